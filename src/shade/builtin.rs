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
    "pencil",
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

/// Modules that built-in and other scripts can import.
const MODULES: &[(&str, &str)] = &[("lib/hatching", include_str!("../../shaders/lib/hatching.rhai"))];

/// The names of the modules, sorted.
#[must_use]
pub fn module_names() -> Vec<&'static str> {
    MODULES.iter().map(|(name, _)| *name).collect()
}

/// A module by its name; messages call it `builtin:` and the name.
#[must_use]
pub fn module(name: &str) -> Option<Arc<Source>> {
    let (_, text) = MODULES.iter().find(|(known, _)| *known == name)?;
    Some(Source::new(format!("builtin:{name}"), *text))
}
