//! Neighbours in columns, so that one instruction tests a target with many of them.
//!
//! The neighbours of all candidate pixels are gathered once and serve all targets of a pixel. Every lane does the
//! operations of [`super::pair`] and [`super::differ`] in their order, so it gets their bits; what wins here is tested once
//! more by them. The loops are plain Rust that the compiler vectorises for the instructions that [`pulp::Arch`] finds at
//! run time.

use super::Rules;
use super::differ::Tests;
use super::materials::TestColumns;
use super::overlap::{Facet, FacetColumns};
use super::pair::{LineNode, Rank};
use super::types::{LaneReasons, TypeRules};
use super::window::PathTile;

/// Columns are filled up to a multiple of this with neighbours that are infinitely far.
const LANES: usize = 16;

/// The score of a neighbour that makes no line.
const NONE: u32 = u32::MAX;

/// Where a neighbour came from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Origin {
    /// Its tile in the window.
    pub tile: u32,
    pub pixel: [i32; 2],
    /// Its row in its tile.
    pub row: u32,
}

/// Neighbours of the targets of one pixel.
#[derive(Debug)]
pub(super) struct Lanes {
    /// Whether each surely differs from every target. Must be set before [`Self::push`].
    pub certain: bool,
    origins: Vec<Origin>,
    columns: Columns,
    ranks: Vec<Rank>,
    keys: Keys,
    /// What the last loop found out about each neighbour: the smallest is the best.
    scores: Vec<u32>,
    arch: pulp::Arch,
}

#[derive(Debug, Default)]
struct Columns {
    /// From the targets' pixel to the neighbour's.
    pixel: [Vec<f32>; 2],
    /// In the neighbour's pixel.
    offset: [Vec<f32>; 2],
    /// In the order of the ranks.
    key: Vec<u32>,
    radius_squared: Vec<f32>,
    // The rest is empty where all differ for certain or no test reads it.
    object: Vec<u32>,
    shader: Vec<u32>,
    uv: [Vec<f32>; 2],
    normal: [Vec<f32>; 3],
    feature: [Vec<f32>; 3],
    facet: FacetColumns,
    /// Where materials have tests of their own.
    tests: TestColumns,
}

/// A target as loops see it.
#[derive(Clone, Copy)]
pub(super) struct LaneTarget<'a> {
    pub node: &'a LineNode,
    pub facet: &'a Facet,
}

/// How ranks become 32 bits in the same order.
#[derive(Debug)]
enum Keys {
    /// All have this priority: their depths order them.
    Depth { priority: u32 },
    /// By place among all.
    Place { sorted: Vec<Rank> },
}

impl Keys {
    fn of(&self, rank: Rank) -> u32 {
        match self {
            Self::Depth { .. } => rank.depth_bits(),
            Self::Place { sorted } => sorted.partition_point(|known| known.outranks(rank)) as u32,
        }
    }

    /// Keys below this outrank a rank.
    fn end_of_outranking(&self, rank: Rank) -> u32 {
        match self {
            Self::Depth { priority } if *priority < rank.priority_bits() => NONE,
            Self::Depth { priority } if *priority > rank.priority_bits() => 0,
            _ => self.of(rank),
        }
    }
}

impl Lanes {
    pub(super) fn new() -> Self {
        Self {
            certain: true,
            origins: Vec::new(),
            columns: Columns::default(),
            ranks: Vec::new(),
            keys: Keys::Depth { priority: 0 },
            scores: Vec::new(),
            arch: pulp::Arch::new(),
        }
    }

    pub(super) fn len(&self) -> usize {
        self.origins.len()
    }

    /// Removes all neighbours.
    pub(super) fn clear(&mut self) {
        let Columns { pixel, offset, key, radius_squared, object, shader, uv, normal, feature, facet, tests } =
            &mut self.columns;
        let floats = pixel.iter_mut().chain(offset).chain(uv).chain(normal).chain(feature).chain([radius_squared]);
        floats.chain(facet.columns()).for_each(Vec::clear);
        tests.floats().into_iter().for_each(Vec::clear);
        [key, object, shader].into_iter().chain(tests.ids()).for_each(Vec::clear);
        self.origins.clear();
        self.ranks.clear();
        self.certain = true;
    }

    /// Adds a neighbour for targets in pixel `from`.
    #[inline]
    pub(super) fn push(&mut self, origin: Origin, from: [i32; 2], rank: Rank, nodes: &PathTile<'_>, rules: &Rules) {
        let row = origin.row as usize;
        let offset = nodes.offset(row);
        let columns = &mut self.columns;
        for axis in 0..2 {
            columns.pixel[axis].push((origin.pixel[axis] - from[axis]) as f32);
            columns.offset[axis].push(offset[axis]);
        }
        columns.radius_squared.push(nodes.bounds.radius_squared.get(row));
        if !self.certain {
            let features = nodes.features(row);
            columns.object.push(features.object);
            columns.shader.push(features.shader);
            let tests = rules.tests();
            let mixed = rules.materials().is_some();
            if tests.reads_shapes || tests.reads_facets() || mixed {
                push(&mut columns.uv, features.uv);
                push(&mut columns.normal, features.normal);
                push(&mut columns.feature, features.feature);
            }
            if tests.reads_facets() || mixed {
                columns.facet.push(&Facet::of(nodes.nodes, row));
            }
            if mixed {
                columns.tests.push(rules.tests_of(features.shader));
            }
        }
        self.ranks.push(rank);
        self.origins.push(origin);
    }

    /// Completes the columns.
    pub(super) fn finish(&mut self) {
        let priority = self.ranks.first().map_or(0, |rank| rank.priority_bits());
        self.keys = if self.ranks.iter().all(|rank| rank.priority_bits() == priority) {
            Keys::Depth { priority }
        } else {
            let mut sorted = self.ranks.clone();
            sorted.sort_unstable();
            sorted.dedup();
            Keys::Place { sorted }
        };
        let keys = &self.keys;
        self.columns.key.extend(self.ranks.iter().map(|rank| keys.of(*rank)));

        let count = self.len().next_multiple_of(LANES);
        let Columns { pixel, offset, key, radius_squared, object, shader, uv, normal, feature, facet, tests } =
            &mut self.columns;
        pixel.iter_mut().for_each(|column| column.resize(count, f32::INFINITY));
        let floats = offset.iter_mut().chain(uv).chain(normal).chain(feature).chain([radius_squared]);
        let floats = floats.chain(facet.columns()).chain(tests.floats());
        floats.filter(|column| !column.is_empty()).for_each(|column| column.resize(count, 0.0));
        let ids = [key, object, shader].into_iter().chain(tests.ids()).filter(|column| !column.is_empty());
        ids.for_each(|column| column.resize(count, 0));
        self.scores.resize(count, NONE);
    }

    /// Scores the neighbours whose line the target sees, by rank; the best score.
    pub(super) fn score_others(&mut self, target: LaneTarget<'_>, rules: &Rules) -> u32 {
        // The neighbours' materials decide.
        self.score::<false>(target, rules.tests(), rules.materials().is_some(), rules.types())
    }

    /// Scores the neighbours that give the target a line of its own, by distance; the best score.
    pub(super) fn score_own(&mut self, target: LaneTarget<'_>, rules: &Rules) -> u32 {
        self.score::<true>(target, rules.tests_of(target.node.features.shader), false, rules.types())
    }

    fn score<const OWN: bool>(
        &mut self,
        target: LaneTarget<'_>,
        tests: &Tests,
        mixed: bool,
        types: Option<&TypeRules>,
    ) -> u32 {
        let end = self.keys.end_of_outranking(target.node.rank);
        let Self { columns, scores, certain, arch, .. } = self;
        let loops = Loop { columns, scores, target, end, tests, types };
        // Each loop is dispatched by itself: a function that held them all would be too large to be vectorised well.
        match (types.is_some(), *certain, mixed, tests.reads_facets(), tests.reads_shapes) {
            (false, true, ..) => arch.dispatch(Score::<OWN, { Differ::CERTAIN }, false>(loops)),
            (false, _, false, false, false) => arch.dispatch(Score::<OWN, { Differ::BY_IDS }, false>(loops)),
            (false, _, false, false, true) => arch.dispatch(Score::<OWN, { Differ::BY_SHAPES }, false>(loops)),
            (false, _, false, true, _) => arch.dispatch(Score::<OWN, { Differ::BY_FACETS }, false>(loops)),
            (false, _, true, ..) => arch.dispatch(Score::<OWN, { Differ::MIXED }, false>(loops)),
            (true, _, false, false, false) => arch.dispatch(Score::<OWN, { Differ::BY_IDS }, true>(loops)),
            (true, _, false, false, true) => arch.dispatch(Score::<OWN, { Differ::BY_SHAPES }, true>(loops)),
            (true, _, false, true, _) => arch.dispatch(Score::<OWN, { Differ::BY_FACETS }, true>(loops)),
            (true, _, true, ..) => arch.dispatch(Score::<OWN, { Differ::MIXED }, true>(loops)),
        }
    }

    /// The neighbours that the last scoring gave a score.
    pub(super) fn with_score(&self, best: u32) -> impl Iterator<Item = &Origin> {
        let found = if best < NONE { &self.scores[..] } else { &[] };
        let chunks = found.chunks_exact(LANES).enumerate();
        chunks
            .filter(move |(_, chunk)| chunk.iter().fold(false, |any, &score| any | (score == best)))
            .flat_map(|(chunk, scores)| (chunk * LANES..).zip(scores))
            .filter(move |&(_, &score)| score == best)
            .map(|(lane, _)| &self.origins[lane])
    }
}

/// What a loop over all neighbours reads and writes.
struct Loop<'a> {
    columns: &'a Columns,
    scores: &'a mut [u32],
    target: LaneTarget<'a>,
    /// Keys below this outrank the target.
    end: u32,
    tests: &'a Tests,
    /// What types change; no neighbour is certain then.
    types: Option<&'a TypeRules>,
}

/// A loop over all neighbours; `TYPED` if types change radii.
struct Score<'a, const OWN: bool, const DIFFER: u8, const TYPED: bool>(Loop<'a>);

impl<const OWN: bool, const DIFFER: u8, const TYPED: bool> pulp::WithSimd for Score<'_, OWN, DIFFER, TYPED> {
    /// The best score.
    type Output = u32;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> u32 {
        self.run()
    }
}

/// How two nodes are known to differ.
struct Differ;

impl Differ {
    const CERTAIN: u8 = 0;
    const BY_IDS: u8 = 1;
    const BY_SHAPES: u8 = 2;
    const BY_FACETS: u8 = 3;
    const MIXED: u8 = 4;
}

impl<const OWN: bool, const DIFFER: u8, const TYPED: bool> Score<'_, OWN, DIFFER, TYPED> {
    #[inline(always)]
    fn run(self) -> u32 {
        let Loop { columns, scores, target: LaneTarget { node: target, facet: own_facet }, end, tests, types } = self.0;
        let count = scores.len();
        let ids = if DIFFER >= Differ::BY_IDS { count } else { 0 };
        let shapes = if DIFFER >= Differ::BY_SHAPES { count } else { 0 };
        let pixel = columns.pixel.each_ref().map(|column| &column[..count]);
        let offset = columns.offset.each_ref().map(|column| &column[..count]);
        let (key, radius_squared) = (&columns.key[..count], &columns.radius_squared[..count]);
        let (object, shader) = (&columns.object[..ids], &columns.shader[..ids]);
        let uv = columns.uv.each_ref().map(|column| &column[..shapes]);
        let normal = columns.normal.each_ref().map(|column| &column[..shapes]);
        let feature = columns.feature.each_ref().map(|column| &column[..shapes]);
        let facet = columns.facet.rows(if DIFFER >= Differ::BY_FACETS { count } else { 0 });
        let mixed = columns.tests.rows(if DIFFER == Differ::MIXED { count } else { 0 });
        let (own, own_facet, common) = (target.features, *own_facet, *tests);
        let own_hit = !own.is_miss();
        let by_type = types.map(TypeRules::radii_squared).unwrap_or_default();

        let mut best = NONE;
        for i in 0..count {
            // As `pair::distance_squared`.
            let x = pixel[0][i] + (offset[0][i] - target.offset[0]);
            let y = pixel[1][i] + (offset[1][i] - target.offset[1]);
            let distance_squared = x * x + y * y;

            // As `pair::fired`.
            let tests = if DIFFER == Differ::MIXED { mixed.get(i) } else { common };
            let mut differs = true;
            let mut reasons = LaneReasons::default();
            if DIFFER >= Differ::BY_IDS {
                reasons.object = tests.object & (object[i] != own.object);
                reasons.shader = tests.shader & (shader[i] != own.shader);
                differs = reasons.object | reasons.shader;
            }
            if DIFFER >= Differ::BY_SHAPES {
                let [u, v] = [own.uv[0] - uv[0][i], own.uv[1] - uv[1][i]];
                let [x, y, z] =
                    [own.normal[0] - normal[0][i], own.normal[1] - normal[1][i], own.normal[2] - normal[2][i]];
                let [r, g, b] =
                    [own.feature[0] - feature[0][i], own.feature[1] - feature[1][i], own.feature[2] - feature[2][i]];
                reasons.uv = u * u + v * v > tests.uv_squared;
                reasons.normal = x * x + y * y + z * z > tests.chord_squared;
                reasons.feature = (r.abs() > tests.feature) | (g.abs() > tests.feature) | (b.abs() > tests.feature);
                let shapes = reasons.uv | reasons.normal | reasons.feature;
                differs |= own_hit & (object[i] != 0) & shapes;
            }
            if DIFFER >= Differ::BY_FACETS {
                let overlaps = own_facet.overlaps(&facet.get(i), distance_squared, tests.overlap);
                reasons.overlap = own_hit & (object[i] == own.object) & overlaps;
                differs |= reasons.overlap;
            }
            let mut radius_squared = if OWN { target.radius_squared } else { radius_squared[i] };
            if TYPED {
                reasons.miss = !own_hit | (object[i] == 0);
                radius_squared = reasons.radius_squared(by_type, radius_squared);
            }

            let score = if OWN {
                let valid = (distance_squared < radius_squared) & differs & (key[i] >= end);
                // Squares are not negative, so their bits are in their order.
                if valid { distance_squared.to_bits() } else { NONE }
            } else {
                let valid = (distance_squared < radius_squared) & differs & (key[i] < end);
                if valid { key[i] } else { NONE }
            };
            scores[i] = score;
            best = best.min(score);
        }
        best
    }
}

#[inline(always)]
fn push<const N: usize>(columns: &mut [Vec<f32>; N], values: [f32; N]) {
    columns.iter_mut().zip(values).for_each(|(column, value)| column.push(value));
}
