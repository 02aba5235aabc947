//! The folder of a study: what is kept so that a stopped study goes on where it was.

use std::io::Cursor;
use std::path::{Path, PathBuf};

use exr::prelude::{AnyChannel, AnyChannels, FlatSamples, Image, WritableImage};
use serde::{Deserialize, Serialize};

use super::measure::{ByRegion, Errors, Shot};
use crate::diag::Diagnostic;
use crate::film::{Picture, check_writable, write_atomically};
use crate::math::srgb_from_linear;

/// A folder that a study writes to.
#[derive(Clone, Debug)]
pub struct Folder {
    path: PathBuf,
}

/// What is known of a reference beside its picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct ReferenceNote {
    scene: String,
    samples: u32,
    /// Its own errors, estimated: RMSE and FLIP of the whole picture and its regions, coverage, position.
    rmse: [Option<f64>; 4],
    flip: [Option<f64>; 4],
    coverage: Option<f64>,
    position: Option<f64>,
    crossings: Option<f64>,
}

impl Folder {
    /// Opens a folder, and makes it if its parent is there.
    ///
    /// # Errors
    /// If it cannot be made or written to.
    pub fn open(path: &Path) -> Result<Self, Diagnostic> {
        let [pictures, plots] = ["pictures", "plots"].map(|name| path.join(name));
        for folder in [path, &pictures, &plots] {
            match std::fs::create_dir(folder) {
                Err(error) if error.kind() == std::io::ErrorKind::AlreadyExists => {
                    if !folder.is_dir() {
                        let fault = Diagnostic::error("a study writes to a folder, and this is a file").in_file(folder);
                        return Err(fault.hint("name another folder"));
                    }
                }
                Err(error) => {
                    return Err(Diagnostic::error(format!("cannot make this folder: {error}")).in_file(folder));
                }
                Ok(()) => {}
            }
        }
        let folder = Self { path: path.to_owned() };
        check_writable(&folder.table())?;
        check_writable(&folder.picture("reference"))?;
        Ok(folder)
    }

    /// `study.csv`.
    #[must_use]
    pub fn table(&self) -> PathBuf {
        self.path.join("study.csv")
    }

    /// `widths.csv`.
    #[must_use]
    pub fn widths(&self) -> PathBuf {
        self.path.join("widths.csv")
    }

    /// A file of this name.
    #[must_use]
    pub fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// A plot of this name.
    #[must_use]
    pub fn plot(&self, name: &str) -> PathBuf {
        self.path.join("plots").join(format!("{name}.svg"))
    }

    /// The picture of a point, or `reference`.
    #[must_use]
    pub fn picture(&self, name: &str) -> PathBuf {
        let safe = |c: char| if c.is_ascii_alphanumeric() || c == '.' || c == '-' { c } else { '_' };
        self.path.join("pictures").join(format!("{}.png", name.chars().map(safe).collect::<String>()))
    }

    /// Keeps the picture of a point, as a screen shows it.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn keep_picture(&self, name: &str, shot: &Shot) -> Result<(), Diagnostic> {
        let path = self.picture(name);
        let bytes: Vec<u8> =
            shot.colors.iter().flatten().map(|value| (srgb_from_linear(*value) * 255.0).round() as u8).collect();
        let [width, height] = [shot.width, shot.colors.len() / shot.width.max(1)].map(|side| side as u32);
        let picture = image::RgbImage::from_raw(width, height, bytes).unwrap_or_default();
        let mut png = Cursor::new(Vec::new());
        picture
            .write_to(&mut png, image::ImageFormat::Png)
            .map_err(|error| Diagnostic::error(format!("cannot write this picture: {error}")).in_file(&path))?;
        write_atomically(&path, |sink| sink.write_all(png.get_ref()))
    }

    /// The reference that is kept here, with its samples and its own errors, if it is that of the scene.
    #[must_use]
    pub fn reference(&self, scene: &str) -> Option<(Shot, u32, Errors)> {
        let note = std::fs::read(self.file("reference.json")).ok()?;
        let note: ReferenceNote =
            serde_json::from_slice(&note).ok().filter(|note: &ReferenceNote| note.scene == scene)?;
        let picture = Picture::read(&self.file("reference.exr")).ok()?;
        let [r, g, b, line] = ["R", "G", "B", "line"].map(|name| picture.channel(name));
        let (r, g, b, line) = (r?, g?, b?, line?);
        let shot = Shot {
            width: picture.rect.width() as usize,
            colors: (0..r.len()).map(|i| [r[i], g[i], b[i]]).collect(),
            coverage: line.to_vec(),
            secondary: picture.channel("secondary").unwrap_or_default().to_vec(),
        };
        let region = |parts: [Option<f64>; 4]| ByRegion {
            all: parts[0].unwrap_or_default(),
            lines: parts[1],
            reflections: parts[2],
            rest: parts[3],
        };
        let ReferenceNote { rmse, flip, coverage, position, crossings, .. } = note;
        Some((shot, note.samples, Errors { rmse: region(rmse), flip: region(flip), coverage, crossings, position }))
    }

    /// Keeps a reference, in full precision.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn keep_reference(&self, scene: &str, samples: u32, shot: &Shot, own: &Errors) -> Result<(), Diagnostic> {
        let (path, note_path) = (self.file("reference.exr"), self.file("reference.json"));
        // A note must never stand beside another reference than its own.
        if let Err(error) = std::fs::remove_file(&note_path)
            && error.kind() != std::io::ErrorKind::NotFound
        {
            return Err(Diagnostic::error(format!("cannot replace this file: {error}")).in_file(note_path));
        }
        let color = |axis: usize| shot.colors.iter().map(|color| color[axis]).collect::<Vec<f32>>();
        let mut planes = vec![("R", color(0)), ("G", color(1)), ("B", color(2)), ("line", shot.coverage.clone())];
        if !shot.secondary.is_empty() {
            planes.push(("secondary", shot.secondary.clone()));
        }
        let channels = planes.into_iter().map(|(name, values)| AnyChannel::new(name, FlatSamples::F32(values)));
        let size = (shot.width, shot.colors.len() / shot.width.max(1));
        let mut bytes = Cursor::new(Vec::new());
        Image::from_channels(size, AnyChannels::sort(channels.collect()))
            .write()
            .non_parallel()
            .to_buffered(&mut bytes)
            .map_err(|error| Diagnostic::error(format!("cannot write the reference: {error}")).in_file(&path))?;
        write_atomically(&path, |sink| sink.write_all(bytes.get_ref()))?;
        let note = ReferenceNote {
            scene: scene.to_owned(),
            samples,
            rmse: own.rmse.parts(),
            flip: own.flip.parts(),
            coverage: own.coverage,
            position: own.position,
            crossings: own.crossings,
        };
        let text = serde_json::to_string_pretty(&note)
            .map_err(|error| Diagnostic::error(format!("cannot write the reference: {error}")).in_file(&note_path))?;
        write_atomically(&note_path, |sink| sink.write_all((text + "\n").as_bytes()))
    }
}
