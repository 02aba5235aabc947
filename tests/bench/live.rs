//! From an edit to its picture: `cargo bench --bench live [-- SCENE] [--size WxH] [--samples N] [--edits N] [--edit WORD]`.
//!
//! Scene and scripts are held in memory and read anew at every edit, as `tusche watch` does after a save. The figures are
//! medians in milliseconds from the edit to the complete picture, beside a fresh render of the same picture.

use std::path::{Path, PathBuf};
use std::time::Instant;

use tusche::files::FileStore;
use tusche::film::Layer;
use tusche::live::{LivePicture, Session, SessionOptions, Setup};
use tusche::scene::file;
use tusche::shade::{Host, Shaders};

/// What is edited: in which file, what stands there, and how it is written the n-th time.
struct Edit {
    name: &'static str,
    file: PathBuf,
    old: &'static str,
    new: fn(usize) -> String,
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let value = |name: &str, usual: &str| {
        let place = arguments.iter().position(|argument| argument == name);
        place.and_then(|place| arguments.get(place + 1)).map_or(usual.to_owned(), Clone::clone)
    };
    let edits: usize = value("--edits", "20").parse().unwrap_or(20);
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let scene = root.join("scenes/fig4_default.toml");
    let size = value("--size", "960x540");
    let (width, height) = size.split_once('x').unwrap_or(("960", "540"));
    let overrides: Vec<_> =
        [format!("render.size=[{width}, {height}]"), format!("render.samples={}", value("--samples", "4"))]
            .iter()
            .filter_map(|text| file::Override::parse(text).ok())
            .collect();
    // As the scene file names it.
    let ink = root.join("scenes/../shaders/ink.rhai");
    let cases = [
        Edit {
            name: "line setting",
            file: scene.clone(),
            old: "normal = 60.0",
            new: |n| format!("normal = {}.0", 40 + n),
        },
        Edit {
            name: "line width in a parameter",
            file: scene.clone(),
            old: "ink = [0.20, 0.0, 0.02], ink_width = 4.0",
            new: |n| format!("ink = [0.20, 0.0, 0.02], ink_width = {}", 2.0 + n as f64 * 0.05),
        },
        Edit {
            name: "line width in the script",
            file: ink.clone(),
            old: "line_width: p.ink_width",
            new: |n| format!("line_width: p.ink_width * {}", 0.5 + n as f64 * 0.01),
        },
        Edit {
            name: "BSDF colour",
            file: scene.clone(),
            old: "paper = [0.70, 0.17, 0.12]",
            new: |n| format!("paper = [0.{:03}, 0.17, 0.12]", 100 + n),
        },
        Edit {
            name: "moved light",
            file: scene.clone(),
            old: "direction = [-0.5, -0.8, -0.4]",
            new: |n| format!("direction = [-0.5, -0.8, -0.{:03}]", 100 + n),
        },
        Edit {
            name: "moved object",
            file: scene.clone(),
            old: "translate = [0, 1.2, 0]",
            new: |n| format!("translate = [0, 1.{:03}, 0]", 100 + n),
        },
    ];
    println!(
        "{:<28} {:>8} {:>10} {:>8} {:>8} {:>8}   traced shaded restyled lined developed of tiles",
        "edit", "ms", "first, ms", "load", "fresh", "fresh/ms"
    );
    let word = value("--edit", "");
    for case in cases.into_iter().filter(|case| case.name.contains(&word)) {
        let text = std::fs::read_to_string(&case.file).unwrap_or_default();
        if !text.contains(case.old) {
            println!("{:<28} `{}` is not in {}", case.name, case.old, case.file.display());
            continue;
        }
        let load = |n: usize| {
            let files = FileStore::new().with_file(&case.file, text.replace(case.old, &(case.new)(n)));
            let loaded = file::load(&scene, &files, &overrides, &file::LoadOptions::default());
            let scene = loaded.and_then(|(builder, _)| builder.build()).unwrap_or_else(|faults| panic!("{faults}"));
            let (shaders, _) = Shaders::compile(&scene, &Host::new()).unwrap_or_else(|faults| panic!("{faults}"));
            Setup { scene, shaders, layers: vec![Layer::Rgba] }
        };
        let session = |progressive| {
            let options = SessionOptions { progressive, ..SessionOptions::default() };
            Session::new(options).unwrap_or_else(|fault| panic!("{fault}"))
        };
        let kept = session(true);
        kept.set_scene(load(edits));
        let mut last = kept.render().unwrap_or_else(|faults| panic!("{faults}"));
        let events = kept.subscribe();
        let (mut times, mut firsts, mut loads, mut fresh) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for n in 0..edits {
            let start = Instant::now();
            let setup = load(n);
            loads.push(start.elapsed().as_secs_f64());
            kept.set_scene(setup);
            last = kept.render().unwrap_or_else(|faults| panic!("{faults}"));
            times.push(start.elapsed().as_secs_f64());
            let shown = |event| match event {
                tusche::live::Event::Picture(picture) => Some(picture),
                _ => None,
            };
            // The first picture may have come earlier than the final one; its own clock tells when.
            let first: Option<std::sync::Arc<LivePicture>> = events.try_iter().find_map(shown);
            firsts.push(first.map_or(0.0, |picture| picture.stats.seconds.total) + loads[n]);
            if !arguments.iter().any(|argument| argument == "--fresh-once") || n == 0 {
                let start = Instant::now();
                let other = session(false);
                other.set_scene(load(n));
                let _ = other.render();
                fresh.push(start.elapsed().as_secs_f64());
            }
        }
        let [time, first, load, fresh] = [times, firsts, loads, fresh].map(median);
        let done = &last.redone;
        println!(
            "{:<28} {:>8.1} {:>10.1} {:>8.1} {:>8.1} {:>8.2}   {:>6} {:>6} {:>8} {:>5} {:>9} of {}",
            case.name,
            time * 1e3,
            first * 1e3,
            load * 1e3,
            fresh * 1e3,
            fresh / time,
            done.traced,
            done.shaded,
            done.restyled,
            done.lined,
            done.developed,
            done.tiles
        );
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
