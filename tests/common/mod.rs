//! What the tests share: rendering in memory, running the command, golden texts.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::Mutex;

use tusche::diag::Diagnostics;
use tusche::files::FileStore;
use tusche::film::{FilmTile, Layer};
use tusche::plan::Plan;
use tusche::render::{Control, RenderOptions, Report, render};
use tusche::scene::{Scene, file};
use tusche::shade::{Host, Shaders};

/// The repository's root.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// A scene from the text of a scene file that lies in the repository's `scenes` folder.
pub fn scene_from(text: &str) -> Scene {
    load(text).unwrap_or_else(|faults| panic!("the scene is at fault:\n{faults}\n\n{text}"))
}

/// A scene, or what is wrong with it.
pub fn load(text: &str) -> Result<Scene, Diagnostics> {
    let path = root().join("scenes/test.toml");
    let files = FileStore::new().with_file(&path, text);
    let (builder, _) = file::load(&path, &files, &[], &file::LoadOptions::default())?;
    builder.build()
}

/// A scene with materials: their names, and the text of their `surface(hit, p)`.
pub fn scripted_scene(text: &str, shaders: &[(&str, &str)]) -> Scene {
    let folder = root().join("scenes");
    // Without the key a scene gets lights by default.
    let dark = if text.contains("[[lights]]") { "" } else { "lights = []\n" };
    let mut text = format!("{dark}{text}");
    let mut files = FileStore::new();
    for (name, body) in shaders {
        text += &format!("\n[materials.{name}]\nshader = \"{name}.rhai\"\n");
        files = files.with_file(folder.join(format!("{name}.rhai")), format!("fn surface(hit, p) {{ {body} }}"));
    }
    let path = folder.join("light_test.toml");
    let files = files.with_file(&path, text.as_str());
    file::load(&path, &files, &[], &file::LoadOptions::default())
        .and_then(|(builder, _)| builder.build())
        .unwrap_or_else(|faults| panic!("the scene is at fault:\n{faults}\n\n{text}"))
}

/// A picture in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    pub width: usize,
    pub height: usize,
    /// Channels of the layers in order, row by row.
    pub channels: Vec<Vec<f32>>,
}

impl Picture {
    /// The mean of a channel.
    pub fn mean(&self, channel: usize) -> f64 {
        let values = &self.channels[channel];
        values.iter().map(|value| f64::from(*value)).sum::<f64>() / values.len() as f64
    }

    /// A channel at a pixel.
    pub fn at(&self, channel: usize, x: usize, y: usize) -> f32 {
        self.channels[channel][y * self.width + x]
    }

    /// The bits of all channels, for exact comparison (NaN included).
    pub fn bits(&self) -> Vec<u32> {
        self.channels.iter().flatten().map(|value| value.to_bits()).collect()
    }
}

/// Renders a scene in memory. Layers come in the order given.
pub fn render_with(scene: &Scene, layers: &[Layer], options: &RenderOptions) -> (Picture, Report) {
    let (shaders, _) = Shaders::compile(scene, &Host::new()).unwrap_or_else(|faults| panic!("{faults}"));
    let plan = Plan::new(scene, &shaders, layers);
    let [width, height] = scene.render().size.map(|n| n as usize);
    let count: usize = layers.iter().map(|layer| layer.channels().len()).sum();
    let picture = Picture { width, height, channels: vec![vec![0.0; width * height]; count] };
    let picture = Mutex::new(picture);
    let emit = |tile: &FilmTile| {
        let mut picture = picture.lock().expect("no thread panics with it");
        for (channel, values) in picture.channels.iter_mut().zip(&tile.channels) {
            for (row, line) in values.chunks_exact(tile.rect.width() as usize).enumerate() {
                let first = (tile.rect.y0 as usize + row) * width + tile.rect.x0 as usize;
                channel[first..first + line.len()].copy_from_slice(line);
            }
        }
        Ok(())
    };
    let report =
        render(scene, &shaders, &plan, options, &Control::default(), &emit).unwrap_or_else(|fault| panic!("{fault}"));
    (picture.into_inner().expect("no thread panics with it"), report)
}

/// Renders a scene file's text with default options.
pub fn render_text(text: &str, layers: &[Layer]) -> (Picture, Report) {
    render_with(&scene_from(text), layers, &RenderOptions::default())
}

/// Every scene file that ships, by name.
pub fn shipped_scenes() -> Vec<(String, PathBuf)> {
    let mut scenes: Vec<_> = std::fs::read_dir(root().join("scenes"))
        .expect("the scenes folder is there")
        .map(|entry| entry.expect("it can be listed").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .map(|path| (path.file_stem().unwrap_or_default().to_string_lossy().into_owned(), path))
        .collect();
    scenes.sort();
    scenes
}

/// A folder of its own for a test of the command.
pub struct Workplace {
    pub folder: tempfile::TempDir,
}

impl Workplace {
    pub fn new() -> Self {
        Self { folder: tempfile::tempdir().expect("a temporary folder can be made") }
    }

    /// Writes a file into the folder; returns its path.
    pub fn file(&self, name: &str, contents: impl AsRef<[u8]>) -> PathBuf {
        let path = self.folder.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap_or(&path)).expect("folders can be made");
        std::fs::write(&path, contents).expect("files can be written");
        path
    }

    /// Runs `tusche` in the folder.
    pub fn run(&self, arguments: &[&str]) -> Run {
        let mut command = Command::new(env!("CARGO_BIN_EXE_tusche"));
        command.current_dir(self.folder.path()).args(arguments).env_remove("NO_COLOR");
        let output = command.output().expect("the command can be run");
        Run { line: format!("tusche {}", arguments.join(" ")), folder: self.folder.path().to_owned(), output }
    }
}

/// A finished run of the command.
pub struct Run {
    line: String,
    folder: PathBuf,
    output: Output,
}

impl Run {
    pub fn stdout(&self) -> String {
        String::from_utf8_lossy(&self.output.stdout).into_owned()
    }

    /// Standard error, with the test's own folder taken out of paths.
    pub fn stderr(&self) -> String {
        let folder = format!("{}/", self.folder.display());
        String::from_utf8_lossy(&self.output.stderr).replace(&folder, "")
    }

    /// Checks the exit code.
    #[track_caller]
    pub fn exits(self, code: i32) -> Self {
        assert_eq!(self.output.status.code(), Some(code), "{}", self.story());
        self
    }

    /// Checks that standard error holds a text.
    #[track_caller]
    pub fn says(self, text: &str) -> Self {
        assert!(self.stderr().contains(text), "missing: {text}\n{}", self.story());
        self
    }

    /// Everything needed to understand a failure.
    fn story(&self) -> String {
        let listing: Vec<_> = std::fs::read_dir(&self.folder)
            .map(|entries| entries.flatten().map(|entry| entry.file_name()).collect())
            .unwrap_or_default();
        format!(
            "$ {}\nexit: {:?}\nfiles: {listing:?}\n--- standard output\n{}\n--- standard error\n{}",
            self.line,
            self.output.status.code(),
            self.stdout(),
            self.stderr()
        )
    }
}

/// Compares a text with its golden file; with `TUSCHE_BLESS` set, writes the file and fails, so that no blessing run
/// passes unseen.
#[track_caller]
pub fn golden(path: &Path, actual: &str) {
    if std::env::var_os("TUSCHE_BLESS").is_some() {
        std::fs::write(path, actual).expect("golden files can be written");
        panic!("blessed {}: look at the change and run again without TUSCHE_BLESS", path.display());
    }
    let expected = std::fs::read_to_string(path).unwrap_or_default();
    assert_eq!(
        expected,
        actual,
        "{} differs from what is expected; if the change is meant, run again with TUSCHE_BLESS=1",
        path.display()
    );
}
