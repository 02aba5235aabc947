//! Ramps: a value that runs through given stops.

use rhai::{Array, Dynamic, Engine};

use super::Function;
use super::math::{mix, smoothstep};
use super::operand::{Operand, Outcome, kind, number};
use crate::shade::fault::Fault;

pub(super) const FUNCTIONS: &[Function] = &[
    Function {
        name: "ramp",
        form: "ramp(t, [[0.0, a], [1.0, b]])",
        about: "the value at t between stops of a position and a number or vector, linear between them",
        types: "number, array of [number, number or vector] → number or vector",
        example: "ramp(hit.uv.y, [[0.0, rgb(0, 0, 0)], [0.4, rgb(1, 0, 0)], [1.0, rgb(1, 1, 1)]])",
    },
    Function {
        name: "ramp",
        form: "ramp(t, stops, kind)",
        about: "the same with the kind \"constant\" (the stop below t), \"linear\" or \"smooth\" (as smoothstep)",
        types: "number, array of [number, number or vector], text → number or vector",
        example: "ramp(hit.uv.y, [[0.0, 0.2], [0.5, 1.0]], \"smooth\")",
    },
];

/// How a ramp runs between two stops.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Constant,
    Linear,
    Smooth,
}

const KINDS: [(&str, Kind); 3] = [("constant", Kind::Constant), ("linear", Kind::Linear), ("smooth", Kind::Smooth)];

pub(super) fn register(engine: &mut Engine) {
    engine.register_fn("ramp", |t: Dynamic, stops: Array| ramp(number("ramp", &t)?, &stops, Kind::Linear));
    engine.register_fn("ramp", |t: Dynamic, stops: Array, kind: &str| {
        let Some((_, kind)) = KINDS.into_iter().find(|(name, _)| *name == kind) else {
            let fault = Fault::new(format!("a ramp cannot be \"{kind}\""));
            return Err(fault.propose(kind, KINDS.iter().map(|(name, _)| *name)).into());
        };
        ramp(number("ramp", &t)?, &stops, kind)
    });
}

/// With `t` below stop 0 its value, with `t` at or above the last stop its value; else, with stop `i` the first above
/// `t`, `mix(value[i - 1], value[i], u)` where `u` is 0 for constant, `(t - from) / (to - from)` for linear and
/// `smoothstep(from, to, t)` for smooth. A `t` that is no number counts as beyond the last stop.
fn ramp(t: f32, stops: &Array, kind: Kind) -> Outcome {
    let stops = stops.iter().map(stop).collect::<Outcome<Vec<_>>>()?;
    let (Some(first), Some(last)) = (stops.first(), stops.last()) else {
        return Err(Fault::new("a ramp needs at least one stop").into());
    };
    if stops.windows(2).any(|pair| pair[1].0 < pair[0].0) {
        return Err(Fault::new("the positions of a ramp's stops must not fall").into());
    }
    if stops.iter().any(|(_, value)| value.width() != first.1.width()) {
        return Err(Fault::new("the values of a ramp's stops must be of one type").into());
    }
    let above = stops.iter().position(|(position, _)| t < *position);
    let (from, to, u) = match above {
        Some(0) => (first.1, first.1, 0.0),
        None => (last.1, last.1, 0.0),
        Some(i) => {
            let (low, high) = (stops[i - 1].0, stops[i].0);
            let u = match kind {
                Kind::Constant => 0.0,
                Kind::Linear => (t - low) / (high - low),
                Kind::Smooth => smoothstep(low, high, t),
            };
            (stops[i - 1].1, stops[i].1, u)
        }
    };
    Ok(Operand::build(first.1.width(), |lane| mix(from.lane(lane), to.lane(lane), u)))
}

fn stop(value: &Dynamic) -> Outcome<(f32, Operand)> {
    let parts = value.as_array_ref().ok();
    let stop = match parts.as_deref().map(Vec::as_slice) {
        Some([position, value]) => Operand::of(position).filter(|p| p.width() == 1).zip(Operand::of(value)),
        _ => None,
    };
    stop.map(|(position, value)| (position.lane(0), value)).ok_or_else(|| {
        Fault::new(format!("a ramp's stop must be a position and a value, not {}", kind(value)))
            .hint("write the stops as [[0.0, rgb(0, 0, 0)], [1.0, rgb(1, 1, 1)]]")
            .into()
    })
}
