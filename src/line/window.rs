//! The samples that a line pass can see: a grid of tiles.

use crate::sample::SampleBuffer;

/// A rectangle of the picture cut into tiles of one size (those at the right and lower border may be smaller), of
/// which those near the targets are present.
#[derive(Clone, Debug)]
pub struct Window<'a> {
    /// Upper left pixel of the grid.
    pub origin: [i32; 2],
    /// Side of a tile in pixels.
    pub tile: i32,
    /// Tiles per row of the grid.
    pub columns: usize,
    /// The tiles, row by row; `None` where not yet or no longer there.
    pub tiles: Vec<Option<&'a SampleBuffer>>,
}

impl<'a> Window<'a> {
    /// A window of one buffer alone.
    #[must_use]
    pub fn single(buffer: &'a SampleBuffer) -> Self {
        let side = buffer.rect.width().max(buffer.rect.height()).max(1) as i32;
        Self { origin: [buffer.rect.x0, buffer.rect.y0], tile: side, columns: 1, tiles: vec![Some(buffer)] }
    }
}
