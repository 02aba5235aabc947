//! The JSON schema of the scene file.

use schemars::Schema;
use schemars::generate::SchemaSettings;
use schemars::transform::{RecursiveTransform, Transform};
use serde_json::Value;

use super::format::SceneFile;

/// The JSON schema (draft 2020-12) of the scene file, with a description for every key: what `tusche schema` prints,
/// what TOML editor plug-ins can use, and what scene files are checked against.
///
/// The keyword `x-planned` lists values and keys that are designed but not built.
#[must_use]
pub fn schema() -> Value {
    let mut schema = SchemaSettings::draft2020_12().into_generator().into_root_schema_for::<SceneFile>();
    schema.insert("title".to_owned(), "Tusche scene".into());
    RecursiveTransform(without_null).transform(&mut schema);
    RecursiveTransform(describe_tag).transform(&mut schema);
    schema.to_value()
}

/// TOML has no null: a key that may be left out is simply not required. Defaults of whole tables only repeat those of
/// their keys.
fn without_null(schema: &mut Schema) {
    let is_null = |value: &Value| value["type"] == "null";
    if let Some(Value::Array(kinds)) = schema.get_mut("type") {
        kinds.retain(|kind| kind != "null");
        if let [kind] = &kinds[..] {
            let kind = kind.clone();
            schema.insert("type".to_owned(), kind);
        }
    }
    if let Some(Value::Array(options)) = schema.get_mut("anyOf") {
        options.retain(|option| !is_null(option));
        if let [Value::Object(only)] = &options[..] {
            let only = only.clone();
            schema.remove("anyOf");
            for (keyword, value) in only {
                schema.insert(keyword, value);
            }
        }
    }
    if schema.get("default").is_some_and(|default| default.is_null() || default.is_object()) {
        schema.remove("default");
    }
}

/// The key that tells alternatives apart has no description of its own: it gets that of its alternative.
fn describe_tag(schema: &mut Schema) {
    let Some(description) = schema.get("description").cloned() else { return };
    let Some(Value::Object(properties)) = schema.get_mut("properties") else { return };
    for property in properties.values_mut().filter_map(Value::as_object_mut) {
        if property.contains_key("const") && !property.contains_key("description") {
            property.insert("description".to_owned(), description.clone());
        }
    }
}
