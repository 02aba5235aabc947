//! New line and feature attributes for nodes that are there already, and what of samples a change of light leaves alone.

use super::buffer::{Column, Node, NodeColumnSet, NodeColumns, SampleBuffer};
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
            let mut style = Node { depth: 0.0, ..*style };
            let faults = clean_node(&mut style, kept, layout);
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

impl SampleBuffer {
    /// Whether the nodes are those of another buffer of the same rectangle, but for how much light they pass on.
    pub(crate) fn same_nodes(&self, other: &Self) -> bool {
        same_nodes(&self.paths, &other.paths)
    }

    /// Whether the samples look alike before lines.
    pub(crate) fn same_colors(&self, other: &Self) -> bool {
        self.color == other.color && self.alpha == other.alpha
    }
}

fn same_nodes(all: &[NodeColumns], others: &[NodeColumns]) -> bool {
    let same = |(a, b): (&NodeColumns, &NodeColumns)| {
        let NodeColumns {
            path,
            rows,
            object,
            member,
            shader,
            uv,
            normal,
            feature,
            depth,
            line_color,
            line_width,
            line_opacity,
            priority,
            position,
            geometric_normal,
            footprint,
            throughput: _,
            contribution: _,
            behind,
        } = a;
        *path == b.path
            && *rows == b.rows
            && *object == b.object
            && *member == b.member
            && *shader == b.shader
            && *uv == b.uv
            && *normal == b.normal
            && *feature == b.feature
            && *depth == b.depth
            && *line_color == b.line_color
            && *line_width == b.line_width
            && *line_opacity == b.line_opacity
            && *priority == b.priority
            && *position == b.position
            && *geometric_normal == b.geometric_normal
            && *footprint == b.footprint
            && same_nodes(behind, &b.behind)
    };
    all.len() == others.len() && all.iter().zip(others).all(same)
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
