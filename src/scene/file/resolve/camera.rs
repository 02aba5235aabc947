//! Cameras: placed by hand, or taken from models.

use super::super::document::Node;
use super::super::format::{self, Projection as Kind, SceneFile};
use super::{Resolver, unknown_name, vector};
use crate::diag::Diagnostic;
use crate::math::DVec3;
use crate::scene::camera::{Camera, Projection};

/// A camera that a model brought along.
pub(super) struct ModelCamera {
    /// Name of the object that the model is.
    pub model: String,
    pub camera: Camera,
}

impl Resolver<'_> {
    pub(super) fn cameras(&mut self, file: &SceneFile) {
        let single = file.camera.iter().zip(self.node.get("camera"));
        let list = file.cameras.iter().zip(self.node.get("cameras").map_or(&[][..], Node::items));
        for (written, node) in single.chain(list) {
            let Some(camera) = self.camera(written, node) else { continue };
            if self.scene.cameras.iter().any(|known| known.name == camera.name) {
                let fault = Diagnostic::error(format!("two cameras are named `{}`", camera.name));
                let place = if written.name.is_some() { node.span_of("name") } else { node.span.clone() };
                self.faults.push(fault.at(place).hint("give this one a `name` of its own, for `--camera`"));
            }
            self.scene.cameras.push(camera);
        }
        self.camera_of_model();
    }

    /// `--camera` may name a camera of a model.
    fn camera_of_model(&mut self) {
        let Some(name) = &self.scene.camera_name else { return };
        if self.scene.cameras.iter().any(|camera| camera.name == *name) {
            return;
        }
        if let Some(camera) = find(&self.model_cameras, name) {
            self.scene.cameras.push(Camera { name: name.clone(), ..camera.clone() });
            return;
        }
        // One that is written but faulty has been reported.
        if self.faults.has_errors() && (self.node.mentions("camera") || self.node.mentions("cameras")) {
            return;
        }
        let known = self.scene.cameras.iter().map(|camera| camera.name.as_str());
        let known = known.chain(self.model_cameras.iter().map(|found| found.camera.name.as_str()));
        let fault = unknown_name("camera", name, known);
        self.faults.push(fault);
    }

    fn camera(&mut self, written: &format::Camera, node: &Node) -> Option<Camera> {
        for key in ["aperture_radius", "shutter"] {
            let used = match key {
                "aperture_radius" => written.aperture_radius != 0.0,
                _ => written.shutter != [0.0; 2],
            };
            if used {
                let warning = Diagnostic::warning(format!("lens and shutter are not built yet: `{key}` is ignored"));
                self.faults.push(warning.at(node.key_span(key)));
            }
        }
        if let Some(name) = &written.node {
            return self.camera_from_node(name, written, node);
        }
        let projection = match written.projection.unwrap_or(Kind::Perspective) {
            Kind::Perspective => Projection::Perspective { fov_y: written.fov.unwrap_or(40.0).to_radians() },
            Kind::Orthographic => Projection::Orthographic { height: written.height.unwrap_or(2.0) },
        };
        let (strange, kind, instead) = match projection {
            Projection::Perspective { .. } => ("height", "a perspective", "fov"),
            Projection::Orthographic { .. } => ("fov", "an orthographic", "height"),
        };
        // A projection that is written wrongly says nothing about the other keys.
        if node.mentions(strange) && node.mentions("projection") == written.projection.is_some() {
            let fault = Diagnostic::error(format!("{kind} camera has no `{strange}`")).at(node.key_span(strange));
            self.faults.push(fault.hint(format!("what it sees is set by `{instead}`")));
        }
        let Some(position) = written.position else {
            if !node.mentions("position") && !node.mentions("node") && !node.mentions("script") {
                let fault = Diagnostic::error("the camera has no `position`").at(node.span.clone());
                self.faults.push(fault.hint("without any camera, the whole scene is framed"));
            }
            return None;
        };
        let position = vector(position);
        let target = written.target.map_or(DVec3::ZERO, vector);
        let up = written.up.map_or(DVec3::Y, vector);
        if ["target", "up"].iter().any(|key| node.mentions(key) && node.get(key).is_none()) {
            return None;
        }
        let name = written.name.clone().unwrap_or_else(|| "camera".to_owned());
        let camera = Camera::look_at(name, projection, position, target, up);
        camera.map_err(|fault| self.faults.push(explain_look_at(fault, position, target, up, node))).ok()
    }

    fn camera_from_node(&mut self, name: &str, written: &format::Camera, node: &Node) -> Option<Camera> {
        for key in ["projection", "position", "target", "up", "fov", "height"] {
            if node.mentions(key) {
                let fault = Diagnostic::error(format!("`{key}` and `node` are both given")).at(node.key_span(key));
                self.faults.push(fault.hint("a camera of a model has place and projection already"));
            }
        }
        if let Some(camera) = find(&self.model_cameras, name) {
            let name = written.name.clone().unwrap_or_else(|| name.to_owned());
            return Some(Camera { name, ..camera.clone() });
        }
        // A model that could not be read may have had it.
        if !self.faults.has_errors() || !self.model_cameras.is_empty() {
            let known = self.model_cameras.iter().map(|found| found.camera.name.as_str());
            let fault = match self.model_cameras.is_empty() {
                true => Diagnostic::error(format!("there is no camera `{name}`: no model of this scene has cameras")),
                false => unknown_name("camera", name, known),
            };
            self.faults.push(fault.at(node.span_of("node")));
        }
        None
    }
}

/// Says which of the keys is to blame, and what holds for one that is not written.
fn explain_look_at(fault: Diagnostic, position: DVec3, target: DVec3, up: DVec3, node: &Node) -> Diagnostic {
    let at_itself = (position - target).try_normalize().is_none();
    let blame: &[&str] = if at_itself { &["target", "position"] } else { &["up", "target", "position"] };
    let place = blame.iter().find_map(|key| node.get(key)).unwrap_or(node);
    let fault = fault.at(place.span.clone());
    if !at_itself && !node.mentions("up") {
        fault.hint("`up` is [0, 1, 0] if it is not given")
    } else if !node.mentions("target") && (at_itself || up != DVec3::ZERO) {
        fault.hint("`target` is [0, 0, 0] if it is not given")
    } else {
        fault
    }
}

/// The first camera of a name: its own, or with the model's before it, `model/camera`.
fn find<'a>(cameras: &'a [ModelCamera], name: &str) -> Option<&'a Camera> {
    let own = |found: &&ModelCamera| found.camera.name == name;
    let long = |found: &&ModelCamera| {
        let of_model =
            |full: &str| full.strip_prefix(&found.model).and_then(|rest| rest.strip_prefix('/')).map(str::to_owned);
        of_model(&found.camera.name).as_deref() == Some(name) || of_model(name).as_deref() == Some(&found.camera.name)
    };
    cameras.iter().find(own).or_else(|| cameras.iter().find(long)).map(|found| &found.camera)
}
