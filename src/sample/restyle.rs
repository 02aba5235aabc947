//! New line and feature attributes for nodes that are there already.

use super::buffer::{Column, Node, SampleBuffer};
use super::builder::SampleLayout;
use super::gate::clean_node;

impl SampleBuffer {
    /// Replaces what the line pass alone reads (feature and line attributes, priority) at some rows, rising, of the path
    /// of this number. The columns are then what they would be had the nodes come like this. Returns whether anything
    /// differs, or `None` if the gate had to stop something, which it would have to count.
    pub(crate) fn restyle(&mut self, path: usize, rows: &[u32], nodes: &[Node], layout: &SampleLayout) -> Option<bool> {
        let kept = layout.columns;
        let mut clean = Vec::with_capacity(nodes.len());
        for node in nodes {
            let (node, faults) = clean_node(*node, kept, layout.max_width_of(node.shader));
            if !faults.is_empty() {
                return None;
            }
            clean.push(node);
        }
        let columns = self.paths.get_mut(path)?;
        let len = columns.rows.len();
        let mut changed = false;
        if kept.feature {
            changed |= replace(&mut columns.feature, len, rows, clean.iter().map(|node| node.feature));
        }
        if kept.lines {
            changed |= replace(&mut columns.line_color, len, rows, clean.iter().map(|node| node.line_color));
            changed |= replace(&mut columns.line_width, len, rows, clean.iter().map(|node| node.line_width));
            changed |= replace(&mut columns.line_opacity, len, rows, clean.iter().map(|node| node.line_opacity));
            changed |= replace(&mut columns.priority, len, rows, clean.iter().map(|node| node.priority));
        }
        Some(changed)
    }
}

/// Replaces values of a column at some rows; whether any differs.
fn replace<T: Copy + PartialEq>(
    column: &mut Column<T>,
    len: usize,
    rows: &[u32],
    values: impl Iterator<Item = T> + Clone,
) -> bool {
    if rows.iter().zip(values.clone()).all(|(row, value)| column.get(*row as usize) == value) {
        return false;
    }
    let mut changes = rows.iter().zip(values).peekable();
    let mut value_at = |row: usize| match changes.next_if(|(changed, _)| **changed as usize == row) {
        Some((_, value)) => value,
        None => column.get(row),
    };
    let mut replaced = Column::Constant(value_at(0));
    for row in 1..len {
        let value = value_at(row);
        replaced.push(row, value, len);
    }
    *column = replaced.ordered(None);
    true
}
