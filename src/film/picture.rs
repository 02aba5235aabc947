//! Pictures read back from files, for comparing.

use std::io::Cursor;
use std::path::Path;

use exr::image::FlatSamples;
use exr::image::read::image::ReadLayers;
use exr::image::read::layers::ReadChannels;
use image::{DynamicImage, ImageError, ImageReader};

use crate::diag::Diagnostic;
use crate::files::FileStore;
use crate::sample::PixelRect;

/// A picture as channels of numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// The pixels that it holds; of a PNG always from (0, 0), of an EXR its data window.
    pub rect: PixelRect,
    /// Whether the values are linear (EXR) or encoded for display, 0 … 1 (PNG).
    pub linear: bool,
    /// Name and values (`rect.pixels()` of them, row by row), in order of names. Ids are numbers here, exact up to 2²⁴.
    pub channels: Vec<(String, Vec<f32>)>,
}

impl Picture {
    /// Reads a PNG or EXR file; which it is, its content tells. Grey pictures give three equal channels.
    ///
    /// # Errors
    /// If the file cannot be read, is neither, is broken, or is an EXR file of a kind that is not supported (deep
    /// data, parts of different sizes).
    pub fn read(path: &Path) -> Result<Self, Diagnostic> {
        let bytes = FileStore::new().read(path)?;
        let picture = match bytes.first_chunk() {
            Some(&exr::meta::magic_number::BYTES) => Self::from_exr(&bytes),
            _ => Self::from_image(&bytes),
        };
        picture.map_err(|message| Diagnostic::error(message).in_file(path))
    }

    /// Width and height in pixels.
    #[must_use]
    pub fn size(&self) -> [u32; 2] {
        [self.rect.width(), self.rect.height()]
    }

    /// The values of a channel.
    #[must_use]
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        self.channels.iter().find(|(known, _)| known == name).map(|(_, values)| values.as_slice())
    }

    fn new(rect: PixelRect, linear: bool, mut channels: Vec<(String, Vec<f32>)>) -> Self {
        channels.sort_by(|(a, _), (b, _)| a.cmp(b));
        Self { rect, linear, channels }
    }

    fn from_image(bytes: &[u8]) -> Result<Self, String> {
        let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|error| error.to_string())?;
        let Some(format) = reader.format() else {
            return Err("this is not a picture that can be compared: it is neither PNG nor EXR".to_owned());
        };
        let image = reader.decode().map_err(|error| match error {
            ImageError::Unsupported(error) => format!("cannot read this picture: {error}"),
            error => format!("this picture ({}) is broken: {error}", format.to_mime_type()),
        })?;
        let rect = PixelRect::of_size([image.width(), image.height()]);
        let has_alpha = image.color().has_alpha();
        let pixels: Vec<[f32; 4]> = match image {
            DynamicImage::ImageLuma8(_)
            | DynamicImage::ImageLumaA8(_)
            | DynamicImage::ImageRgb8(_)
            | DynamicImage::ImageRgba8(_) => {
                image.into_rgba8().pixels().map(|pixel| pixel.0.map(|value| f32::from(value) / 255.0)).collect()
            }
            _ => image.into_rgba16().pixels().map(|pixel| pixel.0.map(|value| f32::from(value) / 65535.0)).collect(),
        };
        let channel = |(i, name): (usize, &str)| (name.to_owned(), pixels.iter().map(|pixel| pixel[i]).collect());
        let names = if has_alpha { &["R", "G", "B", "A"][..] } else { &["R", "G", "B"] };
        Ok(Self::new(rect, false, names.iter().copied().enumerate().map(channel).collect()))
    }

    fn from_exr(bytes: &[u8]) -> Result<Self, String> {
        let image = exr::image::read::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .all_layers()
            .all_attributes()
            .from_buffered(Cursor::new(bytes))
            .map_err(|error| format!("this EXR file is broken or of a kind that cannot be read: {error}"))?;
        let mut rect = None;
        let mut channels = Vec::new();
        let parts = image.layer_data.len();
        for layer in image.layer_data {
            let (position, size) = (layer.attributes.layer_position, layer.size);
            let [width, height] = [size.width(), size.height()].map(|pixels| i32::try_from(pixels).unwrap_or(i32::MAX));
            let (x0, y0) = (position.x(), position.y());
            let this = PixelRect { x0, y0, x1: x0.saturating_add(width), y1: y0.saturating_add(height) };
            if *rect.get_or_insert(this) != this {
                return Err("the parts of this EXR file have different sizes or places".to_owned());
            }
            let prefix = match &layer.attributes.layer_name {
                Some(name) if parts > 1 => format!("{name}."),
                _ => String::new(),
            };
            channels.extend(layer.channel_data.list.into_iter().map(|channel| {
                let values = match channel.sample_data {
                    FlatSamples::F16(values) => values.into_iter().map(half::f16::to_f32).collect(),
                    FlatSamples::F32(values) => values,
                    FlatSamples::U32(values) => values.into_iter().map(|value| value as f32).collect(),
                };
                (format!("{prefix}{}", channel.name), values)
            }));
        }
        let rect = rect.ok_or("this EXR file has no parts")?;
        Ok(Self::new(rect, true, channels))
    }
}
