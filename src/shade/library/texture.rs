//! Textures, as scripts hold them.

use std::sync::Arc;

use rhai::{Dynamic, Engine};

use super::Function;
use super::hit::Hit;
use super::operand::{Outcome, refuse};
use crate::math::{Vec2, Vec4};
use crate::scene::texture::{Texture, TextureRef};

pub(super) const FUNCTIONS: &[Function] = &[
    Function {
        name: "texture",
        form: "hit.texture(map)",
        about: "the texture's linear colour and alpha at the hit, by its own uv set and transform; test `map != ()` first",
    },
    Function {
        name: "texture",
        form: "texture(map, uv)",
        about: "the texture's linear colour and alpha at a place, (0, 0) being the image's top left",
    },
];

/// A material's use of a texture.
#[derive(Clone, Debug)]
pub(in crate::shade) struct TextureHandle {
    pub texture: Arc<Texture>,
    pub place: TextureRef,
}

impl TextureHandle {
    fn at_hit(&self, hit: &Hit) -> Outcome<Vec4> {
        let uv = hit.uv_set(self.place.uv_set)?;
        Ok(self.texture.sample(self.place.transform.transform_point2(uv)))
    }
}

pub(super) fn register(engine: &mut Engine) {
    engine.register_type_with_name::<TextureHandle>("texture");
    engine.register_fn("==", |a: TextureHandle, b: TextureHandle| a.place == b.place);
    engine.register_fn("!=", |a: TextureHandle, b: TextureHandle| a.place != b.place);
    engine.register_fn("texture", |hit: &mut Hit, map: TextureHandle| map.at_hit(hit));
    engine.register_fn("texture", |map: TextureHandle, uv: Vec2| map.texture.sample(uv));
    engine.register_fn("texture", |hit: &mut Hit, other: Dynamic| -> Outcome<Vec4> {
        Err(refuse("texture", &[Dynamic::from(hit.clone()), other]))
    });
}
