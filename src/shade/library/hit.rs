//! `hit`: the inputs of one hit, as scripts read them.

use std::sync::Arc;

use rhai::{Dynamic, Engine, ImmutableString};

use super::Function;
use super::math::max;
use super::operand::{Outcome, kind, refuse};
use super::parameters::to_script;
use super::vectors::dot;
use crate::math::{Vec2, Vec3};
use crate::scene::attributes::Attribute;
use crate::shade::batch::{HitBatch, LightSample};
use crate::shade::fault::Fault;
use crate::shade::names::InputSet;
use crate::shade::params::Value;

pub(super) const FUNCTIONS: &[Function] = &[
    Function {
        name: "light",
        form: "hit.light(i)",
        about: "light number 0 … hit.light_count − 1, with its direction, radiance and visibility",
        types: "int → light: `direction` (unit vector towards it), `radiance` (colour), `visibility` (0 … 1)",
        example: "if hit.light_count > 0 { hit.light(0).visibility } else { 0.0 }",
    },
    Function {
        name: "attribute",
        form: "hit.attribute(\"name\", default)",
        about: "a value of the object's or material's attributes, of the default's type; the default where there is none",
        types: "text, any of number, vector, text, true or false → the default's type",
        example: "hit.attribute(\"wear\", 0.0)",
    },
];

/// A row of a batch: the batch is shared, so that a hit costs one small allocation whatever it reads.
#[derive(Clone, Debug)]
pub(in crate::shade) struct Hit {
    pub batch: Arc<HitBatch>,
    pub row: usize,
}

/// What `hit.light(i)` gives.
#[derive(Clone, Copy, Debug)]
pub(super) struct Light(LightSample);

impl Hit {
    fn read<T: Copy>(&self, name: &str, column: &[T]) -> Outcome<T> {
        column.get(self.row).copied().ok_or_else(|| unfilled(name))
    }

    fn lights(&self) -> Outcome<&[LightSample]> {
        let count = self.batch.light_count;
        self.batch.lights.get(self.row * count..(self.row + 1) * count).ok_or_else(|| unfilled("light"))
    }

    fn light(&self, index: i64) -> Outcome<Light> {
        let lights = self.lights()?;
        let light = usize::try_from(index).ok().and_then(|i| lights.get(i));
        light.map(|light| Light(*light)).ok_or_else(|| {
            let fault = Fault::new(format!("light {index} is out of range: the scene has {} lights", lights.len()));
            fault.hint("count them with `for i in 0..hit.light_count`").into()
        })
    }

    /// An attribute of the object or the material; the default where they have none of this name.
    fn attribute(&self, name: &str, default: Dynamic) -> Outcome {
        // Without the column, no hit of the material has what its shader asks for.
        let set = match self.batch.attribute_set.as_slice() {
            [] => None,
            column => Some(self.read("attribute", column)?),
        };
        let given = set.and_then(|set| self.batch.attributes.get(set as usize)).and_then(|set| set.get(name));
        let wanted = Value::from_script(&default);
        let Some(wanted) = wanted.filter(Value::can_be_attribute) else {
            let fault = Fault::new(format!("an attribute cannot be {}", kind(&default)));
            return Err(fault.hint(ATTRIBUTE_TYPES).into());
        };
        let Some(given) = given else { return Ok(default) };
        match given.for_default(&wanted) {
            Some(value) => Ok(to_script(&value, &[])),
            None => Err(mistyped_attribute(name, given, &wanted).into()),
        }
    }

    fn irradiance(&self) -> Outcome<Vec3> {
        let normal = self.read("normal", &self.batch.normal)?;
        Ok(irradiance(normal, self.lights()?))
    }

    /// How far uv moves across the pixel.
    pub(super) fn uv_footprint(&self) -> Outcome<f32> {
        self.read("uv_footprint", &self.batch.uv_footprint)
    }

    /// The texture coordinates of a set; (0, 0) where the mesh lacks the set.
    pub(super) fn uv_set(&self, set: u32) -> Outcome<Vec2> {
        match set.checked_sub(1) {
            None => self.read("uv", &self.batch.uv),
            Some(more) => match self.batch.more_uvs.get(more as usize) {
                Some(column) => self.read("texture", column),
                None => Ok(Vec2::ZERO),
            },
        }
    }
}

/// What all lights together give a surface with this normal.
#[inline(always)]
pub(in crate::shade) fn irradiance(normal: Vec3, lights: &[LightSample]) -> Vec3 {
    lights
        .iter()
        .fold(Vec3::ZERO, |sum, light| sum + light.radiance * light.visibility * max(0.0, dot(normal, light.direction)))
}

/// A hit was asked for what its batch does not hold: the analysis missed that the script reads it.
fn unfilled(name: &str) -> Box<rhai::EvalAltResult> {
    Fault::new(format!("the input `{name}` was not prepared for this shader"))
        .hint("this is a fault of Tusche, not of the script: please report it with the script")
        .into()
}

/// What attributes can be.
pub(in crate::shade) const ATTRIBUTE_TYPES: &str = "attributes are numbers, vectors, texts, and true or false";

/// The fault of an attribute whose value is not of the default's type.
pub(in crate::shade) fn mistyped_attribute(name: &str, given: &Attribute, wanted: &Value) -> Fault {
    Fault::new(format!("the attribute `{name}` is {} here, but its default is {}", given.kind(), wanted.kind()))
        .hint("give the default the type that the scene file or the model gives, or the other way round")
}

fn unknown(name: &str) -> Fault {
    let fault = Fault::new(format!("there is no input `{name}` on `hit`"));
    fault.propose(name, InputSet::named().map(|(name, _)| name).collect::<Vec<_>>().into_iter())
}

pub(super) fn register(engine: &mut Engine) {
    engine.register_type_with_name::<Hit>("hit");
    macro_rules! columns {
        ($($name:ident),*) => { $(
            engine.register_get(stringify!($name), |hit: &mut Hit| hit.read(stringify!($name), &hit.batch.$name));
        )* };
    }
    columns!(
        position,
        normal,
        geometric_normal,
        incoming,
        uv,
        tangent,
        color,
        barycentric,
        distance,
        depth,
        front_facing,
        pixels_per_unit,
        curvature,
        footprint,
        uv_footprint
    );
    let id = |hit: &Hit, name: &str, column: &[u32]| hit.read(name, column).map(i64::from);
    engine.register_get("object_id", move |hit: &mut Hit| id(hit, "object_id", &hit.batch.object_id));
    engine.register_get("polygon_id", move |hit: &mut Hit| id(hit, "polygon_id", &hit.batch.polygon_id));
    engine.register_get("shader_id", |hit: &mut Hit| i64::from(hit.batch.material_id));
    engine.register_get("material_id", |hit: &mut Hit| i64::from(hit.batch.material_id));
    engine.register_get("time", |hit: &mut Hit| hit.batch.time);
    engine.register_get("light_count", |hit: &mut Hit| hit.batch.light_count as i64);
    engine.register_get("irradiance", |hit: &mut Hit| hit.irradiance());
    engine.register_get("path_kind", |hit: &mut Hit| -> Outcome<ImmutableString> {
        hit.read("path_kind", &hit.batch.path_kind).map(|kind| kind.name().into())
    });
    engine.register_fn("light", |hit: &mut Hit, index: i64| hit.light(index));
    engine.register_fn("attribute", |hit: &mut Hit, name: ImmutableString, default: Dynamic| {
        hit.attribute(&name, default)
    });
    engine.register_fn("attribute", |hit: &mut Hit, name: Dynamic, default: Dynamic| -> Outcome {
        Err(refuse("attribute", &[Dynamic::from(hit.clone()), name, default]))
    });
    engine.register_indexer_get(|_: &mut Hit, name: ImmutableString| -> Outcome { Err(unknown(&name).into()) });
    engine.register_indexer_set(|_: &mut Hit, name: ImmutableString, _: Dynamic| -> Outcome<()> {
        let known = InputSet::spelled(&name).is_some();
        let fault = if known { Fault::new(format!("the input `{name}` cannot be changed")) } else { unknown(&name) };
        Err(fault.into())
    });

    engine.register_type_with_name::<Light>("light");
    engine.register_get("direction", |light: &mut Light| light.0.direction);
    engine.register_get("radiance", |light: &mut Light| light.0.radiance);
    engine.register_get("visibility", |light: &mut Light| light.0.visibility);
    engine.register_indexer_get(|_: &mut Light, name: ImmutableString| -> Outcome {
        let fault = Fault::new(format!("a light has no `{name}`"));
        Err(fault.propose(&name, ["direction", "radiance", "visibility"].into_iter()).into())
    });
}
