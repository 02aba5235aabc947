//! Waves: all rays of a run of pixels at one depth of the ray tree, traced and shaded together.
//!
//! A tile is cut into runs of pixels of a few thousand samples, so that a wave's data stays in the cache. For each run:
//! camera rays are wave 0; each wave is traced, its hits are grouped by material and shaded in batches, and what they
//! mirror and refract becomes the next wave. When no rays are left, radiance flows back from children to parents, and
//! the nodes enter the [`SampleBuffer`]. Every number depends on its own sample's ray tree alone, so that no tile size,
//! thread count or order can change a bit.

use std::ops::Range;

use super::clear::Pixels;
use super::cone::Cone;
use super::film::{Film, FilmPacket};
use super::media::Seen;
use super::packet::{LANES, RayPacket};
use super::ray_tree::{Run, TreeNode, WaveHit, WaveRay};
use super::record::TileRecord;
use super::surface::Surface;
use super::surface_lanes::surfaces_of;
use super::triangle::Ray;
use super::world::{Hit, World};
use crate::clock::CpuClock;
use crate::math::Vec3;
use crate::plan::{Plan, marker};
use crate::sample::position::SamplePositions;
use crate::sample::{Node, NodePath, PairBatch, PixelRect, SampleBuffer, SampleBufferBuilder, SampleColor};
use crate::scene::Scene;
use crate::scene::camera::CameraRays;
use crate::scene::ids::{MaterialId, ObjectId};
use crate::scene::settings::{Background, RayKinds};
use crate::shade::batch::{HitBatch, OutputBatch};
use crate::shade::{Lighting, LineStyles, OutputSet, PathKind, ShadeErrors, Shaders, Shading};

/// Samples of a run of pixels that are traced together.
const RUN_SAMPLES: usize = 2048;
/// The same where rays branch, so that even deep trees of mirrors and glass stay small in memory.
const RUN_SAMPLES_BRANCHING: usize = 1024;
/// Most surfaces of opacity 0 that a ray passes before it is taken to leave the scene.
pub(super) const MOST_INVISIBLE: u32 = 256;

/// What the rays of a packet met, as far as they are one.
type Packet = [Option<Option<Hit>>; LANES];

/// Rays traced, by kind, for `--stats`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCounts {
    /// From the camera, continuations through invisible surfaces included.
    pub camera: u64,
    /// Of these, the ones that were spared: they were known to meet nothing.
    pub spared: u64,
    /// Towards lights.
    pub shadow: u64,
    /// Mirrored.
    pub reflection: u64,
    /// Refracted or straight on through a see-through surface.
    pub refraction: u64,
}

impl std::ops::AddAssign for RayCounts {
    fn add_assign(&mut self, other: Self) {
        self.camera += other.camera;
        self.spared += other.spared;
        self.shadow += other.shadow;
        self.reflection += other.reflection;
        self.refraction += other.refraction;
    }
}

/// What a tile of rays came to.
#[derive(Debug)]
pub struct TracedTile {
    /// The samples.
    pub samples: SampleBuffer,
    /// What the rays met, if it was to be kept and was not all known.
    pub record: Option<TileRecord>,
    /// Rays traced.
    pub rays: RayCounts,
    /// Hits shaded, by material.
    pub hits: Vec<u64>,
    /// Seconds spent in shaders, by material.
    pub shade_seconds: Vec<f64>,
    /// Seconds spent on all of it.
    pub seconds: f64,
}

/// Traces tiles. Shared by all threads.
pub struct TileTracer<'a> {
    pub(super) scene: &'a Scene,
    pub(super) plan: &'a Plan,
    pub(super) world: &'a World,
    pub(super) lighting: &'a Lighting,
    pub(super) positions: SamplePositions,
    pub(super) rays: CameraRays,
    /// Whether rays that leave the scene let the page show through.
    pub(super) transparent: bool,
    /// For each object the one that stands for its group; empty if there are no groups.
    pub(super) stand_ins: Vec<ObjectId>,
    /// A pixel's cone at the camera.
    pub(super) cone: Cone,
    /// [`Plan::follows_cones`].
    pub(super) follows_cones: bool,
    /// Outputs that mark a hit whose script failed, which no analysis of the script foresees.
    pub(super) marker: OutputSet,
}

/// A thread's own memory and script engine.
pub struct TraceContext<'a> {
    pub(super) shading: Shading<'a>,
    /// Run-time errors of scripts so far.
    pub errors: ShadeErrors,
    /// The one evaluation of each constant material.
    pub(super) constants: Vec<Option<OutputBatch>>,
    pub(super) hits: HitBatch,
    pub(super) outputs: OutputBatch,
    wave_hits: Vec<WaveHit>,
    run: Run,
}

impl<'a> TraceContext<'a> {
    /// A context for one thread at a time.
    #[must_use]
    pub fn new(scene: &'a Scene, shaders: &'a Shaders) -> Self {
        Self {
            shading: Shading::new(scene, shaders),
            errors: ShadeErrors::default(),
            constants: vec![None; scene.materials().len()],
            hits: HitBatch::default(),
            outputs: OutputBatch::default(),
            wave_hits: Vec::new(),
            run: Run::default(),
        }
    }

    /// Styles lines of a material whose shader has a `line`.
    pub fn style_lines(&mut self, material: MaterialId, pairs: &PairBatch, styles: &mut LineStyles) {
        self.shading.style(material, pairs, styles, &mut self.errors);
    }

    /// Script evaluations so far.
    #[must_use]
    pub fn evaluations(&self) -> u64 {
        self.shading.evaluations()
    }
}

impl<'a> TileTracer<'a> {
    /// A tracer for a scene under its plan.
    #[must_use]
    pub fn new(scene: &'a Scene, plan: &'a Plan, world: &'a World, lighting: &'a Lighting) -> Self {
        let settings = scene.render();
        let (angle, width) = scene.camera().pixel_spread(settings.size[1]);
        Self {
            scene,
            plan,
            world,
            lighting,
            positions: SamplePositions::new(settings.sampler, settings.samples, settings.seed),
            rays: scene.camera().rays(settings.size),
            transparent: settings.background == Background::Transparent,
            stand_ins: scene.stand_ins(),
            cone: Cone { width, spread: angle },
            follows_cones: plan.follows_cones(),
            marker: marker(plan.color, plan.lines.is_some()),
        }
    }

    /// Traces and shades all samples of a rectangle of pixels.
    pub fn trace(&self, rect: PixelRect, context: &mut TraceContext<'_>) -> TracedTile {
        self.trace_with(rect, context, Memory::default())
    }

    /// The same with a memory: what is known of the rays is not traced again.
    pub fn trace_with(&self, rect: PixelRect, context: &mut TraceContext<'_>, memory: Memory<'_>) -> TracedTile {
        if memory.known.is_some() && memory.keep {
            // A record that answers every ray need not be made again.
            let errors = context.errors.clone();
            let traced = self.trace_tile(rect, context, Memory { keep: false, only_known: true, ..memory });
            if traced.rays == RayCounts::default() {
                return traced;
            }
            context.errors = errors;
        }
        self.trace_tile(rect, context, memory)
    }

    fn trace_tile(&self, rect: PixelRect, context: &mut TraceContext<'_>, memory: Memory<'_>) -> TracedTile {
        let clock = CpuClock::thread();
        let mut work = Work { known: memory.known, ..Work::new(self.scene.materials().len()) };
        let mut record = memory.keep.then(|| TileRecord::new(self.lighting.len()));
        let layout = &self.plan.layout;
        let per_pixel = layout.samples_per_pixel as usize;
        let offsets = self.positions.of_rect(self.world.arch, &rect, layout.samples_per_pixel);
        let mut samples = SampleBufferBuilder::with_places(rect, layout, offsets);
        let run_samples = if self.plan.has_secondary_rays() { RUN_SAMPLES_BRANCHING } else { RUN_SAMPLES };
        let run_pixels = (run_samples / per_pixel).max(1);
        // A record has to know of every ray.
        let may_be_clear = memory.known.is_none() && record.is_none();
        for Pixels { places, are_clear } in self.runs(rect, run_pixels, may_be_clear) {
            if are_clear {
                let rays = (places.len() * per_pixel) as u64;
                work.rays.camera += rays;
                work.rays.spared += rays;
                self.store_clear(rect, places, &mut samples);
                continue;
            }
            self.trace_run(rect, places, (&mut samples, &mut record), context, &mut work);
            if memory.only_known && work.rays != RayCounts::default() {
                break;
            }
        }
        let samples = samples.finish();
        let record = record.map(TileRecord::finish);
        let Work { rays, hits, shade_seconds, .. } = work;
        TracedTile { samples, record, rays, hits, shade_seconds, seconds: clock.seconds() }
    }

    fn trace_run(
        &self,
        rect: PixelRect,
        pixels: Range<usize>,
        (samples, record): (&mut SampleBufferBuilder, &mut Option<TileRecord>),
        context: &mut TraceContext<'_>,
        work: &mut Work<'_>,
    ) {
        let mut run = std::mem::take(&mut context.run);
        run.clear();
        run.record.clear(record.is_some(), self.lighting.len());
        let film = self.film(rect, samples);
        let count = pixels.len() * film.per_pixel;
        run.roots = count;
        run.positions.resize(if self.plan.layout.position { count } else { 0 }, Vec3::ZERO);
        run.aovs.resize(count * self.plan.layout.aovs, Vec3::ZERO);
        if self.camera_rays_are_plain(work) {
            self.run_camera_wave(&film, pixels, &mut run, context, work);
        } else {
            self.start(&film, pixels, &mut run);
            if !self.plan.bodies.is_empty() {
                self.start_in_media(&mut run, context, work);
            }
        }
        while !run.next.is_empty() {
            let wave = std::mem::take(&mut run.next);
            self.run_wave(wave, &mut run, context, work);
        }
        run.gather_radiance();
        run.surfaces.sort_by_key(|&(node, place, ..)| (place, node));
        self.store(&mut run, samples);
        if let Some(record) = record {
            record.add(&run);
        }
        context.run = run;
    }

    /// Makes the camera rays of a run of pixels the next wave.
    fn start(&self, film: &Film<'_>, pixels: Range<usize>, run: &mut Run) {
        for (sample, pixel, offset) in film.samples(pixels) {
            let (origin, direction) = self.rays.ray(pixel, offset);
            let node = run.nodes.len() as u32;
            run.next.push(WaveRay { origin, direction, node, after: None, passed: 0, media: 0, counted: 0 });
            run.nodes.push(TreeNode::root(sample, self.cone));
        }
    }

    /// The samples of a tile on the film.
    pub(super) fn film<'s>(&self, rect: PixelRect, samples: &'s SampleBufferBuilder) -> Film<'s> {
        let per_pixel = self.plan.layout.samples_per_pixel as usize;
        Film { rect, per_pixel, offsets: samples.places() }
    }

    /// Traces and shades one wave; what it mirrors and refracts becomes the next.
    fn run_wave(&self, mut wave: Vec<WaveRay>, run: &mut Run, context: &mut TraceContext<'_>, work: &mut Work<'_>) {
        // Rays that met something of opacity 0 go round again, for the same node.
        while !wave.is_empty() {
            let mut hits = self.find_hits(&wave, run, work);
            wave.clear();
            self.shade_hits(&mut hits, run, context, work);
            run.forget_behind_again();
            std::mem::swap(&mut wave, &mut run.again);
        }
        if !run.behind.is_empty() {
            self.shade_behind(run, context, work);
        }
    }

    /// Shades the hits of a wave, material by material.
    fn shade_hits(&self, hits: &mut [WaveHit], run: &mut Run, context: &mut TraceContext<'_>, work: &mut Work<'_>) {
        // Stable, so that rays stay in the order of their samples within a material.
        hits.sort_by_key(|hit| hit.material);
        for group in hits.chunk_by(|a, b| a.material == b.material) {
            self.shade_group(group, run, context, work);
        }
    }

    /// Whether camera rays are asked for no more than their closest hits, none of which is known.
    fn camera_rays_are_plain(&self, work: &Work<'_>) -> bool {
        work.known.is_none() && self.plan.bodies.is_empty() && !self.keeps_list(NodePath::CAMERA)
    }

    /// Wave 0 where camera rays are plain: in packets from the film to what they meet. What misses everything is done at once.
    fn run_camera_wave(
        &self,
        film: &Film<'_>,
        pixels: Range<usize>,
        run: &mut Run,
        context: &mut TraceContext<'_>,
        work: &mut Work<'_>,
    ) {
        let mut hits = std::mem::take(&mut context.wave_hits);
        for FilmPacket { first, places, count } in film.packets(pixels) {
            let (rays, met) = self.world.closest_of_camera(&self.rays, &places, count);
            let surfaces = surfaces_of(self.world, &met);
            let starts = rays.ray_starts();
            work.rays.camera += count as u64;
            for lane in 0..count {
                let node = run.nodes.len() as u32;
                let (origin, direction) = starts[lane];
                let ray = || WaveRay { origin, direction, node, after: None, passed: 0, media: 0, counted: 0 };
                if run.record.is_wanted() {
                    run.record.note(&ray(), met[lane].as_ref(), true);
                }
                let mut root = TreeNode::root(first + lane as u32, self.cone);
                match met[lane] {
                    Some(hit) => {
                        let surface = surfaces[lane].unwrap_or_else(|| Surface::new(self.world, direction, &hit));
                        hits.push(self.hit_of(ray(), &hit, surface, &root, 0));
                    }
                    None => self.miss(&mut root, direction),
                }
                run.nodes.push(root);
            }
        }
        self.shade_hits(&mut hits, run, context, work);
        hits.clear();
        context.wave_hits = hits;
        let again = std::mem::take(&mut run.again);
        self.run_wave(again, run, context, work);
    }

    /// A node whose ray leaves the scene.
    fn miss(&self, node: &mut TreeNode, direction: Vec3) {
        node.radiance = self.lighting.background(direction);
        node.alpha = if self.transparent { 0.0 } else { 1.0 };
    }

    fn find_hits(&self, wave: &[WaveRay], run: &mut Run, work: &mut Work<'_>) -> Vec<WaveHit> {
        let mut hits = Vec::with_capacity(wave.len());
        let mut list = Vec::new();
        let mut packet: Packet = [None; LANES];
        for (index, wave_ray) in wave.iter().enumerate() {
            if index % LANES == 0 {
                let rays = &wave[index..(index + LANES).min(wave.len())];
                packet = if work.known.is_some() { [None; LANES] } else { self.packet_hits(rays, run) };
            }
            let Run { nodes, behind, media, crossings, record, .. } = run;
            let node = &mut nodes[wave_ray.node as usize];
            let ray = Ray::new(wave_ray.origin, wave_ray.direction);
            let mut from = *wave_ray;
            let known = self.known_hit(work, node, wave_ray, &mut list);
            let mut is_known = known.is_some();
            let mut at_once = known.or(packet[index % LANES]);
            // Whether what is seen is what was met first, so that a record of it serves the same ray again.
            let mut met_first = true;
            let seen = loop {
                let kind = if is_known { seen_as(node.kind) } else { work.count(node.kind) };
                if !std::mem::take(&mut is_known) {
                    list.clear();
                }
                let found = if let Some(found) = at_once.take() {
                    found
                } else if from.passed >= MOST_INVISIBLE {
                    None
                } else if self.keeps_list(node.path) {
                    self.surface_list(&ray, kind, &from, &[], &mut list);
                    list.first().copied()
                } else {
                    self.world.next_hit(&ray, kind, from.after.as_ref())
                };
                let Some(found) = found else { break None };
                if self.plan.bodies.is_empty() {
                    break Some(Seen { hit: found, error: Vec3::ZERO, crossing: None });
                }
                if let Some(seen) = self.cross(&ray, kind, &mut from, &found, media) {
                    met_first = seen.hit == found;
                    break Some(seen);
                }
            };
            record.note(&from, seen.as_ref().map(|seen| &seen.hit), met_first);
            let Some(Seen { hit, error, crossing }) = seen else {
                self.miss(node, from.direction);
                continue;
            };
            // What else is at the place of a crossing is seen through it.
            let is_behind = |other: &&Hit| other.facet() != hit.facet() && (crossing.is_none() || other.t > hit.t);
            let behind_it = list.iter().filter(is_behind).zip(1..);
            behind.extend(behind_it.map(|(hit, place)| self.wave_hit(&from, hit, node, place)));
            let mut hit = self.wave_hit(&from, &hit, node, 0);
            hit.surface.error = hit.surface.error.max(error);
            if let Some(crossing) = crossing {
                hit.crossing = Some(crossings.len() as u32);
                crossings.push(crossing);
            }
            hits.push(hit);
        }
        hits
    }

    /// What a ray meets, if a record tells, with its list of surfaces. Which surfaces a list holds is known only where
    /// none can be invisible.
    fn known_hit(&self, work: &Work<'_>, node: &TreeNode, ray: &WaveRay, list: &mut Vec<Hit>) -> Option<Option<Hit>> {
        let known = work.known?;
        list.clear();
        if !self.keeps_list(node.path) {
            return known.met(node, ray);
        }
        if !self.plan.lists_are_opaque() {
            return None;
        }
        let first = known.met(node, ray)?;
        list.extend(first);
        list.extend(known.behind(node.path, node.sample));
        Some(first)
    }

    /// What camera rays meet that start together; `None` for rays that are to be traced one by one: those of mirrors and glass
    /// scatter, and those with lists or behind something invisible want more than the closest hit.
    fn packet_hits(&self, rays: &[WaveRay], run: &Run) -> Packet {
        let is_plain = |ray: &WaveRay| {
            let node = &run.nodes[ray.node as usize];
            node.kind == PathKind::Camera && ray.after.is_none() && !self.keeps_list(node.path)
        };
        if !rays.iter().all(is_plain) {
            return [None; LANES];
        }
        let packet = RayPacket::of(rays.iter().map(|ray| (ray.origin, ray.direction)));
        self.world.closest_of(&packet, RayKinds::CAMERA).map(Some)
    }

    /// A hit on its way to be shaded.
    #[inline]
    pub(super) fn wave_hit(&self, from: &WaveRay, hit: &Hit, node: &TreeNode, place: usize) -> WaveHit {
        self.hit_of(*from, hit, Surface::new(self.world, from.direction, hit), node, place)
    }

    /// The same of a surface that is known.
    #[inline]
    fn hit_of(&self, ray: WaveRay, hit: &Hit, surface: Surface, node: &TreeNode, place: usize) -> WaveHit {
        WaveHit {
            ray,
            hit: *hit,
            surface,
            material: self.world.material(hit),
            depth: node.length_before + hit.t,
            place: place as u32,
            crossing: None,
        }
    }

    /// Hands the nodes of a run to the sample buffer.
    fn store(&self, run: &mut Run, samples: &mut SampleBufferBuilder) {
        let layout = &self.plan.layout;
        let roots = &run.nodes[..run.roots];
        for node in roots {
            let color = SampleColor { color: node.radiance.to_array(), alpha: node.alpha };
            samples.set_color(node.sample, color, node.culprit);
        }
        if layout.position || layout.aovs > 0 {
            let mut extras = Vec::with_capacity(layout.aovs);
            for (root, node) in roots.iter().enumerate() {
                let position = run.positions.get(root).copied().unwrap_or_default();
                extras.clear();
                extras.extend(run.aovs[root * layout.aovs..(root + 1) * layout.aovs].iter().map(|aov| aov.to_array()));
                samples.set_extras(node.sample, position.to_array(), &extras);
            }
        }
        // Without a line pass nobody asks what mirrors and glass show.
        let kept = if self.plan.lines.is_some() { run.nodes.len() } else { roots.len() };
        let (roots, others) = run.nodes[..kept].split_at(roots.len());
        let is_plain_miss = |node: &TreeNode| node.attributes == TreeNode::MISS && !layout.columns.contribution;
        for nodes in roots.chunk_by(|a, b| is_plain_miss(a) == is_plain_miss(b)) {
            let (first, last) = (nodes[0].sample, nodes[nodes.len() - 1].sample);
            if is_plain_miss(&nodes[0]) {
                samples.push_same(NodePath::CAMERA, first..=last, attributes_of(&run.attributes, &nodes[0]));
            } else if layout.columns.contribution {
                for node in nodes {
                    samples.push(NodePath::CAMERA, node.sample, attributes_of(&run.attributes, node));
                }
            } else {
                // Of the camera's nodes, throughput is 1.
                let places = nodes.iter().map(|node| node.attributes as usize);
                samples.push_row(NodePath::CAMERA, first..last + 1, &mut run.attributes, places);
            }
        }
        for node in others {
            samples.push(node.path, node.sample, attributes_of(&run.attributes, node));
        }
        for &(node, place, _, attributes) in &run.surfaces {
            let node = &run.nodes[node as usize];
            samples.push_behind(node.path, place as usize, node.sample, attributes);
        }
    }
}

/// What the line pass sees of a node.
fn attributes_of(attributes: &[Node], node: &TreeNode) -> Node {
    let attributes = attributes.get(node.attributes as usize).copied().unwrap_or_default();
    let contribution = (node.throughput * node.radiance).to_array();
    Node { throughput: node.throughput.to_array(), contribution, ..attributes }
}

/// What is known of a tile's rays before they are traced, and whether what they meet is to be known afterwards.
#[derive(Clone, Copy, Debug, Default)]
pub struct Memory<'a> {
    /// The record of an earlier picture of the same objects, camera and sample positions.
    pub known: Option<&'a TileRecord>,
    /// Whether to keep a record. If all was known, there is none: the known one serves on.
    pub keep: bool,
    /// Whether to give up where a ray must be traced.
    only_known: bool,
}

impl<'a> Memory<'a> {
    /// A memory of what is known, if anything is.
    #[must_use]
    pub fn new(known: Option<&'a TileRecord>, keep: bool) -> Self {
        Self { known, keep, only_known: false }
    }
}

/// Counters of one tile, and what is known of its rays.
pub(super) struct Work<'a> {
    pub known: Option<&'a TileRecord>,
    pub rays: RayCounts,
    pub hits: Vec<u64>,
    pub shade_seconds: Vec<f64>,
}

impl Work<'_> {
    pub fn new(materials: usize) -> Self {
        Self { known: None, rays: RayCounts::default(), hits: vec![0; materials], shade_seconds: vec![0.0; materials] }
    }

    /// Counts a ray towards a node; returns what objects see it as.
    pub fn count(&mut self, kind: PathKind) -> RayKinds {
        let count = match kind {
            PathKind::Camera | PathKind::Shadow => &mut self.rays.camera,
            PathKind::Reflection => &mut self.rays.reflection,
            PathKind::Refraction => &mut self.rays.refraction,
        };
        *count += 1;
        seen_as(kind)
    }
}

/// What objects see a ray towards a node as.
fn seen_as(kind: PathKind) -> RayKinds {
    match kind {
        PathKind::Camera | PathKind::Shadow => RayKinds::CAMERA,
        PathKind::Reflection => RayKinds::REFLECTION,
        PathKind::Refraction => RayKinds::REFRACTION,
    }
}

/// A row of an output column; the default where the column is absent.
#[inline]
pub(super) fn value<T: Copy>(column: &[T], row: usize, default: T) -> T {
    column.get(row).copied().unwrap_or(default)
}
