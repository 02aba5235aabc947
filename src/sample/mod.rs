//! Samples: the border between rendering and image work.
//!
//! A [`SampleBuffer`] holds every sample of a rectangle of pixels, as columns. Left of it are geometry and scripts;
//! right of it ([`crate::line`], [`crate::film`]) only these columns are known, so the line pass can be tested with
//! five hand-made samples and no ray tracer. Buffers are made by a [`SampleBufferBuilder`], whose [gate] is the
//! one place where NaN, infinity and absurd widths are stopped (DESIGN section 3.7).
//!
//! Samples are ordered by pixel, row by row, then by sample number; nodes of one path are in the order of their
//! samples. So "the index of a sample" orders samples the same way whatever rectangles a picture is cut into.

pub mod buffer;
pub mod builder;
pub mod gate;
pub mod pair;
pub mod path;
pub mod position;
mod restyle;

pub use buffer::{Column, Node, NodeColumnSet, NodeColumns, PixelRect, Rows, SampleBuffer, SampleColor};
pub use builder::{HandMadeSample, SampleBufferBuilder, SampleLayout};
pub use gate::GateCounts;
pub use pair::{PairBatch, PairSide};
pub use path::NodePath;
