//! What a layer looks like on a screen: 8 bits per channel, without dithering.
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
//! `rgba`, `color` and `below` have alpha if the background is transparent. Colours are stored premultiplied on the film and
//! divided by alpha here, as PNG and browsers ask.

use std::ops::Range;

use rayon::prelude::*;

use super::layer::Layer;
use crate::math::srgb_from_linear;
use crate::sample::PixelRect;

/// A look at one of several layers.
pub struct View {
    layer: Layer,
    /// The layer's channels among those of all layers.
    channels: Range<usize>,
    alpha: bool,
    /// Multiplies colours.
    gain: f32,
    srgb: SrgbBytes,
}

impl View {
    /// A look at one of these layers; `None` if it is not among them. `transparent` tells whether the background is.
    #[must_use]
    pub fn new(layers: &[Layer], layer: &Layer, transparent: bool) -> Option<Self> {
        let place = layers.iter().position(|known| known == layer)?;
        let start = layers[..place].iter().map(|layer| layer.channels().len()).sum();
        let alpha = match layer {
            Layer::Rgba | Layer::Color | Layer::Below => transparent,
            Layer::Line | Layer::LineType(_) | Layer::LinePath(_) => true,
            _ => false,
        };
        let channels = start..start + layer.channels().len();
        Some(Self { layer: layer.clone(), channels, alpha, gain: 1.0, srgb: SrgbBytes::new() })
    }

    /// The same with colours multiplied by 2 to the power of `stops`. Layers that are no colours stay as they are.
    #[must_use]
    pub fn with_exposure(mut self, stops: f32) -> Self {
        self.gain = stops.exp2();
        self
    }

    /// Whether pixels have alpha.
    #[must_use]
    pub fn has_alpha(&self) -> bool {
        self.alpha
    }

    /// Whether the layer is a colour, and not a direction, a place or an id.
    #[must_use]
    pub fn is_color(&self) -> bool {
        !matches!(self.layer, Layer::Normal | Layer::Position | Layer::Uv | Layer::Depth | Layer::Object)
    }

    /// The pixels of a rectangle of a picture `width` pixels wide, whose channels of all layers are given. Each pixel
    /// is `N` bytes: red, green, blue, and alpha if `N` is 4.
    #[must_use]
    pub fn pixels<const N: usize>(&self, channels: &[Vec<f32>], width: usize, rect: PixelRect) -> Vec<u8> {
        let channels = &channels[self.channels.clone()];
        let mut bytes = vec![0; rect.pixels() * N];
        let row_bytes = (rect.width() as usize * N).max(1);
        // On all threads: somebody waits for it.
        bytes.par_chunks_mut(row_bytes).with_min_len(ROWS_AT_ONCE).zip(rect.y0..rect.y1).for_each(|(bytes, y)| {
            let start = y as usize * width + rect.x0 as usize;
            for (bytes, i) in bytes.chunks_exact_mut(N).zip(start..) {
                let mut value = [0.0; 4];
                value.iter_mut().zip(channels).for_each(|(value, channel)| *value = channel[i]);
                bytes.copy_from_slice(&self.show(value)[..N]);
            }
        });
        bytes
    }

    /// What a pixel with these channels looks like.
    fn show(&self, [x, y, z, w]: [f32; 4]) -> [u8; 4] {
        let [r, g, b] = match &self.layer {
            _ if self.alpha => {
                let share = |linear: f32| if w > 0.0 { self.srgb.byte(linear * self.gain / w) } else { 0 };
                return [share(x), share(y), share(z), byte(w)];
            }
            Layer::Normal if [x, y, z] == [0.0; 3] => [0; 3],
            Layer::Normal => [x, y, z].map(|component| byte(component * 0.5 + 0.5)),
            Layer::Position | Layer::Uv => [x, y, z].map(|coordinate| byte(coordinate - coordinate.floor())),
            Layer::Depth => [byte(1.0 / (1.0 + x)); 3],
            Layer::Object => id_color(x.to_bits()).map(byte),
            _ => [x, y, z].map(|linear| self.srgb.byte(linear * self.gain)),
        };
        [r, g, b, u8::MAX]
    }
}

/// Rows of pixels that a thread takes at least.
const ROWS_AT_ONCE: usize = 16;

/// A value 0 … 1 to the nearest byte; what is outside is clamped.
pub(super) fn byte(value: f32) -> u8 {
    (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

/// [`srgb_from_linear`] to the nearest byte, many times as fast: for each byte but 0 the least value that gives it, and
/// for floats by their first bits the byte from where to go on.
struct SrgbBytes {
    least: [f32; 255],
    /// Of the least float that has these first bits, counted from those of [`Self::SMALLEST`].
    start: Vec<u8>,
}

impl SrgbBytes {
    /// What is below gives 0.
    const SMALLEST: f32 = 1.0 / 8192.0;
    /// Bits of a float that do not choose its start: 7 bits of the mantissa do, so that few steps are left.
    const SHIFT: u32 = 16;

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
        let least = std::array::from_fn(least);
        let [first, last] = [Self::SMALLEST, 1.0].map(|value| value.to_bits() >> Self::SHIFT);
        let start = (first..last).map(|bits| {
            let value = f32::from_bits(bits << Self::SHIFT);
            least.partition_point(|least| *least <= value) as u8
        });
        Self { least, start: start.collect() }
    }

    fn byte(&self, linear: f32) -> u8 {
        if linear.is_nan() || linear < Self::SMALLEST {
            return 0;
        }
        let place = (linear.to_bits() >> Self::SHIFT) - (Self::SMALLEST.to_bits() >> Self::SHIFT);
        let Some(start) = self.start.get(place as usize) else { return u8::MAX };
        let mut byte = *start;
        while self.least.get(usize::from(byte)).is_some_and(|least| *least <= linear) {
            byte += 1;
        }
        byte
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
