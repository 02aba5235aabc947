//! Registers a native function and lets a script call it: here, concentric rings that become lines.
//!
//! Run it with `cargo run --release --example native_function`.

use std::path::Path;

use tusche::diag::Diagnostics;
use tusche::files::FileStore;
use tusche::film::Layer;
use tusche::math::Vec3;
use tusche::plan::Plan;
use tusche::render::{Control, PictureFile, RenderOptions, layers_of, render_files};
use tusche::scene::file;
use tusche::shade::{Host, Shaders};

const SCENE: &str = r#"
[render]
size = [320, 240]
[lines]
feature = 0.5
[camera]
position = [0.0, 2.0, 5.0]
target = [0.0, 0.0, 0.0]
fov = 30.0
[materials.rings]
shader = "rings.rhai"
[[objects]]
shape = "sphere"
material = "rings"
"#;

const SCRIPT: &str = r"
fn surface(hit, p) {
    #{ base_color: rgb(0.95, 0.9, 0.8), feature: gray(rings(hit.position, 0.2)), line_width: 2.0 }
}
";

fn main() -> Result<(), Diagnostics> {
    // The function is registered on every engine that the host makes, one for each thread.
    let host = Host::new().with(|engine| {
        engine.register_fn("rings", |position: Vec3, spacing: f32| (position.y / spacing).floor().rem_euclid(2.0));
    });

    // The scene file and its script need not exist on disk.
    let files = FileStore::new().with_file("rings.toml", SCENE).with_file("rings.rhai", SCRIPT);
    let (builder, _warnings) = file::load(Path::new("rings.toml"), &files, &[], &file::LoadOptions::default())?;
    let scene = builder.build()?;
    let (shaders, _warnings) = Shaders::compile(&scene, &host)?;
    let files = [PictureFile { path: "native_function.png".into(), layers: vec![Layer::Rgba] }];
    let plan = Plan::new(&scene, &shaders, &layers_of(&files));
    render_files(&scene, &shaders, &plan, &files, &RenderOptions::default(), &Control::default())?;
    Ok(())
}
