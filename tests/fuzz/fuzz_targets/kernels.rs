//! Whatever the script and the hits: a kernel gives the interpreter's bits.
#![no_main]

#[path = "../agree.rs"]
mod agree;
#[path = "../scripts.rs"]
mod scripts;

use libfuzzer_sys::fuzz_target;
use tusche::shade::OutputSet;

fuzz_target!(|bytes: &[u8]| {
    let script = scripts::script(bytes);
    let seed = bytes.iter().fold(bytes.len() as u64, |seed, byte| seed.wrapping_mul(31).wrapping_add((*byte).into()));
    let hits = agree::hits(1 + bytes.len() % 33, &mut agree::Random(seed));
    if let Err(difference) = agree::compare(&script, &hits, OutputSet::all()) {
        panic!("{difference}\n{script}");
    }
    let script = scripts::line_script(bytes);
    let lines = agree::pairs(1 + bytes.len() % 33, &mut agree::Random(seed));
    if let Err(difference) = agree::compare_lines(&script, &lines) {
        panic!("{difference}\n{script}");
    }
});
