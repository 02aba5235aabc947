//! How a surface scatters light: a diffuse and a specular lobe evaluated for lights, and ideal mirror and refraction
//! directions for rays.
//!
//! The parameters mean what they mean in glTF 2.0. Two simplifications hold until rough effects are built: a surface
//! whose roughness is at most [`MIRROR_ROUGHNESS`] mirrors like a perfect mirror and a rougher one sees only lights
//! and a blurred guess of the background; and refraction is always sharp, whatever the roughness.

mod lanes;

pub use lanes::{BsdfLanes, LANES, LightLanes};

use std::f32::consts::PI;

use crate::math::{Vec3, portable};

/// Up to this roughness a surface mirrors its surroundings, and rays are traced for it.
pub const MIRROR_ROUGHNESS: f32 = 0.05;

/// The outputs of a script that describe scattering, at one hit. Units and defaults: [`super::OutputSet`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs, reason = "documented under their names at OutputSet")]
pub struct Bsdf {
    pub base_color: Vec3,
    pub metallic: f32,
    pub roughness: f32,
    pub specular: f32,
    pub ior: f32,
    pub transmission: f32,
    /// Unit shading normal on the viewer's side.
    pub normal: Vec3,
    pub occlusion: f32,
    /// Whether the ray comes from outside the body.
    pub outside: bool,
    /// Index of refraction of what surrounds the body there; 1 in air.
    pub surrounding: f32,
}

/// Where ideal reflection and refraction go on, and how much of them the viewer sees.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bounces {
    /// Weight of the mirrored ray; 0 if there is none.
    pub reflection: Vec3,
    /// Weight of the refracted ray; 0 if there is none.
    pub refraction: Vec3,
    /// Unit direction of the refracted ray.
    pub refracted: Vec3,
}

/// A share from a script, brought into 0 … 1; NaN becomes the default.
#[inline]
#[must_use]
pub fn unit(share: f32, default: f32) -> f32 {
    if share.is_nan() { default } else { share.clamp(0.0, 1.0) }
}

impl Bsdf {
    /// The same with every parameter in its range; NaN becomes the default.
    #[inline]
    #[must_use]
    pub fn checked(mut self) -> Self {
        self.metallic = unit(self.metallic, 0.0);
        self.roughness = unit(self.roughness, 1.0);
        self.specular = unit(self.specular, 1.0);
        self.transmission = unit(self.transmission, 0.0);
        self.occlusion = unit(self.occlusion, 1.0);
        self.ior = if self.ior.is_finite() && self.ior > 0.0 { self.ior } else { 1.5 };
        self
    }

    pub(crate) fn is_mirror(&self) -> bool {
        self.roughness <= MIRROR_ROUGHNESS
    }

    /// Reflectance at normal incidence of the dielectric part, `specular` included.
    fn dielectric_f0(&self) -> f32 {
        let relative = self.ior / self.surrounding;
        let r = (relative - 1.0) / (relative + 1.0);
        r * r * self.specular
    }

    /// The index of refraction on the viewer's side over the one behind.
    pub fn eta(&self) -> f32 {
        if self.outside { self.surrounding / self.ior } else { self.ior / self.surrounding }
    }

    fn diffuse_color(&self) -> Vec3 {
        self.base_color * ((1.0 - self.metallic) * (1.0 - self.transmission))
    }

    /// Radiance towards `view` (unit, away from the surface) from light that arrives from `light` (unit, towards the
    /// light) with `irradiance` on a surface that faces it.
    #[must_use]
    pub fn scatter(&self, view: Vec3, light: Vec3, irradiance: Vec3) -> Vec3 {
        let cos_light = self.normal.dot(light);
        if cos_light <= 0.0 {
            return Vec3::ZERO;
        }
        let half = (view + light).normalize_or_zero();
        let fresnel = schlick(half.dot(view));
        let dielectric = self.dielectric_f0() + (self.specular - self.dielectric_f0()) * fresnel;
        let diffuse = self.diffuse_color() * ((1.0 - dielectric) / PI);
        let specular = if self.is_mirror() {
            Vec3::ZERO
        } else {
            let metal = self.base_color + (Vec3::ONE - self.base_color) * fresnel;
            let reflectance = Vec3::splat(dielectric).lerp(metal, self.metallic);
            reflectance * self.ggx(view, light, half)
        };
        (diffuse + specular) * irradiance * cos_light
    }

    /// GGX distribution times height-correlated masking over 4 cosines (Heitz 2014).
    fn ggx(&self, view: Vec3, light: Vec3, half: Vec3) -> f32 {
        let alpha = self.roughness * self.roughness;
        let alpha2 = alpha * alpha;
        let cos_view = self.normal.dot(view).max(1e-4);
        let cos_light = self.normal.dot(light);
        let cos_half = self.normal.dot(half).clamp(0.0, 1.0);
        let d = cos_half * cos_half * (alpha2 - 1.0) + 1.0;
        let distribution = alpha2 / (PI * d * d);
        let shadowing = cos_light * (cos_view * cos_view * (1.0 - alpha2) + alpha2).sqrt();
        let masking = cos_view * (cos_light * cos_light * (1.0 - alpha2) + alpha2).sqrt();
        distribution * 0.5 / (shadowing + masking)
    }

    /// Radiance towards `view` from light all around: `ambient` for what is scattered, `mirrored` (the background seen
    /// in the mirror direction) for what is reflected; it is asked for only if it matters.
    ///
    /// The reflected part is Karis' fit of the split sum ("Physically Based Shading on Mobile", 2014). Only what is not
    /// reflected is scattered, so that nothing outshines surroundings of one colour.
    #[must_use]
    pub fn surroundings(&self, view: Vec3, ambient: Vec3, mirrored: impl FnOnce() -> Vec3) -> Vec3 {
        let cos_view = self.normal.dot(view).clamp(0.0, 1.0);
        let (reflected, specular) = if self.is_mirror() {
            let (fresnel, _) = fresnel_dielectric(cos_view, self.eta());
            (fresnel * self.specular, Vec3::ZERO)
        } else {
            let r = self.roughness;
            let (x, y) = (1.0 - r, 0.0425 - 0.0275 * r);
            let a = (x * x).min(portable::exp2(-9.28 * cos_view)) * x + y;
            let scale = -1.04 * a + 1.04 - 0.572 * r;
            let bias = 1.04 * a - 0.04 + 0.022 * r;
            let bias = bias.max(0.0);
            let dielectric = self.dielectric_f0() * scale + bias * self.specular;
            let metal = self.base_color * scale + Vec3::splat(bias);
            let reflectance = Vec3::splat(dielectric).lerp(metal, self.metallic);
            let around = if r < 1.0 { mirrored().lerp(ambient, r) } else { ambient };
            (dielectric, reflectance * around)
        };
        let diffuse = self.diffuse_color() * ambient * (1.0 - reflected.clamp(0.0, 1.0));
        (diffuse + specular) * self.occlusion
    }

    /// The mirror direction of `incoming` (unit, towards the surface). Where the shading normal would send it under
    /// the surface, the geometric normal is used instead.
    #[must_use]
    pub fn mirror_direction(&self, incoming: Vec3, geometric_normal: Vec3) -> Vec3 {
        let about = |normal: Vec3| (incoming - normal * (2.0 * incoming.dot(normal))).normalize();
        let direction = about(self.normal);
        if direction.dot(geometric_normal) > 0.0 { direction } else { about(geometric_normal) }
    }

    /// Ideal reflection and refraction of `incoming` (unit, towards the surface). The weights never add up to more than
    /// 1, whatever colours a script gives: a tree of rays that gained light on its way might have no end.
    #[must_use]
    pub fn bounces(&self, incoming: Vec3, geometric_normal: Vec3) -> Bounces {
        let cos_view = (-self.normal.dot(incoming)).clamp(0.0, 1.0);
        let eta = self.eta();
        let base_color = self.base_color.clamp(Vec3::ZERO, Vec3::ONE);
        let (fresnel, cos_inside) = fresnel_dielectric(cos_view, eta);
        let mut bounces = Bounces::default();

        let dielectric = 1.0 - self.metallic;
        let total_reflection = cos_inside.is_none();
        if self.is_mirror() || (total_reflection && self.transmission > 0.0) {
            let mirrored = if self.is_mirror() { self.specular } else { 0.0 };
            // `specular` weakens the reflection of a surface, but light that cannot leave a body stays in it.
            let kept = if total_reflection { (1.0 - self.specular) * self.transmission } else { 0.0 };
            bounces.reflection = Vec3::splat(dielectric * (fresnel * mirrored + kept));
            if self.is_mirror() {
                let metal = base_color + (Vec3::ONE - base_color) * schlick(cos_view);
                bounces.reflection += metal * self.metallic;
            }
        }
        if let Some(cos_inside) = cos_inside
            && self.transmission > 0.0
        {
            let direction = (incoming * eta + self.normal * (eta * cos_view - cos_inside)).normalize_or(incoming);
            // A shading normal can bend a ray so far that it would stay on its side; then it goes straight on.
            let through = direction.dot(geometric_normal) < 0.0;
            bounces.refracted = if through { direction } else { incoming };
            let passed = 1.0 - fresnel * self.specular;
            bounces.refraction = base_color * (dielectric * self.transmission * passed);
        }
        bounces
    }
}

/// Schlick's Fresnel term (1 − cos)⁵.
fn schlick(cos: f32) -> f32 {
    let x = (1.0 - cos).clamp(0.0, 1.0);
    let x2 = x * x;
    x2 * x2 * x
}

/// Fresnel reflectance of a smooth dielectric for unpolarised light, and the cosine behind the surface (`None`: total
/// internal reflection). `eta` is the index on the viewer's side over the index behind.
fn fresnel_dielectric(cos: f32, eta: f32) -> (f32, Option<f32>) {
    if eta == 1.0 {
        return (0.0, Some(cos));
    }
    let sin2 = eta * eta * (1.0 - cos * cos);
    if sin2 >= 1.0 {
        return (1.0, None);
    }
    let cos_behind = (1.0 - sin2).sqrt();
    let parallel = (cos - eta * cos_behind) / (cos + eta * cos_behind);
    let perpendicular = (eta * cos - cos_behind) / (eta * cos + cos_behind);
    (((parallel * parallel + perpendicular * perpendicular) * 0.5).clamp(0.0, 1.0), Some(cos_behind))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn glass() -> Bsdf {
        Bsdf {
            base_color: Vec3::ONE,
            metallic: 0.0,
            roughness: 0.0,
            specular: 1.0,
            ior: 1.5,
            transmission: 1.0,
            normal: Vec3::Z,
            occlusion: 1.0,
            outside: true,
            surrounding: 1.0,
        }
    }

    #[test]
    fn fresnel_at_normal_incidence_is_four_percent_for_glass() {
        let bounces = glass().bounces(Vec3::NEG_Z, Vec3::Z);
        assert!((bounces.reflection.x - 0.04).abs() < 1e-6);
        assert!((bounces.refraction.x - 0.96).abs() < 1e-6);
        assert_eq!(bounces.refracted, Vec3::NEG_Z);
    }

    #[test]
    fn refraction_obeys_snell() {
        let sin_in = 0.6_f32;
        let incoming = Vec3::new(sin_in, 0.0, -0.8);
        let bounces = glass().bounces(incoming, Vec3::Z);
        assert!((bounces.refracted.x - sin_in / 1.5).abs() < 1e-6);
        assert!((bounces.reflection.x + bounces.refraction.x - 1.0).abs() < 1e-6);
    }

    #[test]
    fn beyond_the_critical_angle_all_light_is_reflected() {
        let inside = Bsdf { outside: false, ..glass() };
        // Critical angle of 1.5: sine 2/3.
        for (sin, total) in [(0.66_f32, false), (0.67, true)] {
            let incoming = Vec3::new(sin, 0.0, -(1.0 - sin * sin).sqrt());
            let bounces = inside.bounces(incoming, Vec3::Z);
            assert_eq!(bounces.refraction == Vec3::ZERO, total, "sine {sin}");
            assert_eq!(bounces.reflection == Vec3::ONE, total, "sine {sin}");
        }
    }

    #[test]
    fn an_index_of_one_bends_and_reflects_nothing() {
        let air = Bsdf { ior: 1.0, ..glass() };
        let incoming = Vec3::new(0.6, 0.0, -0.8);
        let bounces = air.bounces(incoming, Vec3::Z);
        assert_eq!(bounces.reflection, Vec3::ZERO);
        assert!((bounces.refracted - incoming).length() < 1e-6);
    }

    #[test]
    fn a_white_lambertian_reflects_the_irradiance_over_pi() {
        let chalk = Bsdf { transmission: 0.0, roughness: 1.0, specular: 0.0, ..glass() };
        let radiance = chalk.scatter(Vec3::Z, Vec3::new(0.0, 0.6, 0.8), Vec3::splat(PI));
        assert!((radiance.x - 0.8).abs() < 1e-6);
    }

    #[test]
    fn no_angle_or_roughness_makes_more_light_than_arrives() {
        // Directional albedo by quadrature over the hemisphere, for a white metal.
        for roughness in [0.1_f32, 0.3, 0.6, 1.0] {
            for cos_view in [0.1_f32, 0.5, 0.9] {
                let metal = Bsdf { metallic: 1.0, transmission: 0.0, roughness, ..glass() };
                let view = Vec3::new((1.0 - cos_view * cos_view).sqrt(), 0.0, cos_view);
                let (steps, mut sum) = (400, 0.0);
                for i in 0..steps {
                    for j in 0..steps {
                        let cos = (i as f32 + 0.5) / steps as f32;
                        let phi = (j as f32 + 0.5) / steps as f32 * 2.0 * PI;
                        let sin = (1.0 - cos * cos).sqrt();
                        let light = Vec3::new(sin * phi.cos(), sin * phi.sin(), cos);
                        sum += metal.scatter(view, light, Vec3::ONE).x;
                    }
                }
                let albedo = sum * 2.0 * PI / (steps * steps) as f32;
                assert!(albedo < 1.02, "roughness {roughness}, cosine {cos_view}: {albedo}");
            }
        }
    }
}
