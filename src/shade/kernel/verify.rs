//! Checks the invariants of a program (see [`ir`](super::ir)). Run in debug builds and by tests on every kernel.

use super::ir::{Block, Code, Instruction, Item, Kind, Operand, ValueType};
use super::lower::Lowered;

/// Whether a program is well formed.
///
/// # Errors
/// What is wrong, for the engineers of Tusche.
pub(super) fn verify(lowered: &Lowered) -> Result<(), String> {
    let mut set = vec![false; lowered.types.len()];
    block(&lowered.block, &lowered.types, &mut set)?;
    for output in &lowered.outputs {
        for operand in output.channels.iter().chain([&output.present]) {
            read(*operand, &set)?;
        }
    }
    Ok(())
}

fn read(operand: Operand, set: &[bool]) -> Result<(), String> {
    match operand {
        Operand::Value(value) if !set.get(value.0 as usize).copied().unwrap_or(false) => {
            Err(format!("{value} is read before it is set"))
        }
        _ => Ok(()),
    }
}

fn kind(operand: Operand, types: &[ValueType]) -> Kind {
    match operand {
        Operand::Value(value) => types[value.0 as usize].kind,
        Operand::Float(_) => Kind::Float,
        Operand::Int(_) => Kind::Int,
        Operand::Bool(_) => Kind::Bool,
    }
}

fn is_uniform(operand: Operand, types: &[ValueType]) -> bool {
    match operand {
        Operand::Value(value) => types[value.0 as usize].uniform,
        _ => true,
    }
}

fn block(block_of: &Block, types: &[ValueType], set: &mut [bool]) -> Result<(), String> {
    for item in &block_of.items {
        match item {
            Item::Set(instruction) => {
                for operand in &instruction.operands {
                    read(*operand, set)?;
                }
                check(instruction, types)?;
                for index in 0..u32::from(instruction.count) {
                    let value = (instruction.first.0 + index) as usize;
                    if std::mem::replace(&mut set[value], true) {
                        return Err(format!("v{value} is set twice"));
                    }
                }
            }
            Item::If { guard, block: inner } => {
                read(*guard, set)?;
                block(inner, types, set)?;
            }
            Item::Loop(round) => {
                for carried in &round.carried {
                    read(carried.start, set)?;
                    set[carried.value.0 as usize] = true;
                }
                block(&round.block, types, set)?;
                read(round.again, set)?;
                for carried in &round.carried {
                    read(carried.next, set)?;
                    let ValueType { kind: of, uniform } = types[carried.value.0 as usize];
                    for side in [carried.start, carried.next] {
                        if kind(side, types) != of || (uniform && !is_uniform(side, types)) {
                            return Err(format!("{} cannot carry {side}", carried.value));
                        }
                    }
                }
            }
            Item::Fail(mask) => read(*mask, set)?,
        }
    }
    Ok(())
}

fn check(instruction: &Instruction, types: &[ValueType]) -> Result<(), String> {
    use Kind::{Bool, Float, Int};
    let wanted: &[Kind] = match instruction.code {
        Code::Input(..) | Code::Irradiance => &[],
        Code::Light(_) | Code::IntSign | Code::FloatFromInt | Code::HashInt(_) => &[Int],
        Code::Float1(_) | Code::IsNan => &[Float],
        Code::Float2(_) | Code::CompareFloats(_) => &[Float, Float],
        Code::Texture(_) => &[Float, Float, Float][..instruction.operands.len().clamp(2, 3)],
        Code::Library(_) => &[Float; 8][..instruction.operands.len().min(8)],
        Code::Float3(_) => &[Float, Float, Float],
        Code::Int2(_) | Code::CompareInts(_) => &[Int, Int],
        Code::Checked(_) => &[Int, Int, Bool],
        Code::Bool2(_) => &[Bool, Bool],
        Code::Not => &[Bool],
        Code::Select(Float) => &[Bool, Float, Float],
        Code::Select(Int) => &[Bool, Int, Int],
        Code::Select(Bool) => &[Bool, Bool, Bool],
        Code::IntFromFloat => &[Float, Bool],
        Code::HashFloats(_) => &[Float, Float, Float, Float][..instruction.operands.len().min(4)],
        Code::Noise(_) => &[Float, Float, Float][..instruction.operands.len().clamp(2, 3)],
        Code::Native { .. } => return Ok(()),
    };
    let found: Vec<Kind> = instruction.operands.iter().map(|operand| kind(*operand, types)).collect();
    if found != wanted {
        return Err(format!("{:?} takes {wanted:?}, not {found:?}", instruction.code));
    }
    if types[instruction.first.0 as usize].uniform
        && instruction.operands.iter().any(|operand| !is_uniform(*operand, types))
    {
        return Err(format!("{} is not uniform", instruction.first));
    }
    Ok(())
}
