//! Reading the primitives of glTF meshes: checked attributes and triangles, nothing computed yet.

use gltf::json;
use gltf::json::accessor::{ComponentType, Type};
use gltf::json::mesh::{Mode, Semantic};
use gltf::json::validation::Checked;

use super::accessor::{ANY_NUMBER, UNSIGNED, Wanted};
use super::document::Document;
use super::report::Report;
use crate::math::{Vec2, Vec3, Vec4};

/// More uv sets or joint sets than this are not read.
const MAX_SETS: u32 = 8;

/// A primitive as the file has it. Attributes are empty or as long as `positions`.
#[derive(Clone, Debug, Default)]
pub(super) struct Primitive {
    /// Its place in the JSON, for messages.
    pub place: String,
    /// Index of its glTF material.
    pub material: Option<usize>,
    pub positions: Vec<Vec3>,
    /// Not yet of unit length.
    pub normals: Vec<Vec3>,
    pub tangents: Vec<Vec4>,
    pub uvs: Vec<Vec<Vec2>>,
    pub colors: Vec<Vec4>,
    /// All indices are below the number of positions, and the three differ.
    pub triangles: Vec<[u32; 3]>,
    pub morphs: Vec<Morph>,
    /// Joints and their weights; a vertex may have several sets of four.
    pub influences: Vec<Influences>,
}

/// Displacements of one morph target.
#[derive(Clone, Debug, Default)]
pub(super) struct Morph {
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    pub tangents: Vec<Vec3>,
}

/// Four joints for each vertex.
#[derive(Clone, Debug)]
pub(super) struct Influences {
    pub joints: Vec<[u32; 4]>,
    pub weights: Vec<[f32; 4]>,
}

/// What kinds of primitives were passed over.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Skipped {
    pub points: usize,
    pub lines: usize,
}

/// Reads the primitives of a mesh that are made of triangles. Faults are reported; what is left is sound.
pub(super) fn read(document: &Document, mesh: usize, skipped: &mut Skipped, report: &mut Report) -> Vec<Primitive> {
    let primitives = document.root.meshes[mesh].primitives.iter().enumerate();
    primitives
        .filter_map(|(index, primitive)| {
            let place = format!("meshes[{mesh}].primitives[{index}]");
            match primitive.mode {
                Checked::Valid(Mode::Points) => skipped.points += 1,
                Checked::Valid(Mode::Lines | Mode::LineLoop | Mode::LineStrip) => skipped.lines += 1,
                Checked::Valid(mode) => return Reader { document, primitive, place }.read(mode, report),
                Checked::Invalid => report.error(place, "its mode is not one that glTF knows"),
            }
            None
        })
        .collect()
}

struct Reader<'a> {
    document: &'a Document,
    primitive: &'a json::mesh::Primitive,
    place: String,
}

impl Reader<'_> {
    fn read(self, mode: Mode, report: &mut Report) -> Option<Primitive> {
        let vector = Wanted { types: &[Type::Vec3], components: ANY_NUMBER };
        if !self.primitive.attributes.contains_key(&Checked::Valid(Semantic::Positions)) {
            return report.fail(&self.place, "it has no POSITION");
        }
        let positions: Vec<Vec3> = self.attribute::<3>(&Semantic::Positions, vector, None, report)?.map(Vec3::from);
        let count = positions.len();
        let triangles = self.triangles(mode, count, report)?;
        let normals = self.attribute::<3>(&Semantic::Normals, vector, Some(count), report)?.map(Vec3::from);
        let four = Wanted { types: &[Type::Vec4], components: ANY_NUMBER };
        let mut tangents = self.attribute::<4>(&Semantic::Tangents, four, Some(count), report)?.map(Vec4::from);
        if normals.is_empty() {
            tangents.clear(); // The specification says so (section 3.7.2.1): they belong to normals that are not there.
        }
        let colors = Wanted { types: &[Type::Vec3, Type::Vec4], components: ANY_NUMBER };
        let colors = self.attribute::<4>(&Semantic::Colors(0), colors, Some(count), report)?.map(Vec4::from);
        let mut read = Primitive {
            material: self.primitive.material.map(|material| material.value()),
            uvs: self.uvs(count, report)?,
            morphs: self.morphs(count, report)?,
            influences: self.influences(count, report)?,
            place: self.place,
            positions,
            normals,
            tangents,
            colors,
            triangles,
        };
        read.repair(report);
        Some(read)
    }

    /// An attribute, or nothing if the primitive lacks it. `None` after a fault.
    fn attribute<const N: usize>(
        &self,
        semantic: &Semantic,
        wanted: Wanted,
        count: Option<usize>,
        report: &mut Report,
    ) -> Option<Values<N>> {
        let Some(accessor) = self.primitive.attributes.get(&Checked::Valid(semantic.clone())) else {
            return Some(Values(Vec::new()));
        };
        let place = format!("{}.attributes.{}", self.place, semantic.to_string());
        let values = self.document.floats::<N>(accessor.value(), wanted, &place, report)?;
        self.check_count(values.len(), count, &place, report)?;
        Some(Values(values))
    }

    fn check_count(&self, found: usize, count: Option<usize>, place: &str, report: &mut Report) -> Option<()> {
        match count {
            Some(count) if count != found => {
                report.fail(place, format!("there are {count} vertices, but {found} values here"))
            }
            _ => Some(()),
        }
    }

    /// The numbers of the sets that the primitive has of an attribute, below the limit.
    fn sets(&self, number: impl Fn(&Semantic) -> Option<u32>, report: &mut Report) -> Vec<u32> {
        let mut sets = Vec::new();
        for semantic in self.primitive.attributes.keys() {
            let Checked::Valid(semantic) = semantic else { continue };
            match number(semantic) {
                Some(set) if set < MAX_SETS => sets.push(set),
                Some(_) => report.warning(
                    format!("{}.attributes.{}", self.place, semantic.to_string()),
                    format!("only the first {MAX_SETS} sets are read"),
                ),
                None => {}
            }
        }
        sets
    }

    fn uvs(&self, count: usize, report: &mut Report) -> Option<Vec<Vec<Vec2>>> {
        let wanted = Wanted { types: &[Type::Vec2], components: ANY_NUMBER };
        let sets =
            self.sets(|semantic| if let Semantic::TexCoords(set) = semantic { Some(*set) } else { None }, report);
        let length = sets.iter().max().map_or(0, |last| *last as usize + 1);
        let mut uvs = vec![vec![Vec2::ZERO; count]; length];
        for set in sets {
            uvs[set as usize] =
                self.attribute::<2>(&Semantic::TexCoords(set), wanted, Some(count), report)?.map(Vec2::from);
        }
        Some(uvs)
    }

    fn influences(&self, count: usize, report: &mut Report) -> Option<Vec<Influences>> {
        let joints = Wanted { types: &[Type::Vec4], components: &[ComponentType::U8, ComponentType::U16] };
        let weights = Wanted { types: &[Type::Vec4], components: ANY_NUMBER };
        let mut all = Vec::new();
        for set in self.sets(|semantic| if let Semantic::Joints(set) = semantic { Some(*set) } else { None }, report) {
            let accessor = self.primitive.attributes[&Checked::Valid(Semantic::Joints(set))].value();
            let place = format!("{}.attributes.JOINTS_{set}", self.place);
            let joints = self.document.integers::<4>(accessor, joints, &place, report)?;
            self.check_count(joints.len(), Some(count), &place, report)?;
            let weights = self.attribute::<4>(&Semantic::Weights(set), weights, Some(count), report)?.0;
            if weights.is_empty() && count > 0 {
                return report.fail(place, format!("there is no WEIGHTS_{set} with it"));
            }
            all.push(Influences { joints, weights });
        }
        Some(all)
    }

    fn morphs(&self, count: usize, report: &mut Report) -> Option<Vec<Morph>> {
        let wanted = Wanted { types: &[Type::Vec3], components: ANY_NUMBER };
        let targets = self.primitive.targets.iter().flatten().enumerate();
        targets
            .map(|(index, target)| {
                let mut part = |name: &str, accessor: Option<json::Index<json::Accessor>>| {
                    let Some(accessor) = accessor else { return Some(Vec::new()) };
                    let place = format!("{}.targets[{index}].{name}", self.place);
                    let values = self.document.floats::<3>(accessor.value(), wanted, &place, report)?;
                    self.check_count(values.len(), Some(count), &place, report)?;
                    Some(Values(values).map(Vec3::from))
                };
                Some(Morph {
                    positions: part("POSITION", target.positions)?,
                    normals: part("NORMAL", target.normals)?,
                    tangents: part("TANGENT", target.tangents)?,
                })
            })
            .collect()
    }

    fn triangles(&self, mode: Mode, vertices: usize, report: &mut Report) -> Option<Vec<[u32; 3]>> {
        let Ok(vertex_count) = u32::try_from(vertices) else {
            return report.fail(&self.place, "more than 4294967295 vertices");
        };
        let corners: Vec<[u32; 1]> = match self.primitive.indices {
            None => (0..vertex_count).map(|vertex| [vertex]).collect(),
            Some(accessor) => {
                let wanted = Wanted { types: &[Type::Scalar], components: UNSIGNED };
                let place = format!("{}.indices", self.place);
                let corners = self.document.integers::<1>(accessor.value(), wanted, &place, report)?;
                if let Some(at) = corners.iter().position(|[vertex]| *vertex >= vertex_count) {
                    let [vertex] = corners[at];
                    return report.fail(place, format!("index {vertex} at {at} is beyond the {vertices} vertices"));
                }
                corners
            }
        };
        let corner = |i: usize| corners[i][0];
        let whole = corners.len().saturating_sub(2);
        let mut triangles: Vec<[u32; 3]> = match mode {
            Mode::TriangleStrip => {
                // Every second triangle of a strip turns the other way (specification, section 3.7.2.1).
                (0..whole).map(|i| [corner(i), corner(i + 1 + i % 2), corner(i + 2 - i % 2)]).collect()
            }
            Mode::TriangleFan => (0..whole).map(|i| [corner(i + 1), corner(i + 2), corner(0)]).collect(),
            _ => {
                if !corners.len().is_multiple_of(3) {
                    report.warning(&self.place, format!("{} corners do not make whole triangles", corners.len()));
                }
                corners.chunks_exact(3).map(|c| [c[0][0], c[1][0], c[2][0]]).collect()
            }
        };
        // Strips are joined by triangles with a repeated corner; they cover nothing.
        triangles.retain(|[a, b, c]| a != b && b != c && c != a);
        Some(triangles)
    }
}

/// Values of an accessor on their way to vectors.
struct Values<const N: usize>(Vec<[f32; N]>);

impl<const N: usize> Values<N> {
    fn map<T>(self, vector: impl Fn([f32; N]) -> T) -> Vec<T> {
        self.0.into_iter().map(vector).collect()
    }
}

impl Primitive {
    /// Replaces numbers that are not finite by neutral ones, and says so. Positions are left to the builder of the mesh.
    fn repair(&mut self, report: &mut Report) {
        fn replace<T: Copy>(values: &mut [T], is_finite: impl Fn(&T) -> bool, neutral: T) -> usize {
            let mut count = 0;
            for value in values.iter_mut().filter(|value| !is_finite(value)) {
                *value = neutral;
                count += 1;
            }
            count
        }
        let mut counts = vec![
            ("COLOR_0", replace(&mut self.colors, |color| color.is_finite(), Vec4::ONE)),
            ("NORMAL", replace(&mut self.normals, |normal| normal.is_finite(), Vec3::ZERO)),
            ("TANGENT", replace(&mut self.tangents, |tangent| tangent.is_finite(), Vec4::ZERO)),
        ];
        counts.extend(self.uvs.iter_mut().map(|set| ("TEXCOORD", replace(set, |uv| uv.is_finite(), Vec2::ZERO))));
        for set in &mut self.influences {
            let usable = |weights: &[f32; 4]| weights.iter().all(|weight| weight.is_finite() && *weight >= 0.0);
            counts.push(("WEIGHTS", replace(&mut set.weights, usable, [0.0; 4])));
        }
        for morph in &mut self.morphs {
            for part in [&mut morph.positions, &mut morph.normals, &mut morph.tangents] {
                counts.push(("targets", replace(part, |offset| offset.is_finite(), Vec3::ZERO)));
            }
        }
        for (name, count) in counts.into_iter().filter(|(_, count)| *count > 0) {
            report.warning(
                format!("{}.{name}", self.place),
                format!("{count} values are not finite numbers; neutral ones stand in for them"),
            );
        }
    }
}
