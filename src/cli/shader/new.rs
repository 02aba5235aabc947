//! `tusche shader new`: a commented shader to start from.

use std::io::Write;
use std::path::{Path, PathBuf};

use super::args::NewArguments;
use crate::cli::{Failure, terminal};
use crate::diag::{Diagnostic, nearest};
use crate::shade::builtin;

/// The template that is none of the shaders which come with Tusche.
const TEMPLATE: &str = "template";
const TEMPLATE_TEXT: &str = include_str!("template.rhai");
/// Longest name, so that file systems take it.
const MAX_NAME: usize = 100;

pub(super) fn run(arguments: &NewArguments) -> Result<(), Failure> {
    let path = path_of(&arguments.name).map_err(Failure::Usage)?;
    let text = template(&arguments.from).map_err(Failure::Usage)?;
    write_new(&path, &text)?;
    terminal::note(&format!("wrote {path}", path = path.display()));
    Ok(())
}

/// Where the shader of a name goes.
fn path_of(name: &str) -> Result<PathBuf, String> {
    let (folder, file) = match name.rfind(['/', std::path::MAIN_SEPARATOR]) {
        Some(end) => name.split_at(end + 1),
        None => ("", name),
    };
    let stem = file.strip_suffix(".rhai").unwrap_or(file);
    let is_fine = |c: char| c.is_alphanumeric() || "_-".contains(c);
    let fault = if stem.is_empty() {
        "it is empty"
    } else if stem.len() > MAX_NAME {
        "it is too long"
    } else if stem.starts_with('-') {
        "it begins with `-`, which commands take for an option"
    } else if !stem.chars().all(is_fine) {
        "a name has letters, digits, `_` and `-` only"
    } else {
        return Ok(Path::new(folder).join(format!("{stem}.rhai")));
    };
    Err(format!("`{name}` is no name for a shader: {fault}"))
}

fn template(name: &str) -> Result<String, String> {
    if name == TEMPLATE {
        return Ok(TEMPLATE_TEXT.to_owned());
    }
    if let Some(source) = builtin::source(name.strip_prefix("builtin:").unwrap_or(name)) {
        return Ok(source.text.clone());
    }
    let names: Vec<&str> = [TEMPLATE].iter().chain(builtin::names()).copied().collect();
    let told = match nearest(name, names.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("there are: {}", names.join(", ")),
    };
    Err(format!("there is no template `{name}`; {told}"))
}

/// Writes a file that must not be there yet, whole or not at all.
fn write_new(path: &Path, text: &str) -> Result<(), Diagnostic> {
    let fault = |error: &std::io::Error| {
        let fault = Diagnostic::error(format!("cannot write this file: {error}"));
        match error.kind() {
            std::io::ErrorKind::AlreadyExists => Diagnostic::error("this file is there already, and stays as it is")
                .hint("choose another name, or take the file away first"),
            std::io::ErrorKind::NotFound => fault.hint("make the folder first"),
            _ => fault,
        }
        .in_file(path)
    };
    if path.symlink_metadata().is_ok() {
        return Err(fault(&std::io::ErrorKind::AlreadyExists.into()));
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut builder = tempfile::Builder::new();
    builder.prefix(".tusche-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // The user's mask is taken off this, as for any new file.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let mut file = builder.tempfile_in(folder).map_err(|error| fault(&error))?;
    file.write_all(text.as_bytes()).map_err(|error| fault(&error))?;
    // Another program may have made the file meanwhile: this does not replace it.
    file.persist_noclobber(path).map_err(|error| fault(&error.error))?;
    Ok(())
}
