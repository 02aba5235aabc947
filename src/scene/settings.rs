//! Picture, background and line settings, all resolved: no later stage knows that a value was optional.

use bitflags::bitflags;
use serde::{Deserialize, Serialize};

use super::ids::{ObjectId, TextureId};
use crate::math::Vec3;

/// A reconstruction filter's shape; its radius stands beside it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilterKind {
    /// Constant.
    Box,
    /// Falls linearly to 0 at the radius.
    Tent,
    /// exp(−2 x²), lowered to reach 0 at the radius.
    Gaussian,
    /// Mitchell and Netravali's cubic with B = C = 1/3, stretched to the radius.
    Mitchell,
    /// The four-term Blackman-Harris window.
    BlackmanHarris,
}

/// How samples are spread over a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sampler {
    /// Each somewhere in a cell of its own.
    #[default]
    Stratified,
    /// Points of an Owen-scrambled Sobol sequence, another scrambling for each pixel.
    Sobol,
    /// The same from one sequence for all pixels, so that neighbours make up for each other's errors.
    BlueNoise,
}

impl Sampler {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Stratified, Self::Sobol, Self::BlueNoise];

    /// As scene files and tables call it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Stratified => "stratified",
            Self::Sobol => "sobol",
            Self::BlueNoise => "blue-noise",
        }
    }
}

/// `[render]`.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderSettings {
    /// Width and height in pixels, each at least 1.
    pub size: [u32; 2],
    /// Samples per pixel, at least 1.
    pub samples: u32,
    /// How many times as many samples a pixel gets where lines are (see [`oversample`](crate::render::oversample)); 1 for as
    /// many as elsewhere.
    pub line_oversampling: u32,
    /// How they are spread over the pixel.
    pub sampler: Sampler,
    /// Chooses the sample positions.
    pub seed: u64,
    /// What rays that leave the scene see.
    pub background: Background,
    /// Radiance of uniform light from all around that scatters on surfaces without casting shadows, linear RGB.
    pub ambient: Vec3,
    /// The pixel filter.
    pub filter: FilterKind,
    /// Its radius in pixels, > 0.
    pub filter_radius: f32,
    /// Most mirror reflections along a path.
    pub reflection_depth: u32,
    /// Most refractions along a path.
    pub refraction_depth: u32,
}

impl Default for RenderSettings {
    fn default() -> Self {
        Self {
            size: [1280, 720],
            samples: 16,
            line_oversampling: 1,
            sampler: Sampler::Stratified,
            seed: 0,
            background: Background::Color(Vec3::splat(0.9)),
            ambient: Vec3::splat(0.2),
            filter: FilterKind::BlackmanHarris,
            filter_radius: 1.5,
            reflection_depth: 4,
            refraction_depth: 8,
        }
    }
}

/// What rays that leave the scene see.
#[derive(Clone, Debug, PartialEq)]
pub enum Background {
    /// Black, and transparent to the camera.
    Transparent,
    /// One linear colour.
    Color(Vec3),
    /// Between two linear colours, by the height of the ray's direction.
    Gradient {
        /// Straight down.
        bottom: Vec3,
        /// Straight up.
        top: Vec3,
    },
    /// A latitude-longitude image around the scene.
    Image {
        /// The image.
        texture: TextureId,
        /// Multiplies it.
        strength: f32,
    },
}

bitflags! {
    /// Kinds of rays: what an object can be visible to, and which paths draw lines.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub struct RayKinds: u8 {
        /// Rays from the camera.
        const CAMERA = 1;
        /// Mirrored rays.
        const REFLECTION = 2;
        /// Refracted rays, and rays that go on through a see-through surface.
        const REFRACTION = 4;
        /// Rays towards lights.
        const SHADOW = 8;
    }
}

/// What kind of feature a line marks (DESIGN section 3.6), by the strongest reason, in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LineType {
    /// One side is a miss.
    Outline,
    /// The objects differ.
    Silhouette,
    /// The object folds over itself.
    Overlap,
    /// The materials differ.
    Material,
    /// The normals differ.
    Crease,
    /// The texture coordinates differ.
    Uv,
    /// The feature colours differ.
    Feature,
}

impl LineType {
    /// All of them, the strongest reason first.
    pub const ALL: [Self; 7] =
        [Self::Outline, Self::Silhouette, Self::Overlap, Self::Material, Self::Crease, Self::Uv, Self::Feature];

    /// As layers, scene files and scripts call it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Outline => "outline",
            Self::Silhouette => "silhouette",
            Self::Overlap => "overlap",
            Self::Material => "material",
            Self::Crease => "crease",
            Self::Uv => "uv",
            Self::Feature => "feature",
        }
    }
}

/// What a type of line changes about what its shader asks for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TypeStyle {
    /// Colour, linear.
    pub color: Option<Vec3>,
    /// Full width in pixels; 0 draws none of the type.
    pub width: Option<f32>,
    /// Multiplies the opacity, 0 … 1.
    pub opacity: Option<f32>,
}

/// How a line at a reflected or refracted node enters the sample's colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Composition {
    /// The sample takes the line's colour (OG18).
    Replace,
    /// Only that node's part of the sample is replaced.
    Throughput,
}

/// `[lines]`: DESIGN section 3.
#[derive(Clone, Debug, PartialEq)]
pub struct LineSettings {
    /// Whether lines are drawn at all (`--lines off`).
    pub enabled: bool,
    /// Colour of lines whose shader gives none, linear.
    pub color: Vec3,
    /// Full width in pixels of lines whose shader gives none.
    pub width: f32,
    /// Bounds the stencil; wider requests are clamped.
    pub max_width: f32,
    /// Thinner lines are drawn this wide and more transparent (OG18 section 3.5), in pixels.
    pub min_width: f32,
    /// Whether widths are corrected for the thinning of the sample test.
    pub width_compensation: bool,
    /// Where object ids differ.
    pub object: bool,
    /// Where materials differ.
    pub shader: bool,
    /// Where uv differ by more than this distance.
    pub uv: Option<f32>,
    /// Where shading normals differ by more than this angle in degrees.
    pub normal: Option<f32>,
    /// Where any channel of the feature colours differs by more than this.
    pub feature: Option<f32>,
    /// Where an object folds over itself by more than this many pixels per pixel of the picture.
    pub overlap: Option<f32>,
    /// Which paths draw lines; `SHADOW` is not among them.
    pub paths: RayKinds,
    /// Whether lines in reflections and refractions take the path's throughput as tint.
    pub tint: bool,
    /// How they enter the sample.
    pub compose: Composition,
    /// What each type changes, in the order of [`LineType::ALL`].
    pub types: [TypeStyle; LineType::ALL.len()],
    /// How many surfaces a ray's list holds at most (DESIGN section 3.4), at least 1.
    pub surfaces: u32,
    /// How lines of surfaces behind the first are drawn; `None` if they are not. Needs `surfaces` above 1.
    pub hidden: Option<HiddenLines>,
}

/// `[lines.hidden]`: one style for all lines of surfaces behind the first.
#[derive(Clone, Debug, PartialEq)]
pub struct HiddenLines {
    /// Linear.
    pub color: Vec3,
    /// Full width in pixels; 0 is no line.
    pub width: f32,
    /// The objects whose hidden lines are drawn, each with its group; `None` for all.
    pub objects: Option<Vec<ObjectId>>,
}

impl Default for LineSettings {
    fn default() -> Self {
        Self {
            enabled: true,
            color: Vec3::ZERO,
            width: 2.0,
            max_width: 8.0,
            min_width: 0.5,
            width_compensation: true,
            object: true,
            shader: true,
            uv: None,
            normal: None,
            feature: None,
            overlap: None,
            paths: RayKinds::CAMERA.union(RayKinds::REFLECTION).union(RayKinds::REFRACTION),
            tint: true,
            compose: Composition::Replace,
            types: [TypeStyle::default(); LineType::ALL.len()],
            surfaces: 1,
            hidden: None,
        }
    }
}

impl LineSettings {
    /// Whether a test is on that reads more than objects and materials.
    #[must_use]
    pub fn tests_shapes(&self) -> bool {
        self.uv.is_some() || self.normal.is_some() || self.feature.is_some() || self.overlap.is_some()
    }

    /// Whether any test is on.
    #[must_use]
    pub fn tests_anything(&self) -> bool {
        self.object || self.shader || self.tests_shapes()
    }
}

/// `[materials.NAME.lines]`: what a material changes about the tests of `[lines]`; `None` leaves it. A pair of samples is
/// tested as the material of the one whose line attributes style the line says (DESIGN section 3.2: the larger priority,
/// else the shorter depth, else the target).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LineOverrides {
    /// [`LineSettings::object`].
    pub object: Option<bool>,
    /// [`LineSettings::shader`].
    pub shader: Option<bool>,
    /// [`LineSettings::uv`]; `Some(None)` is off.
    pub uv: Option<Option<f32>>,
    /// [`LineSettings::normal`]; `Some(None)` is off.
    pub normal: Option<Option<f32>>,
    /// [`LineSettings::feature`]; `Some(None)` is off.
    pub feature: Option<Option<f32>>,
    /// [`LineSettings::overlap`]; `Some(None)` is off.
    pub overlap: Option<Option<f32>>,
}

impl LineOverrides {
    /// All tests off.
    pub(crate) const NO_TESTS: Self = Self {
        object: Some(false),
        shader: Some(false),
        uv: Some(None),
        normal: Some(None),
        feature: Some(None),
        overlap: Some(None),
    };

    /// The settings with these changes.
    #[must_use]
    pub fn over(&self, settings: &LineSettings) -> LineSettings {
        LineSettings {
            object: self.object.unwrap_or(settings.object),
            shader: self.shader.unwrap_or(settings.shader),
            uv: self.uv.unwrap_or(settings.uv),
            normal: self.normal.unwrap_or(settings.normal),
            feature: self.feature.unwrap_or(settings.feature),
            overlap: self.overlap.unwrap_or(settings.overlap),
            ..settings.clone()
        }
    }
}
