//! How wide a pixel is where its ray arrives: straight on, in mirrors, and through glass.

use crate::common::{Picture, render_with, root};
use tusche::files::FileStore;
use tusche::film::Layer;
use tusche::math::{DMat3, DVec3};

const SIZE: usize = 32;

/// Renders a scene whose shaders `show` (the footprint as a colour) and `mirror` are at hand.
fn rendered(objects: &str) -> Picture {
    let path = root().join("scenes/test.toml");
    let text = format!(
        "[render]\nsize = [{SIZE}, {SIZE}]\nsamples = 1\nfilter = \"box\"\nfilter_radius = 0.5\n\
         [camera]\nfov = 20.0\nposition = [0, 0, 5]\ntarget = [0, 0, 0]\n[lines]\nwidth = 0\n\
         [materials.show]\nshader = \"show.rhai\"\n[materials.mirror]\nshader = \"mirror.rhai\"\n{objects}"
    );
    let mirror = "fn surface(hit, p) { #{ base_color: 1.0, metallic: 1.0, roughness: 0.0, line_width: 0.0 } }";
    let files = FileStore::new()
        .with_file(&path, text)
        .with_file(
            root().join("scenes/show.rhai"),
            "fn surface(hit, p) { #{ color: gray(hit.footprint), line_width: 0 } }",
        )
        .with_file(root().join("scenes/mirror.rhai"), mirror);
    let loaded = tusche::scene::file::load(&path, &files, &[], &Default::default());
    let (builder, _) = loaded.unwrap_or_else(|faults| panic!("{faults}"));
    let scene = builder.build().unwrap_or_else(|faults| panic!("{faults}"));
    render_with(&scene, &[Layer::Color], &Default::default()).0
}

/// Width of a pixel per unit of distance at the middle of the picture.
fn spread() -> f64 {
    2.0 * 10.0_f64.to_radians().tan() / SIZE as f64
}

#[track_caller]
fn assert_close(found: f32, expected: f64, tolerance: f64) {
    let ratio = f64::from(found) / expected;
    assert!((ratio - 1.0).abs() < tolerance, "{found} instead of {expected}, {ratio} times");
}

const MIDDLE: usize = SIZE / 2;

#[test]
fn straight_on_it_grows_with_the_distance() {
    let wall = rendered(
        "[[objects]]\nshape = \"plane\"\nsize = 100\nrotate = [90, 0, 0]\ntranslate = [0, 0, -3]\nmaterial = \"show\"\n",
    );
    assert_close(wall.at(0, MIDDLE, MIDDLE), 8.0 * spread(), 1e-2);
}

#[test]
fn flat_mirrors_unfold() {
    let mirrored = rendered(
        "[[objects]]\nshape = \"plane\"\nsize = 100\nrotate = [90, 0, 0]\nmaterial = \"mirror\"\n\
         [[objects]]\nshape = \"plane\"\nsize = 100\nrotate = [90, 0, 0]\ntranslate = [0, 0, 12]\nmaterial = \"show\"\n",
    );
    let straight = rendered(
        "[[objects]]\nshape = \"plane\"\nsize = 100\nrotate = [90, 0, 0]\ntranslate = [0, 0, -12]\nmaterial = \"show\"\n",
    );
    for pixel in [3, MIDDLE, SIZE - 2] {
        let (found, expected) = (mirrored.at(0, pixel, pixel), straight.at(0, pixel, pixel));
        assert_close(found, f64::from(expected), 1e-5);
    }
}

/// The ray through a film position (pixels, from the top left), as origin and direction.
fn camera_ray(x: f64, y: f64) -> (DVec3, DVec3) {
    let scale = spread();
    let middle = SIZE as f64 / 2.0;
    (DVec3::Z * 5.0, DVec3::new((x - middle) * scale, (middle - y) * scale, -1.0).normalize())
}

/// The mean width of the beam of a pixel after `bend` has changed its rays, `far` along the ray in the pixel's middle.
fn beam(x: f64, y: f64, bend: impl Fn((DVec3, DVec3)) -> (DVec3, DVec3), far: f64) -> f64 {
    let h = 1e-4;
    let at = |dx: f64, dy: f64| {
        let (origin, direction) = bend(camera_ray(x + dx, y + dy));
        origin + direction * far
    };
    let (_, direction) = bend(camera_ray(x, y));
    let (across, down) = ((at(h, 0.0) - at(-h, 0.0)) / (2.0 * h), (at(0.0, h) - at(0.0, -h)) / (2.0 * h));
    DMat3::from_cols(across, down, direction).determinant().abs().sqrt()
}

/// Where a ray meets the unit ball, the nearer or the farther way.
fn meet((origin, direction): (DVec3, DVec3), farther: bool) -> DVec3 {
    let b = origin.dot(direction);
    let root = (b * b - origin.length_squared() + 1.0).sqrt();
    origin + direction * (-b + if farther { root } else { -root })
}

#[test]
fn balls_that_mirror_widen_the_beam() {
    let picture = rendered(
        "[[objects]]\nshape = \"sphere\"\nsegments = 256\nmaterial = \"mirror\"\n\
         [[objects]]\nshape = \"sphere\"\nradius = 50\nsegments = 256\nmaterial = \"show\"\n",
    );
    let mirror = |ray: (DVec3, DVec3)| {
        let place = meet(ray, false);
        (place, ray.1 - place * (2.0 * place.dot(ray.1)))
    };
    // From the middle to three quarters of the ball's radius.
    for pixel in [MIDDLE, MIDDLE + 4, MIDDLE + 8, MIDDLE + 11] {
        let (x, y) = (pixel as f64 + 0.5, MIDDLE as f64 + 0.5);
        let (origin, direction) = mirror(camera_ray(x, y));
        let b = origin.dot(direction);
        let far = -b + (b * b - origin.length_squared() + 2500.0).sqrt();
        // The sample lies somewhere in its pixel, which changes the width by as much as neighbouring pixels differ.
        let neighbours = [beam(x - 0.5, y, mirror, far), beam(x + 0.5, y, mirror, far)];
        let slack = (neighbours[0] / neighbours[1] - 1.0).abs();
        assert_close(picture.at(0, pixel, MIDDLE), beam(x, y, mirror, far), 0.03 + slack);
    }
}
