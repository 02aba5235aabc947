//! Light samples: what every light gives a hit, past what stands in the way.
//!
//! Shadow rays go straight on through see-through and transmissive surfaces and lose what those do not let pass; they
//! are neither bent nor tinted, and reflection at glass takes nothing from them.

use smallvec::SmallVec;

use super::packet::LANES;
use super::ray_tree::{TreeNode, WaveHit, WaveRay};
use super::record::{RunRecord, UNKNOWN};
use super::surface::Surface;
use super::triangle::Ray;
use super::wave::{TileTracer, TraceContext, Work, value};
use super::world::Hit;
use super::world_packet::{ShadowRay, Way};
use crate::clock::CpuClock;
use crate::math::Vec3;
use crate::scene::ids::MaterialId;
use crate::shade::batch::{HitBatch, LightSample, OutputBatch};
use crate::shade::bsdf::unit;
use crate::shade::{InputSet, OutputSet, PathKind};

impl TileTracer<'_> {
    /// What every light gives each hit of a group, shadows included: `lights` samples a hit, hit by hit.
    pub(super) fn light_samples(
        &self,
        group: &[WaveHit],
        nodes: &[TreeNode],
        record: Option<&mut RunRecord>,
        context: &mut TraceContext<'_>,
        work: &mut Work<'_>,
    ) -> Vec<LightSample> {
        let lights = self.lighting.len();
        let mut samples = vec![LightSample::default(); group.len() * lights];
        let mut see_through = Vec::new();
        for light in 0..lights {
            // Rays towards one light that start side by side go much the same way.
            let mut waiting: SmallVec<[(usize, ShadowRay); LANES]> = SmallVec::new();
            for (index, hit) in group.iter().enumerate() {
                let surface = &hit.surface;
                let place = index * lights + light;
                let (mut sample, distance) = self.lighting.sample(light, surface.position);
                let known = match work.known {
                    // Shadow rays start farther off where bodies touch, which depends on shaders.
                    Some(known) if hit.place == 0 && self.plan.bodies.is_empty() => {
                        known.visibility(&nodes[hit.ray.node as usize], &hit.ray, &hit.hit).get(light).copied()
                    }
                    _ => None,
                };
                if let Some(visibility) = known.filter(|visibility| *visibility != UNKNOWN) {
                    sample.visibility = visibility;
                } else if sample.direction.dot(surface.geometric_normal) <= 0.0 {
                    // In its own shadow.
                    sample.visibility = 0.0;
                } else if self.lighting.casts_shadows(light) && sample.radiance != Vec3::ZERO {
                    work.rays.shadow += 1;
                    let start = (surface.leave(sample.direction), sample.direction);
                    // The light itself is no obstacle.
                    let reach = distance * (1.0 - 1e-5);
                    waiting.push((place, ShadowRay { start, reach, leaves: hit.hit.facet() }));
                }
                samples[place] = sample;
                if waiting.len() == LANES {
                    self.cast(&waiting, &mut samples, &mut see_through);
                    waiting.clear();
                }
            }
            self.cast(&waiting, &mut samples, &mut see_through);
        }
        if !see_through.is_empty() {
            self.attenuate(&see_through, &mut samples, context, work);
        }
        if let Some(record) = record {
            for (hit, samples) in group.iter().zip(samples.chunks(self.lighting.len().max(1))) {
                for (light, sample) in samples.iter().enumerate() {
                    record.note_visibility(hit.ray.node, light, sample.visibility);
                }
            }
        }
        samples
    }

    /// Sends rays towards a light, each for the light sample of a number: what is surely blocked becomes invisible, and what
    /// see-through surfaces are passed is noted.
    fn cast(&self, rays: &[(usize, ShadowRay)], samples: &mut [LightSample], see_through: &mut Vec<(usize, Ray, Hit)>) {
        let opaque = |id: MaterialId| self.plan.materials[id.index()].blocks_light();
        let packet: SmallVec<[ShadowRay; LANES]> = rays.iter().map(|(_, ray)| *ray).collect();
        let mut passed = Vec::new();
        for (&(place, ShadowRay { start, reach, leaves }), way) in
            rays.iter().zip(self.world.blocked_of(&packet, &opaque))
        {
            let blocked = way == Way::Blocked
                || way == Way::Unknown && {
                    let ray = Ray::new(start.0, start.1);
                    let blocked = self.world.blocked(&ray, reach, Some(leaves), opaque, &mut passed);
                    see_through.extend(passed.iter().filter(|_| !blocked).map(|hit| (place, ray, *hit)));
                    blocked
                };
            if blocked {
                samples[place].visibility = 0.0;
            }
        }
    }

    /// Lowers the visibility of light samples by what see-through surfaces on the way let pass: asks their shaders for
    /// opacity and transmission with `path_kind` "shadow". Scripts see the lights there without shadows.
    fn attenuate(
        &self,
        passed: &[(usize, Ray, Hit)],
        samples: &mut [LightSample],
        context: &mut TraceContext<'_>,
        work: &mut Work<'_>,
    ) {
        let mut hits: Vec<(usize, WaveHit)> = passed
            .iter()
            .map(|(sample, ray, hit)| {
                let (origin, direction) = (ray.origin, ray.direction);
                let wave_ray = WaveRay { origin, direction, node: 0, after: None, passed: 0, media: 0, counted: 0 };
                let surface = Surface::new(self.world, ray.direction, hit);
                let material = self.world.material(hit);
                let hit =
                    WaveHit { ray: wave_ray, hit: *hit, surface, material, depth: hit.t, place: 0, crossing: None };
                (*sample, hit)
            })
            .collect();
        hits.sort_by_key(|(_, hit)| hit.material);
        let mut passes = vec![1.0; hits.len()];
        let mut first = 0;
        while first < hits.len() {
            let material = hits[first].1.material;
            let end = first + hits[first..].partition_point(|(_, hit)| hit.material == material);
            let plan = &self.plan.materials[material.index()];
            let clock = CpuClock::thread();
            let mut batch = HitBatch { material_id: material.0 + 1, time: self.scene.time(), ..HitBatch::default() };
            batch.light_count = self.lighting.len();
            for (_, hit) in &hits[first..end] {
                self.gather(&mut batch, plan.inputs, hit, PathKind::Shadow, self.cone);
                if plan.inputs.intersects(InputSet::LIGHTS) {
                    let sample = |light| self.lighting.sample(light, hit.surface.position).0;
                    batch.lights.extend((0..self.lighting.len()).map(sample));
                }
            }
            let mut outputs = OutputBatch::default();
            let wanted = OutputSet::OPACITY | OutputSet::TRANSMISSION | OutputSet::METALLIC | OutputSet::COLOR;
            let wanted = wanted & (plan.wanted | self.marker);
            context.shading.shade(material, &batch, wanted, &mut outputs, &mut context.errors);
            work.hits[material.index()] += batch.len as u64;
            work.shade_seconds[material.index()] += clock.seconds();
            for (row, pass) in passes[first..end].iter_mut().enumerate() {
                // A hit whose colour is final lets no more light pass than it shows.
                let through = if value(&outputs.color, row, None).is_some() {
                    0.0
                } else {
                    unit(value(&outputs.transmission, row, 0.0), 0.0)
                        * (1.0 - unit(value(&outputs.metallic, row, 0.0), 0.0))
                };
                *pass = 1.0 - unit(value(&outputs.opacity, row, 1.0), 1.0) * (1.0 - through);
            }
            first = end;
        }
        // In the order along each ray again: products round differently in other orders.
        let mut order: Vec<usize> = (0..hits.len()).collect();
        order.sort_by(|&a, &b| {
            let key = |i: usize| (hits[i].0, hits[i].1.hit.t, hits[i].1.hit.facet());
            key(a).partial_cmp(&key(b)).unwrap_or(std::cmp::Ordering::Equal)
        });
        for index in order {
            samples[hits[index].0].visibility *= passes[index];
        }
    }
}
