//! What scene files mean.

use std::path::Path;
use std::sync::Arc;

use proptest::prelude::*;
use tusche::math::{DVec3, Vec2, Vec3, Vec4};
use tusche::scene::camera::Projection;
use tusche::scene::file::{LoadOptions, load};
use tusche::scene::ids::ObjectId;
use tusche::scene::light::LightKind;
use tusche::scene::material::ParamValue;
use tusche::scene::settings::{
    Background, Composition, FilterKind, HiddenLines, LineSettings, LineType, RayKinds, RenderSettings, Sampler,
    TypeStyle,
};
use tusche::scene::shape::Shape;
use tusche::scene::texture::{Pixels, TextureFilter, Wrap};

use super::{load_with, loaded, store};

const FULL: &str = include_str!("full.toml");

#[test]
fn an_empty_file_means_the_defaults_of_the_library() {
    let (scene, warnings) = load_with("", &[], &LoadOptions::default()).unwrap();
    assert_eq!(warnings.0.len(), 1);
    assert_eq!(scene.render, RenderSettings::default());
    assert_eq!(scene.lines, LineSettings::default());
    assert_eq!(scene.cameras.len(), 1, "the scene is framed");
    assert!(!scene.lights.is_empty(), "there are default lights");
    scene.build().unwrap();
}

#[test]
fn every_setting_is_taken_over() {
    let scene = loaded(FULL);
    assert_eq!(
        scene.render,
        RenderSettings {
            size: [320, 240],
            samples: 9,
            line_oversampling: 4,
            sampler: Sampler::BlueNoise,
            seed: 7,
            background: Background::Gradient { bottom: Vec3::splat(0.1), top: Vec3::new(0.5, 0.6, 0.7) },
            ambient: Vec3::new(0.3, 0.2, 0.1),
            filter: FilterKind::Mitchell,
            filter_radius: 2.0,
            reflection_depth: 2,
            refraction_depth: 3,
        }
    );
    assert_eq!(
        scene.lines,
        LineSettings {
            enabled: true,
            color: Vec3::new(0.1, 0.0, 0.2),
            width: 3.0,
            max_width: 12.0,
            min_width: 1.0,
            width_compensation: false,
            object: false,
            shader: false,
            uv: Some(0.25),
            normal: Some(30.0),
            feature: Some(0.5),
            overlap: Some(2.0),
            paths: RayKinds::CAMERA | RayKinds::REFRACTION,
            tint: false,
            compose: Composition::Throughput,
            types: LineType::ALL.map(|kind| match kind {
                LineType::Crease => {
                    TypeStyle { color: Some(Vec3::new(0.2, 0.1, 0.0)), width: Some(1.5), opacity: Some(0.75) }
                }
                LineType::Outline => TypeStyle { width: Some(6.0), ..TypeStyle::default() },
                _ => TypeStyle::default(),
            }),
            surfaces: 3,
            hidden: Some(HiddenLines {
                color: Vec3::new(0.2, 0.3, 0.4),
                width: 0.75,
                objects: Some(vec![ObjectId(0)]),
            }),
        }
    );
    scene.build().unwrap();
}

#[test]
fn cameras() {
    let scene = loaded(FULL);
    let [front, plan] = &scene.cameras[..] else { panic!("{:?}", scene.cameras) };
    assert_eq!(front.name, "front");
    assert_eq!(front.projection, Projection::Perspective { fov_y: 30.0_f64.to_radians() });
    assert_eq!(front.position, DVec3::new(0.0, 1.0, 6.0));
    assert_eq!(plan.projection, Projection::Orthographic { height: 4.0 });
    assert_eq!(plan.world_from_camera.z_axis, DVec3::Y, "it looks down");
    assert_eq!(plan.world_from_camera.y_axis, DVec3::NEG_Z);
    // The first is used unless another is asked for.
    assert_eq!(scene.build().unwrap().camera().name, "front");
    let options = LoadOptions { camera: Some("plan".to_owned()), ..LoadOptions::default() };
    let (scene, _) = load_with(FULL, &[], &options).unwrap();
    assert_eq!(scene.build().unwrap().camera().name, "plan");
}

#[test]
fn materials_and_their_parameters() {
    let scene = loaded(FULL);
    let ink = &scene.materials[0];
    assert_eq!((ink.name.as_str(), ink.priority, ink.double_sided), ("ink", Some(-3), false));
    assert_eq!(ink.dielectric_priority, 2);
    assert_eq!(scene.scripts[ink.script.index()].path.as_deref(), Some(Path::new("ink.rhai")));
    let value = |name: &str| ink.params[name].0.clone();
    assert_eq!(value("on"), ParamValue::Bool(true));
    assert_eq!(value("count"), ParamValue::Int(4));
    assert_eq!(value("width"), ParamValue::Float(2.5));
    assert_eq!(value("offset"), ParamValue::Vec2(Vec2::new(1.0, 2.0)));
    assert_eq!(value("paint"), ParamValue::Vec3(Vec3::new(0.1, 0.2, 0.3)));
    assert_eq!(value("rect"), ParamValue::Vec4(Vec4::new(1.0, 2.0, 3.0, 4.0)));
    assert_eq!(value("mode"), ParamValue::Text("wet".to_owned()));
    let ParamValue::Texture(paper) = value("paper") else { panic!() };
    let texture = &scene.textures[paper.texture.index()];
    assert_eq!((texture.wrap, texture.filter), ([Wrap::Clamp; 2], TextureFilter::Linear));
    assert!(matches!(texture.image.pixels, Pixels::Rgba8 { srgb: false, .. }));
    let ParamValue::Texture(grain) = value("grain") else { panic!() };
    let texture = &scene.textures[grain.texture.index()];
    assert_eq!((texture.wrap, texture.filter), ([Wrap::Mirror; 2], TextureFilter::Nearest));
    assert_eq!((texture.image.width, texture.image.height), (1, 1));
    // Each value knows where it was written.
    let span = ink.params["width"].1.as_ref().unwrap();
    assert_eq!(&span.source.text[span.range.clone()], "2.5");
    let base = &scene.materials[1];
    assert!(scene.scripts[base.script.index()].path.is_none());
    assert!(base.double_sided && base.priority.is_none());
}

#[test]
fn materials_share_scripts_and_textures_share_images() {
    let scene = loaded(
        r#"
        [materials.zebra]
        shader = "ink.rhai"
        params = { a = { texture = "white.png" }, b = { texture = "white.png", wrap = "clamp" }, c = { texture = "white.png" } }
        [materials.aardvark]
        shader = "ink.rhai"
        [[objects]]
        shape = "sphere"
        "#,
    );
    let names: Vec<_> = scene.materials.iter().map(|material| material.name.as_str()).collect();
    assert_eq!(names, ["zebra", "aardvark", "default"], "in the order of the file");
    assert_eq!(scene.scripts.len(), 2);
    assert_eq!(scene.textures.len(), 2);
    assert!(Arc::ptr_eq(&scene.textures[0].image, &scene.textures[1].image));
}

#[test]
fn objects() {
    let scene = loaded(FULL);
    let [floor, torus, cylinder] = &scene.objects[..] else { panic!() };
    assert_eq!((floor.name.as_str(), floor.priority, floor.lines), ("floor", Some(5), false));
    assert_eq!(floor.visible_to, RayKinds::CAMERA | RayKinds::SHADOW);
    assert_eq!(*scene.meshes[floor.mesh.index()], Shape::Plane { size: [4.0, 6.0], segments: [2, 3] }.mesh().unwrap());
    assert_eq!(floor.world_from_object.transform_point3(DVec3::ZERO), DVec3::NEG_Y);
    assert_eq!((torus.name.as_str(), torus.priority, torus.lines), ("torus", None, true));
    assert_eq!(torus.visible_to, RayKinds::all());
    let expected = Shape::Torus { radius: 2.0, tube_radius: 0.5, segments: [12, 6] };
    assert_eq!(*scene.meshes[torus.mesh.index()], expected.mesh().unwrap());
    // Scaled first, then turned: the axis y is twice as long and points along z.
    assert_eq!(torus.world_from_object.transform_vector3(DVec3::Y), DVec3::Z * 2.0);
    assert_eq!(cylinder.world_from_object.transform_point3(DVec3::ONE), DVec3::new(3.0, 4.0, 5.0));
    assert_eq!(scene.materials[cylinder.materials[0].index()].name, "default");
    let span = floor.span.as_ref().unwrap();
    assert!(span.source.text[span.range.end..].starts_with("\nname = \"floor\""), "{span:?}");
}

#[test]
fn equal_shapes_share_a_mesh() {
    let scene = loaded(
        r#"
        [[objects]]
        shape = "sphere"
        [[objects]]
        shape = "sphere"
        radius = 1.0
        translate = [3, 0, 0]
        [[objects]]
        shape = "sphere"
        segments = [128, 64]
        [[objects]]
        shape = "sphere"
        radius = 2
        "#,
    );
    assert_eq!(scene.meshes.len(), 2);
    let names: Vec<_> = scene.objects.iter().map(|object| object.name.as_str()).collect();
    assert_eq!(names, ["sphere", "sphere 2", "sphere 3", "sphere 4"]);
    assert_eq!(scene.materials.len(), 1, "and the default material");
}

#[test]
fn all_shapes_are_there_and_fit_the_cube() {
    for shape in ["sphere", "box", "plane", "cylinder", "cone", "torus", "disc", "capsule", "knot"] {
        let scene = loaded(&format!("[[objects]]\nshape = \"{shape}\"\nsegments = 24\n"));
        let mesh = &scene.meshes[0];
        let reach = mesh.positions.iter().fold(Vec3::ZERO, |reach, position| reach.max(position.abs()));
        assert!((reach.max_element() - 1.0).abs() < 0.02, "{shape} reaches {reach}");
        scene.build().unwrap();
    }
}

#[test]
fn lights() {
    let scene = loaded(FULL);
    let [sun, point, spot] = &scene.lights[..] else { panic!() };
    assert_eq!((sun.name.as_str(), sun.shadows), ("noon", false));
    // Light that travels down comes from above.
    assert_eq!(sun.kind, LightKind::Sun { direction: Vec3::Y, irradiance: Vec3::new(2.0, 1.0, 0.0) });
    assert_eq!((point.name.as_str(), point.shadows), ("point", true));
    assert_eq!(point.kind, LightKind::Point { position: DVec3::new(0.0, 4.0, 0.0), intensity: Vec3::splat(10.0) });
    let LightKind::Spot { direction, inner_cos, outer_cos, .. } = spot.kind else { panic!() };
    assert_eq!(direction, Vec3::NEG_Y);
    // Angles are full angles: 60 degrees reach 30 to each side.
    assert_eq!((inner_cos, outer_cos), (1.0, (3.0_f32).sqrt() / 2.0));
}

#[test]
fn thresholds_and_backgrounds_have_alternatives() {
    let scene = loaded("[lines]\nuv = false\nnormal = 0\n[[objects]]\nshape = \"box\"");
    assert_eq!((scene.lines.uv, scene.lines.normal), (None, Some(0.0)));
    let background =
        |text: &str| loaded(&format!("[render]\nbackground = {text}\n[[objects]]\nshape = \"box\"")).render.background;
    assert_eq!(background("\"transparent\""), Background::Transparent);
    assert_eq!(background("[1, 0.5, 0]"), Background::Color(Vec3::new(1.0, 0.5, 0.0)));
    assert!(matches!(background("{ image = \"white.png\", strength = 2 }"), Background::Image { strength: 2.0, .. }));
}

#[test]
fn paths_are_relative_to_the_scene_file_and_those_of_overrides_are_not() {
    let scene = "[materials.a]\nshader = \"../shaders/a.rhai\"\n[[objects]]\nshape = \"box\"";
    let script = "fn surface(hit, p) { #{} }";
    let files = tusche::files::FileStore::new()
        .with_file("project/scenes/scene.toml", scene)
        .with_file("project/scenes/../shaders/a.rhai", script)
        .with_file("here.rhai", script);
    let path = Path::new("project/scenes/scene.toml");
    let (builder, _) = load(path, &files, &[], &LoadOptions::default()).unwrap();
    assert_eq!(builder.scripts[0].path.as_deref(), Some(Path::new("project/scenes/../shaders/a.rhai")));
    let change = tusche::scene::file::Override::parse("materials.a.shader=here.rhai").unwrap();
    let (builder, _) = load(path, &files, &[change], &LoadOptions::default()).unwrap();
    assert_eq!(builder.scripts[0].path.as_deref(), Some(Path::new("here.rhai")));
}

#[test]
fn time_follows_the_frame() {
    let options = LoadOptions { frame: Some(36.0), ..LoadOptions::default() };
    let (scene, _) = load_with(FULL, &[], &options).unwrap();
    assert_eq!(scene.time, 1.5);
    let options = LoadOptions { frame: Some(f64::NAN), ..LoadOptions::default() };
    assert!(load_with(FULL, &[], &options).unwrap_err().to_string().contains("frame must be a finite number"));
}

#[test]
fn a_missing_scene_file_is_named() {
    let faults = load(Path::new("no/such.toml"), &store(""), &[], &LoadOptions::default()).unwrap_err();
    assert_eq!(faults.to_string(), "no/such.toml: error: cannot read this file: no such file");
}

#[test]
fn files_that_cannot_be_used_are_faults_of_the_line_that_names_them() {
    let scene = "[render]\nbackground = { image = \"ink.rhai\" }\n[[objects]]\ngltf = \"missing.glb\"\nradius = 2\n";
    let faults = load_with(scene, &[], &LoadOptions::default()).unwrap_err();
    let lines: Vec<_> = faults.to_string().lines().map(str::to_owned).collect();
    assert!(lines[0].starts_with("scene.toml:2:24: error: ink.rhai: "), "{faults}");
    assert!(faults.to_string().contains("missing.glb"), "{faults}");
    assert!(lines.last().unwrap().contains("`radius` belongs to a shape, not to a model"), "{faults}");
}

#[test]
fn a_file_of_another_kind_is_told_in_few_words() {
    let faults = load_with(&"<scene> = \n".repeat(20_000), &[], &LoadOptions::default()).unwrap_err();
    assert_eq!(faults.0.len(), 41);
    assert_eq!(faults.0[40].to_string(), "error: scene.toml: 19960 more lines are not valid TOML");
}

#[test]
fn endless_nesting_is_no_stack_overflow() {
    let faults = load_with(&format!("a = {}", "[".repeat(100_000)), &[], &LoadOptions::default()).unwrap_err();
    assert!(faults.to_string().contains("max recursion depth"), "{faults}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever is done to a good file, the answer is a scene or messages with places inside the text.
    #[test]
    fn damaged_files_never_panic(edits in prop::collection::vec((0..FULL.len(), 0..30_usize, 0..FRAGMENTS.len()), 1..4)) {
        let mut text = FULL.to_owned();
        for (at, length, fragment) in edits {
            let at = at.min(text.len());
            let end = (at + length).min(text.len());
            if text.is_char_boundary(at) && text.is_char_boundary(end) {
                text.replace_range(at..end, FRAGMENTS[fragment]);
            }
        }
        match load_with(&text, &[], &LoadOptions::default()) {
            Ok((scene, _)) => { scene.build().unwrap(); }
            Err(faults) => {
                prop_assert!(faults.has_errors());
                for fault in &faults.0 {
                    prop_assert!(!fault.message.contains("did not match any variant"), "{}", fault);
                    prop_assert!(!fault.render(false).is_empty());
                }
            }
        }
    }
}

const FRAGMENTS: &[&str] = &[
    "",
    "\n",
    "=",
    "[",
    "]",
    "[[",
    "]]",
    "\"",
    "'",
    "{",
    "}",
    ",",
    ".",
    "#",
    "nan",
    "-inf",
    "1e308",
    "-1",
    "0",
    "true",
    "[]",
    "{}",
    "[[objects]]\n",
    "[camera]\n",
    "\nx = 1\n",
    "ü",
    "\0",
    "1979-05-27",
    "[nan]",
    "99999999999",
];
