//! The shaders that are built into Tusche: the files of `shaders/`, by name.

use std::sync::Arc;

use crate::diag::Source;

macro_rules! shaders {
    ($($name:literal),* $(,)?) => {
        const NAMES: &[&str] = &[$($name),*];
        const TEXTS: &[&str] = &[$(include_str!(concat!("../../shaders/", $name, ".rhai"))),*];
    };
}

shaders![
    "cel",
    "default",
    "glass",
    "hatch",
    "ink",
    "light_driven_width",
    "lit_shadow",
    "mirror",
    "noise_width",
    "polygon_ids",
    "uv_lines",
];

/// The names, sorted.
#[must_use]
pub fn names() -> &'static [&'static str] {
    NAMES
}

/// A shader by its name; messages call it `builtin:` and the name.
#[must_use]
pub fn source(name: &str) -> Option<Arc<Source>> {
    let index = NAMES.iter().position(|known| *known == name)?;
    Some(Source::new(format!("builtin:{name}"), TEXTS[index]))
}
