//! What a script's text asks for before it is compiled: the files that it names.

use std::sync::Arc;

use super::fault::span;
use super::link;
use crate::diag::{Source, Span};

/// The files that a script names, each with the place of its name.
#[derive(Clone, Debug, Default)]
pub struct Requests {
    /// Modules, as written.
    pub modules: Vec<(String, Span)>,
}

/// What a script asks for; nothing if it cannot be parsed, which compiling will report.
#[must_use]
pub fn requests(source: &Arc<Source>) -> Requests {
    let imports = link::imports(source).into_iter();
    Requests { modules: imports.map(|import| (import.path, span(source, import.path_position))).collect() }
}
