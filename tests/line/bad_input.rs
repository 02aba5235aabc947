//! Line settings and widths that nobody means, and pictures at the ends of what is possible: each has a message (see also
//! `tests/golden/scene_file`) or a safe result.

use tusche::film::Layer;
use tusche::line::{LineType, Method};
use tusche::math::{DAffine3, DVec3, Vec3};
use tusche::render::RenderOptions;
use tusche::scene::Object;
use tusche::scene::mesh::Mesh;
use tusche::scene::settings::RayKinds;

use crate::common::{Picture, Workplace, load, render_text, render_with, scene_from};

fn ball(lines: &str, script: &str) -> String {
    format!(
        "[render]\nsize = [40, 30]\nsamples = 4\n[camera]\nposition = [0, 0, 5]\n[lines]\n{lines}\n\
         [materials.ink]\nshader = \"builtin:ink\"\n{script}\n[[objects]]\nshape = \"sphere\"\nmaterial = \"ink\"\n"
    )
}

fn lines_of(text: &str) -> Picture {
    render_text(text, &[Layer::Line]).0
}

/// The command's picture of the ball with a script that asks for this width, and what it says.
fn with_script_width(width: &str) -> (Vec<u8>, String) {
    let place = Workplace::new();
    let scene = ball("", "").replace("builtin:ink", "ink.rhai");
    place.file("scene.toml", scene);
    place.file("ink.rhai", format!("fn surface(hit, p) {{ #{{ color: rgb(1.0, 1.0, 1.0), line_width: {width} }} }}"));
    let run = place.run(&["render", "scene.toml", "-o", "a.png"]).exits(0);
    (std::fs::read(place.folder.path().join("a.png")).expect("it is written"), run.stderr())
}

#[test]
fn widths_of_scripts_that_are_none_draw_nothing_and_are_told() {
    let (nothing, said) = with_script_width("0.0");
    assert!(!said.contains("warning"), "{said}");
    for (width, what) in [
        ("(hit.distance - hit.distance) / 0.0", "NaN"),
        ("hit.distance / 0.0", "an infinite number"),
        ("-hit.distance", "a negative line width"),
        ("-3.0", "a negative line width"),
    ] {
        let (picture, said) = with_script_width(width);
        assert!(picture == nothing, "{width} draws something");
        assert!(said.contains(&format!("the shader of material `ink` gave {what} at ")), "{width}: {said}");
    }
}

#[test]
fn widths_of_scripts_that_are_huge_are_clamped_and_told() {
    let (widest, said) = with_script_width("8.0");
    assert!(!said.contains("warning"), "{said}");
    let (picture, said) = with_script_width("1e9 + hit.distance");
    assert!(picture == widest, "not as wide as `max_width`");
    assert!(said.contains("gave a line wider than max_width (8 px) at "), "{said}");
}

#[test]
fn a_largest_width_of_0_means_no_lines() {
    let none = lines_of(&ball("max_width = 0", ""));
    assert_eq!(none.mean(3), 0.0);
    let place = Workplace::new();
    place.file("scene.toml", ball("width = 3", ""));
    let run = place.run(&["render", "scene.toml", "--set", "lines.max_width=0", "-o", "a.png"]).exits(0);
    assert!(run.stderr().contains("no lines are drawn: `max_width` is 0"), "{}", run.stderr());
    place.run(&["render", "scene.toml", "--lines", "off", "-o", "b.png"]).exits(0);
    place.run(&["compare", "a.png", "b.png"]).exits(0);
    // Nor does a script bring them back.
    let script = "params = { ink_width = 5.0 }";
    assert_eq!(lines_of(&ball("max_width = 0\nwidth = 0\nmin_width = 0", script)).mean(3), 0.0);
}

#[test]
fn thresholds_at_their_ends() {
    let crease = |lines: &str, shape: &str| {
        let text = ball(lines, "").replace("sphere", shape).replace("[[objects]]", "[[objects]]\nrotate = [20, 30, 0]");
        render_text(&text, &[Layer::LineType(LineType::Crease)]).0.mean(3)
    };
    assert_eq!(crease("normal = 0", "plane"), 0.0, "equal normals are equal at 0 degrees");
    assert!(crease("normal = 0", "box") > 0.0);
    assert!(crease("normal = 0", "sphere") > crease("normal = 20", "sphere"), "any two normals of a ball differ");
    assert_eq!(crease("normal = 180", "box"), 0.0);
    assert!(crease("normal = 89.9", "box") > 0.0);
    // 0 is no way to switch a test off; these find what there is to find, which on one flat colour is nothing.
    let feature = |lines: &str| render_text(&ball(lines, ""), &[Layer::LineType(LineType::Feature)]).0.mean(3);
    assert_eq!(feature("feature = 0\noverlap = 0"), 0.0);
    let fault = load(&ball("normal = 181", "")).expect_err("it is no angle between normals").to_string();
    assert!(fault.contains("`lines.normal` is an angle of at most 180 degrees, found 181"), "{fault}");
}

/// Both methods, whatever the tile.
fn both_methods(text: &str) -> Picture {
    let scene = scene_from(text);
    let draw = |method, tile| {
        let options = RenderOptions { method, tile, ..RenderOptions::default() };
        render_with(&scene, &[Layer::Rgba, Layer::Line], &options).0
    };
    let expected = draw(Method::Brute, 32);
    for tile in [1, 5, 32] {
        assert!(draw(Method::Exact, tile).bits() == expected.bits(), "tiles of {tile}");
    }
    expected
}

#[test]
fn pictures_smaller_than_the_stencil() {
    let wide = "width = 64\nmax_width = 64";
    let script = "params = { ink_width = 64.0 }";
    for size in ["1, 1", "3, 2", "1, 9", "20, 1"] {
        let text = ball(wide, script).replace("40, 30", size);
        let picture = both_methods(&text);
        assert!(picture.channels.iter().flatten().all(|value| value.is_finite()), "{size}");
    }
    // All of a small picture lies within reach of the outline.
    assert_eq!(both_methods(&ball(wide, script).replace("40, 30", "12, 9")).mean(7), 1.0);
}

#[test]
fn one_sample_per_pixel() {
    let picture = both_methods(&ball("", "").replace("samples = 4", "samples = 1"));
    assert!(picture.mean(7) > 0.02, "the ball has an outline");
    // So few samples that the thinnest line falls between them, which is no fault.
    both_methods(&ball("width = 0.1", "params = { ink_width = 0.1 }").replace("samples = 4", "samples = 1"));
}

/// Quads beside each other whose ids are equal in their lower 16 bits.
#[test]
fn more_objects_than_16_bits_can_tell_apart() {
    const COUNT: u32 = 3 * 65_536 + 5;
    let text = ball("width = 1", "params = { ink_width = 1.0 }").replace(
        "[camera]\nposition = [0, 0, 5]",
        "[camera]\nprojection = \"orthographic\"\nheight = 3\nposition = [0, 0, 5]",
    );
    let mut builder = scene_from(&text).into_builder();
    let material = builder.objects[0].materials[0];
    builder.objects.clear();
    let corners = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]].map(|[x, y]| Vec3::new(x, y, 0.0));
    let quad = Mesh {
        name: "quad".into(),
        positions: corners.to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    };
    let mesh = builder.add_mesh(quad);
    // In view: four columns of ids that are equal but for the bits above the 16th, in three rows; the others lie aside.
    let in_view = |id: u32| (id % 65_536 < 3).then(|| (f64::from(id / 65_536) - 1.5, f64::from(id % 65_536) - 1.0));
    for id in 0..COUNT {
        let place = in_view(id).unwrap_or((f64::from(id % 300) + 50.0, f64::from(id / 300)));
        builder.add_object(Object {
            name: format!("quad {id}"),
            mesh,
            materials: vec![material],
            world_from_object: DAffine3::from_translation(DVec3::new(place.0, place.1, 0.0)),
            priority: None,
            visible_to: RayKinds::all(),
            lines: true,
            group: None,
            span: None,
        });
    }
    let scene = builder.build().expect("the objects are sound");
    let (picture, _) = render_with(&scene, &[Layer::Object, Layer::Line], &RenderOptions::default());
    for (column, row) in (0..4).flat_map(|column| (0..3).map(move |row| (column, row))) {
        let (x, y) = (column * 10 + 5, 25 - row * 10);
        assert_eq!(
            picture.at(0, x, y).to_bits(),
            1 + 65_536 * column as u32 + row as u32,
            "column {column}, row {row}"
        );
        assert_eq!(picture.at(4, x, y), 0.0, "no line within an object");
        if column > 0 {
            assert!(picture.at(4, column * 10, y) > 0.3, "a line left of column {column}, row {row}");
        }
    }
}
