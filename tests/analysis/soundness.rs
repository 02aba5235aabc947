//! Whatever the analysis claims of a script must hold when the script runs: generated scripts are analysed and run on
//! many inputs by an engine with a small library.

use proptest::prelude::*;
use rhai::{Dynamic, Engine, Map, Scope};
use tusche::math::{Vec3, luminance};
use tusche::shade::analysis::inputs::LIMIT;
use tusche::shade::analysis::{Analysis, OutputFact};
use tusche::shade::{InputSet, OutputSet, Value};

use super::analysis;

/// A hit with some of the inputs.
#[derive(Clone, Copy, Debug)]
struct Hit {
    position: Vec3,
    normal: Vec3,
    irradiance: Vec3,
    distance: f32,
    curvature: f32,
    time: f32,
    object_id: i64,
    polygon_id: i64,
    front_facing: bool,
    path_kind: u8,
    light: f32,
}

#[derive(Clone, Copy)]
struct Light {
    visibility: f32,
    direction: Vec3,
}

const PATH_KINDS: [&str; 4] = ["camera", "reflection", "refraction", "shadow"];

/// The inputs that a [`Hit`] has.
const VARIED: [InputSet; 11] = [
    InputSet::POSITION,
    InputSet::NORMAL,
    InputSet::IRRADIANCE,
    InputSet::DISTANCE,
    InputSet::CURVATURE,
    InputSet::TIME,
    InputSet::OBJECT_ID,
    InputSet::POLYGON_ID,
    InputSet::FRONT_FACING,
    InputSet::PATH_KIND,
    InputSet::LIGHT,
];

impl Hit {
    /// The same, with one input taken from another hit.
    fn with(mut self, input: InputSet, from: &Self) -> Self {
        match input {
            InputSet::POSITION => self.position = from.position,
            InputSet::NORMAL => self.normal = from.normal,
            InputSet::IRRADIANCE => self.irradiance = from.irradiance,
            InputSet::DISTANCE => self.distance = from.distance,
            InputSet::CURVATURE => self.curvature = from.curvature,
            InputSet::TIME => self.time = from.time,
            InputSet::OBJECT_ID => self.object_id = from.object_id,
            InputSet::POLYGON_ID => self.polygon_id = from.polygon_id,
            InputSet::FRONT_FACING => self.front_facing = from.front_facing,
            InputSet::PATH_KIND => self.path_kind = from.path_kind,
            _ => self.light = from.light,
        }
        self
    }
}

fn engine() -> Engine {
    let mut engine = Engine::new();
    engine.set_optimization_level(rhai::OptimizationLevel::None);
    engine.set_max_operations(200_000);
    engine.set_max_call_levels(32);
    engine.set_max_expr_depths(0, 0);
    engine
        .register_type::<Hit>()
        .register_get("position", |hit: &mut Hit| hit.position)
        .register_get("normal", |hit: &mut Hit| hit.normal)
        .register_get("irradiance", |hit: &mut Hit| hit.irradiance)
        .register_get("distance", |hit: &mut Hit| hit.distance)
        .register_get("curvature", |hit: &mut Hit| hit.curvature)
        .register_get("time", |hit: &mut Hit| hit.time)
        .register_get("object_id", |hit: &mut Hit| hit.object_id)
        .register_get("polygon_id", |hit: &mut Hit| hit.polygon_id)
        .register_get("front_facing", |hit: &mut Hit| hit.front_facing)
        .register_get("path_kind", |hit: &mut Hit| PATH_KINDS[usize::from(hit.path_kind) % 4].to_owned())
        .register_fn("light", |hit: &mut Hit, i: i64| Light {
            visibility: if i == 0 { hit.light } else { 1.0 - hit.light },
            direction: Vec3::X,
        })
        .register_get("visibility", |light: &mut Light| light.visibility)
        .register_get("direction", |light: &mut Light| light.direction);
    engine
        .register_type::<Vec3>()
        .register_get_set("x", |v: &mut Vec3| v.x, |v: &mut Vec3, x: f32| v.x = x)
        .register_get_set("y", |v: &mut Vec3| v.y, |v: &mut Vec3, y: f32| v.y = y)
        .register_get_set("z", |v: &mut Vec3| v.z, |v: &mut Vec3, z: f32| v.z = z)
        .register_get("zxy", |v: &mut Vec3| Vec3::new(v.z, v.x, v.y))
        .register_fn("vec3", Vec3::new)
        .register_fn("vec3", Vec3::splat)
        .register_fn("+", |a: Vec3, b: Vec3| a + b)
        .register_fn("-", |a: Vec3, b: Vec3| a - b)
        .register_fn("*", |a: Vec3, b: Vec3| a * b)
        .register_fn("/", |a: Vec3, b: Vec3| a / b)
        .register_fn("*", |a: Vec3, b: f32| a * b)
        .register_fn("*", |a: f32, b: Vec3| a * b)
        .register_fn("/", |a: Vec3, b: f32| a / b)
        .register_fn("-", |a: Vec3| -a)
        .register_fn("abs", |a: Vec3| a.abs())
        .register_fn("dot", |a: Vec3, b: Vec3| a.dot(b))
        .register_fn("cross", |a: Vec3, b: Vec3| a.cross(b))
        .register_fn("length", |a: Vec3| a.length())
        .register_fn("distance", |a: Vec3, b: Vec3| a.distance(b))
        .register_fn("normalize", |a: Vec3| a.normalize())
        .register_fn("reflect", |a: Vec3, n: Vec3| a - 2.0 * a.dot(n) * n)
        .register_fn("luminance", luminance)
        .register_fn("mix", |a: Vec3, b: Vec3, t: f32| a.lerp(b, t));
    engine
        .register_fn("clamp", |x: f32, a: f32, b: f32| x.max(a).min(b))
        .register_fn("saturate", |x: f32| if x.is_nan() { x } else { x.clamp(0.0, 1.0) })
        .register_fn("mix", |a: f32, b: f32, t: f32| a + (b - a) * t)
        .register_fn("step", |edge: f32, x: f32| if x < edge { 0.0_f32 } else { 1.0 })
        .register_fn("smoothstep", |a: f32, b: f32, x: f32| {
            let t = (x - a) / (b - a);
            let t = if t.is_nan() { t } else { t.clamp(0.0, 1.0) };
            t * t * (3.0 - 2.0 * t)
        })
        .register_fn("remap", |x: f32, a: f32, b: f32, c: f32, d: f32| c + (d - c) * ((x - a) / (b - a)))
        .register_fn("fract", |x: f32| x - x.floor())
        .register_fn("mod", |a: f32, b: f32| a - b * (a / b).floor())
        .register_fn("pow", |a: f32, b: f32| a.powf(b))
        .register_fn("sign", |x: f32| x.signum())
        .register_fn("hash", |x: f32| (x.to_bits().wrapping_mul(0x9E37_79B9) >> 8) as f32 / 16_777_216.0)
        .register_fn("native", |x: f32| x * 3.0 - 1.0)
        .register_fn("native", |hit: Hit| hit.curvature);
    engine
}

/// Writes a script; every choice is the next byte, and bytes that have run out choose the simplest form.
struct Writer<'a> {
    choices: std::slice::Iter<'a, u8>,
    /// Names in scope with their types.
    variables: Vec<(String, Type)>,
    functions: Vec<(String, Vec<Type>, Type)>,
    names: usize,
    /// Whether `break` may be written, and whether `continue` may.
    in_loop: Option<bool>,
    /// What `return` returns here.
    returns: Type,
    has_hit: bool,
    this: Option<Type>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Type {
    Float,
    Int,
    Bool,
    Vector,
    /// The record that `surface` returns.
    Outputs,
}

const FLOAT_OUTPUTS: [&str; 5] = ["roughness", "line_width", "metallic", "aov_one", "opacity"];

impl Writer<'_> {
    fn choose(&mut self, count: u8) -> u8 {
        self.choices.next().map_or(0, |byte| byte % count)
    }

    fn name(&mut self, prefix: &str) -> String {
        self.names += 1;
        format!("{prefix}{}", self.names)
    }

    fn variable(&mut self, of: Type) -> Option<String> {
        let names: Vec<String> =
            self.variables.iter().filter(|(_, t)| *t == of).map(|(name, _)| name.clone()).collect();
        let choice = self.choose(255);
        (!names.is_empty()).then(|| names[usize::from(choice) % names.len()].clone())
    }

    fn script(&mut self) -> String {
        let mut script = String::new();
        for _ in 0..self.choose(4) {
            script += &self.function();
        }
        self.has_hit = true;
        self.returns = Type::Outputs;
        self.variables = vec![("out".into(), Type::Outputs)];
        let count = 1 + self.choose(6);
        let body = self.statements(count, 3);
        let end = self.outputs(2);
        format!("{script}fn surface(hit, p) {{ let out = #{{}}; {body} {end} }}")
    }

    fn function(&mut self) -> String {
        let (name, result) = (self.name("f"), self.simple_type());
        let parameters: Vec<Type> = (0..self.choose(3)).map(|_| self.simple_type()).collect();
        let is_method = self.choose(4) == 3;
        self.has_hit = false;
        self.returns = result;
        self.this = is_method.then_some(Type::Float);
        self.variables = parameters.iter().enumerate().map(|(i, t)| (format!("a{i}"), *t)).collect();
        let count = self.choose(3);
        let body = self.statements(count, 2);
        let end = self.expression(result, 2);
        self.this = None;
        let names: Vec<String> = (0..parameters.len()).map(|i| format!("a{i}")).collect();
        let prefix = if is_method { "m" } else { "" };
        self.functions.push((format!("{prefix}{name}"), parameters, result));
        format!("fn {prefix}{name}({}) {{ {body} {end} }}\n", names.join(", "))
    }

    fn simple_type(&mut self) -> Type {
        [Type::Float, Type::Int, Type::Vector, Type::Bool][usize::from(self.choose(4))]
    }

    fn statements(&mut self, count: u8, depth: u8) -> String {
        let scope = self.variables.len();
        let text: Vec<String> = (0..count).map(|_| self.statement(depth)).collect();
        if depth < 3 && !(self.returns != Type::Outputs && depth == 2) {
            self.variables.truncate(scope);
        }
        text.join(" ")
    }

    fn block(&mut self, depth: u8) -> String {
        let scope = self.variables.len();
        let count = 1 + self.choose(3);
        let text = self.statements(count, depth.min(1));
        self.variables.truncate(scope);
        text
    }

    fn statement(&mut self, depth: u8) -> String {
        if depth == 0 {
            return self.simple_statement();
        }
        match self.choose(16) {
            0..=3 => self.simple_statement(),
            4 | 5 => {
                let of = self.simple_type();
                let value = self.expression(of, 2);
                let name = self.name("v");
                self.variables.push((name.clone(), of));
                format!("let {name} = {value};")
            }
            6 | 7 => {
                let (condition, first) = (self.expression(Type::Bool, 2), self.block(depth - 1));
                let second = if self.choose(2) == 0 { String::new() } else { self.block(depth - 1) };
                format!("if {condition} {{ {first} }} else {{ {second} }}")
            }
            8 => {
                let name = self.name("i");
                let end =
                    if self.choose(2) == 0 { "4".into() } else { format!("({}) % 6", self.expression(Type::Int, 1)) };
                let body = self.loop_body(&name, Type::Int, depth, true);
                format!("for {name} in 0..{end} {{ {body} }}")
            }
            9 => {
                let name = self.name("i");
                let condition = self.expression(Type::Bool, 1);
                let body = self.loop_body(&name, Type::Int, depth, true);
                format!("let {name} = 0; while {name} < 5 && {condition} {{ {name} += 1; {body} }}")
            }
            10 => {
                let name = self.name("i");
                let body = self.loop_body(&name, Type::Int, depth, true);
                format!("let {name} = 0; loop {{ {name} += 1; if {name} > 4 {{ break; }} {body} }}")
            }
            11 => {
                let name = self.name("i");
                let condition = self.expression(Type::Bool, 1);
                let body = self.loop_body(&name, Type::Int, depth, false);
                format!("let {name} = 0; do {{ {name} += 1; {body} }} while {name} < 4 && {condition};")
            }
            12 => {
                let name = self.name("e");
                let items: Vec<String> = (0..1 + self.choose(3)).map(|_| self.expression(Type::Float, 1)).collect();
                let body = self.loop_body(&name, Type::Float, depth, true);
                format!("for {name} in [{}] {{ {body} }}", items.join(", "))
            }
            13 => {
                let subject = self.expression(Type::Int, 1);
                let condition = self.expression(Type::Bool, 1);
                let cases: Vec<String> = (0..3).map(|_| self.block(depth - 1)).collect();
                format!(
                    "switch {subject} {{ 1 => {{ {} }}, 2 if {condition} => {{ {} }}, 3..6 => {{ {} }}, _ => () }}",
                    cases[0], cases[1], cases[2]
                )
            }
            14 if self.this.is_some() => format!("this = {};", self.expression(Type::Float, 2)),
            _ => {
                let condition = self.expression(Type::Bool, 2);
                let value =
                    if self.returns == Type::Outputs { self.outputs(1) } else { self.expression(self.returns, 1) };
                format!("if {condition} {{ return {value}; }}")
            }
        }
    }

    fn loop_body(&mut self, name: &str, of: Type, depth: u8, may_continue: bool) -> String {
        let scope = self.variables.len();
        // Counters of `while` loops must not be assigned, or the loop may not end.
        let visible = if of == Type::Int { Vec::new() } else { vec![(name.to_owned(), of)] };
        self.variables.extend(visible);
        let outer = self.in_loop.replace(may_continue);
        let body = self.block(depth - 1);
        self.in_loop = outer;
        self.variables.truncate(scope);
        if of == Type::Int && self.choose(2) == 0 {
            let target = self.variable(Type::Float);
            return target.map_or(body.clone(), |target| format!("{body} {target} += {name} * 0.25;"));
        }
        body
    }

    fn simple_statement(&mut self) -> String {
        match self.choose(9) {
            0 | 1 if self.returns == Type::Outputs => {
                let key = FLOAT_OUTPUTS[usize::from(self.choose(5))];
                format!("out.{key} = {};", self.expression(Type::Float, 2))
            }
            2 if self.returns == Type::Outputs => format!("out.base_color = {};", self.expression(Type::Vector, 2)),
            3 if self.in_loop.is_some() => format!("if {} {{ break; }}", self.expression(Type::Bool, 1)),
            4 if self.in_loop == Some(true) => format!("if {} {{ continue; }}", self.expression(Type::Bool, 1)),
            5 => match self.variable(Type::Vector) {
                Some(name) => {
                    let channel = ["x", "y", "z"][usize::from(self.choose(3))];
                    let operator = ["=", "+=", "*="][usize::from(self.choose(3))];
                    format!("{name}.{channel} {operator} {};", self.expression(Type::Float, 1))
                }
                None => ";".into(),
            },
            _ => {
                let of = self.simple_type();
                match self.variable(of) {
                    Some(name) => {
                        let operators: &[&str] = if of == Type::Bool { &["="] } else { &["=", "+=", "-=", "*="] };
                        let operator = operators[usize::from(self.choose(4)) % operators.len()];
                        format!("{name} {operator} {};", self.expression(of, 2))
                    }
                    None => ";".into(),
                }
            }
        }
    }

    fn outputs(&mut self, depth: u8) -> String {
        let mut record = String::from("out");
        if self.choose(3) == 0 {
            let (roughness, color) = (self.expression(Type::Float, depth), self.expression(Type::Vector, depth));
            record = format!("#{{ roughness: {roughness}, base_color: {color} }}");
            if self.choose(2) == 0 {
                record = format!("(out + {record})");
            }
        }
        if depth > 0 && self.choose(4) == 3 {
            let (condition, other) = (self.expression(Type::Bool, 1), self.outputs(0));
            record = format!("if {condition} {{ {record} }} else {{ {other} }}");
        }
        record
    }

    fn expression(&mut self, of: Type, depth: u8) -> String {
        if depth > 0 && self.choose(12) == 11 {
            let (condition, first, second) =
                (self.expression(Type::Bool, 1), self.expression(of, depth - 1), self.expression(of, depth - 1));
            return format!("(if {condition} {{ {first} }} else {{ {second} }})");
        }
        if depth > 0
            && self.choose(8) == 7
            && let Some(call) = self.call(of, depth)
        {
            return call;
        }
        match of {
            Type::Float => self.float(depth),
            Type::Int => self.int(depth),
            Type::Bool => self.bool(depth),
            Type::Vector => self.vector(depth),
            Type::Outputs => self.outputs(depth),
        }
    }

    fn call(&mut self, of: Type, depth: u8) -> Option<String> {
        let fitting: Vec<_> = self.functions.iter().filter(|(_, _, result)| *result == of).cloned().collect();
        let (name, parameters, _) = fitting.get(usize::from(self.choose(4)))?.clone();
        let arguments: Vec<String> = parameters.iter().map(|t| self.expression(*t, depth - 1)).collect();
        let arguments = arguments.join(", ");
        if name.starts_with('m') {
            let target = self.variable(Type::Float)?;
            return Some(format!("{target}.{name}({arguments})"));
        }
        Some(format!("{name}({arguments})"))
    }

    fn float(&mut self, depth: u8) -> String {
        const LITERALS: [&str; 12] =
            ["0.5", "0.0", "1.0", "-1.0", "2.0", "0.25", "1e-10", "3e30", "-0.1", "7.0", "1.0000001", "0.3"];
        if depth == 0 {
            return match self.choose(4) {
                0 => LITERALS[usize::from(self.choose(12))].into(),
                1 if self.has_hit => {
                    ["hit.distance", "hit.curvature", "hit.time", "p.half"][usize::from(self.choose(4))].into()
                }
                2 if self.this.is_some() => "this".into(),
                _ => self.variable(Type::Float).unwrap_or_else(|| "0.75".into()),
            };
        }
        let d = depth - 1;
        match self.choose(24) {
            0 | 1 => self.float(0),
            2..=6 => {
                let operator = ["+", "-", "*", "/", "%"][usize::from(self.choose(5))];
                format!("({} {operator} {})", self.expression(Type::Float, d), self.expression(Type::Float, d))
            }
            7 => format!("{}.{}", self.expression(Type::Vector, d), ["x", "y", "z"][usize::from(self.choose(3))]),
            8 => format!("clamp({}, {}, {})", self.expression(Type::Float, d), self.float(0), self.float(0)),
            9 => format!(
                "mix({}, {}, {})",
                self.float(0),
                self.expression(Type::Float, d),
                self.expression(Type::Float, d)
            ),
            10 => format!("step({}, {})", self.expression(Type::Float, d), self.expression(Type::Float, d)),
            11 => format!("smoothstep({}, {}, {})", self.float(0), self.float(0), self.expression(Type::Float, d)),
            12 => {
                let name = ["sqrt", "abs", "floor", "sin", "exp", "ln"][usize::from(self.choose(6))];
                format!("{name}({})", self.expression(Type::Float, d))
            }
            13 => {
                let name = ["saturate", "fract", "sign", "hash", "native", "round"][usize::from(self.choose(6))];
                format!("{name}({})", self.expression(Type::Float, d))
            }
            14 => {
                let name = ["min", "max", "mod", "pow"][usize::from(self.choose(4))];
                format!("{name}({}, {})", self.expression(Type::Float, d), self.expression(Type::Float, d))
            }
            15 => format!("dot({}, {})", self.expression(Type::Vector, d), self.expression(Type::Vector, d)),
            16 => {
                let name = ["length", "luminance"][usize::from(self.choose(2))];
                format!("{name}({})", self.expression(Type::Vector, d))
            }
            17 => format!("distance({}, {})", self.expression(Type::Vector, d), self.expression(Type::Vector, d)),
            18 => format!("remap({}, 0.5, 2.0, {}, {})", self.expression(Type::Float, d), self.float(0), self.float(0)),
            19 => format!("({} * {})", self.expression(Type::Int, d), self.float(0)),
            20 if self.has_hit => format!("hit.light({}).visibility", self.choose(2)),
            21 if self.has_hit => "native(hit)".into(),
            22 => format!("saturate({}).abs()", self.expression(Type::Float, d)),
            _ => format!("(-({}))", self.expression(Type::Float, d)),
        }
    }

    fn int(&mut self, depth: u8) -> String {
        if depth == 0 {
            return match self.choose(3) {
                0 => ["1", "0", "2", "3", "-4", "5"][usize::from(self.choose(6))].into(),
                1 if self.has_hit => ["hit.object_id", "hit.polygon_id", "p.three"][usize::from(self.choose(3))].into(),
                _ => self.variable(Type::Int).unwrap_or_else(|| "2".into()),
            };
        }
        let operator = ["+", "-", "*", "%", "/"][usize::from(self.choose(5))];
        format!("({} {operator} {})", self.expression(Type::Int, depth - 1), self.int(0))
    }

    fn bool(&mut self, depth: u8) -> String {
        if depth == 0 {
            return match self.choose(4) {
                0 if self.has_hit => "hit.front_facing".into(),
                1 if self.has_hit => "hit.path_kind == \"camera\"".into(),
                2 if self.has_hit => ["p.texture != ()", "p.on"][usize::from(self.choose(2))].into(),
                _ => self.variable(Type::Bool).unwrap_or_else(|| "true".into()),
            };
        }
        let d = depth - 1;
        match self.choose(6) {
            0 | 1 => {
                let operator = ["<", ">", "<=", ">=", "==", "!="][usize::from(self.choose(6))];
                format!("{} {operator} {}", self.expression(Type::Float, d), self.expression(Type::Float, d))
            }
            2 => {
                let operator = ["<", ">", "<=", ">=", "==", "!="][usize::from(self.choose(6))];
                format!("{} {operator} {}", self.expression(Type::Int, d), self.expression(Type::Int, d))
            }
            3 => format!("({} && {})", self.expression(Type::Bool, d), self.expression(Type::Bool, d)),
            4 => format!("({} || {})", self.expression(Type::Bool, d), self.expression(Type::Bool, d)),
            _ => format!("!({})", self.expression(Type::Bool, d)),
        }
    }

    fn vector(&mut self, depth: u8) -> String {
        if depth == 0 {
            return match self.choose(3) {
                0 if self.has_hit => {
                    ["hit.normal", "hit.position", "hit.irradiance"][usize::from(self.choose(3))].into()
                }
                _ => self.variable(Type::Vector).unwrap_or_else(|| "vec3(0.25, 0.5, 1.0)".into()),
            };
        }
        let d = depth - 1;
        match self.choose(12) {
            0..=3 => {
                let operator = ["+", "-", "*", "/"][usize::from(self.choose(4))];
                format!("({} {operator} {})", self.expression(Type::Vector, d), self.expression(Type::Vector, d))
            }
            4 => format!("({} * {})", self.expression(Type::Vector, d), self.expression(Type::Float, d)),
            5 => format!("vec3({}, {}, {})", self.expression(Type::Float, d), self.float(0), self.float(0)),
            6 => format!("mix({}, {}, {})", self.vector(0), self.expression(Type::Vector, d), self.float(0)),
            7 => format!("normalize({})", self.expression(Type::Vector, d)),
            8 => format!("cross({}, {})", self.expression(Type::Vector, d), self.expression(Type::Vector, d)),
            9 => format!("reflect({}, {})", self.expression(Type::Vector, d), self.vector(0)),
            10 => format!("{}.zxy", self.expression(Type::Vector, d)),
            _ => format!("abs({})", self.expression(Type::Vector, d)),
        }
    }
}

fn write_script(choices: &[u8]) -> String {
    Writer {
        choices: choices.iter(),
        variables: Vec::new(),
        functions: Vec::new(),
        names: 0,
        in_loop: None,
        returns: Type::Float,
        has_hit: false,
        this: None,
    }
    .script()
}

fn number(limit: f32) -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => -2.0..2.0_f32,
        1 => -1e3..1e3_f32,
        3 => prop::sample::select(vec![0.0, -0.0, 1.0, -1.0, 0.5, 1e-30, f32::MIN_POSITIVE, 1e9, limit, -limit]),
    ]
}

fn positive(limit: f32) -> impl Strategy<Value = f32> {
    number(limit).prop_map(f32::abs)
}

fn vector(limit: f32) -> impl Strategy<Value = Vec3> {
    (number(limit), number(limit), number(limit)).prop_map(Vec3::from)
}

fn hit() -> impl Strategy<Value = Hit> {
    let vectors = (vector(LIMIT), vector(1.0), vector(LIMIT));
    let floats = (positive(LIMIT), number(LIMIT), number(LIMIT), 0.0..=1.0_f32);
    let ints = (prop_oneof![1..6_i64, Just(i64::from(u32::MAX))], 0..6_i64);
    (vectors, floats, ints, any::<bool>(), any::<u8>()).prop_map(|(vectors, floats, ints, front_facing, path_kind)| {
        Hit {
            position: vectors.0,
            normal: vectors.1.try_normalize().unwrap_or(Vec3::Z),
            irradiance: vectors.2.abs(),
            distance: floats.0,
            curvature: floats.1,
            time: floats.2,
            light: floats.3,
            object_id: ints.0,
            polygon_id: ints.1,
            front_facing,
            path_kind,
        }
    })
}

fn params() -> Map {
    let mut map = Map::new();
    map.insert("half".into(), 0.5_f32.into());
    map.insert("three".into(), 3_i64.into());
    map.insert("on".into(), true.into());
    map.insert("texture".into(), Dynamic::UNIT);
    map
}

fn run(engine: &Engine, ast: &rhai::AST, hit: Hit) -> Option<Map> {
    let result = engine.call_fn::<Dynamic>(&mut Scope::new(), ast, "surface", (hit, params())).ok()?;
    Some(result.try_cast::<Map>().expect("scripts return records"))
}

fn channels(value: &Dynamic) -> Vec<f32> {
    if let Ok(x) = value.as_float() {
        vec![x]
    } else if let Ok(n) = value.as_int() {
        vec![n as f32]
    } else {
        value.clone().try_cast::<Vec3>().expect("outputs are numbers and vectors").to_array().to_vec()
    }
}

fn facts(found: &Analysis) -> Vec<(String, OutputFact)> {
    let outputs = OutputSet::all().iter_names().map(|(name, flag)| (name.to_lowercase(), found.output(flag).clone()));
    outputs.chain(found.aovs.iter().map(|(name, fact)| (format!("aov_{name}"), fact.clone()))).collect()
}

fn check(script: &str, hits: &[Hit]) -> Result<bool, TestCaseError> {
    let values =
        [("half", Value::Float(0.5)), ("three", Value::Int(3)), ("on", Value::Bool(true)), ("texture", Value::Unit)];
    let found = analysis(script, &values);
    let engine = engine();
    let ast = engine.compile(script).map_err(|error| TestCaseError::fail(format!("{error}\n{script}")))?;
    if !found.complete {
        return Ok(false);
    }
    let facts = facts(&found);
    let fail = |what: String| Err(TestCaseError::fail(format!("{what}\n{script}\n{found}")));
    for (i, hit) in hits.iter().enumerate() {
        let Some(outputs) = run(&engine, &ast, *hit) else { continue };
        for key in outputs.keys() {
            if !facts.iter().any(|(name, fact)| name == key.as_str() && fact.may) {
                return fail(format!("`{key}` is written at {hit:?}"));
            }
        }
        for (name, fact) in &facts {
            let Some(value) = outputs.get(name.as_str()) else {
                if fact.always {
                    return fail(format!("`{name}` is not written at {hit:?}"));
                }
                continue;
            };
            let value = channels(value);
            if let Some([low, high]) = fact.range
                && !value.iter().all(|x| (low..=high).contains(x))
            {
                return fail(format!("`{name}` is {value:?} at {hit:?}"));
            }
            let constant = match &fact.constant {
                Some(Value::Float(x)) => Some(vec![*x]),
                Some(Value::Int(n)) => Some(vec![*n as f32]),
                Some(Value::Vec3(v)) => Some(v.to_array().to_vec()),
                Some(other) => return fail(format!("`{name}` is said to be {other:?}")),
                None => None,
            };
            if constant.is_some_and(|constant| constant != value) {
                return fail(format!("`{name}` is {value:?} at {hit:?}"));
            }
        }
        let other = &hits[(i + 1) % hits.len()];
        for input in VARIED {
            let Some(varied) = run(&engine, &ast, hit.with(input, other)) else { continue };
            for (name, fact) in facts.iter().filter(|(_, fact)| !fact.inputs.contains(input)) {
                let values = |outputs: &Map| outputs.get(name.as_str()).map(channels);
                // NaN is not equal to itself, but nothing has changed.
                let same = match (values(&outputs), values(&varied)) {
                    (Some(a), Some(b)) => a.iter().zip(&b).all(|(a, b)| a == b || a.is_nan() && b.is_nan()),
                    (a, b) => a.is_none() && b.is_none(),
                };
                if !same {
                    let _ = fact;
                    return fail(format!("`{name}` depends on {input:?}, from {hit:?} to {other:?}"));
                }
            }
        }
    }
    Ok(true)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn facts_hold(choices in prop::collection::vec(any::<u8>(), 0..300), hits in prop::collection::vec(hit(), 6)) {
        check(&write_script(&choices), &hits)?;
    }
}
