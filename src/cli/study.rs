//! `tusche study`: what accuracy costs.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::args::{LineMode, StudyArguments};
use super::request::Request;
use super::{Failure, terminal};
use crate::diag::{Diagnostic, Diagnostics};
use crate::study::{Knob, StudyControl, StudyOptions, report, study};

pub(super) fn run(arguments: &StudyArguments) -> Result<(), Failure> {
    let scene = &arguments.scene;
    let [folder] = &scene.output[..] else {
        return Err(Failure::Usage("`tusche study` writes to one folder: name it with -o DIR".into()));
    };
    if !scene.layer.is_empty() || !matches!(scene.lines, LineMode::Exact) {
        return Err(Failure::Usage(
            "`tusche study` chooses layers and methods itself: leave out --layer and --lines".into(),
        ));
    }
    let cancel = Arc::new(AtomicBool::new(false));
    let on_signal = Arc::clone(&cancel);
    // As in `render`: where no handler can be set, Ctrl-C just ends the process, and what is written stays good.
    let _ = ctrlc::set_handler(move || on_signal.store(true, Ordering::Relaxed));

    let request = Request::new(scene, scene.frame, &[])?;
    let name = scene.scene.file_stem().unwrap_or("scene".as_ref()).to_string_lossy().into_owned();
    let options = StudyOptions {
        title: name,
        knobs: if arguments.knob.is_empty() { Knob::ALL.to_vec() } else { arguments.knob.clone() },
        repeats: arguments.repeats,
        reference: arguments.reference,
        budget: arguments.budget.map(|budget| budget.0),
        widths: arguments.knob.is_empty(),
        threads: arguments.threads.map_or(0, usize::from),
    };
    let bar = terminal::Progress::new(!scene.quiet, "study".into());
    let advance = |share: f64, what: &str| {
        bar.label(what);
        bar.set(share);
    };
    let control = StudyControl { cancel: Some(&cancel), progress: Some(&advance) };
    let found = study(request.scene, &request.shaders, folder, &options, &control);
    bar.done();
    let found = found?;
    report::write(&found, folder)?;
    if !found.complete {
        let fault = Diagnostic::error("stopped before all was measured");
        let fault =
            fault.hint(format!("what is measured is in {}; run the same command again for the rest", page(folder)));
        return Err(Diagnostics::from(fault).into());
    }
    if !scene.quiet {
        if found.left_out > 0 {
            let n = found.left_out;
            terminal::note(&format!("{n} picture{} did not fit into the budget", if n == 1 { "" } else { "s" }));
        }
        terminal::note(&format!("wrote {}", page(folder)));
    }
    Ok(())
}

fn page(folder: &Path) -> String {
    folder.join("index.html").display().to_string()
}
