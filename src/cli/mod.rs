//! The command line: one file per command; arguments as typed in `args`, as meant in `request`.
//!
//! This is the only place that prints. Talk goes to standard error, data to standard output.

mod args;
mod compare;
mod explain;
mod flicker;
mod render;
mod request;
mod shader;
mod study;
mod terminal;
mod watch;
mod why;

use std::io::Write;

use clap::{CommandFactory, Parser};

use crate::diag::Diagnostics;
use args::{Arguments, Command};

/// Why a command did not succeed.
enum Failure {
    /// The scene, a shader or a file is at fault: exit code 1.
    Input(Diagnostics),
    /// The flags do not fit together: exit code 2.
    Usage(String),
    /// All has been said already: exit code 1.
    Silent,
}

impl From<Diagnostics> for Failure {
    fn from(diagnostics: Diagnostics) -> Self {
        Self::Input(diagnostics)
    }
}

impl From<crate::diag::Diagnostic> for Failure {
    fn from(diagnostic: crate::diag::Diagnostic) -> Self {
        Self::Input(diagnostic.into())
    }
}

/// Runs the command line of this process; returns its exit code.
#[must_use]
pub fn run() -> u8 {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => {
            // Help and version go to standard output and are no failure.
            let code = if error.use_stderr() { 2 } else { 0 };
            let _ = error.print();
            return code;
        }
    };
    let result = match arguments.command {
        Command::Render(arguments) => render::run(&arguments),
        Command::Explain(arguments) => explain::run(&arguments),
        Command::Watch(arguments) => watch::run(&arguments),
        Command::Why(arguments) => why::run(&arguments),
        Command::Flicker(arguments) => flicker::run(&arguments),
        Command::Study(arguments) => study::run(&arguments),
        Command::Shader { command } => shader::run(&command),
        Command::Compare(arguments) => compare::run(&arguments),
        Command::Schema => print(&format!("{:#}\n", crate::scene::file::schema())),
        Command::Completions { shell } => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Arguments::command(), "tusche", &mut script);
            print(&String::from_utf8_lossy(&script))
        }
    };
    match result {
        Ok(()) => 0,
        Err(Failure::Silent) => 1,
        Err(Failure::Input(diagnostics)) => {
            terminal::say(&diagnostics);
            1
        }
        Err(Failure::Usage(message)) => {
            let error = Arguments::command().error(clap::error::ErrorKind::ArgumentConflict, message);
            let _ = error.print();
            2
        }
    }
}

/// Writes data to standard output. A reader that has gone away is no failure.
fn print(text: &str) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(crate::diag::Diagnostic::error(format!("cannot write to standard output: {error}")).into())
        }
        _ => Ok(()),
    }
}
