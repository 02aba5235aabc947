//! All integration tests in one binary. This file is the table of contents.

mod analysis;
mod film;
mod gltf;
mod line;
mod scene_file;
mod shade;
