//! Bounding volume hierarchies: obvhs builds binary ones, whose nodes are merged into nodes of eight; the traversal is ours.
//!
//! obvhs' own ray loop clamps directions at 1e-7 and does not round its box test outwards, so a ray may miss a box
//! whose triangle it meets. Here the far distance is widened as Ize shows ("Robust BVH Ray Traversal", JCGT 2013), and
//! boxes at the best distance, give or take roundings, are still visited, so that ties are settled by the lower triangle
//! id and not by the order of the tree.
//!
//! **What a ray visits depends on the boxes of the leaves alone.** Subtraction, product, minimum and maximum round
//! monotonically, so a box inside another is never entered before it or left behind it, and a ray that enters a leaf has
//! entered all boxes around it. No hit counts as nearer than the near side of its leaf, so that one that is not visited any
//! more could not have won. That is why packets, which go down the tree together and decide for each ray at the leaves,
//! find the same bits as single rays.

use std::ops::Range;
use std::time::Duration;

use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::bvh2::node::Bvh2Node;
use smallvec::{SmallVec, smallvec};

use super::eight::{Eights, WIDTH};
use super::triangle::Ray;
use crate::math::Vec3;

/// 1 + 2 γ(3) in single precision, rounded up (Ize 2013, section 3).
pub(super) const BOX_FAR_SCALE: f32 = 1.000_000_4;
/// The distance to a box and the one to a triangle on its face are rounded differently; this covers both.
pub(super) const BOX_NEAR_SCALE: f32 = 0.999_998;

/// Eight children and their boxes.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
struct Node {
    /// Low x, y, z, then high x, y, z of all children. Boxes of absent children are inside out, so that no ray enters them.
    planes: [[f32; WIDTH]; 6],
    /// Where a child's places start, or which node it is.
    first: [u32; WIDTH],
    /// How many places a child has; 0 for nodes.
    count: [u32; WIDTH],
}

impl Node {
    const EMPTY: Self = Self {
        planes: [
            [f32::INFINITY; WIDTH],
            [f32::INFINITY; WIDTH],
            [f32::INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
            [f32::NEG_INFINITY; WIDTH],
        ],
        first: [0; WIDTH],
        count: [0; WIDTH],
    };
}

/// A leaf that is visited.
#[derive(Clone, Copy)]
pub struct Leaf<'a> {
    /// What is in it: places in [`BoxTree::order`], or what [`BoxTree::number_leaves`] made of them.
    pub places: Places,
    /// Distance at which its box is entered, rounded down.
    pub near: f32,
    node: &'a Node,
    child: usize,
}

/// Where places start and how many there are.
pub type Places = (u32, u32);

impl Leaf<'_> {
    /// Its places.
    #[inline(always)]
    #[must_use]
    pub fn range(&self) -> Range<usize> {
        self.places.0 as usize..(self.places.0 + self.places.1) as usize
    }

    /// Low x, y, z, then high x, y, z of its box.
    #[inline(always)]
    #[must_use]
    pub(super) fn planes(&self) -> [f32; 6] {
        self.node.planes.each_ref().map(|plane| plane[self.child])
    }
}

/// What goes down a tree: a ray, or the bounds of several.
pub trait Slabs<E: Eights> {
    /// Distances at which eight boxes, given by their planes, are entered and left, as they are before they are scaled.
    fn distances(&self, eights: E, planes: &[[f32; WIDTH]; 6]) -> (E::Eight, E::Eight);
}

/// Looks into leaves. A closure does; packets have types of their own, because what runs under wider instructions has to be
/// inlined, which no closure can be made to be.
pub trait Visitor {
    /// Whether nearer leaves should come first. Whoever looks for anything at all is quicker without.
    const NEAR_FIRST: bool = true;

    /// Looks into a leaf that is entered within `t_max`, which it may lower; returns whether to go on.
    fn leaf<E: Eights>(&mut self, eights: E, leaf: Leaf<'_>, t_max: &mut f32) -> bool;
}

impl<F: FnMut(Leaf<'_>, &mut f32) -> bool> Visitor for F {
    #[inline(always)]
    fn leaf<E: Eights>(&mut self, _: E, leaf: Leaf<'_>, t_max: &mut f32) -> bool {
        self(leaf, t_max)
    }
}

/// A ray as the box test sees it.
struct RaySlabs<E: Eights> {
    origin: [E::Eight; 3],
    inverse: [E::Eight; 3],
    /// Which planes are entered and left, by axis.
    near: [usize; 3],
    far: [usize; 3],
}

impl<E: Eights> RaySlabs<E> {
    #[inline(always)]
    fn new(eights: E, ray: &Ray) -> Self {
        let side = |inverse: f32| if inverse < 0.0 { 3 } else { 0 };
        let (x, y, z) = (side(ray.inverse.x), side(ray.inverse.y), side(ray.inverse.z));
        let (origin, inverse) = (ray.origin, ray.inverse);
        Self {
            origin: [eights.splat(origin.x), eights.splat(origin.y), eights.splat(origin.z)],
            inverse: [eights.splat(inverse.x), eights.splat(inverse.y), eights.splat(inverse.z)],
            near: [x, 1 + y, 2 + z],
            far: [3 - x, 4 - y, 5 - z],
        }
    }
}

impl<E: Eights> RaySlabs<E> {
    /// Distances to the planes of three axes.
    #[inline(always)]
    fn at(&self, e: E, planes: &[[f32; WIDTH]; 6], [x, y, z]: [usize; 3]) -> [E::Eight; 3] {
        let ([ox, oy, oz], [ix, iy, iz]) = (self.origin, self.inverse);
        [
            e.mul(e.sub(e.load(&planes[x.min(5)]), ox), ix),
            e.mul(e.sub(e.load(&planes[y.min(5)]), oy), iy),
            e.mul(e.sub(e.load(&planes[z.min(5)]), oz), iz),
        ]
    }
}

impl<E: Eights> Slabs<E> for RaySlabs<E> {
    #[inline(always)]
    fn distances(&self, e: E, planes: &[[f32; WIDTH]; 6]) -> (E::Eight, E::Eight) {
        let [nx, ny, nz] = self.at(e, planes, self.near);
        let [fx, fy, fz] = self.at(e, planes, self.far);
        (e.max(e.max(nx, ny), nz), e.min(e.min(fx, fy), fz))
    }
}

#[inline(always)]
pub(super) fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[inline(always)]
pub(super) fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// A hierarchy over any boxes. Its leaves are runs of [`BoxTree::order`].
#[derive(Clone, Default)]
pub struct BoxTree {
    nodes: Vec<Node>,
    bounds: Option<(Vec3, Vec3)>,
    /// The box of each place in the leaves, as an index into the boxes that the tree was built over.
    pub order: Vec<u32>,
}

impl std::fmt::Debug for BoxTree {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "BoxTree({} nodes over {} boxes)", self.nodes.len(), self.order.len())
    }
}

impl BoxTree {
    /// Builds a hierarchy with at most `most` boxes in a leaf. All boxes must be finite.
    #[must_use]
    pub fn new(boxes: &[Aabb], most: u32) -> Self {
        if boxes.is_empty() {
            return Self::default();
        }
        let parameters = BvhBuildParams { max_prims_per_leaf: most, ..BvhBuildParams::medium_build() };
        let Bvh2 { nodes: pairs, primitive_indices, .. } = build_bvh2(boxes, parameters, &mut Duration::default());
        let bounds = pairs.first().map(|root| (root.aabb().min.into(), root.aabb().max.into()));
        Self { nodes: merge(&pairs), bounds, order: primitive_indices }
    }

    /// The box around everything.
    #[must_use]
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        self.bounds
    }

    /// Memory that the tree takes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.order[..])
    }

    /// Replaces the places of each leaf.
    pub fn number_leaves(&mut self, mut places: impl FnMut(Range<usize>) -> Places) {
        for node in &mut self.nodes {
            for child in 0..WIDTH {
                if node.count[child] > 0 {
                    let first = node.first[child] as usize;
                    (node.first[child], node.count[child]) = places(first..first + node.count[child] as usize);
                }
            }
        }
    }

    /// Visits the leaves that a ray enters within `*t_max`, roughly front to back. `visit` may lower `t_max` and returns
    /// whether to go on.
    #[inline(always)]
    pub fn traverse<E: Eights, V: Visitor>(&self, eights: E, ray: &Ray, t_max: &mut f32, visit: V) {
        if ray.is_sound() {
            self.walk(eights, &RaySlabs::new(eights, ray), t_max, visit);
        }
    }

    /// The same for anything that has slab distances, none of which may be NaN.
    #[inline(always)]
    pub fn walk<E: Eights, V: Visitor>(&self, e: E, slabs: &impl Slabs<E>, t_max: &mut f32, mut visit: V) {
        if self.nodes.is_empty() {
            return;
        }
        // Postponed children: on the stack for the depths that rays go to, on the heap beyond.
        let mut stack: SmallVec<[u64; 48]> = SmallVec::new();
        let mut at = 0;
        loop {
            let node = &self.nodes[at];
            let (near, far) = slabs.distances(e, &node.planes);
            let near = e.mul(e.max(near, e.splat(0.0)), e.splat(BOX_NEAR_SCALE));
            let far = e.min(e.mul(far, e.splat(BOX_FAR_SCALE)), e.splat(*t_max));
            let mut left = e.at_most(near, far);
            let nears = e.store(near);
            // A key is a distance and a child; distances are not negative, so keys are in their order.
            let key = |left: u32| {
                let child = left.trailing_zeros() & (WIDTH as u32 - 1);
                u64::from(nears[child as usize].to_bits()) << 32 | u64::from(at as u32 * WIDTH as u32 + child)
            };
            let mut next = None;
            if left != 0 {
                let mut nearest = key(left);
                left &= left - 1;
                if !V::NEAR_FIRST {
                    while left != 0 {
                        stack.push(key(left));
                        left &= left - 1;
                    }
                } else if left != 0 {
                    let mut second = key(left);
                    left &= left - 1;
                    if second < nearest {
                        std::mem::swap(&mut nearest, &mut second);
                    }
                    if left != 0 {
                        // Farthest first.
                        let mut keys = [0; WIDTH];
                        (keys[0], keys[1]) = (second, nearest);
                        let mut count = 2;
                        while left != 0 && count < WIDTH {
                            let key = key(left);
                            left &= left - 1;
                            let mut place = count;
                            while place > 0 && keys[place - 1] < key {
                                keys[place] = keys[place - 1];
                                place -= 1;
                            }
                            keys[place] = key;
                            count += 1;
                        }
                        nearest = keys[count - 1];
                        keys[..count - 1].iter().for_each(|key| stack.push(*key));
                    } else {
                        stack.push(second);
                    }
                }
                next = Some(nearest);
            }
            at = loop {
                let Some(key) = next.take().or_else(|| stack.pop()) else { return };
                let near = f32::from_bits((key >> 32) as u32);
                if near > *t_max {
                    continue;
                }
                let (parent, child) = (key as u32 as usize / WIDTH, key as usize % WIDTH);
                let node = &self.nodes[parent];
                let places = (node.first[child], node.count[child]);
                if places.1 == 0 {
                    break places.0 as usize;
                }
                if !visit.leaf(e, Leaf { places, near, node, child }, t_max) {
                    return;
                }
            };
        }
    }
}

/// Merges a binary hierarchy into nodes of eight: of the children of a node the largest is replaced by its own two until
/// there are eight. The children of a node stand next to each other.
fn merge(pairs: &[Bvh2Node]) -> Vec<Node> {
    let mut nodes = vec![Node::EMPTY];
    // Nodes to fill, with what of the binary tree they stand for.
    let mut open = vec![(0_usize, 0_u32)];
    while let Some((node, pair)) = open.pop() {
        let mut children: SmallVec<[u32; WIDTH]> = smallvec![pair];
        while children.len() < WIDTH {
            let area = |place: usize| pairs[children[place] as usize].aabb().half_area();
            let largest = (0..children.len())
                .filter(|&place| !pairs[children[place] as usize].is_leaf())
                .max_by(|&a, &b| area(a).total_cmp(&area(b)));
            let Some(largest) = largest else { break };
            let first = pairs[children[largest] as usize].first_index;
            children[largest] = first;
            children.push(first + 1);
        }
        for (child, &pair) in children.iter().enumerate() {
            let from = &pairs[pair as usize];
            let bounds = from.aabb();
            for axis in 0..3 {
                nodes[node].planes[axis][child] = bounds.min[axis];
                nodes[node].planes[axis + 3][child] = bounds.max[axis];
            }
            if from.is_leaf() {
                nodes[node].first[child] = from.first_index;
                nodes[node].count[child] = from.prim_count;
            } else {
                nodes[node].first[child] = nodes.len() as u32;
                open.push((nodes.len(), pair));
                nodes.push(Node::EMPTY);
            }
        }
    }
    nodes
}
