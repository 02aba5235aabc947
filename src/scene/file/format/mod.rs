//! The scene file as it is written: plain types whose derived JSON schema is both `tusche schema` and what
//! [`check`](super::check) holds a document against.
//!
//! Doc comments here become the schema's descriptions, which editors show. Defaults, ranges and alternatives stand
//! here and nowhere else; what one value demands of another is [`resolve`](super::resolve)'s matter. The keyword
//! `x-planned` names values and keys that are designed but not built, each with what to do instead.

mod lines;
mod truth;

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub(super) use self::lines::{Compose, LinePath, Lines, MaterialLines, Threshold};
pub(super) use self::truth::{Truth, TruthDisc, TruthEdge};
use crate::scene::check::{MAX_LINE_OVERSAMPLING, MAX_SAMPLES, MAX_SIZE};
use crate::scene::shape::MAX_SEGMENTS;

/// Largest coordinate and length, in world units.
const FAR: f64 = 1e12;
/// Smallest length, in world units.
pub(super) const TINY: f64 = 1e-9;
/// Largest colour component, strength and parameter: squares of it still fit a 32-bit float.
const BRIGHT: f64 = 1e18;

/// A Tusche scene: picture, camera, lines, materials, objects and lights. Relative paths are relative to this file.
#[derive(Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(super) struct SceneFile {
    /// Picture size, sampling, filter and background.
    pub render: Render,
    /// The camera. Without any camera the whole scene is framed.
    pub camera: Option<Camera>,
    /// Further cameras, chosen by name with `--camera`; without `[camera]` the first is used.
    pub cameras: Vec<Camera>,
    /// What draws a line, and how lines look where a script does not say.
    pub lines: Lines,
    /// Materials by name: each is a script with its parameters.
    pub materials: BTreeMap<String, Material>,
    /// The objects: models and built-in shapes with a place in the world.
    pub objects: Vec<Object>,
    /// The lines that the picture must show, known by geometry: what `tusche study` measures lines against.
    pub truth: Option<Truth>,
    /// The lights. Without any, those of the models are used, and failing those, a default set; `lights = []` is dark.
    pub lights: Vec<Light>,
}

/// `[render]`: picture size, sampling, filter and background.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(super) struct Render {
    /// Width and height in pixels.
    #[schemars(inner(range(min = 1, max = MAX_SIZE)))]
    pub size: [u32; 2],
    /// Samples per pixel.
    #[schemars(range(min = 1, max = MAX_SAMPLES))]
    pub samples: u32,
    /// How many times as many samples a pixel gets in parts of the picture where a first look finds lines; 1 for as many as
    /// elsewhere.
    #[schemars(range(min = 1, max = MAX_LINE_OVERSAMPLING))]
    pub line_oversampling: u32,
    /// How samples are spread over a pixel.
    pub sampler: Sampler,
    /// Chooses the sample positions; the same seed gives the same picture, bit for bit.
    pub seed: u64,
    /// What rays that leave the scene see.
    pub background: Background,
    /// Uniform light from all around that surfaces scatter; it casts no shadows.
    pub ambient: Ambient,
    /// The pixel filter.
    pub filter: Filter,
    /// Radius of the pixel filter in pixels.
    #[schemars(range(max = 64), extend("exclusiveMinimum" = 0))]
    pub filter_radius: f64,
    /// Most mirror reflections in a row along a path.
    #[schemars(range(max = 30))]
    pub reflection_depth: u32,
    /// Most refractions along a path.
    #[schemars(range(max = 30))]
    pub refraction_depth: u32,
    /// Groups of samples that share one lens point, time and microfacet numbers. Not built yet: ignored.
    #[schemars(range(min = 1, max = MAX_SAMPLES))]
    pub strata: Option<u32>,
}

impl Default for Render {
    fn default() -> Self {
        Self {
            size: [1280, 720],
            samples: 16,
            line_oversampling: 1,
            sampler: Sampler::Stratified,
            seed: 0,
            background: Background::Color(Color([0.9; 3])),
            ambient: Ambient::Gray(0.2),
            filter: Filter::BlackmanHarris,
            filter_radius: 1.5,
            reflection_depth: 4,
            refraction_depth: 8,
            strata: None,
        }
    }
}

/// A radiance: one number for white light, or a colour.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(untagged)]
pub(super) enum Ambient {
    /// White light.
    Gray(#[schemars(range(min = 0, max = BRIGHT))] f64),
    /// Coloured light.
    Color(Color),
}

/// What rays that leave the scene see.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(untagged)]
pub(super) enum Background {
    /// Black, and transparent to the camera.
    Transparent(Transparent),
    /// One colour.
    Color(Color),
    /// Two colours, mixed by the height of the ray's direction.
    Gradient(Gradient),
    /// An image around the scene.
    Image(BackgroundImage),
}

/// Black, and transparent to the camera.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Transparent {
    /// Black, and transparent to the camera.
    Transparent,
}

/// A background between two colours.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Gradient {
    /// Colour straight down.
    pub bottom: Color,
    /// Colour straight up.
    pub top: Color,
}

/// A latitude-longitude image around the scene.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct BackgroundImage {
    /// Path of the image: PNG, JPEG, Radiance HDR or OpenEXR.
    pub image: String,
    /// Multiplies the image.
    #[serde(default = "one")]
    #[schemars(range(min = 0, max = BRIGHT))]
    pub strength: f64,
}

/// How samples are spread over a pixel.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Sampler {
    /// Each somewhere in a cell of its own.
    Stratified,
    /// Points of an Owen-scrambled Sobol sequence; best for 1, 2, 4, 8, 16, … samples.
    Sobol,
    /// The same from one sequence for all pixels, so that neighbours make up for each other's errors.
    BlueNoise,
}

/// A pixel filter.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Filter {
    /// Constant.
    Box,
    /// Falls linearly to 0 at the radius.
    Tent,
    /// A Gaussian, lowered to reach 0 at the radius.
    Gaussian,
    /// Mitchell and Netravali's cubic with B = C = 1/3.
    Mitchell,
    /// The four-term Blackman-Harris window.
    BlackmanHarris,
}

/// Red, green and blue: linear Rec. 709, not sRGB.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema)]
pub(super) struct Color(#[schemars(inner(range(min = 0, max = BRIGHT)))] pub [f64; 3]);

/// A point, vector or displacement: x, y (up) and z, right-handed, in world units.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema)]
pub(super) struct Vector(#[schemars(inner(range(min = -FAR, max = FAR)))] pub [f64; 3]);

/// A camera: either placed by `position` and `target`, or taken from a model by `node`.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("x-planned" = {
    "script": "use a `projection`: \"perspective\" or \"orthographic\""
}))]
pub(super) struct Camera {
    /// Its name, for `--camera`. Default: the `node`, else "camera".
    pub name: Option<String>,
    /// Takes place and projection from the camera of this name in a glTF model of this scene.
    pub node: Option<String>,
    /// How directions relate to places in the picture. Default: "perspective".
    pub projection: Option<Projection>,
    /// World position. Required unless `node` is given.
    pub position: Option<Vector>,
    /// The point in the middle of the picture. Default: [0, 0, 0].
    pub target: Option<Vector>,
    /// Which way is up in the picture. Default: [0, 1, 0].
    pub up: Option<Vector>,
    /// Vertical field of view of a perspective camera, in degrees. Default: 40.
    #[schemars(range(min = 0.01, max = 179))]
    pub fov: Option<f64>,
    /// Height of the view of an orthographic camera, in world units. Default: 2.
    #[schemars(range(min = TINY, max = FAR))]
    pub height: Option<f64>,
    /// Radius of the lens in world units. Not built yet: ignored.
    #[serde(default)]
    #[schemars(range(min = 0, max = FAR))]
    pub aperture_radius: f64,
    /// Distance from the lens to the plane in focus, in world units. Not built yet: ignored.
    #[serde(default = "one")]
    #[schemars(range(min = TINY, max = FAR))]
    pub focus_distance: f64,
    /// When the shutter opens and closes, in seconds. Not built yet: ignored.
    #[serde(default)]
    #[schemars(inner(range(min = -FAR, max = FAR)))]
    pub shutter: [f64; 2],
}

/// How directions relate to places in the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(extend("x-planned" = { "panorama": "", "fisheye": "", "cylindrical": "", "script": "" }))]
pub(super) enum Projection {
    /// A pinhole; `fov` is its field of view.
    Perspective,
    /// Parallel rays; `height` is how much they cover.
    Orthographic,
}

/// A material: a script with its parameters.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Material {
    /// Path of a `.rhai` script, or "builtin:NAME" for one that comes with Tusche.
    pub shader: String,
    /// Values for the script's `params()`.
    #[serde(default)]
    pub params: BTreeMap<String, Param>,
    /// Line priority of its surfaces where neither the script nor the object gives one. Default: 0.
    #[schemars(range(min = i32::MIN, max = i32::MAX))]
    pub priority: Option<i32>,
    /// Which of overlapping bodies of glass or liquid fills the space that they share: the one with the larger number, and of
    /// equal ones the one that a ray enters last. Says nothing about lines.
    #[serde(default)]
    #[schemars(range(min = i32::MIN, max = i32::MAX))]
    pub dielectric_priority: i32,
    /// Whether surfaces are seen from behind.
    #[serde(default = "yes")]
    pub double_sided: bool,
    /// Line tests of its own, instead of those of `[lines]`.
    #[serde(default)]
    pub lines: MaterialLines,
}

/// A parameter's value.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(untagged)]
pub(super) enum Param {
    /// A switch.
    Bool(bool),
    /// A whole number.
    Int(i64),
    /// A number.
    Float(#[schemars(range(min = -BRIGHT, max = BRIGHT))] f64),
    /// A vector or a colour.
    Vector(#[schemars(length(min = 2, max = 4), inner(range(min = -BRIGHT, max = BRIGHT)))] Vec<f64>),
    /// A text.
    Text(String),
    /// A texture.
    Texture(Texture),
    /// A texture, in other words.
    File(TextureFile),
}

/// An attribute's value.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(untagged)]
pub(super) enum Attribute {
    /// A switch.
    Bool(bool),
    /// A whole number.
    Int(i64),
    /// A number.
    Float(#[schemars(range(min = -BRIGHT, max = BRIGHT))] f64),
    /// A vector or a colour.
    Vector(#[schemars(length(min = 2, max = 4), inner(range(min = -BRIGHT, max = BRIGHT)))] Vec<f64>),
    /// A text.
    Text(String),
}

/// A texture: an image and how to look it up.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Texture {
    /// Path of the image: PNG, JPEG or Radiance HDR.
    pub texture: String,
    /// What happens outside 0 … 1, in u and in v.
    #[serde(default)]
    pub wrap: Wrap,
    /// How pixels are interpolated.
    #[serde(default)]
    pub filter: TextureFilter,
    /// Whether the image holds sRGB colours; false for widths, masks and other data.
    #[serde(default = "yes")]
    pub srgb: bool,
}

/// A texture: an image and how to look it up.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct TextureFile {
    /// Path of the image: PNG, JPEG, Radiance HDR or OpenEXR.
    pub file: String,
    /// What happens outside 0 … 1, in u and in v.
    #[serde(default)]
    pub wrap: Wrap,
    /// How pixels are interpolated.
    #[serde(default)]
    pub filter: TextureFilter,
    /// How colours are encoded: "linear" for widths, masks and other data. Floats are always linear.
    #[serde(default)]
    pub color: Encoding,
}

/// How the colours of an image are encoded.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Encoding {
    /// As for screens.
    #[default]
    Srgb,
    /// As they are.
    Linear,
}

/// What happens outside 0 … 1.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Wrap {
    /// The image repeats.
    #[default]
    Repeat,
    /// The image repeats, every second time mirrored.
    Mirror,
    /// The border pixels go on.
    Clamp,
}

/// How pixels are interpolated.
#[derive(Clone, Copy, Debug, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(super) enum TextureFilter {
    /// The nearest pixel.
    Nearest,
    /// Bilinear.
    #[default]
    Linear,
    /// Bilinear in smaller images that fit the width of a pixel: calm where the texture is far away.
    Mipmap,
}

/// A model or a built-in shape with a place in the world.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Object {
    /// Its name, for messages and `--set objects.NAME.…`. Default: the name of the model or shape.
    pub name: Option<String>,
    /// Path of a glTF model: `.gltf` or `.glb`.
    pub gltf: Option<String>,
    /// Path of a mesh: `.obj` or `.ply`. Of it only the shape is used; `material` says what it looks like.
    pub mesh: Option<String>,
    /// A built-in shape, instead of a model. By default each is centred and fits the cube from -1 to 1; y is its axis.
    pub shape: Option<Shape>,
    /// Edge lengths of a box (x, y, z) or a plane (x, z); one number for all. Default: 2.
    pub size: Option<Size>,
    /// Radius of a shape; of a torus, that of the circle along its tube. Default: 1; torus 0.75, knot 0.6, capsule 0.5.
    #[schemars(range(min = TINY, max = FAR))]
    pub radius: Option<f64>,
    /// Height of a cylinder, a cone, or a capsule with its caps. Default: 2.
    #[schemars(range(min = TINY, max = FAR))]
    pub height: Option<f64>,
    /// Radius of the tube of a torus or a knot. Default: torus 0.25, knot 0.16.
    #[schemars(range(min = TINY, max = FAR))]
    pub tube_radius: Option<f64>,
    /// How finely a shape is cut: one number around, or one for each direction. Default: 128 around; 1 for flat faces.
    pub segments: Option<Segments>,
    /// Name of a material of this file. For a model it replaces all materials of its own. Default: matte grey.
    pub material: Option<String>,
    /// Line priority where the script gives none. Default: the material's.
    #[schemars(range(min = i32::MIN, max = i32::MAX))]
    pub priority: Option<i32>,
    /// Moves the object, last of all.
    pub translate: Option<Vector>,
    /// Turns the object about the world's x axis, then y, then z (degrees, counter-clockwise), after `scale`.
    pub rotate: Option<Vector>,
    /// Scales the object, first of all: one number, or one for each axis. Negative numbers mirror.
    pub scale: Option<Scale>,
    /// A 4 × 4 matrix column by column, as in glTF, instead of `translate`, `rotate` and `scale`.
    #[schemars(inner(range(min = -FAR, max = FAR)))]
    pub matrix: Option<[f64; 16]>,
    /// Which rays meet it.
    #[serde(default = "all_rays")]
    pub visible_to: Vec<RayKind>,
    /// Whether its surfaces draw lines. If not, what lies before it still draws its own line at their border.
    #[serde(default = "yes")]
    pub lines: bool,
    /// Objects of one group count as one object: no line where they meet. For a model, all its parts.
    #[schemars(length(min = 1))]
    pub group: Option<String>,
    /// Whether the lights of a model are used. Default: true if this file has no `[[lights]]`.
    pub lights: Option<bool>,
    /// Values that shaders ask for with `hit.attribute("name", default)`.
    #[serde(default)]
    pub attributes: BTreeMap<String, Attribute>,
}

/// A built-in shape.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Shape {
    /// A ball: `radius`, `segments` = [around, from pole to pole].
    Sphere,
    /// A box: `size`, `segments` = [along x, y, z].
    Box,
    /// A rectangle that faces up: `size`, `segments` = [along x, along z].
    Plane,
    /// A cylinder with caps: `radius`, `height`, `segments` = [around, along].
    Cylinder,
    /// A cone with its tip up and a base: `radius`, `height`, `segments` = [around, along].
    Cone,
    /// A ring: `radius`, `tube_radius`, `segments` = [around, around the tube].
    Torus,
    /// A round disc that faces up: `radius`, `segments`.
    Disc,
    /// A cylinder with half balls for caps: `radius`, `height`, `segments` = [around, from pole to rim].
    Capsule,
    /// A tube along a trefoil knot: `radius`, `tube_radius`, `segments` = [along, around the tube].
    Knot,
}

/// Edge lengths: one number for all, or one for each.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(untagged)]
pub(super) enum Size {
    /// The same for all edges.
    All(Length),
    /// One for each direction.
    Each(#[schemars(length(min = 2, max = 3))] Vec<Length>),
}

/// A length in world units.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema)]
pub(super) struct Length(#[schemars(range(min = TINY, max = FAR))] pub f64);

/// How finely a shape is cut.
#[derive(Clone, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(untagged)]
pub(super) enum Segments {
    /// Around; other directions follow.
    Around(#[schemars(range(min = 1, max = MAX_SEGMENTS))] u32),
    /// One for each direction.
    Each(#[schemars(length(min = 1, max = 3), inner(range(min = 1, max = MAX_SEGMENTS)))] Vec<u32>),
}

/// A scale: one number, or one for each axis.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(untagged)]
pub(super) enum Scale {
    /// The same along all axes.
    All(#[schemars(range(min = -FAR, max = FAR))] f64),
    /// One for each axis.
    Each(Vector),
}

/// A kind of ray.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(super) enum RayKind {
    /// Rays from the camera.
    Camera,
    /// Mirrored rays.
    Reflection,
    /// Refracted rays.
    Refraction,
    /// Rays towards lights.
    Shadow,
}

/// A light.
#[derive(Debug, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
#[schemars(extend("x-planned" = { "area": "", "environment": "" }))]
pub(super) enum Light {
    /// Parallel light from far away.
    Sun {
        /// Its name, for messages. Default: "sun".
        name: Option<String>,
        /// The direction in which the light travels; any length. [0, -1, 0] shines straight down.
        direction: Vector,
        /// Its colour.
        #[serde(default = "white")]
        color: Color,
        /// Irradiance on a surface that faces the light. A white matte surface then has the brightness strength / π.
        #[serde(default = "sun_strength")]
        #[schemars(range(min = 0, max = BRIGHT))]
        strength: f64,
        /// Whether objects block it.
        #[serde(default = "yes")]
        shadows: bool,
    },
    /// Equal light in all directions from a point.
    Point {
        /// Its name, for messages. Default: "point".
        name: Option<String>,
        /// World position.
        position: Vector,
        /// Its colour.
        #[serde(default = "white")]
        color: Color,
        /// Radiant intensity: irradiance at distance 1; it falls with the square of the distance.
        #[serde(default = "lamp_strength")]
        #[schemars(range(min = 0, max = BRIGHT))]
        strength: f64,
        /// Whether objects block it.
        #[serde(default = "yes")]
        shadows: bool,
    },
    /// A cone of light from a point.
    Spot {
        /// Its name, for messages. Default: "spot".
        name: Option<String>,
        /// World position.
        position: Vector,
        /// The direction of the cone's axis, away from the light; any length.
        direction: Vector,
        /// Full angle of the cone in degrees: outside there is no light.
        #[serde(default = "cone_angle")]
        #[schemars(range(min = 0.01, max = 180))]
        cone_angle: f64,
        /// Full angle in degrees of the inner cone, inside which the light is not dimmed. Default: 3/4 of `cone_angle`.
        #[schemars(range(min = 0, max = 180))]
        inner_angle: Option<f64>,
        /// Its colour.
        #[serde(default = "white")]
        color: Color,
        /// Radiant intensity in the inner cone: irradiance at distance 1; it falls with the square of the distance.
        #[serde(default = "lamp_strength")]
        #[schemars(range(min = 0, max = BRIGHT))]
        strength: f64,
        /// Whether objects block it.
        #[serde(default = "yes")]
        shadows: bool,
    },
}

fn yes() -> bool {
    true
}

fn one() -> f64 {
    1.0
}

fn white() -> Color {
    Color([1.0; 3])
}

fn sun_strength() -> f64 {
    3.0
}

fn lamp_strength() -> f64 {
    10.0
}

fn cone_angle() -> f64 {
    45.0
}

fn all_rays() -> Vec<RayKind> {
    vec![RayKind::Camera, RayKind::Reflection, RayKind::Refraction, RayKind::Shadow]
}
