//! What functions do to bounds: those of the library, and of the script engine the few that shaders need.
//!
//! Bounds follow the formulas that the library documents at each function, operation by operation. Functions that are
//! not known here (a plug-in's) are taken to be pure: their result is unknown and depends on their arguments. Of the
//! engine's own functions those that change their first argument are listed.

use std::f32::consts::PI;

use rhai::Position;

use super::geometry;
use super::interval::Interval;
use super::operators;
use super::value::{Abstract, Shape, Vector};
use super::walk::{Flow, Walker};
use crate::shade::names::InputSet;

/// Functions of the script engine that change their first argument.
const MUTATING: [&str; 38] = [
    "append",
    "chop",
    "clear",
    "crop",
    "dedup",
    "drain",
    "extract",
    "fill_with",
    "for_each",
    "insert",
    "make_lower",
    "make_upper",
    "mixin",
    "order",
    "order_by",
    "order_desc",
    "pad",
    "pop",
    "push",
    "remove",
    "replace",
    "retain",
    "reverse",
    "set",
    "set_bit",
    "set_bits",
    "set_tag",
    "shift",
    "sort",
    "sort_by",
    "sort_desc",
    "splice",
    "split",
    "take",
    "trim",
    "truncate",
    "write_ascii",
    "write_utf8",
];

/// Functions that give an int if all arguments are ints. All others of numbers give a float.
const OF_INTS: [&str; 6] = ["min", "max", "clamp", "abs", "sign", "mod"];

impl Walker<'_> {
    /// A call of a function that the script does not define. Gives its value, and its first argument anew if the
    /// function may have changed it.
    pub(super) fn native_call(
        &mut self,
        name: &str,
        arguments: &[Abstract],
        position: Position,
    ) -> Flow<(Abstract, Option<Abstract>)> {
        self.step(position)?;
        if MUTATING.contains(&name) {
            return Ok(self.mutating_call(name, arguments));
        }
        let value = match arguments {
            [hit, texture] if hit.shape == Shape::Hit && name == "texture" => self.texture_at_hit(texture),
            [hit, index] if hit.shape == Shape::Hit && name == "light" => self.light(index),
            [hit, of, default] if hit.shape == Shape::Hit && name == "attribute" => {
                self.attribute(of, default, position)?
            }
            [text, _, ..] if name == "texture" && matches!(text.shape, Shape::Text(_)) => {
                self.named_texture(arguments, position)?
            }
            [texture, uv, width @ ..] if name == "texture" && width.len() < 2 => {
                let shape = self.texture_bounds(&texture.shape);
                let width: InputSet = width.iter().map(|width| self.escape(width)).collect();
                let inputs = self.escape(texture) | self.escape(uv) | width;
                self.value(shape, inputs)
            }
            [a, b] if operators::is_binary(name) => self.binary(name, a, b),
            _ if matches!(name, "print" | "debug") => self.unit(),
            _ => {
                let shapes: Vec<&Shape> = arguments.iter().map(|argument| &argument.shape).collect();
                let shape = match shapes.as_slice() {
                    [x] => operators::unary(name, x).or_else(|| library(name, &shapes)),
                    _ => library(name, &shapes),
                };
                let inputs = arguments.iter().map(|argument| self.escape(argument)).collect();
                self.value(shape.unwrap_or(Shape::Unknown), inputs)
            }
        };
        Ok((value, None))
    }

    fn mutating_call(&mut self, name: &str, arguments: &[Abstract]) -> (Abstract, Option<Abstract>) {
        if let ("mixin", [a, b]) = (name, arguments)
            && let (Shape::Record(x), Shape::Record(y)) = (&a.shape, &b.shape)
        {
            let merged = self.merged(x, y);
            return (self.unit(), Some(merged));
        }
        (self.unknown(arguments), Some(self.unknown(arguments)))
    }
}

/// Type and bounds of a function's result; `None` if nothing is known of it.
pub(super) fn library(name: &str, arguments: &[&Shape]) -> Option<Shape> {
    constructor(name, arguments)
        .or_else(|| integer(name, arguments))
        .or_else(|| channelwise(name, arguments))
        .or_else(|| geometry::library(name, arguments))
        .or_else(|| pattern(name, arguments))
        .or_else(|| conversion(name, arguments))
}

/// Vectors and colors from numbers and vectors.
fn constructor(name: &str, arguments: &[&Shape]) -> Option<Shape> {
    let (count, is_color) = match name {
        "vec2" => (2, false),
        "vec3" => (3, false),
        "vec4" => (4, false),
        "rgb" | "gray" => (3, true),
        _ => return None,
    };
    let mut channels = Vec::new();
    for argument in arguments {
        match argument {
            Shape::Vector(vector) if !is_color => channels.extend_from_slice(&vector.channels),
            other => channels.push(other.number()?),
        }
    }
    match (arguments, channels.as_slice()) {
        (_, [x]) if name != "rgb" => Some(Shape::Vector(Vector::new(vec![*x; count]))),
        // The start of a longer vector.
        ([_], longer) if longer.len() >= count => Some(Shape::Vector(Vector::new(longer[..count].to_vec()))),
        (_, all) if all.len() == count => Some(Shape::Vector(Vector::new(channels))),
        _ => None,
    }
}

/// Functions of ints that give an int.
fn integer(name: &str, arguments: &[&Shape]) -> Option<Shape> {
    if !OF_INTS.contains(&name) {
        return None;
    }
    let bounds = arguments.iter().map(|shape| match shape {
        Shape::Int(low, high) => Some((*low, *high)),
        _ => None,
    });
    let bounds = bounds.collect::<Option<Vec<_>>>()?;
    let (low, high) = match (name, bounds.as_slice()) {
        ("min", [a, b]) => (a.0.min(b.0), a.1.min(b.1)),
        ("max", [a, b]) => (a.0.max(b.0), a.1.max(b.1)),
        ("clamp", [x, low, high]) => (x.0.max(low.0).min(high.0), x.1.max(low.1).min(high.1)),
        ("abs", [x]) if x.0 >= 0 => *x,
        ("abs", [x]) => (0, x.0.saturating_neg().max(x.1)),
        ("sign", [x]) => (x.0.signum(), x.1.signum()),
        _ => (i64::MIN, i64::MAX),
    };
    Some(Shape::Int(low, high))
}

/// Functions of each channel alone; a number beside vectors counts for all their channels.
fn channelwise(name: &str, arguments: &[&Shape]) -> Option<Shape> {
    let vector = arguments.iter().find_map(|shape| match shape {
        Shape::Vector(vector) => Some(vector.channels.len()),
        _ => None,
    });
    let of_channel = |channel: usize| {
        let bounds = arguments.iter().map(|shape| match shape {
            Shape::Vector(vector) => vector.channels.get(channel).copied(),
            other => other.number(),
        });
        scalar(name, &bounds.collect::<Option<Vec<_>>>()?)
    };
    match vector {
        Some(count) => Some(Shape::Vector(Vector::new((0..count).map(of_channel).collect::<Option<Vec<_>>>()?))),
        // Whether it is an int hangs on arguments that may be ints.
        None if OF_INTS.contains(&name) && !arguments.iter().any(|shape| matches!(shape, Shape::Float(_))) => None,
        None => Some(Shape::Float(of_channel(0)?)),
    }
}

/// The greatest angle that an inverse function gives, with room for its error.
const HALF_TURN: f32 = PI * 1.000_001;

fn scalar(name: &str, arguments: &[Interval]) -> Option<Interval> {
    Some(match (name, arguments) {
        ("abs", [x]) => x.abs(),
        ("sign", [x]) => {
            let sign = |x: f32| if x == 0.0 { x } else { x.signum() };
            x.rising(sign)
        }
        ("floor", [x]) => x.rising(f32::floor),
        ("ceil", [x]) => x.rising(f32::ceil),
        ("round", [x]) => x.rising(f32::round),
        ("fract", [x]) => Interval::UNIT.or_nan(!x.is_finite()),
        ("saturate", [x]) => x.clamp(Interval::exact(0.0), Interval::exact(1.0)),
        ("sqrt", [x]) => x.sqrt(),
        ("exp" | "exp2", [x]) => {
            let bounds = x.rising_roughly(if name == "exp" { f64::exp } else { f64::exp2 });
            Interval::new(bounds.low.max(0.0), bounds.high).or_nan(bounds.nan)
        }
        ("ln" | "log" | "log2", [x]) if x.low >= 0.0 => x.rising_roughly(match name {
            "log2" => f64::log2,
            "log" => f64::log10,
            _ => f64::ln,
        }),
        ("sin" | "cos", [x]) => Interval::within(1.0).or_nan(!x.is_finite()),
        ("tanh", [x]) => Interval::within(1.0).or_nan(x.nan),
        ("atan", [x]) => Interval::within(HALF_TURN / 2.0).or_nan(x.nan),
        ("atan", [y, x]) => Interval::within(HALF_TURN).or_nan(x.nan || y.nan),
        ("acos", [x]) if x.low >= -1.0 && x.high <= 1.0 => Interval::new(0.0, HALF_TURN).or_nan(x.nan),
        ("asin", [x]) if x.low >= -1.0 && x.high <= 1.0 => Interval::within(HALF_TURN / 2.0).or_nan(x.nan),
        ("tan" | "acos" | "asin" | "sinh" | "cosh" | "ln" | "log" | "log2", [_]) | ("log", [_, _]) => Interval::ANY,
        ("radians", [x]) => x.mul(Interval::exact(PI / 180.0)),
        ("degrees", [x]) => x.mul(Interval::exact(180.0 / PI)),
        ("min", [a, b]) => a.min(*b),
        ("max", [a, b]) => a.max(*b),
        ("mod", [x, y]) => modulo(*x, *y),
        ("pow", [x, y]) => x.pow(*y),
        ("step", [edge, x]) => step(*edge, *x),
        ("clamp", [x, low, high]) => x.clamp(*low, *high),
        ("mix", [a, b, t]) => a.mix(*b, *t),
        ("smoothstep", [low, high, x]) => smoothstep(*low, *high, *x),
        ("remap", [x, from_low, from_high, to_low, to_high]) => {
            to_low.add(x.sub(*from_low).div(from_high.sub(*from_low)).mul(to_high.sub(*to_low)))
        }
        _ => return None,
    })
}

/// `x - y * floor(x / y)`: from 0 to `y`, but for rounding.
fn modulo(x: Interval, y: Interval) -> Interval {
    if !x.div(y).is_finite() || !x.is_finite() || !y.is_finite() {
        return Interval::ANY;
    }
    let between = Interval::exact(0.0).hull(y);
    between.widened(x.size().max(y.size()))
}

fn step(edge: Interval, x: Interval) -> Interval {
    match (x.nan || edge.nan, x.low >= edge.high, x.high < edge.low) {
        (false, true, _) => Interval::exact(1.0),
        (false, _, true) => Interval::exact(0.0),
        _ => Interval::UNIT,
    }
}

/// `t * t * (3 - 2 * t)` of a `t` within 0 … 1, which never leaves 0 … 1 (a test tries all `t` near 1).
fn smoothstep(low: Interval, high: Interval, x: Interval) -> Interval {
    let defined = low.is_finite() && high.is_finite() && high.sub(low).is_finite() && !x.nan;
    let rises = defined && low.high < high.low;
    match (rises, x.high <= low.low, x.low >= high.high) {
        (true, true, _) => Interval::exact(0.0),
        (true, _, true) => Interval::exact(1.0),
        _ => Interval::UNIT.or_nan(!defined),
    }
}

/// Colors, ramps and noise.
fn pattern(name: &str, arguments: &[&Shape]) -> Option<Shape> {
    let number = |shape: &Shape| shape.number().unwrap_or(Interval::ANY);
    let has_nan = arguments.iter().any(|shape| shape.range().is_none_or(|range| range.nan));
    let color = |channel| Some(Shape::Vector(Vector::new([channel; 3])));
    match (name, arguments) {
        ("hash", [_]) => Some(Shape::Float(Interval::UNIT)),
        ("hash_color", [_]) => color(Interval::UNIT),
        ("value_noise" | "cell_id", [_]) => Some(Shape::Float(Interval::UNIT.or_nan(has_nan))),
        ("gradient_noise", [_]) => Some(Shape::Float(Interval::within(1.0).or_nan(has_nan))),
        ("worley", [_]) => {
            let distances = [Interval::new(0.0, 1.5), Interval::new(0.0, 2.0)];
            Some(Shape::Vector(Vector::new(distances.map(|distance| distance.or_nan(has_nan)))))
        }
        ("stripes", [_, _] | [_, _, _])
        | ("checker", [_] | [_, _])
        | ("dots" | "hatch" | "cross_hatch", [_, _] | [_, _, _]) => {
            // Sums of what is not huge do not overflow.
            let is_tame = arguments.iter().all(|shape| shape.range().is_some_and(|range| range.size() < 1e30));
            Some(Shape::Float(Interval::UNIT.or_nan(has_nan || !is_tame)))
        }
        ("rotate", [Shape::Vector(v), angle]) if v.channels.len() == 2 => {
            let length = v.length * 1.000_01;
            let is_tame = !has_nan && length < 1e30 && angle.number()?.is_finite();
            let channel = if is_tame { Interval::within(length) } else { Interval::ANY };
            Some(Shape::Vector(Vector::new([channel; 2])))
        }
        ("hsl", [hue, saturation, lightness]) => {
            let (h, s, l) = (number(hue), number(saturation), number(lightness));
            let unit = |x: Interval| x.low >= 0.0 && x.high <= 1.0;
            let is_color = !has_nan && h.size() < 1e30 && unit(s) && unit(l);
            color(if is_color { Interval::new(-1e-6, 1.000_001) } else { Interval::ANY })
        }
        ("srgb_from_rgb", [_]) => color(Interval::new(0.0, 1.000_001).or_nan(has_nan)),
        ("temperature", [_]) => color(Interval::UNIT.or_nan(has_nan)),
        ("hsl_from_rgb" | "oklab" | "oklab_from_rgb" | "oklch" | "oklch_from_rgb" | "mix_oklab", _) => {
            color(Interval::ANY)
        }
        ("fbm", [point, _, _, _]) => {
            let nan = point.range().is_none_or(|range| range.nan || range.size() > 1e30);
            Some(Shape::Float(Interval::within(1.0).or_nan(nan)))
        }
        ("fbm", [point, _]) => {
            let nan = point.range().is_none_or(|range| range.nan);
            Some(Shape::Float(Interval::within(1.0).or_nan(nan)))
        }
        ("cellular_noise", [_]) => Some(Shape::Float(Interval::new(0.0, 1.5).or_nan(has_nan))),
        ("hsv", [hue, saturation, value]) => {
            let (h, s, v) = (number(hue), number(saturation), number(value));
            let is_color = !has_nan && h.size() < 1e30 && s.low >= 0.0 && s.high <= 1.0 && v.low >= 0.0;
            // What is subtracted from the value is a share of it.
            color(if is_color && v.is_finite() { Interval::new(0.0, v.high) } else { Interval::ANY })
        }
        ("srgb" | "hsv_from_rgb", _) => color(Interval::ANY),
        ("ramp", [t, Shape::Array(stops), kind @ ..]) if t.is_number() => {
            let constant = matches!(kind, [Shape::Text(Some(kind))] if &**kind == "constant");
            ramp(stops, constant)
        }
        _ => None,
    }
}

/// A mean of two neighbouring stops, or one of them (always so if `constant`); each stop is a position and a value.
fn ramp(stops: &[Abstract], constant: bool) -> Option<Shape> {
    let mut values = Vec::new();
    let mut positions_are_finite = true;
    for stop in stops {
        let Shape::Array(parts) = &stop.shape else { return None };
        let [position, value] = parts.as_slice() else { return None };
        positions_are_finite &= position.shape.number()?.is_finite();
        values.push(match &value.shape {
            Shape::Vector(vector) => vector.clone(),
            other => Vector::new([other.number()?]),
        });
    }
    let (first, last) = (values.first()?, values.last()?);
    if values.iter().any(|value| value.channels.len() != first.channels.len()) {
        return None;
    }
    let channel = |i: usize| {
        let ends = first.channels[i].hull(last.channels[i]);
        let means = values.windows(2).map(|pair| {
            let (from, to) = (pair[0].channels[i], pair[1].channels[i]);
            if constant { from.hull(to) } else { from.mix(to, Interval::UNIT) }
        });
        let hull = means.fold(ends, Interval::hull);
        if positions_are_finite && values.iter().all(|v| v.channels[i].is_finite()) { hull } else { Interval::ANY }
    };
    let channels: Vec<Interval> = (0..first.channels.len()).map(channel).collect();
    Some(match channels.as_slice() {
        [x] => Shape::Float(*x),
        _ => Shape::Vector(Vector::new(channels)),
    })
}

/// Functions between types.
fn conversion(name: &str, arguments: &[&Shape]) -> Option<Shape> {
    Some(match (name, arguments) {
        ("to_float", [x]) => Shape::Float(x.number()?),
        ("to_int", [x @ Shape::Int(..)]) => (*x).clone(),
        // What does not fit ends the script with an error; `as` stays within the type's bounds.
        ("to_int", [Shape::Float(x)]) => Shape::Int(x.low as i64, x.high as i64),
        ("is_nan" | "is_empty" | "is_odd" | "is_even" | "is_zero" | "contains", _) => Shape::Bool(None),
        ("to_string" | "to_debug" | "type_of", _) => Shape::Text(None),
        ("len", [Shape::Array(items)]) => {
            let length = i64::try_from(items.len()).ok()?;
            Shape::Int(length, length)
        }
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    #[test]
    fn smoothstep_stays_within_its_ends() {
        // Rounding matters only where t·t·(3 − 2·t) is within 1e-6 of 1.
        let mut t = 0.999_f32;
        while t <= 1.0 {
            assert!(t * t * (3.0 - 2.0 * t) <= 1.0, "{t:?}");
            t = t.next_up();
        }
    }
}
