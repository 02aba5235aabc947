//! The line pass: which line each sample sees. Pure image work on a [`SampleBuffer`](crate::sample::SampleBuffer)'s columns
//! (OG18 section 3, DESIGN section 3).
//!
//! A tile of samples is made ready once ([`TileBounds::new`]); then [`find_lines`] may be called for many tiles at once,
//! each with a [`Window`] onto the tiles around it. The result is a function of the samples and the rules alone: tile
//! size, threads and method change no bit.
//!
//! `brute` is the definition as plain loops and the oracle for `search`, which gives the same bits much sooner. What
//! decides is shared by both: `differ`, `overlap`, `materials`, `pair`, [`Rules`]. `list` holds both once more for lists of
//! surfaces (DESIGN section 3.4). `bounds` and `lanes` are the search's: what is known of many nodes
//! at once, and the loops over neighbours that are left.

mod baselines;
mod bounds;
mod brute;
mod change;
mod differ;
mod inspect;
mod lanes;
mod list;
mod materials;
mod overlap;
mod pair;
mod rules;
mod search;
mod style;
mod through;
mod types;
mod widening;
mod window;

pub use bounds::TileBounds;
pub use change::RuleChange;
pub use differ::Fired;
pub use inspect::{InspectedPair, TestResult, inspect, nearest_difference};
pub use rules::Rules;
pub use style::{LineScript, LineScripts};
pub use window::{LineTile, Window};

pub use crate::scene::settings::LineType;

use crate::sample::{GateCounts, NodePath, PixelRect};
use list::Kind;
use pair::LineNode;
use window::PathTile;

/// How lines are searched. The first two give the same lines, bit for bit; the others are methods to compare with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Bounds and cut-offs.
    #[default]
    Exact,
    /// Every neighbour of every sample.
    Brute,
    /// Choudhury and Parker 2009: one style, opacity by the part of the stencil that differs; camera nodes only.
    Choudhury,
    /// Bauer 2017: one style, a contour image of sub-pixels; camera nodes only.
    Bauer,
    /// West 2021: as exact, with some neighbours drawn at random instead of all; first surfaces only.
    Path {
        /// How many.
        probes: u32,
    },
}

impl Method {
    /// [`Method::Path`] with the most probes that are published.
    pub const PATH: Self = Self::Path { probes: 16 };
}

/// The line that a sample sees. With [`Rules::with_any_pair`], `fired`, `neighbor` and `own` may be those of another pair
/// that looks the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeenLine {
    /// The line's colour, tinted if the rules say so.
    pub color: [f32; 3],
    /// min(1, width / minimum width) times the line's opacity; with what is seen through it, if that is below 1.
    pub alpha: f32,
    /// The sample's colour with the line in it.
    pub lined: [f32; 3],
    /// Whether `lined` is the same whatever the sample's colour is.
    pub covers: bool,
    /// At which node the line was found.
    pub path: NodePath,
    /// Which tests fired.
    pub fired: Fired,
    /// The neighbour: pixel and sample number.
    pub neighbor: ([i32; 2], u32),
    /// Whether the target's own line attributes style it (else the neighbour's do).
    pub own: bool,
    /// Whether it is the line of a surface behind the sample's first, in the style of `[lines.hidden]`.
    pub hidden: bool,
}

/// The lines of a rectangle: which samples see one, in the order of samples.
#[derive(Clone, Debug, PartialEq)]
pub struct LineBuffer {
    /// The pixels.
    pub rect: PixelRect,
    /// Sample indices (as in the [`SampleBuffer`](crate::sample::SampleBuffer) of the same rectangle), rising.
    pub samples: Vec<u32>,
    /// The line of each.
    pub lines: Vec<SeenLine>,
    /// Work done, for `--stats`.
    pub counts: LineCounts,
    /// What scripts gave for lines that is no number, by `shader` value; may be shorter than there are materials.
    pub gate: Vec<GateCounts>,
}

impl SeenLine {
    /// Whether pixels are the same with either: of the reasons only the strongest counts, and of the pair nothing.
    fn looks_like(&self, other: &Self) -> bool {
        let bits = |line: &Self| [line.color, line.lined].map(|color| color.map(f32::to_bits));
        bits(self) == bits(other)
            && self.alpha.to_bits() == other.alpha.to_bits()
            && self.path == other.path
            && self.hidden == other.hidden
            && LineType::of(self.fired) == LineType::of(other.fired)
    }
}

impl LineBuffer {
    fn new(rect: PixelRect, mut lines: Vec<(u32, SeenLine)>, counts: LineCounts, gate: Vec<GateCounts>) -> Self {
        lines.sort_unstable_by_key(|&(sample, _)| sample);
        let lined_samples = lines.len() as u64;
        let hidden_samples = lines.iter().filter(|(_, line)| line.hidden).count() as u64;
        let (samples, lines) = lines.into_iter().unzip();
        Self { rect, samples, lines, counts: LineCounts { lined_samples, hidden_samples, ..counts }, gate }
    }

    /// These lines of a part of a rectangle, and those of another buffer outside it; both of the same samples, so many in
    /// a pixel.
    #[must_use]
    pub(crate) fn with_others_outside(self, part: PixelRect, other: &Self, samples_per_pixel: u32) -> Self {
        let outside = |sample: &u32| {
            let [x, y] = self.pixel_of(*sample, samples_per_pixel);
            !part.contains(x, y)
        };
        let kept = other.samples.iter().copied().zip(other.lines.iter().copied()).filter(|(sample, _)| outside(sample));
        let lines = self.samples.iter().copied().zip(self.lines.iter().copied()).chain(kept).collect();
        Self::new(self.rect, lines, self.counts, self.gate)
    }

    fn pixel_of(&self, sample: u32, samples_per_pixel: u32) -> [i32; 2] {
        let (pixel, width) = (sample / samples_per_pixel.max(1), self.rect.width().max(1));
        [self.rect.x0 + (pixel % width) as i32, self.rect.y0 + (pixel / width) as i32]
    }

    /// The least rectangle of pixels outside which the lines look like those of another buffer of the same samples, so many
    /// in a pixel; `None` if all do.
    #[must_use]
    pub fn difference(&self, other: &Self, samples_per_pixel: u32) -> Option<PixelRect> {
        let mut changed: Option<PixelRect> = None;
        let mut note = |sample: u32| {
            let [x0, y0] = self.pixel_of(sample, samples_per_pixel);
            let pixel = PixelRect { x0, y0, x1: x0 + 1, y1: y0 + 1 };
            changed = Some(changed.map_or(pixel, |changed| changed.union(&pixel)));
        };
        let (mut here, mut there) = (0, 0);
        loop {
            match (self.samples.get(here), other.samples.get(there)) {
                (Some(a), Some(b)) if a == b => {
                    if !self.lines[here].looks_like(&other.lines[there]) {
                        note(*a);
                    }
                    (here, there) = (here + 1, there + 1);
                }
                (Some(a), b) if b.is_none_or(|b| a < b) => {
                    note(*a);
                    here += 1;
                }
                (_, Some(b)) => {
                    note(*b);
                    there += 1;
                }
                _ => return changed,
            }
        }
    }
}

/// Work done by the line pass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LineCounts {
    /// Target–neighbour pairs whose attributes or distance were looked at; probes of [`Method::Path`].
    pub pairs_tested: u64,
    /// Samples that see a line, hidden ones included.
    pub lined_samples: u64,
    /// Samples that see a hidden line.
    pub hidden_samples: u64,
}

impl std::ops::AddAssign for LineCounts {
    fn add_assign(&mut self, other: Self) {
        self.pairs_tested += other.pairs_tested;
        self.lined_samples += other.lined_samples;
        self.hidden_samples += other.hidden_samples;
    }
}

/// Finds the line of every sample of `target`. `window` must hold all samples of the picture within
/// [`Rules::reach`] pixels around it, the target's own among them; all its bounds must be made by `rules`.
///
/// The paths are taken in breadth-first order, each only for samples that have no line yet and have a node there
/// (OG18 section 3.4).
///
/// A line that is not opaque (thinner than the minimum width, or with an opacity) shows the next one in the order of keys,
/// and so on until they are opaque. Each surface (object and material) draws or borders at most one of a sample's lines at
/// a path, else the many pairs that see one edge would count as many lines; there are at most 8.
///
/// `scripts` style the lines of materials that [`Rules::with_scripts`] names.
#[must_use]
pub fn find_lines(
    window: &Window<'_>,
    target: LineTile<'_>,
    rules: &Rules,
    method: Method,
    scripts: Option<&mut (dyn LineScripts + '_)>,
) -> LineBuffer {
    find(window, target, vec![false; target.buffer.samples()], rules, method, scripts)
}

/// The same for the pixels of a part of the target alone: other samples see no line.
#[must_use]
pub(crate) fn find_lines_in(
    part: PixelRect,
    window: &Window<'_>,
    target: LineTile<'_>,
    rules: &Rules,
    method: Method,
) -> LineBuffer {
    let outside = |sample| {
        let [x, y] = target.buffer.pixel_of(sample);
        !part.contains(x, y)
    };
    let skipped = (0..target.buffer.samples() as u32).map(outside).collect();
    find(window, target, skipped, rules, method, None)
}

/// Those that are `lined` see no further line.
fn find(
    window: &Window<'_>,
    target: LineTile<'_>,
    mut lined: Vec<bool>,
    rules: &Rules,
    method: Method,
    mut scripts: Option<&mut (dyn LineScripts + '_)>,
) -> LineBuffer {
    let mut lines: Vec<(u32, SeenLine)> = Vec::new();
    let mut counts = LineCounts::default();
    let mut gate = Vec::new();
    let lists = rules.surfaces() > 1;
    // Hidden lines come last: they are drawn where no visible line of any path is.
    let passes = target.buffer.paths.iter().map(|nodes| (nodes, Kind::Visible));
    let hidden = rules.hidden().map_or(&[][..], |_| &target.buffer.paths);
    for (nodes, kind) in passes.chain(hidden.iter().map(|nodes| (nodes, Kind::Hidden))) {
        let Some(targets) = PathTile::new(target, nodes.path) else { continue };
        let at_path = window.at_path(nodes.path);
        let found = match method {
            Method::Exact if !lists => search::find(&at_path, &targets, &lined, rules, &mut counts),
            Method::Brute if !lists => brute::find(&at_path, &targets, &lined, rules, &mut counts),
            Method::Exact | Method::Brute => {
                let search = list::Search { window: &at_path, targets: &targets, rules, kind };
                let skipped =
                    if kind == Kind::Hidden { seen_through(target, nodes.path, &lined) } else { lined.clone() };
                if method == Method::Brute {
                    list::brute::find(&search, &skipped, &mut counts)
                } else {
                    list::search::find(&search, &skipped, &mut counts)
                }
            }
            Method::Choudhury => {
                lines = baselines::choudhury(&at_path, &targets, rules, &mut counts);
                break;
            }
            Method::Bauer => {
                lines = baselines::bauer(&at_path, &targets, rules, &mut counts);
                break;
            }
            Method::Path { .. } if kind == Kind::Hidden => break,
            Method::Path { probes } => baselines::path(&at_path, &targets, &lined, rules, probes, &mut counts),
        };
        style::style(&at_path, &targets, &found, rules, scripts.as_deref_mut(), &mut gate, |sample, line| {
            lined[sample as usize] = true;
            lines.push((sample, line));
        });
    }
    LineBuffer::new(target.buffer.rect, lines, counts, gate)
}

/// The samples that look for no hidden line at a path: those that have a line, and those whose rays go on through the
/// surface there. It hides nothing; what lies behind it is looked at where they arrive.
fn seen_through(target: LineTile<'_>, path: NodePath, lined: &[bool]) -> Vec<bool> {
    let mut skipped = lined.to_vec();
    if let Some(through) = target.buffer.nodes(path.refracted()) {
        (0..through.rows.len()).for_each(|row| skipped[through.rows.sample(row) as usize] = true);
    }
    skipped
}
