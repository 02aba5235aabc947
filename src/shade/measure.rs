//! What shading costs: CPU time per hit, as medians, so that other programs on a busy machine hardly show.

use super::batch::{HitBatch, OutputBatch};
use super::interpret::{ShadeErrors, Shading};
use super::names::OutputSet;
use super::program::Shaders;
use crate::clock::CpuClock;
use crate::scene::Scene;
use crate::scene::ids::MaterialId;

/// Shortest time that one measurement takes, in seconds: far above the resolution of clocks.
const LEAST_SECONDS: f64 = 0.002;

/// Nanoseconds of CPU time for each hit of a batch, all outputs wanted: the median of `repeats` measurements, after a
/// first round that warms caches and is not counted. 0 for an empty batch.
#[must_use]
pub fn nanoseconds_per_hit(shading: &mut Shading<'_>, material: MaterialId, hits: &HitBatch, repeats: usize) -> f64 {
    if hits.len == 0 {
        return 0.0;
    }
    let mut outputs = OutputBatch::default();
    let mut shade = |shading: &mut Shading<'_>| {
        let mut errors = ShadeErrors::default();
        shading.shade(material, hits, OutputSet::all(), &mut outputs, &mut errors);
    };
    shade(shading);
    let measured = (0..repeats.max(1)).map(|_| {
        let clock = CpuClock::thread();
        let mut rounds = 0_u32;
        loop {
            shade(shading);
            rounds += 1;
            let seconds = clock.seconds();
            if seconds >= LEAST_SECONDS {
                return seconds * 1e9 / (f64::from(rounds) * hits.len as f64);
            }
        }
    });
    median(measured.collect())
}

/// Nanoseconds of CPU time that the one evaluation of a constant shader takes: the median over new contexts.
#[must_use]
pub fn nanoseconds_once(
    scene: &Scene,
    shaders: &Shaders,
    material: MaterialId,
    hits: &HitBatch,
    repeats: usize,
) -> f64 {
    let mut outputs = OutputBatch::default();
    let measured = (0..repeats.max(1)).map(|_| {
        let mut shading = Shading::new(scene, shaders);
        let mut errors = ShadeErrors::default();
        let clock = CpuClock::thread();
        shading.shade(material, hits, OutputSet::all(), &mut outputs, &mut errors);
        clock.seconds() * 1e9
    });
    median(measured.collect())
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    match values.len() {
        0 => 0.0,
        n if n % 2 == 1 => values[n / 2],
        n => (values[n / 2 - 1] + values[n / 2]) / 2.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_the_one_in_the_middle() {
        assert_eq!(median(vec![]), 0.0);
        assert_eq!(median(vec![3.0, 1.0, 100.0]), 3.0);
        assert_eq!(median(vec![4.0, 1.0, 2.0, 100.0]), 3.0);
    }
}
