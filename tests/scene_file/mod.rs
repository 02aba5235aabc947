//! Scene files: what they mean, and what is said about those that mean nothing.

mod goldens;
mod meaning;
mod models;
mod overrides;
mod schema;
mod shapes;

use std::path::Path;

use tusche::diag::Diagnostics;
use tusche::files::FileStore;
use tusche::scene::SceneBuilder;
use tusche::scene::file::{LoadOptions, Override, load};

/// A store with a scene and the files that the scenes of these tests name.
fn store(scene: &str) -> FileStore {
    FileStore::new()
        .with_file("scene.toml", scene)
        .with_file("ink.rhai", "fn surface(hit, p) { #{} }")
        .with_file("white.png", white_png())
        .with_file("stage.gltf", STAGE)
}

/// A model of a camera and a lamp, with nothing to see.
const STAGE: &str = r#"{
    "asset": { "version": "2.0" },
    "scene": 0,
    "scenes": [{ "nodes": [0, 1] }],
    "nodes": [
        { "name": "Shot", "camera": 0, "translation": [0, 0, 5] },
        { "name": "Lamp", "translation": [0, 2, 0], "extensions": { "KHR_lights_punctual": { "light": 0 } } }
    ],
    "cameras": [{ "type": "perspective", "perspective": { "yfov": 0.5, "znear": 0.1 } }],
    "extensionsUsed": ["KHR_lights_punctual"],
    "extensions": { "KHR_lights_punctual": { "lights": [{ "type": "point", "intensity": 40 }] } }
}"#;

/// A picture of one white pixel.
fn white_png() -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 1, 1);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(&[255; 3]).unwrap();
    drop(writer);
    bytes
}

fn load_with(
    scene: &str,
    overrides: &[&str],
    options: &LoadOptions,
) -> Result<(SceneBuilder, Diagnostics), Diagnostics> {
    let parsed: Vec<_> = overrides.iter().map(|text| Override::parse(text).unwrap()).collect();
    load(Path::new("scene.toml"), &store(scene), &parsed, options)
}

/// A scene that must load without a word.
#[track_caller]
fn loaded(scene: &str) -> SceneBuilder {
    let (builder, warnings) =
        load_with(scene, &[], &LoadOptions::default()).unwrap_or_else(|faults| panic!("{faults}"));
    assert!(warnings.is_empty(), "{warnings}");
    builder
}
