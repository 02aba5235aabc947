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
    Function {
        name: "mix",
        form: "mix(a, b, t)",
        about: "a·(1 − t) + b·t",
        types: "numbers or vectors → the same",
        example: "mix(rgb(1, 0, 0), rgb(0, 0, 1), 0.25)",
    },
    Function {
        name: "clamp",
        form: "clamp(x, low, high)",
        about: "min(max(x, low), high)",
        types: "numbers or vectors → the same",
        example: "clamp(hit.curvature, -1.0, 1.0)",
    },
    Function {
        name: "saturate",
        form: "saturate(x)",
        about: "x within 0 … 1",
        types: "number or vector → the same, 0 … 1",
        example: "saturate(luminance(hit.irradiance))",
    },
    Function {
        name: "step",
        form: "step(edge, x)",
        about: "0 where x < edge, else 1",
        types: "numbers or vectors → the same, 0 or 1",
        example: "step(0.5, hit.uv.x)",
    },
    Function {
        name: "smoothstep",
        form: "smoothstep(low, high, x)",
        about: "0 below low, 1 above high, t·t·(3 − 2·t) between",
        types: "numbers or vectors → the same, 0 … 1",
        example: "smoothstep(0.2, 0.8, hit.uv.y)",
    },
    Function {
        name: "remap",
        form: "remap(x, from_low, from_high, to_low, to_high)",
        about: "x carried over linearly from one range to another, beyond the ends too",
        types: "numbers or vectors → the same",
        example: "remap(hit.depth, 1.0, 10.0, 4.0, 1.0)",
    },
    Function {
        name: "min",
        form: "min(a, b)",
        about: "b where b < a, else a",
        types: "numbers or vectors → the same",
        example: "min(hit.uv.x, hit.uv.y)",
    },
    Function {
        name: "max",
        form: "max(a, b)",
        about: "b where a < b, else a",
        types: "numbers or vectors → the same",
        example: "max(0.0, dot(hit.normal, -hit.incoming))",
    },
    Function {
        name: "abs",
        form: "abs(x)",
        about: "x without its sign",
        types: "number or vector → the same, 0 or more",
        example: "abs(hit.normal)",
    },
    Function {
        name: "sign",
        form: "sign(x)",
        about: "−1, 0 or 1",
        types: "number or vector → the same, −1, 0 or 1",
        example: "sign(hit.curvature)",
    },
    Function {
        name: "floor",
        form: "floor(x)",
        about: "the next whole number downwards, as a float",
        types: "number or vector → float or vector",
        example: "floor(hit.uv.x * 8.0)",
    },
    Function {
        name: "ceil",
        form: "ceil(x)",
        about: "the next whole number upwards, as a float",
        types: "number or vector → float or vector",
        example: "ceil(hit.uv.x * 8.0)",
    },
    Function {
        name: "round",
        form: "round(x)",
        about: "the nearest whole number, halves away from 0, as a float",
        types: "number or vector → float or vector",
        example: "round(hit.depth)",
    },
    Function {
        name: "fract",
        form: "fract(x)",
        about: "x − floor(x)",
        types: "number or vector → float or vector, 0 … 1",
        example: "fract(hit.uv.x * 8.0)",
    },
    Function {
        name: "mod",
        form: "mod(x, y)",
        about: "x − y·floor(x / y): has the sign of y, unlike x % y",
        types: "numbers or vectors → the same",
        example: "mod(hit.position.x, 2.0)",
    },
    Function {
        name: "sqrt",
        form: "sqrt(x)",
        about: "square root",
        types: "number or vector → float or vector; NaN below 0",
        example: "sqrt(2.0)",
    },
    Function {
        name: "pow",
        form: "pow(x, y)",
        about: "x to the power y, as a float",
        types: "numbers or vectors → float or vector",
        example: "pow(hit.uv.x, 2.2)",
    },
    Function {
        name: "exp",
        form: "exp(x)",
        about: "e to the power x",
        types: "number or vector → float or vector, 0 or more",
        example: "exp(-hit.distance)",
    },
    Function {
        name: "exp2",
        form: "exp2(x)",
        about: "2 to the power x",
        types: "number or vector → float or vector, 0 or more",
        example: "exp2(3.0)",
    },
    Function {
        name: "ln",
        form: "ln(x)",
        about: "natural logarithm",
        types: "number or vector → float or vector; NaN below 0",
        example: "ln(2.0)",
    },
    Function {
        name: "log",
        form: "log(x)",
        about: "logarithm to base 10",
        types: "number or vector → float or vector; NaN below 0",
        example: "log(1000.0)",
    },
    Function {
        name: "log",
        form: "log(x, base)",
        about: "ln(x) / ln(base)",
        types: "numbers or vectors → float or vector",
        example: "log(8.0, 2.0)",
    },
    Function {
        name: "log2",
        form: "log2(x)",
        about: "logarithm to base 2",
        types: "number or vector → float or vector; NaN below 0",
        example: "log2(8.0)",
    },
    Function {
        name: "sin",
        form: "sin(radians)",
        about: "sine",
        types: "number or vector → float or vector, −1 … 1",
        example: "sin(hit.uv.x * TAU)",
    },
    Function {
        name: "cos",
        form: "cos(radians)",
        about: "cosine",
        types: "number or vector → float or vector, −1 … 1",
        example: "cos(hit.uv.x * TAU)",
    },
    Function {
        name: "tan",
        form: "tan(radians)",
        about: "tangent",
        types: "number or vector → float or vector",
        example: "tan(PI / 4.0)",
    },
    Function {
        name: "asin",
        form: "asin(x)",
        about: "angle of a sine, in radians",
        types: "number or vector, −1 … 1 → float or vector, −π/2 … π/2",
        example: "asin(0.5)",
    },
    Function {
        name: "acos",
        form: "acos(x)",
        about: "angle of a cosine, in radians",
        types: "number or vector, −1 … 1 → float or vector, 0 … π",
        example: "acos(hit.normal.z * 0.99)",
    },
    Function {
        name: "atan",
        form: "atan(x)",
        about: "angle of a tangent, in radians",
        types: "number or vector → float or vector, −π/2 … π/2",
        example: "atan(1.0)",
    },
    Function {
        name: "atan",
        form: "atan(y, x)",
        about: "angle of the direction (x, y), −π … π",
        types: "numbers or vectors → float or vector, −π … π",
        example: "atan(hit.normal.z, hit.normal.x)",
    },
    Function {
        name: "sinh",
        form: "sinh(x)",
        about: "hyperbolic sine",
        types: "number or vector → float or vector",
        example: "sinh(1.0)",
    },
    Function {
        name: "cosh",
        form: "cosh(x)",
        about: "hyperbolic cosine",
        types: "number or vector → float or vector, 1 or more",
        example: "cosh(1.0)",
    },
    Function {
        name: "tanh",
        form: "tanh(x)",
        about: "hyperbolic tangent",
        types: "number or vector → float or vector, −1 … 1",
        example: "tanh(hit.curvature)",
    },
    Function {
        name: "radians",
        form: "radians(degrees)",
        about: "degrees · (π / 180)",
        types: "number or vector → float or vector",
        example: "radians(45)",
    },
    Function {
        name: "degrees",
        form: "degrees(radians)",
        about: "radians · (180 / π)",
        types: "number or vector → float or vector",
        example: "degrees(PI)",
    },
    Function {
        name: "is_nan",
        form: "is_nan(x)",
        about: "whether a float is no number",
        types: "float → true or false",
        example: "is_nan(sqrt(-1.0))",
    },
    Function {
        name: "to_int",
        form: "to_int(x)",
        about: "the whole part of a number, as an int",
        types: "number → int",
        example: "to_int(hit.uv.x * 8.0)",
    },
    Function {
        name: "to_float",
        form: "to_float(x)",
        about: "the nearest float of an int",
        types: "number → float",
        example: "to_float(hit.object_id)",
    },
];

/// Words that stand for numbers.
pub(in crate::shade) const CONSTANTS: [(&str, f32); 2] = [("PI", PI), ("TAU", TAU)];

/// `b` where `b < a`, else `a`: a NaN in `a` stays.
#[inline(always)]
pub(in crate::shade) fn min(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}

/// `b` where `a < b`, else `a`: a NaN in `a` stays.
#[inline(always)]
pub(in crate::shade) fn max(a: f32, b: f32) -> f32 {
    if a < b { b } else { a }
}

/// `min(max(x, low), high)`.
#[inline(always)]
pub(in crate::shade) fn clamp(x: f32, low: f32, high: f32) -> f32 {
    min(max(x, low), high)
}

/// `clamp(x, 0, 1)`.
#[inline(always)]
pub(in crate::shade) fn saturate(x: f32) -> f32 {
    clamp(x, 0.0, 1.0)
}

/// `a * (1 - t) + b * t`: exactly `a` at 0 and `b` at 1.
#[inline(always)]
pub(in crate::shade) fn mix(a: f32, b: f32, t: f32) -> f32 {
    a * (1.0 - t) + b * t
}

/// 0 where `x < edge`, else 1.
#[inline(always)]
pub(in crate::shade) fn step(edge: f32, x: f32) -> f32 {
    if x < edge { 0.0 } else { 1.0 }
}

/// With `t = saturate((x - low) / (high - low))`: `t * t * (3 - 2 * t)`. With `low = high` it is `step(low, x)`.
#[inline(always)]
pub(in crate::shade) fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    if low == high {
        return step(low, x);
    }
    let t = saturate((x - low) / (high - low));
    t * t * (3.0 - 2.0 * t)
}

/// `to_low + (x - from_low) / (from_high - from_low) * (to_high - to_low)`.
pub(super) fn remap(x: f32, from_low: f32, from_high: f32, to_low: f32, to_high: f32) -> f32 {
    to_low + (x - from_low) / (from_high - from_low) * (to_high - to_low)
}

/// -1, 0 or 1; a NaN stays.
#[inline(always)]
pub(in crate::shade) fn sign(x: f32) -> f32 {
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
pub(in crate::shade) fn fract(x: f32) -> f32 {
    x - x.floor()
}

/// `x - y * floor(x / y)`.
#[inline(always)]
pub(in crate::shade) fn floored_mod(x: f32, y: f32) -> f32 {
    x - y * (x / y).floor()
}

/// `x - y * floor(x / y)` in whole numbers; `None` where that has no value.
#[inline(always)]
pub(in crate::shade) fn floored_mod_ints(x: i64, y: i64) -> Option<i64> {
    let rest = x.checked_rem(y)?;
    Some(if rest != 0 && (rest < 0) != (y < 0) { rest + y } else { rest })
}

/// The whole part; `None` where that does not fit an int.
#[inline(always)]
pub(in crate::shade) fn to_int(x: f32) -> Option<i64> {
    // 2⁶³ as a float; every float below it fits.
    const END: f32 = 9_223_372_036_854_775_808.0;
    #[expect(clippy::cast_possible_truncation, reason = "checked to fit")]
    (-END..END).contains(&x).then_some(x as i64)
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
        floored_mod_ints(x, y).ok_or_else(|| Fault::new(format!("mod({x}, {y}) has no value")).into())
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
        match Operand::of(&x) {
            Some(Operand::Int(i)) => Ok(i),
            Some(Operand::Float(f)) => {
                to_int(f).ok_or_else(|| Fault::new(format!("to_int({f}) does not fit an int")).into())
            }
            _ => Err(refuse("to_int", &[x])),
        }
    });
}
