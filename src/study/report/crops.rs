//! Small parts of pictures for the page, as data URIs.

use std::io::Cursor;
use std::path::Path;

use image::{ImageFormat, RgbImage, imageops};

/// Most columns and rows of a crop.
const SIZE: [u32; 2] = [72, 54];
/// How much brighter differences are shown.
pub(super) const GAIN: u16 = 3;

/// A picture that a study kept; `None` if it is gone.
pub(super) fn read(path: &Path) -> Option<RgbImage> {
    let bytes = std::fs::read(path).ok()?;
    Some(image::load_from_memory_with_format(&bytes, ImageFormat::Png).ok()?.into_rgb8())
}

/// A place in a picture: x, y, width, height.
pub(super) type Place = [u32; 4];

/// Where two pictures of one size differ most, or the middle.
pub(super) fn most_telling(reference: &RgbImage, other: &RgbImage) -> Place {
    let [width, height] = [reference.width(), reference.height()];
    let size = [SIZE[0].min(width), SIZE[1].min(height)];
    let middle = [(width - size[0]) / 2, (height - size[1]) / 2, size[0], size[1]];
    if reference.dimensions() != other.dimensions() {
        return middle;
    }
    let sum = |[x, y, w, h]: Place| -> u64 {
        let pixels = (y..y + h).flat_map(|y| (x..x + w).map(move |x| (x, y)));
        pixels
            .map(|(x, y)| {
                let (a, b) = (reference.get_pixel(x, y).0, other.get_pixel(x, y).0);
                a.iter().zip(b).map(|(a, b)| u64::from(a.abs_diff(b))).sum::<u64>()
            })
            .sum()
    };
    let steps = |length: u32, size: u32| (0..=(length - size) / 12).map(|step| step * 12);
    let places = steps(height, size[1]).flat_map(|y| steps(width, size[0]).map(move |x| [x, y, size[0], size[1]]));
    // The first of equals.
    places
        .fold((sum(middle), middle), |best, place| {
            let found = sum(place);
            if found > best.0 { (found, place) } else { best }
        })
        .1
}

/// A part of a picture.
pub(super) fn crop(picture: &RgbImage, [x, y, width, height]: Place) -> RgbImage {
    imageops::crop_imm(picture, x, y, width, height).to_image()
}

/// What differs, brightened.
pub(super) fn difference(a: &RgbImage, b: &RgbImage) -> RgbImage {
    RgbImage::from_fn(a.width().min(b.width()), a.height().min(b.height()), |x, y| {
        let (a, b) = (a.get_pixel(x, y).0, b.get_pixel(x, y).0);
        image::Rgb([0, 1, 2].map(|axis| (u16::from(a[axis].abs_diff(b[axis])) * GAIN).min(255) as u8))
    })
}

/// A picture as an address that holds all of it.
pub(super) fn data_uri(picture: &RgbImage) -> Option<String> {
    let mut png = Cursor::new(Vec::new());
    picture.write_to(&mut png, ImageFormat::Png).ok()?;
    Some(format!("data:image/png;base64,{}", base64::encode(png.into_inner())))
}
