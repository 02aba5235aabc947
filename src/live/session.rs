//! A session: one thread that always works on the newest setup, and tells its subscribers what comes of it.

use std::fmt;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

use rayon::prelude::*;

use super::stages::{Outcome, Prepared, Redone, Stages};
use crate::diag::{Diagnostic, Diagnostics, Source};
use crate::film::{FilmTile, Layer};
use crate::render::stats::Stats;
use crate::render::{Control, RenderOptions, render};
use crate::sample::PixelRect;
use crate::scene::Scene;
use crate::scene::settings::RenderSettings;
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

/// What is kept of a picture so that later edits need less work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kept {
    /// Samples, lines, and what rays met.
    All,
    /// Not what rays met: they are traced again when hits must be shaded.
    Samples,
    /// No more than the picture: every edit renders all of it again.
    Nothing,
}

/// Memory that is used so that later edits need less work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CacheUse {
    /// What the limit leaves room for.
    pub kept: Kept,
    /// About how many bytes it takes to keep all.
    pub needed: u64,
    /// How many may be used: [`SessionOptions::cache_bytes`].
    pub limit: u64,
}

impl fmt::Display for CacheUse {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mib = |bytes: u64| bytes.div_ceil(1 << 20);
        let lacking = match self.kept {
            Kept::All => return write!(f, "all is kept: about {} MiB", mib(self.needed)),
            Kept::Samples => "what rays met is not kept, and traced again when a shader or a light changes",
            Kept::Nothing => "only the picture is kept, and every edit renders all of it again",
        };
        write!(f, "the memory limit is {} MiB and about {} are needed: {lacking}", mib(self.limit), mib(self.needed))
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
    /// What was done again for it.
    pub redone: Redone,
    /// What is kept of it.
    pub cache: CacheUse,
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

    /// Gives a script of the scene another text; all else stays as it was set last. `name` is what messages call the
    /// script, or the end of it behind a `/`. Modules and textures that the text names must be among those that the
    /// scene's scripts name already. Returns the generation and the warnings.
    ///
    /// # Errors
    /// If nothing was set, there is no such script, or the text is at fault; then what was shown before stays.
    pub fn set_shader(&self, name: &str, text: &str) -> Result<(u64, Diagnostics), Diagnostics> {
        let setup = self.setup().ok_or_else(|| Diagnostic::error("the session has no scene yet"))?;
        let mut builder = setup.scene.clone().into_builder();
        let is_meant = |known: &str| known == name || known.strip_suffix(name).is_some_and(|rest| rest.ends_with('/'));
        let Some(script) = builder.scripts.iter_mut().find(|script| is_meant(&script.source.name)) else {
            let names: Vec<&str> = setup.scene.scripts().iter().map(|script| script.source.name.as_str()).collect();
            let fault = Diagnostic::error(format!("the scene has no script `{name}`"));
            return Err(fault.hint(format!("it has: {}", names.join(", "))).into());
        };
        script.source = Source::new(script.source.name.clone(), text);
        let scene = builder.build()?;
        let (shaders, warnings) = setup.shaders.compile_again(&scene)?;
        Ok((self.set_scene(Setup { scene, shaders, layers: setup.layers.clone() }), warnings))
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

    /// Tells of progress if that is worth the waking of those who listen: `steps` are those that were told.
    fn tell_progress(&self, steps: &AtomicU32, generation: u64, samples: u32, share: f64) {
        let step = (share * PROGRESS_STEPS) as u32;
        if steps.fetch_max(step, Ordering::Relaxed) < step {
            self.tell(&Event::Progress { generation, samples, share });
        }
    }

    /// The worker's life.
    fn work(&self) {
        let pool = match rayon::ThreadPoolBuilder::new().num_threads(self.options.threads).build() {
            Ok(pool) => pool,
            Err(error) => return self.give_up(&Diagnostic::error(format!("cannot start rendering threads: {error}"))),
        };
        let mut kept = Memory::default();
        while let Some((setup, generation)) = self.next_setup() {
            self.tell(&Event::Begun { generation });
            if let Err(faults) = pool.install(|| self.show(&setup, generation, &mut kept)) {
                self.fail(generation, faults);
            }
        }
    }

    /// Waits for a setup that nobody has worked on yet; `None` once the session is closed.
    fn next_setup(&self) -> Option<(Arc<Setup>, u64)> {
        let mut state = self.lock();
        loop {
            if state.closed {
                return None;
            }
            if let Some(setup) = state.next.take() {
                self.cancel.store(false, Ordering::Relaxed);
                state.setup = Some(Arc::clone(&setup));
                return Some((setup, state.generation));
            }
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn fail(&self, generation: u64, faults: Diagnostics) {
        self.lock().failed = Some((generation, faults.clone()));
        self.tell(&Event::Failed { generation, faults });
        self.changed.notify_all();
    }

    /// Answers every setup with a fault.
    fn give_up(&self, fault: &Diagnostic) {
        while let Some((_, generation)) = self.next_setup() {
            self.fail(generation, fault.clone().into());
        }
    }

    /// Renders all pictures of a setup, until the final one or until a newer setup has come.
    fn show(&self, setup: &Arc<Setup>, generation: u64, kept: &mut Memory) -> Result<(), Diagnostics> {
        let RenderSettings { samples: last, size, .. } = *setup.scene.render();
        let mut samples = last;
        if let Some(stages) = &mut kept.stages {
            let prepared = Prepared::new(setup, stages.samples(), Some(stages.prepared()))?;
            let change = stages.change_to(&prepared);
            if !change.redo.trace && (stages.samples() == last || (self.options.progressive && stages.samples() < last))
            {
                let seconds = stages.seconds_for(&change.redo);
                // A picture of one sample is traced from scratch; it must come much sooner to be worth that.
                let needed = self.cache_for(Some(stages), stages.prepared()).needed;
                let kept_of_it = if stages.keeps_records() { Kept::All } else { Kept::Samples };
                let cache = CacheUse { kept: kept_of_it, needed, limit: self.options.cache_bytes };
                let slow = seconds > PATIENCE && stages.seconds_at(1, size) < seconds / 3.0;
                stages.set(prepared, &change);
                if slow && self.options.progressive && stages.samples() > 1 {
                    let preview = Prepared::new(setup, 1, Some(stages.prepared()))?;
                    let mut preview = Stages::new(preview, self.options.tile, false);
                    kept.shown = false;
                    if !self.bring_up_to_date(&mut preview, cache, (generation, last), true) {
                        return Ok(());
                    }
                }
                let is_done = self.bring_up_to_date(stages, cache, (generation, last), !kept.shown);
                kept.shown |= is_done;
                if !is_done || stages.samples() == last {
                    return Ok(());
                }
                samples = next_rung(stages, last, size);
            } else if self.options.progressive && stages.seconds_at(last, size) > AT_ONCE {
                samples = 1;
            }
        } else if self.options.progressive {
            samples = 1;
        }
        loop {
            let prepared = Prepared::new(setup, samples, kept.stages.as_ref().map(Stages::prepared))?;
            let cache = self.cache_for(kept.stages.as_ref(), &prepared);
            let is_done = match cache.kept {
                Kept::Nothing => {
                    *kept = Memory::default();
                    self.stream(&prepared, cache, generation, samples == last)?
                }
                Kept::All | Kept::Samples => {
                    let mut stages = Stages::new(prepared, self.options.tile, cache.kept == Kept::All);
                    let is_done = self.bring_up_to_date(&mut stages, cache, (generation, last), true);
                    if is_done {
                        *kept = Memory { stages: Some(stages), shown: true };
                    }
                    is_done
                }
            };
            if !is_done || samples == last {
                return Ok(());
            }
            samples = kept.stages.as_ref().map_or((samples * 2).min(last), |stages| next_rung(stages, last, size));
        }
    }

    /// How much of a picture fits into the memory that may be used.
    fn cache_for(&self, like: Option<&Stages>, prepared: &Prepared) -> CacheUse {
        let [with_records, without] = like.map_or(BYTES_PER_SAMPLE, Stages::bytes_per_sample);
        let render = prepared.scene.render();
        let samples = u64::from(render.size[0]) * u64::from(render.size[1]) * u64::from(render.samples);
        let [needed, without] = [with_records, without].map(|bytes| samples.saturating_mul(bytes));
        let limit = self.options.cache_bytes;
        let kept = match () {
            () if needed <= limit => Kept::All,
            () if without <= limit => Kept::Samples,
            () => Kept::Nothing,
        };
        CacheUse { kept, needed, limit }
    }

    /// Does what is due, and shows the picture; whether it was not cancelled.
    fn bring_up_to_date(
        &self,
        stages: &mut Stages,
        cache: CacheUse,
        (generation, last): (u64, u32),
        shows_all: bool,
    ) -> bool {
        let samples = stages.samples();
        let steps = AtomicU32::new(0);
        let progress = |share: f64| self.tell_progress(&steps, generation, samples, share);
        let control = Control { cancel: Some(&self.cancel), progress: Some(&progress) };
        let Some(Outcome { report, redone, changed }) = stages.work(&control) else { return false };
        let scene = &stages.prepared().scene;
        let whole = PixelRect::of_size(scene.render().size);
        self.show_picture(LivePicture {
            generation,
            samples,
            is_final: samples == last,
            size: scene.render().size,
            layers: stages.prepared().plan.layers.clone(),
            // New memory takes longer to come than to be written.
            channels: stages.channels().par_iter().cloned().collect(),
            changed: if shows_all { whole } else { changed },
            redone,
            cache,
            stats: report.stats,
            warnings: report.warnings,
            script_errors: report.script_errors,
        });
        true
    }

    fn show_picture(&self, picture: LivePicture) {
        let picture = Arc::new(picture);
        self.lock().picture = Some(Arc::clone(&picture));
        self.tell(&Event::Picture(picture));
        self.changed.notify_all();
    }

    /// Renders a picture of which nothing can be kept; whether it was not cancelled.
    fn stream(
        &self,
        prepared: &Prepared,
        cache: CacheUse,
        generation: u64,
        is_final: bool,
    ) -> Result<bool, Diagnostics> {
        let Prepared { scene, plan, setup, .. } = prepared;
        let RenderSettings { size, samples, .. } = *scene.render();
        let whole = PixelRect::of_size(size);
        let counts: usize = plan.layers.iter().map(|layer| layer.channels().len()).sum();
        let channels = Mutex::new(vec![vec![0.0; whole.pixels()]; counts]);
        let steps = AtomicU32::new(0);
        let progress = |share: f64| self.tell_progress(&steps, generation, samples, share);
        let control = Control { cancel: Some(&self.cancel), progress: Some(&progress) };
        let options = RenderOptions { threads: self.options.threads, tile: self.options.tile, ..Default::default() };
        let put = |tile: &FilmTile| {
            let mut channels = channels.lock().unwrap_or_else(PoisonError::into_inner);
            for (all, part) in channels.iter_mut().zip(&tile.channels) {
                tile.rect.copy_into(part, all, whole.width() as usize);
            }
            Ok(())
        };
        let report = render(scene, &setup.shaders, plan, &options, &control, &put)?;
        if report.complete {
            self.show_picture(LivePicture {
                generation,
                samples,
                is_final,
                size,
                layers: plan.layers.clone(),
                channels: channels.into_inner().unwrap_or_else(PoisonError::into_inner),
                changed: whole,
                redone: Redone::everything(scene),
                cache,
                stats: report.stats,
                warnings: report.warnings,
                script_errors: report.script_errors,
            });
        }
        Ok(report.complete)
    }
}

/// Longer than this, in seconds, nobody should wait for a picture: one of fewer samples comes first.
const PATIENCE: f64 = 0.3;
/// In how many steps the progress of a picture is told.
const PROGRESS_STEPS: f64 = 64.0;
/// A picture that takes fewer seconds than this is made at once, even if all is to be traced.
const AT_ONCE: f64 = 0.15;
/// In so many seconds the next picture of more samples should come, if it can be done with twice as many or more.
const NEXT_WITHIN: f64 = 1.0;

/// How many samples per pixel come after those of a picture that is up to date: at least twice as many, and as many as
/// can be had soon.
fn next_rung(stages: &Stages, last: u32, size: [u32; 2]) -> u32 {
    let mut samples = stages.samples().saturating_mul(2);
    while samples < last && stages.seconds_at(samples.saturating_mul(2).min(last), size) <= NEXT_WITHIN {
        samples = samples.saturating_mul(2);
    }
    samples.min(last)
}

/// About what a sample takes in memory with and without what its rays met, before anything was measured.
const BYTES_PER_SAMPLE: [u64; 2] = [160, 90];

/// What the worker keeps between setups.
#[derive(Default)]
struct Memory {
    stages: Option<Stages>,
    /// Whether the picture that was shown last is theirs.
    shown: bool,
}
