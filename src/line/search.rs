//! The exact search: the same lines as [`super::brute`], bit for bit, without looking at most pairs.
//!
//! Pairs fall in two kinds. Where the neighbour outranks the target, the line is the neighbour's: the pair of highest rank
//! is seen. Only where there is none, the line is the target's own: the nearest pair is seen. So for each target
//!
//! 1. blocks, and in them pixels, are visited from the highest rank down, until what remains is outranked by the pair
//!    already found or by the target itself;
//! 2. if that found nothing and the target draws lines, the blocks are visited for the nearest neighbour that differs.
//!
//! What cannot matter is left out at five levels, each time because nothing in it can differ or because it is too far for
//! the widest line in it: blocks for a block of targets (where most of a picture ends), blocks and pixels for a pixel of
//! targets, blocks and pixels for a target. The pair that the previous target saw is tried first: it is often this one's
//! too, and then its rank and distance cut off nearly all the rest.
//!
//! Measured on `tests/bench/line_search.rs`, nanoseconds per sample at (1 px, 16 samples), (16 px, 16) and (16 px, 64):
//! each target going through all pixels of a near block 46, 342, 738; pixels sifted once per pixel of targets 19, 241, 740;
//! and distances compared before anything else is read of a neighbour (as it is now) 18, 178, 494.

use super::bounds::{Block, Bounds, PathBounds, PixelNodes};
use super::pair::{Found, LineNode, Pair, Rank, distance_squared};
use super::window::{PathTile, PathWindow};
use super::{LineCounts, Rules};
use crate::sample::PixelRect;

/// The line that each target sees which is not yet `lined`, in no particular order.
pub(super) fn find(
    window: &PathWindow<'_>,
    targets: &PathTile<'_>,
    lined: &[bool],
    rules: &Rules,
    counts: &mut LineCounts,
) -> Vec<Found> {
    let mut search = Search {
        window,
        rules,
        tiles: Vec::new(),
        near_block: Vec::new(),
        near_pixel: Vec::new(),
        pixels: Vec::new(),
        pairs_tested: 0,
    };
    let mut found = Vec::new();
    search.collect_tiles(targets);
    if search.tiles.is_empty() {
        return found;
    }
    for block in &targets.bounds.blocks {
        search.collect_blocks(block);
        if search.near_block.is_empty() {
            continue;
        }
        let mut previous = None;
        for pixel in targets.bounds.pixels(block) {
            search.collect_for_pixel(pixel);
            if search.near_pixel.is_empty() {
                continue;
            }
            for row in pixel.first as usize..pixel.end as usize {
                if lined[targets.nodes.sample[row] as usize] {
                    continue;
                }
                if let Some(pair) = search.seen(pixel, &targets.node(pixel.pixel, row), previous) {
                    found.push(Found { row, path: targets.nodes.path, pair });
                    previous = Some(pair);
                }
            }
        }
    }
    counts.pairs_tested += search.pairs_tested;
    found
}

/// A block that may hold neighbours.
#[derive(Clone, Copy)]
struct Near<'w> {
    /// Place of its tile in the window.
    tile: usize,
    block: &'w Block,
    /// Smallest squared distance from the pixel of targets.
    gap_squared: f32,
    /// Its pixels in [`Search::pixels`], once they have been sifted for the pixel of targets.
    sifted: Option<(usize, usize)>,
}

/// Scratch of one search, narrowed from level to level.
struct Search<'w, 'a> {
    window: &'w PathWindow<'a>,
    rules: &'w Rules,
    /// Tiles that may hold neighbours of the tile of targets.
    tiles: Vec<(usize, &'w PathTile<'a>)>,
    /// Blocks that may hold neighbours of the current block of targets.
    near_block: Vec<Near<'w>>,
    /// Those that may hold neighbours of the current pixel of targets, by best rank, then by distance.
    near_pixel: Vec<Near<'w>>,
    /// Pixels of those blocks that may hold neighbours of the current pixel of targets, block by block, in each by best
    /// rank.
    pixels: Vec<&'w PixelNodes>,
    pairs_tested: u64,
}

impl<'w> Search<'w, '_> {
    fn collect_tiles(&mut self, targets: &PathTile<'_>) {
        let reach = targets.buffer.rect.grown(self.rules.reach());
        let tests = self.rules.tests();
        self.tiles.extend(
            self.window
                .tiles_in(reach)
                .filter(|(_, tile)| targets.bounds.bounds.may_differ(&tile.bounds.bounds, tests)),
        );
    }

    fn collect_blocks(&mut self, targets: &Block) {
        self.near_block.clear();
        for &(tile, nodes) in &self.tiles {
            let bounds: &'w PathBounds = nodes.bounds;
            for block in &bounds.blocks {
                if self.may_matter(&targets.rect, &targets.bounds, &block.rect, &block.bounds).is_some() {
                    self.near_block.push(Near { tile, block, gap_squared: 0.0, sifted: None });
                }
            }
        }
    }

    fn collect_for_pixel(&mut self, targets: &PixelNodes) {
        let rect = pixel_rect(targets.pixel);
        let mut near = std::mem::take(&mut self.near_pixel);
        near.clear();
        for &candidate in &self.near_block {
            let block = candidate.block;
            if let Some(gap_squared) = self.may_matter(&rect, &targets.bounds, &block.rect, &block.bounds) {
                near.push(Near { gap_squared, ..candidate });
            }
        }
        near.sort_unstable_by(|a, b| {
            let by_rank = a.block.bounds.best.compare(b.block.bounds.best);
            by_rank.then(a.gap_squared.total_cmp(&b.gap_squared))
        });
        self.near_pixel = near;
        self.pixels.clear();
    }

    /// The pixels of a near block that may hold neighbours of the pixel of targets, as a range of [`Self::pixels`].
    ///
    /// Sifted when the first target asks: for most pixels of targets, ranks and distances found so far cut off most
    /// blocks before.
    fn sifted(&mut self, near: usize, targets: &PixelNodes) -> (usize, usize) {
        let Near { tile, block, sifted, .. } = self.near_pixel[near];
        if let Some(range) = sifted {
            return range;
        }
        let first = self.pixels.len();
        if let Some(nodes) = &self.window.tiles[tile] {
            let bounds: &'w PathBounds = nodes.bounds;
            for pixel in bounds.pixels(block) {
                let [target, neighbor] = [targets.pixel, pixel.pixel].map(pixel_rect);
                if self.may_matter(&target, &targets.bounds, &neighbor, &pixel.bounds).is_some() {
                    self.pixels.push(pixel);
                }
            }
        }
        let range = (first, self.pixels.len());
        self.near_pixel[near].sifted = Some(range);
        range
    }

    /// The smallest squared distance between targets and neighbours of two rectangles, if they may make lines.
    #[inline]
    fn may_matter(
        &self,
        target_rect: &PixelRect,
        targets: &Bounds,
        neighbor_rect: &PixelRect,
        neighbors: &Bounds,
    ) -> Option<f32> {
        let gap_squared = rect_gap_squared(target_rect, neighbor_rect);
        let near = gap_squared < targets.radius_squared.max(neighbors.radius_squared);
        (near && targets.may_differ(neighbors, self.rules.tests())).then_some(gap_squared)
    }

    /// The pair that a target sees.
    fn seen(&mut self, targets: &PixelNodes, t: &LineNode, guess: Option<Pair>) -> Option<Pair> {
        let as_bounds = Bounds::of_node(&t.features, t.rank, t.radius_squared);
        let mut best = None;
        if let Some(Pair { tile, pixel, row, .. }) = guess {
            self.pairs_tested += 1;
            self.test(t, tile, pixel, row, &mut best);
        }
        self.search_outranking(targets, t, &as_bounds, &mut best);
        if best.is_none_or(|pair: Pair| pair.own) && t.radius_squared > 0.0 {
            self.search_nearest(targets, t, &as_bounds, &mut best);
        }
        best
    }

    /// Looks for the highest-ranking valid pair whose neighbour outranks the target.
    fn search_outranking(&mut self, targets: &PixelNodes, t: &LineNode, as_bounds: &Bounds, best: &mut Option<Pair>) {
        let tests = self.rules.tests();
        for i in 0..self.near_pixel.len() {
            let Near { tile, block, .. } = self.near_pixel[i];
            // Sorted by rank: no later block can win either.
            if !may_win(t, best, block.bounds.best) {
                break;
            }
            let gap_squared = target_gap_squared(t, &block.rect);
            if gap_squared >= block.bounds.radius_squared || !as_bounds.may_differ(&block.bounds, tests) {
                continue;
            }
            let Some(nodes) = &self.window.tiles[tile] else { continue };
            let (first, end) = self.sifted(i, targets);
            for pixel in first..end {
                let pixel = self.pixels[pixel];
                if !may_win(t, best, pixel.bounds.best) {
                    break;
                }
                let gap_squared = target_gap_squared(t, &pixel_rect(pixel.pixel));
                if gap_squared >= pixel.bounds.radius_squared
                    || loses_by_distance(best, pixel.bounds.best, gap_squared)
                    || !as_bounds.may_differ(&pixel.bounds, tests)
                {
                    continue;
                }
                self.pairs_tested += u64::from(pixel.end - pixel.first);
                for row in pixel.first as usize..pixel.end as usize {
                    if may_win(t, best, nodes.rank(row))
                        && distance_squared(t, pixel.pixel, nodes.offset(row)) < pixel.bounds.radius_squared
                    {
                        self.test(t, tile, pixel.pixel, row, best);
                    }
                }
            }
        }
    }

    /// Looks for the nearest neighbour that differs and does not outrank the target.
    fn search_nearest(&mut self, targets: &PixelNodes, t: &LineNode, as_bounds: &Bounds, best: &mut Option<Pair>) {
        let tests = self.rules.tests();
        let too_far = |best: &Option<Pair>, distance: f32| match best {
            Some(pair) => distance > pair.distance_squared,
            None => distance >= t.radius_squared,
        };
        for i in 0..self.near_pixel.len() {
            let Near { tile, block, gap_squared, .. } = self.near_pixel[i];
            if too_far(best, gap_squared)
                || block.bounds.worst.outranks(t.rank)
                || too_far(best, target_gap_squared(t, &block.rect))
                || !as_bounds.may_differ(&block.bounds, tests)
            {
                continue;
            }
            let Some(nodes) = &self.window.tiles[tile] else { continue };
            let (first, end) = self.sifted(i, targets);
            for pixel in first..end {
                let pixel = self.pixels[pixel];
                if too_far(best, target_gap_squared(t, &pixel_rect(pixel.pixel)))
                    || pixel.bounds.worst.outranks(t.rank)
                    || !as_bounds.may_differ(&pixel.bounds, tests)
                {
                    continue;
                }
                self.pairs_tested += u64::from(pixel.end - pixel.first);
                for row in pixel.first as usize..pixel.end as usize {
                    if !too_far(best, distance_squared(t, pixel.pixel, nodes.offset(row))) {
                        self.test(t, tile, pixel.pixel, row, best);
                    }
                }
            }
        }
    }

    /// Keeps a pair if it is valid and beats the best.
    #[inline]
    fn test(&self, t: &LineNode, tile: usize, pixel: [i32; 2], row: usize, best: &mut Option<Pair>) {
        let Some(nodes) = &self.window.tiles[tile] else { return };
        let rank = nodes.rank(row);
        let own = !rank.outranks(t.rank);
        let distance_squared = distance_squared(t, pixel, nodes.offset(row));
        let (rank, radius_squared) =
            if own { (t.rank, t.radius_squared) } else { (rank, nodes.bounds.radius_squared.get(row)) };
        if distance_squared >= radius_squared {
            return;
        }
        let pair = Pair { rank, distance_squared, pixel, tile, row, own };
        if best.is_none_or(|best| pair.beats(&best)) && self.rules.tests().differ(&t.features, &nodes.features(row)) {
            *best = Some(pair);
        }
    }
}

/// Whether a neighbour of this rank may outrank the target and all that was found so far.
#[inline]
fn may_win(t: &LineNode, best: &Option<Pair>, rank: Rank) -> bool {
    rank.outranks(t.rank) && best.is_none_or(|best| !best.rank.outranks(rank))
}

/// Whether neighbours of at most this rank and at least this distance can only tie in rank and are too far then.
#[inline]
fn loses_by_distance(best: &Option<Pair>, rank: Rank, distance_squared: f32) -> bool {
    best.is_some_and(|best| best.rank == rank && distance_squared > best.distance_squared)
}

/// The smallest squared distance that [`distance_squared`] can give between a target in one rectangle and a neighbour in
/// another.
#[inline]
fn rect_gap_squared(targets: &PixelRect, neighbors: &PixelRect) -> f32 {
    let gap = |t0: i32, t1: i32, n0: i32, n1: i32| (n0 - t1).max(t0 - n1).max(0) as f32;
    let x = gap(targets.x0, targets.x1, neighbors.x0, neighbors.x1);
    let y = gap(targets.y0, targets.y1, neighbors.y0, neighbors.y1);
    x * x + y * y
}

/// The smallest squared distance that [`distance_squared`] can give from a target to a neighbour in a rectangle. Its
/// operations are the same, at the nearest offset there is; they are monotone, so no rounding makes this too large.
#[inline]
fn target_gap_squared(t: &LineNode, rect: &PixelRect) -> f32 {
    let gap = |pixel: i32, offset: f32, first: i32, end: i32| {
        let before = (first - pixel) as f32 + (0.0 - offset);
        let behind = (end - 1 - pixel) as f32 + (1.0 - offset);
        before.max(-behind).max(0.0)
    };
    let x = gap(t.pixel[0], t.offset[0], rect.x0, rect.x1);
    let y = gap(t.pixel[1], t.offset[1], rect.y0, rect.y1);
    x * x + y * y
}

fn pixel_rect([x, y]: [i32; 2]) -> PixelRect {
    PixelRect { x0: x, y0: y, x1: x + 1, y1: y + 1 }
}
