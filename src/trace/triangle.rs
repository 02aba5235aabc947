//! The watertight ray–triangle test of Woop, Benthin and Wald ("Watertight Ray/Triangle Intersection", JCGT 2013).
//!
//! The triangle is sheared into a space where the ray is the z axis; three edge functions then decide on which side
//! of each edge the ray passes. For an edge that two triangles share, both compute the same two products and subtract
//! them in opposite order, so a ray can never slip between them; where a function is exactly 0 in single precision it
//! is computed again in double, where the products are exact.

use super::gamma;
use crate::math::{Vec3, Vec4};

/// Roundings on a ray's way into an object's space, with those of the matrix and of where it left a surface.
const START_ROUNDINGS: u32 = 12;

/// Bound on the error of a position and of one beside it, over the largest coordinate: `Surface::new` has two times 14 roundings
/// in each of three axes.
const SLACK: f32 = 2.0 * gamma(84);
/// Largest slack over the distance: that of rays along a surface has no bound.
pub(super) const MOST_SLACK: f32 = 1.0 / 16.0;

/// A vertex that is not farther ahead of a ray than this, times the farthest of its triangle, may be behind it.
pub(super) const NOT_AHEAD: f32 = gamma(8);

/// Axes of the sheared space, by the axis of the largest component of the direction and whether it is negative: the winding of the
/// sheared triangle stays what it is.
const AXES: [[[usize; 3]; 2]; 3] = [[[1, 2, 0], [2, 1, 0]], [[2, 0, 1], [0, 2, 1]], [[0, 1, 2], [1, 0, 2]]];

/// A ray, with what the triangle test needs of it worked out.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Where it starts.
    pub origin: Vec3,
    /// Where it goes; of any finite length > 0, in which distances are counted.
    pub direction: Vec3,
    /// 1 / direction, with zeros replaced by values too small to matter (see [`Ray::new`]).
    pub(super) inverse: Vec3,
    /// Coordinates that were rounded when it was placed, in each axis: [`super::world::PlacedObject`] sets it. The precision of
    /// `origin` is that of the larger one of both.
    pub(super) grain: Vec3,
    /// Axes of the sheared space, the ray's own last.
    pub(super) axes: [usize; 3],
    pub(super) shear: Vec3,
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleHit {
    /// Distance in lengths of the ray's direction, > 0.
    pub t: f32,
    /// Barycentric weight of the second vertex.
    pub u: f32,
    /// Barycentric weight of the third vertex.
    pub v: f32,
    /// Whether the ray met the side from which the vertices run counter-clockwise.
    pub front: bool,
    /// How much farther along the ray others may be that lie in one plane with it, for all that single precision can tell.
    pub slack: f32,
}

impl Ray {
    /// A ray. One whose `origin` or `direction` is not finite, or whose `direction` is zero, meets nothing: an absurd
    /// transform can make such rays in an object's own space.
    #[inline]
    #[must_use]
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        // Without branches: which way a ray goes is anybody's guess.
        let magnitude = direction.abs();
        let is_x = (magnitude.x > magnitude.y) & (magnitude.x > magnitude.z);
        let largest = if is_x { 0 } else { 2 - usize::from(magnitude.y > magnitude.z) };
        let components = [direction.x, direction.y, direction.z, 1.0];
        let axes = AXES[largest][usize::from(components[largest] < 0.0)];
        // Divisions in pairs: three take as long as one.
        let [x, y, along] = axes.map(|axis| components[axis & 3]);
        let shear = (Vec4::new(x, y, 1.0, 1.0) / Vec4::splat(along)).truncate();
        // A component of exactly 0 would make 0 · ∞ = NaN at a box face that contains the origin. At 1e-30 the ray
        // strays less than a unit in the last place over any distance a float can hold beside its origin.
        let safe = |d: f32| if d.abs() < 1e-30 { 1e-30_f32.copysign(d) } else { d };
        let inverse = (Vec4::ONE / Vec4::new(safe(direction.x), safe(direction.y), safe(direction.z), 1.0)).truncate();
        Self { origin, direction, inverse, grain: Vec3::ZERO, axes, shear }
    }

    /// Whether it can meet anything.
    #[inline]
    #[must_use]
    pub(super) fn is_sound(&self) -> bool {
        self.origin.is_finite() && self.direction.is_finite()
    }

    /// The point at a distance.
    #[must_use]
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + self.direction * t
    }

    /// Where the ray meets a triangle at 0 < t ≤ `t_max`. Triangles without area, and those with a coordinate that is
    /// not finite, are never met; nor is one on which the ray starts, as far as `grain` can tell.
    #[inline]
    #[must_use]
    pub fn triangle(&self, vertices: &[Vec3; 3], t_max: f32) -> Option<TriangleHit> {
        let [kx, ky, kz] = self.axes;
        let [a, b, c] = vertices.map(|vertex| vertex - self.origin);
        let ax = a[kx] - self.shear.x * a[kz];
        let ay = a[ky] - self.shear.y * a[kz];
        let bx = b[kx] - self.shear.x * b[kz];
        let by = b[ky] - self.shear.y * b[kz];
        let cx = c[kx] - self.shear.x * c[kz];
        let cy = c[ky] - self.shear.y * c[kz];

        let mut u = cx * by - cy * bx;
        let mut v = ax * cy - ay * cx;
        let mut w = bx * ay - by * ax;
        if u == 0.0 || v == 0.0 || w == 0.0 {
            let [ax, ay, bx, by, cx, cy] = [ax, ay, bx, by, cx, cy].map(f64::from);
            u = (cx * by - cy * bx) as f32;
            v = (ax * cy - ay * cx) as f32;
            w = (bx * ay - by * ax) as f32;
        }
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let determinant = u + v + w;
        let [az, bz, cz] = [a[kz], b[kz], c[kz]].map(|z| self.shear.z * z);
        let mut t = (u * az + v * bz + w * cz) / determinant;
        // `t` lies between the vertices' distances. Where one of these is not ahead of the ray, `t` may be rounding
        // alone: the ray may leave this very triangle, a hair off it.
        if az.min(bz).min(cz) <= NOT_AHEAD * az.abs().max(bz.abs()).max(cz.abs()) {
            t = self.distance_to_plane(vertices)?;
        }

        // Written so that NaN (no area, or a coordinate that is not finite) is no hit.
        if t > 0.0 && t <= t_max && determinant.abs() > 0.0 {
            let front = determinant > 0.0;
            let slack = self.slack(vertices, t);
            Some(TriangleHit { t, u: v / determinant, v: w / determinant, front, slack })
        } else {
            None
        }
    }

    /// [`TriangleHit::slack`]: well above the error bounds of [`super::surface::Surface`], divided by the cosine at which the
    /// ray arrives.
    #[inline(always)]
    pub(super) fn slack(&self, vertices: &[Vec3; 3], t: f32) -> f32 {
        let size = self.origin.abs().max(self.grain).max_element();
        let (normal, size) = normal_and_size(vertices, size);
        // The minimum of NaN and a number is the number.
        (size / normal.dot(self.direction).abs()).min(t * MOST_SLACK)
    }

    /// The distance to a triangle's plane, in double precision; `None` if the ray may start on it.
    ///
    /// The bound on rounding in single precision (pbrt 4th edition, section 6.8.7) cannot decide this: it grows with the distance
    /// of the vertices, and rejects all that is met by rays along a large plane. But the vertices are exact by definition,
    /// double precision is as good as exact, and the one thing that was rounded is where the ray starts.
    #[cold]
    fn distance_to_plane(&self, vertices: &[Vec3; 3]) -> Option<f32> {
        let [a, b, c] = vertices.map(|vertex| vertex.as_dvec3());
        let origin = self.origin.as_dvec3();
        let normal = (b - a).cross(c - a);
        // From the nearest vertex, so that least is lost.
        let offset = [a, b, c].map(|vertex| vertex - origin);
        let nearest = offset.into_iter().min_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))?;
        let height = normal.dot(nearest);
        let start_error = self.origin.abs().max(self.grain).as_dvec3() * f64::from(gamma(START_ROUNDINGS));
        // Written so that NaN is no hit.
        (height.abs() > normal.abs().dot(start_error)).then(|| (height / normal.dot(self.direction.as_dvec3())) as f32)
    }
}

/// A triangle's normal, and what the slack of a hit is when divided by its product with the ray's direction. `size` is that of
/// coordinates that were rounded.
#[inline(always)]
pub(super) fn normal_and_size([a, b, c]: &[Vec3; 3], size: f32) -> (Vec3, f32) {
    let normal = (b - a).cross(c - a);
    let size = a.abs().max(b.abs()).max(c.abs()).max_element().max(size);
    (normal, SLACK * size * (normal.x.abs() + normal.y.abs() + normal.z.abs()))
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: [Vec3; 3] = [Vec3::ZERO, Vec3::X, Vec3::Y];

    #[test]
    fn the_side_and_weights_are_those_of_the_vertices() {
        for (from, front) in [(1.0, true), (-1.0, false)] {
            let ray = Ray::new(Vec3::new(0.25, 0.5, from), Vec3::new(0.0, 0.0, -from));
            let hit = ray.triangle(&TRIANGLE, f32::INFINITY).expect("the ray goes through the triangle");
            assert_eq!((hit.t, hit.u, hit.v, hit.front), (1.0, 0.25, 0.5, front));
            assert!((1e-6..1e-4).contains(&hit.slack), "{}", hit.slack);
        }
    }

    #[test]
    fn distances_stay_within_the_interval() {
        let ray = Ray::new(Vec3::new(0.25, 0.25, 1.0), Vec3::NEG_Z);
        assert!(ray.triangle(&TRIANGLE, 0.999).is_none());
        assert!(ray.triangle(&TRIANGLE, 1.0).is_some());
        assert!(Ray::new(Vec3::new(0.25, 0.25, -1.0), Vec3::NEG_Z).triangle(&TRIANGLE, 9.0).is_none());
        assert!(Ray::new(Vec3::new(0.25, 0.25, 0.0), Vec3::NEG_Z).triangle(&TRIANGLE, 9.0).is_none());
    }

    #[test]
    fn rays_that_are_not_finite_or_go_nowhere_meet_nothing() {
        let [start, down] = [Vec3::new(0.25, 0.25, 1.0), Vec3::NEG_Z];
        for (origin, direction) in [
            (start, Vec3::ZERO),
            (start, Vec3::new(0.0, 0.0, f32::NEG_INFINITY)),
            (start, Vec3::NAN),
            (Vec3::new(0.25, 0.25, f32::INFINITY), down),
            (Vec3::new(f32::NAN, 0.25, 1.0), down),
        ] {
            assert_eq!(Ray::new(origin, direction).triangle(&TRIANGLE, f32::INFINITY), None, "{origin} {direction}");
        }
    }

    #[test]
    fn triangles_without_area_or_with_nan_are_never_met() {
        let ray = Ray::new(Vec3::new(0.25, 0.0, 1.0), Vec3::NEG_Z);
        for broken in [
            [Vec3::ZERO, Vec3::X, Vec3::X],
            [Vec3::ZERO, Vec3::X, Vec3::X * 2.0],
            [Vec3::ZERO; 3],
            [Vec3::NAN, Vec3::X, Vec3::Y],
            [Vec3::ZERO, Vec3::INFINITY, Vec3::Y],
        ] {
            assert_eq!(ray.triangle(&broken, f32::INFINITY), None, "{broken:?}");
        }
    }
}
