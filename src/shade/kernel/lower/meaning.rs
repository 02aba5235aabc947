//! What a variable or expression is while a script is lowered: a type that is known, made of operands.
//!
//! Vectors, records and arrays are taken apart into columns here, so that swizzles, keys and elements cost nothing.
//! Where two paths meet, each column becomes a select. Values of different types that meet stay side by side in a
//! [`Meaning::Choice`], and whatever is done to such a value is done to both.

use std::collections::BTreeMap;
use std::rc::Rc;

use smallvec::SmallVec;

use super::super::build::Builder;
use super::super::ir::{Kind, Operand};

/// Types that one variable may have before its script is no kernel.
const MOST_CHOICES: usize = 16;

/// The channels of a vector.
pub(in crate::shade::kernel) type Channels = SmallVec<[Operand; 4]>;

/// What a value is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::shade::kernel) enum Meaning {
    /// Not set on any path so far.
    Undefined,
    Unit,
    Bool(Operand),
    Int(Operand),
    Float(Operand),
    Vector(Channels),
    Text(Rc<str>),
    /// A text that differs from hit to hit, as `hit.path_kind`: an int, its place among these.
    Word(Operand, &'static [&'static str]),
    /// A use of a texture, by number in the scene's list of uses.
    Texture(usize),
    Record(Rc<Record>),
    Array(Rc<Vec<Meaning>>),
    Range(Range),
    Hit,
    Parameters(Rc<Record>),
    /// By index.
    Light(Operand),
    Closure(Rc<Closure>),
    /// The first where the mask is true, else the second.
    Choice(Operand, Rc<[Meaning; 2]>),
}

/// Keys of an object map.
pub(in crate::shade::kernel) type Record = BTreeMap<Rc<str>, Field>;

/// A key of an object map.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::shade::kernel) struct Field {
    pub value: Meaning,
    /// Where the key is there at all.
    pub present: Operand,
}

/// `low .. end` or `low ..= end`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::shade::kernel) struct Range {
    pub low: Operand,
    pub end: Operand,
    pub inclusive: bool,
}

/// A function without a name, bound to variables around it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::shade::kernel) struct Closure {
    pub function: Rc<str>,
    pub captured: Vec<Captured>,
}

/// What a closure holds of its surroundings.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::shade::kernel) enum Captured {
    /// A variable, shared with the surroundings.
    Variable {
        cell: usize,
        identity: u64,
    },
    Value(Meaning),
}

impl Meaning {
    pub fn float(x: f32) -> Self {
        Self::Float(Operand::float(x))
    }

    pub fn int(x: i64) -> Self {
        Self::Int(Operand::Int(x))
    }

    pub fn bool(x: bool) -> Self {
        Self::Bool(Operand::Bool(x))
    }

    pub fn vector(channels: &[Operand]) -> Self {
        Self::Vector(Channels::from_slice(channels))
    }

    /// What messages call the type.
    pub fn name(&self) -> String {
        match self {
            Self::Undefined => "nothing".into(),
            Self::Unit => "()".into(),
            Self::Bool(_) => "bool".into(),
            Self::Int(_) => "int".into(),
            Self::Float(_) => "float".into(),
            Self::Vector(channels) => format!("vec{}", channels.len()),
            Self::Text(_) | Self::Word(..) => "text".into(),
            Self::Texture(_) => "texture".into(),
            Self::Record(_) => "record".into(),
            Self::Array(_) => "array".into(),
            Self::Range(_) => "range".into(),
            Self::Hit => "hit".into(),
            Self::Parameters(_) => "parameters".into(),
            Self::Light(_) => "light".into(),
            Self::Closure(_) => "function".into(),
            Self::Choice(_, sides) => format!("{} or {}", sides[0].name(), sides[1].name()),
        }
    }

    /// How many values it is made of, counted up to `limit`.
    pub fn count_parts(&self, limit: usize) -> usize {
        let mut total = 1;
        let mut add = |part: &Self| {
            if total < limit {
                total += part.count_parts(limit - total);
            }
        };
        match self {
            Self::Record(record) | Self::Parameters(record) => record.values().for_each(|field| add(&field.value)),
            Self::Array(items) => items.iter().for_each(add),
            Self::Choice(_, sides) => sides.iter().for_each(add),
            _ => {}
        }
        total
    }

    /// A record that has the keys of another, too, but where it had none, nowhere present: what a loop must start from
    /// that sets them. `None` if it has them all, or is no record.
    pub fn with_keys_of(&self, other: &Self, nothing: &mut impl FnMut(Operand) -> Operand) -> Option<Self> {
        let (Self::Record(own), Self::Record(others)) = (self, other) else { return None };
        let mut wider = Record::clone(own);
        let mut news = false;
        for (key, field) in others.iter() {
            if let Some(known) = wider.get_mut(key) {
                if let Some(value) = known.value.with_keys_of(&field.value, nothing) {
                    known.value = value;
                    news = true;
                }
            } else {
                let field = Field { value: field.value.map(nothing), present: Operand::FALSE };
                wider.insert(Rc::clone(key), field);
                news = true;
            }
        }
        news.then(|| Self::Record(Rc::new(wider)))
    }

    /// Whether [`Builder::join`] makes one value of the two that is no choice at its top.
    fn joins_into_one_with(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Range(a), Self::Range(b)) => a.inclusive == b.inclusive,
            (Self::Record(_), Self::Record(_)) => true,
            (Self::Array(a), Self::Array(b)) => a.len() == b.len(),
            _ => self.same_form(other),
        }
    }

    /// Whether two have the same structure, so that one can follow the other in a loop.
    pub fn same_form(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Vector(a), Self::Vector(b)) => a.len() == b.len(),
            (Self::Word(_, a), Self::Word(_, b)) => a == b,
            (Self::Bool(_), Self::Bool(_))
            | (Self::Int(_), Self::Int(_))
            | (Self::Float(_), Self::Float(_))
            | (Self::Light(_), Self::Light(_)) => true,
            (Self::Range(a), Self::Range(b)) => a.inclusive == b.inclusive,
            (Self::Record(a), Self::Record(b)) => {
                a.len() == b.len()
                    && a.iter().zip(b.iter()).all(|((x, a), (y, b))| x == y && a.value.same_form(&b.value))
            }
            (Self::Array(a), Self::Array(b)) => {
                a.len() == b.len() && a.iter().zip(b.iter()).all(|(a, b)| a.same_form(b))
            }
            (Self::Choice(_, a), Self::Choice(_, b)) => a[0].same_form(&b[0]) && a[1].same_form(&b[1]),
            _ => self == other,
        }
    }

    /// The same structure with every operand replaced; operands come in a fixed order.
    pub fn map(&self, f: &mut impl FnMut(Operand) -> Operand) -> Self {
        match self {
            Self::Bool(x) => Self::Bool(f(*x)),
            Self::Int(x) => Self::Int(f(*x)),
            Self::Float(x) => Self::Float(f(*x)),
            Self::Word(x, words) => Self::Word(f(*x), words),
            Self::Light(x) => Self::Light(f(*x)),
            Self::Vector(channels) => Self::Vector(channels.iter().map(|x| f(*x)).collect()),
            Self::Range(range) => Self::Range(Range { low: f(range.low), end: f(range.end), ..*range }),
            Self::Record(record) => {
                let fields = record.iter().map(|(key, field)| {
                    (Rc::clone(key), Field { value: field.value.map(f), present: f(field.present) })
                });
                Self::Record(Rc::new(fields.collect()))
            }
            Self::Array(items) => Self::Array(Rc::new(items.iter().map(|item| item.map(f)).collect())),
            Self::Choice(mask, sides) => {
                let mask = f(*mask);
                Self::Choice(mask, Rc::new([sides[0].map(f), sides[1].map(f)]))
            }
            other => other.clone(),
        }
    }

    /// All operands, in the order of [`map`](Self::map).
    pub fn operands(&self) -> Vec<Operand> {
        let mut operands = Vec::new();
        self.map(&mut |operand| {
            operands.push(operand);
            operand
        });
        operands
    }
}

impl Builder {
    /// `a` where the mask is true, else `b`.
    pub fn join(&mut self, mask: Operand, a: &Meaning, b: &Meaning) -> Meaning {
        use Meaning::{Array, Bool, Choice, Float, Int, Light, Range as Span, Record, Undefined, Vector, Word};
        if a == b || mask == Operand::TRUE {
            return a.clone();
        }
        if mask == Operand::FALSE {
            return b.clone();
        }
        match (a, b) {
            (Undefined, known) | (known, Undefined) => known.clone(),
            (Bool(a), Bool(b)) => Bool(self.select(mask, *a, *b)),
            (Int(a), Int(b)) => Int(self.select(mask, *a, *b)),
            (Float(a), Float(b)) => Float(self.select(mask, *a, *b)),
            (Word(a, words), Word(b, others)) if words == others => Word(self.select(mask, *a, *b), words),
            (Light(a), Light(b)) => Light(self.select(mask, *a, *b)),
            (Vector(a), Vector(b)) if a.len() == b.len() => {
                Vector(a.iter().zip(b).map(|(a, b)| self.select(mask, *a, *b)).collect())
            }
            (Span(a), Span(b)) if a.inclusive == b.inclusive => Span(Range {
                low: self.select(mask, a.low, b.low),
                end: self.select(mask, a.end, b.end),
                inclusive: a.inclusive,
            }),
            (Array(a), Array(b)) if a.len() == b.len() => {
                Array(Rc::new(a.iter().zip(b.iter()).map(|(a, b)| self.join(mask, a, b)).collect()))
            }
            (Record(a), Record(b)) => Record(Rc::new(self.join_records(mask, a, b))),
            (Choice(..), _) | (_, Choice(..)) => self.join_choices(mask, a, b),
            _ => Choice(mask, Rc::new([a.clone(), b.clone()])),
        }
    }

    /// Joins values of which one may be of several types. What is of one type on both sides becomes one value: else a
    /// variable that changes its type in turn would grow with each join, by a factor.
    fn join_choices(&mut self, mask: Operand, a: &Meaning, b: &Meaning) -> Meaning {
        let mut all: Vec<(Operand, Meaning)> = Vec::new();
        let mut add = |builder: &mut Self, at: Operand, value: &Meaning| {
            let alike = |known: &&mut (Operand, Meaning)| known.1.joins_into_one_with(value);
            match all.iter_mut().find(alike) {
                Some((known_at, known)) => {
                    *known = builder.join(at, value, known);
                    *known_at = builder.or(*known_at, at);
                }
                None => all.push((at, value.clone())),
            }
        };
        let not_mask = self.not(mask);
        self.each_choice(mask, a, &mut add);
        self.each_choice(not_mask, b, &mut add);
        self.too_many_types |= all.len() > MOST_CHOICES;
        // In one order, so that a loop finds the same form before and after a round.
        all.sort_by_cached_key(|(_, value)| value.name());
        let Some((_, mut joined)) = all.pop() else { return Meaning::Undefined };
        while let Some((at, value)) = all.pop() {
            joined = Meaning::Choice(at, Rc::new([value, joined]));
        }
        joined
    }

    /// Shows all that a value may be, with where it is that.
    fn each_choice(&mut self, at: Operand, value: &Meaning, see: &mut impl FnMut(&mut Self, Operand, &Meaning)) {
        match value {
            Meaning::Choice(mask, sides) => {
                let (first, second) = (self.and(at, *mask), self.and_not(at, *mask));
                self.each_choice(first, &sides[0], see);
                self.each_choice(second, &sides[1], see);
            }
            // Nobody reads it there.
            Meaning::Undefined => {}
            _ if at == Operand::FALSE => {}
            _ => see(self, at, value),
        }
    }

    fn join_records(&mut self, mask: Operand, a: &Record, b: &Record) -> Record {
        let mut joined = Record::new();
        for (key, field) in a {
            let field = match b.get(key) {
                Some(other) => Field {
                    value: self.join_present(mask, field, other),
                    present: self.select(mask, field.present, other.present),
                },
                None => Field { value: field.value.clone(), present: self.and(mask, field.present) },
            };
            joined.insert(Rc::clone(key), field);
        }
        for (key, field) in b.iter().filter(|(key, _)| !a.contains_key(*key)) {
            let present = self.and_not(field.present, mask);
            joined.insert(Rc::clone(key), Field { value: field.value.clone(), present });
        }
        joined
    }

    fn join_present(&mut self, mask: Operand, a: &Field, b: &Field) -> Meaning {
        self.join(mask, &a.value, &b.value)
    }

    /// A constant of a kind, for what is never read.
    pub fn nothing(&self, kind: Kind) -> Operand {
        match kind {
            Kind::Float => Operand::float(0.0),
            Kind::Int => Operand::Int(0),
            Kind::Bool => Operand::FALSE,
        }
    }
}
