//! Scene files: what they mean, and what is said about those that mean nothing.

mod goldens;
mod meaning;
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
}

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
