//! The node hierarchy: where each node is, and which nodes the scene shows.
//!
//! Transforms are composed in double precision. Nothing here recurses, so a chain of a million nodes is only slow.

use gltf::json;

use super::report::Report;
use crate::math::{DAffine3, DMat4, DQuat, DVec3};

/// A node's own transform and morph weights, after the animation.
#[derive(Clone, Debug)]
pub(super) struct Local {
    pub translation: DVec3,
    pub rotation: DQuat,
    pub scale: DVec3,
    /// Given instead of the three above; an animated node does not use it.
    pub matrix: Option<DAffine3>,
    /// Weights of the node's morph targets; `None`: those of its mesh.
    pub weights: Option<Vec<f32>>,
}

impl Local {
    fn affine(&self) -> DAffine3 {
        self.matrix
            .unwrap_or_else(|| DAffine3::from_scale_rotation_translation(self.scale, self.rotation, self.translation))
    }
}

/// The nodes of a model, known to form trees.
pub(super) struct Hierarchy {
    parents: Vec<Option<usize>>,
    /// All nodes, each after its parent.
    order: Vec<usize>,
    /// The nodes of the shown scene, each after its parent and before its later siblings.
    pub shown: Vec<usize>,
}

/// Finds the hierarchy of the default scene (or the first, or all nodes where there is no scene).
pub(super) fn hierarchy(root: &json::Root, report: &mut Report) -> Option<Hierarchy> {
    let count = root.nodes.len();
    let children = |node: usize| root.nodes[node].children.iter().flatten().map(|child| child.value());
    let mut parents: Vec<Option<usize>> = vec![None; count];
    let mut sound = true;
    for parent in 0..count {
        for child in children(parent) {
            if let Some(other) = parents[child].replace(parent) {
                sound = false;
                report.error(
                    format!("nodes[{parent}].children"),
                    format!("nodes[{child}] is a child of nodes[{other}] too; a node has one parent"),
                );
            }
        }
    }
    if !sound {
        return None;
    }
    let roots: Vec<usize> = (0..count).filter(|node| parents[*node].is_none()).collect();
    let order = preorder(&roots, children);
    if order.len() < count {
        return report.fail("nodes", cycle(&parents, &order));
    }
    let scene = root.scene.map_or(0, |scene| scene.value());
    let listed: Vec<usize> = match root.scenes.get(scene) {
        Some(scene) => scene.nodes.iter().map(|node| node.value()).collect(),
        None => roots,
    };
    let shown = preorder(&listed, children);
    let mut seen = vec![false; count];
    for node in &shown {
        if std::mem::replace(&mut seen[*node], true) {
            let place = format!("scenes[{scene}].nodes");
            return report.fail(place, format!("nodes[{node}] is reached twice; list only the topmost nodes, once"));
        }
    }
    Some(Hierarchy { parents, order, shown })
}

/// All nodes below and including `tops`, depth first. Ends because each node has one parent.
fn preorder<I: Iterator<Item = usize>>(tops: &[usize], children: impl Fn(usize) -> I) -> Vec<usize> {
    let mut order = Vec::new();
    let mut stack: Vec<usize> = tops.iter().rev().copied().collect();
    while let Some(node) = stack.pop() {
        order.push(node);
        let first = stack.len();
        stack.extend(children(node));
        stack[first..].reverse();
    }
    order
}

/// Spells out a cycle among the nodes that no parentless node leads to.
fn cycle(parents: &[Option<usize>], reached: &[usize]) -> String {
    let mut outside = vec![true; parents.len()];
    for node in reached {
        outside[*node] = false;
    }
    let start = outside.iter().position(|outside| *outside).unwrap_or(0);
    let up = |node: usize| parents[node].unwrap_or(node);
    // After as many steps as there are nodes the walk is on the cycle.
    let on_cycle = (0..parents.len()).fold(start, |node, _| up(node));
    let mut names = vec![format!("nodes[{on_cycle}]")];
    let mut node = up(on_cycle);
    while node != on_cycle && names.len() < 8 {
        names.push(format!("nodes[{node}]"));
        node = up(node);
    }
    names.push(if node == on_cycle { format!("nodes[{on_cycle}]") } else { "…".into() });
    format!("a node is its own ancestor: {}", names.join(" in "))
}

/// The nodes' own transforms as the file gives them.
pub(super) fn locals(root: &json::Root, report: &mut Report) -> Vec<Local> {
    root.nodes
        .iter()
        .enumerate()
        .map(|(index, node)| {
            let mut fault = |field: &str, message: &str| report.error(format!("nodes[{index}].{field}"), message);
            let translation = DVec3::from(node.translation.unwrap_or_default().map(f64::from));
            let scale = DVec3::from(node.scale.unwrap_or([1.0; 3]).map(f64::from));
            let rotation = DQuat::from_array(node.rotation.unwrap_or_default().0.map(f64::from));
            for (field, finite) in [("translation", translation.is_finite()), ("scale", scale.is_finite())] {
                if !finite {
                    fault(field, "the numbers must be finite");
                }
            }
            let length = rotation.length();
            let rotation = if length.is_finite() && length > 0.0 {
                rotation / length
            } else {
                fault("rotation", "a rotation must be a quaternion of length 1");
                DQuat::IDENTITY
            };
            let matrix = node.matrix.map(|matrix| DMat4::from_cols_array(&matrix.map(f64::from)));
            if let Some(matrix) = matrix {
                if !matrix.is_finite() {
                    fault("matrix", "the numbers must be finite");
                } else if matrix.row(3).to_array() != [0.0, 0.0, 0.0, 1.0] {
                    fault("matrix", "the last row (every fourth number) must be 0, 0, 0, 1");
                }
            }
            let matrix = matrix.map(DAffine3::from_mat4);
            Local { translation, rotation, scale, matrix, weights: node.weights.clone() }
        })
        .collect()
}

/// From each node to the model's space.
pub(super) fn model_from_nodes(hierarchy: &Hierarchy, locals: &[Local]) -> Vec<DAffine3> {
    let mut composed: Vec<DAffine3> = vec![DAffine3::IDENTITY; locals.len()];
    for node in &hierarchy.order {
        let local = locals[*node].affine();
        composed[*node] = hierarchy.parents[*node].map_or(local, |parent| composed[parent] * local);
    }
    composed
}

/// Whether a transform keeps volumes: those that do not (a scale of 0) leave nothing to see.
pub(super) fn is_invertible(transform: &DAffine3) -> bool {
    let determinant = transform.matrix3.determinant();
    determinant != 0.0 && determinant.is_finite() && transform.inverse().is_finite()
}
