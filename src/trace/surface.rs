//! From a hit to the surface there: place, error bounds, normals and vertex attributes.

use super::gamma;
use super::world::{Hit, PlacedObject, World};
use crate::math::{Vec2, Vec3, Vec4};

/// Square of the sine between the sides of a triangle up to which single precision is not enough for its normal.
pub(super) const SLIVER: f32 = 1e-6;
/// Squares of lengths that single precision can tell: those of tiny and huge vectors vanish and overflow.
pub(super) const SOUND_SQUARES: std::ops::Range<f32> = 1e-30..1e30;

/// The surface at a hit. Positions are relative to the camera's position, directions are in world space.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// Where.
    pub position: Vec3,
    /// How far off `position` may be, in each axis.
    pub error: Vec3,
    /// Unit normal of the triangle, on the side that the ray came from.
    pub geometric_normal: Vec3,
    /// Unit shading normal, on the side that the ray came from.
    pub normal: Vec3,
    /// Barycentric weights of the triangle's vertices.
    pub barycentric: Vec3,
    /// Whether the ray met the front.
    pub front: bool,
}

impl Surface {
    /// The surface at `hit`, which a ray in `direction` met.
    #[must_use]
    pub fn new(world: &World, direction: Vec3, hit: &Hit) -> Self {
        let object = world.object(hit.object);
        let mesh = &object.mesh;
        let corners = mesh.triangles[hit.triangle as usize];
        let [a, b, c] = corners.map(|vertex| mesh.positions[vertex as usize]);
        let [u, v] = hit.barycentric;
        let barycentric = Vec3::new(1.0 - u - v, u, v);

        // The position from the vertices is far more precise than the one along the ray (pbrt, section 6.8.4).
        let local = a * barycentric.x + b * u + c * v;
        let local_error = (a * barycentric.x).abs() * gamma(7) + (b * u).abs() * gamma(7) + (c * v).abs() * gamma(7);
        let m = object.world_from_object;
        let apply_abs = |p: Vec3| m.x_axis.abs() * p.x.abs() + m.y_axis.abs() * p.y.abs() + m.z_axis.abs() * p.z.abs();
        let position = m * local + object.translation;
        let error =
            apply_abs(local_error) * (1.0 + gamma(3)) + (apply_abs(local) + object.translation.abs()) * gamma(4);

        let flip = if hit.front { 1.0 } else { -1.0 };
        let geometric_normal = triangle_normal(object, [a, b, c]);
        // Too thin to have a normal in single precision: any normal towards the ray will do.
        let geometric_normal = geometric_normal.map_or_else(|| -direction.normalize_or_zero(), |n| n * flip);
        let normal = shading_normal(object, corners, barycentric)
            .map(|normal| normal * flip)
            // A shading normal on the far side of the triangle (smoothed over a sharp edge) would light the wrong side.
            .filter(|normal| normal.dot(geometric_normal) > 0.0)
            .unwrap_or(geometric_normal);
        Self { position, error, geometric_normal, normal, barycentric, front: hit.front }
    }

    /// Where a ray that leaves towards `direction` starts: far enough off the surface, on the right side of it, that
    /// rounding cannot make it meet the surface again (pbrt, section 6.8.6).
    #[inline]
    #[must_use]
    pub fn leave(&self, direction: Vec3) -> Vec3 {
        let normal = self.geometric_normal;
        let distance = normal.abs().dot(self.error);
        let offset = normal * if direction.dot(normal) < 0.0 { -distance } else { distance };
        let start = self.position + offset;
        Vec3::new(away(start.x, offset.x), away(start.y, offset.y), away(start.z, offset.z))
    }
}

/// The next number after `start` in the direction of an offset; `start` itself if there is none. Without branches, which would be
/// mispredicted half of the time.
#[inline(always)]
fn away(start: f32, offset: f32) -> f32 {
    const SIGN: u32 = 1 << 31;
    let (bits, towards) = (start.to_bits(), offset.to_bits() & SIGN);
    let grows = bits & SIGN == towards;
    let step = if grows { 1 } else { u32::MAX };
    let moved = if start == 0.0 { towards | 1 } else { bits.wrapping_add(step) };
    let moves = (offset > 0.0) | (offset < 0.0);
    let has_next = !start.is_nan() & !(start.is_infinite() & grows);
    if moves & has_next { f32::from_bits(moved) } else { start }
}

/// Unit normal of a triangle in the world; `None` if it has none even in double precision.
fn triangle_normal(object: &PlacedObject, [a, b, c]: [Vec3; 3]) -> Option<Vec3> {
    let (along, across) = (b - a, c - a);
    let local = along.cross(across);
    let world = object.normal_from_object * local;
    // Normals of slivers are differences of almost equal products.
    let sound = local.length_squared() > along.length_squared() * across.length_squared() * SLIVER
        && SOUND_SQUARES.contains(&world.length_squared());
    if sound {
        return world.try_normalize();
    }
    let [a, b, c] = [a, b, c].map(Vec3::as_dvec3);
    (object.normal_from_object.as_dmat3() * (b - a).cross(c - a)).try_normalize().map(|normal| normal.as_vec3())
}

fn shading_normal(object: &PlacedObject, corners: [u32; 3], weights: Vec3) -> Option<Vec3> {
    let normals = &object.mesh.normals;
    if normals.is_empty() {
        return None;
    }
    let [a, b, c] = corners.map(|vertex| normals[vertex as usize]);
    let local = a * weights.x + b * weights.y + c * weights.z;
    let world = object.normal_from_object * local;
    if SOUND_SQUARES.contains(&world.length_squared()) {
        return world.try_normalize();
    }
    (object.normal_from_object.as_dmat3() * local.as_dvec3()).try_normalize().map(|normal| normal.as_vec3())
}

/// Vertex attributes at a hit; each is worked out only when asked for.
impl Surface {
    fn corners(object: &PlacedObject, hit: &Hit) -> [usize; 3] {
        object.mesh.triangles[hit.triangle as usize].map(|vertex| vertex as usize)
    }

    /// Texture coordinates of a set; 0 where the mesh lacks it.
    #[must_use]
    pub fn uv(&self, object: &PlacedObject, hit: &Hit, set: usize) -> Vec2 {
        let Some(uvs) = object.mesh.uvs.get(set) else { return Vec2::ZERO };
        let [a, b, c] = Self::corners(object, hit).map(|vertex| uvs[vertex]);
        a * self.barycentric.x + b * self.barycentric.y + c * self.barycentric.z
    }

    /// How many units of uv one world unit on the triangle covers, in the mean of all directions; 0 without uv.
    #[must_use]
    pub fn uv_density(&self, object: &PlacedObject, hit: &Hit) -> f32 {
        let Some(uvs) = object.mesh.uvs.first() else { return 0.0 };
        let corners = Self::corners(object, hit);
        let [a, b, c] = corners.map(|vertex| object.world_from_object * object.mesh.positions[vertex]);
        let [ta, tb, tc] = corners.map(|vertex| uvs[vertex]);
        let area = (b - a).cross(c - a).length();
        let density = ((tb - ta).perp_dot(tc - ta).abs() / area).sqrt();
        if density.is_finite() { density } else { 0.0 }
    }

    /// Vertex colour; white where the mesh has none.
    #[must_use]
    pub fn color(&self, object: &PlacedObject, hit: &Hit) -> Vec4 {
        let colors = &object.mesh.colors;
        if colors.is_empty() {
            return Vec4::ONE;
        }
        let [a, b, c] = Self::corners(object, hit).map(|vertex| colors[vertex]);
        a * self.barycentric.x + b * self.barycentric.y + c * self.barycentric.z
    }

    /// Unit tangent along u, at a right angle to the shading normal; `w` is the handedness of the bitangent.
    ///
    /// From the mesh's tangents, else from how uv changes over the triangle, else any.
    #[must_use]
    pub fn tangent(&self, object: &PlacedObject, hit: &Hit) -> Vec4 {
        let corners = Self::corners(object, hit);
        let tangents = &object.mesh.tangents;
        let (local, handedness) = if tangents.is_empty() {
            let (tangent, mirrored) = uv_tangent(object, corners);
            (tangent, if mirrored { -1.0 } else { 1.0 })
        } else {
            let [a, b, c] = corners.map(|vertex| tangents[vertex]);
            let sum = a * self.barycentric.x + b * self.barycentric.y + c * self.barycentric.z;
            (sum.truncate(), if sum.w < 0.0 { -1.0 } else { 1.0 })
        };
        let tangent = object.world_from_object * local;
        let tangent = (tangent - self.normal * self.normal.dot(tangent))
            .try_normalize()
            .unwrap_or_else(|| crate::math::frame(self.normal).0);
        // The cross product of normal and tangent turns round with the normal, which was turned towards the ray, and in
        // a mirrored object; the bitangent must not.
        let turned = self.front == (object.world_from_object.determinant() < 0.0);
        tangent.extend(if turned { -handedness } else { handedness })
    }

    /// Mean curvature in 1 / world units, from how the vertex normals turn over the triangle; positive where the side
    /// that the ray met bulges towards it. 0 on meshes without vertex normals.
    ///
    /// Half the divergence of the normal field over the triangle: with edge vectors e and normals n at the vertices,
    /// the normals change linearly, n(p) = n₀ + W (p − p₀), and the mean curvature is half the trace of W.
    #[must_use]
    pub fn curvature(&self, object: &PlacedObject, hit: &Hit) -> f32 {
        let normals = &object.mesh.normals;
        if normals.is_empty() {
            return 0.0;
        }
        let corners = Self::corners(object, hit);
        let [a, b, c] = corners.map(|vertex| object.world_from_object * object.mesh.positions[vertex]);
        let [na, nb, nc] = corners.map(|vertex| (object.normal_from_object * normals[vertex]).normalize_or_zero());
        let (e1, e2) = (b - a, c - a);
        let normal = e1.cross(e2);
        let area_squared = normal.length_squared();
        if area_squared == 0.0 {
            return 0.0;
        }
        // Dual edge vectors: d1·e1 = 1, d1·e2 = 0, and so on; the trace of W is Σ dᵢ·(nᵢ − n₀).
        let d1 = e2.cross(normal) / area_squared;
        let d2 = normal.cross(e1) / area_squared;
        let curvature = 0.5 * (d1.dot(nb - na) + d2.dot(nc - na));
        match curvature.is_finite() {
            true if self.front => curvature,
            true => -curvature,
            false => 0.0,
        }
    }
}

/// The direction in which u grows over a triangle (object space, not normalised), and whether the uv are mirrored.
fn uv_tangent(object: &PlacedObject, corners: [usize; 3]) -> (Vec3, bool) {
    let mesh = &object.mesh;
    let Some(uvs) = mesh.uvs.first() else { return (Vec3::ZERO, false) };
    let [a, b, c] = corners.map(|vertex| mesh.positions[vertex]);
    let [ta, tb, tc] = corners.map(|vertex| uvs[vertex]);
    let (du, dv) = (tb - ta, tc - ta);
    let determinant = du.x * dv.y - du.y * dv.x;
    let tangent = (b - a) * dv.y - (c - a) * du.y;
    (if determinant < 0.0 { -tangent } else { tangent }, determinant < 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn away_is_up_and_down() {
        let numbers = [0.0, f32::MIN_POSITIVE, 1e-45, 1.0, 1.5, 3e7, f32::MAX, f32::INFINITY, f32::NAN];
        for start in numbers.into_iter().flat_map(|x| [x, -x]) {
            for offset in numbers.into_iter().flat_map(|x| [x, -x]) {
                let expected = match offset {
                    o if o > 0.0 => start.next_up(),
                    o if o < 0.0 => start.next_down(),
                    _ => start,
                };
                assert_eq!(away(start, offset).to_bits(), expected.to_bits(), "{start} {offset}");
            }
        }
    }
}
