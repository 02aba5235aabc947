//! The fuzz targets of `tests/fuzz`, run on inputs that a seed makes from small files.

#[path = "../fuzz/inputs.rs"]
mod inputs;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

use super::count_from;
use crate::common::root;
use crate::gltf::glb;
use crate::line::picture;

/// Numbers from a seed.
struct Dice(u64);

impl Dice {
    fn below(&mut self, count: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % count.max(1)
    }
}

/// Words that files are made of, and values at the ends of ranges.
const WORDS: [&str; 40] = [
    "nan",
    "inf",
    "-inf",
    "-1",
    "0",
    "1",
    "2",
    "255",
    "65535",
    "4294967295",
    "-2147483649",
    "1e308",
    "1e39",
    "-1e-46",
    "0.0",
    "\"\"",
    "[]",
    "{}",
    "null",
    "true",
    "\n",
    "=",
    ",",
    "]",
    "}",
    "\"",
    "[[objects]]\n",
    "[camera]\n",
    "shape",
    "\"sphere\"",
    "é",
    "\u{0}",
    "\\u0000",
    "\u{2028}",
    "POSITION",
    "\"VEC3\"",
    "5126",
    "5123",
    "builtin:",
    "1_000",
];

fn change(bytes: &mut Vec<u8>, others: &[Vec<u8>], dice: &mut Dice) {
    let at = dice.below(bytes.len() + 1);
    let end = (at + 1 + dice.below(12)).min(bytes.len());
    match dice.below(9) {
        0 if at < bytes.len() => bytes[at] ^= 1 << dice.below(8),
        1 if at < bytes.len() => bytes[at] = [0, 1, 127, 128, 255][dice.below(5)],
        2 => drop(bytes.drain(at.min(end)..end)),
        3 => {
            let again = bytes[at.min(end)..end].to_vec();
            let to = dice.below(bytes.len() + 1);
            drop(bytes.splice(to..to, again));
        }
        4 => {
            let other = &others[dice.below(others.len())];
            let from = dice.below(other.len());
            let piece = other[from..(from + 1 + dice.below(60)).min(other.len())].to_vec();
            drop(bytes.splice(at..at, piece));
        }
        5 => bytes.truncate(at.max(1)),
        6 => drop(bytes.splice(at..at, WORDS[dice.below(WORDS.len())].bytes())),
        // A word or number gives way to another.
        _ => {
            let of_word = |byte: &u8| byte.is_ascii_alphanumeric() || b"+-._".contains(byte);
            let Some(start) = (at..bytes.len()).find(|&place| of_word(&bytes[place])) else { return };
            let end = (start..bytes.len()).find(|&place| !of_word(&bytes[place])).unwrap_or(bytes.len());
            drop(bytes.splice(start..end, WORDS[dice.below(WORDS.len())].bytes()));
        }
    }
}

/// The files of a folder of `tests/fuzz/seeds`, sorted.
fn seeds_of(name: &str) -> Vec<Vec<u8>> {
    let folder = root().join("tests/fuzz/seeds").join(name);
    let entries = std::fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut paths: Vec<_> = entries.map(|entry| entry.expect("it can be listed").path()).collect();
    paths.sort();
    paths.iter().map(|path| std::fs::read(path).expect("seeds can be read")).collect()
}

/// Runs a target on inputs made by `make` from their numbers; all that panic are told at once. A tenth must be accepted, or
/// little but the reading of syntax is tried.
fn run(usual: u64, make: impl Fn(&mut Dice) -> Vec<u8> + Sync, target: impl Fn(&[u8]) -> bool + Sync) {
    let accepted = AtomicU64::new(0);
    let first = count_from("TUSCHE_FIRST_INPUT", 0);
    let last = first + count_from("TUSCHE_INPUTS", usual);
    let mut findings: Vec<String> = (first..last)
        .into_par_iter()
        .filter_map(|number| {
            let bytes = make(&mut Dice(number.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(number)));
            let outcome = catch_unwind(AssertUnwindSafe(|| target(&bytes)));
            accepted.fetch_add(u64::from(*outcome.as_ref().unwrap_or(&false)), Ordering::Relaxed);
            outcome.err().map(|_| format!("input {number}:\n{}\n", String::from_utf8_lossy(&bytes)))
        })
        .collect();
    findings.truncate(5);
    assert!(findings.is_empty(), "panics, above, came of:\n{}", findings.join("\n"));
    let accepted = accepted.into_inner();
    assert!(accepted * 10 >= last - first, "{accepted} of {} inputs are accepted", last - first);
}

/// One to four changes, now and then none.
fn changed(seeds: &[Vec<u8>], dice: &mut Dice) -> Vec<u8> {
    let mut bytes = seeds[dice.below(seeds.len())].clone();
    for _ in 0..dice.below(5) {
        change(&mut bytes, seeds, dice);
    }
    bytes
}

#[test]
fn scene_files_give_a_scene_or_diagnostics() {
    let seeds = seeds_of("scene_file");
    for seed in &seeds {
        assert!(inputs::scene_file(seed), "a scene of the seeds is not read:\n{}", String::from_utf8_lossy(seed));
    }
    run(600, |dice| changed(&seeds, dice), inputs::scene_file);
}

#[test]
fn models_give_a_scene_or_diagnostics() {
    let texts = seeds_of("model");
    for seed in &texts {
        assert!(inputs::model(seed), "a model of the seeds is not read:\n{}", String::from_utf8_lossy(seed));
    }
    let make = |dice: &mut Dice| {
        let text = changed(&texts, dice);
        if dice.below(3) > 0 {
            return text;
        }
        let mut binary = glb(&text, Some(&[7; 64]));
        if dice.below(2) == 0 {
            change(&mut binary, &texts, dice);
        }
        binary
    };
    run(1000, make, inputs::model);
}

#[test]
fn any_samples_have_the_same_lines_by_search_and_by_brute_force() {
    let make = |dice: &mut Dice| {
        let length = 60 + dice.below(900);
        // Small bytes are frequent, so that values are often equal and, at 0, any float.
        (0..length).map(|_| if dice.below(3) == 0 { dice.below(4) } else { dice.below(256) } as u8).collect()
    };
    run(600, make, |bytes| {
        inputs::samples(bytes);
        true
    });
}
