//! How sample buffers are filled, and what their gate stops (DESIGN section 3.7).

use tusche::sample::{
    Column, GateCounts, HandMadeSample, Node, NodeColumnSet, NodePath, PixelRect, Rows, SampleBuffer,
    SampleBufferBuilder, SampleColor, SampleLayout,
};

use super::picture::layout;

const CAMERA: NodePath = NodePath::CAMERA;

fn hit(shader: u32) -> Node {
    Node { object: 1, shader, depth: 1.0, line_width: 2.0, priority: 0, ..Node::default() }
}

fn row(pixels: i32) -> PixelRect {
    PixelRect { x0: 5, y0: -3, x1: 5 + pixels, y1: -2 }
}

/// The buffer of one sample per pixel with these camera nodes.
fn buffer_of(nodes: &[Node]) -> SampleBuffer {
    let nodes: Vec<_> = nodes.iter().map(|&node| [(CAMERA, node)]).collect();
    let samples: Vec<_> = nodes.iter().map(|nodes| HandMadeSample { nodes, ..Default::default() }).collect();
    SampleBuffer::from_samples(row(nodes.len() as i32), &layout(1, 8.0), &samples)
}

fn values<T: Copy>(column: &Column<T>, count: usize) -> Vec<T> {
    (0..count).map(|row| column.get(row)).collect()
}

#[test]
fn widths_that_are_no_width_are_neutralised_and_counted_by_shader() {
    let widths = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, 1e9, 8.0, 0.0, -0.0];
    let nodes = widths.map(|line_width| Node { line_width, ..hit(2) });
    let buffer = buffer_of(&nodes);
    assert_eq!(values(&buffer.paths[0].line_width, 8), [0.0, 0.0, 0.0, 0.0, 8.0, 8.0, 0.0, 0.0]);
    assert_eq!(buffer.gate.len(), 9);
    assert_eq!(buffer.gate[2], GateCounts { nan: 1, infinite: 2, negative: 1, clamped_widths: 1 });
    let mut sum = GateCounts::default();
    buffer.gate.iter().for_each(|&counts| sum += counts);
    assert_eq!(sum, buffer.gate[2]);
}

#[test]
fn every_kept_number_passes_the_gate() {
    let (nan, inf) = (f32::NAN, f32::INFINITY);
    let node = Node {
        uv: [nan, 0.5],
        normal: [0.0, nan, 1.0],
        feature: [1.0, inf, 2.0],
        depth: nan,
        line_color: [nan, 1.0, -inf],
        throughput: [nan; 3],
        contribution: [inf, 2.0, 3.0],
        ..hit(1)
    };
    let buffer = buffer_of(&[node]);
    let nodes = &buffer.paths[0];
    assert_eq!(nodes.uv.get(0), [0.0, 0.5]);
    assert_eq!(nodes.normal.get(0), [0.0, 0.0, 1.0]);
    assert_eq!(nodes.feature.get(0), [1.0, 0.0, 2.0]);
    assert_eq!(nodes.depth.get(0), f32::MAX);
    assert_eq!(nodes.line_color.get(0), [0.0, 1.0, 0.0]);
    assert_eq!(nodes.throughput.get(0), [0.0; 3]);
    assert_eq!(nodes.contribution.get(0), [0.0, 2.0, 3.0]);
    // However many numbers are bad, the node counts once per kind.
    assert_eq!(buffer.gate[1], GateCounts { nan: 1, infinite: 1, ..Default::default() });
}

#[test]
fn normals_get_unit_length() {
    let normals = [[0.0, 0.0, 0.0], [0.0, 3.0, 4.0], [1e30, 0.0, 0.0], [0.0, -1e-30, 0.0], [f32::INFINITY, 0.0, 0.0]];
    let buffer = buffer_of(&normals.map(|normal| Node { normal, ..hit(1) }));
    let z = [0.0, 0.0, 1.0];
    assert_eq!(values(&buffer.paths[0].normal, 5), [z, [0.0, 0.6, 0.8], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], z]);
    assert_eq!(buffer.gate[1], GateCounts { nan: 1, infinite: 1, ..Default::default() });
}

#[test]
fn columns_that_are_not_kept_cost_nothing_and_are_not_counted() {
    let layout = SampleLayout { samples_per_pixel: 1, ..Default::default() };
    let odd =
        |x: f32| Node { uv: [x; 2], normal: [x; 3], feature: [x; 3], line_width: x, line_color: [x; 3], ..hit(1) };
    let nodes = [[(CAMERA, odd(f32::NAN))], [(CAMERA, odd(0.25))]];
    let samples = nodes.each_ref().map(|nodes| HandMadeSample { nodes, ..Default::default() });
    let buffer = SampleBuffer::from_samples(row(2), &layout, &samples);
    let nodes = &buffer.paths[0];
    assert_eq!((&nodes.uv, &nodes.line_width), (&Column::Constant([0.0; 2]), &Column::Constant(0.0)));
    assert_eq!(nodes.normal, Column::Constant([0.0, 0.0, 1.0]));
    assert_eq!(buffer.gate, [GateCounts::default()], "no materials, so misses alone");
    // Offsets, and one count: colours that are all the same cost nothing.
    assert_eq!(buffer.bytes(), 16 + size_of::<GateCounts>());
}

#[test]
fn a_miss_has_no_style_and_no_place() {
    let loud = Node { object: 0, contribution: [0.5; 3], ..hit(3) };
    let buffer = buffer_of(&[loud]);
    let nodes = &buffer.paths[0];
    assert_eq!((nodes.shader.get(0), nodes.depth.get(0)), (0, f32::INFINITY));
    assert_eq!((nodes.priority.get(0), nodes.line_width.get(0)), (i32::MIN, 0.0));
    assert_eq!(nodes.contribution.get(0), [0.5; 3]);
    assert_eq!(buffer.gate, vec![GateCounts::default(); 9], "an infinite depth is no fault of a miss");
}

#[test]
fn colors_and_extra_outputs_count_with_the_node_that_made_them() {
    let layout = SampleLayout { position: true, aovs: 1, ..layout(1, 8.0) };
    let mut builder = SampleBufferBuilder::new(row(3), &layout);
    let color = |x| SampleColor { color: [x, 0.5, 0.5], alpha: 1.0 };
    builder.set_sample(0, [f32::NAN, 7.0], color(f32::NAN), 4);
    builder.set_extras(0, [f32::INFINITY, 1.0, 2.0], &[[f32::NAN, 1.0, 2.0]]);
    builder.push(CAMERA, 0, Node { line_width: f32::NAN, ..hit(4) });
    builder.push(CAMERA, 1, hit(5));
    builder.set_extras(1, [1.0; 3], &[[f32::INFINITY; 3]]);
    let buffer = builder.finish();
    assert_eq!(buffer.offset[0], [0.0, 1.0]);
    assert_eq!((buffer.color.get(0), buffer.alpha.get(0)), ([0.0, 0.5, 0.5], 1.0));
    assert_eq!((buffer.color.get(2), buffer.alpha.get(2)), ([0.0; 3], 0.0));
    assert_eq!(values(&buffer.position, 3), [[0.0, 1.0, 2.0], [1.0; 3], [0.0; 3]]);
    assert_eq!(values(&buffer.aovs[0], 3), [[0.0, 1.0, 2.0], [0.0; 3], [0.0; 3]]);
    assert_eq!(buffer.gate[4], GateCounts { nan: 1, infinite: 1, ..Default::default() });
    assert_eq!(buffer.gate[5], GateCounts { infinite: 1, ..Default::default() });
}

#[test]
fn nodes_may_come_in_any_order() {
    let r = CAMERA.reflected();
    let layout = layout(2, 8.0);
    let uv = |x: u32| Node { uv: [x as f32, 0.0], ..hit(1) };
    let mut in_order = SampleBufferBuilder::new(row(3), &layout);
    let mut shuffled = SampleBufferBuilder::new(row(3), &layout);
    for sample in 0..6 {
        in_order.push(CAMERA, sample, uv(sample));
    }
    for sample in [0, 3, 5] {
        in_order.push(r, sample, uv(10 + sample));
    }
    for sample in [5, 0, 3] {
        shuffled.push(r, sample, uv(10 + sample));
    }
    for sample in [4, 2, 0, 5, 1, 3] {
        shuffled.push(CAMERA, sample, uv(sample));
    }
    // A second node at one place is a mistake that changes nothing.
    shuffled.push(r, 3, uv(99));
    let (in_order, shuffled) = (in_order.finish(), shuffled.finish());
    assert_eq!(in_order, shuffled);
    let reflected = in_order.nodes(r).expect("pushed");
    assert_eq!(reflected.rows, Rows::Some { first: vec![0, 1, 2, 3], sample: vec![0, 3, 5] });
    assert_eq!([0, 1, 2].map(|pixel| reflected.rows.of_pixel(pixel)), [0..1, 1..2, 2..3]);
    assert_eq!(in_order.paths[0].rows, Rows::Every { samples: 6, per_pixel: 2 });
    assert_eq!(in_order.nodes(CAMERA.refracted()), None);
    assert_eq!(in_order.pixel_of(3), [6, -3]);
    assert_eq!(in_order.pixel_number([6, -3]), 1);
    assert_eq!(reflected.object, Column::Constant(1), "equal values share one");
}

#[test]
fn a_sample_without_a_camera_node_is_a_miss() {
    let mut builder = SampleBufferBuilder::new(row(3), &layout(1, 8.0));
    builder.push(CAMERA, 1, hit(1));
    let buffer = builder.finish();
    assert_eq!(values(&buffer.paths[0].object, 3), [0, 1, 0]);
    assert_eq!(buffer.paths[0].rows, Rows::Every { samples: 3, per_pixel: 1 });
    let empty =
        SampleBufferBuilder::new(row(0), &SampleLayout { columns: NodeColumnSet::ALL, ..layout(4, 8.0) }).finish();
    assert_eq!((empty.samples(), empty.paths.len(), empty.paths[0].rows.is_empty()), (0, 1, true));
}

#[test]
fn columns_take_the_shortest_form_that_is_exact() {
    // As many values as there are, each several times in a run, then as many again in the same order.
    let column = |distinct: u32| {
        let nodes: Vec<_> = (0..4096).map(|i| Node { object: 1 + i / 8 % distinct, ..hit(1) }).collect();
        let buffer = buffer_of(&nodes);
        assert_eq!(values(&buffer.paths[0].object, 4096), nodes.iter().map(|node| node.object).collect::<Vec<_>>());
        buffer.paths[0].object.clone()
    };
    assert_eq!(column(1).bytes(), 0);
    assert_eq!(column(2).bytes(), 4096 + 2 * 4);
    assert_eq!(column(16).bytes(), 4096 + 16 * 4);
    assert!(matches!(column(300), Column::Values(_)));
    assert_eq!(column(300).bytes(), 4096 * 4);
}
