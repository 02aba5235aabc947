//! Expressions: literals, variables, logic, and calls.

use std::rc::Rc;

use rhai::{Dynamic, Expr, FnCallExpr, FnPtr, Position};

use super::super::ir::Operand;
use super::meaning::{Captured, Closure, Field, Meaning, Range, Record};
use super::{Flow, Lowerer, MAX_PARTS};

/// Functions of the script engine that run or make code, look at variables by name, or change their first argument.
const BEYOND: [&str; 9] =
    ["eval", "Fn", "exit", "is_def_var", "is_def_fn", "is_shared", "type_of", "mixin", "fill_with"];

impl Lowerer<'_> {
    /// Evaluates an expression.
    pub(super) fn expression(&mut self, expression: &Expr) -> Flow<Meaning> {
        if self.is_dead() {
            return Ok(Meaning::Undefined);
        }
        self.step(expression.position())?;
        let meaning = match expression {
            Expr::BoolConstant(x, _) => Meaning::bool(*x),
            Expr::IntegerConstant(x, _) => Meaning::int(*x),
            Expr::FloatConstant(x, _) => Meaning::float(**x),
            Expr::StringConstant(text, _) => Meaning::Text(text.as_str().into()),
            Expr::Unit(_) => Meaning::Unit,
            Expr::DynamicConstant(value, position) => match self.literal(value) {
                Some(meaning) => meaning,
                None => return self.give_up(*position, "a value of this type"),
            },
            Expr::Array(items, position) => {
                let items = self.expressions(items)?;
                self.sized(Meaning::Array(Rc::new(items)), *position)?
            }
            Expr::Map(map, position) => {
                let mut record = Record::new();
                for (key, value) in &map.0 {
                    let value = self.expression(value)?;
                    record.insert(key.name.as_str().into(), Field { value, present: Operand::TRUE });
                }
                self.sized(Meaning::Record(Rc::new(record)), *position)?
            }
            Expr::Variable(variable, _, position) => {
                let (_, name, namespace, _) = &**variable;
                if !namespace.is_empty() {
                    return self.give_up(*position, "a name of a module");
                }
                self.variable(name, *position)?
            }
            Expr::ThisPtr(position) => self.variable("this", *position)?,
            Expr::Stmt(block) => self.block(block.statements())?,
            Expr::FnCall(call, position) => self.function_call(call, *position)?,
            Expr::Dot(..) | Expr::Index(..) => self.chain(expression)?,
            Expr::And(terms, _) => self.logic(terms, false)?,
            Expr::Or(terms, _) => self.logic(terms, true)?,
            Expr::Coalesce(terms, _) => self.coalesce(terms)?,
            Expr::InterpolatedString(_, position) => return self.give_up(*position, "a text made from values"),
            Expr::CharConstant(_, position) => return self.give_up(*position, "a character"),
            other => return self.give_up(other.position(), "this expression"),
        };
        Ok(if self.is_dead() { Meaning::Undefined } else { meaning })
    }

    /// Evaluates expressions from left to right.
    pub(super) fn expressions(&mut self, expressions: &[Expr]) -> Flow<Vec<Meaning>> {
        expressions.iter().map(|expression| self.expression(expression)).collect()
    }

    /// Refuses values that come near the engine's limits of size, which the interpreter checks at each step.
    pub(super) fn sized(&self, meaning: Meaning, position: Position) -> Flow<Meaning> {
        if meaning.count_parts(MAX_PARTS + 1) > MAX_PARTS {
            return self.give_up(position, &format!("{} of more than {MAX_PARTS} parts", meaning.name()));
        }
        Ok(meaning)
    }

    /// A value that the script engine has folded, or of a case.
    pub(super) fn literal(&self, value: &Dynamic) -> Option<Meaning> {
        if value.is_unit() {
            return Some(Meaning::Unit);
        }
        if let Ok(x) = value.as_bool() {
            return Some(Meaning::bool(x));
        }
        if let Ok(x) = value.as_int() {
            return Some(Meaning::int(x));
        }
        if let Ok(x) = value.as_float() {
            return Some(Meaning::float(x));
        }
        if let Ok(text) = value.as_immutable_string_ref() {
            return Some(Meaning::Text(text.as_str().into()));
        }
        if let Ok(items) = value.as_array_ref() {
            return Some(Meaning::Array(Rc::new(items.iter().map(|item| self.literal(item)).collect::<Option<_>>()?)));
        }
        if let Ok(map) = value.as_map_ref() {
            let fields = map.iter().map(|(key, value)| {
                Some((Rc::from(key.as_str()), Field { value: self.literal(value)?, present: Operand::TRUE }))
            });
            return Some(Meaning::Record(Rc::new(fields.collect::<Option<_>>()?)));
        }
        if let Some(range) = value.read_lock::<std::ops::Range<i64>>() {
            let (low, end) = (Operand::Int(range.start), Operand::Int(range.end));
            return Some(Meaning::Range(Range { low, end, inclusive: false }));
        }
        if let Some(range) = value.read_lock::<std::ops::RangeInclusive<i64>>() {
            let (low, end) = (Operand::Int(*range.start()), Operand::Int(*range.end()));
            return Some(Meaning::Range(Range { low, end, inclusive: true }));
        }
        let pointer = value.read_lock::<FnPtr>()?;
        let captured = pointer.iter_curry().map(|value| self.literal(value).map(Captured::Value));
        let captured = captured.collect::<Option<Vec<_>>>()?;
        Some(Meaning::Closure(Rc::new(Closure { function: pointer.fn_name().into(), captured })))
    }

    fn variable(&mut self, name: &str, position: Position) -> Flow<Meaning> {
        match self.find(name) {
            Some(cell) => Ok(self.cells[cell].meaning.clone()),
            None => self.give_up(position, &format!("the name `{name}`")),
        }
    }

    /// `&&` (`decisive` false) and `||` (`decisive` true): the first decisive term ends it.
    fn logic(&mut self, terms: &[Expr], decisive: bool) -> Flow<Meaning> {
        let Some((term, others)) = terms.split_first() else {
            return Ok(Meaning::bool(!decisive));
        };
        let value = self.expression(term)?;
        let first = self.truth(&value, term.position())?;
        if others.is_empty() {
            return Ok(Meaning::Bool(first));
        }
        let decided = if decisive { first } else { self.builder.not(first) };
        let value = self.branch(decided, |_| Ok(Meaning::bool(decisive)), |lowerer| lowerer.logic(others, decisive))?;
        Ok(value)
    }

    fn coalesce(&mut self, terms: &[Expr]) -> Flow<Meaning> {
        let Some((term, others)) = terms.split_first() else { return Ok(Meaning::Unit) };
        let first = self.expression(term)?;
        match &first {
            Meaning::Unit => self.coalesce(others),
            Meaning::Choice(mask, sides) => {
                let mask = match (&sides[0], &sides[1]) {
                    (Meaning::Unit, Meaning::Choice(..)) | (Meaning::Choice(..), _) => {
                        return self.give_up(term.position(), "`??` after such a value");
                    }
                    (Meaning::Unit, _) => *mask,
                    (_, Meaning::Unit) => self.builder.not(*mask),
                    _ => return Ok(first),
                };
                let known = if sides[0] == Meaning::Unit { sides[1].clone() } else { sides[0].clone() };
                self.branch(mask, |lowerer| lowerer.coalesce(others), |_| Ok(known))
            }
            _ => Ok(first),
        }
    }

    /// A call in the form `f(a, b)`, or an operator.
    pub(super) fn function_call(&mut self, call: &FnCallExpr, position: Position) -> Flow<Meaning> {
        let name = call.name.as_str();
        if call.capture_parent_scope || BEYOND.contains(&name) {
            return self.give_up(position, &format!("`{name}`"));
        }
        if call.is_qualified() {
            return self.give_up(position, "a module's function");
        }
        if name == "curry" {
            return self.curry(call, position);
        }
        // The engine reads a variable in first place after it has evaluated the other arguments.
        let is_variable = matches!(call.args.first(), Some(Expr::ThisPtr(_) | Expr::Variable(..)));
        let arguments = match call.args.split_first() {
            Some((first, others)) if is_variable => {
                let mut arguments = self.expressions(others)?;
                arguments.insert(0, self.expression(first)?);
                arguments
            }
            _ => self.expressions(&call.args)?,
        };
        if self.is_dead() {
            return Ok(Meaning::Undefined);
        }
        if name == "call"
            && let Some((Meaning::Closure(closure), arguments)) = arguments.split_first()
        {
            return self.call_closure(closure, arguments.to_vec(), position);
        }
        if let Some(function) = self.functions.get(&(name.to_owned(), arguments.len())) {
            self.refuse_shared(&call.args, position)?;
            return self.call(function, name, arguments, None, position);
        }
        self.native(name, arguments, position)
    }

    /// A variable that a closure has captured stays shared when it is passed on.
    fn refuse_shared(&self, arguments: &[Expr], position: Position) -> Flow<()> {
        let is_shared = |argument: &Expr| match argument {
            Expr::Variable(variable, ..) => self.find(&variable.1).is_some_and(|cell| self.cells[cell].shared),
            _ => false,
        };
        if arguments.iter().any(is_shared) {
            return self.give_up(position, "passing on a variable that a closure has captured");
        }
        Ok(())
    }

    /// What the parser makes of a closure that captures variables.
    fn curry(&mut self, call: &FnCallExpr, position: Position) -> Flow<Meaning> {
        let Some((first, others)) = call.args.split_first() else { return self.give_up(position, "`curry`") };
        let Meaning::Closure(closure) = self.expression(first)? else { return self.give_up(position, "`curry`") };
        let mut captured = closure.captured.clone();
        for argument in others {
            let Expr::Variable(variable, ..) = argument else { return self.give_up(position, "`curry`") };
            let Some(cell) = self.find(&variable.1) else { return self.give_up(position, "this captured variable") };
            captured.push(Captured::Variable { cell, identity: self.cells[cell].identity });
        }
        Ok(Meaning::Closure(Rc::new(Closure { function: Rc::clone(&closure.function), captured })))
    }

    pub(super) fn call_closure(
        &mut self,
        closure: &Closure,
        arguments: Vec<Meaning>,
        position: Position,
    ) -> Flow<Meaning> {
        let count = closure.captured.len() + arguments.len();
        let Some(function) = self.functions.get(&(closure.function.to_string(), count)) else {
            return self.give_up(position, "a closure called with another number of arguments");
        };
        let cells = self.cells.len();
        let mut names = Vec::new();
        let mut parameters = function.parameters.iter();
        for (captured, parameter) in closure.captured.iter().zip(parameters.by_ref()) {
            let cell = match captured {
                Captured::Variable { cell, identity } => {
                    if self.cells.get(*cell).is_none_or(|cell| cell.identity != *identity) {
                        return self.give_up(position, "a closure that outlives a variable that it has captured");
                    }
                    *cell
                }
                Captured::Value(value) => self.new_cell(value.clone(), false),
            };
            names.push((parameter.as_str().into(), cell));
        }
        for (argument, parameter) in arguments.into_iter().zip(parameters) {
            names.push((parameter.as_str().into(), self.new_cell(argument, false)));
        }
        let value = self.inline(function, &closure.function, names, position)?;
        self.cells.truncate(cells);
        Ok(value)
    }
}
