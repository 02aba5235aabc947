//! From a script's syntax tree to a program: the script is run once, with columns in place of values.
//!
//! Parameters and all that follows from them alone are constants, so branches on them are decided here and their loops
//! unrolled; script functions and closures are inlined. What depends on hits becomes instructions:
//!
//! 1. `meaning` says what a value is while the script is walked, and joins what two paths give.
//! 2. Here: variables, calls, and branches. The *live mask* says at which hits control is at the current place; a
//!    `return`, `break` or `continue` takes hits out of it until the function, loop or round ends.
//! 3. `statements`, `expressions`, `chains` walk the tree; `operators`, `library` and `inputs` lower what scripts compute
//!    and read.
//! 4. `loops` unrolls loops or makes them loops of the program.
//!
//! A script that cannot be lowered is run by the interpreter; the [`Blame`] says which construct is at fault.
//!
//! A variable is a *cell*. Ordinary cells matter only at live hits. *Exit* cells (a function's result so far, what
//! variables were where a loop was left) matter at hits that are not live any more, and are joined with care for them.

mod chains;
mod expressions;
mod inputs;
mod library;
mod loops;
pub(super) mod meaning;
mod operators;
mod statements;

use std::rc::Rc;
use std::sync::Arc;

use rhai::Position;

use self::meaning::{Channels, Field, Meaning, Record};
use super::build::Builder;
use super::ir::{Block, Code, Column, Comparison, Item, Kind, Operand, ValueType};
use crate::scene::attributes::AttributeSet;
use crate::scene::texture::{Texture, TextureRef};
use crate::shade::analysis::Finding;
use crate::shade::host::{MAX_CALL_DEPTH, MAX_OPERATIONS};
use crate::shade::names::{self, AOV_PREFIX, OutputForm, OutputSet, PAIR_INPUTS, PairForm};
use crate::shade::native::NativeFunction;
use crate::shade::params::{Params, Value};
use crate::shade::script::{Entry, Functions, Program, ScriptFunction};

/// Constructs that are walked before a script counts as too long to be a kernel.
const MAX_STEPS: u32 = 60_000;
/// Values in one record or array. The engine's own limits lie above.
const MAX_PARTS: usize = 200;

/// Why a script cannot be lowered.
#[derive(Clone, Debug)]
pub(super) struct Blame(pub Finding);

/// What walking yields, unless the script cannot be lowered.
pub(super) type Flow<T> = Result<T, Blame>;

/// A variable, or part of the state of a call or loop.
#[derive(Clone, Debug)]
struct Cell {
    meaning: Meaning,
    exit: bool,
    identity: u64,
    constant: bool,
    /// Whether a closure has captured it.
    shared: bool,
}

/// A call that is being inlined.
#[derive(Debug, Default)]
struct Frame {
    /// Variables in scope, the innermost last.
    names: Vec<(Rc<str>, usize)>,
    loops: Vec<LoopContext>,
    /// Exit cells: at which hits the function has returned, and what.
    returned: usize,
    result: usize,
    /// Variables around the call that it may change (`this`, and what closures have captured), each with the exit cell
    /// that keeps what it was where hits returned.
    shares: Vec<(usize, usize)>,
    /// For messages about recursion.
    function: Rc<str>,
    /// Which of the program's files the code stands in.
    file: usize,
}

/// A loop that is being walked; all are exit cells.
#[derive(Debug, Default)]
struct LoopContext {
    /// Cells that exist outside the loop.
    outside: usize,
    broken: usize,
    /// The value of `break`.
    value: usize,
    /// As many as there are cells outside: what they were where the loop was left.
    at_break: usize,
    continued: usize,
    at_continue: usize,
}

/// What the lowering knows beside the script.
#[derive(Clone, Copy, Debug)]
pub(in crate::shade) struct Surroundings<'a> {
    pub textures: &'a [Arc<Texture>],
    /// Material number, from 1, as `hit.material_id`.
    pub material_id: u32,
    /// The scene's sets of attributes.
    pub attributes: &'a Arc<Vec<AttributeSet>>,
    /// Functions that plug-ins have added.
    pub natives: &'a [NativeFunction],
    /// Lights in the scene; `None` if the same kernel must serve any number.
    pub light_count: Option<usize>,
}

/// A texture and where on it.
#[derive(Clone, Debug)]
pub(in crate::shade) struct TextureUse {
    pub texture: Arc<Texture>,
    pub place: TextureRef,
}

/// A lowered script.
#[derive(Debug)]
pub(super) struct Lowered {
    pub block: Block,
    pub types: Vec<ValueType>,
    /// What the returned record holds.
    pub outputs: Vec<LoweredOutput>,
    pub textures: Vec<TextureUse>,
    pub natives: Vec<NativeFunction>,
    /// What loops may cost in the interpreter's operations before their hits are given to it.
    pub fuel: u64,
}

/// A key of the returned record.
#[derive(Clone, Debug)]
pub(super) struct LoweredOutput {
    pub target: Target,
    /// One float, three floats, or one int (`priority`).
    pub channels: Channels,
    /// Where the key is there at all.
    pub present: Operand,
}

/// Which column an output fills.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Target {
    /// One flag.
    Output(OutputSet),
    /// A layer of the script's own, by name without the prefix.
    Aov(String),
}

/// Lowers a function of a script that the renderer calls, for a material with these parameters.
pub(super) fn lower(program: &Program, entry: Entry, params: &Params, surroundings: Surroundings<'_>) -> Flow<Lowered> {
    let functions = &program.functions;
    let mut lowerer = Lowerer {
        builder: Builder::new(),
        functions,
        surroundings,
        textures: Vec::new(),
        natives: Vec::new(),
        cells: Vec::new(),
        live: Some(Operand::TRUE),
        frames: Vec::new(),
        cost: 0,
        steps: 0,
        next_identity: 0,
    };
    let called = program.key(entry).and_then(|key| Some((key.0.as_str(), functions.get(key)?)));
    let Some((name, function)) = called else {
        return Err(lowerer.blame(Position::NONE, &format!("a script without `{}`", entry.form())));
    };
    let record = params.0.iter().map(|(name, value)| {
        (Rc::from(name.as_str()), Field { value: lowerer.parameter(value), present: Operand::TRUE })
    });
    let parameters = Meaning::Parameters(Rc::new(record.collect()));
    let first = match entry {
        Entry::Surface => Meaning::Hit,
        Entry::Line => lowerer.pair(),
    };
    let arguments = [first, parameters].into_iter().take(function.parameters.len()).collect();
    let returned = lowerer.call(function, name, arguments, None, Position::NONE)?;
    let end = function.body.last().map_or(Position::NONE, rhai::Stmt::position);
    let record = match returned {
        Meaning::Record(record) => record,
        // Every hit fails or leaves otherwise: there is nothing for a kernel to do.
        other => {
            return Err(lowerer.blame(end, &format!("that `{}` may return {}", entry.name(), other.name())));
        }
    };
    lowerer.step(end)?;
    let outputs = lowerer.outputs(entry, &record, end)?;
    let fuel = MAX_OPERATIONS.saturating_sub(lowerer.cost);
    if fuel == 0 {
        return Err(lowerer.blame(Position::NONE, "the sheer number of operations"));
    }
    let (textures, natives) = (std::mem::take(&mut lowerer.textures), std::mem::take(&mut lowerer.natives));
    let (block, types) = lowerer.builder.finish();
    Ok(Lowered { block, types, outputs, textures, natives, fuel })
}

/// The state of the walk.
struct Lowerer<'a> {
    builder: Builder,
    functions: &'a Functions,
    surroundings: Surroundings<'a>,
    textures: Vec<TextureUse>,
    natives: Vec<NativeFunction>,
    cells: Vec<Cell>,
    /// At which hits control is here; `None` if at none.
    live: Option<Operand>,
    frames: Vec<Frame>,
    /// The most operations, as the interpreter counts them, of what has been walked.
    cost: u64,
    steps: u32,
    next_identity: u64,
}

impl Lowerer<'_> {
    /// The reason not to lower a script.
    fn blame(&self, position: Position, what: &str) -> Blame {
        Blame(Finding {
            file: self.frames.last().map_or(0, |frame| frame.file),
            place: (position.line().unwrap_or(0), position.position().unwrap_or(0)),
            message: format!("{what} cannot be made part of a kernel"),
            hint: None,
        })
    }

    fn give_up<T>(&self, position: Position, what: &str) -> Flow<T> {
        Err(self.blame(position, what))
    }

    /// Counts a construct.
    fn step(&mut self, position: Position) -> Flow<()> {
        self.steps += 1;
        // The interpreter counts at most two operations for a construct, and one for the call that it may be.
        self.cost += 3;
        if self.steps > MAX_STEPS || self.builder.is_full() {
            return self.give_up(position, "a script of this length, with its loops unrolled,");
        }
        if self.builder.too_many_types {
            return self.give_up(position, "a value that may be of so many types");
        }
        Ok(())
    }

    fn is_dead(&self) -> bool {
        self.live.is_none()
    }

    /// The live mask. Nothing is emitted where no hit is live, so what stands for it there does not matter.
    fn mask(&self) -> Operand {
        self.live.unwrap_or(Operand::FALSE)
    }

    /// All live hits fail.
    fn fail(&mut self) {
        if let Some(live) = self.live.take() {
            self.builder.push(Item::Fail(live));
        }
    }

    /// Live hits where the condition holds fail. They go on, with values that nobody reads.
    fn fail_where(&mut self, condition: Operand) {
        let mask = self.builder.and(self.mask(), condition);
        if mask != Operand::FALSE {
            self.builder.push(Item::Fail(mask));
        }
    }

    fn parameter(&mut self, value: &Value) -> Meaning {
        match value {
            Value::Unit => Meaning::Unit,
            Value::Bool(x) => Meaning::bool(*x),
            Value::Int(x) => Meaning::int(*x),
            Value::Float(x) => Meaning::float(*x),
            Value::Vec2(v) => Meaning::vector(&v.to_array().map(Operand::float)),
            Value::Vec3(v) => Meaning::vector(&v.to_array().map(Operand::float)),
            Value::Vec4(v) => Meaning::vector(&v.to_array().map(Operand::float)),
            Value::Text(text) => Meaning::Text(text.as_str().into()),
            Value::Texture(place) => match self.surroundings.textures.get(place.texture.index()) {
                Some(texture) => self.texture_use(Arc::clone(texture), *place),
                None => Meaning::Unit,
            },
            Value::Record(entries) => {
                let fields = entries.iter().map(|(key, value)| {
                    (Rc::from(key.as_str()), Field { value: self.parameter(value), present: Operand::TRUE })
                });
                Meaning::Record(Rc::new(fields.collect()))
            }
            Value::Array(items) => Meaning::Array(Rc::new(items.iter().map(|item| self.parameter(item)).collect())),
        }
    }

    /// A use of a texture.
    fn texture_use(&mut self, texture: Arc<Texture>, place: TextureRef) -> Meaning {
        self.textures.push(TextureUse { texture, place });
        Meaning::Texture(self.textures.len() - 1)
    }

    /// What `line` gets: a record of inputs, of which only those that are read stay in the program.
    fn pair(&mut self) -> Meaning {
        let mut side = |other: bool| {
            let inputs = PAIR_INPUTS.iter().filter(|input| input.of_side || !other);
            let fields = inputs.map(|input| {
                let mut read = |kind, lane| {
                    self.builder.emit(Code::Input(Column::Pair { input: input.input, other, kind }, lane), &[])
                };
                let value = match input.form {
                    PairForm::Bool => Meaning::Bool(read(Kind::Bool, 0)),
                    PairForm::Int => Meaning::Int(read(Kind::Int, 0)),
                    PairForm::Word(words) => Meaning::Word(read(Kind::Int, 0), words),
                    PairForm::Floats(1, _) => Meaning::Float(read(Kind::Float, 0)),
                    PairForm::Floats(count, _) => {
                        Meaning::Vector((0..count).map(|lane| read(Kind::Float, lane)).collect())
                    }
                };
                (Rc::from(input.name), Field { value, present: Operand::TRUE })
            });
            fields.collect::<Record>()
        };
        let (mut pair, other) = (side(false), side(true));
        let other = Field { value: Meaning::Record(Rc::new(other)), present: Operand::TRUE };
        pair.insert(names::OTHER.into(), other);
        Meaning::Record(Rc::new(pair))
    }

    // What is returned.

    fn outputs(&mut self, entry: Entry, record: &Record, position: Position) -> Flow<Vec<LoweredOutput>> {
        let mut outputs = Vec::new();
        for (key, field) in record {
            let of_line = entry == Entry::Line;
            let target = match (OutputSet::spelled(key), key.strip_prefix(AOV_PREFIX)) {
                (Some(output), _) if !of_line || names::line_outputs().any(|known| known == &**key) => {
                    Target::Output(output)
                }
                (None, Some(name)) if !of_line => Target::Aov(name.to_owned()),
                _ => return self.give_up(position, &format!("the output `{key}`")),
            };
            // What is wrong with an output matters where it is there.
            self.live = Some(field.present);
            let channels = self.spread(vec![field.value.clone()], &mut |lowerer, value| {
                lowerer.output(&target, &value[0], position)
            })?;
            let channels = match channels {
                Meaning::Vector(channels) => channels,
                Meaning::Int(x) | Meaning::Float(x) => Channels::from_slice(&[x]),
                // The key is there at no hit.
                _ => continue,
            };
            outputs.push(LoweredOutput { target, channels, present: field.present });
        }
        Ok(outputs)
    }

    /// A value as an output holds it.
    fn output(&mut self, target: &Target, value: &Meaning, position: Position) -> Flow<Meaning> {
        let output = match target {
            Target::Output(output) => *output,
            Target::Aov(_) => OutputSet::COLOR,
        };
        let form = output.form();
        match (form, value) {
            (OutputForm::Int, Meaning::Int(x)) => {
                let [low, high] = [i32::MIN, i32::MAX].map(|x| Operand::Int(x.into()));
                let under = self.builder.emit(Code::CompareInts(Comparison::Less), &[*x, low]);
                let over = self.builder.emit(Code::CompareInts(Comparison::Greater), &[*x, high]);
                let outside = self.builder.or(under, over);
                self.fail_where(outside);
                Ok(Meaning::Int(*x))
            }
            (OutputForm::Color | OutputForm::Vector, Meaning::Vector(channels)) if channels.len() == 3 => {
                Ok(value.clone())
            }
            (OutputForm::Number | OutputForm::Color, number) => match self.number(number) {
                Some(x) if form == OutputForm::Number => Ok(Meaning::Float(x)),
                Some(x) => Ok(Meaning::Vector(Channels::from_elem(x, 3))),
                None => self.give_up(position, &format!("an output that is {}", number.name())),
            },
            (_, other) => self.give_up(position, &format!("an output that is {}", other.name())),
        }
    }

    // Variables.

    fn new_cell(&mut self, meaning: Meaning, exit: bool) -> usize {
        self.next_identity += 1;
        self.cells.push(Cell { meaning, exit, identity: self.next_identity, constant: false, shared: false });
        self.cells.len() - 1
    }

    fn declare(&mut self, name: &str, meaning: Meaning) -> usize {
        let cell = self.new_cell(meaning, false);
        self.bind(name, cell);
        cell
    }

    fn bind(&mut self, name: &str, cell: usize) {
        if let Some(frame) = self.frames.last_mut() {
            frame.names.push((name.into(), cell));
        }
    }

    fn find(&self, name: &str) -> Option<usize> {
        let names = &self.frames.last()?.names;
        names.iter().rev().find(|(known, _)| &**known == name).map(|(_, cell)| *cell)
    }

    /// Runs code in a scope of its own: what it declares is gone afterwards.
    fn scoped<T>(&mut self, walk: impl FnOnce(&mut Self) -> Flow<T>) -> Flow<T> {
        let names = self.frames.last().map_or(0, |frame| frame.names.len());
        let cells = self.cells.len();
        let value = walk(self)?;
        if let Some(frame) = self.frames.last_mut() {
            frame.names.truncate(names);
        }
        self.cells.truncate(cells);
        Ok(value)
    }

    // Calls.

    /// Inlines a script function. `this` is the cell of what a method was called on.
    fn call(
        &mut self,
        function: &ScriptFunction,
        name: &str,
        arguments: Vec<Meaning>,
        this: Option<usize>,
        position: Position,
    ) -> Flow<Meaning> {
        let cells = self.cells.len();
        let mut names: Vec<(Rc<str>, usize)> = this.map(|cell| (Rc::from("this"), cell)).into_iter().collect();
        for (parameter, argument) in function.parameters.iter().zip(arguments) {
            names.push((parameter.as_str().into(), self.new_cell(argument, false)));
        }
        let value = self.inline(function, name, names, position)?;
        self.cells.truncate(cells);
        Ok(value)
    }

    /// Walks a function's body with these variables in scope.
    fn inline(
        &mut self,
        function: &ScriptFunction,
        name: &str,
        names: Vec<(Rc<str>, usize)>,
        position: Position,
    ) -> Flow<Meaning> {
        if function.is_typed {
            return self.give_up(position, "a function for one type of `this`");
        }
        if self.frames.iter().any(|frame| &*frame.function == name) {
            return self.give_up(position, &format!("`{}`, which calls itself,", function.name));
        }
        // `surface` itself is run, not called.
        if self.frames.len() > MAX_CALL_DEPTH {
            return self.give_up(position, "a call nested this deep");
        }
        let cells = self.cells.len();
        let (returned, result) = (self.new_cell(Meaning::bool(false), true), self.new_cell(Meaning::Undefined, true));
        let outside: Vec<usize> = (0..cells)
            .filter(|cell| {
                !self.cells[*cell].exit
                    && (self.cells[*cell].shared
                        || names.iter().any(|(name, named)| &**name == "this" && named == cell))
            })
            .collect();
        let shares: Vec<(usize, usize)> =
            outside.into_iter().map(|cell| (cell, self.new_cell(Meaning::Undefined, true))).collect();
        let entry = self.live;
        // Closures are called within their own file.
        let outer = self.frames.last().map_or(function.file, |frame| frame.file);
        let file = if function.is_closure() { outer } else { function.file };
        let frame =
            Frame { names, loops: Vec::new(), returned, result, shares: shares.clone(), function: name.into(), file };
        self.frames.push(frame);
        let value = self.statements(&function.body)?;
        self.frames.pop();
        if let Meaning::Bool(returned) = self.cells[returned].meaning
            && returned != Operand::FALSE
        {
            // What hits that returned early had when they did.
            for (cell, kept) in shares {
                let (then, now) = (self.cells[kept].meaning.clone(), self.cells[cell].meaning.clone());
                self.cells[cell].meaning = if self.is_dead() { then } else { self.builder.join(returned, &then, &now) };
            }
        }
        let result = self.cells[result].meaning.clone();
        let value = match (self.live, &self.cells[returned].meaning) {
            (Some(_), Meaning::Bool(Operand::FALSE)) => value,
            (None, Meaning::Bool(Operand::FALSE)) => Meaning::Undefined,
            (Some(_), Meaning::Bool(returned)) => {
                self.live = entry;
                self.builder.join(*returned, &result, &value)
            }
            _ => {
                self.live = entry;
                result
            }
        };
        self.cells.truncate(cells);
        Ok(value)
    }

    /// Live hits return from the innermost call.
    fn leave_call(&mut self, value: &Meaning) {
        let (Some(live), Some(frame)) = (self.live, self.frames.last()) else { return };
        let (returned, result, shares) = (frame.returned, frame.result, frame.shares.clone());
        self.leave_into(live, returned, result, value);
        for (cell, kept) in shares {
            let (now, before) = (self.cells[cell].meaning.clone(), self.cells[kept].meaning.clone());
            self.cells[kept].meaning = self.builder.join(live, &now, &before);
        }
        self.live = None;
    }

    /// Notes in exit cells that hits left here, and with what.
    fn leave_into(&mut self, live: Operand, gone: usize, carried: usize, value: &Meaning) {
        if let Meaning::Bool(before) = self.cells[gone].meaning {
            self.cells[gone].meaning = Meaning::Bool(self.builder.or(before, live));
        }
        self.cells[carried].meaning = self.builder.join(live, value, &self.cells[carried].meaning);
    }

    // Branches.

    /// Walks both sides of a choice, each for its hits, and goes on with what is known after either.
    fn branch(
        &mut self,
        condition: Operand,
        first: impl FnOnce(&mut Self) -> Flow<Meaning>,
        second: impl FnOnce(&mut Self) -> Flow<Meaning>,
    ) -> Flow<Meaning> {
        match (condition, self.live) {
            (_, None) => return Ok(Meaning::Undefined),
            (Operand::TRUE, _) => return first(self),
            (Operand::FALSE, _) => return second(self),
            _ => {}
        }
        let live = self.mask();
        let uniform = self.builder.is_uniform(condition);
        let guards = if uniform {
            [condition, self.builder.not(condition)]
        } else {
            [self.builder.and(live, condition), self.builder.and_not(live, condition)]
        };
        let masks = if uniform { [live; 2] } else { guards };

        let before = self.cells.clone();
        self.live = Some(masks[0]);
        self.builder.open();
        let value_a = first(self)?;
        let block = self.builder.close();
        let (cells_a, live_a) = (std::mem::replace(&mut self.cells, before.clone()), self.live);
        self.push_guarded(guards[0], block);

        self.live = Some(masks[1]);
        self.builder.open();
        let value_b = second(self)?;
        let block = self.builder.close();
        let (cells_b, live_b) = (std::mem::replace(&mut self.cells, before), self.live);
        self.push_guarded(guards[1], block);

        for (index, (a, b)) in cells_a.into_iter().zip(cells_b).enumerate() {
            self.cells[index].shared = a.shared || b.shared;
            let joined = if self.cells[index].exit {
                self.join_exit(uniform, guards, &a.meaning, &b.meaning, index)
            } else {
                match (live_a, live_b) {
                    (Some(_), None) => a.meaning,
                    (None, Some(_)) => b.meaning,
                    _ => self.builder.join(guards[0], &a.meaning, &b.meaning),
                }
            };
            self.cells[index].meaning = joined;
        }
        self.live = match (live_a, live_b) {
            (Some(a), Some(b)) if a == masks[0] && b == masks[1] => Some(live),
            (Some(a), Some(b)) => {
                let (a, b) = (self.cut(a, guards[0]), self.cut(b, guards[1]));
                Some(self.builder.or(a, b))
            }
            (Some(a), None) => Some(self.cut(a, guards[0])),
            (None, Some(b)) => Some(self.cut(b, guards[1])),
            (None, None) => None,
        };
        Ok(match (live_a, live_b) {
            (Some(_), Some(_)) => self.builder.join(guards[0], &value_a, &value_b),
            (Some(_), None) => value_a,
            (None, Some(_)) => value_b,
            (None, None) => Meaning::Undefined,
        })
    }

    /// A mask that was worked out on one side of a choice: a side that was skipped left nothing in it that could be read.
    fn cut(&mut self, mask: Operand, guard: Operand) -> Operand {
        if mask == guard { guard } else { self.builder.and(mask, guard) }
    }

    /// An exit cell after a choice. At hits that were live on neither side it stays what it was.
    fn join_exit(&mut self, uniform: bool, guards: [Operand; 2], a: &Meaning, b: &Meaning, index: usize) -> Meaning {
        if a == b {
            return a.clone();
        }
        let before = self.cells[index].meaning.clone();
        let rest = if uniform || *b == before { b.clone() } else { self.builder.join(guards[1], b, &before) };
        self.builder.join(guards[0], a, &rest)
    }

    /// Adds a block that runs where its guard holds.
    fn push_guarded(&mut self, guard: Operand, block: Block) {
        if block.items.is_empty() {
            return;
        }
        if guard == Operand::TRUE {
            block.items.into_iter().for_each(|item| self.builder.push(item));
        } else {
            self.builder.push(Item::If { guard, block });
        }
    }

    /// Walks code that matters only at live hits, and is skipped if there are none left.
    fn guarded<T>(&mut self, walk: impl FnOnce(&mut Self) -> Flow<T>) -> Flow<T> {
        let live = self.mask();
        if self.is_dead() || live == Operand::TRUE {
            return walk(self);
        }
        let before = self.cells.clone();
        self.builder.open();
        let value = walk(self)?;
        let block = self.builder.close();
        self.push_guarded(live, block);
        for (index, before) in before.into_iter().enumerate() {
            if before.exit && self.cells[index].meaning != before.meaning {
                self.cells[index].meaning =
                    self.builder.join(live, &self.cells[index].meaning.clone(), &before.meaning);
            }
        }
        if let Some(after) = self.live
            && after != live
        {
            self.live = Some(self.builder.and(live, after));
        }
        Ok(value)
    }
}
