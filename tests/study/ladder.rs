//! Which knobs matter to which scene: golden texts for all shipped ones.

use tusche::shade::{Host, Shaders};
use tusche::study::{Knob, Ladder, Settings};

use crate::common::{golden, root, scene_from, shipped_scenes};

fn ladder(text: &str) -> Ladder {
    let scene = scene_from(text);
    let (shaders, _) = Shaders::compile(&scene, &Host::new()).unwrap_or_else(|faults| panic!("{faults}"));
    Ladder::new(&scene, &shaders, &Knob::ALL)
}

#[test]
fn ladders_of_shipped_scenes_are_as_written() {
    let mut all = String::new();
    for (name, path) in shipped_scenes() {
        let text = std::fs::read_to_string(&path).expect("shipped scenes can be read");
        all += &format!("# {name}\n{}\n", ladder(&text));
    }
    golden(&root().join("tests/golden/study/ladders.txt"), &all);
}

#[test]
fn every_point_is_tried_once_and_builds() {
    let text = std::fs::read_to_string(root().join("scenes/glass.toml")).expect("shipped scenes can be read");
    let ladder = ladder(&text);
    let mut order = ladder.order();
    assert_eq!(order[0], 0, "the scene itself comes first");
    order.sort_unstable();
    assert_eq!(order, (0..ladder.points.len()).collect::<Vec<_>>());
    for (i, settings) in ladder.points.iter().enumerate() {
        assert!(!ladder.points[..i].contains(settings), "{settings:?} is there twice");
        let mut builder = scene_from(&text).into_builder();
        settings.apply(&mut builder);
        let scene = builder.build().unwrap_or_else(|faults| panic!("{}: {faults}", ladder.name(i)));
        let method = settings.method;
        assert_eq!(Settings { method, ..Settings::of(&scene) }, *settings);
    }
    let names: Vec<_> = (0..ladder.points.len()).map(|point| ladder.name(point)).collect();
    for (i, name) in names.iter().enumerate() {
        assert!(!name.is_empty() && !names[..i].contains(name), "`{name}` names two points");
    }
}
