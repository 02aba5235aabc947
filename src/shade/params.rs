//! The parameters of a material, resolved: what its script's `params()` returns, with the material's own values put in.

use std::collections::BTreeMap;
use std::sync::Arc;

use rhai::Dynamic;

use super::fault::Fault;
use super::library::kind;
use super::script::Program;
use crate::diag::{Diagnostic, Diagnostics};
use crate::math::{Vec2, Vec3, Vec4};
use crate::scene::material::{Material, ParamValue};
use crate::scene::texture::TextureRef;

/// A value that a parameter can have.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// `()`: nothing; the default of a texture.
    Unit,
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
    /// A use of a texture.
    Texture(TextureRef),
    /// An object map, for structured defaults such as palettes.
    Record(BTreeMap<String, Value>),
    /// An array, for instance the stops of a ramp.
    Array(Vec<Value>),
}

/// The parameters of one material by name. Cheap to clone.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Params(pub Arc<BTreeMap<String, Value>>);

/// The parameter that bounds the width of a shader's lines, in pixels, whatever `line_width` comes to: wider requests
/// are clamped to it and counted, as those beyond the scene's `max_width` are. A script declares it where the bound
/// cannot be seen from its text; a script may read it like any other, and a material may set it.
pub const MAX_LINE_WIDTH: &str = "max_line_width";

impl Params {
    /// What [`MAX_LINE_WIDTH`] says, if it is declared: a number of at least 0.
    #[must_use]
    pub fn max_line_width(&self) -> Option<f32> {
        #[expect(clippy::cast_precision_loss, reason = "an int counts as the nearest float")]
        match self.0.get(MAX_LINE_WIDTH)? {
            Value::Float(x) => Some(*x),
            Value::Int(x) => Some(*x as f32),
            _ => None,
        }
    }
}

impl Value {
    /// What the value is called in messages.
    pub(super) fn kind(&self) -> &'static str {
        match self {
            Self::Unit | Self::Texture(_) => "a texture",
            Self::Bool(_) => "true or false",
            Self::Int(_) => "an int",
            Self::Float(_) => "a number",
            Self::Vec2(_) => "a vec2 (two numbers)",
            Self::Vec3(_) => "a vec3 or colour (three numbers)",
            Self::Vec4(_) => "a vec4 (four numbers)",
            Self::Text(_) => "a text",
            Self::Record(_) => "a record",
            Self::Array(_) => "an array",
        }
    }

    /// A script's value, if parameters can be such.
    pub(super) fn from_script(value: &Dynamic) -> Option<Self> {
        if value.is_unit() {
            return Some(Self::Unit);
        }
        if let Ok(x) = value.as_bool() {
            return Some(Self::Bool(x));
        }
        if let Ok(x) = value.as_int() {
            return Some(Self::Int(x));
        }
        if let Ok(x) = value.as_float() {
            return Some(Self::Float(x));
        }
        if let Some(v) = value.read_lock::<Vec2>() {
            return Some(Self::Vec2(*v));
        }
        if let Some(v) = value.read_lock::<Vec3>() {
            return Some(Self::Vec3(*v));
        }
        if let Some(v) = value.read_lock::<Vec4>() {
            return Some(Self::Vec4(*v));
        }
        if let Ok(text) = value.as_immutable_string_ref() {
            return Some(Self::Text(text.to_string()));
        }
        if let Ok(array) = value.as_array_ref() {
            return array.iter().map(Self::from_script).collect::<Option<_>>().map(Self::Array);
        }
        let map = value.as_map_ref().ok()?;
        let entries = map.iter().map(|(key, value)| Some((key.to_string(), Self::from_script(value)?)));
        entries.collect::<Option<_>>().map(Self::Record)
    }

    /// Whether it is of a type that attributes can have.
    pub(super) fn can_be_attribute(&self) -> bool {
        !matches!(self, Self::Unit | Self::Texture(_) | Self::Record(_) | Self::Array(_))
    }

    /// A material's value in place of this default, if it is of its type. An int may stand for a float.
    fn replaced_by(&self, given: &ParamValue) -> Option<Self> {
        #[expect(clippy::cast_precision_loss, reason = "an int counts as the nearest float")]
        Some(match (self, given) {
            (Self::Unit, ParamValue::Texture(place)) => Self::Texture(*place),
            (Self::Bool(_), ParamValue::Bool(x)) => Self::Bool(*x),
            (Self::Int(_), ParamValue::Int(x)) => Self::Int(*x),
            (Self::Float(_), ParamValue::Float(x)) => Self::Float(*x),
            (Self::Float(_), ParamValue::Int(x)) => Self::Float(*x as f32),
            (Self::Vec2(_), ParamValue::Vec2(v)) => Self::Vec2(*v),
            (Self::Vec3(_), ParamValue::Vec3(v)) => Self::Vec3(*v),
            (Self::Vec4(_), ParamValue::Vec4(v)) => Self::Vec4(*v),
            (Self::Text(_), ParamValue::Text(text)) => Self::Text(text.clone()),
            _ => return None,
        })
    }
}

/// The defaults of a script from what `params()` returned.
pub(super) fn defaults(program: &Program, returned: &Dynamic) -> Result<BTreeMap<String, Value>, Diagnostics> {
    let Ok(map) = returned.as_map_ref() else {
        let fault = Fault::new(format!("`params` must return a record, but it returned {}", kind(returned)));
        return Err(fault.hint("write: fn params() { #{ ink_width: 2.0 } }").at(program.params_span()).into());
    };
    let mut faults = Diagnostics::default();
    let mut values = BTreeMap::new();
    for (name, value) in map.iter() {
        match Value::from_script(value) {
            Some(value) => {
                values.insert(name.to_string(), value);
            }
            None => faults.push(
                Fault::new(format!("the parameter `{name}` cannot be {}", kind(value)))
                    .hint("parameters are numbers, vectors, texts, true or false, (), and arrays and records of these")
                    .at(program.key_span(name).unwrap_or_else(|| program.params_span())),
            ),
        }
    }
    if faults.has_errors() { Err(faults) } else { Ok(values) }
}

/// The defaults with a material's own values put in.
pub(super) fn resolve(
    mut values: BTreeMap<String, Value>,
    material: &Material,
    program: &Program,
) -> Result<Params, Diagnostics> {
    let mut faults = Diagnostics::default();
    for (name, (given, span)) in &material.params {
        let fault = match values.get_mut(name) {
            None => unknown(name, &values, program),
            Some(value) => match value.replaced_by(given) {
                Some(replaced) => {
                    *value = replaced;
                    continue;
                }
                None => mistyped(name, value, given),
            },
        };
        let fault = fault.hint(format!("the material is `{}`", material.name));
        faults.push(match span.as_ref().or(material.span.as_ref()) {
            Some(span) => fault.at(span.clone()),
            None => fault.hints.into_iter().fold(Diagnostic::error(fault.message), Diagnostic::hint),
        });
    }
    if !faults.has_errors()
        && let Some(value) = values.get(MAX_LINE_WIDTH)
        && let Some(fault) = bad_bound(value)
    {
        // Where it was set, or else where it is declared.
        let set = material.params.get(MAX_LINE_WIDTH).and_then(|(_, span)| span.clone());
        let place = set.or_else(|| program.key_span(MAX_LINE_WIDTH)).unwrap_or_else(|| program.params_span());
        faults.push(fault.at(place));
    }
    if faults.has_errors() { Err(faults) } else { Ok(Params(Arc::new(values))) }
}

fn bad_bound(value: &Value) -> Option<Fault> {
    let fault = match value {
        Value::Int(x) if *x >= 0 => return None,
        Value::Float(x) if *x >= 0.0 => return None,
        Value::Int(x) => Fault::new(format!("`{MAX_LINE_WIDTH}` must be a number of at least 0, but it is {x}")),
        Value::Float(x) => Fault::new(format!("`{MAX_LINE_WIDTH}` must be a number of at least 0, but it is {x}")),
        other => Fault::new(format!("`{MAX_LINE_WIDTH}` must be a number, not {}", other.kind())),
    };
    Some(fault.hint("it bounds the width of this shader's lines, in pixels"))
}

fn unknown(name: &str, values: &BTreeMap<String, Value>, program: &Program) -> Fault {
    let script = &program.source.name;
    let fault = Fault::new(format!("the shader {script} has no parameter `{name}`"));
    if values.is_empty() {
        fault.hint("it has no parameters")
    } else {
        fault.propose(name, values.keys().map(String::as_str))
    }
}

fn mistyped(name: &str, default: &Value, given: &ParamValue) -> Fault {
    let given = match given {
        ParamValue::Bool(_) => "true or false",
        ParamValue::Int(_) => "an int",
        ParamValue::Float(_) => "a number",
        ParamValue::Vec2(_) => "two numbers",
        ParamValue::Vec3(_) => "three numbers",
        ParamValue::Vec4(_) => "four numbers",
        ParamValue::Text(_) => "a text",
        ParamValue::Texture(_) => "a texture",
    };
    let fault = Fault::new(format!("the parameter `{name}` must be {}, not {given}", default.kind()));
    match default {
        Value::Record(_) | Value::Array(_) => fault.hint("only the script itself can set it"),
        _ => fault,
    }
}
