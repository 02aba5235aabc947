//! Where on the film the samples of a pixel lie.
//!
//! Every position is a function of the seed, the pixel and the number of the sample, so tiles, crops and threads cannot matter.
//! There are three samplers ([`Sampler`]); what each buys is measured in the README, chapter "What accuracy costs". Both that are not
//! `stratified` are at their best for powers of two.

mod sobol;
mod stratified;

use crate::sample::PixelRect;
use crate::scene::settings::Sampler;
use sobol::{BlueNoise, Sobol};
use stratified::Stratified;

/// Where samples lie: for each pixel, its [`PixelPositions`].
#[derive(Clone, Debug)]
pub struct SamplePositions {
    kind: Kind,
}

#[derive(Clone, Debug)]
enum Kind {
    Stratified(Stratified),
    Sobol(Sobol),
    BlueNoise(BlueNoise),
}

impl SamplePositions {
    /// Positions for `samples` per pixel, at least 1.
    #[must_use]
    pub fn new(sampler: Sampler, samples: u32, seed: u64) -> Self {
        let seed = mix(seed as u32, (seed >> 32) as u32, 0x7A5C_4E01);
        let kind = match sampler {
            Sampler::Stratified => Kind::Stratified(Stratified::new(samples, seed)),
            Sampler::Sobol => Kind::Sobol(Sobol::new(seed)),
            Sampler::BlueNoise => Kind::BlueNoise(BlueNoise::new(samples, seed)),
        };
        Self { kind }
    }

    /// Those of all `samples` of the pixels of a rectangle, in order: what [`PixelPositions::offset`] gives one by one, bit for bit.
    #[must_use]
    pub fn of_rect(&self, arch: pulp::Arch, rect: &PixelRect, samples: u32) -> Vec<[f32; 2]> {
        let mut offsets = vec![[0.0; 2]; rect.pixels() * samples as usize];
        arch.dispatch(Fill { positions: self, rect, samples: samples as usize, offsets: &mut offsets });
        offsets
    }

    /// Those of one pixel.
    #[must_use]
    #[inline(always)]
    pub fn of_pixel(&self, pixel: [i32; 2]) -> PixelPositions<'_> {
        PixelPositions(match &self.kind {
            Kind::Stratified(positions) => InPixel::Stratified(positions.of_pixel(pixel)),
            Kind::Sobol(positions) => InPixel::Sobol(positions.of_pixel(pixel)),
            Kind::BlueNoise(positions) => InPixel::Sobol(positions.of_pixel(pixel)),
        })
    }
}

/// Fills in the offsets of a rectangle.
struct Fill<'a> {
    positions: &'a SamplePositions,
    rect: &'a PixelRect,
    samples: usize,
    offsets: &'a mut [[f32; 2]],
}

impl pulp::WithSimd for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Self { positions, rect, samples, offsets } = self;
        let width = rect.width() as usize;
        for (index, offsets) in offsets.chunks_exact_mut(samples.max(1)).enumerate() {
            let pixel = [rect.x0 + (index % width) as i32, rect.y0 + (index / width) as i32];
            match positions.of_pixel(pixel).0 {
                InPixel::Stratified(positions) => positions.fill(offsets),
                InPixel::Sobol(positions) => positions.fill(offsets),
            }
        }
    }
}

/// Where the samples of one pixel lie.
#[derive(Clone, Copy, Debug)]
pub struct PixelPositions<'a>(InPixel<'a>);

#[derive(Clone, Copy, Debug)]
enum InPixel<'a> {
    Stratified(stratified::OfPixel<'a>),
    Sobol(sobol::OfPixel),
}

impl PixelPositions<'_> {
    /// Offset of a sample inside the pixel, each component 0 … 1 (1 excluded).
    #[must_use]
    #[inline]
    pub fn offset(&self, sample: u32) -> [f32; 2] {
        match &self.0 {
            InPixel::Stratified(positions) => positions.offset(sample),
            InPixel::Sobol(positions) => positions.offset(sample),
        }
    }
}

/// The factor c of the mean gap between an edge and the nearest sample beyond it (DESIGN section 3.9).
///
/// Measured by `cargo bench --bench gaps` at straight edges of all angles, from a radius of 1.4 times the samples' distance up: 0.77 to
/// 0.83 for both Sobol samplers. The same measurement gives 0.79 to 0.82 for `stratified`, whose 0.84 is that of an edge at 13° and
/// normative.
#[must_use]
pub const fn gap_factor(sampler: Sampler) -> f32 {
    match sampler {
        Sampler::Stratified => 0.84,
        Sampler::Sobol | Sampler::BlueNoise => 0.80,
    }
}

/// For lines so thin that the formula of the gap does not hold: half the width that is drawn, and the radius that has to be searched
/// for it, both in units of the samples' distance 1 / √ρ, rising. Beyond the last the formula holds. None for `stratified`, where it is
/// normative.
///
/// Measured by `cargo bench --bench gaps`: means of both Sobol samplers at 1, 4 and 16 samples. The last lies on the formula's curve. They
/// agree within 6 % of what is drawn, from 0.8 up within 4 %, but for `blue-noise` at one sample per pixel, which draws up to 14 % more.
#[must_use]
pub const fn thin_radii(sampler: Sampler) -> &'static [[f32; 2]] {
    match sampler {
        Sampler::Stratified => &[],
        Sampler::Sobol | Sampler::BlueNoise => {
            &[[0.1196, 0.7], [0.1966, 0.8], [0.2959, 0.9], [0.4112, 1.0], [0.6697, 1.2], [0.9315, 1.4]]
        }
    }
}

/// A 32-bit mix of three numbers, the same on every machine (the finaliser of PCG's RXS-M-XS family, chained).
#[inline(always)]
pub(crate) fn mix(a: u32, b: u32, c: u32) -> u32 {
    step(a ^ step(b ^ step(c)))
}

/// A 32-bit mix of one number.
#[inline(always)]
pub(crate) fn step(state: u32) -> u32 {
    let state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

/// A number in 0 … 1 (1 excluded) from the upper 24 bits.
#[inline(always)]
fn unit(bits: u32) -> f32 {
    // Of signed integers there is a conversion in every set of instructions.
    (bits >> 8) as i32 as f32 * (1.0 / 16_777_216.0)
}

/// Element `i` of a random permutation of 0 … `length`, by Kensler's hashed cycle walk
/// ("Correlated Multi-Jittered Sampling", 2013, section "Permutation").
fn permute(mut i: u32, length: u32, key: u32) -> u32 {
    let mut mask = length - 1;
    for shift in [1, 2, 4, 8, 16] {
        mask |= mask >> shift;
    }
    loop {
        i ^= key;
        i = i.wrapping_mul(0xe170_893d);
        i ^= key >> 16;
        i ^= (i & mask) >> 4;
        i ^= key >> 8;
        i = i.wrapping_mul(0x0929_eb3f);
        i ^= key >> 23;
        i ^= (i & mask) >> 1;
        i = i.wrapping_mul(1 | key >> 27);
        i = i.wrapping_mul(0x6935_fa69);
        i ^= (i & mask) >> 11;
        i = i.wrapping_mul(0x74dc_b303);
        i ^= (i & mask) >> 2;
        i = i.wrapping_mul(0x9e50_1cc3);
        i ^= (i & mask) >> 2;
        i = i.wrapping_mul(0xc860_a3df);
        i &= mask;
        i ^= i >> 5;
        if i < length {
            return (i.wrapping_add(key)) % length;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAMPLERS: [Sampler; 3] = Sampler::ALL;

    #[test]
    fn offsets_lie_in_their_pixel() {
        for sampler in SAMPLERS {
            for samples in [1, 2, 3, 9, 64, 100] {
                let positions = SamplePositions::new(sampler, samples, 3);
                for pixel in [[0, 0], [-7, 12], [7679, 4319], [i32::MIN, i32::MAX]] {
                    let pixel = positions.of_pixel(pixel);
                    assert!((0..samples).all(|sample| pixel.offset(sample).iter().all(|x| (0.0..1.0).contains(x))));
                }
            }
        }
    }

    #[test]
    fn rectangles_are_filled_with_the_same() {
        let rect = PixelRect { x0: -3, y0: 5, x1: 4, y1: 8 };
        for sampler in SAMPLERS {
            for samples in [1, 2, 3, 7, 9, 11, 16, 17, 64, 100] {
                let positions = SamplePositions::new(sampler, samples, 3);
                let mut filled = positions.of_rect(pulp::Arch::new(), &rect, samples).into_iter();
                for [x, y] in (rect.y0..rect.y1).flat_map(|y| (rect.x0..rect.x1).map(move |x| [x, y])) {
                    for sample in 0..samples {
                        let one = positions.of_pixel([x, y]).offset(sample);
                        assert_eq!(filled.next().map(|offset| offset.map(f32::to_bits)), Some(one.map(f32::to_bits)));
                    }
                }
                assert_eq!(filled.next(), None);
            }
        }
    }

    #[test]
    fn seeds_and_pixels_decorrelate() {
        for sampler in SAMPLERS {
            let offset = |seed, pixel| SamplePositions::new(sampler, 16, seed).of_pixel(pixel).offset(5);
            assert_ne!(offset(0, [3, 4]), offset(1, [3, 4]));
            assert_ne!(offset(0, [3, 4]), offset(1 << 32, [3, 4]));
            assert_ne!(offset(0, [3, 4]), offset(0, [4, 3]));
            // Of blue noise, the number of a sample tells the column that it lies in; see the next test for all of them.
            if sampler == Sampler::BlueNoise {
                continue;
            }
            let mean: f32 = (0..1000).map(|x| offset(0, [x, 0])[0]).sum::<f32>() / 1000.0;
            // Sample 5 of jittered 4×4 lies in the second column: 0.25 … 0.5, deviation of the mean 0.0023; elsewhere
            // it is anywhere, deviation 0.009.
            let (expected, tolerance) = if sampler == Sampler::Stratified { (0.375, 0.01) } else { (0.5, 0.03) };
            assert!((mean - expected).abs() < tolerance, "{sampler:?}: {mean}");
        }
    }

    /// Every place on the film is as likely as any other, so the mean over pixels is that of a function's integral.
    #[test]
    fn no_place_is_favoured() {
        for sampler in SAMPLERS {
            for samples in [1, 2, 4, 9, 16] {
                let positions = SamplePositions::new(sampler, samples, 9);
                let mut cells = [0_u32; 64];
                for pixel in 0..4096_i32 {
                    let pixel = positions.of_pixel([pixel % 64, pixel / 64]);
                    for sample in 0..samples {
                        let [x, y] = pixel.offset(sample).map(|x| (x * 8.0) as usize);
                        cells[y * 8 + x] += 1;
                    }
                }
                let expected = f64::from(4096 * samples) / 64.0;
                for count in cells {
                    let error = f64::from(count) - expected;
                    assert!(error.abs() < 5.0 * expected.sqrt(), "{sampler:?}, {samples}: {count} for {expected}");
                }
            }
        }
    }

    /// What one pixel has too much of, its neighbours have too little of: over blocks of pixels, errors nearly cancel.
    #[test]
    fn errors_of_blue_noise_have_little_at_low_frequencies() {
        let variance = |sampler, seed| {
            let positions = SamplePositions::new(sampler, 4, seed);
            let error = |x: i32, y: i32| {
                let pixel = positions.of_pixel([x, y]);
                let inside = (0..4).filter(|sample| {
                    let [x, y] = pixel.offset(*sample);
                    0.6 * x + 0.35 * y < 0.45
                });
                inside.count() as f64 / 4.0
            };
            let blocks: Vec<f64> = (0..1024)
                .map(|block| {
                    let corner = [block % 32 * 8 + 3, block / 32 * 8 + 5];
                    (0..64).map(|i| error(corner[0] + i % 8, corner[1] + i / 8)).sum::<f64>() / 64.0
                })
                .collect();
            let mean = blocks.iter().sum::<f64>() / 1024.0;
            blocks.iter().map(|block| (block - mean) * (block - mean)).sum::<f64>() / 1024.0
        };
        let mean = |sampler| (1..5).map(|seed| variance(sampler, seed)).sum::<f64>() / 4.0;
        let [sobol, blue] = [Sampler::Sobol, Sampler::BlueNoise].map(mean);
        // The blocks do not lie on the curve's grid: else it would be far less.
        assert!(blue < 0.7 * sobol, "{blue:e} against {sobol:e}");
    }
}
