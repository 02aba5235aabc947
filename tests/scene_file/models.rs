//! What scene files take from the models that they name.

use tusche::math::{DVec3, Vec3};
use tusche::scene::SceneBuilder;
use tusche::scene::camera::Projection;
use tusche::scene::file::LoadOptions;
use tusche::scene::light::LightKind;

use super::load_with;

fn stage(scene: &str, camera: Option<&str>) -> SceneBuilder {
    let options = LoadOptions { camera: camera.map(str::to_owned), ..LoadOptions::default() };
    load_with(scene, &[], &options).unwrap_or_else(|faults| panic!("{faults}")).0
}

const STAGE: &str = "[[objects]]\nname = \"set\"\ngltf = \"stage.gltf\"\ntranslate = [1, 0, 0]\n";

#[test]
fn a_camera_of_a_model_is_used_where_it_is_asked_for() {
    let by_node = stage(&format!("[camera]\nnode = \"Shot\"\n{STAGE}"), None);
    let by_long_name = stage(&format!("[camera]\nname = \"Shot\"\nnode = \"set/Shot\"\n{STAGE}"), None);
    let by_argument = stage(STAGE, Some("Shot"));
    for scene in [by_node, by_long_name, by_argument] {
        let scene = scene.build().unwrap();
        let camera = scene.camera();
        assert_eq!(camera.name, "Shot");
        assert_eq!(camera.position, DVec3::new(1.0, 0.0, 5.0), "it moves with its model");
        assert_eq!(camera.projection, Projection::Perspective { fov_y: 0.5 });
    }
}

#[test]
fn a_camera_of_a_model_is_not_used_unless_asked_for() {
    let scene = stage(STAGE, None);
    assert_eq!(scene.cameras.len(), 1);
    assert_ne!(scene.cameras[0].name, "Shot");
}

#[test]
fn a_camera_that_no_model_has() {
    let said = |scene: &str, camera: Option<&str>| {
        let options = LoadOptions { camera: camera.map(str::to_owned), ..LoadOptions::default() };
        load_with(scene, &[], &options).unwrap_err().to_string()
    };
    assert_eq!(
        said(&format!("[camera]\nnode = \"Shop\"\n{STAGE}"), None),
        "scene.toml:2:8: error: there is no camera named `Shop` (did you mean `Shot`?)\n\
         scene.toml:5:8: warning: stage.gltf: the model shows no triangles"
    );
    assert_eq!(
        said("[camera]\nnode = \"Shot\"\n[[objects]]\nshape = \"sphere\"", None),
        "scene.toml:2:8: error: there is no camera `Shot`: no model of this scene has cameras"
    );
    assert_eq!(
        said(STAGE, Some("Shop")),
        "scene.toml:3:8: warning: stage.gltf: the model shows no triangles\n\
         error: there is no camera named `Shop` (did you mean `Shot`?)"
    );
}

#[test]
fn lights_of_models_shine_unless_the_file_has_its_own() {
    let lamp = LightKind::Point { position: DVec3::new(1.0, 2.0, 0.0), intensity: Vec3::splat(40.0) };
    let kinds = |extra: &str| -> Vec<_> {
        stage(&format!("{STAGE}{extra}"), None).lights.into_iter().map(|light| light.kind).collect()
    };
    let own = "[[lights]]\nkind = \"point\"\nposition = [0, 9, 0]\n";
    assert_eq!(kinds(""), std::slice::from_ref(&lamp));
    assert_eq!(kinds(own).len(), 1);
    assert_ne!(kinds(own)[0], lamp);
    assert_eq!(kinds(&format!("lights = true\n{own}"))[1], lamp);
    let dark = kinds("lights = false\n");
    assert!(!dark.is_empty() && !dark.contains(&lamp), "there are default lights");
}
