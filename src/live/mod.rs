//! Live: a picture that follows its scene and its scripts while they are being edited.
//!
//! [`Session`] renders in the background and keeps what an edit does not touch. [`Watch`] drives it:
//!
//! 1. `follow`: which files have other contents than those that the last run read.
//! 2. [`mod@watch`] and `driver`: one loop that loads what has changed, gives it to the session, and tells what comes of it.
//! 3. [`edit`] and [`controls`]: what can be turned without touching a file, and how it gets back into one.
//! 4. `board` and `server`: the page in a browser; `tev`: the same pictures in that viewer; `outputs`: picture files.

mod board;
mod change;
pub mod controls;
mod driver;
pub mod edit;
mod follow;
mod outputs;
mod server;
pub mod session;
mod stages;
mod tev;
pub mod watch;

pub use server::PageOptions;
pub use session::{CacheUse, Event, Kept, LivePicture, Session, SessionOptions, Setup};
pub use stages::Redone;
pub use tev::DEFAULT_ADDRESS as TEV_ADDRESS;
pub use watch::{News, Watch, WatchHandle, WatchOptions};
