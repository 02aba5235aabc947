//! Errors against lines that a scene declares: what is measured is known to be wrong by this much.

use tusche::film::Layer;
use tusche::plan::Plan;
use tusche::scene::material::ParamValue;
use tusche::scene::settings::Sampler;
use tusche::scene::{Scene, SceneBuilder};
use tusche::shade::{Host, Shaders};
use tusche::study::truth::coverage;

use crate::common::{Workplace, render_with, root, scene_from};

/// A turned square beside a ball, one with a thin line.
const SCENE: &str = r#"
[render]
size = [96, 64]
samples = 4

[camera]
projection = "orthographic"
height = 64.0
position = [0.0, 0.0, 100.0]
target = [0.0, 0.0, 0.0]

[lines]
width = 3.0

[materials.ink]
shader = "builtin:ink"
params = { ink_width = 3.0 }

[[objects]]
name = "ball"
shape = "sphere"
radius = 17.0
segments = [512, 256]
translate = [-22.3, 1.7, 0.0]
material = "ink"

[[objects]]
shape = "plane"
size = [28.0, 28.0]
rotate = [90.0, 0.0, 45.0]
translate = [22.0, -0.4, 0.0]
material = "ink"

[truth]
discs = [{ object = "ball" }]

[[truth.edges]]
points = [[22.0, 19.398990, 0.0], [2.201010, -0.4, 0.0], [22.0, -20.198990, 0.0], [41.798990, -0.4, 0.0]]
closed = true
"#;

fn changed(change: impl FnOnce(&mut SceneBuilder)) -> Scene {
    let mut builder = scene_from(SCENE).into_builder();
    change(&mut builder);
    builder.build().unwrap_or_else(|faults| panic!("{faults}"))
}

/// Which share of the lines' area is wrong.
fn error(scene: &Scene) -> f64 {
    let (shaders, _) = Shaders::compile(scene, &Host::new()).unwrap_or_else(|faults| panic!("{faults}"));
    let filter = Plan::new(scene, &shaders, &[Layer::Line]).filter;
    let truth = scene.truth().expect("lines are declared");
    let truth = coverage(truth, scene.camera(), scene.render().size, &filter);
    let (picture, _) = render_with(scene, &[Layer::Line], &Default::default());
    let wrong: f64 = truth.iter().zip(&picture.channels[3]).map(|(a, b)| f64::from((a - b).abs())).sum();
    wrong / truth.iter().map(|ink| f64::from(*ink)).sum::<f64>()
}

/// The slope of a line through logarithms, by least squares.
fn slope(counts: &[u32], errors: &[f64]) -> f64 {
    let points: Vec<_> = counts.iter().zip(errors).map(|(count, error)| [f64::from(*count).ln(), error.ln()]).collect();
    let mean = |axis: usize| points.iter().map(|point| point[axis]).sum::<f64>() / points.len() as f64;
    let (x, y) = (mean(0), mean(1));
    let product: f64 = points.iter().map(|point| (point[0] - x) * (point[1] - y)).sum();
    product / points.iter().map(|point| (point[0] - x) * (point[0] - x)).sum::<f64>()
}

#[test]
fn coverage_converges_to_what_is_declared_whichever_the_sampler() {
    let counts = [4, 16, 64, 256];
    let errors = Sampler::ALL.map(|sampler| {
        counts.map(|samples| {
            error(&changed(|scene| {
                scene.render.sampler = sampler;
                scene.render.samples = samples;
            }))
        })
    });
    for (sampler, errors) in Sampler::ALL.into_iter().zip(&errors) {
        let slope = slope(&counts, errors);
        // Edges give −3/4 where samples are stratified; gaps to the nearest sample have a spread of N^(−2/3). Random samples
        // would give −1/2.
        assert!((-0.85..-0.62).contains(&slope), "{sampler:?} has a slope of {slope:.3}: {errors:.4?}");
        // Of what is declared only the mesh's facets are left out: 0.0008 px of 17.
        assert!(errors[3] < 0.01, "{sampler:?}: {errors:.4?}");
    }
    for (other, sampler) in errors[1..].iter().zip(["sobol", "blue-noise"]) {
        for (mine, stratified) in other.iter().zip(&errors[0]) {
            assert!(*mine < 1.1 * stratified, "{sampler} is at least as good: {other:.4?}, {:.4?}", errors[0]);
        }
    }
}

#[test]
fn a_minimum_width_leaves_an_error_that_no_samples_mend() {
    let errors = [0.5, 0.0].map(|min_width| {
        [16, 1024].map(|samples| {
            error(&changed(|scene| {
                scene.render.samples = samples;
                scene.lines.min_width = min_width;
                scene.materials.iter_mut().for_each(|material| {
                    material.params.insert("ink_width".into(), (ParamValue::Float(0.2), None));
                });
                scene.truth.iter_mut().flat_map(|truth| &mut truth.curves).for_each(|curve| curve.width = 0.2);
            }))
        })
    });
    let [[half_16, half_1024], [none_16, none_1024]] = errors;
    assert!(none_1024 < 0.1 * none_16, "without one, only noise is left: {errors:.4?}");
    assert!(half_16 < none_16, "few samples gain by it: {errors:.4?}");
    assert!(half_1024 > 2.0 * none_1024, "many lose by it: {errors:.4?}");
}

#[test]
fn shipped_scenes_show_what_they_declare() {
    for name in ["truth_disc", "truth_edges"] {
        let text =
            std::fs::read_to_string(root().join(format!("scenes/{name}.toml"))).expect("shipped scenes can be read");
        let mut builder = scene_from(&text).into_builder();
        builder.lines.min_width = 0.0;
        builder.render.samples = 64;
        let error = error(&builder.build().unwrap_or_else(|faults| panic!("{faults}")));
        assert!(error < 0.025, "{name}: {error}");
    }
}

#[test]
fn a_study_measures_against_what_is_declared_or_says_that_it_is_not_there() {
    let place = Workplace::new();
    place.file("scene.toml", SCENE);
    let study = ["study", "scene.toml", "--repeats", "1", "--reference", "64", "--knob", "sampler"];
    place.run(&[&study[..], &["-o", "out"]].concat()).exits(0);
    let text = std::fs::read_to_string(place.folder.path().join("out/study.json")).expect("study.json is written");
    let found: serde_json::Value = serde_json::from_str(&text).expect("it is JSON");
    assert_eq!(found["reference"]["truth"], true);
    assert!(found["reference"]["own_errors"]["line_coverage"].is_null(), "what is declared has no error of its own");
    assert!(found["reference"]["own_errors"]["rmse"]["all"]["mean"].is_number());
    assert_eq!(found["points"].as_array().map(Vec::len), Some(3 * 3));
    let page = std::fs::read_to_string(place.folder.path().join("out/index.html")).expect("the page is written");
    assert!(page.contains("by geometry") && page.contains("<h2>Samplers</h2>") && !page.contains("NaN"));

    place.file("wrong.toml", SCENE.replace("discs = [{ object = \"ball\" }]", "width = 1.0"));
    place
        .run(&["study", "wrong.toml", "--reference", "16", "-o", "wrong"])
        .exits(1)
        .says("the picture shows other lines than `[truth]` declares")
        .says("wrong.toml:34:1")
        .says("declare all lines and no others");
}
