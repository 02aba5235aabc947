//! Renders a scene file from Rust: what `tusche render scenes/hello.toml -o hello.png` does, without the talk.
//!
//! Run it with `cargo run --release --example render_from_code`.

use std::path::Path;

use tusche::diag::Diagnostics;
use tusche::files::FileStore;
use tusche::film::Layer;
use tusche::plan::Plan;
use tusche::render::{Control, PictureFile, RenderOptions, layers_of, render_files};
use tusche::scene::file;
use tusche::shade::{Host, Shaders};

fn main() -> Result<(), Diagnostics> {
    // A scene file becomes a scene; its scripts become shaders; both together become a plan.
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/hello.toml");
    let files = FileStore::new();
    let (mut builder, _warnings) = file::load(&path, &files, &[], &file::LoadOptions::default())?;
    builder.render.size = [320, 180];
    let scene = builder.build()?;
    let (shaders, _warnings) = Shaders::compile(&scene, &Host::new())?;
    let files = [PictureFile { path: "render_from_code.png".into(), layers: vec![Layer::Rgba] }];
    let plan = Plan::new(&scene, &shaders, &layers_of(&files));
    println!("{plan}");

    let report = render_files(&scene, &shaders, &plan, &files, &RenderOptions::default(), &Control::default())?;
    println!("{} camera rays, {} samples on lines", report.stats.rays.camera, report.stats.lines.lined_samples);
    Ok(())
}
