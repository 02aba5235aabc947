//! Models: made here by hand, so that each test says in full what it reads, and a few from other programs.

mod faults;
mod framing;
mod geometry;
mod hierarchy;
mod material;
mod pose;
mod real;
mod texture;

use std::path::Path;

use serde_json::{Value, json};
use tusche::diag::Diagnostics;
use tusche::files::FileStore;
use tusche::math::Vec3;
use tusche::scene::framing as scene_framing;
use tusche::scene::gltf::{Imported, ModelTime, Placement, import};
use tusche::scene::mesh::Mesh;
use tusche::scene::{Object, SceneBuilder};

/// A glTF model under construction: JSON, and one buffer `model.bin`.
struct Model {
    json: Value,
    buffer: Vec<u8>,
    files: Vec<(String, Vec<u8>)>,
}

impl Model {
    fn new() -> Self {
        let json = json!({
            "asset": { "version": "2.0" },
            "scene": 0,
            "scenes": [{ "nodes": [] }],
            "nodes": [], "meshes": [], "accessors": [], "bufferViews": [], "materials": [],
            "textures": [], "images": [], "samplers": [], "skins": [], "animations": [], "cameras": [],
        });
        Self { json, buffer: Vec::new(), files: Vec::new() }
    }

    /// One triangle in the xy plane at a node, as the start of many tests.
    fn triangle() -> Self {
        let mut model = Self::new();
        let positions = model.floats("VEC3", &[0., 0., 0., 1., 0., 0., 0., 1., 0.]);
        let mesh = model.push("meshes", json!({ "primitives": [{ "attributes": { "POSITION": positions } }] }));
        model.root(json!({ "mesh": mesh, "name": "thing" }));
        model
    }

    /// Adds an entry to a table and returns its index.
    fn push(&mut self, table: &str, entry: Value) -> usize {
        let table = self.json[table].as_array_mut().unwrap();
        table.push(entry);
        table.len() - 1
    }

    /// Adds a node to the scene.
    fn root(&mut self, node: Value) -> usize {
        let index = self.push("nodes", node);
        self.json["scenes"][0]["nodes"].as_array_mut().unwrap().push(index.into());
        index
    }

    /// Adds bytes as a buffer view.
    fn view(&mut self, bytes: &[u8]) -> usize {
        self.buffer.resize(self.buffer.len().next_multiple_of(4), 0);
        let offset = self.buffer.len();
        self.buffer.extend(bytes);
        self.push("bufferViews", json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() }))
    }

    /// Adds an accessor over bytes of its own.
    fn accessor(&mut self, component: u32, kind: &str, count: usize, bytes: &[u8]) -> usize {
        let view = self.view(bytes);
        self.push("accessors", json!({ "bufferView": view, "componentType": component, "type": kind, "count": count }))
    }

    fn floats(&mut self, kind: &str, values: &[f32]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.accessor(FLOAT, kind, values.len() / width(kind), &bytes)
    }

    fn shorts(&mut self, kind: &str, values: &[u16]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.accessor(UNSIGNED_SHORT, kind, values.len() / width(kind), &bytes)
    }

    fn file(&mut self, name: &str, bytes: impl Into<Vec<u8>>) {
        self.files.push((name.into(), bytes.into()));
    }

    /// The JSON text, with the buffer as an external file.
    fn text(&self) -> String {
        let mut json = self.json.clone();
        json["buffers"] = json!([{ "uri": "model.bin", "byteLength": self.buffer.len() }]);
        serde_json::to_string_pretty(&json).unwrap()
    }

    /// The model as a `.glb`.
    fn glb(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        json["buffers"] = json!([{ "byteLength": self.buffer.len() }]);
        glb(json.to_string().as_bytes(), Some(&self.buffer))
    }

    fn store(&self) -> FileStore {
        let store = FileStore::new().with_file("model.gltf", self.text()).with_file("model.bin", self.buffer.clone());
        self.files.iter().fold(store, |store, (name, bytes)| store.with_file(name, bytes.clone()))
    }

    fn import_at(&self, time: ModelTime) -> (SceneBuilder, Imported) {
        self.try_import(time, &Placement::named("m")).unwrap_or_else(|faults| panic!("{faults}"))
    }

    fn import(&self) -> (SceneBuilder, Imported) {
        self.import_at(ModelTime::Rest)
    }

    fn try_import(&self, time: ModelTime, placement: &Placement) -> Result<(SceneBuilder, Imported), Diagnostics> {
        let mut scene = SceneBuilder::default();
        let imported = import(Path::new("model.gltf"), &self.store(), time, &mut scene, placement)?;
        Ok((scene, imported))
    }

    /// The faults of a model that cannot be imported, as text.
    fn faults(&self) -> String {
        match self.try_import(ModelTime::Rest, &Placement::named("m")) {
            Ok(_) => panic!("the model was imported"),
            Err(faults) => faults.to_string(),
        }
    }

    /// The only mesh of the model, which imports without warnings.
    fn mesh(&self) -> Mesh {
        let (scene, imported) = self.import();
        assert_eq!(imported.warnings.to_string(), "");
        assert_eq!(scene.meshes.len(), 1);
        scene.meshes[0].as_ref().clone()
    }
}

const BYTE: u32 = 5120;
const UNSIGNED_BYTE: u32 = 5121;
const SHORT: u32 = 5122;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;

fn width(kind: &str) -> usize {
    match kind {
        "SCALAR" => 1,
        "VEC2" => 2,
        "VEC3" => 3,
        "VEC4" => 4,
        "MAT4" => 16,
        other => panic!("{other}"),
    }
}

pub fn glb(json: &[u8], binary: Option<&[u8]>) -> Vec<u8> {
    let mut chunks = Vec::new();
    let parts = [(Some(json), b"JSON", b' '), (binary, b"BIN\0", 0)];
    for (bytes, kind, padding) in parts.into_iter().filter_map(|(bytes, kind, pad)| Some((bytes?, kind, pad))) {
        let length = bytes.len().next_multiple_of(4);
        chunks.extend((length as u32).to_le_bytes());
        chunks.extend(kind);
        chunks.extend(bytes);
        chunks.resize(chunks.len() + length - bytes.len(), padding);
    }
    let mut file = b"glTF".to_vec();
    file.extend(2_u32.to_le_bytes());
    file.extend((chunks.len() as u32 + 12).to_le_bytes());
    file.extend(chunks);
    file
}

/// A PNG of the given pixels.
fn png(width: u32, height: u32, pixels: &[[u8; 4]]) -> Vec<u8> {
    let image = image::RgbaImage::from_raw(width, height, pixels.as_flattened().to_vec()).unwrap();
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    bytes
        .chunks(3)
        .flat_map(|chunk| {
            let word = chunk.iter().enumerate().fold(0, |word, (i, byte)| word | u32::from(*byte) << (16 - 8 * i));
            let digit = move |i: usize| char::from(DIGITS[(word >> (18 - 6 * i) & 63) as usize]);
            let length = chunk.len();
            (0..4).map(move |i| if i <= length { digit(i) } else { '=' })
        })
        .collect()
}

/// World positions of an object's vertices.
fn world(scene: &SceneBuilder, object: &Object) -> Vec<Vec3> {
    let mesh = &scene.meshes[object.mesh.index()];
    let world = |position: &Vec3| object.world_from_object.transform_point3(position.as_dvec3()).as_vec3();
    mesh.positions.iter().map(world).collect()
}

#[track_caller]
fn assert_near(found: &[Vec3], expected: &[[f32; 3]]) {
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for (a, b) in found.iter().zip(expected) {
        assert!(a.distance(Vec3::from(*b)) < 1e-5, "found {found:?}, expected {expected:?}");
    }
}

/// A model alone as a scene: framed, with its own lights or the default ones.
fn load_model(
    path: &Path,
    files: &FileStore,
    time: ModelTime,
    camera: Option<&str>,
    size: [u32; 2],
) -> Result<(SceneBuilder, Diagnostics), Diagnostics> {
    let mut scene = SceneBuilder::default();
    let imported = import(path, files, time, &mut scene, &Placement::named("model"))?;
    scene.render.size = size;
    let bounds = scene_framing::bounds(&scene);
    scene.cameras.push(scene_framing::frame_camera(bounds, size));
    scene.cameras.extend(imported.cameras);
    scene.camera_name = camera.map(str::to_owned);
    let seen_by = scene.cameras.iter().find(|known| camera == Some(known.name.as_str())).unwrap_or(&scene.cameras[0]);
    scene.lights =
        if imported.lights.is_empty() { scene_framing::default_lights(seen_by, bounds) } else { imported.lights };
    Ok((scene, imported.warnings))
}
