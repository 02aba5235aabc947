//! Running shaders over batches with the Rhai interpreter: the reference that defines what a script means.

use std::collections::BTreeMap;

use super::batch::{HitBatch, OutputBatch};
use super::names::OutputSet;
use super::program::Shaders;
use crate::diag::{Diagnostic, Diagnostics};
use crate::scene::Scene;
use crate::scene::ids::MaterialId;

/// Run-time errors of scripts: each place and message once, with a count. Merging is order-independent.
#[derive(Clone, Debug, Default)]
pub struct ShadeErrors {
    /// By rendered place and message: the diagnostic and how many hits had it.
    pub errors: BTreeMap<String, (Diagnostic, u64)>,
}

impl ShadeErrors {
    /// Adds another list's counts.
    pub fn merge(&mut self, other: Self) {
        for (key, (diagnostic, count)) in other.errors {
            self.errors.entry(key).or_insert((diagnostic, 0)).1 += count;
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

/// A thread's own shading context: its engine and scratch memory.
pub struct Shading<'a> {
    scene: &'a Scene,
    shaders: &'a Shaders,
}

impl<'a> Shading<'a> {
    /// A context for the calling thread.
    #[must_use]
    pub fn new(scene: &'a Scene, shaders: &'a Shaders) -> Self {
        Self { scene, shaders }
    }

    /// Shades a batch of hits of one material. Columns of `wanted` are filled (an output that the shader never
    /// writes gets its default), others are left empty. A hit whose script fails gets the marker: `color` (1, 0, 1),
    /// no line, all else default.
    pub fn shade(
        &mut self,
        material: MaterialId,
        hits: &HitBatch,
        wanted: OutputSet,
        outputs: &mut OutputBatch,
        errors: &mut ShadeErrors,
    ) {
        let _ = (self.scene, self.shaders, material, hits, wanted, outputs, errors);
        todo!()
    }
}
