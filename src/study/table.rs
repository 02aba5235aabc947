//! `study.csv`: one row for each picture that was measured, from which all else can be made again.

use std::path::Path;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use super::ladder::{Settings, method_name};
use super::measure::{ByRegion, Errors};
use crate::diag::Diagnostic;
use crate::film::write_atomically;
use crate::plan::filter_name;
use crate::render::stats::Stats;

/// A picture that was measured: a row of `study.csv`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "the settings are those of `Settings`, the errors those of `Errors`")]
pub struct Run {
    /// Tells scenes apart: rows of another one are of no use.
    pub scene: String,
    /// Samples per pixel of the reference.
    pub reference: u32,
    pub samples: u32,
    #[serde(default = "one")]
    pub line_oversampling: u32,
    /// How they are spread over a pixel.
    pub sampler: String,
    pub method: String,
    pub min_width: f32,
    pub width_compensation: bool,
    pub surfaces: u32,
    pub reflection_depth: u32,
    pub refraction_depth: u32,
    pub filter: String,
    pub filter_radius: f32,
    /// Which repeat, from 0; each has a seed of its own.
    pub repeat: u32,
    pub threads: usize,
    /// From start to end.
    pub wall_seconds: f64,
    /// CPU seconds of building hierarchies, and so on for the other stages; summed over threads.
    pub build_seconds: f64,
    pub trace_seconds: f64,
    pub shade_seconds: f64,
    pub lines_seconds: f64,
    pub film_seconds: f64,
    /// Most memory that the process held meanwhile, where the system can tell.
    pub peak_rss_bytes: Option<u64>,
    pub bytes_per_sample: f64,
    pub rmse: f64,
    pub rmse_lines: Option<f64>,
    pub rmse_reflections: Option<f64>,
    pub rmse_rest: Option<f64>,
    pub flip: f64,
    pub flip_lines: Option<f64>,
    pub flip_reflections: Option<f64>,
    pub flip_rest: Option<f64>,
    pub line_coverage: Option<f64>,
    pub line_position: Option<f64>,
    pub line_crossings: Option<f64>,
}

/// In tables of before there was more.
fn one() -> u32 {
    1
}

impl Run {
    /// A row.
    #[must_use]
    pub fn new(identity: (&str, u32), settings: &Settings, repeat: u32, stats: &Stats, errors: &Errors) -> Self {
        let seconds = &stats.seconds;
        Self {
            scene: identity.0.to_owned(),
            reference: identity.1,
            samples: settings.samples,
            line_oversampling: settings.line_oversampling,
            sampler: settings.sampler.name().to_owned(),
            method: method_name(settings.method).to_owned(),
            min_width: settings.min_width,
            width_compensation: settings.width_compensation,
            surfaces: settings.surfaces,
            reflection_depth: settings.reflection_depth,
            refraction_depth: settings.refraction_depth,
            filter: filter_name(settings.filter).to_owned(),
            filter_radius: settings.filter_radius,
            repeat,
            threads: stats.threads,
            wall_seconds: seconds.total,
            build_seconds: seconds.build,
            trace_seconds: seconds.trace,
            shade_seconds: seconds.shade,
            lines_seconds: seconds.lines,
            film_seconds: seconds.film,
            peak_rss_bytes: stats.peak_rss_bytes,
            bytes_per_sample: stats.bytes_per_sample,
            rmse: errors.rmse.all,
            rmse_lines: errors.rmse.lines,
            rmse_reflections: errors.rmse.reflections,
            rmse_rest: errors.rmse.rest,
            flip: errors.flip.all,
            flip_lines: errors.flip.lines,
            flip_reflections: errors.flip.reflections,
            flip_rest: errors.flip.rest,
            line_coverage: errors.coverage,
            line_position: errors.position,
            line_crossings: errors.crossings,
        }
    }

    /// Whether it has these settings.
    #[must_use]
    pub fn is_of(&self, settings: &Settings) -> bool {
        self.samples == settings.samples
            && self.line_oversampling == settings.line_oversampling
            && self.sampler == settings.sampler.name()
            && self.method == method_name(settings.method)
            && self.min_width == settings.min_width
            && self.width_compensation == settings.width_compensation
            && self.surfaces == settings.surfaces
            && self.reflection_depth == settings.reflection_depth
            && self.refraction_depth == settings.refraction_depth
            && self.filter == filter_name(settings.filter)
            && self.filter_radius == settings.filter_radius
    }

    /// Its errors.
    #[must_use]
    pub fn errors(&self) -> Errors {
        Errors {
            rmse: ByRegion {
                all: self.rmse,
                lines: self.rmse_lines,
                reflections: self.rmse_reflections,
                rest: self.rmse_rest,
            },
            flip: ByRegion {
                all: self.flip,
                lines: self.flip_lines,
                reflections: self.flip_reflections,
                rest: self.flip_rest,
            },
            coverage: self.line_coverage,
            position: self.line_position,
            crossings: self.line_crossings,
        }
    }

    /// CPU seconds of tracing, shading, lines and film: what grows with the picture.
    #[must_use]
    pub fn cpu_seconds(&self) -> f64 {
        self.trace_seconds + self.shade_seconds + self.lines_seconds + self.film_seconds
    }
}

/// Reads a table; an absent one is empty.
///
/// # Errors
/// If it cannot be read, or is no table of a study.
pub fn read<T: DeserializeOwned>(path: &Path) -> Result<Vec<T>, Diagnostic> {
    let text = match std::fs::read(path) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(Diagnostic::error(format!("cannot read this file: {error}")).in_file(path)),
    };
    let text = String::from_utf8_lossy(&text);
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let runs = lines.enumerate().map(|(line, cells)| {
        let cells: Vec<&str> = cells.split(',').collect();
        let run = if cells.len() == names.len() {
            let row: Map<_, _> =
                names.iter().zip(cells).map(|(name, cell)| ((*name).to_owned(), value(cell))).collect();
            serde_json::from_value(row.into()).map_err(|error| error.to_string())
        } else {
            Err(format!("{} cells under {} names", cells.len(), names.len()))
        };
        run.map_err(|error| {
            let fault = Diagnostic::error(format!("this is no table of a study: {error} in line {}", line + 2));
            fault.in_file(path).hint("name another folder, or delete the file: all is then measured anew")
        })
    });
    runs.collect()
}

/// Writes a table.
///
/// # Errors
/// If the file cannot be written.
pub fn write<T: Serialize>(path: &Path, runs: &[T]) -> Result<(), Diagnostic> {
    let failed = |error: serde_json::Error| Diagnostic::error(format!("cannot write the table: {error}")).in_file(path);
    let mut text = String::new();
    for run in runs {
        // By way of text, so that a float gets its own digits and not those of a double.
        let row = serde_json::to_string(run).and_then(|row| serde_json::from_str::<Map<String, Value>>(&row));
        let row = row.map_err(failed)?;
        if text.is_empty() {
            text = row.keys().map(String::as_str).collect::<Vec<_>>().join(",") + "\n";
        }
        text += &(row.values().map(cell).collect::<Vec<_>>().join(",") + "\n");
    }
    write_atomically(path, |sink| sink.write_all(text.as_bytes()))
}

/// A value as a cell. There are only numbers, names without commas, and what is not there.
fn cell(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(name) => name.clone(),
        other => other.to_string(),
    }
}

fn value(cell: &str) -> Value {
    match cell {
        "" => Value::Null,
        cell => serde_json::from_str(cell).unwrap_or_else(|_| cell.into()),
    }
}
