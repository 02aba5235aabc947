//! Colours: linear Rec. 709 RGB in a vec3.

use rhai::{Dynamic, Engine};

use super::Function;
use super::math::{floored_mod, max, min};
use super::operand::{Outcome, number, refuse};
use super::vectors::gather;
use crate::math::{Vec3, linear_from_srgb, luminance};

pub(super) const FUNCTIONS: &[Function] = &[
    Function { name: "rgb", form: "rgb(r, g, b)", about: "a linear colour, the same as vec3" },
    Function { name: "gray", form: "gray(x)", about: "rgb(x, x, x)" },
    Function {
        name: "srgb", form: "srgb(r, g, b)", about: "a linear colour from sRGB values 0 … 1; also srgb(color)"
    },
    Function { name: "hsv", form: "hsv(hue, saturation, value)", about: "a colour; the hue is in turns and wraps" },
    Function {
        name: "hsv_from_rgb",
        form: "hsv_from_rgb(color)",
        about: "vec3 of hue in turns (0 … 1), saturation, value",
    },
    Function { name: "luminance", form: "luminance(color)", about: "r·0.2126 + g·0.7152 + b·0.0722" },
];

/// For `n` = 5, 3 and 1 (red, green, blue), with `k = mod(n + hue * 6, 6)`:
/// `value - value * saturation * max(0, min(min(k, 4 - k), 1))`.
#[inline(always)]
pub(super) fn rgb_from_hsv(hue: f32, saturation: f32, value: f32) -> Vec3 {
    let channel = |n: f32| {
        let k = floored_mod(n + hue * 6.0, 6.0);
        value - value * saturation * max(0.0, min(min(k, 4.0 - k), 1.0))
    };
    Vec3::new(channel(5.0), channel(3.0), channel(1.0))
}

/// Hue in turns (0 for grays), saturation (0 for black), value.
#[inline(always)]
pub(super) fn hsv_from_rgb(color: Vec3) -> Vec3 {
    let [r, g, b] = color.to_array();
    let value = max(max(r, g), b);
    let chroma = value - min(min(r, g), b);
    let sixths = if chroma == 0.0 {
        0.0
    } else if value == r {
        floored_mod((g - b) / chroma, 6.0)
    } else if value == g {
        (b - r) / chroma + 2.0
    } else {
        (r - g) / chroma + 4.0
    };
    Vec3::new(sixths / 6.0, if value == 0.0 { 0.0 } else { chroma / value }, value)
}

pub(super) fn register(engine: &mut Engine) {
    engine.register_fn("rgb", |r: f32, g: f32, b: f32| Vec3::new(r, g, b));
    engine.register_fn("rgb", |r: Dynamic, g: Dynamic, b: Dynamic| three("rgb", [r, g, b]));
    engine.register_fn("gray", |x: f32| Vec3::splat(x));
    engine.register_fn("gray", |x: Dynamic| number("gray", &x).map(Vec3::splat));
    let decode = |v: Vec3| Vec3::new(linear_from_srgb(v.x), linear_from_srgb(v.y), linear_from_srgb(v.z));
    engine.register_fn("srgb", move |r: Dynamic, g: Dynamic, b: Dynamic| three("srgb", [r, g, b]).map(decode));
    engine.register_fn("srgb", decode);
    engine.register_fn("hsv", |h: Dynamic, s: Dynamic, v: Dynamic| {
        three("hsv", [h, s, v]).map(|v| rgb_from_hsv(v.x, v.y, v.z))
    });
    engine.register_fn("hsv_from_rgb", hsv_from_rgb);
    engine.register_fn("luminance", luminance);
}

fn three(name: &str, parts: [Dynamic; 3]) -> Outcome<Vec3> {
    if parts.iter().any(|part| !part.is_float() && !part.is_int()) {
        return Err(refuse(name, &parts));
    }
    gather::<Vec3, 3>(parts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hues_are_in_turns_and_wrap() {
        assert_eq!(rgb_from_hsv(0.0, 1.0, 1.0), Vec3::new(1.0, 0.0, 0.0));
        assert_eq!(rgb_from_hsv(1.0, 1.0, 1.0), Vec3::new(1.0, 0.0, 0.0));
        assert!(rgb_from_hsv(1.0 / 3.0, 1.0, 1.0).abs_diff_eq(Vec3::new(0.0, 1.0, 0.0), 1e-6));
        assert!(rgb_from_hsv(-1.0 / 3.0, 1.0, 1.0).abs_diff_eq(Vec3::new(0.0, 0.0, 1.0), 1e-6));
        assert_eq!(rgb_from_hsv(0.3, 0.0, 0.25), Vec3::splat(0.25));
    }

    #[test]
    fn hsv_goes_there_and_back() {
        for color in [Vec3::new(0.2, 0.5, 0.9), Vec3::new(0.9, 0.1, 0.3), Vec3::new(0.3, 0.8, 0.1), Vec3::splat(0.4)] {
            let hsv = hsv_from_rgb(color);
            assert!(rgb_from_hsv(hsv.x, hsv.y, hsv.z).abs_diff_eq(color, 1e-6), "{color} {hsv}");
        }
    }
}
