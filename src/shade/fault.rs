//! What goes wrong in a script, as a [`Diagnostic`] with its place.
//!
//! Rhai's errors carry a position and a sentence made for programmers of a host; here they become sentences for the
//! person who wrote the shader. Library functions raise a [`Fault`], which passes through the interpreter unchanged.

use std::sync::Arc;

use rhai::{Dynamic, EvalAltResult, LexError, ParseError, ParseErrorType, Position};

use super::closures;
use super::host::{MAX_ARRAY, MAX_CALL_DEPTH, MAX_EXPRESSION_DEPTH, MAX_MAP, MAX_OPERATIONS, MAX_TEXT};
use super::library;
use super::names::{AOV_PREFIX, OutputSet};
use super::script::Functions;
use crate::diag::{Diagnostic, Source, Span, nearest};

/// An error raised by a library function; the interpreter adds the place of the call.
#[derive(Clone, Debug)]
pub(super) struct Fault {
    pub message: String,
    pub hints: Vec<String>,
}

impl Fault {
    pub fn new(message: impl Into<String>) -> Self {
        Self { message: message.into(), hints: Vec::new() }
    }

    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hints.push(hint.into());
        self
    }

    /// The same, with the nearest of the names as a hint, or all of them if none is near.
    pub fn propose<'a>(self, word: &str, names: impl Iterator<Item = &'a str> + Clone) -> Self {
        match nearest(word, names.clone()) {
            Some(near) => self.hint(format!("did you mean `{near}`?")),
            None => {
                let all: Vec<_> = names.collect();
                if all.is_empty() { self } else { self.hint(format!("there are: {}", all.join(", "))) }
            }
        }
    }

    /// As a diagnostic at a place.
    pub fn at(self, span: Span) -> Diagnostic {
        self.hints.into_iter().fold(Diagnostic::error(self.message).at(span), Diagnostic::hint)
    }
}

impl From<Fault> for Box<EvalAltResult> {
    fn from(fault: Fault) -> Self {
        Box::new(EvalAltResult::ErrorRuntime(Dynamic::from(fault), Position::NONE))
    }
}

/// The span of a position; without one, the end of the text. A dot stands for the name behind it.
pub(super) fn span(source: &Arc<Source>, position: Position) -> Span {
    match position.line() {
        Some(line) => {
            let column = position.position().unwrap_or(1);
            let dot = source.text[source.offset(line, column)..].starts_with('.');
            Span::word_at(source, line, column + usize::from(dot))
        }
        None => Span::new(source, source.text.len()..source.text.len()),
    }
}

/// What the message of a script begins with that ran out of operations.
pub(super) const OUT_OF_OPERATIONS: &str = "the script did not finish within";

/// An error of the parser.
pub(super) fn from_parse_error(error: &ParseError, source: &Arc<Source>) -> Diagnostic {
    use ParseErrorType as Kind;
    let fault = match error.err_type() {
        Kind::UnexpectedEOF => Fault::new("the script ends too early").hint("is a closing `}` or `)` missing?"),
        Kind::BadInput(LexError::ImproperSymbol(_, told)) if !told.is_empty() => Fault::new(lower_first(told)),
        Kind::BadInput(LexError::UnterminatedString) => {
            Fault::new("this text has no end").hint("is a closing `\"` missing?")
        }
        Kind::VariableUndefined(name) => undefined_variable(name, source, error.position()),
        Kind::Reserved(word) => Fault::new(format!("`{word}` is a reserved word")).hint("give it another name"),
        Kind::ModuleUndefined(name) => Fault::new(format!("there is no module `{name}`")),
        Kind::ExprTooDeep => Fault::new(format!("this is nested more than {MAX_EXPRESSION_DEPTH} levels deep"))
            .hint("give parts of it a name with `let`, or put them into functions"),
        Kind::WrongFnDefinition => Fault::new("functions can only stand at the top level of the script"),
        Kind::FnDuplicatedDefinition(name, count) => {
            Fault::new(format!("there are two functions `{name}` with {count} parameters"))
        }
        Kind::MissingToken(token, place) if token == ":" && place.contains("object map") => {
            let key = place.split('\'').nth(1).unwrap_or_default();
            Fault::new(format!("expected `:` and a value after the key `{key}` of this record"))
                .hint("a record is written #{ base_color: rgb(0.8, 0.2, 0.1), line_width: 2.0 }")
        }
        Kind::MissingToken(token, place) => {
            let place = place.replace("object map literal", "record");
            let fault = Fault::new(format!("expected `{token}` {place}"));
            let rest = source.text[span(source, error.position()).range.start..].trim();
            if rest.is_empty() { fault.hint("the script ends here: is a closing `}` or `)` missing?") } else { fault }
        }
        Kind::WrongDocComment => Fault::new("a `///` comment must be followed by a function")
            .hint("write `//!` at the head of the file, and `//` elsewhere"),
        other => Fault::new(lower_first(&other.to_string())),
    };
    fault.at(span(source, error.position()))
}

/// An error of a run, at its innermost place. `files` and `functions` are the program's, `surface` is where to point if
/// the engine knows no place.
pub(super) fn from_run(
    error: &EvalAltResult,
    surface: &Span,
    files: &[Arc<Source>],
    functions: &Functions,
) -> Diagnostic {
    let mut place = error.position();
    let mut file = 0;
    let mut at = 0;
    let mut error = error;
    let mut callers = Vec::new();
    while let EvalAltResult::ErrorInFunctionCall(called, _, inner, call) = error {
        callers.push((called.as_str(), at, *call));
        // A closure is called within its own file.
        at = functions.iter().find(|((key, _), f)| key == called && !f.is_closure()).map_or(at, |(_, f)| f.file);
        error = inner;
        if !inner.position().is_none() {
            place = inner.position();
            file = at;
        }
    }
    let mut fault = explain(error, functions, file);
    for (called, from, call) in callers.iter().rev().filter(|(_, _, call)| !call.is_none()) {
        let (line, column) = (call.line().unwrap_or(0), call.position().unwrap_or(0));
        let what = match written(called, functions) {
            Some(name) => format!("`{name}`"),
            None => "the closure".to_owned(),
        };
        fault = fault.hint(if *from == file {
            format!("{what} was called at line {line}, column {column}")
        } else {
            format!("{what} was called at {}:{line}:{column}", files[*from].name)
        });
    }
    fault.at(if place.is_none() { surface.clone() } else { span(&files[file], place) })
}

/// A function's name as written; `None` for closures.
fn written<'n>(called: &'n str, functions: &'n Functions) -> Option<&'n str> {
    if called.starts_with(closures::PREFIX) {
        return None;
    }
    Some(functions.iter().find(|((key, _), _)| key == called).map_or(called, |(_, function)| &function.name))
}

fn explain(error: &EvalAltResult, functions: &Functions, file: usize) -> Fault {
    use EvalAltResult as Kind;
    match error {
        Kind::ErrorRuntime(token, _) => match token.read_lock::<Fault>() {
            Some(fault) => fault.clone(),
            None => Fault::new(format!("the script stopped itself: {token}")),
        },
        Kind::ErrorFunctionNotFound(signature, _) => unknown_function(signature, functions, file),
        Kind::ErrorVariableNotFound(name, _) => unknown_variable(name),
        Kind::ErrorPropertyNotFound(name, _) => Fault::new(format!("this record has no `{name}`"))
            .hint(format!("`\"{name}\" in record` tells whether it has")),
        Kind::ErrorDotExpr(message, _) => unknown_property(message),
        Kind::ErrorTooManyOperations(_) => Fault::new(format!("{OUT_OF_OPERATIONS} {MAX_OPERATIONS} operations"))
            .hint("is there a loop without an end?"),
        Kind::ErrorStackOverflow(_) => Fault::new(format!("functions call each other more than {MAX_CALL_DEPTH} deep"))
            .hint("does a function call itself without an end?"),
        Kind::ErrorDataTooLarge(what, _) if what.contains("string") => {
            Fault::new(format!("a text may have at most {MAX_TEXT} bytes"))
        }
        Kind::ErrorDataTooLarge(what, _) if what.contains("map") => {
            Fault::new(format!("a record may have at most {MAX_MAP} entries"))
        }
        Kind::ErrorDataTooLarge(..) => Fault::new(format!("an array may have at most {MAX_ARRAY} elements")),
        Kind::ErrorArithmetic(message, _) => Fault::new(lower_first(message)),
        Kind::ErrorArrayBounds(length, index, _) => {
            Fault::new(format!("index {index} is out of range: the array has {length} elements"))
                .hint("the first element is number 0")
        }
        Kind::ErrorIndexingType(types, _) => Fault::new(format!("this cannot be indexed: {types}")),
        Kind::ErrorMismatchDataType(wanted, found, _) => {
            Fault::new(format!("this must be {}, but it is {}", type_name(wanted), type_name(found)))
        }
        Kind::ErrorFor(_) => {
            Fault::new("`for` cannot run over this").hint("it runs over ranges such as `0..4`, arrays and texts")
        }
        Kind::ErrorAssignmentToConstant(name, _) => Fault::new(format!("`{name}` is constant and cannot be changed")),
        Kind::ErrorModuleNotFound(name, _) => Fault::new(format!("there is no module `{name}`")),
        other => {
            let mut text = other.to_string();
            if let Some(end) = text.rfind(" (line ") {
                text.truncate(end);
            }
            Fault::new(lower_first(&text))
        }
    }
}

/// A variable that the parser does not know: what else the text around it may mean.
fn undefined_variable(name: &str, source: &Source, position: Position) -> Fault {
    let start = source.offset(position.line().unwrap_or(1), position.position().unwrap_or(1));
    let behind = source.text[start..].strip_prefix(name).unwrap_or_default().trim_start();
    let is_key = OutputSet::spelled(name).is_some() || name.starts_with(AOV_PREFIX);
    if is_key && behind.starts_with(':') {
        return Fault::new(format!("there is no variable `{name}` here")).hint("a record begins with `#{`, not `{`");
    }
    let declared = |line: &str| {
        let mut words = line.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|word| !word.is_empty());
        matches!(words.next(), Some("let" | "const")) && words.next() == Some(name)
    };
    if source.text.lines().any(|line| !line.starts_with([' ', '\t']) && declared(line)) {
        return Fault::new(format!("there is no variable `{name}` here"))
            .hint("functions do not see what stands outside of them: move it into `params()` or into this function");
    }
    let fault = unknown_variable(name);
    let names = declared_names(&source.text);
    match nearest(name, names.iter().copied().filter(|known| *known != name)) {
        Some(near) if fault.hints.is_empty() => fault.hint(format!("did you mean `{near}`?")),
        _ => fault,
    }
}

/// Every name that a text declares by `let` or `const` anywhere.
fn declared_names(text: &str) -> Vec<&str> {
    let mut words = text.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|word| !word.is_empty());
    let mut names = Vec::new();
    while let Some(word) = words.next() {
        if matches!(word, "let" | "const") {
            names.extend(words.next());
        }
    }
    names
}

fn unknown_variable(name: &str) -> Fault {
    let fault = Fault::new(format!("there is no variable `{name}` here"));
    match name {
        "hit" | "p" => fault.hint(format!("a function sees only its own parameters: pass `{name}` on to it")),
        _ => fault,
    }
}

/// `signature` is as Rhai writes it: `name (type, type)`.
fn unknown_function(signature: &str, functions: &Functions, file: usize) -> Fault {
    let (name, types) = signature.split_once(" (").unwrap_or((signature, ")"));
    let types: Vec<_> =
        types.trim_end_matches(')').split(", ").filter(|name| !name.is_empty()).map(type_name).collect();
    let is_operator = !name.starts_with(|c: char| c.is_alphabetic() || c == '_');
    if is_operator {
        return match types.as_slice() {
            [left, right] => Fault::new(format!("`{name}` does not work between {left} and {right}")),
            _ => Fault::new(format!("`{name}` does not work on {}", types.join(", "))),
        };
    }
    if name.starts_with(closures::PREFIX) {
        return Fault::new("the closure is called with another number of arguments than it has parameters");
    }
    let all: Vec<(&str, usize)> = functions
        .iter()
        .filter(|(_, function)| function.file == file && !function.is_closure())
        .map(|((_, count), function)| (function.name.as_str(), *count))
        .collect();
    let own: Vec<_> = all.iter().filter(|(known, _)| *known == name).collect();
    let library: Vec<_> = library::functions().filter(|known| known.name == name).collect();
    if own.is_empty() && library.is_empty() {
        let names = all.iter().map(|(name, _)| *name).chain(library::functions().map(|f| f.name));
        let fault = Fault::new(format!("there is no function `{name}`"));
        return match nearest(name, names) {
            Some(near) => fault.hint(format!("did you mean `{near}`?")),
            None => fault,
        };
    }
    let mut fault = Fault::new(format!("`{name}` cannot be called with ({})", types.join(", ")));
    for (_, count) in own {
        fault = fault.hint(format!("the script's own `{name}` takes {count} parameters"));
    }
    for known in library {
        fault = fault.hint(format!("it is called as `{}`: {}", known.form, known.about));
    }
    fault
}

/// `message` is Rhai's: `Unknown property 'x' - a getter is not registered for type 'y'`.
fn unknown_property(message: &str) -> Fault {
    let quoted: Vec<_> = message.split('\'').collect();
    match quoted.as_slice() {
        [_, property, verb, owner, ..] => {
            let owner = type_name(owner);
            if verb.contains("setter") {
                Fault::new(format!("`{property}` of {owner} cannot be set"))
            } else {
                Fault::new(format!("{owner} has no `{property}`"))
            }
        }
        _ => Fault::new(lower_first(message)),
    }
}

/// How messages call a type, from Rhai's name for it.
pub(super) fn type_name(rhai: &str) -> String {
    match rhai {
        "i64" => "int",
        "f32" => "float",
        "&str | ImmutableString | String" | "string" => "text",
        "map" => "record",
        "Fn" => "function",
        other if other.contains("ops::range::Range") => "range",
        other => other,
    }
    .to_owned()
}

fn lower_first(text: &str) -> String {
    let mut letters = text.chars();
    match letters.next() {
        Some(first) => first.to_lowercase().chain(letters).collect(),
        None => String::new(),
    }
}
