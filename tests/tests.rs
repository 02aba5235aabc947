//! All integration tests in one binary. This file is the table of contents.

mod common;

// From the outside in: the command, its input, ...
mod cli;
mod gltf;
mod mesh_file;
mod scene_file;
// ... scripts and what is known of them, ...
mod analysis;
mod kernel;
mod plan;
mod shade;
mod shader_check;
// ... rays, lines and pixels, ...
mod clear;
mod film;
mod footprint;
mod light;
mod line;
mod packets;
mod trace;
// ... and the whole.
mod flicker;
mod live;
mod oversampling;
mod same_bits;
mod sampling;
mod session;
mod stability;
mod study;
mod surfaces;
mod truth;
mod why;
