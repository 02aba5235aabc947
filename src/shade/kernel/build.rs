//! Building a program: instructions are folded and shared as they are written.

use std::collections::HashMap;

use super::ir::{Block, BoolBinary, Carried, Code, Instruction, Item, Kind, Loop, Operand, Operands, Value, ValueType};

/// Values that a program may have: bounds compile time and memory.
const MAX_VALUES: usize = 60_000;

/// A program in the making.
#[derive(Debug)]
pub(super) struct Builder {
    pub types: Vec<ValueType>,
    /// Whether some value may be of more types than is reasonable.
    pub too_many_types: bool,
    open: Vec<OpenBlock>,
}

#[derive(Debug, Default)]
struct OpenBlock {
    block: Block,
    /// What has been computed in this block.
    known: HashMap<(Code, Operands), Value>,
}

impl Builder {
    pub fn new() -> Self {
        Self { types: Vec::new(), too_many_types: false, open: vec![OpenBlock::default()] }
    }

    /// Whether the program has grown beyond all measure.
    pub fn is_full(&self) -> bool {
        self.types.len() > MAX_VALUES
    }

    /// The whole program, once all blocks are closed but the outermost.
    pub fn finish(mut self) -> (Block, Vec<ValueType>) {
        (self.open.pop().map(|open| open.block).unwrap_or_default(), self.types)
    }

    /// Opens a block inside the current one.
    pub fn open(&mut self) {
        self.open.push(OpenBlock::default());
    }

    /// Closes the current block; the caller puts it where it belongs.
    pub fn close(&mut self) -> Block {
        self.open.pop().map(|open| open.block).unwrap_or_default()
    }

    /// Adds a part to the current block.
    pub fn push(&mut self, item: Item) {
        if let Some(open) = self.open.last_mut() {
            open.block.items.push(item);
        }
    }

    /// Where to [go back](Self::go_back) to.
    pub fn mark(&self) -> usize {
        self.types.len()
    }

    /// Forgets the values made since a mark. The blocks that hold their instructions must have been closed and dropped.
    pub fn go_back(&mut self, mark: usize) {
        self.types.truncate(mark);
    }

    /// A value that a loop carries.
    pub fn carried(&mut self, kind: Kind, uniform: bool) -> Value {
        self.new_value(ValueType { kind, uniform })
    }

    fn new_value(&mut self, of: ValueType) -> Value {
        let value = Value(self.types.len() as u32);
        self.types.push(of);
        value
    }

    /// Whether an operand has one value for all hits.
    pub fn is_uniform(&self, operand: Operand) -> bool {
        match operand {
            Operand::Value(value) => self.types[value.0 as usize].uniform,
            _ => true,
        }
    }

    pub fn kind(&self, operand: Operand) -> Kind {
        match operand {
            Operand::Value(value) => self.types[value.0 as usize].kind,
            Operand::Float(_) => Kind::Float,
            Operand::Int(_) => Kind::Int,
            Operand::Bool(_) => Kind::Bool,
        }
    }

    /// An instruction with one result: the constant that it folds to, an earlier value that is the same, or a new one.
    pub fn emit(&mut self, code: Code, operands: &[Operand]) -> Operand {
        if let Some(folded) = self.fold(code, operands) {
            return folded;
        }
        let kind = match code {
            Code::Input(column, _) => column.kind(),
            Code::CompareFloats(_) | Code::CompareInts(_) | Code::IsNan | Code::Bool2(_) | Code::Not => Kind::Bool,
            Code::Int2(_) | Code::IntSign | Code::Checked(_) | Code::IntFromFloat => Kind::Int,
            Code::Select(kind) => kind,
            _ => Kind::Float,
        };
        Operand::Value(self.set(code, operands, &[kind]))
    }

    /// An instruction with several results of these kinds; gives the first, the others follow it.
    pub fn emit_many(&mut self, code: Code, operands: &[Operand], kinds: &[Kind]) -> Value {
        self.set(code, operands, kinds)
    }

    fn set(&mut self, code: Code, operands: &[Operand], kinds: &[Kind]) -> Value {
        let operands = Operands::from_slice(operands);
        let key = (code, operands.clone());
        if let Some(known) = self.open.iter().rev().find_map(|open| open.known.get(&key)) {
            return *known;
        }
        let varies = match code {
            Code::Input(column, _) => !column.is_uniform(),
            Code::Light | Code::Irradiance => true,
            _ => false,
        };
        let uniform = !varies && operands.iter().all(|operand| self.is_uniform(*operand));
        let first = Value(self.types.len() as u32);
        for kind in kinds {
            self.new_value(ValueType { kind: *kind, uniform });
        }
        self.push(Item::Set(Instruction { code, operands, first, count: kinds.len() as u8 }));
        if let Some(open) = self.open.last_mut() {
            open.known.insert(key, first);
        }
        first
    }

    /// The result, if it is known now. Faults are never folded away: such operands are left to run.
    fn fold(&self, code: Code, operands: &[Operand]) -> Option<Operand> {
        use Operand::{Bool, Int};
        let float = |i: usize| operands[i].as_float();
        let int = |i: usize| operands[i].as_int();
        match code {
            Code::Float1(op) => Some(Operand::float(op.apply(float(0)?))),
            Code::Float2(op) => Some(Operand::float(op.apply(float(0)?, float(1)?))),
            Code::Float3(op) => Some(Operand::float(op.apply(float(0)?, float(1)?, float(2)?))),
            Code::CompareFloats(op) => Some(Bool(op.floats(float(0)?, float(1)?))),
            Code::IsNan => Some(Bool(float(0)?.is_nan())),
            Code::Int2(op) => Some(Int(op.apply(int(0)?, int(1)?))),
            Code::IntSign => Some(Int(int(0)?.signum())),
            Code::Checked(op) => op.apply(int(0)?, int(1)?).map(Int),
            Code::CompareInts(op) => Some(Bool(op.ints(int(0)?, int(1)?))),
            Code::Bool2(op) => self.fold_bool(op, operands[0], operands[1]),
            Code::Not => Some(Bool(!operands[0].as_bool()?)),
            Code::Select(_) => match operands[0] {
                Bool(true) => Some(operands[1]),
                Bool(false) => Some(operands[2]),
                _ if operands[1] == operands[2] => Some(operands[1]),
                mask if operands[1] == Operand::TRUE && operands[2] == Operand::FALSE => Some(mask),
                _ => None,
            },
            #[expect(clippy::cast_precision_loss, reason = "an int counts as the nearest float")]
            Code::FloatFromInt => Some(Operand::float(int(0)? as f32)),
            Code::IntFromFloat => crate::shade::library::math::to_int(float(0)?).map(Int),
            _ => None,
        }
    }

    fn fold_bool(&self, op: BoolBinary, a: Operand, b: Operand) -> Option<Operand> {
        if let (Some(a), Some(b)) = (a.as_bool(), b.as_bool()) {
            return Some(Operand::Bool(op.apply(a, b)));
        }
        let (any, both) = (|x| a == x || b == x, a == b);
        let other = |x| if a == x { b } else { a };
        match op {
            BoolBinary::And if any(Operand::FALSE) => Some(Operand::FALSE),
            BoolBinary::And if any(Operand::TRUE) => Some(other(Operand::TRUE)),
            BoolBinary::Or if any(Operand::TRUE) => Some(Operand::TRUE),
            BoolBinary::Or | BoolBinary::Xor if any(Operand::FALSE) => Some(other(Operand::FALSE)),
            BoolBinary::And | BoolBinary::Or if both => Some(a),
            BoolBinary::Xor if both => Some(Operand::FALSE),
            BoolBinary::AndNot if both || a == Operand::FALSE || b == Operand::TRUE => Some(Operand::FALSE),
            BoolBinary::AndNot if b == Operand::FALSE => Some(a),
            _ => None,
        }
    }

    // Shorthands.

    pub fn and(&mut self, a: Operand, b: Operand) -> Operand {
        self.emit(Code::Bool2(BoolBinary::And), &[a, b])
    }

    pub fn or(&mut self, a: Operand, b: Operand) -> Operand {
        self.emit(Code::Bool2(BoolBinary::Or), &[a, b])
    }

    pub fn and_not(&mut self, a: Operand, b: Operand) -> Operand {
        if a == Operand::TRUE {
            return self.not(b);
        }
        self.emit(Code::Bool2(BoolBinary::AndNot), &[a, b])
    }

    pub fn not(&mut self, a: Operand) -> Operand {
        self.emit(Code::Not, &[a])
    }

    /// `a` where the mask is true, else `b`; both of one kind.
    pub fn select(&mut self, mask: Operand, a: Operand, b: Operand) -> Operand {
        let kind = self.kind(a);
        self.emit(Code::Select(kind), &[mask, a, b])
    }

    /// Adds a loop.
    pub fn push_loop(&mut self, carried: Vec<Carried>, block: Block, again: Operand, cost: u64) {
        self.push(Item::Loop(Box::new(Loop { carried, block, again, cost })));
    }
}
