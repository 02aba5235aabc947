//! How much wider is searched than is asked for, so that lines are as wide as asked on average (DESIGN section 3.9).

use crate::math::portable;
use crate::sample::position::{gap_factor, thin_radii};
use crate::scene::settings::Sampler;

/// The radii of a sampler at a rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Widening {
    /// Mean gap to the nearest sample beyond an edge, for a half width of 1 px.
    unit_gap: f64,
    /// Samples along a pixel, √ρ.
    per_side: f32,
    /// Where the formula of the gap does not hold.
    thin: &'static [[f32; 2]],
}

impl Widening {
    pub(super) fn new(sampler: Sampler, samples_per_pixel: u32) -> Self {
        let samples = samples_per_pixel.max(1) as f32;
        // h(r, ρ) = c · (3 / (4 √(2r) ρ))^(2/3) falls with the cube root of r alone: DESIGN section 3.9.
        let unit_gap = gap_factor(sampler) * portable::pow(3.0 / (4.0 * samples), 2.0 / 3.0) / portable::cbrt(2.0);
        Self { unit_gap: f64::from(unit_gap), per_side: samples.sqrt(), thin: thin_radii(sampler) }
    }

    /// The radius within which neighbours are searched, for half the asked width, above 0. Rises with it.
    pub(super) fn radius(&self, half: f32) -> f32 {
        let asked = half * self.per_side;
        let above = self.thin.partition_point(|[knot, _]| *knot <= asked);
        match (self.thin.get(above.wrapping_sub(1)), self.thin.get(above)) {
            (_, None) => widened(half, self.unit_gap),
            // As likely as two samples that are nearer to each other than most: what is drawn grows with the fourth power.
            (None, Some([knot, radius])) => radius * (asked / knot).sqrt().sqrt() / self.per_side,
            (Some([a, low]), Some([b, high])) => (low + (asked - a) / (b - a) * (high - low)) / self.per_side,
        }
    }
}

/// The r with r − gap / ∛r = half.
///
/// With s = ∛r that is s⁴ − half · s − gap = 0: convex for s > 0, so Newton's steps from above fall to the root and stop
/// by themselves. ∛half + ∜gap is above it; it decides only how many steps are needed.
fn widened(half: f32, gap: f64) -> f32 {
    let half = f64::from(half);
    // The factor makes up for the rounding of the f32 root.
    let mut s = (f64::from(portable::cbrt(half as f32)) + gap.sqrt().sqrt()) * (1.0 + 1e-6);
    loop {
        let cube = s * s * s;
        let next = s - (s * cube - half * s - gap) / (4.0 * cube - half);
        if next < s {
            s = next;
        } else {
            // As near as f64 comes.
            return cube as f32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SAMPLES: [u32; 6] = [1, 2, 4, 16, 64, 1024];

    #[test]
    fn the_formula_holds_but_for_thin_lines() {
        for samples in SAMPLES {
            for (sampler, factor, from) in
                [(Sampler::Stratified, 0.84, 0.0), (Sampler::Sobol, 0.80, 0.9315), (Sampler::BlueNoise, 0.80, 0.9315)]
            {
                for half in [5e-7, 0.05, 0.25, 0.5, 1.0, 4.0, 32.0_f32] {
                    let r = f64::from(Widening::new(sampler, samples).radius(half));
                    let h = factor * (3.0 / (4.0 * (2.0 * r).sqrt() * f64::from(samples))).powf(2.0 / 3.0);
                    let error = r - h - f64::from(half);
                    let is_right = error.abs() < 1e-6 * r.max(1.0);
                    let is_thin = half * (samples as f32).sqrt() < from;
                    assert!(is_right || is_thin, "{sampler:?}, {samples} samples, {half} px: off by {error}");
                }
            }
        }
    }

    /// What is measured at one rate holds at all: lengths are in units of the samples' distance.
    #[test]
    fn thin_lines_have_the_measured_radii() {
        for samples in [1, 4, 16, 64] {
            let spacing = 1.0 / (samples as f32).sqrt();
            for sampler in [Sampler::Sobol, Sampler::BlueNoise] {
                let radius = |asked: f32| Widening::new(sampler, samples).radius(asked * spacing) / spacing;
                for [asked, expected] in thin_radii(sampler) {
                    assert!((radius(*asked) - expected).abs() < 1e-4, "{samples}, {asked}: {}", radius(*asked));
                }
                // Half way between two, and a sixteenth of the least.
                assert!((radius(0.24625) - 0.85).abs() < 1e-4, "{}", radius(0.24625));
                assert!((radius(0.1196 / 16.0) - 0.35).abs() < 1e-4, "{}", radius(0.1196 / 16.0));
            }
        }
    }

    proptest! {
        #[test]
        fn wider_lines_have_larger_radii(half in 1e-4..3.0f32, step in 0.0..0.1f32, index in 0..18usize) {
            let widening = Widening::new(Sampler::ALL[index % 3], SAMPLES[index / 3]);
            prop_assert!(widening.radius(half) <= widening.radius(half + step));
            prop_assert!(widening.radius(half) > half, "it is wider");
        }
    }

    /// Nowhere is a smaller radius found for the next larger number, least of all where the parts meet.
    #[test]
    fn radii_never_fall_where_parts_meet() {
        for (sampler, samples) in Sampler::ALL.into_iter().flat_map(|sampler| SAMPLES.map(|samples| (sampler, samples)))
        {
            let widening = Widening::new(sampler, samples);
            for [knot, _] in thin_radii(sampler) {
                let mut half = knot / widening.per_side * (1.0 - 1e-5);
                while half < knot / widening.per_side * (1.0 + 1e-5) {
                    let next = half.next_up();
                    assert!(widening.radius(half) <= widening.radius(next), "{sampler:?}, {samples}, {half}");
                    half = next;
                }
            }
        }
    }
}
