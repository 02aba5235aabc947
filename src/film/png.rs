//! PNG: a [`View`] of one layer. `rgba`, `color` and `below` have an alpha channel if the settings say so.

use std::io::{self, ErrorKind, Write};

use png::{BitDepth, ColorType, Encoder, EncodingError, SrgbRenderingIntent};

use super::blocks::{Block, Blocks, SIDE};
use super::layer::FilmTile;
use super::output::OutputSettings;
use super::view::{View, byte};
use crate::diag::Diagnostic;
use crate::sample::PixelRect;

/// A file to be.
pub(super) struct PngFormat {
    view: View,
    crop: PixelRect,
    whole: bool,
    metadata: Vec<(String, String)>,
}

impl PngFormat {
    pub(super) fn new(settings: &OutputSettings) -> Result<Self, Diagnostic> {
        let layer = &settings.png_layer;
        let view = View::new(&settings.layers, layer, settings.transparent).ok_or_else(|| {
            let layers: Vec<_> = settings.layers.iter().map(ToString::to_string).collect();
            Diagnostic::error(format!("a PNG of layer `{layer}` was asked for, but that layer is not rendered"))
                .hint(format!("rendered are {}", layers.join(", ")))
        })?;
        // PNG allows Latin-1, of which ASCII is the part that nobody reads wrongly.
        let is_keyword = |name: &str| (1..80).contains(&name.len()) && name.bytes().all(|b| (b' '..=b'~').contains(&b));
        if let Some((name, _)) = settings.metadata.iter().find(|(name, _)| !is_keyword(name)) {
            return Err(Diagnostic::error(format!(
                "cannot make a PNG file of this picture: the keyword {name:?} is not 1 to 79 ASCII letters"
            )));
        }
        let whole = settings.crop == PixelRect::of_size(settings.size);
        Ok(Self { view, crop: settings.crop, whole, metadata: settings.metadata.clone() })
    }

    /// Bytes of one pixel.
    pub(super) fn pixel_bytes(&self) -> usize {
        if self.view.has_alpha() { 4 } else { 3 }
    }

    /// The pixels of a tile as the file shows them.
    pub(super) fn pixels(&self, tile: &FilmTile) -> Vec<u8> {
        let size = [tile.rect.width(), tile.rect.height()];
        let (whole, width) = (PixelRect::of_size(size), size[0] as usize);
        match self.view.has_alpha() {
            true => self.view.pixels::<4>(&tile.channels, width, whole),
            false => self.view.pixels::<3>(&tile.channels, width, whole),
        }
    }

    /// A block as it waits for the end: unpacked, since PNG is compressed across blocks.
    pub(super) fn pack(block: Block) -> Vec<u8> {
        block.bytes
    }

    /// Writes the file, one row of blocks after another. Blocks that are not there are transparent black.
    pub(super) fn write(&self, blocks: &mut Blocks, sink: &mut dyn Write) -> io::Result<()> {
        watched(sink, |sink| self.encode(blocks, sink))
    }

    fn encode(&self, blocks: &mut Blocks, sink: &mut dyn Write) -> io::Result<()> {
        let mut encoder = Encoder::new(sink, self.crop.width(), self.crop.height());
        encoder.set_color(if self.view.has_alpha() { ColorType::Rgba } else { ColorType::Rgb });
        encoder.set_depth(BitDepth::Eight);
        if self.view.is_color() {
            encoder.set_source_srgb(SrgbRenderingIntent::RelativeColorimetric);
        }
        let software = ("Software".to_owned(), concat!("Tusche ", env!("CARGO_PKG_VERSION")).to_owned());
        for (keyword, text) in [software].iter().chain(&self.metadata) {
            encoder.add_itxt_chunk(keyword.clone(), text.clone()).map_err(io_error)?;
        }
        let mut writer = encoder.write_header().map_err(io_error)?;
        if !self.whole {
            writer.write_chunk(png::chunk::ChunkType(*b"oFFs"), &self.offset_chunk()).map_err(io_error)?;
        }

        let pixel_bytes = self.pixel_bytes();
        let row_bytes = self.crop.width() as usize * pixel_bytes;
        let mut rows = writer.stream_writer().map_err(io_error)?;
        for first in (0..blocks.count()).step_by(blocks.columns()) {
            let height = blocks.block_rect(first).height() as usize;
            let mut band = vec![0; height * row_bytes];
            for column in 0..blocks.columns() {
                let Some(block) = blocks.load(first + column)? else { continue };
                let block_row = block.len() / height;
                let start = column * SIDE as usize * pixel_bytes;
                for (row, block_row) in band.chunks_exact_mut(row_bytes).zip(block.chunks_exact(block_row)) {
                    row[start..start + block_row.len()].copy_from_slice(block_row);
                }
            }
            rows.write_all(&band)?;
        }
        rows.finish().map_err(io_error)?;
        writer.finish().map_err(io_error)
    }

    /// Where a crop lies in the whole picture: the standard `oFFs` chunk, in pixels.
    fn offset_chunk(&self) -> [u8; 9] {
        let mut chunk = [0; 9];
        chunk[..4].copy_from_slice(&self.crop.x0.to_be_bytes());
        chunk[4..8].copy_from_slice(&self.crop.y0.to_be_bytes());
        chunk
    }
}

/// Writes a small picture of encoded colours, 0 … 1.
pub(super) fn write_small(sink: &mut dyn Write, size: [u32; 2], pixels: &[[f32; 3]]) -> io::Result<()> {
    watched(sink, |sink| {
        let mut encoder = Encoder::new(sink, size[0], size[1]);
        encoder.set_color(ColorType::Rgb);
        encoder.set_depth(BitDepth::Eight);
        let bytes: Vec<u8> = pixels.iter().flatten().map(|value| byte(*value)).collect();
        let mut writer = encoder.write_header().map_err(io_error)?;
        writer.write_image_data(&bytes).map_err(io_error)?;
        writer.finish().map_err(io_error)
    })
}

/// Runs an encoder so that no failure of the sink gets lost: the `png` crate writes the last piece of pixels in a
/// destructor, which tells nobody, and wraps other failures until their cause cannot be seen.
fn watched(sink: &mut dyn Write, encode: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
    let mut watched = Watched { sink, failure: None };
    let result = encode(&mut watched);
    watched.failure.map_or(result, Err)
}

struct Watched<'a> {
    sink: &'a mut dyn Write,
    /// The first failure.
    failure: Option<io::Error>,
}

impl Watched<'_> {
    fn note<T>(&mut self, result: io::Result<T>) -> io::Result<T> {
        result.map_err(|error| {
            let kind = error.kind();
            if kind != ErrorKind::Interrupted {
                self.failure.get_or_insert(error);
            }
            kind.into()
        })
    }
}

impl Write for Watched<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let result = self.sink.write(bytes);
        self.note(result)
    }

    fn flush(&mut self) -> io::Result<()> {
        let result = self.sink.flush();
        self.note(result)
    }
}

fn io_error(error: EncodingError) -> io::Error {
    match error {
        EncodingError::IoError(error) => error,
        error => io::Error::other(error.to_string()),
    }
}
