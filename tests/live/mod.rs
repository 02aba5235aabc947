//! Live: files that change, errors that come and go, edits, the page, viewers. Nothing here asserts how long anything
//! takes; whatever is waited for has a minute to come.

mod browser;
mod command;
mod edits;
mod errors;
mod files;
mod http;
mod latency;
mod page;
mod tev;

use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use tusche::live::{LivePicture, News, SessionOptions, Watch, WatchHandle, WatchOptions};
use tusche::render::SceneRequest;
use tusche::scene::file::LoadOptions;
use tusche::shade::ShadingMode;

use crate::common::Workplace;

/// How long anything may take before a test gives up.
const LIMIT: Duration = Duration::from_secs(60);

const SCENE: &str = r#"# A ball.
[render]
size = [32, 24]
samples = 2
background = [0.25, 0.25, 0.25]

[camera]
position = [0.0, 0.0, 5.0]
target = [0.0, 0.0, 0.0]

[materials.ink]
shader = "ink.rhai"
params = { paper = [0.8, 0.7, 0.5] }

[[objects]]
name = "ball"
shape = "sphere"
material = "ink"
"#;

const INK: &str = "fn params() {
    #{
        paper: rgb(0.9, 0.9, 0.9),
        ink_width: 2.0,     // pixels, 0 … 12
    }
}
fn surface(hit, p) { #{ color: p.paper, line_width: p.ink_width } }
";

fn place() -> Workplace {
    let place = Workplace::new();
    place.file("scene.toml", SCENE);
    place.file("ink.rhai", INK);
    place
}

/// What to watch in a place, with neither page nor files.
fn options(place: &Workplace) -> WatchOptions {
    WatchOptions {
        scene: SceneRequest {
            path: place.folder.path().join("scene.toml"),
            overrides: Vec::new(),
            options: LoadOptions::default(),
            lines: true,
            shading: ShadingMode::Auto,
        },
        outputs: Vec::new(),
        layers: Vec::new(),
        session: SessionOptions { threads: 1, ..SessionOptions::default() },
        page: None,
        tev: None,
    }
}

/// A watch that runs on a thread of its own.
struct Watching {
    handle: WatchHandle,
    url: Option<String>,
    news: Receiver<News>,
    thread: Option<JoinHandle<()>>,
}

impl Watching {
    fn start(options: WatchOptions) -> Self {
        let watch = Watch::new(options).unwrap_or_else(|fault| panic!("{fault}"));
        let (handle, url) = (watch.handle(), watch.url().map(str::to_owned));
        let (sender, news) = channel();
        let thread = std::thread::spawn(move || watch.run(&mut |news| drop(sender.send(news))));
        Self { handle, url, news, thread: Some(thread) }
    }

    /// The first news of a kind; what comes before is dropped.
    #[track_caller]
    fn wait<T>(&self, what: &str, wanted: impl FnMut(&News) -> Option<T>) -> T {
        self.wait_and_see(what, wanted).0
    }

    /// The same, with what came before.
    #[track_caller]
    fn wait_and_see<T>(&self, what: &str, mut wanted: impl FnMut(&News) -> Option<T>) -> (T, Vec<News>) {
        let end = Instant::now() + LIMIT;
        let mut before = Vec::new();
        loop {
            match self.news.recv_timeout(end.saturating_duration_since(Instant::now())) {
                Ok(news) => match wanted(&news) {
                    Some(found) => return (found, before),
                    None => before.push(news),
                },
                Err(_) => panic!("no {what} came; news were {before:#?}"),
            }
        }
    }

    /// The next final picture of the newest setup.
    #[track_caller]
    fn picture(&self) -> Arc<LivePicture> {
        self.picture_with("final picture", |_| true)
    }

    /// The next final picture with something about it.
    #[track_caller]
    fn picture_with(&self, what: &str, is_wanted: impl Fn(&LivePicture) -> bool) -> Arc<LivePicture> {
        self.wait(what, |news| match news {
            News::Picture { picture, after: Some(_) } if picture.is_final && is_wanted(picture) => {
                Some(Arc::clone(picture))
            }
            _ => None,
        })
    }

    #[track_caller]
    fn faults(&self) -> String {
        self.wait("fault", |news| match news {
            News::Faults(faults) => Some(faults.to_string()),
            _ => None,
        })
    }

    #[track_caller]
    fn mended(&self) {
        self.wait("mend", |news| matches!(news, News::Mended).then_some(()));
    }

    fn url(&self) -> &str {
        self.url.as_deref().expect("there is a page")
    }
}

impl Drop for Watching {
    fn drop(&mut self) {
        self.handle.stop();
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
            && !std::thread::panicking()
        {
            panic!("the watch panicked");
        }
    }
}

/// The background's red: the upper left pixel.
fn background(picture: &LivePicture) -> f32 {
    picture.channels[0][0]
}

/// The middle of the ball, green.
fn paper(picture: &LivePicture) -> f32 {
    picture.channels[1][12 * 32 + 16]
}

/// Pixels that differ from background and ball: roughly the inked area.
fn inked(picture: &LivePicture) -> usize {
    picture.channels[0].iter().filter(|red| **red < 0.2).count()
}

fn is_near(a: f32, b: f32) -> bool {
    (a - b).abs() < 2e-3
}

/// The scene with another background.
fn with_background(grey: f32) -> String {
    let changed = SCENE.replace("background = [0.25, 0.25, 0.25]", &format!("background = [{grey}, {grey}, {grey}]"));
    assert_ne!(changed, SCENE);
    changed
}

/// Writes as many editors do: beside the file, then over it.
fn replace(path: &Path, contents: impl AsRef<[u8]>) {
    let beside = path.with_extension("tmp~");
    std::fs::write(&beside, contents).expect("files can be written");
    std::fs::rename(&beside, path).expect("files can be renamed");
}
