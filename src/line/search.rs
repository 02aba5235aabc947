//! TODO
use super::{LineBuffer, Rules, Window};
use crate::sample::SampleBuffer;

pub(super) fn find_lines(window: &Window<'_>, target: &SampleBuffer, rules: &Rules) -> LineBuffer {
    let _ = (window, target, rules);
    todo!()
}
