//! What scripts give for lines that is no number: stopped, and counted by material, however the picture is cut.

use tusche::line::{LineBuffer, LineScript, LineScripts, Method, Rules, find_lines};
use tusche::sample::{GateCounts, Node, PairBatch, PixelRect};
use tusche::scene::settings::LineSettings;

use super::picture::{Tiles, layout, sampled};

/// NaN for lines of the first material; for those of the second an infinite colour, and a plain one for every third.
struct Wrong;

impl LineScripts for Wrong {
    fn style(&mut self, shader: u32, pairs: &mut PairBatch, styles: &mut Vec<(Option<[f32; 3]>, f32)>) {
        styles.extend((0..pairs.len).map(|row| match shader {
            1 => (None, f32::NAN),
            _ if pairs.pixel[row][0] as i32 % 3 == 0 => (Some([0.25; 3]), 7.0),
            _ => (Some([f32::INFINITY, 0.5, f32::NAN]), -3.0),
        }));
    }
}

/// A card of each material, apart from each other, before nothing.
fn cards([x, y]: [f32; 2]) -> Node {
    let card = |shader: u32| Node { object: shader, shader, depth: 2.0, line_width: 3.0, ..Node::default() };
    let within = (4.0..16.0).contains(&y);
    match x {
        _ if within && (4.0..10.0).contains(&x) => card(1),
        _ if within && (20.0..28.0).contains(&x) => card(2),
        _ => Node::default(),
    }
}

#[test]
fn what_is_no_number_is_stopped_and_counted() {
    let rect = PixelRect { x0: 0, y0: 0, x1: 32, y1: 20 };
    let settings = LineSettings::default();
    let rules = Rules::new(&settings, 4).with_scripts(&[LineScript::Opacity, LineScript::Opacity]);
    let mut counted = Vec::new();
    for side in [32, 7] {
        let tiles = Tiles::new(rect, side, &rules, |tile| sampled(tile, &layout(4, settings.max_width), &cards));
        let window = tiles.window();
        let lines: Vec<LineBuffer> = window
            .tiles
            .iter()
            .flatten()
            .map(|tile| find_lines(&window, *tile, &rules, Method::Exact, Some(&mut Wrong)))
            .collect();
        let mut counts = [GateCounts::default(); 3];
        for (sum, one) in lines.iter().flat_map(|lines| (0..).zip(&lines.gate)) {
            counts[sum as usize] += *one;
        }
        let all: Vec<_> = lines.iter().flat_map(|lines| &lines.lines).collect();
        assert!(all.iter().all(|line| line.lined.iter().chain(&line.color).all(|x| x.is_finite())));
        // The neutral opacity is 0; above 1 is 1.
        let opaque = all.iter().filter(|line| line.alpha == 1.0).count();
        let clear = all.iter().filter(|line| line.alpha == 0.0).count();
        assert!(opaque > 50 && opaque + clear == all.len());
        assert_eq!(counts[0], GateCounts::default(), "a miss draws no line");
        assert_eq!((counts[1].infinite, counts[1].negative), (0, 0));
        assert!(counts[1].nan > 50 && counts[2].nan > 50 && counts[2].nan == counts[2].infinite);
        assert_eq!(counts[1].nan + counts[2].nan + opaque as u64, all.len() as u64);
        counted.push(counts);
    }
    assert_eq!(counted[0], counted[1], "tiles do not matter");
}
