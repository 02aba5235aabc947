//! What the operators of the script language do to bounds.

use std::rc::Rc;

use super::interval::Interval;
use super::value::{Record, Shape, Vector, mixed_number};

/// The result of a unary operator; `None` if nothing is known of it.
pub(super) fn unary(operator: &str, x: &Shape) -> Option<Shape> {
    Some(match (operator, x) {
        ("+", _) if x.is_number() => x.clone(),
        // The one integer without a negative fails when the script runs.
        ("-", Shape::Int(low, high)) => Shape::Int(high.saturating_neg(), low.saturating_neg()),
        ("-", Shape::Float(x)) => Shape::Float(x.neg()),
        ("-", Shape::Number(x)) => Shape::Number(x.neg()),
        ("-", Shape::Vector(v)) => {
            Shape::Vector(Vector { channels: v.channels.iter().map(|c| c.neg()).collect(), length: v.length })
        }
        ("!", Shape::Bool(b)) => Shape::Bool(b.map(|b| !b)),
        _ => return None,
    })
}

/// The result of a binary operator; `None` if nothing is known of it.
pub(super) fn binary(operator: &str, a: &Shape, b: &Shape) -> Option<Shape> {
    match operator {
        "==" | "!=" | "<" | "<=" | ">" | ">=" => return Some(Shape::Bool(compare(operator, a, b))),
        ".." | "..=" => {
            return match (a, b) {
                (Shape::Int(low, low_too), Shape::Int(high, high_too)) if low == low_too && high == high_too => {
                    Some(range(*low, *high, operator == "..="))
                }
                _ => None,
            };
        }
        _ => {}
    }
    match (a, b) {
        (Shape::Int(..), Shape::Int(..)) => integers(operator, a, b),
        (Shape::Float(_), _) | (_, Shape::Float(_)) if a.is_number() && b.is_number() => {
            floats(operator, a.number()?, b.number()?).map(Shape::Float)
        }
        (Shape::Number(_), _) | (_, Shape::Number(_)) if a.is_number() && b.is_number() => {
            // Both forms of `+ - *` agree as long as all is exact; division differs.
            match operator {
                "+" | "-" | "*" => floats(operator, a.range()?, b.range()?).map(mixed_number),
                _ => None,
            }
        }
        (Shape::Vector(a), Shape::Vector(b)) if a.channels.len() == b.channels.len() => {
            let channels = a.channels.iter().zip(&b.channels);
            channelwise(operator, channels.map(|(a, b)| (*a, *b)))
        }
        (Shape::Vector(v), _) if b.is_number() => {
            let b = b.number()?;
            channelwise(operator, v.channels.iter().map(|a| (*a, b)))
        }
        (_, Shape::Vector(v)) if a.is_number() => {
            let a = a.number()?;
            channelwise(operator, v.channels.iter().map(|b| (a, *b)))
        }
        (Shape::Bool(a), Shape::Bool(b)) => match operator {
            "&" => Some(Shape::Bool(both(*a, *b))),
            "|" => Some(Shape::Bool(both(a.map(|a| !a), b.map(|b| !b)).map(|c| !c))),
            "^" => Some(Shape::Bool(a.zip(*b).map(|(a, b)| a ^ b))),
            _ => None,
        },
        (Shape::Text(a), Shape::Text(b)) if operator == "+" => {
            let text = a.as_ref().zip(b.as_ref()).map(|(a, b)| Rc::from(format!("{a}{b}")));
            Some(Shape::Text(text))
        }
        (Shape::Record(a), Shape::Record(b)) if operator == "+" => merged(a, b),
        _ => None,
    }
}

fn channelwise(operator: &str, pairs: impl Iterator<Item = (Interval, Interval)>) -> Option<Shape> {
    let channels = pairs.map(|(a, b)| floats(operator, a, b)).collect::<Option<Vec<_>>>()?;
    Some(Shape::Vector(Vector::new(channels)))
}

fn both(a: Option<bool>, b: Option<bool>) -> Option<bool> {
    match (a, b) {
        (Some(false), _) | (_, Some(false)) => Some(false),
        (Some(true), Some(true)) => Some(true),
        _ => None,
    }
}

/// Integers from `low` to `high`.
pub(super) fn range(low: i64, high: i64, inclusive: bool) -> Shape {
    Shape::Range(low, if inclusive { high.saturating_add(1) } else { high })
}

/// `b`'s keys put into `a`; `None` if it is open which of the two a key comes from.
pub(super) fn merged(a: &Record, b: &Record) -> Option<Shape> {
    let mut merged = Record { is_params: false, ..a.clone() };
    for (key, field) in &b.fields {
        if !field.always && a.fields.contains_key(key) {
            return None;
        }
        merged.fields.insert(Rc::clone(key), field.clone());
    }
    Some(Shape::Record(Rc::new(merged)))
}

/// Operations on floats, the very ones of the script engine.
fn floats(operator: &str, a: Interval, b: Interval) -> Option<Interval> {
    Some(match operator {
        "+" => a.add(b),
        "-" => a.sub(b),
        "*" => a.mul(b),
        "/" => a.div(b),
        "%" => a.rem(b),
        "**" => a.pow(b),
        _ => return None,
    })
}

/// Operations on integers. What overflows ends the script with an error, so results are within the type's bounds.
fn integers(operator: &str, a: &Shape, b: &Shape) -> Option<Shape> {
    let (Shape::Int(a_low, a_high), Shape::Int(b_low, b_high)) = (a, b) else { return None };
    let wide = |n: &i64| i128::from(*n);
    let corners = |f: fn(i128, i128) -> i128| {
        let values = [
            f(wide(a_low), wide(b_low)),
            f(wide(a_low), wide(b_high)),
            f(wide(a_high), wide(b_low)),
            f(wide(a_high), wide(b_high)),
        ];
        let clamp = |n: i128| i64::try_from(n).unwrap_or(if n < 0 { i64::MIN } else { i64::MAX });
        let (low, high) = values.iter().fold((values[0], values[0]), |(low, high), n| (low.min(*n), high.max(*n)));
        Shape::Int(clamp(low), clamp(high))
    };
    let positive = *b_low > 0;
    Some(match operator {
        "+" => corners(|a, b| a + b),
        "-" => corners(|a, b| a - b),
        "*" => corners(|a, b| a * b),
        "/" if positive => corners(|a, b| a / b),
        "%" if positive && a_low == a_high && b_low == b_high => Shape::Int(a_low % b_low, a_low % b_low),
        "%" if positive && *a_low >= 0 => Shape::Int(0, (b_high - 1).min(*a_high)),
        "%" if positive => Shape::Int(1 - b_high, b_high - 1),
        "/" | "%" | "**" | "&" | "|" | "^" | "<<" | ">>" => Shape::Int(i64::MIN, i64::MAX),
        _ => return None,
    })
}

/// What a comparison gives, if that is certain.
///
/// The script engine compares floats with a relative tolerance (of `f32::EPSILON`; absolute next to zero), and
/// comparisons with infinities and NaN go their own ways. So an order is certain only between finite numbers that are
/// clearly apart, or where the tolerance works in its favour.
fn compare(operator: &str, a: &Shape, b: &Shape) -> Option<bool> {
    match (a, b) {
        (Shape::Int(a_low, a_high), Shape::Int(b_low, b_high)) => {
            return match operator {
                "<" => order(a_high < b_low, a_low >= b_high),
                ">" => order(a_low > b_high, a_high <= b_low),
                "<=" => order(a_high <= b_low, a_low > b_high),
                ">=" => order(a_low >= b_high, a_high < b_low),
                "==" => order(a_low == a_high && a == b, a_high < b_low || a_low > b_high),
                _ => order(a_high < b_low || a_low > b_high, a_low == a_high && a == b),
            };
        }
        (Shape::Bool(Some(a)), Shape::Bool(Some(b))) => return Some(holds(operator, a.cmp(b))),
        (Shape::Text(Some(a)), Shape::Text(Some(b))) => return Some(holds(operator, a.cmp(b))),
        (Shape::Unit, Shape::Unit) => return Some(operator == "=="),
        _ if a.is_number() && b.is_number() => {}
        // Values of different types are unequal, and not in any order.
        _ if a.is_typed() && b.is_typed() && !same_type(a, b) => return Some(operator == "!="),
        (Shape::Number(_), other) | (other, Shape::Number(_)) if other.is_typed() => return Some(operator == "!="),
        _ => return None,
    }
    let (a, b) = (a.number()?, b.number()?);
    let finite = a.is_finite() && b.is_finite();
    let (less, greater) = (clearly_less(a, b), clearly_less(b, a));
    let same = a.value().is_some() && a.value() == b.value();
    match operator {
        "<" => order(finite && less, a.low >= b.high),
        ">" => order(finite && greater, b.low >= a.high),
        "<=" => order(finite && a.high <= b.low, greater),
        ">=" => order(finite && b.high <= a.low, less),
        "==" => order(finite && same, less || greater),
        _ => order(finite && (less || greater), same),
    }
}

/// Whether every `a` is less than every `b` by more than the tolerance of comparisons.
fn clearly_less(a: Interval, b: Interval) -> bool {
    let (a, b) = (f64::from(a.high), f64::from(b.low));
    b - a > 4e-7 * a.abs().max(b.abs()).max(1.0)
}

fn order(certain: bool, impossible: bool) -> Option<bool> {
    match (certain, impossible) {
        (true, _) => Some(true),
        (_, true) => Some(false),
        _ => None,
    }
}

fn holds(operator: &str, order: std::cmp::Ordering) -> bool {
    match operator {
        "<" => order.is_lt(),
        ">" => order.is_gt(),
        "<=" => order.is_le(),
        ">=" => order.is_ge(),
        "==" => order.is_eq(),
        _ => order.is_ne(),
    }
}

fn same_type(a: &Shape, b: &Shape) -> bool {
    match (a, b) {
        (Shape::Vector(a), Shape::Vector(b)) => a.channels.len() == b.channels.len(),
        _ => std::mem::discriminant(a) == std::mem::discriminant(b),
    }
}
