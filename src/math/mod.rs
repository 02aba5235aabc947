//! Vectors, and the one place where transcendental functions come from.
//!
//! Everything that can reach a pixel takes its sines and powers from [`portable`], which gives the same bits on every
//! CPU and with every C library. (`glam` is built with its `libm` feature for the same reason.) Add, multiply, divide
//! and square root are exact IEEE operations and need no care.

pub mod portable;

pub use glam::{
    Affine2, DAffine3, DMat3, DMat4, DQuat, DVec2, DVec3, DVec4, Mat3, Mat4, Quat, Vec2, Vec3, Vec3A, Vec4,
};

/// The luminance of a linear Rec. 709 colour.
#[inline]
#[must_use]
pub fn luminance(color: Vec3) -> f32 {
    color.x * 0.2126 + color.y * 0.7152 + color.z * 0.0722
}

/// One linear component as an sRGB-encoded value; both 0 … 1, input clamped.
#[inline(always)]
#[must_use]
pub fn srgb_from_linear(linear: f32) -> f32 {
    let x = linear.clamp(0.0, 1.0);
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * portable::pow(x, 1.0 / 2.4) - 0.055 }
}

/// One sRGB-encoded component (0 … 1) as a linear value.
#[inline(always)]
#[must_use]
pub fn linear_from_srgb(encoded: f32) -> f32 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { portable::pow((encoded + 0.055) / 1.055, 2.4) }
}

/// An orthonormal frame around a unit normal: two tangents such that (tangent, bitangent, normal) is right-handed.
///
/// Duff et al. 2017, "Building an Orthonormal Basis, Revisited".
#[must_use]
pub fn frame(normal: Vec3) -> (Vec3, Vec3) {
    let sign = 1.0_f32.copysign(normal.z);
    let a = -1.0 / (sign + normal.z);
    let b = normal.x * normal.y * a;
    (
        Vec3::new(1.0 + sign * normal.x * normal.x * a, sign * b, -sign * normal.x),
        Vec3::new(b, sign + normal.y * normal.y * a, -normal.y),
    )
}
