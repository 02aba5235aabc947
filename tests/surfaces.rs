//! Lists of surfaces in whole pictures (DESIGN section 3.4): what they add, what they cost, and what they leave alone.

use tusche::film::Layer;
use tusche::line::Method;
use tusche::render::{RenderOptions, Report};
use tusche::scene::Scene;
use tusche::scene::settings::HiddenLines;

use crate::common::{Picture, render_with, root, scene_from, scripted_scene, shipped_scenes};

fn shipped(name: &str) -> Scene {
    let path = root().join(format!("scenes/{name}.toml"));
    scene_from(&std::fs::read_to_string(path).expect("shipped scenes can be read"))
}

/// The same scene with other lists, a sample rate and a size.
fn with(scene: Scene, surfaces: u32, samples: u32, width: u32) -> Scene {
    let mut builder = scene.into_builder();
    builder.lines.surfaces = surfaces;
    if surfaces == 1 {
        builder.lines.hidden = None;
    }
    let [whole_width, height] = builder.render.size;
    builder.render.size = [width, (width * height / whole_width).max(1)];
    builder.render.samples = samples;
    builder.build().unwrap_or_else(|faults| panic!("{faults}"))
}

fn picture(scene: &Scene, layers: &[Layer]) -> (Picture, Report) {
    render_with(scene, layers, &RenderOptions::default())
}

/// Area of the line around the card of figure 6 that is not covered by the ball, in square pixels: what lies within half a
/// width of the card's outline and not in the ball's disc, counted on a grid of twenty by twenty points a pixel.
fn visible_outline(width: f64) -> f64 {
    const FINE: i32 = 20;
    let (center, half) = ([-0.3 * 90.0, -0.2 * 90.0], [1.3 * 90.0, 0.9 * 90.0]);
    let (ball, radius) = ([0.13 * 90.0, 0.1 * 90.0], 0.9 * 90.0);
    let mut inside = 0_u64;
    for iy in -180 * FINE..180 * FINE {
        for ix in -240 * FINE..240 * FINE {
            let [x, y] = [ix, iy].map(|i| (f64::from(i) + 0.5) / f64::from(FINE));
            // The distance to the outline of a rectangle: outside to its nearest point, inside to its nearest side.
            let beyond = [(x - center[0]).abs() - half[0], (y - center[1]).abs() - half[1]];
            let outside = beyond[0].max(0.0).hypot(beyond[1].max(0.0));
            let distance = if outside > 0.0 { outside } else { -beyond[0].max(beyond[1]) };
            inside += u64::from(distance < width / 2.0 && (x - ball[0]).hypot(y - ball[1]) > radius);
        }
    }
    inside as f64 / f64::from(FINE * FINE)
}

/// OG18 figure 6: with two surfaces a ray the silhouette of the card is complete; with one it has a gap.
#[test]
fn the_outline_of_figure_6_has_its_length() {
    let width = 12.0;
    let truth = visible_outline(width);
    let length = |surfaces| {
        let scene = with(shipped("fig6_occluder"), surfaces, 16, 480);
        let mut builder = scene.into_builder();
        builder.render.filter = tusche::scene::settings::FilterKind::Box;
        builder.render.filter_radius = 0.5;
        let scene = builder.build().unwrap_or_else(|faults| panic!("{faults}"));
        let (picture, report) = picture(&scene, &[Layer::Line]);
        assert_eq!(report.stats.lines.surfaces_behind > 0, surfaces > 1);
        picture.mean(3) * (480.0 * 360.0) / width
    };
    let [one, two, four] = [1, 2, 4].map(length);
    let truth = truth / width;
    // What the width compensation promises at 16 samples and such widths.
    assert!((two / truth - 1.0).abs() < 0.005, "{two:.2} px drawn, {truth:.2} px long; {one:.2} with one surface");
    assert_eq!(two, four, "nothing lies behind the card");
    // About forty pixels of the outer half are lost, as far as it is not covered.
    assert!(one < truth - 8.0, "{one:.2} px of {truth:.2} px: nothing is lost?");
}

/// What makes the picture is the first surface, found and shaded as ever.
#[test]
fn lists_change_no_bit_but_those_of_lines() {
    const LAYERS: [Layer; 6] = [Layer::Color, Layer::Depth, Layer::Normal, Layer::Position, Layer::Uv, Layer::Object];
    for (name, path) in shipped_scenes() {
        let scene = || scene_from(&std::fs::read_to_string(&path).expect("shipped scenes can be read"));
        let bits = |surfaces| {
            // Without the line layer there would be no lists.
            let layers: Vec<_> = LAYERS.into_iter().chain([Layer::Line]).collect();
            let (mut picture, report) = picture(&with(scene(), surfaces, 4, 72), &layers);
            picture.channels.truncate(picture.channels.len() - 4);
            (picture.bits(), report.stats.rays.camera)
        };
        let one = bits(1);
        for surfaces in [2, 5] {
            assert!(bits(surfaces) == one, "{name}, {surfaces} surfaces");
        }
    }
}

#[test]
fn the_search_draws_what_brute_force_draws() {
    let layers = [Layer::Rgba, Layer::Line, Layer::HiddenLine, Layer::Below];
    let by_type = Layer::FIXED.into_iter().filter(|layer| matches!(layer, Layer::LineType(_)));
    // With layers by type the very pair matters.
    let exact: Vec<_> = layers.iter().cloned().chain(by_type).collect();
    for name in ["fig6_occluder", "hidden_lines", "glass", "fig4_priority"] {
        for (surfaces, layers) in [(2, &layers[..]), (4, &layers[..]), (3, &exact[..])] {
            let mut builder = with(shipped(name), surfaces, 4, 64).into_builder();
            let style = HiddenLines { color: tusche::math::Vec3::ONE, width: 1.5, objects: None };
            builder.lines.hidden.get_or_insert(style);
            let scene = builder.build().unwrap_or_else(|faults| panic!("{faults}"));
            let bits = |method, tile| {
                let options = RenderOptions { method, tile, ..RenderOptions::default() };
                render_with(&scene, layers, &options).0.bits()
            };
            let brute = bits(Method::Brute, 32);
            for tile in [32, 9] {
                assert!(bits(Method::Exact, tile) == brute, "{name}, {surfaces} surfaces, tiles of {tile}");
            }
        }
    }
}

const SIDE: &str = "[render]\nsize = [40, 30]\nsamples = 4\n[camera]\nposition = [0.0, 0.0, 5.0]\n\
                    target = [0.0, 0.0, 0.0]\nfov = 40.0\n[lines]\nwidth = 3.0\nsurfaces = 3\n";
const BALL: &str = "[[objects]]\nshape = \"sphere\"\nradius = 0.8\nmaterial = \"plain\"\ntranslate = [0.5, 0.3, 1.0]\n";
const CARD: &str = "[[objects]]\nshape = \"box\"\nsize = [1.5, 1.0, 0.1]\nmaterial = \"inked\"\n";

fn shader(name: &str) -> (&str, &'static str) {
    let text = match name {
        "plain" => "#{ color: 0.5, line_width: 0.0 }",
        "inked" => "#{ color: 0.8, line_width: 3.0 }",
        "nothing" => "#{ opacity: 0.0, line_width: 8.0, color: 1.0 }",
        "holes" => "#{ opacity: if hit.uv.x > 0.5 { 1.0 } else { 0.0 }, line_width: 2.0, color: 0.1 }",
        _ => "#{ opacity: if hit.position.x > 9.0 { 1.0 } else { 0.0 }, line_width: 2.0, color: 0.1 }",
    };
    (name, text)
}

/// A surface of opacity 0 takes no place in a list, wherever it stands.
#[test]
fn what_is_invisible_is_no_surface() {
    let sheet = |z: f64, material: &str| {
        format!(
            "[[objects]]\nshape = \"plane\"\nsize = [9.0, 9.0]\nrotate = [90.0, 0.0, 0.0]\n\
             translate = [0.0, 0.0, {z:.2}]\nmaterial = \"{material}\"\n"
        )
    };
    let shaders = ["plain", "inked", "nothing", "unlikely"].map(shader);
    for tests in ["", "normal = 20.0\n"] {
        let bits = |objects: &str| {
            let text = format!("{SIDE}{tests}{objects}");
            let scene = scripted_scene(&text, &shaders);
            picture(&scene, &[Layer::Rgba, Layer::Line, Layer::Color]).0.bits()
        };
        let without = bits(&format!("{BALL}{CARD}"));
        for material in ["nothing", "unlikely"] {
            for places in [&[0.5][..], &[2.5], &[2.5, 0.3, 0.5], &[-1.0], &[2.0, 1.0, 0.05, 0.0, -0.05, -2.0]] {
                let sheets: String = places.iter().map(|z| sheet(*z, material)).collect();
                assert!(bits(&format!("{BALL}{CARD}{sheets}")) == without, "{material} at {places:?}");
            }
        }
    }
}

/// Of what lies behind, only what lines ask for is worked out.
#[test]
fn surfaces_behind_are_shaded_for_lines_alone() {
    let lit = "#{ base_color: 0.5, line_width: 2.0, feature: hit.normal }";
    let light = "[[lights]]\nkind = \"sun\"\ndirection = [-1.0, -2.0, -1.5]\n";
    let stats = |surfaces: u32, tests: &str| {
        let side = SIDE.replace("surfaces = 3", &format!("surfaces = {surfaces}"));
        let text = format!("{side}{tests}{}{CARD}{light}", BALL.replace("plain", "lit"));
        let scene = scripted_scene(&text, &[("lit", lit), ("inked", lit)]);
        picture(&scene, &[Layer::Rgba]).1.stats
    };
    let [one, two] = [1, 2].map(|surfaces| stats(surfaces, "feature = 0.2\n"));
    assert!(two.shaders[0].hits + two.shaders[1].hits > one.shaders[0].hits + one.shaders[1].hits);
    assert_eq!(two.rays.shadow, one.rays.shadow, "nothing behind is lit");
    assert_eq!(two.rays.camera, one.rays.camera, "one traversal each");
    assert!(two.bytes_per_sample > one.bytes_per_sample);
    assert_eq!(one.lines.surfaces_behind, 0);
    assert!(two.plan.contains("surfaces        up to 2"), "{}", two.plan);
    // Without tests of shapes a closed body is one surface, else it is two.
    let ids = stats(2, "");
    assert!(ids.lines.surfaces_behind < two.lines.surfaces_behind);
}

#[test]
fn lists_need_lines() {
    let text = format!("{SIDE}{BALL}{CARD}");
    let scene = scripted_scene(&text, &["plain", "inked"].map(shader));
    let stats = picture(&scene, &[Layer::Color]).1.stats;
    assert_eq!(stats.lines.surfaces_behind, 0);
    assert!(stats.plan.contains("surfaces        1: no line can be seen"), "{}", stats.plan);
}

/// Cut-outs in front and behind, with lists and hidden lines: the search and the tiles change nothing.
#[test]
fn cut_outs_have_lists_too() {
    let fence = "[[objects]]\nshape = \"plane\"\nsize = [3.0, 3.0]\nrotate = [90.0, 0.0, 0.0]\n\
                 translate = [0.1, 0.0, 0.6]\nmaterial = \"holes\"\n";
    let hidden = "[lines.hidden]\nwidth = 1.0\n";
    let text = format!("{SIDE}{hidden}{BALL}{CARD}{fence}{}", fence.replace("0.6", "2.0"));
    let scene = scripted_scene(&text, &["plain", "inked", "holes"].map(shader));
    let bits = |method, tile, threads| {
        let options = RenderOptions { method, tile, threads, ..RenderOptions::default() };
        let (picture, report) = render_with(&scene, &[Layer::Rgba, Layer::Line, Layer::HiddenLine], &options);
        assert!(report.stats.lines.hidden_samples > 0);
        picture.bits()
    };
    let reference = bits(Method::Brute, 32, 1);
    assert!(bits(Method::Exact, 32, 1) == reference);
    assert!(bits(Method::Exact, 7, 2) == reference);
}
