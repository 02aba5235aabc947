//! The library's functions, as instructions that do the same steps in the same order.

use std::rc::Rc;

use rhai::Position;

use super::super::ir::{
    Code, Comparison, FloatBinary, FloatTernary, FloatUnary, IntBinary, IntChecked, Kind, LibraryFunction, Noise,
    Operand,
};
use super::meaning::{Channels, Meaning};
use super::{Flow, Lowerer};
use crate::shade::native::NativeType;

impl Lowerer<'_> {
    /// A call of a function that the script does not define, or an operator.
    pub(super) fn native(&mut self, name: &str, arguments: Vec<Meaning>, position: Position) -> Flow<Meaning> {
        if self.is_dead() {
            return Ok(Meaning::Undefined);
        }
        self.spread(arguments, &mut |lowerer, arguments| match lowerer.known_function(name, arguments, position)? {
            Some(value) => Ok(value),
            None => {
                let types: Vec<_> = arguments.iter().map(Meaning::name).collect();
                lowerer.give_up(position, &format!("`{name}` of ({})", types.join(", ")))
            }
        })
    }

    fn known_function(&mut self, name: &str, arguments: &[Meaning], position: Position) -> Flow<Option<Meaning>> {
        let value = match arguments {
            [x] => self.unary(name, x),
            [a, b] => self.binary(name, a, b),
            _ => None,
        };
        if value.is_some() {
            return Ok(value);
        }
        match (name, arguments) {
            ("light", [Meaning::Hit, Meaning::Int(index)]) => Ok(Some(self.light(*index))),
            ("texture", [Meaning::Hit, Meaning::Texture(texture)]) => Ok(Some(self.texture_at_hit(*texture))),
            ("texture", [Meaning::Texture(texture), Meaning::Vector(uv)]) if uv.len() == 2 => {
                Ok(Some(self.texture(*texture, &[uv[0], uv[1]])))
            }
            ("texture", [Meaning::Texture(texture), Meaning::Vector(uv), width]) if uv.len() == 2 => {
                Ok(self.number(width).map(|width| self.texture(*texture, &[uv[0], uv[1], width])))
            }
            ("texture", [Meaning::Text(name), Meaning::Vector(uv), options @ ..])
                if uv.len() == 2 && options.len() <= 2 && options.iter().all(|o| matches!(o, Meaning::Text(_))) =>
            {
                Ok(self.named_texture(name, [uv[0], uv[1]]))
            }
            ("attribute", [Meaning::Hit, Meaning::Text(name), default]) => {
                self.attribute(name, default, position).map(Some)
            }
            ("fbm", [Meaning::Vector(point), Meaning::Int(octaves), lacunarity, gain]) => {
                let Some(octaves @ 1..=10) = octaves.as_int() else {
                    return self.give_up(position, "`fbm` with a number of octaves that varies or is out of range");
                };
                Ok(self.layered(point, octaves as u8, lacunarity, gain))
            }
            ("ramp", [t, Meaning::Array(stops)]) => {
                let stops = Rc::clone(stops);
                self.ramp(t, &stops, "linear", position).map(Some)
            }
            ("ramp", [t, Meaning::Array(stops), Meaning::Text(kind)]) => {
                let (stops, kind) = (Rc::clone(stops), Rc::clone(kind));
                self.ramp(t, &stops, &kind, position).map(Some)
            }
            ("fbm", [Meaning::Vector(point), Meaning::Int(octaves)]) => {
                let Some(octaves @ 1..=10) = octaves.as_int() else {
                    return self.give_up(position, "`fbm` with a number of octaves that varies or is out of range");
                };
                Ok(self.noise(Noise::Fbm(octaves as u8), point))
            }
            ("print" | "debug", _) => Ok(Some(Meaning::Unit)),
            ("len", [Meaning::Array(items)]) => Ok(Some(Meaning::int(items.len() as i64))),
            ("contains", [container, item]) => Ok(self.contains(container, item)),
            _ => Ok(self
                .constructor(name, arguments)
                .or_else(|| self.of_ints(name, arguments))
                .or_else(|| self.channelwise(name, arguments))
                .or_else(|| self.geometry(name, arguments))
                .or_else(|| self.of_library(name, arguments))
                .or_else(|| self.other(name, arguments))
                .or_else(|| self.plug_in(name, arguments))),
        }
    }

    fn contains(&mut self, container: &Meaning, item: &Meaning) -> Option<Meaning> {
        Some(Meaning::Bool(match (container, item) {
            (Meaning::Record(record), Meaning::Text(key)) => record.get(key).map_or(Operand::FALSE, |f| f.present),
            (Meaning::Range(range), Meaning::Int(x)) => {
                let under = if range.inclusive { Comparison::LessEqual } else { Comparison::Less };
                let above = self.builder.emit(Code::CompareInts(Comparison::GreaterEqual), &[*x, range.low]);
                let below = self.builder.emit(Code::CompareInts(under), &[*x, range.end]);
                self.builder.and(above, below)
            }
            _ => return None,
        }))
    }

    /// A function that a plug-in has added.
    fn plug_in(&mut self, name: &str, arguments: &[Meaning]) -> Option<Meaning> {
        let native = self.surroundings.natives.iter().find(|native| native.name() == name)?;
        if native.parameters().len() != arguments.len() {
            return None;
        }
        let mut operands: Vec<Operand> = Vec::new();
        for (argument, wanted) in arguments.iter().zip(native.parameters()) {
            match (argument, wanted) {
                (Meaning::Bool(x), NativeType::Bool) | (Meaning::Int(x), NativeType::Int) => operands.push(*x),
                (number, NativeType::Float) => operands.push(self.number(number)?),
                (Meaning::Vector(channels), wanted) if wanted.columns() == Some(channels.len()) => {
                    operands.extend_from_slice(channels);
                }
                _ => return None,
            }
        }
        operands.push(self.mask());
        let can_fail = native.can_fail();
        self.natives.push(native.clone());
        let function = u16::try_from(self.natives.len() - 1).ok()?;
        let code = Code::Native { function, can_fail };
        let kind = match native.result() {
            NativeType::Bool => Kind::Bool,
            NativeType::Int => Kind::Int,
            _ => Kind::Float,
        };
        let count = native.result().columns().unwrap_or(1);
        let first = self.builder.emit_many(code, &operands, &vec![kind; count]);
        let channel = |i: usize| Operand::Value(super::super::ir::Value(first.0 + i as u32));
        Some(match native.result() {
            NativeType::Bool => Meaning::Bool(channel(0)),
            NativeType::Int => Meaning::Int(channel(0)),
            NativeType::Float => Meaning::Float(channel(0)),
            _ => Meaning::Vector((0..count).map(channel).collect()),
        })
    }

    /// Functions that are worked out a hit at a time.
    fn of_library(&mut self, name: &str, arguments: &[Meaning]) -> Option<Meaning> {
        use LibraryFunction as F;
        let mut operands = Channels::new();
        let mut forms: Vec<usize> = Vec::new();
        for argument in arguments {
            match argument {
                Meaning::Vector(channels) => {
                    forms.push(channels.len());
                    operands.extend_from_slice(channels);
                }
                number => {
                    forms.push(1);
                    operands.push(self.number(number)?);
                }
            }
        }
        let function = match (name, forms.as_slice()) {
            ("hsv", [1, 1, 1]) => F::RgbFromHsv,
            ("hsv_from_rgb", [3]) => F::HsvFromRgb,
            ("hsl", [1, 1, 1]) => F::RgbFromHsl,
            ("hsl_from_rgb", [3]) => F::HslFromRgb,
            ("oklab", [1, 1, 1] | [3]) => F::RgbFromOklab,
            ("oklab_from_rgb", [3]) => F::OklabFromRgb,
            ("oklch", [1, 1, 1] | [3]) => F::RgbFromOklch,
            ("oklch_from_rgb", [3]) => F::OklchFromRgb,
            ("mix_oklab", [3, 3, 1]) => F::MixOklab,
            ("temperature", [1]) => F::Temperature,
            ("stripes", [1, 1] | [1, 1, 1]) => F::Stripes,
            ("checker", [2] | [2, 1]) => F::Checker2,
            ("checker", [3] | [3, 1]) => F::Checker3,
            ("dots", [2, 1] | [2, 1, 1]) => F::Dots,
            ("hatch", [2, 1] | [2, 1, 1]) => F::Hatch,
            ("cross_hatch", [2, 1] | [2, 1, 1]) => F::CrossHatch,
            ("rotate", [2, 1]) => F::Rotate,
            ("worley", [2]) => F::Worley2,
            ("worley", [3]) => F::Worley3,
            ("srgb_from_rgb", [3]) => {
                let channels = operands.iter().map(|x| self.float1(FloatUnary::SrgbFromLinear, *x));
                return Some(Meaning::Vector(channels.collect()));
            }
            _ => return None,
        };
        // A filter that is left out is 0, as missing arguments are.
        Some(self.many(Code::Library(function), &operands, function.results()))
    }

    /// `fbm` with a lacunarity of 1 to 4 and a gain of 0 to 1; hits fail where they are out of these ranges.
    fn layered(&mut self, point: &Channels, octaves: u8, lacunarity: &Meaning, gain: &Meaning) -> Option<Meaning> {
        let function = match point.len() {
            2 => LibraryFunction::Layered2(octaves),
            3 => LibraryFunction::Layered3(octaves),
            _ => return None,
        };
        let (lacunarity, gain) = (self.number(lacunarity)?, self.number(gain)?);
        for (x, low, high) in [(lacunarity, 1.0, 4.0), (gain, 0.0, 1.0)] {
            let above = self.builder.emit(Code::CompareFloats(Comparison::GreaterEqual), &[x, Operand::float(low)]);
            let below = self.builder.emit(Code::CompareFloats(Comparison::LessEqual), &[x, Operand::float(high)]);
            let inside = self.builder.and(above, below);
            let outside = self.builder.not(inside);
            self.fail_where(outside);
        }
        let mut operands = point.clone();
        operands.extend([lacunarity, gain]);
        Some(self.many(Code::Library(function), &operands, 1))
    }

    // Functions of numbers and vectors.

    /// Vectors and colours from numbers and vectors.
    fn constructor(&mut self, name: &str, arguments: &[Meaning]) -> Option<Meaning> {
        let (count, numbers_only) = match name {
            "vec2" => (2, false),
            "vec3" => (3, false),
            "vec4" => (4, false),
            "rgb" | "gray" | "srgb" => (3, true),
            _ => return None,
        };
        let mut channels = Channels::new();
        for argument in arguments {
            match argument {
                Meaning::Vector(more) if !numbers_only || (name == "srgb" && arguments.len() == 1) => {
                    channels.extend_from_slice(more);
                }
                number => channels.push(self.number(number)?),
            }
        }
        let vector = match (name, arguments) {
            ("rgb", _) => (arguments.len() == 3).then_some(channels),
            ("gray", [_]) => Some(Channels::from_elem(channels[0], 3)),
            ("srgb", [Meaning::Vector(given)]) => (given.len() == 3).then_some(channels),
            ("srgb", _) => (arguments.len() == 3).then_some(channels),
            ("gray", _) => None,
            (_, [Meaning::Int(_) | Meaning::Float(_)]) => Some(Channels::from_elem(channels[0], count)),
            (_, [_]) if channels.len() > count => Some(Channels::from_slice(&channels[..count])),
            _ => (channels.len() == count).then_some(channels),
        }?;
        Some(Meaning::Vector(if name == "srgb" {
            vector.iter().map(|x| self.float1(FloatUnary::LinearFromSrgb, *x)).collect()
        } else {
            vector
        }))
    }

    /// What gives an int if all arguments are ints.
    fn of_ints(&mut self, name: &str, arguments: &[Meaning]) -> Option<Meaning> {
        let ints: Option<Vec<Operand>> =
            arguments.iter().map(|argument| if let Meaning::Int(x) = argument { Some(*x) } else { None }).collect();
        let ints = ints?;
        let mut plain = |code, a, b| self.builder.emit(Code::Int2(code), &[a, b]);
        Some(Meaning::Int(match (name, ints.as_slice()) {
            ("min", [a, b]) => plain(IntBinary::Min, *a, *b),
            ("max", [a, b]) => plain(IntBinary::Max, *a, *b),
            ("clamp", [x, low, high]) => {
                let above = plain(IntBinary::Max, *x, *low);
                plain(IntBinary::Min, above, *high)
            }
            ("sign", [x]) => self.builder.emit(Code::IntSign, &[*x]),
            ("abs", [x]) => self.checked(IntChecked::Abs, *x, Operand::Int(0)),
            ("mod", [x, y]) => self.checked(IntChecked::FlooredMod, *x, *y),
            _ => return None,
        }))
    }

    /// Functions of each channel alone; a number beside vectors counts for all their channels.
    fn channelwise(&mut self, name: &str, arguments: &[Meaning]) -> Option<Meaning> {
        let mut width = 1;
        for argument in arguments {
            match argument {
                Meaning::Vector(channels) if width == 1 || width == channels.len() => width = channels.len(),
                Meaning::Int(_) | Meaning::Float(_) => {}
                _ => return None,
            }
        }
        let mut channels = Channels::new();
        for lane in 0..width {
            let mut operands = Channels::new();
            for argument in arguments {
                operands.push(match argument {
                    Meaning::Vector(channels) => channels[lane],
                    number => self.number(number)?,
                });
            }
            channels.push(self.of_floats(name, &operands)?);
        }
        Some(if width == 1 { Meaning::Float(channels[0]) } else { Meaning::Vector(channels) })
    }

    fn of_floats(&mut self, name: &str, operands: &[Operand]) -> Option<Operand> {
        use FloatBinary::{Add, Divide, Multiply, Subtract};
        let unary = match name {
            "saturate" => Some(FloatUnary::Saturate),
            "abs" => Some(FloatUnary::Abs),
            "sign" => Some(FloatUnary::Sign),
            "floor" => Some(FloatUnary::Floor),
            "ceil" => Some(FloatUnary::Ceil),
            "round" => Some(FloatUnary::Round),
            "fract" => Some(FloatUnary::Fract),
            "sqrt" => Some(FloatUnary::Sqrt),
            "exp" => Some(FloatUnary::Exp),
            "exp2" => Some(FloatUnary::Exp2),
            "ln" => Some(FloatUnary::Ln),
            "log" => Some(FloatUnary::Log10),
            "log2" => Some(FloatUnary::Log2),
            "sin" => Some(FloatUnary::Sin),
            "cos" => Some(FloatUnary::Cos),
            "tan" => Some(FloatUnary::Tan),
            "asin" => Some(FloatUnary::Asin),
            "acos" => Some(FloatUnary::Acos),
            "atan" => Some(FloatUnary::Atan),
            "sinh" => Some(FloatUnary::Sinh),
            "cosh" => Some(FloatUnary::Cosh),
            "tanh" => Some(FloatUnary::Tanh),
            _ => None,
        };
        let binary = match name {
            "step" => Some(FloatBinary::Step),
            "min" => Some(FloatBinary::Min),
            "max" => Some(FloatBinary::Max),
            "mod" => Some(FloatBinary::FlooredMod),
            "pow" => Some(FloatBinary::Power),
            "atan" => Some(FloatBinary::Atan2),
            _ => None,
        };
        let ternary = match name {
            "mix" => Some(FloatTernary::Mix),
            "clamp" => Some(FloatTernary::Clamp),
            "smoothstep" => Some(FloatTernary::Smoothstep),
            _ => None,
        };
        match (name, operands) {
            ("log", [x, base]) => {
                let (x, base) = (self.float1(FloatUnary::Ln, *x), self.float1(FloatUnary::Ln, *base));
                Some(self.float2(Divide, x, base))
            }
            ("radians", [x]) => Some(self.float2(Multiply, *x, Operand::float(std::f32::consts::PI / 180.0))),
            ("degrees", [x]) => Some(self.float2(Multiply, *x, Operand::float(180.0 / std::f32::consts::PI))),
            ("remap", [x, from_low, from_high, to_low, to_high]) => {
                let above = self.float2(Subtract, *x, *from_low);
                let from = self.float2(Subtract, *from_high, *from_low);
                let share = self.float2(Divide, above, from);
                let to = self.float2(Subtract, *to_high, *to_low);
                let scaled = self.float2(Multiply, share, to);
                Some(self.float2(Add, *to_low, scaled))
            }
            (_, [x]) => unary.map(|code| self.float1(code, *x)),
            (_, [a, b]) => binary.map(|code| self.float2(code, *a, *b)),
            (_, [a, b, c]) => ternary.map(|code| self.builder.emit(Code::Float3(code), &[*a, *b, *c])),
            _ => None,
        }
    }

    /// Products of vectors, and what follows from them.
    fn geometry(&mut self, name: &str, arguments: &[Meaning]) -> Option<Meaning> {
        use FloatBinary::{Add, Divide, Multiply, Subtract};
        match (name, arguments) {
            ("dot", [Meaning::Vector(a), Meaning::Vector(b)]) if a.len() == b.len() => {
                Some(Meaning::Float(self.dot(a, b)))
            }
            ("luminance", [Meaning::Vector(c)]) if c.len() == 3 => {
                let weights = [0.2126, 0.7152, 0.0722].map(Operand::float);
                Some(Meaning::Float(self.dot(c, &Channels::from_slice(&weights))))
            }
            ("length", [Meaning::Vector(v)]) => Some(Meaning::Float(self.length(v))),
            ("distance", [Meaning::Vector(a), Meaning::Vector(b)]) if a.len() == b.len() => {
                let apart: Channels = a.iter().zip(b).map(|(a, b)| self.float2(Subtract, *a, *b)).collect();
                Some(Meaning::Float(self.length(&apart)))
            }
            ("normalize", [Meaning::Vector(v)]) => {
                let length = self.length(v);
                let zero = Operand::float(0.0);
                let none = self.builder.emit(Code::CompareFloats(Comparison::Equal), &[length, zero]);
                let channels = v.iter().map(|x| {
                    let scaled = self.float2(Divide, *x, length);
                    self.builder.select(none, zero, scaled)
                });
                Some(Meaning::Vector(channels.collect()))
            }
            ("cross", [Meaning::Vector(a), Meaning::Vector(b)]) if a.len() == 3 && b.len() == 3 => {
                let mut channel = |i: usize, j: usize| {
                    let first = self.float2(Multiply, a[i], b[j]);
                    let second = self.float2(Multiply, b[i], a[j]);
                    self.float2(Subtract, first, second)
                };
                Some(Meaning::vector(&[channel(1, 2), channel(2, 0), channel(0, 1)]))
            }
            ("reflect", [Meaning::Vector(i), Meaning::Vector(n)]) if i.len() == n.len() => {
                let along = self.dot(n, i);
                let twice = self.float2(Multiply, Operand::float(2.0), along);
                let channels = i.iter().zip(n).map(|(i, n)| {
                    let part = self.float2(Multiply, *n, twice);
                    self.float2(Subtract, *i, part)
                });
                Some(Meaning::Vector(channels.collect()))
            }
            ("refract", [Meaning::Vector(i), Meaning::Vector(n), eta]) if i.len() == n.len() => {
                let eta = self.number(eta)?;
                let c = self.dot(n, i);
                let (one, zero) = (Operand::float(1.0), Operand::float(0.0));
                let eta_squared = self.float2(Multiply, eta, eta);
                let c_squared = self.float2(Multiply, c, c);
                let sine = self.float2(Subtract, one, c_squared);
                let bent = self.float2(Multiply, eta_squared, sine);
                let k = self.float2(Subtract, one, bent);
                let total = self.builder.emit(Code::CompareFloats(Comparison::Less), &[k, zero]);
                let root = self.float1(FloatUnary::Sqrt, k);
                let scaled = self.float2(Multiply, eta, c);
                let along = self.float2(Add, scaled, root);
                let channels = i.iter().zip(n).map(|(i, n)| {
                    let first = self.float2(Multiply, *i, eta);
                    let second = self.float2(Multiply, *n, along);
                    let direction = self.float2(Subtract, first, second);
                    self.builder.select(total, zero, direction)
                });
                Some(Meaning::Vector(channels.collect()))
            }
            _ => None,
        }
    }

    /// The sum of the products of the channels, in order.
    fn dot(&mut self, a: &Channels, b: &Channels) -> Operand {
        let mut products =
            a.iter().zip(b).map(|(a, b)| self.builder.emit(Code::Float2(FloatBinary::Multiply), &[*a, *b]));
        let products: Channels = products.by_ref().collect();
        let (first, others) = (products[0], &products[1..]);
        others.iter().fold(first, |sum, product| self.float2(FloatBinary::Add, sum, *product))
    }

    fn length(&mut self, v: &Channels) -> Operand {
        let squared = self.dot(v, v);
        self.float1(FloatUnary::Sqrt, squared)
    }

    /// Hashes, noise, colours and conversions.
    fn other(&mut self, name: &str, arguments: &[Meaning]) -> Option<Meaning> {
        match (name, arguments) {
            ("hash", [x]) => Some(Meaning::Float(self.hash(0, x)?)),
            ("hash_color", [x]) => Some(Meaning::vector(&[self.hash(1, x)?, self.hash(2, x)?, self.hash(3, x)?])),
            ("value_noise", [Meaning::Vector(point)]) => self.noise(Noise::Value, point),
            ("gradient_noise", [Meaning::Vector(point)]) => self.noise(Noise::Gradient, point),
            ("cellular_noise", [Meaning::Vector(point)]) => self.noise(Noise::Cellular, point),
            ("cell_id", [Meaning::Vector(point)]) => self.noise(Noise::CellId, point),
            ("is_nan", [Meaning::Float(x)]) => Some(Meaning::Bool(self.builder.emit(Code::IsNan, &[*x]))),
            ("to_float", [x]) => Some(Meaning::Float(self.number(x)?)),
            ("to_int", [Meaning::Int(x)]) => Some(Meaning::Int(*x)),
            ("to_int", [Meaning::Float(x)]) => {
                let mask = self.mask();
                Some(Meaning::Int(self.builder.emit(Code::IntFromFloat, &[*x, mask])))
            }
            _ => None,
        }
    }

    fn hash(&mut self, seed: u32, x: &Meaning) -> Option<Operand> {
        Some(match x {
            Meaning::Int(x) => self.builder.emit(Code::HashInt(seed), &[*x]),
            Meaning::Float(x) => self.builder.emit(Code::HashFloats(seed), &[*x]),
            Meaning::Vector(channels) => self.builder.emit(Code::HashFloats(seed), channels),
            _ => return None,
        })
    }

    fn noise(&mut self, noise: Noise, point: &Channels) -> Option<Meaning> {
        (2..=3).contains(&point.len()).then(|| Meaning::Float(self.builder.emit(Code::Noise(noise), point)))
    }

    /// The stops are `[[position, value], …]`. With stop `i` the first above `t`, the value is between those of stops
    /// `i - 1` and `i`; see the library's `ramp`, whose steps these are.
    fn ramp(&mut self, t: &Meaning, stops: &[Meaning], kind: &str, position: Position) -> Flow<Meaning> {
        let odd = || self.blame(position, "a ramp with such stops");
        let mut positions = Vec::new();
        let mut values: Vec<Channels> = Vec::new();
        let t = t.clone();
        let mut parsed = Vec::new();
        for stop in stops {
            let Meaning::Array(parts) = stop else { return Err(odd()) };
            let [at, value] = parts.as_slice() else { return Err(odd()) };
            parsed.push((at.clone(), value.clone()));
        }
        for (at, value) in parsed {
            let Some(at) = self.number(&at) else { return self.give_up(position, "a ramp with such stops") };
            positions.push(at);
            let value = match &value {
                Meaning::Vector(channels) => channels.clone(),
                number => match self.number(number) {
                    Some(x) => Channels::from_slice(&[x]),
                    None => return self.give_up(position, "a ramp with such stops"),
                },
            };
            values.push(value);
        }
        let (Some(first), Some(last)) = (values.first().cloned(), values.last().cloned()) else {
            return self.give_up(position, "a ramp without stops");
        };
        if values.iter().any(|value| value.len() != first.len()) {
            return self.give_up(position, "a ramp whose values are of different types");
        }
        let Some(t) = self.number(&t) else { return self.give_up(position, "a ramp of this") };
        for pair in positions.windows(2) {
            let falls = self.builder.emit(Code::CompareFloats(Comparison::Less), &[pair[1], pair[0]]);
            self.fail_where(falls);
        }

        // From the last stop to the first, so that the first above `t` decides.
        let zero = Operand::float(0.0);
        let (mut from, mut to) = (last.clone(), last);
        let (mut low, mut high) = (zero, Operand::float(1.0));
        let mut within = Operand::FALSE;
        for index in (0..positions.len()).rev() {
            let above = self.builder.emit(Code::CompareFloats(Comparison::Less), &[t, positions[index]]);
            let before = index.checked_sub(1);
            let (value_before, value_here) = match before {
                Some(before) => (values[before].clone(), values[index].clone()),
                None => (first.clone(), first.clone()),
            };
            for lane in 0..first.len() {
                from[lane] = self.builder.select(above, value_before[lane], from[lane]);
                to[lane] = self.builder.select(above, value_here[lane], to[lane]);
            }
            within = match before {
                Some(before) => {
                    low = self.builder.select(above, positions[before], low);
                    high = self.builder.select(above, positions[index], high);
                    self.builder.or(within, above)
                }
                None => self.builder.and_not(within, above),
            };
        }
        let share = match kind {
            "constant" => zero,
            "linear" => {
                let (along, whole) =
                    (self.float2(FloatBinary::Subtract, t, low), self.float2(FloatBinary::Subtract, high, low));
                let share = self.float2(FloatBinary::Divide, along, whole);
                self.builder.select(within, share, zero)
            }
            "smooth" => {
                let share = self.builder.emit(Code::Float3(FloatTernary::Smoothstep), &[low, high, t]);
                self.builder.select(within, share, zero)
            }
            _ => return self.give_up(position, &format!("a ramp that is \"{kind}\"")),
        };
        let channels: Channels = from
            .iter()
            .zip(&to)
            .map(|(from, to)| self.builder.emit(Code::Float3(FloatTernary::Mix), &[*from, *to, share]))
            .collect();
        Ok(if channels.len() == 1 { Meaning::Float(channels[0]) } else { Meaning::Vector(channels) })
    }
}
