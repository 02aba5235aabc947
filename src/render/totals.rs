//! What the tiles of a picture cost and came to, summed.

use super::Report;
use super::stats::{Lines, Seconds, ShaderStats, Stats, peak_memory};
use crate::diag::{Diagnostic, Diagnostics};
use crate::line::{LineBuffer, LineCounts, TileBounds};
use crate::plan::Plan;
use crate::sample::{GateCounts, SampleBuffer};
use crate::scene::Scene;
use crate::scene::ids::MaterialId;
use crate::shade::{ShadeErrors, Shaders};
use crate::trace::{RayCounts, TracedTile};

/// Sums over tiles.
#[derive(Debug)]
pub(crate) struct Totals {
    pub seconds: Seconds,
    pub rays: RayCounts,
    /// Hits shaded, by material.
    pub hits: Vec<u64>,
    pub shade_seconds: Vec<f64>,
    /// Wall time that threads spent on jobs: more than CPU time where they had to wait for a CPU.
    pub busy_seconds: f64,
    lines: LineCounts,
    surfaces_behind: u64,
    pub samples: u64,
    bytes: u64,
    /// By material, misses first.
    gate: Vec<GateCounts>,
}

impl Totals {
    pub fn new(materials: usize) -> Self {
        Self {
            seconds: Seconds::default(),
            rays: RayCounts::default(),
            hits: vec![0; materials],
            shade_seconds: vec![0.0; materials],
            busy_seconds: 0.0,
            lines: LineCounts::default(),
            surfaces_behind: 0,
            samples: 0,
            bytes: 0,
            gate: vec![GateCounts::default(); materials + 1],
        }
    }

    /// Adds what tracing a tile cost.
    pub fn add_traced(&mut self, traced: &TracedTile) {
        let shading: f64 = traced.shade_seconds.iter().sum();
        self.seconds.trace += traced.seconds - shading;
        self.seconds.shade += shading;
        self.rays += traced.rays;
        self.hits.iter_mut().zip(&traced.hits).for_each(|(total, hits)| *total += hits);
        self.shade_seconds.iter_mut().zip(&traced.shade_seconds).for_each(|(total, seconds)| *total += seconds);
    }

    /// Adds what is in a tile.
    pub fn add_samples(&mut self, samples: &SampleBuffer, bounds: Option<&TileBounds>) {
        self.samples += samples.samples() as u64;
        self.surfaces_behind += samples.surfaces_behind() as u64;
        self.bytes += (samples.bytes() + bounds.map_or(0, TileBounds::bytes)) as u64;
        self.gate.iter_mut().zip(&samples.gate).for_each(|(total, gate)| *total += *gate);
    }

    /// Adds a tile's lines.
    pub fn add_lines(&mut self, lines: &LineBuffer) {
        self.lines += lines.counts;
        self.gate.iter_mut().zip(&lines.gate).for_each(|(total, gate)| *total += *gate);
    }

    /// The sums as a report. To be called on the threads that did the work.
    pub fn report(self, scene: &Scene, shaders: &Shaders, plan: &Plan, errors: ShadeErrors, complete: bool) -> Report {
        let gate = self.gate.iter().fold(GateCounts::default(), |mut sum, counts| {
            sum += *counts;
            sum
        });
        let of_shaders = scene
            .materials()
            .iter()
            .enumerate()
            .map(|(index, material)| ShaderStats {
                name: material.name.clone(),
                mode: shaders.of(MaterialId::from_index(index)).mode().name(),
                hits: self.hits[index],
                seconds: self.shade_seconds[index],
            })
            .collect();
        Report {
            stats: Stats {
                seconds: self.seconds,
                threads: rayon::current_num_threads(),
                rays: self.rays.into(),
                samples: self.samples,
                bytes_per_sample: self.bytes as f64 / (self.samples as f64).max(1.0),
                lines: Lines::new(self.lines, self.surfaces_behind, gate),
                gate: gate.into(),
                peak_rss_bytes: peak_memory(),
                triangles: scene.triangle_count(),
                shaders: of_shaders,
                plan: plan.to_string(),
                sampling: None,
            },
            script_errors: errors.into_diagnostics(),
            warnings: gate_warnings(scene, shaders, &self.gate),
            complete,
            written: false,
        }
    }
}

/// What the gate stopped, as a warning for each material and kind.
fn gate_warnings(scene: &Scene, shaders: &Shaders, gate: &[GateCounts]) -> Diagnostics {
    let mut warnings = Diagnostics::default();
    let materials = scene.materials().iter().zip(shaders.iter());
    for ((material, shader), counts) in materials.zip(gate.get(1..).unwrap_or_default()) {
        let script = &scene.scripts()[material.script.index()].source.name;
        let mut warn = |count: u64, what: &str, hint: String| {
            if count > 0 {
                let plural = if count == 1 { "" } else { "s" };
                warnings.push(
                    Diagnostic::warning(format!(
                        "{script}: the shader of material `{}` gave {what} at {count} hit{plural}",
                        material.name
                    ))
                    .hint(hint),
                );
            }
        };
        warn(counts.nan, "NaN", "NaN counts as 0; look for 0/0, sqrt or ln of negative numbers".into());
        warn(counts.infinite, "an infinite number", "infinity counts as 0; look for divisions by 0".into());
        warn(counts.negative, "a negative line width", "a width of 0 or less draws no line".into());
        let max_width = scene.lines().max_width;
        let declared = shader.params().max_line_width().filter(|declared| *declared < max_width);
        let (name, limit, place) = match declared {
            Some(declared) => ("max_line_width", declared, "the shader's `params()`"),
            None => ("max_width", max_width, "[lines]"),
        };
        warn(
            counts.clamped_widths,
            &format!("a line wider than {name} ({limit} px)"),
            format!("wider lines are drawn at {name}; raise it in {place} if they are meant"),
        );
    }
    warnings
}
