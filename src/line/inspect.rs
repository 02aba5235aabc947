//! One pair of samples laid open: what each test finds, who styles the line, and how near the two would have to be.
//!
//! For people who ask why a line is where it is, or why there is none. Plain and slow.

use super::overlap::Facet;
use super::pair::{LineNode, distance_squared, fired, type_of};
use super::window::{LineTile, PathTile};
use super::{Fired, Rules};
use crate::math::portable;
use crate::sample::NodePath;
use crate::scene::settings::LineSettings;

/// What a test found about a pair. Only tests that are on for the pair are listed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TestResult {
    /// The test: one flag.
    pub test: Fired,
    /// What was measured, in the unit of the threshold. `None` for ids, and where a miss takes no part.
    pub value: Option<f32>,
    /// What it must exceed; `None` for ids.
    pub threshold: Option<f32>,
    /// Whether it found a difference.
    pub fired: bool,
}

/// A target and a neighbour at one path.
#[derive(Clone, Debug, PartialEq)]
pub struct InspectedPair {
    /// Which tests found a difference.
    pub fired: Fired,
    /// All tests that are on for this pair, strongest first.
    pub tests: Vec<TestResult>,
    /// Whether the target is the priority sample.
    pub own: bool,
    /// From target to neighbour on the film, in pixels.
    pub distance: f32,
    /// The line of the priority sample is seen within less than this many pixels; 0 if it draws none.
    pub radius: f32,
    /// Its effective width in pixels: the width asked for, but no less than the minimum and no more than the widest
    /// (DESIGN section 3.2); 0 if it draws none.
    pub effective_width: f32,
    /// How much of the sample the line alone covers, 0 … 1.
    pub alpha: f32,
}

/// Lays open the pair of a sample of one tile and a sample of another; `None` if either has no node at the path, or no
/// line is drawn there.
#[must_use]
pub fn inspect(
    (target, sample): (LineTile<'_>, u32),
    (neighbor, other): (LineTile<'_>, u32),
    path: NodePath,
    rules: &Rules,
) -> Option<InspectedPair> {
    let (targets, neighbors) = (PathTile::new(target, path)?, PathTile::new(neighbor, path)?);
    let (row, other) = (targets.nodes.row_of(sample)?, neighbors.nodes.row_of(other)?);
    Some(Sides { targets, row, neighbors, other }.inspect(rules))
}

/// The neighbour that is nearest to a sample of `target` on the film among those in `tile` that differ, at the first path
/// that has any: its path, its sample in `tile`, and the pair.
#[must_use]
pub fn nearest_difference(
    (target, sample): (LineTile<'_>, u32),
    tiles: &[LineTile<'_>],
    rules: &Rules,
) -> Option<(NodePath, usize, u32, InspectedPair)> {
    for nodes in &target.buffer.paths {
        let (path, Some(row)) = (nodes.path, nodes.row_of(sample)) else { continue };
        let Some(targets) = PathTile::new(target, path) else { continue };
        let t = targets.node(target.buffer.pixel_of(sample), row);
        let mut nearest: Option<(f32, usize, usize)> = None;
        for (index, tile) in tiles.iter().enumerate() {
            let Some(neighbors) = PathTile::new(*tile, path) else { continue };
            for other in 0..neighbors.nodes.rows.len() {
                let n = node(&neighbors, other);
                let distance_squared = distance_squared(&t, n.pixel, n.offset);
                if nearest.is_none_or(|(nearest, ..)| distance_squared < nearest)
                    && !fired(rules, (&targets, row, &t), (&neighbors, other, &n)).is_empty()
                {
                    nearest = Some((distance_squared, index, other));
                }
            }
        }
        if let Some((_, index, other)) = nearest
            && let Some(neighbors) = PathTile::new(tiles[index], path)
        {
            let sample = neighbors.nodes.rows.sample(other);
            return Some((path, index, sample, Sides { targets, row, neighbors, other }.inspect(rules)));
        }
    }
    None
}

fn node(nodes: &PathTile<'_>, row: usize) -> LineNode {
    nodes.node(nodes.buffer.pixel_of(nodes.nodes.rows.sample(row)), row)
}

struct Sides<'a> {
    targets: PathTile<'a>,
    row: usize,
    neighbors: PathTile<'a>,
    other: usize,
}

impl Sides<'_> {
    fn inspect(&self, rules: &Rules) -> InspectedPair {
        let Self { targets, row, neighbors, other } = self;
        let (t, n) = (node(targets, *row), node(neighbors, *other));
        let own = !n.rank.outranks(t.rank);
        let (stylist, styling) = if own { (targets, *row) } else { (neighbors, *other) };
        let kind = type_of(rules, (targets, *row), (neighbors, *other));
        let asked = stylist.nodes.line_width.get(styling);
        let changed = rules.types().and_then(|types| types.style(kind).width).filter(|_| asked > 0.0);
        let width = changed.unwrap_or(asked);
        let radius = rules.radius(width);
        let fired = fired(rules, (targets, *row, &t), (neighbors, *other, &n));
        let settings = rules.settings_of(stylist.nodes.shader.get(styling));
        let minimum = settings.min_width;
        InspectedPair {
            fired,
            tests: self.tests(&settings, fired, [&t, &n]),
            own,
            distance: distance_squared(&t, n.pixel, n.offset).sqrt(),
            radius,
            effective_width: if radius > 0.0 { width.min(rules.widest()).max(minimum) } else { 0.0 },
            alpha: stylist.alpha(styling, kind, rules),
        }
    }

    fn tests(&self, settings: &LineSettings, fired: Fired, [t, n]: [&LineNode; 2]) -> Vec<TestResult> {
        let mut tests = Vec::new();
        let mut add = |test: Fired, threshold: Option<f32>, value: Option<f32>| {
            tests.push(TestResult { test, value, threshold, fired: fired.contains(test) });
        };
        let (a, b) = (&t.features, &n.features);
        let hits = !a.is_miss() && !b.is_miss();
        if settings.object {
            add(Fired::OBJECT, None, None);
        }
        if let Some(threshold) = settings.overlap {
            let value = (hits && a.object == b.object).then(|| {
                let [own, other] =
                    [Facet::of(self.targets.nodes, self.row), Facet::of(self.neighbors.nodes, self.other)];
                own.overlap(&other, distance_squared(t, n.pixel, n.offset))
            });
            add(Fired::OVERLAP, Some(threshold), value);
        }
        if settings.shader {
            add(Fired::SHADER, None, None);
        }
        if let Some(threshold) = settings.normal {
            // From the chord, as the test has it.
            let value = hits.then(|| 2.0 * portable::asin((length(a.normal, b.normal) / 2.0).min(1.0)).to_degrees());
            add(Fired::NORMAL, Some(threshold), value);
        }
        if let Some(threshold) = settings.uv {
            add(Fired::UV, Some(threshold), hits.then(|| length(a.uv, b.uv)));
        }
        if let Some(threshold) = settings.feature {
            let largest = || (0..3).map(|i| (a.feature[i] - b.feature[i]).abs()).fold(0.0, f32::max);
            add(Fired::FEATURE, Some(threshold), hits.then(largest));
        }
        tests
    }
}

fn length<const N: usize>(a: [f32; N], b: [f32; N]) -> f32 {
    (0..N).map(|i| (a[i] - b[i]) * (a[i] - b[i])).sum::<f32>().sqrt()
}
