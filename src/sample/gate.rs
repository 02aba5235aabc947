//! The gate: the one place where NaN, infinity and absurd numbers from scripts are stopped (DESIGN section 3.7).
//!
//! Neutral values: a colour component, feature component, uv or AOV that is NaN or infinite becomes 0; a width that is
//! NaN, infinite or negative becomes 0 (no line); a normal that is not finite or has no length becomes +Z; a width
//! above the largest is clamped to it. Everything stopped is counted by material.

/// What the gate stopped, for one material (or summed).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GateCounts {
    /// Nodes with at least one NaN.
    pub nan: u64,
    /// Nodes with at least one infinity.
    pub infinite: u64,
    /// Nodes with a negative line width.
    pub negative: u64,
    /// Nodes whose line width was clamped to `max_width`.
    pub clamped_widths: u64,
}

impl std::ops::AddAssign for GateCounts {
    fn add_assign(&mut self, other: Self) {
        self.nan += other.nan;
        self.infinite += other.infinite;
        self.negative += other.negative;
        self.clamped_widths += other.clamped_widths;
    }
}
