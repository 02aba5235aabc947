//! Which blocks of a picture a pass renders.
//!
//! Blocks are squares of pixels that are fixed to the picture, not to `--tile` or a crop, so that what is decided by block
//! is the same however a picture is cut. A masked pass makes, in the blocks that are wanted, the pixels of the whole
//! picture, bit for bit: samples are traced as far around them as lines and the pixel filter reach.

use crate::sample::PixelRect;

/// Some blocks of a picture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Mask {
    /// Side of a block in pixels.
    side: i32,
    /// The pixels that blocks are cut at.
    region: PixelRect,
    /// Blocks per row of the picture.
    columns: usize,
    wanted: Vec<bool>,
}

impl Mask {
    /// The blocks of a picture for which `wanted` holds, by column and row, as far as they lie in `region`.
    pub fn new(size: [u32; 2], region: PixelRect, side: u32, wanted: impl Fn([usize; 2]) -> bool) -> Self {
        let [columns, rows] = size.map(|pixels| pixels.div_ceil(side.max(1)) as usize);
        let region = region.intersection(&PixelRect::of_size(size));
        let mut mask = Self { side: side.max(1) as i32, region, columns, wanted: vec![false; columns * rows] };
        for index in 0..mask.wanted.len() {
            mask.wanted[index] = mask.rect(index).pixels() > 0 && wanted([index % columns, index / columns]);
        }
        mask
    }

    /// Some of the blocks.
    pub fn of(&self, blocks: &[usize]) -> Self {
        let mut wanted = vec![false; self.wanted.len()];
        blocks.iter().for_each(|index| wanted[*index] = true);
        Self { wanted, ..self.clone() }
    }

    /// The wanted blocks, as indices row by row.
    pub fn blocks(&self) -> impl Iterator<Item = usize> {
        (0..self.wanted.len()).filter(|index| self.wanted[*index])
    }

    /// The pixels of a block.
    pub fn rect(&self, index: usize) -> PixelRect {
        let [x0, y0] = [index % self.columns, index / self.columns].map(|place| place as i32 * self.side);
        PixelRect { x0, y0, x1: x0 + self.side, y1: y0 + self.side }.intersection(&self.region)
    }

    /// The pixels of the wanted blocks that lie in a rectangle, block by block.
    pub fn parts_of(&self, rect: PixelRect) -> Vec<PixelRect> {
        let cut = rect.intersection(&self.region);
        if cut.pixels() == 0 {
            return Vec::new();
        }
        let place = |at: i32| (at / self.side) as usize;
        let mut parts = Vec::new();
        for row in place(cut.y0)..=place(cut.y1 - 1) {
            for column in place(cut.x0)..=place(cut.x1 - 1) {
                let index = row * self.columns + column;
                if self.wanted[index] {
                    parts.push(self.rect(index).intersection(&rect));
                }
            }
        }
        parts
    }

    /// The smallest part of a rectangle that holds all its pixels within `margin` of wanted blocks; `None` if it has none.
    pub fn needed(&self, rect: PixelRect, margin: i32) -> Option<PixelRect> {
        let near = self.parts_of(rect.grown(margin));
        let near = near.into_iter().map(|part| part.grown(margin).intersection(&rect));
        near.filter(|part| part.pixels() > 0).reduce(|all, part| all.union(&part))
    }

    /// The smallest rectangle that holds all wanted blocks; empty if there are none.
    pub fn extent(&self) -> PixelRect {
        let empty = PixelRect { x0: 0, y0: 0, x1: 0, y1: 0 };
        self.blocks().map(|index| self.rect(index)).reduce(|all, rect| all.union(&rect)).unwrap_or(empty)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CROP: PixelRect = PixelRect { x0: 10, y0: 3, x1: 50, y1: 30 };

    fn checkers() -> Mask {
        Mask::new([50, 40], CROP, 16, |[column, row]| (column + row) % 2 == 0)
    }

    #[test]
    fn parts_are_the_wanted_pixels() {
        let mask = checkers();
        let wanted = |x: i32, y: i32| CROP.contains(x, y) && (x / 16 + y / 16) % 2 == 0;
        for rect in [PixelRect::of_size([50, 40]), PixelRect { x0: 14, y0: -5, x1: 33, y1: 17 }] {
            for y in rect.y0..rect.y1 {
                for x in rect.x0..rect.x1 {
                    let parts = mask.parts_of(rect);
                    let count = parts.iter().filter(|part| part.contains(x, y)).count();
                    assert_eq!(count, usize::from(wanted(x, y)), "{x}, {y}");
                    assert!(parts.iter().all(|part| part.intersection(&rect) == *part));
                }
            }
        }
        assert_eq!(mask.blocks().collect::<Vec<_>>(), [0, 2, 5, 7]);
        assert_eq!(mask.extent(), CROP);
    }

    #[test]
    fn what_is_needed_is_the_smallest_rectangle_of_near_pixels() {
        let mask = checkers();
        let all = PixelRect::of_size([50, 40]);
        let wanted: Vec<_> = mask.parts_of(all);
        for margin in [0, 1, 5] {
            for (x0, y0) in [(0, 0), (16, 0), (5, 13), (40, 30), (0, 36)] {
                let rect = PixelRect { x0, y0, x1: x0 + 8, y1: y0 + 4 };
                let near = |x: i32, y: i32| wanted.iter().any(|part| part.grown(margin).contains(x, y));
                let pixels: Vec<_> =
                    (y0..y0 + 4).flat_map(|y| (x0..x0 + 8).map(move |x| (x, y))).filter(|&(x, y)| near(x, y)).collect();
                let bounds = pixels
                    .iter()
                    .map(|&(x, y)| PixelRect { x0: x, y0: y, x1: x + 1, y1: y + 1 })
                    .reduce(|all, pixel| all.union(&pixel));
                assert_eq!(mask.needed(rect, margin), bounds, "{rect:?} with {margin}");
            }
        }
    }
}
