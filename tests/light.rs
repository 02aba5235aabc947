//! Light against physics with known answers: lamps, shadows, mirrors, glass, backgrounds, and surfaces that are not there.

use std::f64::consts::PI;
use std::io::Cursor;

use tusche::files::FileStore;
use tusche::film::Layer;
use tusche::math::{DAffine3, DVec3};
use tusche::plan::Plan;
use tusche::render::{RenderOptions, Report};
use tusche::sample::{NodePath, PixelRect, SampleBuffer};
use tusche::scene::{Scene, file};
use tusche::shade::{Host, Lighting, Shaders};
use tusche::trace::{TileTracer, TraceContext, World};

use crate::common::{Picture, render_with, root, scripted_scene as scene};

/// One sample that looks along −z at the origin, from 5 units away.
const PROBE: &str = r#"
    [camera]
    position = [0.0, 0.0, 5.0]
    target = [0.0, 0.0, 0.0]
    fov = 0.01
"#;
/// A wall whose front is the plane z = 0.
const WALL: &str =
    "[[objects]]\nshape = \"box\"\nsize = [4.0, 4.0, 2.0]\ntranslate = [0.0, 0.0, -1.0]\nmaterial = \"m\"\n";
const CHALK: &str = "#{ base_color: 1.0, specular: 0.0 }";

fn probe(background: &str) -> String {
    format!("[render]\nsize = [1, 1]\nsamples = 1\n{background}\n{PROBE}")
}

fn ball(settings: &str) -> String {
    format!(
        "[render]\nsize = [20, 20]\nsamples = 4\nfilter = \"box\"\nfilter_radius = 0.5\n{settings}\n[camera]\n\
         position = [0.0, 0.0, 5.0]\ntarget = [0.0, 0.0, 0.0]\nfov = 26.0\n\
         [[objects]]\nshape = \"sphere\"\nmaterial = \"m\"\nsegments = [128, 64]\n"
    )
}

fn render(text: &str, shaders: &[(&str, &str)], layers: &[Layer]) -> (Picture, Report) {
    render_with(&scene(text, shaders), layers, &RenderOptions::default())
}

/// The mean colour and alpha of a picture without lines.
fn color(text: &str, shaders: &[(&str, &str)]) -> [f64; 4] {
    let picture = render(text, shaders, &[Layer::Color]).0;
    [0, 1, 2, 3].map(|channel| picture.mean(channel))
}

/// The samples of a whole picture.
fn samples(scene: &Scene, layers: &[Layer]) -> SampleBuffer {
    let (shaders, _) = Shaders::compile(scene, &Host::new()).unwrap_or_else(|faults| panic!("{faults}"));
    let plan = Plan::new(scene, &shaders, layers);
    let transmissive: Vec<bool> = plan.materials.iter().map(|material| material.refracts).collect();
    let world = World::new(scene, &transmissive);
    let lighting = Lighting::new(scene, world.origin);
    let tracer = TileTracer::new(scene, &plan, &world, &lighting);
    tracer.trace(PixelRect::of_size(scene.render().size), &mut TraceContext::new(scene, &shaders)).samples
}

#[track_caller]
fn close(actual: f64, truth: f64, tolerance: f64) {
    assert!((actual - truth).abs() <= tolerance, "{actual} instead of {truth}");
}

// Furnaces: in surroundings of one colour, what absorbs nothing cannot be told from them.

#[test]
fn white_surfaces_vanish_in_white_surroundings() {
    let white = ball("background = [1.0, 1.0, 1.0]\nambient = 1.0");
    for roughness in [0.0, 0.1, 0.5, 1.0] {
        for specular in [0.0, 0.5, 1.0] {
            let script = format!("#{{ base_color: 1.0, roughness: {roughness:.1}, specular: {specular:.1} }}");
            let picture = render(&white, &[("m", &script)], &[Layer::Color]).0;
            for value in &picture.channels[0] {
                // What weighs less than the least throughput is left out.
                assert!((0.997..=1.00001).contains(value), "roughness {roughness}, specular {specular}: {value}");
            }
        }
    }
}

#[test]
fn metals_give_back_no_more_than_they_get() {
    let white = ball("background = [1.0, 1.0, 1.0]\nambient = 1.0");
    for roughness in [0.0, 0.1, 0.5, 1.0] {
        let script = format!("#{{ base_color: 1.0, metallic: 1.0, roughness: {roughness:.1} }}");
        let picture = render(&white, &[("m", &script)], &[Layer::Color]).0;
        for value in &picture.channels[0] {
            assert!((0.4..1.021).contains(value), "roughness {roughness}: {value}");
        }
    }
}

#[test]
fn a_mirror_shows_the_surroundings_times_its_tint() {
    let text = ball("background = [0.8, 0.5, 0.2]\nambient = 1.0");
    let white = render(&text, &[("m", "#{ base_color: 1.0, metallic: 1.0, roughness: 0.0 }")], &[Layer::Color]).0;
    for (channel, truth) in [0.8, 0.5, 0.2].into_iter().enumerate() {
        for value in &white.channels[channel] {
            close(f64::from(*value), truth, 1e-5);
        }
    }
    let wall = format!("{}{WALL}", probe("background = [0.8, 0.5, 0.2]\nambient = 1.0"));
    let tinted = color(&wall, &[("m", "#{ base_color: rgb(0.5, 0.25, 1.0), metallic: 1.0, roughness: 0.0 }")]);
    for (channel, truth) in [0.4, 0.125, 0.2].into_iter().enumerate() {
        close(tinted[channel], truth, 1e-5);
    }
}

#[test]
fn clear_glass_vanishes_in_white_surroundings() {
    let glass = [("m", "#{ base_color: 1.0, roughness: 0.0, transmission: 1.0 }")];
    let text = ball("background = [1.0, 1.0, 1.0]\nambient = 0.0\nreflection_depth = 10\nrefraction_depth = 10");
    let picture = render(&text, &glass, &[Layer::Color]).0;
    close(picture.mean(0), 1.0, 0.01);
    for value in &picture.channels[0] {
        assert!((0.98..=1.0001).contains(value), "{value}");
    }
}

#[test]
fn light_that_cannot_leave_a_body_stays_in_it() {
    // From inside a block, at 50° to one pair of faces and 40° to another: totally reflected by the first (41.8° is
    // critical), partly by the second.
    let text = r#"
        [render]
        size = [1, 1]
        samples = 1
        background = [1.0, 1.0, 1.0]
        ambient = 0.0
        reflection_depth = 20
        refraction_depth = 4
        [camera]
        position = [0.0, 0.0, 0.0]
        target = [0.6428, 0.0, 0.7660]
        fov = 0.01
        [[objects]]
        shape = "box"
        size = [2.0, 2.0, 4.0]
        material = "m"
    "#;
    for specular in ["0.0", "1.0"] {
        let script = format!("#{{ base_color: 1.0, roughness: 0.0, transmission: 1.0, specular: {specular} }}");
        let (picture, report) = render(text, &[("m", &script)], &[Layer::Color]);
        close(picture.mean(0), 1.0, 0.003);
        assert!(report.stats.rays.reflection > 0, "the first face is beyond the critical angle");
    }
}

#[test]
fn glass_that_does_not_bend_light_is_as_if_absent() {
    let text = ball("background = { bottom = [0.1, 0.2, 0.3], top = [0.9, 0.8, 0.7] }\nambient = 0.0");
    let glass =
        render(&text, &[("m", "#{ base_color: 1.0, roughness: 0.0, transmission: 1.0, ior: 1.0 }")], &[Layer::Color]);
    let absent = render(&text, &[("m", "#{ opacity: 0.0 }")], &[Layer::Color]).0;
    for (a, b) in glass.0.channels.iter().flatten().zip(absent.channels.iter().flatten()) {
        close(f64::from(*a), f64::from(*b), 1e-5);
    }
    assert_eq!(glass.1.stats.rays.reflection, 0);
}

// Lamps.

#[test]
fn a_sun_lights_by_the_cosine() {
    for degrees in [0.0_f64, 30.0, 60.0, 85.0, 95.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let sun = format!("[[lights]]\nkind = \"sun\"\ndirection = [{:.9}, 0.0, {:.9}]\nstrength = 3.0\n", -sin, -cos);
        let radiance = color(&format!("{}{WALL}{sun}", probe("ambient = 0.0")), &[("m", CHALK)])[0];
        close(radiance, 3.0 / PI * cos.max(0.0), 1e-5);
    }
}

#[test]
fn a_point_light_falls_off_with_the_square_of_the_distance() {
    for distance in [0.25, 1.0, 3.0, 1000.0] {
        let lamp = format!("[[lights]]\nkind = \"point\"\nposition = [0.0, 0.0, {distance:.9}]\nstrength = 3.0\n");
        let radiance = color(&format!("{}{WALL}{lamp}", probe("ambient = 0.0")), &[("m", CHALK)])[0];
        let truth = 3.0 / PI / (distance * distance);
        close(radiance, truth, truth * 1e-3);
    }
}

#[test]
fn a_spot_light_falls_off_between_its_cones() {
    let cos = |degrees: f64| degrees.to_radians().cos();
    let between = (cos(25.0) - cos(30.0)) / (cos(20.0) - cos(30.0));
    for (degrees, share) in [(0.0_f64, 1.0), (19.9, 1.0), (25.0, between * between), (30.1, 0.0), (120.0, 0.0)] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let lamp = format!(
            "[[lights]]\nkind = \"spot\"\nposition = [0.0, 0.0, 2.0]\ndirection = [{sin:.9}, 0.0, {:.9}]\n\
             cone_angle = 60.0\ninner_angle = 40.0\nstrength = 4.0\n",
            -cos
        );
        let radiance = color(&format!("{}{WALL}{lamp}", probe("ambient = 0.0")), &[("m", CHALK)])[0];
        close(radiance, share / PI, 1e-3);
    }
}

#[test]
fn lights_at_the_surface_and_out_of_reach_harm_nothing() {
    for position in ["[0.0, 0.0, 0.0]", "[0.0, 0.0, 1e-22]", "[0.0, 0.0, 1e12]"] {
        let lamp =
            format!("[[lights]]\nkind = \"point\"\nposition = {position}\nstrength = 1.0\ncolor = [1.0, 0.0, 1.0]\n");
        let (picture, report) =
            render(&format!("{}{WALL}{lamp}", probe("ambient = 0.0")), &[("m", CHALK)], &[Layer::Color]);
        assert!(picture.channels.iter().flatten().all(|value| value.is_finite()));
        assert_eq!((report.stats.gate.nan, picture.at(1, 0, 0)), (0, 0.0), "{position}");
    }
}

// Shadows.

/// The share of a sun's light that passes flat objects above what the camera sees.
fn passed(script: &str, heights: &[f64], more: &str) -> f64 {
    let (sin, cos) = 60.0_f64.to_radians().sin_cos();
    let sun = format!("[[lights]]\nkind = \"sun\"\ndirection = [0.0, {:.9}, {:.9}]\n", -sin, -cos);
    let sheets: String = heights
        .iter()
        .map(|height| {
            let [y, z] = [height * sin, height * cos];
            format!(
                "[[objects]]\nshape = \"plane\"\nsize = [1.0, 0.5]\nmaterial = \"sheet\"\n\
                 translate = [0.1, {y:.9}, {z:.9}]\n{more}\n"
            )
        })
        .collect();
    let text = |sheets: &str| format!("{}{WALL}{sun}{sheets}", probe("ambient = 0.0"));
    let shaders = [("m", CHALK), ("sheet", script)];
    color(&text(&sheets), &shaders)[0] / color(&text(""), &shaders)[0]
}

#[test]
fn shadows_are_as_dark_as_what_casts_them() {
    for (script, share) in [
        ("#{}", 0.0),
        ("#{ opacity: 0.5 }", 0.5),
        ("#{ opacity: 0.0 }", 1.0),
        ("#{ opacity: if hit.path_kind == \"shadow\" { 0.25 } else { 1.0 } }", 0.75),
        ("#{ transmission: 0.75 }", 0.75),
        ("#{ transmission: 1.0, metallic: 1.0 }", 0.0),
        ("#{ transmission: 1.0, opacity: 0.5 }", 1.0),
        // A final colour is no glass.
        ("#{ transmission: 1.0, color: if hit.position.y > 0.0 { 1.0 } else { () } }", 0.0),
        // NaN is no opacity, and the default is opaque.
        ("#{ opacity: (hit.depth - hit.depth) / 0.0 }", 0.0),
        // So is a surface whose script fails.
        ("#{ opacity: 0.5, emission: [0.0][hit.object_id] }", 0.0),
    ] {
        close(passed(script, &[2.0], ""), share, 1e-6);
    }
    close(passed("#{ opacity: 0.5 }", &[1.5, 2.0, 2.5], ""), 0.125, 1e-6);
    close(passed("#{}", &[2.0], "visible_to = [\"camera\"]"), 1.0, 0.0);
}

#[test]
fn nothing_behind_a_lamp_casts_a_shadow() {
    let lamp = "[[lights]]\nkind = \"point\"\nposition = [0.0, 0.0, 1.0]\nstrength = 1.0\n";
    let lid = |z: f64| {
        format!(
            "[[objects]]\nshape = \"box\"\nsize = [1.0, 1.0, 0.01]\ntranslate = [0.0, 0.0, {z}]\nmaterial = \"m\"\nvisible_to = [\"shadow\"]\n"
        )
    };
    let radiance = |z| color(&format!("{}{WALL}{lamp}{}", probe("ambient = 0.0"), lid(z)), &[("m", CHALK)])[0];
    close(radiance(1.1), 1.0 / PI, 1e-5);
    close(radiance(0.9), 0.0, 0.0);
}

// What mirrors and glass show.

/// A mirror at 45° in the origin, and a wall to the right, 3 units away.
fn periscope(wall: &str) -> String {
    format!(
        "{}[[objects]]\nname = \"mirror\"\nshape = \"box\"\nsize = [4.0, 4.0, 0.2]\nrotate = [0.0, 45.0, 0.0]\n\
         translate = [-0.0707106781, 0.0, -0.0707106781]\nmaterial = \"mirror\"\n\
         [[objects]]\nname = \"wall\"\nshape = \"box\"\nsize = [0.2, 4.0, 4.0]\ntranslate = [3.1, 0.0, 0.0]\n\
         material = \"wall\"\n{wall}\n",
        probe("background = [0.0, 0.0, 1.0]")
    )
}
const MIRROR: (&str, &str) = ("mirror", "#{ base_color: rgb(0.5, 0.25, 1.0), metallic: 1.0, roughness: 0.0 }");
const PLACE: (&str, &str) = ("wall", "#{ color: hit.position }");

/// What the mirror of the periscope reflects: Schlick's term at 45° whitens its tint a little.
fn mirror_weight() -> [f64; 3] {
    let fresnel = (1.0 - 0.5_f64.sqrt()).powi(5);
    [0.5, 0.25, 1.0].map(|tint| tint + (1.0 - tint) * fresnel)
}

#[test]
fn a_mirror_shows_what_is_there_and_how_far_it_is() {
    let buffer = samples(&scene(&periscope(""), &[MIRROR, PLACE]), &[Layer::Rgba]);
    let reflected = &buffer.paths[1];
    assert_eq!((buffer.paths.len(), reflected.path), (2, NodePath::CAMERA.reflected()));
    assert_eq!((reflected.object.get(0), reflected.shader.get(0)), (2, 2));
    close(f64::from(reflected.depth.get(0)), 8.0, 2e-3);
    close(f64::from(buffer.color.get(0)[0]), mirror_weight()[0] * 3.0, 1e-5);
    for (channel, weight) in reflected.throughput.get(0).into_iter().enumerate() {
        close(f64::from(weight), mirror_weight()[channel], 1e-5);
    }
}

#[test]
fn objects_are_seen_by_the_rays_they_are_visible_to() {
    let seen = |visible_to: &str| color(&periscope(visible_to), &[MIRROR, ("wall", "#{ color: rgb(1.0, 0.0, 0.0) }")]);
    close(seen("")[0], 0.5, 0.01);
    close(seen("visible_to = [\"reflection\"]")[0], 0.5, 0.01);
    close(seen("visible_to = [\"camera\", \"refraction\", \"shadow\"]")[0], 0.0, 0.0);
    let wall = |visible_to: &str| {
        color(&format!("{}{WALL}{visible_to}", probe("background = [0.0, 0.0, 0.0]")), &[("m", "#{ color: 1.0 }")])[0]
    };
    close(wall(""), 1.0, 0.0);
    close(wall("visible_to = [\"reflection\", \"refraction\", \"shadow\"]"), 0.0, 0.0);
}

#[test]
fn beyond_the_depth_limit_mirrors_are_black() {
    let facing = |depth: u32| {
        let text = periscope("").replace("[render]", &format!("[render]\nreflection_depth = {depth}"));
        render(&text, &[MIRROR, ("wall", "#{ color: 1.0 }")], &[Layer::Color])
    };
    let (picture, report) = facing(0);
    assert_eq!((picture.at(0, 0, 0), report.stats.rays.reflection), (0.0, 0));
    assert!(facing(1).0.at(0, 0, 0) > 0.4);
}

#[test]
fn a_slab_of_glass_shifts_what_lies_behind() {
    let text = r#"
        [render]
        size = [1, 1]
        samples = 1
        [camera]
        projection = "orthographic"
        height = 1e-5
        position = [0.0, 0.0, 5.0]
        target = [0.0, 0.0, 0.0]
        [[objects]]
        shape = "box"
        size = [6.0, 6.0, 1.0]
        rotate = [0.0, 30.0, 0.0]
        material = "glass"
        [[objects]]
        shape = "plane"
        size = [20.0, 20.0]
        rotate = [90.0, 0.0, 0.0]
        translate = [0.0, 0.0, -8.0]
        material = "wall"
    "#;
    for ior in [1.0_f64, 1.33, 1.5, 2.4] {
        let glass = format!("#{{ base_color: 1.0, roughness: 0.0, transmission: 1.0, specular: 0.0, ior: {ior:.2} }}");
        let [x, y, z, _] = color(text, &[("glass", &glass), PLACE]);
        let (sin, cos) = 30.0_f64.to_radians().sin_cos();
        let shift = sin * (1.0 - cos / (ior * ior - sin * sin).sqrt());
        close(x, -shift, 1e-4);
        close(y, 0.0, 1e-4);
        close(z, -8.0, 1e-4);
    }
}

#[test]
fn reflected_lines_are_tinted_and_composed_as_asked() {
    // The mirror shows the middle of the upper edge of the wall, whose line is wider than the picture.
    let lined = |lines: &str| {
        let text = periscope("").replace("translate = [3.1, 0.0, 0.0]", "translate = [3.1, -2.0, 0.0]");
        let text = text.replace("size = [1, 1]", "size = [9, 9]").replace("samples = 1\n", "samples = 4\n");
        let text = format!("{text}[lines]\ncolor = [1.0, 0.5, 0.25]\nwidth = 32.0\nmax_width = 32.0\n{lines}\n");
        let picture = render(&text, &[MIRROR, ("wall", "#{ color: 1.0 }")], &[Layer::Rgba]).0;
        [0, 1, 2].map(|channel| f64::from(picture.at(channel, 4, 4)))
    };
    let weight = mirror_weight();
    let line = [1.0, 0.5, 0.25];
    let luminance = weight[0] * 0.2126 + weight[1] * 0.7152 + weight[2] * 0.0722;
    for channel in 0..3 {
        close(lined("tint = true")[channel], line[channel] * weight[channel], 1e-4);
        close(lined("tint = false")[channel], line[channel], 1e-4);
        close(lined("compose = \"throughput\"")[channel], line[channel] * weight[channel], 1e-4);
        close(lined("compose = \"throughput\"\ntint = false")[channel], line[channel] * luminance, 1e-4);
    }
    // Without it, half of the middle pixel shows the wall and half the blue background.
    close(lined("paths = [\"camera\"]")[0], 0.5 * weight[0], 0.25 * weight[0]);
}

// Backgrounds and coverage.

fn looking(direction: [f64; 3], background: &str) -> [f64; 4] {
    let [x, y, z] = direction;
    color(
        &format!(
            "[render]\nsize = [1, 1]\nsamples = 1\nbackground = {background}\n[camera]\nposition = [0.0, 0.0, 0.0]\n\
             target = [{x:.9}, {y:.9}, {z:.9}]\nup = [0.1, 0.9, 0.2]\nfov = 0.01\n"
        ),
        &[],
    )
}

#[test]
fn a_gradient_goes_by_the_height_of_the_direction() {
    let gradient = "{ bottom = [0.2, 0.0, 0.0], top = [0.8, 0.0, 1.0] }";
    for height in [-1.0_f64, -0.5, 0.0, 0.3, 1.0] {
        let along = (1.0 - height * height).sqrt();
        let seen = looking([along * 0.6, height, along * 0.8], gradient);
        close(seen[0], 0.5 + 0.3 * height, 1e-4);
        close(seen[2], 0.5 + 0.5 * height, 1e-4);
        close(seen[3], 1.0, 0.0);
    }
}

#[test]
fn a_background_image_lies_around_the_scene() {
    // Eight pixels, each with its number in the bits of its colour.
    let image = image::RgbImage::from_fn(4, 2, |x, y| {
        let number = y * 4 + x;
        image::Rgb([0, 1, 2].map(|bit| if number >> bit & 1 == 1 { 255 } else { 0 }))
    });
    let mut png = Cursor::new(Vec::new());
    image.write_to(&mut png, image::ImageFormat::Png).expect("a picture in memory can be written");
    let path = root().join("scenes/around.png");
    for number in 0..8_u32 {
        // The middle of −z is the middle of the image; to the right of it lies +x.
        let turn = (f64::from(number % 4) + 0.5) / 4.0 * 2.0 * PI - PI;
        let polar = (f64::from(number / 4) + 0.5) / 2.0 * PI;
        let [x, y, z] = [polar.sin() * turn.sin(), polar.cos(), -polar.sin() * turn.cos()];
        let text = format!(
            "[render]\nsize = [1, 1]\nsamples = 1\nbackground = {{ image = \"around.png\", strength = 2.0 }}\n[camera]\n\
             position = [0.0, 0.0, 0.0]\ntarget = [{x:.9}, {y:.9}, {z:.9}]\nfov = 0.01\n"
        );
        let scene_path = root().join("scenes/light_test.toml");
        let files = FileStore::new().with_file(&scene_path, text).with_file(&path, png.get_ref().clone());
        let (builder, _) = file::load(&scene_path, &files, &[], &file::LoadOptions::default())
            .unwrap_or_else(|faults| panic!("{faults}"));
        let scene = builder.build().unwrap_or_else(|faults| panic!("{faults}"));
        let picture = render_with(&scene, &[Layer::Color], &RenderOptions::default()).0;
        for bit in 0..3 {
            close(picture.mean(bit), if number >> bit & 1 == 1 { 2.0 } else { 0.0 }, 1e-3);
        }
    }
}

#[test]
fn alpha_is_what_covers_a_transparent_background() {
    let alpha = |background: &str, script: &str, sheets: usize, more: &str| {
        let sheets: String = (0..sheets)
            .map(|index| {
                format!(
                    "[[objects]]\nshape = \"plane\"\nrotate = [90.0, 0.0, 0.0]\ntranslate = [0.0, 0.0, -{index}.0]\n\
                     material = \"m\"\n"
                )
            })
            .collect();
        color(&format!("{}{sheets}", probe(&format!("background = {background}\n{more}"))), &[("m", script)])[3]
    };
    for (script, sheets, more, truth) in [
        ("#{}", 0, "", 0.0),
        ("#{}", 1, "", 1.0),
        ("#{ opacity: 0.5 }", 1, "", 0.5),
        ("#{ opacity: 0.5 }", 2, "", 0.75),
        ("#{ opacity: 0.5, color: 1.0 }", 2, "", 0.75),
        ("#{ opacity: 0.0 }", 3, "", 0.0),
        // What a see-through mirror reflects covers nothing.
        ("#{ opacity: 0.5, metallic: 1.0, roughness: 0.0 }", 1, "", 0.5),
        ("#{ transmission: 1.0, roughness: 0.0 }", 1, "", 1.0),
        ("#{ opacity: 0.5 }", 3, "refraction_depth = 1", 0.75),
    ] {
        close(alpha("\"transparent\"", script, sheets, more), truth, 1e-6);
        close(alpha("[0.5, 0.5, 0.5]", script, sheets, more), 1.0, 1e-6);
    }
    // Too thin to send a ray on, but not a hole in the picture.
    close(alpha("[0.5, 0.5, 0.5]", "#{ opacity: 0.999 }", 1, ""), 1.0, 1e-6);
}

// Surfaces that are not there.

const ALL_LAYERS: [Layer; 8] =
    [Layer::Rgba, Layer::Color, Layer::Line, Layer::Depth, Layer::Normal, Layer::Position, Layer::Uv, Layer::Object];

#[test]
fn invisible_surfaces_are_as_if_absent_to_the_last_bit() {
    let light = "[[lights]]\nkind = \"sun\"\ndirection = [-1.0, -2.0, -1.5]\n\
                 [[objects]]\nshape = \"plane\"\nsize = [6.0, 6.0]\ntranslate = [0.0, -0.8, 0.0]\nmaterial = \"floor\"\n";
    // Around the ball, exactly on it, through it, and exactly on the floor.
    let absent = "[[objects]]\nshape = \"sphere\"\nradius = 1.5\nmaterial = \"nothing\"\n\
                  [[objects]]\nshape = \"sphere\"\nsegments = [128, 64]\nmaterial = \"nothing\"\n\
                  [[objects]]\nshape = \"torus\"\nmaterial = \"nothing\"\n\
                  [[objects]]\nshape = \"plane\"\nsize = [6.0, 6.0]\ntranslate = [0.0, -0.8, 0.0]\nmaterial = \"nothing\"\n";
    let shaders = [
        ("m", "#{ base_color: rgb(0.8, 0.5, 0.2), roughness: 0.4, line_width: 3.0 }"),
        ("floor", "#{ base_color: 0.5, metallic: 1.0, roughness: 0.0 }"),
        ("nothing", "#{ opacity: 0.0, line_width: 8.0 }"),
    ];
    let text = ball("");
    let without = render(&format!("{text}{light}"), &shaders, &ALL_LAYERS).0;
    let with = render(&format!("{text}{light}{absent}"), &shaders, &ALL_LAYERS).0;
    assert!(with.bits() == without.bits());
}

#[test]
fn rays_pass_two_hundred_and_fifty_six_invisible_layers() {
    let layers = |count: usize| {
        let sheets: String = (0..count)
            .map(|_| "[[objects]]\nshape = \"plane\"\nrotate = [90.0, 0.0, 0.0]\nmaterial = \"nothing\"\n")
            .collect();
        let text = format!("{}{WALL}{sheets}", probe("background = [0.0, 1.0, 0.0]"));
        color(&text, &[("m", "#{ color: rgb(1.0, 0.0, 0.0) }"), ("nothing", "#{ opacity: 0.0 }")])
    };
    // All lie at the depth of the wall, which is the first object: it must be found before them.
    close(layers(300)[0], 1.0, 0.0);
    let behind = |count: usize| {
        let sheets: String = (0..count)
            .map(|_| "[[objects]]\nshape = \"plane\"\nrotate = [90.0, 0.0, 0.0]\ntranslate = [0.0, 0.0, 1.0]\nmaterial = \"nothing\"\n")
            .collect();
        let text = format!("{}{WALL}{sheets}", probe("background = [0.0, 1.0, 0.0]"));
        color(&text, &[("m", "#{ color: rgb(1.0, 0.0, 0.0) }"), ("nothing", "#{ opacity: 0.0 }")])
    };
    close(behind(255)[0], 1.0, 0.0);
    close(behind(257)[1], 1.0, 0.0);
}

#[test]
fn the_script_the_object_and_the_material_choose_the_priority_in_this_order() {
    let priority = |script: &str, object: &str, material: &str| {
        let text = format!("{}{WALL}{object}", probe(""));
        let mut builder = scene(&text, &[("m", script)]).into_builder();
        builder.materials[0].priority = material.parse().ok();
        let scene = builder.build().unwrap_or_else(|faults| panic!("{faults}"));
        samples(&scene, &[Layer::Rgba]).paths[0].priority.get(0)
    };
    assert_eq!(priority("#{ priority: 3 }", "priority = 2", "1"), 3);
    assert_eq!(priority("#{ priority: if hit.depth > 9.0 { 3 } else { () } }", "priority = 2", "1"), 2);
    assert_eq!(priority("#{}", "priority = 2", "1"), 2);
    assert_eq!(priority("#{}", "", "1"), 1);
    assert_eq!(priority("#{}", "", ""), 0);
    assert_eq!(priority("#{}", "priority = -5", "1"), -5);
}

#[test]
fn objects_without_lines_draw_none() {
    let width = |lines: &str| {
        let text = format!("{}{WALL}{lines}\n[[objects]]\nshape = \"plane\"\n", probe(""));
        samples(&scene(&text, &[("m", "#{ line_width: 3.0 }")]), &[Layer::Rgba]).paths[0].line_width.get(0)
    };
    assert_eq!((width("lines = true"), width("lines = false")), (3.0, 0.0));
}

// What scripts and scenes must not be able to break.

#[test]
fn nan_from_scripts_reaches_no_pixel_and_is_laid_to_the_right_account() {
    let nan = "(hit.depth - hit.depth) / 0.0";
    let sun = "[[lights]]\nkind = \"sun\"\ndirection = [-1.0, -1.0, -1.0]\n";
    for output in [
        "base_color",
        "metallic",
        "roughness",
        "specular",
        "ior",
        "transmission",
        "opacity",
        "emission",
        "occlusion",
        "color",
        "feature",
        "line_color",
        "line_width",
    ] {
        for rest in ["", ", transmission: 0.5, roughness: 0.0", ", metallic: 0.5, roughness: 0.0, opacity: 0.5"] {
            let rest = if rest.contains(&format!("{output}:")) { "" } else { rest };
            let script = format!("#{{ {output}: {nan}{rest} }}");
            let (picture, _) = render(&format!("{}{sun}", ball("")), &[("m", &script)], &[Layer::Rgba, Layer::Color]);
            assert!(picture.channels.iter().flatten().all(|value| value.is_finite()), "{script}");
        }
    }
    for normal in
        ["vec3(0.0, 0.0, 0.0)", "hit.normal * 0.0 / 0.0", "-hit.normal", "hit.normal * 1e30", "hit.normal * 1e-30"]
    {
        let script = format!("#{{ normal: {normal}, transmission: 0.5, roughness: 0.0 }}");
        let (picture, report) = render(&format!("{}{sun}", ball("")), &[("m", &script)], &[Layer::Color]);
        assert!(picture.channels.iter().flatten().all(|value| value.is_finite()), "{script}");
        assert_eq!(report.stats.gate.nan, 0, "{script}");
    }
    // Seen in a mirror, it is the wall's fault.
    let script = format!("#{{ emission: {nan} }}");
    let (_, report) = render(&periscope(""), &[MIRROR, ("wall", &script)], &[Layer::Color]);
    let told = report.warnings.to_string();
    assert!(told.contains("`wall`") && !told.contains("`mirror`"), "{told}");
}

#[test]
fn a_surface_whose_script_fails_shines_magenta_whatever_the_script_writes() {
    let failing = "#{ base_color: [0.5][hit.object_id], line_color: 0.0 }";
    let text = format!("{}{WALL}", probe("background = [0.0, 0.0, 0.0]"));
    let scene = scene(&text, &[("m", failing)]);
    let (picture, report) = render_with(&scene, &[Layer::Rgba], &RenderOptions::default());
    assert_eq!([0, 1, 2].map(|channel| picture.at(channel, 0, 0)), [1.0, 0.0, 1.0]);
    assert!(report.script_errors.has_errors());
    assert_eq!(samples(&scene, &[Layer::Rgba]).paths[0].line_width.get(0), 0.0);
}

#[test]
fn absurd_scenes_make_pictures() {
    let deep = "reflection_depth = 15\nrefraction_depth = 15";
    // A tree of rays that could gain light would not end.
    let branching = "#{ base_color: 9.0, metallic: 0.5, roughness: 0.0, transmission: 1.0, opacity: 0.5, ior: 1.2 }";
    let wall = format!("{}{WALL}", probe("background = \"transparent\""));
    let mut scenes = vec![
        scene(&probe(""), &[]),
        scene(&wall, &[("m", "#{}")]),
        scene(&ball(deep).replace("[20, 20]", "[6, 6]"), &[("m", branching)]),
    ];
    for scale in
        [[0.0; 3], [1.0, 0.0, 1.0], [1e-37; 3], [1e-38; 3], [1e-42; 3], [1e30; 3], [1e38; 3], [1e18, 1e-18, 1.0]]
    {
        for script in ["#{}", branching] {
            let mut builder = scene(&wall, &[("m", script)]).into_builder();
            builder.objects[0].world_from_object = DAffine3::from_scale(DVec3::from(scale));
            scenes.push(builder.build().unwrap_or_else(|faults| panic!("{faults}")));
        }
    }
    for (index, scene) in scenes.iter().enumerate() {
        let (picture, report) = render_with(scene, &ALL_LAYERS, &RenderOptions::default());
        assert!(picture.channels.iter().flatten().all(|value| !value.is_nan()), "scene {index}");
        assert_eq!(report.stats.gate.nan, 0, "scene {index}");
    }
}

// The plan and the counters.

#[test]
fn every_sample_is_rendered_once() {
    for (tile, lines) in [(7, "width = 8.0"), (16, "width = 1.0"), (64, "width = 8.0"), (u32::MAX, "width = 2.0")] {
        let text = format!("{}[lines]\n{lines}\n", ball(""));
        let options = RenderOptions { tile, ..RenderOptions::default() };
        let (_, report) = render_with(&scene(&text, &[("m", "#{ color: 1.0 }")]), &[Layer::Rgba], &options);
        assert_eq!((report.stats.samples, report.stats.rays.camera), (20 * 20 * 4, 20 * 20 * 4));
    }
}

#[test]
fn samples_keep_only_what_is_asked_for() {
    let text = format!("{}[[objects]]\nshape = \"torus\"\nmaterial = \"m\"\n", ball(""));
    let plain = samples(&scene(&text, &[("m", "#{ base_color: hit.normal }")]), &[Layer::Color]);
    assert_eq!(plain.paths.len(), 1, "nothing mirrors: no column of reflections");
    let nodes = &plain.paths[0];
    let bytes = nodes.depth.bytes() + nodes.uv.bytes() + nodes.normal.bytes() + nodes.line_width.bytes();
    assert_eq!(bytes, 0, "no line and no such layer");
    let mirror = scene(&text, &[("m", "#{ metallic: 1.0, roughness: 0.0 }")]);
    assert_eq!(samples(&mirror, &[Layer::Color]).paths.len(), 1, "only lines ask what mirrors show");
    assert!(samples(&mirror, &[Layer::Rgba]).paths.len() > 1);
}

#[test]
fn a_far_camera_with_a_long_lens_sees_what_a_parallel_one_sees() {
    let sun = "[[lights]]\nkind = \"sun\"\ndirection = [-1.0, -1.0, -1.0]\n";
    let text = ball("").replace("segments", "radius = 0.9\nsegments") + sun;
    let camera = "position = [0.0, 0.0, 5.0]\ntarget = [0.0, 0.0, 0.0]\nfov = 26.0";
    let distance = 10_000.0_f64;
    let fov = 2.0 * (1.0 / distance).atan().to_degrees();
    let far = format!("position = [0.0, 0.0, {distance:.1}]\ntarget = [0.0, 0.0, 0.0]\nfov = {fov:.9}");
    let parallel = "projection = \"orthographic\"\nheight = 2.0\nposition = [0.0, 0.0, 5.0]\ntarget = [0.0, 0.0, 0.0]";
    let shaders = [("m", "#{ base_color: 0.8 }")];
    let [a, b] = [far.as_str(), parallel].map(|with| {
        assert!(text.contains(camera));
        render(&text.replace(camera, with), &shaders, &[Layer::Color]).0
    });
    let differing = a.channels[0].iter().zip(&b.channels[0]).filter(|(a, b)| (*a - *b).abs() > 0.005).count();
    assert!(differing <= 4, "{differing} pixels differ: more than a sample or two at the outline");
}
