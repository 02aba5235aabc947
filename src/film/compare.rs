//! How two pictures differ.

use std::path::Path;

use serde::Serialize;

use super::atomic::write_atomically;
use super::picture::Picture;
use super::png;
use crate::diag::Diagnostic;
use crate::math::srgb_from_linear;

/// How two pictures differ, over all channels of all pixels. EXR values are compared as they are, PNG values as
/// numbers 0 … 1. Two NaN are equal, as are two infinities of one sign; either against a number is an infinite
/// difference.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Root of the mean square of all differences.
    pub rmse: f64,
    /// Peak signal-to-noise ratio in decibels for a peak of 1: −20 log₁₀ of `rmse`. ∞ if the pictures are equal (JSON
    /// has no infinity and shows `null`).
    pub psnr: f64,
    /// The largest difference.
    pub largest: f64,
    /// Where it is; `None` if the pictures are equal.
    pub largest_at: Option<Place>,
    /// Share of pixels in which any channel differs at all, 0 … 1.
    pub differing_share: f64,
}

/// A value of a picture.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Place {
    /// The channel's name.
    pub channel: String,
    /// Column, from the picture's left.
    pub x: u32,
    /// Row, from the picture's top.
    pub y: u32,
}

/// Compares two picture files.
///
/// # Errors
/// If either cannot be read, or they are not of one kind: both PNG or both EXR, of one size and place, with the same
/// channels. (Alone an alpha channel may be missing in one; it counts as 1.) All mismatches are in one message.
pub fn compare(expected: &Path, actual: &Path) -> Result<Comparison, Diagnostic> {
    let (a, b) = (Picture::read(expected)?, Picture::read(actual)?);
    Comparison::of(&a, &b).map_err(|problem| {
        let Diagnostic { message, hints, .. } = problem;
        let message = format!("cannot compare this with {}: {message}", actual.display());
        Diagnostic { hints, ..Diagnostic::error(message).in_file(expected) }
    })
}

impl Comparison {
    /// Compares two pictures.
    ///
    /// # Errors
    /// As [`compare()`], less the files.
    pub fn of(a: &Picture, b: &Picture) -> Result<Self, Diagnostic> {
        check(a, b)?;
        let pixels = a.rect.pixels();
        let opaque = vec![1.0; pixels];
        let names = || a.channels.iter().chain(&b.channels).map(|(name, _)| name.as_str());
        let mut names: Vec<_> = names().collect();
        names.sort_unstable();
        names.dedup();

        let mut differs = vec![false; pixels];
        let (mut sum, mut largest, mut largest_at) = (0.0, 0.0, None);
        for name in &names {
            let [a_values, b_values] = [a, b].map(|picture| picture.channel(name).unwrap_or(&opaque));
            for (i, (&a, &b)) in a_values.iter().zip(b_values).enumerate() {
                let difference = difference(a, b);
                sum += difference * difference;
                differs[i] |= difference > 0.0;
                if difference > largest {
                    (largest, largest_at) = (difference, Some((name, i)));
                }
            }
        }
        let rmse = (sum / (pixels * names.len()).max(1) as f64).sqrt();
        let width = a.rect.width().max(1) as usize;
        Ok(Self {
            size: a.size(),
            rmse,
            psnr: -20.0 * libm::log10(rmse),
            largest,
            largest_at: largest_at.map(|(name, i)| Place {
                channel: (*name).to_owned(),
                x: (i % width) as u32,
                y: (i / width) as u32,
            }),
            differing_share: differs.iter().filter(|differs| **differs).count() as f64 / pixels.max(1) as f64,
        })
    }
}

/// The difference of two values; ∞ if only one is a number, or they are different infinities.
fn difference(a: f32, b: f32) -> f64 {
    if a == b || a.is_nan() && b.is_nan() {
        return 0.0;
    }
    let difference = (f64::from(a) - f64::from(b)).abs();
    if difference.is_nan() { f64::INFINITY } else { difference }
}

/// Whether two pictures can be compared.
fn check(a: &Picture, b: &Picture) -> Result<(), Diagnostic> {
    let mut problems = Vec::new();
    if a.linear != b.linear {
        problems.push("one holds linear values (EXR), the other values encoded for display".to_owned());
    }
    if a.size() != b.size() {
        let size = |picture: &Picture| format!("{}×{}", picture.rect.width(), picture.rect.height());
        problems.push(format!("the sizes differ, {} and {} pixels", size(a), size(b)));
    } else if a.rect != b.rect {
        let place = |picture: &Picture| format!("({}, {})", picture.rect.x0, picture.rect.y0);
        problems.push(format!("they show different parts of a picture, from {} and from {}", place(a), place(b)));
    }
    for (which, this, other) in [("first", a, b), ("second", b, a)] {
        let only: Vec<_> = this
            .channels
            .iter()
            .map(|(name, _)| name.as_str())
            .filter(|name| *name != "A" && other.channel(name).is_none())
            .collect();
        if !only.is_empty() {
            problems.push(format!("only the {which} has {}", only.join(", ")));
        }
    }
    if problems.is_empty() { Ok(()) } else { Err(Diagnostic::error(problems.join("; "))) }
}

/// Writes expected, difference and actual side by side into a PNG file, for a person to look at. Shown are the
/// channels `R G B`, or else the first channel as grey; the differences are scaled so that the largest is white, and
/// infinite ones are magenta. Pictures of different sizes are aligned at the upper left, without a difference.
///
/// # Errors
/// If the file cannot be written.
pub fn write_difference(expected: &Picture, actual: &Picture, path: &Path) -> Result<(), Diagnostic> {
    const MAGENTA: [f32; 3] = [1.0, 0.0, 1.0];
    let same_size = expected.size() == actual.size();
    let views = [expected, actual].map(view);
    let value = |view: &[&[f32]; 3], channel: usize, i: usize| view[channel].get(i).copied().unwrap_or(0.0);
    let difference = |i, channel| difference(value(&views[0], channel, i), value(&views[1], channel, i));
    let pixels = if same_size { expected.rect.pixels() } else { 0 };
    let largest = (0..pixels)
        .flat_map(|i| (0..3).map(move |channel| difference(i, channel)))
        .filter(|difference| difference.is_finite())
        .fold(0.0, f64::max);

    let size = |picture: &Picture| picture.size().map(|pixels| pixels as usize);
    let [[width_a, height_a], [width_b, height_b]] = [size(expected), size(actual)];
    let (width, height) = (width_a.max(width_b), height_a.max(height_b));
    let mut panels = vec![[0.0; 3]; 3 * width * height];
    for y in 0..height {
        for x in 0..width {
            let at = y * 3 * width + x;
            for (panel, picture, view) in [(0, expected, &views[0]), (2, actual, &views[1])] {
                let [w, h] = size(picture);
                if x < w && y < h {
                    let encode = |value: f32| if picture.linear { srgb_from_linear(value) } else { value };
                    panels[at + panel * width] = [0, 1, 2].map(|channel| encode(value(view, channel, y * w + x)));
                }
            }
            if same_size {
                let differences = [0, 1, 2].map(|channel| difference(y * width + x, channel));
                let infinite = differences.iter().any(|difference| difference.is_infinite());
                let scaled = differences.map(|difference| (difference / largest.max(f64::MIN_POSITIVE)) as f32);
                panels[at + width] = if infinite { MAGENTA } else { scaled };
            }
        }
    }
    write_atomically(path, |sink| png::write_small(sink, [3 * width as u32, height as u32], &panels))
}

/// The channels that a person looks at.
fn view(picture: &Picture) -> [&[f32]; 3] {
    let first = picture.channels.first().map_or(&[][..], |(_, values)| values);
    match ["R", "G", "B"].map(|name| picture.channel(name)) {
        [Some(r), Some(g), Some(b)] => [r, g, b],
        _ => [first; 3],
    }
}
