//! The plan: what this scene calls for, derived once and obeyed by every later stage (DESIGN section 5).
//!
//! Its `Display` is what `tusche explain` prints; the golden texts beside the shipped scenes hold it still.

mod explain;

use std::fmt;

pub(crate) use explain::filter_name;

use crate::film::{Filter, Layer};
use crate::line::{LineScript, Rules};
use crate::sample::{NodeColumnSet, SampleLayout};
use crate::scene::ids::MaterialId;
use crate::scene::settings::{LineOverrides, LineSettings, RayKinds};
use crate::scene::{Object, Scene};
use crate::shade::analysis::OutputFact;
use crate::shade::bsdf::MIRROR_ROUGHNESS;
use crate::shade::{InputSet, Mode, OutputSet, PairSet, Shader, Shaders};

/// What rendering does with the hits of one material.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialPlan {
    /// Outputs that are evaluated.
    pub wanted: OutputSet,
    /// Inputs that are gathered.
    pub inputs: InputSet,
    /// How the shader is run.
    pub mode: Mode,
    /// Whether lights can reach the eye by scattering here.
    pub lit: bool,
    /// Whether light samples are taken here, for the BSDF or for the script.
    pub lights: bool,
    /// Whether rays may be mirrored here.
    pub reflects: bool,
    /// Whether rays may be refracted here.
    pub refracts: bool,
    /// Whether rays may go straight on here because the surface is not fully opaque.
    pub see_through: bool,
    /// What is asked of its hits behind the first of a ray, for lines alone.
    pub behind: BehindPlan,
    /// Whether any object uses it.
    used: bool,
}

/// What rendering asks of the shader where a hit lies behind the first of its ray (DESIGN section 3.4).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BehindPlan {
    /// Outputs that are evaluated, with the one that marks hits whose script failed.
    pub wanted: OutputSet,
    /// Inputs that are gathered.
    pub inputs: InputSet,
    /// Whether light samples are taken, for the script.
    pub lights: bool,
}

impl MaterialPlan {
    /// Whether a shadow ray surely ends here.
    #[must_use]
    pub fn blocks_light(&self) -> bool {
        !self.refracts && !self.see_through
    }
}

/// The line pass, if there is one.
#[derive(Clone, Debug, PartialEq)]
pub struct LinePlan {
    /// The rules, with the widest line that can occur worked out.
    pub rules: Rules,
    /// The widest line that can occur, in pixels.
    pub widest: f32,
    /// How far lines reach, in whole pixels: the border of samples that a tile needs around it.
    pub reach: i32,
    /// Whether scripts style lines one by one.
    pub scripted: bool,
    /// The settings with the tests that are on for any material that draws lines.
    pub tests: LineSettings,
}

/// More samples where lines are (`render.line_oversampling`): samples per pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Oversampling {
    /// Of the pilot that looks for lines.
    pub pilot: u32,
    /// Where it finds some.
    pub lines: u32,
    /// Elsewhere.
    pub elsewhere: u32,
}

impl Oversampling {
    /// Side in pixels of the blocks of a picture that have one rate or the other.
    pub const BLOCK: u32 = 16;
}

/// What this scene calls for.
#[derive(Clone, Debug)]
pub struct Plan {
    /// By material.
    pub materials: Vec<MaterialPlan>,
    /// Whether any layer shows colours; if not, nothing is lit.
    pub color: bool,
    /// Most mirror reflections along a path; 0 if nothing mirrors.
    pub reflection_depth: u32,
    /// Most refractions along a path; 0 if nothing is transparent.
    pub refraction_depth: u32,
    /// By object, whether it is a body that rays can be inside of; empty if there is none.
    pub bodies: Vec<bool>,
    /// Whether shadow rays are traced.
    pub shadow_rays: bool,
    /// The line pass; `None` if no line can be seen.
    pub lines: Option<LinePlan>,
    /// Where pixels get more samples; `None` if all get the same number.
    pub oversampling: Option<Oversampling>,
    /// How many surfaces a ray's list holds at most; 1 without lines.
    pub surfaces: u32,
    /// What samples keep.
    pub layout: SampleLayout,
    /// The layers that are developed.
    pub layers: Vec<Layer>,
    /// The pixel filter.
    pub filter: Filter,
    explanation: String,
}

impl Plan {
    /// Derives the plan of a scene for the layers that will be written.
    #[must_use]
    pub fn new(scene: &Scene, shaders: &Shaders, layers: &[Layer]) -> Self {
        let settings = scene.render();
        let color = layers.iter().any(|layer| matches!(layer, Layer::Rgba | Layer::Color | Layer::Below));
        let used = used_materials(scene);
        let tests = scene.lines();

        let has_lights = !scene.lights().is_empty();
        let mut materials: Vec<MaterialPlan> =
            shaders.iter().zip(&used).map(|(shader, used)| plan_material(shader, has_lights, color, *used)).collect();
        let any = |what: fn(&MaterialPlan) -> bool| materials.iter().any(|m| m.used && what(m));
        let reflects = any(|m| m.reflects);
        let passes = any(|m| m.refracts || m.see_through);
        let reflection_depth = if reflects { settings.reflection_depth } else { 0 };
        let refraction_depth = if passes { settings.refraction_depth } else { 0 };

        let lines = plan_lines(scene, shaders, layers);
        let oversampling = (lines.is_some() && settings.line_oversampling > 1).then(|| Oversampling {
            pilot: (settings.samples / PILOT_SHARE).clamp(1, MOST_PILOT_SAMPLES),
            lines: settings.samples.saturating_mul(settings.line_oversampling),
            elsewhere: settings.samples,
        });
        let surfaces = if lines.is_some() { tests.surfaces } else { 1 };
        let in_play = tests_in_play(scene, &drawing_materials(scene));
        let pairs = lines.as_ref().map_or(PairSet::empty(), |_| read_on_pairs(scene, shaders));
        let wants_feature =
            in_play.feature.is_some() || layers.contains(&Layer::Feature) || pairs.contains(PairSet::FEATURE);
        for (material, shader) in materials.iter_mut().zip(shaders.iter()) {
            let may = shader.analysis().writable();
            if lines.is_some() {
                material.wanted |= may & LINE_OUTPUTS;
            }
            if wants_feature && (lines.is_some() || layers.contains(&Layer::Feature)) {
                material.wanted |= may & OutputSet::FEATURE;
            }
            // Only now is it known what is asked of the shader, and so what it reads.
            material.inputs = shader.needs(material.wanted | marker(color, lines.is_some()));
            material.lights = has_lights && (material.lit || material.inputs.intersects(InputSet::LIGHTS));
            if surfaces > 1 {
                let behind = &mut material.behind;
                behind.wanted = material.wanted & (LINE_OUTPUTS | OutputSet::OPACITY);
                if in_play.feature.is_some() {
                    behind.wanted |= material.wanted & OutputSet::FEATURE;
                }
                behind.wanted |= marker(false, true);
                behind.inputs = shader.needs(behind.wanted);
                behind.lights = has_lights && behind.inputs.intersects(InputSet::LIGHTS);
            }
        }

        let secondary = reflection_depth + refraction_depth > 0;
        let line_paths = lines.is_some() && secondary;
        let throughput_composition = tests.compose == crate::scene::settings::Composition::Throughput;
        let columns = NodeColumnSet {
            uv: (lines.is_some() && in_play.uv.is_some()) || layers.contains(&Layer::Uv),
            normal: (lines.is_some() && in_play.normal.is_some())
                || layers.contains(&Layer::Normal)
                || pairs.contains(PairSet::NORMAL),
            feature: wants_feature && (lines.is_some() || layers.contains(&Layer::Feature)),
            depth: lines.is_some() || layers.contains(&Layer::Depth),
            lines: lines.is_some(),
            member: layers.contains(&Layer::Object) && !scene.stand_ins().is_empty(),
            overlap: lines.is_some() && in_play.overlap.is_some(),
            position: pairs.contains(PairSet::POSITION),
            throughput: line_paths && (tests.tint || throughput_composition),
            contribution: lines.is_some() && throughput_composition,
        };
        let has_aovs = layers.iter().any(|layer| matches!(layer, Layer::Aov(..)));
        let aovs = if has_aovs { shaders.aovs().len() } else { 0 };
        let layout = SampleLayout {
            samples_per_pixel: settings.samples,
            columns,
            position: layers.contains(&Layer::Position),
            aovs,
            max_width: tests.max_width,
            declared_widths: shaders.iter().map(|shader| shader.params().max_line_width()).collect(),
            materials: materials.len(),
        };
        let shadow_rays = materials.iter().any(|m| m.used && (m.lights || m.behind.lights))
            && scene.lights().iter().any(|l| l.shadows);
        let bodies = if refraction_depth > 0 { bodies(scene, &materials) } else { Vec::new() };
        let mut plan = Self {
            materials,
            color,
            reflection_depth,
            refraction_depth,
            bodies,
            shadow_rays,
            lines,
            oversampling,
            surfaces,
            layout,
            layers: layers.to_vec(),
            filter: Filter::new(settings.filter, settings.filter_radius),
            explanation: String::new(),
        };
        plan.explanation = explain::explain(&plan, scene, shaders);
        plan
    }

    /// Whether a shader or the overlap test asks how wide a pixel is, so that curved mirrors and glass must be accounted
    /// for.
    #[must_use]
    pub fn follows_cones(&self) -> bool {
        self.layout.columns.overlap || self.materials.iter().any(|material| material.inputs.intersects(InputSet::CONE))
    }

    /// Whether light samples are taken anywhere.
    #[must_use]
    pub fn takes_light_samples(&self) -> bool {
        self.materials.iter().any(|material| material.used && (material.lights || material.behind.lights))
    }

    /// Whether no surface in a list can turn out to be invisible, so that lists depend on no shader.
    #[must_use]
    pub fn lists_are_opaque(&self) -> bool {
        self.bodies.is_empty() && !self.materials.iter().any(|material| material.used && material.see_through)
    }

    /// Whether any ray but those of the camera may be traced along a path.
    #[must_use]
    pub fn has_secondary_rays(&self) -> bool {
        self.reflection_depth + self.refraction_depth > 0
    }
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.explanation)
    }
}

/// The pilot that looks for lines has this part of the picture's samples, but at most so many: more find hardly more.
const PILOT_SHARE: u32 = 4;
const MOST_PILOT_SAMPLES: u32 = 4;

/// How a surface's lines look.
const LINE_OUTPUTS: OutputSet =
    OutputSet::LINE_COLOR.union(OutputSet::LINE_WIDTH).union(OutputSet::LINE_OPACITY).union(OutputSet::PRIORITY);

/// What a shader gives to the line pass alone: colours and rays do not depend on it.
pub const LINE_SLICE: OutputSet = LINE_OUTPUTS.union(OutputSet::FEATURE);

/// Outputs that mark a hit whose script failed, which no analysis of the script foresees.
#[must_use]
pub fn marker(color: bool, lines: bool) -> OutputSet {
    let color = if color { OutputSet::COLOR } else { OutputSet::empty() };
    let width = if lines { OutputSet::LINE_WIDTH } else { OutputSet::empty() };
    color | width
}

fn used_materials(scene: &Scene) -> Vec<bool> {
    let mut used = vec![false; scene.materials().len()];
    for object in scene.objects() {
        for slot in &object.materials {
            used[slot.index()] = true;
        }
    }
    used
}

/// Which objects are bodies that rays can be inside of. An object that some rays do not see is none: they would enter it and
/// never leave.
fn bodies(scene: &Scene, materials: &[MaterialPlan]) -> Vec<bool> {
    let seen = RayKinds::CAMERA | RayKinds::REFLECTION | RayKinds::REFRACTION;
    // By mesh; most scenes use few of glass, but those often.
    let mut closed = vec![None; scene.meshes().len()];
    let mut is_body = |object: &Object| {
        let mesh = object.mesh.index();
        refracts(object, materials)
            && object.visible_to.contains(seen)
            && *closed[mesh].get_or_insert_with(|| scene.meshes()[mesh].is_closed())
    };
    let bodies: Vec<bool> = scene.objects().iter().map(&mut is_body).collect();
    if bodies.contains(&true) { bodies } else { Vec::new() }
}

fn refracts(object: &Object, materials: &[MaterialPlan]) -> bool {
    object.materials.iter().any(|id| materials[id.index()].refracts)
}

/// Least and greatest value an output can have, with its default where the script may leave it out; `None` if unknown.
pub(crate) fn bounds(fact: &OutputFact, default: f32) -> Option<[f32; 2]> {
    if !fact.may {
        return Some([default; 2]);
    }
    let [low, high] = fact.range?;
    Some(if fact.always { [low, high] } else { [low.min(default), high.max(default)] })
}

fn plan_material(shader: &Shader, lights: bool, color: bool, used: bool) -> MaterialPlan {
    let analysis = shader.analysis();
    let least = |output, default| bounds(analysis.output(output), default).map_or(f32::NEG_INFINITY, |b| b[0]);
    let greatest = |output, default| bounds(analysis.output(output), default).map_or(f32::INFINITY, |b| b[1]);
    let bypass = analysis.output(OutputSet::COLOR).always;

    let may_be_smooth = least(OutputSet::ROUGHNESS, 1.0) <= MIRROR_ROUGHNESS;
    let may_be_rough = greatest(OutputSet::ROUGHNESS, 1.0) > MIRROR_ROUGHNESS;
    let metallic = greatest(OutputSet::METALLIC, 0.0) > 0.0;
    let shiny = greatest(OutputSet::SPECULAR, 1.0) > 0.0 || metallic;
    let refracts = !bypass && greatest(OutputSet::TRANSMISSION, 0.0) > 0.0;
    let reflects = !bypass && ((may_be_smooth && shiny) || refracts);
    let see_through = least(OutputSet::OPACITY, 1.0) < 1.0;
    let diffuse = greatest(OutputSet::BASE_COLOR, 0.8) > 0.0
        && least(OutputSet::METALLIC, 0.0) < 1.0
        && least(OutputSet::TRANSMISSION, 0.0) < 1.0;
    let lit = !bypass && color && lights && (diffuse || (may_be_rough && shiny));

    // Rays depend on these even where no layer shows the colour.
    let mut wanted = OutputSet::OPACITY;
    if reflects || refracts {
        wanted |= OutputSet::BSDF | OutputSet::COLOR;
    }
    if color {
        wanted |= OutputSet::BSDF | OutputSet::COLOR;
    }
    MaterialPlan {
        wanted: wanted & analysis.writable(),
        inputs: InputSet::empty(),
        behind: BehindPlan { wanted: OutputSet::empty(), inputs: InputSet::empty(), lights: false },
        mode: shader.mode(),
        lit,
        lights: false,
        reflects,
        refracts,
        see_through,
        used,
    }
}

fn plan_lines(scene: &Scene, shaders: &Shaders, layers: &[Layer]) -> Option<LinePlan> {
    let settings = scene.lines();
    let shown = layers.iter().any(|l| match l {
        Layer::Rgba | Layer::Below | Layer::Line | Layer::LineType(_) | Layer::LinePath(_) => true,
        Layer::HiddenLine => settings.hidden.is_some(),
        _ => false,
    });
    let draws = drawing_materials(scene);
    let tests = tests_in_play(scene, &draws);
    let tested = tests.tests_anything();
    if !settings.enabled || !shown || !tested || settings.paths.is_empty() {
        return None;
    }
    let widest = draws
        .iter()
        .enumerate()
        .filter(|(_, draws)| **draws)
        .map(|(index, _)| {
            let shader = shaders.of(MaterialId::from_index(index));
            let found = bounds(shader.analysis().output(OutputSet::LINE_WIDTH), settings.width).map(|b| b[1]);
            found.into_iter().chain(shader.params().max_line_width()).fold(settings.max_width, f32::min)
        })
        .fold(0.0, f32::max);
    if widest <= 0.0 {
        return None;
    }
    let of_types = settings.types.iter().filter_map(|style| style.width);
    let widest = of_types.fold(widest, f32::max).min(settings.max_width);
    // What draws no lines decides about none.
    let overrides = scene.materials().iter().zip(&draws);
    let overrides: Vec<_> =
        overrides.map(|(material, draws)| draws.then_some(material.lines).unwrap_or_default()).collect();
    // Nodes tell of an object in a group only the group.
    let mut settings = settings.clone();
    let stand_ins = scene.stand_ins();
    for id in settings.hidden.iter_mut().flat_map(|hidden| hidden.objects.iter_mut().flatten()) {
        *id = stand_ins.get(id.index()).copied().unwrap_or(*id);
    }
    let render = scene.render();
    let rules = Rules::for_sampler(&settings, render.sampler, render.samples);
    let rules = rules.with_widest(widest).with_materials(&overrides);
    let scripts: Vec<_> = shaders
        .iter()
        .zip(&draws)
        .map(|(shader, draws)| match (*draws && shader.styles_lines(), shader.changes_line_opacity()) {
            (false, _) => LineScript::None,
            (true, false) => LineScript::Color,
            (true, true) => LineScript::Opacity,
        })
        .collect();
    let rules = rules.with_scripts(&scripts);
    // Only layers by type tell why a line is there.
    let by_type = layers.iter().any(|layer| matches!(layer, Layer::LineType(_)));
    let rules = if by_type { rules } else { rules.with_any_pair() };
    let reach = rules.reach();
    Some(LinePlan { rules, widest, reach, scripted: scripts.iter().any(|script| *script != LineScript::None), tests })
}

/// What scripts that style lines read on their pairs.
fn read_on_pairs(scene: &Scene, shaders: &Shaders) -> PairSet {
    let draws = drawing_materials(scene);
    shaders.iter().zip(&draws).filter(|(_, draws)| **draws).map(|(shader, _)| shader.pair_needs()).collect()
}

/// Which materials are on objects that draw lines.
pub(crate) fn drawing_materials(scene: &Scene) -> Vec<bool> {
    let mut draws = vec![false; scene.materials().len()];
    for object in scene.objects().iter().filter(|object| object.lines) {
        for slot in &object.materials {
            draws[slot.index()] = true;
        }
    }
    draws
}

/// The tests that are on for any material that draws lines.
fn tests_in_play(scene: &Scene, draws: &[bool]) -> LineSettings {
    let none = LineOverrides::NO_TESTS;
    let drawing = scene.materials().iter().zip(draws).filter(|(_, draws)| **draws);
    drawing.map(|(material, _)| material.lines.over(scene.lines())).fold(none.over(scene.lines()), |all, one| {
        LineSettings {
            object: all.object || one.object,
            shader: all.shader || one.shader,
            uv: all.uv.or(one.uv),
            normal: all.normal.or(one.normal),
            feature: all.feature.or(one.feature),
            overlap: all.overlap.or(one.overlap),
            ..all
        }
    })
}
