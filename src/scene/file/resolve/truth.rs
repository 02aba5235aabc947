//! `[truth]`.

use super::super::document::Node;
use super::super::format;
use super::{Resolver, unknown_name};
use crate::diag::{Diagnostic, Span};
use crate::math::{DVec2, DVec3};
use crate::scene::shape::Shape;
use crate::scene::truth::{Truth, TruthCurve, TruthShape};

impl Resolver<'_> {
    /// The lines that the picture must show. Objects, lines and cameras must be there.
    pub(super) fn truth(&mut self, file: &format::SceneFile) {
        let Some(truth) = &file.truth else { return };
        let node = self.part("truth");
        if truth.edges.is_empty() && truth.discs.is_empty() && !node.mentions("edges") && !node.mentions("discs") {
            let fault = Diagnostic::error("`[truth]` declares no lines").at(node.span.clone());
            self.faults.push(fault.hint("add [[truth.edges]] with `points`, or [[truth.discs]] with an `object`"));
        }
        let width = truth.width.unwrap_or(file.lines.width);
        let mut curves = Vec::new();
        for (edge, node) in truth.edges.iter().zip(node.get("edges").map_or(&[][..], Node::items)) {
            let shape = self.truth_edge(edge, node);
            curves.extend(shape.and_then(|shape| self.truth_curve(shape, edge.width.unwrap_or(width), node)));
        }
        for (disc, node) in truth.discs.iter().zip(node.get("discs").map_or(&[][..], Node::items)) {
            let shape = self.truth_disc(disc, node, file);
            curves.extend(shape.and_then(|shape| self.truth_curve(shape, disc.width.unwrap_or(width), node)));
        }
        self.scene.truth = Some(Truth { curves, span: Some(node.span.clone()) });
    }

    fn truth_edge(&mut self, edge: &format::TruthEdge, node: &Node) -> Option<TruthShape> {
        let mut points = edge.points.clone();
        if edge.closed {
            points.extend(points.first().cloned());
        }
        let film = points.iter().map(|point| <[f64; 2]>::try_from(&point[..]).ok().map(DVec2::from));
        if let Some(film) = film.collect::<Option<Vec<_>>>() {
            return Some(TruthShape::Film(film));
        }
        let world = points.iter().map(|point| <[f64; 3]>::try_from(&point[..]).ok().map(DVec3::from));
        if let Some(world) = world.collect::<Option<Vec<_>>>() {
            return Some(TruthShape::World(world));
        }
        let fault = Diagnostic::error("`points` has places of the world and of the film").at(node.span_of("points"));
        self.faults.push(fault.hint("write all with three numbers (world), or all with two (pixels of the film)"));
        None
    }

    fn truth_disc(&mut self, disc: &format::TruthDisc, node: &Node, file: &format::SceneFile) -> Option<TruthShape> {
        match (&disc.object, disc.center, disc.radius) {
            (Some(name), None, None) if !node.mentions("center") && !node.mentions("radius") => {
                self.truth_object(name, node.span_of("object"), file)
            }
            (None, Some(center), Some(radius)) if !node.mentions("object") => {
                Some(TruthShape::FilmCircle { center: center.into(), radius })
            }
            (Some(_), ..) => {
                let key = if node.mentions("center") { "center" } else { "radius" };
                let fault = Diagnostic::error(format!("the outline of an object needs no `{key}`"));
                self.faults.push(fault.at(node.key_span(key)).hint("leave it out, or leave out `object`"));
                None
            }
            // What is wrong with one of them is told already.
            _ if ["object", "center", "radius"].iter().any(|key| node.mentions(key) && node.get(key).is_none()) => None,
            (None, center, _) => {
                let missing = match center {
                    Some(_) => "it has no `radius`",
                    None if disc.radius.is_some() => "it has no `center`",
                    None => "it has neither `object` nor `center` and `radius`",
                };
                let fault = Diagnostic::error(format!("this disc is nowhere: {missing}")).at(node.span.clone());
                self.faults.push(fault.hint("name a sphere or a disc, or give `center` and `radius` in pixels"));
                None
            }
        }
    }

    /// The outline of a named object.
    fn truth_object(&mut self, name: &str, span: Span, file: &format::SceneFile) -> Option<TruthShape> {
        let Some(object) = self.scene.objects.iter().find(|object| object.name == name) else {
            let names: Vec<_> = self.scene.objects.iter().map(|object| object.name.as_str()).collect();
            let fault = unknown_name("object", name, names.into_iter());
            // One that is at fault itself is not there either, and that is told.
            if !file.objects.iter().any(|object| object.name.as_deref() == Some(name)) {
                self.faults.push(fault.at(span));
            }
            return None;
        };
        let shape = self.shapes.iter().find(|(_, mesh)| *mesh == object.mesh).map(|(shape, _)| *shape);
        let axes = object.world_from_object.matrix3;
        let center = object.world_from_object.translation;
        let is_even = |axes: &[DVec3]| {
            let length = axes[0].length();
            let longest = axes.iter().map(|axis| axis.length()).fold(0.0, f64::max);
            let skewed = axes
                .iter()
                .enumerate()
                .any(|(i, a)| axes[..i].iter().any(|b| a.dot(*b).abs() > 1e-9 * longest * longest));
            !skewed && axes.iter().all(|axis| (axis.length() - length).abs() <= 1e-9 * longest)
        };
        match shape {
            Some(Shape::Sphere { radius, .. }) if is_even(&[axes.x_axis, axes.y_axis, axes.z_axis]) => {
                Some(TruthShape::Ball { center, radius: radius * axes.x_axis.length() })
            }
            Some(Shape::Disc { radius, .. }) => {
                Some(TruthShape::Disc { center, axes: [axes.x_axis * radius, axes.z_axis * radius] })
            }
            Some(Shape::Sphere { .. }) => {
                let fault = Diagnostic::error(format!("`{name}` is no ball: it is scaled unevenly")).at(span);
                self.faults.push(fault.hint("scale it by one number, or declare its outline by [[truth.edges]]"));
                None
            }
            _ => {
                let fault = Diagnostic::error(format!("`{name}` is neither a sphere nor a disc")).at(span);
                self.faults.push(fault.hint("declare its edges by [[truth.edges]] with `points`"));
                None
            }
        }
    }

    /// A curve that the camera sees.
    fn truth_curve(&mut self, shape: TruthShape, width: f64, node: &Node) -> Option<TruthCurve> {
        // Without a camera there is nothing to say; that is told elsewhere.
        let camera = self.scene.chosen_camera().ok().cloned();
        if camera.is_some_and(|camera| shape.on_film(&camera, self.scene.render.size).is_none()) {
            let fault = Diagnostic::error("a part of this line is not before the camera").at(node.span.clone());
            self.faults.push(fault.hint("declare the part that is seen"));
            return None;
        }
        Some(TruthCurve { shape, width })
    }
}
