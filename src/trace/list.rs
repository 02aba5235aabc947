//! Surface lists: the first K surfaces along a ray (DESIGN section 3.4).
//!
//! The first surface of a list makes the picture and is found and shaded as without lists, to the last bit. Of the others
//! only what the line pass asks for is worked out: the slice of their shaders for feature, line and opacity.
//!
//! What a list holds must serve `differ`, which compares surfaces, not crossings. While only objects and materials are
//! compared, a second crossing of an object (or group) with the same material can tell nothing new: it is left out, so that a closed
//! body takes one place and not two. Where a test reads texture coordinates, normals, feature colours or overlaps, the far
//! side of a body may differ from its near side, and each crossing has its place. Two triangles that share the edge that a ray hits
//! exactly, at one distance, are one crossing either way.
//!
//! A surface of opacity 0 is not there. That is known only once it is shaded, so a list that turns out to hold one is
//! looked for again without it. All others have their place; what lies behind a see-through surface is also the start of
//! another path (`T`), with a list of its own.

use std::collections::BTreeMap;

use super::ray_tree::{Run, WaveHit, WaveRay};
use super::scatter::Outputs;
use super::triangle::Ray;
use super::wave::{MOST_INVISIBLE, TileTracer, TraceContext, Work, value};
use super::world::{Facet, Hit};
use crate::clock::CpuClock;
use crate::sample::{Node, NodePath};
use crate::scene::settings::RayKinds;
use crate::shade::Mode;
use crate::shade::bsdf::unit;

/// A hit behind the first, shaded: its node's number, its place in the list, itself, and its attributes, or its triangle if it
/// is not there.
type Shaded = (u32, u32, Hit, Result<Node, Facet>);

impl Run {
    /// Forgets what lies behind hits that turned out invisible: their rays look for a new list.
    pub fn forget_behind_again(&mut self) {
        if self.again.is_empty() || self.behind.is_empty() {
            return;
        }
        let mut again: Vec<u32> = self.again.iter().map(|ray| ray.node).collect();
        again.sort_unstable();
        self.behind.retain(|hit| again.binary_search(&hit.ray.node).is_err());
    }
}

impl TileTracer<'_> {
    /// Whether rays to a node keep lists of surfaces.
    #[inline]
    pub(super) fn keeps_list(&self, path: NodePath) -> bool {
        self.plan.surfaces > 1 && self.plan.lines.as_ref().is_some_and(|lines| lines.rules.draws(path))
    }

    /// The list of a ray, but for hits that are known to be invisible.
    pub(super) fn surface_list(
        &self,
        ray: &Ray,
        kind: RayKinds,
        wave_ray: &WaveRay,
        absent: &[Facet],
        list: &mut Vec<Hit>,
    ) {
        let Some(tests) = self.plan.lines.as_ref().map(|lines| &lines.tests) else { return };
        let shapes = tests.tests_shapes();
        let object = |hit: &Hit| self.stand_ins.get(hit.object.index()).copied().unwrap_or(hit.object);
        let same = |a: &Hit, b: &Hit| {
            let same_material = || self.world.material(a) == self.world.material(b);
            if shapes {
                a.object == b.object && a.t == b.t && a.front == b.front && same_material()
            } else {
                (!tests.object || object(a) == object(b)) && (!tests.shader || same_material())
            }
        };
        let from = (wave_ray.after.as_ref(), absent);
        self.world.first_hits(ray, kind, from, self.plan.surfaces as usize, same, list);
    }

    /// Shades the hits behind the first ones of a wave, as far as lines ask for it.
    pub(super) fn shade_behind(&self, run: &mut Run, context: &mut TraceContext<'_>, work: &mut Work<'_>) {
        let mut hits = std::mem::take(&mut run.behind);
        // By node: hits that are not there.
        let mut absent: BTreeMap<u32, Vec<Facet>> = BTreeMap::new();
        while !hits.is_empty() {
            hits.sort_by_key(|hit| hit.material);
            let mut shaded: Vec<Shaded> = Vec::with_capacity(hits.len());
            for group in hits.chunk_by(|a, b| a.material == b.material) {
                self.shade_group_behind(group, run, context, work, &mut shaded);
            }
            shaded.sort_by_key(|&(node, place, ..)| (node, place));
            let mut again = Vec::new();
            for list in shaded.chunk_by(|a, b| a.0 == b.0) {
                let node = list[0].0;
                let mut found_absent = list.iter().filter_map(|(.., found)| found.err()).peekable();
                if found_absent.peek().is_some() {
                    let absent = absent.entry(node).or_default();
                    absent.extend(found_absent);
                    if absent.len() < MOST_INVISIBLE as usize {
                        again.push(node);
                        continue;
                    }
                }
                // Behind so many invisible surfaces nothing is looked for any more.
                let there = list.iter().map_while(|&(node, place, hit, found)| Some((node, place, hit, found.ok()?)));
                run.surfaces.extend(there);
            }
            let rays: Vec<WaveRay> = {
                let mut rays: Vec<_> = hits.iter().map(|hit| hit.ray).collect();
                rays.sort_by_key(|ray| ray.node);
                rays.dedup_by_key(|ray| ray.node);
                rays.retain(|ray| again.binary_search(&ray.node).is_ok());
                rays
            };
            hits.clear();
            let mut list = Vec::new();
            for wave_ray in &rays {
                let node = &run.nodes[wave_ray.node as usize];
                let absent = absent.get(&wave_ray.node).map_or(&[][..], |ranks| &ranks[..]);
                let ray = Ray::new(wave_ray.origin, wave_ray.direction);
                self.surface_list(&ray, work.count(node.kind), wave_ray, absent, &mut list);
                let behind = list.iter().enumerate().skip(1);
                hits.extend(behind.map(|(place, hit)| self.wave_hit(wave_ray, hit, node, place)));
            }
        }
        run.behind = hits;
    }

    /// Shades hits of one material that lie behind first ones.
    fn shade_group_behind(
        &self,
        group: &[WaveHit],
        run: &Run,
        context: &mut TraceContext<'_>,
        work: &mut Work<'_>,
        shaded: &mut Vec<Shaded>,
    ) {
        let Some(material) = group.first().map(|hit| hit.material) else { return };
        let plan = &self.plan.materials[material.index()];
        let lights =
            if plan.behind.lights { self.light_samples(group, &run.nodes, None, context, work) } else { Vec::new() };
        let clock = CpuClock::thread();
        let constant = plan.mode == Mode::Constant;
        if constant {
            self.evaluate_once(material, context);
        } else {
            self.evaluate(material, group, run, &lights, (plan.behind.wanted, plan.behind.inputs), context);
        }
        work.hits[material.index()] += group.len() as u64;
        work.shade_seconds[material.index()] += clock.seconds();

        let batch = match &context.constants[material.index()] {
            Some(outputs) if constant => outputs,
            _ => &context.outputs,
        };
        for (index, hit) in group.iter().enumerate() {
            let outputs = Outputs { batch, row: if constant { 0 } else { index } };
            let opacity = unit(value(&batch.opacity, outputs.row, 1.0), 1.0);
            let cone = run.nodes[hit.ray.node as usize].cone;
            let found = if opacity == 0.0 { Err(hit.hit.facet()) } else { Ok(self.attributes(hit, cone, outputs)) };
            shaded.push((hit.ray.node, hit.place, hit.hit, found));
        }
    }
}
