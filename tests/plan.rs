//! The plan: golden texts beside the scenes, and counters that prove it is obeyed.

use tusche::film::Layer;
use tusche::plan::Plan;
use tusche::render::RenderOptions;
use tusche::shade::{Host, Shaders};

use crate::common::{Picture, golden, render_text, render_with, root, scene_from, shipped_scenes};

const CAMERA: &str = "[camera]\nposition = [0.0, 0.5, 5.0]\ntarget = [0.0, 0.0, 0.0]\n";
const SMALL: &str = "[render]\nsize = [48, 32]\nsamples = 4\n";
const SUN: &str = "[[lights]]\nkind = \"sun\"\ndirection = [-1.0, -1.0, -1.0]\nstrength = 2.0\n";

fn sphere(material: &str) -> String {
    format!("[[objects]]\nshape = \"sphere\"\nmaterial = \"m\"\n[materials.m]\n{material}\n")
}

#[test]
fn the_plan_of_every_shipped_scene_is_as_written_beside_it() {
    let mut blessed = Vec::new();
    for (name, path) in shipped_scenes() {
        let text = std::fs::read_to_string(&path).expect("shipped scenes can be read");
        let scene = scene_from(&text);
        let (shaders, _) = Shaders::compile(&scene, &Host::new()).unwrap_or_else(|faults| panic!("{name}: {faults}"));
        let plan = Plan::new(&scene, &shaders, &[Layer::Rgba]).to_string();
        let beside = root().join(format!("scenes/{name}.plan.txt"));
        if std::env::var_os("TUSCHE_BLESS").is_some() {
            std::fs::write(&beside, &plan).expect("golden files can be written");
            blessed.push(name);
        } else {
            golden(&beside, &plan);
        }
    }
    assert!(blessed.is_empty(), "blessed {blessed:?}: look at the changes and run again without TUSCHE_BLESS");
}

#[test]
fn nothing_that_mirrors_means_no_secondary_rays_and_no_columns_for_them() {
    let text = format!("{SMALL}{CAMERA}{SUN}{}", sphere("shader = \"builtin:cel\""));
    let (_, report) = render_text(&text, &[Layer::Rgba]);
    assert_eq!((report.stats.rays.reflection, report.stats.rays.refraction), (0, 0));
    assert_eq!(report.stats.rays.camera, 48 * 32 * 4);
    assert!(report.stats.rays.shadow > 0, "cel shading reads light");

    let mirror = format!("{SMALL}{CAMERA}{SUN}{}", sphere("shader = \"builtin:mirror\""));
    let (_, report) = render_text(&mirror, &[Layer::Rgba]);
    assert!(report.stats.rays.reflection > 0);
    assert_eq!(report.stats.rays.refraction, 0);
}

#[test]
fn without_lines_there_is_no_line_pass_and_no_halo() {
    let crop = tusche::sample::PixelRect { x0: 16, y0: 8, x1: 32, y1: 24 };
    let options = RenderOptions { crop: Some(crop), ..RenderOptions::default() };
    let thick = "[lines]\nwidth = 8.0\n";
    let flat = "shader = \"builtin:ink\"\nparams = { ink_width = 8.0 }";
    let boxed = SMALL.replace("samples", "filter = \"box\"\nfilter_radius = 0.5\nsamples");
    let samples = |lines: &str, material: &str| {
        let scene = scene_from(&format!("{boxed}{CAMERA}{lines}{}", sphere(material)));
        let (_, report) = render_with(&scene, &[Layer::Rgba], &options);
        report.stats
    };
    let with = samples(thick, flat);
    assert!(with.samples > 16 * 16 * 4, "lines need samples around the crop");
    assert!(with.lines.lined_samples > 0);
    let without = samples(thick, "shader = \"builtin:ink\"\nparams = { ink_width = 0.0 }");
    assert_eq!(without.samples, 16 * 16 * 4, "all widths are 0: no halo");
    assert_eq!(without.lines.pairs_tested, 0);
    let untested = samples("[lines]\nobject = false\nshader = false\n", flat);
    assert_eq!(untested.samples, 16 * 16 * 4, "no test is on: no halo");
}

#[test]
fn nothing_that_reads_light_means_no_shadow_rays() {
    let unlit = format!("{SMALL}{CAMERA}{SUN}{}", sphere("shader = \"builtin:ink\""));
    let (_, report) = render_text(&unlit, &[Layer::Rgba]);
    assert_eq!(report.stats.rays.shadow, 0);
    let lit = format!("{SMALL}{CAMERA}{SUN}{}", sphere("shader = \"builtin:default\""));
    let (_, report) = render_text(&lit, &[Layer::Rgba]);
    assert!(report.stats.rays.shadow > 0);
    // Lines alone need no light, even of lit materials.
    let (_, report) = render_text(&lit, &[Layer::Line]);
    assert_eq!(report.stats.rays.shadow, 0);
}

#[test]
fn a_constant_shader_is_evaluated_once() {
    let text = format!("{SMALL}{CAMERA}{}", sphere("shader = \"builtin:ink\""));
    let (_, report) = render_text(&text, &[Layer::Rgba]);
    let shader = &report.stats.shaders[0];
    assert_eq!(shader.mode, "constant");
    assert!(shader.hits > 100);
}

#[test]
fn columns_that_no_test_reads_take_no_memory() {
    let bytes = |lines: &str| {
        let text = format!("{SMALL}{CAMERA}[lines]\n{lines}\n{}", sphere("shader = \"builtin:ink\""));
        render_text(&text, &[Layer::Rgba]).1.stats.bytes_per_sample
    };
    let plain = bytes("");
    assert!(bytes("uv = 0.1") >= plain + 8.0 * 0.2, "uv adds a column where the sphere is");
    assert!(bytes("normal = 30.0") > plain);
}

#[test]
fn layers_are_the_same_whichever_others_are_made() {
    let text = format!("{SMALL}{CAMERA}{SUN}{}", sphere("shader = \"builtin:cel\""));
    let alone = render_text(&text, &[Layer::Rgba]).0;
    let (all, _) =
        render_text(&text, &[Layer::Rgba, Layer::Color, Layer::Line, Layer::Depth, Layer::Normal, Layer::Uv]);
    let first = Picture { channels: all.channels[..4].to_vec(), ..all };
    assert_eq!(first.bits(), alone.bits());
}
