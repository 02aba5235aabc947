//! `max_line_width`: what a script declares bounds its lines, in the plan and in the picture.

use tusche::files::FileStore;
use tusche::film::Layer;
use tusche::plan::Plan;
use tusche::render::RenderOptions;
use tusche::scene::{Scene, file};
use tusche::shade::{Host, Shaders};

use crate::common::render_with;

/// Asks for lines as wide as the distance, which is 4 to 5.
const BY_DISTANCE: &str = "fn params() { #{ max_line_width: 3.0 } }\n\
    fn surface(hit, p) { #{ line_width: hit.depth, color: rgb(1, 1, 1) } }";

/// A ball with a shader and parameters.
fn scene(script: &str, params: &str) -> Scene {
    let text = format!(
        "[render]\nsize = [48, 32]\nsamples = 4\n\
         [camera]\nposition = [0, 0, 5]\ntarget = [0, 0, 0]\n\
         [lines]\nmax_width = 8.0\n\
         [materials.ink]\nshader = \"ink.rhai\"\nparams = {{ {params} }}\n\
         [[objects]]\nshape = \"sphere\"\nmaterial = \"ink\"\n"
    );
    let files = FileStore::new().with_file("scene.toml", text).with_file("ink.rhai", script);
    let (builder, _) = file::load("scene.toml".as_ref(), &files, &[], &file::LoadOptions::default())
        .unwrap_or_else(|faults| panic!("{faults}"));
    builder.build().unwrap_or_else(|faults| panic!("{faults}"))
}

fn widest(scene: &Scene) -> Option<f32> {
    let (shaders, _) = Shaders::compile(scene, &Host::new()).unwrap_or_else(|faults| panic!("{faults}"));
    Plan::new(scene, &shaders, &[Layer::Rgba]).lines.map(|lines| lines.widest)
}

#[test]
fn it_bounds_the_plan_where_the_analysis_finds_no_bound() {
    assert_eq!(widest(&scene(BY_DISTANCE, "")), Some(3.0));
    assert_eq!(widest(&scene(BY_DISTANCE, "max_line_width = 5")), Some(5.0), "a material may set it");
    assert_eq!(widest(&scene(BY_DISTANCE, "max_line_width = 50.0")), Some(8.0), "the scene's bound stays");
    assert_eq!(widest(&scene(BY_DISTANCE, "max_line_width = 0.0")), None, "no line, no line pass");
}

#[test]
fn wider_lines_are_drawn_that_wide_counted_and_said() {
    let layers = [Layer::Line];
    let draw = |params: &str| render_with(&scene(BY_DISTANCE, params), &layers, &RenderOptions::default());
    let (clamped, report) = draw("");
    assert!(report.stats.lines.clamped_widths > 0);
    let said = report.warnings.to_string();
    assert!(said.contains("a line wider than max_line_width (3 px)") && said.contains("`params()`"), "{said}");
    // What is asked for now is exactly what it was clamped to: the same picture, without a word.
    let exact = "fn surface(hit, p) { #{ line_width: 3.0, color: rgb(1, 1, 1) } }";
    let (expected, report) = render_with(&scene(exact, ""), &layers, &RenderOptions::default());
    assert_eq!(report.stats.lines.clamped_widths, 0);
    assert_eq!(clamped.bits(), expected.bits());
    let (wide, report) = draw("max_line_width = 50.0");
    assert_eq!(report.stats.lines.clamped_widths, 0, "5 px at most are asked for");
    assert!(wide.mean(3) > clamped.mean(3) * 1.3, "{} and {}", wide.mean(3), clamped.mean(3));
}
