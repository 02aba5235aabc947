//! The typed register program of a kernel, before registers are shared out.
//!
//! A program is a tree of blocks. Every [`Value`] is set by one instruction (or is carried by one loop) and is a column
//! of floats, ints or truth values, one row a hit, or a single row if it is the same for all hits (*uniform*).
//! Vectors and records do not exist here: the lowering has taken them apart.
//!
//! Invariants, which [`verify`](super::verify) checks:
//! - A value is used only where its instruction stands before the use in the same block or in a block around it.
//!   What a skipped block would have set is read only through a [`Code::Select`] that picks the other side.
//! - An instruction whose operands are all uniform gives uniform values.
//! - Only instructions with a mask operand can fail, and only at hits in that mask.

use std::fmt;

use smallvec::SmallVec;

use crate::math::{Vec2, Vec3, portable};
use crate::shade::library::{color, fractal, math, pattern};
use crate::shade::names::PairSet;

/// A column that one instruction sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(in crate::shade) struct Value(pub u32);

/// Type of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(in crate::shade) enum Kind {
    Float,
    Int,
    Bool,
}

/// What an instruction reads. Floats are kept as bits, so that operands can be compared and hashed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(in crate::shade) enum Operand {
    Float(u32),
    Int(i64),
    Bool(bool),
    Value(Value),
}

impl Operand {
    pub const TRUE: Self = Self::Bool(true);
    pub const FALSE: Self = Self::Bool(false);

    /// A constant float.
    pub fn float(x: f32) -> Self {
        Self::Float(x.to_bits())
    }

    /// The float, if it is constant.
    pub fn as_float(self) -> Option<f32> {
        if let Self::Float(bits) = self { Some(f32::from_bits(bits)) } else { None }
    }

    /// The int, if it is constant.
    pub fn as_int(self) -> Option<i64> {
        if let Self::Int(x) = self { Some(x) } else { None }
    }

    /// The truth value, if it is constant.
    pub fn as_bool(self) -> Option<bool> {
        if let Self::Bool(x) = self { Some(x) } else { None }
    }
}

/// The formula of an operation, by its number of arguments.
macro_rules! formula {
    ($operation:expr, 1) => {
        #[inline(always)]
        |a| $operation.apply(a)
    };
    ($operation:expr, 2) => {
        #[inline(always)]
        |a, b| $operation.apply(a, b)
    };
    ($operation:expr, 3) => {
        #[inline(always)]
        |a, b, c| $operation.apply(a, b, c)
    };
}

/// Defines the operations of one form: a name each, and what it computes of one row.
macro_rules! operations {
    (
        $(#[$doc:meta])*
        $name:ident, $loops:ident, $arity:tt ($($argument:ident: $type:ty),*) -> $result:ty { $($variant:ident = $formula:expr,)* }
    ) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub(in crate::shade) enum $name { $($variant,)* }

        /// Something that runs one formula over many rows.
        pub(in crate::shade) trait $loops {
            fn run(self, formula: impl Fn($($type),*) -> $result);
        }

        impl $name {
            /// The operation on one row: the very function that the interpreter calls.
            #[inline(always)]
            pub fn apply(self, $($argument: $type),*) -> $result {
                match self { $(Self::$variant => $formula,)* }
            }

            /// Hands the operation's formula to `loops`, so that each operation gets a loop of its own.
            #[inline(always)]
            pub fn in_loop(self, loops: impl $loops) {
                match self { $(Self::$variant => loops.run(formula!(Self::$variant, $arity)),)* }
            }
        }
    };
}

operations! {
    /// float → float.
    FloatUnary, FloatUnaryLoop, 1 (x: f32) -> f32 {
        Negate = -x,
        Abs = x.abs(),
        Sign = math::sign(x),
        Floor = x.floor(),
        Ceil = x.ceil(),
        Round = x.round(),
        Fract = math::fract(x),
        Sqrt = x.sqrt(),
        Saturate = math::saturate(x),
        Exp = portable::exp(x),
        Exp2 = portable::exp2(x),
        Ln = portable::ln(x),
        Log10 = portable::log10(x),
        Log2 = portable::log2(x),
        Sin = portable::sin(x),
        Cos = portable::cos(x),
        Tan = portable::tan(x),
        Asin = portable::asin(x),
        Acos = portable::acos(x),
        Atan = portable::atan(x),
        Sinh = portable::sinh(x),
        Cosh = portable::cosh(x),
        Tanh = portable::tanh(x),
        LinearFromSrgb = crate::math::linear_from_srgb(x),
        SrgbFromLinear = crate::math::srgb_from_linear(x),
    }
}

operations! {
    /// float, float → float.
    FloatBinary, FloatBinaryLoop, 2 (a: f32, b: f32) -> f32 {
        Add = a + b,
        Subtract = a - b,
        Multiply = a * b,
        Divide = a / b,
        Remainder = a % b,
        Min = math::min(a, b),
        Max = math::max(a, b),
        Step = math::step(a, b),
        FlooredMod = math::floored_mod(a, b),
        Power = portable::pow(a, b),
        Atan2 = portable::atan2(a, b),
    }
}

operations! {
    /// float, float, float → float.
    FloatTernary, FloatTernaryLoop, 3 (a: f32, b: f32, c: f32) -> f32 {
        Clamp = math::clamp(a, b, c),
        Mix = math::mix(a, b, c),
        Smoothstep = math::smoothstep(a, b, c),
    }
}

/// Two floats or ints → bool, as IEEE 754 compares floats.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(in crate::shade) enum Comparison {
    Equal,
    NotEqual,
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
}

impl Comparison {
    /// The comparison of one row.
    #[inline(always)]
    #[expect(clippy::float_cmp, reason = "scripts compare exactly")]
    pub fn floats(self, a: f32, b: f32) -> bool {
        match self {
            Self::Equal => a == b,
            Self::NotEqual => a != b,
            Self::Less => a < b,
            Self::LessEqual => a <= b,
            Self::Greater => a > b,
            Self::GreaterEqual => a >= b,
        }
    }

    /// The comparison of one row.
    #[inline(always)]
    pub fn ints(self, a: i64, b: i64) -> bool {
        match self {
            Self::Equal => a == b,
            Self::NotEqual => a != b,
            Self::Less => a < b,
            Self::LessEqual => a <= b,
            Self::Greater => a > b,
            Self::GreaterEqual => a >= b,
        }
    }
}

operations! {
    /// int, int → int, for all ints.
    IntBinary, IntBinaryLoop, 2 (a: i64, b: i64) -> i64 {
        And = a & b,
        Or = a | b,
        Xor = a ^ b,
        ShiftLeft = shift_left(a, b),
        ShiftRight = shift_right(a, b),
        Min = a.min(b),
        Max = a.max(b),
        // Of loop counters, which the fuel of the loop keeps from wrapping unseen.
        WrappingAdd = a.wrapping_add(b),
        WrappingSubtract = a.wrapping_sub(b),
    }
}

operations! {
    /// int, int → int, where that has a value; else the hit fails.
    IntChecked, IntCheckedLoop, 2 (a: i64, b: i64) -> Option<i64> {
        Add = a.checked_add(b),
        Subtract = a.checked_sub(b),
        Multiply = a.checked_mul(b),
        Divide = a.checked_div(b),
        Remainder = a.checked_rem(b),
        Power = u32::try_from(b).ok().and_then(|b| a.checked_pow(b)),
        FlooredMod = math::floored_mod_ints(a, b),
        // The second operand is not read.
        Negate = { let _ = b; a.checked_neg() },
        Abs = { let _ = b; a.checked_abs() },
    }
}

/// Rhai's `<<`: bits beyond the ends are lost, and a negative count shifts the other way.
fn shift_left(x: i64, count: i64) -> i64 {
    match count {
        0..64 => x << count,
        64.. => 0,
        _ => shift_right(x, count.checked_neg().unwrap_or(i64::MAX)),
    }
}

/// Rhai's `>>`: the sign is kept, and a negative count shifts the other way.
fn shift_right(x: i64, count: i64) -> i64 {
    match count {
        0..64 => x >> count,
        64.. => x >> 63,
        _ => shift_left(x, count.checked_neg().unwrap_or(i64::MAX)),
    }
}

/// bool, bool → bool.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(in crate::shade) enum BoolBinary {
    And,
    Or,
    Xor,
    AndNot,
}

impl BoolBinary {
    /// The operation on one row.
    pub fn apply(self, a: bool, b: bool) -> bool {
        match self {
            Self::And => a & b,
            Self::Or => a | b,
            Self::Xor => a ^ b,
            Self::AndNot => a & !b,
        }
    }
}

/// A column of a [`HitBatch`](crate::shade::HitBatch).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(in crate::shade) enum Column {
    Position,
    Normal,
    GeometricNormal,
    Incoming,
    /// By number of the uv set.
    Uv(u32),
    Tangent,
    Color,
    ObjectId,
    PolygonId,
    Barycentric,
    Distance,
    Depth,
    /// An int: the place in [`PathKind::ALL`](crate::shade::PathKind::ALL).
    PathKind,
    FrontFacing,
    Time,
    PixelsPerUnit,
    Curvature,
    Footprint,
    UvFootprint,
    /// An int: which set of attributes the hit has; −1 where the batch has none.
    AttributeSet,
    LightCount,
    /// An input on `pair`, or on `pair.other`.
    Pair {
        input: PairSet,
        other: bool,
        kind: Kind,
    },
}

impl Column {
    pub fn kind(self) -> Kind {
        match self {
            Self::ObjectId | Self::PolygonId | Self::PathKind | Self::AttributeSet | Self::LightCount => Kind::Int,
            Self::FrontFacing => Kind::Bool,
            Self::Pair { kind, .. } => kind,
            _ => Kind::Float,
        }
    }

    /// Whether it is the same for all hits of a batch.
    pub fn is_uniform(self) -> bool {
        matches!(self, Self::Time | Self::LightCount)
    }
}

/// A noise of the library.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(in crate::shade) enum Noise {
    Value,
    Gradient,
    Cellular,
    CellId,
    /// So many layers of gradient noise.
    Fbm(u8),
}

/// Defines functions of several floats: the number of results, and what they are.
macro_rules! library_functions {
    ($($(#[$doc:meta])* $variant:ident $(($field:ident: $type:ty))? => $count:literal, $formula:expr;)*) => {
        /// A function of the library that is worked out a hit at a time.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub(in crate::shade) enum LibraryFunction { $($(#[$doc])* $variant $(($type))?,)* }

        /// Something that runs one function over many rows.
        pub(in crate::shade) trait LibraryLoop {
            fn run(self, formula: impl Fn([f32; MOST_ARGUMENTS]) -> [f32; 4]);
        }

        impl LibraryFunction {
            /// Number of results.
            pub fn results(self) -> usize {
                match self { $(Self::$variant { .. } => $count,)* }
            }

            /// Hands the function to `loops`. Arguments that it does not have are 0.
            #[inline(always)]
            pub fn in_loop(self, loops: impl LibraryLoop) {
                match self { $(Self::$variant $(($field))? => loops.run($formula),)* }
            }
        }
    };
}

/// The most arguments of a [`LibraryFunction`].
pub(in crate::shade) const MOST_ARGUMENTS: usize = 8;

#[inline(always)]
fn three(v: Vec3) -> [f32; 4] {
    [v.x, v.y, v.z, 0.0]
}

#[inline(always)]
fn two(v: Vec2) -> [f32; 4] {
    [v.x, v.y, 0.0, 0.0]
}

#[inline(always)]
fn one(x: f32) -> [f32; 4] {
    [x, 0.0, 0.0, 0.0]
}

library_functions! {
    RgbFromHsv => 3, |a| three(color::rgb_from_hsv(a[0], a[1], a[2]));
    HsvFromRgb => 3, |a| three(color::hsv_from_rgb(Vec3::new(a[0], a[1], a[2])));
    RgbFromHsl => 3, |a| three(color::rgb_from_hsl(a[0], a[1], a[2]));
    HslFromRgb => 3, |a| three(color::hsl_from_rgb(Vec3::new(a[0], a[1], a[2])));
    RgbFromOklab => 3, |a| three(color::rgb_from_oklab(Vec3::new(a[0], a[1], a[2])));
    OklabFromRgb => 3, |a| three(color::oklab_from_rgb(Vec3::new(a[0], a[1], a[2])));
    RgbFromOklch => 3, |a| three(color::rgb_from_oklch(Vec3::new(a[0], a[1], a[2])));
    OklchFromRgb => 3, |a| three(color::oklch_from_rgb(Vec3::new(a[0], a[1], a[2])));
    /// Two colours and the share of the second.
    MixOklab => 3, |a| three(color::mix_oklab(Vec3::new(a[0], a[1], a[2]), Vec3::new(a[3], a[4], a[5]), a[6]));
    Temperature => 3, |a| three(color::temperature(a[0]));
    /// x, width, filter.
    Stripes => 1, |a| one(pattern::stripes(a[0], a[1], a[2]));
    /// Two coordinates, filter.
    Checker2 => 1, |a| one(pattern::checker(&a[..2], a[2]));
    /// Three coordinates, filter.
    Checker3 => 1, |a| one(pattern::checker(&a[..3], a[3]));
    /// u, v, radius, filter.
    Dots => 1, |a| one(pattern::dots(Vec2::new(a[0], a[1]), a[2], a[3]));
    /// u, v, darkness, filter.
    Hatch => 1, |a| one(pattern::hatch(Vec2::new(a[0], a[1]), a[2], a[3]));
    /// u, v, darkness, filter.
    CrossHatch => 1, |a| one(pattern::cross_hatch(Vec2::new(a[0], a[1]), a[2], a[3]));
    /// A vector and an angle.
    Rotate => 2, |a| two(pattern::rotate(Vec2::new(a[0], a[1]), a[2]));
    Worley2 => 2, |a| two(fractal::worley([a[0], a[1]], None));
    Worley3 => 2, |a| two(fractal::worley([a[0], a[1]], Some(a[2])));
    /// Two coordinates, lacunarity, gain.
    Layered2(octaves: u8) => 1, |a| one(fractal::layered([a[0], a[1]], None, octaves.into(), a[2], a[3]));
    /// Three coordinates, lacunarity, gain.
    Layered3(octaves: u8) => 1, |a| one(fractal::layered([a[0], a[1]], Some(a[2]), octaves.into(), a[3], a[4]));
}

/// What an instruction does. Masks come last.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(in crate::shade) enum Code {
    /// A component of an input.
    Input(Column, u8),
    /// All of the light with the index, which has been checked: direction, radiance, visibility.
    Light,
    /// Three floats.
    Irradiance,
    Float1(FloatUnary),
    Float2(FloatBinary),
    Float3(FloatTernary),
    CompareFloats(Comparison),
    IsNan,
    Int2(IntBinary),
    IntSign,
    /// a, b, mask.
    Checked(IntChecked),
    CompareInts(Comparison),
    Bool2(BoolBinary),
    Not,
    /// mask, where true, where false.
    Select(Kind),
    FloatFromInt,
    /// float, mask.
    IntFromFloat,
    /// Of the operands' bits, from a seed.
    HashFloats(u32),
    HashInt(u32),
    /// Of two or three coordinates.
    Noise(Noise),
    /// Floats → floats.
    Library(LibraryFunction),
    /// u, v → red, green, blue, alpha, by number in the kernel's table; with a third operand, the width of the lookup.
    Texture(u16),
    /// A plug-in's function, by number in the kernel's table: its arguments' components, mask. It is called at hits in
    /// the mask only.
    Native {
        function: u16,
        can_fail: bool,
    },
}

/// Operands of an instruction.
pub(in crate::shade) type Operands = SmallVec<[Operand; 4]>;

/// One instruction: sets `count` values from `first` on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::shade) struct Instruction {
    pub code: Code,
    pub operands: Operands,
    pub first: Value,
    pub count: u8,
}

/// Part of a block.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::shade) enum Item {
    Set(Instruction),
    /// Runs the block if the guard is true at any hit.
    If {
        guard: Operand,
        block: Block,
    },
    Loop(Box<Loop>),
    /// Hits in the mask fail: the interpreter will say why.
    Fail(Operand),
}

/// Instructions in the order of the script.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(in crate::shade) struct Block {
    pub items: Vec<Item>,
}

/// A loop: runs its block until `again` is true at no hit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::shade) struct Loop {
    pub carried: Vec<Carried>,
    pub block: Block,
    /// Hits that go round again.
    pub again: Operand,
    /// The most operations, as the interpreter counts them, of one round.
    pub cost: u64,
}

/// A value that a loop carries from round to round.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::shade) struct Carried {
    pub value: Value,
    /// Before the first round.
    pub start: Operand,
    /// After each round.
    pub next: Operand,
}

/// What is known of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::shade) struct ValueType {
    pub kind: Kind,
    /// Whether it has one row for all hits.
    pub uniform: bool,
}

impl fmt::Display for Operand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Float(bits) => write!(f, "{:?}", f32::from_bits(*bits)),
            Self::Int(x) => write!(f, "{x}i"),
            Self::Bool(x) => write!(f, "{x}"),
            Self::Value(value) => write!(f, "{value}"),
        }
    }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "v{}", self.0)
    }
}

impl Block {
    /// Writes the block for people and golden texts.
    pub fn write(&self, types: &[ValueType], indent: usize, text: &mut String) {
        use std::fmt::Write;
        let pad = "  ".repeat(indent);
        for item in &self.items {
            match item {
                Item::Set(set) => {
                    let names: Vec<_> = (0..u32::from(set.count)).map(|i| Value(set.first.0 + i).to_string()).collect();
                    let operands: Vec<_> = set.operands.iter().map(Operand::to_string).collect();
                    let uniform = if types[set.first.0 as usize].uniform { " uniform" } else { "" };
                    let _ =
                        writeln!(text, "{pad}{} ={uniform} {:?}({})", names.join(" "), set.code, operands.join(", "));
                }
                Item::If { guard, block } => {
                    let _ = writeln!(text, "{pad}if {guard}");
                    block.write(types, indent + 1, text);
                }
                Item::Loop(round) => {
                    let carried: Vec<_> =
                        round.carried.iter().map(|c| format!("{} = {} then {}", c.value, c.start, c.next)).collect();
                    let _ = writeln!(text, "{pad}loop {} while {}", carried.join(", "), round.again);
                    round.block.write(types, indent + 1, text);
                }
                Item::Fail(mask) => {
                    let _ = writeln!(text, "{pad}fail {mask}");
                }
            }
        }
    }
}
