//! Native functions: what a Rust user adds to the library that scripts may call (DESIGN section 4.5).
//!
//! A [`NativeFunction`] has static types, which its Rust signature tells: so a wrong argument is refused with a message
//! that lists how it is called, and a compiled shader calls it without going through the interpreter, either its scalar
//! form once a hit or, if it has one, its batch form once for many hits. A [`Package`] registers several at once.
//!
//! **Pure functions only.** The result must depend on nothing but the arguments: no state, clock or randomness. A call may
//! be left out, repeated, made in any order or on any thread. Both forms must give the same bits; transcendental functions
//! from [`crate::math::portable`] do on every machine. A function must not panic: a panic is not caught, and ends the
//! render. What it cannot do it refuses by returning `Err`, which becomes a message at the place of the call.

use std::any::TypeId;
use std::fmt;
use std::sync::Arc;

use rhai::{Dynamic, Engine, EvalAltResult};

use super::fault::Fault;
use super::host::Host;
use super::library::{self, kind};
use crate::diag::{Diagnostic, nearest};
use crate::math::{Vec2, Vec3, Vec4};

/// The type of a native function's parameter or result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum NativeType {
    /// `true` or `false`.
    Bool,
    /// A whole number, 64 bits.
    Int,
    /// A number, 32 bits. An int is taken for one, as the nearest float.
    Float,
    /// Two numbers.
    Vec2,
    /// Three numbers.
    Vec3,
    /// Four numbers.
    Vec4,
}

impl NativeType {
    /// What scripts call it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Bool => "bool",
            Self::Int => "int",
            Self::Float => "float",
            Self::Vec2 => "vec2",
            Self::Vec3 => "vec3",
            Self::Vec4 => "vec4",
        }
    }

    /// How many columns of floats it takes; `None` for what is not made of floats.
    #[must_use]
    pub fn columns(self) -> Option<usize> {
        match self {
            Self::Bool | Self::Int => None,
            Self::Float => Some(1),
            Self::Vec2 => Some(2),
            Self::Vec3 => Some(3),
            Self::Vec4 => Some(4),
        }
    }
}

/// An argument or a result of a native function.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NativeValue {
    /// `true` or `false`.
    Bool(bool),
    /// A whole number.
    Int(i64),
    /// A number.
    Float(f32),
    /// Two numbers.
    Vec2(Vec2),
    /// Three numbers.
    Vec3(Vec3),
    /// Four numbers.
    Vec4(Vec4),
}

impl NativeValue {
    /// Its type.
    #[must_use]
    pub fn kind(self) -> NativeType {
        match self {
            Self::Bool(_) => NativeType::Bool,
            Self::Int(_) => NativeType::Int,
            Self::Float(_) => NativeType::Float,
            Self::Vec2(_) => NativeType::Vec2,
            Self::Vec3(_) => NativeType::Vec3,
            Self::Vec4(_) => NativeType::Vec4,
        }
    }

    /// The value as an argument of a type: itself, or the nearest float of an int.
    #[must_use]
    pub fn passed_as(self, wanted: NativeType) -> Option<Self> {
        match (self, wanted) {
            #[expect(clippy::cast_precision_loss, reason = "an int counts as the nearest float")]
            (Self::Int(x), NativeType::Float) => Some(Self::Float(x as f32)),
            _ => (self.kind() == wanted).then_some(self),
        }
    }

    /// The floats it is made of, if it is made of floats.
    fn components(self) -> Vec<f32> {
        match self {
            Self::Bool(_) | Self::Int(_) => Vec::new(),
            Self::Float(x) => vec![x],
            Self::Vec2(v) => v.to_array().to_vec(),
            Self::Vec3(v) => v.to_array().to_vec(),
            Self::Vec4(v) => v.to_array().to_vec(),
        }
    }

    fn from_components(kind: NativeType, components: &[f32]) -> Option<Self> {
        Some(match (kind, components) {
            (NativeType::Float, [x]) => Self::Float(*x),
            (NativeType::Vec2, [x, y]) => Self::Vec2(Vec2::new(*x, *y)),
            (NativeType::Vec3, [x, y, z]) => Self::Vec3(Vec3::new(*x, *y, *z)),
            (NativeType::Vec4, [x, y, z, w]) => Self::Vec4(Vec4::new(*x, *y, *z, *w)),
            _ => return None,
        })
    }

    fn from_script(value: &Dynamic) -> Option<Self> {
        if let Ok(x) = value.as_float() {
            return Some(Self::Float(x));
        }
        if let Ok(x) = value.as_int() {
            return Some(Self::Int(x));
        }
        if let Ok(x) = value.as_bool() {
            return Some(Self::Bool(x));
        }
        if let Some(v) = value.read_lock::<Vec2>() {
            return Some(Self::Vec2(*v));
        }
        if let Some(v) = value.read_lock::<Vec3>() {
            return Some(Self::Vec3(*v));
        }
        value.read_lock::<Vec4>().map(|v| Self::Vec4(*v))
    }

    fn into_script(self) -> Dynamic {
        match self {
            Self::Bool(x) => Dynamic::from_bool(x),
            Self::Int(x) => Dynamic::from_int(x),
            Self::Float(x) => Dynamic::from_float(x),
            Self::Vec2(v) => Dynamic::from(v),
            Self::Vec3(v) => Dynamic::from(v),
            Self::Vec4(v) => Dynamic::from(v),
        }
    }
}

/// A Rust type that scripts know: `bool`, `i64`, `f32`, [`Vec2`], [`Vec3`] or [`Vec4`].
pub trait Native: Copy + Into<NativeValue> {
    /// Its type.
    const TYPE: NativeType;

    /// The Rust value, if the argument is of this type.
    fn from_value(value: NativeValue) -> Option<Self>;
}

/// What a native function may return: a value, or a value or else what is wrong, which becomes a message in the script.
pub trait NativeResult {
    /// The type of the value.
    const TYPE: NativeType;
    /// Whether there may be no value.
    const CAN_FAIL: bool;

    /// The value, or what is wrong.
    fn into_result(self) -> Result<NativeValue, String>;
}

macro_rules! native {
    ($($rust:ty => $variant:ident),* $(,)?) => { $(
        impl From<$rust> for NativeValue {
            fn from(value: $rust) -> Self {
                Self::$variant(value)
            }
        }

        impl Native for $rust {
            const TYPE: NativeType = NativeType::$variant;

            fn from_value(value: NativeValue) -> Option<Self> {
                match value {
                    NativeValue::$variant(value) => Some(value),
                    _ => None,
                }
            }
        }

        impl NativeResult for $rust {
            const TYPE: NativeType = NativeType::$variant;
            const CAN_FAIL: bool = false;

            fn into_result(self) -> Result<NativeValue, String> {
                Ok(self.into())
            }
        }
    )* };
}
native! { bool => Bool, i64 => Int, f32 => Float, Vec2 => Vec2, Vec3 => Vec3, Vec4 => Vec4 }

impl<T: Native> NativeResult for Result<T, String> {
    const TYPE: NativeType = T::TYPE;
    const CAN_FAIL: bool = true;

    fn into_result(self) -> Result<NativeValue, String> {
        self.map(Into::into)
    }
}

/// A Rust function or closure of 0 to 6 parameters that can be registered. `Signature` is its result and its parameters.
pub trait IntoNative<Signature>: Send + Sync + 'static {
    /// Types of the parameters.
    const PARAMETERS: &'static [NativeType];
    /// Type of the result.
    const RESULT: NativeType;
    /// Whether there may be no result.
    const CAN_FAIL: bool;

    /// Calls it; the arguments are of the types of the parameters.
    fn call(&self, arguments: &[NativeValue]) -> Result<NativeValue, String>;
}

macro_rules! into_native {
    ($($parameter:ident),*) => {
        impl<F, R, $($parameter),*> IntoNative<(R, $($parameter,)*)> for F
        where
            F: Fn($($parameter),*) -> R + Send + Sync + 'static,
            R: NativeResult,
            $($parameter: Native,)*
        {
            const PARAMETERS: &'static [NativeType] = &[$($parameter::TYPE),*];
            const RESULT: NativeType = R::TYPE;
            const CAN_FAIL: bool = R::CAN_FAIL;

            #[allow(non_snake_case, unused_mut, reason = "the types' names serve as the values'; there may be none")]
            fn call(&self, arguments: &[NativeValue]) -> Result<NativeValue, String> {
                let mut arguments = arguments.iter();
                $(
                    let $parameter = arguments.next().and_then(|value| $parameter::from_value(*value));
                    let $parameter = $parameter.ok_or("an argument is missing or of another type")?;
                )*
                let _ = arguments;
                self($($parameter),*).into_result()
            }
        }
    };
}
into_native!();
into_native!(A);
into_native!(A, B);
into_native!(A, B, C);
into_native!(A, B, C, D);
into_native!(A, B, C, D, E);
into_native!(A, B, C, D, E, G);

type Scalar = dyn Fn(&[NativeValue]) -> Result<NativeValue, String> + Send + Sync;

/// A batch form: columns of the arguments' components in order (a vec3 is three columns), columns of the result's
/// components to be filled. All columns are equally long; the length is any.
pub type BatchForm = dyn Fn(&[&[f32]], &mut [&mut [f32]]) + Send + Sync;

/// A function that scripts may call, written in Rust. See the [module](self) for what is asked of it.
#[derive(Clone)]
pub struct NativeFunction {
    name: &'static str,
    parameters: &'static [NativeType],
    result: NativeType,
    can_fail: bool,
    form: String,
    about: String,
    scalar: Arc<Scalar>,
    batch: Option<Arc<BatchForm>>,
}

impl fmt::Debug for NativeFunction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("NativeFunction")
            .field("name", &self.name)
            .field("parameters", &self.parameters)
            .field("result", &self.result)
            .field("batch", &self.batch.is_some())
            .finish_non_exhaustive()
    }
}

impl NativeFunction {
    /// A function with its name in scripts. Its types are those of the Rust function.
    #[must_use]
    pub fn new<Signature, F: IntoNative<Signature>>(name: &'static str, function: F) -> Self {
        let types: Vec<_> = F::PARAMETERS.iter().map(|parameter| parameter.name()).collect();
        Self {
            name,
            parameters: F::PARAMETERS,
            result: F::RESULT,
            can_fail: F::CAN_FAIL,
            form: format!("{name}({})", types.join(", ")),
            about: format!("gives {}", F::RESULT.name()),
            scalar: Arc::new(move |arguments| function.call(arguments)),
            batch: None,
        }
    }

    /// For messages and reference pages: how it is called, such as `"bricks(uv, mortar)"`, and what it gives.
    #[must_use]
    pub fn documented(mut self, form: impl Into<String>, about: impl Into<String>) -> Self {
        self.form = form.into();
        self.about = about.into();
        self
    }

    /// Adds a batch form (see [`BatchForm`]). It must give the same bits as the scalar one, which
    /// [`check`](Self::check) tries. Only functions of floats and vectors that cannot fail have one; a host refuses others.
    #[must_use]
    pub fn with_batch(mut self, batch: impl Fn(&[&[f32]], &mut [&mut [f32]]) + Send + Sync + 'static) -> Self {
        self.batch = Some(Arc::new(batch));
        self
    }

    /// Its name in scripts.
    #[must_use]
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Types of its parameters.
    #[must_use]
    pub fn parameters(&self) -> &'static [NativeType] {
        self.parameters
    }

    /// Type of its result.
    #[must_use]
    pub fn result(&self) -> NativeType {
        self.result
    }

    /// Whether it may return an error instead of a result.
    #[must_use]
    pub fn can_fail(&self) -> bool {
        self.can_fail
    }

    /// As in listings of the library.
    #[must_use]
    pub fn listed(&self) -> library::Function<'_> {
        library::Function { name: self.name, form: &self.form, about: &self.about, types: "", example: "" }
    }

    /// Calls the scalar form. An int is taken where a float is expected.
    ///
    /// # Errors
    /// What the function returns as its error; or that the arguments are not of its types.
    pub fn call(&self, arguments: &[NativeValue]) -> Result<NativeValue, String> {
        let mut passed = [NativeValue::Int(0); MAX_PARAMETERS];
        let matches =
            arguments.len() == self.parameters.len()
                && arguments.iter().zip(self.parameters).zip(&mut passed).all(|((argument, wanted), passed)| {
                    argument.passed_as(*wanted).map(|value| *passed = value).is_some()
                });
        if !matches {
            let types: Vec<_> = arguments.iter().map(|argument| argument.kind().name()).collect();
            return Err(format!("`{}` cannot be called with ({})", self.name, types.join(", ")));
        }
        (self.scalar)(&passed[..arguments.len()])
    }

    /// The batch form, if there is one.
    #[must_use]
    pub fn batch(&self) -> Option<&BatchForm> {
        self.batch.as_deref()
    }

    /// Compares the batch form with the scalar form on columns of arguments, bit by bit (a NaN equals any other). For the
    /// tests of a plug-in; a function without a batch form agrees with itself.
    ///
    /// # Errors
    /// The first place where they differ; or that the columns do not fit the parameters.
    pub fn check(&self, columns: &[&[f32]]) -> Result<(), String> {
        let Some(batch) = self.batch() else { return Ok(()) };
        let widths: Vec<_> = self.parameters.iter().map(|kind| kind.columns().unwrap_or(0)).collect();
        let len = columns.first().map_or(0, |column| column.len());
        if widths.iter().sum::<usize>() != columns.len() || columns.iter().any(|column| column.len() != len) {
            return Err(format!("the columns do not fit the parameters of `{}`", self.listed().form));
        }
        let mut results = vec![vec![0.0; len]; self.result.columns().unwrap_or(0)];
        batch(columns, &mut results.iter_mut().map(Vec::as_mut_slice).collect::<Vec<_>>());
        for lane in 0..len {
            let components: Vec<_> = columns.iter().map(|column| column[lane]).collect();
            let mut rest = components.as_slice();
            let mut arguments = Vec::new();
            for (kind, width) in self.parameters.iter().zip(&widths) {
                let (own, others) = rest.split_at(*width);
                arguments.extend(NativeValue::from_components(*kind, own));
                rest = others;
            }
            let wanted = self.call(&arguments)?.components();
            let got: Vec<_> = results.iter().map(|column| column[lane]).collect();
            let same = |(a, b): (&f32, &f32)| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan());
            if !wanted.iter().zip(&got).all(same) {
                return Err(format!("`{}` of {components:?} is {wanted:?}, but {got:?} in a batch", self.name));
            }
        }
        Ok(())
    }

    /// What makes it unfit to be registered at all.
    pub(super) fn fault(&self) -> Option<String> {
        let of_floats = self.parameters.iter().chain([&self.result]).all(|kind| kind.columns().is_some());
        if self.batch.is_some() && (!of_floats || self.can_fail) {
            return Some("has a batch form, which only functions of floats and vectors that cannot fail have".into());
        }
        None
    }

    /// Registers it with an engine, for any arguments: those that do not fit are refused with the form in a hint.
    pub(super) fn register(&self, engine: &mut Engine) {
        for count in 0..=MAX_PARAMETERS + 2 {
            let function = self.clone();
            engine.register_raw_fn(self.name, vec![TypeId::of::<Dynamic>(); count], move |_, arguments| {
                let values = arguments.iter().zip(function.parameters);
                let values: Option<Vec<_>> =
                    values.map(|(value, wanted)| NativeValue::from_script(value)?.passed_as(*wanted)).collect();
                match values {
                    Some(values) if arguments.len() == function.parameters.len() => {
                        (function.scalar)(&values).map(NativeValue::into_script).map_err(|told| Fault::new(told).into())
                    }
                    _ => {
                        let types: Vec<_> = arguments.iter().map(|argument| kind(argument)).collect();
                        let listed = function.listed();
                        Err(Fault::new(format!("`{}` cannot be called with ({})", listed.name, types.join(", ")))
                            .hint(format!("it is called as `{}`: {}", listed.form, listed.about))
                            .into())
                    }
                }
            });
        }
    }
}

/// The most parameters of a native function.
pub const MAX_PARAMETERS: usize = 6;

/// Several functions and constants that belong together.
///
/// ```
/// use tusche::shade::{Host, NativeFunction, Package};
///
/// struct Masonry;
///
/// impl Package for Masonry {
///     fn name(&self) -> &'static str {
///         "masonry"
///     }
///
///     fn register(&self, host: Host) -> Host {
///         host.with_constant("COURSES", 12_i64)
///             .with_function(NativeFunction::new("course", |height: f32| (height * 12.0).floor()))
///     }
/// }
///
/// assert!(Host::new().with_package(&Masonry).check().is_ok());
/// ```
pub trait Package {
    /// Its name, for messages.
    fn name(&self) -> &'static str;

    /// The host with the package's functions and constants.
    fn register(&self, host: Host) -> Host;
}

/// A number or truth that can be a word in scripts: `bool`, `i64` or `f32`.
pub trait Constant: Native {}

impl Constant for bool {}
impl Constant for i64 {}
impl Constant for f32 {}

/// Words with a meaning of their own: the engine's functions and what a shader defines.
const RESERVED: [&str; 85] = [
    "all",
    "append",
    "bits",
    "call",
    "chars",
    "chop",
    "clear",
    "concat",
    "contains",
    "crop",
    "curry",
    "debug",
    "dedup",
    "drain",
    "end",
    "eval",
    "extract",
    "fill_with",
    "filter",
    "find",
    "find_map",
    "for_each",
    "get",
    "get_bit",
    "get_bits",
    "hit",
    "index_of",
    "insert",
    "is_def_fn",
    "is_def_var",
    "is_empty",
    "is_even",
    "is_exclusive",
    "is_inclusive",
    "is_odd",
    "is_shared",
    "is_zero",
    "keys",
    "len",
    "line",
    "make_lower",
    "make_upper",
    "map",
    "mixin",
    "order",
    "order_by",
    "order_desc",
    "p",
    "pad",
    "pair",
    "params",
    "pop",
    "print",
    "push",
    "range",
    "reduce",
    "reduce_rev",
    "remove",
    "replace",
    "retain",
    "reverse",
    "set",
    "set_bit",
    "set_bits",
    "set_tag",
    "shift",
    "some",
    "sort",
    "sort_by",
    "sort_desc",
    "splice",
    "split",
    "start",
    "surface",
    "tag",
    "take",
    "to_debug",
    "to_hex",
    "to_json",
    "to_string",
    "trim",
    "truncate",
    "type_of",
    "values",
    "zip",
];

/// Why scripts could not tell a new name from what is there without plug-ins; `None` if they can.
pub(super) fn taken(name: &str) -> Option<String> {
    let is_word = name.starts_with(|c: char| c.is_ascii_alphabetic())
        && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    // The parser itself knows best what is a keyword.
    if !is_word || Engine::new_raw().compile_expression(format!("{name}()")).is_err() {
        return Some("is no word that scripts can use as a name".into());
    }
    if library::functions().any(|known| known.name == name) {
        return Some("is a function of the library".into());
    }
    if library::CONSTANTS.iter().any(|(known, _)| *known == name) {
        return Some("is a constant of the library".into());
    }
    RESERVED.contains(&name).then(|| "is a word with a meaning of its own in scripts".into())
}

/// Registers functions with an engine, and leaves their names for [`clarify`].
pub(super) fn register(engine: &mut Engine, functions: &[NativeFunction]) {
    if functions.is_empty() {
        return;
    }
    functions.iter().for_each(|function| function.register(engine));
    engine.set_default_tag(Dynamic::from(Names(functions.iter().map(|function| function.name).collect())));
}

/// Names of an engine's native functions.
#[derive(Clone)]
struct Names(Arc<[&'static str]>);

/// The error of a call of an unknown function that is most likely meant for a native one, as an error that says so.
pub(super) fn clarify(engine: &Engine, mut error: Box<EvalAltResult>) -> Box<EvalAltResult> {
    let mut inner = &mut *error;
    while let EvalAltResult::ErrorInFunctionCall(_, _, cause, _) = inner {
        inner = &mut **cause;
    }
    if let EvalAltResult::ErrorFunctionNotFound(signature, position) = inner
        && let Some(names) = engine.default_tag().read_lock::<Names>()
    {
        let name = signature.split(" (").next().unwrap_or(signature);
        let known = library::functions().map(|function| function.name).chain(names.0.iter().copied());
        if let Some(near) = nearest(name, known)
            && names.0.contains(&near)
        {
            let fault = Fault::new(format!("there is no function `{name}`")).hint(format!("did you mean `{near}`?"));
            *inner = EvalAltResult::ErrorRuntime(Dynamic::from(fault), *position);
        }
    }
    error
}

/// The fault of a name that cannot be registered.
pub(super) fn refused(what: &str, name: &str, package: Option<&str>, why: &str) -> Diagnostic {
    let whose = package.map_or_else(String::new, |package| format!(" of the package `{package}`"));
    Diagnostic::error(format!("the {what} `{name}`{whose} cannot be registered: it {why}"))
}
