//! Scripts that return what no surface has.

use rayon::prelude::*;
use tusche::film::Layer;
use tusche::render::RenderOptions;

use super::Case;
use crate::common::{render_with, scripted_scene};

pub const CASES: &[Case] = &[
    Case {
        name: "NaN, infinity, ±1e38, −0 and denormals in every output of a script",
        wrong: "NaN pixels, and filters that spread them",
        unit: "values that are not finite",
        bound: 0.0,
        figure: any_output,
    },
    Case {
        name: "a script that returns NaN at every second column of a mirror's world",
        wrong: "NaN that travels up a path",
        unit: "values that are not finite",
        bound: 0.0,
        figure: in_a_mirror,
    },
];

const VALUES: [&str; 8] = ["0.0 / 0.0", "1.0 / 0.0", "-1.0 / 0.0", "1e38", "-1e38", "1e-42", "-0.0", "3.4e38"];
const NUMBERS: [&str; 7] = ["metallic", "roughness", "specular", "ior", "transmission", "opacity", "occlusion"];
const COLORS: [&str; 5] = ["base_color", "emission", "color", "feature", "line_color"];
const LINES: [&str; 2] = ["line_width", "line_opacity"];

const TEXT: &str = r#"
[render]
size = [20, 14]
samples = 4
background = [0.5, 0.6, 0.7]
[lines]
feature = 0.1
normal = 30.0
[camera]
position = [0.5, 1.5, 5.0]
target = [0.0, 0.2, 0.0]
fov = 35.0
[[lights]]
kind = "sun"
direction = [-0.5, -1.0, -0.3]
[[objects]]
name = "floor"
shape = "plane"
size = [6.0, 6.0]
material = "mirror"
translate = [0.0, -1.0, 0.0]
[[objects]]
name = "ball"
shape = "sphere"
segments = [32, 16]
material = "odd"
"#;

fn faults(odd: &str) -> usize {
    let mirror = "#{ metallic: 1.0, roughness: 0.0, base_color: rgb(0.8, 0.8, 0.8) }";
    let scene = scripted_scene(TEXT, &[("mirror", mirror), ("odd", odd)]);
    let layers = [Layer::Rgba, Layer::Color, Layer::Line, Layer::Below, Layer::Normal, Layer::Feature];
    super::not_finite(&render_with(&scene, &layers, &RenderOptions { threads: 1, ..RenderOptions::default() }).0)
}

/// Each value in each output, at the hits of the upper half of the ball.
fn any_output() -> f64 {
    let mut scripts = Vec::new();
    for value in VALUES {
        let numbers = NUMBERS.iter().chain(&LINES).map(|output| (output, "v".to_owned()));
        let colors = COLORS.iter().map(|output| (output, "rgb(v, 0.5, v)".to_owned()));
        for (output, value_of) in numbers.chain(colors) {
            let base = if *output == "ior" { "transmission: 1.0, roughness: 0.0, " } else { "" };
            scripts.push(format!(
                "let v = if hit.position.y > 0.0 {{ {value} }} else {{ 0.5 }}; #{{ {base}{output}: {value_of} }}"
            ));
        }
        scripts.push(format!("#{{ normal: vec3({value}, hit.normal.y, {value}) }}"));
    }
    scripts.par_iter().map(|script| faults(script)).sum::<usize>() as f64
}

fn in_a_mirror() -> f64 {
    faults(
        "let v = if hit.position.x > 0.0 { 0.0 / 0.0 } else { 1e38 }; #{ emission: rgb(v, v, v), color: rgb(1.0, v, v) }",
    ) as f64
}
