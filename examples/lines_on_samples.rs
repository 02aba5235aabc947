//! Runs the line pass on hand-made samples: no geometry, no rays, no scripts. A disc is drawn on a terminal.
//!
//! Run it with `cargo run --release --example lines_on_samples`.

use tusche::line::{LineTile, Method, Rules, TileBounds, Window, find_lines};
use tusche::sample::position::SamplePositions;
use tusche::sample::{Node, NodeColumnSet, NodePath, PixelRect, SampleBufferBuilder, SampleColor, SampleLayout};
use tusche::scene::settings::{LineSettings, Sampler};

const SIZE: [u32; 2] = [64, 32];
const SAMPLES: u32 = 4;

fn main() {
    let settings = LineSettings { width: 3.0, ..LineSettings::default() };
    let layout = SampleLayout {
        samples_per_pixel: SAMPLES,
        columns: NodeColumnSet { lines: true, ..NodeColumnSet::default() },
        max_width: settings.max_width,
        materials: 1,
        ..SampleLayout::default()
    };

    // Every sample sees a disc or the background. (Terminal characters are twice as high as wide.)
    let rect = PixelRect::of_size(SIZE);
    let positions = SamplePositions::new(Sampler::Stratified, SAMPLES, 0);
    let mut builder = SampleBufferBuilder::new(rect, &layout);
    for index in 0..rect.pixels() as u32 {
        let pixel = [(index % SIZE[0]) as i32, (index / SIZE[0]) as i32];
        for s in 0..SAMPLES {
            let sample = index * SAMPLES + s;
            let offset = positions.of_pixel(pixel).offset(s);
            let (x, y) = (pixel[0] as f32 + offset[0], pixel[1] as f32 + offset[1]);
            let on_disc = ((x - 32.0) / 2.0).hypot(y - 16.0) < 11.0;
            builder.set_sample(sample, offset, SampleColor::default(), u32::from(on_disc));
            let node = if on_disc {
                Node { object: 1, shader: 1, depth: 1.0, line_width: settings.width, priority: 0, ..Node::default() }
            } else {
                Node::default()
            };
            builder.push(NodePath::CAMERA, sample, node);
        }
    }
    let buffer = builder.finish();

    let rules = Rules::new(&settings, SAMPLES);
    let bounds = TileBounds::new(&buffer, &rules);
    let tile = LineTile { buffer: &buffer, bounds: &bounds };
    let lines = find_lines(&Window::single(tile), tile, &rules, Method::Exact, None);

    let mut lined = vec![0; rect.pixels()];
    for sample in &lines.samples {
        lined[(sample / SAMPLES) as usize] += 1;
    }
    for row in lined.chunks(SIZE[0] as usize) {
        println!("{}", row.iter().map(|count| [' ', '.', '-', '+', '#'][*count]).collect::<String>());
    }
    println!("{} of {} samples see a line", lines.samples.len(), rect.pixels() * SAMPLES as usize);
}
