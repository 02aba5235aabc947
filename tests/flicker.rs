//! Flicker: what lines do from frame to frame beyond moving.

use tusche::diag::Diagnostics;
use tusche::scene::Scene;
use tusche::shade::{Host, Shaders};
use tusche::study::{Flicker, FlickerOptions, flicker};

use crate::common::{Workplace, scene_from};

/// A box askew, seen straight on.
fn scene(samples: u32, lines: &str) -> String {
    format!(
        r#"
        [render]
        size = [40, 30]
        samples = {samples}

        [camera]
        projection = "orthographic"
        height = 3.0
        position = [0.0, 0.0, 10.0]
        target = [0.0, 0.0, 0.0]

        [lines]
        {lines}

        [[objects]]
        shape = "box"
        rotate = [0.0, 0.0, 17.0]
        "#
    )
}

fn measured(text: &str, change: impl FnOnce(&mut FlickerOptions)) -> Result<Flicker, Diagnostics> {
    let mut options = FlickerOptions { frames: 4, reference: 8, ..FlickerOptions::default() };
    change(&mut options);
    let frame = |_| {
        let scene: Scene = scene_from(text);
        let (shaders, _) = Shaders::compile(&scene, &Host::new())?;
        Ok((scene, shaders))
    };
    flicker(frame, &options, &|_| ())
}

#[test]
fn what_does_not_move_does_not_flicker() {
    let still = measured(&scene(4, "width = 2.0"), |options| options.step = [0.0, 0.0]).expect("there are lines");
    assert_eq!((still.flicker, still.floor), (0.0, 0.0));
    assert!(still.unlocked_flicker > 0.02 && still.error > 0.01, "{still:?}");
    // Moved by whole pixels, the same patterns see other parts of the edge.
    let moved = measured(&scene(4, "width = 2.0"), |options| options.step = [1.0, 0.0]).expect("there are lines");
    assert!(moved.flicker > 0.02, "{moved:?}");
}

#[test]
fn locked_patterns_and_more_samples_flicker_less() {
    let slowly = |options: &mut FlickerOptions| options.step = [0.02, 0.01];
    let few = measured(&scene(4, "width = 2.0"), slowly).expect("there are lines");
    let many = measured(&scene(36, "width = 2.0"), slowly).expect("there are lines");
    for found in [few, many] {
        assert!(found.floor < 0.5 * found.flicker, "the reference is good enough: {found:?}");
        assert!(found.flicker < 0.7 * found.unlocked_flicker, "{found:?}");
        // Four edges of two units, 20 px, each with 2 px of line.
        assert!((found.coverage - 160.0).abs() < 4.0, "{found:?}");
    }
    assert!(many.flicker < 0.8 * few.flicker && many.error < 0.5 * few.error, "{few:?} {many:?}");
}

#[test]
fn nothing_to_measure_is_told() {
    let message = |text: &str, change: fn(&mut FlickerOptions)| {
        measured(text, change).map(|_| ()).expect_err("there is nothing to measure").to_string()
    };
    let lined = scene(4, "width = 2.0");
    assert!(message(&scene(4, "width = 0.0"), |_| ()).contains("this scene draws no lines"));
    assert!(message(&lined, |options| options.frames = 1).contains("at least 2"));
    assert!(message(&lined, |options| options.step = [f64::NAN, 0.0]).contains("two finite numbers"));
}

#[test]
fn the_command_prints_it() {
    let place = Workplace::new();
    place.file("scene.toml", scene(4, "width = 2.0"));
    let few = ["--frames", "1-2", "--reference", "2"];
    let run = place.run(&[&["flicker", "scene.toml"], &few[..]].concat()).exits(0);
    for part in ["2 frames, each moved by (0.117, 0.071) px; 4 samples, references of 2 x 8", "lines cover", "floor"] {
        assert!(run.stdout().contains(part), "{}", run.stdout());
    }
    let run = place.run(&[&["flicker", "scene.toml", "--json", "--step", "-0.1,0"], &few[..]].concat()).exits(0);
    let numbers: serde_json::Value = serde_json::from_str(&run.stdout()).expect("the numbers are JSON");
    assert!(numbers["flicker"].as_f64().is_some_and(|flicker| flicker > 0.0), "{numbers}");

    place.run(&["flicker", "scene.toml", "--frames", "3-3"]).exits(2).says("at least two");
    place.run(&["flicker", "scene.toml", "--step", "inf,0"]).exits(2).says("is not a number of pixels");
    place.run(&["flicker", "scene.toml", "-o", "a.png"]).exits(2).says("makes no picture");
    place.run(&["flicker", "none.toml"]).exits(1).says("none.toml");
}
