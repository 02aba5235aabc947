//! Warnings from a script's text alone: what is never read, never called, never reached, or hides something else.
//!
//! Names that begin with `_` may be unused. A variable may take the name of an earlier one, of an input or of a function
//! (`let normal = hit.normal;`), which hides nothing: inputs are read on `hit`, and functions have names of their own.
//! What does hide something is a variable called like `surface`'s own arguments, and a function called like the library's.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use rhai::{ASTFlags, Expr, FnCallExpr, Position, Stmt};

use crate::diag::{Diagnostic, Diagnostics, Source};
use crate::shade::closures;
use crate::shade::fault;
use crate::shade::library;
use crate::shade::params::MAX_LINE_WIDTH;
use crate::shade::program::Shader;
use crate::shade::script::{Entry, ScriptFunction};

/// The arguments of `surface`, as every example calls them.
const HIT: &str = "hit";
const PARAMETERS: &str = "p";

pub(super) fn lint(shader: &Shader) -> Diagnostics {
    let program = &shader.program;
    // The functions of modules may serve other scripts.
    let own = || program.functions.iter().filter(|(_, function)| function.file == 0);
    let mut lint = Lint {
        source: &program.source,
        functions: own().map(|((key, _), _)| key.as_str()).collect(),
        warnings: Diagnostics::default(),
        scope: Vec::new(),
        uses: Uses::default(),
        keys: BTreeSet::new(),
        inputs_name: String::new(),
    };
    let mut uses = BTreeMap::new();
    for ((key, count), function) in own() {
        lint.function(&function.name, *count, function);
        uses.entry(key.as_str()).or_insert_with(Uses::default).extend(std::mem::take(&mut lint.uses));
    }
    let Lint { keys, mut warnings, .. } = lint;

    let surface = program.key(Entry::Surface).and_then(|key| program.functions.get(key));
    if surface.is_some_and(|surface| surface.parameters == [PARAMETERS, HIT]) {
        let message = format!("`surface` gets the hit first: here it is called `{PARAMETERS}`");
        let warning = Diagnostic::warning(message).at(program.surface.span.clone());
        warnings.push(warning.hint(format!("write: fn surface({HIT}, {PARAMETERS})")));
    }
    // Functions that nothing which the renderer calls gets to.
    let mut reached = BTreeSet::new();
    let from_outside = own().filter(|(_, function)| matches!(function.name.as_str(), "surface" | "line" | "params"));
    let mut next: Vec<String> = from_outside.map(|((key, _), _)| key.clone()).collect();
    while let Some(name) = next.pop() {
        if reached.insert(name.clone()) {
            next.extend(uses.get(name.as_str()).into_iter().flat_map(|uses| uses.0.iter().cloned()));
        }
    }
    for ((key, _), function) in own().filter(|(_, function)| !function.is_closure()) {
        let (name, span) = (&function.name, function.span.clone());
        if !reached.contains(key) && !name.starts_with('_') {
            warnings.push(Diagnostic::warning(format!("the function `{name}` is never called")).at(span.clone()));
        }
        let mut library = library::functions().filter(|known| known.name == *name && !known.form.starts_with("hit."));
        if let Some(hidden) = library.next() {
            let message = format!("this function hides the library's `{}`", hidden.form);
            warnings.push(Diagnostic::warning(message).at(span).hint("give it another name if both are meant"));
        }
    }
    for name in shader.params().0.keys() {
        if !keys.contains(name) && !shader.analysis().parameters.contains(name) && name != MAX_LINE_WIDTH {
            let span = program.key_span(name).unwrap_or_else(|| program.params_span());
            let warning = Diagnostic::warning(format!("the parameter `{name}` is never read"));
            warnings.push(warning.at(span).hint(format!("read it with `{PARAMETERS}.{name}`, or take it out")));
        }
    }
    warnings
}

/// Names that a function calls, or holds as values.
#[derive(Default)]
struct Uses(BTreeSet<String>);

impl Uses {
    fn extend(&mut self, other: Self) {
        self.0.extend(other.0);
    }
}

struct Variable {
    name: String,
    place: Position,
    /// Of an argument: whether it is the inputs or the parameters.
    holds: Option<&'static str>,
    is_read: bool,
}

struct Lint<'a> {
    source: &'a Arc<Source>,
    functions: BTreeSet<&'a str>,
    warnings: Diagnostics,
    /// Variables in scope, innermost last.
    scope: Vec<Variable>,
    uses: Uses,
    /// Names of properties and texts that are written anywhere, those read on the inputs aside.
    keys: BTreeSet<String>,
    /// What the current function calls the inputs.
    inputs_name: String,
}

impl Lint<'_> {
    fn warn(&mut self, position: Position, message: String, hint: Option<String>) {
        let warning = Diagnostic::warning(message).at(fault::span(self.source, position));
        self.warnings.push(match hint {
            Some(hint) => warning.hint(hint),
            None => warning,
        });
    }

    fn function(&mut self, name: &str, count: usize, function: &ScriptFunction) {
        let is_surface = name == "surface" && count == 2;
        self.inputs_name = match function.parameters.first() {
            Some(first) if is_surface => first.to_string(),
            _ => HIT.to_owned(),
        };
        let argument = |(index, name): (usize, &rhai::ImmutableString)| Variable {
            name: name.to_string(),
            place: Position::NONE,
            holds: match (name.as_str(), index) {
                (_, 0) if is_surface => Some("inputs"),
                (_, 1) if is_surface => Some("parameters"),
                (HIT, _) => Some("inputs"),
                (PARAMETERS, _) => Some("parameters"),
                _ => None,
            },
            is_read: true,
        };
        self.scope = function.parameters.iter().enumerate().map(argument).collect();
        self.statements(&function.body);
        self.leave(0);
    }

    /// Ends a block: forgets its variables, and says which of them were never read.
    fn leave(&mut self, depth: usize) {
        for variable in self.scope.split_off(depth.min(self.scope.len())) {
            if !variable.is_read && !variable.name.starts_with('_') {
                let message = format!("the variable `{}` is never read", variable.name);
                self.warn(variable.place, message, None);
            }
        }
    }

    fn block(&mut self, statements: &[Stmt]) {
        let depth = self.scope.len();
        self.statements(statements);
        self.leave(depth);
    }

    fn statements(&mut self, statements: &[Stmt]) {
        if let Some(last) = statements.iter().position(ends)
            // Said once for a block.
            && let Some(dead) = statements[last + 1..].iter().find(|dead| !matches!(dead, Stmt::Noop(_)))
        {
            self.warn(start(dead), "this is never reached".into(), reason(&statements[last]));
        }
        // What is not reached counts as use all the same: one fault, one warning.
        statements.iter().for_each(|statement| self.statement(statement));
    }

    fn statement(&mut self, statement: &Stmt) {
        match statement {
            Stmt::Expr(expression) => self.expression(expression),
            Stmt::FnCall(call, _) => self.call(call),
            Stmt::Block(block) => self.block(block.statements()),
            Stmt::Var(variable, ..) => {
                let (name, value, _) = &**variable;
                self.expression(value);
                self.declare(&name.name, name.pos);
            }
            Stmt::Assignment(assignment) => {
                let sides = &assignment.1;
                self.expression(&sides.rhs);
                self.target(&sides.lhs);
            }
            Stmt::If(flow, _) => {
                self.condition(&flow.expr, flow.body.statements(), flow.branch.statements());
                self.expression(&flow.expr);
                self.block(flow.body.statements());
                self.block(flow.branch.statements());
            }
            Stmt::While(flow, _) => {
                self.condition(&flow.expr, flow.body.statements(), &[]);
                self.expression(&flow.expr);
                self.block(flow.body.statements());
            }
            Stmt::Do(flow, ..) => {
                self.expression(&flow.expr);
                self.block(flow.body.statements());
            }
            Stmt::For(parts, _) => {
                let (item, counter, flow) = &**parts;
                self.expression(&flow.expr);
                let depth = self.scope.len();
                for name in counter.iter().chain([item]) {
                    self.declare(&name.name, name.pos);
                    // Rounds are often merely counted.
                    self.read(&name.name);
                }
                self.block(flow.body.statements());
                self.leave(depth);
            }
            Stmt::Switch(switch, _) => {
                self.expression(&switch.0);
                for case in &switch.1.expressions {
                    self.expression(&case.lhs);
                    self.expression(&case.rhs);
                }
            }
            Stmt::TryCatch(flow, _) => {
                self.block(flow.body.statements());
                let depth = self.scope.len();
                if let Expr::Variable(variable, _, place) = &flow.expr {
                    self.declare(&variable.1, *place);
                    self.read(&variable.1);
                }
                self.block(flow.branch.statements());
                self.leave(depth);
            }
            Stmt::BreakLoop(Some(value), ..) | Stmt::Return(Some(value), ..) => self.expression(value),
            Stmt::Import(import, _) => self.expression(&import.0),
            _ => {}
        }
    }

    /// Says so where a condition written as `true` or `false` keeps a branch from ever running.
    fn condition(&mut self, condition: &Expr, body: &[Stmt], branch: &[Stmt]) {
        let (dead, value) = match condition {
            Expr::BoolConstant(false, _) => (body, "false"),
            Expr::BoolConstant(true, _) => (branch, "true"),
            _ => return,
        };
        if let Some(first) = dead.first() {
            let hint = format!("the condition is always {value}");
            self.warn(start(first), "this is never reached".into(), Some(hint));
        }
    }

    fn declare(&mut self, name: &str, place: Position) {
        let hidden = self.scope.iter().find(|variable| variable.name == name).and_then(|variable| variable.holds);
        if let Some(what) = hidden {
            let message = format!("this hides `{name}`: the {what} cannot be read below");
            self.warn(place, message, Some("give it another name".into()));
        }
        self.scope.push(Variable { name: name.to_owned(), place, holds: None, is_read: false });
    }

    fn read(&mut self, name: &str) {
        match self.scope.iter_mut().rev().find(|variable| variable.name == name) {
            Some(variable) => variable.is_read = true,
            None if self.functions.contains(name) => {
                self.uses.0.insert(name.to_owned());
            }
            None => {}
        }
    }

    /// What is assigned to: a variable whose value or part is set is not read by that.
    fn target(&mut self, target: &Expr) {
        match target {
            Expr::Variable(..) => {}
            Expr::Dot(sides, ..) | Expr::Index(sides, ..) => {
                self.target(&sides.lhs);
                self.link(&sides.rhs, matches!(target, Expr::Index(..)), false);
            }
            other => self.expression(other),
        }
    }

    fn call(&mut self, call: &FnCallExpr) {
        self.uses.0.insert(call.name.to_string());
        call.args.iter().for_each(|argument| self.expression(argument));
    }

    fn expression(&mut self, expression: &Expr) {
        if let Some(closure) = closures::literal(expression) {
            self.uses.0.insert(closure.function);
        }
        match expression {
            Expr::Variable(variable, ..) => self.read(&variable.1),
            Expr::StringConstant(text, _) => {
                self.keys.insert(text.to_string());
            }
            Expr::InterpolatedString(parts, _) | Expr::Array(parts, _) => {
                parts.iter().for_each(|part| self.expression(part));
            }
            Expr::Map(map, _) => map.0.iter().for_each(|(_, value)| self.expression(value)),
            Expr::Stmt(block) => self.block(block.statements()),
            Expr::FnCall(call, _) | Expr::MethodCall(call, _) => self.call(call),
            Expr::Dot(sides, ..) | Expr::Index(sides, ..) => {
                let on_inputs = matches!(&sides.lhs, Expr::Variable(variable, ..) if *variable.1 == *self.inputs_name);
                self.expression(&sides.lhs);
                self.link(&sides.rhs, matches!(expression, Expr::Index(..)), on_inputs);
            }
            Expr::And(terms, _) | Expr::Or(terms, _) | Expr::Coalesce(terms, _) => {
                terms.iter().for_each(|term| self.expression(term));
            }
            _ => {}
        }
    }

    /// A link of a chain, behind a dot or (`is_index`) in brackets. `on_inputs` tells whether it is one of the inputs.
    fn link(&mut self, link: &Expr, is_index: bool, on_inputs: bool) {
        match link {
            Expr::Property(property, _) => {
                if !on_inputs {
                    self.keys.insert(property.2.to_string());
                }
            }
            Expr::Dot(sides, flags, _) | Expr::Index(sides, flags, _)
                if !(is_index && flags.contains(ASTFlags::BREAK)) =>
            {
                self.link(&sides.lhs, is_index, on_inputs);
                self.link(&sides.rhs, matches!(link, Expr::Index(..)), false);
            }
            other => self.expression(other),
        }
    }
}

/// Whether control never gets behind a statement.
fn ends(statement: &Stmt) -> bool {
    let any = |statements: &[Stmt]| statements.iter().any(ends);
    match statement {
        Stmt::Return(..) | Stmt::BreakLoop(..) => true,
        Stmt::Block(block) => any(block.statements()),
        Stmt::If(flow, _) => any(flow.body.statements()) && any(flow.branch.statements()),
        // `loop` and `while true`, unless they are left.
        Stmt::While(flow, _) => {
            matches!(flow.expr, Expr::Unit(_) | Expr::BoolConstant(true, _))
                && !flow.body.statements().iter().any(breaks)
        }
        Stmt::Expr(expression) => matches!(&**expression, Expr::Stmt(block) if any(block.statements())),
        _ => false,
    }
}

/// Whether a statement of a loop's body may leave that loop by `break`.
fn breaks(statement: &Stmt) -> bool {
    let any = |statements: &[Stmt]| statements.iter().any(breaks);
    match statement {
        Stmt::BreakLoop(_, flags, _) => flags.contains(ASTFlags::BREAK),
        Stmt::Block(block) => any(block.statements()),
        Stmt::If(flow, _) | Stmt::TryCatch(flow, _) => any(flow.body.statements()) || any(flow.branch.statements()),
        // A `break` inside of these belongs to them.
        Stmt::While(..) | Stmt::Do(..) | Stmt::For(..) => false,
        Stmt::Noop(_) | Stmt::FnCall(..) | Stmt::Return(..) => false,
        // What is left holds expressions, which may hold blocks: assume so.
        _ => true,
    }
}

/// Why nothing behind a statement is reached.
fn reason(statement: &Stmt) -> Option<String> {
    let line = statement.position().line()?;
    let what = match statement {
        Stmt::Return(_, flags, _) if flags.contains(ASTFlags::BREAK) => "`throw`",
        Stmt::Return(..) => "`return`",
        Stmt::BreakLoop(_, flags, _) if flags.contains(ASTFlags::BREAK) => "`break`",
        Stmt::BreakLoop(..) => "`continue`",
        Stmt::While(..) => "a loop without a `break`",
        _ => "code that always leaves",
    };
    Some(format!("line {line} has {what}"))
}

/// Where a statement begins.
fn start(statement: &Stmt) -> Position {
    match statement {
        Stmt::Assignment(assignment) => assignment.1.lhs.start_position(),
        other => other.position(),
    }
}
