//! Picture files while watching: written on a thread of their own, so that the next edit need not wait for them.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;

use super::LivePicture;
use crate::diag::Diagnostic;
use crate::render::{PictureFile, write_picture};
use crate::scene::settings::RenderSettings;

/// Writes pictures; of those that come while one is being written, only the last of each file.
pub(super) struct Outputs {
    jobs: Option<Sender<Job>>,
    thread: Option<JoinHandle<()>>,
}

struct Job {
    file: PictureFile,
    settings: RenderSettings,
    picture: Arc<LivePicture>,
}

impl Outputs {
    /// `told` hears of each file that was written, or why it was not, from another thread.
    pub fn start(told: impl Fn(Result<PathBuf, Diagnostic>) + Send + 'static) -> Result<Self, Diagnostic> {
        let (jobs, receiver) = channel();
        let thread = std::thread::Builder::new()
            .name("outputs".into())
            .spawn(move || work(&receiver, told))
            .map_err(|error| Diagnostic::error(format!("cannot start a thread: {error}")))?;
        Ok(Self { jobs: Some(jobs), thread: Some(thread) })
    }

    pub fn write(&self, file: PictureFile, settings: RenderSettings, picture: Arc<LivePicture>) {
        if let Some(jobs) = &self.jobs {
            // The thread ends after its sender only.
            let _ = jobs.send(Job { file, settings, picture });
        }
    }

    /// Writes what is still to be written, and ends.
    pub fn close(mut self) {
        self.jobs = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn work(jobs: &Receiver<Job>, told: impl Fn(Result<PathBuf, Diagnostic>)) {
    while let Ok(job) = jobs.recv() {
        let mut newest = BTreeMap::from([(job.file.path.clone(), job)]);
        newest.extend(jobs.try_iter().map(|job| (job.file.path.clone(), job)));
        for (path, Job { file, settings, picture }) in newest {
            let written = write_picture(&file, &settings, &picture.layers, &picture.channels);
            told(written.map(|()| path));
        }
    }
}
