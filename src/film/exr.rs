//! OpenEXR: one part with all layers as channels `layer.component`, in tiles, ZIP-compressed.
//!
//! The `exr` crate describes the header and packs the blocks. Its own writer wants all blocks in one call and orders
//! custom attributes by a hash map; here blocks come over time and the same picture must give the same bytes, so this
//! module puts the file together from the crate's parts: header, offset table, blocks in row order.

use std::io::{self, Write};

use exr::block::{BlockIndex, UncompressedBlock};
use exr::compression::Compression;
use exr::error::Error;
use exr::math::{RoundingMode, Vec2};
use exr::meta::attribute::{
    self, AttributeValue, ChannelDescription, IntegerBounds, LevelMode, LineOrder, SampleType, Text, TileDescription,
};
use exr::meta::header::{Header, ImageAttributes, LayerAttributes};
use exr::meta::{BlockDescription, MetaData, magic_number};
use half::f16;

use super::blocks::{Block, Blocks, SIDE};
use super::layer::{Channel, ChannelFormat};
use super::output::OutputSettings;
use crate::diag::Diagnostic;

/// A file to be.
pub(super) struct ExrFormat {
    header: Header,
    /// All bytes before the offset table.
    head: Vec<u8>,
    /// The channels in the order of the file, each with its place in a tile.
    channels: Vec<(usize, Channel)>,
}

impl ExrFormat {
    pub(super) fn new(settings: &OutputSettings) -> Result<Self, Diagnostic> {
        let mut channels: Vec<_> = settings.layers.iter().flat_map(|layer| layer.channels()).enumerate().collect();
        channels.sort_by(|(_, a), (_, b)| a.name.as_bytes().cmp(b.name.as_bytes()));
        for (_, channel) in &channels {
            check_name("channel", &channel.name)?;
        }

        let crop = settings.crop;
        let description =
            |(_, channel): &(usize, Channel)| ChannelDescription::named(text(&channel.name), sample_type(channel));
        let size = Vec2(crop.width() as usize, crop.height() as usize);
        let blocks = BlockDescription::Tiles(TileDescription {
            tile_size: Vec2(SIDE as usize, SIDE as usize),
            level_mode: LevelMode::Singular,
            rounding_mode: RoundingMode::Down,
        });
        let [width, height] = settings.size.map(|pixels| pixels as usize);
        let mut header = Header::new(Text::default(), size, channels.iter().map(description).collect())
            .with_encoding(Compression::ZIP16, blocks, LineOrder::Increasing)
            .with_shared_attributes(ImageAttributes::new(IntegerBounds::from_dimensions(Vec2(width, height))))
            .with_attributes(LayerAttributes {
                layer_name: None,
                layer_position: Vec2(crop.x0, crop.y0),
                software_name: Some(text(concat!("Tusche ", env!("CARGO_PKG_VERSION")))),
                ..LayerAttributes::default()
            });

        let attributes: Vec<_> =
            settings.metadata.iter().map(|(name, value)| (text(name), AttributeValue::Text(text(value)))).collect();
        for (name, _) in &settings.metadata {
            check_name("attribute", name)?;
        }
        header.own_attributes.other.extend(attributes.iter().cloned());
        let cannot = |error: Error| Diagnostic::error(format!("cannot make an EXR file of this picture: {error}"));
        let requirements = MetaData::validate(std::slice::from_ref(&header), true).map_err(cannot)?;
        header.own_attributes.other.clear();

        let mut head = Vec::new();
        let mut write_head = || {
            magic_number::write(&mut head)?;
            requirements.write(&mut head)?;
            header.write(&mut head)?;
            // The header's end mark has to come after the attributes, in their own order.
            let end = head.pop();
            for (name, value) in &attributes {
                attribute::write(name.as_slice(), value, &mut head)?;
            }
            head.extend(end);
            Ok(())
        };
        write_head().map_err(cannot)?;
        Ok(Self { header, head, channels })
    }

    /// Bytes of one value of each channel.
    pub(super) fn value_bytes(&self) -> Vec<usize> {
        self.channels.iter().map(|(_, channel)| sample_type(channel).bytes_per_sample()).collect()
    }

    /// The channels of a tile as the file stores them.
    pub(super) fn planes(&self, channels: &[Vec<f32>]) -> Vec<Vec<u8>> {
        self.channels.iter().map(|(place, channel)| encode(&channels[*place], channel.format)).collect()
    }

    /// A block as it lies in the file.
    pub(super) fn pack(&self, block: Block) -> io::Result<Vec<u8>> {
        let origin = self.header.own_attributes.layer_position;
        let block = UncompressedBlock {
            index: BlockIndex {
                layer: 0,
                pixel_position: Vec2((block.rect.x0 - origin.x()) as usize, (block.rect.y0 - origin.y()) as usize),
                pixel_size: Vec2(block.rect.width() as usize, block.rect.height() as usize),
                level: Vec2(0, 0),
            },
            data: block.bytes,
        };
        let mut packed = Vec::new();
        block
            .compress_to_chunk(std::slice::from_ref(&self.header))
            .and_then(|chunk| chunk.write(&mut packed, 1))
            .map_err(io_error)?;
        Ok(packed)
    }

    /// Writes the file. Blocks that are not there are transparent black.
    pub(super) fn write(&self, blocks: &mut Blocks, sink: &mut dyn Write) -> io::Result<()> {
        for index in 0..blocks.count() {
            if blocks.stored_bytes(index).is_none() {
                let rect = blocks.block_rect(index);
                let empty = Block { index, rect, bytes: vec![0; blocks.block_bytes(rect)] };
                blocks.store(index, &self.pack(empty)?)?;
            }
        }
        sink.write_all(&self.head)?;
        let mut offset = (self.head.len() + blocks.count() * size_of::<u64>()) as u64;
        for index in 0..blocks.count() {
            sink.write_all(&offset.to_le_bytes())?;
            offset += blocks.stored_bytes(index).unwrap_or(0);
        }
        for index in 0..blocks.count() {
            if let Some(packed) = blocks.load(index)? {
                sink.write_all(&packed)?;
            }
        }
        Ok(())
    }
}

/// An attribute or channel name must survive as a C string.
fn check_name(what: &str, name: &str) -> Result<(), Diagnostic> {
    let problem = match name {
        "" => "is empty",
        _ if name.len() > 255 => "is longer than 255 bytes",
        _ if name.contains('\0') => "contains a zero byte",
        _ => return Ok(()),
    };
    Err(Diagnostic::error(format!("cannot make an EXR file of this picture: the {what} name {name:?} {problem}")))
}

/// UTF-8, as OpenEXR says; the crate's own conversion knows only Latin-1.
fn text(text: &str) -> Text {
    Text::from_slice_unchecked(text.as_bytes())
}

fn sample_type(channel: &Channel) -> SampleType {
    match channel.format {
        ChannelFormat::Half => SampleType::F16,
        ChannelFormat::Float => SampleType::F32,
        ChannelFormat::Uint => SampleType::U32,
    }
}

fn encode(values: &[f32], format: ChannelFormat) -> Vec<u8> {
    fn each<const N: usize>(values: &[f32], bytes: impl Fn(f32) -> [u8; N]) -> Vec<u8> {
        let mut encoded = vec![0; values.len() * N];
        encoded.chunks_exact_mut(N).zip(values).for_each(|(out, value)| out.copy_from_slice(&bytes(*value)));
        encoded
    }
    // A light brighter than a half can say must not become infinite: compositing would spread it as NaN.
    let half = |value: f32| f16::from_f32(value.clamp(f16::MIN.to_f32(), f16::MAX.to_f32()));
    match format {
        ChannelFormat::Half => each(values, |value| half(value).to_ne_bytes()),
        ChannelFormat::Float => each(values, f32::to_ne_bytes),
        ChannelFormat::Uint => each(values, |value| value.to_bits().to_ne_bytes()),
    }
}

fn io_error(error: Error) -> io::Error {
    match error {
        Error::Io(error) => error,
        error => io::Error::other(error.to_string()),
    }
}
