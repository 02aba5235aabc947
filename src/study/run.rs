//! The course of a study: the reference, then every point of the ladder, the most telling first.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use rayon::prelude::*;

use super::flip::shown;
use super::folder::Folder;
use super::ladder::{Knob, Ladder, Settings};
use super::measure::{Errors, Reference, Shot, wrong_share};
use super::table::{self, Run};
use super::truth::coverage;
use super::width::{self, Drawn};
use crate::diag::{Diagnostic, Diagnostics, Span};
use crate::film::{FilmTile, Layer, LinePath};
use crate::plan::Plan;
use crate::render::stats::{Stats, reset_peak_memory};
use crate::render::{Control, RenderOptions, render};
use crate::scene::{Scene, SceneBuilder};
use crate::shade::Shaders;

/// How to study.
#[derive(Clone, Debug, PartialEq)]
pub struct StudyOptions {
    /// What the report calls the scene.
    pub title: String,
    /// The knobs to try; those that do not matter to the scene are left out.
    pub knobs: Vec<Knob>,
    /// How often each point is measured, each time with another seed; at least 1.
    pub repeats: u32,
    /// Samples per pixel of the reference, at least 2.
    pub reference: u32,
    /// The most time to take; points that do not fit are left out, the least telling first.
    pub budget: Option<Duration>,
    /// Whether to measure how wide lines are drawn, too, if the scene declares lines.
    pub widths: bool,
    /// Threads; 0 for as many as the machine has.
    pub threads: usize,
}

impl Default for StudyOptions {
    fn default() -> Self {
        Self {
            title: "scene".to_owned(),
            knobs: Knob::ALL.to_vec(),
            repeats: 3,
            reference: 1024,
            budget: None,
            widths: true,
            threads: 0,
        }
    }
}

/// What was measured.
#[derive(Clone, Debug)]
pub struct Study {
    /// What the report calls the scene.
    pub title: String,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// What was tried.
    pub ladder: Ladder,
    /// Samples per pixel of the reference.
    pub reference: u32,
    /// The reference's own errors, estimated from its two halves; what the scene declares has none.
    pub own: Errors,
    /// Whether lines are compared with those that the scene declares.
    pub truth: bool,
    /// How wide lines are drawn, if the scene declares lines.
    pub widths: Vec<Drawn>,
    /// Every picture of this ladder that was measured, by point.
    pub runs: Vec<Vec<Run>>,
    /// Pictures that were to be measured and were not, for want of time.
    pub left_out: usize,
    /// False if it was stopped.
    pub complete: bool,
}

/// Called from any thread with the share that is done, 0 … 1, and with what is being done.
pub type Progress<'a> = &'a (dyn Fn(f64, &str) + Sync);

/// How a caller follows and stops a study.
#[derive(Default)]
pub struct StudyControl<'a> {
    /// Once true, the study soon ends with what is there.
    pub cancel: Option<&'a AtomicBool>,
    /// Follows it.
    pub progress: Option<Progress<'a>>,
}

impl StudyControl<'_> {
    fn is_cancelled(&self) -> bool {
        self.cancel.is_some_and(|cancel| cancel.load(Ordering::Relaxed))
    }

    fn say(&self, share: f64, what: &str) {
        self.progress.iter().for_each(|progress| progress(share, what));
    }
}

/// Studies a scene into a folder: `study.csv`, the reference and the pictures. What the folder already holds of the same
/// scene is not measured again.
///
/// # Errors
/// If the scene draws no lines, a script fails, the budget does not reach for the reference and one picture, the folder cannot
/// be written to, or the study is stopped before the reference is there.
pub fn study(
    scene: Scene,
    shaders: &Shaders,
    folder: &Path,
    options: &StudyOptions,
    control: &StudyControl<'_>,
) -> Result<Study, Diagnostics> {
    let start = Instant::now();
    let ladder = Ladder::new(&scene, shaders, &options.knobs);
    let plan = Plan::new(&scene, shaders, &[Layer::Rgba]);
    let Some(lines) = &plan.lines else {
        let fault = Diagnostic::error("this scene draws no lines, so there is no accuracy of lines to study");
        return Err(fault.hint("`tusche explain` says why").into());
    };
    let folder = Folder::open(folder)?;
    let known: Vec<Run> = table::read(&folder.table())?;
    let camera = Camera {
        truth: scene.truth().map(|truth| Declared {
            coverage: coverage(truth, scene.camera(), scene.render().size, &plan.filter),
            span: truth.span.clone(),
        }),
        key: key(&scene),
        seed: scene.render().seed,
        size: scene.render().size,
        secondary: plan.has_secondary_rays(),
        builder: scene.into_builder(),
        shaders,
        threads: options.threads,
        cancel: control.cancel,
    };
    let deadline = options.budget.map(|budget| start + budget);

    // Drawn widths come last.
    let measures_widths = options.widths && camera.truth.is_some();
    let end = if measures_widths { 0.9 } else { 1.0 };
    let mut work = Work { control, start, budget: options.budget, end, done: 0.0, all: 0.0 };
    let waiting = |runs: &[Run]| {
        let all =
            (0..options.repeats.max(1)).flat_map(|repeat| ladder.order().into_iter().map(move |point| (point, repeat)));
        let is_missing = |(point, repeat): &(usize, u32)| {
            !runs.iter().any(|run| run.repeat == *repeat && run.is_of(&ladder.points[*point]))
        };
        all.filter(is_missing).collect::<Vec<_>>()
    };
    let samples_of =
        |waiting: &[(usize, u32)]| waiting.iter().map(|(point, _)| ladder.points[*point].most_samples()).sum::<u32>();

    // The scene's own picture tells what all others will take.
    let mut first = None;
    let mut runs: Vec<Run> = known.into_iter().filter(|run| run.scene == camera.key).collect();
    let kept = folder.reference(&camera.key);
    let kept = kept.filter(|kept| options.budget.is_some() || kept.1 == options.reference.max(2));
    work.all = f64::from(samples_of(&waiting(&runs))) + kept.as_ref().map_or(f64::from(options.reference), |_| 0.0);
    let per_sample = match runs.iter().find(|run| run.is_of(&ladder.points[0])) {
        Some(run) => run.wall_seconds,
        None => {
            let advance = work.of("the scene", ladder.points[0].most_samples());
            let Some((shot, stats)) = camera.shoot(&ladder.points[0], 0, &advance)? else { return Err(stopped()) };
            first.insert((shot, stats)).1.seconds.total
        }
    } / f64::from(ladder.points[0].samples);
    let (reference, samples, own) = match kept {
        Some((shot, samples, own)) => (Reference::new(shot, lines.widest), samples, own),
        None => {
            let samples = reference_samples(options, ladder.points[0].samples, per_sample)?;
            work.all += f64::from(samples) - f64::from(options.reference);
            let advance = work.of("the reference", samples);
            let Some((shot, own)) = camera.reference(&ladder.ideal, samples, lines.widest, &advance)? else {
                return Err(stopped());
            };
            work.done += f64::from(samples);
            folder.keep_reference(&camera.key, samples, &shot, &own)?;
            (Reference::new(shot, lines.widest), samples, own)
        }
    };
    folder.keep_picture("reference", reference.shot())?;

    let identity = (camera.key.as_str(), samples);
    runs.retain(|run| run.reference == samples);
    let waiting = waiting(&runs);
    work.all = work.done + f64::from(samples_of(&waiting));
    let (mut left_out, mut complete) = (0, true);
    for (point, repeat) in waiting {
        let settings = &ladder.points[point];
        let expected = expected_seconds(&runs, settings.most_samples());
        let taken = if (point, repeat) == (0, 0) { first.take() } else { None };
        if taken.is_none()
            && deadline.is_some_and(|deadline| deadline.saturating_duration_since(Instant::now()) < seconds(expected))
        {
            left_out += 1;
            continue;
        }
        let name = ladder.name(point);
        let advance = work.of(&name, settings.most_samples());
        let shot = if taken.is_some() { taken } else { camera.shoot(settings, repeat, &advance)? };
        let Some((shot, stats)) = shot else {
            complete = false;
            break;
        };
        runs.push(Run::new(identity, settings, repeat, &stats, &reference.errors(&shot)));
        if repeat == 0 {
            folder.keep_picture(&name, &shot)?;
        }
        table::write(&folder.table(), &runs)?;
        work.done += f64::from(settings.most_samples());
    }
    let widths = if measures_widths && complete {
        let (widths, missing) = drawn_widths(&folder, options.threads, deadline, control)?;
        left_out += missing;
        complete = !control.is_cancelled();
        widths
    } else {
        Vec::new()
    };
    let of_point = |settings: &Settings| runs.iter().filter(|run| run.is_of(settings)).cloned().collect();
    let runs = ladder.points.iter().map(of_point).collect();
    Ok(Study {
        title: options.title.clone(),
        size: camera.size,
        ladder,
        reference: samples,
        own,
        truth: camera.truth.is_some(),
        widths,
        runs,
        left_out,
        complete,
    })
}

/// How far a study is, in samples per pixel.
struct Work<'a> {
    control: &'a StudyControl<'a>,
    start: Instant,
    budget: Option<Duration>,
    done: f64,
    all: f64,
    /// The share of the whole study at which all pictures are taken.
    end: f64,
}

impl<'a> Work<'a> {
    /// Follows a picture, or a pair of them, as its share of the whole.
    fn of<'b>(&self, what: &'b str, samples: u32) -> impl Fn(f64) + Sync + use<'a, 'b> {
        let (control, scale) = (self.control, self.end / self.all.max(1.0));
        let (done, samples) = (self.done * scale, f64::from(samples) * scale);
        let (start, budget) = (self.start, self.budget);
        // Whichever ends it first: all is done, or the budget is used up.
        let say = move |share: f64| {
            let used = budget.map_or(0.0, |budget| start.elapsed().as_secs_f64() / budget.as_secs_f64().max(1e-9));
            control.say((done + share * samples).max(used.min(1.0)), what);
        };
        say(0.0);
        say
    }
}

/// How wide lines are drawn, and how many widths there was no time for.
fn drawn_widths(
    folder: &Folder,
    threads: usize,
    deadline: Option<Instant>,
    control: &StudyControl<'_>,
) -> Result<(Vec<Drawn>, usize), Diagnostics> {
    let all = width::all();
    let mut widths: Vec<Drawn> = table::read(&folder.widths())?;
    widths.retain(|known| all.iter().any(|asked| known.is_of(asked)));
    let missing: Vec<_> = all.iter().filter(|asked| !widths.iter().any(|known| known.is_of(asked))).collect();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.map_err(|error| Diagnostic::error(format!("cannot start threads: {error}")))?;
    for (number, part) in missing.chunks(WIDTHS_AT_ONCE).enumerate() {
        if control.is_cancelled() || deadline.is_some_and(|deadline| deadline < Instant::now()) {
            let done = number * WIDTHS_AT_ONCE;
            return Ok((widths, missing.len() - done));
        }
        control.say(0.9 + 0.1 * (number * WIDTHS_AT_ONCE) as f64 / missing.len() as f64, "drawn widths");
        widths.extend(pool.install(|| part.par_iter().map(|asked| Drawn::measure(asked)).collect::<Vec<_>>()));
        table::write(&folder.widths(), &widths)?;
    }
    Ok((widths, 0))
}

/// How many drawn widths are measured between two looks at the clock.
const WIDTHS_AT_ONCE: usize = 10;

fn stopped() -> Diagnostics {
    let fault = Diagnostic::error("stopped before anything could be measured");
    fault.hint("run the same command again").into()
}

fn seconds(seconds: f64) -> Duration {
    Duration::try_from_secs_f64(seconds).unwrap_or(Duration::MAX)
}

/// How long a picture will surely not take longer than: one of fewer samples takes no longer, and one of more takes at most
/// as much longer as it has more samples, since some of the time is the same for all.
fn expected_seconds(runs: &[Run], samples: u32) -> f64 {
    let longest = |run: &Run| run.wall_seconds * (f64::from(samples) / f64::from(run.samples)).max(1.0);
    runs.iter().map(longest).fold(f64::INFINITY, f64::min)
}

/// How many samples the reference gets: what is asked for, or what fits into 40 % of the budget, but at least four times those
/// of the scene.
///
/// # Errors
/// If the budget does not reach for that.
pub fn reference_samples(options: &StudyOptions, own: u32, per_sample: f64) -> Result<u32, Diagnostic> {
    let asked = options.reference.max(2);
    let Some(budget) = options.budget else { return Ok(asked) };
    let least = own.saturating_mul(4).min(asked);
    let affordable = 0.4 * budget.as_secs_f64() / per_sample.max(1e-12);
    if affordable >= f64::from(least) {
        return Ok(asked.min(affordable as u32));
    }
    let needed = (f64::from(least) * per_sample / 0.4).max(0.1);
    let fault = Diagnostic::error(format!(
        "a budget of {} s is too small: the reference needs {:.1} s even with only {least} samples",
        budget.as_secs_f64(),
        f64::from(least) * per_sample
    ));
    Err(fault.hint(format!("give --budget {:.0}s or more, or make the picture smaller with --size", needed.ceil())))
}

/// A number that tells scenes apart: a hash of all that they are made of, and of Tusche's version.
#[must_use]
pub fn key(scene: &Scene) -> String {
    struct Fnv(u64);
    impl std::fmt::Write for Fnv {
        fn write_str(&mut self, text: &str) -> std::fmt::Result {
            for byte in text.bytes() {
                self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
            }
            Ok(())
        }
    }
    let mut hash = Fnv(0xcbf2_9ce4_8422_2325);
    // Nothing here can fail.
    let _ = write!(hash, "{} {scene:?}", env!("CARGO_PKG_VERSION"));
    // Never a number to those who read tables.
    format!("h{:016x}", hash.0)
}

/// The lines that a scene declares.
struct Declared {
    coverage: Vec<f32>,
    span: Option<Span>,
}

/// Less than this share of the lines' area need not mean that a scene declares other lines than it shows.
const LEAST_DOUBT: f64 = 0.1;

/// Called with the share of a picture that is done.
type Advance<'a> = dyn Fn(f64) + Sync + 'a;

/// Takes pictures of one scene with changing settings.
struct Camera<'a> {
    truth: Option<Declared>,
    key: String,
    seed: u64,
    size: [u32; 2],
    secondary: bool,
    builder: SceneBuilder,
    shaders: &'a Shaders,
    threads: usize,
    cancel: Option<&'a AtomicBool>,
}

impl Camera<'_> {
    /// A picture with the seed of a repeat: the scene's own for the first. `None` if it was stopped.
    fn shoot(
        &self,
        settings: &Settings,
        repeat: u32,
        advance: &Advance<'_>,
    ) -> Result<Option<(Shot, Stats)>, Diagnostics> {
        let seed = if repeat == 0 { self.seed } else { self.unused_seed(u64::from(repeat) + 16) };
        let planes = self.take(settings, seed, &[Layer::Rgba, Layer::Line], advance)?;
        Ok(planes.map(|(planes, stats)| (shot(self.size[0] as usize, &planes, None), stats)))
    }

    /// The mean of two halves, and its own errors: half of what they differ by. Lines that the scene declares take the place of those
    /// that were found.
    ///
    /// # Errors
    /// If the scene shows other lines than it declares.
    fn reference(
        &self,
        ideal: &Settings,
        samples: u32,
        widest: f32,
        advance: &Advance<'_>,
    ) -> Result<Option<(Shot, Errors)>, Diagnostics> {
        let settings = Settings { samples: samples.div_ceil(2), ..*ideal };
        let mut layers = vec![Layer::Rgba, Layer::Line];
        if self.secondary {
            layers.extend([LinePath::Reflection, LinePath::Refraction].map(Layer::LinePath));
        }
        let half = |purpose: u64| {
            let advance = |share: f64| advance((share + purpose as f64 - 1.0) / 2.0);
            let planes = self.take(&settings, self.unused_seed(purpose), &layers, &advance)?;
            let declared = self.truth.as_ref().map(|truth| &truth.coverage[..]);
            Ok::<_, Diagnostics>(planes.map(|(planes, _)| shot(self.size[0] as usize, &planes, declared)))
        };
        let (Some(a), Some(b)) = (half(1)?, half(2)?) else { return Ok(None) };
        let own = Reference::new(a.clone(), widest).errors(&b).scaled(0.5);
        let mut shot = Shot::mean(&a, &b);
        let Some(truth) = &self.truth else { return Ok(Some((shot, own))) };
        let error = wrong_share(&truth.coverage, &shot.coverage);
        if error > f64::max(LEAST_DOUBT, 3.0 * own.coverage.unwrap_or_default()) {
            let message = format!(
                "the picture shows other lines than `[truth]` declares: they differ by {:.0} % of the lines' area",
                100.0 * error.min(10.0)
            );
            let fault = Diagnostic::error(message);
            let fault = truth.span.iter().fold(fault, |fault, span| fault.at(span.clone()));
            let hint = "declare all lines and no others, with their widths; pixels are those of the picture as it is rendered, `--size` included";
            return Err(fault.hint(hint).into());
        }
        shot.coverage.clone_from(&truth.coverage);
        Ok(Some((shot, Errors { coverage: None, crossings: None, position: None, ..own })))
    }

    /// Seeds that nobody chooses, so that no pattern is used for two purposes.
    fn unused_seed(&self, purpose: u64) -> u64 {
        self.seed ^ (purpose << 40)
    }

    /// The channels of layers.
    fn take(
        &self,
        settings: &Settings,
        seed: u64,
        layers: &[Layer],
        advance: &Advance<'_>,
    ) -> Result<Option<(Planes, Stats)>, Diagnostics> {
        let mut builder = self.builder.clone();
        settings.apply(&mut builder);
        builder.render.seed = seed;
        let scene = builder.build()?;
        let plan = Plan::new(&scene, self.shaders, layers);
        let [width, height] = self.size.map(|side| side as usize);
        let channels: usize = layers.iter().map(|layer| layer.channels().len()).sum();
        let planes = Mutex::new(vec![vec![0.0_f32; width * height]; channels]);
        let emit = |tile: &FilmTile| {
            let mut planes = planes.lock().unwrap_or_else(PoisonError::into_inner);
            let row = tile.rect.width().max(1) as usize;
            for (plane, values) in planes.iter_mut().zip(&tile.channels) {
                for (y, values) in (tile.rect.y0 as usize..).zip(values.chunks(row)) {
                    let start = y * width + tile.rect.x0 as usize;
                    plane[start..start + values.len()].copy_from_slice(values);
                }
            }
            Ok(())
        };
        let options = RenderOptions { threads: self.threads, method: settings.method, ..RenderOptions::default() };
        let control = Control { cancel: self.cancel, progress: Some(advance) };
        // The process is the same for all pictures; what it always holds (the scene, the reference) is in every peak.
        let reset = reset_peak_memory();
        let mut report = render(&scene, self.shaders, &plan, &options, &control, &emit)?;
        report.stats.peak_rss_bytes = report.stats.peak_rss_bytes.filter(|_| reset);
        if report.script_errors.has_errors() {
            return Err(report.script_errors);
        }
        if !report.complete || self.cancel.is_some_and(|cancel| cancel.load(Ordering::Relaxed)) {
            return Ok(None);
        }
        let planes = planes.into_inner().unwrap_or_else(PoisonError::into_inner);
        Ok(Some((planes, report.stats)))
    }
}

/// Channels, each row by row.
type Planes = Vec<Vec<f32>>;

/// From planes of `rgba`, `line`, and perhaps the lines of two kinds of paths. Where it is declared how much lines cover, colours are
/// as if they did; the coverage is that of the planes.
fn shot(width: usize, planes: &[Vec<f32>], declared: Option<&[f32]>) -> Shot {
    let color = |i: usize| {
        let white = 1.0 - planes[3][i];
        let found = [0, 1, 2].map(|axis| planes[axis][i] + white);
        let alpha = planes[7][i];
        // What is next to nothing has no colour.
        let declared = declared.filter(|_| (0.001..=0.999).contains(&alpha)).map(|declared| declared[i]);
        [0, 1, 2].map(|axis| {
            let value = declared.map_or(found[axis], |declared| {
                let [line, below] = [planes[4 + axis][i] / alpha, (found[axis] - planes[4 + axis][i]) / (1.0 - alpha)];
                line * declared + below * (1.0 - declared)
            });
            shown(value)
        })
    };
    let secondary = |reflection: &Vec<f32>, refraction: &Vec<f32>| {
        reflection.iter().zip(refraction).map(|(a, b)| (a + b).min(1.0)).collect()
    };
    Shot {
        width,
        colors: (0..planes[0].len()).map(color).collect(),
        coverage: planes.get(7).cloned().unwrap_or_default(),
        secondary: planes.get(11).zip(planes.get(15)).map(|(a, b)| secondary(a, b)).unwrap_or_default(),
    }
}
