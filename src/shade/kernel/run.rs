//! Running a slice over a batch: one tight loop per instruction, over a chunk of hits at a time.
//!
//! A register is a column of blocks of [`LANES`] rows; a uniform one uses its first block only, all of whose lanes are
//! equal, so that operands of both sorts are read alike. A chunk's last rows are repeated to fill its last block: these
//! lanes do what a real hit does, and nobody looks at them.
//!
//! All of it is compiled for the widest vectors that the machine has (`pulp` chooses when the program runs). The
//! instructions are the same on all machines, one IEEE operation each, and so are the bits.

use smallvec::SmallVec;

use super::ir::{
    BoolBinary, Code, Column, FloatBinaryLoop, FloatTernaryLoop, FloatUnary, FloatUnaryLoop, IntBinaryLoop,
    IntCheckedLoop, Kind, LibraryFunction, LibraryLoop, MOST_ARGUMENTS, Noise,
};
use super::lower::TextureUse;
use super::slice::{CarriedRegisters, LoopSteps, Register, Runnable, Step};
use crate::math::{Vec2, Vec3, Vec4};
use crate::shade::batch::{HitBatch, LightSample};
use crate::shade::library::batch::{noise as batch, numeric, transcendental};
use crate::shade::library::{hash, hit, math};
use crate::shade::names::PathKind;
use crate::shade::native::{NativeFunction, NativeType, NativeValue};

/// Rows of a block: what the widest vectors hold.
pub(super) const LANES: usize = 16;
/// Blocks of a chunk. 256 rows keep the registers of a shader of 60 operations within 64 KiB.
const BLOCKS: usize = 16;
/// Rows of a chunk.
pub(super) const CHUNK: usize = LANES * BLOCKS;

/// Rows of a column.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Block<T>(pub [T; LANES]);

/// Registers of one kind.
#[derive(Debug)]
struct Bank<T> {
    columns: Vec<Vec<Block<T>>>,
}

impl<T> Default for Bank<T> {
    fn default() -> Self {
        Self { columns: Vec::new() }
    }
}

impl<T: Copy> Bank<T> {
    /// Makes room for so many registers.
    fn prepare(&mut self, registers: usize, zero: T) {
        while self.columns.len() < registers {
            self.columns.push(vec![Block([zero; LANES]); BLOCKS]);
        }
    }

    fn set(&mut self, register: u16, value: T) {
        self.columns[usize::from(register)][0] = Block([value; LANES]);
    }

    #[inline(always)]
    fn view(&self, register: Register) -> View<'_, T> {
        View { blocks: &self.columns[usize::from(register.index)], uniform: register.uniform }
    }

    /// Takes a register out, to be written while others are read.
    #[inline(always)]
    fn take(&mut self, register: Register) -> Vec<Block<T>> {
        std::mem::take(&mut self.columns[usize::from(register.index)])
    }

    #[inline(always)]
    fn put(&mut self, register: Register, column: Vec<Block<T>>) {
        self.columns[usize::from(register.index)] = column;
    }
}

/// A register as it is read.
#[derive(Clone, Copy)]
pub(super) struct View<'a, T> {
    blocks: &'a [Block<T>],
    uniform: bool,
}

impl<'a, T: Copy> View<'a, T> {
    #[inline(always)]
    fn block(&self, index: usize) -> &'a [T; LANES] {
        &self.blocks[if self.uniform { 0 } else { index }].0
    }

    /// The rows of a block.
    #[inline(always)]
    pub fn lanes(&self, index: usize) -> &'a [T; LANES] {
        self.block(index)
    }

    /// The one value of all rows, if it is uniform.
    #[inline(always)]
    pub fn uniform(&self) -> Option<T> {
        self.uniform.then(|| self.blocks[0].0[0])
    }

    /// The value of a row.
    #[inline(always)]
    pub fn row(&self, row: usize) -> T {
        self.block(row / LANES)[row % LANES]
    }
}

/// A thread's registers. They serve all kernels, one after the other.
#[derive(Debug)]
pub(in crate::shade) struct Registers {
    floats: Bank<f32>,
    ints: Bank<i64>,
    bools: Bank<u32>,
    /// Hits that the interpreter must look at.
    failed: Vec<Block<u32>>,
    /// What loops may still cost.
    fuel: u64,
    /// The widest vectors of this machine.
    arch: pulp::Arch,
}

impl Default for Registers {
    fn default() -> Self {
        Self {
            floats: Bank::default(),
            ints: Bank::default(),
            bools: Bank::default(),
            failed: vec![Block([0; LANES]); BLOCKS],
            fuel: 0,
            arch: pulp::Arch::new(),
        }
    }
}

/// A truth value as a mask of bits.
#[inline(always)]
fn mask(x: bool) -> u32 {
    if x { u32::MAX } else { 0 }
}

/// A chunk of a batch: its hits and its tables.
#[derive(Clone, Copy)]
pub(super) struct Chunk<'a> {
    pub hits: &'a HitBatch,
    pub textures: &'a [TextureUse],
    pub natives: &'a [NativeFunction],
    /// First row, and number of rows, at most [`CHUNK`].
    pub first: usize,
    pub rows: usize,
}

impl Chunk<'_> {
    #[inline(always)]
    fn blocks(&self) -> usize {
        self.rows.div_ceil(LANES)
    }
}

impl Registers {
    /// Makes room for a program, and sets its constants.
    pub(super) fn prepare(&mut self, program: &Runnable) {
        self.floats.prepare(program.floats.registers, 0.0);
        self.ints.prepare(program.ints.registers, 0);
        self.bools.prepare(program.bools.registers, 0);
        program.floats.constants.iter().for_each(|(register, x)| self.floats.set(*register, *x));
        program.ints.constants.iter().for_each(|(register, x)| self.ints.set(*register, *x));
        program.bools.constants.iter().for_each(|(register, x)| self.bools.set(*register, mask(*x)));
    }

    /// Runs a program over a chunk of hits.
    pub(super) fn run(&mut self, program: &Runnable, fuel: u64, chunk: &Chunk<'_>) {
        self.failed.fill(Block([0; LANES]));
        self.fuel = fuel;
        self.steps(&program.steps, chunk);
    }

    /// Whether the hit in a row of the last chunk must be given to the interpreter.
    pub fn has_failed(&self, row: usize) -> bool {
        self.failed[row / LANES].0[row % LANES] != 0
    }

    /// Whether any row of the last chunk has failed.
    pub fn any_failed(&self) -> bool {
        self.failed.iter().any(|block| block.0.iter().any(|lane| *lane != 0))
    }

    #[inline(always)]
    pub(super) fn float(&self, register: Register) -> View<'_, f32> {
        self.floats.view(register)
    }

    #[inline(always)]
    pub(super) fn int(&self, register: Register) -> View<'_, i64> {
        self.ints.view(register)
    }

    #[inline(always)]
    pub(super) fn bool(&self, register: Register) -> View<'_, u32> {
        self.bools.view(register)
    }

    fn any(&self, register: Register, blocks: usize) -> bool {
        let view = self.bools.view(register);
        let blocks = if register.uniform { 1 } else { blocks };
        (0..blocks).any(|index| view.block(index).iter().fold(0, |any, lane| any | lane) != 0)
    }

    fn fail(&mut self, register: Register, blocks: usize) {
        let view = self.bools.view(register);
        for (index, failed) in self.failed[..blocks].iter_mut().enumerate() {
            for (failed, lane) in failed.0.iter_mut().zip(view.block(index)) {
                *failed |= lane;
            }
        }
    }

    fn steps(&mut self, steps: &[Step], chunk: &Chunk<'_>) {
        for step in steps {
            match step {
                Step::Set { code, operands, results } => {
                    let blocks = if results[0].uniform { 1 } else { chunk.blocks() };
                    let arch = self.arch;
                    arch.dispatch(Instruction { registers: self, code: *code, operands, results, blocks, chunk });
                }
                Step::If { guard, steps } => {
                    if self.any(*guard, chunk.blocks()) {
                        self.steps(steps, chunk);
                    }
                }
                Step::Loop(round) => self.repeat(round, chunk),
                Step::Fail(mask) => self.fail(*mask, chunk.blocks()),
            }
        }
    }

    fn repeat(&mut self, round: &LoopSteps, chunk: &Chunk<'_>) {
        for carried in &round.carried {
            self.copy(carried.kind, carried.start, carried.value, chunk.blocks());
        }
        // Some values may be swapped: those are put aside first.
        let swapped = |carried: &&CarriedRegisters| {
            round.carried.iter().any(|other| {
                other.kind == carried.kind && other.value.index == carried.next.index && other.value != carried.value
            })
        };
        let swapped: Vec<&CarriedRegisters> = round.carried.iter().filter(swapped).collect();
        loop {
            self.steps(&round.steps, chunk);
            let kept: Vec<Kept> = swapped.iter().map(|carried| self.keep(carried.kind, carried.next)).collect();
            let again = self.any(round.again, chunk.blocks());
            if again && self.fuel < round.cost {
                // Out of fuel: the interpreter will say what it thinks of those that are still at it.
                self.fail(round.again, chunk.blocks());
            }
            for carried in &round.carried {
                if !swapped.iter().any(|other| std::ptr::eq(*other, carried)) {
                    self.copy(carried.kind, carried.next, carried.value, chunk.blocks());
                }
            }
            for (carried, kept) in swapped.iter().zip(kept) {
                self.restore(kept, carried.value, chunk.blocks());
            }
            if !again || self.fuel < round.cost {
                break;
            }
            self.fuel -= round.cost;
        }
    }

    /// Copies a register into another of its kind.
    fn copy(&mut self, kind: Kind, from: Register, to: Register, blocks: usize) {
        if from == to {
            return;
        }
        match kind {
            Kind::Float => copy(&mut self.floats, from, to, blocks),
            Kind::Int => copy(&mut self.ints, from, to, blocks),
            Kind::Bool => copy(&mut self.bools, from, to, blocks),
        }
    }

    fn keep(&self, kind: Kind, register: Register) -> Kept {
        let index = usize::from(register.index);
        match kind {
            Kind::Float => Kept::Floats(self.floats.columns[index].clone(), register.uniform),
            Kind::Int => Kept::Ints(self.ints.columns[index].clone(), register.uniform),
            Kind::Bool => Kept::Bools(self.bools.columns[index].clone(), register.uniform),
        }
    }

    fn restore(&mut self, kept: Kept, to: Register, blocks: usize) {
        match kept {
            Kept::Floats(blocks_of, uniform) => {
                fill(&mut self.floats, View { blocks: &blocks_of, uniform }, to, blocks);
            }
            Kept::Ints(blocks_of, uniform) => fill(&mut self.ints, View { blocks: &blocks_of, uniform }, to, blocks),
            Kept::Bools(blocks_of, uniform) => fill(&mut self.bools, View { blocks: &blocks_of, uniform }, to, blocks),
        }
    }

    /// Runs one instruction over a chunk.
    #[inline(always)]
    fn set(&mut self, code: Code, operands: &[Register], results: &[Register], blocks: usize, chunk: &Chunk<'_>) {
        match code {
            Code::Float1(op) => {
                let mut out = self.floats.take(results[0]);
                let (blocks, a) = (&mut out[..blocks], self.floats.view(operands[0]));
                match op {
                    // These leave the loop for huge angles, so they come as whole blocks.
                    FloatUnary::Sin => whole_blocks(blocks, a, transcendental::sin),
                    FloatUnary::Cos => whole_blocks(blocks, a, transcendental::cos),
                    FloatUnary::Tan => whole_blocks(blocks, a, transcendental::tan),
                    _ => op.in_loop(Unary { out: blocks, a }),
                }
                self.floats.put(results[0], out);
            }
            Code::Float2(op) => {
                let mut out = self.floats.take(results[0]);
                let (a, b) = (self.floats.view(operands[0]), self.floats.view(operands[1]));
                op.in_loop(Binary { out: &mut out[..blocks], a, b });
                self.floats.put(results[0], out);
            }
            Code::Float3(op) => {
                let mut out = self.floats.take(results[0]);
                let [a, b, c] = [0, 1, 2].map(|i| self.floats.view(operands[i]));
                op.in_loop(Ternary { out: &mut out[..blocks], a, b, c });
                self.floats.put(results[0], out);
            }
            Code::CompareFloats(op) => {
                let mut out = self.bools.take(results[0]);
                let (a, b) = (self.floats.view(operands[0]), self.floats.view(operands[1]));
                compare(&mut out[..blocks], a, b, op, |op, a, b| op.floats(a, b));
                self.bools.put(results[0], out);
            }
            Code::CompareInts(op) => {
                let mut out = self.bools.take(results[0]);
                let (a, b) = (self.ints.view(operands[0]), self.ints.view(operands[1]));
                compare(&mut out[..blocks], a, b, op, |op, a, b| op.ints(a, b));
                self.bools.put(results[0], out);
            }
            Code::IsNan => {
                let mut out = self.bools.take(results[0]);
                each(&mut out[..blocks], self.floats.view(operands[0]), |x| mask(x.is_nan()));
                self.bools.put(results[0], out);
            }
            Code::Int2(op) => {
                let mut out = self.ints.take(results[0]);
                let (a, b) = (self.ints.view(operands[0]), self.ints.view(operands[1]));
                op.in_loop(Binary { out: &mut out[..blocks], a, b });
                self.ints.put(results[0], out);
            }
            Code::IntSign => {
                let mut out = self.ints.take(results[0]);
                each(&mut out[..blocks], self.ints.view(operands[0]), i64::signum);
                self.ints.put(results[0], out);
            }
            Code::Checked(op) => {
                let mut out = self.ints.take(results[0]);
                let (a, b) = (self.ints.view(operands[0]), self.ints.view(operands[1]));
                let mask = self.bools.view(operands[2]);
                op.in_loop(Checked { out: &mut out[..blocks], a, b, mask, failed: &mut self.failed });
                if results[0].uniform {
                    let [a, b] = [operands[0], operands[1]].map(|operand| self.ints.view(operand).row(0));
                    self.fail_uniform(op.apply(a, b).is_none(), operands[2], chunk.blocks());
                }
                self.ints.put(results[0], out);
            }
            Code::IntFromFloat => {
                let mut out = self.ints.take(results[0]);
                let (a, live) = (self.floats.view(operands[0]), self.bools.view(operands[1]));
                for (index, out) in out[..blocks].iter_mut().enumerate() {
                    let (a, live) = (a.block(index), live.block(index));
                    for lane in 0..LANES {
                        let int = math::to_int(a[lane]);
                        out.0[lane] = int.unwrap_or_default();
                        self.failed[index].0[lane] |= if int.is_none() { live[lane] } else { 0 };
                    }
                }
                if results[0].uniform {
                    let x = self.floats.view(operands[0]).row(0);
                    self.fail_uniform(math::to_int(x).is_none(), operands[1], chunk.blocks());
                }
                self.ints.put(results[0], out);
            }
            Code::Bool2(op) => {
                let mut out = self.bools.take(results[0]);
                let (a, b) = (self.bools.view(operands[0]), self.bools.view(operands[1]));
                let loops = Binary { out: &mut out[..blocks], a, b };
                match op {
                    BoolBinary::And => loops.go(|a, b| a & b),
                    BoolBinary::Or => loops.go(|a, b| a | b),
                    BoolBinary::Xor => loops.go(|a, b| a ^ b),
                    BoolBinary::AndNot => loops.go(|a, b| a & !b),
                }
                self.bools.put(results[0], out);
            }
            Code::Not => {
                let mut out = self.bools.take(results[0]);
                each(&mut out[..blocks], self.bools.view(operands[0]), |x| !x);
                self.bools.put(results[0], out);
            }
            Code::Select(Kind::Float) => {
                let mut out = self.floats.take(results[0]);
                let (a, b) = (self.floats.view(operands[1]), self.floats.view(operands[2]));
                select(&mut out[..blocks], self.bools.view(operands[0]), a, b);
                self.floats.put(results[0], out);
            }
            Code::Select(Kind::Int) => {
                let mut out = self.ints.take(results[0]);
                let (a, b) = (self.ints.view(operands[1]), self.ints.view(operands[2]));
                select(&mut out[..blocks], self.bools.view(operands[0]), a, b);
                self.ints.put(results[0], out);
            }
            Code::Select(Kind::Bool) => {
                let mut out = self.bools.take(results[0]);
                let (a, b) = (self.bools.view(operands[1]), self.bools.view(operands[2]));
                select(&mut out[..blocks], self.bools.view(operands[0]), a, b);
                self.bools.put(results[0], out);
            }
            Code::FloatFromInt => {
                let mut out = self.floats.take(results[0]);
                #[expect(clippy::cast_precision_loss, reason = "an int counts as the nearest float")]
                each(&mut out[..blocks], self.ints.view(operands[0]), |x| x as f32);
                self.floats.put(results[0], out);
            }
            Code::HashFloats(seed) => {
                let mut out = self.floats.take(results[0]);
                let views: [View<'_, f32>; 4] =
                    std::array::from_fn(|i| self.floats.view(operands[i.min(operands.len() - 1)]));
                for (index, out) in out[..blocks].iter_mut().enumerate() {
                    let [a, b, c, d] = views.map(|view| view.block(index));
                    match operands.len() {
                        1 => numeric::seeded_hash([a], seed, &mut out.0),
                        2 => numeric::seeded_hash([a, b], seed, &mut out.0),
                        3 => numeric::seeded_hash([a, b, c], seed, &mut out.0),
                        _ => numeric::seeded_hash([a, b, c, d], seed, &mut out.0),
                    }
                }
                self.floats.put(results[0], out);
            }
            Code::HashInt(seed) => {
                let mut out = self.floats.take(results[0]);
                each(&mut out[..blocks], self.ints.view(operands[0]), |x| hash::of_int(seed, x));
                self.floats.put(results[0], out);
            }
            Code::Noise(noise) => {
                let mut out = self.floats.take(results[0]);
                self.noise(noise, operands, &mut out[..blocks]);
                self.floats.put(results[0], out);
            }
            Code::Library(function) => {
                let mut outs: [Vec<Block<f32>>; 4] = Default::default();
                for (out, result) in outs.iter_mut().zip(results) {
                    *out = self.floats.take(*result);
                }
                let mut rows = Rows { outs: &mut outs[..results.len()], operands, floats: &self.floats, blocks };
                if !rows.whole_blocks(function) {
                    function.in_loop(rows);
                }
                for (out, result) in outs.into_iter().zip(results) {
                    self.floats.put(*result, out);
                }
            }
            Code::Texture(texture) => self.texture(&chunk.textures[usize::from(texture)], operands, results, blocks),
            Code::Input(column, lane) => self.input(column, usize::from(lane), results[0], chunk),
            Code::Light => self.light(operands[0], results, chunk),
            Code::Irradiance => self.irradiance(results, chunk),
            Code::Native { function, .. } => {
                self.native(&chunk.natives[usize::from(function)], operands, results, blocks, chunk);
            }
        }
    }

    /// A uniform instruction has failed: so have all hits in its mask.
    #[inline(always)]
    fn fail_uniform(&mut self, failed: bool, mask: Register, blocks: usize) {
        if failed {
            self.fail(mask, blocks);
        }
    }

    #[inline(always)]
    fn noise(&self, noise: Noise, operands: &[Register], out: &mut [Block<f32>]) {
        let (x, y) = (self.floats.view(operands[0]), self.floats.view(operands[1]));
        let z = operands.get(2).map(|z| self.floats.view(*z));
        for (index, out) in out.iter_mut().enumerate() {
            let (x, y, out) = (x.block(index), y.block(index), &mut out.0);
            match (noise, z.map(|z| z.block(index))) {
                (Noise::Value, None) => batch::value_noise_2d(x, y, out),
                (Noise::Value, Some(z)) => batch::value_noise_3d(x, y, z, out),
                (Noise::Gradient, None) => batch::gradient_noise_2d(x, y, out),
                (Noise::Gradient, Some(z)) => batch::gradient_noise_3d(x, y, z, out),
                (Noise::Cellular, None) => batch::cellular_noise_2d(x, y, out),
                (Noise::Cellular, Some(z)) => batch::cellular_noise_3d(x, y, z, out),
                (Noise::CellId, None) => batch::cell_id_2d(x, y, out),
                (Noise::CellId, Some(z)) => batch::cell_id_3d(x, y, z, out),
                (Noise::Fbm(octaves), None) => batch::fbm_2d(x, y, octaves.into(), out),
                (Noise::Fbm(octaves), Some(z)) => batch::fbm_3d(x, y, z, octaves.into(), out),
            }
        }
    }

    #[inline(always)]
    fn texture(&mut self, texture: &TextureUse, operands: &[Register], results: &[Register], blocks: usize) {
        let mut outs = [0, 1, 2, 3].map(|i| self.floats.take(results[i]));
        let (u, v) = (self.floats.view(operands[0]), self.floats.view(operands[1]));
        let width = operands.get(2).map(|width| self.floats.view(*width));
        for index in 0..blocks {
            let (u, v) = (u.block(index), v.block(index));
            let mut colors = [[0.0; LANES]; 4];
            match width {
                Some(width) => texture.texture.sample_wide_lanes(u, v, width.block(index), &mut colors),
                None => texture.texture.sample_lanes(u, v, &mut colors),
            }
            for (out, color) in outs.iter_mut().zip(colors) {
                out[index].0 = color;
            }
        }
        for (register, out) in results.iter().zip(outs) {
            self.floats.put(*register, out);
        }
    }

    /// Calls a plug-in's function: its batch form, or else its scalar form at each hit in the mask.
    fn native(
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

    #[inline(always)]
    fn input(&mut self, column: Column, lane: usize, result: Register, chunk: &Chunk<'_>) {
        let hits = chunk.hits;
        match column.kind() {
            Kind::Float => {
                let mut out = self.floats.take(result);
                match column {
                    Column::Position => load(&mut out, &hits.position, chunk, |v| v[lane]),
                    Column::Normal => load(&mut out, &hits.normal, chunk, |v| v[lane]),
                    Column::GeometricNormal => load(&mut out, &hits.geometric_normal, chunk, |v| v[lane]),
                    Column::Incoming => load(&mut out, &hits.incoming, chunk, |v| v[lane]),
                    Column::Uv(0) => load(&mut out, &hits.uv, chunk, |v| v[lane]),
                    Column::Uv(set) => match hits.more_uvs.get(set as usize - 1) {
                        Some(column) => load(&mut out, column, chunk, |v| v[lane]),
                        // Missing sets read as 0.
                        None => out[..chunk.blocks()].fill(Block([0.0; LANES])),
                    },
                    Column::Tangent => load(&mut out, &hits.tangent, chunk, |v| v[lane]),
                    Column::Color => load(&mut out, &hits.color, chunk, |v| v[lane]),
                    Column::Barycentric => load(&mut out, &hits.barycentric, chunk, |v| v[lane]),
                    Column::Distance => load(&mut out, &hits.distance, chunk, |x| x),
                    Column::Depth => load(&mut out, &hits.depth, chunk, |x| x),
                    Column::PixelsPerUnit => load(&mut out, &hits.pixels_per_unit, chunk, |x| x),
                    Column::Curvature => load(&mut out, &hits.curvature, chunk, |x| x),
                    Column::Footprint => load(&mut out, &hits.footprint, chunk, |x| x),
                    Column::UvFootprint => load(&mut out, &hits.uv_footprint, chunk, |x| x),
                    _ => out[0] = Block([hits.time; LANES]),
                }
                self.floats.put(result, out);
            }
            Kind::Int => {
                let mut out = self.ints.take(result);
                match column {
                    Column::ObjectId => load(&mut out, &hits.object_id, chunk, i64::from),
                    Column::PolygonId => load(&mut out, &hits.polygon_id, chunk, i64::from),
                    Column::PathKind => load(&mut out, &hits.path_kind, chunk, PathKind::place),
                    Column::AttributeSet if hits.attribute_set.is_empty() => {
                        out[..chunk.blocks()].fill(Block([-1; LANES]));
                    }
                    Column::AttributeSet => load(&mut out, &hits.attribute_set, chunk, i64::from),
                    _ => out[0] = Block([hits.light_count as i64; LANES]),
                }
                self.ints.put(result, out);
            }
            Kind::Bool => {
                let mut out = self.bools.take(result);
                load(&mut out, &hits.front_facing, chunk, mask);
                self.bools.put(result, out);
            }
        }
    }

    #[inline(always)]
    fn light(&mut self, index: Register, results: &[Register], chunk: &Chunk<'_>) {
        let hits = chunk.hits;
        let count = hits.light_count;
        let mut outs: [Vec<Block<f32>>; 7] = std::array::from_fn(|i| self.floats.take(results[i]));
        let lights = hits.lights.get(chunk.first * count..(chunk.first + chunk.rows) * count).unwrap_or_default();
        // Hits whose index is out of range have failed; they may read anything.
        let in_range = |index: i64| usize::try_from(index).unwrap_or_default().min(count.saturating_sub(1));
        let index_of = self.ints.view(index);
        if !lights.is_empty() {
            for block in 0..chunk.blocks() {
                let index = index_of.block(block);
                let same = index_of.uniform().map(in_range);
                let mut columns = [[0.0; LANES]; 7];
                for lane in 0..LANES {
                    let row = (block * LANES + lane).min(chunk.rows - 1);
                    let light = same.unwrap_or_else(|| in_range(index[lane]));
                    let LightSample { direction, radiance, visibility } = lights[row * count + light];
                    columns[0][lane] = direction.x;
                    columns[1][lane] = direction.y;
                    columns[2][lane] = direction.z;
                    columns[3][lane] = radiance.x;
                    columns[4][lane] = radiance.y;
                    columns[5][lane] = radiance.z;
                    columns[6][lane] = visibility;
                }
                for (out, column) in outs.iter_mut().zip(columns) {
                    out[block].0 = column;
                }
            }
        }
        for (register, out) in results.iter().zip(outs) {
            self.floats.put(*register, out);
        }
    }

    /// As [`hit::irradiance`], for a block of hits at a time.
    #[inline(always)]
    fn irradiance(&mut self, results: &[Register], chunk: &Chunk<'_>) {
        let hits = chunk.hits;
        let count = hits.light_count;
        let mut outs: [Vec<Block<f32>>; 3] = std::array::from_fn(|i| self.floats.take(results[i]));
        let rows = chunk.first..chunk.first + chunk.rows;
        let lights = hits.lights.get(rows.start * count..rows.end * count).unwrap_or_default();
        let normals = hits.normal.get(rows).unwrap_or_default();
        for block in 0..chunk.blocks() {
            let [mut red, mut green, mut blue] = [[0.0; LANES]; 3];
            if !normals.is_empty() && !lights.is_empty() {
                for light in 0..count {
                    for lane in 0..LANES {
                        let row = (block * LANES + lane).min(chunk.rows - 1);
                        let LightSample { direction, radiance, visibility } = lights[row * count + light];
                        let facing = hit::facing(normals[row], direction);
                        red[lane] += radiance.x * visibility * facing;
                        green[lane] += radiance.y * visibility * facing;
                        blue[lane] += radiance.z * visibility * facing;
                    }
                }
            }
            for (out, channel) in outs.iter_mut().zip([red, green, blue]) {
                out[block].0 = channel;
            }
        }
        for (register, out) in results.iter().zip(outs) {
            self.floats.put(*register, out);
        }
    }
}

/// An instruction about to be run. (A closure would do, but closures are not always inlined into the function that is
/// compiled for wide vectors, and then are not compiled for them.)
struct Instruction<'a> {
    registers: &'a mut Registers,
    code: Code,
    operands: &'a [Register],
    results: &'a [Register],
    blocks: usize,
    chunk: &'a Chunk<'a>,
}

impl pulp::WithSimd for Instruction<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        self.registers.set(self.code, self.operands, self.results, self.blocks, self.chunk);
    }
}

/// A register put aside.
enum Kept {
    Floats(Vec<Block<f32>>, bool),
    Ints(Vec<Block<i64>>, bool),
    Bools(Vec<Block<u32>>, bool),
}

fn copy<T: Copy>(bank: &mut Bank<T>, from: Register, to: Register, blocks: usize) {
    let source = bank.take(from);
    fill(bank, View { blocks: &source, uniform: from.uniform }, to, blocks);
    bank.put(from, source);
}

fn fill<T: Copy>(bank: &mut Bank<T>, from: View<'_, T>, to: Register, blocks: usize) {
    let blocks = if to.uniform { 1 } else { blocks };
    for (index, block) in bank.columns[usize::from(to.index)][..blocks].iter_mut().enumerate() {
        block.0 = *from.block(index);
    }
}

/// Reads a column of a batch. The last row is repeated to fill the last block.
#[inline(always)]
fn load<S: Copy, T: Copy>(out: &mut [Block<T>], source: &[S], chunk: &Chunk<'_>, pick: impl Fn(S) -> T) {
    let Some(rows) = source.get(chunk.first..chunk.first + chunk.rows) else { return };
    let (whole, rest) = rows.as_chunks::<LANES>();
    for (out, rows) in out.iter_mut().zip(whole) {
        for (out, row) in out.0.iter_mut().zip(rows) {
            *out = pick(*row);
        }
    }
    if let Some(last) = rest.last() {
        let out = &mut out[whole.len()].0;
        for (lane, out) in out.iter_mut().enumerate() {
            *out = pick(*rest.get(lane).unwrap_or(last));
        }
    }
}

#[inline(always)]
fn each<S: Copy, T: Copy + Default>(out: &mut [Block<T>], a: View<'_, S>, formula: impl Fn(S) -> T) {
    for (index, out) in out.iter_mut().enumerate() {
        // Only what cannot overlap is sure to become vector instructions: hence copies, here and below.
        let a = *a.block(index);
        let mut results = [T::default(); LANES];
        for lane in 0..LANES {
            results[lane] = formula(a[lane]);
        }
        out.0 = results;
    }
}

#[inline(always)]
fn whole_blocks(out: &mut [Block<f32>], a: View<'_, f32>, function: impl Fn(&[f32; LANES], &mut [f32; LANES])) {
    for (index, out) in out.iter_mut().enumerate() {
        function(a.block(index), &mut out.0);
    }
}

#[inline(always)]
fn compare<T: Copy>(
    out: &mut [Block<u32>],
    a: View<'_, T>,
    b: View<'_, T>,
    op: super::ir::Comparison,
    formula: impl Fn(super::ir::Comparison, T, T) -> bool,
) {
    use super::ir::Comparison::{Equal, Greater, GreaterEqual, Less, LessEqual, NotEqual};
    let mut go = |op| Binary { out: &mut *out, a, b }.go(|a, b| mask(formula(op, a, b)));
    // One loop for each, without a choice inside.
    match op {
        Equal => go(Equal),
        NotEqual => go(NotEqual),
        Less => go(Less),
        LessEqual => go(LessEqual),
        Greater => go(Greater),
        GreaterEqual => go(GreaterEqual),
    }
}

#[inline(always)]
fn select<T: Copy + Default>(out: &mut [Block<T>], mask: View<'_, u32>, a: View<'_, T>, b: View<'_, T>) {
    for (index, out) in out.iter_mut().enumerate() {
        let (mask, a, b) = (*mask.block(index), *a.block(index), *b.block(index));
        let mut results = [T::default(); LANES];
        for lane in 0..LANES {
            results[lane] = if mask[lane] != 0 { a[lane] } else { b[lane] };
        }
        out.0 = results;
    }
}

struct Unary<'a> {
    out: &'a mut [Block<f32>],
    a: View<'a, f32>,
}

impl FloatUnaryLoop for Unary<'_> {
    #[inline(always)]
    fn run(self, formula: impl Fn(f32) -> f32) {
        each(self.out, self.a, formula);
    }
}

struct Binary<'a, T, R> {
    out: &'a mut [Block<R>],
    a: View<'a, T>,
    b: View<'a, T>,
}

impl<T: Copy, R: Copy + Default> Binary<'_, T, R> {
    #[inline(always)]
    fn go(self, formula: impl Fn(T, T) -> R) {
        for (index, out) in self.out.iter_mut().enumerate() {
            let (a, b) = (*self.a.block(index), *self.b.block(index));
            let mut results = [R::default(); LANES];
            for lane in 0..LANES {
                results[lane] = formula(a[lane], b[lane]);
            }
            out.0 = results;
        }
    }
}

impl FloatBinaryLoop for Binary<'_, f32, f32> {
    #[inline(always)]
    fn run(self, formula: impl Fn(f32, f32) -> f32) {
        self.go(formula);
    }
}

impl IntBinaryLoop for Binary<'_, i64, i64> {
    #[inline(always)]
    fn run(self, formula: impl Fn(i64, i64) -> i64) {
        self.go(formula);
    }
}

struct Ternary<'a> {
    out: &'a mut [Block<f32>],
    a: View<'a, f32>,
    b: View<'a, f32>,
    c: View<'a, f32>,
}

impl FloatTernaryLoop for Ternary<'_> {
    #[inline(always)]
    fn run(self, formula: impl Fn(f32, f32, f32) -> f32) {
        for (index, out) in self.out.iter_mut().enumerate() {
            let (a, b, c) = (*self.a.block(index), *self.b.block(index), *self.c.block(index));
            let mut results = [0.0; LANES];
            for lane in 0..LANES {
                results[lane] = formula(a[lane], b[lane], c[lane]);
            }
            out.0 = results;
        }
    }
}

struct Rows<'a> {
    outs: &'a mut [Vec<Block<f32>>],
    operands: &'a [Register],
    floats: &'a Bank<f32>,
    blocks: usize,
}

impl Rows<'_> {
    /// Runs functions that have batch forms of their own; the others are left.
    #[inline(always)]
    fn whole_blocks(&mut self, function: LibraryFunction) -> bool {
        let view = |operand: usize| self.floats.view(self.operands[operand]);
        match function {
            LibraryFunction::Worley2 | LibraryFunction::Worley3 => {
                for index in 0..self.blocks {
                    let (x, y) = (view(0).block(index), view(1).block(index));
                    let mut results = [[0.0; LANES]; 2];
                    match function {
                        LibraryFunction::Worley2 => batch::worley_2d(x, y, &mut results),
                        _ => batch::worley_3d(x, y, view(2).block(index), &mut results),
                    }
                    for (out, result) in self.outs.iter_mut().zip(results) {
                        out[index].0 = result;
                    }
                }
                true
            }
            LibraryFunction::Layered2(octaves) if view(2).uniform && view(3).uniform => {
                let (lacunarity, gain) = (view(2).row(0), view(3).row(0));
                for index in 0..self.blocks {
                    let (x, y) = (view(0).block(index), view(1).block(index));
                    batch::layered_2d(x, y, octaves.into(), lacunarity, gain, &mut self.outs[0][index].0);
                }
                true
            }
            LibraryFunction::Layered3(octaves) if view(3).uniform && view(4).uniform => {
                let (lacunarity, gain) = (view(3).row(0), view(4).row(0));
                for index in 0..self.blocks {
                    let (x, y, z) = (view(0).block(index), view(1).block(index), view(2).block(index));
                    batch::layered_3d(x, y, z, octaves.into(), lacunarity, gain, &mut self.outs[0][index].0);
                }
                true
            }
            _ => false,
        }
    }
}

impl LibraryLoop for Rows<'_> {
    #[inline(always)]
    fn run(self, formula: impl Fn([f32; MOST_ARGUMENTS]) -> [f32; 4]) {
        for index in 0..self.blocks {
            let mut arguments = [[0.0; LANES]; MOST_ARGUMENTS];
            for (argument, operand) in arguments.iter_mut().zip(self.operands) {
                *argument = *self.floats.view(*operand).block(index);
            }
            let mut results = [[0.0; LANES]; 4];
            let [a, b, c, d, e, f, g, h] = &arguments;
            for lane in 0..LANES {
                let given = formula([a[lane], b[lane], c[lane], d[lane], e[lane], f[lane], g[lane], h[lane]]);
                [results[0][lane], results[1][lane], results[2][lane], results[3][lane]] = given;
            }
            for (out, result) in self.outs.iter_mut().zip(results) {
                out[index].0 = result;
            }
        }
    }
}

struct Checked<'a> {
    out: &'a mut [Block<i64>],
    a: View<'a, i64>,
    b: View<'a, i64>,
    mask: View<'a, u32>,
    failed: &'a mut [Block<u32>],
}

impl IntCheckedLoop for Checked<'_> {
    #[inline(always)]
    fn run(self, formula: impl Fn(i64, i64) -> Option<i64>) {
        for ((index, out), failed) in self.out.iter_mut().enumerate().zip(self.failed) {
            let (a, b, mask) = (self.a.block(index), self.b.block(index), self.mask.block(index));
            for lane in 0..LANES {
                let result = formula(a[lane], b[lane]);
                out.0[lane] = result.unwrap_or_default();
                failed.0[lane] |= if result.is_none() { mask[lane] } else { 0 };
            }
        }
    }
}
