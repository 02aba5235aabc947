//! Framing.
#![allow(missing_docs)]
use super::SceneBuilder;
use super::camera::{Camera, Projection};
use super::light::{Light, LightKind};
use crate::math::{DMat3, DVec3, Vec3};

pub fn bounds(scene: &SceneBuilder) -> Option<(DVec3, DVec3)> {
    let _ = scene;
    None
}
pub fn frame_camera(bounds: Option<(DVec3, DVec3)>, size: [u32; 2]) -> Camera {
    let _ = (bounds, size);
    Camera {
        name: "framed".into(),
        projection: Projection::Perspective { fov_y: 0.7 },
        position: DVec3::Z * 5.0,
        world_from_camera: DMat3::IDENTITY,
    }
}
pub fn default_lights(camera: &Camera, bounds: Option<(DVec3, DVec3)>) -> Vec<Light> {
    let _ = (camera, bounds);
    vec![Light {
        name: "key".into(),
        kind: LightKind::Sun { direction: Vec3::Y, irradiance: Vec3::ONE },
        shadows: true,
    }]
}
