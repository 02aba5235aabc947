//! What to render, as asked for: a scene file with changes, and how to read it. Loading gives a scene with its shaders.

use std::path::{Path, PathBuf};

use crate::diag::{Diagnostic, Diagnostics};
use crate::files::FileStore;
use crate::film::Layer;
use crate::scene::file::{self, LoadOptions, Override};
use crate::scene::{Scene, SceneBuilder};
use crate::shade::{Host, OutputSet, Shaders, ShadingMode};

/// A scene to load.
#[derive(Clone, Debug)]
pub struct SceneRequest {
    /// A scene file or a model.
    pub path: PathBuf,
    /// Values in place of those of the scene file; later ones hide earlier ones.
    pub overrides: Vec<Override>,
    /// The frame and the camera.
    pub options: LoadOptions,
    /// Whether lines are drawn.
    pub lines: bool,
    /// How shaders are run.
    pub shading: ShadingMode,
}

/// A scene that is ready to be rendered.
#[derive(Debug)]
pub struct LoadedScene {
    /// The scene.
    pub scene: Scene,
    /// Its shaders.
    pub shaders: Shaders,
    /// What is questionable about them.
    pub warnings: Diagnostics,
}

impl SceneRequest {
    /// Reads the scene and compiles its shaders.
    ///
    /// # Errors
    /// Everything that is wrong with the scene, its files, the overrides and the scripts.
    pub fn load(&self, files: &FileStore) -> Result<LoadedScene, Diagnostics> {
        let (builder, mut warnings) = self.read(files)?;
        let scene = builder.build()?;
        let (shaders, more) = Shaders::compile_for(&scene, &Host::new(), self.shading)?;
        warnings.extend(more);
        Ok(LoadedScene { scene, shaders, warnings })
    }

    /// Reads the scene alone.
    ///
    /// # Errors
    /// As [`file::load`].
    pub fn read(&self, files: &FileStore) -> Result<(SceneBuilder, Diagnostics), Diagnostics> {
        let (mut builder, warnings) = file::load(&self.path, files, &self.overrides, &self.options)?;
        builder.lines.enabled &= self.lines;
        Ok((builder, warnings))
    }
}

/// The layers of a picture file: those asked for, or a PNG's `rgba` and everything but parts of others (`line.TYPE`,
/// `line.PATH`, `below`) for an EXR.
///
/// # Errors
/// If there is no layer of a name.
pub fn layers_for(path: &Path, asked: &[String], scene: &Scene, shaders: &Shaders) -> Result<Vec<Layer>, Diagnostic> {
    let is_exr = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("exr"));
    if !asked.is_empty() {
        let shown = if is_exr { asked } else { &asked[..1] };
        return shown.iter().map(|name| Layer::parse(name, shaders.aovs())).collect();
    }
    Ok(if is_exr { whole_layers(scene, shaders) } else { vec![Layer::Rgba] })
}

/// All layers that have something to show, except parts of others (`line.TYPE`, `line.PATH`, `below`).
#[must_use]
pub fn whole_layers(scene: &Scene, shaders: &Shaders) -> Vec<Layer> {
    let mut layers = vec![
        Layer::Rgba,
        Layer::Color,
        Layer::Line,
        Layer::Depth,
        Layer::Normal,
        Layer::Position,
        Layer::Uv,
        Layer::Object,
    ];
    if scene.lines().hidden.is_some() {
        layers.push(Layer::HiddenLine);
    }
    if shaders.iter().any(|shader| shader.analysis().output(OutputSet::FEATURE).may) {
        layers.push(Layer::Feature);
    }
    layers.extend(shaders.aovs().iter().enumerate().map(|(index, name)| Layer::Aov(index, name.clone())));
    layers
}
