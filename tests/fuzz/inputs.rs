//! What becomes of bytes from anywhere: files give a scene or diagnostics, samples give the same lines by search and by
//! brute force. Shared by the fuzz targets and the seeded runs of `cargo test`.

use std::path::Path;

use tusche::diag::Diagnostics;
use tusche::files::FileStore;
use tusche::line::{Method, Rules};
use tusche::math::{Vec2, Vec3};
use tusche::sample::{HandMadeSample, Node, NodePath, PixelRect, SampleBuffer, SampleColor};
use tusche::scene::gltf::{ModelTime, Placement, import};
use tusche::scene::settings::LineSettings;
use tusche::scene::{SceneBuilder, file, framing};

use super::picture::{Tiles, layout};

/// Whether the bytes were accepted. Faults must be told in words.
fn told<T>(outcome: Result<T, Diagnostics>) -> Option<T> {
    outcome
        .map_err(|faults| assert!(faults.has_errors() && !faults.to_string().is_empty(), "a failure without a reason"))
        .ok()
}

/// Reads bytes as a scene file; returns whether they are one.
pub fn scene_file(bytes: &[u8]) -> bool {
    let path = Path::new("scene.toml");
    let files = FileStore::new().with_file(path, bytes).with_file("plain.rhai", "fn surface(hit, p) { #{} }");
    let loaded = told(file::load(path, &files, &[], &file::LoadOptions::default()));
    let scene = loaded.and_then(|(builder, warnings)| {
        let _ = warnings.to_string();
        told(builder.build())
    });
    scene.is_some()
}

/// Reads bytes as a model, binary or text; returns whether they are one.
pub fn model(bytes: &[u8]) -> bool {
    let path = Path::new(if bytes.starts_with(b"glTF") { "model.glb" } else { "model.gltf" });
    let files = FileStore::new().with_file(path, bytes);
    let mut read = false;
    for time in [ModelTime::Rest, ModelTime::Seconds(0.4)] {
        let mut scene = SceneBuilder::default();
        let Some(imported) = told(import(path, &files, time, &mut scene, &Placement::named("model"))) else { continue };
        let _ = imported.warnings.to_string();
        let bounds = framing::bounds(&scene);
        scene.cameras.push(framing::frame_camera(bounds, [64, 48]));
        scene.lights = framing::default_lights(&scene.cameras[0], bounds);
        scene.cameras.extend(imported.cameras);
        scene.lights.extend(imported.lights);
        read |= told(scene.build()).is_some();
    }
    read
}

/// Values from bytes; zeros when they run out.
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn byte(&mut self) -> u8 {
        let Some((first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        *first
    }

    /// Any float at all, or one of a few, so that equal ones are common.
    fn float(&mut self) -> f32 {
        match self.byte() {
            0 => f32::from_bits(u32::from_le_bytes([0; 4].map(|_| self.byte()))),
            choice => [0.0, 0.25, 0.5, 1.0, 2.0, 3.0, -1.0, 0.500_000_06][usize::from(choice) % 8],
        }
    }

    fn floats<const N: usize>(&mut self) -> [f32; N] {
        [0.0; N].map(|_| self.float())
    }

    fn threshold(&mut self) -> Option<f32> {
        [None, Some(0.0), Some(0.25), Some(1.0), Some(30.0), Some(180.0)][usize::from(self.byte()) % 6]
    }

    fn node(&mut self) -> Node {
        Node {
            object: u32::from(self.byte() % 3),
            member: u32::from(self.byte() % 3),
            shader: u32::from(self.byte() % 3),
            uv: self.floats(),
            normal: self.floats(),
            feature: self.floats(),
            depth: self.float(),
            line_color: self.floats(),
            line_width: self.float(),
            line_opacity: self.float(),
            priority: [0, 0, 0, 1, -1, i32::MIN, i32::MAX][usize::from(self.byte()) % 7],
            position: self.floats(),
            geometric_normal: self.floats(),
            footprint: self.float(),
            throughput: self.floats(),
            contribution: self.floats(),
        }
    }

    fn settings(&mut self) -> LineSettings {
        let flags = self.byte();
        LineSettings {
            object: flags & 1 == 0,
            shader: flags & 2 == 0,
            width_compensation: flags & 4 == 0,
            tint: flags & 8 == 0,
            surfaces: 1 + u32::from(flags >> 6),
            uv: self.threshold(),
            normal: self.threshold(),
            feature: self.threshold(),
            overlap: self.threshold(),
            min_width: [0.0, 0.5, 1.0][usize::from(self.byte()) % 3],
            max_width: [1.0, 3.0, 8.0, 20.0][usize::from(self.byte()) % 4],
            ..LineSettings::default()
        }
    }
}

/// A sample of a picture made from bytes.
#[derive(Clone)]
struct Sample {
    offset: [f32; 2],
    color: SampleColor,
    nodes: Vec<(NodePath, Node)>,
    behind: Vec<(NodePath, Node)>,
}

/// Finds the lines of samples made from bytes. Search and brute force must agree to the bit, whatever the tiles, and no
/// line may have a colour that is not a number.
pub fn samples(bytes: &[u8]) {
    let mut bytes = Bytes(bytes);
    let settings = bytes.settings();
    let per_pixel = 1 + u32::from(bytes.byte() % 4);
    let rect = PixelRect { x0: -3, y0: 2, x1: -2 + i32::from(bytes.byte() % 9), y1: 3 + i32::from(bytes.byte() % 9) };
    let camera = NodePath::CAMERA;
    let deeper = [camera.reflected(), camera.refracted(), camera.reflected().refracted()];
    let palette: Vec<Sample> = (0..1 + bytes.byte() % 6)
        .map(|_| {
            let mut nodes = vec![(camera, bytes.node())];
            let mut behind = Vec::new();
            let which = bytes.byte();
            nodes.extend(
                deeper
                    .into_iter()
                    .enumerate()
                    .filter(|(bit, _)| which >> bit & 1 == 1)
                    .map(|(_, path)| (path, bytes.node())),
            );
            for _ in 0..which >> 6 {
                behind.push((camera, bytes.node()));
            }
            Sample { offset: bytes.floats(), color: SampleColor { color: bytes.floats(), alpha: 1.0 }, nodes, behind }
        })
        .collect();
    let all: Vec<Sample> = (0..rect.pixels() * per_pixel as usize)
        .map(|_| {
            let mut sample = palette[usize::from(bytes.byte()) % palette.len()].clone();
            if bytes.byte() % 2 == 1 {
                let within = Vec2::new(f32::from(bytes.byte()), f32::from(bytes.byte())) / 255.0;
                sample.offset = within.to_array();
            }
            sample
        })
        .collect();
    let buffer = |tile: PixelRect| {
        let mut samples = Vec::new();
        for y in tile.y0..tile.y1 {
            for x in tile.x0..tile.x1 {
                let pixel = (y - rect.y0) as usize * rect.width() as usize + (x - rect.x0) as usize;
                let first = pixel * per_pixel as usize;
                samples.extend(all[first..first + per_pixel as usize].iter().map(|sample| HandMadeSample {
                    offset: sample.offset,
                    color: sample.color,
                    nodes: &sample.nodes,
                    behind: &sample.behind,
                }));
            }
        }
        SampleBuffer::from_samples(tile, &layout(per_pixel, settings.max_width), &samples)
    };
    let rules = Rules::new(&settings, per_pixel);
    for side in [64, 3] {
        let tiles = Tiles::new(rect, side, &rules, buffer);
        let [search, brute] = [Method::Exact, Method::Brute].map(|method| tiles.lines(method));
        for (search, brute) in search.iter().zip(&brute) {
            assert_eq!(search.samples, brute.samples, "samples with lines, tiles of {side}");
            for (a, b) in search.lines.iter().zip(&brute.lines) {
                assert_eq!(format!("{a:?}"), format!("{b:?}"), "tiles of {side}");
                assert!(Vec3::from(a.color).is_finite() && a.alpha.is_finite(), "{a:?}");
            }
        }
    }
}
