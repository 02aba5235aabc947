//! The overlap test on shapes whose folds are known (`[lines] overlap`).

use tusche::film::Layer;
use tusche::line::{Fired, LineType, Method, Rules};
use tusche::math::{DAffine3, Vec3};
use tusche::render::RenderOptions;
use tusche::sample::{Node, PixelRect};
use tusche::scene::Scene;
use tusche::scene::mesh::Mesh;
use tusche::scene::settings::LineSettings;

use super::picture::{Tiles, covered_area, layout, sampled};
use crate::common::{render_with, scene_from};

const WIDTH: f32 = 4.0;

fn settings(overlap: f32) -> LineSettings {
    LineSettings { object: false, shader: false, overlap: Some(overlap), ..Default::default() }
}

/// A node of the object whose surface has this place and normal. The world's unit is a pixel where `footprint` is 1.
fn surface(position: Vec3, normal: Vec3, footprint: f32, depth: f32) -> Node {
    Node {
        object: 1,
        shader: 1,
        depth,
        line_width: WIDTH,
        priority: 0,
        position: position.to_array(),
        geometric_normal: normal.normalize().to_array(),
        footprint,
        ..Node::default()
    }
}

/// How many samples of a picture see a line, which all must be overlaps; both methods agree.
fn lined(side: i32, settings: &LineSettings, node: &dyn Fn([f32; 2]) -> Node) -> usize {
    let rules = Rules::new(settings, 4);
    let layout = layout(4, settings.max_width);
    let rect = PixelRect { x0: -side, y0: -side, x1: side, y1: side };
    let tiles = Tiles::new(rect, 32, &rules, |tile| sampled(tile, &layout, node));
    let [exact, brute] = [Method::Exact, Method::Brute].map(|method| {
        let mut all = tiles.lines(method);
        all.iter_mut().for_each(|lines| lines.counts.pairs_tested = 0);
        all
    });
    assert_eq!(exact, brute);
    assert!(exact.iter().flat_map(|lines| &lines.lines).all(|line| line.fired == Fired::OVERLAP));
    exact.iter().map(|lines| lines.lines.len()).sum()
}

/// Seen from far away.
fn orthographic_ball(radius: f32, [x, y]: [f32; 2]) -> Option<(Vec3, Vec3)> {
    let z = radius * radius - x * x - y * y;
    (z > 0.0).then(|| {
        let place = Vec3::new(x, y, z.sqrt());
        (place, place)
    })
}

#[test]
fn a_ball_has_no_lines_within_its_limb() {
    for radius in [3.0, 10.0, 45.0, 1000.0] {
        let ball = |at| match orthographic_ball(radius, at) {
            Some((place, normal)) => surface(place, normal, 1.0, 2000.0 - place.z),
            None => Node::default(),
        };
        assert_eq!(lined(48, &settings(0.05), &ball), 0, "radius {radius}");
        // In perspective, from two radii away, over nearly the whole picture.
        let ball = |[x, y]: [f32; 2]| {
            let spread = 0.5 / 45.0;
            let direction = Vec3::new(x * spread, y * spread, -1.0).normalize();
            let center = Vec3::new(0.0, 0.0, -3.0 * radius);
            let along = direction.dot(center);
            let inside = radius * radius - (center - direction * along).length_squared();
            if inside <= 0.0 {
                return Node::default();
            }
            let depth = along - inside.sqrt();
            surface(direction * depth, direction * depth - center, spread * depth, depth)
        };
        assert_eq!(lined(48, &settings(0.05), &ball), 0, "radius {radius} in perspective");
    }
}

#[test]
fn planes_have_no_lines_at_any_angle() {
    for degrees in [0.0_f64, 45.0, 80.0, 89.0, 89.9, 89.99] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let normal = Vec3::new(sin as f32, 0.0, cos as f32);
        let plane = |[x, y]: [f32; 2]| {
            let z = -f64::from(x) * sin / cos;
            surface(Vec3::new(x, y, z as f32), normal, 1.0, 1e6 - z as f32)
        };
        assert_eq!(lined(32, &settings(2.0), &plane), 0, "{degrees} degrees");
        // A floor that runs to the horizon of a perspective camera one unit above it.
        let floor = |[x, y]: [f32; 2]| {
            let spread = (90.0 - degrees).to_radians().tan() as f32 / 16.0;
            if y < 0.5 {
                return Node::default();
            }
            let direction = Vec3::new(x * spread, -y * spread, -1.0);
            let place = direction / -direction.y;
            surface(place, Vec3::Y, spread * place.length(), place.length())
        };
        assert_eq!(lined(32, &settings(2.0), &floor), 0, "{degrees} degrees, floor");
    }
}

/// Edges that stick out and edges that lie in, with one side seen at a grazing angle: a wall of 200 in 2 pixels.
#[test]
fn edges_are_no_overlaps() {
    let steep = Vec3::new(100.0, 0.0, 1.0);
    for (flat, sign) in [(Vec3::Z, 1.0), (Vec3::Z, -1.0)] {
        let edge = |[x, y]: [f32; 2]| match x {
            x if x < 0.0 => surface(Vec3::new(x, y, 0.0), flat, 1.0, 500.0),
            x => {
                let z = -100.0 * x * sign;
                surface(Vec3::new(x, y, z), steep * Vec3::new(sign, 1.0, 1.0), 1.0, 500.0 - z)
            }
        };
        assert_eq!(lined(16, &settings(2.0), &edge), 0, "sign {sign}");
    }
}

#[test]
fn a_step_draws_where_it_is_higher_than_the_threshold_times_the_distance() {
    let step = |height: f32| {
        move |[x, y]: [f32; 2]| {
            let z = if x < 0.25 { 0.0 } else { height };
            surface(Vec3::new(x, y, z), Vec3::Z, 1.0, 100.0 - z)
        }
    };
    let area = |height: f32, overlap: f32| {
        let rect = PixelRect { x0: -8, y0: 0, x1: 8, y1: 16 };
        covered_area(rect, &settings(overlap), 64, &step(height)) / 16.0
    };
    // The whole width, within sampling error, where the step is high enough for the farthest neighbour.
    assert!((area(4.5, 2.0) - f64::from(WIDTH)).abs() < 0.1, "{}", area(4.5, 2.0));
    // Neighbours up to 1.5 px are found: a line of twice that.
    assert!((area(3.0, 2.0) - 3.0).abs() < 0.15, "{}", area(3.0, 2.0));
    assert_eq!(area(1.99, 2.0), 0.0);
    // The footprint is the unit.
    let fine = |at: [f32; 2]| Node { footprint: 0.25, ..step(1.2)(at) };
    assert!(lined(8, &settings(2.0), &fine) > 0);
    assert_eq!(lined(8, &settings(2.0), &step(1.2)), 0);
}

/// A ball before a wall: as two objects, and as one that folds over itself.
#[test]
fn a_fold_is_found_as_fully_as_a_silhouette() {
    let seen = |ball: u32| {
        move |at: [f32; 2]| match orthographic_ball(20.0, at) {
            Some((place, normal)) => {
                Node { object: ball, ..surface(place + Vec3::Z * 40.0, normal, 1.0, 60.0 - place.z) }
            }
            None => surface(Vec3::new(at[0], at[1], 0.0), Vec3::new(0.5, 0.2, 1.0), 1.0, 100.0),
        }
    };
    let rect = PixelRect { x0: -32, y0: -32, x1: 32, y1: 32 };
    let objects = LineSettings { object: true, ..settings(1e9) };
    let silhouette = covered_area(rect, &objects, 16, &seen(2));
    let fold = covered_area(rect, &settings(2.0), 16, &seen(1));
    assert!((0.98..=1.0).contains(&(fold / silhouette)), "{fold} of {silhouette} square pixels");
    // Between two objects the test does not apply.
    assert_eq!(lined(32, &settings(2.0), &seen(2)), 0);
}

#[test]
fn a_miss_takes_no_part_and_other_tests_are_told_apart() {
    let half = |at: [f32; 2]| match at[0] {
        x if x < 0.0 => Node::default(),
        x => surface(Vec3::new(x, at[1], 0.0), Vec3::Z, 1.0, 10.0),
    };
    assert_eq!(lined(8, &settings(0.0), &half), 0);
    assert_eq!(LineType::of(Fired::OVERLAP | Fired::NORMAL | Fired::SHADER), Some(LineType::Overlap));
    assert_eq!(LineType::of(Fired::OVERLAP | Fired::OBJECT), Some(LineType::Silhouette));
}

/// A sheet bent into waves, as a mesh of flat quads.
fn waves() -> Mesh {
    let (along, across) = (240_u32, 8_u32);
    let mut mesh = Mesh { name: "waves".into(), ..Mesh::default() };
    for i in 0..=along {
        for j in 0..=across {
            let x = 6.0 * (i as f32 / along as f32 - 0.5);
            let y = 2.0 * (j as f32 / across as f32 - 0.5);
            mesh.positions.push(Vec3::new(x, y, 0.35 * (4.0 * x).sin()));
        }
    }
    for i in 0..along {
        for j in 0..across {
            let corner = |di: u32, dj: u32| (i + di) * (across + 1) + j + dj;
            mesh.triangles.push([corner(0, 0), corner(1, 0), corner(1, 1)]);
            mesh.triangles.push([corner(0, 0), corner(1, 1), corner(0, 1)]);
        }
    }
    mesh
}

/// One object seen by a camera, without any test but that of overlaps.
fn scene(camera: &str, object: &str) -> Scene {
    scene_from(&format!(
        "[render]\nsize = [96, 96]\nsamples = 1\nfilter = \"box\"\nfilter_radius = 0.5\n[camera]\n{camera}\n\
         [lines]\nobject = false\nshader = false\noverlap = 2.0\n[materials.ink]\nshader = \"builtin:ink\"\n\
         params = {{ ink_width = 6.0 }}\n{object}"
    ))
}

/// Checks a picture of one object with one sample per pixel against its depths: all lines lie at folds. Returns the number
/// of lined pixels, and of those without a line beside which the depth jumps far. `unit` is the world size of a pixel at a
/// depth. Lines reach farther than the samples of adjacent pixels can be apart.
fn check_folds(scene: &Scene, unit: impl Fn(f32) -> f32) -> [usize; 2] {
    let layers = [Layer::LineType(LineType::Overlap), Layer::Line, Layer::Depth];
    let (picture, _) = render_with(scene, &layers, &RenderOptions::default());
    let brute = RenderOptions { method: Method::Brute, ..RenderOptions::default() };
    assert!(picture.bits() == render_with(scene, &layers, &brute).0.bits(), "brute force");
    let (width, height) = (picture.width, picture.height);
    let (mut count, mut missed) = (0, 0);
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let depth = picture.at(8, x, y);
        assert_eq!(picture.at(3, x, y), picture.at(7, x, y), "other lines at {x}, {y}");
        // The largest jump of depth towards a pixel within reach, in pixels.
        let jump = |reach: usize| {
            let around = |at: usize, most: usize| at.saturating_sub(reach)..=(at + reach).min(most - 1);
            around(y, height)
                .flat_map(|y| around(x, width).map(move |x| (x, y)))
                .map(|(x, y)| (picture.at(8, x, y) - depth).abs() / unit(depth))
                .filter(|jump| jump.is_finite())
                .fold(0.0, f32::max)
        };
        let is_lined = picture.at(3, x, y) > 0.0;
        count += usize::from(is_lined);
        if is_lined {
            assert!(jump(4) > 2.0, "a line without a fold at {x}, {y}: the depths differ by {} px", jump(4));
        } else if depth.is_finite() && jump(1) >= 25.0 {
            missed += 1;
        }
    }
    [count, missed]
}

#[test]
fn the_folds_of_a_torus_are_found() {
    let torus = "[[objects]]\nshape = \"torus\"\nmaterial = \"ink\"\n";
    let fine = &format!("{torus}segments = 512\n");
    let camera = "projection = \"orthographic\"\nheight = 2.4\nposition = [0.0, 2.0, 5.0]";
    let [lined, missed] = check_folds(&scene(camera, torus), |_| 2.4 / 96.0);
    assert!(lined > 50 && missed == 0, "{missed} missed, {lined} lined");
    let [lined, missed] = check_folds(&scene(camera, fine), |_| 2.4 / 96.0);
    assert!(lined > 50 && missed == 0, "{missed} missed, {lined} lined");
    let camera = "fov = 30.0\nposition = [0.0, 2.0, 4.0]";
    let spread = 2.0 * 15.0_f32.to_radians().tan() / 96.0;
    let [lined, missed] = check_folds(&scene(camera, fine), |depth| spread * depth);
    assert!(lined > 50 && missed == 0, "{missed} missed, {lined} lined");
    // From above nothing is covered.
    let camera = "projection = \"orthographic\"\nheight = 2.4\nposition = [0.0, 5.0, 0.0]\nup = [0.0, 0.0, -1.0]";
    assert_eq!(check_folds(&scene(camera, torus), |_| 2.4 / 96.0)[0], 0);
}

#[test]
fn the_folds_of_a_wavy_sheet_are_found_and_vanish_from_above() {
    let with_waves = |camera: &str| {
        let mut builder = scene(camera, "[[objects]]\nshape = \"sphere\"\nmaterial = \"ink\"\n").into_builder();
        builder.objects[0].mesh = builder.add_mesh(waves());
        builder.objects[0].world_from_object = DAffine3::IDENTITY;
        builder.build().expect("the sheet is sound")
    };
    let camera = "projection = \"orthographic\"\nheight = 2.4\nposition = [9.0, 0.3, 5.0]";
    let [lined, missed] = check_folds(&with_waves(camera), |_| 2.4 / 96.0);
    assert!(lined > 200 && missed == 0, "{missed} missed, {lined} lined");
    let camera = "projection = \"orthographic\"\nheight = 2.4\nposition = [0.0, 0.3, 9.0]";
    assert_eq!(check_folds(&with_waves(camera), |_| 2.4 / 96.0)[0], 0);
}

#[test]
fn convex_meshes_have_no_overlaps_however_coarse() {
    let camera = "fov = 35.0\nposition = [1.0, 2.0, 3.5]";
    for shape in ["sphere", "box", "cylinder", "cone", "capsule", "disc"] {
        for segments in ["", "segments = 8\n"].iter().filter(|segments| shape != "box" || segments.is_empty()) {
            let object = format!("[[objects]]\nshape = \"{shape}\"\n{segments}material = \"ink\"\n");
            assert_eq!(check_folds(&scene(camera, &object), |_| 1.0)[0], 0, "{shape} {segments}");
        }
    }
}

/// A mirror above which a torus or a ball stands, seen in the mirror alone.
#[test]
fn folds_are_found_in_mirrors() {
    let mirrored = |shape: &str| {
        let text = format!(
            "[render]\nsize = [96, 96]\nsamples = 4\n[camera]\nfov = 25.0\nposition = [0.0, 4.0, 6.0]\n\
             [lines]\nobject = false\nshader = false\noverlap = 2.0\npaths = [\"camera\", \"reflection\"]\n\
             [materials.ink]\nshader = \"builtin:ink\"\n[materials.mirror]\nshader = \"builtin:mirror\"\n\
             [[objects]]\nshape = \"plane\"\nsize = 8\nmaterial = \"mirror\"\nlines = false\n\
             [[objects]]\nshape = \"{shape}\"\ntranslate = [0.0, 1.2, 0.0]\nrotate = [65.0, 0.0, 0.0]\nscale = 0.8\n\
             material = \"ink\"\nvisible_to = [\"reflection\"]\n"
        );
        let layers = [Layer::LineType(LineType::Overlap), Layer::LinePath(tusche::film::LinePath::Reflection)];
        let (picture, _) = render_with(&scene_from(&text), &layers, &RenderOptions::default());
        assert_eq!(picture.channels[3], picture.channels[7], "all are seen in the mirror");
        picture.mean(3)
    };
    assert!(mirrored("torus") > 0.001, "{}", mirrored("torus"));
    assert_eq!(mirrored("sphere"), 0.0);
}
