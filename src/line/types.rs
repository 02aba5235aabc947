//! Styles by type (`[lines.types.NAME]`): how wide a line is, and how it looks, may depend on what it marks.
//!
//! The width of a pair's line is then known only once its tests are, and so is whether the pair is valid. Bounds hold the
//! widest and the thinnest line of any type.

use super::bounds::Bounds;
use super::differ::Fired;
use super::rules::Rules;
use crate::scene::settings::{LineType, TypeStyle};

/// Tells "as the shader says" from a radius.
const UNCHANGED: f32 = -1.0;

/// What types change, made ready for the search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct TypeRules {
    /// By type: the squared radius of its lines, or [`UNCHANGED`].
    radius_squared: [f32; LineType::ALL.len()],
    styles: [TypeStyle; LineType::ALL.len()],
}

impl TypeRules {
    /// `None` if no type changes anything.
    pub(super) fn new(rules: &Rules) -> Option<Self> {
        let styles = rules.settings().types;
        let radius_squared = styles.map(|style| match style.width {
            Some(width) => rules.radius(width) * rules.radius(width),
            None => UNCHANGED,
        });
        styles.iter().any(|style| *style != TypeStyle::default()).then_some(Self { radius_squared, styles })
    }

    /// By type: the squared radius of its lines, below 0 where it is as the shader says.
    #[inline(always)]
    pub(super) fn radii_squared(&self) -> [f32; LineType::ALL.len()] {
        self.radius_squared
    }

    /// What a type changes.
    pub(super) fn style(&self, kind: Option<LineType>) -> TypeStyle {
        kind.map_or_else(TypeStyle::default, |kind| self.styles[kind as usize])
    }

    /// The squared radius of a line of a type whose shader asks for this one. Who draws no line at all draws none of any type.
    #[inline(always)]
    pub(super) fn radius_squared(&self, kind: LineType, asked_squared: f32) -> f32 {
        let own = self.radius_squared[kind as usize];
        if own >= 0.0 && asked_squared > 0.0 { own } else { asked_squared }
    }

    /// The squared radius of a line that is there for these reasons.
    pub(super) fn radius_squared_of(&self, fired: Fired, asked_squared: f32) -> f32 {
        LineType::of(fired).map_or(asked_squared, |kind| self.radius_squared(kind, asked_squared))
    }

    /// The squared radius of the widest line of any type.
    pub(super) fn widest_squared(&self, asked_squared: f32) -> f32 {
        if asked_squared <= 0.0 { 0.0 } else { self.radius_squared.iter().copied().fold(asked_squared, f32::max) }
    }

    /// The least and the greatest squared radius of the lines between two sets of nodes, of which those of any type are known:
    /// not all types can be between them.
    pub(super) fn between(&self, a: &Bounds, b: &Bounds, of_any: [f32; 2], rules: &Rules) -> [f32; 2] {
        if of_any[1] <= 0.0 {
            return of_any;
        }
        let tests = rules.tests();
        let apart = a.object[1] < b.object[0] || b.object[1] < a.object[0];
        let hits = [a, b].map(|bounds| bounds.object[0] > 0);
        let may_be = |kind: LineType| {
            if apart && tests.object && rules.materials().is_none() {
                // The object test surely finds it, and nothing but a miss is a stronger reason.
                let misses = [a, b].iter().any(|bounds| bounds.object[0] == 0);
                return match kind {
                    LineType::Outline => misses,
                    // Of sets that lie apart, one has hits alone; the other may have both.
                    LineType::Silhouette => a.object[1] > 0 && b.object[1] > 0,
                    _ => false,
                };
            }
            if hits == [true; 2] && a.object == b.object && a.object[0] == a.object[1] {
                return match kind {
                    LineType::Outline | LineType::Silhouette => false,
                    LineType::Overlap => tests.reads_facets(),
                    LineType::Material => {
                        tests.shader && (a.shaders() != b.shaders() || a.shaders()[0] < a.shaders()[1])
                    }
                    LineType::Crease => tests.chord_squared < f32::INFINITY,
                    LineType::Uv => tests.uv_squared < f32::INFINITY,
                    LineType::Feature => tests.feature < f32::INFINITY,
                };
            }
            true
        };
        let none = [f32::INFINITY, 0.0];
        LineType::ALL.into_iter().filter(|kind| may_be(*kind)).fold(none, |[least, greatest], kind| {
            let own = self.radius_squared[kind as usize];
            let [low, high] = if own >= 0.0 { [own; 2] } else { of_any };
            [least.min(low), greatest.max(high)]
        })
    }

    /// The squared radius of the thinnest line of any type, 0 if a type is not drawn.
    pub(super) fn thinnest_squared(&self, asked_squared: f32) -> f32 {
        self.radius_squared.iter().copied().filter(|own| *own >= 0.0).fold(asked_squared, f32::min)
    }
}

/// Why a neighbour differs, lane by lane; with a miss, uv, normals and feature colours mean nothing. The arguments of [`TypeRules::radius_squared_of`] without a branch.
#[derive(Clone, Copy, Default)]
pub(super) struct LaneReasons {
    pub miss: bool,
    pub object: bool,
    pub overlap: bool,
    pub shader: bool,
    pub normal: bool,
    pub uv: bool,
    pub feature: bool,
}

impl LaneReasons {
    /// From the weakest reason to the strongest: the last word counts. By type the squared radius, see [`TypeRules::radii_squared`]; by
    /// value, so that lanes choose between registers and gather nothing.
    #[inline(always)]
    pub(super) fn radius_squared(self, by_type: [f32; LineType::ALL.len()], asked_squared: f32) -> f32 {
        let Self { miss, object, overlap, shader, normal, uv, feature } = self;
        let mut own = UNCHANGED;
        for (reason, kind) in [
            (feature & !miss, LineType::Feature),
            (uv & !miss, LineType::Uv),
            (normal & !miss, LineType::Crease),
            (shader, LineType::Material),
            (overlap, LineType::Overlap),
            (object, LineType::Silhouette),
            (miss & (object | shader), LineType::Outline),
        ] {
            own = if reason { by_type[kind as usize] } else { own };
        }
        if (own >= 0.0) & (asked_squared > 0.0) { own } else { asked_squared }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::settings::LineSettings;

    #[test]
    fn lanes_say_what_the_definition_says() {
        let mut settings = LineSettings { max_width: 16.0, ..LineSettings::default() };
        for (index, kind) in LineType::ALL.into_iter().enumerate().filter(|(index, _)| index % 3 != 1) {
            settings.types[kind as usize].width = Some(index as f32);
        }
        let types = TypeRules::new(&Rules::new(&settings, 16)).expect("something is changed");
        for bits in 0..128 {
            let fired = Fired::from_bits_truncate(bits);
            let miss = fired.contains(Fired::MISS);
            let of_hits = Fired::NORMAL | Fired::UV | Fired::FEATURE | Fired::OVERLAP;
            if miss && (fired.intersects(of_hits) || !fired.intersects(Fired::OBJECT | Fired::SHADER)) {
                continue;
            }
            let reasons = LaneReasons {
                miss,
                object: fired.contains(Fired::OBJECT),
                overlap: fired.contains(Fired::OVERLAP),
                shader: fired.contains(Fired::SHADER),
                normal: fired.contains(Fired::NORMAL),
                uv: fired.contains(Fired::UV),
                feature: fired.contains(Fired::FEATURE),
            };
            for asked in [0.0, 0.3, 9.0] {
                let expected = types.radius_squared_of(fired, asked);
                assert_eq!(reasons.radius_squared(types.radii_squared(), asked), expected, "{fired:?}");
                assert!(types.thinnest_squared(asked) <= expected && expected <= types.widest_squared(asked));
            }
        }
        assert_eq!(TypeRules::new(&Rules::new(&LineSettings::default(), 16)), None);
    }
}
