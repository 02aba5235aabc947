//! `--set PATH=VALUE`.

use tusche::math::{DVec3, Vec3};
use tusche::scene::file::{LoadOptions, Override};
use tusche::scene::material::ParamValue;

use super::load_with;

const SCENE: &str = r#"
[materials."my ink"]
shader = "ink.rhai"

[[objects]]
name = "big ball"
shape = "sphere"
material = "my ink"

[[objects]]
shape = "box"
"#;

fn with(overrides: &[&str]) -> tusche::scene::SceneBuilder {
    let (builder, warnings) = load_with(SCENE, overrides, &LoadOptions::default()).unwrap();
    assert!(warnings.is_empty(), "{warnings}");
    builder
}

#[test]
fn values_replace_and_tables_are_made() {
    let scene = with(&[
        "lines.width=3",
        "render.size=[64, 32]",
        "lines.color = [1, 0, 0]",
        "objects.\"big ball\".priority=2",
        "objects.1.translate=[0, 1, 0]",
        "materials.\"my ink\".params.width=2.5",
        "materials.\"my ink\".params.mode=wet ink",
        "materials.new.shader=builtin:default",
        "objects.1.material=\"new\"",
        "camera={position=[0,0,9], fov=20}",
    ]);
    assert_eq!(scene.lines.width, 3.0);
    assert_eq!(scene.lines.color, Vec3::X);
    assert_eq!(scene.render.size, [64, 32]);
    assert_eq!(scene.objects[0].priority, Some(2));
    assert_eq!(scene.objects[1].world_from_object.translation, DVec3::Y);
    assert_eq!(scene.materials[0].params["width"].0, ParamValue::Float(2.5));
    assert_eq!(scene.materials[0].params["mode"].0, ParamValue::Text("wet ink".to_owned()));
    assert_eq!(scene.materials[scene.objects[1].materials[0].index()].name, "new");
    assert_eq!(scene.cameras[0].position, DVec3::Z * 9.0);
}

#[test]
fn the_last_of_two_wins() {
    assert_eq!(with(&["lines.width=3", "lines.width=5"]).lines.width, 5.0);
}

#[test]
fn a_value_knows_that_it_was_typed() {
    let scene = with(&["materials.\"my ink\".params.width=2.5"]);
    let span = scene.materials[0].params["width"].1.as_ref().unwrap();
    assert_eq!(span.source.name, "--set materials.\"my ink\".params.width=2.5");
    assert_eq!(&span.source.text[span.range.clone()], "2.5");
}

#[test]
fn quoted_parts_may_contain_anything() {
    let scene = with(&["materials.\"a=b.c\".shader=ink.rhai"]);
    assert_eq!(scene.materials[1].name, "a=b.c");
}

#[test]
fn what_cannot_be_read_says_why() {
    for (text, message) in [
        ("lines.width", "an override needs a path and a value (for example: --set lines.width=3)"),
        ("", "an override needs a path and a value (for example: --set lines.width=3)"),
        (
            "=3",
            "what stands before `=` is not a path into the scene file (put parts with spaces or other special characters in quotes: objects.\"big ball\".priority=1)",
        ),
        (
            "big ball=3",
            "what stands before `=` is not a path into the scene file (put parts with spaces or other special characters in quotes: objects.\"big ball\".priority=1)",
        ),
        ("lines.width=", "there is no value after `=`"),
        ("lines.width=  ", "there is no value after `=`"),
    ] {
        let faults = Override::parse(text).unwrap_err();
        assert_eq!(faults.to_string(), format!("--set {text}:1:1: error: {message}"));
    }
    for (text, column) in [
        ("render.size=[64, 32", 20),
        ("render.size=[64 32]", 14),
        ("objects.0.name=\"ball", 21),
        ("lines.width=1.2.3", 16),
    ] {
        let faults = Override::parse(text).unwrap_err();
        let place = format!("--set {text}:1:{column}: error: this is not valid TOML: ");
        assert!(faults.to_string().starts_with(&place), "{faults}");
    }
}

#[test]
fn elements_that_are_not_there_are_not_made() {
    let said = |text: &str| {
        let faults = load_with(SCENE, &[text], &LoadOptions::default()).unwrap_err();
        assert_eq!(faults.0.len(), 1, "{faults}");
        faults.0[0].message.clone()
    };
    assert_eq!(said("objects.2.priority=1"), "`objects` has no number 2");
    assert_eq!(said("objects.box.priority=1"), "`objects` has no element named `box`");
    assert_eq!(said("lights.0.strength=1"), "the scene has no lights");
    assert_eq!(said("objects.0.shape.x=1"), "`objects.0.shape` is a plain value: it has no `x`");
}
