//! The plan in words, with reasons: what `tusche explain` prints.

use super::{MaterialPlan, Oversampling, Plan, drawing_materials, refracts};
use crate::scene::Scene;
use crate::scene::ids::MaterialId;
use crate::scene::settings::{Background, FilterKind, LineSettings, LineType, RayKinds, RenderSettings, Sampler};
use crate::shade::Shaders;

pub(super) fn explain(plan: &Plan, scene: &Scene, shaders: &Shaders) -> String {
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
    if scene.render().line_oversampling > 1 {
        row("oversampling", explain_oversampling(plan));
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

fn explain_oversampling(plan: &Plan) -> String {
    let Some(rates) = &plan.oversampling else { return "none: no line can be seen".into() };
    let side = Oversampling::BLOCK;
    let plural = if rates.pilot == 1 { "" } else { "s" };
    format!(
        "{} samples per pixel in blocks of {side} x {side} pixels in which lines are found, {} elsewhere; to find them costs {} \
         sample{plural} per pixel of line attributes alone, and around the blocks both rates are traced",
        rates.lines, rates.elsewhere, rates.pilot
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
