//! Noise: all from one source, `fastnoise-lite` with its portable arithmetic, at frequency 1.
//!
//! Points may be a vec2 or a vec3. A component beyond ±2²⁰ counts as ±2²⁰, where floats have an eighth of a unit left
//! between them; a point with a NaN gives NaN.

use std::sync::LazyLock;

use fastnoise_lite::{CellularDistanceFunction, CellularReturnType, FastNoiseLite, FractalType, NoiseType};
use rhai::{Dynamic, Engine};

use super::Function;
use super::math::clamp;
use super::operand::{Operand, Outcome, refuse};
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
        name: "fbm",
        form: "fbm(point, octaves)",
        about: "gradient noise −1 … 1 summed over 1 to 10 octaves, each twice as fine and half as strong",
        types: "vec2 or vec3, int 1 … 10 → number, −1 … 1",
        example: "fbm(hit.position, 4)",
    },
];

const LIMIT: f32 = 1_048_576.0;
/// The most octaves of [`fbm`].
pub(in crate::shade) const MAX_OCTAVES: i64 = 10;

static VALUE: LazyLock<FastNoiseLite> = LazyLock::new(|| noise(NoiseType::Value));
static GRADIENT: LazyLock<FastNoiseLite> = LazyLock::new(|| noise(NoiseType::Perlin));
static DISTANCE: LazyLock<FastNoiseLite> = LazyLock::new(|| cells(CellularReturnType::Distance));
static ID: LazyLock<FastNoiseLite> = LazyLock::new(|| cells(CellularReturnType::CellValue));

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

/// The noise at a point of two or three coordinates.
fn at<const N: usize>(noise: &FastNoiseLite, point: [f32; N]) -> f32 {
    let point = point.map(|x| clamp(x, -LIMIT, LIMIT));
    if point.iter().any(|x| x.is_nan()) {
        return f32::NAN;
    }
    match point.as_slice() {
        [x, y] => noise.get_noise_2d(*x, *y),
        [x, y, z] => noise.get_noise_3d(*x, *y, *z),
        _ => f32::NAN,
    }
}

/// Value noise, 0 … 1.
pub(super) fn value_noise<const N: usize>(point: [f32; N]) -> f32 {
    0.5 + 0.5 * at(&VALUE, point)
}

/// Perlin noise, −1 … 1.
pub(super) fn gradient_noise<const N: usize>(point: [f32; N]) -> f32 {
    at(&GRADIENT, point)
}

/// The distance to the nearest scattered point. The source gives it less 1.
pub(super) fn cellular_noise<const N: usize>(point: [f32; N]) -> f32 {
    at(&DISTANCE, point) + 1.0
}

/// The number of the nearest scattered point, 0 … 1.
pub(super) fn cell_id<const N: usize>(point: [f32; N]) -> f32 {
    0.5 + 0.5 * at(&ID, point)
}

/// Perlin noise over 1 to [`MAX_OCTAVES`] octaves.
pub(super) fn fbm<const N: usize>(point: [f32; N], octaves: i64) -> f32 {
    let mut layered = noise(NoiseType::Perlin);
    layered.set_fractal_type(Some(FractalType::FBm));
    layered.set_fractal_octaves(i32::try_from(octaves).ok());
    at(&layered, point)
}

fn register_kind(engine: &mut Engine, name: &'static str, flat: fn([f32; 2]) -> f32, solid: fn([f32; 3]) -> f32) {
    engine.register_fn(name, move |point: Dynamic| sample(name, point, flat, solid));
}

fn sample(name: &str, point: Dynamic, flat: impl Fn([f32; 2]) -> f32, solid: impl Fn([f32; 3]) -> f32) -> Outcome<f32> {
    match Operand::of(&point) {
        Some(Operand::Vec2(v)) => Ok(flat(v.into())),
        Some(Operand::Vec3(v)) => Ok(solid(v.into())),
        _ => Err(refuse(name, &[point])),
    }
}

pub(super) fn register(engine: &mut Engine) {
    register_kind(engine, "value_noise", value_noise, value_noise);
    register_kind(engine, "gradient_noise", gradient_noise, gradient_noise);
    register_kind(engine, "cellular_noise", cellular_noise, cellular_noise);
    register_kind(engine, "cell_id", cell_id, cell_id);
    engine.register_fn("fbm", |point: Dynamic, octaves: i64| {
        if !(1..=MAX_OCTAVES).contains(&octaves) {
            return Err(Fault::new(format!("`fbm` takes 1 to {MAX_OCTAVES} octaves, not {octaves}")).into());
        }
        sample("fbm", point, |p| fbm(p, octaves), |p| fbm(p, octaves))
    });
}
