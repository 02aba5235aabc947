//! Where the samples of a tile lie on the film, one by one and in packets.

use std::ops::Range;

use super::packet::LANES;
use crate::sample::PixelRect;

/// Samples of a tile on the film.
pub(super) struct Film<'a> {
    pub rect: PixelRect,
    pub per_pixel: usize,
    /// Places in their pixels of all samples of the tile.
    pub offsets: &'a [[f32; 2]],
}

/// A packet of them.
pub(super) struct FilmPacket {
    /// Number in the tile of the first; the others follow.
    pub first: u32,
    /// Pixels and places in them. Behind the last, it is repeated.
    pub places: [([i32; 2], [f32; 2]); LANES],
    /// How many there are, at least 1.
    pub count: usize,
}

impl Film<'_> {
    /// The samples of some pixels of the tile, one by one: number in the tile, pixel, and place in the pixel.
    pub fn samples(&self, pixels: Range<usize>) -> impl Iterator<Item = (u32, [i32; 2], [f32; 2])> {
        self.packets(pixels).flat_map(|packet| {
            let FilmPacket { first, places, count } = packet;
            (first..).zip(places).take(count).map(|(sample, (pixel, offset))| (sample, pixel, offset))
        })
    }

    /// The samples of some pixels of the tile, packet by packet.
    pub fn packets(&self, pixels: Range<usize>) -> impl Iterator<Item = FilmPacket> {
        let end = pixels.end * self.per_pixel;
        (pixels.start * self.per_pixel..end).step_by(LANES).map(move |first| self.packet(first, LANES.min(end - first)))
    }

    /// Some samples, at least one, from a number on.
    #[inline]
    fn packet(&self, first: usize, count: usize) -> FilmPacket {
        let Self { rect, per_pixel, offsets } = self;
        let mut places = [([0; 2], [0.0; 2]); LANES];
        let width = rect.width() as usize;
        let (mut pixel, mut within) = (first / per_pixel, first % per_pixel);
        let mut lane = 0;
        while lane < count {
            let at = [rect.x0 + (pixel % width) as i32, rect.y0 + (pixel / width) as i32];
            let end = count.min(lane + per_pixel - within);
            for (place, offset) in places[lane..end].iter_mut().zip(&offsets[first + lane..]) {
                *place = (at, *offset);
            }
            (pixel, within, lane) = (pixel + 1, 0, end);
        }
        let last = places[count - 1];
        places[count..].fill(last);
        FilmPacket { first: first as u32, places, count }
    }
}
