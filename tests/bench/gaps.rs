//! How far lines fall short of the radius that is searched: `cargo bench --bench gaps`.
//!
//! For each sampler, the mean gap between a straight edge and the nearest sample beyond it, as the factor c of DESIGN 3.9, by the radius
//! in units of the samples' distance, r √ρ, at several rates. Where the rates agree, the factor is a function of r √ρ alone.

use tusche::scene::settings::Sampler;
use tusche::study::width::{Asked, Edge, drawn};

/// r √ρ.
const RADII: [f64; 16] = [0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.2, 1.4, 1.7, 2.0, 2.8, 4.0, 8.0, 16.0];
const SAMPLES: [u32; 4] = [1, 4, 16, 64];
/// Of edge, at one sample per pixel.
const LENGTH: f64 = 20_000.0;

fn main() {
    // `cargo test --all-targets` runs benchmarks too, without this flag.
    if !std::env::args().any(|argument| argument == "--bench") {
        return;
    }
    for sampler in Sampler::ALL {
        println!(
            "\n| {}, r √ρ | {} |",
            sampler.name(),
            SAMPLES.map(|samples| format!("{samples} samples")).join(" | ")
        );
        println!("|---|{}", "---|".repeat(SAMPLES.len()));
        for radius in RADII {
            let cells = SAMPLES.map(|samples| {
                let spacing = 1.0 / f64::from(samples).sqrt();
                let width = (2.0 * radius * spacing) as f32;
                let asked = Asked { edge: Edge::Straight, sampler, samples, compensation: false, width };
                let half = drawn(&asked, LENGTH * spacing) / 2.0 / spacing;
                let formula = (3.0 / (4.0 * (2.0 * radius).sqrt())).powf(2.0 / 3.0);
                format!("{:.3} ({half:.4})", (radius - half) / formula)
            });
            println!("| {radius} | {} |", cells.join(" | "));
        }
    }
}
