//! Pixels that surely show the background alone.
//!
//! All rays of a camera through some pixels lie within bounds. Where these enter the box of no object, no ray would meet
//! anything: nothing is traced, and all samples are the same but for their places. The bounds are wider than all that the box
//! test of a single ray can round, so what is left out is what would have missed, bit for bit.

use std::ops::Range;

use super::eight::{Eights, Task, dispatch};
use super::packet::Bundle;
use super::tree::{Leaf, Visitor};
use super::wave::{FilmPlaces, TileTracer};
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

    /// Stores the samples of pixels that show the background alone.
    pub(super) fn store_clear(&self, rect: PixelRect, pixels: Range<usize>, samples: &mut SampleBufferBuilder) {
        let layout = &self.plan.layout;
        let per_pixel = layout.samples_per_pixel;
        let even = self.lighting.even_background();
        let node = |radiance: Vec3| Node { contribution: radiance.to_array(), ..Node::default() };
        let alpha = if self.transparent { 0.0 } else { 1.0 };
        let extras = vec![[0.0; 3]; layout.aovs];
        let mut places = self.film_places(rect, pixels.clone());
        while let Some(FilmPlaces { samples: numbers, film, count }) = FilmPlaces::next(&mut places) {
            // Only an uneven background asks where rays go.
            let rays = even.is_none().then(|| self.world.camera_packet(&self.rays, &film, count));
            for lane in 0..count {
                let towards = rays.as_ref().map_or(Vec3::ZERO, |rays| rays.ray_start(lane).1);
                let radiance = even.unwrap_or_else(|| self.lighting.background(towards));
                let sample = numbers[lane];
                samples.set_sample(sample, film[lane].1, SampleColor { color: radiance.to_array(), alpha }, 0);
                if layout.position || layout.aovs > 0 {
                    samples.set_extras(sample, [0.0; 3], &extras);
                }
                if layout.columns.contribution {
                    samples.push(NodePath::CAMERA, sample, node(radiance));
                }
            }
        }
        if !layout.columns.contribution && !pixels.is_empty() {
            let [first, end] = [pixels.start, pixels.end].map(|pixel| pixel as u32 * per_pixel);
            samples.push_same(NodePath::CAMERA, first..=end - 1, node(Vec3::ZERO));
        }
    }
}
