//! `tusche shader bench`: nanoseconds per hit, and millions of hits per second, on one thread.

use serde::Serialize;

use super::args::BenchArguments;
use super::load;
use crate::cli::{Failure, print, terminal};
use crate::diag::{Diagnostic, Diagnostics};
use crate::shade::{
    Host, Mode, OutputBatch, OutputSet, ShadeErrors, Shaders, Shading, ShadingMode, measure, synthetic,
};

/// Measurements of which the median counts.
const REPEATS: usize = 9;

/// The document of `--json`.
#[derive(Serialize)]
struct Document {
    /// Hits in a batch.
    hits: u32,
    shaders: Vec<Bench>,
}

#[derive(Serialize)]
struct Bench {
    file: String,
    /// `constant`, `kernel` or `interpreted`.
    mode: &'static str,
    ways: Vec<Way>,
    /// How many times faster the kernel is than the interpreter, if both were measured.
    ratio: Option<f64>,
}

/// One way to run a shader.
#[derive(Serialize)]
struct Way {
    /// `once` for the one evaluation of a constant shader, `interpreter` or `kernel`.
    name: &'static str,
    ns_per_hit: f64,
    /// Millions of hits in a second of CPU time.
    mhits_per_second: f64,
}

pub(super) fn run(arguments: &BenchArguments) -> Result<(), Failure> {
    let mut failed = false;
    let mut shaders = Vec::new();
    for path in &arguments.shaders.files {
        let file = path.display().to_string();
        match bench(path, arguments) {
            Ok((mode, ways)) => {
                let of = |name| ways.iter().find(|way| way.name == name).map(|way| way.ns_per_hit);
                let ratio = of("kernel").and_then(|kernel| Some(of("interpreter")? / kernel));
                let bench = Bench { file, mode: mode.name(), ways, ratio };
                if !arguments.json {
                    print(&text(&bench))?;
                }
                shaders.push(bench);
            }
            Err(faults) => {
                failed = true;
                terminal::show(&faults);
            }
        }
    }
    if arguments.json {
        let document = Document { hits: arguments.hits, shaders };
        let text = serde_json::to_string_pretty(&document)
            .map_err(|error| Diagnostic::error(format!("cannot write the figures: {error}")))?;
        print(&(text + "\n"))?;
    }
    if failed { Err(Failure::Silent) } else { Ok(()) }
}

/// A shader that fails at some hits is not measured: an error costs more than a value.
fn bench(path: &std::path::Path, arguments: &BenchArguments) -> Result<(Mode, Vec<Way>), Diagnostics> {
    let (scene, material) = load(path, &arguments.shaders.set)?;
    let (shaders, _) = Shaders::compile(&scene, &Host::new())?;
    let hits = synthetic::hits(arguments.hits as usize, 0);
    let mut shading = Shading::new(&scene, &shaders);
    let (mut outputs, mut errors) = (OutputBatch::default(), ShadeErrors::default());
    shading.shade(material, &hits, OutputSet::all(), &mut outputs, &mut errors);
    if !errors.is_empty() {
        return Err(Diagnostics(errors.errors.into_values().map(|(fault, _)| fault).collect()));
    }
    let mode = shaders.of(material).mode();
    let ways = match mode {
        Mode::Constant => {
            let one = synthetic::hits(1, 0);
            vec![Way::new("once", measure::nanoseconds_once(&scene, &shaders, material, &one, REPEATS))]
        }
        Mode::Kernel => {
            let (reference, _) = Shaders::compile_for(&scene, &Host::new(), ShadingMode::Interpreter)?;
            let mut interpreter = Shading::new(&scene, &reference);
            vec![
                Way::new("kernel", measure::nanoseconds_per_hit(&mut shading, material, &hits, REPEATS)),
                Way::new("interpreter", measure::nanoseconds_per_hit(&mut interpreter, material, &hits, REPEATS)),
            ]
        }
        Mode::Interpreted => {
            vec![Way::new("interpreter", measure::nanoseconds_per_hit(&mut shading, material, &hits, REPEATS))]
        }
    };
    Ok((mode, ways))
}

impl Way {
    fn new(name: &'static str, ns_per_hit: f64) -> Self {
        let tenths = |x: f64| (x * 10.0).round() / 10.0;
        Self { name, ns_per_hit: tenths(ns_per_hit), mhits_per_second: 1e3 / ns_per_hit.max(1e-3) }
    }
}

fn text(bench: &Bench) -> String {
    let mut text = format!("{}: {}\n", bench.file, bench.mode);
    for way in &bench.ways {
        let figures = match way.name {
            "once" => format!("{:>10.1} ns, whatever the number of hits", way.ns_per_hit),
            _ => format!("{:>10.1} ns a hit  {:>8.2} Mhits/s", way.ns_per_hit, way.mhits_per_second),
        };
        text.push_str(&format!("  {:<11}{figures}\n", way.name));
    }
    if let Some(ratio) = bench.ratio {
        text.push_str(&format!("  {:<11}{ratio:>10.1} times faster than the interpreter\n", "kernel is"));
    }
    text
}
