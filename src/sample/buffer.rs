//! The columns of a rectangle of samples.
//!
//! Invariants, kept by the [builder](super::builder): all numbers have passed the [gate](super::gate); rows of a path
//! are sorted by sample and each sample has at most one; the camera's path comes first and has one row per sample, so
//! there row and sample are the same number ([`Rows::Every`]); a column whose values are all equal is
//! [`Column::Constant`], one of few values mostly [`Column::Palette`].

use std::ops::Range;

use super::gate::GateCounts;
use super::path::NodePath;

/// A rectangle of pixels: `x0 ≤ x < x1`, `y0 ≤ y < y1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PixelRect {
    /// Left, included.
    pub x0: i32,
    /// Top, included.
    pub y0: i32,
    /// Right, excluded.
    pub x1: i32,
    /// Bottom, excluded.
    pub y1: i32,
}

impl PixelRect {
    /// The rectangle of a picture.
    #[must_use]
    pub fn of_size(size: [u32; 2]) -> Self {
        Self { x0: 0, y0: 0, x1: size[0] as i32, y1: size[1] as i32 }
    }

    /// Width in pixels.
    #[must_use]
    pub fn width(&self) -> u32 {
        (self.x1 - self.x0).max(0) as u32
    }

    /// Height in pixels.
    #[must_use]
    pub fn height(&self) -> u32 {
        (self.y1 - self.y0).max(0) as u32
    }

    /// Number of pixels.
    #[must_use]
    pub fn pixels(&self) -> usize {
        self.width() as usize * self.height() as usize
    }

    /// Whether a pixel lies inside.
    #[must_use]
    pub fn contains(&self, x: i32, y: i32) -> bool {
        (self.x0..self.x1).contains(&x) && (self.y0..self.y1).contains(&y)
    }

    /// Larger by `margin` pixels on all sides.
    #[must_use]
    pub fn grown(&self, margin: i32) -> Self {
        Self { x0: self.x0 - margin, y0: self.y0 - margin, x1: self.x1 + margin, y1: self.y1 + margin }
    }

    /// The smallest rectangle that covers it and whose corners are multiples of `side`, which is above 0.
    #[must_use]
    pub fn to_blocks(&self, side: u32) -> Self {
        let side = side as i32;
        let (down, up) = (|x: i32| x.div_euclid(side) * side, |x: i32| (x + side - 1).div_euclid(side) * side);
        Self { x0: down(self.x0), y0: down(self.y0), x1: up(self.x1), y1: up(self.y1) }
    }

    /// The smallest rectangle that covers both.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        Self {
            x0: self.x0.min(other.x0),
            y0: self.y0.min(other.y0),
            x1: self.x1.max(other.x1),
            y1: self.y1.max(other.y1),
        }
    }

    /// Copies values of the rectangle (row by row) to its place in a picture of this width; whether any differs from what
    /// was there, to the bit.
    pub(crate) fn copy_into(&self, values: &[f32], picture: &mut [f32], width: usize) -> bool {
        let mut differs = false;
        for (row, values) in values.chunks(self.width().max(1) as usize).enumerate() {
            let start = (self.y0 as usize + row) * width + self.x0 as usize;
            let place = &mut picture[start..start + values.len()];
            differs |= place.iter().zip(values).any(|(a, b)| a.to_bits() != b.to_bits());
            place.copy_from_slice(values);
        }
        differs
    }

    /// What both cover; empty rectangles have no pixels.
    #[must_use]
    pub fn intersection(&self, other: &Self) -> Self {
        let x0 = self.x0.max(other.x0);
        let y0 = self.y0.max(other.y0);
        Self { x0, y0, x1: self.x1.min(other.x1).max(x0), y1: self.y1.min(other.y1).max(y0) }
    }
}

/// A column of values, in the shortest form that holds them exactly. A column that the plan does not name is constant at
/// its neutral value and takes no memory.
#[derive(Clone, Debug, PartialEq)]
pub enum Column<T> {
    /// Every row has this value.
    Constant(T),
    /// Few values, in the order in which they first occur, and for each row its place among them: a byte instead of an
    /// id, a colour or a width.
    Palette {
        /// The values, at most 256.
        values: Vec<T>,
        /// For each row.
        places: Vec<u8>,
    },
    /// One value per row.
    Values(Vec<T>),
}

impl<T: Copy> Column<T> {
    /// The value of a row.
    #[inline(always)]
    #[must_use]
    pub fn get(&self, row: usize) -> T {
        match self {
            Self::Constant(value) => *value,
            Self::Palette { values, places } => values[usize::from(places[row])],
            Self::Values(values) => values[row],
        }
    }

    /// Bytes of heap memory.
    #[must_use]
    pub fn bytes(&self) -> usize {
        match self {
            Self::Constant(_) => 0,
            Self::Palette { values, places } => values.len() * size_of::<T>() + places.len(),
            Self::Values(values) => values.len() * size_of::<T>(),
        }
    }

    /// The column of a function of the values.
    #[must_use]
    pub fn map<U: Copy>(&self, mut function: impl FnMut(T) -> U) -> Column<U> {
        match self {
            Self::Constant(value) => Column::Constant(function(*value)),
            Self::Palette { values, places } => Column::Palette {
                values: values.iter().map(|value| function(*value)).collect(),
                places: places.clone(),
            },
            Self::Values(values) => Column::Values(values.iter().map(|value| function(*value)).collect()),
        }
    }
}

/// Which samples have a node at a path.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Rows {
    /// Every one of this many: row and sample are the same number.
    Every {
        /// Number of samples.
        samples: u32,
        /// How many lie in a pixel.
        per_pixel: u32,
    },
    /// Some.
    Some {
        /// For each pixel of the rectangle (row by row) and one past the last: its first row.
        first: Vec<u32>,
        /// The sample of each row (index into the buffer), rising.
        sample: Vec<u32>,
    },
}

impl Rows {
    /// Number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Self::Every { samples, .. } => *samples as usize,
            Self::Some { sample, .. } => sample.len(),
        }
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The sample of a row.
    #[inline(always)]
    #[must_use]
    pub fn sample(&self, row: usize) -> u32 {
        match self {
            Self::Every { .. } => row as u32,
            Self::Some { sample, .. } => sample[row],
        }
    }

    /// The rows of a pixel, by its number in the rectangle (row by row).
    #[inline]
    #[must_use]
    pub fn of_pixel(&self, pixel: usize) -> Range<usize> {
        match self {
            Self::Every { per_pixel, .. } => pixel * *per_pixel as usize..(pixel + 1) * *per_pixel as usize,
            Self::Some { first, .. } => first[pixel] as usize..first[pixel + 1] as usize,
        }
    }

    /// Bytes of heap memory.
    #[must_use]
    pub fn bytes(&self) -> usize {
        match self {
            Self::Every { .. } => 0,
            Self::Some { first, sample } => (first.len() + sample.len()) * size_of::<u32>(),
        }
    }
}

/// The colour of a sample before lines.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SampleColor {
    /// Linear radiance.
    pub color: [f32; 3],
    /// 1, or 0 where the camera sees a transparent background.
    pub alpha: f32,
}

/// One node, as the tracer hands it to the builder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// 1 + object id; 0 is a miss. Objects of a group share the id of the group's first.
    pub object: u32,
    /// 1 + id of the object itself, where `object` is that of its group; may be 0 where they are the same.
    pub member: u32,
    /// 1 + material id; 0 is a miss.
    pub shader: u32,
    /// Texture coordinates.
    pub uv: [f32; 2],
    /// Unit shading normal (world space).
    pub normal: [f32; 3],
    /// Feature colour.
    pub feature: [f32; 3],
    /// Path length from the camera; ∞ for a miss.
    pub depth: f32,
    /// Line colour, linear.
    pub line_color: [f32; 3],
    /// Full line width in pixels; ≤ 0 is no line.
    pub line_width: f32,
    /// Opacity of the line, 0 … 1.
    pub line_opacity: f32,
    /// Line priority.
    pub priority: i32,
    /// Position relative to the camera's (world space).
    pub position: [f32; 3],
    /// Unit normal of the triangle, on the side that is seen (world space).
    pub geometric_normal: [f32; 3],
    /// Width of a pixel where its ray arrives, in world units, ≥ 0.
    pub footprint: f32,
    /// Product of the weights along the path from the camera, 1 at the camera.
    pub throughput: [f32; 3],
    /// What this node and its subtree add to the sample's colour (throughput included).
    pub contribution: [f32; 3],
}

impl Default for Node {
    /// A miss at the camera.
    fn default() -> Self {
        Self {
            object: 0,
            member: 0,
            shader: 0,
            uv: [0.0; 2],
            normal: [0.0, 0.0, 1.0],
            feature: [0.0; 3],
            depth: f32::INFINITY,
            line_color: [0.0; 3],
            line_width: 0.0,
            line_opacity: 1.0,
            // A miss never decides a line's style, whatever the objects' priorities.
            priority: i32::MIN,
            position: [0.0; 3],
            geometric_normal: [0.0, 0.0, 1.0],
            footprint: 0.0,
            throughput: [1.0; 3],
            contribution: [0.0; 3],
        }
    }
}

/// Which node columns are kept. Derived by the plan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NodeColumnSet {
    /// The uv test or layer is on.
    pub uv: bool,
    /// The normal test or layer is on.
    pub normal: bool,
    /// The feature test or layer is on.
    pub feature: bool,
    /// Lines or the depth layer are on.
    pub depth: bool,
    /// Lines are on: line colour, line width, line opacity, priority.
    pub lines: bool,
    /// Objects share groups, and somebody asks which object it is: `member`.
    pub member: bool,
    /// The overlap test is on: position, geometric normal, footprint.
    pub overlap: bool,
    /// A script that styles lines reads positions.
    pub position: bool,
    /// Tint or throughput composition is on and there are secondary paths.
    pub throughput: bool,
    /// Throughput composition is on.
    pub contribution: bool,
}

impl NodeColumnSet {
    /// Every column.
    pub const ALL: Self = Self {
        uv: true,
        normal: true,
        feature: true,
        depth: true,
        lines: true,
        member: true,
        overlap: true,
        position: true,
        throughput: true,
        contribution: true,
    };
}

/// All nodes at one path, in the order of their samples.
#[derive(Clone, Debug, PartialEq)]
pub struct NodeColumns {
    /// The path.
    pub path: NodePath,
    /// The sample of each row.
    pub rows: Rows,
    /// 1 + object id; 0 is a miss. Objects of a group share the id of the group's first.
    pub object: Column<u32>,
    /// 1 + id of the object itself, or 0 where that is `object`: see [`Self::object_itself`].
    pub member: Column<u32>,
    /// 1 + material id; 0 is a miss.
    pub shader: Column<u32>,
    /// Texture coordinates.
    pub uv: Column<[f32; 2]>,
    /// Unit shading normals.
    pub normal: Column<[f32; 3]>,
    /// Feature colours.
    pub feature: Column<[f32; 3]>,
    /// Path lengths from the camera.
    pub depth: Column<f32>,
    /// Line colours.
    pub line_color: Column<[f32; 3]>,
    /// Line widths in pixels.
    pub line_width: Column<f32>,
    /// Opacities of the lines.
    pub line_opacity: Column<f32>,
    /// Line priorities.
    pub priority: Column<i32>,
    /// Positions relative to the camera's.
    pub position: Column<[f32; 3]>,
    /// Unit normals of the triangles.
    pub geometric_normal: Column<[f32; 3]>,
    /// Widths of a pixel in world units.
    pub footprint: Column<f32>,
    /// Path throughputs.
    pub throughput: Column<[f32; 3]>,
    /// Subtree contributions.
    pub contribution: Column<[f32; 3]>,
    /// The surfaces behind these on the same rays (DESIGN section 3.4): first the second surface of each sample that has
    /// one, then the third, and so on. Empty unless the plan asks for them. A sample with a surface here has one in all
    /// before. Never misses; throughput and contribution are those of the first surface's row and stay neutral here.
    pub behind: Vec<NodeColumns>,
}

/// All samples of a rectangle of pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct SampleBuffer {
    /// The pixels.
    pub rect: PixelRect,
    /// Samples per pixel; sample `s` of the pixel at (x, y) has index ((y − y0) · width + x − x0) · n + s.
    pub samples_per_pixel: u32,
    /// Offsets inside the pixel, 0 … 1.
    pub offset: Vec<[f32; 2]>,
    /// Colours without lines.
    pub color: Column<[f32; 3]>,
    /// 1, or 0 where the camera sees a transparent background.
    pub alpha: Column<f32>,
    /// World positions at the camera's nodes, if the plan names them.
    pub position: Column<[f32; 3]>,
    /// Extra outputs at the camera's nodes, in the plan's order of names.
    pub aovs: Vec<Column<[f32; 3]>>,
    /// The nodes by path, in the order of [`NodePath`]; the first is the camera's, which every sample has.
    pub paths: Vec<NodeColumns>,
    /// What the gate stopped, by `shader` value of the node (0: misses).
    pub gate: Vec<GateCounts>,
}

impl NodeColumns {
    /// 1 + id of the object at a row, whatever its group; 0 is a miss.
    #[must_use]
    pub fn object_itself(&self, row: usize) -> u32 {
        match self.member.get(row) {
            0 => self.object.get(row),
            member => member,
        }
    }

    /// The row of a sample, if it has a node here.
    #[must_use]
    pub fn row_of(&self, sample: u32) -> Option<usize> {
        match &self.rows {
            Rows::Every { samples, .. } => (sample < *samples).then_some(sample as usize),
            Rows::Some { sample: samples, .. } => samples.binary_search(&sample).ok(),
        }
    }

    /// Bytes of heap memory.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.rows.bytes()
            + self.object.bytes()
            + self.member.bytes()
            + self.shader.bytes()
            + self.uv.bytes()
            + self.normal.bytes()
            + self.feature.bytes()
            + self.depth.bytes()
            + self.line_color.bytes()
            + self.line_width.bytes()
            + self.line_opacity.bytes()
            + self.priority.bytes()
            + self.position.bytes()
            + self.geometric_normal.bytes()
            + self.footprint.bytes()
            + self.throughput.bytes()
            + self.contribution.bytes()
            + self.behind.iter().map(|behind| size_of::<Self>() + behind.bytes()).sum::<usize>()
    }

    /// The row of a sample in a pixel (by its number in the rectangle), if it has one.
    #[inline]
    #[must_use]
    pub fn row_in_pixel(&self, pixel: usize, sample: u32) -> Option<usize> {
        match &self.rows {
            Rows::Every { .. } => Some(sample as usize),
            Rows::Some { first, sample: samples } => {
                let (start, end) = (first[pixel] as usize, first[pixel + 1] as usize);
                samples[start..end].binary_search(&sample).ok().map(|place| start + place)
            }
        }
    }
}

impl SampleBuffer {
    /// Number of samples.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.offset.len()
    }

    /// The number of a pixel in the rectangle, row by row. The pixel must lie inside.
    #[inline]
    #[must_use]
    pub fn pixel_number(&self, pixel: [i32; 2]) -> usize {
        (pixel[1] - self.rect.y0) as usize * self.rect.width() as usize + (pixel[0] - self.rect.x0) as usize
    }

    /// The pixel of a sample.
    #[must_use]
    pub fn pixel_of(&self, sample: u32) -> [i32; 2] {
        let (pixel, width) = (sample / self.samples_per_pixel, self.rect.width());
        [self.rect.x0 + (pixel % width) as i32, self.rect.y0 + (pixel / width) as i32]
    }

    /// Number of surfaces behind the first ones, over all lists.
    #[must_use]
    pub fn surfaces_behind(&self) -> usize {
        self.paths.iter().flat_map(|nodes| &nodes.behind).map(|behind| behind.rows.len()).sum()
    }

    /// The nodes at a path, if any sample has one there.
    #[must_use]
    pub fn nodes(&self, path: NodePath) -> Option<&NodeColumns> {
        self.paths.binary_search_by_key(&path, |nodes| nodes.path).ok().map(|found| &self.paths[found])
    }

    /// Bytes of heap memory.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.offset.len() * size_of::<[f32; 2]>()
            + self.color.bytes()
            + self.alpha.bytes()
            + self.position.bytes()
            + self.aovs.iter().map(Column::bytes).sum::<usize>()
            + self.paths.iter().map(NodeColumns::bytes).sum::<usize>()
            + self.gate.len() * size_of::<GateCounts>()
    }
}
