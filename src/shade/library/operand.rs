//! Arguments that may be an int, a float or a vector.

use rhai::{Dynamic, Engine, EvalAltResult};

use super::functions;
use crate::math::{Vec2, Vec3, Vec4};
use crate::shade::fault::{Fault, type_name};

/// What a library function returns.
pub(super) type Outcome<T = Dynamic> = Result<T, Box<EvalAltResult>>;

/// A number or a vector.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Operand {
    Int(i64),
    Float(f32),
    Vec2(Vec2),
    Vec3(Vec3),
    Vec4(Vec4),
}

impl Operand {
    /// The operand in a script's value, if it is a number or a vector.
    pub fn of(value: &Dynamic) -> Option<Self> {
        if let Ok(x) = value.as_float() {
            return Some(Self::Float(x));
        }
        if let Ok(x) = value.as_int() {
            return Some(Self::Int(x));
        }
        if let Some(v) = value.read_lock::<Vec3>() {
            return Some(Self::Vec3(*v));
        }
        if let Some(v) = value.read_lock::<Vec2>() {
            return Some(Self::Vec2(*v));
        }
        value.read_lock::<Vec4>().map(|v| Self::Vec4(*v))
    }

    /// The script's value with the given components.
    pub fn build(width: usize, at: impl Fn(usize) -> f32) -> Dynamic {
        match width {
            1 => Dynamic::from_float(at(0)),
            2 => Dynamic::from(Vec2::new(at(0), at(1))),
            3 => Dynamic::from(Vec3::new(at(0), at(1), at(2))),
            _ => Dynamic::from(Vec4::new(at(0), at(1), at(2), at(3))),
        }
    }

    /// Components: 1 for a number.
    pub fn width(self) -> usize {
        match self {
            Self::Int(_) | Self::Float(_) => 1,
            Self::Vec2(_) => 2,
            Self::Vec3(_) => 3,
            Self::Vec4(_) => 4,
        }
    }

    /// A component; a number has the same at every place.
    #[expect(clippy::cast_precision_loss, reason = "an int counts as the nearest float")]
    pub fn lane(self, index: usize) -> f32 {
        match self {
            Self::Int(x) => x as f32,
            Self::Float(x) => x,
            Self::Vec2(v) => v[index],
            Self::Vec3(v) => v[index],
            Self::Vec4(v) => v[index],
        }
    }
}

/// The error of a library function that was given what it cannot take.
pub(super) fn refuse(name: &str, arguments: &[Dynamic]) -> Box<EvalAltResult> {
    let types: Vec<_> = arguments.iter().map(kind).collect();
    let fault = Fault::new(format!("`{name}` cannot be called with ({})", types.join(", ")));
    functions()
        .filter(|known| known.name == name)
        .fold(fault, |fault, known| fault.hint(format!("it is called as `{}`: {}", known.form, known.about)))
        .into()
}

/// How messages call the type of a value.
pub(in crate::shade) fn kind(value: &Dynamic) -> String {
    if value.is::<Vec2>() {
        "vec2".to_owned()
    } else if value.is::<Vec3>() {
        "vec3".to_owned()
    } else if value.is::<Vec4>() {
        "vec4".to_owned()
    } else if value.is::<super::Hit>() {
        "hit".to_owned()
    } else if value.is::<super::ParameterRecord>() {
        "parameters".to_owned()
    } else if value.is::<super::texture::TextureHandle>() {
        "texture".to_owned()
    } else if value.is::<super::hit::Light>() {
        "light".to_owned()
    } else {
        type_name(value.type_name())
    }
}

/// A number, or the error that `name` takes none such.
pub(super) fn number(name: &str, value: &Dynamic) -> Outcome<f32> {
    match Operand::of(value) {
        Some(operand) if operand.width() == 1 => Ok(operand.lane(0)),
        _ => Err(refuse(name, std::slice::from_ref(value))),
    }
}

/// Applies `f` to each component. Numbers join vectors of any size; vectors must be of one size.
pub(super) fn lanewise<const N: usize>(name: &str, arguments: [Dynamic; N], f: impl Fn([f32; N]) -> f32) -> Outcome {
    let mut operands = [Operand::Float(0.0); N];
    let mut width = 1;
    for (operand, argument) in operands.iter_mut().zip(&arguments) {
        match Operand::of(argument) {
            Some(found) if found.width() == 1 || width == 1 || found.width() == width => {
                *operand = found;
                width = width.max(found.width());
            }
            _ => return Err(refuse(name, &arguments)),
        }
    }
    Ok(Operand::build(width, |index| f(operands.map(|operand| operand.lane(index)))))
}

/// Registers a function of one argument that works on each component.
pub(super) fn unary(engine: &mut Engine, name: &'static str, f: fn(f32) -> f32) {
    engine.register_fn(name, move |x: f32| f(x));
    engine.register_fn(name, move |x: Dynamic| lanewise(name, [x], |[x]| f(x)));
}

/// Registers a function of two arguments that works on each component.
pub(super) fn binary(engine: &mut Engine, name: &'static str, f: fn(f32, f32) -> f32) {
    engine.register_fn(name, move |x: f32, y: f32| f(x, y));
    // Not left to the general form: Rhai brings a `min` and a `max` of its own for these types, which lose NaN.
    engine.register_fn(name, move |x: f32, y: i64| f(x, y as f32));
    engine.register_fn(name, move |x: i64, y: f32| f(x as f32, y));
    engine.register_fn(name, move |x: Dynamic, y: Dynamic| lanewise(name, [x, y], |[x, y]| f(x, y)));
}

/// Registers a function of three arguments that works on each component.
pub(super) fn ternary(engine: &mut Engine, name: &'static str, f: fn(f32, f32, f32) -> f32) {
    engine.register_fn(name, move |x: f32, y: f32, z: f32| f(x, y, z));
    engine
        .register_fn(name, move |x: Dynamic, y: Dynamic, z: Dynamic| lanewise(name, [x, y, z], |[x, y, z]| f(x, y, z)));
}
