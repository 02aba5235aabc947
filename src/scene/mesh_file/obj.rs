//! Wavefront OBJ.

use std::collections::HashMap;
use std::path::Path;

use obj::{IndexTuple, LoadConfig, ObjData, ObjError};

use super::Polygons;
use crate::diag::{Diagnostic, Source, Span};
use crate::math::{Vec2, Vec3};

pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<Polygons, Diagnostic> {
    // Commands of other programs say nothing about the shape.
    let data = ObjData::load_buf_with_config(bytes, LoadConfig { strict: false })
        .map_err(|error| fault(path, bytes, &error))?;
    let faces = || data.objects.iter().flat_map(|object| &object.groups).flat_map(|group| &group.polys);
    let corners = || faces().flat_map(|face| &face.0);
    // What some corners lack, the mesh lacks, but for texture coordinates.
    let has_normals = corners().all(|corner| corner.2.is_some());
    let has_uvs = corners().any(|corner| corner.1.is_some());
    let mut mesh = Polygons::default();
    let mut known: HashMap<IndexTuple, u32> = HashMap::new();
    let mut polygon = Vec::new();
    for (number, face) in faces().enumerate() {
        if face.0.len() < 3 {
            let message = format!("face {} (from 1) has {} corners", number + 1, face.0.len());
            return Err(Diagnostic::error(message).in_file(path).hint("a face has at least three"));
        }
        polygon.clear();
        for corner in &face.0 {
            let IndexTuple(position, uv, normal) = *corner;
            let normal = normal.filter(|_| has_normals);
            let vertex = match known.get(&IndexTuple(position, uv, normal)) {
                Some(vertex) => *vertex,
                None => {
                    let missing = |what: &str, index: usize, count: usize| {
                        // Counted back from the last, it may lie before the first.
                        let which = isize::try_from(index).map_or_else(
                            |_| format!("a {what} before the first"),
                            |index| format!("{what} {}", index.saturating_add(1)),
                        );
                        let message = format!("face {} (from 1) uses {which}, but there are {count}", number + 1);
                        Diagnostic::error(message).in_file(path)
                    };
                    let at = |what, list: &[[f32; 3]], index: usize| {
                        list.get(index).copied().ok_or_else(|| missing(what, index, list.len()))
                    };
                    let vertex = mesh.positions.len() as u32;
                    mesh.positions.push(Vec3::from(at("vertex", &data.position, position)?));
                    if let Some(normal) = normal {
                        mesh.normals.push(Vec3::from(at("normal", &data.normal, normal)?));
                    }
                    if has_uvs {
                        let uv = match uv {
                            Some(uv) => *data
                                .texture
                                .get(uv)
                                .ok_or_else(|| missing("texture coordinate", uv, data.texture.len()))?,
                            None => [0.0; 2],
                        };
                        mesh.uvs.push(Vec2::from(uv));
                    }
                    known.insert(IndexTuple(position, uv, normal), vertex);
                    vertex
                }
            };
            polygon.push(vertex);
        }
        mesh.add(&polygon);
    }
    Ok(mesh)
}

/// What is wrong, at its line.
fn fault(path: &Path, bytes: &[u8], error: &ObjError) -> Diagnostic {
    let (line, message) = match error {
        ObjError::Io(error) => return Diagnostic::error(error.to_string()).in_file(path),
        ObjError::MalformedFaceGroup { line_number, group } => {
            (line_number, format!("`{group}` is no corner of a face"))
        }
        ObjError::ArgumentListFailure { line_number, list } => (line_number, format!("`{list}` should be numbers")),
        ObjError::UnexpectedCommand { line_number, command } => (line_number, format!("`{command}` is not known")),
        ObjError::MissingMTLName { line_number } => (line_number, "`mtllib` without a name".to_owned()),
        ObjError::ZeroVertexNumber { line_number } => (line_number, "vertices are counted from 1".to_owned()),
    };
    let source = Source::new(path.display().to_string(), String::from_utf8_lossy(bytes));
    Diagnostic::error(message).at(Span::word_at(&source, (*line).max(1), 1))
}
