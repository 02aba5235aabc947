//! The shipped shaders, with parameters as models and scenes give them.

use std::collections::BTreeMap;

use super::assert_dump;
use crate::shade::{scene_with, texture};
use tusche::scene::ids::MaterialId;
use tusche::scene::material::ParamValue;
use tusche::shade::{Analysis, Host, OutputSet, Shaders, builtin};

fn shipped(name: &str, params: &[(&str, ParamValue)]) -> Analysis {
    let params: BTreeMap<_, _> =
        params.iter().map(|(name, value)| ((*name).to_owned(), (value.clone(), None))).collect();
    let source = builtin::source(name).expect("it is shipped");
    let scene = scene_with(&[&source.text], params);
    let (shaders, _) = Shaders::compile(&scene, &Host::new()).unwrap_or_else(|faults| panic!("{faults}"));
    shaders.of(MaterialId::from_index(0)).analysis().clone()
}

#[test]
fn every_shipped_shader_is_understood() {
    for name in builtin::names() {
        let found = shipped(name, &[]);
        assert!(found.complete && found.findings.is_empty(), "{name}: {found}");
    }
}

#[test]
fn a_plain_model_is_constant() {
    let found = shipped("default", &[]);
    assert!(found.is_constant());
    assert_dump(
        &found,
        "inputs: none
         base_color: always, [1.0, 1.0], constant
         metallic: always, [0.0, 0.0], constant
         roughness: always, [1.0, 1.0], constant
         specular: always, [1.0, 1.0], constant
         ior: always, [1.5, 1.5], constant
         transmission: always, [0.0, 0.0], constant
         opacity: always, [1.0, 1.0], constant
         emission: always, [0.0, 0.0], constant",
    );
}

#[test]
fn a_model_s_textures_are_read_where_it_has_them() {
    let given = [
        ("metallic", ParamValue::Float(0.0)),
        ("roughness", ParamValue::Float(0.8)),
        ("metallic_roughness_texture", texture()),
        ("normal_texture", texture()),
        ("alpha_mode", ParamValue::Text("mask".into())),
        ("use_vertex_color", ParamValue::Bool(true)),
    ];
    assert_dump(
        &shipped("default", &given),
        "inputs: normal uv tangent color front_facing
         base_color: always, [-1e18, 1e18], from color
         metallic: always, [0.0, 0.0], constant
         roughness: always, [0.2, 0.2], constant
         specular: always, [1.0, 1.0], constant
         ior: always, [1.5, 1.5], constant
         transmission: always, [0.0, 0.0], constant
         opacity: always, [0.0, 1.0], from color
         emission: always, [0.0, 0.0], constant
         normal: always, [-1.25, 1.25], from normal tangent front_facing",
    );
}

#[test]
fn an_unlit_model_has_no_material() {
    let given = [("unlit", ParamValue::Bool(true)), ("base_color_texture", texture())];
    assert_dump(
        &shipped("default", &given),
        "inputs: uv
         opacity: always, [1.0, 1.0], constant
         color: always, [0.25, 0.75], constant",
    );
}

#[test]
fn a_mirror_is_one_whatever_it_meets() {
    let found = shipped("mirror", &[]);
    assert!(found.is_constant());
    assert_eq!(found.output(OutputSet::ROUGHNESS).range, Some([0.0, 0.0]));
    assert_eq!(found.output(OutputSet::METALLIC).range, Some([1.0, 1.0]));
}

#[test]
fn light_driven_width() {
    assert_dump(
        &shipped("light_driven_width", &[]),
        "inputs: normal light_count light
         base_color: always, [0.75, 0.8], constant
         line_color: always, [0.049999148, 0.8500009], from normal light_count light
         line_width: always, [0.49999496, 5.0000052], from normal light_count light",
    );
}

#[test]
fn lit_shadow() {
    assert_dump(
        &shipped("lit_shadow", &[]),
        "inputs: irradiance
         feature: always, [0.0, 1.0], from irradiance
         line_width: always, [2.0, 2.0], constant
         color: always, [0.4499991, 0.8500009], from irradiance",
    );
}

#[test]
fn cel() {
    assert_dump(
        &shipped("cel", &[]),
        "inputs: irradiance
         line_color: always, [0.048, 0.105000004], constant
         line_width: always, [2.0, 2.8], from irradiance
         color: always, [0.04499985, 0.90000093], from irradiance",
    );
}

#[test]
fn hatch() {
    assert_dump(
        &shipped("hatch", &[]),
        "inputs: uv irradiance
         line_color: always, [0.07, 0.12], constant
         line_width: always, [1.5, 1.5], constant
         color: always, [0.069999054, 0.960001], from uv irradiance",
    );
}

#[test]
fn noise_width() {
    assert_dump(
        &shipped("noise_width", &[]),
        "inputs: position
         base_color: always, [0.85, 0.9], constant
         line_width: always, [0.0, 4.0], from position",
    );
}

#[test]
fn polygon_ids() {
    assert_dump(
        &shipped("polygon_ids", &[]),
        "inputs: polygon_id
         base_color: always, [0.8, 0.8], constant
         feature: always, [0.0, 1.0], from polygon_id
         line_width: always, [1.0, 1.0], constant",
    );
}

#[test]
fn uv_lines() {
    assert_dump(
        &shipped("uv_lines", &[]),
        "inputs: uv
         feature: always, [0.0, 1.0], from uv
         line_color: always, [0.55, 1.0], constant
         line_width: always, [1.0, 1.0], constant
         color: always, [0.12, 0.22], constant",
    );
}
