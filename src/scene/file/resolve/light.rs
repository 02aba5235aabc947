//! Lights.

use super::super::document::Node;
use super::super::format;
use super::{Resolver, rgb, vector};
use crate::diag::Diagnostic;
use crate::math::Vec3;
use crate::scene::light::{Light, LightKind};

impl Resolver<'_> {
    /// The lights of the file, then those of models.
    pub(super) fn lights(&mut self, lights: &[format::Light], of_models: Vec<Light>) {
        let nodes = self.node.get("lights").map_or(&[][..], Node::items);
        for (light, node) in lights.iter().zip(nodes) {
            if let Some(light) = self.light(light, node) {
                self.scene.lights.push(light);
            }
        }
        self.scene.lights.extend(of_models);
    }

    fn light(&mut self, light: &format::Light, node: &Node) -> Option<Light> {
        let (name, kind, shadows) = match light {
            format::Light::Sun { name, direction, color, strength, shadows } => {
                let direction = -self.direction(*direction, node)?;
                (name, LightKind::Sun { direction, irradiance: power(*color, *strength) }, shadows)
            }
            format::Light::Point { name, position, color, strength, shadows } => {
                let intensity = power(*color, *strength);
                (name, LightKind::Point { position: vector(*position), intensity }, shadows)
            }
            format::Light::Spot { name, position, direction, cone_angle, inner_angle, color, strength, shadows } => {
                let inner_angle = inner_angle.unwrap_or(0.75 * cone_angle);
                if inner_angle > *cone_angle {
                    let message = format!("`inner_angle` is {inner_angle} and `cone_angle` only {cone_angle}");
                    self.fault(message, node.span_of("inner_angle"));
                }
                let cosine_of_half = |degrees: f64| libm::cos(degrees.to_radians() / 2.0) as f32;
                let kind = LightKind::Spot {
                    position: vector(*position),
                    direction: self.direction(*direction, node)?,
                    intensity: power(*color, *strength),
                    inner_cos: cosine_of_half(inner_angle),
                    outer_cos: cosine_of_half(*cone_angle),
                };
                (name, kind, shadows)
            }
        };
        let default_name = match kind {
            LightKind::Sun { .. } => "sun",
            LightKind::Point { .. } => "point",
            LightKind::Spot { .. } => "spot",
        };
        let name = name.clone().unwrap_or_else(|| default_name.to_owned());
        Some(Light { name, kind, shadows: *shadows })
    }

    fn direction(&mut self, written: format::Vector, node: &Node) -> Option<Vec3> {
        // Normalized again in single precision, so that its length is 1 to the last bits there, too.
        let direction = vector(written).try_normalize().map(|direction| direction.as_vec3().normalize());
        if direction.is_none() {
            let fault = Diagnostic::error("the direction of a light cannot be zero").at(node.span_of("direction"));
            self.faults.push(fault.hint("[0, -1, 0] shines straight down"));
        }
        direction
    }
}

fn power(color: format::Color, strength: f64) -> Vec3 {
    rgb(color) * strength as f32
}
