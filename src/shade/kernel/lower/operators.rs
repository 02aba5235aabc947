//! Operators, and values that are one of two.

use rhai::Position;

use super::super::ir::{BoolBinary, Code, Comparison, FloatBinary, FloatUnary, IntBinary, IntChecked, Operand};
use super::meaning::{Channels, Meaning, Range};
use super::{Flow, Lowerer};

/// Values that are one of several, taken apart in one operation.
const MAX_SPREAD: usize = 16;

impl<'a> Lowerer<'a> {
    /// Does something with values, for each side of those that are one of two, and joins what comes out.
    pub(super) fn spread(
        &mut self,
        values: Vec<Meaning>,
        apply: &mut dyn FnMut(&mut Lowerer<'a>, &[Meaning]) -> Flow<Meaning>,
    ) -> Flow<Meaning> {
        self.spread_up_to(values, MAX_SPREAD, apply)
    }

    fn spread_up_to(
        &mut self,
        values: Vec<Meaning>,
        limit: usize,
        apply: &mut dyn FnMut(&mut Lowerer<'a>, &[Meaning]) -> Flow<Meaning>,
    ) -> Flow<Meaning> {
        let choice = values.iter().enumerate().find_map(|(index, value)| match value {
            Meaning::Choice(mask, sides) => Some((index, *mask, std::rc::Rc::clone(sides))),
            _ => None,
        });
        let Some((index, mask, sides)) = choice else {
            return if self.is_dead() { Ok(Meaning::Undefined) } else { apply(self, &values) };
        };
        if limit == 0 {
            return self.give_up(Position::NONE, "a value that may be of so many types");
        }
        let Some(live) = self.live else { return Ok(Meaning::Undefined) };
        let mut results = Vec::with_capacity(2);
        for (side, meaning) in sides.iter().enumerate() {
            let here = if side == 0 { self.builder.and(live, mask) } else { self.builder.and_not(live, mask) };
            self.live = (here != Operand::FALSE).then_some(here);
            let mut values = values.clone();
            values[index] = meaning.clone();
            results.push((self.spread_up_to(values, limit / 2, apply)?, self.live.is_some()));
        }
        // Hits that failed on one side go on, with values that nobody reads.
        self.live = (results[0].1 || results[1].1).then_some(live);
        Ok(match (results[0].1, results[1].1) {
            (true, false) => results.swap_remove(0).0,
            (false, true) => results.swap_remove(1).0,
            _ => self.builder.join(mask, &results[0].0, &results[1].0),
        })
    }

    /// A number as a float.
    pub(super) fn number(&mut self, value: &Meaning) -> Option<Operand> {
        match value {
            Meaning::Float(x) => Some(*x),
            Meaning::Int(x) => Some(self.builder.emit(Code::FloatFromInt, &[*x])),
            _ => None,
        }
    }

    /// A binary operator; `None` if the lowering does not know it for these types.
    pub(super) fn binary(&mut self, operator: &str, a: &Meaning, b: &Meaning) -> Option<Meaning> {
        if let Some(comparison) = comparison(operator) {
            return self.compare(comparison, a, b).map(Meaning::Bool);
        }
        match (a, b) {
            (Meaning::Int(a), Meaning::Int(b)) => self.integers(operator, *a, *b),
            (Meaning::Bool(a), Meaning::Bool(b)) => {
                let code = match operator {
                    "&" => BoolBinary::And,
                    "|" => BoolBinary::Or,
                    "^" => BoolBinary::Xor,
                    _ => return None,
                };
                Some(Meaning::Bool(self.builder.emit(Code::Bool2(code), &[*a, *b])))
            }
            (Meaning::Text(a), Meaning::Text(b)) if operator == "+" => {
                let fits = a.len() + b.len() <= crate::shade::host::MAX_TEXT;
                fits.then(|| Meaning::Text(format!("{a}{b}").into()))
            }
            (Meaning::Vector(x), Meaning::Vector(y)) if x.len() == y.len() => {
                let code = arithmetic(operator, true)?;
                let channels = x.iter().zip(y).map(|(x, y)| self.builder.emit(code, &[*x, *y]));
                Some(Meaning::Vector(channels.collect()))
            }
            (Meaning::Vector(x), number) => {
                let (code, y) = (arithmetic(operator, true)?, self.number(number)?);
                Some(Meaning::Vector(x.iter().map(|x| self.builder.emit(code, &[*x, y])).collect()))
            }
            (number, Meaning::Vector(y)) => {
                let (code, x) = (arithmetic(operator, true)?, self.number(number)?);
                Some(Meaning::Vector(y.iter().map(|y| self.builder.emit(code, &[x, *y])).collect()))
            }
            _ => {
                let code = arithmetic(operator, false)?;
                let (x, y) = (self.number(a)?, self.number(b)?);
                Some(Meaning::Float(self.builder.emit(code, &[x, y])))
            }
        }
    }

    fn integers(&mut self, operator: &str, a: Operand, b: Operand) -> Option<Meaning> {
        let checked = match operator {
            "+" => Some(IntChecked::Add),
            "-" => Some(IntChecked::Subtract),
            "*" => Some(IntChecked::Multiply),
            "/" => Some(IntChecked::Divide),
            "%" => Some(IntChecked::Remainder),
            "**" => Some(IntChecked::Power),
            _ => None,
        };
        if let Some(checked) = checked {
            return Some(Meaning::Int(self.checked(checked, a, b)));
        }
        let code = match operator {
            "&" => IntBinary::And,
            "|" => IntBinary::Or,
            "^" => IntBinary::Xor,
            "<<" => IntBinary::ShiftLeft,
            ">>" => IntBinary::ShiftRight,
            ".." | "..=" => {
                return Some(Meaning::Range(Range { low: a, end: b, inclusive: operator == "..=" }));
            }
            _ => return None,
        };
        Some(Meaning::Int(self.builder.emit(Code::Int2(code), &[a, b])))
    }

    /// An operation on ints that fails where the result does not fit.
    pub(super) fn checked(&mut self, code: IntChecked, a: Operand, b: Operand) -> Operand {
        let mask = self.mask();
        self.builder.emit(Code::Checked(code), &[a, b, mask])
    }

    /// A unary operator; `None` if the lowering does not know it for this type.
    pub(super) fn unary(&mut self, operator: &str, x: &Meaning) -> Option<Meaning> {
        Some(match (operator, x) {
            ("+", Meaning::Int(_) | Meaning::Float(_) | Meaning::Vector(_)) => x.clone(),
            ("-", Meaning::Int(x)) => Meaning::Int(self.checked(IntChecked::Negate, *x, Operand::Int(0))),
            ("-", Meaning::Float(x)) => Meaning::Float(self.float1(FloatUnary::Negate, *x)),
            ("-", Meaning::Vector(channels)) => {
                Meaning::Vector(channels.iter().map(|x| self.float1(FloatUnary::Negate, *x)).collect())
            }
            ("!", Meaning::Bool(x)) => Meaning::Bool(self.builder.not(*x)),
            _ => return None,
        })
    }

    pub(super) fn float1(&mut self, code: FloatUnary, x: Operand) -> Operand {
        self.builder.emit(Code::Float1(code), &[x])
    }

    pub(super) fn float2(&mut self, code: FloatBinary, a: Operand, b: Operand) -> Operand {
        self.builder.emit(Code::Float2(code), &[a, b])
    }

    /// Values of different types are unequal, and in no order.
    fn compare(&mut self, comparison: Comparison, a: &Meaning, b: &Meaning) -> Option<Operand> {
        use Meaning::{Bool, Float, Int, Light, Text, Texture, Unit, Vector, Word};
        let decided = |ordering: std::cmp::Ordering| Operand::Bool(comparison.ints(ordering as i64, 0));
        Some(match (a, b) {
            (Int(a), Int(b)) => self.builder.emit(Code::CompareInts(comparison), &[*a, *b]),
            (Int(_) | Float(_), Int(_) | Float(_)) => {
                let (a, b) = (self.number(a)?, self.number(b)?);
                self.builder.emit(Code::CompareFloats(comparison), &[a, b])
            }
            (Bool(a), Bool(b)) => self.compare_bools(comparison, *a, *b),
            (Text(a), Text(b)) => decided(a.cmp(b)),
            (Text(_) | Word(..), Text(_) | Word(..)) => {
                let equal = self.texts_equal(a, b, Position::NONE).ok()?;
                match comparison {
                    Comparison::Equal => equal,
                    Comparison::NotEqual => self.builder.not(equal),
                    _ => return None,
                }
            }
            (Unit, Unit) => Operand::Bool(comparison == Comparison::Equal),
            (Texture(a), Texture(b)) => {
                let same = self.textures[*a].place == self.textures[*b].place;
                match comparison {
                    Comparison::Equal => Operand::Bool(same),
                    Comparison::NotEqual => Operand::Bool(!same),
                    _ => return None,
                }
            }
            (Vector(a), Vector(b)) if a.len() == b.len() => {
                let equal = self.vectors_equal(a, b);
                match comparison {
                    Comparison::Equal => equal,
                    Comparison::NotEqual => self.builder.not(equal),
                    _ => return None,
                }
            }
            // A record beside a record and the like is an error, or the engine's own affair.
            (Meaning::Record(_) | Meaning::Array(_) | Meaning::Closure(_) | Meaning::Range(_), _)
            | (_, Meaning::Record(_) | Meaning::Array(_) | Meaning::Closure(_) | Meaning::Range(_))
            | (Light(_), Light(_))
            | (Meaning::Hit, Meaning::Hit)
            | (Meaning::Parameters(_), Meaning::Parameters(_))
            | (Meaning::Undefined, _)
            | (_, Meaning::Undefined) => return None,
            _ => Operand::Bool(comparison == Comparison::NotEqual),
        })
    }

    fn compare_bools(&mut self, comparison: Comparison, a: Operand, b: Operand) -> Operand {
        let builder = &mut self.builder;
        match comparison {
            Comparison::NotEqual => builder.emit(Code::Bool2(BoolBinary::Xor), &[a, b]),
            Comparison::Equal => {
                let differ = builder.emit(Code::Bool2(BoolBinary::Xor), &[a, b]);
                builder.not(differ)
            }
            Comparison::Less => builder.and_not(b, a),
            Comparison::Greater => builder.and_not(a, b),
            Comparison::LessEqual => {
                let above = builder.and_not(a, b);
                builder.not(above)
            }
            Comparison::GreaterEqual => {
                let below = builder.and_not(b, a);
                builder.not(below)
            }
        }
    }

    fn vectors_equal(&mut self, a: &Channels, b: &Channels) -> Operand {
        let mut equal = Operand::TRUE;
        for (a, b) in a.iter().zip(b) {
            let same = self.builder.emit(Code::CompareFloats(Comparison::Equal), &[*a, *b]);
            equal = self.builder.and(equal, same);
        }
        equal
    }

    /// Whether two texts are equal, of which either may differ from hit to hit.
    pub(super) fn texts_equal(&mut self, a: &Meaning, b: &Meaning, position: Position) -> Flow<Operand> {
        match (a, b) {
            (Meaning::Text(a), Meaning::Text(b)) => Ok(Operand::Bool(a == b)),
            (Meaning::Word(a, words), Meaning::Word(b, others)) if words == others => {
                Ok(self.builder.emit(Code::CompareInts(Comparison::Equal), &[*a, *b]))
            }
            (Meaning::Word(word, words), Meaning::Text(text)) | (Meaning::Text(text), Meaning::Word(word, words)) => {
                match words.iter().position(|known| *known == &**text) {
                    Some(place) => {
                        let place = Operand::Int(place as i64);
                        Ok(self.builder.emit(Code::CompareInts(Comparison::Equal), &[*word, place]))
                    }
                    None => Ok(Operand::FALSE),
                }
            }
            _ => self.give_up(position, &format!("{} beside {}", a.name(), b.name())),
        }
    }
}

fn comparison(operator: &str) -> Option<Comparison> {
    Some(match operator {
        "==" => Comparison::Equal,
        "!=" => Comparison::NotEqual,
        "<" => Comparison::Less,
        "<=" => Comparison::LessEqual,
        ">" => Comparison::Greater,
        ">=" => Comparison::GreaterEqual,
        _ => return None,
    })
}

fn arithmetic(operator: &str, vectors: bool) -> Option<Code> {
    Some(Code::Float2(match operator {
        "+" => FloatBinary::Add,
        "-" => FloatBinary::Subtract,
        "*" => FloatBinary::Multiply,
        "/" => FloatBinary::Divide,
        "%" if !vectors => FloatBinary::Remainder,
        "**" if !vectors => FloatBinary::Power,
        _ => return None,
    }))
}
