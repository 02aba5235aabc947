//! The host: what scripts may call, and the limits within which they run.
//!
//! Engines are built from nothing rather than from Rhai's standard set, so that every function in reach is here on
//! purpose: no files, clock, sleep or output, and no function of the C library, whose results differ between machines.

use std::collections::BTreeSet;
use std::fmt;
use std::sync::Arc;

use rhai::packages::{
    ArithmeticPackage, BasicArrayPackage, BasicIteratorPackage, BasicMapPackage, BasicStringPackage, LogicPackage,
    Package,
};
use rhai::{Engine, FloatWrapper, LexError, OptimizationLevel, Position, Token};

use super::library;
use super::native::{self, Constant, NativeFunction, NativeValue, Package as NativePackage};
use crate::diag::Diagnostics;
use crate::scene::texture::Texture;

/// Operations of one call of `surface` or `params`: enough for thousands of noise lookups, and a fraction of a second.
pub(super) const MAX_OPERATIONS: u64 = 500_000;
/// Calls inside calls. This times the next stays well within the stack of a render thread, which a test checks.
pub(super) const MAX_CALL_DEPTH: usize = 8;
/// Levels of nesting in the text of a function: each block, bracket and operator adds some.
pub(super) const MAX_EXPRESSION_DEPTH: usize = 64;
/// Bytes of a script: far more than anybody writes, and read in no time.
pub(super) const MAX_SCRIPT: usize = 1 << 20;
/// Functions of a script: some work grows with the square of their number.
pub(super) const MAX_FUNCTIONS: usize = 512;
/// Bytes of a text.
pub(super) const MAX_TEXT: usize = 4096;
/// Elements of an array, with those of arrays in it.
pub(super) const MAX_ARRAY: usize = 1024;
/// Entries of a record, with those of records in it.
pub(super) const MAX_MAP: usize = 256;

/// The library of functions that scripts see: Tusche's own, and what a Rust user registers (DESIGN section 4.5).
#[derive(Clone, Default)]
pub struct Host {
    packages: Vec<Register>,
    natives: Vec<Owned<NativeFunction>>,
    constants: Vec<Owned<(&'static str, NativeValue)>>,
    /// The package that is being registered.
    package: Option<&'static str>,
    faults: Diagnostics,
}

/// What a package registered.
type Owned<T> = (Option<&'static str>, T);

type Register = Arc<dyn Fn(&mut Engine) + Send + Sync>;

impl fmt::Debug for Host {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Host")
            .field("packages", &self.packages.len())
            .field("natives", &self.natives)
            .field("constants", &self.constants)
            .finish_non_exhaustive()
    }
}

impl Host {
    /// A host with Tusche's own library.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// The same host with one more function. A name that is taken is a fault, which [`check`](Self::check) and
    /// [`Shaders::compile`](super::Shaders::compile) tell.
    #[must_use]
    pub fn with_function(mut self, function: NativeFunction) -> Self {
        let name = function.name();
        match function.fault().or_else(|| self.taken(name)) {
            Some(why) => self.faults.push(native::refused("native function", name, self.package, &why)),
            None => self.natives.push((self.package, function)),
        }
        self
    }

    /// The same host with a word that stands for a number or truth in scripts. (A constant vector is a function without
    /// parameters.) A name that is taken is a fault.
    #[must_use]
    pub fn with_constant(mut self, name: &'static str, value: impl Constant) -> Self {
        match self.taken(name) {
            Some(why) => self.faults.push(native::refused("constant", name, self.package, &why)),
            None => self.constants.push((self.package, (name, value.into()))),
        }
        self
    }

    /// The same host with all that a package registers.
    #[must_use]
    pub fn with_package(mut self, package: &(impl NativePackage + ?Sized)) -> Self {
        let outer = self.package.replace(package.name());
        let mut host = package.register(self);
        host.package = outer;
        host
    }

    /// Whether everything could be registered.
    ///
    /// # Errors
    /// All names that are taken, and all functions that cannot be called by scripts.
    pub fn check(&self) -> Result<(), Diagnostics> {
        if self.faults.has_errors() { Err(self.faults.clone()) } else { Ok(()) }
    }

    /// The functions with known types that were added, in the order of their registration.
    pub fn natives(&self) -> impl Iterator<Item = &NativeFunction> {
        self.natives.iter().map(|(_, function)| function)
    }

    /// The function with known types of a name.
    #[must_use]
    pub fn native(&self, name: &str) -> Option<&NativeFunction> {
        self.natives().find(|function| function.name() == name)
    }

    /// All functions that scripts may call, for messages and reference pages: the library's, then those that were added
    /// with known types.
    pub fn functions(&self) -> impl Iterator<Item = library::Function<'_>> {
        #[expect(clippy::map_identity, reason = "it shortens the lifetime")]
        let library = library::functions().map(|function| -> library::Function<'_> { function });
        library.chain(self.natives().map(NativeFunction::listed))
    }

    /// Why a name cannot be registered.
    fn taken(&self, name: &str) -> Option<String> {
        let functions = self.natives.iter().map(|(package, function)| (package, function.name()));
        let constants = self.constants.iter().map(|(package, (known, _))| (package, *known));
        match functions.chain(constants).find(|(_, known)| *known == name) {
            Some((Some(package), _)) => Some(format!("is registered by the package `{package}` already")),
            Some((None, _)) => Some("is registered already".into()),
            None => native::taken(name),
        }
    }

    /// The same host with functions whose types are not known, so that shaders which call them are not compiled:
    /// `register` is called on every engine that is made (one per thread). [`with_function`](Self::with_function) is the
    /// better door where it fits. The limits and the sandbox are set afterwards, so it cannot loosen them. Pictures do not
    /// depend on thread or tile order only as long as the functions depend on nothing but their arguments.
    #[must_use]
    pub fn with(mut self, register: impl Fn(&mut rhai::Engine) + Send + Sync + 'static) -> Self {
        self.packages.push(Arc::new(register));
        self
    }

    /// A new engine. `parameters` are the names that scripts may ask of `p`, `textures` the scene's.
    pub(super) fn engine(&self, parameters: &BTreeSet<String>, textures: &[Arc<Texture>]) -> Engine {
        let mut engine = Engine::new_raw();
        ArithmeticPackage::new().register_into_engine(&mut engine);
        LogicPackage::new().register_into_engine(&mut engine);
        BasicIteratorPackage::new().register_into_engine(&mut engine);
        BasicStringPackage::new().register_into_engine(&mut engine);
        BasicArrayPackage::new().register_into_engine(&mut engine);
        BasicMapPackage::new().register_into_engine(&mut engine);
        library::register(&mut engine, parameters, textures);
        for register in &self.packages {
            register(&mut engine);
        }
        native::register(&mut engine, &self.natives().cloned().collect::<Vec<_>>());
        confine(&mut engine);
        if !self.constants.is_empty() {
            let constants = self.constants.clone();
            #[allow(deprecated, reason = "marked so only because it may change; the version of rhai is pinned")]
            engine.on_parse_token(move |token, _, _| replace(constant(&constants, token)));
        }
        engine
    }
}

/// An engine that parses scripts as the host's engines do, but can run none. `edit` sees each token, with its place,
/// and gives the token to go on with.
pub(super) fn parser(edit: impl Fn(Token, Position) -> Token + Send + Sync + 'static) -> Engine {
    let mut engine = Engine::new_raw();
    confine(&mut engine);
    #[allow(deprecated, reason = "marked so only because it may change; the version of rhai is pinned")]
    engine.on_parse_token(move |token, place, _| edit(replace(token), place));
    engine
}

fn confine(engine: &mut Engine) {
    engine
        .set_max_operations(MAX_OPERATIONS)
        .set_max_call_levels(MAX_CALL_DEPTH)
        .set_max_expr_depths(MAX_EXPRESSION_DEPTH, MAX_EXPRESSION_DEPTH)
        .set_max_string_size(MAX_TEXT)
        .set_max_array_size(MAX_ARRAY)
        .set_max_map_size(MAX_MAP)
        // Modules are linked before anything runs (see `link`); nothing is left to import.
        .set_max_modules(0)
        // Rhai compares floats with a tolerance and takes powers from the C library unless its built-in operators
        // can be overridden, which this allows.
        .set_fast_operators(false)
        // The tree stays as written: positions are exact, and the analysis and the kernels see what the user sees.
        .set_optimization_level(OptimizationLevel::None)
        .set_strict_variables(true)
        .set_fail_on_invalid_map_property(true)
        .on_print(|_| {})
        .on_debug(|_, _, _| {});
    #[allow(deprecated, reason = "marked so only because it may change; the version of rhai is pinned")]
    engine.on_parse_token(|token, _, _| replace(token));
}

/// A registered constant in place of its name.
fn constant(constants: &[Owned<(&'static str, NativeValue)>], token: Token) -> Token {
    let Token::Identifier(name) = &token else { return token };
    match constants.iter().find(|(_, (known, _))| *known == name.as_str()) {
        Some((_, (name, NativeValue::Float(x)))) => {
            Token::FloatConstant((FloatWrapper::new(*x), (*name).into()).into())
        }
        Some((_, (_, NativeValue::Int(x)))) => Token::IntegerConstant(*x),
        Some((_, (_, NativeValue::Bool(x)))) => {
            if *x {
                Token::True
            } else {
                Token::False
            }
        }
        _ => token,
    }
}

/// Replaces words that stand for numbers by those numbers, and what has no place in a shader by an error that says so.
fn replace(token: Token) -> Token {
    if let Token::Identifier(name) = &token
        && let Some((name, value)) = library::CONSTANTS.into_iter().find(|(known, _)| *known == name.as_str())
    {
        return Token::FloatConstant((FloatWrapper::new(value), name.into()).into());
    }
    let told = match &token {
        Token::Export => "a module has no variables to export: all its functions but the `private` ones can be called",
        Token::Identifier(name) | Token::Reserved(name) => match name.as_str() {
            "eval" => "`eval` is not available in shaders: what a script does must be known from its text",
            "Fn" | "curry" => "function pointers are not available in shaders: call the function by its name",
            _ => return token,
        },
        _ => return token,
    };
    let symbol = token.to_string();
    Token::LexError(LexError::ImproperSymbol(symbol, told.to_owned()).into())
}
