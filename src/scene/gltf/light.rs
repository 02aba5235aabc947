//! Lights of a model (`KHR_lights_punctual`).

use gltf::json;
use gltf::json::extensions::scene::khr_lights_punctual::Type;
use gltf::json::validation::Checked;

use super::report::Report;
use crate::math::{DAffine3, DVec3, Vec3, portable};
use crate::scene::light::{Light, LightKind};

/// The light of a node, if it has one.
///
/// Lux and candela are taken as irradiance and radiant intensity one to one, as other viewers do. Ranges, which are
/// hints for fast engines, are not read. `None` also after a fault.
pub(super) fn of_node(
    root: &json::Root,
    node: usize,
    name: String,
    world_from_node: &DAffine3,
    report: &mut Report,
) -> Option<Light> {
    let index = root.nodes[node].extensions.as_ref()?.khr_lights_punctual.as_ref()?.light.value();
    let json = root.extensions.as_ref()?.khr_lights_punctual.as_ref()?.lights.get(index)?;
    let place = format!("extensions.KHR_lights_punctual.lights[{index}]");
    let strength = Vec3::from(json.color) * json.intensity;
    if !(strength.is_finite() && strength.min_element() >= 0.0) {
        return report.fail(place, "colour and intensity must be finite and not negative");
    }
    let position = world_from_node.translation;
    let backward = direction(world_from_node.matrix3.z_axis);
    let Some(backward) = backward.filter(|_| position.is_finite()) else {
        report.warning(format!("nodes[{node}]"), "its light has no direction (a scale of 0) and does not shine");
        return None;
    };
    let kind = match (json.type_, &json.spot) {
        (Checked::Valid(Type::Directional), _) => LightKind::Sun { direction: backward, irradiance: strength },
        (Checked::Valid(Type::Point), _) => LightKind::Point { position, intensity: strength },
        (Checked::Valid(Type::Spot), Some(spot)) => {
            let (inner, outer) = (spot.inner_cone_angle, spot.outer_cone_angle);
            // Written so that NaN fails.
            if !(0.0 <= inner && inner <= outer && outer <= std::f32::consts::FRAC_PI_2) {
                return report.fail(place, "cone angles must be 0 ≤ inner ≤ outer ≤ π / 2");
            }
            LightKind::Spot {
                position,
                direction: -backward,
                intensity: strength,
                inner_cos: portable::cos(inner),
                outer_cos: portable::cos(outer),
            }
        }
        _ => return report.fail(place, "its type does not fit its properties"),
    };
    Some(Light { name, kind, shadows: true })
}

fn direction(axis: DVec3) -> Option<Vec3> {
    // Normalized again in single precision, so that its length is 1 to the last bits there too.
    Some(axis.try_normalize()?.as_vec3().normalize())
}
