//! Running shaders over batches with the Rhai interpreter: the reference that defines what a script means.

use std::collections::BTreeMap;
use std::sync::Arc;

use rhai::{Caches, Dynamic, Engine, EvalAltResult};

use super::batch::{HitBatch, OutputBatch};
use super::library::Hit;
use super::names::OutputSet;
use super::output::{self, Row};
use super::program::{Mode, Shader, Shaders};
use crate::diag::{Diagnostic, Diagnostics};
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
}

/// A thread's own shading context: its engine and scratch memory. It is costly to make (half a millisecond): keep it.
pub struct Shading<'a> {
    shaders: &'a Shaders,
    engine: Engine,
    memories: Vec<Memory>,
    batch: Arc<HitBatch>,
    evaluations: u64,
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
        Self { shaders, engine: shaders.engine(), memories, batch: Arc::default(), evaluations: 0 }
    }

    /// How often this context has run a `surface`.
    #[must_use]
    pub fn evaluations(&self) -> u64 {
        self.evaluations
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
