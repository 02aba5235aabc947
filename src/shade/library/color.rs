//! Colours: linear Rec. 709 RGB in a vec3.

use std::f32::consts::TAU;

use rhai::{Dynamic, Engine};

use super::Function;
use super::math::{clamp, floored_mod, fract, max, min, mix};
use super::operand::{Outcome, number, refuse};
use super::vectors::gather;
use crate::math::{Vec3, linear_from_srgb, luminance, portable, srgb_from_linear};

pub(super) const FUNCTIONS: &[Function] = &[
    Function {
        name: "rgb",
        form: "rgb(r, g, b)",
        about: "a linear colour, the same as vec3",
        types: "numbers → colour",
        example: "rgb(0.9, 0.5, 0.2)",
    },
    Function { name: "gray", form: "gray(x)", about: "rgb(x, x, x)", types: "number → colour", example: "gray(0.5)" },
    Function {
        name: "srgb",
        form: "srgb(r, g, b)",
        about: "a linear colour from sRGB values 0 … 1; also srgb(color)",
        types: "numbers or a colour, 0 … 1 → colour, 0 … 1",
        example: "srgb(1.0, 0.5, 0.0)",
    },
    Function {
        name: "hsv",
        form: "hsv(hue, saturation, value)",
        about: "a colour; the hue is in turns and wraps",
        types: "numbers: turns, 0 … 1, 0 or more → colour",
        example: "hsv(0.33, 1.0, 0.8)",
    },
    Function {
        name: "hsv_from_rgb",
        form: "hsv_from_rgb(color)",
        about: "vec3 of hue in turns (0 … 1), saturation, value",
        types: "colour → vec3",
        example: "hsv_from_rgb(rgb(0.2, 0.5, 0.9)).x",
    },
    Function {
        name: "hsl",
        form: "hsl(hue, saturation, lightness)",
        about: "a colour; the hue is in turns and wraps, lightness 1 is white",
        types: "numbers: turns, 0 … 1, 0 … 1 → colour, 0 … 1",
        example: "hsl(0.6, 0.7, 0.5)",
    },
    Function {
        name: "hsl_from_rgb",
        form: "hsl_from_rgb(color)",
        about: "vec3 of hue in turns (0 … 1), saturation, lightness",
        types: "colour → vec3",
        example: "hsl_from_rgb(rgb(0.2, 0.5, 0.9)).z",
    },
    Function {
        name: "srgb_from_rgb",
        form: "srgb_from_rgb(color)",
        about: "the sRGB values 0 … 1 of a linear colour; what is outside 0 … 1 is clamped",
        types: "colour → vec3, 0 … 1",
        example: "srgb_from_rgb(rgb(0.2, 0.5, 0.9))",
    },
    Function {
        name: "oklab",
        form: "oklab(lightness, a, b)",
        about: "a linear colour from OKLab, in which equal steps look equal; also oklab(lab)",
        types: "numbers or a vec3 → colour",
        example: "oklab(0.7, 0.1, -0.1)",
    },
    Function {
        name: "oklab_from_rgb",
        form: "oklab_from_rgb(color)",
        about: "vec3 of lightness (0 … 1), a (green to red) and b (blue to yellow), both about −0.4 … 0.4",
        types: "colour → vec3",
        example: "oklab_from_rgb(rgb(0.2, 0.5, 0.9)).x",
    },
    Function {
        name: "oklch",
        form: "oklch(lightness, chroma, hue)",
        about: "a linear colour from OKLab's lightness, chroma (0 … 0.4) and hue in turns; also oklch(lch)",
        types: "numbers or a vec3 → colour",
        example: "oklch(0.7, 0.12, 0.25)",
    },
    Function {
        name: "oklch_from_rgb",
        form: "oklch_from_rgb(color)",
        about: "vec3 of lightness, chroma and hue in turns (0 … 1); the hue of grays is 0",
        types: "colour → vec3",
        example: "oklch_from_rgb(rgb(0.2, 0.5, 0.9)).z",
    },
    Function {
        name: "mix_oklab",
        form: "mix_oklab(a, b, t)",
        about: "two linear colours mixed in OKLab: even to the eye, and no dull middle",
        types: "colour, colour, number 0 … 1 → colour",
        example: "mix_oklab(rgb(0, 0, 1), rgb(1, 1, 0), 0.5)",
    },
    Function {
        name: "temperature",
        form: "temperature(kelvin)",
        about: "the colour of a glowing body of 1667 … 25000 K, its brightest channel 1; 6500 is about white",
        types: "number → colour, 0 … 1",
        example: "temperature(2700)",
    },
    Function {
        name: "luminance",
        form: "luminance(color)",
        about: "r·0.2126 + g·0.7152 + b·0.0722",
        types: "colour → number",
        example: "luminance(hit.irradiance)",
    },
];

/// For `n` = 5, 3 and 1 (red, green, blue), with `k = mod(n + hue * 6, 6)`:
/// `value - value * saturation * max(0, min(min(k, 4 - k), 1))`.
#[inline(always)]
pub(in crate::shade) fn rgb_from_hsv(hue: f32, saturation: f32, value: f32) -> Vec3 {
    let channel = |n: f32| {
        let k = floored_mod(n + hue * 6.0, 6.0);
        value - value * saturation * max(0.0, min(min(k, 4.0 - k), 1.0))
    };
    Vec3::new(channel(5.0), channel(3.0), channel(1.0))
}

/// Hue in turns (0 for grays), saturation (0 for black), value.
#[inline(always)]
pub(in crate::shade) fn hsv_from_rgb(color: Vec3) -> Vec3 {
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

/// For `n` = 0, 8 and 4 (red, green, blue), with `k = mod(n + hue * 12, 12)` and
/// `a = saturation * min(lightness, 1 - lightness)`: `lightness - a * max(-1, min(min(k - 3, 9 - k), 1))`.
#[inline(always)]
pub(in crate::shade) fn rgb_from_hsl(hue: f32, saturation: f32, lightness: f32) -> Vec3 {
    let a = saturation * min(lightness, 1.0 - lightness);
    let channel = |n: f32| {
        let k = floored_mod(n + hue * 12.0, 12.0);
        lightness - a * max(-1.0, min(min(k - 3.0, 9.0 - k), 1.0))
    };
    Vec3::new(channel(0.0), channel(8.0), channel(4.0))
}

/// The hue of `hsv_from_rgb`; with the greatest and the least channel, the lightness is `(greatest + least) * 0.5`, and
/// the saturation `(greatest - lightness) / min(lightness, 1 - lightness)`, or 0 where that is 0.
#[inline(always)]
pub(in crate::shade) fn hsl_from_rgb(color: Vec3) -> Vec3 {
    let [r, g, b] = color.to_array();
    let greatest = max(max(r, g), b);
    let lightness = (greatest + min(min(r, g), b)) * 0.5;
    let room = min(lightness, 1.0 - lightness);
    let saturation = if room == 0.0 { 0.0 } else { (greatest - lightness) / room };
    Vec3::new(hsv_from_rgb(color).x, saturation, lightness)
}

/// Rows of a matrix times a vector: `(row.x * v.x + row.y * v.y) + row.z * v.z`.
#[inline(always)]
fn times(rows: [[f32; 3]; 3], v: Vec3) -> Vec3 {
    let row = |[a, b, c]: [f32; 3]| a * v.x + b * v.y + c * v.z;
    Vec3::new(row(rows[0]), row(rows[1]), row(rows[2]))
}

// B. Ottosson 2020, "A perceptual color space for image processing"; for linear sRGB.
const CONES_FROM_RGB: [[f32; 3]; 3] = [
    [0.412_221_47, 0.536_332_54, 0.051_445_993],
    [0.211_903_5, 0.680_699_5, 0.107_396_96],
    [0.088_302_46, 0.281_718_85, 0.629_978_7],
];
const OKLAB_FROM_ROOTS: [[f32; 3]; 3] = [
    [0.210_454_26, 0.793_617_8, -0.004_072_047],
    [1.977_998_5, -2.428_592_2, 0.450_593_7],
    [0.025_904_037, 0.782_771_77, -0.808_675_77],
];
const ROOTS_FROM_OKLAB: [[f32; 3]; 3] =
    [[1.0, 0.396_337_78, 0.215_803_76], [1.0, -0.105_561_346, -0.063_854_17], [1.0, -0.089_484_18, -1.291_485_5]];
const RGB_FROM_CONES: [[f32; 3]; 3] = [
    [4.076_741_7, -3.307_711_6, 0.230_969_94],
    [-1.268_438, 2.609_757_4, -0.341_319_38],
    [-0.004_196_086_3, -0.703_418_6, 1.707_614_7],
];

/// The matrix of the cones, the cube root of each, and the matrix to OKLab.
#[inline(always)]
pub(in crate::shade) fn oklab_from_rgb(color: Vec3) -> Vec3 {
    let cones = times(CONES_FROM_RGB, color);
    let roots = Vec3::new(portable::cbrt(cones.x), portable::cbrt(cones.y), portable::cbrt(cones.z));
    times(OKLAB_FROM_ROOTS, roots)
}

/// The matrix from OKLab, `(root * root) * root` of each, and the matrix to RGB.
#[inline(always)]
pub(in crate::shade) fn rgb_from_oklab(lab: Vec3) -> Vec3 {
    let roots = times(ROOTS_FROM_OKLAB, lab);
    let cube = |root: f32| root * root * root;
    times(RGB_FROM_CONES, Vec3::new(cube(roots.x), cube(roots.y), cube(roots.z)))
}

/// With `(l, a, b)` of `oklab_from_rgb`: `(l, sqrt(a * a + b * b), fract(atan(b, a) / TAU))`; hue 0 where the chroma is
/// below 0.00001, which is rounding.
#[inline(always)]
pub(in crate::shade) fn oklch_from_rgb(color: Vec3) -> Vec3 {
    let lab = oklab_from_rgb(color);
    let chroma = (lab.y * lab.y + lab.z * lab.z).sqrt();
    let hue = if chroma < 1e-5 { 0.0 } else { fract(portable::atan2(lab.z, lab.y) / TAU) };
    Vec3::new(lab.x, chroma, hue)
}

/// `oklab(lightness, chroma * cos(hue * TAU), chroma * sin(hue * TAU))`.
#[inline(always)]
pub(in crate::shade) fn rgb_from_oklch(lch: Vec3) -> Vec3 {
    let angle = lch.z * TAU;
    rgb_from_oklab(Vec3::new(lch.x, lch.y * portable::cos(angle), lch.y * portable::sin(angle)))
}

/// `mix` of each component of the two colours in OKLab, as a colour.
#[inline(always)]
pub(in crate::shade) fn mix_oklab(a: Vec3, b: Vec3, t: f32) -> Vec3 {
    let (a, b) = (oklab_from_rgb(a), oklab_from_rgb(b));
    rgb_from_oklab(Vec3::new(mix(a.x, b.x, t), mix(a.y, b.y, t), mix(a.z, b.z, t)))
}

/// The chromaticity on the Planckian locus (Kim et al. 2002, cubic splines, by Horner's rule in `1000 / kelvin` and in
/// `x`), as linear Rec. 709 with negative channels set to 0, divided by the greatest channel.
pub(in crate::shade) fn temperature(kelvin: f32) -> Vec3 {
    let kelvin = clamp(kelvin, 1667.0, 25_000.0);
    let cubic = |[a, b, c, d]: [f32; 4], t: f32| ((a * t + b) * t + c) * t + d;
    let of_x = if kelvin <= 4000.0 {
        [-0.266_123_9, -0.234_358_9, 0.877_695_6, 0.179_91]
    } else {
        [-3.025_847, 2.107_037_9, 0.222_634_7, 0.240_39]
    };
    let x = cubic(of_x, 1000.0 / kelvin);
    let of_y = if kelvin <= 2222.0 {
        [-1.106_381_4, -1.348_110_2, 2.185_558_3, -0.202_196_83]
    } else if kelvin <= 4000.0 {
        [-0.954_947_6, -1.374_185_9, 2.091_37, -0.167_488_67]
    } else {
        [3.081_758, -5.873_387, 3.751_13, -0.370_014_83]
    };
    let y = cubic(of_y, x);
    let xyz = Vec3::new(x / y, 1.0, (1.0 - x - y) / y);
    let rgb = times(
        [
            [3.240_454_2, -1.537_138_5, -0.498_531_4],
            [-0.969_266, 1.876_010_8, 0.041_556],
            [0.055_643_4, -0.204_025_9, 1.057_225_2],
        ],
        xyz,
    );
    let rgb = Vec3::new(max(rgb.x, 0.0), max(rgb.y, 0.0), max(rgb.z, 0.0));
    let greatest = max(max(rgb.x, rgb.y), rgb.z);
    Vec3::new(rgb.x / greatest, rgb.y / greatest, rgb.z / greatest)
}

pub(super) fn register(engine: &mut Engine) {
    register_spaces(engine);
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

fn register_spaces(engine: &mut Engine) {
    engine.register_fn("hsl", |h: Dynamic, s: Dynamic, l: Dynamic| {
        three("hsl", [h, s, l]).map(|v| rgb_from_hsl(v.x, v.y, v.z))
    });
    engine.register_fn("hsl_from_rgb", hsl_from_rgb);
    let encode = |v: Vec3| Vec3::new(srgb_from_linear(v.x), srgb_from_linear(v.y), srgb_from_linear(v.z));
    engine.register_fn("srgb_from_rgb", encode);
    engine.register_fn("oklab", |l: Dynamic, a: Dynamic, b: Dynamic| three("oklab", [l, a, b]).map(rgb_from_oklab));
    engine.register_fn("oklab", rgb_from_oklab);
    engine.register_fn("oklab_from_rgb", oklab_from_rgb);
    engine.register_fn("oklch", |l: Dynamic, c: Dynamic, h: Dynamic| three("oklch", [l, c, h]).map(rgb_from_oklch));
    engine.register_fn("oklch", rgb_from_oklch);
    engine.register_fn("oklch_from_rgb", oklch_from_rgb);
    engine.register_fn("mix_oklab", |a: Vec3, b: Vec3, t: Dynamic| -> Outcome<Vec3> {
        Ok(mix_oklab(a, b, number("mix_oklab", &t)?))
    });
    engine.register_fn("temperature", |kelvin: Dynamic| number("temperature", &kelvin).map(temperature));
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
    fn spaces_go_there_and_back() {
        for color in [Vec3::new(0.2, 0.5, 0.9), Vec3::new(0.9, 0.1, 0.3), Vec3::new(0.0, 1.0, 0.0), Vec3::splat(0.4)] {
            let close = |back: Vec3, what: &str| assert!(back.abs_diff_eq(color, 2e-5), "{what}: {back} for {color}");
            let hsl = hsl_from_rgb(color);
            close(rgb_from_hsl(hsl.x, hsl.y, hsl.z), "hsl");
            close(rgb_from_oklab(oklab_from_rgb(color)), "oklab");
            close(rgb_from_oklch(oklch_from_rgb(color)), "oklch");
            close(mix_oklab(color, Vec3::ONE, 0.0), "mix");
            close(mix_oklab(Vec3::ONE, color, 1.0), "mix");
        }
    }

    #[test]
    fn oklab_is_that_of_its_author() {
        // Values of B. Ottosson's page, for XYZ converted to linear sRGB.
        assert!(oklab_from_rgb(Vec3::ONE).abs_diff_eq(Vec3::new(1.0, 0.0, 0.0), 1e-5));
        assert!(oklab_from_rgb(Vec3::X).abs_diff_eq(Vec3::new(0.627_955, 0.224_863, 0.125_846), 1e-5));
        assert!(oklab_from_rgb(Vec3::Z).abs_diff_eq(Vec3::new(0.452_014, -0.032_457, -0.311_528), 1e-5));
        assert_eq!(oklch_from_rgb(Vec3::splat(0.5)).z, 0.0);
    }

    #[test]
    fn temperatures_run_from_red_to_blue() {
        let [warm, white, cold] = [2000.0, 6504.0, 20_000.0].map(temperature);
        assert!(warm.x == 1.0 && warm.y < 0.4 && warm.z < 0.05, "{warm}");
        // Daylight is a little greener than a glowing body.
        assert!(white.min_element() > 0.93, "{white}");
        assert!(cold.z == 1.0 && cold.x < 0.6, "{cold}");
        assert_eq!(temperature(1.0), temperature(1667.0));
        // The two splines meet.
        assert!(temperature(3999.9).abs_diff_eq(temperature(4000.1), 2e-3));
    }

    #[test]
    fn hsv_goes_there_and_back() {
        for color in [Vec3::new(0.2, 0.5, 0.9), Vec3::new(0.9, 0.1, 0.3), Vec3::new(0.3, 0.8, 0.1), Vec3::splat(0.4)] {
            let hsv = hsv_from_rgb(color);
            assert!(rgb_from_hsv(hsv.x, hsv.y, hsv.z).abs_diff_eq(color, 1e-6), "{color} {hsv}");
        }
    }
}
