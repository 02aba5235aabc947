//! What functions of whole vectors do to bounds.
//!
//! Besides the bounds of its channels, the greatest length of a vector is known, so that the dot product of two unit
//! vectors is within −1 … 1, not −3 … 3.

use super::interval::Interval;
use super::value::{Shape, Vector};

/// Type and bounds of a function's result; `None` if it is none of these.
pub(super) fn library(name: &str, arguments: &[&Shape]) -> Option<Shape> {
    match (name, arguments) {
        ("length", [Shape::Vector(v)]) => Some(Shape::Float(length(v))),
        ("normalize", [Shape::Vector(v)]) => Some(Shape::Vector(normalize(v))),
        ("distance", [Shape::Vector(a), Shape::Vector(b)]) if same_size(a, b) => {
            let between = a.channels.iter().zip(&b.channels).map(|(a, b)| a.sub(*b));
            Some(Shape::Float(length(&Vector::new(between))))
        }
        ("dot", [Shape::Vector(a), Shape::Vector(b)]) if same_size(a, b) => Some(Shape::Float(dot(a, b))),
        ("cross", [Shape::Vector(a), Shape::Vector(b)]) if same_size(a, b) && a.channels.len() == 3 => {
            Some(Shape::Vector(cross(a, b)))
        }
        ("reflect", [Shape::Vector(v), Shape::Vector(normal)]) if same_size(v, normal) => {
            Some(Shape::Vector(reflect(v, normal)))
        }
        ("refract", [Shape::Vector(v), Shape::Vector(normal), eta]) if same_size(v, normal) => {
            Some(Shape::Vector(refract(v, normal, eta.number()?)))
        }
        ("luminance", [Shape::Vector(color)]) if color.channels.len() == 3 => {
            let weighted = |i: usize, weight| color.channels[i].mul(Interval::exact(weight));
            Some(Shape::Float(weighted(0, 0.2126).add(weighted(1, 0.7152)).add(weighted(2, 0.0722))))
        }
        _ => None,
    }
}

fn same_size(a: &Vector, b: &Vector) -> bool {
    a.channels.len() == b.channels.len()
}

/// Up to the rounding of a few operations above.
fn slightly_more(x: f32) -> f32 {
    (x * 1.000_001).next_up()
}

/// Any vector of a size, of at most this length; without bounds if that is not finite.
fn at_most(length: f32, count: usize) -> Vector {
    let channel = if length.is_finite() { Interval::within(length) } else { Interval::ANY };
    Vector::new(std::iter::repeat_n(channel, count)).at_most(length)
}

fn is_finite(v: &Vector) -> bool {
    v.channels.iter().all(|channel| channel.is_finite())
}

fn length(v: &Vector) -> Interval {
    let squares = |of: fn(&Interval) -> f32| v.channels.iter().map(|c| f64::from(of(c)).powi(2)).sum::<f64>();
    let (low, high) = (squares(|c| c.abs().low), squares(|c| c.abs().high));
    let nan = v.channels.iter().any(|c| c.nan);
    // Squares may underflow to zero and overflow to infinity.
    let low = if low < 1e-30 { 0.0 } else { (low.sqrt() * 0.999_999) as f32 };
    let high = if high > 3e38 { f32::INFINITY } else { slightly_more((high.sqrt() as f32).min(v.length)) };
    // Where squares fall below the least normal number, a length may come out too long by as much.
    Interval::new(low.min(high), high.max(1e-19)).or_nan(nan)
}

/// `v / length(v)`, or 0 if the length is 0.
fn normalize(v: &Vector) -> Vector {
    let length = length(v);
    let count = v.channels.len();
    if length.nan || length.high == f32::INFINITY {
        return Vector::new(vec![Interval::ANY; count]);
    }
    // Squares below the least normal number are rounded by up to half of themselves.
    if length.low > 1e-15 { Vector::unit(count) } else { at_most(1.25, count) }
}

fn dot(a: &Vector, b: &Vector) -> Interval {
    let products = a.channels.iter().zip(&b.channels).map(|(a, b)| a.mul(*b));
    let sum = products.reduce(Interval::add).unwrap_or(Interval::ANY);
    let limit = slightly_more(slightly_more(a.length) * b.length) + f32::MIN_POSITIVE;
    if sum.is_finite() && limit.is_finite() && sum.value().is_none() { sum.meet(Interval::within(limit)) } else { sum }
}

fn cross(a: &Vector, b: &Vector) -> Vector {
    let channel = |i: usize, j: usize| a.channels[i].mul(b.channels[j]).sub(a.channels[j].mul(b.channels[i]));
    let limit = slightly_more(slightly_more(a.length) * b.length) + f32::MIN_POSITIVE;
    Vector::new([channel(1, 2), channel(2, 0), channel(0, 1)]).at_most(limit)
}

/// `v - normal * (2 * dot(normal, v))`: along the normal, a vector is scaled by 1 − 2 |normal|², across it not at all.
fn reflect(v: &Vector, normal: &Vector) -> Vector {
    let count = v.channels.len();
    let growth = (2.0 * normal.length * normal.length - 1.0).max(1.0);
    if !is_finite(v) || !is_finite(normal) || normal.length > 1e6 || v.length > 1e20 {
        return Vector::new(vec![Interval::ANY; count]);
    }
    at_most(slightly_more(slightly_more(v.length * growth)) + f32::MIN_POSITIVE, count)
}

/// With `c = dot(n, v)` and `k = 1 - eta² (1 - c²)`: 0 if `k < 0`, else `v * eta - n * (eta * c + sqrt(k))`.
fn refract(v: &Vector, normal: &Vector, eta: Interval) -> Vector {
    let count = v.channels.len();
    let (eta_size, c) = (eta.size(), v.length * normal.length);
    if !is_finite(v) || !is_finite(normal) || !eta.is_finite() || eta_size > 1e6 || c > 1e6 {
        return Vector::new(vec![Interval::ANY; count]);
    }
    let root = (1.0 + eta_size * eta_size * c * c).sqrt();
    let size = v.length * eta_size + normal.length * (eta_size * c + root);
    at_most(slightly_more(slightly_more(size)) + f32::MIN_POSITIVE, count)
}
