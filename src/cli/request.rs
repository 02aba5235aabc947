//! Arguments as meant: the scene, its shaders and its plan.

use std::path::{Path, PathBuf};

use super::args::{LineMode, SceneArguments, Size};
use super::{Failure, terminal};
use crate::clock::CpuClock;
use crate::diag::{Diagnostic, Diagnostics};
use crate::files::FileStore;
use crate::plan::Plan;
use crate::render::request::layers_for;
use crate::render::{LoadedScene, PictureFile, SceneRequest, layers_of};
use crate::scene::Scene;
use crate::scene::file::{LoadOptions, Override};
use crate::shade::Shaders;

/// The picture that the arguments ask for, ready to be rendered.
pub(super) struct Request {
    pub scene: Scene,
    pub shaders: Shaders,
    pub plan: Plan,
    /// The pictures to write.
    pub files: Vec<PictureFile>,
    /// Seconds spent on getting here.
    pub load_seconds: f64,
}

impl Request {
    /// Loads, resolves and compiles everything; warnings are printed unless `--quiet`.
    pub fn new(arguments: &SceneArguments, frame: Option<f64>, outputs: &[PathBuf]) -> Result<Self, Failure> {
        let clock = CpuClock::process();
        let request = scene_request(arguments, frame)?;
        let LoadedScene { scene, shaders, warnings } = request.load(&FileStore::new())?;
        if !arguments.quiet {
            terminal::say(&warnings);
        }
        let files = outputs
            .iter()
            .map(|path| {
                Ok(PictureFile { path: path.clone(), layers: layers_for(path, &arguments.layer, &scene, &shaders)? })
            })
            .collect::<Result<Vec<_>, Diagnostic>>()?;
        let plan = Plan::new(&scene, &shaders, &layers_of(&files));
        Ok(Self { scene, shaders, plan, files, load_seconds: clock.seconds() })
    }
}

/// Where to write: what `-o` says, else the scene's name with `.png` in the current folder.
pub(super) fn output_paths(arguments: &SceneArguments) -> Result<Vec<PathBuf>, Failure> {
    if arguments.output.is_empty() {
        let stem = arguments.scene.file_stem().unwrap_or("picture".as_ref());
        return Ok(vec![Path::new(stem).with_extension("png")]);
    }
    check_outputs(arguments)?;
    Ok(arguments.output.clone())
}

/// Whether every output is named once.
pub(super) fn check_outputs(arguments: &SceneArguments) -> Result<(), Failure> {
    let places: Vec<PathBuf> = arguments.output.iter().map(|path| place(path)).collect();
    for (index, path) in arguments.output.iter().enumerate() {
        if places[..index].contains(&places[index]) {
            return Err(Failure::Usage(format!("`{}` is given twice as output", path.display())));
        }
    }
    Ok(())
}

/// The one spelling of a path by which two names of the same file are known.
fn place(path: &Path) -> PathBuf {
    let named = || {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        Some(folder.canonicalize().ok()?.join(path.file_name()?))
    };
    path.canonicalize().ok().or_else(named).unwrap_or_else(|| path.to_owned())
}

/// What to load.
pub(super) fn scene_request(arguments: &SceneArguments, frame: Option<f64>) -> Result<SceneRequest, Failure> {
    // Flags that stand for values of the scene file go the same way as `--set`, so that they are checked the same way.
    let mut changes = Vec::new();
    if let Some(quality) = arguments.quality {
        // First, so that what is set by itself has the last word.
        changes.push("lines.width_compensation=true".to_owned());
        changes.push(format!("render.sampler={}", quality.sampler().name()));
        changes.push(format!("render.samples={}", quality.samples()));
    }
    changes.extend(arguments.set.iter().cloned());
    if let Some(Size([width, height])) = arguments.size {
        changes.push(format!("render.size=[{width}, {height}]"));
    }
    if let Some(samples) = arguments.samples {
        changes.push(format!("render.samples={samples}"));
    }
    if let Some(seed) = arguments.seed {
        changes.push(format!("render.seed={seed}"));
    }
    let mut faults = Diagnostics::default();
    let parsed = changes.iter().filter_map(|text| Override::parse(text).map_err(|fault| faults.extend(fault)).ok());
    let overrides: Vec<_> = parsed.collect();
    if faults.has_errors() {
        return Err(faults.into());
    }
    Ok(SceneRequest {
        path: arguments.scene.clone(),
        overrides,
        options: LoadOptions { frame, camera: arguments.camera.clone() },
        lines: arguments.lines != LineMode::Off,
        shading: arguments.shading.mode(),
    })
}
