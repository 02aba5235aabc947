//! The ray trees of a run of samples while they are traced.

use super::cone::Cone;
use super::media::{Crossing, Media};
use super::record::RunRecord;
use super::surface::Surface;
use super::world::Hit;
use crate::math::Vec3;
use crate::sample::{Node, NodePath};
use crate::scene::ids::MaterialId;
use crate::shade::PathKind;

/// A node of a sample's ray tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct TreeNode {
    /// The sample, as an index into the tile's buffer.
    pub sample: u32,
    pub parent: Option<u32>,
    pub path: NodePath,
    pub kind: PathKind,
    /// What of this node its parent sees.
    pub weight: Vec3,
    /// How much of this node's coverage its parent takes over: what shows through a see-through surface, else 0.
    pub alpha_weight: f32,
    /// Letters of the path that are reflections.
    pub reflections: u8,
    /// Letters of the path that are refractions.
    pub refractions: u8,
    /// The pixel's cone where the ray starts.
    pub cone: Cone,
    /// Path length from the camera to where the ray starts.
    pub length_before: f32,
    /// Product of the weights along the path from the camera.
    pub throughput: Vec3,
    /// Which of the run's attributes the line pass will see, or [`Self::MISS`].
    pub attributes: u32,
    /// Radiance along the ray, without the parent's weight.
    pub radiance: Vec3,
    /// Coverage along the ray.
    pub alpha: f32,
    /// The shader, 1 + its material, that is to blame if the radiance is not finite.
    pub culprit: u32,
}

impl TreeNode {
    /// In place of attributes: the ray has met nothing, or nothing yet.
    pub const MISS: u32 = u32::MAX;

    /// The node of a camera ray.
    pub fn root(sample: u32, cone: Cone) -> Self {
        Self {
            sample,
            parent: None,
            path: NodePath::CAMERA,
            kind: PathKind::Camera,
            weight: Vec3::ONE,
            alpha_weight: 0.0,
            reflections: 0,
            refractions: 0,
            cone,
            length_before: 0.0,
            throughput: Vec3::ONE,
            attributes: Self::MISS,
            radiance: Vec3::ZERO,
            alpha: 1.0,
            culprit: 0,
        }
    }
}

/// A ray that looks for the surface of a node.
#[derive(Clone, Copy, Debug)]
pub(super) struct WaveRay {
    pub origin: Vec3,
    pub direction: Vec3,
    pub node: u32,
    /// The last of the invisible surfaces that the ray has passed, and their number. It goes on from where it started,
    /// so that what it meets next is what it would have met without them.
    pub after: Option<Hit>,
    pub passed: u32,
    /// Which of the run's media it is in.
    pub media: u32,
    /// Bodies at the place ahead that it is known to enter.
    pub counted: u32,
}

impl WaveRay {
    /// The ray behind a hit that it passed as if nothing was there, in other media.
    pub fn going_on(&self, after: &Hit, media: usize) -> Self {
        Self { after: Some(*after), passed: self.passed + 1, media: media as u32, counted: 0, ..*self }
    }
}

/// A ray that met a surface, on its way to be shaded.
#[derive(Clone, Copy, Debug)]
pub(super) struct WaveHit {
    pub ray: WaveRay,
    pub hit: Hit,
    pub surface: Surface,
    pub material: MaterialId,
    /// Path length from the camera.
    pub depth: f32,
    /// Its place in the surface list of its ray: 0 for the first, which makes the picture; only the line pass sees others.
    pub place: u32,
    /// Which of the run's crossings it is part of.
    pub crossing: Option<u32>,
}

/// A run of samples: their trees so far, and the rays that are still to be traced.
#[derive(Debug, Default)]
pub(super) struct Run {
    /// How many of the nodes are the camera's.
    pub roots: usize,
    /// All nodes; those of the camera come first, children stand after their parents.
    pub nodes: Vec<TreeNode>,
    /// What the line pass will see of nodes that are no misses.
    pub attributes: Vec<Node>,
    /// Rays that met something invisible and go on in this wave, for the same node.
    pub again: Vec<WaveRay>,
    /// The next wave.
    pub next: Vec<WaveRay>,
    /// Hits behind the first ones of this wave.
    pub behind: Vec<WaveHit>,
    /// What the line pass will see of surfaces behind the first: the node, the place in its list, the hit, and the attributes.
    pub surfaces: Vec<(u32, u32, Hit, Node)>,
    /// Media of its rays: the first is air.
    pub media: Vec<Media>,
    /// How rays of this wave pass surfaces of bodies.
    pub crossings: Vec<Crossing>,
    /// World position at each camera node, if the plan keeps them.
    pub positions: Vec<Vec3>,
    /// Extra outputs at each camera node, `aov_count` each.
    pub aovs: Vec<Vec3>,
    /// What its rays met, if somebody wants to know later.
    pub record: RunRecord,
}

impl Run {
    /// Empties the run and keeps its memory.
    pub fn clear(&mut self) {
        // The record is told whether it is wanted.
        let Self {
            roots,
            nodes,
            attributes,
            again,
            next,
            behind,
            surfaces,
            media,
            crossings,
            positions,
            aovs,
            record: _,
        } = self;
        *roots = 0;
        nodes.clear();
        attributes.clear();
        again.clear();
        next.clear();
        behind.clear();
        surfaces.clear();
        media.clear();
        media.push(Media::AIR);
        crossings.clear();
        positions.clear();
        aovs.clear();
    }

    /// Adds each node's radiance to its parent's. A parent's reflection stands before its refraction, so the order of
    /// additions is always the same.
    pub fn gather_radiance(&mut self) {
        for index in (0..self.nodes.len()).rev() {
            let TreeNode { weight, radiance, alpha, alpha_weight, culprit, parent, .. } = self.nodes[index];
            if let Some(parent) = parent {
                let parent = &mut self.nodes[parent as usize];
                if !radiance.is_finite() && parent.radiance.is_finite() {
                    parent.culprit = culprit;
                }
                parent.radiance += weight * radiance;
                parent.alpha += alpha_weight * alpha;
            }
        }
    }
}
