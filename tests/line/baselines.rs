//! The methods to compare with: what each is known for, as numbers.

use tusche::film::Layer;
use tusche::line::{LineBuffer, Method, Rules};
use tusche::render::RenderOptions;
use tusche::sample::{HandMadeSample, Node, NodePath, PixelRect, SampleBuffer};
use tusche::scene::settings::LineSettings;

use super::picture::{Tiles, layout, sampled};
use crate::common::{render_with, root, scene_from};

const PICTURE: PixelRect = PixelRect { x0: 0, y0: 0, x1: 24, y1: 24 };
const CROSSING: [f32; 2] = [12.3, 11.8];
const WIDTH: f32 = 6.0;

/// Alpha of the sample nearest to a point of the film.
fn alpha_at(method: Method, at: [f32; 2], node: &dyn Fn([f32; 2]) -> Node) -> f32 {
    let settings = LineSettings { width: WIDTH, ..LineSettings::default() };
    let rules = Rules::new(&settings, 16);
    let layout = layout(16, WIDTH);
    let tiles = Tiles::new(PICTURE, 64, &rules, |tile| sampled(tile, &layout, node));
    let lines: LineBuffer = tiles.lines_of(0, method);
    let buffer = sampled(PICTURE, &layout, node);
    let distance = |sample: &u32| {
        let ([x, y], [dx, dy]) = (buffer.pixel_of(*sample), buffer.offset[*sample as usize]);
        (x as f32 + dx - at[0]).hypot(y as f32 + dy - at[1])
    };
    let all: Vec<u32> = (0..buffer.samples() as u32).collect();
    let nearest = all.iter().min_by(|a, b| distance(a).total_cmp(&distance(b))).expect("there are samples");
    lines.samples.binary_search(nearest).map_or(0.0, |found| lines.lines[found].alpha)
}

fn hit(object: u32) -> Node {
    Node { object, shader: 1, depth: 1.0, line_width: WIDTH, priority: 0, ..Node::default() }
}

/// Four objects that meet in a point: two straight edges cross.
fn quadrants([x, y]: [f32; 2]) -> Node {
    hit(1 + u32::from(x > CROSSING[0]) + 2 * u32::from(y > CROSSING[1]))
}

const METHODS: [Method; 3] = [Method::Exact, Method::Choudhury, Method::Bauer];

/// OG18 figure 2: three quarters of the stencil differ at the crossing, so there the line of Choudhury and Parker is half
/// as strong as on a single edge.
#[test]
fn choudhury_brightens_where_lines_cross_and_ours_does_not() {
    let on_edge = METHODS.map(|method| alpha_at(method, [CROSSING[0] + 0.05, 5.0], &quadrants));
    let at_crossing = METHODS.map(|method| alpha_at(method, [CROSSING[0] + 0.05, CROSSING[1] + 0.05], &quadrants));
    assert_eq!((on_edge[0], at_crossing[0]), (1.0, 1.0), "ours");
    assert!(on_edge[1] > 0.93, "on a straight edge half of the stencil differs: {}", on_edge[1]);
    assert!((at_crossing[1] - 0.5).abs() < 0.07, "three quarters differ: {}", at_crossing[1]);
    assert_eq!((on_edge[2], at_crossing[2]), (1.0, 1.0), "Bauer's are opaque");
}

#[test]
fn choudhury_fades_across_the_line_and_all_end_at_its_border() {
    let at = |method, distance: f32| alpha_at(method, [CROSSING[0] + distance, 5.0], &quadrants);
    let fading = [0.0, 0.75, 1.5, 2.25].map(|distance| at(Method::Choudhury, distance));
    assert!(fading.is_sorted_by(|a, b| a > b), "{fading:?}");
    assert_eq!([0.0, 1.5, 2.5].map(|distance| at(Method::Bauer, distance)), [1.0; 3]);
    for method in METHODS {
        assert_eq!(at(method, 3.6), 0.0, "{method:?}");
        assert_eq!(at(method, 9.0), 0.0, "{method:?}");
    }
}

/// One style for all: widths and colours of shaders are not asked.
#[test]
fn baselines_know_one_style() {
    let thin = |at| Node { line_width: 0.5, line_color: [1.0, 0.0, 0.0], ..quadrants(at) };
    let at = [CROSSING[0] + 1.5, 5.0];
    let [ours, choudhury, bauer] = METHODS.map(|method| alpha_at(method, at, &thin));
    assert_eq!(ours, 0.0);
    assert!(choudhury > 0.1 && bauer == 1.0, "{choudhury} {bauer}");
}

/// What a target at a distance from a straight edge finds beyond it: the part of its disc of radius 1 that is a segment.
fn part_beyond(distance: f64) -> f64 {
    (distance.acos() - distance * (1.0 - distance * distance).sqrt()) / std::f64::consts::PI
}

/// Of targets in reach of a straight edge, the mean of 1 − (1 − f)^N, and the mean variance of being lined.
fn lined_by_path(probes: i32) -> [f64; 2] {
    const STEPS: u32 = 10_000;
    let mean = |of: fn(f64) -> f64| {
        let steps = (0..STEPS).map(|step| (f64::from(step) + 0.5) / f64::from(STEPS));
        steps.map(|distance| of(1.0 - (1.0 - part_beyond(distance)).powi(probes))).sum::<f64>() / f64::from(STEPS)
    };
    [mean(|lined| lined), mean(|lined| lined * (1.0 - lined))]
}

/// The counts are so near to what is expected that one probe more or less would be noticed.
#[test]
fn path_lines_a_straight_edge_as_often_as_its_probes_meet_what_lies_beyond() {
    let film = PixelRect { x0: 0, y0: 0, x1: 16, y1: 248 };
    let inner = 4..244;
    let settings =
        LineSettings { width: WIDTH, max_width: WIDTH, width_compensation: false, ..LineSettings::default() };
    let layout = layout(64, WIDTH);
    let node = |[x, _]: [f32; 2]| hit(1 + u32::from(x > 8.3));
    let tiles = Tiles::new(film, 256, &Rules::new(&settings, 64), |tile| sampled(tile, &layout, &node));
    let in_reach = f64::from(WIDTH) * 64.0 * inner.len() as f64;
    for probes in [1, 2, 4, 8, 16, 64] {
        let lines = tiles.lines_of(0, Method::Path { probes });
        let rows = lines.samples.iter().map(|sample| sample / 64 / film.width());
        let lined = rows.filter(|row| inner.contains(row)).count() as f64;
        let [mean, variance] = lined_by_path(probes as i32);
        let tolerance = 4.0 * (variance * in_reach).sqrt() + 1e-3 * mean * in_reach;
        assert!((lined - mean * in_reach).abs() < tolerance, "{probes}: {lined} for {}", mean * in_reach);
        let fewer = lined_by_path(probes as i32 - 1)[0];
        assert!(probes > 16 || (mean - fewer) * in_reach > 1.5 * tolerance, "{probes}: the bound is too wide");
        assert_eq!(lines.counts.pairs_tested, u64::from(probes) * film.pixels() as u64 * 64);
    }
    // A fifth too thin.
    let [mean, _] = lined_by_path(16);
    assert!((mean - 0.80).abs() < 0.01, "{mean}");
    assert_eq!(Method::PATH, Method::Path { probes: 16 });
}

/// Unlike with the older methods, closeness decides who draws, each with its own width, and lines are seen in mirrors.
#[test]
fn path_draws_every_style_and_in_mirrors() {
    let node =
        |at: [f32; 2]| Node { depth: 1.0 + at[0], line_width: 2.0 + 4.0 * (at[1] / 24.0).round(), ..quadrants(at) };
    let layout = layout(4, WIDTH);
    let mirrored = |rect: PixelRect| {
        let plain = sampled(rect, &layout, &node);
        let nodes: Vec<_> = (0..plain.samples() as u32)
            .map(|sample| {
                let ([x, y], [dx, dy]) = (plain.pixel_of(sample), plain.offset[sample as usize]);
                let seen = node([x as f32 + dx, y as f32 + dy]);
                ([dx, dy], [(NodePath::CAMERA, hit(9)), (NodePath::CAMERA.reflected(), seen)])
            })
            .collect();
        let samples: Vec<_> = nodes
            .iter()
            .map(|(offset, nodes)| HandMadeSample { offset: *offset, nodes, ..HandMadeSample::default() })
            .collect();
        SampleBuffer::from_samples(rect, &layout, &samples)
    };
    let rules = Rules::new(&LineSettings { max_width: WIDTH, ..LineSettings::default() }, 4);
    let tiles = Tiles::new(PICTURE, 64, &rules, mirrored);
    let exact = tiles.lines_of(0, Method::Exact);
    let path = tiles.lines_of(0, Method::PATH);
    assert!(path.lines.iter().all(|line| line.path == NodePath::CAMERA.reflected() && line.alpha == 1.0));
    assert!(path.samples.iter().all(|sample| exact.samples.binary_search(sample).is_ok()));
    let share = path.samples.len() as f64 / exact.samples.len() as f64;
    assert!((0.7..0.95).contains(&share), "{share}");
    // Every segment of every target is probed: at the camera's node nothing differs.
    assert_eq!(path.counts.pairs_tested, 2 * 16 * PICTURE.pixels() as u64 * 4);
    assert_eq!(tiles.lines_of(0, Method::Path { probes: 4096 }).lines, exact.lines);
    for method in [Method::Choudhury, Method::Bauer] {
        assert_eq!(tiles.lines_of(0, method).samples.len(), 0, "{method:?}");
    }
}

#[test]
fn path_does_not_depend_on_tiles_threads_and_crops() {
    for name in ["fig2_crossings", "glass"] {
        let text = std::fs::read_to_string(root().join(format!("scenes/{name}.toml")));
        let mut builder = scene_from(&text.expect("shipped scenes can be read")).into_builder();
        (builder.render.size, builder.render.samples) = ([72, 40], 4);
        let scene = builder.build().unwrap_or_else(|faults| panic!("{faults}"));
        let draw = |tile, threads, crop| {
            let options = RenderOptions { method: Method::PATH, tile, threads, crop };
            render_with(&scene, &[Layer::Rgba, Layer::Line], &options).0
        };
        let whole = draw(32, 1, None);
        assert!(whole.bits() != render_with(&scene, &[Layer::Rgba, Layer::Line], &RenderOptions::default()).0.bits());
        assert!(draw(7, 2, None).bits() == whole.bits(), "{name}");
        let crop = PixelRect { x0: 21, y0: 9, x1: 47, y1: 33 };
        let part = draw(32, 2, Some(crop));
        for (y, x) in (9..33).flat_map(|y| (21..47).map(move |x| (y, x))) {
            assert!(
                (0..part.channels.len()).all(|channel| part.at(channel, x, y) == whole.at(channel, x, y)),
                "{name}: {x}, {y}"
            );
        }
    }
}
