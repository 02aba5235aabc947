//! Arguments as typed. What they mean together is worked out by each command.

use std::path::PathBuf;
use std::str::FromStr;
use std::time::Duration;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, Parser, Subcommand, ValueEnum};

use crate::line::Method;
use crate::render::ErrorGoal;
use crate::sample::PixelRect;
use crate::shade::ShadingMode;
use crate::study::{Knob, Quality};

/// Draws feature lines of ray-traced scenes, styled by Rhai scripts.
#[derive(Debug, Parser)]
#[command(
    name = "tusche",
    version,
    max_term_width = 100,
    after_help = "Start here:\n  \
        tusche render scenes/hello.toml -o hello.png    a small scene\n  \
        tusche render model.glb                         any glTF model, framed and lit\n  \
        tusche watch scenes/hello.toml                  the same, again after every save\n  \
        tusche explain scenes/hello.toml                what a render would do, and why\n\n\
        Exit codes: 0 done, 1 the scene, a shader or a file failed, 2 bad usage."
)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Renders a scene file or a model into pictures.
    Render(Box<RenderArguments>),
    /// Prints what a render would do, with reasons, without making a pixel.
    Explain(Box<ExplainArguments>),
    /// Renders again whenever a file of the scene changes, with a page in the browser.
    Watch(Box<super::watch::WatchArguments>),
    /// Tells why there is a line at a place of the picture, or why there is none.
    Why(Box<WhyArguments>),
    /// Measures how much lines change from frame to frame beyond what motion explains.
    Flicker(Box<FlickerArguments>),
    /// Measures what accuracy costs: renders a scene with many settings, and writes errors, times and a page with plots.
    Study(Box<StudyArguments>),
    /// Checks, measures, starts and shows shaders.
    Shader {
        /// What to do.
        #[command(subcommand)]
        command: super::shader::ShaderCommand,
    },
    /// Compares two pictures; exits with 1 if they differ by more than the tolerance.
    Compare(CompareArguments),
    /// Prints the JSON schema of scene files, for editors.
    Schema,
    /// Prints a completion script for a shell.
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
}

#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    tusche render scene.toml -o picture.png -o layers.exr\n  \
    tusche render model.glb --size 1920x1080 --samples 64\n  \
    tusche render scene.toml --set lines.width=4 --set materials.ink.params.color=[1,0,0]\n  \
    tusche render walk.glb --frames 1-48 -o walk.####.png")]
pub struct RenderArguments {
    #[command(flatten)]
    pub scene: SceneArguments,
    /// Renders frames A to B, each into its own files: the names given with -o must hold a run of `#` for the number.
    #[arg(long, value_name = "A-B", conflicts_with = "frame")]
    pub frames: Option<FrameRange>,
    /// Renders these pixels only, x from X0 to below X1 and y from Y0 (top) to below Y1. They come out as in the whole
    /// picture.
    #[arg(long, value_name = "X0,Y0,X1,Y1")]
    pub crop: Option<Crop>,
    /// How many threads render [default: one for each core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Side of a tile in pixels; changes memory and speed, never the picture.
    #[arg(long, value_name = "N", default_value_t = 32, value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub tile: u32,
    /// Renders with as many samples as fit into this time: 10, 10s, 1m30 (loading included). Says which --samples makes the
    /// same picture.
    #[arg(long, value_name = "T", value_parser = seconds, conflicts_with_all = ["samples", "quality", "error"])]
    pub time: Option<Duration>,
    /// Samples each part of the picture until its estimated error of colours and lines (0 to 1, root mean square) is below
    /// this, for example 0.02.
    #[arg(long, value_name = "E", value_parser = error, allow_negative_numbers = true, conflicts_with_all = ["samples", "quality"])]
    pub error: Option<f64>,
    /// Writes what the picture cost as JSON.
    #[arg(long, value_name = "FILE.json")]
    pub stats: Option<PathBuf>,
    /// Exits with 0 even if a script failed at some hits.
    #[arg(long)]
    pub keep_going: bool,
}

#[derive(Debug, Args)]
pub struct ExplainArguments {
    #[command(flatten)]
    pub scene: SceneArguments,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  \
        tusche flicker scene.toml --samples 16\n  \
        tusche flicker scene.toml --frames 1-24 --step 0.05,0\n  \
        tusche flicker walk.glb --frames 1-12 --animate --size 320x180",
    mut_arg("output", |argument| argument.hide(true)),
    mut_arg("layer", |argument| argument.hide(true)),
    mut_arg("lines", |argument| argument.hide(true))
)]
pub struct FlickerArguments {
    #[command(flatten)]
    pub scene: SceneArguments,
    /// Frames A to B of a path along which the film moves by a part of a pixel each time.
    #[arg(long, value_name = "A-B", default_value = "1-9")]
    pub frames: FrameRange,
    /// How far the film moves from each frame to the next, in pixels.
    #[arg(long, value_name = "X,Y", default_value = "0.117,0.071", allow_hyphen_values = true)]
    pub step: Step,
    /// Plays the scene's animation, too: each frame is that of its number.
    #[arg(long, conflicts_with = "frame")]
    pub animate: bool,
    /// Samples of each of the two references, as a multiple of the picture's.
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub reference: u32,
    /// How many threads render [default: one for each core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Prints the numbers as JSON.
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  \
        tusche study scene.toml -o study                    study/index.html shows the outcome\n  \
        tusche study scene.toml -o study --size 320x180 --budget 5m\n  \
        tusche study scene.toml -o study --knob samples --knob method --repeats 5\n\n\
        Knobs: samples, method, sampler, line_oversampling, ideal_samples, min_width, width_compensation, surfaces,\n\
        reflection_depth, refraction_depth, filter. Of a scene with [truth] and without --knob, it is also measured\n\
        how wide lines are drawn that are asked to have a width. A study that was stopped goes on where it was.",
    mut_arg("output", |argument| argument.help("The folder to write to; it is made if it is not there").value_name("DIR")),
    mut_arg("layer", |argument| argument.hide(true)),
    mut_arg("lines", |argument| argument.hide(true))
)]
pub struct StudyArguments {
    #[command(flatten)]
    pub scene: SceneArguments,
    /// Takes no longer than this: 90s, 5m, 1h. What tells most is measured first.
    #[arg(long, value_name = "TIME")]
    pub budget: Option<Budget>,
    /// How often every setting is measured, each time with another seed.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=100))]
    pub repeats: u32,
    /// Samples per pixel of the reference.
    #[arg(long, value_name = "N", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(2..=65536))]
    pub reference: u32,
    /// Tries this knob; may be given more than once [default: all that matter to the scene].
    #[arg(long, value_name = "NAME")]
    pub knob: Vec<Knob>,
    /// How many threads render [default: one for each core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
}

#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  \
        tusche why scene.toml 320,200              the sample nearest to the middle of a pixel\n  \
        tusche why scene.toml 320.25,200.75        the sample nearest to a place in it\n  \
        tusche why scene.toml 10,10 --size 64x48 --json",
    mut_arg("output", |argument| argument.hide(true)),
    mut_arg("layer", |argument| argument.hide(true)),
    mut_arg("lines", |argument| argument.hide(true))
)]
pub struct WhyArguments {
    #[command(flatten)]
    pub scene: SceneArguments,
    /// The place in pixels from the upper left corner of the picture. A whole number means the middle of its pixel.
    #[arg(value_name = "X,Y")]
    pub place: Place,
    /// Prints the explanation as JSON.
    #[arg(long)]
    pub json: bool,
}

/// What decides the picture itself.
#[derive(Clone, Debug, Args)]
pub struct SceneArguments {
    /// A scene file (.toml), or a model (.gltf, .glb) to render as it is.
    #[arg(value_name = "SCENE")]
    pub scene: PathBuf,
    /// Where to write: a .png shows one layer, an .exr holds all; may be given more than once
    /// [default: the scene's name with .png, in the current folder].
    #[arg(short, long, value_name = "FILE")]
    pub output: Vec<PathBuf>,
    /// Size of the picture in pixels.
    #[arg(long, value_name = "WxH")]
    pub size: Option<Size>,
    /// Samples per pixel.
    #[arg(long, value_name = "N")]
    pub samples: Option<u32>,
    /// How accurate, from measured fronts of accuracy against time: draft, preview or final are 4, 16 or 64 samples per pixel,
    /// spread by the `sobol` sampler, with widths corrected for thinning.
    /// `tusche explain --quality Q` says what it costs.
    #[arg(long, value_name = "Q", conflicts_with = "samples", value_parser = quality())]
    pub quality: Option<Quality>,
    /// Chooses the sample positions.
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Renders through the camera of this name.
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
    /// Poses animated models at this frame (24 a second).
    #[arg(long, value_name = "F", allow_negative_numbers = true)]
    pub frame: Option<f64>,
    /// Changes a value of the scene file, for example lines.width=3; may be given more than once.
    #[arg(long, value_name = "PATH=VALUE")]
    pub set: Vec<String>,
    /// Writes this layer: rgba, color, line, line.TYPE, line.PATH, below, Z, N, P, uv, object, feature, aov_NAME. A .png
    /// shows the first; an .exr holds exactly these [default: rgba; all but line.TYPE, line.PATH and below].
    #[arg(long, value_name = "NAME")]
    pub layer: Vec<String>,
    /// How lines are found: `exact` is fast, `brute` tries every pair and gives the same picture; `choudhury` (2009),
    /// `bauer` (2017) and `path` (West 2021) are other methods, to compare with.
    #[arg(long, value_name = "HOW", default_value = "exact")]
    pub lines: LineMode,
    /// How shaders are run: `kernel` refuses scripts that cannot be compiled, `interpreter` gives the same picture slowly.
    #[arg(long, value_name = "HOW", default_value = "auto")]
    pub shading: Shading,
    /// Says nothing but errors.
    #[arg(short, long)]
    pub quiet: bool,
}

#[derive(Debug, Args)]
pub struct CompareArguments {
    /// The expected picture (.png or .exr).
    #[arg(value_name = "A")]
    pub expected: PathBuf,
    /// The actual picture.
    #[arg(value_name = "B")]
    pub actual: PathBuf,
    /// The largest difference of any channel of any pixel that still counts as equal.
    #[arg(long, value_name = "D", default_value = "0", allow_negative_numbers = true, value_parser = tolerance)]
    pub tolerance: f64,
    /// Prints the figures as JSON.
    #[arg(long)]
    pub json: bool,
}

fn tolerance(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(tolerance) if tolerance >= 0.0 => Ok(tolerance),
        _ => Err("it must be a number of at least 0".into()),
    }
}

fn quality() -> impl TypedValueParser<Value = Quality> {
    PossibleValuesParser::new(Quality::ALL.map(Quality::name)).try_map(|name| name.parse::<Quality>())
}

fn error(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(error) if (ErrorGoal::LEAST..1.0).contains(&error) => Ok(error),
        Ok(error) if error > 0.0 && error < 1.0 => {
            Err(format!("{} is the least: less cannot be reached with {} samples", ErrorGoal::LEAST, ErrorGoal::MOST))
        }
        _ => Err("it must be a number above 0 and below 1, for example 0.02".into()),
    }
}

/// A time as people write it: `90`, `90s`, `1m30`, `1h`.
fn seconds(text: &str) -> Result<Duration, String> {
    let fault = || format!("`{text}` is not a time above 0; write it as 10, 10s or 1m30");
    let (mut rest, mut total, mut last) = (text.trim(), 0.0, f64::INFINITY);
    while !rest.is_empty() {
        let end = rest.find(|c: char| !c.is_ascii_digit() && c != '.').unwrap_or(rest.len());
        let number: f64 = rest[..end].parse().map_err(|_| fault())?;
        let unit = match rest[end..].chars().next() {
            Some('h') => 3600.0,
            Some('m') => 60.0,
            Some('s') => 1.0,
            // A bare number is of seconds, or of the next smaller unit after another.
            None if last == 3600.0 => 60.0,
            None => 1.0,
            Some(_) => return Err(fault()),
        };
        if unit >= last {
            return Err(fault());
        }
        total += number * unit;
        last = unit;
        rest = rest.get(end + 1..).unwrap_or_default();
    }
    Duration::try_from_secs_f64(total).ok().filter(|time| !time.is_zero()).ok_or_else(fault)
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum LineMode {
    Off,
    Exact,
    Brute,
    Choudhury,
    Bauer,
    Path,
}

impl LineMode {
    pub fn method(self) -> Method {
        match self {
            Self::Off | Self::Exact => Method::Exact,
            Self::Brute => Method::Brute,
            Self::Choudhury => Method::Choudhury,
            Self::Bauer => Method::Bauer,
            Self::Path => Method::PATH,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Shading {
    Auto,
    Kernel,
    Interpreter,
}

impl Shading {
    pub fn mode(self) -> ShadingMode {
        match self {
            Self::Auto => ShadingMode::Auto,
            Self::Kernel => ShadingMode::Kernel,
            Self::Interpreter => ShadingMode::Interpreter,
        }
    }
}

/// `WxH`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size(pub [u32; 2]);

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (width, height) = text.split_once(['x', 'X']).ok_or("write it as WIDTHxHEIGHT, for example 1280x720")?;
        let number = |text: &str| text.parse::<u32>().map_err(|_| format!("`{text}` is not a number of pixels"));
        let size = [number(width)?, number(height)?];
        if size.contains(&0) {
            return Err("a picture has at least one pixel each way".into());
        }
        Ok(Self(size))
    }
}

/// `X,Y`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place(pub [f32; 2]);

impl FromStr for Place {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (x, y) = text.split_once(',').ok_or("write it as X,Y, for example 320,200 or 320.25,200.75")?;
        let number = |text: &str| {
            let text = text.trim();
            let middle = if text.parse::<i64>().is_ok() { 0.5 } else { 0.0 };
            match text.parse::<f32>() {
                Ok(number) if number.is_finite() => Ok(number + middle),
                _ => Err(format!("`{text}` is not a number of pixels")),
            }
        };
        Ok(Self([number(x)?, number(y)?]))
    }
}

/// `X0,Y0,X1,Y1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crop(pub PixelRect);

impl FromStr for Crop {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Vec<i32> = text
            .split(',')
            .map(|part| part.trim().parse::<i32>().map_err(|_| format!("`{part}` is not a whole number")))
            .collect::<Result<_, _>>()?;
        let [x0, y0, x1, y1] = numbers[..] else {
            return Err("write it as X0,Y0,X1,Y1, for example 0,0,640,360".into());
        };
        if x0 < 0 || y0 < 0 || x1 <= x0 || y1 <= y0 {
            return Err("X0 and Y0 must be 0 or more, X1 above X0, and Y1 above Y0".into());
        }
        Ok(Self(PixelRect { x0, y0, x1, y1 }))
    }
}

/// `X,Y`: two finite numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step(pub [f64; 2]);

impl FromStr for Step {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (x, y) = text.split_once(',').ok_or("write it as X,Y, for example 0.1,0.05")?;
        let number = |text: &str| {
            let number = text.trim().parse::<f64>().ok().filter(|number| number.is_finite());
            number.ok_or_else(|| format!("`{text}` is not a number of pixels"))
        };
        Ok(Self([number(x)?, number(y)?]))
    }
}

/// `90s`, `5m`, `1h`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget(pub Duration);

impl FromStr for Budget {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let units = [("s", 1.0), ("m", 60.0), ("h", 3600.0)];
        let parts = units.iter().find_map(|(unit, seconds)| Some((text.strip_suffix(unit)?, seconds)));
        let (number, unit) = parts.ok_or("write it with a unit, as in 90s, 5m or 1h")?;
        let number = number.trim().parse::<f64>().ok().filter(|number| *number > 0.0);
        let duration = number.and_then(|number| Duration::try_from_secs_f64(number * unit).ok());
        duration.map(Self).ok_or_else(|| format!("`{text}` is not a time above 0"))
    }
}

/// `A-B`, both included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameRange {
    pub first: u32,
    pub last: u32,
}

impl FromStr for FrameRange {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (first, last) = text.split_once('-').ok_or("write it as A-B, for example 1-48")?;
        let number = |text: &str| text.trim().parse::<u32>().map_err(|_| format!("`{text}` is not a frame number"));
        let (first, last) = (number(first)?, number(last)?);
        if last < first {
            return Err(format!("the last frame, {last}, comes before the first, {first}"));
        }
        Ok(Self { first, last })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_read_as_people_write_them() {
        let read = |text| seconds(text).ok().map(|time| time.as_secs_f64());
        let times =
            [("5", 5.0), ("5s", 5.0), ("0.5", 0.5), ("1m30", 90.0), ("1m30s", 90.0), ("2m", 120.0), ("1h", 3600.0)];
        for (text, expected) in times {
            assert_eq!(read(text), Some(expected), "{text}");
        }
        assert_eq!((read("1h30"), read("1h0m5")), (Some(5400.0), Some(3605.0)));
        for text in
            ["", "0", "s", "-5", "5x", "1s2m", "1m1m", "nan", "inf", "1e5", "1..2", "5 5", "é", "99999999999999999999h"]
        {
            assert_eq!(read(text), None, "{text}");
        }
    }
}
