//! Analytic truth: the area that lines cover is known.

use tusche::sample::{Node, PixelRect};
use tusche::scene::settings::LineSettings;

use super::picture::covered_area;

const PICTURE: PixelRect = PixelRect { x0: 0, y0: 0, x1: 96, y1: 96 };
const CENTER: [f64; 2] = [48.3, 47.6];

fn settings(compensated: bool) -> LineSettings {
    LineSettings { max_width: 8.0, width_compensation: compensated, ..Default::default() }
}

fn hit(object: u32, depth: f32, line_width: f32) -> Node {
    Node { object, shader: object, depth, line_width, priority: 0, ..Node::default() }
}

/// A disc, in no more of a picture than its line needs.
fn disc(radius: f64, width: f32, samples: u32, settings: &LineSettings) -> f64 {
    let inside = |[x, y]: [f32; 2]| (f64::from(x) - CENTER[0]).hypot(f64::from(y) - CENTER[1]) < radius;
    let margin = (radius + 12.0) as i32;
    let rect = PixelRect { x0: 48 - margin, y0: 48 - margin, x1: 48 + margin, y1: 48 + margin }.intersection(&PICTURE);
    covered_area(rect, settings, samples, &|at| if inside(at) { hit(1, 1.0, width) } else { Node::default() })
}

/// A straight edge at an angle: the width of its line, on average over where it lies in its pixels (which matters where
/// it runs along their rows or columns).
fn edge(degrees: f64, width: f32, samples: u32, settings: &LineSettings) -> f64 {
    let phases = if degrees % 90.0 == 0.0 { 4 } else { 2 };
    let (sin, cos) = degrees.to_radians().sin_cos();
    let rect = PixelRect { x0: 0, y0: 0, x1: 80, y1: 48 };
    let drawn = (0..phases).map(|phase| {
        let shift = f64::from(phase) / f64::from(phases);
        let [x0, y0] = [40.03 + shift * sin.abs(), 24.03 + shift * cos.abs()];
        let nearer = |[x, y]: [f32; 2]| (f64::from(x) - x0) * sin - (f64::from(y) - y0) * cos > 0.0;
        // The whole picture recedes, so that on either side some neighbours outrank the target.
        let node = |at: [f32; 2]| hit(1 + u32::from(nearer(at)), 1.0 + at[0] / 64.0, width);
        // Both ends are cut by parallel sides, so the area is that of a parallelogram.
        covered_area(rect, settings, samples, &node) / edge_length(rect, [x0, y0], [cos, sin])
    });
    drawn.sum::<f64>() / f64::from(phases)
}

/// How much of the line through a point lies in a rectangle.
fn edge_length(rect: PixelRect, point: [f64; 2], direction: [f64; 2]) -> f64 {
    let (low, high) = ([rect.x0, rect.y0].map(f64::from), [rect.x1, rect.y1].map(f64::from));
    let (mut from, mut to) = (f64::NEG_INFINITY, f64::INFINITY);
    for axis in 0..2 {
        if direction[axis] != 0.0 {
            let [a, b] = [low[axis], high[axis]].map(|side| (side - point[axis]) / direction[axis]);
            (from, to) = (from.max(a.min(b)), to.min(a.max(b)));
        }
    }
    to - from
}

/// Mean gap per side, DESIGN section 3.9.
fn gap(half_width: f64, samples: u32) -> f64 {
    0.84 * (3.0 / (4.0 * (2.0 * half_width).sqrt() * f64::from(samples))).powf(2.0 / 3.0)
}

fn tolerance(width: f32, samples: u32) -> f64 {
    match samples {
        16 => 0.04,
        _ if width < 2.0 => 0.03,
        _ => 0.01,
    }
}

#[test]
fn a_disc_has_an_outline_of_the_asked_width_on_both_sides() {
    let settings = settings(true);
    for samples in [16, 64] {
        for width in [0.5, 1.0, 3.0, 8.0] {
            let radius = if width > 4.0 { 20.0 } else { 30.0 };
            let asked = std::f64::consts::TAU * radius * f64::from(width);
            let ratio = disc(radius, width, samples, &settings) / asked;
            println!("disc, {samples} samples, {width} px: drawn / asked {ratio:.4}");
            assert!((ratio - 1.0).abs() < tolerance(width, samples), "{samples} samples, {width} px: {ratio}");
        }
    }
}

#[test]
fn a_straight_edge_has_the_asked_width_at_any_angle() {
    let settings = settings(true);
    for samples in [16, 64] {
        for width in [0.5, 1.0, 3.0, 8.0] {
            for degrees in [0.0, 13.0, 45.0, 76.5, 90.0] {
                let ratio = edge(degrees, width, samples, &settings) / f64::from(width);
                println!("edge at {degrees}°, {samples} samples, {width} px: drawn / asked {ratio:.4}");
                assert!((ratio - 1.0).abs() < tolerance(width, samples), "{degrees}°, {samples}, {width} px: {ratio}");
            }
        }
    }
}

#[test]
fn without_compensation_lines_thin_as_predicted() {
    let settings = settings(false);
    for samples in [16, 64] {
        for width in [0.5, 1.0, 3.0, 8.0] {
            let thinning = f64::from(width) - edge(13.0, width, samples, &settings);
            let predicted = 2.0 * gap(f64::from(width) / 2.0, samples);
            println!("{samples} samples, {width} px: thinner by {thinning:.4}, predicted {predicted:.4}");
            assert!((thinning / predicted - 1.0).abs() < 0.15, "{samples}, {width} px: {thinning}, not {predicted}");
        }
    }
}

/// The table of DESIGN section 3.9; its last column would take long.
#[test]
fn without_compensation_lines_are_as_wide_as_measured_elsewhere() {
    let settings = settings(false);
    for (width, measured) in [
        (0.5, [0.03, 0.20, 0.40]),
        (1.0, [0.38, 0.79, 0.91]),
        (2.0, [1.61, 1.83, 1.93]),
        (4.0, [3.72, 3.86, 3.94]),
        (8.0, [7.75, 7.89, 7.96]),
    ] {
        for (samples, measured) in [4, 16, 64].into_iter().zip(measured) {
            let drawn = edge(13.0, width, samples, &settings);
            assert!((drawn - measured).abs() < 0.05, "{width} px, {samples} samples: {drawn}, not {measured}");
        }
    }
}

/// OG18 figure 2: where lines cross, nothing brightens and nothing counts twice.
#[test]
fn crossing_lines_have_the_area_of_their_union() {
    let (rect, center) = (PixelRect { x0: 0, y0: 0, x1: 64, y1: 64 }, [32.21, 31.87]);
    let side = |[x, y]: [f32; 2], degrees: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        (f64::from(x) - center[0]) * sin - (f64::from(y) - center[1]) * cos > 0.0
    };
    for [first, second] in [[13.0, 76.5], [25.0, 60.0]] {
        for width in [3.0, 8.0_f32] {
            let node = |at: [f32; 2]| Node {
                shader: 1 + u32::from(side(at, second)),
                ..hit(1 + u32::from(side(at, first)), 1.0, width)
            };
            let drawn = covered_area(rect, &settings(true), 16, &node);
            let length = |degrees: f64| {
                let (sin, cos) = degrees.to_radians().sin_cos();
                edge_length(rect, center, [cos, sin])
            };
            let wide = f64::from(width);
            let union = wide * (length(first) + length(second)) - wide * wide / (second - first).to_radians().sin();
            assert!((drawn / union - 1.0).abs() < 0.01, "{first}° and {second}°, {width} px: {drawn}, not {union}");
        }
    }
}

/// The nearer disc's line is whole; the farther disc's ends where the nearer disc begins.
#[test]
fn a_disc_covers_the_line_of_the_disc_behind_it() {
    let (rect, width) = (PixelRect { x0: 0, y0: 0, x1: 80, y1: 64 }, 3.0_f32);
    // Signed distances to the edges.
    let near = |x: f64, y: f64| (x - 30.3).hypot(y - 30.9) - 18.0;
    let far = |x: f64, y: f64| (x - 46.7).hypot(y - 34.2) - 22.0;
    let node = |[x, y]: [f32; 2]| match (f64::from(x), f64::from(y)) {
        (x, y) if near(x, y) < 0.0 => hit(1, 1.0, width),
        (x, y) if far(x, y) < 0.0 => hit(2, 2.0, width),
        _ => Node::default(),
    };
    let drawn = covered_area(rect, &settings(true), 64, &node);

    let (step, half) = (0.05, f64::from(width) / 2.0);
    let places = |pixels: i32| (0..).map(|i| (f64::from(i) + 0.5) * step).take_while(move |&x| x < f64::from(pixels));
    let lined = |x, y| near(x, y).abs() < half || (near(x, y) > 0.0 && far(x, y).abs() < half);
    let count: usize = places(rect.y1).map(|y| places(rect.x1).filter(|&x| lined(x, y)).count()).sum();
    let expected = count as f64 * step * step;
    assert!((drawn / expected - 1.0).abs() < 0.01, "{drawn}, not {expected}");
}

/// OG18 section 3.5: a line of half the minimum width is as wide as that, and half transparent.
#[test]
fn below_the_minimum_width_lines_fade() {
    let settings = settings(true);
    let [half, whole] = [0.25, 0.5].map(|width| edge(13.0, width, 16, &settings));
    assert_eq!(half * 2.0, whole);
    assert!((half / 0.25 - 1.0).abs() < 0.04, "{half}");
}
