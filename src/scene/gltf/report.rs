//! Faults found while a model is read, collected so that one run tells them all.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use crate::diag::{Diagnostic, Diagnostics, Severity};

/// More than this many faults of a kind are counted, not told: a damaged file can hold millions.
const MOST_TOLD: usize = 40;

/// Collects the faults of one model.
pub(super) struct Report {
    path: PathBuf,
    told: Diagnostics,
    errors: usize,
    warnings: usize,
}

impl Report {
    pub fn new(path: &Path) -> Self {
        Self { path: path.to_owned(), told: Diagnostics::default(), errors: 0, warnings: 0 }
    }

    /// Tells an error at a place in the model's JSON.
    pub fn error(&mut self, place: impl Display, message: impl Display) {
        self.push(Diagnostic::error(format!("{place}: {message}")));
    }

    /// [`Self::error`] for functions that then have nothing to return.
    pub fn fail<T>(&mut self, place: impl Display, message: impl Display) -> Option<T> {
        self.error(place, message);
        None
    }

    /// Tells a warning at a place in the model's JSON.
    pub fn warning(&mut self, place: impl Display, message: impl Display) {
        self.push(Diagnostic::warning(format!("{place}: {message}")));
    }

    /// Tells anything; without a file of its own it is about the model.
    pub fn push(&mut self, diagnostic: Diagnostic) {
        let count = match diagnostic.severity {
            Severity::Error => &mut self.errors,
            Severity::Warning => &mut self.warnings,
        };
        *count += 1;
        if *count <= MOST_TOLD {
            let placed = diagnostic.file.is_some() || diagnostic.span.is_some();
            self.told.push(if placed { diagnostic } else { diagnostic.in_file(&self.path) });
        }
    }

    /// The model's path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    pub fn has_errors(&self) -> bool {
        self.errors > 0
    }

    /// All that was told, with a last line for what was not.
    pub fn finish(mut self) -> Diagnostics {
        let untold = |count: usize| count.saturating_sub(MOST_TOLD);
        for (severity, count) in [(Severity::Error, untold(self.errors)), (Severity::Warning, untold(self.warnings))] {
            if count > 0 {
                let message = format!("{count} more like these");
                self.told.push(Diagnostic { severity, ..Diagnostic::error(message).in_file(&self.path) });
            }
        }
        self.told
    }
}
