//! Controls: what of a scene can be turned while watching, with names, ranges and present values. They are made from
//! the schema of scene files and from the scripts' `params()`, so that nothing can be forgotten here.

use std::sync::LazyLock;

use serde::Serialize;
use serde_json::{Value as Json, json};

use super::edit::{Edits, KeyPath};
use crate::scene::{Scene, file};
use crate::shade::params::Value;
use crate::shade::{Shader, Shaders};

/// Controls that belong together.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ControlGroup {
    /// Its title, such as `lines` or a material's name.
    pub title: String,
    /// What it is about: the script of a material, for instance.
    pub about: String,
    /// The controls, in the order of the schema or of names.
    pub controls: Vec<Control>,
}

/// One value that can be changed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Control {
    /// Where it stands in the scene file.
    pub path: KeyPath,
    /// What it is, in a sentence or two; may be empty.
    pub help: String,
    /// What kind of value it takes.
    #[serde(flatten)]
    pub kind: Kind,
    /// The present value; null if nothing is said.
    pub value: Json,
    /// The value without any word of the scene file; null if there is none.
    pub default: Json,
    /// Whether an edit gives the present value.
    pub edited: bool,
}

/// What kind of value a control takes.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Kind {
    /// True or false.
    Bool,
    /// A number.
    Number(Range),
    /// A whole number.
    Integer(Range),
    /// A number, or false.
    Threshold(Range),
    /// A linear colour of three components.
    Color,
    /// So many numbers.
    Vector {
        /// How many.
        length: usize,
    },
    /// One of some words.
    Choice {
        /// The words.
        options: Vec<String>,
    },
    /// Any of some words.
    Set {
        /// The words.
        options: Vec<String>,
    },
    /// A list of names.
    Names,
    /// A text.
    Text,
    /// Something that is shown but cannot be changed here, such as a texture.
    Fixed,
}

/// Bounds of a number.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Range {
    /// What a slider covers.
    pub slider: [f64; 2],
    /// The least value that is allowed.
    pub min: Option<f64>,
    /// The largest value that is allowed.
    pub max: Option<f64>,
}

static SCHEMA: LazyLock<Json> = LazyLock::new(file::schema);

/// Keys of `[render]` that matter while a look is found; the others make another picture.
const RENDER: [&str; 5] = ["samples", "sampler", "ambient", "filter", "filter_radius"];

/// The controls of a scene. `written` is what its file says, with overrides and edits put in.
#[must_use]
pub fn controls(written: &Json, scene: &Scene, shaders: &Shaders, edits: &Edits) -> Vec<ControlGroup> {
    let mut groups = Vec::new();
    let mut lines = Vec::new();
    of_object(&SCHEMA["$defs"]["Lines"], &["lines".into()], written, edits, &mut lines);
    groups.push(ControlGroup {
        title: "lines".into(),
        about: "where scripts do not say otherwise".into(),
        controls: lines,
    });
    // A material of a model stands in no scene file, so there is no place for its values.
    let has_place = |name: &str| written["materials"].get(name).is_some();
    for (material, shader) in scene.materials().iter().zip(shaders.iter()).filter(|(m, _)| has_place(&m.name)) {
        let mut controls = of_shader(shader, edits);
        let path = ["materials".into(), material.name.clone(), "lines".into()];
        of_object(&SCHEMA["$defs"]["MaterialLines"], &path, written, edits, &mut controls);
        groups.push(ControlGroup { title: material.name.clone(), about: shader.script().to_owned(), controls });
    }
    let mut render = Vec::new();
    of_object(&SCHEMA["$defs"]["Render"], &["render".into()], written, edits, &mut render);
    render.retain(|control| RENDER.contains(&control.path[1].as_str()));
    groups.push(ControlGroup { title: "render".into(), about: "sampling and filter".into(), controls: render });
    groups
}

/// The controls of all keys of a table, those of tables in it included.
fn of_object(schema: &Json, path: &[String], written: &Json, edits: &Edits, controls: &mut Vec<Control>) {
    let Some(properties) = schema["properties"].as_object() else { return };
    for (key, property) in properties {
        let mut path = path.to_vec();
        path.push(key.clone());
        let resolved = resolved(property);
        if resolved["type"] == "object" {
            of_object(resolved, &path, written, edits, controls);
            continue;
        }
        let default = property.get("default").cloned().unwrap_or(Json::Null);
        let value = value_at(written, &path).unwrap_or(&default).clone();
        let Some(kind) = kind_of(property, &path, &default) else { continue };
        let help = property["description"].as_str().unwrap_or("").to_owned();
        controls.push(Control { edited: edits.paths().any(|known| *known == path), path, help, kind, value, default });
    }
}

fn value_at<'a>(written: &'a Json, path: &[String]) -> Option<&'a Json> {
    path.iter().try_fold(written, |node, key| node.get(key))
}

/// What a schema's reference stands for, if it is one.
fn resolved(schema: &Json) -> &Json {
    let reference = schema["$ref"].as_str().and_then(|reference| reference.strip_prefix("#/$defs/"));
    reference.map_or(schema, |name| &SCHEMA["$defs"][name])
}

fn kind_of(property: &Json, path: &[String], default: &Json) -> Option<Kind> {
    let schema = resolved(property);
    if property["$ref"] == "#/$defs/Color" {
        return Some(Kind::Color);
    }
    if let Some(options) = schema["anyOf"].as_array() {
        // A test that is off, or a number; or, of light, a shade of grey or a colour.
        let number = options.iter().find(|option| option["type"] == "number")?;
        return Some(match options.iter().any(|option| option["$ref"] == "#/$defs/Color") {
            true => Kind::Color,
            false => Kind::Threshold(range_of(number, path, default)),
        });
    }
    if let Some(options) = words(schema) {
        return Some(Kind::Choice { options });
    }
    Some(match schema["type"].as_str()? {
        "boolean" => Kind::Bool,
        "number" => Kind::Number(range_of(schema, path, default)),
        "integer" => Kind::Integer(range_of(schema, path, default)),
        "string" => Kind::Text,
        "array" => match words(resolved(&schema["items"])) {
            Some(options) => Kind::Set { options },
            None if schema["items"]["type"] == "string" => Kind::Names,
            None => return None,
        },
        _ => return None,
    })
}

/// The words that a schema allows, if it lists words.
fn words(schema: &Json) -> Option<Vec<String>> {
    let of = |value: &Json| value.as_str().map(str::to_owned);
    if let Some(words) = schema["enum"].as_array() {
        return words.iter().map(of).collect();
    }
    schema["oneOf"].as_array()?.iter().map(|option| of(&option["const"])).collect()
}

/// The slider of a line setting covers what is of use, the number beside it all that is allowed.
fn range_of(schema: &Json, path: &[String], default: &Json) -> Range {
    let min = schema["minimum"].as_f64().or_else(|| schema["exclusiveMinimum"].as_f64());
    let max = schema["maximum"].as_f64();
    let last = path.last().map_or("", String::as_str);
    let top = match last {
        "width" | "min_width" => 16.0,
        "max_width" => 64.0,
        "normal" => 180.0,
        "overlap" => 10.0,
        "uv" | "feature" | "opacity" => 1.0,
        "samples" => 64.0,
        "surfaces" => 8.0,
        "filter_radius" => 4.0,
        _ => default.as_f64().map_or(1.0, |default| nice_above(2.0 * default.abs())),
    };
    Range { slider: [min.unwrap_or(0.0), max.map_or(top, |max| max.min(top))], min, max }
}

/// The least of 1, 2, 5, 10, 20, … that is not below a number.
fn nice_above(number: f64) -> f64 {
    let mut step = 1e-6;
    loop {
        for nice in [1.0, 2.0, 5.0] {
            if nice * step >= number || step > 1e12 {
                return nice * step;
            }
        }
        step *= 10.0;
    }
}

/// The parameters of a material's script.
fn of_shader(shader: &Shader, edits: &Edits) -> Vec<Control> {
    let control = |(name, value): (&String, &Value)| {
        let path = vec!["materials".into(), shader.name().to_owned(), "params".into(), name.clone()];
        let default = shader.default_of(name).unwrap_or(value);
        let help = shader.note_of(name).unwrap_or_default();
        Control {
            edited: edits.paths().any(|known| *known == path),
            path,
            kind: kind_of_parameter(name, default, &help),
            help,
            value: json_of(value),
            default: json_of(default),
        }
    };
    shader.params().0.iter().map(control).collect()
}

fn kind_of_parameter(name: &str, default: &Value, note: &str) -> Kind {
    let range = |default: f64| {
        let slider = declared_range(note).unwrap_or_else(|| match default {
            d if (0.0..=1.0).contains(&d) => [0.0, 1.0],
            d if d > 0.0 => [0.0, nice_above(2.0 * d)],
            d => [-nice_above(-2.0 * d), nice_above(-2.0 * d)],
        });
        Range { slider, min: None, max: None }
    };
    match default {
        Value::Bool(_) => Kind::Bool,
        #[expect(clippy::cast_precision_loss, reason = "a slider needs no more")]
        Value::Int(default) => {
            let Range { slider: [low, high], .. } = range(*default as f64);
            Kind::Integer(Range { slider: [low, high.max(10.0)], min: None, max: None })
        }
        Value::Float(default) => Kind::Number(range(f64::from(*default))),
        Value::Vec2(_) => Kind::Vector { length: 2 },
        Value::Vec3(value) if value.min_element() >= 0.0 && !is_named_as_vector(name) => Kind::Color,
        Value::Vec3(_) => Kind::Vector { length: 3 },
        Value::Vec4(_) => Kind::Vector { length: 4 },
        Value::Text(_) => Kind::Text,
        Value::Unit | Value::Texture(_) | Value::Record(_) | Value::Array(_) => Kind::Fixed,
    }
}

/// Colours and vectors have one type; names tell them apart.
fn is_named_as_vector(name: &str) -> bool {
    const WORDS: [&str; 12] = [
        "direction",
        "dir",
        "axis",
        "normal",
        "position",
        "offset",
        "scale",
        "origin",
        "up",
        "center",
        "frequency",
        "size",
    ];
    name.split('_').any(|part| WORDS.contains(&part))
}

/// The range that a parameter's comment declares, as in `// pixels, 0 … 12`: two numbers with `…`, `...` or `..` between.
fn declared_range(note: &str) -> Option<[f64; 2]> {
    let (at, dots) = ["…", "...", ".."].iter().find_map(|dots| Some((note.find(dots)?, dots)))?;
    let is_number = |c: char| c.is_ascii_digit() || "+-.e".contains(c);
    let before = note[..at].trim_end();
    let start = before
        .rfind(|c| !is_number(c))
        .map_or(0, |place| place + before[place..].chars().next().map_or(1, char::len_utf8));
    let after = note[at + dots.len()..].trim_start();
    let end = after.find(|c| !is_number(c)).unwrap_or(after.len());
    let [low, high] = [&before[start..], after[..end].trim_end_matches('.')].map(|text| text.parse::<f64>().ok());
    Some([low?, high?]).filter(|[low, high]| low < high && low.is_finite() && high.is_finite())
}

fn json_of(value: &Value) -> Json {
    match value {
        Value::Unit => Json::Null,
        Value::Bool(x) => (*x).into(),
        Value::Int(x) => (*x).into(),
        Value::Float(x) => short(*x),
        Value::Vec2(v) => v.to_array().map(short).to_vec().into(),
        Value::Vec3(v) => v.to_array().map(short).to_vec().into(),
        Value::Vec4(v) => v.to_array().map(short).to_vec().into(),
        Value::Text(text) => text.as_str().into(),
        Value::Texture(_) => "a texture".into(),
        Value::Record(entries) => entries.iter().map(|(key, value)| (key.clone(), json_of(value))).collect(),
        Value::Array(items) => items.iter().map(json_of).collect(),
    }
}

/// A float with as many digits as it needs, which its nearest double has not.
fn short(value: f32) -> Json {
    value.to_string().parse::<f64>().map_or(Json::Null, |value| json!(value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_declared_in_comments() {
        for (note, range) in [
            ("pixels, 0 … 12", Some([0.0, 12.0])),
            ("0.5...2.5", Some([0.5, 2.5])),
            ("-1..1, signed", Some([-1.0, 1.0])),
            ("from 1e-3 … 1.", Some([1e-3, 1.0])),
            ("é2 … 3", Some([2.0, 3.0])),
            ("3 … 2", None),
            ("and so on …", None),
            ("… 5", None),
            ("brightness where the light band begins", None),
        ] {
            assert_eq!(declared_range(note), range, "{note}");
        }
    }

    #[test]
    fn sliders_end_at_round_numbers() {
        for (number, nice) in [(0.3, 0.5), (1.0, 1.0), (4.0, 5.0), (5.1, 10.0), (180.0, 200.0)] {
            assert!((nice_above(number) - nice).abs() < 1e-9 * nice, "{number}");
        }
        assert!(nice_above(f64::INFINITY).is_finite() && nice_above(f64::NAN).is_finite());
    }

    #[test]
    fn every_setting_of_lines_has_a_control() {
        let mut controls = Vec::new();
        of_object(&SCHEMA["$defs"]["Lines"], &["lines".into()], &json!({}), &Edits::default(), &mut controls);
        let mut paths: Vec<_> = controls.iter().map(|control| control.path[1..].join(".")).collect();
        for key in SCHEMA["$defs"]["Lines"]["properties"].as_object().expect("it has properties").keys() {
            let has = paths.iter().any(|path| path.split('.').next() == Some(key));
            assert!(has, "{key} has no control");
        }
        paths.sort();
        assert!(paths.contains(&"types.crease.opacity".to_owned()) && paths.contains(&"hidden.objects".to_owned()));
    }
}
