//! What a study found, for people and programs: `index.html`, the plots by themselves and `study.json` beside `study.csv`.

mod crops;
mod figures;
mod methods;
mod page;
mod samplers;
pub mod summary;
mod svg;
mod widths;

use std::path::Path;

use serde_json::{Map, Value, json};

use super::folder::Folder;
use super::ladder::{Knob, METHODS, Settings, method_name};
use super::measure::{ByRegion, Errors};
use super::run::Study;
use crate::diag::Diagnostic;
use crate::film::write_atomically;
use crate::plan::filter_name;
use summary::{MEASURES, Mean, Point, STAGES, Summary};

/// Writes `study.json`, `index.html` and the folder `plots` into the folder of a study.
///
/// # Errors
/// If a file cannot be written.
pub fn write(study: &Study, folder: &Path) -> Result<(), Diagnostic> {
    let folder = Folder::open(folder)?;
    let summary = Summary::new(study);
    let text = format!("{:#}\n", json(study, &summary));
    write_atomically(&folder.file("study.json"), |sink| sink.write_all(text.as_bytes()))?;
    let (page, figures) = page::page(study, &summary, &folder);
    for (name, text) in &figures.files {
        write_atomically(&folder.plot(name), |sink| sink.write_all(text.as_bytes()))?;
    }
    write_atomically(&folder.file("index.html"), |sink| sink.write_all(page.as_bytes()))
}

/// All that was found, as one document.
#[must_use]
pub fn json(study: &Study, summary: &Summary) -> Value {
    let knobs = study.ladder.knobs.iter().map(|rungs| json!({ "name": rungs.knob.name(), "points": rungs.points }));
    let left_out = study.ladder.left_out.iter().map(|(knob, why)| (knob.name().to_owned(), json!(why)));
    let fits = [Knob::Samples, Knob::IdealSamples].iter().flat_map(|knob| {
        MEASURES.iter().filter_map(|measure| {
            let fit = summary.fit(study, *knob, measure)?;
            Some(json!({ "knob": knob.name(), "error": measure.name, "exponent": fit }))
        })
    });
    let of_samplers = MEASURES.iter().flat_map(|measure| {
        summary.sampler_fits(study, measure).into_iter().filter_map(|(sampler, fit)| {
            Some(json!({ "knob": "sampler", "sampler": sampler, "error": measure.name, "exponent": fit? }))
        })
    });
    let fronts = MEASURES.iter().map(|measure| {
        let front: Vec<usize> = summary.front(measure).iter().map(|point| point.index).collect();
        (measure.name.to_owned(), json!(front))
    });
    let presets = study.ladder.presets.iter().map(|(quality, point)| {
        let behind = MEASURES.iter().filter_map(|measure| {
            let behind = summary.behind_front(*point, measure);
            behind.is_finite().then(|| (measure.name.to_owned(), json!(behind)))
        });
        json!({ "name": quality.name(), "point": point, "behind_front": behind.collect::<Map<_, _>>() })
    });
    let methods = summary.equal_times(study, &methods::COMPARED).into_iter().map(|time| {
        let of_methods = |errors: &[Option<f64>; METHODS.len()]| {
            METHODS
                .iter()
                .zip(errors)
                .map(|(method, error)| (method_name(*method).to_owned(), json!(error)))
                .collect::<Map<_, _>>()
        };
        let errors = methods::COMPARED.iter().zip(&time.errors);
        let errors: Map<_, _> =
            errors.map(|(measure, errors)| (measure.name.to_owned(), of_methods(errors).into())).collect();
        json!({ "samples_of_exact": time.samples, "cpu_seconds": time.seconds, "errors": errors })
    });
    let threads = study.runs.iter().flatten().next().map(|run| run.threads);
    json!({
        "scene": study.title,
        "size": study.size,
        "version": env!("CARGO_PKG_VERSION"),
        "threads": threads,
        "complete": study.complete,
        "left_out_for_time": study.left_out,
        "reference": {
            "samples": study.reference,
            "truth": study.truth,
            "settings": settings(&study.ladder.ideal),
            "own_errors": errors(std::slice::from_ref(&study.own)),
        },
        "knobs": knobs.collect::<Vec<_>>(),
        "knobs_that_do_not_matter": left_out.collect::<Map<_, _>>(),
        "points": summary.points.iter().map(point).collect::<Vec<_>>(),
        "fits": fits.chain(of_samplers).collect::<Vec<_>>(),
        "fronts": fronts.collect::<Map<_, _>>(),
        "presets": presets.collect::<Vec<_>>(),
        "methods_in_equal_time": methods.collect::<Vec<_>>(),
        "drawn_widths": study.widths,
    })
}

fn point(point: &Point) -> Value {
    let stages: Map<_, _> =
        STAGES.iter().zip(point.stages).map(|(name, value)| ((*name).to_owned(), json!(value))).collect();
    json!({
        "point": point.index,
        "name": point.name,
        "settings": settings(&point.settings),
        "runs": point.runs,
        "wall_seconds": point.wall,
        "cpu_seconds": point.cpu,
        "cpu_seconds_by_stage": stages,
        "bytes_per_sample": point.bytes_per_sample,
        "peak_rss_bytes": point.peak,
        "errors": errors(&point.errors),
    })
}

fn settings(settings: &Settings) -> Value {
    // As numbers of the scene file read, not as their nearest doubles.
    let short = |value: f32| value.to_string().parse::<f64>().unwrap_or_else(|_| value.into());
    json!({
        "samples": settings.samples,
        "line_oversampling": settings.line_oversampling,
        "sampler": settings.sampler.name(),
        "method": method_name(settings.method),
        "min_width": short(settings.min_width),
        "width_compensation": settings.width_compensation,
        "surfaces": settings.surfaces,
        "reflection_depth": settings.reflection_depth,
        "refraction_depth": settings.refraction_depth,
        "filter": filter_name(settings.filter),
        "filter_radius": short(settings.filter_radius),
    })
}

/// Errors of several runs: means and deviations.
fn errors(all: &[Errors]) -> Value {
    let mean = |of: &dyn Fn(&Errors) -> Option<f64>| Mean::of(&all.iter().filter_map(of).collect::<Vec<_>>());
    let regions = |of: fn(&Errors) -> &ByRegion| {
        let [all, lines, reflections, rest] = [0, 1, 2, 3].map(|part: usize| mean(&|errors| of(errors).parts()[part]));
        json!({ "all": all, "lines": lines, "reflections": reflections, "rest": rest })
    };
    json!({
        "line_coverage": mean(&|errors| errors.coverage),
        "line_crossings": mean(&|errors| errors.crossings),
        "line_position": mean(&|errors| errors.position),
        "flip": regions(|errors| &errors.flip),
        "rmse": regions(|errors| &errors.rmse),
    })
}
