//! Glass at the ends of its parameters.

use tusche::film::Layer;
use tusche::math::Vec3;
use tusche::render::RenderOptions;
use tusche::shade::Bsdf;

use super::Case;
use crate::common::{Picture, render_with, scripted_scene};

pub const CASES: &[Case] = &[
    Case {
        name: "around the critical angle, float by float",
        wrong: "bright or black rings in glass",
        unit: "faults in 4 000 bounces",
        bound: 0.0,
        figure: critical_angle,
    },
    Case {
        name: "an ior of exactly 1",
        wrong: "a ghost of the body",
        unit: "largest error of a colour",
        bound: 1e-5,
        figure: || ghost("1.0"),
    },
    Case {
        name: "an ior of 1 + 1e-6",
        wrong: "a ghost of the body, or total reflection at its rim",
        unit: "largest error of a colour",
        bound: 2e-2,
        figure: || ghost("1.000001"),
    },
    Case {
        name: "an ior of 0, −1.5, NaN or ∞",
        wrong: "NaN pixels",
        unit: "values that differ from ior 1.5, or are not finite",
        bound: 0.0,
        figure: senseless_ior,
    },
    Case {
        name: "an ior of 1e-30 or 1e30",
        wrong: "NaN pixels",
        unit: "values that are not finite",
        bound: 0.0,
        figure: || ["1e-30", "1e30"].map(|ior| super::not_finite(&ball(ior)) as f64).iter().sum(),
    },
    Case {
        name: "two glass blocks that touch",
        wrong: "a dark wall where they touch",
        unit: "mean error of a colour, against one block",
        bound: 1e-4,
        figure: touching_blocks,
    },
    Case {
        name: "two glass blocks that touch, in either order",
        wrong: "glass that changes with the order of the scene file",
        unit: "values that differ",
        bound: 0.0,
        figure: touching_in_any_order,
    },
    Case {
        name: "a ball in a liquid of its own index",
        wrong: "a ghost of the ball",
        unit: "mean error of a colour, against the liquid alone",
        bound: 1e-4,
        figure: || mean_error(&in_liquid(""), &in_liquid(&format!("{BALL}material = \"glass\"\n"))),
    },
    Case {
        name: "a liquid that overlaps its glass of higher `dielectric_priority`",
        wrong: "a film of the wrong medium along the wall",
        unit: "mean error of a colour, against a liquid that just touches it",
        bound: 1e-4,
        figure: overlapping_liquid,
    },
    Case {
        name: "a camera in a liquid, before a ball of its index",
        wrong: "a ghost of the ball",
        unit: "mean error of a colour, against the liquid alone",
        bound: 1e-4,
        figure: camera_in_liquid,
    },
    Case {
        name: "a camera inside glass",
        wrong: "black, or bent as if it were outside",
        unit: "values that are not finite, or black",
        bound: 0.0,
        figure: camera_inside,
    },
];

fn critical_angle() -> f64 {
    let glass = Bsdf {
        base_color: Vec3::ONE,
        metallic: 0.0,
        roughness: 0.0,
        specular: 1.0,
        ior: 1.5,
        transmission: 1.0,
        normal: Vec3::Z,
        occlusion: 1.0,
        outside: false,
        surrounding: 1.0,
    };
    let mut faults = 0;
    let mut sine = 2.0_f32 / 3.0;
    for _ in 0..2000 {
        sine = sine.next_down();
    }
    for _ in 0..4000 {
        sine = sine.next_up();
        let incoming = Vec3::new(sine, 0.0, -(1.0 - sine * sine).sqrt());
        let bounces = glass.bounces(incoming, Vec3::Z);
        let total = bounces.reflection + bounces.refraction;
        let finite = bounces.reflection.is_finite() && bounces.refraction.is_finite();
        let whole = (total.x - 1.0).abs() < 1e-5;
        let bent = bounces.refraction == Vec3::ZERO
            || (bounces.refracted.is_normalized() && bounces.refracted.z < 0.0 && bounces.refracted.x > 0.99);
        let mirrored = glass.mirror_direction(incoming, Vec3::Z);
        faults += u32::from(!(finite && whole && bent && mirrored.is_normalized() && mirrored.z > 0.0));
    }
    f64::from(faults)
}

const HEAD: &str = r#"
[render]
size = [48, 36]
samples = 4
background = { bottom = [0.1, 0.2, 0.3], top = [0.9, 0.8, 0.7] }
ambient = 0.0
[lines]
object = false
shader = false
[camera]
position = [0.0, 0.5, 5.0]
target = [0.0, 0.0, 0.0]
fov = 35.0
"#;

fn glass(ior: &str) -> String {
    format!("#{{ base_color: rgb(1.0, 1.0, 1.0), roughness: 0.0, transmission: 1.0, ior: {ior} }}")
}

fn drawn(objects: &str, script: &str) -> Picture {
    let scene = scripted_scene(&format!("{HEAD}{objects}"), &[("glass", script)]);
    render_with(&scene, &[Layer::Rgba], &RenderOptions::default()).0
}

fn ball(ior: &str) -> Picture {
    drawn("[[objects]]\nshape = \"sphere\"\nsegments = [64, 32]\nmaterial = \"glass\"\n", &glass(ior))
}

/// The background alone against a ball before it that should not be seen.
fn ghost(ior: &str) -> f64 {
    let away = "[[objects]]\nshape = \"sphere\"\nmaterial = \"glass\"\ntranslate = [0.0, 0.0, 50.0]\n";
    let nothing = drawn(away, &glass(ior));
    super::largest_difference(&nothing, &ball(ior))
}

fn senseless_ior() -> f64 {
    let usual = ball("1.5");
    let picture = |ior: &str| super::differing(&usual, &ball(ior), 0.0) + super::not_finite(&ball(ior));
    ["0.0", "-1.5", "0.0 / 0.0", "1.0 / 0.0"].map(|ior| picture(ior) as f64).iter().sum()
}

/// A block that stands along the x axis turned by 30° about y.
fn block(name: &str, width: f64, along: f64) -> String {
    let (sine, cosine) = 30_f64.to_radians().sin_cos();
    format!(
        "[[objects]]\nname = \"{name}\"\nshape = \"box\"\nsize = [{width}, 1.5, 1.5]\nmaterial = \"glass\"\n\
         translate = [{}, 0.0, {}]\nrotate = [0.0, 30.0, 0.0]\n",
        along * cosine,
        -along * sine
    )
}

/// Two blocks side by side against one of the same outer shape.
fn touching_blocks() -> f64 {
    let one = drawn(&block("one", 2.0, 0.0), &glass("1.5"));
    let two = drawn(&format!("{}{}", block("left", 1.0, -0.5), block("right", 1.0, 0.5)), &glass("1.5"));
    mean_error(&one, &two)
}

fn mean_error(one: &Picture, two: &Picture) -> f64 {
    let values = one.channels.iter().flatten().zip(two.channels.iter().flatten());
    values.map(|(a, b)| f64::from((a - b).abs())).sum::<f64>() / one.channels.iter().map(Vec::len).sum::<usize>() as f64
}

fn touching_in_any_order() -> f64 {
    let (left, right) = (block("left", 1.0, -0.5), block("right", 1.0, 0.5));
    let pictures = [format!("{left}{right}"), format!("{right}{left}")].map(|objects| drawn(&objects, &glass("1.5")));
    super::differing(&pictures[0], &pictures[1], 0.0) as f64
}

const BALL: &str = "[[objects]]\nshape = \"sphere\"\nsegments = [64, 32]\nradius = 0.6\n";

/// A block of liquid of index 1.33, and what else is in the picture; the material `glass` has the same index.
fn in_liquid(objects: &str) -> Picture {
    let text = format!(
        "{HEAD}[[objects]]\nshape = \"box\"\nsize = [2.0, 1.6, 1.8]\nmaterial = \"liquid\"\nrotate = [0.0, 30.0, 0.0]\n{objects}"
    );
    let scene = scripted_scene(&text, &[("glass", &glass("1.33")), ("liquid", &glass("1.33"))]);
    render_with(&scene, &[Layer::Rgba], &RenderOptions::default()).0
}

fn camera_inside() -> f64 {
    let head = HEAD.replace("[0.0, 0.5, 5.0]", "[0.0, 0.1, 0.5]");
    let text = format!("{head}[[objects]]\nshape = \"sphere\"\nsegments = [64, 32]\nmaterial = \"glass\"\n");
    let scene = scripted_scene(&text, &[("glass", &glass("1.5"))]);
    let picture = render_with(&scene, &[Layer::Rgba], &RenderOptions::default()).0;
    let black = (0..picture.channels[0].len()).filter(|&index| picture.channels[0][index] <= 0.0).count();
    (super::not_finite(&picture) + black) as f64
}

/// A liquid between two panes: cut to touch them, or reaching halfway into them.
fn overlapping_liquid() -> f64 {
    let picture = |width: f64| {
        let text = format!(
            "{HEAD}{}{}{}",
            block("left pane", 0.3, -0.65),
            block("right pane", 0.3, 0.65),
            block("liquid", width, 0.0).replace("\"glass\"", "\"liquid\"").replace("1.5, 1.5", "1.3, 1.3"),
        );
        let scene = scripted_scene(&text, &[("glass", &glass("1.5")), ("liquid", &glass("1.33"))]);
        let mut builder = scene.into_builder();
        for material in &mut builder.materials {
            material.dielectric_priority = i32::from(material.name == "glass");
        }
        let scene = builder.build().unwrap_or_else(|faults| panic!("{faults}"));
        render_with(&scene, &[Layer::Rgba], &RenderOptions::default()).0
    };
    mean_error(&picture(1.0), &picture(1.3))
}

fn camera_in_liquid() -> f64 {
    let picture = |ball: &str| {
        let head = HEAD.replace("[0.0, 0.5, 5.0]", "[0.0, 0.1, 0.85]");
        let text = format!(
            "{head}[[objects]]\nshape = \"box\"\nsize = 2.0\nmaterial = \"glass\"\nrotate = [0.0, 30.0, 0.0]\n{ball}"
        );
        let scene = scripted_scene(&text, &[("glass", &glass("1.33"))]);
        render_with(&scene, &[Layer::Rgba], &RenderOptions::default()).0
    };
    mean_error(&picture(""), &picture(&format!("{BALL}material = \"glass\"\n")))
}
