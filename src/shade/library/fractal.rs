//! Noise beyond that of `noise`, from the same source: Worley noise, and layers of any fineness and strength.
//!
//! As there, a component beyond ±2²⁰ counts as ±2²⁰, and a point with a NaN gives NaN.

use std::sync::LazyLock;

use fastnoise_lite::{CellularDistanceFunction, CellularReturnType, FastNoiseLite, NoiseType};
use rhai::{Dynamic, Engine};

use super::Function;
use super::math::clamp;
use super::operand::{Operand, Outcome, number, refuse};
use crate::math::Vec2;
use crate::shade::fault::Fault;

pub(super) const FUNCTIONS: &[Function] = &[
    Function {
        name: "fbm",
        form: "fbm(point, octaves, lacunarity, gain)",
        about: "the same, each octave `lacunarity` (1 … 4) times as fine and `gain` (0 … 1) times as strong as the last",
        types: "vec2 or vec3, int, number 1 … 4, number 0 … 1 → number, −1 … 1",
        example: "fbm(hit.position, 5, 2.3, 0.6)",
    },
    Function {
        name: "worley",
        form: "worley(point)",
        about: "vec2 of the distance F1 to the nearest of scattered points, as `cellular_noise`, and F2 − F1, 0 on the \
                border between two cells",
        types: "vec2 or vec3 → vec2, 0 … 1.5 and 0 … 2",
        example: "1.0 - smoothstep(0.0, 0.1, worley(hit.uv * 10.0).y)",
    },
];

const LIMIT: f32 = 1_048_576.0;
const MAX_OCTAVES: i64 = 10;
/// Seed of the first octave, as the source has it.
const SEED: i32 = 1337;

struct Generators {
    nearest: FastNoiseLite,
    gap: FastNoiseLite,
    octaves: Vec<FastNoiseLite>,
}

fn cells(given: CellularReturnType) -> FastNoiseLite {
    let mut noise = FastNoiseLite::new();
    noise.set_frequency(Some(1.0));
    noise.set_noise_type(Some(NoiseType::Cellular));
    noise.set_cellular_distance_function(Some(CellularDistanceFunction::Euclidean));
    noise.set_cellular_return_type(Some(given));
    noise
}

static GENERATORS: LazyLock<Generators> = LazyLock::new(|| Generators {
    nearest: cells(CellularReturnType::Distance),
    gap: cells(CellularReturnType::Distance2Sub),
    octaves: (0..MAX_OCTAVES as i32)
        .map(|octave| {
            let mut noise = FastNoiseLite::with_seed(SEED + octave);
            noise.set_frequency(Some(1.0));
            noise.set_noise_type(Some(NoiseType::Perlin));
            noise
        })
        .collect(),
});

/// A noise at a point of two or three coordinates; NaN where one is NaN.
fn at(noise: &FastNoiseLite, [x, y]: [f32; 2], z: Option<f32>) -> f32 {
    let [x, y] = [x, y].map(|x| clamp(x, -LIMIT, LIMIT));
    let z = z.map(|z| clamp(z, -LIMIT, LIMIT));
    if x.is_nan() || y.is_nan() || z.is_some_and(f32::is_nan) {
        return f32::NAN;
    }
    match z {
        None => noise.get_noise_2d(x, y),
        Some(z) => noise.get_noise_3d(x, y, z),
    }
}

/// The distances F1 and F2 − F1. (The source gives both less 1.)
pub(in crate::shade) fn worley(xy: [f32; 2], z: Option<f32>) -> Vec2 {
    Vec2::new(at(&GENERATORS.nearest, xy, z) + 1.0, at(&GENERATORS.gap, xy, z) + 1.0)
}

/// With `amplitude` at first 1 / (1 + gain + gain² + …), summed in this order: for each octave,
/// `sum += noise(point) * amplitude`; then `amplitude *= gain` and `point *= lacunarity`. Octave number i has the seed
/// 1337 + i. With lacunarity 2 and gain 0.5 it is `fbm(point, octaves)` to the bit. `octaves` is 1 to 10.
pub(in crate::shade) fn layered(xy: [f32; 2], z: Option<f32>, octaves: usize, lacunarity: f32, gain: f32) -> f32 {
    let (mut total, mut share) = (1.0, gain);
    for _ in 1..octaves {
        total += share;
        share *= gain;
    }
    let (mut xy, mut z) = (xy, z);
    let (mut sum, mut amplitude) = (0.0, 1.0 / total);
    for noise in GENERATORS.octaves.iter().take(octaves) {
        sum += at(noise, xy, z) * amplitude;
        amplitude *= gain;
        xy = xy.map(|x| x * lacunarity);
        z = z.map(|z| z * lacunarity);
    }
    sum
}

fn point(name: &str, value: &Dynamic) -> Outcome<([f32; 2], Option<f32>)> {
    match Operand::of(value) {
        Some(Operand::Vec2(v)) => Ok(([v.x, v.y], None)),
        Some(Operand::Vec3(v)) => Ok(([v.x, v.y], Some(v.z))),
        _ => Err(refuse(name, std::slice::from_ref(value))),
    }
}

pub(super) fn register(engine: &mut Engine) {
    engine.register_fn("worley", |place: Dynamic| point("worley", &place).map(|(xy, z)| worley(xy, z)));
    engine.register_fn("fbm", |place: Dynamic, octaves: i64, lacunarity: Dynamic, gain: Dynamic| -> Outcome<f32> {
        let (xy, z) = point("fbm", &place)?;
        let (lacunarity, gain) = (number("fbm", &lacunarity)?, number("fbm", &gain)?);
        let refused = |what: String| -> Outcome<f32> { Err(Fault::new(format!("`fbm` takes {what}")).into()) };
        if !(1..=MAX_OCTAVES).contains(&octaves) {
            return refused(format!("1 to {MAX_OCTAVES} octaves, not {octaves}"));
        }
        if !(1.0..=4.0).contains(&lacunarity) {
            return refused(format!("a lacunarity of 1 to 4, not {lacunarity}"));
        }
        if !(0.0..=1.0).contains(&gain) {
            return refused(format!("a gain of 0 to 1, not {gain}"));
        }
        Ok(layered(xy, z, octaves as usize, lacunarity, gain))
    });
}
