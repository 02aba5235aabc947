//! How a picture is cut: tiles, and strips of tiles along the picture's long side.

use crate::sample::PixelRect;

/// The tiles of a rectangle of pixels, in strips that run across its short side.
///
/// Strips are worked on in order, and only a few are in memory at a time, so memory grows with the short side of the
/// picture alone.
#[derive(Clone, Debug)]
pub(crate) struct Grid {
    /// All pixels that are sampled.
    pub region: PixelRect,
    /// Side of a tile in pixels; those at the right and lower border may be smaller.
    pub tile: i32,
    /// Tiles per row of the grid.
    pub columns: usize,
    rows: usize,
    /// Whether strips are columns of tiles (wide pictures) or rows (tall ones).
    strips_are_columns: bool,
}

impl Grid {
    pub fn new(region: PixelRect, tile: u32) -> Self {
        let tile = tile as i32;
        let count = |pixels: u32| pixels.div_ceil(tile as u32) as usize;
        Self {
            region,
            tile,
            columns: count(region.width()),
            rows: count(region.height()),
            strips_are_columns: region.width() >= region.height(),
        }
    }

    pub fn tiles(&self) -> usize {
        self.columns * self.rows
    }

    pub fn strips(&self) -> usize {
        if self.strips_are_columns { self.columns } else { self.rows }
    }

    /// The tiles of a strip, as indices into the grid row by row; none beyond the last strip.
    pub fn strip(&self, index: usize) -> Vec<usize> {
        if index >= self.strips() {
            Vec::new()
        } else if self.strips_are_columns {
            (0..self.rows).map(|row| row * self.columns + index).collect()
        } else {
            (0..self.columns).map(|column| index * self.columns + column).collect()
        }
    }

    /// The tiles within `margin` pixels around a tile, that one among them.
    pub fn around(&self, tile: usize, margin: i32) -> Part {
        let rect = self.rect(tile).grown(margin).intersection(&self.region);
        let place = |x: i32, origin: i32| ((x - origin) / self.tile) as usize;
        let columns = place(rect.x0, self.region.x0)..place(rect.x1 - 1, self.region.x0) + 1;
        let rows = place(rect.y0, self.region.y0)..place(rect.y1 - 1, self.region.y0) + 1;
        let side = |index: usize| index as i32 * self.tile;
        Part {
            origin: [self.region.x0 + side(columns.start), self.region.y0 + side(rows.start)],
            columns: columns.len(),
            tiles: rows.flat_map(|row| columns.clone().map(move |column| row * self.columns + column)).collect(),
        }
    }

    /// The pixels of a tile.
    pub fn rect(&self, tile: usize) -> PixelRect {
        let x0 = self.region.x0 + (tile % self.columns) as i32 * self.tile;
        let y0 = self.region.y0 + (tile / self.columns) as i32 * self.tile;
        PixelRect { x0, y0, x1: x0 + self.tile, y1: y0 + self.tile }.intersection(&self.region)
    }
}

/// A rectangle of tiles within a grid.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Part {
    /// Upper left pixel.
    pub origin: [i32; 2],
    /// Tiles per row of the part.
    pub columns: usize,
    /// Row by row, as indices into the grid.
    pub tiles: Vec<usize>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_every_pixel_once_in_either_orientation() {
        for size in [[100, 30], [30, 100], [1, 1], [64, 64]] {
            let region = PixelRect::of_size(size).intersection(&PixelRect { x0: 0, y0: 0, x1: 90, y1: 200 });
            let grid = Grid::new(region, 32);
            let mut seen: Vec<usize> = (0..grid.strips()).flat_map(|strip| grid.strip(strip)).collect();
            seen.sort_unstable();
            assert_eq!(seen, (0..grid.tiles()).collect::<Vec<_>>());
            let pixels: usize = seen.iter().map(|tile| grid.rect(*tile).pixels()).sum();
            assert_eq!(pixels, region.pixels());
        }
    }

    #[test]
    fn a_part_holds_the_tiles_that_a_margin_touches() {
        let grid = Grid::new(PixelRect { x0: 5, y0: 7, x1: 105, y1: 50 }, 10);
        assert_eq!(grid.around(0, 1), Part { origin: [5, 7], columns: 2, tiles: vec![0, 1, 10, 11] });
        assert_eq!(grid.around(12, 0), Part { origin: [25, 17], columns: 1, tiles: vec![12] });
        assert_eq!(
            grid.around(49, 11),
            Part { origin: [75, 27], columns: 3, tiles: vec![27, 28, 29, 37, 38, 39, 47, 48, 49] }
        );
    }

    #[test]
    fn strips_run_across_the_short_side() {
        let wide = Grid::new(PixelRect::of_size([320, 64]), 32);
        assert_eq!((wide.strips(), wide.strip(0).len()), (10, 2));
        let tall = Grid::new(PixelRect::of_size([64, 320]), 32);
        assert_eq!((tall.strips(), tall.strip(0).len()), (10, 2));
    }
}
