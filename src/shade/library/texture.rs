//! Textures, as scripts hold them.

use std::collections::BTreeMap;
use std::sync::Arc;

use rhai::{Dynamic, Engine, ImmutableString};

use super::Function;
use super::hit::Hit;
use super::operand::{Outcome, number, refuse};
use crate::math::{Vec2, Vec4};
use crate::scene::ids::TextureId;
use crate::scene::texture::{Texture, TextureFilter, TextureRef};
use crate::shade::fault::Fault;

pub(super) const FUNCTIONS: &[Function] = &[
    Function {
        name: "texture",
        form: "hit.texture(map)",
        about: "the texture's linear colour and alpha at the hit, by its own uv set, transform and filter; test `map != ()` first",
        types: "texture → vec4",
        example: "if p.map != () { hit.texture(p.map).rgb } else { gray(0.5) }",
    },
    Function {
        name: "texture",
        form: "texture(map, uv)",
        about: "the texture's linear colour and alpha at a place, (0, 0) being the image's top left",
        types: "texture, vec2 → vec4",
        example: "if p.map != () { texture(p.map, hit.uv * 2.0).rgb } else { gray(0.5) }",
    },
    Function {
        name: "texture",
        form: "texture(map, uv, width)",
        about: "the same averaged over `width` units of uv, if the texture's filter is \"mipmap\"",
        types: "texture, vec2, number → vec4",
        example: "if p.map != () { texture(p.map, hit.uv * 2.0, hit.uv_footprint * 2.0).rgb } else { gray(0.5) }",
    },
    Function {
        name: "texture",
        form: "texture(\"file.png\", uv, wrap, color)",
        about: "the same of an image beside the script; wrap is \"repeat\" (default), \"mirror\" or \"clamp\", color is \
                \"srgb\" (default) or \"linear\"; all but uv must be written out as texts",
        types: "text, vec2, text, text → vec4",
        example: "texture(\"grain.png\", hit.uv * 4.0, \"mirror\", \"linear\").r",
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
        let uv = self.place.transform.transform_point2(uv);
        if self.texture.filter != TextureFilter::Mipmap {
            return Ok(self.texture.sample(uv));
        }
        // The width is that of set 0, which others resemble.
        let scale = self.place.transform.matrix2.determinant().abs().sqrt();
        Ok(self.texture.sample_wide(uv, hit.uv_footprint()? * scale))
    }
}

const NAME: &str = "texture:";

/// What stands in a linked script for the path of an image.
pub(in crate::shade) fn texture_name(id: TextureId) -> String {
    format!("{NAME}{}", id.0)
}

/// The texture that a text in a linked script stands for.
pub(in crate::shade) fn texture_of(text: &str) -> Option<TextureId> {
    text.strip_prefix(NAME)?.parse().ok().map(TextureId)
}

/// The fault of a path that is not written out, and so was not loaded.
pub(in crate::shade) fn unwritten_path() -> Fault {
    Fault::new("the path of an image must be written out as a text where it is looked up")
        .hint("write: texture(\"grain.png\", hit.uv)")
}

pub(super) fn register(engine: &mut Engine, textures: &[Arc<Texture>]) {
    let named: BTreeMap<String, Arc<Texture>> = textures
        .iter()
        .enumerate()
        .map(|(index, texture)| (texture_name(TextureId::from_index(index)), Arc::clone(texture)))
        .collect();
    let named = Arc::new(named);
    let look_up = move |name: &ImmutableString, uv: Vec2| -> Outcome<Vec4> {
        let texture = named.get(name.as_str()).ok_or_else(unwritten_path)?;
        Ok(texture.sample(uv))
    };
    let with_options = look_up.clone();
    let with_wrap = look_up.clone();
    engine.register_fn("texture", move |name: ImmutableString, uv: Vec2| look_up(&name, uv));
    engine.register_fn("texture", move |name: ImmutableString, uv: Vec2, _: ImmutableString| with_wrap(&name, uv));
    engine.register_fn("texture", move |name: ImmutableString, uv: Vec2, _: ImmutableString, _: ImmutableString| {
        with_options(&name, uv)
    });
    engine.register_type_with_name::<TextureHandle>("texture");
    engine.register_fn("==", |a: TextureHandle, b: TextureHandle| a.place == b.place);
    engine.register_fn("!=", |a: TextureHandle, b: TextureHandle| a.place != b.place);
    engine.register_fn("texture", |hit: &mut Hit, map: TextureHandle| map.at_hit(hit));
    engine.register_fn("texture", |map: TextureHandle, uv: Vec2| map.texture.sample(uv));
    engine.register_fn("texture", |map: TextureHandle, uv: Vec2, width: Dynamic| -> Outcome<Vec4> {
        Ok(map.texture.sample_wide(uv, number("texture", &width)?))
    });
    engine.register_fn("texture", |hit: &mut Hit, other: Dynamic| -> Outcome<Vec4> {
        Err(refuse("texture", &[Dynamic::from(hit.clone()), other]))
    });
}
