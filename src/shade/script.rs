//! A script, parsed and checked: its functions, and the places of its parts for messages.

use std::collections::BTreeMap;
use std::sync::Arc;

use rhai::{
    AST, ASTNode, Caches, Dynamic, Engine, EvalAltResult, Expr, ImmutableString, Module, Position, Scope, Stmt,
};

use super::analysis::Finding;
use super::closures;
use super::fault::{Fault, from_run, span};
use super::host::Words;
use super::link::{Linked, link};
use super::names::AOV_PREFIX;
use super::native;
use crate::diag::{Diagnostic, Diagnostics, Source, Span, nearest};
use crate::scene::material::ScriptFiles;

/// A parsed script that has a `surface`, linked with its modules.
#[derive(Debug)]
pub(super) struct Program {
    /// The script itself.
    pub source: Arc<Source>,
    /// The script itself, then its modules; [`ScriptFunction::file`] is the index.
    pub files: Vec<Arc<Source>>,
    pub ast: AST,
    /// Its functions and those of its modules, by the name that calls in the syntax tree have, and the number of
    /// parameters.
    pub functions: Functions,
    pub surface: Function,
    /// What styles lines, if there is such a function.
    pub line: Option<Function>,
    params: Option<Function>,
    module: Option<(String, Arc<Module>)>,
}

/// A function of a script that the renderer calls for many rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Entry {
    /// `surface(hit, p)`, for every hit.
    Surface,
    /// `line(pair, p)`, or `line(pair)`, for every line that a sample sees.
    Line,
}

impl Entry {
    pub fn name(self) -> &'static str {
        match self {
            Self::Surface => "surface",
            Self::Line => "line",
        }
    }

    /// How it is written.
    pub fn form(self) -> &'static str {
        match self {
            Self::Surface => "surface(hit, p)",
            Self::Line => "line(pair, p)",
        }
    }

    /// Numbers of parameters that it may have.
    pub fn counts(self) -> &'static [usize] {
        match self {
            Self::Surface => &[2],
            Self::Line => &[2, 1],
        }
    }
}

/// A function that a script or a module defines.
#[derive(Clone)]
pub(super) struct ScriptFunction {
    /// Its name as written; what the engine calls it for a closure.
    pub name: String,
    /// Those of a closure begin with the variables that it captures.
    pub parameters: Vec<ImmutableString>,
    pub body: Vec<Stmt>,
    /// Whether it is for one type of `this` only.
    pub is_typed: bool,
    /// Which of the program's files it stands in.
    pub file: usize,
    /// Where its name stands.
    pub span: Span,
}

/// Functions by name and number of parameters.
pub(super) type Functions = BTreeMap<(String, usize), ScriptFunction>;

impl std::fmt::Debug for ScriptFunction {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ScriptFunction").field("name", &self.name).field("span", &self.span).finish_non_exhaustive()
    }
}

impl ScriptFunction {
    /// Whether it is written as `|x| …`.
    pub fn is_closure(&self) -> bool {
        self.name.starts_with(closures::PREFIX)
    }
}

/// A function that is run from outside. Its body is run as it stands instead of being called: an error such as a loop
/// without an end then keeps the place where it happened, which a call replaces by its own.
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
    /// Parses a script with its modules, and checks their functions. `files` are the scene's, `words` the host's.
    pub fn parse(source: &Arc<Source>, files: &ScriptFiles, words: &Words) -> Result<Self, Diagnostics> {
        let Linked { files, ast, functions, module } = link(source, files, words)?;
        let mut faults = Diagnostics::default();
        let entry =
            |entry: Entry, faults: &mut _| Self::find(&functions, entry.name(), entry.counts(), entry.form(), faults);
        let surface = entry(Entry::Surface, &mut faults);
        if surface.is_none() && !faults.has_errors() {
            let fault = Fault::new("this shader has no function `surface`");
            let fault = match nearest(
                "surface",
                functions.values().filter(|f| f.file == 0 && !f.is_closure()).map(|f| f.name.as_str()),
            ) {
                Some(near) => fault.hint(format!("is `{near}` meant to be it?")),
                None => fault,
            };
            let hint = "write: fn surface(hit, p) { #{ base_color: rgb(0.8, 0.2, 0.1) } }";
            faults.push(fault.hint(hint).at(Span::new(source, 0..0)));
        }
        let line = entry(Entry::Line, &mut faults);
        let params = Self::find(&functions, "params", &[0], "params()", &mut faults);
        match surface {
            Some(surface) if !faults.has_errors() => {
                Ok(Self { source: Arc::clone(source), files, functions, surface, line, params, ast, module })
            }
            _ => Err(faults),
        }
    }

    /// The script's own function of a name, if it has one of some numbers of parameters. One of that name with others
    /// only is a fault.
    fn find(
        functions: &Functions,
        name: &str,
        counts: &[usize],
        form: &str,
        faults: &mut Diagnostics,
    ) -> Option<Function> {
        let found: Vec<_> =
            functions.iter().filter(|(_, function)| function.name == name && function.file == 0).collect();
        let of_count = |count: &usize| found.iter().find(|((_, n), _)| n == count);
        if let Some((_, function)) = counts.iter().find_map(of_count) {
            let ScriptFunction { parameters, body, span, .. } = (*function).clone();
            return Some(Function { parameters, body, span });
        }
        for (_, function) in found {
            faults.push(
                Fault::new(format!(
                    "`{name}` must have {} parameters, but it has {}",
                    counts.iter().map(ToString::to_string).collect::<Vec<_>>().join(" or "),
                    function.parameters.len()
                ))
                .hint(format!("write: fn {form}"))
                .at(function.span.clone()),
            );
        }
        None
    }

    /// The name under which the function table has one of the script's own functions that the renderer calls.
    pub fn key(&self, entry: Entry) -> Option<&(String, usize)> {
        let own = |count: &usize| {
            let mut own = self.functions.iter().filter(|(_, function)| function.file == 0);
            own.find(|((_, n), function)| function.name == entry.name() && n == count).map(|(key, _)| key)
        };
        entry.counts().iter().find_map(own)
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
        if let Some((name, module)) = &self.module {
            global.push_import(name.as_str(), Arc::clone(module));
        }
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
        from_run(error, &self.surface.span, &self.files, &self.functions)
    }

    /// What the analysis found, at its place.
    pub fn found(&self, finding: &Finding) -> Diagnostic {
        let (line, column) = finding.place;
        let span = match line {
            0 => self.surface.span.clone(),
            _ => Span::word_at(&self.files[finding.file], line, column.max(1)),
        };
        let fault = Diagnostic::error(finding.message.clone()).at(span);
        match &finding.hint {
            Some(hint) => fault.hint(hint.clone()),
            None => fault,
        }
    }

    /// Where `params` stands.
    pub fn params_span(&self) -> Span {
        self.params.as_ref().unwrap_or(&self.surface).span.clone()
    }

    /// Where a key is written in a record, or else read or set on one, if it is at one place only.
    pub fn key_span(&self, key: &str) -> Option<Span> {
        let (mut written, mut touched) = (Vec::new(), Vec::new());
        self.each_key(|name, in_literal, file, position| {
            if name == key {
                if in_literal { &mut written } else { &mut touched }.push((file, position));
            }
        });
        match (written.as_slice(), touched.as_slice()) {
            ([(file, place)], _) | ([], [(file, place)]) => Some(span(&self.files[*file], *place)),
            _ => None,
        }
    }

    /// Names of extra outputs that are written out anywhere, without the prefix, in any order.
    pub fn written_aovs(&self) -> Vec<String> {
        let mut names = Vec::new();
        self.each_key(|name, _, _, _| names.extend(name.strip_prefix(AOV_PREFIX).map(str::to_owned)));
        names
    }

    /// Shows every key with whether it stands in a record's literal, its file and its place.
    fn each_key(&self, mut see: impl FnMut(&str, bool, usize, Position)) {
        for function in self.functions.values() {
            for statement in &function.body {
                statement.walk(&mut Vec::new(), &mut |path| {
                    match path.last() {
                        Some(ASTNode::Expr(Expr::Map(map, _))) => {
                            map.0.iter().for_each(|(key, _)| see(&key.name, true, function.file, key.pos))
                        }
                        Some(ASTNode::Expr(Expr::Property(property, position))) => {
                            see(&property.2, false, function.file, *position)
                        }
                        _ => {}
                    }
                    true
                });
            }
        }
    }
}

/// The name of a function whose body starts at `body`.
pub(super) fn name_span(source: &Arc<Source>, body: Position, name: &str) -> Span {
    let end = span(source, body).range.start;
    let start = source.text[..end].rfind(&format!("fn {name}")).map_or(end, |at| at + "fn ".len());
    Span::new(source, start..(start + name.len()).min(source.text.len()))
}
