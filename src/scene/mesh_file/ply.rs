//! Stanford PLY, as text and binary.

use std::path::Path;

use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{Property, PropertyAccess, PropertyAccessResult};

use super::Polygons;
use crate::diag::Diagnostic;
use crate::math::{Vec2, Vec3, Vec4, linear_from_srgb};

/// A vertex with all that may be known of it.
#[derive(Clone, Copy, Debug)]
struct Vertex {
    position: Vec3,
    normal: Vec3,
    uv: Vec2,
    color: Vec4,
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self { position: Vec3::ZERO, normal: Vec3::ZERO, uv: Vec2::ZERO, color: Vec4::ONE }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let target = match name {
            "x" => &mut self.position.x,
            "y" => &mut self.position.y,
            "z" => &mut self.position.z,
            "nx" => &mut self.normal.x,
            "ny" => &mut self.normal.y,
            "nz" => &mut self.normal.z,
            "s" | "u" | "texture_u" => &mut self.uv.x,
            "t" | "v" | "texture_v" => &mut self.uv.y,
            "red" | "r" | "diffuse_red" => &mut self.color.x,
            "green" | "g" | "diffuse_green" => &mut self.color.y,
            "blue" | "b" | "diffuse_blue" => &mut self.color.z,
            "alpha" | "a" => &mut self.color.w,
            _ => return PropertyAccessResult::Ignored,
        };
        let Some(number) = property.to_f32_lossy() else { return PropertyAccessResult::UnsupportedType };
        *target = match property {
            // Bytes are colours as screens show them.
            Property::UChar(byte) if name.starts_with('a') => f32::from(byte) / 255.0,
            Property::UChar(byte) => linear_from_srgb(f32::from(byte) / 255.0),
            _ => number,
        };
        PropertyAccessResult::Set
    }
}

/// The corners of a face.
#[derive(Debug, Default)]
struct Face {
    corners: Vec<i64>,
}

impl PropertyAccess for Face {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        if !matches!(name, "vertex_indices" | "vertex_index") {
            return PropertyAccessResult::Ignored;
        }
        self.corners = match property {
            Property::ListChar(list) => list.into_iter().map(i64::from).collect(),
            Property::ListUChar(list) => list.into_iter().map(i64::from).collect(),
            Property::ListShort(list) => list.into_iter().map(i64::from).collect(),
            Property::ListUShort(list) => list.into_iter().map(i64::from).collect(),
            Property::ListInt(list) => list.into_iter().map(i64::from).collect(),
            Property::ListUInt(list) => list.into_iter().map(i64::from).collect(),
            _ => return PropertyAccessResult::UnsupportedType,
        };
        PropertyAccessResult::Set
    }
}

/// What no mesh is made of.
#[derive(Debug)]
struct Skipped;

impl PropertyAccess for Skipped {
    fn new() -> Self {
        Self
    }
}

pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<Polygons, Diagnostic> {
    let fault = |error: ParseError| Diagnostic::error(error.to_string()).in_file(path);
    let mut reader = Reader::new(bytes);
    let header = Parser::<Skipped>::new().read_header(&mut reader).map_err(fault)?;
    let mut mesh = Polygons::default();
    for (name, element) in &header.elements {
        let has = |names: &[&str]| names.iter().any(|name| element.properties.contains_key(*name));
        match name.as_str() {
            "vertex" => {
                let vertices =
                    Parser::<Vertex>::new().read_payload_for_element(&mut reader, element, &header).map_err(fault)?;
                mesh.positions = vertices.iter().map(|vertex| vertex.position).collect();
                if has(&["nx"]) {
                    mesh.normals = vertices.iter().map(|vertex| vertex.normal).collect();
                }
                if has(&["s", "u", "texture_u"]) {
                    mesh.uvs = vertices.iter().map(|vertex| vertex.uv).collect();
                }
                if has(&["red", "r", "diffuse_red"]) {
                    mesh.colors = vertices.iter().map(|vertex| vertex.color).collect();
                }
            }
            "face" => {
                let faces =
                    Parser::<Face>::new().read_payload_for_element(&mut reader, element, &header).map_err(fault)?;
                let mut corners = Vec::new();
                for (number, face) in faces.iter().enumerate() {
                    let at_fault = |message: String| Err(Diagnostic::error(message).in_file(path));
                    if face.corners.len() < 3 {
                        return at_fault(format!("face {number} (from 0) has {} corners", face.corners.len()));
                    }
                    corners.clear();
                    for corner in &face.corners {
                        match u32::try_from(*corner) {
                            Ok(vertex) if (vertex as usize) < mesh.positions.len() => corners.push(vertex),
                            _ => {
                                let count = mesh.positions.len();
                                return at_fault(format!(
                                    "face {number} (from 0) uses vertex {corner}, but there are {count} before it"
                                ));
                            }
                        }
                    }
                    mesh.add(&corners);
                }
            }
            _ => {
                Parser::<Skipped>::new().read_payload_for_element(&mut reader, element, &header).map_err(fault)?;
            }
        }
    }
    if mesh.triangles.is_empty() && header.elements.contains_key("tristrips") {
        let fault = Diagnostic::error("this file holds triangle strips, which cannot be read").in_file(path);
        return Err(fault.hint("save it with faces"));
    }
    Ok(mesh)
}
