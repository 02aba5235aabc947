//! What is said about models that cannot be read. None of them panics.

use std::path::Path;

use proptest::prelude::*;
use serde_json::{Value, json};
use tusche::files::FileStore;
use tusche::scene::SceneBuilder;
use tusche::scene::gltf::{ModelTime, Placement, import};

use super::{FLOAT, Model, UNSIGNED_BYTE, UNSIGNED_SHORT, glb, load_model};

/// What importing raw bytes says.
fn told(name: &str, bytes: impl Into<Vec<u8>>) -> String {
    let files = FileStore::new().with_file(name, bytes);
    let mut scene = SceneBuilder::default();
    match import(Path::new(name), &files, ModelTime::Rest, &mut scene, &Placement::named("m")) {
        Ok(_) => panic!("the model was imported"),
        Err(faults) => faults.to_string(),
    }
}

/// What importing the one-triangle model says after an edit of its JSON.
fn told_after(edit: impl FnOnce(&mut Value)) -> String {
    let mut model = Model::triangle();
    edit(&mut model.json);
    model.faults()
}

#[test]
fn a_model_that_is_not_there() {
    let faults = load_model(Path::new("no/such.glb"), &FileStore::new(), ModelTime::Rest, None, [4, 4]).unwrap_err();
    assert_eq!(faults.to_string(), "no/such.glb: error: cannot read this file: no such file");
}

#[test]
fn json_errors_have_line_and_column() {
    assert_eq!(
        told("m.gltf", "{\n  \"asset\": {\"version\": \"2.0\"},\n  \"nodes\": [}\n}"),
        "m.gltf:3:13: error: this is not a glTF model: expected value"
    );
    assert_eq!(
        told("m.gltf", "{\"asset\": {\"version\": \"2.0\"}, \"nodes\": [{\"mesh\": -1}]}"),
        "m.gltf:1:51: error: this is not a glTF model: invalid type: integer `-1`, expected index into child of root"
    );
    assert_eq!(told("m.gltf", ""), "m.gltf:1:1: error: this is not a glTF model: EOF while parsing a value");
    assert_eq!(told("m.gltf", "{}"), "m.gltf:1:2: error: this is not a glTF model: missing field `asset`");
    assert_eq!(told("m.gltf", "solid cube\n"), "m.gltf:1:1: error: this is not a glTF model: expected value");
    assert_eq!(
        told("m.glb", glb(b"{]", None)),
        "m.glb: error: its JSON is not a glTF model: key must be a string, at line 1 column 2"
    );
    assert_eq!(
        told("m.gltf", vec![b'{', 0xff, 0xfe]),
        "m.gltf: error: its JSON is not a glTF model: key must be a string, at line 1 column 2"
    );
}

#[test]
fn other_versions() {
    assert_eq!(
        told("m.gltf", "{\"asset\": {\"version\": \"1.0\"}, \"nodes\": {}}"),
        "m.gltf: error: asset: this model needs glTF 1.0; only glTF 2.0 is supported"
    );
    assert_eq!(
        told("m.gltf", "{\"asset\": {\"version\": \"2.1\", \"minVersion\": \"2.1\"}}"),
        "m.gltf: error: asset: this model needs glTF 2.1; only glTF 2.0 is supported"
    );
    let mut old = Model::triangle().glb();
    old[4] = 1;
    assert_eq!(
        told("m.glb", old),
        "m.glb: error: this .glb has container version 1; only version 2 (glTF 2.0) is supported"
    );
}

#[test]
fn truncated_binaries() {
    let whole = Model::triangle().glb();
    let length = whole.len();
    assert_eq!(
        told("m.glb", &whole[..6]),
        "m.glb: error: this .glb is cut off: its header is not complete in its 6 bytes"
    );
    assert_eq!(
        told("m.glb", &whole[..length - 10]),
        format!("m.glb: error: this .glb is cut off: it should have {length} bytes and has {}", length - 10)
    );
    // The container's length is mended, the last chunk's is not.
    let mut shorter = whole[..length - 8].to_vec();
    shorter[8..12].copy_from_slice(&(length as u32 - 8).to_le_bytes());
    assert_eq!(told("m.glb", shorter), "m.glb: error: this .glb is cut off: a chunk should have 36 bytes and has 28");
    for cut in 0..length {
        assert!(told("m.glb", &whole[..cut]).starts_with("m.glb"), "{cut}");
    }
    assert_eq!(
        told("m.glb", [&b"glTF"[..], &[2, 0, 0, 0, 12, 0, 0, 0]].concat()),
        "m.glb: error: this .glb does not start with a JSON chunk"
    );
}

#[test]
fn required_extensions_are_all_named() {
    let faults = told_after(|json| {
        json["extensionsUsed"] = json!(["KHR_draco_mesh_compression", "KHR_texture_basisu", "ACME_gears"]);
        json["extensionsRequired"] =
            json!(["KHR_draco_mesh_compression", "KHR_texture_basisu", "KHR_mesh_quantization", "ACME_gears"]);
    });
    assert_eq!(
        faults,
        "model.gltf: error: extensionsRequired[0]: the model needs `KHR_draco_mesh_compression`, which is not supported \
         (export the model again without mesh compression)\n\
         model.gltf: error: extensionsRequired[1]: the model needs `KHR_texture_basisu`, which is not supported (export \
         the model again with PNG or JPEG textures)\n\
         model.gltf: error: extensionsRequired[3]: the model needs `ACME_gears`, which is not supported (export the model \
         again without this extension)"
    );
}

#[test]
fn optional_extensions_are_a_warning_each() {
    let mut model = Model::triangle();
    model.json["extensionsUsed"] =
        json!(["KHR_materials_clearcoat", "KHR_xmp_json_ld", "KHR_lights_punctual", "ACME_x"]);
    assert_eq!(
        model.import().1.warnings.to_string(),
        "model.gltf: warning: extensionsUsed[0]: `KHR_materials_clearcoat` is not supported and has no effect\n\
         model.gltf: warning: extensionsUsed[3]: `ACME_x` is not supported and has no effect"
    );
}

#[test]
fn indices_into_nothing() {
    assert_eq!(
        told_after(|json| json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(5)),
        "model.gltf: error: meshes[0].primitives[0].attributes.POSITION: there is no accessors[5]"
    );
    assert_eq!(
        told_after(|json| {
            json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(9);
            json["meshes"][0]["primitives"][0]["material"] = json!(2);
            json["nodes"][0]["children"] = json!([4]);
        }),
        "model.gltf: error: meshes[0].primitives[0].attributes.NORMAL: this index points at nothing\n\
         model.gltf: error: meshes[0].primitives[0].material: this index points at nothing\n\
         model.gltf: error: nodes[0].children[0]: this index points at nothing"
    );
    assert_eq!(
        told_after(|json| json["accessors"][0]["componentType"] = json!(1)),
        "model.gltf: error: accessors[0].componentType: this value is not one that glTF knows"
    );
}

#[test]
fn accessors_out_of_range() {
    let place = "model.gltf: error: meshes[0].primitives[0].attributes.POSITION: accessors[0]:";
    let message = |json: fn(&mut Value)| told_after(json).replace(place, "…");
    assert_eq!(
        message(|json| json["accessors"][0]["count"] = json!(4)),
        "… 4 elements of 12 bytes, 12 bytes apart, from byte 0, reach beyond its buffer view, which has 36 bytes"
    );
    assert_eq!(
        message(|json| json["accessors"][0]["byteOffset"] = json!(u64::MAX)),
        "… 3 elements of 12 bytes, 12 bytes apart, from byte 18446744073709551615, reach beyond its buffer view, which \
         has 36 bytes"
    );
    assert_eq!(
        message(|json| json["accessors"][0]["count"] = json!(u64::MAX)),
        "… 18446744073709551615 elements of 12 bytes, 12 bytes apart, from byte 0, reach beyond its buffer view, which \
         has 36 bytes"
    );
    assert_eq!(
        message(|json| json["bufferViews"][0]["byteLength"] = json!(40)),
        "… bufferViews[0] (40 bytes from 0) reaches beyond buffers[0], which has 36 bytes"
    );
    assert_eq!(
        message(|json| json["bufferViews"][0]["byteOffset"] = json!(u64::MAX - 3)),
        "… bufferViews[0] (36 bytes from 18446744073709551612) reaches beyond buffers[0], which has 36 bytes"
    );
    assert_eq!(
        message(|json| json["bufferViews"][0]["byteStride"] = json!(8)),
        "… the stride of 8 bytes is less than the 12 bytes of an element"
    );
    assert_eq!(
        message(|json| json["accessors"][0]["type"] = json!("SCALAR")),
        "… expected VEC3 of i8, u8, i16, u16, f32, found SCALAR of f32"
    );
    assert_eq!(
        message(|json| {
            json["accessors"][0] = json!({ "count": 1_u64 << 60, "type": "VEC3", "componentType": FLOAT, "sparse": {
                "count": 1,
                "indices": { "bufferView": 0, "componentType": UNSIGNED_BYTE },
                "values": { "bufferView": 0 },
            } });
        }),
        "… 1152921504606846976 elements without a buffer view are too many"
    );
    assert_eq!(
        message(|json| {
            json["accessors"][0]["sparse"] = json!({
                "count": 2,
                "indices": { "bufferView": 0, "componentType": UNSIGNED_SHORT, "byteOffset": 12 },
                "values": { "bufferView": 0 },
            });
        }),
        "… its sparse index 16256 is beyond its 3 elements"
    );
    assert_eq!(
        message(|json| {
            json["accessors"][0]["sparse"] = json!({
                "count": 40,
                "indices": { "bufferView": 0, "componentType": UNSIGNED_SHORT },
                "values": { "bufferView": 0 },
            });
        }),
        "… its 40 sparse indices reach beyond bufferViews[0]"
    );
}

#[test]
fn vertex_indices_out_of_range() {
    let mut model = Model::triangle();
    let indices = model.shorts("SCALAR", &[0, 1, 65_535]);
    model.json["meshes"][0]["primitives"][0]["indices"] = json!(indices);
    assert_eq!(
        model.faults(),
        "model.gltf: error: meshes[0].primitives[0].indices: index 65535 at 2 is beyond the 3 vertices"
    );
}

#[test]
fn attributes_of_different_lengths() {
    let mut model = Model::triangle();
    let normals = model.floats("VEC3", &[0., 0., 1., 0., 0., 1.]);
    model.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(normals);
    assert_eq!(
        model.faults(),
        "model.gltf: error: meshes[0].primitives[0].attributes.NORMAL: there are 3 vertices, but 2 values here"
    );
}

#[test]
fn cyclic_nodes() {
    assert_eq!(
        told_after(|json| {
            json["nodes"] = json!([{ "mesh": 0 }, { "children": [2] }, { "children": [3] }, { "children": [1] }]);
        }),
        "model.gltf: error: nodes: a node is its own ancestor: nodes[3] in nodes[2] in nodes[1] in nodes[3]"
    );
    assert_eq!(
        told_after(|json| json["nodes"][0]["children"] = json!([0])),
        "model.gltf: error: nodes: a node is its own ancestor: nodes[0] in nodes[0]"
    );
    assert_eq!(
        told_after(|json| {
            json["nodes"] = json!([{ "mesh": 0 }, { "children": [0] }, { "children": [0] }]);
        }),
        "model.gltf: error: nodes[2].children: nodes[0] is a child of nodes[1] too; a node has one parent"
    );
    assert_eq!(
        told_after(|json| json["scenes"][0]["nodes"] = json!([0, 0])),
        "model.gltf: error: scenes[0].nodes: nodes[0] is reached twice; list only the topmost nodes, once"
    );
}

#[test]
fn transforms_that_are_none() {
    assert_eq!(
        told_after(|json| {
            json["nodes"] = json!([
                { "mesh": 0, "translation": [1e39, 0, 0] },
                { "scale": [0, 1e300, 0] },
                { "rotation": [0, 0, 0, 0] },
                { "matrix": [1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1] },
            ]);
        }),
        "model.gltf: error: nodes[0].translation: the numbers must be finite\n\
         model.gltf: error: nodes[1].scale: the numbers must be finite\n\
         model.gltf: error: nodes[2].rotation: a rotation must be a quaternion of length 1\n\
         model.gltf: error: nodes[3].matrix: the last row (every fourth number) must be 0, 0, 0, 1"
    );
    let mut model = Model::triangle();
    let mut below = 0;
    model.json["nodes"][0]["scale"] = json!([1e38, 1, 1]);
    for _ in 0..9 {
        below = model.push("nodes", json!({ "children": [below], "scale": [1e38, 1, 1] }));
    }
    model.json["scenes"][0]["nodes"] = json!([below]);
    assert_eq!(
        model.faults(),
        "model.gltf: error: nodes[0]: its transform, composed with those of its parents, is not finite"
    );
}

#[test]
fn buffers_that_are_not_there() {
    let json = |buffer: Value| {
        let mut json = Model::triangle().json;
        json["buffers"] = json!([buffer]);
        told("m.gltf", json.to_string())
    };
    assert_eq!(
        json(json!({ "byteLength": 36, "uri": "gone.bin" })),
        "m.gltf: error: buffers[0]: gone.bin: cannot read this file: no such file"
    );
    assert_eq!(
        json(json!({ "byteLength": 36 })),
        "m.gltf: error: buffers[0]: it has no URI, and there is no binary chunk for it"
    );
    assert_eq!(
        json(json!({ "byteLength": 36, "uri": "data:;base64,AAAA" })),
        "m.gltf: error: buffers[0]: it should have 36 bytes and has 4"
    );
    assert_eq!(
        json(json!({ "byteLength": 36, "uri": "data:;base64,A?A=" })),
        "m.gltf: error: buffers[0]: the data URI is damaged: Invalid byte 63, offset 1."
    );
    assert_eq!(
        json(json!({ "byteLength": 36, "uri": "data:text/plain,hello" })),
        "m.gltf: error: buffers[0]: the data URI is not base64: it must start with \"data:TYPE;base64,\""
    );
    assert_eq!(
        json(json!({ "byteLength": 36, "uri": "https://example.com/m.bin" })),
        "m.gltf: error: buffers[0]: `https:` is not supported: only relative paths and data URIs are"
    );
}

#[test]
fn cameras_and_lights_that_are_none() {
    assert_eq!(
        told_after(|json| {
            json["cameras"] = json!([
                { "type": "perspective", "perspective": { "yfov": 4.0, "znear": 0.1 } },
                { "type": "orthographic", "orthographic": { "xmag": 1, "ymag": 0, "znear": 0.1, "zfar": 2 } },
                { "type": "orthographic", "perspective": { "yfov": 1.0, "znear": 0.1 } },
            ]);
            json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [
                { "type": "spot", "spot": { "innerConeAngle": 1.0, "outerConeAngle": 0.5 } },
                { "type": "point", "intensity": -1.0 },
            ] } });
            json["nodes"] = json!([
                { "camera": 0 }, { "camera": 1 }, { "camera": 2 },
                { "extensions": { "KHR_lights_punctual": { "light": 0 } } },
                { "extensions": { "KHR_lights_punctual": { "light": 1 } } },
            ]);
            json["scenes"][0]["nodes"] = json!([0, 1, 2, 3, 4]);
        }),
        "model.gltf: error: cameras[0]: yfov must be between 0 and π\n\
         model.gltf: error: cameras[1]: ymag must be a finite number other than 0\n\
         model.gltf: error: cameras[2]: its type does not fit its properties\n\
         model.gltf: error: extensions.KHR_lights_punctual.lights[0]: cone angles must be 0 ≤ inner ≤ outer ≤ π / 2\n\
         model.gltf: error: extensions.KHR_lights_punctual.lights[1]: colour and intensity must be finite and not \
         negative"
    );
}

#[test]
fn gpu_instances_that_are_none() {
    let mut model = Model::triangle();
    let three = model.floats("VEC3", &[0.; 9]);
    let two = model.floats("VEC3", &[1.; 6]);
    let turns = model.floats("VEC4", &[0.; 4]);
    let mut with = |attributes: Value| {
        model.json["nodes"][0]["extensions"] = json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
        model.faults().replace("model.gltf: error: nodes[0].extensions.EXT_mesh_gpu_instancing.attributes", "…")
    };
    assert_eq!(with(json!(null)), "…: this is missing");
    assert_eq!(with(json!({})), "…: there is no TRANSLATION, ROTATION or SCALE");
    assert_eq!(
        with(json!({ "TRANSLATION": three, "SCALE": two })),
        "…: the attributes have different numbers of values"
    );
    assert_eq!(with(json!({ "SCALE": 99 })), "….SCALE: accessors[99]: there is no such accessor");
    assert_eq!(with(json!({ "SCALE": -1 })), "….SCALE: expected the index of an accessor");
    assert_eq!(with(json!({ "ROTATION": turns })), "…: instance 0 has no finite transform");
}

#[test]
fn a_flood_of_faults_is_dammed() {
    let faults = told_after(|json| json["nodes"] = json!(vec![json!({ "rotation": [0, 0, 0, 0] }); 1000]));
    assert_eq!(faults.lines().count(), 41);
    assert!(faults.ends_with("model.gltf: error: 960 more like these"), "{faults}");
}

#[test]
fn a_failed_import_leaves_the_scene_as_it_was() {
    let mut model = Model::triangle();
    model.root(json!({ "mesh": 0, "extras": { "tusche": { "priority": "high" } } }));
    let mut scene = SceneBuilder::default();
    let files = model.store();
    import(Path::new("model.gltf"), &files, ModelTime::Rest, &mut scene, &Placement::named("m")).unwrap_err();
    assert!(scene.objects.is_empty() && scene.meshes.is_empty() && scene.materials.is_empty());
}

/// A model that uses most of what the importer reads.
fn rich() -> Model {
    let mut model = Model::new();
    let positions = model.floats("VEC3", &[0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.]);
    let normals = model.floats("VEC3", &[0., 0., 1.].repeat(4));
    let uvs = model.floats("VEC2", &[0., 1., 1., 1., 1., 0., 0., 0.]);
    let joints = model.shorts("VEC4", &[0, 1, 0, 0].repeat(4));
    let weights = model.floats("VEC4", &[0.5, 0.5, 0., 0.].repeat(4));
    let indices = model.shorts("SCALAR", &[0, 1, 2, 0, 2, 3]);
    let binds = model.floats("MAT4", &tusche::math::Mat4::IDENTITY.to_cols_array().repeat(2));
    let times = model.floats("SCALAR", &[0., 1.]);
    let moves = model.floats("VEC3", &[0., 0., 0., 1., 0., 0.]);
    let image = model.view(&super::png(2, 2, &[[9, 8, 7, 6]; 4]));
    model.push("images", json!({ "bufferView": image, "mimeType": "image/png" }));
    model.push("textures", json!({ "source": 0 }));
    model.push(
        "materials",
        json!({ "normalTexture": { "index": 0 }, "pbrMetallicRoughness": {
        "baseColorTexture": { "index": 0, "extensions": { "KHR_texture_transform": { "rotation": 1.0 } } }
    } }),
    );
    model.push("skins", json!({ "joints": [1, 2], "inverseBindMatrices": binds }));
    let attributes = json!({
        "POSITION": positions, "NORMAL": normals, "TEXCOORD_0": uvs, "JOINTS_0": joints, "WEIGHTS_0": weights
    });
    let primitive = json!({
        "attributes": attributes, "indices": indices, "material": 0, "targets": [{ "POSITION": normals }]
    });
    model.push("meshes", json!({ "primitives": [primitive], "weights": [0.5] }));
    model.push(
        "animations",
        json!({
            "channels": [{ "sampler": 0, "target": { "node": 2, "path": "translation" } }],
            "samplers": [{ "input": times, "output": moves }],
        }),
    );
    model.push("cameras", json!({ "type": "perspective", "perspective": { "yfov": 1.0, "znear": 0.1 } }));
    model.root(json!({ "mesh": 0, "skin": 0, "camera": 0 }));
    model.root(json!({ "children": [2] }));
    model.push("nodes", json!({ "translation": [0, 1, 0] }));
    model
}

#[test]
fn the_rich_model_is_sound() {
    let (scene, imported) = rich().import();
    assert_eq!(imported.warnings.to_string(), "");
    assert_eq!((scene.objects.len(), scene.textures.len(), imported.cameras.len()), (1, 2, 1));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Whatever the bytes are, the importer returns; what it accepts, the scene accepts.
    #[test]
    fn damaged_files_never_panic(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..12)) {
        let mut bytes = rich().glb();
        for (at, byte) in changes {
            let at = at.index(bytes.len() - 20) + 20;
            bytes[at] = byte;
        }
        survive(bytes)?;
    }

    /// The same for damage that leaves the JSON well-formed: any number in it becomes any other.
    #[test]
    fn absurd_numbers_never_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), prop_oneof![
            Just(json!(0)), Just(json!(1)), Just(json!(2)), Just(json!(7)), Just(json!(5121)), Just(json!(-1)),
            Just(json!(65_536)), Just(json!(u32::MAX)), Just(json!(u64::MAX)), Just(json!(1e39)), Just(json!(0.5)),
        ]), 1..4),
    ) {
        let mut model = rich();
        for (at, number) in changes {
            let mut numbers = Vec::new();
            gather_numbers(&mut model.json, &mut numbers);
            let at = at.index(numbers.len());
            *numbers[at] = number;
        }
        survive(model.glb())?;
    }
}

fn gather_numbers<'a>(value: &'a mut Value, numbers: &mut Vec<&'a mut Value>) {
    match value {
        Value::Number(_) => numbers.push(value),
        Value::Array(values) => values.iter_mut().for_each(|value| gather_numbers(value, numbers)),
        Value::Object(record) => record.values_mut().for_each(|value| gather_numbers(value, numbers)),
        _ => {}
    }
}

fn survive(bytes: Vec<u8>) -> Result<(), TestCaseError> {
    let files = FileStore::new().with_file("m.glb", bytes);
    match load_model(Path::new("m.glb"), &files, ModelTime::Seconds(0.3), None, [64, 64]) {
        Ok((scene, _)) => {
            let positions = scene.meshes.iter().flat_map(|mesh| &mesh.positions);
            prop_assert!(positions.into_iter().all(|position| position.is_finite()));
            prop_assert!(scene.build().is_ok());
        }
        Err(faults) => prop_assert!(faults.has_errors()),
    }
    Ok(())
}
