//! Attributes of objects: named values that scripts ask for with `hit.attribute("name", default)`.
//!
//! They come from the scene file (`attributes` of an object) and from the `extras` of a model's nodes, meshes and
//! materials. Where several give one, the scene file wins over the node, the node over the mesh, the mesh over the
//! material. An object and one of its materials together have one [`AttributeSet`]; a hit refers to it by number.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::Object;
use super::ids::{MaterialId, ObjectId};
use crate::math::{Vec2, Vec3, Vec4};
use crate::shade::Value;

/// The attributes of an object or a material, by name.
pub type AttributeSet = BTreeMap<String, Attribute>;

/// An attribute's value.
#[derive(Clone, Debug, PartialEq)]
pub enum Attribute {
    /// `true` or `false`.
    Bool(bool),
    /// A whole number.
    Int(i64),
    /// A number.
    Float(f32),
    /// Two numbers.
    Vec2(Vec2),
    /// Three numbers: a vector or a linear colour.
    Vec3(Vec3),
    /// Four numbers.
    Vec4(Vec4),
    /// A text.
    Text(String),
}

/// Attributes as they are collected.
#[derive(Clone, Debug, Default)]
pub struct Attributes {
    /// Of objects.
    pub objects: BTreeMap<ObjectId, AttributeSet>,
    /// Of materials, for objects that lack them.
    pub materials: BTreeMap<MaterialId, AttributeSet>,
}

/// The attribute sets of a scene, by object and material.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AttributeTable {
    /// Set 0 is empty.
    sets: Arc<Vec<AttributeSet>>,
    /// For each object its materials and their sets; empty where no object has any.
    by_object: Vec<Vec<(MaterialId, u32)>>,
}

impl Attributes {
    /// Adds attributes to those of an object; new ones win.
    pub fn extend_object(&mut self, object: ObjectId, attributes: AttributeSet) {
        if !attributes.is_empty() {
            self.objects.entry(object).or_default().extend(attributes);
        }
    }

    pub(super) fn table(&self, objects: &[Object]) -> AttributeTable {
        if self.objects.is_empty() && self.materials.is_empty() {
            return AttributeTable { sets: Arc::new(vec![AttributeSet::new()]), by_object: Vec::new() };
        }
        let mut sets = vec![AttributeSet::new()];
        let by_object = objects.iter().enumerate().map(|(index, object)| {
            let own = self.objects.get(&ObjectId::from_index(index));
            let mut materials = object.materials.clone();
            materials.sort();
            materials.dedup();
            let set_of = |material: MaterialId| {
                let mut set = self.materials.get(&material).cloned().unwrap_or_default();
                set.extend(own.cloned().unwrap_or_default());
                let known = sets.iter().position(|known| *known == set).unwrap_or(sets.len());
                if known == sets.len() {
                    sets.push(set);
                }
                (material, known as u32)
            };
            materials.into_iter().map(set_of).collect()
        });
        let by_object = by_object.collect();
        AttributeTable { sets: Arc::new(sets), by_object }
    }
}

impl AttributeTable {
    /// All sets.
    #[must_use]
    pub fn sets(&self) -> &Arc<Vec<AttributeSet>> {
        &self.sets
    }

    /// The set of an object with one of its materials.
    #[must_use]
    pub fn of(&self, object: ObjectId, material: MaterialId) -> u32 {
        let materials = self.by_object.get(object.index()).map_or(&[][..], Vec::as_slice);
        materials.iter().find(|(known, _)| *known == material).map_or(0, |(_, set)| *set)
    }

    /// The sets that hits of a material can have, each once, and an object that has it.
    pub fn of_material(&self, material: MaterialId) -> BTreeMap<u32, ObjectId> {
        let mut found = BTreeMap::new();
        for (index, materials) in self.by_object.iter().enumerate() {
            for (_, set) in materials.iter().filter(|(known, _)| *known == material) {
                found.entry(*set).or_insert_with(|| ObjectId::from_index(index));
            }
        }
        found
    }
}

impl Attribute {
    /// What a script gets that asks with this default: of the default's type. An int stands for a float as well.
    /// `None` if the type is another.
    #[must_use]
    pub fn for_default(&self, default: &Value) -> Option<Value> {
        #[expect(clippy::cast_precision_loss, reason = "an int counts as the nearest float")]
        Some(match (default, self) {
            (Value::Bool(_), Self::Bool(x)) => Value::Bool(*x),
            (Value::Int(_), Self::Int(x)) => Value::Int(*x),
            (Value::Float(_), Self::Float(x)) => Value::Float(*x),
            (Value::Float(_), Self::Int(x)) => Value::Float(*x as f32),
            (Value::Vec2(_), Self::Vec2(v)) => Value::Vec2(*v),
            (Value::Vec3(_), Self::Vec3(v)) => Value::Vec3(*v),
            (Value::Vec4(_), Self::Vec4(v)) => Value::Vec4(*v),
            (Value::Text(_), Self::Text(text)) => Value::Text(text.clone()),
            _ => return None,
        })
    }

    /// What messages call its type.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Bool(_) => "true or false",
            Self::Int(_) => "an int",
            Self::Float(_) => "a number",
            Self::Vec2(_) => "a vec2 (two numbers)",
            Self::Vec3(_) => "a vec3 or colour (three numbers)",
            Self::Vec4(_) => "a vec4 (four numbers)",
            Self::Text(_) => "a text",
        }
    }
}
