//! From primitives to a scene mesh: normals, tangents, and one set of arrays with a material slot for each triangle.

use super::primitive::Primitive;
use super::report::Report;
use super::tangent;
use crate::math::{Vec2, Vec3, Vec4, frame};
use crate::scene::mesh::Mesh;

/// Which primitives of a mesh share a material slot.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Slots {
    /// The glTF material of each slot.
    pub materials: Vec<Option<usize>>,
}

/// Merges primitives into one mesh. `tangent_set` tells which uv set a material's normal texture uses, if it has one.
pub(super) fn merge(
    name: String,
    mut primitives: Vec<Primitive>,
    tangent_set: impl Fn(Option<usize>) -> Option<usize>,
    report: &mut Report,
) -> Option<(Mesh, Slots)> {
    for primitive in &mut primitives {
        drop_unusable(primitive, report);
    }
    primitives.retain(|primitive| !primitive.triangles.is_empty());

    // Tangents in the file are kept; others are made only where a normal texture asks for them.
    let tangent_set = |primitive: &Primitive| {
        let set = if primitive.tangents.is_empty() { tangent_set(primitive.material) } else { None };
        set.filter(|set| *set < primitive.uvs.len())
    };
    // A mesh that needs no normals stays without: the tracer takes each triangle's own.
    let needs_normals = primitives.iter().any(|p| !p.normals.is_empty() || tangent_set(p).is_some());
    for primitive in &mut primitives {
        if !primitive.normals.is_empty() {
            complete_normals(primitive);
        } else if needs_normals {
            unshare(primitive);
        }
        if let Some(set) = tangent_set(primitive) {
            tangent::generate(primitive, set);
        }
        complete_tangents(primitive);
    }
    concatenate(name, primitives, report)
}

/// Drops triangles with positions that are not finite, and vertices that no triangle uses.
fn drop_unusable(primitive: &mut Primitive, report: &mut Report) {
    let before = primitive.triangles.len();
    let positions = &primitive.positions;
    primitive.triangles.retain(|corners| corners.iter().all(|vertex| positions[*vertex as usize].is_finite()));
    let dropped = before - primitive.triangles.len();
    if dropped > 0 {
        report.warning(
            format!("{}.attributes.POSITION", primitive.place),
            format!("{dropped} triangles have positions that are not finite numbers and are not drawn"),
        );
    }
    let mut used = vec![false; primitive.positions.len()];
    for vertex in primitive.triangles.as_flattened() {
        used[*vertex as usize] = true;
    }
    if used.iter().all(|used| *used) {
        return;
    }
    let kept: Vec<u32> = (0..used.len() as u32).filter(|vertex| used[*vertex as usize]).collect();
    let mut renamed = vec![0; used.len()];
    for (new, old) in kept.iter().enumerate() {
        renamed[*old as usize] = new as u32;
    }
    for vertex in primitive.triangles.as_flattened_mut() {
        *vertex = renamed[*vertex as usize];
    }
    gather(primitive, &kept);
}

/// Gives each triangle its own three vertices, with the triangle's normal.
fn unshare(primitive: &mut Primitive) {
    let corners = primitive.triangles.as_flattened().to_vec();
    gather(primitive, &corners);
    for (index, triangle) in primitive.triangles.iter_mut().enumerate() {
        let first = 3 * index as u32;
        *triangle = [first, first + 1, first + 2];
    }
    primitive.normals = primitive
        .triangles
        .iter()
        .flat_map(|triangle| {
            let normal = face_normal(&primitive.positions, triangle);
            [if normal == Vec3::ZERO { Vec3::Z } else { normal }; 3]
        })
        .collect();
}

/// Makes the vertex attributes those of the listed old vertices, in that order.
pub(super) fn gather(primitive: &mut Primitive, vertices: &[u32]) {
    fn pick<T: Copy>(values: &mut Vec<T>, vertices: &[u32]) {
        if !values.is_empty() {
            *values = vertices.iter().map(|vertex| values[*vertex as usize]).collect();
        }
    }
    pick(&mut primitive.positions, vertices);
    pick(&mut primitive.normals, vertices);
    pick(&mut primitive.tangents, vertices);
    pick(&mut primitive.colors, vertices);
    for set in &mut primitive.uvs {
        pick(set, vertices);
    }
    // Posing is done, so what it needed can go.
    primitive.morphs.clear();
    primitive.influences.clear();
}

/// The unit normal of a triangle, or zero if it has no area; in double precision, so that small triangles have one.
fn face_normal(positions: &[Vec3], triangle: &[u32; 3]) -> Vec3 {
    let [a, b, c] = triangle.map(|vertex| positions[vertex as usize].as_dvec3());
    (b - a).cross(c - a).normalize_or_zero().as_vec3()
}

/// Brings normals to unit length; those without a direction take that of the first triangle at the vertex.
fn complete_normals(primitive: &mut Primitive) {
    for normal in &mut primitive.normals {
        *normal = normal.as_dvec3().normalize_or_zero().as_vec3();
    }
    if primitive.normals.iter().all(|normal| *normal != Vec3::ZERO) {
        return;
    }
    for triangle in &primitive.triangles {
        let face = face_normal(&primitive.positions, triangle);
        for vertex in triangle {
            let normal = &mut primitive.normals[*vertex as usize];
            if *normal == Vec3::ZERO {
                *normal = face;
            }
        }
    }
    for normal in primitive.normals.iter_mut().filter(|normal| **normal == Vec3::ZERO) {
        *normal = Vec3::Z;
    }
}

/// Brings tangents to unit length and their handedness to ±1.
fn complete_tangents(primitive: &mut Primitive) {
    for (tangent, normal) in primitive.tangents.iter_mut().zip(&primitive.normals) {
        let direction = tangent.truncate().as_dvec3().normalize_or_zero().as_vec3();
        let direction = if direction == Vec3::ZERO { frame(*normal).0 } else { direction };
        *tangent = direction.extend(if tangent.w < 0.0 { -1.0 } else { 1.0 });
    }
}

fn concatenate(name: String, primitives: Vec<Primitive>, report: &mut Report) -> Option<(Mesh, Slots)> {
    let vertices: usize = primitives.iter().map(|primitive| primitive.positions.len()).sum();
    if u32::try_from(vertices).is_err() {
        return report.fail(format!("mesh `{name}`"), "more than 4294967295 vertices");
    }
    let has = |attribute: &dyn Fn(&Primitive) -> bool| primitives.iter().any(attribute);
    let (normals, tangents, colors) = (
        has(&|primitive| !primitive.normals.is_empty()),
        has(&|primitive| !primitive.tangents.is_empty()),
        has(&|primitive| !primitive.colors.is_empty()),
    );
    let uv_sets = primitives.iter().map(|primitive| primitive.uvs.len()).max().unwrap_or(0);
    let mut mesh = Mesh { name, uvs: vec![Vec::new(); uv_sets], ..Mesh::default() };
    let mut slots = Slots::default();
    for primitive in primitives {
        let first = mesh.positions.len() as u32;
        let count = primitive.positions.len();
        let known = slots.materials.iter().position(|material| *material == primitive.material);
        let slot = known.unwrap_or_else(|| {
            slots.materials.push(primitive.material);
            slots.materials.len() - 1
        });
        let Ok(slot) = u16::try_from(slot) else {
            return report.fail(&primitive.place, "a mesh can use at most 65536 materials");
        };
        mesh.slots.extend(std::iter::repeat_n(slot, primitive.triangles.len()));
        mesh.triangles.extend(primitive.triangles.iter().map(|corners| corners.map(|vertex| first + vertex)));
        if normals {
            append(&mut mesh.normals, primitive.normals, count, |_| Vec3::Z);
        }
        if tangents {
            // Tangents come with normals, so these are here.
            let (normals, first) = (&mesh.normals, first as usize);
            append(&mut mesh.tangents, primitive.tangents, count, |i| frame(normals[first + i]).0.extend(1.0));
        }
        if colors {
            append(&mut mesh.colors, primitive.colors, count, |_| Vec4::ONE);
        }
        let mut sets = primitive.uvs.into_iter();
        for set in &mut mesh.uvs {
            append(set, sets.next().unwrap_or_default(), count, |_| Vec2::ZERO);
        }
        append(&mut mesh.positions, primitive.positions, count, |_| Vec3::ZERO);
    }
    if slots.materials.len() <= 1 {
        mesh.slots = Vec::new();
    }
    Some((mesh, slots))
}

/// Appends a primitive's values, or `count` stand-ins where it has none. The first primitive's array is moved.
fn append<T>(all: &mut Vec<T>, values: Vec<T>, count: usize, stand_in: impl Fn(usize) -> T) {
    if values.is_empty() {
        all.extend((0..count).map(stand_in));
    } else if all.is_empty() {
        *all = values;
    } else {
        all.extend(values);
    }
}
