//! Pictures of unusual sizes, filters and sample counts.

use tusche::film::Layer;
use tusche::render::RenderOptions;
use tusche::sample::PixelRect;
use tusche::scene::settings::FilterKind;

use super::Case;
use crate::common::{render_with, scene_from};

pub const CASES: &[Case] = &[
    Case {
        name: "the last columns of a picture 16384 pixels wide, alone and with the rest",
        wrong: "crops that do not fit the picture",
        unit: "values that differ",
        bound: 0.0,
        figure: last_columns,
    },
    Case {
        name: "both ends of a symmetric picture 16384 pixels wide",
        wrong: "lines that are displaced far from the first column",
        unit: "difference of the inked area, in pixels a line",
        bound: 0.1,
        figure: both_ends,
    },
    Case {
        name: "one pixel, one sample",
        wrong: "a division by zero",
        unit: "values off or not finite",
        bound: 0.0,
        figure: one_pixel,
    },
    Case {
        name: "filters wider than the picture",
        wrong: "darkened or NaN borders",
        unit: "largest error of a flat colour",
        bound: 1e-5,
        figure: wide_filters,
    },
];

/// A row of bars from end to end of a wide picture.
fn bars(width: u32) -> String {
    let mut text = format!(
        "[render]\nsize = [{width}, 4]\nsamples = 4\nfilter = \"box\"\nfilter_radius = 0.5\n[camera]\n\
         projection = \"orthographic\"\nheight = 4.0\nposition = [0, 0, 5]\n[materials.paint]\nshader = \"builtin:ink\"\n"
    );
    let half = f64::from(width) / 2.0;
    for x in [half - 10.3, half - 17.0, 0.0, -half + 17.0, -half + 10.3] {
        text += &format!(
            "[[objects]]\nshape = \"box\"\nmaterial = \"paint\"\nsize = [3.0, 9.0, 1.0]\ntranslate = [{x}, 0, 0]\n"
        );
    }
    text
}

fn last_columns() -> f64 {
    let scene = scene_from(&bars(16384));
    let layers = [Layer::Rgba, Layer::Line, Layer::Depth];
    let crop = PixelRect { x0: 16384 - 40, y0: 0, x1: 16384, y1: 4 };
    let whole = render_with(&scene, &layers, &RenderOptions::default()).0;
    let alone =
        render_with(&scene, &layers, &RenderOptions { crop: Some(crop), tile: 24, ..RenderOptions::default() }).0;
    let mut differ = 0;
    for channel in 0..whole.channels.len() {
        for (x, y) in (crop.x0..crop.x1).flat_map(|x| (0..4).map(move |y| (x as usize, y))) {
            differ += u32::from(whole.at(channel, x, y).to_bits() != alone.at(channel, x, y).to_bits());
        }
    }
    assert!((0..40).any(|x| whole.at(7, 16384 - 40 + x, 1) > 0.0), "there are lines to compare");
    f64::from(differ)
}

fn both_ends() -> f64 {
    let mut builder = scene_from(&bars(16384)).into_builder();
    builder.render.samples = 64;
    let scene = builder.build().unwrap_or_else(|faults| panic!("{faults}"));
    let area = |x0: i32, x1: i32| {
        let crop = PixelRect { x0, y0: 0, x1, y1: 4 };
        let picture =
            render_with(&scene, &[Layer::Line], &RenderOptions { crop: Some(crop), ..RenderOptions::default() }).0;
        picture.channels[3].iter().map(|alpha| f64::from(*alpha)).sum::<f64>() / 4.0
    };
    (area(0, 40) - area(16384 - 40, 16384)).abs() / 4.0
}

const FLAT: &str =
    "[render]\nsize = [3, 2]\nsamples = 1\nbackground = [0.25, 0.5, 0.75]\n[camera]\nposition = [0, 0, 5]\n";

fn one_pixel() -> f64 {
    let mut builder = scene_from(FLAT).into_builder();
    builder.render.size = [1, 1];
    let scene = builder.build().unwrap_or_else(|faults| panic!("{faults}"));
    let picture = render_with(&scene, &[Layer::Rgba, Layer::Color], &RenderOptions::default()).0;
    let right = [0.25, 0.5, 0.75, 1.0].into_iter().cycle();
    picture
        .channels
        .iter()
        .flatten()
        .zip(right)
        .filter(|(found, right)| {
            let off = (**found - right).abs();
            off.is_nan() || off >= 1e-6
        })
        .count() as f64
}

fn wide_filters() -> f64 {
    let mut worst = 0.0_f64;
    let kinds =
        [FilterKind::Box, FilterKind::Tent, FilterKind::Gaussian, FilterKind::Mitchell, FilterKind::BlackmanHarris];
    for kind in kinds {
        for (size, radius) in [([3, 2], 64.0), ([1, 1], 64.0), ([1, 1], 1e-3), ([5, 1], 7.0), ([2, 2], 0.1)] {
            let mut builder = scene_from(FLAT).into_builder();
            (builder.render.size, builder.render.filter, builder.render.filter_radius) = (size, kind, radius);
            let scene = builder.build().unwrap_or_else(|faults| panic!("{faults}"));
            let picture = render_with(&scene, &[Layer::Rgba], &RenderOptions::default()).0;
            for (channel, right) in picture.channels.iter().zip([0.25, 0.5, 0.75, 1.0]) {
                for value in channel {
                    let off = f64::from((value - right).abs());
                    worst = if off.is_nan() { f64::INFINITY } else { worst.max(off) };
                }
            }
        }
    }
    worst
}
