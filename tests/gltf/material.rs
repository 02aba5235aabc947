//! Materials: parameters of the default shader, textures, and what the extras name.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use serde_json::{Value, json};
use tusche::math::{Affine2, DVec3, Vec2, Vec3};
use tusche::scene::SceneBuilder;
use tusche::scene::attributes::Attribute;
use tusche::scene::camera::{Camera, Projection};
use tusche::scene::gltf::{ModelTime, Placement};
use tusche::scene::ids::MaterialId;
use tusche::scene::material::{Material, ParamValue};
use tusche::scene::texture::{Pixels, TextureFilter, TextureRef, Wrap};

use super::{Model, png};

/// The triangle, made of the given material, with three images (red, grey, 1 × 1) and four textures.
fn made_of(material: Value) -> Model {
    let mut model = Model::triangle();
    let uvs = model.floats("VEC2", &[0., 0., 1., 0., 0., 1.]);
    model.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(uvs);
    model.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] = json!(uvs);
    model.json["meshes"][0]["primitives"][0]["material"] = json!(0);
    model.file("red.png", png(1, 1, &[[255, 0, 0, 255]]));
    model.file("gray image.png", png(1, 1, &[[128, 128, 128, 255]]));
    model.push("images", json!({ "uri": "red.png" }));
    model.push("images", json!({ "uri": "gray%20image.png", "name": "gray" }));
    model.push("samplers", json!({ "magFilter": 9728, "wrapS": 33071, "wrapT": 33648 }));
    model.push("textures", json!({ "source": 0 }));
    model.push("textures", json!({ "source": 1 }));
    model.push("textures", json!({ "source": 0, "sampler": 0 }));
    model.push("textures", json!({ "source": 0 }));
    model.push("materials", material);
    model
}

fn params(material: &Material) -> BTreeMap<&str, &ParamValue> {
    material.params.iter().map(|(name, (value, _))| (name.as_str(), value)).collect()
}

/// The only material's parameters, without those that are always there and have their default.
fn changed(scene: &SceneBuilder) -> BTreeMap<&str, &ParamValue> {
    let mut params = params(&scene.materials[0]);
    let defaults = [
        ("base_color", ParamValue::Vec3(Vec3::ONE)),
        ("metallic", ParamValue::Float(1.0)),
        ("roughness", ParamValue::Float(1.0)),
    ];
    for (name, value) in defaults {
        assert!(params.contains_key(name), "{name}");
        if *params[name] == value {
            params.remove(name);
        }
    }
    params
}

fn texture(value: &ParamValue) -> TextureRef {
    match value {
        ParamValue::Texture(texture) => *texture,
        other => panic!("{other:?}"),
    }
}

#[test]
fn defaults_are_gltfs() {
    let (scene, imported) = made_of(json!({})).import();
    assert_eq!(imported.warnings.to_string(), "");
    assert!(changed(&scene).is_empty());
    let material = &scene.materials[0];
    assert_eq!((material.name.as_str(), material.double_sided, material.priority), ("material 0", false, None));
    assert_eq!(scene.scripts[material.script.index()].source.name, "builtin:default");
    assert!(scene.textures.is_empty());
}

#[test]
fn every_number_has_its_parameter() {
    let (scene, imported) = made_of(json!({
        "name": "all",
        "doubleSided": true,
        "pbrMetallicRoughness": { "baseColorFactor": [0.1, 0.2, 0.3, 0.4], "metallicFactor": 0.5, "roughnessFactor": 0.25 },
        "emissiveFactor": [1, 0.5, 0],
        "alphaMode": "MASK",
        "alphaCutoff": 0.75,
        "extensions": {
            "KHR_materials_ior": { "ior": 1.33 },
            "KHR_materials_transmission": { "transmissionFactor": 0.9 },
            "KHR_materials_emissive_strength": { "emissiveStrength": 4 },
            "KHR_materials_specular": { "specularFactor": 0.3 },
            "KHR_materials_unlit": {},
        },
    }))
    .import();
    assert_eq!(imported.warnings.to_string(), "");
    let expected = [
        ("alpha", ParamValue::Float(0.4)),
        ("alpha_cutoff", ParamValue::Float(0.75)),
        ("alpha_mode", ParamValue::Text("mask".into())),
        ("base_color", ParamValue::Vec3(Vec3::new(0.1, 0.2, 0.3))),
        ("emissive", ParamValue::Vec3(Vec3::new(4., 2., 0.))),
        ("ior", ParamValue::Float(1.33)),
        ("metallic", ParamValue::Float(0.5)),
        ("roughness", ParamValue::Float(0.25)),
        ("specular", ParamValue::Float(0.3)),
        ("transmission", ParamValue::Float(0.9)),
        ("unlit", ParamValue::Bool(true)),
    ];
    assert_eq!(changed(&scene), expected.iter().map(|(name, value)| (*name, value)).collect());
    assert!(scene.materials[0].double_sided);
}

#[test]
fn alpha_of_opaque_materials_does_not_count() {
    let (scene, _) = made_of(json!({ "pbrMetallicRoughness": { "baseColorFactor": [1, 1, 1, 0.5] } })).import();
    assert!(changed(&scene).is_empty());
    let blend = json!({ "alphaMode": "BLEND", "pbrMetallicRoughness": { "baseColorFactor": [1, 1, 1, 0.5] } });
    let (scene, _) = made_of(blend).import();
    assert_eq!(changed(&scene)["alpha_mode"], &ParamValue::Text("blend".into()));
    assert_eq!(changed(&scene)["alpha"], &ParamValue::Float(0.5));
}

#[test]
fn every_texture_has_its_parameter_and_its_encoding() {
    let (scene, imported) = made_of(json!({
        "pbrMetallicRoughness": {
            "baseColorTexture": { "index": 0 },
            "metallicRoughnessTexture": { "index": 1, "texCoord": 1 },
        },
        "normalTexture": { "index": 0, "scale": 0.5 },
        "occlusionTexture": { "index": 1, "strength": 0.25 },
        "emissiveFactor": [1, 1, 1],
        "emissiveTexture": { "index": 2 },
        "extensions": {
            "KHR_materials_transmission": { "transmissionFactor": 1, "transmissionTexture": { "index": 3 } },
            "KHR_materials_specular": { "specularTexture": { "index": 3 } },
        },
    }))
    .import();
    assert_eq!(imported.warnings.to_string(), "");
    let params = changed(&scene);
    assert_eq!(params["normal_scale"], &ParamValue::Float(0.5));
    assert_eq!(params["occlusion_strength"], &ParamValue::Float(0.25));
    let srgb = |name: &str| match &scene.textures[texture(params[name]).texture.index()].image.pixels {
        Pixels::Rgba8 { srgb, .. } => *srgb,
        Pixels::Rgba32F { .. } => panic!(),
    };
    for (name, expected) in [
        ("base_color_texture", true),
        ("emissive_texture", true),
        ("metallic_roughness_texture", false),
        ("normal_texture", false),
        ("occlusion_texture", false),
        ("transmission_texture", false),
        ("specular_texture", false),
    ] {
        assert_eq!(srgb(name), expected, "{name}");
    }
    assert_eq!(texture(params["metallic_roughness_texture"]).uv_set, 1);

    // One image for each encoding: red as colour, red as data, grey as data.
    let image = |name: &str| &scene.textures[texture(params[name]).texture.index()].image;
    assert!(Arc::ptr_eq(image("base_color_texture"), image("emissive_texture")));
    assert!(Arc::ptr_eq(image("normal_texture"), image("specular_texture")));
    assert!(!Arc::ptr_eq(image("base_color_texture"), image("normal_texture")));
    assert_eq!(params["transmission_texture"], params["specular_texture"]);

    let emissive = &scene.textures[texture(params["emissive_texture"]).texture.index()];
    assert_eq!((emissive.wrap, emissive.filter), ([Wrap::Clamp, Wrap::Mirror], TextureFilter::Nearest));
    let base = &scene.textures[texture(params["base_color_texture"]).texture.index()];
    assert_eq!((base.wrap, base.filter), ([Wrap::Repeat; 2], TextureFilter::Linear));
    assert_eq!(base.name, "red.png");
}

#[test]
fn texture_transforms() {
    let transform = |extension: Value| {
        let material = json!({ "pbrMetallicRoughness": { "baseColorTexture": {
            "index": 0, "texCoord": 0, "extensions": { "KHR_texture_transform": extension }
        } } });
        let (scene, _) = made_of(material).import();
        texture(changed(&scene)["base_color_texture"])
    };
    let found = transform(json!({ "offset": [0.5, 0.25], "scale": [2, 3], "texCoord": 1 }));
    assert_eq!(found.uv_set, 1);
    assert_eq!(found.transform.transform_point2(Vec2::new(1., 1.)), Vec2::new(2.5, 3.25));
    // A quarter turn counter-clockwise as seen on the image, whose v points down: right becomes up.
    let found = transform(json!({ "rotation": std::f32::consts::FRAC_PI_2, "offset": [0, 1] }));
    assert!(found.transform.transform_point2(Vec2::new(1., 0.)).distance(Vec2::new(0., 0.)) < 1e-6);
    assert!(found.transform.transform_point2(Vec2::new(0., 1.)).distance(Vec2::new(1., 1.)) < 1e-6);
    // The normal texture's transform is plain JSON to the parser.
    let material = json!({ "normalTexture": { "index": 0, "extensions": {
        "KHR_texture_transform": { "scale": [4, 4], "texCoord": 1 }
    } } });
    let (scene, _) = made_of(material).import();
    let found = texture(changed(&scene)["normal_texture"]);
    assert_eq!((found.uv_set, found.transform), (1, Affine2::from_scale(Vec2::splat(4.))));
}

#[test]
fn embedded_images() {
    let pixels = [[1, 2, 3, 4], [5, 6, 7, 8]];
    let mut model = made_of(json!({
        "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } },
        "normalTexture": { "index": 1 },
    }));
    let view = model.view(&png(2, 1, &pixels));
    model.json["images"][0] = json!({ "bufferView": view, "mimeType": "image/png" });
    model.json["images"][1] = json!({ "uri": format!("data:image/png;base64,{}", super::base64(&png(1, 2, &pixels))) });
    let (scene, _) = model.import();
    let images: Vec<_> = scene.textures.iter().map(|texture| (&*texture.name, &*texture.image)).collect();
    assert_eq!((images[0].0, images[0].1.width), ("image 0", 2));
    assert_eq!(images[0].1.pixels, Pixels::Rgba8 { data: pixels.to_vec(), srgb: true });
    assert_eq!((images[1].0, images[1].1.height), ("image 1", 2));
    assert_eq!(images[1].1.pixels, Pixels::Rgba8 { data: pixels.to_vec(), srgb: false });
}

#[test]
fn images_that_cannot_be_read_say_who_wants_them() {
    let mut model = made_of(json!({
        "name": "Leather",
        "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 }, "metallicRoughnessTexture": { "index": 1 } },
        "normalTexture": { "index": 2 },
        "occlusionTexture": { "index": 3 },
    }));
    model.files.clear();
    model.file("gray image.png", *b"not an image");
    model.push("images", json!({ "uri": "data:image/png;base64,iVBORw0KGgo=" }));
    model.push("images", json!({}));
    model.json["textures"][2] = json!({ "source": 2 });
    model.json["textures"][3] = json!({ "source": 3 });
    let faults = model.faults();
    let lines: Vec<_> = faults.lines().collect();
    assert_eq!(
        lines[0],
        "red.png: error: cannot read this file: no such file (material `Leather` of model.gltf wants it)"
    );
    assert_eq!(
        lines[1],
        "gray image.png: error: this is not an image that Tusche reads (PNG, JPEG, Radiance HDR and OpenEXR are) \
         (material `Leather` of model.gltf wants it)"
    );
    assert!(lines[2].starts_with("model.gltf: error: images[2]: cannot decode this image: "), "{}", lines[2]);
    assert_eq!(
        lines[3],
        "model.gltf: error: images[3]: it has neither a URI nor a buffer view (material `Leather` of model.gltf wants it)"
    );
    assert_eq!(lines.len(), 4);
}

#[test]
fn a_texture_in_a_foreign_format_only() {
    let mut model = made_of(json!({ "name": "web", "emissiveFactor": [1, 1, 1], "emissiveTexture": { "index": 0 } }));
    model.json["textures"][0] = json!({ "extensions": { "EXT_texture_webp": { "source": 0 } } });
    assert_eq!(model.faults(), "model.gltf: error: textures[0]: it has no PNG or JPEG image; material `web` wants it");
}

#[test]
fn unused_materials_and_their_textures_are_not_read() {
    let mut model = made_of(json!({ "name": "used" }));
    model.files.clear();
    model.push("materials", json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }));
    let (scene, _) = model.import();
    assert_eq!((scene.materials.len(), scene.textures.len()), (1, 0));
}

#[test]
fn a_placed_material_replaces_all_and_reads_no_texture() {
    let mut model = made_of(json!({ "normalTexture": { "index": 0 } }));
    model.files.clear();
    let placement = Placement { material: Some(MaterialId(4)), ..Placement::named("m") };
    let (scene, _) = model.try_import(ModelTime::Rest, &placement).unwrap();
    assert_eq!(scene.objects[0].materials, [MaterialId(4)]);
    assert!(scene.materials.is_empty() && scene.textures.is_empty() && scene.scripts.is_empty());
    assert!(scene.meshes[0].tangents.is_empty());
}

#[test]
fn uv_that_a_mesh_lacks_are_a_warning() {
    let (_, imported) = made_of(json!({
        "name": "far", "pbrMetallicRoughness": { "baseColorTexture": { "index": 0, "texCoord": 3 } }
    }))
    .import();
    assert_eq!(
        imported.warnings.to_string(),
        "model.gltf: warning: the base_color_texture of material `far` uses TEXCOORD_3, which mesh `mesh 0` does not \
         have; it is looked up at 0, 0"
    );
}

#[test]
fn tinted_specular_is_a_warning() {
    let specular = json!({ "specularColorFactor": [1, 0.5, 0.5] });
    let (_, imported) = made_of(json!({ "extensions": { "KHR_materials_specular": specular } })).import();
    assert_eq!(
        imported.warnings.to_string(),
        "model.gltf: warning: materials[0].extensions.KHR_materials_specular: the colour of specular reflection is not \
         supported; it stays white"
    );
}

#[test]
fn primitives_without_material_share_a_plain_one() {
    let mut model = Model::triangle();
    let primitive = model.json["meshes"][0]["primitives"][0].clone();
    let other = model.push("meshes", json!({ "primitives": [primitive] }));
    model.root(json!({ "mesh": other }));
    let (scene, _) = model.import();
    assert_eq!(scene.materials.len(), 1);
    let expected = [
        ("base_color", ParamValue::Vec3(Vec3::splat(0.8))),
        ("metallic", ParamValue::Float(0.0)),
        ("roughness", ParamValue::Float(1.0)),
    ];
    assert_eq!(params(&scene.materials[0]), expected.iter().map(|(name, value)| (*name, value)).collect());
    assert_eq!(scene.materials[0].name, "default");
}

#[test]
fn vertex_colors_are_asked_for_where_they_are() {
    let mut model = made_of(json!({ "name": "painted" }));
    let colors = model.floats("VEC3", &[1.; 9]);
    let mut painted = model.json["meshes"][0]["primitives"][0].clone();
    painted["attributes"]["COLOR_0"] = json!(colors);
    let mut bare = painted.clone();
    bare.as_object_mut().unwrap().remove("material");
    let plain = model.json["meshes"][0]["primitives"][0].clone();
    model.push("materials", json!({ "name": "unpainted" }));
    let mut other = plain.clone();
    other["material"] = json!(1);
    model.json["meshes"][0]["primitives"] = json!([plain, painted, bare, other]);
    let (scene, _) = model.import();
    let found: Vec<_> = scene
        .materials
        .iter()
        .map(|material| (material.name.as_str(), params(material).get("use_vertex_color").copied().cloned()))
        .collect();
    let yes = Some(ParamValue::Bool(true));
    assert_eq!(found, [("default", yes.clone()), ("painted", yes), ("unpainted", None)]);
}

#[test]
fn material_names_are_unique() {
    let mut model = made_of(json!({ "name": "same" }));
    model.push("materials", json!({ "name": "same" }));
    model.push("materials", json!({}));
    let primitive = model.json["meshes"][0]["primitives"][0].clone();
    let with = |material: usize| {
        let mut primitive = primitive.clone();
        primitive["material"] = json!(material);
        primitive
    };
    model.json["meshes"][0]["primitives"] = json!([with(0), with(1), with(2)]);
    let (scene, _) = model.import();
    let names: Vec<_> = scene.materials.iter().map(|material| material.name.as_str()).collect();
    assert_eq!(names, ["same", "same (material 1)", "material 2"]);
}

#[test]
fn extras_name_a_shader_with_parameters() {
    let record = json!({
        "shader": "looks/ink.rhai",
        "params": {
            "on": true, "count": 3, "width": 2.5, "pair": [1, 2], "paint": [0.1, 0.2, 0.3], "four": [1, 2, 3, 4],
            "style": "wet", "noise": { "texture": "red.png", "srgb": false, "wrap": "clamp", "filter": "nearest" },
        },
        "priority": -2,
        "dielectric_priority": 3,
    });
    // Some exporters can write texts only.
    for extras in [record.clone(), Value::String(record.to_string())] {
        let mut model = made_of(json!({
            "name": "inked", "extras": { "tusche": extras, "other": 1 }, "pbrMetallicRoughness": { "metallicFactor": 0 },
        }));
        model.file("looks/ink.rhai", "fn surface(hit, p) { #{} }");
        let (scene, imported) = model.import();
        assert_eq!(imported.warnings.to_string(), "");
        let material = &scene.materials[0];
        let script = &scene.scripts[material.script.index()];
        assert_eq!(script.path.as_deref(), Some(Path::new("looks/ink.rhai")));
        assert_eq!(script.source.text, "fn surface(hit, p) { #{} }");
        assert_eq!((material.priority, material.dielectric_priority), (Some(-2), 3));
        let mut params = params(material);
        let noise = &scene.textures[texture(params.remove("noise").unwrap()).texture.index()];
        assert_eq!((noise.wrap, noise.filter), ([Wrap::Clamp; 2], TextureFilter::Nearest));
        assert!(matches!(noise.image.pixels, Pixels::Rgba8 { srgb: false, .. }));
        let expected = [
            ("count", ParamValue::Int(3)),
            ("four", ParamValue::Vec4([1., 2., 3., 4.].into())),
            ("on", ParamValue::Bool(true)),
            ("paint", ParamValue::Vec3(Vec3::new(0.1, 0.2, 0.3))),
            ("pair", ParamValue::Vec2(Vec2::new(1., 2.))),
            ("style", ParamValue::Text("wet".into())),
            ("width", ParamValue::Float(2.5)),
        ];
        // A shader of one's own does not know the parameters of the default shader.
        assert_eq!(params, expected.iter().map(|(name, value)| (*name, value)).collect());
    }
}

#[test]
fn extras_without_a_shader_add_to_the_default_one() {
    let (scene, _) = made_of(json!({ "extras": { "tusche": { "params": { "line_width": 4.0 } } } })).import();
    assert_eq!(changed(&scene), [("line_width", &ParamValue::Float(4.0))].into());
}

#[test]
fn extras_of_nodes() {
    let mut model = made_of(json!({ "name": "shared" }));
    model.json["nodes"][0]["extras"] = json!({ "tusche": {
        "shader": "builtin:default", "params": { "line_width": 1.0 }, "priority": 9, "lines": false,
    } });
    model.root(json!({ "mesh": 0, "name": "plain" }));
    let (scene, _) = model.import();
    let [worn, plain] = &scene.objects[..] else { panic!() };
    assert_eq!((worn.priority, worn.lines), (Some(9), false));
    assert_eq!((plain.priority, plain.lines), (None, true));
    assert_eq!(worn.mesh, plain.mesh);
    let name = |object: &tusche::scene::Object| scene.materials[object.materials[0].index()].name.as_str();
    assert_eq!((name(worn), name(plain)), ("thing", "shared"));
    assert_eq!(params(&scene.materials[worn.materials[0].index()]), [("line_width", &ParamValue::Float(1.0))].into());
}

#[test]
fn extras_with_faults() {
    let message = |on_material: Value, on_node: Value| {
        let mut model = made_of(json!({ "extras": { "tusche": on_material } }));
        model.json["nodes"][0]["extras"] = json!({ "tusche": on_node });
        model.faults().replace("model.gltf: error: ", "")
    };
    assert_eq!(
        message(
            json!({ "shadr": "x", "lines": false, "params": 3, "priority": 1.5, "shader": "gone.rhai" }),
            json!({ "shader": "builtin:defualt", "lines": "no", "priority": 3e9 }),
        ),
        "nodes[0].extras.tusche.shader: there is no built-in shader `defualt`; did you mean `default`?\n\
         nodes[0].extras.tusche.lines: expected true or false\n\
         nodes[0].extras.tusche.priority: expected a whole number from −2147483648 to 2147483647\n\
         materials[0].extras.tusche.shadr: unknown key; did you mean `shader`?\n\
         materials[0].extras.tusche.lines: unknown key; there are shader, params, priority, dielectric_priority\n\
         materials[0].extras.tusche.params: expected a record of parameters\n\
         materials[0].extras.tusche.priority: expected a whole number from −2147483648 to 2147483647\n\
         materials[0].extras.tusche.shader: gone.rhai: cannot read this file: no such file"
    );
    assert_eq!(
        message(
            json!({ "params": {
                "a": null, "b": [1], "c": [1, "x"], "d": 1e300, "e": {}, "f": { "texture": "t.png", "wrp": "clamp" },
                "g": { "texture": 3 }, "h": { "texture": "t.png", "wrap": "round" },
            } }),
            json!({ "params": { "a": 1 } }),
        ),
        "nodes[0].extras.tusche: a node with `params` needs a `shader` too\n\
         materials[0].extras.tusche.params.a: expected a value\n\
         materials[0].extras.tusche.params.b: a vector has two to four numbers, this has 1\n\
         materials[0].extras.tusche.params.c: expected a number\n\
         materials[0].extras.tusche.params.d: this number is too large\n\
         materials[0].extras.tusche.params.e: a record is a texture and needs `texture`, the path of an image\n\
         materials[0].extras.tusche.params.f: wrp: unknown key; did you mean `wrap`?\n\
         materials[0].extras.tusche.params.g: texture: expected the path of an image\n\
         materials[0].extras.tusche.params.h: wrap: expected \"repeat\", \"mirror\" or \"clamp\""
    );
    assert_eq!(
        message(json!("{ink"), json!(3)),
        "nodes[0].extras.tusche: expected a record such as {\"shader\": \"ink.rhai\"}\n\
         materials[0].extras.tusche: this text is not JSON: key must be a string at line 1 column 2"
    );
}

#[test]
fn extras_become_attributes() {
    let mut model = made_of(json!({ "extras": { "wear": 0.5, "age": 3, "note": "old" } }));
    model.json["meshes"][0]["extras"] = json!({ "wear": 0.25, "tint": [1, 0, 0.5], "odd": { "a": 1 }, "none": null });
    model.json["nodes"][0]["extras"] = json!({ "tint": [0, 1, 0], "worn": true, "tusche": { "priority": 1 } });
    let (scene, imported) = model.import();
    assert_eq!(imported.warnings.to_string(), "");
    let mut scene = scene;
    let camera = Camera::look_at("c", Projection::Orthographic { height: 1.0 }, DVec3::Z, DVec3::ZERO, DVec3::Y);
    scene.cameras.extend(camera);
    let built = scene.build().expect("it is whole");
    let object = &built.objects()[0];
    let set = built.attributes().of(tusche::scene::ids::ObjectId(0), object.materials[0]);
    let expected = [
        ("age", Attribute::Int(3)),
        ("note", Attribute::Text("old".into())),
        ("tint", Attribute::Vec3(Vec3::Y)),
        ("wear", Attribute::Float(0.25)),
        ("worn", Attribute::Bool(true)),
    ];
    let expected = expected.map(|(name, value)| (name.to_owned(), value)).into();
    assert_eq!(built.attributes().sets()[set as usize], expected);
}
