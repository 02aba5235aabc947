//! Surfaces at one depth: which is seen must depend on nothing but the scene, and must not change from ray to ray.

use tusche::film::Layer;
use tusche::math::{DAffine3, DVec3, Vec3};
use tusche::render::RenderOptions;
use tusche::scene::mesh::Mesh;
use tusche::scene::settings::RayKinds;
use tusche::trace::World;
use tusche::trace::triangle::Ray;

use super::Case;
use crate::common::{render_with, scene_from};
use crate::trace::{ball, builder, place, random, world};

pub const CASES: &[Case] = &[
    Case {
        name: "duplicated faces and objects",
        wrong: "speckled object ids, each speck with lines",
        unit: "rays that see another than the first",
        bound: 0.0,
        figure: duplicates,
    },
    Case {
        name: "coplanar faces that look opposite ways",
        wrong: "speckled sides",
        unit: "rays of 10 000 that see another than the first",
        bound: 0.0,
        figure: opposite_faces,
    },
    Case {
        name: "edges that two objects share",
        wrong: "dots along seams",
        unit: "gaps, and edges with two owners",
        bound: 0.0,
        figure: shared_edges,
    },
    Case {
        name: "the same triangles in another order",
        wrong: "pictures that change with the exporter",
        unit: "rays with another distance",
        bound: 0.0,
        figure: permuted_triangles,
    },
    Case {
        name: "the same objects in another order",
        wrong: "lines that change with the order of the scene file",
        unit: "values of a picture with lines that differ",
        bound: 0.0,
        figure: permuted_objects,
    },
    Case {
        name: "`priority` between two coplanar objects",
        wrong: "lines that flicker between two styles",
        unit: "values of two pictures that differ",
        bound: 0.0,
        figure: priority_settles,
    },
    Case {
        name: "a coplanar decal, cut and turned otherwise",
        wrong: "speckled object ids, each speck with lines",
        unit: "rays of 20 000 that see another than they should",
        bound: 0.0,
        figure: decal,
    },
];

fn square(half: f32, turned: bool) -> Mesh {
    let [a, b, c, d] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let corners = if turned { [b, c, d, a] } else { [a, b, c, d] };
    Mesh {
        positions: corners.map(|[x, y]| Vec3::new(x, y, 0.0) * half).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

/// A direction at a random point of the square −1 … 1 in the plane z = 0, turned.
fn aim(world: &World, turn: DAffine3, state: &mut u64) -> Ray {
    let local = Vec3::new(random(state), random(state), 0.0) * 0.99;
    let target = turn.as_affine3().transform_point3(local) - world.origin.as_vec3();
    Ray::new(Vec3::ZERO, target.normalize())
}

fn duplicates() -> f64 {
    let turn = DAffine3::from_rotation_y(0.6) * DAffine3::from_rotation_x(0.4);
    let mut mesh = square(1.0, false);
    mesh.triangles.extend_from_within(..);
    let mut builder = builder();
    for _ in 0..9 {
        place(&mut builder, mesh.clone(), turn);
    }
    let (_, world) = world(builder);
    let mut state = 3;
    let others = (0..10_000).filter(|_| {
        let ray = aim(&world, turn, &mut state);
        let hit = world.closest(&ray, RayKinds::CAMERA, f32::INFINITY);
        hit.is_none_or(|hit| hit.object.0 != 0 || hit.triangle > 1)
    });
    others.count() as f64
}

fn opposite_faces() -> f64 {
    let turn = DAffine3::from_rotation_y(0.6) * DAffine3::from_rotation_x(0.4);
    let mut mesh = square(1.0, false);
    mesh.triangles.extend([[2, 1, 0], [3, 2, 0], [0, 2, 1], [2, 0, 3]]);
    let mut builder = builder();
    place(&mut builder, mesh, turn);
    let (_, world) = world(builder);
    let mut state = 3;
    let others = (0..10_000).filter(|_| {
        let ray = aim(&world, turn, &mut state);
        world.closest(&ray, RayKinds::CAMERA, f32::INFINITY).is_none_or(|hit| hit.triangle > 1 || !hit.front)
    });
    others.count() as f64
}

/// Four squares, objects of their own, that meet in a cross.
fn shared_edges() -> f64 {
    let turn = DAffine3::from_rotation_y(0.6) * DAffine3::from_rotation_x(0.4);
    let quarter = |x: f32, y: f32| Mesh {
        positions: [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[u, v]| Vec3::new(x + u, y + v, 0.0)).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    };
    let mut builder = builder();
    for [x, y] in [[-1.0, -1.0], [0.0, -1.0], [-1.0, 0.0], [0.0, 0.0]] {
        place(&mut builder, quarter(x, y), turn);
    }
    let (_, world) = world(builder);
    let turn = turn.as_affine3();
    let mut state = 31;
    let mut faults = 0;
    for _ in 0..20_000 {
        let along = random(&mut state) * 0.99;
        let local = if random(&mut state) < 0.0 { Vec3::new(0.0, along, 0.0) } else { Vec3::new(along, 0.0, 0.0) };
        let ray = Ray::new(Vec3::ZERO, turn.transform_point3(local) - world.origin.as_vec3());
        faults += match world.closest(&ray, RayKinds::CAMERA, f32::INFINITY) {
            None => 1,
            // At an equal distance the lower one must have been chosen.
            Some(hit) => {
                let next = world.next_hit(&ray, RayKinds::CAMERA, Some(&hit));
                u32::from(next.is_some_and(|next| next.t == hit.t && next.object < hit.object))
            }
        };
    }
    f64::from(faults)
}

fn permuted_triangles() -> f64 {
    let straight = ball(40, 80, 1.0);
    let mut permuted = straight.clone();
    permuted.triangles.reverse();
    let third = permuted.triangles.len() / 3;
    permuted.triangles.rotate_left(third);
    let world_of = |mesh: Mesh| {
        let mut builder = builder();
        place(&mut builder, mesh, DAffine3::from_rotation_x(0.3));
        world(builder).1
    };
    let (a, b) = (world_of(straight.clone()), world_of(permuted));
    let mut state = 19;
    let differ = (0..20_000).filter(|number| {
        // Every other ray at a vertex, where six triangles meet.
        let vertex = straight.positions[number % straight.positions.len()];
        let target = if number % 2 == 0 { vertex } else { super::random_point(&mut state) };
        let ray = Ray::new(Vec3::ZERO, target - a.origin.as_vec3());
        let t = |world: &World| world.closest(&ray, RayKinds::CAMERA, f32::INFINITY).map(|hit| hit.t.to_bits());
        t(&a) != t(&b)
    });
    differ.count() as f64
}

const HEAD: &str = r#"
[render]
size = [64, 48]
samples = 4
[camera]
position = [1.5, 2.5, 6.0]
target = [0.0, 0.3, 0.0]
fov = 35.0
[lines]
width = 2.0
[materials.a]
shader = "builtin:default"
[materials.b]
shader = "builtin:default"
"#;

fn permuted_objects() -> f64 {
    let objects = [
        "name = \"floor\"\nshape = \"plane\"\nsize = [8.0, 8.0]\nmaterial = \"a\"\n",
        "name = \"block\"\nshape = \"box\"\nmaterial = \"b\"\ntranslate = [0.0, 1.0, 0.0]\n",
        "name = \"ball\"\nshape = \"sphere\"\nmaterial = \"a\"\ntranslate = [0.8, 0.9, 1.1]\n",
        "name = \"ring\"\nshape = \"torus\"\nmaterial = \"b\"\ntranslate = [-1.0, 0.5, 0.7]\n",
    ];
    let picture = |order: [usize; 4]| {
        let text: String = order.iter().map(|&index| format!("[[objects]]\n{}", objects[index])).collect();
        let scene = scene_from(&format!("{HEAD}{text}"));
        render_with(&scene, &[Layer::Rgba, Layer::Line, Layer::Depth], &RenderOptions::default()).0
    };
    let straight = picture([0, 1, 2, 3]);
    [[3, 2, 1, 0], [1, 3, 0, 2], [2, 0, 3, 1]]
        .map(|order| super::differing(&straight, &picture(order), 0.0) as f64)
        .iter()
        .sum()
}

/// Two squares of one plane whose style differs: with a priority, the order in the file must not matter.
fn priority_settles() -> f64 {
    let objects = [
        "name = \"low\"\nshape = \"plane\"\nsize = [4.0, 4.0]\nmaterial = \"a\"\npriority = 1\n",
        "name = \"high\"\nshape = \"plane\"\nsize = [2.0, 2.0]\nmaterial = \"b\"\npriority = 2\n",
    ];
    let picture = |order: [usize; 2]| {
        let text: String = order.iter().map(|&index| format!("[[objects]]\n{}", objects[index])).collect();
        let scene = scene_from(&format!("{HEAD}{text}"));
        render_with(&scene, &[Layer::Rgba, Layer::Line], &RenderOptions::default()).0
    };
    super::differing(&picture([0, 1]), &picture([1, 0]), 0.0) as f64
}

/// Rays within a decal that see the plane below it instead, or the decal where the plane should be seen: near and far, steep
/// and grazing, with and without priorities, whichever comes first in the scene.
fn decal() -> f64 {
    let mut wrong = 0;
    for (lean, away) in [(0.4, 0.0), (1.5, 0.0), (0.4, 1e3), (1.2, 1e5), (0.0, 0.0)] {
        let turn = DAffine3::from_translation(DVec3::new(0.3, -0.2, -1.0) * away)
            * DAffine3::from_rotation_y(0.6)
            * DAffine3::from_rotation_x(lean);
        for decal in [0, 1] {
            for priorities in [[Some(2), Some(1)], [Some(-3), None], [None, None], [None, Some(5)]] {
                wrong += decal_in(turn, decal, priorities);
            }
        }
    }
    f64::from(wrong)
}

/// The decal's place in the scene is `decal`; priorities are in the order of the scene.
fn decal_in(turn: DAffine3, decal: usize, priorities: [Option<i32>; 2]) -> u32 {
    let mut builder = builder();
    for (index, priority) in priorities.into_iter().enumerate() {
        if index == decal {
            place(&mut builder, square(1.0, true), turn * DAffine3::from_rotation_z(0.3));
        } else {
            place(&mut builder, square(3.0, false), turn * DAffine3::from_translation(DVec3::new(0.3, 0.2, 0.0)));
        }
        builder.objects[index].priority = priority;
    }
    let expected = u32::from(priorities[1].unwrap_or(0) > priorities[0].unwrap_or(0));
    // As far away as it is, but large enough to be seen.
    let middle = turn.translation;
    builder.cameras[0].position = middle + DVec3::Z * 5.0 - middle * 0.5;
    let (_, world) = world(builder);
    let mut state = 3;
    let wrong = (0..500).filter(|_| {
        let local = DVec3::new(random(&mut state).into(), random(&mut state).into(), 0.0) * 0.7;
        let target = (turn.transform_point3(local) - world.origin).as_vec3();
        let ray = Ray::new(Vec3::ZERO, target.normalize());
        world.closest(&ray, RayKinds::CAMERA, f32::INFINITY).is_none_or(|hit| hit.object.0 != expected)
    });
    wrong.count() as u32
}
