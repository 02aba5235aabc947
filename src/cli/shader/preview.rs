//! `tusche shader preview`: a shader on a ball and a knot, lines included.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use super::args::PreviewArguments;
use super::load_builder;
use crate::cli::{Failure, terminal};
use crate::diag::Diagnostics;
use crate::film::Layer;
use crate::plan::Plan;
use crate::render::{Control, PictureFile, RenderOptions, layers_of, render_files};
use crate::shade::{Host, Shaders};

pub(super) fn run(arguments: &PreviewArguments) -> Result<(), Failure> {
    let files = &arguments.shaders.files;
    if arguments.output.is_some() && files.len() > 1 {
        return Err(Failure::Usage("-o names one picture: leave it out to preview several shaders".into()));
    }
    let outputs: Vec<PathBuf> =
        files.iter().map(|file| arguments.output.clone().unwrap_or_else(|| default_output(file))).collect();
    if let Some(again) = (1..outputs.len()).find(|index| outputs[..*index].contains(&outputs[*index])) {
        let name = outputs[again].display();
        return Err(Failure::Usage(format!("two of the shaders would be shown in `{name}`: preview one at a time")));
    }
    let cancel = Arc::new(AtomicBool::new(false));
    let on_signal = Arc::clone(&cancel);
    // As in `render`: where this fails, Ctrl-C just ends the process.
    let _ = ctrlc::set_handler(move || on_signal.store(true, Ordering::Relaxed));
    let mut failed = false;
    for (file, output) in files.iter().zip(&outputs) {
        if let Err(faults) = preview(file, output, arguments, &cancel) {
            failed = true;
            terminal::show(&faults);
        }
        if cancel.load(Ordering::Relaxed) {
            terminal::note("stopped before the picture was complete");
            return Err(Failure::Silent);
        }
    }
    if failed { Err(Failure::Silent) } else { Ok(()) }
}

fn default_output(file: &Path) -> PathBuf {
    let name = file.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let stem = name.strip_prefix("builtin:").or(name.strip_suffix(".rhai")).unwrap_or(&name);
    PathBuf::from(format!("{stem}.png"))
}

/// Renders one picture. One whose script fails at some hits is written all the same, with those marked.
fn preview(file: &Path, output: &Path, arguments: &PreviewArguments, cancel: &AtomicBool) -> Result<(), Diagnostics> {
    let start = Instant::now();
    let (mut builder, _) = load_builder(file, &arguments.shaders.set)?;
    if let Some(size) = arguments.size {
        builder.render.size = size.0;
    }
    if let Some(samples) = arguments.samples {
        builder.render.samples = samples;
    }
    let scene = builder.build()?;
    let (shaders, mut warnings) = Shaders::compile(&scene, &Host::new())?;
    let pictures = [PictureFile { path: output.to_owned(), layers: vec![Layer::Rgba] }];
    let plan = Plan::new(&scene, &shaders, &layers_of(&pictures));

    let progress = terminal::Progress::new(!arguments.quiet, file.display().to_string());
    let advance = |share| progress.set(share);
    let control = Control { cancel: Some(cancel), progress: Some(&advance) };
    let result = render_files(&scene, &shaders, &plan, &pictures, &RenderOptions::default(), &control);
    progress.done();
    let report = result?;
    if !arguments.quiet {
        warnings.extend(report.warnings);
        terminal::show(&warnings);
        if report.written {
            terminal::note(&format!("wrote {} ({:.1} s)", output.display(), start.elapsed().as_secs_f64()));
        }
    }
    if report.script_errors.has_errors() { Err(report.script_errors) } else { Ok(()) }
}
