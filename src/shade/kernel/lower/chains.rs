//! Chains of `.name`, `.method()` and `[index]`, and assignments to what they lead to.

use std::rc::Rc;

use rhai::{ASTFlags, Expr, FnCallExpr, OpAssignment, Position};

use super::super::ir::{Code, Comparison, Operand};
use super::meaning::{Channels, Field, Meaning, Record};
use super::{Flow, Lowerer};

/// One link of a chain.
enum Link<'e> {
    Property(&'e str),
    Method(&'e FnCallExpr),
    Index(Meaning),
}

struct Step<'e> {
    link: Link<'e>,
    arguments: Vec<Meaning>,
    position: Position,
}

/// What is assigned at the end of a chain, and the operator of a compound assignment.
struct Assigned<'e> {
    value: Meaning,
    operator: Option<&'e str>,
    position: Position,
}

impl Lowerer<'_> {
    /// Evaluates a chain.
    pub(super) fn chain(&mut self, expression: &Expr) -> Flow<Meaning> {
        let (root, steps) = self.steps(expression)?;
        let target = self.expression(root)?;
        if self.is_dead() {
            return Ok(Meaning::Undefined);
        }
        let (value, changed) = self.follow(target, &steps)?;
        if let Some(changed) = changed {
            self.store(root, changed)?;
        }
        Ok(value)
    }

    /// `left = right` and `left += right`.
    pub(super) fn assignment(&mut self, operator: &OpAssignment, left: &Expr, right: &Expr) -> Flow<()> {
        let value = self.expression(right)?;
        let position = operator.position();
        let operator = operator.get_op_assignment_info().map(|info| info.5);
        let assigned = Assigned { value, operator, position };
        let (root, changed) = match left {
            Expr::Dot(..) | Expr::Index(..) => {
                let (root, steps) = self.steps(left)?;
                let target = self.expression(root)?;
                if self.is_dead() {
                    return Ok(());
                }
                (root, self.assign(target, &steps, &assigned)?)
            }
            _ => {
                let old = if operator.is_some() { self.expression(left)? } else { Meaning::Undefined };
                (left, self.combine(old, &assigned)?)
            }
        };
        if self.is_dead() {
            return Ok(());
        }
        self.store(root, changed)
    }

    /// Splits a chain into its root and its steps. The engine evaluates all arguments before the root.
    fn steps<'e>(&mut self, expression: &'e Expr) -> Flow<(&'e Expr, Vec<Step<'e>>)> {
        let mut steps = Vec::new();
        let mut root = None;
        let mut rest = Some(expression);
        while let Some(link @ (Expr::Dot(sides, flags, position) | Expr::Index(sides, flags, position))) = rest {
            root.get_or_insert(&sides.lhs);
            if flags.contains(ASTFlags::NEGATED) {
                return self.give_up(*position, "`?.`");
            }
            // The chain goes on inside the right side, unless that is a chain of its own, as in `a[b.c]`.
            let (item, next) = match &sides.rhs {
                next @ (Expr::Dot(inner, ..) | Expr::Index(inner, ..)) if !flags.contains(ASTFlags::BREAK) => {
                    (&inner.lhs, Some(next))
                }
                last => (last, None),
            };
            let is_index = matches!(link, Expr::Index(..));
            steps.push(self.one_step(item, is_index, *position)?);
            rest = next;
        }
        match root {
            Some(root) => Ok((root, steps)),
            None => self.give_up(expression.position(), "this expression"),
        }
    }

    fn one_step<'e>(&mut self, item: &'e Expr, is_index: bool, position: Position) -> Flow<Step<'e>> {
        self.step(position)?;
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
        Ok(Step { link, arguments, position })
    }

    /// Stores a new value where a chain starts. What is no variable is a temporary, and forgotten.
    fn store(&mut self, root: &Expr, value: Meaning) -> Flow<()> {
        let name = match root {
            Expr::ThisPtr(_) => "this",
            Expr::Variable(variable, ..) if variable.2.is_empty() => variable.1.as_str(),
            _ => return Ok(()),
        };
        let value = self.sized(value, root.position())?;
        match self.find(name) {
            Some(cell) if self.cells[cell].constant => self.give_up(root.position(), "a change of a constant"),
            Some(cell) => {
                self.cells[cell].meaning = value;
                Ok(())
            }
            None => self.give_up(root.position(), &format!("the name `{name}`")),
        }
    }

    /// Follows a chain. Gives its value, and the target anew if a method may have changed it.
    fn follow(&mut self, target: Meaning, steps: &[Step]) -> Flow<(Meaning, Option<Meaning>)> {
        let Some((step, others)) = steps.split_first() else { return Ok((target, None)) };
        let (item, changed_target) = self.get(&target, step)?;
        if self.is_dead() {
            return Ok((Meaning::Undefined, None));
        }
        let (value, changed_item) = self.follow(item, others)?;
        let changed = match (&step.link, changed_item) {
            (Link::Method(_), _) => changed_target,
            (_, Some(item)) if !self.is_dead() => Some(self.set(&target, step, item)?),
            (_, _) => None,
        };
        Ok((value, changed))
    }

    /// What a target is after an assignment to the end of a chain that starts there.
    fn assign(&mut self, target: Meaning, steps: &[Step], assigned: &Assigned) -> Flow<Meaning> {
        let Some((step, others)) = steps.split_first() else { return self.combine(target, assigned) };
        if others.is_empty() && assigned.operator.is_none() {
            return self.set(&target, step, assigned.value.clone());
        }
        if matches!(step.link, Link::Method(_)) {
            return self.give_up(step.position, "an assignment to what a call gives");
        }
        let (item, _) = self.get(&target, step)?;
        if self.is_dead() {
            return Ok(target);
        }
        let item = self.assign(item, others, assigned)?;
        if self.is_dead() {
            return Ok(target);
        }
        self.set(&target, step, item)
    }

    fn combine(&mut self, old: Meaning, assigned: &Assigned) -> Flow<Meaning> {
        match assigned.operator {
            Some(operator) => self.native(operator, vec![old, assigned.value.clone()], assigned.position),
            None => Ok(assigned.value.clone()),
        }
    }

    /// One step; with what the target is afterwards if a method may have changed it.
    fn get(&mut self, target: &Meaning, step: &Step) -> Flow<(Meaning, Option<Meaning>)> {
        match &step.link {
            Link::Property(name) => {
                let position = step.position;
                let value = self.spread(vec![target.clone()], &mut |lowerer, target| {
                    lowerer.property(&target[0], name, position)
                })?;
                Ok((value, None))
            }
            Link::Index(index) => {
                let position = step.position;
                let value = self.spread(vec![target.clone(), index.clone()], &mut |lowerer, pair| {
                    lowerer.element(&pair[0], &pair[1], position)
                })?;
                Ok((value, None))
            }
            Link::Method(call) => self.method(target, call, &step.arguments, step.position),
        }
    }

    fn set(&mut self, target: &Meaning, step: &Step, item: Meaning) -> Flow<Meaning> {
        match &step.link {
            Link::Property(name) => self.with_property(target, name, item, step.position),
            Link::Index(index) => self.with_element(target, index, item, step.position),
            Link::Method(_) => self.give_up(step.position, "an assignment to a call"),
        }
    }

    fn method(
        &mut self,
        target: &Meaning,
        call: &FnCallExpr,
        arguments: &[Meaning],
        position: Position,
    ) -> Flow<(Meaning, Option<Meaning>)> {
        let name = call.name.as_str();
        if let (Meaning::Closure(closure), "call") = (target, name) {
            return Ok((self.call_closure(closure, arguments.to_vec(), position)?, None));
        }
        if let Some(function) = self.functions.get(&(name.to_owned(), arguments.len())) {
            let this = self.new_cell(target.clone(), false);
            let value = self.call(function, name, arguments.to_vec(), Some(this), position)?;
            let changed = self.cells[this].meaning.clone();
            self.cells.truncate(this);
            return Ok((value, Some(changed)));
        }
        if let (Meaning::Array(items), "push", [item]) = (target, name, arguments) {
            let mut items = Vec::clone(items);
            items.push(item.clone());
            let grown = self.sized(Meaning::Array(Rc::new(items)), position)?;
            return Ok((Meaning::Unit, Some(grown)));
        }
        let all: Vec<Meaning> = std::iter::once(target).chain(arguments).cloned().collect();
        Ok((self.native(name, all, position)?, None))
    }

    /// `target.name`.
    fn property(&mut self, target: &Meaning, name: &str, position: Position) -> Flow<Meaning> {
        match target {
            Meaning::Hit => self.input(name, position),
            Meaning::Light(index) => self.light_part(*index, name, position),
            Meaning::Record(record) | Meaning::Parameters(record) => self.key(record, name),
            Meaning::Vector(channels) => match swizzle(name, channels.len()) {
                Some(picked) => {
                    let picked: Channels = picked.iter().map(|channel| channels[*channel]).collect();
                    Ok(if picked.len() == 1 { Meaning::Float(picked[0]) } else { Meaning::Vector(picked) })
                }
                None => self.give_up(position, &format!("`{name}` of a {}", target.name())),
            },
            Meaning::Array(items) if name == "len" => Ok(Meaning::int(items.len() as i64)),
            _ => self.give_up(position, &format!("`{name}` of {}", target.name())),
        }
    }

    /// A key of a record. Hits where it is missing fail.
    fn key(&mut self, record: &Record, name: &str) -> Flow<Meaning> {
        match record.get(name) {
            Some(field) => {
                let missing = self.builder.not(field.present);
                self.fail_where(missing);
                Ok(field.value.clone())
            }
            None => {
                self.fail();
                Ok(Meaning::Undefined)
            }
        }
    }

    fn with_property(&mut self, target: &Meaning, name: &str, item: Meaning, position: Position) -> Flow<Meaning> {
        match target {
            Meaning::Record(record) => {
                let mut record = Record::clone(record);
                record.insert(name.into(), Field { value: item, present: Operand::TRUE });
                Ok(Meaning::Record(Rc::new(record)))
            }
            Meaning::Vector(channels) => match swizzle(name, channels.len()) {
                Some(to) => self.with_channels(channels, &to, &item, position),
                None => self.give_up(position, &format!("`{name}` of a {}", target.name())),
            },
            _ => self.give_up(position, &format!("a change of `{name}` of {}", target.name())),
        }
    }

    fn with_channels(
        &mut self,
        channels: &Channels,
        to: &[usize],
        item: &Meaning,
        position: Position,
    ) -> Flow<Meaning> {
        let mut channels = channels.clone();
        let mut sorted = to.to_vec();
        sorted.sort_unstable();
        sorted.dedup();
        if sorted.len() < to.len() {
            return self.give_up(position, "a part of a vector that names a channel twice");
        }
        let item = self.spread(vec![item.clone()], &mut |lowerer, item| {
            if let Some(x) = lowerer.number(&item[0]) {
                return Ok(Meaning::Vector(to.iter().map(|_| x).collect()));
            }
            match &item[0] {
                vector @ Meaning::Vector(given) if given.len() == to.len() && to.len() > 1 => Ok(vector.clone()),
                other => lowerer.give_up(position, &format!("{} as part of a vector", other.name())),
            }
        })?;
        if let Meaning::Vector(given) = item {
            for (from, to) in given.iter().zip(to) {
                channels[*to] = *from;
            }
        }
        Ok(Meaning::Vector(channels))
    }

    /// `target[index]`. Hits whose index is out of range fail.
    fn element(&mut self, target: &Meaning, index: &Meaning, position: Position) -> Flow<Meaning> {
        match (target, index) {
            (Meaning::Record(record) | Meaning::Parameters(record), Meaning::Text(name)) => self.key(record, name),
            (Meaning::Array(items), Meaning::Int(index)) => {
                let items = Rc::clone(items);
                self.pick(&items, *index, true)
            }
            (Meaning::Vector(channels), Meaning::Int(index)) => {
                let items: Vec<_> = channels.iter().map(|channel| Meaning::Float(*channel)).collect();
                self.pick(&items, *index, false)
            }
            _ => self.give_up(position, &format!("{} with an index that is {}", target.name(), index.name())),
        }
    }

    fn pick(&mut self, items: &[Meaning], index: Operand, from_end: bool) -> Flow<Meaning> {
        let Some(hits) = self.places(items.len(), index, from_end) else {
            self.fail();
            return Ok(Meaning::Undefined);
        };
        let mut picked = Meaning::Undefined;
        for (item, here) in items.iter().zip(hits) {
            if here != Operand::FALSE {
                picked = self.builder.join(here, item, &picked);
            }
        }
        Ok(picked)
    }

    /// For each of so many elements, at which hits the index means it; `None` if at none at all. Hits where the index
    /// is out of range fail.
    fn places(&mut self, length: usize, index: Operand, from_end: bool) -> Option<Vec<Operand>> {
        let end = length as i64;
        let is = |lowerer: &mut Self, value: i64| {
            lowerer.builder.emit(Code::CompareInts(Comparison::Equal), &[index, Operand::Int(value)])
        };
        let mut hits = Vec::with_capacity(length);
        let mut any = Operand::FALSE;
        for place in 0..end {
            let mut here = is(self, place);
            if from_end {
                let counted = is(self, place - end);
                here = self.builder.or(here, counted);
            }
            any = self.builder.or(any, here);
            hits.push(here);
        }
        if any == Operand::FALSE {
            return None;
        }
        let outside = self.builder.not(any);
        self.fail_where(outside);
        Some(hits)
    }

    fn with_element(&mut self, target: &Meaning, index: &Meaning, item: Meaning, position: Position) -> Flow<Meaning> {
        match (target, index) {
            (Meaning::Record(_), Meaning::Text(name)) => {
                let name = Rc::clone(name);
                self.with_property(target, &name, item, position)
            }
            (Meaning::Array(items), Meaning::Int(index)) => {
                let mut items = Vec::clone(items);
                match self.places(items.len(), *index, true) {
                    Some(hits) => {
                        for (old, here) in items.iter_mut().zip(hits) {
                            *old = self.builder.join(here, &item, old);
                        }
                    }
                    None => self.fail(),
                }
                Ok(Meaning::Array(Rc::new(items)))
            }
            (Meaning::Vector(channels), Meaning::Int(index)) => {
                let (mut channels, index) = (channels.clone(), *index);
                let Some(x) = self.number(&item) else {
                    return self.give_up(position, &format!("{} as part of a vector", item.name()));
                };
                match self.places(channels.len(), index, false) {
                    Some(hits) => {
                        for (old, here) in channels.iter_mut().zip(hits) {
                            *old = self.builder.select(here, x, *old);
                        }
                    }
                    None => self.fail(),
                }
                Ok(Meaning::Vector(channels))
            }
            _ => self.give_up(position, &format!("a change of {} by an index that is {}", target.name(), index.name())),
        }
    }
}

/// The channels that a name such as `x`, `rgb` or `zy` picks.
fn swizzle(name: &str, count: usize) -> Option<Vec<usize>> {
    let of = |letters: &str| -> Option<Vec<usize>> {
        name.chars().map(|c| letters.find(c).filter(|channel| *channel < count)).collect()
    };
    (1..=3).contains(&name.len()).then(|| of("xyzw").or_else(|| of("rgba"))).flatten()
}
