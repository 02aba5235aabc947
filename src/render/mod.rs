//! The driver: tiles through tracing, the line pass and the film, strip by strip.
//!
//! A strip's lines need the samples of the strips beside it, and its pixels need their lines. So each step of the loop
//! samples one strip, finds the lines of an earlier one, and develops one earlier still; all tiles of a step are
//! independent of each other and run on all threads. Strips that nothing needs any more are dropped: no sample is
//! rendered twice, and memory grows with the short side of the picture only.

mod files;
mod grid;
mod mask;
pub mod oversample;
pub mod refine;
pub mod request;
mod scripts;
pub mod stats;
pub mod timed;
mod totals;
pub mod why;

pub(crate) use grid::Grid;
pub(crate) use mask::Mask;
pub(crate) use scripts::ScriptedLines;
pub(crate) use totals::Totals;

pub use files::{PictureFile, layers_of, render_files, render_files_to_error, write_picture};
pub use refine::{ErrorGoal, render_to_error};
pub use request::{LoadedScene, SceneRequest};

use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use rayon::prelude::*;

use crate::clock::CpuClock;
use crate::diag::{Diagnostic, Diagnostics};
use crate::film::{FilmTile, FilmWindow, develop};
use crate::line::{LineBuffer, LineTile, Method, TileBounds, Window, find_lines};
use crate::math::DVec3;
use crate::plan::Plan;
use crate::sample::{PixelRect, SampleBuffer};
use crate::scene::Scene;
use crate::shade::{Lighting, ShadeErrors, Shaders};
use crate::trace::wave::TracedTile;
use crate::trace::{TileTracer, TraceContext, World};
use stats::{Sampling, Stats};

/// How to render; none of it changes the picture but `crop`, which leaves out parts.
#[derive(Clone, Debug)]
pub struct RenderOptions {
    /// Threads; 0 for as many as the machine has.
    pub threads: usize,
    /// Side of a tile in pixels, at least 1; smaller ones are taken where there are very many samples.
    pub tile: u32,
    /// The pixels to render; `None` for all.
    pub crop: Option<PixelRect>,
    /// How lines are searched.
    pub method: Method,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self { threads: 0, tile: 32, crop: None, method: Method::Exact }
    }
}

/// How a caller follows and stops a render.
#[derive(Default)]
pub struct Control<'a> {
    /// Once true, no new tiles are begun and `render` returns soon with what is done.
    pub cancel: Option<&'a AtomicBool>,
    /// Called from any thread with the share of the work that is done, 0 … 1, rising.
    pub progress: Option<&'a (dyn Fn(f64) + Sync)>,
}

/// What came of a render, beside its pixels.
#[derive(Debug)]
pub struct Report {
    /// What it cost.
    pub stats: Stats,
    /// Run-time errors of scripts, each place once with a count; they mark hits but do not stop the picture.
    pub script_errors: Diagnostics,
    /// What the gate stopped, by material.
    pub warnings: Diagnostics,
    /// Whether every tile was rendered (false after a cancel).
    pub complete: bool,
    /// Whether picture files were written; set by [`render_files`] alone.
    pub written: bool,
}

/// Takes finished tiles of the plan's layers: called from any thread, in any order, each pixel once.
pub type Emit<'a> = &'a (dyn Fn(&FilmTile) -> Result<(), Diagnostic> + Sync);

/// Renders a scene under its plan, with more samples where lines are if that says so (see [`oversample`]). Finished tiles of the plan's
/// layers go to `emit`.
///
/// # Errors
/// What `emit` returns, or that no threads could be started.
pub fn render(
    scene: &Scene,
    shaders: &Shaders,
    plan: &Plan,
    options: &RenderOptions,
    control: &Control<'_>,
    emit: Emit<'_>,
) -> Result<Report, Diagnostic> {
    on_threads(options.threads, || {
        let start = Instant::now();
        let stage = Stage::new(scene, plan);
        let mut totals = Totals::new(scene.materials().len());
        let mut errors = ShadeErrors::default();
        let pass = Pass { scene, shaders, plan, options, control, mask: None };
        let (complete, sampling) = match &plan.oversampling {
            None => (stage.render(&pass, &mut totals, &mut errors, emit)?, None),
            Some(rates) => {
                let (complete, found) = oversample::render(&stage, &pass, rates, (&mut totals, &mut errors), emit)?;
                (complete, Some(Sampling::Lines(found)))
            }
        };
        totals.seconds.build = stage.build_seconds;
        let mut report = totals.report(scene, shaders, plan, errors, complete);
        report.stats.sampling = sampling;
        report.stats.seconds.total = start.elapsed().as_secs_f64();
        Ok(report)
    })
}

/// Does some work on threads of its own; 0 for as many as the machine has.
pub(crate) fn on_threads<T: Send>(
    threads: usize,
    work: impl FnOnce() -> Result<T, Diagnostic> + Send,
) -> Result<T, Diagnostic> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|error| Diagnostic::error(format!("cannot start rendering threads: {error}")))?;
    pool.install(work)
}

/// What passes over a scene share: none of it depends on the number of samples.
pub(crate) struct Stage {
    world: World,
    lighting: Lighting,
    /// CPU seconds that it took to make.
    pub build_seconds: f64,
}

/// One pass over a scene: all of a picture, or some of its blocks.
pub(crate) struct Pass<'a> {
    pub scene: &'a Scene,
    pub shaders: &'a Shaders,
    pub plan: &'a Plan,
    pub options: &'a RenderOptions,
    pub control: &'a Control<'a>,
    /// The blocks to render, within the crop; `None` for all of it.
    pub mask: Option<&'a Mask>,
}

impl Stage {
    pub fn new(scene: &Scene, plan: &Plan) -> Self {
        let building = CpuClock::process();
        let transmissive: Vec<bool> = plan.materials.iter().map(|material| material.refracts).collect();
        let world = World::new(scene, &transmissive);
        let lighting = Lighting::new(scene, world.origin);
        Self { world, lighting, build_seconds: building.seconds() }
    }

    /// Renders a pass of the scene that this was made for, or of the same scene with another number of samples; what it
    /// costs and what fails is added. Returns whether it was not stopped. To be called on the threads that do the work.
    pub fn render(
        &self,
        pass: &Pass<'_>,
        totals: &mut Totals,
        errors: &mut ShadeErrors,
        emit: Emit<'_>,
    ) -> Result<bool, Diagnostic> {
        let tracer = TileTracer::new(pass.scene, pass.plan, &self.world, &self.lighting);
        let mut render = Render::new(pass, tracer, self.world.origin, totals);
        render.run(emit)?;
        render.totals.busy_seconds += render.busy_nanoseconds.into_inner() as f64 * 1e-9;
        for context in render.contexts.into_inner().unwrap_or_else(PoisonError::into_inner) {
            errors.merge(context.errors);
        }
        Ok(render.complete)
    }
}

/// The largest side of a tile, for a number of samples per pixel: a tile holds at most 2²² samples, some hundred
/// megabytes, if that leaves it a pixel.
pub(crate) fn largest_tile(samples: u32) -> u32 {
    ((1 << 22) / samples.max(1)).isqrt().max(1)
}

/// The state of a render.
struct Render<'a> {
    scene: &'a Scene,
    shaders: &'a Shaders,
    plan: &'a Plan,
    control: &'a Control<'a>,
    method: Method,
    tracer: TileTracer<'a>,
    /// The camera's place in the world.
    origin: DVec3,
    grid: Grid,
    crop: PixelRect,
    mask: Option<&'a Mask>,
    /// Scratch memory and script engines, one for each thread that ever needed one.
    contexts: Mutex<Vec<TraceContext<'a>>>,
    /// By tile of the grid, while something still needs it.
    samples: Vec<Option<Box<SampledTile>>>,
    lines: Vec<Option<Box<LineBuffer>>>,
    jobs_done: AtomicUsize,
    /// Wall time that threads spent on jobs.
    busy_nanoseconds: AtomicU64,
    totals: &'a mut Totals,
    complete: bool,
}

/// A tile of samples, made ready for the line pass if there is one.
struct SampledTile {
    buffer: SampleBuffer,
    bounds: Option<TileBounds>,
}

impl SampledTile {
    fn for_lines(&self) -> Option<LineTile<'_>> {
        Some(LineTile { buffer: &self.buffer, bounds: self.bounds.as_ref()? })
    }
}

/// One tile's turn in one stage.
enum Job {
    Sample(usize),
    Line(usize),
    Develop(usize),
}

/// What a job made.
enum Product {
    Sampled {
        tile: usize,
        traced: Box<TracedTile>,
        bounds: Option<TileBounds>,
        line_seconds: f64,
    },
    Lined {
        tile: usize,
        lines: Box<LineBuffer>,
        seconds: f64,
    },
    Developed {
        seconds: f64,
    },
    /// Nothing of the tile was needed.
    Nothing,
}

impl<'a> Render<'a> {
    fn new(pass: &Pass<'a>, tracer: TileTracer<'a>, origin: DVec3, totals: &'a mut Totals) -> Self {
        let Pass { scene, shaders, plan, options, control, mask } = *pass;
        let picture = PixelRect::of_size(scene.render().size);
        let crop = options.crop.map_or(picture, |crop| crop.intersection(&picture));
        let crop = mask.map_or(crop, |mask| mask.extent().intersection(&crop));
        let border = plan.lines.as_ref().map_or(0, |lines| lines.reach) + plan.filter.reach();
        let tile = options.tile.clamp(1, largest_tile(scene.render().samples));
        let grid = Grid::new(crop.grown(border).intersection(&picture), tile);
        Self {
            scene,
            shaders,
            plan,
            control,
            method: options.method,
            tracer,
            origin,
            crop,
            mask,
            contexts: Mutex::default(),
            samples: (0..grid.tiles()).map(|_| None).collect(),
            lines: (0..grid.tiles()).map(|_| None).collect(),
            jobs_done: AtomicUsize::new(0),
            busy_nanoseconds: AtomicU64::new(0),
            totals,
            complete: true,
            grid,
        }
    }

    /// The loop: every step moves each stage on by one strip.
    fn run(&mut self, emit: Emit<'_>) -> Result<(), Diagnostic> {
        let strips_of = |pixels: i32| (pixels.max(0) as usize).div_ceil(self.grid.tile as usize);
        let line_halo = self.plan.lines.as_ref().map_or(0, |lines| strips_of(lines.reach));
        let film_halo = strips_of(self.plan.filter.reach());
        let line_lag = 1 + line_halo;
        let film_lag = if self.plan.lines.is_some() { line_lag } else { 0 } + 1 + film_halo;
        for step in 0..self.grid.strips() + film_lag {
            let strip = |lag: usize| step.checked_sub(lag).map_or_else(Vec::new, |strip| self.grid.strip(strip));
            let mut jobs: Vec<Job> = strip(0).into_iter().map(Job::Sample).collect();
            if self.plan.lines.is_some() {
                jobs.extend(strip(line_lag).into_iter().map(Job::Line));
            }
            jobs.extend(strip(film_lag).into_iter().map(Job::Develop));
            // One by one: rayon would else give one thread a run of samples, which take longest, and share too late.
            let products =
                jobs.into_par_iter().with_max_len(1).map(|job| self.work(job, emit)).collect::<Result<Vec<_>, _>>()?;
            for product in products {
                match product {
                    Some(product) => self.take(product),
                    None => self.complete = false,
                }
            }
            if !self.complete {
                return Ok(());
            }
            // The next step's lines need samples from here on, and its pixels need lines from there on.
            let still_needed = (step + 1).saturating_sub((line_lag + line_halo).max(film_lag + film_halo));
            if let Some(done) = still_needed.checked_sub(1) {
                for tile in self.grid.strip(done) {
                    self.samples[tile] = None;
                    self.lines[tile] = None;
                }
            }
        }
        Ok(())
    }

    fn cancelled(&self) -> bool {
        self.control.cancel.is_some_and(|cancel| cancel.load(Ordering::Relaxed))
    }

    /// Does a job, on any thread; `None` once cancelled.
    fn work(&self, job: Job, emit: Emit<'_>) -> Result<Option<Product>, Diagnostic> {
        if self.cancelled() {
            return Ok(None);
        }
        let begun = Instant::now();
        let clock = CpuClock::thread();
        let product = match job {
            Job::Sample(tile) => self.sample(tile),
            Job::Line(tile) if self.needed(tile, self.plan.filter.reach()).is_none() => Some(Product::Nothing),
            Job::Line(tile) => self.line(tile).map(|lines| {
                let seconds = clock.seconds();
                Product::Lined { tile, lines: Box::new(lines), seconds }
            }),
            Job::Develop(tile) => {
                for rect in self.shown(tile) {
                    emit(&self.develop(tile, rect))?;
                }
                Some(Product::Developed { seconds: clock.seconds() })
            }
        };
        self.busy_nanoseconds.fetch_add(begun.elapsed().as_nanos() as u64, Ordering::Relaxed);
        let done = self.jobs_done.fetch_add(1, Ordering::Relaxed) + 1;
        if let Some(progress) = self.control.progress {
            let stages = if self.plan.lines.is_some() { 3 } else { 2 };
            progress(done as f64 / (stages * self.grid.tiles()) as f64);
        }
        Ok(product)
    }

    /// The part of a tile within a margin of what is shown; `None` if there is none.
    fn needed(&self, tile: usize, margin: i32) -> Option<PixelRect> {
        let rect = self.grid.rect(tile);
        self.mask.map_or(Some(rect), |mask| mask.needed(rect, margin))
    }

    /// What is shown of a tile.
    fn shown(&self, tile: usize) -> Vec<PixelRect> {
        let rect = self.grid.rect(tile).intersection(&self.crop);
        let mut shown = self.mask.map_or_else(|| vec![rect], |mask| mask.parts_of(rect));
        shown.retain(|part| part.pixels() > 0);
        shown
    }

    fn sample(&self, tile: usize) -> Option<Product> {
        let reach = self.plan.lines.as_ref().map_or(0, |lines| lines.reach);
        let Some(rect) = self.needed(tile, reach + self.plan.filter.reach()) else { return Some(Product::Nothing) };
        let mut context = self.borrow_context();
        let traced = Box::new(self.tracer.trace(rect, &mut context));
        self.return_context(context);
        let clock = CpuClock::thread();
        let bounds = self.plan.lines.as_ref().map(|lines| TileBounds::new(&traced.samples, &lines.rules));
        Some(Product::Sampled { tile, traced, bounds, line_seconds: clock.seconds() })
    }

    fn line(&self, tile: usize) -> Option<LineBuffer> {
        let lines = self.plan.lines.as_ref()?;
        let part = self.grid.around(tile, lines.reach);
        let tiles = part.tiles.iter().map(|tile| self.samples[*tile].as_ref()?.for_lines()).collect();
        let window = Window { origin: part.origin, tile: self.grid.tile, columns: part.columns, tiles };
        let target = self.samples[tile].as_ref()?.for_lines()?;
        if !lines.scripted {
            return Some(find_lines(&window, target, &lines.rules, self.method, None));
        }
        let mut context = self.borrow_context();
        let mut scripts = ScriptedLines::new(&mut context, self.origin);
        let found = find_lines(&window, target, &lines.rules, self.method, Some(&mut scripts));
        self.return_context(context);
        Some(found)
    }

    /// A context that no thread uses at the moment.
    fn borrow_context(&self) -> TraceContext<'a> {
        let free = self.contexts.lock().unwrap_or_else(PoisonError::into_inner).pop();
        free.unwrap_or_else(|| TraceContext::new(self.scene, self.shaders))
    }

    fn return_context(&self, context: TraceContext<'a>) {
        self.contexts.lock().unwrap_or_else(PoisonError::into_inner).push(context);
    }

    /// Develops a part of a tile.
    fn develop(&self, tile: usize, rect: PixelRect) -> FilmTile {
        let part = self.grid.around(tile, self.plan.filter.reach());
        let of_tile = |tile: &usize| {
            let samples = self.samples[*tile].as_ref()?;
            Some((&samples.buffer, self.lines[*tile].as_deref()))
        };
        let tiles = part.tiles.iter().map(of_tile).collect();
        let window = FilmWindow { origin: part.origin, tile: self.grid.tile, columns: part.columns, tiles };
        develop(&window, rect, &self.plan.filter, &self.plan.layers)
    }

    /// Puts a job's product in its place.
    fn take(&mut self, product: Product) {
        match product {
            Product::Sampled { tile, traced, bounds, line_seconds } => {
                self.totals.seconds.lines += line_seconds;
                self.totals.add_traced(&traced);
                self.totals.add_samples(&traced.samples, bounds.as_ref());
                self.samples[tile] = Some(Box::new(SampledTile { buffer: traced.samples, bounds }));
            }
            Product::Lined { tile, lines, seconds } => {
                self.totals.seconds.lines += seconds;
                self.totals.add_lines(&lines);
                self.lines[tile] = Some(lines);
            }
            Product::Developed { seconds } => self.totals.seconds.film += seconds,
            Product::Nothing => {}
        }
    }
}
