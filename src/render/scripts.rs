//! Between the line pass and the scripts that style its lines: neither knows the other.

use crate::line::LineScripts;
use crate::math::{DVec3, Vec3};
use crate::sample::PairBatch;
use crate::scene::ids::MaterialId;
use crate::shade::LineStyles;
use crate::trace::TraceContext;

/// The scripts of a scene, run in a thread's context.
pub(crate) struct ScriptedLines<'c, 'a> {
    context: &'c mut TraceContext<'a>,
    /// The camera's place in the world.
    origin: DVec3,
    styles: LineStyles,
}

impl<'c, 'a> ScriptedLines<'c, 'a> {
    pub(crate) fn new(context: &'c mut TraceContext<'a>, origin: DVec3) -> Self {
        Self { context, origin, styles: LineStyles::default() }
    }
}

impl LineScripts for ScriptedLines<'_, '_> {
    fn style(&mut self, shader: u32, pairs: &mut PairBatch, styles: &mut Vec<(Option<[f32; 3]>, f32)>) {
        for side in &mut pairs.sides {
            for (position, _) in side.position.iter_mut().zip(&side.object).filter(|(_, object)| **object != 0) {
                *position = (Vec3::from(*position).as_dvec3() + self.origin).as_vec3().to_array();
            }
        }
        let Some(material) = (shader as usize).checked_sub(1) else { return };
        self.context.style_lines(MaterialId::from_index(material), pairs, &mut self.styles);
        let colors = self.styles.color.iter().map(|color| color.map(|color| color.to_array()));
        styles.extend(colors.zip(self.styles.opacity.iter().copied()));
    }
}
