//! Walking chains of `.name`, `.method()` and `[index]`, and assignments to what they lead to.

use std::rc::Rc;

use rhai::{ASTFlags, Expr, FnCallExpr, OpAssignment, Position};

use super::functions;
use super::inputs;
use super::interval::Interval;
use super::nearest_hint;
use super::operators;
use super::value::{Abstract, Field, KeysOf, Record, Shape, Vector};
use super::walk::{Flow, Stop, Walker};
use crate::shade::names::InputSet;

/// One link of a chain.
enum Link<'e> {
    Property(&'e str),
    Method(&'e FnCallExpr),
    Index(Abstract),
}

struct Step<'e> {
    link: Link<'e>,
    /// Values of a method's arguments.
    arguments: Vec<Abstract>,
    /// `?.` or `?[`: `()` is passed on.
    conditional: bool,
    position: Position,
}

/// What is assigned at the end of a chain.
struct Assigned<'e> {
    value: &'e Abstract,
    /// Of a compound assignment such as `+=`: the operator.
    operator: Option<&'e str>,
}

impl Walker<'_> {
    /// Evaluates a chain.
    pub(super) fn chain(&mut self, expression: &Expr) -> Flow<Abstract> {
        let (root, steps) = self.steps(expression)?;
        let target = self.expression(root)?;
        let (value, changed) = self.follow(target, &steps)?;
        if let Some(changed) = changed {
            self.store(root, changed)?;
        }
        Ok(value)
    }

    /// Walks `left = right` and `left += right`.
    pub(super) fn assignment(&mut self, operator: &OpAssignment, left: &Expr, right: &Expr) -> Flow<()> {
        let value = self.expression(right)?;
        let operator = operator.get_op_assignment_info().map(|info| info.5);
        let assigned = Assigned { value: &value, operator };
        let (root, changed) = match left {
            Expr::Dot(..) | Expr::Index(..) => {
                let (root, steps) = self.steps(left)?;
                let target = self.expression(root)?;
                (root, self.assign(target, &steps, &assigned)?)
            }
            _ if operator.is_some() => {
                let old = self.expression(left)?;
                (left, self.combine(&old, &assigned))
            }
            _ => (left, value),
        };
        self.store(root, changed)
    }

    /// Splits a chain into its root and its steps. The engine evaluates all arguments before the root.
    fn steps<'e>(&mut self, expression: &'e Expr) -> Flow<(&'e Expr, Vec<Step<'e>>)> {
        let mut steps = Vec::new();
        let mut root = None;
        let mut rest = Some(expression);
        while let Some(link @ (Expr::Dot(sides, flags, position) | Expr::Index(sides, flags, position))) = rest {
            root.get_or_insert(&sides.lhs);
            // The chain goes on inside the right side, unless that is a chain of its own, as in `a[b.c]`.
            let (item, next) = match &sides.rhs {
                next @ (Expr::Dot(inner, ..) | Expr::Index(inner, ..)) if !flags.contains(ASTFlags::BREAK) => {
                    (&inner.lhs, Some(next))
                }
                last => (last, None),
            };
            let is_index = matches!(link, Expr::Index(..));
            steps.push(self.one_step(item, is_index, flags.contains(ASTFlags::NEGATED), *position)?);
            rest = next;
        }
        match root {
            Some(root) => Ok((root, steps)),
            None => self.give_up(expression.position(), "this expression"),
        }
    }

    fn one_step<'e>(
        &mut self,
        item: &'e Expr,
        is_index: bool,
        conditional: bool,
        position: Position,
    ) -> Flow<Step<'e>> {
        let mut arguments = Vec::new();
        let (link, position) = match item {
            _ if is_index => (Link::Index(self.expression(item)?), position),
            Expr::Property(property, position) => (Link::Property(property.2.as_str()), *position),
            Expr::MethodCall(call, position) => {
                arguments = self.expressions(&call.args)?;
                (Link::Method(call), *position)
            }
            other => return self.give_up(other.position(), "this expression"),
        };
        Ok(Step { link, arguments, conditional, position })
    }

    /// Stores a new value where a chain starts. What is no variable is a temporary, and forgotten.
    pub(super) fn store(&mut self, root: &Expr, value: Abstract) -> Flow<()> {
        let name = match root {
            Expr::ThisPtr(_) => "this",
            Expr::Variable(variable, ..) if variable.2.is_empty() => variable.1.as_str(),
            _ => return Ok(()),
        };
        match self.find(name) {
            Some(variable) => {
                variable.value = value;
                Ok(())
            }
            None => self.give_up(root.position(), "a change of a variable outside of functions"),
        }
    }

    /// Follows a chain. Gives its value, and the target anew if a method has changed it.
    fn follow(&mut self, target: Abstract, steps: &[Step]) -> Flow<(Abstract, Option<Abstract>)> {
        let Some((step, others)) = steps.split_first() else { return Ok((target, None)) };
        if step.conditional && target.shape == Shape::Unit {
            return Ok((target, None));
        }
        let (item, changed_target) = self.get(&target, step)?;
        let (value, changed_item) = self.follow(item, others)?;
        let changed = match (&step.link, changed_item) {
            (Link::Method(_), _) => changed_target,
            (_, Some(item)) => Some(self.set(&target, step, item)?),
            (_, None) => None,
        };
        Ok((value, changed))
    }

    /// What a target is after an assignment to the end of a chain that starts there.
    fn assign(&mut self, target: Abstract, steps: &[Step], assigned: &Assigned) -> Flow<Abstract> {
        let Some((step, others)) = steps.split_first() else { return Ok(self.combine(&target, assigned)) };
        if others.is_empty() && assigned.operator.is_none() {
            return self.set(&target, step, assigned.value.clone());
        }
        let (item, changed_target) = self.get(&target, step)?;
        if matches!(step.link, Link::Method(_)) {
            return Ok(changed_target.unwrap_or(target));
        }
        let item = self.assign(item, others, assigned)?;
        self.set(&target, step, item)
    }

    fn combine(&mut self, old: &Abstract, assigned: &Assigned) -> Abstract {
        match assigned.operator {
            Some(operator) => self.binary(operator, old, assigned.value),
            None => assigned.value.clone(),
        }
    }

    /// A binary operation.
    pub(super) fn binary(&mut self, operator: &str, a: &Abstract, b: &Abstract) -> Abstract {
        if let ("+", Shape::Record(x), Shape::Record(y)) = (operator, &a.shape, &b.shape) {
            return self.merged(x, y);
        }
        match operators::binary(operator, &a.shape, &b.shape) {
            Some(shape) => self.value(shape, a.all_inputs() | b.all_inputs()),
            None => self.unknown([a, b]),
        }
    }

    /// A record with the keys of `a` and `b`; a key of both has the value of `b`.
    pub(super) fn merged(&mut self, a: &Record, b: &Record) -> Abstract {
        let mut merged = Record { keys_of: KeysOf::Script, ..a.clone() };
        for (key, new) in &b.fields {
            let field = match a.fields.get(key) {
                Some(old) if !new.always => Field {
                    value: self.join_values(&old.value, &new.value, new.presence),
                    always: old.always,
                    presence: old.presence | new.presence,
                    place: new.place,
                },
                _ => new.clone(),
            };
            merged.fields.insert(Rc::clone(key), field);
        }
        self.constant(Shape::Record(Rc::new(merged)))
    }

    /// One step; with what the target is afterwards if a method has changed it.
    fn get(&mut self, target: &Abstract, step: &Step) -> Flow<(Abstract, Option<Abstract>)> {
        match &step.link {
            Link::Property(name) => Ok((self.property(target, name, step.position), None)),
            Link::Index(index) => Ok((self.element(target, index, step.position), None)),
            Link::Method(call) => self.method(target, call, &step.arguments, step.position),
        }
    }

    fn set(&mut self, target: &Abstract, step: &Step, item: Abstract) -> Flow<Abstract> {
        match &step.link {
            Link::Property(name) => self.with_property(target, name, item, step.position),
            Link::Index(index) => self.with_element(target, index, item, step.position),
            Link::Method(_) => self.give_up(step.position, "an assignment to a call"),
        }
    }

    fn method(
        &mut self,
        target: &Abstract,
        call: &FnCallExpr,
        arguments: &[Abstract],
        position: Position,
    ) -> Flow<(Abstract, Option<Abstract>)> {
        let name = call.name.as_str();
        if let (Shape::Closure(closure), "call") = (&target.shape, name) {
            return self.closure_call(&Rc::clone(closure), arguments, position).map(|value| (value, None));
        }
        if super::expressions::BEYOND.contains(&name) {
            return self.give_up(position, &format!("`{name}`"));
        }
        if let Some(function) = self.script_function(name, arguments.len()) {
            return self.script_call(function, arguments.to_vec(), Some(target.clone()), position);
        }
        let all: Vec<Abstract> = std::iter::once(target).chain(arguments).cloned().collect();
        self.native_call(name, &all, position)
    }

    /// `target.name`.
    fn property(&mut self, target: &Abstract, name: &str, position: Position) -> Abstract {
        match &target.shape {
            Shape::Hit => match inputs::by_name(name) {
                Some(input) => self.input(input),
                None => {
                    self.unknown_name(format!("there is no input `{name}` on `hit`"), name, inputs::names(), position);
                    self.inputs = InputSet::all();
                    self.value(Shape::Unknown, InputSet::all())
                }
            },
            Shape::Record(record) => self.key(record, name, position),
            Shape::Vector(vector) => match swizzle(name, vector.channels.len()) {
                Some(channels) => {
                    let picked = channels.iter().map(|channel| vector.channels[*channel]);
                    let shape = match picked.len() {
                        1 => Shape::Float(vector.channels[channels[0]]),
                        _ => Shape::Vector(Vector::new(picked)),
                    };
                    self.value(shape, target.inputs)
                }
                None => self.unknown([target]),
            },
            Shape::Float(_) => match functions::library(name, &[&target.shape]) {
                Some(shape) => self.value(shape, target.inputs),
                None => self.unknown([target]),
            },
            _ => self.unknown([target]),
        }
    }

    fn key(&mut self, record: &Record, name: &str, position: Position) -> Abstract {
        if record.keys_of == KeysOf::Parameters {
            self.parameters.insert(name.into());
        }
        match record.fields.get(name) {
            Some(field) if field.always => field.value.clone(),
            Some(field) => {
                let absent = self.unit();
                self.join_values(&field.value, &absent, field.presence)
            }
            None => {
                let message = match record.keys_of {
                    KeysOf::Script => return self.unit(),
                    KeysOf::Parameters => format!("there is no parameter `{name}`"),
                    KeysOf::Pair => format!("there is no `{name}` on `pair`"),
                };
                if record.fields.is_empty() {
                    let hint = Some(format!("declare it: fn params() {{ #{{ {name}: 1.0 }} }}"));
                    self.find_fault(position, message, hint);
                } else {
                    self.unknown_name(message, name, record.fields.keys().map(|key| &**key), position);
                }
                self.unit()
            }
        }
    }

    fn unknown_name<'c>(
        &mut self,
        message: String,
        name: &str,
        candidates: impl Iterator<Item = &'c str>,
        position: Position,
    ) {
        let hint = nearest_hint(name, candidates);
        self.find_fault(position, message, hint);
    }

    fn with_property(&mut self, target: &Abstract, name: &str, item: Abstract, position: Position) -> Flow<Abstract> {
        match &target.shape {
            Shape::Hit => self.give_up(position, "an assignment to `hit`"),
            Shape::Record(record) => {
                let mut record = Record::clone(record);
                record.fields.insert(name.into(), Field::always(item, self.place(position)));
                Ok(self.constant(Shape::Record(Rc::new(record))))
            }
            Shape::Vector(vector) => match swizzle(name, vector.channels.len()) {
                Some(channels) => Ok(self.with_channels(target, vector, &channels, &item)),
                None => Ok(self.unknown([target, &item])),
            },
            // The engine has no properties on these that could be set.
            Shape::Unit | Shape::Bool(_) | Shape::Int(..) | Shape::Float(_) | Shape::Text(_) => Err(Stop::Left),
            _ => Ok(self.unknown([target, &item])),
        }
    }

    fn with_channels(&mut self, target: &Abstract, vector: &Vector, to: &[usize], item: &Abstract) -> Abstract {
        let mut channels = vector.channels.clone();
        for (from, to) in to.iter().enumerate() {
            channels[*to] = match &item.shape {
                Shape::Vector(item) => item.channels.get(from).copied().unwrap_or(Interval::ANY),
                other => other.number().unwrap_or(Interval::ANY),
            };
        }
        self.value(Shape::Vector(Vector::new(channels)), target.inputs | item.all_inputs())
    }

    /// `target[index]`.
    fn element(&mut self, target: &Abstract, index: &Abstract, position: Position) -> Abstract {
        match (&target.shape, &index.shape) {
            (Shape::Record(record), Shape::Text(Some(name))) => self.key(record, name, position),
            (Shape::Array(items), Shape::Int(low, high)) => match exact_index(*low, *high, items.len()) {
                Some(index) => items[index].clone(),
                None => {
                    let items = Rc::clone(items);
                    let control = index.inputs;
                    let joined = items.iter().cloned().reduce(|a, b| self.join_values(&a, &b, control));
                    joined.unwrap_or_else(|| self.unit())
                }
            },
            (Shape::Vector(vector), Shape::Int(low, high)) => {
                let shape = match exact_index(*low, *high, vector.channels.len()) {
                    Some(index) => Shape::Float(vector.channels[index]),
                    None => Shape::Float(vector.hull()),
                };
                self.value(shape, target.inputs | index.inputs)
            }
            _ => self.unknown([target, index]),
        }
    }

    fn with_element(
        &mut self,
        target: &Abstract,
        index: &Abstract,
        item: Abstract,
        position: Position,
    ) -> Flow<Abstract> {
        match (&target.shape, &index.shape) {
            (Shape::Hit, _) => self.give_up(position, "an assignment to `hit`"),
            (Shape::Record(_), Shape::Text(Some(name))) => {
                let name = Rc::clone(name);
                self.with_property(target, &name, item, position)
            }
            (Shape::Array(items), Shape::Int(low, high)) => {
                let mut items = Vec::clone(items);
                match exact_index(*low, *high, items.len()) {
                    Some(index) => items[index] = item,
                    None => {
                        for old in &mut items {
                            *old = self.join_values(old, &item, index.inputs);
                        }
                    }
                }
                Ok(self.constant(Shape::Array(Rc::new(items))))
            }
            (Shape::Vector(vector), Shape::Int(low, high)) => match exact_index(*low, *high, vector.channels.len()) {
                Some(index) => Ok(self.with_channels(target, vector, &[index], &item)),
                None => Ok(self.unknown([target, index, &item])),
            },
            _ => Ok(self.unknown([target, index, &item])),
        }
    }
}

/// The channels that a name such as `x`, `rgb` or `zy` picks.
fn swizzle(name: &str, count: usize) -> Option<Vec<usize>> {
    let of = |letters: &str| -> Option<Vec<usize>> {
        name.chars().map(|c| letters.find(c).filter(|channel| *channel < count)).collect()
    };
    (1..=4).contains(&name.len()).then(|| of("xyzw").or_else(|| of("rgba"))).flatten()
}

/// The element that an index certainly means; negative ones count from the end.
fn exact_index(low: i64, high: i64, length: usize) -> Option<usize> {
    if low != high {
        return None;
    }
    let index = if low < 0 { low + i64::try_from(length).ok()? } else { low };
    usize::try_from(index).ok().filter(|index| *index < length)
}
