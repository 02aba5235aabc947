//! Scripts that come with Tusche.
use std::sync::Arc;

use crate::diag::Source;

/// Names of the built-in scripts.
#[must_use]
pub fn names() -> &'static [&'static str] {
    &["default"]
}

/// The built-in script of a name.
#[must_use]
pub fn source(name: &str) -> Option<Arc<Source>> {
    (name == "default").then(|| Source::new("<builtin:default>", "fn surface(hit, p) { #{} }"))
}
