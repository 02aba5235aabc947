//! `tusche why`: exact texts, agreement with the picture, and what it says to questions without an answer.

use tusche::film::Layer;
use tusche::render::why::{Explanation, Reason, StyledBy, why};
use tusche::scene::Scene;
use tusche::shade::{Host, Shaders};

use crate::common::{Workplace, golden, render_with, root, scene_from};

/// Two boxes, one before the other, a ball without lines, and a mirror below that shows the lower side of a torus.
const SCENE: &str = r#"
[render]
size = [48, 32]
samples = 4
filter = "box"
filter_radius = 0.5

[camera]
fov = 30.0
position = [0.0, 2.5, 9.0]
target = [0.0, 0.3, 0.0]

[lines]
width = 2.0
normal = 40.0
overlap = 2.0

[materials.red]
shader = "builtin:ink"
params = { ink = [0.8, 0.1, 0.1], ink_width = 3.0 }
lines = { normal = 20.0, shader = false }

[materials.blue]
shader = "builtin:ink"
params = { ink = [0.1, 0.1, 0.8], ink_width = 0.4 }
priority = 2

[materials.mirror]
shader = "builtin:mirror"

[[objects]]
name = "crate"
shape = "box"
material = "red"
rotate = [0, 35, 0]
translate = [-2.2, 0.3, 0.0]
scale = 0.8
group = "cargo"

[[objects]]
name = "lid"
shape = "box"
size = [2.4, 0.2, 2.4]
material = "red"
rotate = [0, 35, 0]
translate = [-2.2, 1.2, 0.0]
scale = 0.8
group = "cargo"

[[objects]]
name = "ball"
shape = "sphere"
material = "red"
translate = [0.3, 0.6, 1.0]
scale = 0.8
lines = false

[[objects]]
name = "tower"
shape = "box"
size = [0.8, 3, 0.8]
material = "blue"
translate = [0.9, 1.0, -1.0]

[[objects]]
name = "ring"
shape = "torus"
material = "red"
rotate = [60, 0, 0]
translate = [2.7, 1.1, 0.0]

[[objects]]
name = "floor"
shape = "plane"
size = 9
material = "mirror"
translate = [0, -0.6, 0]
lines = false
"#;

fn compiled(text: &str) -> (Scene, Shaders) {
    let scene = scene_from(text);
    let (shaders, _) = Shaders::compile(&scene, &Host::new()).unwrap_or_else(|faults| panic!("{faults}"));
    (scene, shaders)
}

fn explain(scene: &(Scene, Shaders), place: [f32; 2]) -> Explanation {
    let (explanation, errors) = why(&scene.0, &scene.1, place).unwrap_or_else(|fault| panic!("{fault}"));
    assert!(errors.is_empty(), "{errors}");
    explanation
}

/// The first pixel whose middle sample is explained like this, row by row.
fn find(scene: &(Scene, Shaders), is_meant: impl Fn(&Explanation) -> bool) -> Explanation {
    let [width, height] = scene.0.render().size;
    let places = (0..height).flat_map(|y| (0..width).map(move |x| [x as f32 + 0.5, y as f32 + 0.5]));
    places.map(|place| explain(scene, place)).find(is_meant).expect("the scene has such a place")
}

fn object(seen: &tusche::render::why::Seen) -> Option<&str> {
    seen.surface.as_ref().map(|surface| surface.object.as_str())
}

#[test]
fn explanations_read_as_recorded() {
    let scene = compiled(SCENE);
    let kind = |explanation: &Explanation| explanation.line.as_ref().map(|line| line.kind);
    let pair = |explanation: &Explanation, is_meant: &dyn Fn(&tusche::render::why::Pair) -> bool| {
        explanation.pair.as_ref().is_some_and(is_meant)
    };
    type IsMeant<'a> = &'a dyn Fn(&Explanation) -> bool;
    let cases: [(&str, IsMeant<'_>); 9] = [
        ("outline", &|e| kind(e) == Some("outline") && pair(e, &|p| p.styled_by == StyledBy::Neighbor)),
        ("crease", &|e| kind(e) == Some("crease") && pair(e, &|p| object(&p.here) == Some("crate"))),
        ("priority", &|e| kind(e) == Some("silhouette") && pair(e, &|p| p.reason == Reason::Priority)),
        ("depth", &|e| kind(e) == Some("silhouette") && pair(e, &|p| p.reason == Reason::Depth)),
        ("overlap", &|e| kind(e) == Some("overlap") && pair(e, &|p| object(&p.here) == Some("ring"))),
        ("reflection", &|e| kind(e).is_some() && pair(e, &|p| p.path == "R" && p.reason == Reason::Background)),
        ("no_line_too_far", &|e| e.line.is_none() && pair(e, &|p| p.radius > 0.0 && p.distance > p.radius)),
        ("no_line_of_the_object", &|e| e.line.is_none() && pair(e, &|p| p.radius == 0.0 && p.distance < 1.0)),
        ("nothing_near", &|e| e.line.is_none() && e.pair.is_none()),
    ];
    let mut blessed = Vec::new();
    for (name, is_meant) in cases {
        let text = find(&scene, is_meant).to_string();
        let path = root().join(format!("tests/golden/why/{name}.txt"));
        if std::env::var_os("TUSCHE_BLESS").is_some() {
            std::fs::write(&path, &text).expect("golden files can be written");
            blessed.push(name);
        } else {
            golden(&path, &text);
        }
    }
    assert!(blessed.is_empty(), "blessed {blessed:?}: look at the changes and run again without TUSCHE_BLESS");
}

#[test]
fn it_counts_the_samples_that_the_picture_shows() {
    // Opaque lines of every kind, so that a pixel's share of lined samples is its alpha.
    let text = SCENE.replace("ink_width = 0.4", "ink_width = 1.5");
    let scene = compiled(&text);
    let (picture, _) = render_with(&scene.0, &[Layer::Line], &Default::default());
    let mut lined = 0;
    for (x, y) in (0..picture.height).step_by(3).flat_map(|y| (0..picture.width).map(move |x| (x, y))) {
        let explanation = explain(&scene, [x as f32 + 0.5, y as f32 + 0.5]);
        let share = explanation.lined as f32 / explanation.samples as f32;
        assert!((share - picture.at(3, x, y)).abs() < 1e-3, "{x}, {y}: {share}, not {}", picture.at(3, x, y));
        lined += explanation.lined;
    }
    assert!(lined > 200, "{lined}");
}

#[test]
fn the_sample_nearest_to_the_place_is_explained() {
    let scene = compiled(SCENE);
    let mut numbers = Vec::new();
    for [x, y] in [[0.1, 0.1], [0.9, 0.1], [0.1, 0.9], [0.9, 0.9]] {
        let explanation = explain(&scene, [20.0 + x, 11.0 + y]);
        assert_eq!(explanation.pixel, [20, 11]);
        let [px, py] = explanation.sample.place;
        assert!((px - 20.0 - x).abs() < 0.6 && (py - 11.0 - y).abs() < 0.6, "{explanation}");
        numbers.push(explanation.sample.number);
    }
    numbers.sort_unstable();
    numbers.dedup();
    assert!(numbers.len() > 2, "the corners have samples of their own: {numbers:?}");
}

fn place() -> Workplace {
    let place = Workplace::new();
    place.file("scene.toml", SCENE);
    place
}

#[test]
fn the_command_prints_text_or_json() {
    let place = place();
    let text = place.run(&["why", "scene.toml", "20,11"]).exits(0).stdout();
    assert_eq!(text, explain(&compiled(SCENE), [20.5, 11.5]).to_string());
    let json = place.run(&["why", "scene.toml", "20.25,11.75", "--json"]).exits(0).stdout();
    let json: serde_json::Value = serde_json::from_str(&json).expect("it is JSON");
    assert_eq!(json["pixel"], serde_json::json!([20, 11]));
    assert_eq!(json["samples"], 4);
    for path in ["/lined", "/sample/number", "/sample/place/1", "/reach", "/line", "/pair"] {
        assert!(json.pointer(path).is_some(), "{path} is missing in {json:#}");
    }
    // The flags of a render count: half the size has other pixels, and other samples.
    let half = place.run(&["why", "scene.toml", "20,11", "--size", "24x16", "--samples", "9"]).exits(0).stdout();
    assert!(half.starts_with("pixel 20, 11: ") && half.contains("of 9 samples"), "{half}");
    let wide = place.run(&["why", "scene.toml", "0,0", "--set", "lines.max_width=3"]).exits(0).stdout();
    assert!(wide.contains("within 2 px"), "{wide}");
}

#[test]
fn questions_without_an_answer_are_told_why() {
    let place = place();
    place
        .run(&["why", "scene.toml", "48,3"])
        .exits(2)
        .says("the place 48.5, 3.5 lies outside the picture")
        .says("48 x 32");
    place.run(&["why", "scene.toml", "3,32.0"]).exits(2).says("y is 0 (top) to below 32");
    for (typed, said) in [
        ("12", "write it as X,Y, for example 320,200"),
        ("12,", "`` is not a number of pixels"),
        ("a,3", "`a` is not a number of pixels"),
        ("nan,3", "`nan` is not a number of pixels"),
        ("1,2,3", "`2,3` is not a number of pixels"),
    ] {
        place.run(&["why", "scene.toml", typed]).exits(2).says(said);
    }
    place.run(&["why", "scene.toml"]).exits(2).says("<X,Y>");
    place.run(&["why", "gone.toml", "1,1"]).exits(1).says("gone.toml");
    for off in [["--set", "lines.max_width=0"], ["--set", "lines.paths=[]"]] {
        let run = place.run(&["why", "scene.toml", "1,1", off[0], off[1]]).exits(1);
        run.says("no line can be seen in this scene").says("tusche explain");
    }
    place.run(&["why", "scene.toml", "1,1", "--lines", "off"]).exits(2).says("leave out --lines");
    place.run(&["why", "scene.toml", "1,1", "--lines", "bauer"]).exits(2).says("leave out --lines");
    place.run(&["why", "scene.toml", "1,1", "-o", "a.png"]).exits(2).says("makes no picture");
    place.run(&["why", "scene.toml", "1,1", "--camera", "left"]).exits(1).says("no camera named `left`");
    // It makes no files, whatever it is asked.
    assert_eq!(std::fs::read_dir(place.folder.path()).expect("it can be listed").count(), 1);
}

#[test]
fn scripts_that_fail_are_told() {
    let place = Workplace::new();
    place.file("scene.toml", SCENE.replace("builtin:mirror", "bad.rhai"));
    place.file("bad.rhai", "fn surface(hit, p) { let a = [1.0]; #{ base_color: gray(a[hit.polygon_id + 5]) } }");
    place.run(&["why", "scene.toml", "24,29"]).exits(1).says("bad.rhai");
}
