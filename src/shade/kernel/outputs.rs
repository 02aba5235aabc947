//! From registers to the columns of an [`OutputBatch`].
//!
//! A row without the key holds the default, or `None` for outputs whose default lies outside the shader: what the
//! interpreter's rows hold.

use super::lower::Target;
use super::run::Registers;
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
    let has = |row: usize| present.row(row) != 0;
    let float = |channel: usize| registers.float(roots[1 + channel]);
    let number = |column: &mut Vec<f32>, default: f32| {
        let x = float(0);
        column.extend((0..rows).map(|row| if has(row) { x.row(row) } else { default }));
    };
    let color = |column: &mut Vec<Vec3>, default: Vec3| {
        let [x, y, z] = [float(0), float(1), float(2)];
        column.extend(
            (0..rows).map(|row| if has(row) { Vec3::new(x.row(row), y.row(row), z.row(row)) } else { default }),
        );
    };
    let maybe_color = |column: &mut Vec<Option<Vec3>>| {
        let [x, y, z] = [float(0), float(1), float(2)];
        column.extend((0..rows).map(|row| has(row).then(|| Vec3::new(x.row(row), y.row(row), z.row(row)))));
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
            let x = float(0);
            outputs.line_width.extend((0..rows).map(|row| has(row).then(|| x.row(row))));
        }
        OutputSet::PRIORITY => {
            let x = registers.int(roots[1]);
            #[expect(clippy::cast_possible_truncation, reason = "hits where it does not fit have failed")]
            outputs.priority.extend((0..rows).map(|row| has(row).then(|| x.row(row) as i32)));
        }
        OutputSet::COLOR => maybe_color(&mut outputs.color),
        _ => {}
    }
}
