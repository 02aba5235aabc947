//! Statements: blocks, variables, `if` and `switch`, and the ways out.

use rhai::{ASTFlags, Expr, FlowControl, Position, RangeCase, Stmt, SwitchCasesCollection};

use super::super::ir::{BoolBinary, Code, Comparison, Operand};
use super::meaning::Meaning;
use super::{Flow, Lowerer};

impl Lowerer<'_> {
    /// Walks a block with its own scope. Its value is that of its last statement.
    pub(super) fn block(&mut self, statements: &[Stmt]) -> Flow<Meaning> {
        self.scoped(|lowerer| lowerer.statements(statements))
    }

    /// Walks statements in the current scope, as long as control is here at any hit.
    pub(super) fn statements(&mut self, statements: &[Stmt]) -> Flow<Meaning> {
        let mut value = Meaning::Unit;
        for statement in statements {
            if self.is_dead() {
                return Ok(Meaning::Undefined);
            }
            value = self.statement(statement)?;
        }
        Ok(if self.is_dead() { Meaning::Undefined } else { value })
    }

    fn statement(&mut self, statement: &Stmt) -> Flow<Meaning> {
        self.step(statement.position())?;
        match statement {
            Stmt::Noop(_) => Ok(Meaning::Unit),
            Stmt::Expr(expression) => self.expression(expression),
            Stmt::FnCall(call, position) => self.function_call(call, *position),
            Stmt::Block(block) => self.block(block.statements()),
            Stmt::Var(variable, flags, _) => {
                let (name, expression, _) = &**variable;
                let value = self.expression(expression)?;
                let cell = self.declare(&name.name, value);
                self.cells[cell].constant = flags.contains(ASTFlags::CONSTANT);
                Ok(Meaning::Unit)
            }
            Stmt::Assignment(assignment) => {
                let (operator, sides) = &**assignment;
                self.assignment(operator, &sides.lhs, &sides.rhs)?;
                Ok(Meaning::Unit)
            }
            Stmt::If(flow, _) => self.if_else(flow),
            Stmt::Switch(switch, position) => self.switch(&switch.0, &switch.1, *position),
            Stmt::While(flow, position) => {
                let endless = matches!(flow.expr, Expr::Unit(_));
                let condition = (!endless).then_some((&flow.expr, true));
                self.repeat(condition, flow.body.statements(), false, *position)
            }
            Stmt::Do(flow, flags, position) => {
                let goes_on = !flags.contains(ASTFlags::NEGATED);
                self.repeat(Some((&flow.expr, goes_on)), flow.body.statements(), true, *position)
            }
            Stmt::For(parts, position) => {
                let (item, counter, flow) = &**parts;
                let counter = counter.as_ref().map(|counter| counter.name.as_str());
                self.for_each(&item.name, counter, flow, *position)
            }
            Stmt::BreakLoop(value, flags, position) => {
                let value = self.optional(value.as_deref())?;
                if !self.leave_loop(&value, flags.contains(ASTFlags::BREAK)) {
                    return self.give_up(*position, "a `break` or `continue` outside of a loop");
                }
                Ok(Meaning::Undefined)
            }
            Stmt::Return(value, flags, _) => {
                let value = self.optional(value.as_deref())?;
                if flags.contains(ASTFlags::BREAK) {
                    // `throw`: the interpreter will say what.
                    self.fail();
                } else {
                    self.leave_call(&value);
                }
                Ok(Meaning::Undefined)
            }
            Stmt::Share(variables) => {
                for (variable, _) in &**variables {
                    match self.find(&variable.name) {
                        Some(cell) => self.cells[cell].shared = true,
                        None => return self.give_up(variable.pos, "this captured variable"),
                    }
                }
                Ok(Meaning::Unit)
            }
            Stmt::TryCatch(_, position) => self.give_up(*position, "`try`"),
            other => self.give_up(other.position(), "this statement"),
        }
    }

    fn optional(&mut self, expression: Option<&Expr>) -> Flow<Meaning> {
        expression.map_or(Ok(Meaning::Unit), |expression| self.expression(expression))
    }

    fn if_else(&mut self, flow: &FlowControl) -> Flow<Meaning> {
        let condition = self.expression(&flow.expr)?;
        let condition = self.truth(&condition, flow.expr.position())?;
        self.branch(
            condition,
            |lowerer| lowerer.block(flow.body.statements()),
            |lowerer| lowerer.block(flow.branch.statements()),
        )
    }

    /// A condition as a mask.
    pub(super) fn truth(&mut self, value: &Meaning, position: Position) -> Flow<Operand> {
        match value {
            Meaning::Bool(operand) => Ok(*operand),
            Meaning::Undefined => Ok(Operand::FALSE),
            Meaning::Choice(mask, sides) => {
                let (a, b) = (self.truth(&sides[0], position)?, self.truth(&sides[1], position)?);
                Ok(self.builder.select(*mask, a, b))
            }
            other => self.give_up(position, &format!("a condition that is {}", other.name())),
        }
    }

    /// The cases are tried in order: those whose value equals the subject, then ranges, then the default.
    fn switch(&mut self, subject: &Expr, cases: &SwitchCasesCollection, position: Position) -> Flow<Meaning> {
        let subject = self.expression(subject)?;
        if self.is_dead() {
            return Ok(Meaning::Undefined);
        }
        let mut tests: Vec<(Operand, usize)> = Vec::new();
        let mut by_value: Vec<_> = cases.cases.values().collect();
        // Different values exclude each other, so that their order only decides the order of instructions.
        by_value.sort_by_key(|case| case.blocks.first().copied());
        let mut any = Operand::FALSE;
        for case in by_value {
            let Some(value) = self.literal(&case.value) else {
                return self.give_up(position, "a `switch` with such a case");
            };
            let equal = self.same(&subject, &value, position)?;
            any = self.builder.or(any, equal);
            tests.extend(case.blocks.iter().map(|block| (equal, *block)));
        }
        // The engine looks at ranges where no single value has fitted or none of its conditions has held.
        if !cases.ranges.is_empty() && !cases.cases.is_empty() {
            let has_condition = |index: &usize| !matches!(cases.expressions[*index].lhs, Expr::BoolConstant(true, _));
            if cases.cases.values().flat_map(|case| case.blocks.iter()).any(has_condition) {
                return self.give_up(position, "a `switch` with ranges beside cases with conditions");
            }
        }
        for range in &cases.ranges {
            let inside = self.inside(&subject, range);
            let inside = self.builder.and_not(inside, any);
            tests.push((inside, range.index()));
        }
        self.cases(&tests, cases)
    }

    fn cases(&mut self, tests: &[(Operand, usize)], cases: &SwitchCasesCollection) -> Flow<Meaning> {
        let Some(((fits, index), others)) = tests.split_first() else {
            return match cases.def_case {
                Some(default) => self.expression(&cases.expressions[default].rhs),
                None => Ok(Meaning::Unit),
            };
        };
        if *fits == Operand::FALSE {
            return self.cases(others, cases);
        }
        let case = &cases.expressions[*index];
        let condition = match &case.lhs {
            Expr::BoolConstant(true, _) => *fits,
            lhs => {
                // Asked only at hits whose value fits.
                let position = lhs.position();
                let asked = self.branch(*fits, |lowerer| lowerer.expression(lhs), |_| Ok(Meaning::bool(false)))?;
                let holds = self.truth(&asked, position)?;
                self.builder.and(*fits, holds)
            }
        };
        self.branch(condition, |lowerer| lowerer.expression(&case.rhs), |lowerer| lowerer.cases(others, cases))
    }

    /// Whether a subject equals the value of a case: of the same type, and the same bits.
    fn same(&mut self, subject: &Meaning, value: &Meaning, position: Position) -> Flow<Operand> {
        match (subject, value) {
            (Meaning::Choice(mask, sides), _) => {
                let (a, b) = (self.same(&sides[0], value, position)?, self.same(&sides[1], value, position)?);
                Ok(self.builder.select(*mask, a, b))
            }
            (Meaning::Int(a), Meaning::Int(b)) => {
                Ok(self.builder.emit(Code::CompareInts(Comparison::Equal), &[*a, *b]))
            }
            (Meaning::Bool(a), Meaning::Bool(b)) => {
                let differ = self.builder.emit(Code::Bool2(BoolBinary::Xor), &[*a, *b]);
                Ok(self.builder.not(differ))
            }
            (Meaning::Text(_) | Meaning::Word(..), Meaning::Text(_)) => self.texts_equal(subject, value, position),
            (Meaning::Float(Operand::Float(a)), Meaning::Float(Operand::Float(b))) => Ok(Operand::Bool(a == b)),
            (Meaning::Float(_), Meaning::Float(_)) => self.give_up(position, "a `switch` on a float"),
            (Meaning::Unit, Meaning::Unit) => Ok(Operand::TRUE),
            (Meaning::Record(_) | Meaning::Array(_) | Meaning::Vector(_), _) => {
                self.give_up(position, &format!("a `switch` on {}", subject.name()))
            }
            _ => Ok(Operand::FALSE),
        }
    }

    fn inside(&mut self, subject: &Meaning, range: &RangeCase) -> Operand {
        let (low, end, inclusive) = match range {
            RangeCase::ExclusiveInt(range, _) => (range.start, range.end, false),
            RangeCase::InclusiveInt(range, _) => (*range.start(), *range.end(), true),
        };
        let under = if inclusive { Comparison::LessEqual } else { Comparison::Less };
        match subject {
            Meaning::Choice(mask, sides) => {
                let (a, b) = (self.inside(&sides[0], range), self.inside(&sides[1], range));
                self.builder.select(*mask, a, b)
            }
            Meaning::Int(x) => {
                let above = self.builder.emit(Code::CompareInts(Comparison::GreaterEqual), &[*x, Operand::Int(low)]);
                let below = self.builder.emit(Code::CompareInts(under), &[*x, Operand::Int(end)]);
                self.builder.and(above, below)
            }
            #[expect(clippy::cast_precision_loss, reason = "an int counts as the nearest float")]
            Meaning::Float(x) => {
                let (low, end) = (Operand::float(low as f32), Operand::float(end as f32));
                let above = self.builder.emit(Code::CompareFloats(Comparison::GreaterEqual), &[*x, low]);
                let below = self.builder.emit(Code::CompareFloats(under), &[*x, end]);
                self.builder.and(above, below)
            }
            _ => Operand::FALSE,
        }
    }
}
