//! Ray cones: how wide a pixel is where its ray arrives.
//!
//! A cone has a width and a spread, the change of the width per unit of distance. Flat surfaces change neither when they
//! mirror; curved ones and boundaries of glass do (Akenine-Möller et al. 2021, "Improved Shader and Texture Level of
//! Detail Using Ray Cones"). The two widths of the beam, in the plane of incidence and across it, obey Coddington's
//! equations with different powers; here their geometric mean is followed, so that width² is the area of the beam:
//! for a mirror the powers 2 κ / cos θ and 2 κ cos θ give 2 κ. Behind a focus the width is negative.

/// A pixel's cone at some place on its ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cone {
    /// World units; negative behind a focus.
    pub width: f32,
    /// Change of the width per world unit.
    pub spread: f32,
}

impl Cone {
    /// The cone further along the ray.
    pub fn after(self, distance: f32) -> Self {
        Self { width: self.width + self.spread * distance, ..self }
    }

    /// How wide the pixel is, above 0.
    pub fn footprint(self) -> f32 {
        self.width.abs().max(f32::MIN_POSITIVE)
    }

    /// Mirrored by a surface with a mean curvature of `curvature`, positive where it bulges towards the ray.
    pub fn reflected(self, curvature: f32) -> Self {
        self.checked(self.width, self.spread + 2.0 * curvature * self.width)
    }

    /// Refracted by such a surface. `eta` is the index on the ray's side over the index behind, `cos` the cosine of the
    /// angle at which the ray arrives.
    pub fn refracted(self, curvature: f32, eta: f32, cos: f32) -> Self {
        let cos = cos.clamp(0.01, 1.0);
        let cos_behind = (1.0 - eta * eta * (1.0 - cos * cos)).max(1e-4).sqrt();
        let squeeze = (cos_behind / cos).sqrt();
        let power = curvature * (cos_behind - eta * cos) / (cos_behind * cos).sqrt();
        self.checked(self.width * squeeze, self.spread * eta / squeeze - self.width * power)
    }

    /// A mesh whose normals turn wildly has no useful curvature: such a cone keeps its spread.
    fn checked(self, width: f32, spread: f32) -> Self {
        let spread = if spread.abs() < 1e6 { spread } else { self.spread };
        Self { width: if width.is_finite() { width } else { self.width }, spread }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CONE: Cone = Cone { width: 0.01, spread: 0.001 };

    #[test]
    fn flat_mirrors_change_nothing() {
        assert_eq!(CONE.reflected(0.0).after(3.0), CONE.after(3.0));
        assert_eq!(CONE.refracted(0.0, 1.0, 1.0), CONE);
    }

    #[test]
    fn mirrors_have_their_focal_length() {
        // A concave mirror of radius 2 focuses parallel rays at 1.
        let parallel = Cone { width: 0.1, spread: 0.0 };
        assert!(parallel.reflected(-0.5).after(1.0).width.abs() < 1e-7);
        // Behind the focus the beam is upside down and grows.
        assert!((parallel.reflected(-0.5).after(3.0).footprint() - 0.2).abs() < 1e-6);
    }

    #[test]
    fn balls_of_glass_have_their_focal_length() {
        // Entering a sphere of radius 1 and index 1.5, parallel rays meet 3 behind the surface; the second surface, at
        // 2, bends them to a focus half a radius behind it.
        let parallel = Cone { width: 0.1, spread: 0.0 };
        let inside = parallel.refracted(1.0, 1.0 / 1.5, 1.0);
        assert!(inside.after(3.0).width.abs() < 1e-6, "{inside:?}");
        let behind = inside.after(2.0).refracted(-1.0, 1.5, 1.0);
        assert!(behind.after(0.5).width.abs() < 1e-6, "{behind:?}");
    }
}
