//! Lines with lists of surfaces (DESIGN section 3.4): what is known behind the first surface draws and settles lines, too.
//!
//! A **list** holds the first K surfaces of a sample's ray at a path, front to back; without any, the miss. A miss behind
//! surfaces is no entry: it would match what the tests cannot tell from it. The tracer decides which crossings are
//! surfaces (`trace::list`); here a surface is what has features, a rank and a line.
//!
//! For target t, neighbour n and their first surfaces t₁ and n₁:
//!
//! - Section 3.2 stays: if t₁ and n₁ differ, n₁ draws its line at t if it outranks t₁, else t₁ draws.
//! - t *lacks* s if s differs from every surface of t's list and the list is complete to s.
//! - A surface s of n that t lacks draws its line at t if it outranks t₁, in the style of s, within the radius of s.
//! - t₁ draws its own line at t if n lacks it, in its style, within its radius.
//!
//! Of all these the seen one minimises −priority, depth, distance, index of n, place in n's list, as in section 3.2.
//!
//! Whether two surfaces differ is decided by the tests of the material of the one that would draw. A line's type is that of
//! the differences between the surface that draws it and the first of the other side.
//!
//! So lists add lines and take none away. The text can be read as if 3.2 held no more for K > 1; then two objects that
//! cut each other would lose the line along the cut, since each goes on inside the other and is in both lists; and so would
//! the edges of a box, whose far sides, turned towards the ray, have the normals of its near sides.
//!
//! **Priority.** Section 3.2 orders nodes by *rank*: explicit priority, then depth. Both of the text's orders are read that
//! way. "Not behind t's first surface": s outranks t₁ (at equal rank the target draws, as in 3.2). "Complete at least to s's
//! depth": the list ended before K surfaces, so nothing is missing; or its last surface does not outrank s, so what is
//! missing behind it is thought to come after s. Without priorities, that is the depth of the text. With K = 1 a list is
//! its first surface and always full, so n lacks t₁ exactly if they differ and n₁ does not outrank it, and t lacks n₁
//! exactly if they differ and t₁ does not outrank that: section 3.2 once more, which a test holds fast.
//!
//! **Hidden lines** are those of surfaces that t₁ outranks: of s in n's list which t lacks, and of t's own later surfaces
//! which n lacks. Only surfaces that draw lines at all have hidden ones. All are drawn in one style and opaque, by the same
//! order, where no visible line is seen at any path. A surface that rays go on through hides nothing: what lies behind it
//! is hidden or not at the path that goes on.
//!
//! `brute` is this text as loops; `search` gives the same bits. `bounds` is what is known of many lists at once.

pub(super) mod bounds;
pub(super) mod brute;
pub(super) mod search;
mod through;

use super::differ::{Features, Tests};
use super::overlap::Facet;
use super::pair::{Pair, Rank};
use super::through::Side;
use super::window::{PathTile, PathWindow, alpha, features};
use super::{Fired, LineScript, LineType, Rules};
use crate::sample::{Column, NodeColumns};

/// Which lines are looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Those of surfaces that are not behind the target's first.
    Visible,
    /// Those of surfaces that are.
    Hidden,
}

/// What is searched, and where.
#[derive(Clone, Copy)]
pub(super) struct Search<'w, 'a> {
    pub window: &'w PathWindow<'a>,
    pub targets: &'w PathTile<'a>,
    pub rules: &'w Rules,
    pub kind: Kind,
}

/// One surface of a list.
#[derive(Clone, Copy, Debug)]
pub(super) struct Surface {
    pub features: Features,
    pub rank: Rank,
    /// Square of the radius of its line but for what types change, 0 if it draws none.
    pub radius_squared: f32,
    /// Where the overlap test reads it.
    pub facet: Facet,
}

impl Surface {
    /// That of a row, whose lines have these squared radii.
    #[inline]
    fn of(nodes: &NodeColumns, row: usize, radii_squared: &Column<f32>, rules: &Rules) -> Self {
        Self {
            features: features(nodes, row),
            rank: Rank::new(nodes.priority.get(row), nodes.depth.get(row)),
            radius_squared: radii_squared.get(row),
            facet: if rules.tests().reads_facets() { Facet::of(nodes, row) } else { Facet::NONE },
        }
    }

    /// Its object and material.
    fn side(&self) -> Side {
        (self.features.object, self.features.shader)
    }

    /// Whether its material finds that another surface differs, on rays that lie so far apart on the film.
    #[inline]
    fn differs(&self, other: &Self, distance_squared: f32, rules: &Rules) -> bool {
        let (a, b) = (&self.features, &other.features);
        let tests = rules.tests_of(a.shader);
        tests.differ(a, b) || (tests.reads_facets() && self.overlaps(other, distance_squared, tests))
    }

    /// Which tests of its material find that another surface differs.
    fn fired(&self, other: &Self, distance_squared: f32, rules: &Rules) -> Fired {
        let tests = rules.tests_of(self.features.shader);
        let mut fired = tests.fired(&self.features, &other.features);
        fired.set(Fired::OVERLAP, tests.reads_facets() && self.overlaps(other, distance_squared, tests));
        fired
    }

    /// The squared radius of the line that it draws where the first surface of another ray is this one.
    #[inline]
    pub fn radius_squared_beside(&self, other: &Self, distance_squared: f32, rules: &Rules) -> f32 {
        match rules.types() {
            None => self.radius_squared,
            Some(types) => types.radius_squared_of(self.fired(other, distance_squared, rules), self.radius_squared),
        }
    }

    #[inline]
    fn overlaps(&self, other: &Self, distance_squared: f32, tests: &Tests) -> bool {
        self.features.object == other.features.object
            && !self.features.is_miss()
            && self.facet.overlaps(&other.facet, distance_squared, tests.overlap)
    }
}

/// The surfaces of one sample's ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct List<'l> {
    /// Front to back, at least one.
    pub surfaces: &'l [Surface],
    /// Whether there are as many as a list can hold, so that some may be missing.
    pub full: bool,
}

impl List<'_> {
    /// Whether a surface, with this rank, would be in the list if the ray met it.
    #[inline]
    fn is_complete_to(&self, rank: Rank) -> bool {
        !self.full || self.surfaces.last().is_none_or(|last| !last.rank.outranks(rank))
    }

    pub fn first(&self) -> &Surface {
        &self.surfaces[0]
    }

    /// Whether the ray is known not to meet a surface of a ray that lies so far from it on the film.
    #[inline]
    pub fn lacks(&self, surface: &Surface, distance_squared: f32, rules: &Rules) -> bool {
        self.is_complete_to(surface.rank)
            && self.surfaces.iter().all(|known| surface.differs(known, distance_squared, rules))
    }
}

/// Whether the surface at a place of a neighbour's list draws a line at a target so far away, if it reaches so far.
#[inline]
pub(super) fn draws_at(t: &List<'_>, s: &Surface, place: u32, distance_squared: f32, rules: &Rules) -> bool {
    s.rank.outranks(t.first().rank)
        && match place {
            0 => s.differs(t.first(), distance_squared, rules),
            _ => t.lacks(s, distance_squared, rules),
        }
}

/// Whether the first surface of a target draws its own line beside a neighbour so far away, if it reaches so far.
#[inline]
pub(super) fn draws_own(t: &List<'_>, n: &List<'_>, distance_squared: f32, rules: &Rules) -> bool {
    let (t1, n1) = (t.first(), n.first());
    t1.differs(n1, distance_squared, rules) && (!n1.rank.outranks(t1.rank) || n.lacks(t1, distance_squared, rules))
}

/// Appends the list of a row; returns whether it is full.
pub(super) fn push_list(tile: &PathTile<'_>, row: usize, rules: &Rules, surfaces: &mut Vec<Surface>) -> bool {
    let first = surfaces.len();
    surfaces.push(Surface::of(tile.nodes, row, &tile.bounds.radius_squared, rules));
    for (place, layer) in (1..).zip(&tile.bounds.behind) {
        let Some((nodes, row)) = tile.surface(row, place) else { break };
        surfaces.push(Surface::of(nodes, row, &layer.radius_squared, rules));
    }
    surfaces.len() - first == rules.surfaces()
}

/// Which tests find a difference between the two sides of a line: the surface that draws it, and the first of the other
/// sample.
pub(super) fn fired(
    rules: &Rules,
    (targets, row): (&PathTile<'_>, usize),
    neighbors: &PathTile<'_>,
    pair: &Pair,
) -> Option<Fired> {
    let mut list = Vec::new();
    push_list(targets, row, rules, &mut list);
    let mine = *list.get(if pair.own { pair.surface as usize } else { 0 })?;
    list.clear();
    push_list(neighbors, pair.row as usize, rules, &mut list);
    let theirs = *list.get(if pair.own { 0 } else { pair.surface as usize })?;
    let (drawing, other) = if pair.own { (mine, theirs) } else { (theirs, mine) };
    Some(drawing.fired(&other, pair.distance_squared, rules))
}

/// Whether nothing is seen through the line of a pair.
pub(super) fn is_opaque(
    rules: &Rules,
    (targets, row): (&PathTile<'_>, usize),
    neighbors: &PathTile<'_>,
    pair: &Pair,
) -> bool {
    let (tile, of) = if pair.own { (targets, row) } else { (neighbors, pair.row as usize) };
    let Some((nodes, styling)) = tile.surface(of, pair.surface) else { return true };
    // What a script makes of it is not known yet.
    if rules.script_of(nodes.shader.get(styling)) == LineScript::Opacity {
        return false;
    }
    let kind = rules.types().and_then(|_| LineType::of(fired(rules, (targets, row), neighbors, pair)?));
    alpha(nodes, styling, kind, rules) >= 1.0
}
