//! The parameters of a material, resolved: what its script's `params()` returns, with the material's own values put in.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::math::{Vec2, Vec3, Vec4};
use crate::scene::texture::TextureRef;

/// A value that a parameter can have.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// `()`: nothing; the default of a texture.
    Unit,
    /// `true` or `false`.
    Bool(bool),
    /// A whole number.
    Int(i64),
    /// A number.
    Float(f32),
    /// Two numbers.
    Vec2(Vec2),
    /// Three numbers: a vector or a linear colour.
    Vec3(Vec3),
    /// Four numbers.
    Vec4(Vec4),
    /// A text.
    Text(String),
    /// A use of a texture.
    Texture(TextureRef),
    /// An object map, for structured defaults such as palettes.
    Record(BTreeMap<String, Value>),
    /// An array, for instance the stops of a ramp.
    Array(Vec<Value>),
}

/// The parameters of one material by name. Cheap to clone.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Params(pub Arc<BTreeMap<String, Value>>);
