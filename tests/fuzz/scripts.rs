//! Scripts at random: every construct of the language that kernels know, on values that try their edges.
//!
//! A script is spelled by bytes: every choice takes the next one, and bytes that have run out choose the simplest form,
//! so that any bytes spell a script, and a fuzzer that shortens the bytes shortens the script.

mod expressions;

use std::fmt::Write as _;

/// Types that expressions are written for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Type {
    Float,
    Int,
    Bool,
    Vec2,
    Vec3,
    Vec4,
    /// `#{ a: float, b: vec3, c: #{ d: int } }`
    Record,
    /// Three floats.
    Floats,
    /// Takes a float, gives a float; `.call(x)`.
    Closure,
    /// An int or a float, whichever branch was taken.
    Number,
}

const SIMPLE: [Type; 8] =
    [Type::Float, Type::Vec3, Type::Int, Type::Bool, Type::Vec2, Type::Vec4, Type::Record, Type::Floats];

struct Variable {
    name: String,
    of: Type,
    /// Whether it may be assigned: not constants, nor counters that a loop needs.
    changes: bool,
    /// Captured by a closure: passing it on by name is a different matter.
    captured: bool,
}

struct Writer<'a> {
    choices: std::slice::Iter<'a, u8>,
    variables: Vec<Variable>,
    functions: Vec<(String, Vec<Type>, Type)>,
    names: usize,
    loops: usize,
    /// What `return` gives here; `None` for the record of outputs.
    returns: Option<Type>,
    has_hit: bool,
    this: bool,
    /// Statements that may still be written: bounds the size.
    budget: usize,
}

/// The script that these choices spell.
#[must_use]
pub fn script(choices: &[u8]) -> String {
    let mut writer = Writer {
        choices: choices.iter(),
        variables: Vec::new(),
        functions: Vec::new(),
        names: 0,
        loops: 0,
        returns: None,
        has_hit: false,
        this: false,
        budget: 24,
    };
    writer.script()
}

/// What scripts say of hits, and what of lines instead. Longer words come first.
const OF_LINES: [(&str, &str); 36] = [
    ("fn surface(hit, p)", "fn line(pair, p)"),
    ("hit.light_count", "3"),
    ("hit.light(", "lamp("),
    ("hit.texture(p.map)", "texture(p.map, pair.pixel)"),
    ("hit.attribute(\"wear\", 0.25)", "pair.opacity"),
    ("hit.uv_footprint", "pair.distance"),
    ("hit.uv", "pair.pixel"),
    ("hit.footprint", "pair.distance"),
    ("hit.distance", "pair.distance"),
    ("hit.curvature", "pair.width"),
    ("hit.time", "pair.opacity"),
    ("hit.pixels_per_unit", "pair.other.depth"),
    ("hit.depth", "pair.depth"),
    ("hit.object_id", "pair.object_id"),
    ("hit.polygon_id", "pair.other.object_id"),
    ("hit.material_id", "pair.other.material_id"),
    ("hit.front_facing", "pair.own"),
    ("hit.path_kind == \"camera\"", "pair.kind == \"crease\""),
    ("hit.path_kind", "pair.path_kind"),
    ("hit.normal", "pair.normal"),
    ("hit.position", "pair.other.position"),
    ("hit.irradiance", "pair.color"),
    ("hit.incoming", "pair.other.normal"),
    ("hit.tangent", "vec4(pair.feature, 1.0)"),
    ("hit.color", "vec4(pair.other.feature, 0.5)"),
    ("line_width", "opacity"),
    ("line_color", "color"),
    ("base_color", "color"),
    ("emission", "color"),
    ("o.priority", "o.opacity"),
    ("out.roughness", "out.opacity"),
    ("out.metallic", "out.opacity"),
    ("out.specular", "out.opacity"),
    ("out.aov_one", "out.opacity"),
    ("\"feature\"", "\"color\""),
    ("\"aov_two\"", "\"color\""),
];

/// The script that these choices spell, as one that styles lines.
#[must_use]
pub fn line_script(choices: &[u8]) -> String {
    let text = OF_LINES.iter().fold(script(choices), |text, (of_hits, of_lines)| text.replace(of_hits, of_lines));
    let head = "fn surface(hit, p) { #{} }\n\
        fn lamp(i) { #{ direction: vec3(0.25 * i, 1, 0), radiance: vec3(i, 0.5, 2), visibility: 0.75 } }\n";
    format!("{head}{text}")
}

impl Writer<'_> {
    fn choose(&mut self, count: usize) -> usize {
        self.choices.next().map_or(0, |byte| usize::from(*byte) % count)
    }

    fn pick<'t>(&mut self, texts: &[&'t str]) -> &'t str {
        texts[self.choose(texts.len())]
    }

    fn name(&mut self, prefix: &str) -> String {
        self.names += 1;
        format!("{prefix}{}", self.names)
    }

    fn variable(&mut self, of: Type, to_change: bool) -> Option<String> {
        let names: Vec<String> =
            self.variables.iter().filter(|v| v.of == of && (v.changes || !to_change)).map(|v| v.name.clone()).collect();
        let choice = self.choose(251);
        (!names.is_empty()).then(|| names[choice % names.len()].clone())
    }

    fn script(&mut self) -> String {
        let mut text = String::from(
            "fn params() { #{ half: 0.5, three: 3, tint: rgb(0.2, 0.5, 0.9), name: \"red\", on: true, map: (), steps: [0.1, 0.7] } }\n",
        );
        for _ in 0..self.choose(4) {
            let function = self.function();
            text.push_str(&function);
        }
        self.has_hit = true;
        self.returns = None;
        self.this = false;
        self.budget = 24;
        self.variables.clear();
        let first = [Type::Float, Type::Vec3, Type::Int].map(|of| self.declare(of)).concat();
        let count = 2 + self.choose(7);
        let body = self.statements(count, 3);
        let end = self.outputs();
        let _ = writeln!(text, "fn surface(hit, p) {{ let out = #{{}}; {first} {body} {end} }}");
        text
    }

    fn function(&mut self) -> String {
        let is_method = self.choose(4) == 3;
        let name = self.name(if is_method { "m" } else { "f" });
        let result = SIMPLE[self.choose(SIMPLE.len())];
        let parameters: Vec<Type> = (0..self.choose(3)).map(|_| SIMPLE[self.choose(SIMPLE.len())]).collect();
        self.has_hit = false;
        self.returns = Some(result);
        self.this = is_method;
        self.budget = 6;
        self.variables = (0..).zip(&parameters).map(|(i, of)| variable(format!("a{i}"), *of)).collect();
        let count = self.choose(4);
        let body = self.statements(count, 2);
        let change = if is_method { format!("this = {};", self.expression(Type::Float, 1)) } else { String::new() };
        let end = self.expression(result, 2);
        let names: Vec<String> = (0..parameters.len()).map(|i| format!("a{i}")).collect();
        self.this = false;
        self.functions.push((name.clone(), parameters, result));
        format!("fn {name}({}) {{ {body} {change} {end} }}\n", names.join(", "))
    }

    /// Statements in the current scope.
    fn statements(&mut self, count: usize, depth: usize) -> String {
        let mut text = String::new();
        for _ in 0..count {
            if self.budget == 0 {
                break;
            }
            self.budget -= 1;
            let statement = self.statement(depth);
            text.push_str(&statement);
            text.push(' ');
        }
        text
    }

    fn block(&mut self, depth: usize) -> String {
        let scope = self.variables.len();
        let count = 1 + self.choose(3);
        let text = self.statements(count, depth);
        self.variables.truncate(scope);
        text
    }

    fn statement(&mut self, depth: usize) -> String {
        if depth == 0 {
            return self.simple_statement();
        }
        match self.choose(24) {
            0..=4 => self.simple_statement(),
            5..=7 => {
                let of = SIMPLE[self.choose(SIMPLE.len())];
                self.declare(of)
            }
            8..=10 => {
                let (condition, first) = (self.expression(Type::Bool, 2), self.block(depth - 1));
                match self.choose(3) {
                    0 => format!("if {condition} {{ {first} }}"),
                    1 => format!("if {condition} {{ {first} }} else {{ {} }}", self.block(depth - 1)),
                    _ => {
                        let other = self.expression(Type::Bool, 1);
                        let (second, third) = (self.block(depth - 1), self.block(depth - 1));
                        format!("if {condition} {{ {first} }} else if {other} {{ {second} }} else {{ {third} }}")
                    }
                }
            }
            11 | 12 => self.for_loop(depth),
            13 => {
                let name = self.name("i");
                let (limit, condition) = (self.choose(9), self.expression(Type::Bool, 1));
                let body = self.loop_body(None, depth);
                let joined = self.pick(&["&&", "||"]);
                let guard = if joined == "||" { format!("({name} < 40 && {condition})") } else { condition };
                format!("let {name} = 0; while {name} < {limit} {joined} {guard} {{ {name} += 1; {body} }}")
            }
            14 => {
                let name = self.name("i");
                let body = self.loop_body(None, depth);
                let end = self.expression(Type::Int, 1);
                let limit = self.pick(&["3", "7", "200"]);
                format!(
                    "let {name} = 0; loop {{ {name} += 1; if {name} > {limit} || {name} == {end} {{ break; }} {body} }}"
                )
            }
            15 => {
                let name = self.name("i");
                let condition = self.expression(Type::Bool, 1);
                // `continue` in a `do` loop would pass by its test.
                let loops = std::mem::take(&mut self.loops);
                let body = self.block(depth - 1);
                self.loops = loops;
                format!("let {name} = 0; do {{ {name} += 1; {body} }} while {name} < 4 && {condition};")
            }
            16 | 17 => self.switch(depth),
            18 => {
                // A closure that may see and change what is around it.
                let name = self.name("c");
                let scope = self.variables.len();
                let parameter = self.name("x");
                self.variables.push(variable(parameter.clone(), Type::Float));
                let (loops, returns) = (std::mem::take(&mut self.loops), self.returns);
                let body = match self.choose(3) {
                    0 => self.expression(Type::Float, 2),
                    1 => {
                        let set = self.simple_assignment();
                        format!("{{ {set} {} }}", self.expression(Type::Float, 1))
                    }
                    _ => {
                        let condition = self.expression(Type::Bool, 1);
                        let (first, second) = (self.expression(Type::Float, 1), self.expression(Type::Float, 1));
                        format!("{{ if {condition} {{ return {first}; }} {second} }}")
                    }
                };
                (self.loops, self.returns) = (loops, returns);
                self.variables.truncate(scope);
                for variable in &mut self.variables {
                    variable.captured = true;
                }
                let text = format!("let {name} = |{parameter}| {body};");
                self.variables.push(variable(name, Type::Closure));
                text
            }
            19 if self.this => format!("this = {};", self.expression(Type::Float, 2)),
            20 => {
                let condition = self.expression(Type::Bool, 2);
                let value = self.returned();
                format!("if {condition} {{ return {value}; }}")
            }
            21 if self.choose(3) == 2 => format!("if {} {{ throw \"no\"; }}", self.expression(Type::Bool, 2)),
            22 => {
                let name = self.name("n");
                let (condition, int, float) =
                    (self.expression(Type::Bool, 1), self.expression(Type::Int, 1), self.expression(Type::Float, 1));
                self.variables.push(variable(name.clone(), Type::Number));
                format!("let {name} = if {condition} {{ {int} }} else {{ {float} }};")
            }
            _ => self.simple_statement(),
        }
    }

    fn returned(&mut self) -> String {
        match self.returns {
            Some(of) => self.expression(of, 1),
            None => self.outputs(),
        }
    }

    fn for_loop(&mut self, depth: usize) -> String {
        let name = self.name("i");
        match self.choose(7) {
            0 | 1 => {
                let end = self.pick(&["3", "5", "=4"]);
                let body = self.loop_body(Some((&name, Type::Int)), depth);
                format!("for {name} in 0..{end} {{ {body} }}")
            }
            2 => {
                let end = self.expression(Type::Int, 1);
                let body = self.loop_body(Some((&name, Type::Int)), depth);
                format!("for {name} in 0..min({end}, 9) {{ {body} }}")
            }
            3 => {
                let body = self.loop_body(Some((&name, Type::Int)), depth);
                format!("for {name} in -2..100 {{ {body} }}")
            }
            4 if self.has_hit => {
                let target = self.variable(Type::Vec3, true);
                let body = self.loop_body(Some((&name, Type::Int)), depth);
                let sum = target.map_or(String::new(), |target| {
                    let part = self.pick(&["direction", "radiance"]);
                    format!("{target} += hit.light({name}).{part} * hit.light({name}).visibility;")
                });
                format!("for {name} in 0..hit.light_count {{ {sum} {body} }}")
            }
            _ => {
                let (index, items) = (self.name("k"), self.expression(Type::Floats, 1));
                let scope = self.variables.len();
                self.variables.push(fixed(index.clone(), Type::Int));
                let body = self.loop_body(Some((&name, Type::Float)), depth);
                self.variables.truncate(scope);
                format!("for ({name}, {index}) in {items} {{ {body} }}")
            }
        }
    }

    fn loop_body(&mut self, counter: Option<(&str, Type)>, depth: usize) -> String {
        let scope = self.variables.len();
        self.variables.extend(counter.map(|(name, of)| fixed(name.to_owned(), of)));
        self.loops += 1;
        let body = self.block(depth - 1);
        self.loops -= 1;
        self.variables.truncate(scope);
        body
    }

    fn switch(&mut self, depth: usize) -> String {
        let cases: Vec<String> = (0..4).map(|_| self.block(depth - 1)).collect();
        match self.choose(4) {
            0 => {
                let (subject, condition) = (self.expression(Type::Int, 2), self.expression(Type::Bool, 1));
                format!(
                    "switch {subject} {{ 1 => {{ {} }}, 2 | 3 => {{ {} }}, -1 if {condition} => {{ {} }}, _ => {{ {} }} }}",
                    cases[0], cases[1], cases[2], cases[3]
                )
            }
            1 => {
                let subject = self.expression(Type::Int, 2);
                format!(
                    "switch {subject} {{ 0 => {{ {} }}, 1..4 => {{ {} }}, 4..=9 => {{ {} }} }}",
                    cases[0], cases[1], cases[2]
                )
            }
            2 if self.has_hit => format!(
                "switch hit.path_kind {{ \"camera\" => {{ {} }}, \"reflection\" => {{ {} }}, _ => {{ {} }} }}",
                cases[0], cases[1], cases[2]
            ),
            _ => {
                let subject = self.expression(Type::Bool, 2);
                format!("switch {subject} {{ true => {{ {} }}, false => {{ {} }} }}", cases[0], cases[1])
            }
        }
    }

    fn declare(&mut self, of: Type) -> String {
        let value = self.expression(of, 2);
        // Now and then an old name is used again.
        let old = if self.choose(6) == 5 { self.variable(of, false) } else { None };
        let name = old.unwrap_or_else(|| self.name("v"));
        let is_constant = self.choose(12) == 11;
        self.variables.push(Variable { name: name.clone(), of, changes: !is_constant, captured: false });
        format!("{} {name} = {value};", if is_constant { "const" } else { "let" })
    }

    fn simple_statement(&mut self) -> String {
        match self.choose(10) {
            0 | 1 if self.returns.is_none() => {
                let key = self.pick(&["roughness", "line_width", "metallic", "aov_one", "opacity", "specular"]);
                format!("out.{key} = {};", self.expression(Type::Float, 2))
            }
            2 if self.returns.is_none() => {
                let key = self.pick(&["base_color", "feature", "line_color", "aov_two"]);
                format!("out[\"{key}\"] = {};", self.expression(Type::Vec3, 2))
            }
            3 if self.loops > 0 => format!("if {} {{ break; }}", self.expression(Type::Bool, 1)),
            4 if self.loops > 0 => format!("if {} {{ continue; }}", self.expression(Type::Bool, 1)),
            5 => {
                let value = self.expression(Type::Float, 1);
                let operator = self.pick(&["=", "+=", "*="]);
                match self.choose(5) {
                    0 => self.variable(Type::Vec3, true).map(|v| format!("{v}.y {operator} {value};")),
                    1 => self.variable(Type::Record, true).map(|v| format!("{v}.b.x {operator} {value};")),
                    2 => self.variable(Type::Floats, true).map(|v| format!("{v}[1] {operator} {value};")),
                    3 => {
                        let index = self.expression(Type::Int, 1);
                        self.variable(Type::Floats, true).map(|v| format!("{v}[abs({index}) % 3] {operator} {value};"))
                    }
                    _ => {
                        let pair = self.expression(Type::Vec2, 1);
                        self.variable(Type::Vec4, true).map(|v| format!("{v}.zx = {pair};"))
                    }
                }
                .unwrap_or_else(|| ";".into())
            }
            _ => self.simple_assignment(),
        }
    }

    fn simple_assignment(&mut self) -> String {
        let of = SIMPLE[self.choose(SIMPLE.len())];
        let Some(name) = self.variable(of, true) else { return ";".into() };
        let operators: &[&str] = match of {
            Type::Bool | Type::Record | Type::Floats => &["="],
            Type::Int => &["=", "+=", "-=", "*=", "/=", "%="],
            _ => &["=", "+=", "-=", "*=", "/="],
        };
        let operator = self.pick(operators);
        format!("{name} {operator} {};", self.expression(of, 2))
    }

    fn outputs(&mut self) -> String {
        match self.choose(5) {
            0 => {
                let (width, color) = (self.expression(Type::Float, 1), self.expression(Type::Vec3, 1));
                let priority = self.expression(Type::Int, 1);
                format!("; let o = #{{ line_width: {width}, base_color: {color} }}; o.priority = {priority}; o")
            }
            1 => {
                let (condition, width) = (self.expression(Type::Bool, 1), self.expression(Type::Number, 1));
                format!("if {condition} {{ out }} else {{ #{{ line_width: {width}, emission: 2 }} }}")
            }
            _ => "out".into(),
        }
    }
}

fn variable(name: String, of: Type) -> Variable {
    Variable { name, of, changes: true, captured: false }
}

/// A variable that only its loop changes.
fn fixed(name: String, of: Type) -> Variable {
    Variable { name, of, changes: false, captured: false }
}
