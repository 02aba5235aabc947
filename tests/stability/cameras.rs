//! Cameras at the ends of their ranges.

use tusche::film::Layer;
use tusche::render::RenderOptions;

use super::Case;
use crate::common::{Picture, render_with, scene_from};

pub const CASES: &[Case] = &[
    Case {
        name: "an orthographic camera inside a ball",
        wrong: "holes where the ball is behind the camera",
        unit: "pixels that do not see the ball",
        bound: 0.0,
        figure: orthographic_inside,
    },
    Case {
        name: "a perspective camera inside a ball",
        wrong: "holes, and lines where nothing differs",
        unit: "pixels with a line or without the ball",
        bound: 0.0,
        figure: perspective_inside,
    },
    Case {
        name: "a field of view of 0.01°",
        wrong: "ragged or displaced outlines",
        unit: "pixels on the wrong side of a disc's outline",
        bound: 0.0,
        figure: narrow,
    },
    Case {
        name: "a field of view of 179°",
        wrong: "a bent or torn horizon",
        unit: "pixels on the wrong side of the horizon",
        bound: 0.0,
        figure: wide,
    },
    Case {
        name: "near and far without clip planes: a disc at 1e-5 units before one at 1e5",
        wrong: "clipped things",
        unit: "pixels that see the wrong disc",
        bound: 0.0,
        figure: near_and_far,
    },
];

fn drawn(text: &str) -> Picture {
    render_with(&scene_from(text), &[Layer::Object, Layer::Line], &RenderOptions::default()).0
}

const BALL: &str =
    "[materials.paint]\nshader = \"builtin:ink\"\n[[objects]]\nshape = \"sphere\"\nmaterial = \"paint\"\n";

fn ids(picture: &Picture) -> impl Iterator<Item = u32> + '_ {
    picture.channels[0].iter().map(|id| id.to_bits())
}

fn orthographic_inside() -> f64 {
    let camera = "[camera]\nprojection = \"orthographic\"\nheight = 1.0\nposition = [0.1, 0.0, 0.2]\ntarget = [0.1, 0.0, -1.0]\n";
    let picture = drawn(&format!("[render]\nsize = [64, 48]\nsamples = 4\n{camera}{BALL}"));
    ids(&picture).filter(|&id| id != 1).count() as f64
}

fn perspective_inside() -> f64 {
    let camera = "[camera]\nposition = [0.1, 0.0, 0.2]\ntarget = [0.1, 0.3, -1.0]\nfov = 120.0\n";
    let picture = drawn(&format!("[render]\nsize = [64, 48]\nsamples = 4\n{camera}{BALL}"));
    let missing = ids(&picture).filter(|&id| id != 1).count();
    (missing + picture.channels[4].iter().filter(|alpha| **alpha != 0.0).count()) as f64
}

/// A disc whose outline is a circle of 17.3 pixels. Pixels within half a diagonal of the outline can see either side.
fn narrow() -> f64 {
    const HALF: f64 = 24.0;
    const RADIUS_PX: f64 = 17.3;
    let half_angle = (0.005_f64).to_radians();
    let distance = HALF / RADIUS_PX / half_angle.tan();
    let text = format!(
        "[render]\nsize = [64, 48]\nsamples = 4\n[camera]\nposition = [0, {distance}, 0]\nup = [0, 0, -1]\nfov = 0.01\n\
         [materials.paint]\nshader = \"builtin:ink\"\n[[objects]]\nshape = \"disc\"\nsegments = 2000\nmaterial = \"paint\"\n"
    );
    let picture = drawn(&text);
    let wrong = ids(&picture).enumerate().filter(|&(index, id)| {
        let [x, y] = [(index % 64) as f64 + 0.5 - 32.0, (index / 64) as f64 + 0.5 - HALF];
        let from_outline = x.hypot(y) - RADIUS_PX;
        from_outline.abs() > 0.72 && (id == 1) != (from_outline < 0.0)
    });
    wrong.count() as f64
}

fn wide() -> f64 {
    let text = "[render]\nsize = [64, 48]\nsamples = 4\n[camera]\nposition = [0.0, 1.0, 0.0]\ntarget = [0.0, 1.0, -1.0]\n\
         fov = 179.0\n[materials.paint]\nshader = \"builtin:ink\"\n[[objects]]\nshape = \"plane\"\nsize = [2000.0, 2000.0]\n\
         material = \"paint\"\n";
    let picture = drawn(text);
    ids(&picture).enumerate().filter(|&(index, id)| (id == 1) != (index / 64 >= 24)).count() as f64
}

fn near_and_far() -> f64 {
    // Half of the view is covered by a tiny card right before the camera; a huge one far away fills the rest.
    let text = "[render]\nsize = [64, 48]\nsamples = 4\n[camera]\nposition = [0, 0, 0]\ntarget = [0, 0, -1]\nfov = 40\n\
         [materials.paint]\nshader = \"builtin:ink\"\n\
         [[objects]]\nshape = \"plane\"\nsize = [1e-4, 1e-4]\nmaterial = \"paint\"\nrotate = [90, 0, 0]\n\
         translate = [-5e-5, 0, -1e-5]\n\
         [[objects]]\nshape = \"plane\"\nsize = [1e6, 1e6]\nmaterial = \"paint\"\nrotate = [90, 0, 0]\ntranslate = [0, 0, -1e5]\n";
    let picture = drawn(text);
    ids(&picture).enumerate().filter(|&(index, id)| id != if index % 64 < 32 { 1 } else { 2 }).count() as f64
}
