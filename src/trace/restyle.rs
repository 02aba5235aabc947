//! Restyling: new line attributes for the hits of one material, from a record of what the rays met.
//!
//! Only the slice of the shader for lines and features is run, and only at hits of that material; colours and the ray
//! trees stay as they are. Where that is not certain to give what tracing afresh would give, nothing is done and the
//! caller has the tile shaded again.

use super::ray_tree::{Run, TreeNode, WaveHit, WaveRay};
use super::record::TileRecord;
use super::scatter::Outputs;
use super::wave::{RayCounts, TileTracer, TraceContext, Work};
use super::world::Hit;
use crate::clock::CpuClock;
use crate::plan::LINE_SLICE;
use crate::sample::{Node, NodeColumns, NodePath, PixelRect, SampleBuffer};
use crate::scene::ids::{MaterialId, ObjectId};
use crate::shade::{InputSet, Mode, PathKind, Shaders};

/// Hits that are shaded together.
const GROUP: usize = 4096;

/// What restyling a tile cost.
#[derive(Clone, Copy, Debug, Default)]
pub struct Restyled {
    /// The pixels outside which no attribute differs from before.
    pub changed: Option<PixelRect>,
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
        // What the gate stopped would have to be counted anew.
        let clean = |samples: &SampleBuffer| {
            samples.gate.get(shader as usize).is_none_or(|counts| *counts == Default::default())
        };
        if !clean(samples) {
            return None;
        }
        let plan = &self.plan.materials[material.index()];
        let constant = plan.mode == Mode::Constant;
        // What is asked of first hits, and of those behind them.
        let slices = [plan.wanted, plan.behind.wanted].map(|wanted| {
            let wanted = wanted & LINE_SLICE;
            let inputs = if constant { InputSet::empty() } else { shaders.of(material).needs(wanted) };
            (wanted, inputs, plan.lights && inputs.intersects(InputSet::LIGHTS))
        });
        if slices[0].2 && !self.plan.bodies.is_empty() {
            // Shadow rays start farther from where bodies touch.
            return None;
        }
        let errors = context.errors.hits();
        let mut work = Work { known: Some(record), ..Work::new(self.scene.materials().len()) };
        let mut restyled = Restyled::default();
        if constant {
            let clock = CpuClock::thread();
            self.evaluate_once(material, context);
            restyled.seconds += clock.seconds();
        }
        for path in 0..samples.paths.len() {
            for place in 0..=samples.paths[path].behind.len() {
                let (wanted, inputs, lit) = slices[usize::from(place > 0)];
                let nodes = &samples.paths[path];
                let nodes = place.checked_sub(1).map_or(nodes, |behind| &nodes.behind[behind]);
                let rows: Vec<u32> =
                    (0..nodes.rows.len() as u32).filter(|row| nodes.shader.get(*row as usize) == shader).collect();
                let mut styles = Vec::with_capacity(if constant { 0 } else { rows.len() });
                let mut style_of = Vec::new();
                if let (true, Some(outputs)) = (constant, &context.constants[material.index()]) {
                    // One for each object.
                    for row in &rows {
                        let object = self.object_of(nodes, place, *row, record)?;
                        let known = styles.iter().position(|style: &Node| style.member == object.0 + 1);
                        style_of.push(known.unwrap_or(styles.len()) as u32);
                        if known.is_none() {
                            styles.push(self.style(object, material, Outputs { batch: outputs, row: 0 }));
                        }
                    }
                }
                for rows in rows.chunks(GROUP).filter(|_| !constant) {
                    let (run, group) = self.recorded_hits(samples, (path, place), rows, record)?;
                    let lights =
                        if lit { self.light_samples(&group, &run.nodes, None, context, &mut work) } else { Vec::new() };
                    let clock = CpuClock::thread();
                    self.evaluate(material, &group, &run, &lights, (wanted, inputs), context);
                    restyled.seconds += clock.seconds();
                    let batch = &context.outputs;
                    styles.extend(
                        group
                            .iter()
                            .enumerate()
                            .map(|(row, hit)| self.style(hit.hit.object, material, Outputs { batch, row })),
                    );
                }
                restyled.hits += rows.len() as u64;
                let style_of = constant.then_some(&style_of[..]);
                if samples.restyle((path, place), &rows, (&styles, style_of), &self.plan.layout)? {
                    restyled.changed = covering(restyled.changed, samples, (path, place), &rows);
                }
            }
        }
        restyled.rays = work.rays;
        (context.errors.hits() == errors).then_some(restyled)
    }

    /// The object at a row of a tile's nodes, itself and not the one that stands for its group.
    fn object_of(&self, nodes: &NodeColumns, place: usize, row: u32, record: &TileRecord) -> Option<ObjectId> {
        if self.stand_ins.is_empty() {
            return nodes.object.get(row as usize).checked_sub(1).map(ObjectId);
        }
        let sample = nodes.rows.sample(row as usize);
        Some(hit_at(record, nodes.path, place, sample)?.object)
    }

    /// Rows of a tile's nodes at a path (by number) and a place in lists as hits that can be shaded.
    fn recorded_hits(
        &self,
        samples: &SampleBuffer,
        (path, place): (usize, usize),
        rows: &[u32],
        record: &TileRecord,
    ) -> Option<(Run, Vec<WaveHit>)> {
        let nodes = &samples.paths[path];
        let nodes = place.checked_sub(1).map_or(nodes, |behind| &nodes.behind[behind]);
        let mut run = Run::default();
        let mut group = Vec::with_capacity(rows.len());
        for (index, row) in rows.iter().enumerate() {
            let sample = nodes.rows.sample(*row as usize);
            let known = record.node(nodes.path, sample)?;
            let hit = hit_at(record, nodes.path, place, sample)?;
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
                    let offset = self.positions.of_pixel(pixel).offset(sample % samples.samples_per_pixel);
                    self.rays.ray(pixel, offset)
                }
            };
            let ray = WaveRay { origin, direction, node: index as u32, after: None, passed: 0, media: 0, counted: 0 };
            group.push(self.wave_hit(&ray, &hit, &node, place));
            run.nodes.push(node);
        }
        Some((run, group))
    }
}

/// The hit at a place of a list, 0 for the first.
fn hit_at(record: &TileRecord, path: NodePath, place: usize, sample: u32) -> Option<Hit> {
    match place {
        0 => record.node(path, sample)?.hit,
        _ => record.surface(path, place, sample),
    }
}

/// The least rectangle that covers another and the pixels of some rows of a tile's nodes.
fn covering(
    other: Option<PixelRect>,
    samples: &SampleBuffer,
    (path, place): (usize, usize),
    rows: &[u32],
) -> Option<PixelRect> {
    let nodes = &samples.paths[path];
    let nodes = place.checked_sub(1).map_or(nodes, |behind| &nodes.behind[behind]);
    rows.iter().fold(other, |covered, row| {
        let [x0, y0] = samples.pixel_of(nodes.rows.sample(*row as usize));
        let pixel = PixelRect { x0, y0, x1: x0 + 1, y1: y0 + 1 };
        Some(covered.map_or(pixel, |covered| covered.union(&pixel)))
    })
}
