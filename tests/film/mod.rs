//! The film: filters, layers, developing, files, comparison.

mod compare;
mod develop;
mod files;
mod filter;
mod layer;

use tusche::film::FilmWindow;
use tusche::line::{Fired, LineBuffer, LineCounts, SeenLine};
use tusche::sample::{Column, NodeColumns, NodePath, PixelRect, Rows, SampleBuffer, SampleColor};

/// A picture made of samples that depend on nothing but their pixel and number.
struct Samples {
    size: [u32; 2],
    samples_per_pixel: u32,
    offset: fn(i32, i32, u32) -> [f32; 2],
    color: fn(i32, i32, u32) -> SampleColor,
    line: fn(i32, i32, u32) -> Option<SeenLine>,
    object: fn(i32, i32, u32) -> u32,
}

/// A buffer per tile, with its lines.
type Tiles = Vec<(SampleBuffer, LineBuffer)>;

impl Samples {
    /// Opaque black at the pixels' centres, no lines, no objects.
    fn black(size: [u32; 2]) -> Self {
        Self {
            size,
            samples_per_pixel: 1,
            offset: |_, _, _| [0.5; 2],
            color: |_, _, _| SampleColor { color: [0.0; 3], alpha: 1.0 },
            line: |_, _, _| None,
            object: |_, _, _| 0,
        }
    }

    /// Everything different everywhere, with lines on about one sample in three.
    fn noise(size: [u32; 2], samples_per_pixel: u32) -> Self {
        Self {
            size,
            samples_per_pixel,
            offset: |x, y, s| [unit(x, y, s, 0), unit(x, y, s, 1)],
            color: |x, y, s| SampleColor {
                color: [unit(x, y, s, 2), 10.0 * unit(x, y, s, 3), 0.1 * unit(x, y, s, 4)],
                alpha: unit(x, y, s, 5).round(),
            },
            line: |x, y, s| {
                let tests = [
                    Fired::MISS | Fired::OBJECT,
                    Fired::OBJECT,
                    Fired::OVERLAP,
                    Fired::SHADER,
                    Fired::NORMAL,
                    Fired::UV,
                    Fired::FEATURE,
                ];
                // Some regions have no lines at all.
                (hash(x / 8, y / 8, 0, 6).is_multiple_of(2) && hash(x, y, s, 7).is_multiple_of(3)).then(|| SeenLine {
                    covers: false,
                    alpha: 0.5 + 0.5 * unit(x, y, s, 8),
                    lined: [unit(x, y, s, 9), 0.0, 0.2],
                    ..line([0.3, unit(x, y, s, 10), 0.0], tests[hash(x, y, s, 11) as usize % tests.len()])
                })
            },
            object: |x, y, s| hash(x, y, s, 12) % 4,
        }
    }

    /// The samples of a rectangle.
    fn buffer(&self, rect: PixelRect) -> (SampleBuffer, LineBuffer) {
        let at: Vec<_> = (rect.y0..rect.y1)
            .flat_map(|y| (rect.x0..rect.x1).flat_map(move |x| (0..self.samples_per_pixel).map(move |s| (x, y, s))))
            .collect();
        fn values<T>(at: &[(i32, i32, u32)], value: impl Fn(i32, i32, u32) -> T) -> Column<T> {
            Column::Values(at.iter().map(|&(x, y, s)| value(x, y, s)).collect())
        }
        let triple = |salt: u32| values(&at, move |x, y, s| [0, 1, 2].map(|i| unit(x, y, s, salt + i) - 0.5));
        let object = self.object;
        let nodes = NodeColumns {
            path: NodePath::CAMERA,
            rows: Rows::Every { samples: at.len() as u32, per_pixel: self.samples_per_pixel },
            object: values(&at, object),
            shader: values(&at, object),
            uv: values(&at, |x, y, s| [unit(x, y, s, 20), unit(x, y, s, 21)]),
            normal: triple(30),
            feature: triple(40),
            depth: values(
                &at,
                move |x, y, s| if object(x, y, s) == 0 { f32::INFINITY } else { 1.0 + unit(x, y, s, 50) },
            ),
            line_color: Column::Constant([0.0; 3]),
            line_width: Column::Constant(1.0),
            line_opacity: Column::Constant(1.0),
            member: Column::Constant(0),
            position: Column::Constant([0.0; 3]),
            geometric_normal: Column::Constant([0.0, 0.0, 1.0]),
            footprint: Column::Constant(0.0),
            priority: Column::Constant(0),
            throughput: Column::Constant([1.0; 3]),
            contribution: Column::Constant([0.0; 3]),
            behind: Vec::new(),
        };
        let buffer = SampleBuffer {
            rect,
            samples_per_pixel: self.samples_per_pixel,
            offset: at.iter().map(|&(x, y, s)| (self.offset)(x, y, s)).collect(),
            color: Column::Values(at.iter().map(|&(x, y, s)| (self.color)(x, y, s).color).collect()),
            alpha: values(&at, |x, y, s| (self.color)(x, y, s).alpha),
            position: triple(60),
            aovs: vec![Column::Constant([0.25, 0.5, 4.0]), triple(70)],
            paths: vec![nodes],
            gate: Vec::new(),
        };
        let (samples, lines) = at
            .iter()
            .enumerate()
            .filter_map(|(sample, &(x, y, s))| Some((sample as u32, (self.line)(x, y, s)?)))
            .unzip();
        (buffer, LineBuffer { rect, samples, lines, counts: LineCounts::default(), gate: Vec::new() })
    }

    /// The whole picture in tiles.
    fn tiles(&self, side: i32) -> Tiles {
        rects(PixelRect::of_size(self.size), side).into_iter().map(|rect| self.buffer(rect)).collect()
    }
}

fn window(tiles: &Tiles, size: [u32; 2], side: i32) -> FilmWindow<'_> {
    FilmWindow {
        origin: [0, 0],
        tile: side,
        columns: size[0].div_ceil(side as u32) as usize,
        tiles: tiles.iter().map(|(buffer, lines)| Some((buffer, Some(lines)))).collect(),
    }
}

/// The tiles of a rectangle, row by row.
fn rects(rect: PixelRect, side: i32) -> Vec<PixelRect> {
    let starts = |from: i32, to: i32| (from..to).step_by(side as usize);
    starts(rect.y0, rect.y1)
        .flat_map(|y0| starts(rect.x0, rect.x1).map(move |x0| PixelRect { x0, y0, x1: x0 + side, y1: y0 + side }))
        .map(|tile| tile.intersection(&rect))
        .collect()
}

fn line(color: [f32; 3], fired: Fired) -> SeenLine {
    let (path, neighbor) = (NodePath::CAMERA, ([0, 0], 0));
    SeenLine { color, alpha: 1.0, lined: color, covers: true, path, fired, neighbor, own: true, hidden: false }
}

fn hash(x: i32, y: i32, s: u32, salt: u32) -> u32 {
    let mut bits = 0x9E37_79B9_u32;
    for word in [x as u32, y as u32, s, salt] {
        bits = (bits ^ word).wrapping_mul(0x85EB_CA6B);
        bits ^= bits >> 15;
    }
    bits
}

/// 0 … 1, 1 excluded.
fn unit(x: i32, y: i32, s: u32, salt: u32) -> f32 {
    (hash(x, y, s, salt) >> 8) as f32 / 16_777_216.0
}
