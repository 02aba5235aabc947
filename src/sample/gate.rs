//! The gate: the one place where NaN, infinity and absurd numbers from scripts are stopped (DESIGN section 3.7).
//!
//! Neutral values: a component of a colour, alpha, feature, uv, position, throughput, contribution or AOV, or a footprint, that is
//! NaN or infinite becomes 0, and one beyond ±[`LARGEST`] counts as infinite, so that no sum over a filter can overflow; a width that is NaN, infinite or negative becomes 0 (no line); a width above the largest is
//! clamped to it; an opacity that is NaN or infinite becomes 0 (no line), any other is clamped to 0 … 1; a normal that is not finite or has no length becomes +Z, any other is brought to unit length; the
//! depth of a hit that is not finite becomes the largest finite number. What is stopped is counted by material, once per
//! node and kind however many of its numbers are bad; a normal without length counts as NaN, which it would become.
//!
//! Negative zeros become positive, so that equal numbers have equal bits behind the gate.

use bitflags::bitflags;

use super::buffer::{Node, NodeColumnSet, SampleColor};
use super::builder::SampleLayout;
use super::path::NodePath;
use crate::math::DVec3;

/// Numbers beyond this, either way, count as infinite: a film may add a hundred million of them up.
pub const LARGEST: f32 = 1e30;

/// What the gate stopped, for one material (or summed).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GateCounts {
    /// Nodes with at least one NaN.
    pub nan: u64,
    /// Nodes with at least one infinity, or a number beyond ±[`LARGEST`] where that counts as one.
    pub infinite: u64,
    /// Nodes with a negative line width.
    pub negative: u64,
    /// Nodes whose line width was clamped to `max_width`, or to what their shader declares.
    pub clamped_widths: u64,
}

impl std::ops::AddAssign for GateCounts {
    fn add_assign(&mut self, other: Self) {
        self.nan += other.nan;
        self.infinite += other.infinite;
        self.negative += other.negative;
        self.clamped_widths += other.clamped_widths;
    }
}

bitflags! {
    /// What was wrong with the numbers of one node.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub(super) struct Faults: u8 {
        const NAN = 1;
        const INFINITE = 2;
        const NEGATIVE = 4;
        const CLAMPED = 8;
    }
}

impl Faults {
    /// The number itself, or 0 and a fault.
    #[inline]
    fn number(&mut self, x: f32) -> f32 {
        if x.is_finite() {
            // −0 + 0 is +0; every other number stays what it is.
            return x + 0.0;
        }
        *self |= if x.is_nan() { Self::NAN } else { Self::INFINITE };
        0.0
    }

    /// A number that may be summed: itself, or 0 and a fault.
    #[inline]
    fn summand(&mut self, x: f32) -> f32 {
        self.number(if x.abs() > LARGEST { f32::INFINITY } else { x })
    }

    /// [`Self::summand`] of each component.
    #[inline]
    pub(super) fn numbers<const N: usize>(&mut self, x: [f32; N]) -> [f32; N] {
        if x.iter().all(|x| x.abs() <= LARGEST) {
            return x.map(|x| x + 0.0);
        }
        x.map(|x| self.summand(x))
    }

    fn normal(&mut self, normal: [f32; 3]) -> [f32; 3] {
        const NEUTRAL: [f32; 3] = [0.0, 0.0, 1.0];
        let mut own = Self::default();
        let clean = normal.map(|x| own.number(x));
        *self |= own;
        if !own.is_empty() {
            return NEUTRAL;
        }
        let [x, y, z] = clean;
        if (x * x + y * y + z * z - 1.0).abs() <= 1e-6 {
            return clean;
        }
        // In f64 the squares of no f32 overflow or vanish.
        match DVec3::from(clean.map(f64::from)).try_normalize() {
            Some(unit) => unit.as_vec3().to_array().map(|x| x + 0.0),
            None => {
                *self |= Self::NAN;
                NEUTRAL
            }
        }
    }

    fn width(&mut self, width: f32, max_width: f32) -> f32 {
        let width = self.number(width);
        if width < 0.0 {
            *self |= Self::NEGATIVE;
            0.0
        } else if width > max_width {
            *self |= Self::CLAMPED;
            max_width
        } else {
            width
        }
    }

    fn depth(&mut self, depth: f32) -> f32 {
        let clean = self.number(depth);
        if depth.is_finite() { clean } else { f32::MAX }
    }
}

/// A place in a pixel as the buffer may hold it: the bounds of the line search rely on 0 … 1.
pub(super) fn clean_offset(offset: [f32; 2]) -> [f32; 2] {
    offset.map(|x| if x.abs() <= LARGEST { (x + 0.0).clamp(0.0, 1.0) } else { 0.0 })
}

/// A colour as the buffer may hold it, and what was wrong with it.
#[inline]
pub(super) fn clean_color(SampleColor { color, alpha }: SampleColor) -> (SampleColor, Faults) {
    let mut faults = Faults::default();
    let [alpha] = faults.numbers([alpha]);
    let color = faults.numbers(color);
    (SampleColor { color, alpha }, faults)
}

/// Makes a node what the buffer may hold; returns what was wrong with it. Columns that are not kept are left as they came.
#[inline]
pub(super) fn clean_node(node: &mut Node, kept: NodeColumnSet, layout: &SampleLayout) -> Faults {
    let mut faults = Faults::default();
    // A miss has neither place nor style, only what it adds to the picture.
    if node.object == 0 {
        *node = Node { throughput: node.throughput, contribution: node.contribution, ..Node::default() };
    } else {
        node.depth = faults.depth(node.depth);
    }
    if kept.uv {
        node.uv = faults.numbers(node.uv);
    }
    if kept.normal {
        node.normal = faults.normal(node.normal);
    }
    if kept.feature {
        node.feature = faults.numbers(node.feature);
    }
    if kept.lines {
        node.line_color = faults.numbers(node.line_color);
        node.line_width = faults.width(node.line_width, layout.max_width_of(node.shader));
        node.line_opacity = faults.number(node.line_opacity).clamp(0.0, 1.0);
    }
    if kept.overlap || kept.position {
        node.position = faults.numbers(node.position);
    }
    if kept.overlap {
        node.geometric_normal = faults.normal(node.geometric_normal);
        node.footprint = faults.summand(node.footprint).abs();
    }
    if kept.throughput {
        node.throughput = faults.numbers(node.throughput);
    }
    if kept.contribution {
        node.contribution = faults.numbers(node.contribution);
    }
    faults
}

/// What a script makes of a line, as it may be drawn: the neutral values are those of a node's line.
#[must_use]
pub fn clean_line_style(color: [f32; 3], opacity: f32) -> ([f32; 3], f32, GateCounts) {
    let mut faults = Faults::default();
    let color = faults.numbers(color);
    let opacity = faults.number(opacity).clamp(0.0, 1.0);
    let counts = GateCounts {
        nan: faults.contains(Faults::NAN).into(),
        infinite: faults.contains(Faults::INFINITE).into(),
        ..GateCounts::default()
    };
    (color, opacity, counts)
}

/// Who did what, until the counts are drawn up.
#[derive(Debug, Default)]
pub(super) struct GateLog {
    entries: Vec<(NodePath, u32, u32, Faults)>,
}

impl GateLog {
    /// Notes faults of the node at a path of a sample; none cost nothing.
    #[inline]
    pub(super) fn note(&mut self, path: NodePath, sample: u32, shader: u32, faults: Faults) {
        if !faults.is_empty() {
            self.entries.push((path, sample, shader, faults));
        }
    }

    /// The counts by shader, 0 … `materials`. A node that was noted several times (its colour, its line, its extra
    /// outputs) counts once.
    pub(super) fn counts(mut self, materials: usize) -> Vec<GateCounts> {
        self.entries.sort_unstable_by_key(|&(path, sample, shader, _)| (path, sample, shader));
        self.entries.dedup_by(|next, first| {
            let same = (next.0, next.1, next.2) == (first.0, first.1, first.2);
            if same {
                first.3 |= next.3;
            }
            same
        });
        let mut counts = vec![GateCounts::default(); materials + 1];
        for (_, _, shader, faults) in self.entries {
            let shader = shader as usize;
            if shader >= counts.len() {
                counts.resize(shader + 1, GateCounts::default());
            }
            counts[shader] += GateCounts {
                nan: faults.contains(Faults::NAN).into(),
                infinite: faults.contains(Faults::INFINITE).into(),
                negative: faults.contains(Faults::NEGATIVE).into(),
                clamped_widths: faults.contains(Faults::CLAMPED).into(),
            };
        }
        counts
    }
}
