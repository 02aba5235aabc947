//! Walking closures: code that shares variables with the code around it.
//!
//! The script engine makes a captured variable shared: the closure sees later changes, and changes it itself. Scripts
//! can only bind a closure to a local and call it (see [`closures`]), so wherever it is called, the variables that it
//! captures are in reach: of the calling code, or in turn captured by the closure that the calling code belongs to.
//! A call takes their values along and puts them back.

use std::rc::Rc;

use rhai::Position;

use super::value::{Abstract, Cell, Closure, Shape};
use super::walk::{Call, Flow, Variable, Variables, Walker};
use crate::shade::closures;

impl Walker<'_> {
    /// A closure, where it is written: what it captures is shared from here on.
    pub(super) fn closure(&mut self, literal: &closures::Literal, position: Position) -> Flow<Abstract> {
        let mut captured = Vec::with_capacity(literal.captured.len());
        for name in &literal.captured {
            let fresh = self.fresh();
            let Some(variable) = self.find(name) else {
                return self.give_up(position, "a closure that captures what is no variable");
            };
            captured.push((Rc::clone(&variable.name), *variable.cell.get_or_insert(fresh)));
        }
        let named = self.functions.keys().find(|(name, _)| *name == literal.function);
        match named {
            Some(function) => {
                Ok(self.constant(Shape::Closure(Rc::new(Closure { function: function.clone(), captured }))))
            }
            None => self.give_up(position, "a closure whose code is not in the script"),
        }
    }

    /// Walks a call of a closure.
    pub(super) fn closure_call(
        &mut self,
        closure: &Closure,
        arguments: &[Abstract],
        position: Position,
    ) -> Flow<Abstract> {
        let (name, count) = &closure.function;
        let Some(function) = self.script_function(name, *count) else {
            return self.give_up(position, "a closure whose code is not in the script");
        };
        let takes = count - closure.captured.len();
        if arguments.len() != takes {
            let (given, plural) = (arguments.len(), if takes == 1 { "" } else { "s" });
            self.find_fault(position, format!("this closure takes {takes} argument{plural}, not {given}"), None);
            return Err(super::walk::Stop::Left);
        }
        if !self.may_call() {
            return self.give_up(position, "calls nested this deep");
        }
        let mut variables = Variables::new();
        for (name, cell) in &closure.captured {
            self.take_along(name, *cell, position, &mut variables)?;
        }
        let cells: Vec<Cell> = closure.captured.iter().map(|(_, cell)| *cell).collect();
        self.take_along_behind(&cells, position, &mut variables)?;
        let kept = variables.len();
        let parameters = function.parameters.iter().skip(closure.captured.len()).zip(arguments);
        variables.extend(parameters.map(|(name, value)| Variable::new(name.as_str(), value.clone())));
        let file = self.call().file;
        let call = Call { variables, kept, file, ..Call::default() };
        let (value, kept) = self.enter(call, &function.body)?;
        for changed in kept {
            let mut own = self.call().variables.iter_mut().rev();
            if let Some(variable) = own.find(|variable| variable.cell == changed.cell) {
                variable.value = changed.value;
            }
        }
        Ok(value)
    }

    fn take_along(&mut self, name: &Rc<str>, cell: Cell, position: Position, to: &mut Variables) -> Flow<()> {
        let found = self.call().variables.iter().rev().find(|variable| variable.cell == Some(cell)).cloned();
        match found {
            Some(variable) => {
                to.push(Variable { name: Rc::clone(name), ..variable });
                Ok(())
            }
            None => self.give_up(position, "a closure whose variables are out of reach"),
        }
    }

    /// What captured closures capture, and those in turn: without a name, for the calls in the closure's code.
    fn take_along_behind(&mut self, cells: &[Cell], position: Position, to: &mut Variables) -> Flow<()> {
        let nameless: Rc<str> = "".into();
        let mut next = 0;
        let mut known = cells.to_vec();
        while let Some(variable) = to.get(next) {
            if let Shape::Closure(inner) = &variable.value.shape {
                for (_, cell) in Rc::clone(inner).captured.iter() {
                    if !known.contains(cell) {
                        known.push(*cell);
                        self.take_along(&nameless, *cell, position, to)?;
                    }
                }
            }
            next += 1;
        }
        Ok(())
    }
}
