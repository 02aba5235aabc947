//! Decoding images and looking them up.

use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;

use image::{DynamicImage, ImageFormat};
use proptest::prelude::*;
use tusche::math::{Vec2, Vec4, linear_from_srgb};
use tusche::scene::texture::{Image, Pixels, Texture, TextureFilter, Wrap, decode};

use super::png;

fn encoded(image: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

fn decoded(bytes: &[u8], srgb: bool) -> Image {
    decode(Path::new("t.png"), bytes, srgb).unwrap_or_else(|fault| panic!("{fault}"))
}

/// A row of grey floats.
fn row(values: &[f32], wrap: Wrap, filter: TextureFilter) -> Texture {
    let data = values.iter().map(|value| [*value, 0.0, 0.0, 1.0]).collect();
    let image = Image { width: values.len() as u32, height: 1, pixels: Pixels::Rgba32F { data } };
    Texture { name: "row".into(), image: Arc::new(image), wrap: [wrap; 2], filter, levels: Default::default() }
}

#[test]
fn png_stays_eight_bits() {
    let pixels = [[1, 2, 3, 4], [250, 251, 252, 253]];
    let image = decoded(&png(2, 1, &pixels), true);
    assert_eq!((image.width, image.height), (2, 1));
    assert_eq!(image.pixels, Pixels::Rgba8 { data: pixels.to_vec(), srgb: true });
}

#[test]
fn gray_png_and_jpeg_become_rgba() {
    let gray = DynamicImage::ImageLuma8(image::GrayImage::from_pixel(3, 2, image::Luma([77])));
    let expected = Pixels::Rgba8 { data: vec![[77, 77, 77, 255]; 6], srgb: false };
    for format in [ImageFormat::Png, ImageFormat::Jpeg] {
        assert_eq!(decoded(&encoded(&gray, format), false).pixels, expected, "{format:?}");
    }
}

#[test]
fn sixteen_bits_become_linear_floats() {
    let image = image::ImageBuffer::from_pixel(1, 1, image::Rgba([0_u16, 32_768, 65_535, 32_768]));
    let bytes = encoded(&DynamicImage::ImageRgba16(image), ImageFormat::Png);
    let half = 32_768.0 / 65_535.0;
    assert_eq!(decoded(&bytes, false).pixels, Pixels::Rgba32F { data: vec![[0.0, half, 1.0, half]] });
    assert_eq!(decoded(&bytes, true).pixels, Pixels::Rgba32F { data: vec![[0.0, linear_from_srgb(half), 1.0, half]] });
}

#[test]
fn radiance_hdr() {
    let pixel = [4.0, 0.5, 0.25];
    let image = DynamicImage::ImageRgb32F(image::ImageBuffer::from_pixel(2, 2, image::Rgb(pixel)));
    let image = decoded(&encoded(&image, ImageFormat::Hdr), true);
    assert_eq!(image.pixels, Pixels::Rgba32F { data: vec![[4.0, 0.5, 0.25, 1.0]; 4] });
}

#[test]
fn open_exr() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("t.exr");
    exr::prelude::write_rgba_file(&path, 3, 2, |x, y| (x as f32, y as f32, f32::NAN, f32::INFINITY)).unwrap();
    let image = decoded(&std::fs::read(&path).unwrap(), false);
    assert_eq!((image.width, image.height), (3, 2));
    let Pixels::Rgba32F { data } = &image.pixels else { panic!() };
    assert_eq!(data[5], [2.0, 1.0, 0.0, 1e30]);
    assert_eq!(data[1][..2], [1.0, 0.0]);
}

#[test]
fn images_that_are_none() {
    let told = |bytes: &[u8]| decode(Path::new("t.png"), bytes, true).unwrap_err().to_string();
    assert_eq!(
        told(b"GIF is not read"),
        "t.png: error: this is not an image that Tusche reads (PNG, JPEG, Radiance HDR and OpenEXR are)"
    );
    assert!(told(b"").starts_with("t.png: error: this is not an image"));
    let whole = png(20, 20, &[[9; 4]; 400]);
    assert!(told(&whole[..whole.len() / 2]).starts_with("t.png: error: cannot decode this image: "));
    assert!(told(&[0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0]).starts_with("t.png: error: cannot decode this image: "));
}

#[test]
fn huge_claims_are_refused_before_decoding() {
    let claim = |width: u32, height: u32| {
        let mut bytes = png(1, 1, &[[0; 4]]);
        bytes[16..20].copy_from_slice(&width.to_be_bytes());
        bytes[20..24].copy_from_slice(&height.to_be_bytes());
        let checksum = crc32(&bytes[12..29]);
        bytes[29..33].copy_from_slice(&checksum.to_be_bytes());
        decode(Path::new("bomb.png"), &bytes, true).unwrap_err().to_string()
    };
    for (width, height) in [(40_000, 1), (1, 40_000), (30_000, 30_000)] {
        assert_eq!(
            claim(width, height),
            format!(
                "bomb.png: error: this image of {width} × {height} pixels is too large: at most 32768 pixels each way \
                 and 134 million in all are read"
            )
        );
    }
}

fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| if crc & 1 == 1 { crc >> 1 ^ 0xedb8_8320 } else { crc >> 1 })
    })
}

#[test]
fn the_upper_left_pixel_is_at_zero() {
    let image = decoded(&png(2, 2, &[[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [0; 4]]), false);
    let texture = Texture {
        name: String::new(),
        image: Arc::new(image),
        wrap: [Wrap::Clamp; 2],
        filter: TextureFilter::Nearest,
        levels: Default::default(),
    };
    assert_eq!(texture.sample(Vec2::new(0.1, 0.1)), Vec4::new(1., 0., 0., 1.));
    assert_eq!(texture.sample(Vec2::new(0.9, 0.1)), Vec4::new(0., 1., 0., 1.));
    assert_eq!(texture.sample(Vec2::new(0.1, 0.9)), Vec4::new(0., 0., 1., 1.));
    assert_eq!(texture.sample(Vec2::new(1.0, 1.0)), Vec4::ZERO);
}

#[test]
fn lookups_decode_srgb_but_not_alpha() {
    let image = decoded(&png(1, 1, &[[188, 0, 255, 128]]), true);
    let texture = Texture {
        name: String::new(),
        image: Arc::new(image),
        wrap: [Wrap::Repeat; 2],
        filter: TextureFilter::Linear,
        levels: Default::default(),
    };
    assert_eq!(texture.sample(Vec2::ZERO), Vec4::new(linear_from_srgb(188. / 255.), 0., 1., 128. / 255.));
}

#[test]
fn wrapping() {
    use TextureFilter::Nearest;
    let at = |wrap, u: f32| row(&[0., 1., 2., 3.], wrap, Nearest).sample(Vec2::new(u, 0.0)).x;
    for (u, repeat, mirror, clamp) in [
        (0.3, 1., 1., 1.),
        (1.3, 1., 2., 3.),
        (2.1, 0., 0., 3.),
        (-0.1, 3., 0., 0.),
        (-1.1, 3., 3., 0.),
        (1.0, 0., 3., 3.),
        (2.0, 0., 0., 3.),
        (-1e-9, 3., 0., 0.),
        (1e9, 0., 0., 3.),
    ] {
        assert_eq!([at(Wrap::Repeat, u), at(Wrap::Mirror, u), at(Wrap::Clamp, u)], [repeat, mirror, clamp], "{u}");
    }
}

#[test]
fn linear_filtering_meets_across_the_seam() {
    use TextureFilter::Linear;
    let at = |wrap, u: f32| row(&[0., 4., 8., 16.], wrap, Linear).sample(Vec2::new(u, 0.0)).x;
    for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
        assert_eq!([at(wrap, 0.125), at(wrap, 0.25), at(wrap, 0.5), at(wrap, 0.875)], [0., 2., 6., 16.], "{wrap:?}");
    }
    assert_eq!([at(Wrap::Repeat, 0.0), at(Wrap::Mirror, 0.0), at(Wrap::Clamp, 0.0)], [8., 0., 0.]);
    assert_eq!([at(Wrap::Repeat, 1.0), at(Wrap::Mirror, 1.0), at(Wrap::Clamp, 1.0)], [8., 16., 16.]);
    assert_eq!(at(Wrap::Repeat, 0.0625), at(Wrap::Repeat, 7.0625));
}

#[test]
fn absurd_coordinates_read_as_zero() {
    for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
        for filter in [TextureFilter::Nearest, TextureFilter::Linear] {
            let texture = row(&[0., 4., 8., 16.], wrap, filter);
            for u in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                assert_eq!(texture.sample(Vec2::new(u, u)), texture.sample(Vec2::ZERO), "{wrap:?} {filter:?} {u}");
            }
        }
    }
}

#[test]
fn the_range_is_that_of_the_pixels() {
    let image = decoded(&png(2, 1, &[[10, 200, 0, 255], [20, 100, 0, 51]]), true);
    let texture = Texture {
        name: String::new(),
        image: Arc::new(image),
        wrap: [Wrap::Repeat; 2],
        filter: TextureFilter::Linear,
        levels: Default::default(),
    };
    let linear = |c: f32| linear_from_srgb(c / 255.0);
    assert_eq!(texture.range(), ([linear(10.), linear(100.), 0., 0.2], [linear(20.), linear(200.), 0., 1.]));
    assert_eq!(row(&[-3., 5., 1.], Wrap::Clamp, TextureFilter::Linear).range(), ([-3., 0., 0., 1.], [5., 0., 0., 1.]));
}

proptest! {
    /// The shading host bounds outputs by the range, so not even rounding may leave it.
    #[test]
    fn no_lookup_leaves_the_range(
        values in prop::collection::vec(-1e6_f32..1e6, 1..6),
        u in any::<f32>(),
        near in -3.0_f32..3.0,
        wrap in prop::sample::select(vec![Wrap::Repeat, Wrap::Mirror, Wrap::Clamp]),
        filter in prop::sample::select(vec![TextureFilter::Nearest, TextureFilter::Linear]),
    ) {
        let texture = row(&values, wrap, filter);
        let (least, greatest) = texture.range();
        for uv in [Vec2::new(u, near), Vec2::new(near, u), Vec2::splat(near)] {
            let found = texture.sample(uv);
            prop_assert!((0..4).all(|c| least[c] <= found[c] && found[c] <= greatest[c]), "{found} {least:?} {greatest:?}");
        }
    }
}

#[test]
fn mipmaps_are_means() {
    let data = (0..16).map(|i| if (i % 4 + i / 4) % 2 == 0 { [1.0, 0.0, 0.25, 1.0] } else { [0.0, 1.0, 0.25, 1.0] });
    let image = Image { width: 4, height: 4, pixels: Pixels::Rgba32F { data: data.collect() } };
    let checked = Texture {
        name: "checked".into(),
        image: Arc::new(image),
        wrap: [Wrap::Repeat; 2],
        filter: TextureFilter::Mipmap,
        levels: Default::default(),
    };
    let at = Vec2::new(0.125, 0.125);
    assert_eq!(checked.sample(at), Vec4::new(1.0, 0.0, 0.25, 1.0));
    // A pixel as wide as one of the image's, or without a width, sees the image itself.
    assert_eq!(checked.sample_wide(at, 0.25), checked.sample(at));
    assert_eq!(checked.sample_wide(at, f32::NAN), checked.sample(at));
    // Wider ones see ever less of the pattern, and at last its mean.
    assert_eq!(checked.sample_wide(at, 0.5), Vec4::new(0.5, 0.5, 0.25, 1.0));
    assert!((checked.sample_wide(at, 0.3).x - (1.0 - 0.5 * 1.2_f32.log2())).abs() < 1e-5);
    assert_eq!(checked.sample_wide(at, 1e9), Vec4::new(0.5, 0.5, 0.25, 1.0));
    // Other filters do not know of widths.
    let plain = Texture { filter: TextureFilter::Linear, ..checked.clone() };
    assert_eq!(plain.sample_wide(at, 1e9), plain.sample(at));
    // Sizes that are no powers of two.
    let image = Image { width: 3, height: 1, pixels: Pixels::Rgba32F { data: vec![[0.0; 4], [3.0; 4], [6.0; 4]] } };
    let odd = Texture { image: Arc::new(image), ..checked.clone() };
    let odd = Texture { levels: Default::default(), ..odd };
    assert_eq!(odd.sample_wide(at, 1e9), Vec4::splat(3.0));
}
