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

    /// Whether one of the events is a reflection.
    #[must_use]
    pub fn has_reflection(self) -> bool {
        self.0.count_zeros() > self.0.leading_zeros()
    }

    /// Whether one of the events is a refraction.
    #[must_use]
    pub fn has_refraction(self) -> bool {
        self.0.count_ones() > 1
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_is_breadth_first_with_reflections_first() {
        let mut paths = vec![NodePath::CAMERA];
        for i in 0..7 {
            let path: NodePath = paths[i];
            paths.extend([path.reflected(), path.refracted()]);
        }
        let spelled: Vec<_> = paths.iter().map(ToString::to_string).collect();
        assert_eq!(spelled.join(" "), " R T RR RT TR TT RRR RRT RTR RTT TRR TRT TTR TTT");
        assert!(paths.is_sorted());
    }

    #[test]
    fn letters_are_found_wherever_they_stand() {
        let [camera, r, t] = [NodePath::CAMERA, NodePath::CAMERA.reflected(), NodePath::CAMERA.refracted()];
        let found = [camera, r, t, r.reflected(), r.refracted(), t.reflected(), t.refracted()]
            .map(|path| (path.has_reflection(), path.has_refraction()));
        let (yes, no) = (true, false);
        assert_eq!(found, [(no, no), (yes, no), (no, yes), (yes, no), (yes, yes), (yes, yes), (no, yes)]);
        assert_eq!([camera, r, t].map(NodePath::ends_reflected), [None, Some(true), Some(false)]);
    }
}
