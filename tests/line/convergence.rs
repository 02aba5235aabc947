//! How fast the coverage of lines comes near the truth as samples grow (DESIGN sections 3.9 and 9).

use std::fmt::Write as _;

use tusche::sample::{Node, PixelRect};
use tusche::scene::settings::LineSettings;

use super::picture::covered_by_pixel;
use crate::common::{golden, root};

const SIDE: i32 = 48;
/// Where the edge goes through, its normal, and how wide its line is.
const CENTER: [f64; 2] = [24.3, 23.6];
const ANGLE: f64 = 13.0_f64;
const WIDTH: f64 = 2.0;

/// The signed distance of a point from the edge.
fn distance(x: f64, y: f64) -> f64 {
    let (sin, cos) = ANGLE.to_radians().sin_cos();
    (x - CENTER[0]) * cos + (y - CENTER[1]) * sin
}

/// The part of the unit square at (x, y) that lies within `below` of the edge on its far side: distance < `below`.
fn area_below(x: f64, y: f64, below: f64) -> f64 {
    let corners = [[x, y], [x + 1.0, y], [x + 1.0, y + 1.0], [x, y + 1.0]];
    let mut inside = Vec::new();
    for (index, a) in corners.iter().enumerate() {
        let b = corners[(index + 1) % 4];
        let (da, db) = (distance(a[0], a[1]) - below, distance(b[0], b[1]) - below);
        if da < 0.0 {
            inside.push(*a);
        }
        if (da < 0.0) != (db < 0.0) {
            let t = da / (da - db);
            inside.push([a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]);
        }
    }
    let doubled: f64 = (0..inside.len())
        .map(|i| {
            let (a, b) = (inside[i], inside[(i + 1) % inside.len()]);
            a[0] * b[1] - b[0] * a[1]
        })
        .sum();
    doubled / 2.0
}

/// Root mean square of the error of a pixel's coverage, over the pixels that the line touches, and its mean.
fn error(samples: u32) -> [f64; 2] {
    let settings = LineSettings { width: WIDTH as f32, ..LineSettings::default() };
    let node = |[x, y]: [f32; 2]| Node {
        object: if distance(x.into(), y.into()) < 0.0 { 1 } else { 2 },
        shader: 1,
        depth: 1.0,
        line_width: WIDTH as f32,
        priority: 0,
        ..Node::default()
    };
    let rect = PixelRect { x0: 0, y0: 0, x1: SIDE, y1: SIDE };
    let covered = covered_by_pixel(rect, &settings, samples, &node);
    let (mut squares, mut sum, mut count) = (0.0, 0.0, 0.0);
    for y in 0..SIDE {
        for x in 0..SIDE {
            let (px, py) = (f64::from(x), f64::from(y));
            let truth = area_below(px, py, WIDTH / 2.0) - area_below(px, py, -WIDTH / 2.0);
            let found = covered[(y * SIDE + x) as usize];
            if truth > 0.0 || found > 0.0 {
                squares += (found - truth) * (found - truth);
                sum += found - truth;
                count += 1.0;
            }
        }
    }
    [f64::sqrt(squares / count), sum / count]
}

/// The slope of a line through points, by least squares.
fn slope(points: &[[f64; 2]]) -> f64 {
    let count = points.len() as f64;
    let mean = |axis: usize| points.iter().map(|point| point[axis]).sum::<f64>() / count;
    let (x, y) = (mean(0), mean(1));
    let product: f64 = points.iter().map(|point| (point[0] - x) * (point[1] - y)).sum();
    product / points.iter().map(|point| (point[0] - x) * (point[0] - x)).sum::<f64>()
}

#[test]
fn the_error_of_coverage_falls_as_stratified_sampling_predicts() {
    let counts = [4, 16, 64, 256, 1024];
    let errors = counts.map(error);
    let mut table = "samples,rmse,mean\n".to_owned();
    for (count, [rmse, mean]) in counts.iter().zip(&errors) {
        let _ = writeln!(table, "{count},{rmse:.4},{mean:.4}");
    }
    let points: Vec<_> =
        counts.iter().zip(&errors).map(|(count, [rmse, _])| [f64::from(*count).ln(), rmse.ln()]).collect();
    let slope = slope(&points);
    // Pure jitter of the border between in and out gives −3/4; where the border lies depends on the nearest sample across
    // the edge, whose gap has a spread of N^(−2/3) (DESIGN section 3.9). Random samples would give −1/2.
    assert!((-0.80..-0.62).contains(&slope), "the slope is {slope:.3}:\n{table}");
    for [_, mean] in errors {
        assert!(mean.abs() < 0.02, "compensated lines are as wide as asked:\n{table}");
    }
    golden(&root().join("tests/golden/line/convergence.csv"), &table);
}
