//! Even ground: pixels that need no filter, because all samples that reach them have one value.
//!
//! The filtered value of equal values is that value, whatever their weights. Most of a line picture is such ground (paper,
//! flat paint), and to find it costs a look at each sample instead of weights for each sample and target. Whether a pixel is
//! even depends on the samples in its reach alone, so neither tiles nor crops change a bit.

use crate::math::Vec4;
use crate::sample::PixelRect;

/// Which pixels of a rectangle are even in one field, and what they are.
#[derive(Debug)]
pub(super) struct EvenGround {
    /// What has samples that may reach the rectangle.
    sources: PixelRect,
    reach: i32,
    /// The one value of each source pixel's samples; `None` where they differ, or there are none.
    values: Vec<Option<Vec4>>,
    /// Sources without a value.
    mixed: Counts,
    /// Sources with another value than the one left of them.
    left: Counts,
    /// Sources with another value than the one above them.
    above: Counts,
    /// Pixels of the rectangle that are not even.
    uneven: Counts,
}

impl EvenGround {
    /// `values` are those of the pixels that reach `rect`, row by row.
    pub(super) fn new(rect: PixelRect, reach: i32, values: Vec<Option<Vec4>>) -> Self {
        let sources = rect.grown(reach);
        if values.iter().all(|value| value.is_some() && *value == values[0]) {
            let [mixed, left, above, uneven] = [(); 4].map(|()| Counts::default());
            return Self { sources, reach, mixed, left, above, uneven, values };
        }
        let of = |x: i32, y: i32| place(sources, [x, y]).and_then(|place| values[place]);
        let mixed = Counts::new(sources, |x, y| of(x, y).is_none());
        let left = Counts::new(sources, |x, y| of(x, y) != of(x - 1, y));
        let above = Counts::new(sources, |x, y| of(x, y) != of(x, y - 1));
        let uneven = Counts::default();
        let mut ground = Self { sources, reach, mixed, left, above, uneven, values };
        ground.uneven = Counts::new(rect, |x, y| !ground.surrounds([x, y]));
        ground
    }

    /// Whether all samples that reach a pixel have one value.
    fn surrounds(&self, [x, y]: [i32; 2]) -> bool {
        let around = PixelRect { x0: x, y0: y, x1: x + 1, y1: y + 1 }.grown(self.reach);
        !self.mixed.any(around)
            && !self.left.any(PixelRect { x0: around.x0 + 1, ..around })
            && !self.above.any(PixelRect { y0: around.y0 + 1, x1: around.x0 + 1, ..around })
    }

    /// Whether samples of a pixel reach one that is not even.
    pub(super) fn is_filtered(&self, [x, y]: [i32; 2]) -> bool {
        self.uneven.any(PixelRect { x0: x, y0: y, x1: x + 1, y1: y + 1 }.grown(self.reach))
    }

    /// The value of a pixel of the rectangle, if it is even.
    pub(super) fn value(&self, pixel: [i32; 2]) -> Option<Vec4> {
        if self.surrounds(pixel) { self.values[place(self.sources, pixel)?] } else { None }
    }
}

/// Where a pixel's value stands; `None` outside.
fn place(sources: PixelRect, [x, y]: [i32; 2]) -> Option<usize> {
    let place = || (y - sources.y0) as usize * sources.width() as usize + (x - sources.x0) as usize;
    sources.contains(x, y).then(place)
}

/// How many pixels of any rectangle are marked, from a table of sums (Crow 1984).
#[derive(Debug)]
struct Counts {
    rect: PixelRect,
    /// For each corner of a pixel: marked pixels above and left of it.
    sums: Vec<u32>,
}

impl Default for Counts {
    fn default() -> Self {
        Self::new(PixelRect::of_size([0, 0]), |_, _| false)
    }
}

impl Counts {
    fn new(rect: PixelRect, is_marked: impl Fn(i32, i32) -> bool) -> Self {
        let stride = rect.width() as usize + 1;
        let mut sums = vec![0; stride * (rect.height() as usize + 1)];
        for (y, row) in (rect.y0..rect.y1).zip(1..) {
            let mut marked = 0;
            for (x, column) in (rect.x0..rect.x1).zip(1..) {
                marked += u32::from(is_marked(x, y));
                sums[row * stride + column] = sums[(row - 1) * stride + column] + marked;
            }
        }
        Self { rect, sums }
    }

    /// Whether any pixel of a rectangle is marked; those outside the table are not.
    fn any(&self, rect: PixelRect) -> bool {
        let part = rect.intersection(&self.rect);
        if part.pixels() == 0 {
            return false;
        }
        let stride = self.rect.width() as usize + 1;
        let sum = |x: i32, y: i32| self.sums[(y - self.rect.y0) as usize * stride + (x - self.rect.x0) as usize];
        sum(part.x1, part.y1) + sum(part.x0, part.y0) > sum(part.x0, part.y1) + sum(part.x1, part.y0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether each pixel is even, by looking at all sources.
    fn brute(rect: PixelRect, reach: i32, values: &[Option<Vec4>]) -> Vec<bool> {
        let sources = rect.grown(reach);
        let of = |x: i32, y: i32| values[place(sources, [x, y]).unwrap_or(0)];
        let pixels = (rect.y0..rect.y1).flat_map(|y| (rect.x0..rect.x1).map(move |x| (x, y)));
        pixels
            .map(|(x, y)| {
                let own = of(x, y);
                own.is_some() && (y - reach..=y + reach).all(|b| (x - reach..=x + reach).all(|a| of(a, b) == own))
            })
            .collect()
    }

    #[test]
    fn pixels_are_even_where_all_sources_in_reach_agree() {
        let mut state = 1_u32;
        let mut even = 0;
        for case in 0..300 {
            let mut random = |below: u32| {
                state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
                (state >> 16) % below
            };
            let reach = case % 4;
            let rect = PixelRect { x0: -3, y0: 5, x1: -3 + 1 + random(12) as i32, y1: 5 + 1 + random(12) as i32 };
            let mut values = vec![Some(Vec4::ONE); rect.grown(reach).pixels()];
            for _ in 0..random(4) {
                let place = random(values.len() as u32) as usize;
                let value = [None, Some(Vec4::ZERO), Some(Vec4::ONE)][random(3) as usize];
                let many = random(30) as usize;
                values.iter_mut().skip(place).take(many).for_each(|known| *known = value);
            }
            let expected = brute(rect, reach, &values);
            let ground = EvenGround::new(rect, reach, values);
            let pixels = (rect.y0..rect.y1).flat_map(|y| (rect.x0..rect.x1).map(move |x| [x, y]));
            let found: Vec<bool> = pixels.map(|pixel| ground.value(pixel).is_some()).collect();
            assert_eq!(found, expected, "case {case}");
            even += found.iter().filter(|even| **even).count();
            for y in rect.y0 - reach..rect.y1 + reach {
                for x in rect.x0 - reach..rect.x1 + reach {
                    let targets = PixelRect { x0: x, y0: y, x1: x + 1, y1: y + 1 }.grown(reach).intersection(&rect);
                    let mut reached =
                        (targets.y0..targets.y1).flat_map(|y| (targets.x0..targets.x1).map(move |x| [x, y]));
                    let reaches = reached.any(|pixel| ground.value(pixel).is_none());
                    assert_eq!(ground.is_filtered([x, y]), reaches, "case {case} at {x}, {y}");
                }
            }
        }
        assert!(even > 1000, "{even}");
    }
}
