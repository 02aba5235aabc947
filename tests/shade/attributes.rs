//! Attributes of objects: what scripts get, and what is said when types do not fit.

use super::*;
use crate::common::{load, scene_from};
use tusche::film::Layer;
use tusche::scene::attributes::{Attribute, AttributeSet};
use tusche::shade::ShadingMode;

/// The colour of a material with this body on an object with attributes, or what is said.
fn try_shade(body: &str, attributes: &[(&str, Attribute)]) -> Result<Vec3, String> {
    let script = format!("fn surface(hit, p) {{\n    #{{ color: {body} }}\n}}");
    let set: AttributeSet = attributes.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect();
    let mut builder = scene(&[&script]).into_builder();
    let mesh = builder.add_mesh(tusche::scene::mesh::Mesh::default());
    let object = builder.add_object(tusche::scene::Object {
        name: "thing".into(),
        mesh,
        materials: vec![MaterialId(0)],
        world_from_object: tusche::math::DAffine3::IDENTITY,
        priority: None,
        visible_to: tusche::scene::settings::RayKinds::all(),
        lines: true,
        group: None,
        span: None,
    });
    builder.attributes.extend_object(object, set);
    let scene = builder.build().unwrap_or_else(|faults| panic!("{}", rendered(&faults)));
    let (shaders, _) = Shaders::compile(&scene, &Host::new()).map_err(|faults| rendered(&faults))?;
    let set = scene.attributes().of(object, MaterialId(0));
    let mut hits = batch(1);
    if shaders.all()[0].needs(OutputSet::all()).contains(tusche::shade::InputSet::ATTRIBUTE) {
        hits.attribute_set = vec![set];
        hits.attributes = Arc::clone(scene.attributes().sets());
    }
    let (mut outputs, mut errors) = (OutputBatch::default(), ShadeErrors::default());
    Shading::new(&scene, &shaders).shade(MaterialId(0), &hits, OutputSet::all(), &mut outputs, &mut errors);
    let (reference, _) =
        Shaders::compile_for(&scene, &Host::new(), ShadingMode::Interpreter).expect("it compiled before");
    let (mut interpreted, mut same) = (OutputBatch::default(), ShadeErrors::default());
    Shading::new(&scene, &reference).shade(MaterialId(0), &hits, OutputSet::all(), &mut interpreted, &mut same);
    assert_eq!((&outputs.color, errors.is_empty()), (&interpreted.color, same.is_empty()), "{body}");
    if errors.is_empty() { Ok(outputs.color[0].expect("a colour")) } else { Err(rendered(&errors.into_diagnostics())) }
}

#[test]
fn the_default_gives_the_type() {
    let all = [
        ("wear", Attribute::Float(0.25)),
        ("count", Attribute::Int(3)),
        ("tint", Attribute::Vec3(Vec3::new(1.0, 0.5, 0.25))),
        ("pair", Attribute::Vec2(Vec2::new(2.0, 3.0))),
        ("plane", Attribute::Vec4(Vec4::new(1.0, 2.0, 3.0, 4.0))),
        ("worn", Attribute::Bool(true)),
        ("style", Attribute::Text("bold".into())),
    ];
    let is = |body: &str, expected: Vec3| assert_eq!(try_shade(body, &all), Ok(expected), "{body}");
    is("gray(hit.attribute(\"wear\", 1.0))", Vec3::splat(0.25));
    is("gray(hit.attribute(\"count\", 1.0) / 2)", Vec3::splat(1.5));
    is("gray(hit.attribute(\"count\", 1) / 2)", Vec3::splat(1.0));
    is("hit.attribute(\"tint\", rgb(0, 0, 0))", Vec3::new(1.0, 0.5, 0.25));
    is("vec3(hit.attribute(\"pair\", vec2(0.0)), 0.0)", Vec3::new(2.0, 3.0, 0.0));
    is("hit.attribute(\"plane\", vec4(0.0)).wzy", Vec3::new(4.0, 3.0, 2.0));
    is("gray(if hit.attribute(\"worn\", false) { 1.0 } else { 0.0 })", Vec3::ONE);
    is("gray(if hit.attribute(\"style\", \"thin\") == \"bold\" { 1.0 } else { 0.0 })", Vec3::ONE);
    is("gray(hit.attribute(\"none\", 0.75))", Vec3::splat(0.75));
}

#[track_caller]
fn assert_said(body: &str, words: &[&str]) {
    let said = try_shade(body, &[("wear", Attribute::Float(0.25)), ("style", Attribute::Text("bold".into()))]);
    let said = said.expect_err("it is wrong");
    assert!(said.contains("first.rhai:2:"), "{said}");
    for word in words {
        assert!(said.contains(word), "no `{word}` in {said}");
    }
}

#[test]
fn types_that_do_not_fit_are_told() {
    assert_said("gray(hit.attribute(\"style\", 1.0))", &["`style` is a text here, but its default is a number"]);
    assert_said("gray(hit.attribute(\"wear\", 1))", &["`wear` is a number here, but its default is an int"]);
    assert_said("hit.attribute(\"wear\", rgb(1, 0, 0))", &["its default is a vec3"]);
    assert_said("gray(hit.attribute(\"none\", [1.0])[0])", &["an attribute cannot be"]);
    assert_said("gray(hit.attribute(`w${hit.object_id}`, 1.0))", &["must be known from the script's text"]);
    assert_said("gray(hit.attribute(1, 1.0))", &["must be known from the script's text"]);
}

const SCENE: &str = r#"
[render]
size = [8, 4]
samples = 1
[camera]
projection = "orthographic"
height = 4.0
position = [0, 0, 5]
target = [0, 0, 0]
[materials.flat]
shader = "flat.rhai"
[[objects]]
shape = "box"
material = "flat"
translate = [-2, 0, 0]
size = 4
attributes = { tint = [1, 0, 0], wear = 0.5 }
[[objects]]
shape = "box"
material = "flat"
translate = [2, 0, 0]
size = 4
attributes = { wear = 1 }
"#;

#[test]
fn attributes_come_from_the_scene_file() {
    let text = "fn surface(hit, p) { #{ color: hit.attribute(\"tint\", rgb(0, 1, 0)) * hit.attribute(\"wear\", 0.0), line_width: 0 } }";
    let path = crate::common::root().join("scenes/test.toml");
    let files = tusche::files::FileStore::new()
        .with_file(&path, SCENE)
        .with_file(crate::common::root().join("scenes/flat.rhai"), text);
    let (builder, _) = tusche::scene::file::load(&path, &files, &[], &Default::default())
        .unwrap_or_else(|faults| panic!("{}", rendered(&faults)));
    let scene = builder.build().expect("it is whole");
    let (picture, _) = crate::common::render_with(&scene, &[Layer::Color], &Default::default());
    let at = |x: usize| [0, 1, 2].map(|channel| picture.at(channel, x, 2));
    assert!((at(1)[0] - 0.5).abs() < 1e-3 && at(1)[1] < 1e-3, "{:?}", at(1));
    assert!((at(6)[1] - 1.0).abs() < 1e-3 && at(6)[0] < 1e-3, "{:?}", at(6));
}

#[test]
fn attributes_that_nobody_asks_for_change_nothing() {
    let plain = scene_from("[[objects]]\nshape = \"sphere\"\n");
    let with = scene_from("[[objects]]\nshape = \"sphere\"\nattributes = { wear = 0.5 }\n");
    for scene in [plain, with] {
        let (shaders, _) = Shaders::compile(&scene, &Host::new()).expect("it compiles");
        assert!(!shaders.all()[0].needs(OutputSet::all()).contains(tusche::shade::InputSet::ATTRIBUTE));
    }
    let faults = load("[[objects]]\nshape = \"sphere\"\nattributes = { wear = [1] }\n").expect_err("one number");
    assert!(rendered(&faults).contains("test.toml:3:23"), "{}", rendered(&faults));
}
