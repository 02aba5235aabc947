//! The definition as plain loops (DESIGN section 3.2), to be read beside the text. The oracle of [`super::search`]. For
//! lists of surfaces see [`super::list`].

use super::pair::{Found, MOST_LINES, Pair, Taken, distance_squared, fired, is_opaque};
use super::window::{PathTile, PathWindow};
use super::{LineCounts, Rules};
use crate::sample::PixelRect;

/// The line that each target sees which is not yet `lined`, by its sample.
pub(super) fn find(
    window: &PathWindow<'_>,
    targets: &PathTile<'_>,
    lined: &[bool],
    rules: &Rules,
    counts: &mut LineCounts,
) -> Vec<Found> {
    let mut found = Vec::new();
    for row in 0..targets.nodes.rows.len() {
        if lined[targets.nodes.rows.sample(row) as usize] {
            continue;
        }
        let mut taken = Taken::default();
        let mut pairs = Vec::new();
        while pairs.len() < MOST_LINES
            && let Some(pair) = seen(window, targets, row, &taken, rules, counts)
        {
            pairs.push(pair);
            // Through a line that is not opaque, the next is seen.
            let Some(neighbors) = &window.tiles[pair.tile as usize] else { break };
            if is_opaque(rules, (targets, row), (neighbors, pair.row as usize), pair.own) {
                break;
            }
            taken.take(&neighbors.features(pair.row as usize), pair.own);
        }
        if let Some((pair, behind)) = pairs.split_first() {
            found.push(Found { row, path: targets.nodes.path, pair: *pair, hidden: false, behind: behind.to_vec() });
        }
    }
    found
}

/// The pair that the target of a row sees, but for lines that are taken.
fn seen(
    window: &PathWindow<'_>,
    targets: &PathTile<'_>,
    row: usize,
    taken: &Taken,
    rules: &Rules,
    counts: &mut LineCounts,
) -> Option<Pair> {
    let [x, y] = targets.buffer.pixel_of(targets.nodes.rows.sample(row));
    let target = row;
    let t = targets.node([x, y], row);
    let mut seen: Option<Pair> = None;

    // For every neighbour n …
    for segment in window.segments(PixelRect { x0: x, y0: y, x1: x + 1, y1: y + 1 }.grown(rules.reach())) {
        let tile = segment.tile;
        for pixel in (segment.x0..segment.x1).map(|x| [x, segment.y]) {
            for row in tile.nodes.rows.of_pixel(tile.buffer.pixel_number(pixel)) {
                let n = tile.node(pixel, row);
                counts.pairs_tested += 1;

                // … with differ(t, n), as the material of the priority sample tests:
                let fired = fired(rules, (targets, target, &t), (tile, row, &n));
                if fired.is_empty() {
                    continue;
                }
                // the priority sample p: the larger explicit priority, else the shorter depth, else t.
                let own = !n.rank.outranks(t.rank);
                let p = if own { &t } else { &n };
                if taken.contains(&n.features, own) {
                    continue;
                }
                // The pair is valid if |x_t − x_n| < r', which the line's type may have changed.
                let distance_squared = distance_squared(&t, n.pixel, n.offset);
                let radius_squared =
                    rules.types().map_or(p.radius_squared, |types| types.radius_squared_of(fired, p.radius_squared));
                if distance_squared >= radius_squared {
                    continue;
                }
                // Of all valid pairs the seen one minimises −priority_p, depth_p, |x_t − x_n|, index of n.
                let pair = Pair {
                    rank: p.rank,
                    distance_squared,
                    pixel,
                    tile: segment.index as u32,
                    row: row as u32,
                    surface: 0,
                    own,
                };
                if seen.is_none_or(|best| pair.beats(&best)) {
                    seen = Some(pair);
                }
            }
        }
    }
    seen
}
