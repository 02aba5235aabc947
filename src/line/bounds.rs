//! What is known of a pixel's, a block's and a tile's nodes without looking at them: the search decides most with it.
//!
//! All bounds are exact in the sense that matters: floating-point subtraction, multiplication and addition of
//! non-negative numbers are monotone, so a test that does not exceed its threshold for the corners of two boxes does not
//! exceed it for any two points in them either, and one that exceeds it for their nearest points exceeds it for all,
//! roundings included. No epsilon is needed anywhere.
//!
//! Bounds of uv, normals and feature colours ([`Shape`]) lie apart from the others ([`Bounds`]) and exist only where a
//! test reads them: what is scanned most stays small.

use super::differ::Tests;
use super::list::bounds::LayerBounds;
use super::overlap::{Facet, FacetBounds};
use super::pair::Rank;
use super::rules::Rules;
use super::window::style;
use crate::sample::{Column, NodeColumns, NodePath, PixelRect, SampleBuffer};

/// Side of a block in pixels.
const BLOCK: i32 = 8;

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
            path.radius_squared.bytes()
                + size_of_val(&path.pixels[..])
                + size_of_val(&path.shapes[..])
                + size_of_val(&path.facets[..])
                + size_of_val(&path.by_rank[..])
                + size_of_val(&path.blocks[..])
                + path.behind.iter().map(LayerBounds::bytes).sum::<usize>()
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

    #[inline]
    fn point(value: [f32; N]) -> Self {
        Self { low: value, high: value }
    }

    #[inline]
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

    /// The smallest one. Both must hold a point.
    #[inline]
    fn smallest_difference(&self, other: &Self, i: usize) -> f32 {
        (self.low[i] - other.high[i]).max(other.low[i] - self.high[i]).max(0.0)
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

    /// The smallest one. Both must hold a point.
    #[inline]
    fn smallest_distance_squared(&self, other: &Self) -> f32 {
        let mut sum = 0.0;
        for i in 0..N {
            let difference = self.smallest_difference(other, i);
            sum += difference * difference;
        }
        sum
    }
}

/// Bounds of the feature attributes of the hits in a set of nodes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    uv: Extent<2>,
    normal: Extent<3>,
    feature: Extent<3>,
}

impl Shape {
    pub(super) const EMPTY: Self = Self { uv: Extent::EMPTY, normal: Extent::EMPTY, feature: Extent::EMPTY };

    #[inline]
    pub(super) fn union(&self, other: &Self) -> Self {
        Self {
            uv: self.uv.union(&other.uv),
            normal: self.normal.union(&other.normal),
            feature: self.feature.union(&other.feature),
        }
    }

    /// The least and the greatest squared distance of texture coordinates that hits here and there may have.
    pub(super) fn uv_squared_range(&self, other: &Self) -> [f32; 2] {
        [self.uv.smallest_distance_squared(&other.uv), self.uv.largest_distance_squared(&other.uv)]
    }

    /// The same of normals.
    pub(super) fn chord_squared_range(&self, other: &Self) -> [f32; 2] {
        [self.normal.smallest_distance_squared(&other.normal), self.normal.largest_distance_squared(&other.normal)]
    }

    /// The same of the largest difference of a channel.
    pub(super) fn feature_range(&self, other: &Self) -> [f32; 2] {
        let largest = |of: fn(&Extent<3>, &Extent<3>, usize) -> f32| {
            (0..3).map(|i| of(&self.feature, &other.feature, i)).fold(0.0, f32::max)
        };
        [largest(Extent::smallest_difference), largest(Extent::largest_difference)]
    }

    /// Whether hits here and there may differ.
    #[inline]
    fn may_differ(&self, other: &Self, tests: &Tests) -> bool {
        (tests.uv_squared < f32::INFINITY && self.uv.largest_distance_squared(&other.uv) > tests.uv_squared)
            || (tests.chord_squared < f32::INFINITY
                && self.normal.largest_distance_squared(&other.normal) > tests.chord_squared)
            || (tests.feature < f32::INFINITY
                && (0..3).any(|i| self.feature.largest_difference(&other.feature, i) > tests.feature))
    }

    /// Whether all hits here differ from all there. Both must hold a hit.
    #[inline]
    fn must_differ(&self, other: &Self, tests: &Tests) -> bool {
        (tests.uv_squared < f32::INFINITY && self.uv.smallest_distance_squared(&other.uv) > tests.uv_squared)
            || (tests.chord_squared < f32::INFINITY
                && self.normal.smallest_distance_squared(&other.normal) > tests.chord_squared)
            || (tests.feature < f32::INFINITY
                && (0..3).any(|i| self.feature.smallest_difference(&other.feature, i) > tests.feature))
    }
}

/// Bounds of a set of nodes, but for their [`Shape`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    /// Smallest and largest.
    pub object: [u32; 2],
    /// Smallest and largest.
    shader: [u32; 2],
    /// The highest rank of a node that draws a line, or [`Rank::LAST`].
    pub best: Rank,
    /// The highest rank of any node.
    pub highest: Rank,
    /// The lowest rank of any node.
    pub lowest: Rank,
    /// The widest line's.
    pub radius_squared: f32,
    /// The thinnest line's; ∞ if there is no line.
    pub thinnest_squared: f32,
    /// Whose style the lines have.
    pub stylist: Stylist,
}

/// The style of the lines of a set of nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stylist {
    /// There are no lines.
    None,
    /// All have that of this row and are opaque.
    Alike(u32),
    /// They have several.
    Many,
}

impl Bounds {
    /// Smallest and largest `shader` value.
    #[inline]
    pub(super) fn shaders(&self) -> [u32; 2] {
        self.shader
    }

    /// Whether some object may be both here and there.
    pub(super) fn may_share_object(&self, other: &Self) -> bool {
        self.object[0] <= other.object[1] && other.object[0] <= self.object[1] && self.object[1] > 0
    }

    pub(super) const EMPTY: Self = Self {
        object: [u32::MAX, 0],
        shader: [u32::MAX, 0],
        best: Rank::LAST,
        highest: Rank::LAST,
        lowest: Rank::FIRST,
        radius_squared: 0.0,
        thinnest_squared: f32::INFINITY,
        stylist: Stylist::None,
    };

    #[inline]
    pub(super) fn union(&self, other: &Self, nodes: &NodeColumns, rules: &Rules) -> Self {
        let range = |a: [u32; 2], b: [u32; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        Self {
            object: range(self.object, other.object),
            shader: range(self.shader, other.shader),
            best: self.best.better(other.best),
            highest: self.highest.better(other.highest),
            lowest: self.lowest.worse(other.lowest),
            radius_squared: self.radius_squared.max(other.radius_squared),
            thinnest_squared: self.thinnest_squared.min(other.thinnest_squared),
            stylist: match (self.stylist, other.stylist) {
                (Stylist::None, one) | (one, Stylist::None) => one,
                (Stylist::Alike(a), Stylist::Alike(b))
                    if style(nodes, a as usize, rules) == style(nodes, b as usize, rules) =>
                {
                    Stylist::Alike(a)
                }
                _ => Stylist::Many,
            },
        }
    }
}

/// Bounds with a shape and facets, which are empty where no test reads them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounded<'a> {
    pub bounds: &'a Bounds,
    pub shape: &'a Shape,
    pub facets: &'a FacetBounds,
}

impl Bounded<'_> {
    /// Whether a node here and one there, at least so far apart on the film, may differ.
    #[inline]
    pub(super) fn may_differ(&self, other: &Bounded<'_>, gap_squared: f32, tests: &Tests) -> bool {
        let uniform = |a: [u32; 2], b: [u32; 2]| a[0] == a[1] && b == a;
        (tests.object && !uniform(self.bounds.object, other.bounds.object))
            || (tests.shader && !uniform(self.bounds.shader, other.bounds.shader))
            || (tests.reads_shapes && self.shape.may_differ(other.shape, tests))
            || (tests.reads_facets()
                && self.bounds.may_share_object(other.bounds)
                && self.facets.may_overlap(other.facets, gap_squared, tests.overlap))
    }

    /// Whether all nodes here surely differ from all there.
    #[inline]
    pub(super) fn must_differ(&self, other: &Bounded<'_>, tests: &Tests) -> bool {
        let apart = |a: [u32; 2], b: [u32; 2]| a[1] < b[0] || b[1] < a[0];
        let all_hits = self.bounds.object[0] > 0 && other.bounds.object[0] > 0;
        (tests.object && apart(self.bounds.object, other.bounds.object))
            || (tests.shader && apart(self.bounds.shader, other.bounds.shader))
            || (tests.reads_shapes && all_hits && self.shape.must_differ(other.shape, tests))
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
    shape: Shape,
    facets: FacetBounds,
    /// Its first pixel in [`PathBounds::pixels`].
    pub first: u32,
    /// One past its last.
    pub end: u32,
}

impl Block {
    #[inline]
    pub(super) fn bounded(&self) -> Bounded<'_> {
        Bounded { bounds: &self.bounds, shape: &self.shape, facets: &self.facets }
    }

    /// The places of its pixels in a rectangle, if all its pixels have nodes and not all of them lie there; else `None`.
    #[inline]
    pub(super) fn part(&self, rect: &PixelRect) -> Option<impl Iterator<Item = u32> + use<>> {
        let part = rect.intersection(&self.rect);
        let is_full = (self.end - self.first) as usize == self.rect.pixels();
        let (x, y, width) = (part.x0 - self.rect.x0, part.y0 - self.rect.y0, self.rect.width());
        (is_full && part.pixels() < self.rect.pixels()).then(|| {
            let first = self.first + y as u32 * width + x as u32;
            let (columns, rows) = (part.width(), part.height());
            (0..rows).flat_map(move |row| (0..columns).map(move |column| first + row * width + column))
        })
    }
}

/// Bounds of a tile at one path. Pixels without nodes take no memory: deep paths have few.
#[derive(Clone, Debug)]
pub(super) struct PathBounds {
    path: NodePath,
    /// Square of the radius of each row's line, 0 if it draws none.
    pub radius_squared: Column<f32>,
    /// The whole tile's.
    bounds: Bounds,
    shape: Shape,
    facets_of_all: FacetBounds,
    /// Blocks that have nodes, row by row.
    pub blocks: Vec<Block>,
    /// The blocks' pixels, block by block, in each row by row.
    pub pixels: Vec<PixelNodes>,
    /// Of the same pixels; nothing where no test reads it.
    shapes: Vec<Shape>,
    /// The same.
    facets: Vec<FacetBounds>,
    /// For each block its pixels from the highest best rank down, counted from its first: the search cuts off at the
    /// first that is too low.
    pub by_rank: Vec<u8>,
    /// What is known of the surfaces behind, by place in their lists.
    pub behind: Vec<LayerBounds>,
}

impl PathBounds {
    fn new(buffer: &SampleBuffer, nodes: &NodeColumns, rules: &Rules) -> Self {
        let mut all = Self {
            path: nodes.path,
            radius_squared: radii_squared(&nodes.line_width, rules),
            bounds: Bounds::EMPTY,
            shape: Shape::EMPTY,
            facets_of_all: FacetBounds::EMPTY,
            blocks: Vec::new(),
            pixels: Vec::new(),
            shapes: Vec::new(),
            facets: Vec::new(),
            by_rank: Vec::new(),
            behind: Vec::new(),
        };
        let rect = buffer.rect;
        // Of misses, all pixels have the same bounds.
        let all_miss = matches!(nodes.object, Column::Constant(0)) && !nodes.rows.is_empty();
        let of_misses = all_miss.then(|| of_rows(&all.radius_squared, nodes, 0, 1, rules));
        for y0 in (rect.y0..rect.y1).step_by(BLOCK as usize) {
            for x0 in (rect.x0..rect.x1).step_by(BLOCK as usize) {
                let block = PixelRect { x0, y0, x1: x0 + BLOCK, y1: y0 + BLOCK }.intersection(&rect);
                all.add_block(block, buffer, (nodes, of_misses.as_ref()), rules);
            }
        }
        let layers = nodes.behind.iter().take(rules.surfaces().saturating_sub(1));
        all.behind = layers.map(|layer| LayerBounds::new(&all, buffer, layer, rules)).collect();
        all
    }

    fn add_block(
        &mut self,
        rect: PixelRect,
        buffer: &SampleBuffer,
        (nodes, of_misses): (&NodeColumns, Option<&Bounds>),
        rules: &Rules,
    ) {
        let tests = rules.tests();
        let first = self.pixels.len();
        for y in rect.y0..rect.y1 {
            for pixel in (rect.x0..rect.x1).map(|x| [x, y]) {
                let rows = nodes.rows.of_pixel(buffer.pixel_number(pixel));
                if rows.is_empty() {
                    continue;
                }
                let (start, end) = (rows.start, rows.end);
                let (first, last) = (start as u32, end as u32);
                self.pixels.push(PixelNodes {
                    pixel,
                    first,
                    end: last,
                    bounds: match of_misses {
                        Some(bounds) => *bounds,
                        None => of_rows(&self.radius_squared, nodes, start, end, rules),
                    },
                });
                if tests.reads_shapes {
                    self.shapes.push(shape_of_rows(nodes, start, end, tests));
                }
                if tests.reads_facets() {
                    let hits = (start..end).filter(|row| nodes.object.get(*row) != 0);
                    self.facets.push(FacetBounds::of(hits.map(|row| Facet::of(nodes, row))));
                }
            }
        }
        let pixels = &self.pixels[first..];
        if pixels.is_empty() {
            return;
        }
        let of_all = || pixels.iter().fold(Bounds::EMPTY, |all, pixel| all.union(&pixel.bounds, nodes, rules));
        let bounds = of_misses.copied().unwrap_or_else(of_all);
        let shape = self.shapes.get(first..).unwrap_or_default().iter().fold(Shape::EMPTY, |all, one| all.union(one));
        let facets = FacetBounds::of_all(self.facets.get(first..).unwrap_or_default());
        let start = self.by_rank.len();
        self.by_rank.extend((0..).take(pixels.len()).map(|index: u8| index));
        self.by_rank[start..].sort_unstable_by_key(|&index| (pixels[usize::from(index)].bounds.best, index));
        self.bounds = self.bounds.union(&bounds, nodes, rules);
        self.shape = self.shape.union(&shape);
        self.facets_of_all = self.facets_of_all.union(&facets);
        self.blocks.push(Block { rect, bounds, shape, facets, first: first as u32, end: self.pixels.len() as u32 });
    }

    pub(super) fn bounded(&self) -> Bounded<'_> {
        Bounded { bounds: &self.bounds, shape: &self.shape, facets: &self.facets_of_all }
    }

    /// The bounds of a pixel, by its place in [`Self::pixels`].
    #[inline]
    pub(super) fn of_pixel(&self, place: usize) -> Bounded<'_> {
        Bounded {
            bounds: &self.pixels[place].bounds,
            shape: self.shapes.get(place).unwrap_or(&Shape::EMPTY),
            facets: self.facets.get(place).unwrap_or(&FacetBounds::EMPTY),
        }
    }
}

/// The bounds of some rows. Column by column: most are constant.
pub(super) fn of_rows(
    radii_squared: &Column<f32>,
    nodes: &NodeColumns,
    first: usize,
    end: usize,
    rules: &Rules,
) -> Bounds {
    let mut bounds = Bounds { object: range(&nodes.object, first, end), ..Bounds::EMPTY };
    bounds.shader = range(&nodes.shader, first, end);
    if let (Column::Constant(priority), Column::Values(depths)) = (&nodes.priority, &nodes.depth) {
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        for &depth in &depths[first..end] {
            low = low.min(depth);
            high = high.max(depth);
        }
        bounds.highest = Rank::new(*priority, low);
        bounds.lowest = Rank::new(*priority, high);
    } else {
        for row in first..end {
            let rank = Rank::new(nodes.priority.get(row), nodes.depth.get(row));
            bounds.highest = bounds.highest.better(rank);
            bounds.lowest = bounds.lowest.worse(rank);
        }
    }
    let (mut narrow, mut wide) = (f32::INFINITY, 0.0_f32);
    match radii_squared {
        Column::Constant(radius) => (narrow, wide) = (*radius, *radius),
        radii => {
            for radius in (first..end).map(|row| radii.get(row)) {
                narrow = narrow.min(radius);
                wide = wide.max(radius);
            }
        }
    }
    bounds.radius_squared = rules.widest_squared(wide);
    if narrow > 0.0 {
        bounds.best = bounds.highest;
        bounds.thinnest_squared = narrow;
    } else if wide > 0.0 {
        for row in first..end {
            let radius = radii_squared.get(row);
            if radius > 0.0 {
                bounds.best = bounds.best.better(Rank::new(nodes.priority.get(row), nodes.depth.get(row)));
                bounds.thinnest_squared = bounds.thinnest_squared.min(radius);
            }
        }
    }
    if bounds.thinnest_squared < f32::INFINITY {
        bounds.thinnest_squared = rules.thinnest_squared(bounds.thinnest_squared);
    }
    bounds.stylist = stylist(radii_squared, nodes, first, end, rules);
    bounds
}

fn stylist(radii_squared: &Column<f32>, nodes: &NodeColumns, first: usize, end: usize, rules: &Rules) -> Stylist {
    let Some(row) = (first..end).find(|row| radii_squared.get(*row) > 0.0) else { return Stylist::None };
    let own = style(nodes, row, rules);
    // What is seen through a line depends on the pair.
    let opaque = own.is_opaque(rules);
    let alike = match (&nodes.line_color, &nodes.line_width, &nodes.line_opacity) {
        (Column::Constant(_), Column::Constant(_), Column::Constant(_)) if rules.no_scripts() => opaque,
        _ => {
            let mut others = (row + 1..end).filter(|row| radii_squared.get(*row) > 0.0);
            opaque && others.all(|row| style(nodes, row, rules) == own)
        }
    };
    if alike { Stylist::Alike(row as u32) } else { Stylist::Many }
}

/// Smallest and largest id of some rows.
fn range(ids: &Column<u32>, first: usize, end: usize) -> [u32; 2] {
    match ids {
        Column::Constant(id) => [*id; 2],
        ids => {
            let (mut low, mut high) = (u32::MAX, 0);
            for id in (first..end).map(|row| ids.get(row)) {
                low = low.min(id);
                high = high.max(id);
            }
            [low, high]
        }
    }
}

/// The shape of some rows, as far as tests read it.
pub(super) fn shape_of_rows(nodes: &NodeColumns, first: usize, end: usize, tests: &Tests) -> Shape {
    let hits = |row: &usize| nodes.object.get(*row) != 0;
    Shape {
        uv: extent(&nodes.uv, first, end, tests.uv_squared, hits),
        normal: extent(&nodes.normal, first, end, tests.chord_squared, hits),
        feature: extent(&nodes.feature, first, end, tests.feature, hits),
    }
}

fn extent<const N: usize>(
    column: &Column<[f32; N]>,
    first: usize,
    end: usize,
    threshold: f32,
    hits: impl Fn(&usize) -> bool,
) -> Extent<N> {
    let mut extent = Extent::EMPTY;
    if threshold == f32::INFINITY {
        return extent;
    }
    for row in (first..end).filter(hits) {
        extent = extent.union(&Extent::point(column.get(row)));
        if matches!(column, Column::Constant(_)) {
            break;
        }
    }
    extent
}

/// The squared radius of each row's line. Widths mostly come in runs.
pub(super) fn radii_squared(widths: &Column<f32>, rules: &Rules) -> Column<f32> {
    let mut last = (0.0, 0.0);
    widths.map(|width| {
        if width != last.0 {
            last = (width, rules.radius(width) * rules.radius(width));
        }
        last.1
    })
}
