//! The exact search: the same lines as [`super::brute`], bit for bit, without looking at most pairs.
//!
//! Pairs fall in two kinds. Where the neighbour outranks the target, the line is the neighbour's: the pair of highest rank
//! is seen. Only where there is none, the line is the target's own: the nearest pair is seen. The targets of one pixel are
//! searched together:
//!
//! 1. Blocks that cannot matter to the pixel are left out: nothing in them can differ, or they are too far for the widest
//!    line in them. Most pixels of a picture end here.
//! 2. For lines of neighbours, the *floor* is the rank that every target of the pixel is sure to see or to outdo: the
//!    lowest of the targets' own ranks and of the lines that the last pixel's answer gives them. Pixels are visited from
//!    the highest rank down; one that surely differs, is surely in reach and surely outranks raises the floor. What the
//!    floor outranks is never looked at. A handful of pixels remains, mostly on the rim of the stencil.
//! 3. For own lines, the *limit* is the distance within which every target is sure to find its nearest neighbour: that of
//!    the last pixel's answer, or the far side of a pixel that surely differs. Only pixels nearer than that are looked at.
//! 4. Each target goes through what remains, best first, until what it has found cannot be beaten.

use super::bounds::{Block, Bounded, NodeBounds, PathBounds, PixelNodes};
use super::differ::Tests;
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
        tests: rules.tests(),
        tiles: Vec::new(),
        near_block: Vec::new(),
        near_pixel: Vec::new(),
        candidates: Vec::new(),
        targets: Vec::new(),
        last_other: None,
        last_own: None,
        pairs_tested: 0,
    };
    let mut found = Vec::new();
    search.collect_tiles(targets, rules.reach());
    if search.tiles.is_empty() {
        return found;
    }
    for block in &targets.bounds.blocks {
        search.collect_blocks(block);
        if search.near_block.is_empty() {
            continue;
        }
        for place in block.first as usize..block.end as usize {
            search.search_pixel(targets, place, lined);
            let lines = search.targets.iter().filter_map(|target| Some((target.row, target.best?)));
            found.extend(lines.map(|(row, pair)| Found { row, path: targets.nodes.path, pair }));
        }
    }
    counts.pairs_tested += search.pairs_tested;
    found
}

/// A block that may hold neighbours.
#[derive(Clone, Copy)]
struct Near<'w> {
    /// Place of its tile in the window.
    tile: u32,
    bounds: &'w PathBounds,
    block: &'w Block,
    /// Smallest squared distance from the pixel of targets.
    gap_squared: f32,
}

/// A pixel that may hold neighbours.
#[derive(Clone, Copy)]
struct Candidate<'w> {
    /// Place of its tile in the window.
    tile: u32,
    /// Its place in the tile.
    place: u32,
    bounds: &'w PathBounds,
    pixel: &'w PixelNodes,
    /// Smallest squared distance from the pixel of targets.
    gap_squared: f32,
}

/// A target with the best pair found so far.
struct Target {
    row: usize,
    node: LineNode,
    bounds: NodeBounds,
    best: Option<Pair>,
}

impl Target {
    /// Whether a neighbour of this rank may outrank the target and all that was found so far.
    #[inline(always)]
    fn may_win(&self, rank: Rank) -> bool {
        rank.outranks(self.node.rank) && self.best.is_none_or(|best| !best.rank.outranks(rank))
    }

    /// Whether neighbours of at most this rank and at least this distance can only tie in rank and are too far then.
    #[inline(always)]
    fn loses_by_distance(&self, rank: Rank, distance_squared: f32) -> bool {
        self.best.is_some_and(|best| best.rank == rank && distance_squared > best.distance_squared)
    }

    /// Whether the target has no better line than its own, if it draws one.
    fn wants_own(&self) -> bool {
        self.node.radius_squared > 0.0 && self.best.is_none_or(|best| best.own)
    }

    /// The squared distance from which on a neighbour gives no better own line.
    #[inline(always)]
    fn too_far(&self, distance_squared: f32) -> bool {
        match self.best {
            Some(best) => distance_squared > best.distance_squared,
            None => distance_squared >= self.node.radius_squared,
        }
    }
}

/// Scratch of one search, narrowed from level to level.
struct Search<'w, 'a> {
    window: &'w PathWindow<'a>,
    tests: &'w Tests,
    /// Tiles that may hold neighbours of the tile of targets.
    tiles: Vec<(u32, &'w PathTile<'a>)>,
    /// Blocks that may hold neighbours of the current block of targets.
    near_block: Vec<Near<'w>>,
    /// Those that may hold neighbours of the current pixel of targets.
    near_pixel: Vec<Near<'w>>,
    /// Pixels of those blocks that may hold what is searched.
    candidates: Vec<Candidate<'w>>,
    /// The targets of the current pixel.
    targets: Vec<Target>,
    /// The last line of a neighbour that was found: likely the next one, too.
    last_other: Option<Pair>,
    /// The last own line.
    last_own: Option<Pair>,
    pairs_tested: u64,
}

impl<'w> Search<'w, '_> {
    fn collect_tiles(&mut self, targets: &PathTile<'_>, reach: i32) {
        let bounded = targets.bounds.bounded();
        for (index, tile) in self.window.tiles_in(targets.buffer.rect.grown(reach)) {
            if bounded.may_differ(&tile.bounds.bounded(), self.tests) {
                self.tiles.push((index as u32, tile));
            }
        }
    }

    fn collect_blocks(&mut self, targets: &Block) {
        self.near_block.clear();
        for &(tile, nodes) in &self.tiles {
            let bounds: &'w PathBounds = nodes.bounds;
            for block in &bounds.blocks {
                let gap_squared = rect_gap_squared(&targets.rect, &block.rect);
                if may_matter(&targets.bounded(), &block.bounded(), gap_squared, self.tests) {
                    self.near_block.push(Near { tile, bounds, block, gap_squared });
                }
            }
        }
    }

    /// Leaves the targets of a pixel, with what they see, in [`Self::targets`].
    fn search_pixel(&mut self, nodes: &PathTile<'_>, place: usize, lined: &[bool]) {
        let pixel = &nodes.bounds.pixels[place];
        let bounded = nodes.bounds.of_pixel(place);
        self.targets.clear();
        self.near_pixel.clear();
        let rect = pixel_rect(pixel.pixel);
        for near in &self.near_block {
            let gap_squared = rect_gap_squared(&rect, &near.block.rect);
            if may_matter(&bounded, &near.block.bounded(), gap_squared, self.tests) {
                self.near_pixel.push(Near { gap_squared, ..*near });
            }
        }
        if self.near_pixel.is_empty() {
            return;
        }
        for row in pixel.first as usize..pixel.end as usize {
            if lined[nodes.nodes.sample[row] as usize] {
                continue;
            }
            let node = nodes.node(pixel.pixel, row);
            let bounds = NodeBounds::new(&node.features, node.rank, node.radius_squared);
            self.targets.push(Target { row, node, bounds, best: None });
        }
        self.search_others(pixel.pixel, &bounded);
        self.search_own(pixel.pixel, &bounded);
    }

    /// Finds for each target the highest-ranking valid pair whose neighbour outranks it.
    fn search_others(&mut self, pixel: [i32; 2], bounded: &Bounded<'_>) {
        let mut targets = std::mem::take(&mut self.targets);
        let mut floor = Rank::FIRST;
        for target in &mut targets {
            if let Some(pair) = self.last_other {
                self.test_again(target, &pair);
            }
            floor = floor.worse(target.best.map_or(target.node.rank, |best| best.rank));
        }
        self.collect_others(pixel, bounded, floor);
        for target in &mut targets {
            for i in 0..self.candidates.len() {
                let candidate = self.candidates[i];
                let bounds = &candidate.pixel.bounds;
                // Sorted by rank: no later pixel can win either.
                if !target.may_win(bounds.best) {
                    break;
                }
                let gap_squared = target_gap_squared(&target.node, candidate.pixel.pixel);
                if gap_squared >= bounds.radius_squared
                    || target.loses_by_distance(bounds.best, gap_squared)
                    || !target.bounds.get().may_differ(&candidate.bounds.of_pixel(candidate.place as usize), self.tests)
                {
                    continue;
                }
                let Some(nodes) = &self.window.tiles[candidate.tile as usize] else { continue };
                let pixel = candidate.pixel;
                self.pairs_tested += u64::from(pixel.end - pixel.first);
                for row in pixel.first..pixel.end {
                    if target.may_win(nodes.rank(row as usize))
                        && distance_squared(&target.node, pixel.pixel, nodes.offset(row as usize))
                            < bounds.radius_squared
                    {
                        self.test(target, candidate.tile, pixel.pixel, row);
                    }
                }
            }
            if target.best.is_some_and(|best| !best.own) {
                self.last_other = target.best;
            }
        }
        self.targets = targets;
    }

    /// Collects pixels that may hold a neighbour whose line a target sees, by best rank. None lies below `floor`, the
    /// lowest rank that can still win.
    fn collect_others(&mut self, pixel: [i32; 2], targets: &Bounded<'_>, mut floor: Rank) {
        self.candidates.clear();
        self.near_pixel.sort_unstable_by_key(|near| near.block.bounds.best);
        for near in &self.near_pixel {
            let Near { tile, bounds, block, gap_squared } = *near;
            if floor.outranks(block.bounds.best) {
                break;
            }
            if gap_squared >= block.bounds.radius_squared {
                continue;
            }
            for &index in &bounds.by_rank[block.first as usize..block.end as usize] {
                let place = block.first + u32::from(index);
                let neighbors = &bounds.pixels[place as usize];
                if floor.outranks(neighbors.bounds.best) {
                    break;
                }
                let gap_squared = pixel_gap_squared(pixel, neighbors.pixel);
                if gap_squared >= neighbors.bounds.radius_squared {
                    continue;
                }
                let bounded = bounds.of_pixel(place as usize);
                if !targets.may_differ(&bounded, self.tests) {
                    continue;
                }
                self.candidates.push(Candidate { tile, place, bounds, pixel: neighbors, gap_squared });
                if neighbors.bounds.best.outranks(targets.bounds.highest)
                    && far_squared(pixel, neighbors.pixel) < neighbors.bounds.thinnest_squared
                    && targets.must_differ(&bounded, self.tests)
                {
                    floor = floor.better(neighbors.bounds.best);
                }
            }
        }
        self.candidates.retain(|candidate| !floor.outranks(candidate.pixel.bounds.best));
        self.candidates.sort_unstable_by(|a, b| {
            let by_rank = a.pixel.bounds.best.cmp(&b.pixel.bounds.best);
            by_rank.then(a.gap_squared.total_cmp(&b.gap_squared))
        });
    }

    /// Finds for each target that sees no other line the nearest neighbour that differs and does not outrank it.
    fn search_own(&mut self, pixel: [i32; 2], bounded: &Bounded<'_>) {
        let mut targets = std::mem::take(&mut self.targets);
        let mut own = OwnTargets { highest: Rank::LAST, lowest: Rank::FIRST, thinnest: f32::INFINITY, limit: 0.0 };
        for target in targets.iter_mut().filter(|target| target.wants_own()) {
            if let Some(pair) = self.last_own {
                self.test_again(target, &pair);
            }
            // The last own line may be another's here.
            let radius_squared = target.node.radius_squared;
            let limit = target.best.map_or(radius_squared, |best| best.distance_squared);
            own.limit = own.limit.max(limit);
            own.thinnest = own.thinnest.min(radius_squared);
            own.highest = own.highest.better(target.node.rank);
            own.lowest = own.lowest.worse(target.node.rank);
        }
        if own.limit > 0.0 || own.thinnest < f32::INFINITY {
            self.collect_own(pixel, bounded, own);
            for target in targets.iter_mut().filter(|target| target.wants_own()) {
                self.search_nearest(target);
                if target.best.is_some_and(|best| best.own) {
                    self.last_own = target.best;
                }
            }
        }
        self.targets = targets;
    }

    /// Collects pixels that may hold the nearest neighbour of an own line, the nearest first.
    fn collect_own(&mut self, pixel: [i32; 2], targets: &Bounded<'_>, mut own: OwnTargets) {
        self.candidates.clear();
        self.near_pixel.sort_unstable_by(|a, b| a.gap_squared.total_cmp(&b.gap_squared));
        for near in &self.near_pixel {
            let Near { tile, bounds, block, gap_squared } = *near;
            if gap_squared > own.limit {
                break;
            }
            if block.bounds.lowest.outranks(own.highest) {
                continue;
            }
            for place in block.first..block.end {
                let neighbors = &bounds.pixels[place as usize];
                let gap_squared = pixel_gap_squared(pixel, neighbors.pixel);
                if gap_squared > own.limit || neighbors.bounds.lowest.outranks(own.highest) {
                    continue;
                }
                let bounded = bounds.of_pixel(place as usize);
                if !targets.may_differ(&bounded, self.tests) {
                    continue;
                }
                self.candidates.push(Candidate { tile, place, bounds, pixel: neighbors, gap_squared });
                let far_squared = far_squared(pixel, neighbors.pixel);
                if far_squared < own.limit.min(own.thinnest)
                    && !neighbors.bounds.lowest.outranks(own.lowest)
                    && targets.must_differ(&bounded, self.tests)
                {
                    own.limit = far_squared;
                }
            }
        }
        self.candidates.retain(|candidate| candidate.gap_squared <= own.limit);
        self.candidates.sort_unstable_by(|a, b| a.gap_squared.total_cmp(&b.gap_squared));
    }

    fn search_nearest(&mut self, target: &mut Target) {
        if let Some(pair) = self.last_own {
            self.test_again(target, &pair);
        }
        for i in 0..self.candidates.len() {
            let candidate = self.candidates[i];
            if target.too_far(candidate.gap_squared) {
                break;
            }
            let pixel = candidate.pixel;
            if target.too_far(target_gap_squared(&target.node, pixel.pixel))
                || pixel.bounds.lowest.outranks(target.node.rank)
                || !target.bounds.get().may_differ(&candidate.bounds.of_pixel(candidate.place as usize), self.tests)
            {
                continue;
            }
            let Some(nodes) = &self.window.tiles[candidate.tile as usize] else { continue };
            self.pairs_tested += u64::from(pixel.end - pixel.first);
            for row in pixel.first..pixel.end {
                if !target.too_far(distance_squared(&target.node, pixel.pixel, nodes.offset(row as usize))) {
                    self.test(target, candidate.tile, pixel.pixel, row);
                }
            }
        }
    }

    /// Tests a target with the neighbour of another target's pair.
    fn test_again(&mut self, target: &mut Target, pair: &Pair) {
        self.pairs_tested += 1;
        self.test(target, pair.tile, pair.pixel, pair.row);
    }

    /// Keeps a pair if it is valid and beats the best.
    #[inline]
    fn test(&self, target: &mut Target, tile: u32, pixel: [i32; 2], row: u32) {
        let Some(nodes) = &self.window.tiles[tile as usize] else { return };
        let t = &target.node;
        let rank = nodes.rank(row as usize);
        let own = !rank.outranks(t.rank);
        let distance_squared = distance_squared(t, pixel, nodes.offset(row as usize));
        let (rank, radius_squared) =
            if own { (t.rank, t.radius_squared) } else { (rank, nodes.bounds.radius_squared.get(row as usize)) };
        if distance_squared >= radius_squared {
            return;
        }
        let pair = Pair { rank, distance_squared, pixel, tile, row, own };
        if target.best.is_none_or(|best| pair.beats(&best))
            && self.tests.differ(&t.features, &nodes.features(row as usize))
        {
            target.best = Some(pair);
        }
    }
}

/// What is known of the targets of a pixel that look for own lines.
#[derive(Clone, Copy)]
struct OwnTargets {
    highest: Rank,
    lowest: Rank,
    /// The smallest squared radius.
    thinnest: f32,
    /// The squared distance within which each is sure to find its line, if it has one.
    limit: f32,
}

/// Whether targets and neighbours at least this far apart may make lines.
#[inline]
fn may_matter(targets: &Bounded<'_>, neighbors: &Bounded<'_>, gap_squared: f32, tests: &Tests) -> bool {
    let near = gap_squared < targets.bounds.radius_squared.max(neighbors.bounds.radius_squared);
    near && targets.may_differ(neighbors, tests)
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

/// [`rect_gap_squared`] between two pixels.
#[inline(always)]
fn pixel_gap_squared(targets: [i32; 2], neighbors: [i32; 2]) -> f32 {
    let gap = |axis: usize| ((neighbors[axis] - targets[axis]).abs() - 1).max(0) as f32;
    let (x, y) = (gap(0), gap(1));
    x * x + y * y
}

/// The largest squared distance between a target in one pixel and a neighbour in another.
#[inline(always)]
fn far_squared(targets: [i32; 2], neighbors: [i32; 2]) -> f32 {
    let far = |axis: usize| ((neighbors[axis] - targets[axis]).abs() + 1) as f32;
    let (x, y) = (far(0), far(1));
    x * x + y * y
}

/// The smallest squared distance that [`distance_squared`] can give from a target to a neighbour in a pixel. Its
/// operations are the same, at the nearest offset there is; they are monotone, so no rounding makes this too large.
#[inline(always)]
fn target_gap_squared(t: &LineNode, pixel: [i32; 2]) -> f32 {
    let gap = |axis: usize| {
        let difference = (pixel[axis] - t.pixel[axis]) as f32;
        let before = difference + (0.0 - t.offset[axis]);
        let behind = difference + (1.0 - t.offset[axis]);
        before.max(-behind).max(0.0)
    };
    let (x, y) = (gap(0), gap(1));
    x * x + y * y
}

fn pixel_rect([x, y]: [i32; 2]) -> PixelRect {
    PixelRect { x0: x, y0: y, x1: x + 1, y1: y + 1 }
}
