//! The line pass: oracle against text, search against oracle, both against areas that are known.

mod area;
mod bad_input;
mod baselines;
mod buffer;
mod convergence;
mod equal;
mod lists;
mod objects;
mod overlap;
pub mod picture;
mod scripts;
mod seen;
mod through;
