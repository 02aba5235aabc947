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
    /// Images.
    pub textures: Vec<TextureRequest>,
}

/// An image that a script names.
#[derive(Clone, Debug)]
pub struct TextureRequest {
    /// The path as written.
    pub path: String,
    /// Where it is written.
    pub span: Span,
    /// Further arguments, and where they are: how it continues outside of 0 … 1, and how its colours are encoded.
    /// `None` where one is not written out as a text.
    pub options: Vec<(Option<String>, Span)>,
}

/// What a script asks for; nothing if it cannot be parsed, which compiling will report.
#[must_use]
pub fn requests(source: &Arc<Source>) -> Requests {
    let (imports, textures) = link::named_files(source);
    let imports = imports.into_iter();
    let textures = textures.into_iter().map(|texture| TextureRequest {
        span: span(source, texture.path_position),
        options: texture.options.into_iter().map(|(text, position)| (text, span(source, position))).collect(),
        path: texture.path,
    });
    Requests {
        modules: imports.map(|import| (import.path, span(source, import.path_position))).collect(),
        textures: textures.collect(),
    }
}
