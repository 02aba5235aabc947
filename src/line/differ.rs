//! When two samples differ (DESIGN section 3.1, OG18 section 3.1).
//!
//! Each test compares with `>` and is symmetric bit for bit: swapping the samples changes only the signs of differences.
//! Directions are compared by the chord between them, |a − b| = 2 sin(angle / 2), not by their dot product: it resolves
//! small angles as finely as large ones, is exactly 0 for equal normals, and makes the normal test a distance test like
//! that of uv, so that the search bounds both with boxes.
//!
//! Limits: the gate makes normals unit to within rounding, so a chord is right to about 10⁻⁷. At 0° any two normals that
//! are not equal differ (unless the square of their distance underflows, below 10⁻¹⁹); at 180° and more none do.

use bitflags::bitflags;

use crate::math::portable;
use crate::scene::settings::LineSettings;

bitflags! {
    /// Which tests found a difference.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
    pub struct Fired: u8 {
        /// Object ids differ.
        const OBJECT = 1;
        /// Materials differ.
        const SHADER = 2;
        /// Texture coordinates differ.
        const UV = 4;
        /// Normals differ.
        const NORMAL = 8;
        /// Feature colours differ.
        const FEATURE = 16;
        /// One side is a miss (set beside `OBJECT` or `SHADER`).
        const MISS = 32;
        /// The object folds over itself.
        const OVERLAP = 64;
    }
}

/// The feature attributes of one node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Features {
    pub object: u32,
    pub shader: u32,
    pub uv: [f32; 2],
    pub normal: [f32; 3],
    pub feature: [f32; 3],
}

impl Features {
    pub(super) fn is_miss(&self) -> bool {
        self.object == 0
    }
}

/// The enabled tests with their thresholds. A test that is off has the threshold ∞, which nothing exceeds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tests {
    pub object: bool,
    pub shader: bool,
    /// Largest squared distance in texture space that is no difference.
    pub uv_squared: f32,
    /// Largest squared chord between normals that is no difference.
    pub chord_squared: f32,
    /// Largest difference of a channel that is no difference.
    pub feature: f32,
    /// Largest overlap that is none.
    pub overlap: f32,
    /// Whether the test of uv, normals or feature colours is on.
    pub reads_shapes: bool,
}

impl Tests {
    pub(super) fn new(settings: &LineSettings) -> Self {
        let mut tests = Self {
            object: settings.object,
            shader: settings.shader,
            uv_squared: settings.uv.map_or(f32::INFINITY, |distance| distance.max(0.0) * distance.max(0.0)),
            chord_squared: settings.normal.map_or(f32::INFINITY, chord_squared),
            feature: settings.feature.map_or(f32::INFINITY, |difference| difference.max(0.0)),
            overlap: settings.overlap.map_or(f32::INFINITY, |pixels| pixels.max(0.0)),
            reads_shapes: false,
        };
        tests.reads_shapes = tests.uv_squared.min(tests.chord_squared).min(tests.feature) < f32::INFINITY;
        tests
    }

    /// What finds a difference wherever one of the two does.
    pub(super) fn looser(self, other: &Self) -> Self {
        Self {
            object: self.object | other.object,
            shader: self.shader | other.shader,
            uv_squared: self.uv_squared.min(other.uv_squared),
            chord_squared: self.chord_squared.min(other.chord_squared),
            feature: self.feature.min(other.feature),
            overlap: self.overlap.min(other.overlap),
            reads_shapes: self.reads_shapes | other.reads_shapes,
        }
    }

    /// What finds a difference only where both do, test by test.
    pub(super) fn stricter(self, other: &Self) -> Self {
        Self {
            object: self.object & other.object,
            shader: self.shader & other.shader,
            uv_squared: self.uv_squared.max(other.uv_squared),
            chord_squared: self.chord_squared.max(other.chord_squared),
            feature: self.feature.max(other.feature),
            overlap: self.overlap.max(other.overlap),
            reads_shapes: self.reads_shapes & other.reads_shapes,
        }
    }

    /// Whether the overlap test is on: the one test that also asks where the nodes lie.
    #[inline(always)]
    pub(super) fn reads_facets(&self) -> bool {
        self.overlap < f32::INFINITY
    }

    /// Whether any test finds a difference, the overlap test apart.
    #[inline]
    pub(super) fn differ(&self, a: &Features, b: &Features) -> bool {
        !self.fired(a, b).is_empty()
    }

    /// Which tests find a difference, the overlap test apart.
    #[inline]
    pub(super) fn fired(&self, a: &Features, b: &Features) -> Fired {
        let mut fired = Fired::empty();
        fired.set(Fired::OBJECT, self.object & (a.object != b.object));
        fired.set(Fired::SHADER, self.shader & (a.shader != b.shader));
        if a.is_miss() || b.is_miss() {
            fired.set(Fired::MISS, !fired.is_empty());
            return fired;
        }
        fired.set(Fired::UV, distance_squared(a.uv, b.uv) > self.uv_squared);
        fired.set(Fired::NORMAL, distance_squared(a.normal, b.normal) > self.chord_squared);
        fired.set(Fired::FEATURE, largest_difference(a.feature, b.feature) > self.feature);
        fired
    }
}

/// The largest difference of a channel between two feature colours.
#[inline]
pub(super) fn largest_difference(a: [f32; 3], b: [f32; 3]) -> f32 {
    let difference = |i: usize| (a[i] - b[i]).abs();
    difference(0).max(difference(1)).max(difference(2))
}

/// The squared chord of an angle in degrees; ∞ from 180 on, so that rounding makes no opposite normals differ.
fn chord_squared(degrees: f32) -> f32 {
    if degrees >= 180.0 {
        return f32::INFINITY;
    }
    let half_chord = portable::sin_f64(f64::from(degrees.max(0.0)).to_radians() / 2.0);
    (4.0 * half_chord * half_chord) as f32
}

/// The squared distance between two uv or two normals.
#[inline]
pub(super) fn distance_squared<const N: usize>(a: [f32; N], b: [f32; N]) -> f32 {
    let mut sum = 0.0;
    for i in 0..N {
        let difference = a[i] - b[i];
        sum += difference * difference;
    }
    sum
}
