//! Pictures of shaders on the stage.

use tusche::film::Picture;

use crate::common::Workplace;

/// Paint without light and black lines: two flat colours beside the grey of the stage.
const FLAT: &str = "fn params() { #{ paint: rgb(1.0, 0.0, 0.0) } }\n\
    fn surface(hit, p) { #{ color: p.paint, line_color: rgb(0, 0, 1), line_width: 3.0 } }\n";

fn shares(place: &Workplace, file: &str) -> [f64; 3] {
    let picture = Picture::read(&place.folder.path().join(file)).unwrap_or_else(|fault| panic!("{fault}"));
    let [r, g, b] = ["R", "G", "B"].map(|name| picture.channel(name).expect("it has colours"));
    let share = |is_it: &dyn Fn(f32, f32, f32) -> bool| {
        let count = r.iter().zip(g).zip(b).filter(|((r, g), b)| is_it(**r, **g, **b)).count();
        count as f64 / r.len() as f64
    };
    [
        share(&|r, g, b| r > 0.8 && g < 0.1 && b < 0.1),
        share(&|r, g, b| r < 0.4 && g < 0.1 && b > 0.5),
        share(&|r, g, b| (r - g).abs() < 0.2 && (g - b).abs() < 0.2),
    ]
}

#[test]
fn the_stage_shows_the_paint_its_lines_and_the_ground() {
    let place = Workplace::new();
    place.file("flat.rhai", FLAT);
    let run = place.run(&["shader", "preview", "flat.rhai", "-o", "ball.png", "--size", "160x100", "--samples", "4"]);
    run.exits(0).says("wrote ball.png");
    let [paint, lines, ground] = shares(&place, "ball.png");
    assert!((0.1..0.4).contains(&paint), "{paint} of the picture is paint");
    assert!((0.02..0.2).contains(&lines), "{lines} of the picture is lines");
    assert!(ground > 0.4, "{ground} of the picture is ground");

    let set = ["--set", "paint=[0,0,1]", "--quiet"];
    let small = ["shader", "preview", "flat.rhai", "--size", "160x100", "--samples", "1"];
    let run = place.run(&[&small[..], &set].concat()).exits(0);
    assert_eq!((run.stdout(), run.stderr()), (String::new(), String::new()));
    assert_eq!(shares(&place, "flat.png")[0], 0.0, "the parameter has changed the paint");
}

#[test]
fn several_shaders_have_pictures_of_their_own() {
    let place = Workplace::new();
    place.file("a.rhai", FLAT);
    place.file("b.rhai", "fn surface(hit, p) { #{ bas_color: 1.0 } }");
    let small = ["--size", "16x10", "--samples", "1"];
    let preview = |arguments: &[&str]| place.run(&[&["shader", "preview"], arguments, &small].concat());
    let exists = |name: &str| place.folder.path().join(name).exists();
    preview(&["a.rhai", "b.rhai", "builtin:ink"]).exits(1).says("bas_color").says("wrote a.png").says("wrote ink.png");
    assert!(exists("a.png") && !exists("b.png") && exists("ink.png"));
    preview(&["a.rhai", "builtin:ink", "-o", "c.png"]).exits(2);
    preview(&["a.rhai", "./a.rhai"]).exits(2).says("a.png");
    preview(&["a.rhai", "-o", "c.jpg"]).exits(1).says("c.jpg");
    preview(&["a.rhai", "-o", "no/such/c.png"]).exits(1).says("no/such");
    preview(&["gone.rhai"]).exits(1).says("gone.rhai").says("no such file");
    preview(&["a.rhai", "--set", "paint=red"]).exits(1).says("--set paint=red").says("`paint` must be");
    preview(&["a.rhai", "--samples", "0"]).exits(2);
    preview(&["a.rhai", "--size", "0x4"]).exits(2);
    assert!(!exists("c.png") && !exists("gone.png"));
}

#[test]
fn a_shader_that_fails_at_some_hits_is_shown_all_the_same() {
    let place = Workplace::new();
    let script = "fn surface(hit, p) { let a = [1.0]; #{ color: gray(a[if hit.uv.x > 0.5 { 1 } else { 0 }]) } }";
    place.file("a.rhai", script);
    let run = place.run(&["shader", "preview", "a.rhai", "--size", "32x20", "--samples", "1"]);
    run.exits(1).says("a.rhai:1:").says("index 1 is out of range").says("wrote a.png");
}

#[test]
fn all_shipped_shaders_can_be_shown() {
    let place = Workplace::new();
    let names: Vec<String> = tusche::shade::builtin::names().iter().map(|name| format!("builtin:{name}")).collect();
    let mut arguments = vec!["shader", "preview", "--size", "24x15", "--samples", "1"];
    arguments.extend(names.iter().map(String::as_str));
    place.run(&arguments).exits(0);
    for name in tusche::shade::builtin::names() {
        assert!(place.folder.path().join(format!("{name}.png")).exists(), "{name}");
    }
}
