//! How many rays a second find their surface: `cargo bench --bench rays -- [SCENE...]`.
//!
//! `SCENE` is whatever `tusche render` takes: a model, or a scene file. Without one, knots of about 100 thousand and 2 million
//! triangles are made up. The picture has 1280 × 720 pixels and one pinhole ray each, in blocks of 4 × 4 pixels, from the
//! scene's camera or a framed one. Shadow rays go from what these see towards one sun; bounces leave it in random
//! directions, weighted by the cosine. Only hits are looked for: no surface, no shading.
//!
//! Rates are millions of rays per second of CPU time and thread, times the threads: what others do on the machine does not
//! count, but for the caches and the memory that they take.

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use rayon::prelude::*;
use tusche::clock::CpuClock;
use tusche::files::FileStore;
use tusche::math::Vec3;
use tusche::scene::ids::ObjectId;
use tusche::scene::settings::RayKinds;
use tusche::scene::{Scene, file};
use tusche::trace::World;
use tusche::trace::packet::{LANES, RayPacket, RayStart};
use tusche::trace::surface::Surface;
use tusche::trace::triangle::Ray;
use tusche::trace::world::Facet;
use tusche::trace::world_packet::{ShadowRay, Way};

const SIZE: [u32; 2] = [1280, 720];
/// Side of the blocks of pixels in which rays are ordered.
const BLOCK: u32 = 4;
/// CPU seconds of a pass.
const PASS: f64 = 0.3;
const PASSES: usize = 5;
/// Rays of a batch.
const BATCH: usize = 4096;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    // `cargo test --all-targets` runs benchmarks too, without this flag.
    if !arguments.iter().any(|argument| argument == "--bench") {
        return;
    }
    let scenes: Vec<&String> = arguments.iter().filter(|argument| !argument.starts_with("--")).collect();
    println!("| scene | rays | threads | single, Mrays/s | packets, Mrays/s | packets / single |");
    println!("|---|---|---|---|---|---|");
    if scenes.is_empty() {
        measure("knots, 0.1 M", &knots([512, 34]));
        measure("knots, 2 M", &knots([2048, 163]));
    }
    for scene in scenes {
        measure(scene, &load(Path::new(scene), &FileStore::new()));
    }
}

/// Three knots of some segments.
fn knots([along, tube]: [u32; 2]) -> Scene {
    let knot = format!("[[objects]]\nshape = \"knot\"\nsegments = [{along}, {tube}]\n");
    let text = format!(
        "{knot}translate = [-1.1, 0, 0]\n{knot}translate = [1.1, 0.2, 0.3]\nrotate = [40, 60, 0]\n\
         {knot}translate = [0, 0.9, -1.2]\nrotate = [80, 10, 30]\nscale = 1.3\n"
    );
    let path = Path::new("knots.toml");
    load(path, &FileStore::new().with_file(path, text))
}

fn load(path: &Path, files: &FileStore) -> Scene {
    file::load(path, files, &[], &file::LoadOptions::default())
        .and_then(|(builder, _)| builder.build())
        .unwrap_or_else(|faults| panic!("{faults}"))
}

/// Traces rays; how many of them meet something.
/// Rays that a thread takes at a time, and the same as packets, which the renderer has number by number from the start.
struct Batch {
    rays: Vec<ShadowRay>,
    packets: Vec<RayPacket>,
}

type Trace = fn(&World, &Batch) -> usize;

fn measure(name: &str, scene: &Scene) {
    let transmissive = vec![false; scene.materials().len()];
    let (wall, cpu) = (Instant::now(), CpuClock::process());
    let world = World::new(scene, &transmissive);
    let (wall, cpu) = (wall.elapsed().as_secs_f64(), cpu.seconds());

    let camera = camera_rays(scene);
    let surfaces: Vec<(Facet, Surface)> = camera
        .iter()
        .filter_map(|ray| {
            let hit = world.closest(&single(ray), RayKinds::CAMERA, f32::INFINITY)?;
            Some((hit.facet(), Surface::new(&world, ray.start.1, &hit)))
        })
        .collect();
    // Over the camera's left shoulder.
    let towards = scene.camera().world_from_camera.as_mat3() * Vec3::new(-0.4, 0.7, 0.6).normalize();
    let shadow: Vec<ShadowRay> = surfaces
        .iter()
        .filter(|(_, surface)| towards.dot(surface.geometric_normal) > 0.0)
        .map(|(facet, surface)| endless((surface.leave(towards), towards), *facet))
        .collect();
    let mut state = 1;
    let bounce: Vec<ShadowRay> = surfaces
        .iter()
        .map(|(facet, surface)| {
            let direction = around(surface.geometric_normal, &mut state);
            endless((surface.leave(direction), direction), *facet)
        })
        .collect();

    let rays_seen = camera.len();
    let [camera, shadow, bounce] = [camera, shadow, bounce].map(batches);
    for threads in [1, std::thread::available_parallelism().map_or(1, usize::from)] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started");
        let line = |kind: &str, rays: &[Batch], single: Trace, packets: Option<Trace>| {
            let mut rates = [const { Vec::new() }; 3];
            for _ in 0..PASSES {
                let single = rate(&pool, rays, &|batch| single(&world, batch));
                let packets = packets.map_or(f64::NAN, |packets| rate(&pool, rays, &|batch| packets(&world, batch)));
                for (rates, rate) in rates.iter_mut().zip([single, packets, packets / single]) {
                    rates.push(rate);
                }
            }
            let [single, packets, ratio] = rates.map(median);
            match packets.is_nan() {
                true => println!("| {name} | {kind} | {threads} | {single:.2} | | |"),
                false => println!("| {name} | {kind} | {threads} | {single:.2} | {packets:.2} | {ratio:.2} |"),
            }
        };
        line("camera", &camera, closest, Some(closest_of));
        line("shadow", &shadow, blocked, Some(blocked_of));
        line("bounce", &bounce, closest, Some(closest_of));
    }
    println!(
        "\n{name}: {} triangles, trees of {:.1} MB in {wall:.2} s ({cpu:.2} s of CPU time), {} of {} camera rays hit\n",
        scene.triangle_count(),
        world.tree_bytes() as f64 * 1e-6,
        surfaces.len(),
        rays_seen,
    );
}

fn batches(rays: Vec<ShadowRay>) -> Vec<Batch> {
    let batch = |rays: &[ShadowRay]| {
        let packets = rays.chunks(LANES).map(|rays| RayPacket::of(rays.iter().map(|ray| ray.start))).collect();
        Batch { rays: rays.to_vec(), packets }
    };
    rays.chunks(BATCH).map(batch).collect()
}

fn camera_rays(scene: &Scene) -> Vec<ShadowRay> {
    let mut rays = Vec::with_capacity((SIZE[0] * SIZE[1]) as usize);
    for top in (0..SIZE[1]).step_by(BLOCK as usize) {
        for left in (0..SIZE[0]).step_by(BLOCK as usize) {
            for y in top..(top + BLOCK).min(SIZE[1]) {
                for x in left..(left + BLOCK).min(SIZE[0]) {
                    let start = scene.camera().ray(SIZE, [x as i32, y as i32], [0.5, 0.5]);
                    // They leave no triangle: none has this number.
                    rays.push(endless(start, (ObjectId(0), u32::MAX)));
                }
            }
        }
    }
    rays
}

/// A random direction on the side of a normal, weighted by the cosine.
fn around(normal: Vec3, state: &mut u64) -> Vec3 {
    loop {
        let point = Vec3::from_array(std::array::from_fn(|_| random(state)));
        if (1e-3..1.0).contains(&point.length_squared()) {
            let direction = normal + point.normalize();
            if direction.length_squared() > 1e-6 {
                return direction.normalize();
            }
        }
    }
}

/// Numbers in −1 … 1, the same in every run.
fn random(state: &mut u64) -> f32 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    ((*state >> 40) as f32 / (1u64 << 23) as f32) - 1.0
}

/// A ray that goes on for ever.
fn endless(start: RayStart, leaves: Facet) -> ShadowRay {
    ShadowRay { start, reach: f32::INFINITY, leaves }
}

fn single(ray: &ShadowRay) -> Ray {
    Ray::new(ray.start.0, ray.start.1)
}

fn closest(world: &World, Batch { rays, .. }: &Batch) -> usize {
    let closest = |ray: &ShadowRay| world.closest(&single(ray), RayKinds::CAMERA, f32::INFINITY);
    rays.iter().filter(|ray| closest(ray).is_some_and(|hit| hit.t > 0.0)).count()
}

fn closest_of(world: &World, Batch { packets, .. }: &Batch) -> usize {
    let meet = |packet: &RayPacket| {
        let hits = world.closest_of(packet, RayKinds::CAMERA);
        hits.iter().flatten().filter(|hit| hit.t > 0.0).count()
    };
    packets.iter().map(meet).sum()
}

fn is_blocked(world: &World, ray: &ShadowRay) -> bool {
    world.blocked(&single(ray), ray.reach, Some(ray.leaves), |_| true, &mut Vec::new())
}

fn blocked(world: &World, Batch { rays, .. }: &Batch) -> usize {
    rays.iter().filter(|ray| is_blocked(world, ray)).count()
}

/// As the renderer does it: what packets leave open is looked at one by one.
fn blocked_of(world: &World, Batch { rays, .. }: &Batch) -> usize {
    let count = |rays: &[ShadowRay]| {
        let ways = world.blocked_of(rays, &|_| true);
        let blocked = |(way, ray): &(Way, &ShadowRay)| match way {
            Way::Clear => false,
            Way::Blocked => true,
            Way::Unknown => is_blocked(world, ray),
        };
        ways.into_iter().zip(rays).filter(blocked).count()
    };
    rays.chunks(LANES).map(count).sum()
}

/// Millions of rays a second in one pass.
fn rate(pool: &rayon::ThreadPool, batches: &[Batch], trace: &(dyn Fn(&Batch) -> usize + Sync)) -> f64 {
    let threads = pool.current_num_threads() as f64;
    let rays: usize = batches.iter().map(|batch| batch.rays.len()).sum();
    let clock = CpuClock::process();
    let mut traced = 0;
    while clock.seconds() < PASS * threads {
        black_box(pool.install(|| batches.par_iter().with_max_len(1).map(trace).sum::<usize>()));
        traced += rays;
    }
    traced as f64 / (clock.seconds() / threads) * 1e-6
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
