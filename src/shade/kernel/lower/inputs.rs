//! What scripts read on `hit`: inputs, lights, textures, attributes.

use std::sync::Arc;

use rhai::Position;

use super::super::ir::{Code, Column, Comparison, FloatBinary, Kind, Operand};
use super::meaning::{Channels, Meaning};
use super::{Flow, Lowerer};
use crate::math::{Affine2, Vec2, Vec3, Vec4};
use crate::scene::texture::{TextureFilter, TextureRef};
use crate::shade::library::texture_of;
use crate::shade::names::PATH_KINDS;
use crate::shade::params::Value;

impl Lowerer<'_> {
    // Inputs.

    /// `hit.name`.
    pub(super) fn input(&mut self, name: &str, position: Position) -> Flow<Meaning> {
        let (column, width) = match name {
            "position" => (Column::Position, 3),
            "normal" => (Column::Normal, 3),
            "geometric_normal" => (Column::GeometricNormal, 3),
            "incoming" => (Column::Incoming, 3),
            "uv" => (Column::Uv(0), 2),
            "tangent" => (Column::Tangent, 4),
            "color" => (Column::Color, 4),
            "barycentric" => (Column::Barycentric, 3),
            "distance" => (Column::Distance, 1),
            "depth" => (Column::Depth, 1),
            "time" => (Column::Time, 1),
            "pixels_per_unit" => (Column::PixelsPerUnit, 1),
            "curvature" => (Column::Curvature, 1),
            "footprint" => (Column::Footprint, 1),
            "uv_footprint" => (Column::UvFootprint, 1),
            "object_id" => return Ok(Meaning::Int(self.builder.emit(Code::Input(Column::ObjectId, 0), &[]))),
            "polygon_id" => return Ok(Meaning::Int(self.builder.emit(Code::Input(Column::PolygonId, 0), &[]))),
            "path_kind" => {
                let place = self.builder.emit(Code::Input(Column::PathKind, 0), &[]);
                return Ok(Meaning::Word(place, &PATH_KINDS));
            }
            "front_facing" => return Ok(Meaning::Bool(self.builder.emit(Code::Input(Column::FrontFacing, 0), &[]))),
            "material_id" | "shader_id" => return Ok(Meaning::int(self.surroundings.material_id.into())),
            "light_count" => return Ok(Meaning::Int(self.light_count())),
            "irradiance" => return Ok(self.many(Code::Irradiance, &[], 3)),
            _ => return self.give_up(position, &format!("the input `{name}`")),
        };
        let channels: Channels = (0..width).map(|lane| self.builder.emit(Code::Input(column, lane), &[])).collect();
        Ok(if width == 1 { Meaning::Float(channels[0]) } else { Meaning::Vector(channels) })
    }

    pub(super) fn light_count(&mut self) -> Operand {
        match self.surroundings.light_count {
            Some(count) => Operand::Int(count as i64),
            None => self.builder.emit(Code::Input(Column::LightCount, 0), &[]),
        }
    }

    /// An instruction that gives a float, or the channels of a vector.
    pub(super) fn many(&mut self, code: Code, operands: &[Operand], count: usize) -> Meaning {
        let first = self.builder.emit_many(code, operands, &vec![Kind::Float; count]);
        let mut channels = (0..count as u32).map(|i| Operand::Value(super::super::ir::Value(first.0 + i)));
        match count {
            1 => Meaning::Float(Operand::Value(first)),
            _ => Meaning::Vector(channels.by_ref().collect()),
        }
    }

    /// `hit.light(index)`. Hits where there is none of that index fail.
    pub(super) fn light(&mut self, index: Operand) -> Meaning {
        let count = self.light_count();
        let negative = self.builder.emit(Code::CompareInts(Comparison::Less), &[index, Operand::Int(0)]);
        let over = self.builder.emit(Code::CompareInts(Comparison::GreaterEqual), &[index, count]);
        let outside = self.builder.or(negative, over);
        if outside == Operand::TRUE {
            self.fail();
            return Meaning::Undefined;
        }
        self.fail_where(outside);
        Meaning::Light(index)
    }

    pub(super) fn light_part(&mut self, index: Operand, name: &str, position: Position) -> Flow<Meaning> {
        let all = self.many(Code::Light, &[index], 7);
        let Meaning::Vector(all) = all else { return self.give_up(position, "a light") };
        match name {
            "direction" => Ok(Meaning::vector(&all[..3])),
            "radiance" => Ok(Meaning::vector(&all[3..6])),
            "visibility" => Ok(Meaning::Float(all[6])),
            _ => self.give_up(position, &format!("`{name}` of a light")),
        }
    }

    // Textures.

    /// As `Affine2::transform_point2` of the mesh's texture coordinates.
    pub(super) fn texture_at_hit(&mut self, texture: usize) -> Meaning {
        let place = self.textures[texture].place;
        let [u, v] = [0, 1].map(|lane| self.builder.emit(Code::Input(Column::Uv(place.uv_set), lane), &[]));
        let (m, t) = (place.transform.matrix2, place.transform.translation);
        let uv = [(m.x_axis.x, m.y_axis.x, t.x), (m.x_axis.y, m.y_axis.y, t.y)].map(|(a, b, t)| {
            let along = self.float2(FloatBinary::Multiply, Operand::float(a), u);
            let across = self.float2(FloatBinary::Multiply, Operand::float(b), v);
            let sum = self.float2(FloatBinary::Add, along, across);
            self.float2(FloatBinary::Add, sum, Operand::float(t))
        });
        if self.textures[texture].texture.filter != TextureFilter::Mipmap {
            return self.texture(texture, &uv);
        }
        let scale = Operand::float(m.determinant().abs().sqrt());
        let footprint = self.builder.emit(Code::Input(Column::UvFootprint, 0), &[]);
        let width = self.float2(FloatBinary::Multiply, footprint, scale);
        self.texture(texture, &[uv[0], uv[1], width])
    }

    /// At u and v, and perhaps over a width.
    pub(super) fn texture(&mut self, texture: usize, operands: &[Operand]) -> Meaning {
        self.many(Code::Texture(texture as u16), operands, 4)
    }

    /// An image that the script names; linking has put its number in place of its path.
    pub(super) fn named_texture(&mut self, name: &str, uv: [Operand; 2]) -> Option<Meaning> {
        let id = texture_of(name)?;
        let texture = Arc::clone(self.surroundings.textures.get(id.index())?);
        let place = TextureRef { texture: id, uv_set: 0, transform: Affine2::IDENTITY };
        match self.texture_use(texture, place) {
            Meaning::Texture(index) => Some(self.texture(index, &uv)),
            _ => None,
        }
    }

    /// `hit.attribute(name, default)`: one select for each set of attributes that has it. Where it is of another type
    /// than the default, hits fail.
    pub(super) fn attribute(&mut self, name: &str, default: &Meaning, position: Position) -> Flow<Meaning> {
        let form = match default {
            Meaning::Bool(_) => Value::Bool(false),
            Meaning::Int(_) => Value::Int(0),
            Meaning::Float(_) => Value::Float(0.0),
            Meaning::Vector(channels) if channels.len() == 2 => Value::Vec2(Vec2::ZERO),
            Meaning::Vector(channels) if channels.len() == 3 => Value::Vec3(Vec3::ZERO),
            Meaning::Vector(_) => Value::Vec4(Vec4::ZERO),
            Meaning::Text(_) => Value::Text(String::new()),
            other => return self.give_up(position, &format!("an attribute that is {}", other.name())),
        };
        let sets = Arc::clone(self.surroundings.attributes);
        let mut value = default.clone();
        for (number, set) in sets.iter().enumerate() {
            let Some(given) = set.get(name) else { continue };
            let own = self.builder.emit(Code::Input(Column::AttributeSet, 0), &[]);
            let here = self.builder.emit(Code::CompareInts(Comparison::Equal), &[own, Operand::Int(number as i64)]);
            match given.for_default(&form) {
                Some(given) => {
                    let given = self.parameter(&given);
                    value = self.builder.join(here, &given, &value);
                }
                None => self.fail_where(here),
            }
        }
        Ok(value)
    }
}
