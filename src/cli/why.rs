//! `tusche why`: the pair of samples behind a line, or behind its absence.

use super::args::{LineMode, WhyArguments};
use super::request::Request;
use super::{Failure, print, terminal};
use crate::diag::Diagnostic;
use crate::render::why::{pixel_of, why};

pub(super) fn run(arguments: &WhyArguments) -> Result<(), Failure> {
    let scene = &arguments.scene;
    if !scene.output.is_empty() || !scene.layer.is_empty() {
        return Err(Failure::Usage("`tusche why` makes no picture: leave out -o and --layer".into()));
    }
    if !matches!(scene.lines, LineMode::Exact | LineMode::Brute) {
        let message = "only `--lines exact` and `--lines brute` draw a line for one pair of samples: leave out --lines";
        return Err(Failure::Usage(message.into()));
    }
    let request = Request::new(scene, scene.frame, &[])?;
    let place = arguments.place.0;
    if let Err(fault) = pixel_of(&request.scene, place) {
        return Err(Failure::Usage(format!("{}\n  {}", fault.message, fault.hints.join("; "))));
    }
    let (explanation, script_errors) = why(&request.scene, &request.shaders, place)?;
    terminal::say(&script_errors);
    if arguments.json {
        let text = serde_json::to_string_pretty(&explanation)
            .map_err(|error| Diagnostic::error(format!("cannot write the explanation: {error}")))?;
        print(&(text + "\n"))?;
    } else {
        print(&explanation.to_string())?;
    }
    if script_errors.has_errors() { Err(Failure::Silent) } else { Ok(()) }
}
