//! The line pass: oracle against text, search against oracle, both against areas that are known.

mod equal;
pub mod picture;
