//! Walking expressions: literals, variables, operators, and calls of the script's own functions.

use std::rc::Rc;

use rhai::{Dynamic, Expr, FnCallExpr, Position, Stmt};

use super::interval::Interval;
use super::value::{Abstract, Field, Record, Shape};
use super::walk::{Call, Flow, Stop, Variable, Variables, Walker};
use crate::shade::closures;
use crate::shade::script::ScriptFunction;

/// Functions of the script engine that run or make code, or look at variables by name.
pub(super) const BEYOND: [&str; 8] = ["eval", "Fn", "call", "curry", "exit", "is_def_var", "is_def_fn", "is_shared"];

impl<'a> Walker<'a> {
    /// Evaluates an expression.
    pub(super) fn expression(&mut self, expression: &Expr) -> Flow<Abstract> {
        self.step(expression.position())?;
        if let Some(closure) = closures::literal(expression) {
            return self.closure(&closure, expression.position());
        }
        match expression {
            Expr::BoolConstant(b, _) => Ok(self.constant(Shape::Bool(Some(*b)))),
            Expr::IntegerConstant(n, _) => Ok(self.constant(Shape::Int(*n, *n))),
            Expr::FloatConstant(x, _) => Ok(self.constant(Shape::Float(Interval::exact(**x)))),
            Expr::StringConstant(text, _) => Ok(self.constant(Shape::Text(Some(text.as_str().into())))),
            Expr::CharConstant(..) => Ok(self.constant(Shape::Unknown)),
            Expr::Unit(_) => Ok(self.unit()),
            Expr::DynamicConstant(value, position) => self.literal(value, *position),
            Expr::InterpolatedString(parts, _) => {
                let parts = self.expressions(parts)?;
                let text = self.unknown(&parts);
                Ok(self.value(Shape::Text(None), text.inputs))
            }
            Expr::Array(items, _) => {
                let items = self.expressions(items)?;
                Ok(self.constant(Shape::Array(Rc::new(items))))
            }
            Expr::Map(map, _) => {
                let mut record = Record::default();
                for (key, value) in &map.0 {
                    let value = self.expression(value)?;
                    record.fields.insert(key.name.as_str().into(), Field::always(value, self.place(key.pos)));
                }
                Ok(self.constant(Shape::Record(Rc::new(record))))
            }
            Expr::Variable(variable, _, position) => {
                let (_, name, namespace, _) = &**variable;
                let namespace = (!namespace.is_empty()).then(|| namespace.to_string());
                self.variable(name, namespace.as_deref(), *position)
            }
            Expr::ThisPtr(position) => self.variable("this", None, *position),
            Expr::Stmt(block) => self.block(block.statements()),
            Expr::FnCall(call, position) => self.function_call(call, *position),
            Expr::Dot(..) | Expr::Index(..) => self.chain(expression),
            Expr::And(terms, _) => self.logic(terms, false),
            Expr::Or(terms, _) => self.logic(terms, true),
            Expr::Coalesce(terms, _) => self.coalesce(terms),
            other => self.give_up(other.position(), "this expression"),
        }
    }

    /// Evaluates expressions from left to right.
    pub(super) fn expressions(&mut self, expressions: &[Expr]) -> Flow<Vec<Abstract>> {
        expressions.iter().map(|expression| self.expression(expression)).collect()
    }

    /// A value that the script engine has folded.
    fn literal(&mut self, value: &Dynamic, position: Position) -> Flow<Abstract> {
        let shape = if value.is_unit() {
            Shape::Unit
        } else if let Ok(b) = value.as_bool() {
            Shape::Bool(Some(b))
        } else if let Ok(n) = value.as_int() {
            Shape::Int(n, n)
        } else if let Ok(x) = value.as_float() {
            Shape::Float(Interval::exact(x))
        } else if let Ok(text) = value.as_immutable_string_ref() {
            Shape::Text(Some(text.as_str().into()))
        } else if let Ok(items) = value.as_array_ref() {
            let items = items.iter().map(|item| self.literal(item, position)).collect::<Flow<Vec<_>>>()?;
            Shape::Array(Rc::new(items))
        } else if let Ok(map) = value.as_map_ref() {
            let mut record = Record::default();
            for (key, value) in map.iter() {
                let value = self.literal(value, position)?;
                record.fields.insert(key.as_str().into(), Field::always(value, self.place(position)));
            }
            Shape::Record(Rc::new(record))
        } else if let Some(range) = value.read_lock::<std::ops::Range<i64>>() {
            Shape::Range { low: range.start, end: range.end, exact: true }
        } else if let Some(range) = value.read_lock::<std::ops::RangeInclusive<i64>>() {
            Shape::Range { low: *range.start(), end: range.end().saturating_add(1), exact: true }
        } else if value.is_fnptr() {
            return self.give_up(position, "a function pointer");
        } else {
            Shape::Unknown
        };
        Ok(self.constant(shape))
    }

    fn variable(&mut self, name: &str, namespace: Option<&str>, position: Position) -> Flow<Abstract> {
        if let Some(namespace) = namespace {
            return match namespace {
                "global" => self.give_up(position, "a name in `global`"),
                // Only the host can provide modules, since `import` is not followed.
                _ => Ok(self.constant(Shape::Unknown)),
            };
        }
        if let Some(variable) = self.find(name) {
            return Ok(variable.value.clone());
        }
        if self.functions.values().any(|function| function.name == name) {
            return self.give_up(position, "a function as a value");
        }
        Ok(self.constant(match name {
            "PI" => Shape::Float(Interval::exact(std::f32::consts::PI)),
            "TAU" => Shape::Float(Interval::exact(std::f32::consts::TAU)),
            // A constant that the host provides, or an error when it runs.
            _ => Shape::Unknown,
        }))
    }

    /// `&&` (`decisive` false) and `||` (`decisive` true): the first decisive term ends it.
    fn logic(&mut self, terms: &[Expr], decisive: bool) -> Flow<Abstract> {
        let Some((term, others)) = terms.split_first() else {
            return Ok(self.constant(Shape::Bool(Some(!decisive))));
        };
        let first = self.expression(term)?;
        let known = match first.shape {
            Shape::Bool(known) => known,
            _ => None,
        };
        let decided = self.constant(Shape::Bool(Some(decisive)));
        match known {
            Some(known) if known == decisive => Ok(decided),
            Some(_) => self.logic(others, decisive),
            None => self.either(first.inputs, |_| Ok(decided), |walker| walker.logic(others, decisive)),
        }
    }

    fn coalesce(&mut self, terms: &[Expr]) -> Flow<Abstract> {
        let Some((term, others)) = terms.split_first() else { return Ok(self.unit()) };
        let first = self.expression(term)?;
        match &first.shape {
            Shape::Unit => self.coalesce(others),
            Shape::Unknown => self.either(first.inputs, |_| Ok(first.clone()), |walker| walker.coalesce(others)),
            _ => Ok(first),
        }
    }

    /// A call in the form `f(a, b)`, or an operator.
    pub(super) fn function_call(&mut self, call: &FnCallExpr, position: Position) -> Flow<Abstract> {
        let name = call.name.as_str();
        if !call.is_operator_call() && (call.capture_parent_scope || BEYOND.contains(&name)) {
            return self.give_up(position, &format!("`{name}`"));
        }
        // The engine reads a variable in first place after it has evaluated the other arguments.
        let by_reference = match call.args.first() {
            Some(Expr::ThisPtr(_)) => Some("this"),
            Some(Expr::Variable(variable, ..)) if variable.2.is_empty() => Some(variable.1.as_str()),
            _ => None,
        };
        let arguments = if let (Some(name), Some((first, others))) = (by_reference, call.args.split_first()) {
            let mut arguments = self.expressions(others)?;
            let first = self.variable(name, None, first.position())?;
            arguments.insert(0, first);
            arguments
        } else {
            self.expressions(&call.args)?
        };
        if call.is_qualified() && call.namespace.root() == "global" {
            return self.give_up(position, "a call through `global`");
        }
        if let Some(function) = self.script_function(name, arguments.len()) {
            return self.script_call(function, arguments, None, position).map(|(value, _)| value);
        }
        let (value, changed) = self.native_call(name, &arguments, position)?;
        if let (Some(variable), Some(first), Some(changed)) = (by_reference, call.args.first(), changed) {
            // Of a variable that a closure shares, the engine passes a copy; whether it is shared may hang on the path.
            if self.find(variable).is_some_and(|variable| variable.cell.is_some()) {
                return self
                    .give_up(position, &format!("`{name}`, which would change a variable that a closure captures,"));
            }
            self.store(first, changed)?;
        }
        Ok(value)
    }

    /// The script's own function of that name and number of parameters.
    pub(super) fn script_function(&self, name: &str, parameters: usize) -> Option<&'a ScriptFunction> {
        self.functions.get(&(name.to_owned(), parameters))
    }

    /// Walks a script function with these arguments. Gives its value and what `this` is afterwards.
    pub(super) fn script_call(
        &mut self,
        function: &ScriptFunction,
        arguments: Vec<Abstract>,
        this: Option<Abstract>,
        position: Position,
    ) -> Flow<(Abstract, Option<Abstract>)> {
        if function.is_typed {
            return self.give_up(position, "a function for one type of `this`");
        }
        if !self.may_call() {
            return self.give_up(position, "a function that calls itself, or calls nested this deep");
        }
        let mut variables: Variables = this.into_iter().map(|value| Variable::new("this", value)).collect();
        let kept = variables.len();
        let parameters = function.parameters.iter().zip(arguments);
        variables.extend(parameters.map(|(name, value)| Variable::new(name.as_str(), value)));
        let call = Call { variables, kept, file: function.file, ..Call::default() };
        let (value, kept) = self.enter(call, &function.body)?;
        Ok((value, kept.into_iter().next().map(|this| this.value)))
    }

    /// Walks the body of a function. Gives its value, and the variables that the caller gets back.
    pub(super) fn enter(&mut self, call: Call, body: &[Stmt]) -> Flow<(Abstract, Variables)> {
        self.calls.push(call);
        match self.statements(body) {
            Ok(value) => {
                let call = self.call();
                let kept = call.variables[..call.kept].to_vec();
                call.returns.states.push((kept, value));
            }
            Err(Stop::Left) => {}
            Err(Stop::GaveUp) => return Err(Stop::GaveUp),
        }
        let Some(left) = self.calls.pop() else { return Err(Stop::GaveUp) };
        let Some((kept, value)) = self.join_exits(left.returns, left.escape) else { return Err(Stop::Left) };
        Ok((value, kept))
    }
}
