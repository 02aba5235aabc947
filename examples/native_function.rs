//! A plug-in: a procedural pattern in Rust, with static types and a batch form, that a script calls. Here, a brick wall
//! whose mortar becomes lines.
//!
//! Run it with `cargo run --release --example native_function`.

use std::path::Path;

use tusche::diag::{Diagnostic, Diagnostics};
use tusche::files::FileStore;
use tusche::film::Layer;
use tusche::math::Vec2;
use tusche::plan::Plan;
use tusche::render::{Control, PictureFile, RenderOptions, layers_of, render_files};
use tusche::scene::file;
use tusche::shade::{Host, NativeFunction, Package, Shaders};

const SCENE: &str = r#"
[render]
size = [320, 240]
[lines]
feature = 0.5
[camera]
position = [0.0, 2.0, 5.0]
target = [0.0, 0.0, 0.0]
fov = 30.0
[materials.wall]
shader = "wall.rhai"
[[objects]]
shape = "sphere"
material = "wall"
"#;

const SCRIPT: &str = r"
fn surface(hit, p) {
    let at = hit.uv * vec2(2 * COURSES, COURSES);
    let brick = bricks(at, 0.1);
    #{ base_color: mix(gray(0.8), rgb(0.6, 0.2, 0.1), brick), feature: gray(brick), line_width: 1.5 }
}
";

/// 1 on a brick, 0 on mortar. The same operations in the same order, whether for one place or for many.
fn bricks(x: f32, y: f32, mortar: f32) -> f32 {
    let row = y.floor();
    // Every second row is half a brick further on.
    let shifted = x * 0.5 + (row * 0.5 - (row * 0.5).floor());
    let (along, up) = (shifted - shifted.floor(), y - row);
    let within = |t: f32, gap: f32| t >= gap && t <= 1.0 - gap;
    if within(along, mortar * 0.25) & within(up, mortar * 0.5) { 1.0 } else { 0.0 }
}

struct Masonry;

impl Masonry {
    fn bricks() -> NativeFunction {
        NativeFunction::new("bricks", |at: Vec2, mortar: f32| bricks(at.x, at.y, mortar))
            .documented("bricks(at, mortar)", "1 on a brick of size 2 × 1, 0 on mortar of a given width")
            .with_batch(|arguments, results| {
                let ([x, y, mortar], [out]) = (arguments, results) else { return };
                for (((out, x), y), mortar) in out.iter_mut().zip(*x).zip(*y).zip(*mortar) {
                    *out = bricks(*x, *y, *mortar);
                }
            })
    }
}

impl Package for Masonry {
    fn name(&self) -> &'static str {
        "masonry"
    }

    fn register(&self, host: Host) -> Host {
        host.with_constant("COURSES", 12_i64).with_function(Self::bricks())
    }
}

/// Tries whether both forms of the pattern agree, bit by bit.
fn check() -> Result<(), Diagnostic> {
    let column = |step: f32| (0..10_000).map(|i| (i as f32 - 5000.0) * step).collect::<Vec<_>>();
    let (x, y, mortar) = (column(0.013), column(-0.37), column(0.0001));
    Masonry::bricks().check(&[&x, &y, &mortar]).map_err(Diagnostic::error)
}

fn main() -> Result<(), Diagnostics> {
    check()?;
    let host = Host::new().with_package(&Masonry);

    // The scene file and its script need not exist on disk.
    let files = FileStore::new().with_file("wall.toml", SCENE).with_file("wall.rhai", SCRIPT);
    let (builder, _warnings) = file::load(Path::new("wall.toml"), &files, &[], &file::LoadOptions::default())?;
    let scene = builder.build()?;
    let (shaders, _warnings) = Shaders::compile(&scene, &host)?;
    let files = [PictureFile { path: "native_function.png".into(), layers: vec![Layer::Rgba] }];
    let plan = Plan::new(&scene, &shaders, &layers_of(&files));
    render_files(&scene, &shaders, &plan, &files, &RenderOptions::default(), &Control::default())?;
    Ok(())
}
