//! Film: samples and their lines through the pixel filter into layers, and layers into files.

pub mod compare;
pub mod develop;
pub mod exr;
pub mod filter;
pub mod layer;
pub mod output;
pub mod png;

pub use develop::{FilmWindow, develop};
pub use filter::Filter;
pub use layer::{FilmTile, Layer};
pub use output::{Output, OutputSettings};
