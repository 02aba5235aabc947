//! The functions that scripts may call.
//!
//! Each file owns one subject: what it registers with the engine, and the list of its functions for messages and
//! reference pages. What reaches a picture is computed by plain `f32` functions whose formulas, and the order of the
//! operations in them, are part of the contract: a kernel that does the same steps gives the same bits.
//!
//! Wherever a number is expected, a script may write `1` or `1.0`; an int counts as the nearest float.

pub mod batch;
pub(in crate::shade) mod color;
mod compare;
pub(in crate::shade) mod fractal;
pub(in crate::shade) mod hash;
pub(in crate::shade) mod hit;
pub(in crate::shade) mod math;
pub(in crate::shade) mod noise;
mod operand;
mod parameters;
pub(in crate::shade) mod pattern;
mod ramp;
mod swizzle;
mod texture;
mod vectors;

use std::collections::BTreeSet;
use std::sync::Arc;

use rhai::Engine;

use crate::scene::texture::Texture;

pub(super) use hit::{ATTRIBUTE_TYPES, Hit, mistyped_attribute};
pub(super) use math::CONSTANTS;
pub(super) use operand::kind;
pub(super) use parameters::ParameterRecord;
pub(super) use texture::{texture_name, texture_of, unwritten_path};

/// A function of the library, for messages and reference pages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Function<'a> {
    /// Its name.
    pub name: &'a str,
    /// How it is called.
    pub form: &'a str,
    /// What it gives.
    pub about: &'a str,
    /// Types and ranges of what it takes, `→`, type and range of what it gives.
    pub types: &'a str,
    /// An expression in a `surface(hit, p)` that uses it; a number, a vec3, an int, or true or false.
    pub example: &'a str,
}

/// All functions of the library, by subject.
pub fn functions() -> impl Iterator<Item = Function<'static>> + Clone {
    [
        vectors::FUNCTIONS,
        math::FUNCTIONS,
        color::FUNCTIONS,
        ramp::FUNCTIONS,
        noise::FUNCTIONS,
        fractal::FUNCTIONS,
        pattern::FUNCTIONS,
        hash::FUNCTIONS,
        texture::FUNCTIONS,
        hit::FUNCTIONS,
    ]
    .into_iter()
    .flatten()
    .copied()
}

/// Registers the library. `names` are the parameters that scripts may ask of `p`.
/// `textures` are the scene's.
pub(super) fn register(engine: &mut Engine, names: &BTreeSet<String>, textures: &[Arc<Texture>]) {
    compare::register(engine);
    vectors::register(engine);
    swizzle::register(engine);
    math::register(engine);
    color::register(engine);
    ramp::register(engine);
    noise::register(engine);
    fractal::register(engine);
    pattern::register(engine);
    hash::register(engine);
    texture::register(engine, textures);
    hit::register(engine);
    parameters::register(engine, names);
}
