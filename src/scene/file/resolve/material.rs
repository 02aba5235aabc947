//! Materials: scripts, parameters, textures.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, OnceLock};

use super::super::document::Node;
use super::super::format;
use super::{Resolver, unknown_name};
use crate::diag::{Diagnostic, Span};
use crate::math::{Affine2, Vec2, Vec3, Vec4};
use crate::scene::ids::{MaterialId, ScriptId};
use crate::scene::material::{Material, ParamValue, Script};
use crate::scene::settings::LineOverrides;
use crate::scene::texture::{self, Image, Texture, TextureFilter, TextureRef, Wrap};
use crate::shade::builtin;

/// What a script's name starts with if it comes with Tusche.
pub(in crate::scene::file) const BUILTIN: &str = "builtin:";

impl Resolver<'_> {
    pub(super) fn materials(&mut self, materials: &BTreeMap<String, format::Material>) {
        let Some(table) = self.node.get("materials").and_then(Node::table) else { return };
        // In the order of writing: ids, and with them colours in debug views, then follow the file.
        for entry in &table.entries {
            let Some(material) = materials.get(&entry.key) else { continue };
            let Some(script) = self.script(&material.shader, &entry.node.span_of("shader")) else { continue };
            let params = self.params(&material.params, entry.node.get("params"));
            let lines_node = entry.node.get("lines").unwrap_or(&entry.node);
            let lines = self.line_overrides(&material.lines, &format!("materials.{}.lines", entry.key), lines_node);
            let id = self.scene.add_material(Material {
                name: entry.key.clone(),
                script,
                params,
                priority: material.priority,
                dielectric_priority: material.dielectric_priority,
                double_sided: material.double_sided,
                lines,
                span: Some(entry.key_span.clone()),
            });
            self.materials.push((entry.key.clone(), id));
        }
    }

    /// The material that an object asks for by name.
    pub(super) fn material(&mut self, name: &str, span: &Span) -> Option<MaterialId> {
        let known = self.materials.iter().find(|(known, _)| known == name).map(|(_, id)| *id);
        if known.is_none() {
            let written = self.node.get("materials").and_then(Node::table);
            let entries = written.into_iter().flat_map(|table| &table.entries).map(|entry| entry.key.as_str());
            let dropped = written.into_iter().flat_map(|table| &table.dropped).map(String::as_str);
            let names = entries.chain(dropped);
            // A material that is there but faulty has been reported.
            if !names.clone().any(|known| known == name) {
                self.faults.push(unknown_name("material", name, names).at(span.clone()));
            }
        }
        known
    }

    /// What objects without a material get: matte grey, by the script that shows models.
    pub(super) fn default_material(&mut self) -> MaterialId {
        *self.default_material.get_or_insert_with(|| {
            let source = builtin::source("default").expect("the default shader comes with Tusche");
            let script = self.scene.add_script(Script { source, path: None });
            self.scene.add_material(Material {
                name: "default".to_owned(),
                script,
                params: BTreeMap::new(),
                priority: None,
                dielectric_priority: 0,
                double_sided: true,
                lines: LineOverrides::default(),
                span: None,
            })
        })
    }

    fn script(&mut self, written: &str, span: &Span) -> Option<ScriptId> {
        let script = if let Some(name) = written.strip_prefix(BUILTIN) {
            let Some(source) = builtin::source(name) else {
                let fault = unknown_name("built-in shader", name, builtin::names().iter().copied());
                self.faults.push(fault.at(span.clone()));
                return None;
            };
            Script { source, path: None }
        } else {
            let path = self.path(written, span);
            let read = self.context.files.read_text(&path);
            let source = read.map_err(|fault| self.faults.push(about_file(fault, span))).ok()?;
            Script { source, path: Some(path) }
        };
        Some(self.scene.add_script(script))
    }

    fn params(
        &mut self,
        params: &BTreeMap<String, format::Param>,
        node: Option<&Node>,
    ) -> BTreeMap<String, (ParamValue, Option<Span>)> {
        let mut resolved = BTreeMap::new();
        for (name, param) in params {
            let node = node.and_then(|node| node.get(name));
            let value = match param {
                format::Param::Bool(value) => ParamValue::Bool(*value),
                format::Param::Int(value) => ParamValue::Int(*value),
                format::Param::Float(value) => ParamValue::Float(*value as f32),
                format::Param::Vector(values) => match values[..] {
                    [x, y] => ParamValue::Vec2(Vec2::new(x as f32, y as f32)),
                    [x, y, z] => ParamValue::Vec3(Vec3::new(x as f32, y as f32, z as f32)),
                    [x, y, z, w] => ParamValue::Vec4(Vec4::new(x as f32, y as f32, z as f32, w as f32)),
                    _ => continue,
                },
                format::Param::Text(text) => ParamValue::Text(text.clone()),
                format::Param::Texture(written) => {
                    let format::Texture { texture, wrap, filter, srgb } = written;
                    match self.texture((texture, "texture"), *wrap, *filter, *srgb, node) {
                        Some(texture) => ParamValue::Texture(texture),
                        None => continue,
                    }
                }
                format::Param::File(written) => {
                    let format::TextureFile { file, wrap, filter, color } = written;
                    let srgb = matches!(color, format::Encoding::Srgb);
                    match self.texture((file, "file"), *wrap, *filter, srgb, node) {
                        Some(texture) => ParamValue::Texture(texture),
                        None => continue,
                    }
                }
            };
            resolved.insert(name.clone(), (value, node.map(|node| node.span.clone())));
        }
        resolved
    }

    /// A texture from a path, with the key that it is written at.
    fn texture(
        &mut self,
        (written, key): (&str, &str),
        wrap: format::Wrap,
        filter: format::TextureFilter,
        srgb: bool,
        node: Option<&Node>,
    ) -> Option<TextureRef> {
        let span = node?.span_of(key);
        let path = self.path(written, &span);
        let image = self.image(&path, srgb, &span)?;
        let wrap = match wrap {
            format::Wrap::Repeat => Wrap::Repeat,
            format::Wrap::Mirror => Wrap::Mirror,
            format::Wrap::Clamp => Wrap::Clamp,
        };
        let filter = match filter {
            format::TextureFilter::Nearest => TextureFilter::Nearest,
            format::TextureFilter::Linear => TextureFilter::Linear,
            format::TextureFilter::Mipmap => TextureFilter::Mipmap,
        };
        let texture = Texture { name: written.to_owned(), image, wrap: [wrap; 2], filter, levels: OnceLock::new() };
        Some(TextureRef { texture: self.scene.add_texture(texture), uv_set: 0, transform: Affine2::IDENTITY })
    }

    /// Reads and decodes an image, once for each path and encoding.
    pub(super) fn image(&mut self, path: &Path, srgb: bool, span: &Span) -> Option<Arc<Image>> {
        if let Some((.., image)) = self.images.iter().find(|(known, coded, _)| known == path && *coded == srgb) {
            return Some(Arc::clone(image));
        }
        let files = self.context.files;
        let read = files.read(path).and_then(|bytes| texture::read_image(path, &bytes, srgb, files));
        let image = read.map_err(|fault| self.faults.push(about_file(fault, span))).ok()?;
        self.images.push((path.to_owned(), srgb, Arc::clone(&image)));
        Some(image)
    }
}

/// A fault of a file, at the place that names the file.
pub(super) fn about_file(fault: Diagnostic, span: &Span) -> Diagnostic {
    match fault.file {
        // One-line messages show either a place or a file: say both.
        Some(path) if fault.span.is_none() => {
            Diagnostic { message: format!("{}: {}", path.display(), fault.message), file: None, ..fault }
                .at(span.clone())
        }
        _ => fault,
    }
}
