//! Materials: a script with its parameters.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use super::ids::{ScriptId, TextureId};
use super::settings::LineOverrides;
use super::texture::TextureRef;
use crate::diag::{Source, Span};
use crate::math::{Vec2, Vec3, Vec4};

/// A Rhai script that some material uses. Compiled by [`crate::shade`].
#[derive(Clone, Debug)]
pub struct Script {
    /// The text; its name is how messages call it.
    pub source: Arc<Source>,
    /// Where it was read from; `None` for scripts built into Tusche or made by code.
    pub path: Option<PathBuf>,
}

/// Files that scripts name, found and read when the scene was loaded.
#[derive(Clone, Debug, Default)]
pub struct ScriptFiles {
    /// Modules, by the name of the source that imports them and the path as written there. A file has one name,
    /// whoever imports it.
    pub modules: BTreeMap<(String, String), Arc<Source>>,
    /// Images, as entries of the scene's table of textures.
    pub textures: BTreeMap<TextureKey, TextureId>,
}

/// An image as a script names it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct TextureKey {
    /// Name of the script's source.
    pub script: String,
    /// The path as written.
    pub path: String,
    /// `repeat`, `mirror` or `clamp`.
    pub wrap: String,
    /// `srgb` or `linear`.
    pub color: String,
}

/// A parameter's value as written in a scene file or a model.
#[derive(Clone, Debug, PartialEq)]
pub enum ParamValue {
    /// `true` or `false`.
    Bool(bool),
    /// A whole number.
    Int(i64),
    /// A number.
    Float(f32),
    /// Two numbers.
    Vec2(Vec2),
    /// Three numbers: a vector or a linear colour.
    Vec3(Vec3),
    /// Four numbers.
    Vec4(Vec4),
    /// A text.
    Text(String),
    /// A texture.
    Texture(TextureRef),
}

/// A script with parameters. Each material is one "shader" to the line test of that name.
#[derive(Clone, Debug)]
pub struct Material {
    /// Its name in the scene file or the model.
    pub name: String,
    /// The script.
    pub script: ScriptId,
    /// Values that replace the defaults of the script's `params()`, each with the place that set it.
    pub params: BTreeMap<String, (ParamValue, Option<Span>)>,
    /// Priority of its surfaces where neither the script nor the object gives one.
    pub priority: Option<i32>,
    /// Which of overlapping bodies fills the space that they share: the one with the larger number.
    pub dielectric_priority: i32,
    /// Whether surfaces are seen from behind. Single-sided surfaces are invisible from behind to camera, reflection
    /// and refraction rays, but cast shadows.
    pub double_sided: bool,
    /// What it changes about the line tests.
    pub lines: LineOverrides,
    /// Where it was declared.
    pub span: Option<Span>,
}
