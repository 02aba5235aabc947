//! Kernels against the interpreter: the same bits, whatever the script.

#[path = "../fuzz/agree.rs"]
pub mod agree;
mod cases;
mod lines;
#[path = "../fuzz/scripts.rs"]
mod scripts;

use std::collections::BTreeMap;

use rayon::prelude::*;
use tusche::shade::OutputSet;

use self::agree::{Random, Verdict, compare, hits};

/// How many random scripts are compared; the fuzz target does the same without end.
const SCRIPTS: u64 = 2400;

/// Bytes that spell a script.
fn bytes(random: &mut Random) -> Vec<u8> {
    let length = 40 + random.next() % 500;
    (0..length).map(|_| (random.next() >> 32) as u8).collect()
}

/// A script at random, from its number.
fn compare_random(seed: u64) -> (String, Result<Verdict, String>) {
    let mut random = Random(seed);
    let script = scripts::script(&bytes(&mut random));
    let len = [1, 7, 16, 33][(random.next() % 4) as usize];
    let hits = hits(len, &mut random);
    let wanted = if seed.is_multiple_of(3) { OutputSet::LINE_WIDTH | OutputSet::COLOR } else { OutputSet::all() };
    let verdict = compare(&script, &hits, wanted);
    (script, verdict)
}

/// A script that styles lines at random, from its number.
fn compare_random_lines(seed: u64) -> (String, Result<Verdict, String>) {
    let mut random = Random(seed);
    let script = scripts::line_script(&bytes(&mut random));
    let len = [1, 7, 16, 33][(random.next() % 4) as usize];
    let pairs = agree::pairs(len, &mut random);
    let verdict = agree::compare_lines(&script, &pairs);
    (script, verdict)
}

/// How many scripts are tried.
fn count_of(usual: u64) -> u64 {
    std::env::var("TUSCHE_SCRIPTS").ok().and_then(|text| text.parse().ok()).unwrap_or(usual)
}

#[test]
fn random_scripts_give_the_same_bits() {
    assert_agree(count_of(SCRIPTS), compare_random, 80);
}

#[test]
fn random_scripts_style_lines_with_the_same_bits() {
    assert_agree(count_of(SCRIPTS / 4), compare_random_lines, 80);
}

/// Tries scripts; of a hundred, `least` must have run as kernels.
fn assert_agree(count: u64, try_one: impl Fn(u64) -> (String, Result<Verdict, String>) + Sync, least: u64) {
    let verdicts: Vec<_> = (0..count).into_par_iter().map(|seed| (seed, try_one(seed))).collect();
    let mut kernels = 0;
    let mut reasons: BTreeMap<String, u32> = BTreeMap::new();
    let mut failures = Vec::new();
    for (seed, (script, verdict)) in verdicts {
        match verdict {
            Ok(Verdict::Agrees) => kernels += 1,
            Ok(Verdict::Interpreted(blame)) => {
                let what = blame.split_once(": ").map_or(blame.as_str(), |(_, what)| what);
                *reasons.entry(what.to_owned()).or_default() += 1;
            }
            Ok(Verdict::Constant) => *reasons.entry("constant".into()).or_default() += 1,
            Ok(Verdict::Refused(why)) => {
                *reasons.entry(format!("refused: {}", why.lines().next().unwrap_or_default())).or_default() += 1
            }
            Err(what) => failures.push((script.len(), format!("script {seed}: {what}\n{script}"))),
        }
    }
    println!("{kernels} of {count} ran as kernels; of the others: {reasons:#?}");
    failures.sort();
    if std::env::var_os("TUSCHE_ALL").is_some() {
        failures.iter().take(20).for_each(|(_, failure)| println!("{failure}\n"));
    }
    if let Some((_, shortest)) = failures.first() {
        panic!("{} of {count} scripts differ; the shortest is {shortest}", failures.len());
    }
    assert!(kernels * 100 >= count * least, "only {kernels} of {count} scripts ran as kernels: {reasons:#?}");
}
