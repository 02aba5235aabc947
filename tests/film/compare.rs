//! Comparisons with numbers worked out by hand.

use std::path::{Path, PathBuf};

use tempfile::TempDir;
use tusche::film::{Comparison, Picture, compare, write_difference};
use tusche::sample::PixelRect;

fn picture(size: [u32; 2], channels: &[(&str, &[f32])]) -> Picture {
    let channels = channels.iter().map(|(name, values)| ((*name).to_owned(), values.to_vec())).collect();
    Picture { rect: PixelRect::of_size(size), linear: true, channels }
}

fn write_rgb(folder: &TempDir, name: &str, size: [u32; 2], pixels: &[[u8; 3]]) -> PathBuf {
    let path = folder.path().join(name);
    image::RgbImage::from_raw(size[0], size[1], pixels.concat()).unwrap().save(&path).unwrap();
    path
}

#[test]
fn equal_pictures_do_not_differ() {
    let a = picture([2, 1], &[("R", &[0.5, 1.0]), ("Z", &[f32::INFINITY, f32::NAN])]);
    let comparison = Comparison::of(&a, &a).unwrap();
    assert_eq!(
        comparison,
        Comparison {
            size: [2, 1],
            rmse: 0.0,
            psnr: f64::INFINITY,
            largest: 0.0,
            largest_at: None,
            differing_share: 0.0
        }
    );
}

#[test]
fn numbers_are_as_by_hand() {
    let a = picture([2, 2], &[("G", &[0.0, 0.0, 0.0, 0.5]), ("R", &[0.0, 0.0, 0.0, 1.0])]);
    let b = picture([2, 2], &[("G", &[0.0, 0.0, 0.25, 0.5]), ("R", &[0.0, 0.0, 0.5, 0.5])]);
    let comparison = Comparison::of(&a, &b).unwrap();
    // Squares: 1/16 + 1/4 + 1/4 = 9/16, over 8 values.
    assert_eq!(comparison.rmse, (9.0_f64 / 128.0).sqrt());
    assert!((comparison.psnr - 10.0 * (128.0_f64 / 9.0).log10()).abs() < 1e-12);
    assert_eq!(comparison.largest, 0.5);
    let place = comparison.largest_at.unwrap();
    assert_eq!((place.channel.as_str(), place.x, place.y), ("R", 0, 1));
    assert_eq!(comparison.differing_share, 0.5);
}

#[test]
fn numbers_that_are_none_are_infinitely_far_from_others() {
    for (a, b, difference) in [
        (f32::NAN, f32::NAN, 0.0),
        (f32::INFINITY, f32::INFINITY, 0.0),
        (f32::NEG_INFINITY, f32::INFINITY, f64::INFINITY),
        (f32::NAN, 1.0, f64::INFINITY),
        (f32::NAN, f32::INFINITY, f64::INFINITY),
        (2.0, f32::INFINITY, f64::INFINITY),
        (0.0, -0.0, 0.0),
        (f32::MAX, f32::MIN, 2.0 * f64::from(f32::MAX)),
    ] {
        for (a, b) in [(a, b), (b, a)] {
            let comparison =
                Comparison::of(&picture([1, 1], &[("Z", &[a])]), &picture([1, 1], &[("Z", &[b])])).unwrap();
            assert_eq!(comparison.largest, difference, "{a} {b}");
            assert_eq!(comparison.differing_share, f64::from(u8::from(difference > 0.0)));
        }
    }
}

#[test]
fn a_missing_alpha_is_opaque() {
    let rgb = picture([1, 1], &[("R", &[0.5])]);
    let rgba = picture([1, 1], &[("A", &[0.75]), ("R", &[0.5])]);
    assert_eq!(Comparison::of(&rgb, &rgba).unwrap().largest, 0.25);
    assert_eq!(Comparison::of(&rgba, &rgb).unwrap().largest, 0.25);
}

#[test]
fn mismatches_are_errors_all_in_one() {
    let error = |a: &Picture, b: &Picture| Comparison::of(a, b).unwrap_err().to_string();
    let a = picture([2, 1], &[("R", &[0.0; 2]), ("Z", &[0.0; 2])]);
    let mut b = picture([1, 2], &[("N.X", &[0.0; 2]), ("N.Y", &[0.0; 2]), ("R", &[0.0; 2])]);
    b.linear = false;
    assert_eq!(
        error(&a, &b),
        "error: one holds linear values (EXR), the other values encoded for display; the sizes differ, 2×1 and 1×2 \
         pixels; only the first has Z; only the second has N.X, N.Y"
    );
    let moved = Picture { rect: PixelRect { x0: 3, y0: 4, x1: 5, y1: 5 }, ..a.clone() };
    assert_eq!(error(&a, &moved), "error: they show different parts of a picture, from (0, 0) and from (3, 4)");
}

#[test]
fn files_are_compared() {
    let folder = TempDir::new().unwrap();
    let a = write_rgb(&folder, "a.png", [2, 1], &[[0, 51, 255], [9, 9, 9]]);
    let b = write_rgb(&folder, "b.png", [2, 1], &[[0, 0, 255], [9, 9, 9]]);
    let comparison = compare(&a, &b).unwrap();
    assert!((comparison.largest - 0.2).abs() < 1e-7);
    assert!((comparison.rmse - (0.04_f64 / 6.0).sqrt()).abs() < 1e-7);
    assert_eq!(comparison.differing_share, 0.5);
    assert_eq!(
        serde_json::to_string(&compare(&a, &a).unwrap()).unwrap(),
        r#"{"size":[2,1],"rmse":0.0,"psnr":null,"largest":0.0,"largest_at":null,"differing_share":0.0}"#
    );

    let c = write_rgb(&folder, "c.png", [1, 1], &[[0; 3]]);
    assert_eq!(
        compare(&a, &c).unwrap_err().to_string(),
        format!(
            "{}: error: cannot compare this with {}: the sizes differ, 2×1 and 1×1 pixels",
            a.display(),
            c.display()
        )
    );
}

#[test]
fn deep_and_grey_pngs_are_read() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("deep.png");
    image::ImageBuffer::<image::Rgba<u16>, _>::from_raw(1, 1, vec![0_u16, 1, 65535, 257]).unwrap().save(&path).unwrap();
    let deep = Picture::read(&path).unwrap();
    assert_eq!(deep.channel("G"), Some(&[1.0 / 65535.0][..]));
    assert_eq!(deep.channel("A"), Some(&[1.0 / 255.0][..]));
    assert!(!deep.linear);

    let path = folder.path().join("grey.png");
    image::GrayImage::from_raw(1, 1, vec![51]).unwrap().save(&path).unwrap();
    let grey = Picture::read(&path).unwrap();
    assert_eq!(grey.channels, ["B", "G", "R"].map(|name| (name.to_owned(), vec![0.2])));
}

#[test]
fn unreadable_pictures_are_errors() {
    let folder = TempDir::new().unwrap();
    let good = write_rgb(&folder, "good.png", [40, 40], &[[0, 51, 255]; 1600]);
    let bytes = std::fs::read(&good).unwrap();
    let path = folder.path().join("bad");
    let error = |bytes: Option<&[u8]>| {
        match bytes {
            Some(bytes) => std::fs::write(&path, bytes).unwrap(),
            None => std::fs::remove_file(&path).unwrap_or_default(),
        }
        let error = Picture::read(&path).unwrap_err();
        assert_eq!(error.file.as_deref(), Some(path.as_path()));
        error.message
    };
    assert_eq!(error(None), "cannot read this file: no such file");
    let not_a_picture = "this is not a picture that can be compared: it is neither PNG nor EXR";
    assert_eq!(error(Some(b"hello there, this is text")), not_a_picture);
    assert_eq!(error(Some(b"")), not_a_picture);
    let broken = error(Some(&bytes[..bytes.len() / 2]));
    assert!(broken.starts_with("this picture (image/png) is broken: "), "{broken}");
    let broken = error(Some(&[0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0, 1, 2, 3]));
    assert!(broken.starts_with("this EXR file is broken or of a kind that cannot be read: "), "{broken}");
    assert_eq!(
        Picture::read(folder.path()).unwrap_err().message,
        "cannot read this file: this is a folder, not a file"
    );
}

#[test]
fn a_difference_is_drawn_beside_both() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("difference.png");
    let a = picture([2, 1], &[("B", &[0.0, 0.0]), ("G", &[1.0, 0.0]), ("R", &[1.0, f32::NAN])]);
    let b = picture([2, 1], &[("B", &[0.25, 0.0]), ("G", &[0.5, 0.0]), ("R", &[1.0, 0.0])]);
    let encoded = [a, b].map(|picture| Picture { linear: false, ..picture });
    write_difference(&encoded[0], &encoded[1], &path).unwrap();
    let drawn = image::open(&path).unwrap().into_rgb8();
    let pixels: Vec<_> = drawn.pixels().map(|pixel| pixel.0).collect();
    assert_eq!(drawn.dimensions(), (6, 1));
    // The difference is scaled by 2, as the largest is 0.5.
    let expected = [[255, 255, 0], [0, 0, 0]];
    assert_eq!(pixels[..2], expected);
    assert_eq!(pixels[2..4], [[0, 255, 128], [255, 0, 255]]);
    assert_eq!(pixels[4..], [[255, 128, 64], [0, 0, 0]]);

    // Different sizes, and no colours.
    let small = picture([1, 1], &[("Z", &[1.0])]);
    let large = picture([1, 2], &[("Z", &[0.0, 1.0])]);
    write_difference(&small, &large, &path).unwrap();
    let drawn = image::open(&path).unwrap().into_rgb8();
    assert_eq!(drawn.into_raw(), [[255; 3], [0; 3], [0; 3], [0; 3], [0; 3], [255; 3]].concat());

    let nowhere = folder.path().join("missing/difference.png");
    assert!(write_difference(&small, &large, Path::new(&nowhere)).is_err());
}
