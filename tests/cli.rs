//! The command as its users meet it: exit codes, messages, files.

use std::fs;

use crate::common::Workplace;

const SCENE: &str = r#"
[render]
size = [32, 24]
samples = 2

[camera]
position = [0.0, 0.0, 5.0]
target = [0.0, 0.0, 0.0]

[materials.ink]
shader = "ink.rhai"

[[objects]]
name = "ball"
shape = "sphere"
material = "ink"
"#;

const INK: &str = "fn surface(hit, p) { #{ color: rgb(0.8, 0.7, 0.5), line_width: 2.0 } }\n";

fn place() -> Workplace {
    let place = Workplace::new();
    place.file("scene.toml", SCENE);
    place.file("ink.rhai", INK);
    place
}

/// A place whose scene's script is this.
fn with_script(script: &str) -> Workplace {
    let place = place();
    place.file("ink.rhai", script);
    place
}

/// A place whose scene has a text replaced.
fn with_scene(from: &str, to: &str) -> Workplace {
    let place = place();
    assert!(SCENE.contains(from));
    place.file("scene.toml", SCENE.replace(from, to));
    place
}

#[test]
fn a_scene_becomes_a_png_and_an_exr() {
    let place = place();
    place.run(&["render", "scene.toml", "-o", "a.png", "-o", "a.exr", "--stats", "stats.json"]).exits(0);
    let size = |name: &str| fs::metadata(place.folder.path().join(name)).map_or(0, |file| file.len());
    assert!(size("a.png") > 100 && size("a.exr") > 1000);
    let stats = fs::read_to_string(place.folder.path().join("stats.json")).expect("the statistics are written");
    let stats: serde_json::Value = serde_json::from_str(&stats).expect("they are JSON");
    for path in [
        "/seconds/total",
        "/seconds/load",
        "/seconds/build",
        "/seconds/trace",
        "/seconds/shade",
        "/seconds/lines",
        "/seconds/film",
        "/threads",
        "/rays/camera",
        "/rays/shadow",
        "/rays/reflection",
        "/rays/refraction",
        "/samples",
        "/bytes_per_sample",
        "/lines/pairs_tested",
        "/lines/lined_samples",
        "/lines/clamped_widths",
        "/gate/nan",
        "/gate/infinite",
        "/gate/negative",
        "/triangles",
        "/shaders/0/name",
        "/shaders/0/mode",
        "/shaders/0/hits",
        "/shaders/0/seconds",
        "/plan",
    ] {
        assert!(stats.pointer(path).is_some_and(|value| !value.is_null()), "{path} is missing in {stats:#}");
    }
    assert!(stats.pointer("/peak_rss_bytes").is_some());
}

#[test]
fn the_output_has_the_scenes_name_unless_told_otherwise() {
    let place = place();
    place.run(&["render", "scene.toml"]).exits(0).says("wrote scene.png");
    assert!(place.folder.path().join("scene.png").exists());
    place.run(&["render", "scene.toml", "--quiet"]).exits(0);
    assert_eq!(place.run(&["render", "scene.toml", "--quiet"]).stderr(), "");
}

#[test]
fn pictures_of_two_runs_compare_as_equal() {
    let place = place();
    place.run(&["render", "scene.toml", "-o", "a.png", "--threads", "1"]).exits(0);
    place.run(&["render", "scene.toml", "-o", "b.png", "--tile", "7"]).exits(0);
    let run = place.run(&["compare", "a.png", "b.png"]).exits(0);
    assert!(run.stdout().contains("largest difference      0.000000"), "{}", run.stdout());
    place.run(&["render", "scene.toml", "-o", "c.png", "--seed", "5"]).exits(0);
    place.run(&["compare", "a.png", "c.png"]).exits(1);
    place.run(&["compare", "a.png", "c.png", "--tolerance", "1"]).exits(0);
    let json = place.run(&["compare", "a.png", "c.png", "--json"]).exits(1).stdout();
    let figures: serde_json::Value = serde_json::from_str(&json).expect("the figures are JSON");
    assert!(figures["rmse"].as_f64().is_some_and(|rmse| rmse > 0.0));
}

#[test]
fn explain_prints_the_plan_and_makes_no_picture() {
    let place = place();
    let run = place.run(&["explain", "scene.toml"]).exits(0);
    assert!(run.stdout().contains("32 x 24, 2 samples per pixel"), "{}", run.stdout());
    assert_eq!(run.stderr(), "");
    assert!(!place.folder.path().join("scene.png").exists());
}

#[test]
fn frames_go_into_numbered_files() {
    let place = place();
    place.run(&["render", "scene.toml", "--frames", "9-11", "-o", "f.###.png", "--quiet"]).exits(0);
    for name in ["f.009.png", "f.010.png", "f.011.png"] {
        assert!(place.folder.path().join(name).exists(), "{name}");
    }
    place.run(&["render", "scene.toml", "--frames", "9-11", "-o", "f.png"]).exits(2).says("f.png").says("####");
}

#[test]
fn schema_and_completions_go_to_standard_output() {
    let place = place();
    let schema = place.run(&["schema"]).exits(0).stdout();
    let schema: serde_json::Value = serde_json::from_str(&schema).expect("the schema is JSON");
    assert!(schema["properties"]["lines"].is_object());
    for shell in ["bash", "zsh", "fish"] {
        assert!(place.run(&["completions", shell]).exits(0).stdout().contains("tusche"));
    }
    let help = place.run(&["render", "--help"]).exits(0).stdout();
    assert!(help.contains("Examples:"), "{help}");
}

#[test]
fn bad_flags_are_bad_usage() {
    let place = place();
    for arguments in [
        &["render"][..],
        &["render", "scene.toml", "--size", "12"],
        &["render", "scene.toml", "--size", "0x5"],
        &["render", "scene.toml", "--no-such-flag"],
        &["render", "scene.toml", "--crop", "1,2,3"],
        &["render", "scene.toml", "--crop", "9,0,5,5"],
        &["render", "scene.toml", "--crop", "0,0,33,24"],
        &["render", "scene.toml", "--frames", "5-1", "-o", "#.png"],
        &["render", "scene.toml", "--frames", "1-2", "--frame", "3", "-o", "#.png"],
        &["render", "scene.toml", "--lines", "thick"],
        &["render", "scene.toml", "--threads", "0"],
        &["render", "scene.toml", "-o", "a.png", "-o", "a.png"],
        &["render", "scene.toml", "-o", "a.png", "-o", "./a.png"],
        &["compare", "a.png", "a.png", "--tolerance", "nan"],
        &["compare", "a.png", "a.png", "--tolerance", "-1"],
        &["no-such-command"],
    ] {
        place.run(arguments).exits(2);
    }
    assert!(!place.folder.path().join("scene.png").exists());
}

#[test]
fn missing_and_unknown_files_are_named() {
    let place = place();
    place.run(&["render", "nothing.toml"]).exits(1).says("nothing.toml").says("no such file");
    place.run(&["render", "nothing.glb"]).exits(1).says("nothing.glb").says("no such file");
    place.file("scene.blend", "x");
    place.run(&["render", "scene.blend"]).exits(1).says("scene.blend").says(".toml");
    with_scene("ink.rhai", "missing.rhai")
        .run(&["render", "scene.toml"])
        .exits(1)
        .says("missing.rhai")
        .says("scene.toml:");
}

#[test]
fn every_fault_of_a_scene_is_reported_in_one_go() {
    let place = with_scene("samples = 2", "smaples = 2\nseed = \"x\"\nfilter_radius = nan");
    let run = place.run(&["render", "scene.toml"]).exits(1);
    let run = run.says("smaples").says("samples").says("seed").says("filter_radius").says("scene.toml:4:1");
    run.says("3 errors");
}

#[test]
fn an_empty_scene_is_a_picture_of_the_background_and_a_warning() {
    let place = Workplace::new();
    place.file("empty.toml", "[render]\nsize = [8, 8]\nbackground = [1.0, 0.0, 0.0]\n");
    place.run(&["render", "empty.toml"]).exits(0).says("no objects");
    assert!(place.folder.path().join("empty.png").exists());
}

#[test]
fn faults_of_a_scene_have_a_place_and_leave_no_picture() {
    let cases = [
        ("[render]", "[render", "scene.toml:2:8", "not valid TOML"),
        ("size = [32, 24]", "size = [32, 24", "scene.toml:4:1", "closing `]`"),
        ("samples = 2", "samples = true", "scene.toml:4:11", "whole number"),
        ("samples = 2", "samples = nan", "scene.toml:4:11", "nan"),
        ("samples = 2", "samples = 99999999999999999999", "scene.toml:4:11", "99999999999999999999"),
        ("size = [32, 24]", "size = [1000000, 1000000]", "scene.toml:3:8", "4294967296 are the most"),
        ("position = [0.0, 0.0, 5.0]", "position = [0, 0, -inf]", "scene.toml:7:19", "-inf"),
        ("position = [0.0, 0.0, 5.0]", "position = [0, 0, 0]", "scene.toml:8:10", "looks at itself"),
        ("\"sphere\"", "\"spere\"", "scene.toml:15:9", "`sphere`"),
        ("material = \"ink\"", "material = \"inc\"", "scene.toml:16:12", "`ink`"),
    ];
    for (from, to, at, expected) in cases {
        let place = with_scene(from, to);
        let run = place.run(&["render", "scene.toml"]).exits(1).says(at).says(expected);
        assert!(!run.stderr().contains("2 errors"), "{}", run.stderr());
        assert!(!place.folder.path().join("scene.png").exists());
    }
}

/// A model of one triangle.
const TRIANGLE: &str = r#"{
    "asset": { "version": "2.0" },
    "scenes": [{ "nodes": [0] }],
    "nodes": [{ "mesh": 0 }, { "children": [] }],
    "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "material": 0 }] }],
    "materials": [{ "name": "plain" }],
    "textures": [{ "source": 0 }],
    "images": [{ "uri": "not there.png" }],
    "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }],
    "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
    "buffers": [{ "byteLength": 36, "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA" }]
}"#;

#[test]
fn faults_of_a_model_are_told_and_leave_no_picture() {
    let textured = r#""name": "plain", "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } }"#;
    let cases = [
        ("\"count\": 3", "\"count\": 4", "accessors[0]"),
        ("\"bufferView\": 0,", "\"bufferView\": 7,", "bufferView"),
        ("\"mesh\": 0", "\"mesh\": 0, \"children\": [0]", "nodes[0]"),
        ("\"name\": \"plain\"", textured, "not there.png"),
        ("\"2.0\"", "\"2.0\" \"", "model.gltf:2:"),
    ];
    for (from, to, expected) in cases {
        assert!(TRIANGLE.contains(from));
        let place = Workplace::new();
        place.file("model.gltf", TRIANGLE.replace(from, to));
        place.run(&["render", "model.gltf", "--size", "8x8"]).exits(1).says("model.gltf").says(expected);
        assert!(!place.folder.path().join("model.png").exists());
    }

    let place = Workplace::new();
    place.file("model.gltf", TRIANGLE);
    place.run(&["render", "model.gltf", "--size", "8x8"]).exits(0);
    let mut model = b"glTF\x02\0\0\0\xff\0\0\0".to_vec();
    model.extend((TRIANGLE.len() as u32).to_le_bytes());
    model.extend(b"JSON");
    model.extend(TRIANGLE.as_bytes());
    for length in [5, 11, 17, 100, model.len()] {
        place.file("cut.glb", &model[..length]);
        place.run(&["render", "cut.glb", "--size", "8x8"]).exits(1).says("cut.glb").says("cut off");
    }
}

#[test]
fn scripts_report_file_line_and_column() {
    let cases = [
        ("fn surface(hit, p) { #{ color: rgb(1, 0, 0) ", "ink.rhai:1:"),
        ("fn paint(hit, p) { #{} }", "surface"),
        ("fn surface(hit, p) {\n    #{ line_widht: 2.0 }\n}", "line_width"),
        ("fn surface(hit, p) {\n    #{ feature: gray(hit.positon.x) }\n}", "position"),
        ("fn surface(hit, p) {\n    #{ line_width: \"thick\" }\n}", "line_width"),
        ("fn surface(hit, p) {\n    #{ color: hit.uv.x > 0.5 }\n}", "ink.rhai:2:"),
        ("\nfn surface(hit, p) { 5 }", "ink.rhai:2:"),
    ];
    for (script, expected) in cases {
        with_script(script).run(&["render", "scene.toml"]).exits(1).says("ink.rhai").says(expected);
    }
}

#[test]
fn a_script_that_fails_at_some_hits_marks_them_and_is_reported_once() {
    let script = "fn surface(hit, p) {\n    let a = [1, 2];\n    let i = if hit.position.x > 0.0 { 5 } else { 0 };\n    \
                  #{ feature: gray(a[i]) }\n}\n";
    let place = with_script(script);
    let run = place.run(&["render", "scene.toml", "-o", "a.png"]).exits(1);
    let said = run.stderr();
    assert_eq!(said.matches("ink.rhai:4:").count(), 1, "{said}");
    assert!(said.contains("hits"), "{said}");
    assert!(place.folder.path().join("a.png").exists(), "the picture is written all the same");
    place.run(&["render", "scene.toml", "-o", "a.png", "--keep-going"]).exits(0);
}

#[test]
fn an_endless_loop_in_a_script_ends() {
    let place = with_script("fn surface(hit, p) {\n    while true { }\n    #{}\n}\n");
    place.run(&["render", "scene.toml", "--size", "2x2"]).exits(1).says("ink.rhai:2:");
}

#[test]
fn absurd_numbers_from_scripts_are_stopped_and_counted() {
    let place = with_script("fn surface(hit, p) { #{ line_width: 1.0e9, color: rgb(hit.uv.x / 0.0, 0.0, 0.0) } }");
    let run = place.run(&["render", "scene.toml", "-o", "a.png"]).exits(0);
    run.says("max_width").says("infinite");
}

#[test]
fn outputs_that_cannot_be_written_are_said_and_the_old_file_survives() {
    let place = place();
    place.run(&["render", "scene.toml", "-o", "no/such/folder/a.png"]).exits(1).says("no/such/folder");
    place.run(&["render", "scene.toml", "-o", "a.bmp"]).exits(1).says("png").says("exr");
    place.run(&["render", "scene.toml", "--stats", "no/such/stats.json"]).exits(1).says("no/such/stats.json");
    assert!(!place.folder.path().join("scene.png").exists(), "told before rendering");
    let old = place.file("b.png", "old");
    let broken = with_script("fn surface(");
    fs::copy(broken.folder.path().join("ink.rhai"), place.folder.path().join("ink.rhai")).expect("files can be copied");
    place.run(&["render", "scene.toml", "-o", "b.png"]).exits(1);
    assert_eq!(fs::read(old).expect("it is still there"), b"old");
}

#[test]
fn layers_are_chosen_by_name() {
    let place = place();
    for layer in ["rgba", "color", "line", "line.silhouette", "Z", "N", "P", "uv", "object"] {
        place.run(&["render", "scene.toml", "-o", "a.png", "-q", "--layer", layer]).exits(0);
    }
    place.run(&["render", "scene.toml", "--layer", "colour"]).exits(1).says("color");
    place.run(&["render", "scene.toml", "--layer", "aov_depth"]).exits(1).says("aov_depth");
}

#[test]
fn values_can_be_set_from_the_command_line() {
    let place = place();
    let plan = |arguments: &[&str]| {
        let mut all = vec!["explain", "scene.toml"];
        all.extend(arguments);
        place.run(&all).exits(0).stdout()
    };
    assert!(plan(&["--set", "render.samples=9"]).contains("9 samples"));
    assert!(plan(&["--samples", "5", "--set", "render.samples=9"]).contains("5 samples"));
    assert!(plan(&["--quality", "final"]).contains("64 samples"));
    assert!(plan(&["--lines", "off"]).contains("switched off"));
    place.run(&["explain", "scene.toml", "--set", "lines.widht=3"]).exits(1).says("width");
    place.run(&["explain", "scene.toml", "--set", "lines.width"]).exits(1).says("lines.width");
}

#[cfg(unix)]
#[test]
fn a_reader_that_goes_away_is_no_failure() {
    let line = format!("{} schema | head -c 1 >/dev/null; exit ${{PIPESTATUS[0]}}", env!("CARGO_BIN_EXE_tusche"));
    let status = std::process::Command::new("bash").args(["-c", &line]).status().expect("bash can be run");
    assert_eq!(status.code(), Some(0));
}

#[test]
fn paths_are_relative_to_the_file_that_names_them() {
    let place = Workplace::new();
    let place_scene = SCENE
        .replace("ink.rhai", "../the looks/ink.rhai")
        .replace("[[objects]]", "params = { image = { texture = \"../the looks/tex/noise.png\" } }\n\n[[objects]]");
    place.file("deep/er/scène.toml", place_scene);
    let script = "fn params() { #{ image: () } }\nfn surface(hit, p) { #{ color: hit.texture(p.image).rgb } }\n";
    place.file("deep/the looks/ink.rhai", script);
    let scene = ["render", "deep/er/scène.toml", "--size", "8x8", "-o"];
    place.run(&[&scene[..], &["out.png"]].concat()).exits(1).says("noise.png").says("scène.toml:13:");
    place.file("plain.toml", "");
    fs::create_dir(place.folder.path().join("deep/the looks/tex")).expect("folders can be made");
    place.run(&["render", "plain.toml", "--size", "4x4", "-o", "deep/the looks/tex/noise.png"]).exits(0);
    place.run(&[&scene[..], &["deep/out.png"]].concat()).exits(0);
    assert!(place.folder.path().join("deep/out.png").exists());
}

#[cfg(unix)]
#[test]
fn a_symbolic_link_stays_and_its_target_is_written() {
    use std::os::unix::fs::symlink;
    let place = place();
    let folder = place.folder.path();
    fs::create_dir(folder.join("real")).expect("folders can be made");
    for (link, target) in [("a.png", "real/a.png"), ("lost.png", "gone/a.png"), ("round.png", "round.png")] {
        symlink(target, folder.join(link)).expect("links can be made");
    }
    for _ in ["the target is new", "the target is there"] {
        place.run(&["render", "scene.toml", "-o", "a.png"]).exits(0);
        assert!(folder.join("a.png").is_symlink());
        assert!(folder.join("real/a.png").is_file());
    }
    place.run(&["render", "scene.toml", "-o", "a.png", "-o", "real/a.png"]).exits(2);
    place.run(&["render", "scene.toml", "-o", "lost.png"]).exits(1).says("lost.png").says("gone");
    assert!(folder.join("lost.png").is_symlink());
}

/// A file as large as the process may write stands for a full disk.
#[cfg(unix)]
#[test]
fn the_old_file_survives_a_disk_that_fills() {
    let place = place();
    for name in ["a.exr", "a.png"] {
        let old = place.file(name, "old");
        let tusche = env!("CARGO_BIN_EXE_tusche");
        let line = format!("trap '' XFSZ; ulimit -f 1; exec {tusche} render scene.toml --size 300x200 -o {name}");
        let run = std::process::Command::new("bash").args(["-c", &line]).current_dir(place.folder.path()).output();
        let run = run.expect("bash can be run");
        let said = String::from_utf8_lossy(&run.stderr);
        assert_eq!(run.status.code(), Some(1), "{said}");
        assert!(said.contains(&format!("{name}: cannot write this file")), "{said}");
        assert_eq!(fs::read(&old).expect("it is still there"), b"old");
        fs::remove_file(old).expect("it can be removed");
        let left = fs::read_dir(place.folder.path()).expect("it can be listed").count();
        assert_eq!(left, 2, "only the scene and its script are left");
    }
}

/// Starts a render of minutes, interrupts it twice after a while, and returns what it said.
#[cfg(unix)]
fn interrupted(place: &Workplace, pause: std::time::Duration) -> std::process::Output {
    use std::process::{Command, Stdio};
    let mut command = Command::new(env!("CARGO_BIN_EXE_tusche"));
    command.args(["render", "scene.toml", "--size", "32x16384", "--samples", "256", "--layer", "rgba"]);
    command.args(["-o", "a.png", "-o", "a.exr"]).current_dir(place.folder.path());
    let child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the command can be run");
    std::thread::sleep(pause);
    for _ in 0..2 {
        // The second may come too late, which is fine.
        let _ = Command::new("kill").args(["-INT", &child.id().to_string()]).stderr(Stdio::null()).status();
    }
    child.wait_with_output().expect("it ends")
}

#[cfg(unix)]
#[test]
fn ctrl_c_leaves_valid_files_of_what_is_done_and_says_so() {
    use std::time::Duration;
    use tusche::film::Picture;
    let place = with_script("fn surface(hit, p) { #{ color: rgb(0.5 + 0.5 * abs(hit.normal.x), 0.7, 0.5) } }\n");
    let old = place.file("a.png", "old");
    // How long the start takes depends on the machine: wait longer until some pixels were done before the signal.
    for seconds in [1, 2, 4, 8, 16, 32] {
        let run = interrupted(&place, Duration::from_secs(seconds));
        let said = String::from_utf8_lossy(&run.stderr);
        let Some(code) = run.status.code() else { continue };
        assert_eq!(code, 1, "{said}");
        assert!(said.contains("stopped before the picture was complete"), "{said}");
        assert!(said.contains("what is done is in a.png and a.exr"), "{said}");
        assert_eq!(fs::read_dir(place.folder.path()).expect("it can be listed").count(), 4);
        let rows = [old.clone(), old.with_extension("exr")].map(|path| {
            let picture = Picture::read(&path).unwrap_or_else(|fault| panic!("{fault}"));
            assert_eq!(picture.size(), [32, 16384]);
            let green = picture.channel("G").expect("it has colours");
            green.chunks(32).filter(|row| row.iter().all(|value| *value > 0.0)).count()
        });
        assert_eq!(rows[0], rows[1], "both files hold the same part");
        if rows[0] > 0 {
            assert!(rows[0] < 16384, "the render is too short for this test");
            return;
        }
    }
    panic!("no pixel was done in half a minute");
}
