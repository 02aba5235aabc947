//! What must hold between the parts of a scene, whoever built it.

use super::SceneBuilder;
use super::ids::ObjectId;
use super::light::LightKind;
use super::mesh::Mesh;
use crate::diag::{Diagnostic, Diagnostics, Span};

/// The largest width or height of a picture: EXR and PNG readers stop near here.
pub(super) const MAX_SIZE: u32 = 1 << 20;
/// The most pixels of a picture: 65536 × 65536. Beyond, even writing an unfinished file takes hours.
pub(super) const MAX_PIXELS: u64 = 1 << 32;
/// The most samples a pixel can have.
pub(super) const MAX_SAMPLES: u32 = 1 << 14;
/// The most times as many samples that pixels get where lines are.
pub(super) const MAX_LINE_OVERSAMPLING: u32 = 256;
/// The widest line, in pixels.
pub(super) const MAX_LINE_WIDTH: f32 = 1024.0;
/// The longest surface list.
pub(super) const MAX_SURFACES: u32 = 16;

pub(super) fn check(scene: &SceneBuilder, faults: &mut Diagnostics) {
    check_settings(scene, faults);
    for mesh in &scene.meshes {
        check_mesh(mesh, faults);
    }
    for material in &scene.materials {
        if material.script.index() >= scene.scripts.len() {
            faults.push(placed(
                format!("material `{}` has no script {}", material.name, material.script),
                material.span.as_ref(),
            ));
        }
    }
    for object in &scene.objects {
        let mut fault = |message: String| faults.push(placed(message, object.span.as_ref()));
        let name = &object.name;
        match scene.meshes.get(object.mesh.index()) {
            None => fault(format!("object `{name}` has no {}", object.mesh)),
            Some(mesh) if object.materials.len() < mesh.slot_count() => fault(format!(
                "object `{name}` has {} materials, but its mesh has {} slots",
                object.materials.len(),
                mesh.slot_count()
            )),
            Some(_) => {}
        }
        if let Some(id) = object.materials.iter().find(|id| id.index() >= scene.materials.len()) {
            fault(format!("object `{name}` has no {id}"));
        }
        if !object.world_from_object.is_finite() {
            fault(format!("the transform of object `{name}` is not finite"));
        }
    }
    for light in &scene.lights {
        let finite = match &light.kind {
            LightKind::Sun { direction, irradiance } => direction.is_normalized() && irradiance.is_finite(),
            LightKind::Point { position, intensity } => position.is_finite() && intensity.is_finite(),
            LightKind::Spot { position, direction, intensity, inner_cos, outer_cos } => {
                position.is_finite() && direction.is_normalized() && intensity.is_finite() && outer_cos <= inner_cos
            }
        };
        if !finite {
            faults.push(Diagnostic::error(format!(
                "light `{}` must have finite values and a direction of unit length",
                light.name
            )));
        }
    }
}

fn check_settings(scene: &SceneBuilder, faults: &mut Diagnostics) {
    let render = &scene.render;
    let mut require = |holds: bool, message: String| {
        if !holds {
            faults.push(Diagnostic::error(message));
        }
    };
    require(
        render.size.iter().all(|n| (1..=MAX_SIZE).contains(n)),
        format!("picture size must be 1 to {MAX_SIZE} pixels each way"),
    );
    require(
        render.size.iter().map(|n| u64::from(*n)).product::<u64>() <= MAX_PIXELS,
        format!("a picture can have at most {MAX_PIXELS} pixels"),
    );
    require((1..=MAX_SAMPLES).contains(&render.samples), format!("samples must be 1 to {MAX_SAMPLES}"));
    require(
        (1..=MAX_LINE_OVERSAMPLING).contains(&render.line_oversampling),
        format!("line oversampling must be 1 to {MAX_LINE_OVERSAMPLING}"),
    );
    require(
        render.samples.saturating_mul(render.line_oversampling) <= MAX_SAMPLES,
        format!("samples times line oversampling must be at most {MAX_SAMPLES}"),
    );
    require(
        render.filter_radius > 0.0 && render.filter_radius <= 64.0,
        "filter radius must be above 0 and at most 64 pixels".into(),
    );
    require(
        render.reflection_depth + render.refraction_depth <= 30,
        "reflection and refraction depth may add up to at most 30".into(),
    );
    let lines = &scene.lines;
    for (name, width) in [("width", lines.width), ("max_width", lines.max_width), ("min_width", lines.min_width)] {
        require((0.0..=MAX_LINE_WIDTH).contains(&width), format!("line {name} must be 0 to {MAX_LINE_WIDTH} pixels"));
    }
    require(lines.color.is_finite(), "the line colour must be finite".into());
    require((1..=MAX_SURFACES).contains(&lines.surfaces), format!("surfaces must be 1 to {MAX_SURFACES}"));
    if let Some(hidden) = &lines.hidden {
        require(
            (0.0..=MAX_LINE_WIDTH).contains(&hidden.width),
            format!("the width of hidden lines must be 0 to {MAX_LINE_WIDTH} pixels"),
        );
        require(hidden.color.is_finite(), "the colour of hidden lines must be finite".into());
        require(lines.surfaces > 1, "hidden lines need 2 surfaces or more".into());
        let missing = |id: &&ObjectId| id.index() >= scene.objects.len();
        if let Some(id) = hidden.objects.iter().flatten().find(missing) {
            require(false, format!("hidden lines are asked of {id}, which is not there"));
        }
    }
    let overridden = scene.materials.iter().map(|material| {
        let settings = material.lines.over(lines);
        (format!(" of material `{}`", material.name), settings)
    });
    for (whose, lines) in std::iter::once((String::new(), lines.clone())).chain(overridden) {
        let thresholds =
            [("uv", lines.uv), ("normal", lines.normal), ("feature", lines.feature), ("overlap", lines.overlap)];
        for (name, threshold) in thresholds {
            require(
                threshold.is_none_or(|t| t.is_finite() && t >= 0.0),
                format!("the threshold of the {name} test{whose} must be a finite number, 0 or more"),
            );
        }
    }
}

fn check_mesh(mesh: &Mesh, faults: &mut Diagnostics) {
    let vertices = mesh.positions.len();
    let fits = |length: usize| length == 0 || length == vertices;
    let whole = fits(mesh.normals.len())
        && fits(mesh.tangents.len())
        && fits(mesh.colors.len())
        && mesh.uvs.iter().all(|set| set.len() == vertices)
        && [mesh.polygons.len(), mesh.slots.len()].iter().all(|n| *n == 0 || *n == mesh.triangles.len());
    if !whole {
        faults.push(Diagnostic::error(format!("mesh `{}` has attributes of the wrong length", mesh.name)));
    }
    if mesh.triangles.iter().flatten().any(|vertex| *vertex as usize >= vertices) {
        faults.push(Diagnostic::error(format!("mesh `{}` has a triangle with a vertex it lacks", mesh.name)));
    }
}

fn placed(message: String, span: Option<&Span>) -> Diagnostic {
    let fault = Diagnostic::error(message);
    match span {
        Some(span) => fault.at(span.clone()),
        None => fault,
    }
}
