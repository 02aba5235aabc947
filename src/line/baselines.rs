//! Other methods on the same samples, to compare with: `--lines choudhury`, `--lines bauer` and `--lines path`.
//!
//! What counts as different is decided by the same tests. None looks behind first surfaces. The first two know one line
//! style, that of `[lines]` (`color`, `width`), and the camera's nodes only. All are plain loops, and those of the first two
//! slow: they are here to be looked at.
//!
//! **Choudhury and Parker, "Ray Tracing NPR-Style Feature Lines", NPAR 2009.** Around each sample a disc-shaped stencil of M
//! probes; m of them differ; the line's opacity is 1 − |m − M/2| / (M/2), greatest where half of the disc differs, as it
//! does on a single straight edge. Where several edges meet more than half differs, so lines brighten there (OG18 figure
//! 2, left). Published are rings of probe rays, 8 q of them in ring q, which is an even density. Chosen here: the probes
//! are the samples that lie in the disc anyway, which are as evenly spread and cost no rays. The disc's diameter is the
//! line's width.
//!
//! **Bauer, "A New Contour Method for Highly Detailed Geometry", SIGGRAPH 2017 Talks**, as OG18 section 2 describes it: a
//! contour image of sub-pixels is accumulated while samples are taken. Open are its resolution, what is compared, how a
//! contour gets a width, and how it is blended. Chosen here: as many sub-pixels as samples, in a square grid; each takes the
//! sample that came last; one is contour if it differs from the last of the sub-pixel to its right or below; a sub-pixel
//! whose centre lies within half the width of a contour's centre is lined, and with it its samples, opaquely. So lines
//! have the steps of the grid, and edges between samples of one sub-pixel are missed.
//!
//! **West, "Physically-based Feature Line Rendering", TOG 40(6), 2021.** Every segment of every path is surrounded by a cone
//! as wide as the line, in which N rays are traced; where they meet something else, the closest line ends the path: it is all
//! that is seen. A line that no ray meets is missed, so lines come out thinner and fade towards their rims; with more rays
//! they become right. Published are 1 to 16 rays, and 16 to 32 said to do. Chosen here: at every node path N = 16 samples,
//! drawn at random and put back, each as likely, of those that have a node there and lie in the target's disc (the target
//! among them), whose radius is that of the widest line of any node within [`Rules::reach`] pixels of the target's. They are
//! what such rays would meet. All else is DESIGN section 3.2, whose order is that of the closest line, so this is the exact
//! method with N neighbours of many: it never lines a sample that the exact one does not line, at a straight edge it lines
//! 1 − (1 − f)^N of the samples for which a part f of the disc lies beyond, and lines of 16 probes are a fifth too thin,
//! however many samples there are. A target's draws are the same at all its paths, as a ray of a cone keeps its place in
//! the cone when it is mirrored. Next to a wide line a thin one is met by fewer probes. A line that is not opaque shows those
//! of the other probes. The published method traces N + 1 rays for each segment; here those N cost nothing, so times flatter
//! it. [`LineCounts::pairs_tested`] tells how many they would be.

use std::collections::HashMap;

use super::differ::Features;
use super::pair::{Found, MOST_LINES, Pair, Taken, distance_squared, fired, is_opaque};
use super::window::{PathTile, PathWindow};
use super::{Fired, LineCounts, LineNode, Rules, SeenLine};
use crate::math::Vec3;
use crate::sample::position::{mix, step};
use crate::sample::{NodePath, PixelRect};

/// The lines after Choudhury and Parker, by sample.
pub(super) fn choudhury(
    window: &PathWindow<'_>,
    targets: &PathTile<'_>,
    rules: &Rules,
    counts: &mut LineCounts,
) -> Vec<(u32, SeenLine)> {
    let radius = rules.radius(rules.settings().width);
    let radius_squared = radius * radius;
    let mut lines = Vec::new();
    for row in 0..targets.nodes.rows.len() {
        let (mut probes, mut differing) = (0_u32, 0_u32);
        let mut nearest: Option<(f32, SeenLine)> = None;
        let (t, target) = (node_of(targets, row), row);
        visit(window, &t, radius, |n, tile, row| {
            counts.pairs_tested += 1;
            let distance_squared = distance_squared(&t, n.pixel, n.offset);
            if distance_squared >= radius_squared {
                return;
            }
            probes += 1;
            let fired = fired(rules, (targets, target, &t), (tile, row, n));
            if fired.is_empty() {
                return;
            }
            differing += 1;
            if nearest.is_none_or(|(distance, _)| distance_squared < distance) {
                nearest = Some((distance_squared, plain_line(rules, fired, (n.pixel, sample_in_pixel(tile, row)))));
            }
        });
        let half = probes as f32 / 2.0;
        let alpha = 1.0 - (differing as f32 - half).abs() / half;
        if let Some((_, line)) = nearest.filter(|_| alpha > 0.0) {
            lines.push(blended(targets, row, line, alpha));
        }
    }
    lines
}

/// The lines after Bauer, by sample.
pub(super) fn bauer(
    window: &PathWindow<'_>,
    targets: &PathTile<'_>,
    rules: &Rules,
    counts: &mut LineCounts,
) -> Vec<(u32, SeenLine)> {
    let radius = rules.settings().width.min(rules.widest()) / 2.0;
    let side = targets.buffer.samples_per_pixel.isqrt().max(1) as i32;
    let cell = |node: &LineNode| {
        let along = |axis: usize| {
            let within = (node.offset[axis] * side as f32) as i32;
            node.pixel[axis] * side + within.min(side - 1)
        };
        [along(0), along(1)]
    };

    // The contour image as far as it can matter here.
    let mut last: HashMap<[i32; 2], (&PathTile<'_>, usize, LineNode)> = HashMap::new();
    for segment in window.segments(targets.buffer.rect.grown(radius.ceil() as i32 + 1)) {
        for pixel in (segment.x0..segment.x1).map(|x| [x, segment.y]) {
            for row in segment.tile.nodes.rows.of_pixel(segment.tile.buffer.pixel_number(pixel)) {
                let node = segment.tile.node(pixel, row);
                last.insert(cell(&node), (segment.tile, row, node));
            }
        }
    }
    let contour = |at: [i32; 2]| {
        let (tile, row, own) = last.get(&at)?;
        let beside = [[at[0] + 1, at[1]], [at[0], at[1] + 1]];
        let beside = beside.iter().filter_map(|at| last.get(at));
        let fired = beside.map(|(other, n_row, n)| fired(rules, (tile, *row, own), (other, *n_row, n)));
        Some(fired.fold(Fired::empty(), |all, one| all | one)).filter(|fired| !fired.is_empty())
    };

    let reach = (radius * side as f32).ceil() as i32;
    let mut lines = Vec::new();
    for row in 0..targets.nodes.rows.len() {
        let t = node_of(targets, row);
        let [x, y] = cell(&t);
        let mut nearest: Option<(i32, SeenLine)> = None;
        for [dx, dy] in (-reach..=reach).flat_map(|dy| (-reach..=reach).map(move |dx| [dx, dy])) {
            counts.pairs_tested += 1;
            let distance = dx * dx + dy * dy;
            if distance as f32 > (radius * side as f32) * (radius * side as f32)
                || nearest.is_some_and(|(nearest, _)| nearest <= distance)
            {
                continue;
            }
            if let Some(fired) = contour([x + dx, y + dy]) {
                let pixel = [(x + dx).div_euclid(side), (y + dy).div_euclid(side)];
                nearest = Some((distance, plain_line(rules, fired, (pixel, 0))));
            }
        }
        if let Some((_, line)) = nearest {
            lines.push(blended(targets, row, line, rules.alpha(rules.settings().width)));
        }
    }
    lines
}

/// The line after West that each target sees which is not yet `lined`, by its sample.
pub(super) fn path(
    window: &PathWindow<'_>,
    targets: &PathTile<'_>,
    lined: &[bool],
    rules: &Rules,
    probes: u32,
    counts: &mut LineCounts,
) -> Vec<Found> {
    let discs = Discs::new(window, targets, rules);
    let mut found = Vec::new();
    let mut pairs = Vec::new();
    for row in 0..targets.nodes.rows.len() {
        if lined[targets.nodes.rows.sample(row) as usize] {
            continue;
        }
        counts.pairs_tested += u64::from(probes);
        let t = node_of(targets, row);
        let radius_squared = discs.radius_squared(t.pixel);
        if radius_squared <= 0.0 {
            continue;
        }
        let mut draws = Draws::new(&t, sample_in_pixel(targets, row));
        pairs.clear();
        for _ in 0..probes {
            let Some((place, pixel, n_row)) = draws.probe(window, targets, &t, radius_squared) else { continue };
            let Some(tile) = &window.tiles[place] else { continue };
            pairs.extend(valid_pair(rules, (targets, row, &t), (place, tile, n_row, pixel)));
        }

        // The closest; through a line that is not opaque, the next.
        let mut taken = Taken::default();
        let mut seen: Vec<Pair> = Vec::new();
        while seen.len() < MOST_LINES
            && let Some((pair, features)) = closest(&pairs, &taken)
        {
            seen.push(pair);
            let Some(tile) = &window.tiles[pair.tile as usize] else { break };
            if is_opaque(rules, (targets, row), (tile, pair.row as usize), pair.own) {
                break;
            }
            taken.take(&features, pair.own);
        }
        if let Some((pair, behind)) = seen.split_first() {
            found.push(Found { row, path: targets.nodes.path, pair: *pair, hidden: false, behind: behind.to_vec() });
        }
    }
    found
}

/// The pair of a target and a probe, with the probe's features, if it is valid.
fn valid_pair(
    rules: &Rules,
    target: (&PathTile<'_>, usize, &LineNode),
    (place, tile, row, pixel): (usize, &PathTile<'_>, usize, [i32; 2]),
) -> Option<(Pair, Features)> {
    let t = target.2;
    let n = tile.node(pixel, row);
    let fired = fired(rules, target, (tile, row, &n));
    let own = !n.rank.outranks(t.rank);
    let p = if own { t } else { &n };
    let distance_squared = distance_squared(t, pixel, n.offset);
    let radius_squared =
        rules.types().map_or(p.radius_squared, |types| types.radius_squared_of(fired, p.radius_squared));
    let (tile, row) = (place as u32, row as u32);
    let pair = Pair { rank: p.rank, distance_squared, pixel, tile, row, surface: 0, own };
    (!fired.is_empty() && distance_squared < radius_squared).then_some((pair, n.features))
}

/// The pair that is seen of those whose lines are not taken.
fn closest(pairs: &[(Pair, Features)], taken: &Taken) -> Option<(Pair, Features)> {
    let left = pairs.iter().filter(|(pair, features)| !taken.contains(features, pair.own));
    left.copied().reduce(|best, other| if other.0.beats(&best.0) { other } else { best })
}

/// How wide the discs are in which targets look for lines.
struct Discs {
    rect: PixelRect,
    /// For each pixel, row by row.
    radii_squared: Vec<f32>,
}

impl Discs {
    /// Those of a tile's pixels.
    fn new(window: &PathWindow<'_>, targets: &PathTile<'_>, rules: &Rules) -> Self {
        let (rect, reach) = (targets.buffer.rect, rules.reach());
        let around = rect.grown(reach);
        let (columns, wide) = (rect.width() as usize, around.width() as usize);
        let side = 2 * reach as usize + 1;
        let mut own = vec![0.0_f32; around.pixels()];
        for (_, tile) in window.tiles_in(around) {
            for pixel in &tile.bounds.pixels {
                let [x, y] = pixel.pixel;
                if around.contains(x, y) {
                    own[(y - around.y0) as usize * wide + (x - around.x0) as usize] = pixel.bounds.radius_squared;
                }
            }
        }
        // The widest of a square around each pixel: along rows, then along columns.
        let widest = |radii: &mut dyn Iterator<Item = f32>| radii.fold(0.0, f32::max);
        let along_rows: Vec<f32> = own
            .chunks(wide.max(1))
            .flat_map(|row| row.windows(side).map(|part| widest(&mut part.iter().copied())))
            .collect();
        let radii_squared = (0..rect.pixels())
            .map(|pixel| widest(&mut along_rows[pixel..].iter().step_by(columns).take(side).copied()))
            .collect();
        Self { rect, radii_squared }
    }

    fn radius_squared(&self, [x, y]: [i32; 2]) -> f32 {
        self.radii_squared[(y - self.rect.y0) as usize * self.rect.width() as usize + (x - self.rect.x0) as usize]
    }
}

/// The random numbers of a target.
struct Draws {
    key: u32,
    drawn: u32,
}

impl Draws {
    /// Most draws for a probe. Of those that fall on samples beside the disc, or without a node, half a dozen are usual.
    const MOST: u32 = 64;

    /// They depend on the target's place on the film, so on the seed and the stratum, and on nothing that tiles change.
    fn new(t: &LineNode, sample: u32) -> Self {
        let place = mix(t.offset[0].to_bits(), t.offset[1].to_bits(), sample);
        Self { key: mix(t.pixel[0] as u32, t.pixel[1] as u32, place), drawn: 0 }
    }

    /// One of 0 … `count`, `count` excluded.
    fn below(&mut self, count: u32) -> u32 {
        let bits = step(self.key ^ step(self.drawn));
        self.drawn += 1;
        ((u64::from(bits) * u64::from(count)) >> 32) as u32
    }

    /// One of the nodes in a target's disc: the place of its tile in the window, its pixel and its row. `None` where there
    /// are too few to be found.
    fn probe(
        &mut self,
        window: &PathWindow<'_>,
        targets: &PathTile<'_>,
        t: &LineNode,
        radius_squared: f32,
    ) -> Option<(usize, [i32; 2], usize)> {
        let radius = radius_squared.sqrt();
        let samples = targets.buffer.samples_per_pixel;
        for _ in 0..Self::MOST {
            let pixel = [0, 1].map(|axis| {
                let [low, high] = [-radius, radius].map(|end| (t.offset[axis] + end).floor() as i32);
                t.pixel[axis] + low + self.below((high - low) as u32 + 1) as i32
            });
            let sample = self.below(samples);
            let Some((place, tile)) = window.tile_of(pixel) else { continue };
            let number = tile.buffer.pixel_number(pixel);
            let Some(row) = tile.nodes.row_in_pixel(number, number as u32 * samples + sample) else { continue };
            if distance_squared(t, pixel, tile.offset(row)) < radius_squared {
                return Some((place, pixel, row));
            }
        }
        None
    }
}

fn node_of(targets: &PathTile<'_>, row: usize) -> LineNode {
    targets.node(targets.buffer.pixel_of(targets.nodes.rows.sample(row)), row)
}

/// Calls `visit` for every node within some pixels of a target.
fn visit(window: &PathWindow<'_>, t: &LineNode, radius: f32, mut visit: impl FnMut(&LineNode, &PathTile<'_>, usize)) {
    let [x, y] = t.pixel;
    let stencil = PixelRect { x0: x, y0: y, x1: x + 1, y1: y + 1 }.grown(radius.ceil() as i32);
    for segment in window.segments(stencil) {
        for pixel in (segment.x0..segment.x1).map(|x| [x, segment.y]) {
            for row in segment.tile.nodes.rows.of_pixel(segment.tile.buffer.pixel_number(pixel)) {
                visit(&segment.tile.node(pixel, row), segment.tile, row);
            }
        }
    }
}

fn sample_in_pixel(tile: &PathTile<'_>, row: usize) -> u32 {
    tile.nodes.rows.sample(row) % tile.buffer.samples_per_pixel
}

/// The one line that there is.
fn plain_line(rules: &Rules, fired: Fired, neighbor: ([i32; 2], u32)) -> SeenLine {
    SeenLine {
        covers: false,
        color: rules.settings().color.to_array(),
        alpha: 1.0,
        lined: [0.0; 3],
        path: NodePath::CAMERA,
        fired,
        neighbor,
        own: true,
        hidden: false,
    }
}

fn blended(targets: &PathTile<'_>, row: usize, line: SeenLine, alpha: f32) -> (u32, SeenLine) {
    let sample = targets.nodes.rows.sample(row);
    let before = Vec3::from(targets.buffer.color.get(sample as usize));
    let lined = before * (1.0 - alpha) + Vec3::from(line.color) * alpha;
    (sample, SeenLine { alpha, lined: lined.to_array(), ..line })
}
