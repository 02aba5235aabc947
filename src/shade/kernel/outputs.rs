//! From registers to the columns of an [`OutputBatch`].
//!
//! A row without the key holds the default, or `None` for outputs whose default lies outside the shader: what the
//! interpreter's rows hold.

use super::lower::Target;
use super::run::{LANES, Registers, View};
use super::slice::Register;
use crate::math::Vec3;
use crate::shade::batch::OutputBatch;
use crate::shade::names::OutputSet;
use crate::shade::output::defaults;

/// Appends a chunk of rows. The first root tells where the key is present; its channels follow.
pub(super) fn append(
    target: &Target,
    aovs: &[String],
    roots: &[Register],
    registers: &Registers,
    rows: usize,
    outputs: &mut OutputBatch,
) {
    let present = registers.bool(roots[0]);
    let float = |channel: usize| registers.float(roots[1 + channel]);
    let number = |column: &mut Vec<f32>, default: f32| {
        fill(column, present, [float(0)], rows, |[x]| x, default);
    };
    let color = |column: &mut Vec<Vec3>, default: Vec3| {
        fill(column, present, [float(0), float(1), float(2)], rows, Vec3::from_array, default);
    };
    let maybe_color = |column: &mut Vec<Option<Vec3>>| {
        fill(column, present, [float(0), float(1), float(2)], rows, |color| Some(Vec3::from_array(color)), None);
    };
    let output = match target {
        Target::Output(output) => *output,
        Target::Aov(name) => {
            if let Ok(index) = aovs.binary_search(name)
                && let Some(column) = outputs.aovs.get_mut(index)
            {
                color(column, Vec3::ZERO);
            }
            return;
        }
    };
    match output {
        OutputSet::BASE_COLOR => color(&mut outputs.base_color, defaults::BASE_COLOR),
        OutputSet::METALLIC => number(&mut outputs.metallic, defaults::METALLIC),
        OutputSet::ROUGHNESS => number(&mut outputs.roughness, defaults::ROUGHNESS),
        OutputSet::SPECULAR => number(&mut outputs.specular, defaults::SPECULAR),
        OutputSet::IOR => number(&mut outputs.ior, defaults::IOR),
        OutputSet::TRANSMISSION => number(&mut outputs.transmission, defaults::TRANSMISSION),
        OutputSet::OPACITY => number(&mut outputs.opacity, defaults::OPACITY),
        OutputSet::EMISSION => color(&mut outputs.emission, defaults::EMISSION),
        OutputSet::NORMAL => maybe_color(&mut outputs.normal),
        OutputSet::OCCLUSION => number(&mut outputs.occlusion, defaults::OCCLUSION),
        OutputSet::FEATURE => color(&mut outputs.feature, defaults::FEATURE),
        OutputSet::LINE_COLOR => maybe_color(&mut outputs.line_color),
        OutputSet::LINE_WIDTH => {
            fill(&mut outputs.line_width, present, [float(0)], rows, |[x]| Some(x), None);
        }
        OutputSet::PRIORITY => {
            #[expect(clippy::cast_possible_truncation, reason = "hits where it does not fit have failed")]
            fill(&mut outputs.priority, present, [registers.int(roots[1])], rows, |[x]| Some(x as i32), None);
        }
        OutputSet::COLOR => maybe_color(&mut outputs.color),
        OutputSet::LINE_OPACITY => number(&mut outputs.line_opacity, defaults::LINE_OPACITY),
        _ => {}
    }
}

/// Appends rows to a column, a block at a time.
fn fill<T: Copy, S: Copy, const CHANNELS: usize>(
    column: &mut Vec<T>,
    present: View<'_, u32>,
    channels: [View<'_, S>; CHANNELS],
    rows: usize,
    make: impl Fn([S; CHANNELS]) -> T,
    absent: T,
) {
    let end = column.len() + rows;
    match (present.uniform(), channels.map(|channel| channel.uniform())) {
        (Some(0), _) => column.resize(end, absent),
        (Some(_), values) if values.iter().all(Option::is_some) => {
            column.resize(end, make(channels.map(|channel| channel.lanes(0)[0])));
        }
        (present_everywhere, _) => {
            let start = column.len();
            column.resize(end, absent);
            for (block, values) in column[start..].chunks_mut(LANES).enumerate() {
                let (present, channels) = (present.lanes(block), channels.map(|channel| channel.lanes(block)));
                let value = |lane: usize| make(channels.map(|channel| channel[lane]));
                for (lane, place) in values.iter_mut().enumerate() {
                    if present_everywhere.is_some() || present[lane] != 0 {
                        *place = value(lane);
                    }
                }
            }
        }
    }
}
