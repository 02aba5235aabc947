//! Exact output of `tusche shader check`. `TUSCHE_BLESS=1 cargo test --test tests shader_check` writes what is printed now.
//!
//! - `tests/golden/shader_check/NAME.txt` is what is printed of the shipped shader NAME.
//! - `faults/*.txt` and `warnings/*.txt` hold a script (first its `--set` arguments, if any) and, below a line of dashes,
//!   what is printed of it.

use std::path::Path;

use super::{place_with_shaders, printed};
use crate::common::{Workplace, root};

const RULE: &str = "\n----------------------------------------\n";

#[test]
fn shipped_shaders() {
    let place = place_with_shaders();
    let mut failed = Vec::new();
    for name in tusche::shade::builtin::names() {
        let file = format!("{name}.rhai");
        let run = place.run(&["shader", "check", &file]).exits(0);
        assert_eq!(run.stderr(), "", "{name}");
        let path = root().join(format!("tests/golden/shader_check/{name}.txt"));
        let recorded = std::fs::read_to_string(&path).unwrap_or_default();
        failed.extend(settle(&path, "", &recorded, &printed(&run)));
    }
    assert!(failed.is_empty(), "{} reports changed:\n{}", failed.len(), failed.join("\n"));
}

/// Compares a recorded text with what is printed now. Where they differ, says so, and blesses if asked to: `before` is
/// what stands in the file above the text.
fn settle(path: &Path, before: &str, recorded: &str, now: &str) -> Option<String> {
    if now == recorded {
        return None;
    }
    if std::env::var_os("TUSCHE_BLESS").is_some() {
        std::fs::write(path, format!("{before}{now}")).expect("goldens can be written");
    }
    Some(format!("{}\n--- recorded\n{recorded}\n--- now\n{now}", path.display()))
}

#[test]
fn faults_are_errors() {
    compare("faults", 1, 40);
}

#[test]
fn warnings_are_no_errors() {
    compare("warnings", 0, 15);
}

/// Compares all goldens of a folder, which has at least `count`, and their exit code.
fn compare(folder: &str, code: i32, count: usize) {
    let folder = root().join("tests/golden/shader_check").join(folder);
    let entries = std::fs::read_dir(&folder).expect("the goldens are there");
    let mut files: Vec<_> = entries.map(|entry| entry.expect("it can be listed").path()).collect();
    files.sort();
    assert!(files.len() >= count, "goldens are missing");
    let mut failed = Vec::new();
    for path in files {
        let text = std::fs::read_to_string(&path).expect("goldens are text");
        let (input, recorded) = text.split_once(RULE).unwrap_or((&text, ""));
        let (settings, script): (Vec<&str>, Vec<&str>) = input.lines().partition(|line| line.starts_with("--set "));
        let place = Workplace::new();
        place.file("look.rhai", script.join("\n"));
        let mut arguments = vec!["shader", "check", "look.rhai"];
        arguments.extend(settings.iter().flat_map(|line| ["--set", line.trim_start_matches("--set ")]));
        let now = printed(&place.run(&arguments).exits(code));
        failed.extend(settle(&path, &format!("{input}{RULE}"), recorded, &now));
    }
    assert!(failed.is_empty(), "{} messages changed:\n{}", failed.len(), failed.join("\n"));
}
