//! What is seen through lines that are not opaque, with lists of surfaces: side by side, as [`crate::line::through`] says.
//!
//! A line is of the side of the surface that draws it, an own line of that of the neighbour's first surface. All pairs are
//! looked at that may be the best of some side; no bounds of groups help here.

use smallvec::SmallVec;

use super::search::{Candidate, Neighbor, Scratch, Target, gap_squared};
use super::{List, Search, draws_at, is_opaque};
use crate::line::pair::{Pair, distance_squared};
use crate::line::through::{LineStack, Side};

/// A target whose first line is not opaque.
struct Open {
    /// Its place among the targets of its pixel.
    place: usize,
    lines: LineStack,
    /// Whether its own line is seen, if it has one.
    wants_own: bool,
}

impl Scratch<'_, '_> {
    /// For each target of the last pixel, with the line that it sees first, what it sees through that, front to back.
    /// Nothing at all if no target sees anything.
    pub(super) fn search_through(&mut self) -> Vec<Vec<Pair>> {
        let mut targets = std::mem::take(&mut self.targets);
        let open = targets.iter().enumerate().filter_map(|(place, target)| self.open(place, target));
        let mut open: Vec<Open> = open.collect();
        let mut behind = Vec::new();
        if !open.is_empty() {
            self.search_others_through(&targets, &mut open);
            for Open { place, lines, wants_own } in &mut open {
                let target = &mut targets[*place];
                target.best = None;
                *wants_own = lines.settle(|pair| self.is_opaque(target, pair)) && target.node.radius_squared > 0.0;
            }
            self.search_own_through(&mut targets, &open);
            behind.resize(targets.len(), Vec::new());
            for Open { place, lines, .. } in open {
                let own = targets[place].best.replace(lines.first().1);
                behind[place] = lines.into_behind(own);
            }
        }
        self.targets = targets;
        behind
    }

    /// A target, if something may be seen through its line.
    fn open(&self, place: usize, target: &Target) -> Option<Open> {
        let Search { window, .. } = self.search;
        let first = target.best.filter(|first| !first.own)?;
        let (nodes, row) = window.tiles[first.tile as usize].as_ref()?.surface(first.row as usize, first.surface)?;
        let lines = LineStack::new((nodes.object.get(row), nodes.shader.get(row)), first);
        (!self.is_opaque(target, &first)).then_some(Open { place, lines, wants_own: false })
    }

    fn is_opaque(&self, target: &Target, pair: &Pair) -> bool {
        let Search { window, targets, rules, .. } = self.search;
        let neighbors = window.tiles[pair.tile as usize].as_ref();
        neighbors.is_none_or(|neighbors| is_opaque(rules, (targets, target.row), neighbors, pair))
    }

    /// Finds for each target the best line of a neighbour of each side but that of its first.
    fn search_others_through(&mut self, targets: &[Target], open: &mut [Open]) {
        self.sort_candidates(false);
        for next in 0..self.candidates.len() {
            let Candidate { index, tile, place, sight, .. } = self.candidates[next];
            if !sight.others {
                continue;
            }
            let pixel = tile.bounds.pixels[place].pixel;
            let (first, end) = self.gathered(next);
            let neighbors = first as usize..end as usize;
            let sides = self.sides(neighbors.clone(), |list| list.surfaces.len());
            for open in &mut *open {
                let (target, lines) = (&targets[open.place], &mut open.lines);
                let may_win = |side: &Side| {
                    *side != lines.first().0 && lines.of(*side).is_none_or(|best| !best.rank.outranks(sight.best))
                };
                if sight.best.outranks(target.node.rank)
                    && gap_squared(&target.node, pixel) < sight.radius_squared
                    && sides.iter().any(may_win)
                {
                    self.pairs_tested += u64::from(end - first);
                    for n in &self.neighbors[neighbors.clone()] {
                        self.see_others_through(target, lines, n, pixel, index);
                    }
                }
            }
        }
    }

    /// Keeps the best lines of a neighbour that a target sees, one for each side.
    fn see_others_through(&self, target: &Target, lines: &mut LineStack, n: &Neighbor, pixel: [i32; 2], tile: u32) {
        let rules = self.search.rules;
        let distance_squared = distance_squared(&target.node, pixel, n.offset);
        let list = self.list(&target.list);
        for (place, s) in (0..).zip(self.list(n).surfaces) {
            let side = s.side();
            if side == lines.first().0 || distance_squared >= rules.widest_squared(s.radius_squared) {
                continue;
            }
            let pair = Pair { rank: s.rank, distance_squared, pixel, tile, row: n.row, surface: place, own: false };
            if lines.of(side).is_none_or(|best| pair.beats(best))
                && draws_at(&list, s, place, distance_squared, rules)
                && distance_squared < s.radius_squared_beside(list.first(), distance_squared, rules)
            {
                lines.put(side, pair);
            }
        }
    }

    /// Finds for each target that sees so far its own line, beside the nearest neighbour of a side that draws none.
    fn search_own_through(&mut self, targets: &mut [Target], open: &[Open]) {
        if open.iter().all(|open| !open.wants_own) {
            return;
        }
        self.sort_candidates(true);
        for next in 0..self.candidates.len() {
            let Candidate { index, tile, place, sight, .. } = self.candidates[next];
            if !sight.own {
                continue;
            }
            let pixel = tile.bounds.pixels[place].pixel;
            let (first, end) = self.gathered(next);
            let neighbors = first as usize..end as usize;
            let sides = self.sides(neighbors.clone(), |_| 1);
            for Open { place, lines, .. } in open.iter().filter(|open| open.wants_own) {
                let target = &mut targets[*place];
                let gap_squared = gap_squared(&target.node, pixel);
                if gap_squared < self.search.rules.widest_squared(target.node.radius_squared)
                    && target.best.is_none_or(|best| best.distance_squared >= gap_squared)
                    && sides.iter().any(|side| !lines.has(*side))
                {
                    self.pairs_tested += u64::from(end - first);
                    for n in &self.neighbors[neighbors.clone()] {
                        self.see_own(target, n, pixel, index, |side| !lines.has(side));
                    }
                }
            }
        }
    }

    /// The sides of the first surfaces of some neighbours' lists, so many of each.
    fn sides(&self, neighbors: std::ops::Range<usize>, count: impl Fn(&List<'_>) -> usize) -> SmallVec<[Side; 4]> {
        let mut sides = SmallVec::new();
        for n in &self.neighbors[neighbors] {
            let list = self.list(n);
            for side in list.surfaces[..count(&list)].iter().map(super::Surface::side) {
                if !sides.contains(&side) {
                    sides.push(side);
                }
            }
        }
        sides
    }
}
