//! Light samples: what every light gives a hit, past what stands in the way.
//!
//! Shadow rays go straight on through see-through and transmissive surfaces and lose what those do not let pass; they
//! are neither bent nor tinted, and reflection at glass takes nothing from them.

use smallvec::SmallVec;

use super::packet::{LANES, RayStart};
use super::ray_tree::{WaveHit, WaveRay};
use super::surface::Surface;
use super::triangle::Ray;
use super::wave::{TileTracer, TraceContext, Work, value};
use super::world::Hit;
use super::world_packet::Way;
use crate::clock::CpuClock;
use crate::math::Vec3;
use crate::scene::ids::MaterialId;
use crate::shade::batch::{HitBatch, LightSample, OutputBatch};
use crate::shade::bsdf::unit;
use crate::shade::{InputSet, OutputSet, PathKind};

/// Shadow rays towards one light that wait to be traced together.
#[derive(Default)]
struct Packet {
    starts: SmallVec<[RayStart; LANES]>,
    reaches: SmallVec<[f32; LANES]>,
    /// Places of their light samples.
    samples: SmallVec<[usize; LANES]>,
}

impl TileTracer<'_> {
    /// What every light gives each hit of a group, shadows included: `lights` samples a hit, hit by hit.
    pub(super) fn light_samples(
        &self,
        group: &[WaveHit],
        context: &mut TraceContext<'_>,
        work: &mut Work,
    ) -> Vec<LightSample> {
        let lights = self.lighting.len();
        let mut samples = Vec::with_capacity(group.len() * lights);
        for hit in group {
            samples.extend((0..lights).map(|light| self.lighting.sample(light, hit.surface.position).0));
        }
        let mut see_through = Vec::new();
        for light in 0..lights {
            let mut packet = Packet::default();
            for (index, hit) in group.iter().enumerate() {
                let surface = &hit.surface;
                let place = index * lights + light;
                let sample = &mut samples[place];
                if sample.direction.dot(surface.geometric_normal) <= 0.0 {
                    // In its own shadow.
                    sample.visibility = 0.0;
                } else if self.lighting.casts_shadows(light) && sample.radiance != Vec3::ZERO {
                    work.rays.shadow += 1;
                    let distance = self.lighting.sample(light, surface.position).1;
                    packet.starts.push((surface.leave(sample.direction), sample.direction));
                    // The light itself is no obstacle.
                    packet.reaches.push(distance * (1.0 - 1e-5));
                    packet.samples.push(place);
                    if packet.starts.len() == LANES {
                        self.trace_shadows(&mut packet, &mut samples, &mut see_through);
                    }
                }
            }
            self.trace_shadows(&mut packet, &mut samples, &mut see_through);
        }
        if !see_through.is_empty() {
            // In the order of the hits again, as if their rays had been traced one after the other.
            see_through.sort_by_key(|&(sample, ..)| sample);
            self.attenuate(&see_through, &mut samples, context, work);
        }
        samples
    }

    /// Traces the shadow rays of a packet and empties it: light that surely does not arrive loses its visibility; what other
    /// rays pass is added to `see_through`, with the place of the light sample.
    fn trace_shadows(
        &self,
        packet: &mut Packet,
        samples: &mut [LightSample],
        see_through: &mut Vec<(usize, Ray, Hit)>,
    ) {
        let opaque = |id: MaterialId| self.plan.materials[id.index()].blocks_light();
        let ways = self.world.blocked_of(&packet.starts, &packet.reaches, opaque);
        let mut passed = Vec::new();
        for (lane, &(origin, direction)) in packet.starts.iter().enumerate() {
            let sample = packet.samples[lane];
            let is_blocked = match ways[lane] {
                Way::Clear => continue,
                Way::Blocked => true,
                Way::Unsure => {
                    let ray = Ray::new(origin, direction);
                    let is_blocked = self.world.blocked(&ray, packet.reaches[lane], opaque, &mut passed);
                    if !is_blocked {
                        see_through.extend(passed.iter().map(|hit| (sample, ray, *hit)));
                    }
                    is_blocked
                }
            };
            if is_blocked {
                samples[sample].visibility = 0.0;
            }
        }
        packet.starts.clear();
        packet.reaches.clear();
        packet.samples.clear();
    }

    /// Lowers the visibility of light samples by what see-through surfaces on the way let pass: asks their shaders for
    /// opacity and transmission with `path_kind` "shadow". Scripts see the lights there without shadows.
    fn attenuate(
        &self,
        passed: &[(usize, Ray, Hit)],
        samples: &mut [LightSample],
        context: &mut TraceContext<'_>,
        work: &mut Work,
    ) {
        let mut hits: Vec<(usize, WaveHit)> = passed
            .iter()
            .map(|(sample, ray, hit)| {
                let wave_ray =
                    WaveRay { origin: ray.origin, direction: ray.direction, node: 0, after: None, passed: 0 };
                let surface = Surface::new(self.world, ray, hit);
                let material = self.world.material(hit);
                (*sample, WaveHit { ray: wave_ray, hit: *hit, surface, material, depth: hit.t, place: 0 })
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
            let key = |i: usize| (hits[i].0, hits[i].1.hit.rank());
            key(a).partial_cmp(&key(b)).unwrap_or(std::cmp::Ordering::Equal)
        });
        for index in order {
            samples[hits[index].0].visibility *= passes[index];
        }
    }
}
