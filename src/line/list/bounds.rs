//! What is known of the lists of a pixel, a block or a tile without looking at them.
//!
//! Each place in the lists (the first surfaces, the second, …) has bounds of its own. A surface is surely *met* by a set of
//! lists if there is a place at which every one of them has a surface and none there differs from it. So where the same
//! surfaces lie behind each other, however many, two neighbourhoods are told to be alike by as many comparisons.

use crate::line::Rules;
use crate::line::bounds::{Bounded, Bounds, PathBounds, Shape, of_rows, radii_squared, shape_of_rows};
use crate::line::materials::may_differ;
use crate::line::overlap::{Facet, FacetBounds};
use crate::sample::{Column, NodeColumns, SampleBuffer};

/// Bounds of the surfaces at one place behind the first, for the blocks and pixels of a [`PathBounds`].
#[derive(Clone, Debug)]
pub(in crate::line) struct LayerBounds {
    /// Square of the radius of each row's line, 0 if it draws none.
    pub radius_squared: Column<f32>,
    /// One part.
    whole: Parts,
    blocks: Parts,
    pixels: Parts,
}

/// Bounds of some sets of surfaces at one place.
#[derive(Clone, Debug, Default)]
struct Parts {
    parts: Vec<Part>,
    /// Nothing where no test reads shapes.
    shapes: Vec<Shape>,
    /// Nothing where no test reads facets.
    facets: Vec<FacetBounds>,
}

/// Bounds of some surfaces at one place, but for their shape and facets.
#[derive(Clone, Copy, Debug)]
struct Part {
    bounds: Bounds,
    /// Whether every list has a surface there.
    every: bool,
}

impl LayerBounds {
    pub(in crate::line) fn new(front: &PathBounds, buffer: &SampleBuffer, nodes: &NodeColumns, rules: &Rules) -> Self {
        let tests = rules.tests();
        let radius_squared = radii_squared(&nodes.line_width, rules);
        let (mut pixels, mut blocks, mut whole) = (Parts::default(), Parts::default(), Parts::default());
        for block in &front.blocks {
            let first = pixels.parts.len();
            for pixel in &front.pixels[block.first as usize..block.end as usize] {
                let rows = nodes.rows.of_pixel(buffer.pixel_number(pixel.pixel));
                let every = rows.len() == (pixel.end - pixel.first) as usize;
                let bounds = if rows.is_empty() {
                    Bounds::EMPTY
                } else {
                    of_rows(&radius_squared, nodes, rows.start, rows.end, rules)
                };
                pixels.parts.push(Part { bounds, every });
                if tests.reads_shapes {
                    pixels.shapes.push(shape_of_rows(nodes, rows.start, rows.end, tests));
                }
                if tests.reads_facets() {
                    pixels.facets.push(FacetBounds::of(rows.map(|row| Facet::of(nodes, row))));
                }
            }
            blocks.push_union(&pixels, first, nodes, rules);
        }
        whole.push_union(&blocks, 0, nodes, rules);
        Self { radius_squared, whole, blocks, pixels }
    }

    /// Bytes of heap memory, and of the layer itself.
    pub(in crate::line) fn bytes(&self) -> usize {
        let of_parts = |parts: &Parts| {
            size_of_val(&parts.parts[..]) + size_of_val(&parts.shapes[..]) + size_of_val(&parts.facets[..])
        };
        let parts = [&self.whole, &self.blocks, &self.pixels].map(of_parts);
        size_of::<Self>() + self.radius_squared.bytes() + parts.iter().sum::<usize>()
    }
}

impl Parts {
    /// Appends the bounds of all of some parts from the one at `first` on.
    fn push_union(&mut self, of: &Self, first: usize, nodes: &NodeColumns, rules: &Rules) {
        let empty = Part { bounds: Bounds::EMPTY, every: true };
        self.parts.push(of.parts[first..].iter().fold(empty, |all, one| {
            let present = one.bounds.object[0] <= one.bounds.object[1];
            let bounds = if present { all.bounds.union(&one.bounds, nodes, rules) } else { all.bounds };
            Part { bounds, every: all.every && one.every }
        }));
        if !of.shapes.is_empty() {
            self.shapes.push(of.shapes[first..].iter().fold(Shape::EMPTY, |all, one| all.union(one)));
        }
        if !of.facets.is_empty() {
            self.facets.push(FacetBounds::of_all(&of.facets[first..]));
        }
    }

    /// The bounds of a part and whether every list has a surface there; `None` if none has.
    #[inline]
    fn get(&self, index: usize) -> Option<(Bounded<'_>, bool)> {
        let Part { bounds, every } = &self.parts[index];
        let shape = self.shapes.get(index).unwrap_or(&Shape::EMPTY);
        let facets = self.facets.get(index).unwrap_or(&FacetBounds::EMPTY);
        (bounds.object[0] <= bounds.object[1]).then_some((Bounded { bounds, shape, facets }, *every))
    }
}

/// A set of lists.
#[derive(Clone, Copy)]
pub(super) struct Lists<'b> {
    bounds: &'b PathBounds,
    part: PartOf,
}

/// Which lists of a path.
#[derive(Clone, Copy)]
enum PartOf {
    Tile,
    Block(usize),
    Pixel(usize),
}

impl<'b> Lists<'b> {
    pub(super) fn of_tile(bounds: &'b PathBounds) -> Self {
        Self { bounds, part: PartOf::Tile }
    }

    /// Of a block, by its place.
    pub(super) fn of_block(bounds: &'b PathBounds, block: usize) -> Self {
        Self { bounds, part: PartOf::Block(block) }
    }

    /// Of a pixel, by its place.
    pub(super) fn of_pixel(bounds: &'b PathBounds, pixel: usize) -> Self {
        Self { bounds, part: PartOf::Pixel(pixel) }
    }

    /// How many places the lists have at most.
    pub(super) fn places(&self) -> usize {
        1 + self.bounds.behind.len()
    }

    /// The first surfaces.
    #[inline]
    pub(super) fn first(&self) -> Bounded<'b> {
        match self.part {
            PartOf::Tile => self.bounds.bounded(),
            PartOf::Block(block) => self.bounds.blocks[block].bounded(),
            PartOf::Pixel(pixel) => self.bounds.of_pixel(pixel),
        }
    }

    /// The surfaces at a place, and whether every list has one there; `None` if none has.
    #[inline]
    pub(super) fn at(&self, place: usize) -> Option<(Bounded<'b>, bool)> {
        let Some(behind) = place.checked_sub(1) else { return Some((self.first(), true)) };
        let layer = &self.bounds.behind[behind];
        match self.part {
            PartOf::Tile => layer.whole.get(0),
            PartOf::Block(block) => layer.blocks.get(block),
            PartOf::Pixel(pixel) => layer.pixels.get(pixel),
        }
    }

    /// Whether every list, at least so far away on the film, surely has a surface that does not differ from any of these.
    #[inline]
    pub(super) fn surely_meet(&self, surfaces: &Bounded<'_>, gap_squared: f32, rules: &Rules) -> bool {
        (0..self.places()).any(|place| {
            self.at(place).is_some_and(|(known, every)| every && !may_differ(rules, surfaces, &known, gap_squared))
        })
    }
}
