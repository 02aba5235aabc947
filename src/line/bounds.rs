//! What is known of a pixel's, a block's and a tile's nodes without looking at them: the search rejects with it.
//!
//! All bounds are exact in the sense that matters: floating-point subtraction, multiplication and addition of
//! non-negative numbers are monotone, so a test that does not exceed its threshold for the corners of two boxes does not
//! exceed it for any two points in them either, roundings included. No epsilon is needed anywhere.

use super::differ::{Features, Tests};
use super::pair::Rank;
use super::rules::Rules;
use super::window::features;
use crate::sample::{Column, NodeColumns, NodePath, PixelRect, SampleBuffer};

/// Side of a block in pixels.
const BLOCK: usize = 8;

/// What the line pass knows of a tile of samples before it starts. Made once per tile, when it has been traced.
#[derive(Clone, Debug)]
pub struct TileBounds {
    /// The paths that draw lines, in order.
    paths: Vec<PathBounds>,
}

impl TileBounds {
    /// Bounds of a buffer, for these rules.
    #[must_use]
    pub fn new(buffer: &SampleBuffer, rules: &Rules) -> Self {
        let drawn = buffer.paths.iter().filter(|nodes| rules.draws(nodes.path));
        Self { paths: drawn.map(|nodes| PathBounds::new(buffer, nodes, rules)).collect() }
    }

    pub(super) fn at_path(&self, path: NodePath) -> Option<&PathBounds> {
        self.paths.binary_search_by_key(&path, |bounds| bounds.path).ok().map(|found| &self.paths[found])
    }

    /// Bytes of heap memory.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let of_path = |path: &PathBounds| {
            path.radius_squared.bytes() + size_of_val(&path.pixels[..]) + size_of_val(&path.blocks[..])
        };
        self.paths.iter().map(|path| size_of::<PathBounds>() + of_path(path)).sum()
    }
}

/// Smallest and largest value per component; empty if low is above high.
#[derive(Clone, Copy, Debug)]
struct Extent<const N: usize> {
    low: [f32; N],
    high: [f32; N],
}

impl<const N: usize> Extent<N> {
    const EMPTY: Self = Self { low: [f32::INFINITY; N], high: [f32::NEG_INFINITY; N] };

    fn point(value: [f32; N]) -> Self {
        Self { low: value, high: value }
    }

    fn union(&self, other: &Self) -> Self {
        let mut union = *self;
        for i in 0..N {
            union.low[i] = self.low[i].min(other.low[i]);
            union.high[i] = self.high[i].max(other.high[i]);
        }
        union
    }

    /// The largest difference of a component between a point here and one there; 0 if either is empty.
    #[inline]
    fn largest_difference(&self, other: &Self, i: usize) -> f32 {
        (self.high[i] - other.low[i]).max(other.high[i] - self.low[i]).max(0.0)
    }

    /// The largest squared distance between a point here and one there; 0 if either is empty.
    #[inline]
    fn largest_distance_squared(&self, other: &Self) -> f32 {
        let mut sum = 0.0;
        for i in 0..N {
            let difference = self.largest_difference(other, i);
            sum += difference * difference;
        }
        sum
    }
}

/// Bounds of a set of nodes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    /// Smallest and largest.
    object: [u32; 2],
    /// Smallest and largest.
    shader: [u32; 2],
    /// Of hits, as the next two.
    uv: Extent<2>,
    normal: Extent<3>,
    feature: Extent<3>,
    /// The highest rank of a node that draws a line, or [`Rank::LAST`].
    pub best: Rank,
    /// The lowest rank of any node.
    pub worst: Rank,
    /// The widest line's.
    pub radius_squared: f32,
}

impl Bounds {
    const EMPTY: Self = Self {
        object: [u32::MAX, 0],
        shader: [u32::MAX, 0],
        uv: Extent::EMPTY,
        normal: Extent::EMPTY,
        feature: Extent::EMPTY,
        best: Rank::LAST,
        worst: Rank { priority: i32::MAX, depth: f32::NEG_INFINITY },
        radius_squared: 0.0,
    };

    /// The bounds of one node.
    #[inline]
    pub(super) fn of_node(features: &Features, rank: Rank, radius_squared: f32) -> Self {
        let mut bounds = Self {
            object: [features.object; 2],
            shader: [features.shader; 2],
            best: if radius_squared > 0.0 { rank } else { Rank::LAST },
            worst: rank,
            radius_squared,
            ..Self::EMPTY
        };
        if !features.is_miss() {
            bounds.uv = Extent::point(features.uv);
            bounds.normal = Extent::point(features.normal);
            bounds.feature = Extent::point(features.feature);
        }
        bounds
    }

    #[inline]
    fn union(&self, other: &Self) -> Self {
        let range = |a: [u32; 2], b: [u32; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        Self {
            object: range(self.object, other.object),
            shader: range(self.shader, other.shader),
            uv: self.uv.union(&other.uv),
            normal: self.normal.union(&other.normal),
            feature: self.feature.union(&other.feature),
            best: self.best.better(other.best),
            worst: if self.worst.outranks(other.worst) { other.worst } else { self.worst },
            radius_squared: self.radius_squared.max(other.radius_squared),
        }
    }

    /// Whether a node here and one there may differ.
    #[inline]
    pub(super) fn may_differ(&self, other: &Self, tests: &Tests) -> bool {
        let uniform = |a: [u32; 2], b: [u32; 2]| a[0] == a[1] && b == a;
        (tests.object && !uniform(self.object, other.object))
            || (tests.shader && !uniform(self.shader, other.shader))
            || (tests.uv_squared < f32::INFINITY && self.uv.largest_distance_squared(&other.uv) > tests.uv_squared)
            || (tests.chord_squared < f32::INFINITY
                && self.normal.largest_distance_squared(&other.normal) > tests.chord_squared)
            || (tests.feature < f32::INFINITY
                && (0..3).any(|i| self.feature.largest_difference(&other.feature, i) > tests.feature))
    }
}

/// A pixel that has nodes at a path.
#[derive(Clone, Copy, Debug)]
pub(super) struct PixelNodes {
    /// The pixel of the picture.
    pub pixel: [i32; 2],
    /// Its first row.
    pub first: u32,
    /// One past its last row.
    pub end: u32,
    pub bounds: Bounds,
}

/// A square of pixels some of which have nodes at a path.
#[derive(Clone, Debug)]
pub(super) struct Block {
    /// The pixels of the picture, whether they have nodes or not.
    pub rect: PixelRect,
    pub bounds: Bounds,
    /// Its first pixel in [`PathBounds::pixels`].
    first: usize,
    /// One past its last.
    end: usize,
}

/// Bounds of a tile at one path. Pixels without nodes take no memory: deep paths have few.
#[derive(Clone, Debug)]
pub(super) struct PathBounds {
    path: NodePath,
    /// Square of the radius of each row's line, 0 if it draws none.
    pub radius_squared: Column<f32>,
    /// The whole tile's.
    pub bounds: Bounds,
    /// Blocks that have nodes, row by row.
    pub blocks: Vec<Block>,
    /// The blocks' pixels, block by block, in each by best rank: the search cuts off at the first that is too low.
    pixels: Vec<PixelNodes>,
}

impl PathBounds {
    fn new(buffer: &SampleBuffer, nodes: &NodeColumns, rules: &Rules) -> Self {
        let radius_squared = radii_squared(&nodes.line_width, rules);
        let rect = buffer.rect;
        let (mut blocks, mut pixels) = (Vec::new(), Vec::new());
        for y0 in (rect.y0..rect.y1).step_by(BLOCK) {
            for x0 in (rect.x0..rect.x1).step_by(BLOCK) {
                let block = PixelRect { x0, y0, x1: x0 + BLOCK as i32, y1: y0 + BLOCK as i32 }.intersection(&rect);
                let first = pixels.len();
                for y in block.y0..block.y1 {
                    for pixel in (block.x0..block.x1).map(|x| [x, y]) {
                        let rows = nodes.rows(buffer.pixel_number(pixel));
                        if rows.is_empty() {
                            continue;
                        }
                        let (first, end) = (rows.start as u32, rows.end as u32);
                        let bounds = rows
                            .map(|row| {
                                let rank = Rank { priority: nodes.priority.get(row), depth: nodes.depth.get(row) };
                                Bounds::of_node(&features(nodes, row), rank, radius_squared.get(row))
                            })
                            .fold(Bounds::EMPTY, |all, one| all.union(&one));
                        pixels.push(PixelNodes { pixel, first, end, bounds });
                    }
                }
                if pixels.len() > first {
                    let bounds = pixels[first..].iter().fold(Bounds::EMPTY, |all, pixel| all.union(&pixel.bounds));
                    pixels[first..].sort_by(|a, b| a.bounds.best.compare(b.bounds.best));
                    blocks.push(Block { rect: block, bounds, first, end: pixels.len() });
                }
            }
        }
        let bounds = blocks.iter().fold(Bounds::EMPTY, |all, block: &Block| all.union(&block.bounds));
        Self { path: nodes.path, radius_squared, bounds, blocks, pixels }
    }

    pub(super) fn pixels(&self, block: &Block) -> &[PixelNodes] {
        &self.pixels[block.first..block.end]
    }
}

/// The squared radius of each row's line. Widths mostly come in runs.
fn radii_squared(widths: &Column<f32>, rules: &Rules) -> Column<f32> {
    let squared = |width: f32| rules.radius(width) * rules.radius(width);
    match widths {
        Column::Constant(width) => Column::Constant(squared(*width)),
        Column::Values(widths) => {
            let mut last = (0.0, squared(0.0));
            let of = |&width: &f32| {
                if width != last.0 {
                    last = (width, squared(width));
                }
                last.1
            };
            Column::Values(widths.iter().map(of).collect())
        }
    }
}
