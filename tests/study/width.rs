//! How wide lines are drawn that are asked to have a width (DESIGN section 3.9).

use tusche::scene::settings::Sampler;
use tusche::study::width::{Asked, Edge, drawn};

/// Drawn / asked.
fn share(edge: Edge, sampler: Sampler, samples: u32, compensation: bool, width: f32) -> f64 {
    drawn(&Asked { edge, sampler, samples, compensation, width }, 600.0) / f64::from(width)
}

#[test]
fn compensated_lines_are_as_wide_as_asked_whichever_the_edge_and_the_sampler() {
    for edge in Edge::ALL {
        for sampler in Sampler::ALL {
            for (samples, width, tolerance) in [(4, 2.0, 0.035), (16, 1.0, 0.035), (16, 4.0, 0.015), (64, 2.0, 0.01)] {
                let share = share(edge, sampler, samples, true, width);
                assert!(
                    (share - 1.0).abs() < tolerance,
                    "{edge:?}, {sampler:?}, {samples} samples, {width} px: {share}"
                );
            }
        }
    }
}

#[test]
fn the_papers_rule_draws_as_thin_as_predicted() {
    for sampler in Sampler::ALL {
        for (samples, width) in [(4, 4.0), (16, 2.0), (64, 1.0)] {
            let share = share(Edge::Straight, sampler, samples, false, width);
            let gap = 0.80 * (3.0 / (4.0 * f64::from(width).sqrt() * f64::from(samples))).powf(2.0 / 3.0);
            let predicted = 1.0 - 2.0 * gap / f64::from(width);
            assert!(
                (share - predicted).abs() < 0.1 * (1.0 - predicted),
                "{sampler:?}, {samples}: {share} for {predicted}"
            );
        }
    }
}
