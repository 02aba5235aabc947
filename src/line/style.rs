//! How a seen line colours its sample (DESIGN sections 3.2, 3.3 and 3.6; OG18 sections 3.4 and 3.5).
//!
//! 1. Each pair of a sample has a colour and an opacity: those of its priority sample, changed by the line's type.
//! 2. Where the priority sample's material has a script for lines, the script changes them: all lines of a material at once.
//!    Hidden lines are left as they are.
//! 3. The pairs are mixed into the sample's colour, from the back to the front.

use std::collections::BTreeMap;

use smallvec::SmallVec;

use super::differ::Fired;
use super::pair::{Found, Pair, fired};
use super::window::{PathTile, PathWindow, alpha};
use super::{LineType, Rules, SeenLine, list};
use crate::math::{Vec3, luminance};
use crate::sample::gate::clean_line_style;
use crate::sample::{GateCounts, NodeColumns, PairBatch, PairSide};
use crate::scene::settings::{Composition, TypeStyle};

/// What a material's script changes about its lines, one by one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LineScript {
    /// There is none.
    #[default]
    None,
    /// Their colour.
    Color,
    /// Their opacity, and perhaps their colour: what lies behind such a line may be seen through it.
    Opacity,
}

/// Scripts that style lines one by one.
pub trait LineScripts {
    /// Styles lines of a material, given by its `shader` value: for each row of `pairs` a colour, or `None` to leave it, and a
    /// factor of the opacity. Any numbers will do. Positions in `pairs` are relative to the camera's, as in the samples.
    fn style(&mut self, shader: u32, pairs: &mut PairBatch, styles: &mut Vec<(Option<[f32; 3]>, f32)>);
}

impl LineType {
    /// The strongest reason that a line has; `None` without any.
    #[must_use]
    pub fn of(fired: Fired) -> Option<Self> {
        [
            (Fired::MISS, Self::Outline),
            (Fired::OBJECT, Self::Silhouette),
            (Fired::OVERLAP, Self::Overlap),
            (Fired::SHADER, Self::Material),
            (Fired::NORMAL, Self::Crease),
            (Fired::UV, Self::Uv),
            (Fired::FEATURE, Self::Feature),
        ]
        .into_iter()
        .find_map(|(test, kind)| fired.contains(test).then_some(kind))
    }
}

/// The line of one pair, without tint.
#[derive(Clone, Copy, Debug)]
struct Drawn {
    color: Vec3,
    alpha: f32,
    fired: Fired,
}

/// The lines of a sample, front to back: mostly one.
type DrawnLines = SmallVec<[Drawn; 1]>;

/// Hands over the lines that targets see, in their colours, with their samples. What scripts gave that is no number is
/// counted by `shader` value.
pub(super) fn style(
    window: &PathWindow<'_>,
    targets: &PathTile<'_>,
    found: &[Found],
    rules: &Rules,
    scripts: Option<&mut (dyn LineScripts + '_)>,
    gate: &mut Vec<GateCounts>,
    mut see: impl FnMut(u32, SeenLine),
) {
    let styler = Styler { window, targets, rules };
    let mut mix = |found: &Found, drawn: &[Drawn]| {
        if let Some((sample, line)) = styler.mix(found, drawn) {
            see(sample, line);
        }
    };
    match scripts.filter(|_| !rules.no_scripts()) {
        // Where nobody asks for all lines at once, they need not be kept.
        None => found.iter().for_each(|found| mix(found, &styler.drawn(found))),
        Some(scripts) => {
            let mut drawn: Vec<DrawnLines> = found.iter().map(|found| styler.drawn(found)).collect();
            styler.ask_scripts(found, &mut drawn, scripts, gate);
            found.iter().zip(&drawn).for_each(|(found, drawn)| mix(found, drawn));
        }
    }
}

struct Styler<'s, 'a> {
    window: &'s PathWindow<'a>,
    targets: &'s PathTile<'a>,
    rules: &'s Rules,
}

impl Styler<'_, '_> {
    /// Columns and row of the surface that styles a pair, and of the first surface of the other sample.
    fn sides(&self, found: &Found, pair: &Pair) -> Option<[(&NodeColumns, usize); 2]> {
        let neighbors = self.window.tiles[pair.tile as usize].as_ref()?;
        let row = pair.row as usize;
        Some(match pair.own {
            true => [self.targets.surface(found.row, pair.surface)?, (neighbors.nodes, row)],
            false => [neighbors.surface(row, pair.surface)?, (self.targets.nodes, found.row)],
        })
    }

    /// The lines of a sample before scripts, front to back.
    #[inline]
    fn drawn(&self, found: &Found) -> DrawnLines {
        let pairs = std::iter::once(&found.pair).chain(&found.behind);
        pairs.filter_map(|pair| self.drawn_pair(found, pair)).collect()
    }

    fn drawn_pair(&self, found: &Found, pair: &Pair) -> Option<Drawn> {
        let [(nodes, row), _] = self.sides(found, pair)?;
        let neighbors = self.window.tiles[pair.tile as usize].as_ref()?;
        let fired = if self.rules.surfaces() > 1 {
            list::fired(self.rules, (self.targets, found.row), neighbors, pair)?
        } else {
            let target = self.targets.node(self.pixel(found), found.row);
            let neighbor = neighbors.node(pair.pixel, pair.row as usize);
            let of_neighbor = (neighbors, pair.row as usize, &neighbor);
            fired(self.rules, (self.targets, found.row, &target), of_neighbor)
        };
        if let Some(hidden) = self.rules.hidden().filter(|_| found.hidden) {
            return Some(Drawn { color: Vec3::from(hidden.color), alpha: hidden.alpha, fired });
        }
        let kind = LineType::of(fired);
        let changed = self.rules.types().map_or_else(TypeStyle::default, |types| types.style(kind));
        Some(Drawn {
            color: changed.color.unwrap_or_else(|| Vec3::from(nodes.line_color.get(row))),
            alpha: alpha(nodes, row, kind, self.rules),
            fired,
        })
    }

    fn pixel(&self, found: &Found) -> [i32; 2] {
        self.targets.buffer.pixel_of(self.targets.nodes.rows.sample(found.row))
    }

    /// Hands the lines of materials that have a script to it, one material at a time.
    fn ask_scripts(
        &self,
        found: &[Found],
        drawn: &mut [DrawnLines],
        scripts: &mut dyn LineScripts,
        gate: &mut Vec<GateCounts>,
    ) {
        let mut batches: BTreeMap<u32, (PairBatch, Vec<(usize, usize)>)> = BTreeMap::new();
        for (index, found) in found.iter().enumerate().filter(|(_, found)| !found.hidden) {
            for (layer, pair) in std::iter::once(&found.pair).chain(&found.behind).enumerate() {
                let (Some(sides), Some(drawn)) = (self.sides(found, pair), drawn[index].get(layer)) else { continue };
                let [(nodes, row), _] = sides;
                let shader = nodes.shader.get(row);
                if self.rules.script_of(shader) != LineScript::None {
                    let (batch, places) = batches.entry(shader).or_default();
                    self.add(batch, found, pair, sides, drawn);
                    places.push((index, layer));
                }
            }
        }
        let mut styles = Vec::new();
        for (shader, (mut batch, places)) in batches {
            scripts.style(shader, &mut batch, &mut styles);
            for ((index, layer), (color, opacity)) in places.into_iter().zip(styles.drain(..)) {
                let line = &mut drawn[index][layer];
                let (color, opacity, counts) = clean_line_style(color.unwrap_or(line.color.to_array()), opacity);
                (line.color, line.alpha) = (Vec3::from(color), line.alpha * opacity);
                if counts != GateCounts::default() {
                    gate.resize(gate.len().max(shader as usize + 1), GateCounts::default());
                    gate[shader as usize] += counts;
                }
            }
        }
    }

    /// Adds a line to what a script is asked about.
    fn add(&self, batch: &mut PairBatch, found: &Found, pair: &Pair, sides: [(&NodeColumns, usize); 2], drawn: &Drawn) {
        let [(nodes, row), _] = sides;
        // There is no pair without a reason.
        let kind = LineType::of(drawn.fired).unwrap_or(LineType::Feature);
        let changed = self.rules.types().and_then(|types| types.style(Some(kind)).width);
        let width = changed.unwrap_or_else(|| nodes.line_width.get(row));
        let [x, y] = self.pixel(found);
        let [across, down] = self.targets.offset(found.row);
        batch.len += 1;
        batch.kind.push(kind);
        batch.path.push(found.path);
        batch.distance.push((pair.distance_squared.sqrt() / self.rules.radius(width)).min(1.0));
        batch.own.push(pair.own);
        batch.width.push(width);
        batch.color.push(drawn.color.to_array());
        batch.opacity.push(drawn.alpha);
        batch.pixel.push([x as f32 + across, y as f32 + down]);
        for (side, (nodes, row)) in batch.sides.iter_mut().zip(sides) {
            side.object.push(nodes.object_itself(row));
            side.material.push(nodes.shader.get(row));
            side.depth.push(nodes.depth.get(row).min(PairSide::FARTHEST));
            side.position.push(nodes.position.get(row));
            side.normal.push(nodes.normal.get(row));
            side.feature.push(nodes.feature.get(row));
        }
    }

    /// A sample's colour with its lines. What else is told of the line is of the one in front.
    #[inline]
    fn mix(&self, found: &Found, drawn: &[Drawn]) -> Option<(u32, SeenLine)> {
        let Self { targets, .. } = self;
        let sample = targets.nodes.rows.sample(found.row);
        // The target's: it is the target's colour that the line replaces.
        let throughput = Vec3::from(targets.nodes.throughput.get(found.row));
        let mut contribution = Vec3::from(targets.nodes.contribution.get(found.row));
        let settings = self.rules.settings();
        let mut lined = Vec3::from(targets.buffer.color.get(sample as usize));
        let (mut color, mut premultiplied, mut covered) = (Vec3::ZERO, Vec3::ZERO, 0.0);
        for Drawn { color: line_color, alpha, .. } in drawn.iter().rev().copied() {
            color = if settings.tint { line_color * throughput } else { line_color };
            match settings.compose {
                Composition::Replace => lined = lined * (1.0 - alpha) + color * alpha,
                Composition::Throughput => {
                    let part = if settings.tint { color } else { line_color * luminance(throughput) };
                    let change = (part - contribution) * alpha;
                    lined += change;
                    contribution += change;
                }
            }
            premultiplied = premultiplied * (1.0 - alpha) + color * alpha;
            covered = covered * (1.0 - alpha) + alpha;
        }
        if !found.behind.is_empty() && covered > 0.0 {
            color = premultiplied / covered;
        }
        let pair = &found.pair;
        let neighbors = self.window.tiles[pair.tile as usize].as_ref()?;
        let line = SeenLine {
            color: color.to_array(),
            alpha: covered,
            lined: lined.to_array(),
            covers: settings.compose == Composition::Replace && drawn.iter().any(|line| line.alpha == 1.0),
            path: found.path,
            hidden: found.hidden,
            fired: drawn.first()?.fired,
            neighbor: (pair.pixel, neighbors.nodes.rows.sample(pair.row as usize) % neighbors.buffer.samples_per_pixel),
            own: pair.own,
        };
        Some((sample, line))
    }
}
