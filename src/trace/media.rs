//! Media: which bodies of glass or liquid a ray is in.
//!
//! A *body* is an object whose mesh is closed and through whose surface light may pass. A ray carries the bodies that it has
//! entered and not left, as Schmidt and Budge have it ("Simple Nested Dielectrics in Ray Traced Images", 2002): where bodies
//! overlap, the one with the largest `dielectric_priority` fills the space, and surfaces of the others are not there. Of equal
//! ones it is the one entered last, so that a body inside another, or a glass that a liquid stands in, needs no priority.
//!
//! What the surfaces at one place of a ray (see `hits`) change, they change together: where a ray leaves one body and enters
//! the next, it goes straight from the one medium to the other, without the thinnest film of air; where both have one index of
//! refraction, there is no surface. Surfaces that a ray passes as if they were not there give no node and draw no line; the ray goes on
//! from where it started, so that nothing is lost between them.
//!
//! Meshes with an open edge are sheets: they bend rays as a boundary to air does and nobody is inside of them. Lists of surfaces
//! behind the first one (`list`) know nothing of media.

use smallvec::SmallVec;

use super::hits::Place;
use super::ray_tree::{Run, WaveHit, WaveRay};
use super::surface::Surface;
use super::triangle::Ray;
use super::wave::{TileTracer, TraceContext, Work};
use super::world::{Hit, world_box};
use crate::math::Vec3;
use crate::scene::ids::{MaterialId, ObjectId};
use crate::scene::settings::RayKinds;

/// Most bodies that a ray remembers to be in; beyond, those of the least priority are forgotten.
const MOST_BODIES: usize = 8;

/// Directions in which is looked whether a place is inside a body: until one meets no edge.
const OUTWARD: [Vec3; 4] = [
    Vec3::new(0.364_837, 0.871_234, 0.328_519),
    Vec3::new(-0.718_923, 0.243_651, 0.651_017),
    Vec3::new(0.211_379, -0.553_817, -0.805_343),
    Vec3::new(-0.481_931, -0.317_719, 0.816_541),
];

/// What a ray may be inside of: the parts of an object that have one material.
type Key = (ObjectId, MaterialId);

/// A body that a ray is in.
#[derive(Clone, Copy, Debug)]
pub(super) struct Body {
    pub key: Key,
    pub priority: i32,
    /// Index of refraction where the ray entered.
    pub ior: f32,
}

/// The bodies that a ray is in.
#[derive(Clone, Copy, Debug)]
pub(super) struct Media {
    /// In the order in which they were entered.
    bodies: [Body; MOST_BODIES],
    count: usize,
    /// The one whose medium the ray travels in; `None`: air.
    within: Option<Key>,
    /// The index of refraction there.
    pub index: f32,
}

impl Media {
    /// Outside of all bodies.
    pub const AIR: Self = Self {
        bodies: [Body { key: (ObjectId(0), MaterialId(0)), priority: 0, ior: 1.0 }; MOST_BODIES],
        count: 0,
        within: None,
        index: 1.0,
    };

    fn bodies(&self) -> &[Body] {
        &self.bodies[..self.count]
    }

    /// The body that fills the space: of the largest priority, and of equal ones the one entered last.
    fn top(&self) -> Option<&Body> {
        self.bodies().iter().max_by_key(|body| body.priority)
    }

    fn holds(&self, object: ObjectId) -> bool {
        self.bodies().iter().any(|body| body.key.0 == object)
    }

    pub fn enter(&mut self, body: Body) {
        if self.count == MOST_BODIES {
            let least = (0..self.count).min_by_key(|&place| self.bodies[place].priority).unwrap_or(0);
            self.remove(least);
        }
        self.bodies[self.count] = body;
        self.count += 1;
    }

    /// Leaves a body; whether the ray was in it.
    fn leave(&mut self, key: Key) -> bool {
        let bodies = self.bodies();
        let place = bodies.iter().rposition(|body| body.key == key);
        // A body may have several materials.
        let place = place.or_else(|| bodies.iter().rposition(|body| body.key.0 == key.0));
        place.map(|place| self.remove(place)).is_some()
    }

    fn remove(&mut self, place: usize) {
        self.bodies.copy_within(place + 1..self.count, place);
        self.count -= 1;
    }

    /// The same, for a ray that travels in the body that fills the space.
    pub fn settled(self) -> Self {
        let (within, index) = self.top().map_or((None, 1.0), |top| (Some(top.key), top.ior));
        Self { within, index, ..self }
    }
}

/// What becomes of a ray at surfaces of bodies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pass {
    /// It goes from one medium to the next.
    Bends,
    /// The same, as one body ends where the other begins: there is a surface only if their indices differ.
    Touches,
    /// It enters a body that another one outranks: there is no surface.
    Silent,
    /// It enters one of several bodies at one place: the others, and those that end there, are looked at next.
    Counted,
    /// Body and air change within rounding: it is not bent.
    Thin,
    /// What is seen is no boundary of a body, but lies at one.
    Stops,
}

/// How a ray passes surfaces of bodies.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossing {
    pub pass: Pass,
    /// The media behind them, but for the body of the hit itself.
    pub behind: Media,
    /// Whether the ray enters the body of the hit.
    pub enters: bool,
    /// The last hit at the place.
    pub last: Hit,
}

/// What is seen of the surfaces at a place.
pub(super) struct Seen {
    pub hit: Hit,
    /// How far off its position those of others at the place may be, in each axis.
    pub error: Vec3,
    pub crossing: Option<Crossing>,
}

impl TileTracer<'_> {
    fn is_body(&self, hit: &Hit) -> bool {
        self.plan.bodies.get(hit.object.index()).is_some_and(|body| *body)
            && self.plan.materials[self.world.material(hit).index()].refracts
    }

    /// What a ray sees at the place of the first hit that it found there; `None` if it passes that place and goes on, as
    /// `from` then says.
    pub(super) fn cross(
        &self,
        ray: &Ray,
        kind: RayKinds,
        from: &mut WaveRay,
        found: &Hit,
        media: &mut Vec<Media>,
    ) -> Option<Seen> {
        let inside = media[from.media as usize];
        let plain = Seen { hit: *found, error: Vec3::ZERO, crossing: None };
        if !found.crowded && !self.is_body(found) {
            return Some(plain);
        }
        let at = self.at_place(ray, kind, found);

        // What ends, what begins, and what else is there.
        let mut behind = inside;
        let (mut entries, mut seen): (Place, SmallVec<[(Key, bool); 8]>) = Default::default();
        let (mut exit, mut thin, mut unknown, mut other) = (None, None, None, None);
        for hit in &at {
            let key = (hit.object, self.world.material(hit));
            if !self.is_body(hit) {
                other.get_or_insert((*hit, entries.is_empty()));
                continue;
            }
            if seen.contains(&(key, hit.front)) {
                continue;
            }
            seen.push((key, hit.front));
            if at.iter().any(|twin| twin.object == hit.object && twin.front != hit.front && self.is_body(twin)) {
                if !inside.holds(hit.object) {
                    thin.get_or_insert(*hit);
                }
            } else if hit.front {
                entries.push(*hit);
            } else if !behind.leave(key) {
                unknown.get_or_insert(*hit);
            } else if inside.within.is_some_and(|within| within.0 == key.0) {
                exit.get_or_insert(*hit);
            }
        }
        // A body that the ray entered twice goes on.
        let exit = exit.filter(|_| behind.top().map(|top| top.key) != inside.within);
        let last = at.last().copied().unwrap_or(*found);
        let see = |hit: Hit, pass, behind, enters| {
            let crossing = Some(Crossing { pass, behind, enters, last });
            Some(Seen { hit, error: self.spread(ray, &hit, &at), crossing })
        };

        if let Some((other, true)) = other {
            return see(other, Pass::Stops, behind, false);
        }
        let priority = |hit: &Hit| self.scene.materials()[self.world.material(hit).index()].dielectric_priority;
        entries.sort_by_key(priority);
        match entries.get(from.counted as usize..).unwrap_or(&[]) {
            [] => match (exit, thin, unknown) {
                (Some(exit), ..) => see(exit, Pass::Bends, behind, false),
                (None, Some(sheet), _) => see(sheet, Pass::Thin, behind, false),
                // As if it had been entered somewhere.
                (None, None, Some(hit)) => Some(Seen { error: self.spread(ray, &hit, &at), hit, ..plain }),
                (None, None, None) => {
                    *from = from.going_on(&last, media.len());
                    media.push(behind);
                    None
                }
            },
            [entry] => {
                let outranks = behind.top().is_none_or(|top| priority(entry) >= top.priority);
                match (outranks && !inside.holds(entry.object), exit.is_some()) {
                    (true, false) => see(*entry, Pass::Bends, behind, true),
                    (true, true) => see(*entry, Pass::Touches, behind, true),
                    (false, false) => see(*entry, Pass::Silent, behind, true),
                    (false, true) => see(*entry, Pass::Counted, inside, true),
                }
            }
            [entry, ..] => see(*entry, Pass::Counted, inside, true),
        }
    }

    /// A hit and those behind it at its place.
    fn at_place(&self, ray: &Ray, kind: RayKinds, found: &Hit) -> Place {
        let mut at = Place::new();
        if found.crowded {
            let all = self.world.place(ray, kind, found);
            at.extend(all.into_iter().skip_while(|hit| hit.facet() != found.facet()));
        }
        if at.is_empty() {
            at.push(*found);
        }
        at
    }

    /// How far off the position of a hit those of others at its place may be.
    fn spread(&self, ray: &Ray, hit: &Hit, at: &[Hit]) -> Vec3 {
        if at.len() < 2 {
            return Vec3::ZERO;
        }
        let position = Surface::new(self.world, ray.direction, hit).position;
        at.iter().fold(Vec3::ZERO, |spread, other| {
            let other = Surface::new(self.world, ray.direction, other);
            spread.max((other.position - position).abs() + other.error)
        })
    }

    /// Finds the bodies in which camera rays start.
    pub(super) fn start_in_media(&self, run: &mut Run, context: &mut TraceContext<'_>, work: &mut Work<'_>) {
        let starts = run
            .next
            .iter()
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), ray| (low.min(ray.origin), high.max(ray.origin)));
        let may_hold_one = |id: &ObjectId| {
            let bounds = world_box(self.world.object(*id));
            bounds.is_some_and(|b| Vec3::from(b.min).cmple(starts.1).all() && Vec3::from(b.max).cmpge(starts.0).all())
        };
        let bodies = self.plan.bodies.iter().zip(0..).filter(|(body, _)| **body).map(|(_, id)| ObjectId(id));
        let bodies: SmallVec<[ObjectId; 8]> = bodies.filter(may_hold_one).collect();
        if bodies.is_empty() {
            return;
        }
        let mut known: Option<(Vec3, u32)> = None;
        for index in 0..run.next.len() {
            let WaveRay { origin, node, .. } = run.next[index];
            let media = match known {
                Some((start, media)) if start == origin => media,
                _ => self.media_at(origin, node, &bodies, run, context, work),
            };
            known = Some((origin, media));
            run.next[index].media = media;
        }
    }

    /// The bodies around a place: of equal priority, the one that ends first was entered last.
    fn media_at(
        &self,
        origin: Vec3,
        node: u32,
        bodies: &[ObjectId],
        run: &mut Run,
        context: &mut TraceContext<'_>,
        work: &mut Work<'_>,
    ) -> u32 {
        let mut ends: SmallVec<[(Hit, Ray); 4]> = bodies.iter().filter_map(|id| self.end_of(*id, origin)).collect();
        if ends.is_empty() {
            return 0;
        }
        ends.sort_by(|(a, _), (b, _)| b.t.total_cmp(&a.t).then(a.object.cmp(&b.object)));
        let mut media = Media::AIR;
        for (hit, ray) in &ends {
            let from = WaveRay { origin, direction: ray.direction, node, after: None, passed: 0, media: 0, counted: 0 };
            let end = self.wave_hit(&from, hit, &run.nodes[node as usize], 0);
            if let Some(body) = self.body_at(&end, run, context, work) {
                media.enter(body);
            }
        }
        run.media.push(media.settled());
        run.media.len() as u32 - 1
    }

    /// Where a body ends in some direction from a place, if that is inside of it.
    fn end_of(&self, id: ObjectId, origin: Vec3) -> Option<(Hit, Ray)> {
        let object = self.world.object(id);
        let (low, high) = object.tree.bounds()?;
        for direction in OUTWARD {
            let ray = Ray::new(origin, direction.normalize());
            let local = object.to_object(&ray);
            if local.origin.cmplt(low).any() || local.origin.cmpgt(high).any() {
                return None;
            }
            let (mut sheets, mut clean, mut end): (i32, bool, Option<Hit>) = (0, true, None);
            let mut reach = f32::INFINITY;
            object.tree.intersect(&local, &mut reach, |triangle, met, _| {
                clean &= met.u.min(met.v).min(1.0 - met.u - met.v) > 1e-4;
                sheets += if met.front { -1 } else { 1 };
                let (barycentric, front) = ([met.u, met.v], met.front);
                let hit = Hit { t: met.t, object: id, triangle, barycentric, front, crowded: false };
                let nearer = end.is_none_or(|end| (met.t, triangle) < (end.t, end.triangle));
                if !front && nearer && self.is_body(&hit) {
                    end = Some(hit);
                }
                true
            });
            if clean {
                return end.filter(|_| sheets > 0).map(|hit| (hit, ray));
            }
        }
        None
    }

    /// The body whose surface was met, as its shader says; `None` if no light passes there.
    fn body_at(
        &self,
        hit: &WaveHit,
        run: &mut Run,
        context: &mut TraceContext<'_>,
        work: &mut Work<'_>,
    ) -> Option<Body> {
        let material = hit.material;
        self.shade(std::slice::from_ref(hit), run, false, context, work);
        let outputs = self.outputs_of(material, 0, context);
        let opacity = self.opacity(outputs);
        (opacity > 0.0).then(|| self.body(hit, &self.bsdf(hit, outputs, 1.0))).flatten()
    }

    /// The body that is entered where its surface was met; `None` if no light passes there.
    pub(super) fn body(&self, hit: &WaveHit, bsdf: &crate::shade::Bsdf) -> Option<Body> {
        let passes = bsdf.transmission > 0.0 && bsdf.metallic < 1.0;
        let priority = self.scene.materials()[hit.material.index()].dielectric_priority;
        passes.then_some(Body { key: (hit.hit.object, hit.material), priority, ior: bsdf.ior })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn body(object: u32, priority: i32, ior: f32) -> Body {
        Body { key: (ObjectId(object), MaterialId(0)), priority, ior }
    }

    fn index(media: &Media) -> f32 {
        media.settled().index
    }

    #[test]
    fn the_body_entered_last_fills_the_space_unless_another_outranks_it() {
        let mut media = Media::AIR;
        assert_eq!(index(&media), 1.0);
        media.enter(body(1, 0, 1.5));
        media.enter(body(2, 0, 1.33));
        assert_eq!(index(&media), 1.33);
        media.enter(body(3, 1, 1.8));
        media.enter(body(4, 0, 1.1));
        assert_eq!(index(&media), 1.8);
        // In whichever order they are left.
        assert!(media.leave((ObjectId(2), MaterialId(0))) && !media.leave((ObjectId(2), MaterialId(0))));
        assert!(media.leave((ObjectId(3), MaterialId(0))));
        assert_eq!(index(&media), 1.1);
        // Where it has another material.
        assert!(media.leave((ObjectId(4), MaterialId(7))));
        assert_eq!(index(&media), 1.5);
    }

    #[test]
    fn a_body_entered_twice_is_left_twice() {
        let mut media = Media::AIR;
        let key = body(1, 0, 1.5).key;
        media.enter(body(1, 0, 1.5));
        media.enter(body(1, 0, 1.5));
        assert!(media.leave(key) && media.holds(key.0) && media.leave(key) && !media.holds(key.0));
    }

    #[test]
    fn of_too_many_bodies_those_of_the_least_priority_are_forgotten() {
        let mut media = Media::AIR;
        media.enter(body(0, -1, 2.0));
        for object in 1..=MOST_BODIES as u32 {
            media.enter(body(object, object as i32, 1.0 + object as f32));
        }
        assert!(!media.holds(ObjectId(0)) && media.holds(ObjectId(1)));
        assert_eq!(index(&media), 1.0 + MOST_BODIES as f32);
    }
}
