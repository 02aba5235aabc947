//! The course of a study: what it writes, how it goes on, what it refuses.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::time::Duration;

use serde_json::Value;
use tusche::study::StudyOptions;
use tusche::study::run::reference_samples;

use crate::common::Workplace;

const SCENE: &str = r#"
[render]
size = [40, 30]
samples = 4

[camera]
projection = "orthographic"
height = 3.0
position = [0.0, 0.0, 10.0]
target = [0.0, 0.0, 0.0]

[lines]
width = 2.0

[[objects]]
shape = "box"
rotate = [0.0, 0.0, 17.0]
"#;

const FEW: [&str; 8] = ["study", "scene.toml", "--repeats", "2", "--reference", "32", "--knob", "method"];

fn place() -> Workplace {
    let place = Workplace::new();
    place.file("scene.toml", SCENE);
    place
}

fn read(place: &Workplace, name: &str) -> String {
    let path = place.folder.path().join(name);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Rows of the table without what a clock and the system's memory say.
fn rows(table: &str) -> Vec<String> {
    let names: Vec<&str> = table.lines().next().expect("a row of names").split(',').collect();
    let wavers = |name: &str| name.ends_with("_seconds") || ["threads", "peak_rss_bytes"].contains(&name);
    let without_times = |line: &str| {
        let cells = names.iter().zip(line.split(',')).filter(|(name, _)| !wavers(name));
        cells.map(|(_, cell)| cell).collect::<Vec<_>>().join(",")
    };
    let mut rows: Vec<_> = table.lines().skip(1).map(without_times).collect();
    rows.sort();
    rows
}

fn numbers(folder: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(folder.join("study.json")).expect("study.json is written"))
        .expect("it is JSON")
}

#[test]
fn a_study_writes_a_table_numbers_pictures_and_a_page() {
    let place = place();
    let study =
        ["study", "scene.toml", "--repeats", "2", "--reference", "256", "--knob", "method", "--knob", "samples"];
    place.run(&[&study[..], &["-o", "out"]].concat()).exits(0).says("wrote out/index.html");
    let table = read(&place, "out/study.csv");
    assert_eq!(
        table.lines().next(),
        Some(
            "scene,reference,samples,line_oversampling,sampler,method,min_width,width_compensation,surfaces,reflection_depth,refraction_depth,filter,\
             filter_radius,repeat,threads,wall_seconds,build_seconds,trace_seconds,shade_seconds,lines_seconds,film_seconds,\
             peak_rss_bytes,bytes_per_sample,rmse,rmse_lines,rmse_reflections,rmse_rest,flip,flip_lines,flip_reflections,flip_rest,\
             line_coverage,line_position,line_crossings"
        )
    );
    // 8 rates, 3 presets with a sampler of their own, and 3 more methods at 3 rates, twice.
    assert_eq!(table.lines().count(), 1 + 2 * (8 + 3 + 3 * 3));

    let found = numbers(&place.folder.path().join("out"));
    let keys: Vec<_> = found.as_object().map(|map| map.keys().map(String::as_str).collect()).unwrap_or_default();
    let expected = "scene size version threads complete left_out_for_time reference knobs knobs_that_do_not_matter points fits fronts presets methods_in_equal_time drawn_widths";
    assert_eq!(keys.join(" "), expected);
    assert_eq!((&found["complete"], &found["left_out_for_time"]), (&Value::Bool(true), &Value::from(0)));
    let points = found["points"].as_array().expect("there are points");
    assert_eq!(points.len(), 20);
    let coverage = |samples: u64| {
        let is_it = |point: &&Value| point["settings"]["samples"] == samples && point["settings"]["method"] == "exact";
        let point = points.iter().find(is_it).expect("the point was measured");
        assert_eq!(point["runs"], 2);
        assert!(
            point["errors"]["rmse"]["lines"]["deviation"].is_number()
                && point["errors"]["rmse"]["reflections"].is_null()
        );
        point["errors"]["line_coverage"]["mean"].as_f64().expect("there are lines")
    };
    assert!(coverage(144) < 0.3 * coverage(4), "{} {}", coverage(144), coverage(4));
    let presets = found["presets"].as_array().expect("there are presets");
    let names: Vec<_> = presets.iter().map(|preset| preset["name"].as_str().unwrap_or_default()).collect();
    assert_eq!(names, ["draft", "preview", "final"]);
    for (preset, samples) in presets.iter().zip([4, 16, 64]) {
        let point = points.iter().find(|point| point["point"] == preset["point"]).expect("the point was measured");
        assert!(point["settings"]["samples"] == samples && preset["behind_front"]["flip"].is_number(), "{preset}");
    }
    if cfg!(target_os = "linux") {
        assert!(points.iter().all(|point| point["peak_rss_bytes"].as_f64().is_some_and(|peak| peak > 1e6)));
        assert!(read(&place, "out/index.html").contains("Most memory that the process held"));
    }
    let fit = &found["fits"][0];
    assert_eq!((&fit["knob"], &fit["error"]), (&"samples".into(), &"line_coverage".into()));
    let slope = fit["exponent"]["by_samples"].as_f64().expect("a slope is fitted");
    assert!((-1.0..-0.4).contains(&slope), "{slope}");
    for method in ["bauer", "path"] {
        let is_it = |point: &&Value| point["settings"]["samples"] == 4 && point["settings"]["method"] == method;
        let other = points.iter().find(is_it).unwrap_or_else(|| panic!("{method} was tried"));
        let other = other["errors"]["line_coverage"]["mean"].as_f64().expect("there are lines");
        assert!(other > coverage(4), "the exact search is nearer to the truth: {method} {other} {}", coverage(4));
    }
    // A square has corners.
    assert!(
        points.iter().all(|point| point["errors"]["line_crossings"]["mean"].as_f64().is_some_and(|error| error > 0.0))
    );
    for time in found["methods_in_equal_time"].as_array().expect("methods are compared") {
        for errors in [&time["errors"]["line_coverage"], &time["errors"]["line_crossings"]] {
            let of = |method: &str| errors[method].as_f64();
            // Which of the others can be compared, and how they do, depends on the machine.
            let all = ["exact", "choudhury", "bauer", "path"].into_iter().filter_map(of);
            assert!(of("exact").is_some() && all.into_iter().all(|error| error > 0.0), "{time}");
        }
    }

    for plot in ["line_coverage", "flip", "methods_line_coverage"] {
        let text = read(&place, &format!("out/plots/{plot}.svg"));
        assert!(text.starts_with("<svg xmlns=") && !text.contains("NaN"), "{plot}");
        assert_eq!(text.matches("<svg ").count(), text.matches("</svg>").count(), "{plot}");
    }
    for picture in ["reference", "the_scene", "samples_144", "method_choudhury_16"] {
        assert!(place.folder.path().join(format!("out/pictures/{picture}.png")).is_file(), "{picture}");
    }
}

#[test]
fn the_page_needs_nothing_else() {
    let place = place();
    place.file("a <b> & c.toml", SCENE);
    place
        .run(&["study", "a <b> & c.toml", "-o", "out", "--repeats", "1", "--reference", "8", "--knob", "samples"])
        .exits(0);
    let page = read(&place, "out/index.html");
    assert!(page.starts_with("<!DOCTYPE html>") && page.ends_with("</html>\n"));
    // Pictures as base64 may hold anything.
    let text: String = page
        .split("src=\"data:")
        .enumerate()
        .map(|(i, part)| if i == 0 { part } else { part.split_once('"').map_or("", |(_, rest)| rest) })
        .collect();
    for outside in ["http:", "https:", "//", "<script", "<link", "@import", "url("] {
        assert!(!text.contains(outside), "the page mentions `{outside}`");
    }
    for part in [
        "a &lt;b&gt; &amp; c: what accuracy costs",
        "prefers-color-scheme: dark",
        "@media print",
        "data:image/png;base64,",
    ] {
        assert!(page.contains(part), "missing: {part}");
    }
    assert!(!text.contains("NaN") && page.matches("<svg class=\"plot\"").count() == 4);
    let open: BTreeSet<_> = ["svg", "figure", "table", "div", "ul", "tr"]
        .into_iter()
        .filter(|tag| {
            let opened = page.matches(&format!("<{tag}>")).count() + page.matches(&format!("<{tag} ")).count();
            opened != page.matches(&format!("</{tag}>")).count()
        })
        .collect();
    assert!(open.is_empty(), "not closed: {open:?}");
}

#[test]
fn a_stopped_study_goes_on_and_comes_to_the_same() {
    let place = place();
    place.run(&[&FEW[..], &["-o", "whole"]].concat()).exits(0);
    place.run(&[&FEW[..], &["-o", "parts", "--threads", "1"]].concat()).exits(0);
    let table = read(&place, "whole/study.csv");
    assert_eq!(table.lines().count(), 1 + 24);

    // As if it had been stopped after two pictures.
    let begun: Vec<_> = table.lines().take(3).collect();
    place.file("parts/study.csv", begun.join("\n") + "\n");
    fs::remove_file(place.folder.path().join("parts/index.html")).expect("it was there");
    fs::copy(place.folder.path().join("whole/reference.exr"), place.folder.path().join("parts/reference.exr"))
        .expect("a copy");
    place.run(&[&FEW[..], &["-o", "parts"]].concat()).exits(0);
    let again = read(&place, "parts/study.csv");
    assert_eq!(again.lines().take(3).collect::<Vec<_>>(), begun, "what was measured stays as it was");
    assert_eq!(rows(&again), rows(&table));
    assert!(read(&place, "parts/index.html").contains("</html>"));

    // All is there: nothing is measured again, times included.
    place.run(&[&FEW[..], &["-o", "parts"]].concat()).exits(0);
    assert_eq!(read(&place, "parts/study.csv"), again);

    // Another scene, or another reference: nothing of it is of use.
    place.run(&[&FEW[..], &["-o", "parts", "--set", "lines.width=3"]].concat()).exits(0);
    let other = read(&place, "parts/study.csv");
    assert_eq!(other.lines().count(), 1 + 24);
    assert!(begun[1..].iter().all(|row| !other.contains(row)));
}

#[test]
fn a_budget_takes_what_tells_most_first() {
    let options = |seconds: f64| StudyOptions {
        reference: 1024,
        budget: Some(Duration::from_secs_f64(seconds)),
        ..StudyOptions::default()
    };
    // A sample per pixel takes 10 ms.
    assert_eq!(reference_samples(&options(3600.0), 16, 0.01).ok(), Some(1024));
    assert_eq!(reference_samples(&options(10.0), 16, 0.01).ok(), Some(400));
    let fault = reference_samples(&options(1.0), 16, 0.01).expect_err("64 samples take 0.64 s");
    assert!(fault.to_string().contains("a budget of 1 s is too small"), "{fault}");
    assert!(fault.hints[0].contains("--budget 2s"), "{fault}");
    assert_eq!(reference_samples(&StudyOptions::default(), 16, 1e9).ok(), Some(1024), "no budget, no limit");

    let place = place();
    place.run(&[&FEW[..], &["-o", "out", "--budget", "1h"]].concat()).exits(0);
    assert_eq!(read(&place, "out/study.csv").lines().count(), 1 + 24);
    place
        .run(&[&FEW[..], &["-o", "none", "--budget", "0.000001s"]].concat())
        .exits(1)
        .says("is too small")
        .says("--budget");
    // The reference of before is good enough; there is no time for another picture.
    place.file("scene.toml", SCENE);
    let run = place.run(&["study", "scene.toml", "-o", "out", "--budget", "0.000001s", "--reference", "32"]).exits(0);
    assert!(run.stderr().contains("did not fit into the budget"), "{}", run.stderr());
    assert_eq!(numbers(&place.folder.path().join("out"))["points"].as_array().map(Vec::len), Some(12));
}

#[test]
fn what_cannot_be_studied_is_told() {
    let place = place();
    place.run(&["study", "scene.toml"]).exits(2).says("-o DIR");
    place.run(&["study", "scene.toml", "-o", "a", "-o", "b"]).exits(2).says("one folder");
    place.run(&["study", "scene.toml", "-o", "a", "--lines", "bauer"]).exits(2).says("leave out");
    place.run(&["study", "scene.toml", "-o", "a", "--knob", "sampls"]).exits(2).says("did you mean `samples`?");
    place.run(&["study", "scene.toml", "-o", "a", "--budget", "5"]).exits(2).says("write it with a unit");
    place.run(&["study", "scene.toml", "-o", "a", "--budget", "-5m"]).exits(2);
    place.run(&["study", "scene.toml", "-o", "a", "--budget", "nans"]).exits(2).says("is not a time above 0");
    place.run(&["study", "none.toml", "-o", "a"]).exits(1).says("none.toml");
    place.run(&["study", "scene.toml", "-o", "a", "--set", "lines.width=0"]).exits(1).says("draws no lines");
    place.run(&["study", "scene.toml", "-o", "no/such/folder"]).exits(1).says("cannot make this folder");
    place.run(&["study", "scene.toml", "-o", "scene.toml"]).exits(1).says("scene.toml");
    place.file("old/study.csv", "this,is\nno,study\n");
    place
        .run(&["study", "scene.toml", "-o", "old"])
        .exits(1)
        .says("this is no table of a study")
        .says("delete the file");
    let left = fs::read_to_string(place.folder.path().join("old/study.csv")).expect("it stays");
    assert_eq!(left, "this,is\nno,study\n");
    assert!(!place.folder.path().join("a").exists(), "nothing is written before all is well");
}
