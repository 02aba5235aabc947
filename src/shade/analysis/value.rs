//! What is known of a value while a script is walked.
//!
//! An [`Abstract`] stands for the values that one evaluation of an expression can give. Its `inputs` are those that the
//! value depends on, through data or through the branches that were taken. Its [`Identity`] tells copies of one value
//! from values that merely look alike: where two branches meet, a variable with the same identity on both sides was not
//! changed, so it does not depend on which branch was taken.

use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

use smallvec::SmallVec;

use super::interval::Interval;
use crate::scene::texture::TextureRef;
use crate::shade::names::InputSet;
use crate::shade::params::Value;

/// A position in a program: its file, line and column; the last two from 1 (0 where the script engine does not know).
pub(crate) type Place = (usize, usize, usize);

/// Nowhere in a program.
pub(crate) const NOWHERE: Place = (0, 0, 0);

/// A variable that a closure captures is shared: this names it, whatever code sees it.
pub(crate) type Cell = Identity;

/// Names one evaluation of one expression.
pub(crate) type Identity = u64;

/// Integers up to here convert to `f32` and back without loss.
pub(crate) const EXACT_INT: i64 = 1 << 24;

/// What is known of a value.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Abstract {
    pub identity: Identity,
    pub shape: Shape,
    /// What the value depends on. Empty for records and arrays, whose parts know what they depend on; see
    /// [`Abstract::all_inputs`].
    pub inputs: InputSet,
}

/// Type of a value, and its bounds.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Shape {
    Unit,
    Bool(Option<bool>),
    /// From the first to the second, inclusive.
    Int(i64, i64),
    Float(Interval),
    /// An integer or a float, whose `f32` value is bounded. The bounds are at most [`EXACT_INT`], so that they hold for
    /// the integer, too.
    Number(Interval),
    Vector(Vector),
    Text(Option<Rc<str>>),
    Texture(Option<TextureRef>),
    Record(Rc<Record>),
    Array(Rc<Vec<Abstract>>),
    /// Integers from `low` up to and without `end`; if not `exact`, some run of these.
    Range {
        low: i64,
        end: i64,
        exact: bool,
    },
    /// The argument of `surface`.
    Hit,
    /// A closure that a variable holds.
    Closure(Rc<Closure>),
    /// What is known is only on which inputs it depends. Never holds a [`Shape::Hit`] whose inputs are not counted.
    Unknown,
}

/// A closure: its function, and the captured variables.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Closure {
    /// Its name for the engine, and how many parameters it has with the captured variables.
    pub function: (String, usize),
    /// Name and cell of each, in the order of the parameters.
    pub captured: Vec<(Rc<str>, Cell)>,
}

/// Two to four channels.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Vector {
    pub channels: SmallVec<[Interval; 4]>,
    /// No possible value that is free of NaN is longer.
    pub length: f32,
}

/// Whose keys a record has. Of what the renderer gives, an unknown name is a fault.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum KeysOf {
    /// The script's own.
    #[default]
    Script,
    /// The material's parameters.
    Parameters,
    /// Of what `line` gets.
    Pair,
}

/// An object map with known keys.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Record {
    pub fields: BTreeMap<Rc<str>, Field>,
    /// Whose keys these are.
    pub keys_of: KeysOf,
}

/// A key that may be in a record.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Field {
    pub value: Abstract,
    /// Whether the key is always there.
    pub always: bool,
    /// What its presence depends on.
    pub presence: InputSet,
    /// Where the key is written.
    pub place: Place,
}

impl Field {
    /// A key that is always there.
    pub fn always(value: Abstract, place: Place) -> Self {
        Self { value, always: true, presence: InputSet::empty(), place }
    }
}

impl Vector {
    /// A vector of these channels.
    pub fn new(channels: impl IntoIterator<Item = Interval>) -> Self {
        let channels: SmallVec<[Interval; 4]> = channels.into_iter().collect();
        let squares: f64 = channels.iter().map(|c| f64::from(c.size()).powi(2)).sum();
        let length = ((squares.sqrt() * 1.000_001) as f32).next_up();
        Self { channels, length }
    }

    /// A vector of unit length, up to rounding.
    pub fn unit(count: usize) -> Self {
        Self { length: 1.000_001, ..Self::new(std::iter::repeat_n(Interval::UNIT_COMPONENT, count)) }
    }

    /// The same, known to be at most this long.
    pub fn at_most(mut self, length: f32) -> Self {
        self.length = self.length.min(length);
        self
    }

    /// The hull of all channels.
    pub fn hull(&self) -> Interval {
        self.channels.iter().copied().reduce(Interval::hull).unwrap_or(Interval::ANY)
    }
}

impl Shape {
    /// A parameter as a shape with identities from `fresh`. A texture beyond the scene's table is none.
    pub fn from_value(value: &Value, textures: usize, fresh: &mut impl FnMut() -> Identity) -> Self {
        match value {
            Value::Unit => Self::Unit,
            Value::Bool(b) => Self::Bool(Some(*b)),
            Value::Int(n) => Self::Int(*n, *n),
            Value::Float(x) => Self::Float(Interval::exact(*x)),
            Value::Vec2(v) => Self::exact_vector(&v.to_array()),
            Value::Vec3(v) => Self::exact_vector(&v.to_array()),
            Value::Vec4(v) => Self::exact_vector(&v.to_array()),
            Value::Text(text) => Self::Text(Some(text.as_str().into())),
            Value::Texture(texture) if texture.texture.index() < textures => Self::Texture(Some(*texture)),
            Value::Texture(_) => Self::Unit,
            Value::Record(fields) => {
                let fields = fields
                    .iter()
                    .map(|(key, value)| {
                        let value = Abstract::constant(Self::from_value(value, textures, fresh), fresh());
                        (key.as_str().into(), Field::always(value, NOWHERE))
                    })
                    .collect();
                Self::Record(Rc::new(Record { fields, keys_of: KeysOf::Script }))
            }
            Value::Array(items) => {
                let items =
                    items.iter().map(|item| Abstract::constant(Self::from_value(item, textures, fresh), fresh()));
                Self::Array(Rc::new(items.collect()))
            }
        }
    }

    fn exact_vector(channels: &[f32]) -> Self {
        Self::Vector(Vector::new(channels.iter().map(|x| Interval::exact(*x))))
    }

    /// The bounds as an `f32`, of anything that is a number.
    pub fn number(&self) -> Option<Interval> {
        match self {
            Self::Int(low, high) if low == high => Some(Interval::exact(*low as f32)),
            Self::Int(low, high) => Some(Interval::new(*low as f32, *high as f32)),
            Self::Float(x) | Self::Number(x) => Some(*x),
            _ => None,
        }
    }

    /// The bounds of all channels together, of numbers and vectors.
    pub fn range(&self) -> Option<Interval> {
        match self {
            Self::Vector(vector) => Some(vector.hull()),
            Self::Int(low, high) => {
                // `as` rounds to nearest, which may be inwards.
                let is_rounded = |n: i64| n.unsigned_abs() > EXACT_INT as u64;
                let outwards = |n: i64, step: fn(f32) -> f32| if is_rounded(n) { step(n as f32) } else { n as f32 };
                Some(Interval::new(outwards(*low, f32::next_down), outwards(*high, f32::next_up)))
            }
            _ => self.number(),
        }
    }

    /// Whether it is exactly known: the same value at all hits.
    pub fn is_exact(&self) -> bool {
        match self {
            Self::Unit | Self::Bool(Some(_)) | Self::Text(Some(_)) | Self::Texture(Some(_)) => true,
            Self::Range { exact, .. } => *exact,
            Self::Int(low, high) => low == high,
            Self::Float(x) => x.value().is_some(),
            Self::Vector(vector) => vector.channels.iter().all(|c| c.value().is_some()),
            _ => false,
        }
    }

    /// The value, if exactly known and of a type that outputs can have.
    pub fn to_value(&self) -> Option<Value> {
        match self {
            Self::Bool(b) => b.map(Value::Bool),
            Self::Int(low, high) if low == high => Some(Value::Int(*low)),
            Self::Float(x) => x.value().map(Value::Float),
            Self::Text(text) => text.as_ref().map(|text| Value::Text(text.to_string())),
            Self::Vector(vector) => {
                let channels: Option<Vec<f32>> = vector.channels.iter().map(|c| c.value()).collect();
                match *channels?.as_slice() {
                    [x, y] => Some(Value::Vec2(crate::math::Vec2::new(x, y))),
                    [x, y, z] => Some(Value::Vec3(crate::math::Vec3::new(x, y, z))),
                    [x, y, z, w] => Some(Value::Vec4(crate::math::Vec4::new(x, y, z, w))),
                    _ => None,
                }
            }
            _ => None,
        }
    }

    /// Whether its parts, not it, depend on inputs.
    pub fn is_container(&self) -> bool {
        matches!(self, Self::Record(_) | Self::Array(_))
    }

    /// Whether the type is fully known, so that two values of different such types are never equal.
    pub fn is_typed(&self) -> bool {
        !matches!(self, Self::Unknown | Self::Number(_))
    }

    /// Whether the script engine counts it as a number.
    pub fn is_number(&self) -> bool {
        matches!(self, Self::Int(..) | Self::Float(_) | Self::Number(_))
    }
}

impl Abstract {
    /// A value that depends on no input.
    pub fn constant(shape: Shape, identity: Identity) -> Self {
        Self { identity, shape, inputs: InputSet::empty() }
    }

    /// All that the value or a part of it depends on, presence of its keys included.
    pub fn all_inputs(&self) -> InputSet {
        let parts = match &self.shape {
            Shape::Record(record) => {
                record.fields.values().map(|field| field.value.all_inputs() | field.presence).collect()
            }
            Shape::Array(items) => items.iter().map(Self::all_inputs).collect(),
            Shape::Hit | Shape::Closure(_) => InputSet::all(),
            _ => InputSet::empty(),
        };
        self.inputs | parts
    }

    /// Whether `hit` itself is part of it.
    pub fn holds_hit(&self) -> bool {
        match &self.shape {
            // What it captures may hold it.
            Shape::Hit | Shape::Closure(_) => true,
            Shape::Record(record) => record.fields.values().any(|field| field.value.holds_hit()),
            Shape::Array(items) => items.iter().any(Self::holds_hit),
            _ => false,
        }
    }

    /// How many values it is made of, counted up to `limit`.
    pub fn count_parts(&self, limit: usize) -> usize {
        let count = |parts: &mut dyn Iterator<Item = &Self>| {
            let mut total = 1;
            while let Some(part) = parts.next().filter(|_| total < limit) {
                total += part.count_parts(limit - total);
            }
            total
        };
        match &self.shape {
            Shape::Record(record) => count(&mut record.fields.values().map(|field| &field.value)),
            Shape::Array(items) => count(&mut items.iter()),
            _ => 1,
        }
    }

    /// How deep records and arrays are nested in it.
    pub fn depth(&self) -> usize {
        match &self.shape {
            Shape::Record(record) => 1 + record.fields.values().map(|f| f.value.depth()).max().unwrap_or(0),
            Shape::Array(items) => 1 + items.iter().map(Self::depth).max().unwrap_or(0),
            _ => 0,
        }
    }
}

/// How two values that meet after a branch become one.
pub(crate) struct Join<'a> {
    /// What the choice of the branch depends on.
    pub control: InputSet,
    /// Gives new identities.
    pub next_identity: &'a mut Identity,
    /// At the head of a loop: identities of values that stand for "whatever it is when a round begins". Such a value
    /// keeps its identity from round to round, so that the walk of the loop settles.
    pub loop_values: Option<&'a mut BTreeSet<Identity>>,
    /// Whether numbers that still change from round to round lose their bounds.
    pub widen: bool,
}

impl Join<'_> {
    /// What is known if it is one of the two.
    pub fn join(&mut self, a: &Abstract, b: &Abstract) -> Abstract {
        if a.identity == b.identity {
            return a.clone();
        }
        let shape = self.shapes(&a.shape, &b.shape);
        let inputs = match shape {
            _ if shape.is_exact() || shape.is_container() => InputSet::empty(),
            Shape::Unknown => a.all_inputs() | b.all_inputs() | self.control,
            _ => a.inputs | b.inputs | self.control,
        };
        Abstract { identity: self.identity_of(a), shape, inputs }
    }

    fn identity_of(&mut self, head: &Abstract) -> Identity {
        if let Some(loop_values) = &self.loop_values
            && loop_values.contains(&head.identity)
        {
            return head.identity;
        }
        *self.next_identity += 1;
        if let Some(loop_values) = &mut self.loop_values {
            loop_values.insert(*self.next_identity);
        }
        *self.next_identity
    }

    fn interval(&self, a: Interval, b: Interval) -> Interval {
        let hull = a.hull(b);
        if !self.widen {
            return hull;
        }
        Interval {
            low: if hull.low < a.low { f32::NEG_INFINITY } else { hull.low },
            high: if hull.high > a.high { f32::INFINITY } else { hull.high },
            nan: hull.nan,
        }
    }

    fn shapes(&mut self, a: &Shape, b: &Shape) -> Shape {
        match (a, b) {
            (Shape::Unit, Shape::Unit) => Shape::Unit,
            (Shape::Hit, Shape::Hit) => Shape::Hit,
            (Shape::Closure(x), Shape::Closure(y)) if x == y => Shape::Closure(Rc::clone(x)),
            (Shape::Bool(x), Shape::Bool(y)) => Shape::Bool(x.filter(|_| x == y)),
            (Shape::Text(x), Shape::Text(y)) => Shape::Text(x.clone().filter(|_| x == y)),
            (Shape::Texture(x), Shape::Texture(y)) => Shape::Texture(x.filter(|_| x == y)),
            (Shape::Range { low: low_a, end: end_a, .. }, Shape::Range { low: low_b, end: end_b, .. }) => {
                Shape::Range { low: *low_a.min(low_b), end: *end_a.max(end_b), exact: a == b && a.is_exact() }
            }
            (Shape::Int(low_a, high_a), Shape::Int(low_b, high_b)) => {
                let (low, high) = ((*low_a).min(*low_b), (*high_a).max(*high_b));
                Shape::Int(
                    if self.widen && low < *low_a { i64::MIN } else { low },
                    if self.widen && high > *high_a { i64::MAX } else { high },
                )
            }
            (Shape::Float(x), Shape::Float(y)) => Shape::Float(self.interval(*x, *y)),
            (
                Shape::Int(..) | Shape::Float(_) | Shape::Number(_),
                Shape::Int(..) | Shape::Float(_) | Shape::Number(_),
            ) => match (a.range(), b.range()) {
                (Some(x), Some(y)) => mixed_number(self.interval(x, y)),
                _ => Shape::Unknown,
            },
            (Shape::Vector(x), Shape::Vector(y)) if x.channels.len() == y.channels.len() => {
                let channels = x.channels.iter().zip(&y.channels).map(|(x, y)| self.interval(*x, *y));
                Shape::Vector(
                    Vector::new(channels.collect::<SmallVec<[Interval; 4]>>()).at_most(
                        if self.widen && y.length > x.length { f32::INFINITY } else { x.length.max(y.length) },
                    ),
                )
            }
            (Shape::Record(x), Shape::Record(y)) => Shape::Record(Rc::new(self.records(x, y))),
            (Shape::Array(x), Shape::Array(y)) if x.len() == y.len() => {
                Shape::Array(Rc::new(x.iter().zip(y.iter()).map(|(x, y)| self.join(x, y)).collect()))
            }
            _ => Shape::Unknown,
        }
    }

    fn records(&mut self, a: &Record, b: &Record) -> Record {
        let keys: BTreeSet<&Rc<str>> = a.fields.keys().chain(b.fields.keys()).collect();
        let mut fields = BTreeMap::new();
        for key in keys {
            let field = match (a.fields.get(key), b.fields.get(key)) {
                (Some(x), Some(y)) => {
                    let always = x.always && y.always;
                    let choice = if always { InputSet::empty() } else { self.control };
                    Field {
                        value: self.join(&x.value, &y.value),
                        always,
                        presence: x.presence | y.presence | choice,
                        place: x.place,
                    }
                }
                (Some(one), None) | (None, Some(one)) => {
                    Field { always: false, presence: one.presence | self.control, ..one.clone() }
                }
                (None, None) => continue,
            };
            fields.insert(Rc::clone(key), field);
        }
        Record { fields, keys_of: if a.keys_of == b.keys_of { a.keys_of } else { KeysOf::Script } }
    }
}

/// An integer or a float within these bounds.
pub(crate) fn mixed_number(bounds: Interval) -> Shape {
    if bounds.size() <= EXACT_INT as f32 && !bounds.nan { Shape::Number(bounds) } else { Shape::Unknown }
}
