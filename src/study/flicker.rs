//! Flicker: how much the coverage of lines changes from frame to frame beyond what motion explains.
//!
//! The film is moved by a part of a pixel from each frame to the next, so that the ideal coverage moves as a whole and is
//! known, to any accuracy, from many samples: the *reference* of a frame is the same frame with many times the samples and
//! other patterns. A frame's *error* is its coverage less its reference. An error that stays where it is on the film is not
//! seen in motion; one that changes is. So flicker is the mean change of the error from frame to frame, relative to the
//! coverage of lines:
//!
//! flicker = Σ |(Cᵢ₊₁ − Rᵢ₊₁) − (Cᵢ − Rᵢ)| / Σ ½ (Rᵢ + Rᵢ₊₁), over all pixels and pairs of frames in a row.
//!
//! Sample patterns are *locked*: a pixel has the same in every frame. What that buys is told by the same number for patterns
//! that are drawn anew for each frame. The reference has errors of its own; it is the mean of two of equal rate, and
//! half of their difference, treated the same way, is the *floor* below which the numbers mean nothing.

use std::sync::Mutex;

use crate::diag::{Diagnostic, Diagnostics};
use crate::film::Layer;
use crate::math::DVec2;
use crate::plan::Plan;
use crate::render::{Control, RenderOptions, render};
use crate::scene::Scene;
use crate::scene::settings::RenderSettings;
use crate::shade::Shaders;

/// What to measure.
#[derive(Clone, Debug, PartialEq)]
pub struct FlickerOptions {
    /// Frames, at least 2.
    pub frames: u32,
    /// How far the film moves from each frame to the next, in pixels.
    pub step: [f64; 2],
    /// Samples of each of the two references, as a multiple of the scene's.
    pub reference: u32,
    /// Threads; 0 for as many as the machine has.
    pub threads: usize,
}

impl Default for FlickerOptions {
    fn default() -> Self {
        // Not a fraction with a small denominator: no phase of the pixel comes twice.
        Self { frames: 9, step: [0.117, 0.071], reference: 16, threads: 0 }
    }
}

/// What was measured. All but `coverage` are shares of the coverage.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Flicker {
    /// Area that lines cover, in pixels, in the mean of the frames.
    pub coverage: f64,
    /// Mean error of a single frame.
    pub error: f64,
    /// Its change from frame to frame.
    pub flicker: f64,
    /// The same with patterns that are drawn anew for each frame.
    pub unlocked_flicker: f64,
    /// How much of it the errors of the reference may be.
    pub floor: f64,
}

/// Coverage by pixel of one frame, however it was sampled.
struct Frame {
    locked: Vec<f32>,
    unlocked: Vec<f32>,
    references: [Vec<f32>; 2],
}

impl Frame {
    fn reference(&self, pixel: usize) -> f64 {
        self.references.iter().map(|coverage| f64::from(coverage[pixel])).sum::<f64>() / 2.0
    }
}

/// Measures the flicker of a scene. `frame` gives the scene of each frame, from 0: the same one, unless it moves by itself.
/// `progress` is called with the share that is done.
///
/// # Errors
/// If fewer than two frames are asked for, the step is not finite, the scene draws no lines, scripts fail, or what `frame` and
/// the renderer return.
pub fn flicker(
    mut frame: impl FnMut(u32) -> Result<(Scene, Shaders), Diagnostics>,
    options: &FlickerOptions,
    progress: &dyn Fn(f64),
) -> Result<Flicker, Diagnostics> {
    if options.frames < 2 {
        return Err(Diagnostic::error("flicker is between frames: at least 2 are needed").into());
    }
    if !options.step.iter().all(|step| step.is_finite()) {
        return Err(Diagnostic::error("the step between frames must be two finite numbers of pixels").into());
    }
    let mut sums = Sums::default();
    let mut last: Option<Frame> = None;
    for number in 0..options.frames {
        let (scene, shaders) = frame(number)?;
        let next = render_frame(scene, &shaders, number, options)?;
        sums.add_frame(&next);
        if let Some(last) = &last {
            if last.locked.len() != next.locked.len() {
                return Err(Diagnostic::error("the frames are not of one size").into());
            }
            sums.add_pair(last, &next);
        }
        last = Some(next);
        progress(f64::from(number + 1) / f64::from(options.frames));
    }
    if sums.coverage <= 0.0 {
        let fault = Diagnostic::error("this scene draws no lines, so there are none to flicker");
        return Err(fault.hint("`tusche explain` says why").into());
    }
    Ok(Flicker {
        coverage: sums.coverage / f64::from(options.frames),
        error: sums.error / sums.coverage,
        flicker: sums.locked / sums.of_pairs,
        unlocked_flicker: sums.unlocked / sums.of_pairs,
        floor: sums.floor / sums.of_pairs,
    })
}

#[derive(Default)]
struct Sums {
    coverage: f64,
    error: f64,
    of_pairs: f64,
    locked: f64,
    unlocked: f64,
    floor: f64,
}

impl Sums {
    fn add_frame(&mut self, frame: &Frame) {
        for (pixel, locked) in frame.locked.iter().enumerate() {
            let reference = frame.reference(pixel);
            self.coverage += reference;
            self.error += (f64::from(*locked) - reference).abs();
        }
    }

    fn add_pair(&mut self, before: &Frame, after: &Frame) {
        for pixel in 0..before.locked.len() {
            let references = [before.reference(pixel), after.reference(pixel)];
            let moved = references[1] - references[0];
            let changed = |before: &[f32], after: &[f32]| f64::from(after[pixel]) - f64::from(before[pixel]);
            self.of_pairs += (references[0] + references[1]) / 2.0;
            self.locked += (changed(&before.locked, &after.locked) - moved).abs();
            self.unlocked += (changed(&before.unlocked, &after.unlocked) - moved).abs();
            let [first, second] = [0, 1].map(|half| changed(&before.references[half], &after.references[half]));
            self.floor += (first - second).abs() / 2.0;
        }
    }
}

/// Renders a frame in all four ways.
fn render_frame(scene: Scene, shaders: &Shaders, number: u32, options: &FlickerOptions) -> Result<Frame, Diagnostics> {
    let shift = DVec2::from(options.step) * f64::from(number);
    let RenderSettings { samples, line_oversampling, seed, .. } = *scene.render();
    let mut builder = scene.into_builder();
    for camera in &mut builder.cameras {
        camera.film_shift += shift;
    }
    let mut coverage = |samples: u32, line_oversampling: u32, seed: u64| {
        builder.render.samples = samples;
        builder.render.line_oversampling = line_oversampling;
        builder.render.seed = seed;
        let scene = builder.clone().build()?;
        line_coverage(&scene, shaders, options.threads)
    };
    let many = samples.saturating_mul(options.reference.max(1));
    // Seeds that nobody chooses, so that no pattern is used for two purposes.
    let unused = |purpose: u64| seed ^ (purpose << 40);
    Ok(Frame {
        locked: coverage(samples, line_oversampling, seed)?,
        unlocked: coverage(samples, line_oversampling, unused(u64::from(number) + 3))?,
        references: [coverage(many, 1, unused(1))?, coverage(many, 1, unused(2))?],
    })
}

/// How much of each pixel lines cover, row by row.
fn line_coverage(scene: &Scene, shaders: &Shaders, threads: usize) -> Result<Vec<f32>, Diagnostics> {
    let plan = Plan::new(scene, shaders, &[Layer::Line]);
    let [width, height] = scene.render().size.map(|pixels| pixels as usize);
    let coverage = Mutex::new(vec![0.0; width * height]);
    let options = RenderOptions { threads, ..RenderOptions::default() };
    let report = render(scene, shaders, &plan, &options, &Control::default(), &|tile| {
        // The alpha of `line`.
        if let Some(alpha) = tile.channels.get(3) {
            let mut all = coverage.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            let row = tile.rect.width().max(1) as usize;
            for (y, values) in (tile.rect.y0 as usize..).zip(alpha.chunks(row)) {
                let start = y * width + tile.rect.x0 as usize;
                all[start..start + values.len()].copy_from_slice(values);
            }
        }
        Ok(())
    })?;
    if report.script_errors.has_errors() {
        return Err(report.script_errors);
    }
    Ok(coverage.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner))
}
