//! Slices of a program: what some outputs need, with registers shared out, ready to run.
//!
//! 1. What the wanted outputs do not need is dropped; what may fail stays, because a failing hit fails whatever is asked.
//! 2. Short branches are taken apart: working them out at all hits is cheaper than asking whether any hit needs them.
//! 3. Values get registers; a register is used again when nobody reads its value any more, so that the registers in use
//!    fit the nearest cache.

use std::collections::HashMap;

use smallvec::SmallVec;

use super::ir::{
    Block, Carried, Code, Column, FloatBinary, FloatUnary, Instruction, Item, Kind, Loop, Noise, Operand, Value,
    ValueType,
};
use crate::shade::names::{InputSet, PairSet};

/// A branch whose instructions cost less than this is taken apart.
const SHORT_BRANCH: u32 = 12;

/// Where an operand is: a register of the bank of its kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::shade) struct Register {
    pub index: u16,
    /// Whether its first block holds one value for all hits.
    pub uniform: bool,
}

/// Registers of an instruction.
pub(super) type Registers = SmallVec<[Register; 4]>;

/// An instruction with registers.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Step {
    Set { code: Code, operands: Registers, results: Registers },
    If { guard: Register, steps: Vec<Step> },
    Loop(Box<LoopSteps>),
    Fail(Register),
}

/// A loop with registers.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LoopSteps {
    pub carried: Vec<CarriedRegisters>,
    pub steps: Vec<Step>,
    pub again: Register,
    pub cost: u64,
}

/// What a loop carries, with registers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CarriedRegisters {
    pub kind: Kind,
    pub value: Register,
    pub start: Register,
    pub next: Register,
}

/// Registers of one kind.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct BankSize<T> {
    pub registers: usize,
    /// Registers that hold constants.
    pub constants: Vec<(u16, T)>,
}

impl<T> Default for BankSize<T> {
    fn default() -> Self {
        Self { registers: 0, constants: Vec::new() }
    }
}

/// A program that can be run, and where it leaves what was asked for.
#[derive(Clone, Debug, Default)]
pub(super) struct Runnable {
    pub steps: Vec<Step>,
    pub floats: BankSize<f32>,
    pub ints: BankSize<i64>,
    pub bools: BankSize<bool>,
    /// Registers of the roots, in order.
    pub roots: Vec<Register>,
}

impl Runnable {
    /// Whether another does the same to the last bit.
    pub fn same(&self, other: &Self) -> bool {
        let bits = |program: &Self| -> Vec<(u16, u32)> {
            program.floats.constants.iter().map(|(register, value)| (*register, value.to_bits())).collect()
        };
        self.steps == other.steps
            && self.floats.registers == other.floats.registers
            && bits(self) == bits(other)
            && self.ints == other.ints
            && self.bools == other.bools
            && self.roots == other.roots
    }
}

/// Cuts the slice of a program that the roots need, and gives it registers.
pub(super) fn cut(block: &Block, types: &[ValueType], roots: &[Operand]) -> Runnable {
    let mut needed = vec![false; types.len()];
    for root in roots {
        mark(&mut needed, *root);
    }
    // Loops hand values back, so marks may have to go round more than once.
    while mark_block(block, &mut needed) {}
    let block = pruned(block, &needed);
    let mut allocation = Allocation::new(types);
    allocation.find_last_uses(&block, roots);
    allocation.allocate(&block, roots)
}

fn mark(needed: &mut [bool], operand: Operand) -> bool {
    match operand {
        Operand::Value(Value(index)) => !std::mem::replace(&mut needed[index as usize], true),
        _ => false,
    }
}

/// Whether an instruction can make hits fail.
fn may_fail(instruction: &Instruction) -> bool {
    match instruction.code {
        Code::Checked(_) | Code::IntFromFloat => instruction.operands.last() != Some(&Operand::FALSE),
        Code::Native { can_fail, .. } => can_fail,
        _ => false,
    }
}

fn results(instruction: &Instruction) -> std::ops::Range<usize> {
    let first = instruction.first.0 as usize;
    first..first + usize::from(instruction.count)
}

/// Marks what a block's needed parts need. Whether anything was new.
fn mark_block(block: &Block, needed: &mut [bool]) -> bool {
    let mut news = false;
    for item in block.items.iter().rev() {
        match item {
            Item::Set(set) => {
                if needed[results(set)].iter().any(|needed| *needed) || may_fail(set) {
                    for operand in &set.operands {
                        news |= mark(needed, *operand);
                    }
                }
            }
            Item::If { guard, block } => {
                news |= mark_block(block, needed);
                if is_needed(block, needed) {
                    news |= mark(needed, *guard);
                }
            }
            Item::Loop(round) => {
                // A loop may never end, so it always counts.
                news |= mark(needed, round.again);
                for carried in &round.carried {
                    if needed[carried.value.0 as usize] {
                        news |= mark(needed, carried.start);
                        news |= mark(needed, carried.next);
                    }
                }
                news |= mark_block(&round.block, needed);
            }
            Item::Fail(mask) => news |= mark(needed, *mask),
        }
    }
    news
}

fn is_needed(block: &Block, needed: &[bool]) -> bool {
    block.items.iter().any(|item| match item {
        Item::Set(set) => needed[results(set)].iter().any(|needed| *needed) || may_fail(set),
        Item::If { block, .. } => is_needed(block, needed),
        Item::Loop(_) | Item::Fail(_) => true,
    })
}

/// A block without what nobody needs, and with short branches taken apart.
fn pruned(block: &Block, needed: &[bool]) -> Block {
    let mut kept = Block::default();
    for item in &block.items {
        match item {
            Item::Set(set) => {
                if needed[results(set)].iter().any(|needed| *needed) || may_fail(set) {
                    kept.items.push(item.clone());
                }
            }
            Item::If { guard, block } => {
                let block = pruned(block, needed);
                let cost = block.items.iter().try_fold(0, |sum, item| Some(sum + short_cost(item)?));
                match cost {
                    Some(0..=SHORT_BRANCH) => kept.items.extend(block.items),
                    _ => kept.items.push(Item::If { guard: *guard, block }),
                }
            }
            Item::Loop(round) => {
                let carried: Vec<Carried> =
                    round.carried.iter().filter(|carried| needed[carried.value.0 as usize]).copied().collect();
                let block = pruned(&round.block, needed);
                kept.items.push(Item::Loop(Box::new(Loop { carried, block, ..**round })));
            }
            Item::Fail(_) => kept.items.push(item.clone()),
        }
    }
    kept
}

/// What an instruction costs, in additions; `None` for what must stay in its branch.
fn short_cost(item: &Item) -> Option<u32> {
    let Item::Set(set) = item else { return if matches!(item, Item::Fail(_)) { Some(1) } else { None } };
    Some(match set.code {
        Code::Input(..) | Code::Float3(_) | Code::Checked(_) => 2,
        Code::Float2(FloatBinary::Remainder | FloatBinary::Power | FloatBinary::Atan2) => 30,
        Code::Float1(
            FloatUnary::Negate
            | FloatUnary::Abs
            | FloatUnary::Sign
            | FloatUnary::Floor
            | FloatUnary::Ceil
            | FloatUnary::Round
            | FloatUnary::Fract
            | FloatUnary::Sqrt
            | FloatUnary::Saturate,
        ) => 1,
        Code::Float1(_) => 30,
        Code::Noise(Noise::Fbm(octaves)) => 60 * u32::from(octaves),
        Code::Noise(_) | Code::Library(_) | Code::Texture(_) | Code::Native { .. } | Code::Light | Code::Irradiance => {
            60
        }
        Code::HashFloats(_) | Code::HashInt(_) => 15,
        _ => 1,
    })
}

/// Registers of one kind while they are shared out.
#[derive(Default)]
struct Pool {
    /// Free ones: with a row for each hit, and uniform ones.
    free: [Vec<u16>; 2],
    made: u16,
    constants: HashMap<Operand, u16>,
}

impl Pool {
    fn take(&mut self, uniform: bool) -> u16 {
        self.free[usize::from(uniform)].pop().unwrap_or_else(|| self.make())
    }

    fn make(&mut self) -> u16 {
        self.made += 1;
        self.made - 1
    }
}

/// The sharing out of registers.
struct Allocation<'a> {
    types: &'a [ValueType],
    /// Where each value is read last, as places in the order of items.
    last_use: Vec<u32>,
    pools: [Pool; 3],
    registers: HashMap<Value, u16>,
    place: u32,
}

fn number(kind: Kind) -> usize {
    match kind {
        Kind::Float => 0,
        Kind::Int => 1,
        Kind::Bool => 2,
    }
}

impl<'a> Allocation<'a> {
    fn new(types: &'a [ValueType]) -> Self {
        Self { types, last_use: vec![0; types.len()], pools: Default::default(), registers: HashMap::new(), place: 0 }
    }

    fn find_last_uses(&mut self, block: &Block, roots: &[Operand]) {
        let mut set_at = vec![0; self.types.len()];
        let mut place = 0;
        self.uses_of_block(block, &mut place, &mut set_at);
        for root in roots {
            self.read(*root, u32::MAX);
        }
    }

    fn read(&mut self, operand: Operand, place: u32) {
        if let Operand::Value(Value(index)) = operand {
            let last = &mut self.last_use[index as usize];
            *last = (*last).max(place);
        }
    }

    /// Every item has a place; a loop has one before and one behind its block.
    fn uses_of_block(&mut self, block: &Block, place: &mut u32, set_at: &mut Vec<u32>) {
        for item in &block.items {
            *place += 1;
            match item {
                Item::Set(set) => {
                    set.operands.iter().for_each(|operand| self.read(*operand, *place));
                    for result in results(set) {
                        set_at[result] = *place;
                        self.last_use[result] = self.last_use[result].max(*place);
                    }
                }
                Item::If { guard, block } => {
                    self.read(*guard, *place);
                    self.uses_of_block(block, place, set_at);
                }
                Item::Loop(round) => {
                    let start = *place;
                    for carried in &round.carried {
                        self.read(carried.start, start);
                        set_at[carried.value.0 as usize] = start;
                    }
                    self.uses_of_block(&round.block, place, set_at);
                    *place += 1;
                    let end = *place;
                    self.read(round.again, end);
                    for carried in &round.carried {
                        self.read(carried.next, end);
                        self.read(Operand::Value(carried.value), end);
                    }
                    // What comes from outside is needed in every round.
                    self.keep_until(&round.block, start, end, set_at);
                    for carried in &round.carried {
                        self.keep(carried.next, start, end, set_at);
                    }
                    self.keep(round.again, start, end, set_at);
                }
                Item::Fail(mask) => self.read(*mask, *place),
            }
        }
    }

    fn keep(&mut self, operand: Operand, start: u32, end: u32, set_at: &[u32]) {
        if let Operand::Value(Value(index)) = operand
            && set_at[index as usize] <= start
        {
            self.read(operand, end);
        }
    }

    fn keep_until(&mut self, block: &Block, start: u32, end: u32, set_at: &[u32]) {
        for item in &block.items {
            match item {
                Item::Set(set) => set.operands.iter().for_each(|operand| self.keep(*operand, start, end, set_at)),
                Item::If { guard, block } => {
                    self.keep(*guard, start, end, set_at);
                    self.keep_until(block, start, end, set_at);
                }
                Item::Loop(round) => {
                    for carried in &round.carried {
                        self.keep(carried.start, start, end, set_at);
                        self.keep(carried.next, start, end, set_at);
                    }
                    self.keep(round.again, start, end, set_at);
                    self.keep_until(&round.block, start, end, set_at);
                }
                Item::Fail(mask) => self.keep(*mask, start, end, set_at),
            }
        }
    }

    fn allocate(mut self, block: &Block, roots: &[Operand]) -> Runnable {
        let steps = self.steps(block);
        let roots: Vec<Register> = roots.iter().map(|root| self.register(*root)).collect();
        let [floats, ints, bools] = self.pools;
        Runnable {
            floats: bank(floats, Operand::as_float),
            ints: bank(ints, Operand::as_int),
            bools: bank(bools, Operand::as_bool),
            steps,
            roots,
        }
    }

    /// The register of a constant, or of a value that has been set.
    fn register(&mut self, operand: Operand) -> Register {
        let kind = match operand {
            Operand::Value(value) => {
                let uniform = self.types[value.0 as usize].uniform;
                // A value without a register would be one that is read before it is set, which `verify` rules out.
                return Register { index: self.registers.get(&value).copied().unwrap_or_default(), uniform };
            }
            Operand::Float(_) => Kind::Float,
            Operand::Int(_) => Kind::Int,
            Operand::Bool(_) => Kind::Bool,
        };
        let pool = &mut self.pools[number(kind)];
        let index = match pool.constants.get(&operand) {
            Some(index) => *index,
            None => {
                let index = pool.make();
                pool.constants.insert(operand, index);
                index
            }
        };
        Register { index, uniform: true }
    }

    fn give(&mut self, value: Value) -> Register {
        let ValueType { kind, uniform } = self.types[value.0 as usize];
        let index = self.pools[number(kind)].take(uniform);
        self.registers.insert(value, index);
        Register { index, uniform }
    }

    /// Frees the registers of values that are read for the last time at or before this place.
    fn free(&mut self, operands: impl Iterator<Item = Operand>) {
        for operand in operands {
            if let Operand::Value(value) = operand
                && self.last_use[value.0 as usize] <= self.place
                && let Some(index) = self.registers.remove(&value)
            {
                let ValueType { kind, uniform } = self.types[value.0 as usize];
                self.pools[number(kind)].free[usize::from(uniform)].push(index);
            }
        }
    }

    fn steps(&mut self, block: &Block) -> Vec<Step> {
        let mut steps = Vec::with_capacity(block.items.len());
        for item in &block.items {
            self.place += 1;
            match item {
                Item::Set(set) => {
                    let operands: Registers = set.operands.iter().map(|operand| self.register(*operand)).collect();
                    // Results never share a register with an operand: a loop reads one while it writes the other.
                    let values = results(set).map(|index| Value(index as u32));
                    let results: Registers = values.clone().map(|value| self.give(value)).collect();
                    self.free(set.operands.iter().copied().chain(values.map(Operand::Value)));
                    steps.push(Step::Set { code: set.code, operands, results });
                }
                Item::If { guard, block } => {
                    let register = self.register(*guard);
                    let inner = self.steps(block);
                    self.free([*guard].into_iter());
                    steps.push(Step::If { guard: register, steps: inner });
                }
                Item::Loop(round) => {
                    let starts: Vec<Register> =
                        round.carried.iter().map(|carried| self.register(carried.start)).collect();
                    let values: Vec<Register> = round.carried.iter().map(|carried| self.give(carried.value)).collect();
                    let inner = self.steps(&round.block);
                    self.place += 1;
                    let again = self.register(round.again);
                    let carried = round.carried.iter().zip(starts).zip(values).map(|((carried, start), value)| {
                        let kind = self.types[carried.value.0 as usize].kind;
                        CarriedRegisters { kind, value, start, next: self.register(carried.next) }
                    });
                    let carried = carried.collect();
                    let read = round
                        .carried
                        .iter()
                        .flat_map(|carried| [carried.start, carried.next, Operand::Value(carried.value)]);
                    self.free(read.chain([round.again]));
                    // Values from outside that the block reads last in its own midst were kept until here.
                    let mut inside = Vec::new();
                    operands_of(&round.block, &mut inside);
                    self.free(inside.into_iter());
                    steps.push(Step::Loop(Box::new(LoopSteps { carried, steps: inner, again, cost: round.cost })));
                }
                Item::Fail(mask) => {
                    let register = self.register(*mask);
                    self.free([*mask].into_iter());
                    steps.push(Step::Fail(register));
                }
            }
        }
        steps
    }
}

fn operands_of(block: &Block, operands: &mut Vec<Operand>) {
    for item in &block.items {
        match item {
            Item::Set(set) => operands.extend_from_slice(&set.operands),
            Item::If { guard, block } => {
                operands.push(*guard);
                operands_of(block, operands);
            }
            Item::Loop(round) => {
                operands.extend(round.carried.iter().flat_map(|carried| [carried.start, carried.next]));
                operands.push(round.again);
                operands_of(&round.block, operands);
            }
            Item::Fail(mask) => operands.push(*mask),
        }
    }
}

fn bank<T>(pool: Pool, value: impl Fn(Operand) -> Option<T>) -> BankSize<T> {
    let mut constants: Vec<(u16, T)> =
        pool.constants.into_iter().filter_map(|(operand, index)| Some((index, value(operand)?))).collect();
    constants.sort_by_key(|(index, _)| *index);
    BankSize { registers: usize::from(pool.made), constants }
}

impl Runnable {
    /// The inputs that the program reads.
    pub fn inputs(&self) -> InputSet {
        let mut inputs = InputSet::empty();
        each_code(&self.steps, &mut |code| inputs |= input(code));
        inputs
    }

    /// What is read on `pair`.
    pub fn pair_inputs(&self) -> PairSet {
        let mut inputs = PairSet::empty();
        each_code(&self.steps, &mut |code| {
            if let Code::Input(Column::Pair { input, .. }, _) = code {
                inputs |= input;
            }
        });
        inputs
    }

    /// Whether any hit may fail.
    pub fn may_fail(&self) -> bool {
        any_fails(&self.steps)
    }
}

/// Whether hits may fail. Loops may run out of fuel. What can fail but is only asked where its mask is never true is
/// counted, too.
fn any_fails(steps: &[Step]) -> bool {
    steps.iter().any(|step| match step {
        Step::Set { code, .. } => {
            matches!(code, Code::Checked(_) | Code::IntFromFloat | Code::Native { can_fail: true, .. })
        }
        Step::If { steps, .. } => any_fails(steps),
        Step::Loop(_) | Step::Fail(_) => true,
    })
}

fn each_code(steps: &[Step], see: &mut impl FnMut(Code)) {
    for step in steps {
        match step {
            Step::Set { code, .. } => see(*code),
            Step::If { steps, .. } => each_code(steps, see),
            Step::Loop(round) => each_code(&round.steps, see),
            Step::Fail(_) => {}
        }
    }
}

/// The input that an instruction reads.
fn input(code: Code) -> InputSet {
    match code {
        Code::Light => InputSet::LIGHT,
        Code::Irradiance => InputSet::IRRADIANCE,
        Code::Input(column, _) => match column {
            Column::Position => InputSet::POSITION,
            Column::Normal => InputSet::NORMAL,
            Column::GeometricNormal => InputSet::GEOMETRIC_NORMAL,
            Column::Incoming => InputSet::INCOMING,
            Column::Uv(0) => InputSet::UV,
            Column::Uv(_) => InputSet::MORE_UVS,
            Column::Tangent => InputSet::TANGENT,
            Column::Color => InputSet::COLOR,
            Column::ObjectId => InputSet::OBJECT_ID,
            Column::PolygonId => InputSet::POLYGON_ID,
            Column::Barycentric => InputSet::BARYCENTRIC,
            Column::Distance => InputSet::DISTANCE,
            Column::Depth => InputSet::DEPTH,
            Column::PathKind => InputSet::PATH_KIND,
            Column::FrontFacing => InputSet::FRONT_FACING,
            Column::Time => InputSet::TIME,
            Column::PixelsPerUnit => InputSet::PIXELS_PER_UNIT,
            Column::Curvature => InputSet::CURVATURE,
            Column::Footprint => InputSet::FOOTPRINT,
            Column::UvFootprint => InputSet::UV_FOOTPRINT,
            Column::AttributeSet => InputSet::ATTRIBUTE,
            Column::LightCount => InputSet::LIGHT_COUNT,
            Column::Pair { .. } => InputSet::empty(),
        },
        _ => InputSet::empty(),
    }
}
