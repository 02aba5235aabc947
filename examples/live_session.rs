//! A session in a program of one's own: set a scene, listen, change something, and pay only for what the change touches.
//!
//! Run it with `cargo run --release --example live_session`.

use std::path::Path;

use tusche::diag::Diagnostics;
use tusche::files::FileStore;
use tusche::film::Layer;
use tusche::live::{Event, Session, SessionOptions, Setup};
use tusche::render::SceneRequest;
use tusche::scene::file::{LoadOptions, Override};
use tusche::shade::ShadingMode;

fn main() -> Result<(), Diagnostics> {
    let session = Session::new(SessionOptions::default())?;

    // Whoever subscribes hears of every picture, those of few samples on the way included. A window would show them here.
    let events = session.subscribe();
    let window = std::thread::spawn(move || {
        for event in events {
            if let Event::Picture(picture) = event {
                let kind = if picture.is_final { "final picture" } else { "picture" };
                println!("  {kind} of {} samples, new in {:?}", picture.samples, picture.changed);
            }
        }
    });

    let mut request = SceneRequest {
        path: Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/fig4_default.toml"),
        overrides: vec![Override::parse("render.size=[480, 270]")?, Override::parse("render.samples=4")?],
        options: LoadOptions::default(),
        lines: true,
        shading: ShadingMode::Auto,
    };
    for change in [None, Some("lines.normal=40"), Some("materials.red.params.ink_width=8"), Some("camera.fov=30")] {
        println!("{}", change.unwrap_or("the scene as it is"));
        request.overrides.extend(change.map(Override::parse).transpose()?);
        let loaded = request.load(&FileStore::new())?;
        // What was under way is dropped; what the change does not touch is kept.
        session.set_scene(Setup { scene: loaded.scene, shaders: loaded.shaders, layers: vec![Layer::Rgba] });
        let picture = session.render()?;
        println!("  {} rays, done again: {:?}", picture.stats.rays.camera, picture.redone);
    }

    drop(session);
    // The events end with the session; a window that panicked has said so itself.
    let _ = window.join();
    Ok(())
}
