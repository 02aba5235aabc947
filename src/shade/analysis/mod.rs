//! What a material's shader reads and writes, found from its script's syntax tree and parameters (DESIGN section 4.3).
//!
//! TODO by its owner: an abstract interpretation of `surface` with the material's parameters as constants.

use std::sync::Arc;

use super::names::{InputSet, OutputSet};
use super::params::Params;
use crate::scene::texture::Texture;

/// What is known of one output.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OutputFact {
    /// Whether the key may be in the record at all.
    pub may: bool,
    /// Whether the key is in the record at every hit.
    pub always: bool,
    /// The inputs that its value (or its presence) depends on.
    pub inputs: InputSet,
    /// Least and greatest value of any channel, where bounds are known; NaN is possible only if `None`.
    pub range: Option<[f32; 2]>,
}

/// What a material's shader reads and writes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Analysis {
    /// Inputs that code which may run reads.
    pub inputs: InputSet,
    /// One fact for each [`OutputSet`] flag, in the order of the bits.
    pub outputs: Vec<OutputFact>,
    /// Extra outputs, by name without `aov_`, sorted.
    pub aovs: Vec<(String, OutputFact)>,
    /// Whether the facts are known to be complete. If not, all inputs are assumed read and all outputs written.
    pub complete: bool,
}

impl Analysis {
    /// The fact of one output.
    ///
    /// # Panics
    /// If `output` is not exactly one flag.
    #[must_use]
    pub fn output(&self, output: OutputSet) -> &OutputFact {
        assert!(output.bits().is_power_of_two());
        &self.outputs[output.bits().trailing_zeros() as usize]
    }

    /// Whether every output is the same at all hits, so that one evaluation serves the whole material.
    #[must_use]
    pub fn is_constant(&self) -> bool {
        self.complete && self.inputs.is_empty()
    }
}

/// Nothing is known: everything is read, and every output may be written.
#[must_use]
pub fn unknown() -> Analysis {
    let fact = OutputFact { may: true, always: false, inputs: InputSet::all(), range: None };
    Analysis {
        inputs: InputSet::all(),
        outputs: OutputSet::all().iter().map(|_| fact.clone()).collect(),
        aovs: Vec::new(),
        complete: false,
    }
}

/// Analyses a script with the parameters of one material.
#[must_use]
pub fn analyse(ast: &rhai::AST, params: &Params, textures: &[Arc<Texture>]) -> Analysis {
    let _ = (ast, params, textures);
    unknown()
}
