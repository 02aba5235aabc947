//! Who chooses the samples: an error, a time, a quality.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use tusche::film::{FilmTile, Layer};
use tusche::line::Method;
use tusche::plan::Plan;
use tusche::render::refine::{BLOCK, FIRST, Refinement, estimate, measured_layers, next_rate};
use tusche::render::stats::Sampling;
use tusche::render::{Control, ErrorGoal, RenderOptions, Report, render_to_error};
use tusche::sample::PixelRect;
use tusche::scene::Scene;
use tusche::scene::settings::Sampler;
use tusche::shade::{Host, Shaders};
use tusche::study::{Quality, Settings};

use crate::common::{Picture, Workplace, render_with, scene_from};

/// Thin and wide lines, a mirror, a ground: parts that need few samples and parts that need many.
const SCENE: &str = r#"
[render]
size = [75, 50]
samples = 4
[camera]
position = [0.0, 1.0, 6.0]
target = [0.0, 0.4, 0.0]
[lines]
width = 3.0
normal = 30.0
[[objects]]
shape = "box"
rotate = [10.0, 27.0, 0.0]
translate = [-1.1, 0.5, 0.0]
material = "ink"
[[objects]]
shape = "sphere"
translate = [1.2, 0.6, 0.0]
radius = 0.6
material = "mirror"
[materials.ink]
shader = "builtin:cel"
[materials.mirror]
shader = "builtin:mirror"
"#;

/// A picture to an error, with all its layers, and how its tiles came.
fn refined(
    scene: &Scene,
    goal: &ErrorGoal,
    options: &RenderOptions,
    control: &Control<'_>,
) -> (Picture, Report, Vec<u32>) {
    let (shaders, _) = Shaders::compile(scene, &Host::new()).unwrap_or_else(|faults| panic!("{faults}"));
    let layers = measured_layers(&[Layer::Depth]);
    let plan = Plan::new(scene, &shaders, &layers);
    let [width, height] = scene.render().size.map(|side| side as usize);
    let channels: usize = layers.iter().map(|layer| layer.channels().len()).sum();
    let picture = Picture { width, height, channels: vec![vec![0.0; width * height]; channels] };
    let out = Mutex::new((picture, vec![0_u32; width * height]));
    let emit = |tile: &FilmTile| {
        let mut out = out.lock().expect("no thread panics with it");
        let places = (tile.rect.y0..tile.rect.y1).flat_map(|y| (tile.rect.x0..tile.rect.x1).map(move |x| (x, y)));
        for (i, (x, y)) in places.enumerate() {
            let at = y as usize * width + x as usize;
            out.1[at] += 1;
            for (channel, values) in out.0.channels.iter_mut().zip(&tile.channels) {
                channel[at] = values[i];
            }
        }
        Ok(())
    };
    let report = render_to_error(scene, &shaders, &plan, goal, options, control, &emit)
        .unwrap_or_else(|fault| panic!("{fault}"));
    let (picture, times) = out.into_inner().expect("no thread panics with it");
    (picture, report, times)
}

fn refinement(report: &Report) -> &Refinement {
    match &report.stats.sampling {
        Some(Sampling::Error(found)) => found,
        other => panic!("no refinement: {other:?}"),
    }
}

/// The definition as plain loops: whole pictures of every rate, and for each block the first that is good enough. Returns
/// the picture and the rate of every pixel.
fn by_definition(scene: &Scene, goal: &ErrorGoal, method: Method) -> (Picture, Vec<u32>) {
    let layers = measured_layers(&[Layer::Depth]);
    let options = RenderOptions { method, ..RenderOptions::default() };
    let whole = |rate: u32| render_with(&scene.with_samples(rate), &layers, &options).0;
    let pictures: Vec<(u32, Picture)> =
        std::iter::successors(Some(FIRST), |rate| (rate * 2 <= goal.most).then_some(rate * 2))
            .map(|rate| (rate, whole(rate)))
            .collect();
    let picture = |rate: u32| &pictures.iter().find(|(known, _)| *known == rate).expect("all were rendered").1;
    let count = |layers: &[Layer]| -> usize { layers.iter().map(|layer| layer.channels().len()).sum() };
    let first = |layer: Layer| count(&layers[..layers.iter().position(|known| *known == layer).expect("it is there")]);
    let (color, line) = (first(Layer::Rgba), first(Layer::Line));
    let mut outcome = picture(FIRST).clone();
    let mut rates = vec![0; outcome.width * outcome.height];
    for top in (0..outcome.height).step_by(BLOCK as usize) {
        for left in (0..outcome.width).step_by(BLOCK as usize) {
            let bottom = (top + BLOCK as usize).min(outcome.height);
            let right = (left + BLOCK as usize).min(outcome.width);
            let places: Vec<_> = (top..bottom).flat_map(|y| (left..right).map(move |x| (x, y))).collect();
            let rms = |a: &Picture, b: &Picture| {
                let unit = |value: f32| f64::from(value.clamp(0.0, 1.0));
                let shown = |picture: &Picture, axis: usize, (x, y): (usize, usize)| {
                    unit(picture.at(color + axis, x, y) + (1.0 - picture.at(color + 3, x, y)))
                };
                let mut colors = 0.0;
                let mut lines = 0.0;
                for place in &places {
                    for axis in 0..3 {
                        colors += (shown(a, axis, *place) - shown(b, axis, *place)).powi(2);
                    }
                    lines += (unit(a.at(line + 3, place.0, place.1)) - unit(b.at(line + 3, place.0, place.1))).powi(2);
                }
                let count = places.len() as f64;
                (colors / (3.0 * count)).sqrt().max((lines / count).sqrt())
            };
            let (mut before, mut rate) = (FIRST, 2 * FIRST);
            while let Some(next) = next_rate(
                goal,
                rate,
                estimate(rms(picture(before), picture(rate)), [before, rate], scene.render().sampler),
            ) {
                (before, rate) = (rate, next);
            }
            for (x, y) in places {
                rates[y * outcome.width + x] = rate;
                for (channel, values) in outcome.channels.iter_mut().zip(&picture(rate).channels) {
                    channel[y * outcome.width + x] = values[y * outcome.width + x];
                }
            }
        }
    }
    (outcome, rates)
}

const GOAL: ErrorGoal = ErrorGoal { error: 0.015, most: 64 };

#[test]
fn every_block_is_that_of_the_picture_with_its_rate() {
    let scene = scene_from(SCENE);
    let (expected, rates) = by_definition(&scene, &GOAL, Method::Exact);
    let counts: std::collections::BTreeMap<u32, u64> = rates.iter().fold(Default::default(), |mut counts, rate| {
        *counts.entry(*rate).or_default() += 1;
        counts
    });
    assert!(counts.len() >= 3, "blocks of several rates meet: {counts:?}");
    let (picture, report, times) = refined(&scene, &GOAL, &RenderOptions::default(), &Control::default());
    assert!(times.iter().all(|times| *times == 1), "each pixel comes once");
    assert!(report.complete);
    assert!(picture.bits() == expected.bits());
    let found = refinement(&report);
    let reported: Vec<_> = found.rates.iter().map(|rate| (rate.samples, rate.pixels)).collect();
    assert_eq!(reported, counts.into_iter().collect::<Vec<_>>());
    let mean = rates.iter().map(|rate| f64::from(*rate)).sum::<f64>() / rates.len() as f64;
    assert!((found.mean_samples - mean).abs() < 1e-9);
    assert!(found.unfinished_blocks == 0 && found.largest_error <= GOAL.error, "{found:?}");
}

#[test]
fn tiles_threads_crops_and_brute_force_change_no_bit_of_a_picture_to_an_error() {
    let scene = scene_from(SCENE);
    let whole = refined(&scene, &GOAL, &RenderOptions::default(), &Control::default()).0;
    for (threads, tile, method) in
        [(1, 7, Method::Exact), (3, 5, Method::Exact), (2, 64, Method::Exact), (2, 32, Method::Brute)]
    {
        let options = RenderOptions { threads, tile, method, crop: None };
        let picture = refined(&scene, &GOAL, &options, &Control::default()).0;
        assert!(picture.bits() == whole.bits(), "{options:?}");
    }
    // It cuts blocks; what they need is decided by the whole of them.
    let crop = PixelRect { x0: 21, y0: 9, x1: 70, y1: 47 };
    let options = RenderOptions { crop: Some(crop), ..RenderOptions::default() };
    let (picture, _, times) = refined(&scene, &GOAL, &options, &Control::default());
    for y in 0..50 {
        for x in 0..75 {
            let inside = crop.contains(x as i32, y as i32);
            assert_eq!(times[y * 75 + x], u32::from(inside));
            for channel in 0..picture.channels.len() {
                let expected = if inside { whole.at(channel, x, y) } else { 0.0 };
                assert_eq!(picture.at(channel, x, y).to_bits(), expected.to_bits(), "{x}, {y}");
            }
        }
    }
}

#[test]
fn true_errors_are_near_what_was_asked_for() {
    let scene = scene_from(SCENE);
    let reference = by_definition(&scene.with_samples(4), &ErrorGoal { error: 1e-9, most: 1024 }, Method::Exact).0;
    for error in [0.03, 0.015] {
        let goal = ErrorGoal { error, most: 256 };
        let (picture, report, _) = refined(&scene, &goal, &RenderOptions::default(), &Control::default());
        let (mut above, mut blocks, mut worst) = (0, 0, 0.0_f64);
        for top in (0..50).step_by(BLOCK as usize) {
            for left in (0..75).step_by(BLOCK as usize) {
                let mut sums = [0.0; 2];
                let mut count = 0.0;
                for y in top..(top + BLOCK as usize).min(50) {
                    for x in left..(left + BLOCK as usize).min(75) {
                        let difference = |channel: usize| {
                            let value = |picture: &Picture| f64::from(picture.at(channel, x, y).clamp(0.0, 1.0));
                            (value(&picture) - value(&reference)).powi(2)
                        };
                        sums[0] += (difference(0) + difference(1) + difference(2)) / 3.0;
                        sums[1] += difference(7);
                        count += 1.0;
                    }
                }
                let true_error = (sums[0].max(sums[1]) / count).sqrt();
                above += usize::from(true_error > 1.25 * error);
                worst = worst.max(true_error);
                blocks += 1;
            }
        }
        let found = refinement(&report);
        assert!(above * 8 <= blocks && worst < 2.0 * error, "{error}: {above} of {blocks}, worst {worst}\n{found:?}");
    }
}

#[test]
fn what_is_done_of_a_stopped_picture_comes_as_it_is() {
    let scene = scene_from(SCENE);
    let (stop, passes) = (AtomicBool::new(false), AtomicBool::new(false));
    // Past a half, all blocks have been rendered once.
    let progress = |share: f64| {
        if share > 0.5 {
            passes.store(true, Ordering::Relaxed);
            stop.store(true, Ordering::Relaxed);
        }
    };
    let control = Control { cancel: Some(&stop), progress: Some(&progress) };
    let (picture, report, times) = refined(&scene, &GOAL, &RenderOptions::default(), &control);
    assert!(!report.complete && passes.load(Ordering::Relaxed));
    assert!(times.iter().all(|times| *times == 1));
    let layers = measured_layers(&[Layer::Depth]);
    let first = render_with(&scene.with_samples(FIRST), &layers, &RenderOptions::default()).0;
    assert!(picture.bits() == first.bits());

    stop.store(true, Ordering::Relaxed);
    let (_, report, times) = refined(&scene, &GOAL, &RenderOptions::default(), &control);
    assert!(!report.complete && times.iter().all(|times| *times == 0));
}

#[test]
fn a_quality_is_a_number_of_samples_that_can_be_explained() {
    let place = place();
    let explained = |flags: &[&str]| place.run(&[&["explain", "scene.toml"], flags].concat()).exits(0).stdout();
    let plan = explained(&["--quality", "final"]);
    assert!(
        plan.contains("64 sobol samples per pixel\n")
            && plan.contains("final: 64 samples per pixel, sampler sobol, where the scene says 4 and stratified"),
        "{plan}"
    );
    assert!(plan.contains("times the time of draft") && plan.contains("of the lines' area wrong"), "{plan}");
    assert!(!explained(&[]).contains("quality"));
    let own = Settings::of(&scene_from(SCENE));
    let text = Quality::Preview.explain(&own);
    assert!(
        text.starts_with("quality         preview: 16 samples per pixel, sampler sobol, where the scene says 4 and stratified; all else"),
        "{text}"
    );
    assert!(!Quality::Draft.explain(&own).contains("times the time of draft"), "it is the draft");
    let uncorrected = Settings { width_compensation: false, ..own };
    assert_eq!(Quality::Final.settings(&uncorrected), Settings { samples: 64, sampler: Sampler::Sobol, ..own });
    // What is set by itself has the last word.
    assert!(explained(&["--quality", "draft", "--set", "render.samples=9"]).contains("9 sobol samples per pixel\n"));
    let off = explained(&["--quality", "draft", "--set", "lines.width_compensation=false"]);
    assert!(off.contains("which the scene turns off"), "{off}");
    place.run(&["explain", "scene.toml", "--quality", "best"]).exits(2).says("draft").says("final");

    place.run(&["render", "scene.toml", "--quality", "draft", "-o", "a.png"]).exits(0);
    place.run(&["render", "scene.toml", "--samples", "4", "--set", "render.sampler=sobol", "-o", "b.png"]).exits(0);
    assert!(read(&place, "a.png") == read(&place, "b.png"));
    place
        .run(&["render", "scene.toml", "--quality", "draft", "--set", "render.sampler=stratified", "-o", "c.png"])
        .exits(0);
    place.run(&["render", "scene.toml", "--samples", "4", "-o", "d.png"]).exits(0);
    assert!(read(&place, "c.png") == read(&place, "d.png"), "what is set by itself has the last word");
}

fn place() -> Workplace {
    let place = Workplace::new();
    place.file("scene.toml", SCENE);
    place
}

fn read(place: &Workplace, name: &str) -> Vec<u8> {
    std::fs::read(place.folder.path().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

#[test]
fn a_picture_within_a_time_can_be_made_again_with_its_samples() {
    let place = place();
    let run = place
        .run(&["render", "scene.toml", "--size", "24x16", "--time", "2s", "-o", "a.png", "--stats", "stats.json"])
        .exits(0)
        .says("samples per pixel fit into 2 s")
        .says("makes the same picture");
    let said = run.stderr();
    let samples = said.split("--samples ").nth(1).and_then(|rest| rest.split(' ').next()).expect("it is said");
    place.run(&["render", "scene.toml", "--size", "24x16", "--samples", samples, "-o", "b.png"]).exits(0);
    assert!(read(&place, "a.png") == read(&place, "b.png"));
    let stats: serde_json::Value = serde_json::from_slice(&read(&place, "stats.json")).expect("it is JSON");
    let choice = &stats["sampling"]["time"];
    assert_eq!((choice["samples"].to_string().as_str(), &choice["asked_seconds"]), (samples, &2.0.into()));
}

#[test]
fn a_picture_to_an_error_says_what_it_took() {
    let place = place();
    place
        .run(&["render", "scene.toml", "--error", "0.02", "-o", "a.png", "-o", "a.exr", "--stats", "stats.json"])
        .exits(0)
        .says("samples per pixel: 8 in ")
        .says("in the mean")
        .says("wrote a.png");
    let stats: serde_json::Value = serde_json::from_slice(&read(&place, "stats.json")).expect("it is JSON");
    let found = &stats["sampling"]["error"];
    assert!(found["rates"].as_array().is_some_and(|rates| rates.len() > 1) && found["error"] == 0.02, "{found}");
    // The PNG of the same run as the EXR: both show the same.
    place.run(&["render", "scene.toml", "--error", "0.02", "-o", "b.png", "--tile", "11", "--threads", "1"]).exits(0);
    assert!(read(&place, "a.png") == read(&place, "b.png"));
    // No scene has too few lines for it.
    place.run(&["render", "scene.toml", "--error", "0.05", "--lines", "off", "-o", "c.png"]).exits(0);
}

#[test]
fn what_cannot_be_chosen_is_told() {
    let place = place();
    let refused = |flags: &[&str], message: &str| {
        place.run(&[&["render", "scene.toml", "-o", "none.png"], flags].concat()).exits(2).says(message);
    };
    refused(&["--time", "soon"], "write it as 10, 10s or 1m30");
    refused(&["--time", "0"], "is not a time above 0");
    refused(&["--time=-1"], "is not a time above 0");
    refused(&["--time", "5", "--samples", "4"], "cannot be used with");
    refused(&["--time", "5", "--error", "0.1"], "cannot be used with");
    refused(&["--time", "5", "--quality", "draft"], "cannot be used with");
    refused(&["--error", "0.1", "--samples", "4"], "cannot be used with");
    refused(&["--error", "0"], "above 0 and below 1");
    refused(&["--error", "-0.1"], "above 0 and below 1");
    refused(&["--error", "nan"], "above 0 and below 1");
    refused(&["--error", "1e-5"], "is the least");
    place
        .run(&["render", "scene.toml", "--time", "60", "-o", "no/such/folder.png"])
        .exits(1)
        .says("no/such/folder.png");
    let too_short = ["render", "scene.toml", "--size", "2000x1500", "--time", "0.001", "-o", "none.png"];
    place.run(&too_short).exits(1).says("too short for this picture").says("give --time").says("--size");
    assert!(!place.folder.path().join("none.png").exists());
}
