//! Hard cases stay numerically stable (DESIGN section 7).
//!
//! Each file holds a family of cases. A case measures one figure, a number of faults or a largest error, the same in every
//! run and on every machine; it must not exceed its bound. Where a bound is that of a known limit, the table says so; such bounds are there to be lowered.
//!
//! `TUSCHE_RAYS=10000000` traces that many rays in cases that count leaks, `TUSCHE_SCENES=1000` makes that many random
//! scenes, `TUSCHE_CASE=glass` measures only cases whose name holds the word.

mod acne;
mod cameras;
mod edges;
mod film;
mod fuzz;
mod glass;
mod lines;
mod place;
mod random_scenes;
mod scripts;
mod ties;
mod transforms;
mod triangles;
mod uv;

use std::panic::catch_unwind;

use rayon::prelude::*;
use tusche::math::Vec3;

use crate::common::{Picture, golden, root};
use crate::trace::random;

/// Where the table of the last run is kept.
const TABLE: &str = "tests/golden/stability/table.md";

/// A hard case.
struct Case {
    name: &'static str,
    /// What a picture would show if it went wrong.
    wrong: &'static str,
    /// What the figure counts or measures.
    unit: &'static str,
    /// The largest figure that is accepted.
    bound: f64,
    figure: fn() -> f64,
}

/// A number from the environment, for longer runs.
fn count_from(variable: &str, usual: u64) -> u64 {
    std::env::var(variable).ok().and_then(|text| text.parse().ok()).unwrap_or(usual)
}

/// A random point of the cube −1 … 1.
fn random_point(state: &mut u64) -> Vec3 {
    Vec3::new(random(state), random(state), random(state))
}

/// How many values of a picture are not finite.
fn not_finite(picture: &Picture) -> usize {
    picture.channels.iter().flatten().filter(|value| !value.is_finite()).count()
}

/// The largest difference of two pictures in any channel; ∞ if one has NaN where the other has not.
fn largest_difference(a: &Picture, b: &Picture) -> f64 {
    let pairs = a.channels.iter().flatten().zip(b.channels.iter().flatten());
    pairs
        .filter(|(a, b)| a.to_bits() != b.to_bits())
        .map(|(a, b)| f64::from((a - b).abs()))
        .map(|difference| if difference.is_nan() { f64::INFINITY } else { difference })
        .fold(0.0, f64::max)
}

/// How many values of two pictures differ by more than `tolerance`.
fn differing(a: &Picture, b: &Picture, tolerance: f32) -> usize {
    assert_eq!(a.channels.len(), b.channels.len());
    let pairs = a.channels.iter().flatten().zip(b.channels.iter().flatten());
    pairs
        .filter(|(a, b)| {
            let off = (*a - *b).abs();
            a.to_bits() != b.to_bits() && (off.is_nan() || off > tolerance)
        })
        .count()
}

/// A figure as the table shows it.
fn shown(figure: f64) -> String {
    if figure.fract() == 0.0 && figure.abs() < 1e9 { format!("{figure}") } else { format!("{figure:.0e}") }
}

#[test]
fn every_hard_case_stays_within_its_bound() {
    let all: Vec<Case> = [
        edges::CASES,
        acne::CASES,
        triangles::CASES,
        uv::CASES,
        transforms::CASES,
        ties::CASES,
        place::CASES,
        cameras::CASES,
        glass::CASES,
        lines::CASES,
        film::CASES,
        scripts::CASES,
        random_scenes::CASES,
    ]
    .into_iter()
    .flatten()
    .map(|case| Case { ..*case })
    .collect();
    let word = std::env::var("TUSCHE_CASE").ok();
    let cases: Vec<&Case> =
        all.iter().filter(|case| word.as_ref().is_none_or(|word| case.name.contains(word))).collect();
    let figures: Vec<f64> = cases.par_iter().map(|case| catch_unwind(case.figure).unwrap_or(f64::INFINITY)).collect();

    let mut table = String::from("| case | what would go wrong | figure | bound | counted |\n|---|---|---|---|---|\n");
    let mut broken = Vec::new();
    for (case, figure) in cases.iter().zip(&figures) {
        let Case { name, wrong, unit, bound, .. } = case;
        table += &format!("| {name} | {wrong} | {} | {} | {unit} |\n", shown(*figure), shown(*bound));
        if figure.is_nan() || figure > bound {
            broken.push(format!("{name}: {figure} is more than {bound} ({unit})"));
        }
    }
    println!("{table}");
    assert!(broken.is_empty(), "out of bounds:\n{}", broken.join("\n"));
    // The table of a usual run is a golden text.
    if ["TUSCHE_CASE", "TUSCHE_RAYS", "TUSCHE_SCENES"].iter().all(|name| std::env::var_os(name).is_none()) {
        golden(&root().join(TABLE), &table);
    }
}

#[test]
fn the_readme_shows_the_table() {
    let text =
        |path: &str| std::fs::read_to_string(root().join(path)).unwrap_or_else(|fault| panic!("{path}: {fault}"));
    assert!(text("README.md").contains(&text(TABLE)), "the table of hard cases in README.md is not that of {TABLE}");
}
