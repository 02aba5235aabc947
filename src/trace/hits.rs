//! Which hits of a ray come first, and which of those at one place counts.
//!
//! Surfaces that lie in one plane (a decal on a wall, two sides of one sheet, glass against glass) are met at distances that
//! differ by rounding alone, now the one first and now the other. Hits that are not farther apart than the error bounds of
//! their positions are therefore *at one place*: they count as met at the distance of the nearest, and of them the one with the
//! largest priority comes first, then the lower object, then the lower triangle. The priority is that of the object, else
//! of the material; what scripts return is not known yet.
//!
//! The search for the nearest hit looks a little farther than its distance (`slack`, a bound that costs next to nothing), and
//! so knows whether anything else can be at its place. Almost always nothing is. Else the place is looked at again, in a way that
//! depends on the ray alone: neither on the order of the hierarchy nor on whether the ray went in a packet.

use std::cmp::Reverse;

use smallvec::SmallVec;

use super::surface::Surface;
use super::triangle::Ray;
use super::world::{Facet, Hit, World};
use crate::scene::ids::ObjectId;
use crate::scene::settings::RayKinds;

/// Where a hit stands among all hits of its ray.
type Rank = (f32, Reverse<i32>, ObjectId, u32);

/// Hits at one place, first to last.
pub(super) type Place = SmallVec<[Hit; 8]>;

/// The nearest hit, by distance alone.
struct Nearest {
    hit: Hit,
    /// How much farther hits may be that are at the same place.
    slack: f32,
}

impl World {
    fn rank(&self, hit: &Hit) -> Rank {
        let object = self.object(hit.object);
        let priority = object.priorities[object.slot(hit.triangle)];
        (hit.t, Reverse(priority), hit.object, hit.triangle)
    }

    /// The first hit of a ray of one kind within `t_max`.
    #[must_use]
    pub fn closest(&self, ray: &Ray, kind: RayKinds, t_max: f32) -> Option<Hit> {
        let near = self.nearest(ray, kind, t_max, |_| true)?;
        if near.hit.crowded { self.place_of(ray, kind, &near, &[]).first().copied() } else { Some(near.hit) }
    }

    /// The first hit of a ray of one kind behind another of its hits.
    #[must_use]
    pub fn next_hit(&self, ray: &Ray, kind: RayKinds, after: Option<&Hit>) -> Option<Hit> {
        let Some(after) = after else { return self.closest(ray, kind, f32::INFINITY) };
        let mut at = Place::new();
        if after.crowded {
            at = self.place(ray, kind, after);
            let rank = self.rank(after);
            if let Some(next) = at.iter().find(|hit| self.rank(hit) > rank) {
                return Some(*next);
            }
        }
        let is_behind = |hit: &Hit| match after.crowded {
            true => hit.t >= after.t && !is_among(&at, hit),
            false => by_distance(hit) > by_distance(after),
        };
        let near = self.nearest(ray, kind, f32::INFINITY, is_behind)?;
        if near.hit.crowded { self.place_of(ray, kind, &near, &at).first().copied() } else { Some(near.hit) }
    }

    /// All hits at the place of one of a ray's hits.
    pub(super) fn place(&self, ray: &Ray, kind: RayKinds, of: &Hit) -> Place {
        let near = self.nearest(ray, kind, f32::INFINITY, |hit| hit.t >= of.t);
        let at = near.map(|near| self.place_of(ray, kind, &near, &[])).unwrap_or_default();
        // Where places overlap, the nearest may be part of the one before.
        if is_among(&at, of) { at } else { std::iter::once(*of).collect() }
    }

    /// The nearest of the hits that `counts`; it is `crowded` if others may be at its place.
    #[inline]
    fn nearest(&self, ray: &Ray, kind: RayKinds, t_max: f32, counts: impl Fn(&Hit) -> bool) -> Option<Nearest> {
        let mut best: Option<Nearest> = None;
        self.each_hit(ray, kind, t_max, |hit, slack, reach| {
            if !counts(&hit) {
                return true;
            }
            // Whatever is at the place of the final best one was seen, as it is not behind the reach of any earlier best one
            // that is not at that place itself.
            match &mut best {
                Some(Nearest { hit: known, slack }) if by_distance(known) < by_distance(&hit) => {
                    known.crowded |= hit.t <= known.t + *slack;
                }
                _ => {
                    let crowded = best.as_ref().is_some_and(|known| known.hit.t <= hit.t + slack);
                    *reach = reach.min(hit.t + slack);
                    best = Some(Nearest { hit: Hit { crowded, ..hit }, slack });
                }
            }
            true
        });
        best
    }

    /// All hits at the place of the nearest one but those that are `elsewhere`, first to last.
    #[cold]
    fn place_of(&self, ray: &Ray, kind: RayKinds, near: &Nearest, elsewhere: &[Hit]) -> Place {
        let nearest = Surface::new(self, ray.direction, &near.hit);
        let normal = nearest.geometric_normal;
        let mut at = Place::new();
        self.each_hit(ray, kind, near.hit.t + near.slack, |hit, _, _| {
            if hit.t < near.hit.t || is_among(elsewhere, &hit) {
                return true;
            }
            let there = Surface::new(self, ray.direction, &hit);
            let apart = normal.dot(there.position - nearest.position).abs();
            if hit.facet() == near.hit.facet() || apart <= normal.abs().dot(nearest.error + there.error) {
                at.push(Hit { t: near.hit.t, ..hit });
            }
            true
        });
        let crowded = at.len() > 1;
        at.iter_mut().for_each(|hit| hit.crowded = crowded);
        at.sort_by(|a, b| self.rank(a).partial_cmp(&self.rank(b)).unwrap_or(std::cmp::Ordering::Equal));
        at
    }

    /// The first hits of a ray of one kind, front to back, in one traversal: at most `most`, of those that are `same` (an
    /// equivalence) only the first, none up to `after`, and none that is `absent`. They are those that [`Self::next_hit`]
    /// finds one after the other, bit for bit.
    ///
    /// Instead of looking for one hit after the other (Wald et al. 2018), the nearest are kept sorted while the hierarchy is
    /// traversed once, and the last of them is the far end of the ray: no hit is lost or doubled at equal depth, since
    /// ranks settle all ties, and nothing is traversed twice. Only where several may be at one place they are looked for one by one.
    pub fn first_hits(
        &self,
        ray: &Ray,
        kind: RayKinds,
        (after, absent): (Option<&Hit>, &[Facet]),
        most: usize,
        same: impl Fn(&Hit, &Hit) -> bool,
        hits: &mut Vec<Hit>,
    ) {
        hits.clear();
        let mut crowded = after.is_some_and(|after| after.crowded);
        let mut slacks: SmallVec<[f32; 16]> = SmallVec::new();
        if !crowded {
            self.each_hit(ray, kind, f32::INFINITY, |hit, slack, reach| {
                if after.is_some_and(|after| by_distance(&hit) <= by_distance(after)) {
                    return true;
                }
                let at_one_place = |(known, known_slack): (&Hit, &f32)| match by_distance(known) < by_distance(&hit) {
                    true => hit.t <= known.t + known_slack,
                    false => known.t <= hit.t + slack,
                };
                crowded |= hits.iter().zip(&slacks).any(at_one_place);
                if crowded {
                    return false;
                }
                if absent.contains(&hit.facet()) {
                    return true;
                }
                match hits.iter().position(|known| same(known, &hit)) {
                    Some(known) if by_distance(&hit) < by_distance(&hits[known]) => {
                        hits.remove(known);
                        slacks.remove(known);
                    }
                    Some(_) => return true,
                    None => {}
                }
                let place = hits.partition_point(|known| by_distance(known) < by_distance(&hit));
                if place < most {
                    hits.truncate(most - 1);
                    slacks.truncate(most - 1);
                    hits.insert(place, hit);
                    slacks.insert(place, slack);
                    if hits.len() == most {
                        *reach = hits[most - 1].t + slacks[most - 1];
                    }
                }
                true
            });
        }
        if crowded {
            self.first_hits_one_by_one(ray, kind, (after, absent), most, same, hits);
        }
    }

    #[cold]
    fn first_hits_one_by_one(
        &self,
        ray: &Ray,
        kind: RayKinds,
        (after, absent): (Option<&Hit>, &[Facet]),
        most: usize,
        same: impl Fn(&Hit, &Hit) -> bool,
        hits: &mut Vec<Hit>,
    ) {
        hits.clear();
        let mut after = after.copied();
        while hits.len() < most
            && let Some(hit) = self.next_hit(ray, kind, after.as_ref())
        {
            after = Some(hit);
            if !absent.contains(&hit.facet()) && !hits.iter().any(|known| same(known, &hit)) {
                hits.push(hit);
            }
        }
    }
}

/// The order of hits as they are met.
fn by_distance(hit: &Hit) -> (f32, ObjectId, u32) {
    (hit.t, hit.object, hit.triangle)
}

fn is_among(hits: &[Hit], hit: &Hit) -> bool {
    hits.iter().any(|known| known.facet() == hit.facet())
}
