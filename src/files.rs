//! The one door through which files enter: every read is cached and remembered, so that a caller can tell exactly
//! which files a picture depends on.

use std::any::Any;
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
    /// What was made of bytes in this store, and in an earlier one.
    made: Mutex<BTreeMap<Origin, Made>>,
    known_made: BTreeMap<Origin, Made>,
}

/// The file that bytes are from, and which part and use of it this is.
type Origin = (PathBuf, String);

/// What was made of bytes.
#[derive(Clone)]
struct Made {
    bytes: Arc<[u8]>,
    thing: Arc<dyn Any + Send + Sync>,
}

impl std::fmt::Debug for Made {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "of {} bytes", self.bytes.len())
    }
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
    /// follows files knows which of them are still the same. What was made of bytes is taken over, too.
    #[must_use]
    pub fn succeeded(&self, changed: &[PathBuf]) -> Self {
        let mut known = lock(&self.cache).clone();
        changed.iter().for_each(|path| drop(known.remove(path)));
        Self { known, known_made: lock(&self.made).clone(), ..Self::default() }
    }

    /// Makes something of bytes, such as an image of a compressed one, unless an earlier store has made it of the same
    /// bytes. `origin` is the file that they are from, and which part and use of it this is.
    ///
    /// # Errors
    /// Those of `make`.
    pub fn make<T: Any + Send + Sync, E>(
        &self,
        origin: (&Path, &str),
        bytes: &Arc<[u8]>,
        make: impl FnOnce(&[u8]) -> Result<T, E>,
    ) -> Result<Arc<T>, E> {
        let origin = (origin.0.to_owned(), origin.1.to_owned());
        let is_same = |made: &&Made| Arc::ptr_eq(&made.bytes, bytes) || made.bytes == *bytes;
        let known = self.known_made.get(&origin).filter(is_same).cloned();
        let known = known.or_else(|| lock(&self.made).get(&origin).filter(is_same).cloned());
        let thing = match known.and_then(|made| made.thing.downcast().ok()) {
            Some(thing) => thing,
            None => Arc::new(make(bytes)?),
        };
        let made = Made { bytes: Arc::clone(bytes), thing: Arc::<T>::clone(&thing) };
        lock(&self.made).insert(origin, made);
        Ok(thing)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_successor_reads_only_what_has_changed_and_depends_only_on_what_it_reads() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
        let read = |store: &FileStore, path: &PathBuf| store.read(path).map(|bytes| bytes.to_vec()).unwrap();
        [&a, &b].iter().for_each(|path| std::fs::write(path, "old").unwrap());
        let first = FileStore::new();
        assert_eq!((read(&first, &a), read(&first, &b)), (b"old".to_vec(), b"old".to_vec()));
        [&a, &b].iter().for_each(|path| std::fs::write(path, "new").unwrap());
        let second = first.succeeded(std::slice::from_ref(&b));
        assert!(second.dependencies().is_empty());
        assert_eq!((read(&second, &a), read(&second, &b)), (b"old".to_vec(), b"new".to_vec()));
        assert_eq!(second.dependencies(), [a.clone(), b]);
        // What the last run did not read, nobody has followed.
        assert_eq!(read(&second.succeeded(&[]).succeeded(&[]), &a), b"new".to_vec());
    }

    #[test]
    fn things_are_made_once_of_the_same_bytes() {
        let (path, old, new) = (Path::new("a"), Arc::from(&b"old"[..]), Arc::from(&b"new"[..]));
        let make = |store: &FileStore, bytes: &Arc<[u8]>| {
            store.make((path, "length"), bytes, |bytes| Ok::<_, ()>(bytes.len())).unwrap()
        };
        let first = FileStore::new();
        let made = make(&first, &old);
        assert!(Arc::ptr_eq(&made, &make(&first, &old)));
        let second = first.succeeded(&[]);
        assert!(Arc::ptr_eq(&made, &make(&second, &Arc::from(&b"old"[..]))));
        assert!(!Arc::ptr_eq(&made, &make(&second.succeeded(&[]), &new)));
        assert!(first.make((path, "other"), &old, |_| Err::<(), _>("fault")).is_err());
        // What was not asked for again is forgotten.
        assert!(!Arc::ptr_eq(&made, &make(&first.succeeded(&[]).succeeded(&[]), &old)));
    }
}
