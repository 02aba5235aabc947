//! Whether two shaders give the same: what an edit of a script or a parameter leaves as it was.
//!
//! "No" may be wrong, "yes" never is.

use std::sync::Arc;

use super::analysis::Finding;
use super::kernel::Kernel;
use super::names::{InputSet, OutputSet};
use super::program::{Mode, Shader};
use super::script::Entry;
use crate::scene::texture::Texture;

impl Shader {
    /// Whether all outputs, errors and lines are those of another shader, at every hit.
    #[must_use]
    pub fn same_as(&self, other: &Self) -> bool {
        // As texts, which tell −0 from 0.
        let params = |shader: &Self| format!("{:?}", shader.params());
        self.mode() == other.mode()
            && self.program.files == other.program.files
            && params(self) == params(other)
            && self.same_surroundings(other)
            && self.same_textures(other)
    }

    /// Whether these outputs, and all extra ones, are those of another shader at every hit, and no hit fails.
    #[must_use]
    pub fn same_outputs(&self, other: &Self, wanted: OutputSet) -> bool {
        if !self.same_surroundings(other) {
            return false;
        }
        match (self.comparable(), other.comparable()) {
            (Some(own), Some(others)) => own.same(&others, wanted),
            _ => false,
        }
    }

    /// Whether some hit may fail when these outputs are asked for, so that it would be marked.
    #[must_use]
    pub fn may_fail(&self, wanted: OutputSet) -> bool {
        self.comparable().is_none_or(|kernel| kernel.slice(wanted).may_fail)
    }

    /// What is not in the script and its parameters.
    fn same_surroundings(&self, other: &Self) -> bool {
        let reads_lights = |shader: &Self| {
            !shader.analysis().complete || shader.analysis().inputs.intersects(InputSet::LIGHT_COUNT | InputSet::LIGHT)
        };
        self.material_id == other.material_id
            && self.natives.is_empty()
            && other.natives.is_empty()
            && self.attributes == other.attributes
            && (self.light_count == other.light_count || !(reads_lights(self) || reads_lights(other)))
    }

    fn same_textures(&self, other: &Self) -> bool {
        match (self.comparable(), other.comparable()) {
            // A kernel knows which textures it reads.
            (Some(own), Some(others)) if self.line.is_none() && other.line.is_none() => own.same_textures(&others),
            _ => {
                let same = |(a, b): (&Arc<Texture>, &Arc<Texture>)| a.looks_like(b);
                self.textures.len() == other.textures.len() && self.textures.iter().zip(&*other.textures).all(same)
            }
        }
    }

    /// The kernel, or that of a constant shader, which none is made for otherwise.
    fn comparable(&self) -> Option<Arc<Kernel>> {
        let lowered: Result<_, Finding> = match (&self.kernel, self.mode()) {
            (Some(kernel), _) => kernel.clone(),
            (None, Mode::Constant) => self.lower(Entry::Surface, self.light_count),
            (None, _) => return None,
        };
        lowered.ok()
    }
}
