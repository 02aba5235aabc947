//! Jittered positions: every sample in a cell of its own.

use std::sync::Arc;

use super::{mix, permute, step, unit};

/// A grid of cells over each pixel.
#[derive(Clone, Debug)]
pub(super) struct Stratified {
    columns: u32,
    rows: u32,
    samples: u32,
    seed: u32,
    /// For each cell, and for the sample of the same number: what does not depend on the pixel.
    cells: Arc<[Cell]>,
}

/// A cell and a sample of one number.
#[derive(Clone, Copy, Debug)]
struct Cell {
    /// Column and row of the cell.
    place: [f32; 2],
    /// What makes the sample's place in its cell of the pixel's key.
    jitter: [u32; 2],
}

/// One pixel's.
#[derive(Clone, Copy, Debug)]
pub(super) struct OfPixel<'a> {
    size: [f32; 2],
    samples: u32,
    key: u32,
    cells: &'a [Cell],
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
        let cell = |number| Cell {
            place: [(number % columns) as f32, (number / columns) as f32],
            jitter: [1, 2].map(|axis| step(number ^ step(axis))),
        };
        Self { columns, rows, samples, seed, cells: (0..columns * rows).map(cell).collect() }
    }

    #[inline]
    pub(super) fn of_pixel(&self, pixel: [i32; 2]) -> OfPixel<'_> {
        let size = [self.columns as f32, self.rows as f32];
        let key = mix(pixel[0] as u32, pixel[1] as u32, self.seed);
        OfPixel { size, samples: self.samples, key, cells: &self.cells }
    }
}

impl OfPixel<'_> {
    #[inline]
    pub(super) fn offset(&self, sample: u32) -> [f32; 2] {
        let cells = self.cells.len() as u32;
        let cell = if cells == self.samples { sample } else { permute(sample, cells, self.key) };
        let Cell { place, .. } = self.cells[cell as usize];
        let Cell { jitter, .. } = self.cells[sample as usize];
        [0, 1].map(|axis| {
            // `mix` of the key, the sample and 1 or 2.
            let jitter = unit(step(self.key ^ jitter[axis]));
            // Rounding up to 1 would put the sample into the next pixel.
            ((place[axis] + jitter) / self.size[axis]).min(1.0 - f32::EPSILON / 2.0)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_of_a_mix_is_part_of_it() {
        let positions = Stratified::new(16, 3);
        for (sample, cell) in positions.cells.iter().enumerate() {
            for key in [0, 1, 0x1234_5678, u32::MAX] {
                let whole = [1, 2].map(|axis| mix(key, sample as u32, axis));
                assert_eq!(cell.jitter.map(|jitter| step(key ^ jitter)), whole);
            }
        }
    }

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
