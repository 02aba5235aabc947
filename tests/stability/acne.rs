//! Rays that leave a surface must not meet it again, whatever its size and place.

use tusche::math::{DAffine3, DVec3, Vec3};
use tusche::scene::settings::RayKinds;
use tusche::trace::surface::Surface;
use tusche::trace::triangle::Ray;

use super::{Case, random_point};
use crate::trace::{ball, builder, place, world};

pub const CASES: &[Case] = &[
    Case {
        name: "shadow rays from balls of radius 1e-3 to 1e6",
        wrong: "shadow acne, or light through thin walls",
        unit: "rays that meet their own ball",
        bound: 0.0,
        figure: || [-3, -2, -1, 0, 1, 2, 3, 4, 5, 6].map(|power| own_hits(10_f64.powi(power), 0.0)).iter().sum(),
    },
    Case {
        name: "shadow rays from a ball 10 000 radii away",
        wrong: "shadow acne on far objects",
        unit: "rays that meet their own ball",
        bound: 0.0,
        figure: || own_hits(1.0, 1e4),
    },
    Case {
        name: "reflected rays in a box of mirrors, 64 deep",
        wrong: "holes in rooms of mirrors",
        unit: "leaks in 128 000 bounces",
        bound: 0.0,
        figure: mirror_box,
    },
    Case {
        name: "reach of the offset of a ball's shadow rays",
        wrong: "gaps between things and their shadows",
        unit: "largest offset over the radius",
        bound: 1e-5,
        figure: largest_offset,
    },
];

/// How often a ray that leaves a ball, straight up or along it, meets it again.
fn own_hits(radius: f64, away: f64) -> f64 {
    let mut builder = builder();
    let center = DVec3::new(0.6, -0.48, -0.64) * away * radius;
    place(
        &mut builder,
        ball(32, 64, 1.0),
        DAffine3::from_translation(center) * DAffine3::from_scale(DVec3::splat(radius)),
    );
    builder.cameras[0].position = DVec3::new(0.3, 0.2, 3.0) * radius;
    let (_, world) = world(builder);
    let center = (center - world.origin).as_vec3();
    let mut state = 7;
    let (mut rays, mut own) = (0, 0);
    for _ in 0..2000 {
        let target = center + random_point(&mut state) * (0.55 * radius as f32);
        let ray = Ray::new(Vec3::ZERO, target.normalize());
        let Some(hit) = world.closest(&ray, RayKinds::CAMERA, f32::INFINITY) else { continue };
        let surface = Surface::new(&world, ray.direction, &hit);
        let any = random_point(&mut state);
        let along = (any - surface.geometric_normal * any.dot(surface.geometric_normal)).normalize();
        for direction in [surface.geometric_normal, (along + surface.geometric_normal * 1e-4).normalize()] {
            rays += 1;
            let again = Ray::new(surface.leave(direction), direction);
            own += u32::from(world.closest(&again, RayKinds::SHADOW, f32::INFINITY).is_some());
        }
    }
    assert!(rays > 3000, "{rays} rays at radius {radius}");
    f64::from(own)
}

fn largest_offset() -> f64 {
    let mut builder = builder();
    place(&mut builder, ball(32, 64, 1.0), DAffine3::IDENTITY);
    let (_, world) = world(builder);
    let center = -world.origin.as_vec3();
    let mut state = 3;
    let mut largest = 0.0_f32;
    for _ in 0..2000 {
        let ray = Ray::new(Vec3::ZERO, (center + random_point(&mut state) * 0.55).normalize());
        let Some(hit) = world.closest(&ray, RayKinds::CAMERA, f32::INFINITY) else { continue };
        let surface = Surface::new(&world, ray.direction, &hit);
        largest = largest.max(surface.leave(surface.geometric_normal).distance(surface.position));
    }
    assert!(largest > 0.0);
    f64::from(largest)
}

/// From the middle of a cube in all directions; every bounce must find a wall.
fn mirror_box() -> f64 {
    let mut builder = builder();
    let walls = tusche::scene::shape::Shape::BOX.mesh().unwrap_or_else(|fault| panic!("{}", fault.message));
    place(&mut builder, walls, DAffine3::from_rotation_y(0.4));
    builder.cameras[0].position = DVec3::new(0.1, -0.2, 0.3);
    let (_, world) = world(builder);
    let mut state = 29;
    let mut leaks = 0;
    for _ in 0..2000 {
        let (mut origin, mut direction) = (Vec3::ZERO, random_point(&mut state).normalize());
        for bounce in 0..64 {
            let ray = Ray::new(origin, direction);
            let Some(hit) = world.closest(&ray, RayKinds::REFLECTION, f32::INFINITY) else {
                leaks += 64 - bounce;
                break;
            };
            let surface = Surface::new(&world, ray.direction, &hit);
            let normal = surface.geometric_normal;
            direction = (direction - normal * (2.0 * direction.dot(normal))).normalize();
            origin = surface.leave(direction);
        }
    }
    f64::from(leaks)
}
