//! Sessions: what an edit does not touch is kept, and nobody can tell from the picture.

mod counters;
mod edits;

use std::path::PathBuf;

use tusche::files::FileStore;
use tusche::film::Layer;
use tusche::live::Setup;
use tusche::scene::{Scene, file};
use tusche::shade::{Host, Shaders};

use crate::common::root;

/// Texts of a scene file and of scripts beside it.
pub struct Sources {
    pub scene: String,
    pub scripts: Vec<(String, String)>,
}

impl Sources {
    /// The scene, read afresh as if all files had just been saved.
    pub fn scene(&self) -> Scene {
        let folder: PathBuf = root().join("scenes");
        let path = folder.join("session.toml");
        let files = FileStore::new().with_file(&path, self.scene.as_str());
        let files =
            self.scripts.iter().fold(files, |files, (name, text)| files.with_file(folder.join(name), text.as_str()));
        file::load(&path, &files, &[], &file::LoadOptions::default())
            .and_then(|(builder, _)| builder.build())
            .unwrap_or_else(|faults| panic!("the scene is at fault:\n{faults}\n\n{}", self.scene))
    }

    /// What a session is to show.
    pub fn setup(&self, layers: &[Layer]) -> Setup {
        let scene = self.scene();
        let (shaders, _) = Shaders::compile(&scene, &Host::new()).unwrap_or_else(|faults| panic!("{faults}"));
        Setup { scene, shaders, layers: layers.to_vec() }
    }
}
