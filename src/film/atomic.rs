//! Files that appear whole or not at all.
//!
//! Everything is written to a nameless or temporary file in the folder of the target (a rename must not cross file
//! systems) and gets its name in one step at the end. Whatever fails before leaves the old file as it was.

use std::fs::{self, File};
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

use crate::diag::Diagnostic;

/// Creates or replaces a file with what `write` writes. The file gets the permissions of the one it replaces, or those
/// that any new file gets; a symbolic link stays, and what it points to is replaced.
///
/// # Errors
/// If the folder is missing, the target is not a plain file, or writing fails; the old file is then untouched. An
/// error of `write` itself is reported in the same way.
pub fn write_atomically(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<(), Diagnostic> {
    let target = Target::new(path)?;
    target.replace(write).map_err(|error| target.failure(&error))
}

/// A checked place for a file.
#[derive(Clone, Debug)]
pub(super) struct Target {
    path: PathBuf,
    /// With symbolic links followed.
    real: PathBuf,
    folder: PathBuf,
}

impl Target {
    pub(super) fn new(path: &Path) -> Result<Self, Diagnostic> {
        let error = |message: &str| Diagnostic::error(message).in_file(path);
        let real = followed(path);
        match fs::metadata(&real) {
            Ok(old) if old.is_dir() => {
                return Err(error("cannot write here: this is a folder").hint("add the name of a file"));
            }
            Ok(old) if !old.is_file() => {
                return Err(error("cannot write here: this is a device or pipe, and the file is made by renaming"));
            }
            _ => {}
        }
        let folder = match real.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent.to_owned(),
            _ => PathBuf::from("."),
        };
        if !folder.is_dir() {
            let message = format!("cannot write this file: there is no folder `{}`", folder.display());
            return Err(error(&message).hint("create the folder first"));
        }
        Ok(Self { path: path.to_owned(), real, folder })
    }

    /// The path as the user typed it.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// A nameless file beside the target, gone when closed.
    pub(super) fn spool(&self) -> io::Result<File> {
        tempfile::tempfile_in(&self.folder)
    }

    pub(super) fn replace(&self, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> io::Result<()> {
        let mut builder = tempfile::Builder::new();
        builder.prefix(".tusche-").suffix(".part");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            // The user's mask is taken off this, as for any new file.
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        let file = builder.tempfile_in(&self.folder)?;
        let mut writer = BufWriter::new(file);
        write(&mut writer)?;
        let file = writer.into_inner().map_err(io::IntoInnerError::into_error)?;
        if let Ok(old) = fs::metadata(&self.real) {
            file.as_file().set_permissions(old.permissions())?;
        }
        file.persist(&self.real)?;
        Ok(())
    }

    /// What to tell the user about a failure to write.
    pub(super) fn failure(&self, error: &io::Error) -> Diagnostic {
        let (reason, hint) = match error.kind() {
            ErrorKind::StorageFull => ("the disk is full".to_owned(), Some("free some space and try again")),
            ErrorKind::QuotaExceeded => ("the disk quota is used up".to_owned(), Some("free some space and try again")),
            ErrorKind::PermissionDenied => {
                (format!("no permission to create files in `{}`", self.folder.display()), Some("choose another folder"))
            }
            ErrorKind::ReadOnlyFilesystem => ("the disk is read-only".to_owned(), Some("choose another folder")),
            _ => (error.to_string(), None),
        };
        let diagnostic = Diagnostic::error(format!("cannot write this file: {reason}")).in_file(&self.path);
        match hint {
            Some(hint) => diagnostic.hint(hint),
            None => diagnostic,
        }
    }
}

/// The path with symbolic links followed, even to a file that does not exist yet.
fn followed(path: &Path) -> PathBuf {
    /// As many as Linux follows; a longer chain is a circle.
    const MOST_LINKS: usize = 40;
    let mut real = path.to_owned();
    for _ in 0..MOST_LINKS {
        if let Ok(found) = fs::canonicalize(&real) {
            return found;
        }
        match fs::read_link(&real) {
            Ok(next) => real = real.parent().unwrap_or(Path::new("")).join(next),
            Err(_) => return real,
        }
    }
    path.to_owned()
}

/// Whether [`write_atomically`] could begin now: better told before hours of work than after.
///
/// # Errors
/// If the folder is missing or takes no new files, or the target is not a plain file.
pub fn check_writable(path: &Path) -> Result<(), Diagnostic> {
    let target = Target::new(path)?;
    target.spool().map(drop).map_err(|error| target.failure(&error))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failures_name_the_file_and_the_cause() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let target = Target::new(&path).unwrap();
        let (file, place) = (path.display(), folder.path().display());
        for (kind, message) in [
            (ErrorKind::StorageFull, "the disk is full (free some space and try again)".to_owned()),
            (ErrorKind::QuotaExceeded, "the disk quota is used up (free some space and try again)".to_owned()),
            (
                ErrorKind::PermissionDenied,
                format!("no permission to create files in `{place}` (choose another folder)"),
            ),
            (ErrorKind::ReadOnlyFilesystem, "the disk is read-only (choose another folder)".to_owned()),
            (ErrorKind::BrokenPipe, "broken pipe".to_owned()),
        ] {
            let failure = target.failure(&kind.into()).to_string();
            assert_eq!(failure, format!("{file}: error: cannot write this file: {message}"));
        }
    }

    #[test]
    fn a_file_appears_whole_or_not_at_all() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write_atomically(&path, |sink| sink.write_all(b"first")).unwrap();
        let error = write_atomically(&path, |sink| {
            sink.write_all(b"second")?;
            Err(ErrorKind::StorageFull.into())
        });
        assert_eq!(error.unwrap_err().message, "cannot write this file: the disk is full");
        assert_eq!(fs::read_to_string(&path).unwrap(), "first");
        write_atomically(&path, |sink| sink.write_all(b"third")).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "third");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
