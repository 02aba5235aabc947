//! Words for what a schema expects and for what was found instead.

use serde_json::Value as Json;

use super::check::{alternatives, follow};
use super::document::Value;

/// What a schema expects, as in "expected a number from 0 to 1".
pub(super) fn describe(root: &Json, schema: &Json) -> String {
    let schema = follow(root, schema);
    if let Some(options) = alternatives(schema) {
        let words: Vec<_> = options.iter().map(|option| describe(root, option)).collect();
        return either(&words);
    }
    match (schema.get("const"), schema["type"].as_str()) {
        (Some(Json::String(text)), _) => format!("\"{text}\""),
        (Some(constant), _) => format!("`{constant}`"),
        (None, Some("boolean")) => "true or false".to_owned(),
        (None, Some("integer")) => format!("a whole number{}", bounds(schema)),
        (None, Some("number")) => format!("a number{}", bounds(schema)),
        (None, Some("string")) => "a string".to_owned(),
        (None, Some("array")) => describe_array(root, schema),
        _ => describe_table(schema),
    }
}

fn either(words: &[String]) -> String {
    match words {
        [] => String::new(),
        [one] => one.clone(),
        [most @ .., last] => format!("{} or {last}", most.join(", ")),
    }
}

fn bounds(schema: &Json) -> String {
    let bound = |keyword: &str| schema[keyword].as_f64().map(number_text);
    match (bound("minimum"), bound("exclusiveMinimum"), bound("maximum")) {
        (Some(least), _, Some(most)) => format!(" from {least} to {most}"),
        (Some(least), _, None) => format!(" of at least {least}"),
        (None, Some(least), Some(most)) => format!(" above {least} and at most {most}"),
        (None, Some(least), None) => format!(" above {least}"),
        (None, None, Some(most)) => format!(" of at most {most}"),
        (None, None, None) => String::new(),
    }
}

fn describe_array(root: &Json, schema: &Json) -> String {
    let item = follow(root, &schema["items"]);
    // Of alternatives, all are of one kind.
    let item = alternatives(item).and_then(|options| options.first()).unwrap_or(item);
    let items = match item["type"].as_str() {
        Some("number") => "numbers",
        Some("integer") => "whole numbers",
        Some("object") => "tables",
        Some("string") => "strings",
        _ => "values",
    };
    match (schema["minItems"].as_u64(), schema["maxItems"].as_u64()) {
        (Some(least), Some(most)) if least == most => format!("an array of {least} {items}"),
        (Some(least), Some(most)) => format!("an array of {least} to {most} {items}"),
        (Some(least), None) if least > 1 => format!("an array of at least {least} {items}"),
        _ => format!("an array of {items}"),
    }
}

fn describe_table(schema: &Json) -> String {
    let required: Vec<_> = schema["required"].as_array().into_iter().flatten().filter_map(Json::as_str).collect();
    match required[..] {
        [] => "a table".to_owned(),
        _ => {
            format!("a table with {}", required.iter().map(|key| format!("`{key}`")).collect::<Vec<_>>().join(" and "))
        }
    }
}

/// What a value is, as in "found a string".
pub(super) fn found(value: &Value) -> String {
    match value {
        Value::Bool(value) => format!("`{value}`"),
        Value::Int(value) => value.to_string(),
        Value::Float(value) if value.is_nan() => "nan".to_owned(),
        Value::Float(value) => number_text(*value),
        Value::String(_) => "a string".to_owned(),
        Value::Datetime(_) => "a date".to_owned(),
        Value::Array(items) => match items.len() {
            0 => "an empty array".to_owned(),
            n => format!("an array of {n}"),
        },
        Value::Table(table) => match &table.entries[..] {
            [] => "an empty table".to_owned(),
            [entry] => format!("a table with `{}`", entry.key),
            _ => "a table".to_owned(),
        },
    }
}

/// A number without a tail of zeros.
pub(super) fn number_text(number: f64) -> String {
    let magnitude = number.abs();
    if magnitude != 0.0 && !(1e-4..1e10).contains(&magnitude) { format!("{number:e}") } else { number.to_string() }
}
