//! Which settings are worth trying for a scene: a ladder for each knob that matters to it.

use std::fmt;

use super::quality::Quality;
use crate::film::Layer;
use crate::line::Method;
use crate::plan::{Plan, bounds, drawing_materials, filter_name};
use crate::scene::ids::MaterialId;
use crate::scene::settings::{FilterKind, LineSettings, Sampler};
use crate::scene::{Scene, SceneBuilder};
use crate::shade::{OutputSet, Shaders};

/// What a picture's accuracy and time can be traded by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Knob {
    /// Samples per pixel, all else as in the scene.
    Samples,
    /// Samples per pixel, all else as in the reference: nothing is left but the error of sampling.
    IdealSamples,
    /// How lines are found, at several rates.
    Method,
    /// How samples are spread over a pixel, at several rates.
    Sampler,
    /// How many times as many samples there are at lines, at several rates.
    LineOversampling,
    /// The minimum width of lines.
    MinWidth,
    /// Whether widths are corrected for thinning.
    WidthCompensation,
    /// Surfaces kept along a ray.
    Surfaces,
    /// Most mirror reflections along a path.
    ReflectionDepth,
    /// Most refractions along a path.
    RefractionDepth,
    /// The pixel filter.
    Filter,
}

impl Knob {
    /// All of them, the most telling first.
    pub const ALL: [Self; 11] = [
        Self::Samples,
        Self::Method,
        Self::Sampler,
        Self::LineOversampling,
        Self::IdealSamples,
        Self::MinWidth,
        Self::WidthCompensation,
        Self::Surfaces,
        Self::ReflectionDepth,
        Self::RefractionDepth,
        Self::Filter,
    ];

    /// As tables and the command line call it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Samples => "samples",
            Self::IdealSamples => "ideal_samples",
            Self::Method => "method",
            Self::Sampler => "sampler",
            Self::LineOversampling => "line_oversampling",
            Self::MinWidth => "min_width",
            Self::WidthCompensation => "width_compensation",
            Self::Surfaces => "surfaces",
            Self::ReflectionDepth => "reflection_depth",
            Self::RefractionDepth => "refraction_depth",
            Self::Filter => "filter",
        }
    }
}

impl std::str::FromStr for Knob {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Self::ALL.into_iter().find(|knob| knob.name() == name).ok_or_else(|| {
            let names = Self::ALL.map(Self::name);
            match crate::diag::nearest(name, names.iter().copied()) {
                Some(near) => format!("there is no knob `{name}`; did you mean `{near}`?"),
                None => format!("there is no knob `{name}`; knobs are {}", names.join(", ")),
            }
        })
    }
}

/// The settings of a picture that a study changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Samples per pixel.
    pub samples: u32,
    /// How many times as many there are at lines.
    pub line_oversampling: u32,
    /// How they are spread over a pixel.
    pub sampler: Sampler,
    /// How lines are found.
    pub method: Method,
    /// Minimum width in pixels.
    pub min_width: f32,
    /// Whether widths are corrected for thinning.
    pub width_compensation: bool,
    /// Surfaces kept along a ray.
    pub surfaces: u32,
    /// Most mirror reflections along a path.
    pub reflection_depth: u32,
    /// Most refractions along a path.
    pub refraction_depth: u32,
    /// Pixel filter.
    pub filter: FilterKind,
    /// Its radius in pixels.
    pub filter_radius: f32,
}

impl Settings {
    /// Those of a scene.
    #[must_use]
    pub fn of(scene: &Scene) -> Self {
        let (render, lines) = (scene.render(), scene.lines());
        Self {
            samples: render.samples,
            line_oversampling: render.line_oversampling,
            sampler: render.sampler,
            method: Method::Exact,
            min_width: lines.min_width,
            width_compensation: lines.width_compensation,
            surfaces: lines.surfaces,
            reflection_depth: render.reflection_depth,
            refraction_depth: render.refraction_depth,
            filter: render.filter,
            filter_radius: render.filter_radius,
        }
    }

    /// Puts them into a scene; the method is for the renderer.
    pub fn apply(&self, scene: &mut SceneBuilder) {
        let (render, lines) = (&mut scene.render, &mut scene.lines);
        render.samples = self.samples;
        render.line_oversampling = self.line_oversampling;
        render.sampler = self.sampler;
        render.reflection_depth = self.reflection_depth;
        render.refraction_depth = self.refraction_depth;
        render.filter = self.filter;
        render.filter_radius = self.filter_radius;
        lines.min_width = self.min_width;
        lines.width_compensation = self.width_compensation;
        lines.surfaces = self.surfaces;
    }

    /// The most samples that any pixel has.
    #[must_use]
    pub fn most_samples(&self) -> u32 {
        self.samples.saturating_mul(self.line_oversampling)
    }

    /// The value of a knob.
    #[must_use]
    pub fn value(&self, knob: Knob) -> String {
        match knob {
            Knob::Samples | Knob::IdealSamples => self.samples.to_string(),
            Knob::Method => format!("{} {}", method_name(self.method), self.samples),
            Knob::Sampler => format!("{} {}", self.sampler.name(), self.samples),
            Knob::LineOversampling => format!("{} x {}", self.samples, self.line_oversampling),
            Knob::MinWidth => self.min_width.to_string(),
            Knob::WidthCompensation => if self.width_compensation { "on" } else { "off" }.to_owned(),
            Knob::Surfaces => self.surfaces.to_string(),
            Knob::ReflectionDepth => self.reflection_depth.to_string(),
            Knob::RefractionDepth => self.refraction_depth.to_string(),
            Knob::Filter => format!("{} {}", filter_name(self.filter), self.filter_radius),
        }
    }
}

/// The methods that a study compares.
pub const METHODS: [Method; 4] = [Method::Exact, Method::Choudhury, Method::Bauer, Method::PATH];

/// As on the command line.
#[must_use]
pub fn method_name(method: Method) -> &'static str {
    match method {
        Method::Exact => "exact",
        Method::Brute => "brute",
        Method::Choudhury => "choudhury",
        Method::Bauer => "bauer",
        Method::Path { .. } => "path",
    }
}

/// A knob and what is tried for it.
#[derive(Clone, Debug, PartialEq)]
pub struct Rungs {
    /// The knob.
    pub knob: Knob,
    /// Places in [`Ladder::points`], in the order of values.
    pub points: Vec<usize>,
}

/// All that is worth trying for a scene. Its `Display` is a text for people and golden files.
#[derive(Clone, Debug, PartialEq)]
pub struct Ladder {
    /// All settings to try, each once; the first are those of the scene.
    pub points: Vec<Settings>,
    /// The knobs that matter, the most telling first.
    pub knobs: Vec<Rungs>,
    /// The knobs that do not, and why.
    pub left_out: Vec<(Knob, &'static str)>,
    /// The places of the presets in [`Ladder::points`]; empty unless the ladder of samples is tried.
    pub presets: Vec<(Quality, usize)>,
    /// The settings of the reference, but for its samples.
    pub ideal: Settings,
}

/// Counts that are plainly jittered.
const SAMPLES: [u32; 8] = [1, 2, 4, 9, 16, 36, 64, 144];
/// Counts that suit every sampler.
const SAMPLER_SAMPLES: [u32; 3] = [4, 16, 64];
/// Counts of line methods. The others take so much longer that the exact search has four times as many in the same time.
const METHOD_SAMPLES: [u32; 3] = [1, 4, 16];
/// How many times as many samples there are at lines.
const LINE_OVERSAMPLING: [u32; 3] = [1, 4, 16];
/// The most samples that this may come to.
const MOST_OVERSAMPLED: u32 = 256;

impl Ladder {
    /// The ladder of a scene, of the knobs that are asked for.
    #[must_use]
    pub fn new(scene: &Scene, shaders: &Shaders, wanted: &[Knob]) -> Self {
        let plan = Plan::new(scene, shaders, &[Layer::Rgba]);
        let own = Settings::of(scene);
        let ideal = ideal(scene, shaders, &plan, &own);
        let mut ladder =
            Self { points: vec![own], knobs: Vec::new(), left_out: Vec::new(), presets: Vec::new(), ideal };
        for knob in Knob::ALL.into_iter().filter(|knob| wanted.contains(knob)) {
            match rungs(knob, scene, shaders, &plan, &own, &ideal) {
                Ok(settings) => {
                    let points = settings.into_iter().map(|settings| ladder.point(settings)).collect();
                    ladder.knobs.push(Rungs { knob, points });
                }
                Err(why) => ladder.left_out.push((knob, why)),
            }
        }
        if wanted.contains(&Knob::Samples) {
            ladder.presets = Quality::ALL.map(|quality| (quality, ladder.point(quality.settings(&own)))).to_vec();
        }
        ladder
    }

    fn point(&mut self, settings: Settings) -> usize {
        let known = self.points.iter().position(|known| *known == settings);
        known.unwrap_or_else(|| {
            self.points.push(settings);
            self.points.len() - 1
        })
    }

    /// The points in the order in which they tell most: the scene itself; its ladder of samples but for the two highest rates,
    /// which take most of the time; the ends and the middle of each other ladder with the scene's samples, then what lies between;
    /// the two highest rates, and the presets; what has other rates and another setting, too, and last the highest rates of that.
    #[must_use]
    pub fn order(&self) -> Vec<usize> {
        let own = self.points[0].samples;
        let mut ranked = vec![(0, 0)];
        for Rungs { knob, points } in &self.knobs {
            let mut rates: Vec<u32> = points.iter().map(|point| self.points[*point].samples).collect();
            rates.sort_unstable();
            rates.dedup();
            let highest = rates.get(rates.len().saturating_sub(2)).copied().unwrap_or(own).max(own + 1);
            let group = |point: usize| match (knob, self.points[point].samples) {
                (Knob::Samples, samples) if samples < highest => 0,
                (Knob::Samples, _) => 1,
                (_, samples) if samples == own => 2,
                (_, samples) if samples < highest => 3,
                _ => 4,
            };
            // Of the first three of each group, and of the rest.
            for (number, ranks) in [[1, 1], [4, 4], [2, 3], [5, 5], [6, 6]].into_iter().enumerate() {
                let part: Vec<usize> = points.iter().copied().filter(|point| group(*point) == number).collect();
                let places = bisected(part.len()).into_iter().enumerate();
                ranked.extend(places.map(|(place, of_part)| (ranks[usize::from(place >= 3)], part[of_part])));
            }
        }
        ranked.extend(self.presets.iter().map(|(_, point)| (4, *point)));
        // Stable: among equals the more telling knob comes first.
        ranked.sort_by_key(|(rank, _)| *rank);
        let mut order = Vec::new();
        for (_, point) in ranked {
            if !order.contains(&point) {
                order.push(point);
            }
        }
        order
    }

    /// What a point is called: the first knob that it is on, and its value there, or a preset.
    #[must_use]
    pub fn name(&self, point: usize) -> String {
        if point == 0 {
            return "the scene".to_owned();
        }
        if let Some(rungs) = self.knobs.iter().find(|rungs| rungs.points.contains(&point)) {
            return format!("{} {}", rungs.knob.name(), self.points[point].value(rungs.knob));
        }
        let preset = self.presets.iter().find(|(_, place)| *place == point);
        preset.map_or_else(String::new, |(quality, _)| format!("quality {}", quality.name()))
    }
}

/// 0 … `count` in an order in which every part of the range is soon visited.
fn bisected(count: usize) -> Vec<usize> {
    let mut order = Vec::new();
    let mut add = |place: usize| {
        if place < count && !order.contains(&place) {
            order.push(place);
        }
    };
    add(0);
    add(count.saturating_sub(1));
    let mut step = count.next_power_of_two().max(1);
    while step > 0 {
        (0..=count / step).for_each(|i| add((i * step).min(count.saturating_sub(1))));
        step /= 2;
    }
    order
}

/// The scene's settings without what is an approximation. The filter stays: another one is another picture.
fn ideal(scene: &Scene, shaders: &Shaders, plan: &Plan, own: &Settings) -> Settings {
    let mut ideal = Settings { line_oversampling: 1, ..*own };
    if plan.lines.is_some() {
        if least_width(scene, shaders) < own.min_width {
            ideal.min_width = 0.0;
        }
        ideal.width_compensation = true;
        if surfaces_matter(scene, shaders) {
            ideal.surfaces = own.surfaces.max(8);
        }
    }
    if plan.reflection_depth > 0 {
        ideal.reflection_depth = own.reflection_depth.max(8).min(MOST_DEPTH - own.refraction_depth.min(MOST_DEPTH));
    }
    if plan.refraction_depth > 0 {
        ideal.refraction_depth = own.refraction_depth.max(16).min(MOST_DEPTH - ideal.reflection_depth);
    }
    ideal
}

/// The most that reflections and refractions may add up to.
const MOST_DEPTH: u32 = 30;

fn rungs(
    knob: Knob,
    scene: &Scene,
    shaders: &Shaders,
    plan: &Plan,
    own: &Settings,
    ideal: &Settings,
) -> Result<Vec<Settings>, &'static str> {
    let lines = plan.lines.is_some();
    let counts = |counts: &[u32], own: u32| {
        let mut all: Vec<u32> = counts.iter().copied().chain([own]).collect();
        all.sort_unstable();
        all.dedup();
        all
    };
    let depths = |depths: &[u32], own: u32, other: u32| {
        counts(depths, own).into_iter().filter(|depth| depth + other <= MOST_DEPTH).collect::<Vec<_>>()
    };
    Ok(match knob {
        Knob::Samples => {
            counts(&SAMPLES, own.samples).into_iter().map(|samples| Settings { samples, ..*own }).collect()
        }
        Knob::IdealSamples => {
            if (Settings { samples: own.samples, ..*ideal }) == *own {
                return Err("the scene is as exact as the reference but for its samples");
            }
            let all = counts(&SAMPLES, own.samples);
            all.into_iter().map(|samples| Settings { samples, ..*ideal }).collect()
        }
        _ if !lines
            && matches!(
                knob,
                Knob::Method | Knob::LineOversampling | Knob::MinWidth | Knob::WidthCompensation | Knob::Surfaces
            ) =>
        {
            return Err("no line can be seen");
        }
        Knob::Method => {
            let all = counts(&METHOD_SAMPLES, own.samples);
            let at = |method| all.iter().map(move |samples| Settings { method, samples: *samples, ..*own });
            METHODS.into_iter().flat_map(at).collect()
        }
        Knob::Sampler => {
            let all = counts(&SAMPLER_SAMPLES, own.samples);
            let at = |sampler| all.iter().map(move |samples| Settings { sampler, samples: *samples, ..*own });
            Sampler::ALL.into_iter().flat_map(at).collect()
        }
        Knob::LineOversampling => {
            let all = counts(&SAMPLER_SAMPLES, own.samples);
            let factors = counts(&LINE_OVERSAMPLING, own.line_oversampling);
            let at =
                |samples| factors.iter().map(move |factor| Settings { samples, line_oversampling: *factor, ..*own });
            let affordable = |settings: &Settings| settings.most_samples() <= MOST_OVERSAMPLED || settings == own;
            all.into_iter().flat_map(at).filter(affordable).collect()
        }
        Knob::MinWidth => {
            if least_width(scene, shaders) >= own.min_width.max(1.0) {
                return Err("no line is thin");
            }
            let mut all = vec![0.0, 0.25, 0.5, 1.0, own.min_width];
            all.sort_by(f32::total_cmp);
            all.dedup();
            all.into_iter().map(|min_width| Settings { min_width, ..*own }).collect()
        }
        Knob::WidthCompensation => {
            [false, true].map(|width_compensation| Settings { width_compensation, ..*own }).to_vec()
        }
        Knob::Surfaces => {
            if !surfaces_matter(scene, shaders) {
                return Err("nothing is behind what draws no lines");
            }
            let least = if scene.lines().hidden.is_some() { 2 } else { 1 };
            let all = counts(&[1, 2, 4, 8], own.surfaces).into_iter().filter(|surfaces| *surfaces >= least);
            all.map(|surfaces| Settings { surfaces, ..*own }).collect()
        }
        Knob::ReflectionDepth if plan.reflection_depth == 0 => return Err("no ray is mirrored"),
        Knob::ReflectionDepth => {
            let all = depths(&[0, 1, 2, 4, 8], own.reflection_depth, own.refraction_depth);
            all.into_iter().map(|reflection_depth| Settings { reflection_depth, ..*own }).collect()
        }
        Knob::RefractionDepth if plan.refraction_depth == 0 => return Err("no ray is refracted"),
        Knob::RefractionDepth => {
            let all = depths(&[0, 1, 2, 4, 8, 16], own.refraction_depth, own.reflection_depth);
            all.into_iter().map(|refraction_depth| Settings { refraction_depth, ..*own }).collect()
        }
        Knob::Filter => {
            let mut all = vec![
                (FilterKind::Box, 0.5),
                (FilterKind::Tent, 1.0),
                (FilterKind::Gaussian, 1.5),
                (FilterKind::Mitchell, 2.0),
                (FilterKind::BlackmanHarris, 1.5),
            ];
            if !all.contains(&(own.filter, own.filter_radius)) {
                all.push((own.filter, own.filter_radius));
            }
            all.into_iter().map(|(filter, filter_radius)| Settings { filter, filter_radius, ..*own }).collect()
        }
    })
}

/// Whether a line can be lost for want of surface lists: something that draws no lines, or shows what is behind it, may
/// cover something that draws some; or hidden lines are drawn.
fn surfaces_matter(scene: &Scene, shaders: &Shaders) -> bool {
    let draws_none = |material: MaterialId| width_bounds(scene.lines(), shaders, material)[1] <= 0.0;
    let bare = scene.objects().iter().any(|object| !object.lines || object.materials.iter().all(|id| draws_none(*id)));
    bare || scene.lines().hidden.is_some() || scene.lines().surfaces > 1
}

/// The thinnest line that may be drawn, in pixels; lines of width 0 are none.
fn least_width(scene: &Scene, shaders: &Shaders) -> f32 {
    let settings = scene.lines();
    let drawn = drawing_materials(scene).into_iter().enumerate().filter(|(_, draws)| *draws);
    let of_materials = drawn
        .map(|(index, _)| width_bounds(settings, shaders, MaterialId::from_index(index)))
        .filter(|[_, most]| *most > 0.0)
        .map(|[least, _]| least);
    let of_types = settings.types.iter().filter_map(|style| style.width).filter(|width| *width > 0.0);
    of_materials.chain(of_types).fold(f32::INFINITY, f32::min)
}

fn width_bounds(settings: &LineSettings, shaders: &Shaders, material: MaterialId) -> [f32; 2] {
    let fact = shaders.of(material).analysis().output(OutputSet::LINE_WIDTH);
    bounds(fact, settings.width).unwrap_or([0.0, f32::INFINITY])
}

impl fmt::Display for Ladder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for Rungs { knob, points } in &self.knobs {
            let values = points.iter().map(|point| {
                let value = self.points[*point].value(*knob);
                if *point == 0 { format!("[{value}]") } else { value }
            });
            let separator = match knob {
                Knob::Filter | Knob::Method | Knob::Sampler | Knob::LineOversampling => ", ",
                _ => " ",
            };
            writeln!(f, "{:<20}{}", knob.name(), values.collect::<Vec<_>>().join(separator))?;
        }
        for (knob, why) in &self.left_out {
            writeln!(f, "{:<20}none: {why}", knob.name())?;
        }
        let ideal = Knob::ALL.into_iter().filter(|knob| {
            !matches!(knob, Knob::Samples | Knob::IdealSamples)
                && self.ideal.value(*knob) != self.points[0].value(*knob)
        });
        let ideal: Vec<_> = ideal.map(|knob| format!("{} {}", knob.name(), self.ideal.value(knob))).collect();
        let ideal = if ideal.is_empty() { "as the scene, with more samples".to_owned() } else { ideal.join(", ") };
        writeln!(f, "{:<20}{ideal}", "reference")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_rung_is_visited_once_and_the_ends_first() {
        for count in 0..20 {
            let order = bisected(count);
            let mut sorted = order.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, (0..count).collect::<Vec<_>>());
            if count > 1 {
                assert_eq!(order[..2], [0, count - 1]);
            }
        }
        assert_eq!(bisected(8), [0, 7, 4, 2, 6, 1, 3, 5]);
    }
}
