//! `--set PATH=VALUE`: values from the command line, placed into the document before it is checked.

use std::sync::Arc;

use serde_json::Value as Schema;

use super::document::{self, Entry, Node, Table, Value};
use crate::diag::{Diagnostic, Diagnostics, Source, Span, nearest};

/// A value for a place in a scene file: `lines.width=3`, `objects.ball.priority=2`, `materials.ink.params.width=2.5`.
///
/// The path is a TOML key: parts are joined by dots, and a part with other characters than letters, digits, `_` and
/// `-` stands in quotes. Elements of `objects`, `lights` and `cameras` are named by number, from 0, or by their
/// `name`. The value is a TOML value; a word that is not one is taken as a string.
#[derive(Clone, Debug)]
pub struct Override {
    source: Arc<Source>,
    path: Vec<(String, Span)>,
    value: Node,
}

impl Override {
    /// Reads `PATH=VALUE`.
    ///
    /// # Errors
    /// If there is no `=`, the path is not a TOML key, or the value looks like TOML and is broken.
    pub fn parse(text: &str) -> Result<Self, Diagnostics> {
        Self::parse_as(format!("--set {text}"), text)
    }

    /// The same for one that comes from somewhere else than `--set`: messages call it `name`.
    ///
    /// # Errors
    /// As [`Self::parse`].
    pub fn parse_as(name: impl Into<String>, text: &str) -> Result<Self, Diagnostics> {
        let source = Source::new(name, text);
        let whole = Span::new(&source, 0..text.len());
        // A quoted part may contain `=`: the path ends at the first one before which a key is complete.
        let split = text.match_indices('=').find_map(|(at, _)| Some((at, key_path(&source, at)?)));
        let Some((at, path)) = split else {
            let fault = if text.contains('=') {
                Diagnostic::error("what stands before `=` is not a path into the scene file").hint(
                    "put parts with spaces or other special characters in quotes: objects.\"big ball\".priority=1",
                )
            } else {
                Diagnostic::error("an override needs a path and a value").hint("for example: --set lines.width=3")
            };
            return Err(fault.at(whole).into());
        };
        let rest = &text[at + 1..];
        let start = at + 1 + (rest.len() - rest.trim_start().len());
        let word = rest.trim();
        if word.is_empty() {
            return Err(Diagnostic::error("there is no value after `=`").at(whole).into());
        }
        let value = match document::parse_value(&source, start) {
            Ok(node) => node,
            Err(faults) if word.starts_with(['[', '{', '"', '\'']) || is_number_like(word) => return Err(faults),
            Err(_) => {
                Node { span: Span::new(&source, start..start + word.len()), value: Value::String(word.to_owned()) }
            }
        };
        Ok(Self { source, path, value })
    }

    /// The same value, for a path that begins with these parts.
    pub(super) fn within(mut self, parts: &[&str]) -> Self {
        let whole = Span::new(&self.source, 0..self.source.text.len());
        self.path.splice(0..0, parts.iter().map(|part| ((*part).to_owned(), whole.clone())));
        self
    }

    /// The parts of the path.
    pub fn path(&self) -> impl Iterator<Item = &str> {
        self.path.iter().map(|(part, _)| part.as_str())
    }

    /// What was typed, which places in messages point into.
    pub(super) fn source(&self) -> &Arc<Source> {
        &self.source
    }

    /// Puts the value into a document.
    ///
    /// Tables on the way are made as needed; unknown keys among them are found by the check of the whole document.
    ///
    /// # Errors
    /// If the path names an element that is not there, or goes on below a plain value.
    pub(super) fn place(&self, root: &mut Node, schema: &Schema) -> Result<(), Diagnostic> {
        let mut node = root;
        for (depth, (part, span)) in self.path.iter().enumerate() {
            let so_far = || self.path[..depth].iter().map(|(part, _)| part.as_str()).collect::<Vec<_>>().join(".");
            let last = depth + 1 == self.path.len();
            node = match &mut node.value {
                Value::Array(items) => element(items, part, span, &so_far())?,
                Value::Table(table) => {
                    let known = table.entries.iter().position(|entry| entry.key == *part);
                    let index = match known {
                        Some(index) => index,
                        None if !last && depth == 0 && schema["properties"][part]["type"] == "array" => {
                            return Err(Diagnostic::error(format!("the scene has no {part}")).at(span.clone()));
                        }
                        None => {
                            let value = Value::Table(Table::default());
                            let node = Node { span: span.clone(), value };
                            table.entries.push(Entry { key: part.clone(), key_span: span.clone(), node });
                            table.entries.len() - 1
                        }
                    };
                    if last {
                        table.entries[index].key_span = span.clone();
                    }
                    &mut table.entries[index].node
                }
                _ => {
                    let message = format!("`{}` is a plain value: it has no `{part}`", so_far());
                    return Err(Diagnostic::error(message).at(span.clone()));
                }
            };
        }
        *node = self.value.clone();
        Ok(())
    }
}

fn is_number_like(word: &str) -> bool {
    word.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c))
        && word.chars().all(|c| c.is_ascii_digit() || "+-._eE".contains(c))
}

/// The parts of the key that the first `end` bytes of the text are, if they are one.
fn key_path(source: &Arc<Source>, end: usize) -> Option<Vec<(String, Span)>> {
    let assignment = Source::new("", format!("{}=0", &source.text[..end]));
    let mut node = document::parse(&assignment).ok()?;
    let mut path = Vec::new();
    while let Value::Table(table) = node.value {
        let [entry] = <[Entry; 1]>::try_from(table.entries).ok()?;
        path.push((entry.key, Span::new(source, entry.key_span.range)));
        node = entry.node;
    }
    Some(path)
}

fn element<'a>(items: &'a mut [Node], part: &str, span: &Span, array: &str) -> Result<&'a mut Node, Diagnostic> {
    let names: Vec<_> = items.iter().map(|item| item.get("name").and_then(Node::as_str)).collect();
    let index = match part.parse::<usize>() {
        Ok(index) if index < items.len() => Ok(index),
        Ok(_) => {
            let hint = match items.len() {
                0 => "it is empty".to_owned(),
                1 => "there is one, number 0".to_owned(),
                n => format!("there are {n}, numbered from 0 to {}", n - 1),
            };
            Err(Diagnostic::error(format!("`{array}` has no number {part}")).hint(hint))
        }
        Err(_) => names.iter().position(|name| *name == Some(part)).ok_or_else(|| {
            let fault = Diagnostic::error(format!("`{array}` has no element named `{part}`"));
            let names = names.iter().flatten().copied();
            match nearest(part, names) {
                Some(near) => fault.hint(format!("did you mean `{near}`?")),
                None => fault.hint(format!("elements without a `name` go by number: {array}.0")),
            }
        }),
    };
    index.map(|index| &mut items[index]).map_err(|fault| fault.at(span.clone()))
}
