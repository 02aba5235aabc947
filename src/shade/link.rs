//! Modules: several files become one program.
//!
//! `import "lib/hatching" as h;` at the head of a script makes the functions of `lib/hatching.rhai`, beside the script,
//! callable as `h::stroke(…)`. Rhai's own modules resolve calls inside of a module through a table that all files of a
//! run share, so that two files with a function of one name see each other's. Here each file is parsed twice. The first
//! parse tells which word calls or defines which function; in the second, each of these words gets a tail that tells
//! the file (`stroke` of file 2 becomes `stroke__2`). Then all functions fit into one table, and neither the
//! interpreter, the analysis nor the kernels know of files, but for the places in messages. In the same way the path of
//! an image that a script names becomes the number of the scene's texture. A script that names no file is parsed once
//! and stays as it is.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex, PoisonError};

use rhai::{AST, ASTNode, Engine, Expr, FnAccess, FnCallExpr, Module, Position, Stmt, Token};

use super::closures;
use super::fault::{Fault, from_parse_error, span};
use super::host::{self, Host, MAX_FUNCTIONS, MAX_SCRIPT, Words};
use super::library;
use super::script::{Functions, ScriptFunction, name_span};
use crate::diag::{Diagnostic, Diagnostics, Source, Span, nearest};
use crate::scene::material::{ScriptFiles, TextureKey};

/// The most modules of a script.
pub(super) const MAX_MODULES: usize = 64;
/// The longest chain of imports.
const MAX_IMPORT_DEPTH: usize = 16;

/// A script with its modules.
pub(super) struct Linked {
    /// The script itself, then its modules.
    pub files: Vec<Arc<Source>>,
    /// The functions of all files, for the interpreter.
    pub ast: AST,
    /// The same, for those who walk them.
    pub functions: Functions,
    /// What calls of the form `h::stroke(…)` go to, and under which name.
    pub module: Option<(String, Arc<Module>)>,
}

/// Where `import` stands in a script, for the loader of its files.
pub(super) struct Import {
    pub path: String,
    pub alias: String,
    pub path_position: Position,
}

struct File {
    source: Arc<Source>,
    ast: AST,
    tokens: Vec<(Token, Position)>,
    /// File of each alias.
    imports: BTreeMap<String, usize>,
}

/// Parses a script and the modules that it imports.
pub(super) fn link(source: &Arc<Source>, known: &ScriptFiles, words: &Words) -> Result<Linked, Diagnostics> {
    let mut linker = Linker { known, words, files: Vec::new(), chain: Vec::new(), faults: Diagnostics::default() };
    linker.open(source);
    let Linker { files, mut faults, .. } = linker;
    let files: Vec<File> = files.into_iter().flatten().collect();
    if faults.has_errors() {
        return Err(faults);
    }
    let names_textures = files.iter().any(|file| !textures(&file.ast).is_empty());
    let linked = match files.as_slice() {
        [only] if !names_textures => {
            let mut functions = Functions::new();
            add_functions(&mut functions, source, &only.ast, 0, "");
            Linked { files: vec![Arc::clone(source)], ast: only.ast.clone(), functions, module: None }
        }
        _ => join(&files, known, words, &mut faults)?,
    };
    for (index, file) in linked.files.iter().enumerate() {
        closures::check(&linked.functions, file, index, &mut faults);
        refuse_inner_imports(&linked.functions, file, index, &mut faults);
    }
    if faults.has_errors() { Err(faults) } else { Ok(linked) }
}

struct Linker<'a> {
    known: &'a ScriptFiles,
    words: &'a Words,
    /// In the order in which they were opened; `None` while, or if, a file is not complete.
    files: Vec<Option<File>>,
    /// Files whose imports are being followed, outermost first.
    chain: Vec<(usize, Arc<Source>)>,
    faults: Diagnostics,
}

impl Linker<'_> {
    /// Parses a file and all that it imports.
    fn open(&mut self, source: &Arc<Source>) -> usize {
        let index = self.files.len();
        self.files.push(None);
        let (ast, tokens) = match parse(source, self.words) {
            Ok(parsed) => parsed,
            Err(fault) => {
                self.faults.push(fault);
                return index;
            }
        };
        self.chain.push((index, Arc::clone(source)));
        let mut imports = BTreeMap::new();
        for statement in ast.statements() {
            match import(statement) {
                Ok(Some(import)) => self.follow(source, import, &mut imports),
                Ok(None) => self.faults.push(
                    Fault::new("only functions can stand at the top level of a shader")
                        .hint("move values into `params()`, or into functions such as `fn levels() { 4 }`")
                        .at(span(source, statement.position())),
                ),
                Err((fault, position)) => self.faults.push(fault.at(span(source, position))),
            }
        }
        self.chain.pop();
        self.files[index] = Some(File { source: Arc::clone(source), ast, tokens, imports });
        index
    }

    fn follow(&mut self, source: &Arc<Source>, import: Import, imports: &mut BTreeMap<String, usize>) {
        let place = span(source, import.path_position);
        let Import { path, alias, .. } = import;
        let Some(module) = self.known.modules.get(&(source.name.clone(), path.clone())) else {
            let fault = Fault::new(format!("there is no module `{path}`"));
            self.faults.push(fault.hint("modules are files beside the script, ending in .rhai").at(place));
            return;
        };
        if let Some(start) = self.chain.iter().position(|(_, open)| open.name == module.name) {
            let mut names: Vec<&str> = self.chain[start..].iter().map(|(_, open)| open.name.as_str()).collect();
            names.push(&module.name);
            let fault = Fault::new("this import leads back to a file that is being imported");
            self.faults.push(fault.hint(format!("the circle is: {}", names.join(" → "))).at(place));
            return;
        }
        if imports.contains_key(&alias) {
            let fault = Fault::new(format!("another module is imported as `{alias}`, too"));
            self.faults.push(fault.hint("give it another name behind `as`").at(place));
            return;
        }
        let opened = self.files.iter().flatten().position(|file| file.source.name == module.name);
        let known = opened.and_then(|_| {
            self.files.iter().position(|file| file.as_ref().is_some_and(|file| file.source.name == module.name))
        });
        let limit = |fault: String| Fault::new(fault).hint("join some of the files").at(place.clone());
        let index = match known {
            Some(index) => index,
            None if self.files.len() > MAX_MODULES => {
                self.faults.push(limit(format!("a script can have at most {MAX_MODULES} modules")));
                return;
            }
            None if self.chain.len() > MAX_IMPORT_DEPTH => {
                self.faults.push(limit(format!("modules import each other more than {MAX_IMPORT_DEPTH} deep")));
                return;
            }
            None => self.open(&Arc::clone(module)),
        };
        imports.insert(alias, index);
    }
}

/// The import that a statement is; `None` for another statement.
fn import(statement: &Stmt) -> Result<Option<Import>, (Fault, Position)> {
    let Stmt::Import(parts, position) = statement else { return Ok(None) };
    let (path, alias) = &**parts;
    let Expr::StringConstant(path, path_position) = path else {
        let fault = Fault::new("the module to import must be written out as a text");
        return Err((fault.hint("write: import \"lib/hatching\" as h;"), *position));
    };
    if alias.name.is_empty() {
        let fault = Fault::new("a module needs a name to be called by");
        return Err((fault.hint(format!("write: import \"{path}\" as m;")), *position));
    }
    Ok(Some(Import { path: path.to_string(), alias: alias.name.to_string(), path_position: *path_position }))
}

/// The imports at the head of a script and the images that it names, for those who look up its files; none if it cannot
/// be parsed.
pub(super) fn named_files(source: &Arc<Source>) -> (Vec<Import>, Vec<NamedTexture>) {
    // Most scripts name no files, and parsing a long one takes time.
    let may_name = ["import", "texture"].iter().any(|word| source.text.contains(word));
    let Some(ast) = may_name.then(|| glance(source)).flatten() else { return Default::default() };
    let imports = ast.statements().iter().filter_map(|statement| import(statement).ok().flatten());
    (imports.collect(), textures(&ast))
}

/// Parses a script for what it names, whatever a plug-in may have added to the language.
fn glance(source: &Arc<Source>) -> Option<AST> {
    let mut engine = host::parser(&Host::new().words(), |token, _| token);
    engine.set_strict_variables(false);
    compile(&engine, source).ok().filter(|_| source.text.len() <= MAX_SCRIPT)
}

fn parse(source: &Arc<Source>, words: &Words) -> Result<(AST, Vec<(Token, Position)>), Diagnostic> {
    let size = source.text.len();
    if size > MAX_SCRIPT {
        let fault = Diagnostic::error(format!("a script may have at most {MAX_SCRIPT} bytes, and this has {size}"));
        return Err(fault.in_file(&source.name));
    }
    let tokens = Arc::new(Mutex::new(Vec::new()));
    let seen = Arc::clone(&tokens);
    let engine = host::parser(words, move |token, position| {
        seen.lock().unwrap_or_else(PoisonError::into_inner).push((token.clone(), position));
        token
    });
    let ast = compile(&engine, source)?;
    let count = ast.iter_fn_def().count();
    if count > MAX_FUNCTIONS {
        let fault = Fault::new(format!("a script may have at most {MAX_FUNCTIONS} functions, and this has {count}"));
        return Err(fault.at(Span::new(source, 0..0)));
    }
    let tokens = std::mem::take(&mut *tokens.lock().unwrap_or_else(PoisonError::into_inner));
    Ok((ast, tokens))
}

fn compile(engine: &Engine, source: &Arc<Source>) -> Result<AST, Diagnostic> {
    engine.compile(source.text.as_str()).map_err(|error| from_parse_error(&error, source))
}

/// An image that a script names: `texture("grain.png", uv, "clamp", "linear")`.
pub(super) struct NamedTexture {
    pub path: String,
    pub path_position: Position,
    /// How it continues outside of 0 … 1, and how its colours are encoded, as far as written.
    pub options: Vec<(Option<String>, Position)>,
}

/// The images that the functions of a syntax tree name.
pub(super) fn textures(ast: &AST) -> Vec<NamedTexture> {
    let own: BTreeSet<usize> =
        ast.iter_fn_def().filter(|function| function.name == "texture").map(|function| function.params.len()).collect();
    let mut found = Vec::new();
    each_call(ast, |call, _| {
        if call.name != "texture" || call.is_qualified() || own.contains(&call.args.len()) {
            return;
        }
        if let [Expr::StringConstant(path, path_position), _, options @ ..] = call.args.as_slice() {
            let text = |option: &Expr| match option {
                Expr::StringConstant(text, position) => (Some(text.to_string()), *position),
                other => (None, other.position()),
            };
            let options = options.iter().map(text).collect();
            found.push(NamedTexture { path: path.to_string(), path_position: *path_position, options });
        }
    });
    found
}

/// What a word or a text becomes in the second parse.
enum Edit {
    Word(String),
    Text(String),
}

/// Gives every function a name of its own, and puts all into one table.
fn join(files: &[File], known: &ScriptFiles, words: &Words, faults: &mut Diagnostics) -> Result<Linked, Diagnostics> {
    let mut tail = "__".to_owned();
    while files.iter().any(|file| file.source.text.contains(&tail)) {
        tail.push('_');
    }
    let namespace = format!("modules{tail}");
    let mut library = Module::new();
    let mut public = Module::new();
    let mut functions = Functions::new();
    for (index, file) in files.iter().enumerate() {
        let mut edits = edits(files, index, &tail, &namespace, faults);
        for texture in textures(&file.ast) {
            let key = texture.key(&file.source);
            match key.and_then(|key| known.textures.get(&key)) {
                Some(id) => _ = edits.insert(texture.path_position, Edit::Text(library::texture_name(*id))),
                None => faults.push(
                    Fault::new(format!("the image `{}` was not loaded with the scene", texture.path))
                        .at(span(&file.source, texture.path_position)),
                ),
            }
        }
        let engine = host::parser(words, move |token, position| match (edits.get(&position), &token) {
            (Some(Edit::Word(name)), Token::Identifier(_)) => Token::Identifier(Box::new(name.as_str().into())),
            (Some(Edit::Text(text)), Token::StringConstant(_)) => Token::StringConstant(Box::new(text.as_str().into())),
            _ => token,
        });
        let ast = match compile(&engine, &file.source) {
            Ok(ast) => ast,
            Err(fault) => {
                faults.push(fault);
                continue;
            }
        };
        let tail = if files.len() == 1 { String::new() } else { format!("{tail}{index}") };
        add_functions(&mut functions, &file.source, &ast, index, &tail);
        for function in ast.iter_fn_def() {
            library.set_script_fn(Arc::clone(function));
            if function.access == FnAccess::Public {
                public.set_script_fn(Arc::clone(function));
            }
        }
    }
    if faults.has_errors() {
        return Err(std::mem::take(faults));
    }
    public.build_index();
    Ok(Linked {
        files: files.iter().map(|file| Arc::clone(&file.source)).collect(),
        ast: AST::new([], library),
        functions,
        module: (files.len() > 1).then(|| (namespace, Arc::new(public))),
    })
}

impl NamedTexture {
    /// By which the scene's files know it; `None` if an option is not written out.
    pub fn key(&self, source: &Source) -> Option<TextureKey> {
        let mut options = self.options.iter();
        let mut next = |default: &str| match options.next() {
            Some((text, _)) => text.clone(),
            None => Some(default.to_owned()),
        };
        Some(TextureKey {
            script: source.name.clone(),
            path: self.path.clone(),
            wrap: next("repeat")?,
            color: next("srgb")?,
        })
    }
}

/// What some words of a file become, by place: where functions are defined or called, and the names of modules.
fn edits(
    files: &[File],
    index: usize,
    tail: &str,
    namespace: &str,
    faults: &mut Diagnostics,
) -> BTreeMap<Position, Edit> {
    let file = &files[index];
    let mut edits = BTreeMap::new();
    if files.len() == 1 {
        return edits;
    }
    let own: BTreeSet<(&str, usize)> =
        file.ast.iter_fn_def().map(|function| (function.name.as_str(), function.params.len())).collect();
    for (at, (token, _)) in file.tokens.iter().enumerate() {
        let name = |offset: usize| match file.tokens.get(at + offset) {
            Some((Token::Identifier(name), position)) => Some((name.to_string(), *position)),
            _ => None,
        };
        match token {
            Token::Fn => {
                // A function may be for one type of `this`: fn int.double().
                let typed = matches!(file.tokens.get(at + 2), Some((Token::Period, _)));
                if let Some((name, position)) = name(if typed { 3 } else { 1 }) {
                    edits.insert(position, Edit::Word(format!("{name}{tail}{index}")));
                }
            }
            Token::Import => {
                if let Some((_, position)) = name(3) {
                    edits.insert(position, Edit::Word(namespace.to_owned()));
                }
            }
            _ => {}
        }
    }
    each_call(&file.ast, |call, position| {
        if call.is_operator_call() {
            return;
        }
        let count = call.args.len();
        if !call.is_qualified() {
            if own.contains(&(call.name.as_str(), count)) {
                edits.insert(position, Edit::Word(format!("{}{tail}{index}", call.name)));
            }
            return;
        }
        let first = call.namespace.path.first().map_or(position, |name| name.pos);
        let at = file.tokens.iter().position(|(_, position)| *position == first);
        let word = at.and_then(|at| file.tokens.get(at + 2)).map_or(position, |(_, position)| *position);
        match callee(files, file, call, count) {
            Ok(target) => {
                edits.insert(first, Edit::Word(namespace.to_owned()));
                edits.insert(word, Edit::Word(format!("{}{tail}{target}", call.name)));
            }
            Err(fault) => {
                faults.push(fault.at(span(&file.source, if call.namespace.path.len() > 1 { first } else { word })))
            }
        }
    });
    edits
}

/// The file that a call of the form `h::stroke(…)` goes to.
fn callee(files: &[File], file: &File, call: &FnCallExpr, count: usize) -> Result<usize, Fault> {
    let alias = call.namespace.root();
    let name = call.name.as_str();
    if call.namespace.path.len() > 1 {
        return Err(Fault::new("the modules of a module are its own").hint("import what is needed in this file, too"));
    }
    let Some(&target) = file.imports.get(alias) else {
        let fault = Fault::new(format!("there is no module `{alias}`"));
        return Err(fault.propose(alias, file.imports.keys().map(String::as_str)));
    };
    let all = || files[target].ast.iter_fn_def().filter(|function| !function.name.starts_with(closures::PREFIX));
    let named: Vec<_> = all().filter(|function| function.name == name).collect();
    let module = &files[target].source.name;
    match named.iter().find(|function| function.params.len() == count) {
        Some(function) if function.access == FnAccess::Private => {
            let fault = Fault::new(format!("`{name}` is private to its module"));
            Err(fault.hint(format!("take `private` away from it in {module}, or call another function")))
        }
        Some(_) => Ok(target),
        None if named.is_empty() => {
            let fault = Fault::new(format!("the module `{alias}` has no function `{name}`"));
            let public: Vec<_> =
                all().filter(|f| f.access == FnAccess::Public).map(|function| function.name.as_str()).collect();
            Err(match nearest(name, public.iter().copied()) {
                Some(near) => fault.hint(format!("did you mean `{near}`?")),
                None if public.is_empty() => fault.hint(format!("{module} has none that can be called")),
                None => fault.hint(format!("there are: {}", public.join(", "))),
            })
        }
        None => {
            let counts: Vec<_> = named.iter().map(|function| function.params.len().to_string()).collect();
            Err(Fault::new(format!("`{alias}::{name}` takes {} arguments, not {count}", counts.join(" or "))))
        }
    }
}

/// Shows every call in a file with its place.
fn each_call(ast: &AST, mut see: impl FnMut(&FnCallExpr, Position)) {
    ast.walk(&mut |path| {
        if let Some(
            ASTNode::Expr(Expr::FnCall(call, position) | Expr::MethodCall(call, position))
            | ASTNode::Stmt(Stmt::FnCall(call, position)),
        ) = path.last()
        {
            see(call, *position);
        }
        true
    });
}

/// The functions of a syntax tree of which no source is known.
pub(super) fn functions(ast: &AST) -> Functions {
    let mut functions = Functions::new();
    add_functions(&mut functions, &Source::new("", ""), ast, 0, "");
    functions
}

/// Adds the functions of a file's syntax tree. `tail` is what their names got.
fn add_functions(functions: &mut Functions, source: &Arc<Source>, ast: &AST, index: usize, tail: &str) {
    for function in ast.iter_fn_def() {
        let count = function.params.len();
        // The engine does not let bodies out, but walks them. (Its `clone_functions_only_filtered` would copy all.)
        let mut alone = ast.clone_functions_only();
        alone.retain_functions(|_, _, name, n| name == function.name && n == count);
        let mut body = Vec::new();
        alone.walk(&mut |path: &[ASTNode]| {
            if let [ASTNode::Stmt(statement)] = path {
                body.push((*statement).clone());
            }
            true
        });
        let name = function.name.strip_suffix(tail).unwrap_or(&function.name);
        let new = ScriptFunction {
            name: name.to_owned(),
            parameters: function.params.to_vec(),
            body,
            is_typed: function.this_type.is_some(),
            file: index,
            span: name_span(source, function.body.start_position(), name),
        };
        let entry = functions.entry((function.name.to_string(), count));
        // Two of one name differ in their type of `this`; a closure that two files share does not differ.
        entry.and_modify(|other| other.is_typed |= !other.is_closure()).or_insert(new);
    }
}

fn refuse_inner_imports(functions: &Functions, source: &Arc<Source>, index: usize, faults: &mut Diagnostics) {
    for statement in functions.values().filter(|function| function.file == index).flat_map(|function| &function.body) {
        statement.walk(&mut Vec::new(), &mut |path| {
            if let Some(ASTNode::Stmt(Stmt::Import(_, position))) = path.last() {
                let fault = Fault::new("`import` can only stand at the head of a script, outside of its functions");
                faults.push(fault.at(span(source, *position)));
            }
            true
        });
    }
}
