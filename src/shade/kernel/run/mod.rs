//! Running a slice over a batch: one tight loop per instruction, over a chunk of hits at a time.
//!
//! A register is a column of blocks of [`LANES`] rows; a uniform one uses its first block only, all of whose lanes are
//! equal, so that operands of both sorts are read alike. A chunk's last rows are repeated to fill its last block: these
//! lanes do what a real hit does, and nobody looks at them.
//!
//! All of it is compiled for the widest vectors that the machine has (`pulp` chooses when the program runs). The
//! instructions are the same on all machines, one IEEE operation each, and so are the bits.
//!
//! `bank` holds registers, `loops` the loops of the instructions; `inputs` reads batches, `native` calls plug-ins.

mod bank;
mod inputs;
mod loops;
mod native;

use self::bank::{BLOCKS, Bank, Block, Kept, copy, fill, mask};
pub(super) use self::bank::{CHUNK, LANES, View};
use self::loops::{Binary, Checked, Rows, Ternary, Unary, compare, each, select, whole_blocks};
use super::ir::{BoolBinary, Code, FloatUnary, Kind, Noise};
use super::lower::TextureUse;
use super::slice::{CarriedRegisters, LoopSteps, Register, Runnable, Step};
use crate::sample::PairBatch;
use crate::shade::batch::HitBatch;
use crate::shade::library::batch::{noise as batch, numeric, transcendental};
use crate::shade::library::{hash, math};
use crate::shade::native::NativeFunction;

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

/// A chunk of a batch: its hits and its tables.
#[derive(Clone, Copy)]
pub(super) struct Chunk<'a> {
    pub hits: &'a HitBatch,
    pub pairs: Option<&'a PairBatch>,
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

    /// Hits in a mask fail.
    pub(super) fn fail(&mut self, register: Register, blocks: usize) {
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
