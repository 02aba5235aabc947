//! Files: what is written is read back, whole or not at all.

use std::fs;
use std::path::{Path, PathBuf};

use half::f16;
use tempfile::TempDir;
use tusche::film::{ChannelFormat, FilmTile, Layer, Output, OutputSettings, Picture};
use tusche::line::LineType;
use tusche::math::srgb_from_linear;
use tusche::sample::PixelRect;

use super::{hash, rects, unit};

fn layers() -> Vec<Layer> {
    Layer::FIXED.into_iter().chain([Layer::Aov(0, "ink".into())]).collect()
}

fn settings(path: PathBuf, size: [u32; 2]) -> OutputSettings {
    OutputSettings {
        path,
        size,
        crop: PixelRect::of_size(size),
        layers: layers(),
        png_layer: Layer::Rgba,
        transparent: false,
        metadata: Vec::new(),
    }
}

/// A value for each channel of each pixel, whatever the tile.
fn value(format: ChannelFormat, x: i32, y: i32, channel: usize) -> f32 {
    match format {
        ChannelFormat::Uint => f32::from_bits(hash(x, y, 0, channel as u32) % 100_000),
        _ if channel % 5 == 4 && x == 3 => f32::INFINITY,
        _ => unit(x, y, 0, channel as u32) * [1.0, 100.0, -3.0, 1.5e5][channel % 4],
    }
}

fn tile(layers: &[Layer], rect: PixelRect) -> FilmTile {
    let formats = layers.iter().flat_map(Layer::channels).map(|channel| channel.format);
    let channel = |(i, format): (usize, ChannelFormat)| {
        (rect.y0..rect.y1).flat_map(|y| (rect.x0..rect.x1).map(move |x| value(format, x, y, i))).collect()
    };
    FilmTile { rect, channels: formats.enumerate().map(channel).collect() }
}

/// Writes all tiles of the crop; `stride` shuffles them.
fn write(settings: OutputSettings, side: i32, stride: usize) {
    let tiles = rects(settings.crop, side);
    let layers = settings.layers.clone();
    let output = Output::create(settings).unwrap();
    for start in 0..stride.min(tiles.len()) {
        for rect in tiles[start..].iter().step_by(stride) {
            output.write(&tile(&layers, *rect)).unwrap();
        }
    }
    output.finish().unwrap();
}

fn check_exr(path: &Path, crop: PixelRect, layers: &[Layer], is_written: impl Fn(i32, i32) -> bool) {
    let picture = Picture::read(path).unwrap();
    assert!(picture.linear);
    assert_eq!(picture.rect, crop);
    let channels: Vec<_> = layers.iter().flat_map(Layer::channels).collect();
    assert_eq!(picture.channels.len(), channels.len());
    for (i, channel) in channels.iter().enumerate() {
        let values = picture.channel(&channel.name).unwrap();
        for y in crop.y0..crop.y1 {
            for x in crop.x0..crop.x1 {
                let actual = values[((y - crop.y0) * crop.width() as i32 + x - crop.x0) as usize];
                let written = if is_written(x, y) { value(channel.format, x, y, i) } else { 0.0 };
                let expected = match channel.format {
                    ChannelFormat::Half => f16::from_f32(written.clamp(-65504.0, 65504.0)).to_f32(),
                    ChannelFormat::Float => written,
                    ChannelFormat::Uint => written.to_bits() as f32,
                };
                assert_eq!(actual, expected, "{} at {x}, {y}", channel.name);
            }
        }
    }
}

#[test]
fn exr_files_are_read_back_whatever_the_tiles() {
    let folder = TempDir::new().unwrap();
    let size = [150, 70];
    let mut files = Vec::new();
    for (i, (side, stride)) in [(8, 1), (8, 7), (32, 3), (64, 2), (100, 2), (1000, 1), (1, 97)].into_iter().enumerate()
    {
        let path = folder.path().join(format!("{i}.exr"));
        write(settings(path.clone(), size), side, stride);
        check_exr(&path, PixelRect::of_size(size), &layers(), |_, _| true);
        files.push(fs::read(&path).unwrap());
    }
    assert!(files.windows(2).all(|pair| pair[0] == pair[1]), "tiles change the file's bytes");
}

#[test]
fn tiles_may_come_from_many_threads() {
    let folder = TempDir::new().unwrap();
    let paths = ["threads.exr", "one.exr"].map(|name| folder.path().join(name));
    let settings = paths.clone().map(|path| settings(path, [130, 130]));
    let output = Output::create(settings[0].clone()).unwrap();
    let tiles = rects(PixelRect::of_size([130, 130]), 16);
    std::thread::scope(|scope| {
        for part in tiles.chunks(20) {
            scope.spawn(|| part.iter().for_each(|rect| output.write(&tile(&layers(), *rect)).unwrap()));
        }
    });
    output.finish().unwrap();
    write(settings[1].clone(), 130, 1);
    assert_eq!(fs::read(&paths[0]).unwrap(), fs::read(&paths[1]).unwrap());
}

#[test]
fn an_exr_crop_keeps_its_place() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("crop.exr");
    let crop = PixelRect { x0: 13, y0: 70, x1: 140, y1: 111 };
    write(OutputSettings { crop, ..settings(path.clone(), [200, 150]) }, 32, 2);
    check_exr(&path, crop, &layers(), |_, _| true);
    let meta = exr::meta::MetaData::read_from_file(&path, true).unwrap();
    let header = &meta.headers[0];
    assert_eq!((header.own_attributes.layer_position.0, header.own_attributes.layer_position.1), (13, 70));
    assert_eq!(header.shared_attributes.display_window.size, exr::math::Vec2(200, 150));
    assert_eq!(header.shared_attributes.display_window.position, exr::math::Vec2(0, 0));

    // Tiles cut along the picture's grid hang over the crop; what is outside is left out.
    let output = Output::create(OutputSettings { crop, ..settings(path.clone(), [200, 150]) }).unwrap();
    for rect in rects(PixelRect::of_size([200, 150]), 50) {
        output.write(&tile(&layers(), rect)).unwrap();
    }
    output.finish().unwrap();
    check_exr(&path, crop, &layers(), |_, _| true);
}

#[test]
fn exr_headers_say_what_made_the_picture() {
    let folder = TempDir::new().unwrap();
    let paths = [0, 1].map(|i| folder.path().join(format!("{i}.exr")));
    for path in &paths {
        let metadata: Vec<_> = (0..12)
            .map(|i| (format!("tusche/fact{i}"), format!("grün {i}")))
            .chain([("scene".into(), String::new())])
            .collect();
        write(OutputSettings { metadata, ..settings(path.clone(), [3, 2]) }, 8, 1);
    }
    let meta = exr::meta::MetaData::read_from_file(&paths[0], true).unwrap();
    let attributes = &meta.headers[0].own_attributes;
    assert_eq!(attributes.software_name.as_ref().unwrap().to_string(), concat!("Tusche ", env!("CARGO_PKG_VERSION")));
    assert_eq!(meta.headers[0].shared_attributes.pixel_aspect, 1.0);
    assert_eq!(attributes.other.len(), 13);
    let text =
        |name: &str| attributes.other[&exr::meta::attribute::Text::from(name)].to_text().unwrap().as_slice().to_vec();
    assert_eq!(text("tusche/fact11"), "grün 11".as_bytes());
    assert_eq!(text("scene"), b"");
    assert_eq!(fs::read(&paths[0]).unwrap(), fs::read(&paths[1]).unwrap());
}

#[test]
fn what_was_never_written_is_transparent_black() {
    let folder = TempDir::new().unwrap();
    let size = [200, 130];
    let done = PixelRect { x0: 10, y0: 0, x1: 90, y1: 100 };
    for name in ["part.exr", "part.png"] {
        let path = folder.path().join(name);
        let output = Output::create(OutputSettings { transparent: true, ..settings(path.clone(), size) }).unwrap();
        for rect in rects(done, 40) {
            output.write(&tile(&layers(), rect)).unwrap();
        }
        output.finish().unwrap();
        if name.ends_with("exr") {
            check_exr(&path, PixelRect::of_size(size), &layers(), |x, y| done.contains(x, y));
        } else {
            let picture = image::open(&path).unwrap().into_rgba8();
            assert_eq!(picture.dimensions(), (200, 130));
            for (x, y, pixel) in picture.enumerate_pixels() {
                assert!(done.contains(x as i32, y as i32) || pixel.0 == [0; 4], "{x}, {y}: {pixel:?}");
            }
        }
    }
}

/// A picture of one pixel with these channels, as a PNG shows it.
fn shown(layer: Layer, transparent: bool, channels: &[f32]) -> Vec<u8> {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("a.PNG");
    let layers = vec![Layer::Aov(9, "other".into()), layer.clone()];
    let settings = OutputSettings { layers, png_layer: layer, transparent, ..settings(path.clone(), [1, 1]) };
    let output = Output::create(settings).unwrap();
    let channels = [0.5; 3].iter().chain(channels).map(|value| vec![*value]).collect();
    output.write(&FilmTile { rect: PixelRect::of_size([1, 1]), channels }).unwrap();
    output.finish().unwrap();
    image::open(&path).unwrap().into_bytes()
}

#[test]
fn png_files_show_layers_as_documented() {
    let srgb = |linear: f32| (srgb_from_linear(linear) * 255.0).round() as u8;
    assert_eq!([srgb(0.0), srgb(0.215_86), srgb(1.0)], [0, 128, 255]);
    let shown = |layer: Layer, transparent: bool, channels: &[f32]| shown(layer, transparent, channels);

    assert_eq!(shown(Layer::Rgba, false, &[0.0, 0.215_86, 7.0, 0.3]), [0, 128, 255]);
    assert_eq!(shown(Layer::Color, false, &[f32::NAN, -1.0, 0.5, 0.0]), [0, 0, srgb(0.5)]);
    assert_eq!(shown(Layer::Rgba, true, &[0.1, 0.25, 0.5, 0.5]), [srgb(0.2), srgb(0.5), 255, 128]);
    assert_eq!(shown(Layer::Rgba, true, &[0.1, 0.25, 0.5, 0.0]), [0, 0, 0, 0]);
    assert_eq!(shown(Layer::Line, false, &[0.0, 0.25, 0.0, 0.25]), [0, 255, 0, 64]);
    assert_eq!(shown(Layer::LineType(LineType::Uv), false, &[0.0, 0.25, 0.0, 0.25]), [0, 255, 0, 64]);
    assert_eq!(shown(Layer::Normal, false, &[-1.0, 0.0, 1.0]), [0, 128, 255]);
    assert_eq!(shown(Layer::Normal, false, &[0.0; 3]), [0; 3]);
    assert_eq!(shown(Layer::Position, false, &[1.2, -0.2, 3.0]), [51, 204, 0]);
    assert_eq!(shown(Layer::Uv, false, &[0.4, 1.6]), [102, 153, 0]);
    assert_eq!(shown(Layer::Depth, false, &[f32::INFINITY]), [0; 3]);
    assert_eq!(shown(Layer::Depth, false, &[4.0]), [51; 3]);
    assert_eq!(shown(Layer::Feature, false, &[1.0, 0.0, 0.5]), [255, 0, srgb(0.5)]);
    assert_eq!(shown(Layer::Aov(0, "a".into()), false, &[1.0, 0.0, 0.5]), [255, 0, srgb(0.5)]);

    let object = |id: u32| shown(Layer::Object, false, &[f32::from_bits(id)]);
    assert_eq!(object(0), [0; 3]);
    let mut colors: Vec<_> = (0..200).map(object).collect();
    colors.sort();
    colors.dedup();
    assert_eq!(colors.len(), 200);
}

#[test]
fn png_files_do_not_depend_on_the_tiles() {
    let folder = TempDir::new().unwrap();
    let crop = PixelRect { x0: 9, y0: 5, x1: 150, y1: 140 };
    let mut files = Vec::new();
    for (i, (side, stride)) in [(8, 5), (32, 1), (100, 2), (1000, 1)].into_iter().enumerate() {
        let path = folder.path().join(format!("{i}.png"));
        let metadata = vec![("Scene".to_owned(), "größe.toml".to_owned())];
        write(OutputSettings { crop, metadata, ..settings(path.clone(), [200, 150]) }, side, stride);
        files.push(fs::read(&path).unwrap());

        let picture = image::open(&path).unwrap().into_rgb8();
        assert_eq!(picture.dimensions(), (crop.width(), crop.height()));
        for (x, y, pixel) in picture.enumerate_pixels() {
            let value = |channel| value(ChannelFormat::Half, x as i32 + crop.x0, y as i32 + crop.y0, channel);
            assert_eq!(pixel.0, [0, 1, 2].map(|channel| (srgb_from_linear(value(channel)) * 255.0).round() as u8));
        }
    }
    assert!(files.windows(2).all(|pair| pair[0] == pair[1]), "tiles change the file's bytes");

    // The place of the crop, the scene and the program are in the header.
    let find = |what: &[u8]| files[0].windows(what.len()).any(|window| window == what);
    assert!(find(b"oFFs\0\0\0\x09\0\0\0\x05\0"));
    assert!(find("größe.toml".as_bytes()));
    assert!(find(concat!("Tusche ", env!("CARGO_PKG_VERSION")).as_bytes()));
}

#[test]
fn a_dropped_output_leaves_no_trace() {
    let folder = TempDir::new().unwrap();
    for name in ["a.exr", "a.png"] {
        let path = folder.path().join(name);
        fs::write(&path, "old").unwrap();
        let output = Output::create(settings(path.clone(), [100, 100])).unwrap();
        output.write(&tile(&layers(), PixelRect::of_size([80, 80]))).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        drop(output);
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
}

#[cfg(unix)]
#[test]
fn files_have_ordinary_permissions() {
    use std::os::unix::fs::PermissionsExt;
    let folder = TempDir::new().unwrap();
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
    let ordinary = folder.path().join("ordinary");
    fs::write(&ordinary, "").unwrap();
    let path = folder.path().join("a.png");
    write(settings(path.clone(), [1, 1]), 1, 1);
    assert_eq!(mode(&path), mode(&ordinary));

    // An old file's permissions are kept, and a link to it stays a link.
    fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
    let link = folder.path().join("link.png");
    std::os::unix::fs::symlink(&path, &link).unwrap();
    write(settings(link.clone(), [2, 2]), 1, 1);
    assert_eq!(mode(&path), 0o640);
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(Picture::read(&path).unwrap().size(), [2, 2]);
}

#[test]
fn impossible_outputs_are_errors() {
    let folder = TempDir::new().unwrap();
    let at = |name: &str| settings(folder.path().join(name), [4, 4]);
    let error = |settings: OutputSettings| {
        let path = settings.path.clone();
        let error = Output::create(settings).err().unwrap();
        assert_eq!(error.file.as_deref(), Some(path.as_path()));
        Diagnosed { message: error.message, hints: error.hints.join("; ") }
    };
    struct Diagnosed {
        message: String,
        hints: String,
    }

    let unknown = error(at("a.jpg"));
    assert_eq!(unknown.message, "cannot write pictures of type `.jpg`");
    assert_eq!(unknown.hints, "known types are .png and .exr");
    let nameless = error(at("picture"));
    assert_eq!(nameless.message, "the name of the picture has no extension to tell its type");
    assert_eq!(nameless.hints, "known types are .png and .exr");

    let missing = error(at("not/there/a.png"));
    let there = folder.path().join("not/there");
    assert_eq!(missing.message, format!("cannot write this file: there is no folder `{}`", there.display()));
    assert_eq!(missing.hints, "create the folder first");

    fs::create_dir(folder.path().join("folder.png")).unwrap();
    let is_folder = error(at("folder.png"));
    assert_eq!(is_folder.message, "cannot write here: this is a folder");
    assert_eq!(is_folder.hints, "add the name of a file");

    let other = error(OutputSettings { png_layer: Layer::Aov(3, "x".into()), ..at("a.png") });
    assert_eq!(other.message, "a PNG of layer `aov_x` was asked for, but that layer is not rendered");
    assert!(other.hints.starts_with("rendered are rgba, color, line, line.outline, "), "{}", other.hints);

    let twice = error(OutputSettings { layers: vec![Layer::Uv, Layer::Rgba, Layer::Uv], ..at("a.exr") });
    assert_eq!(twice.message, "layer `uv` is asked for twice");

    for name in ["a.exr", "a.png"] {
        let crop = PixelRect { x0: 3, y0: 0, x1: 3, y1: 4 };
        assert_eq!(
            error(OutputSettings { crop, ..at(name) }).message,
            "the part of the picture to write has no pixels"
        );
    }

    for name in ["", "a\0b", "größe ⚠", &"x".repeat(80)] {
        let metadata = vec![(name.to_owned(), String::new())];
        assert_eq!(
            error(OutputSettings { metadata, ..at("a.png") }).message,
            format!("cannot make a PNG file of this picture: the keyword {name:?} is not 1 to 79 ASCII letters")
        );
    }

    let cannot = "cannot make an EXR file of this picture: ";
    for (name, message) in [
        ("", "the attribute name \"\" is empty"),
        ("a\0b", "the attribute name \"a\\0b\" contains a zero byte"),
        ("channels", "invalid: attribute name `channels` is reserved and cannot be custom"),
    ] {
        let metadata = vec![(name.to_owned(), String::new())];
        assert_eq!(error(OutputSettings { metadata, ..at("a.exr") }).message, format!("{cannot}{message}"));
    }
    let long = vec![Layer::Aov(0, "x".repeat(300))];
    let long = error(OutputSettings { layers: long, ..at("a.exr") }).message;
    assert!(
        long.starts_with(&format!("{cannot}the channel name \"aov_xxx")) && long.ends_with("is longer than 255 bytes")
    );
    let empty = error(OutputSettings { layers: Vec::new(), ..at("a.exr") }).message;
    assert_eq!(empty, format!("{cannot}invalid: at least one channel is required"));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "only the folder that this test made");
}

#[cfg(target_os = "linux")]
#[test]
fn a_device_is_no_output() {
    let error = Output::create(settings("/dev/full".into(), [4, 4])).err().unwrap();
    assert_eq!(error.message, "the name of the picture has no extension to tell its type");
    let folder = TempDir::new().unwrap();
    let link = folder.path().join("full.png");
    std::os::unix::fs::symlink("/dev/full", &link).unwrap();
    assert_eq!(
        Output::create(settings(link, [4, 4])).err().unwrap().message,
        "cannot write here: this is a device or pipe, and the file is made by renaming"
    );
}

#[test]
fn tiles_that_were_not_announced_are_errors() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("a.exr");
    let output = Output::create(settings(path.clone(), [100, 100])).unwrap();
    let rect = PixelRect::of_size([64, 64]);
    let error = output.write(&tile(&[Layer::Rgba], rect)).unwrap_err();
    assert_eq!(error.message, "a tile does not have the channels that were announced");
    output.write(&tile(&layers(), rect)).unwrap();
    let error = output.write(&tile(&layers(), rect)).unwrap_err();
    assert_eq!(error.message, "some pixels were written twice");
    assert_eq!(error.hints, ["this is a bug in the program, not in the scene"]);
    assert_eq!(output.finish().unwrap_err(), error);
    assert!(!path.exists());
}
