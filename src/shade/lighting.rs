//! What lights and the background give: light samples at a point, and radiance from directions.

use std::sync::Arc;

use super::batch::LightSample;
use crate::math::{DVec3, Vec2, Vec3, portable};
use crate::scene::Scene;
use crate::scene::light::LightKind;
use crate::scene::settings::Background;
use crate::scene::texture::Texture;

/// The lights and the background of a scene, placed relative to the camera.
#[derive(Clone, Debug)]
pub struct Lighting {
    lights: Vec<PlacedLight>,
    background: PlacedBackground,
    /// Radiance of the uniform light all around.
    pub ambient: Vec3,
}

#[derive(Clone, Debug)]
struct PlacedLight {
    form: Form,
    strength: Vec3,
    shadows: bool,
}

#[derive(Clone, Debug)]
enum Form {
    Sun { direction: Vec3 },
    Point { position: Vec3 },
    Spot { position: Vec3, direction: Vec3, inner_cos: f32, outer_cos: f32 },
}

#[derive(Clone, Debug)]
enum PlacedBackground {
    Color(Vec3),
    Gradient { bottom: Vec3, top: Vec3 },
    Image { texture: Arc<Texture>, strength: f32 },
}

impl Lighting {
    /// The lights of a scene around the point `origin` of the world.
    #[must_use]
    pub fn new(scene: &Scene, origin: DVec3) -> Self {
        let relative = |position: &DVec3| (*position - origin).as_vec3();
        let lights = scene
            .lights()
            .iter()
            .map(|light| {
                let (form, strength) = match &light.kind {
                    LightKind::Sun { direction, irradiance } => (Form::Sun { direction: *direction }, *irradiance),
                    LightKind::Point { position, intensity } => {
                        (Form::Point { position: relative(position) }, *intensity)
                    }
                    LightKind::Spot { position, direction, intensity, inner_cos, outer_cos } => {
                        let (inner_cos, outer_cos) = (*inner_cos, *outer_cos);
                        let position = relative(position);
                        (Form::Spot { position, direction: *direction, inner_cos, outer_cos }, *intensity)
                    }
                };
                PlacedLight { form, strength, shadows: light.shadows }
            })
            .collect();
        let background = match &scene.render().background {
            Background::Transparent => PlacedBackground::Color(Vec3::ZERO),
            Background::Color(color) => PlacedBackground::Color(*color),
            Background::Gradient { bottom, top } => PlacedBackground::Gradient { bottom: *bottom, top: *top },
            Background::Image { texture, strength } => {
                PlacedBackground::Image { texture: Arc::clone(&scene.textures()[texture.index()]), strength: *strength }
            }
        };
        Self { lights, background, ambient: scene.render().ambient }
    }

    /// Number of lights.
    #[must_use]
    pub fn len(&self) -> usize {
        self.lights.len()
    }

    /// Whether there are no lights.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.lights.is_empty()
    }

    /// Whether a light is blocked by objects.
    #[must_use]
    pub fn casts_shadows(&self, light: usize) -> bool {
        self.lights[light].shadows
    }

    /// What a light gives a point (relative to the camera) if nothing is in between, and how far away it is (∞ for a
    /// sun). A point that lies in the light itself, or farther from it than can be counted, gets nothing.
    #[inline]
    #[must_use]
    pub fn sample(&self, light: usize, position: Vec3) -> (LightSample, f32) {
        let PlacedLight { form, strength, .. } = &self.lights[light];
        let from_point = |from: Vec3| {
            let distance_squared = (from - position).length_squared();
            let distance = distance_squared.sqrt();
            let direction = (from - position) / distance;
            // Nearer than this the square of the distance has no single-precision value.
            distance_squared.is_normal().then_some((direction, distance, *strength / distance_squared))
        };
        let found = match form {
            Form::Sun { direction } => Some((*direction, f32::INFINITY, *strength)),
            Form::Point { position } => from_point(*position),
            Form::Spot { position, direction, inner_cos, outer_cos } => {
                from_point(*position).map(|(towards, distance, radiance)| {
                    let cos = -towards.dot(*direction);
                    // The falloff of KHR_lights_punctual.
                    let share = ((cos - outer_cos) / (inner_cos - outer_cos).max(1e-4)).clamp(0.0, 1.0);
                    (towards, distance, radiance * (share * share))
                })
            }
        };
        match found {
            Some((direction, distance, radiance)) => (LightSample { direction, radiance, visibility: 1.0 }, distance),
            None => (LightSample { direction: Vec3::Z, radiance: Vec3::ZERO, visibility: 0.0 }, 0.0),
        }
    }

    /// Radiance of the background where that is the same in all directions.
    #[must_use]
    pub fn even_background(&self) -> Option<Vec3> {
        match &self.background {
            PlacedBackground::Color(color) => Some(*color),
            PlacedBackground::Gradient { .. } | PlacedBackground::Image { .. } => None,
        }
    }

    /// Radiance of the background along a unit direction.
    #[must_use]
    pub fn background(&self, direction: Vec3) -> Vec3 {
        match &self.background {
            PlacedBackground::Color(color) => *color,
            PlacedBackground::Gradient { bottom, top } => bottom.lerp(*top, (direction.y * 0.5 + 0.5).clamp(0.0, 1.0)),
            PlacedBackground::Image { texture, strength } => {
                let turn = std::f32::consts::TAU;
                let u = portable::atan2(direction.x, -direction.z) / turn + 0.5;
                let v = portable::acos(direction.y.clamp(-1.0, 1.0)) / (turn * 0.5);
                texture.sample(Vec2::new(u, v)).truncate() * *strength
            }
        }
    }
}
