//! Records: what the rays of a tile met, kept so that its samples can be shaded again without tracing.
//!
//! A node is known by its sample and its path. While objects, camera and sample positions stay what they are, a ray that
//! starts where it did, in the same direction, meets what it met; so a record answers for a ray only if start and
//! direction are the same bits, and what it does not know is traced. The same holds for shadow rays: what a hit sees of
//! each light is kept beside it.

use super::cone::Cone;
use super::ray_tree::{Run, TreeNode, WaveRay};
use super::world::Hit;
use crate::math::Vec3;
use crate::sample::{Node, NodePath};
use crate::scene::ids::ObjectId;

/// What the rays of a tile met.
#[derive(Clone, Debug, Default)]
pub struct TileRecord {
    /// In the order of paths.
    paths: Vec<PathRecord>,
    /// Lights of the scene.
    lights: usize,
}

/// The nodes of one path, in the order of their samples.
#[derive(Clone, Debug)]
struct PathRecord {
    path: NodePath,
    /// Empty for the camera's path, where every sample has a node.
    samples: Vec<u32>,
    met: Vec<PackedHit>,
    /// Empty for the camera's path, whose rays are soon made again.
    starts: Vec<Start>,
    /// What each hit sees of each light, [`UNKNOWN`] where nobody asked; empty if nobody ever did.
    visibility: Vec<f32>,
    /// The second surfaces of lists, the third, and so on.
    behind: Vec<BehindRecord>,
}

/// The hits at one place of the lists of a path, in the order of their samples.
#[derive(Clone, Debug, Default)]
struct BehindRecord {
    samples: Vec<u32>,
    met: Vec<PackedHit>,
}

impl BehindRecord {
    fn hit(&self, sample: u32) -> Option<Hit> {
        self.met[self.samples.binary_search(&sample).ok()?].hit()
    }
}

/// A hit or a miss in 20 bytes.
#[derive(Clone, Copy, Debug)]
struct PackedHit {
    t: f32,
    barycentric: [f32; 2],
    /// 1 + object, 0 for a miss.
    object: u32,
    /// The triangle and, in the uppermost bits, [`FRONT`], [`BEHIND_INVISIBLE`] and [`CROWDED`].
    triangle: u32,
}

/// The front of the triangle was met.
const FRONT: u32 = 1 << 31;
/// The ray has passed surfaces, or seen another at the place of what it met first: shaders had a say in it.
const BEHIND_INVISIBLE: u32 = 1 << 30;
/// There are other surfaces at the place.
const CROWDED: u32 = 1 << 29;

/// No light is this visible.
pub(super) const UNKNOWN: f32 = -1.0;

/// Where a ray starts that is not the camera's, and what is known of it there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    pub origin: Vec3,
    pub direction: Vec3,
    pub cone: Cone,
    pub length_before: f32,
}

/// A node as a record holds it.
#[derive(Clone, Copy, Debug)]
pub(super) struct KnownNode<'a> {
    pub hit: Option<Hit>,
    /// `None` at the camera.
    pub start: Option<&'a Start>,
    /// For each light; may be empty.
    pub visibility: &'a [f32],
    passed_invisible: bool,
}

/// What a run's rays met, node by node, while it is being traced. Empty unless somebody wants a record.
#[derive(Debug, Default)]
pub(super) struct RunRecord {
    wanted: bool,
    lights: usize,
    /// The ray, what it met, and whether it would meet that again.
    nodes: Vec<Option<(WaveRay, Option<Hit>, bool)>>,
    visibility: Vec<f32>,
}

impl RunRecord {
    pub fn clear(&mut self, wanted: bool, lights: usize) {
        self.wanted = wanted;
        self.lights = lights;
        self.nodes.clear();
        self.visibility.clear();
    }

    /// Whether anything is noted.
    pub fn is_wanted(&self) -> bool {
        self.wanted
    }

    /// Notes what the ray of a node met. What it `met_first` it will meet again; else that depends on shaders.
    #[inline]
    pub fn note(&mut self, ray: &WaveRay, hit: Option<&Hit>, met_first: bool) {
        if self.wanted {
            let node = ray.node as usize;
            if self.nodes.len() <= node {
                self.nodes.resize(node + 1, None);
            }
            self.nodes[node] = Some((*ray, hit.copied(), met_first && ray.passed == 0));
            // What an invisible surface before it saw of the lights is another matter.
            let first = node * self.lights;
            if let Some(visibility) = self.visibility.get_mut(first..first + self.lights) {
                visibility.fill(UNKNOWN);
            }
        }
    }

    /// Notes what the hit of a node sees of a light.
    #[inline]
    pub fn note_visibility(&mut self, node: u32, light: usize, visibility: f32) {
        if self.wanted {
            let place = node as usize * self.lights + light;
            if self.visibility.len() <= place {
                self.visibility.resize((node as usize + 1) * self.lights, UNKNOWN);
            }
            self.visibility[place] = visibility;
        }
    }
}

impl TileRecord {
    pub(super) fn new(lights: usize) -> Self {
        Self { paths: Vec::new(), lights }
    }

    /// Adds the nodes of a run whose samples come after all that are there.
    pub(super) fn add(&mut self, run: &Run) {
        let record = &run.record;
        if !record.wanted {
            return;
        }
        let mut order: Vec<u32> = (0..run.nodes.len() as u32).collect();
        let key = |node: &u32| {
            let node = &run.nodes[*node as usize];
            (node.path, node.sample)
        };
        order.sort_by_key(key);
        for nodes in order.chunk_by(|a, b| key(a).0 == key(b).0) {
            let path = key(&nodes[0]).0;
            let place = self.paths.partition_point(|known| known.path < path);
            if self.paths.get(place).is_none_or(|known| known.path != path) {
                let of_path = PathRecord {
                    path,
                    samples: Vec::new(),
                    met: Vec::new(),
                    starts: Vec::new(),
                    visibility: Vec::new(),
                    behind: Vec::new(),
                };
                self.paths.insert(place, of_path);
            }
            let of_path = &mut self.paths[place];
            for &index in nodes {
                let node = &run.nodes[index as usize];
                let Some((ray, hit, again)) = record.nodes.get(index as usize).copied().flatten() else { continue };
                if path != NodePath::CAMERA {
                    let TreeNode { sample, cone, length_before, .. } = *node;
                    of_path.samples.push(sample);
                    of_path.starts.push(Start { origin: ray.origin, direction: ray.direction, cone, length_before });
                }
                let first = index as usize * self.lights;
                let known = record.visibility.get(first..first + self.lights).unwrap_or_default();
                let asked = known.iter().any(|visibility| *visibility != UNKNOWN);
                if asked || !of_path.visibility.is_empty() {
                    of_path.visibility.resize(of_path.met.len() * self.lights, UNKNOWN);
                    of_path.visibility.extend_from_slice(known);
                    of_path.visibility.resize((of_path.met.len() + 1) * self.lights, UNKNOWN);
                }
                of_path.met.push(PackedHit::new(hit.as_ref(), !again));
            }
        }
        let sample_of = |(node, place, ..): &(u32, u32, Hit, Node)| (*place, run.nodes[*node as usize].sample);
        let mut order: Vec<_> = run.surfaces.iter().collect();
        order.sort_by_key(|surface| sample_of(surface));
        for surface @ (node, _, hit, _) in order {
            let path = run.nodes[*node as usize].path;
            let Ok(of_path) = self.paths.binary_search_by_key(&path, |known| known.path) else { continue };
            let (place, sample) = sample_of(surface);
            let (behind, place) = (&mut self.paths[of_path].behind, place as usize - 1);
            if behind.len() <= place {
                behind.resize_with(place + 1, BehindRecord::default);
            }
            behind[place].samples.push(sample);
            behind[place].met.push(PackedHit::new(Some(hit), false));
        }
    }

    /// In no more memory than it needs.
    pub(super) fn finish(mut self) -> Self {
        for of_path in &mut self.paths {
            of_path.samples.shrink_to_fit();
            of_path.met.shrink_to_fit();
            of_path.starts.shrink_to_fit();
            of_path.visibility.shrink_to_fit();
            for behind in &mut of_path.behind {
                behind.samples.shrink_to_fit();
                behind.met.shrink_to_fit();
            }
        }
        self
    }

    /// Forgets what hits see of lights.
    pub fn forget_visibility(&mut self) {
        for of_path in &mut self.paths {
            of_path.visibility = Vec::new();
        }
    }

    /// Forgets which of several surfaces at one place was met first.
    pub fn forget_ties(&mut self) {
        for of_path in &mut self.paths {
            // Of lists, any place may have changed.
            let all = !of_path.behind.is_empty();
            for met in of_path.met.iter_mut().filter(|met| all || met.triangle & CROWDED != 0) {
                met.triangle |= BEHIND_INVISIBLE;
            }
        }
    }

    /// Bytes of heap memory.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let of_path = |path: &PathRecord| {
            size_of_val(&path.samples[..])
                + size_of_val(&path.met[..])
                + size_of_val(&path.starts[..])
                + size_of_val(&path.visibility[..])
                + path
                    .behind
                    .iter()
                    .map(|behind| size_of_val(&behind.samples[..]) + size_of_val(&behind.met[..]))
                    .sum::<usize>()
                + size_of::<PathRecord>()
        };
        self.paths.iter().map(of_path).sum()
    }

    /// What is known of the node at a path of a sample.
    #[inline]
    pub(super) fn node(&self, path: NodePath, sample: u32) -> Option<KnownNode<'_>> {
        let of_path = &self.paths[self.paths.binary_search_by_key(&path, |known| known.path).ok()?];
        let row = match path {
            NodePath::CAMERA => sample as usize,
            _ => of_path.samples.binary_search(&sample).ok()?,
        };
        let met = of_path.met.get(row)?;
        Some(KnownNode {
            hit: met.hit(),
            start: of_path.starts.get(row),
            visibility: of_path.visibility.get(row * self.lights..(row + 1) * self.lights).unwrap_or_default(),
            passed_invisible: met.triangle & BEHIND_INVISIBLE != 0,
        })
    }

    /// The surfaces behind the first in the list of a node.
    pub(super) fn behind(&self, path: NodePath, sample: u32) -> impl Iterator<Item = Hit> + '_ {
        let of_path =
            self.paths.binary_search_by_key(&path, |known| known.path).ok().map(|at| &self.paths[at].behind[..]);
        of_path.unwrap_or_default().iter().map_while(move |behind| behind.hit(sample))
    }

    /// One of them, by its place, counted from 1.
    #[inline]
    pub(super) fn surface(&self, path: NodePath, place: usize, sample: u32) -> Option<Hit> {
        let of_path = self.paths.binary_search_by_key(&path, |known| known.path).ok()?;
        self.paths[of_path].behind.get(place.checked_sub(1)?)?.hit(sample)
    }

    /// What a ray to a node meets, if that is known: `Some(None)` is nothing.
    #[inline]
    pub(super) fn met(&self, node: &TreeNode, ray: &WaveRay) -> Option<Option<Hit>> {
        let known = self.node(node.path, node.sample)?;
        let usable = ray.passed == 0 && !known.passed_invisible && known.starts_as(ray);
        usable.then_some(known.hit)
    }

    /// What the hit of a node sees of each light, as far as it is known: [`UNKNOWN`] where it is not. May be empty.
    #[inline]
    pub(super) fn visibility(&self, node: &TreeNode, ray: &WaveRay, hit: &Hit) -> &[f32] {
        match self.node(node.path, node.sample) {
            Some(known) if known.hit == Some(*hit) && known.starts_as(ray) => known.visibility,
            _ => &[],
        }
    }
}

impl KnownNode<'_> {
    /// Whether a ray is the one that is known.
    #[inline]
    fn starts_as(&self, ray: &WaveRay) -> bool {
        let same = |a: Vec3, b: Vec3| a.to_array().map(f32::to_bits) == b.to_array().map(f32::to_bits);
        self.start.is_none_or(|start| same(start.origin, ray.origin) && same(start.direction, ray.direction))
    }
}

impl PackedHit {
    fn new(hit: Option<&Hit>, passed_invisible: bool) -> Self {
        let flag = |set: bool, bit: u32| if set { bit } else { 0 };
        let passed = flag(passed_invisible, BEHIND_INVISIBLE);
        match hit {
            None => Self { t: 0.0, barycentric: [0.0; 2], object: 0, triangle: passed },
            // A triangle whose number does not fit is taken for one that is not known.
            Some(hit) if hit.triangle >= CROWDED => {
                Self { t: 0.0, barycentric: [0.0; 2], object: 0, triangle: BEHIND_INVISIBLE }
            }
            Some(hit) => Self {
                t: hit.t,
                barycentric: hit.barycentric,
                object: hit.object.0 + 1,
                triangle: hit.triangle | flag(hit.front, FRONT) | flag(hit.crowded, CROWDED) | passed,
            },
        }
    }

    fn hit(&self) -> Option<Hit> {
        Some(Hit {
            t: self.t,
            object: ObjectId(self.object.checked_sub(1)?),
            triangle: self.triangle & !(FRONT | BEHIND_INVISIBLE | CROWDED),
            barycentric: self.barycentric,
            front: self.triangle & FRONT != 0,
            crowded: self.triangle & CROWDED != 0,
        })
    }
}
