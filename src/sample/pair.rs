//! Seen lines as columns: what the line pass tells a script's `line(pair, p)` of them (DESIGN section 3.6).

use super::path::NodePath;
use crate::scene::settings::LineType;

/// Seen lines that one material styles, one a row. Columns that the script does not read may be empty; each filled one has
/// [`PairBatch::len`] rows. Units and spaces are documented at [`PAIR_INPUTS`](crate::shade::names::PAIR_INPUTS).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PairBatch {
    /// Number of rows.
    pub len: usize,
    /// What kind of feature the line marks.
    pub kind: Vec<LineType>,
    /// At which path the line was found.
    pub path: Vec<NodePath>,
    /// From the edge to the line's border: 0 … 1.
    pub distance: Vec<f32>,
    /// Whether the sample itself is of the surface that styles the line.
    pub own: Vec<bool>,
    /// Full width in pixels.
    pub width: Vec<f32>,
    /// The line's colour, linear, without tint.
    pub color: Vec<[f32; 3]>,
    /// The line's opacity, that of a thin line included: 0 … 1.
    pub opacity: Vec<f32>,
    /// Where in the picture the sample lies, in pixels.
    pub pixel: Vec<[f32; 2]>,
    /// The surface that styles the line, and what lies across the edge.
    pub sides: [PairSide; 2],
}

/// One side of seen lines.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PairSide {
    /// 1 + object id; 0 is a miss.
    pub object: Vec<u32>,
    /// 1 + material id; 0 is a miss.
    pub material: Vec<u32>,
    /// Path length from the camera; of a miss, [`PairSide::FARTHEST`].
    pub depth: Vec<f32>,
    /// World space.
    pub position: Vec<[f32; 3]>,
    /// Unit shading normals, world space.
    pub normal: Vec<[f32; 3]>,
    /// Feature colours.
    pub feature: Vec<[f32; 3]>,
}

impl PairSide {
    /// The depth that scripts see where there is no surface: they never get an infinite input.
    pub const FARTHEST: f32 = 1e18;
}
