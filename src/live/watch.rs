//! Watching: what to watch, what is told of it, and a hold on it. The loop itself is in `driver`.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

use tokio::sync::oneshot;

use super::board::Board;
use super::driver::Driver;
use super::edit::KeyPath;
use super::follow::{Follower, Touched};
use super::outputs::Outputs;
use super::server::{PageOptions, Server};
use super::tev::Tev;
use super::{CacheUse, Event, LivePicture, Session, SessionOptions};
use crate::diag::{Diagnostic, Diagnostics};
use crate::render::SceneRequest;

/// What to watch, and who is to see it.
#[derive(Clone, Debug)]
pub struct WatchOptions {
    /// The scene.
    pub scene: SceneRequest,
    /// Picture files that are written again with every final picture.
    pub outputs: Vec<PathBuf>,
    /// Names of the layers to show and to write; empty for the default.
    pub layers: Vec<String>,
    /// How to render.
    pub session: SessionOptions,
    /// The page, if there is to be one.
    pub page: Option<PageOptions>,
    /// Where a tev viewer listens, as `HOST:PORT`.
    pub tev: Option<String>,
}

/// What happens while watching.
#[derive(Clone, Debug)]
pub enum News {
    /// The scene was loaded; a picture is on its way.
    Loaded {
        /// The session's generation.
        generation: u64,
        /// How many files are followed.
        files: usize,
        /// In how many folders.
        folders: usize,
    },
    /// What is questionable about the scene or the picture, if that is other than before.
    Warnings(Diagnostics),
    /// The scene cannot be shown; the last good picture stays. Told once for the same faults.
    Faults(Diagnostics),
    /// The scene can be shown again.
    Mended,
    /// How far a picture is.
    Progress {
        /// Its samples per pixel.
        samples: u32,
        /// The share that is done, 0 … 1.
        share: f64,
    },
    /// There is a picture.
    Picture {
        /// It.
        picture: Arc<LivePicture>,
        /// Time since the change that it shows was noticed; none if there is a newer one.
        after: Option<Duration>,
    },
    /// A script failed at some hits of the last picture; told once for the same errors.
    ScriptErrors(Diagnostics),
    /// The memory limit leaves room for less of the picture than before, or for more.
    Memory(CacheUse),
    /// A picture file was written.
    Wrote(PathBuf),
    /// A picture file could not be written, files cannot be followed as usual, or a viewer has gone away.
    Trouble(Diagnostic),
    /// Edits were written into the scene file.
    Saved(PathBuf),
    /// Something good about a viewer.
    Note(String),
}

/// What a page, or code, can ask for.
#[derive(Debug)]
pub(super) enum Command {
    /// Sets values.
    Edit(Vec<(KeyPath, serde_json::Value)>),
    /// Takes edits back; all if there is no list.
    Revert(Option<Vec<KeyPath>>),
    /// Shows another layer.
    Layer(String),
    /// Writes the edits into the scene file.
    Save(oneshot::Sender<Result<(), Diagnostics>>),
}

pub(super) enum Message {
    Touched(Touched),
    Session(Event),
    Command(Command),
    Written(Result<PathBuf, Diagnostic>),
    Viewer(Result<String, Diagnostic>),
    Stop,
}

/// A hold on a [`Watch`] from elsewhere. Cheap to clone.
#[derive(Clone)]
pub struct WatchHandle {
    sender: Sender<Message>,
}

impl WatchHandle {
    /// Ends watching soon.
    pub fn stop(&self) {
        // One that has ended already needs no end.
        let _ = self.sender.send(Message::Stop);
    }

    /// Sets a value of the scene without touching its file.
    pub fn edit(&self, path: KeyPath, value: serde_json::Value) {
        self.send(Command::Edit(vec![(path, value)]));
    }

    /// Takes all edits back.
    pub fn revert(&self) {
        self.send(Command::Revert(None));
    }

    /// Writes the edits into the scene file; what comes of it is news.
    pub fn save(&self) {
        self.send(Command::Save(oneshot::channel().0));
    }

    pub(super) fn send(&self, command: Command) {
        let _ = self.sender.send(Message::Command(command));
    }
}

/// A scene that is being watched.
pub struct Watch {
    handle: WatchHandle,
    receiver: Receiver<Message>,
    driver: Driver,
}

impl Watch {
    /// Prepares to watch; nothing is loaded before [`run`](Self::run).
    ///
    /// # Errors
    /// If the page's address cannot be had, or no thread can be started.
    pub fn new(options: WatchOptions) -> Result<Self, Diagnostic> {
        let (sender, receiver) = channel();
        let handle = WatchHandle { sender: sender.clone() };
        let session = Arc::new(Session::new(options.session.clone())?);
        let board = Arc::new(Board::new());
        let server = match &options.page {
            Some(page) => Some(Server::start(page, Arc::clone(&board), Arc::clone(&session), handle.clone())?),
            None => None,
        };
        let to_driver = sender.clone();
        let tell = move |touched| drop(to_driver.send(Message::Touched(touched)));
        let (follower, trouble) = Follower::new(tell);
        let to_driver = sender.clone();
        let written = move |result| drop(to_driver.send(Message::Written(result)));
        let outputs = Outputs::start(written)?;
        let to_driver = sender.clone();
        let viewer = move |result| drop(to_driver.send(Message::Viewer(result)));
        let name = options.scene.path.display().to_string();
        let tev = options.tev.clone().map(|address| Tev::start(address, name, viewer)).transpose()?;
        let events = forward(&session, sender)?;
        let driver = Driver::new(options, session, board, follower, outputs, server, tev, events, trouble);
        Ok(Self { handle, receiver, driver })
    }

    /// A hold on it for other threads.
    #[must_use]
    pub fn handle(&self) -> WatchHandle {
        self.handle.clone()
    }

    /// The address of the page, with its token, if there is a page.
    #[must_use]
    pub fn url(&self) -> Option<&str> {
        self.driver.server.as_ref().map(Server::url)
    }

    /// Watches until [`WatchHandle::stop`]; `tell` hears what happens.
    pub fn run(self, tell: &mut dyn FnMut(News)) {
        let Self { handle, receiver, mut driver } = self;
        driver.run(&receiver, tell);
        driver.close();
        drop(handle);
    }
}

/// Hands the session's events on; ends with the session.
fn forward(session: &Session, sender: Sender<Message>) -> Result<JoinHandle<()>, Diagnostic> {
    let events = session.subscribe();
    std::thread::Builder::new()
        .name("events".into())
        .spawn(move || {
            for event in events {
                if sender.send(Message::Session(event)).is_err() {
                    break;
                }
            }
        })
        .map_err(|error| Diagnostic::error(format!("cannot start a thread: {error}")))
}
