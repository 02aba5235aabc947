//! Batch forms of cellular noise: of the points scattered one to a cell, the nearest in the 3 × 3 (× 3) cells around.

use super::tables::{RANDOM_2D, RANDOM_3D};
use super::{LANES, Lanes, PRIME_X, PRIME_Y, PRIME_Z, SEED, clamp, floor, scramble};

/// A component of the places of the points in their cells, from the middle: `vectors` scaled by `reach`.
const fn scattered<const N: usize>(vectors: [[f32; N]; 256], component: usize, reach: f32) -> [f32; 256] {
    let mut table = [0.0; 256];
    let mut index = 0;
    while index < 256 {
        table[index] = vectors[index][component] * reach;
        index += 1;
    }
    table
}
const REACH_2D: f32 = 0.437_015_95;
const REACH_3D: f32 = 0.396_143_53;
static X_2D: [f32; 256] = scattered(RANDOM_2D, 0, REACH_2D);
static Y_2D: [f32; 256] = scattered(RANDOM_2D, 1, REACH_2D);
static X_3D: [f32; 256] = scattered(RANDOM_3D, 0, REACH_3D);
static Y_3D: [f32; 256] = scattered(RANDOM_3D, 1, REACH_3D);
static Z_3D: [f32; 256] = scattered(RANDOM_3D, 2, REACH_3D);

/// The nearest whole number, halves away from zero. `x` is at most 2²¹.
#[inline(always)]
fn round(x: f32) -> i32 {
    let whole = floor(x.abs() + 0.5);
    if x < 0.0 { whole.wrapping_neg() } else { whole }
}

/// The points nearest to each lane's place.
struct Nearest {
    /// The squared distance to the nearest.
    first: Lanes,
    /// The squared distance to the next.
    second: Lanes,
    /// The hash of the cell of the nearest.
    hash: [i32; LANES],
}

impl Nearest {
    #[inline(always)]
    fn new() -> Self {
        Self { first: [f32::MAX; LANES], second: [f32::MAX; LANES], hash: [0; LANES] }
    }

    /// Sees another point of a lane.
    #[inline(always)]
    fn see(&mut self, lane: usize, squared: f32, hash: i32) {
        let (first, second) = (self.first[lane], self.second[lane]);
        let second = if squared < second { squared } else { second };
        self.second[lane] = if second < first { first } else { second };
        self.hash[lane] = if squared < first { hash } else { self.hash[lane] };
        self.first[lane] = if squared < first { squared } else { first };
    }
}

#[inline(always)]
fn nearest_2d(x: &Lanes, y: &Lanes) -> Nearest {
    let x: Lanes = std::array::from_fn(|i| clamp(x[i]));
    let y: Lanes = std::array::from_fn(|i| clamp(y[i]));
    let column: [i32; LANES] = std::array::from_fn(|i| round(x[i]));
    let row: [i32; LANES] = std::array::from_fn(|i| round(y[i]));
    let mut nearest = Nearest::new();
    for dx in -1..=1 {
        for dy in -1..=1 {
            for i in 0..LANES {
                let (xi, yi) = (column[i].wrapping_add(dx), row[i].wrapping_add(dy));
                let hash = scramble(SEED ^ xi.wrapping_mul(PRIME_X) ^ yi.wrapping_mul(PRIME_Y));
                let index = (hash >> 1 & 255) as usize;
                let to_x = (xi as f32 - x[i]) + X_2D[index];
                let to_y = (yi as f32 - y[i]) + Y_2D[index];
                let squared = to_x * to_x + to_y * to_y;
                nearest.see(i, squared, hash);
            }
        }
    }
    nearest
}

#[inline(always)]
fn nearest_3d(x: &Lanes, y: &Lanes, z: &Lanes) -> Nearest {
    let x: Lanes = std::array::from_fn(|i| clamp(x[i]));
    let y: Lanes = std::array::from_fn(|i| clamp(y[i]));
    let z: Lanes = std::array::from_fn(|i| clamp(z[i]));
    let x0: [i32; LANES] = std::array::from_fn(|i| round(x[i]));
    let y0: [i32; LANES] = std::array::from_fn(|i| round(y[i]));
    let z0: [i32; LANES] = std::array::from_fn(|i| round(z[i]));
    let mut nearest = Nearest::new();
    for dx in -1..=1 {
        for dy in -1..=1 {
            for dz in -1..=1 {
                for i in 0..LANES {
                    let (xi, yi, zi) = (x0[i].wrapping_add(dx), y0[i].wrapping_add(dy), z0[i].wrapping_add(dz));
                    let hash =
                        scramble(SEED ^ xi.wrapping_mul(PRIME_X) ^ yi.wrapping_mul(PRIME_Y) ^ zi.wrapping_mul(PRIME_Z));
                    let index = (hash >> 2 & 255) as usize;
                    let to_x = (xi as f32 - x[i]) + X_3D[index];
                    let to_y = (yi as f32 - y[i]) + Y_3D[index];
                    let to_z = (zi as f32 - z[i]) + Z_3D[index];
                    let squared = to_x * to_x + to_y * to_y + to_z * to_z;
                    nearest.see(i, squared, hash);
                }
            }
        }
    }
    nearest
}

/// `cellular_noise` of a vec2.
#[inline(always)]
pub fn cellular_noise_2d(x: &Lanes, y: &Lanes, out: &mut Lanes) {
    let Nearest { first, .. } = nearest_2d(x, y);
    for i in 0..LANES {
        let n = (first[i].sqrt() - 1.0) + 1.0;
        out[i] = if x[i].is_nan() | y[i].is_nan() { f32::NAN } else { n };
    }
}

/// `cellular_noise` of a vec3.
#[inline(always)]
pub fn cellular_noise_3d(x: &Lanes, y: &Lanes, z: &Lanes, out: &mut Lanes) {
    let Nearest { first, .. } = nearest_3d(x, y, z);
    for i in 0..LANES {
        let n = (first[i].sqrt() - 1.0) + 1.0;
        out[i] = if x[i].is_nan() | y[i].is_nan() | z[i].is_nan() { f32::NAN } else { n };
    }
}

/// `cell_id` of a vec2.
#[inline(always)]
pub fn cell_id_2d(x: &Lanes, y: &Lanes, out: &mut Lanes) {
    let Nearest { hash, .. } = nearest_2d(x, y);
    for i in 0..LANES {
        let n = 0.5 + 0.5 * (hash[i] as f32 * (1.0 / 2_147_483_648.0));
        out[i] = if x[i].is_nan() | y[i].is_nan() { f32::NAN } else { n };
    }
}

/// `cell_id` of a vec3.
#[inline(always)]
pub fn cell_id_3d(x: &Lanes, y: &Lanes, z: &Lanes, out: &mut Lanes) {
    let Nearest { hash, .. } = nearest_3d(x, y, z);
    for i in 0..LANES {
        let n = 0.5 + 0.5 * (hash[i] as f32 * (1.0 / 2_147_483_648.0));
        out[i] = if x[i].is_nan() | y[i].is_nan() | z[i].is_nan() { f32::NAN } else { n };
    }
}

/// F1 and F2 − F1 of each lane, less 1 and plus 1 again as the scalar form has it; NaN where `valid` is not.
#[inline(always)]
fn distances(nearest: &Nearest, valid: impl Fn(usize) -> bool, out: &mut [Lanes; 2]) {
    let [nears, gaps] = out;
    for (i, (near, gap)) in nears.iter_mut().zip(gaps).enumerate() {
        let (first, second) = (nearest.first[i].sqrt(), nearest.second[i].sqrt());
        *near = if valid(i) { (first - 1.0) + 1.0 } else { f32::NAN };
        *gap = if valid(i) { (second - first - 1.0) + 1.0 } else { f32::NAN };
    }
}

/// `worley` of a vec2.
#[inline(always)]
pub fn worley_2d(x: &Lanes, y: &Lanes, out: &mut [Lanes; 2]) {
    distances(&nearest_2d(x, y), |i| !(x[i].is_nan() | y[i].is_nan()), out);
}

/// `worley` of a vec3.
#[inline(always)]
pub fn worley_3d(x: &Lanes, y: &Lanes, z: &Lanes, out: &mut [Lanes; 2]) {
    distances(&nearest_3d(x, y, z), |i| !(x[i].is_nan() | y[i].is_nan() | z[i].is_nan()), out);
}
