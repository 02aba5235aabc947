//! Jittered positions: every sample in a cell of its own.

use super::{mix, permute, unit};

/// A grid of cells over each pixel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stratified {
    columns: u32,
    rows: u32,
    samples: u32,
    seed: u32,
}

/// One pixel's.
#[derive(Clone, Copy, Debug)]
pub(super) struct OfPixel {
    columns: u32,
    rows: u32,
    samples: u32,
    key: u32,
}

impl Stratified {
    /// Counts that split into near-square grids (1, 2, 4, 6, 9, 12, 16, …) are plainly jittered; others leave random cells of
    /// the next larger grid empty.
    pub(super) fn new(samples: u32, seed: u32) -> Self {
        let columns = (f64::from(samples).sqrt().ceil() as u32).max(1);
        let exact = (1..=columns).rev().find(|c| samples.is_multiple_of(*c)).filter(|c| samples / c <= 2 * c);
        let (columns, rows) = match exact {
            Some(c) => (samples / c, c),
            None => (columns, samples.div_ceil(columns)),
        };
        Self { columns, rows, samples, seed }
    }

    #[inline]
    pub(super) fn of_pixel(&self, pixel: [i32; 2]) -> OfPixel {
        let Self { columns, rows, samples, seed } = *self;
        OfPixel { columns, rows, samples, key: mix(pixel[0] as u32, pixel[1] as u32, seed) }
    }
}

impl OfPixel {
    #[inline]
    pub(super) fn offset(&self, sample: u32) -> [f32; 2] {
        let cells = self.columns * self.rows;
        let cell = if cells == self.samples { sample } else { permute(sample, cells, self.key) };
        let [jitter_x, jitter_y] = [mix(self.key, sample, 1), mix(self.key, sample, 2)].map(unit);
        [
            ((cell % self.columns) as f32 + jitter_x) / self.columns as f32,
            ((cell / self.columns) as f32 + jitter_y) / self.rows as f32,
        ]
        // Rounding up to 1 would put the sample into the next pixel.
        .map(|x| x.min(1.0 - f32::EPSILON / 2.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sample_has_a_cell_of_its_own() {
        for samples in [1, 2, 3, 4, 5, 7, 9, 11, 16, 64, 100] {
            let positions = Stratified::new(samples, 3);
            let (columns, rows) = (positions.columns, positions.rows);
            assert!(columns * rows >= samples && columns * rows < samples + columns.max(rows), "{samples}");
            for pixel in [[0, 0], [-7, 12], [7679, 4319]] {
                let cells: std::collections::BTreeSet<_> = (0..samples)
                    .map(|sample| {
                        let [x, y] = positions.of_pixel(pixel).offset(sample);
                        // A jitter near 1 may round up to the next cell's border.
                        let cell = |x: f32, count: u32| ((x * count as f32) - 1e-5).max(0.0) as u32;
                        (cell(x, columns), cell(y, rows))
                    })
                    .collect();
                assert_eq!(cells.len(), samples as usize, "{samples} samples at {pixel:?}");
            }
        }
    }
}
