//! Bounding volume hierarchies: obvhs builds them, the traversal is ours.
//!
//! obvhs' own ray loop clamps directions at 1e-7 and does not round its box test outwards, so a ray may miss a box
//! whose triangle it meets. Here the far distance is widened as Ize shows ("Robust BVH Ray Traversal", JCGT 2013), and
//! boxes at the best distance, give or take roundings, are still visited, so that ties are settled by the lower triangle
//! id and not by the order of the tree.

use std::time::Duration;

use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::bvh2::node::Bvh2Node;

use super::triangle::{Ray, TriangleHit};
use crate::math::{Vec3, Vec3A};
use crate::scene::mesh::Mesh;

/// 1 + 2 γ(3) in single precision, rounded up (Ize 2013, section 3).
const BOX_FAR_SCALE: f32 = 1.000_000_4;
/// The distance to a box and the one to a triangle on its face are rounded differently; this covers both.
const BOX_NEAR_SCALE: f32 = 0.999_998;

/// A hierarchy over any boxes. Its leaves are runs of [`BoxTree::order`].
#[derive(Clone, Default)]
pub struct BoxTree {
    nodes: Vec<Bvh2Node>,
    /// The box of each place in the leaves, as an index into the boxes that the tree was built over.
    pub order: Vec<u32>,
}

impl std::fmt::Debug for BoxTree {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "BoxTree({} nodes over {} boxes)", self.nodes.len(), self.order.len())
    }
}

impl BoxTree {
    /// Builds a hierarchy. All boxes must be finite.
    #[must_use]
    pub fn new(boxes: &[Aabb]) -> Self {
        if boxes.is_empty() {
            return Self::default();
        }
        let Bvh2 { nodes, primitive_indices, .. } =
            build_bvh2(boxes, BvhBuildParams::medium_build(), &mut Duration::default());
        Self { nodes, order: primitive_indices }
    }

    /// The box around everything.
    #[must_use]
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        self.nodes.first().map(|root| (root.aabb().min.into(), root.aabb().max.into()))
    }

    /// Visits the leaf places whose boxes a ray may meet within `*t_max`, roughly front to back. `visit` gets a range
    /// of places in [`Self::order`], may lower `t_max`, and returns whether to go on.
    #[inline]
    pub fn traverse(
        &self,
        ray: &Ray,
        t_max: &mut f32,
        mut visit: impl FnMut(std::ops::Range<usize>, &mut f32) -> bool,
    ) {
        let origin = Vec3A::from(ray.origin);
        let inverse = Vec3A::from(ray.inverse);
        let enter = |node: &Bvh2Node| {
            let bounds = node.aabb();
            let t1 = (bounds.min - origin) * inverse;
            let t2 = (bounds.max - origin) * inverse;
            let near = t1.min(t2).max_element().max(0.0) * BOX_NEAR_SCALE;
            let far = t1.max(t2).min_element() * BOX_FAR_SCALE;
            if near <= far { near } else { f32::INFINITY }
        };
        let leaf = |node: &Bvh2Node| {
            let first = node.first_index as usize;
            first..first + node.prim_count as usize
        };

        let Some(root) = self.nodes.first() else { return };
        let root_near = enter(root);
        if root_near == f32::INFINITY || root_near > *t_max {
            return;
        }
        if root.is_leaf() {
            visit(leaf(root), t_max);
            return;
        }
        let mut stack = Stack::new();
        let mut pair = root.first_index as usize;
        loop {
            let (mut left, mut right) = (&self.nodes[pair], &self.nodes[pair + 1]);
            let (mut left_near, mut right_near) = (enter(left), enter(right));
            if right_near < left_near {
                std::mem::swap(&mut left, &mut right);
                std::mem::swap(&mut left_near, &mut right_near);
            }
            let mut next = None;
            if left_near != f32::INFINITY && left_near <= *t_max {
                if left.is_leaf() {
                    if !visit(leaf(left), t_max) {
                        return;
                    }
                } else {
                    next = Some(left.first_index as usize);
                }
            }
            if right_near != f32::INFINITY && right_near <= *t_max {
                if right.is_leaf() {
                    if !visit(leaf(right), t_max) {
                        return;
                    }
                } else if next.is_some() {
                    stack.push(right.first_index, right_near);
                } else {
                    next = Some(right.first_index as usize);
                }
            }
            pair = match next {
                Some(pair) => pair,
                None => loop {
                    match stack.pop() {
                        None => return,
                        Some((pair, near)) if near <= *t_max => break pair as usize,
                        Some(_) => {}
                    }
                },
            };
        }
    }
}

/// Postponed nodes: on the stack for the depths that rays go to, on the heap beyond. Clearing it is part of the cost of
/// every ray, so it is no larger than needed.
struct Stack {
    inline: [(u32, f32); Self::INLINE],
    length: usize,
    beyond: Vec<(u32, f32)>,
}

impl Stack {
    const INLINE: usize = 32;

    fn new() -> Self {
        Self { inline: [(0, 0.0); Self::INLINE], length: 0, beyond: Vec::new() }
    }

    #[inline]
    fn push(&mut self, pair: u32, near: f32) {
        match self.inline.get_mut(self.length) {
            Some(place) => {
                *place = (pair, near);
                self.length += 1;
            }
            None => self.beyond.push((pair, near)),
        }
    }

    #[inline]
    fn pop(&mut self) -> Option<(u32, f32)> {
        if let Some(entry) = self.beyond.pop() {
            return Some(entry);
        }
        self.length = self.length.checked_sub(1)?;
        Some(self.inline[self.length])
    }
}

/// A mesh's triangles under a hierarchy, in the mesh's own space.
#[derive(Clone, Debug)]
pub struct MeshTree {
    tree: BoxTree,
    /// Vertex positions of the triangles, in leaf order, so that a leaf reads one run of memory.
    triangles: Vec<[Vec3; 3]>,
}

impl MeshTree {
    /// Builds the hierarchy of a mesh. Triangles with a coordinate that is not finite are left out.
    #[must_use]
    pub fn new(mesh: &Mesh) -> Self {
        let corners = |triangle: &[u32; 3]| triangle.map(|vertex| mesh.positions[vertex as usize]);
        let (ids, boxes): (Vec<u32>, Vec<Aabb>) = mesh
            .triangles
            .iter()
            .enumerate()
            .map(|(id, triangle)| (id as u32, corners(triangle)))
            .filter(|(_, corners)| corners.iter().all(|corner| corner.is_finite()))
            .map(|(id, corners)| (id, Aabb::from_points(&corners.map(Vec3A::from))))
            .unzip();
        let mut tree = BoxTree::new(&boxes);
        for place in &mut tree.order {
            *place = ids[*place as usize];
        }
        let triangles = tree.order.iter().map(|id| corners(&mesh.triangles[*id as usize])).collect();
        Self { tree, triangles }
    }

    /// The box around the mesh; `None` if it has no triangles.
    #[must_use]
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        self.tree.bounds()
    }

    /// Shows each triangle that the ray meets within `*t_max` to `accept`, with its id, roughly front to back.
    /// `accept` may lower `t_max` and returns whether to go on.
    #[inline]
    pub fn intersect(&self, ray: &Ray, t_max: &mut f32, mut accept: impl FnMut(u32, TriangleHit, &mut f32) -> bool) {
        self.tree.traverse(ray, t_max, |places, t_max| {
            for place in places {
                if let Some(hit) = ray.triangle(&self.triangles[place], *t_max)
                    && !accept(self.tree.order[place], hit, t_max)
                {
                    return false;
                }
            }
            true
        });
    }
}
