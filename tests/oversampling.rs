//! More samples where lines are: what the picture is, that it is right on average, and what it costs.

use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use tusche::film::{FilmTile, Layer};
use tusche::line::Method;
use tusche::plan::{Oversampling, Plan};
use tusche::render::oversample::Oversampled;
use tusche::render::stats::Sampling;
use tusche::render::why::why;
use tusche::render::{Control, RenderOptions, Report, render};
use tusche::sample::PixelRect;
use tusche::scene::Scene;
use tusche::shade::{Host, Shaders};
use tusche::study::truth::coverage;

use crate::common::{Picture, Workplace, render_with, root, scene_from};

/// A thin box and a mirror above much empty ground, lit so that shadow rays are traced.
const SCENE: &str = r#"
[render]
size = [121, 75]
samples = 4
line_oversampling = 4
# So that no two rates have the same bits anywhere.
background = { bottom = [0.9, 0.8, 0.7], top = [0.4, 0.6, 0.7] }
[camera]
position = [0.0, 1.0, 9.0]
target = [0.6, 0.4, 0.0]
[lines]
width = 2.0
normal = 30.0
[[objects]]
shape = "box"
size = [0.8, 1.0, 0.8]
rotate = [10.0, 27.0, 0.0]
translate = [-1.1, 0.5, 0.0]
material = "ink"
[[objects]]
shape = "sphere"
translate = [0.4, 0.6, 0.0]
radius = 0.6
material = "mirror"
[materials.ink]
shader = "builtin:default"
[materials.mirror]
shader = "builtin:mirror"
"#;
const SIZE: [usize; 2] = [121, 75];
const BLOCK: usize = Oversampling::BLOCK as usize;
const LAYERS: [Layer; 3] = [Layer::Rgba, Layer::Line, Layer::Depth];
/// The channel of coverage among those of [`LAYERS`].
const COVERAGE: usize = 7;

fn picture_of(scene: &Scene) -> (Picture, Report) {
    render_with(scene, &LAYERS, &RenderOptions::default())
}

fn found(report: &Report) -> &Oversampled {
    match &report.stats.sampling {
        Some(Sampling::Lines(found)) => found,
        other => panic!("no oversampling: {other:?}"),
    }
}

/// The pixels of every block of a picture.
fn blocks([width, height]: [usize; 2]) -> Vec<Vec<(usize, usize)>> {
    let corners = (0..height).step_by(BLOCK).flat_map(|top| (0..width).step_by(BLOCK).map(move |left| (left, top)));
    corners
        .map(|(left, top)| {
            let right = (left + BLOCK).min(width);
            (top..(top + BLOCK).min(height)).flat_map(|y| (left..right).map(move |x| (x, y))).collect()
        })
        .collect()
}

/// Whether two pictures have the same bits in a block.
fn same(a: &Picture, b: &Picture, block: &[(usize, usize)]) -> bool {
    let bits = |picture: &Picture, channel: usize, (x, y): (usize, usize)| picture.at(channel, x, y).to_bits();
    (0..a.channels.len()).all(|channel| block.iter().all(|place| bits(a, channel, *place) == bits(b, channel, *place)))
}

#[test]
fn every_block_is_that_of_the_picture_with_its_rate() {
    let scene = scene_from(SCENE);
    let (picture, report) = picture_of(&scene);
    let [low, high] = [4, 16].map(|rate| picture_of(&scene.with_samples(rate)).0);
    let mut pixels = BTreeMap::new();
    let mut lined = 0;
    for block in blocks(SIZE) {
        let has_ink = |picture: &Picture| block.iter().any(|(x, y)| picture.at(COVERAGE, *x, *y) > 0.0);
        let is_high = !same(&picture, &low, &block);
        assert!(!is_high || same(&picture, &high, &block), "the block of {:?} is of neither", block[0]);
        // Nothing in this scene is so small that a pilot misses it.
        assert!(is_high || !has_ink(&high), "the block of {:?} has lines", block[0]);
        *pixels.entry(if is_high { 16 } else { 4 }).or_insert(0) += block.len() as u64;
        lined += usize::from(is_high);
    }
    let found = found(&report);
    let rates: BTreeMap<u32, u64> = found.rates.iter().map(|rate| (rate.samples, rate.pixels)).collect();
    assert_eq!(rates, pixels);
    assert_eq!((found.lined_blocks, found.blocks), (lined, blocks(SIZE).len()));
    assert!(lined > 5 && found.blocks - lined > 5, "{found:?}");
    assert!(report.complete);
}

#[test]
fn tiles_threads_crops_and_brute_force_change_no_bit() {
    let scene = scene_from(SCENE);
    let whole = picture_of(&scene).0;
    for (threads, tile, method) in
        [(1, 7, Method::Exact), (3, 5, Method::Exact), (2, 64, Method::Exact), (2, 32, Method::Brute)]
    {
        let options = RenderOptions { threads, tile, method, crop: None };
        let (picture, _) = render_with(&scene, &LAYERS, &options);
        assert!(picture.bits() == whole.bits(), "{options:?}");
    }
    for crop in [PixelRect { x0: 21, y0: 9, x1: 70, y1: 47 }, PixelRect { x0: 47, y0: 31, x1: 49, y1: 33 }] {
        let options = RenderOptions { crop: Some(crop), ..RenderOptions::default() };
        let (picture, report) = render_with(&scene, &LAYERS, &options);
        for (y, x) in (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (y, x))) {
            for channel in 0..picture.channels.len() {
                let expected = if crop.contains(x as i32, y as i32) { whole.at(channel, x, y) } else { 0.0 };
                assert_eq!(picture.at(channel, x, y).to_bits(), expected.to_bits(), "{x}, {y}");
            }
        }
        assert_eq!(found(&report).rates.iter().map(|rate| rate.pixels).sum::<u64>(), crop.pixels() as u64);
    }
}

#[test]
fn rays_are_those_of_the_pilot_and_of_the_rates() {
    let scene = scene_from(SCENE);
    // Tiles of one pixel trace nothing but what is needed.
    let options = RenderOptions { tile: 1, ..RenderOptions::default() };
    let (picture, report) = render_with(&scene, &LAYERS, &options);
    let low = picture_of(&scene.with_samples(4)).0;
    let (shaders, _) = Shaders::compile(&scene, &Host::new()).unwrap_or_else(|faults| panic!("{faults}"));
    let lined: Vec<_> = blocks(SIZE).into_iter().map(|block| (!same(&picture, &low, &block), block)).collect();
    let expected = |rate: u32, is_lined: bool| {
        let plan = Plan::new(&scene.with_samples(rate), &shaders, &LAYERS);
        let margin = plan.lines.as_ref().expect("there are lines").reach + plan.filter.reach();
        let mut needed = vec![false; SIZE[0] * SIZE[1]];
        for (x, y) in lined.iter().filter(|(lined, _)| *lined == is_lined).flat_map(|(_, block)| block) {
            let near =
                |at: usize, side: usize| at.saturating_sub(margin as usize)..(at + margin as usize + 1).min(side);
            for y in near(*y, SIZE[1]) {
                needed[y * SIZE[0]..][near(*x, SIZE[0])].fill(true);
            }
        }
        needed.iter().filter(|needed| **needed).count() as u64 * u64::from(rate)
    };
    let found = found(&report);
    let pixels = (SIZE[0] * SIZE[1]) as u64;
    assert_eq!((found.pilot_samples, found.pilot_rays.camera), (1, pixels));
    let rays = report.stats.rays;
    assert_eq!(rays.camera - found.pilot_rays.camera, expected(4, false) + expected(16, true));
    assert_eq!(report.stats.samples, rays.camera);
    // A pilot looks for lines; it need not know how bright they are.
    assert!(found.pilot_rays.shadow == 0 && rays.shadow > 0 && found.pilot_rays.reflection > 0, "{found:?}");

    let (_, plain) = picture_of(&scene.with_samples(4));
    assert!(plain.stats.sampling.is_none() && plain.stats.rays.camera == 4 * pixels);
    // Without lines there is nothing to look for.
    let (_, colors) = render_with(&scene, &[Layer::Color], &RenderOptions::default());
    assert!(colors.stats.sampling.is_none() && colors.stats.rays.camera == 4 * pixels);
}

/// Discs so small that one sample per pixel mostly misses them.
const CRUMBS: &str = r#"
[render]
size = [64, 48]
samples = 1
line_oversampling = 9
filter = "box"
filter_radius = 0.5
background = "transparent"
[camera]
projection = "orthographic"
height = 48.0
position = [0.0, 0.0, 100.0]
target = [0.0, 0.0, 0.0]
[lines]
width = 0.7
[materials.ink]
shader = "builtin:ink"
params = { ink_width = 0.7 }
"#;
const RADIUS: f64 = 0.3;
const SEGMENTS: u32 = 64;

/// The crumbs, one in every block.
fn crumbs() -> Scene {
    let mut text = CRUMBS.to_owned();
    for (row, column) in (0..3).flat_map(|row| (0..4).map(move |column| (row, column))) {
        // Not all at the same place of their pixels.
        let [x, y] = [f64::from(column) * 16.0 - 24.0 + 0.17 * f64::from(row), f64::from(row) * 16.0 - 16.0 + 0.31];
        text += &format!(
            "[[objects]]\nshape = \"disc\"\nradius = {RADIUS}\nsegments = {SEGMENTS}\nrotate = [90.0, 0.0, 0.0]\n\
             translate = [{x}, {y}, 0.0]\nmaterial = \"ink\"\n"
        );
    }
    scene_from(&text)
}

/// Mean and standard error.
fn mean_of(values: &[f64]) -> (f64, f64) {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let square = values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / (count - 1.0);
    (mean, (square / count).sqrt())
}

/// The area of small things is right on average, and how much their lines cover is a mean of what pictures of either rate show, the
/// rate being decided by samples that know nothing of them. If the picture's own samples decided, neither would hold.
#[test]
fn what_a_pilot_decides_is_right_on_average() {
    const LAYERS: [Layer; 2] = [Layer::Color, Layer::Line];
    let scene = crumbs();
    let blocks = blocks([64, 48]);
    let truth = f64::from(SEGMENTS) / 2.0 * RADIUS * RADIUS * (std::f64::consts::TAU / f64::from(SEGMENTS)).sin();
    // Areas and line coverage: of the picture, of one whose own samples decide, and of plain ones of either rate.
    let (mut areas, mut hasty_areas) = (Vec::new(), Vec::new());
    let (mut lines, mut low_lines, mut high_lines, mut lined) = (Vec::new(), Vec::new(), Vec::new(), 0.0);
    for seed in 0..80 {
        let scene = scene.with_seed(seed);
        let (own, report) = render_with(&scene, &LAYERS, &RenderOptions::default());
        let [low, high] =
            [1, 9].map(|rate| render_with(&scene.with_samples(rate), &LAYERS, &RenderOptions::default()).0);
        lined += found(&report).lined_blocks as f64;
        for block in &blocks {
            let sum = |picture: &Picture, channel: usize| -> f64 {
                block.iter().map(|(x, y)| f64::from(picture.at(channel, *x, *y))).sum()
            };
            areas.push(sum(&own, 3));
            // Each block has a whole crumb, whose line reaches no other block.
            let saw = sum(&low, COVERAGE) > 0.0;
            hasty_areas.push(sum(if saw { &high } else { &low }, 3));
            lines.push(sum(&own, COVERAGE));
            low_lines.push(sum(&low, COVERAGE));
            high_lines.push(sum(&high, COVERAGE));
        }
    }
    let share = lined / areas.len() as f64;
    assert!((0.1..0.9).contains(&share), "the pilot finds some crumbs and misses some: {share}");
    let (area, error) = mean_of(&areas);
    assert!((area - truth).abs() < 3.5 * error, "{area} ± {error} for {truth}");
    let (hasty, error) = mean_of(&hasty_areas);
    assert!(truth - hasty > 10.0 * error, "samples that decide for themselves would be caught: {hasty} ± {error}");

    let [own, low, high] = [&lines, &low_lines, &high_lines].map(|values| mean_of(values));
    // The share that was high is itself a matter of luck, but the same one in the picture and in what is expected of it.
    let expected = share * high.0 + (1.0 - share) * low.0;
    let error = own.1.hypot(share * high.1).hypot((1.0 - share) * low.1);
    assert!((own.0 - expected).abs() < 3.5 * error, "{own:?} for {expected} ± {error}");
}

/// The lines that a scene declares, of balls and discs in perspective: the ink is what it should be.
#[test]
fn the_ink_of_declared_lines_is_as_much_as_it_should_be() {
    let text = std::fs::read_to_string(root().join("scenes/truth_disc.toml")).expect("the scene is there");
    let mut builder = scene_from(&text).into_builder();
    builder.render.size = [160, 90];
    builder.render.samples = 9;
    builder.render.line_oversampling = 4;
    let scene = builder.build().unwrap_or_else(|faults| panic!("{faults}"));
    let (shaders, _) = Shaders::compile(&scene, &Host::new()).unwrap_or_else(|faults| panic!("{faults}"));
    let plan = Plan::new(&scene, &shaders, &[Layer::Line]);
    let truth = coverage(scene.truth().expect("it declares lines"), scene.camera(), [160, 90], &plan.filter);
    let truth: f64 = truth.iter().map(|coverage| f64::from(*coverage)).sum();
    let inks: Vec<f64> = (0..4)
        .map(|seed| {
            let (picture, report) = render_with(&scene.with_seed(seed), &[Layer::Line], &RenderOptions::default());
            assert!(found(&report).lined_blocks > 10);
            picture.channels[3].iter().map(|coverage| f64::from(*coverage)).sum()
        })
        .collect();
    let (ink, error) = mean_of(&inks);
    // The correction of widths is an approximation: DESIGN 3.9 states it to 2.7 %.
    assert!((ink / truth - 1.0).abs() < 0.02 + 3.0 * error / truth, "{ink} ± {error} for {truth}");
}

#[test]
fn a_stopped_picture_has_only_what_is_done() {
    let scene = scene_from(SCENE);
    let (shaders, _) = Shaders::compile(&scene, &Host::new()).unwrap_or_else(|faults| panic!("{faults}"));
    let plan = Plan::new(&scene, &shaders, &LAYERS);
    let run = |until: f64| {
        let stop = AtomicBool::new(until <= 0.0);
        let (times, shares) = (Mutex::new(vec![0_u32; SIZE[0] * SIZE[1]]), Mutex::new(Vec::new()));
        let progress = |share: f64| {
            shares.lock().expect("no thread panics with it").push(share);
            stop.fetch_or(share >= until, Ordering::Relaxed);
        };
        let emit = |tile: &FilmTile| {
            let mut times = times.lock().expect("no thread panics with it");
            for (x, y) in (tile.rect.y0..tile.rect.y1).flat_map(|y| (tile.rect.x0..tile.rect.x1).map(move |x| (x, y))) {
                times[y as usize * SIZE[0] + x as usize] += 1;
            }
            Ok(())
        };
        let control = Control { cancel: Some(&stop), progress: Some(&progress) };
        let options = RenderOptions { threads: 1, ..RenderOptions::default() };
        let report =
            render(&scene, &shaders, &plan, &options, &control, &emit).unwrap_or_else(|fault| panic!("{fault}"));
        let shares = shares.into_inner().expect("no thread panics with it");
        assert!(shares.is_sorted() && shares.iter().all(|share| (0.0..=1.0 + 1e-9).contains(share)), "{shares:?}");
        let times = times.into_inner().expect("no thread panics with it");
        assert!(times.iter().all(|times| *times <= 1), "each pixel comes at most once");
        (report.complete, times.iter().filter(|times| **times == 1).count())
    };
    let all = SIZE[0] * SIZE[1];
    assert_eq!((run(0.0), run(0.02), run(2.0)), ((false, 0), (false, 0), (true, all)));
    let (complete, done) = run(0.6);
    assert!(!complete && done > 0 && done < all, "{done}");
}

#[test]
fn a_place_is_explained_with_the_samples_that_it_has() {
    let scene = scene_from(SCENE);
    let (shaders, _) = Shaders::compile(&scene, &Host::new()).unwrap_or_else(|faults| panic!("{faults}"));
    let (picture, _) = picture_of(&scene);
    let low = picture_of(&scene.with_samples(4)).0;
    for block in blocks(SIZE).iter().step_by(3) {
        let (x, y) = block[block.len() / 2];
        let (explained, _) = why(&scene, &shaders, [x as f32, y as f32]).unwrap_or_else(|fault| panic!("{fault}"));
        assert_eq!(explained.samples, if same(&picture, &low, block) { 4 } else { 16 }, "{x}, {y}");
    }
}

fn place() -> Workplace {
    let place = Workplace::new();
    place.file("scene.toml", SCENE);
    place
}

#[test]
fn what_it_does_is_told() {
    let place = place();
    let explained = |flags: &[&str]| place.run(&[&["explain", "scene.toml"], flags].concat()).exits(0).stdout();
    let row = "oversampling    16 samples per pixel in blocks of 16 x 16 pixels in which lines are found, 4 elsewhere; to find them costs \
               1 sample per pixel";
    assert!(explained(&[]).contains(row), "{}", explained(&[]));
    assert!(explained(&["--quality", "final"]).contains("oversampling    256 samples per pixel"));
    assert!(explained(&["--lines", "off"]).contains("oversampling    none: no line can be seen"));
    assert!(!explained(&["--set", "render.line_oversampling=1"]).contains("oversampling"));

    place
        .run(&["render", "scene.toml", "-o", "a.png", "-o", "a.exr", "--stats", "stats.json"])
        .exits(0)
        .says("samples per pixel: 4 in ")
        .says("blocks have lines, as a pilot of 1 found")
        .says("wrote a.png");
    let stats = std::fs::read(place.folder.path().join("stats.json")).expect("it is there");
    let stats: serde_json::Value = serde_json::from_slice(&stats).expect("it is JSON");
    let found = &stats["sampling"]["lines"];
    assert_eq!((found["pilot_samples"].as_u64(), found["pilot_rays"]["camera"].as_u64()), (Some(1), Some(121 * 75)));
    assert!(found["rates"].as_array().is_some_and(|rates| rates.len() == 2), "{found}");
    let header = std::fs::read(place.folder.path().join("a.exr")).expect("it is there");
    assert!(String::from_utf8_lossy(&header).contains("line_oversampling"));
}

#[test]
fn what_does_not_go_together_is_told() {
    let place = place();
    let run = |flags: &[&str]| place.run(&[&["render", "scene.toml", "-o", "none.png"], flags].concat());
    run(&["--time", "5"])
        .exits(1)
        .says("--time finds one number of samples for the whole picture")
        .says("add --set render.line_oversampling=1");
    assert!(!place.folder.path().join("none.png").exists());
    let off = ["--set", "render.line_oversampling=1"];
    run(&[&["--error", "0.05", "--size", "40x25"][..], &off].concat()).exits(0);
    run(&["--error", "0.05", "--size", "40x25"]).exits(0).says("`line_oversampling` does nothing here");
    run(&["--samples", "9000"]).exits(1).says("36000 samples per pixel: 16384 are the most");
    run(&["--set", "render.line_oversamplin=2"]).exits(1).says("line_oversampling");
}
