//! The one door through which files enter: every read is cached and remembered, so that a caller can tell exactly
//! which files a picture depends on.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use crate::diag::{Diagnostic, Source};

/// Reads files, caches them, and records them as dependencies. Cheap to share by reference between threads.
#[derive(Debug, Default)]
pub struct FileStore {
    cache: Mutex<BTreeMap<PathBuf, Arc<[u8]>>>,
    missing: Mutex<Vec<PathBuf>>,
    /// What an earlier store read, and need not be read again; no dependencies until somebody asks for them.
    known: BTreeMap<PathBuf, Arc<[u8]>>,
}

impl FileStore {
    /// A store over the real file system.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Puts a file into the store that need not exist on disk; it hides one that does.
    #[must_use]
    pub fn with_file(self, path: impl Into<PathBuf>, bytes: impl Into<Vec<u8>>) -> Self {
        lock(&self.cache).insert(path.into(), Arc::from(bytes.into()));
        self
    }

    /// A new store without dependencies that takes over what this one read, except the files named here: whoever
    /// follows files knows which of them are still the same.
    #[must_use]
    pub fn succeeded(&self, changed: &[PathBuf]) -> Self {
        let mut known = lock(&self.cache).clone();
        changed.iter().for_each(|path| drop(known.remove(path)));
        Self { known, ..Self::default() }
    }

    /// The bytes of a file.
    ///
    /// # Errors
    /// A diagnostic with the path and the system's reason; the caller adds the place that asked for the file.
    pub fn read(&self, path: &Path) -> Result<Arc<[u8]>, Diagnostic> {
        if let Some(bytes) = lock(&self.cache).get(path) {
            return Ok(Arc::clone(bytes));
        }
        if let Some(bytes) = self.known.get(path) {
            lock(&self.cache).insert(path.to_owned(), Arc::clone(bytes));
            return Ok(Arc::clone(bytes));
        }
        let bytes = std::fs::read(path).map_err(|error| {
            lock(&self.missing).push(path.to_owned());
            let reason = match error.kind() {
                std::io::ErrorKind::NotFound => "no such file".to_owned(),
                std::io::ErrorKind::IsADirectory => "this is a folder, not a file".to_owned(),
                _ => error.to_string(),
            };
            Diagnostic::error(format!("cannot read this file: {reason}")).in_file(path)
        })?;
        let bytes: Arc<[u8]> = Arc::from(bytes);
        lock(&self.cache).insert(path.to_owned(), Arc::clone(&bytes));
        Ok(bytes)
    }

    /// A file as text, named by its path in messages.
    ///
    /// # Errors
    /// As [`Self::read`], and if the file is not UTF-8.
    pub fn read_text(&self, path: &Path) -> Result<Arc<Source>, Diagnostic> {
        let bytes = self.read(path)?;
        let text = std::str::from_utf8(&bytes).map_err(|error| {
            Diagnostic::error(format!("this file is not UTF-8 text: bad byte at offset {}", error.valid_up_to()))
                .in_file(path)
        })?;
        Ok(Source::new(path.display().to_string(), text))
    }

    /// The bytes of a file, if it was read.
    #[must_use]
    pub fn held(&self, path: &Path) -> Option<Arc<[u8]>> {
        lock(&self.cache).get(path).map(Arc::clone)
    }

    /// Every file that was read, and every file that was looked for and not found, sorted.
    #[must_use]
    pub fn dependencies(&self) -> Vec<PathBuf> {
        let mut all: Vec<_> = lock(&self.cache).keys().cloned().collect();
        all.extend(lock(&self.missing).iter().cloned());
        all.sort();
        all.dedup();
        all
    }
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    // A panic elsewhere cannot leave these maps half-changed, so a poisoned lock is still good.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
