//! Analytic truth: pictures whose right answer is known by geometry.

use std::f64::consts::PI;

use tusche::film::Layer;

use crate::common::{Picture, render_text};

/// Pictures are this many pixels each way; the orthographic camera shows as many world units.
const SIZE: usize = 256;

fn picture(samples: u32, width: f64, lines: &str, objects: &str) -> Picture {
    let text = format!(
        r#"
        [render]
        size = [{SIZE}, {SIZE}]
        samples = {samples}
        filter = "box"
        filter_radius = 0.5

        [camera]
        projection = "orthographic"
        height = {SIZE}.0
        position = [0.0, 0.0, 100.0]
        target = [0.0, 0.0, 0.0]

        [lines]
        width = {width}
        max_width = 16.0
        {lines}

        {objects}
        "#
    );
    render_text(&text, &[Layer::Line]).0
}

/// The area of the line layer in square pixels: its alpha is the fourth channel.
fn line_area(picture: &Picture) -> f64 {
    picture.mean(3) * (SIZE * SIZE) as f64
}

fn disc(radius: f64) -> String {
    format!("[[objects]]\nshape = \"disc\"\nradius = {radius}\nsegments = 512\nrotate = [90.0, 0.0, 0.0]\n")
}

/// DESIGN section 3.9: how much each side of a straight line is too thin for a half width of `r` pixels.
fn thinning(r: f64, samples: u32) -> f64 {
    0.84 * (3.0 / (4.0 * (2.0 * r).sqrt() * f64::from(samples))).powf(2.0 / 3.0)
}

/// The tolerance that the width compensation promises.
fn tolerance(samples: u32, width: f64) -> f64 {
    match samples {
        16 => 0.04,
        _ if width >= 2.0 => 0.01,
        _ => 0.03,
    }
}

#[test]
fn a_disc_has_the_outline_that_geometry_gives_it() {
    for samples in [16, 64] {
        for width in [0.5, 1.0, 3.0, 8.0] {
            let radius = 90.0;
            let area = line_area(&picture(samples, width, "", &disc(radius)));
            let truth = 2.0 * PI * radius * width;
            let error = (area / truth - 1.0).abs();
            assert!(
                error < tolerance(samples, width),
                "{samples} samples, {width} px: {area:.1} px² drawn, {truth:.1} px² asked for"
            );
        }
    }
}

#[test]
fn without_compensation_lines_are_as_thin_as_predicted() {
    for samples in [16, 64] {
        for width in [1.0, 3.0, 8.0] {
            let radius = 90.0;
            let area = line_area(&picture(samples, width, "width_compensation = false", &disc(radius)));
            let predicted = 2.0 * PI * radius * (width - 2.0 * thinning(width / 2.0, samples));
            let missing = 2.0 * PI * radius * width - area;
            let predicted_missing = 2.0 * PI * radius * width - predicted;
            assert!(missing > 0.0, "the paper's rule draws too thin");
            let error = (area / predicted - 1.0).abs();
            assert!(
                error < 0.15,
                "{samples} samples, {width} px: {area:.1} px² drawn, {predicted:.1} predicted ({missing:.1} missing, \
                 {predicted_missing:.1} predicted)"
            );
        }
    }
}

#[test]
fn a_square_has_the_outline_that_geometry_gives_it_at_any_angle() {
    for (samples, angles) in [(16, &[0, 13, 30, 45][..]), (64, &[13])] {
        for angle in angles {
            for width in [0.5, 1.0, 3.0, 8.0] {
                let side = 170.3;
                let square = format!(
                    "[[objects]]\nshape = \"plane\"\nsize = [{side}, {side}]\nrotate = [90.0, 0.0, {angle}.0]\n\
                     translate = [0.13, 0.41, 0.0]\n"
                );
                let area = line_area(&picture(samples, width, "", &square));
                // Both sides of four edges; outside the corners are round, inside they overlap.
                let truth = 4.0 * side * width + (PI / 4.0 - 1.0) * width * width;
                let error = (area / truth - 1.0).abs();
                assert!(
                    error < tolerance(samples, width),
                    "{samples} samples, {width} px, {angle}°: {area:.1} px² drawn, {truth:.1} px² asked for"
                );
            }
        }
    }
}

#[test]
fn crossing_lines_have_the_area_of_their_union() {
    // Four quarters of the picture, each an object of its own, at one depth.
    let quarters: String = [[-1, -1], [1, -1], [-1, 1], [1, 1]]
        .iter()
        .map(|[x, y]| {
            format!(
                "[[objects]]\nshape = \"plane\"\nsize = [200.0, 200.0]\nrotate = [90.0, 0.0, 0.0]\n\
                 translate = [{:.1}, {:.1}, 0.0]\n",
                f64::from(x * 100) + 0.37,
                f64::from(y * 100) - 0.21
            )
        })
        .collect();
    for (samples, width) in [(16, 3.0), (16, 8.0), (64, 8.0)] {
        let area = line_area(&picture(samples, width, "", &quarters));
        let truth = 2.0 * SIZE as f64 * width - width * width;
        let error = (area / truth - 1.0).abs();
        assert!(error < tolerance(samples, width), "{samples} samples, {width} px: {area:.1} px² for {truth:.1} px²");
    }
}

#[test]
fn a_width_below_the_minimum_is_as_much_more_transparent() {
    let quarter = line_area(&picture(64, 0.25, "min_width = 0.5", &disc(90.0)));
    let truth = 2.0 * PI * 90.0 * 0.25;
    assert!((quarter / truth - 1.0).abs() < 0.03, "{quarter:.1} px² for {truth:.1} px²");
}
