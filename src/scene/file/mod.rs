//! Scene files: TOML in, a filled [`SceneBuilder`] out.
//!
//! 1. `document`: the text becomes a tree whose every key and value knows its place.
//! 2. `overrides`: values of `--set` are put into the tree, with places of their own.
//! 3. `check`: the tree is held against the JSON schema that is derived from the types of `format`; faulty parts are
//!    reported and cut out.
//! 4. `deserialize`: what is left becomes a typed value.
//! 5. `resolve`: names, paths, units and defaults are resolved into the builder, with the tree at hand for places.
//!
//! No step stops at the first fault, nor does a fault stop the steps after it, syntax errors excepted: all that can be
//! found is told in one go, in the order of the file.

mod check;
mod deserialize;
mod document;
mod expect;
mod format;
mod overrides;
mod resolve;
mod schema;

use std::path::Path;
use std::sync::Arc;

use super::SceneBuilder;
use super::ids::MaterialId;
use crate::diag::{Diagnostic, Diagnostics, Source};
use crate::files::FileStore;

pub use overrides::Override;
pub use schema::schema;

/// What the command line decides and loading needs to know.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// Poses animated models at this frame, of which there are 24 a second. Default: time 0.
    pub frame: Option<f64>,
    /// The camera to render with, of the scene file or of one of its models. Default: the scene's first.
    pub camera: Option<String>,
}

/// Reads a scene file, or a bare model as a scene, and everything that it names. Warnings come beside the value.
///
/// Relative paths are relative to the file, those in `overrides` to the working directory.
///
/// # Errors
/// Everything that is wrong with the file, the overrides and the files it names, warnings included: errors of the
/// scene file in its order, then those of the overrides, then those of other files or without a place.
pub fn load(
    path: &Path,
    files: &FileStore,
    overrides: &[Override],
    options: &LoadOptions,
) -> Result<(SceneBuilder, Diagnostics), Diagnostics> {
    let (source, is_written) = source_of(path, files)?;
    load_document(&source, path, files, overrides, options, is_written)
}

/// The text of a scene file, or the one that a bare model stands for, and whether a user wrote it.
fn source_of(path: &Path, files: &FileStore) -> Result<(Arc<Source>, bool), Diagnostic> {
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
    match extension.as_deref() {
        Some("toml") => Ok((files.read_text(path)?, true)),
        Some("gltf" | "glb") => {
            files.read(path)?;
            Ok((model_scene(path)?, false))
        }
        _ => {
            let fault = Diagnostic::error("this is neither a scene file nor a model").in_file(path);
            Err(fault.hint("scene files end in .toml, models in .gltf or .glb"))
        }
    }
}

/// What a scene file says, with overrides put in: its tables as written, neither checked nor completed. A bare model gives
/// the scene file that it stands for. Numbers that JSON does not know are null.
///
/// # Errors
/// If the file cannot be read or is no TOML, or an override has no place in it.
pub fn written(path: &Path, files: &FileStore, overrides: &[Override]) -> Result<serde_json::Value, Diagnostics> {
    let (source, _) = source_of(path, files)?;
    let mut document = document::parse(&source)?;
    let schema = schema();
    for change in overrides {
        change.place(&mut document, &schema)?;
    }
    Ok(document.to_json())
}

/// Reads a bare shader as a scene: a ball and a knot of it on a stage, which `tusche shader preview` shows. The path may
/// be `builtin:` and a name. `params` are `NAME=VALUE`, values for the shader's parameters; paths in them are relative to
/// the working directory. Gives the material that has the shader, too.
///
/// # Errors
/// As [`load`].
pub fn load_shader(
    path: &Path,
    files: &FileStore,
    params: &[Override],
) -> Result<(SceneBuilder, MaterialId, Diagnostics), Diagnostics> {
    let is_builtin = path.to_str().is_some_and(|path| path.starts_with(resolve::BUILTIN));
    if !is_builtin {
        files.read_text(path)?;
    }
    let (name, source) = shader_scene(path, is_builtin)?;
    let overrides: Vec<_> = params.iter().map(|param| param.clone().within(&["materials", &name, "params"])).collect();
    let (builder, warnings) = load_document(&source, path, files, &overrides, &LoadOptions::default(), false)?;
    let material = builder.materials.iter().position(|material| material.name == name);
    let material = material.ok_or_else(|| Diagnostic::error("the stage has lost its shader").in_file(path))?;
    Ok((builder, MaterialId::from_index(material), warnings))
}

/// Loads a scene from its text. `is_written` tells whether a user wrote that.
fn load_document(
    source: &Arc<Source>,
    path: &Path,
    files: &FileStore,
    overrides: &[Override],
    options: &LoadOptions,
    is_written: bool,
) -> Result<(SceneBuilder, Diagnostics), Diagnostics> {
    let mut document = document::parse(source)?;
    let mut faults = Diagnostics::default();
    let schema = schema();
    for change in overrides {
        change.place(&mut document, &schema).unwrap_or_else(|fault| faults.push(fault));
    }
    check::check(&mut document, &schema, &mut faults);
    let written = deserialize::from_node(&document).map_err(|fault| {
        faults.push(fault);
        std::mem::take(&mut faults)
    })?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let context = resolve::Context { files, options, source, folder };
    let builder = resolve::resolve(&written, &document, context, &mut faults);
    let sources: Vec<_> = std::iter::once(source).chain(overrides.iter().map(Override::source)).collect();
    faults.0.sort_by_key(|fault| {
        let span = fault.span.as_ref();
        let file = span.and_then(|span| sources.iter().position(|source| Arc::ptr_eq(source, &span.source)));
        (file.unwrap_or(sources.len()), span.map_or(0, |span| span.range.start))
    });
    if !is_written {
        // Nobody wrote the text that stands for a bare model or shader; its messages name that.
        for fault in faults.0.iter_mut().filter(|fault| fault.span.as_ref().is_some_and(|span| span.source == *source))
        {
            fault.span = None;
        }
    }
    if faults.has_errors() { Err(faults) } else { Ok((builder, faults)) }
}

/// The scene file that a bare model stands for: what a scene file leaves out is framed and lit, and creases draw lines.
fn model_scene(path: &Path) -> Result<Arc<Source>, Diagnostic> {
    let (file, name) = names(path)?;
    let text = format!(
        "[render]\nbackground = {{ bottom = [0.83, 0.83, 0.82], top = [0.96, 0.96, 0.97] }}\n\
         [lines]\nnormal = 50.0\n\
         [[objects]]\nname = {}\ngltf = {}\n",
        quote(name),
        quote(file)
    );
    Ok(Source::new(format!("<scene of {}>", path.display()), text))
}

/// The scene file that a bare shader stands for, and the name of the material that has the shader.
fn shader_scene(path: &Path, is_builtin: bool) -> Result<(String, Arc<Source>), Diagnostic> {
    let (file, stem) = names(path)?;
    let name = if is_builtin { file.strip_prefix(resolve::BUILTIN).unwrap_or(file) } else { stem };
    let text = format!(
        "{}\n[materials.{}]\nshader = {}\n",
        include_str!("stage.toml").replace("SHADER", &quote(name)),
        quote(name),
        quote(file)
    );
    Ok((name.to_owned(), Source::new(format!("<scene of {}>", path.display()), text)))
}

/// The name of a file, with and without its extension.
fn names(path: &Path) -> Result<(&str, &str), Diagnostic> {
    let bad_name = || Diagnostic::error("the name of this file is not valid text").in_file(path);
    let file = path.file_name().and_then(|name| name.to_str()).ok_or_else(bad_name)?;
    let name = path.file_stem().and_then(|name| name.to_str()).ok_or_else(bad_name)?;
    Ok((file, name))
}

fn quote(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}
