//! Built-in shapes, against what geometry says about them.

use std::collections::BTreeMap;
use std::f64::consts::{PI, SQRT_2};

use tusche::math::{DVec3, Vec2, Vec3};
use tusche::scene::mesh::Mesh;
use tusche::scene::shape::{MAX_SEGMENTS, Shape};

const ALL: [Shape; 9] = [
    Shape::SPHERE,
    Shape::BOX,
    Shape::PLANE,
    Shape::CYLINDER,
    Shape::CONE,
    Shape::TORUS,
    Shape::DISC,
    Shape::CAPSULE,
    Shape::KNOT,
];

/// Shapes cut in unequal and odd ways.
const ODD: [Shape; 10] = [
    Shape::Sphere { radius: 0.3, segments: [3, 2] },
    Shape::Sphere { radius: 1e6, segments: [7, 5] },
    Shape::Box { size: [0.1, 3.0, 0.7], segments: [3, 1, 5] },
    Shape::Cylinder { radius: 0.1, height: 9.0, segments: [5, 3] },
    Shape::Cone { radius: 1.7, height: 0.3, segments: [11, 4] },
    Shape::Torus { radius: 2.0, tube_radius: 1.9, segments: [3, 3] },
    Shape::Capsule { radius: 0.7, height: 1.4, segments: [9, 1] },
    Shape::Capsule { radius: 0.7, height: 5.1, segments: [6, 3] },
    Shape::Knot { radius: 1e-4, tube_radius: 2e-5, segments: [100, 7] },
    Shape::Plane { size: [2.0, 3.0], segments: [4, 7] },
];

fn is_closed(shape: &Shape) -> bool {
    !matches!(shape, Shape::Plane { .. } | Shape::Disc { .. })
}

fn corners(mesh: &Mesh) -> impl Iterator<Item = [DVec3; 3]> {
    mesh.triangles.iter().map(|triangle| triangle.map(|vertex| mesh.positions[vertex as usize].as_dvec3()))
}

fn area(mesh: &Mesh) -> f64 {
    corners(mesh).map(|[a, b, c]| (b - a).cross(c - a).length() / 2.0).sum()
}

fn volume(mesh: &Mesh) -> f64 {
    corners(mesh).map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
}

#[test]
fn attributes_are_whole_and_normals_point_outwards() {
    for shape in ALL.iter().chain(&ODD) {
        let mesh = shape.mesh().unwrap();
        let size = mesh.positions.iter().fold(0.0_f32, |size, position| size.max(position.length()));
        assert_eq!(mesh.normals.len(), mesh.positions.len());
        assert_eq!(mesh.uvs[0].len(), mesh.positions.len());
        assert_eq!(mesh.polygons.len(), mesh.triangles.len());
        for normal in &mesh.normals {
            assert!((normal.length() - 1.0).abs() < 1e-5, "{shape:?} has the normal {normal}");
        }
        for uv in &mesh.uvs[0] {
            assert!(uv.cmpge(Vec2::ZERO).all() && uv.cmple(Vec2::ONE).all(), "{shape:?} has uv {uv}");
        }
        for (triangle, [a, b, c]) in mesh.triangles.iter().zip(corners(&mesh)) {
            let face = (b - a).cross(c - a);
            assert!(face.length() > 1e-9 * f64::from(size * size), "{shape:?} has a degenerate triangle");
            // Smooth normals lean from their triangle, by less than a right angle.
            for vertex in triangle {
                let normal = mesh.normals[*vertex as usize].as_dvec3();
                assert!(face.dot(normal) > 0.0, "{shape:?} is wound the wrong way round at {vertex}");
            }
        }
    }
}

#[test]
fn closed_shapes_are_watertight() {
    for shape in ALL.iter().chain(&ODD).filter(|shape| is_closed(shape)) {
        let mesh = shape.mesh().unwrap();
        // Edges by the bits of their ends: adding 0 makes one of the two zeros.
        let bits = |vertex: u32| (mesh.positions[vertex as usize] + Vec3::ZERO).to_array().map(f32::to_bits);
        let mut edges: BTreeMap<_, i32> = BTreeMap::new();
        for [a, b, c] in &mesh.triangles {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *edges.entry((bits(*from), bits(*to))).or_default() += 1;
            }
        }
        for ((from, to), count) in &edges {
            assert_eq!(*count, 1, "{shape:?} has an edge twice");
            assert_eq!(edges.get(&(*to, *from)), Some(&1), "{shape:?} has an edge with one side");
        }
    }
}

#[test]
fn areas_and_volumes_are_those_of_geometry() {
    let knot = knot_length(0.6);
    let cases = [
        (Shape::SPHERE, 4.0 * PI, 4.0 / 3.0 * PI),
        (Shape::BOX, 24.0, 8.0),
        (Shape::Box { size: [1.0, 2.0, 3.0], segments: [2, 3, 4] }, 22.0, 6.0),
        (Shape::PLANE, 4.0, 0.0),
        (Shape::CYLINDER, 6.0 * PI, 2.0 * PI),
        (Shape::CONE, PI + PI * 5.0_f64.sqrt(), 2.0 / 3.0 * PI),
        (Shape::TORUS, 4.0 * PI * PI * 0.75 * 0.25, 2.0 * PI * PI * 0.75 * 0.25 * 0.25),
        (Shape::DISC, PI, 0.0),
        (Shape::CAPSULE, 4.0 * PI * 0.25 + PI, 4.0 / 3.0 * PI * 0.125 + PI * 0.25),
        (Shape::KNOT, 2.0 * PI * 0.16 * knot, PI * 0.16 * 0.16 * knot),
    ];
    for (shape, expected_area, expected_volume) in cases {
        let mesh = shape.mesh().unwrap();
        let (area, volume) = (area(&mesh), volume(&mesh));
        assert!((area / expected_area - 1.0).abs() < 4e-3, "{shape:?}: area {area}, expected {expected_area}");
        if is_closed(&shape) {
            let ratio = volume / expected_volume;
            assert!((ratio - 1.0).abs() < 4e-3, "{shape:?}: volume {volume}, expected {expected_volume}");
            assert!(ratio < 1.0 + 1e-6, "{shape:?} bulges: corners lie on the true surface");
        }
    }
}

#[test]
fn finer_cuts_converge_quadratically() {
    let lack =
        |around: u32| 4.0 * PI - area(&Shape::Sphere { radius: 1.0, segments: [2 * around, around] }.mesh().unwrap());
    for around in [16, 32, 64] {
        let ratio = lack(around) / lack(2 * around);
        assert!((ratio - 4.0).abs() < 0.1, "{ratio}");
    }
}

/// Length of the knot's curve, summed finely.
fn knot_length(radius: f64) -> f64 {
    let coil = 0.4 * radius;
    let point = |t: f64| {
        let reach = radius + coil * (3.0 * t).cos();
        DVec3::new(reach * (2.0 * t).sin(), coil * (3.0 * t).sin(), reach * (2.0 * t).cos())
    };
    let n = 100_000;
    let at = |i: i32| point(2.0 * PI * f64::from(i) / f64::from(n));
    (0..n).map(|i| at(i).distance(at(i + 1))).sum()
}

#[test]
fn round_shapes_have_the_normals_of_geometry() {
    for (shape, centre) in [
        (Shape::SPHERE, (|_| DVec3::ZERO) as fn(DVec3) -> DVec3),
        (Shape::CAPSULE, |p| DVec3::Y * p.y.clamp(-0.5, 0.5)),
        (Shape::TORUS, |p| DVec3::new(p.x, 0.0, p.z).normalize() * 0.75),
    ] {
        let mesh = shape.mesh().unwrap();
        for (position, normal) in mesh.positions.iter().zip(&mesh.normals) {
            let position = position.as_dvec3();
            let expected = (position - centre(position)).normalize();
            assert!((normal.as_dvec3() - expected).length() < 1e-5, "{shape:?} at {position}");
        }
    }
    // The side of a cone that is as high as wide leans by 45 degrees.
    let cone = Shape::Cone { radius: 1.0, height: 1.0, segments: [32, 1] }.mesh().unwrap();
    let side = cone.normals.iter().filter(|normal| normal.y > 0.0);
    assert!(side.clone().count() > 32);
    side.for_each(|normal| assert!((f64::from(normal.y) - 1.0 / SQRT_2).abs() < 1e-6));
}

#[test]
fn caps_and_box_faces_have_hard_edges() {
    for (shape, directions) in [(Shape::BOX, 6), (Shape::PLANE, 1), (Shape::DISC, 1)] {
        let mesh = shape.mesh().unwrap();
        let mut normals: Vec<_> = mesh.normals.iter().map(|n| (*n + Vec3::ZERO).to_array().map(f32::to_bits)).collect();
        normals.sort_unstable();
        normals.dedup();
        assert_eq!(normals.len(), directions, "{shape:?}");
    }
    let cylinder = Shape::CYLINDER.mesh().unwrap();
    assert!(cylinder.normals.iter().all(|normal| normal.y.abs() == 1.0 || normal.y == 0.0));
}

#[test]
fn polygons_are_the_cells() {
    for (shape, polygons) in [
        (Shape::Plane { size: [1.0; 2], segments: [4, 3] }, 12),
        (Shape::BOX, 6),
        (Shape::Box { size: [1.0; 3], segments: [2, 3, 4] }, 2 * (2 * 3 + 3 * 4 + 4 * 2)),
        (Shape::Sphere { radius: 1.0, segments: [8, 4] }, 32),
        (Shape::Cylinder { radius: 1.0, height: 1.0, segments: [8, 2] }, 16 + 2),
        (Shape::Cone { radius: 1.0, height: 1.0, segments: [8, 2] }, 16 + 1),
        (Shape::Torus { radius: 1.0, tube_radius: 0.1, segments: [8, 3] }, 24),
        (Shape::DISC, 1),
    ] {
        let mesh = shape.mesh().unwrap();
        assert!(mesh.polygons.is_sorted());
        assert!(mesh.polygons.windows(2).all(|pair| pair[1] - pair[0] <= 1));
        assert_eq!(mesh.polygons[0], 0);
        assert_eq!(mesh.polygons.last(), Some(&(polygons - 1)), "{shape:?}");
    }
}

#[test]
fn textures_read_the_right_way_round_from_outside() {
    for shape in ALL.iter().chain(&ODD) {
        // Seen from the front, u grows to the right and v downwards: clockwise on screen is counter-clockwise in (u, v).
        let mesh = shape.mesh().unwrap();
        if matches!(shape, Shape::Knot { .. }) {
            continue;
        }
        for triangle in &mesh.triangles {
            let [a, b, c] = triangle.map(|vertex| mesh.uvs[0][vertex as usize]);
            assert!((b - a).perp_dot(c - a) < 0.0, "{shape:?} mirrors its texture");
        }
    }
    // The middle of a ball's texture faces the front, its top is up.
    let ball = Shape::SPHERE.mesh().unwrap();
    let at = |uv: Vec2| ball.uvs[0].iter().position(|known| *known == uv).map(|vertex| ball.positions[vertex]).unwrap();
    assert_eq!(at(Vec2::splat(0.5)), Vec3::Z);
    assert_eq!(at(Vec2::new(0.75, 0.5)), Vec3::X);
    assert!(ball.positions.iter().zip(&ball.uvs[0]).all(|(position, uv)| uv.y != 0.0 || *position == Vec3::Y));
}

#[test]
fn rims_are_round_at_a_thousand_pixels() {
    for shape in [Shape::SPHERE, Shape::CYLINDER, Shape::CONE, Shape::DISC, Shape::TORUS] {
        let mesh = shape.mesh().unwrap();
        let from_axis = |point: DVec3| point.with_y(0.0).length();
        let mut edges = 0;
        for [a, b, c] in corners(&mesh) {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                if from.y == to.y && from_axis(from).min(from_axis(to)) > 1.0 - 1e-6 {
                    let lack_px = 500.0 * (1.0 - from_axis((from + to) / 2.0));
                    assert!(lack_px < 0.2, "{shape:?} lacks {lack_px} pixels");
                    edges += 1;
                }
            }
        }
        assert!(edges >= 128, "{shape:?} has {edges} edges around");
    }
}

#[test]
fn absurd_parameters_are_refused() {
    let refused = |shape: Shape, parameter: &str| {
        let fault = shape.mesh().unwrap_err();
        assert_eq!(fault.parameter, parameter, "{shape:?}: {}", fault.message);
    };
    for radius in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e30, 1e-30] {
        refused(Shape::Sphere { radius, segments: [8, 4] }, "radius");
        refused(Shape::Torus { radius: 1.0, tube_radius: radius, segments: [8, 4] }, "tube_radius");
        refused(Shape::Cone { radius: 1.0, height: radius, segments: [8, 4] }, "height");
        refused(Shape::Box { size: [1.0, radius, 1.0], segments: [1; 3] }, "size");
    }
    for segments in [0, 2, MAX_SEGMENTS + 1, u32::MAX] {
        refused(Shape::Disc { radius: 1.0, segments }, "segments");
        refused(Shape::Knot { radius: 1.0, tube_radius: 0.1, segments: [100, segments] }, "segments");
    }
    refused(Shape::Plane { size: [1.0; 2], segments: [1, 0] }, "segments");
    refused(Shape::Capsule { radius: 1.0, height: 1.9, segments: [8, 4] }, "height");
    refused(Shape::Torus { radius: 1.0, tube_radius: 1.0, segments: [8, 4] }, "tube_radius");
    refused(Shape::Knot { radius: 1.0, tube_radius: 0.4, segments: [8, 4] }, "tube_radius");
}
