//! The surfaces of a packet's hits, sixteen at a time: what [`Surface::new`] does, operation by operation, in loops over lanes that
//! the compiler vectorises for the instructions that [`pulp::Arch`] finds at run time. What comes out is the same, bit for bit.
//!
//! Packets that meet several objects, and triangles whose normals single precision cannot tell, are left to [`Surface::new`].

use super::gamma;
use super::packet::{LANES, Lanes, product};
use super::surface::{SLIVER, SOUND_SQUARES, Surface};
use super::world::{Hit, PlacedObject, World};
use super::world_packet::PacketHits;
use crate::math::{Mat3, Vec3};

/// Vectors by axis.
type Axes = [Lanes; 3];

/// The surfaces at the hits of a packet, as far as they can be worked out together; not where a ray met nothing.
#[inline]
pub(super) fn surfaces_of(world: &World, hits: &PacketHits) -> [Option<Surface>; LANES] {
    let mut surfaces = [None; LANES];
    let mut met = hits.iter().flatten();
    if let Some(first) = met.next()
        && met.all(|hit| hit.object == first.object)
    {
        world.arch.dispatch(Fill { object: world.object(first.object), first, hits, surfaces: &mut surfaces });
    }
    surfaces
}

struct Fill<'a> {
    object: &'a PlacedObject,
    /// Stands in for rays that met nothing.
    first: &'a Hit,
    hits: &'a PacketHits,
    surfaces: &'a mut [Option<Surface>; LANES],
}

impl pulp::WithSimd for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Self { object, first, hits, surfaces } = self;
        let mesh = &object.mesh;
        let zeros = [[0.0; LANES]; 3];
        let (mut corners, mut normals, mut weights, mut flip) = ([zeros; 3], [zeros; 3], zeros, [0.0; LANES]);
        let has_normals = !mesh.normals.is_empty();
        for (lane, hit) in hits.iter().enumerate() {
            let hit = hit.as_ref().unwrap_or(first);
            let [u, v] = hit.barycentric;
            set(&mut weights, lane, Vec3::new(1.0 - u - v, u, v));
            flip[lane] = if hit.front { 1.0 } else { -1.0 };
            for (corner, vertex) in mesh.triangles[hit.triangle as usize].iter().enumerate() {
                set(&mut corners[corner], lane, mesh.positions[*vertex as usize]);
                if has_normals {
                    set(&mut normals[corner], lane, mesh.normals[*vertex as usize]);
                }
            }
        }
        let (mut position, mut error, mut geometric, mut normal) = (zeros, zeros, zeros, zeros);
        place(object, &corners, &weights, &mut position, &mut error);
        let mut sound = geometric_normals(&object.normal_from_object, &corners, &flip, &mut geometric);
        if has_normals {
            let turned = (&normals, &weights, &flip);
            shading_normals(&object.normal_from_object, turned, &geometric, &mut normal, &mut sound);
        } else {
            normal = geometric;
        }
        for (lane, (surface, hit)) in surfaces.iter_mut().zip(hits).enumerate() {
            *surface = hit.filter(|_| sound[lane]).map(|hit| Surface {
                position: of(&position, lane).into(),
                error: of(&error, lane).into(),
                geometric_normal: of(&geometric, lane).into(),
                normal: of(&normal, lane).into(),
                barycentric: of(&weights, lane).into(),
                front: hit.front,
            });
        }
    }
}

#[inline(always)]
fn set(axes: &mut Axes, lane: usize, value: Vec3) {
    axes[0][lane] = value.x;
    axes[1][lane] = value.y;
    axes[2][lane] = value.z;
}

/// Positions in the world, and how far off they may be.
#[inline(always)]
fn place(object: &PlacedObject, corners: &[Axes; 3], weights: &Axes, position: &mut Axes, error: &mut Axes) {
    let (mut local, mut size, mut local_error) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3], [[0.0; LANES]; 3]);
    for axis in 0..3 {
        for i in 0..LANES {
            let a = corners[0][axis][i] * weights[0][i];
            let b = corners[1][axis][i] * weights[1][i];
            let c = corners[2][axis][i] * weights[2][i];
            local[axis][i] = a + b + c;
            size[axis][i] = local[axis][i].abs();
            local_error[axis][i] = a.abs() * gamma(7) + b.abs() * gamma(7) + c.abs() * gamma(7);
        }
    }
    let m = object.world_from_object;
    let sizes = Mat3::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs());
    let (placed, size) = (product(&m, &local), product(&sizes, &size));
    // Errors are positive.
    let local_error = product(&sizes, &local_error);
    for axis in 0..3 {
        let t = object.translation[axis];
        for i in 0..LANES {
            position[axis][i] = placed[axis][i] + t;
            error[axis][i] = local_error[axis][i] * (1.0 + gamma(3)) + (size[axis][i] + t.abs()) * gamma(4);
        }
    }
}

/// Unit normals of triangles, on the side that rays came from; returns which are sound.
#[inline(always)]
fn geometric_normals(matrix: &Mat3, [a, b, c]: &[Axes; 3], flip: &Lanes, normals: &mut Axes) -> [bool; LANES] {
    let (mut local, mut least) = ([[0.0; LANES]; 3], [0.0; LANES]);
    for i in 0..LANES {
        let along = [b[0][i] - a[0][i], b[1][i] - a[1][i], b[2][i] - a[2][i]];
        let across = [c[0][i] - a[0][i], c[1][i] - a[1][i], c[2][i] - a[2][i]];
        local[0][i] = along[1] * across[2] - across[1] * along[2];
        local[1][i] = along[2] * across[0] - across[2] * along[0];
        local[2][i] = along[0] * across[1] - across[0] * along[1];
        least[i] = dot(along, along) * dot(across, across) * SLIVER;
    }
    let world = product(matrix, &local);
    let mut sound = [false; LANES];
    for i in 0..LANES {
        let square = dot(of(&local, i), of(&local, i));
        sound[i] = unit(&world, i, flip[i], normals) & (square > least[i]);
    }
    sound
}

/// Unit shading normals on the side that rays came from; what is not sound is noted.
#[inline(always)]
fn shading_normals(
    matrix: &Mat3,
    (corners, weights, flip): (&[Axes; 3], &Axes, &Lanes),
    geometric: &Axes,
    normals: &mut Axes,
    sound: &mut [bool; LANES],
) {
    let mut local = [[0.0; LANES]; 3];
    for axis in 0..3 {
        for i in 0..LANES {
            local[axis][i] = corners[0][axis][i] * weights[0][i]
                + corners[1][axis][i] * weights[1][i]
                + corners[2][axis][i] * weights[2][i];
        }
    }
    let world = product(matrix, &local);
    for i in 0..LANES {
        sound[i] &= unit(&world, i, flip[i], normals);
    }
    for i in 0..LANES {
        let is_on_side = dot(of(normals, i), of(geometric, i)) > 0.0;
        for axis in 0..3 {
            normals[axis][i] = if is_on_side { normals[axis][i] } else { geometric[axis][i] };
        }
    }
}

/// The unit vector along a lane's, turned round or not; whether single precision can tell it.
#[inline(always)]
fn unit(vectors: &Axes, i: usize, flip: f32, units: &mut Axes) -> bool {
    let square = dot(of(vectors, i), of(vectors, i));
    let scale = 1.0 / square.sqrt();
    for axis in 0..3 {
        units[axis][i] = vectors[axis][i] * scale * flip;
    }
    SOUND_SQUARES.contains(&square)
}

#[inline(always)]
fn of(axes: &Axes, i: usize) -> [f32; 3] {
    [axes[0][i], axes[1][i], axes[2][i]]
}

#[inline(always)]
fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::files::FileStore;
    use crate::scene::file;
    use crate::scene::settings::RayKinds;
    use crate::trace::packet::RayPacket;
    use crate::trace::triangle::Ray;

    /// Smooth, flat, mirrored and skewed objects, one that is thin, one that is tiny, and two side by side.
    const SCENE: &str = r#"
        objects = [
            { shape = "sphere", radius = 1.0, translate = [-3, 0, 0] },
            { shape = "box", size = [1.5, 1.5, 1.5], rotate = [20, 30, 40] },
            { shape = "torus", translate = [3, 0, 0], scale = [-1.0, 1.0, 2.0] },
            { shape = "box", size = [2.0, 1e-9, 2.0], translate = [0, -2, 0], rotate = [50, 0, 0] },
            { shape = "sphere", radius = 1e-8, translate = [0, 2, 0], scale = 1e8 },
            { shape = "sphere", radius = 0.3, translate = [3, 2, 0] },
            { shape = "sphere", radius = 0.3, translate = [3.4, 2, 0] },
        ]
        [camera]
        position = [0, 0, 12]
        target = [0, 0, 0]
    "#;

    #[test]
    fn sixteen_surfaces_are_those_of_one() {
        let path = Path::new("surfaces.toml");
        let files = FileStore::new().with_file(path, SCENE.to_owned());
        let (builder, _) = file::load(path, &files, &[], &file::LoadOptions::default()).expect("the scene is sound");
        let scene = builder.build().expect("the scene is sound");
        let world = World::new(&scene, &[false]);
        let (mut together, mut alone) = (0, 0);
        for (row, column) in (0..120).flat_map(|row| (0..60).map(move |column| (row, column))) {
            let start = |lane: usize| {
                let [x, y] = [column as f32 / 6.0 - 5.0 + lane as f32 * 0.011, row as f32 / 20.0 - 3.0];
                (Vec3::ZERO, Vec3::new(x, y, -12.0).normalize())
            };
            let packet = RayPacket::of((0..LANES).map(start));
            let hits = world.closest_of(&packet, RayKinds::CAMERA);
            let surfaces = surfaces_of(&world, &hits);
            for (lane, hit) in hits.iter().enumerate() {
                let Some(hit) = hit else { continue };
                let (origin, direction) = packet.ray_start(lane);
                let expected = Surface::new(&world, Ray::new(origin, direction).direction, hit);
                let Some(found) = &surfaces[lane] else {
                    alone += 1;
                    continue;
                };
                assert_eq!(bits(found), bits(&expected), "{hit:?}");
                together += 1;
            }
        }
        assert!(together > 20_000 && alone > 100, "{together} and {alone}");
    }

    fn bits(surface: &Surface) -> ([[u32; 3]; 5], bool) {
        let Surface { position, error, geometric_normal, normal, barycentric, front } = *surface;
        ([position, error, geometric_normal, normal, barycentric].map(|v| v.to_array().map(f32::to_bits)), front)
    }
}
