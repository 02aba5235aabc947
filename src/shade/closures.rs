//! What scripts may do with closures: bind one to a local by `let`, and call it.
//!
//! Rhai would let a closure be stored anywhere, in a record that another closure captures too. A script could then
//! build a chain of closures of any length, whose end overflows the stack of Rust, or a circle that is never freed.
//! Here the text itself bounds the depth: a closure is written behind `let f =`, and `f` stands for nothing but
//! `f.call(…)`, so a closure can hold only those that were written above it, within its own function.

use std::collections::BTreeSet;

use rhai::{ASTNode, Expr, Position, Stmt};

use super::fault::{Fault, span};
use super::script::{Functions, ScriptFunction};
use crate::diag::{Diagnostics, Source};

/// What the engine's names of closures start with.
pub(super) const PREFIX: &str = "anon$";

/// A closure as it is written.
pub(super) struct Literal<'e> {
    /// The name of its function, whose first parameters are the captured variables.
    pub function: String,
    /// The variables that it shares with the code around it.
    pub captured: Vec<&'e str>,
}

/// The closure that an expression is, if it is one. If it captures variables, the parser has made it a block that
/// shares them and binds them to the function.
pub(super) fn literal(expression: &Expr) -> Option<Literal<'_>> {
    match expression {
        Expr::DynamicConstant(value, _) => {
            let pointer = value.read_lock::<rhai::FnPtr>()?;
            let function = pointer.fn_name().to_owned();
            function.starts_with(PREFIX).then_some(Literal { function, captured: Vec::new() })
        }
        Expr::Stmt(block) => {
            let [Stmt::Share(_), Stmt::Expr(bound)] = block.statements() else { return None };
            let Expr::FnCall(call, _) = &**bound else { return None };
            let (function, captured) = call.args.split_first().filter(|_| call.name == "curry")?;
            let captured = captured.iter().map(|variable| match variable {
                Expr::Variable(variable, ..) => Some(variable.1.as_str()),
                _ => None,
            });
            Some(Literal { captured: captured.collect::<Option<_>>()?, ..literal(function)? })
        }
        _ => None,
    }
}

/// Reports every other use of closures in the functions of a file.
pub(super) fn check(functions: &Functions, source: &std::sync::Arc<Source>, file: usize, faults: &mut Diagnostics) {
    for ((key, _), function) in functions {
        if function.file == file && !key.starts_with(PREFIX) {
            let mut group = Group::default();
            group.gather(function, functions);
            group.check(|message, hint, position| {
                let fault = Fault::new(message).hint(hint);
                let diagnostic = fault.at(span(source, position));
                if !faults.0.contains(&diagnostic) {
                    faults.push(diagnostic);
                }
            });
        }
    }
}

/// A function and the closures in it, which see each other's variables.
#[derive(Default)]
struct Group<'f> {
    functions: Vec<&'f ScriptFunction>,
    seen: BTreeSet<String>,
    /// Names that closures are bound to.
    closures: BTreeSet<String>,
    /// All other names that are bound, with the place.
    others: Vec<(String, Position)>,
}

impl<'f> Group<'f> {
    fn gather(&mut self, function: &'f ScriptFunction, all: &'f Functions) {
        self.functions.push(function);
        let mut inner = Vec::new();
        for statement in &function.body {
            statement.walk(&mut Vec::new(), &mut |path| {
                match path.last() {
                    Some(ASTNode::Stmt(Stmt::Var(variable, ..))) => {
                        let (name, value, _) = &**variable;
                        match literal(value) {
                            Some(_) => {
                                self.closures.insert(name.name.to_string());
                            }
                            None => self.others.push((name.name.to_string(), name.pos)),
                        }
                    }
                    Some(ASTNode::Stmt(Stmt::For(parts, _))) => {
                        for name in std::iter::once(&parts.0).chain(&parts.1) {
                            self.others.push((name.name.to_string(), name.pos));
                        }
                    }
                    Some(ASTNode::Expr(expression @ (Expr::DynamicConstant(..) | Expr::Stmt(_)))) => {
                        if let Some(literal) = literal(expression) {
                            inner.push((literal.function, literal.captured.len(), expression.position()));
                        }
                    }
                    _ => {}
                }
                true
            });
        }
        self.others.extend(
            function
                .parameters
                .iter()
                .filter(|_| !function.is_closure())
                .map(|name| (name.to_string(), function.body.first().map_or(Position::NONE, Stmt::position))),
        );
        for (name, captured, position) in inner {
            let found = all.iter().find(|((key, _), _)| *key == name).map(|(_, function)| function);
            let Some(function) = found else { continue };
            // Bound, it is met twice: once as a whole, once as the function in it, which captures nothing.
            let own = function.parameters.iter().skip(captured);
            if captured > 0 || function.parameters.is_empty() || !self.seen.contains(&name) {
                self.others.extend(own.map(|name| (name.to_string(), position)));
            }
            if self.seen.insert(name) {
                self.gather(function, all);
            }
        }
    }

    fn check(&self, mut report: impl FnMut(String, &str, Position)) {
        for (name, position) in self.others.iter().filter(|(name, _)| self.closures.contains(name)) {
            let message = format!("`{name}` is the name of a closure and of something else in this function");
            report(message, "give one of them another name", *position);
        }
        for statement in self.functions.iter().flat_map(|function| &function.body) {
            statement.walk(&mut Vec::new(), &mut |path| {
                self.check_node(path, &mut report);
                true
            });
        }
    }

    fn check_node(&self, path: &[ASTNode], report: &mut impl FnMut(String, &str, Position)) {
        let [before @ .., ASTNode::Expr(expression)] = path else { return };
        match expression {
            Expr::DynamicConstant(_, position) if literal(expression).is_some() => {
                let is_bound = match before {
                    // The function within a closure that captures variables.
                    [rest @ .., ASTNode::Expr(block), ASTNode::Stmt(_), ASTNode::Expr(_)]
                        if literal(block).is_some() =>
                    {
                        is_initial(rest, block)
                    }
                    _ => is_initial(before, expression),
                };
                if !is_bound {
                    let message = "a closure can only be bound to a variable, and called by its name".to_owned();
                    report(message, "write: let f = |x| x * 2.0; f.call(3.0)", *position);
                }
            }
            Expr::Variable(variable, _, position) if variable.2.is_empty() && self.closures.contains(&*variable.1) => {
                let is_used_well = match before.last() {
                    Some(ASTNode::Expr(Expr::Dot(sides, ..))) => {
                        std::ptr::eq(&raw const sides.lhs, *expression) && calls_first(&sides.rhs)
                    }
                    Some(ASTNode::Expr(Expr::FnCall(call, _))) => call.name == "curry",
                    _ => false,
                };
                if !is_used_well {
                    let message = format!("`{}` is a closure, and can only be called", variable.1);
                    report(message, &format!("write: {}.call(…)", variable.1), *position);
                }
            }
            Expr::MethodCall(call, position) if call.name == "call" => {
                let target = match before {
                    [.., ASTNode::Expr(Expr::Dot(sides, ..))] if std::ptr::eq(&raw const sides.rhs, *expression) => {
                        Some(&sides.lhs)
                    }
                    [.., ASTNode::Expr(Expr::Dot(outer, ..)), ASTNode::Expr(inner)]
                        if std::ptr::eq(&raw const outer.rhs, *inner) =>
                    {
                        Some(&outer.lhs)
                    }
                    _ => None,
                };
                let is_closure =
                    matches!(target, Some(Expr::Variable(variable, ..)) if self.closures.contains(&*variable.1));
                if !is_closure {
                    let message = "`call` belongs to closures that a variable of this function holds".to_owned();
                    report(message, "write: let f = |x| x * 2.0; f.call(3.0)", *position);
                }
            }
            Expr::FnCall(call, position) if call.name == "call" && !call.is_qualified() => {
                let message = "`call` is written behind the closure".to_owned();
                report(message, "write: let f = |x| x * 2.0; f.call(3.0)", *position);
            }
            _ => {}
        }
    }
}

/// Whether the innermost node is a `let` that binds this expression.
fn is_initial(path: &[ASTNode], expression: &Expr) -> bool {
    matches!(path.last(), Some(ASTNode::Stmt(Stmt::Var(variable, ..))) if std::ptr::eq(&raw const variable.1, expression))
}

/// Whether a chain's first link is `call(…)`.
fn calls_first(chain: &Expr) -> bool {
    match chain {
        Expr::MethodCall(call, _) => call.name == "call",
        Expr::Dot(sides, ..) | Expr::Index(sides, ..) => calls_first(&sides.lhs),
        _ => false,
    }
}
