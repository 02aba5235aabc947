//! How wide lines are drawn that are asked to have a width (DESIGN section 3.9), for edges whose lines have a known area.
//!
//! No scene and no ray tracer is in play: shapes are sampled as a camera would, and the line pass is run on the samples. So what is
//! found holds for every scene.

use std::f64::consts::{FRAC_PI_2, PI};

use serde::{Deserialize, Serialize};

use crate::line::{LineTile, Method, Rules, TileBounds, Window, find_lines};
use crate::math::portable;
use crate::sample::position::SamplePositions;
use crate::sample::{
    Node, NodeColumnSet, NodePath, PixelRect, SampleBuffer, SampleBufferBuilder, SampleColor, SampleLayout,
};
use crate::scene::settings::{LineSettings, Sampler};

/// An edge whose line has a known area. The shape lies before nothing; its material draws the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Edge {
    /// A straight edge.
    Straight,
    /// The rim of a disc of radius 20 px.
    Disc20,
    /// The rim of a disc of radius 5 px.
    Disc5,
    /// The rim of a square of 12 px: four corners and little between them.
    Square12,
}

impl Edge {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Straight, Self::Disc20, Self::Disc5, Self::Square12];

    /// As the report calls it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Straight => "straight edge",
            Self::Disc20 => "disc, radius 20 px",
            Self::Disc5 => "disc, radius 5 px",
            Self::Square12 => "square, side 12 px",
        }
    }

    /// As files call it.
    #[must_use]
    pub const fn file_name(self) -> &'static str {
        match self {
            Self::Straight => "straight",
            Self::Disc20 => "disc20",
            Self::Disc5 => "disc5",
            Self::Square12 => "square12",
        }
    }

    /// Half the side of the square that is sampled, without what lines reach beyond it.
    fn half_window(self) -> i32 {
        match self {
            Self::Straight => 16,
            Self::Disc20 => 21,
            Self::Disc5 => 6,
            Self::Square12 => 9,
        }
    }

    /// Length of the edge in the window, in pixels.
    fn length(self, place: &Place) -> f64 {
        match self {
            // It crosses the window from top to bottom.
            Self::Straight => 2.0 * f64::from(self.half_window()) / place.axis[0],
            Self::Disc20 => 40.0 * PI,
            Self::Disc5 => 10.0 * PI,
            Self::Square12 => 48.0,
        }
    }

    /// Area of its line in the window, in square pixels.
    #[must_use]
    fn area(self, width: f64, place: &Place) -> f64 {
        let annulus = |radius: f64| {
            let [outer, inner] = [radius + width / 2.0, (radius - width / 2.0).max(0.0)];
            PI * (outer * outer - inner * inner)
        };
        match self {
            Self::Straight => self.length(place) * width,
            Self::Disc20 => annulus(20.0),
            Self::Disc5 => annulus(5.0),
            // Round outside of the corners, and overlapping inside of them.
            Self::Square12 => 48.0 * width + (PI / 4.0 - 1.0) * width * width,
        }
    }

    /// Whether a point, relative to the middle of the window, lies on the shape.
    fn holds(self, x: f64, y: f64, place: &Place) -> bool {
        let (x, y) = (x - place.shift[0], y - place.shift[1]);
        let [cos, sin] = place.axis;
        let (along, across) = (x * cos + y * sin, y * cos - x * sin);
        match self {
            Self::Straight => along < 0.0,
            Self::Disc20 => x * x + y * y < 400.0,
            Self::Disc5 => x * x + y * y < 25.0,
            Self::Square12 => along.abs() < 6.0 && across.abs() < 6.0,
        }
    }
}

/// How a shape lies on the pixels.
#[derive(Clone, Copy, Debug)]
struct Place {
    shift: [f64; 2],
    /// Cosine and sine of how far it is turned.
    axis: [f64; 2],
}

impl Place {
    /// The places of repeats are spread evenly over shifts of a pixel and angles of −45° … 45°.
    fn of(repeat: u32) -> Self {
        // Kronecker sequence of the inverse powers of the root of x⁴ = x + 1.
        let share = |step: f64| (0.5 + f64::from(repeat) * step).fract();
        let angle = (share(0.819_172_513) - 0.5) * FRAC_PI_2;
        let axis = [portable::cos(angle as f32), portable::sin(angle as f32)].map(f64::from);
        let length = axis[0].hypot(axis[1]);
        Self { shift: [share(0.671_043_607), share(0.549_700_478)], axis: axis.map(|x| x / length) }
    }
}

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Asked {
    /// The edge.
    pub edge: Edge,
    /// How samples are spread.
    pub sampler: Sampler,
    /// Samples per pixel.
    pub samples: u32,
    /// Whether widths are corrected for thinning; `false` is the paper's rule.
    pub compensation: bool,
    /// Full width in pixels.
    pub width: f32,
}

/// The mean drawn width in pixels: the area of the drawn line as a part of that of a line of the asked width, times that
/// width. Edges of at least `length` pixels are drawn.
#[must_use]
pub fn drawn(asked: &Asked, length: f64) -> f64 {
    let Asked { edge, sampler, samples, compensation, width } = *asked;
    let settings = LineSettings {
        width,
        max_width: width,
        min_width: 0.0,
        width_compensation: compensation,
        shader: false,
        ..LineSettings::default()
    };
    let rules = Rules::for_sampler(&settings, sampler, samples).with_any_pair();
    let (mut area, mut truth, mut drawn, mut repeat) = (0.0, 0.0, 0.0, 0);
    while drawn < length {
        let place = Place::of(repeat);
        let positions = SamplePositions::new(sampler, samples, repeat.into());
        area += covered(edge, &place, &positions, samples, &rules);
        truth += edge.area(width.into(), &place);
        drawn += edge.length(&place);
        repeat += 1;
    }
    area / truth * f64::from(width)
}

/// The drawn area in the window.
fn covered(edge: Edge, place: &Place, positions: &SamplePositions, samples: u32, rules: &Rules) -> f64 {
    let width = rules.settings().width;
    let half = edge.half_window();
    // Closed shapes lie in the window with their lines.
    let half = if edge == Edge::Straight { half } else { half + rules.reach() + 1 };
    let window = PixelRect { x0: -half, y0: -half, x1: half, y1: half };
    // A straight edge leaves at top and bottom, and so does its line.
    let beyond = rules.reach() + 1;
    let wide = if edge == Edge::Straight { half + 2 * beyond } else { beyond };
    let rect = PixelRect { x0: -half - wide, y0: -half - beyond, x1: half + wide, y1: half + beyond };
    let buffer = sampled(rect, samples, width, positions, |x, y| edge.holds(x, y, place));
    let bounds = TileBounds::new(&buffer, rules);
    let tile = LineTile { buffer: &buffer, bounds: &bounds };
    let lines = find_lines(&Window::single(tile), tile, rules, Method::Exact, None);
    let is_inside = |sample: &&u32| {
        let [x, y] = buffer.pixel_of(**sample);
        (window.y0..window.y1).contains(&y) && (edge == Edge::Straight || window.contains(x, y))
    };
    lines.samples.iter().filter(is_inside).count() as f64 / f64::from(samples)
}

/// Samples of a shape before nothing.
fn sampled(
    rect: PixelRect,
    samples: u32,
    width: f32,
    positions: &SamplePositions,
    holds: impl Fn(f64, f64) -> bool,
) -> SampleBuffer {
    let layout = SampleLayout {
        samples_per_pixel: samples,
        columns: NodeColumnSet { lines: true, depth: true, ..NodeColumnSet::default() },
        max_width: width,
        materials: 1,
        ..SampleLayout::default()
    };
    let mut builder = SampleBufferBuilder::new(rect, &layout);
    let mut number = 0;
    for y in rect.y0..rect.y1 {
        for x in rect.x0..rect.x1 {
            let in_pixel = positions.of_pixel([x, y]);
            for sample in 0..samples {
                let offset = in_pixel.offset(sample);
                let [px, py] = [f64::from(x) + f64::from(offset[0]), f64::from(y) + f64::from(offset[1])];
                let on_shape = holds(px, py);
                builder.set_sample(number, offset, SampleColor::default(), u32::from(on_shape));
                let node = if on_shape {
                    Node { object: 1, shader: 1, depth: 1.0, line_width: width, priority: 0, ..Node::default() }
                } else {
                    Node::default()
                };
                builder.push(NodePath::CAMERA, number, node);
                number += 1;
            }
        }
    }
    builder.finish()
}

/// What was measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Drawn {
    /// By which version of Tusche.
    pub version: String,
    /// What was asked for.
    #[serde(flatten)]
    pub asked: Asked,
    /// Drawn width in pixels; see [`drawn`].
    pub drawn: f64,
}

impl Drawn {
    /// Measures.
    #[must_use]
    pub fn measure(asked: &Asked) -> Self {
        // A pixel of edge tells of as many gaps as there are samples along it, so that fewer pixels do for more samples.
        let length = LENGTH / f64::from(asked.samples).sqrt();
        Self { version: env!("CARGO_PKG_VERSION").to_owned(), asked: *asked, drawn: drawn(asked, length) }
    }

    /// Whether it is what would be measured.
    #[must_use]
    pub fn is_of(&self, asked: &Asked) -> bool {
        self.asked == *asked && self.version == env!("CARGO_PKG_VERSION")
    }
}

/// How much edge is drawn of one sample per pixel, in pixels.
const LENGTH: f64 = 2400.0;

/// Rates of samples that are measured.
pub const SAMPLES: [u32; 5] = [1, 4, 16, 64, 256];
/// Widths in pixels that are measured.
pub const WIDTHS: [f32; 5] = [0.5, 1.0, 2.0, 4.0, 8.0];

/// All that the report shows: every edge, sampler and width, by the paper's rule and compensated, at rising rates.
#[must_use]
pub fn all() -> Vec<Asked> {
    let mut all = Vec::new();
    for samples in SAMPLES {
        for edge in Edge::ALL {
            for sampler in Sampler::ALL {
                for compensation in [false, true] {
                    all.extend(WIDTHS.map(|width| Asked { edge, sampler, samples, compensation, width }));
                }
            }
        }
    }
    all
}
