//! Texture coordinates where a sphere's net is cut and where it shrinks to a point.

use tusche::math::{DAffine3, Vec3};
use tusche::scene::settings::RayKinds;
use tusche::scene::shape::Shape;
use tusche::trace::surface::Surface;
use tusche::trace::triangle::Ray;

use super::{Case, random_point};
use crate::trace::{builder, place, random, world};

pub const CASES: &[Case] = &[Case {
    name: "the uv seam and the poles of a sphere",
    wrong: "a line along the seam, a smeared strip of texture, NaN at the poles",
    unit: "false uv and unusable tangents of 20 000 rays",
    bound: 0.0,
    figure: seam_and_poles,
}];

const AROUND: u32 = 256;

/// A point of the sphere: on the seam, a pole, or as near to one as a float tells.
fn target(number: usize, state: &mut u64) -> Vec3 {
    let hair = random_point(state) * 10_f32.powi(-((random(state).abs() * 8.0) as i32));
    let height = random(state);
    let seam = Vec3::new(0.0, height, -(1.0 - height * height).sqrt());
    match number % 6 {
        0 => seam,
        1 => seam + Vec3::new(hair.x, 0.0, 0.0),
        2 => Vec3::Y * height.signum(),
        3 => Vec3::Y * height.signum() + hair,
        4 => seam * Vec3::new(1.0, 1.0, -1.0),
        _ => random_point(state),
    }
}

fn seam_and_poles() -> f64 {
    let shape = Shape::Sphere { radius: 1.0, segments: [AROUND, AROUND / 2] };
    let turn = DAffine3::from_rotation_y(0.6) * DAffine3::from_rotation_x(0.4);
    let mut builder = builder();
    place(&mut builder, shape.mesh().unwrap_or_else(|fault| panic!("{}", fault.message)), turn);
    let (_, world) = world(builder);
    let turn = turn.as_affine3();
    let mut state = 77;
    let mut faults = 0;
    for number in 0..20_000 {
        let aim = turn.transform_point3(target(number, &mut state).normalize() * 0.999);
        // From outside, straight towards the point, whichever side it is on.
        let origin = aim * 3.0;
        let ray = Ray::new(origin - world.origin.as_vec3(), (aim - origin).normalize());
        let Some(hit) = world.closest(&ray, RayKinds::REFLECTION, f32::INFINITY) else {
            faults += 1;
            continue;
        };
        let surface = Surface::new(&world, ray.direction, &hit);
        let object = world.object(hit.object);
        let uv = surface.uv(object, &hit, 0);
        let on_sphere = turn.inverse().transform_vector3(surface.position + world.origin.as_vec3()).as_dvec3();
        let from_axis = on_sphere.x.hypot(on_sphere.z);
        let v = from_axis.atan2(on_sphere.y) / std::f64::consts::PI;
        let u = (-on_sphere.x).atan2(-on_sphere.z) / std::f64::consts::TAU;
        let off = (f64::from(uv.x) - u).rem_euclid(1.0);
        // Within a triangle u may be off by what the triangle covers; so near to a pole that positions round it can be anything.
        let right_u = off.min(1.0 - off) <= 1.01 / f64::from(AROUND) || from_axis < 1e-4;
        let in_range = (0.0..=1.0).contains(&uv.x) && (0.0..=1.0).contains(&uv.y);
        let tangent = surface.tangent(object, &hit).truncate();
        let usable = tangent.is_normalized() && tangent.dot(surface.normal).abs() < 1e-5;
        faults += u32::from(!(right_u && in_range && (f64::from(uv.y) - v).abs() < 1e-3 && usable));
    }
    f64::from(faults)
}
