//! `p`: a material's parameters, as scripts hold them.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use rhai::{Array, Dynamic, Engine, ImmutableString, Map};

use super::operand::Outcome;
use super::texture::TextureHandle;
use crate::scene::texture::Texture;
use crate::shade::fault::Fault;
use crate::shade::params::{Params, Value};

/// The parameters of one material. Scripts read its entries as properties and cannot change them, so that no hit sees
/// what another hit did.
#[derive(Clone, Debug)]
pub(in crate::shade) struct ParameterRecord(Arc<BTreeMap<String, Dynamic>>);

impl ParameterRecord {
    pub fn new(params: &Params, textures: &[Arc<Texture>]) -> Self {
        Self(Arc::new(params.0.iter().map(|(name, value)| (name.clone(), to_script(value, textures))).collect()))
    }

    fn get(&self, name: &str) -> Outcome {
        self.0.get(name).cloned().ok_or_else(|| self.unknown(name).into())
    }

    fn unknown(&self, name: &str) -> Fault {
        let fault = Fault::new(format!("there is no parameter `{name}`"));
        if self.0.is_empty() {
            return fault.hint(format!("declare it: fn params() {{ #{{ {name}: 1.0 }} }}"));
        }
        fault.propose(name, self.0.keys().map(String::as_str))
    }
}

pub(super) fn to_script(value: &Value, textures: &[Arc<Texture>]) -> Dynamic {
    match value {
        Value::Unit => Dynamic::UNIT,
        Value::Bool(x) => Dynamic::from_bool(*x),
        Value::Int(x) => Dynamic::from_int(*x),
        Value::Float(x) => Dynamic::from_float(*x),
        Value::Vec2(x) => Dynamic::from(*x),
        Value::Vec3(x) => Dynamic::from(*x),
        Value::Vec4(x) => Dynamic::from(*x),
        Value::Text(x) => Dynamic::from(x.clone()),
        Value::Texture(place) => match textures.get(place.texture.index()) {
            Some(texture) => Dynamic::from(TextureHandle { texture: Arc::clone(texture), place: *place }),
            None => Dynamic::UNIT,
        },
        Value::Record(entries) => {
            let map: Map = entries.iter().map(|(key, value)| (key.into(), to_script(value, textures))).collect();
            Dynamic::from_map(map)
        }
        Value::Array(items) => {
            let array: Array = items.iter().map(|value| to_script(value, textures)).collect();
            Dynamic::from_array(array)
        }
    }
}

/// Each name gets a getter of its own: an indexer by name would be asked only after a failed look-up.
pub(super) fn register(engine: &mut Engine, names: &BTreeSet<String>) {
    engine.register_type_with_name::<ParameterRecord>("parameters");
    for name in names {
        let key = name.clone();
        engine.register_get(name, move |p: &mut ParameterRecord| p.get(&key));
    }
    engine.register_indexer_get(|p: &mut ParameterRecord, name: ImmutableString| p.get(&name));
    engine.register_indexer_set(|p: &mut ParameterRecord, name: ImmutableString, _: Dynamic| -> Outcome<()> {
        let fault = if p.0.contains_key(name.as_str()) {
            Fault::new(format!("the parameter `{name}` cannot be changed"))
                .hint(format!("copy it first: let {name} = p.{name};"))
        } else {
            p.unknown(&name)
        };
        Err(fault.into())
    });
}
