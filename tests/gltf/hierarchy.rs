//! Nodes: transforms, sharing, instances, names, and which scene is shown.

use std::path::Path;
use std::sync::Arc;

use serde_json::json;
use tusche::files::FileStore;
use tusche::math::{DAffine3, DVec3};
use tusche::scene::SceneBuilder;
use tusche::scene::gltf::{ModelTime, Placement, import};
use tusche::scene::settings::RayKinds;

use super::{Model, assert_near, base64, world};

#[test]
fn transforms_are_composed_down_the_tree() {
    let mut model = Model::triangle();
    model.json["nodes"][0] = json!({ "mesh": 0, "scale": [2, 2, 2] });
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let turned = model.push("nodes", json!({ "rotation": [0, 0, half, half], "children": [0] }));
    let top = model.push("nodes", json!({ "translation": [10, 0, 0], "children": [turned] }));
    model.json["scenes"][0]["nodes"] = json!([top]);
    let (scene, _) = model.import();
    assert_near(&world(&scene, &scene.objects[0]), &[[10., 0., 0.], [10., 2., 0.], [8., 0., 0.]]);
}

#[test]
fn a_matrix_is_given_column_by_column() {
    let mut model = Model::triangle();
    model.json["nodes"][0]["matrix"] = json!([0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1]);
    let (scene, _) = model.import();
    assert_near(&world(&scene, &scene.objects[0]), &[[5., 6., 7.], [5., 7., 7.], [4., 6., 7.]]);
}

#[test]
fn composition_keeps_double_precision() {
    let mut model = Model::triangle();
    model.json["nodes"][0]["translation"] = json!([0.25, 0, 0]);
    let far = model.push("nodes", json!({ "translation": [16_777_216, 0, 0], "children": [0] }));
    model.json["scenes"][0]["nodes"] = json!([far]);
    let (scene, _) = model.import();
    assert_eq!(scene.objects[0].world_from_object.translation, DVec3::new(16_777_216.25, 0., 0.));
}

#[test]
fn a_mesh_used_ten_thousand_times_is_stored_once() {
    let mut model = Model::triangle();
    for i in 1..10_000 {
        model.root(json!({ "mesh": 0, "translation": [i, 0, 0] }));
    }
    let (scene, imported) = model.import();
    assert_eq!((scene.objects.len(), scene.meshes.len(), scene.materials.len()), (10_000, 1, 1));
    assert_eq!(imported.objects, 0..10_000);
    assert_eq!(scene.objects[9_999].world_from_object.translation.x, 9_999.0);
}

#[test]
fn gpu_instances_are_objects() {
    let mut model = Model::triangle();
    let translations = model.floats("VEC3", &[0., 0., 1., 0., 0., 2., 0., 0., 3.]);
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let rotations = model.floats("VEC4", &[0., 0., 0., 1., 0., 0., half, half, 0., 0., 0., 1.]);
    let scales = model.floats("VEC3", &[1., 1., 1., 1., 1., 1., 3., 3., 3.]);
    model.json["extensionsRequired"] = json!(["EXT_mesh_gpu_instancing"]);
    model.json["nodes"][0]["translation"] = json!([100, 0, 0]);
    model.json["nodes"][0]["extensions"] = json!({ "EXT_mesh_gpu_instancing": {
        "attributes": { "TRANSLATION": translations, "ROTATION": rotations, "SCALE": scales }
    } });
    let (scene, _) = model.import();
    let names: Vec<_> = scene.objects.iter().map(|object| object.name.as_str()).collect();
    assert_eq!(names, ["m/thing[0]", "m/thing[1]", "m/thing[2]"]);
    assert_eq!(scene.meshes.len(), 1);
    assert_near(&world(&scene, &scene.objects[0]), &[[100., 0., 1.], [101., 0., 1.], [100., 1., 1.]]);
    assert_near(&world(&scene, &scene.objects[1]), &[[100., 0., 2.], [100., 1., 2.], [99., 0., 2.]]);
    assert_near(&world(&scene, &scene.objects[2]), &[[100., 0., 3.], [103., 0., 3.], [100., 3., 3.]]);
}

#[test]
fn object_names_are_unique() {
    let mut model = Model::triangle();
    model.root(json!({ "mesh": 0, "name": "thing" }));
    model.root(json!({ "mesh": 0 }));
    model.root(json!({ "mesh": 0, "name": "node 2" }));
    let (scene, _) = model.import();
    let names: Vec<_> = scene.objects.iter().map(|object| object.name.as_str()).collect();
    assert_eq!(names, ["m/thing", "m/thing (node 1)", "m/node 2", "m/node 2 (node 3)"]);
}

#[test]
fn the_marked_scene_is_shown() {
    let mut model = Model::triangle();
    let other = model.push("nodes", json!({ "mesh": 0, "name": "other" }));
    model.push("scenes", json!({ "nodes": [other] }));
    model.json["scene"] = json!(1);
    assert_eq!(model.import().0.objects[0].name, "m/other");
    model.json.as_object_mut().unwrap().remove("scene");
    assert_eq!(model.import().0.objects[0].name, "m/thing");
    model.json.as_object_mut().unwrap().remove("scenes");
    assert_eq!(model.import().0.objects.len(), 2);
}

#[test]
fn a_placement_reaches_every_object() {
    let mut model = Model::triangle();
    model.json["nodes"][0]["extras"] = json!({ "tusche": { "priority": 3 } });
    let placement = Placement {
        world_from_model: DAffine3::from_translation(DVec3::Y),
        priority: Some(7),
        visible_to: RayKinds::SHADOW,
        lines: false,
        ..Placement::named("placed")
    };
    let (scene, _) = model.try_import(ModelTime::Rest, &placement).unwrap();
    let object = &scene.objects[0];
    assert_eq!((object.name.as_str(), object.priority, object.lines), ("placed/thing", Some(7), false));
    assert_eq!(object.visible_to, RayKinds::SHADOW);
    assert_eq!(object.world_from_object.translation, DVec3::Y);
}

#[test]
fn groups_come_from_the_placement_else_from_the_nodes() {
    let mut model = Model::triangle();
    model.json["nodes"][0]["extras"] = json!({ "tusche": { "group": "wheels" } });
    model.root(json!({ "mesh": 0 }));
    let groups = |placement: &Placement| {
        let (scene, _) = model.try_import(ModelTime::Rest, placement).unwrap();
        scene.objects.into_iter().map(|object| object.group).collect::<Vec<_>>()
    };
    assert_eq!(groups(&Placement::named("m")), [Some("wheels".to_owned()), None]);
    let car = Some("car".to_owned());
    assert_eq!(groups(&Placement { group: car.clone(), ..Placement::named("m") }), [car.clone(), car]);
}

#[test]
fn importing_twice_into_one_scene() {
    let model = Model::triangle();
    let mut scene = SceneBuilder::default();
    let files = model.store();
    for name in ["a", "b"] {
        import(Path::new("model.gltf"), &files, ModelTime::Rest, &mut scene, &Placement::named(name)).unwrap();
    }
    let objects: Vec<_> = scene.objects.iter().map(|o| (o.name.as_str(), o.mesh.0, o.materials[0].0)).collect();
    assert_eq!(objects, [("a/thing", 0, 0), ("b/thing", 1, 1)]);
    assert_eq!(scene.scripts.len(), 1);
}

#[test]
fn a_scale_of_zero_hides_with_a_warning() {
    let mut model = Model::triangle();
    model.root(json!({ "mesh": 0, "scale": [0, 0, 0] }));
    model.root(json!({ "mesh": 0, "scale": [1, 0, 1] }));
    let (scene, imported) = model.import();
    assert_eq!(scene.objects.len(), 1);
    assert_eq!(
        imported.warnings.to_string(),
        "model.gltf: warning: nodes[1]: its scale is 0 in some direction, as for 2 objects in all; they are not drawn"
    );
}

#[test]
fn an_empty_scene_is_a_warning() {
    let (scene, imported) = Model::new().import();
    assert!(scene.objects.is_empty());
    assert_eq!(imported.warnings.to_string(), "model.gltf: warning: the model shows no triangles");
}

#[test]
fn a_very_deep_tree_does_not_overflow_the_stack() {
    let mut model = Model::triangle();
    let mut below = 0;
    for _ in 0..100_000 {
        below = model.push("nodes", json!({ "children": [below] }));
    }
    model.json["scenes"][0]["nodes"] = json!([below]);
    assert_eq!(model.import().0.objects.len(), 1);
}

#[test]
fn all_containers_hold_the_same_model() {
    let model = Model::triangle();
    let expected = model.mesh();
    let mut embedded = model.json.clone();
    let uri = format!("data:application/octet-stream;base64,{}", base64(&model.buffer));
    embedded["buffers"] = json!([{ "uri": uri, "byteLength": model.buffer.len() }]);
    let mut spaced = model.json.clone();
    spaced["buffers"] = json!([{ "uri": "my%20model.bin", "byteLength": model.buffer.len() }]);
    let with_mark = [&[0xef, 0xbb, 0xbf], embedded.to_string().as_bytes()].concat();
    let files = FileStore::new()
        .with_file("a.glb", model.glb())
        .with_file("a.gltf", embedded.to_string())
        .with_file("folder/b.gltf", spaced.to_string())
        .with_file("folder/my model.bin", model.buffer.clone())
        .with_file("marked.gltf", with_mark);
    for path in ["a.glb", "a.gltf", "folder/b.gltf", "marked.gltf"] {
        let mut scene = SceneBuilder::default();
        import(Path::new(path), &files, ModelTime::Rest, &mut scene, &Placement::named("m"))
            .unwrap_or_else(|faults| panic!("{faults}"));
        assert_eq!(scene.meshes, [Arc::new(expected.clone())], "{path}");
    }
    assert!(files.dependencies().iter().any(|path| path == Path::new("folder/my model.bin")));
}
