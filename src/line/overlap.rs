//! The overlap test: where an object folds over itself (`[lines] overlap`).
//!
//! Each of two nodes has a tangent plane, that of its triangle on the side that is seen. On a smooth surface both nodes
//! lie on the same side of each other's plane, to third order: below it where the surface bulges, above it in a hollow.
//! Where one part of an object covers another, they do not: the nearer node lies far *above* the plane of the other, which
//! lies *below* the plane of the nearer. So with P positions, N normals towards the viewer, f the width of a pixel at the
//! node where it is wider and d the distance in pixels on the film, two nodes of one object overlap if
//!
//! > max(a, b) > τ · f · max(d, 1) and min(a, b) < 0, with a = N_t · (P_n − P_t) and b = N_n · (P_t − P_n).
//!
//! Objects of one group count as one; a miss takes no part. What follows from it:
//!
//! - Planes, at whatever angle: a = b = 0 but for rounding, 10⁻⁶ of the distance between the nodes. At 89.9° that is
//!   10⁻³ pixels, thousands of times below τ = 2.
//! - Convex shapes, smooth or faceted: no point lies above a tangent plane, so max(a, b) ≤ 0. Neither limbs nor edges
//!   draw, whatever τ is. (The distance to the plane without its sign would not do: near the limb of a sphere of radius R
//!   both are |P_n − P_t|² / 2R, which is x pixels for a sample on the limb and one x pixels from it.)
//! - Hollows and inner edges (a floor and a wall): no point lies below, so min(a, b) ≥ 0, and nothing draws.
//! - A step of height h whose plateaus face the viewer draws if h > τ d, so if it is steeper than atan τ; folds of less
//!   than τ pixels fade out. τ is the only parameter; 2 is a good start.
//! - On the very rim of a fold the nearer plane is seen from its edge and passes beside the farther node: b > 0, as for a
//!   floor and a wall that is seen from its edge, from which one pair alone cannot tell it. Samples there see no line of
//!   this test: on a smooth rim of radius R before a jump of z those within R d² / 2z² pixels of it, on a mesh those on the
//!   outermost facet, seen nearly from its edge. All others find the fold by neighbours further in; on a torus and on a
//!   sheet of waves no sample was found that misses it.
//!
//! In mirrors and glass the same holds with the positions and footprints of what is seen there. Near the focus of a
//! curved mirror the footprint vanishes, and with it the threshold.
//!
//! Both sides of the comparison are the same bits whichever node is the target: swapping them only changes signs.

use crate::sample::NodeColumns;

/// The tangent plane of a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Facet {
    pub position: [f32; 3],
    pub normal: [f32; 3],
    /// World units, ≥ 0.
    pub footprint: f32,
}

impl Facet {
    /// That of a node where no test asks for it.
    pub(super) const NONE: Self = Self { position: [0.0; 3], normal: [0.0; 3], footprint: 0.0 };

    /// Of a row.
    #[inline(always)]
    pub(super) fn of(nodes: &NodeColumns, row: usize) -> Self {
        Self {
            position: nodes.position.get(row),
            normal: nodes.geometric_normal.get(row),
            footprint: nodes.footprint.get(row),
        }
    }

    /// How far another node lies above the plane.
    #[inline(always)]
    fn height_of(&self, other: &Self) -> f32 {
        let along = |axis: usize| self.normal[axis] * (other.position[axis] - self.position[axis]);
        along(0) + along(1) + along(2)
    }

    /// The lower and the higher of the two nodes' heights above each other's plane.
    #[inline(always)]
    fn heights(&self, other: &Self) -> [f32; 2] {
        let (a, b) = (self.height_of(other), other.height_of(self));
        [a.min(b), a.max(b)]
    }

    /// The height that counts as one pixel per pixel.
    #[inline(always)]
    fn unit(&self, other: &Self, distance_squared: f32) -> f32 {
        self.footprint.max(other.footprint) * distance_squared.sqrt().max(1.0)
    }

    /// Whether the two overlap by more than `threshold`. No branches, so that loops over it vectorise.
    #[inline(always)]
    pub(super) fn overlaps(&self, other: &Self, distance_squared: f32, threshold: f32) -> bool {
        let [low, high] = self.heights(other);
        (low < 0.0) & (high > threshold * self.unit(other, distance_squared))
    }

    /// By how much they overlap, for people; 0 if they do not.
    pub(super) fn overlap(&self, other: &Self, distance_squared: f32) -> f32 {
        let [low, high] = self.heights(other);
        let unit = self.unit(other, distance_squared);
        if low < 0.0 && high > 0.0 { high / unit.max(f32::MIN_POSITIVE) } else { 0.0 }
    }
}

/// Bounds of the facets of the hits in a set of nodes: their points lie in a ball around an anchor and between two
/// planes across it, their normals in a ball around one of them.
///
/// Boxes would be no use: a slanted plane fills its box, and then nothing on it can be left out.
#[derive(Clone, Copy, Debug)]
pub(super) struct FacetBounds {
    anchor: [f32; 3],
    normal: [f32; 3],
    /// Largest distance of a point from the anchor; below 0 if there are no points.
    radius: f64,
    /// Largest distance of a normal from `normal`.
    spread: f64,
    /// Least and greatest height of a point above the plane through the anchor.
    heights: [f64; 2],
    /// Least footprint.
    footprint: f32,
}

impl FacetBounds {
    pub(super) const EMPTY: Self = Self {
        anchor: [0.0; 3],
        normal: [0.0; 3],
        radius: -1.0,
        spread: 0.0,
        heights: [0.0; 2],
        footprint: f32::INFINITY,
    };

    /// Bounds of some facets.
    pub(super) fn of(facets: impl Iterator<Item = Facet>) -> Self {
        let mut bounds = Self::EMPTY;
        for facet in facets {
            if bounds.radius < 0.0 {
                (bounds.anchor, bounds.normal, bounds.radius) = (facet.position, facet.normal, 0.0);
            }
            let from_anchor = difference(facet.position, bounds.anchor);
            let height = dot(wide(bounds.normal), from_anchor);
            bounds.radius = bounds.radius.max(length(from_anchor));
            bounds.spread = bounds.spread.max(length(difference(facet.normal, bounds.normal)));
            bounds.heights = [bounds.heights[0].min(height), bounds.heights[1].max(height)];
            bounds.footprint = bounds.footprint.min(facet.footprint);
        }
        bounds
    }

    /// Bounds of several sets. The middle one's anchor is the best for all.
    pub(super) fn of_all(sets: &[Self]) -> Self {
        let middle = sets.get(sets.len() / 2).copied().unwrap_or(Self::EMPTY);
        sets.iter().fold(middle, |all, one| all.union(one))
    }

    pub(super) fn union(&self, other: &Self) -> Self {
        if self.radius < 0.0 || other.radius < 0.0 {
            return if self.radius < 0.0 { *other } else { *self };
        }
        let apart = difference(other.anchor, self.anchor);
        let turned = length(difference(other.normal, self.normal));
        let height = dot(wide(self.normal), apart);
        let sway = turned * other.radius;
        Self {
            radius: self.radius.max(length(apart) + other.radius),
            spread: self.spread.max(turned + other.spread),
            heights: [
                self.heights[0].min(height + other.heights[0] - sway),
                self.heights[1].max(height + other.heights[1] + sway),
            ],
            footprint: self.footprint.min(other.footprint),
            ..*self
        }
    }

    /// Whether a facet here and one there, at least so far apart on the film, may overlap by more than `threshold`.
    pub(super) fn may_overlap(&self, other: &Self, gap_squared: f32, threshold: f32) -> bool {
        // Roundings of all that is compared, relative to the largest distance; what underflows is far below the last.
        const SLACK: f64 = 1e-6;
        const LEAST: f64 = 1e-36;
        if self.radius < 0.0 || other.radius < 0.0 {
            return false;
        }
        let footprint = f64::from(self.footprint.max(other.footprint));
        let least = f64::from(threshold) * footprint * f64::from(gap_squared).sqrt().max(1.0) * (1.0 - SLACK);
        let apart = difference(other.anchor, self.anchor);
        let farthest = length(apart) + self.radius + other.radius;
        let turned = length(difference(other.normal, self.normal));
        let slack = SLACK * farthest + LEAST;
        // With P = anchor + p and N = normal + e: N · (P' − P) = normal · apart + normal' · p' + (normal − normal') · p'
        // − normal · p + e · (P' − P).
        let heights_of = |from: &Self, to: &Self, apart: f64| {
            let sway = turned * to.radius + from.spread * farthest + slack;
            [apart + to.heights[0] - from.heights[1] - sway, apart + to.heights[1] - from.heights[0] + sway]
        };
        let there = heights_of(self, other, dot(wide(self.normal), apart));
        let here = heights_of(other, self, -dot(wide(other.normal), apart));
        (there[1] > least && here[0] < 0.0) || (here[1] > least && there[0] < 0.0)
    }
}

/// Facets in columns; see [`super::lanes`].
#[derive(Debug, Default)]
pub(super) struct FacetColumns {
    position: [Vec<f32>; 3],
    normal: [Vec<f32>; 3],
    footprint: Vec<f32>,
}

impl FacetColumns {
    pub(super) fn push(&mut self, facet: &Facet) {
        for axis in 0..3 {
            self.position[axis].push(facet.position[axis]);
            self.normal[axis].push(facet.normal[axis]);
        }
        self.footprint.push(facet.footprint);
    }

    pub(super) fn columns(&mut self) -> impl Iterator<Item = &mut Vec<f32>> {
        self.position.iter_mut().chain(&mut self.normal).chain([&mut self.footprint])
    }

    /// The first `count` rows.
    #[inline(always)]
    pub(super) fn rows(&self, count: usize) -> FacetRows<'_> {
        FacetRows {
            position: self.position.each_ref().map(|column| &column[..count]),
            normal: self.normal.each_ref().map(|column| &column[..count]),
            footprint: &self.footprint[..count],
        }
    }
}

/// Rows of [`FacetColumns`].
#[derive(Clone, Copy)]
pub(super) struct FacetRows<'a> {
    position: [&'a [f32]; 3],
    normal: [&'a [f32]; 3],
    footprint: &'a [f32],
}

impl FacetRows<'_> {
    #[inline(always)]
    pub(super) fn get(&self, row: usize) -> Facet {
        Facet {
            position: [self.position[0][row], self.position[1][row], self.position[2][row]],
            normal: [self.normal[0][row], self.normal[1][row], self.normal[2][row]],
            footprint: self.footprint[row],
        }
    }
}

fn wide(a: [f32; 3]) -> [f64; 3] {
    a.map(f64::from)
}

fn difference(a: [f32; 3], b: [f32; 3]) -> [f64; 3] {
    let (a, b) = (wide(a), wide(b));
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn length(a: [f64; 3]) -> f64 {
    dot(a, a).sqrt()
}
