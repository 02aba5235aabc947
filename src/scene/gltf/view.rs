//! Cameras and lights of a model.

use gltf::json;
use gltf::json::camera::Type as CameraType;
use gltf::json::extensions::scene::khr_lights_punctual::Type as LightType;
use gltf::json::validation::Checked;

use super::report::Report;
use crate::math::{DAffine3, DMat3, DVec3, Vec3};
use crate::scene::camera::{Camera, Projection};
use crate::scene::light::{Light, LightKind};

/// The camera of a node, if it has one. Scale does not matter to cameras. The aspect ratio and the clipping planes are
/// the picture's business and are not read. `None` also after a fault.
pub(super) fn camera(
    root: &json::Root,
    node: usize,
    name: String,
    world_from_node: &DAffine3,
    report: &mut Report,
) -> Option<Camera> {
    let index = root.nodes[node].camera?.value();
    let json = root.cameras.get(index)?;
    let place = format!("cameras[{index}]");
    let projection = match (json.type_, &json.perspective, &json.orthographic) {
        (Checked::Valid(CameraType::Perspective), Some(perspective), _) => {
            let fov_y = f64::from(perspective.yfov);
            if !(fov_y > 0.0 && fov_y < std::f64::consts::PI) {
                return report.fail(place, "yfov must be between 0 and π");
            }
            Projection::Perspective { fov_y }
        }
        (Checked::Valid(CameraType::Orthographic), _, Some(orthographic)) => {
            let height = 2.0 * f64::from(orthographic.ymag).abs();
            if !(height > 0.0 && height.is_finite()) {
                return report.fail(place, "ymag must be a finite number other than 0");
            }
            Projection::Orthographic { height }
        }
        _ => return report.fail(place, "its type does not fit its properties"),
    };
    match axes(world_from_node) {
        Some(world_from_camera) => {
            Some(Camera { name, projection, position: world_from_node.translation, world_from_camera })
        }
        None => {
            report.warning(format!("nodes[{node}]"), "its camera has no direction (a scale of 0) and cannot be used");
            None
        }
    }
}

/// Right, up and backward of a node that looks along its −z, made orthonormal.
fn axes(world_from_node: &DAffine3) -> Option<DMat3> {
    if !world_from_node.is_finite() {
        return None;
    }
    let backward = world_from_node.matrix3.z_axis.try_normalize()?;
    let right = world_from_node.matrix3.y_axis.try_normalize()?.cross(backward).try_normalize()?;
    Some(DMat3::from_cols(right, backward.cross(right), backward))
}

/// The light of a node, if it has one (`KHR_lights_punctual`).
///
/// Lux and candela are taken as irradiance and radiant intensity one to one, as other viewers do. Ranges, which are
/// hints for fast engines, are not read. `None` also after a fault.
pub(super) fn light(
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
        (Checked::Valid(LightType::Directional), _) => LightKind::Sun { direction: backward, irradiance: strength },
        (Checked::Valid(LightType::Point), _) => LightKind::Point { position, intensity: strength },
        (Checked::Valid(LightType::Spot), Some(spot)) => {
            let (inner, outer) = (spot.inner_cone_angle, spot.outer_cone_angle);
            // Written so that NaN fails.
            if !(0.0 <= inner && inner <= outer && outer <= std::f32::consts::FRAC_PI_2) {
                return report.fail(place, "cone angles must be 0 ≤ inner ≤ outer ≤ π / 2");
            }
            let cos = |angle: f32| libm::cosf(angle);
            LightKind::Spot {
                position,
                direction: -backward,
                intensity: strength,
                inner_cos: cos(inner),
                outer_cos: cos(outer),
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
