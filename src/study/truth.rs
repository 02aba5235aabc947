//! How much the lines that a scene declares cover of each pixel, by geometry.
//!
//! A line is all that is within half its width of a straight piece. Such a stadium is convex, so a horizontal scanline meets it in one
//! interval, whose part of a pixel's filter is known exactly. What is left is the integral over y, for which every row of pixels is cut
//! into `SCANLINES`. Coverage is then within 1e-3 where an edge runs along the rows, and within 1e-4 elsewhere.

use crate::film::Filter;
use crate::math::DVec2;
use crate::scene::camera::Camera;
use crate::scene::truth::Truth;

/// Scanlines in a row of pixels.
const SCANLINES: usize = 256;
/// Entries of the filter's integral per pixel.
const STEPS: f64 = 4096.0;

/// The coverage of each pixel of a picture of `size` pixels through a pixel filter, row by row. What is not before the camera
/// covers nothing.
#[must_use]
pub fn coverage(truth: &Truth, camera: &Camera, size: [u32; 2], filter: &Filter) -> Vec<f32> {
    let [width, height] = size.map(|side| side as usize);
    let mut scanlines: Vec<Vec<[f64; 2]>> = vec![Vec::new(); height * SCANLINES];
    for curve in &truth.curves {
        let points = curve.shape.on_film(camera, size).unwrap_or_default();
        points.windows(2).for_each(|pair| add(&mut scanlines, pair[0], pair[1], curve.width / 2.0));
    }
    let integral = Integral::new(filter);
    let reach = filter.reach().max(0) as usize;
    let across: Vec<f64> = (0..width).map(|x| integral.between(x, [0.0, width as f64])).collect();
    let mut sums = vec![0.0; width * height];
    let mut weights = vec![0.0; height];
    let mut row = vec![0.0; width];
    for (number, intervals) in scanlines.iter_mut().enumerate() {
        row.fill(0.0);
        for [from, to] in merged(intervals) {
            let [from, to] = [from.max(0.0), to.min(width as f64)];
            if from < to {
                let first = (from as usize).saturating_sub(reach);
                let last = (to as usize + reach + 1).min(width);
                (first..last).for_each(|x| row[x] += integral.between(x, [from, to]));
            }
        }
        let y = (number as f64 + 0.5) / SCANLINES as f64;
        let around = (number / SCANLINES).saturating_sub(reach)..(number / SCANLINES + reach + 1).min(height);
        for pixel in around {
            let weight = f64::from(filter.weight((y - pixel as f64 - 0.5) as f32));
            weights[pixel] += weight;
            if !intervals.is_empty() {
                let sums = &mut sums[pixel * width..(pixel + 1) * width];
                sums.iter_mut().zip(&row).for_each(|(sum, part)| *sum += weight * part);
            }
        }
    }
    let share = |(i, sum): (usize, &f64)| (sum / (weights[i / width] * across[i % width])) as f32;
    sums.iter().enumerate().map(share).collect()
}

/// Adds what is within `radius` of a straight piece to the scanlines that meet it.
fn add(scanlines: &mut [Vec<[f64; 2]>], a: DVec2, b: DVec2, radius: f64) {
    let number = |y: f64| y * SCANLINES as f64 - 0.5;
    let first = number(a.y.min(b.y) - radius).ceil().max(0.0) as usize;
    let last = (number(a.y.max(b.y) + radius).floor() + 1.0).clamp(0.0, scanlines.len() as f64) as usize;
    let side = (b - a).perp().try_normalize().unwrap_or(DVec2::ZERO) * radius;
    let corners = [a + side, b + side, b - side, a - side];
    for (number, intervals) in scanlines.iter_mut().enumerate().take(last).skip(first) {
        let y = (number as f64 + 0.5) / SCANLINES as f64;
        let mut interval = [f64::INFINITY, f64::NEG_INFINITY];
        let mut take = |x: f64| interval = [interval[0].min(x), interval[1].max(x)];
        for end in [a, b] {
            let half = (radius * radius - (y - end.y) * (y - end.y)).sqrt();
            if half >= 0.0 {
                take(end.x - half);
                take(end.x + half);
            }
        }
        for (i, from) in corners.iter().enumerate() {
            let to = corners[(i + 1) % 4];
            if (from.y <= y) != (to.y <= y) {
                take(from.x + (y - from.y) / (to.y - from.y) * (to.x - from.x));
            }
        }
        if interval[0] < interval[1] {
            intervals.push(interval);
        }
    }
}

/// The union of intervals, as intervals that do not touch.
fn merged(intervals: &mut [[f64; 2]]) -> Vec<[f64; 2]> {
    intervals.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
    let mut union: Vec<[f64; 2]> = Vec::new();
    for interval in intervals.iter() {
        match union.last_mut() {
            Some(last) if interval[0] <= last[1] => last[1] = last[1].max(interval[1]),
            _ => union.push(*interval),
        }
    }
    union
}

/// The integral of a filter along one axis, from its left end.
struct Integral {
    reach: f64,
    sums: Vec<f64>,
}

impl Integral {
    fn new(filter: &Filter) -> Self {
        let reach = f64::from(filter.reach()) + 0.5;
        let steps = (2.0 * reach * STEPS) as usize;
        let mut sums = vec![0.0];
        let mut sum = 0.0;
        for step in 0..steps {
            let middle = (step as f64 + 0.5) / STEPS - reach;
            sum += f64::from(filter.weight(middle as f32)) / STEPS;
            sums.push(sum);
        }
        Self { reach, sums }
    }

    /// From one place to another, of the filter of a pixel in that column.
    fn between(&self, column: usize, [from, to]: [f64; 2]) -> f64 {
        let center = column as f64 + 0.5;
        self.up_to(to - center) - self.up_to(from - center)
    }

    fn up_to(&self, x: f64) -> f64 {
        let place = ((x + self.reach) * STEPS).clamp(0.0, (self.sums.len() - 1) as f64);
        let step = (place as usize).min(self.sums.len() - 2);
        self.sums[step] + (place - step as f64) * (self.sums[step + 1] - self.sums[step])
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::math::DVec3;
    use crate::scene::camera::Projection;
    use crate::scene::settings::FilterKind;
    use crate::scene::truth::{TruthCurve, TruthShape};

    const SIZE: [u32; 2] = [40, 30];

    fn covered(curves: Vec<TruthCurve>, filter: &Filter) -> Vec<f64> {
        let view = Projection::Orthographic { height: 2.0 };
        let camera = Camera::look_at("c", view, DVec3::Z, DVec3::ZERO, DVec3::Y).expect("a good camera");
        let truth = Truth { curves, span: None };
        coverage(&truth, &camera, SIZE, filter).into_iter().map(f64::from).collect()
    }

    fn filters() -> [Filter; 5] {
        [
            Filter::new(FilterKind::Box, 0.5),
            Filter::new(FilterKind::Tent, 1.0),
            Filter::new(FilterKind::Gaussian, 1.5),
            Filter::new(FilterKind::Mitchell, 2.0),
            Filter::new(FilterKind::BlackmanHarris, 1.5),
        ]
    }

    fn ring(radius: f64, width: f64) -> TruthCurve {
        TruthCurve { shape: TruthShape::FilmCircle { center: DVec2::new(20.3, 14.6), radius }, width }
    }

    #[test]
    fn a_ring_has_the_area_of_a_ring_through_any_filter() {
        for filter in filters() {
            // Only of these do the weights of all pixels add up to the same everywhere.
            let is_even = matches!(filter.kind(), FilterKind::Box | FilterKind::Tent);
            let tolerance = if is_even { 2e-4 } else { 5e-3 };
            for (radius, width) in [(9.0, 0.5), (9.0, 3.0), (2.0, 8.0)] {
                let area: f64 = covered(vec![ring(radius, width)], &filter).iter().sum();
                let [outer, inner] = [radius + width / 2.0, f64::max(radius - width / 2.0, 0.0)];
                let truth = PI * (outer * outer - inner * inner);
                assert!((area / truth - 1.0).abs() < tolerance, "{:?}: {area} for {truth}", filter.kind());
            }
        }
    }

    #[test]
    fn a_box_filter_gives_the_part_of_the_pixel() {
        let edge = |points: [[f64; 2]; 2], width: f64| TruthCurve {
            shape: TruthShape::Film(points.map(DVec2::from).to_vec()),
            width,
        };
        let filter = Filter::new(FilterKind::Box, 0.5);
        let upright = covered(vec![edge([[10.25, -9.0], [10.25, 99.0]], 1.0)], &filter);
        for row in upright.chunks(40) {
            let parts = [row[8], row[9], row[10], row[11]];
            let expected = [0.0, 0.25, 0.75, 0.0];
            assert!(parts.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5), "{parts:?}");
        }
        let level = covered(vec![edge([[-9.0, 7.5], [99.0, 7.5]], 2.0)], &filter);
        for (y, expected) in [(5, 0.0), (6, 0.5), (7, 1.0), (8, 0.5), (9, 0.0)] {
            assert!((level[y * 40 + 20] - expected).abs() < 2e-3, "row {y}: {}", level[y * 40 + 20]);
        }
        // A diagonal through corners cuts pixels into halves but for its width.
        let diagonal = covered(vec![edge([[-9.0, -9.0], [99.0, 99.0]], 0.5)], &filter);
        let cut = 1.0 - 0.25 * 2.0_f64.sqrt();
        assert!((diagonal[12 * 40 + 12] - (1.0 - cut * cut)).abs() < 1e-4, "{}", diagonal[12 * 40 + 12]);
    }

    #[test]
    fn lines_that_cover_each_other_are_one() {
        for filter in filters() {
            let once = covered(vec![ring(9.0, 3.0)], &filter);
            assert_eq!(covered(vec![ring(9.0, 3.0), ring(9.0, 3.0), ring(9.0, 1.0)], &filter), once);
            let all = covered(vec![ring(1.0, 200.0)], &filter);
            assert!(all.iter().all(|part| (part - 1.0).abs() < 1e-6), "at borders too: {:?}", &all[..3]);
        }
    }
}
