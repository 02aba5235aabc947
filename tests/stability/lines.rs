//! Lines at the borders of their thresholds and widths, on hand-made samples.

use tusche::math::portable;
use tusche::sample::{Node, PixelRect};
use tusche::scene::settings::LineSettings;

use super::Case;
use crate::line::picture::covered_area;

pub const CASES: &[Case] = &[
    Case {
        name: "features that differ by exactly the threshold, and by one float more",
        wrong: "lines that come and go with rounding",
        unit: "thresholds with a wrong answer",
        bound: 0.0,
        figure: feature_threshold,
    },
    Case {
        name: "uv that differ by exactly the threshold, and by one float more",
        wrong: "lines that come and go with rounding",
        unit: "thresholds with a wrong answer",
        bound: 0.0,
        figure: uv_threshold,
    },
    Case {
        name: "equal normals at a threshold of 0°, right angles at 90°, opposite ones at 180°",
        wrong: "lines all over smooth surfaces",
        unit: "wrong answers",
        bound: 0.0,
        figure: normal_threshold,
    },
    Case {
        name: "line widths 0.4999, 0.5 and 0.5001",
        wrong: "lines that jump when they grow thin",
        unit: "largest jump of the inked area, relative",
        bound: 1e-2,
        figure: around_the_minimum,
    },
    Case {
        name: "line widths from 1e-30 to 1e-3",
        wrong: "lines that never fade, or NaN",
        unit: "inked area beyond that of the width, in pixels a pixel",
        bound: 1e-3,
        figure: thinnest,
    },
];

const RECT: PixelRect = PixelRect { x0: 0, y0: 0, x1: 24, y1: 24 };

/// The inked area around a slanted edge between two nodes.
fn area(settings: &LineSettings, left: Node, right: Node) -> f64 {
    covered_area(RECT, settings, 16, &|[x, y]| if x + 0.3 * y < 14.0 { left } else { right })
}

fn node() -> Node {
    Node { object: 1, member: 1, shader: 1, depth: 1.0, line_width: 2.0, priority: 0, ..Node::default() }
}

fn only(change: impl FnOnce(&mut LineSettings)) -> LineSettings {
    let mut settings = LineSettings { object: false, shader: false, ..LineSettings::default() };
    change(&mut settings);
    settings
}

const THRESHOLDS: [f32; 7] = [0.0, 1e-30, 0.1, 0.25, 1.0 / 3.0, 1.0, 1e6];

fn feature_threshold() -> f64 {
    let wrong = THRESHOLDS.into_iter().filter(|&threshold| {
        let settings = only(|settings| settings.feature = Some(threshold));
        let at = |value: f32| area(&settings, node(), Node { feature: [0.0, value, 0.0], ..node() });
        at(threshold) != 0.0 || at(-threshold) != 0.0 || at(threshold.next_up()) <= 0.0
    });
    wrong.count() as f64
}

fn uv_threshold() -> f64 {
    // A distance is a root of squares: squares that are exact, and steps that survive them.
    let thresholds = [0.0, 0.25, 0.5, 1.0, 4.0_f32];
    let wrong = thresholds.into_iter().filter(|&threshold| {
        let settings = only(|settings| settings.uv = Some(threshold));
        let at = |value: f32| area(&settings, node(), Node { uv: [value, 0.0], ..node() });
        let more = if threshold == 0.0 { 1e-6 } else { threshold * (1.0 + 4.0 * f32::EPSILON) };
        at(threshold) != 0.0 || at(more) <= 0.0
    });
    wrong.count() as f64
}

fn normal_threshold() -> f64 {
    let at = |degrees: f32, a: [f32; 3], b: [f32; 3]| {
        let settings = only(|settings| settings.normal = Some(degrees));
        area(&settings, Node { normal: a, ..node() }, Node { normal: b, ..node() }) > 0.0
    };
    let z = [0.0, 0.0, 1.0];
    let turned = |degrees: f32| {
        let angle = degrees.to_radians();
        [portable::sin(angle), 0.0, portable::cos(angle)]
    };
    // A normal that rounding leaves a bit short or long is still equal to itself.
    let rough = [0.577_350_3, 0.577_350_3, 0.577_350_2];
    let answers = [
        (at(0.0, z, z), false),
        (at(0.0, rough, rough), false),
        (at(90.0, z, [1.0, 0.0, 0.0]), false),
        (at(180.0, z, [0.0, 0.0, -1.0]), false),
        (at(89.9, z, [1.0, 0.0, 0.0]), true),
        (at(179.0, z, [0.0, 0.0, -1.0]), true),
        (at(0.0, z, turned(0.5)), true),
        (at(1.0, z, turned(1.01)), true),
        (at(1.0, z, turned(0.99)), false),
    ];
    answers.iter().filter(|(found, expected)| found != expected).count() as f64
}

fn inked(width: f32) -> f64 {
    area(
        &LineSettings::default(),
        Node { line_width: width, ..node() },
        Node { object: 2, line_width: width, ..node() },
    )
}

fn around_the_minimum() -> f64 {
    let [below, at, above] = [0.4999, 0.5, 0.5001].map(inked);
    ((above - at).abs().max((at - below).abs())) / at
}

fn thinnest() -> f64 {
    // The edge is about 25 pixels long.
    [1e-30_f32, 1e-10, 1e-3].map(|width| inked(width) / 25.0 - 2.0 * f64::from(width)).into_iter().fold(0.0, f64::max)
}
