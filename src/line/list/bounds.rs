//! What is known of the lists of a pixel, a block or a tile without looking at them.
//!
//! Each place in the lists (the first surfaces, the second, …) has bounds of its own. A surface is surely *met* by a set of
//! lists if there is a place at which every one of them has a surface and none there differs from it. So where the same
//! surfaces lie behind each other, however many, two neighbourhoods are told to be alike by as many comparisons.

use crate::line::Rules;
use crate::line::bounds::{Bounded, Bounds, PathBounds, Shape, of_rows, radii_squared, shape_of_rows};
use crate::line::differ::Tests;
use crate::sample::{Column, NodeColumns, SampleBuffer};

/// Bounds of the surfaces at one place behind the first, for the blocks and pixels of a [`PathBounds`].
#[derive(Clone, Debug)]
pub(in crate::line) struct LayerBounds {
    /// Square of the radius of each row's line, 0 if it draws none.
    pub radius_squared: Column<f32>,
    whole: Part,
    whole_shape: Shape,
    blocks: Vec<Part>,
    /// Nothing where no test reads shapes; so for pixels.
    block_shapes: Vec<Shape>,
    pixels: Vec<Part>,
    pixel_shapes: Vec<Shape>,
}

/// Bounds of some surfaces at one place.
#[derive(Clone, Copy, Debug)]
struct Part {
    bounds: Bounds,
    /// Whether every list has a surface there.
    every: bool,
}

impl LayerBounds {
    pub(in crate::line) fn new(front: &PathBounds, buffer: &SampleBuffer, nodes: &NodeColumns, rules: &Rules) -> Self {
        let shapes = rules.tests().reads_shapes;
        let empty = Part { bounds: Bounds::EMPTY, every: true };
        let mut layer = Self {
            radius_squared: radii_squared(&nodes.line_width, rules),
            whole: empty,
            whole_shape: Shape::EMPTY,
            blocks: Vec::new(),
            block_shapes: Vec::new(),
            pixels: Vec::new(),
            pixel_shapes: Vec::new(),
        };
        for block in &front.blocks {
            let (mut of_block, mut block_shape) = (empty, Shape::EMPTY);
            for pixel in &front.pixels[block.first as usize..block.end as usize] {
                let rows = nodes.rows.of_pixel(buffer.pixel_number(pixel.pixel));
                let every = rows.len() == (pixel.end - pixel.first) as usize;
                let mut bounds = Bounds::EMPTY;
                if !rows.is_empty() {
                    bounds = of_rows(&layer.radius_squared, nodes, rows.start, rows.end, rules);
                    of_block.bounds = of_block.bounds.union(&bounds, nodes);
                }
                of_block.every &= every;
                layer.pixels.push(Part { bounds, every });
                if shapes {
                    let shape = shape_of_rows(nodes, rows.start, rows.end, rules.tests());
                    block_shape = block_shape.union(&shape);
                    layer.pixel_shapes.push(shape);
                }
            }
            layer.whole.bounds = layer.whole.bounds.union(&of_block.bounds, nodes);
            layer.whole.every &= of_block.every;
            layer.blocks.push(of_block);
            if shapes {
                layer.whole_shape = layer.whole_shape.union(&block_shape);
                layer.block_shapes.push(block_shape);
            }
        }
        layer
    }

    /// Bytes of heap memory, and of the layer itself.
    pub(in crate::line) fn bytes(&self) -> usize {
        size_of::<Self>()
            + self.radius_squared.bytes()
            + size_of_val(&self.blocks[..])
            + size_of_val(&self.block_shapes[..])
            + size_of_val(&self.pixels[..])
            + size_of_val(&self.pixel_shapes[..])
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
            PartOf::Tile => Bounded { bounds: &self.bounds.bounds, shape: &self.bounds.shape },
            PartOf::Block(block) => self.bounds.blocks[block].bounded(),
            PartOf::Pixel(pixel) => self.bounds.of_pixel(pixel),
        }
    }

    /// The surfaces at a place, and whether every list has one there; `None` if none has.
    #[inline]
    pub(super) fn at(&self, place: usize) -> Option<(Bounded<'b>, bool)> {
        let Some(behind) = place.checked_sub(1) else { return Some((self.first(), true)) };
        let layer = &self.bounds.behind[behind];
        let shape = |shapes: &'b [Shape], index: usize| shapes.get(index).unwrap_or(&Shape::EMPTY);
        let (part, shape) = match self.part {
            PartOf::Tile => (&layer.whole, &layer.whole_shape),
            PartOf::Block(block) => (&layer.blocks[block], shape(&layer.block_shapes, block)),
            PartOf::Pixel(pixel) => (&layer.pixels[pixel], shape(&layer.pixel_shapes, pixel)),
        };
        let present = part.bounds.object[0] <= part.bounds.object[1];
        present.then_some((Bounded { bounds: &part.bounds, shape }, part.every))
    }

    /// Whether every list surely has a surface that does not differ from any of these.
    #[inline]
    pub(super) fn surely_meet(&self, surfaces: &Bounded<'_>, tests: &Tests) -> bool {
        (0..self.places())
            .any(|place| self.at(place).is_some_and(|(known, every)| every && !surfaces.may_differ(&known, tests)))
    }
}
