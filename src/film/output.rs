//! Output files: tiles in, in any order; a whole file out, at the end or not at all.

use std::io::{self, Write};
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use super::atomic::Target;
use super::blocks::{Block, Blocks, Spool};
use super::exr::ExrFormat;
use super::layer::{FilmTile, Layer};
use super::png::PngFormat;
use crate::diag::Diagnostic;
use crate::sample::PixelRect;

/// What to write where.
#[derive(Clone, Debug)]
pub struct OutputSettings {
    /// `.png` or `.exr`. EXR holds all layers; PNG is a view of one.
    pub path: PathBuf,
    /// Size of the whole picture.
    pub size: [u32; 2],
    /// The part of it that is rendered. An EXR file has this as its data window, the whole picture as its display
    /// window; a PNG file has the size of the crop, and its place as an `oFFs` chunk.
    pub crop: PixelRect,
    /// The layers of every tile that will come, in order.
    pub layers: Vec<Layer>,
    /// The layer that a PNG shows.
    pub png_layer: Layer,
    /// Whether a PNG of `rgba` or `color` has an alpha channel: the background is transparent.
    pub transparent: bool,
    /// Further facts for the file's header, such as scene, seed and sample count: name and text.
    pub metadata: Vec<(String, String)>,
}

/// An open output file. Dropped unfinished, it leaves no trace and the old file untouched.
///
/// Until the end, pixels wait in a nameless file in the same folder, so even a killed process leaves nothing behind.
/// Tiles may come from several threads; packing them runs on the calling thread, outside the lock.
pub struct Output {
    target: Target,
    format: Format,
    layers: Vec<Layer>,
    state: Mutex<State>,
}

const KNOWN: &str = "known types are .png and .exr";

enum Format {
    Exr(Box<ExrFormat>),
    Png(PngFormat),
}

struct State {
    blocks: Blocks,
    /// The first failure; nothing good can come after it.
    failure: Option<Diagnostic>,
}

impl Output {
    /// Opens an output.
    ///
    /// # Errors
    /// If the extension is not known, the folder is missing or cannot be written to, the path is not that of a plain
    /// file, a layer is asked for twice, or a PNG shows a layer that is not among the layers.
    pub fn create(settings: OutputSettings) -> Result<Self, Diagnostic> {
        let format = Format::new(&settings)?;
        let target = Target::new(&settings.path)?;
        let spool = target.spool().map_err(|error| target.failure(&error))?;
        Ok(Self::new(settings, format, target, Box::new(spool)))
    }

    fn new(settings: OutputSettings, format: Format, target: Target, spool: Box<dyn Spool>) -> Self {
        let blocks = Blocks::new(settings.crop, format.value_bytes(), spool);
        Self { target, format, layers: settings.layers, state: Mutex::new(State { blocks, failure: None }) }
    }

    /// Writes a tile; tiles come in any order, each pixel once. Pixels outside the crop are left out.
    ///
    /// # Errors
    /// If the disk is full or gone. From then on every call gives the same error.
    pub fn write(&self, tile: &FilmTile) -> Result<(), Diagnostic> {
        self.check(tile)?;
        let planes = self.format.planes(&tile.channels);
        let full = self.with_blocks(|blocks| {
            blocks.put(tile.rect, &planes).map_err(|_| self.bug("some pixels were written twice"))
        })?;
        full.into_iter().try_for_each(|block| self.store(block))
    }

    /// Fills what was never written with transparent black, closes the file and gives it its name.
    ///
    /// # Errors
    /// As [`Self::write`]; the old file is then untouched.
    pub fn finish(self) -> Result<(), Diagnostic> {
        self.finish_through(|sink| Box::new(sink))
    }

    /// As [`Self::finish`], with something between this and the disk.
    fn finish_through(
        self,
        wrap: impl for<'a> FnOnce(&'a mut dyn Write) -> Box<dyn Write + 'a>,
    ) -> Result<(), Diagnostic> {
        let Self { target, format, state, .. } = self;
        let State { mut blocks, failure } = state.into_inner().unwrap_or_else(PoisonError::into_inner);
        if let Some(failure) = failure {
            return Err(failure);
        }
        let finish = || {
            for block in blocks.take_partial() {
                blocks.store(block.index, &format.pack(block)?)?;
            }
            target.replace(|sink| format.write(&mut blocks, &mut *wrap(sink)))
        };
        finish().map_err(|error| target.failure(&error))
    }

    fn store(&self, block: Block) -> Result<(), Diagnostic> {
        let index = block.index;
        let packed = self.format.pack(block);
        self.with_blocks(|blocks| {
            packed.and_then(|packed| blocks.store(index, &packed)).map_err(|error| self.target.failure(&error))
        })
    }

    fn with_blocks<T>(&self, work: impl FnOnce(&mut Blocks) -> Result<T, Diagnostic>) -> Result<T, Diagnostic> {
        // A panic elsewhere cannot leave the blocks half-changed in a way that their counts would not show.
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(failure) = &state.failure {
            return Err(failure.clone());
        }
        let result = work(&mut state.blocks);
        if let Err(failure) = &result {
            state.failure = Some(failure.clone());
        }
        result
    }

    /// Whether a tile is made as announced.
    fn check(&self, tile: &FilmTile) -> Result<(), Diagnostic> {
        let expected: usize = self.layers.iter().map(|layer| layer.channels().len()).sum();
        let fits = tile.channels.len() == expected && tile.channels.iter().all(|c| c.len() == tile.rect.pixels());
        if fits { Ok(()) } else { Err(self.bug("a tile does not have the channels that were announced")) }
    }

    fn bug(&self, message: &str) -> Diagnostic {
        Diagnostic::error(message).in_file(self.target.path()).hint("this is a bug in the program, not in the scene")
    }
}

impl Format {
    fn new(settings: &OutputSettings) -> Result<Self, Diagnostic> {
        let in_file = |diagnostic: Diagnostic| diagnostic.in_file(&settings.path);
        if let Some(twice) = settings.layers.iter().enumerate().find(|(i, layer)| settings.layers[..*i].contains(layer))
        {
            return Err(in_file(Diagnostic::error(format!("layer `{}` is asked for twice", twice.1))));
        }
        let extension = settings.path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("exr") => ExrFormat::new(settings).map(|exr| Self::Exr(Box::new(exr))),
            Some("png") => PngFormat::new(settings).map(Self::Png),
            Some(other) => Err(Diagnostic::error(format!("cannot write pictures of type `.{other}`")).hint(KNOWN)),
            None => Err(Diagnostic::error("the name of the picture has no extension to tell its type").hint(KNOWN)),
        }
        .map_err(in_file)
    }

    fn value_bytes(&self) -> Vec<usize> {
        match self {
            Self::Exr(exr) => exr.value_bytes(),
            Self::Png(png) => vec![png.pixel_bytes()],
        }
    }

    fn planes(&self, channels: &[Vec<f32>]) -> Vec<Vec<u8>> {
        match self {
            Self::Exr(exr) => exr.planes(channels),
            Self::Png(png) => vec![png.pixels(channels)],
        }
    }

    fn pack(&self, block: Block) -> io::Result<Vec<u8>> {
        match self {
            Self::Exr(exr) => exr.pack(block),
            Self::Png(_) => Ok(PngFormat::pack(block)),
        }
    }

    fn write(&self, blocks: &mut Blocks, sink: &mut dyn Write) -> io::Result<()> {
        match self {
            Self::Exr(exr) => exr.write(blocks, sink),
            Self::Png(png) => png.write(blocks, sink),
        }
    }
}
