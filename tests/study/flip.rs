//! FLIP against NVIDIA's own program, on pictures made by whole numbers alone, so that both see the same.

use tusche::study::flip::{PIXELS_PER_DEGREE, flip, linear, mean_flip};

const WIDTH: u32 = 96;
const HEIGHT: u32 = 64;
/// What both may differ by; their powers and roots round differently.
const TOLERANCE: f64 = 1e-4;

type Color = [u8; 3];

fn hash(x: u32, y: u32, seed: u32) -> Color {
    let mut h = x + y * WIDTH + seed * 65536;
    h ^= h >> 16;
    h = h.wrapping_mul(0x7feb_352d);
    h ^= h >> 15;
    h = h.wrapping_mul(0x846c_a68b);
    h ^= h >> 16;
    [h, h >> 8, h >> 16].map(|part| part as u8)
}

fn gradient(x: u32, y: u32) -> Color {
    [(x * 255 / (WIDTH - 1)) as u8, (y * 255 / (HEIGHT - 1)) as u8, 128]
}

fn lined(x: u32, y: u32, shift: u32) -> Color {
    if (3 * x + 7 * y + shift) % 90 < 12 { [20, 20, 30] } else { gradient(x, y) }
}

fn paler(x: u32, y: u32) -> Color {
    hash(x, y, 1).map(|part| ((u32::from(part) + 128) / 2) as u8)
}

fn picture(color: impl Fn(u32, u32) -> Color) -> Vec<[f32; 3]> {
    let rows = 0..HEIGHT;
    rows.flat_map(|y| (0..WIDTH).map(move |x| (x, y)))
        .map(|(x, y)| linear(color(x, y).map(|part| f32::from(part) / 255.0)))
        .collect()
}

/// Name, reference, test; then for 67.02 and 30 pixels per degree: mean, largest, and the pixels (31, 17) and (95, 63). The
/// numbers are those of `flip_evaluator` 1.7 (NVIDIA, PyPI), `evaluate(reference, test, "LDR", applyMagma=False)`.
type Case = (&'static str, fn(u32, u32) -> Color, fn(u32, u32) -> Color, [[f64; 4]; 2]);

const CASES: [Case; 7] = [
    (
        "a gradient, and lines on it",
        gradient,
        |x, y| lined(x, y, 0),
        [[0.255_136, 0.984_111, 0.075_674, 0.984_111], [0.210_606, 0.992_696, 0.020_233, 0.992_696]],
    ),
    (
        "lines, and lines moved by a pixel",
        |x, y| lined(x, y, 0),
        |x, y| lined(x, y, 3),
        [[0.101_775, 0.734_939, 0.019_135, 0.734_939], [0.126_021, 0.978_523, 0.011_034, 0.786_238]],
    ),
    (
        "noise, and other noise",
        |x, y| hash(x, y, 1),
        |x, y| hash(x, y, 2),
        [[0.451_356, 0.969_728, 0.348_325, 0.881_608], [0.748_166, 0.984_951, 0.417_295, 0.929_458]],
    ),
    (
        "noise, and paler noise",
        |x, y| hash(x, y, 1),
        paler,
        [[0.347_450, 0.707_082, 0.394_634, 0.484_727], [0.456_359, 0.896_487, 0.386_829, 0.509_370]],
    ),
    ("black, and white", |_, _| [0; 3], |_, _| [255; 3], [[0.967_388; 4], [0.967_384; 4]]),
    ("green, and blue", |_, _| [0, 255, 0], |_, _| [0, 0, 255], [[1.0; 4]; 2]),
    ("a gradient, and itself", gradient, gradient, [[0.0; 4]; 2]),
];

#[test]
fn flip_gives_what_nvidias_program_gives() {
    for (name, reference, test, expected) in CASES {
        let (reference, test) = (picture(reference), picture(test));
        for (pixels_per_degree, expected) in [PIXELS_PER_DEGREE, 30.0].into_iter().zip(expected) {
            let map = flip(WIDTH as usize, &reference, &test, pixels_per_degree);
            let at = |x: u32, y: u32| f64::from(map[(y * WIDTH + x) as usize]);
            let mean = map.iter().map(|value| f64::from(*value)).sum::<f64>() / map.len() as f64;
            let largest = map.iter().copied().fold(0.0, f32::max);
            let found = [mean, largest.into(), at(31, 17), at(95, 63)];
            for (found, expected) in found.iter().zip(expected) {
                assert!(
                    (found - expected).abs() < TOLERANCE,
                    "{name}, {pixels_per_degree} pixels per degree: {found:.6} for {expected:.6}"
                );
            }
        }
    }
}

#[test]
fn pictures_without_pixels_or_of_two_sizes_have_no_flip() {
    let gray = vec![[0.5; 3]; 12];
    assert_eq!(flip(4, &gray, &gray, 67.0), vec![0.0; 12]);
    for (width, reference, test) in
        [(0, &gray[..], &gray[..]), (5, &gray, &gray), (4, &gray, &gray[..8]), (4, &[], &[])]
    {
        assert!(flip(width, reference, test, 67.0).is_empty());
        assert_eq!(mean_flip(width, reference, test), 0.0);
    }
}

#[test]
fn what_is_no_colour_counts_as_one_that_a_screen_can_show() {
    let bright = vec![[7.0, f32::INFINITY, 1.0]; 12];
    let white = vec![[1.0; 3]; 12];
    assert_eq!(mean_flip(4, &bright, &white), 0.0);
    let broken = vec![[f32::NAN, -3.0, f32::NEG_INFINITY]; 12];
    assert_eq!(mean_flip(4, &broken, &[[0.0; 3]; 12]), 0.0);
}
