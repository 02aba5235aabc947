//! Opening a model: container, JSON, checks of the JSON, and the bytes of its buffers.
//!
//! The `gltf` crate supplies the types of the JSON and checks their indices and enumerations; its readers of containers
//! and accessors are not used, as they trust the lengths a file claims. After [`open`] every index in `root` that the
//! crate knows of is in range; what Tusche reads by hand (extensions as plain JSON) is checked where it is read.

use std::borrow::Cow;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use gltf::json;
use gltf::json::mesh::Semantic;
use gltf::json::validation::{Checked, Error as Invalid, Validate};

use super::report::Report;
use crate::diag::{Diagnostic, Source, Span};
use crate::files::FileStore;

/// The extensions that the importer honours.
const SUPPORTED: [&str; 9] = [
    "EXT_mesh_gpu_instancing",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// Extensions that carry nothing a picture could show.
const WITHOUT_EFFECT: [&str; 2] = ["KHR_xmp", "KHR_xmp_json_ld"];

/// How to do without an extension that models often require.
fn way_out(extension: &str) -> &'static str {
    match extension {
        "KHR_draco_mesh_compression" | "EXT_meshopt_compression" | "KHR_meshopt_compression" => {
            "export the model again without mesh compression"
        }
        "KHR_texture_basisu" | "EXT_texture_webp" | "EXT_texture_avif" | "MSFT_texture_dds" => {
            "export the model again with PNG or JPEG textures"
        }
        _ => "export the model again without this extension",
    }
}

/// A model whose JSON is checked and whose buffers are at hand.
pub(super) struct Document {
    /// The JSON.
    pub root: json::Root,
    /// The folder that relative paths in the model start from.
    pub folder: PathBuf,
    buffers: Vec<Buffer>,
}

/// The bytes of a buffer; files are shared with the store, not copied.
enum Buffer {
    File(Arc<[u8]>, Range<usize>),
    Decoded(Vec<u8>),
    /// It could not be read, which was reported; whoever needs it need not say so again.
    Missing,
}

impl Document {
    /// The bytes of a buffer view. `Err(None)` if the buffer is missing, which is already reported.
    pub fn view(&self, index: usize) -> Result<&[u8], Option<String>> {
        let view = self.root.buffer_views.get(index).ok_or_else(|| format!("there is no bufferViews[{index}]"))?;
        let buffer = view.buffer.value();
        let bytes = match self.buffers.get(buffer) {
            Some(Buffer::File(bytes, range)) => &bytes[range.clone()],
            Some(Buffer::Decoded(bytes)) => bytes,
            Some(Buffer::Missing) | None => return Err(None),
        };
        let start = view.byte_offset.map_or(0, |offset| offset.0);
        let end = start.checked_add(view.byte_length.0);
        end.and_then(|end| bytes.get(usize::try_from(start).ok()?..usize::try_from(end).ok()?)).ok_or_else(|| {
            Some(format!(
                "bufferViews[{index}] ({} bytes from {start}) reaches beyond buffers[{buffer}], which has {} bytes",
                view.byte_length.0,
                bytes.len()
            ))
        })
    }
}

/// What a URI in a model refers to.
pub(super) enum Uri {
    Data(Vec<u8>),
    File(PathBuf),
}

/// Resolves a URI: a path relative to the model, percent-encoded, or embedded base64 data.
pub(super) fn resolve(folder: &Path, uri: &str) -> Result<Uri, String> {
    if uri.starts_with("data:") {
        if !uri.contains(";base64,") {
            return Err("the data URI is not base64: it must start with \"data:TYPE;base64,\"".into());
        }
        return gltf::buffer::Data::from_source(gltf::buffer::Source::Uri(uri), None)
            .map(|data| Uri::Data(data.0))
            .map_err(|error| format!("the data URI is damaged: {error}"));
    }
    if let Some((scheme, _)) = uri.split_once(':') {
        return Err(format!("`{scheme}:` is not supported: only relative paths and data URIs are"));
    }
    let path = urlencoding::decode(uri).unwrap_or(Cow::Borrowed(uri));
    Ok(Uri::File(folder.join(&*path)))
}

/// Opens a model. `None` if it is not usable, which is reported.
pub(super) fn open(path: &Path, files: &FileStore, report: &mut Report) -> Option<Document> {
    let bytes = files.read(path).map_err(|fault| report.push(fault)).ok()?;
    let (json, binary) = if bytes.starts_with(b"glTF") {
        split_glb(&bytes).map_err(|message| report.push(Diagnostic::error(message))).ok()?
    } else {
        (skip_byte_order_mark(&bytes), None)
    };
    let is_text_file = binary.is_none() && !bytes.starts_with(b"glTF");
    let root = parse(path, &bytes[json], is_text_file, report)?;
    check_extensions(&root, report);
    if !check_indices(&root, report) || report.has_errors() {
        return None;
    }
    let folder = path.parent().unwrap_or(Path::new("")).to_owned();
    let buffers =
        (0..root.buffers.len()).map(|index| read_buffer(&root, index, &folder, &bytes, &binary, files, report));
    let buffers = buffers.collect();
    Some(Document { root, folder, buffers })
}

fn skip_byte_order_mark(bytes: &[u8]) -> Range<usize> {
    let start = if bytes.starts_with(&[0xef, 0xbb, 0xbf]) { 3 } else { 0 };
    start..bytes.len()
}

type Chunks = (Range<usize>, Option<Range<usize>>);

/// Finds the JSON and the binary chunk of a `.glb`.
fn split_glb(bytes: &[u8]) -> Result<Chunks, String> {
    let word = |at: usize| -> Option<u32> { Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?)) };
    let cut = || format!("this .glb is cut off: its header is not complete in its {} bytes", bytes.len());
    let version = word(4).ok_or_else(cut)?;
    if version != 2 {
        return Err(format!("this .glb has container version {version}; only version 2 (glTF 2.0) is supported"));
    }
    let length = word(8).ok_or_else(cut)? as usize;
    if length > bytes.len() {
        return Err(format!("this .glb is cut off: it should have {length} bytes and has {}", bytes.len()));
    }
    let mut chunks = Vec::new();
    let mut at = 12;
    // Whatever follows the two chunks that glTF 2.0 knows is to be ignored.
    while chunks.len() < 2 && at < length {
        let (Some(size), Some(kind)) = (word(at), word(at + 4)) else {
            return Err(cut());
        };
        let (start, size) = (at + 8, size as usize);
        if size > length.saturating_sub(start) {
            return Err(format!(
                "this .glb is cut off: a chunk should have {size} bytes and has {}",
                length.saturating_sub(start)
            ));
        }
        chunks.push((kind.to_le_bytes(), start..start + size));
        // Chunks are padded to four bytes; the sum cannot overflow, as the chunk lies in memory.
        at = (start + size).next_multiple_of(4);
    }
    let mut chunks = chunks.into_iter();
    match (chunks.next(), chunks.next()) {
        (Some((kind, json)), binary) if &kind == b"JSON" => {
            Ok((json, binary.filter(|(kind, _)| kind == b"BIN\0").map(|(_, range)| range)))
        }
        _ => Err("this .glb does not start with a JSON chunk".into()),
    }
}

fn parse(path: &Path, json: &[u8], is_text_file: bool, report: &mut Report) -> Option<json::Root> {
    // A glTF 1.0 file has another structure altogether, so the version comes first.
    #[derive(serde::Deserialize)]
    struct Versioned {
        asset: Asset,
    }
    #[derive(serde::Deserialize)]
    #[serde(rename_all = "camelCase")]
    struct Asset {
        version: String,
        min_version: Option<String>,
    }
    let parsed = serde_json::from_slice::<Versioned>(json).and_then(|versioned| {
        let asset = versioned.asset;
        let too_old = !asset.version.starts_with("2.");
        let too_new = asset.min_version.as_ref().is_some_and(|version| version != "2.0");
        if too_old || too_new {
            let version = asset.min_version.filter(|_| too_new).unwrap_or(asset.version);
            Ok(Err(format!("this model needs glTF {version}; only glTF 2.0 is supported")))
        } else {
            serde_json::from_slice::<json::Root>(json).map(Ok)
        }
    });
    match parsed {
        Ok(Ok(root)) => Some(root),
        Ok(Err(version)) => report.fail("asset", version),
        Err(error) => {
            report.push(json_fault(path, json, is_text_file, &error));
            None
        }
    }
}

/// A JSON error at its line and column; text files show the line.
fn json_fault(path: &Path, json: &[u8], is_text_file: bool, error: &serde_json::Error) -> Diagnostic {
    // serde_json appends the place to its message; here it is said apart.
    let message = error.to_string();
    let message = message.rsplit_once(" at line ").map_or(message.as_str(), |(message, _)| message);
    let (line, column) = (error.line(), error.column());
    match std::str::from_utf8(json) {
        Ok(text) if is_text_file => {
            let source = Source::new(path.display().to_string(), text);
            Diagnostic::error(format!("this is not a glTF model: {message}")).at(Span::word_at(&source, line, column))
        }
        _ => Diagnostic::error(format!("its JSON is not a glTF model: {message}, at line {line} column {column}"))
            .in_file(path),
    }
}

fn check_extensions(root: &json::Root, report: &mut Report) {
    let is_fine = |name: &str| SUPPORTED.contains(&name) || WITHOUT_EFFECT.contains(&name);
    for (i, name) in root.extensions_required.iter().enumerate().filter(|(_, name)| !is_fine(name)) {
        let message = format!("extensionsRequired[{i}]: the model needs `{name}`, which is not supported");
        report.push(Diagnostic::error(message).hint(way_out(name)));
    }
    for (i, name) in root.extensions_used.iter().enumerate().filter(|(_, name)| !is_fine(name)) {
        if !root.extensions_required.contains(name) {
            report.warning(format!("extensionsUsed[{i}]"), format!("`{name}` is not supported and has no effect"));
        }
    }
}

/// Checks all indices and enumerations. What is wrong but harmless is not reported.
fn check_indices(root: &json::Root, report: &mut Report) -> bool {
    // The validator of the crate indexes with these before it checks them.
    let mut sound = true;
    for (i, mesh) in root.meshes.iter().enumerate() {
        for (j, primitive) in mesh.primitives.iter().enumerate() {
            if let Some(accessor) = primitive.attributes.get(&Checked::Valid(Semantic::Positions))
                && accessor.value() >= root.accessors.len()
            {
                sound = false;
                let place = format!("meshes[{i}].primitives[{j}].attributes.POSITION");
                report.error(place, format!("there is no accessors[{accessor}]"));
            }
        }
    }
    if !sound {
        return false;
    }
    root.validate(root, json::Path::new, &mut |path, fault| {
        let place = path().as_str().replace("[\"", ".").replace("\"]", "");
        let message = match fault {
            Invalid::IndexOutOfBounds => "this index points at nothing",
            Invalid::Invalid => "this value is not one that glTF knows",
            Invalid::Missing => "this is missing",
            Invalid::Oversize => "this is larger than memory",
            // Ours says more.
            Invalid::Unsupported => return,
        };
        if place.ends_with("<invalid semantic name>") {
            let place = place.trim_end_matches(".<invalid semantic name>");
            report.warning(place, "an attribute with a name that glTF does not know is ignored");
            return;
        }
        // The bounds of positions and strides are computed and checked from the data itself.
        let unread = ["POSITION.min", "POSITION.max", "byteStride"];
        if !unread.iter().any(|unread| place.ends_with(unread)) {
            sound = false;
            report.error(place, message);
        }
    });
    sound
}

fn read_buffer(
    root: &json::Root,
    index: usize,
    folder: &Path,
    model: &Arc<[u8]>,
    binary: &Option<Range<usize>>,
    files: &FileStore,
    report: &mut Report,
) -> Buffer {
    let buffer = &root.buffers[index];
    let found = match (&buffer.uri, binary) {
        (Some(uri), _) => match resolve(folder, uri) {
            Ok(Uri::Data(bytes)) => Ok(Buffer::Decoded(bytes)),
            Ok(Uri::File(path)) => files
                .read(&path)
                .map(|bytes| {
                    let whole = 0..bytes.len();
                    Buffer::File(bytes, whole)
                })
                .map_err(|fault| format!("{}: {}", path.display(), fault.message)),
            Err(message) => Err(message),
        },
        (None, Some(range)) if index == 0 => Ok(Buffer::File(Arc::clone(model), range.clone())),
        (None, _) => Err("it has no URI, and there is no binary chunk for it".into()),
    };
    let claimed = usize::try_from(buffer.byte_length.0).unwrap_or(usize::MAX);
    let cut = |actual: usize| format!("it should have {claimed} bytes and has {actual}");
    let checked = found.and_then(|found| match found {
        Buffer::File(bytes, range) if range.len() >= claimed => {
            Ok(Buffer::File(bytes, range.start..range.start + claimed))
        }
        Buffer::File(_, range) => Err(cut(range.len())),
        Buffer::Decoded(bytes) if bytes.len() < claimed => Err(cut(bytes.len())),
        whole => Ok(whole),
    });
    checked.unwrap_or_else(|message| {
        report.error(format!("buffers[{index}]"), message);
        Buffer::Missing
    })
}
