//! Pictures to an error (`--error E`): sampling stops, block by block, where the estimated error is small enough.
//!
//! # What the picture is
//!
//! The picture is cut into blocks of [`BLOCK`] × [`BLOCK`] pixels, counted from its upper left corner whatever the tiles, the
//! crop and the threads are. Every block has a *rate* of its own, a power of two of samples per pixel, and is, bit for bit,
//! that block of the picture that is rendered with this many samples everywhere (`--samples`).
//!
//! So nothing has to be defined anew where blocks of different rates meet. ρ and r' (DESIGN 3.9) are those of the block's
//! own rate; the line search of a sample sees neighbours of that rate alone, also those that lie beyond the block's border;
//! and the pixel filter gathers no other. To that end samples are traced around the blocks of a rate, as far as lines and
//! filter reach: they are the price, about 1.5 times the samples of a block in a row of blocks with lines of 2.5 px. The
//! alternative, to compare samples of different rates, has no exact answer: r' depends on the density across the edge, so a
//! line along a border would need two widths, and the bounds of the search one set for each pair of rates.
//!
//! # When a block is done
//!
//! All blocks are rendered at [`FIRST`] samples and at twice as many. With RMS errors e that fall as N^−0.75, as those of
//! stratified samples at edges do (measured: −0.77), and with patterns that know nothing of each other, two pictures of rates
//! a < b differ by d² = e_a² + e_b² in the mean, so that the error of the better one is e_b ≈ d · s / √(1 + s²), s = (a / b)^0.75.
//! The sequences of the other samplers begin alike at every rate: the better picture holds the samples of the other, its errors are
//! those that all its parts share, and d² = e_a² − e_b², so the sum under the root becomes a difference.
//!
//! d is the root mean square over the pixels of the block: that of the three colours as a screen shows them (linear, 0 … 1, what
//! is transparent before white) or that of the coverage of lines, whichever is greater. If the estimate is at most E, the block
//! is done; else it is rendered at the rate that should suffice, but at most four times as many samples, and looked at again.
//!
//! The estimate is of noise alone: what two rates miss alike, such as a wire far thinner than their samples are apart, is not
//! in it, and neither is an approximation that the scene makes (a minimum width, a depth). A picture waits in memory until all
//! its blocks are done, so memory grows with its area.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use serde::Serialize;

use super::stats::Sampling;
use super::{Control, Emit, Mask, Pass, RenderOptions, Report, Stage, Totals, on_threads};
use crate::diag::Diagnostic;
use crate::film::{FilmTile, Layer};
use crate::plan::Plan;
use crate::sample::PixelRect;
use crate::scene::Scene;
use crate::scene::settings::Sampler;
use crate::shade::{ShadeErrors, Shaders};

/// Side of a block in pixels.
pub const BLOCK: u32 = 16;
/// The rate that all blocks are first rendered at, in samples per pixel.
pub const FIRST: u32 = 4;
/// How fast errors fall with the number of samples: as this power of its inverse.
const SLOPE: f64 = 0.75;
/// Most that a rate grows by at once.
const MOST_GROWTH: u32 = 4;

/// When to stop sampling.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorGoal {
    /// The RMS error of a block's colours (linear, 0 … 1) and of its line coverage that is small enough; above 0.
    pub error: f64,
    /// The most samples per pixel; a power of two above [`FIRST`]. Blocks that would need more are left at that.
    pub most: u32,
}

impl ErrorGoal {
    /// The least error that can be asked for: what edges of full contrast come to with [`Self::MOST`] samples.
    pub const LEAST: f64 = 0.0005;
    /// The most samples per pixel unless asked for otherwise.
    pub const MOST: u32 = 1024;
}

/// What rates a picture was rendered with.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Refinement {
    /// The error that was asked for.
    pub error: f64,
    /// The rates that blocks ended at, and how much of the picture that is.
    pub rates: Vec<Rate>,
    /// The mean of the rates over the pixels.
    pub mean_samples: f64,
    /// Blocks whose error is still above what was asked for.
    pub unfinished_blocks: usize,
    /// The largest error that is estimated for any block.
    pub largest_error: f64,
}

/// A rate and its share.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Rate {
    /// Samples per pixel.
    pub samples: u32,
    /// Pixels of the picture.
    pub pixels: u64,
}

/// The layers that the plan of such a picture must have: those to write, and what errors are measured on.
#[must_use]
pub fn measured_layers(layers: &[Layer]) -> Vec<Layer> {
    let mut all: Vec<Layer> = layers.iter().cloned().chain([Layer::Rgba, Layer::Line]).collect();
    all.sort();
    all.dedup();
    all
}

/// The error of the better of two pictures of a block, estimated from what they differ by; see the module.
#[must_use]
pub fn estimate(difference: f64, rates: [u32; 2], sampler: Sampler) -> f64 {
    let ratio = libm::pow(f64::from(rates[0]) / f64::from(rates[1]), SLOPE);
    let shared = if sampler == Sampler::Stratified { 1.0 } else { -1.0 };
    difference * ratio / (1.0 + shared * ratio * ratio).sqrt()
}

/// The rate that a block needs next if its error at a rate is estimated to be this; `None` if it is done.
#[must_use]
pub fn next_rate(goal: &ErrorGoal, rate: u32, error: f64) -> Option<u32> {
    if error <= goal.error || rate >= goal.most {
        return None;
    }
    let growth = libm::pow(error / goal.error, 1.0 / SLOPE);
    let mut next = rate.saturating_mul(2);
    while next < goal.most && next < rate.saturating_mul(MOST_GROWTH) && f64::from(next) < f64::from(rate) * growth {
        next = next.saturating_mul(2);
    }
    Some(next.min(goal.most))
}

/// Renders a scene to an error, under a plan whose layers are those of [`measured_layers`]; see the module. The scene's own
/// number of samples does not matter. Tiles of the plan's layers go to `emit` once they are done.
///
/// If it is stopped, the blocks that are not done come as they are.
///
/// # Errors
/// As [`super::render`].
pub fn render_to_error(
    scene: &Scene,
    shaders: &Shaders,
    plan: &Plan,
    goal: &ErrorGoal,
    options: &RenderOptions,
    control: &Control<'_>,
    emit: Emit<'_>,
) -> Result<Report, Diagnostic> {
    on_threads(options.threads, || {
        let start = Instant::now();
        let stage = Stage::new(scene, plan);
        let mut totals = Totals::new(scene.materials().len());
        let mut errors = ShadeErrors::default();
        let picture = PixelRect::of_size(scene.render().size);
        let crop = options.crop.map_or(picture, |crop| crop.intersection(&picture));
        // Whole blocks are looked at, so that a crop comes out as in the whole picture.
        let whole = crop.to_blocks(BLOCK).intersection(&picture);
        let all = Mask::new(scene.render().size, whole, BLOCK, |_| true);
        let mut course = Course::new(goal, scene.render().sampler, &all, Canvas::new(whole, &plan.layers));
        let emit = |course: &Course<'_>, block: usize| {
            let rect = all.rect(block).intersection(&crop);
            if rect.pixels() > 0 { emit(&course.canvas.tile(rect)) } else { Ok(()) }
        };
        // Small tiles trace fewer samples for nothing around single blocks.
        let options = RenderOptions { tile: options.tile.min(BLOCK), crop: Some(whole), ..options.clone() };
        let mut complete = true;
        let mut passes = 0;
        while let Some((rate, blocks)) = course.waiting.pop_first() {
            let mask = all.of(&blocks);
            let scene = scene.with_samples(rate);
            let plan = Plan::new(&scene, shaders, &plan.layers);
            // How many passes there will be is not known: each goes half of the way that is left.
            let share = |done: f64| 1.0 - libm::pow(0.5, f64::from(passes) + done);
            let progress = |done: f64| control.progress.iter().for_each(|progress| progress(share(done)));
            let control = Control { cancel: control.cancel, progress: Some(&progress) };
            let pass =
                Pass { scene: &scene, shaders, plan: &plan, options: &options, control: &control, mask: Some(&mask) };
            let fresh = Mutex::new(Canvas::new(mask.extent(), &plan.layers));
            let put = |tile: &FilmTile| {
                fresh.lock().unwrap_or_else(PoisonError::into_inner).put(tile);
                Ok(())
            };
            if !stage.render(&pass, &mut totals, &mut errors, &put)? {
                complete = false;
                course.waiting.insert(rate, blocks);
                break;
            }
            let fresh = fresh.into_inner().unwrap_or_else(PoisonError::into_inner);
            for block in course.take(rate, &blocks, &fresh) {
                emit(&course, block)?;
            }
            passes += 1;
        }
        if !complete {
            let begun: Vec<_> = course.waiting.values().flatten().filter(|block| course.rates[**block] > 0).collect();
            begun.into_iter().try_for_each(|block| emit(&course, *block))?;
        }
        totals.seconds.build = stage.build_seconds;
        let refinement = course.refinement();
        let mut report = totals.report(scene, shaders, plan, errors, complete);
        report.stats.sampling = Some(Sampling::Error(refinement));
        report.stats.seconds.total = start.elapsed().as_secs_f64();
        Ok(report)
    })
}

/// How far the blocks of a picture are.
struct Course<'a> {
    goal: &'a ErrorGoal,
    sampler: Sampler,
    all: &'a Mask,
    /// What is known of the picture.
    canvas: Canvas,
    /// By block: the rate of what the canvas holds; 0 for nothing.
    rates: Vec<u32>,
    /// By block: its estimated error.
    errors: Vec<f64>,
    /// By the rate that they need next, the blocks that are not done.
    waiting: BTreeMap<u32, Vec<usize>>,
}

impl<'a> Course<'a> {
    fn new(goal: &'a ErrorGoal, sampler: Sampler, all: &'a Mask, canvas: Canvas) -> Self {
        let blocks: Vec<usize> = all.blocks().collect();
        let count = blocks.last().map_or(0, |last| last + 1);
        let waiting = if blocks.is_empty() { BTreeMap::new() } else { BTreeMap::from([(FIRST, blocks)]) };
        Self { goal, sampler, all, canvas, rates: vec![0; count], errors: vec![f64::INFINITY; count], waiting }
    }

    /// Takes in what a pass made of some blocks; returns those that are done.
    fn take(&mut self, rate: u32, blocks: &[usize], fresh: &Canvas) -> Vec<usize> {
        let mut done = Vec::new();
        for &block in blocks {
            let rect = self.all.rect(block);
            let before = self.rates[block];
            let next = if before == 0 {
                Some(rate.saturating_mul(2))
            } else {
                self.errors[block] = estimate(self.canvas.difference(fresh, rect), [before, rate], self.sampler);
                next_rate(self.goal, rate, self.errors[block])
            };
            self.canvas.put(&fresh.tile(rect));
            self.rates[block] = rate;
            match next {
                Some(next) => self.waiting.entry(next).or_default().push(block),
                None => done.push(block),
            }
        }
        // In the order of blocks, whatever rates they come from.
        self.waiting.values_mut().for_each(|blocks| blocks.sort_unstable());
        done
    }

    fn refinement(&self) -> Refinement {
        let mut pixels = BTreeMap::new();
        for (block, rate) in self.rates.iter().enumerate().filter(|(_, rate)| **rate > 0) {
            *pixels.entry(*rate).or_insert(0) += self.all.rect(block).pixels() as u64;
        }
        let rates: Vec<_> = pixels.into_iter().map(|(samples, pixels)| Rate { samples, pixels }).collect();
        let sum = |of: fn(&Rate) -> u64| rates.iter().map(of).sum::<u64>() as f64;
        let known = || self.errors.iter().filter(|error| error.is_finite());
        Refinement {
            error: self.goal.error,
            mean_samples: sum(|rate| u64::from(rate.samples) * rate.pixels) / sum(|rate| rate.pixels).max(1.0),
            rates,
            unfinished_blocks: known().filter(|error| **error > self.goal.error).count(),
            largest_error: known().copied().fold(0.0, f64::max),
        }
    }
}

/// All channels of some layers for a rectangle of pixels.
struct Canvas {
    rect: PixelRect,
    channels: Vec<Vec<f32>>,
    /// The first channel of `rgba` and of `line`.
    color: Option<usize>,
    line: Option<usize>,
}

impl Canvas {
    fn new(rect: PixelRect, layers: &[Layer]) -> Self {
        let count = |layers: &[Layer]| layers.iter().map(|layer| layer.channels().len()).sum();
        let first = |layer| Some(count(&layers[..layers.iter().position(|known| *known == layer)?]));
        Self {
            rect,
            channels: vec![vec![0.0; rect.pixels()]; count(layers)],
            color: first(Layer::Rgba),
            line: first(Layer::Line),
        }
    }

    /// The places of a row of pixels.
    fn row(&self, rect: PixelRect, y: i32) -> std::ops::Range<usize> {
        let start = (y - self.rect.y0) as usize * self.rect.width() as usize + (rect.x0 - self.rect.x0) as usize;
        start..start + rect.width() as usize
    }

    fn put(&mut self, tile: &FilmTile) {
        for y in tile.rect.y0..tile.rect.y1 {
            let to = self.row(tile.rect, y);
            let from = (y - tile.rect.y0) as usize * to.len();
            for (channel, values) in self.channels.iter_mut().zip(&tile.channels) {
                channel[to.clone()].copy_from_slice(&values[from..from + to.len()]);
            }
        }
    }

    fn tile(&self, rect: PixelRect) -> FilmTile {
        let rows = |channel: &Vec<f32>| (rect.y0..rect.y1).flat_map(|y| channel[self.row(rect, y)].to_vec()).collect();
        FilmTile { rect, channels: self.channels.iter().map(rows).collect() }
    }

    /// The RMS difference of two pictures of a rectangle: of colours or of line coverage, whichever is greater.
    fn difference(&self, other: &Self, rect: PixelRect) -> f64 {
        let shown = |value: f32| if value > 0.0 { f64::from(value.min(1.0)) } else { 0.0 };
        let (mut colors, mut lines) = (0.0, 0.0);
        for y in rect.y0..rect.y1 {
            for (own, others) in self.row(rect, y).zip(other.row(rect, y)) {
                if let Some(first) = self.color {
                    let value = |canvas: &Self, at: usize, axis: usize| {
                        let white = 1.0 - canvas.channels[first + 3][at];
                        shown(canvas.channels[first + axis][at] + white)
                    };
                    for axis in 0..3 {
                        let difference = value(self, own, axis) - value(other, others, axis);
                        colors += difference * difference;
                    }
                }
                if let Some(first) = self.line {
                    let difference = shown(self.channels[first + 3][own]) - shown(other.channels[first + 3][others]);
                    lines += difference * difference;
                }
            }
        }
        let pixels = (rect.pixels() as f64).max(1.0);
        (colors / (3.0 * pixels)).sqrt().max((lines / pixels).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOAL: ErrorGoal = ErrorGoal { error: 0.01, most: 256 };

    #[test]
    fn the_estimate_is_that_of_pictures_whose_errors_fall_as_they_should() {
        for (a, b) in [(4, 8), (8, 32), (16, 64)] {
            let [ea, eb] = [a, b].map(|rate: u32| 0.3 * libm::pow(f64::from(rate), -0.75));
            let difference = (ea * ea + eb * eb).sqrt();
            assert!((estimate(difference, [a, b], Sampler::Stratified) - eb).abs() < 1e-12);
            let difference = (ea * ea - eb * eb).sqrt();
            assert!((estimate(difference, [a, b], Sampler::Sobol) - eb).abs() < 1e-12);
        }
        assert_eq!(estimate(0.0, [4, 8], Sampler::Stratified), 0.0);
    }

    #[test]
    fn the_next_rate_is_the_one_that_should_suffice_or_four_times_as_many() {
        let next = |rate, error| next_rate(&GOAL, rate, error);
        assert_eq!((next(8, 0.0), next(8, 0.01), next(256, 1.0)), (None, None, None));
        assert_eq!(
            (next(8, 0.0101), next(8, 0.0168), next(8, 0.0169), next(8, 1.0)),
            (Some(16), Some(16), Some(32), Some(32))
        );
        assert_eq!((next(128, 1.0), next(64, 1.0)), (Some(256), Some(256)));
    }
}
