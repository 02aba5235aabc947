//! How a seen line colours its sample (DESIGN sections 3.2 and 3.3; OG18 sections 3.4 and 3.5).

use super::differ::Fired;
use super::pair::{Found, fired};
use super::window::{PathTile, PathWindow, alpha};
use super::{LineType, Rules, SeenLine, list};
use crate::math::{Vec3, luminance};
use crate::scene::settings::Composition;

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

/// The line that a target sees, in its colours. Lines that are seen through it are mixed into it, from the back to the
/// front; what else is told of the line is of the one in front.
pub(super) fn style(window: &PathWindow<'_>, targets: &PathTile<'_>, found: &Found, rules: &Rules) -> Option<SeenLine> {
    let sample = targets.nodes.rows.sample(found.row);
    let before = Vec3::from(targets.buffer.color[sample as usize]);
    // The target's: it is the target's colour that the line replaces.
    let throughput = Vec3::from(targets.nodes.throughput.get(found.row));
    let mut contribution = Vec3::from(targets.nodes.contribution.get(found.row));
    let settings = rules.settings();
    let (mut lined, mut color, mut premultiplied, mut covered) = (before, Vec3::ZERO, Vec3::ZERO, 0.0);
    for pair in found.behind.iter().rev().chain([&found.pair]) {
        let (nodes, row) = match pair.own {
            true => targets.surface(found.row, pair.surface)?,
            false => window.tiles[pair.tile as usize].as_ref()?.surface(pair.row as usize, pair.surface)?,
        };
        let (line_color, alpha) = match rules.hidden().filter(|_| found.hidden) {
            Some(hidden) => (Vec3::from(hidden.color), hidden.alpha),
            None => (Vec3::from(nodes.line_color.get(row)), alpha(nodes, row, rules)),
        };
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
    let neighbors = window.tiles[pair.tile as usize].as_ref()?;
    let spp = neighbors.buffer.samples_per_pixel;
    let fired = if rules.surfaces() > 1 {
        list::fired(rules, targets, found, neighbors)?
    } else {
        let target = targets.node(targets.buffer.pixel_of(sample), found.row);
        let row = pair.row as usize;
        let neighbor = neighbors.node(pair.pixel, row);
        fired(rules, (targets, found.row, &target), (neighbors, row, &neighbor))
    };
    Some(SeenLine {
        color: color.to_array(),
        alpha: covered,
        lined: lined.to_array(),
        path: found.path,
        hidden: found.hidden,
        fired,
        neighbor: (pair.pixel, neighbors.nodes.rows.sample(pair.row as usize) % spp),
        own: pair.own,
    })
}
