//! What an exporter may add for Tusche: `extras.tusche` on materials and nodes.
//!
//! On a material: `{ "shader": "ink.rhai", "params": { "ink_width": 2.5 }, "priority": 3,
//! "dielectric_priority": 1 }`. On a node, also
//! `"lines": false` and `"group": "car"`; a node's shader replaces all materials of its mesh. What a node says does not reach its children.
//!
//! A shader is a path relative to the model, or `builtin:NAME`. Parameters are written as in a scene file: booleans,
//! numbers, arrays of two to four numbers, texts, and textures as
//! `{ "texture": "noise.png", "srgb": false, "wrap": "clamp", "filter": "nearest" }`. The record may also be a text that
//! holds this JSON, which is all that some exporters can write.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use gltf::json::Extras;
use serde_json::{Map, Value};

use super::report::Report;
use crate::diag::nearest;
use crate::files::FileStore;
use crate::math::{Vec2, Vec3, Vec4};
use crate::scene::attributes::{Attribute, AttributeSet};
use crate::scene::material::Script;
use crate::scene::texture::{TextureFilter, Wrap};
use crate::shade::builtin;

/// A material as the extras describe it.
#[derive(Clone, Debug, Default)]
pub(super) struct Look {
    pub shader: Option<Script>,
    pub params: BTreeMap<String, Param>,
}

/// A parameter; textures are not yet decoded.
#[derive(Clone, Debug)]
pub(super) enum Param {
    Bool(bool),
    Int(i64),
    Float(f32),
    Vec2(Vec2),
    Vec3(Vec3),
    Vec4(Vec4),
    Text(String),
    Texture(TextureFile),
}

/// A texture from a file of its own.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TextureFile {
    pub path: PathBuf,
    pub srgb: bool,
    pub wrap: Wrap,
    pub filter: TextureFilter,
}

/// What the extras of a material or node say.
#[derive(Clone, Debug, Default)]
pub(super) struct Extra {
    pub look: Look,
    pub priority: Option<i32>,
    pub dielectric_priority: i32,
    pub lines: Option<bool>,
    pub group: Option<String>,
}

/// Where extras are found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum On {
    Material,
    Node,
}

impl On {
    fn keys(self) -> &'static [&'static str] {
        match self {
            Self::Material => &["shader", "params", "priority", "dielectric_priority"],
            Self::Node => &["shader", "params", "priority", "lines", "group"],
        }
    }
}

const WHOLE: &str = "expected a whole number from −2147483648 to 2147483647";

fn whole(value: &Value) -> Option<i32> {
    value.as_i64().and_then(|number| i32::try_from(number).ok())
}

/// Reads the extras at `place`. What is wrong is reported and left out.
pub(super) fn read(
    extras: &Extras,
    on: On,
    place: &str,
    folder: &Path,
    files: &FileStore,
    report: &mut Report,
) -> Extra {
    let place = format!("{place}.extras.tusche");
    let mut extra = Extra::default();
    let Some(record) = record(extras, &place, report) else {
        return extra;
    };
    for (key, value) in &record {
        let place = format!("{place}.{key}");
        match (key.as_str(), value) {
            ("shader", Value::String(shader)) => match script(shader, folder, files) {
                Ok(script) => extra.look.shader = Some(script),
                Err(message) => report.error(place, message),
            },
            ("shader", _) => report.error(place, "expected a text: a path, or builtin:NAME"),
            ("params", Value::Object(params)) => {
                for (name, value) in params {
                    let place = format!("{place}.{name}");
                    match param(value, folder) {
                        Ok(value) => _ = extra.look.params.insert(name.clone(), value),
                        Err(message) => report.error(place, message),
                    }
                }
            }
            ("params", _) => report.error(place, "expected a record of parameters"),
            ("priority", value) => match whole(value) {
                Some(priority) => extra.priority = Some(priority),
                None => report.error(place, WHOLE),
            },
            ("dielectric_priority", value) if on == On::Material => match whole(value) {
                Some(priority) => extra.dielectric_priority = priority,
                None => report.error(place, WHOLE),
            },
            ("lines", value) if on == On::Node => match value.as_bool() {
                Some(lines) => extra.lines = Some(lines),
                None => report.error(place, "expected true or false"),
            },
            ("group", Value::String(group)) if on == On::Node && !group.is_empty() => extra.group = Some(group.clone()),
            ("group", _) if on == On::Node => report.error(place, "expected the name of a group"),
            _ => report.error(place, unknown(key, on.keys())),
        }
    }
    if on == On::Node && extra.look.shader.is_none() && !extra.look.params.is_empty() {
        report.error(place, "a node with `params` needs a `shader` too");
    }
    extra
}

/// The attributes that extras hold beside what is meant for Tusche: numbers, arrays of two to four numbers, texts and
/// switches. Other values are left to whoever wrote them.
pub(super) fn attributes(extras: &Extras) -> AttributeSet {
    let record = extras.as_ref().and_then(|extras| serde_json::from_str::<Map<String, Value>>(extras.get()).ok());
    let entries = record.into_iter().flatten().filter(|(key, _)| key != "tusche");
    entries.filter_map(|(key, value)| Some((key, attribute(&value)?))).collect()
}

fn attribute(value: &Value) -> Option<Attribute> {
    match value {
        Value::Bool(value) => Some(Attribute::Bool(*value)),
        Value::String(text) => Some(Attribute::Text(text.clone())),
        Value::Number(number) => match number.as_i64() {
            Some(whole) => Some(Attribute::Int(whole)),
            None => Some(Attribute::Float(float(number.as_f64()).ok()?)),
        },
        Value::Array(numbers) => {
            let numbers: Option<Vec<f32>> = numbers.iter().map(|number| float(number.as_f64()).ok()).collect();
            match numbers?[..] {
                [x, y] => Some(Attribute::Vec2(Vec2::new(x, y))),
                [x, y, z] => Some(Attribute::Vec3(Vec3::new(x, y, z))),
                [x, y, z, w] => Some(Attribute::Vec4(Vec4::new(x, y, z, w))),
                _ => None,
            }
        }
        Value::Object(_) | Value::Null => None,
    }
}

fn unknown(key: &str, known: &[&str]) -> String {
    match nearest(key, known.iter().copied()) {
        Some(near) => format!("unknown key; did you mean `{near}`?"),
        None => format!("unknown key; there are {}", known.join(", ")),
    }
}

fn record(extras: &Extras, place: &str, report: &mut Report) -> Option<Map<String, Value>> {
    let extras: Value = serde_json::from_str(extras.as_ref()?.get()).ok()?;
    let record = match extras.get("tusche")? {
        Value::String(text) => match serde_json::from_str(text) {
            Ok(record) => record,
            Err(error) => return report.fail(place, format!("this text is not JSON: {error}")),
        },
        record => record.clone(),
    };
    match record {
        Value::Object(record) => Some(record),
        _ => report.fail(place, "expected a record such as {\"shader\": \"ink.rhai\"}"),
    }
}

fn script(shader: &str, folder: &Path, files: &FileStore) -> Result<Script, String> {
    if let Some(name) = shader.strip_prefix("builtin:") {
        let known = builtin::names();
        return match (builtin::source(name), nearest(name, known.iter().copied())) {
            (Some(source), _) => Ok(Script { source, path: None }),
            (None, Some(near)) => Err(format!("there is no built-in shader `{name}`; did you mean `{near}`?")),
            (None, None) => Err(format!("there is no built-in shader `{name}`; there are {}", known.join(", "))),
        };
    }
    let path = folder.join(shader);
    match files.read_text(&path) {
        Ok(source) => Ok(Script { source, path: Some(path) }),
        Err(fault) => Err(format!("{}: {}", path.display(), fault.message)),
    }
}

fn param(value: &Value, folder: &Path) -> Result<Param, String> {
    match value {
        Value::Bool(value) => Ok(Param::Bool(*value)),
        Value::String(text) => Ok(Param::Text(text.clone())),
        Value::Number(number) => match (number.as_i64(), number.as_f64()) {
            (Some(whole), _) => Ok(Param::Int(whole)),
            (None, value) => Ok(Param::Float(float(value)?)),
        },
        Value::Array(numbers) => {
            let numbers: Vec<f32> = numbers.iter().map(|number| float(number.as_f64())).collect::<Result<_, _>>()?;
            match numbers[..] {
                [x, y] => Ok(Param::Vec2(Vec2::new(x, y))),
                [x, y, z] => Ok(Param::Vec3(Vec3::new(x, y, z))),
                [x, y, z, w] => Ok(Param::Vec4(Vec4::new(x, y, z, w))),
                _ => Err(format!("a vector has two to four numbers, this has {}", numbers.len())),
            }
        }
        Value::Object(record) => texture(record, folder).map(Param::Texture),
        Value::Null => Err("expected a value".into()),
    }
}

fn float(value: Option<f64>) -> Result<f32, String> {
    let value = value.ok_or("expected a number")? as f32;
    if value.is_finite() { Ok(value) } else { Err("this number is too large".into()) }
}

fn texture(record: &Map<String, Value>, folder: &Path) -> Result<TextureFile, String> {
    let mut path = None;
    let (mut srgb, mut wrap, mut filter) = (true, Wrap::default(), TextureFilter::default());
    for (key, value) in record {
        match (key.as_str(), value.as_str(), value.as_bool()) {
            ("texture", Some(file), _) => path = Some(folder.join(file)),
            ("srgb", _, Some(value)) => srgb = value,
            ("wrap", Some("repeat"), _) => wrap = Wrap::Repeat,
            ("wrap", Some("mirror"), _) => wrap = Wrap::Mirror,
            ("wrap", Some("clamp"), _) => wrap = Wrap::Clamp,
            ("filter", Some("nearest"), _) => filter = TextureFilter::Nearest,
            ("filter", Some("linear"), _) => filter = TextureFilter::Linear,
            ("filter", Some("mipmap"), _) => filter = TextureFilter::Mipmap,
            ("texture", ..) => return Err("texture: expected the path of an image".into()),
            ("srgb", ..) => return Err("srgb: expected true or false".into()),
            ("wrap", ..) => return Err("wrap: expected \"repeat\", \"mirror\" or \"clamp\"".into()),
            ("filter", ..) => return Err("filter: expected \"nearest\", \"linear\" or \"mipmap\"".into()),
            _ => return Err(format!("{key}: {}", unknown(key, &["texture", "srgb", "wrap", "filter"]))),
        }
    }
    let path = path.ok_or("a record is a texture and needs `texture`, the path of an image")?;
    Ok(TextureFile { path, srgb, wrap, filter })
}
