//! Batches: the inputs and outputs of many hits of one material, as columns.

use std::sync::Arc;

use super::names::PathKind;
use crate::math::{Vec2, Vec3, Vec4};
use crate::scene::attributes::AttributeSet;

/// What one light gives one hit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LightSample {
    /// Unit vector towards the light.
    pub direction: Vec3,
    /// Irradiance on a surface that faces it, without shadows, linear RGB.
    pub radiance: Vec3,
    /// What of it arrives: 0 in shadow, 1 if nothing is in between, between where see-through things are.
    pub visibility: f32,
}

/// Inputs of a batch. Only the columns that the material's shader reads are filled (the others are empty); each filled
/// column has [`HitBatch::len`] rows. Units and spaces are documented at [`super::InputSet`].
#[derive(Clone, Debug, Default)]
#[allow(missing_docs, reason = "each column is documented under its name at InputSet")]
pub struct HitBatch {
    pub len: usize,
    pub position: Vec<Vec3>,
    pub normal: Vec<Vec3>,
    pub geometric_normal: Vec<Vec3>,
    pub incoming: Vec<Vec3>,
    pub uv: Vec<Vec2>,
    /// uv sets 1, 2, …
    pub more_uvs: Vec<Vec<Vec2>>,
    pub tangent: Vec<Vec4>,
    pub color: Vec<Vec4>,
    pub object_id: Vec<u32>,
    pub polygon_id: Vec<u32>,
    pub barycentric: Vec<Vec3>,
    pub distance: Vec<f32>,
    pub depth: Vec<f32>,
    pub path_kind: Vec<PathKind>,
    pub front_facing: Vec<bool>,
    pub pixels_per_unit: Vec<f32>,
    pub curvature: Vec<f32>,
    pub footprint: Vec<f32>,
    pub uv_footprint: Vec<f32>,
    /// Each hit's set among `attributes`. Empty also where no hit of the material has an attribute that its shader asks
    /// for: all get the default.
    pub attribute_set: Vec<u32>,
    /// All sets of attributes of the scene; not a column, and kept when the batch is emptied.
    pub attributes: Arc<Vec<AttributeSet>>,
    /// `light_count` samples for each hit, hit by hit.
    pub lights: Vec<LightSample>,
    /// Lights in the scene.
    pub light_count: usize,
    /// Seconds; the same for all hits.
    pub time: f32,
    /// Material of all hits, from 1; also their shader id.
    pub material_id: u32,
}

impl HitBatch {
    /// Empties all columns and keeps their memory.
    pub fn clear(&mut self) {
        let Self {
            len,
            position,
            normal,
            geometric_normal,
            incoming,
            uv,
            more_uvs,
            tangent,
            color,
            object_id,
            polygon_id,
            barycentric,
            distance,
            depth,
            path_kind,
            front_facing,
            pixels_per_unit,
            curvature,
            footprint,
            uv_footprint,
            attribute_set,
            attributes: _,
            lights,
            light_count: _,
            time: _,
            material_id: _,
        } = self;
        *len = 0;
        position.clear();
        normal.clear();
        geometric_normal.clear();
        incoming.clear();
        uv.clear();
        more_uvs.iter_mut().for_each(Vec::clear);
        tangent.clear();
        color.clear();
        object_id.clear();
        polygon_id.clear();
        barycentric.clear();
        distance.clear();
        depth.clear();
        path_kind.clear();
        front_facing.clear();
        pixels_per_unit.clear();
        curvature.clear();
        footprint.clear();
        uv_footprint.clear();
        attribute_set.clear();
        lights.clear();
    }
}

/// An output column: absent if no hit of the batch has it.
///
/// A script may leave out a key at some hits and not at others; a row without the key holds the default, and for
/// `line_color`, `line_width`, `priority` and `color`, whose defaults lie outside the shader, `None`.
#[derive(Clone, Debug, Default)]
#[allow(missing_docs, reason = "each column is documented under its name at OutputSet")]
pub struct OutputBatch {
    pub len: usize,
    pub base_color: Vec<Vec3>,
    pub metallic: Vec<f32>,
    pub roughness: Vec<f32>,
    pub specular: Vec<f32>,
    pub ior: Vec<f32>,
    pub transmission: Vec<f32>,
    pub opacity: Vec<f32>,
    pub emission: Vec<Vec3>,
    pub normal: Vec<Option<Vec3>>,
    pub occlusion: Vec<f32>,
    pub feature: Vec<Vec3>,
    pub line_color: Vec<Option<Vec3>>,
    pub line_width: Vec<Option<f32>>,
    pub line_opacity: Vec<f32>,
    pub priority: Vec<Option<i32>>,
    pub color: Vec<Option<Vec3>>,
    /// The plan's `aov_` names in order; a key that is left out is 0.
    pub aovs: Vec<Vec<Vec3>>,
}
