//! What shading costs: `cargo bench --bench kernels`.
//!
//! Five shipped shaders on the same batch of synthetic hits, in one run, on one thread: by the interpreter, as kernels,
//! and written by hand in Rust. The hand-written ones do what a programmer would write for the same batches: one loop
//! over the hits, numbers in local variables, the same columns filled. They are checked to give the same bits.
//! `default` has textures for base colour and for metal and roughness, and vertex colours; without any it is constant.

use std::collections::BTreeMap;
use std::hint::black_box;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use fastnoise_lite::{FastNoiseLite, FractalType, NoiseType};
use tusche::diag::Source;
use tusche::math::{Affine2, DVec3, Vec2, Vec3, luminance};
use tusche::scene::camera::{Camera, Projection};
use tusche::scene::ids::{MaterialId, TextureId};
use tusche::scene::light::{Light, LightKind};
use tusche::scene::material::{Material, ParamValue, Script};
use tusche::scene::texture::{Image, Pixels, Texture, TextureFilter, TextureRef, Wrap};
use tusche::scene::{Scene, SceneBuilder};
use tusche::shade::{
    HitBatch, Host, OutputBatch, OutputSet, ShadeErrors, Shaders, Shading, ShadingMode, measure, synthetic,
};

/// Hits of a batch: what the renderer traces together.
const HITS: usize = 4096;
const REPEATS: usize = 15;

type ByHand = fn(&HitBatch, &Texture, &mut OutputBatch);

fn main() {
    // `cargo test --all-targets` runs benchmarks too, without this flag.
    if !std::env::args().any(|argument| argument == "--bench") {
        return;
    }
    println!("| shader | interpreter, ns | kernel, ns | by hand, ns | interpreter / kernel | kernel / by hand |");
    println!("|---|---|---|---|---|---|");
    let shaders: [(&str, ByHand); 5] = [
        ("cel", cel),
        ("light_driven_width", light_driven_width),
        ("noise_width", noise_width),
        ("hatch", hatch),
        ("default", default),
    ];
    for (name, by_hand) in shaders {
        measure(name, by_hand);
    }
}

fn measure(name: &str, by_hand: ByHand) {
    let scene = scene(name);
    let hits = synthetic::hits(HITS, 0);
    let material = MaterialId(0);
    let compile = |mode| Shaders::compile_for(&scene, &Host::new(), mode).unwrap_or_else(|faults| panic!("{faults}")).0;
    let (kernels, reference) = (compile(ShadingMode::Kernel), compile(ShadingMode::Interpreter));

    let mut kernel = Shading::new(&scene, &kernels);
    let mut outputs = OutputBatch::default();
    kernel.shade(material, &hits, OutputSet::all(), &mut outputs, &mut ShadeErrors::default());
    let texture = &scene.textures()[0];
    let mut expected = OutputBatch::default();
    by_hand(&hits, texture, &mut expected);
    assert_same(name, &outputs, &expected);

    // The kernel fills all columns that there are; the hand-written shader only those that it has.
    let kernel_ns = measure::nanoseconds_per_hit(&mut kernel, material, &hits, REPEATS);
    let mut interpreter = Shading::new(&scene, &reference);
    let few = synthetic::hits(512, 0);
    let interpreter_ns = measure::nanoseconds_per_hit(&mut interpreter, material, &few, 5);
    let by_hand_ns = nanoseconds(|| by_hand(black_box(&hits), texture, black_box(&mut expected)));
    println!(
        "| {name} | {interpreter_ns:.0} | {kernel_ns:.1} | {by_hand_ns:.1} | {:.0} | {:.2} |",
        interpreter_ns / kernel_ns,
        kernel_ns / by_hand_ns
    );
}

/// The median over rounds of at least two milliseconds.
fn nanoseconds(mut run: impl FnMut()) -> f64 {
    run();
    let mut all: Vec<f64> = (0..REPEATS)
        .map(|_| {
            let (start, mut rounds) = (Instant::now(), 0_u32);
            while start.elapsed().as_secs_f64() < 0.002 {
                run();
                rounds += 1;
            }
            start.elapsed().as_secs_f64() * 1e9 / (f64::from(rounds) * HITS as f64)
        })
        .collect();
    all.sort_by(f64::total_cmp);
    all[REPEATS / 2]
}

fn assert_same(name: &str, a: &OutputBatch, b: &OutputBatch) {
    macro_rules! columns {
        ($($column:ident)*) => { $(
            if !b.$column.is_empty() {
                assert!(a.$column == b.$column, "{name}: {} differs", stringify!($column));
            }
        )* };
    }
    columns!(base_color metallic roughness specular ior transmission opacity emission line_color line_width color);
}

// The shaders by hand.

fn irradiance(hits: &HitBatch, row: usize) -> Vec3 {
    let lights = &hits.lights[row * hits.light_count..(row + 1) * hits.light_count];
    let normal = hits.normal[row];
    lights
        .iter()
        .fold(Vec3::ZERO, |sum, light| sum + light.radiance * light.visibility * max(0.0, dot(normal, light.direction)))
}

fn dot(a: Vec3, b: Vec3) -> f32 {
    a.x * b.x + a.y * b.y + a.z * b.z
}

fn max(a: f32, b: f32) -> f32 {
    if a < b { b } else { a }
}

fn saturate(x: f32) -> f32 {
    let x = max(x, 0.0);
    if 1.0 < x { 1.0 } else { x }
}

fn mix(a: f32, b: f32, t: f32) -> f32 {
    a * (1.0 - t) + b * t
}

fn mix3(a: Vec3, b: Vec3, t: f32) -> Vec3 {
    a * (1.0 - t) + b * t
}

fn step(edge: f32, x: f32) -> f32 {
    if x < edge { 0.0 } else { 1.0 }
}

fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = saturate((x - low) / (high - low));
    t * t * (3.0 - 2.0 * t)
}

fn cel(hits: &HitBatch, _: &Texture, out: &mut OutputBatch) {
    let (paint, shadow) = (Vec3::new(0.90, 0.45, 0.15), Vec3::new(0.35, 0.16, 0.30));
    out.color.clear();
    out.line_color.clear();
    out.line_width.clear();
    for row in 0..hits.len {
        let brightness = luminance(irradiance(hits, row));
        let tone = if brightness < 0.15 {
            0.0
        } else if brightness < 0.6 {
            0.6
        } else {
            1.0
        };
        out.color.push(Some(mix3(shadow * paint, paint, tone)));
        out.line_color.push(Some(shadow * 0.3));
        out.line_width.push(Some(2.0 * (1.4 - 0.4 * tone)));
    }
}

fn light_driven_width(hits: &HitBatch, _: &Texture, out: &mut OutputBatch) {
    let (lit_ink, shaded_ink) = (Vec3::new(0.85, 0.30, 0.10), Vec3::new(0.05, 0.05, 0.20));
    out.base_color.clear();
    out.line_color.clear();
    out.line_width.clear();
    for row in 0..hits.len {
        let lights = &hits.lights[row * hits.light_count..(row + 1) * hits.light_count];
        let mut brightness = 0.0;
        for light in lights {
            let facing = max(0.0, dot(hits.normal[row], light.direction));
            brightness += luminance(light.radiance * light.visibility) * facing;
        }
        let lit = saturate(brightness);
        out.base_color.push(Vec3::new(0.75, 0.78, 0.80));
        out.line_color.push(Some(mix3(shaded_ink, lit_ink, lit)));
        out.line_width.push(Some(mix(5.0, 0.5, lit)));
    }
}

fn noise_width(hits: &HitBatch, _: &Texture, out: &mut OutputBatch) {
    let mut noise = FastNoiseLite::new();
    noise.set_frequency(Some(1.0));
    noise.set_noise_type(Some(NoiseType::Perlin));
    noise.set_fractal_type(Some(FractalType::FBm));
    noise.set_fractal_octaves(Some(3));
    out.base_color.clear();
    out.line_width.clear();
    for row in 0..hits.len {
        let place = hits.position[row] * 4.0;
        let wobble = saturate(0.5 + noise.get_noise_3d(place.x, place.y, place.z));
        out.base_color.push(Vec3::new(0.9, 0.9, 0.85));
        out.line_width.push(Some(mix(0.0, 4.0, wobble)));
    }
}

fn hatch(hits: &HitBatch, _: &Texture, out: &mut OutputBatch) {
    let (paper, ink) = (Vec3::new(0.96, 0.94, 0.88), Vec3::new(0.08, 0.07, 0.12));
    let stroke = |across: f32, coverage: f32| {
        let from_middle = ((across - across.floor()) - 0.5).abs() * 2.0;
        1.0 - step(coverage, from_middle)
    };
    out.color.clear();
    out.line_color.clear();
    out.line_width.clear();
    for row in 0..hits.len {
        let darkness = 1.0 - saturate(luminance(irradiance(hits, row)));
        let uv: Vec2 = hits.uv[row] * 60.0;
        let first = stroke(uv.x + uv.y, smoothstep(0.2, 0.9, darkness) * 0.5);
        let second = stroke(uv.x - uv.y, smoothstep(0.6, 1.0, darkness) * 0.4);
        out.color.push(Some(mix3(paper, ink, max(first, second))));
        out.line_color.push(Some(ink));
        out.line_width.push(Some(1.5));
    }
}

fn default(hits: &HitBatch, texture: &Texture, out: &mut OutputBatch) {
    out.base_color.clear();
    out.metallic.clear();
    out.roughness.clear();
    out.specular.clear();
    out.ior.clear();
    out.transmission.clear();
    out.opacity.clear();
    out.emission.clear();
    for row in 0..hits.len {
        let uv = Affine2::IDENTITY.transform_point2(hits.uv[row]);
        let mut base = Vec3::ONE.extend(1.0);
        base *= texture.sample(uv);
        base *= hits.color[row];
        let map = texture.sample(uv);
        out.base_color.push(base.truncate());
        out.metallic.push(1.0 * map.z);
        out.roughness.push(0.8 * map.y);
        out.specular.push(1.0);
        out.ior.push(1.5);
        out.transmission.push(0.0);
        out.opacity.push(1.0);
        out.emission.push(Vec3::ZERO);
    }
}

/// One material with the shader, two lights, and a texture of 256 × 256 pixels.
fn scene(name: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders").join(format!("{name}.rhai"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let projection = Projection::Orthographic { height: 2.0 };
    let camera =
        Camera::look_at("camera", projection, DVec3::Z, DVec3::ZERO, DVec3::Y).expect("it looks at the origin");
    let mut builder = SceneBuilder { cameras: vec![camera], ..SceneBuilder::default() };
    let data = (0..256 * 256_u32).map(|i| [(i % 251) as u8, (i % 241) as u8, (i % 239) as u8, 255]).collect();
    builder.add_texture(Texture {
        name: "texture".into(),
        image: Arc::new(Image { width: 256, height: 256, pixels: Pixels::Rgba8 { data, srgb: true } }),
        wrap: [Wrap::Repeat; 2],
        filter: TextureFilter::Linear,
        levels: Default::default(),
    });
    for number in 0..synthetic::LIGHTS {
        builder.lights.push(Light {
            name: format!("light {number}"),
            kind: LightKind::Point { position: DVec3::Y, intensity: Vec3::ONE },
            shadows: false,
        });
    }
    let mut params = BTreeMap::new();
    if name == "default" {
        let place = TextureRef { texture: TextureId(0), uv_set: 0, transform: Affine2::IDENTITY };
        params.insert("base_color_texture".to_owned(), (ParamValue::Texture(place), None));
        params.insert("metallic_roughness_texture".to_owned(), (ParamValue::Texture(place), None));
        params.insert("use_vertex_color".to_owned(), (ParamValue::Bool(true), None));
        params.insert("metallic".to_owned(), (ParamValue::Float(1.0), None));
        params.insert("roughness".to_owned(), (ParamValue::Float(0.8), None));
    }
    let script = builder.add_script(Script { source: Source::new(name, text), path: None });
    builder.add_material(Material {
        name: name.into(),
        script,
        params,
        priority: None,
        dielectric_priority: 0,
        double_sided: true,
        lines: Default::default(),
        span: None,
    });
    builder.build().unwrap_or_else(|faults| panic!("{faults}"))
}
