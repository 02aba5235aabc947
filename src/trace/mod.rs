//! Rays: from a tile of pixels to its samples.
//!
//! - [`triangle`]: the watertight ray–triangle test.
//! - [`tree`]: bounding volume hierarchies and the traversal they share; [`mesh_tree`]: one over the triangles of a mesh.
//! - [`world`]: one hierarchy over the objects; closest hits and shadow rays. `hits` settles which hit of a ray comes first.
//! - [`packet`], [`world_packet`]: the same for sixteen rays that go much the same way.
//! - [`surface`]: from a hit to a place with normals, texture coordinates and error bounds; `surface_lanes`: sixteen at a time.
//! - [`wave`]: the rays of a tile, one depth of the ray tree at a time; `shadow` finds what lights give a hit, `scatter`
//!   shades hits and sends rays on; `media` knows which bodies of glass a ray is in; `list` keeps what the line pass wants to
//!   know of surfaces behind the first.
//! - `film`: where a tile's samples lie; `clear`: pixels that surely show the background alone, for which nothing is traced.
//! - `record`: what the rays of a tile met, so that it can be shaded again without tracing; `restyle`: only its lines.
//!
//! Everything here works relative to the camera's position, so that precision is best where the camera looks from,
//! wherever in the world that is.

mod clear;
mod cone;
pub mod eight;
mod film;
mod hits;
mod list;
mod media;
pub mod mesh_tree;
pub mod packet;
mod ray_tree;
mod record;
mod restyle;
mod scatter;
mod shadow;
pub mod surface;
mod surface_lanes;
pub mod tree;
pub mod triangle;
pub mod wave;
pub mod world;
pub mod world_packet;

pub use record::TileRecord;
pub use restyle::Restyled;
pub use wave::{Memory, RayCounts, TileTracer, TraceContext, TracedTile};
pub use world::World;

/// Bound on the relative error of `n` roundings in a row (Higham; pbrt 4th edition, section 6.8.1).
const fn gamma(n: u32) -> f32 {
    let n_epsilon = n as f32 * f32::EPSILON * 0.5;
    n_epsilon / (1.0 - n_epsilon)
}
