//! Triangle meshes, stored once and placed any number of times.

use crate::math::{Vec2, Vec3, Vec4};

/// A triangle mesh in its own space. Attributes are per vertex and either empty (absent) or as long as `positions`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// For messages and `tusche explain`.
    pub name: String,
    /// Vertex positions, object space.
    pub positions: Vec<Vec3>,
    /// Vertex indices of each triangle, counter-clockwise seen from the front. All are below `positions.len()`.
    pub triangles: Vec<[u32; 3]>,
    /// Unit shading normals. Absent: each triangle's own normal.
    pub normals: Vec<Vec3>,
    /// Unit tangents; `w` is the handedness of the bitangent, ±1. Absent: derived from uv or the normal at the hit.
    pub tangents: Vec<Vec4>,
    /// Texture coordinate sets; set 0 is `hit.uv`. Each set is as long as `positions`.
    pub uvs: Vec<Vec<Vec2>>,
    /// Linear vertex colours with alpha. Absent: white.
    pub colors: Vec<Vec4>,
    /// The polygon each triangle was cut from, counted from 0. Absent: each triangle is its own polygon.
    pub polygons: Vec<u32>,
    /// The material slot of each triangle. Absent: all use slot 0.
    pub slots: Vec<u16>,
}

impl Mesh {
    /// How many material slots an object with this mesh needs (at least one).
    #[must_use]
    pub fn slot_count(&self) -> usize {
        self.slots.iter().max().map_or(1, |slot| usize::from(*slot) + 1)
    }
}
