//! What is seen through lines that are not opaque, by the plain search: those of [`super::brute`], bit for bit.
//!
//! Each **side** (object and material) draws or borders at most one of a sample's lines, and a target draws at most one
//! itself. A line of a neighbour outranks the target, so all of them come before its own. So nothing is seen through an own
//! line, and through the line of a neighbour are seen, in the order of keys until one is opaque:
//!
//! 1. of each other side the best line of a neighbour;
//! 2. the own line beside the nearest neighbour of a side that draws none.
//!
//! So one pair is searched for each side, where the text searches all pairs again for each line, the last time in vain. Pixels
//! with several sides are split into groups of one side, and so are the targets of a pixel: of two groups it is mostly known
//! whether all pairs differ or none. Otherwise the search is that of [`super::search`]: the best candidates first, gathered
//! into columns, cut off by what all targets are sure to see.

use smallvec::{SmallVec, smallvec};

use super::Rules;
use super::bounds::{self, Bounded, Bounds, PixelNodes, Shape};
use super::lanes::{Lanes, Origin};
use super::materials::{certainty, may_matter, radii_squared};
use super::overlap::{Facet, FacetBounds};
use super::pair::{MOST_LINES, Pair, Rank, is_opaque};
use super::search::{FIRST_BATCH, Near, OwnTargets, Target, far_squared, keep, pixel_gap_squared, reached};
use super::window::{PathTile, PathWindow};
use crate::sample::NodeColumns;

/// Object and material.
pub(super) type Side = (u32, u32);

fn side(nodes: &NodeColumns, row: usize) -> Side {
    (nodes.object.get(row), nodes.shader.get(row))
}

/// The lines of neighbours that a target sees, each with the side that draws it.
pub(super) struct LineStack {
    /// The first is the one in front.
    lines: SmallVec<[(Side, Pair); 2]>,
}

impl LineStack {
    pub(super) fn new(side: Side, first: Pair) -> Self {
        Self { lines: smallvec![(side, first)] }
    }

    /// The line in front.
    pub(super) fn first(&self) -> (Side, Pair) {
        self.lines[0]
    }

    pub(super) fn has(&self, side: Side) -> bool {
        self.lines.iter().any(|line| line.0 == side)
    }

    /// The line of a side.
    pub(super) fn of(&self, side: Side) -> Option<&Pair> {
        self.lines.iter().find(|line| line.0 == side).map(|line| &line.1)
    }

    /// Adds the line of a side, or puts it in the place of the one that the side has.
    pub(super) fn put(&mut self, side: Side, pair: Pair) {
        match self.lines.iter_mut().find(|line| line.0 == side) {
            Some(line) => line.1 = pair,
            None => self.lines.push((side, pair)),
        }
    }

    /// Brings all into the order in which they are seen and leaves out what opaque ones hide. Whether a line behind them
    /// would be seen.
    pub(super) fn settle(&mut self, is_opaque: impl Fn(&Pair) -> bool) -> bool {
        let behind = &mut self.lines[1..];
        behind.sort_unstable_by(|(_, a), (_, b)| a.order(b));
        let opaque = behind.iter().position(|(_, pair)| is_opaque(pair));
        self.lines.truncate(opaque.map_or(MOST_LINES, |opaque| (opaque + 2).min(MOST_LINES)));
        opaque.is_none() && self.lines.len() < MOST_LINES
    }

    /// The lines behind the one in front, and at last the target's own.
    pub(super) fn into_behind(self, own: Option<Pair>) -> Vec<Pair> {
        self.lines.into_iter().skip(1).map(|(_, pair)| pair).chain(own).collect()
    }
}

/// Scratch for the targets of one tile.
pub(super) struct Through<'w, 'a> {
    window: &'w PathWindow<'a>,
    rules: &'w Rules,
    /// By tile of the window and place of the pixel: its groups, once they are known.
    split: Vec<Vec<Option<(u32, u32)>>>,
    groups: Vec<Group>,
    /// Rows of groups that share their pixel with others.
    rows: Vec<u32>,
    candidates: Vec<Candidate>,
    lanes: Lanes,
    /// Pairs that were looked at.
    pub pairs_tested: u64,
}

/// Nodes of one side in one pixel.
struct Group {
    side: Side,
    /// Its first row, or where its rows begin in [`Through::rows`].
    first: u32,
    count: u32,
    /// Whether its rows are listed there.
    listed: bool,
    area: Area,
}

/// Bounds of some nodes.
struct Area {
    bounds: Bounds,
    shape: Shape,
    facets: FacetBounds,
}

impl Area {
    fn of_rows(tile: &PathTile<'_>, rows: impl Iterator<Item = usize> + Clone, rules: &Rules) -> Self {
        let (nodes, tests) = (tile.nodes, rules.tests());
        let (mut all, mut shape) = (Bounds::EMPTY, Shape::EMPTY);
        for row in rows.clone() {
            let one = bounds::of_rows(&tile.bounds.radius_squared, nodes, row, row + 1, rules);
            all = all.union(&one, nodes, rules);
            if tests.reads_shapes {
                shape = shape.union(&bounds::shape_of_rows(nodes, row, row + 1, tests));
            }
        }
        let hits = rows.filter(|row| tests.reads_facets() && nodes.object.get(*row) != 0);
        Self { bounds: all, shape, facets: FacetBounds::of(hits.map(|row| Facet::of(nodes, row))) }
    }

    fn bounded(&self) -> Bounded<'_> {
        Bounded { bounds: &self.bounds, shape: &self.shape, facets: &self.facets }
    }
}

/// A group that may hold neighbours.
#[derive(Clone, Copy)]
struct Candidate {
    side: Side,
    /// Place of its tile in the window.
    tile: u32,
    pixel: [i32; 2],
    /// Its place in [`Through::groups`].
    group: u32,
    /// Smallest squared distance from the pixel of targets.
    gap_squared: f32,
}

/// A target whose first line is not opaque.
struct Open {
    /// Its place among the targets of its pixel.
    place: usize,
    /// With the best pair of what is being searched.
    target: Target,
    lines: LineStack,
    /// Whether its own line is seen, if it has one.
    wants_own: bool,
}

impl<'w, 'a> Through<'w, 'a> {
    pub(super) fn new(window: &'w PathWindow<'a>, rules: &'w Rules) -> Self {
        Self {
            window,
            rules,
            split: vec![Vec::new(); window.tiles.len()],
            groups: Vec::new(),
            rows: Vec::new(),
            candidates: Vec::new(),
            lanes: Lanes::new(),
            pairs_tested: 0,
        }
    }

    /// For each target of a pixel, with the line that it sees first, what it sees through that, front to back. Nothing at
    /// all if no target sees anything. `near` are all blocks that may matter to the targets.
    pub(super) fn search(&mut self, nodes: &PathTile<'_>, near: &[Near<'_>], targets: &[Target]) -> Vec<Vec<Pair>> {
        let mut open: Vec<Open> =
            targets.iter().enumerate().filter_map(|(place, target)| self.open(nodes, place, target)).collect();
        if open.is_empty() {
            return Vec::new();
        }
        let of = |open: &Open| side(nodes.nodes, open.target.row);
        open.sort_by_key(of);
        for alike in open.chunk_by_mut(|a, b| of(a) == of(b)) {
            self.search_alike(nodes, near, alike);
        }
        let mut behind = vec![Vec::new(); targets.len()];
        for Open { place, target, lines, wants_own } in open {
            behind[place] = lines.into_behind(target.best.filter(|_| wants_own));
        }
        behind
    }

    /// A target, if something may be seen through its line.
    fn open(&self, nodes: &PathTile<'_>, place: usize, target: &Target) -> Option<Open> {
        let first = target.best.filter(|first| !first.own)?;
        let neighbors = self.window.tiles[first.tile as usize].as_ref()?;
        let lines = LineStack::new(side(neighbors.nodes, first.row as usize), first);
        let open = Open { place, target: target.clone(), lines, wants_own: false };
        (!self.is_opaque(nodes, target.row, &first)).then_some(open)
    }

    fn is_opaque(&self, nodes: &PathTile<'_>, row: usize, pair: &Pair) -> bool {
        self.window.tiles[pair.tile as usize]
            .as_ref()
            .is_none_or(|neighbors| is_opaque(self.rules, (nodes, row), (neighbors, pair.row as usize), pair.own))
    }

    /// Searches for targets of one side.
    fn search_alike(&mut self, nodes: &PathTile<'_>, near: &[Near<'_>], targets: &mut [Open]) {
        let area = Area::of_rows(nodes, targets.iter().map(|open| open.target.row), self.rules);
        let bounded = area.bounded();
        self.collect(near, targets[0].target.node.pixel, &bounded);
        let mut candidates = std::mem::take(&mut self.candidates);
        for of_side in candidates.chunk_by_mut(|a, b| a.side == b.side) {
            self.search_others(of_side, &bounded, targets);
        }
        for Open { target, lines, wants_own, .. } in &mut *targets {
            target.best = None;
            *wants_own =
                lines.settle(|pair| self.is_opaque(nodes, target.row, pair)) && target.node.radius_squared > 0.0;
        }
        for of_side in candidates.chunk_by_mut(|a, b| a.side == b.side) {
            self.search_own(of_side, &bounded, targets);
        }
        self.candidates = candidates;
    }

    /// Collects the groups that may matter to targets of a pixel, side by side.
    fn collect(&mut self, near: &[Near<'_>], pixel: [i32; 2], targets: &Bounded<'_>) {
        let mut candidates = std::mem::take(&mut self.candidates);
        candidates.clear();
        for Near { tile, bounds, block, gap_squared } in near {
            if !may_matter(self.rules, targets, &block.bounded(), *gap_squared) {
                continue;
            }
            let widest = targets.bounds.radius_squared.max(block.bounds.radius_squared);
            let part = block.part(&reached(pixel, widest));
            let all = if part.is_some() { 0..0 } else { block.first..block.end };
            for place in part.into_iter().flatten().chain(all) {
                let neighbors = &bounds.pixels[place as usize];
                let gap_squared = pixel_gap_squared(pixel, neighbors.pixel);
                if !may_matter(self.rules, targets, &bounds.of_pixel(place as usize), gap_squared) {
                    continue;
                }
                let (first, end) = self.groups_of(*tile, place as usize);
                for group in first..end {
                    let Group { side, area, .. } = &self.groups[group as usize];
                    if may_matter(self.rules, targets, &area.bounded(), gap_squared) {
                        candidates.push(Candidate {
                            side: *side,
                            tile: *tile,
                            pixel: neighbors.pixel,
                            group,
                            gap_squared,
                        });
                    }
                }
            }
        }
        candidates.sort_by_key(|candidate| candidate.side);
        self.candidates = candidates;
    }

    /// The groups of a pixel, by its tile in the window and its place there.
    fn groups_of(&mut self, tile: u32, place: usize) -> (u32, u32) {
        let Some(nodes) = &self.window.tiles[tile as usize] else { return (0, 0) };
        let of_tile = &mut self.split[tile as usize];
        if let Some(Some(groups)) = of_tile.get(place) {
            return *groups;
        }
        of_tile.resize(nodes.bounds.pixels.len(), None);
        let start = self.groups.len() as u32;
        let PixelNodes { first, end, bounds, .. } = &nodes.bounds.pixels[place];
        let ([object, last_object], [shader, last_shader]) = (bounds.object, bounds.shaders());
        if (object, shader) == (last_object, last_shader) {
            let Bounded { bounds, shape, facets } = nodes.bounds.of_pixel(place);
            let area = Area { bounds: *bounds, shape: *shape, facets: *facets };
            self.groups.push(Group { side: (object, shader), first: *first, count: end - first, listed: false, area });
        } else {
            let mut rows: Vec<u32> = (*first..*end).collect();
            rows.sort_by_key(|row| side(nodes.nodes, *row as usize));
            for rows in rows.chunk_by(|a, b| side(nodes.nodes, *a as usize) == side(nodes.nodes, *b as usize)) {
                self.groups.push(Group {
                    side: side(nodes.nodes, rows[0] as usize),
                    first: self.rows.len() as u32,
                    count: rows.len() as u32,
                    listed: true,
                    area: Area::of_rows(nodes, rows.iter().map(|row| *row as usize), self.rules),
                });
                self.rows.extend_from_slice(rows);
            }
        }
        let groups = (start, self.groups.len() as u32);
        self.split[tile as usize][place] = Some(groups);
        groups
    }

    /// Adds for each target the best line of a neighbour of one side, if it sees one and has none of the side.
    fn search_others(&mut self, candidates: &mut [Candidate], targets: &Bounded<'_>, open: &mut [Open]) {
        let (side, pixel) = (candidates[0].side, open[0].target.node.pixel);
        // The first line is the only one yet that may be of this side.
        let mut open: Vec<&mut Open> = open.iter_mut().filter(|open| open.lines.first().0 != side).collect();
        open.iter_mut().for_each(|open| open.target.best = None);
        // The lowest rank that can still win.
        let floor_of = |open: &[&mut Open]| {
            let ranks = open.iter().map(|open| open.target.best.map_or(open.target.node.rank, |best| best.rank));
            ranks.fold(Rank::FIRST, Rank::worse)
        };
        let mut floor = floor_of(&open);
        let mut all_certain = true;
        let mut found: SmallVec<[Candidate; 32]> = SmallVec::new();
        for candidate in &*candidates {
            let area = &self.groups[candidate.group as usize].area;
            let neighbors = &area.bounds;
            let [thinnest_squared, widest_squared] = radii_squared(self.rules, targets, &area.bounded(), neighbors);
            if floor.outranks(neighbors.best) || candidate.gap_squared >= widest_squared {
                continue;
            }
            // Their materials decide.
            let certain = certainty(self.rules, targets, &area.bounded(), candidate.gap_squared, neighbors);
            let Some(certain) = certain else { continue };
            all_certain &= certain;
            found.push(*candidate);
            if certain
                && neighbors.best.outranks(targets.bounds.highest)
                && far_squared(pixel, candidate.pixel) < thinnest_squared
            {
                floor = floor.better(neighbors.best);
            }
        }
        let best = |groups: &[Group], candidate: &Candidate| groups[candidate.group as usize].area.bounds.best;
        found.sort_by(|a, b| {
            let by_rank = best(&self.groups, a).cmp(&best(&self.groups, b));
            by_rank.then(a.gap_squared.total_cmp(&b.gap_squared))
        });
        let (mut next, mut batch) = (0, FIRST_BATCH);
        while let Some(first) = found.get(next).map(|candidate| best(&self.groups, candidate)) {
            if floor.outranks(first) {
                break;
            }
            let wanted = |rank: Rank, radius_squared: f32| radius_squared > 0.0 && !floor.outranks(rank);
            next += self.gather(&found[next..], batch, all_certain, pixel, wanted);
            batch *= 4;
            for open in open.iter_mut().filter(|open| open.target.may_win(first)) {
                self.pairs_tested += self.lanes.len() as u64;
                let score = self.lanes.score_others(open.target.lane(), self.rules);
                for origin in self.lanes.with_score(score) {
                    keep(self.window, self.rules, &mut open.target, origin);
                }
            }
            floor = floor_of(&open);
        }
        for open in open {
            if let Some(best) = open.target.best {
                open.lines.put(side, best);
            }
        }
    }

    /// Finds for each target that sees so far the nearest neighbour of one side, if it has no line of the side and is
    /// nearer than what was found.
    fn search_own(&mut self, candidates: &mut [Candidate], targets: &Bounded<'_>, open: &mut [Open]) {
        let (side, pixel) = (candidates[0].side, open[0].target.node.pixel);
        let mut open: Vec<&mut Open> = open.iter_mut().filter(|open| open.wants_own && !open.lines.has(side)).collect();
        let limit_of = |open: &[&mut Open]| {
            let limits = open
                .iter()
                .map(|open| open.target.best.map_or(open.target.reach_squared, |best| best.distance_squared));
            limits.fold(0.0, f32::max)
        };
        let mut own = OwnTargets::NONE;
        own.limit = limit_of(&open);
        for open in &open {
            own.add(&open.target.node, self.rules);
        }
        let mut all_certain = true;
        let mut found: SmallVec<[Candidate; 32]> = SmallVec::new();
        for candidate in candidates.iter().filter(|_| !open.is_empty()) {
            let area = &self.groups[candidate.group as usize].area;
            let [thinnest_squared, widest_squared] =
                radii_squared(self.rules, targets, &area.bounded(), targets.bounds);
            if candidate.gap_squared > own.limit.min(widest_squared) || area.bounds.lowest.outranks(own.highest) {
                continue;
            }
            // The targets' materials decide.
            let certain = certainty(self.rules, targets, &area.bounded(), candidate.gap_squared, targets.bounds);
            let Some(certain) = certain else { continue };
            all_certain &= certain;
            found.push(*candidate);
            if certain {
                own.narrow(far_squared(pixel, candidate.pixel), thinnest_squared, area.bounds.lowest);
            }
        }
        found.sort_by(|a, b| a.gap_squared.total_cmp(&b.gap_squared));
        let (mut next, mut batch) = (0, FIRST_BATCH);
        while let Some(first) = found.get(next).map(|candidate| candidate.gap_squared) {
            if first > own.limit {
                break;
            }
            next += self.gather(&found[next..], batch, all_certain, pixel, |rank, _| !rank.outranks(own.highest));
            batch *= 4;
            for open in open.iter_mut().filter(|open| !open.target.too_far(first)) {
                self.pairs_tested += self.lanes.len() as u64;
                let score = self.lanes.score_own(open.target.lane(), self.rules);
                for origin in self.lanes.with_score(score) {
                    keep(self.window, self.rules, &mut open.target, origin);
                }
            }
            own.limit = limit_of(&open);
        }
    }

    /// Gathers rows of the first candidates for targets in `pixel`; returns of how many.
    fn gather(
        &mut self,
        candidates: &[Candidate],
        batch: usize,
        certain: bool,
        pixel: [i32; 2],
        wanted: impl Fn(Rank, f32) -> bool,
    ) -> usize {
        self.lanes.clear();
        self.lanes.certain = certain && self.rules.types().is_none();
        let mut gathered = 0;
        for candidate in candidates {
            if self.lanes.len() >= batch {
                break;
            }
            gathered += 1;
            let Some(nodes) = &self.window.tiles[candidate.tile as usize] else { continue };
            let Group { first, count, listed, .. } = self.groups[candidate.group as usize];
            for place in first..first + count {
                let row = if listed { self.rows[place as usize] } else { place };
                let rank = nodes.rank(row as usize);
                if wanted(rank, nodes.bounds.radius_squared.get(row as usize)) {
                    let origin = Origin { tile: candidate.tile, pixel: candidate.pixel, row };
                    self.lanes.push(origin, pixel, rank, nodes, self.rules);
                }
            }
        }
        self.lanes.finish();
        gathered
    }
}
