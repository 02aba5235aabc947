//! Output files: written tile by tile under a temporary name, renamed at the end.

use std::path::PathBuf;

use super::layer::{FilmTile, Layer};
use crate::diag::Diagnostic;
use crate::sample::PixelRect;

/// What to write where.
#[derive(Clone, Debug)]
pub struct OutputSettings {
    /// `.png` or `.exr`.
    pub path: PathBuf,
    /// Size of the whole picture.
    pub size: [u32; 2],
    /// The part of it that is rendered.
    pub crop: PixelRect,
    /// The layers of every tile that will come, in order.
    pub layers: Vec<Layer>,
    /// The layer that a PNG shows.
    pub png_layer: Layer,
}

/// An open output file. Dropped unfinished, it leaves no trace and the old file untouched.
pub struct Output {
    _todo: (),
}

impl Output {
    /// Opens an output.
    ///
    /// # Errors
    /// If the extension is not known or the folder cannot be written to.
    pub fn create(settings: OutputSettings) -> Result<Self, Diagnostic> {
        let _ = settings;
        todo!()
    }

    /// Writes a tile; tiles come in any order, each pixel once.
    ///
    /// # Errors
    /// If the disk is full or gone.
    pub fn write(&mut self, tile: &FilmTile) -> Result<(), Diagnostic> {
        let _ = tile;
        todo!()
    }

    /// Fills what was never written with transparent black, closes the file and gives it its name.
    ///
    /// # Errors
    /// As [`Self::write`]; the old file is then untouched.
    pub fn finish(self) -> Result<(), Diagnostic> {
        todo!()
    }
}
