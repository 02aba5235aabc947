//! Expressions of random scripts: of every type, from literals to calls.

use super::{Type, Writer};

impl Writer<'_> {
    pub(super) fn expression(&mut self, of: Type, depth: usize) -> String {
        if depth > 0 {
            match self.choose(18) {
                17 => {
                    let (condition, first, second) = (
                        self.expression(Type::Bool, 1),
                        self.expression(of, depth - 1),
                        self.expression(of, depth - 1),
                    );
                    return format!("(if {condition} {{ {first} }} else {{ {second} }})");
                }
                15 | 16 => {
                    if let Some(call) = self.call(of, depth) {
                        return call;
                    }
                }
                14 => {
                    let (subject, first, second) =
                        (self.expression(Type::Int, 1), self.expression(of, depth - 1), self.expression(of, depth - 1));
                    return format!("(switch {subject} {{ 0 | 1 => {first}, _ => {second} }})");
                }
                _ => {}
            }
        }
        match of {
            Type::Float => self.float(depth),
            Type::Int => self.int(depth),
            Type::Bool => self.bool(depth),
            Type::Vec2 => self.vec2(depth),
            Type::Vec3 => self.vec3(depth),
            Type::Vec4 => self.vec4(depth),
            Type::Record => {
                if depth == 0
                    && let Some(name) = self.variable(Type::Record, false)
                {
                    return name;
                }
                let d = depth.saturating_sub(1);
                let (a, b, c) = (self.float(d), self.vec3(0), self.int(0));
                format!("#{{ a: {a}, b: {b}, c: #{{ d: {c} }} }}")
            }
            Type::Floats => {
                if depth == 0
                    && let Some(name) = self.variable(Type::Floats, false)
                {
                    return name;
                }
                format!("[{}, {}, {}]", self.float(0), self.float(0), self.float(0))
            }
            Type::Closure => self.variable(Type::Closure, false).unwrap_or_else(|| "|x| x * 0.5".into()),
            Type::Number => match self.choose(3) {
                0 => self.int(0),
                1 => self.variable(Type::Number, false).unwrap_or_else(|| "2".into()),
                _ => self.float(0),
            },
        }
    }

    fn call(&mut self, of: Type, depth: usize) -> Option<String> {
        let fitting: Vec<_> = self.functions.iter().filter(|(_, _, result)| *result == of).cloned().collect();
        let (name, parameters, _) = fitting.get(self.choose(4))?.clone();
        let mut arguments = Vec::new();
        for of in parameters {
            let argument = self.expression(of, depth - 1);
            // A captured variable passed by name is shared with the callee, which kernels leave to the interpreter.
            let captured = self.variables.iter().any(|v| v.captured && v.name == argument);
            arguments.push(if captured { "0".into() } else { argument });
        }
        let arguments = arguments.join(", ");
        if name.starts_with('m') {
            let target = self.variable(Type::Float, true)?;
            return Some(format!("{target}.{name}({arguments})"));
        }
        Some(format!("{name}({arguments})"))
    }

    fn float(&mut self, depth: usize) -> String {
        const LITERALS: [&str; 14] = [
            "0.5",
            "0.0",
            "1.0",
            "-1.0",
            "2.0",
            "0.25",
            "1e-10",
            "3e30",
            "-0.1",
            "7.0",
            "1.0000001",
            "0.3",
            "-0.0",
            "1e-41",
        ];
        if depth == 0 {
            return match self.choose(5) {
                0 => self.pick(&LITERALS).into(),
                1 if self.has_hit => self
                    .pick(&["hit.distance", "hit.curvature", "hit.time", "p.half", "hit.pixels_per_unit", "hit.depth"])
                    .into(),
                2 if self.this => "this".into(),
                3 => self.variable(Type::Record, false).map_or_else(|| "0.6".into(), |name| format!("{name}.a")),
                _ => self.variable(Type::Float, false).unwrap_or_else(|| "0.75".into()),
            };
        }
        let d = depth - 1;
        match self.choose(42) {
            0 | 1 => self.float(0),
            2..=7 => {
                let operator = self.pick(&["+", "-", "*", "/", "%", "**"]);
                format!("({} {operator} {})", self.expression(Type::Float, d), self.expression(Type::Float, d))
            }
            8 => format!("{}.{}", self.expression(Type::Vec3, d), self.pick(&["x", "y", "z", "r", "b"])),
            9 => format!("clamp({}, {}, {})", self.expression(Type::Float, d), self.float(0), self.float(0)),
            10 => format!(
                "mix({}, {}, {})",
                self.float(0),
                self.expression(Type::Float, d),
                self.expression(Type::Float, d)
            ),
            11 => format!("step({}, {})", self.expression(Type::Float, d), self.expression(Type::Number, d)),
            12 => format!("smoothstep({}, {}, {})", self.float(0), self.float(0), self.expression(Type::Float, d)),
            13 | 14 => {
                const NAMES: [&str; 22] = [
                    "sqrt", "abs", "floor", "ceil", "round", "fract", "sign", "saturate", "sin", "cos", "tan", "exp",
                    "exp2", "ln", "log2", "log", "degrees", "radians", "asin", "atan", "tanh", "hash",
                ];
                let name = self.pick(&NAMES);
                format!("{name}({})", self.expression(Type::Float, d))
            }
            15 => {
                let name = self.pick(&["min", "max", "mod", "pow", "atan", "log"]);
                format!("{name}({}, {})", self.expression(Type::Float, d), self.expression(Type::Number, d))
            }
            16 => format!("dot({}, {})", self.expression(Type::Vec3, d), self.expression(Type::Vec3, d)),
            17 => format!("{}({})", self.pick(&["length", "luminance", "hash"]), self.expression(Type::Vec3, d)),
            18 => format!("distance({}, {})", self.expression(Type::Vec2, d), self.expression(Type::Vec2, d)),
            19 => format!("remap({}, 0.5, {}, {}, 2)", self.expression(Type::Float, d), self.float(0), self.float(0)),
            20 => format!("({} * {})", self.expression(Type::Int, d), self.float(0)),
            21 if self.has_hit => format!("hit.light({}).visibility", self.expression(Type::Int, 0)),
            22 if self.has_hit => "hit.texture(p.map).g".into(),
            23 => format!("fbm({}, {})", self.expression(Type::Vec3, d), 1 + self.choose(3)),
            24 => format!(
                "{}({})",
                self.pick(&["value_noise", "gradient_noise", "cellular_noise", "cell_id"]),
                self.expression(Type::Vec2, d)
            ),
            25 => {
                let kind = self.pick(&["linear", "constant", "smooth"]);
                let (t, a, b, c) = (self.expression(Type::Float, d), self.float(0), self.float(0), self.float(0));
                format!("ramp({t}, [[0, {a}], [0.5, {b}], [1.0, {c}]], \"{kind}\")")
            }
            26 => format!("length({}).abs()", self.expression(Type::Vec2, d)),
            27 => match self.variable(Type::Floats, false) {
                Some(name) => format!("{name}[{}]", self.expression(Type::Int, 1)),
                None => "0.4".into(),
            },
            28 => match self.variable(Type::Closure, false) {
                Some(name) => format!("{name}.call({})", self.float(0)),
                None => "0.1".into(),
            },
            29 => format!("to_float({})", self.expression(Type::Int, d)),
            30 => {
                let name = self.name("y");
                format!("{{ let {name} = {}; {name} * {} }}", self.expression(Type::Float, d), self.float(0))
            }
            31 => match self.variable(Type::Number, false) {
                Some(name) => format!("({name} * {})", self.float(0)),
                None => "1.5".into(),
            },
            32 if self.has_hit => format!("p.steps[{}]", self.choose(2)),
            33 => format!("stripes({}, {}, {})", self.expression(Type::Float, d), self.float(0), self.float(0)),
            34 => {
                let name = self.pick(&["dots", "hatch", "cross_hatch"]);
                format!("{name}({}, {})", self.expression(Type::Vec2, d), self.expression(Type::Number, 0))
            }
            35 => format!("checker({}, {})", self.expression(Type::Vec3, d), self.float(0)),
            36 => format!("fbm({}, 2, 1.5, {})", self.expression(Type::Vec2, d), self.float(0)),
            37 => format!("worley({}).y", self.expression(Type::Vec3, d)),
            38 if self.has_hit => {
                self.pick(&["hit.footprint", "hit.uv_footprint", "hit.attribute(\"wear\", 0.25)"]).into()
            }
            _ => format!("(-({}))", self.expression(Type::Float, d)),
        }
    }

    fn int(&mut self, depth: usize) -> String {
        if depth == 0 {
            return match self.choose(5) {
                0 => self.pick(&["1", "0", "2", "3", "-4", "5", "1000000007", "9223372036854775807"]).into(),
                1 if self.has_hit => {
                    self.pick(&["hit.object_id", "hit.polygon_id", "p.three", "hit.material_id"]).into()
                }
                2 => self.variable(Type::Record, false).map_or_else(|| "1".into(), |name| format!("{name}.c.d")),
                _ => self.variable(Type::Int, false).unwrap_or_else(|| "2".into()),
            };
        }
        let d = depth - 1;
        match self.choose(12) {
            0..=4 => {
                let operator = self.pick(&["+", "-", "*", "%", "/", "&", "|", "^", "<<", ">>", "**"]);
                format!("({} {operator} {})", self.expression(Type::Int, d), self.int(0))
            }
            5 => format!("to_int({})", self.expression(Type::Float, d)),
            6 => format!("{}({}, {})", self.pick(&["min", "max", "mod"]), self.expression(Type::Int, d), self.int(0)),
            7 => format!("{}({})", self.pick(&["abs", "sign"]), self.expression(Type::Int, d)),
            8 => format!("clamp({}, {}, {})", self.expression(Type::Int, d), self.int(0), self.int(0)),
            9 => format!("(-({}))", self.expression(Type::Int, d)),
            _ => self.int(0),
        }
    }

    fn bool(&mut self, depth: usize) -> String {
        if depth == 0 {
            return match self.choose(5) {
                0 if self.has_hit => "hit.front_facing".into(),
                1 if self.has_hit => self.pick(&["hit.path_kind == \"camera\"", "hit.path_kind != \"shadow\""]).into(),
                2 if self.has_hit => self.pick(&["p.map != ()", "p.on", "p.name == \"red\""]).into(),
                3 => self.pick(&["true", "false"]).into(),
                _ => self.variable(Type::Bool, false).unwrap_or_else(|| "(1 < 2)".into()),
            };
        }
        let d = depth - 1;
        let comparison = self.pick(&["<", ">", "<=", ">=", "==", "!="]);
        match self.choose(10) {
            0..=2 => format!("({} {comparison} {})", self.expression(Type::Float, d), self.expression(Type::Number, d)),
            3 => format!("({} {comparison} {})", self.expression(Type::Int, d), self.expression(Type::Int, d)),
            4 => format!("({} && {})", self.expression(Type::Bool, d), self.expression(Type::Bool, d)),
            5 => format!("({} || {})", self.expression(Type::Bool, d), self.expression(Type::Bool, d)),
            6 => {
                let operator = self.pick(&["&", "|", "^", "=="]);
                format!("({} {operator} {})", self.expression(Type::Bool, d), self.expression(Type::Bool, d))
            }
            7 => format!("is_nan({})", self.expression(Type::Float, d)),
            8 => format!("({} == {})", self.expression(Type::Vec3, d), self.expression(Type::Vec3, d)),
            _ => format!("!({})", self.expression(Type::Bool, d)),
        }
    }

    fn vec2(&mut self, depth: usize) -> String {
        if depth == 0 {
            return match self.choose(3) {
                0 if self.has_hit => "hit.uv".into(),
                1 => format!("vec2({}, {})", self.float(0), self.float(0)),
                _ => self.variable(Type::Vec2, false).unwrap_or_else(|| "vec2(0.3, -0.7)".into()),
            };
        }
        let d = depth - 1;
        match self.choose(6) {
            0 | 1 => format!(
                "({} {} {})",
                self.expression(Type::Vec2, d),
                self.pick(&["+", "-", "*", "/"]),
                self.expression(Type::Vec2, d)
            ),
            2 => format!("{}.{}", self.expression(Type::Vec3, d), self.pick(&["xy", "zx", "gg"])),
            3 => match self.choose(3) {
                0 => format!("rotate({}, {})", self.expression(Type::Vec2, d), self.float(0)),
                1 => format!("worley({})", self.expression(Type::Vec2, d)),
                _ => {
                    let name = self.pick(&["floor", "fract", "abs", "normalize"]);
                    format!("{name}({})", self.expression(Type::Vec2, d))
                }
            },
            4 => format!("mix({}, {}, {})", self.vec2(0), self.expression(Type::Vec2, d), self.float(0)),
            _ => format!("vec2({})", self.expression(Type::Vec3, d)),
        }
    }

    fn vec3(&mut self, depth: usize) -> String {
        if depth == 0 {
            return match self.choose(4) {
                0 if self.has_hit => self
                    .pick(&[
                        "hit.normal",
                        "hit.position",
                        "hit.irradiance",
                        "vec3(hit.uv, 0.5)",
                        "p.tint",
                        "hit.incoming",
                    ])
                    .into(),
                1 => format!("vec3({}, 0.5, {})", self.float(0), self.float(0)),
                2 => self
                    .variable(Type::Record, false)
                    .map_or_else(|| "vec3(1, 2, 3)".into(), |name| format!("{name}.b")),
                _ => self.variable(Type::Vec3, false).unwrap_or_else(|| "vec3(0.25, -0.5, 1.0)".into()),
            };
        }
        let d = depth - 1;
        match self.choose(24) {
            0..=4 => format!(
                "({} {} {})",
                self.expression(Type::Vec3, d),
                self.pick(&["+", "-", "*", "/"]),
                self.expression(Type::Vec3, d)
            ),
            5 => format!("({} * {})", self.expression(Type::Vec3, d), self.expression(Type::Number, d)),
            6 => format!(
                "vec3({}, {}, {})",
                self.expression(Type::Float, d),
                self.float(0),
                self.expression(Type::Int, 0)
            ),
            7 => format!("mix({}, {}, {})", self.vec3(0), self.expression(Type::Vec3, d), self.float(0)),
            8 => format!("normalize({})", self.expression(Type::Vec3, d)),
            9 => format!("cross({}, {})", self.expression(Type::Vec3, d), self.expression(Type::Vec3, d)),
            10 => format!("reflect({}, {})", self.expression(Type::Vec3, d), self.vec3(0)),
            11 => format!("{}.{}", self.expression(Type::Vec3, d), self.pick(&["zxy", "bgr", "xxz"])),
            12 => format!("refract({}, {}, {})", self.expression(Type::Vec3, d), self.vec3(0), self.float(0)),
            13 => format!("hsv({}, saturate({}), {})", self.float(0), self.float(0), self.expression(Type::Float, d)),
            14 => format!("clamp({}, {}, {})", self.expression(Type::Vec3, d), self.float(0), self.vec3(0)),
            15 => format!("hash_color({})", self.expression(Type::Int, d)),
            16 => format!(
                "{}({})",
                self.pick(&["srgb", "hsv_from_rgb", "floor", "saturate"]),
                self.expression(Type::Vec3, d)
            ),
            17 => format!("gray({})", self.expression(Type::Number, d)),
            18 => {
                let (t, a, b) = (self.expression(Type::Float, d), self.vec3(0), self.vec3(0));
                format!("ramp({t}, [[{}, {a}], [1.0, {b}]])", self.pick(&["0.0", "0.9", "0.25"]))
            }
            19 => {
                const NAMES: [&str; 6] =
                    ["oklab", "oklab_from_rgb", "oklch", "oklch_from_rgb", "hsl_from_rgb", "srgb_from_rgb"];
                format!("{}({})", self.pick(&NAMES), self.expression(Type::Vec3, d))
            }
            20 => format!("mix_oklab({}, {}, {})", self.expression(Type::Vec3, d), self.vec3(0), self.float(0)),
            21 => format!("temperature({})", self.expression(Type::Number, d)),
            22 => format!("hsl({}, {}, {})", self.float(0), self.float(0), self.expression(Type::Float, d)),
            _ => format!("abs({})", self.expression(Type::Vec3, d)),
        }
    }

    fn vec4(&mut self, depth: usize) -> String {
        if depth == 0 {
            return match self.choose(3) {
                0 if self.has_hit => {
                    self.pick(&["hit.tangent", "hit.color", "hit.texture(p.map)", "texture(p.map, hit.uv)"]).into()
                }
                1 => format!("vec4({}, {}, 0.5, 1)", self.float(0), self.float(0)),
                _ => self.variable(Type::Vec4, false).unwrap_or_else(|| "vec4(0.25, -0.5, 1.0, 2.0)".into()),
            };
        }
        let d = depth - 1;
        match self.choose(5) {
            0 | 1 => format!(
                "({} {} {})",
                self.expression(Type::Vec4, d),
                self.pick(&["+", "-", "*", "/"]),
                self.expression(Type::Vec4, d)
            ),
            2 => format!("vec4({}, {})", self.expression(Type::Vec3, d), self.float(0)),
            3 => format!("({} - {})", self.expression(Type::Vec4, d), self.expression(Type::Float, d)),
            _ => format!("normalize({})", self.expression(Type::Vec4, d)),
        }
    }
}
