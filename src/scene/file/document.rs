//! The document: a TOML file as a tree whose every key and value knows where it was written.
//!
//! [`Node`]s of one tree may come from several sources: a `--set` override brings its own. The types of
//! [`format`](super::format) stay free of places; who needs one walks this tree beside the typed value.

use std::ops::Range;
use std::sync::Arc;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::diag::{Diagnostic, Diagnostics, Source, Span};

/// A value and where it was written. A table that a header opened is placed at the header.
#[derive(Clone, Debug)]
pub(super) struct Node {
    pub span: Span,
    pub value: Value,
}

/// A TOML value.
#[derive(Clone, Debug)]
pub(super) enum Value {
    Bool(bool),
    Int(i64),
    Float(f64),
    String(String),
    Datetime(String),
    Array(Vec<Node>),
    Table(Table),
}

/// Entries in the order of writing.
#[derive(Clone, Debug, Default)]
pub(super) struct Table {
    pub entries: Vec<Entry>,
    /// Keys that were written, but whose values were dropped because they were faulty (and reported).
    pub dropped: Vec<String>,
}

/// A key with its value.
#[derive(Clone, Debug)]
pub(super) struct Entry {
    pub key: String,
    pub key_span: Span,
    pub node: Node,
}

impl Node {
    /// The table that this node is, if it is one.
    pub fn table(&self) -> Option<&Table> {
        match &self.value {
            Value::Table(table) => Some(table),
            _ => None,
        }
    }

    /// The value of a key.
    pub fn get(&self, key: &str) -> Option<&Node> {
        self.table()?.entries.iter().find(|entry| entry.key == key).map(|entry| &entry.node)
    }

    /// The elements of an array; empty for anything else.
    pub fn items(&self) -> &[Node] {
        match &self.value {
            Value::Array(items) => items,
            _ => &[],
        }
    }

    /// Whether a key was written, even if its value was dropped.
    pub fn mentions(&self, key: &str) -> bool {
        self.get(key).is_some() || self.table().is_some_and(|table| table.dropped.iter().any(|dropped| dropped == key))
    }

    /// Where the value of a key was written; the table's own place if it was not.
    pub fn span_of(&self, key: &str) -> Span {
        self.get(key).map_or_else(|| self.span.clone(), |node| node.span.clone())
    }

    /// Where a key was written; the table's own place if it was not.
    pub fn key_span(&self, key: &str) -> Span {
        let entry = self.table().and_then(|table| table.entries.iter().find(|entry| entry.key == key));
        entry.map_or_else(|| self.span.clone(), |entry| entry.key_span.clone())
    }

    /// The same as JSON, which knows no places.
    pub fn to_json(&self) -> serde_json::Value {
        match &self.value {
            Value::Bool(value) => (*value).into(),
            Value::Int(value) => (*value).into(),
            Value::Float(value) => (*value).into(),
            Value::String(text) | Value::Datetime(text) => text.as_str().into(),
            Value::Array(items) => items.iter().map(Self::to_json).collect(),
            Value::Table(table) => {
                table.entries.iter().map(|entry| (entry.key.clone(), entry.node.to_json())).collect()
            }
        }
    }

    /// The string that this node is, if it is one.
    pub fn as_str(&self) -> Option<&str> {
        match &self.value {
            Value::String(text) => Some(text),
            _ => None,
        }
    }
}

/// More faulty lines than this are counted, not told: the file is not TOML at all.
const MOST_TOLD: usize = 40;

/// Parses a whole file.
///
/// # Errors
/// The syntax errors, the first of each line: one slip often makes the parser stumble again on the same line.
pub(super) fn parse(source: &Arc<Source>) -> Result<Node, Diagnostics> {
    let (table, errors) = DeTable::parse_recoverable(&source.text);
    let mut faults = syntax_errors(source, 0, errors);
    let reader = Reader { source, offset: 0 };
    let span = reader.span(&table);
    let root = Node { span, value: Value::Table(reader.table(table.into_inner(), &mut faults)) };
    if faults.is_empty() { Ok(root) } else { Err(faults) }
}

/// Parses the value that is the source's text from `offset` on.
pub(super) fn parse_value(source: &Arc<Source>, offset: usize) -> Result<Node, Diagnostics> {
    let (value, errors) = DeValue::parse_recoverable(&source.text[offset..]);
    let mut faults = syntax_errors(source, offset, errors);
    let node = Reader { source, offset }.node(value, &mut faults);
    if faults.is_empty() { Ok(node) } else { Err(faults) }
}

fn syntax_errors(source: &Arc<Source>, offset: usize, errors: Vec<toml::de::Error>) -> Diagnostics {
    let mut places: Vec<_> = errors
        .iter()
        .map(|error| {
            let range = error.span().unwrap_or_default();
            (range.start + offset..range.end + offset, error.message())
        })
        .collect();
    places.sort_by_key(|(range, _)| range.start);
    let bytes = source.text.as_bytes();
    places.dedup_by(|(next, _), (kept, _)| !bytes[kept.start..next.start].contains(&b'\n'));
    // An array that is not closed takes in all that follows, and the parser misses a comma before each line of it.
    let begins_line = |at: usize| bytes[..at].iter().rev().find(|byte| !matches!(byte, b' ' | b'\t')) == Some(&b'\n');
    let misses_comma = |(range, message): &(Range<usize>, &str)| {
        message.starts_with("missing comma between array elements") && begins_line(range.start)
    };
    places.dedup_by(|next, kept| misses_comma(next) && misses_comma(kept));
    let untold = places.len().saturating_sub(MOST_TOLD);
    places.truncate(MOST_TOLD);
    let mut faults = Diagnostics::default();
    for place in places {
        let hint = misses_comma(&place).then_some("or is a closing `]` missing above?");
        let (range, message) = place;
        let fault = Diagnostic::error(format!("this is not valid TOML: {message}")).at(Span::new(source, range));
        faults.push(hint.into_iter().fold(fault, Diagnostic::hint));
    }
    if untold > 0 {
        faults.push(Diagnostic::error(format!("{}: {untold} more lines are not valid TOML", source.name)));
    }
    faults
}

/// Turns the parser's tree into ours; numbers that do not fit are faults.
struct Reader<'a> {
    source: &'a Arc<Source>,
    offset: usize,
}

impl Reader<'_> {
    fn span<T>(&self, spanned: &Spanned<T>) -> Span {
        let range = spanned.span();
        Span::new(self.source, range.start + self.offset..range.end + self.offset)
    }

    fn table(&self, table: DeTable<'_>, faults: &mut Diagnostics) -> Table {
        let mut entries: Vec<_> = table
            .into_iter()
            .map(|(key, value)| Entry {
                key_span: self.span(&key),
                key: key.into_inner().into_owned(),
                node: self.node(value, faults),
            })
            .collect();
        entries.sort_by_key(|entry| entry.key_span.range.start);
        Table { entries, dropped: Vec::new() }
    }

    fn node(&self, value: Spanned<DeValue<'_>>, faults: &mut Diagnostics) -> Node {
        let span = self.span(&value);
        let mut too_large = |what: &str| {
            faults.push(Diagnostic::error(format!("this {what} is too large to represent")).at(span.clone()));
        };
        let value = match value.into_inner() {
            DeValue::Boolean(value) => Value::Bool(value),
            DeValue::Integer(digits) => {
                Value::Int(i64::from_str_radix(digits.as_str(), digits.radix()).unwrap_or_else(|_| {
                    too_large("whole number");
                    0
                }))
            }
            DeValue::Float(digits) => {
                let value: f64 = digits.as_str().parse().unwrap_or(f64::NAN);
                if value.is_infinite() && !digits.as_str().contains("inf") {
                    too_large("number");
                }
                Value::Float(value)
            }
            DeValue::String(text) => Value::String(text.into_owned()),
            DeValue::Datetime(date) => Value::Datetime(date.to_string()),
            DeValue::Array(items) => Value::Array(items.into_iter().map(|item| self.node(item, faults)).collect()),
            DeValue::Table(table) => Value::Table(self.table(table, faults)),
        };
        Node { span, value }
    }
}
