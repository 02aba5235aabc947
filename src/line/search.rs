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
//!
//! Where callers only ask how lines look ([`Rules::with_any_pair`]), a target is done as soon as it has a pair whose style
//! is that of all lines that could still win; its own line looks the same whichever neighbour it is found by.
//!
//! What is seen through lines that are not opaque is searched by [`super::through`].
//!
//! Measured with `tests/bench/line_search.rs --quick`, nanoseconds per sample at (16 px, 64 samples), (32 px, 16) and
//! (32 px, 64), of which 24 %, 47 % and 47 % are lined:
//!
//! - targets one by one through sorted pixels, floor and limit shared, neighbours tested one at a time: 1217, 981, 3228;
//! - neighbours gathered into columns, loops not vectorised (a closure that is not inlined): 3157, 2431, more;
//! - vectorised for SSE2 (the closure of `pulp::Arch::dispatch` was compiled for the baseline): 738, 879, 1872;
//! - vectorised for what the machine has (AVX-512 here), as it is now: 484, 740, 1176;
//! - the same, any pair that looks alike: 112, 161, 168.

use super::bounds::{Block, Bounded, PathBounds, PixelNodes, Stylist};
use super::differ::{Fired, Tests};
use super::lanes::{LaneTarget, Lanes, Origin};
use super::materials::{certainty, may_differ, may_matter, radii_squared};
use super::overlap::Facet;
use super::pair::{Found, LineNode, Pair, Rank, distance_squared};
use super::through::Through;
use super::window::{LineStyle, PathTile, PathWindow};
use super::{LineCounts, Rules};
use crate::sample::PixelRect;

/// How many neighbours are gathered before the targets are tested with them; each further batch is four times as large.
pub(super) const FIRST_BATCH: usize = 128;

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
        tests: rules.tests(),
        any_pair: !rules.exact_pairs(),
        tiles: Vec::new(),
        near_block: Vec::new(),
        near_pixel: Vec::new(),
        candidates: Vec::new(),
        certain: false,
        lanes: Lanes::new(),
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
    let mut through = Through::new(window, rules);
    for block in &targets.bounds.blocks {
        search.collect_blocks(block);
        if search.near_block.is_empty() {
            continue;
        }
        for place in block.first as usize..block.end as usize {
            search.search_pixel(targets, place, lined);
            let mut behind = through.search(targets, &search.near_pixel, &search.targets);
            for (i, target) in search.targets.iter().enumerate() {
                let Target { row, best: Some(pair), .. } = *target else { continue };
                let behind = behind.get_mut(i).map(std::mem::take).unwrap_or_default();
                found.push(Found { row, path: targets.nodes.path, pair, hidden: false, behind });
            }
        }
    }
    counts.pairs_tested += search.pairs_tested + through.pairs_tested;
    found
}

/// A block that may hold neighbours.
#[derive(Clone, Copy)]
pub(super) struct Near<'w> {
    /// Place of its tile in the window.
    pub tile: u32,
    pub bounds: &'w PathBounds,
    pub block: &'w Block,
    /// Smallest squared distance from the pixel of targets.
    pub gap_squared: f32,
}

/// A pixel that may hold neighbours.
#[derive(Clone, Copy)]
struct Candidate<'w> {
    /// Place of its tile in the window.
    tile: u32,
    pixel: &'w PixelNodes,
    /// Smallest squared distance from the pixel of targets.
    gap_squared: f32,
    /// Whether all its nodes surely differ from all targets.
    certain: bool,
}

/// A target with the best pair found so far.
#[derive(Clone)]
pub(super) struct Target {
    pub row: usize,
    pub node: LineNode,
    facet: Facet,
    /// The squared radius of the widest line of its own, of any type.
    pub reach_squared: f32,
    style: LineStyle,
    opaque: bool,
    pub best: Option<Pair>,
}

impl Target {
    pub(super) fn lane(&self) -> LaneTarget<'_> {
        LaneTarget { node: &self.node, facet: &self.facet }
    }

    /// Whether a neighbour of this rank may outrank the target and all that was found so far.
    #[inline(always)]
    pub(super) fn may_win(&self, rank: Rank) -> bool {
        rank.outranks(self.node.rank) && self.best.is_none_or(|best| !best.rank.outranks(rank))
    }

    /// Whether the target has no better line than its own, if it draws one.
    fn wants_own(&self) -> bool {
        self.node.radius_squared > 0.0 && self.best.is_none_or(|best| best.own)
    }

    /// The squared distance from which on a neighbour gives no better own line.
    #[inline(always)]
    pub(super) fn too_far(&self, distance_squared: f32) -> bool {
        match self.best {
            Some(best) => distance_squared > best.distance_squared,
            None => distance_squared >= self.reach_squared,
        }
    }
}

/// Scratch of one search, narrowed from level to level.
struct Search<'w, 'a> {
    window: &'w PathWindow<'a>,
    rules: &'w Rules,
    tests: &'w Tests,
    /// Whether any pair will do that looks like the one that is seen.
    any_pair: bool,
    /// Tiles that may hold neighbours of the tile of targets.
    tiles: Vec<(u32, &'w PathTile<'a>)>,
    /// Blocks that may hold neighbours of the current block of targets.
    near_block: Vec<Near<'w>>,
    /// Those that may hold neighbours of the current pixel of targets.
    near_pixel: Vec<Near<'w>>,
    /// Pixels of those blocks that may hold what is searched.
    candidates: Vec<Candidate<'w>>,
    /// Whether all their nodes surely differ from all targets.
    certain: bool,
    /// Nodes of the candidates.
    lanes: Lanes,
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
            if may_differ(self.rules, &bounded, &tile.bounds.bounded(), 0.0) {
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
                if may_matter(self.rules, &targets.bounded(), &block.bounded(), gap_squared) {
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
        if (pixel.first..pixel.end).all(|row| lined[nodes.nodes.rows.sample(row as usize) as usize]) {
            return;
        }
        let rect = pixel_rect(pixel.pixel);
        for near in &self.near_block {
            let gap_squared = rect_gap_squared(&rect, &near.block.rect);
            if may_matter(self.rules, &bounded, &near.block.bounded(), gap_squared) {
                self.near_pixel.push(Near { gap_squared, ..*near });
            }
        }
        if self.near_pixel.is_empty() || !self.may_be_seen(pixel.pixel, &bounded) {
            return;
        }
        for row in pixel.first as usize..pixel.end as usize {
            if lined[nodes.nodes.rows.sample(row) as usize] {
                continue;
            }
            let node = nodes.node(pixel.pixel, row);
            self.targets.push({
                let style = nodes.style(row, self.rules);
                let reach_squared = self.rules.widest_squared(node.radius_squared);
                let facet = if self.tests.reads_facets() { Facet::of(nodes.nodes, row) } else { Facet::NONE };
                Target { row, node, facet, reach_squared, style, opaque: style.is_opaque(self.rules), best: None }
            });
        }
        self.search_others(pixel.pixel, &bounded);
        self.search_own(pixel.pixel, &bounded);
    }

    /// Whether a pixel near a pixel of targets may matter to them. Asked only where few pixels are near enough; else it is
    /// cheaper to search.
    fn may_be_seen(&self, pixel: [i32; 2], targets: &Bounded<'_>) -> bool {
        self.near_pixel.iter().any(|near| {
            let widest = targets.bounds.radius_squared.max(near.block.bounds.radius_squared);
            near.block.part(&reached(pixel, widest)).is_none_or(|mut places| {
                places.any(|place| {
                    let neighbors = near.bounds.of_pixel(place as usize);
                    let gap_squared = pixel_gap_squared(pixel, near.bounds.pixels[place as usize].pixel);
                    may_matter(self.rules, targets, &neighbors, gap_squared)
                })
            })
        })
    }

    /// Finds for each target the highest-ranking valid pair whose neighbour outranks it.
    fn search_others(&mut self, pixel: [i32; 2], bounded: &Bounded<'_>) {
        let mut targets = std::mem::take(&mut self.targets);
        for target in &mut targets {
            if let Some(pair) = self.last_other {
                self.test_again(target, &pair);
            }
            if let Some(pair) = self.last_own.filter(|_| self.any_pair) {
                self.test_again(target, &pair);
            }
        }
        let near = self.near_pixel.iter().map(|near| (near.tile, near.block.bounds.stylist));
        let style = self.common_style(near);
        let floor = self.floor(&targets, style);
        if floor > Rank::FIRST {
            self.collect_others(pixel, bounded, floor);
            self.search_candidates(pixel, &mut targets, floor);
        }
        self.last_other =
            targets.iter().rev().filter_map(|target| target.best).find(|best| !best.own).or(self.last_other);
        self.targets = targets;
    }

    /// The style of all lines of some sets of nodes, if it is the same and nothing else of a pair matters.
    fn common_style(&self, mut stylists: impl Iterator<Item = (u32, Stylist)>) -> Option<LineStyle> {
        if !self.any_pair {
            return None;
        }
        let mut common = None;
        stylists
            .all(|(tile, stylist)| match stylist {
                Stylist::None => true,
                Stylist::Many => false,
                Stylist::Alike(row) => {
                    let style =
                        self.window.tiles[tile as usize].as_ref().map(|nodes| nodes.style(row as usize, self.rules));
                    style == *common.get_or_insert(style)
                }
            })
            .then_some(common?)?
    }

    /// The lowest rank that can still change how a target looks, if all lines that can have this style; below all if
    /// nothing can.
    fn floor(&self, targets: &[Target], style: Option<LineStyle>) -> Rank {
        let unsettled = targets.iter().filter(|target| !self.is_settled(target, style));
        unsettled.fold(Rank::FIRST, |floor, target| floor.worse(target.best.map_or(target.node.rank, |best| best.rank)))
    }

    /// Whether no line of this style can change how a target looks.
    fn is_settled(&self, target: &Target, style: Option<LineStyle>) -> bool {
        let Some((style, best)) = style.zip(target.best) else { return false };
        if best.own {
            return target.style == style;
        }
        self.window.tiles[best.tile as usize]
            .as_ref()
            .is_some_and(|nodes| nodes.style(best.row as usize, self.rules) == style)
    }

    /// Goes through the candidates, the highest-ranking first.
    fn search_candidates(&mut self, pixel: [i32; 2], targets: &mut [Target], mut floor: Rank) {
        let style = self.common_style(self.candidates.iter().map(|c| (c.tile, c.pixel.bounds.stylist)));
        floor = floor.better(self.floor(targets, style));
        let (mut next, mut batch) = (0, FIRST_BATCH);
        while let Some(first) = self.candidates.get(next).map(|candidate| candidate.pixel.bounds.best) {
            if floor.outranks(first) {
                break;
            }
            self.lanes.clear();
            self.lanes.certain = self.certain && self.rules.types().is_none();
            while let Some(candidate) = self.candidates.get(next).copied()
                && self.lanes.len() < batch
            {
                self.gather(pixel, &candidate, |rank, radius_squared| radius_squared > 0.0 && !floor.outranks(rank));
                next += 1;
            }
            batch *= 4;
            self.lanes.finish();
            for target in targets.iter_mut() {
                if target.may_win(first) && !self.is_settled(target, style) {
                    self.pairs_tested += self.lanes.len() as u64;
                    let score = self.lanes.score_others(target.lane(), self.rules);
                    for origin in self.lanes.with_score(score) {
                        keep(self.window, self.rules, target, origin);
                    }
                }
            }
            floor = self.floor(targets, style);
        }
    }

    /// Gathers the rows of a candidate for targets in `pixel`.
    fn gather(&mut self, pixel: [i32; 2], candidate: &Candidate<'w>, wanted: impl Fn(Rank, f32) -> bool) {
        let Candidate { tile, pixel: neighbors, .. } = *candidate;
        let Some(nodes) = &self.window.tiles[tile as usize] else { return };
        for row in neighbors.first..neighbors.end {
            let rank = nodes.rank(row as usize);
            if wanted(rank, nodes.bounds.radius_squared.get(row as usize)) {
                self.lanes.push(Origin { tile, pixel: neighbors.pixel, row }, pixel, rank, nodes, self.rules);
            }
        }
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
            let part = block.part(&reached(pixel, block.bounds.radius_squared));
            let is_part = part.is_some();
            let by_rank = &bounds.by_rank[if is_part { 0..0 } else { block.first as usize..block.end as usize }];
            let by_rank = by_rank.iter().map(|index| block.first + u32::from(*index));
            for place in part.into_iter().flatten().chain(by_rank) {
                let neighbors = &bounds.pixels[place as usize];
                if floor.outranks(neighbors.bounds.best) {
                    if is_part {
                        continue;
                    }
                    break;
                }
                let gap_squared = pixel_gap_squared(pixel, neighbors.pixel);
                if gap_squared >= neighbors.bounds.radius_squared {
                    continue;
                }
                let bounded = bounds.of_pixel(place as usize);
                let [thinnest_squared, widest_squared] = radii_squared(self.rules, targets, &bounded, bounded.bounds);
                if gap_squared >= widest_squared {
                    continue;
                }
                // Their materials decide.
                let Some(certain) = certainty(self.rules, targets, &bounded, gap_squared, bounded.bounds) else {
                    continue;
                };
                self.candidates.push(Candidate { tile, pixel: neighbors, gap_squared, certain });
                if certain
                    && neighbors.bounds.best.outranks(targets.bounds.highest)
                    && far_squared(pixel, neighbors.pixel) < thinnest_squared
                {
                    floor = floor.better(neighbors.bounds.best);
                }
            }
        }
        self.candidates.retain(|candidate| !floor.outranks(candidate.pixel.bounds.best));
        self.certain = self.candidates.iter().all(|candidate| candidate.certain);
        self.candidates.sort_unstable_by(|a, b| {
            let by_rank = a.pixel.bounds.best.cmp(&b.pixel.bounds.best);
            by_rank.then(a.gap_squared.total_cmp(&b.gap_squared))
        });
    }

    /// Finds for each target that sees no other line the nearest neighbour that differs and does not outrank it.
    fn search_own(&mut self, pixel: [i32; 2], bounded: &Bounded<'_>) {
        let mut targets = std::mem::take(&mut self.targets);
        let mut own = OwnTargets::NONE;
        let any_pair = self.any_pair;
        // An own line looks the same whichever its neighbour is.
        let open = |target: &&mut Target| target.wants_own() && !(any_pair && target.opaque && target.best.is_some());
        for target in targets.iter_mut().filter(open) {
            if let Some(pair) = self.last_own {
                self.test_again(target, &pair);
            }
            if !open(&target) {
                continue;
            }
            // The last own line may be another's here.
            let limit = target.best.map_or(target.reach_squared, |best| best.distance_squared);
            own.limit = own.limit.max(limit);
            own.add(&target.node, self.rules);
        }
        if own.limit > 0.0 {
            self.collect_own(pixel, bounded, own);
            let (mut next, mut batch) = (0, FIRST_BATCH);
            while let Some(first) = self.candidates.get(next).map(|candidate| candidate.gap_squared) {
                if first > own.limit {
                    break;
                }
                self.lanes.clear();
                self.lanes.certain = self.certain && self.rules.types().is_none();
                while let Some(candidate) = self.candidates.get(next).copied()
                    && self.lanes.len() < batch
                {
                    self.gather(pixel, &candidate, |rank, _| !rank.outranks(own.highest));
                    next += 1;
                }
                batch *= 4;
                self.lanes.finish();
                own.limit = 0.0;
                for target in targets.iter_mut().filter(open) {
                    if !target.too_far(first) {
                        self.pairs_tested += self.lanes.len() as u64;
                        let score = self.lanes.score_own(target.lane(), self.rules);
                        for origin in self.lanes.with_score(score) {
                            keep(self.window, self.rules, target, origin);
                        }
                    }
                    if open(&target) {
                        let limit = target.best.map_or(target.reach_squared, |best| best.distance_squared);
                        own.limit = own.limit.max(limit);
                    }
                }
            }
            self.last_own =
                targets.iter().rev().filter_map(|target| target.best).find(|best| best.own).or(self.last_own);
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
            let part = block.part(&reached(pixel, own.limit));
            let all = if part.is_some() { 0..0 } else { block.first..block.end };
            for place in part.into_iter().flatten().chain(all) {
                let neighbors = &bounds.pixels[place as usize];
                let gap_squared = pixel_gap_squared(pixel, neighbors.pixel);
                if gap_squared > own.limit || neighbors.bounds.lowest.outranks(own.highest) {
                    continue;
                }
                let bounded = bounds.of_pixel(place as usize);
                let [thinnest_squared, widest_squared] = radii_squared(self.rules, targets, &bounded, targets.bounds);
                if gap_squared >= widest_squared {
                    continue;
                }
                // The targets' materials decide.
                let Some(certain) = certainty(self.rules, targets, &bounded, gap_squared, targets.bounds) else {
                    continue;
                };
                self.candidates.push(Candidate { tile, pixel: neighbors, gap_squared, certain });
                if certain {
                    let far_squared = far_squared(pixel, neighbors.pixel);
                    own.narrow(far_squared, thinnest_squared, neighbors.bounds.lowest);
                }
            }
        }
        self.candidates.retain(|candidate| candidate.gap_squared <= own.limit);
        self.certain = self.candidates.iter().all(|candidate| candidate.certain);
        self.candidates.sort_unstable_by(|a, b| a.gap_squared.total_cmp(&b.gap_squared));
    }

    /// Tests a target with the neighbour of another target's pair.
    fn test_again(&mut self, target: &mut Target, pair: &Pair) {
        self.pairs_tested += 1;
        let origin = Origin { tile: pair.tile, pixel: pair.pixel, row: pair.row };
        keep(self.window, self.rules, target, &origin);
    }
}

/// Keeps a pair if it is valid and beats the best.
pub(super) fn keep(window: &PathWindow<'_>, rules: &Rules, target: &mut Target, origin: &Origin) {
    let Origin { tile, pixel, row } = *origin;
    let Some(nodes) = &window.tiles[tile as usize] else { return };
    let t = &target.node;
    let rank = nodes.rank(row as usize);
    let own = !rank.outranks(t.rank);
    let distance_squared = distance_squared(t, pixel, nodes.offset(row as usize));
    let (rank, asked_squared) =
        if own { (t.rank, t.radius_squared) } else { (rank, nodes.bounds.radius_squared.get(row as usize)) };
    if distance_squared >= rules.widest_squared(asked_squared) {
        return;
    }
    let pair = Pair { rank, distance_squared, pixel, tile, row, surface: 0, own };
    if !target.best.is_none_or(|best| pair.beats(&best)) {
        return;
    }
    // As `pair::fired`.
    let n = nodes.features(row as usize);
    let tests = rules.tests_of(if own { t.features.shader } else { n.shader });
    let overlaps = || {
        t.features.object == n.object
            && !n.is_miss()
            && target.facet.overlaps(&Facet::of(nodes.nodes, row as usize), distance_squared, tests.overlap)
    };
    let Some(types) = rules.types() else {
        if tests.differ(&t.features, &n) || (tests.reads_facets() && overlaps()) {
            target.best = Some(pair);
        }
        return;
    };
    let mut fired = tests.fired(&t.features, &n);
    fired.set(Fired::OVERLAP, tests.reads_facets() && overlaps());
    if !fired.is_empty() && distance_squared < types.radius_squared_of(fired, asked_squared) {
        target.best = Some(pair);
    }
}

/// What is known of the targets of a pixel that look for own lines.
#[derive(Clone, Copy)]
pub(super) struct OwnTargets {
    pub highest: Rank,
    lowest: Rank,
    /// The smallest squared radius of a line of any type.
    thinnest: f32,
    /// The squared distance within which each is sure to find its line, if it has one.
    pub limit: f32,
}

impl OwnTargets {
    pub(super) const NONE: Self =
        Self { highest: Rank::LAST, lowest: Rank::FIRST, thinnest: f32::INFINITY, limit: 0.0 };

    /// Adds a target but for its limit.
    pub(super) fn add(&mut self, target: &LineNode, rules: &Rules) {
        self.thinnest = self.thinnest.min(rules.thinnest_squared(target.radius_squared));
        self.highest = self.highest.better(target.rank);
        self.lowest = self.lowest.worse(target.rank);
    }

    /// Lowers the limit by nodes within this squared distance that surely differ from all, the last of this rank; lines
    /// beside them have at least this squared radius.
    pub(super) fn narrow(&mut self, far_squared: f32, thinnest_squared: f32, lowest: Rank) {
        let in_reach = far_squared < self.thinnest.max(thinnest_squared);
        if in_reach && far_squared < self.limit && !lowest.outranks(self.lowest) {
            self.limit = far_squared;
        }
    }
}

/// The smallest squared distance that [`distance_squared`] can give between a target in one rectangle and a neighbour in
/// another.
#[inline]
pub(super) fn rect_gap_squared(targets: &PixelRect, neighbors: &PixelRect) -> f32 {
    let gap = |t0: i32, t1: i32, n0: i32, n1: i32| (n0 - t1).max(t0 - n1).max(0) as f32;
    let x = gap(targets.x0, targets.x1, neighbors.x0, neighbors.x1);
    let y = gap(targets.y0, targets.y1, neighbors.y0, neighbors.y1);
    x * x + y * y
}

/// [`rect_gap_squared`] between two pixels.
#[inline(always)]
pub(super) fn pixel_gap_squared(targets: [i32; 2], neighbors: [i32; 2]) -> f32 {
    let gap = |axis: usize| ((neighbors[axis] - targets[axis]).abs() - 1).max(0) as f32;
    let (x, y) = (gap(0), gap(1));
    x * x + y * y
}

/// The largest squared distance between a target in one pixel and a neighbour in another.
#[inline(always)]
pub(super) fn far_squared(targets: [i32; 2], neighbors: [i32; 2]) -> f32 {
    let far = |axis: usize| ((neighbors[axis] - targets[axis]).abs() + 1) as f32;
    let (x, y) = (far(0), far(1));
    x * x + y * y
}

/// The pixels whose [`pixel_gap_squared`] from a pixel may be no more than this.
#[inline]
pub(super) fn reached(pixel: [i32; 2], gap_squared: f32) -> PixelRect {
    // More than any picture is wide, and no overflow.
    const FAR: f32 = 1e8;
    pixel_rect(pixel).grown(1 + gap_squared.sqrt().min(FAR) as i32)
}

pub(super) fn pixel_rect([x, y]: [i32; 2]) -> PixelRect {
    PixelRect { x0: x, y0: y, x1: x + 1, y1: y + 1 }
}
