//! Which cases of a `switch` a known value picks.
//!
//! The syntax tree keeps the values of cases only as hashes, by a hasher that is private to the script engine. So the
//! engine itself is asked: it runs the same `switch` with every case replaced by its number.

use rhai::{AST, BinaryExpr, Dynamic, Engine, Expr, Module, Position, Stmt, SwitchCasesCollection};

use crate::shade::params::Value;

/// The cases that a value picks, as indices of the expressions, in the order in which their conditions are tried. The
/// default case is left out. `None` for values that `switch` is not asked about.
pub(super) fn picked_cases(value: &Value, cases: &SwitchCasesCollection) -> Option<Vec<usize>> {
    let subject = match value {
        Value::Bool(b) => Dynamic::from(*b),
        Value::Int(n) => Dynamic::from(*n),
        Value::Float(x) => Dynamic::from(*x),
        Value::Text(text) => Dynamic::from(text.clone()),
        _ => return None,
    };
    let subject = Expr::from_dynamic(subject, Position::NONE);
    let mut numbered = cases.clone();
    numbered.def_case = None;
    for (index, case) in numbered.expressions.iter_mut().enumerate() {
        *case = BinaryExpr {
            lhs: Expr::BoolConstant(true, Position::NONE),
            rhs: Expr::IntegerConstant(i64::try_from(index).ok()?, Position::NONE),
        };
    }
    let engine = Engine::new_raw();
    let mut picked = Vec::new();
    loop {
        let statement = Stmt::Switch(Box::new((subject.clone(), numbered.clone())), Position::NONE);
        let result = engine.eval_ast::<Dynamic>(&AST::new([statement], Module::new())).ok()?;
        if result.is_unit() {
            return Some(picked);
        }
        // The next run tells which case comes after this one.
        let index = usize::try_from(result.as_int().ok()?).ok()?;
        numbered.expressions.get_mut(index)?.lhs = Expr::BoolConstant(false, Position::NONE);
        picked.push(index);
    }
}
