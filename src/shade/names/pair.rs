//! What `line(pair, p)` reads and returns (DESIGN section 3.6).

use bitflags::bitflags;

use crate::scene::settings::LineType;

bitflags! {
    /// Inputs on `pair`, of either side: which columns of a [`PairBatch`](crate::sample::PairBatch) are read.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
    pub struct PairSet: u16 {
        /// `kind`.
        const KIND = 1;
        /// `path_kind`.
        const PATH_KIND = 1 << 1;
        /// `distance`.
        const DISTANCE = 1 << 2;
        /// `own`.
        const OWN = 1 << 3;
        /// `width`.
        const WIDTH = 1 << 4;
        /// `color`.
        const COLOR = 1 << 5;
        /// `opacity`.
        const OPACITY = 1 << 6;
        /// `pixel`.
        const PIXEL = 1 << 7;
        /// `object_id`; 0 is a miss.
        const OBJECT_ID = 1 << 8;
        /// `material_id`; 0 is a miss.
        const MATERIAL_ID = 1 << 9;
        /// `depth`.
        const DEPTH = 1 << 10;
        /// `position`.
        const POSITION = 1 << 11;
        /// `normal`.
        const NORMAL = 1 << 12;
        /// `feature`.
        const FEATURE = 1 << 13;
    }
}

/// Type of an input on `pair`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::shade) enum PairForm {
    Bool,
    Int,
    /// One of some texts.
    Word(&'static [&'static str]),
    /// A float or a vector of so many, with bounds of its channels where there are any.
    Floats(u8, Option<[f32; 2]>),
}

/// An input on `pair`, for reference pages.
#[derive(Clone, Copy, Debug)]
pub struct PairInput {
    /// Its name on `pair`, and on `pair.other` if it is of a side.
    pub name: &'static str,
    /// Which it is.
    pub input: PairSet,
    /// Whether `pair.other` has it, too.
    pub of_side: bool,
    /// Unit or space; empty where it has none.
    pub unit: &'static str,
    /// Its range; empty where any value is possible.
    pub range: &'static str,
    /// What it is.
    pub about: &'static str,
    pub(in crate::shade) form: PairForm,
}

impl PairInput {
    /// Its type, as reference pages call it.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self.form {
            PairForm::Bool => "true or false",
            PairForm::Int => "int",
            PairForm::Word(_) => "text",
            PairForm::Floats(1, _) => "float",
            PairForm::Floats(2, _) => "vec2",
            PairForm::Floats(..) => "vec3",
        }
    }
}

/// The texts that `pair.kind` can be, in the order of [`LineType::ALL`].
pub(in crate::shade) const KINDS: [&str; LineType::ALL.len()] = {
    let mut names = [""; LineType::ALL.len()];
    let mut index = 0;
    while index < names.len() {
        names[index] = LineType::ALL[index].name();
        index += 1;
    }
    names
};

/// The texts that `path_kind` can be, in the order of [`PathKind::ALL`](super::PathKind::ALL).
pub(in crate::shade) const PATH_KINDS: [&str; 4] = ["camera", "reflection", "refraction", "shadow"];

const POINT: PairForm = PairForm::Floats(3, None);
const COLOR: PairForm = PairForm::Floats(3, None);
const SHARE: PairForm = PairForm::Floats(1, Some([0.0, 1.0]));
const LENGTH: PairForm = PairForm::Floats(1, Some([0.0, crate::sample::PairSide::FARTHEST]));

/// What `line` reads on `pair`: first what is of the line, then what either side has, in the order of the bits.
pub const PAIR_INPUTS: [PairInput; 14] = [
    PairInput {
        name: "kind",
        input: PairSet::KIND,
        of_side: false,
        unit: "",
        range: "`\"outline\"`, `\"silhouette\"`, `\"overlap\"`, `\"material\"`, `\"crease\"`, `\"uv\"`, `\"feature\"`",
        about: "what the line marks, by the strongest reason",
        form: PairForm::Word(&KINDS),
    },
    PairInput {
        name: "path_kind",
        input: PairSet::PATH_KIND,
        of_side: false,
        unit: "",
        range: "`\"camera\"`, `\"reflection\"`, `\"refraction\"`",
        about: "which ray met the surfaces",
        form: PairForm::Word(&PATH_KINDS),
    },
    PairInput {
        name: "distance",
        input: PairSet::DISTANCE,
        of_side: false,
        unit: "",
        range: "0 … 1",
        about: "how far the sample is from the edge: 0 on it, 1 at the line's border",
        form: SHARE,
    },
    PairInput {
        name: "own",
        input: PairSet::OWN,
        of_side: false,
        unit: "",
        range: "",
        about: "whether the sample itself is of the surface that styles the line, or across the edge from it",
        form: PairForm::Bool,
    },
    PairInput {
        name: "width",
        input: PairSet::WIDTH,
        of_side: false,
        unit: "pixels",
        range: "above 0",
        about: "full width of the line",
        form: LENGTH,
    },
    PairInput {
        name: "color",
        input: PairSet::COLOR,
        of_side: false,
        unit: "linear RGB",
        range: "",
        about: "the line's colour so far, without tint",
        form: COLOR,
    },
    PairInput {
        name: "opacity",
        input: PairSet::OPACITY,
        of_side: false,
        unit: "",
        range: "0 … 1",
        about: "the line's opacity so far",
        form: SHARE,
    },
    PairInput {
        name: "pixel",
        input: PairSet::PIXEL,
        of_side: false,
        unit: "pixels",
        range: "",
        about: "where in the picture the sample lies, from the top left",
        form: PairForm::Floats(2, None),
    },
    PairInput {
        name: "object_id",
        input: PairSet::OBJECT_ID,
        of_side: true,
        unit: "",
        range: "from 1; 0 is a miss",
        about: "which object",
        form: PairForm::Int,
    },
    PairInput {
        name: "material_id",
        input: PairSet::MATERIAL_ID,
        of_side: true,
        unit: "",
        range: "from 1; 0 is a miss",
        about: "which material",
        form: PairForm::Int,
    },
    PairInput {
        name: "depth",
        input: PairSet::DEPTH,
        of_side: true,
        unit: "world units",
        range: "0 or more; 1e18 is a miss",
        about: "length of the path from the camera",
        form: LENGTH,
    },
    PairInput {
        name: "position",
        input: PairSet::POSITION,
        of_side: true,
        unit: "world space",
        range: "",
        about: "where the ray met the surface; 0 of a miss",
        form: POINT,
    },
    PairInput {
        name: "normal",
        input: PairSet::NORMAL,
        of_side: true,
        unit: "world space",
        range: "length 1",
        about: "the shading normal; (0, 0, 1) of a miss",
        form: PairForm::Floats(3, Some([-1.000_001, 1.000_001])),
    },
    PairInput {
        name: "feature",
        input: PairSet::FEATURE,
        of_side: true,
        unit: "",
        range: "",
        about: "the feature colour",
        form: COLOR,
    },
];

/// The key under which `pair` holds the side across the edge.
pub(in crate::shade) const OTHER: &str = "other";

/// What `line` may return: key, type, range, default, meaning.
pub const LINE_OUTPUTS: [[&str; 5]; 2] = [
    ["color", "colour or number", "0 … 1", "`pair.color`", "colour of the line at this sample, before tint"],
    ["opacity", "number", "0 … 1", "1", "multiplies the line's opacity; through what is left the next line is seen"],
];

/// All keys that `line` may return.
pub(in crate::shade) fn line_outputs() -> impl Iterator<Item = &'static str> {
    LINE_OUTPUTS.into_iter().map(|[key, ..]| key)
}
