//! Where on the film the samples of a pixel lie.

/// A 32-bit mix of three numbers, the same on every machine (the finaliser of PCG's RXS-M-XS family, chained).
#[inline]
fn mix(a: u32, b: u32, c: u32) -> u32 {
    let step = |state: u32| {
        let state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
        (word >> 22) ^ word
    };
    step(a ^ step(b ^ step(c)))
}

/// A number in 0 … 1 (1 excluded) with 24 random bits.
#[inline]
fn unit(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / 16_777_216.0)
}

/// Jittered sample positions: every sample seeds itself from its pixel and number, so tiles and threads cannot matter.
#[derive(Clone, Copy, Debug)]
pub struct SamplePositions {
    columns: u32,
    rows: u32,
    samples: u32,
    seed: u32,
}

impl SamplePositions {
    /// Positions for `samples` per pixel. Counts that split into near-square grids (1, 2, 4, 6, 9, 12, 16, …) are
    /// plainly jittered; others leave random cells of the next larger grid empty.
    #[must_use]
    pub fn new(samples: u32, seed: u64) -> Self {
        let columns = (f64::from(samples).sqrt().ceil() as u32).max(1);
        let exact = (1..=columns).rev().find(|c| samples.is_multiple_of(*c)).filter(|c| samples / c <= 2 * c);
        let (columns, rows) = match exact {
            Some(c) => (samples / c, c),
            None => (columns, samples.div_ceil(columns)),
        };
        Self { columns, rows, samples, seed: mix(seed as u32, (seed >> 32) as u32, 0x7A5C_4E01) }
    }

    /// Offset of a sample inside its pixel, each component 0 … 1 (1 excluded).
    #[must_use]
    pub fn offset(&self, pixel: [i32; 2], sample: u32) -> [f32; 2] {
        let key = mix(pixel[0] as u32, pixel[1] as u32, self.seed);
        let cells = self.columns * self.rows;
        let cell = if cells == self.samples { sample } else { permute(sample, cells, key) };
        let [jitter_x, jitter_y] = [mix(key, sample, 1), mix(key, sample, 2)].map(unit);
        [
            ((cell % self.columns) as f32 + jitter_x) / self.columns as f32,
            ((cell / self.columns) as f32 + jitter_y) / self.rows as f32,
        ]
        // Rounding up to 1 would put the sample into the next pixel.
        .map(|x| x.min(1.0 - f32::EPSILON / 2.0))
    }
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

    #[test]
    fn offsets_lie_in_their_pixel_each_in_a_cell_of_its_own() {
        for samples in [1, 2, 3, 4, 5, 7, 9, 11, 16, 64, 100] {
            let positions = SamplePositions::new(samples, 3);
            let (columns, rows) = (positions.columns, positions.rows);
            assert!(columns * rows >= samples && columns * rows < samples + columns.max(rows), "{samples}");
            for pixel in [[0, 0], [-7, 12], [7679, 4319]] {
                let cells: std::collections::BTreeSet<_> = (0..samples)
                    .map(|sample| {
                        let [x, y] = positions.offset(pixel, sample);
                        assert!((0.0..1.0).contains(&x) && (0.0..1.0).contains(&y));
                        // A jitter near 1 may round up to the next cell's border.
                        let cell = |x: f32, count: u32| ((x * count as f32) - 1e-5).max(0.0) as u32;
                        (cell(x, columns), cell(y, rows))
                    })
                    .collect();
                assert_eq!(cells.len(), samples as usize, "{samples} samples at {pixel:?}");
            }
        }
    }

    #[test]
    fn seeds_and_pixels_decorrelate() {
        let offset = |seed, pixel| SamplePositions::new(16, seed).offset(pixel, 5);
        assert_ne!(offset(0, [3, 4]), offset(1, [3, 4]));
        assert_ne!(offset(0, [3, 4]), offset(1 << 32, [3, 4]));
        assert_ne!(offset(0, [3, 4]), offset(0, [4, 3]));
        let mean: f32 = (0..1000).map(|x| offset(0, [x, 0])[0]).sum::<f32>() / 1000.0;
        // Sample 5 of 4×4 lies in the second column: 0.25 … 0.5, deviation of the mean 0.0023.
        assert!((mean - 0.375).abs() < 0.01, "{mean}");
    }
}
