//! The JSON schema that `tusche schema` prints.

use serde_json::Value;

fn visit(schema: &Value, path: &str, see: &mut impl FnMut(&str, &Value)) {
    match schema {
        Value::Object(map) => {
            see(path, schema);
            map.iter().for_each(|(key, value)| visit(value, &format!("{path}/{key}"), see));
        }
        Value::Array(items) => items.iter().enumerate().for_each(|(i, v)| visit(v, &format!("{path}/{i}"), see)),
        _ => {}
    }
}

#[test]
fn every_key_and_every_choice_is_described() {
    let schema = tusche::scene::file::schema();
    assert_eq!(schema["$schema"], "https://json-schema.org/draft/2020-12/schema");
    let mut count = 0;
    visit(&schema, "#", &mut |path, schema| {
        let described = |schema: &Value| schema["description"].as_str().is_some_and(|text| !text.is_empty());
        for (key, property) in schema["properties"].as_object().into_iter().flatten() {
            assert!(described(property), "{path}/properties/{key} has no description");
            count += 1;
        }
        if schema.get("const").is_some() {
            assert!(described(schema), "{path} has no description");
        }
    });
    assert!(count > 70, "only {count} keys were looked at");
}

#[test]
fn keys_that_do_not_exist_are_refused_everywhere() {
    visit(&tusche::scene::file::schema(), "#", &mut |path, schema| {
        if schema.get("properties").is_some_and(Value::is_object) && schema["type"] == "object" {
            assert_eq!(schema["additionalProperties"], false, "{path}");
        }
    });
}

#[test]
fn there_is_no_null_as_toml_has_none() {
    let text = tusche::scene::file::schema().to_string();
    assert!(!text.contains("null"), "{text}");
}

#[test]
fn references_lead_somewhere() {
    let schema = tusche::scene::file::schema();
    visit(&schema, "#", &mut |path, part| {
        if let Some(target) = part["$ref"].as_str() {
            assert!(schema.pointer(target.trim_start_matches('#')).is_some(), "{path} refers to {target}");
        }
    });
}

#[test]
fn the_full_example_has_every_key() {
    let example = include_str!("full.toml");
    // Those that exclude what the example has.
    let excluded = ["gltf", "mesh", "node", "image", "lights"];
    visit(&tusche::scene::file::schema(), "#", &mut |path, schema| {
        for (key, _) in schema["properties"].as_object().into_iter().flatten() {
            let written = [format!("{key} ="), format!("[{key}"), format!(".{key}]")];
            let found = written.iter().any(|text| example.contains(text.as_str()));
            assert!(found || excluded.contains(&key.as_str()), "{path}: `{key}` is not in the example");
        }
    });
}
