//! Pixel filters: how much a sample counts for a pixel.
//!
//! A filter is the product of the same even function along x and along y, evaluated at the true distance between the
//! sample and the pixel's centre. What the hot loop asks for is the function at all pixels that one sample reaches, and
//! that depends only on the sample's offset inside its own pixel. So rows of weights, one weight for each pixel in
//! reach, are tabulated over the offset and read with linear interpolation: the cost is the same for every kind, and
//! nothing is taken from the machine's C library. Kinks and jumps of the function lie on entries of the table, which
//! is why radii are rounded to multiples of the table's step: box and tent are exact, and the others differ from their
//! formulas by less than 1e-5 of the peak from radius 1 up.

use std::f32::consts::PI;

use crate::math::{Vec4, portable};
use crate::scene::settings::FilterKind;

/// Entries of the table per pixel. Even, so that the pixel's centre lies on one.
const STEPS: usize = 512;

/// Weights in a group: a SIMD register.
pub(super) const GROUP: usize = 4;

/// A separable reconstruction filter.
#[derive(Clone, Debug, PartialEq)]
pub struct Filter {
    kind: FilterKind,
    radius: f32,
    reach: i32,
    /// For each step of the offset, for each group of pixels in reach: the weights at the start of the step, and their
    /// rise over it. The pixels go from −reach to +reach; the last group is filled up with weights of 0.
    rows: Vec<[Vec4; 2]>,
}

impl Filter {
    /// The largest radius in pixels.
    pub const MAX_RADIUS: f32 = 64.0;

    /// A filter; `radius` in pixels is rounded to the nearest multiple of 1/512 in 1/512 … [`Self::MAX_RADIUS`].
    #[must_use]
    pub fn new(kind: FilterKind, radius: f32) -> Self {
        let steps = STEPS as f32;
        let radius = (radius.min(Self::MAX_RADIUS) * steps).round().max(1.0) / steps;
        let reach = (radius - 0.5).ceil().max(0.0) as i32;
        let mut filter = Self { kind, radius, reach, rows: Vec::new() };
        let reach = reach as usize;
        for step in 0..STEPS {
            for group in 0..filter.groups() {
                let weights = [0, 1, 2, 3].map(|lane| {
                    let pixel = group * GROUP + lane;
                    // Distances in whole steps, so that both ends of the step fall on one side of each jump and kink.
                    let start = step as f32 - steps / 2.0 + (reach as f32 - pixel as f32) * steps;
                    let [start, end] = [start, start + 1.0].map(|distance| distance.abs() / steps / radius);
                    if pixel > 2 * reach || start.max(end) > 1.0 {
                        return (0.0, 0.0);
                    }
                    let value = formula(kind, radius, start);
                    (value, formula(kind, radius, end) - value)
                });
                filter
                    .rows
                    .push([Vec4::from(weights.map(|weight| weight.0)), Vec4::from(weights.map(|weight| weight.1))]);
            }
        }
        filter
    }

    /// The filter's shape.
    #[must_use]
    pub fn kind(&self) -> FilterKind {
        self.kind
    }

    /// The distance in pixels beyond which weights are zero.
    #[must_use]
    pub fn radius(&self) -> f32 {
        self.radius
    }

    /// The weight of a sample that lies `x` pixels right of a pixel's centre (or below it), along this one axis; the
    /// weight of a sample is the product over both.
    ///
    /// Zero unless −radius ≤ x < radius: a sample on the very border of two boxes counts for one of them. The weight
    /// at 0 is 1 (box, tent, Blackman-Harris), 1 − exp(−2 r²) (Gaussian) or 8/9 (Mitchell).
    #[must_use]
    pub fn weight(&self, x: f32) -> f32 {
        // The sample's pixel and its offset in that.
        let pixel = (x + 0.5).floor();
        if pixel.is_nan() || pixel.abs() > self.reach as f32 {
            return 0.0;
        }
        let place = (self.reach - pixel as i32) as usize;
        self.weights(x + 0.5 - pixel).nth(place / GROUP).map_or(0.0, |weights| weights[place % GROUP])
    }

    /// How many whole pixels around a pixel hold samples that can reach it.
    #[must_use]
    pub fn reach(&self) -> i32 {
        self.reach
    }

    /// Groups of weights in a row.
    pub(super) fn groups(&self) -> usize {
        (2 * self.reach as usize + 1).div_ceil(GROUP)
    }

    /// The weights of a sample for the pixels from −reach to +reach around its own, in groups; `offset` is its place
    /// in its own pixel, 0 … 1.
    #[inline]
    pub(super) fn weights(&self, offset: f32) -> impl Iterator<Item = Vec4> {
        let place = offset * STEPS as f32;
        let step = (place as i32).clamp(0, STEPS as i32 - 1) as usize;
        let groups = self.groups();
        let rest = place - step as f32;
        self.rows[step * groups..(step + 1) * groups].iter().map(move |[start, rise]| *start + *rise * rest)
    }

    /// Whether some weights are negative, so that the weights of a pixel may cancel.
    pub(super) fn has_negative_lobes(&self) -> bool {
        self.kind == FilterKind::Mitchell
    }
}

/// A filter's value at a distance of `t` radii, 0 ≤ `t` ≤ 1.
fn formula(kind: FilterKind, radius: f32, t: f32) -> f32 {
    match kind {
        FilterKind::Box => 1.0,
        FilterKind::Tent => 1.0 - t,
        FilterKind::Gaussian => {
            let gaussian = |x: f32| portable::exp(-2.0 * x * x);
            gaussian(t * radius) - gaussian(radius)
        }
        FilterKind::Mitchell => {
            let t = 2.0 * t;
            let cubic = if t < 1.0 {
                (7.0 * t - 12.0) * t * t + 16.0 / 3.0
            } else {
                ((-7.0 / 3.0 * t + 12.0) * t - 20.0) * t + 32.0 / 3.0
            };
            cubic / 6.0
        }
        FilterKind::BlackmanHarris => {
            let cosine = |harmonic: f32| portable::cos(harmonic * PI * t);
            0.358_75 + 0.488_29 * cosine(1.0) + 0.141_28 * cosine(2.0) + 0.011_68 * cosine(3.0)
        }
    }
}
