//! The state of a walk: variables, calls, loops, and what has been found so far.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;
use std::sync::Arc;

use rhai::Position;

use super::Finding;
use super::value::{Abstract, Cell, Identity, Join, KeysOf, Place, Shape};
use crate::scene::attributes::AttributeSet;
use crate::scene::texture::Texture;
use crate::shade::names::InputSet;
use crate::shade::script::Functions;

/// Expressions that a walk may evaluate before it gives up: bounds its time.
const MAX_STEPS: u32 = 400_000;
/// Expressions after which loops are no longer walked round by round.
const MAX_STEPS_UNROLLED: u32 = 100_000;
/// Values in one record or array, those in its parts included. Parts are shared, so that a script could build a value
/// of astronomic size in a few lines; the engine's own limits end such a script.
const MAX_PARTS: usize = 2048;
/// Calls inside calls.
const MAX_CALL_DEPTH: usize = 24;

/// Why the rest of a piece of code is not walked.
#[derive(Debug)]
pub(super) enum Stop {
    /// Control went elsewhere (`return`, `break`, `continue`, `throw`): what follows is not reached from here.
    Left,
    /// The script is beyond this analysis.
    GaveUp,
}

/// What evaluation yields, unless it does not come back.
pub(super) type Flow<T> = Result<T, Stop>;

/// A variable in scope.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Variable {
    pub name: Rc<str>,
    pub value: Abstract,
    /// Which shared variable it is, once a closure has captured it.
    pub cell: Option<Cell>,
}

impl Variable {
    /// A variable that nothing shares.
    pub fn new(name: impl Into<Rc<str>>, value: Abstract) -> Self {
        Self { name: name.into(), value, cell: None }
    }
}

/// All variables of a call, outermost block first; a later one shadows an earlier one of the same name.
pub(super) type Variables = Vec<Variable>;

/// The place where paths meet again: states or values that got there.
#[derive(Default)]
pub(super) struct Exits {
    /// Variables as they were where control left, and the value it took along.
    pub states: Vec<(Variables, Abstract)>,
}

/// A loop being walked.
#[derive(Default)]
pub(super) struct Loop {
    pub breaks: Exits,
    pub continues: Exits,
    /// What leaving this loop, or a round of it, early depends on.
    pub escape: InputSet,
    /// Whether the test comes after the body (`do`).
    pub test_last: bool,
    /// Variables outside the loop's body.
    pub depth: usize,
}

/// A script function being walked.
#[derive(Default)]
pub(super) struct Call {
    pub variables: Variables,
    pub loops: Vec<Loop>,
    pub returns: Exits,
    /// How many of the first variables the caller gets back: `this`, or what a closure captures.
    pub kept: usize,
    /// Which of the program's files the code stands in.
    pub file: usize,
    /// What the branches around the current code depend on.
    pub branches: InputSet,
    /// What leaving this call early depends on.
    pub escape: InputSet,
}

/// The walk over one material's shader.
pub(super) struct Walker<'a> {
    pub functions: &'a Functions,
    pub textures: &'a [Arc<Texture>],
    /// The sets of attributes that hits of the material can have.
    pub attribute_sets: &'a [&'a AttributeSet],
    /// Names of attributes that were asked for.
    pub attributes: BTreeSet<String>,
    /// Bounds of the textures that were looked up, which cost a look at all pixels, by their index.
    pub texture_bounds: BTreeMap<usize, Shape>,
    /// The innermost call is the last.
    pub calls: Vec<Call>,
    /// Inputs that were read.
    pub inputs: InputSet,
    /// Parameters that were read.
    pub parameters: BTreeSet<Rc<str>>,
    /// By place, so that code that is walked twice is blamed once.
    pub findings: BTreeSet<Finding>,
    /// Why the walk gave up.
    pub blame: Option<Finding>,
    pub next_identity: Identity,
    steps: u32,
}

impl<'a> Walker<'a> {
    pub fn new(functions: &'a Functions, textures: &'a [Arc<Texture>], attribute_sets: &'a [&'a AttributeSet]) -> Self {
        Self {
            functions,
            textures,
            attribute_sets,
            attributes: BTreeSet::new(),
            texture_bounds: BTreeMap::new(),
            calls: vec![Call::default()],
            inputs: InputSet::empty(),
            parameters: BTreeSet::new(),
            findings: BTreeSet::new(),
            blame: None,
            next_identity: 0,
            steps: 0,
        }
    }

    /// A position of the script engine in the code that is being walked.
    pub fn place(&self, position: Position) -> Place {
        let file = self.calls.last().map_or(0, |call| call.file);
        (file, position.line().unwrap_or(0), position.position().unwrap_or(0))
    }

    /// Notes what is certainly wrong.
    pub fn find_fault(&mut self, position: Position, message: String, hint: Option<String>) {
        let place = self.place(position);
        self.findings.insert(Finding::new(place, message, hint));
    }

    /// A new identity.
    pub fn fresh(&mut self) -> Identity {
        self.next_identity += 1;
        self.next_identity
    }

    /// A new value. One that is exactly known depends on nothing.
    pub fn value(&mut self, shape: Shape, inputs: InputSet) -> Abstract {
        if shape.is_container() {
            let whole = Abstract::constant(shape, self.fresh());
            let parts = whole.count_parts(MAX_PARTS);
            self.steps += u32::try_from(parts / 16).unwrap_or(u32::MAX);
            return if parts < MAX_PARTS { whole } else { self.unknown([&whole]) };
        }
        let inputs = if shape.is_exact() { InputSet::empty() } else { inputs };
        Abstract { identity: self.fresh(), shape, inputs }
    }

    pub fn constant(&mut self, shape: Shape) -> Abstract {
        self.value(shape, InputSet::empty())
    }

    pub fn unit(&mut self) -> Abstract {
        self.constant(Shape::Unit)
    }

    /// A value of which nothing is known but what it is computed from.
    pub fn unknown<'v>(&mut self, from: impl IntoIterator<Item = &'v Abstract>) -> Abstract {
        let inputs = from.into_iter().map(|value| self.escape(value)).collect();
        self.value(Shape::Unknown, inputs)
    }

    /// All that a value can tell to code that is not known. `hit` tells everything.
    pub fn escape(&mut self, value: &Abstract) -> InputSet {
        if value.holds_hit() {
            self.inputs = InputSet::all();
        }
        if let Shape::Record(record) = &value.shape
            && record.keys_of == KeysOf::Parameters
        {
            self.parameters.extend(record.fields.keys().cloned());
        }
        value.all_inputs()
    }

    /// Ends the analysis: the construct at `position` is beyond it.
    pub fn give_up<T>(&mut self, position: Position, what: &str) -> Flow<T> {
        let message = format!("{what} cannot be analysed");
        let place = self.place(position);
        self.blame.get_or_insert(Finding::new(place, message, None));
        Err(Stop::GaveUp)
    }

    /// Counts the work; a walk that grows too long ends.
    pub fn step(&mut self, position: Position) -> Flow<()> {
        self.steps += 1;
        if self.steps > MAX_STEPS {
            self.give_up(position, "a script that branches or loops this much")
        } else {
            Ok(())
        }
    }

    /// Whether a loop may still be walked round by round.
    pub fn may_unroll(&self) -> bool {
        self.steps < MAX_STEPS_UNROLLED
    }

    /// Whether another call may be entered.
    pub fn may_call(&self) -> bool {
        self.calls.len() < MAX_CALL_DEPTH
    }

    /// The innermost call.
    pub fn call(&mut self) -> &mut Call {
        let last = self.calls.len() - 1;
        &mut self.calls[last]
    }

    /// What it depends on whether the current code runs at all, within this call.
    pub fn control(&mut self) -> InputSet {
        let call = self.call();
        call.loops.iter().map(|l| l.escape).collect::<InputSet>() | call.branches | call.escape
    }

    /// Where a variable is.
    pub fn find(&mut self, name: &str) -> Option<&mut Variable> {
        self.call().variables.iter_mut().rev().find(|variable| &*variable.name == name)
    }

    /// Adds a variable.
    pub fn declare(&mut self, name: &str, value: Abstract) {
        self.call().variables.push(Variable::new(name, value));
    }

    /// The value that is one of two, chosen by `control`.
    pub fn join_values(&mut self, a: &Abstract, b: &Abstract, control: InputSet) -> Abstract {
        let joined =
            Join { control, next_identity: &mut self.next_identity, loop_values: None, widen: false }.join(a, b);
        self.note_lost_hit(&joined, a, b);
        joined
    }

    fn note_lost_hit(&mut self, joined: &Abstract, a: &Abstract, b: &Abstract) {
        if (a.holds_hit() || b.holds_hit()) && !(joined.holds_hit() && a.holds_hit() && b.holds_hit()) {
            self.inputs = InputSet::all();
        }
    }

    /// The variables after one of two paths, chosen by `control`.
    pub fn join_variables(&mut self, a: &Variables, b: &Variables, control: InputSet) -> Variables {
        a.iter()
            .zip(b)
            .map(|(a, b)| Variable {
                name: Rc::clone(&a.name),
                value: self.join_values(&a.value, &b.value, control),
                cell: a.cell.or(b.cell),
            })
            .collect()
    }

    /// The variables at the head of a loop: as before it, or as after a round.
    pub fn join_loop(
        &mut self,
        head: &Variables,
        end: &Variables,
        control: InputSet,
        loop_values: &mut BTreeSet<Identity>,
        widen: bool,
    ) -> Variables {
        let mut next = Variables::with_capacity(head.len());
        for (a, b) in head.iter().zip(end) {
            let loop_values = Some(&mut *loop_values);
            let value =
                Join { control, next_identity: &mut self.next_identity, loop_values, widen }.join(&a.value, &b.value);
            self.note_lost_hit(&value, &a.value, &b.value);
            next.push(Variable { name: Rc::clone(&a.name), value, cell: a.cell.or(b.cell) });
        }
        next
    }

    /// Joins all paths that got to one place; `None` if none did.
    pub fn join_exits(&mut self, exits: Exits, control: InputSet) -> Option<(Variables, Abstract)> {
        exits.states.into_iter().reduce(|(variables_a, value_a), (variables_b, value_b)| {
            (self.join_variables(&variables_a, &variables_b, control), self.join_values(&value_a, &value_b, control))
        })
    }

    /// Walks a piece of code whose running depends on `inputs`.
    pub fn under<T>(&mut self, inputs: InputSet, walk: impl FnOnce(&mut Self) -> Flow<T>) -> Flow<T> {
        let outer = self.call().branches;
        self.call().branches |= inputs;
        let result = walk(self);
        self.call().branches = outer;
        result
    }

    /// Walks two paths from the current state, of which one is taken by a choice that depends on `control`, and goes
    /// on with what is known after either.
    pub fn either(
        &mut self,
        control: InputSet,
        first: impl FnOnce(&mut Self) -> Flow<Abstract>,
        second: impl FnOnce(&mut Self) -> Flow<Abstract>,
    ) -> Flow<Abstract> {
        let before = self.call().variables.clone();
        let first = self.under(control, first);
        if let Err(Stop::GaveUp) = first {
            return first;
        }
        let after_first = std::mem::replace(&mut self.call().variables, before);
        let second = self.under(control, second);
        match (first, second) {
            (_, Err(Stop::GaveUp)) => Err(Stop::GaveUp),
            (Err(_), second) => second,
            (Ok(value), Err(Stop::Left)) => {
                self.call().variables = after_first;
                Ok(value)
            }
            (Ok(first), Ok(second)) => {
                let after_second = std::mem::take(&mut self.call().variables);
                self.call().variables = self.join_variables(&after_first, &after_second, control);
                Ok(self.join_values(&first, &second, control))
            }
        }
    }
}
