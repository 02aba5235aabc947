//! Functions that plug-ins have added.

use smallvec::SmallVec;

use super::super::slice::Register;
use super::bank::{Block, LANES, mask};
use super::{Chunk, Registers};
use crate::math::{Vec2, Vec3, Vec4};
use crate::shade::native::{NativeFunction, NativeType, NativeValue};

impl Registers {
    /// Calls a plug-in's function: its batch form, or else its scalar form at each hit in the mask.
    pub(super) fn native(
        &mut self,
        native: &NativeFunction,
        operands: &[Register],
        results: &[Register],
        blocks: usize,
        chunk: &Chunk<'_>,
    ) {
        let Some((live, operands)) = operands.split_last() else { return };
        if let Some(batch) = native.batch() {
            let columns: Vec<Vec<f32>> = operands
                .iter()
                .map(|operand| (0..blocks * LANES).map(|row| self.floats.view(*operand).row(row)).collect())
                .collect();
            let columns: Vec<&[f32]> = columns.iter().map(Vec::as_slice).collect();
            let mut given = vec![vec![0.0; blocks * LANES]; results.len()];
            batch(&columns, &mut given.iter_mut().map(Vec::as_mut_slice).collect::<Vec<_>>());
            for (register, given) in results.iter().zip(given) {
                let column = &mut self.floats.columns[usize::from(register.index)];
                for (row, x) in given.into_iter().enumerate() {
                    column[row / LANES].0[row % LANES] = x;
                }
            }
            return;
        }
        let uniform = results[0].uniform;
        let rows = if uniform { 1 } else { blocks * LANES };
        for row in 0..rows {
            let is_live = if uniform { self.any(*live, chunk.blocks()) } else { self.bools.view(*live).row(row) != 0 };
            if !is_live {
                continue;
            }
            let mut rest = operands;
            let arguments: SmallVec<[NativeValue; 6]> =
                native.parameters().iter().map(|wanted| self.argument(*wanted, &mut rest, row)).collect();
            match native.call(&arguments) {
                Ok(value) => self.put_native(value, results, row),
                Err(_) if uniform => self.fail(*live, chunk.blocks()),
                Err(_) => self.failed[row / LANES].0[row % LANES] = u32::MAX,
            }
        }
    }

    /// An argument of a type, from the first of the operands, which it takes away.
    fn argument(&self, wanted: NativeType, operands: &mut &[Register], row: usize) -> NativeValue {
        let count = wanted.columns().unwrap_or(1).min(operands.len());
        let (own, rest) = operands.split_at(count);
        *operands = rest;
        let float = |i: usize| own.get(i).map_or(0.0, |operand| self.floats.view(*operand).row(row));
        match wanted {
            NativeType::Float => NativeValue::Float(float(0)),
            NativeType::Vec2 => NativeValue::Vec2(Vec2::new(float(0), float(1))),
            NativeType::Vec3 => NativeValue::Vec3(Vec3::new(float(0), float(1), float(2))),
            NativeType::Vec4 => NativeValue::Vec4(Vec4::new(float(0), float(1), float(2), float(3))),
            NativeType::Int => NativeValue::Int(own.first().map_or(0, |operand| self.ints.view(*operand).row(row))),
            NativeType::Bool => {
                NativeValue::Bool(own.first().is_some_and(|operand| self.bools.view(*operand).row(row) != 0))
            }
        }
    }

    fn put_native(&mut self, value: NativeValue, results: &[Register], row: usize) {
        let (block, lane) = (row / LANES, row % LANES);
        let mut put = |channels: &[f32]| {
            for (register, x) in results.iter().zip(channels) {
                let column = &mut self.floats.columns[usize::from(register.index)];
                if register.uniform {
                    column[0] = Block([*x; LANES]);
                } else {
                    column[block].0[lane] = *x;
                }
            }
        };
        match value {
            NativeValue::Float(x) => put(&[x]),
            NativeValue::Vec2(v) => put(&v.to_array()),
            NativeValue::Vec3(v) => put(&v.to_array()),
            NativeValue::Vec4(v) => put(&v.to_array()),
            NativeValue::Int(x) if results[0].uniform => self.ints.set(results[0].index, x),
            NativeValue::Int(x) => self.ints.columns[usize::from(results[0].index)][block].0[lane] = x,
            NativeValue::Bool(x) if results[0].uniform => self.bools.set(results[0].index, mask(x)),
            NativeValue::Bool(x) => self.bools.columns[usize::from(results[0].index)][block].0[lane] = mask(x),
        }
    }
}
