//! What is wrong with a shader, what is questionable, and what the renderer makes of it.
//!
//! 1. The script is compiled and analysed: [`Shaders::compile`] reports all that is certainly wrong.
//! 2. It is run over [synthetic hits](super::synthetic), which shows what only running can: arguments of the wrong type,
//!    loops without an end, NaN.
//! 3. `lint` reads its syntax tree for what has no effect or another one than meant; `facts` draws conclusions from the
//!    analysis and the trial.
//! 4. The rest of the facts is the [`Report`].
//!
//! Warnings are few on purpose: each is about something that a reader of the script would want to change.

mod facts;
mod lint;
mod report;

use std::collections::BTreeMap;
use std::sync::Arc;

pub use report::Report;
pub(crate) use report::input_names;

use super::batch::OutputBatch;
use super::fault::OUT_OF_OPERATIONS;
use super::interpret::{ShadeErrors, Shading};
use super::line::LineStyles;
use super::measure;
use super::names::OutputSet;
use super::program::{Mode, Shaders};
use super::{Host, synthetic};
use crate::diag::{Diagnostic, Diagnostics, Source};
use crate::scene::camera::{Camera, Projection};
use crate::scene::ids::MaterialId;
use crate::scene::material::{Material, Script};
use crate::scene::{Scene, SceneBuilder};

/// Hits that a shader is tried on.
pub const TRIAL_HITS: usize = 256;
/// Measurements of its cost.
const REPEATS: usize = 5;

/// What was found in a shader.
#[derive(Clone, Debug, Default)]
pub struct Check {
    /// Errors first, then warnings, each by place.
    pub diagnostics: Diagnostics,
    /// What the renderer makes of it; `None` if it cannot be compiled.
    pub report: Option<Report>,
}

impl Check {
    /// The check of a shader that cannot be loaded.
    #[must_use]
    pub fn failed(diagnostics: Diagnostics) -> Self {
        Self { diagnostics, report: None }
    }
}

/// Checks a script by itself, with the defaults of its parameters.
#[must_use]
pub fn check_script(source: &Arc<Source>, host: &Host) -> Check {
    match scene_of(source) {
        Ok((scene, material)) => check(&scene, material, host),
        Err(faults) => Check::failed(faults),
    }
}

/// Checks the shader of a material, with its parameters. Other materials of the scene must compile.
#[must_use]
pub fn check(scene: &Scene, material: MaterialId, host: &Host) -> Check {
    let (shaders, warnings) = match Shaders::compile(scene, host) {
        Ok(compiled) => compiled,
        Err(mut faults) => {
            // Which material it is helps nobody who checks a shader.
            let about = format!("the material is `{}`", scene.materials()[material.index()].name);
            faults.0.iter_mut().for_each(|fault| fault.hints.retain(|hint| *hint != about));
            return Check::failed(in_order(faults));
        }
    };
    let shader = shaders.of(material);
    let trial = Trial::run(scene, &shaders, material);
    let cost = (shader.mode() != Mode::Constant && trial.errors.is_empty()).then(|| {
        let hits = synthetic::hits(TRIAL_HITS, 0);
        measure::nanoseconds_per_hit(&mut Shading::new(scene, &shaders), material, &hits, REPEATS)
    });
    let mut diagnostics = warnings;
    diagnostics.extend(trial.errors.clone());
    diagnostics.extend(lint::lint(shader));
    // A shader that fails has given no values to judge by, and has other worries.
    if trial.errors.is_empty() {
        diagnostics.extend(facts::warnings(shader, &scene.materials()[material.index()], &trial, cost));
    }
    Check { diagnostics: in_order(diagnostics), report: Some(Report::new(shader, cost, trial.interpreted)) }
}

/// A scene of nothing but a script's material.
fn scene_of(source: &Arc<Source>) -> Result<(Scene, MaterialId), Diagnostics> {
    let projection = Projection::Orthographic { height: 1.0 };
    let camera =
        Camera::look_at("camera", projection, crate::math::DVec3::Z, Default::default(), crate::math::DVec3::Y)?;
    let mut scene = SceneBuilder { cameras: vec![camera], ..SceneBuilder::default() };
    let script = scene.add_script(Script { source: Arc::clone(source), path: None });
    let material = scene.add_material(Material {
        name: "shader".into(),
        script,
        params: BTreeMap::new(),
        priority: None,
        dielectric_priority: 0,
        double_sided: true,
        lines: Default::default(),
        span: None,
    });
    Ok((scene.build()?, material))
}

/// What came of running a shader over synthetic hits.
struct Trial {
    errors: Diagnostics,
    outputs: OutputBatch,
    /// Names of the extra outputs, in the order of their columns.
    aovs: Vec<String>,
    /// What its `line`, if there is one, makes of synthetic lines.
    styles: LineStyles,
    /// How many hits the interpreter was run for.
    interpreted: u64,
}

impl Trial {
    fn run(scene: &Scene, shaders: &Shaders, material: MaterialId) -> Self {
        let (mut outputs, mut errors) = (OutputBatch::default(), ShadeErrors::default());
        let hits = synthetic::hits(TRIAL_HITS, 0);
        let mut shading = Shading::new(scene, shaders);
        shading.shade(material, &hits, OutputSet::all(), &mut outputs, &mut errors);
        let interpreted = shading.evaluations();
        let mut styles = LineStyles::default();
        if shaders.of(material).styles_lines() {
            shading.style(material, &synthetic::pairs(TRIAL_HITS, 0), &mut styles, &mut errors);
        }
        let errors = errors.errors.into_values().map(|(fault, count)| match count {
            // A shader that ran out of operations is not run again, so the count says nothing.
            n if n < TRIAL_HITS as u64 && !fault.message.starts_with(OUT_OF_OPERATIONS) => {
                fault.hint(format!("this happened at {n} of {TRIAL_HITS} trial hits"))
            }
            _ => fault,
        });
        Self { errors: Diagnostics(errors.collect()), outputs, aovs: shaders.aovs().to_vec(), styles, interpreted }
    }
}

/// Errors before warnings, each by place; what has none comes last.
fn in_order(mut diagnostics: Diagnostics) -> Diagnostics {
    let key = |diagnostic: &Diagnostic| {
        let start = diagnostic.span.as_ref().map_or(usize::MAX, |span| span.range.start);
        (std::cmp::Reverse(diagnostic.severity), start)
    };
    diagnostics.0.sort_by_key(key);
    diagnostics.0.dedup();
    diagnostics
}
