//! Whether a script gives the same bits as a kernel and by the interpreter.

use std::collections::BTreeMap;
use std::sync::Arc;

use tusche::diag::{Diagnostics, Source};
use tusche::math::{Affine2, DVec3, Vec2, Vec3, Vec4};
use tusche::sample::{NodePath, PairBatch};
use tusche::scene::camera::{Camera, Projection};
use tusche::scene::ids::{MaterialId, TextureId};
use tusche::scene::light::{Light, LightKind};
use tusche::scene::material::{Material, ParamValue, Script};
use tusche::scene::settings::LineType;
use tusche::scene::texture::{Image, Pixels, Texture, TextureFilter, TextureRef, Wrap};
use tusche::scene::{Scene, SceneBuilder};
use tusche::shade::{
    HitBatch, Host, LightSample, LineStyles, Mode, OutputBatch, OutputSet, PathKind, ShadeErrors, Shaders, Shading,
    ShadingMode,
};

/// What became of a script.
#[derive(Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It ran as a kernel, with the interpreter's bits.
    Agrees,
    /// It is no kernel; the construct at fault.
    Interpreted(String),
    /// Every hit gives the same, so nothing was to be compared.
    Constant,
    /// It does not compile; both say the same.
    Refused(String),
}

/// Compares the two ways of running a script.
///
/// # Errors
/// What differs.
pub fn compare(script: &str, hits: &HitBatch, wanted: OutputSet) -> Result<Verdict, String> {
    let scene = scene(script);
    let [kernels, reference] = match compile(&scene)? {
        Ok(both) => both,
        Err(refused) => return Ok(refused),
    };
    let shader = kernels.of(MaterialId(0));
    match shader.mode() {
        Mode::Constant => return Ok(Verdict::Constant),
        Mode::Interpreted => {
            return Ok(Verdict::Interpreted(shader.blame().map_or_else(String::new, ToString::to_string)));
        }
        Mode::Kernel => {}
    }
    let shade = |shaders: &Shaders| {
        let (mut outputs, mut errors) = (OutputBatch::default(), ShadeErrors::default());
        Shading::new(&scene, shaders).shade(MaterialId(0), hits, wanted, &mut outputs, &mut errors);
        (outputs, errors)
    };
    verdict(shade(&kernels), shade(&reference), difference)
}

/// The same for a script's `line`.
///
/// # Errors
/// What differs.
pub fn compare_lines(script: &str, pairs: &PairBatch) -> Result<Verdict, String> {
    let scene = scene(script);
    let [kernels, reference] = match compile(&scene)? {
        Ok(both) => both,
        Err(refused) => return Ok(refused),
    };
    if let Some(blame) = kernels.of(MaterialId(0)).line_blame() {
        return Ok(Verdict::Interpreted(blame.message));
    }
    let style = |shaders: &Shaders| {
        let (mut styles, mut errors) = (LineStyles::default(), ShadeErrors::default());
        Shading::new(&scene, shaders).style(MaterialId(0), pairs, &mut styles, &mut errors);
        (styles, errors)
    };
    verdict(style(&kernels), style(&reference), |a, b| {
        column("color", &a.color, &b.color).or_else(|| column("opacity", &a.opacity, &b.opacity))
    })
}

/// The shaders of a scene as kernels and for the interpreter, or that both refuse the script.
fn compile(scene: &Scene) -> Result<Result<[Shaders; 2], Verdict>, String> {
    let compile = |mode| Shaders::compile_for(scene, &Host::new(), mode).map(|(shaders, _)| shaders);
    match [ShadingMode::Auto, ShadingMode::Interpreter].map(compile) {
        [Ok(kernels), Ok(reference)] => Ok(Ok([kernels, reference])),
        [Err(a), Err(b)] if rendered(&a) == rendered(&b) => Ok(Err(Verdict::Refused(rendered(&a)))),
        [a, b] => Err(format!("one compiles: {:?}\n{:?}", a.err(), b.err())),
    }
}

/// What comes of what a kernel and the interpreter gave.
fn verdict<T>(
    (a, errors_a): (T, ShadeErrors),
    (b, errors_b): (T, ShadeErrors),
    difference: impl Fn(&T, &T) -> Option<String>,
) -> Result<Verdict, String> {
    let [errors_a, errors_b] = [errors_a, errors_b].map(|errors| rendered(&errors.into_diagnostics()));
    if errors_a != errors_b {
        return Err(format!("errors differ:\nkernel:\n{errors_a}\ninterpreter:\n{errors_b}"));
    }
    difference(&a, &b).map_or(Ok(Verdict::Agrees), Err)
}

fn rendered(faults: &Diagnostics) -> String {
    faults.0.iter().map(|fault| fault.render(false)).collect::<Vec<_>>().join("\n")
}

/// Bits that are compared: of floats all, but every NaN is one.
trait Bits {
    fn bits(&self) -> Vec<u64>;
}

impl Bits for f32 {
    fn bits(&self) -> Vec<u64> {
        vec![if self.is_nan() { u64::MAX } else { u64::from(self.to_bits()) }]
    }
}

impl Bits for i32 {
    fn bits(&self) -> Vec<u64> {
        vec![*self as u64]
    }
}

impl Bits for Vec3 {
    fn bits(&self) -> Vec<u64> {
        self.to_array().iter().flat_map(Bits::bits).collect()
    }
}

impl<T: Bits> Bits for Option<T> {
    fn bits(&self) -> Vec<u64> {
        self.as_ref().map_or_else(Vec::new, Bits::bits)
    }
}

fn column<T: Bits + std::fmt::Debug>(name: &str, a: &[T], b: &[T]) -> Option<String> {
    if a.len() != b.len() {
        return Some(format!("{name} has {} rows in the kernel and {} in the interpreter", a.len(), b.len()));
    }
    let row = a.iter().zip(b).position(|(a, b)| a.bits() != b.bits())?;
    Some(format!("{name} of hit {row}: the kernel gives {:?}, the interpreter {:?}", a[row], b[row]))
}

fn difference(a: &OutputBatch, b: &OutputBatch) -> Option<String> {
    macro_rules! columns {
        ($($name:ident)*) => { None$(.or_else(|| column(stringify!($name), &a.$name, &b.$name)))* };
    }
    columns!(base_color metallic roughness specular ior transmission opacity emission normal occlusion feature
        line_color line_width priority color)
    .or_else(|| a.aovs.iter().zip(&b.aovs).find_map(|(a, b)| column("an extra output", a, b)))
    .or_else(|| (a.len != b.len).then(|| "the numbers of rows".into()))
}

/// A scene of nothing but one material; its parameter `map`, if the script has one, is a small texture.
pub fn scene(script: &str) -> Scene {
    let projection = Projection::Orthographic { height: 2.0 };
    let camera =
        Camera::look_at("camera", projection, DVec3::Z, DVec3::ZERO, DVec3::Y).expect("it looks at the origin");
    let mut builder = SceneBuilder { cameras: vec![camera], ..SceneBuilder::default() };
    let data = (0..12_u8).map(|i| [i * 20, 255 - i * 13, i * 7, 255 - i * 2]).collect();
    builder.add_texture(Texture {
        name: "colors".into(),
        image: Arc::new(Image { width: 4, height: 3, pixels: Pixels::Rgba8 { data, srgb: true } }),
        wrap: [Wrap::Repeat, Wrap::Mirror],
        filter: TextureFilter::Linear,
        levels: Default::default(),
    });
    let script_id = builder.add_script(Script { source: Source::new("random.rhai", script), path: None });
    let mut params = BTreeMap::new();
    if script.contains("map: ()") {
        let transform = Affine2::from_scale_angle_translation(Vec2::new(2.0, 0.5), 0.3, Vec2::new(0.1, 0.2));
        let place = TextureRef { texture: TextureId(0), uv_set: 0, transform };
        params.insert("map".to_owned(), (ParamValue::Texture(place), None));
    }
    for number in 0..2 {
        builder.lights.push(Light {
            name: format!("light {number}"),
            kind: LightKind::Point { position: DVec3::Y, intensity: Vec3::ONE },
            shadows: false,
        });
    }
    builder.add_material(Material {
        name: "random".into(),
        script: script_id,
        params,
        priority: None,
        dielectric_priority: 0,
        double_sided: true,
        lines: Default::default(),
        span: None,
    });
    builder.build().unwrap_or_else(|faults| panic!("{faults}"))
}

/// Numbers that are the same every time.
pub struct Random(pub u64);

impl Random {
    /// The next number (SplitMix64).
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A float: mostly ordinary, now and then one of those that try formulas.
    fn float(&mut self) -> f32 {
        const SPECIAL: [f32; 16] = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            0.5,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::NAN,
            f32::MIN_POSITIVE,
            1e-41,
            -1e-45,
            f32::MAX,
            1e9,
            -3.5,
            16_777_217.0,
            9.3e18,
        ];
        let choice = self.next();
        if choice.is_multiple_of(5) {
            SPECIAL[(choice / 5 % 16) as usize]
        } else {
            ((choice >> 40) as f32 / 16_777_216.0 - 0.5) * [1.0, 4.0, 100.0, 1e6][(choice / 5 % 4) as usize]
        }
    }

    fn vec3(&mut self) -> Vec3 {
        Vec3::new(self.float(), self.float(), self.float())
    }

    fn light(&mut self) -> LightSample {
        LightSample { direction: self.vec3(), radiance: self.vec3(), visibility: self.float() }
    }
}

/// Hits with every column filled, and two lights.
pub fn hits(len: usize, random: &mut Random) -> HitBatch {
    let mut batch = HitBatch { len, light_count: 2, material_id: 1, time: random.float(), ..HitBatch::default() };
    for _ in 0..len {
        batch.position.push(random.vec3());
        batch.normal.push(random.vec3());
        batch.geometric_normal.push(random.vec3());
        batch.incoming.push(random.vec3());
        batch.uv.push(Vec2::new(random.float(), random.float()));
        batch.tangent.push(random.vec3().extend(1.0));
        batch.color.push(Vec4::new(random.float(), random.float(), 0.5, 1.0));
        batch.object_id.push((random.next() % 7) as u32);
        batch.polygon_id.push(if random.next().is_multiple_of(9) { u32::MAX } else { (random.next() % 5) as u32 });
        batch.barycentric.push(random.vec3());
        batch.distance.push(random.float());
        batch.depth.push(random.float());
        batch.path_kind.push(PathKind::ALL[(random.next() % 4) as usize]);
        batch.front_facing.push(random.next().is_multiple_of(2));
        batch.pixels_per_unit.push(random.float());
        batch.curvature.push(random.float());
        batch.footprint.push(random.float());
        batch.uv_footprint.push(random.float());
        let lights = [random.light(), random.light()];
        batch.lights.extend(lights);
    }
    batch
}

/// Lines with every column filled.
pub fn pairs(len: usize, random: &mut Random) -> PairBatch {
    let mut batch = PairBatch { len, ..PairBatch::default() };
    let paths = [NodePath::CAMERA, NodePath::CAMERA.reflected(), NodePath::CAMERA.refracted()];
    for _ in 0..len {
        batch.kind.push(LineType::ALL[random.next() as usize % LineType::ALL.len()]);
        batch.path.push(paths[random.next() as usize % paths.len()]);
        batch.distance.push(random.float());
        batch.own.push(random.next().is_multiple_of(2));
        batch.width.push(random.float());
        batch.color.push(random.vec3().to_array());
        batch.opacity.push(random.float());
        batch.pixel.push([random.float(), random.float()]);
        for side in &mut batch.sides {
            side.object.push((random.next() % 7) as u32);
            side.material.push((random.next() % 3) as u32);
            side.depth.push(random.float());
            side.position.push(random.vec3().to_array());
            side.normal.push(random.vec3().to_array());
            side.feature.push(random.vec3().to_array());
        }
    }
    batch
}
