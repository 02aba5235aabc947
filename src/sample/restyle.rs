//! New line and feature attributes for nodes that are there already.

use super::buffer::{Column, Node, NodeColumnSet, SampleBuffer};
use super::builder::SampleLayout;
use super::gate::clean_node;

impl SampleBuffer {
    /// Replaces what the line pass alone reads (feature and line attributes, priority) at some rows, rising, of the path
    /// of this number and a place in its lists, 0 for the first surfaces. The new ones are those of `styles`, by row or
    /// as `style_of` says. The columns are then what they would be had the nodes come like this. Returns whether
    /// anything differs, or `None` if the gate had to stop something, which it would have to count.
    pub(crate) fn restyle(
        &mut self,
        (path, place): (usize, usize),
        rows: &[u32],
        (styles, style_of): (&[Node], Option<&[u32]>),
        layout: &SampleLayout,
    ) -> Option<bool> {
        let NodeColumnSet { feature, lines, .. } = layout.columns;
        // All else of the nodes has passed the gate before.
        let kept = NodeColumnSet { feature, lines, ..NodeColumnSet::default() };
        let mut clean = Vec::with_capacity(styles.len());
        for style in styles {
            let (style, faults) = clean_node(Node { depth: 0.0, ..*style }, kept, layout.max_width_of(style.shader));
            if !faults.is_empty() {
                return None;
            }
            clean.push(style);
        }
        let columns = self.paths.get_mut(path)?;
        let columns = match place {
            0 => columns,
            _ => columns.behind.get_mut(place - 1)?,
        };
        let len = columns.rows.len();
        let new = (0..rows.len()).map(|index| &clean[style_of.map_or(index, |style_of| style_of[index] as usize)]);
        let mut changed = false;
        if feature {
            changed |= replace(&mut columns.feature, len, rows, new.clone().map(|node| node.feature));
        }
        if lines {
            changed |= replace(&mut columns.line_color, len, rows, new.clone().map(|node| node.line_color));
            changed |= replace(&mut columns.line_width, len, rows, new.clone().map(|node| node.line_width));
            changed |= replace(&mut columns.line_opacity, len, rows, new.clone().map(|node| node.line_opacity));
            changed |= replace(&mut columns.priority, len, rows, new.map(|node| node.priority));
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
