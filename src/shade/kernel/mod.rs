//! Kernels: scripts as programs that run over whole batches of hits (DESIGN section 4.4).
//!
//! 1. `lower` walks a script's syntax tree once for a material and writes the program it stands for in `ir`, with the
//!    help of `build`, which folds constants and shares what is computed twice.
//! 2. `slice` cuts out what some outputs need and gives values registers. A kernel has a slice for each set of outputs
//!    that is asked for: a pass over lines alone never evaluates the BSDF.
//! 3. `run` runs a slice, an instruction at a time, over a chunk of hits.
//! 4. `outputs` hands the results to the [`OutputBatch`](super::OutputBatch).
//!
//! # The same bits
//! An instruction does to each row what the interpreter's function does to one value: the same `f32` operations in the
//! same order. Where the interpreter would raise an error, or might run out of operations, the hit *fails*, and the
//! interpreter is run for it: it alone decides, and has the message. Property tests hold kernels to the interpreter.

mod build;
mod ir;
mod lower;
mod outputs;
mod run;
mod slice;
mod verify;

use std::sync::{Arc, Mutex};

pub(super) use self::lower::Surroundings;
use self::lower::{Lowered, Target};
pub(super) use self::run::Registers;
use self::slice::Runnable;
use super::analysis::Finding;
use super::batch::{HitBatch, OutputBatch};
use super::names::{InputSet, OutputSet, PairSet};
use super::params::Params;
use super::script::{Entry, Program};
use crate::sample::PairBatch;

/// A script, lowered for one material.
#[derive(Debug)]
pub(super) struct Kernel {
    lowered: Lowered,
    /// Slices that have been asked for, by outputs.
    slices: Mutex<Vec<(OutputSet, Arc<Slice>)>>,
}

/// What a kernel runs over.
#[derive(Clone, Copy, Debug)]
pub(super) struct Batch<'a> {
    /// Without rows where there are pairs.
    pub hits: &'a HitBatch,
    /// What a kernel of `line` runs over.
    pub pairs: Option<&'a PairBatch>,
}

/// What some outputs need of a kernel.
#[derive(Debug)]
pub(super) struct Slice {
    program: Runnable,
    /// The kernel's outputs that are wanted, with where in the program's roots their channels begin; the root before
    /// tells where the output is present.
    outputs: Vec<(usize, usize)>,
    /// Inputs that the slice reads.
    pub inputs: InputSet,
    /// What a slice of `line` reads.
    pub pair_inputs: PairSet,
    /// Whether hits may fail, so that the interpreter may have to run for them.
    pub may_fail: bool,
}

impl Kernel {
    /// Lowers a function of a script that the renderer calls, for a material with these parameters.
    ///
    /// # Errors
    /// The construct that cannot be lowered.
    pub fn new(
        program: &Program,
        entry: Entry,
        params: &Params,
        surroundings: Surroundings<'_>,
    ) -> Result<Self, Finding> {
        let lowered = lower::lower(program, entry, params, surroundings).map_err(|blame| blame.0)?;
        debug_assert_eq!(verify::verify(&lowered), Ok(()), "the lowering made a program that is not well formed");
        Ok(Self { lowered, slices: Mutex::default() })
    }

    /// The slice that gives these outputs, and all extra ones.
    pub fn slice(&self, wanted: OutputSet) -> Arc<Slice> {
        // A thread that panicked while it held the lock has at worst not added its slice.
        let mut slices = self.slices.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some((_, slice)) = slices.iter().find(|(known, _)| *known == wanted) {
            return Arc::clone(slice);
        }
        let slice = Arc::new(self.cut(wanted));
        slices.push((wanted, Arc::clone(&slice)));
        slice
    }

    fn cut(&self, wanted: OutputSet) -> Slice {
        let mut roots = Vec::new();
        let mut outputs = Vec::new();
        for (index, output) in self.lowered.outputs.iter().enumerate() {
            let is_wanted = match &output.target {
                Target::Output(output) => wanted.contains(*output),
                Target::Aov(_) => true,
            };
            if is_wanted {
                roots.push(output.present);
                outputs.push((index, roots.len()));
                roots.extend_from_slice(&output.channels);
            }
        }
        let program = slice::cut(&self.lowered.block, &self.lowered.types, &roots);
        let (inputs, pair_inputs, may_fail) = (program.inputs(), program.pair_inputs(), program.may_fail());
        Slice { program, outputs, inputs, pair_inputs, may_fail }
    }

    /// Whether the slices of two kernels for these outputs are one program that cannot fail.
    pub fn same(&self, other: &Self, wanted: OutputSet) -> bool {
        let (own, others) = (self.slice(wanted), other.slice(wanted));
        let targets = |kernel: &Self, slice: &Slice| -> Vec<(Target, usize)> {
            slice.outputs.iter().map(|(output, root)| (kernel.lowered.outputs[*output].target.clone(), *root)).collect()
        };
        !own.may_fail
            && !others.may_fail
            && self.lowered.fuel == other.lowered.fuel
            && own.program.same(&others.program)
            && targets(self, &own) == targets(other, &others)
            && self.same_textures(other)
    }

    /// Whether two kernels read the same textures in the same way.
    pub fn same_textures(&self, other: &Self) -> bool {
        let (own, others) = (&self.lowered.textures, &other.lowered.textures);
        let mut pairs = own.iter().zip(others);
        own.len() == others.len() && pairs.all(|(a, b)| a.place == b.place && a.texture.looks_like(&b.texture))
    }

    /// Shades a batch into columns. `failed` gets the rows that the interpreter must look at; their columns hold
    /// anything. `aovs` are the names of the extra outputs.
    pub fn run(
        &self,
        slice: &Slice,
        batch: Batch<'_>,
        aovs: &[String],
        registers: &mut Registers,
        outputs: &mut OutputBatch,
        failed: &mut Vec<usize>,
    ) {
        registers.prepare(&slice.program);
        let Batch { hits, pairs } = batch;
        let len = pairs.map_or(hits.len, |pairs| pairs.len);
        let mut first = 0;
        while first < len {
            let rows = run::CHUNK.min(len - first);
            let Lowered { textures, natives, .. } = &self.lowered;
            let chunk = run::Chunk { hits, pairs, textures, natives, first, rows };
            registers.run(&slice.program, self.lowered.fuel, &chunk);
            for (output, root) in &slice.outputs {
                let output = &self.lowered.outputs[*output];
                outputs::append(&output.target, aovs, &slice.program.roots[*root - 1..], registers, rows, outputs);
            }
            // A layer that the plan does not know is a fault of the hits that write it.
            for (output, root) in &slice.outputs {
                if let Target::Aov(name) = &self.lowered.outputs[*output].target
                    && aovs.binary_search(name).is_err()
                {
                    registers.fail(slice.program.roots[*root - 1], rows.div_ceil(run::LANES));
                }
            }
            if registers.any_failed() {
                failed.extend((0..rows).filter(|row| registers.has_failed(*row)).map(|row| first + row));
            }
            first += rows;
        }
    }

    /// The program, for people and golden texts.
    pub fn listing(&self) -> String {
        let mut text = String::new();
        self.lowered.block.write(&self.lowered.types, 0, &mut text);
        for output in &self.lowered.outputs {
            let name = match &output.target {
                Target::Output(output) => output.iter_names().map(|(name, _)| name.to_lowercase()).collect(),
                Target::Aov(name) => format!("{}{name}", super::names::AOV_PREFIX),
            };
            let channels: Vec<_> = output.channels.iter().map(ToString::to_string).collect();
            let present = match output.present {
                ir::Operand::TRUE => String::new(),
                mask => format!(" where {mask}"),
            };
            text.push_str(&format!("{name}: {}{present}\n", channels.join(" ")));
        }
        text
    }
}
