//! `tusche flicker`: how much lines change from frame to frame beyond what motion explains.

use std::cell::RefCell;

use super::args::FlickerArguments;
use super::request::Request;
use super::{Failure, print, terminal};
use crate::diag::{Diagnostic, Diagnostics};
use crate::study::{Flicker, FlickerOptions, flicker};

pub(super) fn run(arguments: &FlickerArguments) -> Result<(), Failure> {
    let scene = &arguments.scene;
    if !scene.output.is_empty() || !scene.layer.is_empty() {
        return Err(Failure::Usage("`tusche flicker` makes no picture: leave out -o and --layer".into()));
    }
    let (first, last) = (arguments.frames.first, arguments.frames.last);
    if first == last {
        return Err(Failure::Usage("flicker is between frames: --frames needs at least two, as in 1-9".into()));
    }
    let options = FlickerOptions {
        frames: last - first + 1,
        step: arguments.step.0,
        reference: arguments.reference,
        threads: arguments.threads.map_or(0, usize::from),
    };
    // Errors of the command line's own kinds must get through the library's.
    let failure = RefCell::new(None);
    let samples = RefCell::new(0);
    let frame = |number: u32| {
        let of_animation = arguments.animate.then_some(f64::from(first + number));
        // What is questionable is told once.
        let mut scene = scene.clone();
        scene.quiet |= number > 0;
        match Request::new(&scene, of_animation.or(scene.frame), &[]) {
            Ok(request) => {
                *samples.borrow_mut() = request.scene.render().samples;
                Ok((request.scene, request.shaders))
            }
            Err(Failure::Input(faults)) => Err(faults),
            Err(other) => {
                *failure.borrow_mut() = Some(other);
                Err(Diagnostics::default())
            }
        }
    };
    let bar = terminal::Progress::new(!scene.quiet, "flicker".into());
    let found = flicker(frame, &options, &|share| bar.set(share));
    bar.done();
    if let Some(failure) = failure.into_inner() {
        return Err(failure);
    }
    let found = found?;
    if arguments.json {
        let text = serde_json::to_string_pretty(&found)
            .map_err(|error| Diagnostic::error(format!("cannot write the numbers: {error}")))?;
        return print(&(text + "\n"));
    }
    print(&text(&found, &options, samples.into_inner()))
}

fn text(found: &Flicker, options: &FlickerOptions, samples: u32) -> String {
    let share = |x: f64| format!("{:.2} %", x * 100.0);
    let [x, y] = options.step;
    format!(
        "{} frames, each moved by ({x}, {y}) px; {samples} samples, references of 2 x {}\n\
         lines cover       {:.0} px\n\
         error             {} of that, in a single frame\n\
         flicker           {} of that changes from frame to frame beyond motion\n\
         unlocked          {} if sample patterns changed with each frame\n\
         floor             {} is what errors of the reference may add\n",
        options.frames,
        samples.saturating_mul(options.reference),
        found.coverage,
        share(found.error),
        share(found.flicker),
        share(found.unlocked_flicker),
        share(found.floor),
    )
}
