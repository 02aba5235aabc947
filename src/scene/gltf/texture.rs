//! The textures that the used materials ask for, decoded in parallel, each image once per encoding.

use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use gltf::json;
use gltf::json::texture::{MagFilter, WrappingMode};
use gltf::json::validation::Checked;
use rayon::prelude::*;

use super::document::{Document, Uri, resolve};
use super::extras::TextureFile;
use super::report::Report;
use crate::diag::Diagnostic;
use crate::files::FileStore;
use crate::scene::ids::TextureId;
use crate::scene::texture::{self, Image, Texture, TextureFilter, Wrap, decode};

/// Where an image comes from.
#[derive(Clone, Debug, PartialEq)]
enum Origin {
    /// `images[…]` of the model.
    Model(usize),
    /// A file named by the extras.
    File(PathBuf),
}

struct WantedImage {
    origin: Origin,
    srgb: bool,
    /// Who wants it, for messages.
    wanted_by: String,
}

struct WantedTexture {
    image: usize,
    wrap: [Wrap; 2],
    filter: TextureFilter,
}

/// Collects wishes; the ids given out are indices into what [`Textures::load`] returns.
#[derive(Default)]
pub(super) struct Textures {
    images: Vec<WantedImage>,
    textures: Vec<WantedTexture>,
}

impl Textures {
    /// Asks for `textures[index]` of the model. `None` after a fault.
    pub fn of_model(
        &mut self,
        root: &json::Root,
        index: usize,
        srgb: bool,
        wanted_by: &str,
        report: &mut Report,
    ) -> Option<TextureId> {
        let texture = root.textures.get(index)?;
        let image = texture.source.value();
        if image >= root.images.len() {
            // A texture may be there in formats of extensions only.
            let message = format!("it has no PNG or JPEG image; {wanted_by} wants it");
            return report.fail(format!("textures[{index}]"), message);
        }
        let sampler = texture.sampler.and_then(|sampler| root.samplers.get(sampler.value()));
        let wrap = |mode: Checked<WrappingMode>| match mode {
            Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
            Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
            Checked::Valid(WrappingMode::Repeat) | Checked::Invalid => Wrap::Repeat,
        };
        let filter = match sampler.and_then(|sampler| sampler.mag_filter) {
            Some(Checked::Valid(MagFilter::Nearest)) => TextureFilter::Nearest,
            _ => TextureFilter::Linear,
        };
        let wrap = sampler.map_or([Wrap::Repeat; 2], |sampler| [wrap(sampler.wrap_s), wrap(sampler.wrap_t)]);
        Some(self.add(Origin::Model(image), srgb, wrap, filter, wanted_by))
    }

    /// Asks for a texture from a file of its own.
    pub fn of_file(&mut self, file: &TextureFile, wanted_by: &str) -> TextureId {
        self.add(Origin::File(file.path.clone()), file.srgb, [file.wrap; 2], file.filter, wanted_by)
    }

    fn add(
        &mut self,
        origin: Origin,
        srgb: bool,
        wrap: [Wrap; 2],
        filter: TextureFilter,
        wanted_by: &str,
    ) -> TextureId {
        let known = self.images.iter().position(|image| image.origin == origin && image.srgb == srgb);
        let image = known.unwrap_or_else(|| {
            self.images.push(WantedImage { origin, srgb, wanted_by: wanted_by.to_owned() });
            self.images.len() - 1
        });
        let known = self
            .textures
            .iter()
            .position(|texture| (texture.image, texture.wrap, texture.filter) == (image, wrap, filter));
        TextureId::from_index(known.unwrap_or_else(|| {
            self.textures.push(WantedTexture { image, wrap, filter });
            self.textures.len() - 1
        }))
    }

    /// Decodes all images. What fails is reported; then there are too few textures.
    pub fn load(self, document: &Document, files: &FileStore, report: &mut Report) -> Vec<Texture> {
        let decoded: Vec<_> = self.images.par_iter().map(|image| load_image(image, document, files)).collect();
        let mut images = Vec::new();
        for (result, wanted) in decoded.into_iter().zip(&self.images) {
            match result {
                Ok(image) => images.push(Some(image)),
                Err(Some(fault)) => {
                    images.push(None);
                    report.push(fault.hint(format!("{} of {} wants it", wanted.wanted_by, report.path().display())));
                }
                Err(None) => images.push(None),
            }
        }
        self.textures
            .into_iter()
            .filter_map(|texture| {
                let (name, image) = images[texture.image].clone()?;
                Some(Texture { name, image, wrap: texture.wrap, filter: texture.filter, levels: OnceLock::new() })
            })
            .collect()
    }
}

type Loaded = (String, Arc<Image>);

/// `Err(None)`: the buffer is missing, which is already reported.
fn load_image(wanted: &WantedImage, document: &Document, files: &FileStore) -> Result<Loaded, Option<Diagnostic>> {
    let from_file = |path: PathBuf| {
        let bytes = files.read(&path)?;
        let image = texture::read_image(&path, &bytes, wanted.srgb, files)?;
        Ok((path.display().to_string(), image))
    };
    let index = match &wanted.origin {
        Origin::File(path) => return from_file(path.clone()),
        Origin::Model(index) => *index,
    };
    let place = format!("images[{index}]");
    let fault = |message: &dyn std::fmt::Display| Diagnostic::error(format!("{place}: {message}"));
    let json = &document.root.images[index];
    let name = json.name.clone().unwrap_or_else(|| format!("image {index}"));
    // An embedded image has no file of its own: its faults are the model's.
    let embedded =
        |bytes: &[u8]| {
            let origin = format!("{} {name} {place} {}", wanted.wanted_by, wanted.srgb);
            let decode = |bytes: &[u8]| decode(&document.folder, bytes, wanted.srgb);
            let image = files
                .make((&document.folder, &origin), &Arc::from(bytes), decode)
                .map_err(|inner| Diagnostic { file: None, message: fault(&inner.message).message, ..inner })?;
            Ok((name, image))
        };
    match (&json.uri, json.buffer_view) {
        (Some(uri), _) => match resolve(&document.folder, uri).map_err(|message| fault(&message))? {
            Uri::File(path) => from_file(path),
            Uri::Data(bytes) => embedded(&bytes),
        },
        (None, Some(view)) => {
            embedded(document.view(view.value()).map_err(|message| message.map(|message| fault(&message)))?)
        }
        (None, None) => Err(Some(fault(&"it has neither a URI nor a buffer view"))),
    }
}
