//! `tusche shader …`: what is said of shaders, what they cost, how they begin, and how they look.

mod commands;
mod declared_width;
mod goldens;
mod preview;

use crate::common::{Run, Workplace};

/// What a run printed: standard output, then standard error below a line. Measured times are masked.
pub fn printed(run: &Run) -> String {
    let mut text = masked(&run.stdout());
    let said = masked(&run.stderr());
    if !said.is_empty() {
        text.push_str("\nstandard error:\n");
        text.push_str(&said);
    }
    text
}

/// The text with the figures in front of ` ns` replaced by `#`.
pub fn masked(text: &str) -> String {
    let mut parts = text.split(" ns").peekable();
    let mut result = String::new();
    while let Some(part) = parts.next() {
        if parts.peek().is_none() {
            return result + part;
        }
        let kept = part.trim_end_matches(|c: char| c.is_ascii_digit() || c == '.');
        result.push_str(kept);
        result.push_str(if kept.len() < part.len() { "# ns" } else { " ns" });
    }
    result
}

/// A place with all shipped shaders.
pub fn place_with_shaders() -> Workplace {
    let place = Workplace::new();
    for name in tusche::shade::builtin::names() {
        let source = tusche::shade::builtin::source(name).expect("it is shipped");
        place.file(&format!("{name}.rhai"), &source.text);
    }
    place
}
