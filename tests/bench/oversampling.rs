//! What it buys to spend samples where lines are: `cargo bench --bench oversampling -- [--seeds N] [--reference N] [--width N] [SCENE...]`.
//!
//! Renders scenes (or those named), 320 px wide unless they declare their lines, on one thread: with as many samples everywhere at many rates, with
//! `line_oversampling`, and to an error (`--error`). Each picture is compared with the lines that the scene declares, else with one of
//! 1024 samples; colours always with the latter. What plain sampling of the same CPU time would come to, and what plain sampling of the
//! same error would take, is read off the plain rates by straight lines between their logarithms.

use std::path::{Path, PathBuf};
use std::sync::Mutex;

use tusche::files::FileStore;
use tusche::film::{FilmTile, Layer};
use tusche::plan::Plan;
use tusche::render::{Control, ErrorGoal, RenderOptions, Report, render, render_to_error};
use tusche::scene::{Scene, SceneBuilder, file};
use tusche::shade::{Host, Shaders};
use tusche::study::truth::coverage;

const SCENES: [&str; 4] = ["fig1_robot", "fig4_default", "truth_disc", "truth_edges"];
const PLAIN: [u32; 8] = [4, 9, 16, 25, 36, 64, 100, 144];
const OVERSAMPLED: [[u32; 2]; 8] = [[1, 4], [1, 16], [4, 4], [4, 9], [4, 16], [9, 4], [16, 4], [16, 9]];
const GOALS: [f64; 3] = [0.04, 0.02, 0.01];
/// Coverage in [`LAYERS`].
const COVERAGE: usize = 7;
const LAYERS: [Layer; 2] = [Layer::Rgba, Layer::Line];

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    // `cargo test --all-targets` runs benchmarks too, without this flag.
    if !arguments.iter().any(|argument| argument == "--bench") {
        return;
    }
    let number = |name: &str, default: u32| {
        let place = arguments.iter().position(|argument| argument == name);
        place.and_then(|place| arguments.get(place + 1)?.parse().ok()).unwrap_or(default)
    };
    let effort = [number("--seeds", 2), number("--reference", 1024), number("--width", 320)];
    let named = arguments.iter().filter(|argument| argument.ends_with(".toml"));
    let mut scenes: Vec<PathBuf> = named.map(PathBuf::from).collect();
    if scenes.is_empty() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
        scenes.extend(SCENES.map(|name| folder.join(name).with_extension("toml")));
    }
    println!(
        "| scene | samples | camera rays a pixel | CPU s | lines wrong | RMSE | lines wrong at the same time, plain | ratio | \
         CPU s for the same lines, plain | ratio | CPU s for the same RMSE, plain | ratio |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
    for path in scenes {
        measure(&path, effort);
    }
}

/// What a picture cost and how wrong it is.
#[derive(Clone, Copy, Debug, Default)]
struct Cost {
    rays: f64,
    seconds: f64,
    lines: f64,
    rmse: f64,
}

fn measure(path: &Path, [seeds, reference, wide]: [u32; 3]) {
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let (mut builder, _) = file::load(path, &FileStore::new(), &[], &file::LoadOptions::default())
        .unwrap_or_else(|faults| panic!("{faults}"));
    let [width, height] = builder.render.size;
    // Declared lines are those of the scene's own size.
    if builder.truth.is_none() {
        builder.render.size = [wide, (wide * height / width).max(1)];
    }
    let scene = built(&builder, reference, 1, 1 << 50);
    let (shaders, _) = Shaders::compile(&scene, &Host::new()).unwrap_or_else(|faults| panic!("{faults}"));
    let mut reference = planes(&scene, &shaders, None).0;
    if let Some(truth) = scene.truth() {
        let filter = Plan::new(&scene, &shaders, &LAYERS).filter;
        reference[COVERAGE] = coverage(truth, scene.camera(), scene.render().size, &filter);
    }
    let cost = |samples: u32, factor: u32, goal: Option<f64>| {
        let each = (0..seeds).map(|seed| {
            let scene = built(&builder, samples, factor, 1000 + u64::from(seed));
            let (planes, report) = planes(&scene, &shaders, goal);
            judged(&reference, &planes, &report)
        });
        let sum = each.fold(Cost::default(), |sum, one| Cost {
            rays: sum.rays + one.rays,
            seconds: sum.seconds + one.seconds,
            lines: sum.lines + one.lines,
            rmse: sum.rmse + one.rmse,
        });
        let count = f64::from(seeds.max(1));
        Cost { rays: sum.rays / count, seconds: sum.seconds / count, lines: sum.lines / count, rmse: sum.rmse / count }
    };
    let plain = PLAIN.map(|samples| cost(samples, 1, None));
    let row = |samples: String, found: Cost, compared: bool| {
        let Cost { rays, seconds, lines, rmse } = found;
        let mut cells =
            format!("| {name} | {samples} | {rays:.1} | {seconds:.2} | {:.2} % | {rmse:.4} |", 100.0 * lines);
        if compared {
            let same_time = between(&plain, |cost| cost.seconds, |cost| cost.lines, seconds);
            let for_lines = between(&plain, |cost| cost.lines, |cost| cost.seconds, lines);
            let for_rmse = between(&plain, |cost| cost.rmse, |cost| cost.seconds, rmse);
            cells += &format!(
                " {:.2} % | {:.2} | {for_lines:.2} | {:.2} | {for_rmse:.2} | {:.2} |",
                100.0 * same_time,
                same_time / lines,
                for_lines / seconds,
                for_rmse / seconds
            );
        } else {
            cells += " | | | | | |";
        }
        println!("{cells}");
    };
    for (samples, found) in PLAIN.iter().zip(&plain) {
        row(samples.to_string(), *found, false);
    }
    for [samples, factor] in OVERSAMPLED {
        row(format!("{samples} × {factor}"), cost(samples, factor, None), true);
    }
    for goal in GOALS {
        row(format!("--error {goal}"), cost(4, 1, Some(goal)), true);
    }
}

fn built(builder: &SceneBuilder, samples: u32, factor: u32, seed: u64) -> Scene {
    let mut builder = builder.clone();
    builder.render.samples = samples;
    builder.render.line_oversampling = factor;
    builder.render.seed = seed;
    builder.build().unwrap_or_else(|faults| panic!("{faults}"))
}

fn planes(scene: &Scene, shaders: &Shaders, goal: Option<f64>) -> (Vec<Vec<f32>>, Report) {
    let plan = Plan::new(scene, shaders, &LAYERS);
    let [width, height] = scene.render().size.map(|side| side as usize);
    let planes = Mutex::new(vec![vec![0.0_f32; width * height]; 8]);
    let emit = |tile: &FilmTile| {
        let mut planes = planes.lock().expect("no thread panics with it");
        for (plane, values) in planes.iter_mut().zip(&tile.channels) {
            for (y, values) in (tile.rect.y0 as usize..).zip(values.chunks_exact(tile.rect.width() as usize)) {
                let start = y * width + tile.rect.x0 as usize;
                plane[start..start + values.len()].copy_from_slice(values);
            }
        }
        Ok(())
    };
    let options = RenderOptions { threads: 1, ..RenderOptions::default() };
    let control = Control::default();
    let report = match goal {
        None => render(scene, shaders, &plan, &options, &control, &emit),
        Some(error) => {
            let goal = ErrorGoal { error, most: ErrorGoal::MOST };
            render_to_error(scene, shaders, &plan, &goal, &options, &control, &emit)
        }
    };
    let report = report.unwrap_or_else(|fault| panic!("{fault}"));
    (planes.into_inner().expect("no thread panics with it"), report)
}

fn judged(reference: &[Vec<f32>], found: &[Vec<f32>], report: &Report) -> Cost {
    let pixels = reference[0].len() as f64;
    let ink: f64 = reference[COVERAGE].iter().map(|coverage| f64::from(*coverage)).sum();
    let off = |a: &f32, b: &f32| f64::from(*a) - f64::from(*b);
    let wrong: f64 = reference[COVERAGE].iter().zip(&found[COVERAGE]).map(|(a, b)| off(a, b).abs()).sum();
    let shown = |planes: &[Vec<f32>], axis: usize, i: usize| (planes[axis][i] + 1.0 - planes[3][i]).clamp(0.0, 1.0);
    let square = |axis: usize, i: usize| off(&shown(reference, axis, i), &shown(found, axis, i)).powi(2);
    let squares: f64 = (0..reference[0].len()).map(|i| (0..3).map(|axis| square(axis, i)).sum::<f64>() / 3.0).sum();
    let seconds = &report.stats.seconds;
    Cost {
        rays: report.stats.rays.camera as f64 / pixels,
        seconds: seconds.trace + seconds.shade + seconds.lines + seconds.film,
        lines: wrong / ink,
        rmse: (squares / pixels).sqrt(),
    }
}

/// What the plain pictures have of one thing at a value of another, by straight lines between logarithms; beyond their ends, the
/// line of the last two.
fn between(plain: &[Cost], at: fn(&Cost) -> f64, of: fn(&Cost) -> f64, value: f64) -> f64 {
    let points: Vec<[f64; 2]> = plain.iter().map(|cost| [at(cost).ln(), of(cost).ln()]).collect();
    let rises = points[points.len() - 1][0] > points[0][0];
    let value = value.ln();
    let place = points.iter().position(|[x, _]| (*x >= value) == rises).unwrap_or(points.len() - 1);
    let [[x0, y0], [x1, y1]] = [points[place.max(1) - 1], points[place.max(1)]];
    (y0 + (y1 - y0) * (value - x0) / (x1 - x0)).exp()
}
