//! What a bare model needs to be seen: a camera that frames it, and lights.
//!
//! Everything here is computed from the scene's bounding box alone, so the same model gives the same picture whatever
//! its units are.

use rayon::prelude::*;

use super::SceneBuilder;
use super::camera::{Camera, Projection};
use super::light::{Light, LightKind};
use crate::math::{DMat3, DVec2, DVec3, Vec3};

/// Vertical field of view of the framing camera, in degrees: long enough not to distort, short enough to show depth.
pub const FIELD_OF_VIEW_DEGREES: f64 = 30.0;
/// How much of the picture the bounding box fills in the direction where it fills more.
pub const FILL: f64 = 0.9;
/// How far the framing camera stands to the right of the model's front (+Z), in degrees.
pub const AZIMUTH_DEGREES: f64 = 35.0;
/// How far it stands above the horizon, in degrees.
pub const ELEVATION_DEGREES: f64 = 20.0;

/// The corners of the axis-aligned box around all vertices of all objects, world space. `None` without vertices.
#[must_use]
pub fn bounds(scene: &SceneBuilder) -> Option<(DVec3, DVec3)> {
    scene
        .objects
        .par_iter()
        .filter_map(|object| {
            let mesh = scene.meshes.get(object.mesh.index())?;
            mesh.positions
                .iter()
                .map(|position| object.world_from_object.transform_point3(position.as_dvec3()))
                .filter(|position| position.is_finite())
                .fold(None, |bounds, position| {
                    Some(joined(bounds.unwrap_or((position, position)), (position, position)))
                })
        })
        .reduce_with(joined)
}

fn joined(a: (DVec3, DVec3), b: (DVec3, DVec3)) -> (DVec3, DVec3) {
    (a.0.min(b.0), a.1.max(b.1))
}

/// A perspective camera named `framed` that sees the whole box from slightly above, in front and to the right.
///
/// The box's eight corners are projected: in the tighter direction they span exactly [`FILL`] of the picture and are
/// centred; in the other direction they have equal room on both sides. Without a box it looks at a unit cube.
#[must_use]
pub fn frame_camera(bounds: Option<(DVec3, DVec3)>, size: [u32; 2]) -> Camera {
    let (low, high) = grown(bounds);
    let center = (low + high) / 2.0;
    let (azimuth, elevation) = (AZIMUTH_DEGREES.to_radians(), ELEVATION_DEGREES.to_radians());
    let backward = DVec3::new(
        libm::sin(azimuth) * libm::cos(elevation),
        libm::sin(elevation),
        libm::cos(azimuth) * libm::cos(elevation),
    );
    let right = DVec3::Y.cross(backward).normalize();
    let world_from_camera = DMat3::from_cols(right, backward.cross(right), backward);

    // The view's four side planes, drawn in by `FILL`, must each have the box on their inner side. In camera axes the
    // plane to the right is x = x₀ + (z₀ − z) · tan, so the least x₀ + z₀ · tan is the greatest x + z · tan of a corner.
    let fov_y = FIELD_OF_VIEW_DEGREES.to_radians();
    let tan_y = libm::tan(fov_y / 2.0) * FILL;
    let tan_x = tan_y * f64::from(size[0].max(1)) / f64::from(size[1].max(1));
    let corners = corners(low - center, high - center).map(|corner| world_from_camera.transpose() * corner);
    let greatest = |f: &dyn Fn(DVec3) -> f64| corners.iter().map(|c| f(*c)).fold(f64::NEG_INFINITY, f64::max);
    let rightmost = greatest(&|c| c.x + c.z * tan_x);
    let leftmost = greatest(&|c| -c.x + c.z * tan_x);
    let topmost = greatest(&|c| c.y + c.z * tan_y);
    let bottommost = greatest(&|c| -c.y + c.z * tan_y);
    let distance = f64::max((rightmost + leftmost) / (2.0 * tan_x), (topmost + bottommost) / (2.0 * tan_y));
    let eye = DVec3::new((rightmost - leftmost) / 2.0, (topmost - bottommost) / 2.0, distance);
    Camera {
        name: "framed".into(),
        projection: Projection::Perspective { fov_y },
        position: center + world_from_camera * eye,
        world_from_camera,
        film_shift: DVec2::ZERO,
    }
}

/// The box, or a unit cube where there is none; a box without size (one point) grows to a unit cube around it.
fn grown(bounds: Option<(DVec3, DVec3)>) -> (DVec3, DVec3) {
    let half = DVec3::splat(0.5);
    match bounds {
        None => (-half, half),
        Some((low, high)) if low == high => (low - half, low + half),
        Some(bounds) => bounds,
    }
}

fn corners(low: DVec3, high: DVec3) -> [DVec3; 8] {
    let pick = |bit: bool, low: f64, high: f64| if bit { high } else { low };
    std::array::from_fn(|i| {
        DVec3::new(pick(i & 1 != 0, low.x, high.x), pick(i & 2 != 0, low.y, high.y), pick(i & 4 != 0, low.z, high.z))
    })
}

/// Direction (right, up, backward of the camera), strength and tint of a default light.
struct Rig {
    name: &'static str,
    towards: Vec3,
    irradiance: Vec3,
    shadows: bool,
}

/// A key light from the upper left, a cool fill from the right, and a rim light from behind.
///
/// A white diffuse surface that faces the key light reflects a little less than 1. Only the key light casts shadows:
/// the other two stand for light from all around, of which a surface inside gets its share too.
const RIGS: [Rig; 3] = [
    Rig { name: "key", towards: Vec3::new(-0.45, 0.75, 0.65), irradiance: Vec3::new(2.3, 2.25, 2.15), shadows: true },
    Rig { name: "fill", towards: Vec3::new(0.85, 0.15, 0.6), irradiance: Vec3::new(0.7, 0.76, 0.85), shadows: false },
    Rig { name: "rim", towards: Vec3::new(0.3, 0.6, -0.9), irradiance: Vec3::new(0.8, 0.8, 0.8), shadows: false },
];

/// Lights for a model that brings none: three suns whose directions follow the camera.
///
/// `bounds` is not needed by suns, which light a model of any size alike; it is a parameter so that callers need not
/// change when lights near the model replace them.
#[must_use]
pub fn default_lights(camera: &Camera, bounds: Option<(DVec3, DVec3)>) -> Vec<Light> {
    let _ = bounds;
    RIGS.iter()
        .map(|rig| Light {
            name: rig.name.into(),
            kind: LightKind::Sun {
                direction: (camera.world_from_camera * rig.towards.as_dvec3()).normalize().as_vec3().normalize(),
                irradiance: rig.irradiance,
            },
            shadows: rig.shadows,
        })
        .collect()
}
