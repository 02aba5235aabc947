//! The names of the contract between scripts and renderer (DESIGN section 4.1): every input and every output.

use bitflags::bitflags;

bitflags! {
    /// Inputs on `hit`.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
    pub struct InputSet: u32 {
        /// `position`: world space.
        const POSITION = 1;
        /// `normal`: unit shading normal, world space, on the side the ray came from.
        const NORMAL = 1 << 1;
        /// `geometric_normal`: unit normal of the triangle, world space, on the side the ray came from.
        const GEOMETRIC_NORMAL = 1 << 2;
        /// `incoming`: unit direction of the ray, towards the surface, world space.
        const INCOMING = 1 << 3;
        /// `uv`: texture coordinates, set 0.
        const UV = 1 << 4;
        /// `tangent`: xyz is the unit tangent along u, world space; w is the sign (1 or -1) such that
        /// `cross(normal, tangent.xyz) * tangent.w` is the tangent along v, on the front of the surface.
        const TANGENT = 1 << 5;
        /// `color`: linear vertex colour with alpha; (1, 1, 1, 1) where the mesh has none.
        const COLOR = 1 << 6;
        /// `object_id`: integer, from 1.
        const OBJECT_ID = 1 << 7;
        /// `shader_id`: integer, from 1: which material's shader this is, as in the `shader` line test.
        const SHADER_ID = 1 << 8;
        /// `polygon_id`: integer, from 0.
        const POLYGON_ID = 1 << 9;
        /// `material_id`: integer, from 1.
        const MATERIAL_ID = 1 << 10;
        /// `barycentric`: weights of the triangle's three vertices.
        const BARYCENTRIC = 1 << 11;
        /// `distance`: length of the last ray segment, world units.
        const DISTANCE = 1 << 12;
        /// `depth`: path length from the camera, world units.
        const DEPTH = 1 << 13;
        /// `path_kind`: `"camera"`, `"reflection"`, `"refraction"` or `"shadow"`.
        const PATH_KIND = 1 << 14;
        /// `front_facing`: whether the ray met the front of the triangle.
        const FRONT_FACING = 1 << 15;
        /// `time`: seconds.
        const TIME = 1 << 16;
        /// `pixels_per_unit`: how many pixels one world unit at the hit covers.
        const PIXELS_PER_UNIT = 1 << 17;
        /// `curvature`: mean curvature from the normals of the triangle, 1 / world units, positive where convex.
        const CURVATURE = 1 << 18;
        /// `irradiance`: sum of the lights' contributions on this side, shadows included, linear RGB: over all lights in
        /// order, radiance · visibility · max(0, normal · direction). Needs the columns of `light` and `normal`.
        const IRRADIANCE = 1 << 19;
        /// `light_count`: integer.
        const LIGHT_COUNT = 1 << 20;
        /// `light(i)`: needs the light samples, shadows included.
        const LIGHT = 1 << 21;
        /// uv sets beyond the first, by `texture` lookups.
        const MORE_UVS = 1 << 22;
        /// `attribute(name, default)`: a value that the object (scene file, model `extras`) or else its material (model
        /// `extras`) has under this name; the default where none has. Columns: which set of attributes each hit has.
        const ATTRIBUTE = 1 << 23;
    }
}

/// What scripts read on `hit`, with its spelling, in the order of the bits. `MORE_UVS` is no property: `texture` reads it.
const INPUT_NAMES: [(&str, InputSet); 23] = [
    ("position", InputSet::POSITION),
    ("normal", InputSet::NORMAL),
    ("geometric_normal", InputSet::GEOMETRIC_NORMAL),
    ("incoming", InputSet::INCOMING),
    ("uv", InputSet::UV),
    ("tangent", InputSet::TANGENT),
    ("color", InputSet::COLOR),
    ("object_id", InputSet::OBJECT_ID),
    ("shader_id", InputSet::SHADER_ID),
    ("polygon_id", InputSet::POLYGON_ID),
    ("material_id", InputSet::MATERIAL_ID),
    ("barycentric", InputSet::BARYCENTRIC),
    ("distance", InputSet::DISTANCE),
    ("depth", InputSet::DEPTH),
    ("path_kind", InputSet::PATH_KIND),
    ("front_facing", InputSet::FRONT_FACING),
    ("time", InputSet::TIME),
    ("pixels_per_unit", InputSet::PIXELS_PER_UNIT),
    ("curvature", InputSet::CURVATURE),
    ("irradiance", InputSet::IRRADIANCE),
    ("light_count", InputSet::LIGHT_COUNT),
    ("light", InputSet::LIGHT),
    ("attribute", InputSet::ATTRIBUTE),
];

impl InputSet {
    /// The inputs that are called, as `hit.light(i)`, and not read as properties.
    pub const CALLED: Self = Self::LIGHT.union(Self::ATTRIBUTE);

    /// The inputs that need light samples (and with them shadow rays).
    pub const LIGHTS: Self = Self::IRRADIANCE.union(Self::LIGHT);

    /// Every input that has a name on `hit`, with that name, in the order of the bits.
    pub fn named() -> impl Iterator<Item = (&'static str, Self)> {
        INPUT_NAMES.into_iter()
    }

    /// The input of a name.
    #[must_use]
    pub fn spelled(name: &str) -> Option<Self> {
        INPUT_NAMES.into_iter().find(|(known, _)| *known == name).map(|(_, input)| input)
    }

    /// The columns of a batch that these inputs are computed from.
    #[must_use]
    pub fn columns(self) -> Self {
        if self.contains(Self::IRRADIANCE) { self | Self::LIGHT | Self::NORMAL } else { self }
    }
}

bitflags! {
    /// Keys of the record that `surface` returns; `aov_NAME` keys are counted apart.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
    pub struct OutputSet: u32 {
        /// `base_color`: linear RGB 0 … 1; default 0.8.
        const BASE_COLOR = 1;
        /// `metallic`: 0 … 1; default 0.
        const METALLIC = 1 << 1;
        /// `roughness`: 0 (mirror) … 1; default 1.
        const ROUGHNESS = 1 << 2;
        /// `specular`: weight of the dielectric reflection, 0 … 1; default 1.
        const SPECULAR = 1 << 3;
        /// `ior`: index of refraction, default 1.5.
        const IOR = 1 << 4;
        /// `transmission`: share of light that is refracted instead of scattered, 0 … 1; default 0.
        const TRANSMISSION = 1 << 5;
        /// `opacity`: 0 (not there) … 1; default 1.
        const OPACITY = 1 << 6;
        /// `emission`: linear RGB radiance; default 0.
        const EMISSION = 1 << 7;
        /// `normal`: unit normal for shading only (normal maps), world space; default `hit.normal`. Lines keep `hit.normal`.
        const NORMAL = 1 << 8;
        /// `occlusion`: share of ambient light that reaches the point, 0 … 1; default 1.
        const OCCLUSION = 1 << 9;
        /// `feature`: feature colour; default 0.
        const FEATURE = 1 << 10;
        /// `line_color`: linear RGB; default the scene's.
        const LINE_COLOR = 1 << 11;
        /// `line_width`: full width in pixels; default the scene's; ≤ 0 is no line.
        const LINE_WIDTH = 1 << 12;
        /// `priority`: integer; default the object's, then the material's, then 0.
        const PRIORITY = 1 << 13;
        /// `color`: final radiance; where given, lighting is bypassed.
        const COLOR = 1 << 14;
    }
}

/// The keys of the record, in the order of the bits.
const OUTPUT_NAMES: [(&str, OutputSet); 15] = [
    ("base_color", OutputSet::BASE_COLOR),
    ("metallic", OutputSet::METALLIC),
    ("roughness", OutputSet::ROUGHNESS),
    ("specular", OutputSet::SPECULAR),
    ("ior", OutputSet::IOR),
    ("transmission", OutputSet::TRANSMISSION),
    ("opacity", OutputSet::OPACITY),
    ("emission", OutputSet::EMISSION),
    ("normal", OutputSet::NORMAL),
    ("occlusion", OutputSet::OCCLUSION),
    ("feature", OutputSet::FEATURE),
    ("line_color", OutputSet::LINE_COLOR),
    ("line_width", OutputSet::LINE_WIDTH),
    ("priority", OutputSet::PRIORITY),
    ("color", OutputSet::COLOR),
];

/// What the key of an extra output starts with.
pub const AOV_PREFIX: &str = "aov_";

impl OutputSet {
    /// Every output with its key, in the order of the bits.
    pub fn named() -> impl Iterator<Item = (&'static str, Self)> {
        OUTPUT_NAMES.into_iter()
    }

    /// The output of a key.
    #[must_use]
    pub fn spelled(name: &str) -> Option<Self> {
        OUTPUT_NAMES.into_iter().find(|(known, _)| *known == name).map(|(_, output)| output)
    }

    /// What the lighting of a hit needs.
    pub const BSDF: Self = Self::BASE_COLOR
        .union(Self::METALLIC)
        .union(Self::ROUGHNESS)
        .union(Self::SPECULAR)
        .union(Self::IOR)
        .union(Self::TRANSMISSION)
        .union(Self::OPACITY)
        .union(Self::EMISSION)
        .union(Self::NORMAL)
        .union(Self::OCCLUSION);
}

/// Which ray met the surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PathKind {
    /// From the camera.
    #[default]
    Camera,
    /// Mirrored.
    Reflection,
    /// Refracted, or straight on through a see-through surface.
    Refraction,
    /// Towards a light (only `opacity` is asked for).
    Shadow,
}

impl PathKind {
    /// As scripts see it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Camera => "camera",
            Self::Reflection => "reflection",
            Self::Refraction => "refraction",
            Self::Shadow => "shadow",
        }
    }
}
