//! What the renderer makes of a shader, for people to read.

use std::fmt;

use super::TRIAL_HITS;
use crate::diag::Diagnostic;
use crate::shade::analysis::{Analysis, OutputFact};
use crate::shade::names::{AOV_PREFIX, InputSet, OutputSet, PAIR_INPUTS, PairSet};
use crate::shade::params::{Params, Value};
use crate::shade::program::{Mode, Shader};

/// What the renderer makes of a shader. `Display` is what `tusche shader check` prints.
#[derive(Clone, Debug)]
pub struct Report {
    /// How it is run.
    pub mode: Mode,
    /// For an interpreted shader: the construct because of which it is, if one is to blame.
    pub blame: Option<Diagnostic>,
    /// Of a shader that is not constant: nanoseconds of CPU time for each hit, measured on this machine.
    pub nanoseconds_per_hit: Option<f64>,
    /// Trial hits that the interpreter was run for. Of a kernel: those that it gave up.
    pub interpreted_hits: u64,
    /// What it reads and writes.
    pub analysis: Analysis,
    /// Its parameters, with the values that were set.
    pub params: Params,
    /// What is known of its `line`, if it has one.
    pub line: Option<LineReport>,
}

/// What the renderer makes of a shader's `line(pair, p)`.
#[derive(Clone, Debug)]
pub struct LineReport {
    /// How it is run.
    pub mode: Mode,
    /// If it is interpreted: the construct because of which it is.
    pub blame: Option<Diagnostic>,
    /// Names of what is read on `pair` (of either side), in the order of the contract.
    pub reads: Vec<&'static str>,
}

impl Report {
    pub(super) fn new(shader: &Shader, nanoseconds_per_hit: Option<f64>, interpreted_hits: u64) -> Self {
        Self {
            mode: shader.mode(),
            blame: shader.blame_diagnostic(),
            nanoseconds_per_hit,
            interpreted_hits,
            analysis: shader.analysis().clone(),
            params: shader.params().clone(),
            line: shader.line_mode().map(|mode| LineReport {
                mode,
                blame: shader.line_blame(),
                reads: names_on_pair(shader.pair_needs()),
            }),
        }
    }

    /// Names of the inputs that are read, in the order of the contract. `texture` stands for uv sets beyond the first.
    #[must_use]
    pub fn inputs(&self) -> Vec<&'static str> {
        input_names(self.analysis.inputs)
    }

    /// The outputs that may be written, by key, in the order of the contract, extra ones last.
    #[must_use]
    pub fn outputs(&self) -> Vec<(String, &OutputFact)> {
        let named = OutputSet::named().map(|(name, output)| (name.to_owned(), self.analysis.output(output)));
        let extra = self.analysis.aovs.iter().map(|(name, fact)| (format!("{AOV_PREFIX}{name}"), fact));
        named.filter(|(_, fact)| fact.may).chain(extra.filter(|(_, fact)| fact.may)).collect()
    }
}

fn names_on_pair(inputs: PairSet) -> Vec<&'static str> {
    PAIR_INPUTS.iter().filter(|input| inputs.contains(input.input)).map(|input| input.name).collect()
}

/// Names of inputs, in the order of the contract.
pub(crate) fn input_names(inputs: InputSet) -> Vec<&'static str> {
    let mut names: Vec<_> =
        InputSet::named().filter(|(_, input)| inputs.contains(*input)).map(|(name, _)| name).collect();
    if inputs.contains(InputSet::MORE_UVS) {
        names.push("texture");
    }
    names
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.mode {
            Mode::Constant => writeln!(f, "  mode        constant: evaluated once")?,
            Mode::Kernel => writeln!(f, "  mode        kernel: runs over batches of hits")?,
            Mode::Interpreted => writeln!(f, "  mode        interpreted, at every hit")?,
        }
        if let Some(blame) = &self.blame {
            let place = blame.span.as_ref().map(|span| format!("{span:?}: ")).unwrap_or_default();
            writeln!(f, "  because     {place}{}", blame.message)?;
        }
        if let Some(cost) = self.nanoseconds_per_hit {
            writeln!(f, "  cost        {cost:.0} ns a hit, measured here")?;
        }
        if self.mode == Mode::Kernel && self.interpreted_hits > 0 {
            let hits = self.interpreted_hits;
            writeln!(f, "  gives up    {hits} of {TRIAL_HITS} trial hits, which the interpreter runs")?;
        }
        let inputs = self.inputs();
        let reads = match self.analysis.complete {
            false => "all inputs, since the analysis is not complete".to_owned(),
            true if inputs.is_empty() => "no input".to_owned(),
            true => inputs.join(" "),
        };
        writeln!(f, "  reads       {reads}")?;
        let outputs = self.outputs();
        if !self.analysis.complete {
            writeln!(f, "  writes      all outputs, since the analysis is not complete")?;
        } else if outputs.is_empty() {
            writeln!(f, "  writes      nothing: every output has its default")?;
        }
        let width = outputs.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
        for (index, (name, fact)) in outputs.iter().enumerate().filter(|_| self.analysis.complete) {
            let title = if index == 0 { "writes" } else { "" };
            let unit = if name == "line_width" { " px" } else { "" };
            writeln!(f, "  {title:<11} {name:<width$}  {}", describe(fact, unit))?;
        }
        if let Some(width) = self.params.max_line_width() {
            writeln!(f, "  declares    lines of at most {width} px")?;
        }
        if let Some(line) = &self.line {
            let mode = if line.mode == Mode::Kernel { "kernel" } else { "interpreted, at every line" };
            let reads = if line.reads.is_empty() { "nothing".to_owned() } else { line.reads.join(" ") };
            writeln!(f, "  line        {mode}; reads {reads}")?;
        }
        Ok(())
    }
}

/// `sometimes, 0.2 … 0.6, from uv normal`
fn describe(fact: &OutputFact, unit: &str) -> String {
    let mut parts = Vec::new();
    if !fact.always {
        parts.push("sometimes".to_owned());
    }
    if let Some(constant) = &fact.constant {
        parts.push(format!("constant {}{unit}", value(constant)));
    } else {
        parts.extend(fact.range.and_then(|range| bounds(range, unit)));
        if fact.inputs.is_empty() {
            parts.push("constant".into());
        }
    }
    if !fact.inputs.is_empty() {
        parts.push(format!("from {}", input_names(fact.inputs).join(" ")));
    }
    parts.join(", ")
}

/// `0.2 … 0.6`, `at least 0`, …; nothing if there is no bound that tells something.
fn bounds([low, high]: [f32; 2], unit: &str) -> Option<String> {
    match (low > -UNTOLD, high < UNTOLD) {
        (true, true) if low == high => Some(format!("{}{unit}", number(low))),
        (true, true) => Some(format!("{} … {}{unit}", number(low), number(high))),
        (true, false) => Some(format!("at least {}{unit}", number(low))),
        (false, true) => Some(format!("at most {}{unit}", number(high))),
        (false, false) => None,
    }
}

/// Bounds of this size come from what positions and radiance are limited to at all, and are not told.
const UNTOLD: f32 = 1e15;

fn value(value: &Value) -> String {
    let list = |channels: &[f32]| format!("({})", channels.iter().map(|x| number(*x)).collect::<Vec<_>>().join(", "));
    match value {
        Value::Unit => "()".into(),
        Value::Bool(x) => x.to_string(),
        Value::Int(x) => x.to_string(),
        Value::Float(x) => number(*x),
        Value::Vec2(v) => list(&v.to_array()),
        Value::Vec3(v) => list(&v.to_array()),
        Value::Vec4(v) => list(&v.to_array()),
        Value::Text(text) => format!("{text:?}"),
        Value::Texture(_) => "a texture".into(),
        Value::Record(_) => "a record".into(),
        Value::Array(_) => "an array".into(),
    }
}

/// A number with four digits that count: bounds are rounded outwards by a few units in the last place, which nobody needs
/// to read.
fn number(x: f32) -> String {
    if x.is_infinite() {
        return if x > 0.0 { "∞" } else { "−∞" }.into();
    }
    // As `1.234e-2`, read again and written without an exponent.
    let rounded: f32 = format!("{x:.3e}").parse().unwrap_or(x);
    match rounded.abs() {
        size if size != 0.0 && !(1e-4..1e7).contains(&size) => format!("{rounded:e}"),
        // Adding 0 leaves no −0.
        _ => format!("{}", rounded + 0.0),
    }
}
