//! The driver: the loop between files, the session, pages, viewers and picture files.
//!
//! One thread owns all of it and takes one message after the other: files were touched, the session has news, a page wants
//! something, it is time to stop. Whatever is wrong with the scene is a state that is told and ends with the next good
//! load; the last good picture stays meanwhile.
//!
//! A setup that arrives while the picture before it is still on its way drops that at once, with two exceptions that keep
//! pictures coming however fast a scene is saved or a slider is dragged: it waits up to `GRACE` for the first picture of
//! the one before, and after `MOST_DROPPED` dropped ones in a row for as long as it takes.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::board::{Board, ShownPicture, Topic};
use super::controls::controls;
use super::edit::Edits;
use super::follow::{Follower, POLL, Touched};
use super::outputs::Outputs;
use super::server::{Server, messages};
use super::tev::Tev;
use super::watch::{Command, Message, News, WatchOptions};
use super::{Event, Kept, LivePicture, Session, Setup};
use crate::diag::{Diagnostic, Diagnostics};
use crate::files::FileStore;
use crate::film::{Layer, write_atomically};
use crate::render::request::{layers_for, whole_layers};
use crate::render::{LoadedScene, PictureFile, SceneRequest, layers_of};
use crate::scene::file;
use crate::scene::settings::{Background, RenderSettings};

/// How long files may still be coming after one is known to be complete.
const QUIET: Duration = Duration::from_millis(3);
/// How long after the first sign of a change nothing more is waited for.
const BATCH: Duration = Duration::from_millis(25);
/// How long a new setup waits for the first picture of the one before.
const GRACE: Duration = Duration::from_millis(150);
/// How many setups in a row are dropped before they have a picture.
const MOST_DROPPED: u32 = 8;
/// How often a load that failed because files were changing under it is tried again before that is told.
const MOST_RETRIES: u32 = 8;
/// How soon to look again at files that are gone or empty.
const SOON: Duration = Duration::from_millis(50);
/// How often pages hear of progress.
const PROGRESS: Duration = Duration::from_millis(40);
/// From when on: what is done sooner needs no bar, and a browser on the same cores would only hold it up.
const PROGRESS_FROM: Duration = Duration::from_millis(200);

pub(super) struct Driver {
    options: WatchOptions,
    session: Arc<Session>,
    board: Arc<Board>,
    follower: Follower,
    outputs: Outputs,
    pub(super) server: Option<Server>,
    tev: Option<Tev>,
    events: Option<JoinHandle<()>>,
    /// What to tell first.
    trouble: Option<Diagnostic>,

    /// What the last load read.
    store: FileStore,
    edits: Edits,
    /// The name of the layer that pages show.
    layer: String,
    batch: Option<Batch>,
    /// Since when a load is due, and of which files the contents are known to be others.
    due: Option<Due>,
    /// When to look again at files that are gone or empty.
    look_again: Option<Instant>,
    retries: u32,
    /// Faults that may pass, since files are still changing.
    held_back: Option<Diagnostics>,

    current: Option<Current>,
    /// Setups in a row that were dropped without a picture.
    dropped: u32,
    faults: Diagnostics,
    warnings: Diagnostics,
    /// What the gate stopped in the last picture, and errors of scripts there; and what was told of both.
    gated: Diagnostics,
    script_errors: Diagnostics,
    told: [Diagnostics; 2],
    /// When pages last heard of progress.
    progress: Option<Instant>,
    /// What was kept of the last picture.
    kept: Kept,
    /// What was loaded, until pages are told of it: that waits for the picture, since telling takes time on the same cores.
    untold: Option<SceneRequest>,
}

/// Events that belong together.
struct Batch {
    paths: BTreeSet<PathBuf>,
    began: Instant,
    ends: Instant,
}

#[derive(Default)]
struct Due {
    since: Option<Instant>,
    changed: Vec<PathBuf>,
}

/// The setup that the session works on.
struct Current {
    generation: u64,
    /// When the session got it.
    began: Instant,
    /// When the change that it shows was noticed.
    noticed: Instant,
    /// Whether it has a picture, or cannot have one.
    settled: bool,
    settings: RenderSettings,
    files: Vec<PictureFile>,
    layer: Layer,
}

impl Driver {
    #[expect(clippy::too_many_arguments, reason = "the parts are made one by one, each of which can fail")]
    pub(super) fn new(
        options: WatchOptions,
        session: Arc<Session>,
        board: Arc<Board>,
        follower: Follower,
        outputs: Outputs,
        server: Option<Server>,
        tev: Option<Tev>,
        events: JoinHandle<()>,
        trouble: Option<Diagnostic>,
    ) -> Self {
        let layer = options.layers.first().cloned().unwrap_or_else(|| Layer::Rgba.to_string());
        Self {
            options,
            session,
            board,
            follower,
            outputs,
            server,
            tev,
            events: Some(events),
            trouble,
            store: FileStore::new(),
            edits: Edits::default(),
            layer,
            batch: None,
            due: Some(Due { since: Some(Instant::now()), changed: Vec::new() }),
            look_again: None,
            retries: 0,
            held_back: None,
            current: None,
            dropped: 0,
            faults: Diagnostics::default(),
            warnings: Diagnostics::default(),
            gated: Diagnostics::default(),
            script_errors: Diagnostics::default(),
            told: Default::default(),
            progress: None,
            kept: Kept::All,
            untold: None,
        }
    }

    pub(super) fn run(&mut self, receiver: &Receiver<Message>, tell: &mut dyn FnMut(News)) {
        if let Some(trouble) = self.trouble.take() {
            tell(News::Trouble(trouble));
        }
        let mut next_poll = Instant::now() + POLL;
        loop {
            let now = Instant::now();
            if now >= next_poll {
                next_poll = now + POLL;
                self.look(&BTreeSet::new(), now);
            }
            if self.batch.as_ref().is_some_and(|batch| now >= batch.ends)
                && let Some(batch) = self.batch.take()
            {
                self.look(&batch.paths, batch.began);
            }
            if self.look_again.is_some_and(|at| now >= at) {
                self.look_again = None;
                self.look(&BTreeSet::new(), now);
            }
            if self.due.is_none()
                && self.look_again.is_none()
                && let Some(faults) = self.held_back.take()
            {
                self.fail(faults, tell);
            }
            let start = self.due.is_some().then(|| self.may_start());
            if let Some(Start::Now) = start {
                self.load(tell);
                continue;
            }
            let wake = match start {
                Some(Start::At(at)) => Some(at),
                _ => None,
            };
            let wakes = [Some(next_poll), self.batch.as_ref().map(|batch| batch.ends), self.look_again, wake];
            let wait =
                wakes.into_iter().flatten().min().map_or(POLL, |at| at.saturating_duration_since(Instant::now()));
            match receiver.recv_timeout(wait) {
                Ok(Message::Stop) | Err(RecvTimeoutError::Disconnected) => return,
                Ok(message) => self.take(message, tell),
                Err(RecvTimeoutError::Timeout) => {}
            }
        }
    }

    /// Ends all threads.
    pub(super) fn close(mut self) {
        // The server and its requests hold the session, whose end ends the thread of events.
        drop(self.server.take());
        drop(self.tev.take());
        drop(self.session);
        if let Some(events) = self.events.take() {
            let _ = events.join();
        }
        self.outputs.close();
    }

    fn take(&mut self, message: Message, tell: &mut dyn FnMut(News)) {
        match message {
            Message::Touched(touched) => self.touched(touched),
            Message::Session(event) => self.hear(event, tell),
            Message::Command(command) => self.obey(command, tell),
            Message::Written(Ok(path)) => tell(News::Wrote(path)),
            Message::Written(Err(fault)) => self.trouble(fault, tell),
            Message::Viewer(Ok(note)) => {
                self.board.post(Topic::Note, messages::note(&note, false));
                tell(News::Note(note));
            }
            Message::Viewer(Err(fault)) => self.trouble(fault, tell),
            Message::Stop => {}
        }
    }

    fn trouble(&self, fault: Diagnostic, tell: &mut dyn FnMut(News)) {
        self.board.post(Topic::Note, messages::note(&fault.to_string(), true));
        tell(News::Trouble(fault));
    }

    fn touched(&mut self, touched: Touched) {
        let lost = touched.paths.is_empty();
        let meant = touched.paths.into_iter().filter(|path| self.follower.concerns(path));
        let meant: Vec<_> = meant.collect();
        if meant.is_empty() && !lost {
            return;
        }
        let now = Instant::now();
        let batch = self.batch.get_or_insert_with(|| Batch { paths: BTreeSet::new(), began: now, ends: now + BATCH });
        batch.paths.extend(meant);
        if touched.complete {
            batch.ends = (now + QUIET).min(batch.began + BATCH);
        }
    }

    /// Looks at files, and sees to it that what has changed is loaded.
    fn look(&mut self, touched: &BTreeSet<PathBuf>, noticed: Instant) {
        let changes = self.follower.check(touched);
        if changes.waiting {
            self.look_again.get_or_insert(Instant::now() + SOON);
        }
        if !changes.changed.is_empty() {
            let due = self.due.get_or_insert_default();
            due.since.get_or_insert(noticed);
            due.changed.extend(changes.changed);
        }
    }

    fn may_start(&self) -> Start {
        match &self.current {
            Some(current) if !current.settled && self.dropped >= MOST_DROPPED => Start::Later,
            Some(current) if !current.settled && current.began.elapsed() < GRACE => Start::At(current.began + GRACE),
            _ => Start::Now,
        }
    }

    /// Loads the scene and gives it to the session, or tells what is wrong.
    fn load(&mut self, tell: &mut dyn FnMut(News)) {
        let due = self.due.take().unwrap_or_default();
        self.held_back = None;
        // It tells of files as they were read then.
        self.post_scene();
        let noticed = due.since.unwrap_or_else(Instant::now);
        let store = self.store.succeeded(&due.changed);
        let mut request = self.options.scene.clone();
        let loaded = self.edits.overrides().and_then(|overrides| {
            request.overrides.extend(overrides);
            let loaded = request.load(&store)?;
            let files = self.files(&loaded, &store)?;
            Ok((loaded, files))
        });
        // Edits that cannot even be written down (a bug) keep the scene from being read.
        if !store.dependencies().is_empty() {
            if let Some(trouble) = self.follower.follow(&store) {
                self.trouble(trouble, tell);
            }
            self.store = store;
        }
        // Files may have changed since they were read, and nobody listened to new ones until now.
        self.look(&BTreeSet::new(), noticed);
        match loaded {
            Ok((loaded, files)) => self.show(request, loaded, files, noticed, tell),
            Err(faults) if (self.due.is_some() || self.look_again.is_some()) && self.retries < MOST_RETRIES => {
                self.retries += 1;
                self.held_back = Some(faults);
            }
            Err(faults) => {
                self.retries = 0;
                self.fail(faults, tell);
            }
        }
    }

    /// The picture files with their layers.
    fn files(&self, loaded: &LoadedScene, store: &FileStore) -> Result<Vec<PictureFile>, Diagnostics> {
        let read = store.dependencies();
        let file = |path: &PathBuf| {
            if read.iter().any(|known| is_same_file(known, path)) {
                let fault = Diagnostic::error("the scene reads this file, so no picture can be written to it");
                return Err(fault.in_file(path));
            }
            let layers = layers_for(path, &self.options.layers, &loaded.scene, &loaded.shaders)?;
            Ok(PictureFile { path: path.clone(), layers })
        };
        Ok(self.options.outputs.iter().map(file).collect::<Result<_, _>>()?)
    }

    fn show(
        &mut self,
        request: SceneRequest,
        loaded: LoadedScene,
        files: Vec<PictureFile>,
        noticed: Instant,
        tell: &mut dyn FnMut(News),
    ) {
        let LoadedScene { scene, shaders, warnings } = loaded;
        // A script's extra layer goes when the script does.
        let layer = Layer::parse(&self.layer, shaders.aovs()).unwrap_or(Layer::Rgba);
        let mut layers = layers_of(&files);
        layers.push(layer.clone());
        layers.sort();
        layers.dedup();
        let settings = scene.render().clone();
        let generation = self.session.set_scene(Setup { scene, shaders, layers });
        if self.current.as_ref().is_some_and(|current| !current.settled) {
            self.dropped += 1;
        }
        let began = Instant::now();
        self.retries = 0;
        self.current = Some(Current { generation, began, noticed, settled: false, settings, files, layer });
        let (files, folders) = self.follower.counts();
        tell(News::Loaded { generation, files, folders });
        if self.faults.has_errors() {
            self.faults = Diagnostics::default();
            tell(News::Mended);
        }
        if self.warnings != warnings {
            self.warnings = warnings;
            if !self.warnings.is_empty() {
                tell(News::Warnings(self.warnings.clone()));
            }
        }
        self.untold = Some(request);
        self.post_faults();
    }

    fn fail(&mut self, faults: Diagnostics, tell: &mut dyn FnMut(News)) {
        if self.faults != faults {
            self.faults = faults;
            tell(News::Faults(self.faults.clone()));
        }
        self.post_faults();
        self.post_edits();
    }

    fn hear(&mut self, event: Event, tell: &mut dyn FnMut(News)) {
        match event {
            Event::Begun { .. } => {}
            Event::Progress { samples, share, .. } => {
                let is_slow = self.current.as_ref().is_none_or(|current| current.began.elapsed() >= PROGRESS_FROM);
                if is_slow {
                    self.post_scene();
                }
                if is_slow && self.progress.is_none_or(|last| last.elapsed() >= PROGRESS) {
                    self.progress = Some(Instant::now());
                    self.board.post(Topic::Progress, messages::progress(samples, share));
                }
                tell(News::Progress { samples, share });
            }
            Event::Picture(picture) => self.picture(picture, tell),
            Event::Failed { generation, faults } => {
                if let Some(current) = self.current.as_mut().filter(|current| current.generation == generation) {
                    current.settled = true;
                    self.dropped = 0;
                }
                self.post_scene();
                self.fail(faults, tell);
            }
        }
    }

    fn picture(&mut self, picture: Arc<LivePicture>, tell: &mut dyn FnMut(News)) {
        self.dropped = 0;
        let Some(current) = self.current.as_mut() else { return };
        let is_newest = current.generation == picture.generation;
        current.settled |= is_newest;
        let after = is_newest.then(|| current.noticed.elapsed());
        let transparent = current.settings.background == Background::Transparent;
        let layer = Some(&current.layer).filter(|layer| picture.layers.contains(layer)).or(picture.layers.first());
        if let Some(layer) = layer {
            let shown = ShownPicture { revision: 0, picture: Arc::clone(&picture), layer: layer.clone(), transparent };
            self.board.show(shown, |shown| messages::picture(shown, after));
        }
        if let Some(tev) = &self.tev {
            tev.show(&picture);
        }
        if picture.is_final && self.kept != picture.cache.kept {
            self.kept = picture.cache.kept;
            tell(News::Memory(picture.cache));
        }
        if is_newest && picture.is_final {
            for file in &current.files {
                self.outputs.write(file.clone(), current.settings.clone(), Arc::clone(&picture));
            }
        }
        if self.script_errors != picture.script_errors || self.gated != picture.warnings {
            self.script_errors.clone_from(&picture.script_errors);
            self.gated.clone_from(&picture.warnings);
            self.post_faults();
        }
        // Pictures on the way have the same faults at fewer hits.
        if picture.is_final && self.told != [picture.script_errors.clone(), picture.warnings.clone()] {
            self.told = [picture.script_errors.clone(), picture.warnings.clone()];
            if !picture.warnings.is_empty() {
                tell(News::Warnings(picture.warnings.clone()));
            }
            if picture.script_errors.has_errors() {
                tell(News::ScriptErrors(picture.script_errors.clone()));
            }
        }
        if is_newest {
            self.post_scene();
        }
        tell(News::Picture { picture, after });
    }

    fn obey(&mut self, command: Command, tell: &mut dyn FnMut(News)) {
        match command {
            Command::Edit(edits) => {
                for (path, value) in edits {
                    if let Err(fault) = self.edits.set(path, &value) {
                        self.trouble(fault, tell);
                    }
                }
                self.reload();
            }
            Command::Revert(None) => {
                self.edits.clear();
                self.reload();
            }
            Command::Revert(Some(paths)) => {
                paths.iter().for_each(|path| self.edits.remove(path));
                self.reload();
            }
            Command::Layer(name) => {
                self.layer = name;
                self.reload();
            }
            Command::Save(reply) => {
                let result = self.save();
                match &result {
                    Ok(()) => {
                        let path = self.options.scene.path.clone();
                        let note = format!("the edits are written to {}", path.display());
                        self.board.post(Topic::Note, messages::note(&note, false));
                        tell(News::Saved(path));
                        self.reload();
                    }
                    Err(faults) => faults.0.iter().for_each(|fault| self.trouble(fault.clone(), tell)),
                }
                // A page that is gone does not want to know.
                let _ = reply.send(result);
            }
        }
    }

    fn reload(&mut self) {
        self.due.get_or_insert_default().since.get_or_insert_with(Instant::now);
    }

    /// Writes the edits into the scene file as it is now.
    fn save(&mut self) -> Result<(), Diagnostics> {
        let path = &self.options.scene.path;
        if !is_scene_file(path) {
            let fault = Diagnostic::error("a bare model has no scene file to write to").in_file(path);
            return Err(fault.hint("copy the edits as TOML into a scene file of your own").into());
        }
        let text = FileStore::new().read_text(path)?;
        let text = self.edits.written_into(&text.text)?;
        write_atomically(path, |sink| sink.write_all(text.as_bytes()))?;
        // An override would hide what was just written.
        let written: Vec<_> = self.edits.paths().cloned().collect();
        self.options.scene.overrides.retain(|known| !written.iter().any(|path| known.path().eq(path)));
        self.edits.clear();
        // The file's own event would come, too, but later.
        self.due.get_or_insert_default().changed.push(path.clone());
        Ok(())
    }

    /// Tells pages all about the scene that was loaded, unless they know.
    fn post_scene(&mut self) {
        let Some(request) = self.untold.take() else { return };
        let Some(setup) = self.session.setup() else { return };
        let written = file::written(&request.path, &self.store, &request.overrides).unwrap_or_default();
        let groups = controls(&written, &setup.scene, &setup.shaders, &self.edits);
        let layers = Layer::FIXED.into_iter().filter(|layer| {
            let may_be_empty = matches!(layer, Layer::HiddenLine | Layer::Feature);
            !may_be_empty || whole_layers(&setup.scene, &setup.shaders).contains(layer)
        });
        let own = setup.shaders.aovs().iter().enumerate().map(|(index, name)| Layer::Aov(index, name.clone()));
        let layers: Vec<_> = layers.chain(own).map(|layer| layer.to_string()).collect();
        let path = &self.options.scene.path;
        self.board.post(
            Topic::Scene,
            messages::scene(&messages::Scene {
                name: path.display().to_string(),
                is_writable: is_scene_file(path),
                layers,
                layer: self.current.as_ref().map_or(String::new(), |current| current.layer.to_string()),
                groups: Some(groups),
                edits: self.edits.paths().cloned().collect(),
                toml: self.edits.toml(),
            }),
        );
    }

    /// Tells pages of the edits where the scene itself cannot be told of.
    fn post_edits(&self) {
        let path = &self.options.scene.path;
        self.board.post(
            Topic::Scene,
            messages::scene(&messages::Scene {
                name: path.display().to_string(),
                is_writable: is_scene_file(path),
                layers: Vec::new(),
                layer: self.layer.clone(),
                groups: None,
                edits: self.edits.paths().cloned().collect(),
                toml: self.edits.toml(),
            }),
        );
    }

    fn post_faults(&self) {
        let has_picture = self.session.picture().is_some();
        let text = messages::faults([&self.faults, &self.script_errors, &self.gated, &self.warnings], has_picture);
        self.board.post(Topic::Faults, text);
    }
}

enum Start {
    Now,
    At(Instant),
    /// Once there is a picture.
    Later,
}

fn is_scene_file(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"))
}

fn is_same_file(a: &Path, b: &Path) -> bool {
    match (a.canonicalize(), b.canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        _ => false,
    }
}
