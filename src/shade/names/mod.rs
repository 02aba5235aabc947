//! The names of the contract between scripts and renderer (DESIGN section 4.1): every input and every output.

mod pair;

use bitflags::bitflags;

use crate::sample::NodePath;

pub(super) use self::pair::{KINDS, OTHER, PATH_KINDS, PairForm, line_outputs};
pub use self::pair::{LINE_OUTPUTS, PAIR_INPUTS, PairInput, PairSet};

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
        /// `footprint`: width of the pixel's cone at the hit, world units, across the ray: 1 / `pixels_per_unit`. Right
        /// through flat and curved mirrors and glass; of the shadow ray's hits, as if seen from the camera.
        const FOOTPRINT = 1 << 24;
        /// `uv_footprint`: how far uv (set 0) moves across the pixel, in the mean of all directions; 0 without uv.
        const UV_FOOTPRINT = 1 << 25;
    }
}

/// An input, for reference pages.
#[derive(Clone, Copy, Debug)]
pub struct Input {
    /// Its name on `hit`.
    pub name: &'static str,
    /// Which it is.
    pub input: InputSet,
    /// Its type.
    pub kind: &'static str,
    /// Unit or space; empty where it has none.
    pub unit: &'static str,
    /// Its range; empty where any value is possible.
    pub range: &'static str,
    /// What it is.
    pub about: &'static str,
}

/// An output, for reference pages.
#[derive(Clone, Copy, Debug)]
pub struct Output {
    /// The key in the record.
    pub name: &'static str,
    /// Which it is.
    pub output: OutputSet,
    /// Its type.
    pub kind: &'static str,
    /// Unit or space; empty where it has none.
    pub unit: &'static str,
    /// Its range; empty where any value is possible.
    pub range: &'static str,
    /// What stands for it where it is left out.
    pub default: &'static str,
    /// What it does.
    pub about: &'static str,
}

/// What scripts read on `hit`, in the order of the bits. `MORE_UVS` is no property: `texture` reads it.
pub const INPUTS: [Input; 25] = [
    Input {
        name: "position",
        input: InputSet::POSITION,
        kind: "vec3",
        unit: "world space",
        range: "",
        about: "where the ray met the surface",
    },
    Input {
        name: "normal",
        input: InputSet::NORMAL,
        kind: "vec3",
        unit: "world space",
        range: "length 1",
        about: "the shading normal, on the side the ray came from",
    },
    Input {
        name: "geometric_normal",
        input: InputSet::GEOMETRIC_NORMAL,
        kind: "vec3",
        unit: "world space",
        range: "length 1",
        about: "the normal of the triangle, on the side the ray came from",
    },
    Input {
        name: "incoming",
        input: InputSet::INCOMING,
        kind: "vec3",
        unit: "world space",
        range: "length 1",
        about: "the direction of the ray, towards the surface",
    },
    Input {
        name: "uv",
        input: InputSet::UV,
        kind: "vec2",
        unit: "",
        range: "usually 0 … 1",
        about: "texture coordinates (set 0), (0, 0) being the image's top left; 0 where the mesh has none",
    },
    Input {
        name: "tangent",
        input: InputSet::TANGENT,
        kind: "vec4",
        unit: "world space",
        range: "length 1; w is 1 or −1",
        about: "xyz is the tangent along u; cross(normal, tangent.xyz) * tangent.w is that along v, on the front",
    },
    Input {
        name: "color",
        input: InputSet::COLOR,
        kind: "vec4",
        unit: "linear RGB and alpha",
        range: "usually 0 … 1",
        about: "vertex colour; (1, 1, 1, 1) where the mesh has none",
    },
    Input {
        name: "object_id",
        input: InputSet::OBJECT_ID,
        kind: "int",
        unit: "",
        range: "from 1",
        about: "which object",
    },
    Input {
        name: "shader_id",
        input: InputSet::SHADER_ID,
        kind: "int",
        unit: "",
        range: "from 1",
        about: "which material's shader, as in the `shader` line test",
    },
    Input {
        name: "polygon_id",
        input: InputSet::POLYGON_ID,
        kind: "int",
        unit: "",
        range: "from 0",
        about: "which polygon of the mesh",
    },
    Input {
        name: "material_id",
        input: InputSet::MATERIAL_ID,
        kind: "int",
        unit: "",
        range: "from 1",
        about: "which material",
    },
    Input {
        name: "barycentric",
        input: InputSet::BARYCENTRIC,
        kind: "vec3",
        unit: "",
        range: "0 … 1, sum 1",
        about: "weights of the triangle's three vertices",
    },
    Input {
        name: "distance",
        input: InputSet::DISTANCE,
        kind: "float",
        unit: "world units",
        range: "0 or more",
        about: "length of the last ray segment",
    },
    Input {
        name: "depth",
        input: InputSet::DEPTH,
        kind: "float",
        unit: "world units",
        range: "0 or more",
        about: "length of the path from the camera",
    },
    Input {
        name: "path_kind",
        input: InputSet::PATH_KIND,
        kind: "text",
        unit: "",
        range: "`\"camera\"`, `\"reflection\"`, `\"refraction\"`, `\"shadow\"`",
        about: "which ray met the surface",
    },
    Input {
        name: "front_facing",
        input: InputSet::FRONT_FACING,
        kind: "true or false",
        unit: "",
        range: "",
        about: "whether the ray met the front of the triangle",
    },
    Input { name: "time", input: InputSet::TIME, kind: "float", unit: "seconds", range: "", about: "the scene's time" },
    Input {
        name: "pixels_per_unit",
        input: InputSet::PIXELS_PER_UNIT,
        kind: "float",
        unit: "pixels / world unit",
        range: "0 or more",
        about: "how many pixels one world unit at the hit covers, in mirrors and glass too",
    },
    Input {
        name: "curvature",
        input: InputSet::CURVATURE,
        kind: "float",
        unit: "1 / world units",
        range: "",
        about: "mean curvature from the vertex normals, positive where the surface bulges towards the ray",
    },
    Input {
        name: "irradiance",
        input: InputSet::IRRADIANCE,
        kind: "vec3",
        unit: "linear RGB",
        range: "0 or more",
        about: "light that arrives on this side, shadows included",
    },
    Input {
        name: "light_count",
        input: InputSet::LIGHT_COUNT,
        kind: "int",
        unit: "",
        range: "from 0",
        about: "lights of the scene, for `hit.light(i)`",
    },
    Input {
        name: "light",
        input: InputSet::LIGHT,
        kind: "a method",
        unit: "",
        range: "",
        about: "`hit.light(i)`: see the functions",
    },
    Input {
        name: "attribute",
        input: InputSet::ATTRIBUTE,
        kind: "a method",
        unit: "",
        range: "",
        about: "`hit.attribute(\"name\", default)`: see the functions",
    },
    Input {
        name: "footprint",
        input: InputSet::FOOTPRINT,
        kind: "float",
        unit: "world units",
        range: "above 0",
        about: "width of the pixel at the hit, across the ray: 1 / pixels_per_unit",
    },
    Input {
        name: "uv_footprint",
        input: InputSet::UV_FOOTPRINT,
        kind: "float",
        unit: "units of uv",
        range: "0 or more",
        about: "how far uv moves across the pixel, for filters; 0 where the mesh has no uv",
    },
];

impl InputSet {
    /// The inputs that need to know how wide a pixel is at the hit.
    pub const CONE: Self = Self::PIXELS_PER_UNIT.union(Self::FOOTPRINT).union(Self::UV_FOOTPRINT);

    /// The inputs that are called, as `hit.light(i)`, and not read as properties.
    pub const CALLED: Self = Self::LIGHT.union(Self::ATTRIBUTE);

    /// The inputs that need light samples (and with them shadow rays).
    pub const LIGHTS: Self = Self::IRRADIANCE.union(Self::LIGHT);

    /// Every input that has a name on `hit`, with that name, in the order of the bits.
    pub fn named() -> impl Iterator<Item = (&'static str, Self)> {
        INPUTS.into_iter().map(|entry| (entry.name, entry.input))
    }

    /// The input of a name.
    #[must_use]
    pub fn spelled(name: &str) -> Option<Self> {
        Self::named().find(|(known, _)| *known == name).map(|(_, input)| input)
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
        /// `line_opacity`: 0 … 1; default 1. Lines that are not opaque show the lines behind them.
        const LINE_OPACITY = 1 << 15;
    }
}

/// The keys of the record, in the order of the bits.
pub const OUTPUTS: [Output; 16] = [
    Output {
        name: "base_color",
        output: OutputSet::BASE_COLOR,
        kind: "colour or number",
        unit: "linear RGB",
        range: "0 … 1",
        default: "0.8",
        about: "colour of the surface",
    },
    Output {
        name: "metallic",
        output: OutputSet::METALLIC,
        kind: "number",
        unit: "",
        range: "0 … 1",
        default: "0",
        about: "how much of a metal it is",
    },
    Output {
        name: "roughness",
        output: OutputSet::ROUGHNESS,
        kind: "number",
        unit: "",
        range: "0 (mirror) … 1",
        default: "1",
        about: "how much it blurs what it mirrors",
    },
    Output {
        name: "specular",
        output: OutputSet::SPECULAR,
        kind: "number",
        unit: "",
        range: "0 … 1",
        default: "1",
        about: "weight of the dielectric reflection",
    },
    Output {
        name: "ior",
        output: OutputSet::IOR,
        kind: "number",
        unit: "",
        range: "above 0",
        default: "1.5",
        about: "index of refraction",
    },
    Output {
        name: "transmission",
        output: OutputSet::TRANSMISSION,
        kind: "number",
        unit: "",
        range: "0 … 1",
        default: "0",
        about: "share of light that is refracted instead of scattered",
    },
    Output {
        name: "opacity",
        output: OutputSet::OPACITY,
        kind: "number",
        unit: "",
        range: "0 (not there) … 1",
        default: "1",
        about: "how much of it is there",
    },
    Output {
        name: "emission",
        output: OutputSet::EMISSION,
        kind: "colour or number",
        unit: "linear RGB radiance",
        range: "0 or more",
        default: "0",
        about: "light that it sends out",
    },
    Output {
        name: "normal",
        output: OutputSet::NORMAL,
        kind: "vec3",
        unit: "world space",
        range: "length 1",
        default: "`hit.normal`",
        about: "normal for shading only, as of normal maps; lines keep `hit.normal`",
    },
    Output {
        name: "occlusion",
        output: OutputSet::OCCLUSION,
        kind: "number",
        unit: "",
        range: "0 … 1",
        default: "1",
        about: "share of ambient light that reaches the point",
    },
    Output {
        name: "feature",
        output: OutputSet::FEATURE,
        kind: "colour or number",
        unit: "",
        range: "",
        default: "0",
        about: "lines are drawn where it jumps, as far as the scene's `feature` test asks",
    },
    Output {
        name: "line_color",
        output: OutputSet::LINE_COLOR,
        kind: "colour or number",
        unit: "linear RGB",
        range: "0 … 1",
        default: "the scene's",
        about: "colour of the lines",
    },
    Output {
        name: "line_width",
        output: OutputSet::LINE_WIDTH,
        kind: "number",
        unit: "pixels",
        range: "0 … `max_width`",
        default: "the scene's",
        about: "full width of the lines; 0 or less is no line",
    },
    Output {
        name: "priority",
        output: OutputSet::PRIORITY,
        kind: "int",
        unit: "",
        range: "",
        default: "the object's, the material's, 0",
        about: "whose line is drawn where two surfaces meet: the higher one's",
    },
    Output {
        name: "color",
        output: OutputSet::COLOR,
        kind: "colour or number",
        unit: "linear RGB radiance",
        range: "",
        default: "lighting decides",
        about: "final colour; lighting is bypassed",
    },
    Output {
        name: "line_opacity",
        output: OutputSet::LINE_OPACITY,
        kind: "number",
        unit: "",
        range: "0 … 1",
        default: "1",
        about: "opacity of the lines; those that are not opaque show the lines behind them",
    },
];

/// What a script gives for an output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum OutputForm {
    Number,
    /// A vec3, or a number for all three channels.
    Color,
    Vector,
    Int,
}

/// What the key of an extra output starts with.
pub const AOV_PREFIX: &str = "aov_";

impl OutputSet {
    /// Every output with its key, in the order of the bits.
    pub fn named() -> impl Iterator<Item = (&'static str, Self)> {
        OUTPUTS.into_iter().map(|entry| (entry.name, entry.output))
    }

    /// The output of a key.
    #[must_use]
    pub fn spelled(name: &str) -> Option<Self> {
        Self::named().find(|(known, _)| *known == name).map(|(_, output)| output)
    }

    /// What a script gives for one output.
    pub(super) fn form(self) -> OutputForm {
        match self {
            Self::BASE_COLOR | Self::EMISSION | Self::FEATURE | Self::LINE_COLOR | Self::COLOR => OutputForm::Color,
            Self::NORMAL => OutputForm::Vector,
            Self::PRIORITY => OutputForm::Int,
            _ => OutputForm::Number,
        }
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
    /// All kinds.
    pub const ALL: [Self; 4] = [Self::Camera, Self::Reflection, Self::Refraction, Self::Shadow];

    /// The kind of the last ray of a path.
    #[must_use]
    pub fn of(path: NodePath) -> Self {
        match path.ends_reflected() {
            None => Self::Camera,
            Some(true) => Self::Reflection,
            Some(false) => Self::Refraction,
        }
    }

    /// Its place in [`Self::ALL`].
    pub(super) fn place(self) -> i64 {
        self as i64
    }

    /// As scripts see it.
    #[must_use]
    pub fn name(self) -> &'static str {
        PATH_KINDS[self as usize]
    }
}
