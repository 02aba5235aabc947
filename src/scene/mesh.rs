//! Triangle meshes, stored once and placed any number of times.

use rayon::prelude::*;

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

    /// Whether the triangles enclose a space: along each edge as many run one way as the other. Corners at one place are one
    /// corner; triangles that have two of them there count for nothing.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        let mut places: Vec<([u32; 3], u32)> =
            self.positions.iter().map(|position| position.to_array().map(|x| (x + 0.0).to_bits())).zip(0..).collect();
        places.par_sort_unstable();
        let mut corner = vec![0; places.len()];
        for same in places.chunk_by(|a, b| a.0 == b.0) {
            for (_, vertex) in same {
                corner[*vertex as usize] = same[0].1;
            }
        }
        // The lower corner first, and whether the edge runs from there.
        let mut edges: Vec<(u32, u32, bool)> = Vec::with_capacity(self.triangles.len() * 3);
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|vertex| corner[vertex as usize]);
            if a != b && b != c && c != a {
                edges.extend([(a, b), (b, c), (c, a)].map(|(from, to)| (from.min(to), from.max(to), from < to)));
            }
        }
        edges.par_sort_unstable();
        let is_even = |edge: &[(u32, u32, bool)]| edge.iter().filter(|(.., up)| *up).count() * 2 == edge.len();
        !edges.is_empty() && edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)).all(is_even)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mesh_is_closed_if_no_edge_is_open() {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(Vec3::from);
        let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let mut mesh = Mesh { positions: corners.to_vec(), triangles: faces.to_vec(), ..Mesh::default() };
        assert!(mesh.is_closed());
        // Corners of their own for each face change nothing, nor does a triangle without area.
        mesh.positions = faces.iter().flatten().map(|corner| corners[*corner as usize]).collect();
        mesh.triangles = (0..4).map(|face| [face * 3, face * 3 + 1, face * 3 + 2]).collect();
        mesh.triangles.push([0, 1, 1]);
        assert!(mesh.is_closed());
        mesh.triangles[2].reverse();
        assert!(!mesh.is_closed(), "one face looks inwards");
        mesh.triangles.remove(2);
        assert!(!mesh.is_closed(), "one face is missing");
        assert!(!Mesh::default().is_closed());
    }
}
