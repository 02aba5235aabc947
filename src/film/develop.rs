//! From samples to pixels.
//!
//! A pixel is Σ w v / Σ w over all samples of the picture within the filter's radius; past the picture's border there
//! are none. Layers whose values must not be mixed (depth, ids, …) take the pixel's own sample that is nearest to its
//! centre instead.
//!
//! The work goes by *source* pixels: the samples of one pixel are summed up for each of the pixels that they reach,
//! and these partial sums are added to the targets. A target so receives its partial sums in row order of the sources,
//! and each is a sum in order of samples: no tile size and no neighbouring tile changes a bit. The weights along x
//! and y of a sample are looked up once and serve all targets and layers; the lined picture shares the sums of the
//! plain one wherever a pixel has no line, which is nearly everywhere. A pixel that only equal samples reach has their
//! value, and none of this is done for it (`even`).

use super::even::EvenGround;
use super::filter::Filter;
use super::layer::{FilmTile, Layer, LinePath};
use super::spread::{Spread, Sums};
use crate::line::{LineBuffer, LineType, SeenLine};
use crate::math::{Vec3, Vec4};
use crate::sample::{Column, PixelRect, SampleBuffer};

/// Tiles of samples with their lines, in a grid as in [`crate::line::Window`].
#[derive(Clone, Debug)]
pub struct FilmWindow<'a> {
    /// Upper left pixel of the grid.
    pub origin: [i32; 2],
    /// Side of a tile in pixels, ≥ 1.
    pub tile: i32,
    /// Tiles per row of the grid.
    pub columns: usize,
    /// The tiles, row by row; the lines are `None` when lines are off.
    pub tiles: Vec<Option<(&'a SampleBuffer, Option<&'a LineBuffer>)>>,
}

/// Filters the samples around `rect` into its pixels. `window` must hold all samples of the picture within
/// [`Filter::reach`] pixels around it; pixels without samples in reach are 0.
///
/// Where the weights in reach cancel (a filter narrower than the samples are apart, negative lobes at the corner of a
/// tiny picture), a pixel is the plain mean of its own samples.
#[must_use]
pub fn develop(window: &FilmWindow<'_>, rect: PixelRect, filter: &Filter, layers: &[Layer]) -> FilmTile {
    let sources = rect.grown(filter.reach());
    let (mut has_lines, mut has_hidden) = (false, false);
    window.visit(sources, |pixel| {
        has_lines |= !pixel.lines.is_empty();
        has_hidden |= pixel.lines.iter().any(|line| line.hidden);
    });

    // Which fields have to be filtered, each once, and which of them a layer shows.
    let mut fields = Vec::new();
    let shown: Vec<Option<usize>> = layers
        .iter()
        .map(|layer| {
            let field = Field::of(layer, has_lines)?;
            Some(fields.iter().position(|known| *known == field).unwrap_or_else(|| {
                fields.push(field);
                fields.len() - 1
            }))
        })
        .collect();
    // What lies under lines is brought from the share of the pixel that they leave to the whole of it.
    let all = if has_hidden { Shown::All } else { Shown::Visible };
    let covers = [(Field::Below, all), (Field::Lines(Shown::Hidden), Shown::Visible)];
    let covers = covers.map(|(under, cover)| {
        let under = fields.iter().position(|field| *field == under).filter(|_| has_lines)?;
        let cover = Field::Lines(cover);
        let cover = fields.iter().position(|field| *field == cover).unwrap_or_else(|| {
            fields.push(cover);
            fields.len() - 1
        });
        Some((under, cover))
    });
    let mut filtered = filter_fields(window, rect, filter, &fields);
    for (under, cover) in covers.into_iter().flatten() {
        uncover(&mut filtered, under, cover);
    }

    let mut channels = Vec::new();
    for (layer, field) in layers.iter().zip(shown) {
        let count = layer.channels().len();
        match field {
            Some(field) => {
                let component = |c: usize| filtered[field].iter().map(move |value| value[c]).collect();
                channels.extend((0..count).map(component));
            }
            None => {
                let mut nearest = vec![vec![0.0; rect.pixels()]; count];
                if let Some(value) = nearest_value(layer) {
                    window.visit(rect, |pixel| {
                        let value = value(pixel.buffer, pixel.nearest_sample());
                        let at = index_in(rect, pixel.x, pixel.y);
                        nearest.iter_mut().zip(value).for_each(|(channel, value)| channel[at] = value);
                    });
                }
                channels.extend(nearest);
            }
        }
    }
    FilmTile { rect, channels }
}

/// Brings the values of a field from the share of each pixel that a cover leaves to the whole pixel.
fn uncover(filtered: &mut [Vec<Vec4>], under: usize, cover: usize) {
    // Below this, nothing of the quotient is seen under the cover.
    const LEAST: f32 = 1e-4;
    for pixel in 0..filtered[under].len() {
        let share = 1.0 - filtered[cover][pixel].w;
        filtered[under][pixel] = if share > LEAST { filtered[under][pixel] / share } else { Vec4::ZERO };
    }
}

/// Filters each field into the pixels of `rect`, row by row.
fn filter_fields(window: &FilmWindow<'_>, rect: PixelRect, filter: &Filter, fields: &[Field]) -> Vec<Vec<Vec4>> {
    if fields.is_empty() {
        return Vec::new();
    }
    let grounds = even_grounds(window, rect, filter.reach(), fields);
    let mut spread = Spread::new(filter, rect);
    let mut sums = vec![Sums::new(filter, rect); fields.len()];
    let (mut values, mut plain_part, mut part) = (Vec::new(), Vec::new(), Vec::new());
    window.visit(rect.grown(filter.reach()), |pixel| {
        if !grounds.iter().any(|ground| ground.is_filtered([pixel.x, pixel.y])) {
            return;
        }
        spread.weigh(filter, [pixel.x, pixel.y], &pixel.buffer.offset[pixel.first..pixel.end]);
        let mut plain_done = false;
        for (field, sums) in fields.iter().zip(&mut sums) {
            match field.gather(&pixel, &mut values) {
                Gathered::Zero => {}
                Gathered::Plain => {
                    if !plain_done {
                        spread.spread(&values, &mut plain_part);
                        plain_done = true;
                    }
                    spread.add(&plain_part, sums);
                }
                Gathered::Own => {
                    spread.spread(&values, &mut part);
                    spread.add(&part, sums);
                }
            }
        }
    });

    let mut filtered: Vec<_> = sums.iter().map(|sums| spread.divide(sums)).collect();
    for [x, y] in spread.cancelled() {
        window.visit(PixelRect { x0: x, y0: y, x1: x + 1, y1: y + 1 }, |pixel| {
            for (field, filtered) in fields.iter().zip(&mut filtered) {
                let sum = match field.gather(&pixel, &mut values) {
                    Gathered::Zero => Vec4::ZERO,
                    Gathered::Plain | Gathered::Own => values.iter().fold(Vec4::ZERO, |sum, value| sum + *value),
                };
                filtered[index_in(rect, x, y)] = sum / (pixel.end - pixel.first) as f32;
            }
        });
    }
    for (filtered, ground) in filtered.iter_mut().zip(&grounds) {
        let pixels = (rect.y0..rect.y1).flat_map(|y| (rect.x0..rect.x1).map(move |x| [x, y]));
        for (filtered, pixel) in filtered.iter_mut().zip(pixels) {
            *filtered = ground.value(pixel).unwrap_or(*filtered);
        }
    }
    filtered
}

/// Where no filter is needed, for each field: no layer depends on which others are asked for.
fn even_grounds(window: &FilmWindow<'_>, rect: PixelRect, reach: i32, fields: &[Field]) -> Vec<EvenGround> {
    let sources = rect.grown(reach);
    let mut values = vec![vec![None; sources.pixels()]; fields.len()];
    window.visit(sources, |pixel| {
        let place = index_in(sources, pixel.x, pixel.y);
        for (values, field) in values.iter_mut().zip(fields) {
            values[place] = field.one_value(&pixel);
        }
    });
    values.into_iter().map(|values| EvenGround::new(rect, reach, values)).collect()
}

fn index_in(rect: PixelRect, x: i32, y: i32) -> usize {
    (y - rect.y0) as usize * rect.width() as usize + (x - rect.x0) as usize
}

/// The samples of one pixel.
struct SourcePixel<'a> {
    x: i32,
    y: i32,
    buffer: &'a SampleBuffer,
    /// Its first sample.
    first: usize,
    /// One past its last sample.
    end: usize,
    /// Which of its samples see a line.
    lined: &'a [u32],
    /// The line of each of those.
    lines: &'a [SeenLine],
}

impl SourcePixel<'_> {
    /// The sample nearest to the pixel's centre, the first of equals.
    fn nearest_sample(&self) -> usize {
        let distance = |sample: usize| {
            let [x, y] = self.buffer.offset[sample].map(|offset| offset - 0.5);
            x * x + y * y
        };
        (self.first..self.end).min_by(|&a, &b| distance(a).total_cmp(&distance(b))).unwrap_or(self.first)
    }
}

impl FilmWindow<'_> {
    /// Calls `visit` for each pixel of `rect` that has samples, row by row.
    fn visit(&self, rect: PixelRect, mut visit: impl FnMut(SourcePixel<'_>)) {
        let column = |x: i32| (x - self.origin[0]).div_euclid(self.tile.max(1));
        for y in rect.y0..rect.y1 {
            let row = (y - self.origin[1]).div_euclid(self.tile.max(1));
            for column in column(rect.x0).max(0)..=column(rect.x1 - 1).min(self.columns as i32 - 1) {
                if row < 0 {
                    continue;
                }
                let tile = self.tiles.get(row as usize * self.columns + column as usize);
                let Some((buffer, lines)) = tile.copied().flatten() else { continue };
                let run = PixelRect { y0: y, y1: y + 1, ..rect }.intersection(&buffer.rect);
                if run.pixels() > 0 {
                    visit_run(buffer, lines, run, &mut visit);
                }
            }
        }
    }
}

/// Calls `visit` for each pixel of a run inside one row of a tile.
fn visit_run(
    buffer: &SampleBuffer,
    lines: Option<&LineBuffer>,
    run: PixelRect,
    visit: &mut impl FnMut(SourcePixel<'_>),
) {
    let samples_per_pixel = buffer.samples_per_pixel as usize;
    let mut first = index_in(buffer.rect, run.x0, run.y0) * samples_per_pixel;
    let (mut lined, mut lines) = lines.map_or((&[][..], &[][..]), |lines| {
        let start = lines.samples.partition_point(|&sample| (sample as usize) < first);
        (&lines.samples[start..], &lines.lines[start..])
    });
    for x in run.x0..run.x1 {
        let end = first + samples_per_pixel;
        let count = lined.iter().take_while(|&&sample| (sample as usize) < end).count();
        let (these_lined, later_lined) = lined.split_at(count);
        let (these_lines, later_lines) = lines.split_at(count);
        visit(SourcePixel { x, y: run.y0, buffer, first, end, lined: these_lined, lines: these_lines });
        (lined, lines, first) = (later_lined, later_lines, end);
    }
}

/// What is filtered. Each layer that is not taken from the nearest sample shows one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Field {
    /// Colours with lines.
    Lined,
    /// Colours without.
    Plain,
    /// Premultiplied lines.
    Lines(Shown),
    /// What lines leave of the colours.
    Below,
    /// An extra output.
    Aov(usize),
}

/// Which lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shown {
    All,
    Visible,
    Hidden,
    OfType(LineType),
    AtPath(LinePath),
}

impl Shown {
    fn contains(self, line: &SeenLine) -> bool {
        match self {
            Self::All => true,
            Self::Visible => !line.hidden,
            Self::Hidden => line.hidden,
            Self::OfType(kind) => !line.hidden && LineType::of(line.fired) == Some(kind),
            Self::AtPath(path) => !line.hidden && LinePath::of(line.path) == path,
        }
    }
}

/// What a pixel's samples hold of a field.
enum Gathered {
    /// Zero everywhere.
    Zero,
    /// The same as [`Field::Plain`].
    Plain,
    /// Something of its own.
    Own,
}

impl Field {
    /// What a layer shows; `None` if it takes nearest samples, or is all zero because no line is near.
    fn of(layer: &Layer, has_lines: bool) -> Option<Self> {
        match layer {
            Layer::Rgba if has_lines => Some(Self::Lined),
            Layer::Rgba | Layer::Color => Some(Self::Plain),
            Layer::Below if has_lines => Some(Self::Below),
            Layer::Below => Some(Self::Plain),
            Layer::Line => has_lines.then_some(Self::Lines(Shown::Visible)),
            Layer::HiddenLine => has_lines.then_some(Self::Lines(Shown::Hidden)),
            Layer::LineType(kind) => has_lines.then_some(Self::Lines(Shown::OfType(*kind))),
            Layer::LinePath(path) => has_lines.then_some(Self::Lines(Shown::AtPath(*path))),
            Layer::Aov(index, _) => Some(Self::Aov(*index)),
            Layer::Depth | Layer::Normal | Layer::Position | Layer::Uv | Layer::Object | Layer::Feature => None,
        }
    }

    /// The value that all samples of a pixel have; `None` if they differ, or it takes more than a look to tell.
    fn one_value(self, pixel: &SourcePixel<'_>) -> Option<Vec4> {
        let samples = pixel.first..pixel.end;
        let buffer = pixel.buffer;
        match self {
            Self::Plain | Self::Lined | Self::Below => {
                let color = buffer.color.get(pixel.first);
                let alpha = buffer.alpha.get(pixel.first);
                let is_one = (self == Self::Plain || pixel.lines.is_empty())
                    && (matches!(buffer.color, Column::Constant(_))
                        || samples.clone().all(|sample| buffer.color.get(sample) == color))
                    && (matches!(buffer.alpha, Column::Constant(_))
                        || samples.into_iter().all(|sample| buffer.alpha.get(sample) == alpha));
                is_one.then(|| Vec3::from(color).extend(alpha))
            }
            Self::Lines(lines) => (!pixel.lines.iter().any(|line| lines.contains(line))).then_some(Vec4::ZERO),
            Self::Aov(index) => {
                let Some(column) = buffer.aovs.get(index) else { return Some(Vec4::ZERO) };
                let first = column.get(pixel.first);
                let is_one = samples.into_iter().all(|sample| column.get(sample) == first);
                is_one.then(|| Vec3::from(first).extend(0.0))
            }
        }
    }

    /// Puts the values of a pixel's samples into `values`, unless they are zero.
    fn gather(self, pixel: &SourcePixel<'_>, values: &mut Vec<Vec4>) -> Gathered {
        let samples = pixel.first..pixel.end;
        let buffer = pixel.buffer;
        let plain = |sample: usize| Vec3::from(buffer.color.get(sample)).extend(buffer.alpha.get(sample));
        let lined = || pixel.lined.iter().map(|&sample| sample as usize - pixel.first).zip(pixel.lines);
        match self {
            Self::Plain | Self::Lined | Self::Below => {
                values.clear();
                values.extend(samples.map(plain));
                if self == Self::Plain || pixel.lines.is_empty() {
                    return Gathered::Plain;
                }
                for (sample, line) in lined() {
                    let alpha = values[sample].w;
                    values[sample] = match self {
                        Self::Below => {
                            let left = Vec3::from(line.lined) - Vec3::from(line.color) * line.alpha;
                            left.extend(alpha * (1.0 - line.alpha))
                        }
                        _ => Vec3::from(line.lined).extend(alpha + (1.0 - alpha) * line.alpha),
                    };
                }
                Gathered::Own
            }
            Self::Lines(lines) => {
                let shown = |line: &SeenLine| lines.contains(line);
                if !pixel.lines.iter().any(shown) {
                    return Gathered::Zero;
                }
                values.clear();
                values.resize(samples.len(), Vec4::ZERO);
                for (sample, line) in lined().filter(|(_, line)| shown(line)) {
                    values[sample] = (Vec3::from(line.color) * line.alpha).extend(line.alpha);
                }
                Gathered::Own
            }
            Self::Aov(index) => {
                let Some(column) = pixel.buffer.aovs.get(index) else { return Gathered::Zero };
                values.clear();
                values.extend(samples.map(|sample| Vec3::from(column.get(sample)).extend(0.0)));
                Gathered::Own
            }
        }
    }
}

/// How a layer reads its value from one sample, if it takes nearest samples. The camera's node of a sample is at the
/// sample's own index, since every sample has exactly one.
fn nearest_value(layer: &Layer) -> Option<fn(&SampleBuffer, usize) -> [f32; 3]> {
    fn at_hit(buffer: &SampleBuffer, sample: usize, value: [f32; 3]) -> [f32; 3] {
        if buffer.paths[0].object.get(sample) == 0 { [0.0; 3] } else { value }
    }
    match layer {
        Layer::Depth => Some(|buffer, sample| [buffer.paths[0].depth.get(sample), 0.0, 0.0]),
        Layer::Normal => Some(|buffer, sample| at_hit(buffer, sample, buffer.paths[0].normal.get(sample))),
        Layer::Position => Some(|buffer, sample| at_hit(buffer, sample, buffer.position.get(sample))),
        Layer::Uv => Some(|buffer, sample| {
            let [u, v] = buffer.paths[0].uv.get(sample);
            at_hit(buffer, sample, [u, v, 0.0])
        }),
        Layer::Object => Some(|buffer, sample| [f32::from_bits(buffer.paths[0].object_itself(sample)), 0.0, 0.0]),
        Layer::Feature => Some(|buffer, sample| at_hit(buffer, sample, buffer.paths[0].feature.get(sample))),
        Layer::Rgba
        | Layer::Color
        | Layer::Line
        | Layer::LineType(_)
        | Layer::LinePath(_)
        | Layer::HiddenLine
        | Layer::Below
        | Layer::Aov(..) => None,
    }
}
