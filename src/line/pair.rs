//! One target and one neighbour: who styles the line, whether it is valid, and which of two valid pairs is seen
//! (DESIGN section 3.2). Everything here is shared by the oracle and the search, so they cannot disagree by a rounding.

use std::cmp::Ordering;

use super::differ::{Features, Fired};
use super::overlap::Facet;
use super::window::{PathTile, alpha};
use super::{LineScript, LineType, Rules};
use crate::sample::NodePath;

/// What orders nodes along the line of sight: explicit priority first, then the shorter depth.
///
/// Both in one number, since ranks are compared more often than anything else here: the priority above the depth, each
/// as bits whose order is its own, the topmost node first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Rank(u64);

impl Rank {
    /// Outranked by all, or equal: that of a miss.
    pub(super) const LAST: Self = Self::new(i32::MIN, f32::INFINITY);

    /// Outranks all but nodes of the highest priority there is.
    pub(super) const FIRST: Self = Self(0);

    /// The rank of a node. The depth is not NaN and no negative zero, as behind the gate.
    #[inline(always)]
    pub(super) const fn new(priority: i32, depth: f32) -> Self {
        const SIGN: u32 = 1 << 31;
        let priority = !(priority as u32 ^ SIGN);
        let bits = depth.to_bits();
        let depth = if bits & SIGN == 0 { bits | SIGN } else { !bits };
        Self((priority as u64) << 32 | depth as u64)
    }

    /// The priority as bits: fewer outrank more.
    #[inline(always)]
    pub(super) fn priority_bits(self) -> u32 {
        (self.0 >> 32) as u32
    }

    /// The depth as bits: fewer outrank more.
    #[inline(always)]
    pub(super) fn depth_bits(self) -> u32 {
        self.0 as u32
    }

    #[inline(always)]
    pub(super) fn outranks(self, other: Self) -> bool {
        self.0 < other.0
    }

    /// The one that outranks the other.
    #[inline(always)]
    pub(super) fn better(self, other: Self) -> Self {
        Self(self.0.min(other.0))
    }

    /// The one that is outranked by the other.
    #[inline(always)]
    pub(super) fn worse(self, other: Self) -> Self {
        Self(self.0.max(other.0))
    }
}

/// A node with what the line pass asks of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct LineNode {
    /// The pixel of the picture.
    pub pixel: [i32; 2],
    /// Place in the pixel, each component 0 … 1.
    pub offset: [f32; 2],
    pub features: Features,
    pub rank: Rank,
    /// Square of the radius of its line ([`super::Rules::radius`]) but for what types change, 0 if it draws none.
    pub radius_squared: f32,
}

/// Which type of line a target and a neighbour make, each a tile and a row; `None` if no type changes anything.
pub(super) fn type_of(
    rules: &Rules,
    (targets, row): (&PathTile<'_>, usize),
    (neighbors, neighbor): (&PathTile<'_>, usize),
) -> Option<LineType> {
    rules.types()?;
    let node = |tile: &PathTile<'_>, row: usize| tile.node(tile.buffer.pixel_of(tile.nodes.rows.sample(row)), row);
    let (t, n) = (node(targets, row), node(neighbors, neighbor));
    LineType::of(fired(rules, (targets, row, &t), (neighbors, neighbor, &n)))
}

/// Whether nothing is seen through the line of a pair.
pub(super) fn is_opaque(
    rules: &Rules,
    target: (&PathTile<'_>, usize),
    neighbor: (&PathTile<'_>, usize),
    own: bool,
) -> bool {
    let (nodes, row) = if own { target } else { neighbor };
    // What a script makes of it is not known yet.
    rules.script_of(nodes.nodes.shader.get(row)) != LineScript::Opacity
        && alpha(nodes.nodes, row, type_of(rules, target, neighbor), rules) >= 1.0
}

/// Which tests find a difference between a target and a neighbour, each with its tile and row: those of the priority
/// sample's material decide (DESIGN section 3.2).
pub(super) fn fired(
    rules: &Rules,
    (targets, row, t): (&PathTile<'_>, usize, &LineNode),
    (neighbors, neighbor, n): (&PathTile<'_>, usize, &LineNode),
) -> Fired {
    let own = !n.rank.outranks(t.rank);
    let tests = rules.tests_of(if own { &t.features } else { &n.features }.shader);
    let mut fired = tests.fired(&t.features, &n.features);
    if tests.reads_facets() && t.features.object == n.features.object && !t.features.is_miss() {
        let distance_squared = distance_squared(t, n.pixel, n.offset);
        let overlaps = Facet::of(targets.nodes, row).overlaps(
            &Facet::of(neighbors.nodes, neighbor),
            distance_squared,
            tests.overlap,
        );
        fired.set(Fired::OVERLAP, overlaps);
    }
    fired
}

/// The squared distance on the film from a target to a neighbour, in square pixels.
///
/// Whole pixels are subtracted as integers, so a line is drawn alike everywhere in a large picture. Squares are compared
/// instead of distances throughout.
#[inline(always)]
pub(super) fn distance_squared(target: &LineNode, pixel: [i32; 2], offset: [f32; 2]) -> f32 {
    let along = |axis: usize| (pixel[axis] - target.pixel[axis]) as f32 + (offset[axis] - target.offset[axis]);
    let (x, y) = (along(0), along(1));
    x * x + y * y
}

/// A target's pair with a neighbour that differs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pair {
    /// Of the priority sample.
    pub rank: Rank,
    /// From target to neighbour.
    pub distance_squared: f32,
    /// The neighbour's pixel.
    pub pixel: [i32; 2],
    /// The neighbour's tile in the window.
    pub tile: u32,
    /// The neighbour's row in its tile.
    pub row: u32,
    /// Which surface of the priority sample's list styles the line: 0 for the first.
    pub surface: u32,
    /// Whether the target is the priority sample.
    pub own: bool,
}

impl Pair {
    /// Whether this pair is seen rather than another of the same target.
    #[inline]
    pub(super) fn beats(&self, other: &Self) -> bool {
        self.order(other).is_lt()
    }

    /// The order in which pairs of a target are seen, front to back.
    #[inline]
    pub(super) fn order(&self, other: &Self) -> Ordering {
        // Rows of a pixel are in the order of its samples; the lines of one neighbour come
        // before the target's own, in the order of its list.
        let index = |pair: &Self| (pair.pixel[1], pair.pixel[0], pair.row, pair.own, pair.surface);
        let by_rank = self.rank.cmp(&other.rank);
        // Squares are not NaN and no negative zero.
        let by_key = by_rank.then(self.distance_squared.total_cmp(&other.distance_squared));
        by_key.then_with(|| index(self).cmp(&index(other)))
    }
}

/// The line that a target sees, before styling.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Found {
    /// The target's row at the path.
    pub row: usize,
    /// The path.
    pub path: NodePath,
    pub pair: Pair,
    /// Whether it is the line of a hidden surface, in their style.
    pub hidden: bool,
    /// What is seen through it, front to back, if it is not opaque.
    pub behind: Vec<Pair>,
}

/// Most lines of a sample, one behind the other.
pub(super) const MOST_LINES: usize = 8;

/// The lines of a target that were already seen, from the front. Each surface (object and material) draws or borders at
/// most one of them: an edge is one line, however many pairs see it.
#[derive(Clone, Debug, Default)]
pub(super) struct Taken {
    neighbors: Vec<(u32, u32)>,
    own: bool,
}

impl Taken {
    /// Takes the line of a pair with a neighbour of these features.
    pub(super) fn take(&mut self, neighbor: &Features, own: bool) {
        self.neighbors.push((neighbor.object, neighbor.shader));
        self.own |= own;
    }

    /// Whether a pair belongs to a line that is taken.
    pub(super) fn contains(&self, neighbor: &Features, own: bool) -> bool {
        (own && self.own) || self.neighbors.contains(&(neighbor.object, neighbor.shader))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_are_ordered_by_priority_and_then_by_depth() {
        let descending = [
            (i32::MAX, 0.0),
            (i32::MAX, f32::MAX),
            (1, 5.0),
            (0, -1e9),
            (0, -1.0),
            (0, 0.0),
            (0, 1e-40),
            (0, 1.0),
            (0, 1.000_000_1),
            (0, f32::MAX),
            (-1, 0.0),
            (i32::MIN, 3.0),
            (i32::MIN, f32::INFINITY),
        ]
        .map(|(priority, depth)| Rank::new(priority, depth));
        for (i, a) in descending.iter().enumerate() {
            for (j, b) in descending.iter().enumerate() {
                assert_eq!(a.outranks(*b), i < j, "{i} and {j}");
            }
        }
        assert_eq!(descending[12], Rank::LAST);
        assert!(Rank::FIRST.outranks(descending[0]));
    }
}
