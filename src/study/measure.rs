//! How far a picture is from its reference: colours, coverage and place of lines, by region.

use super::flip::{PIXELS_PER_DEGREE, flip};

/// What a study looks at of a picture, row by row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shot {
    /// Width in pixels.
    pub width: usize,
    /// Linear colours as a screen shows them: 0 … 1, what is transparent before white.
    pub colors: Vec<[f32; 3]>,
    /// How much of each pixel lines cover.
    pub coverage: Vec<f32>,
    /// How much lines cover that are seen in mirrors and through glass. Empty if there are none.
    pub secondary: Vec<f32>,
}

impl Shot {
    /// The mean of two pictures of one size.
    #[must_use]
    pub fn mean(a: &Self, b: &Self) -> Self {
        let mean = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| (a + b) / 2.0).collect();
        let color = |(a, b): (&[f32; 3], &[f32; 3])| [0, 1, 2].map(|axis| (a[axis] + b[axis]) / 2.0);
        Self {
            width: a.width,
            colors: a.colors.iter().zip(&b.colors).map(color).collect(),
            coverage: mean(&a.coverage, &b.coverage),
            secondary: mean(&a.secondary, &b.secondary),
        }
    }
}

/// Errors of a picture. Those of a region that has no pixels are `None`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Errors {
    /// Root mean square error of linear colours 0 … 1.
    pub rmse: ByRegion,
    /// Mean FLIP, 0 … 1.
    pub flip: ByRegion,
    /// Σ |coverage − reference| / Σ reference: which share of the lines' area is wrong.
    pub coverage: Option<f64>,
    /// The same where lines meet; see [`Reference::errors`].
    pub crossings: Option<f64>,
    /// Mean distance of lines from where they should be, in pixels; see [`Reference::errors`].
    pub position: Option<f64>,
}

/// A number for the whole picture and for its parts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ByRegion {
    /// All pixels.
    pub all: f64,
    /// Within a pixel of lines that are seen directly.
    pub lines: Option<f64>,
    /// Within a pixel of lines that are seen in mirrors and through glass, but not of the former.
    pub reflections: Option<f64>,
    /// All other pixels.
    pub rest: Option<f64>,
}

impl ByRegion {
    /// Whole picture, lines, reflections, rest.
    #[must_use]
    pub fn parts(&self) -> [Option<f64>; 4] {
        [Some(self.all), self.lines, self.reflections, self.rest]
    }

    fn of(regions: &[Region], value: impl Fn(usize) -> f64, finish: impl Fn(f64) -> f64) -> Self {
        let mut sums = [(0.0, 0_usize); 3];
        for (i, region) in regions.iter().enumerate() {
            let (sum, count) = &mut sums[*region as usize];
            *sum += value(i);
            *count += 1;
        }
        let mean = |(sum, count): (f64, usize)| (count > 0).then(|| finish(sum / count as f64));
        let all = sums.iter().fold((0.0, 0), |(sum, count), part| (sum + part.0, count + part.1));
        let [lines, reflections, rest] = sums.map(mean);
        Self { all: mean(all).unwrap_or_default(), lines, reflections, rest }
    }

    fn map(self, change: impl Fn(f64) -> f64 + Copy) -> Self {
        let Self { all, lines, reflections, rest } = self;
        Self {
            all: change(all),
            lines: lines.map(change),
            reflections: reflections.map(change),
            rest: rest.map(change),
        }
    }
}

impl Errors {
    /// All errors multiplied.
    #[must_use]
    pub fn scaled(self, factor: f64) -> Self {
        let scale = |x: f64| x * factor;
        Self {
            rmse: self.rmse.map(scale),
            flip: self.flip.map(scale),
            coverage: self.coverage.map(scale),
            crossings: self.crossings.map(scale),
            position: self.position.map(scale),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Region {
    Lines,
    Reflections,
    Rest,
}

/// Coverage below which a pixel is not taken for a line's.
const INK: f32 = 0.01;
/// Share of the reference's ink around a place below which a picture counts as having no line there.
const MISSING: f64 = 0.1;
/// From this ratio on of the ink's variances along and across, lines meet there: a straight line has 1/16 at most, as the discs are
/// chosen, two that cross at 45° have 0.17, a right angle 0.25, a right crossing 1.
const MEETING: f64 = 0.15;

/// A picture to compare with.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    shot: Shot,
    regions: Vec<Region>,
    /// Pixels around which lines meet.
    crossings: Vec<usize>,
    /// Radius of the discs in which the place of a line is told, in pixels.
    radius: i32,
}

impl Reference {
    /// A reference whose lines are at most `widest` pixels wide.
    #[must_use]
    pub fn new(shot: Shot, widest: f32) -> Self {
        let secondary = near(&shot, &shot.secondary);
        // A line in a mirror is one of `coverage`, too.
        let primary: Vec<f32> = if shot.secondary.is_empty() {
            shot.coverage.clone()
        } else {
            shot.coverage.iter().zip(&shot.secondary).map(|(all, secondary)| all - secondary).collect()
        };
        let primary = near(&shot, &primary);
        let region = |i: usize| match (primary[i], secondary[i]) {
            (true, _) => Region::Lines,
            (false, true) => Region::Reflections,
            (false, false) => Region::Rest,
        };
        let regions = (0..shot.colors.len()).map(region).collect();
        let around = 2 * widest.clamp(0.0, 32.0).ceil() as i32 + 2;
        let meets = |i: &usize| shot.coverage[*i] >= INK && Moments::around(&shot, &shot.coverage, *i, around).meet();
        let crossings = (0..shot.coverage.len()).filter(meets).collect();
        Self { shot, regions, crossings, radius: (widest / 2.0).clamp(0.0, 32.0).ceil() as i32 + 2 }
    }

    /// The picture itself.
    #[must_use]
    pub fn shot(&self) -> &Shot {
        &self.shot
    }

    /// The errors of a picture of the same size.
    ///
    /// The place of a line is the centroid of ink in a disc around a pixel; its error is the distance of the picture's
    /// centroid from the reference's in the same disc. Along the line both lie in the disc's middle, so what is left is
    /// the distance across. It is averaged over all pixels, weighted by the reference's coverage. Where the picture has
    /// less than a tenth of the ink, the line is missing, and its error is the disc's radius.
    ///
    /// Lines meet in pixels of lines around which the reference's ink is no stroke: in a disc whose radius is twice the width of the widest
    /// line, its variance along is not much larger than that across. These are crossings, junctions, corners, and lines side by side.
    #[must_use]
    pub fn errors(&self, test: &Shot) -> Errors {
        let (reference, regions) = (&self.shot, &self.regions);
        let square = |i: usize| {
            let difference = |axis: usize| f64::from(reference.colors[i][axis]) - f64::from(test.colors[i][axis]);
            (0..3).map(|axis| difference(axis) * difference(axis)).sum::<f64>() / 3.0
        };
        let flip = flip(reference.width, &reference.colors, &test.colors, PIXELS_PER_DEGREE);
        let has_ink = reference.coverage.iter().any(|coverage| *coverage > 0.0);
        Errors {
            rmse: ByRegion::of(regions, square, f64::sqrt),
            flip: ByRegion::of(regions, |i| f64::from(flip[i]), |mean| mean),
            coverage: has_ink.then(|| wrong_share(&reference.coverage, &test.coverage)),
            crossings: (!self.crossings.is_empty()).then(|| {
                let [reference, test] =
                    [&reference.coverage, &test.coverage].map(|ink| self.crossings.iter().map(|i| ink[*i]));
                wrong_share(&reference.collect::<Vec<_>>(), &test.collect::<Vec<_>>())
            }),
            position: self.position(&test.coverage),
        }
    }

    fn position(&self, test: &[f32]) -> Option<f64> {
        let (mut sum, mut weights) = (0.0, 0.0);
        for (i, coverage) in self.shot.coverage.iter().enumerate().filter(|(_, coverage)| **coverage >= INK) {
            let [expected, found] =
                [&self.shot.coverage, test].map(|ink| Moments::around(&self.shot, ink, i, self.radius));
            let missing = found.ink < MISSING * expected.ink;
            let across = |axis: usize| found.first[axis] / found.ink - expected.first[axis] / expected.ink;
            let distance = if missing { f64::from(self.radius) } else { across(0).hypot(across(1)) };
            sum += f64::from(*coverage) * distance;
            weights += f64::from(*coverage);
        }
        (weights > 0.0).then(|| sum / weights)
    }
}

/// Moments of the ink around a pixel.
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    ink: f64,
    /// Of x and y, from the pixel.
    first: [f64; 2],
    /// Of x², xy and y².
    second: [f64; 3],
}

impl Moments {
    /// Those of the ink of a picture as large as `shot`, in a disc around a pixel.
    fn around(shot: &Shot, ink: &[f32], pixel: usize, radius: i32) -> Self {
        let width = shot.width as i32;
        let (x0, y0, height) = (pixel as i32 % width, pixel as i32 / width, (ink.len() / shot.width) as i32);
        let mut moments = Self::default();
        for y in (y0 - radius).max(0)..(y0 + radius + 1).min(height) {
            let half = f64::from(radius * radius - (y - y0) * (y - y0)).sqrt() as i32;
            for x in (x0 - half).max(0)..(x0 + half + 1).min(width) {
                let ink = f64::from(ink[(y * width + x) as usize]);
                let [x, y] = [x - x0, y - y0].map(f64::from);
                moments.ink += ink;
                moments.first.iter_mut().zip([x, y]).for_each(|(sum, x)| *sum += x * ink);
                moments.second.iter_mut().zip([x * x, x * y, y * y]).for_each(|(sum, x)| *sum += x * ink);
            }
        }
        moments
    }

    /// Whether lines meet here: the ink is no stroke.
    fn meet(&self) -> bool {
        let [x, y] = self.first.map(|sum| sum / self.ink);
        let [xx, xy, yy] = self.second.map(|sum| sum / self.ink);
        let [xx, xy, yy] = [xx - x * x, xy - x * y, yy - y * y];
        let (mean, half) = ((xx + yy) / 2.0, ((xx - yy) / 2.0).hypot(xy));
        mean - half > MEETING * (mean + half)
    }
}

/// Σ |coverage − reference| / Σ reference; infinite or no number if the reference has no lines.
pub(super) fn wrong_share(reference: &[f32], test: &[f32]) -> f64 {
    let ink: f64 = reference.iter().map(|coverage| f64::from(*coverage)).sum();
    let wrong = reference.iter().zip(test).map(|(a, b)| (f64::from(*a) - f64::from(*b)).abs());
    wrong.sum::<f64>() / ink
}

/// Which pixels are within one of a line's.
fn near(shot: &Shot, ink: &[f32]) -> Vec<bool> {
    let (width, height) = (shot.width, shot.colors.len() / shot.width.max(1));
    let mut near = vec![false; shot.colors.len()];
    for (i, _) in ink.iter().enumerate().filter(|(_, ink)| **ink >= INK) {
        let (x, y) = (i % width, i / width);
        for y in y.saturating_sub(1)..(y + 2).min(height) {
            near[y * width..][x.saturating_sub(1)..(x + 2).min(width)].fill(true);
        }
    }
    near
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: usize = 40;

    /// A vertical line of a width whose middle is at x.
    fn line(x: f32, width: f32) -> Shot {
        let covered = |i: usize| {
            let left = (i % SIDE) as f32;
            ((x + width / 2.0).min(left + 1.0) - (x - width / 2.0).max(left)).max(0.0)
        };
        let coverage: Vec<f32> = (0..SIDE * SIDE).map(covered).collect();
        Shot {
            width: SIDE,
            colors: coverage.iter().map(|ink| [1.0 - ink; 3]).collect(),
            coverage,
            secondary: Vec::new(),
        }
    }

    #[test]
    fn a_line_is_as_far_off_as_it_is_moved() {
        let reference = Reference::new(line(20.0, 2.0), 2.0);
        for moved in [0.0, 0.1, 0.4, 0.8] {
            let position = reference.errors(&line(20.0 + moved, 2.0)).position.unwrap_or(f64::NAN);
            // What leaves the discs of pixels at the line's rim makes it a little less.
            assert!(
                position >= 0.8 * f64::from(moved) && position < 1.01 * f64::from(moved) + 1e-9,
                "{moved}: {position}"
            );
        }
        let missing = reference.errors(&line(500.0, 2.0));
        assert_eq!((missing.position, missing.coverage), (Some(3.0), Some(1.0)));
    }

    #[test]
    fn errors_are_those_of_arithmetic() {
        let reference = Reference::new(line(20.0, 2.0), 2.0);
        let found = reference.errors(&line(20.0, 3.0));
        // It has not moved; at its rim, discs cut off more of the wider line on one side than on the other.
        assert!(found.position.is_some_and(|position| position < 0.05), "{found:?}");
        assert!(found.coverage.is_some_and(|coverage| (coverage - 0.5).abs() < 1e-6), "{found:?}");
        // Two of forty columns are off by a half.
        assert!((found.rmse.all - (2.0_f64 / 40.0 * 0.25).sqrt()).abs() < 1e-6, "{found:?}");
        assert!((found.rmse.lines.unwrap_or(0.0) - (2.0_f64 / 4.0 * 0.25).sqrt()).abs() < 1e-6, "{found:?}");
        assert_eq!((found.rmse.reflections, found.rmse.rest), (None, Some(0.0)));
        assert_eq!(reference.errors(&line(20.0, 2.0)).scaled(2.0).rmse.all, 0.0);
    }

    #[test]
    fn lines_meet_at_crossings_and_corners_and_nowhere_else() {
        // Two lines through the middle, at an angle; the second may begin there.
        let crossed = |degrees: f32, begins: bool| {
            let [cos, sin] = [degrees.to_radians().cos(), degrees.to_radians().sin()];
            let mut shot = line(20.0, 2.0);
            for (i, ink) in shot.coverage.iter_mut().enumerate() {
                let [x, y] = [i % SIDE, i / SIDE].map(|place| place as f32 + 0.5 - 20.0);
                let [along, across] = [y * cos + x * sin, x * cos - y * sin];
                if across.abs() < 1.0 && (along > 0.0 || !begins) {
                    *ink = 1.0;
                }
            }
            Reference::new(shot, 2.0)
        };
        assert!(crossed(0.0, false).crossings.is_empty(), "a straight line");
        for (degrees, begins) in [(90.0, false), (60.0, false), (90.0, true)] {
            let reference = crossed(degrees, begins);
            assert!(reference.crossings.contains(&(20 * SIDE + 20)), "{degrees}°");
            let near = |i: &usize| (i % SIDE).abs_diff(20).max((i / SIDE).abs_diff(20)) <= 8;
            assert!(reference.crossings.iter().all(near), "{degrees}°: {:?}", reference.crossings);
            // Without the second line, only what was there of it is wrong.
            let found = reference.errors(&line(20.0, 2.0));
            let [all, met] = [found.coverage, found.crossings].map(|error| error.unwrap_or(f64::NAN));
            assert!(met > 0.1 && met < 0.7 && all > 0.2, "{degrees}°: {found:?}");
        }
    }

    #[test]
    fn lines_in_mirrors_are_a_region_of_their_own() {
        let mut shot = line(20.0, 2.0);
        shot.secondary = vec![0.0; SIDE * SIDE];
        for row in 0..SIDE / 2 {
            for x in 19..21 {
                shot.secondary[row * SIDE + x] = 1.0;
            }
        }
        let reference = Reference::new(shot.clone(), 2.0);
        let count = |region| reference.regions.iter().filter(|known| **known == region).count();
        assert_eq!((count(Region::Lines), count(Region::Reflections)), (4 * 21, 4 * 19));
        let empty = Reference::new(line(500.0, 2.0), 2.0).errors(&shot);
        assert_eq!((empty.position, empty.coverage, empty.rmse.lines), (None, None, None));
    }
}
