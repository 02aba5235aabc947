//! Live: a picture that follows its scene and its scripts while they are being edited.
//!
//! [`Session`] renders in the background and keeps what an edit does not touch. Everything else here drives it.

mod change;
pub mod session;
mod stages;

pub use session::{Event, LivePicture, Session, SessionOptions, Setup};
pub use stages::Redone;
