//! A session: one thread that always works on the newest setup, and tells its subscribers what comes of it.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

use crate::diag::{Diagnostic, Diagnostics};
use crate::film::{FilmTile, Layer};
use crate::plan::Plan;
use crate::render::stats::Stats;
use crate::render::{Control, RenderOptions, render};
use crate::sample::PixelRect;
use crate::scene::Scene;
use crate::shade::Shaders;

/// What is to be shown.
#[derive(Debug)]
pub struct Setup {
    /// The scene; its `render.samples` are those of the final picture.
    pub scene: Scene,
    /// Its shaders.
    pub shaders: Shaders,
    /// The layers to develop, each once.
    pub layers: Vec<Layer>,
}

/// How a session works; none of it changes the final picture.
#[derive(Clone, Debug)]
pub struct SessionOptions {
    /// Threads; 0 for as many as the machine has.
    pub threads: usize,
    /// Side of a tile in pixels.
    pub tile: u32,
    /// The most bytes that are kept so that later edits need less work; what goes beyond is worked out again.
    pub cache_bytes: u64,
    /// Whether pictures of fewer samples (1, 2, 4, …) are shown on the way to the final one where that takes a while.
    pub progressive: bool,
}

impl Default for SessionOptions {
    fn default() -> Self {
        Self { threads: 0, tile: 32, cache_bytes: 2 << 30, progressive: true }
    }
}

/// A complete picture.
#[derive(Clone, Debug)]
pub struct LivePicture {
    /// Which [`Session::set_scene`] it shows, counted from 1.
    pub generation: u64,
    /// Samples per pixel.
    pub samples: u32,
    /// Whether it has all samples that the scene asks for.
    pub is_final: bool,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Its layers.
    pub layers: Vec<Layer>,
    /// The channels of all layers, one after the other, row by row, linear.
    pub channels: Vec<Vec<f32>>,
    /// What may differ from the picture shown before.
    pub changed: PixelRect,
    /// What it cost.
    pub stats: Stats,
    /// What the gate stopped.
    pub warnings: Diagnostics,
    /// Run-time errors of scripts; they mark hits but do not stop the picture.
    pub script_errors: Diagnostics,
}

/// What subscribers hear.
#[derive(Clone, Debug)]
pub enum Event {
    /// Work on a generation has begun; what was under way before is dropped.
    Begun {
        /// Which.
        generation: u64,
    },
    /// The share of a picture that is done, 0 … 1.
    Progress {
        /// Of which generation.
        generation: u64,
        /// Samples per pixel of the picture under way.
        samples: u32,
        /// How much.
        share: f64,
    },
    /// A complete picture, with fewer samples than the scene asks for or with all.
    Picture(Arc<LivePicture>),
    /// Rendering was not possible at all.
    Failed {
        /// Which.
        generation: u64,
        /// Why.
        faults: Diagnostics,
    },
}

/// Renders the newest setup in the background. Dropping it ends the work.
pub struct Session {
    shared: Arc<Shared>,
    worker: Option<JoinHandle<()>>,
}

struct Shared {
    options: SessionOptions,
    state: Mutex<State>,
    changed: Condvar,
    /// Told to work that has become pointless.
    cancel: AtomicBool,
}

#[derive(Default)]
struct State {
    generation: u64,
    /// The newest setup, until the worker takes it.
    next: Option<Arc<Setup>>,
    /// The setup that is shown, or being worked on.
    setup: Option<Arc<Setup>>,
    picture: Option<Arc<LivePicture>>,
    failed: Option<(u64, Diagnostics)>,
    subscribers: Vec<Sender<Event>>,
    closed: bool,
}

impl Session {
    /// A session that shows nothing yet.
    ///
    /// # Errors
    /// If no thread can be started.
    pub fn new(options: SessionOptions) -> Result<Self, Diagnostic> {
        let shared = Arc::new(Shared {
            options,
            state: Mutex::default(),
            changed: Condvar::new(),
            cancel: AtomicBool::new(false),
        });
        let of_worker = Arc::clone(&shared);
        let worker = std::thread::Builder::new()
            .name("session".into())
            .spawn(move || of_worker.work())
            .map_err(|error| Diagnostic::error(format!("cannot start a thread: {error}")))?;
        Ok(Self { shared, worker: Some(worker) })
    }

    /// Shows a scene from now on; work on what was shown before is dropped. Returns the generation.
    pub fn set_scene(&self, setup: Setup) -> u64 {
        let mut state = self.shared.lock();
        state.generation += 1;
        state.next = Some(Arc::new(setup));
        self.shared.cancel.store(true, Ordering::Relaxed);
        self.shared.changed.notify_all();
        state.generation
    }

    /// The setup that is shown or being worked on.
    #[must_use]
    pub fn setup(&self) -> Option<Arc<Setup>> {
        let state = self.shared.lock();
        state.next.clone().or_else(|| state.setup.clone())
    }

    /// The last complete picture.
    #[must_use]
    pub fn picture(&self) -> Option<Arc<LivePicture>> {
        self.shared.lock().picture.clone()
    }

    /// Waits for the final picture of the newest setup.
    ///
    /// # Errors
    /// If nothing was set, or rendering was not possible.
    pub fn render(&self) -> Result<Arc<LivePicture>, Diagnostics> {
        let mut state = self.shared.lock();
        loop {
            let generation = state.generation;
            match &state.picture {
                _ if generation == 0 => return Err(Diagnostic::error("the session has no scene yet").into()),
                Some(picture) if picture.generation == generation && picture.is_final => {
                    return Ok(Arc::clone(picture));
                }
                _ => {}
            }
            if let Some((failed, faults)) = &state.failed
                && *failed == generation
            {
                return Err(faults.clone());
            }
            state = self.shared.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Events from now on. A subscriber that is dropped is forgotten.
    #[must_use]
    pub fn subscribe(&self) -> Receiver<Event> {
        let (sender, receiver) = channel();
        self.shared.lock().subscribers.push(sender);
        receiver
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        self.shared.lock().closed = true;
        self.shared.cancel.store(true, Ordering::Relaxed);
        self.shared.changed.notify_all();
        if let Some(worker) = self.worker.take() {
            // A worker that panicked has nothing left to say.
            let _ = worker.join();
        }
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn tell(&self, event: &Event) {
        self.lock().subscribers.retain(|subscriber| subscriber.send(event.clone()).is_ok());
    }

    /// The worker's life.
    fn work(&self) {
        loop {
            let (setup, generation) = {
                let mut state = self.lock();
                loop {
                    if state.closed {
                        return;
                    }
                    if let Some(setup) = state.next.take() {
                        self.cancel.store(false, Ordering::Relaxed);
                        state.setup = Some(Arc::clone(&setup));
                        break (setup, state.generation);
                    }
                    state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
                }
            };
            self.tell(&Event::Begun { generation });
            if let Err(faults) = self.show(&setup, generation) {
                self.lock().failed = Some((generation, faults.clone()));
                self.tell(&Event::Failed { generation, faults });
                self.changed.notify_all();
            }
        }
    }

    /// Renders all pictures of a setup, until the final one or until a newer setup has come.
    fn show(&self, setup: &Setup, generation: u64) -> Result<(), Diagnostics> {
        let last = setup.scene.render().samples;
        let mut samples = if self.options.progressive { 1 } else { last };
        loop {
            let mut builder = setup.scene.clone().into_builder();
            builder.render.samples = samples;
            let scene = builder.build()?;
            let plan = Plan::new(&scene, &setup.shaders, &setup.layers);
            let size = scene.render().size;
            let whole = PixelRect::of_size(size);
            let counts: usize = setup.layers.iter().map(|layer| layer.channels().len()).sum();
            let channels = Mutex::new(vec![vec![0.0; whole.pixels()]; counts]);
            let progress = |share: f64| self.tell(&Event::Progress { generation, samples, share });
            let control = Control { cancel: Some(&self.cancel), progress: Some(&progress) };
            let options =
                RenderOptions { threads: self.options.threads, tile: self.options.tile, ..Default::default() };
            let put = |tile: &FilmTile| {
                let mut channels = channels.lock().unwrap_or_else(PoisonError::into_inner);
                for (all, part) in channels.iter_mut().zip(&tile.channels) {
                    let width = tile.rect.width() as usize;
                    for (row, values) in part.chunks(width).enumerate() {
                        let start = (tile.rect.y0 as usize + row) * size[0] as usize + tile.rect.x0 as usize;
                        all[start..start + width].copy_from_slice(values);
                    }
                }
                Ok(())
            };
            let report = render(&scene, &setup.shaders, &plan, &options, &control, &put)?;
            if !report.complete {
                return Ok(());
            }
            let picture = Arc::new(LivePicture {
                generation,
                samples,
                is_final: samples == last,
                size,
                layers: setup.layers.clone(),
                channels: channels.into_inner().unwrap_or_else(PoisonError::into_inner),
                changed: whole,
                stats: report.stats,
                warnings: report.warnings,
                script_errors: report.script_errors,
            });
            self.lock().picture = Some(Arc::clone(&picture));
            self.tell(&Event::Picture(picture));
            self.changed.notify_all();
            if samples == last {
                return Ok(());
            }
            samples = (samples * 2).min(last);
        }
    }
}
