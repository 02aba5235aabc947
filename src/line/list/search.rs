//! The exact search with lists of surfaces: the lines of [`super::brute`], bit for bit, without looking at most pairs.
//!
//! The targets of one pixel are searched together, as in [`crate::line::search`]:
//!
//! 1. Tiles, blocks and pixels that cannot matter are left out: too far for their widest line, or what could draw does not
//!    differ from any first surface or is surely met by every list of the other side ([`Lists::surely_meet`]), or lies
//!    behind every first surface. Most pixels end here.
//! 2. Lines of neighbours: the pixels that are left are visited from the best rank down, until what was found outranks them.
//! 3. Own lines, where there is no other: from the nearest pixel outwards, until what was found is nearer.
//!
//! Where callers only ask how lines look ([`Rules::with_any_pair`](crate::line::Rules::with_any_pair)) and all lines near by
//! have one opaque style, nearer pixels come first and a target is done with the first line it sees. Hidden lines all
//! have one style.
//!
//! What is seen through lines that are not opaque is searched by [`super::through`].

use super::bounds::Lists;
use super::{Kind, List, Search, Surface, draws_at, draws_own, push_list};
use crate::line::bounds::{Bounded, Stylist};
use crate::line::materials::may_differ;
use crate::line::pair::{Found, LineNode, Pair, Rank, distance_squared};
use crate::line::search::{pixel_gap_squared, pixel_rect, rect_gap_squared};
use crate::line::through::Side;
use crate::line::window::{LineStyle, PathTile, style};
use crate::line::{LineCounts, Rules};

/// The line that each target sees which is not `skipped`, in no particular order.
pub(in crate::line) fn find(search: &Search<'_, '_>, skipped: &[bool], counts: &mut LineCounts) -> Vec<Found> {
    let targets = search.targets;
    let mut scratch = Scratch::new(*search);
    scratch.collect_tiles();
    let mut found = Vec::new();
    for (index, block) in targets.bounds.blocks.iter().enumerate() {
        scratch.collect_blocks(index);
        if scratch.near_block.is_empty() {
            continue;
        }
        for place in block.first as usize..block.end as usize {
            scratch.search_pixel(place, skipped);
            let mut behind = if search.kind == Kind::Visible { scratch.search_through() } else { Vec::new() };
            for (i, target) in scratch.targets.iter().enumerate() {
                let Target { row, best: Some(pair), .. } = *target else { continue };
                let behind = behind.get_mut(i).map(std::mem::take).unwrap_or_default();
                let hidden = search.kind == Kind::Hidden;
                found.push(Found { row, path: targets.nodes.path, pair, hidden, behind });
            }
        }
    }
    counts.pairs_tested += scratch.pairs_tested;
    found
}

/// What targets may see of some neighbours.
#[derive(Clone, Copy)]
pub(super) struct Sight {
    /// No line of a neighbour, or none at all if hidden ones are searched, outranks this.
    pub best: Rank,
    /// Whether they may see lines of neighbours; if hidden ones are searched, any.
    pub others: bool,
    /// Whether they may see their own.
    pub own: bool,
    /// The widest line's, of those that the targets do not draw themselves.
    pub radius_squared: f32,
    /// The style of the neighbours' lines.
    style: Styles,
}

/// The styles of some lines.
#[derive(Clone, Copy, PartialEq)]
enum Styles {
    None,
    /// All are opaque and have this one.
    One(LineStyle),
    Many,
}

impl Styles {
    fn and(self, other: Self) -> Self {
        match (self, other) {
            (Self::None, styles) | (styles, Self::None) => styles,
            (Self::One(a), Self::One(b)) if a == b => self,
            _ => Self::Many,
        }
    }
}

/// A block that may hold neighbours.
#[derive(Clone, Copy)]
struct Near<'w, 'a> {
    /// Place of its tile in the window.
    index: u32,
    tile: &'w PathTile<'a>,
    block: usize,
}

/// A pixel that may hold neighbours.
#[derive(Clone, Copy)]
pub(super) struct Candidate<'w, 'a> {
    pub index: u32,
    pub tile: &'w PathTile<'a>,
    /// Its place in the bounds of its tile.
    pub place: usize,
    /// Smallest squared distance from the pixel of targets.
    gap_squared: f32,
    pub sight: Sight,
    /// Where its neighbours are in [`Scratch::neighbors`], once gathered.
    gathered: Option<(u32, u32)>,
}

/// A neighbour with its list in [`Scratch::surfaces`].
#[derive(Clone, Copy)]
pub(super) struct Neighbor {
    pub offset: [f32; 2],
    pub row: u32,
    first: u32,
    end: u32,
    full: bool,
}

/// A target with its list in [`Scratch::surfaces`] and the best pair found so far.
pub(super) struct Target {
    pub row: usize,
    pub node: LineNode,
    pub list: Neighbor,
    /// The style of its own line, if that is opaque.
    style: Option<LineStyle>,
    pub best: Option<Pair>,
    /// Whether nothing can change how it looks.
    settled: bool,
}

pub(super) struct Scratch<'w, 'a> {
    pub search: Search<'w, 'a>,
    any_pair: bool,
    tiles: Vec<(u32, &'w PathTile<'a>)>,
    near_block: Vec<Near<'w, 'a>>,
    pub candidates: Vec<Candidate<'w, 'a>>,
    /// Lists of targets and neighbours of the current pixel.
    surfaces: Vec<Surface>,
    pub neighbors: Vec<Neighbor>,
    pub targets: Vec<Target>,
    /// The last line of a neighbour that was found: likely the next one, too.
    last_other: Option<Pair>,
    pub pairs_tested: u64,
}

impl<'w, 'a> Scratch<'w, 'a> {
    fn new(search: Search<'w, 'a>) -> Self {
        Self {
            search,
            any_pair: !search.rules.exact_pairs(),
            tiles: Vec::new(),
            near_block: Vec::new(),
            candidates: Vec::new(),
            surfaces: Vec::new(),
            neighbors: Vec::new(),
            targets: Vec::new(),
            last_other: None,
            pairs_tested: 0,
        }
    }

    /// What targets with these lists may see of neighbours with those, if anything.
    fn sight(&self, t: &Lists<'_>, n: &Lists<'_>, tile: &PathTile<'_>, gap_squared: f32) -> Option<Sight> {
        let rules = self.search.rules;
        let t1 = t.first();
        let met = |lists: &Lists<'_>, s: &Bounded<'_>| lists.surely_meet(s, gap_squared, rules);
        let mut sight = Sight { best: Rank::LAST, others: false, own: false, radius_squared: 0.0, style: Styles::None };
        match self.search.kind {
            Kind::Visible => {
                let n1 = n.first();
                let firsts_may_differ = may_differ(rules, &t1, &n1, gap_squared);
                for place in 0..n.places() {
                    let Some((s, _)) = n.at(place) else { continue };
                    if gap_squared < s.bounds.radius_squared
                        && s.bounds.best.outranks(t1.bounds.lowest)
                        && (if place == 0 { firsts_may_differ } else { !met(t, &s) })
                    {
                        sight.others = true;
                        sight.best = sight.best.better(s.bounds.best);
                        sight.radius_squared = sight.radius_squared.max(s.bounds.radius_squared);
                        if self.any_pair {
                            sight.style = sight.style.and(styles(tile, place, s.bounds.stylist, rules));
                        }
                    }
                }
                sight.own = firsts_may_differ
                    && gap_squared < t1.bounds.radius_squared
                    && (!n1.bounds.lowest.outranks(t1.bounds.highest) || !met(n, &t1));
            }
            Kind::Hidden => {
                let radius_squared = rules.hidden().map_or(0.0, |hidden| hidden.radius_squared);
                if gap_squared >= radius_squared {
                    return None;
                }
                sight.radius_squared = radius_squared;
                for place in 0..n.places() {
                    let Some((s, _)) = n.at(place) else { continue };
                    if s.bounds.radius_squared > 0.0 && t1.bounds.highest.outranks(s.bounds.lowest) && !met(t, &s) {
                        sight.others = true;
                        sight.best = sight.best.better(s.bounds.best);
                    }
                }
                for place in 1..t.places() {
                    let Some((s, _)) = t.at(place) else { continue };
                    if s.bounds.radius_squared > 0.0 && t1.bounds.highest.outranks(s.bounds.lowest) && !met(n, &s) {
                        sight.others = true;
                        sight.best = sight.best.better(s.bounds.best);
                    }
                }
            }
        }
        (sight.others || sight.own).then_some(sight)
    }

    fn collect_tiles(&mut self) {
        let Search { window, targets, rules, .. } = self.search;
        let lists = Lists::of_tile(targets.bounds);
        for (index, tile) in window.tiles_in(targets.buffer.rect.grown(rules.reach())) {
            let gap_squared = rect_gap_squared(&targets.buffer.rect, &tile.buffer.rect);
            if self.sight(&lists, &Lists::of_tile(tile.bounds), tile, gap_squared).is_some() {
                self.tiles.push((index as u32, tile));
            }
        }
    }

    fn collect_blocks(&mut self, targets: usize) {
        let bounds = self.search.targets.bounds;
        let (rect, lists) = (bounds.blocks[targets].rect, Lists::of_block(bounds, targets));
        let mut near = std::mem::take(&mut self.near_block);
        near.clear();
        for &(index, tile) in &self.tiles {
            for (block, of_block) in tile.bounds.blocks.iter().enumerate() {
                let gap_squared = rect_gap_squared(&rect, &of_block.rect);
                if self.sight(&lists, &Lists::of_block(tile.bounds, block), tile, gap_squared).is_some() {
                    near.push(Near { index, tile, block });
                }
            }
        }
        self.near_block = near;
    }

    /// Collects the pixels that may hold neighbours of a pixel of targets.
    fn collect_pixels(&mut self, place: usize) {
        let bounds = self.search.targets.bounds;
        let (pixel, lists) = (bounds.pixels[place].pixel, Lists::of_pixel(bounds, place));
        let mut candidates = std::mem::take(&mut self.candidates);
        candidates.clear();
        for &Near { index, tile, block } in &self.near_block {
            let of_block = &tile.bounds.blocks[block];
            let gap_squared = rect_gap_squared(&pixel_rect(pixel), &of_block.rect);
            if self.sight(&lists, &Lists::of_block(tile.bounds, block), tile, gap_squared).is_none() {
                continue;
            }
            for place in of_block.first as usize..of_block.end as usize {
                let gap_squared = pixel_gap_squared(pixel, tile.bounds.pixels[place].pixel);
                if let Some(sight) = self.sight(&lists, &Lists::of_pixel(tile.bounds, place), tile, gap_squared) {
                    candidates.push(Candidate { index, tile, place, gap_squared, sight, gathered: None });
                }
            }
        }
        self.candidates = candidates;
    }

    /// Leaves the targets of a pixel, with what they see, in [`Self::targets`].
    fn search_pixel(&mut self, place: usize, skipped: &[bool]) {
        self.targets.clear();
        self.surfaces.clear();
        self.neighbors.clear();
        self.collect_pixels(place);
        if self.candidates.is_empty() {
            return;
        }
        let Search { targets, rules, .. } = self.search;
        let pixel = &targets.bounds.pixels[place];
        self.gather(targets, place);
        for list in std::mem::take(&mut self.neighbors) {
            let row = list.row as usize;
            if !skipped[targets.nodes.rows.sample(row) as usize] {
                let node = targets.node(pixel.pixel, row);
                let style = Some(targets.style(row, rules)).filter(|style| style.is_opaque(rules));
                self.targets.push(Target { row, node, list, style, best: None, settled: false });
            }
        }
        if self.targets.is_empty() {
            return;
        }
        match self.search.kind {
            Kind::Visible => {
                self.search_others();
                self.search_own();
            }
            Kind::Hidden => self.search_hidden(),
        }
    }

    /// Finds for each target the highest-ranking line of a neighbour.
    fn search_others(&mut self) {
        let mut targets = std::mem::take(&mut self.targets);
        if let Some(last) = self.last_other {
            self.test_again(&mut targets, &last);
        }
        let others = self.candidates.iter().filter(|candidate| candidate.sight.others);
        let styles = others.fold(Styles::None, |all, candidate| all.and(candidate.sight.style));
        let style = if let Styles::One(style) = styles { Some(style) } else { None };
        self.sort_candidates(style.is_some());
        if style.is_some() {
            targets.iter_mut().for_each(|target| target.settled = target.best.is_some());
        }
        for next in 0..self.candidates.len() {
            let Candidate { tile, place, sight, .. } = self.candidates[next];
            if !sight.others {
                continue;
            }
            let pixel = tile.bounds.pixels[place].pixel;
            let open = |target: &Target| {
                if target.settled
                    || !sight.best.outranks(target.node.rank)
                    || target.best.is_some_and(|best| best.rank.outranks(sight.best))
                {
                    return false;
                }
                let gap_squared = gap_squared(&target.node, pixel);
                gap_squared < sight.radius_squared
                    && target.best.is_none_or(|best| best.rank != sight.best || best.distance_squared >= gap_squared)
            };
            if !targets.iter().any(open) {
                continue;
            }
            let (first, end) = self.gathered(next);
            let index = self.candidates[next].index;
            for target in targets.iter_mut().filter(|target| open(target)) {
                self.pairs_tested += u64::from(end - first);
                for n in &self.neighbors[first as usize..end as usize] {
                    self.see_others(target, n, pixel, index);
                    if style.is_some() && target.best.is_some() {
                        target.settled = true;
                        break;
                    }
                }
            }
        }
        self.last_other = targets.iter().rev().find_map(|target| target.best).or(self.last_other);
        targets.iter_mut().for_each(|target| target.settled = target.best.is_some());
        self.targets = targets;
    }

    /// Finds for each target without another line the nearest neighbour that lacks it.
    fn search_own(&mut self) {
        let rules = self.search.rules;
        let mut targets = std::mem::take(&mut self.targets);
        self.sort_candidates(true);
        for next in 0..self.candidates.len() {
            let Candidate { tile, place, sight, .. } = self.candidates[next];
            if !sight.own {
                continue;
            }
            let pixel = tile.bounds.pixels[place].pixel;
            let open = |target: &Target| {
                if target.settled {
                    return false;
                }
                let gap_squared = gap_squared(&target.node, pixel);
                gap_squared < rules.widest_squared(target.node.radius_squared)
                    && target.best.is_none_or(|best| best.distance_squared >= gap_squared)
            };
            if !targets.iter().any(open) {
                continue;
            }
            let (first, end) = self.gathered(next);
            let index = self.candidates[next].index;
            for target in targets.iter_mut().filter(|target| open(target)) {
                self.pairs_tested += u64::from(end - first);
                for n in &self.neighbors[first as usize..end as usize] {
                    self.see_own(target, n, pixel, index, |_| true);
                    // An own line looks the same whichever its neighbour is.
                    if self.any_pair && target.style.is_some() && target.best.is_some() {
                        target.settled = true;
                        break;
                    }
                }
            }
        }
        self.targets = targets;
    }

    /// Finds for each target its hidden line.
    fn search_hidden(&mut self) {
        let mut targets = std::mem::take(&mut self.targets);
        self.sort_candidates(self.any_pair);
        for next in 0..self.candidates.len() {
            let Candidate { tile, place, sight, .. } = self.candidates[next];
            let pixel = tile.bounds.pixels[place].pixel;
            let open = |target: &Target| {
                !target.settled
                    && target.best.is_none_or(|best| !best.rank.outranks(sight.best))
                    && gap_squared(&target.node, pixel) < sight.radius_squared
            };
            if !targets.iter().any(open) {
                continue;
            }
            let (first, end) = self.gathered(next);
            let index = self.candidates[next].index;
            for target in targets.iter_mut().filter(|target| open(target)) {
                self.pairs_tested += u64::from(end - first);
                for n in &self.neighbors[first as usize..end as usize] {
                    self.see_hidden(target, n, pixel, index);
                    if self.any_pair && target.best.is_some() {
                        target.settled = true;
                        break;
                    }
                }
            }
        }
        self.targets = targets;
    }

    /// Orders candidates by distance, or by rank and then distance.
    pub(super) fn sort_candidates(&mut self, nearest: bool) {
        self.candidates.sort_unstable_by(|a, b| {
            let by_gap = a.gap_squared.total_cmp(&b.gap_squared);
            let by_rank = a.sight.best.cmp(&b.sight.best);
            let order = if nearest { by_gap.then(by_rank) } else { by_rank.then(by_gap) };
            order.then((a.index, a.place).cmp(&(b.index, b.place)))
        });
    }

    /// The neighbours of a candidate, in [`Self::neighbors`].
    pub(super) fn gathered(&mut self, candidate: usize) -> (u32, u32) {
        let Candidate { tile, place, gathered, .. } = self.candidates[candidate];
        gathered.unwrap_or_else(|| {
            let first = self.neighbors.len() as u32;
            self.gather(tile, place);
            let range = (first, self.neighbors.len() as u32);
            self.candidates[candidate].gathered = Some(range);
            range
        })
    }

    /// Gathers the lists of a pixel.
    fn gather(&mut self, tile: &PathTile<'_>, place: usize) {
        let rules = self.search.rules;
        let pixel = &tile.bounds.pixels[place];
        for row in pixel.first as usize..pixel.end as usize {
            let first = self.surfaces.len() as u32;
            let full = push_list(tile, row, rules, &mut self.surfaces);
            let end = self.surfaces.len() as u32;
            self.neighbors.push(Neighbor { offset: tile.offset(row), row: row as u32, first, end, full });
        }
    }

    pub(super) fn list(&self, of: &Neighbor) -> List<'_> {
        List { surfaces: &self.surfaces[of.first as usize..of.end as usize], full: of.full }
    }

    /// Keeps the best line of a neighbour that a target sees.
    #[inline]
    fn see_others(&self, target: &mut Target, n: &Neighbor, pixel: [i32; 2], tile: u32) {
        let distance_squared = distance_squared(&target.node, pixel, n.offset);
        let rules = self.search.rules;
        for (place, s) in (0..).zip(self.list(n).surfaces) {
            if distance_squared >= rules.widest_squared(s.radius_squared) {
                continue;
            }
            let pair = Pair { rank: s.rank, distance_squared, pixel, tile, row: n.row, surface: place, own: false };
            if target.best.is_none_or(|best| pair.beats(&best))
                && draws_at(&self.list(&target.list), s, place, distance_squared, rules)
                && distance_squared < s.radius_squared_beside(self.list(&target.list).first(), distance_squared, rules)
            {
                target.best = Some(pair);
            }
        }
    }

    /// Keeps the own line of a target if a neighbour lacks it, whose first surface is of a side that `may_border` it.
    #[inline]
    pub(super) fn see_own(
        &self,
        target: &mut Target,
        n: &Neighbor,
        pixel: [i32; 2],
        tile: u32,
        may_border: impl Fn(Side) -> bool,
    ) {
        let distance_squared = distance_squared(&target.node, pixel, n.offset);
        let rules = self.search.rules;
        if distance_squared >= rules.widest_squared(target.node.radius_squared) {
            return;
        }
        let (list, rank) = (self.list(n), target.node.rank);
        let pair = Pair { rank, distance_squared, pixel, tile, row: n.row, surface: 0, own: true };
        if target.best.is_none_or(|best| pair.beats(&best))
            && draws_own(&self.list(&target.list), &list, distance_squared, rules)
            && distance_squared
                < self.list(&target.list).first().radius_squared_beside(list.first(), distance_squared, rules)
            && may_border(list.first().side())
        {
            target.best = Some(pair);
        }
    }

    /// Keeps the best hidden line that a target sees beside a neighbour.
    fn see_hidden(&self, target: &mut Target, n: &Neighbor, pixel: [i32; 2], tile: u32) {
        let Some(hidden) = self.search.rules.hidden() else { return };
        let distance_squared = distance_squared(&target.node, pixel, n.offset);
        if distance_squared >= hidden.radius_squared {
            return;
        }
        let (t, n_list, rules) = (self.list(&target.list), self.list(n), self.search.rules);
        let front = target.node.rank;
        for (list, other, own) in [(n_list, t, false), (t, n_list, true)] {
            for (place, s) in (0..).zip(list.surfaces) {
                if !front.outranks(s.rank) || s.radius_squared <= 0.0 || !hidden.draws(s.features.object) {
                    continue;
                }
                let pair = Pair { rank: s.rank, distance_squared, pixel, tile, row: n.row, surface: place, own };
                if target.best.is_none_or(|best| pair.beats(&best)) && other.lacks(s, distance_squared, rules) {
                    target.best = Some(pair);
                }
            }
        }
    }

    /// Tests all targets of a pixel with the neighbour of another target's pair.
    fn test_again(&mut self, targets: &mut [Target], pair: &Pair) {
        let Search { window, rules, .. } = self.search;
        let Some(tile) = &window.tiles[pair.tile as usize] else { return };
        let first = self.surfaces.len();
        let full = push_list(tile, pair.row as usize, rules, &mut self.surfaces);
        let neighbor = Neighbor {
            offset: tile.offset(pair.row as usize),
            row: pair.row,
            first: first as u32,
            end: self.surfaces.len() as u32,
            full,
        };
        self.pairs_tested += targets.len() as u64;
        for target in targets {
            self.see_others(target, &neighbor, pair.pixel, pair.tile);
        }
    }
}

/// The smallest squared distance that [`distance_squared`] can give between a target and a neighbour in a pixel: offsets are
/// 0 … 1, and every step of it is monotone.
#[inline]
pub(super) fn gap_squared(target: &LineNode, pixel: [i32; 2]) -> f32 {
    let gap = |axis: usize| {
        let pixels = (pixel[axis] - target.pixel[axis]) as f32;
        (pixels + (0.0 - target.offset[axis])).max(-(pixels + (1.0 - target.offset[axis]))).max(0.0)
    };
    let (x, y) = (gap(0), gap(1));
    x * x + y * y
}

/// The styles of the lines at a place of the lists of a tile, by who has it.
fn styles(tile: &PathTile<'_>, place: usize, stylist: Stylist, rules: &Rules) -> Styles {
    let nodes = place.checked_sub(1).map_or(tile.nodes, |behind| &tile.nodes.behind[behind]);
    match stylist {
        Stylist::None => Styles::None,
        Stylist::Alike(row) => Styles::One(style(nodes, row as usize, rules)),
        Stylist::Many => Styles::Many,
    }
}
