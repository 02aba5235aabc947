//! The best picture within a time (`--time T`): how many samples fit.
//!
//! A *pilot* renders a lattice of small blocks, spread evenly over this very picture, first with one sample per pixel, then with
//! as many as seem to fit, as far as a tenth of the time that is left allows. CPU seconds per sample and per pixel, the share of
//! the CPU that other programs leave, and the time that building hierarchies takes give the time of the whole picture. Then
//! the picture is rendered from start to end with the number that was chosen. So it is complete and of one kind, and `--samples`
//! with that number makes it again, bit for bit, on any machine.
//!
//! Time counts from the start of the command to the finished files. What these take is learnt, too: the blocks of a pilot are packed
//! together as the files will be. [`AIM`] of the time is aimed at.
//!
//! How to choose is kept apart from the clock ([`Chooser`]), so that it can be tested with clocks and costs that are made up.

use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use serde::Serialize;

use super::files::{PictureFile, file_seconds, layers_of};
use super::{Control, Mask, Pass, RenderOptions, Stage, Totals, on_threads};
use crate::diag::Diagnostic;
use crate::film::{FilmTile, Layer};
use crate::plan::Plan;
use crate::sample::PixelRect;
use crate::scene::Scene;
use crate::shade::{ShadeErrors, Shaders};

/// The part of the time that is aimed at.
pub const AIM: f64 = 0.96;
/// Side of the blocks of a pilot in pixels.
const BLOCK: u32 = 16;
/// Fewer blocks than this tell too little.
const LEAST_BLOCKS: usize = 48;
/// The part of the time left that a pilot may take.
const PILOT_SHARE: f64 = 0.1;
/// How many times as many samples as the one before a pilot has, at most: how costs grow has to be seen before it is relied on.
const GROWTH: u32 = 8;
/// Most pilots.
const MOST_PILOTS: usize = 6;

/// How many samples were chosen, and why.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Choice {
    /// The time that was asked for, in seconds.
    pub asked_seconds: f64,
    /// What the pilots took.
    pub pilot_seconds: f64,
    /// What the whole was expected to take, pilots and loading included.
    pub expected_seconds: f64,
    /// Samples per pixel.
    pub samples: u32,
}

/// What a pilot found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// Its samples per pixel.
    pub samples: u32,
    /// Seconds that it took.
    pub took: f64,
    /// Seconds that the whole picture should take at this rate, without what takes the same at any rate.
    pub whole: f64,
}

/// What to do next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Step {
    /// Run a pilot with this many samples per pixel.
    Measure(u32),
    /// Render the picture with this many; it should be finished at this time.
    Render(u32, f64),
    /// Not even one sample fits: the time that it would take.
    TooShort(f64),
}

/// Decides how many samples fit into a time. All times are seconds from the start of the command.
#[derive(Clone, Debug)]
pub struct Chooser {
    /// When the picture should be finished.
    aim: f64,
    /// What the picture takes at any rate.
    fixed: f64,
    measured: Vec<Measured>,
}

impl Chooser {
    /// A chooser for a time; `fixed` are the seconds that a picture takes beside its samples.
    #[must_use]
    pub fn new(time: f64, fixed: f64) -> Self {
        Self { aim: time * AIM, fixed, measured: Vec::new() }
    }

    /// Takes in what a pilot found.
    pub fn add(&mut self, measured: Measured) {
        self.measured.push(measured);
    }

    /// What to do at this time.
    #[must_use]
    pub fn next(&self, now: f64) -> Step {
        let Some(last) = self.measured.last() else { return Step::Measure(1) };
        let left = self.aim - now - self.fixed;
        if self.expected(1.0) > left {
            return Step::TooShort((now + self.fixed + self.expected(1.0)) / AIM);
        }
        // Pilots of more samples take time, too.
        let per_sample = last.took / f64::from(last.samples);
        let affordable = (left * PILOT_SHARE / per_sample.max(1e-9)) as u32;
        let grown = last.samples.saturating_mul(GROWTH);
        let pilot = self.fitting(left * (1.0 - PILOT_SHARE)).min(affordable).min(grown);
        if self.measured.len() < MOST_PILOTS && pilot >= last.samples.saturating_mul(2) {
            return Step::Measure(pilot);
        }
        let samples = self.fitting(left);
        Step::Render(samples, now + self.fixed + self.expected(f64::from(samples)))
    }

    /// The most samples whose picture takes no longer than this.
    fn fitting(&self, seconds: f64) -> u32 {
        let (Some(last), slope) = (self.measured.last(), self.slope()) else { return 1 };
        let samples = f64::from(last.samples) + (seconds - last.whole) / slope.max(1e-12);
        (samples as u32).clamp(1, Scene::MAX_SAMPLES)
    }

    /// What the samples of a picture take.
    fn expected(&self, samples: f64) -> f64 {
        let Some(last) = self.measured.last() else { return 0.0 };
        last.whole + (samples - f64::from(last.samples)) * self.slope()
    }

    /// Seconds for each further sample per pixel: those between the last two pilots, but neither far less nor more than a
    /// sample took in the last.
    fn slope(&self) -> f64 {
        let Some(last) = self.measured.last() else { return 0.0 };
        let mean = last.whole / f64::from(last.samples);
        let Some(before) = self.measured.iter().rev().find(|known| known.samples < last.samples) else { return mean };
        ((last.whole - before.whole) / f64::from(last.samples - before.samples)).clamp(0.6 * mean, 1.25 * mean)
    }
}

/// Chooses how many samples per pixel fit into a time of `seconds` from `start`, for a picture in these files. `None` if it was
/// stopped.
///
/// # Errors
/// If not even one fits, or no threads could be started.
pub fn choose_samples(
    scene: &Scene,
    shaders: &Shaders,
    files: &[PictureFile],
    (seconds, start): (f64, Instant),
    options: &RenderOptions,
    control: &Control<'_>,
) -> Result<Option<Choice>, Diagnostic> {
    on_threads(options.threads, || {
        let now = || start.elapsed().as_secs_f64();
        let begun = now();
        let mut pilot = Pilot::new(scene, shaders, files, options);
        let mut chooser = Chooser::new(seconds, now() - begun);
        loop {
            match chooser.next(now()) {
                Step::Measure(samples) => match pilot.measure(samples, control, seconds, &now)? {
                    Some(measured) => chooser.add(measured),
                    None => return Ok(None),
                },
                Step::Render(samples, expected_seconds) => {
                    let pilot_seconds = now() - begun;
                    return Ok(Some(Choice { asked_seconds: seconds, pilot_seconds, expected_seconds, samples }));
                }
                Step::TooShort(needed) => return Err(too_short(seconds, needed)),
            }
        }
    })
}

fn too_short(seconds: f64, needed: f64) -> Diagnostic {
    let least = (needed * 10.0).ceil() / 10.0;
    let fault = Diagnostic::error(format!(
        "{seconds} s are too short for this picture: it takes about {least:.1} s with only one sample per pixel"
    ));
    fault.hint(format!("give --time {least:.1} or more, or make the picture smaller with --size"))
}

/// Renders a part of a picture to learn what the whole takes.
struct Pilot<'a> {
    scene: &'a Scene,
    shaders: &'a Shaders,
    files: &'a [PictureFile],
    layers: Vec<Layer>,
    options: RenderOptions,
    stage: Stage,
    mask: Mask,
    crop: PixelRect,
}

impl<'a> Pilot<'a> {
    fn new(scene: &'a Scene, shaders: &'a Shaders, files: &'a [PictureFile], options: &RenderOptions) -> Self {
        let layers = layers_of(files);
        let stage = Stage::new(scene, &Plan::new(scene, shaders, &layers));
        let size = scene.render().size;
        let picture = PixelRect::of_size(size);
        let crop = options.crop.map_or(picture, |crop| crop.intersection(&picture));
        let options = RenderOptions { tile: options.tile.min(BLOCK), crop: Some(crop), ..options.clone() };
        Self { scene, shaders, files, layers, options, stage, mask: lattice(size, crop), crop }
    }

    fn measure(
        &mut self,
        samples: u32,
        control: &Control<'_>,
        seconds: f64,
        now: &(impl Fn() -> f64 + Sync),
    ) -> Result<Option<Measured>, Diagnostic> {
        let start = now();
        let scene = self.scene.with_samples(samples);
        let plan = Plan::new(&scene, self.shaders, &self.layers);
        let progress = |_| control.progress.iter().for_each(|progress| progress((now() / seconds).min(1.0)));
        let control = Control { cancel: control.cancel, progress: Some(&progress) };
        let mut totals = Totals::new(scene.materials().len());
        let mut errors = ShadeErrors::default();
        let (shaders, options) = (self.shaders, &self.options);
        let pass = Pass { scene: &scene, shaders, plan: &plan, options, control: &control, mask: Some(&self.mask) };
        let tiles = Mutex::new(Vec::new());
        let keep = |tile: &FilmTile| {
            tiles.lock().unwrap_or_else(PoisonError::into_inner).push(tile.clone());
            Ok(())
        };
        if !self.stage.render(&pass, &mut totals, &mut errors, &keep)? {
            return Ok(None);
        }
        let tiles = tiles.into_inner().unwrap_or_else(PoisonError::into_inner);
        let [packing, closing] = file_seconds(self.scene.render(), &self.layers, self.files, &tiles)?;
        let reach = plan.lines.as_ref().map_or(0, |lines| lines.reach) + plan.filter.reach();
        let sampled = self.crop.grown(reach).intersection(&PixelRect::of_size(scene.render().size)).pixels();
        let shown: usize = self.mask.blocks().map(|block| self.mask.rect(block).pixels()).sum();
        let cost = &totals.seconds;
        let of_samples = (cost.trace + cost.shade + cost.lines) / (totals.samples as f64).max(1.0);
        let of_pixels = cost.film / (shown as f64).max(1.0) + packing;
        let cpu = of_samples * sampled as f64 * f64::from(samples) + of_pixels * self.crop.pixels() as f64;
        // Where other programs want the CPUs, too, a second of work takes longer.
        let all = cost.trace + cost.shade + cost.lines + cost.film;
        let load = (totals.busy_seconds / all.max(1e-9)).max(1.0);
        // One thread closes the files.
        let alone = closing * self.crop.pixels() as f64;
        let whole = (cpu / rayon::current_num_threads() as f64 + alone) * load;
        Ok(Some(Measured { samples, took: now() - start, whole }))
    }
}

/// Blocks of a picture that are spread evenly: one of 25, or of 5, or all, as long as that makes enough.
fn lattice(size: [u32; 2], crop: PixelRect) -> Mask {
    // (4, 3) and (1, 2) are the shortest vectors of these lattices, which are squares.
    let one_of = |count: usize, step: usize| {
        Mask::new(size, crop, BLOCK, |[column, row]| (column + step * row) % count == count / 2)
    };
    let sparse = [(25, 7), (5, 2)].into_iter().map(|(count, step)| one_of(count, step));
    sparse.into_iter().find(|mask| mask.blocks().count() >= LEAST_BLOCKS).unwrap_or_else(|| one_of(1, 0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Plays the choice with a made-up cost of a picture by its samples. Returns the samples and when it ends.
    fn play(time: f64, fixed: f64, share: f64, cost: impl Fn(f64) -> f64) -> Result<(u32, f64), f64> {
        let mut chooser = Chooser::new(time, fixed);
        let mut now = fixed;
        loop {
            match chooser.next(now) {
                Step::Measure(samples) => {
                    let whole = cost(f64::from(samples));
                    now += share * whole;
                    chooser.add(Measured { samples, took: share * whole, whole });
                }
                Step::Render(samples, _) => return Ok((samples, now + fixed + cost(f64::from(samples)))),
                Step::TooShort(needed) => return Err(needed),
            }
        }
    }

    #[test]
    fn pictures_end_in_time_whatever_their_cost() {
        // By samples: in proportion, with a part that is the same for all, and growing faster or more slowly.
        let costs: [fn(f64) -> f64; 4] =
            [|n| 0.1 * n, |n| 0.4 + 0.1 * n, |n| 0.05 * libm::pow(n, 1.15), |n| 0.1 * libm::pow(n, 0.9)];
        for (index, cost) in costs.into_iter().enumerate() {
            for time in [3.0, 5.0, 10.0, 90.0, 1000.0] {
                let (samples, end) = play(time, 0.05, 0.09, cost).unwrap_or_else(|needed| panic!("{needed} s"));
                let one_more = cost(f64::from(samples + 1)) - cost(f64::from(samples));
                assert!(end < 1.02 * time, "cost {index}: {samples} samples end at {end} of {time}");
                let is_most = samples == Scene::MAX_SAMPLES;
                assert!(
                    is_most || end + one_more > 0.88 * time,
                    "cost {index}: {samples} samples end at {end} of {time}"
                );
            }
        }
    }

    #[test]
    fn what_is_too_short_is_told_with_what_it_takes() {
        let needed = play(0.5, 0.2, 0.1, |n| 0.3 * n).expect_err("one sample takes 0.73 s");
        assert!((0.7..0.85).contains(&needed), "{needed}");
        assert!(play(needed + 1e-6, 0.2, 0.1, |n| 0.3 * n).is_ok_and(|(samples, _)| samples == 1));
        let fault = too_short(0.5, needed).to_string();
        assert!(fault.contains("0.5 s are too short"), "{fault}");
    }

    #[test]
    fn no_picture_gets_more_samples_than_there_can_be() {
        assert_eq!(play(1e6, 0.0, 0.1, |n| 1e-6 * n).map(|(samples, _)| samples), Ok(Scene::MAX_SAMPLES));
    }

    #[test]
    fn pilots_are_spread_evenly_and_never_tiny() {
        let blocks = |size: [u32; 2]| lattice(size, PixelRect::of_size(size)).blocks().count();
        assert_eq!((blocks([1280, 720]), blocks([320, 180]), blocks([40, 30])), (144, 48, 6));
        let mask = lattice([1280, 720], PixelRect::of_size([1280, 720]));
        for row in 0..4 {
            // Each square of 10 × 10 blocks has about four.
            for column in 0..8 {
                let square = PixelRect { x0: column * 160, y0: row * 160, x1: column * 160 + 160, y1: row * 160 + 160 };
                let count = mask.parts_of(square).len();
                assert!((3..=5).contains(&count), "{count} at {column}, {row}");
            }
        }
    }
}
