//! Texture lookups of sixteen places at once, the same bits as [`Texture::sample`].
//!
//! Coordinates and interpolation are plain loops over lanes that become vector instructions where they are inlined into
//! code compiled for wide vectors; only the pixels are fetched one by one.

use super::texture::{Image, LINEAR_FROM_SRGB8, Pixels, Texture, TextureFilter, Wrap, between, fold};
use crate::math::Vec2;

/// Places looked up at once.
const LANES: usize = 16;

type Lanes = [f32; LANES];

/// For each lane an index into an image.
type Places = [u32; LANES];

/// Values of the 256 codes as they are.
static PLAIN8: [f32; 256] = plain8();

const fn plain8() -> [f32; 256] {
    let mut table = [0.0; 256];
    let mut code = 0;
    while code < 256 {
        table[code] = code as f32 / 255.0;
        code += 1;
    }
    table
}

/// The four pixels around each lane's place, and how far it is from the first to the second, along x and along y.
struct Around {
    corners: [Places; 4],
    along: [Lanes; 2],
}

impl Texture {
    /// [`sample`](Self::sample) of each lane: `out` gets red, green, blue and alpha.
    #[inline(always)]
    pub fn sample_lanes(&self, u: &Lanes, v: &Lanes, out: &mut [Lanes; 4]) {
        let image = &*self.image;
        let u = folded(u, self.wrap[0]);
        let v = folded(v, self.wrap[1]);
        match self.filter {
            TextureFilter::Nearest => {
                let (x, y) = (nearest(&u, image.width), nearest(&v, image.height));
                let places = std::array::from_fn(|i| place(image, x[i], y[i]));
                match &image.pixels {
                    Pixels::Rgba8 { data, srgb } => decode(&fetched(data, &places), *srgb, out),
                    Pixels::Rgba32F { data } => {
                        for (lane, place) in places.into_iter().enumerate() {
                            let pixel = data.get(place as usize).copied().unwrap_or_default();
                            (0..4).for_each(|channel| out[channel][lane] = pixel[channel]);
                        }
                    }
                }
            }
            TextureFilter::Linear | TextureFilter::Mipmap => {
                let around = around(image, &u, &v, self.wrap);
                match &image.pixels {
                    Pixels::Rgba8 { data, srgb } => interpolate_rgba8(data, *srgb, &around, out),
                    Pixels::Rgba32F { data } => interpolate_floats(data, &around, out),
                }
            }
        }
    }

    /// [`sample_wide`](Self::sample_wide) of each lane: `out` gets red, green, blue and alpha.
    #[inline(always)]
    pub fn sample_wide_lanes(&self, u: &Lanes, v: &Lanes, width: &Lanes, out: &mut [Lanes; 4]) {
        if self.filter != TextureFilter::Mipmap {
            return self.sample_lanes(u, v, out);
        }
        for i in 0..LANES {
            let pixel = self.sample_wide(Vec2::new(u[i], v[i]), width[i]).to_array();
            for (channel, out) in out.iter_mut().enumerate() {
                out[i] = pixel[channel];
            }
        }
    }
}

/// The coordinates brought into 0 … 1.
#[inline(always)]
fn folded(t: &Lanes, wrap: Wrap) -> Lanes {
    let mut out = [0.0; LANES];
    match wrap {
        Wrap::Repeat => each(t, &mut out, |t| fold(t, Wrap::Repeat)),
        Wrap::Mirror => each(t, &mut out, |t| fold(t, Wrap::Mirror)),
        Wrap::Clamp => each(t, &mut out, |t| fold(t, Wrap::Clamp)),
    }
    out
}

#[inline(always)]
fn each(given: &Lanes, out: &mut Lanes, f: impl Fn(f32) -> f32) {
    for i in 0..LANES {
        out[i] = f(given[i]);
    }
}

/// Adding it to a number of at most 2²² rounds that to a whole one, which then stands in the low bits.
const ROUNDER: f32 = 12_582_912.0;

/// The whole number in a float.
#[inline(always)]
fn whole(x: f32) -> i32 {
    (x + ROUNDER).to_bits().wrapping_sub(ROUNDER.to_bits()) as i32
}

#[inline(always)]
fn nearest(t: &Lanes, size: u32) -> [i32; LANES] {
    let mut out = [0; LANES];
    for i in 0..LANES {
        out[i] = whole((t[i] * size as f32).floor()).min(size as i32 - 1);
    }
    out
}

/// The two pixels around each coordinate, and how far it is from the first to the second.
#[inline(always)]
fn neighbors(t: &Lanes, size: u32, wrap: Wrap) -> ([[i32; LANES]; 2], Lanes) {
    let size_f = size as f32;
    let size = size as i32;
    let mut sides = [[0; LANES]; 2];
    let mut along = [0.0; LANES];
    let repeats = wrap == Wrap::Repeat;
    for i in 0..LANES {
        let x = t[i] * size_f - 0.5;
        let left = x.floor();
        let index = whole(left);
        along[i] = x - left;
        // Beyond either end by one at most. At the seam of a mirror the border pixel is met again.
        let (below, above) = if repeats { (size - 1, 0) } else { (0, size - 1) };
        let inside = |index: i32| {
            let index = if index < 0 { below } else { index };
            if index >= size { above } else { index }
        };
        sides[0][i] = inside(index);
        sides[1][i] = inside(index.wrapping_add(1));
    }
    (sides, along)
}

#[inline(always)]
fn place(image: &Image, x: i32, y: i32) -> u32 {
    // An image has at most 2²⁷ pixels.
    (y as u32).wrapping_mul(image.width).wrapping_add(x as u32)
}

#[inline(always)]
fn around(image: &Image, u: &Lanes, v: &Lanes, wrap: [Wrap; 2]) -> Around {
    let (x, along_x) = neighbors(u, image.width, wrap[0]);
    let (y, along_y) = neighbors(v, image.height, wrap[1]);
    let mut corners = [[0; LANES]; 4];
    for (corner, places) in corners.iter_mut().enumerate() {
        for i in 0..LANES {
            places[i] = place(image, x[corner & 1][i], y[corner >> 1][i]);
        }
    }
    Around { corners, along: [along_x, along_y] }
}

#[inline(always)]
fn fetched(data: &[[u8; 4]], places: &Places) -> [u32; LANES] {
    let mut out = [0; LANES];
    for i in 0..LANES {
        out[i] = u32::from_le_bytes(data.get(places[i] as usize).copied().unwrap_or_default());
    }
    out
}

/// The linear channels of pixels.
#[inline(always)]
fn decode(pixels: &[u32; LANES], srgb: bool, out: &mut [Lanes; 4]) {
    let color: &[f32; 256] = if srgb { &LINEAR_FROM_SRGB8 } else { &PLAIN8 };
    for (channel, out) in out.iter_mut().enumerate() {
        let table = if channel < 3 { color } else { &PLAIN8 };
        for i in 0..LANES {
            out[i] = table[(pixels[i] >> (channel * 8) & 255) as usize];
        }
    }
}

#[inline(always)]
fn interpolate_rgba8(data: &[[u8; 4]], srgb: bool, around: &Around, out: &mut [Lanes; 4]) {
    let mut corners = [[[0.0; LANES]; 4]; 4];
    for (places, corner) in around.corners.iter().zip(&mut corners) {
        decode(&fetched(data, places), srgb, corner);
    }
    let [along_x, along_y] = &around.along;
    for (channel, out) in out.iter_mut().enumerate() {
        let [a, b, c, d] = [0, 1, 2, 3].map(|corner: usize| &corners[corner][channel]);
        for i in 0..LANES {
            let top = between(a[i], b[i], along_x[i]);
            let bottom = between(c[i], d[i], along_x[i]);
            out[i] = between(top, bottom, along_y[i]);
        }
    }
}

#[inline(always)]
fn interpolate_floats(data: &[[f32; 4]], around: &Around, out: &mut [Lanes; 4]) {
    for lane in 0..LANES {
        let pixel = |corner: usize| data.get(around.corners[corner][lane] as usize).copied().unwrap_or_default();
        let (a, b, c, d) = (pixel(0), pixel(1), pixel(2), pixel(3));
        let (along_x, along_y) = (around.along[0][lane], around.along[1][lane]);
        for (channel, out) in out.iter_mut().enumerate() {
            let top = between(a[channel], b[channel], along_x);
            let bottom = between(c[channel], d[channel], along_x);
            out[lane] = between(top, bottom, along_y);
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{Arc, OnceLock};

    use super::*;

    struct Look<'a>(&'a Texture, &'a Lanes, &'a Lanes, &'a mut [Lanes; 4]);

    impl pulp::WithSimd for Look<'_> {
        type Output = ();

        #[inline(always)]
        fn with_simd<S: pulp::Simd>(self, _: S) {
            self.0.sample_lanes(self.1, self.2, self.3);
        }
    }

    fn widths() -> Vec<pulp::Arch> {
        let mut widths = vec![pulp::Arch::Scalar, pulp::Arch::new()];
        #[cfg(target_arch = "x86_64")]
        widths.extend(pulp::x86::V3::try_new().map(pulp::Arch::V3));
        widths
    }

    /// Coordinates in and around the image, at its borders and at those of its pixels, and of any kind.
    fn coordinate(bits: u64, size: u32) -> f32 {
        const SPECIAL: [f32; 12] = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            2.0,
            f32::NAN,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::MAX,
            -1e-30,
            0.999_999_94,
            1e10,
        ];
        let (kind, low, high) = (bits % 8, (bits >> 8) as u32 % 4096, (bits >> 32) as u32);
        match kind {
            0 => f32::from_bits(high),
            1 => SPECIAL[high as usize % SPECIAL.len()],
            2 => (low % (4 * size)) as f32 / (2 * size) as f32 - 0.5,
            _ => high as f32 / 4_294_967_296.0 * 6.0 - 3.0,
        }
    }

    #[test]
    fn sixteen_places_are_looked_up_as_one_is() {
        let mut state = 1_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            state ^ (state >> 29)
        };
        for (width, height) in [(1, 1), (2, 3), (7, 5), (64, 32)] {
            let count = (width * height) as usize;
            let bytes: Vec<[u8; 4]> = (0..count).map(|_| (next() as u32).to_le_bytes()).collect();
            let floats: Vec<[f32; 4]> =
                bytes.iter().map(|pixel| pixel.map(|c| (f32::from(c) - 100.0) * 0.37 * f32::from(c % 5))).collect();
            for pixels in [
                Pixels::Rgba8 { data: bytes.clone(), srgb: true },
                Pixels::Rgba8 { data: bytes.clone(), srgb: false },
                Pixels::Rgba32F { data: floats.clone() },
            ] {
                let image = Arc::new(Image { width, height, pixels });
                for across in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
                    for down in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
                        for filter in [TextureFilter::Nearest, TextureFilter::Linear] {
                            let texture = Texture {
                                name: String::new(),
                                image: Arc::clone(&image),
                                wrap: [across, down],
                                filter,
                                levels: OnceLock::new(),
                            };
                            for _ in 0..60 {
                                let u = std::array::from_fn(|_| coordinate(next(), width));
                                let v = std::array::from_fn(|_| coordinate(next(), height));
                                for arch in widths() {
                                    let mut out = [[0.0; LANES]; 4];
                                    arch.dispatch(Look(&texture, &u, &v, &mut out));
                                    for lane in 0..LANES {
                                        let wanted = texture.sample(Vec2::new(u[lane], v[lane])).to_array();
                                        let got = out.map(|channel| channel[lane]);
                                        assert_eq!(
                                            wanted.map(f32::to_bits),
                                            got.map(f32::to_bits),
                                            "at ({}, {}) of {texture:?}: {wanted:?} and {got:?}",
                                            u[lane],
                                            v[lane]
                                        );
                                    }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}
