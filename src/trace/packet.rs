//! Packets: rays that go much the same way, sixteen at a time.
//!
//! A packet goes down a hierarchy as one: its `Bundle` bounds the slab distances of all its rays, and eight boxes are tested
//! with it at once. Only at the leaves is each ray asked whether it enters, and then meets each triangle, with the
//! operations of the single ray in their order, in loops over lanes that the compiler vectorises for the instructions that
//! [`pulp::Arch`] finds at run time. See the head of `tree` for why it finds the same bits.
//!
//! Rays whose largest components differ in axis or sign would need triangles sheared in different ways; they are no packet
//! (`LaneRays::shear`) and are traced one at a time.

use super::eight::{self, Eights};
use super::mesh_tree::{MeshTree, WIDTH};
use super::tree::{BOX_FAR_SCALE, BOX_NEAR_SCALE, Leaf, Slabs, Visitor, max, min};
use super::triangle::{MOST_SLACK, NOT_AHEAD, Ray, normal_and_size};
use super::world::PlacedObject;
use crate::math::{Mat3, Vec3};
use crate::scene::camera::CameraRays;

/// Rays of a packet.
pub const LANES: usize = 16;

/// Origin and direction of a ray.
pub type RayStart = (Vec3, Vec3);

/// One number of each ray.
pub(super) type Lanes = [f32; LANES];

/// The reach of a lane that takes part no more.
pub(super) const DONE: f32 = -1.0;

/// Combines all lanes, half with half: one after the other they would wait for each other.
#[inline(always)]
fn combined(mut lanes: Lanes, combine: impl Fn(f32, f32) -> f32 + Copy) -> f32 {
    let mut half = LANES / 2;
    while half > 0 {
        for i in 0..half {
            lanes[i] = combine(lanes[i], lanes[i + half]);
        }
        half /= 2;
    }
    lanes[0]
}

/// The largest of all lanes.
#[inline(always)]
pub(super) fn largest(lanes: &Lanes) -> f32 {
    combined(*lanes, max)
}

/// Vectors by axis, times a matrix.
#[inline(always)]
pub(super) fn product(matrix: &Mat3, [x, y, z]: &[Lanes; 3]) -> [Lanes; 3] {
    let [mx, my, mz] = matrix.to_cols_array_2d();
    [0, 1, 2].map(|axis: usize| {
        let (mx, my, mz) = (mx[axis], my[axis], mz[axis]);
        let mut lanes = [0.0; LANES];
        for i in 0..LANES {
            lanes[i] = mx * x[i] + my * y[i] + mz * z[i];
        }
        lanes
    })
}

/// At most [`LANES`] rays, number by number.
#[derive(Clone, Debug)]
pub struct RayPacket {
    pub(super) origin: [Lanes; 3],
    pub(super) direction: [Lanes; 3],
    /// How many they are. Behind them the last is repeated.
    count: usize,
}

impl RayPacket {
    /// The first [`LANES`] of some rays.
    #[must_use]
    pub fn of(rays: impl IntoIterator<Item = RayStart>) -> Self {
        let mut packet = Self { origin: [[0.0; LANES]; 3], direction: [[0.0; LANES]; 3], count: 0 };
        for (lane, (origin, direction)) in rays.into_iter().take(LANES).enumerate() {
            for axis in 0..3 {
                packet.origin[axis][lane] = origin[axis];
                packet.direction[axis][lane] = direction[axis];
            }
            packet.count += 1;
        }
        if let Some(last) = packet.count.checked_sub(1) {
            for lanes in packet.origin.iter_mut().chain(&mut packet.direction) {
                let value = lanes[last];
                lanes[last..].fill(value);
            }
        }
        packet
    }

    /// The rays of a camera through the first `count` of some film positions; the others are to be the last of these.
    #[inline(always)]
    pub(super) fn of_camera(camera: &CameraRays, film: &[([i32; 2], [f32; 2]); LANES], count: usize) -> Self {
        let (origin, direction) = camera.rays(film);
        Self { origin, direction, count: count.min(LANES) }
    }

    /// How many rays there are.
    #[inline]
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// Origins and directions. Asked for at once: numbers that are written one by one and read together right away make the
    /// processor wait.
    #[inline]
    #[must_use]
    pub fn ray_starts(&self) -> [RayStart; LANES] {
        std::array::from_fn(|lane| self.ray_start(lane))
    }

    /// Origin and direction of one of the rays.
    #[inline]
    #[must_use]
    pub fn ray_start(&self, lane: usize) -> RayStart {
        (Vec3::from_array(lane_of(&self.origin, lane)), Vec3::from_array(lane_of(&self.direction, lane)))
    }
}

#[inline(always)]
fn lane_of([x, y, z]: &[Lanes; 3], lane: usize) -> [f32; 3] {
    [x[lane], y[lane], z[lane]]
}

/// The rays of a packet in one space.
#[derive(Clone, Copy)]
pub(super) struct LaneRays {
    pub origin: [Lanes; 3],
    pub direction: [Lanes; 3],
    inverse: [Lanes; 3],
}

impl LaneRays {
    /// Rays by axis.
    #[inline(always)]
    pub fn new(origin: [Lanes; 3], direction: [Lanes; 3]) -> Self {
        let mut inverse = [[0.0; LANES]; 3];
        for (inverse, direction) in inverse.iter_mut().zip(&direction) {
            for i in 0..LANES {
                // As in `Ray::new`.
                let d = direction[i];
                inverse[i] = 1.0 / if d.abs() < 1e-30 { 1e-30_f32.copysign(d) } else { d };
            }
        }
        Self { origin, direction, inverse }
    }

    /// The rays in the space of an object, as [`PlacedObject::to_object`] places single rays there.
    #[inline(always)]
    pub fn placed(&self, object: &PlacedObject) -> Self {
        let mut origin = self.origin;
        for (lanes, translation) in origin.iter_mut().zip(object.translation.to_array()) {
            lanes.iter_mut().for_each(|lane| *lane -= translation);
        }
        if object.is_only_moved {
            return Self { origin, ..*self };
        }
        let matrix = &object.object_from_world;
        Self::new(product(matrix, &origin), product(matrix, &self.direction))
    }

    /// The largest component of any ray's origin.
    #[inline(always)]
    pub fn largest_start(&self) -> f32 {
        let [x, y, z] = &self.origin;
        let mut lanes = [0.0; LANES];
        for i in 0..LANES {
            lanes[i] = max(max(x[i].abs(), y[i].abs()), z[i].abs());
        }
        largest(&lanes)
    }

    /// Where one of the rays starts.
    #[inline]
    pub fn start(&self, lane: usize) -> Vec3 {
        Vec3::from_array(lane_of(&self.origin, lane))
    }

    /// One of the rays, with its grain.
    #[inline]
    pub fn ray(&self, lane: usize, grain: Vec3) -> Ray {
        Ray { grain, ..Ray::new(self.start(lane), Vec3::from_array(lane_of(&self.direction, lane))) }
    }

    /// The axis of the rays' largest components and whether these are negative; `None` if the rays are no packet.
    #[inline(always)]
    pub fn heading(&self) -> Option<(usize, bool)> {
        const NEGATIVE: u32 = 4;
        const UNSOUND: u32 = 8;
        let ([ox, oy, oz], [dx, dy, dz]) = (&self.origin, &self.direction);
        let mut headings = [0; LANES];
        for i in 0..LANES {
            // The axis and its order are those of `Ray::new`.
            let [x, y, z] = [dx[i].abs(), dy[i].abs(), dz[i].abs()];
            let is_x = (x > y) & (x > z);
            let (axis, along) = if is_x {
                (0, dx[i])
            } else if y > z {
                (1, dy[i])
            } else {
                (2, dz[i])
            };
            // 0 for finite numbers, else NaN.
            let zero = (ox[i] * 0.0 + oy[i] * 0.0 + oz[i] * 0.0) + (x * 0.0 + y * 0.0 + z * 0.0);
            headings[i] = axis | if along < 0.0 { NEGATIVE } else { 0 } | if zero == 0.0 { 0 } else { UNSOUND };
        }
        let first = headings[0];
        let mut differ = 0;
        for heading in headings {
            differ |= heading ^ first;
        }
        (differ == 0 && first & UNSOUND == 0).then_some(((first & 3) as usize, first & NEGATIVE != 0))
    }

    /// What the triangle test needs; `None` if the rays are no packet.
    #[inline(always)]
    pub fn shear(&self) -> Option<Shear> {
        let (z, is_negative) = self.heading()?;
        let (mut x, mut y) = ((z + 1) % 3, (z + 2) % 3);
        if is_negative {
            std::mem::swap(&mut x, &mut y);
        }
        let mut shear = Shear { axes: [x, y, z], x: [0.0; LANES], y: [0.0; LANES], z: [0.0; LANES] };
        let (along_x, along_y, along_z) = (&self.direction[x], &self.direction[y], &self.direction[z.min(2)]);
        for i in 0..LANES {
            shear.x[i] = along_x[i] / along_z[i];
            shear.y[i] = along_y[i] / along_z[i];
            shear.z[i] = 1.0 / along_z[i];
        }
        Some(shear)
    }

    /// Bounds on the distances of the slab test.
    #[inline(always)]
    pub fn bundle(&self) -> Bundle {
        let mut bundle = Bundle {
            near: [0, 1, 2],
            far: [3, 4, 5],
            origin: [[0.0; 2]; 3],
            inverse: [[0.0; 2]; 3],
            mixed: [false; 3],
        };
        for axis in 0..3 {
            let (low, high) = (combined(self.origin[axis], min), largest(&self.origin[axis]));
            let (least, most) = (combined(self.inverse[axis], min), largest(&self.inverse[axis]));
            bundle.mixed[axis] = least < 0.0 && most > 0.0;
            bundle.inverse[axis] = [least, most];
            bundle.origin[axis] = [high, low];
            if most < 0.0 {
                std::mem::swap(&mut bundle.near[axis], &mut bundle.far[axis]);
                bundle.origin[axis].swap(0, 1);
            }
        }
        bundle
    }

    /// Where each ray enters a leaf, and how far it reaches there: as in `reach`, or [`DONE`] where it does not enter. Whether
    /// any does.
    #[inline(always)]
    pub fn enter(&self, leaf: &Leaf<'_>, reach: &Lanes) -> (Lanes, Lanes, bool) {
        let [x0, y0, z0, x1, y1, z1] = leaf.planes();
        let ([ox, oy, oz], [ix, iy, iz]) = (&self.origin, &self.inverse);
        let (mut near, mut limit) = ([0.0; LANES], [0.0; LANES]);
        let mut any = 0;
        for i in 0..LANES {
            let (x0, x1) = ((x0 - ox[i]) * ix[i], (x1 - ox[i]) * ix[i]);
            let (y0, y1) = ((y0 - oy[i]) * iy[i], (y1 - oy[i]) * iy[i]);
            let (z0, z1) = ((z0 - oz[i]) * iz[i], (z1 - oz[i]) * iz[i]);
            let enter = max(max(min(x0, x1), min(y0, y1)), max(min(z0, z1), 0.0)) * BOX_NEAR_SCALE;
            let leave = min(min(max(x0, x1), max(y0, y1)), max(z0, z1)) * BOX_FAR_SCALE;
            let enters = (enter <= leave) & (enter <= reach[i]);
            near[i] = enter;
            limit[i] = if enters { reach[i] } else { DONE };
            any |= u32::from(enters);
        }
        (near, limit, any != 0)
    }
}

/// Bounds on what the slab test of any ray of a packet gives: all operations round monotonically, so the bounds hold to the
/// last bit.
pub(super) struct Bundle {
    near: [usize; 3],
    far: [usize; 3],
    /// By axis: the origin from which the near plane is least far ahead, and the one from which the far plane is
    /// farthest.
    origin: [[f32; 2]; 3],
    /// Least and largest.
    inverse: [[f32; 2]; 3],
    /// Axes along which the rays go both ways: they bound nothing. The largest components of the rays of a packet have one
    /// axis and one sign, so there is always an axis that does.
    mixed: [bool; 3],
}

impl Bundle {
    /// Relative to an inverse: many times what the slab test of a ray rounds.
    const SLACK: f32 = 1e-5;

    /// Of all rays of any length whose origins and directions lie within bounds, the least and the most by axis.
    pub fn within(origin: [Vec3; 2], direction: [Vec3; 2]) -> Self {
        let mut bundle =
            Self { near: [0, 1, 2], far: [3, 4, 5], origin: [[0.0; 2]; 3], inverse: [[0.0; 2]; 3], mixed: [false; 3] };
        for axis in 0..3 {
            let [low, high] = direction.map(|bound| bound[axis]);
            // What is this small may be anything next to what it was rounded from.
            if low < 1e-6 && high > -1e-6 {
                bundle.mixed[axis] = true;
                continue;
            }
            let [least, most] = [1.0 / high, 1.0 / low];
            bundle.inverse[axis] = [least - least.abs() * Self::SLACK, most + most.abs() * Self::SLACK];
            bundle.origin[axis] = [origin[1][axis], origin[0][axis]];
            if most < 0.0 {
                std::mem::swap(&mut bundle.near[axis], &mut bundle.far[axis]);
                bundle.origin[axis].swap(0, 1);
            }
        }
        bundle
    }
}

impl<E: Eights> Slabs<E> for Bundle {
    #[inline(always)]
    fn distances(&self, e: E, planes: &[[f32; eight::WIDTH]; 6]) -> (E::Eight, E::Eight) {
        let (mut near, mut far) = (e.splat(f32::NEG_INFINITY), e.splat(f32::INFINITY));
        for axis in 0..3 {
            if self.mixed[axis] {
                continue;
            }
            let (least, most) = (e.splat(self.inverse[axis][0]), e.splat(self.inverse[axis][1]));
            let ahead = e.sub(e.load(&planes[self.near[axis].min(5)]), e.splat(self.origin[axis][0]));
            let behind = e.sub(e.load(&planes[self.far[axis].min(5)]), e.splat(self.origin[axis][1]));
            near = e.max(near, e.min(e.mul(ahead, least), e.mul(ahead, most)));
            far = e.min(far, e.max(e.mul(behind, least), e.mul(behind, most)));
        }
        (near, far)
    }
}

/// A packet's rays as the triangle test sees them.
pub(super) struct Shear {
    axes: [usize; 3],
    x: Lanes,
    y: Lanes,
    z: Lanes,
}

/// Hits of a packet's rays with one triangle.
#[derive(Default)]
pub(super) struct LaneHits {
    pub t: Lanes,
    pub u: Lanes,
    pub v: Lanes,
    /// At least that of the single ray's hit.
    pub slack: Lanes,
    /// 1: front, 2: back, 0: no hit.
    pub side: [u32; LANES],
}

impl LaneHits {
    pub const NONE: u32 = 0;
    pub const FRONT: u32 = 1;
    pub const BACK: u32 = 2;
    /// Asks for [`Ray::triangle`] itself.
    const SPECIAL: u32 = 4;
}

/// Looks for what is in a mesh, for all rays of a packet.
pub(super) trait Visit {
    /// How far each ray reaches now.
    fn reach(&self) -> &Lanes;

    /// What a ray's [`Ray::grain`] is.
    fn grain(&self, lane: usize) -> Vec3;

    /// At least the largest component of any ray's origin and grain.
    fn size(&self) -> f32;

    /// Whether a ray is taken not to meet a triangle.
    fn leaves(&self, lane: usize, triangle: u32) -> bool;

    /// Takes the hits of one triangle.
    fn hit(&mut self, triangle: u32, hits: &LaneHits);
}

/// Shows each triangle that a ray of a packet meets to `visit`.
#[inline(always)]
pub(super) fn intersect<E: Eights>(eights: E, tree: &MeshTree, rays: &LaneRays, shear: &Shear, visit: &mut impl Visit) {
    let mut farthest = largest(visit.reach());
    tree.tree().walk(eights, &rays.bundle(), &mut farthest, InLeaf { tree, rays, shear, visit });
}

/// Looks at the triangles of leaves.
struct InLeaf<'a, V> {
    tree: &'a MeshTree,
    rays: &'a LaneRays,
    shear: &'a Shear,
    visit: &'a mut V,
}

impl<V: Visit> Visitor for InLeaf<'_, V> {
    #[inline(always)]
    fn leaf<E: Eights>(&mut self, _: E, leaf: Leaf<'_>, farthest: &mut f32) -> bool {
        let Self { tree, rays, shear, visit } = self;
        let (near, mut limit, any) = rays.enter(&leaf, visit.reach());
        if any {
            for block in tree.blocks(&leaf) {
                for place in 0..WIDTH {
                    let Some((triangle, vertices)) = block.triangle(place) else { break };
                    if let Some(hits) = shear.triangle(rays, *visit, (triangle, &vertices), &near, &limit) {
                        visit.hit(triangle, &hits);
                        let reach = visit.reach();
                        for i in 0..LANES {
                            limit[i] = min(limit[i], reach[i]);
                        }
                    }
                }
            }
            *farthest = largest(visit.reach());
        }
        *farthest >= 0.0
    }
}

impl Shear {
    /// Where the rays meet a triangle within `limit`, as [`Ray::triangle`] and the mesh tree say; `None` if none does.
    #[inline(always)]
    fn triangle(
        &self,
        rays: &LaneRays,
        visit: &impl Visit,
        (id, vertices): (u32, &[Vec3; 3]),
        near: &Lanes,
        limit: &Lanes,
    ) -> Option<LaneHits> {
        let [kx, ky, kz] = self.axes.map(|axis| axis.min(2));
        let [ox, oy, oz] = [kx, ky, kz].map(|axis| &rays.origin[axis]);
        let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] =
            vertices.map(|vertex| [kx, ky, kz].map(|axis| vertex.to_array()[axis]));
        let (mut us, mut vs, mut ws) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        let mut any = 0;
        for i in 0..LANES {
            let (sx, sy) = (self.x[i], self.y[i]);
            let (a, b, c) = (az - oz[i], bz - oz[i], cz - oz[i]);
            let (ax, ay) = (ax - ox[i] - sx * a, ay - oy[i] - sy * a);
            let (bx, by) = (bx - ox[i] - sx * b, by - oy[i] - sy * b);
            let (cx, cy) = (cx - ox[i] - sx * c, cy - oy[i] - sy * c);
            let u = cx * by - cy * bx;
            let v = ax * cy - ay * cx;
            let w = bx * ay - by * ax;
            let outside = (min(min(u, v), w) < 0.0) & (max(max(u, v), w) > 0.0);
            let edge = (u == 0.0) | (v == 0.0) | (w == 0.0);
            any |= u32::from((!outside | edge) & (limit[i] >= 0.0));
            us[i] = u;
            vs[i] = v;
            ws[i] = w;
        }
        if any == 0 {
            return None;
        }
        let mut hits = LaneHits::default();
        let mut any = 0;
        let (normal, size) = normal_and_size(vertices, visit.size());
        // Products of lanes may be fused or ordered otherwise than those of single rays.
        let size = size * 2.0;
        let [dx, dy, dz] = &rays.direction;
        for i in 0..LANES {
            let (u, v, w) = (us[i], vs[i], ws[i]);
            let sz = self.z[i];
            let (a, b, c) = (sz * (az - oz[i]), sz * (bz - oz[i]), sz * (cz - oz[i]));
            let outside = (min(min(u, v), w) < 0.0) & (max(max(u, v), w) > 0.0);
            let edge = (u == 0.0) | (v == 0.0) | (w == 0.0);
            let determinant = u + v + w;
            let t = (u * a + v * b + w * c) / determinant;
            let farthest = max(max(a.abs(), b.abs()), c.abs());
            let special = edge | (!outside & (min(min(a, b), c) <= farthest * NOT_AHEAD));
            // See the head of `tree`.
            let entered = max(t, near[i]);
            let met = !outside & (t > 0.0) & (entered <= limit[i]);
            let side = if determinant > 0.0 { LaneHits::FRONT } else { LaneHits::BACK };
            let side = if met { side } else { LaneHits::NONE };
            let asks = special & (limit[i] >= 0.0);
            let side = if asks { LaneHits::SPECIAL } else { side };
            hits.t[i] = entered;
            hits.u[i] = v / determinant;
            hits.v[i] = w / determinant;
            let along = normal.x * dx[i] + normal.y * dy[i] + normal.z * dz[i];
            hits.slack[i] = min(size / along.abs(), t * (2.0 * MOST_SLACK));
            hits.side[i] = side;
            any |= side;
        }
        if any & LaneHits::SPECIAL != 0 {
            any = ask(rays, visit, (id, vertices), near, limit, &mut hits);
        }
        (any != 0).then_some(hits)
    }
}

/// Replaces special lanes by what the single ray meets; whether any lane meets the triangle.
#[cold]
fn ask(
    rays: &LaneRays,
    visit: &impl Visit,
    (id, vertices): (u32, &[Vec3; 3]),
    near: &Lanes,
    limit: &Lanes,
    hits: &mut LaneHits,
) -> u32 {
    for i in 0..LANES {
        if hits.side[i] & LaneHits::SPECIAL == 0 {
            continue;
        }
        hits.side[i] = LaneHits::NONE;
        if visit.leaves(i, id) {
            continue;
        }
        if let Some(hit) = rays.ray(i, visit.grain(i)).triangle(vertices, limit[i]) {
            let t = hit.t.max(near[i]);
            if t <= limit[i] {
                hits.side[i] = if hit.front { LaneHits::FRONT } else { LaneHits::BACK };
                (hits.t[i], hits.u[i], hits.v[i], hits.slack[i]) = (t, hit.u, hit.v, hit.slack);
            }
        }
    }
    hits.side.iter().fold(0, |any, side| any | side)
}

/// The same as [`intersect`] for rays that are no packet in the mesh's space.
#[inline(never)]
pub(super) fn one_by_one(tree: &MeshTree, rays: &LaneRays, visit: &mut impl Visit) {
    for lane in 0..LANES {
        let mut reach = visit.reach()[lane];
        if reach < 0.0 {
            continue;
        }
        tree.intersect(&rays.ray(lane, visit.grain(lane)), &mut reach, |triangle, hit, reach| {
            let mut hits = LaneHits::default();
            hits.side[lane] = if hit.front { LaneHits::FRONT } else { LaneHits::BACK };
            (hits.t[lane], hits.u[lane], hits.v[lane], hits.slack[lane]) = (hit.t, hit.u, hit.v, hit.slack);
            visit.hit(triangle, &hits);
            *reach = visit.reach()[lane];
            *reach >= 0.0
        });
    }
}
