//! From samples to pixels.

use super::filter::Filter;
use super::layer::{FilmTile, Layer};
use crate::line::LineBuffer;
use crate::sample::{PixelRect, SampleBuffer};

/// Tiles of samples with their lines, in a grid as in [`crate::line::Window`].
#[derive(Clone, Debug)]
pub struct FilmWindow<'a> {
    /// Upper left pixel of the grid.
    pub origin: [i32; 2],
    /// Side of a tile in pixels.
    pub tile: i32,
    /// Tiles per row of the grid.
    pub columns: usize,
    /// The tiles, row by row; the lines are `None` when lines are off.
    pub tiles: Vec<Option<(&'a SampleBuffer, Option<&'a LineBuffer>)>>,
}

/// Filters the samples around `rect` into its pixels. `window` must hold all samples of the picture within
/// [`Filter::reach`] pixels around it.
#[must_use]
pub fn develop(window: &FilmWindow<'_>, rect: PixelRect, filter: &Filter, layers: &[Layer]) -> FilmTile {
    let _ = (window, rect, filter, layers);
    todo!()
}
