//! Objects: shapes and models with a place in the world.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

use super::super::document::Node;
use super::super::format::{self, Segments, Size};
use super::material::about_file;
use super::transform::world_from_object;
use super::{ModelCamera, Resolver};
use crate::diag::{Diagnostic, Diagnostics, Span};
use crate::math::{Vec2, Vec3, Vec4};
use crate::scene::Object;
use crate::scene::attributes::{Attribute, AttributeSet};
use crate::scene::gltf::{self, ModelTime, Placement};
use crate::scene::ids::{MeshId, ObjectId};
use crate::scene::light::Light;
use crate::scene::mesh_file;
use crate::scene::settings::RayKinds;
use crate::scene::shape::Shape;

/// What an object may be.
const KINDS: [&str; 3] = ["gltf", "mesh", "shape"];

impl Resolver<'_> {
    /// Adds all objects; returns the lights of those models whose lights are to be used.
    pub(super) fn objects(&mut self, objects: &[format::Object], lights_by_default: bool) -> Vec<Light> {
        let mut lights = Vec::new();
        let mut names = Names::default();
        let nodes = self.node.get("objects").map_or(&[][..], Node::items);
        for (object, node) in objects.iter().zip(nodes) {
            let name = self.object_name(object, node, &mut names);
            if object.group.as_deref() == Some("") {
                let fault = Diagnostic::error(format!("the group of object `{name}` has no name"));
                let hint = "objects with equal group names count as one; leave `group` out for an object of its own";
                self.faults.push(fault.at(node.span_of("group")).hint(hint));
            }
            let kinds: Vec<&str> = KINDS.into_iter().filter(|kind| node.mentions(kind)).collect();
            match (&kinds[..], &object.gltf, &object.mesh, object.shape) {
                (["gltf"], Some(model), ..) => {
                    let found = self.model(model, object, node, name);
                    if object.lights.unwrap_or(lights_by_default) {
                        lights.extend(found);
                    }
                }
                (["mesh"], _, Some(mesh), _) => self.mesh(mesh, object, node, name),
                (["shape"], .., Some(shape)) => self.shape(shape, object, node, name),
                ([], ..) => {
                    let fault = Diagnostic::error(format!("object `{name}` has neither `gltf` nor `mesh` nor `shape`"));
                    let hint = "say what it is: `shape = \"sphere\"`, `gltf = \"model.glb\"` or `mesh = \"mesh.obj\"`";
                    self.faults.push(fault.at(node.span.clone()).hint(hint));
                }
                ([first, second, ..], ..) => {
                    let fault = Diagnostic::error(format!("object `{name}` has both `{first}` and `{second}`"));
                    self.faults.push(fault.at(node.key_span(second)).hint("make two objects of it"));
                }
                // What is written there has been told to be wrong.
                _ => {}
            }
        }
        lights
    }

    /// The written name, or one made of what the object is.
    fn object_name(&mut self, object: &format::Object, node: &Node, names: &mut Names) -> String {
        if let Some(name) = &object.name {
            if !names.taken.insert(name.clone()) {
                let warning = Diagnostic::warning(format!("another object is named `{name}`, too"));
                let hint = format!("`--set objects.{name}` means the first");
                self.faults.push(warning.at(node.span_of("name")).hint(hint));
            }
            return name.clone();
        }
        let kind = match (object.gltf.as_ref().or(object.mesh.as_ref()), object.shape) {
            (Some(model), _) => Path::new(model).file_stem().map(|stem| stem.to_string_lossy().into_owned()),
            (None, Some(shape)) => Some(built_in(shape).name().to_owned()),
            (None, None) => None,
        };
        names.numbered(&kind.unwrap_or_else(|| "object".to_owned()))
    }

    fn model(&mut self, written: &str, object: &format::Object, node: &Node, name: String) -> Vec<Light> {
        self.no_parameters(node, "model");
        let world_from_model = world_from_object(object, node, self.faults);
        let material = match &object.material {
            Some(name) => match self.material(name, &node.span_of("material")) {
                Some(id) => Some(id),
                None => return Vec::new(),
            },
            None => None,
        };
        let span = node.span_of("gltf");
        let path = self.path(written, &span);
        let time = self.context.options.frame.map_or(ModelTime::Rest, ModelTime::Frame);
        let placement = Placement {
            name: name.clone(),
            world_from_model,
            material,
            priority: object.priority,
            visible_to: visible_to(object),
            lines: object.lines,
            group: object.group.clone(),
            span: Some(node.span.clone()),
        };
        match gltf::import(&path, self.context.files, time, &mut self.scene, &placement) {
            Ok(imported) => {
                self.model_faults(imported.warnings, &span);
                for index in imported.objects {
                    self.scene.attributes.extend_object(ObjectId::from_index(index), attributes(object));
                }
                let cameras = imported.cameras.into_iter();
                self.model_cameras.extend(cameras.map(|camera| ModelCamera { model: name.clone(), camera }));
                imported.lights
            }
            Err(faults) => {
                self.model_faults(faults, &span);
                Vec::new()
            }
        }
    }

    fn model_faults(&mut self, faults: Diagnostics, span: &Span) {
        faults.0.into_iter().for_each(|fault| self.faults.push(about_file(fault, span)));
    }

    /// Tells of parameters of shapes at something that is none.
    fn no_parameters(&mut self, node: &Node, what: &str) {
        for key in ["size", "radius", "height", "tube_radius", "segments"] {
            if node.mentions(key) {
                self.fault(format!("`{key}` belongs to a shape, not to a {what}"), node.key_span(key));
            }
        }
    }

    fn mesh(&mut self, written: &str, object: &format::Object, node: &Node, name: String) {
        self.no_parameters(node, "mesh");
        let span = node.span_of("mesh");
        let path = self.path(written, &span);
        let mesh = match self.meshes.iter().find(|(known, _)| *known == path) {
            Some((_, id)) => Some(*id),
            None => match mesh_file::read(&path, self.context.files) {
                Ok(mesh) => {
                    let id = self.scene.add_mesh(Arc::unwrap_or_clone(mesh));
                    self.meshes.push((path, id));
                    Some(id)
                }
                Err(fault) => {
                    let fault = about_file(fault, &span);
                    self.faults.push(if fault.span.is_none() { fault.at(span) } else { fault });
                    None
                }
            },
        };
        self.place(mesh, object, node, name, "mesh");
    }

    fn shape(&mut self, kind: format::Shape, object: &format::Object, node: &Node, name: String) {
        let mesh = self.shape_mesh(kind, object, node);
        self.place(mesh, object, node, name, "shape");
    }

    /// Adds the object of a mesh, unless something is wrong with it.
    fn place(&mut self, mesh: Option<MeshId>, object: &format::Object, node: &Node, name: String, what: &str) {
        if node.mentions("lights") {
            self.fault(format!("`lights` belongs to a model, not to a {what}"), node.key_span("lights"));
        }
        let world_from_object = world_from_object(object, node, self.faults);
        let material = match &object.material {
            Some(name) => self.material(name, &node.span_of("material")),
            None if node.mentions("material") => None,
            None => Some(self.default_material()),
        };
        let (Some(mesh), Some(material)) = (mesh, material) else { return };
        let id = self.scene.add_object(Object {
            name,
            mesh,
            materials: vec![material],
            world_from_object,
            priority: object.priority,
            visible_to: visible_to(object),
            lines: object.lines,
            group: object.group.clone(),
            span: Some(node.span.clone()),
        });
        self.scene.attributes.extend_object(id, attributes(object));
    }

    /// The mesh of a shape; shapes with equal parameters share one.
    fn shape_mesh(&mut self, kind: format::Shape, object: &format::Object, node: &Node) -> Option<MeshId> {
        let mut shape = built_in(kind);
        let takes = parameters(&shape);
        let strange = ["size", "radius", "height", "tube_radius", "segments"]
            .into_iter()
            .filter(|key| node.mentions(key) && !takes.contains(key));
        for key in strange {
            let listed = takes.iter().map(|key| format!("`{key}`")).collect::<Vec<_>>().join(", ");
            let fault = Diagnostic::error(format!("a {} has no `{key}`", shape.name())).at(node.key_span(key));
            self.faults.push(fault.hint(format!("it has: {listed}")));
        }
        let mut fault = |(key, message): (&str, String)| {
            // What is not written cannot be wrong: then it is the radius that does not fit it.
            let key = if node.mentions(key) { key } else { "radius" };
            self.faults.push(Diagnostic::error(message).at(node.span_of(key)));
        };
        set_parameters(&mut shape, object).map_err(&mut fault).ok()?;
        if let Some((_, id)) = self.shapes.iter().find(|(known, _)| *known == shape) {
            return Some(*id);
        }
        let mesh = shape.mesh().map_err(|found| fault((found.parameter, found.message))).ok()?;
        let id = self.scene.add_mesh(mesh);
        self.shapes.push((shape, id));
        Some(id)
    }
}

/// The names of the objects so far.
#[derive(Default)]
struct Names {
    taken: BTreeSet<String>,
    /// How many objects of a kind have been numbered.
    numbers: BTreeMap<String, u32>,
}

impl Names {
    /// `kind`, `kind 2`, `kind 3`, …, whichever is free.
    fn numbered(&mut self, kind: &str) -> String {
        let number = self.numbers.entry(kind.to_owned()).or_insert(0);
        loop {
            *number += 1;
            let name = if *number == 1 { kind.to_owned() } else { format!("{kind} {number}") };
            if self.taken.insert(name.clone()) {
                return name;
            }
        }
    }
}

fn attributes(object: &format::Object) -> AttributeSet {
    let value = |attribute: &format::Attribute| {
        Some(match attribute {
            format::Attribute::Bool(value) => Attribute::Bool(*value),
            format::Attribute::Int(value) => Attribute::Int(*value),
            format::Attribute::Float(value) => Attribute::Float(*value as f32),
            format::Attribute::Vector(values) => match values[..] {
                [x, y] => Attribute::Vec2(Vec2::new(x as f32, y as f32)),
                [x, y, z] => Attribute::Vec3(Vec3::new(x as f32, y as f32, z as f32)),
                [x, y, z, w] => Attribute::Vec4(Vec4::new(x as f32, y as f32, z as f32, w as f32)),
                _ => return None,
            },
            format::Attribute::Text(text) => Attribute::Text(text.clone()),
        })
    };
    object.attributes.iter().filter_map(|(name, attribute)| Some((name.clone(), value(attribute)?))).collect()
}

fn visible_to(object: &format::Object) -> RayKinds {
    let kinds = object.visible_to.iter().map(|kind| match kind {
        format::RayKind::Camera => RayKinds::CAMERA,
        format::RayKind::Reflection => RayKinds::REFLECTION,
        format::RayKind::Refraction => RayKinds::REFRACTION,
        format::RayKind::Shadow => RayKinds::SHADOW,
    });
    kinds.fold(RayKinds::empty(), RayKinds::union)
}

/// A shape with its default parameters.
fn built_in(kind: format::Shape) -> Shape {
    match kind {
        format::Shape::Sphere => Shape::SPHERE,
        format::Shape::Box => Shape::BOX,
        format::Shape::Plane => Shape::PLANE,
        format::Shape::Cylinder => Shape::CYLINDER,
        format::Shape::Cone => Shape::CONE,
        format::Shape::Torus => Shape::TORUS,
        format::Shape::Disc => Shape::DISC,
        format::Shape::Capsule => Shape::CAPSULE,
        format::Shape::Knot => Shape::KNOT,
    }
}

fn parameters(shape: &Shape) -> &'static [&'static str] {
    match shape {
        Shape::Box { .. } | Shape::Plane { .. } => &["size", "segments"],
        Shape::Sphere { .. } | Shape::Disc { .. } => &["radius", "segments"],
        Shape::Cylinder { .. } | Shape::Cone { .. } | Shape::Capsule { .. } => &["radius", "height", "segments"],
        Shape::Torus { .. } | Shape::Knot { .. } => &["radius", "tube_radius", "segments"],
    }
}

type ParameterFault = (&'static str, String);

/// Puts the written parameters in place of the default ones.
fn set_parameters(shape: &mut Shape, object: &format::Object) -> Result<(), ParameterFault> {
    let set = |place: &mut f64, value: Option<f64>| *place = value.unwrap_or(*place);
    let name = shape.name();
    match shape {
        Shape::Sphere { radius, segments } => {
            set(radius, object.radius);
            // As many segments from pole to pole as around half the equator.
            set_segments(name, segments, &object.segments, |around| [around, around.div_ceil(2).max(2)])
        }
        Shape::Box { size, segments } => {
            set_size(name, size, &object.size)?;
            set_segments(name, segments, &object.segments, |all| [all; 3])
        }
        Shape::Plane { size, segments } => {
            set_size(name, size, &object.size)?;
            set_segments(name, segments, &object.segments, |all| [all; 2])
        }
        Shape::Cylinder { radius, height, segments } | Shape::Cone { radius, height, segments } => {
            set(radius, object.radius);
            set(height, object.height);
            set_segments(name, segments, &object.segments, |around| [around, 1])
        }
        Shape::Torus { radius, tube_radius, segments } => {
            set(radius, object.radius);
            set(tube_radius, object.tube_radius);
            set_segments(name, segments, &object.segments, |around| [around, around.div_ceil(2).max(3)])
        }
        Shape::Disc { radius, segments } => {
            set(radius, object.radius);
            let mut around = [*segments];
            set_segments(name, &mut around, &object.segments, |around| [around])?;
            [*segments] = around;
            Ok(())
        }
        Shape::Capsule { radius, height, segments } => {
            set(radius, object.radius);
            set(height, object.height);
            set_segments(name, segments, &object.segments, |around| [around, around.div_ceil(4)])
        }
        Shape::Knot { radius, tube_radius, segments } => {
            set(radius, object.radius);
            set(tube_radius, object.tube_radius);
            set_segments(name, segments, &object.segments, |along| [along, along.div_ceil(10).max(3)])
        }
    }
}

fn set_size<const N: usize>(name: &str, place: &mut [f64; N], written: &Option<Size>) -> Result<(), ParameterFault> {
    match written {
        None => {}
        Some(Size::All(edge)) => *place = [edge.0; N],
        Some(Size::Each(edges)) => {
            let edges: Vec<f64> = edges.iter().map(|edge| edge.0).collect();
            *place = exactly(&edges, name, "size")?;
        }
    }
    Ok(())
}

fn set_segments<const N: usize>(
    name: &str,
    place: &mut [u32; N],
    written: &Option<Segments>,
    from_one: impl Fn(u32) -> [u32; N],
) -> Result<(), ParameterFault> {
    match written {
        None => {}
        Some(Segments::Around(around)) => *place = from_one(*around),
        Some(Segments::Each(counts)) => *place = exactly(counts, name, "segments")?,
    }
    Ok(())
}

fn exactly<T: Copy, const N: usize>(
    values: &[T],
    name: &str,
    parameter: &'static str,
) -> Result<[T; N], ParameterFault> {
    values.try_into().map_err(|_| {
        let count = if N == 1 { "one number".to_owned() } else { format!("one number or {N}") };
        (parameter, format!("`{parameter}` of a {name} is {count}, found {}", values.len()))
    })
}
