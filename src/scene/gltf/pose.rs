//! Morph targets and skins move the vertices of a primitive to where they are at the posed time.

use gltf::json::accessor::Type;

use super::accessor::{FLOAT, Wanted};
use super::document::Document;
use super::node::Local;
use super::primitive::Primitive;
use super::report::Report;
use crate::math::{DAffine3, DMat3, DMat4, DVec3, Vec3, Vec4};

/// What moves the vertices of one node's mesh.
#[derive(Clone, Debug, Default)]
pub(super) struct Deformation {
    /// Weights of the morph targets; none if all are 0.
    pub weights: Vec<f32>,
    /// From each joint's bound vertices to the model's space.
    pub joints: Option<Vec<DAffine3>>,
}

impl Deformation {
    /// What deforms a node's mesh. `None` after a fault.
    pub fn of_node(
        document: &Document,
        node: usize,
        local: &Local,
        model_from_nodes: &[DAffine3],
        report: &mut Report,
    ) -> Option<Self> {
        let json = &document.root.nodes[node];
        let mesh = json.mesh.and_then(|mesh| document.root.meshes.get(mesh.value()));
        let weights = local.weights.as_ref().or(mesh.and_then(|mesh| mesh.weights.as_ref()));
        let mut weights = weights.cloned().unwrap_or_default();
        if !weights.iter().all(|weight| weight.is_finite()) {
            return report.fail(format!("nodes[{node}].weights"), "the numbers must be finite");
        }
        if weights.iter().all(|weight| *weight == 0.0) {
            weights.clear();
        }
        let joints = match json.skin {
            Some(skin) => Some(joint_transforms(document, skin.value(), model_from_nodes, report)?),
            None => None,
        };
        Some(Self { weights, joints })
    }

    /// Whether the mesh is as the file has it, so that nodes can share it.
    pub fn is_none(&self) -> bool {
        self.weights.is_empty() && self.joints.is_none()
    }

    /// Moves a primitive's vertices. `None` after a fault.
    pub fn apply(&self, primitive: &mut Primitive, report: &mut Report) -> Option<()> {
        self.morph(primitive);
        match &self.joints {
            Some(joints) => skin(joints, primitive, report),
            None => Some(()),
        }
    }

    fn morph(&self, primitive: &mut Primitive) {
        for (morph, weight) in primitive.morphs.iter().zip(&self.weights) {
            let add = |base: &mut [Vec3], offsets: &[Vec3]| {
                for (value, offset) in base.iter_mut().zip(offsets) {
                    *value += *offset * *weight;
                }
            };
            add(&mut primitive.positions, &morph.positions);
            add(&mut primitive.normals, &morph.normals);
            for (tangent, offset) in primitive.tangents.iter_mut().zip(&morph.tangents) {
                *tangent += (*offset * *weight).extend(0.0);
            }
        }
    }
}

fn joint_transforms(
    document: &Document,
    skin: usize,
    model_from_nodes: &[DAffine3],
    report: &mut Report,
) -> Option<Vec<DAffine3>> {
    let skin_json = &document.root.skins[skin];
    let inverse_binds = match skin_json.inverse_bind_matrices {
        None => vec![DAffine3::IDENTITY; skin_json.joints.len()],
        Some(accessor) => {
            let place = format!("skins[{skin}].inverseBindMatrices");
            let wanted = Wanted { types: &[Type::Mat4], components: FLOAT };
            let matrices = document.floats::<16>(accessor.value(), wanted, &place, report)?;
            if matrices.len() < skin_json.joints.len() {
                let (found, joints) = (matrices.len(), skin_json.joints.len());
                return report.fail(place, format!("{joints} joints need as many matrices, found {found}"));
            }
            if !matrices.as_flattened().iter().all(|number| number.is_finite()) {
                return report.fail(place, "the numbers must be finite");
            }
            let affine = |matrix: &[f32; 16]| DAffine3::from_mat4(DMat4::from_cols_array(&matrix.map(f64::from)));
            matrices.iter().map(affine).collect()
        }
    };
    Some(
        skin_json
            .joints
            .iter()
            .zip(inverse_binds)
            .map(|(joint, inverse_bind)| model_from_nodes[joint.value()] * inverse_bind)
            .collect(),
    )
}

/// Linear blend skinning, into the model's space (specification, section 3.7.3.3).
fn skin(joints: &[DAffine3], primitive: &mut Primitive, report: &mut Report) -> Option<()> {
    if primitive.influences.is_empty() {
        return report.fail(&primitive.place, "its node has a skin, but it has no JOINTS_0 and WEIGHTS_0");
    }
    for (number, set) in primitive.influences.iter().enumerate() {
        let used = set.joints.iter().zip(&set.weights).flat_map(|(joints, weights)| joints.iter().zip(weights));
        if let Some((joint, _)) =
            used.into_iter().find(|(joint, weight)| **weight > 0.0 && **joint as usize >= joints.len())
        {
            let place = format!("{}.attributes.JOINTS_{number}", primitive.place);
            return report.fail(place, format!("joint {joint} is beyond the {} joints of its skin", joints.len()));
        }
    }
    for vertex in 0..primitive.positions.len() {
        let mut sum = 0.0;
        let mut linear = DMat3::ZERO;
        let mut offset = DVec3::ZERO;
        for set in &primitive.influences {
            for (joint, weight) in set.joints[vertex].iter().zip(set.weights[vertex]) {
                if weight > 0.0 {
                    let joint = &joints[*joint as usize];
                    let weight = f64::from(weight);
                    sum += weight;
                    linear += joint.matrix3 * weight;
                    offset += joint.translation * weight;
                }
            }
        }
        // A vertex that no joint holds stays where it was modelled. Weights often miss a sum of 1 by rounding.
        let (linear, offset) = if sum > 0.0 { (linear * sum.recip(), offset / sum) } else { (DMat3::IDENTITY, offset) };
        let position = &mut primitive.positions[vertex];
        *position = (linear * position.as_dvec3() + offset).as_vec3();
        if let Some(normal) = primitive.normals.get_mut(vertex) {
            *normal = (cofactors(linear) * normal.as_dvec3()).normalize_or_zero().as_vec3();
        }
        if let Some(tangent) = primitive.tangents.get_mut(vertex) {
            let direction: Vec3 = (linear * tangent.truncate().as_dvec3()).normalize_or_zero().as_vec3();
            *tangent = Vec4::from((direction, tangent.w));
        }
    }
    Some(())
}

/// What transforms normals: the inverse transpose up to a positive factor, defined for singular matrices too.
fn cofactors(m: DMat3) -> DMat3 {
    let sign = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
    DMat3::from_cols(m.y_axis.cross(m.z_axis) * sign, m.z_axis.cross(m.x_axis) * sign, m.x_axis.cross(m.y_axis) * sign)
}
