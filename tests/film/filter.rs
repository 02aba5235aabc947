//! Filters against theory: symmetric, zero outside, with the known integral.

use std::f64::consts::PI;

use tusche::film::Filter;
use tusche::scene::settings::FilterKind;

pub const KINDS: [FilterKind; 5] =
    [FilterKind::Box, FilterKind::Tent, FilterKind::Gaussian, FilterKind::Mitchell, FilterKind::BlackmanHarris];

const RADII: [f32; 6] = [0.25, 0.5, 1.0, 1.5, 2.0, 3.75];

/// Deviation from the formula that the table may have, relative to the peak.
const TABLE_TOLERANCE: f64 = 1e-5;

fn formula(kind: FilterKind, radius: f64, x: f64) -> f64 {
    let x = x.abs();
    if x > radius {
        return 0.0;
    }
    match kind {
        FilterKind::Box => 1.0,
        FilterKind::Tent => 1.0 - x / radius,
        FilterKind::Gaussian => (-2.0 * x * x).exp() - (-2.0 * radius * radius).exp(),
        FilterKind::Mitchell => {
            let (b, c, t) = (1.0 / 3.0, 1.0 / 3.0, 2.0 * x / radius);
            // Mitchell and Netravali 1988, equation 8.
            let sum = if t < 1.0 {
                (12.0 - 9.0 * b - 6.0 * c) * t.powi(3) + (-18.0 + 12.0 * b + 6.0 * c) * t * t + (6.0 - 2.0 * b)
            } else {
                (-b - 6.0 * c) * t.powi(3)
                    + (6.0 * b + 30.0 * c) * t * t
                    + (-12.0 * b - 48.0 * c) * t
                    + (8.0 * b + 24.0 * c)
            };
            sum / 6.0
        }
        FilterKind::BlackmanHarris => {
            // The window over 0 … 1 with its middle at 1/2, as signal processing writes it.
            let n = 0.5 + 0.5 * x / radius;
            0.358_75 - 0.488_29 * (2.0 * PI * n).cos() + 0.141_28 * (4.0 * PI * n).cos()
                - 0.011_68 * (6.0 * PI * n).cos()
        }
    }
}

/// The integral over the whole line, by hand.
fn integral(kind: FilterKind, r: f64) -> f64 {
    match kind {
        FilterKind::Box => 2.0 * r,
        FilterKind::Tent => r,
        FilterKind::Gaussian => (PI / 2.0).sqrt() * libm::erf(2.0_f64.sqrt() * r) - 2.0 * r * (-2.0 * r * r).exp(),
        FilterKind::Mitchell => r / 2.0,
        FilterKind::BlackmanHarris => 2.0 * r * 0.358_75,
    }
}

#[test]
fn weights_follow_the_formula() {
    for kind in KINDS {
        for radius in [1.0, 1.5, 2.0, 3.75] {
            let filter = Filter::new(kind, radius);
            for i in -8000..8000 {
                let x = i as f32 * 0.000_5 + 0.000_123;
                let expected = formula(kind, f64::from(radius), f64::from(x));
                let weight = f64::from(filter.weight(x));
                assert!(
                    (weight - expected).abs() < TABLE_TOLERANCE,
                    "{kind:?} {radius}: {weight} at {x}, not {expected}"
                );
            }
        }
    }
}

#[test]
fn weights_are_zero_outside_the_radius_and_symmetric_inside() {
    for kind in KINDS {
        for radius in RADII {
            let filter = Filter::new(kind, radius);
            assert_eq!(filter.radius(), radius);
            for x in [radius, radius * 1.000_01, radius + 0.3, 17.0, 1e9, f32::INFINITY, f32::NAN] {
                assert_eq!(filter.weight(x), 0.0, "{kind:?} {radius} at {x}");
            }
            for x in [-radius * 1.000_01, -radius - 0.3, -17.0, -1e9] {
                assert_eq!(filter.weight(x), 0.0, "{kind:?} {radius} at {x}");
            }
            for i in 1..1000 {
                let x = radius * i as f32 / 1000.0;
                assert!((filter.weight(x) - filter.weight(-x)).abs() < 1e-6, "{kind:?} {radius} at {x}");
            }
        }
    }
}

#[test]
fn weights_have_the_stated_integral() {
    for kind in KINDS {
        for radius in RADII {
            let filter = Filter::new(kind, radius);
            let (steps, range) = (100_000, 2.0 * f64::from(radius) + 1.0);
            let at = |i: i32| (f64::from(i) + 0.5) / f64::from(steps) * range - range / 2.0;
            let sum: f64 = (0..steps).map(|i| f64::from(filter.weight(at(i) as f32))).sum();
            let (measured, expected) = (sum * range / f64::from(steps), integral(kind, f64::from(radius)));
            assert!((measured / expected - 1.0).abs() < 1e-3, "{kind:?} {radius}: {measured}, not {expected}");
        }
    }
}

#[test]
fn peaks_are_as_documented() {
    assert_eq!(Filter::new(FilterKind::Box, 0.5).weight(0.0), 1.0);
    assert_eq!(Filter::new(FilterKind::Tent, 1.5).weight(0.0), 1.0);
    assert!((Filter::new(FilterKind::Gaussian, 1.0).weight(0.0) - (1.0 - (-2.0_f32).exp())).abs() < 1e-6);
    assert!((Filter::new(FilterKind::Mitchell, 2.0).weight(0.0) - 8.0 / 9.0).abs() < 1e-6);
    assert!((Filter::new(FilterKind::BlackmanHarris, 1.5).weight(0.0) - 1.0).abs() < 1e-6);
}

#[test]
fn only_mitchell_goes_below_zero() {
    for kind in KINDS {
        let filter = Filter::new(kind, 2.0);
        let lowest = (0..2000).map(|i| filter.weight(i as f32 * 0.001)).fold(f32::INFINITY, f32::min);
        match kind {
            FilterKind::Mitchell => assert!(lowest < -0.03, "{lowest}"),
            _ => assert!(lowest >= 0.0, "{kind:?}: {lowest}"),
        }
    }
}

#[test]
fn reach_holds_all_samples_that_count() {
    for (radius, reach) in [(0.1, 0), (0.5, 0), (0.51, 1), (1.0, 1), (1.5, 1), (1.51, 2), (2.0, 2), (2.5, 2), (3.75, 4)]
    {
        assert_eq!(Filter::new(FilterKind::Box, radius).reach(), reach, "{radius}");
    }
}

#[test]
fn absurd_radii_are_limited() {
    for (asked, given) in
        [(0.0, 1.0 / 512.0), (-3.0, 1.0 / 512.0), (1e30, 64.0), (f32::INFINITY, 64.0), (f32::NAN, 64.0)]
    {
        assert_eq!(Filter::new(FilterKind::Tent, asked).radius(), given, "{asked}");
    }
    assert_eq!(Filter::new(FilterKind::Tent, 0.7).radius(), 358.0 / 512.0);
}

#[test]
fn a_box_of_one_pixel_counts_each_sample_once() {
    let filter = Filter::new(FilterKind::Box, 0.5);
    for offset in [0.0, 0.25, 0.5, 0.75, 1.0 - f32::EPSILON / 2.0] {
        // As seen from the pixel's own centre and from those of its neighbours.
        let weights = [-1.0, 0.0, 1.0].map(|neighbor| filter.weight(offset - 0.5 + neighbor));
        assert_eq!(weights, [0.0, 1.0, 0.0], "{offset}");
    }
}
