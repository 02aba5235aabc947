//! What is wrong is a state: it is told, it keeps the last good picture, and it goes when it is mended.

use std::sync::Arc;

use tusche::live::News;

use super::{INK, SCENE, Watching, is_near, options, paper, place};

#[test]
fn a_broken_script_is_told_with_its_place_and_mended() {
    let place = place();
    let watching = Watching::start(options(&place));
    watching.picture();
    place.file("ink.rhai", INK.replace("color: p.paper", "colour: p.paper"));
    let faults = watching.wait("fault", |news| match news {
        News::Faults(faults) => Some(faults.clone()),
        _ => None,
    });
    let text = faults.0[0].render(false);
    assert!(text.contains("ink.rhai:7:") && text.contains("color"), "{text}");
    assert!(text.contains("colour: p.paper"), "the snippet is missing:\n{text}");
    place.file("ink.rhai", INK.replace("color: p.paper", "color: gray(0.5)"));
    watching.mended();
    watching.picture_with("picture of the mended script", |picture| is_near(paper(picture), 0.5));
}

#[test]
fn a_broken_scene_is_told_once() {
    let place = place();
    let watching = Watching::start(options(&place));
    watching.picture();
    place.file("scene.toml", SCENE.replace("samples = 2", "smaples = 2"));
    assert!(watching.faults().contains("samples"));
    // The same mistake, and something else that does not matter.
    place.file("ink.rhai", INK.replace("2.0", "3.0"));
    place.file("scene.toml", SCENE.replace("samples = 2", "samples = 3"));
    let ((), before) = watching.wait_and_see("mend", |news| matches!(news, News::Mended).then_some(()));
    assert!(!before.iter().any(|news| matches!(news, News::Faults(_))), "{before:#?}");
    assert_eq!(watching.picture().samples, 3);
}

#[test]
fn the_first_load_may_fail() {
    let place = place();
    place.file("scene.toml", "[render\n");
    let watching = Watching::start(options(&place));
    assert!(watching.faults().contains("this is not valid TOML"));
    place.file("scene.toml", SCENE);
    watching.mended();
    watching.picture();
}

#[test]
fn errors_of_a_running_script_come_with_the_picture() {
    let place = place();
    let watching = Watching::start(options(&place));
    watching.picture();
    let failing = "fn surface(hit, p) { let a = [1]; let i = if hit.position.x > 0.0 { 3 } else { 0 }; #{ color: gray(a[i] * 1.0) } }";
    place.file("ink.rhai", failing);
    place.file("scene.toml", SCENE.replace("params = { paper = [0.8, 0.7, 0.5] }\n", ""));
    let errors = watching.wait("script error", |news| match news {
        News::ScriptErrors(errors) => Some(errors.to_string()),
        _ => None,
    });
    assert!(errors.contains("ink.rhai:1:"), "{errors}");
    place.file("ink.rhai", failing.replace("{ 3 }", "{ 0 }"));
    let picture = watching.picture_with("picture without errors", |picture| picture.script_errors.is_empty());
    assert!(is_near(paper(&picture), 1.0));
}

#[test]
fn a_picture_goes_when_its_watch_does() {
    let place = place();
    let watching = Watching::start(options(&place));
    let picture = watching.picture();
    drop(watching);
    assert_eq!(Arc::strong_count(&picture), 1);
}
