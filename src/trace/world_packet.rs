//! Packets of rays through the world. What they find is what [`World::closest`] and [`World::blocked`] find of each ray, bit for
//! bit.

use super::eight::{Eights, Task, dispatch};
use super::packet::{self, DONE, LANES, LaneHits, LaneRays, Lanes, RayPacket, RayStart, Visit, intersect, largest};
use super::tree::{Leaf, Visitor};
use super::triangle::Ray;

use super::world::{Facet, Hit, PlacedObject, World};
use crate::math::Vec3;
use crate::scene::camera::CameraRays;
use crate::scene::ids::{MaterialId, ObjectId};
use crate::scene::settings::RayKinds;

/// Fewer rays are traced one by one.
const FEWEST: usize = 4;
/// Shadow rays that leave another triangle than the ray before them, at most: where triangles are as small as rays are far apart,
/// each ray of a packet enters leaves of its own, for which all have to be asked, and that was measured five times as slow.
const MOST_CHANGES: usize = 6;

impl World {
    /// The closest hits of rays of one kind, as [`Self::closest`] finds them one by one. Quickest where the rays go much the
    /// same way.
    #[must_use]
    pub fn closest_of(&self, rays: &RayPacket, kind: RayKinds) -> PacketHits {
        let mut hits = [None; LANES];
        let mut found = Found::none();
        let task = Closest { world: self, rays, kind, found: &mut found };
        let met = if rays.count() < FEWEST { None } else { dispatch(self.arch, task) };
        // Most packets of the background meet nothing at all.
        if met == Some(false) {
            return hits;
        }
        for (lane, hit) in hits[..rays.count()].iter_mut().enumerate() {
            *hit = if met.is_some() && found.crowded[lane] == 0 {
                found.hit(lane)
            } else {
                let (origin, direction) = rays.ray_start(lane);
                self.closest(&Ray::new(origin, direction), kind, f32::INFINITY)
            };
        }
        hits
    }

    /// The rays of a camera through the first `count` of some film positions (pixels, and places in them), of which the others are
    /// to be the last of these, and their closest hits.
    #[must_use]
    pub(super) fn closest_of_camera(
        &self,
        camera: &CameraRays,
        film: &[([i32; 2], [f32; 2]); LANES],
        count: usize,
    ) -> (RayPacket, PacketHits) {
        let rays = self.camera_packet(camera, film, count);
        let hits = self.closest_of(&rays, RayKinds::CAMERA);
        (rays, hits)
    }

    /// The same rays alone.
    #[must_use]
    pub(super) fn camera_packet(
        &self,
        camera: &CameraRays,
        film: &[([i32; 2], [f32; 2]); LANES],
        count: usize,
    ) -> RayPacket {
        self.arch.dispatch(FromCamera { camera, film, count })
    }

    /// What is in the way of at most [`LANES`] shadow rays, as [`Self::blocked`] finds it one by one. Those that have little in
    /// common are not looked at.
    #[must_use]
    pub fn blocked_of(&self, rays: &[ShadowRay], opaque: &impl Fn(MaterialId) -> bool) -> [Way; LANES] {
        let mut ways = [Way::Clear; LANES];
        let changes = rays.windows(2).filter(|pair| pair[0].leaves != pair[1].leaves).count();
        let is_packet = rays.len() >= FEWEST && changes <= MOST_CHANGES && {
            let packet = RayPacket::of(rays.iter().map(|ray| ray.start));
            dispatch(self.arch, Blocked { world: self, rays: &packet, shadow: rays, opaque, ways: &mut ways })
        };
        if is_packet { ways } else { [Way::Unknown; LANES] }
    }
}

/// The hits of a packet's rays.
pub type PacketHits = [Option<Hit>; LANES];

/// Makes the rays of a camera.
struct FromCamera<'a> {
    camera: &'a CameraRays,
    film: &'a [([i32; 2], [f32; 2]); LANES],
    count: usize,
}

impl pulp::WithSimd for FromCamera<'_> {
    type Output = RayPacket;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> RayPacket {
        RayPacket::of_camera(self.camera, self.film, self.count)
    }
}

/// The nearest hits so far; absent ones have the object `u32::MAX`.
#[derive(Clone, Copy)]
struct Found {
    t: Lanes,
    /// The distance up to which others may be at the same place.
    reach: Lanes,
    u: Lanes,
    v: Lanes,
    object: [u32; LANES],
    triangle: [u32; LANES],
    side: [u32; LANES],
    /// Whether others may be at the same place.
    crowded: [u32; LANES],
}

impl Found {
    const NONE: u32 = u32::MAX;

    /// No hits, of rays without reach.
    #[inline(always)]
    fn none() -> Self {
        let t = [DONE; LANES];
        let none = [Self::NONE; LANES];
        let (u, v, side, crowded) = ([0.0; LANES], [0.0; LANES], [0; LANES], [0; LANES]);
        Self { t, reach: t, u, v, object: none, triangle: none, side, crowded }
    }

    #[inline(always)]
    fn hit(&self, lane: usize) -> Option<Hit> {
        (self.object[lane] != Self::NONE).then(|| Hit {
            t: self.t[lane],
            object: ObjectId(self.object[lane]),
            triangle: self.triangle[lane],
            barycentric: [self.u[lane], self.v[lane]],
            front: self.side[lane] == LaneHits::FRONT,
            crowded: false,
        })
    }

    /// Takes hits with one triangle that are nearer, or as near and lower in rank. `near` is where the object's box is
    /// entered.
    #[inline(always)]
    fn take(&mut self, hits: &LaneHits, near: &Lanes, id: u32, triangle: u32, single_sided: bool) {
        let wanted = if single_sided { LaneHits::FRONT } else { LaneHits::FRONT | LaneHits::BACK };
        let Self { t: best, reach, u, v, object, triangle: known, side, crowded } = self;
        for i in 0..LANES {
            let t = if hits.t[i] > near[i] { hits.t[i] } else { near[i] };
            let lower = (id < object[i]) | ((id == object[i]) & (triangle < known[i]));
            let met = hits.side[i] & wanted != 0;
            let better = met & ((t < best[i]) | ((t == best[i]) & lower));
            let here = t + hits.slack[i];
            let beside = if better { best[i] <= here } else { met & (t <= reach[i]) };
            crowded[i] = u32::from(beside | (!better & (crowded[i] != 0)));
            reach[i] = if better { here } else { reach[i] };
            best[i] = if better { t } else { best[i] };
            u[i] = if better { hits.u[i] } else { u[i] };
            v[i] = if better { hits.v[i] } else { v[i] };
            object[i] = if better { id } else { object[i] };
            known[i] = if better { triangle } else { known[i] };
            side[i] = if better { hits.side[i] } else { side[i] };
        }
    }
}

/// Looks for something in the objects that rays of a packet may meet.
trait Search {
    /// How far each ray reaches now.
    fn reach(&self) -> &Lanes;

    /// Looks at an object of a number: with the rays in its space, where they enter its box, and how far they reach in it.
    fn object<E: Eights>(
        &mut self,
        eights: E,
        id: u32,
        object: &PlacedObject,
        placed: &LaneRays,
        near: &Lanes,
        limit: Lanes,
    );
}

/// Shows each object that rays of a packet may meet to `search`. Returns whether the rays are a packet.
#[inline(always)]
fn each_object<E: Eights>(eights: E, world: &World, rays: &LaneRays, kind: RayKinds, search: &mut impl Search) -> bool {
    if rays.heading().is_none() {
        return false;
    }
    let mut farthest = largest(search.reach());
    world.tree.walk(eights, &rays.bundle(), &mut farthest, Objects { world, rays, kind, search });
    true
}

/// [`Visit::size`] of rays of the world that are placed in an object.
#[inline(always)]
fn size_of_starts(rays: &LaneRays, object: &PlacedObject, placed: &LaneRays) -> f32 {
    placed.largest_start().max(object.grain(Vec3::splat(rays.largest_start())).max_element())
}

/// Looks for what is in an object with rays in its space, together if they are a packet there.
#[inline(always)]
fn search_object<E: Eights>(eights: E, object: &PlacedObject, placed: &LaneRays, search: &mut impl Visit) {
    match placed.shear() {
        Some(shear) => intersect(eights, &object.tree, placed, &shear, search),
        None => packet::one_by_one(&object.tree, placed, search),
    }
}

/// Looks at the objects of leaves.
struct Objects<'a, S> {
    world: &'a World,
    rays: &'a LaneRays,
    kind: RayKinds,
    search: &'a mut S,
}

impl<S: Search> Visitor for Objects<'_, S> {
    #[inline(always)]
    fn leaf<E: Eights>(&mut self, eights: E, leaf: Leaf<'_>, farthest: &mut f32) -> bool {
        let Self { world, rays, kind, search } = self;
        let (near, _, any) = rays.enter(&leaf, search.reach());
        if any {
            for id in &world.tree.order[leaf.range()] {
                let object = &world.objects[*id as usize];
                if object.visible_to.contains(*kind) {
                    let (_, limit, _) = rays.enter(&leaf, search.reach());
                    let placed = rays.placed(object);
                    search.object(eights, *id, object, &placed, &near, limit);
                }
            }
            *farthest = largest(search.reach());
        }
        *farthest >= 0.0
    }
}

/// Looks for the nearest hits of a packet, which are none yet. Returns whether any ray meets anything; `None` if the rays are no
/// packet.
struct Closest<'a> {
    world: &'a World,
    rays: &'a RayPacket,
    kind: RayKinds,
    found: &'a mut Found,
}

/// Looks for the nearest hits.
struct Nearest<'a> {
    rays: &'a LaneRays,
    culls: bool,
    found: &'a mut Found,
}

impl Search for Nearest<'_> {
    #[inline(always)]
    fn reach(&self) -> &Lanes {
        &self.found.reach
    }

    #[inline(always)]
    fn object<E: Eights>(
        &mut self,
        eights: E,
        id: u32,
        object: &PlacedObject,
        placed: &LaneRays,
        near: &Lanes,
        reach: Lanes,
    ) {
        let size = size_of_starts(self.rays, object, placed);
        let (rays, culls, found) = (self.rays, self.culls, &mut *self.found);
        let mut search = InObject { found, id, object, rays, size, culls, near, reach };
        search_object(eights, object, placed, &mut search);
    }
}

/// Looks for the nearest hits in one object.
struct InObject<'a> {
    found: &'a mut Found,
    id: u32,
    object: &'a PlacedObject,
    rays: &'a LaneRays,
    size: f32,
    culls: bool,
    near: &'a Lanes,
    reach: Lanes,
}

impl Visit for InObject<'_> {
    #[inline(always)]
    fn reach(&self) -> &Lanes {
        &self.reach
    }

    #[inline]
    fn grain(&self, lane: usize) -> Vec3 {
        self.object.grain(self.rays.start(lane))
    }

    #[inline(always)]
    fn size(&self) -> f32 {
        self.size
    }

    #[inline(always)]
    fn leaves(&self, _: usize, _: u32) -> bool {
        false
    }

    #[inline(always)]
    fn hit(&mut self, triangle: u32, hits: &LaneHits) {
        let single_sided = self.culls && self.object.single_sided[self.object.slot(triangle)];
        self.found.take(hits, self.near, self.id, triangle, single_sided);
        for (reach, best) in self.reach.iter_mut().zip(&self.found.reach) {
            *reach = if *best < *reach { *best } else { *reach };
        }
    }
}

impl Task for Closest<'_> {
    type Output = Option<bool>;

    #[inline(always)]
    fn run<E: Eights>(self, eights: E) -> Option<bool> {
        let Self { world, rays, kind, found } = self;
        for (lane, (t, reach)) in found.t.iter_mut().zip(&mut found.reach).enumerate() {
            *t = if lane < rays.count() { f32::INFINITY } else { DONE };
            *reach = *t;
        }
        let culls = kind != RayKinds::SHADOW;
        let rays = LaneRays::new(rays.origin, rays.direction);
        let mut search = Nearest { rays: &rays, culls, found };
        let is_packet = each_object(eights, world, &rays, kind, &mut search);
        is_packet.then(|| {
            // Those that are met have lower numbers.
            let mut least = Found::NONE;
            for object in search.found.object {
                least = least.min(object);
            }
            least != Found::NONE
        })
    }
}

/// A ray towards a light.
#[derive(Clone, Copy, Debug)]
pub struct ShadowRay {
    /// Origin and direction.
    pub start: RayStart,
    /// How far the light is, in lengths of the direction.
    pub reach: f32,
    /// The triangle that it leaves, which it does not meet.
    pub leaves: Facet,
}

/// What a packet knows of a shadow ray's way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// Nothing is in it.
    Clear,
    /// Something opaque is.
    Blocked,
    /// Nothing opaque is, but other things may be; or nobody looked.
    Unknown,
}

/// Looks for anything in the ways of a packet, which are clear so far. Returns whether the rays are a packet.
struct Blocked<'a, O> {
    world: &'a World,
    rays: &'a RayPacket,
    shadow: &'a [ShadowRay],
    opaque: &'a O,
    ways: &'a mut [Way; LANES],
}

/// Looks for anything in the way.
struct Ways<'a, O> {
    rays: &'a LaneRays,
    shadow: &'a [ShadowRay],
    opaque: &'a O,
    /// How far rays reach that nothing has blocked yet.
    reach: Lanes,
    ways: &'a mut [Way; LANES],
}

impl<O: Fn(MaterialId) -> bool> Search for Ways<'_, O> {
    #[inline(always)]
    fn reach(&self) -> &Lanes {
        &self.reach
    }

    #[inline(always)]
    fn object<E: Eights>(
        &mut self,
        eights: E,
        id: u32,
        object: &PlacedObject,
        placed: &LaneRays,
        _: &Lanes,
        reach: Lanes,
    ) {
        let size = size_of_starts(self.rays, object, placed);
        let mut search = AnyInObject { id, object, size, reach, found: self };
        search_object(eights, object, placed, &mut search);
    }
}

/// Looks for anything in one object.
struct AnyInObject<'a, 'w, O> {
    found: &'a mut Ways<'w, O>,
    id: u32,
    object: &'a PlacedObject,
    size: f32,
    reach: Lanes,
}

impl<O: Fn(MaterialId) -> bool> Visit for AnyInObject<'_, '_, O> {
    #[inline(always)]
    fn reach(&self) -> &Lanes {
        &self.reach
    }

    #[inline]
    fn grain(&self, lane: usize) -> Vec3 {
        self.object.grain(self.found.rays.start(lane))
    }

    #[inline(always)]
    fn size(&self) -> f32 {
        self.size
    }

    #[inline(always)]
    fn leaves(&self, lane: usize, triangle: u32) -> bool {
        self.found.shadow.get(lane).is_some_and(|ray| ray.leaves == (ObjectId(self.id), triangle))
    }

    #[inline(always)]
    fn hit(&mut self, triangle: u32, hits: &LaneHits) {
        let opaque = (self.found.opaque)(self.object.materials[self.object.slot(triangle)]);
        for lane in 0..LANES {
            if hits.side[lane] == LaneHits::NONE || self.leaves(lane, triangle) {
                continue;
            }
            self.found.ways[lane] = if opaque { Way::Blocked } else { Way::Unknown };
            if opaque {
                self.found.reach[lane] = DONE;
                self.reach[lane] = DONE;
            }
        }
    }
}

impl<O: Fn(MaterialId) -> bool> Task for Blocked<'_, O> {
    type Output = bool;

    #[inline(always)]
    fn run<E: Eights>(self, eights: E) -> bool {
        let Self { world, rays, shadow, opaque, ways } = self;
        let mut reach = [DONE; LANES];
        for (reach, ray) in reach.iter_mut().zip(shadow) {
            *reach = ray.reach;
        }
        let rays = LaneRays::new(rays.origin, rays.direction);
        let mut search = Ways { rays: &rays, shadow, opaque, reach, ways };
        each_object(eights, world, &rays, RayKinds::SHADOW, &mut search)
    }
}
