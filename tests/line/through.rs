//! What is seen through lines that are not opaque: which lines, and that the search for them is a small part of the work.
//! That they are the oracle's for all kinds of samples is tested in `equal`.

use tusche::line::{LineBuffer, LineScript, LineScripts, LineTile, Method, Rules, TileBounds, Window, find_lines};
use tusche::sample::{HandMadeSample, Node, NodePath, PairBatch, PixelRect, SampleBuffer};
use tusche::scene::settings::LineSettings;

use super::picture::{layout, sampled};

/// Halves the opacity of every line and counts what it is asked.
#[derive(Default)]
struct Halving {
    lines: u64,
    calls: u64,
}

impl LineScripts for Halving {
    fn style(&mut self, _: u32, pairs: &mut PairBatch, styles: &mut Vec<(Option<[f32; 3]>, f32)>) {
        self.lines += pairs.len as u64;
        self.calls += 1;
        styles.extend(std::iter::repeat_n((None, 0.5), pairs.len));
    }
}

/// A far wall, and before it three balls that overlap each other, all with lines.
fn balls(at: [f32; 2]) -> Node {
    let wall = Node { object: 1, shader: 1, depth: 9.0, line_width: 3.0, normal: [0.0, 0.0, 1.0], ..Node::default() };
    let balls = [([13.0, 14.0], 9.0, 5.0), ([23.0, 15.0], 8.0, 4.0), ([19.0, 24.0], 7.0, 3.0)];
    let mut seen = wall;
    for (number, (center, radius, depth)) in (2..).zip(balls) {
        let [x, y]: [f32; 2] = [(at[0] - center[0]) / radius, (at[1] - center[1]) / radius];
        let height_squared = 1.0 - x * x - y * y;
        if height_squared > 0.0 {
            let z = height_squared.sqrt();
            let near = depth - 0.1 * z;
            if near < seen.depth {
                seen = Node { object: number, depth: near, line_width: 6.0, normal: [x, y, z], ..wall };
            }
        }
    }
    seen
}

fn lines(buffer: &SampleBuffer, rules: &Rules, method: Method, script: Option<&mut Halving>) -> LineBuffer {
    let bounds = TileBounds::new(buffer, rules);
    let tile = LineTile { buffer, bounds: &bounds };
    let script = script.map(|script| script as &mut dyn LineScripts);
    find_lines(&Window::single(tile), tile, rules, method, script)
}

fn without_counts(lines: LineBuffer) -> LineBuffer {
    LineBuffer { counts: Default::default(), ..lines }
}

/// Whatever a script gives: lines that may be seen through cost about as many pairs as opaque ones, and scripts are asked
/// about lines that are seen and nothing else.
#[test]
fn lines_that_are_seen_through_cost_little_more_than_opaque_ones() {
    let rect = PixelRect { x0: 0, y0: 0, x1: 34, y1: 34 };
    for (surfaces, samples, most) in [(1, 16, 1.5), (1, 64, 1.5), (2, 16, 3.0)] {
        for normal in [None, Some(30.0)] {
            let settings = LineSettings { max_width: 12.0, normal, surfaces, ..LineSettings::default() };
            let buffer = sampled(rect, &layout(samples, settings.max_width), &balls);
            let rules = Rules::new(&settings, samples);
            let opaque = lines(&buffer, &rules, Method::Exact, None).counts;
            let rules = rules.with_scripts(&[LineScript::Opacity]);
            let mut script = Halving::default();
            let seen = lines(&buffer, &rules, Method::Exact, Some(&mut script));
            let counts = seen.counts;
            assert_eq!(counts.lined_samples, opaque.lined_samples);
            let ratio = counts.pairs_tested as f64 / opaque.pairs_tested as f64;
            assert!(ratio < most, "{surfaces} surfaces, {samples} samples, normal {normal:?}: {ratio} times the pairs");
            // Near edges of two balls lines lie one behind the other; elsewhere there is one.
            let asked = script.lines as f64 / counts.lined_samples as f64;
            assert!((1.02..1.5).contains(&asked), "{surfaces} surfaces: {asked} lines a lined sample");
            assert_eq!(script.calls, 1, "all lines of a material at a path are asked for at once");
            if samples == 16 {
                let brute = lines(&buffer, &rules, Method::Brute, Some(&mut Halving::default()));
                let saved = brute.counts.pairs_tested as f64 / counts.pairs_tested as f64;
                assert!(saved > 15.0, "{surfaces} surfaces, normal {normal:?}: {saved}");
                assert_eq!(without_counts(seen), without_counts(brute));
            }
        }
    }
}

/// Many cards one behind the other, each with a line of its own: the eight in front are seen, however many there are.
#[test]
fn at_most_eight_lines_are_seen() {
    let settings = LineSettings { max_width: 60.0, width_compensation: false, ..LineSettings::default() };
    for cards in [3_u32, 8, 9, 14] {
        let rect = PixelRect { x0: 0, y0: 0, x1: cards as i32, y1: 1 };
        // All reach the last, which is the farthest: the first is the nearest.
        let node = |number: u32| Node {
            object: 1 + number,
            shader: 1,
            depth: 1.0 + number as f32,
            line_width: 40.0,
            ..Node::default()
        };
        let nodes: Vec<_> = (0..cards).map(|number| [(NodePath::CAMERA, node(number))]).collect();
        let samples: Vec<_> = nodes
            .iter()
            .map(|nodes| HandMadeSample { offset: [0.5, 0.5], nodes, ..HandMadeSample::default() })
            .collect();
        let buffer = SampleBuffer::from_samples(rect, &layout(1, settings.max_width), &samples);
        let rules = Rules::new(&settings, 1).with_scripts(&[LineScript::Opacity]);
        let [exact, brute] = [Method::Exact, Method::Brute].map(|method| {
            let mut script = Halving::default();
            (without_counts(lines(&buffer, &rules, method, Some(&mut script))), script.lines)
        });
        assert_eq!(exact, brute);
        // A card sees those before it, and its own line beside one behind it: never more than eight.
        let own = |number: u32| u32::from(number + 1 < cards);
        let expected: u32 = (0..cards).map(|number| (number + own(number)).min(8)).sum();
        assert_eq!(exact.1, u64::from(expected), "{cards} cards");
        let last = exact.0.lines.last().map(|line| line.alpha);
        assert_eq!(last, Some(1.0 - 0.5_f32.powi((cards as i32 - 1).min(8))), "{cards} cards");
    }
}
