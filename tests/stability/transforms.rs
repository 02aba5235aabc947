//! Mirrored, singular, tiny and huge transforms.

use tusche::math::{DAffine3, DVec3, Vec3};
use tusche::scene::settings::RayKinds;
use tusche::trace::surface::Surface;
use tusche::trace::triangle::Ray;

use super::{Case, random_point};
use crate::trace::{ball, builder, place, world};

pub const CASES: &[Case] = &[
    Case {
        name: "mirrored objects",
        wrong: "inside out: lit from the wrong side",
        unit: "false sides and normals in 16 000 rays",
        bound: 0.0,
        figure: || {
            let mirrors = [[-1.0, 1.0, 1.0], [1.0, -1.0, 1.0], [-1.0, -1.0, 1.0], [-1.0, -1.0, -1.0]];
            mirrors.map(|scale| false_normals(DVec3::from(scale))).iter().sum()
        },
    },
    Case {
        name: "objects scaled by 1e-6 and 1e6",
        wrong: "lost objects, false normals",
        unit: "false hits and normals in 8 000 rays",
        bound: 0.0,
        figure: || [1e-6, 1e6].map(|scale| false_normals(DVec3::splat(scale))).iter().sum(),
    },
    Case {
        name: "objects stretched by 1e6 along one axis",
        wrong: "lost objects, false normals",
        unit: "false hits and normals in 4 000 rays",
        bound: 0.0,
        figure: || false_normals(DVec3::new(1e3, 1e-3, 1.0)),
    },
    Case {
        name: "singular transforms",
        wrong: "NaN that spreads, or flat ghosts",
        unit: "hits in 15 000 rays",
        bound: 0.0,
        figure: singular,
    },
];

/// Of rays at a stretched and turned ball: how many miss it, see its inside, or find a normal that is not that of the
/// ellipsoid (give or take its facets).
fn false_normals(scale: DVec3) -> f64 {
    let turn = DAffine3::from_rotation_z(0.3);
    let linear = turn * DAffine3::from_scale(scale);
    let mut builder = builder();
    let size = scale.abs().max_element();
    builder.cameras[0].position = DVec3::new(0.4, 0.3, 3.0) * size;
    place(&mut builder, ball(64, 128, 1.0), linear);
    let (_, world) = world(builder);
    let mut state = 13;
    let mut faults = 0;
    for _ in 0..4000 {
        let target = linear.transform_point3(random_point(&mut state).as_dvec3() * 0.5);
        let ray = Ray::new(Vec3::ZERO, (target - world.origin).normalize().as_vec3());
        let Some(hit) = world.closest(&ray, RayKinds::CAMERA, f32::INFINITY) else {
            faults += 1;
            continue;
        };
        let surface = Surface::new(&world, ray.direction, &hit);
        let local = linear.inverse().transform_point3(surface.position.as_dvec3() + world.origin);
        let expected = (linear.matrix3.inverse().transpose() * local).normalize().as_vec3();
        // The facets of the ball are 3° wide; stretched ones hide how far their normals are off.
        let tolerance = if scale.abs().min_element() == size { 0.1 } else { 1.0 };
        let right = hit.front && surface.geometric_normal.distance(expected) < tolerance;
        faults += u32::from(!right);
    }
    f64::from(faults)
}

fn singular() -> f64 {
    let mut builder = builder();
    for scale in [DVec3::new(1.0, 0.0, 1.0), DVec3::ZERO, DVec3::new(1e-40, 1.0, 1.0), DVec3::new(0.0, 0.0, 1e30)] {
        place(&mut builder, ball(8, 16, 1.0), DAffine3::from_scale(scale));
    }
    let (_, world) = world(builder);
    let mut state = 5;
    let mut hits = 0;
    for _ in 0..15_000 {
        let target = random_point(&mut state);
        let ray = Ray::new(Vec3::ZERO, target - world.origin.as_vec3());
        let hit = world.closest(&ray, RayKinds::CAMERA, f32::INFINITY);
        // A body squeezed to less than a float can hold is a plate seen edge-on; its normals must still be numbers.
        hits += u32::from(hit.is_some_and(|hit| !Surface::new(&world, ray.direction, &hit).normal.is_normalized()));
        hits += u32::from(hit.is_some_and(|hit| hit.object.0 != 2));
    }
    f64::from(hits)
}
