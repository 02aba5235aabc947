//! Rays against geometry with known answers: no leaks, no doubled surfaces, the same answer whatever the order.

use std::sync::Arc;

use tusche::math::{DAffine3, DVec3, Vec3};
use tusche::scene::camera::{Camera, Projection};
use tusche::scene::ids::MaterialId;
use tusche::scene::material::{Material, Script};
use tusche::scene::mesh::Mesh;
use tusche::scene::settings::RayKinds;
use tusche::scene::{Object, Scene, SceneBuilder};
use tusche::trace::World;
use tusche::trace::surface::Surface;
use tusche::trace::triangle::Ray;
use tusche::trace::world::Hit;

pub fn builder() -> SceneBuilder {
    let mut builder = SceneBuilder::default();
    let projection = Projection::Perspective { fov_y: 0.7 };
    let camera = Camera::look_at("camera", projection, DVec3::Z * 5.0, DVec3::ZERO, DVec3::Y);
    builder.cameras.push(camera.expect("this camera is sound"));
    let source = tusche::diag::Source::new("<test>", "fn surface(hit, p) { #{} }");
    let script = builder.add_script(Script { source, path: None });
    builder.add_material(Material {
        name: "grey".into(),
        script,
        params: Default::default(),
        priority: None,
        dielectric_priority: 0,
        double_sided: true,
        lines: Default::default(),
        span: None,
    });
    builder
}

pub fn place(builder: &mut SceneBuilder, mesh: Mesh, world_from_object: DAffine3) {
    let mesh = builder.add_mesh(mesh);
    builder.add_object(Object {
        name: "object".into(),
        mesh,
        materials: vec![MaterialId(0)],
        world_from_object,
        priority: None,
        visible_to: RayKinds::all(),
        lines: true,
        group: None,
        span: None,
    });
}

pub fn world(builder: SceneBuilder) -> (Scene, World) {
    let scene = builder.build().unwrap_or_else(|faults| panic!("{faults}"));
    let world = World::new(&scene, &[false]);
    (scene, world)
}

/// A closed sphere of triangles around the origin: its vertices are shared, so its edges have no gaps.
pub fn ball(rings: u32, segments: u32, radius: f32) -> Mesh {
    let mut mesh = Mesh { name: "ball".into(), ..Mesh::default() };
    mesh.positions.push(Vec3::Y * radius);
    for ring in 1..rings {
        let theta = ring as f32 / rings as f32 * std::f32::consts::PI;
        for segment in 0..segments {
            let phi = segment as f32 / segments as f32 * std::f32::consts::TAU;
            let direction = Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            mesh.positions.push(direction * radius);
        }
    }
    mesh.positions.push(-Vec3::Y * radius);
    let last = mesh.positions.len() as u32 - 1;
    let vertex = |ring: u32, segment: u32| match ring {
        0 => 0,
        ring if ring == rings => last,
        ring => 1 + (ring - 1) * segments + segment % segments,
    };
    for ring in 0..rings {
        for segment in 0..segments {
            let [a, b] = [vertex(ring, segment), vertex(ring, segment + 1)];
            let [c, d] = [vertex(ring + 1, segment), vertex(ring + 1, segment + 1)];
            if a != b {
                mesh.triangles.push([a, b, c]);
            }
            if c != d {
                mesh.triangles.push([b, d, c]);
            }
        }
    }
    mesh
}

/// Numbers in −1 … 1, the same in every run.
pub fn random(state: &mut u64) -> f32 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    ((*state >> 40) as f32 / (1u64 << 23) as f32) - 1.0
}

#[test]
fn no_ray_at_an_edge_or_vertex_of_a_closed_mesh_slips_through() {
    let mesh = ball(40, 80, 1.0);
    let targets: Vec<Vec3> = mesh
        .triangles
        .iter()
        .flat_map(|triangle| {
            let [a, b, c] = triangle.map(|vertex| mesh.positions[vertex as usize]);
            [a, (a + b) * 0.5, b.lerp(c, 0.3), c.lerp(a, 0.77)]
        })
        .collect();
    let mut builder = builder();
    let turned = DAffine3::from_rotation_y(0.3) * DAffine3::from_rotation_x(1.1);
    place(&mut builder, mesh, turned);
    let (_, world) = world(builder);
    let origin = world.origin.as_vec3();
    let mut state = 1;
    let (mut rays, mut leaks) = (0, 0);
    for _ in 0..12 {
        let start = Vec3::new(random(&mut state), random(&mut state), random(&mut state)) * 0.4;
        let outside = start.normalize() * 3.0;
        for target in &targets {
            let target = turned.as_affine3().transform_point3(*target);
            // From inside every ray must hit. From outside those at points well inside the outline must.
            for from in [start, outside] {
                let inside = from == start || target.normalize().dot(from.normalize()) > 0.5;
                if inside {
                    rays += 1;
                    let ray = Ray::new(from - origin, target - from);
                    leaks += usize::from(world.closest(&ray, RayKinds::CAMERA, f32::INFINITY).is_none());
                }
            }
        }
    }
    assert!(rays > 300_000, "{rays} rays");
    assert_eq!(leaks, 0, "of {rays} rays");
}

#[test]
fn rays_that_leave_a_surface_do_not_meet_it_again_at_any_scale() {
    // Long slivers are the hard case: rounding errors of the distance are large beside their width.
    let sliver = DVec3::new(0.1, 3.0, 0.1);
    for (size, rings, segments) in
        [1e-3, 1.0, 1e3, 1e6].map(|scale| (DVec3::splat(scale), 32, 64)).into_iter().chain([(sliver, 4, 256)])
    {
        let scale = size.max_element();
        let mut builder = builder();
        place(&mut builder, ball(rings, segments, 1.0), DAffine3::from_scale(size));
        builder.cameras[0].position = DVec3::new(0.3, 0.2, 3.0) * scale;
        let (_, world) = world(builder);
        let mut state = 7;
        let (mut hits, mut acne) = (0, 0);
        for _ in 0..20_000 {
            let target = Vec3::new(random(&mut state), random(&mut state), random(&mut state)) * size.as_vec3();
            let ray = Ray::new(Vec3::ZERO, (target - world.origin.as_vec3()).normalize());
            let Some(hit) = world.closest(&ray, RayKinds::CAMERA, f32::INFINITY) else { continue };
            let surface = Surface::new(&world, ray.direction, &hit);
            // A ball is convex: what leaves it outwards, even along it, meets nothing.
            for _ in 0..4 {
                let any = Vec3::new(random(&mut state), random(&mut state), random(&mut state)).normalize();
                let along = (any - surface.geometric_normal * any.dot(surface.geometric_normal)).normalize();
                for direction in [surface.geometric_normal, along + surface.geometric_normal * 1e-4] {
                    hits += 1;
                    let again = Ray::new(surface.leave(direction), direction);
                    acne += usize::from(world.closest(&again, RayKinds::SHADOW, f32::INFINITY).is_some());
                }
            }
        }
        assert!(hits > 20_000, "{hits}");
        assert_eq!(acne, 0, "at size {size}, of {hits}");
    }
}

#[test]
fn of_surfaces_at_one_depth_the_lowest_object_and_triangle_counts() {
    let square = Mesh {
        positions: vec![
            Vec3::new(-1.0, -1.0, 0.0),
            Vec3::new(1.0, -1.0, 0.0),
            Vec3::new(1.0, 1.0, 0.0),
            Vec3::new(-1.0, 1.0, 0.0),
        ],
        triangles: vec![[0, 1, 2], [0, 2, 3], [0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    };
    let mut builder = builder();
    for _ in 0..9 {
        place(&mut builder, square.clone(), DAffine3::IDENTITY);
    }
    let (_, world) = world(builder);
    let mut state = 3;
    for _ in 0..2_000 {
        let target = Vec3::new(random(&mut state), random(&mut state), 0.0) * 0.99;
        let ray = Ray::new(Vec3::ZERO, target - world.origin.as_vec3());
        let hit = world.closest(&ray, RayKinds::CAMERA, f32::INFINITY).expect("the squares are hit");
        assert_eq!(hit.object.0, 0);
        assert!(hit.triangle < 2, "triangle {}", hit.triangle);
    }
}

/// The hits of a ray one after the other, at most `most`, of those that are `same` only the first.
fn one_by_one(world: &World, ray: &Ray, most: usize, same: impl Fn(&Hit, &Hit) -> bool) -> Vec<Hit> {
    let mut hits: Vec<Hit> = Vec::new();
    let mut after: Option<Hit> = None;
    while let Some(hit) = world.next_hit(ray, RayKinds::CAMERA, after.as_ref())
        && hits.len() < most
    {
        after = Some(hit);
        if !hits.iter().any(|known| same(known, &hit)) {
            hits.push(hit);
        }
    }
    hits
}

#[test]
fn the_first_hits_of_a_ray_are_those_found_one_by_one() {
    let square = |z: f32| Mesh {
        positions: [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| Vec3::new(x, y, z)).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3], [0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    };
    let mut builder = builder();
    // Closed bodies within each other, and squares at one depth, each of them twice.
    for index in 0..6 {
        let at = DVec3::new(0.3 * f64::from(index), 0.1, -0.2 * f64::from(index));
        place(&mut builder, ball(16, 24, 1.0), DAffine3::from_translation(at));
        place(&mut builder, square(0.0), DAffine3::IDENTITY);
    }
    let (_, world) = world(builder);
    let mut state = 5;
    let mut hits = Vec::new();
    let (mut longest, mut ties) = (0, 0);
    for _ in 0..3_000 {
        let target = Vec3::new(random(&mut state), random(&mut state), 0.3 * random(&mut state));
        let ray = Ray::new(Vec3::ZERO, (target - world.origin.as_vec3()).normalize());
        for most in [1, 2, 3, 5, 16, 64] {
            world.first_hits(&ray, RayKinds::CAMERA, (None, &[]), most, |_, _| false, &mut hits);
            assert_eq!(hits, one_by_one(&world, &ray, most, |_, _| false), "{most} hits");
            assert_eq!(hits.first().copied(), world.closest(&ray, RayKinds::CAMERA, f32::INFINITY));
            longest = longest.max(hits.len());
            ties += hits.windows(2).filter(|pair| pair[0].t == pair[1].t).count();
            let same = |a: &Hit, b: &Hit| a.object == b.object;
            world.first_hits(&ray, RayKinds::CAMERA, (None, &[]), most, same, &mut hits);
            assert_eq!(hits, one_by_one(&world, &ray, most, same), "{most} objects");
        }
        // What is absent is as if it were not there; so is all up to a rank.
        let all = one_by_one(&world, &ray, 64, |_, _| false);
        if let [first, second, rest @ ..] = &all[..] {
            let absent = [second.facet()];
            world.first_hits(&ray, RayKinds::CAMERA, (Some(first), &absent), 64, |_, _| false, &mut hits);
            assert_eq!(hits, rest);
        }
    }
    assert!(longest > 16 && ties > 10_000, "{longest} hits, {ties} ties");
}

#[test]
fn of_coplanar_triangles_all_over_a_mesh_the_lowest_counts() {
    // A wavy net of squares, and the same once more.
    let mut net = Mesh::default();
    let side = 24_u32;
    for index in 0..(side + 1) * (side + 1) {
        let [x, y] = [index % (side + 1), index / (side + 1)].map(|i| i as f32 / side as f32 * 2.0 - 1.0);
        net.positions.push(Vec3::new(x, y, 0.05 * (7.0 * x).sin()));
    }
    for square in 0..side * side {
        let a = square / side * (side + 1) + square % side;
        net.triangles.extend([[a, a + 1, a + side + 2], [a, a + side + 2, a + side + 1]]);
    }
    let once = net.triangles.len() as u32;
    net.triangles.extend_from_within(..);
    for turn in [0.0, 0.4, 1.2] {
        let mut builder = builder();
        place(&mut builder, net.clone(), DAffine3::from_rotation_y(turn) * DAffine3::from_rotation_x(0.7 * turn));
        let (_, world) = world(builder);
        let mut state = 11;
        let mut hits = 0;
        for _ in 0..20_000 {
            let target = Vec3::new(random(&mut state), random(&mut state), 0.0);
            let ray = Ray::new(Vec3::ZERO, (target - world.origin.as_vec3()).normalize());
            let Some(hit) = world.closest(&ray, RayKinds::CAMERA, f32::INFINITY) else { continue };
            hits += 1;
            assert!(hit.triangle < once, "turned by {turn}: triangle {}", hit.triangle);
        }
        assert!(hits > 4_000, "turned by {turn}: {hits} hits");
    }
}

#[test]
fn rays_that_leave_far_turned_and_stretched_objects_do_not_meet_them_again() {
    for (stretch, distance) in [(1.0, 1e4), (100.0, 1.0), (100.0, 1e3), (1e-3, 10.0)] {
        let mut builder = builder();
        let linear = DAffine3::from_rotation_z(0.7)
            * DAffine3::from_scale(DVec3::new(1.0, stretch, 0.3))
            * DAffine3::from_rotation_y(0.4);
        let center = DVec3::new(0.3, -0.2, -1.0) * distance;
        place(&mut builder, ball(32, 64, 1.0), DAffine3::from_translation(center) * linear);
        builder.cameras[0].position = DVec3::Z * 3.0 * stretch.max(1.0);
        let (_, world) = world(builder);
        let mut state = 9;
        let (mut hits, mut acne) = (0, 0);
        for _ in 0..20_000 {
            let inside = DVec3::new(random(&mut state).into(), random(&mut state).into(), random(&mut state).into());
            let target = (center + linear.transform_point3(inside * 0.55) - world.origin).as_vec3();
            let ray = Ray::new(Vec3::ZERO, target.normalize());
            let Some(hit) = world.closest(&ray, RayKinds::CAMERA, f32::INFINITY) else { continue };
            let surface = Surface::new(&world, ray.direction, &hit);
            let any = Vec3::new(random(&mut state), random(&mut state), random(&mut state)).normalize();
            let along = (any - surface.geometric_normal * any.dot(surface.geometric_normal)).normalize();
            for direction in [surface.geometric_normal, along + surface.geometric_normal * 1e-3] {
                hits += 1;
                let again = Ray::new(surface.leave(direction), direction.normalize());
                acne += usize::from(world.closest(&again, RayKinds::SHADOW, f32::INFINITY).is_some());
            }
        }
        assert!(hits > 20_000, "{hits}");
        assert_eq!(acne, 0, "stretched by {stretch}, {distance} away, of {hits}");
    }
}

#[test]
fn a_mesh_used_ten_thousand_times_is_stored_once() {
    let mut builder = builder();
    let mesh = Arc::new(ball(8, 16, 0.01));
    builder.meshes.push(Arc::clone(&mesh));
    for x in 0..100 {
        for y in 0..100 {
            builder.add_object(Object {
                name: format!("ball {x} {y}"),
                mesh: tusche::scene::ids::MeshId(0),
                materials: vec![MaterialId(0)],
                world_from_object: DAffine3::from_translation(DVec3::new(
                    f64::from(x) - 50.0,
                    f64::from(y) - 50.0,
                    0.0,
                )),
                priority: None,
                visible_to: RayKinds::all(),
                lines: true,
                group: None,
                span: None,
            });
        }
    }
    let (scene, world) = world(builder);
    assert_eq!(scene.triangle_count(), mesh.triangles.len());
    let ray = Ray::new(Vec3::ZERO, DVec3::new(7.0, -3.0, -5.0).as_vec3());
    let hit = world.closest(&ray, RayKinds::CAMERA, f32::INFINITY).expect("the ball at (7, −3) is hit");
    assert_eq!(scene.objects()[hit.object.index()].name, "ball 57 47");
}

#[test]
fn single_sided_surfaces_are_seen_from_the_front_only_but_cast_shadows() {
    let triangle =
        Mesh { positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y], triangles: vec![[0, 1, 2]], ..Mesh::default() };
    for mirrored in [1.0, -1.0] {
        let mut builder = builder();
        builder.materials[0].double_sided = false;
        let place_it = DAffine3::from_scale(DVec3::new(mirrored, 1.0, 1.0));
        place(&mut builder, triangle.clone(), place_it);
        let (_, world) = world(builder);
        let at = Vec3::new(0.25 * mirrored as f32, 0.25, 0.0) - world.origin.as_vec3();
        // A mirroring transform keeps the front the front.
        let seen = |from: Vec3, kind| {
            let ray = Ray::new(at + from, -from);
            world.closest(&ray, kind, f32::INFINITY).is_some()
        };
        assert!(seen(Vec3::Z, RayKinds::CAMERA));
        assert!(!seen(Vec3::NEG_Z, RayKinds::CAMERA));
        assert!(seen(Vec3::NEG_Z, RayKinds::SHADOW));
    }
}

#[test]
fn degenerate_and_broken_triangles_are_never_met() {
    let mut builder = builder();
    let mesh = Mesh {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::NAN, Vec3::Y, Vec3::INFINITY],
        triangles: vec![[0, 1, 2], [0, 1, 1], [0, 0, 0], [0, 3, 4]],
        ..Mesh::default()
    };
    place(&mut builder, mesh, DAffine3::IDENTITY);
    place(&mut builder, ball(4, 8, 1.0), DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0)));
    place(&mut builder, ball(4, 8, 1.0), DAffine3::from_scale(DVec3::ZERO));
    let (_, world) = world(builder);
    let mut state = 5;
    for _ in 0..5_000 {
        let target = Vec3::new(random(&mut state), random(&mut state), random(&mut state));
        let ray = Ray::new(Vec3::ZERO, target - world.origin.as_vec3());
        assert_eq!(world.closest(&ray, RayKinds::CAMERA, f32::INFINITY), None);
    }
}
