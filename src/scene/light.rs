//! Lights.

use crate::math::{DVec3, Vec3};

/// A light of the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Light {
    /// For messages and `tusche explain`.
    pub name: String,
    /// Its form, place and strength.
    pub kind: LightKind,
    /// Whether it is blocked by objects. Costs one shadow ray per lit hit.
    pub shadows: bool,
}

/// The forms of light.
#[derive(Clone, Debug, PartialEq)]
pub enum LightKind {
    /// Parallel light.
    Sun {
        /// Unit vector from the surface towards the light.
        direction: Vec3,
        /// Irradiance on a surface that faces it, linear RGB.
        irradiance: Vec3,
    },
    /// Equal light in all directions from a point.
    Point {
        /// World position.
        position: DVec3,
        /// Radiant intensity (irradiance at distance 1), linear RGB.
        intensity: Vec3,
    },
    /// A cone of light from a point.
    Spot {
        /// World position.
        position: DVec3,
        /// Unit vector along the cone's axis, away from the light.
        direction: Vec3,
        /// Radiant intensity inside the inner cone, linear RGB.
        intensity: Vec3,
        /// Cosine of the half angle inside which the light is full.
        inner_cos: f32,
        /// Cosine of the half angle outside which there is none; at most `inner_cos`.
        outer_cos: f32,
    },
}
