//! One target and one neighbour: who styles the line, whether it is valid, and which of two valid pairs is seen
//! (DESIGN section 3.2). Everything here is shared by the oracle and the search, so they cannot disagree by a rounding.

use std::cmp::Ordering;

use super::differ::Features;
use crate::sample::NodePath;

/// What orders nodes along the line of sight: explicit priority first, then the shorter depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rank {
    pub priority: i32,
    pub depth: f32,
}

impl Rank {
    /// Outranked by all, or equal: that of a miss.
    pub(super) const LAST: Self = Self { priority: i32::MIN, depth: f32::INFINITY };

    #[inline]
    pub(super) fn outranks(self, other: Self) -> bool {
        self.priority > other.priority || (self.priority == other.priority && self.depth < other.depth)
    }

    /// The order in which lines cover each other, the topmost first.
    #[inline]
    pub(super) fn compare(self, other: Self) -> Ordering {
        other.priority.cmp(&self.priority).then(self.depth.total_cmp(&other.depth))
    }

    /// The one that outranks the other.
    #[inline]
    pub(super) fn better(self, other: Self) -> Self {
        if other.outranks(self) { other } else { self }
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
    /// Square of the radius of its line ([`super::Rules::radius`]), 0 if it draws none.
    pub radius_squared: f32,
}

/// The squared distance on the film from a target to a neighbour, in square pixels.
///
/// Whole pixels are subtracted as integers, so a line is drawn alike everywhere in a large picture. Squares are compared
/// instead of distances throughout.
#[inline]
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
    pub tile: usize,
    /// The neighbour's row in its tile.
    pub row: usize,
    /// Whether the target is the priority sample.
    pub own: bool,
}

impl Pair {
    /// Whether this pair is seen rather than another of the same target.
    #[inline]
    pub(super) fn beats(&self, other: &Self) -> bool {
        if self.rank != other.rank {
            return self.rank.outranks(other.rank);
        }
        if self.distance_squared != other.distance_squared {
            return self.distance_squared < other.distance_squared;
        }
        // Rows of a pixel are in the order of its samples.
        let index = |pair: &Self| (pair.pixel[1], pair.pixel[0], pair.row);
        index(self) < index(other)
    }
}

/// The line that a target sees, before styling.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    /// The target's row at the path.
    pub row: usize,
    /// The path.
    pub path: NodePath,
    pub pair: Pair,
}
