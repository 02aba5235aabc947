//! Restyling: new line attributes for the hits of one material, from a record of what the rays met.
//!
//! Only the slice of the shader for lines and features is run, and only at hits of that material; colours and the ray
//! trees stay as they are. Where that is not certain to give what tracing afresh would give, nothing is done and the
//! caller has the tile shaded again.

use super::ray_tree::{Run, TreeNode, WaveHit, WaveRay};
use super::record::TileRecord;
use super::scatter::Outputs;
use super::wave::{RayCounts, TileTracer, TraceContext, Work};
use crate::clock::CpuClock;
use crate::plan::LINE_SLICE;
use crate::sample::SampleBuffer;
use crate::scene::ids::MaterialId;
use crate::shade::{InputSet, Mode, PathKind, Shaders};

/// Hits that are shaded together.
const GROUP: usize = 4096;

/// What restyling a tile cost.
#[derive(Clone, Copy, Debug, Default)]
pub struct Restyled {
    /// Whether any attribute differs from before.
    pub changed: bool,
    /// Hits that were shaded.
    pub hits: u64,
    /// Rays traced: towards lights that nobody had asked about before.
    pub rays: RayCounts,
    /// Seconds spent in the shader.
    pub seconds: f64,
}

impl TileTracer<'_> {
    /// Gives the hits of a material in a tile their line and feature attributes again. `None` if the gate or a script would
    /// have to be heard: then the tile must be shaded again, and its samples hold anything until then.
    pub fn restyle(
        &self,
        material: MaterialId,
        shaders: &Shaders,
        samples: &mut SampleBuffer,
        record: &TileRecord,
        context: &mut TraceContext<'_>,
    ) -> Option<Restyled> {
        let shader = material.0 + 1;
        let clean = |samples: &SampleBuffer| {
            samples.gate.get(shader as usize).is_none_or(|counts| *counts == Default::default())
        };
        if self.plan.surfaces > 1 || !clean(samples) {
            return None;
        }
        let plan = &self.plan.materials[material.index()];
        let wanted = plan.wanted & LINE_SLICE;
        let constant = plan.mode == Mode::Constant;
        let inputs = if constant { InputSet::empty() } else { shaders.of(material).needs(wanted) };
        let lit = plan.lights && inputs.intersects(InputSet::LIGHTS);
        if lit && !self.plan.bodies.is_empty() {
            // Shadow rays start farther from where bodies touch.
            return None;
        }
        let errors = context.errors.hits();
        let mut work = Work { known: Some(record), ..Work::new(self.scene.materials().len()) };
        let mut restyled = Restyled::default();
        for path in 0..samples.paths.len() {
            let nodes = &samples.paths[path];
            let rows: Vec<u32> =
                (0..nodes.rows.len() as u32).filter(|row| nodes.shader.get(*row as usize) == shader).collect();
            let mut attributes = Vec::with_capacity(rows.len());
            for rows in rows.chunks(GROUP) {
                let (run, group) = self.recorded_hits(samples, path, rows, record)?;
                let lights =
                    if lit { self.light_samples(&group, &run.nodes, None, context, &mut work) } else { Vec::new() };
                let clock = CpuClock::thread();
                if constant {
                    self.evaluate_once(material, context);
                } else {
                    self.evaluate(material, &group, &run, &lights, (wanted, inputs), context);
                }
                restyled.seconds += clock.seconds();
                let batch = match &context.constants[material.index()] {
                    Some(outputs) if constant => outputs,
                    _ => &context.outputs,
                };
                attributes.extend(group.iter().enumerate().map(|(index, hit)| {
                    let outputs = Outputs { batch, row: if constant { 0 } else { index } };
                    self.attributes(hit, run.nodes[hit.ray.node as usize].cone, outputs)
                }));
            }
            restyled.hits += rows.len() as u64;
            restyled.changed |= samples.restyle(path, &rows, &attributes, &self.plan.layout)?;
        }
        restyled.rays = work.rays;
        (context.errors.hits() == errors).then_some(restyled)
    }

    /// Rows of a tile's nodes at a path (by number) as hits that can be shaded.
    fn recorded_hits(
        &self,
        samples: &SampleBuffer,
        path: usize,
        rows: &[u32],
        record: &TileRecord,
    ) -> Option<(Run, Vec<WaveHit>)> {
        let nodes = &samples.paths[path];
        let mut run = Run::default();
        let mut group = Vec::with_capacity(rows.len());
        for (index, row) in rows.iter().enumerate() {
            let sample = nodes.rows.sample(*row as usize);
            let known = record.node(nodes.path, sample)?;
            let hit = known.hit?;
            let mut node = TreeNode { path: nodes.path, ..TreeNode::root(sample, self.cone) };
            let (origin, direction) = match known.start {
                Some(start) => {
                    node.kind = if nodes.path.ends_reflected()? { PathKind::Reflection } else { PathKind::Refraction };
                    node.cone = start.cone;
                    node.length_before = start.length_before;
                    (start.origin, start.direction)
                }
                None => {
                    let pixel = samples.pixel_of(sample);
                    let offset = self.positions.offset(pixel, sample % samples.samples_per_pixel);
                    self.rays.ray(pixel, offset)
                }
            };
            let ray = WaveRay { origin, direction, node: index as u32, after: None, passed: 0, media: 0, counted: 0 };
            group.push(self.wave_hit(&ray, &hit, &node, 0));
            run.nodes.push(node);
        }
        Some((run, group))
    }
}
