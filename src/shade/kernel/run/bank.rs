//! Columns of registers.

use super::super::slice::Register;

/// Rows of a block: what the widest vectors hold.
pub(in crate::shade::kernel) const LANES: usize = 16;
/// Blocks of a chunk. 256 rows keep the registers of a shader of 60 operations within 64 KiB.
pub(in crate::shade::kernel) const BLOCKS: usize = 16;
/// Rows of a chunk.
pub(in crate::shade::kernel) const CHUNK: usize = LANES * BLOCKS;

/// Rows of a column.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(in crate::shade::kernel) struct Block<T>(pub [T; LANES]);

/// Registers of one kind.
#[derive(Debug)]
pub(in crate::shade::kernel) struct Bank<T> {
    pub(in crate::shade::kernel) columns: Vec<Vec<Block<T>>>,
}

impl<T> Default for Bank<T> {
    fn default() -> Self {
        Self { columns: Vec::new() }
    }
}

impl<T: Copy> Bank<T> {
    /// Makes room for so many registers.
    pub(in crate::shade::kernel) fn prepare(&mut self, registers: usize, zero: T) {
        while self.columns.len() < registers {
            self.columns.push(vec![Block([zero; LANES]); BLOCKS]);
        }
    }

    pub(in crate::shade::kernel) fn set(&mut self, register: u16, value: T) {
        self.columns[usize::from(register)][0] = Block([value; LANES]);
    }

    #[inline(always)]
    pub(in crate::shade::kernel) fn view(&self, register: Register) -> View<'_, T> {
        View { blocks: &self.columns[usize::from(register.index)], uniform: register.uniform }
    }

    /// Takes a register out, to be written while others are read.
    #[inline(always)]
    pub(in crate::shade::kernel) fn take(&mut self, register: Register) -> Vec<Block<T>> {
        std::mem::take(&mut self.columns[usize::from(register.index)])
    }

    #[inline(always)]
    pub(in crate::shade::kernel) fn put(&mut self, register: Register, column: Vec<Block<T>>) {
        self.columns[usize::from(register.index)] = column;
    }
}

/// A register as it is read.
#[derive(Clone, Copy)]
pub(in crate::shade::kernel) struct View<'a, T> {
    pub(in crate::shade::kernel) blocks: &'a [Block<T>],
    pub(in crate::shade::kernel) uniform: bool,
}

impl<'a, T: Copy> View<'a, T> {
    #[inline(always)]
    pub(in crate::shade::kernel) fn block(&self, index: usize) -> &'a [T; LANES] {
        &self.blocks[if self.uniform { 0 } else { index }].0
    }

    /// The rows of a block.
    #[inline(always)]
    pub(in crate::shade::kernel) fn lanes(&self, index: usize) -> &'a [T; LANES] {
        self.block(index)
    }

    /// The one value of all rows, if it is uniform.
    #[inline(always)]
    pub(in crate::shade::kernel) fn uniform(&self) -> Option<T> {
        self.uniform.then(|| self.blocks[0].0[0])
    }

    /// The value of a row.
    #[inline(always)]
    pub(in crate::shade::kernel) fn row(&self, row: usize) -> T {
        self.block(row / LANES)[row % LANES]
    }
}

/// A truth value as a mask of bits.
#[inline(always)]
pub(in crate::shade::kernel) fn mask(x: bool) -> u32 {
    if x { u32::MAX } else { 0 }
}

/// A register put aside.
pub(in crate::shade::kernel) enum Kept {
    Floats(Vec<Block<f32>>, bool),
    Ints(Vec<Block<i64>>, bool),
    Bools(Vec<Block<u32>>, bool),
}

pub(in crate::shade::kernel) fn copy<T: Copy>(bank: &mut Bank<T>, from: Register, to: Register, blocks: usize) {
    let source = bank.take(from);
    fill(bank, View { blocks: &source, uniform: from.uniform }, to, blocks);
    bank.put(from, source);
}

pub(in crate::shade::kernel) fn fill<T: Copy>(bank: &mut Bank<T>, from: View<'_, T>, to: Register, blocks: usize) {
    let blocks = if to.uniform { 1 } else { blocks };
    for (index, block) in bank.columns[usize::from(to.index)][..blocks].iter_mut().enumerate() {
        block.0 = *from.block(index);
    }
}
