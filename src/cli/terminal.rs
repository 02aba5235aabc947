//! Talking on standard error: diagnostics, notes and the progress bar.

use std::io::{IsTerminal, Write};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};

use crate::diag::{Diagnostics, Severity};

/// Prints diagnostics with their snippets, and how many errors there were if more than one.
pub fn say(diagnostics: &Diagnostics) {
    show(diagnostics);
    let errors = diagnostics.0.iter().filter(|d| d.severity == Severity::Error).count();
    if errors > 1 {
        note(&format!("{errors} errors"));
    }
}

/// Prints diagnostics with their snippets.
pub fn show(diagnostics: &Diagnostics) {
    let mut err = std::io::stderr().lock();
    let color = err.is_terminal() && std::env::var_os("NO_COLOR").is_none();
    for diagnostic in &diagnostics.0 {
        let _ = writeln!(err, "{}\n", diagnostic.render(color));
    }
}

/// Prints a line of talk.
pub fn note(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}

/// A progress bar with the time left; invisible where standard error is no terminal.
pub struct Progress {
    bar: ProgressBar,
}

impl Progress {
    const STEPS: u64 = 1000;

    pub fn new(shown: bool, label: String) -> Self {
        let bar = if shown && std::io::stderr().is_terminal() {
            ProgressBar::new(Self::STEPS)
        } else {
            ProgressBar::hidden()
        };
        let style = ProgressStyle::with_template("{msg} {wide_bar} {percent:>3} %  {elapsed} passed, {eta} left");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        bar.set_message(label);
        bar.enable_steady_tick(Duration::from_millis(200));
        Self { bar }
    }

    pub fn set(&self, share: f64) {
        let position = (share * Self::STEPS as f64) as u64;
        if position > self.bar.position() {
            self.bar.set_position(position);
        }
    }

    /// Says what is done now.
    pub fn label(&self, label: &str) {
        self.bar.set_message(label.to_owned());
    }

    pub fn done(self) {
        self.bar.finish_and_clear();
    }
}
