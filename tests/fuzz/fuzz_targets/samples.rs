//! Whatever the samples: the search draws what brute force draws.
#![no_main]

#[path = "../inputs.rs"]
#[allow(dead_code, reason = "each target uses one of its functions")]
mod inputs;
#[path = "../../line/picture.rs"]
#[allow(dead_code, reason = "tests use the rest")]
mod picture;

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    inputs::samples(bytes);
});
