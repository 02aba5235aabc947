//! The scene as rays see it: a hierarchy over objects, each a mesh with its own hierarchy and a transform.

use std::sync::Arc;

use obvhs::aabb::Aabb;
use rayon::prelude::*;

use super::eight::{Eights, Task, dispatch};
use super::mesh_tree::{MeshTree, NO_TRIANGLE};
use super::tree::{BoxTree, Leaf, Visitor};
use super::triangle::Ray;
use crate::math::{DVec3, Mat3, Vec3, Vec3A};
use crate::scene::Scene;
use crate::scene::ids::{MaterialId, ObjectId};
use crate::scene::mesh::Mesh;
use crate::scene::settings::RayKinds;

/// Where a ray meets an object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance in lengths of the ray's direction.
    pub t: f32,
    /// The object.
    pub object: ObjectId,
    /// Index into the triangles of its mesh.
    pub triangle: u32,
    /// Barycentric weights of the triangle's second and third vertex.
    pub barycentric: [f32; 2],
    /// Whether the front of the triangle was met. The side that is the front in the mesh's own space stays it under
    /// mirroring transforms, as glTF has it.
    pub front: bool,
    /// Whether the ray meets other surfaces at the same place.
    pub crowded: bool,
}

/// One triangle of one object: a ray meets it once at most.
pub type Facet = (ObjectId, u32);

impl Hit {
    /// The triangle.
    #[must_use]
    pub fn facet(&self) -> Facet {
        (self.object, self.triangle)
    }
}

/// An object, placed relative to the camera.
#[derive(Clone, Debug)]
pub struct PlacedObject {
    /// Its mesh.
    pub mesh: Arc<Mesh>,
    /// Materials by slot.
    pub materials: Vec<MaterialId>,
    /// Linear part of the transform into the world.
    pub world_from_object: Mat3,
    /// Where the object's origin lies, relative to the camera.
    pub translation: Vec3,
    pub(super) object_from_world: Mat3,
    /// Whether the object is neither turned nor scaled: most models come that way, and rays go on there as they are.
    pub(super) is_only_moved: bool,
    /// Inverse transpose of the linear part, for normals.
    pub normal_from_object: Mat3,
    pub(super) visible_to: RayKinds,
    /// By slot: which of coplanar surfaces is seen.
    pub(super) priorities: Vec<i32>,
    pub(super) tree: Arc<MeshTree>,
    /// By slot: whether the back side is invisible to camera, reflection and refraction rays.
    pub(super) single_sided: Vec<bool>,
}

impl PlacedObject {
    /// The material slot of a triangle.
    #[inline]
    #[must_use]
    pub fn slot(&self, triangle: u32) -> usize {
        self.mesh.slots.get(triangle as usize).map_or(0, |slot| usize::from(*slot))
    }

    #[inline(always)]
    pub(super) fn to_object(&self, ray: &Ray) -> Ray {
        let (grain, origin) = (self.grain(ray.origin), ray.origin - self.translation);
        if self.is_only_moved {
            return Ray { origin, grain, ..*ray };
        }
        Ray { grain, ..Ray::new(self.object_from_world * origin, self.object_from_world * ray.direction) }
    }

    /// The grain, in the object's space, of a ray that starts at `origin`.
    #[inline]
    pub(super) fn grain(&self, origin: Vec3) -> Vec3 {
        let m = self.object_from_world;
        let rounded = origin.abs() + self.translation.abs();
        if self.is_only_moved {
            return rounded;
        }
        m.x_axis.abs() * rounded.x + m.y_axis.abs() * rounded.y + m.z_axis.abs() * rounded.z
    }
}

/// The scene as rays see it. Everything is relative to the camera's position.
#[derive(Clone, Debug)]
pub struct World {
    pub(super) tree: BoxTree,
    /// By object id. Objects that no ray can meet (no triangles, singular transform) are not in the tree.
    pub(super) objects: Vec<PlacedObject>,
    /// The instructions that packets use.
    pub(super) arch: pulp::Arch,
    /// The camera's position in the world.
    pub origin: DVec3,
}

impl World {
    /// Builds all hierarchies, in parallel over the meshes.
    ///
    /// `transmissive` tells of each material whether light may pass through it: such surfaces are seen from behind
    /// even if they are single-sided, or a glass body would have no far side.
    #[must_use]
    pub fn new(scene: &Scene, transmissive: &[bool]) -> Self {
        Self::with_trees_of(scene, transmissive, None)
    }

    /// The same with the hierarchies of those meshes that an older world has, too.
    #[must_use]
    pub fn with_trees_of(scene: &Scene, transmissive: &[bool], older: Option<&Self>) -> Self {
        let origin = scene.camera().position;
        let mut known: Vec<(&Arc<Mesh>, &Arc<MeshTree>)> =
            older.iter().flat_map(|older| &older.objects).map(|object| (&object.mesh, &object.tree)).collect();
        known.sort_by_key(|(_, tree)| Arc::as_ptr(tree));
        known.dedup_by_key(|(_, tree)| Arc::as_ptr(tree));
        let tree_of = |mesh: &Arc<Mesh>| {
            let same = |known: &Arc<Mesh>| Arc::ptr_eq(known, mesh) || **known == **mesh;
            let known = known.iter().find(|(known, _)| same(known));
            known.map_or_else(|| Arc::new(MeshTree::new(mesh)), |(_, tree)| Arc::clone(tree))
        };
        let trees: Vec<Arc<MeshTree>> = scene.meshes().par_iter().map(tree_of).collect();
        let objects: Vec<PlacedObject> = scene
            .objects()
            .iter()
            .map(|object| {
                let linear = object.world_from_object.matrix3;
                let inverse = linear.inverse();
                PlacedObject {
                    mesh: Arc::clone(&scene.meshes()[object.mesh.index()]),
                    materials: object.materials.clone(),
                    world_from_object: linear.as_mat3(),
                    translation: (object.world_from_object.translation - origin).as_vec3(),
                    object_from_world: inverse.as_mat3(),
                    is_only_moved: inverse.as_mat3() == Mat3::IDENTITY,
                    normal_from_object: inverse.transpose().as_mat3(),
                    visible_to: object.visible_to,
                    priorities: object
                        .materials
                        .iter()
                        .map(|id| object.priority.or(scene.materials()[id.index()].priority).unwrap_or(0))
                        .collect(),
                    tree: Arc::clone(&trees[object.mesh.index()]),
                    single_sided: object
                        .materials
                        .iter()
                        .map(|id| !scene.materials()[id.index()].double_sided && !transmissive[id.index()])
                        .collect(),
                }
            })
            .collect();
        let (ids, boxes): (Vec<u32>, Vec<Aabb>) = objects
            .iter()
            .enumerate()
            .filter(|(_, object)| object.object_from_world.is_finite() && object.world_from_object.is_finite())
            .filter_map(|(id, object)| Some((id as u32, world_box(object)?)))
            .unzip();
        let mut tree = BoxTree::new(&boxes, 2);
        for place in &mut tree.order {
            *place = ids[*place as usize];
        }
        Self { tree, objects, arch: pulp::Arch::new(), origin }
    }

    /// Memory that the hierarchies take, with their copies of the triangles; meshes used more than once count once.
    #[must_use]
    pub fn tree_bytes(&self) -> usize {
        let mut trees: Vec<&Arc<MeshTree>> = self.objects.iter().map(|object| &object.tree).collect();
        trees.sort_by_key(|tree| Arc::as_ptr(tree));
        trees.dedup_by(|a, b| Arc::ptr_eq(a, b));
        self.tree.bytes() + trees.iter().map(|tree| tree.bytes()).sum::<usize>()
    }

    /// An object by id.
    #[must_use]
    pub fn object(&self, id: ObjectId) -> &PlacedObject {
        &self.objects[id.index()]
    }

    /// The material at a hit.
    #[must_use]
    pub fn material(&self, hit: &Hit) -> MaterialId {
        let object = self.object(hit.object);
        object.materials[object.slot(hit.triangle)]
    }

    /// Looks for something that blocks a shadow ray within `t_max`. `opaque` tells of a material whether it surely
    /// blocks; hits on others are collected in `passed`, nearest first. Returns whether the ray is surely blocked
    /// (`passed` is then incomplete). The triangle that it `leaves` is not met.
    #[must_use]
    pub fn blocked(
        &self,
        ray: &Ray,
        t_max: f32,
        leaves: Option<Facet>,
        opaque: impl Fn(MaterialId) -> bool,
        passed: &mut Vec<Hit>,
    ) -> bool {
        passed.clear();
        let mut blocked = false;
        let accept = |hit: Hit, _: f32, _: &mut f32| {
            blocked = opaque(self.material(&hit));
            if !blocked {
                passed.push(hit);
            }
            !blocked
        };
        dispatch(self.arch, Hits::<_, false> { world: self, ray, kind: RayKinds::SHADOW, t_max, leaves, accept });
        if !blocked {
            passed.sort_by(|a, b| a.t.total_cmp(&b.t).then((a.object, a.triangle).cmp(&(b.object, b.triangle))));
        }
        blocked
    }

    /// Shows each hit to `accept`, roughly front to back, with how much farther others may be at its place; `accept` may lower
    /// `t_max` and returns whether to go on.
    #[inline]
    pub(super) fn each_hit(
        &self,
        ray: &Ray,
        kind: RayKinds,
        t_max: f32,
        accept: impl FnMut(Hit, f32, &mut f32) -> bool,
    ) {
        dispatch(self.arch, Hits::<_, true> { world: self, ray, kind, t_max, leaves: None, accept });
    }
}

/// Shows hits of a ray, nearer ones first or anyhow, but none with the triangle that it `leaves`.
struct Hits<'a, A, const NEAR_FIRST: bool> {
    world: &'a World,
    ray: &'a Ray,
    kind: RayKinds,
    t_max: f32,
    leaves: Option<Facet>,
    accept: A,
}

impl<A: FnMut(Hit, f32, &mut f32) -> bool, const NEAR_FIRST: bool> Task for Hits<'_, A, NEAR_FIRST> {
    type Output = ();

    #[inline(always)]
    fn run<E: Eights>(self, eights: E) {
        let mut t_max = self.t_max;
        self.world.tree.traverse(eights, self.ray, &mut t_max, self);
    }
}

impl<A: FnMut(Hit, f32, &mut f32) -> bool, const NEAR_FIRST: bool> Visitor for Hits<'_, A, NEAR_FIRST> {
    const NEAR_FIRST: bool = NEAR_FIRST;

    #[inline(always)]
    fn leaf<E: Eights>(&mut self, eights: E, leaf: Leaf<'_>, t_max: &mut f32) -> bool {
        let Self { world, ray, kind, leaves, accept, .. } = self;
        let culls = *kind != RayKinds::SHADOW;
        for id in &world.tree.order[leaf.range()] {
            let object = &world.objects[*id as usize];
            if !object.visible_to.contains(*kind) {
                continue;
            }
            let mut go_on = true;
            let left = leaves.filter(|(object, _)| object.0 == *id).map_or(NO_TRIANGLE, |(_, triangle)| triangle);
            let placed = object.to_object(ray);
            object.tree.intersect_with::<_, NEAR_FIRST>(eights, (&placed, left), t_max, |triangle, hit, t_max| {
                if culls && !hit.front && object.single_sided[object.slot(triangle)] {
                    return true;
                }
                let slack = hit.slack;
                let hit = Hit {
                    t: hit.t.max(leaf.near),
                    object: ObjectId(*id),
                    triangle,
                    barycentric: [hit.u, hit.v],
                    front: hit.front,
                    crowded: false,
                };
                go_on = accept(hit, slack, t_max);
                go_on
            });
            if !go_on {
                return false;
            }
        }
        true
    }
}

/// The box of an object, relative to the camera, grown by the rounding of its transform.
pub(super) fn world_box(object: &PlacedObject) -> Option<Aabb> {
    let (low, high) = object.tree.bounds()?;
    let center = (low + high) * 0.5;
    let half = (high - low) * 0.5;
    let m = object.world_from_object;
    let place = m * center + object.translation;
    let extent = Mat3::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs()) * half;
    // A dozen roundings of values no larger than these.
    let slack = (place.abs() + extent + object.translation.abs() + (m * center).abs()) * (16.0 * f32::EPSILON);
    let extent = extent + slack + Vec3::splat(f32::MIN_POSITIVE);
    let bounds = Aabb::new(Vec3A::from(place - extent), Vec3A::from(place + extent));
    (bounds.min.is_finite() && bounds.max.is_finite()).then_some(bounds)
}
