//! Batch forms of the noise functions: the arithmetic of `fastnoise-lite`, laid out for vectors.
//!
//! A point beyond ±2²⁰ or with a NaN is treated as by the scalar form. What makes these fast: whole parts are found by
//! adding and subtracting a number instead of by a saturating conversion, and the gradients of 3-D Perlin noise by
//! shifting constants instead of by looking them up.

mod cells;
mod tables;

pub use cells::{cell_id_2d, cell_id_3d, cellular_noise_2d, cellular_noise_3d};

use super::{LANES, Lanes};
use tables::GRADIENTS_2D;

/// Coordinates are clamped to ± this.
const LIMIT: f32 = 1_048_576.0;

const SEED: i32 = 1337;
const PRIME_X: i32 = 501_125_321;
const PRIME_Y: i32 = 1_136_930_381;
const PRIME_Z: i32 = 1_720_413_743;

/// The sign of a float.
const SIGN: u32 = 1 << 31;

/// Adding it to a number of at most 2²² rounds that to a whole one, which then stands in the low bits.
const ROUNDER: f32 = 12_582_912.0;

/// The number whose sum with [`ROUNDER`] this is.
#[inline(always)]
fn whole(sum: f32) -> i32 {
    sum.to_bits().wrapping_sub(ROUNDER.to_bits()) as i32
}

/// A coordinate within the limits; NaN stays.
#[inline(always)]
fn clamp(x: f32) -> f32 {
    let x = if x < -LIMIT { -LIMIT } else { x };
    if LIMIT < x { LIMIT } else { x }
}

#[inline(always)]
fn scramble(hash: i32) -> i32 {
    hash.wrapping_mul(0x27d4_eb2d)
}

/// The source's floor: of a negative whole number it is the one below. `x` is at most 2²².
#[inline(always)]
fn floor(x: f32) -> i32 {
    let sum = x + ROUNDER;
    let near = sum - ROUNDER;
    // Wrapping, because a NaN has any whole part.
    whole(sum).wrapping_sub(i32::from(if x >= 0.0 { near > x } else { near >= x }))
}

/// [`floor`] for numbers of at most 2³⁰, such as the coordinates of high octaves.
#[inline(always)]
fn floor_far(x: f32) -> i32 {
    let sum = x * (1.0 / 4096.0) + ROUNDER;
    let rest = x - (sum - ROUNDER) * 4096.0;
    let rest_sum = rest + ROUNDER;
    let near = rest_sum - ROUNDER;
    let above = if x >= 0.0 { near > rest } else { near >= rest };
    (whole(sum) << 12).wrapping_add(whole(rest_sum)).wrapping_sub(i32::from(above))
}

#[inline(always)]
fn lerp(a: f32, b: f32, t: f32) -> f32 {
    a + t * (b - a)
}

#[inline(always)]
fn quintic(t: f32) -> f32 {
    t * t * t * (t * (t * 6.0 - 15.0) + 10.0)
}

#[inline(always)]
fn hermite(t: f32) -> f32 {
    t * t * (t * -2.0 + 3.0)
}

/// For each of the 64 gradients a truth: those of even gradients in one word and of odd ones in the other, from the top.
const fn truths(which: u32) -> [u32; 2] {
    let mut words = [0, 0];
    let mut index = 0;
    while index < 64 {
        // Twelve directions to the edges of a cube, five times over, and then four of them once more.
        let edge = if index < 60 { index % 12 } else { [8, 1, 9, 3][index - 60] };
        let truth = match which {
            0 => edge < 4,
            1 => edge >= 8,
            2 => edge & 1 != 0,
            _ => edge & 2 != 0,
        };
        if truth {
            words[index & 1] |= SIGN >> (index >> 1);
        }
        index += 1;
    }
    words
}

/// Along x the gradient is 0: then `u` is along y, else along x.
const WITHOUT_X: [u32; 2] = truths(0);
/// Along z the gradient is 0: then `v` is along y, else along z.
const WITHOUT_Z: [u32; 2] = truths(1);
/// `u` is negative.
const U_NEGATIVE: [u32; 2] = truths(2);
/// `v` is negative.
const V_NEGATIVE: [u32; 2] = truths(3);

/// The product of a gradient and the way from its corner. The gradient's components are 0 and ±1, so it is a sum of two
/// of the way's components. The third adds nothing but the sign of a zero, which it does only if `EXACT`.
#[inline(always)]
fn gradient_3d<const EXACT: bool>(hash: i32, x: f32, y: f32, z: f32) -> f32 {
    let hash = scramble(hash);
    let hash = hash ^ (hash >> 15);
    let odd = hash & 4 != 0;
    let place = (hash >> 3) as u32;
    let truth = |words: [u32; 2]| (if odd { words[1] } else { words[0] }).wrapping_shl(place);
    let without_x = (truth(WITHOUT_X) as i32) < 0;
    let without_z = (truth(WITHOUT_Z) as i32) < 0;
    let u = if without_x { y } else { x };
    let v = if without_z { y } else { z };
    let u = f32::from_bits(u.to_bits() ^ (truth(U_NEGATIVE) & SIGN));
    let v = f32::from_bits(v.to_bits() ^ (truth(V_NEGATIVE) & SIGN));
    if EXACT {
        let w = if without_x {
            x
        } else if without_z {
            z
        } else {
            y
        };
        (u + v) + w * 0.0
    } else {
        u + v
    }
}

#[inline(always)]
fn perlin_3d<const EXACT: bool>(seed: i32, [x, y, z]: [f32; 3], [x0, y0, z0]: [i32; 3]) -> f32 {
    let (xd0, yd0, zd0) = (x - x0 as f32, y - y0 as f32, z - z0 as f32);
    let (xd1, yd1, zd1) = (xd0 - 1.0, yd0 - 1.0, zd0 - 1.0);
    let (xs, ys, zs) = (quintic(xd0), quintic(yd0), quintic(zd0));
    let (x0, y0, z0) = (x0.wrapping_mul(PRIME_X), y0.wrapping_mul(PRIME_Y), z0.wrapping_mul(PRIME_Z));
    let (x1, y1, z1) = (x0.wrapping_add(PRIME_X), y0.wrapping_add(PRIME_Y), z0.wrapping_add(PRIME_Z));
    let (x0, x1) = (x0 ^ seed, x1 ^ seed);
    let row = |yz: i32, yd: f32, zd: f32| {
        lerp(gradient_3d::<EXACT>(x0 ^ yz, xd0, yd, zd), gradient_3d::<EXACT>(x1 ^ yz, xd1, yd, zd), xs)
    };
    let yf0 = lerp(row(y0 ^ z0, yd0, zd0), row(y1 ^ z0, yd1, zd0), ys);
    let yf1 = lerp(row(y0 ^ z1, yd0, zd1), row(y1 ^ z1, yd1, zd1), ys);
    lerp(yf0, yf1, zs) * 0.964_921_4
}

/// A component of all 128 gradients.
const fn spread(component: usize) -> [f32; 128] {
    let mut table = [0.0; 128];
    let mut index = 0;
    while index < 128 {
        table[index] = GRADIENTS_2D[if index < 120 { index % 24 } else { index - 96 }][component];
        index += 1;
    }
    table
}
static GRADIENT_X: [f32; 128] = spread(0);
static GRADIENT_Y: [f32; 128] = spread(1);

#[inline(always)]
fn gradient_2d(hash: i32, x: f32, y: f32) -> f32 {
    let hash = scramble(hash);
    let index = ((hash ^ (hash >> 15)) >> 1 & 127) as usize;
    x * GRADIENT_X[index] + y * GRADIENT_Y[index]
}

#[inline(always)]
fn perlin_2d(seed: i32, [x, y]: [f32; 2], [x0, y0]: [i32; 2]) -> f32 {
    let (xd0, yd0) = (x - x0 as f32, y - y0 as f32);
    let (xd1, yd1) = (xd0 - 1.0, yd0 - 1.0);
    let (xs, ys) = (quintic(xd0), quintic(yd0));
    let (x0, y0) = (x0.wrapping_mul(PRIME_X), y0.wrapping_mul(PRIME_Y));
    let (x1, y1) = (x0.wrapping_add(PRIME_X), y0.wrapping_add(PRIME_Y));
    let (x0, x1) = (x0 ^ seed, x1 ^ seed);
    let xf0 = lerp(gradient_2d(x0 ^ y0, xd0, yd0), gradient_2d(x1 ^ y0, xd1, yd0), xs);
    let xf1 = lerp(gradient_2d(x0 ^ y1, xd0, yd1), gradient_2d(x1 ^ y1, xd1, yd1), xs);
    lerp(xf0, xf1, ys) * 1.424_769_2
}

/// `gradient_noise` of a vec2.
#[inline(always)]
pub fn gradient_noise_2d(x: &Lanes, y: &Lanes, out: &mut Lanes) {
    for i in 0..LANES {
        let (x, y) = (clamp(x[i]), clamp(y[i]));
        let n = perlin_2d(SEED, [x, y], [floor(x), floor(y)]);
        out[i] = if x.is_nan() | y.is_nan() { f32::NAN } else { n };
    }
}

/// `gradient_noise` of a vec3.
#[inline(always)]
pub fn gradient_noise_3d(x: &Lanes, y: &Lanes, z: &Lanes, out: &mut Lanes) {
    // A lattice point may want the other zero.
    if gradient_lanes_3d::<false>(x, y, z, out) {
        gradient_lanes_3d::<true>(x, y, z, out);
    }
}

/// Tells whether any result is zero.
#[inline(always)]
fn gradient_lanes_3d<const EXACT: bool>(x: &Lanes, y: &Lanes, z: &Lanes, out: &mut Lanes) -> bool {
    let mut zero = false;
    for i in 0..LANES {
        let (x, y, z) = (clamp(x[i]), clamp(y[i]), clamp(z[i]));
        let n = perlin_3d::<EXACT>(SEED, [x, y, z], [floor(x), floor(y), floor(z)]);
        zero |= n == 0.0;
        out[i] = if x.is_nan() | y.is_nan() | z.is_nan() { f32::NAN } else { n };
    }
    zero
}

/// The strength of the first octave, with which the sum over all stays within ±1.
#[inline(always)]
fn bounding(octaves: u32) -> f32 {
    let (mut amplitude, mut sum) = (0.5, 1.0);
    for _ in 1..octaves {
        sum += amplitude;
        amplitude *= 0.5;
    }
    1.0 / sum
}

/// `fbm` of a vec2, with 1 to 10 octaves.
#[inline(always)]
pub fn fbm_2d(x: &Lanes, y: &Lanes, octaves: u32, out: &mut Lanes) {
    let mut amplitude = bounding(octaves);
    let mut scale = 1.0;
    let mut sum = [0.0; LANES];
    for octave in 0..octaves {
        for i in 0..LANES {
            let (x, y) = (clamp(x[i]) * scale, clamp(y[i]) * scale);
            sum[i] += perlin_2d(SEED + octave as i32, [x, y], [floor_far(x), floor_far(y)]) * amplitude;
        }
        amplitude *= 0.5;
        scale *= 2.0;
    }
    for i in 0..LANES {
        out[i] = if x[i].is_nan() | y[i].is_nan() { f32::NAN } else { sum[i] };
    }
}

/// `fbm` of a vec3, with 1 to 10 octaves.
#[inline(always)]
pub fn fbm_3d(x: &Lanes, y: &Lanes, z: &Lanes, octaves: u32, out: &mut Lanes) {
    let mut amplitude = bounding(octaves);
    let mut scale = 1.0;
    let mut sum = [0.0; LANES];
    for octave in 0..octaves {
        for i in 0..LANES {
            let (x, y, z) = (clamp(x[i]) * scale, clamp(y[i]) * scale, clamp(z[i]) * scale);
            let whole = [floor_far(x), floor_far(y), floor_far(z)];
            // The sum starts at +0, to which the sign of another zero makes no difference.
            sum[i] += perlin_3d::<false>(SEED + octave as i32, [x, y, z], whole) * amplitude;
        }
        amplitude *= 0.5;
        scale *= 2.0;
    }
    for i in 0..LANES {
        out[i] = if x[i].is_nan() | y[i].is_nan() | z[i].is_nan() { f32::NAN } else { sum[i] };
    }
}

#[inline(always)]
fn value(hash: i32) -> f32 {
    let hash = scramble(hash);
    let hash = hash.wrapping_mul(hash);
    let hash = hash ^ (hash << 19);
    hash as f32 * (1.0 / 2_147_483_648.0)
}

/// `value_noise` of a vec2.
#[inline(always)]
pub fn value_noise_2d(x: &Lanes, y: &Lanes, out: &mut Lanes) {
    for i in 0..LANES {
        let (x, y) = (clamp(x[i]), clamp(y[i]));
        let (x0, y0) = (floor(x), floor(y));
        let (xs, ys) = (hermite(x - x0 as f32), hermite(y - y0 as f32));
        let (x0, y0) = (x0.wrapping_mul(PRIME_X), y0.wrapping_mul(PRIME_Y));
        let (x1, y1) = (x0.wrapping_add(PRIME_X), y0.wrapping_add(PRIME_Y));
        let row = |y: i32| lerp(value(SEED ^ x0 ^ y), value(SEED ^ x1 ^ y), xs);
        let n = 0.5 + 0.5 * lerp(row(y0), row(y1), ys);
        out[i] = if x.is_nan() | y.is_nan() { f32::NAN } else { n };
    }
}

/// `value_noise` of a vec3.
#[inline(always)]
pub fn value_noise_3d(x: &Lanes, y: &Lanes, z: &Lanes, out: &mut Lanes) {
    for i in 0..LANES {
        let (x, y, z) = (clamp(x[i]), clamp(y[i]), clamp(z[i]));
        let (x0, y0, z0) = (floor(x), floor(y), floor(z));
        let (xs, ys, zs) = (hermite(x - x0 as f32), hermite(y - y0 as f32), hermite(z - z0 as f32));
        let (x0, y0, z0) = (x0.wrapping_mul(PRIME_X), y0.wrapping_mul(PRIME_Y), z0.wrapping_mul(PRIME_Z));
        let (x1, y1, z1) = (x0.wrapping_add(PRIME_X), y0.wrapping_add(PRIME_Y), z0.wrapping_add(PRIME_Z));
        let row = |yz: i32| lerp(value(SEED ^ x0 ^ yz), value(SEED ^ x1 ^ yz), xs);
        let yf0 = lerp(row(y0 ^ z0), row(y1 ^ z0), ys);
        let yf1 = lerp(row(y0 ^ z1), row(y1 ^ z1), ys);
        let n = 0.5 + 0.5 * lerp(yf0, yf1, zs);
        out[i] = if x.is_nan() | y.is_nan() | z.is_nan() { f32::NAN } else { n };
    }
}

#[cfg(test)]
mod tests {
    use super::super::check::{Numbers, same_bits};
    use super::*;
    use crate::shade::library::noise as scalar;

    const COUNT: usize = 200_000;

    #[test]
    fn noise_of_vec2_is_the_same_in_batches() {
        let mut numbers = Numbers::new(1);
        let mut next = || [numbers.any(), numbers.any()];
        same_bits(
            "value_noise",
            COUNT,
            &mut next,
            |p| [scalar::value_noise(p)],
            |[x, y], [out]| value_noise_2d(x, y, out),
        );
        same_bits(
            "gradient_noise",
            COUNT,
            &mut next,
            |p| [scalar::gradient_noise(p)],
            |[x, y], [out]| {
                gradient_noise_2d(x, y, out);
            },
        );
        same_bits(
            "cellular_noise",
            COUNT,
            &mut next,
            |p| [scalar::cellular_noise(p)],
            |[x, y], [out]| {
                cellular_noise_2d(x, y, out);
            },
        );
        same_bits("cell_id", COUNT, &mut next, |p| [scalar::cell_id(p)], |[x, y], [out]| cell_id_2d(x, y, out));
        for octaves in 1..=10 {
            same_bits(
                "fbm",
                COUNT / 10,
                &mut next,
                |p| [scalar::fbm(p, i64::from(octaves))],
                |[x, y], [out]| {
                    fbm_2d(x, y, octaves, out);
                },
            );
        }
    }

    #[test]
    fn noise_of_vec3_is_the_same_in_batches() {
        let mut numbers = Numbers::new(2);
        let mut next = || [numbers.any(), numbers.any(), numbers.any()];
        same_bits(
            "value_noise",
            COUNT,
            &mut next,
            |p| [scalar::value_noise(p)],
            |[x, y, z], [out]| {
                value_noise_3d(x, y, z, out);
            },
        );
        same_bits(
            "gradient_noise",
            COUNT,
            &mut next,
            |p| [scalar::gradient_noise(p)],
            |[x, y, z], [out]| {
                gradient_noise_3d(x, y, z, out);
            },
        );
        same_bits(
            "cellular_noise",
            COUNT,
            &mut next,
            |p| [scalar::cellular_noise(p)],
            |[x, y, z], [out]| {
                cellular_noise_3d(x, y, z, out);
            },
        );
        same_bits("cell_id", COUNT, &mut next, |p| [scalar::cell_id(p)], |[x, y, z], [out]| cell_id_3d(x, y, z, out));
        for octaves in 1..=10 {
            same_bits(
                "fbm",
                COUNT / 10,
                &mut next,
                |p| [scalar::fbm(p, i64::from(octaves))],
                |[x, y, z], [out]| {
                    fbm_3d(x, y, z, octaves, out);
                },
            );
        }
    }

    /// Around lattice points the signs of zeros differ most.
    #[test]
    fn noise_at_lattice_points_is_the_same_in_batches() {
        const NEAR: [f32; 12] =
            [0.0, -0.0, 1.0, -1.0, 2.0, -2.0, 1e-45, -1e-45, 1e-9, -1e-9, 0.999_999_94, -0.999_999_94];
        let mut numbers = Numbers::new(3);
        let mut near = || NEAR[numbers.below(12) as usize];
        let mut next = || [near(), near(), near()];
        same_bits(
            "gradient_noise",
            COUNT,
            &mut next,
            |p| [scalar::gradient_noise(p)],
            |[x, y, z], [out]| {
                gradient_noise_3d(x, y, z, out);
            },
        );
        same_bits("fbm", COUNT, &mut next, |p| [scalar::fbm(p, 3)], |[x, y, z], [out]| fbm_3d(x, y, z, 3, out));
        same_bits(
            "gradient_noise",
            COUNT,
            &mut next,
            |[x, y, _]| [scalar::gradient_noise([x, y])],
            |[x, y, _], [out]| {
                gradient_noise_2d(x, y, out);
            },
        );
    }
}
