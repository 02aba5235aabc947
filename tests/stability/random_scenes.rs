//! Valid scenes at random: never a panic, never a NaN, and the same bits for any tiles and threads.

use std::fmt::Write;

use rayon::prelude::*;
use tusche::film::Layer;
use tusche::line::Method;
use tusche::render::RenderOptions;

use super::{Case, count_from};
use crate::common::{render_with, scripted_scene};

pub const CASES: &[Case] = &[Case {
    name: "random valid scenes, each with two tile sizes, thread counts and searches",
    wrong: "whatever nobody thought of",
    unit: "values not finite or not the same",
    bound: 0.0,
    figure: || {
        let scenes = count_from("TUSCHE_SCENES", 24);
        (1..=scenes).into_par_iter().map(faults).sum::<usize>() as f64
    },
}];

/// Numbers from a seed.
struct Dice(u64);

impl Dice {
    fn below(&mut self, count: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % count
    }

    fn any<'a>(&mut self, of: &[&'a str]) -> &'a str {
        of[self.below(of.len())]
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.below(1 << 20) as f64 / f64::from(1 << 20)
    }

    fn vector(&mut self, reach: f64) -> String {
        let [x, y, z] = [0; 3].map(|_| self.between(-reach, reach));
        format!("[{x:.4}, {y:.4}, {z:.4}]")
    }
}

const SCRIPTS: [&str; 8] = [
    "#{}",
    "#{ color: hit.normal * 0.5 + 0.5, feature: gray(step(0.0, hit.position.x)) }",
    "#{ metallic: 1.0, roughness: 0.0, base_color: rgb(0.9, 0.8, 0.7) }",
    "#{ roughness: 0.0, transmission: 1.0, ior: 1.0 + hit.uv.x }",
    "#{ opacity: hit.uv.y, line_width: 6.0 * hit.uv.x }",
    "#{ emission: rgb(1.0, 1.0, 1.0) / (hit.uv.x - 0.5), line_width: 1.0 / hit.uv.y }",
    "#{ base_color: hit.irradiance, priority: 3, line_color: rgb(1.0, 0.0, 0.0) }",
    "#{ roughness: 0.3, opacity: if hit.front_facing { 1.0 } else { 0.0 }, line_opacity: 0.5 }",
];

fn scene(dice: &mut Dice) -> String {
    let mut text = format!(
        "[render]\nsize = [{}, {}]\nsamples = {}\nfilter = \"{}\"\nfilter_radius = {:.3}\nreflection_depth = {}\n\
         refraction_depth = {}\nseed = {}\n",
        1 + dice.below(36),
        1 + dice.below(28),
        [1, 2, 3, 4, 9][dice.below(5)],
        dice.any(&["box", "tent", "gaussian", "mitchell", "blackman-harris"]),
        dice.between(0.1, 3.0),
        dice.below(5),
        dice.below(5),
        dice.below(1000),
    );
    let background = dice.any(&["\"transparent\"", "[0.2, 0.4, 0.9]", "{ bottom = [0, 0, 0], top = [1, 1, 1] }"]);
    let camera = dice.any(&["fov = 40.0", "fov = 170.0", "fov = 1.0", "projection = \"orthographic\"\nheight = 3.0"]);
    let position = dice.vector(4.0);
    let _ = write!(
        text,
        "background = {background}\n[camera]\nposition = {position}\ntarget = [0.01, 0.02, 0.03]\nup = [0.1, 1.0, 0.2]\n{camera}\n"
    );
    let _ = write!(text, "[lines]\nwidth = {:.3}\nsurfaces = {}\n", dice.between(0.0, 6.0), 1 + dice.below(3));
    for test in
        ["uv = 0.1", "normal = 20.0", "feature = 0.05", "overlap = 2.0", "object = false", "compose = \"throughput\""]
    {
        if dice.below(2) == 0 {
            text += test;
            text += "\n";
        }
    }
    for _ in 0..dice.below(3) {
        let lamp =
            dice.any(&["kind = \"sun\"\ndirection = [0.3, -1.0, 0.2]", "kind = \"point\"\nposition = [1, 3, 2]"]);
        let _ = write!(text, "[[lights]]\n{lamp}\n");
    }
    for number in 0..1 + dice.below(7) {
        let shape = dice.any(&["sphere", "box", "plane", "cylinder", "cone", "torus", "disc", "capsule"]);
        let segments = if matches!(shape, "box" | "plane") { 1 + dice.below(3) } else { 3 + dice.below(40) };
        let scale = 10_f64.powf(dice.between(-3.0, 1.5)) * if dice.below(4) == 0 { -1.0 } else { 1.0 };
        // Some share a place and a plane with others.
        let translate = if dice.below(3) == 0 { "[0.0, 0.0, 0.0]".to_owned() } else { dice.vector(1.5) };
        let rotate = if dice.below(3) == 0 { "[0.0, 0.0, 0.0]".to_owned() } else { dice.vector(180.0) };
        let scale = if dice.below(2) == 0 { 1.0 } else { scale };
        let _ = write!(
            text,
            "[[objects]]\nname = \"o{number}\"\nshape = \"{shape}\"\nsegments = {segments}\nmaterial = \"m{}\"\n\
             translate = {translate}\nrotate = {rotate}\nscale = {scale:.6}\n",
            dice.below(3)
        );
        text +=
            dice.any(&["", "", "priority = 2\n", "group = \"g\"\n", "lines = false\n", "visible_to = [\"camera\"]\n"]);
    }
    text
}

/// How many values of a random scene are not finite, or differ with tiles, threads or the search.
fn faults(seed: u64) -> usize {
    let mut dice = Dice(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
    let text = scene(&mut dice);
    let materials = ["m0", "m1", "m2"].map(|name| (name, SCRIPTS[dice.below(SCRIPTS.len())]));
    let scene = scripted_scene(&text, &materials);
    let layers = [Layer::Rgba, Layer::Color, Layer::Line, Layer::Below, Layer::Normal, Layer::Object];
    let draw = |threads, tile, method| {
        render_with(&scene, &layers, &RenderOptions { threads, tile, method, ..RenderOptions::default() }).0
    };
    let usual = draw(1, 32, Method::Exact);
    let other = draw(2, 1 + dice.below(20) as u32, Method::Brute);
    let found = super::not_finite(&usual) + super::differing(&usual, &other, 0.0);
    if found > 0 {
        println!("{found} faults in random scene {seed}: {materials:?}\n{text}");
    }
    found
}
