//! Shading: groups of hits of one material become node attributes, radiance and further rays.

use std::sync::Arc;

use smallvec::SmallVec;

use super::cone::Cone;
use super::media::{Crossing, Pass};
use super::ray_tree::{Run, TreeNode, WaveHit, WaveRay};
use super::wave::{TileTracer, TraceContext, Work, value};
use crate::clock::CpuClock;
use crate::math::{Vec2, Vec3, luminance};
use crate::plan::MaterialPlan;
use crate::sample::{Node, NodePath};
use crate::scene::ids::{MaterialId, ObjectId};
use crate::shade::analysis::inputs::LIMIT;
use crate::shade::batch::{HitBatch, LightSample, OutputBatch};
use crate::shade::bsdf::{Bounces, BsdfLanes, LANES, LightLanes, unit};
use crate::shade::{Bsdf, InputSet, Mode, OutputSet, PathKind};

/// A branch of the ray tree that weighs less than this in every channel is not traced: what it shows would have to be
/// brighter than white to change an 8-bit picture by one step. Like a branch beyond the depth limits, it counts as black.
const LEAST_THROUGHPUT: f32 = 1.0 / 512.0;

/// The outputs of a material's shader at one hit: a batch and a row in it.
#[derive(Clone, Copy)]
pub(super) struct Outputs<'a> {
    pub batch: &'a OutputBatch,
    pub row: usize,
}

impl TileTracer<'_> {
    /// Shades hits of one material: fills their nodes and sends on what they mirror and let pass.
    pub(super) fn shade_group(
        &self,
        group: &[WaveHit],
        run: &mut Run,
        context: &mut TraceContext<'_>,
        work: &mut Work<'_>,
    ) {
        let Some(material) = group.first().map(|hit| hit.material) else { return };
        let plan = &self.plan.materials[material.index()];
        let lights = self.shade(group, run, true, context, work);
        let lights_per_hit = if plan.lights { self.lighting.len() } else { 0 };
        for (place, hits) in group.chunks(LANES).enumerate() {
            let first = place * LANES;
            let lights = &lights[first * lights_per_hit..(first + hits.len()) * lights_per_hit];
            let lit = self.light_together(hits, first, plan, lights, context);
            for (lane, hit) in hits.iter().enumerate() {
                let outputs = self.outputs_of(material, first + lane, context);
                let lights = &lights[lane * lights_per_hit..(lane + 1) * lights_per_hit];
                let lit = lit.as_ref().map(|(bsdfs, lit)| (bsdfs[lane], lit.radiance(lane)));
                self.finish(hit, plan, outputs, (lights, lit), run);
            }
        }
    }

    /// How some of the hits that were shaded last (from the `first` on) scatter light, and what of it their viewers see; `None` if
    /// that has to be told one by one: where bodies overlap, and where a script gives the colour.
    fn light_together(
        &self,
        hits: &[WaveHit],
        first: usize,
        plan: &MaterialPlan,
        lights: &[LightSample],
        context: &TraceContext<'_>,
    ) -> Option<(SmallVec<[Bsdf; LANES]>, BsdfLanes)> {
        let material = hits.first()?.material;
        if !self.plan.color || !self.plan.bodies.is_empty() {
            return None;
        }
        let mut bsdfs = SmallVec::new();
        let mut lanes = BsdfLanes::default();
        for (lane, hit) in hits.iter().enumerate() {
            let outputs = self.outputs_of(material, first + lane, context);
            if value(&outputs.batch.color, outputs.row, None).is_some() {
                return None;
            }
            let bsdf = self.bsdf(hit, outputs, 1.0);
            let direction = hit.ray.direction;
            let emission = value(&outputs.batch.emission, outputs.row, Vec3::ZERO);
            lanes.set(lane, &bsdf, -direction, emission, || {
                self.lighting.background(bsdf.mirror_direction(direction, hit.surface.geometric_normal))
            });
            bsdfs.push(bsdf);
        }
        let mut columns: SmallVec<[LightLanes; 2]> = SmallVec::new();
        if plan.lit && !lights.is_empty() {
            columns.resize_with(lights.len() / hits.len(), LightLanes::default);
            for (lane, lights) in lights.chunks_exact(columns.len()).enumerate() {
                for (column, light) in columns.iter_mut().zip(lights).filter(|(_, light)| light.visibility > 0.0) {
                    column.set(lane, light.direction, light.radiance * light.visibility);
                }
            }
        }
        lanes.light(self.world.arch, &columns, self.lighting.ambient);
        Some((bsdfs, lanes))
    }

    /// Runs the shader of hits of one material, of which there is at least one; returns what lights give them, if anybody asks.
    /// The run's record learns of it if they are those of their nodes.
    pub(super) fn shade(
        &self,
        group: &[WaveHit],
        run: &mut Run,
        of_nodes: bool,
        context: &mut TraceContext<'_>,
        work: &mut Work<'_>,
    ) -> Vec<LightSample> {
        let Some(material) = group.first().map(|hit| hit.material) else { return Vec::new() };
        let plan = &self.plan.materials[material.index()];
        let lights = if plan.lights {
            self.light_samples(group, &run.nodes, of_nodes.then_some(&mut run.record), context, work)
        } else {
            Vec::new()
        };
        let clock = CpuClock::thread();
        if plan.mode == Mode::Constant {
            self.evaluate_once(material, context);
        } else {
            self.evaluate(material, group, run, &lights, (plan.wanted | self.marker, plan.inputs), context);
        }
        work.hits[material.index()] += group.len() as u64;
        work.shade_seconds[material.index()] += clock.seconds();
        lights
    }

    /// What the shader returned for one of the hits that were shaded last.
    pub(super) fn outputs_of<'c>(
        &self,
        material: MaterialId,
        index: usize,
        context: &'c TraceContext<'_>,
    ) -> Outputs<'c> {
        let constant = self.plan.materials[material.index()].mode == Mode::Constant;
        match &context.constants[material.index()] {
            Some(batch) if constant => Outputs { batch, row: 0 },
            _ => Outputs { batch: &context.outputs, row: index },
        }
    }

    /// How much of a surface is there.
    pub(super) fn opacity(&self, Outputs { batch, row }: Outputs<'_>) -> f32 {
        unit(value(&batch.opacity, row, 1.0), 1.0)
    }

    /// Runs the shader of a constant material, once per context.
    pub(super) fn evaluate_once(&self, material: MaterialId, context: &mut TraceContext<'_>) {
        let TraceContext { shading, hits, errors, constants, .. } = context;
        let constant = &mut constants[material.index()];
        if constant.is_none() {
            hits.clear();
            hits.len = 1;
            hits.material_id = material.0 + 1;
            let outputs = constant.insert(OutputBatch::default());
            let wanted = self.plan.materials[material.index()].wanted | self.marker;
            shading.shade(material, hits, wanted, outputs, errors);
        }
    }

    /// Runs a material's shader over a group of hits, into the context's outputs.
    pub(super) fn evaluate(
        &self,
        material: MaterialId,
        group: &[WaveHit],
        run: &Run,
        lights: &[LightSample],
        (wanted, inputs): (OutputSet, InputSet),
        context: &mut TraceContext<'_>,
    ) {
        let TraceContext { shading, hits, outputs, errors, .. } = context;
        hits.clear();
        hits.material_id = material.0 + 1;
        hits.time = self.scene.time();
        hits.light_count = self.lighting.len();
        if inputs.intersects(InputSet::LIGHTS) {
            hits.lights.extend_from_slice(lights);
        }
        for hit in group {
            let node = &run.nodes[hit.ray.node as usize];
            self.gather(hits, inputs, hit, node.kind, node.cone);
        }
        shading.shade(material, hits, wanted, outputs, errors);
    }

    /// Adds one hit to a batch: only the columns that are read.
    pub(super) fn gather(&self, batch: &mut HitBatch, inputs: InputSet, hit: &WaveHit, kind: PathKind, cone: Cone) {
        let object = self.world.object(hit.hit.object);
        let surface = &hit.surface;
        batch.len += 1;
        if inputs.contains(InputSet::POSITION) {
            batch.position.push(self.in_world(surface.position));
        }
        if inputs.contains(InputSet::NORMAL) {
            batch.normal.push(surface.normal);
        }
        if inputs.contains(InputSet::GEOMETRIC_NORMAL) {
            batch.geometric_normal.push(surface.geometric_normal);
        }
        if inputs.contains(InputSet::INCOMING) {
            batch.incoming.push(hit.ray.direction);
        }
        if inputs.contains(InputSet::UV) {
            batch.uv.push(surface.uv(object, &hit.hit, 0));
        }
        if inputs.contains(InputSet::MORE_UVS) {
            // Meshes of one material may differ in how many sets they have; missing ones read as 0.
            let sets = (object.mesh.uvs.len().max(1) - 1).max(batch.more_uvs.len());
            batch.more_uvs.resize_with(sets, || vec![Vec2::ZERO; batch.len - 1]);
            for (set, column) in batch.more_uvs.iter_mut().enumerate() {
                column.push(surface.uv(object, &hit.hit, set + 1));
            }
        }
        if inputs.contains(InputSet::TANGENT) {
            batch.tangent.push(surface.tangent(object, &hit.hit));
        }
        if inputs.contains(InputSet::COLOR) {
            batch.color.push(surface.color(object, &hit.hit));
        }
        if inputs.contains(InputSet::OBJECT_ID) {
            batch.object_id.push(hit.hit.object.0 + 1);
        }
        if inputs.contains(InputSet::POLYGON_ID) {
            let triangle = hit.hit.triangle;
            batch.polygon_id.push(object.mesh.polygons.get(triangle as usize).copied().unwrap_or(triangle));
        }
        if inputs.contains(InputSet::BARYCENTRIC) {
            batch.barycentric.push(surface.barycentric);
        }
        if inputs.contains(InputSet::DISTANCE) {
            batch.distance.push(hit.hit.t);
        }
        if inputs.contains(InputSet::DEPTH) {
            batch.depth.push(hit.depth);
        }
        if inputs.contains(InputSet::PATH_KIND) {
            batch.path_kind.push(kind);
        }
        if inputs.contains(InputSet::FRONT_FACING) {
            batch.front_facing.push(surface.front);
        }
        if inputs.intersects(InputSet::CONE) {
            let footprint = cone.after(hit.hit.t).footprint();
            if inputs.contains(InputSet::PIXELS_PER_UNIT) {
                batch.pixels_per_unit.push((1.0 / footprint).min(LIMIT));
            }
            if inputs.contains(InputSet::FOOTPRINT) {
                batch.footprint.push(footprint.min(LIMIT));
            }
            if inputs.contains(InputSet::UV_FOOTPRINT) {
                let cos = surface.geometric_normal.dot(hit.ray.direction).abs().max(0.01);
                let uv_footprint = footprint / cos.sqrt() * surface.uv_density(object, &hit.hit);
                batch.uv_footprint.push(uv_footprint.min(LIMIT));
            }
        }
        if inputs.contains(InputSet::ATTRIBUTE) {
            if batch.len == 1 {
                batch.attributes = Arc::clone(self.scene.attributes().sets());
            }
            batch.attribute_set.push(self.scene.attributes().of(hit.hit.object, hit.material));
        }
        if inputs.contains(InputSet::CURVATURE) {
            batch.curvature.push(surface.curvature(object, &hit.hit));
        }
    }

    /// Lights one hit, fills its node, and sends on what it mirrors and lets pass.
    fn finish(
        &self,
        hit: &WaveHit,
        plan: &MaterialPlan,
        outputs: Outputs<'_>,
        (lights, lit): (&[LightSample], Option<(Bsdf, Vec3)>),
        run: &mut Run,
    ) {
        let direction = hit.ray.direction;
        let Outputs { batch, row } = outputs;
        let opacity = self.opacity(outputs);
        let crossing = hit.crossing.and_then(|index| run.crossings.get(index as usize)).copied();
        if let Some(again) = self.passes(hit, outputs, opacity, crossing.as_ref(), run) {
            run.again.push(again);
            return;
        }
        let inside = run.media.get(hit.ray.media as usize).map_or(1.0, |media| media.index);

        // What the line pass and the layers need.
        let index = hit.ray.node as usize;
        let node = &mut run.nodes[index];
        node.attributes = run.attributes.len() as u32;
        run.attributes.push(self.attributes(hit, node.cone, outputs));
        node.culprit = hit.material.0 + 1;
        node.alpha = if self.transparent { opacity } else { 1.0 };
        if node.path == NodePath::CAMERA {
            if let Some(position) = run.positions.get_mut(index) {
                *position = self.in_world(hit.surface.position);
            }
            let count = self.plan.layout.aovs;
            for (aov, column) in run.aovs[index * count..(index + 1) * count].iter_mut().zip(&batch.aovs) {
                *aov = value(column, row, Vec3::ZERO);
            }
        }

        // Its own radiance, and what it sends on.
        let mut bounces = Bounces::default();
        let mut mirrored = Vec3::ZERO;
        let mut eta = 1.0;
        let mut media = hit.ray.media;
        if let Some(color) = value(&batch.color, row, None) {
            node.radiance = color * opacity;
        } else if self.plan.color || plan.reflects || plan.refracts {
            let mut bsdf = lit.map_or_else(|| self.bsdf(hit, outputs, inside), |(bsdf, _)| bsdf);
            if let Some(crossing) = &crossing {
                bsdf.surrounding = match crossing.pass {
                    Pass::Thin => bsdf.ior,
                    Pass::Bends if !crossing.enters => crossing.behind.settled().index,
                    _ => inside,
                };
            }
            let mirror_direction = || bsdf.mirror_direction(direction, hit.surface.geometric_normal);
            let around = || {
                bsdf.surroundings(-direction, self.lighting.ambient, || self.lighting.background(mirror_direction()))
            };
            if let Some((_, radiance)) = lit {
                let radiance = if bsdf.is_mirror() { radiance + around() } else { radiance };
                node.radiance = radiance * opacity;
            } else if self.plan.color {
                let mut radiance = value(&batch.emission, row, Vec3::ZERO);
                let arriving = lights.iter().filter(|light| plan.lit && light.visibility > 0.0);
                for light in arriving {
                    radiance += bsdf.scatter(-direction, light.direction, light.radiance * light.visibility);
                }
                node.radiance = (radiance + around()) * opacity;
            }
            if plan.reflects || plan.refracts {
                mirrored = mirror_direction();
                bounces = bsdf.bounces(direction, hit.surface.geometric_normal);
                eta = bsdf.eta();
                if let Some(Crossing { mut behind, enters, .. }) = crossing {
                    if enters && let Some(body) = self.body(hit, &bsdf) {
                        behind.enter(body);
                    }
                    media = run.media.len() as u32;
                    run.media.push(behind.settled());
                }
            }
        }

        if opacity == 1.0 && !plan.reflects && !plan.refracts {
            // Nothing is sent on.
            return;
        }
        let refraction = bounces.refraction * opacity;
        let through = Vec3::splat(1.0 - opacity);
        // One ray stands for both ways through a surface that is see-through and refracts.
        let straight = luminance(through) >= luminance(refraction);
        if !straight {
            // What glass shows is bent: on another page it would not be what lies behind.
            node.alpha = 1.0;
        }
        let alpha_weight = 1.0 - node.alpha;
        let [reflections, refractions] = [node.reflections, node.refractions].map(u32::from);
        if reflections < self.plan.reflection_depth {
            let weight = bounces.reflection * opacity;
            let kind = PathKind::Reflection;
            let media = hit.ray.media;
            let mirrored = Departure { kind, direction: mirrored, weight, alpha_weight: 0.0, eta: 1.0, media };
            self.send(hit, mirrored, run);
        }
        if refractions < self.plan.refraction_depth {
            let direction = if straight { direction } else { bounces.refracted };
            let weight = refraction + through;
            let eta = if straight { 1.0 } else { eta };
            let kind = PathKind::Refraction;
            self.send(hit, Departure { kind, direction, weight, alpha_weight, eta, media }, run);
        }
    }

    /// Where a ray goes on if the surface that it met is not there: because it is invisible, or because of other bodies.
    fn passes(
        &self,
        hit: &WaveHit,
        outputs: Outputs<'_>,
        opacity: f32,
        crossing: Option<&Crossing>,
        run: &mut Run,
    ) -> Option<WaveRay> {
        let stays = WaveRay { passed: hit.ray.passed + 1, counted: hit.ray.counted + 1, ..hit.ray };
        let Some(&Crossing { pass, mut behind, enters, last }) = crossing else {
            return (opacity == 0.0).then(|| hit.ray.going_on(&hit.hit, hit.ray.media as usize));
        };
        let media = run.media.len();
        if opacity == 0.0 {
            if enters {
                return Some(stays);
            }
            if matches!(pass, Pass::Thin | Pass::Stops) {
                return Some(hit.ray.going_on(&hit.hit, hit.ray.media as usize));
            }
            run.media.push(behind.settled());
            return Some(hit.ray.going_on(&last, media));
        }
        if !matches!(pass, Pass::Touches | Pass::Silent | Pass::Counted) {
            return None;
        }
        let body = self.body(hit, &self.bsdf(hit, outputs, 1.0));
        if let Some(body) = body {
            behind.enter(body);
        }
        match (pass, body) {
            (Pass::Counted, _) => {
                run.media.push(behind);
                Some(WaveRay { media: media as u32, ..stays })
            }
            (Pass::Touches, Some(body)) if body.ior == behind.index => {
                run.media.push(behind.settled());
                Some(hit.ray.going_on(&last, media))
            }
            (Pass::Silent, Some(_)) => {
                run.media.push(behind);
                Some(hit.ray.going_on(&last, media))
            }
            _ => None,
        }
    }

    pub(super) fn attributes(&self, hit: &WaveHit, cone: Cone, outputs: Outputs<'_>) -> Node {
        let placed = self.world.object(hit.hit.object);
        let columns = self.plan.layout.columns;
        let uv = columns.uv.then(|| hit.surface.uv(placed, &hit.hit, 0));
        let stand_in = self.stand_ins.get(hit.hit.object.index()).copied().unwrap_or(hit.hit.object);
        let footprint = if columns.overlap { cone.after(hit.hit.t).footprint() } else { 0.0 };
        Node {
            object: stand_in.0 + 1,
            uv: uv.unwrap_or_default().to_array(),
            normal: hit.surface.normal.to_array(),
            depth: hit.depth,
            position: hit.surface.position.to_array(),
            geometric_normal: hit.surface.geometric_normal.to_array(),
            footprint,
            ..self.style(hit.hit.object, hit.material, outputs)
        }
    }

    /// The part of a node's attributes that depends on its object and its shader's outputs alone; the rest is neutral.
    pub(super) fn style(&self, id: ObjectId, material: MaterialId, Outputs { batch, row }: Outputs<'_>) -> Node {
        let object = &self.scene.objects()[id.index()];
        let lines = self.scene.lines();
        let width = value(&batch.line_width, row, None).unwrap_or(lines.width);
        let priority = value(&batch.priority, row, None)
            .or(object.priority)
            .or(self.scene.materials()[material.index()].priority)
            .unwrap_or(0);
        Node {
            object: id.0 + 1,
            member: id.0 + 1,
            shader: material.0 + 1,
            feature: value(&batch.feature, row, Vec3::ZERO).to_array(),
            line_color: value(&batch.line_color, row, None).unwrap_or(lines.color).to_array(),
            line_width: if object.lines { width } else { 0.0 },
            line_opacity: value(&batch.line_opacity, row, 1.0),
            priority,
            ..Node::default()
        }
    }

    /// How a surface scatters light; `surrounding` is the index of refraction where its body is not.
    pub(super) fn bsdf(&self, hit: &WaveHit, Outputs { batch, row }: Outputs<'_>, surrounding: f32) -> Bsdf {
        let surface = &hit.surface;
        let normal = value(&batch.normal, row, None)
            .and_then(Vec3::try_normalize)
            .filter(|normal| normal.dot(surface.geometric_normal) > 0.0)
            .unwrap_or(surface.normal);
        Bsdf {
            base_color: value(&batch.base_color, row, Vec3::splat(0.8)),
            metallic: value(&batch.metallic, row, 0.0),
            roughness: value(&batch.roughness, row, 1.0),
            specular: value(&batch.specular, row, 1.0),
            ior: value(&batch.ior, row, 1.5),
            transmission: value(&batch.transmission, row, 0.0),
            normal,
            occlusion: value(&batch.occlusion, row, 1.0),
            outside: surface.front,
            surrounding,
        }
        .checked()
    }

    /// Sends a ray on from a hit, unless it could not be seen.
    fn send(&self, hit: &WaveHit, departure: Departure, run: &mut Run) {
        let Departure { kind, direction, weight, alpha_weight, eta, media } = departure;
        let parent = &run.nodes[hit.ray.node as usize];
        let throughput = parent.throughput * weight;
        if !throughput.is_finite() || throughput.max_element() < LEAST_THROUGHPUT {
            return;
        }
        let parent = *parent;
        let reflected = kind == PathKind::Reflection;
        let origin = hit.surface.leave(direction);
        let node = run.nodes.len() as u32;
        run.next.push(WaveRay { origin, direction, node, after: None, passed: 0, media, counted: 0 });
        run.nodes.push(TreeNode {
            parent: Some(hit.ray.node),
            path: if reflected { parent.path.reflected() } else { parent.path.refracted() },
            kind,
            weight,
            alpha_weight,
            reflections: parent.reflections + u8::from(reflected),
            refractions: parent.refractions + u8::from(!reflected),
            length_before: hit.depth,
            throughput,
            ..TreeNode::root(parent.sample, self.departing_cone(hit, &parent, reflected, eta))
        });
    }

    /// The pixel's cone where a ray leaves a hit.
    fn departing_cone(&self, hit: &WaveHit, parent: &TreeNode, reflected: bool, eta: f32) -> Cone {
        let cone = parent.cone.after(hit.hit.t);
        if !self.follows_cones || (!reflected && eta == 1.0) {
            return cone;
        }
        let curvature = hit.surface.curvature(self.world.object(hit.hit.object), &hit.hit);
        if reflected {
            cone.reflected(curvature)
        } else {
            cone.refracted(curvature, eta, -hit.surface.normal.dot(hit.ray.direction))
        }
    }

    /// A position relative to the camera, in the world.
    fn in_world(&self, position: Vec3) -> Vec3 {
        (position.as_dvec3() + self.world.origin).as_vec3()
    }
}

/// A ray that leaves a hit.
struct Departure {
    kind: PathKind,
    direction: Vec3,
    /// What the hit's node sees of it.
    weight: Vec3,
    /// What of its coverage the hit's node takes over.
    alpha_weight: f32,
    /// Of a refracted ray: the index on its side over the index behind.
    eta: f32,
    /// The media that it is in.
    media: u32,
}
