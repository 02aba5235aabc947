//! What is known of the inputs on `hit` before any script runs.
//!
//! The host keeps these promises: inputs are never NaN nor infinite, their magnitude is at most [`LIMIT`], and unit
//! vectors are of unit length up to rounding.

use std::rc::Rc;

use rhai::Position;

use super::interval::Interval;
use super::value::{Abstract, Field, KeysOf, NOWHERE, Record, Shape, Vector};
use super::walk::{Flow, Stop, Walker};
use crate::math::{Affine2, Vec2, Vec3, Vec4};
use crate::scene::texture::{TextureFilter, TextureRef};
use crate::shade::fault::Fault;
use crate::shade::library::{ATTRIBUTE_TYPES, mistyped_attribute, texture_of, unwritten_path};
use crate::shade::names::{InputSet, OTHER, PAIR_INPUTS, PairForm};
use crate::shade::params::Value;

/// The greatest magnitude of an input. Its square is still a finite `f32`.
pub const LIMIT: f32 = 1e18;

/// Names that scripts read as `hit.NAME`.
pub(super) fn names() -> impl Iterator<Item = &'static str> {
    InputSet::named().filter(|(_, input)| !InputSet::CALLED.contains(*input)).map(|(name, _)| name)
}

/// The input of that name.
pub(super) fn by_name(name: &str) -> Option<InputSet> {
    InputSet::spelled(name).filter(|input| !InputSet::CALLED.contains(*input))
}

/// Type and bounds of an input.
pub(super) fn shape(input: InputSet) -> Shape {
    let any = Interval::within(LIMIT);
    let positive = Interval::new(0.0, LIMIT);
    let id = |least| Shape::Int(least, i64::from(u32::MAX));
    let vector = |channel, count| Shape::Vector(Vector::new(std::iter::repeat_n(channel, count)));
    match input {
        InputSet::POSITION => vector(any, 3),
        InputSet::NORMAL | InputSet::GEOMETRIC_NORMAL | InputSet::INCOMING => Shape::Vector(Vector::unit(3)),
        InputSet::UV => vector(any, 2),
        // The fourth component is the sign of the bitangent.
        InputSet::TANGENT => vector(Interval::UNIT_COMPONENT, 4),
        InputSet::COLOR => vector(any, 4),
        InputSet::OBJECT_ID | InputSet::SHADER_ID | InputSet::MATERIAL_ID => id(1),
        InputSet::POLYGON_ID | InputSet::LIGHT_COUNT => id(0),
        // Weights of a point that rounding has put just outside of the triangle.
        InputSet::BARYCENTRIC => vector(Interval::new(-0.001, 1.001), 3),
        InputSet::DISTANCE | InputSet::DEPTH => Shape::Float(positive),
        input if InputSet::CONE.contains(input) => Shape::Float(positive),
        InputSet::PATH_KIND => Shape::Text(None),
        InputSet::FRONT_FACING => Shape::Bool(None),
        InputSet::IRRADIANCE => vector(positive, 3),
        _ => Shape::Float(any),
    }
}

/// What `line` gets. It is taken to depend on everything.
pub(super) fn pair(walker: &mut Walker) -> Abstract {
    let mut side = |other: bool| {
        let mut record = Record { keys_of: KeysOf::Pair, ..Record::default() };
        for input in PAIR_INPUTS.iter().filter(|input| input.of_side || !other) {
            let channel = |bounds: Option<[f32; 2]>| match bounds {
                Some([low, high]) => Interval::new(low, high),
                None => Interval::within(LIMIT),
            };
            let shape = match input.form {
                PairForm::Bool => Shape::Bool(None),
                PairForm::Int => Shape::Int(0, i64::from(u32::MAX)),
                PairForm::Word(_) => Shape::Text(None),
                PairForm::Floats(1, bounds) => Shape::Float(channel(bounds)),
                PairForm::Floats(count, bounds) => {
                    Shape::Vector(Vector::new(std::iter::repeat_n(channel(bounds), count.into())))
                }
            };
            let value = walker.value(shape, InputSet::all());
            record.fields.insert(input.name.into(), Field::always(value, NOWHERE));
        }
        record
    };
    let (mut pair, other) = (side(false), side(true));
    let other = walker.value(Shape::Record(Rc::new(other)), InputSet::all());
    pair.fields.insert(OTHER.into(), Field::always(other, NOWHERE));
    walker.value(Shape::Record(Rc::new(pair)), InputSet::all())
}

/// Any value of a type that attributes can have.
fn type_of(shape: &Shape) -> Option<Value> {
    Some(match shape {
        Shape::Bool(_) => Value::Bool(false),
        Shape::Int(..) => Value::Int(0),
        Shape::Float(_) => Value::Float(0.0),
        Shape::Text(_) => Value::Text(String::new()),
        Shape::Vector(vector) => match vector.channels.len() {
            2 => Value::Vec2(Vec2::ZERO),
            3 => Value::Vec3(Vec3::ZERO),
            _ => Value::Vec4(Vec4::ZERO),
        },
        _ => return None,
    })
}

impl Walker<'_> {
    /// Reads an input.
    pub(super) fn input(&mut self, input: InputSet) -> Abstract {
        self.inputs |= input;
        self.value(shape(input), input)
    }

    /// `hit.light(index)`.
    pub(super) fn light(&mut self, index: &Abstract) -> Abstract {
        self.inputs |= InputSet::LIGHT;
        let inputs = InputSet::LIGHT | index.all_inputs();
        let radiance = Vector::new(std::iter::repeat_n(Interval::new(0.0, LIMIT), 3));
        let parts = [
            ("direction", Shape::Vector(Vector::unit(3))),
            ("radiance", Shape::Vector(radiance)),
            ("visibility", Shape::Float(Interval::UNIT)),
        ];
        let mut record = Record::default();
        for (name, shape) in parts {
            let value = self.value(shape, inputs);
            record.fields.insert(name.into(), Field::always(value, NOWHERE));
        }
        self.constant(Shape::Record(Rc::new(record)))
    }

    /// `hit.attribute(name, default)`: what the material's hits can have under the name.
    pub(super) fn attribute(&mut self, name: &Abstract, default: &Abstract, position: Position) -> Flow<Abstract> {
        let Shape::Text(Some(name)) = &name.shape else {
            self.find_fault(
                position,
                "the name of an attribute must be known from the script's text".to_owned(),
                Some("write: hit.attribute(\"wear\", 0.0)".to_owned()),
            );
            return self.give_up(position, "an attribute whose name is not known");
        };
        let name = Rc::clone(name);
        self.attributes.insert(name.to_string());
        let mut joined = default.clone();
        let sets = self.attribute_sets;
        for given in sets.iter().map(|set| set.get(&*name)) {
            let value = match (given, type_of(&default.shape)) {
                (_, None) if default.shape.is_typed() => {
                    let message = "an attribute cannot be of this type".to_owned();
                    self.find_fault(position, message, Some(ATTRIBUTE_TYPES.to_owned()));
                    return Err(Stop::Left);
                }
                (None, _) => continue,
                (Some(_), None) => self.value(Shape::Unknown, InputSet::ATTRIBUTE),
                (Some(given), Some(wanted)) => match given.for_default(&wanted) {
                    Some(value) => {
                        let shape = Shape::from_value(&value, 0, &mut || 0);
                        self.value(shape, InputSet::empty())
                    }
                    None => {
                        let Fault { message, hints } = mistyped_attribute(&name, given, &wanted);
                        self.find_fault(position, message, hints.into_iter().next());
                        return Err(Stop::Left);
                    }
                },
            };
            // Which it is, the object tells.
            self.inputs |= InputSet::ATTRIBUTE;
            joined = self.join_values(&joined, &value, InputSet::ATTRIBUTE);
        }
        Ok(joined)
    }

    /// `hit.texture(texture)`.
    pub(super) fn texture_at_hit(&mut self, texture: &Abstract) -> Abstract {
        let read = match &texture.shape {
            Shape::Texture(Some(TextureRef { uv_set: 0, .. })) => InputSet::UV,
            Shape::Texture(Some(_)) => InputSet::MORE_UVS,
            _ => InputSet::UV | InputSet::MORE_UVS,
        };
        let read = match &texture.shape {
            Shape::Texture(Some(place)) => match self.textures.get(place.texture.index()) {
                Some(texture) if texture.filter == TextureFilter::Mipmap => read | InputSet::UV_FOOTPRINT,
                _ => read,
            },
            _ => read | InputSet::UV_FOOTPRINT,
        };
        self.inputs |= read;
        let shape = self.texture_bounds(&texture.shape);
        let inputs = read | self.escape(texture);
        self.value(shape, inputs)
    }

    /// `texture("file.png", uv, …)`.
    pub(super) fn named_texture(&mut self, arguments: &[Abstract], position: Position) -> Flow<Abstract> {
        let id = match &arguments[0].shape {
            Shape::Text(Some(text)) => texture_of(text).filter(|id| id.index() < self.textures.len()),
            _ => None,
        };
        let Some(texture) = id else {
            let Fault { message, hints } = unwritten_path();
            self.find_fault(position, message, hints.into_iter().next());
            return Err(Stop::Left);
        };
        let place = TextureRef { texture, uv_set: 0, transform: Affine2::IDENTITY };
        let shape = self.texture_bounds(&Shape::Texture(Some(place)));
        let inputs = arguments.iter().map(|argument| self.escape(argument)).collect();
        Ok(self.value(shape, inputs))
    }

    /// What a lookup in a texture can give.
    pub(super) fn texture_bounds(&mut self, texture: &Shape) -> Shape {
        let index = match texture {
            Shape::Texture(Some(texture)) => texture.texture.index(),
            Shape::Texture(None) => return Shape::Vector(Vector::new([Interval::ANY; 4])),
            _ => return Shape::Unknown,
        };
        let Some(texture) = self.textures.get(index) else { return Shape::Unknown };
        let bounds = self.texture_bounds.entry(index).or_insert_with(|| {
            let (low, high) = texture.range();
            let channel = |i: usize| if low[i] <= high[i] { Interval::new(low[i], high[i]) } else { Interval::ANY };
            Shape::Vector(Vector::new((0..4).map(channel)))
        });
        bounds.clone()
    }
}
