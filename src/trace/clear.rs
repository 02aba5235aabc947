//! Pixels that surely show the background alone.
//!
//! All rays of a camera through some pixels lie within bounds. Where these enter the box of no object, no ray would meet
//! anything: nothing is traced, and all samples are the same but for their places. The bounds are wider than all that the box
//! test of a single ray can round, so what is left out is what would have missed, bit for bit.

use std::ops::Range;

use super::eight::{Eights, Task, dispatch};
use super::film::FilmPacket;
use super::packet::Bundle;
use super::tree::{Leaf, Visitor};
use super::wave::TileTracer;
use super::world::World;
use crate::math::Vec3;
use crate::sample::{Node, NodePath, PixelRect, SampleBufferBuilder, SampleColor};
use crate::scene::camera::CameraRays;

/// Pixels that are looked at together, in the order of a tile.
const SEGMENT: usize = 16;

/// A run of a tile's pixels.
pub(super) struct Pixels {
    pub places: Range<usize>,
    /// Whether no ray through them meets anything.
    pub are_clear: bool,
}

impl World {
    /// Whether no ray of a camera through the pixels from `first` to `last` (both included, column and row) enters the box of any object.
    pub(super) fn is_clear(&self, camera: &CameraRays, first: [i32; 2], last: [i32; 2]) -> bool {
        let [origin, direction] = camera.bounds(first, last);
        dispatch(self.arch, Enters { world: self, rays: Bundle::within(origin, direction) })
    }
}

struct Enters<'a> {
    world: &'a World,
    rays: Bundle,
}

impl Task for Enters<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<E: Eights>(self, eights: E) -> bool {
        let (mut clear, mut reach) = (Clear(true), f32::INFINITY);
        self.world.tree.walk(eights, &self.rays, &mut reach, &mut clear);
        clear.0
    }
}

/// Whether no leaf was visited.
struct Clear(bool);

impl Visitor for &mut Clear {
    #[inline(always)]
    fn leaf<E: Eights>(&mut self, _: E, _: Leaf<'_>, _: &mut f32) -> bool {
        self.0 = false;
        false
    }
}

impl TileTracer<'_> {
    /// Cuts a tile into runs of pixels, of at most `most` where rays must be traced; none is clear unless `may_be_clear`.
    pub(super) fn runs(&self, rect: PixelRect, most: usize, may_be_clear: bool) -> Vec<Pixels> {
        let width = rect.width() as usize;
        let place = |index: usize| [rect.x0 + (index % width) as i32, rect.y0 + (index / width) as i32];
        let mut runs: Vec<Pixels> = Vec::new();
        let segment = SEGMENT.min(most.max(1));
        for start in (0..rect.pixels()).step_by(segment) {
            let places = start..(start + segment).min(rect.pixels());
            let (mut first, mut last) = (place(places.start), place(places.end - 1));
            if first[1] != last[1] {
                (first[0], last[0]) = (rect.x0, rect.x1 - 1);
            }
            let are_clear = may_be_clear && self.world.is_clear(&self.rays, first, last);
            match runs.last_mut() {
                Some(run) if run.are_clear == are_clear && (are_clear || run.places.len() + places.len() <= most) => {
                    run.places.end = places.end;
                }
                _ => runs.push(Pixels { places, are_clear }),
            }
        }
        runs
    }

    /// Stores the samples of pixels that show the background alone: their colours, as extra outputs and positions are 0 from the start.
    pub(super) fn store_clear(&self, rect: PixelRect, pixels: Range<usize>, samples: &mut SampleBufferBuilder) {
        let film = self.film(rect, samples);
        let [first, end] = [pixels.start, pixels.end].map(|pixel| (pixel * film.per_pixel) as u32);
        let node = |radiance: Vec3| Node { contribution: radiance.to_array(), ..Node::default() };
        let alpha = if self.transparent { 0.0 } else { 1.0 };
        let color = |radiance: Vec3| SampleColor { color: radiance.to_array(), alpha };
        let same = if let Some(radiance) = self.lighting.even_background() {
            samples.set_same_color(first..end, color(radiance));
            Some(radiance)
        } else {
            let mut background = Vec::with_capacity((end - first) as usize);
            for FilmPacket { places, count, .. } in film.packets(pixels) {
                let rays = self.world.camera_packet(&self.rays, &places, count);
                background.extend((0..count).map(|lane| self.lighting.background(rays.ray_start(lane).1)));
            }
            let keeps_contribution = self.plan.layout.columns.contribution;
            for (sample, radiance) in (first..end).zip(background) {
                samples.set_color(sample, color(radiance), 0);
                if keeps_contribution {
                    samples.push(NodePath::CAMERA, sample, node(radiance));
                }
            }
            (!keeps_contribution).then_some(Vec3::ZERO)
        };
        if let Some(radiance) = same.filter(|_| first < end) {
            samples.push_same(NodePath::CAMERA, first..=end - 1, node(radiance));
        }
    }
}
