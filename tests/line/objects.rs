//! What objects and materials change about lines: groups, `lines = false`, and tests of their own.

use tusche::film::Layer;
use tusche::line::{Fired, LineType, Method, Rules};
use tusche::plan::Plan;
use tusche::render::{RenderOptions, Report};
use tusche::sample::{Node, PixelRect};
use tusche::scene::settings::{LineOverrides, LineSettings};
use tusche::shade::{Host, Shaders};

use super::picture::{Tiles, layout, sampled};
use crate::common::{Picture, render_text, render_with, scene_from};

/// Boxes of 2 x 2 in a picture of 64 x 32 pixels that shows 8 x 4 units; each a line of keys of its own.
fn boxes(lines: &str, objects: &[&str]) -> String {
    let mut text = format!(
        "[render]\nsize = [64, 32]\nsamples = 4\nfilter = \"box\"\nfilter_radius = 0.5\n[camera]\n\
         projection = \"orthographic\"\nheight = 4\nposition = [0, 0, 9]\n[lines]\nwidth = 2\n{lines}\n\
         [materials.a]\nshader = \"builtin:ink\"\n[materials.b]\nshader = \"builtin:ink\"\n"
    );
    for object in objects {
        text += &format!("[[objects]]\nshape = \"box\"\n{object}\n");
    }
    text
}

/// The line's alpha left and right of the middle of the picture.
fn at_border(picture: &Picture) -> [f32; 2] {
    [31, 32].map(|x| picture.at(3, x, 16))
}

const LEFT: &str = "material = \"a\"\ntranslate = [-1, 0, 0]";
const RIGHT: &str = "material = \"a\"\ntranslate = [1, 0, -3]";

#[test]
fn objects_of_a_group_have_no_line_between_them() {
    let layers = [Layer::Line, Layer::Object, Layer::LineType(LineType::Outline)];
    let draw = |left: &str, right: &str, lines: &str| -> (Picture, Report) {
        render_text(&boxes(lines, &[&format!("{LEFT}\n{left}"), &format!("{RIGHT}\n{right}")]), &layers)
    };
    let (apart, _) = draw("", "", "");
    assert_eq!(at_border(&apart), [1.0; 2]);
    let (grouped, _) = draw("group = \"car\"", "group = \"car\"", "");
    assert_eq!(at_border(&grouped), [0.0; 2]);
    // Their outline stays, and the object layer still knows them.
    assert_eq!(grouped.at(3, 16, 8), 1.0, "the upper edge of the left box");
    assert_eq!(grouped.channels[4], apart.channels[4], "object ids");
    assert_eq!([8, 40].map(|x| grouped.at(4, x + 8, 16).to_bits()), [1, 2]);
    for (left, right) in [("group = \"car\"", "group = \"bus\""), ("group = \"car\"", "")] {
        assert_eq!(draw(left, right, "").0.bits(), apart.bits(), "{left} and {right}");
    }
    // Materials are compared all the same.
    let right = RIGHT.replace("\"a\"", "\"b\"");
    let two = boxes("", &[&format!("{LEFT}\ngroup = \"car\""), &format!("{right}\ngroup = \"car\"")]);
    let (two, _) = render_text(&two, &[Layer::Line, Layer::LineType(LineType::Material)]);
    assert_eq!(at_border(&two), [1.0; 2]);
    assert_eq!([31, 32].map(|x| two.at(7, x, 16)), [1.0; 2]);
}

#[test]
fn groups_cost_nothing_where_there_are_none_and_a_column_only_where_ids_are_asked_for() {
    let plan = |groups: [&str; 2], layers: &[Layer]| {
        let objects = [format!("{LEFT}\n{}", groups[0]), format!("{RIGHT}\n{}", groups[1])];
        let scene = scene_from(&boxes("", &[&objects[0], &objects[1]]));
        let (shaders, _) = Shaders::compile(&scene, &Host::new()).expect("ink compiles");
        let plan = Plan::new(&scene, &shaders, layers);
        (plan.layout.columns.member, plan.to_string().contains("groups"))
    };
    let car = "group = \"car\"";
    assert_eq!(plan(["", ""], &[Layer::Rgba, Layer::Object]), (false, false));
    assert_eq!(plan([car, ""], &[Layer::Rgba, Layer::Object]), (false, false), "a group of one");
    assert_eq!(plan([car, car], &[Layer::Rgba]), (false, true));
    assert_eq!(plan([car, car], &[Layer::Rgba, Layer::Object]), (true, true));
}

/// Two parts of a group, one before the other: with the overlap test the jump between them is a fold of the group.
#[test]
fn a_group_folds_over_itself() {
    let (left, right) = (format!("{LEFT}\ngroup = \"car\""), format!("{RIGHT}\ngroup = \"car\""));
    let text = boxes("overlap = 2.0", &[&left, &right]);
    let (picture, _) = render_text(&text, &[Layer::Line, Layer::LineType(LineType::Overlap)]);
    assert_eq!(at_border(&picture), [1.0; 2]);
    assert_eq!([31, 32].map(|x| picture.at(7, x, 16)), [1.0; 2]);
}

/// The left box is in front: it styles the line at their border.
#[test]
fn an_object_without_lines_draws_none_and_hides_none_that_outranks_it() {
    let draw = |left: &str, right: &str| {
        let text = boxes("normal = 30.0", &[&format!("{LEFT}\n{left}"), &format!("{RIGHT}\n{right}")]);
        render_text(&text, &[Layer::Line]).0
    };
    let off = "lines = false";
    assert_eq!(at_border(&draw("", "")), [1.0; 2]);
    // The border belongs to the one in front, whatever the other does.
    assert_eq!(at_border(&draw(off, "")), [0.0; 2]);
    assert_eq!(at_border(&draw("", off)), [1.0; 2]);
    assert_eq!(at_border(&draw(off, off)), [0.0; 2]);
    assert_eq!(draw(off, off).mean(3), 0.0, "nothing at all");
    // Unless the other outranks it.
    assert_eq!(at_border(&draw(off, "priority = 1")), [1.0; 2]);
    assert_eq!(at_border(&draw("priority = 1\nlines = false", "")), [0.0; 2]);
    // Its outline is gone, the other's is not.
    let half = draw(off, "");
    assert_eq!([16, 48].map(|x| half.at(3, x, 8)), [0.0, 1.0]);
    // A script's width does not bring it back.
    let wide = boxes("", &[&format!("{LEFT}\nlines = false")]).replace(
        "[materials.a]\nshader = \"builtin:ink\"",
        "[materials.a]\nshader = \"builtin:ink\"\nparams = { ink_width = 8.0 }",
    );
    assert_eq!(render_text(&wide, &[Layer::Line]).0.mean(3), 0.0);
}

/// Left of 0 a node of material 1, right of it one of material 2 behind it; both with `change`.
fn lined(settings: &LineSettings, overrides: &[LineOverrides], change: impl Fn(Node) -> Node) -> Vec<Fired> {
    let node = |[x, _]: [f32; 2]| {
        let (object, depth, normal) = if x < 0.0 { (1, 1.0, [0.0, 0.0, 1.0]) } else { (2, 2.0, [0.6, 0.0, 0.8]) };
        change(Node { object, shader: object, depth, normal, line_width: 2.0, priority: 0, ..Node::default() })
    };
    let rules = Rules::new(settings, 4).with_materials(overrides);
    let layout = layout(4, 8.0);
    let rect = PixelRect { x0: -4, y0: 0, x1: 4, y1: 4 };
    let tiles = Tiles::new(rect, 3, &rules, |tile| sampled(tile, &layout, &node));
    let found = |method| -> Vec<Fired> {
        tiles.lines(method).iter().flat_map(|lines| lines.lines.iter().map(|line| line.fired)).collect()
    };
    assert_eq!(found(Method::Exact), found(Method::Brute));
    found(Method::Exact)
}

#[test]
fn the_tests_of_the_priority_samples_material_decide() {
    let all_off = LineSettings { object: false, shader: false, ..Default::default() };
    let on = LineOverrides { object: Some(true), ..Default::default() };
    let same = |node| node;
    // Material 1 is in front.
    assert!(lined(&all_off, &[], same).is_empty());
    assert!(!lined(&all_off, &[on], same).is_empty());
    assert!(lined(&all_off, &[Default::default(), on], same).is_empty(), "the one behind has no say");
    // With a larger priority it has.
    let raised = |node: Node| Node { priority: node.object as i32, ..node };
    assert!(!lined(&all_off, &[Default::default(), on], raised).is_empty());
    assert!(lined(&all_off, &[on], raised).is_empty());
    // At equal ranks each target is tested by its own: one side of the border has a line.
    let level = |node| Node { depth: 1.0, ..node };
    let (one, both) = (lined(&all_off, &[on], level).len(), lined(&all_off, &[on, on], level).len());
    assert!(one > 0 && both > one, "{one} of {both}");

    // Thresholds, and tests that a material switches off. The normals are 36.87 degrees apart.
    let normal = |threshold: Option<f32>| LineOverrides { normal: Some(threshold), ..Default::default() };
    let creases = LineSettings { normal: Some(36.0), ..all_off.clone() };
    let fired = |overrides: &[LineOverrides]| lined(&creases, overrides, same).first().copied();
    assert_eq!(fired(&[]), Some(Fired::NORMAL));
    assert_eq!(fired(&[normal(Some(38.0))]), None);
    assert_eq!(fired(&[normal(None)]), None);
    assert_eq!(fired(&[normal(Some(10.0)), normal(None)]), Some(Fired::NORMAL));
    assert_eq!(fired(&[LineOverrides { shader: Some(true), ..normal(None) }]), Some(Fired::SHADER));
}

#[test]
fn materials_of_a_scene_have_their_own_creases() {
    let turned = |material: &str, x: f32| {
        format!("material = \"{material}\"\ntranslate = [{x:?}, 0, 0]\nrotate = [0, 45, 0]\nsize = [1.5, 2, 1.5]")
    };
    let draw = |lines: &str, of_b: &str| {
        let text = boxes(lines, &[&turned("a", -1.5), &turned("b", 1.5)]);
        let text = text.replace("[materials.b]\n", &format!("[materials.b]\nlines = {{ {of_b} }}\n"));
        let (picture, report) = render_text(&text, &[Layer::LineType(LineType::Crease)]);
        // The edge towards the viewer of each.
        ([20, 44].map(|x| picture.at(3, x, 16).max(picture.at(3, x - 1, 16)) > 0.5), report.stats.plan)
    };
    assert_eq!(draw("normal = 60.0", "").0, [true, true]);
    assert_eq!(draw("normal = 60.0", "normal = 100.0").0, [true, false]);
    assert_eq!(draw("normal = 60.0", "normal = false").0, [true, false]);
    let (creases, plan) = draw("", "normal = 60.0");
    assert_eq!(creases, [false, true]);
    assert!(
        plan.contains("where object, shader; for lines of b: object, shader, normal > 60 degrees differ"),
        "{plan}"
    );
    assert!(plan.lines().any(|line| line.starts_with("columns") && line.contains("normal")), "{plan}");
    // A test that nobody who draws reads needs no column.
    let (_, plan) = draw("", "normal = false");
    assert!(!plan.lines().any(|line| line.starts_with("columns") && line.contains("normal")), "{plan}");
}

#[test]
fn a_scene_with_all_of_it_is_brute_force_bit_by_bit() {
    let text = boxes(
        "normal = 20.0\noverlap = 3.0",
        &[
            "material = \"a\"\ntranslate = [-1, 0, 0]\nrotate = [10, 30, 0]\ngroup = \"car\"",
            "material = \"b\"\ntranslate = [1, 0.5, -1]\nrotate = [0, 30, 20]\ngroup = \"car\"",
            "material = \"b\"\ntranslate = [0.2, -1, 1]\nscale = 0.7\nlines = false",
        ],
    ) + "[[objects]]\nshape = \"knot\"\nmaterial = \"a\"\ntranslate = [-2.5, 0, 0]\n[[objects]]\nshape = \"torus\"\n\
         material = \"b\"\ntranslate = [2.5, -0.4, 0]\nrotate = [60, 0, 0]\n\
         [materials.b.lines]\nnormal = false\noverlap = 1.5\n";
    let scene = scene_from(&text.replace("samples = 4", "samples = 9"));
    let layers = [Layer::Rgba, Layer::LineType(LineType::Overlap), Layer::LineType(LineType::Crease), Layer::Object];
    let bits = |method, tile| {
        let options = RenderOptions { method, tile, ..RenderOptions::default() };
        render_with(&scene, &layers, &options).0
    };
    let expected = bits(Method::Brute, 32);
    assert!(expected.mean(7) > 0.01 && expected.mean(11) > 0.01, "both kinds of lines are there");
    for tile in [7, 32] {
        assert!(bits(Method::Exact, tile).bits() == expected.bits(), "tiles of {tile}");
    }
}
