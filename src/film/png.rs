//! PNG: a view of one layer, 8 bits per channel, without dithering.
//!
//! | layer | shown as |
//! |---|---|
//! | `rgba`, `color`, `below`, `feature`, `aov_NAME` | sRGB |
//! | `line`, `line.TYPE`, `line.PATH` | sRGB with alpha |
//! | `N` | n / 2 + 1/2, black at a miss |
//! | `P` | the fractional part of each coordinate |
//! | `Z` | 1 / (1 + z): white at the camera, black at infinity |
//! | `uv` | red and green are the fractional parts of u and v |
//! | `object` | one colour per id, black at a miss |
//!
//! `rgba`, `color` and `below` have an alpha channel if the settings say so. Colours are stored premultiplied on the film and
//! divided by alpha for PNG, as its standard asks.

use std::io::{self, ErrorKind, Write};
use std::ops::Range;

use png::{BitDepth, ColorType, Encoder, EncodingError, SrgbRenderingIntent};

use super::blocks::{Block, Blocks, SIDE};
use super::layer::Layer;
use super::output::OutputSettings;
use crate::diag::Diagnostic;
use crate::math::srgb_from_linear;
use crate::sample::PixelRect;

/// A file to be.
pub(super) struct PngFormat {
    layer: Layer,
    /// The layer's channels in a tile.
    channels: Range<usize>,
    alpha: bool,
    crop: PixelRect,
    whole: bool,
    metadata: Vec<(String, String)>,
    srgb: SrgbBytes,
}

impl PngFormat {
    pub(super) fn new(settings: &OutputSettings) -> Result<Self, Diagnostic> {
        let layer = settings.png_layer.clone();
        let place = settings.layers.iter().position(|known| *known == layer).ok_or_else(|| {
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
        let start = settings.layers[..place].iter().map(|layer| layer.channels().len()).sum();
        let alpha = match layer {
            Layer::Rgba | Layer::Color | Layer::Below => settings.transparent,
            Layer::Line | Layer::LineType(_) | Layer::LinePath(_) => true,
            _ => false,
        };
        Ok(Self {
            channels: start..start + layer.channels().len(),
            layer,
            alpha,
            crop: settings.crop,
            whole: settings.crop == PixelRect::of_size(settings.size),
            metadata: settings.metadata.clone(),
            srgb: SrgbBytes::new(),
        })
    }

    /// Bytes of one pixel.
    pub(super) fn pixel_bytes(&self) -> usize {
        if self.alpha { 4 } else { 3 }
    }

    /// The pixels of a tile as the file shows them.
    pub(super) fn pixels(&self, channels: &[Vec<f32>]) -> Vec<u8> {
        let channels = &channels[self.channels.clone()];
        let count = channels.first().map_or(0, Vec::len);
        let mut bytes = Vec::with_capacity(count * self.pixel_bytes());
        for i in 0..count {
            let mut value = [0.0; 4];
            value.iter_mut().zip(channels).for_each(|(value, channel)| *value = channel[i]);
            bytes.extend_from_slice(&self.show(value)[..self.pixel_bytes()]);
        }
        bytes
    }

    /// What a pixel with these channels looks like.
    fn show(&self, [x, y, z, w]: [f32; 4]) -> [u8; 4] {
        let [r, g, b] = match &self.layer {
            _ if self.alpha => {
                let share = |premultiplied: f32| if w > 0.0 { self.srgb.byte(premultiplied / w) } else { 0 };
                return [share(x), share(y), share(z), byte(w)];
            }
            Layer::Normal if [x, y, z] == [0.0; 3] => [0; 3],
            Layer::Normal => [x, y, z].map(|component| byte(component * 0.5 + 0.5)),
            Layer::Position | Layer::Uv => [x, y, z].map(|coordinate| byte(coordinate - coordinate.floor())),
            Layer::Depth => [byte(1.0 / (1.0 + x)); 3],
            Layer::Object => id_color(x.to_bits()).map(byte),
            _ => [x, y, z].map(|linear| self.srgb.byte(linear)),
        };
        [r, g, b, u8::MAX]
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
        encoder.set_color(if self.alpha { ColorType::Rgba } else { ColorType::Rgb });
        encoder.set_depth(BitDepth::Eight);
        if !matches!(self.layer, Layer::Normal | Layer::Position | Layer::Uv | Layer::Depth | Layer::Object) {
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

/// A value 0 … 1 to the nearest byte; what is outside is clamped.
fn byte(value: f32) -> u8 {
    (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

/// [`srgb_from_linear`] to the nearest byte, several times as fast: for each byte but 0 the least value that gives it.
struct SrgbBytes {
    least: [f32; 255],
}

impl SrgbBytes {
    fn new() -> Self {
        let least = |i: usize| {
            // Positive floats are in the order of their bits.
            let (mut below, mut at) = (0, 1.0_f32.to_bits());
            while at - below > 1 {
                let middle = below.midpoint(at);
                let reached = usize::from(byte(srgb_from_linear(f32::from_bits(middle)))) > i;
                if reached { at = middle } else { below = middle }
            }
            f32::from_bits(at)
        };
        Self { least: std::array::from_fn(least) }
    }

    fn byte(&self, linear: f32) -> u8 {
        self.least.partition_point(|least| *least <= linear) as u8
    }
}

/// A colour for an id, bright enough to tell from the black of a miss.
fn id_color(id: u32) -> [f32; 3] {
    if id == 0 {
        return [0.0; 3];
    }
    // The golden ratio's multiples keep consecutive ids far apart on the colour circle.
    let hue = f64::from(id) * 0.618_033_988_749_895 % 1.0 * 6.0;
    let value = [1.0, 0.8, 0.6][id as usize % 3];
    [5.0, 3.0, 1.0].map(|shift| {
        let k = (hue + shift) % 6.0;
        (value * (1.0 - 0.7 * k.min(4.0 - k).clamp(0.0, 1.0))) as f32
    })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_bytes_are_the_nearest() {
        let srgb = SrgbBytes::new();
        for i in 0..100_000 {
            let linear = i as f32 * 1.1e-5 - 0.05;
            assert_eq!(srgb.byte(linear), byte(srgb_from_linear(linear)), "{linear}");
        }
        assert_eq!([f32::NAN, f32::NEG_INFINITY, f32::INFINITY].map(|value| srgb.byte(value)), [0, 0, 255]);
    }
}
