//! The commands as their users meet them: exit codes, files, JSON.

use std::fs;

use serde_json::Value as Json;

use super::{masked, place_with_shaders, printed};
use crate::common::{Workplace, golden, root};

const INK: &str = "fn params() { #{ ink_width: 2.0 } }\nfn surface(hit, p) { #{ line_width: p.ink_width } }\n";
const BROKEN: &str = "fn surface(hit, p) {\n    #{ bas_color: hit.normal }\n}\n";

#[test]
fn one_broken_file_keeps_no_other_from_being_checked() {
    let place = Workplace::new();
    place.file("a.rhai", INK);
    place.file("b.rhai", BROKEN);
    place.file("c.rhai", INK);
    let run = place.run(&["shader", "check", "a.rhai", "b.rhai", "gone.rhai", "c.rhai"]).exits(1);
    golden(&root().join("tests/golden/shader_check/commands/several_files.txt"), &printed(&run));
}

#[test]
fn the_document_for_editors_is_as_recorded() {
    let place = Workplace::new();
    place.file("a.rhai", "fn params() { #{ ink_width: 2.0, paint: rgb(0.1, 0.2, 0.3), map: () } }\nfn surface(hit, p) {\n    /* é */ let n = 1; #{ line_width: p.ink_width * hit.depth, base_color: p.paint, aov_up: hit.normal }\n}\n");
    place.file("b.rhai", BROKEN);
    let run = place.run(&["shader", "check", "--json", "a.rhai", "b.rhai", "gone.rhai"]).exits(1);
    assert_eq!(run.stderr(), "");
    let text = run.stdout();
    let document: Json = serde_json::from_str(&text).expect("it is JSON");
    let cost = document.pointer("/files/0/report/ns_per_hit").and_then(Json::as_f64).expect("it was measured");
    assert!(cost > 0.0);
    let text = text.replace(&format!("\"ns_per_hit\": {cost:?}"), "\"ns_per_hit\": #");
    golden(&root().join("tests/golden/shader_check/commands/document.json"), &text);
}

#[test]
fn the_reference_is_printed() {
    let place = Workplace::new();
    let run = place.run(&["shader", "reference"]).exits(0);
    assert_eq!(run.stdout(), fs::read_to_string(root().join("shaders/README.md")).expect("it is shipped"));
}

#[test]
fn modules_are_checked_with_the_script_that_imports_them() {
    let place = Workplace::new();
    place.file("look.rhai", "import \"lib/ink\" as ink;\nfn surface(hit, p) { #{ line_width: ink::width(hit) } }\n");
    place.file("lib/ink.rhai", "fn width(hit) { 2.0 + helper(hit) }\nprivate fn helper(hit) { hit.uv.x }\n");
    place.run(&["shader", "check", "look.rhai"]).exits(0);
    place.file("lib/ink.rhai", "fn width(hit) {\n    hit.positon.x\n}\n");
    let run = place.run(&["shader", "check", "look.rhai"]).exits(1).says("did you mean `position`?");
    assert!(run.stderr().contains("lib/ink.rhai:2:9"), "{}", run.stderr());
    place.file("look.rhai", "import \"lib/inc\" as ink;\nfn surface(hit, p) { #{} }\n");
    place.run(&["shader", "check", "look.rhai"]).exits(1).says("look.rhai:1:8").says("did you mean `ink.rhai`?");
}

#[test]
fn files_that_are_no_scripts_are_said() {
    let place = Workplace::new();
    place.file("latin.rhai", b"fn surface(hit, p) { #{} } // \xe9");
    place.file("empty.rhai", "");
    fs::create_dir(place.folder.path().join("folder.rhai")).expect("folders can be made");
    let run = place.run(&["shader", "check", "latin.rhai", "empty.rhai", "folder.rhai", "gone.rhai"]).exits(1);
    golden(&root().join("tests/golden/shader_check/commands/no_scripts.txt"), &printed(&run));
    for file in ["latin.rhai", "empty.rhai", "folder.rhai", "gone.rhai"] {
        let run = place.run(&["shader", "check", "--json", file]).exits(1);
        let document: Json = serde_json::from_str(&run.stdout()).expect("it is JSON");
        assert_eq!(document["errors"], 1, "{file}");
        assert_eq!(document["files"][0]["report"], Json::Null, "{file}");
        assert_eq!(document["files"][0]["diagnostics"][0]["file"], file);
        place.run(&["shader", "bench", file]).exits(1).says(file);
    }
}

#[cfg(unix)]
#[test]
fn a_file_without_permission_is_said() {
    use std::os::unix::fs::PermissionsExt;
    let place = Workplace::new();
    let path = place.file("secret.rhai", INK);
    fs::set_permissions(&path, fs::Permissions::from_mode(0o000)).expect("permissions can be set");
    if fs::read(&path).is_ok() {
        eprintln!("skipped: this user may read everything");
        return;
    }
    place.run(&["shader", "check", "secret.rhai"]).exits(1).says("secret.rhai").says("cannot read this file");
}

#[test]
fn files_of_ten_megabytes_are_refused() {
    let place = Workplace::new();
    place.file("long.rhai", format!("{INK}{}", "// ink\n".repeat(1_500_000)));
    place.file("wide.rhai", format!("fn surface(hit, p) {{ #{{ line_width: 1.0{} }} }}", " + 1.0".repeat(1_700_000)));
    let run = place.run(&["shader", "check", "long.rhai", "wide.rhai"]).exits(1);
    golden(&root().join("tests/golden/shader_check/commands/ten_megabytes.txt"), &printed(&run));
}

#[test]
fn large_scripts_are_checked_or_refused() {
    let place = Workplace::new();
    let functions = |count: usize| (0..count).map(|n| format!("fn f{n}(x) {{ x + {n}.0 }}\n")).collect::<String>();
    let surface = "fn surface(hit, p) { #{ line_width: 1.0 } }\n";
    place.file("many.rhai", functions(20_000) + surface);
    place.file("most.rhai", functions(511) + surface);
    place.file(
        "long.rhai",
        format!("fn surface(hit, p) {{ let x = 0.0;\n{}#{{ line_width: x }} }}", "x += 1.0;\n".repeat(90_000)),
    );
    place.run(&["shader", "check", "many.rhai"]).exits(1).says("at most 512 functions, and this has 20001");
    place.run(&["shader", "check", "most.rhai"]).exits(0).says("the function `f0` is never called");
    place.run(&["shader", "check", "long.rhai"]);
}

#[test]
fn parameters_can_be_set() {
    let place = Workplace::new();
    place.file("a.rhai", INK);
    let width = |setting: &str| place.run(&["shader", "check", "a.rhai", "--set", setting]).exits(0).stdout();
    assert!(width("ink_width=7").contains("constant 7 px"));
    assert!(width("ink_width = 0.25").contains("constant 0.25 px"));
}

#[test]
fn bad_flags_are_bad_usage() {
    let place = Workplace::new();
    place.file("a.rhai", INK);
    for arguments in [
        &["shader"][..],
        &["shader", "check"],
        &["shader", "check", "a.rhai", "--set", "ink_width"],
        &["shader", "check", "a.rhai", "--set", "=2"],
        &["shader", "check", "a.rhai", "--set", "ink_width="],
        &["shader", "check", "a.rhai", "--no-such-flag"],
        &["shader", "bench", "a.rhai", "--hits", "0"],
        &["shader", "bench", "a.rhai", "--hits", "many"],
        &["shader", "new"],
        &["shader", "no-such-command"],
    ] {
        place.run(arguments).exits(2);
    }
}

#[test]
fn bench_measures_each_shader() {
    let place = place_with_shaders();
    place.file("broken.rhai", BROKEN);
    place.file("fails.rhai", "fn surface(hit, p) { #{ priority: 1 / (hit.object_id - 1) } }");
    let run = place.run(&["shader", "bench", "cel.rhai", "ink.rhai", "--hits", "64"]).exits(0);
    let lines: Vec<String> = masked(&run.stdout()).lines().map(str::to_owned).collect();
    assert!(
        lines[0].starts_with("cel.rhai: ") && lines.iter().any(|line| line.starts_with("  interpreter")),
        "{lines:?}"
    );
    assert!(lines.contains(&"ink.rhai: constant".to_owned()), "{lines:?}");
    let run = place.run(&["shader", "bench", "broken.rhai", "cel.rhai", "fails.rhai", "--hits", "64", "--json"]);
    let run = run.exits(1).says("bas_color").says("division by zero");
    let document: Json = serde_json::from_str(&run.stdout()).expect("it is JSON");
    assert_eq!(document["hits"], 64);
    assert_eq!(document["shaders"].as_array().map(Vec::len), Some(1));
    let ways = document["shaders"][0]["ways"].as_array().expect("it was measured");
    for way in ways {
        let [cost, rate] = ["ns_per_hit", "mhits_per_second"].map(|key| way[key].as_f64().expect("a number"));
        assert!(cost > 0.0 && (cost * rate - 1e3).abs() < 20.0, "{way}");
    }
}

#[test]
fn new_shaders_pass_without_a_word() {
    let place = Workplace::new();
    fs::create_dir(place.folder.path().join("looks")).expect("folders can be made");
    let mut written = vec!["looks/first-look.rhai".to_owned()];
    place.run(&["shader", "new", "looks/first-look"]).exits(0).says("wrote looks/first-look.rhai");
    for name in tusche::shade::builtin::names() {
        place.run(&["shader", "new", &format!("my_{name}.rhai"), "--from", name]).exits(0);
        written.push(format!("my_{name}.rhai"));
    }
    for file in &written {
        let text = fs::read_to_string(place.folder.path().join(file)).expect("it is written");
        assert!(text.starts_with("//! ") && text.contains("fn surface(hit, p)"), "{file}");
        let run = place.run(&["shader", "check", file]).exits(0);
        assert_eq!(run.stderr(), "", "{file}");
    }
    let left = fs::read_dir(place.folder.path()).expect("it can be listed").count();
    assert_eq!(left, written.len(), "no temporary file is left");
}

#[test]
fn new_never_replaces_a_file() {
    let place = Workplace::new();
    let path = place.file("look.rhai", "mine");
    place.run(&["shader", "new", "look"]).exits(1).says("look.rhai").says("there already");
    assert_eq!(fs::read(&path).expect("it is still there"), b"mine");
    fs::create_dir(place.folder.path().join("dir.rhai")).expect("folders can be made");
    place.run(&["shader", "new", "dir"]).exits(1).says("there already");
    place.run(&["shader", "new", "no/such/look"]).exits(1).says("no/such/look.rhai").says("make the folder first");
    for name in ["", "a b", "a.b", ".hidden", "looks/", "é\u{301}?", "-x", &"x".repeat(200)] {
        place.run(&["shader", "new", "--", name]).exits(2).says("is no name for a shader");
    }
    place.run(&["shader", "new", "x", "--from", "celo"]).exits(2).says("did you mean `cel`?");
    place.run(&["shader", "new", "x", "--from", "something else"]).exits(2).says("template, cel, ");
}

#[cfg(unix)]
#[test]
fn a_reader_that_goes_away_is_no_failure() {
    let place = Workplace::new();
    place.file("a.rhai", INK);
    let files = "a.rhai ".repeat(50);
    for command in ["shader check", "shader check --json", "shader bench --hits 1"] {
        let tusche = env!("CARGO_BIN_EXE_tusche");
        let line = format!("{tusche} {command} {files} | head -c 1 >/dev/null; exit ${{PIPESTATUS[0]}}");
        let run = std::process::Command::new("bash").args(["-c", &line]).current_dir(place.folder.path()).status();
        assert_eq!(run.expect("bash can be run").code(), Some(0), "{command}");
    }
}

#[test]
fn the_reference_is_printed_for_terminals_and_as_markdown() {
    let place = Workplace::new();
    let markdown = place.run(&["shader", "reference", "--markdown"]).exits(0).stdout();
    assert_eq!(markdown, tusche::shade::reference::markdown());
    let text = place.run(&["shader", "reference"]).exits(0).stdout();
    assert!(!text.contains("|---") && !text.contains("```"));
    for (name, _) in tusche::shade::InputSet::named() {
        assert!(text.lines().any(|line| line.split(' ').next() == Some(name)), "{name} is missing");
    }
    for function in tusche::shade::library::functions() {
        assert!(text.contains(function.form), "{} is missing", function.form);
    }
}
