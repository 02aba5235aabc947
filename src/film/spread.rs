//! The weighted sums of a rectangle of pixels: the arithmetic under [`super::develop()`].
//!
//! A *tap* is a target pixel's place relative to a source pixel, from −reach to +reach along each axis. Rows of taps
//! are padded to whole groups of four with weights of 0, so that one group is one SIMD register. The sums have as many
//! columns more than the rectangle as a group can overhang, which spares the inner loops any test for the border.

use std::ops::Range;

use super::filter::{Filter, GROUP};
use crate::math::Vec4;
use crate::sample::PixelRect;

/// The least share of Σ |w| that Σ w may be: below, dividing would make a pixel more than 10 times as bright as its
/// brightest sample.
const CANCELLED: f32 = 0.1;

/// Weighted sums of one field over the pixels of a rectangle.
#[derive(Clone, Debug)]
pub(super) struct Sums {
    values: Vec<Vec4>,
}

/// The size of the sums of a rectangle.
#[derive(Clone, Copy, Debug)]
struct Layout {
    rect: PixelRect,
    reach: usize,
    /// Groups of taps in a row.
    groups: usize,
    /// Sums per row.
    stride: usize,
}

impl Layout {
    fn new(filter: &Filter, rect: PixelRect) -> Self {
        let reach = filter.reach() as usize;
        let groups = filter.groups();
        Self { rect, reach, groups, stride: rect.width() as usize + 2 * reach + GROUP * groups - 1 }
    }

    fn len(&self) -> usize {
        self.stride * self.rect.height() as usize
    }

    /// The place of the sum of each pixel, row by row.
    fn places(self) -> impl Iterator<Item = usize> {
        let width = self.rect.width() as usize;
        (0..self.rect.height() as usize)
            .flat_map(move |y| (0..width).map(move |x| y * self.stride + 2 * self.reach + x))
    }
}

impl Sums {
    pub(super) fn new(filter: &Filter, rect: PixelRect) -> Self {
        Self { values: vec![Vec4::ZERO; Layout::new(filter, rect).len()] }
    }
}

/// Spreads the values of one source pixel after another, and keeps the sums of the weights.
#[derive(Debug)]
pub(super) struct Spread {
    layout: Layout,
    /// Place of the source pixel's first tap in its row of the sums.
    column: usize,
    /// Row taps that fall inside the rectangle.
    taps: Range<usize>,
    /// Row of the sums of the first of those.
    row: usize,
    samples: usize,
    /// Weights along x: for each group of taps, for each sample.
    along_x: Vec<Vec4>,
    /// Weights along y, likewise.
    along_y: Vec<Vec4>,
    totals: Vec<f32>,
    /// Sums of the weights' magnitudes, where those differ from the weights.
    magnitudes: Vec<f32>,
    /// Square of the largest weight along an axis.
    peak: f32,
}

impl Spread {
    pub(super) fn new(filter: &Filter, rect: PixelRect) -> Self {
        let layout = Layout::new(filter, rect);
        let magnitudes = if filter.has_negative_lobes() { layout.len() } else { 0 };
        Self {
            layout,
            column: 0,
            taps: 0..0,
            row: 0,
            samples: 0,
            along_x: Vec::new(),
            along_y: Vec::new(),
            totals: vec![0.0; layout.len()],
            magnitudes: vec![0.0; magnitudes],
            peak: filter.weight(0.0) * filter.weight(0.0),
        }
    }

    /// Makes a source pixel the current one: looks up the weights of its samples and adds them to the totals.
    pub(super) fn weigh(&mut self, filter: &Filter, pixel: [i32; 2], offsets: &[[f32; 2]]) {
        let Layout { rect, reach, groups, .. } = self.layout;
        let last = 2 * reach as i32;
        let reach_rows = reach as i32;
        let first_tap = (rect.y0 - pixel[1] + reach_rows).clamp(0, last + 1);
        let end_tap = (rect.y1 - pixel[1] + reach_rows).clamp(first_tap, last + 1);
        self.taps = first_tap as usize..end_tap as usize;
        self.row = (pixel[1] + first_tap - reach_rows - rect.y0).max(0) as usize;
        self.column = (pixel[0] - rect.x0 + reach_rows) as usize;
        self.samples = offsets.len();

        let samples = offsets.len();
        self.along_x.resize(groups * samples, Vec4::ZERO);
        self.along_y.resize(groups * samples, Vec4::ZERO);
        for (sample, [x, y]) in offsets.iter().enumerate() {
            for (group, (x, y)) in filter.weights(*x).zip(filter.weights(*y)).enumerate() {
                self.along_x[group * samples + sample] = x;
                self.along_y[group * samples + sample] = y;
            }
        }

        let mut totals = std::mem::take(&mut self.totals);
        self.add_totals(&mut totals, |weight| weight);
        self.totals = totals;
        if !self.magnitudes.is_empty() {
            let mut magnitudes = std::mem::take(&mut self.magnitudes);
            self.add_totals(&mut magnitudes, Vec4::abs);
            self.magnitudes = magnitudes;
        }
    }

    /// Adds a function of the current pixel's weights to the totals, for each tap in the order of the samples.
    fn add_totals(&self, totals: &mut [f32], function: impl Fn(Vec4) -> Vec4) {
        for group_y in 0..self.layout.groups {
            for group_x in 0..self.layout.groups {
                // Four rows of taps at once, since the additions of one wait for each other.
                let mut rows = [Vec4::ZERO; GROUP];
                for (x, y) in self.of_group(&self.along_x, group_x).iter().zip(self.of_group(&self.along_y, group_y)) {
                    let [y0, y1, y2, y3] = y.to_array();
                    rows[0] += function(*x * y0);
                    rows[1] += function(*x * y1);
                    rows[2] += function(*x * y2);
                    rows[3] += function(*x * y3);
                }
                for (lane, row) in rows.iter().enumerate() {
                    let tap = group_y * GROUP + lane;
                    if self.taps.contains(&tap) {
                        let place = self.place(tap - self.taps.start) + group_x * GROUP;
                        let totals = totals[place..place + GROUP].iter_mut();
                        totals.zip(row.to_array()).for_each(|(total, part)| *total += part);
                    }
                }
            }
        }
    }

    fn of_group<'a>(&self, weights: &'a [Vec4], group: usize) -> &'a [Vec4] {
        &weights[group * self.samples..(group + 1) * self.samples]
    }

    /// The sum of the current pixel's first tap in one of its rows of taps.
    fn place(&self, row: usize) -> usize {
        (self.row + row) * self.layout.stride + self.column
    }

    /// Sums the current pixel's values (one per sample) for each tap. Every sum is in the order of the samples.
    pub(super) fn spread(&self, values: &[Vec4], part: &mut Vec<Vec4>) {
        part.clear();
        for tap in self.taps.clone() {
            let along_y = self.of_group(&self.along_y, tap / GROUP);
            for group in 0..self.layout.groups {
                let mut sums = [Vec4::ZERO; GROUP];
                for ((x, y), value) in self.of_group(&self.along_x, group).iter().zip(along_y).zip(values) {
                    let weights = *x * y.as_ref()[tap % GROUP];
                    sums[0] += *value * weights.x;
                    sums[1] += *value * weights.y;
                    sums[2] += *value * weights.z;
                    sums[3] += *value * weights.w;
                }
                part.extend(sums);
            }
        }
    }

    /// Adds what [`Self::spread`] made of the current pixel.
    pub(super) fn add(&self, part: &[Vec4], sums: &mut Sums) {
        let taps = self.layout.groups * GROUP;
        for (row, part) in part.chunks_exact(taps).enumerate() {
            let place = self.place(row);
            sums.values[place..place + taps].iter_mut().zip(part).for_each(|(sum, part)| *sum += *part);
        }
    }

    /// The sums over the weights' totals, row by row; 0 where no sample is in reach.
    pub(super) fn divide(&self, sums: &Sums) -> Vec<Vec4> {
        let quotient = |place: usize| {
            let total = self.totals[place];
            if self.is_cancelled(place) { Vec4::ZERO } else { sums.values[place] / total }
        };
        self.layout.places().map(quotient).collect()
    }

    /// The pixels whose weights cancel.
    pub(super) fn cancelled(&self) -> Vec<[i32; 2]> {
        let rect = self.layout.rect;
        let pixels = (rect.y0..rect.y1).flat_map(|y| (rect.x0..rect.x1).map(move |x| [x, y]));
        pixels
            .zip(self.layout.places())
            .filter(|(_, place)| self.is_cancelled(*place))
            .map(|(pixel, _)| pixel)
            .collect()
    }

    fn is_cancelled(&self, place: usize) -> bool {
        let total = self.totals[place];
        let magnitude = self.magnitudes.get(place).copied().unwrap_or(total);
        total < CANCELLED * magnitude || total < 1e-6 * self.peak
    }
}
