//! glTF 2.0 models: `.gltf` with its buffers and images, or `.glb`.
//!
//! A model is read in this order:
//!
//! 1. `document`: container, JSON and its checks, the bytes of the buffers.
//! 2. `node`, `animation`: the hierarchy, posed at one time, composed in double precision.
//! 3. `primitive`, `pose`, `build`, `tangent`: each mesh is read once, deformed for the nodes that have skins or
//!    morph weights, and merged into one scene mesh whose triangles know their material slot.
//! 4. `material`, `extras`, `texture`: the used materials, and the images they need, decoded in parallel.
//! 5. `model` runs these steps; only if all went well, the parts enter the [`SceneBuilder`]: one object for each node
//!    with a mesh.
//!
//! A model is untrusted input. Lengths and indices are checked before they are used, nothing recurses along the file's
//! structure, and every fault is told with its place in the JSON, all in one go.
//!
//! Out of scope: points and lines, mesh compression, texture formats other than PNG and JPEG, all animations but the
//! first, material variants, and extensions of materials beyond those in `document`.

mod accessor;
mod animation;
mod build;
mod camera;
mod document;
mod extras;
mod instancing;
mod light;
mod material;
mod model;
mod node;
mod pose;
mod primitive;
mod report;
mod tangent;
mod texture;

use std::ops::Range;
use std::path::Path;

use super::SceneBuilder;
use super::camera::Camera;
use super::ids::MaterialId;
use super::light::Light;
use super::settings::RayKinds;
use crate::diag::{Diagnostics, Span};
use crate::files::FileStore;
use crate::math::DAffine3;
use report::Report;

/// Frames in a second of animation, for [`ModelTime::Frame`].
pub const FRAMES_PER_SECOND: f64 = 24.0;

/// At which time a model's animation is taken.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum ModelTime {
    /// None was asked for: an animated model is posed at 0 seconds, as in other viewers; others are as modelled.
    #[default]
    Rest,
    /// A frame number, from 0; [`FRAMES_PER_SECOND`].
    Frame(f64),
    /// Seconds from the start.
    Seconds(f64),
}

impl ModelTime {
    /// The time in seconds.
    #[must_use]
    pub fn seconds(self) -> f64 {
        match self {
            Self::Rest => 0.0,
            Self::Frame(frame) => frame / FRAMES_PER_SECOND,
            Self::Seconds(seconds) => seconds,
        }
    }
}

/// How a model stands in a scene.
#[derive(Clone, Debug)]
pub struct Placement {
    /// Objects are named `name/node`.
    pub name: String,
    /// Where the model is.
    pub world_from_model: DAffine3,
    /// Replaces all materials of the model, whose textures are then not read.
    pub material: Option<MaterialId>,
    /// Line priority of all objects; `None` leaves what the model's extras say.
    pub priority: Option<i32>,
    /// Which rays meet the objects.
    pub visible_to: RayKinds,
    /// Whether its surfaces draw lines; the model's extras can still switch them off for a node.
    pub lines: bool,
    /// The group of all objects; `None` leaves what the model's extras say.
    pub group: Option<String>,
    /// Where the model was placed.
    pub span: Option<Span>,
}

impl Placement {
    /// A model at the origin as it is, under a name.
    #[must_use]
    pub fn named(name: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            world_from_model: DAffine3::IDENTITY,
            material: None,
            priority: None,
            visible_to: RayKinds::all(),
            lines: true,
            group: None,
            span: None,
        }
    }
}

/// What [`import`] found. Meshes, materials, textures and objects are in the builder; cameras and lights are the
/// caller's to add.
#[derive(Clone, Debug)]
pub struct Imported {
    /// Which objects of the builder are the model's.
    pub objects: Range<usize>,
    /// Its cameras in world space, named after their nodes (else after themselves).
    pub cameras: Vec<Camera>,
    /// Its lights in world space.
    pub lights: Vec<Light>,
    /// What may not look as meant.
    pub warnings: Diagnostics,
}

/// Adds a model to a scene.
///
/// Only the first animation is played. The nodes of the default scene are shown (the first scene where none is marked,
/// all nodes where there is no scene). Nodes that share a mesh share it here too, unless skins or morph weights deform
/// it. Skinned meshes ignore their node's transform, as glTF demands.
///
/// # Errors
/// All faults found, with the file and the place in its JSON. The builder is then as it was.
pub fn import(
    path: &Path,
    files: &FileStore,
    time: ModelTime,
    into: &mut SceneBuilder,
    placement: &Placement,
) -> Result<Imported, Diagnostics> {
    let mut report = Report::new(path);
    match model::read(path, files, time, placement, &mut report) {
        Some(model) if !report.has_errors() => Ok(model.commit(into, placement, report.finish())),
        _ => Err(report.finish()),
    }
}
