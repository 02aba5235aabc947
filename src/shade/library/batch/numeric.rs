//! Batch forms of functions of numbers, colours and hashes, where a loop over the scalar form is not vector code already.
//!
//! All work on copies of their blocks: only what cannot overlap is sure to become vector instructions (a sum of two blocks
//! in place takes six times as long).
//!
//! `floor`, `ceil` and `round` are instructions wherever vectors are wide (AVX, NEON); on a CPU with SSE2 alone they are
//! calls, with the same results.

use super::{LANES, Lanes};
use crate::math::Vec3;
use crate::shade::library::{color, hash as hashes, math};

macro_rules! lanewise {
    ($($(#[$doc:meta])* $name:ident($($x:ident),*) = $f:expr;)*) => { $(
        $(#[$doc])*
        #[inline(always)]
        pub fn $name($($x: &Lanes,)* out: &mut Lanes) {
            $(let $x = *$x;)*
            let mut results = [0.0; LANES];
            for i in 0..LANES {
                results[i] = $f($($x[i]),*);
            }
            *out = results;
        }
    )* };
}
lanewise! {
    /// `floor` of each lane.
    floor(x) = f32::floor;
    /// `ceil` of each lane.
    ceil(x) = f32::ceil;
    /// `round` of each lane: halves away from zero.
    round(x) = f32::round;
    /// `fract` of each lane.
    fract(x) = math::fract;
    /// `mod` of each lane.
    floored_mod(x, y) = math::floored_mod;
    /// `sign` of each lane.
    sign(x) = math::sign;
    /// `smoothstep` of each lane.
    smoothstep(low, high, x) = math::smoothstep;
    /// `remap` of each lane.
    remap(x, from_low, from_high, to_low, to_high) = math::remap;
    /// One channel of `srgb` of each lane.
    linear_from_srgb(encoded) = crate::math::linear_from_srgb;
}

/// `hsv` of each lane: red, green and blue.
#[inline(always)]
pub fn rgb_from_hsv(hue: &Lanes, saturation: &Lanes, value: &Lanes, out: &mut [Lanes; 3]) {
    let (hue, saturation, value) = (*hue, *saturation, *value);
    let mut channels = [[0.0; LANES]; 3];
    for i in 0..LANES {
        let color = color::rgb_from_hsv(hue[i], saturation[i], value[i]);
        [channels[0][i], channels[1][i], channels[2][i]] = color.to_array();
    }
    *out = channels;
}

/// `hsv_from_rgb` of each lane: hue, saturation and value.
#[inline(always)]
pub fn hsv_from_rgb(red: &Lanes, green: &Lanes, blue: &Lanes, out: &mut [Lanes; 3]) {
    let (red, green, blue) = (*red, *green, *blue);
    let mut channels = [[0.0; LANES]; 3];
    for i in 0..LANES {
        let hsv = color::hsv_from_rgb(Vec3::new(red[i], green[i], blue[i]));
        [channels[0][i], channels[1][i], channels[2][i]] = hsv.to_array();
    }
    *out = channels;
}

/// The hash of each lane, of a float or a vector: with seed 0 `hash`, with 1 to 3 a channel of `hash_color`.
#[inline(always)]
pub fn seeded_hash<const N: usize>(components: [&Lanes; N], seed: u32, out: &mut Lanes) {
    let mut results = [0.0; LANES];
    for i in 0..LANES {
        results[i] = hashes::of_floats(seed, &components.map(|component| component[i]));
    }
    *out = results;
}

/// `hash` of each lane: of a float or a vector.
#[inline(always)]
pub fn hash<const N: usize>(components: [&Lanes; N], out: &mut Lanes) {
    seeded_hash(components, 0, out);
}

/// `hash_color` of each lane: of a float or a vector.
#[inline(always)]
pub fn hash_color<const N: usize>(components: [&Lanes; N], out: &mut [Lanes; 3]) {
    let [red, green, blue] = out;
    seeded_hash(components, 1, red);
    seeded_hash(components, 2, green);
    seeded_hash(components, 3, blue);
}

/// The hash of each lane, of an int: with seed 0 `hash`, with 1 to 3 a channel of `hash_color`.
#[inline(always)]
pub fn seeded_hash_int(x: &[i64; LANES], seed: u32, out: &mut Lanes) {
    let x = *x;
    let mut results = [0.0; LANES];
    for i in 0..LANES {
        results[i] = hashes::of_int(seed, x[i]);
    }
    *out = results;
}

/// `hash` of each lane: of an int.
#[inline(always)]
pub fn hash_int(x: &[i64; LANES], out: &mut Lanes) {
    seeded_hash_int(x, 0, out);
}

/// `hash_color` of each lane: of an int.
#[inline(always)]
pub fn hash_color_int(x: &[i64; LANES], out: &mut [Lanes; 3]) {
    let [red, green, blue] = out;
    seeded_hash_int(x, 1, red);
    seeded_hash_int(x, 2, green);
    seeded_hash_int(x, 3, blue);
}

#[cfg(test)]
mod tests {
    use super::super::check::{Numbers, same_bits};
    use super::*;
    use crate::math;
    use crate::shade::library::math as scalar;

    const COUNT: usize = 500_000;

    #[test]
    fn functions_of_one_number_are_the_same_in_batches() {
        let mut numbers = Numbers::new(5);
        let mut next = || [numbers.any()];
        same_bits("floor", COUNT, &mut next, |[x]| [x.floor()], |[x], [out]| floor(x, out));
        same_bits("ceil", COUNT, &mut next, |[x]| [x.ceil()], |[x], [out]| ceil(x, out));
        same_bits("round", COUNT, &mut next, |[x]| [x.round()], |[x], [out]| round(x, out));
        same_bits("fract", COUNT, &mut next, |[x]| [scalar::fract(x)], |[x], [out]| fract(x, out));
        same_bits("sign", COUNT, &mut next, |[x]| [scalar::sign(x)], |[x], [out]| sign(x, out));
        let srgb = |[x]: [f32; 1]| [math::linear_from_srgb(x)];
        same_bits("srgb", COUNT, &mut next, srgb, |[x], [out]| linear_from_srgb(x, out));
    }

    #[test]
    fn functions_of_many_numbers_are_the_same_in_batches() {
        let mut numbers = Numbers::new(6);
        let mut next = || [numbers.any(), numbers.any()];
        same_bits(
            "mod",
            COUNT,
            &mut next,
            |[x, y]| [scalar::floored_mod(x, y)],
            |[x, y], [out]| floored_mod(x, y, out),
        );
        let mut next = || std::array::from_fn(|_| numbers.any());
        same_bits(
            "smoothstep",
            COUNT,
            &mut next,
            |[low, high, x]| [scalar::smoothstep(low, high, x)],
            |[low, high, x], [out]| {
                smoothstep(low, high, x, out);
            },
        );
        same_bits(
            "smoothstep",
            COUNT,
            || [1.0, 1.0, 2.0],
            |[low, high, x]| [scalar::smoothstep(low, high, x)],
            |[low, high, x], [out]| {
                smoothstep(low, high, x, out);
            },
        );
        let mut next = || std::array::from_fn(|_| numbers.any());
        same_bits(
            "remap",
            COUNT,
            &mut next,
            |[x, a, b, c, d]| [scalar::remap(x, a, b, c, d)],
            |[x, a, b, c, d], [out]| {
                remap(x, a, b, c, d, out);
            },
        );
    }

    #[test]
    fn colors_are_the_same_in_batches() {
        let mut numbers = Numbers::new(7);
        let mut next = || std::array::from_fn(|_| numbers.any());
        same_bits(
            "hsv",
            COUNT,
            &mut next,
            |[h, s, v]| color::rgb_from_hsv(h, s, v).to_array(),
            |[h, s, v], out| {
                rgb_from_hsv(h, s, v, out);
            },
        );
        same_bits(
            "hsv_from_rgb",
            COUNT,
            &mut next,
            |rgb| color::hsv_from_rgb(rgb.into()).to_array(),
            |[r, g, b], out| {
                hsv_from_rgb(r, g, b, out);
            },
        );
    }

    #[test]
    fn hashes_are_the_same_in_batches() {
        let mut numbers = Numbers::new(8);
        let mut next = || std::array::from_fn(|_| numbers.any());
        let both = |components: &[f32]| [0, 1, 2, 3].map(|seed| hashes::of_floats(seed, components));
        same_bits(
            "hash",
            COUNT,
            || next().map(|x: f32| x),
            |[x, _]| both(&[x]),
            |[x, _], [h, color @ ..]| {
                hash([x], h);
                hash_color([x], color);
            },
        );
        let mut next = || std::array::from_fn(|_| numbers.any());
        same_bits(
            "hash",
            COUNT,
            &mut next,
            |v: [f32; 2]| both(&v),
            |[x, y], [h, color @ ..]| {
                hash([x, y], h);
                hash_color([x, y], color);
            },
        );
        let mut next = || std::array::from_fn(|_| numbers.any());
        same_bits(
            "hash",
            COUNT,
            &mut next,
            |v: [f32; 3]| both(&v),
            |[x, y, z], [h, color @ ..]| {
                hash([x, y, z], h);
                hash_color([x, y, z], color);
            },
        );
        let mut next = || std::array::from_fn(|_| numbers.any());
        same_bits(
            "hash",
            COUNT,
            &mut next,
            |v: [f32; 4]| both(&v),
            |[x, y, z, w], [h, color @ ..]| {
                hash([x, y, z, w], h);
                hash_color([x, y, z, w], color);
            },
        );
        for _ in 0..10_000 {
            let x: [i64; LANES] = std::array::from_fn(|_| numbers.bits() as i64 >> numbers.below(64));
            let (mut h, mut color) = ([0.0; LANES], [[0.0; LANES]; 3]);
            hash_int(&x, &mut h);
            hash_color_int(&x, &mut color);
            for lane in 0..LANES {
                let wanted = [0, 1, 2, 3].map(|seed| hashes::of_int(seed, x[lane]));
                assert_eq!(wanted, [h[lane], color[0][lane], color[1][lane], color[2][lane]]);
            }
        }
    }
}
