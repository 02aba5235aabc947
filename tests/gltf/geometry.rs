//! Triangles, attributes, and what is computed where a model has none.

use proptest::prelude::*;
use serde_json::{Value, json};
use tusche::math::{Vec2, Vec3, Vec4};
use tusche::scene::gltf::ModelTime;

use super::{BYTE, Model, SHORT, UNSIGNED_BYTE, UNSIGNED_INT, UNSIGNED_SHORT, assert_near};

/// Four corners of the unit square, in an order that suits strips and fans alike.
const SQUARE: [f32; 12] = [0., 0., 0., 1., 0., 0., 1., 1., 0., 0., 1., 0.];

fn primitive(model: &mut Model, primitive: Value) {
    let mesh = model.push("meshes", json!({ "primitives": [primitive] }));
    model.root(json!({ "mesh": mesh }));
}

fn edit(model: &mut Model, key: &str, value: Value) {
    model.json["meshes"][0]["primitives"][0][key] = value;
}

#[test]
fn a_triangle_without_anything_else() {
    let mesh = Model::triangle().mesh();
    assert_near(&mesh.positions, &[[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]]);
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
    assert!(mesh.normals.is_empty() && mesh.tangents.is_empty() && mesh.uvs.is_empty() && mesh.colors.is_empty());
    assert!(mesh.slots.is_empty() && mesh.polygons.is_empty());
    assert_eq!(mesh.name, "mesh 0");
}

#[test]
fn indices_of_all_types() {
    for (component, bytes) in [
        (UNSIGNED_BYTE, vec![2, 1, 0]),
        (UNSIGNED_SHORT, vec![2, 0, 1, 0, 0, 0]),
        (UNSIGNED_INT, vec![2, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0]),
    ] {
        let mut model = Model::triangle();
        let indices = model.accessor(component, "SCALAR", 3, &bytes);
        edit(&mut model, "indices", indices.into());
        assert_eq!(model.mesh().triangles, [[2, 1, 0]], "{component}");
    }
}

#[test]
fn strips_keep_their_winding() {
    let mut model = Model::new();
    // A zigzag: bottom left, bottom right, top left, top right, and one more to the right.
    let positions = model.floats("VEC3", &[0., 0., 0., 1., 0., 0., 0., 1., 0., 1., 1., 0., 0., 2., 0.]);
    primitive(&mut model, json!({ "attributes": { "POSITION": positions }, "mode": 5 }));
    let mesh = model.mesh();
    assert_eq!(mesh.triangles, [[0, 1, 2], [1, 3, 2], [2, 3, 4]]);
    for [a, b, c] in mesh.triangles {
        let [a, b, c] = [a, b, c].map(|vertex| mesh.positions[vertex as usize]);
        assert!((b - a).cross(c - a).z > 0.0);
    }
}

#[test]
fn strips_joined_by_repeated_corners_lose_nothing_else() {
    let mut model = Model::new();
    let positions = model.floats("VEC3", &[0., 0., 0., 1., 0., 0., 0., 1., 0., 5., 0., 0., 6., 0., 0., 5., 1., 0.]);
    let indices = model.shorts("SCALAR", &[0, 1, 2, 2, 3, 3, 4, 5]);
    primitive(&mut model, json!({ "attributes": { "POSITION": positions }, "indices": indices, "mode": 5 }));
    // The last three corners are the sixth triangle of the strip, which turns the other way.
    assert_eq!(model.mesh().triangles, [[0, 1, 2], [3, 5, 4]]);
}

#[test]
fn fans_turn_around_their_first_corner() {
    let mut model = Model::new();
    let positions = model.floats("VEC3", &SQUARE);
    primitive(&mut model, json!({ "attributes": { "POSITION": positions }, "mode": 6 }));
    assert_eq!(model.mesh().triangles, [[1, 2, 0], [2, 3, 0]]);
}

#[test]
fn points_and_lines_are_passed_over_with_one_warning() {
    let mut model = Model::triangle();
    for mode in [0, 1, 2, 3] {
        let primitives = model.json["meshes"][0]["primitives"].as_array_mut().unwrap();
        primitives.push(json!({ "attributes": { "POSITION": 0 }, "mode": mode }));
    }
    let (scene, imported) = model.import();
    assert_eq!(scene.meshes[0].triangles.len(), 1);
    assert_eq!(
        imported.warnings.to_string(),
        "model.gltf: warning: primitives made of points (1) or lines (3) are not drawn: only triangles are"
    );
}

#[test]
fn sparse_accessors_replace_elements() {
    let mut model = Model::triangle();
    let indices = model.view(&[2, 0]);
    let moved: Vec<u8> = [7.0_f32, 8.0, 9.0].iter().flat_map(|value| value.to_le_bytes()).collect();
    let values = model.view(&moved);
    model.json["accessors"][0]["sparse"] = json!({
        "count": 1,
        "indices": { "bufferView": indices, "componentType": UNSIGNED_SHORT },
        "values": { "bufferView": values },
    });
    assert_near(&model.mesh().positions, &[[0., 0., 0.], [1., 0., 0.], [7., 8., 9.]]);
    // Without bytes of its own the rest is zero.
    model.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    assert_near(&model.mesh().positions, &[[0., 0., 0.], [0., 0., 0.], [7., 8., 9.]]);
}

#[test]
fn interleaved_attributes_are_read_by_their_stride() {
    let mut model = Model::new();
    let bytes: Vec<u8> = (0..3)
        .flat_map(|i| {
            let vertex = [i as f32, (i * i) as f32, 0.0, 0.0, 0.0, 1.0];
            vertex.into_iter().flat_map(f32::to_le_bytes).collect::<Vec<_>>()
        })
        .collect();
    let view = model.view(&bytes);
    model.json["bufferViews"][view]["byteStride"] = json!(24);
    let accessor = json!({ "bufferView": view, "componentType": super::FLOAT, "type": "VEC3", "count": 3 });
    let positions = model.push("accessors", accessor.clone());
    let normals = model.push("accessors", accessor);
    model.json["accessors"][normals]["byteOffset"] = json!(12);
    primitive(&mut model, json!({ "attributes": { "POSITION": positions, "NORMAL": normals } }));
    let mesh = model.mesh();
    assert_near(&mesh.positions, &[[0., 0., 0.], [1., 1., 0.], [2., 4., 0.]]);
    assert_near(&mesh.normals, &[[0., 0., 1.]; 3]);
}

#[test]
fn quantized_attributes() {
    let mut model = Model::new();
    model.json["extensionsUsed"] = json!(["KHR_mesh_quantization"]);
    model.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    // Plain 16-bit positions, padded to 8 bytes; normalized 8-bit normals, padded to 4; normalized 16-bit uv.
    let positions: Vec<u8> = [[0_i16, 0, 0, 9], [300, 0, 0, 9], [0, -300, 0, 9]]
        .as_flattened()
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect();
    let positions = model.accessor(SHORT, "VEC3", 3, &positions);
    let normals = model.accessor(BYTE, "VEC3", 3, &[0, 0, 127, 9, 0, 0x80, 0, 9, 0, 127, 0, 9]);
    let uvs = model.shorts("VEC2", &[0, 65_535, 32_768, 0, 0, 0]);
    for (accessor, stride) in [(positions, 8), (normals, 4)] {
        model.json["bufferViews"][accessor]["byteStride"] = json!(stride);
    }
    model.json["accessors"][normals]["normalized"] = json!(true);
    model.json["accessors"][uvs]["normalized"] = json!(true);
    let attributes = json!({ "POSITION": positions, "NORMAL": normals, "TEXCOORD_0": uvs });
    primitive(&mut model, json!({ "attributes": attributes }));
    let mesh = model.mesh();
    assert_near(&mesh.positions, &[[0., 0., 0.], [300., 0., 0.], [0., -300., 0.]]);
    assert_near(&mesh.normals, &[[0., 0., 1.], [0., -1., 0.], [0., 1., 0.]]);
    assert_eq!(mesh.uvs, [[Vec2::new(0., 1.), Vec2::new(32_768. / 65_535., 0.), Vec2::ZERO]]);
}

#[test]
fn vertex_colors_of_all_kinds() {
    let half = 0x8080_u16;
    let cases: [(u32, &str, Vec<u8>, Vec4); 3] = [
        (UNSIGNED_BYTE, "VEC4", [255, 0, 51, 102].repeat(3), Vec4::new(1., 0., 0.2, 0.4)),
        (
            UNSIGNED_SHORT,
            "VEC3",
            [half, 0, 65_535].repeat(3).iter().flat_map(|v| v.to_le_bytes()).collect(),
            Vec4::new(f32::from(half) / 65_535., 0., 1., 1.),
        ),
        (
            super::FLOAT,
            "VEC3",
            [0.25_f32, 0.5, 0.75].repeat(3).iter().flat_map(|v| v.to_le_bytes()).collect(),
            Vec4::new(0.25, 0.5, 0.75, 1.),
        ),
    ];
    for (component, kind, bytes, expected) in cases {
        let mut model = Model::triangle();
        let colors = model.accessor(component, kind, 3, &bytes);
        if kind == "VEC3" && component == UNSIGNED_SHORT {
            let view = model.json["accessors"][colors]["bufferView"].as_u64().unwrap() as usize;
            model.json["bufferViews"][view]["byteStride"] = json!(6);
        }
        model.json["accessors"][colors]["normalized"] = json!(component != super::FLOAT);
        edit(&mut model, "attributes", json!({ "POSITION": 0, "COLOR_0": colors }));
        let mesh = model.mesh();
        assert!(mesh.colors.iter().all(|color| color.distance(expected) < 1e-6), "{kind}: {:?}", mesh.colors);
    }
}

#[test]
fn several_uv_sets_with_a_gap() {
    let mut model = Model::triangle();
    let first = model.floats("VEC2", &[0., 0., 1., 0., 0., 1.]);
    let third = model.floats("VEC2", &[5., 5., 6., 5., 5., 6.]);
    edit(&mut model, "attributes", json!({ "POSITION": 0, "TEXCOORD_0": first, "TEXCOORD_2": third }));
    let mesh = model.mesh();
    assert_eq!(mesh.uvs.len(), 3);
    assert_eq!(mesh.uvs[0][1], Vec2::new(1., 0.));
    assert_eq!(mesh.uvs[1], [Vec2::ZERO; 3]);
    assert_eq!(mesh.uvs[2][2], Vec2::new(5., 6.));
}

#[test]
fn primitives_become_one_mesh_with_material_slots() {
    let mut model = Model::new();
    let red = model.push("materials", json!({ "name": "red" }));
    let blue = model.push("materials", json!({ "name": "blue" }));
    let positions = model.floats("VEC3", &SQUARE);
    let indices = model.shorts("SCALAR", &[0, 1, 2, 0, 2, 3]);
    let uvs = model.floats("VEC2", &[0., 0., 1., 0., 1., 1., 0., 1.]);
    let colors = model.floats("VEC3", &[0.5; 12]);
    let mesh = model.push(
        "meshes",
        json!({ "name": "merged", "primitives": [
            { "attributes": { "POSITION": positions }, "indices": indices, "material": blue },
            { "attributes": { "POSITION": positions, "TEXCOORD_0": uvs }, "indices": indices, "material": red },
            { "attributes": { "POSITION": positions, "COLOR_0": colors }, "indices": indices, "material": blue },
        ] }),
    );
    model.root(json!({ "mesh": mesh }));
    let (scene, _) = model.import();
    let mesh = &scene.meshes[0];
    assert_eq!(mesh.name, "merged");
    assert_eq!(mesh.slots, [0, 0, 1, 1, 0, 0]);
    assert_eq!(mesh.triangles[2..4], [[4, 5, 6], [4, 6, 7]]);
    assert_eq!(mesh.uvs[0].len(), 12);
    assert_eq!((mesh.uvs[0][0], mesh.uvs[0][6]), (Vec2::ZERO, Vec2::ONE));
    assert_eq!((mesh.colors[0], mesh.colors[8]), (Vec4::ONE, Vec4::new(0.5, 0.5, 0.5, 1.)));
    let names: Vec<_> = scene.objects[0].materials.iter().map(|m| &*scene.materials[m.index()].name).collect();
    assert_eq!(names, ["blue", "red"]);
}

#[test]
fn vertices_that_nothing_uses_are_left_out() {
    let mut model = Model::new();
    let positions = model.floats("VEC3", &[9., 9., 9., 0., 0., 0., 8., 8., 8., 1., 0., 0., 0., 1., 0.]);
    let indices = model.shorts("SCALAR", &[1, 3, 4]);
    primitive(&mut model, json!({ "attributes": { "POSITION": positions }, "indices": indices }));
    let mesh = model.mesh();
    assert_near(&mesh.positions, &[[0., 0., 0.], [1., 0., 0.], [0., 1., 0.]]);
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
}

#[test]
fn a_primitive_without_normals_beside_one_with_is_flat() {
    let mut model = Model::new();
    // A square bent along its diagonal: two triangles with different normals.
    let bent = model.floats("VEC3", &[0., 0., 0., 1., 0., 0., 1., 1., 1., 0., 1., 0.]);
    let indices = model.shorts("SCALAR", &[0, 1, 2, 0, 2, 3]);
    let normals = model.floats("VEC3", &[0., 3., 4., 0., 3., 4., 0., 3., 4., 0., 3., 4.]);
    let mesh = model.push(
        "meshes",
        json!({ "primitives": [
            { "attributes": { "POSITION": bent, "NORMAL": normals }, "indices": indices },
            { "attributes": { "POSITION": bent }, "indices": indices },
        ] }),
    );
    model.root(json!({ "mesh": mesh }));
    let mesh = model.mesh();
    assert_eq!(mesh.positions.len(), 4 + 6);
    assert_near(&mesh.normals[..4], &[[0., 0.6, 0.8]; 4]);
    let half = 0.5_f32.sqrt();
    assert_near(&mesh.normals[4..7], &[[0., -half, half]; 3]);
    assert_near(&mesh.normals[7..], &[[-half, 0., half]; 3]);
    assert_eq!(mesh.triangles[2..], [[4, 5, 6], [7, 8, 9]]);
}

#[test]
fn normals_without_direction_take_that_of_their_triangle() {
    let mut model = Model::triangle();
    let normals = model.floats("VEC3", &[0., 0., 0., f32::NAN, 0., 1., 0., 0., -2.]);
    edit(&mut model, "attributes", json!({ "POSITION": 0, "NORMAL": normals }));
    let (scene, imported) = model.import();
    assert_near(&scene.meshes[0].normals, &[[0., 0., 1.], [0., 0., 1.], [0., 0., -1.]]);
    assert_eq!(
        imported.warnings.to_string(),
        "model.gltf: warning: meshes[0].primitives[0].NORMAL: 1 values are not finite numbers; neutral ones stand in \
         for them"
    );
}

/// A square with a normal texture, whose u goes along `u`; `mirrored` uv run the other way.
fn textured_square(uvs: &[f32], with_normals: bool) -> Model {
    let mut model = Model::new();
    let positions = model.floats("VEC3", &SQUARE);
    let uvs = model.floats("VEC2", uvs);
    let indices = model.shorts("SCALAR", &[0, 1, 2, 0, 2, 3]);
    let mut attributes = json!({ "POSITION": positions, "TEXCOORD_0": uvs });
    if with_normals {
        attributes["NORMAL"] = model.floats("VEC3", &[0., 0., 1., 0., 0., 1., 0., 0., 1., 0., 0., 1.]).into();
    }
    model.file("flat.png", super::png(1, 1, &[[128, 128, 255, 255]]));
    model.push("images", json!({ "uri": "flat.png" }));
    model.push("textures", json!({ "source": 0 }));
    model.push("materials", json!({ "normalTexture": { "index": 0 } }));
    primitive(&mut model, json!({ "attributes": attributes, "indices": indices, "material": 0 }));
    model
}

#[test]
fn tangents_are_computed_for_normal_textures() {
    // v points down on the image, so this texture stands upright on the square: tangent right, bitangent up.
    let upright = textured_square(&[0., 1., 1., 1., 1., 0., 0., 0.], true).mesh();
    assert_eq!(upright.positions.len(), 4);
    assert_eq!(upright.tangents, [Vec4::new(1., 0., 0., 1.); 4]);
    // Mirrored left to right: the tangent turns, the bitangent (w · n × t) does not.
    let mirrored = textured_square(&[1., 1., 0., 1., 0., 0., 1., 0.], true).mesh();
    assert_eq!(mirrored.tangents, [Vec4::new(-1., 0., 0., -1.); 4]);
    let bitangent = Vec3::Z.cross(mirrored.tangents[0].truncate()) * mirrored.tangents[0].w;
    assert_eq!(bitangent, Vec3::Y);
    // Turned by a quarter: u goes up.
    let turned = textured_square(&[0., 0., 0., 1., 1., 1., 1., 0.], true).mesh();
    assert_eq!(turned.tangents, [Vec4::new(0., 1., 0., 1.); 4]);
}

#[test]
fn vertices_between_mirrored_halves_are_split() {
    let mut model = Model::new();
    // Two squares side by side; the right half shows the left half's texture mirrored.
    let positions = model.floats("VEC3", &[0., 0., 0., 1., 0., 0., 2., 0., 0., 0., 1., 0., 1., 1., 0., 2., 1., 0.]);
    let uvs = model.floats("VEC2", &[0., 1., 1., 1., 0., 1., 0., 0., 1., 0., 0., 0.]);
    let normals = model.floats("VEC3", &[0., 0., 1.].repeat(6));
    let indices = model.shorts("SCALAR", &[0, 1, 4, 0, 4, 3, 1, 2, 5, 1, 5, 4]);
    model.file("flat.png", super::png(1, 1, &[[128, 128, 255, 255]]));
    model.push("images", json!({ "uri": "flat.png" }));
    model.push("textures", json!({ "source": 0 }));
    model.push("materials", json!({ "normalTexture": { "index": 0 } }));
    let attributes = json!({ "POSITION": positions, "TEXCOORD_0": uvs, "NORMAL": normals });
    primitive(&mut model, json!({ "attributes": attributes, "indices": indices, "material": 0 }));
    let mesh = model.mesh();
    assert_eq!(mesh.positions.len(), 8);
    for (index, triangle) in mesh.triangles.iter().enumerate() {
        let expected = if index < 2 { Vec4::new(1., 0., 0., 1.) } else { Vec4::new(-1., 0., 0., -1.) };
        assert!(triangle.iter().all(|vertex| mesh.tangents[*vertex as usize] == expected), "{mesh:?}");
    }
}

#[test]
fn tangents_of_a_mesh_without_normals() {
    let mesh = textured_square(&[0., 1., 1., 1., 1., 0., 0., 0.], false).mesh();
    assert!(mesh.normals.iter().all(|normal| *normal == Vec3::Z));
    assert!(mesh.tangents.iter().all(|tangent| *tangent == Vec4::new(1., 0., 0., 1.)));
    assert_eq!(mesh.normals.len(), mesh.positions.len());
}

#[test]
fn tangents_in_the_file_are_kept() {
    let mut model = textured_square(&[0., 1., 1., 1., 1., 0., 0., 0.], true);
    let tangents = model.floats("VEC4", &[0., 2., 0., -1.].repeat(4));
    model.json["meshes"][0]["primitives"][0]["attributes"]["TANGENT"] = tangents.into();
    assert_eq!(model.mesh().tangents, [Vec4::new(0., 1., 0., -1.); 4]);
}

#[test]
fn tangents_exist_where_the_uv_are_degenerate() {
    let mesh = textured_square(&[0.5; 8], true).mesh();
    for (tangent, normal) in mesh.tangents.iter().zip(&mesh.normals) {
        assert!((tangent.truncate().length() - 1.0).abs() < 1e-5 && tangent.truncate().dot(*normal).abs() < 1e-5);
        assert_eq!(tangent.w.abs(), 1.0);
    }
}

#[test]
fn positions_that_are_not_finite_cost_their_triangles() {
    let mut model = Model::new();
    let mut positions = SQUARE;
    positions[9] = f32::NAN;
    let positions = model.floats("VEC3", &positions);
    let indices = model.shorts("SCALAR", &[0, 1, 2, 0, 2, 3]);
    primitive(&mut model, json!({ "attributes": { "POSITION": positions }, "indices": indices }));
    let (scene, imported) = model.import_at(ModelTime::Rest);
    assert_eq!(scene.meshes[0].triangles, [[0, 1, 2]]);
    assert!(scene.meshes[0].positions.iter().all(|position| position.is_finite()));
    assert_eq!(
        imported.warnings.to_string(),
        "model.gltf: warning: meshes[0].primitives[0].attributes.POSITION: 1 triangles have positions that are not \
         finite numbers and are not drawn"
    );
}

proptest! {
    /// Tangents of any triangles, however they meet and whatever their uv are, are a frame with the normals.
    #[test]
    fn tangents_of_any_mesh(
        points in prop::collection::vec(prop::array::uniform3(-2_i8..3), 3..12),
        spots in prop::collection::vec(prop::array::uniform2(-2_i8..3), 12),
        corners in prop::collection::vec(any::<prop::sample::Index>(), 3..60),
        with_normals in any::<bool>(),
    ) {
        let count = points.len();
        let corners: Vec<u16> = corners.iter().map(|corner| corner.index(count) as u16).collect();
        let corners = &corners[..corners.len() / 3 * 3];
        let mut model = textured_square(&[0.; 8], false);
        let floats = |values: &[i8]| values.iter().map(|value| f32::from(*value)).collect::<Vec<_>>();
        let positions = model.floats("VEC3", &floats(points.as_flattened()));
        let uvs = model.floats("VEC2", &floats(spots[..count].as_flattened()));
        let indices = model.shorts("SCALAR", corners);
        let mut attributes = json!({ "POSITION": positions, "TEXCOORD_0": uvs });
        if with_normals {
            let normals: Vec<_> = points.iter().map(|[x, y, z]| [*y, *z, *x]).collect();
            attributes["NORMAL"] = json!(model.floats("VEC3", &floats(normals.as_flattened())));
        }
        edit(&mut model, "attributes", attributes);
        edit(&mut model, "indices", json!(indices));
        let (scene, _) = model.import();
        for mesh in &scene.meshes {
            prop_assert_eq!(mesh.tangents.len(), mesh.positions.len());
            for (tangent, normal) in mesh.tangents.iter().zip(&mesh.normals) {
                prop_assert!(normal.is_normalized() && tangent.truncate().is_normalized(), "{tangent} {normal}");
                prop_assert!(tangent.w.abs() == 1.0);
            }
        }
    }
}
