//! What accuracy costs, and what is wrong with pictures, as numbers (DESIGN section 9).

pub mod flicker;
pub mod flip;

pub use flicker::{Flicker, FlickerOptions, flicker};
pub use flip::{flip, mean_flip};
