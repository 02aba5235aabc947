//! Owen-scrambled points of Sobol's sequence: for each pixel a scrambling of its own, or for all pixels one sequence.
//!
//! The first two dimensions of the sequence are a (0,2)-sequence: of 2^m points that follow each other from a multiple of 2^m on,
//! each of the 2^m rectangles of area 2^-m with sides of powers of two holds one. Owen's scrambling keeps that, and makes every point
//! uniform. The scrambling is a hash of the reversed bits (Laine and Karras 2011, used as in Burley, "Practical Hash-based Owen
//! Scrambling", JCGT 2020), with the constants that Vegdahl found to mix better (2021,
//! <https://psychopath.io/post/2021_01_30_building_a_better_lk_hash>); pbrt-v4 and Blender use them, too.

use super::{mix, unit};

/// A scrambling for each pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sobol {
    seed: u32,
}

impl Sobol {
    pub(super) fn new(seed: u32) -> Self {
        Self { seed }
    }

    #[inline(always)]
    pub(super) fn of_pixel(&self, pixel: [i32; 2]) -> OfPixel {
        OfPixel::new(0, mix(pixel[0] as u32, pixel[1] as u32, self.seed))
    }
}

/// One sequence for all pixels, which take its points block by block along a shuffled Z curve (Ahmed and Wonka, "Screen-Space
/// Blue-Noise Diffusion of Monte Carlo Sampling Error via Hierarchical Ordering of Pixels", 2020).
///
/// The points of any square of 2^k × 2^k pixels on the curve's grid, laid over each other, are again well distributed. So what one
/// pixel has too much of, its neighbours have too little of, and errors are finer grained: they have less power at low frequencies.
#[derive(Clone, Copy, Debug)]
pub(super) struct BlueNoise {
    seed: u32,
    /// Points of a block.
    samples: u32,
    /// How many levels of squares of pixels the sequence has room for.
    digits: u32,
}

impl BlueNoise {
    pub(super) fn new(samples: u32, seed: u32) -> Self {
        let bits = samples.max(1).next_power_of_two().trailing_zeros().min(30);
        Self { seed, samples, digits: (32 - bits) / 2 }
    }

    #[inline(always)]
    pub(super) fn of_pixel(&self, [x, y]: [i32; 2]) -> OfPixel {
        let place = interleaved(x as u32) | interleaved(y as u32) << 1;
        // The next square of as many pixels has a scrambling of its own.
        let digits = self.digits;
        let square = place >> (2 * digits);
        let key = mix(square as u32, (square >> 32) as u32, self.seed);
        // Which of its four parts a square visits when is shuffled, at every level: else the curve would show.
        let mut block = 0_u32;
        for level in (0..digits).rev() {
            let above = (place >> (2 * level + 2)) as u32;
            let part = (place >> (2 * level)) as u32 & 3;
            block = block << 2 | shuffled(part, mix(above, level, key));
        }
        // Blocks leave no point out: which those are would be the same in all pixels.
        OfPixel::new(block.wrapping_mul(self.samples), key)
    }
}

/// Where one of four things comes in one of their 24 orders.
fn shuffled(part: u32, hash: u32) -> u32 {
    // Two bits for each part, from the lowest up.
    const ORDERS: [u8; 24] = [
        0xE4, 0xB4, 0xD8, 0x78, 0x9C, 0x6C, 0xE1, 0xB1, 0xC9, 0x39, 0x8D, 0x2D, 0xD2, 0x72, 0xC6, 0x36, 0x4E, 0x1E,
        0x93, 0x63, 0x87, 0x27, 0x4B, 0x1B,
    ];
    let order = ORDERS[((u64::from(hash) * 24) >> 32) as usize];
    u32::from(order >> (2 * part)) & 3
}

/// The bits of a number, with a gap after each.
fn interleaved(bits: u32) -> u64 {
    let mut x = u64::from(bits);
    x = (x | x << 16) & 0x0000_FFFF_0000_FFFF;
    x = (x | x << 8) & 0x00FF_00FF_00FF_00FF;
    x = (x | x << 4) & 0x0F0F_0F0F_0F0F_0F0F;
    x = (x | x << 2) & 0x3333_3333_3333_3333;
    (x | x << 1) & 0x5555_5555_5555_5555
}

/// One pixel's part of a scrambled sequence.
#[derive(Clone, Copy, Debug)]
pub(super) struct OfPixel {
    first: u32,
    seeds: [u32; 2],
}

impl OfPixel {
    #[inline(always)]
    fn new(first: u32, key: u32) -> Self {
        Self { first, seeds: [mix(key, 0, 1), mix(key, 0, 2)] }
    }

    /// The offsets of all samples.
    #[inline(always)]
    pub(super) fn fill(&self, offsets: &mut [[f32; 2]]) {
        for (sample, offset) in (0..).zip(offsets) {
            *offset = self.offset(sample);
        }
    }

    #[inline(always)]
    pub(super) fn offset(&self, sample: u32) -> [f32; 2] {
        let index = self.first.wrapping_add(sample);
        let [x, y] = [index, second_dimension(index)];
        [unit(scramble(x, self.seeds[0]).reverse_bits()), unit(scramble(y, self.seeds[1]).reverse_bits())]
    }
}

/// Sobol's second dimension, the digits behind the point from the lowest bit upwards; those of the first are the index itself.
///
/// Bits are coefficients of a polynomial over GF(2), and this is what it becomes with x + 1 for x. As (x + 1)^16 = x^16 + 1, that
/// is done by halves.
#[inline(always)]
fn second_dimension(index: u32) -> u32 {
    let mut x = index;
    x ^= x >> 16;
    x ^= (x & 0xFF00_FF00) >> 8;
    x ^= (x & 0xF0F0_F0F0) >> 4;
    x ^= (x & 0xCCCC_CCCC) >> 2;
    x ^ (x & 0xAAAA_AAAA) >> 1
}

/// Owen's scrambling of digits from the lowest bit upwards: each is flipped or not by a hash of those below it.
#[inline(always)]
fn scramble(digits: u32, seed: u32) -> u32 {
    let mut x = digits;
    x ^= x.wrapping_mul(0x3D20_ADEA);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6C56);
    x ^ x.wrapping_mul(0x53A2_2864)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether of 2^m points, each rectangle of area 2^-m with sides of powers of two holds one.
    fn is_net(points: &[[f32; 2]]) -> bool {
        let m = points.len().trailing_zeros();
        (0..=m).all(|columns| {
            let cell = |x: f32, bits: u32| (x * (1_u32 << bits) as f32) as u32;
            let cells = points.iter().map(|[x, y]| (cell(*x, columns), cell(*y, m - columns)));
            cells.collect::<std::collections::BTreeSet<_>>().len() == points.len()
        })
    }

    #[test]
    fn the_second_dimension_is_sobols() {
        // By the book: direction numbers v, each the last one xored with itself shifted.
        for index in (0..2000).chain([u32::MAX, 0x8000_0000, 0x1234_5678]) {
            let (mut direction, mut expected) = (1_u32 << 31, 0);
            for bit in 0..32 {
                if index >> bit & 1 == 1 {
                    expected ^= direction;
                }
                direction ^= direction >> 1;
            }
            assert_eq!(second_dimension(index).reverse_bits(), expected, "{index}");
        }
    }

    #[test]
    fn scrambling_decides_each_digit_by_those_before_it() {
        for seed in [0, 1, 0xDEAD_BEEF, u32::MAX] {
            for digits in [0, 1, 0x0F0F_1234, u32::MAX] {
                for bit in 0..32 {
                    let flipped = scramble(digits, seed) ^ scramble(digits ^ 1 << bit, seed);
                    assert_eq!(flipped.trailing_zeros(), bit, "bit {bit} of {digits:x}");
                }
            }
        }
    }

    #[test]
    fn a_digit_is_flipped_in_half_of_all_cases() {
        for bit in 0..24 {
            let flipped = (0..4096).filter(|i| {
                let (digits, seed) = (mix(*i, 1, 2), mix(*i, 3, 4));
                (scramble(digits, seed) ^ digits) >> bit & 1 == 1
            });
            let share = flipped.count() as f64 / 4096.0;
            assert!((share - 0.5).abs() < 0.05, "bit {bit}: {share}");
        }
    }

    #[test]
    fn four_parts_come_in_any_order_alike_often() {
        let mut seen = std::collections::BTreeMap::new();
        for key in 0..24_000 {
            let mut order = [0, 1, 2, 3].map(|part| shuffled(part, mix(key, 5, 7)));
            *seen.entry(order).or_insert(0) += 1;
            order.sort_unstable();
            assert_eq!(order, [0, 1, 2, 3]);
        }
        assert_eq!(seen.len(), 24);
        assert!(seen.values().all(|count| (850..1150).contains(count)), "{seen:?}");
    }

    #[test]
    fn powers_of_two_are_nets_in_every_pixel() {
        for samples in [1_u32, 2, 4, 8, 16, 64, 256, 1024] {
            for pixel in [[0, 0], [5, -3], [7679, 4319]] {
                let kinds = [Sobol::new(11).of_pixel(pixel), BlueNoise::new(samples, 11).of_pixel(pixel)];
                for positions in kinds {
                    let points: Vec<_> = (0..samples).map(|sample| positions.offset(sample)).collect();
                    assert!(is_net(&points), "{samples} samples in {pixel:?}");
                }
            }
        }
    }

    #[test]
    fn squares_of_pixels_share_one_net() {
        for samples in [1_u32, 2, 4, 16] {
            let positions = BlueNoise::new(samples, 5);
            for side in [2_i32, 4, 8] {
                for corner in [[0, 0], [3, 5], [-1, -4]] {
                    let pixels = (0..side * side).map(|i| [corner[0] * side + i % side, corner[1] * side + i / side]);
                    let points: Vec<_> = pixels
                        .flat_map(|pixel| (0..samples).map(move |sample| positions.of_pixel(pixel).offset(sample)))
                        .collect();
                    assert!(is_net(&points), "{samples} samples, {side} pixels at {corner:?}");
                }
            }
        }
    }
}
