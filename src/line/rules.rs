//! Line settings, made ready for a sample rate.

use super::differ::Tests;
use super::materials::MaterialTests;
use super::style::LineScript;
use super::types::TypeRules;
use super::widening::Widening;
use crate::math::Vec3;
use crate::sample::NodePath;
use crate::scene::settings::{Composition, LineOverrides, LineSettings, RayKinds, Sampler, TypeStyle};

/// [`LineSettings`] with all that follows from them and the sample rate worked out once.
#[derive(Clone, Debug, PartialEq)]
pub struct Rules {
    settings: LineSettings,
    /// Widths above this count as this.
    widest: f32,
    widening: Widening,
    /// The loosest tests of any material.
    tests: Tests,
    materials: Option<MaterialTests>,
    types: Option<TypeRules>,
    /// By `shader` value: what scripts change about lines.
    scripts: Vec<LineScript>,
    exact_pairs: bool,
    hidden: Option<HiddenStyle>,
}

/// How hidden lines are drawn.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct HiddenStyle {
    /// Linear.
    pub color: [f32; 3],
    /// Square of the half width, 0 if nothing is drawn.
    pub radius_squared: f32,
    /// How much a line covers.
    pub alpha: f32,
    /// Object ids as nodes have them, rising; `None` for all.
    objects: Option<Vec<u32>>,
}

impl HiddenStyle {
    /// Whether hidden lines of an object, by its id as nodes have it, are drawn.
    pub(super) fn draws(&self, object: u32) -> bool {
        self.objects.as_ref().is_none_or(|objects| objects.binary_search(&object).is_ok())
    }
}

impl Rules {
    /// Rules for a sample rate: samples per pixel, at least 1, that are compared with each other, plainly jittered.
    #[must_use]
    pub fn new(settings: &LineSettings, samples_per_pixel: u32) -> Self {
        Self::for_sampler(settings, Sampler::Stratified, samples_per_pixel)
    }

    /// The same for samples of any sampler.
    #[must_use]
    pub fn for_sampler(settings: &LineSettings, sampler: Sampler, samples_per_pixel: u32) -> Self {
        let mut rules = Self {
            widest: settings.max_width.max(0.0),
            widening: Widening::new(sampler, samples_per_pixel),
            tests: Tests::new(settings),
            materials: None,
            types: None,
            scripts: Vec::new(),
            exact_pairs: true,
            hidden: None,
            settings: settings.clone(),
        };
        rules.types = TypeRules::new(&rules);
        rules.hidden = settings.hidden.as_ref().filter(|_| settings.surfaces > 1).map(|hidden| HiddenStyle {
            color: hidden.color.to_array(),
            radius_squared: rules.radius(hidden.width) * rules.radius(hidden.width),
            alpha: rules.alpha(hidden.width),
            objects: hidden.objects.as_ref().map(|objects| {
                let mut ids: Vec<u32> = objects.iter().map(|id| id.0 + 1).collect();
                ids.sort_unstable();
                ids
            }),
        });
        rules
    }

    /// The same rules, knowing that no width that a shader gives is above `width` pixels: less reach, so smaller halos. A
    /// wider line counts as this wide.
    #[must_use]
    pub fn with_widest(mut self, width: f32) -> Self {
        self.widest = self.widest.min(width.max(0.0));
        self.types = TypeRules::new(&self);
        self
    }

    /// Whether the same samples have the same lines under other rules, but for what their tests find and what they look
    /// like. What the rules know of the widest line only bounds the search, and samples have a width and a colour of their
    /// own.
    pub(super) fn same_but_for_tests_and_looks(&self, other: &Self) -> bool {
        let narrower = self.widest.min(other.widest);
        let bare = |rules: &Self| {
            let mut bare = rules.clone();
            let LineSettings { color, width, tint, compose, .. } = LineSettings::default();
            let untested = LineOverrides::NO_TESTS.over(&bare.settings);
            bare.settings = LineSettings { color, width, tint, compose, ..untested };
            bare.settings.types = bare.settings.types.map(|style| TypeStyle { color: None, opacity: None, ..style });
            if let Some(hidden) = &mut bare.settings.hidden {
                hidden.color = Vec3::ZERO;
            }
            if let Some(hidden) = &mut bare.hidden {
                hidden.color = [0.0; 3];
            }
            bare.with_materials(&[]).with_widest(narrower)
        };
        // With types, it matters which of several pairs is found that look alike.
        self.exact_pairs() == other.exact_pairs() && bare(self) == bare(other)
    }

    /// Whether bounds of a tile that were made by other rules serve these, too: how far apart attributes must be, and
    /// what lines look like but for their width, does not enter them.
    #[must_use]
    pub fn same_bounds(&self, other: &Self) -> bool {
        let narrower = self.widest.min(other.widest);
        let read = |rules: &Self| {
            let Tests { uv_squared, chord_squared, feature, overlap, .. } = rules.tests;
            [uv_squared, chord_squared, feature, overlap].map(|threshold| threshold < f32::INFINITY)
        };
        let widths = |rules: &Self| {
            let settings = &rules.settings;
            let narrowed = rules.clone().with_widest(narrower);
            (settings.min_width, settings.width_compensation, rules.widening, narrowed.types)
        };
        read(self) == read(other)
            && widths(self) == widths(other)
            && self.settings.paths == other.settings.paths
            && self.settings.surfaces == other.settings.surfaces
            && self.no_scripts() == other.no_scripts()
    }

    /// Whether lines look otherwise where nodes pass on other amounts of light.
    #[must_use]
    pub fn read_light(&self) -> bool {
        self.settings.tint || self.settings.compose == Composition::Throughput
    }

    /// The same rules, knowing what each material's script changes about its lines, by material id.
    #[must_use]
    pub fn with_scripts(mut self, materials: &[LineScript]) -> Self {
        if materials.iter().any(|script| *script != LineScript::None) {
            self.scripts = std::iter::once(LineScript::None).chain(materials.iter().copied()).collect();
        }
        self
    }

    /// What types change, if any does.
    pub(super) fn types(&self) -> Option<&TypeRules> {
        self.types.as_ref()
    }

    /// What a script changes about the lines of a material, by its `shader` value.
    #[inline]
    pub(super) fn script_of(&self, shader: u32) -> LineScript {
        self.scripts.get(shader as usize).copied().unwrap_or_default()
    }

    /// How many `shader` values there are whose tests may be others than those of the first.
    pub(super) fn shaders_tested(&self) -> u32 {
        self.materials.as_ref().map_or(1, MaterialTests::shaders)
    }

    /// The colour of hidden lines.
    pub(super) fn hidden_color(&self) -> Option<[f32; 3]> {
        self.hidden.as_ref().map(|hidden| hidden.color)
    }

    /// Whether no script styles any line.
    pub(super) fn no_scripts(&self) -> bool {
        self.scripts.is_empty()
    }

    /// The squared radius of the widest line that a node can draw which asks for this one.
    #[inline]
    pub(super) fn widest_squared(&self, asked_squared: f32) -> f32 {
        self.types.as_ref().map_or(asked_squared, |types| types.widest_squared(asked_squared))
    }

    /// The squared radius of the thinnest.
    #[inline]
    pub(super) fn thinnest_squared(&self, asked_squared: f32) -> f32 {
        self.types.as_ref().map_or(asked_squared, |types| types.thinnest_squared(asked_squared))
    }

    /// The same rules with what each material changes about the tests, in the order of their ids.
    #[must_use]
    pub fn with_materials(mut self, overrides: &[LineOverrides]) -> Self {
        self.materials = MaterialTests::new(&self.settings, overrides);
        self.tests = match &self.materials {
            Some(materials) => materials.loosest(&[[0, u32::MAX]]),
            None => Tests::new(&self.settings),
        };
        self
    }

    /// The same rules for callers to whom only the looks of lines matter: colours, alpha and path are those of the pair
    /// that is seen, but the neighbour and the tests that fired may be those of another that looks alike. Where all
    /// lines near by have one style, the search then stops at the first.
    #[must_use]
    pub fn with_any_pair(mut self) -> Self {
        self.exact_pairs = false;
        self
    }

    pub(super) fn exact_pairs(&self) -> bool {
        // What a line looks like depends on the pair where types differ.
        self.exact_pairs || self.types.is_some()
    }

    /// How many surfaces a list holds at most.
    pub(super) fn surfaces(&self) -> usize {
        self.settings.surfaces as usize
    }

    /// How hidden lines are drawn, if any can be seen.
    pub(super) fn hidden(&self) -> Option<&HiddenStyle> {
        self.hidden.as_ref().filter(|hidden| hidden.radius_squared > 0.0)
    }

    /// The settings that the rules were made from.
    #[must_use]
    pub fn settings(&self) -> &LineSettings {
        &self.settings
    }

    /// Widths above this count as this.
    pub(super) fn widest(&self) -> f32 {
        self.widest
    }

    /// Whoever styles the line, nothing differs that these find alike.
    pub(super) fn tests(&self) -> &Tests {
        &self.tests
    }

    /// The tests of pairs that a material styles, by its `shader` value.
    #[inline]
    pub(super) fn tests_of(&self, shader: u32) -> &Tests {
        match &self.materials {
            None => &self.tests,
            Some(materials) => materials.of(shader),
        }
    }

    /// The settings that hold for lines that a material styles.
    pub(super) fn settings_of(&self, shader: u32) -> LineSettings {
        match &self.materials {
            None => self.settings.clone(),
            Some(materials) => materials.overrides_of(shader).over(&self.settings),
        }
    }

    /// The tests by material, if they are not the same for all.
    pub(super) fn materials(&self) -> Option<&MaterialTests> {
        self.materials.as_ref()
    }

    /// The half width within which a neighbour makes a line of this full width visible: half the effective width,
    /// widened by the thinning compensation (DESIGN section 3.9). 0 if the width is no line. In pixels.
    #[must_use]
    pub fn radius(&self, width: f32) -> f32 {
        let width = width.min(self.widest);
        if width <= 0.0 {
            return 0.0;
        }
        let half = width.max(self.settings.min_width) / 2.0;
        if self.settings.width_compensation { self.widening.radius(half) } else { half }
    }

    /// How much of the sample a line of this full width covers: 1, or less below the minimum width (OG18 section 3.5).
    #[must_use]
    pub fn alpha(&self, width: f32) -> f32 {
        let minimum = self.settings.min_width;
        if minimum > 0.0 { (width.min(self.widest) / minimum).clamp(0.0, 1.0) } else { 1.0 }
    }

    /// How far a line reaches at most, in whole pixels: neighbours farther than this many pixels never matter.
    #[must_use]
    pub fn reach(&self) -> i32 {
        let hidden = self.hidden().map_or(0.0, |hidden| hidden.radius_squared.sqrt());
        self.radius(self.widest).max(hidden).ceil() as i32
    }

    /// Whether nodes at this path draw lines: the camera's if cameras do, any other if all kinds of its events do.
    #[must_use]
    pub fn draws(&self, path: NodePath) -> bool {
        let mut needed = RayKinds::empty();
        needed.set(RayKinds::CAMERA, path == NodePath::CAMERA);
        needed.set(RayKinds::REFLECTION, path.has_reflection());
        needed.set(RayKinds::REFRACTION, path.has_refraction());
        self.settings.paths.contains(needed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rules(samples: u32, change: impl FnOnce(&mut LineSettings)) -> Rules {
        let mut settings = LineSettings { max_width: 64.0, ..LineSettings::default() };
        change(&mut settings);
        Rules::new(&settings, samples)
    }

    #[test]
    fn the_paper_radius_is_half_the_effective_width() {
        let rules = rules(16, |s| s.width_compensation = false);
        let radii = [-1.0, 0.0, 0.25, 0.5, 3.0, 64.0, 1e9].map(|width| rules.radius(width));
        assert_eq!(radii, [0.0, 0.0, 0.25, 0.25, 1.5, 32.0, 32.0]);
        assert_eq!(rules.reach(), 32);
        assert_eq!(rules.clone().with_widest(2.5).reach(), 2);
        assert_eq!(rules.clone().with_widest(0.0).reach(), 0);
        assert_eq!(rules.with_widest(f32::INFINITY).reach(), 32);
    }

    #[test]
    fn compensation_solves_its_equation() {
        for samples in [1, 4, 16, 64, 1024] {
            let rules = rules(samples, |s| s.min_width = 0.0);
            for width in [1e-6, 0.1, 0.5, 1.0, 2.0, 8.0, 64.0_f32] {
                let r = f64::from(rules.radius(width));
                let h = 0.84 * (3.0 / (4.0 * (2.0 * r).sqrt() * f64::from(samples))).powf(2.0 / 3.0);
                let error = r - h - f64::from(width) / 2.0;
                assert!(error.abs() < 1e-6 * r.max(1.0), "{samples} samples, {width} px: off by {error}");
            }
        }
    }

    #[test]
    fn alpha_is_the_part_of_the_minimum_width() {
        let rules = rules(16, |_| ());
        assert_eq!([0.0, 0.125, 0.25, 0.5, 9.0].map(|width| rules.alpha(width)), [0.0, 0.25, 0.5, 1.0, 1.0]);
        let without = self::rules(16, |s| s.min_width = 0.0);
        assert_eq!(without.alpha(1e-9), 1.0);
    }

    #[test]
    fn a_path_draws_if_all_its_kinds_do() {
        let camera = NodePath::CAMERA;
        let paths = [camera, camera.reflected(), camera.refracted(), camera.reflected().refracted()];
        let drawn = |kinds| paths.map(|path| rules(16, |s| s.paths = kinds).draws(path));
        assert_eq!(drawn(RayKinds::all()), [true; 4]);
        assert_eq!(drawn(RayKinds::CAMERA), [true, false, false, false]);
        assert_eq!(drawn(RayKinds::REFLECTION), [false, true, false, false]);
        assert_eq!(drawn(RayKinds::REFLECTION | RayKinds::REFRACTION), [false, true, true, true]);
        assert_eq!(drawn(RayKinds::empty()), [false; 4]);
    }
}
