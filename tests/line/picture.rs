//! Pictures without a ray tracer: a function from the film to nodes, sampled as the renderer samples.

use tusche::line::{LineBuffer, LineScripts, LineTile, Method, Rules, TileBounds, Window, find_lines};
use tusche::sample::position::SamplePositions;
use tusche::sample::{HandMadeSample, Node, NodeColumnSet, NodePath, PairBatch, PixelRect, SampleBuffer, SampleLayout};
use tusche::scene::settings::{LineSettings, Sampler};

/// Everything a buffer can keep.
pub fn layout(samples_per_pixel: u32, max_width: f32) -> SampleLayout {
    SampleLayout { samples_per_pixel, columns: NodeColumnSet::ALL, max_width, materials: 8, ..SampleLayout::default() }
}

/// The samples of a rectangle of a picture; `node` gives what the camera sees at a point of the film, in pixels.
pub fn sampled(rect: PixelRect, layout: &SampleLayout, node: &dyn Fn([f32; 2]) -> Node) -> SampleBuffer {
    let positions = SamplePositions::new(Sampler::Stratified, layout.samples_per_pixel, 7);
    let mut nodes = Vec::new();
    for y in rect.y0..rect.y1 {
        for x in rect.x0..rect.x1 {
            for sample in 0..layout.samples_per_pixel {
                let offset = positions.of_pixel([x, y]).offset(sample);
                nodes.push((offset, [(NodePath::CAMERA, node([x as f32 + offset[0], y as f32 + offset[1]]))]));
            }
        }
    }
    let samples: Vec<_> =
        nodes.iter().map(|(offset, nodes)| HandMadeSample { offset: *offset, nodes, ..Default::default() }).collect();
    SampleBuffer::from_samples(rect, layout, &samples)
}

/// Styles lines by all that is told of them: what differs by a bit looks different.
struct AnyScript;

impl LineScripts for AnyScript {
    fn style(&mut self, shader: u32, pairs: &mut PairBatch, styles: &mut Vec<(Option<[f32; 3]>, f32)>) {
        for row in 0..pairs.len {
            let mut all = format!("{shader} {:?} {} {}", pairs.kind[row], pairs.path[row], pairs.own[row]);
            let floats = [pairs.distance[row], pairs.width[row], pairs.opacity[row]].into_iter();
            for x in floats.chain(pairs.color[row]).chain(pairs.pixel[row]) {
                all += &format!(" {:x}", x.to_bits());
            }
            for side in &pairs.sides {
                all += &format!(" {} {} {:x}", side.object[row], side.material[row], side.depth[row].to_bits());
                all += &format!(" {:?} {:?} {:?}", side.position[row], side.normal[row], side.feature[row]);
            }
            let hash = all.bytes().fold(14_695_981_039_346_656_037_u64, |hash, byte| {
                (hash ^ u64::from(byte)).wrapping_mul(1_099_511_628_211)
            });
            let opacity = [0.0, 1.0, 0.25, f32::NAN, 2.0, -1.0, 0.5, 0.75][(hash >> 20) as usize % 8];
            // That of the second material leaves the opacity.
            let opacity = if shader == 2 { 1.0 } else { opacity };
            let color = [(hash >> 40) as f32, (hash >> 50) as f32, f32::INFINITY];
            styles.push(((hash >> 10).is_multiple_of(3).then_some(color), opacity));
        }
    }
}

/// A picture in tiles, ready for the line pass.
pub struct Tiles {
    rect: PixelRect,
    side: i32,
    columns: usize,
    rules: Rules,
    tiles: Vec<(SampleBuffer, TileBounds)>,
}

impl Tiles {
    /// Cuts a rectangle into tiles and fills each with `buffer`.
    pub fn new(rect: PixelRect, side: i32, rules: &Rules, buffer: impl Fn(PixelRect) -> SampleBuffer) -> Self {
        let starts = |low: i32, high: i32| (low..high).step_by(side as usize);
        let mut tiles = Vec::new();
        for y0 in starts(rect.y0, rect.y1) {
            for x0 in starts(rect.x0, rect.x1) {
                let buffer = buffer(PixelRect { x0, y0, x1: x0 + side, y1: y0 + side }.intersection(&rect));
                let bounds = TileBounds::new(&buffer, rules);
                tiles.push((buffer, bounds));
            }
        }
        Self { rect, side, columns: starts(rect.x0, rect.x1).count(), rules: rules.clone(), tiles }
    }

    fn tile(&self, index: usize) -> LineTile<'_> {
        let (buffer, bounds) = &self.tiles[index];
        LineTile { buffer, bounds }
    }

    pub fn window(&self) -> Window<'_> {
        Window {
            origin: [self.rect.x0, self.rect.y0],
            tile: self.side,
            columns: self.columns,
            tiles: (0..self.tiles.len()).map(|index| Some(self.tile(index))).collect(),
        }
    }

    /// The lines of one tile.
    pub fn lines_of(&self, index: usize, method: Method) -> LineBuffer {
        find_lines(&self.window(), self.tile(index), &self.rules, method, Some(&mut AnyScript))
    }

    /// The lines of all tiles, in order.
    pub fn lines(&self, method: Method) -> Vec<LineBuffer> {
        (0..self.tiles.len()).map(|index| self.lines_of(index, method)).collect()
    }

    /// Bytes of all samples and bounds.
    #[allow(dead_code, reason = "only the benchmark asks")]
    pub fn bytes(&self) -> usize {
        self.tiles.iter().map(|(buffer, bounds)| buffer.bytes() + bounds.bytes()).sum()
    }

    /// Number of samples.
    #[allow(dead_code, reason = "only the benchmark asks")]
    pub fn samples(&self) -> usize {
        self.tiles.iter().map(|(buffer, _)| buffer.samples()).sum()
    }
}

/// The part of each pixel of a rectangle that lines cover, row by row: the mean of their alpha over its samples. Samples
/// are taken beyond it too, so its border does not matter.
#[allow(dead_code, reason = "the benchmark does not ask")]
pub fn covered_by_pixel(
    rect: PixelRect,
    settings: &LineSettings,
    samples_per_pixel: u32,
    node: &dyn Fn([f32; 2]) -> Node,
) -> Vec<f64> {
    let rules = Rules::new(settings, samples_per_pixel);
    let layout = layout(samples_per_pixel, settings.max_width);
    let sampled_rect = rect.grown(rules.reach());
    let tiles = Tiles::new(sampled_rect, 32, &rules, |tile| sampled(tile, &layout, node));
    let mut covered = vec![0.0; rect.pixels()];
    for ((buffer, _), lines) in tiles.tiles.iter().zip(tiles.lines(Method::Exact)) {
        for (&sample, line) in lines.samples.iter().zip(&lines.lines) {
            let [x, y] = buffer.pixel_of(sample);
            if rect.contains(x, y) {
                let pixel = (y - rect.y0) as usize * rect.width() as usize + (x - rect.x0) as usize;
                covered[pixel] += f64::from(line.alpha) / f64::from(samples_per_pixel);
            }
        }
    }
    covered
}

/// The area that lines cover in a rectangle, in square pixels.
#[allow(dead_code, reason = "the benchmark does not ask")]
pub fn covered_area(
    rect: PixelRect,
    settings: &LineSettings,
    samples_per_pixel: u32,
    node: &dyn Fn([f32; 2]) -> Node,
) -> f64 {
    covered_by_pixel(rect, settings, samples_per_pixel, node).iter().sum()
}
