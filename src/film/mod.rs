//! Film: samples and their lines through the pixel filter into layers, and layers into files.
//!
//! [`develop`](develop()) turns the samples around a rectangle into a [`FilmTile`]; an [`Output`] takes tiles as they
//! finish, in any order and from any thread, and holds only what does not yet fill a block of its file; [`compare`](mod@compare)
//! reads pictures back and tells how they differ. Nothing here knows of scenes, rays or scripts.

mod atomic;
mod blocks;
pub mod compare;
pub mod develop;
mod even;
mod exr;
pub mod filter;
pub mod layer;
pub mod output;
pub mod picture;
mod png;
mod spread;
pub mod view;

pub use atomic::{check_writable, write_atomically};
pub use compare::{Comparison, compare, write_difference};
pub use develop::{FilmWindow, develop};
pub use filter::Filter;
pub use layer::{Channel, ChannelFormat, FilmTile, Layer, LinePath};
pub use output::{Output, OutputSettings};
pub use picture::Picture;
pub use view::View;
