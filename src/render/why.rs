//! Why a line is where it is, or why there is none: the pair of samples that a place in the picture sees, laid open.
//!
//! Only the place's pixel and the samples that can draw a line there are traced; each sample is the one that a render
//! of the whole picture has there, bit for bit.

use std::fmt;

use rayon::prelude::*;
use serde::Serialize;

use super::grid::Grid;
use super::oversample::rate_at;
use super::scripts::ScriptedLines;
use crate::diag::{Diagnostic, Diagnostics};
use crate::film::Layer;
use crate::line::{
    Fired, InspectedPair, LineTile, LineType, Method, TileBounds, Window, find_lines, inspect, nearest_difference,
};
use crate::plan::Plan;
use crate::sample::{NodeColumns, NodePath, PixelRect, SampleBuffer};
use crate::scene::Scene;
use crate::scene::ids::MaterialId;
use crate::shade::{Lighting, ShadeErrors, Shaders};
use crate::trace::{TileTracer, TraceContext, World};

/// Side of the tiles that the stencil is traced in.
const TILE: u32 = 32;

/// Why a place looks as it does to the line pass.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Explanation {
    /// The pixel of the place.
    pub pixel: [i32; 2],
    /// Samples in the pixel.
    pub samples: u32,
    /// How many of them see a line.
    pub lined: u32,
    /// The sample of the pixel that is nearest to the place; all below is about it.
    pub sample: SamplePlace,
    /// The line that it sees.
    pub line: Option<Line>,
    /// The pair that makes the line. Without a line: with the nearest neighbour that differs, if any is in reach.
    pub pair: Option<Pair>,
    /// How far the widest line of the scene reaches, in whole pixels: no neighbour farther away was looked at.
    pub reach: i32,
}

/// A sample.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SamplePlace {
    /// Its pixel.
    pub pixel: [i32; 2],
    /// Its number in the pixel.
    pub number: u32,
    /// Its place in the picture, in pixels.
    pub place: [f32; 2],
}

/// A line as it looks.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Line {
    /// Its type: the strongest test that found a difference.
    pub kind: &'static str,
    /// Its colour, linear, tinted if the scene says so, mixed with lines that are seen through it.
    pub color: [f32; 3],
    /// How much of the sample it covers, together with lines that are seen through it.
    pub alpha: f32,
}

/// Two samples that differ.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Pair {
    /// At which node: empty for what the camera sees, else `R` for each reflection and `T` for each refraction.
    pub path: String,
    /// All tests that are on for the pair, the strongest first.
    pub tests: Vec<Test>,
    /// On the film, in pixels.
    pub distance: f32,
    /// The line is seen within less than this, in pixels; 0 if the one that would style it draws none.
    pub radius: f32,
    /// The effective width in pixels.
    pub effective_width: f32,
    /// How much of the sample this line alone covers: width over minimum width, at most 1, times the opacity.
    pub alpha: f32,
    /// Whose line attributes style the line.
    pub styled_by: StyledBy,
    /// Why.
    pub reason: Reason,
    /// What is seen at the sample.
    pub here: Seen,
    /// What is seen at its neighbour.
    pub there: Seen,
}

/// Which side of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum StyledBy {
    /// The sample itself.
    Own,
    /// Its neighbour.
    Neighbor,
}

/// Why one side styles the line (DESIGN section 3.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Reason {
    /// The other side is the background.
    Background,
    /// Its priority is larger.
    Priority,
    /// Its depth is shorter.
    Depth,
    /// The two are equal in both, and then a sample styles its own line.
    Equal,
}

/// What a test found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Test {
    /// As in `[lines]`.
    pub name: &'static str,
    /// What was measured; none for ids, and where the test does not apply to the pair.
    pub value: Option<f32>,
    /// What it must exceed; none for ids.
    pub threshold: Option<f32>,
    /// Whether it found a difference.
    pub differs: bool,
}

/// A node by its names.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Seen {
    /// The sample.
    pub sample: SamplePlace,
    /// The surface; `None` for the background.
    pub surface: Option<Surface>,
}

/// A surface by its names, with its line attributes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Surface {
    /// The object's name.
    pub object: String,
    /// Its group.
    pub group: Option<String>,
    /// Whether the object draws lines (`lines` in the scene file).
    pub draws_lines: bool,
    /// The material's name.
    pub material: String,
    /// The material's script.
    pub shader: String,
    /// Line priority.
    pub priority: i32,
    /// Path length from the camera.
    pub depth: f32,
    /// Line width in pixels, as the gate let it pass.
    pub width: f32,
    /// Line opacity.
    pub opacity: f32,
    /// Line colour, linear.
    pub color: [f32; 3],
}

/// Explains a place of the picture, in pixels from its upper left corner. Run-time errors of scripts come beside the
/// value.
///
/// # Errors
/// If the place lies outside the picture, or if no line can be seen in the scene.
pub fn why(scene: &Scene, shaders: &Shaders, place: [f32; 2]) -> Result<(Explanation, Diagnostics), Diagnostic> {
    let pixel = pixel_of(scene, place)?;
    // A layer by type asks for the very pair; that of objects keeps apart what belongs to one group.
    let layers = [Layer::Rgba, Layer::LineType(LineType::Outline), Layer::Object];
    let plan = Plan::new(scene, shaders, &layers);
    let scene = &scene.with_samples(rate_at(scene, shaders, &plan, pixel)?);
    let plan = Plan::new(scene, shaders, &layers);
    let Some(lines) = &plan.lines else {
        let fault = Diagnostic::error("no line can be seen in this scene");
        return Err(fault.hint("no test is on, all widths are 0, or lines are off: `tusche explain` tells"));
    };

    // Trace the stencil, and the pixel alone as target.
    let transmissive: Vec<bool> = plan.materials.iter().map(|material| material.refracts).collect();
    let world = World::new(scene, &transmissive);
    let lighting = Lighting::new(scene, world.origin);
    let tracer = TileTracer::new(scene, &plan, &world, &lighting);
    let picture = PixelRect::of_size(scene.render().size);
    let own = PixelRect { x0: pixel[0], y0: pixel[1], x1: pixel[0] + 1, y1: pixel[1] + 1 };
    let grid = Grid::new(own.grown(lines.reach).intersection(&picture), TILE);
    let traced = |rect: PixelRect, context: &mut TraceContext<'_>| {
        let samples = tracer.trace(rect, context).samples;
        let bounds = TileBounds::new(&samples, &lines.rules);
        (samples, bounds)
    };
    let (tiles, errors): (Vec<_>, Vec<ShadeErrors>) = (0..grid.tiles())
        .into_par_iter()
        .map(|tile| {
            let mut context = TraceContext::new(scene, shaders);
            (traced(grid.rect(tile), &mut context), context.errors)
        })
        .unzip();
    let (target, target_bounds) = traced(own, &mut TraceContext::new(scene, shaders));
    let target = LineTile { buffer: &target, bounds: &target_bounds };
    let tiles: Vec<LineTile<'_>> = tiles.iter().map(|(buffer, bounds)| LineTile { buffer, bounds }).collect();
    let window = Window {
        origin: [grid.region.x0, grid.region.y0],
        tile: grid.tile,
        columns: grid.columns,
        tiles: tiles.iter().map(|tile| Some(*tile)).collect(),
    };

    // Find the line, and the pair behind it.
    let mut context = TraceContext::new(scene, shaders);
    let mut scripts = ScriptedLines::new(&mut context, world.origin);
    let found = find_lines(&window, target, &lines.rules, Method::Exact, Some(&mut scripts));
    let sample = nearest_sample(target.buffer, pixel, place);
    let seen = found.samples.binary_search(&sample).ok().map(|index| found.lines[index]);
    let namer = Namer { scene };
    let pair = match seen {
        Some(line) => {
            let (pixel, number) = line.neighbor;
            let tile = tiles.iter().find(|tile| tile.buffer.rect.contains(pixel[0], pixel[1]));
            tile.and_then(|tile| {
                let other = tile.buffer.pixel_number(pixel) as u32 * tile.buffer.samples_per_pixel + number;
                let pair = inspect((target, sample), (*tile, other), line.path, &lines.rules)?;
                namer.pair((target.buffer, sample), (tile.buffer, other), line.path, pair)
            })
        }
        None => nearest_difference((target, sample), &tiles, &lines.rules).and_then(|(path, tile, other, pair)| {
            namer.pair((target.buffer, sample), (tiles[tile].buffer, other), path, pair)
        }),
    };
    let explanation = Explanation {
        pixel,
        samples: target.buffer.samples_per_pixel,
        lined: found.samples.len() as u32,
        sample: sample_place(target.buffer, sample),
        line: seen.map(|line| Line {
            kind: LineType::of(line.fired).map_or("none", LineType::name),
            color: line.color,
            alpha: line.alpha,
        }),
        pair,
        reach: lines.reach,
    };
    let mut all = ShadeErrors::default();
    errors.into_iter().for_each(|errors| all.merge(errors));
    Ok((explanation, all.into_diagnostics()))
}

/// The pixel of a place.
///
/// # Errors
/// If it lies outside the picture.
pub fn pixel_of(scene: &Scene, place: [f32; 2]) -> Result<[i32; 2], Diagnostic> {
    let size = scene.render().size;
    let inside = (0..2).all(|axis| place[axis] >= 0.0 && place[axis] < size[axis] as f32);
    if inside {
        return Ok(place.map(|x| x as i32));
    }
    let [width, height] = size;
    let fault = Diagnostic::error(format!("the place {}, {} lies outside the picture", place[0], place[1]));
    Err(fault
        .hint(format!("it has {width} x {height} pixels: x is 0 to below {width}, y is 0 (top) to below {height}")))
}

/// The sample of a buffer of one pixel that is nearest to a place, the first of equals.
fn nearest_sample(buffer: &SampleBuffer, pixel: [i32; 2], place: [f32; 2]) -> u32 {
    let distance_squared = |offset: &[f32; 2]| {
        let along = |axis: usize| offset[axis] - (place[axis] - pixel[axis] as f32);
        along(0) * along(0) + along(1) * along(1)
    };
    let distances = buffer.offset.iter().map(distance_squared);
    (0..).zip(distances).min_by(|(_, a), (_, b)| a.total_cmp(b)).map_or(0, |(sample, _)| sample)
}

fn sample_place(buffer: &SampleBuffer, sample: u32) -> SamplePlace {
    let pixel = buffer.pixel_of(sample);
    let [x, y] = buffer.offset[sample as usize];
    SamplePlace { pixel, number: sample % buffer.samples_per_pixel, place: [pixel[0] as f32 + x, pixel[1] as f32 + y] }
}

/// Puts names to ids.
struct Namer<'a> {
    scene: &'a Scene,
}

impl Namer<'_> {
    fn pair(
        &self,
        here: (&SampleBuffer, u32),
        there: (&SampleBuffer, u32),
        path: NodePath,
        pair: InspectedPair,
    ) -> Option<Pair> {
        let (here, there) = (self.seen(here, path)?, self.seen(there, path)?);
        let (styling, other) = if pair.own { (&here, &there) } else { (&there, &here) };
        let reason = match (&styling.surface, &other.surface) {
            (_, None) => Reason::Background,
            (Some(styling), Some(other)) if styling.priority != other.priority => Reason::Priority,
            (Some(styling), Some(other)) if styling.depth != other.depth => Reason::Depth,
            _ => Reason::Equal,
        };
        let tests = pair.tests.iter().map(|test| Test {
            name: test_name(test.test),
            value: test.value,
            threshold: test.threshold,
            differs: test.fired,
        });
        Some(Pair {
            path: path.to_string(),
            tests: tests.collect(),
            distance: pair.distance,
            radius: pair.radius,
            effective_width: pair.effective_width,
            alpha: pair.alpha,
            styled_by: if pair.own { StyledBy::Own } else { StyledBy::Neighbor },
            reason,
            here,
            there,
        })
    }

    fn seen(&self, (buffer, sample): (&SampleBuffer, u32), path: NodePath) -> Option<Seen> {
        let nodes = buffer.nodes(path)?;
        let row = nodes.row_of(sample)?;
        Some(Seen { sample: sample_place(buffer, sample), surface: self.surface(nodes, row) })
    }

    fn surface(&self, nodes: &NodeColumns, row: usize) -> Option<Surface> {
        let object = self.scene.objects().get((nodes.object_itself(row) as usize).checked_sub(1)?)?;
        let id = MaterialId::from_index((nodes.shader.get(row) as usize).checked_sub(1)?);
        let material = self.scene.materials().get(id.index())?;
        Some(Surface {
            object: object.name.clone(),
            group: object.group.clone(),
            draws_lines: object.lines,
            material: material.name.clone(),
            shader: self.scene.scripts()[material.script.index()].source.name.clone(),
            priority: nodes.priority.get(row),
            depth: nodes.depth.get(row),
            width: nodes.line_width.get(row),
            opacity: nodes.line_opacity.get(row),
            color: nodes.line_color.get(row),
        })
    }
}

/// As in `[lines]`.
fn test_name(test: Fired) -> &'static str {
    match test {
        Fired::OBJECT => "object",
        Fired::OVERLAP => "overlap",
        Fired::SHADER => "shader",
        Fired::NORMAL => "normal",
        Fired::UV => "uv",
        Fired::FEATURE => "feature",
        _ => "?",
    }
}

impl fmt::Display for Explanation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { pixel: [x, y], samples, lined, sample, line, pair, reach } = self;
        writeln!(f, "pixel {x}, {y}: {lined} of {samples} samples see{} a line", if *lined == 1 { "s" } else { "" })?;
        writeln!(f, "nearest sample: {sample}")?;
        match (line, pair) {
            (Some(line), Some(pair)) => {
                writeln!(f, "it sees a line: {}, {}", line.kind, pair.seen_where())?;
                row(f, "color", format_args!("{} (linear)", numbers(&line.color)))?;
                row(f, "alpha", number(line.alpha))?;
            }
            (None, Some(pair)) => {
                writeln!(f, "it sees no line; the nearest neighbour that differs is {}", pair.seen_where())?;
            }
            (_, None) => {
                return writeln!(
                    f,
                    "it sees no line: nothing differs within {reach} px, as far as the widest line reaches"
                );
            }
        }
        let Some(pair) = pair else { return Ok(()) };
        pair.fmt(f)
    }
}

impl Pair {
    fn seen_where(&self) -> String {
        let events = self.path.chars().map(|event| if event == 'R' { "reflection" } else { "refraction" });
        match &events.collect::<Vec<_>>()[..] {
            [] => "seen directly".into(),
            [one] => format!("seen in a {one}"),
            several => format!("seen at the end of {} ({})", self.path, several.join(", then ")),
        }
    }
}

impl fmt::Display for Pair {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let styling = match self.styled_by {
            StyledBy::Own => &self.here,
            StyledBy::Neighbor => &self.there,
        };
        let whose = match self.styled_by {
            StyledBy::Own => "its own attributes",
            StyledBy::Neighbor => "its neighbour's attributes",
        };
        let reason = match self.reason {
            Reason::Background => "the other side is the background",
            Reason::Priority => "the larger priority",
            Reason::Depth => "the same priority, and the shorter depth",
            Reason::Equal => "the same priority and depth, so each side styles its own",
        };
        row(f, "styled by", format_args!("{whose}: {reason}"))?;
        if self.radius > 0.0 {
            let effective = number(self.effective_width);
            row(f, "width", format_args!("effective {effective} px, seen within {} px", number(self.radius)))?;
        } else {
            let why = match &styling.surface {
                Some(surface) if !surface.draws_lines => "the object has `lines = false`",
                Some(_) => "its width is 0",
                None => "the background draws none",
            };
            row(f, "width", format_args!("no line: {why}"))?;
        }
        let far = if self.distance < self.radius || self.radius == 0.0 { "" } else { ", too far" };
        row(f, "distance", format_args!("{} px{far}", number(self.distance)))?;
        if self.radius > 0.0 && self.alpha < 1.0 {
            row(f, "line alpha", format_args!("{} (the line alone)", number(self.alpha)))?;
        }
        writeln!(f, "tests")?;
        for test in &self.tests {
            let verdict = if test.differs { "differs" } else { "the same" };
            match (test.value, test.threshold) {
                (Some(value), Some(threshold)) => {
                    let sign = if test.differs { ">" } else { "<=" };
                    row(f, test.name, format_args!("{verdict}: {} {sign} {}", number(value), number(threshold)))?;
                }
                (None, Some(_)) => row(f, test.name, "does not apply")?,
                _ => row(f, test.name, verdict)?,
            }
        }
        writeln!(f, "here: {}", self.here.sample)?;
        self.here.fmt(f)?;
        writeln!(f, "there: {}", self.there.sample)?;
        self.there.fmt(f)
    }
}

impl fmt::Display for Seen {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(surface) = &self.surface else { return row(f, "object", "none: the background") };
        match &surface.group {
            Some(group) => row(f, "object", format_args!("{} (group {group})", surface.object))?,
            None => row(f, "object", &surface.object)?,
        }
        row(f, "material", format_args!("{} ({})", surface.material, surface.shader))?;
        row(f, "priority", surface.priority)?;
        row(f, "depth", number(surface.depth))?;
        let Surface { width, opacity, color, .. } = surface;
        let style = format!("{} px, opacity {}, color {}", number(*width), number(*opacity), numbers(color));
        row(f, "line", style)
    }
}

impl fmt::Display for SamplePlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { pixel: [x, y], number, place } = self;
        write!(f, "number {number} of pixel {x}, {y}, at {}", numbers(place))
    }
}

fn row(f: &mut fmt::Formatter<'_>, name: &str, value: impl fmt::Display) -> fmt::Result {
    writeln!(f, "  {name:<12}{value}")
}

fn numbers(values: &[f32]) -> String {
    values.iter().map(|value| number(*value)).collect::<Vec<_>>().join(", ")
}

/// Four decimals, or four digits of what is smaller.
fn number(value: f32) -> String {
    if value != 0.0 && value.abs() < 0.001 {
        return format!("{value:.3e}");
    }
    let text = format!("{value:.4}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    text.to_owned()
}
