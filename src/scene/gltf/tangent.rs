//! Tangents for normal textures, by Mikkelsen's method (MikkTSpace), which glTF prescribes where a model has none.
//!
//! The method works on triangle corners. A vertex whose corners get different tangents (at seams and mirrored halves of
//! the texture) is split.

use std::collections::HashMap;

use bevy_mikktspace::{Geometry, Ops, TangentSpace, generate_tangents};

use super::build::gather;
use super::primitive::Primitive;
use crate::math::{Vec2, Vec4};

/// Mathematics that do not depend on the machine.
struct Portable;

impl Ops for Portable {
    fn sqrt(x: f32) -> f32 {
        x.sqrt()
    }

    fn acos(x: f32) -> f32 {
        libm::acos(f64::from(x)) as f32
    }
}

struct Corners<'a> {
    primitive: &'a Primitive,
    uvs: &'a [Vec2],
    /// Of all corners; zero where the method finds none.
    tangents: Vec<Vec4>,
}

impl Corners<'_> {
    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.primitive.triangles[face][corner] as usize
    }
}

impl Geometry<Portable> for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.primitive.triangles.len()
    }

    fn num_vertices_of_face(&self, _face: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.primitive.positions[self.vertex(face, corner)].into()
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.primitive.normals[self.vertex(face, corner)].into()
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        self.uvs[self.vertex(face, corner)].into()
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        if let Some(space) = space {
            // The method's v points up, glTF's down: the bitangent turns around.
            let [x, y, z, w] = space.tangent_encoded();
            self.tangents[3 * face + corner] = Vec4::new(x, y, z, -w);
        }
    }
}

/// Computes the tangents of a primitive that has normals and the given uv set.
pub(super) fn generate(primitive: &mut Primitive, set: usize) {
    let tangents = vec![Vec4::ZERO; 3 * primitive.triangles.len()];
    let mut corners = Corners { primitive, uvs: &primitive.uvs[set], tangents };
    if generate_tangents(&mut corners).is_err() {
        return; // The error type has no values.
    }
    let tangents = corners.tangents;
    // Only looked up, never walked through, so the map's order does not matter.
    let mut vertices: HashMap<(u32, [u32; 4]), u32> = HashMap::new();
    let mut sources: Vec<u32> = Vec::new();
    let mut distinct: Vec<Vec4> = Vec::new();
    for (corner, tangent) in primitive.triangles.as_flattened_mut().iter_mut().zip(tangents) {
        *corner = *vertices.entry((*corner, tangent.to_array().map(f32::to_bits))).or_insert_with(|| {
            sources.push(*corner);
            distinct.push(tangent);
            sources.len() as u32 - 1
        });
    }
    gather(primitive, &sources);
    primitive.tangents = distinct;
}
