//! The triangles of a mesh under a hierarchy, four side by side, in the mesh's own space.

use obvhs::aabb::Aabb;

use super::eight::{Eights, Pairs};
use super::tree::{BoxTree, Leaf, Visitor};
use super::triangle::{NOT_AHEAD, Ray, TriangleHit};
use crate::math::{Vec3, Vec3A, Vec4};
use crate::scene::mesh::Mesh;

/// Triangles of a block.
pub(super) const WIDTH: usize = 4;
/// The id of an absent triangle.
pub(super) const NO_TRIANGLE: u32 = u32::MAX;

/// Four triangles. Absent ones have vertices that are NaN, so that no ray meets them.
#[derive(Clone, Copy)]
#[repr(C, align(32))]
pub(super) struct Block {
    /// By vertex and axis.
    corners: [[Vec4; 3]; 3],
    ids: [u32; WIDTH],
}

impl Block {
    /// One triangle's id and vertices; `None` beyond the last.
    #[inline(always)]
    pub fn triangle(&self, place: usize) -> Option<(u32, [Vec3; 3])> {
        let id = self.ids[place];
        let corner = |[x, y, z]: &[Vec4; 3]| Vec3::new(x[place], y[place], z[place]);
        let [a, b, c] = &self.corners;
        (id != NO_TRIANGLE).then(|| (id, [corner(a), corner(b), corner(c)]))
    }

    /// Shows each triangle that the ray meets within `*t_max`, but the one that it `leaves`, to `accept`. The tests are those of [`Ray::triangle`],
    /// operation by operation, on four triangles at a time; where it does more than that, it is asked itself.
    #[inline(always)]
    fn intersect(
        &self,
        (ray, leaves): (&Ray, u32),
        near: f32,
        t_max: &mut f32,
        accept: &mut impl FnMut(u32, TriangleHit, &mut f32) -> bool,
    ) -> bool {
        let [kx, ky, kz] = ray.axes;
        let (kx, ky, kz) = (kx.min(2), ky.min(2), kz.min(2));
        let origin = ray.origin.to_array();
        let from = [Vec4::splat(origin[kx]), Vec4::splat(origin[ky]), Vec4::splat(origin[kz])];
        let shear = [Vec4::splat(ray.shear.x), Vec4::splat(ray.shear.y)];
        let sz = Vec4::splat(ray.shear.z);
        let [a, b, c] = &self.corners;
        let [ax, ay, az] = sheared([a[kx], a[ky], a[kz]], from, shear);
        let [bx, by, bz] = sheared([b[kx], b[ky], b[kz]], from, shear);
        let [cx, cy, cz] = sheared([c[kx], c[ky], c[kz]], from, shear);
        let u = cx * by - cy * bx;
        let v = ax * cy - ay * cx;
        let w = bx * ay - by * ax;
        let zero = Vec4::ZERO;
        let outside = u.min(v).min(w).cmplt(zero) & u.max(v).max(w).cmpgt(zero);
        let edge = u.cmpeq(zero) | v.cmpeq(zero) | w.cmpeq(zero);
        if (!outside | edge).bitmask() == 0 {
            return true;
        }
        let determinant = u + v + w;
        let [az, bz, cz] = [sz * az, sz * bz, sz * cz];
        let t = (u * az + v * bz + w * cz) / determinant;
        let largest = az.abs().max(bz.abs()).max(cz.abs());
        let special = edge | (!outside & az.min(bz).min(cz).cmple(largest * NOT_AHEAD));
        let mut candidates = ((!outside & t.cmpgt(zero) & t.cmple(Vec4::splat(*t_max))) | special).bitmask();
        if candidates == 0 {
            return true;
        }
        let special = special.bitmask();
        let [t, v, w, determinant] = [t, v, w, determinant].map(|four| four.to_array());
        while candidates != 0 {
            let place = candidates.trailing_zeros() as usize % WIDTH;
            candidates &= candidates - 1;
            if self.ids[place] == leaves {
                continue;
            }
            let hit = if special & (1 << place) == 0 {
                let determinant = determinant[place];
                let [u, v] = [v[place] / determinant, w[place] / determinant];
                let vertices = self.triangle(place).map_or([Vec3::NAN; 3], |(_, vertices)| vertices);
                let slack = ray.slack(&vertices, t[place]);
                Some(TriangleHit { t: t[place], u, v, front: determinant > 0.0, slack })
            } else {
                self.triangle(place).and_then(|(_, vertices)| ray.triangle(&vertices, *t_max))
            };
            if let Some(mut hit) = hit {
                // See the head of `tree`.
                hit.t = hit.t.max(near);
                if hit.t <= *t_max && !accept(self.ids[place], hit, t_max) {
                    return false;
                }
            }
        }
        true
    }
}

/// Four vertices in the space where the ray is the z axis, before z is scaled.
#[inline(always)]
fn sheared([x, y, z]: [Vec4; 3], [x0, y0, z0]: [Vec4; 3], [sx, sy]: [Vec4; 2]) -> [Vec4; 3] {
    let z = z - z0;
    [x - x0 - sx * z, y - y0 - sy * z, z]
}

/// A mesh's triangles under a hierarchy, in the mesh's own space.
#[derive(Clone)]
pub struct MeshTree {
    tree: BoxTree,
    blocks: Vec<Block>,
}

impl std::fmt::Debug for MeshTree {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "MeshTree({:?}, {} blocks)", self.tree, self.blocks.len())
    }
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
        let mut tree = BoxTree::new(&boxes, WIDTH as u32);
        let mut blocks = Vec::with_capacity(boxes.len() / 2);
        let order = std::mem::take(&mut tree.order);
        tree.number_leaves(|places| {
            let first = blocks.len() as u32;
            for places in order[places].chunks(WIDTH) {
                let mut block = Block { corners: [[Vec4::NAN; 3]; 3], ids: [NO_TRIANGLE; WIDTH] };
                for (lane, place) in places.iter().enumerate() {
                    let id = ids[*place as usize];
                    block.ids[lane] = id;
                    for (into, corner) in block.corners.iter_mut().zip(corners(&mesh.triangles[id as usize])) {
                        for (axis, into) in into.iter_mut().enumerate() {
                            into[lane] = corner[axis];
                        }
                    }
                }
                blocks.push(block);
            }
            (first, blocks.len() as u32 - first)
        });
        blocks.shrink_to_fit();
        Self { tree, blocks }
    }

    /// The box around the mesh; `None` if it has no triangles.
    #[must_use]
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        self.tree.bounds()
    }

    /// Memory that the hierarchy and its copy of the triangles take.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.tree.bytes() + size_of_val(&self.blocks[..])
    }

    /// The hierarchy; its leaves hold places among the blocks.
    #[inline(always)]
    pub(super) fn tree(&self) -> &BoxTree {
        &self.tree
    }

    /// What a leaf holds.
    #[inline(always)]
    pub(super) fn blocks(&self, leaf: &Leaf<'_>) -> &[Block] {
        &self.blocks[leaf.range()]
    }

    /// Shows each triangle that the ray meets within `*t_max` to `accept`, with its id, roughly front to back.
    /// `accept` may lower `t_max` and returns whether to go on.
    pub fn intersect(&self, ray: &Ray, t_max: &mut f32, accept: impl FnMut(u32, TriangleHit, &mut f32) -> bool) {
        self.intersect_with::<_, true>(Pairs, (ray, NO_TRIANGLE), t_max, accept);
    }

    /// The same with chosen instructions, nearer triangles first or anyhow, but for the triangle that the ray leaves.
    #[inline(always)]
    pub(super) fn intersect_with<E: Eights, const NEAR_FIRST: bool>(
        &self,
        eights: E,
        (ray, leaves): (&Ray, u32),
        t_max: &mut f32,
        accept: impl FnMut(u32, TriangleHit, &mut f32) -> bool,
    ) {
        self.tree.traverse(eights, ray, t_max, InLeaf::<_, NEAR_FIRST> { tree: self, ray, leaves, accept });
    }
}

/// Looks at the triangles of leaves.
struct InLeaf<'a, A, const NEAR_FIRST: bool> {
    tree: &'a MeshTree,
    ray: &'a Ray,
    leaves: u32,
    accept: A,
}

impl<A: FnMut(u32, TriangleHit, &mut f32) -> bool, const NEAR_FIRST: bool> Visitor for InLeaf<'_, A, NEAR_FIRST> {
    const NEAR_FIRST: bool = NEAR_FIRST;

    #[inline(always)]
    fn leaf<E: Eights>(&mut self, _: E, leaf: Leaf<'_>, t_max: &mut f32) -> bool {
        for block in self.tree.blocks(&leaf) {
            if !block.intersect((self.ray, self.leaves), leaf.near, t_max, &mut self.accept) {
                return false;
            }
        }
        true
    }
}
