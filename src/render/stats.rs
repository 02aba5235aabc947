//! What a picture cost: the contents of `--stats` (DESIGN section 12, normative names).

use serde::Serialize;

use super::oversample::Oversampled;
use super::refine::Refinement;
use super::timed::Choice;
use crate::line::LineCounts;
use crate::sample::GateCounts;
use crate::trace::RayCounts;

/// What a picture cost.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Stats {
    /// Seconds by stage.
    pub seconds: Seconds,
    /// Threads that rendered.
    pub threads: usize,
    /// Rays by kind.
    pub rays: Rays,
    /// Camera samples.
    pub samples: u64,
    /// Mean size of a sample in memory, with what the line pass prepares for its search.
    pub bytes_per_sample: f64,
    /// The line pass.
    pub lines: Lines,
    /// What the gate stopped.
    pub gate: Gate,
    /// Most memory the process ever held; `null` where the system does not tell.
    pub peak_rss_bytes: Option<u64>,
    /// Triangles in all meshes, each mesh counted once.
    pub triangles: usize,
    /// What each shader cost.
    pub shaders: Vec<ShaderStats>,
    /// The plan, as `tusche explain` prints it.
    pub plan: String,
    /// How the samples were chosen, where they are not as many everywhere as the scene or `--samples` says.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sampling: Option<Sampling>,
}

/// How the samples were chosen.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Sampling {
    /// By `--time`.
    Time(Choice),
    /// By `--error`.
    Error(Refinement),
    /// By `line_oversampling`: more where lines are.
    Lines(Oversampled),
}

/// `total` is wall time; the others are CPU seconds summed over threads. Those of `load` and `build` count all that the
/// process does meanwhile.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Seconds {
    /// From start to finished files.
    pub total: f64,
    /// Reading scene, models, textures and scripts.
    pub load: f64,
    /// Building hierarchies.
    pub build: f64,
    /// Tracing rays, and what else a tile needs but shaders.
    pub trace: f64,
    /// Running shaders.
    pub shade: f64,
    /// The line pass.
    pub lines: f64,
    /// Pixel filter and files.
    pub film: f64,
}

/// Rays by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[allow(missing_docs, reason = "the names say it; see RayCounts")]
pub struct Rays {
    pub camera: u64,
    pub spared: u64,
    pub shadow: u64,
    pub reflection: u64,
    pub refraction: u64,
}

impl From<RayCounts> for Rays {
    fn from(RayCounts { camera, spared, shadow, reflection, refraction }: RayCounts) -> Self {
        Self { camera, spared, shadow, reflection, refraction }
    }
}

/// The line pass.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Lines {
    /// Pairs of samples that were compared.
    pub pairs_tested: u64,
    /// Samples that see a line.
    pub lined_samples: u64,
    /// Of those, samples that see the line of a hidden surface.
    pub hidden_samples: u64,
    /// Surfaces that were kept behind the first ones of rays.
    pub surfaces_behind: u64,
    /// Nodes whose line width was clamped to `max_width`.
    pub clamped_widths: u64,
}

impl Lines {
    pub(super) fn new(counts: LineCounts, surfaces_behind: u64, gate: GateCounts) -> Self {
        Self {
            pairs_tested: counts.pairs_tested,
            lined_samples: counts.lined_samples,
            hidden_samples: counts.hidden_samples,
            surfaces_behind,
            clamped_widths: gate.clamped_widths,
        }
    }
}

/// What the gate stopped.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Gate {
    /// Nodes with a NaN.
    pub nan: u64,
    /// Nodes with an infinity.
    pub infinite: u64,
    /// Nodes with a negative line width.
    pub negative: u64,
}

impl From<GateCounts> for Gate {
    fn from(GateCounts { nan, infinite, negative, .. }: GateCounts) -> Self {
        Self { nan, infinite, negative }
    }
}

/// What one material's shader cost.
#[derive(Clone, Debug, Serialize)]
pub struct ShaderStats {
    /// The material's name.
    pub name: String,
    /// `constant` or `interpreted`.
    pub mode: &'static str,
    /// Hits that took its outputs.
    pub hits: u64,
    /// Seconds spent running it.
    pub seconds: f64,
}

/// The most memory this process ever held, if the system tells.
#[must_use]
pub fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}

/// Makes [`peak_memory`] begin anew, at what the process holds now; whether the system can do that (Linux can).
#[must_use]
pub fn reset_peak_memory() -> bool {
    std::fs::write("/proc/self/clear_refs", "5").is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_peak_is_forgotten_once_it_is_reset() {
        const MANY: usize = 256 << 20;
        let filled = std::hint::black_box(vec![1_u8; MANY]);
        let Some(with) = peak_memory() else { return };
        drop(filled);
        // The system counts pages by thread, and adds the counts up now and then.
        assert!(peak_memory().is_some_and(|still| still + (16 << 20) >= with), "a peak stays");
        if reset_peak_memory() {
            // Other tests of the process take memory meanwhile, but not that much.
            assert!(peak_memory().is_some_and(|now| now < with - MANY as u64 / 2));
        }
    }
}
