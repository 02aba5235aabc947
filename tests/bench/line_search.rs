//! How much sooner the search finds the oracle's lines: `cargo bench --bench line_search -- [OPTIONS] [WIDTH...]`.
//!
//! Options: `--any-pair` searches as for a picture without layers by line type, `--no-brute` leaves out the oracle,
//! `--quick` takes a part of the picture. The oracle is left out where it would take minutes.
//!
//! The picture is synthetic (no ray tracer): discs and straight edges at several depths before a background that the
//! camera misses, one disc with a priority, one domed so that creases are tested too. Most of it is far from any edge.

#[path = "../line/picture.rs"]
#[allow(dead_code, reason = "the tests use the rest")]
mod picture;

use std::hint::black_box;
use std::time::Instant;

use picture::{Tiles, layout, sampled};
use tusche::line::{LineTile, Method, Rules, TileBounds, find_lines};
use tusche::sample::{Node, NodeColumnSet, PixelRect, SampleLayout};
use tusche::scene::settings::LineSettings;

const PICTURE: PixelRect = PixelRect { x0: 0, y0: 0, x1: 512, y1: 384 };
/// A part of it.
const QUARTER: PixelRect = PixelRect { x0: 64, y0: 96, x1: 320, y1: 288 };
const TILE: i32 = 32;
/// What a picture with the lines of this one keeps.
const COLUMNS: NodeColumnSet = NodeColumnSet {
    uv: false,
    normal: true,
    feature: false,
    depth: true,
    lines: true,
    member: false,
    overlap: false,
    position: false,
    throughput: false,
    contribution: false,
};

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    // `cargo test --all-targets` runs benchmarks too, without this flag.
    if !arguments.iter().any(|argument| argument == "--bench") {
        return;
    }
    let has = |option: &str| arguments.iter().any(|argument| argument == option);
    let options = Options { any_pair: has("--any-pair"), brute: !has("--no-brute"), quick: has("--quick") };
    let asked: Vec<f32> = arguments.iter().filter_map(|argument| argument.parse().ok()).collect();
    let widths = if asked.is_empty() { vec![1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0] } else { asked };
    println!(
        "| width, px | samples | bytes | prepare, ns | brute, ns | search, ns | ratio | pairs, brute | pairs, search | lined |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for width in widths {
        for samples_per_pixel in [4, 16, 64, 256] {
            measure(width, samples_per_pixel, options);
        }
    }
}

#[derive(Clone, Copy)]
struct Options {
    any_pair: bool,
    brute: bool,
    quick: bool,
}

fn measure(width: f32, samples_per_pixel: u32, options: Options) {
    let settings =
        LineSettings { max_width: width, width, normal: Some(30.0), object: true, shader: true, ..Default::default() };
    let rules = Rules::new(&settings, samples_per_pixel);
    let rules = if options.any_pair { rules.with_any_pair() } else { rules };
    let layout = SampleLayout { columns: COLUMNS, ..layout(samples_per_pixel, width) };
    let node = |at| node(at, width);
    // The same picture at a rate that keeps the number of samples within bounds.
    let picture = if options.quick || samples_per_pixel > 64 { QUARTER } else { PICTURE };
    let tiles = Tiles::new(picture, TILE, &rules, |tile| sampled(tile, &layout, &node));
    let samples = tiles.samples() as f64;

    let preparing = nanoseconds(|| {
        for tile in &tiles.window().tiles {
            black_box(tile.map(|tile| TileBounds::new(tile.buffer, &rules)));
        }
    });
    let (mut pairs, mut lined) = (0, 0);
    let search = nanoseconds(|| {
        (pairs, lined) = (0, 0);
        for lines in tiles.lines(Method::Exact) {
            pairs += lines.counts.pairs_tested;
            lined += lines.counts.lined_samples;
        }
    });

    // Brute force takes small crops along the diagonal: its time hardly depends on what it sees.
    let side = if width * (samples_per_pixel as f32) > 500.0 { 4 } else { 16 };
    let affordable = width * width * samples_per_pixel as f32 <= 32.0 * 32.0 * 64.0;
    let crops = if options.brute && affordable { (1..9).collect() } else { Vec::new() };
    let (mut brute, mut brute_pairs, mut brute_samples) = (0.0, 0, 0.0);
    for step in crops {
        let [x0, y0] =
            [picture.x0 + picture.width() as i32 * step / 9, picture.y0 + picture.height() as i32 * step / 9];
        let crop = sampled(PixelRect { x0, y0, x1: x0 + side, y1: y0 + side }, &layout, &node);
        let bounds = TileBounds::new(&crop, &rules);
        let target = LineTile { buffer: &crop, bounds: &bounds };
        brute_samples += crop.samples() as f64;
        brute += seconds(|| {
            brute_pairs += find_lines(&tiles.window(), target, &rules, Method::Brute, None).counts.pairs_tested;
        });
    }

    let [preparing, search, brute] = [preparing / samples, search / samples, brute * 1e9 / brute_samples];
    println!(
        "| {width} | {samples_per_pixel} | {:.1} | {preparing:.1} | {brute:.0} | {search:.1} | {:.0} | {:.0} | {:.2} | {:.0} % |",
        tiles.bytes() as f64 / samples,
        brute / (preparing + search),
        brute_pairs as f64 / brute_samples,
        pairs as f64 / samples,
        lined as f64 / samples * 100.0,
    );
}

/// The time that this thread spent on a CPU, where the system tells (Linux), else wall time: other work on the machine
/// must not count.
fn seconds(work: impl FnOnce()) -> f64 {
    let on_cpu = || -> Option<f64> {
        let stat = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
        Some(stat.split(' ').next()?.parse::<f64>().ok()? * 1e-9)
    };
    let (start, start_on_cpu) = (Instant::now(), on_cpu());
    work();
    match (start_on_cpu, on_cpu()) {
        (Some(start), Some(end)) => end - start,
        _ => start.elapsed().as_secs_f64(),
    }
}

/// The best of three runs.
fn nanoseconds(mut work: impl FnMut()) -> f64 {
    (0..3).map(|_| seconds(&mut work)).fold(f64::INFINITY, f64::min) * 1e9
}

/// What the camera sees at a point of the film.
fn node([x, y]: [f32; 2], width: f32) -> Node {
    // Centre, radius, depth, priority, height of the dome.
    const DISCS: [([f32; 2], f32, f32, i32, f32); 4] = [
        ([130.0, 150.0], 70.0, 6.0, 0, 0.0),
        ([190.0, 190.0], 60.0, 7.0, 1, 0.0),
        ([370.0, 210.0], 80.0, 5.0, 0, 60.0),
        ([90.0, 300.0], 40.0, 4.0, 0, 0.0),
    ];
    let mut seen = Node::default();
    for (object, &([cx, cy], radius, depth, priority, dome)) in (1..).zip(&DISCS) {
        let [dx, dy] = [(x - cx) / radius, (y - cy) / radius];
        let squared = dx * dx + dy * dy;
        if squared >= 1.0 {
            continue;
        }
        // A little perspective: no two samples are equally deep.
        let depth = depth + 0.001 * x + 0.0007 * y - dome * 0.01 * (1.0 - squared).sqrt();
        if depth < seen.depth {
            let normal = if dome > 0.0 { [dx, dy, (1.0 - squared).sqrt()] } else { [0.0, 0.0, 1.0] };
            seen = Node { object, shader: object, depth, priority, normal, line_width: width, ..Node::default() };
        }
    }
    // A floor with a slanted horizon.
    if seen.object == 0 && y > 300.0 + 0.2 * x {
        let depth = 2000.0 / (y - 200.0);
        seen = Node { object: 9, shader: 8, depth, priority: 0, line_width: width, ..Node::default() };
    }
    seen
}
