//! FLIP: how different two pictures look to a person who flips between them, from 0 (the same) to 1.
//!
//! LDR-FLIP (Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", HPG 2020) in the separable
//! form of NVIDIA's own implementation, version 1.7
//! (<https://github.com/NVlabs/flip/blob/1eb247c/src/cpp/FLIP.h>, BSD licence), with its constants. The crates that
//! offer FLIP wrap that C++ code, which would bring a C++ compiler and unsafe code along. The tests compare with values that
//! NVIDIA's program gives.
//!
//! Colours are filtered as the eye filters them at a distance, and compared in a space where steps look alike; where edges
//! or points appear in one picture alone, the difference counts for more. Lines are such edges, so FLIP is strict with them.

use crate::math::linear_from_srgb;
use crate::math::portable::{cbrt, exp, pow};

/// Pixels of a picture for each degree of the field of view: those of a screen 0.7 m wide with 3840 columns, seen from 0.7 m.
pub const PIXELS_PER_DEGREE: f32 = 67.020_64;

const COLOR_EXPONENT: f32 = 0.7;
const COLOR_KNEE: f32 = 0.4;
const COLOR_BELOW_KNEE: f32 = 0.95;
const FEATURE_WIDTH: f32 = 0.082;
const WHITE: [f32; 3] = [0.950_428_55, 1.0, 1.088_900_4];

/// FLIP of every pixel, row by row. The pictures hold linear colours row by row; like a screen, FLIP knows nothing outside
/// 0 … 1, so they are clamped (and NaN is black). Both are `width` pixels wide.
///
/// Nothing comes back if the pictures are empty or not of one size.
#[must_use]
pub fn flip(width: usize, reference: &[[f32; 3]], test: &[[f32; 3]], pixels_per_degree: f32) -> Vec<f32> {
    let whole = width > 0 && reference.len().is_multiple_of(width) && reference.len() == test.len();
    if !whole || reference.is_empty() {
        return Vec::new();
    }
    let opponents = [reference, test].map(|picture| picture.iter().map(|rgb| opponent(*rgb)).collect::<Vec<_>>());
    let colors = color_differences(width, &opponents, pixels_per_degree);
    let features = feature_differences(width, &opponents, pixels_per_degree);
    colors.iter().zip(&features).map(|(color, feature)| raised(*color, 1.0 - feature)).collect()
}

/// The mean of [`flip`] over all pixels, at [`PIXELS_PER_DEGREE`]; 0 for pictures without pixels.
#[must_use]
pub fn mean_flip(width: usize, reference: &[[f32; 3]], test: &[[f32; 3]]) -> f64 {
    let map = flip(width, reference, test, PIXELS_PER_DEGREE);
    map.iter().map(|value| f64::from(*value)).sum::<f64>() / map.len().max(1) as f64
}

/// A colour as it is in a PNG file (0 … 1, sRGB) as [`flip`] wants it.
#[must_use]
pub fn linear(srgb: [f32; 3]) -> [f32; 3] {
    srgb.map(linear_from_srgb)
}

/// A linear value as a screen can show it: 0 … 1, NaN as 0.
#[must_use]
pub fn shown(value: f32) -> f32 {
    if value > 0.0 { value.min(1.0) } else { 0.0 }
}

/// `x` to the power of `y`, for x of at least 0; 0 to the power of 0 is 1.
fn raised(x: f32, y: f32) -> f32 {
    if x > 0.0 {
        pow(x, y)
    } else if y == 0.0 {
        1.0
    } else {
        0.0
    }
}

/// How much the filtered colours differ, 0 … 1.
fn color_differences(width: usize, pictures: &[Vec<[f32; 3]>; 2], pixels_per_degree: f32) -> Vec<f32> {
    let kernels = ContrastKernels::new(pixels_per_degree);
    let [reference, test] = pictures.each_ref().map(|picture| {
        // The blue-yellow channel's filter is the sum of two Gaussians, so it is filtered twice.
        let channel = |kernel: &[f32], channel: usize| {
            let plane: Vec<f32> = picture.iter().map(|color| color[channel]).collect();
            down(width, &along(width, &plane, kernel), kernel)
        };
        let luma = channel(&kernels.luma, 0);
        let red_green = channel(&kernels.red_green, 1);
        let [blue, yellow] = kernels.blue_yellow.each_ref().map(|kernel| channel(kernel, 2));
        let perceived = |i: usize| hunt(lab(xyz([luma[i], red_green[i], blue[i] + yellow[i]])));
        (0..picture.len()).map(perceived).collect::<Vec<_>>()
    });
    let greatest = {
        let [green, blue] = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|rgb| hunt(lab(xyz_from_linear(rgb))));
        raised(hyab(green, blue), COLOR_EXPONENT)
    };
    let knee = COLOR_KNEE * greatest;
    let mapped = |(a, b): (&[f32; 3], &[f32; 3])| {
        let difference = raised(hyab(*a, *b), COLOR_EXPONENT);
        if difference < knee {
            difference * (COLOR_BELOW_KNEE / knee)
        } else {
            COLOR_BELOW_KNEE + (difference - knee) / (greatest - knee) * (1.0 - COLOR_BELOW_KNEE)
        }
    };
    reference.iter().zip(&test).map(mapped).collect()
}

/// How much edges and points differ, 0 … 1.
fn feature_differences(width: usize, pictures: &[Vec<[f32; 3]>; 2], pixels_per_degree: f32) -> Vec<f32> {
    let kernels = FeatureKernels::new(pixels_per_degree);
    let [reference, test] = pictures.each_ref().map(|picture| {
        let gray: Vec<f32> = picture.iter().map(|color| (color[0] + 16.0) / 116.0).collect();
        let smooth = along(width, &gray, &kernels.smooth);
        let strength = |kernel: &[f32]| {
            let x = down(width, &along(width, &gray, kernel), &kernels.smooth);
            let y = down(width, &smooth, kernel);
            x.iter().zip(&y).map(|(x, y)| (x * x + y * y).sqrt()).collect::<Vec<_>>()
        };
        [strength(&kernels.edge), strength(&kernels.point)]
    });
    let difference = |i: usize| {
        let [edge, point] = [0, 1].map(|kind| (reference[kind][i] - test[kind][i]).abs());
        (edge.max(point) * std::f32::consts::FRAC_1_SQRT_2).sqrt()
    };
    (0..pictures[0].len()).map(difference).collect()
}

/// The contrast sensitivity of the eye, by channel.
struct ContrastKernels {
    luma: Vec<f32>,
    red_green: Vec<f32>,
    blue_yellow: [Vec<f32>; 2],
}

impl ContrastKernels {
    fn new(pixels_per_degree: f32) -> Self {
        use std::f32::consts::PI;
        const WIDEST: f32 = 0.04;
        let radius = (3.0 * (WIDEST / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as i32;
        let gaussian = |width: f32| {
            let value = |x: i32| {
                let degrees = x as f32 / pixels_per_degree;
                exp(-PI * PI * degrees * degrees / width)
            };
            (-radius..=radius).map(value).collect::<Vec<f32>>()
        };
        let scaled = |kernel: Vec<f32>, scale: f32| kernel.into_iter().map(|value| value * scale).collect::<Vec<f32>>();
        let of_sum_one = |kernel: Vec<f32>| {
            let sum: f32 = kernel.iter().sum();
            scaled(kernel, 1.0 / sum)
        };
        // Each is applied along and down, so each gets the root of its height.
        let blue_yellow = [(34.1, WIDEST), (13.5, 0.025)]
            .map(|(height, width): (f32, f32)| scaled(gaussian(width), (height * (PI / width).sqrt()).sqrt()));
        let [a, b] = blue_yellow.each_ref().map(|kernel| kernel.iter().sum::<f32>());
        let norm = 1.0 / (a * a + b * b).sqrt();
        Self {
            luma: of_sum_one(gaussian(0.0047)),
            red_green: of_sum_one(gaussian(0.0053)),
            blue_yellow: blue_yellow.map(|kernel| scaled(kernel, norm)),
        }
    }
}

/// A Gaussian and its first and second derivatives.
struct FeatureKernels {
    smooth: Vec<f32>,
    edge: Vec<f32>,
    point: Vec<f32>,
}

impl FeatureKernels {
    fn new(pixels_per_degree: f32) -> Self {
        let deviation = 0.5 * FEATURE_WIDTH * pixels_per_degree;
        let radius = (3.0 * deviation).ceil() as i32;
        let variance = deviation * deviation;
        let kernel = |factor: &dyn Fn(f32) -> f32| {
            let value = |x: f32| factor(x) * exp(-x * x / (2.0 * variance));
            (-radius..=radius).map(|x| value(x as f32)).collect::<Vec<f32>>()
        };
        Self {
            smooth: balanced(kernel(&|_| 1.0)),
            edge: balanced(kernel(&|x| -x)),
            point: balanced(kernel(&|x| x * x / variance - 1.0)),
        }
    }
}

/// Positive values scaled to a sum of 1, negative ones to −1.
fn balanced(kernel: Vec<f32>) -> Vec<f32> {
    let sum = |sign: f32| kernel.iter().map(|value| (value * sign).max(0.0)).sum::<f32>();
    let (positive, negative) = (sum(1.0), sum(-1.0));
    kernel
        .into_iter()
        .map(|value| value / if value > 0.0 { positive } else { negative.max(f32::MIN_POSITIVE) })
        .collect()
}

/// Filters each row; the picture's border goes on outside of it.
fn along(width: usize, plane: &[f32], kernel: &[f32]) -> Vec<f32> {
    let radius = kernel.len() / 2;
    let filtered = |row: &[f32]| {
        let at = |x: usize, tap: usize| row[(x + tap).saturating_sub(radius).min(width - 1)];
        (0..width)
            .map(|x| kernel.iter().enumerate().map(|(tap, weight)| weight * at(x, tap)).sum())
            .collect::<Vec<f32>>()
    };
    plane.chunks_exact(width).flat_map(filtered).collect()
}

/// Filters each column.
fn down(width: usize, plane: &[f32], kernel: &[f32]) -> Vec<f32> {
    let (radius, height) = (kernel.len() / 2, plane.len() / width);
    let mut filtered = vec![0.0; plane.len()];
    for (y, sums) in filtered.chunks_exact_mut(width).enumerate() {
        for (tap, weight) in kernel.iter().enumerate() {
            let row = (y + tap).saturating_sub(radius).min(height - 1);
            let values = &plane[row * width..(row + 1) * width];
            sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += weight * value);
        }
    }
    filtered
}

/// CIE XYZ of a linear Rec. 709 colour.
fn xyz_from_linear([r, g, b]: [f32; 3]) -> [f32; 3] {
    [
        10_135_552.0 / 24_577_794.0 * r + 8_788_810.0 / 24_577_794.0 * g + 4_435_075.0 / 24_577_794.0 * b,
        2_613_072.0 / 12_288_897.0 * r + 8_788_810.0 / 12_288_897.0 * g + 887_015.0 / 12_288_897.0 * b,
        1_425_312.0 / 73_733_382.0 * r + 8_788_810.0 / 73_733_382.0 * g + 70_074_185.0 / 73_733_382.0 * b,
    ]
}

/// YCxCz, the linear cousin of CIELAB, of a linear colour.
fn opponent(rgb: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = white_relative(xyz_from_linear(rgb.map(shown)));
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// XYZ of a filtered YCxCz, by way of the colour that a screen would show: negative and too bright parts are cut off.
fn xyz([luma, red_green, blue_yellow]: [f32; 3]) -> [f32; 3] {
    let y = (luma + 16.0) / 116.0;
    let relative = [y + red_green / 500.0, y, y - blue_yellow / 200.0];
    let [x, y, z] = [0, 1, 2].map(|axis| relative[axis] * WHITE[axis]);
    let rgb = [
        3.241_003_3 * x - 1.537_398_9 * y - 0.498_615_86 * z,
        -0.969_224_33 * x + 1.875_930_1 * y + 0.041_554_224 * z,
        0.055_639_423 * x - 0.204_011_2 * y + 1.057_148_9 * z,
    ];
    xyz_from_linear(rgb.map(|value| value.clamp(0.0, 1.0)))
}

fn white_relative(xyz: [f32; 3]) -> [f32; 3] {
    [0, 1, 2].map(|axis| xyz[axis] / WHITE[axis])
}

/// CIELAB.
fn lab(xyz: [f32; 3]) -> [f32; 3] {
    const DELTA: f32 = 6.0 / 29.0;
    let root = |t: f32| {
        if t > DELTA * DELTA * DELTA { cbrt(t) } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
    };
    let [x, y, z] = white_relative(xyz).map(root);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// Colours look the more colourful the lighter they are (the Hunt effect).
fn hunt([lightness, a, b]: [f32; 3]) -> [f32; 3] {
    [lightness, 0.01 * lightness * a, 0.01 * lightness * b]
}

/// The HyAB distance, which suits large differences.
fn hyab(p: [f32; 3], q: [f32; 3]) -> f32 {
    let [l, a, b] = [0, 1, 2].map(|axis| p[axis] - q[axis]);
    l.abs() + (a * a + b * b).sqrt()
}
