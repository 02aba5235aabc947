//! What other rules change about the lines of samples that stay as they are: which tiles must be searched again.
//!
//! Two kinds of changes are told apart; whatever else differs (widths, paths, lists, …) concerns all tiles.
//!
//! - How lines look: tint, composition, colours and opacities of types. Which samples see lines, and at which paths, is the
//!   same under both rules, so that only tiles that have lines are concerned.
//! - Thresholds of tests. A pair of samples makes the same line under both rules unless some measure of it lies between
//!   the old threshold and the new one; and not even then if the objects differ and the object test is on, since no other
//!   test has a say beside it (DESIGN section 3.6). Bounds rule out most of a picture, and what they leave is looked at
//!   pair by pair: a tile is concerned only if some pair within reach of it is.
//!
//! A tile that is not concerned has the same lines, bit for bit, but for [`Fired`](super::Fired) beside a stronger reason.

use super::LineBuffer;
use super::bounds::{Block, Bounded, PixelNodes};
use super::differ::{self, Features, Tests, largest_difference};
use super::overlap::Facet;
use super::pair::distance_squared;
use super::rules::Rules;
use super::search::{pixel_gap_squared, pixel_rect, reached, rect_gap_squared};
use super::window::{LineTile, PathTile, PathWindow, Window};
use crate::sample::NodePath;
use crate::scene::settings::Composition;

/// What leads from the lines under some rules to those under others.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RuleChange(Kind);

#[derive(Clone, Debug, Default, PartialEq)]
enum Kind {
    #[default]
    Nothing,
    Some {
        looks: Looks,
        tests: Option<TestChange>,
    },
    Everything,
}

/// Whose looks change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Looks {
    /// No line's.
    None,
    /// Those of lines in reflections and behind what is seen through.
    Secondary,
    All,
}

impl RuleChange {
    /// What leads from some rules to others.
    #[must_use]
    pub fn between(old: &Rules, new: &Rules) -> Self {
        if !old.same_but_for_tests_and_looks(new) {
            return Self::everything();
        }
        let looks = match (old.settings(), new.settings()) {
            (a, b) if a.compose != b.compose || a.types != b.types || old.hidden_color() != new.hidden_color() => {
                Looks::All
            }
            (a, b) if a.tint == b.tint => Looks::None,
            // The camera's own nodes have no tint, but what is mixed with it may be rounded otherwise.
            (a, _) if a.compose == Composition::Replace => Looks::Secondary,
            _ => Looks::All,
        };
        let tests = TestChange::between(old, new);
        // Bounds know nothing of what no test has read, and lists are compared by more than pairs of first surfaces.
        let known = tests.as_ref().is_none_or(|tests| new.surfaces() == 1 && tests.reads_no_more_than(old.tests()));
        match (looks, tests) {
            _ if !known => Self::everything(),
            (Looks::None, None) => Self::default(),
            (looks, tests) => Self(Kind::Some { looks, tests }),
        }
    }

    /// The change that concerns all tiles.
    #[must_use]
    pub fn everything() -> Self {
        Self(Kind::Everything)
    }

    /// The same change, and all lines that are there may look otherwise.
    #[must_use]
    pub fn with_looks(self) -> Self {
        match self.0 {
            Kind::Everything => self,
            Kind::Nothing => Self(Kind::Some { looks: Looks::All, tests: None }),
            Kind::Some { tests, .. } => Self(Kind::Some { looks: Looks::All, tests }),
        }
    }

    /// Whether all lines stay as they are.
    #[must_use]
    pub fn is_nothing(&self) -> bool {
        self.0 == Kind::Nothing
    }

    /// Whether a tile may have other lines than those that were found in the same `window` by the old rules, by which its
    /// bounds were made.
    #[must_use]
    pub fn concerns(&self, window: &Window<'_>, target: LineTile<'_>, lines: &LineBuffer, old: &Rules) -> bool {
        match &self.0 {
            Kind::Nothing => false,
            Kind::Everything => true,
            Kind::Some { looks, tests } => {
                let looks_differ = match looks {
                    Looks::None => false,
                    Looks::Secondary => lines.lines.iter().any(|line| line.path != NodePath::CAMERA),
                    Looks::All => !lines.lines.is_empty(),
                };
                let turns = |tests: &TestChange| {
                    let targets = target.buffer.paths.iter().filter_map(|nodes| PathTile::new(target, nodes.path));
                    targets.into_iter().any(|targets| {
                        let window = window.at_path(targets.nodes.path);
                        Turning { change: tests, rules: old, targets, window: &window }.any()
                    })
                };
                looks_differ || tests.as_ref().is_some_and(turns)
            }
        }
    }
}

/// Measures above the first number and not above the second: those on different sides of two thresholds.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Band(f32, f32);

impl Band {
    const NONE: Self = Self(f32::INFINITY, f32::NEG_INFINITY);

    /// With all that lies between two thresholds.
    fn and_between(self, a: f32, b: f32) -> Self {
        if a == b { self } else { Self(self.0.min(a).min(b), self.1.max(a).max(b)) }
    }

    #[inline]
    fn contains(self, measure: f32) -> bool {
        measure > self.0 && measure <= self.1
    }

    /// Whether a measure may lie in the band of which the least and the greatest that it can be are given.
    #[inline]
    fn overlaps(self, range: impl FnOnce() -> [f32; 2]) -> bool {
        self != Self::NONE && {
            let [least, greatest] = range();
            greatest > self.0 && least <= self.1
        }
    }
}

/// Tests that find other differences.
#[derive(Clone, Debug, PartialEq)]
struct TestChange {
    /// By `shader` value: whether lines that it styles are tested otherwise. Those beyond are as the first.
    concerned: Vec<bool>,
    /// Whether the object test was turned on or off for any of them, and the shader test.
    object: bool,
    shader: bool,
    uv_squared: Band,
    chord_squared: Band,
    feature: Band,
    overlap: Band,
    /// Whether different objects are all that matters where they differ, and materials.
    object_decides: bool,
    shader_decides: bool,
}

impl TestChange {
    /// `None` if all tests are the same.
    fn between(old: &Rules, new: &Rules) -> Option<Self> {
        let mut change = Self {
            concerned: Vec::new(),
            object: false,
            shader: false,
            uv_squared: Band::NONE,
            chord_squared: Band::NONE,
            feature: Band::NONE,
            overlap: Band::NONE,
            object_decides: true,
            shader_decides: true,
        };
        for shader in 0..old.shaders_tested().max(new.shaders_tested()) {
            let (a, b) = (old.tests_of(shader), new.tests_of(shader));
            change.concerned.push(a != b);
            change.object |= a.object != b.object;
            change.shader |= a.shader != b.shader;
            change.uv_squared = change.uv_squared.and_between(a.uv_squared, b.uv_squared);
            change.chord_squared = change.chord_squared.and_between(a.chord_squared, b.chord_squared);
            change.feature = change.feature.and_between(a.feature, b.feature);
            change.overlap = change.overlap.and_between(a.overlap, b.overlap);
            change.object_decides &= a.object && b.object;
            change.shader_decides &= a.shader && b.shader;
        }
        // An overlap is a stronger reason than another material.
        change.shader_decides &= change.overlap == Band::NONE && !change.object;
        change.concerned.contains(&true).then_some(change)
    }

    /// Whether bounds for these tests hold all that is asked here.
    fn reads_no_more_than(&self, tests: &Tests) -> bool {
        [
            (self.uv_squared, tests.uv_squared),
            (self.chord_squared, tests.chord_squared),
            (self.feature, tests.feature),
            (self.overlap, tests.overlap),
        ]
        .iter()
        .all(|(band, threshold)| *band == Band::NONE || *threshold < f32::INFINITY)
    }

    /// Whether some node here and some there, at least so far apart on the film, may differ under one of the rules alone,
    /// or for another reason.
    fn may_turn(&self, a: &Bounded<'_>, b: &Bounded<'_>, gap_squared: f32) -> bool {
        let apart = |a: [u32; 2], b: [u32; 2]| a[1] < b[0] || b[1] < a[0];
        let alike = |a: [u32; 2], b: [u32; 2]| a[0] == a[1] && a == b;
        let objects = (a.bounds.object, b.bounds.object);
        let shaders = (a.bounds.shaders(), b.bounds.shaders());
        let is_decided = (self.object_decides && apart(objects.0, objects.1))
            || (self.shader_decides && apart(shaders.0, shaders.1));
        !is_decided
            && ((self.object && !alike(objects.0, objects.1))
                || (self.shader && !alike(shaders.0, shaders.1))
                || self.uv_squared.overlaps(|| a.shape.uv_squared_range(b.shape))
                || self.chord_squared.overlaps(|| a.shape.chord_squared_range(b.shape))
                || self.feature.overlaps(|| a.shape.feature_range(b.shape))
                || (self.overlap != Band::NONE
                    && a.bounds.may_share_object(b.bounds)
                    && a.facets.may_overlap(b.facets, gap_squared, self.overlap.0)))
    }

    fn concerns_shader(&self, shader: u32) -> bool {
        *self.concerned.get(shader as usize).unwrap_or(&self.concerned[0])
    }

    /// Whether two nodes, so far apart on the film, differ under one of the rules alone, or for another reason.
    fn turns(&self, a: &Features, b: &Features, apart_squared: f32, facets: impl FnOnce() -> (Facet, Facet)) -> bool {
        let (same_object, same_shader) = (a.object == b.object, a.shader == b.shader);
        if !(self.concerns_shader(a.shader) || self.concerns_shader(b.shader))
            || (self.object_decides && !same_object)
            || (self.shader_decides && !same_shader)
        {
            return false;
        }
        if (self.object && !same_object) || (self.shader && !same_shader) {
            return true;
        }
        if a.is_miss() || b.is_miss() {
            return false;
        }
        let of_shapes = self.uv_squared.contains(differ::distance_squared(a.uv, b.uv))
            || self.chord_squared.contains(differ::distance_squared(a.normal, b.normal))
            || self.feature.contains(largest_difference(a.feature, b.feature));
        of_shapes
            || (self.overlap != Band::NONE && same_object && {
                let (a, b) = facets();
                a.overlaps(&b, apart_squared, self.overlap.0) != a.overlaps(&b, apart_squared, self.overlap.1)
            })
    }
}

/// A tile at one path, and the pairs that turn there: that make another line, or for another reason.
struct Turning<'t, 'w, 'a> {
    change: &'t TestChange,
    /// By which the bounds were made. Lines are as wide under the new ones.
    rules: &'t Rules,
    targets: PathTile<'a>,
    window: &'w PathWindow<'a>,
}

impl<'a> Turning<'_, '_, 'a> {
    /// Whether any pair of a target and a neighbour within reach turns.
    fn any(&self) -> bool {
        let all = self.targets.bounds.bounded();
        let reached = self.window.tiles_in(self.targets.buffer.rect.grown(self.rules.reach())).map(|(_, tile)| tile);
        let tiles: Vec<&PathTile<'a>> =
            reached.filter(|tile| self.change.may_turn(&all, &tile.bounds.bounded(), 0.0)).collect();
        let mut near: Vec<(&PathTile<'a>, &Block)> = Vec::new();
        self.targets.bounds.blocks.iter().any(|block| {
            near.clear();
            for tile in &tiles {
                let others = tile.bounds.blocks.iter().filter(|other| {
                    self.may_turn(&block.bounded(), &other.bounded(), rect_gap_squared(&block.rect, &other.rect))
                });
                near.extend(others.map(|other| (*tile, other)));
            }
            !near.is_empty() && (block.first as usize..block.end as usize).any(|place| self.any_in_pixel(place, &near))
        })
    }

    /// Whether some pair within reach of each other may turn, at least so far apart on the film.
    fn may_turn(&self, a: &Bounded<'_>, b: &Bounded<'_>, gap_squared: f32) -> bool {
        gap_squared < a.bounds.radius_squared.max(b.bounds.radius_squared) && self.change.may_turn(a, b, gap_squared)
    }

    /// Whether any pair of a target in a pixel and a neighbour in some blocks turns.
    fn any_in_pixel(&self, place: usize, near: &[(&PathTile<'a>, &Block)]) -> bool {
        let (own, bounded) = (&self.targets.bounds.pixels[place], self.targets.bounds.of_pixel(place));
        let rect = pixel_rect(own.pixel);
        near.iter().any(|(tile, block)| {
            if !self.may_turn(&bounded, &block.bounded(), rect_gap_squared(&rect, &block.rect)) {
                return false;
            }
            let part = block.part(&reached(own.pixel, bounded.bounds.radius_squared.max(block.bounds.radius_squared)));
            let all = if part.is_some() { 0..0 } else { block.first..block.end };
            part.into_iter().flatten().chain(all).any(|other| {
                let neighbors = &tile.bounds.pixels[other as usize];
                let gap_squared = pixel_gap_squared(own.pixel, neighbors.pixel);
                self.may_turn(&bounded, &tile.bounds.of_pixel(other as usize), gap_squared)
                    && self.any_of_rows(own, tile, neighbors)
            })
        })
    }

    /// Whether any pair of a target in one pixel and a neighbour in another turns.
    fn any_of_rows(&self, own: &PixelNodes, tile: &PathTile<'a>, other: &PixelNodes) -> bool {
        (own.first as usize..own.end as usize).any(|row| {
            let target = self.targets.node(own.pixel, row);
            (other.first as usize..other.end as usize).any(|other_row| {
                let neighbor = tile.node(other.pixel, other_row);
                let apart_squared = distance_squared(&target, neighbor.pixel, neighbor.offset);
                let facets = || (Facet::of(self.targets.nodes, row), Facet::of(tile.nodes, other_row));
                apart_squared < self.rules.widest_squared(target.radius_squared.max(neighbor.radius_squared))
                    && self.change.turns(&target.features, &neighbor.features, apart_squared, facets)
            })
        })
    }
}
