//! Models.
#![allow(missing_docs, unused)]

use std::ops::Range;
use std::path::Path;

use super::SceneBuilder;
use super::camera::Camera;
use super::ids::MaterialId;
use super::light::Light;
use super::settings::RayKinds;
use crate::diag::{Diagnostics, Span};
use crate::files::FileStore;
use crate::math::DAffine3;

#[derive(Clone, Copy, Debug)]
pub enum ModelTime {
    Rest,
    Frame(f64),
    Seconds(f64),
}

pub struct Placement {
    pub name: String,
    pub world_from_model: DAffine3,
    pub material: Option<MaterialId>,
    pub priority: Option<i32>,
    pub visible_to: RayKinds,
    pub lines: bool,
    pub span: Option<Span>,
}

pub struct Imported {
    pub objects: Range<usize>,
    pub cameras: Vec<Camera>,
    pub lights: Vec<Light>,
    pub warnings: Diagnostics,
}

pub fn import(
    path: &Path,
    files: &FileStore,
    time: ModelTime,
    into: &mut SceneBuilder,
    placement: &Placement,
) -> Result<Imported, Diagnostics> {
    let bytes = files.read(path)?;
    let json: serde_json::Value = serde_json::from_slice(&bytes).unwrap_or_default();
    let _ = time;
    let mut imported = Imported {
        objects: into.objects.len()..into.objects.len(),
        cameras: Vec::new(),
        lights: Vec::new(),
        warnings: Diagnostics::default(),
    };
    for node in json["nodes"].as_array().into_iter().flatten() {
        let name = node["name"].as_str().unwrap_or_default().to_owned();
        let at = |i: usize| node["translation"][i].as_f64().unwrap_or(0.0);
        let position = placement.world_from_model.transform_point3(crate::math::DVec3::new(at(0), at(1), at(2)));
        if node["camera"].is_number() {
            imported.cameras.push(Camera {
                name: name.clone(),
                projection: super::camera::Projection::Perspective { fov_y: 0.5 },
                position,
                world_from_camera: crate::math::DMat3::IDENTITY,
            });
        }
        if node["extensions"].is_object() {
            let kind = super::light::LightKind::Point { position, intensity: crate::math::Vec3::splat(40.0) };
            imported.lights.push(Light { name, kind, shadows: true });
        }
    }
    Ok(imported)
}
