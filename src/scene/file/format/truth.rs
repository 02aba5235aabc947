//! `[truth]`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{FAR, TINY};
use crate::scene::check::MAX_LINE_WIDTH;

/// The lines that the picture must show, known by geometry: what `tusche study` measures lines against. A render does not look at it.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(in super::super) struct Truth {
    /// Full width of its lines in pixels. Default: `width` of `[lines]`.
    #[schemars(range(max = MAX_LINE_WIDTH), extend("exclusiveMinimum" = 0))]
    pub width: Option<f64>,
    /// Lines along straight edges. Where lines cross, they are one.
    #[serde(default)]
    pub edges: Vec<TruthEdge>,
    /// Lines around discs and balls.
    #[serde(default)]
    pub discs: Vec<TruthDisc>,
}

/// A line along straight edges.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(in super::super) struct TruthEdge {
    /// The points that the edges join: each a place in the world [x, y, z], or on the film [x, y] in pixels from its upper left
    /// corner.
    #[schemars(length(min = 2), inner(length(min = 2, max = 3), inner(range(min = -FAR, max = FAR))))]
    pub points: Vec<Vec<f64>>,
    /// Whether an edge joins the last point and the first, too.
    #[serde(default)]
    pub closed: bool,
    /// Full width in pixels. Default: that of `[truth]`.
    #[schemars(range(max = MAX_LINE_WIDTH), extend("exclusiveMinimum" = 0))]
    pub width: Option<f64>,
}

/// A line around a disc: either the outline of an `object`, or a circle on the film by `center` and `radius`.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(in super::super) struct TruthDisc {
    /// Name of an object of this file that is a sphere or a disc and is seen whole.
    pub object: Option<String>,
    /// Its middle on the film, in pixels from the upper left corner.
    #[schemars(inner(range(min = -FAR, max = FAR)))]
    pub center: Option<[f64; 2]>,
    /// Its radius in pixels.
    #[schemars(range(min = TINY, max = FAR))]
    pub radius: Option<f64>,
    /// Full width in pixels. Default: that of `[truth]`.
    #[schemars(range(max = MAX_LINE_WIDTH), extend("exclusiveMinimum" = 0))]
    pub width: Option<f64>,
}
