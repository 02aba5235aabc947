//! Output files: tiles in, in any order; a whole file out, at the end or not at all.

use std::io::{self, Write};
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use super::atomic::Target;
use super::blocks::{Block, Blocks, Spool};
use super::exr::ExrFormat;
use super::layer::{FilmTile, Layer};
use super::png::PngFormat;
use crate::clock::CpuClock;
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
    Png(Box<PngFormat>),
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
    /// file, the crop is empty, a layer is asked for twice, a PNG shows a layer that is not among the layers, or the
    /// format cannot hold a name.
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
        let planes = self.format.planes(tile);
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

    /// Makes an output of a whole picture in memory and forgets it. Returns the CPU seconds that this takes while tiles come, and
    /// those at the end.
    ///
    /// # Errors
    /// As [`Self::create`], but for what has to do with the disk.
    pub(crate) fn rehearse(settings: OutputSettings, tile: &FilmTile) -> Result<[f64; 2], Diagnostic> {
        let format = Format::new(&settings)?;
        let failed = |error: io::Error| Diagnostic::error(format!("cannot pack this picture: {error}"));
        let clock = CpuClock::thread();
        let mut blocks = Blocks::new(settings.crop, format.value_bytes(), Box::new(io::Cursor::new(Vec::new())));
        // The picture is whole and its pixels come once.
        let full = blocks.put(tile.rect, &format.planes(tile)).unwrap_or_default();
        for block in full {
            blocks.store(block.index, &format.pack(block).map_err(failed)?).map_err(failed)?;
        }
        let coming = clock.seconds();
        format.write(&mut blocks, &mut io::sink()).map_err(failed)?;
        Ok([coming, clock.seconds() - coming])
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
        if settings.crop.pixels() == 0 {
            return Err(in_file(Diagnostic::error("the part of the picture to write has no pixels")));
        }
        let extension = settings.path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("exr") => ExrFormat::new(settings).map(|exr| Self::Exr(Box::new(exr))),
            Some("png") => PngFormat::new(settings).map(|png| Self::Png(Box::new(png))),
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

    fn planes(&self, tile: &FilmTile) -> Vec<Vec<u8>> {
        match self {
            Self::Exr(exr) => exr.planes(&tile.channels),
            Self::Png(png) => vec![png.pixels(tile)],
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

#[cfg(test)]
mod tests {
    use std::fs;
    use std::io::{Cursor, ErrorKind, Read, Seek, SeekFrom};
    use std::path::Path;

    use super::*;

    /// A disk that is full after so many bytes.
    struct Full<W> {
        inner: W,
        room: usize,
    }

    impl<W: Write> Write for Full<W> {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            if bytes.len() > self.room {
                return Err(ErrorKind::StorageFull.into());
            }
            self.room -= bytes.len();
            self.inner.write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            self.inner.flush()
        }
    }

    impl<W: Read> Read for Full<W> {
        fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
            self.inner.read(bytes)
        }
    }

    impl<W: Seek> Seek for Full<W> {
        fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
            self.inner.seek(to)
        }
    }

    const SIZE: [u32; 2] = [256, 128];

    /// An output over an old file, on a disk with this much room for what waits.
    fn output(folder: &tempfile::TempDir, name: &str, room: usize) -> (PathBuf, Output) {
        let path = folder.path().join(name);
        fs::write(&path, "old").unwrap();
        let settings = OutputSettings {
            path: path.clone(),
            size: SIZE,
            crop: PixelRect::of_size(SIZE),
            layers: vec![Layer::Rgba, Layer::Depth],
            png_layer: Layer::Rgba,
            transparent: false,
            metadata: Vec::new(),
        };
        let (format, target) = (Format::new(&settings).unwrap(), Target::new(&path).unwrap());
        (path, Output::new(settings, format, target, Box::new(Full { inner: Cursor::new(Vec::new()), room })))
    }

    fn tile(rect: PixelRect) -> FilmTile {
        // Values that do not compress.
        let noise = |i: u32| {
            let bits = (i ^ i >> 7).wrapping_mul(0x9E37_79B9);
            (bits ^ bits >> 15).wrapping_mul(0x85EB_CA6B) as f32 / 4_294_967_296.0
        };
        let channel = |c: u32| (0..rect.pixels() as u32).map(move |i| noise(i * 5 + c)).collect();
        FilmTile { rect, channels: (0..5).map(channel).collect() }
    }

    fn check_old_survives(folder: &tempfile::TempDir, path: &Path, error: &Diagnostic) {
        let message = format!("{}: error: cannot write this file: the disk is full", path.display());
        assert_eq!(error.to_string(), format!("{message} (free some space and try again)"));
        assert_eq!(fs::read_to_string(path).unwrap(), "old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn the_old_file_survives_a_disk_that_fills_while_writing() {
        for name in ["a.exr", "a.png"] {
            let folder = tempfile::tempdir().unwrap();
            let (path, output) = output(&folder, name, 20_000);
            let error = output.write(&tile(PixelRect::of_size(SIZE))).unwrap_err();
            check_old_survives(&folder, &path, &error);
            assert_eq!(output.write(&tile(PixelRect::of_size(SIZE))).unwrap_err(), error);
            assert_eq!(output.finish().unwrap_err(), error);
            check_old_survives(&folder, &path, &error);
        }
    }

    #[test]
    fn the_old_file_survives_a_disk_that_fills_at_the_end() {
        for name in ["a.exr", "a.png"] {
            // With and without unwritten blocks to fill in.
            for part in [SIZE, [100, 100]] {
                let begun = || {
                    let folder = tempfile::tempdir().unwrap();
                    let (path, output) = output(&folder, name, usize::MAX);
                    output.write(&tile(PixelRect::of_size(part))).unwrap();
                    (folder, path, output)
                };
                let (_folder, path, output) = begun();
                output.finish().unwrap();
                let length = fs::metadata(path).unwrap().len() as usize;
                assert!(length > 20_000, "{name} of {length} bytes");
                for room in (0..length).step_by(length / 12).chain([length - 1, length - 13]) {
                    let (folder, path, output) = begun();
                    let result = output.finish_through(|sink| Box::new(Full { inner: sink, room }));
                    let error = result.expect_err(&format!("{name}, {room} of {length} bytes"));
                    check_old_survives(&folder, &path, &error);
                }
            }
        }
    }

    #[test]
    fn the_old_file_survives_when_only_the_last_blocks_fail() {
        let folder = tempfile::tempdir().unwrap();
        let (path, output) = output(&folder, "a.exr", 10);
        output.write(&tile(PixelRect::of_size([10, 10]))).unwrap();
        let error = output.finish().unwrap_err();
        check_old_survives(&folder, &path, &error);
    }
}
