//! From what is written to what is meant: names, paths, units, defaults.
//!
//! Each part takes the typed value and the document's node beside it, for places. Faults are collected; a part that
//! cannot be resolved is left out of the builder, which is thrown away in the end if there was any error.

mod camera;
mod light;
mod material;
mod object;
mod settings;
mod transform;
mod truth;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::LoadOptions;
use super::document::Node;
use super::format::{self, SceneFile};
use crate::diag::{Diagnostic, Diagnostics, Source, Span, nearest};
use crate::files::FileStore;
use crate::math::{DVec3, Vec3};
use crate::scene::ids::{MaterialId, MeshId};
use crate::scene::shape::Shape;
use crate::scene::texture::Image;
use crate::scene::{SceneBuilder, framing, script_files};
use camera::ModelCamera;
pub(super) use material::BUILTIN;

/// Frames of an animation in a second.
const FRAME_RATE: f64 = 24.0;

/// Where a scene file comes from, and what was asked for.
#[derive(Clone, Copy)]
pub(super) struct Context<'a> {
    pub files: &'a FileStore,
    pub options: &'a LoadOptions,
    pub source: &'a Arc<Source>,
    /// The folder of the scene file.
    pub folder: &'a Path,
}

/// Resolves a whole scene file.
pub(super) fn resolve(file: &SceneFile, node: &Node, context: Context<'_>, faults: &mut Diagnostics) -> SceneBuilder {
    let mut resolver = Resolver {
        context,
        node,
        faults,
        scene: SceneBuilder::default(),
        images: Vec::new(),
        shapes: Vec::new(),
        meshes: Vec::new(),
        materials: Vec::new(),
        default_material: None,
        model_cameras: Vec::new(),
    };
    resolver.scene.camera_name.clone_from(&context.options.camera);
    if context.options.frame.is_some_and(|frame| !frame.is_finite()) {
        resolver.faults.push(Diagnostic::error("the frame must be a finite number"));
    }
    resolver.scene.time = (context.options.frame.unwrap_or(0.0) / FRAME_RATE) as f32;
    resolver.render(&file.render);
    resolver.lines(&file.lines);
    resolver.materials(&file.materials);
    let model_lights = resolver.objects(&file.objects, file.lights.is_empty() && !node.mentions("lights"));
    resolver.hidden_objects(file);
    script_files::load(&mut resolver.scene, context.files, resolver.faults);
    resolver.lights(&file.lights, model_lights);
    resolver.cameras(file);
    resolver.fill_in();
    resolver.truth(file);
    resolver.scene
}

struct Resolver<'a> {
    context: Context<'a>,
    /// The whole document.
    node: &'a Node,
    faults: &'a mut Diagnostics,
    scene: SceneBuilder,
    /// Images by path and whether they are sRGB-encoded: textures that differ in their sampler share one.
    images: Vec<(PathBuf, bool, Arc<Image>)>,
    /// Shapes with equal parameters share a mesh.
    shapes: Vec<(Shape, MeshId)>,
    /// Meshes from files; those of one file share one.
    meshes: Vec<(PathBuf, MeshId)>,
    /// The materials of the file by name.
    materials: Vec<(String, MaterialId)>,
    /// What objects without a material get, made when the first needs it.
    default_material: Option<MaterialId>,
    /// Cameras that models brought along.
    model_cameras: Vec<ModelCamera>,
}

impl<'a> Resolver<'a> {
    fn fault(&mut self, message: impl Into<String>, span: Span) {
        self.faults.push(Diagnostic::error(message).at(span));
    }

    /// A path that is written at `node`.
    fn path(&self, written: &str, span: &Span) -> PathBuf {
        // What comes from the command line is relative to where that was typed.
        if Arc::ptr_eq(&span.source, self.context.source) { self.context.folder.join(written) } else { written.into() }
    }

    /// What the scene lacks, and what looks like a slip.
    fn fill_in(&mut self) {
        // Framing looks at all meshes; there is no use in it if the scene is not going to be.
        if self.faults.has_errors() {
            return;
        }
        if self.scene.objects.is_empty() && !self.node.mentions("objects") {
            let warning = Diagnostic::warning("the scene has no objects: the picture shows the background only");
            let start = Span::new(self.context.source, 0..0);
            self.faults
                .push(warning.at(start).hint("add one: [[objects]] with shape = \"sphere\" or gltf = \"model.glb\""));
        }
        let bounds = framing::bounds(&self.scene);
        if self.scene.cameras.is_empty() {
            self.scene.cameras.push(framing::frame_camera(bounds, self.scene.render.size));
        }
        if self.scene.lights.is_empty() && !self.node.mentions("lights") {
            match self.scene.chosen_camera() {
                Ok(camera) => self.scene.lights = framing::default_lights(camera, bounds),
                Err(fault) => self.faults.push(fault),
            }
        }
    }

    /// The node of a top-level table; the whole document if it is not written.
    fn part(&self, key: &str) -> &'a Node {
        self.node.get(key).unwrap_or(self.node)
    }
}

fn rgb(format::Color(color): format::Color) -> Vec3 {
    Vec3::from(color.map(|channel| channel as f32))
}

fn vector(format::Vector(vector): format::Vector) -> DVec3 {
    DVec3::from(vector)
}

/// A name that is not there, with the nearest that is.
fn unknown_name<'n>(what: &str, name: &str, known: impl Iterator<Item = &'n str> + Clone) -> Diagnostic {
    let fault = Diagnostic::error(format!("there is no {what} named `{name}`"));
    if let Some(near) = nearest(name, known.clone()) {
        return fault.hint(format!("did you mean `{near}`?"));
    }
    let known: Vec<_> = known.map(|name| format!("`{name}`")).collect();
    match known.is_empty() {
        true => fault.hint(format!("the scene has no {what}s with a name")),
        false => fault.hint(format!("there are: {}", known.join(", "))),
    }
}
