//! Running shaders over batches: with kernels where there are any, and with the Rhai interpreter, the reference that
//! defines what a script means.
//!
//! The interpreter walks the syntax tree. Rhai's bytecode machine (its feature `grain`) was compared on random scripts,
//! the shipped ones and faulty ones, and left out: the shipped ones take 1.02 to 1.3 times as long with it, since most of
//! their time goes to properties and library functions; its `for (x, i) in …` overwrites other variables, and it counts
//! operations differently, so that loops without an end stop elsewhere.
//! `tests/bench/README.md` has the figures.

use std::collections::BTreeMap;
use std::sync::Arc;

use rhai::{Caches, Dynamic, Engine, EvalAltResult};

use super::batch::{HitBatch, OutputBatch};
use super::kernel::{Batch, Kernel, Registers, Slice};
use super::library::Hit;
use super::line::{self, LineRow, LineStyles};
use super::names::OutputSet;
use super::output::{self, Row};
use super::program::{Mode, Shader, Shaders};
use crate::diag::{Diagnostic, Diagnostics};
use crate::sample::PairBatch;
use crate::scene::Scene;
use crate::scene::ids::MaterialId;

/// Run-time errors of scripts: each place and message once, with a count. Merging is order-independent.
#[derive(Clone, Debug, Default)]
pub struct ShadeErrors {
    /// By place and message, numbers in it aside: the diagnostic and how many hits had it. Of diagnostics that differ
    /// only in numbers, the first in alphabetical order is kept, whoever saw it first.
    pub errors: BTreeMap<String, (Diagnostic, u64)>,
}

impl ShadeErrors {
    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.errors.is_empty()
    }

    /// How many hits had an error.
    #[must_use]
    pub fn hits(&self) -> u64 {
        self.errors.values().map(|(_, hits)| hits).sum()
    }

    /// Adds an error that some hits had.
    pub fn add(&mut self, diagnostic: Diagnostic, hits: u64) {
        let mut key = match &diagnostic.span {
            Some(span) => format!("{}:{}: ", span.source.name, span.range.start),
            None => String::new(),
        };
        key.extend(diagnostic.message.chars().filter(|c| !c.is_ascii_digit()));
        self.insert(key, diagnostic, hits);
    }

    /// Adds another list's counts.
    pub fn merge(&mut self, other: Self) {
        for (key, (diagnostic, hits)) in other.errors {
            self.insert(key, diagnostic, hits);
        }
    }

    fn insert(&mut self, key: String, diagnostic: Diagnostic, hits: u64) {
        match self.errors.get_mut(&key) {
            Some((kept, count)) => {
                *count += hits;
                if (&diagnostic.message, &diagnostic.hints) < (&kept.message, &kept.hints) {
                    *kept = diagnostic;
                }
            }
            None => {
                self.errors.insert(key, (diagnostic, hits));
            }
        }
    }

    /// As diagnostics, each with a hint that says how many hits had it.
    #[must_use]
    pub fn into_diagnostics(self) -> Diagnostics {
        Diagnostics(
            self.errors
                .into_values()
                .map(|(diagnostic, count)| {
                    let hits = if count == 1 { "1 hit".to_owned() } else { format!("{count} hits") };
                    diagnostic.hint(format!("this happened at {hits}, which got the marker colour"))
                })
                .collect(),
        )
    }
}

/// What one context remembers of one material.
#[derive(Default)]
struct Memory {
    /// Resolved functions of the script.
    caches: Caches,
    /// The one result of a constant shader, or of a shader that ran out of operations.
    fixed: Option<Result<Row, Diagnostic>>,
    /// What is said of a `line` that ran out of operations.
    fixed_line: Option<Diagnostic>,
    /// Kernels and slices, by number of lights and by outputs.
    slices: Vec<(usize, OutputSet, Arc<Kernel>, Arc<Slice>)>,
}

/// A thread's own shading context: its engine and scratch memory. It is costly to make (half a millisecond): keep it.
pub struct Shading<'a> {
    shaders: &'a Shaders,
    engine: Engine,
    memories: Vec<Memory>,
    batch: Arc<HitBatch>,
    registers: Registers,
    /// What a kernel of `line` writes.
    line_outputs: OutputBatch,
    /// Rows that a kernel has given up.
    failed: Vec<usize>,
    evaluations: u64,
    kernel_hits: u64,
}

impl std::fmt::Debug for Shading<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Shading").field("evaluations", &self.evaluations).finish_non_exhaustive()
    }
}

impl<'a> Shading<'a> {
    /// A context for the calling thread.
    #[must_use]
    pub fn new(scene: &'a Scene, shaders: &'a Shaders) -> Self {
        let memories = scene.materials().iter().map(|_| Memory::default()).collect();
        Self {
            shaders,
            engine: shaders.engine(),
            memories,
            batch: Arc::default(),
            registers: Registers::default(),
            line_outputs: OutputBatch::default(),
            failed: Vec::new(),
            evaluations: 0,
            kernel_hits: 0,
        }
    }

    /// How many hits kernels have shaded, those included that the interpreter was then asked about.
    #[must_use]
    pub fn kernel_hits(&self) -> u64 {
        self.kernel_hits
    }

    /// How often the interpreter has run a `surface` in this context.
    #[must_use]
    pub fn evaluations(&self) -> u64 {
        self.evaluations
    }

    /// The outputs that a material's shader may write: what a plan asks of it at most.
    #[must_use]
    pub fn writable(&self, material: MaterialId) -> OutputSet {
        self.shaders.of(material).analysis().writable()
    }

    /// Shades a batch of hits of one material. Columns of `wanted`, and all extra outputs, are filled (an output that
    /// the shader never writes gets its default), others are left empty. A hit whose script fails gets the marker:
    /// `color` (1, 0, 1), no line, all else default.
    ///
    /// A constant shader is run once in each context. A shader that ran out of operations is not run again in this
    /// context: all further hits count as failed, so that a loop without an end costs its limit once, not at every hit.
    pub fn shade(
        &mut self,
        material: MaterialId,
        hits: &HitBatch,
        wanted: OutputSet,
        outputs: &mut OutputBatch,
        errors: &mut ShadeErrors,
    ) {
        output::start(outputs, self.shaders.aovs().len());
        let shader = self.shaders.of(material);
        let constant = shader.mode() == Mode::Constant;
        if shader.mode() == Mode::Kernel
            && self.memories[material.index()].fixed.is_none()
            && knows_attributes(shader, hits)
            && let Some((kernel, slice)) = self.slice(shader, material, hits.light_count, wanted)
        {
            self.run_kernel(&kernel, &slice, material, hits, wanted, outputs, errors);
            return;
        }
        if !constant {
            // Scripts can hold only what is owned; a copy for each batch costs little beside running it.
            self.batch = Arc::new(hits.clone());
        }
        for row in 0..hits.len {
            if let Some(fixed) = &self.memories[material.index()].fixed {
                repeat(fixed, hits.len - row, wanted, outputs, errors);
                break;
            }
            let (result, endless) = self.evaluate(shader, material, row);
            if constant || endless {
                self.memories[material.index()].fixed = Some(result.clone());
            }
            repeat(&result, 1, wanted, outputs, errors);
        }
    }

    /// The kernel of a material for so many lights, and its slice for these outputs.
    fn slice(
        &mut self,
        shader: &Shader,
        material: MaterialId,
        lights: usize,
        wanted: OutputSet,
    ) -> Option<(Arc<Kernel>, Arc<Slice>)> {
        let known = &mut self.memories[material.index()].slices;
        if let Some((.., kernel, slice)) = known.iter().find(|(count, set, ..)| (*count, *set) == (lights, wanted)) {
            return Some((Arc::clone(kernel), Arc::clone(slice)));
        }
        let kernel = shader.kernel(lights)?;
        let slice = kernel.slice(wanted);
        known.push((lights, wanted, Arc::clone(&kernel), Arc::clone(&slice)));
        Some((kernel, slice))
    }

    /// Shades a batch with a kernel. Hits that it gives up are run by the interpreter, which alone knows what becomes
    /// of them.
    #[expect(clippy::too_many_arguments, reason = "the arguments of `shade`, and what it has found")]
    fn run_kernel(
        &mut self,
        kernel: &Kernel,
        slice: &Slice,
        material: MaterialId,
        hits: &HitBatch,
        wanted: OutputSet,
        outputs: &mut OutputBatch,
        errors: &mut ShadeErrors,
    ) {
        let shader = self.shaders.of(material);
        let mut failed = std::mem::take(&mut self.failed);
        failed.clear();
        let batch = Batch { hits, pairs: None };
        kernel.run(slice, batch, self.shaders.aovs(), &mut self.registers, outputs, &mut failed);
        output::fill_up(hits.len, wanted, outputs);
        self.kernel_hits += hits.len as u64;
        if !failed.is_empty() {
            self.batch = Arc::new(hits.clone());
        }
        for &row in &failed {
            let (result, endless) = self.evaluate(shader, material, row);
            // As without kernels, a shader that has run out of operations is given up from here on.
            let rows = if endless { row..hits.len } else { row..row + 1 };
            let marker;
            let values = match &result {
                Ok(values) => values,
                Err(diagnostic) => {
                    errors.add(diagnostic.clone(), rows.len() as u64);
                    marker = Row::marker();
                    &marker
                }
            };
            rows.for_each(|row| output::replace(row, values, wanted, outputs));
            if endless {
                self.memories[material.index()].fixed = Some(result);
                break;
            }
        }
        self.failed = failed;
    }

    /// Styles lines of one material, whose shader must have a `line`: [`Shader::styles_lines`]. A line whose script
    /// fails gets the marker's colour, opaque. A script that ran out of operations is not run again in this context.
    pub fn style(
        &mut self,
        material: MaterialId,
        pairs: &PairBatch,
        styles: &mut LineStyles,
        errors: &mut ShadeErrors,
    ) {
        let LineStyles { color, opacity } = styles;
        color.clear();
        opacity.clear();
        let shader = self.shaders.of(material);
        let Some(line) = &shader.line else {
            color.resize(pairs.len, None);
            opacity.resize(pairs.len, 1.0);
            return;
        };
        let mut failed = std::mem::take(&mut self.failed);
        failed.clear();
        match line.kernel().filter(|_| self.memories[material.index()].fixed_line.is_none()) {
            Some(kernel) => {
                let slice = kernel.slice(line::WRITTEN);
                let mut outputs = std::mem::take(&mut self.line_outputs);
                output::start(&mut outputs, 0);
                let batch = Batch { hits: &HitBatch::default(), pairs: Some(pairs) };
                kernel.run(&slice, batch, &[], &mut self.registers, &mut outputs, &mut failed);
                output::fill_up(pairs.len, line::WRITTEN, &mut outputs);
                color.extend_from_slice(&outputs.color);
                opacity.extend_from_slice(&outputs.opacity);
                self.line_outputs = outputs;
            }
            None => {
                color.resize(pairs.len, None);
                opacity.resize(pairs.len, 1.0);
                failed.extend(0..pairs.len);
            }
        }
        for &row in &failed {
            let known = self.memories[material.index()].fixed_line.clone();
            let result = known.map_or_else(|| self.style_one(shader, material, pairs, row), Err);
            // A script without end is given up from here on, whether there is a kernel or not.
            let endless = self.memories[material.index()].fixed_line.is_some();
            let rows = if endless { row..pairs.len } else { row..row + 1 };
            let style = result.unwrap_or_else(|fault| {
                errors.add(fault, rows.len() as u64);
                LineRow::MARKER
            });
            color[rows.clone()].fill(style.color);
            opacity[rows].fill(style.opacity);
            if endless {
                break;
            }
        }
        self.failed = failed;
    }

    /// Runs `line` for one line.
    fn style_one(
        &mut self,
        shader: &Shader,
        material: MaterialId,
        pairs: &PairBatch,
        row: usize,
    ) -> Result<LineRow, Diagnostic> {
        self.evaluations += 1;
        let program = &shader.program;
        // A shader that has no `line` is never asked.
        let function = program.line.as_ref().unwrap_or(&program.surface);
        let memory = &mut self.memories[material.index()];
        let arguments = [line::pair_record(pairs, row), Dynamic::from(shader.record.clone())];
        match program.run(&self.engine, &mut memory.caches, function, arguments) {
            Ok(value) => LineRow::read(&value).map_err(|fault| {
                let place = fault.key.and_then(|key| program.key_span(&key));
                fault.fault.at(place.unwrap_or_else(|| function.span.clone()))
            }),
            Err(error) => {
                let fault = program.explain(&error);
                if matches!(*error, EvalAltResult::ErrorTooManyOperations(_)) {
                    memory.fixed_line = Some(fault.clone());
                }
                Err(fault)
            }
        }
    }

    /// Runs `surface` at one hit. The second value tells whether it ran out of operations.
    fn evaluate(&mut self, shader: &Shader, material: MaterialId, row: usize) -> (Result<Row, Diagnostic>, bool) {
        self.evaluations += 1;
        let program = &shader.program;
        let caches = &mut self.memories[material.index()].caches;
        let hit = Hit { batch: Arc::clone(&self.batch), row };
        let arguments = [Dynamic::from(hit), Dynamic::from(shader.record.clone())];
        match program.run(&self.engine, caches, &program.surface, arguments) {
            Ok(value) => {
                let row = Row::read(&value, self.shaders.aovs()).map_err(|fault| {
                    let place = fault.key.and_then(|key| program.key_span(&key));
                    fault.fault.at(place.unwrap_or_else(|| program.surface.span.clone()))
                });
                (row, false)
            }
            Err(error) => (Err(program.explain(&error)), matches!(*error, EvalAltResult::ErrorTooManyOperations(_))),
        }
    }
}

fn repeat(
    result: &Result<Row, Diagnostic>,
    count: usize,
    wanted: OutputSet,
    outputs: &mut OutputBatch,
    errors: &mut ShadeErrors,
) {
    let marker;
    let row = match result {
        Ok(row) => row,
        Err(diagnostic) => {
            errors.add(diagnostic.clone(), count as u64);
            marker = Row::marker();
            &marker
        }
    };
    for _ in 0..count {
        output::append(row, wanted, outputs);
    }
}

/// Whether the attributes of a batch are those of the scene, for which its kernels were made.
fn knows_attributes(shader: &Shader, hits: &HitBatch) -> bool {
    hits.attribute_set.is_empty()
        || Arc::ptr_eq(&hits.attributes, &shader.attributes)
        || hits.attributes == shader.attributes
}
