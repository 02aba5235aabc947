//! Lists of surfaces, with a few hand-made samples each (DESIGN section 3.4): a row of pixels with one sample in each, as in
//! `seen`. Both methods must agree.

use tusche::line::{Fired, LineTile, Method, Rules, SeenLine, TileBounds, Window, find_lines};
use tusche::math::Vec3;
use tusche::sample::{Column, HandMadeSample, Node, NodePath, PixelRect, SampleBuffer, SampleColor};
use tusche::scene::ids::ObjectId;
use tusche::scene::settings::{HiddenLines, LineSettings};

use super::picture::layout;

const CAMERA: NodePath = NodePath::CAMERA;

/// The paper's radius, so that distances in tests are those in the text.
fn settings(surfaces: u32) -> LineSettings {
    LineSettings { width_compensation: false, min_width: 0.0, max_width: 16.0, surfaces, ..Default::default() }
}

fn hidden(surfaces: u32, width: f32) -> LineSettings {
    let style = HiddenLines { color: Vec3::new(0.0, 1.0, 0.0), width, objects: None };
    LineSettings { hidden: Some(style), ..settings(surfaces) }
}

/// A hit whose line is as red as its object's number.
fn hit(object: u32, depth: f32, line_width: f32) -> Node {
    let line_color = [object as f32, 0.0, 0.0];
    Node { object, shader: 1, depth, line_width, line_color, priority: 0, ..Node::default() }
}

/// A ball without lines, near the camera.
fn ball() -> Node {
    hit(9, 1.0, 0.0)
}

/// A card with thick lines behind it.
fn card() -> Node {
    hit(2, 5.0, 5.0)
}

fn buffer(lists: &[&[Node]], through: &[(usize, Node)], settings: &LineSettings) -> SampleBuffer {
    let rect = PixelRect { x0: 0, y0: 0, x1: lists.len() as i32, y1: 1 };
    let color = SampleColor { color: [0.5; 3], alpha: 1.0 };
    let nodes: Vec<Vec<(NodePath, Node)>> = (0..lists.len())
        .map(|sample| {
            let first = lists[sample].first().copied().unwrap_or_default();
            let through = through.iter().filter(|(of, _)| *of == sample).map(|&(_, node)| (CAMERA.refracted(), node));
            [(CAMERA, first)].into_iter().chain(through).collect()
        })
        .collect();
    let behind: Vec<Vec<_>> =
        lists.iter().map(|list| list.iter().skip(1).map(|&node| (CAMERA, node)).collect()).collect();
    let samples: Vec<_> = nodes
        .iter()
        .zip(&behind)
        .map(|(nodes, behind)| HandMadeSample { offset: [0.5, 0.5], color, nodes, behind })
        .collect();
    SampleBuffer::from_samples(rect, &layout(1, settings.max_width), &samples)
}

fn lines_of(lists: &[&[Node]], through: &[(usize, Node)], settings: &LineSettings) -> Vec<Option<SeenLine>> {
    let buffer = buffer(lists, through, settings);
    let rules = Rules::new(settings, 1);
    let bounds = TileBounds::new(&buffer, &rules);
    let tile = LineTile { buffer: &buffer, bounds: &bounds };
    let [exact, brute] = [Method::Exact, Method::Brute].map(|method| {
        let mut lines = find_lines(&Window::single(tile), tile, &rules, method, None);
        lines.counts.pairs_tested = 0;
        lines
    });
    assert_eq!(exact, brute);
    let line = |sample| exact.samples.binary_search(&sample).ok().map(|found| exact.lines[found]);
    (0..lists.len() as u32).map(line).collect()
}

/// Whose line each sample sees, as letters: the object's number, `h` for a hidden line, `-` for none.
fn seen(lists: &[&[Node]], settings: &LineSettings) -> String {
    let lines = lines_of(lists, &[], settings);
    let letter = |line: Option<SeenLine>| match line {
        None => "-".to_owned(),
        Some(line) if line.hidden => "h".to_owned(),
        Some(line) => format!("{}", line.color[0]),
    };
    lines.into_iter().map(letter).collect()
}

/// OG18 figure 6 in one row: a card that goes on behind a ball that draws nothing. The card's edge is behind the ball.
#[test]
fn a_line_behind_an_object_without_lines_goes_on_beside_it() {
    let behind: &[Node] = &[ball(), card()];
    let lists = |covered: &[Node]| [&[][..], &[], covered, behind, &[card()], &[card()]].map(<[Node]>::to_vec);
    let view = |lists: &[Vec<Node>], surfaces| {
        let lists: Vec<_> = lists.iter().map(Vec::as_slice).collect();
        seen(&lists, &settings(surfaces))
    };
    // The ball's silhouette lies beyond the card's: with one surface, the background knows nothing of the card.
    let apart = lists(behind);
    assert_eq!(view(&apart, 1), "------");
    assert_eq!(view(&apart, 2), "22----");
    // Its edge lies behind the ball: the card's own half of the line is there, too, but not on the ball.
    let within = lists(&[ball()]);
    assert_eq!(view(&within, 1), "------");
    assert_eq!(view(&within, 2), "-2--2-");
    assert_eq!(view(&within, 4), "-2--2-");
}

#[test]
fn what_a_full_list_may_lack_draws_nothing() {
    let wall = hit(3, 9.0, 9.0);
    // Behind the two surfaces of the middle sample the wall may go on.
    let lists: [&[Node]; 3] = [&[wall], &[ball(), hit(8, 2.0, 0.0)], &[wall]];
    assert_eq!(seen(&lists, &settings(2)), "---");
    // A third surface tells that it does, or that it does not.
    assert_eq!(seen(&lists, &settings(3)), "3-3");
    let known: [&[Node]; 3] = [&[wall], &[ball(), hit(8, 2.0, 0.0), wall], &[wall]];
    assert_eq!(seen(&known, &settings(3)), "---");
}

#[test]
fn priority_settles_what_is_behind_and_what_is_complete() {
    let on_top = Node { priority: 1, ..card() };
    // The card is farther than the ball and yet not behind it.
    let lists: [&[Node]; 2] = [&[ball()], &[on_top]];
    assert_eq!(seen(&lists, &settings(1)), "22");
    assert_eq!(seen(&lists, &settings(2)), "22");
    // It goes on behind the ball, and is drawn along the ball's edge, as the priority asks.
    let lists: [&[Node]; 2] = [&[ball(), on_top], &[on_top]];
    assert_eq!(seen(&lists, &settings(1)), "22");
    assert_eq!(seen(&lists, &settings(2)), "22");
    // A full list whose last surface has less priority counts as complete; one with as much does not.
    let cover = Node { priority: 2, ..ball() };
    let lists = |priority| [vec![on_top], vec![cover, Node { priority, ..hit(8, 2.0, 0.0) }]];
    let view = |lists: [Vec<Node>; 2]| seen(&lists.each_ref().map(Vec::as_slice), &settings(2));
    assert_eq!(view(lists(0)), "2-");
    assert_eq!(view(lists(1)), "--");
}

/// Each goes on inside the other, so both lists hold both.
#[test]
fn objects_that_cut_each_other_keep_their_line() {
    let lists: [&[Node]; 2] = [&[hit(1, 5.0, 3.0), hit(2, 5.5, 3.0)], &[hit(2, 5.0, 3.0), hit(1, 5.5, 3.0)]];
    for surfaces in 1..4 {
        assert_eq!(seen(&lists, &settings(surfaces)), "12", "{surfaces} surfaces");
    }
}

#[test]
fn a_miss_is_no_surface_behind_others() {
    // The normal test knows no misses; if one stood behind the wall, nothing would differ from it.
    let normals = LineSettings { object: false, shader: false, normal: Some(10.0), ..settings(2) };
    let turned = Node { normal: [1.0, 0.0, 0.0], ..hit(1, 2.0, 3.0) };
    let lists: [&[Node]; 3] = [&[turned], &[hit(1, 2.0, 3.0)], &[]];
    assert_eq!(seen(&lists, &normals), "11-");
}

#[test]
fn hidden_lines_are_drawn_where_no_other_is() {
    let lists: [&[Node]; 4] = [&[ball()], &[ball()], &[ball(), card()], &[ball(), card()]];
    assert_eq!(seen(&lists, &settings(2)), "----");
    assert_eq!(seen(&lists, &hidden(2, 3.0)), "-hh-");
    assert_eq!(seen(&lists, &hidden(2, 5.0)), "hhhh");
    assert_eq!(seen(&lists, &hidden(2, 0.0)), "----");
    let lines = lines_of(&lists, &[], &hidden(2, 3.0));
    let line = lines[1].expect("it is hidden");
    assert_eq!((line.color, line.alpha, line.own), ([0.0, 1.0, 0.0], 1.0, false));
    assert_eq!(line.fired, Fired::OBJECT);
    assert!(lines[2].is_some_and(|line| line.own));

    // A surface that draws no lines has no hidden ones either.
    let plain = hit(2, 5.0, 0.0);
    assert_eq!(seen(&[&[ball()], &[ball(), plain]], &hidden(2, 3.0)), "--");
    // A visible line goes first.
    let inked = hit(4, 0.5, 3.0);
    assert_eq!(seen(&[&[inked], &[ball(), card()], &[ball()]], &hidden(2, 3.0)), "44h");
    // Only of the objects that are asked for.
    let mut asked = hidden(2, 3.0);
    let only = |objects| Some(HiddenLines { objects: Some(objects), ..asked.hidden.clone().expect("it is set") });
    let [others, this] = [vec![ObjectId(0)], vec![ObjectId(1)]].map(only);
    asked.hidden = others;
    assert_eq!(seen(&lists, &asked), "----");
    asked.hidden = this;
    assert_eq!(seen(&lists, &asked), "-hh-");
}

#[test]
fn what_rays_go_on_through_hides_nothing() {
    let lists: [&[Node]; 2] = [&[ball()], &[ball(), card()]];
    let opaque = lines_of(&lists, &[], &hidden(2, 3.0));
    assert!(opaque.iter().flatten().all(|line| line.hidden));
    // The same ball, see-through: the card is seen at the path that goes on, and its line there is no hidden one.
    let lines = lines_of(&lists, &[(0, Node::default()), (1, card())], &hidden(2, 3.0));
    let paths: Vec<_> = lines.iter().flatten().map(|line| (line.path, line.hidden)).collect();
    assert_eq!(paths, [(CAMERA.refracted(), false); 2]);
}

#[test]
fn lines_that_are_not_opaque_show_those_of_other_surfaces() {
    let glassy = |object, depth| Node { line_opacity: 0.5, ..hit(object, depth, 9.0) };
    // One neighbour whose two surfaces both draw on the miss beside it.
    let lists: [&[Node]; 2] = [&[], &[glassy(1, 1.0), glassy(2, 2.0)]];
    let line = lines_of(&lists, &[], &settings(2))[0].expect("both draw");
    assert_eq!((line.alpha, line.color[0]), (0.75, (0.5 + 0.25 * 2.0) / 0.75));
    assert_eq!(lines_of(&lists, &[], &settings(1))[0].expect("one draws").alpha, 0.5);
}

#[test]
fn lists_are_kept_in_columns_of_their_own() {
    let buffer = |lists: &[&[Node]], surfaces| buffer(lists, &[], &settings(surfaces));
    let two = buffer(&[&[ball(), card()], &[], &[ball()], &[ball(), card(), hit(3, 7.0, 1.0)]], 3);
    let [second, third] = &two.paths[0].behind[..] else { panic!("{:?}", two.paths[0].behind) };
    assert_eq!(two.surfaces_behind(), 3);
    assert_eq!((second.rows.len(), second.row_of(0), second.row_of(1), second.row_of(3)), (2, Some(0), None, Some(1)));
    assert_eq!((&second.object, &third.object), (&Column::Constant(2), &Column::Constant(3)));
    assert_eq!(third.rows.sample(0), 3);
    // What stands behind a miss, or behind nothing, is no surface of a list.
    let odd = buffer(&[&[Node::default(), card()], &[ball(), Node::default(), card()]], 3);
    assert_eq!(odd.surfaces_behind(), 0);
    // Without any the buffer is what it was.
    let one = buffer(&[&[ball()], &[]], 1);
    assert!(one.paths[0].behind.is_empty());
}
