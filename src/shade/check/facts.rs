//! Warnings from what is known of a shader's outputs and parameters, and from its trial.

use super::{TRIAL_HITS, Trial};
use crate::diag::{Diagnostic, Diagnostics, Severity, Span};
use crate::math::Vec3;
use crate::scene::material::Material;
use crate::shade::batch::OutputBatch;
use crate::shade::names::{AOV_PREFIX, OutputSet};
use crate::shade::params::MAX_LINE_WIDTH;
use crate::shade::program::Shader;

/// A width in pixels up to which a bound tells something: bounds from inputs without limits lie far above.
const USEFUL_BOUND: f32 = 1024.0;

/// Warnings about a shader whose trial had no errors.
pub(super) fn warnings(shader: &Shader, material: &Material, trial: &Trial, cost: Option<f64>) -> Diagnostics {
    let mut warnings = Diagnostics::default();
    nan(shader, trial, &mut warnings);
    nan_styles(shader, trial, &mut warnings);
    line_width(shader, trial, &mut warnings);
    without_effect(shader, material, &mut warnings);
    let interpreted = |what: &str, fault: Diagnostic| Diagnostic {
        severity: Severity::Warning,
        message: format!("{what} is interpreted: {}", fault.message),
        ..fault
    };
    if let Some(fault) = shader.blame_diagnostic() {
        let warning = interpreted("this shader", fault);
        warnings.push(match cost {
            Some(cost) => warning.hint(format!("it costs {cost:.0} ns a hit")),
            None => warning,
        });
    }
    if let Some(fault) = shader.line_blame() {
        warnings.push(interpreted("`line`", fault));
    }
    warnings
}

/// Colours and opacities of lines that are no numbers.
fn nan_styles(shader: &Shader, trial: &Trial, warnings: &mut Diagnostics) {
    let colors = trial.styles.color.iter().flatten().filter(|color| color.is_nan()).count();
    let opacities = trial.styles.opacity.iter().filter(|opacity| opacity.is_nan()).count();
    for (key, count) in [("color", colors), ("opacity", opacities)].into_iter().filter(|(_, count)| *count > 0) {
        let span = shader.program.line.as_ref().unwrap_or(&shader.program.surface).span.clone();
        let warning =
            Diagnostic::warning(format!("the `{key}` of `line` is NaN at {count} of {TRIAL_HITS} trial lines"));
        warnings
            .push(warning.at(span).hint("NaN counts as 0: look for 0/0, and for sqrt, ln or pow of negative numbers"));
    }
}

/// Where an output's key stands.
fn key_span(shader: &Shader, key: &str) -> Span {
    shader.program.key_span(key).unwrap_or_else(|| shader.program.surface.span.clone())
}

fn nan(shader: &Shader, trial: &Trial, warnings: &mut Diagnostics) {
    let extra = trial.outputs.aovs.iter().zip(&trial.aovs);
    let extra =
        extra.map(|(column, name)| (format!("{AOV_PREFIX}{name}"), column.iter().filter(|v| v.is_nan()).count()));
    let named = OutputSet::named().map(|(name, output)| (name.to_owned(), nan_rows(&trial.outputs, output)));
    for (key, count) in named.chain(extra).filter(|(_, count)| *count > 0) {
        let message = match count {
            n if n >= trial.outputs.len => format!("the output `{key}` is NaN at all {TRIAL_HITS} trial hits"),
            n => format!("the output `{key}` is NaN at {n} of {TRIAL_HITS} trial hits"),
        };
        let warning = Diagnostic::warning(message).at(key_span(shader, &key));
        warnings.push(warning.hint("NaN counts as 0: look for 0/0, and for sqrt, ln or pow of negative numbers"));
    }
}

/// How many rows of a column are NaN.
fn nan_rows(outputs: &OutputBatch, output: OutputSet) -> usize {
    let numbers = |column: &[f32]| column.iter().filter(|x| x.is_nan()).count();
    let vectors = |column: &[Vec3]| column.iter().filter(|v| v.is_nan()).count();
    let perhaps = |column: &[Option<Vec3>]| column.iter().flatten().filter(|v| v.is_nan()).count();
    match output {
        OutputSet::BASE_COLOR => vectors(&outputs.base_color),
        OutputSet::METALLIC => numbers(&outputs.metallic),
        OutputSet::ROUGHNESS => numbers(&outputs.roughness),
        OutputSet::SPECULAR => numbers(&outputs.specular),
        OutputSet::IOR => numbers(&outputs.ior),
        OutputSet::TRANSMISSION => numbers(&outputs.transmission),
        OutputSet::OPACITY => numbers(&outputs.opacity),
        OutputSet::EMISSION => vectors(&outputs.emission),
        OutputSet::NORMAL => perhaps(&outputs.normal),
        OutputSet::OCCLUSION => numbers(&outputs.occlusion),
        OutputSet::FEATURE => vectors(&outputs.feature),
        OutputSet::LINE_COLOR => perhaps(&outputs.line_color),
        OutputSet::LINE_WIDTH => outputs.line_width.iter().flatten().filter(|x| x.is_nan()).count(),
        OutputSet::COLOR => perhaps(&outputs.color),
        OutputSet::LINE_OPACITY => numbers(&outputs.line_opacity),
        _ => 0,
    }
}

/// Widths that draw nothing, have no known bound, or break the declared one.
fn line_width(shader: &Shader, trial: &Trial, warnings: &mut Diagnostics) {
    let fact = shader.analysis().output(OutputSet::LINE_WIDTH);
    let complete = shader.analysis().complete;
    let declared = shader.params().max_line_width();
    let high = fact.range.map(|range| range[1]);
    let declaration = || key_span(shader, MAX_LINE_WIDTH);
    let mut warn = |message: String, span: Span, hint: String| {
        warnings.push(Diagnostic::warning(message).at(span).hint(hint));
    };
    if !fact.may {
        if declared.is_some() {
            warn(
                format!("`{MAX_LINE_WIDTH}` is declared, but the shader gives no `line_width`"),
                declaration(),
                "lines then have the scene's width, and it bounds that".into(),
            );
        }
        return;
    }
    if high.is_some_and(|high| high <= 0.0) {
        warn(
            "`line_width` is never above 0: this shader draws no lines".into(),
            key_span(shader, "line_width"),
            "widths are in pixels".into(),
        );
        return;
    }
    let Some(declared) = declared else {
        if !high.is_some_and(|high| high <= USEFUL_BOUND) && complete {
            warn(
                "no upper bound of `line_width` is known, so tiles are rendered with room for the widest line of all"
                    .into(),
                key_span(shader, "line_width"),
                format!("limit it with `clamp` or `min`, or declare its bound in `params()`: {MAX_LINE_WIDTH}: 8.0"),
            );
        }
        return;
    };
    let widest = widest(&trial.outputs);
    // What the analysis knows for certain, or else what a trial has shown.
    let proved = fact.range.map(|range| range[0]).filter(|low| *low > declared);
    if let Some(width) = proved.or_else(|| widest.filter(|widest| *widest > declared)) {
        let how = if proved.is_some() { "is always at least" } else { "reaches" };
        warn(
            format!("`line_width` {how} {} px, more than the {declared} px that are declared", rounded(width)),
            declaration(),
            format!("wider lines are drawn {declared} px wide: raise `{MAX_LINE_WIDTH}` if they are meant"),
        );
    }
}

/// The widest line of a trial.
fn widest(outputs: &OutputBatch) -> Option<f32> {
    outputs.line_width.iter().flatten().copied().filter(|width| width.is_finite()).reduce(f32::max)
}

/// To three digits behind the point.
fn rounded(x: f32) -> f32 {
    (x * 1e3).round() / 1e3
}

/// Parameters that were given a value which nothing reads under these parameters.
fn without_effect(shader: &Shader, material: &Material, warnings: &mut Diagnostics) {
    let analysis = shader.analysis();
    if !analysis.complete {
        return;
    }
    for (name, (_, span)) in &material.params {
        if analysis.parameters.contains(name) || name == MAX_LINE_WIDTH {
            continue;
        }
        let warning = Diagnostic::warning(format!("setting `{name}` has no effect: nothing that may run reads it"));
        let hint = "other parameters may switch it off, or the shader does not use it";
        warnings.push(warning.at(span.clone().unwrap_or_else(|| shader.program.params_span())).hint(hint));
    }
}
