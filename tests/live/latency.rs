//! A measurement, not a test: milliseconds from the save of a file to the picture in the page, beside a fresh render.
//!
//! `cargo test --release --test tests latency -- --ignored --nocapture`, on a machine that does nothing else.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use serde_json::json;
use tusche::live::{PageOptions, SessionOptions};

use super::browser::Browser;
use super::{Watching, options, replace};
use crate::common::{Workplace, root};

/// Edits of each kind that count, after two that do not.
const ROUNDS: usize = 20;

/// Tells of every final picture when its last pixel was put, and how long the server had it in hand until the picture was
/// made.
const LISTEN: &str = "window.seen = [];
    const canvas = document.getElementById('picture');
    new MutationObserver(() => {
        if (canvas.dataset.final === 'true') window.seen.push([performance.timeOrigin + performance.now(), picture.redone, picture.after]);
    }).observe(canvas, { attributes: true, attributeFilter: ['data-final', 'data-revision'] });";

fn now() -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |time| time.as_secs_f64() * 1e3)
}

fn median(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

#[test]
#[ignore = "a measurement for people, not a check: run by hand, as README says under \"While you work\""]
fn latency_of_edits() {
    let browser = Browser::start().expect("chromium and chromedriver are there");
    let place = Workplace::new();
    for (folder, extension) in [("scenes", "toml"), ("shaders", "rhai")] {
        for entry in std::fs::read_dir(root().join(folder)).expect("it can be listed").flatten() {
            if entry.path().extension().is_some_and(|found| found == extension) {
                let contents = std::fs::read(entry.path()).expect("it can be read");
                place.file(&format!("{folder}/{}", entry.file_name().to_string_lossy()), contents);
            }
        }
    }
    let mut options = options(&place);
    options.scene.path = place.folder.path().join("scenes/fig4_default.toml");
    options.scene.overrides =
        vec![tusche::scene::file::Override::parse("render.samples=4").expect("it is an override")];
    options.session = SessionOptions::default();
    options.page = Some(PageOptions::LOCAL);
    let watching = Watching::start(options);
    browser.open(watching.url());
    browser.wait("return document.getElementById('picture').dataset.final === 'true'");
    browser.run(LISTEN);

    println!(
        "| edit | median | least | most | of which until the picture is made | done again |\n|---|---|---|---|---|---|"
    );
    for (name, file, from, to) in [
        ("line setting: `normal`", "scenes/fig4_default.toml", "normal = 60.0", ["normal = 40.0", "normal = 50.0"]),
        (
            "line setting: `normal`, edges of cylinders come and go",
            "scenes/fig4_default.toml",
            "normal = 60.0",
            ["normal = 100.0", "normal = 60.0"],
        ),
        ("line setting: `tint`", "scenes/fig4_default.toml", "tint = false", ["tint = true", "tint = false"]),
        ("line width in a script", "shaders/ink.rhai", "p.ink_width,", ["p.ink_width * 0.9,", "p.ink_width * 1.1,"]),
        (
            "line colour in a script",
            "shaders/ink.rhai",
            "line_color: p.ink,",
            ["line_color: p.ink * 0.5,", "line_color: p.ink * 2.0,"],
        ),
        (
            "BSDF colour",
            "shaders/mirror.rhai",
            "base_color: p.tint",
            ["base_color: p.tint * 0.9", "base_color: p.tint * 0.8"],
        ),
    ] {
        let path = place.folder.path().join(file);
        let original = std::fs::read_to_string(&path).expect("it can be read");
        assert!(original.contains(from), "{file}");
        let (mut times, mut made) = (Vec::new(), Vec::new());
        let mut redone = json!(null);
        for round in 0..ROUNDS + 2 {
            std::thread::sleep(Duration::from_millis(300));
            browser.run("window.seen.length = 0");
            let saved = now();
            replace(&path, original.replace(from, to[round % 2]));
            // Whoever asks the browser takes time on the same cores.
            std::thread::sleep(Duration::from_millis(400));
            let seen = browser.wait("return window.seen.length > 0 && window.seen[0]");
            if round >= 2 {
                times.push(seen[0].as_f64().expect("a time") - saved);
                redone = seen[1].clone();
                made.push(seen[2].as_f64().unwrap_or(f64::NAN) * 1e3);
            }
        }
        let middle = median(&mut times);
        let made = median(&mut made);
        println!("| {name} | {middle:.0} | {:.0} | {:.0} | {made:.0} | {redone} |", times[0], times[times.len() - 1]);
        replace(&path, original);
        std::thread::sleep(Duration::from_secs(2));
    }
    drop(watching);
    let mut times: Vec<_> = (0..5)
        .map(|_| {
            let start = Instant::now();
            place.run(&["render", "scenes/fig4_default.toml", "--samples", "4", "-o", "fresh.png", "-q"]).exits(0);
            start.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    let middle = median(&mut times);
    println!("| a fresh `render` | {middle:.0} | {:.0} | {:.0} | | |", times[0], times[times.len() - 1]);
}
