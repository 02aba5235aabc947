//! Determinism: no thread count, tile size, search method, crop or run changes a bit of a picture.

use tusche::film::Layer;
use tusche::line::Method;
use tusche::render::RenderOptions;
use tusche::sample::PixelRect;
use tusche::scene::Scene;
use tusche::scene::settings::Sampler;

use crate::common::{render_with, root, scene_from, shipped_scenes};

const LAYERS: [Layer; 6] = [Layer::Rgba, Layer::Color, Layer::Line, Layer::HiddenLine, Layer::Depth, Layer::Object];

/// A shipped scene, small and quick.
fn small(path: &std::path::Path) -> Scene {
    let scene = scene_from(&std::fs::read_to_string(path).expect("shipped scenes can be read"));
    let mut builder = scene.into_builder();
    let [width, height] = builder.render.size;
    builder.render.size = [72, (72 * height / width).max(1)];
    builder.render.samples = 4;
    builder.build().unwrap_or_else(|faults| panic!("{faults}"))
}

#[test]
fn threads_tiles_and_runs_change_no_bit() {
    for (name, path) in shipped_scenes() {
        let scene = small(&path);
        let bits = |threads, tile| {
            let options = RenderOptions { threads, tile, ..RenderOptions::default() };
            render_with(&scene, &LAYERS, &options).0.bits()
        };
        let reference = bits(1, 32);
        for (threads, tile) in [(1, 32), (2, 8), (4, 32), (2, 100)] {
            assert!(bits(threads, tile) == reference, "{name}: {threads} threads, tiles of {tile}");
        }
    }
}

#[test]
fn threads_tiles_and_crops_change_no_bit_of_any_sampler() {
    for sampler in Sampler::ALL {
        for samples in [4, 9] {
            let mut builder = small(&root().join("scenes/hello.toml")).into_builder();
            (builder.render.sampler, builder.render.samples) = (sampler, samples);
            let scene = builder.build().unwrap_or_else(|faults| panic!("{faults}"));
            let whole = render_with(&scene, &LAYERS, &RenderOptions::default()).0;
            let crop = Some(PixelRect { x0: 31, y0: 9, x1: 57, y1: 30 });
            for (threads, tile, crop) in [(1, 8, None), (2, 100, None), (2, 16, crop)] {
                let options = RenderOptions { threads, tile, crop, ..RenderOptions::default() };
                let part = render_with(&scene, &LAYERS, &options).0;
                let rect = crop.unwrap_or(PixelRect::of_size(scene.render().size));
                for y in rect.y0 as usize..rect.y1 as usize {
                    for x in rect.x0 as usize..rect.x1 as usize {
                        for channel in 0..whole.channels.len() {
                            let [a, b] = [&whole, &part].map(|picture| picture.at(channel, x, y).to_bits());
                            assert_eq!(a, b, "{sampler:?}, {samples} samples, channel {channel} at {x}, {y}");
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn the_exact_search_draws_what_brute_force_draws_on_every_scene() {
    for (name, path) in shipped_scenes() {
        let scene = small(&path);
        let bits = |method| {
            let options = RenderOptions { method, ..RenderOptions::default() };
            render_with(&scene, &LAYERS, &options).0.bits()
        };
        assert!(bits(Method::Exact) == bits(Method::Brute), "{name}");
    }
}

#[test]
fn crops_are_pieces_of_the_whole_picture() {
    for (name, path) in shipped_scenes() {
        let scene = small(&path);
        let whole = render_with(&scene, &LAYERS, &RenderOptions::default()).0;
        for crop in [
            PixelRect { x0: 0, y0: 0, x1: 20, y1: 11 },
            PixelRect { x0: 31, y0: 9, x1: 57, y1: 30 },
            PixelRect { x0: 71, y0: 5, x1: 72, y1: 6 },
        ] {
            let options = RenderOptions { crop: Some(crop), tile: 16, ..RenderOptions::default() };
            let piece = render_with(&scene, &LAYERS, &options).0;
            for channel in 0..whole.channels.len() {
                for y in crop.y0..crop.y1.min(whole.height as i32) {
                    for x in crop.x0..crop.x1 {
                        let [a, b] = [&whole, &piece].map(|p| p.at(channel, x as usize, y as usize).to_bits());
                        assert_eq!(a, b, "{name}: channel {channel} at {x}, {y}");
                    }
                }
            }
        }
    }
}
