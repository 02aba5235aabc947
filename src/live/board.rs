//! The board: what pages show, always the newest state of each topic and nothing else, so that no reader, however slow,
//! makes anything pile up.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::watch;

use super::LivePicture;
use crate::film::Layer;
use crate::sample::PixelRect;

/// What a page hears about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Topic {
    /// The scene: its name, its layers, its controls, the edits.
    Scene,
    /// What is wrong and what is questionable.
    Faults,
    /// How far the next picture is.
    Progress,
    /// That there is a picture, and what it cost.
    Picture,
    /// What happened last to the scene file or a viewer, in a sentence.
    Note,
}

impl Topic {
    pub const ALL: [Self; 5] = [Self::Scene, Self::Faults, Self::Progress, Self::Picture, Self::Note];

    /// Its name in the stream of events.
    pub fn name(self) -> &'static str {
        match self {
            Self::Scene => "scene",
            Self::Faults => "faults",
            Self::Progress => "progress",
            Self::Picture => "picture",
            Self::Note => "note",
        }
    }
}

/// Which version of each topic a reader has.
pub(super) type Read = [u64; Topic::ALL.len()];

pub(super) struct Board {
    state: Mutex<State>,
    version: watch::Sender<u64>,
}

#[derive(Default)]
struct State {
    version: u64,
    /// Of each topic the version and the text, JSON.
    topics: [(u64, Arc<str>); Topic::ALL.len()],
    picture: Option<ShownPicture>,
    /// The pictures before, newest last: what changed in each.
    history: VecDeque<Change>,
}

/// A picture with what is needed to look at it.
#[derive(Clone)]
pub(super) struct ShownPicture {
    /// Counts pictures from 1.
    pub revision: u64,
    pub picture: Arc<LivePicture>,
    /// The layer to look at.
    pub layer: Layer,
    /// Whether the background is transparent.
    pub transparent: bool,
}

struct Change {
    revision: u64,
    rect: PixelRect,
    /// Whether it has nothing in common with the picture before: another size or another layer.
    whole: bool,
}

/// How many pictures a page may be behind and still need only what changed.
const HISTORY: usize = 64;

impl Board {
    pub fn new() -> Self {
        Self { state: Mutex::default(), version: watch::Sender::new(0) }
    }

    /// Replaces what a topic says; what it says already is no news.
    pub fn post(&self, topic: Topic, text: String) {
        let mut state = self.lock();
        if *state.topics[topic as usize].1 == *text {
            return;
        }
        state.version += 1;
        state.topics[topic as usize] = (state.version, text.into());
        self.version.send_replace(state.version);
    }

    /// Shows a picture; `describe` makes its message from its revision.
    pub fn show(&self, mut shown: ShownPicture, describe: impl FnOnce(&ShownPicture) -> String) {
        let mut state = self.lock();
        let before = state.picture.as_ref();
        shown.revision = before.map_or(1, |before| before.revision + 1);
        let whole =
            before.is_none_or(|before| before.layer != shown.layer || before.picture.size != shown.picture.size);
        if state.history.len() == HISTORY {
            state.history.pop_front();
        }
        state.history.push_back(Change { revision: shown.revision, rect: shown.picture.changed, whole });
        state.version += 1;
        state.topics[Topic::Picture as usize] = (state.version, describe(&shown).into());
        state.picture = Some(shown);
        self.version.send_replace(state.version);
    }

    /// What is new to a reader, who is then up to date.
    pub fn news(&self, read: &mut Read) -> Vec<(Topic, Arc<str>)> {
        let state = self.lock();
        let mut news = Vec::new();
        for topic in Topic::ALL {
            let (version, text) = &state.topics[topic as usize];
            if *version > read[topic as usize] {
                read[topic as usize] = *version;
                news.push((topic, Arc::clone(text)));
            }
        }
        news
    }

    /// Wakes up whenever there is news.
    pub fn listen(&self) -> watch::Receiver<u64> {
        self.version.subscribe()
    }

    /// The picture, and the part of it that one who has an earlier revision (or 0 for none) lacks.
    pub fn picture_since(&self, have: u64) -> Option<(ShownPicture, PixelRect)> {
        let state = self.lock();
        let shown = state.picture.clone()?;
        let all = PixelRect::of_size(shown.picture.size);
        let since = || state.history.iter().filter(|change| change.revision > have);
        let known = have > 0 && have <= shown.revision && since().count() as u64 == shown.revision - have;
        if !known || since().any(|change| change.whole) {
            return Some((shown, all));
        }
        let rect = since().map(|change| change.rect).filter(|rect| rect.pixels() > 0).reduce(joined);
        let rect = rect.map_or(PixelRect { x1: 0, y1: 0, ..all }, |rect| rect.intersection(&all));
        Some((shown, rect))
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The least rectangle that covers both.
fn joined(a: PixelRect, b: PixelRect) -> PixelRect {
    PixelRect { x0: a.x0.min(b.x0), y0: a.y0.min(b.y0), x1: a.x1.max(b.x1), y1: a.y1.max(b.y1) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diag::Diagnostics;
    use crate::live::{CacheUse, Kept, Redone};
    use crate::render::stats::Stats;

    const WHOLE: PixelRect = PixelRect { x0: 0, y0: 0, x1: 8, y1: 4 };

    fn show(board: &Board, layer: Layer, changed: PixelRect) {
        let picture = LivePicture {
            generation: 1,
            samples: 1,
            is_final: true,
            size: [8, 4],
            layers: vec![layer.clone()],
            channels: Vec::new(),
            changed,
            redone: Redone::default(),
            cache: CacheUse { kept: Kept::All, needed: 0, limit: 0 },
            stats: Stats::default(),
            warnings: Diagnostics::default(),
            script_errors: Diagnostics::default(),
        };
        let shown = ShownPicture { revision: 0, picture: Arc::new(picture), layer, transparent: false };
        board.show(shown, |shown| shown.revision.to_string());
    }

    fn part(board: &Board, have: u64) -> PixelRect {
        board.picture_since(have).expect("there is a picture").1
    }

    #[test]
    fn a_reader_gets_what_changed_since_it_last_looked() {
        let board = Board::new();
        assert!(board.picture_since(0).is_none());
        show(&board, Layer::Rgba, WHOLE);
        show(&board, Layer::Rgba, PixelRect { x0: 1, y0: 1, x1: 3, y1: 2 });
        show(&board, Layer::Rgba, PixelRect { x0: 4, y0: 0, x1: 5, y1: 2 });
        assert_eq!(part(&board, 0), WHOLE);
        assert_eq!(part(&board, 1), PixelRect { x0: 1, y0: 0, x1: 5, y1: 2 });
        assert_eq!(part(&board, 2), PixelRect { x0: 4, y0: 0, x1: 5, y1: 2 });
        assert_eq!(part(&board, 3).pixels(), 0);
        // One from before a restart.
        assert_eq!(part(&board, 7), WHOLE);
        show(&board, Layer::Color, PixelRect { x0: 0, y0: 0, x1: 1, y1: 1 });
        assert_eq!(part(&board, 3), WHOLE);
        for _ in 0..2 * HISTORY {
            show(&board, Layer::Color, PixelRect { x0: 0, y0: 0, x1: 1, y1: 1 });
        }
        assert_eq!(part(&board, 4), WHOLE);
        assert_eq!(board.lock().history.len(), HISTORY);
    }

    #[test]
    fn a_reader_gets_each_topic_once_and_only_the_newest() {
        let board = Board::new();
        let mut read = Read::default();
        assert!(board.news(&mut read).is_empty());
        board.post(Topic::Scene, "1".into());
        board.post(Topic::Scene, "2".into());
        board.post(Topic::Faults, "3".into());
        let news: Vec<_> = board.news(&mut read).into_iter().map(|(topic, text)| (topic, text.to_string())).collect();
        assert_eq!(news, [(Topic::Scene, "2".to_owned()), (Topic::Faults, "3".to_owned())]);
        board.post(Topic::Scene, "2".into());
        assert!(board.news(&mut read).is_empty());
    }
}
