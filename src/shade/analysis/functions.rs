//! What functions do to bounds: the library's and the script engine's own.
//!
//! Functions that are not known here (a plug-in's) are taken to be pure: their result is unknown and depends on their
//! arguments. Of the engine's own functions those that change their first argument are listed.

use rhai::Position;

use super::interval::Interval;
use super::operators;
use super::value::{Abstract, Shape, Vector, mixed_number};
use super::walk::{Flow, Walker};

/// Functions of the script engine that change their first argument.
const MUTATING: [&str; 40] = [
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
    "write_be",
    "write_le",
    "write_utf8",
];

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
            [texture, uv] if name == "texture" => {
                let shape = self.texture_bounds(&texture.shape);
                let inputs = self.escape(texture) | self.escape(uv);
                self.value(shape, inputs)
            }
            [x] if operators::unary(name, &x.shape).is_some() => {
                let shape = operators::unary(name, &x.shape).unwrap_or(Shape::Unknown);
                self.value(shape, x.all_inputs())
            }
            [a, b] if !name.starts_with(|c: char| c.is_alphabetic()) => self.binary(name, a, b),
            _ if matches!(name, "print" | "debug") => self.unit(),
            _ => {
                let shapes: Vec<&Shape> = arguments.iter().map(|argument| &argument.shape).collect();
                let inputs = self.unknown(arguments).inputs;
                self.value(library(name, &shapes).unwrap_or(Shape::Unknown), inputs)
            }
        };
        Ok((value, None))
    }

    fn mutating_call(&mut self, name: &str, arguments: &[Abstract]) -> (Abstract, Option<Abstract>) {
        if let ("mixin", [a, b]) = (name, arguments)
            && let (Shape::Record(x), Shape::Record(y)) = (&a.shape, &b.shape)
            && let Some(shape) = operators::merged(x, y)
        {
            let merged = self.value(shape, a.inputs | b.inputs);
            return (self.unit(), Some(merged));
        }
        (self.unknown(arguments), Some(self.unknown(arguments)))
    }
}

/// Type and bounds of a function's result; `None` if nothing is known of it.
pub(super) fn library(name: &str, arguments: &[&Shape]) -> Option<Shape> {
    constructor(name, arguments)
        .or_else(|| channelwise(name, arguments))
        .or_else(|| geometric(name, arguments))
        .or_else(|| pattern(name, arguments))
        .or_else(|| conversion(name, arguments))
}

/// Vectors and colors from numbers and vectors.
fn constructor(name: &str, arguments: &[&Shape]) -> Option<Shape> {
    let count = match name {
        "vec2" => 2,
        "vec3" | "rgb" | "gray" => 3,
        "vec4" => 4,
        _ => return None,
    };
    let mut channels = Vec::new();
    for argument in arguments {
        match argument {
            Shape::Vector(vector) => channels.extend_from_slice(&vector.channels),
            other => channels.push(other.number()?),
        }
    }
    match (name, channels.as_slice()) {
        // One number may be a packed color.
        ("rgb", [_]) => None,
        (_, [x]) => Some(Shape::Vector(Vector::new(vec![*x; count]))),
        _ if channels.len() == count => Some(Shape::Vector(Vector::new(channels))),
        _ => None,
    }
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
        None => {
            let bounds = of_channel(0)?;
            let is_float = arguments.iter().any(|shape| matches!(shape, Shape::Float(_)));
            Some(if is_float || arguments.is_empty() { Shape::Float(bounds) } else { mixed_number(bounds) })
        }
    }
}

fn scalar(name: &str, arguments: &[Interval]) -> Option<Interval> {
    Some(match (name, arguments) {
        ("PI", []) => Interval::exact(std::f32::consts::PI),
        ("E", []) => Interval::exact(std::f32::consts::E),
        ("abs", [x]) => x.abs(),
        ("sign", [x]) => sign(*x),
        ("floor", [x]) => x.rising(f32::floor),
        ("ceil" | "ceiling", [x]) => x.rising(f32::ceil),
        ("round", [x]) => x.rising(f32::round),
        ("trunc" | "int", [x]) => x.rising(f32::trunc),
        ("fract" | "fraction", [x]) => {
            let least = if x.low >= 0.0 { 0.0 } else { -1.0 };
            Interval::new(least, 1.0).or_nan(!x.is_finite())
        }
        ("saturate", [x]) => x.clamp(Interval::exact(0.0), Interval::exact(1.0)),
        ("sqrt", [x]) => x.sqrt(),
        ("exp", [x]) => {
            let bounds = x.rising_roughly(f64::exp);
            Interval { low: bounds.low.max(0.0), ..bounds }
        }
        ("ln" | "log" | "log2" | "log10", [x]) if x.low >= 0.0 => x.rising_roughly(match name {
            "log2" => f64::log2,
            "log10" | "log" => f64::log10,
            _ => f64::ln,
        }),
        ("sin" | "cos", [x]) => Interval::within(1.0).or_nan(!x.is_finite()),
        ("tanh", [x]) => Interval::within(1.0).or_nan(x.nan),
        ("atan", [x]) => Interval::within(1.571).or_nan(x.nan),
        ("atan" | "atan2", [y, x]) => Interval::within(3.142).or_nan(x.nan || y.nan),
        ("acos", [x]) if x.low >= -1.0 && x.high <= 1.0 => Interval::new(0.0, 3.142).or_nan(x.nan),
        ("asin", [x]) if x.low >= -1.0 && x.high <= 1.0 => Interval::within(1.571).or_nan(x.nan),
        ("tan" | "acos" | "asin" | "sinh" | "cosh" | "ln" | "log" | "log2" | "log10", [_]) => Interval::ANY,
        ("min", [a, b]) => a.min(*b),
        ("max", [a, b]) => a.max(*b),
        ("mod", [a, b]) => modulo(*a, *b),
        ("pow", [x, y]) => x.pow(*y),
        ("step", [edge, x]) => step(*edge, *x),
        ("clamp", [x, low, high]) => x.clamp(*low, *high),
        ("mix" | "lerp", [a, b, t]) => a.mix(*b, *t),
        ("smoothstep", [from, to, x]) => smoothstep(*from, *to, *x),
        ("remap", [x, from, to, new_from, new_to]) => remap(*x, [*from, *to], [*new_from, *new_to]),
        _ => return None,
    })
}

fn sign(x: Interval) -> Interval {
    let bounds = match (x.low > 0.0, x.high < 0.0) {
        (true, _) => Interval::exact(1.0),
        (_, true) => Interval::exact(-1.0),
        _ => Interval::within(1.0),
    };
    bounds.or_nan(x.nan)
}

/// The remainder with the sign of the divisor, or with that of the dividend.
fn modulo(a: Interval, b: Interval) -> Interval {
    let size = b.size();
    let least = if a.low >= 0.0 && b.low >= 0.0 { 0.0 } else { -size };
    let nan = a.nan || b.nan || b.has_zero() || !a.is_finite() || !b.is_finite();
    Interval::new(least, size).widened(a.size().max(size)).or_nan(nan)
}

fn step(edge: Interval, x: Interval) -> Interval {
    match (x.nan || edge.nan, x.low >= edge.high, x.high < edge.low) {
        (false, true, _) => Interval::exact(1.0),
        (false, _, true) => Interval::exact(0.0),
        _ => Interval::UNIT,
    }
}

fn smoothstep(from: Interval, to: Interval, x: Interval) -> Interval {
    let rises = from.high < to.low;
    let finite = from.is_finite() && to.is_finite() && !x.nan;
    match (rises && finite, x.high <= from.low, x.low >= to.high) {
        (true, true, _) => Interval::exact(0.0),
        (true, _, true) => Interval::exact(1.0),
        (true, ..) => Interval::UNIT,
        _ => Interval::UNIT.or_nan(true),
    }
}

fn remap(x: Interval, from: [Interval; 2], to: [Interval; 2]) -> Interval {
    let t = x.sub(from[0]).div(from[1].sub(from[0]));
    let free = to[0].mix(to[1], t);
    let clamped = to[0].mix(to[1], t.clamp(Interval::exact(0.0), Interval::exact(1.0)));
    let either = free.hull(clamped);
    either.widened(either.size())
}

/// Functions of whole vectors.
fn geometric(name: &str, arguments: &[&Shape]) -> Option<Shape> {
    let vectors: Option<Vec<&Vector>> = arguments
        .iter()
        .map(|shape| match shape {
            Shape::Vector(vector) => Some(vector),
            _ => None,
        })
        .collect();
    let vectors = vectors?;
    Some(match (name, vectors.as_slice()) {
        ("length", [v]) => Shape::Float(length(v)),
        ("distance", [a, b]) if a.channels.len() == b.channels.len() => {
            let between = a.channels.iter().zip(&b.channels).map(|(a, b)| a.sub(*b));
            Shape::Float(length(&Vector::new(between)))
        }
        ("normalize", [v]) => {
            let length = length(v);
            let unit = Vector::unit(v.channels.len());
            let nan = length.nan || length.low <= 0.0 || length.high == f32::INFINITY;
            Shape::Vector(Vector { channels: unit.channels.iter().map(|c| c.or_nan(nan)).collect(), ..unit })
        }
        ("dot", [a, b]) if a.channels.len() == b.channels.len() => Shape::Float(dot(a, b)),
        ("cross", [a, b]) if a.channels.len() == 3 && b.channels.len() == 3 => {
            let term = |i: usize, j: usize| {
                let (x, y) = (a.channels[i].mul(b.channels[j]), a.channels[j].mul(b.channels[i]));
                x.sub(y).widened(x.size().max(y.size()))
            };
            let limit = slightly_more(a.length * b.length);
            Shape::Vector(Vector::new([term(1, 2), term(2, 0), term(0, 1)]).at_most(limit))
        }
        ("reflect", [v, normal]) if v.channels.len() == normal.channels.len() => {
            let nan = v.channels.iter().chain(&normal.channels).any(|c| !c.is_finite());
            if nan || slightly_more(normal.length) > 1.1 || v.length > 1e18 {
                return Some(Shape::Vector(Vector::new(vec![Interval::ANY; v.channels.len()])));
            }
            // Along the normal the vector is scaled by 1 − 2 |n|², across it not at all.
            let growth = (2.0 * normal.length * normal.length - 1.0).max(1.0);
            let size = slightly_more(v.length * growth);
            Shape::Vector(Vector::new(vec![Interval::within(size); v.channels.len()]).at_most(size))
        }
        ("luminance", [color]) if color.channels.len() >= 3 => {
            let weighted = |i: usize, weight| color.channels[i].mul(Interval::exact(weight));
            Shape::Float(weighted(0, 0.2126).add(weighted(1, 0.7152)).add(weighted(2, 0.0722)))
        }
        _ => return None,
    })
}

fn slightly_more(x: f32) -> f32 {
    (x * 1.000_01).next_up()
}

fn length(v: &Vector) -> Interval {
    let squares = |of: fn(&Interval) -> f32| v.channels.iter().map(|c| f64::from(of(c)).powi(2)).sum::<f64>();
    let (low, high) = (squares(|c| c.abs().low), squares(|c| c.abs().high));
    let nan = v.channels.iter().any(|c| c.nan);
    // Squares may underflow to zero and overflow to infinity.
    let low = if low < 1e-30 { 0.0 } else { (low.sqrt() * 0.999_999) as f32 };
    let high = if high > 3e38 { f32::INFINITY } else { slightly_more((high.sqrt() as f32).min(v.length)) };
    Interval::new(low.min(high), high).or_nan(nan)
}

fn dot(a: &Vector, b: &Vector) -> Interval {
    let products = a.channels.iter().zip(&b.channels).map(|(a, b)| a.mul(*b));
    let (sum, size) = products
        .fold((Interval::exact(0.0), 0.0_f32), |(sum, size), product| (sum.add(product), size.max(product.size())));
    let limit = slightly_more(a.length * b.length);
    let sum = sum.widened(size);
    if sum.is_finite() && limit.is_finite() { sum.meet(Interval::within(limit)) } else { sum }
}

/// Colors, noise and the like.
fn pattern(name: &str, arguments: &[&Shape]) -> Option<Shape> {
    let finite = arguments.iter().all(|shape| shape.range().is_none_or(Interval::is_finite));
    Some(match (name, arguments) {
        ("hash", _) => Shape::Float(Interval::UNIT),
        ("noise" | "value_noise" | "gradient_noise" | "fbm", _) => Shape::Float(Interval::within(1.0).or_nan(!finite)),
        ("hsv", [_, saturation, value]) => {
            let (s, v) = (saturation.number()?, value.number()?);
            let is_color = finite && s.low >= 0.0 && s.high <= 1.0 && v.low >= 0.0;
            let channel = if is_color { Interval::new(0.0, slightly_more(v.high)) } else { Interval::ANY };
            Shape::Vector(Vector::new([channel; 3]))
        }
        _ => return None,
    })
}

/// Functions of the script engine between types.
fn conversion(name: &str, arguments: &[&Shape]) -> Option<Shape> {
    Some(match (name, arguments) {
        ("to_float", [x]) => Shape::Float(x.number()?),
        ("to_int", [x @ Shape::Int(..)]) => (*x).clone(),
        // What does not fit ends the script with an error; `as` stays within the type's bounds.
        ("to_int", [Shape::Float(x)]) => Shape::Int(x.low as i64, x.high as i64),
        ("is_nan" | "is_finite" | "is_infinite" | "is_empty" | "is_odd" | "is_even" | "is_zero" | "contains", _) => {
            Shape::Bool(None)
        }
        ("to_string" | "to_debug" | "type_of", _) => Shape::Text(None),
        ("len", [Shape::Array(items)]) => {
            let length = i64::try_from(items.len()).ok()?;
            Shape::Int(length, length)
        }
        _ => return None,
    })
}
