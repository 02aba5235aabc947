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

/// A noise of the library.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(in crate::shade) enum Noise {
    Value,
    Gradient,
    Cellular,
    CellId,
    /// So many layers of gradient noise, 1 to 10.
    Fbm(u8),
}

struct Generators {
    value: FastNoiseLite,
    gradient: FastNoiseLite,
    distance: FastNoiseLite,
    id: FastNoiseLite,
    layered: Vec<FastNoiseLite>,
}

static GENERATORS: LazyLock<Generators> = LazyLock::new(|| Generators {
    value: noise(NoiseType::Value),
    gradient: noise(NoiseType::Perlin),
    distance: cells(CellularReturnType::Distance),
    id: cells(CellularReturnType::CellValue),
    layered: (1..=MAX_OCTAVES)
        .map(|octaves| {
            let mut layered = noise(NoiseType::Perlin);
            layered.set_fractal_type(Some(FractalType::FBm));
            layered.set_fractal_octaves(i32::try_from(octaves).ok());
            layered
        })
        .collect(),
});

impl Noise {
    /// The noise at a point of two or three coordinates.
    pub fn at(self, x: f32, y: f32, z: Option<f32>) -> f32 {
        let [x, y] = [x, y].map(|x| clamp(x, -LIMIT, LIMIT));
        let z = z.map(|z| clamp(z, -LIMIT, LIMIT));
        if x.is_nan() || y.is_nan() || z.is_some_and(f32::is_nan) {
            return f32::NAN;
        }
        let get = |noise: &FastNoiseLite| match z {
            None => noise.get_noise_2d(x, y),
            Some(z) => noise.get_noise_3d(x, y, z),
        };
        let all = &*GENERATORS;
        match self {
            Self::Value => 0.5 + 0.5 * get(&all.value),
            Self::Gradient => get(&all.gradient),
            // The source gives the distance less 1.
            Self::Cellular => get(&all.distance) + 1.0,
            Self::CellId => 0.5 + 0.5 * get(&all.id),
            Self::Fbm(octaves) => get(&all.layered[usize::from(octaves).clamp(1, all.layered.len()) - 1]),
        }
    }

    /// The noise at many points.
    #[inline(always)]
    pub fn block<const N: usize>(self, x: &[f32; N], y: &[f32; N], z: Option<&[f32; N]>, out: &mut [f32; N]) {
        for lane in 0..N {
            out[lane] = self.at(x[lane], y[lane], z.map(|z| z[lane]));
        }
    }
}

fn sample(name: &str, noise: Noise, point: Dynamic) -> Outcome<f32> {
    match Operand::of(&point) {
        Some(Operand::Vec2(v)) => Ok(noise.at(v.x, v.y, None)),
        Some(Operand::Vec3(v)) => Ok(noise.at(v.x, v.y, Some(v.z))),
        _ => Err(refuse(name, &[point])),
    }
}

pub(super) fn register(engine: &mut Engine) {
    for (name, noise) in [
        ("value_noise", Noise::Value),
        ("gradient_noise", Noise::Gradient),
        ("cellular_noise", Noise::Cellular),
        ("cell_id", Noise::CellId),
    ] {
        engine.register_fn(name, move |point: Dynamic| sample(name, noise, point));
    }
    engine.register_fn("fbm", |point: Dynamic, octaves: i64| match u8::try_from(octaves) {
        Ok(layers) if (1..=MAX_OCTAVES).contains(&octaves) => sample("fbm", Noise::Fbm(layers), point),
        _ => Err(Fault::new(format!("`fbm` takes 1 to {MAX_OCTAVES} octaves, not {octaves}")).into()),
    });
}
