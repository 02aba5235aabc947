//! Holds a document against the JSON schema of the scene file, and finds everything that is wrong in one walk.
//!
//! What is faulty is reported and cut out of the document, so that the later steps can go on with the rest and find
//! what else is wrong: a missing file and a misspelt key are told together. A table remembers which of its keys were
//! cut out ([`Table::dropped`]), lest one mistake be reported twice. A faulty part that cannot be missed makes
//! the part around it faulty in turn.
//!
//! The walk knows the keywords that `schemars` writes for the types of [`format`](super::format): `$ref`, `type`,
//! `const`, `anyOf`, `oneOf`, `properties`, `additionalProperties`, `required`, `items`, and bounds.

use serde_json::Value as Json;

use super::document::{Node, Table, Value};
use super::expect::{describe, found};
use crate::diag::{Diagnostic, Diagnostics, nearest};

/// Reports all faults of a document and cuts them out.
pub(super) fn check(document: &mut Node, schema: &Json, faults: &mut Diagnostics) {
    Walk { root: schema, faults }.node(document, schema, "");
}

/// A schema with its `$ref` followed.
pub(super) fn follow<'a>(root: &'a Json, schema: &'a Json) -> &'a Json {
    let mut schema = schema;
    while let Some(name) = schema["$ref"].as_str().and_then(|path| path.strip_prefix("#/$defs/")) {
        schema = &root["$defs"][name];
    }
    schema
}

/// The alternatives of a schema, if it has any.
pub(super) fn alternatives(schema: &Json) -> Option<&Vec<Json>> {
    schema["anyOf"].as_array().or_else(|| schema["oneOf"].as_array())
}

struct Walk<'a> {
    root: &'a Json,
    faults: &'a mut Diagnostics,
}

impl<'a> Walk<'a> {
    /// Checks a node; false if it cannot be used. `path` names it in messages, in the spelling of `--set`.
    fn node(&mut self, node: &mut Node, schema: &'a Json, path: &str) -> bool {
        let schema = follow(self.root, schema);
        if let Some(options) = alternatives(schema) {
            return self.one_of(node, schema, options, path);
        }
        if !self.kind_fits(&node.value, schema) {
            return self.mismatch(node, schema, path);
        }
        match &mut node.value {
            Value::Table(_) => self.table(node, schema, path),
            Value::Array(_) => self.array(node, schema, path),
            value => self.scalar_fits(value, schema) || self.mismatch(node, schema, path),
        }
    }

    fn mismatch(&mut self, node: &Node, schema: &Json, path: &str) -> bool {
        self.expected(&describe(self.root, schema), node, path)
    }

    fn expected(&mut self, what: &str, node: &Node, path: &str) -> bool {
        let message = format!("`{path}`: expected {what}, found {}", found(&node.value));
        self.faults.push(Diagnostic::error(message).at(node.span.clone()));
        false
    }

    /// Whether a value is of the kind (string, table, …) that a schema asks for.
    fn kind_fits(&self, value: &Value, schema: &Json) -> bool {
        let schema = follow(self.root, schema);
        match (value, schema["type"].as_str()) {
            (_, None) => alternatives(schema).is_none_or(|options| options.iter().any(|o| self.kind_fits(value, o))),
            (Value::Bool(_), Some(kind)) => kind == "boolean",
            (Value::Int(_), Some(kind)) => kind == "integer" || kind == "number",
            (Value::Float(_), Some(kind)) => kind == "number",
            (Value::String(_), Some(kind)) => kind == "string",
            (Value::Array(_), Some(kind)) => kind == "array",
            (Value::Table(_), Some(kind)) => kind == "object",
            (Value::Datetime(_), Some(_)) => false,
        }
    }

    /// Whether a scalar has the kind and a value that a schema asks for.
    fn scalar_fits(&self, value: &Value, schema: &Json) -> bool {
        let schema = follow(self.root, schema);
        if let Some(options) = alternatives(schema) {
            return options.iter().any(|option| self.scalar_fits(value, option));
        }
        let allowed = |value: Json| schema.get("const").is_none_or(|constant| *constant == value);
        self.kind_fits(value, schema)
            && match value {
                Value::Bool(value) => allowed((*value).into()),
                Value::String(text) => allowed(text.as_str().into()),
                Value::Int(value) => in_bounds(*value as f64, schema),
                Value::Float(value) => in_bounds(*value, schema),
                Value::Datetime(_) | Value::Array(_) | Value::Table(_) => false,
            }
    }

    fn one_of(&mut self, node: &mut Node, schema: &'a Json, options: &'a [Json], path: &str) -> bool {
        if let Some(tag) = self.tag(options) {
            return self.tagged(node, schema, options, tag, path);
        }
        if options.iter().all(|option| option["const"].is_string()) {
            return self.named_value(node, schema, options, path);
        }
        let of_kind: Vec<&'a Json> = options.iter().filter(|option| self.kind_fits(&node.value, option)).collect();
        match (&node.value, &of_kind[..]) {
            (_, []) => self.mismatch(node, schema, path),
            (Value::Table(table), _) => match self.most_alike(table, &of_kind) {
                Some(option) => self.node(node, option, path),
                None => self.mismatch(node, schema, path),
            },
            (Value::Array(_), [option, ..]) => self.node(node, option, path),
            (value, _) if of_kind.iter().any(|option| self.scalar_fits(value, option)) => true,
            // Of a number, only its size can be wrong: what else could stand there is no help.
            (Value::Int(_) | Value::Float(_), [option, ..]) => self.mismatch(node, option, path),
            _ => self.mismatch(node, schema, path),
        }
    }

    /// The alternative that shares most keys with a table, the first of equals; `None` if it could be any of several.
    fn most_alike(&self, table: &Table, options: &[&'a Json]) -> Option<&'a Json> {
        let shared = |option: &Json| {
            let known = &follow(self.root, option)["properties"];
            table.entries.iter().filter(|entry| known.get(&entry.key).is_some()).count()
        };
        // `max_by_key` takes the last of equals.
        let closest = options.iter().rev().copied().max_by_key(|option| shared(option));
        closest.filter(|option| shared(option) > 0 || options.len() == 1)
    }

    /// The property whose constant tells the alternatives apart, if each has one.
    fn tag(&self, options: &'a [Json]) -> Option<&'a str> {
        let properties = options.first()?["properties"].as_object()?;
        let is_tag = |name: &str| options.iter().all(|option| option["properties"][name]["const"].is_string());
        properties.keys().map(String::as_str).find(|name| is_tag(name))
    }

    fn tagged(&mut self, node: &mut Node, schema: &'a Json, options: &'a [Json], tag: &'a str, path: &str) -> bool {
        if node.table().is_none() {
            return self.mismatch(node, &options[0], path);
        }
        let names: Vec<_> = options.iter().filter_map(|option| option["properties"][tag]["const"].as_str()).collect();
        let inner = join(path, tag);
        let Some(value) = node.get(tag) else {
            let message = format!("`{path}` lacks the key `{tag}`");
            let hint = format!("add one of: {}", assignments(tag, &names));
            self.faults.push(Diagnostic::error(message).at(node.span.clone()).hint(hint));
            return false;
        };
        match value.as_str().map(|name| (name, names.iter().position(|known| *known == name))) {
            Some((_, Some(index))) => self.table(node, &options[index], path),
            Some((name, None)) => {
                let fault = unknown_value(&inner, name, &names, &schema["x-planned"]);
                self.faults.push(fault.at(value.span.clone()));
                false
            }
            None => self.expected("a string", value, &inner),
        }
    }

    fn named_value(&mut self, node: &Node, schema: &Json, options: &[Json], path: &str) -> bool {
        let names: Vec<_> = options.iter().filter_map(|option| option["const"].as_str()).collect();
        match node.as_str() {
            None => self.mismatch(node, schema, path),
            Some(name) if names.contains(&name) => true,
            Some(name) => {
                self.faults.push(unknown_value(path, name, &names, &schema["x-planned"]).at(node.span.clone()));
                false
            }
        }
    }

    fn table(&mut self, node: &mut Node, schema: &'a Json, path: &str) -> bool {
        let Value::Table(table) = &mut node.value else { return false };
        let properties = schema["properties"].as_object();
        let Table { entries, dropped } = table;
        entries.retain_mut(|entry| {
            let inner = join(path, &entry.key);
            let good = match (properties.and_then(|known| known.get(&entry.key)), &schema["additionalProperties"]) {
                (Some(property), _) | (None, property @ Json::Object(_)) => {
                    self.node(&mut entry.node, property, &inner)
                }
                (None, _) => {
                    let fault = self.unknown_key(&entry.key, &entry.node.value, schema, path);
                    self.faults.push(fault.at(entry.key_span.clone()));
                    false
                }
            };
            if !good {
                dropped.push(entry.key.clone());
            }
            good
        });
        let required = schema["required"].as_array().into_iter().flatten().filter_map(Json::as_str);
        let absent: Vec<_> = required.filter(|key| node.get(key).is_none()).collect();
        for key in &absent {
            if !node.mentions(key) {
                let what = describe(self.root, &schema["properties"][*key]);
                let fault = Diagnostic::error(format!("`{path}` lacks the key `{key}`, {what}"));
                self.faults.push(fault.at(node.span.clone()));
            }
        }
        absent.is_empty()
    }

    fn unknown_key(&self, key: &str, value: &Value, schema: &Json, path: &str) -> Diagnostic {
        if let Some(instead) = schema["x-planned"][key].as_str() {
            return Diagnostic::error(format!("`{key}` is not built yet")).hint(instead);
        }
        let known = || schema["properties"].as_object().into_iter().flatten().map(|(key, _)| key.as_str());
        let fault = Diagnostic::error(match (path, value) {
            ("", Value::Table(_) | Value::Array(_)) => format!("unknown table `{key}`"),
            ("", _) => format!("unknown key `{key}` outside of all tables"),
            _ => format!("unknown key `{key}` in `{path}`"),
        });
        if let Some(near) = nearest(key, known()) {
            return fault.hint(format!("did you mean `{near}`?"));
        }
        // Written in the wrong table?
        let mut tables = self.root["properties"].as_object().into_iter().flatten();
        let home = tables.find(|(_, table)| follow(self.root, table)["properties"].get(key).is_some());
        match home {
            Some((home, _)) => fault.hint(format!("`{key}` belongs in [{home}]")),
            None => fault.hint(format!("known here: {}", listed(known()))),
        }
    }

    fn array(&mut self, node: &mut Node, schema: &'a Json, path: &str) -> bool {
        let Value::Array(items) = &mut node.value else { return false };
        let least = schema["minItems"].as_u64().unwrap_or(0);
        let most = schema["maxItems"].as_u64().unwrap_or(u64::MAX);
        if !(least..=most).contains(&(items.len() as u64)) {
            return self.mismatch(node, schema, path);
        }
        let before = items.len();
        let mut index = 0;
        items.retain_mut(|item| {
            let good = self.node(item, &schema["items"], &join(path, &index.to_string()));
            index += 1;
            good
        });
        // An array of some length is one value; a list goes on without its faulty elements.
        items.len() == before || (least == 0 && most == u64::MAX)
    }
}

fn in_bounds(number: f64, schema: &Json) -> bool {
    let holds = |keyword: &str, test: fn(f64, f64) -> bool| schema[keyword].as_f64().is_none_or(|b| test(number, b));
    number.is_finite()
        && holds("minimum", |n, bound| n >= bound)
        && holds("exclusiveMinimum", |n, bound| n > bound)
        && holds("maximum", |n, bound| n <= bound)
}

fn unknown_value(path: &str, name: &str, names: &[&str], planned: &Json) -> Diagnostic {
    let quoted = listed(names.iter().copied());
    if planned.get(name).is_some() {
        return Diagnostic::error(format!("`{path}`: `{name}` is not built yet")).hint(format!("there are: {quoted}"));
    }
    let fault = Diagnostic::error(format!("`{path}`: unknown value `{name}`"));
    match nearest(name, names.iter().copied()) {
        Some(near) => fault.hint(format!("did you mean `{near}`?")),
        None => fault.hint(format!("there are: {quoted}")),
    }
}

fn listed<'a>(names: impl Iterator<Item = &'a str>) -> String {
    names.map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

fn assignments(key: &str, names: &[&str]) -> String {
    names.iter().map(|name| format!("{key} = \"{name}\"")).collect::<Vec<_>>().join(", ")
}

fn join(path: &str, key: &str) -> String {
    if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") }
}
