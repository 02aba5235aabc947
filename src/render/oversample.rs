//! More samples where lines are (`render.line_oversampling`).
//!
//! Lines are what takes most samples: a pixel on an edge has an error that falls as N^−0.75, one on an even surface next to none.
//!
//! # What the picture is
//!
//! A *pilot* of few samples per pixel looks for lines. It runs the line pass alone: no light and no colour is worked out that no
//! line depends on. The picture is cut into blocks of [`Oversampling::BLOCK`]² pixels, counted from its upper left corner whatever
//! tiles, crop and threads are. A block is *lined* if a pixel within it, or within the reach of lines around it, shows a line in
//! the pilot, at whatever path and of whatever surface. Lined blocks get `samples` × `line_oversampling` samples per pixel, all
//! others `samples`; each is, bit for bit, that block of the picture that has its rate everywhere, as in [`refine`](super::refine),
//! which says why.
//!
//! # Why that is unbiased
//!
//! Which rate a block gets depends on the pilot alone, whose samples have a seed of their own and are thrown away. So given the
//! rate, the picture's samples are those of any picture of that rate, and the mean of a block over many seeds is a mean of what
//! plain pictures of either rate have there: where both are right on average, so is this. A block whose lines the pilot missed
//! still gets `samples` samples that may find them. To keep the samples that decided would be wrong: small things that
//! they missed would stay missing, those that they hit by luck would stay, and both would be looked at too rarely or too often.
//!
//! # What it takes
//!
//! The rates are rendered one after the other, each in blocks here and there. Samples are traced around them as far as lines and the
//! pixel filter reach, at both rates where both meet. Picture files keep in memory, until the second rate comes, what of their own
//! blocks is begun: 64 × 64 pixels, of which many may have both rates, so memory grows with the area of the picture.

use std::sync::atomic::{AtomicBool, Ordering};

use serde::Serialize;

use super::refine::Rate;
use super::stats::Rays;
use super::{Control, Emit, Mask, Pass, RenderOptions, Stage, Totals};
use crate::diag::Diagnostic;
use crate::film::{FilmTile, Layer};
use crate::line::Method;
use crate::plan::{Oversampling, Plan};
use crate::sample::PixelRect;
use crate::scene::Scene;
use crate::shade::{ShadeErrors, Shaders};

/// What a picture with more samples at lines was made of.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Oversampled {
    /// Samples per pixel of the pilot.
    pub pilot_samples: u32,
    /// The pilot's rays; those of the whole picture's statistics hold them, too.
    pub pilot_rays: Rays,
    /// CPU seconds of the pilot; again they are among the others.
    pub pilot_seconds: f64,
    /// How much of the picture has which rate.
    pub rates: Vec<Rate>,
    /// Blocks in which, or near which, the pilot found lines.
    pub lined_blocks: usize,
    /// All blocks.
    pub blocks: usize,
}

/// Side of a block in pixels.
const BLOCK: u32 = Oversampling::BLOCK;
/// How much of the work the pilot is taken to be; what follows is known only once it is done.
const PILOT_PROGRESS: f64 = 0.05;

/// Makes the seed of pilots another than that of any picture.
const PILOT_SEED: u64 = 0x0070_696c_6f74_0000;

/// Renders a picture whose plan asks for it. Returns whether it was not stopped. To be called on the threads that do the work.
pub(super) fn render(
    stage: &Stage,
    pass: &Pass<'_>,
    rates: &Oversampling,
    (totals, errors): (&mut Totals, &mut ShadeErrors),
    emit: Emit<'_>,
) -> Result<(bool, Oversampled), Diagnostic> {
    let Pass { scene, shaders, plan, options, control, .. } = *pass;
    let picture = PixelRect::of_size(scene.render().size);
    let crop = options.crop.map_or(picture, |crop| crop.intersection(&picture));
    let share = |from: f64, part: f64| {
        move |done: f64| control.progress.iter().for_each(|progress| progress(from + part * done))
    };
    let passes = [rates.elsewhere, rates.lines];

    let pilot = Pilot { stage, scene, shaders, rates, options };
    let progress = share(0.0, PILOT_PROGRESS);
    let lined =
        pilot.lined_blocks(crop, &Control { cancel: control.cancel, progress: Some(&progress) }, totals, errors)?;
    let mut found = Oversampled {
        pilot_samples: rates.pilot,
        pilot_rays: totals.rays.into(),
        pilot_seconds: totals.seconds.trace + totals.seconds.shade + totals.seconds.lines + totals.seconds.film,
        rates: Vec::new(),
        lined_blocks: 0,
        blocks: 0,
    };
    let Some(lined) = lined else { return Ok((false, found)) };
    let columns = scene.render().size[0].div_ceil(BLOCK) as usize;
    let masks = [false, true].map(|wanted| {
        Mask::new(scene.render().size, crop, BLOCK, |[column, row]| lined[row * columns + column] == wanted)
    });
    found.lined_blocks = masks[1].blocks().count();
    found.blocks = found.lined_blocks + masks[0].blocks().count();
    let pixels = masks.each_ref().map(|mask| mask.blocks().map(|block| mask.rect(block).pixels() as u64).sum::<u64>());
    let work = [0, 1].map(|which| pixels[which] as f64 * f64::from(passes[which]));

    let rates = passes.into_iter().zip(pixels).filter(|(_, pixels)| *pixels > 0);
    found.rates = rates.map(|(samples, pixels)| Rate { samples, pixels }).collect();
    let mut from = PILOT_PROGRESS;
    for (which, rate) in passes.into_iter().enumerate().filter(|(which, _)| pixels[*which] > 0) {
        let scene = scene.with_samples(rate);
        let plan = Plan::new(&scene, shaders, &plan.layers);
        // Small tiles trace fewer samples for nothing around single blocks.
        let options = RenderOptions { tile: options.tile.min(BLOCK), ..options.clone() };
        let part = (1.0 - PILOT_PROGRESS) * work[which] / (work[0] + work[1]);
        let progress = share(from, part);
        from += part;
        let control = Control { cancel: control.cancel, progress: Some(&progress) };
        let mask = Some(&masks[which]);
        let pass = Pass { scene: &scene, shaders, plan: &plan, options: &options, control: &control, mask };
        if !stage.render(&pass, totals, errors, emit)? {
            return Ok((false, found));
        }
    }
    Ok((true, found))
}

/// Samples per pixel around a pixel of the picture.
///
/// # Errors
/// If no threads could be started.
pub(super) fn rate_at(scene: &Scene, shaders: &Shaders, plan: &Plan, pixel: [i32; 2]) -> Result<u32, Diagnostic> {
    let Some(rates) = &plan.oversampling else { return Ok(scene.render().samples) };
    let stage = Stage::new(scene, plan);
    let options = RenderOptions::default();
    let pilot = Pilot { stage: &stage, scene, shaders, rates, options: &options };
    let mut totals = Totals::new(scene.materials().len());
    let own = PixelRect { x0: pixel[0], y0: pixel[1], x1: pixel[0] + 1, y1: pixel[1] + 1 };
    let lined = pilot.lined_blocks(own, &Control::default(), &mut totals, &mut ShadeErrors::default())?;
    let columns = scene.render().size[0].div_ceil(BLOCK) as usize;
    let block = pixel[1] as usize / BLOCK as usize * columns + pixel[0] as usize / BLOCK as usize;
    Ok(if lined.is_some_and(|lined| lined[block]) { rates.lines } else { rates.elsewhere })
}

/// Looks for lines.
struct Pilot<'a> {
    stage: &'a Stage,
    scene: &'a Scene,
    shaders: &'a Shaders,
    rates: &'a Oversampling,
    options: &'a RenderOptions,
}

impl Pilot<'_> {
    /// Which blocks of the picture are lined, row by row, as far as they touch a crop; `None` if it was stopped.
    fn lined_blocks(
        &self,
        crop: PixelRect,
        control: &Control<'_>,
        totals: &mut Totals,
        errors: &mut ShadeErrors,
    ) -> Result<Option<Vec<bool>>, Diagnostic> {
        let size = self.scene.render().size;
        let picture = PixelRect::of_size(size);
        let [columns, rows] = size.map(|pixels| pixels.div_ceil(BLOCK) as usize);
        let scene = self.scene.with_samples(self.rates.pilot).with_seed(self.scene.render().seed ^ PILOT_SEED);
        let plan = Plan::new(&scene, self.shaders, &[Layer::Line]);
        let reach = plan.lines.as_ref().map_or(0, |lines| lines.reach);
        // Whole blocks are looked at, so that a crop comes out as in the whole picture.
        let looked_at = crop.to_blocks(BLOCK).grown(reach).intersection(&picture);
        let lined: Vec<AtomicBool> = (0..columns * rows).map(|_| AtomicBool::new(false)).collect();
        let mark = |tile: &FilmTile| {
            let coverage = tile.channels.get(ALPHA).map_or(&[][..], |coverage| coverage);
            let places = (tile.rect.y0..tile.rect.y1).flat_map(|y| (tile.rect.x0..tile.rect.x1).map(move |x| (x, y)));
            for ((x, y), _) in places.zip(coverage).filter(|(_, coverage)| **coverage != 0.0) {
                let near = PixelRect { x0: x, y0: y, x1: x + 1, y1: y + 1 }.grown(reach).intersection(&picture);
                let [x0, y0, x1, y1] =
                    [near.x0, near.y0, near.x1 - 1, near.y1 - 1].map(|at| at as usize / BLOCK as usize);
                for row in y0..=y1 {
                    lined[row * columns + x0..=row * columns + x1]
                        .iter()
                        .for_each(|block| block.store(true, Ordering::Relaxed));
                }
            }
            Ok(())
        };
        // All ways to search find the same lines, but for those that are there to be compared with.
        let options = RenderOptions { crop: Some(looked_at), method: Method::Exact, ..self.options.clone() };
        let (shaders, plan, options) = (self.shaders, &plan, &options);
        let pass = Pass { scene: &scene, shaders, plan, options, control, mask: None };
        let complete = self.stage.render(&pass, totals, errors, &mark)?;
        Ok(complete.then(|| lined.into_iter().map(AtomicBool::into_inner).collect()))
    }
}

/// The channel of `line` that is coverage.
const ALPHA: usize = 3;
