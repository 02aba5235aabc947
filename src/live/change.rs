//! What an edit changed, and what must be done again for it.
//!
//! Setups are compared, not files: an edit that means nothing costs nothing, and two that come together cost what both
//! touch. Where it is not certain that something stays as it was, it is done again.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::line::RuleChange;
use crate::plan::{LINE_SLICE, MaterialPlan, Plan};
use crate::sample::SampleLayout;
use crate::scene::Scene;
use crate::scene::ids::MaterialId;
use crate::scene::settings::{Background, LineSettings};
use crate::shade::{InputSet, Mode, OutputSet, Shader, Shaders};

/// What must be done again. Grows until it is done.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Redo {
    /// Rays meet other things: all is traced.
    pub trace: bool,
    /// Which of several surfaces at one place comes first may have changed.
    pub ties: bool,
    /// What hits see of lights has changed.
    pub visibility: bool,
    /// Everything is shaded, with rays that are known.
    pub shade: bool,
    /// All tiles are shaded that see one of these materials.
    pub shade_materials: BTreeSet<MaterialId>,
    /// Hits of these materials get other line attributes.
    pub restyle: BTreeSet<MaterialId>,
    /// What the line pass needs other bounds for.
    pub bounds: bool,
}

/// What leads from one setup to another.
#[derive(Clone, Debug, Default)]
pub(super) struct Change {
    /// What must be done again to samples.
    pub redo: Redo,
    /// Which lines must be looked for again though samples stay.
    pub lines: RuleChange,
    /// Whether all tiles are developed.
    pub film: bool,
}

/// A setup at some number of samples, as far as the picture depends on it.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    pub scene: &'a Scene,
    pub shaders: &'a Shaders,
    pub plan: &'a Plan,
}

impl Redo {
    /// Everything.
    pub fn all() -> Self {
        Self { trace: true, visibility: true, shade: true, bounds: true, ..Self::default() }
    }

    /// Whether there is nothing to do.
    pub fn is_nothing(&self) -> bool {
        *self == Self::default()
    }

    /// Whether anything must be shaded again.
    pub fn shades(&self) -> bool {
        self.shade || self.visibility || !self.shade_materials.is_empty()
    }

    /// Adds what another asks for.
    pub fn add(&mut self, other: &Self) {
        self.trace |= other.trace;
        self.ties |= other.ties;
        self.visibility |= other.visibility;
        self.shade |= other.shade;
        self.shade_materials.extend(&other.shade_materials);
        self.restyle.extend(&other.restyle);
        self.bounds |= other.bounds;
    }

    /// What a tile needs of it that sees only some materials.
    pub fn of_tile(&self, seen: impl Fn(MaterialId) -> bool) -> Self {
        let seen_of = |ids: &BTreeSet<MaterialId>| ids.iter().copied().filter(|id| seen(*id)).collect();
        Self { shade_materials: seen_of(&self.shade_materials), restyle: seen_of(&self.restyle), ..self.clone() }
    }
}

impl Change {
    /// From one setup to another.
    pub fn between(old: View<'_>, new: View<'_>) -> Self {
        let mut redo = Redo::default();
        let same_rays = same_world(old, new)
            && old.scene.camera() == new.scene.camera()
            && same_sampling(old.scene, new.scene)
            && old.plan.surfaces == new.plan.surfaces
            && old.plan.bodies == new.plan.bodies
            && (new.plan.surfaces == 1 || same_lists(old, new));
        if !same_rays {
            return Self { redo: Redo::all(), lines: RuleChange::everything(), film: true };
        }
        if !same_ties(old.scene, new.scene) {
            redo.ties = true;
            redo.visibility = true;
            redo.shade = true;
        }
        if old.scene.lights() != new.scene.lights()
            && (old.plan.takes_light_samples() || new.plan.takes_light_samples())
        {
            redo.visibility = true;
            redo.shade = true;
        }
        redo.shade |= old.scene.time() != new.scene.time();
        redo.shade |= !same_shading(old, new);
        redo.bounds |= match (&old.plan.lines, &new.plan.lines) {
            (Some(a), Some(b)) => !a.rules.same_bounds(&b.rules),
            (a, b) => a.is_some() != b.is_some(),
        };
        let mut lines = match (&old.plan.lines, &new.plan.lines) {
            (Some(a), Some(b)) => RuleChange::between(&a.rules, &b.rules),
            (None, None) => RuleChange::default(),
            _ => RuleChange::everything(),
        };
        for (index, (a, b)) in old.shaders.iter().zip(new.shaders.iter()).enumerate() {
            let id = MaterialId::from_index(index);
            compare_material(&mut redo, id, (a, old), (b, new));
            if !a.same_as(b) && (a.styles_lines() || b.styles_lines()) {
                lines = lines.with_looks();
            }
        }
        let film = old.plan.filter != new.plan.filter || old.plan.layers != new.plan.layers;
        Self { redo, lines, film }
    }
}

impl View<'_> {
    /// Whether the hierarchies are those of another view.
    pub fn same_world(self, other: View<'_>) -> bool {
        same_world(other, self)
            && same_ties(other.scene, self.scene)
            && self.scene.camera().position == other.scene.camera().position
    }
}

/// Whether rays that start alike meet the same surfaces.
fn same_world(old: View<'_>, new: View<'_>) -> bool {
    let (a, b) = (old.scene.objects(), new.scene.objects());
    let sided = |view: View<'_>| -> Vec<(bool, bool)> {
        let materials = view.scene.materials().iter().zip(&view.plan.materials);
        materials.map(|(material, plan)| (material.double_sided, plan.refracts)).collect()
    };
    a.len() == b.len()
        && a.iter().zip(b).all(|(a, b)| {
            a.mesh == b.mesh
                && a.materials == b.materials
                && a.world_from_object == b.world_from_object
                && a.visible_to == b.visible_to
        })
        && sided(old) == sided(new)
        && old.scene.meshes().len() == new.scene.meshes().len()
        && old.scene.meshes().iter().zip(new.scene.meshes()).all(|(a, b)| Arc::ptr_eq(a, b) || a == b)
}

/// Whether of several surfaces at one place the same come first.
fn same_ties(old: &Scene, new: &Scene) -> bool {
    let of_objects = |scene: &Scene| -> Vec<_> { scene.objects().iter().map(|object| object.priority).collect() };
    let of_materials = |scene: &Scene| -> Vec<_> {
        scene.materials().iter().map(|material| (material.priority, material.dielectric_priority)).collect()
    };
    of_objects(old) == of_objects(new) && of_materials(old) == of_materials(new)
}

/// Whether the camera's rays start alike.
fn same_sampling(old: &Scene, new: &Scene) -> bool {
    let (a, b) = (old.render(), new.render());
    a.size == b.size && a.samples == b.samples && a.sampler == b.sampler && a.seed == b.seed
}

/// Whether lists keep the same surfaces of those that rays meet.
fn same_lists(old: View<'_>, new: View<'_>) -> bool {
    let kept = |view: View<'_>| {
        let tests = view.plan.lines.as_ref().map(|lines| &lines.tests);
        tests.map(|tests| (tests.tests_shapes(), tests.object, tests.shader, tests.paths))
    };
    kept(old) == kept(new)
        && old.plan.lists_are_opaque() == new.plan.lists_are_opaque()
        && old.scene.stand_ins() == new.scene.stand_ins()
}

/// Whether rays that leave the scene see the same.
fn same_background(old: &Scene, new: &Scene) -> bool {
    let image = |scene: &Scene| match scene.render().background {
        Background::Image { texture, .. } => scene.textures().get(texture.index()).cloned(),
        _ => None,
    };
    old.render().background == new.render().background
        && match (image(old), image(new)) {
            (Some(a), Some(b)) => a.looks_like(&b),
            (a, b) => a.is_none() && b.is_none(),
        }
}

/// Whether hits of unchanged shaders become the same samples.
fn same_shading(old: View<'_>, new: View<'_>) -> bool {
    let (a, b) = (old.scene.render(), new.scene.render());
    let groups = |scene: &Scene| -> Vec<_> { scene.objects().iter().map(|object| object.group.clone()).collect() };
    let layout =
        |view: View<'_>| SampleLayout { max_width: 0.0, declared_widths: Vec::new(), ..view.plan.layout.clone() };
    same_background(old.scene, new.scene)
        && a.ambient == b.ambient
        && layout(old) == layout(new)
        && old.plan.color == new.plan.color
        && old.plan.reflection_depth == new.plan.reflection_depth
        && old.plan.refraction_depth == new.plan.refraction_depth
        && old.plan.follows_cones() == new.plan.follows_cones()
        && old.plan.lines.is_some() == new.plan.lines.is_some()
        && old.scene.attributes() == new.scene.attributes()
        && groups(old.scene) == groups(new.scene)
        && old.shaders.aovs() == new.shaders.aovs()
}

/// Whether what scripts leave open about lines, and the widest line, are the same for a material.
fn same_style(old: View<'_>, new: View<'_>, id: MaterialId, shader: &Shader) -> bool {
    let draws = |settings: &LineSettings| (settings.width, settings.color);
    let may_leave_out = |output: OutputSet| !shader.analysis().output(output).always;
    let open = may_leave_out(OutputSet::LINE_WIDTH) || may_leave_out(OutputSet::LINE_COLOR);
    let objects = old.scene.objects().iter().zip(new.scene.objects());
    let mut drawing = objects.filter(|(object, _)| object.materials.contains(&id));
    let limit = |view: View<'_>| {
        let layout = &view.plan.layout;
        (layout.max_width, layout.declared_widths.get(id.index()).copied().flatten())
    };
    (!open || draws(old.scene.lines()) == draws(new.scene.lines()))
        && drawing.all(|(a, b)| a.priority == b.priority && a.lines == b.lines)
        && old.scene.materials()[id.index()].priority == new.scene.materials()[id.index()].priority
        && limit(old) == limit(new)
}

/// What differs between two shaders of a material.
fn compare_material(redo: &mut Redo, id: MaterialId, (a, old): (&Shader, View<'_>), (b, new): (&Shader, View<'_>)) {
    let (before, after) = (&old.plan.materials[id.index()], &new.plan.materials[id.index()]);
    let same = a.same_as(b);
    if same && before == after && same_style(old, new, id, b) {
        return;
    }
    if before.blocks_light() != after.blocks_light()
        || (!same && !after.blocks_light() && !a.same_outputs(b, OPACITY_SLICE))
    {
        // Its shadows may be other ones, wherever they fall.
        redo.visibility = true;
        redo.shade = true;
        return;
    }
    let restylable = same_but_for_lines(before, after)
        && (same || a.same_outputs(b, OutputSet::all().difference(LINE_SLICE)))
        && !a.may_fail(LINE_SLICE)
        && !b.may_fail(LINE_SLICE);
    if restylable {
        redo.restyle.insert(id);
    } else if new.plan.bodies.contains(&true) && after.refracts {
        // Rays that start in it, or pass it where another body outranks it, have no hit there.
        redo.shade = true;
    } else {
        redo.shade_materials.insert(id);
    }
}

/// What shadow rays ask a see-through surface for.
const OPACITY_SLICE: OutputSet =
    OutputSet::OPACITY.union(OutputSet::TRANSMISSION).union(OutputSet::METALLIC).union(OutputSet::COLOR);

/// Whether a material is rendered in the same way but for what lines ask of it.
fn same_but_for_lines(old: &MaterialPlan, new: &MaterialPlan) -> bool {
    let but_for_lines = |plan: &MaterialPlan| {
        let mut plan = plan.clone();
        plan.wanted = plan.wanted.difference(LINE_SLICE);
        plan.inputs = InputSet::empty();
        plan.mode = Mode::Constant;
        plan.lights = false;
        plan.behind.wanted = plan.behind.wanted.difference(LINE_SLICE);
        plan.behind.inputs = InputSet::empty();
        plan.behind.lights = false;
        plan
    };
    but_for_lines(old) == but_for_lines(new)
}
