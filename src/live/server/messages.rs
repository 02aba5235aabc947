//! What the page and the server say to each other: JSON, and pictures as bytes.

use std::time::Duration;

use bytes::Bytes;
use serde::{Deserialize, Serialize};
use serde_json::{Value as Json, json};

use super::super::board::ShownPicture;
use super::super::controls::ControlGroup;
use super::super::edit::KeyPath;
use crate::diag::{Diagnostic, Diagnostics, Severity};
use crate::film::View;
use crate::live::{Kept, Redone};
use crate::sample::PixelRect;

/// All that pages show of a scene but its picture.
#[derive(Serialize)]
pub(in crate::live) struct Scene {
    pub name: String,
    /// Whether edits can be written back.
    pub is_writable: bool,
    /// Names of layers; none if the scene could not be read.
    pub layers: Vec<String>,
    /// The one that is shown.
    pub layer: String,
    /// `None` if the scene could not be read: the old ones stay.
    pub groups: Option<Vec<ControlGroup>>,
    /// Paths of edits.
    pub edits: Vec<KeyPath>,
    /// The edits as TOML.
    pub toml: String,
}

pub(in crate::live) fn scene(scene: &Scene) -> String {
    // Strings and numbers cannot fail to become JSON.
    serde_json::to_string(scene).unwrap_or_default()
}

pub(in crate::live) fn progress(samples: u32, share: f64) -> String {
    json!({ "samples": samples, "share": share }).to_string()
}

pub(in crate::live) fn note(text: &str, is_bad: bool) -> String {
    json!({ "text": text, "bad": is_bad }).to_string()
}

/// What is wrong: faults of the scene, of scripts while they run, what the gate stopped, and warnings.
pub(in crate::live) fn faults(lists: [&Diagnostics; 4], has_picture: bool) -> String {
    let diagnostics: Vec<_> = lists.into_iter().flat_map(|list| &list.0).map(diagnostic).collect();
    // Errors while scripts run do not keep a picture from being made.
    json!({ "stale": lists[0].has_errors() && has_picture, "list": diagnostics }).to_string()
}

fn diagnostic(diagnostic: &Diagnostic) -> Json {
    let place = diagnostic.span.as_ref().map(|span| {
        let (line, column) = span.line_column();
        format!("{}:{line}:{column}", span.source.name)
    });
    let file = diagnostic.file.as_ref().map(|file| file.display().to_string());
    json!({
        "severity": match diagnostic.severity {
            Severity::Error => "error",
            Severity::Warning => "warning",
        },
        "message": diagnostic.message,
        "place": place.or(file),
        "text": diagnostic.render(false),
    })
}

/// What a picture is and what it cost; `after` is the time since the change that it shows.
pub(in crate::live) fn picture(shown: &ShownPicture, after: Option<Duration>) -> String {
    let picture = &shown.picture;
    let stats = &picture.stats;
    let seconds = &stats.seconds;
    json!({
        "revision": shown.revision,
        "generation": picture.generation,
        "samples": picture.samples,
        "final": picture.is_final,
        "size": picture.size,
        "layer": shown.layer.to_string(),
        "after": after.map(|after| after.as_secs_f64()),
        "seconds": {
            "build": seconds.build,
            "trace": seconds.trace,
            "shade": seconds.shade,
            "lines": seconds.lines,
            "film": seconds.film,
        },
        "redone": redone(&picture.redone),
        // Only what is wrong with it.
        "memory": (picture.cache.kept != Kept::All).then(|| picture.cache.to_string()),
        "total": seconds.total,
        "threads": stats.threads,
        "rays": stats.rays,
        "pairs": stats.lines.pairs_tested,
        "shaders": stats.shaders.iter().map(|shader| json!({
            "name": shader.name,
            "mode": shader.mode,
            "hits": shader.hits,
        })).collect::<Vec<_>>(),
    })
    .to_string()
}

/// What was done again for a picture, and what was known already.
fn redone(redone: &Redone) -> String {
    let tiles = |count: usize| match count {
        0 => "none".to_owned(),
        all if all == redone.tiles => "all".to_owned(),
        some => format!("{some} of {} tiles", redone.tiles),
    };
    let shaded = (redone.traced + redone.shaded + redone.restyled).min(redone.tiles);
    let mut text = format!(
        "done again: rays {}, shading {}, lines {}, pixels {}",
        tiles(redone.traced),
        tiles(shaded),
        tiles(redone.lined),
        tiles(redone.developed)
    );
    if !redone.materials.is_empty() && redone.traced < redone.tiles {
        text += &format!("; shaders run: {}", redone.materials.join(", "));
    }
    text
}

/// Bytes of whole numbers before the pixels.
const HEADER: usize = 4 * 7;

/// A part of a picture as bytes: revision, left, top, width and height of the part, width and height of the picture (32-bit
/// little-endian numbers), then the part's pixels as RGBA, 8 bits each, row by row.
///
/// Measured on loopback at 960 x 540: see `tests/bench/README.md`, which also has why this is not PNG.
pub(super) fn pixels(shown: &ShownPicture, part: PixelRect, exposure: f32) -> Option<Bytes> {
    let picture = &shown.picture;
    let view = View::new(&picture.layers, &shown.layer, shown.transparent)?.with_exposure(exposure);
    let mut bytes = Vec::with_capacity(HEADER + 4 * part.pixels());
    let place = [part.x0, part.y0].map(|x| u32::try_from(x).unwrap_or(0));
    let [width, height] = picture.size;
    #[expect(clippy::cast_possible_truncation, reason = "a page lives for fewer than 2^32 pictures")]
    for number in [shown.revision as u32, place[0], place[1], part.width(), part.height(), width, height] {
        bytes.extend_from_slice(&number.to_le_bytes());
    }
    bytes.extend_from_slice(&view.pixels::<4>(&picture.channels, width as usize, part));
    Some(bytes.into())
}

/// What a page sets.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Edit {
    pub path: KeyPath,
    pub value: Json,
}

/// `edit`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct EditRequest {
    pub edits: Vec<Edit>,
}

/// `revert`: some paths, or all.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RevertRequest {
    pub paths: Option<Vec<KeyPath>>,
}

/// `layer`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LayerRequest {
    pub layer: String,
}
