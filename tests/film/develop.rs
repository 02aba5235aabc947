//! Developing against theory and against plain loops in double precision.

use proptest::prelude::*;
use tusche::film::{FilmTile, FilmWindow, Filter, Layer, LinePath, develop};
use tusche::line::{Fired, LineType, SeenLine};
use tusche::sample::{NodePath, PixelRect, SampleColor};
use tusche::scene::settings::FilterKind;

use super::filter::KINDS;
use super::{Samples, line, rects, unit, window};

/// Rounding of sums of up to some hundred values in single precision.
const SUM_TOLERANCE: f64 = 2e-5;

fn all_layers() -> Vec<Layer> {
    Layer::FIXED.into_iter().chain([Layer::Aov(0, "flat".into()), Layer::Aov(1, "noise".into())]).collect()
}

fn whole(samples: &Samples, filter: &Filter, layers: &[Layer]) -> FilmTile {
    let side = samples.size[0].max(samples.size[1]) as i32;
    let tiles = samples.tiles(side);
    develop(&window(&tiles, samples.size, side), PixelRect::of_size(samples.size), filter, layers)
}

/// Whether so few samples are within the radius that their positive and negative weights may cancel.
fn weights_cancel(kind: FilterKind, radius: f32) -> bool {
    kind == FilterKind::Mitchell && radius < 1.0
}

/// Σ w v / Σ w of one channel over all samples of the picture.
fn oracle(samples: &Samples, filter: &Filter, pixel: [i32; 2], value: impl Fn(i32, i32, u32) -> f64) -> f64 {
    let (mut sum, mut total) = (0.0, 0.0);
    for y in 0..samples.size[1] as i32 {
        for x in 0..samples.size[0] as i32 {
            for s in 0..samples.samples_per_pixel {
                let offset = (samples.offset)(x, y, s);
                let weight = |to: i32, from: i32, offset: f32| filter.weight((from - to) as f32 + (offset - 0.5));
                let weight = f64::from(weight(pixel[0], x, offset[0])) * f64::from(weight(pixel[1], y, offset[1]));
                total += weight;
                sum += weight * value(x, y, s);
            }
        }
    }
    sum / total
}

#[test]
fn filtered_layers_are_weighted_means() {
    let samples = Samples::noise([9, 7], 5);
    let lined = |x, y, s| (samples.line)(x, y, s);
    let color = |x, y, s| (samples.color)(x, y, s);
    let of_type = |x, y, s| lined(x, y, s).filter(|line| line.fired == Fired::NORMAL);
    for kind in KINDS {
        for radius in [0.5, 1.5, 2.3] {
            if weights_cancel(kind, radius) {
                continue;
            }
            let filter = Filter::new(kind, radius);
            let layers = [Layer::Rgba, Layer::Color, Layer::Line, Layer::LineType(LineType::Crease)];
            let tile = whole(&samples, &filter, &layers);
            for i in 0..tile.rect.pixels() {
                let pixel = [i as i32 % 9, i as i32 / 9];
                let check = |channel: usize, value: &dyn Fn(i32, i32, u32) -> f32| {
                    let expected = oracle(&samples, &filter, pixel, |x, y, s| f64::from(value(x, y, s)));
                    let actual = f64::from(tile.channels[channel][i]);
                    assert!(
                        (actual - expected).abs() < SUM_TOLERANCE * 10.0,
                        "{kind:?} {radius}, pixel {pixel:?}, channel {channel}: {actual}, not {expected}"
                    );
                };
                check(0, &|x, y, s| lined(x, y, s).map_or(color(x, y, s).color[0], |line| line.lined[0]));
                check(3, &|x, y, s| {
                    let alpha = color(x, y, s).alpha;
                    lined(x, y, s).map_or(alpha, |line| alpha + (1.0 - alpha) * line.alpha)
                });
                check(5, &|x, y, s| color(x, y, s).color[1]);
                check(7, &|x, y, s| color(x, y, s).alpha);
                check(9, &|x, y, s| lined(x, y, s).map_or(0.0, |line| line.color[1] * line.alpha));
                check(11, &|x, y, s| lined(x, y, s).map_or(0.0, |line| line.alpha));
                check(13, &|x, y, s| of_type(x, y, s).map_or(0.0, |line| line.color[1] * line.alpha));
                check(15, &|x, y, s| of_type(x, y, s).map_or(0.0, |line| line.alpha));
            }
        }
    }
}

#[test]
fn a_constant_picture_stays_constant() {
    for kind in KINDS {
        for radius in [0.5, 0.8, 1.5, 3.0] {
            let samples = Samples {
                samples_per_pixel: 4,
                offset: |x, y, s| [unit(x, y, s, 0), unit(x, y, s, 1)],
                color: |_, _, _| SampleColor { color: [1.0, 0.3, 1e4], alpha: 1.0 },
                ..Samples::black([12, 9])
            };
            let tile = whole(&samples, &Filter::new(kind, radius), &[Layer::Rgba, Layer::Aov(0, "flat".into())]);
            for (channel, (expected, tolerance)) in
                [(1.0, 0.0), (0.3, 1e-6), (1e4, 1e-2), (1.0, 0.0), (0.25, 1e-6), (0.5, 1e-6), (4.0, 1e-5)]
                    .into_iter()
                    .enumerate()
            {
                for value in &tile.channels[channel] {
                    assert!((value - expected).abs() <= tolerance, "{kind:?} {radius}, channel {channel}: {value}");
                }
            }
        }
    }
}

/// What a compositor does with half floats: the lines over the hidden ones over what lies below are the picture with lines,
/// and the lines by type and by path add up to the lines. Without hidden lines, too.
#[test]
fn layers_rebuild_the_picture() {
    rebuild(|_, _| false);
    rebuild(|x, s| (x as u32 + s).is_multiple_of(3));
}

fn rebuild(hidden: fn(i32, u32) -> bool) {
    let random = Samples::noise([11, 9], 5);
    let samples = Samples {
        line: |x, y, s| {
            let line = (Samples::noise([11, 9], 5).line)(x, y, s)?;
            let path = NodePath::CAMERA;
            let path =
                [path, path.reflected(), path.refracted(), path.reflected().refracted()][(s as usize + x as usize) % 4];
            let color = (Samples::noise([11, 9], 5).color)(x, y, s).color;
            let mix = |i: usize| color[i] * (1.0 - line.alpha) + line.color[i] * line.alpha;
            Some(SeenLine { lined: [mix(0), mix(1), mix(2)], path, ..line })
        },
        ..random
    };
    let mut tiles = samples.tiles(64);
    for line in tiles.iter_mut().flat_map(|(_, lines)| lines.samples.iter().zip(&mut lines.lines)) {
        let (sample, line) = line;
        line.hidden = hidden((sample / 5 % 11) as i32, sample % 5);
    }
    let half = |x: f32| half::f16::from_f32(x).to_f32();
    let types = Layer::FIXED.into_iter().filter(|layer| matches!(layer, Layer::LineType(_)));
    let paths = [LinePath::Camera, LinePath::Reflection, LinePath::Refraction].map(Layer::LinePath);
    let layers: Vec<_> =
        [Layer::Rgba, Layer::Line, Layer::Below, Layer::HiddenLine].into_iter().chain(types).chain(paths).collect();
    for kind in [FilterKind::Box, FilterKind::Tent, FilterKind::Gaussian, FilterKind::BlackmanHarris] {
        let rect = PixelRect::of_size(samples.size);
        let tile = develop(&window(&tiles, samples.size, 64), rect, &Filter::new(kind, 1.5), &layers);
        let value = |layer: usize, channel: usize, i: usize| tile.channels[4 * layer + channel][i];
        for i in 0..tile.rect.pixels() {
            for channel in 0..4 {
                let [rgba, line, below, hidden] = [0, 1, 2, 3].map(|layer| half(value(layer, channel, i)));
                let under = hidden + (1.0 - half(value(3, 3, i))) * below;
                let over = line + (1.0 - half(value(1, 3, i))) * under;
                // Half floats have 11 bits; five of them are rounded here.
                let tolerance = 5.0 / 2048.0 * rgba.abs().max(below.abs()).max(1.0);
                assert!((over - rgba).abs() < tolerance, "{kind:?}, pixel {i}, channel {channel}: {over}, not {rgba}");
                let sum = |layers: std::ops::Range<usize>| layers.map(|layer| value(layer, channel, i)).sum::<f32>();
                assert!((sum(4..11) - value(1, channel, i)).abs() < 1e-5, "types, pixel {i}");
                assert!((sum(11..14) - value(1, channel, i)).abs() < 1e-5, "paths, pixel {i}");
            }
        }
    }
}

#[test]
fn one_bright_sample_draws_the_filter() {
    let samples = Samples {
        offset: |_, _, _| [0.7, 0.2],
        color: |x, y, _| SampleColor { color: if [x, y] == [5, 4] { [1.0; 3] } else { [0.0; 3] }, alpha: 1.0 },
        ..Samples::black([11, 9])
    };
    for kind in KINDS {
        for radius in [0.5, 1.0, 1.5, 2.25] {
            if weights_cancel(kind, radius) {
                continue;
            }
            let filter = Filter::new(kind, radius);
            // Every pixel away from the border sees samples at the same places, so Σ w is the same for all.
            let along = |offset: f32| (-4..=4).map(|i| filter.weight(i as f32 + offset - 0.5)).sum::<f32>();
            let total = along(0.7) * along(0.2);
            let tile = whole(&samples, &filter, &[Layer::Color]);
            let mut energy = 0.0;
            for y in 0..9 {
                for x in 0..11 {
                    let value = tile.channels[0][y * 11 + x];
                    let [dx, dy] = [5.0 + 0.7 - (x as f32 + 0.5), 4.0 + 0.2 - (y as f32 + 0.5)];
                    let expected = filter.weight(dx) * filter.weight(dy) / total;
                    assert!((value - expected).abs() < 1e-5, "{kind:?} {radius} at {x}, {y}: {value}, not {expected}");
                    energy += value;
                }
            }
            assert!((energy - 1.0).abs() < 1e-5, "{kind:?} {radius}: {energy}");
        }
    }
}

#[test]
fn weights_that_cancel_give_the_mean_of_the_pixel() {
    // A radius that no sample is within, and a lone sample in a negative lobe.
    for (kind, radius, offset) in [
        (FilterKind::Tent, 0.1, [0.9, 0.9]),
        (FilterKind::Box, 0.25, [0.1, 0.5]),
        (FilterKind::Mitchell, 0.6, [0.95, 0.5]),
        (FilterKind::Mitchell, 0.6, [0.95, 0.95]),
    ] {
        for (count, mean) in [(1, 0.25), (2, 0.5)] {
            let (buffer, lines) = Samples {
                samples_per_pixel: count,
                color: |_, _, s| SampleColor { color: [0.25 + 0.5 * s as f32; 3], alpha: 1.0 },
                line: |_, _, _| Some(line([0.5; 3], Fired::OBJECT)),
                ..Samples::black([1, 1])
            }
            .buffer(PixelRect::of_size([1, 1]));
            let tiles = vec![(tusche::sample::SampleBuffer { offset: vec![offset; count as usize], ..buffer }, lines)];
            let layers = [Layer::Color, Layer::Rgba, Layer::Line, Layer::Aov(0, "flat".into())];
            let tile =
                develop(&window(&tiles, [1, 1], 1), PixelRect::of_size([1, 1]), &Filter::new(kind, radius), &layers);
            let values: Vec<_> = [0, 3, 4, 7, 8, 11, 14].iter().map(|&channel| tile.channels[channel][0]).collect();
            if kind == FilterKind::Mitchell && offset[1] > 0.9 {
                // Two negative weights make a positive product, which is a good weight.
                values
                    .iter()
                    .zip([mean, 1.0, 0.5, 1.0, 0.5, 1.0, 4.0])
                    .for_each(|(a, b)| assert!((a - b).abs() < 1e-6));
            } else {
                assert_eq!(values, [mean, 1.0, 0.5, 1.0, 0.5, 1.0, 4.0], "{kind:?} {radius}");
            }
        }
    }
}

#[test]
fn no_pixel_is_much_brighter_than_its_samples() {
    for seed in 0..200 {
        let (buffer, lines) = Samples::noise([3, 3], 1).buffer(PixelRect::of_size([3, 3]));
        let offset = (0..9).map(|i| [unit(seed, i, 0, 0), unit(seed, i, 0, 1)]).collect();
        let tiles = vec![(tusche::sample::SampleBuffer { offset, ..buffer }, lines)];
        let filter = Filter::new(FilterKind::Mitchell, 0.9);
        let tile = develop(&window(&tiles, [3, 3], 3), PixelRect::of_size([3, 3]), &filter, &[Layer::Color]);
        // Samples are at most 1 in the red channel, and the limit is a factor of 10.
        assert!(tile.channels[0].iter().all(|value| value.abs() <= 10.0), "{:?}", tile.channels[0]);
    }
}

#[test]
fn nearest_layers_take_the_sample_nearest_to_the_centre() {
    let samples = Samples {
        samples_per_pixel: 4,
        // Samples 1 and 2 are equally near.
        offset: |_, _, s| [[0.9, 0.5], [0.375, 0.5], [0.625, 0.5], [0.5, 0.1]][s as usize],
        object: |x, _, s| if x == 1 { 0 } else { 10 * x as u32 + s },
        ..Samples::noise([3, 1], 4)
    };
    let layers = [Layer::Object, Layer::Depth, Layer::Normal, Layer::Position, Layer::Uv, Layer::Feature];
    let tile = whole(&samples, &Filter::new(FilterKind::BlackmanHarris, 3.0), &layers);
    let ids: Vec<_> = tile.channels[0].iter().map(|bits| bits.to_bits()).collect();
    assert_eq!(ids, [1, 0, 21]);
    for x in [0, 2] {
        let values: Vec<_> = tile.channels[1..].iter().map(|channel| channel[x as usize]).collect();
        let triple = |salt: u32| [0, 1, 2].map(|i| unit(x, 0, 1, salt + i) - 0.5);
        let expected = [
            &[1.0 + unit(x, 0, 1, 50)][..],
            &triple(30),
            &triple(60),
            &[unit(x, 0, 1, 20), unit(x, 0, 1, 21)],
            &triple(40),
        ];
        assert_eq!(values, expected.concat());
    }
    let miss: Vec<_> = tile.channels[1..].iter().map(|channel| channel[1]).collect();
    assert_eq!(miss[0], f32::INFINITY);
    assert!(miss[1..].iter().all(|value| *value == 0.0), "{miss:?}");
}

#[test]
fn line_types_add_up_to_all_lines() {
    let samples = Samples::noise([16, 16], 4);
    let layers: Vec<_> =
        Layer::FIXED.into_iter().filter(|layer| matches!(layer, Layer::Line | Layer::LineType(_))).collect();
    let tile = whole(&samples, &Filter::new(FilterKind::Gaussian, 1.5), &layers);
    assert!(tile.channels[3].iter().any(|alpha| *alpha > 0.1));
    for i in 0..tile.rect.pixels() {
        for component in 0..4 {
            let types: f32 = (1..8).map(|layer| tile.channels[4 * layer + component][i]).sum();
            assert!((types - tile.channels[component][i]).abs() < 1e-5);
        }
    }
}

#[test]
fn without_lines_the_picture_is_the_plain_one() {
    let samples = Samples { line: |_, _, _| None, ..Samples::noise([8, 8], 3) };
    let layers = [Layer::Rgba, Layer::Color, Layer::Line, Layer::LineType(LineType::Uv)];
    let filter = Filter::new(FilterKind::Mitchell, 2.0);
    let tile = whole(&samples, &filter, &layers);
    assert_eq!(tile.channels[..4], tile.channels[4..8]);
    assert!(tile.channels[8..].iter().flatten().all(|value| *value == 0.0));

    // The same when the line pass did not run.
    let tiles = samples.tiles(8);
    let no_lines = FilmWindow {
        tiles: tiles.iter().map(|(buffer, _)| Some((buffer, None))).collect(),
        ..window(&tiles, [8, 8], 8)
    };
    assert_eq!(develop(&no_lines, PixelRect::of_size([8, 8]), &filter, &layers), tile);
}

#[test]
fn pixels_without_samples_are_zero() {
    let samples = Samples::noise([16, 8], 2);
    let tiles = samples.tiles(8);
    let mut half = window(&tiles, [16, 8], 8);
    half.tiles[1] = None;
    let filter = Filter::new(FilterKind::Box, 0.5);
    let tile = develop(&half, PixelRect { x0: -2, y0: -3, x1: 20, y1: 12 }, &filter, &all_layers());
    let inside = develop(&half, PixelRect::of_size([8, 8]), &filter, &all_layers());
    for (channel, inside) in tile.channels.iter().zip(&inside.channels) {
        for y in -3..12_i32 {
            for x in -2..20_i32 {
                let value = channel[((y + 3) * 22 + x + 2) as usize];
                let sampled = (0..8).contains(&x) && (0..8).contains(&y);
                let expected = if sampled { inside[(y * 8 + x) as usize] } else { 0.0 };
                assert_eq!(value.to_bits(), expected.to_bits(), "({x}, {y})");
            }
        }
    }
    assert!(develop(&half, PixelRect::of_size([0, 0]), &filter, &all_layers()).channels.iter().all(Vec::is_empty));
}

/// The tile of a part of another.
fn cut(tile: &FilmTile, rect: PixelRect) -> FilmTile {
    let pixels: Vec<_> = (rect.y0..rect.y1)
        .flat_map(|y| (rect.x0..rect.x1).map(move |x| (x, y)))
        .map(|(x, y)| (y - tile.rect.y0) as usize * tile.rect.width() as usize + (x - tile.rect.x0) as usize)
        .collect();
    let channels = tile.channels.iter().map(|channel| pixels.iter().map(|&i| channel[i]).collect()).collect();
    FilmTile { rect, channels }
}

fn bits(tile: &FilmTile) -> Vec<Vec<u32>> {
    tile.channels.iter().map(|channel| channel.iter().map(|value| value.to_bits()).collect()).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Neither the grid of tiles nor the rectangle that is asked for changes a bit.
    #[test]
    fn tiles_do_not_matter(
        width in 1_u32..40,
        height in 1_u32..40,
        samples_per_pixel in 1_u32..5,
        kind in prop::sample::select(KINDS.to_vec()),
        radius in 0.1_f32..4.0,
        side in 1_i32..24,
        piece in 1_i32..24,
    ) {
        let size = [width, height];
        let samples = Samples::noise(size, samples_per_pixel);
        let filter = Filter::new(kind, radius);
        let layers = all_layers();
        let expected = whole(&samples, &filter, &layers);
        let tiles = samples.tiles(side);
        for rect in rects(PixelRect::of_size(size), piece) {
            let tile = develop(&window(&tiles, size, side), rect, &filter, &layers);
            prop_assert_eq!(bits(&tile), bits(&cut(&expected, rect)));
            // Nor which other layers are asked for.
            let alone = develop(&window(&tiles, size, side), rect, &filter, &[Layer::Color]);
            prop_assert_eq!(bits(&alone), bits(&tile)[4..8].to_vec());
        }
    }
}
