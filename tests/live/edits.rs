//! Edits: shown without touching a file, and written back with comments and order kept.

use serde_json::json;
use tusche::live::News;
use tusche::live::edit::Edits;

use super::{SCENE, Watching, background, inked, is_near, options, paper, place};
use crate::common::{golden, root};

const WRITTEN: &str = r#"# Made by hand.
[render]            # the picture
size = [ 640,360 ]

# What draws a line.
[lines]
width=4.0   # thick
normal = 60
color = [
    0.1,    # red
    0.2,
    0.3,
]

[materials.ink]
shader = "ink.rhai"
params = { paper = [0.9, 0.8, 0.7], "my width" = 3.0, dots = 5 }   # warm

[materials."big ball"]
shader = "ball.rhai"

[[objects]]
name = "ball"       # the first
shape = "sphere"
material = "ink"

[[objects]]
name = "other"
shape = "box"
material = "big ball"

[[lights]]
kind = "sun"
"#;

fn path(text: &str) -> Vec<String> {
    text.split('/').map(str::to_owned).collect()
}

fn edits(list: &[(&str, serde_json::Value)]) -> Edits {
    let mut edits = Edits::default();
    for (at, value) in list {
        edits.set(path(at), value).expect("TOML has such values");
    }
    edits
}

fn all_kinds() -> Edits {
    edits(&[
        ("lines/width", json!(6)),
        ("lines/normal", json!(false)),
        ("lines/color", json!([0.5, 0, 1])),
        ("lines/uv", json!(0.25)),
        ("lines/paths", json!(["camera"])),
        ("lines/types/crease/width", json!(1.5)),
        ("lines/types/crease/color", json!([1, 0, 0])),
        ("lines/hidden/color", json!([0.5, 0.5, 0.5])),
        ("materials/ink/params/paper", json!([0.1, 0.2, 0.3])),
        ("materials/ink/params/my width", json!(2)),
        ("materials/ink/params/dots", json!(7)),
        ("materials/ink/params/fresh", json!(true)),
        ("materials/big ball/params/label", json!("a \"quoted\" text")),
        ("materials/big ball/lines/overlap", json!(2)),
        ("objects/other/translate", json!([1, 2.5, 3])),
        ("objects/0/priority", json!(2)),
        ("lights/0/strength", json!(2.5)),
    ])
}

#[test]
fn edits_are_written_into_a_file_that_stays_as_it_is_otherwise() {
    let written = all_kinds().written_into(WRITTEN).expect("all places are there");
    golden(&root().join("tests/golden/live/written_back.toml"), &written);
    // Writing the same again changes nothing, and nothing changes nothing.
    assert_eq!(all_kinds().written_into(&written).expect("all places are there"), written);
    assert_eq!(Edits::default().written_into(WRITTEN).expect("it is TOML"), WRITTEN);
}

#[test]
fn edits_are_copied_out_as_toml() {
    let edits = edits(&[
        ("lines/width", json!(6)),
        ("lines/types/crease/width", json!(1.5)),
        ("materials/ink/params/paper", json!([0.1, 0.2, 0.3])),
        ("materials/big ball/params/x", json!(1)),
        ("render/samples", json!(8)),
    ]);
    golden(&root().join("tests/golden/live/copied_out.toml"), &edits.toml());
}

#[test]
fn the_last_edit_of_a_path_counts() {
    let mut edits = edits(&[("lines/width", json!(6)), ("lines/normal", json!(30)), ("lines/width", json!(7))]);
    assert_eq!(edits.toml(), "[lines]\nwidth = 7\nnormal = 30\n");
    edits.remove(&path("lines/normal"));
    assert_eq!(edits.toml(), "[lines]\nwidth = 7\n");
    assert_eq!(edits.overrides().expect("it can be written").len(), 1);
    edits.clear();
    assert!(edits.is_empty() && edits.toml().is_empty());
}

#[test]
fn edits_without_a_place_change_nothing() {
    for (at, message) in [
        ("objects/third/priority", "has no element `third`"),
        ("objects/7/priority", "has no element `7`"),
        ("lines/width/more", "no place for `more`"),
    ] {
        let faults = edits(&[("lines/tint", json!(false)), (at, json!(1))]).written_into(WRITTEN).expect_err(at);
        assert!(faults.to_string().contains(message), "{faults}");
    }
    assert!(edits(&[("lines/width", json!(1))]).written_into("[lines\n").is_err());
    let mut edits = Edits::default();
    assert!(edits.set(path("lines/width"), &json!(null)).is_err());
    assert!(edits.set(Vec::new(), &json!(1)).is_err());
    assert!(edits.set(vec!["a".into(); 100], &json!(1)).is_err());
}

#[test]
fn an_edit_is_shown_reverted_and_saved() {
    let place = place();
    let watching = Watching::start(options(&place));
    let first = watching.picture();
    watching.handle.edit(path("materials/ink/params/ink_width"), json!(8));
    watching.picture_with("picture with wider lines", |picture| inked(picture) > inked(&first));
    watching.handle.edit(path("materials/ink/params/paper"), json!([0.5, 0.5, 0.5]));
    watching.picture_with("picture of other paper", |picture| is_near(paper(picture), 0.5));
    watching.handle.revert();
    let reverted = watching.picture_with("picture of the file", |picture| is_near(paper(picture), 0.7));
    assert_eq!(reverted.channels, first.channels);

    watching.handle.edit(path("materials/ink/params/paper"), json!([0.5, 0.5, 0.5]));
    watching.handle.edit(path("render/background"), json!([1, 1, 1]));
    let edited = watching
        .picture_with("edited picture", |picture| is_near(background(picture), 1.0) && is_near(paper(picture), 0.5));
    watching.handle.save();
    watching.wait("save", |news| matches!(news, News::Saved(_)).then_some(()));
    let text = std::fs::read_to_string(place.folder.path().join("scene.toml")).expect("it is there");
    let expected = SCENE.replace("[0.8, 0.7, 0.5]", "[0.5, 0.5, 0.5]").replace("[0.25, 0.25, 0.25]", "[1.0, 1.0, 1.0]");
    assert_eq!(text, expected);
    assert_eq!(watching.picture().channels, edited.channels);
    // Nothing is left to hide what the file says from now on.
    place.file("scene.toml", SCENE);
    watching.picture_with("picture of the file", |picture| is_near(background(picture), 0.25));
}

#[test]
fn an_edit_that_the_scene_cannot_have_is_told_and_can_be_mended() {
    let place = place();
    let watching = Watching::start(options(&place));
    watching.picture();
    watching.handle.edit(path("lines/width"), json!(-1));
    let faults = watching.faults();
    assert!(faults.contains("the edit of lines.width"), "{faults}");
    watching.handle.edit(path("materials/ink/params/no_such"), json!(1));
    watching.handle.edit(path("lines/width"), json!(3));
    let faults = watching.faults();
    assert!(faults.contains("no_such"), "{faults}");
    watching.handle.revert();
    watching.mended();
    watching.picture();
}

#[test]
fn what_is_saved_is_no_longer_hidden_by_set() {
    let place = place();
    let mut options = options(&place);
    options.scene.overrides =
        vec![tusche::scene::file::Override::parse("render.background=[0.5, 0.5, 0.5]").expect("it is an override")];
    let watching = Watching::start(options);
    assert!(is_near(background(&watching.picture()), 0.5));
    watching.handle.edit(path("render/background"), json!([0.75, 0.75, 0.75]));
    watching.picture_with("edited picture", |picture| is_near(background(picture), 0.75));
    watching.handle.save();
    watching.wait("save", |news| matches!(news, News::Saved(_)).then_some(()));
    assert!(is_near(background(&watching.picture()), 0.75));
}
