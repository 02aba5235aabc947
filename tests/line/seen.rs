//! Which line is seen and how it colours its sample, with a few hand-made samples each (DESIGN sections 3.1 to 3.3).
//!
//! All samples lie in one row of pixels, one per pixel, so that places can be read off. Both methods must agree.

use tusche::line::{Fired, LineBuffer, LineTile, LineType, Method, Rules, SeenLine, TileBounds, Window, find_lines};
use tusche::math::Vec3;
use tusche::sample::{HandMadeSample, Node, NodePath, PixelRect, SampleBuffer, SampleColor};
use tusche::scene::settings::{Composition, LineSettings, RayKinds};

use super::picture::layout;

const CAMERA: NodePath = NodePath::CAMERA;
const GRAY: [f32; 3] = [0.5; 3];

/// The paper's radius, so that distances in tests are those in the text.
fn settings() -> LineSettings {
    LineSettings { width_compensation: false, min_width: 0.0, max_width: 16.0, ..Default::default() }
}

fn hit(object: u32, depth: f32, line_width: f32) -> Node {
    let line_color = [object as f32, 0.0, 0.0];
    Node { object, shader: 1, depth, line_width, line_color, priority: 0, ..Node::default() }
}

const MISS: fn() -> Node = Node::default;

/// A row of pixels with one sample each: its horizontal offset and its nodes.
fn lines_of(samples: &[(f32, &[(NodePath, Node)])], settings: &LineSettings) -> LineBuffer {
    let rect = PixelRect { x0: 0, y0: 0, x1: samples.len() as i32, y1: 1 };
    let color = SampleColor { color: GRAY, alpha: 1.0 };
    let samples: Vec<_> =
        samples.iter().map(|&(x, nodes)| HandMadeSample { offset: [x, 0.5], color, nodes, behind: &[] }).collect();
    let buffer = SampleBuffer::from_samples(rect, &layout(1, settings.max_width), &samples);
    let rules = Rules::new(settings, 1);
    let bounds = TileBounds::new(&buffer, &rules);
    let tile = LineTile { buffer: &buffer, bounds: &bounds };
    let [exact, brute] = [Method::Exact, Method::Brute].map(|method| {
        let mut lines = find_lines(&Window::single(tile), tile, &rules, method, None);
        lines.counts.pairs_tested = 0;
        lines
    });
    assert_eq!(exact, brute);
    exact
}

/// The line of each sample, all at the same place in their pixels, with camera nodes only.
fn camera_lines(nodes: &[Node], settings: &LineSettings) -> Vec<Option<SeenLine>> {
    let nodes: Vec<_> = nodes.iter().map(|&node| [(CAMERA, node)]).collect();
    let samples: Vec<_> = nodes.iter().map(|nodes| (0.5, &nodes[..])).collect();
    by_sample(&lines_of(&samples, settings), samples.len())
}

fn by_sample(lines: &LineBuffer, count: usize) -> Vec<Option<SeenLine>> {
    assert_eq!(lines.counts.lined_samples, lines.samples.len() as u64);
    (0..count as u32).map(|sample| lines.samples.binary_search(&sample).ok().map(|found| lines.lines[found])).collect()
}

/// Who styles the lines, by the red of [`hit`]'s line colour.
fn stylists(lines: &[Option<SeenLine>]) -> Vec<Option<u32>> {
    lines.iter().map(|line| line.map(|line| line.color[0] as u32)).collect()
}

fn neighbors(lines: &[Option<SeenLine>]) -> Vec<Option<i32>> {
    lines.iter().map(|line| line.map(|line| line.neighbor.0[0])).collect()
}

#[test]
fn the_shorter_depth_styles() {
    let lines = camera_lines(&[hit(1, 2.0, 3.0), hit(2, 1.0, 3.0), hit(3, 3.0, 3.0)], &settings());
    assert_eq!(stylists(&lines), [Some(2), Some(2), Some(2)]);
    assert_eq!(lines.iter().flatten().map(|line| line.own).collect::<Vec<_>>(), [false, true, false]);
}

#[test]
fn priority_goes_before_depth() {
    let nodes = [hit(1, 1.0, 3.0), Node { priority: 1, ..hit(2, 9.0, 3.0) }, hit(3, 1.0, 3.0)];
    assert_eq!(stylists(&camera_lines(&nodes, &settings())), [Some(2), Some(2), Some(2)]);
    let nodes = [hit(1, 9.0, 3.0), Node { priority: -1, ..hit(2, 1.0, 3.0) }, hit(3, 9.0, 3.0)];
    assert_eq!(stylists(&camera_lines(&nodes, &settings())), [Some(1), Some(1), Some(3)]);
}

#[test]
fn at_equal_depth_each_side_has_its_own_line() {
    let lines = camera_lines(&[hit(1, 1.0, 3.0), hit(2, 1.0, 3.0)], &settings());
    assert_eq!(stylists(&lines), [Some(1), Some(2)]);
    assert!(lines.iter().flatten().all(|line| line.own));
}

#[test]
fn the_topmost_line_is_seen_however_far() {
    // The target in the middle reaches all of them; the last one is on top.
    let nodes = [hit(1, 3.0, 10.0), hit(2, 4.0, 10.0), hit(3, 9.0, 10.0), hit(4, 4.0, 10.0), hit(5, 2.0, 10.0)];
    assert_eq!(stylists(&camera_lines(&nodes, &settings()))[2], Some(5));
}

#[test]
fn among_equal_ranks_the_nearest_is_seen_and_then_the_first() {
    let target = hit(1, 5.0, 0.0);
    let nodes = [hit(2, 1.0, 9.0), target, target, hit(3, 1.0, 9.0)];
    assert_eq!(neighbors(&camera_lines(&nodes, &settings()))[1..3], [Some(0), Some(3)]);
    let nodes = [hit(2, 1.0, 9.0), target, hit(3, 1.0, 9.0)];
    assert_eq!(neighbors(&camera_lines(&nodes, &settings()))[1], Some(0), "a tie in distance");
    // The same when the line is the target's own.
    let nodes = [hit(2, 9.0, 0.0), hit(1, 5.0, 9.0), hit(2, 8.0, 0.0)];
    assert_eq!(neighbors(&camera_lines(&nodes, &settings()))[1], Some(0), "an own line");
}

/// A tie on the borders of pixels, where the second neighbour is the search's first guess.
#[test]
fn a_tie_goes_to_the_first_whatever_was_tried_first() {
    let behind = |object| [(CAMERA, hit(object, 5.0, 0.0))];
    let front = |object| [(CAMERA, hit(object, 1.0, 9.0))];
    let [a, b, c, d] = [behind(1), front(1), behind(2), front(3)];
    let samples: [(f32, &[_]); 4] = [(0.5, &a), (1.0, &b), (0.5, &c), (0.0, &d)];
    let lines = by_sample(&lines_of(&samples, &settings()), 4);
    assert_eq!(neighbors(&lines)[0], Some(3));
    assert_eq!(neighbors(&lines)[2], Some(1));
}

#[test]
fn a_miss_never_styles() {
    let low = Node { priority: i32::MIN, ..hit(1, f32::MAX, 3.0) };
    let lines = camera_lines(&[MISS(), low, MISS()], &settings());
    assert_eq!(stylists(&lines), [Some(1); 3]);
    // Even if the tracer gives it a style.
    let loud = Node { line_width: 8.0, priority: 9, depth: 0.0, line_color: [7.0; 3], ..Node::default() };
    assert_eq!(stylists(&camera_lines(&[loud, hit(1, 1.0, 3.0)], &settings())), [Some(1), Some(1)]);
}

#[test]
fn a_miss_takes_part_in_object_and_shader_tests_only() {
    let odd = Node { uv: [5.0; 2], normal: [1.0, 0.0, 0.0], feature: [5.0; 3], ..hit(1, 1.0, 3.0) };
    let off = LineSettings { object: false, shader: false, ..settings() };
    let rest = LineSettings { uv: Some(0.0), normal: Some(0.0), feature: Some(0.0), ..off.clone() };
    assert_eq!(stylists(&camera_lines(&[odd, MISS()], &rest)), [None, None]);
    for (on, fired) in [
        (LineSettings { object: true, ..rest.clone() }, Fired::OBJECT | Fired::MISS),
        (LineSettings { shader: true, ..rest }, Fired::SHADER | Fired::MISS),
    ] {
        let lines = camera_lines(&[odd, MISS()], &on);
        assert_eq!(lines.iter().flatten().map(|line| line.fired).collect::<Vec<_>>(), [fired; 2]);
    }
    assert_eq!(stylists(&camera_lines(&[MISS(), MISS()], &settings())), [None, None]);
}

/// OG18 figure 6: the silhouette of the object behind is lost where an object without lines covers it.
#[test]
fn an_object_without_lines_hides_the_line_behind_it() {
    let [front, behind] = [hit(1, 1.0, 0.0), hit(2, 2.0, 9.0)];
    assert_eq!(stylists(&camera_lines(&[MISS(), front, behind], &settings())), [Some(2), None, Some(2)]);
    assert_eq!(stylists(&camera_lines(&[front, behind], &settings())), [None, None]);
}

#[test]
fn a_neighbor_at_the_radius_is_too_far() {
    for (width, seen) in [(2.0, None), (2.000_001, Some(1))] {
        let lines = camera_lines(&[hit(1, 1.0, width), MISS()], &settings());
        assert_eq!(stylists(&lines), [seen, seen], "{width} px, 1 px apart");
    }
    // The radius is that of the priority sample, not of the target.
    assert_eq!(stylists(&camera_lines(&[hit(1, 1.0, 1.0), hit(2, 2.0, 9.0)], &settings())), [None, None]);
}

#[test]
fn thresholds_are_exceeded_or_not() {
    let base = Node { normal: [0.0, 0.0, 1.0], ..hit(1, 1.0, 3.0) };
    let none = LineSettings { object: false, shader: false, ..settings() };
    let differ = |settings: &LineSettings, other: Node| {
        let lines = camera_lines(&[base, other], settings);
        assert_eq!(lines[0].is_some(), lines[1].is_some());
        lines[0].map(|line| line.fired)
    };

    let uv = |limit| LineSettings { uv: Some(limit), ..none.clone() };
    let moved = Node { uv: [0.3, 0.4], ..base };
    assert_eq!(differ(&uv(0.5), Node { uv: [0.5, 0.0], ..base }), None);
    assert_eq!(differ(&uv(0.49), moved), Some(Fired::UV));
    assert_eq!(differ(&uv(0.0), moved), Some(Fired::UV));
    assert_eq!(differ(&uv(0.0), base), None);

    let normal = |limit| LineSettings { normal: Some(limit), ..none.clone() };
    let turned = |normal| Node { normal, ..base };
    let [right, back] = [turned([1.0, 0.0, 0.0]), turned([0.0, 0.0, -1.0])];
    assert_eq!(differ(&normal(90.0), right), None, "exactly the threshold");
    assert_eq!(differ(&normal(89.99), right), Some(Fired::NORMAL));
    assert_eq!(differ(&normal(179.9), back), Some(Fired::NORMAL));
    assert_eq!(differ(&normal(180.0), back), None, "180° turns the test off");
    assert_eq!(differ(&normal(0.0), base), None, "equal normals at 0°");
    assert_eq!(differ(&normal(0.0), turned([1e-4, 0.0, 1.0])), Some(Fired::NORMAL), "anything else at 0°");
    let tilted = |degrees: f32| turned([degrees.to_radians().sin(), 0.0, degrees.to_radians().cos()]);
    for threshold in [0.01, 0.1, 30.0, 60.0, 120.0, 170.0] {
        assert_eq!(differ(&normal(threshold), tilted(threshold * 0.999)), None, "{threshold}°");
        assert_eq!(differ(&normal(threshold), tilted(threshold * 1.001)), Some(Fired::NORMAL), "{threshold}°");
    }
    assert_eq!(differ(&normal(1.0), turned([0.0, 0.0, 1e-20])), None, "length does not count");

    let feature = |limit| LineSettings { feature: Some(limit), ..none.clone() };
    assert_eq!(differ(&feature(0.5), Node { feature: [0.5, -0.5, 0.5], ..base }), None, "per channel");
    assert_eq!(differ(&feature(0.5), Node { feature: [0.0, 0.0, 0.6], ..base }), Some(Fired::FEATURE));
    let both = LineSettings { object: true, ..feature(0.5) };
    let strange = Node { object: 2, feature: [9.0; 3], ..base };
    assert_eq!(differ(&both, strange), Some(Fired::OBJECT | Fired::FEATURE));
}

#[test]
fn not_a_number_never_reaches_the_tests() {
    let odd = Node { uv: [f32::NAN; 2], normal: [f32::NAN; 3], feature: [f32::NAN; 3], ..hit(1, 1.0, 3.0) };
    let all = LineSettings { uv: Some(0.0), normal: Some(0.0), feature: Some(0.0), ..settings() };
    assert_eq!(stylists(&camera_lines(&[odd, hit(1, 1.0, 3.0)], &all)), [None, None]);
    let unseen = Node { line_width: f32::NAN, ..hit(2, 0.5, 3.0) };
    assert_eq!(stylists(&camera_lines(&[unseen, hit(1, 1.0, 3.0)], &all)), [None, None]);
}

#[test]
fn the_strongest_reason_names_the_line() {
    let order = [
        (Fired::MISS, LineType::Outline),
        (Fired::OBJECT, LineType::Silhouette),
        (Fired::OVERLAP, LineType::Overlap),
        (Fired::SHADER, LineType::Material),
        (Fired::NORMAL, LineType::Crease),
        (Fired::UV, LineType::Uv),
        (Fired::FEATURE, LineType::Feature),
    ];
    let mut weaker = Fired::empty();
    assert_eq!(LineType::of(weaker), None);
    for (test, kind) in order.into_iter().rev() {
        weaker |= test;
        assert_eq!(LineType::of(weaker), Some(kind));
    }
}

#[test]
fn paths_are_taken_reflections_first_and_only_without_a_line_yet() {
    let (r, t) = (CAMERA.reflected(), CAMERA.refracted());
    let camera = [(CAMERA, hit(9, 1.0, 0.0))];
    let glass = |reflected: u32, refracted: u32| {
        [(CAMERA, hit(9, 1.0, 0.0)), (r, hit(reflected, 2.0, 3.0)), (t, hit(refracted, 2.0, 3.0))]
    };
    // Between the first two both nodes differ, between the next two the refracted alone; the last has no glass.
    let [a, b, c] = [glass(1, 4), glass(2, 5), glass(2, 6)];
    let samples: [(f32, &[_]); 4] = [(0.5, &a), (0.5, &b), (0.5, &c), (0.5, &camera)];
    let paths = |settings: &LineSettings| {
        let lines = by_sample(&lines_of(&samples, settings), 4);
        lines.iter().map(|line| line.map_or("-".into(), |line| line.path.to_string())).collect::<Vec<_>>().join(" ")
    };
    assert_eq!(paths(&settings()), "R R T -");
    assert_eq!(paths(&LineSettings { paths: RayKinds::CAMERA | RayKinds::REFRACTION, ..settings() }), "T T T -");
    assert_eq!(paths(&LineSettings { paths: RayKinds::CAMERA, ..settings() }), "- - - -");

    // A line at the camera's node comes first.
    let own = [(CAMERA, hit(8, 0.5, 3.0)), (r, hit(1, 2.0, 3.0))];
    let samples: [(f32, &[_]); 3] = [(0.5, &own), (0.5, &b), (0.5, &c)];
    let lines = by_sample(&lines_of(&samples, &settings()), 3);
    let paths = lines.iter().flatten().map(|line| line.path.to_string());
    assert_eq!(paths.collect::<Vec<_>>(), ["", "", "T"]);
}

#[test]
fn a_reflected_sky_outlines_what_is_reflected() {
    let r = CAMERA.reflected();
    let mirror = |seen: Node| [(CAMERA, hit(9, 1.0, 0.0)), (r, seen)];
    let [ball, sky] = [mirror(hit(1, 2.0, 3.0)), mirror(MISS())];
    let lines = by_sample(&lines_of(&[(0.5, &ball), (0.5, &sky)], &settings()), 2);
    assert_eq!(stylists(&lines), [Some(1), Some(1)]);
    assert!(lines.iter().flatten().all(|line| LineType::of(line.fired) == Some(LineType::Outline)));
}

#[test]
fn colors_follow_tint_and_composition() {
    let r = CAMERA.reflected();
    let mirror = |object: u32| {
        let seen = Node {
            line_color: [1.0, 0.5, 0.25],
            throughput: [0.5, 0.25, 0.125],
            contribution: [0.25, 0.125, 0.0],
            ..hit(object, 2.0, 3.0)
        };
        [(CAMERA, hit(9, 1.0, 0.0)), (r, seen)]
    };
    let [a, b] = [mirror(1), mirror(2)];
    let line = |tint, compose, min_width| {
        let settings = LineSettings { tint, compose, min_width, ..settings() };
        let line = by_sample(&lines_of(&[(0.5, &a), (0.5, &b)], &settings), 2)[0].expect("both sides have a line");
        (line.color, line.alpha, line.lined)
    };
    use Composition::{Replace, Throughput};
    let (plain, tinted) = ([1.0, 0.5, 0.25], [0.5, 0.125, 0.031_25]);
    assert_eq!(line(false, Replace, 0.0), (plain, 1.0, plain));
    assert_eq!(line(true, Replace, 0.0), (tinted, 1.0, tinted));
    // Half the minimum width: half the sample's colour, which is 0.5.
    assert_eq!(line(true, Replace, 6.0), (tinted, 0.5, tinted.map(|c| 0.25 + c / 2.0)));
    // The node's part of the sample goes, the line's takes its place.
    assert_eq!(line(true, Throughput, 0.0), (tinted, 1.0, [0.5 - 0.25 + 0.5, 0.5 - 0.125 + 0.125, 0.5 + 0.031_25]));
    assert_eq!(line(true, Throughput, 6.0).2, [0.625, 0.5, 0.515_625]);
    // Without tint the weight is one number, the throughput's luminance.
    let weight = 0.5 * 0.2126 + 0.25 * 0.7152 + 0.125 * 0.0722;
    let (color, alpha, lined) = line(false, Throughput, 0.0);
    assert_eq!((color, alpha), (plain, 1.0));
    let expected = Vec3::new(0.25 + weight, 0.375 + weight * 0.5, 0.5 + weight * 0.25);
    assert!((Vec3::from(lined) - expected).abs().max_element() < 1e-6, "{lined:?}, not {expected}");
}

#[test]
fn at_the_camera_both_compositions_are_one() {
    let whole = Node { contribution: GRAY, ..hit(1, 1.0, 3.0) };
    for tint in [false, true] {
        let lined = [Composition::Replace, Composition::Throughput].map(|compose| {
            let settings = LineSettings { tint, compose, ..settings() };
            camera_lines(&[whole, MISS()], &settings)[0].expect("an outline").lined
        });
        assert_eq!(lined, [[1.0, 0.0, 0.0]; 2]);
    }
}

#[test]
fn a_picture_without_samples_has_no_lines() {
    assert_eq!(lines_of(&[], &settings()).samples, [0_u32; 0]);
    let off = LineSettings { max_width: 0.0, ..settings() };
    assert_eq!(stylists(&camera_lines(&[hit(1, 1.0, 3.0), MISS()], &off)), [None, None]);
}

/// Three lines on one sample: a half-transparent one in front, one of half the minimum width, and an opaque one.
#[test]
fn lines_that_are_not_opaque_show_the_lines_behind_them() {
    let node = |object: u32, depth: f32, red: f32, opacity: f32| Node {
        line_color: [red, 0.0, 0.0],
        line_opacity: opacity,
        ..hit(object, depth, 9.0)
    };
    let target = hit(9, 8.0, 0.0);
    let nodes =
        [node(1, 1.0, 1.0, 0.5), node(2, 2.0, 0.5, 0.5), target, node(3, 3.0, 0.25, 1.0), node(4, 4.0, 8.0, 1.0)];
    let seen = |nodes: &[Node]| camera_lines(nodes, &settings())[2].expect("lines all around");
    let line = seen(&nodes);
    // Half of 1, half of the rest of 0.5, and all that remains of 0.25; nothing of 8.
    let mixed = 0.5 + 0.25 * 0.5 + 0.25 * 0.25;
    assert_eq!((line.alpha, line.color[0], line.lined), (1.0, mixed, [mixed, 0.0, 0.0]));
    assert_eq!(line.neighbor.0[0], 0, "what else is told is of the line in front");

    // Without the opaque ones, a quarter of the sample's colour is left.
    let through = seen(&nodes[..3]);
    assert_eq!((through.alpha, through.lined[1]), (0.75, 0.25 * GRAY[1]));

    // An edge is one line, however many pairs see it, and whichever side draws it.
    let twice = [nodes[0], nodes[0], target, nodes[0], nodes[0]];
    assert_eq!(seen(&twice).alpha, 0.5);
    let edge = [node(1, 5.0, 1.0, 0.5), node(1, 1.0, 1.0, 0.5), node(2, 3.0, 1.0, 0.5)];
    assert_eq!(seen(&edge).alpha, 0.5, "one neighbour outranks the target and one does not");
    // So is the outline of one object before several others.
    let before_two = [node(3, 7.0, 1.0, 0.0), node(1, 7.0, 1.0, 0.0), node(2, 3.0, 1.0, 0.5), node(4, 7.0, 1.0, 0.0)];
    assert_eq!(seen(&before_two).alpha, 0.5);
}
