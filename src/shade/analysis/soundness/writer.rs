//! Scripts at random: every construct that the analysis follows, and values that try its bounds.

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
    /// A closure of a float that gives a float.
    Closure,
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

    fn fallback(&self, input: &str, literal: &str) -> String {
        if self.has_hit { input.into() } else { literal.into() }
    }

    fn script(&mut self) -> String {
        let mut script = String::new();
        for _ in 0..self.choose(3) {
            script += &self.function();
        }
        self.has_hit = true;
        self.returns = Type::Outputs;
        self.variables = vec![("out".into(), Type::Outputs)];
        let declared = [self.declare(Type::Float), self.declare(Type::Vector)].concat();
        let count = 1 + self.choose(6);
        let body = [declared, self.statements(count, 3)].concat();
        let end = [self.write_output(), self.write_output(), self.outputs(2)].concat();
        script += "fn facing(hit) { max(0.0, dot(hit.normal, hit.light(0).direction)) }\n";
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
        let change = if is_method { format!("this = {};", self.expression(Type::Float, 1)) } else { String::new() };
        let end = change + &*self.expression(result, 2);
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
        match self.choose(18) {
            16 | 17 => self.closure(),
            0..=3 => self.simple_statement(),
            4 | 5 => {
                let of = self.simple_type();
                self.declare(of)
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

    fn declare(&mut self, of: Type) -> String {
        let value = self.expression(of, 2);
        let name = self.name("v");
        self.variables.push((name.clone(), of));
        format!("let {name} = {value};")
    }

    fn closure(&mut self) -> String {
        let (name, parameter) = (self.name("g"), self.name("x"));
        let scope = self.variables.len();
        self.variables.push((parameter.clone(), Type::Float));
        let outer = (self.returns, self.in_loop.take(), self.this.take());
        self.returns = Type::Float;
        let count = self.choose(3);
        let body = self.statements(count, 1);
        let end = self.expression(Type::Float, 2);
        (self.returns, self.in_loop, self.this) = outer;
        self.variables.truncate(scope);
        self.variables.push((name.clone(), Type::Closure));
        format!("let {name} = |{parameter}| {{ {body} {end} }};")
    }

    fn write_output(&mut self) -> String {
        let key = FLOAT_OUTPUTS[usize::from(self.choose(5))];
        format!("out.{key} = {};", self.expression(Type::Float, 2))
    }

    fn simple_statement(&mut self) -> String {
        match self.choose(9) {
            0 | 1 if self.returns == Type::Outputs => self.write_output(),
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
        if depth > 0 && self.choose(16) == 15 {
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
            Type::Outputs | Type::Closure => self.outputs(depth),
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
                _ => self.variable(Type::Float).unwrap_or_else(|| self.fallback("hit.curvature", "0.75")),
            };
        }
        let d = depth - 1;
        match self.choose(36) {
            33 | 34 => {
                let (v, x, y) = (self.expression(Type::Vector, d), self.expression(Type::Float, d), self.float(0));
                match self.choose(12) {
                    0 => format!("stripes({x}, {y})"),
                    1 => format!("stripes({x}, {y}, 0.1)"),
                    2 => format!("checker({v}, {x})"),
                    3 => format!("dots({v}.xy, {x})"),
                    4 => format!("dots({v}.xy, {x}, {y})"),
                    5 => format!("hatch({v}.xy, {x}, {y})"),
                    6 => format!("cross_hatch({v}.xy, {x}, {y})"),
                    7 => format!("rotate({v}.xy, {x}).y"),
                    8 => format!("worley({v}).y"),
                    9 => format!("fbm({v}, 3, 2.5, 0.4)"),
                    10 => format!("temperature({x}).y"),
                    _ => format!("mix_oklab({v}, hsl({x}, saturate({y}), 0.5), {y}).z"),
                }
            }
            28 if self.has_hit => {
                let default = self.float(0);
                format!("hit.attribute(\"wear\", to_float({default}))")
            }
            29 if self.has_hit => ["hit.attribute(\"missing\", 0.5)", "hit.attribute(\"tint\", vec3(0.5)).y"]
                [usize::from(self.choose(2))]
            .into(),
            30..=32 => match self.variable(Type::Closure) {
                Some(name) => format!("{name}.call({})", self.expression(Type::Float, d)),
                None => self.float(0),
            },
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
                let name = ["sqrt", "abs", "floor", "sin", "exp", "ln", "degrees"][usize::from(self.choose(7))];
                format!("{name}({})", self.expression(Type::Float, d))
            }
            13 => {
                let name = ["saturate", "fract", "sign", "hash", "native", "round"][usize::from(self.choose(6))];
                format!("{name}({})", self.expression(Type::Float, d))
            }
            14 => {
                let name = ["min", "max", "mod", "pow", "atan"][usize::from(self.choose(5))];
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
            21 if self.has_hit => {
                ["native(hit)", "hit.texture(p.map).g", "facing(hit)", "hit.texture(p.mip).r", "hit.footprint"]
                    [usize::from(self.choose(5))]
                .into()
            }
            23 => format!("fbm({}, 2)", self.expression(Type::Vector, d)),
            24 => format!(
                "ramp({}, [[0.0, {}], [1.0, {}]])",
                self.expression(Type::Float, d),
                self.float(0),
                self.float(0)
            ),
            22 => format!("saturate({}).abs()", self.expression(Type::Float, d)),
            _ => format!("(-({}))", self.expression(Type::Float, d)),
        }
    }

    fn int(&mut self, depth: u8) -> String {
        if depth == 0 {
            return match self.choose(3) {
                0 => ["1", "0", "2", "3", "-4", "5"][usize::from(self.choose(6))].into(),
                1 if self.has_hit => ["hit.object_id", "hit.polygon_id", "p.three", "hit.attribute(\"count\", 1)"]
                    [usize::from(self.choose(4))]
                .into(),
                _ => self.variable(Type::Int).unwrap_or_else(|| self.fallback("hit.polygon_id", "2")),
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
                2 if self.has_hit => ["p.none != ()", "p.on", "p.map != ()"][usize::from(self.choose(3))].into(),
                _ => self.variable(Type::Bool).unwrap_or_else(|| self.fallback("hit.front_facing", "true")),
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
                0 if self.has_hit => ["hit.normal", "hit.position", "hit.irradiance", "vec3(hit.uv, 0.5)"]
                    [usize::from(self.choose(4))]
                .into(),
                _ => self
                    .variable(Type::Vector)
                    .unwrap_or_else(|| self.fallback("hit.position", "vec3(0.25, -0.5, 1.0)")),
            };
        }
        let d = depth - 1;
        match self.choose(16) {
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
            11 => format!("refract({}, {}, {})", self.expression(Type::Vector, d), self.vector(0), self.float(0)),
            12 => {
                let arguments = (self.float(0), self.float(0), self.expression(Type::Float, d));
                format!("hsv({}, saturate({}), {})", arguments.0, arguments.1, arguments.2)
            }
            13 => format!("clamp({}, {}, {})", self.expression(Type::Vector, d), self.float(0), self.vector(0)),
            14 => format!("hash_color({})", self.expression(Type::Int, d)),
            _ => format!("abs({})", self.expression(Type::Vector, d)),
        }
    }
}

/// The script that these choices spell.
pub(super) fn script(choices: &[u8]) -> String {
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
