//! Script analysis: text goldens of what is known of scripts. Its soundness is tested beside it.

mod golden;
mod shaders;

use std::collections::BTreeMap;
use std::sync::Arc;

use tusche::math::{Affine2, Vec3};
use tusche::scene::ids::TextureId;
use tusche::scene::texture::{Image, Pixels, Texture, TextureFilter, TextureRef, Wrap};
use tusche::shade::analysis::{Analysis, analyse};
use tusche::shade::{Params, Value};

/// Compiles with positions as written, and analyses with these parameters and one texture.
fn analysis(script: &str, params: &[(&str, Value)]) -> Analysis {
    let mut engine = rhai::Engine::new_raw();
    engine.set_optimization_level(rhai::OptimizationLevel::None);
    engine.set_max_expr_depths(0, 0);
    let ast = engine.compile(script).unwrap_or_else(|error| panic!("{error}\n{script}"));
    let params: BTreeMap<String, Value> =
        params.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect();
    analyse(&ast, &Params(Arc::new(params)), &[texture([51, 102, 0, 255], [102, 204, 0, 255])])
}

/// Compares the dump of an analysis with lines of text.
#[track_caller]
fn assert_dump(analysis: &Analysis, expected: &str) {
    let lines = |text: &str| text.lines().map(str::trim).filter(|line| !line.is_empty()).collect::<Vec<_>>().join("\n");
    let (actual, expected) = (lines(&analysis.to_string()), lines(expected));
    assert_eq!(actual, expected, "\n--- actual\n{actual}\n--- expected\n{expected}\n");
}

/// Two linear pixels.
fn texture(a: [u8; 4], b: [u8; 4]) -> Arc<Texture> {
    let image = Image { width: 2, height: 1, pixels: Pixels::Rgba8 { data: vec![a, b], srgb: false } };
    Arc::new(Texture {
        name: "two".into(),
        image: Arc::new(image),
        wrap: [Wrap::Repeat; 2],
        filter: TextureFilter::Linear,
        levels: Default::default(),
    })
}

fn texture_ref(uv_set: u32) -> Value {
    Value::Texture(TextureRef { texture: TextureId::from_index(0), uv_set, transform: Affine2::IDENTITY })
}

fn rgb(r: f32, g: f32, b: f32) -> Value {
    Value::Vec3(Vec3::new(r, g, b))
}
