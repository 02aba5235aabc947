//! What accuracy costs, and what is wrong with pictures, as numbers (DESIGN section 9).
//!
//! [`study()`] renders a [`Ladder`] of settings for each [`Knob`] that matters to a scene, and compares every
//! picture with a reference: the scene without approximations, with many samples and seeds of its own. [`measure`] says what
//! the errors are; [`report`] turns the outcome into a page.

pub mod flicker;
pub mod flip;
pub mod folder;
pub mod ladder;
pub mod measure;
pub mod quality;
pub mod report;
pub mod run;
pub mod table;
pub mod truth;
pub mod width;

pub use flicker::{Flicker, FlickerOptions, flicker};
pub use flip::{flip, mean_flip};
pub use ladder::{Knob, Ladder, Settings};
pub use quality::Quality;
pub use run::{Study, StudyControl, StudyOptions, study};
