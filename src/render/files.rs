//! Rendering straight into picture files.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use super::{Control, Emit, ErrorGoal, RenderOptions, Report, render, render_to_error};
use crate::clock::CpuClock;
use crate::diag::Diagnostic;
use crate::film::{FilmTile, Layer, Output, OutputSettings};
use crate::plan::Plan;
use crate::sample::PixelRect;
use crate::scene::Scene;
use crate::scene::settings::{Background, RenderSettings};
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
    let settings = scene.render();
    let mut facts = vec![("samples", settings.samples.to_string())];
    if plan.oversampling.is_some() {
        facts.push(("line_oversampling", settings.line_oversampling.to_string()));
    }
    into_files(settings, &plan.layers, files, options.crop, &facts, |emit| {
        render(scene, shaders, plan, options, control, emit)
    })
}

/// The same to an error instead of with the scene's samples: see [`render_to_error`]. The plan must be made for the layers
/// of [`measured_layers`](super::refine::measured_layers).
///
/// # Errors
/// As [`render_files`].
pub fn render_files_to_error(
    scene: &Scene,
    shaders: &Shaders,
    plan: &Plan,
    files: &[PictureFile],
    goal: &ErrorGoal,
    options: &RenderOptions,
    control: &Control<'_>,
) -> Result<Report, Diagnostic> {
    let facts = [("error", goal.error.to_string())];
    into_files(scene.render(), &plan.layers, files, options.crop, &facts, |emit| {
        render_to_error(scene, shaders, plan, goal, options, control, emit)
    })
}

/// Lets some work write its tiles of these layers into files; `facts` go into their headers.
fn into_files(
    settings: &RenderSettings,
    layers: &[Layer],
    files: &[PictureFile],
    crop: Option<PixelRect>,
    facts: &[(&str, String)],
    work: impl FnOnce(Emit<'_>) -> Result<Report, Diagnostic>,
) -> Result<Report, Diagnostic> {
    let start = Instant::now();
    let picture = PixelRect::of_size(settings.size);
    let crop = crop.map_or(picture, |crop| crop.intersection(&picture));
    let open = |file| Part::open(settings, layers, file, crop, facts);
    let outputs = files.iter().map(open).collect::<Result<Vec<_>, _>>()?;
    let begun = AtomicBool::new(false);
    let mut report = work(&|tile| {
        begun.store(true, Ordering::Relaxed);
        outputs.iter().try_for_each(|part| part.output.write(&part.of(tile.rect, &tile.channels)))
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

/// Writes a finished picture into a file; it appears whole or not at all. `layers` are those of the picture, and
/// `channels` the channels of all of them for the whole of it, row by row.
///
/// # Errors
/// If the file cannot be written, or one of its layers is not among the picture's; a file that was there before is then
/// untouched.
pub fn write_picture(
    file: &PictureFile,
    settings: &RenderSettings,
    layers: &[Layer],
    channels: &[Vec<f32>],
) -> Result<(), Diagnostic> {
    let whole = PixelRect::of_size(settings.size);
    let part = Part::open(settings, layers, file, whole, &[("samples", settings.samples.to_string())])?;
    part.output.write(&part.of(whole, channels))?;
    part.output.finish()
}

/// CPU seconds that files take for every pixel: while tiles come, and at the end, where one thread does all.
///
/// That depends on what is in the picture. So equal square tiles of it, of these layers, are put together to a small picture, which is
/// packed as the files will be and forgotten. 0 if there are none.
///
/// # Errors
/// If a file cannot be made like this.
pub(super) fn file_seconds(
    settings: &RenderSettings,
    layers: &[Layer],
    files: &[PictureFile],
    tiles: &[FilmTile],
) -> Result<[f64; 2], Diagnostic> {
    let mosaic = mosaic(tiles);
    if mosaic.rect.pixels() == 0 {
        return Ok([0.0; 2]);
    }
    let size = [mosaic.rect.width(), mosaic.rect.height()];
    let small = RenderSettings { size, ..settings.clone() };
    let mut sum = [0.0; 2];
    for file in files {
        let channels = channels_of(file, layers)?;
        let tile = part_of(&channels, mosaic.rect, &mosaic.channels);
        let seconds = Output::rehearse(output_settings(&small, file, mosaic.rect, &[]), &tile)?;
        sum.iter_mut().zip(seconds).for_each(|(sum, seconds)| *sum += seconds / mosaic.rect.pixels() as f64);
    }
    Ok(sum)
}

/// A square of tiles, of those that are as large as the largest; without pixels if there are no tiles.
fn mosaic(tiles: &[FilmTile]) -> FilmTile {
    let most = tiles.iter().map(|tile| tile.rect.pixels()).max().unwrap_or(0);
    let whole: Vec<&FilmTile> = tiles.iter().filter(|tile| tile.rect.pixels() == most).collect();
    let (columns, side) = (whole.len().isqrt(), most.isqrt());
    let row = |channel: usize, y: usize| {
        let tiles = whole[y / side * columns..][..columns].iter();
        tiles.flat_map(move |tile| tile.channels[channel][y % side * side..][..side].iter().copied())
    };
    let pixels = columns * side;
    let channels = whole.first().map_or(0, |tile| tile.channels.len());
    let channel = |channel: usize| (0..pixels).flat_map(|y| row(channel, y)).collect();
    FilmTile { rect: PixelRect::of_size([pixels as u32; 2]), channels: (0..channels).map(channel).collect() }
}

/// Which channels of a picture with these layers go into a file.
fn channels_of(file: &PictureFile, layers: &[Layer]) -> Result<Vec<usize>, Diagnostic> {
    let mut channels = Vec::new();
    for layer in &file.layers {
        let Some(place) = layers.iter().position(|known| known == layer) else {
            return Err(Diagnostic::error(format!("the plan does not make layer `{layer}`")).in_file(&file.path));
        };
        let first: usize = layers[..place].iter().map(|known| known.channels().len()).sum();
        channels.extend(first..first + layer.channels().len());
    }
    Ok(channels)
}

fn part_of(own: &[usize], rect: PixelRect, channels: &[Vec<f32>]) -> FilmTile {
    FilmTile { rect, channels: own.iter().map(|channel| channels[*channel].clone()).collect() }
}

fn output_settings(
    settings: &RenderSettings,
    file: &PictureFile,
    crop: PixelRect,
    facts: &[(&str, String)],
) -> OutputSettings {
    let seed = ("seed", settings.seed.to_string());
    let facts = facts.iter().chain([&seed]).map(|(name, value)| ((*name).to_owned(), value.clone()));
    OutputSettings {
        path: file.path.clone(),
        size: settings.size,
        crop,
        layers: file.layers.clone(),
        png_layer: file.layers.first().cloned().unwrap_or(Layer::Rgba),
        transparent: settings.background == Background::Transparent,
        metadata: facts.collect(),
    }
}

/// An open file, and which of the picture's channels go into it.
struct Part {
    output: Output,
    channels: Vec<usize>,
}

impl Part {
    fn open(
        settings: &RenderSettings,
        layers: &[Layer],
        file: &PictureFile,
        crop: PixelRect,
        facts: &[(&str, String)],
    ) -> Result<Self, Diagnostic> {
        let channels = channels_of(file, layers)?;
        let output = Output::create(output_settings(settings, file, crop, facts))?;
        Ok(Self { output, channels })
    }

    /// The channels of a rectangle that belong into this file.
    fn of(&self, rect: PixelRect, channels: &[Vec<f32>]) -> FilmTile {
        part_of(&self.channels, rect, channels)
    }
}
