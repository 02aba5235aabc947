//! Layers of a picture: what each holds and what it and its channels are called.

use std::fmt;
use std::str::FromStr;

use crate::diag::{self, Diagnostic};
use crate::line::LineType;
use crate::sample::{NodePath, PixelRect};

/// A layer. Its `Display` is its name in files and for `--layer`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Layer {
    /// The picture with lines, premultiplied: `R G B A`.
    Rgba,
    /// The picture without lines, premultiplied: `color.R G B A`.
    Color,
    /// The lines alone, premultiplied: `line.R G B A`. Hidden ones are not among them.
    Line,
    /// The lines of one type alone, premultiplied: `line.TYPE.R G B A`.
    LineType(LineType),
    /// The lines at the ends of one kind of path alone, premultiplied: `line.camera.R G B A`, `line.reflection.R G B A`,
    /// `line.refraction.R G B A`.
    LinePath(LinePath),
    /// The lines of hidden surfaces alone, premultiplied: `line.hidden.R G B A`. In pixels that a visible line partly covers,
    /// they are brought to the share of the pixel that it leaves: `line` *over* this layer *over* `below` is `rgba`.
    HiddenLine,
    /// What lies below the lines, premultiplied: `below.R G B A`. The layer `line` (*over* `line.hidden`, if there are hidden lines) *over* this one is `rgba`, also in pixels
    /// that a line only partly covers, where `color` would be wrong: it holds the colours under the line, too. (With
    /// `compose = "throughput"`, only where no reflected or refracted line is.)
    Below,
    /// Distance from the camera along the ray, nearest sample; ∞ at a miss: `Z`.
    Depth,
    /// Shading normal in world space, nearest sample; 0 at a miss: `N.X Y Z`.
    Normal,
    /// World position, nearest sample; 0 at a miss: `P.X Y Z`.
    Position,
    /// Texture coordinates, nearest sample; 0 at a miss: `uv.U V`.
    Uv,
    /// 1 + object id of the nearest sample, 0 at a miss, as a 32-bit unsigned channel: `object.id`.
    Object,
    /// Feature colour, nearest sample; 0 at a miss: `feature.R G B`.
    Feature,
    /// A script's extra output, filtered: `aov_NAME.R G B`. The number is its place in
    /// [`SampleBuffer::aovs`](crate::sample::SampleBuffer::aovs), the text is NAME.
    Aov(usize, String),
}

/// How a sample's line was seen: by the last event of its path.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LinePath {
    /// Directly.
    Camera,
    /// In a mirror reflection.
    Reflection,
    /// Through a refraction, or straight through a see-through surface.
    Refraction,
}

impl LinePath {
    /// Of a node's path.
    #[must_use]
    pub fn of(path: NodePath) -> Self {
        match path.ends_reflected() {
            None => Self::Camera,
            Some(true) => Self::Reflection,
            Some(false) => Self::Refraction,
        }
    }
}

/// How a channel's values are stored in EXR.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChannelFormat {
    /// 16-bit float: colours. Values beyond ±65504 are stored as that.
    Half,
    /// 32-bit float: distances, directions, coordinates, and script outputs, whose meaning only the artist knows.
    Float,
    /// 32-bit unsigned integer: ids.
    Uint,
}

/// One channel of a layer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Channel {
    /// The full name in EXR, such as `R`, `Z` or `line.crease.A`.
    pub name: String,
    /// How it is stored there.
    pub format: ChannelFormat,
}

const RGBA: &[&str] = &["R", "G", "B", "A"];
const RGB: &[&str] = &["R", "G", "B"];
const XYZ: &[&str] = &["X", "Y", "Z"];
const AOV_PREFIX: &str = "aov_";

impl Layer {
    /// All layers but the scripts' own, in the order of the documentation.
    pub const FIXED: [Self; 21] = [
        Self::Rgba,
        Self::Color,
        Self::Line,
        Self::LineType(LineType::Outline),
        Self::LineType(LineType::Silhouette),
        Self::LineType(LineType::Overlap),
        Self::LineType(LineType::Material),
        Self::LineType(LineType::Crease),
        Self::LineType(LineType::Uv),
        Self::LineType(LineType::Feature),
        Self::LinePath(LinePath::Camera),
        Self::LinePath(LinePath::Reflection),
        Self::LinePath(LinePath::Refraction),
        Self::HiddenLine,
        Self::Below,
        Self::Depth,
        Self::Normal,
        Self::Position,
        Self::Uv,
        Self::Object,
        Self::Feature,
    ];

    /// The layer of a name; `aovs` are the names (without `aov_`) of the scripts' outputs, in the order of
    /// [`SampleBuffer::aovs`](crate::sample::SampleBuffer::aovs).
    ///
    /// # Errors
    /// If no layer has this name; the nearest name is proposed.
    pub fn parse<S: AsRef<str>>(name: &str, aovs: &[S]) -> Result<Self, Diagnostic> {
        let aov = |(index, name): (usize, &S)| Self::Aov(index, name.as_ref().to_owned());
        let known: Vec<_> = Self::FIXED
            .into_iter()
            .chain(aovs.iter().enumerate().map(aov))
            .map(|layer| (layer.to_string(), layer))
            .collect();
        if let Some((_, layer)) = known.iter().find(|(known, _)| known == name) {
            return Ok(layer.clone());
        }
        let names = || known.iter().map(|(name, _)| name.as_str());
        let message = match name.strip_prefix(AOV_PREFIX) {
            Some(_) => format!("no shader of this scene writes `{name}`"),
            None => format!("there is no layer `{name}`"),
        };
        Err(Diagnostic::error(message).hint(match diag::nearest(name, names()) {
            Some(nearest) => format!("did you mean `{nearest}`?"),
            None => format!("layers are {}", names().collect::<Vec<_>>().join(", ")),
        }))
    }

    /// Its channels, in the order of [`FilmTile::channels`].
    #[must_use]
    pub fn channels(&self) -> Vec<Channel> {
        let (components, format): (&[&str], _) = match self {
            Self::Rgba
            | Self::Color
            | Self::Line
            | Self::LineType(_)
            | Self::LinePath(_)
            | Self::HiddenLine
            | Self::Below => (RGBA, ChannelFormat::Half),
            Self::Depth => (&["Z"], ChannelFormat::Float),
            Self::Normal | Self::Position => (XYZ, ChannelFormat::Float),
            Self::Uv => (&["U", "V"], ChannelFormat::Float),
            Self::Object => (&["id"], ChannelFormat::Uint),
            Self::Feature => (RGB, ChannelFormat::Half),
            Self::Aov(..) => (RGB, ChannelFormat::Float),
        };
        let channel = |component: &&str| Channel {
            name: match self {
                // The names that every program takes for the main picture and its depth.
                Self::Rgba | Self::Depth => (*component).to_owned(),
                _ => format!("{self}.{component}"),
            },
            format,
        };
        components.iter().map(channel).collect()
    }
}

impl fmt::Display for Layer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Rgba => "rgba",
            Self::Color => "color",
            Self::Line => "line",
            Self::LineType(kind) => return write!(f, "line.{}", kind.name()),
            Self::LinePath(LinePath::Camera) => "line.camera",
            Self::LinePath(LinePath::Reflection) => "line.reflection",
            Self::LinePath(LinePath::Refraction) => "line.refraction",
            Self::HiddenLine => "line.hidden",
            Self::Below => "below",
            Self::Depth => "Z",
            Self::Normal => "N",
            Self::Position => "P",
            Self::Uv => "uv",
            Self::Object => "object",
            Self::Feature => "feature",
            Self::Aov(_, name) => return write!(f, "{AOV_PREFIX}{name}"),
        })
    }
}

impl FromStr for Layer {
    type Err = Diagnostic;

    /// A layer that every scene has; for scripts' outputs see [`Layer::parse`].
    fn from_str(name: &str) -> Result<Self, Diagnostic> {
        Self::parse::<&str>(name, &[])
    }
}

/// The pixels of a rectangle: for each layer its channels, each `rect.pixels()` values row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmTile {
    /// The pixels.
    pub rect: PixelRect,
    /// Channels in the order of the layers and of [`Layer::channels`]. Object ids are bit-cast (`f32::from_bits`).
    pub channels: Vec<Vec<f32>>,
}
