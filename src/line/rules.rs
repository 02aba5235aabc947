//! Line settings, made ready for a sample rate.

use crate::scene::settings::LineSettings;

/// [`LineSettings`] with all that follows from them and the sample rate worked out once.
#[derive(Clone, Debug, PartialEq)]
pub struct Rules {
    /// The settings.
    pub settings: LineSettings,
    /// Samples per square pixel and stratum.
    pub density: f32,
}

impl Rules {
    /// Rules for a sample rate.
    #[must_use]
    pub fn new(settings: &LineSettings, samples_per_pixel: u32) -> Self {
        Self { settings: settings.clone(), density: samples_per_pixel as f32 }
    }

    /// The half width within which a neighbour makes a line of this full width visible: half the effective width,
    /// widened by the thinning compensation (DESIGN section 3.9). 0 if the width is no line.
    #[must_use]
    pub fn radius(&self, width: f32) -> f32 {
        let _ = width;
        todo!()
    }

    /// How far a line reaches at most, in whole pixels: neighbours farther than this many pixels never matter.
    #[must_use]
    pub fn reach(&self) -> i32 {
        todo!()
    }
}
