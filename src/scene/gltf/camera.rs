//! Cameras of a model.

use gltf::json;
use gltf::json::camera::Type;
use gltf::json::validation::Checked;

use super::report::Report;
use crate::math::{DAffine3, DMat3, DVec2};
use crate::scene::camera::{Camera, Projection};

/// The camera of a node, if it has one. Scale does not matter to cameras. The aspect ratio and the clipping planes are
/// the picture's business and are not read. `None` also after a fault.
pub(super) fn of_node(
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
        (Checked::Valid(Type::Perspective), Some(perspective), _) => {
            let fov_y = f64::from(perspective.yfov);
            if !(fov_y > 0.0 && fov_y < std::f64::consts::PI) {
                return report.fail(place, "yfov must be between 0 and π");
            }
            Projection::Perspective { fov_y }
        }
        (Checked::Valid(Type::Orthographic), _, Some(orthographic)) => {
            let height = 2.0 * f64::from(orthographic.ymag).abs();
            if !(height > 0.0 && height.is_finite()) {
                return report.fail(place, "ymag must be a finite number other than 0");
            }
            Projection::Orthographic { height }
        }
        _ => return report.fail(place, "its type does not fit its properties"),
    };
    match axes(world_from_node) {
        Some(world_from_camera) => Some(Camera {
            name,
            projection,
            position: world_from_node.translation,
            world_from_camera,
            film_shift: DVec2::ZERO,
        }),
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
