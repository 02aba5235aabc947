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
    let _ = (path, files, time, placement);
    files.read(path)?;
    let n = into.objects.len();
    Ok(Imported { objects: n..n, cameras: Vec::new(), lights: Vec::new(), warnings: Diagnostics::default() })
}
