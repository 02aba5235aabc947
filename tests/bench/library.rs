//! What the library's functions cost, one at a time and in batches: `cargo bench --bench library -- [NAME]`.
//!
//! Nanoseconds a lane, the least of many runs over 64 blocks, which stay in the cache. Widths: the CPU's widest vectors,
//! AVX2, and what every x86-64 has (SSE2).

use std::hint::black_box;
use std::sync::{Arc, OnceLock};
use std::time::Instant;

use fastnoise_lite::{CellularDistanceFunction, CellularReturnType, FastNoiseLite, FractalType, NoiseType};
use tusche::math::{Vec2, linear_from_srgb, portable};
use tusche::scene::texture::{Image, Pixels, Texture, TextureFilter, Wrap};
use tusche::shade::library::batch::{LANES, Lanes, noise, numeric, transcendental};

const BLOCKS: usize = 64;
const RUNS: usize = 60;

/// Aligned as the blocks of kernels are, for the widest loads.
#[derive(Clone)]
#[repr(align(64))]
struct Aligned<T>(T);

struct Blocks<'a, F, const N: usize, const M: usize>(F, &'a [Aligned<[Lanes; N]>], &'a mut [Aligned<[Lanes; M]>]);

impl<F: Fn(&[Lanes; N], &mut [Lanes; M]), const N: usize, const M: usize> pulp::WithSimd for Blocks<'_, F, N, M> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        for (index, out) in self.2.iter_mut().enumerate() {
            // Else the compiler may turn the loop over blocks into vectors instead of that over lanes.
            let index = black_box(index);
            (self.0)(&self.1[index].0, &mut out.0);
        }
    }
}

fn nanoseconds(mut run: impl FnMut()) -> f64 {
    let times = (0..RUNS).map(|_| {
        let start = Instant::now();
        (0..20).for_each(|_| run());
        start.elapsed().as_nanos() as f64 / (20 * BLOCKS * LANES) as f64
    });
    times.fold(f64::INFINITY, f64::min)
}

/// Measures both forms of a function on numbers from 0 to `size`.
fn measure<const N: usize, const M: usize>(
    name: &str,
    size: f32,
    scalar: Option<&dyn Fn([f32; N]) -> f32>,
    batch: impl Fn(&[Lanes; N], &mut [Lanes; M]) + Copy,
) {
    let asked: Vec<_> = std::env::args().skip(1).filter(|argument| !argument.starts_with('-')).collect();
    if !asked.is_empty() && !asked.iter().any(|asked| name.contains(asked.as_str())) {
        return;
    }
    let mut state = 1_u64;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1 << 24) as f32 * size
    };
    let given: Vec<_> = (0..BLOCKS).map(|_| Aligned([(); N].map(|()| [(); LANES].map(|()| next())))).collect();
    let mut out = vec![Aligned([[0.0; LANES]; M]); BLOCKS];
    let one = scalar.map(|scalar| {
        nanoseconds(|| {
            for block in black_box(&given) {
                (0..LANES).for_each(|lane| {
                    black_box(scalar(std::array::from_fn(|component| block.0[component][lane])));
                });
            }
        })
    });
    let mut many = |width: pulp::Arch| {
        nanoseconds(|| {
            width.dispatch(Blocks(batch, black_box(&given), &mut out));
            black_box(&mut out);
        })
    };
    let widest = many(pulp::Arch::new());
    #[cfg(target_arch = "x86_64")]
    let avx2 = pulp::x86::V3::try_new().map(|simd| many(pulp::Arch::V3(simd)));
    #[cfg(not(target_arch = "x86_64"))]
    let avx2: Option<f64> = None;
    let shown = |time: Option<f64>| time.map_or("–".to_owned(), |time| format!("{time:.2}"));
    let (one, avx2) = (shown(one), shown(avx2));
    println!("| {name} | {one} | {widest:.2} | {avx2} | {:.2} |", many(pulp::Arch::Scalar));
}

fn source(kind: NoiseType) -> FastNoiseLite {
    let mut source = FastNoiseLite::new();
    source.set_frequency(Some(1.0));
    source.set_noise_type(Some(kind));
    source.set_cellular_distance_function(Some(CellularDistanceFunction::Euclidean));
    source
}

fn main() {
    // `cargo test --all-targets` runs benchmarks too, without this flag.
    if !std::env::args().any(|argument| argument == "--bench") {
        return;
    }
    println!("| function | scalar, ns | widest | AVX2 | baseline |");
    println!("|---|---|---|---|---|");
    measure_noise();
    measure_numbers();
    measure_transcendental();
    measure_textures();
}

fn flat(source: &FastNoiseLite) -> impl Fn([f32; 2]) -> f32 {
    |[x, y]| source.get_noise_2d(x, y)
}

fn solid(source: &FastNoiseLite) -> impl Fn([f32; 3]) -> f32 {
    |[x, y, z]| source.get_noise_3d(x, y, z)
}

fn measure_noise() {
    let mut cells = source(NoiseType::Cellular);
    cells.set_cellular_return_type(Some(CellularReturnType::Distance));
    let mut ids = source(NoiseType::Cellular);
    ids.set_cellular_return_type(Some(CellularReturnType::CellValue));
    let mut layered = source(NoiseType::Perlin);
    layered.set_fractal_type(Some(FractalType::FBm));
    layered.set_fractal_octaves(Some(3));
    macro_rules! noise {
        ($name:literal, $source:expr, $flat:ident, $solid:ident) => {
            measure(
                concat!($name, ", vec2"),
                40.0,
                Some(&flat(&$source)),
                #[inline(always)]
                |[x, y], [out]: &mut [Lanes; 1]| noise::$flat(x, y, out),
            );
            measure(
                concat!($name, ", vec3"),
                40.0,
                Some(&solid(&$source)),
                #[inline(always)]
                |[x, y, z], [out]: &mut [Lanes; 1]| noise::$solid(x, y, z, out),
            );
        };
    }
    noise!("value_noise", source(NoiseType::Value), value_noise_2d, value_noise_3d);
    noise!("gradient_noise", source(NoiseType::Perlin), gradient_noise_2d, gradient_noise_3d);
    noise!("cellular_noise", cells, cellular_noise_2d, cellular_noise_3d);
    noise!("cell_id", ids, cell_id_2d, cell_id_3d);
    measure(
        "fbm of 3 octaves, vec2",
        40.0,
        Some(&flat(&layered)),
        #[inline(always)]
        |[x, y], [out]: &mut [Lanes; 1]| {
            noise::fbm_2d(x, y, black_box(3), out);
        },
    );
    measure(
        "fbm of 3 octaves, vec3",
        40.0,
        Some(&solid(&layered)),
        #[inline(always)]
        |[x, y, z], [out]: &mut [Lanes; 1]| {
            noise::fbm_3d(x, y, z, black_box(3), out);
        },
    );
}

fn measure_numbers() {
    macro_rules! unary {
        ($($name:ident = $scalar:expr;)*) => { $(
            measure(stringify!($name), 40.0, Some(&|[x]: [f32; 1]| $scalar(x)), #[inline(always)] |[x], [out]: &mut [Lanes; 1]| numeric::$name(x, out));
        )* };
    }
    unary! {
        floor = f32::floor;
        ceil = f32::ceil;
        round = f32::round;
        fract = |x: f32| x - x.floor();
        sign = |x: f32| if x > 0.0 { 1.0 } else if x < 0.0 { -1.0 } else { x };
        linear_from_srgb = linear_from_srgb;
    }
    let floored_mod = |[x, y]: [f32; 2]| x - y * (x / y).floor();
    measure(
        "mod",
        40.0,
        Some(&floored_mod),
        #[inline(always)]
        |[x, y], [out]: &mut [Lanes; 1]| numeric::floored_mod(x, y, out),
    );
    let smoothstep = |[low, high, x]: [f32; 3]| {
        let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    };
    measure(
        "smoothstep",
        40.0,
        Some(&smoothstep),
        #[inline(always)]
        |[low, high, x], [out]: &mut [Lanes; 1]| {
            numeric::smoothstep(low, high, x, out);
        },
    );
    let remap = |[x, a, b, c, d]: [f32; 5]| c + (x - a) / (b - a) * (d - c);
    measure(
        "remap",
        40.0,
        Some(&remap),
        #[inline(always)]
        |[x, a, b, c, d], [out]: &mut [Lanes; 1]| numeric::remap(x, a, b, c, d, out),
    );
    measure(
        "hash of a vec3",
        40.0,
        None,
        #[inline(always)]
        |[x, y, z], [out]: &mut [Lanes; 1]| numeric::hash([x, y, z], out),
    );
    measure(
        "hash_color of a vec3",
        40.0,
        None,
        #[inline(always)]
        |[x, y, z], out: &mut [Lanes; 3]| numeric::hash_color([x, y, z], out),
    );
    measure(
        "hsv",
        1.0,
        None,
        #[inline(always)]
        |[h, s, v], out: &mut [Lanes; 3]| numeric::rgb_from_hsv(h, s, v, out),
    );
    measure(
        "hsv_from_rgb",
        1.0,
        None,
        #[inline(always)]
        |[r, g, b], out: &mut [Lanes; 3]| numeric::hsv_from_rgb(r, g, b, out),
    );
}

fn measure_transcendental() {
    macro_rules! unary {
        ($size:literal: $($name:ident)*) => { $(
            measure(stringify!($name), $size, Some(&|[x]: [f32; 1]| portable::$name(x)), #[inline(always)] |[x], [out]: &mut [Lanes; 1]| transcendental::$name(x, out));
        )* };
    }
    unary! { 40.0: sin cos tan atan sinh cosh tanh exp exp2 ln log2 log10 cbrt }
    unary! { 1.0: asin acos }
    measure(
        "atan(y, x)",
        40.0,
        Some(&|[y, x]: [f32; 2]| portable::atan2(y, x)),
        #[inline(always)]
        |[y, x], [out]: &mut [Lanes; 1]| transcendental::atan2(y, x, out),
    );
    measure(
        "pow",
        4.0,
        Some(&|[x, y]: [f32; 2]| portable::pow(x, y)),
        #[inline(always)]
        |[x, y], [out]: &mut [Lanes; 1]| transcendental::pow(x, y, out),
    );
}

fn measure_textures() {
    const SIDE: u32 = 64;
    let bytes = || (0..SIDE * SIDE).map(|i| [i as u8, (i / 7) as u8, (i / 31) as u8, 255]);
    let images = [
        ("sRGB", Pixels::Rgba8 { data: bytes().collect(), srgb: true }),
        ("linear", Pixels::Rgba8 { data: bytes().collect(), srgb: false }),
        ("floats", Pixels::Rgba32F { data: bytes().map(|pixel| pixel.map(f32::from)).collect() }),
    ];
    for (name, pixels) in images {
        let image = Arc::new(Image { width: SIDE, height: SIDE, pixels });
        for filter in [TextureFilter::Nearest, TextureFilter::Linear] {
            let texture = Texture {
                name: String::new(),
                image: Arc::clone(&image),
                wrap: [Wrap::Repeat; 2],
                filter,
                levels: OnceLock::new(),
            };
            let name =
                format!("texture, {name}, {}", if filter == TextureFilter::Linear { "bilinear" } else { "nearest" });
            let scalar = |[u, v]: [f32; 2]| texture.sample(Vec2::new(u, v)).x;
            measure(
                &name,
                4.0,
                Some(&scalar),
                #[inline(always)]
                |[u, v], out: &mut [Lanes; 4]| texture.sample_lanes(u, v, out),
            );
        }
    }
}
