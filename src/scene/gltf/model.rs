//! From the parts of a file to the parts of a scene.

use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::path::Path;

use gltf::json::mesh::Semantic;
use gltf::json::validation::Checked;

use super::build::{self, Slots};
use super::document::{self, Document};
use super::extras::{self, Extra, Look, On};
use super::material::{self, Draft, Drafts};
use super::node::Local;
use super::pose::Deformation;
use super::primitive::{self, Skipped};
use super::report::Report;
use super::texture::Textures;
use super::{Imported, ModelTime, Placement, animation, camera, instancing, light, node};
use crate::diag::{Diagnostic, Diagnostics};
use crate::files::FileStore;
use crate::math::DAffine3;
use crate::scene::attributes::AttributeSet;
use crate::scene::camera::Camera;
use crate::scene::ids::{MaterialId, MeshId, TextureId};
use crate::scene::light::Light;
use crate::scene::material::{Material, ParamValue};
use crate::scene::mesh::Mesh;
use crate::scene::settings::LineOverrides;
use crate::scene::texture::Texture;
use crate::scene::{Object, SceneBuilder};

/// Everything read, not yet in a scene. Indices are into this model's own tables.
pub(super) struct Model {
    meshes: Vec<Mesh>,
    drafts: Vec<Draft>,
    textures: Vec<Texture>,
    parts: Vec<Part>,
    cameras: Vec<Camera>,
    lights: Vec<Light>,
}

/// An object to be.
struct Part {
    name: String,
    /// Index of its shape while reading; of its mesh afterwards.
    mesh: usize,
    /// Index of its node's own shader among the looks.
    look: Option<usize>,
    /// Drafts by material slot; set once the meshes are known.
    materials: Vec<usize>,
    world_from_object: DAffine3,
    priority: Option<i32>,
    lines: bool,
    group: Option<String>,
    attributes: AttributeSet,
}

/// A glTF mesh as one or more nodes show it.
struct Shape {
    mesh: usize,
    name: String,
    deformation: Deformation,
}

/// Reads a model. `None` after a fault; faults may also be reported beside a model.
pub(super) fn read(
    path: &Path,
    files: &FileStore,
    time: ModelTime,
    placement: &Placement,
    report: &mut Report,
) -> Option<Model> {
    let document = document::open(path, files, report)?;
    let hierarchy = node::hierarchy(&document.root, report)?;
    let mut locals = node::locals(&document.root, report);
    animation::pose(&document, time.seconds(), &mut locals, report);
    if time != ModelTime::Rest && document.root.animations.is_empty() {
        report.push(Diagnostic::warning("the model has no animation: the time has no effect on it"));
    }
    let model_from_nodes = node::model_from_nodes(&hierarchy, &locals);
    if report.has_errors() {
        return None; // Everything below would follow from faults already told.
    }

    let mut walk = Walk {
        document: &document,
        files,
        placement,
        locals: &locals,
        model_from_nodes: &model_from_nodes,
        report,
        names: Names::default(),
        camera_names: Names::default(),
        shared: BTreeMap::new(),
        shapes: Vec::new(),
        parts: Vec::new(),
        looks: Vec::new(),
        cameras: Vec::new(),
        lights: Vec::new(),
        flat: Vec::new(),
    };
    for node in &hierarchy.shown {
        walk.visit(*node);
    }
    walk.tell_flat();
    let Walk { shapes, mut parts, looks, cameras, lights, .. } = walk;

    let tangent_set = |material| match placement.material {
        Some(_) => None,
        None => material::tangent_set(&document.root, material),
    };
    let built = build_shapes(&document, &shapes, tangent_set, report);
    parts.retain(|part| built[part.mesh].is_some());
    if parts.is_empty() && !report.has_errors() {
        report.push(Diagnostic::warning("the model shows no triangles"));
    }

    let mut textures = Textures::default();
    let drafts = if placement.material.is_some() {
        Vec::new()
    } else {
        let drafts = Drafts { document: &document, files, textures: &mut textures, report: &mut *report };
        draft_materials(drafts, &mut parts, &built, looks)
    };
    tell_missing_uvs(&parts, &built, &drafts, report);
    let textures = textures.load(&document, files, report);

    // Shapes without triangles leave gaps in the numbering.
    let mut meshes = Vec::new();
    let renamed: Vec<usize> = built
        .into_iter()
        .map(|built| {
            meshes.extend(built.map(|(mesh, _)| mesh));
            meshes.len().saturating_sub(1)
        })
        .collect();
    for part in &mut parts {
        part.mesh = renamed[part.mesh];
    }
    Some(Model { meshes, drafts, textures, parts, cameras, lights })
}

/// The walk over the shown nodes.
struct Walk<'a> {
    document: &'a Document,
    files: &'a FileStore,
    placement: &'a Placement,
    locals: &'a [Local],
    model_from_nodes: &'a [DAffine3],
    report: &'a mut Report,
    names: Names,
    camera_names: Names,
    /// The shapes that nodes share, by glTF mesh.
    shared: BTreeMap<usize, usize>,
    shapes: Vec<Shape>,
    parts: Vec<Part>,
    /// Shaders of nodes, with the nodes' names.
    looks: Vec<(String, Look)>,
    cameras: Vec<Camera>,
    lights: Vec<Light>,
    /// Nodes with a mesh and a scale of 0.
    flat: Vec<usize>,
}

impl Walk<'_> {
    fn visit(&mut self, node: usize) {
        let root = &self.document.root;
        let json = &root.nodes[node];
        let world_from_node = self.placement.world_from_model * self.model_from_nodes[node];
        if json.camera.is_some() {
            let own = || json.camera.and_then(|camera| root.cameras.get(camera.value())?.name.clone());
            let name = json.name.clone().or_else(own).unwrap_or_else(|| format!("camera {}", self.cameras.len()));
            let name = self.camera_names.unique(name, &format!("node {node}"));
            self.cameras.extend(camera::of_node(root, node, name, &world_from_node, self.report));
        }
        let name = json.name.clone().unwrap_or_else(|| format!("node {node}"));
        self.lights.extend(light::of_node(root, node, name.clone(), &world_from_node, self.report));
        if let Some(mesh) = json.mesh {
            self.visit_mesh(node, mesh.value(), &name);
        }
    }

    fn visit_mesh(&mut self, node: usize, mesh: usize, name: &str) {
        let (document, report) = (self.document, &mut *self.report);
        let json = &document.root.nodes[node];
        let place = format!("nodes[{node}]");
        let extra = extras::read(&json.extras, On::Node, &place, &document.folder, self.files, report);
        let mut attributes = extras::attributes(&document.root.meshes[mesh].extras);
        attributes.extend(extras::attributes(&json.extras));
        let local = &self.locals[node];
        let (Some(deformation), Some(instances)) = (
            Deformation::of_node(document, node, local, self.model_from_nodes, report),
            instancing::transforms(document, node, report),
        ) else {
            return;
        };
        // A skin moves vertices straight into the model's space.
        let is_skinned = deformation.joints.is_some();
        let model_from_mesh = if is_skinned { DAffine3::IDENTITY } else { self.model_from_nodes[node] };
        let shape = self.shape(node, mesh, deformation);
        let Extra { look, priority, lines, group, .. } = extra;
        let group = self.placement.group.clone().or(group);
        let look = look.shader.is_some().then(|| {
            self.looks.push((name.to_owned(), look));
            self.looks.len() - 1
        });
        let is_single = instances.len() == 1;
        for (index, instance) in instances.into_iter().enumerate() {
            let world_from_object = self.placement.world_from_model * model_from_mesh * instance;
            if !world_from_object.is_finite() {
                self.report.error(&place, "its transform, composed with those of its parents, is not finite");
                return;
            }
            if !node::is_invertible(&world_from_object) {
                self.flat.push(node);
                continue;
            }
            let name = if is_single { name.to_owned() } else { format!("{name}[{index}]") };
            let name = self.names.unique(format!("{}/{name}", self.placement.name), &format!("node {node}"));
            self.parts.push(Part {
                name,
                mesh: shape,
                look,
                materials: Vec::new(),
                world_from_object,
                priority: self.placement.priority.or(priority),
                lines: self.placement.lines && lines.unwrap_or(true),
                group: group.clone(),
                attributes: attributes.clone(),
            });
        }
    }

    /// The shape of a node's mesh: its own if something deforms it, else the one of all such nodes.
    fn shape(&mut self, node: usize, mesh: usize, deformation: Deformation) -> usize {
        let is_shared = deformation.is_none();
        if let (true, Some(shape)) = (is_shared, self.shared.get(&mesh)) {
            return *shape;
        }
        let json = &self.document.root.meshes[mesh];
        let name = json.name.clone().unwrap_or_else(|| format!("mesh {mesh}"));
        let name = if is_shared { name } else { format!("{name} (node {node})") };
        self.shapes.push(Shape { mesh, name, deformation });
        if is_shared {
            self.shared.insert(mesh, self.shapes.len() - 1);
        }
        self.shapes.len() - 1
    }

    fn tell_flat(&mut self) {
        if let Some(first) = self.flat.first() {
            let message = match self.flat.len() {
                1 => "its scale is 0 in some direction; it is not drawn".to_owned(),
                count => format!("its scale is 0 in some direction, as for {count} objects in all; they are not drawn"),
            };
            self.report.warning(format!("nodes[{first}]"), message);
        }
    }
}

/// Names that were given, so that none is given twice.
#[derive(Default)]
struct Names(HashSet<String>);

impl Names {
    fn unique(&mut self, name: String, distinction: &str) -> String {
        if self.0.insert(name.clone()) {
            return name;
        }
        let longer = format!("{name} ({distinction})");
        let numbered = (2..).map(|number| format!("{longer} {number}"));
        let candidates = std::iter::once(longer.clone()).chain(numbered);
        // There are endless candidates and finitely many names.
        candidates.into_iter().find(|candidate| self.0.insert(candidate.clone())).unwrap_or(longer)
    }
}

/// Reads each mesh once and makes a scene mesh of each shape. `None` for shapes without triangles, or after a fault.
fn build_shapes(
    document: &Document,
    shapes: &[Shape],
    tangent_set: impl Fn(Option<usize>) -> Option<usize>,
    report: &mut Report,
) -> Vec<Option<(Mesh, Slots)>> {
    let mut by_mesh: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (index, shape) in shapes.iter().enumerate() {
        by_mesh.entry(shape.mesh).or_default().push(index);
    }
    let mut skipped = Skipped::default();
    let mut built: Vec<_> = shapes.iter().map(|_| None).collect();
    for (mesh, users) in by_mesh {
        let mut primitives = primitive::read(document, mesh, &mut skipped, report);
        for (left, index) in (0..users.len()).rev().zip(users) {
            let shape = &shapes[index];
            let mut own = if left == 0 { std::mem::take(&mut primitives) } else { primitives.clone() };
            if !own.iter_mut().all(|primitive| shape.deformation.apply(primitive, report).is_some()) {
                break; // The other shapes of this mesh would have the same fault.
            }
            built[index] = build::merge(shape.name.clone(), own, &tangent_set, report)
                .filter(|(mesh, _)| !mesh.triangles.is_empty());
        }
    }
    let Skipped { points, lines } = skipped;
    if points + lines > 0 {
        let message =
            format!("primitives made of points ({points}) or lines ({lines}) are not drawn: only triangles are");
        report.push(Diagnostic::warning(message));
    }
    built
}

/// Drafts the materials in use and hands them to the parts.
fn draft_materials(
    mut drafts: Drafts<'_>,
    parts: &mut [Part],
    built: &[Option<(Mesh, Slots)>],
    looks: Vec<(String, Look)>,
) -> Vec<Draft> {
    let root = &drafts.document.root;
    let mut all = Vec::new();
    let mut names = Names::default();
    let mut known: BTreeMap<Option<usize>, usize> = BTreeMap::new();
    let used: BTreeSet<_> = built.iter().flatten().flat_map(|(_, slots)| slots.materials.iter().copied()).collect();
    let colored: BTreeSet<_> = root
        .meshes
        .iter()
        .flat_map(|mesh| &mesh.primitives)
        .filter(|primitive| primitive.attributes.contains_key(&Checked::Valid(Semantic::Colors(0))))
        .map(|primitive| primitive.material.map(|material| material.value()))
        .collect();
    for material in used {
        let use_vertex_color = colored.contains(&material);
        let draft = match material {
            Some(index) => {
                let unnamed = format!("material {index}");
                let name = root.materials[index].name.clone().unwrap_or_else(|| unnamed.clone());
                drafts.of_material(index, names.unique(name, &unnamed), use_vertex_color)
            }
            None => drafts.plain(names.unique("default".into(), "no material"), use_vertex_color),
        };
        if let Some(draft) = draft {
            known.insert(material, all.len());
            all.push(draft);
        }
    }
    let own: Vec<Option<usize>> = looks
        .into_iter()
        .map(|(node, look)| {
            all.push(drafts.of_node(names.unique(node, "node"), look)?);
            Some(all.len() - 1)
        })
        .collect();
    for part in parts {
        let Some((_, slots)) = &built[part.mesh] else { continue };
        part.materials = match part.look.and_then(|look| own[look]) {
            Some(draft) => vec![draft; slots.materials.len()],
            None => slots.materials.iter().filter_map(|material| known.get(material).copied()).collect(),
        };
    }
    all
}

/// Tells which materials look up uv that a mesh wearing them does not have.
fn tell_missing_uvs(parts: &[Part], built: &[Option<(Mesh, Slots)>], drafts: &[Draft], report: &mut Report) {
    let mut told = BTreeSet::new();
    for part in parts {
        let Some((mesh, _)) = &built[part.mesh] else { continue };
        for material in &part.materials {
            let Draft { name, params, .. } = &drafts[*material];
            let missing = params.iter().find_map(|(param, (value, _))| match value {
                ParamValue::Texture(texture) if texture.uv_set as usize >= mesh.uvs.len() => {
                    Some((param, texture.uv_set))
                }
                _ => None,
            });
            if let (Some((param, set)), true) = (missing, told.insert(*material)) {
                let mesh = &mesh.name;
                report.push(Diagnostic::warning(format!(
                    "the {param} of material `{name}` uses TEXCOORD_{set}, which mesh `{mesh}` does not have; it is \
                     looked up at 0, 0"
                )));
            }
        }
    }
}

impl Model {
    /// Puts everything into a scene.
    pub fn commit(self, into: &mut SceneBuilder, placement: &Placement, warnings: Diagnostics) -> Imported {
        let textures: Vec<TextureId> = self.textures.into_iter().map(|texture| into.add_texture(texture)).collect();
        let materials: Vec<MaterialId> = self
            .drafts
            .into_iter()
            .map(|draft| {
                let Draft { name, script, mut params, priority, dielectric_priority, double_sided, attributes } = draft;
                for (value, _) in params.values_mut() {
                    if let ParamValue::Texture(reference) = value {
                        reference.texture = textures[reference.texture.index()];
                    }
                }
                let lines = LineOverrides::default();
                let script = into.add_script(script);
                let id = into.add_material(Material {
                    name,
                    script,
                    params,
                    priority,
                    dielectric_priority,
                    double_sided,
                    lines,
                    span: None,
                });
                if !attributes.is_empty() {
                    into.attributes.materials.insert(id, attributes);
                }
                id
            })
            .collect();
        let meshes: Vec<(MeshId, usize)> = self
            .meshes
            .into_iter()
            .map(|mesh| {
                let slots = mesh.slot_count();
                (into.add_mesh(mesh), slots)
            })
            .collect();
        let first = into.objects.len();
        for part in self.parts {
            let (mesh, slots) = meshes[part.mesh];
            let id = into.add_object(Object {
                name: part.name,
                mesh,
                materials: match placement.material {
                    Some(material) => vec![material; slots],
                    None => part.materials.into_iter().map(|draft| materials[draft]).collect(),
                },
                world_from_object: part.world_from_object,
                priority: part.priority,
                visible_to: placement.visible_to,
                lines: part.lines,
                group: part.group,
                span: placement.span.clone(),
            });
            into.attributes.extend_object(id, part.attributes);
        }
        Imported { objects: first..into.objects.len(), cameras: self.cameras, lights: self.lights, warnings }
    }
}
