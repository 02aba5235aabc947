//! Packets of rays through the world. What they find is what [`World::closest`] and [`World::blocked`] find of each ray, bit
//! for bit.

use super::packet::{self, DONE, LANES, LaneHits, LaneRays, Lanes, RayStart, Visit, intersect, largest};
use super::triangle::Ray;
use super::world::{Hit, PlacedObject, World};
use crate::scene::ids::{MaterialId, ObjectId};
use crate::scene::settings::RayKinds;

/// Fewer rays are traced one by one.
const FEWEST: usize = 4;

/// What a packet knows of the way of one of its rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// Nothing is on it.
    Clear,
    /// Something that surely blocks is on it.
    Blocked,
    /// Something is on it that may let pass: ask [`World::blocked`].
    Unsure,
}

impl World {
    /// The closest hits of at most [`LANES`] rays of one kind, as [`Self::closest`] finds them one by one. Quickest where the
    /// rays go much the same way.
    #[must_use]
    pub fn closest_of(&self, rays: &[RayStart], kind: RayKinds) -> [Option<Hit>; LANES] {
        let mut hits = [None; LANES];
        let packet = if rays.len() < FEWEST { None } else { LaneRays::of(rays) };
        let traced = packet.and_then(|packet| {
            let found = Found::new(rays.len());
            self.arch.dispatch(Closest { world: self, rays: &packet, kind, found })
        });
        match traced {
            Some(found) => hits = std::array::from_fn(|lane| found.hit(lane)),
            None => {
                for (hit, &(origin, direction)) in hits.iter_mut().zip(rays) {
                    *hit = self.closest(&Ray::new(origin, direction), kind, f32::INFINITY);
                }
            }
        }
        hits
    }

    /// Whether something blocks at most [`LANES`] shadow rays within their `reach`. Slower than single rays, which stop at the
    /// first thing they meet (`tests/bench/README.md`), so the renderer does not use it; the benchmark shows it. `opaque` is as for [`Self::blocked`].
    #[must_use]
    pub fn blocked_of(&self, rays: &[RayStart], reach: &[f32], opaque: impl Fn(MaterialId) -> bool) -> [Way; LANES] {
        let packet = if rays.len() < FEWEST { None } else { LaneRays::of(rays) };
        let traced = packet.and_then(|packet| {
            let mut limit = [DONE; LANES];
            limit[..rays.len()].copy_from_slice(&reach[..rays.len()]);
            self.arch.dispatch(Blocked { world: self, rays: &packet, reach: limit, opaque })
        });
        traced.unwrap_or([Way::Unsure; LANES])
    }
}

/// The nearest hits so far; absent ones have the object `u32::MAX`.
#[derive(Clone, Copy)]
struct Found {
    t: Lanes,
    u: Lanes,
    v: Lanes,
    object: [u32; LANES],
    triangle: [u32; LANES],
    side: [u32; LANES],
}

impl Found {
    const NONE: u32 = u32::MAX;

    fn new(rays: usize) -> Self {
        let mut t = [DONE; LANES];
        t[..rays].fill(f32::INFINITY);
        let none = [Self::NONE; LANES];
        Self { t, u: [0.0; LANES], v: [0.0; LANES], object: none, triangle: none, side: [0; LANES] }
    }

    #[inline(always)]
    fn hit(&self, lane: usize) -> Option<Hit> {
        (self.object[lane] != Self::NONE).then(|| Hit {
            t: self.t[lane],
            object: ObjectId(self.object[lane]),
            triangle: self.triangle[lane],
            barycentric: [self.u[lane], self.v[lane]],
            front: self.side[lane] == LaneHits::FRONT,
        })
    }

    /// Takes hits with one triangle that are nearer, or as near and lower in rank. `near` is where the object's box is
    /// entered.
    #[inline(always)]
    fn take(&mut self, hits: &LaneHits, near: &Lanes, id: u32, triangle: u32, single_sided: bool) {
        let wanted = if single_sided { LaneHits::FRONT } else { LaneHits::FRONT | LaneHits::BACK };
        let Self { t: best, u, v, object, triangle: known, side } = self;
        for i in 0..LANES {
            let t = if hits.t[i] > near[i] { hits.t[i] } else { near[i] };
            let lower = (id < object[i]) | ((id == object[i]) & (triangle < known[i]));
            let better = (hits.side[i] & wanted != 0) & ((t < best[i]) | ((t == best[i]) & lower));
            best[i] = if better { t } else { best[i] };
            u[i] = if better { hits.u[i] } else { u[i] };
            v[i] = if better { hits.v[i] } else { v[i] };
            object[i] = if better { id } else { object[i] };
            known[i] = if better { triangle } else { known[i] };
            side[i] = if better { hits.side[i] } else { side[i] };
        }
    }
}

/// Shows each object that rays of a packet may meet to `each`: its id, the rays in its space, where its box is entered, and
/// how far rays reach in it. `each` gets and changes what is found, whose reach `reach` tells. `None` if the rays are no packet.
#[inline(always)]
fn each_object<F>(
    world: &World,
    rays: &LaneRays,
    kind: RayKinds,
    found: &mut F,
    reach: impl Fn(&F) -> &Lanes,
    mut each: impl FnMut(&mut F, u32, &PlacedObject, &LaneRays, &Lanes, Lanes),
) -> Option<()> {
    rays.shear()?;
    let mut farthest = largest(reach(found));
    world.tree.walk(&rays.bundle(), &mut farthest, |leaf, farthest| {
        let (near, _, any) = rays.enter(&leaf, reach(found));
        if any {
            for id in &world.tree.order[leaf.range()] {
                let object = &world.objects[*id as usize];
                if object.visible_to.contains(kind) {
                    let (_, limit, _) = rays.enter(&leaf, reach(found));
                    let placed = rays.placed(&object.object_from_world, object.translation);
                    each(found, *id, object, &placed, &near, limit);
                }
            }
            *farthest = largest(reach(found));
        }
        *farthest >= 0.0
    });
    Some(())
}

struct Closest<'a> {
    world: &'a World,
    rays: &'a LaneRays,
    kind: RayKinds,
    found: Found,
}

/// Looks for the nearest hits in one object.
struct InObject<'a> {
    found: &'a mut Found,
    id: u32,
    object: &'a PlacedObject,
    culls: bool,
    near: &'a Lanes,
    reach: Lanes,
}

impl Visit for InObject<'_> {
    #[inline(always)]
    fn reach(&self) -> &Lanes {
        &self.reach
    }

    #[inline(always)]
    fn hit(&mut self, triangle: u32, hits: &LaneHits) {
        let single_sided = self.culls && self.object.single_sided[self.object.slot(triangle)];
        self.found.take(hits, self.near, self.id, triangle, single_sided);
        for (reach, best) in self.reach.iter_mut().zip(&self.found.t) {
            *reach = if *best < *reach { *best } else { *reach };
        }
    }
}

impl pulp::WithSimd for Closest<'_> {
    type Output = Option<Found>;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Self::Output {
        let Self { world, rays, kind, mut found } = self;
        let culls = kind != RayKinds::SHADOW;
        each_object(
            world,
            rays,
            kind,
            &mut found,
            |found| &found.t,
            |found, id, object, placed, near, limit| {
                let mut search = InObject { found, id, object, culls, near, reach: limit };
                match placed.shear() {
                    Some(shear) => intersect(&object.tree, placed, &shear, &mut search),
                    None => packet::one_by_one(&object.tree, placed, &mut search),
                }
            },
        )?;
        Some(found)
    }
}

struct Blocked<'a, F> {
    world: &'a World,
    rays: &'a LaneRays,
    reach: Lanes,
    opaque: F,
}

/// What is known of the ways of a packet.
struct Ways {
    way: [Way; LANES],
    reach: Lanes,
}

/// Looks for anything in the way in one object.
struct InTheWay<'a, F> {
    ways: &'a mut Ways,
    object: &'a PlacedObject,
    reach: Lanes,
    opaque: &'a F,
}

impl<F: Fn(MaterialId) -> bool> Visit for InTheWay<'_, F> {
    #[inline(always)]
    fn reach(&self) -> &Lanes {
        &self.reach
    }

    #[inline(always)]
    fn hit(&mut self, triangle: u32, hits: &LaneHits) {
        let opaque = (self.opaque)(self.object.materials[self.object.slot(triangle)]);
        let found = if opaque { Way::Blocked } else { Way::Unsure };
        for i in 0..LANES {
            if hits.side[i] != LaneHits::NONE {
                self.ways.way[i] = found;
                self.ways.reach[i] = DONE;
                self.reach[i] = DONE;
            }
        }
    }
}

impl<F: Fn(MaterialId) -> bool> pulp::WithSimd for Blocked<'_, F> {
    type Output = Option<[Way; LANES]>;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Self::Output {
        let Self { world, rays, reach, opaque } = self;
        let mut ways = Ways { way: [Way::Clear; LANES], reach };
        let kind = RayKinds::SHADOW;
        each_object(
            world,
            rays,
            kind,
            &mut ways,
            |ways| &ways.reach,
            |ways, _, object, placed, _, limit| {
                let mut search = InTheWay { ways, object, reach: limit, opaque: &opaque };
                match placed.shear() {
                    Some(shear) => intersect(&object.tree, placed, &shear, &mut search),
                    None => packet::one_by_one(&object.tree, placed, &mut search),
                }
            },
        )?;
        Some(ways.way)
    }
}
