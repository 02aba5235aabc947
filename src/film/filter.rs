//! Pixel filters: how much a sample counts for a pixel.
//!
//! A filter is the product of the same even function along x and along y, evaluated at the true distance between the
//! sample and the pixel's centre. The function is tabulated once and read with linear interpolation, so that the hot
//! loop costs the same for every kind and takes nothing from the machine's C library. The table *is* the definition:
//! it differs from the formula by less than 2e-6 of the peak, and box and tent are exact.

use std::f32::consts::PI;

use crate::math::portable;
use crate::scene::settings::FilterKind;

/// Intervals of the table between the centre and the radius. Even, so that Mitchell's knot lies on an entry.
const STEPS: usize = 1024;

/// A separable reconstruction filter: even, and zero at and beyond its radius.
#[derive(Clone, Debug, PartialEq)]
pub struct Filter {
    kind: FilterKind,
    radius: f32,
    steps_per_pixel: f32,
    /// For each interval its first value and the rise to its last; one past the end, zero.
    table: Vec<[f32; 2]>,
}

impl Filter {
    /// The radius that a filter is limited to, in pixels.
    pub const MAX_RADIUS: f32 = 64.0;

    /// A filter; `radius` in pixels, > 0, is limited to [`Self::MAX_RADIUS`].
    #[must_use]
    pub fn new(kind: FilterKind, radius: f32) -> Self {
        let radius = radius.max(1e-3).min(Self::MAX_RADIUS);
        let value = |step: usize| formula(kind, radius, step as f32 / STEPS as f32);
        let table = (0..STEPS).map(|step| [value(step), value(step + 1) - value(step)]).chain([[0.0; 2]]).collect();
        Self { kind, radius, steps_per_pixel: STEPS as f32 / radius, table }
    }

    /// The filter's shape.
    #[must_use]
    pub fn kind(&self) -> FilterKind {
        self.kind
    }

    /// The distance in pixels at and beyond which weights are zero.
    #[must_use]
    pub fn radius(&self) -> f32 {
        self.radius
    }

    /// The weight at a distance of `x` pixels along one axis. A sample's weight is the product over both axes.
    ///
    /// The weight at 0 is 1 (box, tent, Blackman-Harris), 1 − exp(−2 r²) (Gaussian) or 8/9 (Mitchell).
    #[inline]
    #[must_use]
    pub fn weight(&self, x: f32) -> f32 {
        let place = x.abs() * self.steps_per_pixel;
        let step = (place as usize).min(STEPS);
        let [value, rise] = self.table[step];
        value + (place - step as f32) * rise
    }

    /// How many whole pixels around a pixel hold samples that can reach it.
    #[must_use]
    pub fn reach(&self) -> i32 {
        (self.radius - 0.5).ceil().max(0.0) as i32
    }

    /// Whether some weights are negative, so that the weights of a pixel may cancel.
    #[must_use]
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
