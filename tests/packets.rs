//! Packets find what single rays find, bit for bit.

use proptest::prelude::*;
use tusche::math::{DAffine3, DQuat, DVec3, Vec3};
use tusche::scene::camera::{Camera, Projection};
use tusche::scene::ids::{MaterialId, ObjectId};
use tusche::scene::material::{Material, Script};
use tusche::scene::mesh::Mesh;
use tusche::scene::settings::RayKinds;
use tusche::scene::{Object, SceneBuilder};
use tusche::trace::World;
use tusche::trace::packet::{LANES, RayPacket, RayStart};
use tusche::trace::triangle::Ray;
use tusche::trace::world::Hit;
use tusche::trace::world_packet::{ShadowRay, Way};

/// Coordinates among which some are equal, so that rays meet edges, vertices, coplanar and flat triangles, and run along
/// axes and faces of boxes.
fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![4 => -2.0f32..2.0, 3 => (-4i32..=4).prop_map(|i| i as f32 * 0.5), 1 => Just(0.0), 1 => -1e-6f32..1e-6]
}

fn vector() -> impl Strategy<Value = Vec3> {
    (coordinate(), coordinate(), coordinate()).prop_map(Vec3::from)
}

/// Triangles over few vertices: they share edges, lie in each other, and some have no area.
fn mesh() -> impl Strategy<Value = Mesh> {
    (proptest::collection::vec(vector(), 3..40), any::<u64>(), 1..200usize).prop_map(|(positions, seed, count)| {
        let mut state = seed;
        let mut vertex = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as u32 % positions.len() as u32
        };
        let triangles: Vec<[u32; 3]> = (0..count).map(|_| [vertex(), vertex(), vertex()]).collect();
        let slots = (0..count).map(|i| (i % 2) as u16).collect();
        Mesh { name: "random".into(), positions, triangles, slots, ..Mesh::default() }
    })
}

fn placement() -> impl Strategy<Value = DAffine3> {
    let turn = (vector(), 0.0..7.0f64)
        .prop_map(|(axis, angle)| DQuat::from_axis_angle(axis.as_dvec3().try_normalize().unwrap_or(DVec3::Y), angle));
    let moved = (vector(), 0.2..3.0f64, any::<bool>(), turn).prop_map(|(by, scale, mirrored, turn)| {
        let scale = DVec3::new(if mirrored { -scale } else { scale }, 1.0, 1.0);
        DAffine3::from_scale_rotation_translation(scale, turn, by.as_dvec3())
    });
    prop_oneof![1 => Just(DAffine3::IDENTITY), 3 => moved]
}

/// A ray near others of its packet, by how much they differ.
fn packet() -> impl Strategy<Value = Vec<RayStart>> {
    let spread = prop_oneof![Just(0.0f32), Just(1e-6), Just(1e-3), Just(0.1), Just(3.0)];
    let rays = proptest::collection::vec((vector(), vector()), 1..=LANES);
    (vector(), vector(), spread.clone(), spread, rays).prop_map(|(origin, direction, apart, turned, rays)| {
        let near = |(from, towards): (Vec3, Vec3)| (origin * 2.0 + from * apart, direction + towards * turned);
        rays.into_iter().map(near).collect()
    })
}

/// Objects of one or two meshes, with materials that are seen from the front only (the second slot) and objects that some
/// rays do not see.
fn world() -> impl Strategy<Value = World> {
    let object = (0..2usize, placement(), 0..4u8);
    (mesh(), mesh(), proptest::collection::vec(object, 1..7)).prop_map(|(first, second, objects)| {
        let mut builder = SceneBuilder::default();
        let camera = Camera::look_at("camera", Projection::Perspective { fov_y: 0.7 }, DVec3::ZERO, DVec3::X, DVec3::Y);
        builder.cameras.push(camera.expect("this camera is sound"));
        let source = tusche::diag::Source::new("<test>", "fn surface(hit, p) { #{} }");
        let script = builder.add_script(Script { source, path: None });
        for double_sided in [true, false] {
            builder.add_material(Material {
                name: format!("{double_sided}"),
                script,
                params: Default::default(),
                priority: None,
                dielectric_priority: 0,
                double_sided,
                lines: Default::default(),
                span: None,
            });
        }
        let meshes = [builder.add_mesh(first), builder.add_mesh(second)];
        for (mesh, world_from_object, hidden) in objects {
            let visible_to = match hidden {
                0 => RayKinds::all() - RayKinds::CAMERA,
                1 => RayKinds::all() - RayKinds::SHADOW,
                _ => RayKinds::all(),
            };
            builder.add_object(Object {
                name: "object".into(),
                mesh: meshes[mesh],
                materials: vec![MaterialId(0), MaterialId(1)],
                world_from_object,
                priority: None,
                visible_to,
                lines: true,
                group: None,
                span: None,
            });
        }
        let scene = builder.build().unwrap_or_else(|faults| panic!("{faults}"));
        World::new(&scene, &[false, false])
    })
}

fn bits(hit: Option<Hit>) -> Option<[u32; 6]> {
    let hit = hit?;
    let [u, v] = hit.barycentric;
    Some([hit.t.to_bits(), u.to_bits(), v.to_bits(), hit.object.0, hit.triangle, u32::from(hit.front)])
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn packets_find_the_closest_hits_of_single_rays(
        world in world(),
        packets in proptest::collection::vec(packet(), 1..40),
    ) {
        for rays in packets {
            for kind in [RayKinds::CAMERA, RayKinds::REFLECTION] {
                let found = world.closest_of(&RayPacket::of(rays.iter().copied()), kind);
                for (lane, &(origin, direction)) in rays.iter().enumerate() {
                    let single = world.closest(&Ray::new(origin, direction), kind, f32::INFINITY);
                    prop_assert_eq!(bits(found[lane]), bits(single), "{} {}", origin, direction);
                }
                prop_assert!(found[rays.len()..].iter().all(Option::is_none));
            }
        }
    }

    /// Everything is opaque, nothing is, or what is seen from the front only; rays leave triangles that they meet.
    #[test]
    fn packets_are_blocked_where_single_rays_are(
        world in world(),
        packets in proptest::collection::vec(packet(), 1..40),
        which in 0..3u32,
        reach in prop_oneof![Just(f32::INFINITY), 0.1f32..4.0],
        leaves_what_it_meets in any::<bool>(),
    ) {
        let opaque = |id: MaterialId| which == 2 || which == 1 && id == MaterialId(1);
        for rays in packets {
            let shadow: Vec<ShadowRay> = rays
                .iter()
                .map(|&start| {
                    let met = world.closest(&Ray::new(start.0, start.1), RayKinds::SHADOW, f32::INFINITY);
                    let leaves = met.filter(|_| leaves_what_it_meets).map_or((ObjectId(0), u32::MAX), |hit| hit.facet());
                    ShadowRay { start, reach, leaves }
                })
                .collect();
            let ways = world.blocked_of(&shadow, &opaque);
            let mut passed = Vec::new();
            for (ray, way) in shadow.iter().zip(ways) {
                let single = Ray::new(ray.start.0, ray.start.1);
                let blocked = world.blocked(&single, reach, Some(ray.leaves), opaque, &mut passed);
                match way {
                    Way::Unknown => {}
                    Way::Blocked => prop_assert!(blocked, "{:?}", ray),
                    Way::Clear => prop_assert!(!blocked && passed.is_empty(), "{:?} {:?}", ray, passed),
                }
                // Nobody looks at packets that are none; else only what is not opaque leaves a doubt.
                if which == 2 && ways.iter().take(shadow.len()).any(|way| *way != Way::Unknown) {
                    prop_assert_ne!(way, Way::Unknown);
                }
            }
        }
    }
}

/// The order of the hierarchy decides nothing: all triangles, one by one, give the same hit.
#[test]
fn what_a_ray_meets_first_is_least_among_all_triangles() {
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    runner
        .run(&(mesh(), packet()), |(mesh, rays)| {
            let tree = tusche::trace::mesh_tree::MeshTree::new(&mesh);
            for (origin, direction) in rays {
                let ray = Ray::new(origin, direction);
                let (mut least, mut far): (Option<(f32, u32)>, f32) = (None, f32::INFINITY);
                tree.intersect(&ray, &mut far, |id, hit, t_max| {
                    if least.is_none_or(|least| (hit.t, id) < least) {
                        least = Some((hit.t, id));
                        *t_max = hit.t;
                    }
                    true
                });
                let corners = |triangle: &[u32; 3]| triangle.map(|vertex| mesh.positions[vertex as usize]);
                let all = mesh
                    .triangles
                    .iter()
                    .zip(0..)
                    .filter_map(|(triangle, id)| Some((ray.triangle(&corners(triangle), f32::INFINITY)?.t, id)));
                let expected = all.min_by(|a, b| a.partial_cmp(b).expect("distances are numbers"));
                prop_assert_eq!(least, expected);
            }
            Ok(())
        })
        .unwrap_or_else(|fault| panic!("{fault}"));
}
