//! Edits made while watching: values in place of those of the scene file, which can be copied out as TOML or written back
//! into the file with its comments and its order kept.

use toml_edit::{Array, DocumentMut, InlineTable, Item, Key, Table, TableLike, Value};

use crate::diag::{Diagnostic, Diagnostics};
use crate::scene::file::Override;

/// The parts of a path into a scene file, such as `lines` and `width`. Elements of arrays go by number or by `name`.
pub type KeyPath = Vec<String>;

/// The edits, each path once, in the order in which they were first made.
#[derive(Clone, Debug, Default)]
pub struct Edits {
    list: Vec<(KeyPath, Value)>,
}

/// Most parts that a path can have.
const MOST_PARTS: usize = 8;
/// Most edits at a time.
const MOST_EDITS: usize = 1000;

impl Edits {
    /// Sets a value. Whether the scene can have it there is found when it is loaded.
    ///
    /// # Errors
    /// If TOML has no such value, or the path is empty or absurdly long.
    pub fn set(&mut self, path: KeyPath, value: &serde_json::Value) -> Result<(), Diagnostic> {
        if path.is_empty() || path.len() > MOST_PARTS {
            return Err(Diagnostic::error(format!("a path of an edit has 1 to {MOST_PARTS} parts")));
        }
        let value = from_json(value)?;
        match self.list.iter().position(|(known, _)| *known == path) {
            Some(place) => self.list[place].1 = value,
            None if self.list.len() == MOST_EDITS => {
                return Err(Diagnostic::error(format!("there are {MOST_EDITS} edits, the most that are possible"))
                    .hint("write them back into the scene file"));
            }
            None => self.list.push((path, value)),
        }
        Ok(())
    }

    /// Takes an edit back.
    pub fn remove(&mut self, path: &[String]) {
        self.list.retain(|(known, _)| known != path);
    }

    /// Takes all back.
    pub fn clear(&mut self) {
        self.list.clear();
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// The paths.
    pub fn paths(&self) -> impl Iterator<Item = &KeyPath> {
        self.list.iter().map(|(path, _)| path)
    }

    /// As [`Override`]s.
    ///
    /// # Errors
    /// If a path or a value cannot be written; that would be a bug.
    pub fn overrides(&self) -> Result<Vec<Override>, Diagnostics> {
        let mut faults = Diagnostics::default();
        let parse = |(path, value): &(KeyPath, Value)| {
            let text = format!("{}={}", spelt(path), value.to_string().trim());
            Override::parse_as(format!("the edit of {}", spelt(path)), &text).map_err(|fault| faults.extend(fault)).ok()
        };
        let overrides: Vec<_> = self.list.iter().filter_map(parse).collect();
        if faults.has_errors() { Err(faults) } else { Ok(overrides) }
    }

    /// As the text of a scene file that holds nothing else.
    #[must_use]
    pub fn toml(&self) -> String {
        self.written_into("").unwrap_or_default()
    }

    /// A scene file's text with the edits written into it. Comments, order and layout stay; a number keeps its kind; what
    /// is new comes at the end of its table.
    ///
    /// # Errors
    /// If the text is not TOML, or an edit's place is not there.
    pub fn written_into(&self, text: &str) -> Result<String, Diagnostics> {
        let mut document: DocumentMut = text.parse().map_err(|error: toml_edit::TomlError| {
            Diagnostic::error(format!("the scene file is not valid TOML: {}", error.message()))
                .hint("mend it first; the edits stay as they are")
        })?;
        let mut faults = Diagnostics::default();
        for (path, value) in &self.list {
            if let Err(fault) = write(document.as_table_mut(), false, path, value) {
                faults.push(fault);
            }
        }
        if faults.has_errors() { Err(faults) } else { Ok(document.to_string()) }
    }
}

/// A path as `--set` takes it.
#[must_use]
pub fn spelt(path: &[String]) -> String {
    path.iter().map(|part| Key::new(part).display_repr().into_owned()).collect::<Vec<_>>().join(".")
}

fn from_json(value: &serde_json::Value) -> Result<Value, Diagnostic> {
    Ok(match value {
        serde_json::Value::Null => return Err(Diagnostic::error("TOML has no null")),
        serde_json::Value::Bool(value) => (*value).into(),
        serde_json::Value::Number(number) => match number.as_i64() {
            Some(whole) => whole.into(),
            None => number.as_f64().unwrap_or(f64::NAN).into(),
        },
        serde_json::Value::String(text) => text.as_str().into(),
        serde_json::Value::Array(items) => {
            Value::Array(items.iter().map(from_json).collect::<Result<Array, Diagnostic>>()?)
        }
        serde_json::Value::Object(entries) => {
            let mut table = InlineTable::new();
            for (key, value) in entries {
                table.insert(key, from_json(value)?);
            }
            Value::InlineTable(table)
        }
    })
}

/// Puts a value at a path below a table, which may stand in braces.
fn write(table: &mut dyn TableLike, in_braces: bool, path: &[String], value: &Value) -> Result<(), Diagnostic> {
    let Some((first, rest)) = path.split_first() else { return Ok(()) };
    if rest.is_empty() {
        match table.get_mut(first).and_then(Item::as_value_mut) {
            Some(old) => replace(old, value.clone()),
            None => {
                let mut value = value.clone();
                if in_braces && let Some(last) = table.iter_mut().filter_map(|(_, item)| item.as_value_mut()).last() {
                    // The space before the brace belongs to what comes last.
                    let suffix = last.decor().suffix().cloned().unwrap_or_default();
                    last.decor_mut().set_suffix("");
                    value.decor_mut().set_prefix(" ");
                    value.decor_mut().set_suffix(suffix);
                }
                table.insert(first, Item::Value(value));
            }
        }
        return Ok(());
    }
    if !table.contains_key(first) {
        // Parameters stand in braces everywhere else, too.
        let fresh = match first.as_str() {
            "params" => Item::Value(InlineTable::new().into()),
            _ => {
                let mut fresh = Table::new();
                fresh.set_implicit(true);
                Item::Table(fresh)
            }
        };
        table.insert(first, fresh);
    }
    let item = table.get_mut(first).ok_or_else(|| no_place(first))?;
    write_below(item, first, rest, value)
}

fn write_below(item: &mut Item, name: &str, path: &[String], value: &Value) -> Result<(), Diagnostic> {
    if let Item::ArrayOfTables(tables) = item {
        let named = |table: &Table| table.get("name").and_then(Item::as_str).map(str::to_owned);
        let names: Vec<_> = tables.iter().map(named).collect();
        let index = place_of(&names, name, &path[0])?;
        let table = tables.get_mut(index).ok_or_else(|| no_place(&path[0]))?;
        return write(table, false, &path[1..], value);
    }
    if let Item::Value(Value::Array(items)) = item {
        let named = |item: &Value| item.as_inline_table()?.get("name")?.as_str().map(str::to_owned);
        let names: Vec<_> = items.iter().map(named).collect();
        let index = place_of(&names, name, &path[0])?;
        let element = items.get_mut(index).ok_or_else(|| no_place(&path[0]))?;
        return match (&path[1..], element) {
            ([], element) => {
                replace(element, value.clone());
                Ok(())
            }
            (rest, Value::InlineTable(table)) => write(table, true, rest, value),
            (rest, _) => Err(no_place(&rest[0])),
        };
    }
    let in_braces = item.is_inline_table();
    let table = item.as_table_like_mut().ok_or_else(|| no_place(&path[0]))?;
    write(table, in_braces, path, value)
}

/// The index of an element that goes by number or by name.
fn place_of(names: &[Option<String>], array: &str, part: &str) -> Result<usize, Diagnostic> {
    let by_number = part.parse().ok().filter(|index: &usize| *index < names.len());
    by_number
        .or_else(|| names.iter().position(|name| name.as_deref() == Some(part)))
        .ok_or_else(|| Diagnostic::error(format!("the scene file's `{array}` has no element `{part}`")))
}

fn no_place(part: &str) -> Diagnostic {
    Diagnostic::error(format!("the scene file has no place for `{part}`"))
}

/// Puts a value in place of another, in the same layout: space and comments around it stay, an array stays on as many
/// lines, and a float stays a float.
fn replace(old: &mut Value, new: Value) {
    let new = match (&mut *old, new) {
        (Value::Array(old), Value::Array(new)) if old.len() == new.len() => {
            old.iter_mut().zip(new).for_each(|(old, new)| replace(old, new));
            return;
        }
        #[expect(clippy::cast_precision_loss, reason = "JSON's numbers are floats from the start")]
        (Value::Float(_), Value::Integer(whole)) => Value::from(*whole.value() as f64),
        (_, new) => new,
    };
    let decor = old.decor().clone();
    *old = new;
    *old.decor_mut() = decor;
}
