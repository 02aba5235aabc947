//! Layers of a picture: what each holds and what its channels are called.

use crate::line::LineType;
use crate::sample::PixelRect;

/// A layer. Its `Display` is its name in files and for `--layer`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Layer {
    /// The picture with lines: `R G B A`.
    Rgba,
    /// The picture without lines: `color.R G B A`.
    Color,
    /// The lines alone, premultiplied: `line.R G B A`.
    Line,
    /// The lines of one type alone, premultiplied: `line.TYPE.R G B A`.
    LineType(LineType),
    /// Distance from the camera along the ray, nearest sample; ∞ at a miss: `Z`.
    Depth,
    /// Shading normal in world space, nearest sample; 0 at a miss: `N.X Y Z`.
    Normal,
    /// World position, nearest sample; 0 at a miss: `P.X Y Z`.
    Position,
    /// Texture coordinates, nearest sample: `uv.U V`.
    Uv,
    /// 1 + object id of the nearest sample, 0 at a miss, as a 32-bit unsigned channel: `object.id`.
    Object,
    /// Feature colour, nearest sample: `feature.R G B`.
    Feature,
    /// A script's extra output, filtered: `aov_NAME.R G B`. The number is its place in [`crate::sample::SampleBuffer::aovs`].
    Aov(usize, String),
}

/// The pixels of a rectangle: for each layer its channels, each `rect.pixels()` values row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmTile {
    /// The pixels.
    pub rect: PixelRect,
    /// Channels in the order of the layers and of [`Layer::channels`]. Object ids are bit-cast (`f32::from_bits`).
    pub channels: Vec<Vec<f32>>,
}
