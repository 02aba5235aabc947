//! The methods to compare with: what each is known for, as numbers.

use tusche::line::{LineBuffer, Method, Rules};
use tusche::sample::{Node, PixelRect};
use tusche::scene::settings::LineSettings;

use super::picture::{Tiles, layout, sampled};

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
