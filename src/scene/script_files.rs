//! The files that scripts name: modules and images.
//!
//! A module is written relative to the script that imports it, with `/` between folders and with or without `.rhai`:
//! `import "lib/hatching" as h` beside `shaders/ink.rhai` means `shaders/lib/hatching.rhai`. `..` leads to the folder
//! above. Absolute paths are refused, so that a folder of shaders can be moved. `builtin:lib/hatching` names a module
//! that comes with Tusche; the imports of built-in files are built in, too. Images are written in the same way, with
//! their extension: `texture("grain.png", uv)`.

use std::collections::BTreeSet;
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, OnceLock};

use super::SceneBuilder;
use super::ids::TextureId;
use super::material::TextureKey;
use super::texture::{self, Image, Texture, TextureFilter, Wrap};
use crate::diag::{Diagnostic, Diagnostics, Source, Span, nearest};
use crate::files::FileStore;
use crate::shade::builtin;
use crate::shade::requests::{Requests, TextureRequest, requests};

/// What built-in shaders and modules are called: this and a name.
pub const BUILTIN: &str = "builtin:";

/// Files that scripts name beyond this number are not read; compiling reports the limit.
const MAX_FILES: usize = 1024;

/// Reads all files that the scripts of a scene name, and those that they name in turn.
pub fn load(scene: &mut SceneBuilder, files: &FileStore, faults: &mut Diagnostics) {
    let mut open: Vec<(Arc<Source>, Option<PathBuf>)> =
        scene.scripts.iter().map(|script| (Arc::clone(&script.source), script.path.clone())).collect();
    let mut seen = BTreeSet::new();
    let mut images = Vec::new();
    while let Some((source, path)) = open.pop() {
        if seen.len() > MAX_FILES || !seen.insert(source.name.clone()) {
            continue;
        }
        let Requests { modules, textures } = requests(&source);
        for request in textures {
            match texture(&source, path.as_deref(), &request, scene, files, &mut images) {
                Ok((key, id)) => _ = scene.script_files.textures.insert(key, id),
                Err(fault) => faults.push(fault),
            }
        }
        for (written, span) in modules {
            match module(&source, path.as_deref(), &written, files) {
                Ok((module, path)) => {
                    scene.script_files.modules.insert((source.name.clone(), written), Arc::clone(&module));
                    open.push((module, path));
                }
                Err(fault) => faults.push(place(fault, span)),
            }
        }
    }
}

fn place(fault: Diagnostic, span: Span) -> Diagnostic {
    Diagnostic { file: None, ..fault }.at(span)
}

fn module(
    importer: &Source,
    path: Option<&Path>,
    written: &str,
    files: &FileStore,
) -> Result<(Arc<Source>, Option<PathBuf>), Diagnostic> {
    let bare = written.strip_suffix(".rhai").unwrap_or(written);
    let built_in = match (bare.strip_prefix(BUILTIN), importer.name.strip_prefix(BUILTIN)) {
        (Some(name), _) => Some(name.to_owned()),
        (None, Some(importer)) => {
            let beside = Path::new(importer).parent().unwrap_or(Path::new("")).join(bare);
            Some(tidy(&beside).to_string_lossy().into_owned())
        }
        (None, None) => None,
    };
    if let Some(name) = built_in {
        return match builtin::module(&name) {
            Some(source) => Ok((source, None)),
            None => {
                let fault = Diagnostic::error(format!("there is no built-in module `{name}`"));
                let names = builtin::module_names();
                Err(fault.hint(match nearest(&name, names.iter().copied()) {
                    Some(near) => format!("did you mean `{near}`?"),
                    None => format!("there are: {}", names.join(", ")),
                }))
            }
        };
    }
    let path = beside(path, &format!("{bare}.rhai"))?;
    let source = files.read_text(&path).map_err(|fault| {
        let message = format!("cannot read the module {}: {}", path.display(), reason(&fault));
        with_nearest(Diagnostic::error(message), &path, &["rhai"])
    })?;
    Ok((source, Some(path)))
}

/// Images that were read, by path and whether they are sRGB-encoded.
type Images = Vec<(PathBuf, bool, Arc<Image>)>;

const WRAPS: [(&str, Wrap); 3] = [("repeat", Wrap::Repeat), ("mirror", Wrap::Mirror), ("clamp", Wrap::Clamp)];
const COLORS: [(&str, bool); 2] = [("srgb", true), ("linear", false)];

fn texture(
    script: &Source,
    path: Option<&Path>,
    request: &TextureRequest,
    scene: &mut SceneBuilder,
    files: &FileStore,
    images: &mut Images,
) -> Result<(TextureKey, TextureId), Diagnostic> {
    let mut options = request.options.iter();
    let (wrap_name, wrap) = option(options.next(), &WRAPS, "wrap mode")?;
    let (color, srgb) = option(options.next(), &COLORS, "colour encoding")?;
    if script.name.starts_with(BUILTIN) {
        return Err(Diagnostic::error("a built-in script cannot name an image").at(request.span.clone()));
    }
    let path = beside(path, &request.path).map_err(|fault| place(fault, request.span.clone()))?;
    let known = images.iter().find(|(known, encoded, _)| *known == path && *encoded == srgb);
    let image = match known {
        Some((.., image)) => Arc::clone(image),
        None => {
            let bytes = files.read(&path).map_err(|fault| {
                let message = format!("cannot read the image {}: {}", path.display(), reason(&fault));
                let fault = with_nearest(Diagnostic::error(message), &path, &["png", "jpg", "jpeg", "hdr", "exr"]);
                place(fault, request.span.clone())
            })?;
            let image = texture::read_image(&path, &bytes, srgb, files).map_err(|fault| {
                let message = format!("{}: {}", path.display(), fault.message);
                place(Diagnostic { message, ..fault }, request.span.clone())
            })?;
            images.push((path, srgb, Arc::clone(&image)));
            image
        }
    };
    let texture = Texture {
        name: request.path.clone(),
        image,
        wrap: [wrap; 2],
        filter: TextureFilter::Linear,
        levels: OnceLock::new(),
    };
    let id = scene.add_texture(texture);
    let key = TextureKey {
        script: script.name.clone(),
        path: request.path.clone(),
        wrap: wrap_name.to_owned(),
        color: color.to_owned(),
    };
    Ok((key, id))
}

/// An option by its name; the first where none is written.
fn option<T: Copy>(
    written: Option<&(Option<String>, Span)>,
    known: &[(&'static str, T)],
    what: &str,
) -> Result<(&'static str, T), Diagnostic> {
    let Some((text, span)) = written else { return Ok(known[0]) };
    let fault = match text {
        None => Diagnostic::error(format!("the {what} of a texture must be written out as a text")),
        Some(text) => match known.iter().find(|(name, _)| name == text) {
            Some(found) => return Ok(*found),
            None => Diagnostic::error(format!("there is no {what} `{text}`")),
        },
    };
    let names = known.iter().map(|(name, _)| *name);
    let near = text.as_ref().and_then(|text| nearest(text, names.clone()));
    Err(fault.at(span.clone()).hint(match near {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("there are: {}", names.collect::<Vec<_>>().join(", ")),
    }))
}

/// Why a file could not be read.
fn reason(fault: &Diagnostic) -> &str {
    fault.message.strip_prefix("cannot read this file: ").unwrap_or(&fault.message)
}

/// A path that a script names, relative to the folder of the script.
fn beside(script: Option<&Path>, written: &str) -> Result<PathBuf, Diagnostic> {
    let relative = Path::new(written);
    if written.contains('\\') {
        return Err(Diagnostic::error("paths in scripts are written with `/`, not with `\\`"));
    }
    if relative.is_absolute() || relative.has_root() {
        let fault = Diagnostic::error("a script must name files relative to itself");
        return Err(fault.hint("write the path from the folder of this script, with `..` for the folder above"));
    }
    let folder = script.and_then(Path::parent).unwrap_or(Path::new(""));
    Ok(tidy(&folder.join(relative)))
}

/// The same path without `.`, and without `..` behind a folder: a file has one name, however it is written.
fn tidy(path: &Path) -> PathBuf {
    let mut tidy = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir if matches!(tidy.components().next_back(), Some(Component::Normal(_))) => {
                tidy.pop();
            }
            part => tidy.push(part),
        }
    }
    tidy
}

/// Names the file beside a missing one that was perhaps meant.
fn with_nearest(fault: Diagnostic, path: &Path, extensions: &[&str]) -> Diagnostic {
    let (Some(folder), Some(name)) = (path.parent(), path.file_name().and_then(|name| name.to_str())) else {
        return fault;
    };
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .into_iter()
        .flatten()
        .flatten()
        .filter_map(|entry| entry.file_name().into_string().ok())
        .filter(|name| extensions.iter().any(|extension| name.ends_with(&format!(".{extension}"))))
        .collect();
    names.sort();
    match nearest(name, names.iter().map(String::as_str)) {
        Some(near) => fault.hint(format!("did you mean `{near}`?")),
        None => fault,
    }
}
