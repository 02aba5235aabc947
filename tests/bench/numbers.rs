//! What number formats change: `cargo bench --bench numbers`.
//!
//! Three questions, each with the same work in both formats, in one run, on one thread.
//!
//! - *Rays*: one hierarchy over three knots, walked by the same code in `f32` and in `f64`, with the same camera rays. It is not
//!   Tusche's own traversal, which is `f32` throughout, but as plain in both formats: what differs is the format alone.
//! - *Columns*: the samples of shipped scenes, with columns rounded to half floats and back, through the line search and the
//!   film. Bytes are counted as if the columns were kept so; time is what turning them back takes.
//! - *Scripts*: two shipped shaders, written by hand in `f32` (with the bits of the interpreter: `cargo bench --bench kernels`
//!   checks that) and once more in `f64`.

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use half::f16;
use half::slice::HalfFloatSliceExt;
use tusche::files::FileStore;
use tusche::film::{FilmWindow, Layer, develop};
use tusche::line::{LineTile, Method, TileBounds, Window, find_lines};
use tusche::plan::Plan;
use tusche::sample::{Column, PixelRect, SampleBuffer};
use tusche::scene::{Scene, file};
use tusche::shade::{HitBatch, Host, Lighting, Shaders, synthetic};
use tusche::trace::{TileTracer, TraceContext, World};

fn main() {
    // `cargo test --all-targets` runs benchmarks too, without this flag.
    if !std::env::args().any(|argument| argument == "--bench") {
        return;
    }
    rays();
    columns();
    scripts();
}

/// The median seconds of five runs.
fn seconds(mut run: impl FnMut()) -> f64 {
    let mut all: Vec<f64> = (0..5)
        .map(|_| {
            let start = Instant::now();
            run();
            start.elapsed().as_secs_f64()
        })
        .collect();
    all.sort_by(f64::total_cmp);
    all[2]
}

fn load(text: &str) -> Scene {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/bench.toml"));
    let files = FileStore::new().with_file(path, text);
    file::load(path, &files, &[], &file::LoadOptions::default())
        .and_then(|(builder, _)| builder.build())
        .unwrap_or_else(|faults| panic!("{faults}"))
}

// Rays.

/// A box, and the first triangle of a leaf with one past its last, or the second child of a node whose first child follows it.
type Node<T> = ([[T; 3]; 2], Result<[u32; 2], u32>);

/// A hierarchy of boxes over triangles, halved at the median of the longest side, four triangles a leaf.
struct Tree {
    nodes: Vec<Node<f64>>,
    order: Vec<u32>,
}

impl Tree {
    fn new(triangles: &[[[f64; 3]; 3]]) -> Self {
        let mut tree = Self { nodes: Vec::new(), order: (0..triangles.len() as u32).collect() };
        let end = tree.order.len();
        tree.split(triangles, 0, end);
        tree
    }

    fn split(&mut self, triangles: &[[[f64; 3]; 3]], first: usize, end: usize) {
        let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for corner in self.order[first..end].iter().flat_map(|index| triangles[*index as usize]) {
            for axis in 0..3 {
                bounds[0][axis] = bounds[0][axis].min(corner[axis]);
                bounds[1][axis] = bounds[1][axis].max(corner[axis]);
            }
        }
        let place = self.nodes.len();
        self.nodes.push((bounds, Ok([first as u32, end as u32])));
        if end - first > 4 {
            let side = |axis: &usize| bounds[1][*axis] - bounds[0][*axis];
            let axis = (0..3).max_by(|a, b| side(a).total_cmp(&side(b))).unwrap_or_default();
            let middle = |index: &u32| triangles[*index as usize].iter().map(|corner| corner[axis]).sum::<f64>();
            let half = (end - first) / 2;
            self.order[first..end].select_nth_unstable_by(half, |a, b| middle(a).total_cmp(&middle(b)));
            self.split(triangles, first, first + half);
            self.nodes[place].1 = Err(self.nodes.len() as u32);
            self.split(triangles, first + half, end);
        }
    }
}

/// The same walk in either format.
macro_rules! walk {
    ($name:ident, $float:ty) => {
        mod $name {
            type F = $float;
            type V = [F; 3];

            pub struct Walk {
                nodes: Vec<super::Node<F>>,
                triangles: Vec<([V; 3], u32)>,
            }

            fn minus(a: V, b: V) -> V {
                [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
            }

            fn cross(a: V, b: V) -> V {
                [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
            }

            fn dot(a: V, b: V) -> F {
                a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
            }

            impl Walk {
                pub fn new(tree: &super::Tree, triangles: &[[[f64; 3]; 3]]) -> Self {
                    let point = |p: [f64; 3]| p.map(|x| x as F);
                    Self {
                        nodes: tree.nodes.iter().map(|(bounds, next)| (bounds.map(point), *next)).collect(),
                        triangles: tree
                            .order
                            .iter()
                            .map(|index| (triangles[*index as usize].map(point), *index))
                            .collect(),
                    }
                }

                /// The nearest triangle and its distance.
                pub fn closest(&self, origin: [f64; 3], direction: [f64; 3]) -> Option<(u32, f64)> {
                    let (origin, direction) = (origin.map(|x| x as F), direction.map(|x| x as F));
                    let inverse = direction.map(|x| 1.0 / x);
                    let (mut best, mut nearest) = (None, F::INFINITY);
                    let mut stack = [0_u32; 64];
                    let mut depth = 1;
                    while depth > 0 {
                        depth -= 1;
                        let at = stack[depth];
                        let (bounds, next) = &self.nodes[at as usize];
                        let (mut enter, mut leave): (F, F) = (0.0, nearest);
                        for axis in 0..3 {
                            let [a, b] = [0, 1].map(|side: usize| (bounds[side][axis] - origin[axis]) * inverse[axis]);
                            enter = enter.max(a.min(b));
                            leave = leave.min(a.max(b));
                        }
                        // Rounding must not lose a box: a few units in the last place of slack.
                        if enter > leave * (1.0 + 8.0 * F::EPSILON) {
                            continue;
                        }
                        match *next {
                            Err(second) => {
                                stack[depth] = second;
                                stack[depth + 1] = at + 1;
                                depth += 2;
                            }
                            Ok([first, end]) => {
                                for ([a, b, c], index) in &self.triangles[first as usize..end as usize] {
                                    let (u, v) = (minus(*b, *a), minus(*c, *a));
                                    let p = cross(direction, v);
                                    let scale = 1.0 / dot(u, p);
                                    let from = minus(origin, *a);
                                    let s = dot(from, p) * scale;
                                    let q = cross(from, u);
                                    let t = dot(direction, q) * scale;
                                    let distance = dot(v, q) * scale;
                                    if s >= 0.0 && t >= 0.0 && s + t <= 1.0 && distance > 0.0 && distance < nearest {
                                        (best, nearest) = (Some(*index), distance);
                                    }
                                }
                            }
                        }
                    }
                    Some((best?, nearest as f64))
                }
            }
        }
    };
}

walk!(single, f32);
walk!(double, f64);

fn rays() {
    let knot = "[[objects]]\nshape = \"knot\"\nsegments = [512, 34]\n";
    let scene = load(&format!(
        "{knot}translate = [-1.1, 0, 0]\n{knot}translate = [1.1, 0.2, 0.3]\nrotate = [40, 60, 0]\n\
         {knot}translate = [0, 0.9, -1.2]\nrotate = [80, 10, 30]\nscale = 1.3\n"
    ));
    // World space in double precision, relative to the camera, as in the renderer.
    let eye = scene.camera().position;
    let (mut triangles, mut owners) = (Vec::new(), Vec::new());
    for (owner, object) in scene.objects().iter().enumerate() {
        let mesh = &scene.meshes()[object.mesh.index()];
        for triangle in &mesh.triangles {
            triangles.push(triangle.map(|corner| {
                let place = mesh.positions[corner as usize].as_dvec3();
                (object.world_from_object.transform_point3(place) - eye).to_array()
            }));
            owners.push(owner);
        }
    }
    let tree = Tree::new(&triangles);
    let (single, double) = (single::Walk::new(&tree, &triangles), double::Walk::new(&tree, &triangles));
    const SIZE: [u32; 2] = [640, 360];
    let rays = scene.camera().rays(SIZE);
    let pixels = (0..SIZE[1] as i32).flat_map(|y| (0..SIZE[0] as i32).map(move |x| [x, y]));
    let rays: Vec<_> = pixels.map(|pixel| rays.ray(pixel, [0.5; 2]).1.as_dvec3().to_array()).collect();
    let all =
        |closest: &dyn Fn([f64; 3]) -> Option<(u32, f64)>| rays.iter().map(|ray| closest(*ray)).collect::<Vec<_>>();
    let (found, exact) = (all(&|ray| single.closest([0.0; 3], ray)), all(&|ray| double.closest([0.0; 3], ray)));
    let time = |closest: &dyn Fn([f64; 3]) -> Option<(u32, f64)>| {
        seconds(|| {
            black_box(all(closest));
        })
    };
    let (fast, slow) = (time(&|ray| single.closest([0.0; 3], ray)), time(&|ray| double.closest([0.0; 3], ray)));
    let owner = |hit: &Option<(u32, f64)>| hit.map(|(index, _)| owners[index as usize]);
    let pairs = || found.iter().zip(&exact);
    let other_triangle = pairs().filter(|(a, b)| a.map(|a| a.0) != b.map(|b| b.0)).count();
    let other_object = pairs().filter(|(a, b)| owner(a) != owner(b)).count();
    let mut errors: Vec<f64> = pairs()
        .filter_map(|(a, b)| Some(((*a)?, (*b)?)))
        .filter(|(a, b)| a.0 == b.0)
        .map(|(a, b)| (a.1 - b.1).abs() / b.1)
        .collect();
    errors.sort_by(f64::total_cmp);
    println!("Rays: {} triangles, {} camera rays.\n", triangles.len(), rays.len());
    println!("| | f32 | f64 |\n|---|---|---|");
    println!("| Mrays/s | {:.2} | {:.2} |", rays.len() as f64 * 1e-6 / fast, rays.len() as f64 * 1e-6 / slow);
    println!("| bytes of boxes and triangles | {} | {} |", bytes::<f32>(&tree), bytes::<f64>(&tree));
    println!("| rays that meet another triangle than in f64 | {other_triangle} | 0 |");
    println!("| rays that meet another object | {other_object} | 0 |");
    println!(
        "| relative error of the distance, median and greatest | {:.1e}, {:.1e} | 0 |\n",
        errors[errors.len() / 2],
        errors[errors.len() - 1]
    );
}

fn bytes<T>(tree: &Tree) -> usize {
    tree.nodes.len() * (6 * size_of::<T>() + 8) + tree.order.len() * (9 * size_of::<T>() + 4)
}

// Columns.

/// The columns that could be kept as half floats.
#[derive(Clone, Copy, PartialEq)]
enum Kept {
    Depth,
    Normal,
    Feature,
    Color,
    All,
}

fn rounded(x: f32) -> f32 {
    f16::from_f32(x).to_f32()
}

/// A column in halves, and how many bytes that spares.
fn in_halves<const N: usize>(column: &Column<[f32; N]>) -> (Column<[f32; N]>, usize) {
    let spared = if let Column::Values(values) = column { values.len() * N * 2 } else { 0 };
    (column.map(|value| value.map(rounded)), spared)
}

/// A buffer with some columns rounded to half floats, and how many bytes that spares.
fn halved(buffer: &SampleBuffer, kept: Kept) -> (SampleBuffer, usize) {
    let mut buffer = buffer.clone();
    let is = |what: Kept| kept == what || kept == Kept::All;
    let mut spared = 0;
    if is(Kept::Color) {
        let (column, bytes) = in_halves(&buffer.color);
        buffer.color = column;
        spared += bytes;
    }
    for nodes in &mut buffer.paths {
        if is(Kept::Depth) {
            let values = if let Column::Values(values) = &nodes.depth { values.len() } else { 0 };
            nodes.depth = nodes.depth.map(rounded);
            spared += values * 2;
        }
        if is(Kept::Normal) {
            let (column, bytes) = in_halves(&nodes.normal);
            nodes.normal = column;
            spared += bytes;
        }
        if is(Kept::Feature) {
            let (column, bytes) = in_halves(&nodes.feature);
            nodes.feature = column;
            spared += bytes;
        }
    }
    (buffer, spared)
}

fn columns() {
    println!("Columns: 320 px wide, 16 samples; what changes if a column is kept in half floats.\n");
    println!(
        "| scene | column | bytes/sample | lined samples that change | line coverage error | greatest change of a colour, of 255 |"
    );
    println!("|---|---|---|---|---|---|");
    let (mut searched, mut samples) = (0.0, 0);
    for name in ["fig1_robot", "fig2_crossings", "hello", "glass", "pencil"] {
        let path = format!("{}/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"));
        let scene = load(&std::fs::read_to_string(path).unwrap_or_else(|fault| panic!("{name}: {fault}")));
        let mut builder = scene.into_builder();
        let [width, height] = builder.render.size;
        builder.render.size = [320, 320 * height / width];
        builder.render.samples = 16;
        let scene = builder.build().unwrap_or_else(|faults| panic!("{faults}"));
        let (shaders, _) = Shaders::compile(&scene, &Host::new()).unwrap_or_else(|faults| panic!("{faults}"));
        let plan = Plan::new(&scene, &shaders, &[Layer::Rgba, Layer::Line]);
        let Some(lines) = plan.lines.as_ref().filter(|lines| !lines.scripted) else { continue };
        let transmissive: Vec<bool> = plan.materials.iter().map(|material| material.refracts).collect();
        let world = World::new(&scene, &transmissive);
        let lighting = Lighting::new(&scene, world.origin);
        let tracer = TileTracer::new(&scene, &plan, &world, &lighting);
        let rect = PixelRect::of_size(scene.render().size);
        let whole = tracer.trace(rect, &mut TraceContext::new(&scene, &shaders)).samples;
        let side = rect.width().max(rect.height()) as i32;
        let picture = |buffer: &SampleBuffer| {
            let bounds = TileBounds::new(buffer, &lines.rules);
            let tile = LineTile { buffer, bounds: &bounds };
            let found = find_lines(&Window::single(tile), tile, &lines.rules, Method::Exact, None);
            let window =
                FilmWindow { origin: [0, 0], tile: side, columns: 1, tiles: vec![Some((buffer, Some(&found)))] };
            (develop(&window, rect, &plan.filter, &plan.layers).channels, found.samples)
        };
        searched += seconds(|| {
            black_box(picture(&whole));
        });
        samples += whole.samples();
        let (expected, expected_lined) = picture(&whole);
        let of_all = whole.samples() as f64;
        for (kept, label) in [
            (Kept::Depth, "depth"),
            (Kept::Normal, "normal"),
            (Kept::Feature, "feature"),
            (Kept::Color, "color"),
            (Kept::All, "all four"),
        ] {
            let (buffer, spared) = halved(&whole, kept);
            if spared == 0 {
                continue;
            }
            let (channels, lined) = picture(&buffer);
            let changed = lined.iter().filter(|sample| expected_lined.binary_search(sample).is_err()).count()
                + expected_lined.iter().filter(|sample| lined.binary_search(sample).is_err()).count();
            // The layers are `rgba` and `line`: the alpha of the second is the coverage.
            let ink: f64 = expected[7].iter().map(|x| f64::from(*x)).sum();
            let wrong: f64 = expected[7].iter().zip(&channels[7]).map(|(a, b)| f64::from((a - b).abs())).sum();
            let shown = |x: f32| tusche::math::srgb_from_linear(x.clamp(0.0, 1.0)) * 255.0;
            let change = |axis: usize| {
                let pixels = expected[axis].iter().zip(&channels[axis]);
                pixels.map(|(a, b)| (shown(*a) - shown(*b)).abs()).fold(0.0, f32::max)
            };
            println!(
                "| {name} | {label} | {:.1} → {:.1} | {:.3} % | {:.3} % | {:.1} |",
                whole.bytes() as f64 / of_all,
                (whole.bytes() - spared) as f64 / of_all,
                100.0 * changed as f64 / (expected_lined.len() as f64).max(1.0),
                100.0 * wrong / ink.max(1e-9),
                change(0).max(change(1)).max(change(2))
            );
        }
    }
    const MANY: usize = 1 << 20;
    let values: Vec<f16> = (0..MANY).map(|i| f16::from_f32(i as f32 / 1000.0)).collect();
    let mut floats = vec![0.0_f32; MANY];
    let turned = seconds(|| values.convert_to_f32_slice(black_box(&mut floats)));
    println!(
        "\nTurning a half float back takes {:.2} ns a value; bounds, line search and film together {:.0} ns a sample.\n",
        turned * 1e9 / MANY as f64,
        searched * 1e9 / samples as f64
    );
}

// Scripts.

/// Two shaders by hand, in either format: the width and the first channel of a colour at every hit.
macro_rules! by_hand {
    ($name:ident, $float:ty) => {
        mod $name {
            use tusche::shade::HitBatch;
            type F = $float;

            fn luminance(color: [F; 3]) -> F {
                color[0] * 0.2126 + color[1] * 0.7152 + color[2] * 0.0722
            }

            fn lights(hits: &HitBatch, row: usize) -> impl Iterator<Item = ([F; 3], F)> {
                let normal = hits.normal[row].to_array().map(|x| x as F);
                hits.lights[row * hits.light_count..(row + 1) * hits.light_count].iter().map(move |light| {
                    let direction = light.direction.to_array().map(|x| x as F);
                    let facing = normal[0] * direction[0] + normal[1] * direction[1] + normal[2] * direction[2];
                    let visibility = light.visibility as F;
                    (light.radiance.to_array().map(|x| x as F * visibility), if facing > 0.0 { facing } else { 0.0 })
                })
            }

            pub fn cel(hits: &HitBatch, out: &mut Vec<[F; 2]>) {
                out.clear();
                for row in 0..hits.len {
                    let mut sum = [0.0; 3];
                    for (radiance, facing) in lights(hits, row) {
                        for axis in 0..3 {
                            sum[axis] += radiance[axis] * facing;
                        }
                    }
                    let brightness = luminance(sum);
                    let tone: F = if brightness < 0.15 {
                        0.0
                    } else if brightness < 0.6 {
                        0.6
                    } else {
                        1.0
                    };
                    let (shadow, paint): (F, F) = (0.35, 0.90);
                    out.push([2.0 * (1.4 - 0.4 * tone), shadow * paint * (1.0 - tone) + paint * tone]);
                }
            }

            pub fn light_driven_width(hits: &HitBatch, out: &mut Vec<[F; 2]>) {
                out.clear();
                for row in 0..hits.len {
                    let mut brightness: F = 0.0;
                    for (radiance, facing) in lights(hits, row) {
                        brightness += luminance(radiance) * facing;
                    }
                    let lit = brightness.clamp(0.0, 1.0);
                    out.push([5.0 * (1.0 - lit) + 0.5 * lit, 0.05 * (1.0 - lit) + 0.85 * lit]);
                }
            }
        }
    };
}

by_hand!(short, f32);
by_hand!(long, f64);

fn scripts() {
    const HITS: usize = 1 << 18;
    const BATCH: usize = 4096;
    let batches: Vec<HitBatch> = (0..HITS / BATCH).map(|seed| synthetic::hits(BATCH, seed as u64)).collect();
    println!("Scripts: {HITS} hits.\n");
    println!(
        "| shader | f32, ns | f64, ns | greatest difference of a width, px | of a colour | hits that fall into another band |"
    );
    println!("|---|---|---|---|---|---|");
    type Run<F> = fn(&HitBatch, &mut Vec<[F; 2]>);
    let shaders: [(&str, Run<f32>, Run<f64>); 2] =
        [("cel", short::cel, long::cel), ("light_driven_width", short::light_driven_width, long::light_driven_width)];
    for (name, short, long) in shaders {
        let (mut a, mut b) = (Vec::new(), Vec::new());
        let (mut greatest, mut other_band) = ([0.0_f64; 2], 0);
        for batch in &batches {
            short(batch, &mut a);
            long(batch, &mut b);
            for (a, b) in a.iter().zip(&b) {
                let differences = [0, 1].map(|i| (f64::from(a[i]) - b[i]).abs());
                if differences[0] > 0.1 {
                    other_band += 1;
                } else {
                    greatest = [0, 1].map(|i| greatest[i].max(differences[i]));
                }
            }
        }
        let time = |run: &mut dyn FnMut(&HitBatch)| {
            seconds(|| batches.iter().for_each(|batch| run(black_box(batch)))) * 1e9 / HITS as f64
        };
        let fast = time(&mut |batch| short(batch, black_box(&mut a)));
        let slow = time(&mut |batch| long(batch, black_box(&mut b)));
        println!("| {name} | {fast:.1} | {slow:.1} | {:.1e} | {:.1e} | {other_band} |", greatest[0], greatest[1]);
    }
}
