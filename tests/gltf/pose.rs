//! Animations, skins and morph targets.

use serde_json::{Value, json};
use tusche::math::{DVec3, Mat4, Vec3};
use tusche::scene::gltf::ModelTime;

use super::{BYTE, Model, assert_near, world};

/// The triangle, whose node is animated by one channel.
fn animated(path: &str, interpolation: &str, times: &[f32], kind: &str, values: &[f32]) -> Model {
    let mut model = Model::triangle();
    let input = model.floats("SCALAR", times);
    let output = model.floats(kind, values);
    model.push(
        "animations",
        json!({
            "channels": [{ "sampler": 0, "target": { "node": 0, "path": path } }],
            "samplers": [{ "input": input, "output": output, "interpolation": interpolation }],
        }),
    );
    model
}

/// Where the triangle's second corner (1, 0, 0) is.
fn corner_at(model: &Model, time: ModelTime) -> Vec3 {
    let (scene, imported) = model.import_at(time);
    assert_eq!(imported.warnings.to_string(), "");
    world(&scene, &scene.objects[0])[1]
}

#[track_caller]
fn assert_corner(model: &Model, seconds: f64, expected: [f32; 3]) {
    assert_near(&[corner_at(model, ModelTime::Seconds(seconds))], &[expected]);
}

#[test]
fn translation_between_keys() {
    let model = animated("translation", "LINEAR", &[1., 2., 4.], "VEC3", &[0., 0., 0., 10., 0., 0., 10., 8., 0.]);
    for (seconds, expected) in [
        (-1.0, [1., 0., 0.]),
        (1.0, [1., 0., 0.]),
        (1.25, [3.5, 0., 0.]),
        (2.0, [11., 0., 0.]),
        (3.5, [11., 6., 0.]),
        (4.0, [11., 8., 0.]),
        (100.0, [11., 8., 0.]),
    ] {
        assert_corner(&model, seconds, expected);
    }
    assert_near(&[corner_at(&model, ModelTime::Frame(30.0))], &[[3.5, 0., 0.]]);
    assert_near(&[corner_at(&model, ModelTime::Rest)], &[[1., 0., 0.]]);
    for absurd in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert!(corner_at(&model, ModelTime::Seconds(absurd)).is_finite());
    }
}

#[test]
fn steps_hold_their_key() {
    let model = animated("scale", "STEP", &[0., 1.], "VEC3", &[2., 1., 1., 5., 1., 1.]);
    assert_corner(&model, 0.999, [2., 0., 0.]);
    assert_corner(&model, 1.0, [5., 0., 0.]);
}

#[test]
fn rotations_take_the_short_way() {
    let half = std::f32::consts::FRAC_1_SQRT_2;
    // The second key is a quarter turn about z, as its opposite quaternion.
    let model = animated("rotation", "LINEAR", &[0., 1.], "VEC4", &[0., 0., 0., 1., 0., 0., -half, -half]);
    assert_corner(&model, 1.0, [0., 1., 0.]);
    let third = (std::f32::consts::FRAC_PI_2 / 3.0).sin_cos();
    assert_corner(&model, 1.0 / 3.0, [third.1, third.0, 0.]);
}

#[test]
fn rotations_may_be_normalized_integers() {
    let mut model = animated("rotation", "LINEAR", &[0.], "VEC4", &[0.; 4]);
    let output = model.accessor(BYTE, "VEC4", 1, &[0, 0, 90, 90]);
    model.json["accessors"][output]["normalized"] = json!(true);
    model.json["animations"][0]["samplers"][0]["output"] = json!(output);
    assert_corner(&model, 0.0, [0., 1., 0.]);
}

#[test]
fn cubic_splines_pass_their_keys_with_their_tangents() {
    // Keys are (incoming tangent, value, outgoing tangent); two seconds apart.
    let keys = [[0., 0., 0.], [0., 0., 0.], [3., 0., 0.], [1., 0., 0.], [4., 0., 0.], [0., 0., 0.]];
    let model = animated("translation", "CUBICSPLINE", &[0., 2.], "VEC3", keys.as_flattened());
    assert_corner(&model, 0.0, [1., 0., 0.]);
    assert_corner(&model, 2.0, [5., 0., 0.]);
    // Hermite at the middle: half of both values, plus an eighth of the span times the difference of the tangents.
    assert_corner(&model, 1.0, [1. + 2. + 2. / 8. * (3. - 1.), 0., 0.]);
    let slope = (corner_at(&model, ModelTime::Seconds(1e-3)).x - 1.0) / 1e-3;
    assert!((slope - 3.0).abs() < 0.02, "{slope}");
}

#[test]
fn a_spline_of_rotations_is_normalized() {
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let none = [0.; 4];
    let keys = [none, [0., 0., 0., 1.], none, none, [0., 0., half, half], none];
    let model = animated("rotation", "CUBICSPLINE", &[0., 1.], "VEC4", keys.as_flattened());
    let eighth = std::f32::consts::FRAC_PI_4.sin_cos();
    assert_corner(&model, 0.5, [eighth.1, eighth.0, 0.]);
}

#[test]
fn only_the_first_animation_plays() {
    let mut model = animated("translation", "LINEAR", &[0.], "VEC3", &[3., 0., 0.]);
    let mut second = model.json["animations"][0].clone();
    second["samplers"][0]["output"] = json!(0);
    model.push("animations", second);
    assert_corner(&model, 0.0, [4., 0., 0.]);
}

#[test]
fn a_time_without_animation_is_a_warning() {
    let (_, imported) = Model::triangle().import_at(ModelTime::Frame(3.0));
    assert_eq!(
        imported.warnings.to_string(),
        "model.gltf: warning: the model has no animation: the time has no effect on it"
    );
}

#[test]
fn animations_with_faults() {
    let message = |edit: &dyn Fn(&mut Model)| {
        let mut model = animated("translation", "LINEAR", &[0., 1.], "VEC3", &[0.; 6]);
        edit(&mut model);
        model.faults().replace("model.gltf: error: animations[0].", "")
    };
    assert_eq!(
        message(&|model| model.json["animations"][0]["channels"][0]["target"]["node"] = json!(9)),
        "channels[0].target.node: there is no nodes[9]"
    );
    assert_eq!(
        message(&|model| {
            let times = model.floats("SCALAR", &[0., 1., 1.]);
            model.json["animations"][0]["samplers"][0]["input"] = json!(times);
        }),
        "samplers[0].input: the times must be finite and strictly increasing"
    );
    assert_eq!(
        message(&|model| {
            let times = model.floats("SCALAR", &[]);
            model.json["animations"][0]["samplers"][0]["input"] = json!(times);
        }),
        "samplers[0].input: an animation needs at least one key"
    );
    assert_eq!(
        message(&|model| model.json["animations"][0]["samplers"][0]["interpolation"] = json!("CUBICSPLINE")),
        "samplers[0].output: 2 keys need 6 values, found 2"
    );
    assert_eq!(
        message(&|model| {
            let values = model.floats("VEC3", &[0., 0., 0., f32::NAN, 0., 0.]);
            model.json["animations"][0]["samplers"][0]["output"] = json!(values);
        }),
        "samplers[0].output: the values must be finite"
    );
    assert_eq!(
        message(&|model| {
            let values = model.floats("VEC4", &[0.; 8]);
            model.json["animations"][0]["samplers"][0]["output"] = json!(values);
            model.json["animations"][0]["channels"][0]["target"]["path"] = json!("rotation");
        }),
        "samplers[0]: a rotation must be a quaternion of length 1"
    );
}

/// The triangle with two morph targets: up by 1, and right by 1 with the normal tilted.
fn morphing() -> Model {
    let mut model = Model::triangle();
    let normals = model.floats("VEC3", &[0., 0., 1.].repeat(3));
    let up = model.floats("VEC3", &[0., 1., 0.].repeat(3));
    let right = model.floats("VEC3", &[1., 0., 0.].repeat(3));
    model.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(normals);
    model.json["meshes"][0]["primitives"][0]["targets"] =
        json!([{ "POSITION": up }, { "POSITION": right, "NORMAL": right }]);
    model
}

#[test]
fn morph_weights_of_mesh_node_and_animation() {
    let mut model = morphing();
    assert_corner_at_rest(&model, [1., 0., 0.]);
    model.json["meshes"][0]["weights"] = json!([0.5, 0]);
    assert_corner_at_rest(&model, [1., 0.5, 0.]);
    model.json["nodes"][0]["weights"] = json!([0, 2]);
    assert_corner_at_rest(&model, [3., 0., 0.]);
    let (scene, _) = model.import();
    let tilted = 2.0_f32 / 5.0_f32.sqrt();
    assert_near(&scene.meshes[0].normals, &[[tilted, 0., tilted / 2.]; 3]);
    let times = model.floats("SCALAR", &[0., 1.]);
    let weights = model.floats("SCALAR", &[0., 0., 4., 2.]);
    model.push(
        "animations",
        json!({
            "channels": [{ "sampler": 0, "target": { "node": 0, "path": "weights" } }],
            "samplers": [{ "input": times, "output": weights }],
        }),
    );
    assert_corner(&model, 0.5, [2., 2., 0.]);
}

fn assert_corner_at_rest(model: &Model, expected: [f32; 3]) {
    assert_near(&[corner_at(model, ModelTime::Rest)], &[expected]);
}

#[test]
fn only_deformed_nodes_have_meshes_of_their_own() {
    let mut model = morphing();
    model.root(json!({ "mesh": 0, "name": "raised", "weights": [1, 0] }));
    model.root(json!({ "mesh": 0, "weights": [0, 0] }));
    let (scene, _) = model.import();
    let meshes: Vec<_> = scene.objects.iter().map(|object| object.mesh.0).collect();
    assert_eq!(meshes, [0, 1, 0]);
    assert_eq!(scene.meshes[1].name, "mesh 0 (node 1)");
    assert_near(&scene.meshes[0].positions, &[[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]]);
    assert_near(&scene.meshes[1].positions, &[[0., 1., 0.], [1., 1., 0.], [0., 2., 0.]]);
}

/// The triangle on two joints: the first is at rest, the second moved up by 10 and turned by a quarter about z.
fn skinned(joints: &[u16; 12], weights: &[f32; 12]) -> Model {
    let mut model = Model::triangle();
    let joints = model.shorts("VEC4", joints);
    let weights = model.floats("VEC4", weights);
    let normals = model.floats("VEC3", &[1., 0., 0.].repeat(3));
    let binds = [Mat4::IDENTITY, Mat4::from_translation(Vec3::new(-1., 0., 0.))].map(|bind| bind.to_cols_array());
    let binds = model.floats("MAT4", binds.as_flattened());
    model.json["meshes"][0]["primitives"][0]["attributes"] =
        json!({ "POSITION": 0, "NORMAL": normals, "JOINTS_0": joints, "WEIGHTS_0": weights });
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let still = model.root(json!({}));
    let moved = model.root(json!({ "translation": [0, 10, 0], "rotation": [0, 0, half, half] }));
    model.push("skins", json!({ "joints": [still, moved], "inverseBindMatrices": binds }));
    model.json["nodes"][0]["skin"] = json!(0);
    // Which glTF says to ignore.
    model.json["nodes"][0]["translation"] = json!([500, 0, 0]);
    model
}

#[test]
fn skins_blend_their_joints() {
    let joints = [0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0];
    let weights = [1., 0., 0., 0., 1., 0., 0., 0., 0.5, 0.5, 0., 0.];
    let model = skinned(&joints, &weights);
    let (scene, imported) = model.import();
    assert_eq!(imported.warnings.to_string(), "");
    // Second vertex: (1, 0) − (1, 0) turned and moved. Third: (0, 1) half, and half (−1, 1) turned to (−1, −1) + (0, 10).
    assert_near(&world(&scene, &scene.objects[0]), &[[0., 0., 0.], [0., 10., 0.], [-0.5, 5., 0.]]);
    let half = std::f32::consts::FRAC_1_SQRT_2;
    assert_near(&scene.meshes[0].normals, &[[1., 0., 0.], [0., 1., 0.], [half, half, 0.]]);
    assert_eq!(scene.objects[0].world_from_object.translation, DVec3::ZERO);
}

#[test]
fn weights_need_not_add_up_to_one() {
    let joints = [0; 12];
    let weights = [0.9, 0., 0., 0., 2., 2., 0., 0., 0., 0., 0., 0.];
    let (scene, _) = skinned(&joints, &weights).import();
    assert_near(&scene.meshes[0].positions, &[[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]]);
}

#[test]
fn skins_with_faults() {
    let joints = [0, 7, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
    let unused = [1., 0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0.];
    skinned(&joints, &unused).import();
    let mut used = unused;
    used[1] = 0.5;
    let message = |edit: &dyn Fn(&mut Value)| {
        let mut model = skinned(&joints, &used);
        edit(&mut model.json);
        model.faults().replace("model.gltf: error: ", "")
    };
    let attributes = "meshes[0].primitives[0].attributes";
    assert_eq!(message(&|_| {}), format!("{attributes}.JOINTS_0: joint 7 is beyond the 2 joints of its skin"));
    assert_eq!(
        message(&|json| {
            let attributes = &mut json["meshes"][0]["primitives"][0]["attributes"];
            attributes.as_object_mut().unwrap().remove("JOINTS_0");
        }),
        "meshes[0].primitives[0]: its node has a skin, but it has no JOINTS_0 and WEIGHTS_0"
    );
    assert_eq!(
        message(&|json| {
            let attributes = &mut json["meshes"][0]["primitives"][0]["attributes"];
            attributes.as_object_mut().unwrap().remove("WEIGHTS_0");
        }),
        format!("{attributes}.JOINTS_0: there is no WEIGHTS_0 with it")
    );
    assert_eq!(
        message(&|json| json["skins"][0]["joints"] = json!([1, 2, 2])),
        "skins[0].inverseBindMatrices: 3 joints need as many matrices, found 2"
    );
}
