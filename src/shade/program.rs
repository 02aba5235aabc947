//! Compiled scripts and the materials that use them.

use super::analysis::Analysis;
use super::host::Host;
use crate::diag::Diagnostics;
use crate::scene::Scene;
use crate::scene::ids::MaterialId;

/// How a material's shader is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Evaluated once.
    Constant,
    /// By the Rhai interpreter, at every hit.
    Interpreted,
}

impl Mode {
    /// As in `--stats` and `tusche explain`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Constant => "constant",
            Self::Interpreted => "interpreted",
        }
    }
}

/// A material's shader: a compiled script with this material's parameters.
#[derive(Debug)]
pub struct Shader {
    /// Name of the material.
    pub name: String,
    /// What it reads and writes.
    pub analysis: Analysis,
    /// How it is run.
    pub mode: Mode,
}

/// The shaders of all materials of a scene.
#[derive(Debug)]
pub struct Shaders {
    /// By material.
    pub shaders: Vec<Shader>,
    /// Names of all extra outputs of all shaders, without `aov_`, sorted.
    pub aovs: Vec<String>,
}

impl Shaders {
    /// Compiles and analyses all scripts of a scene. Warnings come beside the value.
    ///
    /// # Errors
    /// Every syntax error, missing `surface`, unknown input or output, unknown or ill-typed parameter, at its place.
    pub fn compile(scene: &Scene, host: &Host) -> Result<(Self, Diagnostics), Diagnostics> {
        let _ = (scene, host);
        todo!()
    }

    /// The shader of a material.
    #[must_use]
    pub fn of(&self, material: MaterialId) -> &Shader {
        &self.shaders[material.index()]
    }
}
