//! Each operator and each function of numbers, on bounds that try it: what the interpreter computes must lie within.

use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use rhai::{AST, Dynamic, Engine, Scope};

use super::number;
use crate::math::{Vec2, Vec3};
use crate::shade::analysis::functions::library;
use crate::shade::analysis::interval::Interval;
use crate::shade::analysis::operators;
use crate::shade::analysis::value::{Shape, Vector};
use crate::shade::host::Host;

/// Operators and functions with their numbers of operands.
const OPERATIONS: [(&str, usize); 76] = [
    ("+", 2),
    ("-", 2),
    ("*", 2),
    ("/", 2),
    ("%", 2),
    ("**", 2),
    ("<", 2),
    ("<=", 2),
    (">", 2),
    (">=", 2),
    ("==", 2),
    ("!=", 2),
    ("-", 1),
    ("abs", 1),
    ("sign", 1),
    ("floor", 1),
    ("ceil", 1),
    ("round", 1),
    ("fract", 1),
    ("saturate", 1),
    ("sqrt", 1),
    ("exp", 1),
    ("exp2", 1),
    ("ln", 1),
    ("log", 1),
    ("log2", 1),
    ("sin", 1),
    ("cos", 1),
    ("tan", 1),
    ("asin", 1),
    ("acos", 1),
    ("atan", 1),
    ("sinh", 1),
    ("cosh", 1),
    ("tanh", 1),
    ("radians", 1),
    ("degrees", 1),
    ("to_int", 1),
    ("to_float", 1),
    ("is_nan", 1),
    ("hash", 1),
    ("min", 2),
    ("max", 2),
    ("mod", 2),
    ("pow", 2),
    ("step", 2),
    ("log", 2),
    ("atan", 2),
    ("clamp", 3),
    ("mix", 3),
    ("smoothstep", 3),
    ("gray", 1),
    ("hsv", 3),
    ("remap", 5),
    ("length", 1),
    ("normalize", 1),
    ("luminance", 1),
    ("distance", 2),
    ("dot", 2),
    ("cross", 2),
    ("reflect", 2),
    ("refract", 3),
    ("stripes", 2),
    ("stripes", 3),
    ("checker", 1),
    ("checker", 2),
    ("hsl", 3),
    ("hsl_from_rgb", 1),
    ("srgb_from_rgb", 1),
    ("temperature", 1),
    ("oklab", 3),
    ("oklab_from_rgb", 1),
    ("oklch", 1),
    ("oklch_from_rgb", 1),
    ("mix_oklab", 3),
    ("worley", 1),
];

/// What is known of an operand, and one thing that it can be.
#[derive(Clone, Debug)]
struct Operand {
    shape: Shape,
    value: Dynamic,
}

fn float_operand() -> impl Strategy<Value = Operand> {
    let small = prop::sample::select(vec![0.0, -0.0, 1.0, -1.0, 0.5, 2.0, 3.0, 0.1, 255.0]);
    let end = prop_oneof![2 => number(1e30), 2 => small];
    let ends = (end.clone(), end.clone(), end);
    (ends, prop::sample::select(vec![0, 0, 1, 2, 3, 4]), any::<u8>()).prop_map(|((a, b, c), kind, pick)| {
        let (mut low, mut high, mut inside) = (a.min(b), a.max(b), c.clamp(a.min(b), a.max(b)));
        let mut nan = false;
        match kind {
            1 => high = f32::INFINITY,
            2 => nan = true,
            // Exactly known.
            3 => (low, high, inside) = (c, c, c),
            _ => {}
        }
        if kind == 3 {
            return Operand { shape: Shape::Float(Interval::exact(c)), value: Dynamic::from_float(c) };
        }
        let value = match pick % 4 {
            0 => low,
            1 => high,
            2 if nan => f32::NAN,
            _ => inside,
        };
        low = low.min(high);
        Operand { shape: Shape::Float(Interval::new(low, high).or_nan(nan)), value: Dynamic::from_float(value) }
    })
}

fn int_operand() -> impl Strategy<Value = Operand> {
    let end = prop_oneof![
        -5..6_i64,
        prop::sample::select(vec![0, 1, 16_777_217, -16_777_219, i64::MAX, i64::MIN, 4_294_967_295])
    ];
    (end.clone(), end.clone(), end).prop_map(|(a, b, c)| {
        let (low, high) = (a.min(b), a.max(b));
        Operand { shape: Shape::Int(low, high), value: Dynamic::from_int(c.clamp(low, high)) }
    })
}

/// A vec3, at times tiny: squares of such channels are rounded to nothing.
fn vector_operand() -> impl Strategy<Value = Operand> {
    let scale = prop::sample::select(vec![1.0, 1.0, 1e18, 1e-22, 3e-23, 1e-10]);
    (prop::array::uniform3(float_operand()), scale).prop_map(|(parts, scale)| {
        let scale = Interval::exact(scale);
        let channels = parts.iter().map(|part| part.shape.number().unwrap_or(Interval::ANY).mul(scale));
        let value = |part: &Operand| part.value.as_float().unwrap_or(f32::NAN) * scale.low;
        let [x, y, z] = [value(&parts[0]), value(&parts[1]), value(&parts[2])];
        Operand { shape: Shape::Vector(Vector::new(channels)), value: Dynamic::from(Vec3::new(x, y, z)) }
    })
}

/// Operands of an operation; at times the first two are the same.
fn operands(count: usize) -> impl Strategy<Value = Vec<Operand>> {
    let numbers = prop_oneof![3 => float_operand().boxed(), 1 => int_operand().boxed()];
    let any = prop_oneof![4 => numbers.boxed(), 3 => vector_operand().boxed()];
    (prop::collection::vec(any, count), 0..4).prop_map(|(mut operands, same)| {
        if same == 0 && operands.len() > 1 {
            operands[1] = operands[0].clone();
        }
        operands
    })
}

/// The expression of an operation on variables.
fn expression(name: &str, count: usize) -> String {
    match (name.starts_with(char::is_alphabetic), count) {
        (true, _) => format!("{name}({})", ["a", "b", "c", "d", "e"][..count].join(", ")),
        (false, 1) => format!("{name}a"),
        (false, _) => format!("a {name} b"),
    }
}

fn check(engine: &Engine, name: &str, ast: &AST, operands: &[Operand]) -> Result<(), String> {
    let shapes: Vec<&Shape> = operands.iter().map(|operand| &operand.shape).collect();
    let claimed = match shapes.as_slice() {
        [a, b] if operators::is_binary(name) => operators::binary(name, a, b),
        [x] => operators::unary(name, x).or_else(|| library(name, &shapes)),
        _ => library(name, &shapes),
    };
    let mut scope = Scope::new();
    for (name, operand) in ["a", "b", "c", "d", "e"].iter().zip(operands) {
        scope.push_dynamic(*name, operand.value.clone());
    }
    let (Some(claimed), Ok(result)) = (claimed, engine.eval_ast_with_scope::<Dynamic>(&mut scope, ast)) else {
        return Ok(());
    };
    let within = match &claimed {
        Shape::Bool(known) => known.is_none_or(|known| result.as_bool() == Ok(known)),
        Shape::Int(low, high) => result.as_int().is_ok_and(|n| (low..=high).contains(&&n)),
        Shape::Float(bounds) => result.as_float().is_ok_and(|x| is_within(*bounds, x)),
        Shape::Number(bounds) => {
            let x = result.as_float().or_else(|_| result.as_int().map(|n| n as f32));
            x.is_ok_and(|x| is_within(*bounds, x))
        }
        Shape::Vector(vector) => {
            let of_space = result.read_lock::<Vec3>().map(|v| v.to_array().to_vec());
            let channels = of_space.or_else(|| result.read_lock::<Vec2>().map(|v| v.to_array().to_vec()));
            channels.is_some_and(|v| {
                v.len() == vector.channels.len() && v.iter().zip(&vector.channels).all(|(x, b)| is_within(*b, *x))
            })
        }
        _ => true,
    };
    if within { Ok(()) } else { Err(format!("`{name}` of {operands:?} is {result:?}, not within {claimed:?}")) }
}

fn is_within(bounds: Interval, x: f32) -> bool {
    match bounds.value() {
        Some(known) => known.to_bits() == x.to_bits(),
        None => bounds.nan && x.is_nan() || (bounds.low..=bounds.high).contains(&x),
    }
}

#[test]
fn operations_stay_within_their_bounds() {
    let engine = Host::new().engine(&std::collections::BTreeSet::new(), &[]);
    let mut failures = Vec::new();
    for (name, count) in OPERATIONS {
        let mut compiler = Engine::new_raw();
        compiler.set_optimization_level(rhai::OptimizationLevel::None);
        let ast = compiler.compile_expression(expression(name, count)).expect("the expressions are well formed");
        let config = ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() };
        let result = TestRunner::new(config)
            .run(&operands(count), |operands| check(&engine, name, &ast, &operands).map_err(TestCaseError::fail));
        if let Err(error) = result {
            failures.extend(error.to_string().lines().next().map(str::to_owned));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
