//! Tusche: a CPU ray tracer that draws feature lines.
//!
//! The method is Ogaki & Georgiev, "Production Ray Tracing of Feature Lines" (SIGGRAPH Asia 2018 Technical Briefs),
//! cited below as OG18. A picture is made in this order:
//!
//! 1. [`scene`]: a scene file or a glTF model becomes an immutable [`scene::Scene`].
//! 2. [`shade`]: its Rhai scripts are compiled; each states what it reads and writes.
//! 3. [`plan`]: what this scene needs is derived once; everything below obeys.
//! 4. [`trace`]: tiles of pixels are traced in waves of rays, and hits are shaded in batches.
//! 5. [`sample`]: the nodes of the ray trees become columns, past the one gate where NaN is stopped.
//! 6. [`mod@line`]: image work only; each sample finds the line it sees.
//! 7. [`film`]: samples are filtered into layers and written as tiles finish.
//!
//! [`render`] is the loop over all of it; [`live`] repeats only what an edit touches; [`study`] measures what comes of it. Nothing but [`cli`] prints; problems are [`diag::Diagnostic`]s.

pub mod cli;
pub mod clock;
pub mod diag;
pub mod files;
pub mod film;
pub mod line;
pub mod live;
pub mod math;
pub mod plan;
pub mod render;
pub mod sample;
pub mod scene;
pub mod shade;
pub mod study;
pub mod trace;
