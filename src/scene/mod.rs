//! The scene: what a picture shows, resolved and immutable.
//!
//! Two doors lead in: a scene file ([`mod@file`]) and a model ([`gltf`]); both fill a [`SceneBuilder`], as code that makes
//! a scene by hand does. [`SceneBuilder::build`] checks what must hold between the parts, and from then on every id is
//! in range, every number finite, and no default is left to choose.

pub mod attributes;
pub mod camera;
pub mod file;
pub mod framing;
pub mod gltf;
pub mod ids;
pub mod light;
mod lookup;
pub mod material;
pub mod mesh;
pub mod mesh_file;
pub mod script_files;
pub mod settings;
pub mod shape;
pub mod texture;
pub mod truth;

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::diag::{Diagnostic, Diagnostics, Span};
use crate::math::DAffine3;
use attributes::{AttributeTable, Attributes};
use camera::Camera;
use ids::{MaterialId, MeshId, ObjectId, ScriptId, TextureId};
use light::Light;
use material::{Material, Script, ScriptFiles};
use mesh::Mesh;
use settings::{LineSettings, RayKinds, RenderSettings};
use texture::Texture;
use truth::Truth;

/// A mesh with a place in the world and materials.
#[derive(Clone, Debug)]
pub struct Object {
    /// Its name in the scene file or the model; parts of a model are `model/node`.
    pub name: String,
    /// The mesh.
    pub mesh: MeshId,
    /// One material for each slot of the mesh.
    pub materials: Vec<MaterialId>,
    /// Its place, composed in double precision.
    pub world_from_object: DAffine3,
    /// Line priority where the script gives none; `None` falls through to the material, then 0.
    pub priority: Option<i32>,
    /// Which rays meet it.
    pub visible_to: RayKinds,
    /// Whether its surfaces draw lines. If not, all lines that its attributes would style are missing: its outline, its
    /// own creases, and its border with whatever it outranks. What outranks it still draws its line at their border, on
    /// both sides of it.
    pub lines: bool,
    /// Objects of one group compare as one in the object test: no line is drawn where they meet or cover each other.
    pub group: Option<String>,
    /// Where it was declared.
    pub span: Option<Span>,
}

/// A resolved scene. Built by [`SceneBuilder`]; never changes afterwards.
#[derive(Clone, Debug)]
pub struct Scene {
    parts: SceneBuilder,
    camera: Camera,
    attributes: AttributeTable,
}

impl Scene {
    /// The most samples a pixel can have.
    pub const MAX_SAMPLES: u32 = check::MAX_SAMPLES;

    /// `[render]`.
    #[must_use]
    pub fn render(&self) -> &RenderSettings {
        &self.parts.render
    }

    /// `[lines]`.
    #[must_use]
    pub fn lines(&self) -> &LineSettings {
        &self.parts.lines
    }

    /// The camera to render with.
    #[must_use]
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// All objects; `ObjectId` is the index.
    #[must_use]
    pub fn objects(&self) -> &[Object] {
        &self.parts.objects
    }

    /// For each object the one that stands for it in the object test: the first of its group, or itself. Empty if no two
    /// objects share a group.
    #[must_use]
    pub fn stand_ins(&self) -> Vec<ObjectId> {
        let mut first: BTreeMap<&str, ObjectId> = BTreeMap::new();
        let mut shared = false;
        let mut stand_ins = Vec::with_capacity(self.objects().len());
        for (index, object) in self.objects().iter().enumerate() {
            let own = ObjectId::from_index(index);
            let stand_in = object.group.as_deref().map_or(own, |group| *first.entry(group).or_insert(own));
            shared |= stand_in != own;
            stand_ins.push(stand_in);
        }
        if shared { stand_ins } else { Vec::new() }
    }

    /// All meshes; `MeshId` is the index.
    #[must_use]
    pub fn meshes(&self) -> &[Arc<Mesh>] {
        &self.parts.meshes
    }

    /// All materials; `MaterialId` is the index.
    #[must_use]
    pub fn materials(&self) -> &[Material] {
        &self.parts.materials
    }

    /// All scripts; `ScriptId` is the index.
    #[must_use]
    pub fn scripts(&self) -> &[Script] {
        &self.parts.scripts
    }

    /// The attributes of all objects.
    #[must_use]
    pub fn attributes(&self) -> &AttributeTable {
        &self.attributes
    }

    /// The files that scripts name.
    #[must_use]
    pub fn script_files(&self) -> &ScriptFiles {
        &self.parts.script_files
    }

    /// All textures; `TextureId` is the index.
    #[must_use]
    pub fn textures(&self) -> &[Arc<Texture>] {
        &self.parts.textures
    }

    /// All lights.
    #[must_use]
    pub fn lights(&self) -> &[Light] {
        &self.parts.lights
    }

    /// `[truth]`: the lines that the picture must show, if the scene declares them.
    #[must_use]
    pub fn truth(&self) -> Option<&Truth> {
        self.parts.truth.as_ref()
    }

    /// The scene's time in seconds: what animations were posed at, and `hit.time`.
    #[must_use]
    pub fn time(&self) -> f32 {
        self.parts.time
    }

    /// Triangles in all meshes, each mesh counted once.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.parts.meshes.iter().map(|mesh| mesh.triangles.len()).sum()
    }

    /// The same scene with another number of samples per pixel, 1 … [`Self::MAX_SAMPLES`], and with as many where lines are.
    #[must_use]
    pub fn with_samples(&self, samples: u32) -> Self {
        let mut scene = self.clone();
        scene.parts.render.samples = samples.clamp(1, Self::MAX_SAMPLES);
        scene.parts.render.line_oversampling = 1;
        scene
    }

    /// The same scene with samples at other places.
    #[must_use]
    pub fn with_seed(&self, seed: u64) -> Self {
        let mut scene = self.clone();
        scene.parts.render.seed = seed;
        scene
    }

    /// The parts again, to build a changed scene from.
    #[must_use]
    pub fn into_builder(self) -> SceneBuilder {
        self.parts
    }
}

/// Collects the parts of a [`Scene`].
#[derive(Clone, Debug, Default)]
pub struct SceneBuilder {
    /// `[render]`.
    pub render: RenderSettings,
    /// `[lines]`.
    pub lines: LineSettings,
    /// The cameras; the first is used unless `camera_name` chooses.
    pub cameras: Vec<Camera>,
    /// Which camera to use.
    pub camera_name: Option<String>,
    /// The scene's time in seconds.
    pub time: f32,
    /// All objects.
    pub objects: Vec<Object>,
    /// Attributes of objects and materials.
    pub attributes: Attributes,
    /// All meshes.
    pub meshes: Vec<Arc<Mesh>>,
    /// All materials.
    pub materials: Vec<Material>,
    /// All scripts.
    pub scripts: Vec<Script>,
    /// The files that scripts name (see [`script_files::load`]).
    pub script_files: ScriptFiles,
    /// All textures.
    pub textures: Vec<Arc<Texture>>,
    /// All lights.
    pub lights: Vec<Light>,
    /// `[truth]`: the lines that the picture must show.
    pub truth: Option<Truth>,
}

impl SceneBuilder {
    /// Adds a mesh.
    pub fn add_mesh(&mut self, mesh: Mesh) -> MeshId {
        self.meshes.push(Arc::new(mesh));
        MeshId::from_index(self.meshes.len() - 1)
    }

    /// Adds a material.
    pub fn add_material(&mut self, material: Material) -> MaterialId {
        self.materials.push(material);
        MaterialId::from_index(self.materials.len() - 1)
    }

    /// Adds a script; one with the same path, or the same name and text, is shared.
    pub fn add_script(&mut self, script: Script) -> ScriptId {
        let known = self.scripts.iter().position(|known| match (&known.path, &script.path) {
            (Some(a), Some(b)) => a == b,
            (None, None) => known.source == script.source,
            _ => false,
        });
        ScriptId::from_index(known.unwrap_or_else(|| {
            self.scripts.push(script);
            self.scripts.len() - 1
        }))
    }

    /// Adds a texture; an equal one over the same image is shared.
    pub fn add_texture(&mut self, texture: Texture) -> TextureId {
        let known = self.textures.iter().position(|known| {
            Arc::ptr_eq(&known.image, &texture.image)
                && known.wrap == texture.wrap
                && known.filter == texture.filter
                && known.name == texture.name
        });
        TextureId::from_index(known.unwrap_or_else(|| {
            self.textures.push(Arc::new(texture));
            self.textures.len() - 1
        }))
    }

    /// Adds an object.
    pub fn add_object(&mut self, object: Object) -> ObjectId {
        self.objects.push(object);
        ObjectId::from_index(self.objects.len() - 1)
    }

    /// Checks all that must hold between the parts, and freezes them.
    ///
    /// # Errors
    /// Every fault found, with the place that caused it where known.
    pub fn build(self) -> Result<Scene, Diagnostics> {
        let mut faults = Diagnostics::default();
        check::check(&self, &mut faults);
        let camera = self.chosen_camera().map_err(|fault| faults.push(fault)).ok().cloned();
        match camera {
            Some(camera) if !faults.has_errors() => {
                let attributes = self.attributes.table(&self.objects);
                Ok(Scene { parts: self, camera, attributes })
            }
            _ => Err(faults),
        }
    }

    fn chosen_camera(&self) -> Result<&Camera, Diagnostic> {
        let Some(name) = &self.camera_name else {
            return self.cameras.first().ok_or_else(|| Diagnostic::error("the scene has no camera"));
        };
        self.cameras.iter().find(|camera| camera.name == *name).ok_or_else(|| {
            let names: Vec<_> = self.cameras.iter().map(|camera| camera.name.as_str()).collect();
            let fault = Diagnostic::error(format!("there is no camera named `{name}`"));
            match crate::diag::nearest(name, names.iter().copied()) {
                Some(near) => fault.hint(format!("did you mean `{near}`?")),
                None => fault.hint(format!("the scene has: {}", names.join(", "))),
            }
        })
    }
}

mod check;
