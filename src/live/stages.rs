//! The stages of a picture, each tile's results kept with what must be done to them again.
//!
//! All tiles are sampled, then their lines are found, then they are developed, on all threads. A tile that an edit does
//! not reach is not touched: samples stay if no ray or shader changed for them, lines if no sample within reach did,
//! pixels if no line or sample under their filter did; and of a tile that it reaches, only the part. What is left to do is noted in the tiles, so that work can be
//! dropped at any moment and taken up for a later setup.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use rayon::prelude::*;

use super::change::{Change, Redo, View};
use super::session::Setup;
use crate::clock::CpuClock;
use crate::diag::Diagnostics;
use crate::film::{FilmTile, FilmWindow, Layer, develop};
use crate::line::{LineBuffer, LineTile, Method, RuleChange, TileBounds, Window, find_lines, find_lines_in};
use crate::plan::Plan;
use crate::render::{Control, Grid, Report, ScriptedLines, Totals, largest_tile};
use crate::sample::{PixelRect, SampleBuffer};
use crate::scene::Scene;
use crate::scene::ids::MaterialId;
use crate::shade::{Lighting, ShadeErrors};
use crate::trace::{Memory, RayCounts, TileRecord, TileTracer, TraceContext, World};

/// A setup at some number of samples, ready to be rendered.
pub(super) struct Prepared {
    pub setup: Arc<Setup>,
    pub scene: Scene,
    pub plan: Plan,
    world: Arc<World>,
    lighting: Lighting,
    /// CPU seconds that building hierarchies took.
    build_seconds: f64,
}

impl Prepared {
    /// Prepares a setup; hierarchies are those of an older one as far as they are the same.
    pub fn new(setup: &Arc<Setup>, samples: u32, older: Option<&Self>) -> Result<Self, Diagnostics> {
        let mut builder = setup.scene.clone().into_builder();
        builder.render.samples = samples;
        // Live pictures have the same number everywhere: what was kept of them could not be used again else.
        builder.render.line_oversampling = 1;
        let scene = builder.build()?;
        let mut plan = Plan::new(&scene, &setup.shaders, &setup.layers);
        // Kept whether or not the lines of this picture are tinted, so that to tint them takes the line pass alone.
        plan.layout.columns.throughput |= plan.lines.is_some() && plan.has_secondary_rays();
        if let Some(older) = older {
            // So that a test that is turned off and on again costs no shading.
            plan.layout.columns.uv |= older.plan.layout.columns.uv;
            plan.layout.columns.normal |= older.plan.layout.columns.normal;
        }
        let clock = CpuClock::process();
        let view = View { scene: &scene, shaders: &setup.shaders, plan: &plan };
        let world = match older {
            Some(older) if view.same_world(older.view()) => Arc::clone(&older.world),
            _ => {
                let transmissive: Vec<bool> = plan.materials.iter().map(|material| material.refracts).collect();
                Arc::new(World::with_trees_of(&scene, &transmissive, older.map(|older| &*older.world)))
            }
        };
        let build_seconds = clock.seconds();
        let lighting = Lighting::new(&scene, world.origin);
        Ok(Self { setup: Arc::clone(setup), scene, plan, world, lighting, build_seconds })
    }

    pub fn view(&self) -> View<'_> {
        View { scene: &self.scene, shaders: &self.setup.shaders, plan: &self.plan }
    }
}

/// What was done again for a picture, and what was not. The rays are in its [`Stats`](crate::render::stats::Stats).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Redone {
    /// Tiles of the picture.
    pub tiles: usize,
    /// Tiles whose camera rays were traced.
    pub traced: usize,
    /// Tiles that were shaded again with rays that were known.
    pub shaded: usize,
    /// Tiles where only line and feature attributes of some materials were worked out again.
    pub restyled: usize,
    /// Tiles whose lines were searched.
    pub lined: usize,
    /// Tiles that were developed.
    pub developed: usize,
    /// Names of the materials whose shaders were run.
    pub materials: Vec<String>,
}

impl Redone {
    /// Everything, in one piece.
    pub(super) fn everything(scene: &Scene) -> Self {
        let materials = scene.materials().iter().map(|material| material.name.clone()).collect();
        Self { tiles: 1, traced: 1, lined: 1, developed: 1, materials, ..Self::default() }
    }
}

/// A tile of the picture and what is still to be done to it.
#[derive(Default)]
struct Tile {
    redo: Redo,
    /// The part of it whose lines must be searched.
    lines_due: Option<PixelRect>,
    /// The part of it that must be developed.
    film_due: Option<PixelRect>,
    samples: Option<Box<SampleBuffer>>,
    bounds: Option<TileBounds>,
    record: Option<TileRecord>,
    lines: Option<Box<LineBuffer>>,
    /// Hits by material when it was last shaded.
    hits: Vec<u64>,
    errors: ShadeErrors,
    line_errors: ShadeErrors,
}

impl Tile {
    fn for_lines(&self) -> Option<LineTile<'_>> {
        Some(LineTile { buffer: self.samples.as_deref()?, bounds: self.bounds.as_ref()? })
    }

    fn bytes_but_for_record(&self) -> usize {
        let lines =
            self.lines.as_ref().map_or(0, |lines| size_of_val(&lines.samples[..]) + size_of_val(&lines.lines[..]));
        self.samples.as_ref().map_or(0, |samples| samples.bytes())
            + self.bounds.as_ref().map_or(0, TileBounds::bytes)
            + lines
    }
}

/// What a record takes of a sample whose ray is neither mirrored nor refracted.
const CAMERA_RECORD_BYTES: u64 = 24;

/// What a tile's samples cost to bring up to date.
#[derive(Default)]
struct Sampled {
    /// The pixels outside which no sample asks for other lines.
    changed: Option<PixelRect>,
    /// Whether the tile's own lines may, and no others.
    own_lines_changed: bool,
    /// Whether pixels may, even with the same lines.
    pixels_changed: bool,
    traced: bool,
    shaded: bool,
    restyled: bool,
    rays: RayCounts,
    hits: Vec<u64>,
    shade_seconds: Vec<f64>,
    seconds: f64,
    line_seconds: f64,
}

/// All tiles of a picture at some number of samples.
pub(super) struct Stages {
    prepared: Prepared,
    grid: Grid,
    tiles: Vec<Tile>,
    /// The picture: channels of all layers.
    channels: Vec<Vec<f32>>,
    /// How far changes reach that are still under way, in pixels: lines, film.
    reach: [i32; 2],
    /// What of the picture has changed since it was last up to date.
    changed: Option<PixelRect>,
    pace: Pace,
    /// Whether what rays met is kept.
    keeps_records: bool,
}

/// How long samples of a tile took when they were last worked out, on all threads together: wall seconds.
#[derive(Clone, Copy, Debug, Default)]
struct Pace {
    /// With all rays traced; 0 before any was.
    trace: f64,
    /// With rays that were known; 0 before.
    shade: f64,
}

impl Pace {
    /// About what shading takes of tracing, before it was measured.
    const SHADE_OF_TRACE: f64 = 0.4;

    fn note(&mut self, seconds: f64, sampled: &[(usize, Sampled)]) {
        let per_tile = seconds / sampled.len().max(1) as f64;
        let all = |what: fn(&Sampled) -> bool| !sampled.is_empty() && sampled.iter().all(|(_, sampled)| what(sampled));
        if all(|sampled| sampled.traced) {
            self.trace = per_tile;
        } else if all(|sampled| sampled.shaded) {
            self.shade = per_tile;
        }
    }

    /// Seconds for so many tiles of each kind.
    fn seconds(&self, traced: usize, shaded: usize) -> f64 {
        let shade = if self.shade > 0.0 { self.shade } else { self.trace * Self::SHADE_OF_TRACE };
        traced as f64 * self.trace + shaded as f64 * shade
    }
}

/// A picture that is up to date.
pub(super) struct Outcome {
    pub report: Report,
    pub redone: Redone,
    /// What may differ from before.
    pub changed: PixelRect,
}

impl Stages {
    /// Stages with everything still to be done.
    pub fn new(prepared: Prepared, tile: u32, keeps_records: bool) -> Self {
        let render = prepared.scene.render();
        let grid = Grid::new(PixelRect::of_size(render.size), tile.clamp(1, largest_tile(render.samples)));
        let tiles = (0..grid.tiles()).map(|_| Tile { redo: Redo::all(), ..Tile::default() }).collect();
        let mut stages = Self {
            prepared,
            grid,
            tiles,
            channels: Vec::new(),
            reach: [0; 2],
            changed: None,
            pace: Pace::default(),
            keeps_records,
        };
        stages.make_room();
        stages.widen_reach();
        stages
    }

    pub fn prepared(&self) -> &Prepared {
        &self.prepared
    }

    pub fn samples(&self) -> u32 {
        self.prepared.scene.render().samples
    }

    /// Whether what rays met is kept.
    pub fn keeps_records(&self) -> bool {
        self.keeps_records
    }

    pub fn channels(&self) -> &[Vec<f32>] {
        &self.channels
    }

    /// Bytes that a sample takes, with and without what its rays met.
    pub fn bytes_per_sample(&self) -> [u64; 2] {
        let samples = (self.grid.region.pixels() as u64 * u64::from(self.samples())).max(1);
        let records: usize = self.tiles.iter().filter_map(|tile| Some(tile.record.as_ref()?.bytes())).sum();
        let others: usize = self.tiles.iter().map(Tile::bytes_but_for_record).sum();
        let [with, without] = [others + records, others].map(|bytes| bytes as u64 / samples);
        // Where none was kept, a camera ray's node is what there would be at least.
        [if self.keeps_records { with } else { without + CAMERA_RECORD_BYTES }, without]
    }

    /// What leads to another setup.
    pub fn change_to(&self, prepared: &Prepared) -> Change {
        Change::between(self.prepared.view(), prepared.view())
    }

    /// About how many seconds it takes to bring the samples up to date with `redo`, and with what was left over from
    /// before.
    pub fn seconds_for(&self, redo: &Redo) -> f64 {
        let (mut traced, mut shaded) = (0, 0);
        for tile in &self.tiles {
            let mut redo = redo.of_tile(|id| sees(tile, id));
            redo.add(&tile.redo);
            if redo.trace || tile.record.is_none() && redo.shades() {
                traced += 1;
            } else if redo.shades() {
                shaded += 1;
            }
        }
        self.pace.seconds(traced, shaded)
    }

    /// About how many seconds all samples take with so many of them in a pixel, in a picture of this many pixels.
    pub fn seconds_at(&self, samples: u32, size: [u32; 2]) -> f64 {
        let own = self.grid.region.pixels() as f64 * f64::from(self.samples());
        let others = PixelRect::of_size(size).pixels() as f64 * f64::from(samples);
        self.pace.seconds(self.tiles.len(), 0) * others / own.max(1.0)
    }

    /// Notes what leads to a setup of the same size and number of samples; the setup is the one to come.
    pub fn set(&mut self, prepared: Prepared, change: &Change) {
        let concerned = self.concerned(&change.lines);
        for (index, (tile, concerned)) in self.tiles.iter_mut().zip(concerned).enumerate() {
            let of_tile = change.redo.of_tile(|id| sees(tile, id));
            tile.redo.add(&of_tile);
            let whole = Some(self.grid.rect(index));
            if concerned {
                tile.lines_due = whole;
            }
            if change.film {
                tile.film_due = whole;
            }
        }
        self.prepared = prepared;
        self.make_room();
        self.widen_reach();
    }

    /// Which tiles need other lines even if all samples stay as they are.
    fn concerned(&self, change: &RuleChange) -> Vec<bool> {
        let Some(lines) = self.prepared.plan.lines.as_ref().filter(|_| !change.is_nothing()) else {
            return vec![!change.is_nothing(); self.tiles.len()];
        };
        let is_concerned = |index: usize| {
            // What has changed since the lines were found is searched anyway, and cannot be asked.
            let is_known = |tile: &Tile| tile.samples.is_some() && !tile.redo.bounds;
            let tile = &self.tiles[index];
            let (window, near) = self.window_of(index, lines.reach);
            let known = near.iter().all(|near| is_known(&self.tiles[*near]));
            match (tile.for_lines(), &tile.lines) {
                (Some(target), Some(found)) if known => change.concerns(&window, target, found, &lines.rules),
                _ => true,
            }
        };
        let indices = (0..self.tiles.len()).into_par_iter().with_max_len(TILES_AT_ONCE);
        let whole = |index: usize| self.tiles[index].lines_due == Some(self.grid.rect(index));
        indices.map(|index| !whole(index) && is_concerned(index)).collect()
    }

    /// The tiles within so many pixels around a tile, with their numbers.
    fn window_of(&self, index: usize, reach: i32) -> (Window<'_>, Vec<usize>) {
        let part = self.grid.around(index, reach);
        let tiles = part.tiles.iter().map(|tile| self.tiles[*tile].for_lines()).collect();
        (Window { origin: part.origin, tile: self.grid.tile, columns: part.columns, tiles }, part.tiles)
    }

    fn make_room(&mut self) {
        let counts: usize = self.prepared.plan.layers.iter().map(|layer| layer.channels().len()).sum();
        let pixels = self.grid.region.pixels();
        self.channels.resize_with(counts, || vec![0.0; pixels]);
    }

    fn widen_reach(&mut self) {
        let plan = &self.prepared.plan;
        let lines = plan.lines.as_ref().map_or(0, |lines| lines.reach);
        self.reach = [self.reach[0].max(lines), self.reach[1].max(plan.filter.reach())];
    }

    /// Does what is due. `None` if that was cancelled; the rest stays due.
    pub fn work(&mut self, control: &Control<'_>) -> Option<Outcome> {
        let start = Instant::now();
        let mut totals = Totals::new(self.prepared.scene.materials().len());
        totals.seconds.build = std::mem::take(&mut self.prepared.build_seconds);
        let mut redone = Redone { tiles: self.tiles.len(), ..Redone::default() };
        let done = AtomicUsize::new(0);
        let cancelled = || control.cancel.is_some_and(|cancel| cancel.load(Ordering::Relaxed));
        let step = || {
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            if let Some(progress) = control.progress {
                progress(done as f64 / (3 * self.grid.tiles()) as f64);
            }
        };

        // Samples.
        let prepared = &self.prepared;
        let tracer = TileTracer::new(&prepared.scene, &prepared.plan, &prepared.world, &prepared.lighting);
        let contexts = Contexts { prepared, free: Mutex::default() };
        let (grid, keeps_records) = (&self.grid, self.keeps_records);
        let sampled: Vec<(usize, Sampled)> = self
            .tiles
            .par_iter_mut()
            .with_max_len(1)
            .enumerate()
            .filter(|(_, tile)| !tile.redo.is_nothing())
            .filter_map(|(index, tile)| {
                if cancelled() {
                    return None;
                }
                let sampled = bring_up_to_date(tile, grid.rect(index), prepared, &tracer, &contexts, keeps_records);
                step();
                Some((index, sampled))
            })
            .collect();
        self.pace.note(start.elapsed().as_secs_f64(), &sampled);
        for (index, sampled) in &sampled {
            redone.traced += usize::from(sampled.traced);
            redone.shaded += usize::from(sampled.shaded);
            redone.restyled += usize::from(sampled.restyled);
            totals.rays += sampled.rays;
            let shading: f64 = sampled.shade_seconds.iter().sum();
            totals.seconds.trace += sampled.seconds - shading;
            totals.seconds.shade += shading;
            totals.seconds.lines += sampled.line_seconds;
            totals.hits.iter_mut().zip(&sampled.hits).for_each(|(total, hits)| *total += hits);
            totals.shade_seconds.iter_mut().zip(&sampled.shade_seconds).for_each(|(total, own)| *total += own);
            let whole = self.grid.rect(*index);
            if sampled.own_lines_changed {
                self.tiles[*index].lines_due = Some(whole);
            }
            let (tiles, [lines, film]) = (&mut self.tiles, self.reach);
            if let Some(changed) = sampled.changed {
                around(tiles, &self.grid, (*index, changed), lines, |tile| &mut tile.lines_due);
            }
            if sampled.pixels_changed {
                around(tiles, &self.grid, (*index, whole), film, |tile| &mut tile.film_due);
            }
        }

        // Lines.
        let sampled = self.tiles.iter().all(|tile| tile.samples.is_some());
        let found: Vec<(usize, Found)> = (0..self.tiles.len())
            .filter_map(|index| Some((index, self.tiles[index].lines_due?)))
            .collect::<Vec<_>>()
            .into_par_iter()
            .with_max_len(1)
            .filter_map(|(index, part)| {
                if cancelled() || !sampled {
                    return None;
                }
                let found = self.lines_of(index, part, &contexts);
                step();
                Some((index, found))
            })
            .collect();
        drop(contexts);
        for (index, found) in found {
            redone.lined += 1;
            totals.seconds.lines += found.seconds;
            let tile = &mut self.tiles[index];
            tile.lines = found.lines;
            tile.line_errors = found.errors;
            tile.lines_due = None;
            if let Some(changed) = found.changed {
                around(&mut self.tiles, &self.grid, (index, changed), self.reach[1], |tile| &mut tile.film_due);
            }
        }

        // Film.
        let lined = self.tiles.iter().all(|tile| tile.samples.is_some() && tile.lines_due.is_none());
        let developed: Vec<(usize, FilmTile, f64)> = (0..self.tiles.len())
            .filter_map(|index| Some((index, self.tiles[index].film_due?)))
            .collect::<Vec<_>>()
            .into_par_iter()
            .with_max_len(1)
            .filter_map(|(index, part)| {
                if cancelled() || !lined {
                    return None;
                }
                let clock = CpuClock::thread();
                let film = self.develop(index, part);
                step();
                Some((index, film, clock.seconds()))
            })
            .collect();
        for (index, film, seconds) in developed {
            redone.developed += 1;
            totals.seconds.film += seconds;
            if self.put(&film) {
                self.changed = Some(self.changed.map_or(film.rect, |changed| changed.union(&film.rect)));
            }
            self.tiles[index].film_due = None;
        }

        let is_due = |tile: &Tile| !tile.redo.is_nothing() || tile.lines_due.is_some() || tile.film_due.is_some();
        if self.tiles.iter().any(is_due) {
            return None;
        }
        self.reach = [0; 2];
        self.widen_reach();
        totals.seconds.total = start.elapsed().as_secs_f64();
        Some(self.outcome(totals, redone))
    }

    fn outcome(&mut self, mut totals: Totals, mut redone: Redone) -> Outcome {
        let Prepared { scene, plan, setup, .. } = &self.prepared;
        let mut errors = ShadeErrors::default();
        for tile in &self.tiles {
            if let Some(samples) = &tile.samples {
                totals.add_samples(samples, tile.bounds.as_ref());
            }
            if let Some(lines) = &tile.lines {
                totals.add_lines(lines);
            }
            errors.merge(tile.errors.clone());
            errors.merge(tile.line_errors.clone());
        }
        let run = scene.materials().iter().zip(&totals.hits).filter(|(_, hits)| **hits > 0);
        redone.materials = run.map(|(material, _)| material.name.clone()).collect();
        let nothing = PixelRect { x0: 0, y0: 0, x1: 0, y1: 0 };
        let changed = self.changed.take().unwrap_or(nothing);
        Outcome { report: totals.report(scene, &setup.shaders, plan, errors, true), redone, changed }
    }

    /// Searches the lines of a part of a tile; those of the rest stay.
    fn lines_of(&self, index: usize, part: PixelRect, contexts: &Contexts<'_>) -> Found {
        let clock = CpuClock::thread();
        let (tile, whole) = (&self.tiles[index], self.grid.rect(index));
        let (Some(lines), Some(target)) = (&self.prepared.plan.lines, tile.for_lines()) else {
            return Found { changed: tile.lines.as_ref().map(|_| whole), ..Found::default() };
        };
        let (window, _) = self.window_of(index, lines.reach);
        let mut errors = ShadeErrors::default();
        let found = if lines.scripted {
            contexts.with(|context| {
                let mut scripts = ScriptedLines::new(context, self.prepared.world.origin);
                let found = find_lines(&window, target, &lines.rules, Method::Exact, Some(&mut scripts));
                errors = std::mem::take(&mut context.errors);
                found
            })
        } else if let Some(old) = tile.lines.as_ref().filter(|_| part != whole) {
            let found = find_lines_in(part, &window, target, &lines.rules, Method::Exact);
            found.with_others_outside(part, old, self.samples())
        } else {
            find_lines(&window, target, &lines.rules, Method::Exact, None)
        };
        let changed = match &tile.lines {
            Some(old) => found.difference(old, self.samples()),
            None => Some(whole),
        };
        Found { lines: Some(Box::new(found)), errors, changed, seconds: clock.seconds() }
    }

    /// Develops a part of a tile.
    fn develop(&self, index: usize, rect: PixelRect) -> FilmTile {
        let plan = &self.prepared.plan;
        let part = self.grid.around(index, plan.filter.reach());
        let of_tile = |tile: &usize| {
            let tile = &self.tiles[*tile];
            Some((tile.samples.as_deref()?, tile.lines.as_deref()))
        };
        let tiles = part.tiles.iter().map(of_tile).collect();
        let window = FilmWindow { origin: part.origin, tile: self.grid.tile, columns: part.columns, tiles };
        develop(&window, rect, &plan.filter, &plan.layers)
    }

    /// Puts a tile into the picture; whether anything differs from before.
    fn put(&mut self, film: &FilmTile) -> bool {
        let stride = self.grid.region.width() as usize;
        let mut changed = false;
        for (all, part) in self.channels.iter_mut().zip(&film.channels) {
            changed |= film.rect.copy_into(part, all, stride);
        }
        changed
    }
}

/// Lines of a tile.
#[derive(Default)]
struct Found {
    lines: Option<Box<LineBuffer>>,
    errors: ShadeErrors,
    /// The pixels where they look otherwise than before.
    changed: Option<PixelRect>,
    seconds: f64,
}

/// Notes as due what some pixels of a tile reach.
fn around(
    tiles: &mut [Tile],
    grid: &Grid,
    (index, pixels): (usize, PixelRect),
    reach: i32,
    due: impl Fn(&mut Tile) -> &mut Option<PixelRect>,
) {
    for near in grid.around(index, reach).tiles {
        let part = pixels.grown(reach).intersection(&grid.rect(near));
        if part.pixels() > 0 {
            let due = due(&mut tiles[near]);
            *due = Some(due.map_or(part, |due| due.union(&part)));
        }
    }
}

/// How many tiles a thread takes at once where most need next to nothing.
const TILES_AT_ONCE: usize = 8;

/// Whether a tile may see a material.
fn sees(tile: &Tile, material: MaterialId) -> bool {
    tile.hits.get(material.index()).is_none_or(|hits| *hits > 0)
}

/// Memory and script engines, one for each thread that ever needs one.
struct Contexts<'a> {
    prepared: &'a Prepared,
    free: Mutex<Vec<TraceContext<'a>>>,
}

impl<'a> Contexts<'a> {
    fn with<T>(&self, work: impl FnOnce(&mut TraceContext<'a>) -> T) -> T {
        let free = self.free.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut context = free.unwrap_or_else(|| TraceContext::new(&self.prepared.scene, &self.prepared.setup.shaders));
        let result = work(&mut context);
        self.free.lock().unwrap_or_else(PoisonError::into_inner).push(context);
        result
    }
}

/// Does what a tile's samples need.
fn bring_up_to_date(
    tile: &mut Tile,
    rect: PixelRect,
    prepared: &Prepared,
    tracer: &TileTracer<'_>,
    contexts: &Contexts<'_>,
    keeps_record: bool,
) -> Sampled {
    let redo = std::mem::take(&mut tile.redo);
    let mut sampled = Sampled::default();
    let mut shade = redo.trace || redo.shades();
    if !shade && !redo.restyle.is_empty() {
        shade = !restyle(tile, &redo, prepared, tracer, contexts, &mut sampled);
    }
    if shade {
        let known = tile.record.take().filter(|_| !redo.trace).map(|mut record| {
            if redo.visibility {
                record.forget_visibility();
            }
            if redo.ties {
                record.forget_ties();
            }
            record
        });
        contexts.with(|context| {
            let memory = Memory::new(known.as_ref(), keeps_record);
            let traced = tracer.trace_with(rect, context, memory);
            tile.errors = std::mem::take(&mut context.errors);
            let (new, old) = (&traced.samples, tile.samples.as_deref());
            let lit_lines = prepared.plan.lines.as_ref().is_some_and(|lines| lines.rules.read_light());
            sampled.pixels_changed = old != Some(new);
            let changed = sampled.pixels_changed
                && old.is_none_or(|old| (lit_lines && old.paths != new.paths) || !old.same_nodes(new));
            sampled.changed = changed.then_some(rect);
            // Lines that let the sample's colour through have it mixed in.
            let covered = || tile.lines.as_ref().is_none_or(|lines| lines.lines.iter().all(|line| line.covers));
            sampled.own_lines_changed = old.is_none_or(|old| !old.same_colors(new)) && !covered();
            (sampled.traced, sampled.shaded) = (known.is_none(), known.is_some());
            sampled.rays += traced.rays;
            sampled.seconds += traced.seconds;
            sampled.shade_seconds = traced.shade_seconds;
            sampled.hits.clone_from(&traced.hits);
            tile.hits = traced.hits;
            tile.record = traced.record.or(known.filter(|_| keeps_record));
            tile.samples = Some(Box::new(traced.samples));
        });
    }
    let clock = CpuClock::thread();
    match (&prepared.plan.lines, &tile.samples) {
        (Some(lines), Some(samples)) if sampled.changed.is_some() || redo.bounds || tile.bounds.is_none() => {
            tile.bounds = Some(TileBounds::new(samples, &lines.rules));
        }
        (None, _) => tile.bounds = None,
        _ => {}
    }
    sampled.line_seconds = clock.seconds();
    sampled
}

/// Gives hits of some materials their line attributes again; `false` if the tile must be shaded instead.
fn restyle(
    tile: &mut Tile,
    redo: &Redo,
    prepared: &Prepared,
    tracer: &TileTracer<'_>,
    contexts: &Contexts<'_>,
    sampled: &mut Sampled,
) -> bool {
    let (Some(samples), Some(record)) = (tile.samples.as_deref_mut(), &tile.record) else { return false };
    let materials = prepared.scene.materials().len();
    sampled.hits = vec![0; materials];
    sampled.shade_seconds = vec![0.0; materials];
    let clock = CpuClock::thread();
    let shaders = &prepared.setup.shaders;
    let done = contexts.with(|context| {
        redo.restyle.iter().all(|material| match tracer.restyle(*material, shaders, samples, record, context) {
            Some(restyled) => {
                let (one, other) = (sampled.changed, restyled.changed);
                sampled.changed = one.zip(other).map(|(a, b)| a.union(&b)).or(one).or(other);
                sampled.rays += restyled.rays;
                sampled.hits[material.index()] += restyled.hits;
                sampled.shade_seconds[material.index()] += restyled.seconds;
                true
            }
            None => {
                // Whoever shades the tile hears what there is to say.
                context.errors = ShadeErrors::default();
                false
            }
        })
    });
    sampled.seconds += clock.seconds();
    sampled.restyled = done;
    sampled.pixels_changed = sampled.changed.is_some() && prepared.plan.layers.contains(&Layer::Feature);
    if !done {
        // Half restyled: nobody knows how it was.
        tile.samples = None;
    }
    done
}
