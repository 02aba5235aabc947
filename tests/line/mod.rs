//! The line pass: oracle against text, search against oracle, both against areas that are known.

mod area;
mod baselines;
mod buffer;
mod equal;
mod lists;
pub mod picture;
mod seen;
