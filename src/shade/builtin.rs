//! The shaders that come with Tusche, embedded in the binary.

use std::sync::Arc;

use crate::diag::Source;

/// The source of a built-in shader, named `<builtin:NAME>` in messages.
#[must_use]
pub fn source(name: &str) -> Option<Arc<Source>> {
    (name == "default").then(|| Source::new("<builtin:default>", include_str!("../../shaders/default.rhai")))
}

/// The names of all built-in shaders.
#[must_use]
pub fn names() -> &'static [&'static str] {
    &["default"]
}
