//! `tusche shader check`: what is wrong with shaders, what they read and write, and how they run.
//!
//! Diagnostics go to standard error with their snippets, reports to standard output, shader by shader; with `--json`
//! everything goes to standard output as one document, which `json` describes. No shader keeps the others from being
//! checked.

use std::path::Path;

use super::args::CheckArguments;
use super::json::Document;
use super::load;
use crate::cli::{Failure, print, terminal};
use crate::diag::{Diagnostic, Severity};
use crate::shade::Host;
use crate::shade::check::{Check, check};

pub(super) fn run(arguments: &CheckArguments) -> Result<(), Failure> {
    let host = Host::new();
    let one = |path: &Path| match load(path, &arguments.shaders.set) {
        Ok((scene, material)) => check(&scene, material, &host),
        Err(faults) => Check::failed(faults),
    };
    let files = &arguments.shaders.files;
    let mut checks = Vec::new();
    for path in files {
        let found = one(path);
        if !arguments.json {
            terminal::show(&found.diagnostics);
            print(&text(path, &found))?;
        }
        checks.push((path.display().to_string(), found));
    }
    if arguments.json {
        let text = serde_json::to_string_pretty(&Document::new(&checks))
            .map_err(|error| Diagnostic::error(format!("cannot write the document: {error}")))?;
        print(&(text + "\n"))?;
    }
    let failed = checks.iter().any(|(_, found)| found.diagnostics.has_errors());
    if failed { Err(Failure::Silent) } else { Ok(()) }
}

/// What standard output gets of one shader: its name, a verdict, and the report if there are no errors, which come first.
fn text(path: &Path, found: &Check) -> String {
    let count = |severity| found.diagnostics.0.iter().filter(|d| d.severity == severity).count();
    let plural = |count: usize, what: &str| match count {
        0 => None,
        1 => Some(format!("1 {what}")),
        n => Some(format!("{n} {what}s")),
    };
    let counts = [(Severity::Error, "error"), (Severity::Warning, "warning")];
    let verdict: Vec<_> = counts.iter().filter_map(|(severity, what)| plural(count(*severity), what)).collect();
    let verdict = if verdict.is_empty() { "no faults".to_owned() } else { verdict.join(", ") };
    let report = found.report.as_ref().filter(|_| !found.diagnostics.has_errors());
    let report = report.map_or_else(String::new, ToString::to_string);
    format!("{}: {verdict}\n{report}", path.display())
}
