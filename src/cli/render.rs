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
use crate::render::{Control, RenderOptions, Report, render_files};
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
    let request = Request::new(&arguments.scene, frame, outputs)?;
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
    let advance = |share| progress.set(share);
    let control = Control { cancel: Some(cancel), progress: Some(&advance) };
    let Request { scene, shaders, plan, files, load_seconds } = &request;
    let result = render_files(scene, shaders, plan, files, &options, &control);
    progress.done();
    let mut report = result?;
    report.stats.seconds.load = *load_seconds;
    report.stats.seconds.total = start.elapsed().as_secs_f64();
    conclude(arguments, &request, stats, report)
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
        let fault = if report.written {
            fault.hint(format!("what is done is in {}; the rest is transparent black", files.join(" and ")))
        } else {
            fault.hint("nothing was done yet, and nothing was written")
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
