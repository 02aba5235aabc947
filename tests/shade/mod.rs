//! The script host: what shaders may say, what they mean, and what is said when they are wrong.

mod attributes;
mod closures;
mod errors;
mod library;
mod modules;
mod native;
mod reference;
mod shading;
mod shipped;
mod textures;

use std::collections::BTreeMap;
use std::sync::Arc;

use tusche::diag::{Diagnostics, Source};
use tusche::math::{Affine2, DVec3, Vec2, Vec3, Vec4};
use tusche::scene::camera::{Camera, Projection};
use tusche::scene::ids::MaterialId;
use tusche::scene::material::{Material, ParamValue, Script};
use tusche::scene::texture::{Image, Pixels, Texture, TextureFilter, TextureRef, Wrap};
use tusche::scene::{Scene, SceneBuilder};
use tusche::shade::{HitBatch, Host, LightSample, OutputBatch, OutputSet, PathKind, ShadeErrors, Shaders, Shading};

/// A scene of nothing but one material for each script text.
pub fn scene(scripts: &[&str]) -> Scene {
    scene_with(scripts, BTreeMap::new())
}

/// The same; the last material has parameters.
pub fn scene_with(scripts: &[&str], params: BTreeMap<String, (ParamValue, Option<tusche::diag::Span>)>) -> Scene {
    let projection = Projection::Orthographic { height: 2.0 };
    let camera =
        Camera::look_at("camera", projection, DVec3::Z, DVec3::ZERO, DVec3::Y).expect("it looks at the origin");
    let mut builder = SceneBuilder { cameras: vec![camera], ..SceneBuilder::default() };
    builder.add_texture(Texture {
        name: "gray".into(),
        image: Arc::new(Image { width: 1, height: 1, pixels: Pixels::Rgba32F { data: vec![[0.5, 0.25, 0.75, 0.5]] } }),
        wrap: [Wrap::Repeat; 2],
        filter: TextureFilter::Linear,
        levels: Default::default(),
    });
    for (index, text) in scripts.iter().enumerate() {
        let source = Source::new(format!("{}.rhai", ["first", "second", "third"][index.min(2)]), *text);
        let script = builder.add_script(Script { source, path: None });
        builder.add_material(Material {
            name: format!("material {index}"),
            script,
            params: if index + 1 == scripts.len() { params.clone() } else { BTreeMap::new() },
            priority: None,
            dielectric_priority: 0,
            double_sided: true,
            lines: Default::default(),
            span: None,
        });
    }
    builder.build().unwrap_or_else(|faults| panic!("{faults}"))
}

/// A use of the scene's one texture.
pub fn texture() -> ParamValue {
    let place = TextureRef { texture: tusche::scene::ids::TextureId(0), uv_set: 0, transform: Affine2::IDENTITY };
    ParamValue::Texture(place)
}

/// Hits with all columns filled and two lights.
pub fn batch(len: usize) -> HitBatch {
    let at = |row: usize| row as f32 * 0.1;
    let rows = || 0..len;
    HitBatch {
        len,
        position: rows().map(|row| Vec3::new(at(row), 0.5, -0.25)).collect(),
        normal: vec![Vec3::Y; len],
        geometric_normal: vec![Vec3::Y; len],
        incoming: vec![Vec3::new(0.0, -0.6, -0.8); len],
        uv: rows().map(|row| Vec2::new(at(row), 0.3)).collect(),
        more_uvs: vec![vec![Vec2::new(0.7, 0.8); len]],
        tangent: vec![Vec4::new(1.0, 0.0, 0.0, 1.0); len],
        color: vec![Vec4::new(0.2, 0.4, 0.6, 0.8); len],
        object_id: rows().map(|row| row as u32 + 1).collect(),
        polygon_id: rows().map(|row| row as u32).collect(),
        barycentric: vec![Vec3::new(0.2, 0.3, 0.5); len],
        distance: vec![2.0; len],
        depth: vec![5.0; len],
        path_kind: vec![PathKind::Reflection; len],
        front_facing: vec![true; len],
        pixels_per_unit: vec![100.0; len],
        curvature: vec![0.5; len],
        footprint: vec![0.01; len],
        uv_footprint: vec![0.02; len],
        attribute_set: vec![0; len],
        attributes: Arc::new(vec![Default::default()]),
        lights: rows()
            .flat_map(|_| {
                [
                    LightSample { direction: Vec3::Y, radiance: Vec3::new(1.0, 0.5, 0.25), visibility: 1.0 },
                    LightSample { direction: Vec3::X, radiance: Vec3::ONE, visibility: 0.5 },
                ]
            })
            .collect(),
        light_count: 2,
        time: 1.5,
        material_id: 1,
    }
}

/// Shades a batch with material 0 and all outputs wanted.
pub fn shade(scene: &Scene, host: &Host, hits: &HitBatch) -> (OutputBatch, ShadeErrors) {
    let (shaders, _) = Shaders::compile(scene, host).unwrap_or_else(|faults| panic!("{}", rendered(&faults)));
    let mut outputs = OutputBatch::default();
    let mut errors = ShadeErrors::default();
    Shading::new(scene, &shaders).shade(MaterialId(0), hits, OutputSet::all(), &mut outputs, &mut errors);
    (outputs, errors)
}

/// The `aov_x` that a script body gives at the first hit: `expression` may use `hit` and `p`.
pub fn value(expression: &str) -> Vec3 {
    let script = format!("fn params() {{ #{{ map: () }} }} fn surface(hit, p) {{ #{{ color: {expression} }} }}");
    let params = BTreeMap::from([("map".to_owned(), (texture(), None))]);
    let (outputs, errors) = shade(&scene_with(&[&script], params), &Host::new(), &batch(3));
    let faults = errors.into_diagnostics();
    assert!(faults.is_empty(), "{expression}: {}", rendered(&faults));
    outputs.color[0].expect("the script gives a colour")
}

/// What is said of a script at compile time, or at run time by the first hits.
pub fn complaint(script: &str) -> String {
    let scene = scene(&[script]);
    match Shaders::compile(&scene, &Host::new()) {
        Err(faults) => rendered(&faults),
        Ok((shaders, _)) => {
            let mut errors = ShadeErrors::default();
            let mut outputs = OutputBatch::default();
            Shading::new(&scene, &shaders).shade(MaterialId(0), &batch(3), OutputSet::all(), &mut outputs, &mut errors);
            assert!(!errors.is_empty(), "nothing was wrong with: {script}");
            rendered(&errors.into_diagnostics())
        }
    }
}

pub fn rendered(faults: &Diagnostics) -> String {
    faults.0.iter().map(|fault| fault.render(false)).collect::<Vec<_>>().join("\n")
}
