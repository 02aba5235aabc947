//! Paths: which reflections and refractions led to a node.

use std::fmt;

/// The path of a node: `""` at the camera ray's hit, then one letter per event, `R` reflected or `T` transmitted.
///
/// Kept as the letters' bits (R = 0, T = 1) behind a leading 1, so that numeric order is breadth-first order with
/// reflections before refractions: `""`, `R`, `T`, `RR`, `RT`, `TR`, `TT`, … (OG18 section 3.4).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodePath(u32);

impl NodePath {
    /// The camera ray's own hit.
    pub const CAMERA: Self = Self(1);

    /// This path and then a mirror reflection. Paths have at most 30 letters.
    #[must_use]
    pub fn reflected(self) -> Self {
        Self(self.0 << 1)
    }

    /// This path and then a refraction, or straight on through a see-through surface.
    #[must_use]
    pub fn refracted(self) -> Self {
        Self(self.0 << 1 | 1)
    }

    /// Number of letters.
    #[must_use]
    pub fn depth(self) -> u32 {
        self.0.ilog2()
    }

    /// Whether the last event was a reflection; `None` for the camera's path.
    #[must_use]
    pub fn ends_reflected(self) -> Option<bool> {
        (self != Self::CAMERA).then_some(self.0 & 1 == 0)
    }
}

impl fmt::Display for NodePath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for i in (0..self.depth()).rev() {
            f.write_str(if self.0 >> i & 1 == 0 { "R" } else { "T" })?;
        }
        Ok(())
    }
}
