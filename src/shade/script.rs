//! A script, parsed and checked: its functions, and the places of its parts for messages.

use std::sync::Arc;

use rhai::{AST, ASTNode, Caches, Dynamic, Engine, EvalAltResult, Expr, ImmutableString, Position, Scope, Stmt};

use super::analysis::Finding;
use super::fault::{Fault, from_parse_error, from_run, span};
use super::host::{MAX_FUNCTIONS, MAX_SCRIPT};
use super::names::AOV_PREFIX;
use super::native;
use crate::diag::{Diagnostic, Diagnostics, Source, Span, nearest};

/// A parsed script that has a `surface`.
#[derive(Debug)]
pub(super) struct Program {
    pub source: Arc<Source>,
    pub ast: AST,
    /// Its functions with their numbers of parameters, sorted.
    pub functions: Vec<(String, usize)>,
    pub surface: Function,
    params: Option<Function>,
}

/// A function of a script. Its body is run as it stands instead of being called: an error such as a loop without an
/// end then keeps the place where it happened, which a call replaces by its own.
pub(super) struct Function {
    parameters: Vec<ImmutableString>,
    body: Vec<Stmt>,
    /// Where its name stands.
    pub span: Span,
}

impl std::fmt::Debug for Function {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Function").field("span", &self.span).finish_non_exhaustive()
    }
}

impl Program {
    /// Parses a script and checks its functions.
    pub fn parse(engine: &Engine, source: &Arc<Source>) -> Result<Self, Diagnostics> {
        let size = source.text.len();
        if size > MAX_SCRIPT {
            let fault = Diagnostic::error(format!("a script may have at most {MAX_SCRIPT} bytes, and this has {size}"));
            return Err(fault.in_file(&source.name).into());
        }
        let ast = engine.compile(source.text.as_str()).map_err(|error| from_parse_error(&error, source))?;
        let count = ast.iter_fn_def().count();
        if count > MAX_FUNCTIONS {
            let fault =
                Fault::new(format!("a script may have at most {MAX_FUNCTIONS} functions, and this has {count}"));
            return Err(fault.at(Span::new(source, 0..0)).into());
        }
        let mut faults = Diagnostics::default();
        if let Some(statement) = ast.statements().first() {
            faults.push(
                Fault::new("only functions can stand at the top level of a shader")
                    .hint("move values into `params()`, or into functions such as `fn levels() { 4 }`")
                    .at(span(source, statement.position())),
            );
        }
        let surface = Self::find(&ast, source, "surface", 2, "surface(hit, p)", &mut faults);
        if surface.is_none() && !faults.has_errors() {
            let fault = Fault::new("this shader has no function `surface`");
            let fault = match nearest("surface", ast.iter_functions().map(|function| function.name)) {
                Some(near) => fault.hint(format!("is `{near}` meant to be it?")),
                None => fault,
            };
            let hint = "write: fn surface(hit, p) { #{ base_color: rgb(0.8, 0.2, 0.1) } }";
            faults.push(fault.hint(hint).at(Span::new(source, 0..0)));
        }
        let params = Self::find(&ast, source, "params", 0, "params()", &mut faults);
        match surface {
            Some(surface) if !faults.has_errors() => {
                let mut functions: Vec<_> =
                    ast.iter_functions().map(|function| (function.name.to_owned(), function.params.len())).collect();
                functions.sort();
                Ok(Self { source: Arc::clone(source), functions, surface, params, ast })
            }
            _ => Err(faults),
        }
    }

    /// The function of a name, if it has `count` parameters. One of that name with others only is a fault.
    fn find(
        ast: &AST,
        source: &Arc<Source>,
        name: &str,
        count: usize,
        form: &str,
        faults: &mut Diagnostics,
    ) -> Option<Function> {
        let found: Vec<_> = ast.iter_fn_def().filter(|function| function.name == name).collect();
        if let Some(function) = found.iter().find(|function| function.params.len() == count) {
            let mut alone = ast.clone();
            alone.retain_functions(|_, _, known, n| known == name && n == count);
            let mut body = Vec::new();
            alone.walk(&mut |path| {
                if let [ASTNode::Stmt(statement)] = path {
                    body.push((*statement).clone());
                }
                true
            });
            let span = name_span(source, function.body.start_position(), name);
            return Some(Function { parameters: function.params.to_vec(), body, span });
        }
        for function in found {
            faults.push(
                Fault::new(format!("`{name}` must have {count} parameters, but it has {}", function.params.len()))
                    .hint(format!("write: fn {form}"))
                    .at(name_span(source, function.body.start_position(), name)),
            );
        }
        None
    }

    /// Runs one of the functions with its arguments.
    pub fn run(
        &self,
        engine: &Engine,
        caches: &mut Caches,
        function: &Function,
        arguments: impl IntoIterator<Item = Dynamic>,
    ) -> Result<Dynamic, Box<EvalAltResult>> {
        let mut global = engine.new_global_runtime_state();
        global.lib.push(self.ast.shared_lib().clone());
        // Not the outermost level, where `const` would be kept as a global constant.
        global.scope_level = 1;
        let mut scope = Scope::new();
        for (name, value) in function.parameters.iter().zip(arguments) {
            scope.push_dynamic(name.clone(), value);
        }
        #[allow(deprecated, reason = "the one door to a cache of resolved functions that lasts longer than a call")]
        let result = engine.eval_statements_raw(&mut global, caches, &mut scope, &function.body);
        result.map_err(|error| native::clarify(engine, error))
    }

    /// What `params()` returns; an empty record without it.
    pub fn defaults(&self, engine: &Engine) -> Result<Dynamic, Diagnostic> {
        match &self.params {
            None => Ok(Dynamic::from_map(rhai::Map::new())),
            Some(params) => self.run(engine, &mut Caches::new(), params, []).map_err(|error| self.explain(&error)),
        }
    }

    /// An error of a run, with its place.
    pub fn explain(&self, error: &EvalAltResult) -> Diagnostic {
        from_run(error, &self.surface.span, &self.functions)
    }

    /// What the analysis found, at its place.
    pub fn found(&self, finding: &Finding) -> Diagnostic {
        let (line, column) = finding.place;
        let span = match line {
            0 => self.surface.span.clone(),
            _ => Span::word_at(&self.source, line, column.max(1)),
        };
        let fault = Diagnostic::error(finding.message.clone()).at(span);
        match &finding.hint {
            Some(hint) => fault.hint(hint.clone()),
            None => fault,
        }
    }

    /// Where the name of a function with this many parameters stands.
    pub fn function_span(&self, name: &str, parameters: usize) -> Span {
        let mut functions = self.ast.iter_fn_def();
        match functions.find(|function| function.name == name && function.params.len() == parameters) {
            Some(function) => name_span(&self.source, function.body.start_position(), name),
            None => Span::new(&self.source, 0..0),
        }
    }

    /// Where `params` stands.
    pub fn params_span(&self) -> Span {
        self.params.as_ref().unwrap_or(&self.surface).span.clone()
    }

    /// Where a key is written in a record, or else read or set on one, if it is at one place only.
    pub fn key_span(&self, key: &str) -> Option<Span> {
        let (mut written, mut touched) = (Vec::new(), Vec::new());
        self.each_key(|name, in_literal, position| {
            if name == key {
                if in_literal { &mut written } else { &mut touched }.push(position);
            }
        });
        match (written.as_slice(), touched.as_slice()) {
            ([place], _) | ([], [place]) => Some(span(&self.source, *place)),
            _ => None,
        }
    }

    /// Names of extra outputs that are written out anywhere, without the prefix, in any order.
    pub fn written_aovs(&self) -> Vec<String> {
        let mut names = Vec::new();
        self.each_key(|name, _, _| names.extend(name.strip_prefix(AOV_PREFIX).map(str::to_owned)));
        names
    }

    /// Shows every key with whether it stands in a record's literal, and its place.
    fn each_key(&self, mut see: impl FnMut(&str, bool, Position)) {
        self.ast.walk(&mut |path| {
            match path.last() {
                Some(ASTNode::Expr(Expr::Map(map, _))) => {
                    map.0.iter().for_each(|(key, _)| see(&key.name, true, key.pos))
                }
                Some(ASTNode::Expr(Expr::Property(property, position))) => see(&property.2, false, *position),
                _ => {}
            }
            true
        });
    }
}

/// The name of a function whose body starts at `body`.
fn name_span(source: &Arc<Source>, body: Position, name: &str) -> Span {
    let end = span(source, body).range.start;
    let start = source.text[..end].rfind(&format!("fn {name}")).map_or(end, |at| at + "fn ".len());
    Span::new(source, start..(start + name.len()).min(source.text.len()))
}
