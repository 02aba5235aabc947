//! Lowering of `hit.attribute(name, default)`: a table by the hit's set of attributes.

use super::super::ir::{Code, Column};
use super::Lowerer;
use super::meaning::Meaning;
use crate::math::{Vec2, Vec3, Vec4};
use crate::shade::native::{NativeFunction, NativeResult};
use crate::shade::params::Value;

impl Lowerer<'_> {
    /// An attribute; `None` if it cannot be lowered, among other reasons because it is an error at some hits.
    pub(super) fn attribute(&mut self, name: &str, default: &Meaning) -> Option<Meaning> {
        let wanted = match default {
            Meaning::Bool(_) => Value::Bool(false),
            Meaning::Int(_) => Value::Int(0),
            Meaning::Float(_) => Value::Float(0.0),
            Meaning::Vector(channels) => match channels.len() {
                2 => Value::Vec2(Vec2::ZERO),
                3 => Value::Vec3(Vec3::ZERO),
                _ => Value::Vec4(Vec4::ZERO),
            },
            Meaning::Text(_) => Value::Text(String::new()),
            _ => return None,
        };
        let mut table: Vec<Option<Value>> = vec![None; self.surroundings.attributes.len()];
        for &set in self.surroundings.attribute_sets {
            if let Some(given) = self.surroundings.attributes.get(set as usize)?.get(name) {
                table[set as usize] = Some(given.for_default(&wanted)?);
            }
        }
        if table.iter().all(Option::is_none) {
            return Some(default.clone());
        }
        let set = Meaning::Int(self.builder.emit(Code::Input(Column::AttributeSet, 0), &[]));
        let given: Vec<bool> = table.iter().map(Option::is_some).collect();
        macro_rules! values {
            ($($kind:ident),*) => {
                match wanted {
                    $(Value::$kind(zero) => look_up(
                        table.iter().map(|value| if let Some(Value::$kind(x)) = value { *x } else { zero }).collect(),
                        zero,
                    ),)*
                    _ => return None,
                }
            };
        }
        let value = values!(Bool, Int, Float, Vec2, Vec3, Vec4);
        let value = self.call_native(&value, std::slice::from_ref(&set))?;
        match self.call_native(&look_up(given, false), &[set])? {
            Meaning::Bool(given) => Some(self.builder.join(given, &value, default)),
            _ => None,
        }
    }
}

/// A function that gives the entry of a table.
fn look_up<T: NativeResult + Copy + Send + Sync + 'static>(table: Vec<T>, outside: T) -> NativeFunction {
    let at = move |set: i64| usize::try_from(set).ok().and_then(|set| table.get(set).copied()).unwrap_or(outside);
    NativeFunction::new("attribute", at)
}
