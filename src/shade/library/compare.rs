//! Comparisons and powers of numbers, in place of Rhai's own.
//!
//! Rhai's built-in operators call floats equal that differ in the last bit or are both below 1e-7, find no float above
//! or below another that near, and take `**` from the C library. Here floats compare exactly as IEEE 754 says (a NaN is
//! neither equal, less nor greater), an int counts as the nearest float, and `**` is the library's `pow`.
//! Ints compared with ints, and int ** int, stay Rhai's: exact, and an error where the result does not fit.

#![expect(clippy::cast_precision_loss, reason = "an int counts as the nearest float")]

use rhai::Engine;

use crate::math::portable;

pub(super) fn register(engine: &mut Engine) {
    macro_rules! numbers {
        ($($name:literal = $f:expr;)*) => { $(
            engine.register_fn($name, |a: f32, b: f32| $f(a, b));
            engine.register_fn($name, |a: f32, b: i64| $f(a, b as f32));
            engine.register_fn($name, |a: i64, b: f32| $f(a as f32, b));
        )* };
    }
    numbers! {
        "==" = |a: f32, b: f32| a == b;
        "!=" = |a: f32, b: f32| a != b;
        "<" = |a: f32, b: f32| a < b;
        "<=" = |a: f32, b: f32| a <= b;
        ">" = |a: f32, b: f32| a > b;
        ">=" = |a: f32, b: f32| a >= b;
        "**" = portable::pow;
    }
    engine.register_fn("**=", |a: &mut f32, b: f32| *a = portable::pow(*a, b));
    engine.register_fn("**=", |a: &mut f32, b: i64| *a = portable::pow(*a, b as f32));
}
