//! Compiled scripts and the materials that use them.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, PoisonError};

use rhai::Engine;

use super::analysis::{self, Analysis, Finding};
use super::host::Host;
use super::kernel::{Kernel, Surroundings};
use super::library::ParameterRecord;
use super::line::LineShader;
use super::names::{InputSet, OutputSet, PairSet};
use super::native::NativeFunction;
use super::params::{self, Params, Value};
use super::script::{Entry, Program};
use crate::diag::{Diagnostic, Diagnostics};
use crate::scene::Scene;
use crate::scene::attributes::AttributeSet;
use crate::scene::ids::MaterialId;
use crate::scene::texture::Texture;

/// How a material's shader is run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Evaluated once.
    Constant,
    /// As a program over batches of hits.
    Kernel,
    /// By the Rhai interpreter, at every hit.
    Interpreted,
}

/// How shaders that are not constant may be run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ShadingMode {
    /// As kernels where that is possible.
    #[default]
    Auto,
    /// As kernels; a shader that cannot be one is an error.
    Kernel,
    /// By the interpreter.
    Interpreter,
}

impl Mode {
    /// As in `--stats` and `tusche explain`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Constant => "constant",
            Self::Kernel => "kernel",
            Self::Interpreted => "interpreted",
        }
    }
}

/// A material's shader: a compiled script with this material's parameters.
#[derive(Debug)]
pub struct Shader {
    name: String,
    analysis: Analysis,
    params: Params,
    defaults: Params,
    pub(super) program: Arc<Program>,
    pub(super) record: ParameterRecord,
    /// The kernel, or why there is none; `None` if the interpreter was asked for.
    pub(super) kernel: Option<Result<Arc<Kernel>, Finding>>,
    /// What styles lines, if the script has such a function.
    pub(super) line: Option<LineShader>,
    /// Kernels for batches with another number of lights than the scene has.
    other_kernels: Mutex<Vec<(usize, Option<Arc<Kernel>>)>>,
    pub(super) material_id: u32,
    pub(super) light_count: usize,
    pub(super) textures: Arc<[Arc<Texture>]>,
    pub(super) natives: Arc<[NativeFunction]>,
    pub(super) attributes: Arc<Vec<AttributeSet>>,
}

impl Shader {
    /// Name of the material.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Name of the script, as messages call it.
    #[must_use]
    pub fn script(&self) -> &str {
        &self.program.source.name
    }

    /// What it reads and writes.
    #[must_use]
    pub fn analysis(&self) -> &Analysis {
        &self.analysis
    }

    /// Its parameters.
    #[must_use]
    pub fn params(&self) -> &Params {
        &self.params
    }

    /// What a parameter is where its material says nothing.
    #[must_use]
    pub fn default_of(&self, parameter: &str) -> Option<&Value> {
        self.defaults.0.get(parameter)
    }

    /// The comment that stands behind a parameter in `params()`, on the same line.
    #[must_use]
    pub fn note_of(&self, parameter: &str) -> Option<String> {
        let span = self.program.key_span(parameter)?;
        let line = span.source.text.get(span.range.end..)?.lines().next()?;
        let (_, note) = line.split_once("//")?;
        Some(note.trim().to_owned())
    }

    /// How it is run.
    #[must_use]
    pub fn mode(&self) -> Mode {
        match self.kernel {
            _ if self.analysis.is_constant() => Mode::Constant,
            Some(Ok(_)) => Mode::Kernel,
            _ => Mode::Interpreted,
        }
    }

    /// The construct that keeps the shader from being a kernel.
    #[must_use]
    pub fn blame(&self) -> Option<&Finding> {
        self.kernel.as_ref()?.as_ref().err()
    }

    /// The blame as a diagnostic, at its place.
    #[must_use]
    pub fn blame_diagnostic(&self) -> Option<Diagnostic> {
        self.blame().map(|blame| self.program.found(blame))
    }

    /// The columns of a [`HitBatch`](super::HitBatch) that must be filled for it when these outputs are asked for. The
    /// interpreter evaluates all outputs, whatever is asked for.
    #[must_use]
    pub fn needs(&self, wanted: OutputSet) -> InputSet {
        let all = if self.analysis.complete { self.analysis.inputs.columns() } else { InputSet::all() };
        match &self.kernel {
            Some(Ok(kernel)) if self.mode() == Mode::Kernel => {
                let slice = kernel.slice(wanted);
                // Hits that fail are given to the interpreter.
                if slice.may_fail { all } else { slice.inputs.columns() }
            }
            _ => all,
        }
    }

    /// The kernel for batches with so many lights.
    pub(super) fn kernel(&self, light_count: usize) -> Option<Arc<Kernel>> {
        let kernel = self.kernel.as_ref()?.as_ref().ok()?;
        if light_count == self.light_count || !self.analysis.inputs.intersects(InputSet::LIGHT_COUNT | InputSet::LIGHT)
        {
            return Some(Arc::clone(kernel));
        }
        let mut others = self.other_kernels.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, kernel)) = others.iter().find(|(count, _)| *count == light_count) {
            return kernel.clone();
        }
        let kernel = self.lower(Entry::Surface, light_count).ok();
        others.push((light_count, kernel.clone()));
        kernel
    }

    /// Whether its script has a `line`, so that seen lines must be given to [`Shading::style`](super::Shading::style).
    #[must_use]
    pub fn styles_lines(&self) -> bool {
        self.line.is_some()
    }

    /// Whether its `line` may give an opacity: if not, nothing new is seen through its lines.
    #[must_use]
    pub fn changes_line_opacity(&self) -> bool {
        self.line.as_ref().is_some_and(|line| line.opacity)
    }

    /// The columns of a [`PairBatch`](crate::sample::PairBatch) that must be filled for its `line`; none without one.
    #[must_use]
    pub fn pair_needs(&self) -> PairSet {
        self.line.as_ref().map_or(PairSet::empty(), LineShader::needs)
    }

    /// How its `line` is run; `None` without one.
    #[must_use]
    pub fn line_mode(&self) -> Option<Mode> {
        let line = self.line.as_ref()?;
        Some(if line.kernel().is_some() { Mode::Kernel } else { Mode::Interpreted })
    }

    /// The construct that keeps its `line` from being a kernel, at its place.
    #[must_use]
    pub fn line_blame(&self) -> Option<Diagnostic> {
        let blame = self.line.as_ref()?.kernel.as_ref()?.as_ref().err()?;
        Some(self.program.found(blame))
    }

    pub(super) fn lower(&self, entry: Entry, light_count: usize) -> Result<Arc<Kernel>, Finding> {
        let surroundings = Surroundings {
            textures: &self.textures,
            attributes: &self.attributes,
            natives: &self.natives,
            material_id: self.material_id,
            light_count: Some(light_count),
        };
        Kernel::new(&self.program, entry, &self.params, surroundings).map(Arc::new)
    }

    /// The program of its kernel for all outputs, if it has one: for people, and for golden texts.
    #[must_use]
    pub fn listing(&self) -> Option<String> {
        self.kernel.as_ref()?.as_ref().ok().map(|kernel| kernel.listing())
    }
}

/// The shaders of all materials of a scene.
#[derive(Debug)]
pub struct Shaders {
    shaders: Vec<Shader>,
    aovs: Vec<String>,
    host: Host,
    mode: ShadingMode,
    /// Every name that some script's `params()` has.
    parameters: BTreeSet<String>,
    /// The scene's, for scripts that name images.
    textures: Vec<Arc<Texture>>,
}

impl Shaders {
    /// Compiles and analyses all scripts of a scene. Warnings come beside the value.
    ///
    /// # Errors
    /// What the host could not register; every syntax error, missing `surface`, fault in `params()`, unknown or ill-typed parameter, and what the analysis
    /// finds to be certainly wrong (unknown inputs, outputs and parameters in code that may run), at its place.
    pub fn compile(scene: &Scene, host: &Host) -> Result<(Self, Diagnostics), Diagnostics> {
        Self::compile_for(scene, host, ShadingMode::Auto)
    }

    /// The same, with a say in how shaders are run.
    ///
    /// # Errors
    /// As [`compile`](Self::compile); and with [`ShadingMode::Kernel`], every construct that cannot be part of a kernel.
    pub fn compile_for(scene: &Scene, host: &Host, mode: ShadingMode) -> Result<(Self, Diagnostics), Diagnostics> {
        let engine = host.engine(&BTreeSet::new(), scene.textures());
        let mut faults = host.check().err().unwrap_or_default();
        let words = host.words();
        let mut keep = |result: Result<_, Diagnostics>| result.map_err(|found| faults.extend(found)).ok();

        let scripts: Vec<_> = scene
            .scripts()
            .iter()
            .map(|script| {
                keep(Program::parse(&script.source, scene.script_files(), &words).and_then(|program| {
                    let defaults = params::defaults(&program, &program.defaults(&engine)?)?;
                    Ok((Arc::new(program), Params(Arc::new(defaults))))
                }))
            })
            .collect();

        let textures: Arc<[Arc<Texture>]> = scene.textures().into();
        let natives: Arc<[NativeFunction]> = host.natives().cloned().collect();
        let mut shaders = Vec::new();
        for (index, material) in scene.materials().iter().enumerate() {
            let sets = scene.attributes().of_material(MaterialId::from_index(index));
            let attributes: Vec<_> = sets.keys().map(|set| &scene.attributes().sets()[*set as usize]).collect();
            let Some((program, defaults)) = &scripts[material.script.index()] else { continue };
            match params::resolve((*defaults.0).clone(), material, program) {
                Ok(params) => {
                    let analyse = |entry, attributes: &[&AttributeSet]| {
                        analysis::analyse_program(program, entry, &params, scene.textures(), attributes)
                    };
                    let mut analysis = analyse(Entry::Surface, &attributes);
                    let line = program.line.as_ref().map(|_| analyse(Entry::Line, &[]));
                    if let Some(line) = &line {
                        analysis.parameters.extend(line.parameters.iter().cloned());
                        if !line.complete {
                            analysis.parameters.extend(params.0.keys().cloned());
                        }
                    }
                    for finding in analysis.findings.iter().chain(line.iter().flat_map(|line| &line.findings)) {
                        let fault = program.found(finding);
                        // Materials that share a script share its faults.
                        if !faults.0.contains(&fault) {
                            faults.push(fault);
                        }
                    }
                    let mut shader = Shader {
                        name: material.name.clone(),
                        analysis,
                        record: ParameterRecord::new(&params, scene.textures()),
                        params,
                        defaults: defaults.clone(),
                        program: Arc::clone(program),
                        kernel: None,
                        line: line.map(|line| {
                            let opacity = !line.complete || line.output(OutputSet::OPACITY).may;
                            LineShader { opacity, kernel: None }
                        }),
                        other_kernels: Mutex::default(),
                        material_id: MaterialId::from_index(index).0 + 1,
                        light_count: scene.lights().len(),
                        textures: Arc::clone(&textures),
                        natives: Arc::clone(&natives),
                        attributes: Arc::clone(scene.attributes().sets()),
                    };
                    let lights = shader.light_count;
                    if mode != ShadingMode::Interpreter && !shader.analysis.is_constant() {
                        shader.kernel = Some(shader.lower(Entry::Surface, lights));
                    }
                    if mode != ShadingMode::Interpreter && shader.line.is_some() {
                        let kernel = Some(shader.lower(Entry::Line, lights));
                        shader.line.iter_mut().for_each(|line| line.kernel.clone_from(&kernel));
                    }
                    if mode == ShadingMode::Kernel {
                        for fault in shader.blame_diagnostic().into_iter().chain(shader.line_blame()) {
                            if !faults.0.contains(&fault) {
                                faults.push(fault);
                            }
                        }
                    }
                    shaders.push(shader);
                }
                Err(found) => faults.extend(found),
            }
        }
        if faults.has_errors() {
            return Err(faults);
        }
        let parameters = scripts.iter().flatten().flat_map(|(_, defaults)| defaults.0.keys().cloned()).collect();
        let aovs = extra_outputs(&shaders);
        let textures = scene.textures().to_vec();
        Ok((Self { shaders, aovs, host: host.clone(), mode, parameters, textures }, faults))
    }

    /// Compiles the scripts of another scene with the same host, and runs them in the same way.
    ///
    /// # Errors
    /// As [`compile_for`](Self::compile_for).
    pub fn compile_again(&self, scene: &Scene) -> Result<(Self, Diagnostics), Diagnostics> {
        Self::compile_for(scene, &self.host, self.mode)
    }

    /// All shaders, in the order of the materials.
    pub fn iter(&self) -> impl Iterator<Item = &Shader> {
        self.shaders.iter()
    }

    /// The shader of a material.
    #[must_use]
    pub fn of(&self, material: MaterialId) -> &Shader {
        &self.shaders[material.index()]
    }

    /// The shaders by material.
    #[must_use]
    pub fn all(&self) -> &[Shader] {
        &self.shaders
    }

    /// Names of all extra outputs of all shaders, without `aov_`, sorted.
    #[must_use]
    pub fn aovs(&self) -> &[String] {
        &self.aovs
    }

    /// An engine for one thread: an engine shared by two would make them wait for each other.
    pub(super) fn engine(&self) -> Engine {
        self.host.engine(&self.parameters, &self.textures)
    }
}

/// The names that the analysis knows, and where it is not complete, those written out in the script.
fn extra_outputs(shaders: &[Shader]) -> Vec<String> {
    let mut names = BTreeSet::new();
    for shader in shaders {
        names.extend(shader.analysis.aovs.iter().map(|(name, _)| name.clone()));
        if !shader.analysis.complete {
            names.extend(shader.program.written_aovs());
        }
    }
    names.into_iter().collect()
}
