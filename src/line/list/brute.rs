//! The definition as plain loops, to be read beside the head of [`super`]. The oracle of [`super::search`].

use super::{Kind, List, Search, Surface, is_opaque, push_list};
use crate::line::LineCounts;
use crate::line::differ::Features;
use crate::line::pair::{Found, MOST_LINES, Pair, Taken, distance_squared};
use crate::line::window::{PathTile, features};
use crate::sample::PixelRect;

/// The line that each target sees which is not `skipped`, by its sample.
pub(in crate::line) fn find(search: &Search<'_, '_>, skipped: &[bool], counts: &mut LineCounts) -> Vec<Found> {
    let Search { window, targets, rules, kind } = *search;
    let mut found = Vec::new();
    for row in 0..targets.nodes.rows.len() {
        if skipped[targets.nodes.rows.sample(row) as usize] {
            continue;
        }
        let mut taken = Taken::default();
        let mut pairs = Vec::new();
        let most = if kind == Kind::Hidden { 1 } else { MOST_LINES };
        while pairs.len() < most
            && let Some(pair) = seen(search, row, &taken, counts)
        {
            pairs.push(pair);
            // Through a line that is not opaque, the next is seen.
            let Some(neighbors) = &window.tiles[pair.tile as usize] else { break };
            if is_opaque(rules, (targets, row), neighbors, &pair) {
                break;
            }
            taken.take(&other_side(neighbors, &pair), pair.own);
        }
        if let Some((pair, behind)) = pairs.split_first() {
            let hidden = kind == Kind::Hidden;
            found.push(Found { row, path: targets.nodes.path, pair: *pair, hidden, behind: behind.to_vec() });
        }
    }
    found
}

/// The neighbour's surface by which a line is taken: the one that draws it, or the first if the target draws.
pub(super) fn other_side(neighbors: &PathTile<'_>, pair: &Pair) -> Features {
    let row = pair.row as usize;
    let drawing = if pair.own { None } else { neighbors.surface(row, pair.surface) };
    drawing.map_or_else(|| neighbors.features(row), |(nodes, row)| features(nodes, row))
}

/// The pair that the target of a row sees, but for lines that are taken.
fn seen(search: &Search<'_, '_>, row: usize, taken: &Taken, counts: &mut LineCounts) -> Option<Pair> {
    let Search { window, targets, rules, kind } = *search;
    let [x, y] = targets.buffer.pixel_of(targets.nodes.rows.sample(row));
    let node = targets.node([x, y], row);
    let mut surfaces = Vec::new();
    let full = push_list(targets, row, rules, &mut surfaces);
    let t = List { surfaces: &surfaces, full };
    let t1 = t.surfaces[0];
    let mut seen: Option<Pair> = None;

    // For every neighbour n …
    for segment in window.segments(PixelRect { x0: x, y0: y, x1: x + 1, y1: y + 1 }.grown(rules.reach())) {
        let tile = segment.tile;
        for pixel in (segment.x0..segment.x1).map(|x| [x, segment.y]) {
            for row in tile.nodes.rows.of_pixel(tile.buffer.pixel_number(pixel)) {
                let mut surfaces = Vec::new();
                let full = push_list(tile, row, rules, &mut surfaces);
                let n = List { surfaces: &surfaces, full };
                let n1 = n.surfaces[0];
                counts.pairs_tested += 1;
                let d = distance_squared(&node, pixel, tile.offset(row));
                let at = At { pixel, tile: segment.index as u32, row: row as u32, distance_squared: d };

                // … the lines that t may see of it.
                match kind {
                    Kind::Visible => {
                        for (place, s) in (0..).zip(n.surfaces) {
                            let differs = if place == 0 { s.differs(&t1, d, rules) } else { t.lacks(s, d, rules) };
                            if s.rank.outranks(t1.rank) && differs && !taken.contains(&s.features, false) {
                                at.consider(s, s.radius_squared_beside(&t1, d, rules), place, false, &mut seen);
                            }
                        }
                        let own = !n1.rank.outranks(t1.rank) && t1.differs(&n1, d, rules);
                        if (own || n.lacks(&t1, d, rules)) && !taken.contains(&n1.features, true) {
                            at.consider(&t1, t1.radius_squared_beside(&n1, d, rules), 0, true, &mut seen);
                        }
                    }
                    Kind::Hidden => {
                        let Some(hidden) = rules.hidden() else { continue };
                        let is_hidden = |s: &Surface| {
                            t1.rank.outranks(s.rank) && s.radius_squared > 0.0 && hidden.draws(s.features.object)
                        };
                        for (place, s) in (0..).zip(n.surfaces) {
                            if is_hidden(s) && t.lacks(s, d, rules) {
                                at.consider(s, hidden.radius_squared, place, false, &mut seen);
                            }
                        }
                        for (place, s) in (0..).zip(t.surfaces) {
                            if is_hidden(s) && n.lacks(s, d, rules) {
                                at.consider(s, hidden.radius_squared, place, true, &mut seen);
                            }
                        }
                    }
                }
            }
        }
    }
    seen
}

/// A neighbour, as seen from a target.
struct At {
    pixel: [i32; 2],
    tile: u32,
    row: u32,
    distance_squared: f32,
}

impl At {
    /// Keeps the line of a surface if it reaches the target and is seen rather than what was.
    fn consider(&self, surface: &Surface, radius_squared: f32, place: u32, own: bool, seen: &mut Option<Pair>) {
        let Self { pixel, tile, row, distance_squared } = *self;
        if distance_squared >= radius_squared {
            return;
        }
        let pair = Pair { rank: surface.rank, distance_squared, pixel, tile, row, surface: place, own };
        if seen.is_none_or(|best| pair.beats(&best)) {
            *seen = Some(pair);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::line::window::{LineTile, Window};
    use crate::line::{Rules, TileBounds, brute};
    use crate::sample::{HandMadeSample, Node, NodeColumnSet, NodePath, SampleBuffer, SampleLayout};
    use crate::scene::settings::LineSettings;

    /// Lists of one surface see what DESIGN section 3.2 says, whatever the priorities, depths, misses and opacities.
    #[test]
    fn one_surface_is_no_list() {
        let mut state = 1_u64;
        let mut below = move |limit: u64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) % limit
        };
        for round in 0..60 {
            let rect = PixelRect { x0: 0, y0: 0, x1: 7, y1: 5 };
            let nodes: Vec<_> = (0..rect.pixels() * 2)
                .map(|_| {
                    let node = Node {
                        object: below(4) as u32,
                        shader: 1 + below(2) as u32,
                        depth: 1.0 + below(3) as f32,
                        priority: below(3) as i32 - 1,
                        line_width: [0.0, 0.3, 1.0, 3.0, 6.0][below(5) as usize],
                        line_opacity: [1.0, 0.5][below(2) as usize],
                        ..Node::default()
                    };
                    ([below(8) as f32 / 8.0, below(8) as f32 / 8.0], [(NodePath::CAMERA, node)])
                })
                .collect();
            let samples: Vec<_> = nodes
                .iter()
                .map(|(offset, nodes)| HandMadeSample { offset: *offset, nodes, ..HandMadeSample::default() })
                .collect();
            let columns = NodeColumnSet::ALL;
            let layout = SampleLayout { samples_per_pixel: 2, columns, max_width: 8.0, ..SampleLayout::default() };
            let buffer = SampleBuffer::from_samples(rect, &layout, &samples);
            let settings = LineSettings { shader: round % 2 == 0, ..LineSettings::default() };
            let rules = Rules::new(&settings, 2);
            let bounds = TileBounds::new(&buffer, &rules);
            let tile = LineTile { buffer: &buffer, bounds: &bounds };
            let window = Window::single(tile).at_path(NodePath::CAMERA);
            let targets = PathTile::new(tile, NodePath::CAMERA).expect("every sample has a camera node");
            let skipped = vec![false; buffer.samples()];
            let mut counts = LineCounts::default();
            let search = Search { window: &window, targets: &targets, rules: &rules, kind: Kind::Visible };
            let lists = find(&search, &skipped, &mut counts);
            let plain = brute::find(&window, &targets, &skipped, &rules, &mut counts);
            assert!(!plain.is_empty());
            assert_eq!(lists, plain);
        }
    }
}
