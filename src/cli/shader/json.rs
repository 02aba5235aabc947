//! The document of `tusche shader check --json`.
//!
//! ```text
//! { "version": 1,                       of this schema; grows when a key changes its meaning or goes
//!   "files": [                          in the order of the command line
//!     { "file": "ink.rhai",             as typed
//!       "diagnostics": [                errors first, then warnings, each by place
//!         { "severity": "error" | "warning",
//!           "file": "ink.rhai" | null,  what the place is in; `--set` values are called by what was typed
//!           "range": { "start": { "line": 2, "column": 8 }, "end": { "line": 2, "column": 17 } } | null,
//!           "message": "there is no output `bas_color`",
//!           "hints": ["did you mean `base_color`?"] } ],
//!       "report": null |                null if the shader does not compile or cannot be read
//!         { "mode": "constant" | "kernel" | "interpreted",
//!           "blame": null | { as in "diagnostics" },         why it is interpreted, where known
//!           "ns_per_hit": 1700.0 | null,          measured; null for a constant shader, or one that fails
//!           "complete": true,                     whether the facts below are known to be complete
//!           "inputs": ["irradiance"],             what is read on `hit`, in the order of the contract
//!           "outputs": [                          what may be returned, in the order of the contract
//!             { "name": "line_width",
//!               "always": true,                   whether it is returned at every hit
//!               "inputs": ["irradiance"],         what it depends on
//!               "range": [2.0, 2.8] | null,       least and greatest value of any channel, where known
//!               "constant": 2.0 | [1.0, 0.5, 0.0] | null } ],
//!           "parameters": [ { "name": "ink_width", "value": 2.0 } ],        by name; a texture is { "texture": 0 }
//!           "max_line_width": 8.0 | null,         what the script declares
//!           "line": null |                        null without a function `line`
//!             { "mode": "kernel" | "interpreted",
//!               "blame": null | { as in "diagnostics" },
//!               "inputs": ["kind", "depth"] } } } ],   what is read on `pair`, of either side
//!   "errors": 1,
//!   "warnings": 0 }
//! ```
//!
//! Lines and columns count from 1; columns count characters (Unicode scalar values); `end` is the place behind the last
//! character. Keys come in this order and are always there. A bound that is infinite is `null` in `range`.

use serde::Serialize;
use serde_json::Value as Json;

use crate::diag::{Diagnostic, Severity, Span};
use crate::shade::check::{Check, Report};
use crate::shade::params::Value;

#[derive(Serialize)]
pub(super) struct Document {
    version: u32,
    files: Vec<File>,
    errors: usize,
    warnings: usize,
}

#[derive(Serialize)]
struct File {
    file: String,
    diagnostics: Vec<Entry>,
    report: Option<Facts>,
}

#[derive(Serialize)]
struct Entry {
    severity: &'static str,
    file: Option<String>,
    range: Option<Range>,
    message: String,
    hints: Vec<String>,
}

#[derive(Serialize)]
struct Range {
    start: Place,
    end: Place,
}

#[derive(Serialize)]
struct Place {
    line: usize,
    column: usize,
}

#[derive(Serialize)]
struct Facts {
    mode: &'static str,
    blame: Option<Entry>,
    ns_per_hit: Option<f64>,
    complete: bool,
    inputs: Vec<&'static str>,
    outputs: Vec<Output>,
    parameters: Vec<Parameter>,
    max_line_width: Option<f32>,
    line: Option<LineFacts>,
}

#[derive(Serialize)]
struct LineFacts {
    mode: &'static str,
    blame: Option<Entry>,
    inputs: Vec<&'static str>,
}

#[derive(Serialize)]
struct Output {
    name: String,
    always: bool,
    inputs: Vec<&'static str>,
    range: Option<[Option<f32>; 2]>,
    constant: Option<Json>,
}

#[derive(Serialize)]
struct Parameter {
    name: String,
    value: Json,
}

impl Document {
    pub fn new(checks: &[(String, Check)]) -> Self {
        let count = |severity| {
            let all = checks.iter().flat_map(|(_, check)| &check.diagnostics.0);
            all.filter(|diagnostic| diagnostic.severity == severity).count()
        };
        Self {
            version: 1,
            files: checks.iter().map(|(file, check)| File::new(file, check)).collect(),
            errors: count(Severity::Error),
            warnings: count(Severity::Warning),
        }
    }
}

impl File {
    fn new(file: &str, check: &Check) -> Self {
        Self {
            file: file.to_owned(),
            diagnostics: check.diagnostics.0.iter().map(Entry::new).collect(),
            report: check.report.as_ref().map(Facts::new),
        }
    }
}

impl Entry {
    fn new(diagnostic: &Diagnostic) -> Self {
        let file = match (&diagnostic.span, &diagnostic.file) {
            (Some(span), _) => Some(span.source.name.clone()),
            (None, file) => file.as_ref().map(|path| path.display().to_string()),
        };
        Self {
            severity: match diagnostic.severity {
                Severity::Error => "error",
                Severity::Warning => "warning",
            },
            file,
            range: diagnostic.span.as_ref().map(range),
            message: diagnostic.message.clone(),
            hints: diagnostic.hints.clone(),
        }
    }
}

fn range(span: &Span) -> Range {
    let place = |offset: usize| {
        let (line, column) = span.source.line_column(offset);
        Place { line, column }
    };
    Range { start: place(span.range.start), end: place(span.range.end.max(span.range.start)) }
}

impl Facts {
    fn new(report: &Report) -> Self {
        Self {
            mode: report.mode.name(),
            blame: report.blame.as_ref().map(Entry::new),
            ns_per_hit: report.nanoseconds_per_hit.map(|cost| (cost * 10.0).round() / 10.0),
            complete: report.analysis.complete,
            inputs: report.inputs(),
            outputs: report
                .outputs()
                .into_iter()
                .map(|(name, fact)| Output {
                    name,
                    always: fact.always,
                    inputs: crate::shade::check::input_names(fact.inputs),
                    range: fact.range.map(|range| range.map(|bound| bound.is_finite().then_some(bound))),
                    constant: fact.constant.as_ref().map(json),
                })
                .collect(),
            parameters: report
                .params
                .0
                .iter()
                .map(|(name, value)| Parameter { name: name.clone(), value: json(value) })
                .collect(),
            max_line_width: report.params.max_line_width(),
            line: report.line.as_ref().map(|line| LineFacts {
                mode: line.mode.name(),
                blame: line.blame.as_ref().map(Entry::new),
                inputs: line.reads.clone(),
            }),
        }
    }
}

fn json(value: &Value) -> Json {
    match value {
        Value::Unit => Json::Null,
        Value::Bool(x) => Json::from(*x),
        Value::Int(x) => Json::from(*x),
        Value::Float(x) => number(*x),
        Value::Vec2(v) => Json::from_iter(v.to_array().map(number)),
        Value::Vec3(v) => Json::from_iter(v.to_array().map(number)),
        Value::Vec4(v) => Json::from_iter(v.to_array().map(number)),
        Value::Text(text) => Json::from(text.as_str()),
        Value::Texture(place) => serde_json::json!({ "texture": place.texture.index() }),
        Value::Record(entries) => Json::from_iter(entries.iter().map(|(key, value)| (key.clone(), json(value)))),
        Value::Array(items) => Json::from_iter(items.iter().map(json)),
    }
}

/// The shortest decimal that stands for this `f32`, which is not the one that stands for the same `f64`.
fn number(x: f32) -> Json {
    x.to_string().parse::<f64>().map_or(Json::Null, Json::from)
}
