//! The plan: what this scene calls for, derived once and obeyed by every later stage (DESIGN section 5).
//!
//! Its `Display` is what `tusche explain` prints; the golden texts beside the shipped scenes hold it still.

use std::fmt;

use crate::film::{Filter, Layer};
use crate::line::{LineScript, Rules};
use crate::sample::{NodeColumnSet, SampleLayout};
use crate::scene::ids::MaterialId;
use crate::scene::settings::{
    Background, FilterKind, LineOverrides, LineSettings, LineType, RayKinds, RenderSettings, Sampler,
};
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
            surfaces,
            layout,
            layers: layers.to_vec(),
            filter: Filter::new(settings.filter, settings.filter_radius),
            explanation: String::new(),
        };
        plan.explanation = explain(&plan, scene, shaders);
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
    let none = LineOverrides {
        object: Some(false),
        shader: Some(false),
        uv: Some(None),
        normal: Some(None),
        feature: Some(None),
        overlap: Some(None),
    };
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

fn explain(plan: &Plan, scene: &Scene, shaders: &Shaders) -> String {
    let mut text = String::new();
    let mut row = |name: &str, value: String| {
        text.push_str(&format!("{name:<16}{value}\n"));
    };
    let settings = scene.render();
    let [width, height] = settings.size;
    row("picture", format!("{width} x {height}, {} samples per pixel", samples_name(settings)));
    row("filter", format!("{}, radius {} px", filter_name(settings.filter), settings.filter_radius));
    row("objects", format!("{} over {} triangles", scene.objects().len(), scene.triangle_count()));
    row("background", background_name(&settings.background).into());

    let names = |what: fn(&MaterialPlan) -> bool| {
        let all: Vec<_> = plan
            .materials
            .iter()
            .enumerate()
            .filter(|(_, m)| m.used && what(m))
            .map(|(index, _)| scene.materials()[index].name.as_str())
            .collect();
        shorten(&all)
    };
    row(
        "reflection rays",
        match plan.reflection_depth {
            0 if settings.reflection_depth == 0 => "none: reflection_depth is 0".into(),
            0 => "none: nothing mirrors".into(),
            depth => format!("to depth {depth}: {}", names(|m| m.reflects)),
        },
    );
    row(
        "refraction rays",
        match plan.refraction_depth {
            0 if settings.refraction_depth == 0 => "none: refraction_depth is 0".into(),
            0 => "none: nothing is transparent".into(),
            depth => format!("to depth {depth}: {}", names(|m| m.refracts || m.see_through)),
        },
    );
    if plan.refraction_depth > 0 && plan.materials.iter().any(|material| material.used && material.refracts) {
        row("media", explain_media(plan, scene));
    }
    row(
        "shadow rays",
        if plan.shadow_rays {
            let lights: Vec<_> =
                scene.lights().iter().filter(|light| light.shadows).map(|light| light.name.as_str()).collect();
            format!("to {}; asked for by {}", shorten(&lights), names(|m| m.lights))
        } else if scene.lights().is_empty() {
            "none: there are no lights".into()
        } else if !scene.lights().iter().any(|light| light.shadows) {
            "none: no light casts shadows".into()
        } else {
            "none: nothing reads light and nothing is lit".into()
        },
    );
    row("lines", explain_lines(plan, scene));
    if plan.lines.is_some() {
        let changed = LineType::ALL.into_iter().filter_map(|kind| {
            let style = scene.lines().types[kind as usize];
            let parts = [
                style.width.map(|width| format!("{width} px")),
                style.opacity.map(|opacity| format!("opacity {opacity}")),
                style.color.map(|_| "a colour of its own".to_owned()),
            ];
            let parts: Vec<_> = parts.into_iter().flatten().collect();
            (!parts.is_empty()).then(|| format!("{}: {}", kind.name(), parts.join(", ")))
        });
        let changed: Vec<_> = changed.collect();
        if !changed.is_empty() {
            row("line types", changed.join("; "));
        }
    }
    if plan.lines.as_ref().is_some_and(|lines| lines.scripted) {
        let draws = drawing_materials(scene);
        let scripted = shaders.iter().zip(draws).filter(|(_, draws)| *draws).filter_map(|(shader, _)| {
            let mode = shader.line_mode()?;
            let reads = flag_names(shader.pair_needs().iter_names().map(|(name, _)| name));
            let reads = if reads.is_empty() { "nothing".to_owned() } else { reads };
            Some(format!("those of {} ({}) read {reads}", shader.name(), mode.name()))
        });
        row("line scripts", scripted.collect::<Vec<_>>().join("; "));
    }
    if plan.lines.is_some() && !scene.stand_ins().is_empty() {
        row("groups", explain_groups(scene));
    }
    row("strata", "1: no lens, no shutter, no rough mirror".into());
    row("surfaces", explain_surfaces(plan, scene.lines()));
    row("columns", columns(plan).join(" "));
    row("layers", plan.layers.iter().map(ToString::to_string).collect::<Vec<_>>().join(" "));
    for (index, material) in plan.materials.iter().enumerate().filter(|(_, m)| m.used) {
        let shader = shaders.of(MaterialId::from_index(index));
        let reads = if shader.analysis().complete {
            flag_names(material.inputs.iter_names().map(|(name, _)| name))
        } else {
            "anything".into()
        };
        row(
            "material",
            format!(
                "{} ({}): {}; reads {}; evaluates {}",
                scene.materials()[index].name,
                short_script_name(&scene.scripts()[scene.materials()[index].script.index()].source.name),
                material.mode.name(),
                if reads.is_empty() { "nothing".into() } else { reads },
                match flag_names(material.wanted.iter_names().map(|(name, _)| name)) {
                    none if none.is_empty() => "nothing".into(),
                    some => some,
                },
            ),
        );
    }
    text
}

/// What rays can be inside of.
fn explain_media(plan: &Plan, scene: &Scene) -> String {
    let (mut bodies, mut sheets) = (Vec::new(), Vec::new());
    for (index, object) in scene.objects().iter().enumerate().filter(|(_, object)| refracts(object, &plan.materials)) {
        if !plan.bodies.get(index).is_some_and(|body| *body) {
            sheets.push(object.name.as_str());
            continue;
        }
        let priority = object.materials.iter().map(|id| scene.materials()[id.index()].dielectric_priority).max();
        bodies.push(match priority {
            None | Some(0) => object.name.clone(),
            Some(priority) => format!("{} (dielectric priority {priority})", object.name),
        });
    }
    let bodies: Vec<_> = bodies.iter().map(String::as_str).collect();
    let mut parts = vec![if bodies.is_empty() { "no bodies".into() } else { shorten(&bodies) }];
    if !sheets.is_empty() {
        parts.push(format!("not closed or not seen by all rays, so nothing is inside of them: {}", shorten(&sheets)));
    }
    parts.join("; ")
}

fn tests_of(settings: &LineSettings) -> Vec<String> {
    let mut tests = Vec::new();
    tests.extend(settings.object.then(|| "object".to_owned()));
    tests.extend(settings.shader.then(|| "shader".to_owned()));
    tests.extend(settings.uv.map(|t| format!("uv > {t}")));
    tests.extend(settings.normal.map(|t| format!("normal > {t} degrees")));
    tests.extend(settings.feature.map(|t| format!("feature > {t}")));
    tests.extend(settings.overlap.map(|t| format!("overlap > {t}")));
    tests
}

/// Which objects count as one.
fn explain_groups(scene: &Scene) -> String {
    let mut groups: Vec<(&str, usize)> = Vec::new();
    for group in scene.objects().iter().filter_map(|object| object.group.as_deref()) {
        match groups.iter_mut().find(|(known, _)| *known == group) {
            Some((_, count)) => *count += 1,
            None => groups.push((group, 1)),
        }
    }
    let groups: Vec<_> = groups.iter().map(|(group, count)| format!("{group} ({count} objects)")).collect();
    let groups: Vec<_> = groups.iter().map(String::as_str).collect();
    format!("count as one in the object test: {}", shorten(&groups))
}

fn explain_lines(plan: &Plan, scene: &Scene) -> String {
    let settings = scene.lines();
    let Some(lines) = &plan.lines else {
        return if settings.enabled { "none: no line can be seen" } else { "none: switched off" }.into();
    };
    let mut tests = vec![match &tests_of(settings)[..] {
        [] => "nothing".to_owned(),
        tests => tests.join(", "),
    }];
    for (material, draws) in scene.materials().iter().zip(drawing_materials(scene)) {
        let own = material.lines.over(settings);
        if draws && own != *settings {
            let own = tests_of(&own);
            let own = if own.is_empty() { "nothing".to_owned() } else { own.join(", ") };
            tests.push(format!("for lines of {}: {own}", material.name));
        }
    }
    let mut paths = vec!["camera"];
    paths.retain(|_| settings.paths.contains(RayKinds::CAMERA));
    if plan.reflection_depth > 0 && settings.paths.contains(RayKinds::REFLECTION) {
        paths.push("reflection");
    }
    if plan.refraction_depth > 0 && settings.paths.contains(RayKinds::REFRACTION) {
        paths.push("refraction");
    }
    format!(
        "where {} differ; seen by {}; at most {} px wide, so tiles need {} px around them",
        tests.join("; "),
        paths.join(", "),
        // The bounds of scripts are rounded outwards; nobody needs to read that.
        (lines.widest * 1e3).round() / 1e3,
        lines.reach
    )
}

fn explain_surfaces(plan: &Plan, settings: &LineSettings) -> String {
    let Some(lines) = plan.lines.as_ref().filter(|_| plan.surfaces > 1) else {
        let why = if settings.surfaces > 1 { "no line can be seen" } else { "`lines.surfaces` asks for no more" };
        return format!("1: {why}");
    };
    let counted = match (lines.tests.tests_shapes(), lines.tests.object, lines.tests.shader) {
        (true, ..) => "each time a ray meets one",
        (false, true, true) => "each object and material once",
        (false, true, false) => "each object once",
        (false, false, _) => "each material once",
    };
    let hidden = match &settings.hidden {
        None => String::new(),
        Some(hidden) => {
            let of = match &hidden.objects {
                None => "all objects".to_owned(),
                Some(objects) if objects.len() == 1 => "1 object".to_owned(),
                Some(objects) => format!("{} objects", objects.len()),
            };
            format!("; hidden lines of {of}, {} px wide", hidden.width)
        }
    };
    format!("up to {}, as `lines.surfaces` asks: {counted}{hidden}", plan.surfaces)
}

fn columns(plan: &Plan) -> Vec<&'static str> {
    let set = plan.layout.columns;
    [
        (true, "color"),
        (true, "object"),
        (true, "shader"),
        (set.uv, "uv"),
        (set.normal, "normal"),
        (set.feature, "feature"),
        (set.depth, "depth"),
        (set.lines, "line_color line_width priority"),
        (set.member, "member"),
        (set.overlap, "node_position geometric_normal footprint"),
        (set.throughput, "throughput"),
        (set.contribution, "contribution"),
        (plan.layout.position, "position"),
        (plan.layout.aovs > 0, "aovs"),
    ]
    .into_iter()
    .filter_map(|(kept, name)| kept.then_some(name))
    .collect()
}

fn flag_names<'a>(names: impl Iterator<Item = &'a str>) -> String {
    names.map(str::to_lowercase).collect::<Vec<_>>().join(" ")
}

/// Up to four names, and how many more there are.
fn shorten(names: &[&str]) -> String {
    match names {
        few if few.len() <= 4 => few.join(", "),
        many => format!("{} and {} more", many[..3].join(", "), many.len() - 3),
    }
}

/// The last part of a script's path: the same text wherever the scene lies.
fn short_script_name(name: &str) -> &str {
    name.rsplit(['/', '\\']).next().unwrap_or(name)
}

/// How many samples, and how they are spread if not as they are by default.
fn samples_name(settings: &RenderSettings) -> String {
    match settings.sampler {
        Sampler::Stratified => settings.samples.to_string(),
        other => format!("{} {}", settings.samples, other.name()),
    }
}

pub(crate) fn filter_name(kind: FilterKind) -> &'static str {
    match kind {
        FilterKind::Box => "box",
        FilterKind::Tent => "tent",
        FilterKind::Gaussian => "gaussian",
        FilterKind::Mitchell => "mitchell",
        FilterKind::BlackmanHarris => "blackman-harris",
    }
}

fn background_name(background: &Background) -> &'static str {
    match background {
        Background::Transparent => "transparent",
        Background::Color(_) => "one colour",
        Background::Gradient { .. } => "gradient",
        Background::Image { .. } => "image",
    }
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.explanation)
    }
}
