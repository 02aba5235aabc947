//! Pixels on their way from tiles of any size and order to the blocks of a file.
//!
//! A picture is cut into blocks of [`SIDE`] pixels. Blocks that tiles have filled only in part wait in memory; a full
//! one is packed and appended to a *spool*, a nameless file, which remembers nothing but where each block lies. So
//! memory holds the blocks along the border between what is done and what is not, whatever the size of the picture,
//! and the final file can be written in one fixed order: its bytes do not depend on the order of the tiles. The price
//! is that for the moment of finishing, the disk holds the picture twice.

use std::collections::BTreeMap;
use std::io::{self, Read, Seek, SeekFrom, Write};

use crate::sample::PixelRect;

/// Side of a block in pixels.
pub(super) const SIDE: i32 = 64;

/// Where packed blocks wait: a file, except in tests that make the disk fail.
pub(super) trait Spool: Read + Write + Seek + Send {}

impl<T: Read + Write + Seek + Send> Spool for T {}

/// A block whose pixels are all there.
#[derive(Debug)]
pub(super) struct Block {
    /// Its place in row order.
    pub index: usize,
    /// Its pixels.
    pub rect: PixelRect,
    /// For each row, for each plane: the values of the row.
    pub bytes: Vec<u8>,
}

/// A pixel came twice.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Twice;

/// The blocks of a picture.
pub(super) struct Blocks {
    rect: PixelRect,
    /// Bytes per value of each plane.
    value_bytes: Vec<usize>,
    partial: BTreeMap<usize, Partial>,
    /// Where each packed block lies in the spool: start and length, which is 0 for a block that is not there.
    places: Vec<(u64, u32)>,
    spool: Box<dyn Spool>,
    spool_end: u64,
}

struct Partial {
    bytes: Vec<u8>,
    missing: usize,
}

impl Blocks {
    /// No pixels yet. `value_bytes` are the bytes of one value in each plane.
    pub(super) fn new(rect: PixelRect, value_bytes: Vec<usize>, spool: Box<dyn Spool>) -> Self {
        let count = blocks_along(rect.width()) * blocks_along(rect.height());
        Self { rect, value_bytes, partial: BTreeMap::new(), places: vec![(0, 0); count], spool, spool_end: 0 }
    }

    /// Blocks in a row.
    pub(super) fn columns(&self) -> usize {
        blocks_along(self.rect.width())
    }

    /// Blocks in all.
    pub(super) fn count(&self) -> usize {
        self.places.len()
    }

    /// The pixels of a block.
    pub(super) fn block_rect(&self, index: usize) -> PixelRect {
        let x0 = self.rect.x0 + (index % self.columns()) as i32 * SIDE;
        let y0 = self.rect.y0 + (index / self.columns()) as i32 * SIDE;
        PixelRect { x0, y0, x1: x0 + SIDE, y1: y0 + SIDE }.intersection(&self.rect)
    }

    /// Bytes of a block's pixels.
    pub(super) fn block_bytes(&self, rect: PixelRect) -> usize {
        rect.pixels() * self.value_bytes.iter().sum::<usize>()
    }

    /// Takes in the planes of a rectangle of pixels, leaves out what is outside the picture, and hands out the blocks
    /// that this fills.
    pub(super) fn put(&mut self, rect: PixelRect, planes: &[Vec<u8>]) -> Result<Vec<Block>, Twice> {
        let inside = rect.intersection(&self.rect);
        let mut full = Vec::new();
        if inside.pixels() == 0 {
            return Ok(full);
        }
        let block = |at: i32, start: i32| ((at - start) / SIDE) as usize;
        for row in block(inside.y0, self.rect.y0)..=block(inside.y1 - 1, self.rect.y0) {
            for column in block(inside.x0, self.rect.x0)..=block(inside.x1 - 1, self.rect.x0) {
                full.extend(self.put_into(row * self.columns() + column, rect, planes)?);
            }
        }
        Ok(full)
    }

    fn put_into(&mut self, index: usize, rect: PixelRect, planes: &[Vec<u8>]) -> Result<Option<Block>, Twice> {
        if self.places[index].1 > 0 {
            return Err(Twice);
        }
        let block_rect = self.block_rect(index);
        let bytes = self.block_bytes(block_rect);
        let partial = self
            .partial
            .entry(index)
            .or_insert_with(|| Partial { bytes: vec![0; bytes], missing: block_rect.pixels() });
        let overlap = block_rect.intersection(&rect);
        partial.missing = partial.missing.checked_sub(overlap.pixels()).ok_or(Twice)?;

        let width = overlap.width() as usize;
        for y in overlap.y0..overlap.y1 {
            let mut row = (y - block_rect.y0) as usize * bytes / block_rect.height() as usize;
            for (plane, size) in planes.iter().zip(&self.value_bytes) {
                let from = ((y - rect.y0) as usize * rect.width() as usize + (overlap.x0 - rect.x0) as usize) * size;
                let to = row + (overlap.x0 - block_rect.x0) as usize * size;
                partial.bytes[to..to + width * size].copy_from_slice(&plane[from..from + width * size]);
                row += block_rect.width() as usize * size;
            }
        }
        if partial.missing > 0 {
            return Ok(None);
        }
        let bytes = self.partial.remove(&index).map(|partial| partial.bytes).unwrap_or_default();
        Ok(Some(Block { index, rect: block_rect, bytes }))
    }

    /// Hands out the blocks that were begun and will not be completed; what they miss is 0.
    pub(super) fn take_partial(&mut self) -> Vec<Block> {
        let partial = std::mem::take(&mut self.partial);
        let block =
            |(index, partial): (usize, Partial)| Block { index, rect: self.block_rect(index), bytes: partial.bytes };
        partial.into_iter().map(block).collect()
    }

    /// Keeps a packed block in the spool.
    pub(super) fn store(&mut self, index: usize, packed: &[u8]) -> io::Result<()> {
        let length = u32::try_from(packed.len()).map_err(io::Error::other)?;
        self.spool.seek(SeekFrom::Start(self.spool_end))?;
        self.spool.write_all(packed)?;
        self.places[index] = (self.spool_end, length);
        self.spool_end += u64::from(length);
        Ok(())
    }

    /// Length of a packed block, if it is there.
    pub(super) fn stored_bytes(&self, index: usize) -> Option<u64> {
        let (_, length) = self.places[index];
        (length > 0).then_some(u64::from(length))
    }

    /// Reads a packed block, if it is there.
    pub(super) fn load(&mut self, index: usize) -> io::Result<Option<Vec<u8>>> {
        let (start, length) = self.places[index];
        if length == 0 {
            return Ok(None);
        }
        let mut packed = vec![0; length as usize];
        self.spool.seek(SeekFrom::Start(start))?;
        self.spool.read_exact(&mut packed)?;
        Ok(Some(packed))
    }
}

fn blocks_along(pixels: u32) -> usize {
    pixels.div_ceil(SIDE as u32) as usize
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    /// The most bytes that waited while strips of tiles ran down a picture, one after another.
    fn most_waiting(size: [u32; 2], tile: i32) -> usize {
        let picture = PixelRect::of_size(size);
        let mut blocks = Blocks::new(picture, vec![2, 4], Box::new(Cursor::new(Vec::new())));
        let mut most = 0;
        for x0 in (0..picture.x1).step_by(tile as usize) {
            for y0 in (0..picture.y1).step_by(tile as usize) {
                let rect = PixelRect { x0, y0, x1: x0 + tile, y1: y0 + tile }.intersection(&picture);
                let planes = [2, 4].map(|size| vec![7; rect.pixels() * size]);
                for block in blocks.put(rect, &planes).unwrap() {
                    assert!(block.bytes.iter().all(|byte| *byte == 7));
                    blocks.store(block.index, &block.bytes).unwrap();
                }
                most = most.max(blocks.partial.values().map(|partial| partial.bytes.len()).sum());
            }
        }
        assert_eq!(stored(&mut blocks), picture.pixels() * 6);
        most
    }

    fn stored(blocks: &mut Blocks) -> usize {
        (0..blocks.count()).map(|index| blocks.load(index).unwrap().unwrap().len()).sum()
    }

    #[test]
    fn what_waits_grows_with_the_short_side_alone() {
        for tile in [8, 32, 100] {
            let short = most_waiting([500, 200], tile);
            assert_eq!(most_waiting([1000, 200], tile), short);
            // At most two blocks across a strip's border, all along it.
            assert!(short <= 2 * 200_usize.next_multiple_of(64) * 64 * 6, "{short}");
        }
        assert_eq!(most_waiting([500, 200], 64), 0);
    }

    #[test]
    fn pixels_that_come_twice_are_told() {
        let new = || Blocks::new(PixelRect::of_size([100, 100]), vec![1], Box::new(Cursor::new(Vec::new())));
        let put =
            |blocks: &mut Blocks, rect: PixelRect| blocks.put(rect, &[vec![1; rect.pixels()]]).map(|full| full.len());
        let mut blocks = new();
        let part = PixelRect::of_size([50, 50]);
        assert_eq!(put(&mut blocks, part), Ok(0));
        assert_eq!(put(&mut blocks, PixelRect::of_size([64, 64])), Err(Twice));

        let mut blocks = new();
        let full = blocks.put(PixelRect::of_size([64, 64]), &[vec![1; 4096]]).unwrap();
        blocks.store(full[0].index, &full[0].bytes).unwrap();
        assert_eq!(put(&mut blocks, part), Err(Twice));
        assert_eq!(put(&mut blocks, PixelRect { x0: 200, y0: 0, x1: 300, y1: 9 }), Ok(0));
    }
}
