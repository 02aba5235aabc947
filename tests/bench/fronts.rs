//! Whether `--quality` chooses points on the front: `cargo bench --bench fronts -- [--write] [--keep=DIR] [SCENE...]`.
//!
//! Studies every shipped scene (or those named), 112 px wide, with all knobs that matter to it but the line method, and tells for each preset what it
//! costs, how far it is from the reference, and how far it lies behind the front of accuracy against CPU time: the largest factor
//! by which another point of the study is both faster and more accurate, over all four measures of error. `--write` writes
//! `src/study/fronts.csv`, from which `tusche explain --quality` takes its figures. It takes minutes, and is best done on a
//! machine that does nothing else. `--keep` leaves the studies and their pages in a folder; what is there of a scene is not measured again.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use tusche::files::FileStore;
use tusche::scene::file;
use tusche::shade::{Host, Shaders};
use tusche::study::report::{
    self,
    summary::{MEASURES, Summary},
};
use tusche::study::{Knob, StudyControl, StudyOptions, study};

const WIDTH: u32 = 112;
/// Samples per pixel of the reference: over six times those of the last preset.
const REFERENCE: u32 = 400;
/// More than this behind the front is a defect of the presets.
const ALLOWED: f64 = 1.10;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    // `cargo test --all-targets` runs benchmarks too, without this flag.
    if !arguments.iter().any(|argument| argument == "--bench") {
        return;
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut scenes: Vec<PathBuf> =
        arguments.iter().filter(|argument| !argument.starts_with("--")).map(PathBuf::from).collect();
    if scenes.is_empty() {
        let all = std::fs::read_dir(root.join("scenes")).expect("the scenes folder is there");
        scenes.extend(
            all.flatten().map(|entry| entry.path()).filter(|path| path.extension().is_some_and(|end| end == "toml")),
        );
        scenes.sort();
    }
    println!(
        "| scene | preset | CPU s/Mpx | line coverage error | position, px | FLIP | RMSE | behind the front | by |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    let names = MEASURES.map(|measure| measure.name).join(",");
    let mut table = format!("scene,quality,samples,cpu_seconds_per_megapixel,{names},behind_front\n");
    let keep = arguments.iter().find_map(|argument| argument.strip_prefix("--keep=")).map(PathBuf::from);
    let temporary = tempfile::tempdir().expect("a temporary folder can be made");
    let folder = keep.as_deref().unwrap_or(temporary.path());
    let mut worst = 0.0_f64;
    for path in scenes {
        worst = worst.max(measure(&path, folder, &mut table));
    }
    println!("\nThe worst is {worst:.2}; at most {ALLOWED:.2} is allowed.");
    if arguments.iter().any(|argument| argument == "--write") {
        std::fs::write(root.join("src/study/fronts.csv"), table).expect("the table can be written");
    }
    if worst > ALLOWED {
        std::process::exit(1);
    }
}

/// Adds a scene's rows to the table; how far its presets lie behind the front at most.
fn measure(path: &Path, folder: &Path, table: &mut String) -> f64 {
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let (mut builder, _) = file::load(path, &FileStore::new(), &[], &file::LoadOptions::default())
        .unwrap_or_else(|faults| panic!("{faults}"));
    let [width, height] = builder.render.size;
    builder.render.size = [WIDTH, (WIDTH * height / width).max(1)];
    let megapixels = f64::from(WIDTH * builder.render.size[1]) * 1e-6;
    let scene = builder.build().unwrap_or_else(|faults| panic!("{faults}"));
    let (shaders, _) = Shaders::compile(&scene, &Host::new()).unwrap_or_else(|faults| panic!("{faults}"));
    let folder = folder.join(&name);
    // Older methods take several times as long for more error; see README.
    let knobs = Knob::ALL.into_iter().filter(|knob| *knob != Knob::Method).collect();
    let options = StudyOptions {
        title: name.clone(),
        knobs,
        reference: REFERENCE,
        threads: 1,
        widths: false,
        ..StudyOptions::default()
    };
    let found = study(scene, &shaders, &folder, &options, &StudyControl::default())
        .unwrap_or_else(|faults| panic!("{name}: {faults}"));
    report::write(&found, &folder).unwrap_or_else(|fault| panic!("{name}: {fault}"));
    let summary = Summary::new(&found);
    let mut worst = 0.0_f64;
    for (quality, index) in &found.ladder.presets {
        let Some(point) = summary.points.iter().find(|point| point.index == *index) else {
            panic!("{name}: {} was not measured", quality.name());
        };
        let errors = MEASURES.map(|measure| point.error(measure.of).map_or(f64::NAN, |error| error.mean));
        let behind = MEASURES.map(|measure| summary.behind_front(point.index, &measure));
        let most = behind.into_iter().fold(0.0, f64::max);
        let by = &MEASURES[behind.iter().position(|behind| *behind == most).unwrap_or_default()];
        let rival = summary.rival(point.index, by).map_or("", |(rival, _)| &rival.name);
        worst = worst.max(most);
        let seconds = point.cpu.median / megapixels;
        println!(
            "| {name} | {} | {seconds:.2} | {:.2} % | {:.3} | {:.4} | {:.4} | {most:.2} | {}, {rival} |",
            quality.name(),
            100.0 * errors[0],
            errors[1],
            errors[2],
            errors[3],
            by.name
        );
        let errors = errors.map(|error| format!("{error:.5}")).join(",");
        let _ = writeln!(table, "{name},{},{},{seconds:.3},{errors},{most:.3}", quality.name(), quality.samples());
    }
    worst
}
