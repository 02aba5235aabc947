//! Following files: which of those that the last run read have other contents now.
//!
//! The system tells of events in the folders of the files (so that a file that is replaced by renaming, or deleted and
//! made again, is still followed); what counts is only whether the contents differ from those that were read. As a net
//! below the events, which network file systems and replaced folders swallow, sizes and times are looked at once a
//! second ([`POLL`]). A file that is gone or empty is given [`PATIENCE`] to come back, because editors write so.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};

use notify::event::{AccessKind, AccessMode, ModifyKind, RenameMode};
use notify::{Event, EventKind, RecommendedWatcher, RecursiveMode, Watcher};

use crate::diag::Diagnostic;
use crate::files::FileStore;

/// How often sizes and times are looked at.
pub const POLL: Duration = Duration::from_secs(1);
/// How long a file may be gone or empty before that counts.
pub const PATIENCE: Duration = Duration::from_millis(250);

/// Something happened to files.
#[derive(Debug)]
pub(super) struct Touched {
    pub paths: Vec<PathBuf>,
    /// Whether a file is complete as far as the system can tell: it was closed after writing, or given its name.
    pub complete: bool,
}

/// What a look at the files found.
#[derive(Debug, Default, PartialEq, Eq)]
pub(super) struct Changes {
    /// Files with other contents than those read, by the names under which they were read.
    pub changed: Vec<PathBuf>,
    /// Whether a file is gone or empty that may come back: look again soon.
    pub waiting: bool,
}

/// Follows the files that a store read.
pub(super) struct Follower {
    /// `None` where the system cannot tell of events.
    watcher: Option<RecommendedWatcher>,
    /// Files by the names under which they were read.
    files: BTreeMap<PathBuf, File>,
    /// The folders whose events are listened to.
    folders: BTreeMap<PathBuf, Option<Identity>>,
}

struct File {
    /// Names under which events may speak of it: its own, and that of what a link leads to.
    names: Vec<PathBuf>,
    /// What was read; `None` if it could not be.
    held: Option<Arc<[u8]>>,
    stamp: Option<Stamp>,
    /// Since when it is gone or empty although it was not when it was read before.
    gone: Option<Instant>,
}

/// Size and time of the last change.
type Stamp = (u64, Option<SystemTime>);
/// What tells a folder from one that has taken its place.
type Identity = (u64, u64);

impl Follower {
    /// A follower of no files; `tell` hears of events from another thread. A diagnostic tells if the system does not
    /// report events; then files are looked at once a second.
    pub fn new(tell: impl Fn(Touched) + Send + 'static) -> (Self, Option<Diagnostic>) {
        let watcher = notify::recommended_watcher(move |event: notify::Result<Event>| match event {
            Ok(event) => {
                if let Some(complete) = is_complete(event.kind) {
                    tell(Touched { paths: event.paths, complete });
                }
            }
            // Events were lost: everything may have changed.
            Err(_) => tell(Touched { paths: Vec::new(), complete: false }),
        });
        let (watcher, fault) = match watcher {
            Ok(watcher) => (Some(watcher), None),
            Err(error) => (None, Some(without_events(&error))),
        };
        (Self { watcher, files: BTreeMap::new(), folders: BTreeMap::new() }, fault)
    }

    /// Follows exactly the files that a store read or looked for, and compares with what it read. Files that it names
    /// for the first time are looked at once more at the next [`check`](Self::check), since nobody listened when they
    /// were read.
    pub fn follow(&mut self, store: &FileStore) -> Option<Diagnostic> {
        let now = Instant::now();
        let mut old = std::mem::take(&mut self.files);
        for path in store.dependencies() {
            let held = store.held(&path);
            let before = old.remove(&path);
            let vanished =
                before.as_ref().is_some_and(|file| is_full(file.held.as_deref())) && !is_full(held.as_deref());
            let gone = vanished.then(|| before.as_ref().and_then(|file| file.gone).unwrap_or(now));
            let stamp = before.filter(|file| file.held == held).and_then(|file| file.stamp);
            self.files.insert(path.clone(), File { names: names(&path), held, stamp, gone });
        }
        self.listen()
    }

    /// Listens to the folders of the files, and to no others.
    fn listen(&mut self) -> Option<Diagnostic> {
        let watcher = self.watcher.as_mut()?;
        let wanted: BTreeSet<PathBuf> =
            self.files.values().flat_map(|file| &file.names).filter_map(|name| existing_folder(name)).collect();
        self.folders.retain(|folder, identity| {
            let keep = wanted.contains(folder) && identity.is_some() && *identity == identity_of(folder);
            if !keep {
                // It may be gone already.
                let _ = watcher.unwatch(folder);
            }
            keep
        });
        let mut fault = None;
        for folder in wanted {
            if self.folders.contains_key(&folder) {
                continue;
            }
            let identity = identity_of(&folder);
            match watcher.watch(&folder, RecursiveMode::NonRecursive) {
                Ok(()) => drop(self.folders.insert(folder, identity)),
                // A folder that is gone again is met at the next look.
                Err(_) if !folder.is_dir() => {}
                Err(error) => fault = Some(without_events(&error).in_file(folder)),
            }
        }
        fault
    }

    /// Whether an event at a path can be about a file that is followed.
    pub fn concerns(&self, touched: &Path) -> bool {
        self.files.values().any(|file| file.is_meant(touched))
    }

    /// Looks at the files that an event may be about; with no paths, at all whose size or time is another.
    pub fn check(&mut self, touched: &BTreeSet<PathBuf>) -> Changes {
        let now = Instant::now();
        let mut changes = Changes::default();
        let mut anew = false;
        for (path, file) in &mut self.files {
            let stamp = stamp_of(path);
            let is_due = file.gone.is_some() || file.stamp != stamp || touched.iter().any(|path| file.is_meant(path));
            if !is_due {
                continue;
            }
            anew |= file.stamp.is_some() != stamp.is_some();
            file.stamp = stamp;
            match file.judge(path, now) {
                Verdict::Same => {}
                Verdict::Waiting => changes.waiting = true,
                Verdict::Changed => changes.changed.push(path.clone()),
            }
        }
        let replaced = |(folder, identity): (&PathBuf, &Option<Identity>)| *identity != identity_of(folder);
        if anew || self.folders.iter().any(replaced) {
            // What cannot be listened to was told when it was first met.
            let _ = self.listen();
        }
        changes
    }

    /// How many files are followed, and how many folders are listened to.
    pub fn counts(&self) -> (usize, usize) {
        (self.files.len(), self.folders.len())
    }
}

enum Verdict {
    Same,
    Waiting,
    Changed,
}

impl File {
    /// Whether an event at a path can be about this file: it is its own, or that of a folder on the way.
    fn is_meant(&self, touched: &Path) -> bool {
        self.names.iter().any(|name| name.starts_with(touched))
    }

    fn judge(&mut self, path: &Path, now: Instant) -> Verdict {
        let current = std::fs::read(path).ok();
        let was_full = is_full(self.held.as_deref()) || self.gone.is_some();
        if was_full && !is_full(current.as_deref()) {
            let since = *self.gone.get_or_insert(now);
            if now.duration_since(since) < PATIENCE {
                return Verdict::Waiting;
            }
            // It stays away: from now on that is how it is.
            (self.gone, self.held) = (None, current.map(Arc::from));
            return Verdict::Changed;
        }
        self.gone = None;
        if current.as_deref() == self.held.as_deref() { Verdict::Same } else { Verdict::Changed }
    }
}

fn is_full(contents: Option<&[u8]>) -> bool {
    contents.is_some_and(|contents| !contents.is_empty())
}

fn without_events(error: &notify::Error) -> Diagnostic {
    Diagnostic::warning(format!("the system does not report changes of files: {error}"))
        .hint("files are looked at once a second instead")
}

/// What an event says: `None` if it cannot change contents, else whether a file is complete.
fn is_complete(kind: EventKind) -> Option<bool> {
    match kind {
        EventKind::Access(AccessKind::Close(AccessMode::Write)) => Some(true),
        EventKind::Access(_) => None,
        EventKind::Modify(ModifyKind::Name(RenameMode::To | RenameMode::Both)) => Some(true),
        _ => Some(false),
    }
}

/// The names of a file in events: its folder's one true path and its own name, and what it leads to if it is a link.
fn names(path: &Path) -> Vec<PathBuf> {
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let folder = absolute.parent().and_then(|folder| folder.canonicalize().ok());
    let own = match (folder, absolute.file_name()) {
        (Some(folder), Some(name)) => folder.join(name),
        _ => absolute,
    };
    let real = path.canonicalize().ok().filter(|real| *real != own);
    std::iter::once(own).chain(real).collect()
}

/// The folder of a file, or the nearest one above that is there.
fn existing_folder(name: &Path) -> Option<PathBuf> {
    name.ancestors().skip(1).find(|folder| folder.is_dir()).map(Path::to_owned)
}

fn stamp_of(path: &Path) -> Option<Stamp> {
    let metadata = std::fs::metadata(path).ok()?;
    Some((metadata.len(), metadata.modified().ok()))
}

#[cfg(unix)]
fn identity_of(folder: &Path) -> Option<Identity> {
    use std::os::unix::fs::MetadataExt;
    let metadata = std::fs::metadata(folder).ok()?;
    Some((metadata.dev(), metadata.ino()))
}

#[cfg(not(unix))]
fn identity_of(folder: &Path) -> Option<Identity> {
    folder.is_dir().then_some((0, 0))
}
