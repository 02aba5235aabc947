//! Meshes in two old formats: Wavefront OBJ and Stanford PLY (text and binary).
//!
//! What is read is the shape alone, as one mesh: positions, normals, one set of texture coordinates, and PLY's vertex colours. What
//! it looks like is the scene file's to say: material libraries, groups and smoothing groups are passed over. Polygons are cut into
//! fans from their first corner, which suits convex ones, and each triangle knows its polygon. Texture coordinates are turned to
//! glTF's way: v grows downwards.
//!
//! Such a file is untrusted input: lengths and indices are checked before they are used.

mod obj;
mod ply;

use std::path::Path;
use std::sync::Arc;

use super::mesh::Mesh;
use crate::diag::Diagnostic;
use crate::files::FileStore;
use crate::math::{Vec2, Vec3, Vec4};

/// Endings of the files that [`read`] reads.
pub const ENDINGS: [&str; 2] = ["obj", "ply"];

/// Reads a mesh.
///
/// # Errors
/// If the file cannot be read, is of another kind, is not what its ending says, or holds no triangle. With the line if it is text.
pub fn read(path: &Path, files: &FileStore) -> Result<Arc<Mesh>, Diagnostic> {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let parse: fn(&Path, &[u8]) -> Result<Polygons, Diagnostic> = match ending.as_str() {
        "obj" => obj::parse,
        "ply" => ply::parse,
        _ => {
            let fault = Diagnostic::error(format!("`{}` is not a kind of mesh that can be read", path.display()));
            let hint = match ending.as_str() {
                "gltf" | "glb" => "for a glTF model write `gltf = …` instead of `mesh = …`",
                _ => "meshes are read from `.obj` and `.ply`, models from `.gltf` and `.glb`",
            };
            return Err(fault.hint(hint));
        }
    };
    let bytes = files.read(path)?;
    files.make((path, "mesh"), &bytes, |bytes| parse(path, bytes)?.mesh(name, path))
}

/// A mesh as it is read: attributes are by vertex, and empty if the file has none.
#[derive(Debug, Default)]
struct Polygons {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    /// v grows upwards.
    uvs: Vec<Vec2>,
    colors: Vec<Vec4>,
    triangles: Vec<[u32; 3]>,
    /// The polygon of each triangle.
    polygons: Vec<u32>,
    polygon_count: u32,
}

impl Polygons {
    /// Adds a polygon of at least three corners.
    fn add(&mut self, corners: &[u32]) {
        for pair in corners.get(1..).unwrap_or_default().windows(2) {
            self.triangles.push([corners[0], pair[0], pair[1]]);
            self.polygons.push(self.polygon_count);
        }
        self.polygon_count += 1;
    }

    fn mesh(self, name: String, path: &Path) -> Result<Mesh, Diagnostic> {
        let fault = |message: String| Err(Diagnostic::error(message).in_file(path));
        if self.triangles.is_empty() {
            return fault("this file has no faces".into());
        }
        if let Some(vertex) = self.positions.iter().position(|position| !position.is_finite()) {
            return fault(format!("the position of vertex {vertex} (from 0) is not a finite number"));
        }
        let only_triangles = self.polygon_count as usize == self.triangles.len();
        let uvs: Vec<Vec2> = self.uvs.into_iter().map(|uv| Vec2::new(uv.x, 1.0 - uv.y)).collect();
        Ok(Mesh {
            name,
            positions: self.positions,
            triangles: self.triangles,
            // One without a length stays so, and the triangle's own stands in for it.
            normals: self.normals.into_iter().map(Vec3::normalize_or_zero).collect(),
            uvs: if uvs.is_empty() { Vec::new() } else { vec![uvs] },
            colors: self.colors,
            polygons: if only_triangles { Vec::new() } else { self.polygons },
            ..Mesh::default()
        })
    }
}
