//! The shaders in `shaders/`.

use super::*;
use tusche::shade::builtin;

fn run(name: &str) -> OutputBatch {
    run_with(name, BTreeMap::new())
}

fn run_with(name: &str, params: BTreeMap<String, (ParamValue, Option<tusche::diag::Span>)>) -> OutputBatch {
    let source = builtin::source(name).expect("it is shipped");
    let (outputs, errors) = shade(&scene_with(&[&source.text], params), &Host::new(), &batch(16));
    assert!(errors.is_empty(), "{name}: {}", rendered(&errors.into_diagnostics()));
    assert_eq!(outputs.len, 16);
    outputs
}

#[test]
fn each_runs_and_begins_with_a_lesson() {
    for name in builtin::names() {
        let source = builtin::source(name).expect("it is shipped");
        assert_eq!(source.name, format!("builtin:{name}"));
        assert!(source.text.starts_with("//! "), "{name} has no doc comment");
        let outputs = run(name);
        let finite = |values: &[Option<Vec3>]| values.iter().flatten().all(|v| v.is_finite());
        assert!(finite(&outputs.color) && finite(&outputs.line_color), "{name}");
        assert!(outputs.base_color.iter().chain(&outputs.feature).all(|v| v.is_finite()), "{name}");
        assert!(outputs.line_width.iter().flatten().all(|w| (0.0..64.0).contains(w)), "{name}");
    }
    assert!(builtin::source("nothing").is_none());
    assert!(builtin::names().is_sorted());
}

#[test]
fn the_default_shader_takes_what_a_model_gives() {
    let outputs = run("default");
    assert_eq!((outputs.base_color[0], outputs.opacity[0], outputs.normal[0]), (Vec3::ONE, 1.0, None));
    let given = |params: &[(&str, ParamValue)]| {
        run_with("default", params.iter().map(|(name, value)| ((*name).to_owned(), (value.clone(), None))).collect())
    };
    // The texture is (0.5, 0.25, 0.75, 0.5) everywhere.
    let all = given(&[
        ("base_color", ParamValue::Vec3(Vec3::new(1.0, 1.0, 0.0))),
        ("alpha", ParamValue::Float(0.5)),
        ("base_color_texture", texture()),
        ("use_vertex_color", ParamValue::Bool(true)),
        ("metallic", ParamValue::Float(1.0)),
        ("metallic_roughness_texture", texture()),
        ("normal_texture", texture()),
        ("occlusion_texture", texture()),
        ("occlusion_strength", ParamValue::Float(0.5)),
        ("emissive", ParamValue::Vec3(Vec3::splat(2.0))),
        ("emissive_texture", texture()),
        ("alpha_mode", ParamValue::Text("blend".into())),
        ("transmission", ParamValue::Int(1)),
        ("transmission_texture", texture()),
        ("specular_texture", texture()),
    ]);
    assert_eq!(all.base_color[0], Vec3::new(0.5 * 0.2, 0.25 * 0.4, 0.0));
    assert_eq!(all.opacity[0], 0.5 * 0.5 * 0.8);
    assert_eq!((all.metallic[0], all.roughness[0]), (0.75, 0.25));
    assert_eq!((all.transmission[0], all.specular[0], all.occlusion[0]), (0.5, 0.5, 0.75));
    assert_eq!(all.emission[0], Vec3::new(1.0, 0.5, 1.5));
    // (0.5, 0.25, 0.75) is the direction (0, -0.5, 0.5): half along the normal y, half against v, which is −z.
    let normal = all.normal[0].expect("there is a normal map");
    assert!(normal.abs_diff_eq(Vec3::new(0.0, 1.0, 1.0).normalize(), 1e-6), "{normal}");

    let masked = given(&[("alpha", ParamValue::Float(0.4)), ("alpha_mode", ParamValue::Text("mask".into()))]);
    assert_eq!(masked.opacity[0], 0.0);
    let opaque = given(&[("alpha", ParamValue::Float(0.4))]);
    assert_eq!(opaque.opacity[0], 1.0);
    let unlit = given(&[("unlit", ParamValue::Bool(true)), ("base_color", ParamValue::Vec3(Vec3::X))]);
    assert_eq!(unlit.color[0], Some(Vec3::X));
}

#[test]
fn cel_shading_has_flat_tones() {
    let mut hits = batch(3);
    for (row, visibility) in [0.0, 0.5, 1.0].into_iter().enumerate() {
        hits.lights[row * 2] = LightSample { direction: Vec3::Y, radiance: Vec3::ONE, visibility };
    }
    let source = builtin::source("cel").expect("it is shipped");
    let (outputs, _) = shade(&scene(&[&source.text]), &Host::new(), &hits);
    let luminances: Vec<_> = outputs.color.iter().flatten().map(|c| tusche::math::luminance(*c)).collect();
    assert!(luminances[0] < luminances[1] && luminances[1] < luminances[2], "{luminances:?}");
    assert!(outputs.line_width[0] > outputs.line_width[2]);
}

#[test]
fn features_differ_where_lines_belong() {
    let polygons = run("polygon_ids");
    assert!(polygons.feature.windows(2).all(|pair| pair[0] != pair[1]));
    // uv.x grows by 0.1, the cells are 1/16 wide: each hit lies in a cell of its own.
    let cells = run("uv_lines");
    assert!(cells.feature.windows(2).all(|pair| pair[0] != pair[1]));
    let mut hits = batch(2);
    hits.lights[0].visibility = 0.0;
    let source = builtin::source("lit_shadow").expect("it is shipped");
    let (outputs, _) = shade(&scene(&[&source.text]), &Host::new(), &hits);
    assert_eq!(outputs.feature, [Vec3::ZERO, Vec3::ONE]);
}
