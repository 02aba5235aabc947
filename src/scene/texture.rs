//! Images that scripts look up: decoding, and lookups.
//!
//! An [`Image`] holds finite numbers only, so a lookup of finite pixels is finite and inside [`Texture::range`], whatever
//! the texture coordinates are: the shading host may bound a shader's outputs by it. A picture takes many samples per
//! pixel, and each looks up the full image, unless the texture asks for [`TextureFilter::Mipmap`].

use std::io::Cursor;
use std::path::Path;
use std::sync::{Arc, LazyLock, OnceLock};

use image::{DynamicImage, ImageReader};

use super::ids::TextureId;
use crate::diag::Diagnostic;
use crate::files::FileStore;
use crate::math::{Affine2, Vec2, Vec4, linear_from_srgb, portable};

/// The largest width or height of an image, in pixels.
pub const MAX_SIDE: u32 = 32_768;

/// The most pixels of an image. A small file can claim a huge image; this bounds what it can make us allocate.
pub const MAX_PIXELS: u64 = 1 << 27;

/// Float pixels are clamped to ± this, so that interpolating between two of them cannot overflow.
const MAX_FLOAT: f32 = 1e30;

/// Linear values of the 256 sRGB-encoded ones.
pub(super) static LINEAR_FROM_SRGB8: LazyLock<[f32; 256]> =
    LazyLock::new(|| std::array::from_fn(|i| linear_from_srgb(i as f32 / 255.0)));

/// What happens outside 0 … 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The image repeats.
    #[default]
    Repeat,
    /// The image repeats, every second time mirrored.
    Mirror,
    /// The border pixels go on.
    Clamp,
}

/// How pixels are interpolated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TextureFilter {
    /// The nearest pixel.
    Nearest,
    /// Bilinear.
    #[default]
    Linear,
    /// Bilinear in the two of a series of smaller images that fit the width of a pixel, and between them.
    Mipmap,
}

/// Pixels of an image, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub enum Pixels {
    /// Eight bits a channel. `srgb`: colour (not alpha) is sRGB-encoded and decoded on lookup.
    Rgba8 {
        /// Width × height pixels.
        data: Vec<[u8; 4]>,
        /// Whether red, green and blue are sRGB-encoded.
        srgb: bool,
    },
    /// Linear floats.
    Rgba32F {
        /// Width × height pixels.
        data: Vec<[f32; 4]>,
    },
}

/// A decoded image; textures that differ only in their sampler share it.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Width in pixels, at least 1.
    pub width: u32,
    /// Height in pixels, at least 1.
    pub height: u32,
    /// The pixels.
    pub pixels: Pixels,
}

/// An image with a sampler.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// For messages: a path or a glTF image name.
    pub name: String,
    /// The pixels.
    pub image: Arc<Image>,
    /// Outside 0 … 1 in u and in v.
    pub wrap: [Wrap; 2],
    /// Between pixels.
    pub filter: TextureFilter,
    /// Smaller images, each half as large as the one before; made when first looked up.
    pub levels: OnceLock<Vec<Image>>,
}

impl Texture {
    /// Whether lookups give the same everywhere; quick where the image is shared.
    #[must_use]
    pub fn looks_like(&self, other: &Self) -> bool {
        self.wrap == other.wrap
            && self.filter == other.filter
            && (Arc::ptr_eq(&self.image, &other.image) || self.image == other.image)
    }
}

/// A material's use of a texture: which texture, which uv set, and where on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureRef {
    /// The texture.
    pub texture: TextureId,
    /// Which uv set of the mesh.
    pub uv_set: u32,
    /// Applied to the uv of the mesh before the lookup (KHR_texture_transform).
    pub transform: Affine2,
}

impl Image {
    /// The linear value of a pixel; `x` and `y` are inside the image.
    fn pixel(&self, x: u32, y: u32) -> Vec4 {
        let index = y as usize * self.width as usize + x as usize;
        match &self.pixels {
            Pixels::Rgba8 { data, srgb } => linear_from_rgba8(data[index], *srgb),
            Pixels::Rgba32F { data } => Vec4::from(data[index]),
        }
    }
}

fn linear_from_rgba8([r, g, b, a]: [u8; 4], srgb: bool) -> Vec4 {
    let plain = |c: u8| f32::from(c) / 255.0;
    if srgb {
        let [r, g, b] = [r, g, b].map(|c| LINEAR_FROM_SRGB8[usize::from(c)]);
        Vec4::new(r, g, b, plain(a))
    } else {
        Vec4::new(plain(r), plain(g), plain(b), plain(a))
    }
}

impl Texture {
    /// The linear value at a place: u from the left, v down from the top, the image being 0 … 1 (as in glTF).
    ///
    /// Texture coordinates that are not finite read as 0. Alpha is not multiplied in.
    #[must_use]
    pub fn sample(&self, uv: Vec2) -> Vec4 {
        let image = &*self.image;
        let u = fold(uv.x, self.wrap[0]);
        let v = fold(uv.y, self.wrap[1]);
        match self.filter {
            TextureFilter::Nearest => {
                let near = |t: f32, size: u32| ((t * size as f32) as u32).min(size - 1);
                image.pixel(near(u, image.width), near(v, image.height))
            }
            TextureFilter::Linear | TextureFilter::Mipmap => self.bilinear(image, u, v),
        }
    }

    /// The same for a pixel that covers `width` units of uv; only [`TextureFilter::Mipmap`] makes a difference.
    ///
    /// With `level = log2(width * sqrt(columns * rows))` of the image, clamped to the levels there are: linear between
    /// the levels below and above.
    #[must_use]
    pub fn sample_wide(&self, uv: Vec2, width: f32) -> Vec4 {
        let image = &*self.image;
        let pixels = width * (image.width as f32 * image.height as f32).sqrt();
        if self.filter != TextureFilter::Mipmap || pixels <= 1.0 || pixels.is_nan() {
            return self.sample(uv);
        }
        let levels = self.levels.get_or_init(|| smaller(image));
        let level = portable::log2(pixels).min(levels.len() as f32);
        let below = level.floor();
        let (u, v) = (fold(uv.x, self.wrap[0]), fold(uv.y, self.wrap[1]));
        let of = |level: usize| level.checked_sub(1).map_or(image, |index| &levels[index]);
        let low = self.bilinear(of(below as usize), u, v);
        let high = self.bilinear(of((below as usize + 1).min(levels.len())), u, v);
        between_pixels(low, high, level - below)
    }

    fn bilinear(&self, image: &Image, u: f32, v: f32) -> Vec4 {
        let (x0, x1, fx) = neighbors(u, image.width, self.wrap[0]);
        let (y0, y1, fy) = neighbors(v, image.height, self.wrap[1]);
        let top = between_pixels(image.pixel(x0, y0), image.pixel(x1, y0), fx);
        let bottom = between_pixels(image.pixel(x0, y1), image.pixel(x1, y1), fx);
        between_pixels(top, bottom, fy)
    }

    /// The least and the greatest linear value of each channel (red, green, blue, alpha): no lookup leaves them.
    ///
    /// Looks at every pixel; callers keep the result.
    #[must_use]
    pub fn range(&self) -> ([f32; 4], [f32; 4]) {
        match &self.image.pixels {
            Pixels::Rgba8 { data, srgb } => {
                // Decoding is monotonic, so the bounds of the codes are enough.
                let (least, greatest) = bounds(data.iter().copied(), [u8::MAX; 4], [0; 4], Ord::min, Ord::max);
                (linear_from_rgba8(least, *srgb).into(), linear_from_rgba8(greatest, *srgb).into())
            }
            Pixels::Rgba32F { data } => {
                let (most, least) = ([f32::INFINITY; 4], [f32::NEG_INFINITY; 4]);
                bounds(data.iter().copied(), most, least, f32::min, f32::max)
            }
        }
    }
}

/// Images of half the size, and half of that, down to one pixel. Each pixel is the mean of those it covers, within them.
fn smaller(image: &Image) -> Vec<Image> {
    let mut levels: Vec<Image> = Vec::new();
    loop {
        let next = {
            let last = levels.last().unwrap_or(image);
            if last.width == 1 && last.height == 1 {
                return levels;
            }
            halved(last)
        };
        levels.push(next);
    }
}

fn halved(image: &Image) -> Image {
    let (width, height) = ((image.width / 2).max(1), (image.height / 2).max(1));
    let mut data = Vec::with_capacity(width as usize * height as usize);
    for y in 0..height {
        for x in 0..width {
            let (mut sum, mut weights) = (Vec4::ZERO, 0.0);
            let (mut low, mut high) = (Vec4::INFINITY, Vec4::NEG_INFINITY);
            for (row, row_weight) in covered(y, height, image.height) {
                for (column, weight) in covered(x, width, image.width) {
                    let pixel = image.pixel(column, row);
                    sum += pixel * (weight * row_weight);
                    weights += weight * row_weight;
                    (low, high) = (low.min(pixel), high.max(pixel));
                }
            }
            data.push((sum / weights).clamp(low, high).to_array());
        }
    }
    Image { width, height, pixels: Pixels::Rgba32F { data } }
}

/// The pixels of a row of `from` that pixel `index` of `to` covers, each with how much of it.
fn covered(index: u32, to: u32, from: u32) -> impl Iterator<Item = (u32, f32)> {
    let scale = f64::from(from) / f64::from(to);
    let (start, end) = (f64::from(index) * scale, f64::from(index + 1) * scale);
    let last = (end.ceil() as u32).min(from);
    (start as u32..last).map(move |pixel| {
        let (left, right) = (f64::from(pixel).max(start), f64::from(pixel + 1).min(end));
        (pixel, (right - left).max(0.0) as f32)
    })
}

fn bounds<T: Copy>(
    pixels: impl Iterator<Item = [T; 4]>,
    most: [T; 4],
    least: [T; 4],
    min: impl Fn(T, T) -> T,
    max: impl Fn(T, T) -> T,
) -> ([T; 4], [T; 4]) {
    pixels.fold((most, least), |(low, high), pixel| {
        (std::array::from_fn(|c| min(low[c], pixel[c])), std::array::from_fn(|c| max(high[c], pixel[c])))
    })
}

/// A texture coordinate brought into 0 … 1 (both included).
#[inline(always)]
pub(super) fn fold(t: f32, wrap: Wrap) -> f32 {
    if !t.is_finite() {
        return 0.0;
    }
    match wrap {
        Wrap::Repeat => t - t.floor(),
        Wrap::Mirror => {
            let t = (t * 0.5 - (t * 0.5).floor()) * 2.0;
            if t > 1.0 { 2.0 - t } else { t }
        }
        Wrap::Clamp => t.clamp(0.0, 1.0),
    }
}

/// The two pixels whose centers are around a folded coordinate, and how far it is from the first to the second.
fn neighbors(t: f32, size: u32, wrap: Wrap) -> (u32, u32, f32) {
    let x = t * size as f32 - 0.5;
    let left = x.floor();
    // From −1 to size − 1, so the cast is exact.
    let left_index = left as i64;
    let size = i64::from(size);
    let inside = |i: i64| match wrap {
        Wrap::Repeat => i.rem_euclid(size) as u32,
        // At a mirror's seam the pixel beyond the border is the border pixel itself.
        Wrap::Mirror | Wrap::Clamp => i.clamp(0, size - 1) as u32,
    };
    (inside(left_index), inside(left_index + 1), x - left)
}

/// Between two values, and never beyond either whatever the rounding.
#[inline(always)]
pub(super) fn between(a: f32, b: f32, t: f32) -> f32 {
    let (low, high) = if a < b { (a, b) } else { (b, a) };
    let value = a + (b - a) * t;
    let value = if value > low { value } else { low };
    if value < high { value } else { high }
}

/// [`between`] of each channel.
fn between_pixels(a: Vec4, b: Vec4, t: f32) -> Vec4 {
    Vec4::from_array(std::array::from_fn(|channel| between(a[channel], b[channel], t)))
}

/// The image of a file's bytes, which is decoded only if `files` does not know it already.
///
/// # Errors
/// As [`decode`].
pub fn read_image(path: &Path, bytes: &Arc<[u8]>, srgb: bool, files: &FileStore) -> Result<Arc<Image>, Diagnostic> {
    let encoding = if srgb { "sRGB" } else { "linear" };
    files.make((path, encoding), bytes, |bytes| decode(path, bytes, srgb))
}

/// Decodes a PNG, JPEG, Radiance HDR or OpenEXR image; the content tells which, not the name.
///
/// Eight bits a channel stay eight bits. More, and floats, become linear floats; `srgb` says how integer colour (not
/// alpha) is encoded. Colour profiles and gamma chunks are ignored, as glTF demands. In float images, NaN reads as 0.
///
/// # Errors
/// If the format is not known, the data are damaged, or the image is larger than [`MAX_SIDE`] or [`MAX_PIXELS`].
/// `path` only names the image in messages.
pub fn decode(path: &Path, bytes: &[u8], srgb: bool) -> Result<Image, Diagnostic> {
    let fault = |message: String| Diagnostic::error(message).in_file(path);
    if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        return decode_exr(bytes).map_err(fault);
    }
    let reader = || ImageReader::new(Cursor::new(bytes)).with_guessed_format();
    let unreadable = |error: &dyn std::fmt::Display| fault(format!("cannot decode this image: {error}"));
    let sized = reader().map_err(|error| unreadable(&error))?;
    if sized.format().is_none() {
        return Err(
            fault("this is not an image that Tusche reads".into()).hint("PNG, JPEG, Radiance HDR and OpenEXR are")
        );
    }
    let (width, height) = sized.into_dimensions().map_err(|error| unreadable(&error))?;
    check_size(u64::from(width), u64::from(height)).map_err(fault)?;
    let mut limited = reader().map_err(|error| unreadable(&error))?;
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(MAX_PIXELS * 16);
    limited.limits(limits);
    let image = limited.decode().map_err(|error| unreadable(&error))?;
    let pixels = match image {
        DynamicImage::ImageLuma8(_)
        | DynamicImage::ImageLumaA8(_)
        | DynamicImage::ImageRgb8(_)
        | DynamicImage::ImageRgba8(_) => {
            Pixels::Rgba8 { data: image.into_rgba8().pixels().map(|pixel| pixel.0).collect(), srgb }
        }
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
            Pixels::Rgba32F { data: image.into_rgba32f().pixels().map(|pixel| pixel.0.map(finite)).collect() }
        }
        _ => {
            let linear = |c: u16| {
                let value = f32::from(c) / 65_535.0;
                if srgb { linear_from_srgb(value) } else { value }
            };
            let pixel = |[r, g, b, a]: [u16; 4]| [linear(r), linear(g), linear(b), f32::from(a) / 65_535.0];
            Pixels::Rgba32F { data: image.into_rgba16().pixels().map(|p| pixel(p.0)).collect() }
        }
    };
    Ok(Image { width, height, pixels })
}

fn decode_exr(bytes: &[u8]) -> Result<Image, String> {
    use exr::prelude::{ReadChannels, ReadLayers, read};

    let unreadable = |error: &exr::error::Error| format!("cannot decode this image: {error}");
    let meta =
        exr::meta::MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(|error| unreadable(&error))?;
    for header in &meta.headers {
        check_size(header.layer_size.width() as u64, header.layer_size.height() as u64)?;
    }
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .rgba_channels(
            |size, _| (size.width(), vec![[0.0_f32; 4]; size.area()]),
            |(width, pixels), position, (r, g, b, a): (f32, f32, f32, f32)| {
                pixels[position.y() * *width + position.x()] = [r, g, b, a].map(finite);
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(|error| unreadable(&error))?;
    let (width, data) = image.layer_data.channel_data.pixels;
    let height = data.len() / width.max(1);
    Ok(Image { width: width as u32, height: height as u32, pixels: Pixels::Rgba32F { data } })
}

fn check_size(width: u64, height: u64) -> Result<(), String> {
    let side = u64::from(MAX_SIDE);
    if width == 0 || height == 0 {
        Err("this image has no pixels".into())
    } else if width > side || height > side || width * height > MAX_PIXELS {
        Err(format!(
            "this image of {width} × {height} pixels is too large: at most {side} pixels each way and {} million in all \
             are read",
            MAX_PIXELS / 1_000_000
        ))
    } else {
        Ok(())
    }
}

fn finite(value: f32) -> f32 {
    if value.is_nan() { 0.0 } else { value.clamp(-MAX_FLOAT, MAX_FLOAT) }
}
