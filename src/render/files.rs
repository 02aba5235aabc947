//! Rendering straight into picture files.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use super::{Control, RenderOptions, Report, render};
use crate::clock::CpuClock;
use crate::diag::Diagnostic;
use crate::film::{FilmTile, Layer, Output, OutputSettings};
use crate::plan::Plan;
use crate::sample::PixelRect;
use crate::scene::Scene;
use crate::scene::settings::Background;
use crate::shade::Shaders;

/// A picture file to write.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PictureFile {
    /// Where; `.png` shows the first layer, `.exr` holds all.
    pub path: PathBuf,
    /// Which layers; all must be among the plan's.
    pub layers: Vec<Layer>,
}

/// The layers of several files, each once, in one order: what the plan must know.
#[must_use]
pub fn layers_of(files: &[PictureFile]) -> Vec<Layer> {
    let mut layers: Vec<Layer> = files.iter().flat_map(|file| file.layers.iter().cloned()).collect();
    layers.sort();
    layers.dedup();
    layers
}

/// Renders a scene into files. They get their names once all is done; if the render is cancelled they hold what was
/// finished, and transparent black elsewhere. If nothing at all was finished, nothing is written.
///
/// # Errors
/// If a file cannot be written, or a layer is not in the plan; files that were there before are then untouched.
pub fn render_files(
    scene: &Scene,
    shaders: &Shaders,
    plan: &Plan,
    files: &[PictureFile],
    options: &RenderOptions,
    control: &Control<'_>,
) -> Result<Report, Diagnostic> {
    let start = Instant::now();
    let outputs = files.iter().map(|file| Part::open(scene, plan, file, options)).collect::<Result<Vec<_>, _>>()?;
    let begun = AtomicBool::new(false);
    let mut report = render(scene, shaders, plan, options, control, &|tile| {
        begun.store(true, Ordering::Relaxed);
        outputs.iter().try_for_each(|part| part.output.write(&part.of(tile)))
    })?;
    let finish = CpuClock::thread();
    report.written = report.complete || begun.into_inner();
    if report.written {
        outputs.into_iter().try_for_each(|part| part.output.finish())?;
    }
    report.stats.seconds.film += finish.seconds();
    report.stats.seconds.total = start.elapsed().as_secs_f64();
    Ok(report)
}

/// An open file, and which of the plan's channels go into it.
struct Part {
    output: Output,
    channels: Vec<usize>,
}

impl Part {
    fn open(scene: &Scene, plan: &Plan, file: &PictureFile, options: &RenderOptions) -> Result<Self, Diagnostic> {
        let mut channels = Vec::new();
        for layer in &file.layers {
            let Some(place) = plan.layers.iter().position(|known| known == layer) else {
                return Err(Diagnostic::error(format!("the plan does not make layer `{layer}`")).in_file(&file.path));
            };
            let first: usize = plan.layers[..place].iter().map(|known| known.channels().len()).sum();
            channels.extend(first..first + layer.channels().len());
        }
        let render = scene.render();
        let picture = PixelRect::of_size(render.size);
        let output = Output::create(OutputSettings {
            path: file.path.clone(),
            size: render.size,
            crop: options.crop.map_or(picture, |crop| crop.intersection(&picture)),
            layers: file.layers.clone(),
            png_layer: file.layers.first().cloned().unwrap_or(Layer::Rgba),
            transparent: render.background == Background::Transparent,
            metadata: vec![("samples".into(), render.samples.to_string()), ("seed".into(), render.seed.to_string())],
        })?;
        Ok(Self { output, channels })
    }

    /// The channels of a tile that belong into this file.
    fn of(&self, tile: &FilmTile) -> FilmTile {
        let channels = self.channels.iter().map(|channel| tile.channels[*channel].clone()).collect();
        FilmTile { rect: tile.rect, channels }
    }
}
