//! Jittered positions: every sample in a cell of its own.

use std::sync::Arc;

use super::{mix, permute, step, unit};

/// A grid of cells over each pixel.
#[derive(Clone, Debug)]
pub(super) struct Stratified {
    samples: u32,
    seed: u32,
    cells: Arc<Cells>,
}

/// What does not depend on the pixel.
#[derive(Debug)]
struct Cells {
    /// Column and row of each cell.
    places: Vec<[f32; 2]>,
    /// For each sample, what makes its place in its cell of the pixel's key.
    jitters: Vec<[u32; 2]>,
    /// Columns and rows of the grid, as often as there are cells: so that all of these are numbers that stand side by side.
    sizes: Vec<[f32; 2]>,
}

/// One pixel's.
#[derive(Clone, Copy, Debug)]
pub(super) struct OfPixel<'a> {
    samples: u32,
    key: u32,
    cells: &'a Cells,
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
        let cells = Cells {
            places: (0..columns * rows).map(|cell| [(cell % columns) as f32, (cell / columns) as f32]).collect(),
            jitters: (0..samples).map(|sample| [1, 2].map(|axis| step(sample ^ step(axis)))).collect(),
            sizes: vec![[columns as f32, rows as f32]; (columns * rows) as usize],
        };
        Self { samples, seed, cells: Arc::new(cells) }
    }

    #[inline(always)]
    pub(super) fn of_pixel(&self, pixel: [i32; 2]) -> OfPixel<'_> {
        let key = mix(pixel[0] as u32, pixel[1] as u32, self.seed);
        OfPixel { samples: self.samples, key, cells: &self.cells }
    }
}

impl OfPixel<'_> {
    const LARGEST: f32 = 1.0 - f32::EPSILON / 2.0;

    #[inline]
    pub(super) fn offset(&self, sample: u32) -> [f32; 2] {
        let Cells { places, jitters, sizes } = self.cells;
        let cells = places.len() as u32;
        let cell = if cells == self.samples { sample } else { permute(sample, cells, self.key) };
        let (place, jitter) = (places[cell as usize], jitters[sample as usize]);
        [0, 1].map(|axis| self.along(place[axis], jitter[axis], sizes[0][axis]))
    }

    /// The offsets of all samples.
    #[inline(always)]
    pub(super) fn fill(&self, offsets: &mut [[f32; 2]]) {
        let Cells { places, jitters, sizes } = self.cells;
        if places.len() == offsets.len() {
            let cells = places.as_flattened().iter().zip(jitters.as_flattened()).zip(sizes.as_flattened());
            for (offset, ((place, jitter), size)) in offsets.as_flattened_mut().iter_mut().zip(cells) {
                *offset = self.along(*place, *jitter, *size);
            }
        } else {
            for (sample, offset) in (0..).zip(offsets) {
                *offset = self.offset(sample);
            }
        }
    }

    /// Place along one axis: in a cell, by what makes it of the key, in a grid of some cells.
    #[inline(always)]
    fn along(&self, place: f32, jitter: u32, size: f32) -> f32 {
        // `mix` of the key, the sample and 1 or 2.
        let jitter = unit(step(self.key ^ jitter));
        // Rounding up to 1 would put the sample into the next pixel.
        let offset = (place + jitter) / size;
        if offset < Self::LARGEST { offset } else { Self::LARGEST }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_of_a_mix_is_part_of_it() {
        let positions = Stratified::new(16, 3);
        for (sample, jitter) in positions.cells.jitters.iter().enumerate() {
            for key in [0, 1, 0x1234_5678, u32::MAX] {
                let whole = [1, 2].map(|axis| mix(key, sample as u32, axis));
                assert_eq!(jitter.map(|jitter| step(key ^ jitter)), whole);
            }
        }
    }

    #[test]
    fn every_sample_has_a_cell_of_its_own() {
        for samples in [1, 2, 3, 4, 5, 7, 9, 11, 16, 64, 100] {
            let positions = Stratified::new(samples, 3);
            let [columns, rows] = positions.cells.sizes[0].map(|size| size as u32);
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
