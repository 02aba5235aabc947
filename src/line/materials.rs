//! Tests by material (`[materials.NAME.lines]`): a pair is tested as the material of its priority sample says.
//!
//! Bounds know only which materials may be there, so they take the loosest or strictest tests of all of these.

use super::Rules;
use super::bounds::{Bounded, Bounds};
use super::differ::Tests;
use crate::scene::settings::{LineOverrides, LineSettings};

/// Ranges of more materials than this count as all.
const WIDEST_RANGE: u32 = 16;

/// The tests of each material.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MaterialTests {
    /// By `shader` value; 0, a miss, has those of `[lines]`, and so have materials that are not in the list.
    by_shader: Vec<Tests>,
    /// By material id.
    overrides: Vec<LineOverrides>,
    loosest: Tests,
    strictest: Tests,
}

impl MaterialTests {
    /// `None` if no material changes anything.
    pub(super) fn new(settings: &LineSettings, overrides: &[LineOverrides]) -> Option<Self> {
        let common = Tests::new(settings);
        let own = overrides.iter().map(|overrides| Tests::new(&overrides.over(settings)));
        let by_shader: Vec<Tests> = std::iter::once(common).chain(own).collect();
        if by_shader.iter().all(|tests| *tests == common) {
            return None;
        }
        let loosest = by_shader.iter().fold(common, Tests::looser);
        let strictest = by_shader.iter().fold(common, Tests::stricter);
        Some(Self { by_shader, overrides: overrides.to_vec(), loosest, strictest })
    }

    pub(super) fn of(&self, shader: u32) -> &Tests {
        self.by_shader.get(shader as usize).unwrap_or(&self.by_shader[0])
    }

    /// How many `shader` values there are tests for.
    pub(super) fn shaders(&self) -> u32 {
        self.by_shader.len() as u32
    }

    pub(super) fn overrides_of(&self, shader: u32) -> LineOverrides {
        let index = (shader as usize).checked_sub(1);
        index.and_then(|index| self.overrides.get(index)).copied().unwrap_or_default()
    }

    /// What finds a difference wherever one of the materials of some ranges does.
    pub(super) fn loosest(&self, ranges: &[[u32; 2]]) -> Tests {
        self.fold(ranges, Tests::looser).unwrap_or(self.loosest)
    }

    /// What finds no difference where one of the materials of some ranges finds none.
    pub(super) fn strictest(&self, ranges: &[[u32; 2]]) -> Tests {
        self.fold(ranges, Tests::stricter).unwrap_or(self.strictest)
    }

    fn fold(&self, ranges: &[[u32; 2]], join: fn(Tests, &Tests) -> Tests) -> Option<Tests> {
        if ranges.iter().any(|[low, high]| high.saturating_sub(*low) >= WIDEST_RANGE) {
            return None;
        }
        let shaders = ranges.iter().flat_map(|[low, high]| *low..=*high);
        shaders.map(|shader| self.of(shader)).fold(None, |all, one| Some(all.map_or(*one, |all| join(all, one))))
    }
}

/// Whether targets and neighbours at least this far apart may make lines.
#[inline]
pub(super) fn may_matter(rules: &Rules, targets: &Bounded<'_>, neighbors: &Bounded<'_>, gap_squared: f32) -> bool {
    let near = |targets: f32, neighbors: f32| gap_squared < targets.max(neighbors);
    near(targets.bounds.radius_squared, neighbors.bounds.radius_squared)
        && (rules.types().is_none() || {
            let [own, other] =
                [targets, neighbors].map(|styling| radii_squared(rules, targets, neighbors, styling.bounds));
            near(own[1], other[1])
        })
        && may_differ(rules, targets, neighbors, gap_squared)
}

/// The least and the greatest squared radius of the lines between two sets of nodes that one of them draws; the least is
/// ∞ if there are none.
#[inline]
pub(super) fn radii_squared(rules: &Rules, a: &Bounded<'_>, b: &Bounded<'_>, drawing: &Bounds) -> [f32; 2] {
    let of_any = [drawing.thinnest_squared, drawing.radius_squared];
    rules.types().map_or(of_any, |types| types.between(a.bounds, b.bounds, of_any, rules))
}

/// Whether targets and neighbours at least this far apart may differ.
#[inline]
pub(super) fn may_differ(rules: &Rules, targets: &Bounded<'_>, neighbors: &Bounded<'_>, gap_squared: f32) -> bool {
    let styling = [targets.bounds, neighbors.bounds];
    match rules.materials() {
        None => targets.may_differ(neighbors, gap_squared, rules.tests()),
        Some(materials) => {
            targets.may_differ(neighbors, gap_squared, &materials.loosest(&styling.map(Bounds::shaders)))
        }
    }
}

/// Whether targets and neighbours surely differ; `None` if they surely do not. All lines between them are styled by
/// materials within the bounds `styling`.
#[inline]
pub(super) fn certainty(
    rules: &Rules,
    targets: &Bounded<'_>,
    neighbors: &Bounded<'_>,
    gap_squared: f32,
    styling: &Bounds,
) -> Option<bool> {
    let certain = |loosest: &Tests, strictest: &Tests| {
        let may = targets.may_differ(neighbors, gap_squared, loosest);
        may.then(|| targets.must_differ(neighbors, strictest))
    };
    match rules.materials() {
        None => certain(rules.tests(), rules.tests()),
        Some(materials) => {
            let styling = [styling.shaders()];
            certain(&materials.loosest(&styling), &materials.strictest(&styling))
        }
    }
}

/// The tests of neighbours in columns; see [`super::lanes`].
#[derive(Debug, Default)]
pub(super) struct TestColumns {
    /// All bits or none.
    object: Vec<u32>,
    shader: Vec<u32>,
    uv_squared: Vec<f32>,
    chord_squared: Vec<f32>,
    feature: Vec<f32>,
    overlap: Vec<f32>,
}

impl TestColumns {
    pub(super) fn push(&mut self, tests: &Tests) {
        self.object.push(tests.object.into());
        self.shader.push(tests.shader.into());
        self.uv_squared.push(tests.uv_squared);
        self.chord_squared.push(tests.chord_squared);
        self.feature.push(tests.feature);
        self.overlap.push(tests.overlap);
    }

    pub(super) fn ids(&mut self) -> [&mut Vec<u32>; 2] {
        [&mut self.object, &mut self.shader]
    }

    pub(super) fn floats(&mut self) -> [&mut Vec<f32>; 4] {
        [&mut self.uv_squared, &mut self.chord_squared, &mut self.feature, &mut self.overlap]
    }

    /// The first `count` rows.
    #[inline(always)]
    pub(super) fn rows(&self, count: usize) -> TestRows<'_> {
        TestRows {
            object: &self.object[..count],
            shader: &self.shader[..count],
            uv_squared: &self.uv_squared[..count],
            chord_squared: &self.chord_squared[..count],
            feature: &self.feature[..count],
            overlap: &self.overlap[..count],
        }
    }
}

/// Rows of [`TestColumns`].
#[derive(Clone, Copy)]
pub(super) struct TestRows<'a> {
    object: &'a [u32],
    shader: &'a [u32],
    uv_squared: &'a [f32],
    chord_squared: &'a [f32],
    feature: &'a [f32],
    overlap: &'a [f32],
}

impl TestRows<'_> {
    #[inline(always)]
    pub(super) fn get(&self, row: usize) -> Tests {
        Tests {
            object: self.object[row] != 0,
            shader: self.shader[row] != 0,
            uv_squared: self.uv_squared[row],
            chord_squared: self.chord_squared[row],
            feature: self.feature[row],
            overlap: self.overlap[row],
            reads_shapes: true,
        }
    }
}
