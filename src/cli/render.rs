//! `tusche render`: pictures.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use super::args::RenderArguments;
use super::request::{Request, output_paths};
use super::{Failure, terminal};
use crate::diag::{Diagnostic, Diagnostics};
use crate::film::{check_writable, write_atomically};
use crate::plan::Plan;
use crate::render::refine::{BLOCK, Rate, measured_layers};
use crate::render::stats::Sampling;
use crate::render::timed::choose_samples;
use crate::render::{Control, ErrorGoal, RenderOptions, Report, layers_of, render_files, render_files_to_error};
use crate::sample::PixelRect;

pub(super) fn run(arguments: &RenderArguments) -> Result<(), Failure> {
    let outputs = output_paths(&arguments.scene)?;
    let cancel = Arc::new(AtomicBool::new(false));
    let on_signal = Arc::clone(&cancel);
    // A second handler cannot be set; there is none, so this cannot fail but for exotic systems, where Ctrl-C just ends
    // the process and the old files survive.
    let _ = ctrlc::set_handler(move || on_signal.store(true, Ordering::Relaxed));

    let Some(range) = arguments.frames else {
        return render_frame(arguments, arguments.scene.frame, &outputs, arguments.stats.as_deref(), &cancel);
    };
    if let Some(path) = outputs.iter().chain(&arguments.stats).find(|path| numbered(path, 0).is_none()) {
        return Err(Failure::Usage(format!(
            "--frames needs a place for the frame number in `{}`: write for example `picture.####.png`",
            path.display()
        )));
    }
    for frame in range.first..=range.last {
        let outputs: Vec<PathBuf> = outputs.iter().filter_map(|path| numbered(path, frame)).collect();
        let stats = arguments.stats.as_deref().and_then(|path| numbered(path, frame));
        render_frame(arguments, Some(f64::from(frame)), &outputs, stats.as_deref(), &cancel)?;
    }
    Ok(())
}

/// The path with its last run of `#` replaced by the frame's number, padded with zeros to the run's length.
fn numbered(path: &Path, frame: u32) -> Option<PathBuf> {
    let name = path.file_name()?.to_str()?;
    let end = name.rfind('#')? + 1;
    let start = name[..end].trim_end_matches('#').len();
    let width = end - start;
    Some(path.with_file_name(format!("{}{frame:0width$}{}", &name[..start], &name[end..])))
}

fn render_frame(
    arguments: &RenderArguments,
    frame: Option<f64>,
    outputs: &[PathBuf],
    stats: Option<&Path>,
    cancel: &AtomicBool,
) -> Result<(), Failure> {
    let start = Instant::now();
    let mut request = Request::new(&arguments.scene, frame, outputs)?;
    let size = request.scene.render().size;
    let picture = PixelRect::of_size(size);
    let crop = arguments.crop.map_or(picture, |crop| crop.0);
    if crop.intersection(&picture) != crop {
        return Err(Failure::Usage(format!(
            "--crop reaches beyond the picture, which has {} x {} pixels",
            size[0], size[1]
        )));
    }
    if let Some(path) = stats {
        check_writable(path)?;
    }
    let quiet = arguments.scene.quiet;
    let label = frame.map_or_else(String::new, |frame| format!("frame {frame}"));
    let progress = terminal::Progress::new(!quiet, label);
    let options = RenderOptions {
        threads: arguments.threads.map_or(0, usize::from),
        tile: arguments.tile,
        crop: Some(crop),
        method: arguments.scene.lines.method(),
    };
    check_sampling(arguments, &request)?;
    let time = arguments.time.map(|time| (time.as_secs_f64(), start));
    let result = render_request(&mut request, arguments.error, time, &options, cancel, &progress);
    progress.done();
    let mut report = result?;
    report.stats.seconds.load = request.load_seconds;
    report.stats.seconds.total = start.elapsed().as_secs_f64();
    conclude(arguments, &request, stats, report)
}

/// Whether what chooses the number of samples leaves room for what the scene says of it.
fn check_sampling(arguments: &RenderArguments, request: &Request) -> Result<(), Failure> {
    if request.plan.oversampling.is_none() {
        return Ok(());
    }
    let off = "--set render.line_oversampling=1";
    if arguments.time.is_some() {
        let fault = Diagnostic::error(
            "--time finds one number of samples for the whole picture, but the scene's `line_oversampling` asks for more at lines",
        );
        let hint = format!("add {off} to have the same number everywhere, or choose --samples instead of --time");
        return Err(Diagnostics::from(fault.hint(hint)).into());
    }
    if arguments.error.is_some() && !arguments.scene.quiet {
        let fault = Diagnostic::warning(
            "`line_oversampling` does nothing here: --error finds how many samples each part of the picture needs",
        );
        terminal::say(&fault.hint(format!("{off} says the same without this warning")).into());
    }
    Ok(())
}

/// Renders with the scene's samples, to an error, or within a time from a start.
fn render_request(
    request: &mut Request,
    error: Option<f64>,
    time: Option<(f64, Instant)>,
    options: &RenderOptions,
    cancel: &AtomicBool,
    progress: &terminal::Progress,
) -> Result<Report, Failure> {
    let advance = |share| progress.set(share);
    let timed = |_| time.iter().for_each(|(seconds, start)| progress.set(start.elapsed().as_secs_f64() / seconds));
    let control = Control { cancel: Some(cancel), progress: Some(if time.is_some() { &timed } else { &advance }) };
    let layers = layers_of(&request.files);
    let mut choice = None;
    if let Some(time) = time {
        // Before time goes into finding out what fits.
        request.files.iter().try_for_each(|file| check_writable(&file.path))?;
        let chosen = choose_samples(&request.scene, &request.shaders, &request.files, time, options, &control)?;
        let chosen = *choice.insert(chosen.ok_or_else(stopped_early)?);
        request.scene = request.scene.with_samples(chosen.samples);
        request.plan = Plan::new(&request.scene, &request.shaders, &layers);
    }
    if error.is_some() {
        // It finds its own rates.
        request.scene = request.scene.with_samples(request.scene.render().samples);
        request.plan = Plan::new(&request.scene, &request.shaders, &measured_layers(&layers));
    }
    let Request { scene, shaders, plan, files, .. } = request;
    let mut report = match error {
        Some(error) => {
            let goal = ErrorGoal { error, most: ErrorGoal::MOST };
            render_files_to_error(scene, shaders, plan, files, &goal, options, &control)?
        }
        None => render_files(scene, shaders, plan, files, options, &control)?,
    };
    if let Some(choice) = choice {
        report.stats.sampling = Some(Sampling::Time(choice));
    }
    Ok(report)
}

fn stopped_early() -> Diagnostics {
    let fault = Diagnostic::error("stopped before the picture was complete");
    fault.hint("nothing was done yet, and nothing was written").into()
}

/// What to say of how samples were chosen.
fn told(sampling: &Sampling) -> String {
    match sampling {
        Sampling::Time(choice) => format!(
            "{} samples per pixel fit into {} s, of which {:.1} s went into finding that out; --samples {} makes the same picture",
            choice.samples, choice.asked_seconds, choice.pilot_seconds, choice.samples
        ),
        Sampling::Error(found) => {
            format!("samples per pixel: {}, {:.1} in the mean", shares(&found.rates), found.mean_samples)
        }
        Sampling::Lines(found) => format!(
            "samples per pixel: {}; {} of {} blocks have lines, as a pilot of {} found",
            shares(&found.rates),
            found.lined_blocks,
            found.blocks,
            found.pilot_samples
        ),
    }
}

/// How much of a picture has which rate.
fn shares(rates: &[Rate]) -> String {
    let pixels: u64 = rates.iter().map(|rate| rate.pixels).sum();
    let share = |rate: &Rate| 100.0 * rate.pixels as f64 / (pixels as f64).max(1.0);
    let rates: Vec<_> = rates.iter().map(|rate| format!("{} in {:.1} %", rate.samples, share(rate))).collect();
    format!("{} of the picture", rates.join(", "))
}

/// What did not go as asked for.
fn shortfall(sampling: &Sampling) -> Option<Diagnostic> {
    let Sampling::Error(found) = sampling else { return None };
    if found.unfinished_blocks == 0 {
        return None;
    }
    let (count, most) = (found.unfinished_blocks, ErrorGoal::MOST);
    let parts = if count == 1 { "part" } else { "parts" };
    let fault = Diagnostic::warning(format!(
        "{count} {parts} of {BLOCK} x {BLOCK} pixels did not reach an error of {} with {most} samples per pixel: the largest is {:.4}",
        found.error, found.largest_error
    ));
    Some(fault.hint("ask for a larger --error, or take a larger picture, in which detail is coarser"))
}

/// Says what happened, writes `--stats`, and decides about success.
fn conclude(
    arguments: &RenderArguments,
    request: &Request,
    stats: Option<&Path>,
    report: Report,
) -> Result<(), Failure> {
    let quiet = arguments.scene.quiet;
    if let Some(path) = stats {
        write_stats(path, &report)?;
    }
    if !quiet {
        terminal::say(&report.warnings);
    }
    if !quiet && report.written {
        if let Some(sampling) = &report.stats.sampling {
            terminal::note(&told(sampling));
            let short = shortfall(sampling).filter(|_| report.complete);
            short.into_iter().for_each(|fault| terminal::say(&fault.into()));
        }
        for file in &request.files {
            terminal::note(&format!("wrote {} ({:.1} s)", file.path.display(), report.stats.seconds.total));
        }
    }
    let failed = report.script_errors.has_errors();
    if failed {
        terminal::say(&report.script_errors);
    }
    if !report.complete {
        let files: Vec<String> = request.files.iter().map(|file| file.path.display().to_string()).collect();
        let fault = Diagnostic::error("stopped before the picture was complete");
        let files = files.join(" and ");
        let fault = match (report.written, &report.stats.sampling) {
            (false, _) => fault.hint("nothing was done yet, and nothing was written"),
            (true, Some(Sampling::Error(_))) => {
                fault.hint(format!("what is in {files} is not as accurate everywhere as was asked for"))
            }
            (true, _) => fault.hint(format!("what is done is in {files}; the rest is transparent black")),
        };
        let fault = fault.hint("run the same command again for the whole picture");
        return Err(Diagnostics::from(fault).into());
    }
    if failed && !arguments.keep_going { Err(Failure::Silent) } else { Ok(()) }
}

fn write_stats(path: &Path, report: &Report) -> Result<(), Diagnostic> {
    let text = serde_json::to_string_pretty(&report.stats)
        .map_err(|error| Diagnostic::error(format!("cannot write the statistics: {error}")))?;
    write_atomically(path, |sink| sink.write_all((text + "\n").as_bytes()))
}
