//! What the operators of the script language do to bounds.

use std::rc::Rc;

use super::interval::Interval;
use super::value::{Shape, Vector, mixed_number};

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

/// Whether a function of this name is a binary operator.
pub(super) fn is_binary(name: &str) -> bool {
    const OPERATORS: [&str; 19] =
        ["+", "-", "*", "/", "%", "**", "==", "!=", "<", "<=", ">", ">=", "..", "..=", "&", "|", "^", "<<", ">>"];
    OPERATORS.contains(&name)
}

/// The result of a binary operator; `None` if nothing is known of it.
pub(super) fn binary(operator: &str, a: &Shape, b: &Shape) -> Option<Shape> {
    match operator {
        "==" | "!=" | "<" | "<=" | ">" | ">=" => return Some(Shape::Bool(compare(operator, a, b))),
        ".." | "..=" => {
            let (Shape::Int(low, low_too), Shape::Int(high_too, high)) = (a, b) else { return None };
            let end = if operator == "..=" { high.saturating_add(1) } else { *high };
            return Some(Shape::Range { low: *low, end, exact: low == low_too && high == high_too });
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
            // What a script can hold at all; without the bound a doubling loop would fill the memory.
            let fits = |(a, b): &(&Rc<str>, &Rc<str>)| a.len() + b.len() <= crate::shade::host::MAX_TEXT;
            let text = a.as_ref().zip(b.as_ref()).filter(fits).map(|(a, b)| Rc::from(format!("{a}{b}")));
            Some(Shape::Text(text))
        }
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

/// What a comparison gives, if that is certain. Floats compare as IEEE 754 says; an int beside one counts as the nearest
/// float; values of different types are unequal, and in no order.
fn compare(operator: &str, a: &Shape, b: &Shape) -> Option<bool> {
    match (a, b) {
        (Shape::Int(a_low, a_high), Shape::Int(b_low, b_high)) => {
            return compare_bounds(operator, (a_low, a_high), (b_low, b_high), false);
        }
        (Shape::Bool(Some(a)), Shape::Bool(Some(b))) => return compare_bounds(operator, (a, a), (b, b), false),
        (Shape::Text(Some(a)), Shape::Text(Some(b))) => return compare_bounds(operator, (a, a), (b, b), false),
        (Shape::Unit, Shape::Unit) => return Some(operator == "=="),
        _ if a.is_number() && b.is_number() => {}
        _ if a.is_typed() && b.is_typed() && !same_type(a, b) => return Some(operator == "!="),
        (Shape::Number(_), other) | (other, Shape::Number(_)) if other.is_typed() => return Some(operator == "!="),
        _ => return None,
    }
    let (a, b) = (a.number()?, b.number()?);
    compare_bounds(operator, (&a.low, &a.high), (&b.low, &b.high), a.nan || b.nan)
}

fn compare_bounds<T: PartialOrd + ?Sized>(operator: &str, a: (&T, &T), b: (&T, &T), nan: bool) -> Option<bool> {
    let apart = a.1 < b.0 || a.0 > b.1;
    let same = a.0 == a.1 && b.0 == b.1 && a.0 == b.0;
    // With a NaN all comparisons but `!=` fail.
    match operator {
        "<" => order(!nan && a.1 < b.0, a.0 >= b.1),
        ">" => order(!nan && a.0 > b.1, a.1 <= b.0),
        "<=" => order(!nan && a.1 <= b.0, a.0 > b.1),
        ">=" => order(!nan && a.0 >= b.1, a.1 < b.0),
        "==" => order(!nan && same, apart),
        _ => order(apart, !nan && same),
    }
}

fn order(certain: bool, impossible: bool) -> Option<bool> {
    match (certain, impossible) {
        (true, _) => Some(true),
        (_, true) => Some(false),
        _ => None,
    }
}

fn same_type(a: &Shape, b: &Shape) -> bool {
    match (a, b) {
        (Shape::Vector(a), Shape::Vector(b)) => a.channels.len() == b.channels.len(),
        _ => std::mem::discriminant(a) == std::mem::discriminant(b),
    }
}
