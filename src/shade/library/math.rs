//! Functions of numbers, each applied to every component of a vector.
//!
//! `min`, `max`, `clamp`, `abs`, `sign` and `mod` of ints alone give an int; all else gives floats.

#![expect(clippy::cast_precision_loss, reason = "an int counts as the nearest float")]

use std::f32::consts::{PI, TAU};

use rhai::{Dynamic, Engine};

use super::Function;
use super::operand::{Operand, Outcome, binary, lanewise, refuse, ternary, unary};
use crate::math::portable;
use crate::shade::fault::Fault;

pub(super) const FUNCTIONS: &[Function] = &[
    Function { name: "mix", form: "mix(a, b, t)", about: "a·(1 − t) + b·t" },
    Function { name: "clamp", form: "clamp(x, low, high)", about: "min(max(x, low), high)" },
    Function { name: "saturate", form: "saturate(x)", about: "x within 0 … 1" },
    Function { name: "step", form: "step(edge, x)", about: "0 where x < edge, else 1" },
    Function {
        name: "smoothstep",
        form: "smoothstep(low, high, x)",
        about: "0 below low, 1 above high, t·t·(3 − 2·t) between",
    },
    Function {
        name: "remap",
        form: "remap(x, from_low, from_high, to_low, to_high)",
        about: "x carried over linearly from one range to another, beyond the ends too",
    },
    Function { name: "min", form: "min(a, b)", about: "b where b < a, else a" },
    Function { name: "max", form: "max(a, b)", about: "b where a < b, else a" },
    Function { name: "abs", form: "abs(x)", about: "x without its sign" },
    Function { name: "sign", form: "sign(x)", about: "−1, 0 or 1" },
    Function { name: "floor", form: "floor(x)", about: "the next whole number downwards, as a float" },
    Function { name: "ceil", form: "ceil(x)", about: "the next whole number upwards, as a float" },
    Function { name: "round", form: "round(x)", about: "the nearest whole number, halves away from 0, as a float" },
    Function { name: "fract", form: "fract(x)", about: "x − floor(x)" },
    Function { name: "mod", form: "mod(x, y)", about: "x − y·floor(x / y): has the sign of y, unlike x % y" },
    Function { name: "sqrt", form: "sqrt(x)", about: "square root" },
    Function { name: "pow", form: "pow(x, y)", about: "x to the power y, as a float" },
    Function { name: "exp", form: "exp(x)", about: "e to the power x" },
    Function { name: "exp2", form: "exp2(x)", about: "2 to the power x" },
    Function { name: "ln", form: "ln(x)", about: "natural logarithm" },
    Function { name: "log", form: "log(x)", about: "logarithm to base 10" },
    Function { name: "log", form: "log(x, base)", about: "ln(x) / ln(base)" },
    Function { name: "log2", form: "log2(x)", about: "logarithm to base 2" },
    Function { name: "sin", form: "sin(radians)", about: "sine" },
    Function { name: "cos", form: "cos(radians)", about: "cosine" },
    Function { name: "tan", form: "tan(radians)", about: "tangent" },
    Function { name: "asin", form: "asin(x)", about: "angle of a sine, in radians" },
    Function { name: "acos", form: "acos(x)", about: "angle of a cosine, in radians" },
    Function { name: "atan", form: "atan(x)", about: "angle of a tangent, in radians" },
    Function { name: "atan", form: "atan(y, x)", about: "angle of the direction (x, y), −π … π" },
    Function { name: "sinh", form: "sinh(x)", about: "hyperbolic sine" },
    Function { name: "cosh", form: "cosh(x)", about: "hyperbolic cosine" },
    Function { name: "tanh", form: "tanh(x)", about: "hyperbolic tangent" },
    Function { name: "radians", form: "radians(degrees)", about: "degrees · (π / 180)" },
    Function { name: "degrees", form: "degrees(radians)", about: "radians · (180 / π)" },
    Function { name: "is_nan", form: "is_nan(x)", about: "whether a float is no number" },
    Function { name: "to_int", form: "to_int(x)", about: "the whole part of a number, as an int" },
    Function { name: "to_float", form: "to_float(x)", about: "the nearest float of an int" },
];

/// Words that stand for numbers.
pub(in crate::shade) const CONSTANTS: [(&str, f32); 2] = [("PI", PI), ("TAU", TAU)];

/// `b` where `b < a`, else `a`: a NaN in `a` stays.
#[inline(always)]
pub(super) fn min(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}

/// `b` where `a < b`, else `a`: a NaN in `a` stays.
#[inline(always)]
pub(super) fn max(a: f32, b: f32) -> f32 {
    if a < b { b } else { a }
}

/// `min(max(x, low), high)`.
#[inline(always)]
pub(super) fn clamp(x: f32, low: f32, high: f32) -> f32 {
    min(max(x, low), high)
}

/// `clamp(x, 0, 1)`.
#[inline(always)]
pub(super) fn saturate(x: f32) -> f32 {
    clamp(x, 0.0, 1.0)
}

/// `a * (1 - t) + b * t`: exactly `a` at 0 and `b` at 1.
#[inline(always)]
pub(super) fn mix(a: f32, b: f32, t: f32) -> f32 {
    a * (1.0 - t) + b * t
}

/// 0 where `x < edge`, else 1.
#[inline(always)]
pub(super) fn step(edge: f32, x: f32) -> f32 {
    if x < edge { 0.0 } else { 1.0 }
}

/// With `t = saturate((x - low) / (high - low))`: `t * t * (3 - 2 * t)`. With `low = high` it is `step(low, x)`.
#[inline(always)]
pub(super) fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    if low == high {
        return step(low, x);
    }
    let t = saturate((x - low) / (high - low));
    t * t * (3.0 - 2.0 * t)
}

/// `to_low + (x - from_low) / (from_high - from_low) * (to_high - to_low)`.
#[inline(always)]
pub(super) fn remap(x: f32, from_low: f32, from_high: f32, to_low: f32, to_high: f32) -> f32 {
    to_low + (x - from_low) / (from_high - from_low) * (to_high - to_low)
}

/// -1, 0 or 1; a NaN stays.
#[inline(always)]
pub(super) fn sign(x: f32) -> f32 {
    if x > 0.0 {
        1.0
    } else if x < 0.0 {
        -1.0
    } else {
        x
    }
}

/// `x - floor(x)`.
#[inline(always)]
pub(super) fn fract(x: f32) -> f32 {
    x - x.floor()
}

/// `x - y * floor(x / y)`.
#[inline(always)]
pub(super) fn floored_mod(x: f32, y: f32) -> f32 {
    x - y * (x / y).floor()
}

/// `ln(x) / ln(base)`.
fn log(x: f32, base: f32) -> f32 {
    portable::ln(x) / portable::ln(base)
}

pub(super) fn register(engine: &mut Engine) {
    ternary(engine, "mix", mix);
    ternary(engine, "clamp", clamp);
    unary(engine, "saturate", saturate);
    binary(engine, "step", step);
    ternary(engine, "smoothstep", smoothstep);
    engine.register_fn("remap", |x: Dynamic, a: Dynamic, b: Dynamic, c: Dynamic, d: Dynamic| {
        lanewise("remap", [x, a, b, c, d], |[x, a, b, c, d]| remap(x, a, b, c, d))
    });
    binary(engine, "min", min);
    binary(engine, "max", max);
    unary(engine, "abs", f32::abs);
    unary(engine, "sign", sign);
    unary(engine, "floor", f32::floor);
    unary(engine, "ceil", f32::ceil);
    unary(engine, "round", f32::round);
    unary(engine, "fract", fract);
    binary(engine, "mod", floored_mod);
    unary(engine, "sqrt", f32::sqrt);
    binary(engine, "pow", portable::pow);
    unary(engine, "exp", portable::exp);
    unary(engine, "exp2", portable::exp2);
    unary(engine, "ln", portable::ln);
    unary(engine, "log", portable::log10);
    binary(engine, "log", log);
    unary(engine, "log2", portable::log2);
    unary(engine, "sin", portable::sin);
    unary(engine, "cos", portable::cos);
    unary(engine, "tan", portable::tan);
    unary(engine, "asin", portable::asin);
    unary(engine, "acos", portable::acos);
    unary(engine, "atan", portable::atan);
    binary(engine, "atan", portable::atan2);
    unary(engine, "sinh", portable::sinh);
    unary(engine, "cosh", portable::cosh);
    unary(engine, "tanh", portable::tanh);
    unary(engine, "radians", |degrees| degrees * (PI / 180.0));
    unary(engine, "degrees", |radians| radians * (180.0 / PI));
    register_ints(engine);
    register_conversions(engine);
}

/// What gives an int if all arguments are ints.
fn register_ints(engine: &mut Engine) {
    engine.register_fn("min", |a: i64, b: i64| a.min(b));
    engine.register_fn("max", |a: i64, b: i64| a.max(b));
    engine.register_fn("clamp", |x: i64, low: i64, high: i64| x.max(low).min(high));
    engine.register_fn("sign", i64::signum);
    engine.register_fn("abs", |x: i64| -> Outcome<i64> {
        x.checked_abs().ok_or_else(|| Fault::new(format!("abs({x}) does not fit an int")).into())
    });
    engine.register_fn("mod", |x: i64, y: i64| -> Outcome<i64> {
        let rest = x.checked_rem(y).ok_or_else(|| Fault::new(format!("mod({x}, {y}) has no value")))?;
        Ok(if rest != 0 && (rest < 0) != (y < 0) { rest + y } else { rest })
    });
}

fn register_conversions(engine: &mut Engine) {
    engine.register_fn("is_nan", |x: f32| x.is_nan());
    engine.register_fn("to_float", |x: Dynamic| match Operand::of(&x) {
        Some(Operand::Int(i)) => Ok(i as f32),
        Some(Operand::Float(f)) => Ok(f),
        _ => Err(refuse("to_float", &[x])),
    });
    engine.register_fn("to_int", |x: Dynamic| -> Outcome<i64> {
        // 2⁶³ as a float; every float below it fits.
        const END: f32 = 9_223_372_036_854_775_808.0;
        match Operand::of(&x) {
            Some(Operand::Int(i)) => Ok(i),
            #[expect(clippy::cast_possible_truncation, reason = "checked to fit")]
            Some(Operand::Float(f)) if (-END..END).contains(&f) => Ok(f as i64),
            Some(Operand::Float(f)) => Err(Fault::new(format!("to_int({f}) does not fit an int")).into()),
            _ => Err(refuse("to_int", &[x])),
        }
    });
}
