//! What accuracy costs, and what is wrong with pictures, as numbers (DESIGN section 9).

pub mod flicker;

pub use flicker::{Flicker, FlickerOptions, flicker};
