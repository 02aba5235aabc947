//! Patterns: stripes, checks, dots and hatching, 0 … 1.
//!
//! Each takes a filter width as an optional last argument: how far the pattern's coordinate moves across a pixel, as
//! `hit.footprint` and `hit.uv_footprint` tell. The pattern is then averaged over a box of that width, which removes its
//! jagged edges, and far away gives its mean. A filter that is not above 0 leaves the pattern sharp.

use rhai::{Dynamic, Engine};

use super::Function;
use super::math::{clamp, floored_mod, fract, max, min, mix, saturate};
use super::operand::{Operand, Outcome, number, refuse};
use super::vectors::length;
use crate::math::{Vec2, portable};

pub(super) const FUNCTIONS: &[Function] = &[
    Function {
        name: "stripes",
        form: "stripes(x, width)",
        about: "1 on a stripe in the middle of each unit of x that takes the share `width` (0 … 1) of it, else 0",
        types: "numbers → number, 0 or 1",
        example: "stripes(hit.uv.x * 20.0, 0.3)",
    },
    Function {
        name: "stripes",
        form: "stripes(x, width, filter)",
        about: "the same, averaged over `filter` units of x",
        types: "numbers → number, 0 … 1",
        example: "stripes(hit.uv.x * 20.0, 0.3, hit.uv_footprint * 20.0)",
    },
    Function {
        name: "checker",
        form: "checker(point)",
        about: "0 and 1 by turns in the unit squares of a vec2, or the unit cubes of a vec3",
        types: "vec2 or vec3 → number, 0 or 1",
        example: "checker(hit.position * 2.0)",
    },
    Function {
        name: "checker",
        form: "checker(point, filter)",
        about: "the same, averaged over a box with edges of `filter` units",
        types: "vec2 or vec3, number → number, 0 … 1",
        example: "checker(hit.uv * 8.0, hit.uv_footprint * 8.0)",
    },
    Function {
        name: "dots",
        form: "dots(uv, radius)",
        about: "1 on discs of a radius of 0 … 0.7 in the middle of each unit square, else 0",
        types: "vec2, number → number, 0 or 1",
        example: "dots(rotate(hit.uv * 30.0, 0.5), 0.3)",
    },
    Function {
        name: "dots",
        form: "dots(uv, radius, filter)",
        about: "the same with edges that are `filter` units wide",
        types: "vec2, number, number → number, 0 … 1",
        example: "dots(hit.uv * 30.0, 0.3, hit.uv_footprint * 30.0)",
    },
    Function {
        name: "hatch",
        form: "hatch(uv, darkness)",
        about: "1 on strokes along u, one in each unit of v, that cover the share `darkness` (0 … 1), else 0",
        types: "vec2, number 0 … 1 → number, 0 or 1",
        example: "hatch(hit.uv * 60.0, 0.4)",
    },
    Function {
        name: "hatch",
        form: "hatch(uv, darkness, filter)",
        about: "the same, averaged over `filter` units of v",
        types: "vec2, number 0 … 1, number → number, 0 … 1",
        example: "hatch(rotate(hit.uv * 60.0, 0.8), 0.4, hit.uv_footprint * 60.0)",
    },
    Function {
        name: "cross_hatch",
        form: "cross_hatch(uv, darkness)",
        about: "the same with strokes along v too where it is darker than a half; they cover `darkness` together",
        types: "vec2, number 0 … 1 → number, 0 or 1",
        example: "cross_hatch(hit.uv * 60.0, 1.0 - saturate(luminance(hit.irradiance)))",
    },
    Function {
        name: "cross_hatch",
        form: "cross_hatch(uv, darkness, filter)",
        about: "the same, averaged over `filter` units of u and v",
        types: "vec2, number 0 … 1, number → number, 0 … 1",
        example: "cross_hatch(hit.uv * 60.0, 0.7, hit.uv_footprint * 60.0)",
    },
    Function {
        name: "rotate",
        form: "rotate(v, radians)",
        about: "a vec2 turned counter-clockwise (from x to y), to lay patterns askew",
        types: "vec2, number → vec2",
        example: "rotate(hit.uv, radians(30)).x",
    },
];

/// With `w = saturate(width)`: without a filter, 1 where `abs(fract(x) - 0.5) * 2 < w`, else 0. With one, and with
/// `i(t) = floor(t) * w + clamp(fract(t) - (0.5 - 0.5 * w), 0, w)`:
/// `saturate((i(x + 0.5 * filter) - i(x - 0.5 * filter)) / filter)`.
#[inline(always)]
pub(in crate::shade) fn stripes(x: f32, width: f32, filter: f32) -> f32 {
    let w = saturate(width);
    if filter > 0.0 {
        let integral = |t: f32| t.floor() * w + clamp(fract(t) - (0.5 - 0.5 * w), 0.0, w);
        return saturate((integral(x + 0.5 * filter) - integral(x - 0.5 * filter)) / filter);
    }
    let from_middle = (fract(x) - 0.5).abs() * 2.0;
    if from_middle < w { 1.0 } else { 0.0 }
}

/// A square wave, 1 on the units that begin with an even number and −1 on the others; averaged over `filter`, with
/// `i(t) = 1 - abs(mod(t, 2) - 1)`: `clamp((i(x + 0.5 * filter) - i(x - 0.5 * filter)) / filter, -1, 1)`.
#[inline(always)]
fn square_wave(x: f32, filter: f32) -> f32 {
    if filter > 0.0 {
        let integral = |t: f32| 1.0 - (floored_mod(t, 2.0) - 1.0).abs();
        return clamp((integral(x + 0.5 * filter) - integral(x - 0.5 * filter)) / filter, -1.0, 1.0);
    }
    if floored_mod(x.floor(), 2.0) < 1.0 { 1.0 } else { -1.0 }
}

/// `0.5 - 0.5 * wave(x) * wave(y)` (and `* wave(z)`), from left to right.
#[inline(always)]
pub(in crate::shade) fn checker(point: &[f32], filter: f32) -> f32 {
    let waves = point.iter().fold(0.5, |product, x| product * square_wave(*x, filter));
    0.5 - waves
}

/// With `d = length(fract(uv) - 0.5)`: without a filter, 1 where `d < radius`, else 0. With one, the mean
/// `m = min(PI * radius * radius, 1)` takes over where the filter is wider than half a unit:
/// `mix(saturate((radius - d) / filter + 0.5), m, saturate(filter * 2 - 1))`.
#[inline(always)]
pub(in crate::shade) fn dots(uv: Vec2, radius: f32, filter: f32) -> f32 {
    let d = length(Vec2::new(fract(uv.x) - 0.5, fract(uv.y) - 0.5));
    if filter > 0.0 {
        let mean = min(std::f32::consts::PI * radius * radius, 1.0);
        return mix(saturate((radius - d) / filter + 0.5), mean, saturate(filter * 2.0 - 1.0));
    }
    if d < radius { 1.0 } else { 0.0 }
}

/// `stripes(uv.y, darkness, filter)`.
#[inline(always)]
pub(in crate::shade) fn hatch(uv: Vec2, darkness: f32, filter: f32) -> f32 {
    stripes(uv.y, darkness, filter)
}

/// With `a = stripes(uv.y, min(d, 0.5), filter)` and `b = stripes(uv.x, max(d * 2 - 1, 0), filter)` for a darkness `d`
/// within 0 … 1: `a + b - a * b`, which is the exact mean of the two layers, as they cross at right angles.
#[inline(always)]
pub(in crate::shade) fn cross_hatch(uv: Vec2, darkness: f32, filter: f32) -> f32 {
    let d = saturate(darkness);
    let a = stripes(uv.y, min(d, 0.5), filter);
    let b = stripes(uv.x, max(d * 2.0 - 1.0, 0.0), filter);
    a + b - a * b
}

/// With `c = cos(radians)` and `s = sin(radians)`: `(v.x * c - v.y * s, v.x * s + v.y * c)`.
#[inline(always)]
pub(in crate::shade) fn rotate(v: Vec2, radians: f32) -> Vec2 {
    let (c, s) = (portable::cos(radians), portable::sin(radians));
    Vec2::new(v.x * c - v.y * s, v.x * s + v.y * c)
}

/// The numbers behind a first argument, if all are numbers.
fn numbers(arguments: &[Dynamic]) -> Option<Vec<f32>> {
    arguments.iter().map(|argument| Operand::of(argument).filter(|o| o.width() == 1).map(|o| o.lane(0))).collect()
}

fn of_plane(name: &str, arguments: &[Dynamic], f: fn(Vec2, f32, f32) -> f32) -> Outcome<f32> {
    match (Operand::of(&arguments[0]), numbers(&arguments[1..]).as_deref()) {
        (Some(Operand::Vec2(uv)), Some([x])) => Ok(f(uv, *x, 0.0)),
        (Some(Operand::Vec2(uv)), Some([x, filter])) => Ok(f(uv, *x, *filter)),
        _ => Err(refuse(name, arguments)),
    }
}

fn checked(arguments: &[Dynamic]) -> Outcome<f32> {
    let filter = match numbers(&arguments[1..]).as_deref() {
        Some([]) => 0.0,
        Some([filter]) => *filter,
        _ => return Err(refuse("checker", arguments)),
    };
    match Operand::of(&arguments[0]) {
        Some(Operand::Vec2(point)) => Ok(checker(&point.to_array(), filter)),
        Some(Operand::Vec3(point)) => Ok(checker(&point.to_array(), filter)),
        _ => Err(refuse("checker", arguments)),
    }
}

pub(super) fn register(engine: &mut Engine) {
    engine.register_fn("stripes", |x: Dynamic, width: Dynamic| match numbers(&[x.clone(), width.clone()]).as_deref() {
        Some([x, width]) => Ok(stripes(*x, *width, 0.0)),
        _ => Err(refuse("stripes", &[x, width])),
    });
    engine.register_fn("stripes", |x: Dynamic, width: Dynamic, filter: Dynamic| {
        let all = [x, width, filter];
        match numbers(&all).as_deref() {
            Some([x, width, filter]) => Ok(stripes(*x, *width, *filter)),
            _ => Err(refuse("stripes", &all)),
        }
    });
    engine.register_fn("checker", |point: Dynamic| checked(&[point]));
    engine.register_fn("checker", |point: Dynamic, filter: Dynamic| checked(&[point, filter]));
    type OfPlane = fn(Vec2, f32, f32) -> f32;
    let planes: [(&'static str, OfPlane); 3] = [("dots", dots), ("hatch", hatch), ("cross_hatch", cross_hatch)];
    for (name, f) in planes {
        engine.register_fn(name, move |uv: Dynamic, x: Dynamic| of_plane(name, &[uv, x], f));
        engine.register_fn(name, move |uv: Dynamic, x: Dynamic, filter: Dynamic| of_plane(name, &[uv, x, filter], f));
    }
    engine.register_fn("rotate", |v: Dynamic, radians: Dynamic| -> Outcome<Vec2> {
        match Operand::of(&v) {
            Some(Operand::Vec2(plane)) => Ok(rotate(plane, number("rotate", &radians)?)),
            _ => Err(refuse("rotate", &[v, radians])),
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean of a pattern over a box, by many points.
    fn mean(f: impl Fn(f32, f32) -> f32, width: f32) -> f32 {
        let steps = 400;
        let at = |i: i32| ((i as f32 + 0.5) / steps as f32 - 0.5) * width;
        let sum: f64 =
            (0..steps).flat_map(|i| (0..steps).map(move |j| (i, j))).map(|(i, j)| f64::from(f(at(i), at(j)))).sum();
        (sum / f64::from(steps * steps)) as f32
    }

    #[test]
    fn filters_average_over_a_box() {
        for (x, y, filter) in [(0.3, 0.8, 0.25), (-1.7, 2.2, 0.6), (5.0, -3.5, 1.7), (0.0, 0.0, 4.3)] {
            let uv = Vec2::new(x, y);
            let stripes_mean = mean(|dx, _| stripes(x + dx, 0.3, 0.0), filter);
            assert!((stripes(x, 0.3, filter) - stripes_mean).abs() < 0.015, "{x} {filter}");
            let checker_mean = mean(|dx, dy| checker(&[x + dx, y + dy], 0.0), filter);
            assert!((checker(&[x, y], filter) - checker_mean).abs() < 0.015, "{uv} {filter}");
            for darkness in [0.2, 0.5, 0.8] {
                let crossed = mean(|dx, dy| cross_hatch(uv + Vec2::new(dx, dy), darkness, 0.0), filter);
                assert!((cross_hatch(uv, darkness, filter) - crossed).abs() < 0.015, "{uv} {darkness} {filter}");
            }
        }
    }

    #[test]
    fn hatching_keeps_the_tone() {
        for darkness in [0.0, 0.1, 0.35, 0.5, 0.65, 0.9, 1.0] {
            let drawn = mean(|x, y| hatch(Vec2::new(x, y), darkness, 0.0), 5.0);
            assert!((drawn - darkness).abs() < 0.01, "{darkness}: {drawn}");
            let drawn = mean(|x, y| cross_hatch(Vec2::new(x, y), darkness, 0.0), 5.0);
            assert!((drawn - darkness).abs() < 0.01, "{darkness}: {drawn}");
            assert!((cross_hatch(Vec2::new(0.3, 0.7), darkness, 1000.0) - darkness).abs() < 0.002);
        }
    }

    #[test]
    fn dots_cover_their_area() {
        for radius in [0.1, 0.3, 0.5] {
            let area = std::f32::consts::PI * radius * radius;
            assert!((mean(|x, y| dots(Vec2::new(x, y), radius, 0.0), 1.0) - area).abs() < 0.01);
            assert!((mean(|x, y| dots(Vec2::new(x, y), radius, 0.1), 1.0) - area).abs() < 0.02);
            assert_eq!(dots(Vec2::new(0.2, 0.9), radius, 3.0), area);
        }
    }

    #[test]
    fn checks_alternate() {
        assert_eq!(checker(&[0.5, 0.5], 0.0), 0.0);
        assert_eq!(checker(&[1.5, 0.5], 0.0), 1.0);
        assert_eq!(checker(&[-0.5, 0.5], 0.0), 1.0);
        assert_eq!(checker(&[-0.5, -0.5], 0.0), 0.0);
        assert_eq!(checker(&[0.5, 1.5, 2.5], 0.0), 1.0);
        assert_eq!(checker(&[1.5, 1.5, 1.5], 0.0), 1.0);
    }
}
