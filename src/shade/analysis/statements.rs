//! Walking statements: blocks, branches, loops, and the ways out of them.

use std::collections::BTreeSet;

use rhai::{ASTFlags, Expr, FlowControl, Position, Stmt, SwitchCasesCollection};

use super::switch::picked_cases;
use super::value::{Abstract, Shape};
use super::walk::{Exits, Flow, Loop, Stop, Variables, Walker};
use crate::shade::names::InputSet;

/// Rounds of a loop that are walked one by one while it is known whether there is another.
const MAX_UNROLLED: usize = 64;
/// Rounds after which bounds that still move are dropped.
const ROUNDS_BEFORE_WIDENING: usize = 2;
/// Rounds after which the search for what holds in every round ends.
const MAX_ROUNDS: usize = 40;
/// Nesting of records and arrays that a loop may build up.
const MAX_DEPTH: usize = 8;

impl Walker<'_> {
    /// Walks a block with its own scope. Its value is that of its last statement.
    pub(super) fn block(&mut self, statements: &[Stmt]) -> Flow<Abstract> {
        let depth = self.call().variables.len();
        let result = self.statements(statements);
        self.call().variables.truncate(depth);
        result
    }

    /// Walks statements in the current scope.
    pub(super) fn statements(&mut self, statements: &[Stmt]) -> Flow<Abstract> {
        let mut value = self.unit();
        for statement in statements {
            value = self.statement(statement)?;
        }
        Ok(value)
    }

    fn statement(&mut self, statement: &Stmt) -> Flow<Abstract> {
        self.step(statement.position())?;
        match statement {
            Stmt::Noop(_) => Ok(self.unit()),
            Stmt::Expr(expression) => self.expression(expression),
            Stmt::FnCall(call, position) => self.function_call(call, *position),
            Stmt::Block(block) => self.block(block.statements()),
            Stmt::Var(variable, ..) => {
                let (name, expression, _) = &**variable;
                let value = self.expression(expression)?;
                self.declare(&name.name, value);
                Ok(self.unit())
            }
            Stmt::Assignment(assignment) => {
                let (operator, sides) = &**assignment;
                self.assignment(operator, &sides.lhs, &sides.rhs)?;
                Ok(self.unit())
            }
            Stmt::If(flow, _) => self.branch(flow),
            Stmt::Switch(switch, position) => self.switch(&switch.0, &switch.1, *position),
            Stmt::While(flow, position) => {
                let endless = matches!(flow.expr, Expr::Unit(_));
                let condition = (!endless).then_some((&flow.expr, true));
                self.repeat(condition, flow.body.statements(), false, *position)
            }
            Stmt::Do(flow, flags, position) => {
                let goes_on = !flags.contains(ASTFlags::NEGATED);
                self.repeat(Some((&flow.expr, goes_on)), flow.body.statements(), true, *position)
            }
            Stmt::For(parts, position) => {
                let (item, counter, flow) = &**parts;
                let counter = counter.as_ref().map(|counter| counter.name.as_str());
                self.for_each(&item.name, counter, flow, *position)
            }
            Stmt::BreakLoop(value, flags, position) => {
                let value = match value {
                    Some(expression) => self.expression(expression)?,
                    None => self.unit(),
                };
                self.leave_loop(value, flags.contains(ASTFlags::BREAK), *position)
            }
            Stmt::Return(value, flags, _) => {
                let value = match value {
                    Some(expression) => self.expression(expression)?,
                    None => self.unit(),
                };
                // `throw` outside of `try` ends the script with an error, about which nothing is claimed.
                if flags.contains(ASTFlags::BREAK) { Err(Stop::Left) } else { self.leave_call(value) }
            }
            Stmt::TryCatch(_, position) => self.give_up(*position, "`try`"),
            Stmt::Import(_, position) => self.give_up(*position, "`import`"),
            Stmt::Share(variables) => {
                let position = variables.first().map_or(Position::NONE, |(variable, _)| variable.pos);
                self.give_up(position, "a closure that captures a variable")
            }
            other => self.give_up(other.position(), "this statement"),
        }
    }

    fn branch(&mut self, flow: &FlowControl) -> Flow<Abstract> {
        let condition = self.expression(&flow.expr)?;
        match condition.shape {
            Shape::Bool(Some(true)) => self.block(flow.body.statements()),
            Shape::Bool(Some(false)) => self.block(flow.branch.statements()),
            _ => self.either(
                condition.inputs,
                |walker| walker.block(flow.body.statements()),
                |walker| walker.block(flow.branch.statements()),
            ),
        }
    }

    /// A `return`, or the end of a function.
    pub(super) fn leave_call<T>(&mut self, value: Abstract) -> Flow<T> {
        let control = self.control();
        let call = self.call();
        call.escape |= control;
        call.loops.iter_mut().for_each(|left| left.escape |= control);
        let kept = call.variables[..call.kept].to_vec();
        call.returns.states.push((kept, value));
        Err(Stop::Left)
    }

    fn leave_loop(&mut self, value: Abstract, is_break: bool, position: Position) -> Flow<Abstract> {
        let control = self.control();
        let call = self.call();
        let Some(current) = call.loops.last_mut() else {
            return self.give_up(position, "a `break` or `continue` outside of a loop");
        };
        if current.test_last && !is_break {
            return self.give_up(position, "`continue` in a `do` loop");
        }
        current.escape |= control;
        let state = (call.variables[..current.depth].to_vec(), value);
        let exits = if is_break { &mut current.breaks } else { &mut current.continues };
        exits.states.push(state);
        Err(Stop::Left)
    }

    fn switch(&mut self, subject: &Expr, cases: &SwitchCasesCollection, position: Position) -> Flow<Abstract> {
        let subject = self.expression(subject)?;
        match subject.shape.to_value().and_then(|value| picked_cases(&value, cases)) {
            Some(picked) => self.decided_switch(&picked, cases),
            None => self.open_switch(&subject, cases, position),
        }
    }

    /// A `switch` on a known value: only the conditions of the cases that it picks are open.
    fn decided_switch(&mut self, picked: &[usize], cases: &SwitchCasesCollection) -> Flow<Abstract> {
        let Some((&index, others)) = picked.split_first() else {
            return match cases.def_case {
                Some(default) => self.expression(&cases.expressions[default].rhs),
                None => Ok(self.unit()),
            };
        };
        let case = &cases.expressions[index];
        let condition = self.expression(&case.lhs)?;
        match condition.shape {
            Shape::Bool(Some(true)) => self.expression(&case.rhs),
            Shape::Bool(Some(false)) => self.decided_switch(others, cases),
            _ => self.either(
                condition.inputs,
                |walker| walker.expression(&case.rhs),
                |walker| walker.decided_switch(others, cases),
            ),
        }
    }

    /// A `switch` on an unknown value: any case may be taken.
    fn open_switch(&mut self, subject: &Abstract, cases: &SwitchCasesCollection, position: Position) -> Flow<Abstract> {
        let mut control = subject.all_inputs();
        self.escape(subject);
        // All conditions first: any of them may be what decides.
        let before = self.call().variables.clone();
        for (index, case) in cases.expressions.iter().enumerate() {
            if Some(index) != cases.def_case {
                control |= self.under(control, |walker| walker.expression(&case.lhs))?.inputs;
            }
        }
        if self.call().variables != before {
            return self.give_up(position, "a `switch` whose conditions change variables");
        }
        self.open_cases(cases, 0, control)
    }

    fn open_cases(&mut self, cases: &SwitchCasesCollection, index: usize, control: InputSet) -> Flow<Abstract> {
        if index == cases.expressions.len() {
            // With a default case, some case is taken; without, perhaps none.
            return if cases.def_case.is_some() { Err(Stop::Left) } else { Ok(self.unit()) };
        }
        let case = &cases.expressions[index].rhs;
        self.either(control, |walker| walker.expression(case), |walker| walker.open_cases(cases, index + 1, control))
    }

    /// Walks `while`, `loop` and `do`. `condition` is an expression and the value of it that means another round.
    fn repeat(
        &mut self,
        condition: Option<(&Expr, bool)>,
        body: &[Stmt],
        body_first: bool,
        position: Position,
    ) -> Flow<Abstract> {
        let test = |walker: &mut Self| walker.goes_on(condition);
        let open = (None, InputSet::empty());
        self.enter_loop(body_first);
        // Round by round, as long as it is known whether there is another.
        for round in 0..MAX_UNROLLED {
            let before = self.call().variables.clone();
            let (known, _) = match condition {
                _ if body_first && round == 0 => (Some(true), InputSet::empty()),
                _ if !self.may_unroll() => open,
                _ => test(self)?,
            };
            match known {
                Some(true) => {
                    if !self.round(body)? {
                        return self.leave_loop_behind(Exits::default(), InputSet::empty(), position);
                    }
                }
                Some(false) => {
                    let value = self.unit();
                    let exits = Exits { states: vec![(self.call().variables.clone(), value)] };
                    return self.leave_loop_behind(exits, InputSet::empty(), position);
                }
                None => {
                    self.call().variables = before;
                    break;
                }
            }
        }
        self.settle(position, test, |walker| walker.round(body))
    }

    /// Whether a loop goes on (if known), and what that depends on.
    fn goes_on(&mut self, condition: Option<(&Expr, bool)>) -> Flow<(Option<bool>, InputSet)> {
        let Some((expression, goes_on)) = condition else { return Ok((Some(true), InputSet::empty())) };
        let value = self.expression(expression)?;
        Ok(match value.shape {
            Shape::Bool(Some(known)) => (Some(known == goes_on), InputSet::empty()),
            _ => (None, value.inputs),
        })
    }

    fn enter_loop(&mut self, test_last: bool) {
        let depth = self.call().variables.len();
        self.call().loops.push(Loop { depth, test_last, ..Loop::default() });
    }

    /// Walks the body of the innermost loop once, to where the next round may begin. `false` if it never gets there.
    fn round(&mut self, body: &[Stmt]) -> Flow<bool> {
        self.step(Position::NONE)?;
        let result = self.block(body);
        let Some(current) = self.call().loops.last_mut() else { return Ok(false) };
        let depth = current.depth;
        let mut ends = std::mem::take(&mut current.continues);
        let escape = current.escape;
        match result {
            Ok(value) => ends.states.push((self.call().variables[..depth].to_vec(), value)),
            Err(Stop::Left) => {}
            Err(Stop::GaveUp) => return Err(Stop::GaveUp),
        }
        match self.join_exits(ends, escape) {
            Some((variables, _)) => {
                self.call().variables = variables;
                Ok(true)
            }
            None => Ok(false),
        }
    }

    /// Finds what holds at the head of the innermost loop in every round, and goes on behind the loop.
    fn settle(
        &mut self,
        position: Position,
        mut test: impl FnMut(&mut Self) -> Flow<(Option<bool>, InputSet)>,
        mut round: impl FnMut(&mut Self) -> Flow<bool>,
    ) -> Flow<Abstract> {
        let mut loop_values = BTreeSet::new();
        let mut head: Variables = self.call().variables.clone();
        // Breaks of rounds that were walked one by one stay; those of this search are found anew in each round.
        let breaks_before = self.call().loops.last().map_or(0, |current| current.breaks.states.len());
        let mut last_control = None;
        for number in 0..MAX_ROUNDS {
            if let Some(current) = self.call().loops.last_mut() {
                current.breaks.states.truncate(breaks_before);
            }
            let mut exits = Exits::default();
            let mut end = None;
            let mut control = InputSet::empty();
            match test(self) {
                Ok((known, inputs)) => {
                    control = inputs;
                    if known != Some(true) {
                        let value = self.unit();
                        exits.states.push((self.call().variables.clone(), value));
                    }
                    if known != Some(false) && self.under(inputs, &mut round)? {
                        end = Some(self.call().variables.clone());
                    }
                }
                Err(Stop::Left) => {}
                Err(Stop::GaveUp) => return Err(Stop::GaveUp),
            }
            control |= self.call().loops.last().map_or(InputSet::empty(), |current| current.escape);
            let next = match end {
                Some(end) => {
                    let widen = number >= ROUNDS_BEFORE_WIDENING;
                    self.join_loop(&head, &end, control, &mut loop_values, widen)
                }
                None => head.clone(),
            };
            if next == head && last_control == Some(control) {
                return self.leave_loop_behind(exits, control, position);
            }
            last_control = Some(control);
            if next.iter().any(|variable| variable.value.depth() > MAX_DEPTH) {
                return self.give_up(position, "a loop that builds nested values");
            }
            head.clone_from(&next);
            self.call().variables = next;
        }
        self.give_up(position, "a loop that does not settle")
    }

    /// Joins the ways out of the innermost loop.
    fn leave_loop_behind(&mut self, mut exits: Exits, control: InputSet, position: Position) -> Flow<Abstract> {
        let Some(left) = self.call().loops.pop() else {
            return self.give_up(position, "a loop");
        };
        exits.states.extend(left.breaks.states);
        match self.join_exits(exits, control | left.escape) {
            Some((variables, value)) => {
                self.call().variables = variables;
                Ok(value)
            }
            None => Err(Stop::Left),
        }
    }

    fn for_each(
        &mut self,
        item: &str,
        counter: Option<&str>,
        flow: &FlowControl,
        position: Position,
    ) -> Flow<Abstract> {
        let sequence = self.expression(&flow.expr)?;
        self.enter_loop(false);
        let body = flow.body.statements();
        if let Some(items) = self.items(&sequence) {
            for (index, value) in items.into_iter().enumerate() {
                let index = index as i64;
                let index = self.constant(Shape::Int(index, index));
                if !self.round_with(item, value, counter, index, body)? {
                    return self.leave_loop_behind(Exits::default(), InputSet::empty(), position);
                }
            }
            let value = self.unit();
            let exits = Exits { states: vec![(self.call().variables.clone(), value)] };
            return self.leave_loop_behind(exits, InputSet::empty(), position);
        }
        let control = self.escape(&sequence);
        let test = |_: &mut Self| Ok((None, control));
        self.settle(position, test, |walker| {
            // Which round it is depends on what ends the loop.
            let which = walker.call().loops.last().map_or(control, |current| control | current.escape);
            let item_shape = match &sequence.shape {
                Shape::Range { low, end, .. } if low < end => Shape::Int(*low, end - 1),
                _ => Shape::Unknown,
            };
            let value = walker.value(item_shape, which);
            let index = walker.value(Shape::Int(0, i64::MAX), which);
            walker.round_with(item, value, counter, index, body)
        })
    }

    /// The values that a `for` goes through, if they are known and few.
    fn items(&mut self, sequence: &Abstract) -> Option<Vec<Abstract>> {
        if !self.may_unroll() {
            return None;
        }
        match &sequence.shape {
            Shape::Range { low, end, exact: true } if end.saturating_sub(*low) <= MAX_UNROLLED as i64 => {
                Some((*low..*end).map(|n| self.constant(Shape::Int(n, n))).collect())
            }
            Shape::Array(items) if items.len() <= MAX_UNROLLED => Some(items.to_vec()),
            _ => None,
        }
    }

    fn round_with(
        &mut self,
        item: &str,
        value: Abstract,
        counter: Option<&str>,
        index: Abstract,
        body: &[Stmt],
    ) -> Flow<bool> {
        let depth = self.call().variables.len();
        if let Some(counter) = counter {
            self.declare(counter, index);
        }
        self.declare(item, value);
        // The loop's own variables are gone where rounds meet.
        let again = self.round(body)?;
        self.call().variables.truncate(depth);
        Ok(again)
    }
}
