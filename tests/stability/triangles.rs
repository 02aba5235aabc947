//! Triangles and vertex normals that are no use.

use tusche::math::{DAffine3, DVec3, Vec3};
use tusche::scene::mesh::Mesh;
use tusche::scene::settings::RayKinds;
use tusche::trace::surface::Surface;
use tusche::trace::triangle::Ray;

use super::{Case, random_point};
use crate::trace::{ball, builder, place, random, world};

pub const CASES: &[Case] = &[
    Case {
        name: "zero-area, NaN and infinite triangles",
        wrong: "specks, or NaN that spreads",
        unit: "hits in 20 000 rays",
        bound: 0.0,
        figure: useless_triangles,
    },
    Case {
        name: "broken triangles among sound ones",
        wrong: "holes beside them",
        unit: "rays with another hit than without them",
        bound: 0.0,
        figure: useless_among_sound,
    },
    Case {
        name: "a square of slivers, 4 000 000 times as long as wide",
        wrong: "scratches",
        unit: "leaks and false normals in 20 000 rays",
        bound: 0.0,
        figure: slivers,
    },
    Case {
        name: "a triangle of 1e-9 and one of 1e10 units",
        wrong: "shading that follows the camera",
        unit: "false normals of 6",
        bound: 0.0,
        figure: tiny_and_huge,
    },
    Case {
        name: "zero, denormal, NaN, huge and opposite vertex normals",
        wrong: "black or NaN pixels",
        unit: "unusable normals",
        bound: 0.0,
        figure: vertex_normals,
    },
];

/// Corners and triangles without area or with a coordinate that is not finite.
fn useless() -> Mesh {
    Mesh {
        positions: vec![
            Vec3::ZERO,
            Vec3::X,
            Vec3::X * 2.0,
            Vec3::Y,
            Vec3::NAN,
            Vec3::INFINITY,
            Vec3::splat(1e-42),
            Vec3::new(f32::NEG_INFINITY, 0.0, 0.0),
        ],
        triangles: vec![[0, 0, 0], [0, 1, 1], [0, 1, 2], [0, 1, 4], [0, 3, 5], [0, 6, 6], [7, 5, 3], [0, 3, 7]],
        ..Mesh::default()
    }
}

fn useless_triangles() -> f64 {
    let mut builder = builder();
    let mesh = useless();
    let corners = mesh.positions.clone();
    place(&mut builder, mesh, DAffine3::IDENTITY);
    let (_, world) = world(builder);
    let mut state = 5;
    let mut hits = 0;
    for number in 0..20_000 {
        // At the very corners and edges, too.
        let [a, b] = [corners[number % 4], corners[number / 4 % 4]];
        let target = if number % 2 == 0 { a.lerp(b, random(&mut state)) } else { random_point(&mut state) };
        let ray = Ray::new(Vec3::ZERO, target - world.origin.as_vec3());
        hits += u32::from(world.closest(&ray, RayKinds::CAMERA, f32::INFINITY).is_some());
    }
    f64::from(hits)
}

fn useless_among_sound() -> f64 {
    let sound = ball(24, 48, 1.0);
    let mut mixed = sound.clone();
    let first = mixed.positions.len() as u32;
    let useless = useless();
    mixed.positions.extend(useless.positions);
    mixed.triangles.extend(useless.triangles.iter().map(|triangle| triangle.map(|vertex| vertex + first)));
    let world_of = |mesh: Mesh| {
        let mut builder = builder();
        place(&mut builder, mesh, DAffine3::from_rotation_x(0.3));
        world(builder).1
    };
    let (without, with) = (world_of(sound), world_of(mixed));
    let mut state = 15;
    let mut differ = 0;
    for _ in 0..20_000 {
        let ray = Ray::new(Vec3::ZERO, random_point(&mut state) - without.origin.as_vec3());
        let hit = |world: &tusche::trace::World| world.closest(&ray, RayKinds::CAMERA, f32::INFINITY);
        differ += u32::from(hit(&without) != hit(&with));
    }
    f64::from(differ)
}

/// A square cut into fans of slivers from two opposite corners.
fn slivers() -> f64 {
    const STRIPS: u32 = 4096;
    let mut mesh = Mesh::default();
    for index in 0..=STRIPS {
        let x = -1.0 + 2.0 * index as f32 / STRIPS as f32;
        mesh.positions.extend([Vec3::new(x, -1000.0, 0.0), Vec3::new(x, 1000.0, 0.0)]);
    }
    for strip in 0..STRIPS {
        let a = strip * 2;
        mesh.triangles.extend([[a, a + 2, a + 3], [a, a + 3, a + 1]]);
    }
    let mut builder = builder();
    let turn = DAffine3::from_rotation_z(0.7);
    place(&mut builder, mesh, turn);
    let (_, world) = world(builder);
    let mut state = 23;
    let mut faults = 0;
    for _ in 0..20_000 {
        let local = Vec3::new(random(&mut state) * 0.99, random(&mut state) * 900.0, 0.0);
        let target = turn.as_affine3().transform_point3(local);
        let ray = Ray::new(Vec3::ZERO, (target - world.origin.as_vec3()).normalize());
        match world.closest(&ray, RayKinds::CAMERA, f32::INFINITY) {
            None => faults += 1,
            Some(hit) => {
                let normal = Surface::new(&world, ray.direction, &hit).geometric_normal;
                faults += u32::from(normal.distance(Vec3::Z) > 1e-3);
            }
        }
    }
    f64::from(faults)
}

fn tiny_and_huge() -> f64 {
    let mut faults = 0;
    for (size, scale) in [(1e-9, 1.0), (1e10, 1.0), (1e7, 1e-6), (1e-12, 1e6), (1e-6, 1e-6), (1e6, 1e6)] {
        let positions = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|[x, y]| Vec3::new(x, y, 0.0) * size).to_vec();
        let triangle = Mesh { positions, triangles: vec![[0, 1, 2]], ..Mesh::default() };
        let turn = DAffine3::from_rotation_x(0.5);
        let in_world = f64::from(size) * scale;
        let mut builder = builder();
        builder.cameras[0].position = turn.transform_point3(DVec3::new(0.3, 0.1, 0.4) * in_world);
        place(&mut builder, triangle, turn * DAffine3::from_scale(DVec3::splat(scale)));
        let (_, world) = world(builder);
        let target = turn.transform_point3(DVec3::new(0.25, 0.25, 0.0) * in_world) - world.origin;
        let ray = Ray::new(Vec3::ZERO, target.normalize().as_vec3());
        let expected = turn.transform_vector3(DVec3::Z).as_vec3();
        let found = world.closest(&ray, RayKinds::CAMERA, f32::INFINITY);
        let normal = found.map(|hit| Surface::new(&world, ray.direction, &hit).geometric_normal);
        faults += u32::from(normal.is_none_or(|normal| normal.distance(expected) > 1e-4));
    }
    f64::from(faults)
}

fn vertex_normals() -> f64 {
    let kinds = [
        Vec3::ZERO,
        Vec3::splat(1e-42),
        Vec3::splat(-1e-30),
        Vec3::NAN,
        Vec3::new(f32::INFINITY, 0.0, 0.0),
        Vec3::splat(3e38),
        Vec3::Z,
        Vec3::NEG_Z,
        Vec3::X,
    ];
    let mut faults = 0;
    let mut state = 41;
    for combination in 0..kinds.len().pow(3) {
        let normal = |place: u32| kinds[combination / kinds.len().pow(place) % kinds.len()];
        let triangle = Mesh {
            positions: vec![Vec3::new(-1.0, -1.0, 0.0), Vec3::new(1.0, -1.0, 0.0), Vec3::new(0.0, 1.0, 0.0)],
            triangles: vec![[0, 1, 2]],
            normals: vec![normal(0), normal(1), normal(2)],
            ..Mesh::default()
        };
        let mut builder = builder();
        place(&mut builder, triangle, DAffine3::from_rotation_y(0.5));
        let (_, world) = world(builder);
        for _ in 0..8 {
            let target = Vec3::new(random(&mut state) * 0.2, random(&mut state) * 0.2, 0.0);
            let ray = Ray::new(Vec3::ZERO, (target - world.origin.as_vec3()).normalize());
            let Some(hit) = world.closest(&ray, RayKinds::CAMERA, f32::INFINITY) else { continue };
            let Surface { normal, geometric_normal, .. } = Surface::new(&world, ray.direction, &hit);
            let usable = normal.is_normalized() && normal.dot(geometric_normal) > 0.0;
            faults += u32::from(!usable);
        }
    }
    f64::from(faults)
}
