//! `EXT_mesh_gpu_instancing`: a node that draws its mesh many times.

use gltf::json::accessor::Type;
use serde_json::Value;

use super::accessor::{ANY_NUMBER, FLOAT, Wanted};
use super::document::Document;
use super::report::Report;
use crate::math::{DAffine3, DQuat, DVec3};

/// The transforms of a node's instances, each applied before the node's own. One identity for an ordinary node; `None`
/// after a fault.
pub(super) fn transforms(document: &Document, node: usize, report: &mut Report) -> Option<Vec<DAffine3>> {
    let extensions = document.root.nodes[node].extensions.as_ref();
    let Some(extension) = extensions.and_then(|extensions| extensions.others.get("EXT_mesh_gpu_instancing")) else {
        return Some(vec![DAffine3::IDENTITY]);
    };
    let place = format!("nodes[{node}].extensions.EXT_mesh_gpu_instancing.attributes");
    let Some(attributes) = extension.get("attributes").and_then(Value::as_object) else {
        return report.fail(place, "this is missing");
    };
    let attribute = |name: &str| attributes.get(name).map(|accessor| (format!("{place}.{name}"), accessor.as_u64()));
    let vector = Wanted { types: &[Type::Vec3], components: FLOAT };
    let quaternion = Wanted { types: &[Type::Vec4], components: ANY_NUMBER };
    let translations = read::<3>(document, attribute("TRANSLATION"), vector, report)?;
    let rotations = read::<4>(document, attribute("ROTATION"), quaternion, report)?;
    let scales = read::<3>(document, attribute("SCALE"), vector, report)?;
    let lengths =
        [translations.as_ref().map(Vec::len), rotations.as_ref().map(Vec::len), scales.as_ref().map(Vec::len)];
    let mut counts = lengths.into_iter().flatten();
    let Some(count) = counts.next() else {
        return report.fail(place, "there is no TRANSLATION, ROTATION or SCALE");
    };
    if !counts.all(|other| other == count) {
        return report.fail(place, "the attributes have different numbers of values");
    }
    let vector = |values: &Option<Vec<[f32; 3]>>, i: usize, absent: DVec3| {
        values.as_ref().map_or(absent, |values| DVec3::from(values[i].map(f64::from)))
    };
    (0..count)
        .map(|i| {
            let translation = vector(&translations, i, DVec3::ZERO);
            let scale = vector(&scales, i, DVec3::ONE);
            let rotation = rotations.as_ref().map_or(DQuat::IDENTITY, |all| DQuat::from_array(all[i].map(f64::from)));
            let length = rotation.length();
            if translation.is_finite() && scale.is_finite() && length.is_finite() && length > 0.0 {
                Some(DAffine3::from_scale_rotation_translation(scale, rotation / length, translation))
            } else {
                report.fail(&place, format!("instance {i} has no finite transform"))
            }
        })
        .collect()
}

/// An attribute, or `Some(None)` if it is not there.
fn read<const N: usize>(
    document: &Document,
    attribute: Option<(String, Option<u64>)>,
    wanted: Wanted,
    report: &mut Report,
) -> Option<Option<Vec<[f32; N]>>> {
    let Some((place, accessor)) = attribute else {
        return Some(None);
    };
    let Some(accessor) = accessor.and_then(|accessor| usize::try_from(accessor).ok()) else {
        return report.fail(place, "expected the index of an accessor");
    };
    document.floats::<N>(accessor, wanted, &place, report).map(Some)
}
