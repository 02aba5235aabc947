//! The files that scripts name: modules.
//!
//! A module is written relative to the script that imports it, with `/` between folders and with or without `.rhai`:
//! `import "lib/hatching" as h` beside `shaders/ink.rhai` means `shaders/lib/hatching.rhai`. `..` leads to the folder
//! above. Absolute paths are refused, so that a folder of shaders can be moved. `builtin:lib/hatching` names a module
//! that comes with Tusche; the imports of built-in files are built in, too.

use std::collections::BTreeSet;
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;

use super::SceneBuilder;
use crate::diag::{Diagnostic, Diagnostics, Source, Span, nearest};
use crate::files::FileStore;
use crate::shade::builtin;
use crate::shade::requests::{Requests, requests};

/// What built-in shaders and modules are called: this and a name.
pub const BUILTIN: &str = "builtin:";

/// Files that scripts name beyond this number are not read; compiling reports the limit.
const MAX_FILES: usize = 1024;

/// Reads all files that the scripts of a scene name, and those that they name in turn.
pub fn load(scene: &mut SceneBuilder, files: &FileStore, faults: &mut Diagnostics) {
    let mut open: Vec<(Arc<Source>, Option<PathBuf>)> =
        scene.scripts.iter().map(|script| (Arc::clone(&script.source), script.path.clone())).collect();
    let mut seen = BTreeSet::new();
    while let Some((source, path)) = open.pop() {
        if seen.len() > MAX_FILES || !seen.insert(source.name.clone()) {
            continue;
        }
        let Requests { modules } = requests(&source);
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
