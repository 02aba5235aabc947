//! Pixels that surely show the background alone are not traced, and nobody can tell.

use proptest::prelude::*;
use tusche::film::Layer;
use tusche::plan::Plan;
use tusche::sample::PixelRect;
use tusche::scene::Scene;
use tusche::shade::{Host, Lighting, Shaders};
use tusche::trace::{Memory, TileTracer, TraceContext, TracedTile, World};

use crate::common::scripted_scene;

/// A tile, with rays spared where that can be and with all of them traced, as a record asks for.
fn both(scene: &Scene, layers: &[Layer], tile: PixelRect) -> [TracedTile; 2] {
    let (shaders, _) = Shaders::compile(scene, &Host::new()).unwrap_or_else(|faults| panic!("{faults}"));
    let plan = Plan::new(scene, &shaders, layers);
    let world = World::new(scene, &plan.materials.iter().map(|material| material.refracts).collect::<Vec<_>>());
    let lighting = Lighting::new(scene, world.origin);
    let tracer = TileTracer::new(scene, &plan, &world, &lighting);
    let mut context = TraceContext::new(scene, &shaders);
    [false, true].map(|keep| tracer.trace_with(tile, &mut context, Memory::new(None, keep)))
}

const BODY: &str = "#{ base_color: rgb(0.2, 0.5, 0.9), line_width: 2.0, feature: rgb(hit.depth, 0.0, 0.0) }";

#[test]
fn of_the_sky_nothing_is_traced() {
    let text = "[render]\nsize = [64, 48]\nsamples = 4\n[camera]\nposition = [0.0, 0.0, 5.0]\ntarget = [0.0, 0.0, 0.0]\nfov = 30.0\n\
                [[objects]]\nshape = \"sphere\"\nradius = 0.3\nmaterial = \"m\"\n";
    let scene = scripted_scene(text, &[("m", BODY)]);
    let [spared, traced] = both(&scene, &[Layer::Color], PixelRect::of_size([64, 48]));
    assert_eq!(spared.samples, traced.samples);
    assert_eq!((spared.rays.camera, traced.rays.camera, traced.rays.spared), (64 * 48 * 4, 64 * 48 * 4, 0));
    // The ball's box covers 12 × 12 pixels, in rows of segments of 16.
    let seen = spared.rays.camera - spared.rays.spared;
    assert!((12 * 16 * 4..=14 * 32 * 4).contains(&seen), "{seen}");
}

fn number(values: std::ops::Range<f64>) -> impl Strategy<Value = f64> {
    prop_oneof![3 => values, 1 => Just(0.0), 1 => Just(0.5), 1 => Just(-1.0)]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn what_is_spared_would_have_met_nothing(
        camera in [number(-4.0..4.0), number(-4.0..4.0), number(1.0..6.0)],
        target in [number(-1.0..1.0), number(-1.0..1.0), number(-1.0..1.0)],
        projection in 0..6,
        scale in prop_oneof![Just(1e-3), Just(1.0), Just(1e4)],
        balls in proptest::collection::vec([number(-2.0..2.0), number(-2.0..2.0), number(-2.0..2.0), number(0.01..0.8)], 0..5),
        background in prop_oneof![
            Just("[0.1, 0.2, 0.3]"),
            Just("\"transparent\""),
            Just("{ bottom = [0.9, 0.8, 0.7], top = [0.1, 0.2, 0.5] }"),
        ],
        samples in prop_oneof![Just(1), Just(3), Just(16), Just(600)],
        corner in [0..40i32, 0..30i32],
        size in [1..24i32, 1..9i32],
        compose in prop_oneof![Just("replace"), Just("throughput")],
        layers in prop_oneof![
            Just(vec![Layer::Color]),
            Just(vec![Layer::Color, Layer::Position, Layer::Below, Layer::Rgba]),
        ],
    ) {
        let projection = match projection {
            0 => "projection = \"orthographic\"\nheight = 3.0".replace("3.0", &format!("{:?}", 3.0 * scale)),
            angle => format!("fov = {:?}", [0.01, 5.0, 40.0, 100.0, 179.0][angle as usize - 1]),
        };
        let at = |[x, y, z]: [f64; 3]| format!("[{:?}, {:?}, {:?}]", x * scale, y * scale, z * scale);
        let mut text = format!(
            "[render]\nsize = [64, 48]\nsamples = {samples}\nbackground = {background}\n[camera]\nposition = {}\ntarget = {}\n{projection}\n[lines]\ncompose = \"{compose}\"\n",
            at(camera), at([target[0], target[1], target[2] - 7.0]),
        );
        for [x, y, z, radius] in balls {
            text += &format!(
                "[[objects]]\nshape = \"sphere\"\nsegments = [8, 4]\nradius = {:?}\ntranslate = {}\nmaterial = \"m\"\n",
                radius.abs().max(0.01) * scale, at([x, y, z]),
            );
        }
        let scene = scripted_scene(&text, &[("m", BODY)]);
        let [x, y] = corner;
        let tile = PixelRect { x0: x, y0: y, x1: x + size[0], y1: y + size[1] };
        let [spared, traced] = both(&scene, &layers, tile);
        prop_assert_eq!(&spared.samples, &traced.samples);
        prop_assert_eq!(spared.rays.camera, traced.rays.camera);
        prop_assert_eq!(spared.hits, traced.hits);
    }
}
