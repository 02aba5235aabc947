//! `[lines]`, and what materials change about it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{BRIGHT, Color};
use crate::scene::check::{MAX_LINE_WIDTH, MAX_SURFACES};

/// `[lines]`: what draws a line, and how lines look where a script does not say.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(in crate::scene::file) struct Lines {
    /// Colour of lines whose script gives none.
    pub color: Color,
    /// Full width in pixels of lines whose script gives none; 0 is no line.
    #[schemars(range(min = 0, max = MAX_LINE_WIDTH))]
    pub width: f64,
    /// Widest line in pixels; wider requests are clamped.
    #[schemars(range(min = 0, max = MAX_LINE_WIDTH))]
    pub max_width: f64,
    /// Thinner lines are drawn this wide, in pixels, and more transparent.
    #[schemars(range(min = 0, max = MAX_LINE_WIDTH))]
    pub min_width: f64,
    /// Widens lines so that they come out as wide as asked for in spite of the finite number of samples.
    pub width_compensation: bool,
    /// Lines where two objects meet in the picture.
    pub object: bool,
    /// Lines where two materials meet in the picture.
    pub shader: bool,
    /// Lines where texture coordinates differ by more than this distance.
    pub uv: Threshold,
    /// Lines where shading normals differ by more than this angle in degrees, at most 180.
    pub normal: Threshold,
    /// Lines where any channel of the scripts' feature colours differs by more than this.
    pub feature: Threshold,
    /// Lines where an object (or a group) folds over itself: the nearer sample lies above the tangent plane of the other
    /// by more than this times the width of a pixel there and the samples' distance in pixels. 2 is a good start.
    pub overlap: Threshold,
    /// Which rays see lines.
    pub paths: Vec<LinePath>,
    /// Whether lines in reflections and refractions take the colour of what reflects and refracts them.
    pub tint: bool,
    /// How lines in reflections and refractions enter the picture.
    pub compose: Compose,
    /// What types of lines change about what their shaders ask for.
    pub types: LineTypes,
    /// How many surfaces along a ray take part in the tests. With 1, a line is lost where an object that draws none covers
    /// what would tell of it. While only objects and materials are compared, an object counts once for each material,
    /// where the ray first meets it; else each time the ray meets it.
    #[schemars(range(min = 1, max = MAX_SURFACES))]
    pub surfaces: u32,
    /// Draws lines of what is hidden, in a style of their own, where no other line is. Needs `surfaces` above 1.
    pub hidden: Option<HiddenLines>,
}

impl Default for Lines {
    fn default() -> Self {
        Self {
            color: Color([0.0; 3]),
            width: 2.0,
            max_width: 8.0,
            min_width: 0.5,
            width_compensation: true,
            object: true,
            shader: true,
            uv: Threshold::Off(false),
            normal: Threshold::Off(false),
            feature: Threshold::Off(false),
            overlap: Threshold::Off(false),
            paths: vec![LinePath::Camera, LinePath::Reflection, LinePath::Refraction],
            tint: true,
            compose: Compose::Replace,
            types: LineTypes::default(),
            surfaces: 1,
            hidden: None,
        }
    }
}

/// Styles by the strongest reason why a line is there.
#[derive(Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(in crate::scene::file) struct LineTypes {
    /// Lines along the background.
    pub outline: LineTypeStyle,
    /// Lines between objects.
    pub silhouette: LineTypeStyle,
    /// Lines where an object folds over itself.
    pub overlap: LineTypeStyle,
    /// Lines between materials.
    pub material: LineTypeStyle,
    /// Lines where normals differ.
    pub crease: LineTypeStyle,
    /// Lines where texture coordinates differ.
    pub uv: LineTypeStyle,
    /// Lines where feature colours differ.
    pub feature: LineTypeStyle,
}

/// What a type of line changes; what is left out stays as the shader gives it.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(in crate::scene::file) struct LineTypeStyle {
    /// Colour.
    pub color: Option<Color>,
    /// Full width in pixels; 0 draws none of this type. Surfaces whose own lines are 0 wide draw none of any type.
    #[schemars(range(min = 0, max = MAX_LINE_WIDTH))]
    pub width: Option<f64>,
    /// Multiplies the opacity.
    #[schemars(range(min = 0, max = 1))]
    pub opacity: Option<f64>,
}

/// `[lines.hidden]`: how lines of surfaces behind the first are drawn.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(in crate::scene::file) struct HiddenLines {
    /// Colour of hidden lines.
    pub color: Color,
    /// Full width in pixels of hidden lines; 0 is no line.
    #[schemars(range(min = 0, max = MAX_LINE_WIDTH))]
    pub width: f64,
    /// Names of the objects whose hidden lines are drawn; the name of a model stands for all its parts, an
    /// object in a group for the group. Default: all.
    pub objects: Option<Vec<String>>,
}

impl Default for HiddenLines {
    fn default() -> Self {
        Self { color: Color([0.5; 3]), width: 1.0, objects: None }
    }
}

/// A line test: `false`, or the difference from which on it draws.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(untagged)]
pub(in crate::scene::file) enum Threshold {
    /// The test is off.
    Off(#[schemars(extend("const" = false))] bool),
    /// The test draws where the difference is greater.
    Above(#[schemars(range(min = 0, max = BRIGHT))] f64),
}

/// A kind of ray that sees lines.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(in crate::scene::file) enum LinePath {
    /// Rays from the camera.
    Camera,
    /// Mirrored rays.
    Reflection,
    /// Refracted rays.
    Refraction,
}

/// How lines in reflections and refractions enter the picture.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(in crate::scene::file) enum Compose {
    /// The sample takes the line's colour.
    Replace,
    /// Only what that ray adds is replaced: a line in a faint reflection stays faint.
    Throughput,
}

/// Line tests of a material. Two samples are tested as the material says whose line would be drawn: that of the larger
/// priority, else of the nearer surface. What is left out is as in `[lines]`.
#[derive(Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(in crate::scene::file) struct MaterialLines {
    /// Lines where two objects meet in the picture.
    pub object: Option<bool>,
    /// Lines where two materials meet in the picture.
    pub shader: Option<bool>,
    /// Lines where texture coordinates differ by more than this distance.
    pub uv: Option<Threshold>,
    /// Lines where shading normals differ by more than this angle in degrees, at most 180.
    pub normal: Option<Threshold>,
    /// Lines where any channel of the scripts' feature colours differs by more than this.
    pub feature: Option<Threshold>,
    /// Lines where an object (or a group) folds over itself by more than this.
    pub overlap: Option<Threshold>,
}
