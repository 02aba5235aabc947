//! Rays aimed at shared edges and vertices, and along surfaces.

use rayon::prelude::*;
use tusche::math::{DAffine3, DVec3, Vec3, portable};
use tusche::scene::mesh::Mesh;
use tusche::scene::settings::RayKinds;
use tusche::trace::World;
use tusche::trace::triangle::Ray;

use super::{Case, count_from, random_point};
use crate::trace::{ball, builder, place, random, world};

pub const CASES: &[Case] = &[
    Case {
        name: "rays from inside at edges and vertices of a fine sphere",
        wrong: "black dots in a room",
        unit: "leaks in 100 000 rays",
        bound: 0.0,
        figure: sphere_from_inside,
    },
    Case {
        name: "rays from outside at edges and vertices of a fine sphere",
        wrong: "dots of background on a body, each with its outline",
        unit: "leaks in 100 000 rays",
        bound: 0.0,
        figure: sphere_from_outside,
    },
    Case {
        name: "rays from above at edges and vertices of a terrain of 10 km",
        wrong: "dots of sky on the ground",
        unit: "leaks in 100 000 rays",
        bound: 0.0,
        figure: || terrain(1.0),
    },
    Case {
        name: "rays from below at edges and vertices of a terrain of 10 km",
        wrong: "light through the ground",
        unit: "leaks in 100 000 rays",
        bound: 0.0,
        figure: || terrain(-1.0),
    },
    Case {
        name: "grazing rays along a plane",
        wrong: "a torn horizon",
        unit: "wrong answers in 90 000 rays",
        bound: 0.0,
        figure: || grazing().0,
    },
    Case {
        name: "grazing rays along a plane, where they meet it",
        wrong: "depth noise at a distance",
        unit: "error over the plane's size",
        bound: 1e-6,
        figure: || grazing().1,
    },
];

/// Rays in batches of 1000, each with its own random numbers; the sum of what `leaks` counts in a batch.
fn in_batches(leaks: impl Fn(&mut u64) -> u32 + Sync) -> f64 {
    let batches = count_from("TUSCHE_RAYS", 100_000) / 1000;
    f64::from((1..=batches).into_par_iter().map(|batch| leaks(&mut (batch * 7919))).sum::<u32>())
}

/// A vertex of a triangle, a point of an edge that rounding moves off it, or one just beside a vertex.
fn target(mesh: &Mesh, triangle: usize, state: &mut u64) -> Vec3 {
    let [a, b, _] = mesh.triangles[triangle].map(|vertex| mesh.positions[vertex as usize]);
    match (random(state).abs() * 4.0) as u32 {
        0 => a,
        1 => (a + b) * 0.5,
        2 => a.lerp(b, 1e-6),
        _ => a.lerp(b, random(state).abs()),
    }
}

fn any_triangle(mesh: &Mesh, state: &mut u64) -> usize {
    ((random(state).abs() * mesh.triangles.len() as f32) as usize).min(mesh.triangles.len() - 1)
}

fn slips_through(world: &World, from: Vec3, target: Vec3) -> u32 {
    let ray = Ray::new(from - world.origin.as_vec3(), target - from);
    u32::from(world.closest(&ray, RayKinds::CAMERA, f32::INFINITY).is_none())
}

/// A ball of 160 000 triangles, turned, and its rays: from near its middle, or from around it.
fn sphere(from: impl Fn(Vec3, &mut u64) -> Option<Vec3> + Sync) -> f64 {
    let mesh = ball(200, 400, 1.0);
    let turned = DAffine3::from_rotation_y(0.3) * DAffine3::from_rotation_x(1.1);
    let mut builder = builder();
    place(&mut builder, mesh.clone(), turned);
    let (_, world) = world(builder);
    let turned = turned.as_affine3();
    in_batches(|state| {
        let mut leaks = 0;
        for _ in 0..1000 {
            let triangle = any_triangle(&mesh, state);
            let target = turned.transform_point3(target(&mesh, triangle, state));
            if let Some(from) = from(target, state) {
                leaks += slips_through(&world, from, target);
            }
        }
        leaks
    })
}

fn sphere_from_inside() -> f64 {
    sphere(|_, state| Some(random_point(state) * 0.5))
}

fn sphere_from_outside() -> f64 {
    sphere(|target, state| {
        let from = (target + random_point(state) * 0.5).normalize() * 3.0;
        // Only at points well inside the outline must every ray meet the mesh.
        (from.dot(target) > 1.5).then_some(from)
    })
}

/// A terrain of 10 km with hills of 300 m.
pub fn hills(side: u32) -> Mesh {
    let mut mesh = Mesh { name: "hills".into(), ..Mesh::default() };
    let at = |index: u32| (index as f32 / side as f32 - 0.5) * 10_000.0;
    for row in 0..=side {
        for column in 0..=side {
            let (x, z) = (at(column), at(row));
            let height = portable::sin(x * 1.3e-3) * portable::cos(z * 0.9e-3) * 250.0
                + portable::sin(x * 1.7e-2 + z * 1.1e-2) * 50.0;
            mesh.positions.push(Vec3::new(x, height, z));
        }
    }
    for row in 0..side {
        for column in 0..side {
            let a = row * (side + 1) + column;
            mesh.triangles.extend([[a, a + side + 1, a + side + 2], [a, a + side + 2, a + 1]]);
        }
    }
    mesh
}

/// From above (1) or below (−1).
fn terrain(side: f32) -> f64 {
    let mesh = hills(256);
    let mut builder = builder();
    builder.cameras[0].position = DVec3::new(1234.5, 2000.0, -987.6);
    place(&mut builder, mesh.clone(), DAffine3::IDENTITY);
    let (_, world) = world(builder);
    in_batches(|state| {
        let mut leaks = 0;
        for _ in 0..1000 {
            let triangle = any_triangle(&mesh, state);
            let target = target(&mesh, triangle, state);
            // So steep that a ray that just clears a ridge meets the ground behind it.
            let from = Vec3::new(random(state) * 1500.0, 2000.0 * side, random(state) * 1500.0);
            let inner = target.x.abs().max(target.z.abs()) < 2500.0;
            leaks += if inner { slips_through(&world, from, target) } else { 0 };
        }
        leaks
    })
}

/// Wrong answers, and the largest error of a distance over the plane's size.
fn grazing() -> (f64, f64) {
    const HALF: f32 = 500.0;
    let square = Mesh {
        positions: [[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]]
            .map(|[x, z]| Vec3::new(x * HALF, 0.0, z * HALF))
            .to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    };
    let (mut wrong, mut worst) = (0, 0.0_f64);
    for height in [1e-4_f32, 1e-2, 1.0] {
        let mut builder = builder();
        builder.cameras[0].position = DVec3::Y * f64::from(height);
        place(&mut builder, square.clone(), DAffine3::IDENTITY);
        let (_, world) = world(builder);
        let mut state = 17;
        for _ in 0..15_000 {
            let turn = random(&mut state) * 3.1;
            let distance = 1.0 + random(&mut state).abs() * 490.0;
            let fall = height / distance;
            for (down, meets) in [(-fall, true), (fall, false)] {
                let ray = Ray::new(Vec3::ZERO, Vec3::new(portable::cos(turn), down, portable::sin(turn)));
                let hit = world.closest(&ray, RayKinds::CAMERA, f32::INFINITY);
                wrong += u32::from(hit.is_some() != meets);
                if let (Some(hit), true) = (hit, meets) {
                    worst = worst.max(f64::from((hit.t - distance).abs() / HALF));
                }
            }
        }
    }
    (f64::from(wrong), worst)
}
