//! The same scene elsewhere and in other sizes, and huge ratios within one scene.

use tusche::film::Layer;
use tusche::math::{DAffine3, DVec3};
use tusche::render::RenderOptions;
use tusche::scene::Scene;
use tusche::scene::light::LightKind;

use super::Case;
use crate::common::{Picture, render_with, scene_from};

pub const CASES: &[Case] = &[
    Case {
        name: "a scene moved by 1e7, in steps that a double holds",
        wrong: "trembling lines far from the origin",
        unit: "values of a picture that differ",
        bound: 0.0,
        figure: || moved(DVec3::new(1e7, -1e7, 5e6)),
    },
    Case {
        name: "a scene moved by 1e7 and a bit",
        wrong: "trembling lines far from the origin",
        unit: "share of values off by more than 0.01",
        bound: 1e-3,
        figure: || moved(DVec3::new(1e7 + 0.1, -1e7 - 0.7, 5e6 + 0.3)),
    },
    Case {
        name: "scenes of size 1e-4 to 1e6",
        wrong: "lines that depend on the unit of length",
        unit: "share of values off by more than 0.01",
        bound: 1e-4,
        figure: || {
            [-4, -3, -2, -1, 1, 2, 3, 4, 5, 6].map(|power| resized(10_f64.powi(power))).into_iter().fold(0.0, f64::max)
        },
    },
    Case {
        name: "a 1 mm screw in the middle of 10 km of tilted ground",
        wrong: "a screw that floats or drowns",
        unit: "share of values off by more than 0.01",
        bound: 1e-3,
        figure: || screw(DVec3::ZERO),
    },
    Case {
        name: "the same, 4 km off the middle of the ground",
        wrong: "a screw that floats or drowns",
        unit: "share of values off by more than 0.01 (a float holds half a millimetre there)",
        bound: 2e-2,
        figure: || screw(DVec3::new(4000.0, 0.0, -1000.0)),
    },
];

const TEXT: &str = r#"
[render]
size = [96, 72]
samples = 4
[camera]
position = [2.5, 2.25, 5.0]
target = [0.0, 0.5, 0.0]
fov = 35.0
[lines]
width = 2.0
normal = 30.0
[materials.paint]
shader = "builtin:default"
[[lights]]
kind = "point"
position = [2.0, 4.0, 3.0]
strength = 60.0
[[objects]]
name = "floor"
shape = "plane"
size = [8.0, 8.0]
material = "paint"
[[objects]]
name = "ball"
shape = "sphere"
radius = 0.75
segments = [64, 32]
material = "paint"
translate = [0.5, 0.75, 0.25]
[[objects]]
name = "block"
shape = "box"
size = [1.0, 1.5, 1.0]
material = "paint"
translate = [-1.0, 0.75, 0.0]
[[objects]]
name = "ring"
shape = "torus"
segments = [64, 32]
material = "paint"
translate = [0.25, 1.5, -0.5]
rotate = [60.0, 10.0, 0.0]
"#;

/// A scene with each transform, camera and light taken through `world`, and lights `size` squared as strong.
fn changed(text: &str, world: DAffine3, size: f64) -> Scene {
    let mut builder = scene_from(text).into_builder();
    for object in &mut builder.objects {
        object.world_from_object = world * object.world_from_object;
    }
    for camera in &mut builder.cameras {
        camera.position = world.transform_point3(camera.position);
    }
    for light in &mut builder.lights {
        if let LightKind::Point { position, intensity } = &mut light.kind {
            *position = world.transform_point3(*position);
            *intensity *= (size * size) as f32;
        }
    }
    builder.build().unwrap_or_else(|faults| panic!("{faults}"))
}

fn drawn(scene: &Scene) -> Picture {
    render_with(scene, &[Layer::Rgba, Layer::Line], &RenderOptions::default()).0
}

fn share_off(a: &Picture, b: &Picture) -> f64 {
    super::differing(a, b, 0.01) as f64 / a.channels.iter().map(Vec::len).sum::<usize>() as f64
}

fn moved(by: DVec3) -> f64 {
    let (here, there) = (drawn(&scene_from(TEXT)), drawn(&changed(TEXT, DAffine3::from_translation(by), 1.0)));
    if by.fract() == DVec3::ZERO { super::differing(&here, &there, 0.0) as f64 } else { share_off(&here, &there) }
}

fn resized(by: f64) -> f64 {
    let scaled = changed(TEXT, DAffine3::from_scale(DVec3::splat(by)), by);
    share_off(&drawn(&scene_from(TEXT)), &drawn(&scaled))
}

/// A screw (head and shank) on tilted ground, with its shadow: on 10 km of it against on 10 cm of it.
fn screw(at: DVec3) -> f64 {
    let text = r#"
[render]
size = [96, 72]
samples = 4
[camera]
position = [0.003, 0.006, 0.005]
target = [0.0, 0.0, 0.0]
fov = 25.0
[materials.paint]
shader = "builtin:default"
[[lights]]
kind = "sun"
direction = [-0.5, -1.0, -0.2]
[[objects]]
name = "ground"
shape = "plane"
size = [0.1, 0.1]
segments = [100, 100]
material = "paint"
[[objects]]
name = "shank"
shape = "cylinder"
radius = 0.0003
height = 0.001
material = "paint"
[[objects]]
name = "head"
shape = "box"
size = 0.001
material = "paint"
translate = [0.0, 0.0007, 0.0]
"#;
    let tilt = DAffine3::from_rotation_z(0.35) * DAffine3::from_rotation_x(0.1);
    // In the plane of the ground.
    let at = tilt.transform_point3(at);
    let picture = |stretch: f64, middle: DVec3| {
        let mut builder = scene_from(text).into_builder();
        for object in &mut builder.objects[1..] {
            object.world_from_object = DAffine3::from_translation(at) * tilt * object.world_from_object;
        }
        let ground =
            DAffine3::from_translation(middle) * tilt * DAffine3::from_scale(DVec3::new(stretch, 1.0, stretch));
        builder.objects[0].world_from_object = ground;
        builder.cameras[0].position += at;
        drawn(&builder.build().unwrap_or_else(|faults| panic!("{faults}")))
    };
    share_off(&picture(1.0, at), &picture(1e5, DVec3::ZERO))
}
