//! Pixel filters.

use crate::scene::settings::FilterKind;

/// A separable reconstruction filter, zero at and beyond its radius.
#[derive(Clone, Debug, PartialEq)]
pub struct Filter {
    kind: FilterKind,
    radius: f32,
}

impl Filter {
    /// A filter; `radius` in pixels, > 0.
    #[must_use]
    pub fn new(kind: FilterKind, radius: f32) -> Self {
        Self { kind, radius }
    }

    /// How many whole pixels around a pixel hold samples that can reach it.
    #[must_use]
    pub fn reach(&self) -> i32 {
        (self.radius - 0.5).ceil().max(0.0) as i32
    }
}
