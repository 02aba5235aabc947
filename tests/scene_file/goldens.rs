//! Exact messages: each file in `tests/golden/scene_file` holds a scene, and below a line of dashes what is said about it.
//!
//! Lines that start with `--set` or `--camera` at the top are arguments. `TUSCHE_BLESS=1 cargo test` writes what is said now.

use std::fmt::Write as _;
use std::path::Path;

use tusche::scene::file::LoadOptions;

const RULE: &str = "\n----------------------------------------\n";

#[test]
fn messages_are_as_recorded() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden/scene_file");
    let mut files: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    assert!(files.len() > 20, "the goldens are missing");
    let mut failed = Vec::new();
    for path in files {
        let text = std::fs::read_to_string(&path).unwrap();
        let (input, recorded) = text.split_once(RULE).unwrap_or((&text, ""));
        let said = said_about(input);
        if said == recorded {
            continue;
        }
        if std::env::var_os("TUSCHE_BLESS").is_some() {
            std::fs::write(&path, format!("{input}{RULE}{said}")).unwrap();
        }
        failed.push(format!("{}\n--- recorded\n{recorded}\n--- now\n{said}", path.display()));
    }
    assert!(failed.is_empty(), "{} messages changed:\n{}", failed.len(), failed.join("\n"));
}

fn said_about(input: &str) -> String {
    let (arguments, scene): (Vec<_>, Vec<_>) = input.lines().partition(|line| line.starts_with("--"));
    let overrides: Vec<_> = arguments.iter().filter_map(|line| line.strip_prefix("--set ")).collect();
    let camera = arguments.iter().find_map(|line| line.strip_prefix("--camera "));
    let options = LoadOptions { camera: camera.map(str::to_owned), ..LoadOptions::default() };
    let (verdict, diagnostics) = match super::load_with(&scene.join("\n"), &overrides, &options) {
        Ok((_, warnings)) => ("loaded", warnings),
        Err(faults) => ("not loaded", faults),
    };
    let mut said = format!("{verdict}\n");
    for diagnostic in diagnostics.0 {
        writeln!(said, "\n{}", diagnostic.render(false)).unwrap();
    }
    said
}
