//! The script host: Rhai scripts as surface shaders (DESIGN section 4).
//!
//! 1. [`Host`] holds what scripts may call: the library, and whatever a Rust user registers.
//! 2. [`Shaders::compile`] compiles the scene's scripts and, for each material, runs the [`analysis`]: what it reads,
//!    what it writes, within which bounds.
//! 3. Hits of one material are gathered into a [`HitBatch`] (only the inputs it reads) and shaded into an
//!    [`OutputBatch`] (only the outputs that the plan needs) by a [`Shading`] context, one per thread.
//!
//! What the interpreter returns is what a script means; anything faster must match it bit for bit.

pub mod analysis;
pub mod batch;
pub mod bsdf;
pub mod builtin;
pub mod check;
mod closures;
mod fault;
pub mod host;
pub mod interpret;
mod kernel;
pub mod library;
pub mod lighting;
pub mod line;
mod link;
pub mod measure;
pub mod names;
pub mod native;
mod output;
pub mod params;
pub mod program;
pub mod reference;
pub mod requests;
mod same;
mod script;
pub mod synthetic;

pub use analysis::Analysis;
pub use batch::{HitBatch, LightSample, OutputBatch};
pub use bsdf::Bsdf;
pub use check::{Check, Report};
pub use host::Host;
pub use interpret::{ShadeErrors, Shading};
pub use lighting::Lighting;
pub use line::LineStyles;
pub use names::{InputSet, OutputSet, PairSet, PathKind};
pub use native::{NativeFunction, NativeType, NativeValue, Package};
pub use params::{Params, Value};
pub use program::{Mode, Shader, Shaders, ShadingMode};
