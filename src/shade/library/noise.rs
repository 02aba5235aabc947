//! Noise: all from one source, `fastnoise-lite` with its portable arithmetic, at frequency 1.
//!
//! Points may be a vec2 or a vec3. A component beyond ±2²⁰ counts as ±2²⁰, where floats have an eighth of a unit left
//! between them; a point with a NaN gives NaN.

use fastnoise_lite::{CellularDistanceFunction, CellularReturnType, FastNoiseLite, FractalType, NoiseType};
use rhai::{Dynamic, Engine};

use super::Function;
use super::math::clamp;
use super::operand::{Operand, Outcome, number, refuse};
use crate::math::Vec2;
use crate::shade::fault::Fault;

pub(super) const FUNCTIONS: &[Function] = &[
    Function {
        name: "value_noise",
        form: "value_noise(point)",
        about: "smooth noise 0 … 1, lattice values interpolated",
        types: "vec2 or vec3 → number, 0 … 1",
        example: "value_noise(hit.position * 4.0)",
    },
    Function {
        name: "gradient_noise",
        form: "gradient_noise(point)",
        about: "Perlin noise −1 … 1, 0 at whole coordinates",
        types: "vec2 or vec3 → number, −1 … 1",
        example: "gradient_noise(hit.position * 4.0)",
    },
    Function {
        name: "cellular_noise",
        form: "cellular_noise(point)",
        about: "distance to the nearest of scattered points, 0 … 1.5",
        types: "vec2 or vec3 → number, 0 … 1.5",
        example: "cellular_noise(hit.uv * 10.0)",
    },
    Function {
        name: "cell_id",
        form: "cell_id(point)",
        about: "a number 0 … 1 that belongs to the nearest scattered point",
        types: "vec2 or vec3 → number, 0 … 1",
        example: "cell_id(hit.uv * 10.0)",
    },
    Function {
        name: "worley",
        form: "worley(point)",
        about: "vec2 of the distance F1 to the nearest of scattered points, as `cellular_noise`, and F2 − F1, 0 on the \
                border between two cells",
        types: "vec2 or vec3 → vec2, 0 … 1.5 and 0 … 2",
        example: "1.0 - smoothstep(0.0, 0.1, worley(hit.uv * 10.0).y)",
    },
    Function {
        name: "fbm",
        form: "fbm(point, octaves)",
        about: "gradient noise −1 … 1 summed over 1 to 10 octaves, each twice as fine and half as strong",
        types: "vec2 or vec3, int 1 … 10 → number, −1 … 1",
        example: "fbm(hit.position, 4)",
    },
    Function {
        name: "fbm",
        form: "fbm(point, octaves, lacunarity, gain)",
        about: "the same, each octave `lacunarity` (1 … 4) times as fine and `gain` (0 … 1) times as strong as the last",
        types: "vec2 or vec3, int, number 1 … 4, number 0 … 1 → number, −1 … 1",
        example: "fbm(hit.position, 5, 2.3, 0.6)",
    },
];

const LIMIT: f32 = 1_048_576.0;
const MAX_OCTAVES: i64 = 10;

fn noise(kind: NoiseType) -> FastNoiseLite {
    let mut noise = FastNoiseLite::new();
    noise.set_frequency(Some(1.0));
    noise.set_noise_type(Some(kind));
    noise
}

fn cells(given: CellularReturnType) -> FastNoiseLite {
    let mut noise = noise(NoiseType::Cellular);
    noise.set_cellular_distance_function(Some(CellularDistanceFunction::Euclidean));
    noise.set_cellular_return_type(Some(given));
    noise
}

fn sample(name: &str, noise: &FastNoiseLite, point: Dynamic) -> Outcome<f32> {
    let operand = match Operand::of(&point) {
        Some(operand @ (Operand::Vec2(_) | Operand::Vec3(_))) => operand,
        _ => return Err(refuse(name, &[point])),
    };
    let at = |lane| clamp(operand.lane(lane), -LIMIT, LIMIT);
    if (0..operand.width()).any(|lane| at(lane).is_nan()) {
        return Ok(f32::NAN);
    }
    Ok(match operand {
        Operand::Vec2(_) => noise.get_noise_2d(at(0), at(1)),
        _ => noise.get_noise_3d(at(0), at(1), at(2)),
    })
}

fn seeded(seed: i32) -> FastNoiseLite {
    let mut noise = noise(NoiseType::Perlin);
    noise.set_seed(Some(seed));
    noise
}

/// With `amplitude` at first 1 / (1 + gain + gain² + …), summed in this order: for each octave,
/// `sum += noise(point) * amplitude`; then `amplitude *= gain` and `point *= lacunarity`. Octave number i has the seed
/// 1337 + i. With lacunarity 2 and gain 0.5 it is `fbm(point, octaves)` to the bit.
fn layered(octaves: &[FastNoiseLite], point: Dynamic, lacunarity: f32, gain: f32) -> Outcome<f32> {
    let mut operand = match Operand::of(&point) {
        Some(operand @ (Operand::Vec2(_) | Operand::Vec3(_))) => operand,
        _ => return Err(refuse("fbm", &[point])),
    };
    let (mut total, mut share) = (1.0, gain);
    for _ in 1..octaves.len() {
        total += share;
        share *= gain;
    }
    let (mut sum, mut amplitude) = (0.0, 1.0 / total);
    for noise in octaves {
        let at = Operand::build(operand.width(), |lane| operand.lane(lane));
        sum += sample("fbm", noise, at)? * amplitude;
        amplitude *= gain;
        operand = match operand {
            Operand::Vec2(v) => Operand::Vec2(v * lacunarity),
            Operand::Vec3(v) => Operand::Vec3(v * lacunarity),
            other => other,
        };
    }
    Ok(sum)
}

pub(super) fn register(engine: &mut Engine) {
    let value = noise(NoiseType::Value);
    engine
        .register_fn("value_noise", move |point: Dynamic| sample("value_noise", &value, point).map(|n| 0.5 + 0.5 * n));
    let gradient = noise(NoiseType::Perlin);
    engine.register_fn("gradient_noise", move |point: Dynamic| sample("gradient_noise", &gradient, point));
    // The source gives the distance less 1.
    let distance = cells(CellularReturnType::Distance);
    engine.register_fn("cellular_noise", move |point: Dynamic| {
        sample("cellular_noise", &distance, point).map(|n| n + 1.0)
    });
    let id = cells(CellularReturnType::CellValue);
    engine.register_fn("cell_id", move |point: Dynamic| sample("cell_id", &id, point).map(|n| 0.5 + 0.5 * n));
    let (nearest, gap) = (cells(CellularReturnType::Distance), cells(CellularReturnType::Distance2Sub));
    engine.register_fn("worley", move |point: Dynamic| -> Outcome<Vec2> {
        let first = sample("worley", &nearest, point.clone())? + 1.0;
        Ok(Vec2::new(first, sample("worley", &gap, point)? + 1.0))
    });
    let octave: Vec<FastNoiseLite> = (0..MAX_OCTAVES as i32).map(|i| seeded(1337 + i)).collect();
    engine.register_fn("fbm", move |point: Dynamic, octaves: i64, lacunarity: Dynamic, gain: Dynamic| {
        let (lacunarity, gain) = (number("fbm", &lacunarity)?, number("fbm", &gain)?);
        let refused = |what: &str| -> Outcome<f32> { Err(Fault::new(format!("`fbm` takes {what}")).into()) };
        if !(1..=MAX_OCTAVES).contains(&octaves) {
            return refused(&format!("1 to {MAX_OCTAVES} octaves, not {octaves}"));
        }
        if !(1.0..=4.0).contains(&lacunarity) {
            return refused(&format!("a lacunarity of 1 to 4, not {lacunarity}"));
        }
        if !(0.0..=1.0).contains(&gain) {
            return refused(&format!("a gain of 0 to 1, not {gain}"));
        }
        layered(&octave[..octaves as usize], point, lacunarity, gain)
    });
    engine.register_fn("fbm", |point: Dynamic, octaves: i64| {
        if !(1..=MAX_OCTAVES).contains(&octaves) {
            return Err(Fault::new(format!("`fbm` takes 1 to {MAX_OCTAVES} octaves, not {octaves}")).into());
        }
        let mut layered = noise(NoiseType::Perlin);
        layered.set_fractal_type(Some(FractalType::FBm));
        layered.set_fractal_octaves(i32::try_from(octaves).ok());
        sample("fbm", &layered, point)
    });
}
