//! What a material's shader reads and writes, found from its script's syntax tree and parameters (DESIGN section 4.3).
//!
//! `surface` is interpreted abstractly: each value is replaced by what is known of it (type, bounds, and the inputs it
//! depends on), with the material's parameters as constants. Branches that the parameters rule out are not walked, so a
//! material without a texture reads no uv, and one whose metalness is 0 is no mirror.
//!
//! 1. `interval` bounds floats; `value` says what is known of a value, and joins what is known on two paths.
//! 2. `walk` holds variables, calls and findings; `statements`, `expressions` and `chains` walk the syntax tree.
//! 3. `operators`, `functions`, `geometry` and [`inputs`] give the bounds of what scripts compute and read.
//! 4. Here, the record that `surface` returns becomes an [`Analysis`].
//!
//! # What the facts promise
//! They hold for every hit at which the script ends without an error, whatever the inputs are (within what the host
//! promises of them, see [`inputs::LIMIT`]), and never claim less than what can happen: where the walk does not
//! understand, it takes a value as unknown, or gives up and says so ([`Analysis::complete`], [`Analysis::blame`]).
//! Functions that neither the library nor the script defines are taken to be pure. The walk is bounded in time.

mod chains;
mod closure;
mod expressions;
mod functions;
mod geometry;
pub mod inputs;
mod interval;
mod operators;
#[cfg(test)]
mod soundness;
mod statements;
mod switch;
mod value;
pub(in crate::shade) mod walk;

use std::collections::BTreeSet;
use std::fmt;
use std::rc::Rc;
use std::sync::Arc;

use self::value::{Abstract, Field, KeysOf, NOWHERE, Place, Record, Shape};
use self::walk::{Flow, Walker};
use super::link;
use super::names::{AOV_PREFIX, InputSet, OutputSet, line_outputs};
use super::params::{Params, Value};
use super::script::{Entry, Functions, Program};
use crate::diag;
use crate::scene::attributes::AttributeSet;
use crate::scene::texture::Texture;

/// What is known of one output.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OutputFact {
    /// Whether the key may be in the record at all. A key whose value is `()` counts as left out.
    pub may: bool,
    /// Whether the key is in the record at every hit.
    pub always: bool,
    /// The inputs that its value (or its presence) depends on.
    pub inputs: InputSet,
    /// Least and greatest value of any channel, where bounds are known; NaN is possible only if `None`.
    pub range: Option<[f32; 2]>,
    /// The value, if it is known and the same wherever the key is in the record.
    pub constant: Option<Value>,
}

/// Something in a script that is certainly wrong, or beyond analysis.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Finding {
    /// Which file it is in: 0 is the script itself, 1 and up are its modules.
    pub file: usize,
    /// Line and column, both from 1; 0 where the script engine does not know.
    pub place: (usize, usize),
    /// What is wrong, in one sentence without a full stop.
    pub message: String,
    /// What to do about it.
    pub hint: Option<String>,
}

/// What a material's shader reads and writes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Analysis {
    /// Inputs that code which may run reads.
    pub inputs: InputSet,
    /// One fact for each [`OutputSet`] flag, in the order of the bits.
    pub outputs: Vec<OutputFact>,
    /// Extra outputs, by name without `aov_`, sorted.
    pub aovs: Vec<(String, OutputFact)>,
    /// Attributes that code which may run asks for, sorted.
    pub attributes: Vec<String>,
    /// Parameters that code which may run reads.
    pub parameters: BTreeSet<String>,
    /// Whether the facts are known to be complete. If not, all inputs are assumed read and all outputs written.
    pub complete: bool,
    /// If not complete: the construct that stopped the analysis.
    pub blame: Option<Finding>,
    /// What is certainly wrong in code that may run: unknown inputs, outputs and parameters. By place.
    pub findings: Vec<Finding>,
}

/// Analyses the function `surface(hit, p)` of a compiled script, for a material with these parameters. `textures` is
/// the scene's table, which texture parameters point into.
#[must_use]
pub fn analyse(ast: &rhai::AST, params: &Params, textures: &[Arc<Texture>]) -> Analysis {
    let functions = link::functions(ast);
    analyse_functions(&functions, Entry::Surface, Some(&("surface".to_owned(), 2)), params, textures, &[])
}

/// The same for a program, and for each of its functions that the renderer calls. What is said of inputs is of those of
/// hits, and means nothing of `line`.
/// `attributes` are the sets that hits of the material can have.
pub(super) fn analyse_program(
    program: &Program,
    entry: Entry,
    params: &Params,
    textures: &[Arc<Texture>],
    attributes: &[&AttributeSet],
) -> Analysis {
    analyse_functions(&program.functions, entry, program.key(entry), params, textures, attributes)
}

fn analyse_functions(
    functions: &Functions,
    entry: Entry,
    key: Option<&(String, usize)>,
    params: &Params,
    textures: &[Arc<Texture>],
    attributes: &[&AttributeSet],
) -> Analysis {
    let mut walker = Walker::new(functions, textures, attributes);
    match walk_entry(&mut walker, entry, key, params) {
        Ok(Some(record)) => {
            let mut analysis = Analysis::empty(walker.inputs);
            for (key, field) in &record.fields {
                analysis.add(entry, key, field, &mut walker);
            }
            analysis.aovs.sort_by(|a, b| a.0.cmp(&b.0));
            analysis.parameters = walker.parameters.iter().map(|name| (**name).to_owned()).collect();
            analysis.findings = walker.findings.into_iter().collect();
            analysis.attributes = walker.attributes.into_iter().collect();
            analysis
        }
        // No path ends without an error, so nothing is ever written.
        Ok(None) => Analysis {
            findings: walker.findings.into_iter().collect(),
            attributes: walker.attributes.into_iter().collect(),
            ..Analysis::empty(walker.inputs)
        },
        Err(_) => Analysis { blame: walker.blame, findings: walker.findings.into_iter().collect(), ..unknown() },
    }
}

/// What is assumed of a script of which nothing is known.
#[must_use]
pub fn unknown() -> Analysis {
    let fact = OutputFact { may: true, inputs: InputSet::all(), ..OutputFact::default() };
    Analysis {
        inputs: InputSet::all(),
        outputs: vec![fact; OutputSet::all().bits().count_ones() as usize],
        complete: false,
        ..Analysis::default()
    }
}

/// The record that is returned; `None` if none ever is.
fn walk_entry(
    walker: &mut Walker,
    entry: Entry,
    key: Option<&(String, usize)>,
    params: &Params,
) -> Flow<Option<Rc<Record>>> {
    let start = rhai::Position::NONE;
    let Some(function) = key.and_then(|(name, count)| walker.script_function(name, *count)) else {
        return walker.give_up(start, &format!("a script without `{}`", entry.form()));
    };
    let mut fields = Record { keys_of: KeysOf::Parameters, ..Record::default() };
    for (name, value) in params.0.iter() {
        let shape = Shape::from_value(value, walker.textures.len(), &mut || walker.fresh());
        let value = Abstract::constant(shape, walker.fresh());
        fields.fields.insert(name.as_str().into(), Field::always(value, NOWHERE));
    }
    let parameters = Abstract::constant(Shape::Record(Rc::new(fields)), walker.fresh());
    let first = match entry {
        Entry::Surface => walker.constant(Shape::Hit),
        Entry::Line => inputs::pair(walker),
    };
    let arguments = [first, parameters].into_iter().take(function.parameters.len()).collect();
    let returned = match walker.script_call(function, arguments, None, start) {
        Ok((value, _)) => value,
        Err(walk::Stop::Left) => return Ok(None),
        Err(walk::Stop::GaveUp) => return Err(walk::Stop::GaveUp),
    };
    match returned.shape {
        Shape::Record(record) => Ok(Some(record)),
        _ => {
            let end = function.body.last().map_or(start, rhai::Stmt::position);
            let what = format!("what `{}` returns, which is not always a record with known keys,", entry.name());
            walker.give_up(end, &what)
        }
    }
}

impl Analysis {
    /// The fact of one output.
    ///
    /// # Panics
    /// If `output` is not exactly one flag.
    #[must_use]
    pub fn output(&self, output: OutputSet) -> &OutputFact {
        assert!(output.bits().is_power_of_two());
        &self.outputs[output.bits().trailing_zeros() as usize]
    }

    /// The outputs that may be in the record.
    #[must_use]
    pub fn writable(&self) -> OutputSet {
        OutputSet::all().iter().filter(|output| self.output(*output).may).collect()
    }

    /// Whether every output is the same at all hits, so that one evaluation serves the whole material.
    #[must_use]
    pub fn is_constant(&self) -> bool {
        self.complete && self.inputs.is_empty()
    }

    /// A shader that writes nothing.
    fn empty(inputs: InputSet) -> Self {
        let outputs = vec![OutputFact::default(); OutputSet::all().bits().count_ones() as usize];
        Self { inputs, outputs, complete: true, ..Self::default() }
    }

    /// Takes in a key of the returned record.
    fn add(&mut self, entry: Entry, key: &str, field: &Field, walker: &mut Walker) {
        if entry == Entry::Line && !line_outputs().any(|known| known == key) {
            let names: Vec<_> = line_outputs().map(|name| format!("`{name}`")).collect();
            let hint = nearest_hint(key, line_outputs())
                .unwrap_or_else(|| format!("it gives {}; all else is decided by `surface`", names.join(" and ")));
            let message = format!("`{}` gives no `{key}`", entry.name());
            walker.findings.insert(Finding::new(field.place, message, Some(hint)));
            return;
        }
        if let Some(name) = key.strip_prefix(AOV_PREFIX) {
            self.aovs.push((name.to_owned(), fact(field, walker)));
            return;
        }
        match OutputSet::spelled(key) {
            Some(output) => self.outputs[output.bits().trailing_zeros() as usize] = fact(field, walker),
            None => {
                let names = OutputSet::named().map(|(name, _)| name);
                let message = format!("there is no output `{key}`");
                let hint = nearest_hint(key, names).or_else(|| {
                    let all: Vec<_> = OutputSet::named().map(|(name, _)| name).collect();
                    Some(format!(
                        "there are: {}; a layer of your own is called `{AOV_PREFIX}` and a name",
                        all.join(", ")
                    ))
                });
                walker.findings.insert(Finding::new(field.place, message, hint));
            }
        }
    }
}

fn fact(field: &Field, walker: &mut Walker) -> OutputFact {
    let Abstract { shape, .. } = &field.value;
    if *shape == Shape::Unit {
        return OutputFact::default();
    }
    OutputFact {
        may: true,
        always: field.always,
        inputs: walker.escape(&field.value) | field.presence,
        // Adding 0 leaves no −0, which nobody would understand.
        range: shape.range().filter(|range| !range.nan).map(|range| [range.low + 0.0, range.high + 0.0]),
        constant: shape.to_value(),
    }
}

/// A hint that names the candidate that was perhaps meant.
fn nearest_hint<'c>(name: &str, candidates: impl Iterator<Item = &'c str>) -> Option<String> {
    diag::nearest(name, candidates).map(|near| format!("did you mean `{near}`?"))
}

impl fmt::Display for OutputFact {
    /// `always, [0.2, 0.6], from uv normal`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match (self.may, self.always) {
            (_, true) => "always",
            (true, false) => "sometimes",
            (false, false) => "never",
        })?;
        if let Some([low, high]) = self.range {
            write!(f, ", [{low:?}, {high:?}]")?;
        }
        if self.inputs.is_empty() { f.write_str(", constant") } else { write!(f, ", from {}", InputNames(self.inputs)) }
    }
}

impl fmt::Display for Analysis {
    /// One line for the inputs, one for each output that may be written, one for each finding.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "inputs: {}", InputNames(self.inputs))?;
        if !self.attributes.is_empty() {
            writeln!(f, "attributes: {}", self.attributes.join(" "))?;
        }
        if !self.complete {
            f.write_str("incomplete")?;
            if let Some(blame) = &self.blame {
                write!(f, ": {blame}")?;
            }
            writeln!(f)?;
        } else {
            for (name, output) in OutputSet::named() {
                let fact = self.output(output);
                if fact.may {
                    writeln!(f, "{name}: {fact}")?;
                }
            }
            for (name, fact) in &self.aovs {
                writeln!(f, "{AOV_PREFIX}{name}: {fact}")?;
            }
        }
        for finding in &self.findings {
            writeln!(f, "finding {finding}")?;
        }
        Ok(())
    }
}

impl Finding {
    fn new((file, line, column): Place, message: String, hint: Option<String>) -> Self {
        Self { file, place: (line, column), message, hint }
    }
}

impl fmt::Display for Finding {
    /// `line:column: message (hint)`; in modules with the number of the file before it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.file > 0 {
            write!(f, "module {}:", self.file)?;
        }
        write!(f, "{}:{}: {}", self.place.0, self.place.1, self.message)?;
        match &self.hint {
            Some(hint) => write!(f, " ({hint})"),
            None => Ok(()),
        }
    }
}

/// Shows inputs by name, in the order of their bits.
struct InputNames(InputSet);

impl fmt::Display for InputNames {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.is_empty() {
            return f.write_str("none");
        }
        if self.0.is_all() {
            return f.write_str("all");
        }
        for (i, (name, _)) in self.0.iter_names().enumerate() {
            write!(f, "{}{}", if i > 0 { " " } else { "" }, name.to_lowercase())?;
        }
        Ok(())
    }
}
