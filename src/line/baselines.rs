//! Other methods on the same samples, to compare with: `--lines choudhury` and `--lines bauer`.
//!
//! Both know one line style, that of `[lines]` (`color`, `width`), and the camera's nodes only. What counts as different is
//! decided by the same tests. Both are plain loops and slow: they are here to be looked at.
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

use std::collections::HashMap;

use super::pair::{distance_squared, fired};
use super::window::{PathTile, PathWindow};
use super::{Fired, LineCounts, LineNode, Rules, SeenLine};
use crate::math::Vec3;
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
