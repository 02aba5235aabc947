//! glTF materials become parameters of the built-in `default` shader, or the shader that their extras name.
//!
//! Base colour, metallic and roughness are always given; other parameters only where they differ from what glTF takes
//! by default, so that the shader's own defaults (which are glTF's) let the plan leave out what is not used.

use std::collections::BTreeMap;

use gltf::json;
use gltf::json::extensions::texture::TextureTransform;
use gltf::json::material::AlphaMode;
use gltf::json::validation::Checked;

use super::document::Document;
use super::extras::{self, Look, On, Param};
use super::report::Report;
use super::texture::Textures;
use crate::diag::Span;
use crate::files::FileStore;
use crate::math::{Affine2, Vec2, Vec3, portable};
use crate::scene::attributes::AttributeSet;
use crate::scene::material::{ParamValue, Script};
use crate::scene::texture::TextureRef;
use crate::shade::builtin;

/// What primitives without a material are made of: glTF's default would be a rough white metal, which nobody means.
const PLAIN_COLOR: Vec3 = Vec3::splat(0.8);

/// A material whose texture ids are those of [`Textures`].
pub(super) struct Draft {
    pub name: String,
    pub script: Script,
    pub params: BTreeMap<String, (ParamValue, Option<Span>)>,
    pub priority: Option<i32>,
    pub dielectric_priority: i32,
    pub double_sided: bool,
    /// Of the material's extras.
    pub attributes: AttributeSet,
}

/// The uv set that a material's normal texture uses, if it has one.
pub(super) fn tangent_set(root: &json::Root, material: Option<usize>) -> Option<usize> {
    let normal = root.materials.get(material?)?.normal_texture.as_ref()?;
    // `KHR_texture_transform` inside a normal texture is plain JSON to the crate.
    let transform = normal.extensions.as_ref().and_then(|extensions| transform_from(&extensions.others));
    Some(transform.and_then(|transform| transform.tex_coord).unwrap_or(normal.tex_coord) as usize)
}

fn transform_from(extensions: &serde_json::Map<String, serde_json::Value>) -> Option<TextureTransform> {
    serde_json::from_value(extensions.get("KHR_texture_transform")?.clone()).ok()
}

/// Makes drafts of materials.
pub(super) struct Drafts<'a> {
    pub document: &'a Document,
    pub files: &'a FileStore,
    pub textures: &'a mut Textures,
    pub report: &'a mut Report,
}

impl Drafts<'_> {
    /// The default material, for primitives that name none.
    pub fn plain(&self, name: String, use_vertex_color: bool) -> Option<Draft> {
        let mut params = BTreeMap::new();
        params.insert("base_color".into(), (ParamValue::Vec3(PLAIN_COLOR), None));
        params.insert("metallic".into(), (ParamValue::Float(0.0), None));
        params.insert("roughness".into(), (ParamValue::Float(1.0), None));
        if use_vertex_color {
            params.insert("use_vertex_color".into(), (ParamValue::Bool(true), None));
        }
        let attributes = AttributeSet::new();
        let script = default_script()?;
        let (priority, dielectric_priority) = (None, 0);
        Some(Draft { name, script, params, priority, dielectric_priority, double_sided: false, attributes })
    }

    /// The draft of a node's shader, which replaces the materials of its mesh. `None` if its extras name none.
    pub fn of_node(&mut self, name: String, look: Look) -> Option<Draft> {
        let script = look.shader?;
        let params = look.params.into_iter().map(|(key, value)| (key, (self.value(value, &name), None))).collect();
        let attributes = AttributeSet::new();
        let (priority, dielectric_priority) = (None, 0);
        Some(Draft { name, script, params, priority, dielectric_priority, double_sided: true, attributes })
    }

    /// The draft of `materials[index]`.
    pub fn of_material(&mut self, index: usize, name: String, use_vertex_color: bool) -> Option<Draft> {
        let document = self.document;
        let json = &document.root.materials[index];
        let place = format!("materials[{index}]");
        let extra = extras::read(&json.extras, On::Material, &place, &document.folder, self.files, self.report);
        // A shader of one's own has parameters of its own; those of the default shader mean nothing to it.
        let is_default =
            extra.look.shader.as_ref().is_none_or(|script| Some(script.source.clone()) == default_source());
        let mut params = BTreeMap::new();
        if is_default {
            let mut surface = Surface { drafts: self, place, wanted_by: format!("material `{name}`"), params };
            surface.read(json);
            params = surface.params;
            if use_vertex_color {
                params.insert("use_vertex_color".into(), (ParamValue::Bool(true), None));
            }
        }
        for (key, value) in extra.look.params {
            let value = self.value(value, &name);
            params.insert(key, (value, None));
        }
        let script = extra.look.shader.or_else(default_script)?;
        let attributes = extras::attributes(&json.extras);
        let (priority, dielectric_priority) = (extra.priority, extra.dielectric_priority);
        let double_sided = json.double_sided;
        Some(Draft { name, script, params, priority, dielectric_priority, double_sided, attributes })
    }

    fn value(&mut self, param: Param, material: &str) -> ParamValue {
        match param {
            Param::Bool(value) => ParamValue::Bool(value),
            Param::Int(value) => ParamValue::Int(value),
            Param::Float(value) => ParamValue::Float(value),
            Param::Vec2(value) => ParamValue::Vec2(value),
            Param::Vec3(value) => ParamValue::Vec3(value),
            Param::Vec4(value) => ParamValue::Vec4(value),
            Param::Text(value) => ParamValue::Text(value),
            Param::Texture(file) => ParamValue::Texture(TextureRef {
                texture: self.textures.of_file(&file, &format!("material `{material}`")),
                uv_set: 0,
                transform: Affine2::IDENTITY,
            }),
        }
    }
}

fn default_source() -> Option<std::sync::Arc<crate::diag::Source>> {
    builtin::source("default")
}

fn default_script() -> Option<Script> {
    Some(Script { source: default_source()?, path: None })
}

/// Reads one material's factors and textures into parameters.
struct Surface<'a, 'b> {
    drafts: &'a mut Drafts<'b>,
    place: String,
    wanted_by: String,
    params: BTreeMap<String, (ParamValue, Option<Span>)>,
}

impl Surface<'_, '_> {
    fn read(&mut self, json: &json::Material) {
        let pbr = &json.pbr_metallic_roughness;
        let [r, g, b, alpha] = pbr.base_color_factor.0;
        self.set("base_color", ParamValue::Vec3(Vec3::new(r, g, b)));
        self.set("metallic", ParamValue::Float(pbr.metallic_factor.0));
        self.set("roughness", ParamValue::Float(pbr.roughness_factor.0));
        self.info("base_color_texture", pbr.base_color_texture.as_ref(), true);
        self.info("metallic_roughness_texture", pbr.metallic_roughness_texture.as_ref(), false);
        if let Some(normal) = &json.normal_texture {
            let transform = normal.extensions.as_ref().and_then(|extensions| transform_from(&extensions.others));
            self.texture("normal_texture", normal.index.value(), normal.tex_coord, transform.as_ref(), false);
            self.number("normal_scale", normal.scale, 1.0);
        }
        if let Some(occlusion) = &json.occlusion_texture {
            let transform = occlusion.extensions.as_ref().and_then(|extensions| transform_from(&extensions.others));
            self.texture("occlusion_texture", occlusion.index.value(), occlusion.tex_coord, transform.as_ref(), false);
            self.number("occlusion_strength", occlusion.strength.0, 1.0);
        }
        self.alpha(json, alpha);
        let extensions = json.extensions.as_ref();
        let strength = extensions.and_then(|e| e.emissive_strength.as_ref()).map_or(1.0, |e| e.emissive_strength.0);
        let emissive = Vec3::from(json.emissive_factor.0) * strength;
        if emissive != Vec3::ZERO {
            self.set("emissive", ParamValue::Vec3(emissive));
            self.info("emissive_texture", json.emissive_texture.as_ref(), true);
        }
        if let Some(extensions) = extensions {
            self.extensions(extensions);
        }
    }

    fn alpha(&mut self, json: &json::Material, alpha: f32) {
        let mode = match json.alpha_mode {
            Checked::Valid(AlphaMode::Opaque) | Checked::Invalid => return,
            Checked::Valid(AlphaMode::Mask) => "mask",
            Checked::Valid(AlphaMode::Blend) => "blend",
        };
        self.set("alpha_mode", ParamValue::Text(mode.into()));
        self.number("alpha", alpha, 1.0);
        if mode == "mask" {
            self.number("alpha_cutoff", json.alpha_cutoff.map_or(0.5, |cutoff| cutoff.0), 0.5);
        }
    }

    fn extensions(&mut self, extensions: &json::extensions::material::Material) {
        if extensions.unlit.is_some() {
            self.set("unlit", ParamValue::Bool(true));
        }
        if let Some(ior) = &extensions.ior {
            self.number("ior", ior.ior.0, 1.5);
        }
        if let Some(transmission) = &extensions.transmission
            && transmission.transmission_factor.0 != 0.0
        {
            self.number("transmission", transmission.transmission_factor.0, 0.0);
            self.info("transmission_texture", transmission.transmission_texture.as_ref(), false);
        }
        if let Some(specular) = &extensions.specular {
            self.number("specular", specular.specular_factor.0, 1.0);
            self.info("specular_texture", specular.specular_texture.as_ref(), false);
            if specular.specular_color_factor.0 != [1.0; 3] || specular.specular_color_texture.is_some() {
                let place = format!("{}.extensions.KHR_materials_specular", self.place);
                self.drafts.report.warning(place, "the colour of specular reflection is not supported; it stays white");
            }
        }
    }

    fn set(&mut self, name: &str, value: ParamValue) {
        let finite = match &value {
            ParamValue::Float(value) => value.is_finite(),
            ParamValue::Vec3(value) => value.is_finite(),
            _ => true,
        };
        if finite {
            self.params.insert(name.into(), (value, None));
        } else {
            self.drafts
                .report
                .error(&self.place, format!("the numbers of its {} must be finite", name.replace('_', " ")));
        }
    }

    fn number(&mut self, name: &str, value: f32, default: f32) {
        if value != default {
            self.set(name, ParamValue::Float(value));
        }
    }

    fn info(&mut self, name: &str, info: Option<&json::texture::Info>, srgb: bool) {
        if let Some(info) = info {
            let transform = info.extensions.as_ref().and_then(|extensions| extensions.texture_transform.as_ref());
            self.texture(name, info.index.value(), info.tex_coord, transform, srgb);
        }
    }

    fn texture(&mut self, name: &str, index: usize, uv_set: u32, transform: Option<&TextureTransform>, srgb: bool) {
        let Drafts { document, textures, report, .. } = &mut *self.drafts;
        let Some(texture) = textures.of_model(&document.root, index, srgb, &self.wanted_by, report) else {
            return;
        };
        let uv_set = transform.and_then(|transform| transform.tex_coord).unwrap_or(uv_set);
        let transform = transform.map_or(Affine2::IDENTITY, affine);
        if !transform.is_finite() {
            report.error(&self.place, format!("the numbers of the transform of its {name} must be finite"));
        }
        let texture = TextureRef { texture, uv_set, transform };
        self.params.insert(name.into(), (ParamValue::Texture(texture), None));
    }
}

/// Offset, then rotation, then scale, as column vectors see it: T · R · S. Positive angles turn uv counter-clockwise as
/// seen on the image, whose v points down (`KHR_texture_transform`).
fn affine(transform: &TextureTransform) -> Affine2 {
    let (sin, cos) = (portable::sin(transform.rotation.0), portable::cos(transform.rotation.0));
    let [scale_u, scale_v] = transform.scale.0;
    Affine2::from_cols(Vec2::new(cos, -sin) * scale_u, Vec2::new(sin, cos) * scale_v, Vec2::from(transform.offset.0))
}
