//! Loops: walked round by round while it is known whether there is another round, else made a loop of the program.
//!
//! What a variable is after a loop depends on where a hit left it. While a round is walked, hits that `break` or
//! `continue` put their variables away in exit cells, which are joined with the others at the end of the round.

use std::collections::BTreeSet;

use rhai::{Expr, FlowControl, Position, Stmt};

use super::super::ir::{Carried, Code, Comparison, IntBinary, Kind, Operand};
use super::meaning::{Meaning, Range};
use super::{Flow, LoopContext, Lowerer};

/// Rounds that are unrolled at most.
const MAX_UNROLLED: usize = 64;
/// Constructs that have been walked when loops are not unrolled any more.
const MAX_STEPS_UNROLLED: u32 = 20_000;
/// Rounds that are walked before a loop whose variables change their type is given up.
const MAX_PEELED: usize = 3;
/// Walks of a loop's body to find which variables it changes.
const MAX_ATTEMPTS: usize = 24;

/// Why a loop has not become a loop of the program.
pub(super) enum Obstacle {
    /// A variable changes its type.
    Form(String),
}

/// A counter that a `for` over a range keeps.
#[derive(Clone, Copy)]
struct Counter {
    range: Range,
}

/// What is walked in each round, given the number that a counter has.
type Round<'r, 'a> = &'r mut dyn FnMut(&mut Lowerer<'a>, Option<Operand>) -> Flow<()>;

impl<'a> Lowerer<'a> {
    /// `while`, `loop` and `do`. `condition` is an expression and the value of it that means another round.
    pub(super) fn repeat(
        &mut self,
        condition: Option<(&Expr, bool)>,
        body: &[Stmt],
        body_first: bool,
        position: Position,
    ) -> Flow<Meaning> {
        self.enter_loop();
        let mut round = |lowerer: &mut Self, _: Option<Operand>| {
            lowerer.test(condition)?;
            lowerer.round(body)
        };
        if body_first {
            self.round(body)?;
        }
        // Round by round, as long as it is known whether there is another.
        let mut peeled = 0;
        for _ in 0..MAX_UNROLLED {
            if self.is_dead() {
                return Ok(self.leave_loop_behind());
            }
            if self.steps > MAX_STEPS_UNROLLED {
                break;
            }
            match self.known(condition)? {
                Some(true) => self.guarded(|lowerer| lowerer.round(body))?,
                Some(false) => return Ok(self.leave_loop_behind()),
                None => break,
            }
        }
        loop {
            match self.dynamic(None, &mut round, position)? {
                None => return Ok(self.leave_dynamic_behind()),
                Some(Obstacle::Form(what)) if peeled == MAX_PEELED => return self.give_up(position, &what),
                Some(Obstacle::Form(_)) => {
                    peeled += 1;
                    self.guarded(|lowerer| round(lowerer, None))?;
                    if self.is_dead() {
                        return Ok(self.leave_loop_behind());
                    }
                }
            }
        }
    }

    /// Whether a loop certainly goes on, or certainly does not.
    fn known(&mut self, condition: Option<(&Expr, bool)>) -> Flow<Option<bool>> {
        let Some((expression, goes_on)) = condition else {
            // Whether `loop` ends is for its body to say; unrolling it is worth while only if that is soon known.
            return Ok(None);
        };
        // Asked in a block that is thrown away: the test is walked again where it counts.
        let (mark, cells, live) = (self.builder.mark(), self.cells.clone(), self.live);
        self.builder.open();
        let value = self.expression(expression);
        let effects = !self.builder.close().items.is_empty();
        let changed = self.live != live || self.cells.iter().zip(&cells).any(|(a, b)| a.meaning != b.meaning);
        let known = match value? {
            Meaning::Bool(Operand::Bool(known)) if !effects && !changed => Some(known == goes_on),
            _ => None,
        };
        self.cells = cells;
        self.live = live;
        self.builder.go_back(mark);
        Ok(known)
    }

    /// Live hits for which the condition does not hold leave the loop.
    fn test(&mut self, condition: Option<(&Expr, bool)>) -> Flow<()> {
        let Some((expression, goes_on)) = condition else { return Ok(()) };
        let value = self.expression(expression)?;
        let holds = self.truth(&value, expression.position())?;
        let leaves = if goes_on { self.builder.not(holds) } else { holds };
        self.leave_where(leaves)
    }

    /// Live hits where a condition holds leave the innermost loop.
    fn leave_where(&mut self, condition: Operand) -> Flow<()> {
        self.branch(
            condition,
            |lowerer| {
                lowerer.leave_loop(&Meaning::Unit, true);
                Ok(Meaning::Undefined)
            },
            |_| Ok(Meaning::Undefined),
        )?;
        Ok(())
    }

    pub(super) fn for_each(
        &mut self,
        item: &str,
        counter: Option<&str>,
        flow: &FlowControl,
        position: Position,
    ) -> Flow<Meaning> {
        let sequence = self.expression(&flow.expr)?;
        if self.is_dead() {
            return Ok(Meaning::Undefined);
        }
        let body = flow.body.statements();
        let round = |lowerer: &mut Self, value: Meaning, index: Meaning| {
            lowerer.step(position)?;
            lowerer.scoped(|lowerer| {
                if let Some(counter) = counter {
                    lowerer.declare(counter, index);
                }
                lowerer.declare(item, value);
                lowerer.round(body)
            })
        };
        self.enter_loop();
        match sequence {
            Meaning::Array(items) => {
                for (index, value) in items.iter().enumerate() {
                    if self.is_dead() {
                        break;
                    }
                    let index = Meaning::int(index as i64);
                    self.guarded(|lowerer| round(lowerer, value.clone(), index))?;
                }
                Ok(self.leave_loop_behind())
            }
            Meaning::Range(range) => {
                if let Some(numbers) = few_numbers(range)
                    && self.steps <= MAX_STEPS_UNROLLED
                {
                    for (index, number) in numbers.enumerate() {
                        if self.is_dead() {
                            break;
                        }
                        let index = Meaning::int(index as i64);
                        self.guarded(|lowerer| round(lowerer, Meaning::int(number), index))?;
                    }
                    return Ok(self.leave_loop_behind());
                }
                let mut numbered = |lowerer: &mut Self, number: Option<Operand>| {
                    let number = number.unwrap_or(Operand::Int(0));
                    let index = lowerer.builder.emit(Code::Int2(IntBinary::WrappingSubtract), &[number, range.low]);
                    round(lowerer, Meaning::Int(number), Meaning::Int(index))
                };
                match self.dynamic(Some(Counter { range }), &mut numbered, position)? {
                    None => Ok(self.leave_dynamic_behind()),
                    // A first round cannot be peeled off where nobody knows whether there is one.
                    Some(Obstacle::Form(what)) => self.give_up(position, &what),
                }
            }
            other => self.give_up(position, &format!("`for` over {}", other.name())),
        }
    }

    fn enter_loop(&mut self) {
        let outside = self.cells.len();
        let broken = self.new_cell(Meaning::bool(false), true);
        let value = self.new_cell(Meaning::Undefined, true);
        let continued = self.new_cell(Meaning::bool(false), true);
        let at_break = self.cells.len();
        for _ in 0..outside {
            self.new_cell(Meaning::Undefined, true);
        }
        let at_continue = self.cells.len();
        for _ in 0..outside {
            self.new_cell(Meaning::Undefined, true);
        }
        if let Some(frame) = self.frames.last_mut() {
            frame.loops.push(LoopContext { outside, broken, value, at_break, continued, at_continue });
        }
    }

    fn innermost(&self) -> Option<(usize, usize, usize, usize, usize, usize)> {
        let of = self.frames.last()?.loops.last()?;
        Some((of.outside, of.broken, of.value, of.at_break, of.continued, of.at_continue))
    }

    /// Live hits leave the innermost loop, or a round of it. `false` outside of loops.
    pub(super) fn leave_loop(&mut self, value: &Meaning, is_break: bool) -> bool {
        let Some((outside, broken, result, at_break, continued, at_continue)) = self.innermost() else { return false };
        let Some(live) = self.live else { return true };
        let (gone, kept) = if is_break { (broken, at_break) } else { (continued, at_continue) };
        if let Meaning::Bool(before) = self.cells[gone].meaning {
            self.cells[gone].meaning = Meaning::Bool(self.builder.or(before, live));
        }
        for index in 0..outside {
            if !self.cells[index].exit {
                let (now, before) = (self.cells[index].meaning.clone(), self.cells[kept + index].meaning.clone());
                self.cells[kept + index].meaning = self.builder.join(live, &now, &before);
            }
        }
        if is_break {
            let before = self.cells[result].meaning.clone();
            self.cells[result].meaning = self.builder.join(live, value, &before);
        }
        self.live = None;
        true
    }

    /// Walks the body of the innermost loop once. Hits that `continue` are live again at its end.
    fn round(&mut self, body: &[Stmt]) -> Flow<()> {
        let Some((outside, _, _, _, continued, at_continue)) = self.innermost() else { return Ok(()) };
        self.cells[continued].meaning = Meaning::bool(false);
        for index in 0..outside {
            self.cells[at_continue + index].meaning = Meaning::Undefined;
        }
        self.scoped(|lowerer| lowerer.statements(body))?;
        self.rejoin(outside, continued, at_continue);
        Ok(())
    }

    /// Hits that were put away become live again, with the variables that they had.
    fn rejoin(&mut self, outside: usize, gone: usize, kept: usize) {
        let Meaning::Bool(gone) = self.cells[gone].meaning else { return };
        if gone == Operand::FALSE {
            return;
        }
        for index in 0..outside {
            if self.cells[index].exit {
                continue;
            }
            let then = self.cells[kept + index].meaning.clone();
            let now = self.cells[index].meaning.clone();
            self.cells[index].meaning = if self.is_dead() { then } else { self.builder.join(gone, &then, &now) };
        }
        self.live = Some(match self.live {
            Some(live) => self.builder.or(live, gone),
            None => gone,
        });
    }

    /// Goes on behind the innermost loop; gives the loop's value.
    fn leave_loop_behind(&mut self) -> Meaning {
        let Some((outside, broken, value, at_break, ..)) = self.innermost() else { return Meaning::Unit };
        let value = match (self.cells[broken].meaning.clone(), self.cells[value].meaning.clone()) {
            (Meaning::Bool(Operand::FALSE), _) => Meaning::Unit,
            (_, value) if self.is_dead() => value,
            (Meaning::Bool(broken), value) => self.builder.join(broken, &value, &Meaning::Unit),
            _ => Meaning::Unit,
        };
        self.rejoin(outside, broken, at_break);
        if let Some(frame) = self.frames.last_mut() {
            frame.loops.pop();
        }
        self.cells.truncate(outside);
        value
    }

    /// The same behind a loop of the program: hits have left it in no other way than with a value, be it `()`.
    fn leave_dynamic_behind(&mut self) -> Meaning {
        let value = self.innermost().map(|(_, _, value, ..)| self.cells[value].meaning.clone());
        self.leave_loop_behind();
        value.filter(|value| *value != Meaning::Undefined).unwrap_or(Meaning::Unit)
    }

    /// Makes the innermost loop a loop of the program. Its body is walked again and again, until it is known which
    /// variables it changes, and which of them differ from hit to hit.
    fn dynamic(
        &mut self,
        counter: Option<Counter>,
        round: Round<'_, 'a>,
        position: Position,
    ) -> Flow<Option<Obstacle>> {
        let Some((outside, broken, value, at_break, continued, at_continue)) = self.innermost() else {
            return Ok(None);
        };
        let entry_live = self.mask();
        // Hits that left in rounds that were walked before are out already; what they had is joined last.
        let before = self.cells.clone();
        let mut start = before.clone();
        let mut carried: BTreeSet<usize> = BTreeSet::new();
        let mut varying: BTreeSet<usize> = BTreeSet::new();
        let mut live_varies = !self.builder.is_uniform(entry_live);
        let mut counter_varies = counter.is_some_and(|counter| !self.builder.is_uniform(counter.range.low));
        let cost_before = self.cost;
        for _ in 0..MAX_ATTEMPTS {
            let mark = self.builder.mark();
            self.cost = cost_before;
            self.step(position)?;
            self.builder.open();

            // The head of a round: what is carried has new names.
            let live = self.builder.carried(Kind::Bool, !live_varies);
            let mut head = start.clone();
            let mut parts: Vec<(usize, Vec<Operand>)> = Vec::new();
            for &index in &carried {
                let uniform = !varying.contains(&index);
                let builder = &mut self.builder;
                head[index].meaning = start[index].meaning.map(&mut |operand| {
                    let kind = builder.kind(operand);
                    Operand::Value(builder.carried(kind, uniform))
                });
                parts.push((index, head[index].meaning.operands()));
            }
            let number = counter.map(|_| self.builder.carried(Kind::Int, !counter_varies));
            // Breaks of this round only; those before stay put away.
            for cell in [broken, continued] {
                head[cell].meaning = Meaning::bool(false);
            }
            for index in 0..outside {
                head[at_break + index].meaning = Meaning::Undefined;
                head[at_continue + index].meaning = Meaning::Undefined;
            }
            self.cells.clone_from(&head);
            self.live = Some(Operand::Value(live));

            // The round.
            if let (Some(counter), Some(number)) = (counter, number) {
                let compare = if counter.range.inclusive { Comparison::Greater } else { Comparison::GreaterEqual };
                let over = self.builder.emit(Code::CompareInts(compare), &[Operand::Value(number), counter.range.end]);
                self.leave_where(over)?;
            }
            if !self.is_dead() {
                self.guarded(|lowerer| round(lowerer, number.map(Operand::Value)))?;
            }

            // What is carried to the next round.
            let goes_on = self.mask();
            let left = match self.cells[broken].meaning {
                Meaning::Bool(left) => left,
                _ => Operand::FALSE,
            };
            let mut next: Vec<Meaning> = Vec::with_capacity(outside + 1);
            for index in 0..outside {
                let end = self.cells[index].meaning.clone();
                next.push(if self.cells[index].exit {
                    end
                } else {
                    let at_break = self.cells[at_break + index].meaning.clone();
                    let head = head[index].meaning.clone();
                    let rest = if left == Operand::FALSE { head } else { self.builder.join(left, &at_break, &head) };
                    self.builder.join(goes_on, &end, &rest)
                });
            }
            let result = self.cells[value].meaning.clone();
            let next_number = number.map(|number| {
                self.builder.emit(Code::Int2(IntBinary::WrappingAdd), &[Operand::Value(number), Operand::Int(1)])
            });

            // Is that all that changes?
            let mut settled = true;
            let mut changes: Vec<(usize, &Meaning)> = (0..outside).zip(&next).collect();
            changes.push((value, &result));
            for (index, next) in changes {
                if *next == head[index].meaning && !carried.contains(&index) {
                    continue;
                }
                if start[index].meaning == Meaning::Undefined
                    || (index == value && !start[index].meaning.same_form(next))
                {
                    // Nobody reads an exit cell before it is set.
                    let builder = &self.builder;
                    start[index].meaning = next.map(&mut |operand| builder.nothing(builder.kind(operand)));
                    settled = false;
                }
                let builder = &self.builder;
                if let Some(wider) =
                    start[index].meaning.with_keys_of(next, &mut |operand| builder.nothing(builder.kind(operand)))
                {
                    start[index].meaning = wider;
                    settled = false;
                }
                if !start[index].meaning.same_form(next) {
                    let what = format!(
                        "a variable that is {} before a round of a loop and {} after it",
                        start[index].meaning.name(),
                        next.name()
                    );
                    self.builder.close();
                    self.builder.go_back(mark);
                    self.cells = before;
                    self.live = Some(entry_live);
                    self.cost = cost_before;
                    return Ok(Some(Obstacle::Form(what)));
                }
                settled &= !carried.insert(index);
                let varies = next
                    .operands()
                    .iter()
                    .chain(&start[index].meaning.operands())
                    .any(|o| !self.builder.is_uniform(*o));
                if varies {
                    settled &= !varying.insert(index);
                }
            }
            if !live_varies && !self.builder.is_uniform(goes_on) {
                live_varies = true;
                settled = false;
            }
            if !counter_varies && next_number.is_some_and(|next| !self.builder.is_uniform(next)) {
                counter_varies = true;
                settled = false;
            }
            if !settled {
                self.builder.close();
                self.builder.go_back(mark);
                continue;
            }

            // It is: put the loop where it belongs.
            let mut all = vec![Carried { value: live, start: entry_live, next: goes_on }];
            for (index, heads) in parts {
                let next = if index == value { &result } else { &next[index] };
                let (starts, nexts) = (start[index].meaning.operands(), next.operands());
                for ((head, start), next) in heads.into_iter().zip(starts).zip(nexts) {
                    if let Operand::Value(value) = head {
                        all.push(Carried { value, start, next });
                    }
                }
            }
            if let (Some(counter), Some(value), Some(next)) = (counter, number, next_number) {
                all.push(Carried { value, start: counter.range.low, next });
            }
            let block = self.builder.close();
            self.builder.push_loop(all, block, goes_on, self.cost - cost_before);

            // Behind it, the carried values are what hits had when they left.
            let returned = self.frames.last().map(|frame| frame.returned);
            let broken_before = before[broken].meaning.clone();
            let at_break_before: Vec<_> = (0..outside).map(|i| before[at_break + i].meaning.clone()).collect();
            let value_now = head[value].meaning.clone();
            self.cells = head;
            self.cells[value].meaning = value_now;
            self.cells[broken].meaning = broken_before;
            for (index, meaning) in at_break_before.into_iter().enumerate() {
                self.cells[at_break + index].meaning = meaning;
            }
            // All hits that entered have left the loop, by a `break` or else by a `return`.
            let gone = match returned.map(|cell| &self.cells[cell].meaning) {
                Some(Meaning::Bool(gone)) => *gone,
                _ => Operand::FALSE,
            };
            let live = self.builder.and_not(entry_live, gone);
            self.live = (left != Operand::FALSE && live != Operand::FALSE).then_some(live);
            return Ok(None);
        }
        self.give_up(position, "a loop whose variables do not settle")
    }
}

/// The numbers of a range that is known and short.
fn few_numbers(range: Range) -> Option<std::ops::Range<i64>> {
    let (low, end) = (range.low.as_int()?, range.end.as_int()?);
    let end = if range.inclusive { end.checked_add(1)? } else { end };
    (end.saturating_sub(low) <= MAX_UNROLLED as i64).then_some(low..end)
}
