//! Animations pose the nodes at one time.
//!
//! Only the first animation of a model is played, as other viewers do. Before its first key and after its last, a
//! channel keeps that key's value: animations do not repeat.

use gltf::json;
use gltf::json::accessor::Type;
use gltf::json::animation::{Interpolation, Property};
use gltf::json::validation::Checked;

use super::accessor::{ANY_NUMBER, FLOAT, Wanted};
use super::document::Document;
use super::node::Local;
use super::report::Report;
use crate::math::{DQuat, DVec3};

/// Where a time falls between the keys of a sampler.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Moment {
    /// On a key, or outside all keys.
    Key(usize),
    /// After a key and before the next: how far (0 … 1), and the seconds between the two.
    Between(usize, f64, f64),
}

/// Moves the nodes that the first animation targets to where they are at `seconds`.
pub(super) fn pose(document: &Document, seconds: f64, locals: &mut [Local], report: &mut Report) {
    let Some(animation) = document.root.animations.first() else {
        return;
    };
    for (index, channel) in animation.channels.iter().enumerate() {
        let place = format!("animations[0].channels[{index}]");
        let node = channel.target.node.value();
        let Some(sampler) = animation.samplers.get(channel.sampler.value()) else {
            continue; // Reported when the JSON was checked.
        };
        let Some(local) = locals.get_mut(node) else {
            report.error(format!("{place}.target.node"), format!("there is no nodes[{node}]"));
            continue;
        };
        let (Checked::Valid(property), Checked::Valid(interpolation)) = (channel.target.path, sampler.interpolation)
        else {
            report.error(&place, "its path or interpolation is not one that glTF knows");
            continue;
        };
        let place = format!("animations[0].samplers[{}]", channel.sampler);
        let targets = morph_targets(&document.root, node);
        let channel = Channel { document, sampler, interpolation, seconds, place: &place };
        // An animated node is one with translation, rotation and scale; a matrix would hide them.
        match property {
            Property::Translation => channel.vector(report, |value| (local.translation, local.matrix) = (value, None)),
            Property::Scale => channel.vector(report, |value| (local.scale, local.matrix) = (value, None)),
            Property::Rotation => channel.rotation(report, |value| (local.rotation, local.matrix) = (value, None)),
            Property::MorphTargetWeights => channel.weights(targets, report, |value| local.weights = Some(value)),
        }
    }
}

fn morph_targets(root: &json::Root, node: usize) -> usize {
    let mesh = root.nodes[node].mesh.and_then(|mesh| root.meshes.get(mesh.value()));
    mesh.and_then(|mesh| mesh.primitives.first()?.targets.as_ref()).map_or(0, Vec::len)
}

/// One channel's sampler at one time.
struct Channel<'a> {
    document: &'a Document,
    sampler: &'a json::animation::Sampler,
    interpolation: Interpolation,
    seconds: f64,
    place: &'a str,
}

impl Channel<'_> {
    fn vector(&self, report: &mut Report, set: impl FnOnce(DVec3)) {
        let wanted = Wanted { types: &[Type::Vec3], components: FLOAT };
        let Some((moment, values)) = self.keys::<3>(wanted, 1, report) else {
            return;
        };
        let value = |i: usize| DVec3::from(values[i].map(f64::from));
        match (moment, self.interpolation) {
            (Moment::Key(key), _) | (Moment::Between(key, ..), Interpolation::Step) => set(value(self.at(key))),
            (Moment::Between(key, t, _), Interpolation::Linear) => set(value(key).lerp(value(key + 1), t)),
            (Moment::Between(key, t, seconds), Interpolation::CubicSpline) => {
                let [a, b, c, d] = hermite(t, seconds);
                set(value(3 * key + 1) * a + value(3 * key + 2) * b + value(3 * key + 4) * c + value(3 * key + 3) * d);
            }
        }
    }

    fn rotation(&self, report: &mut Report, set: impl FnOnce(DQuat)) {
        let wanted = Wanted { types: &[Type::Vec4], components: ANY_NUMBER };
        let Some((moment, values)) = self.keys::<4>(wanted, 1, report) else {
            return;
        };
        let value = |i: usize| DQuat::from_array(values[i].map(f64::from));
        let posed = match (moment, self.interpolation) {
            (Moment::Key(key), _) | (Moment::Between(key, ..), Interpolation::Step) => value(self.at(key)),
            (Moment::Between(key, t, _), Interpolation::Linear) => {
                let (a, b) = (value(key), value(key + 1));
                if a.length() > 0.0 && b.length() > 0.0 { a.normalize().slerp(b.normalize(), t) } else { a }
            }
            (Moment::Between(key, t, seconds), Interpolation::CubicSpline) => {
                let [a, b, c, d] = hermite(t, seconds);
                value(3 * key + 1) * a + value(3 * key + 2) * b + value(3 * key + 4) * c + value(3 * key + 3) * d
            }
        };
        let length = posed.length();
        if length > 0.0 && length.is_finite() {
            set(posed / length);
        } else {
            report.error(self.place, "a rotation must be a quaternion of length 1");
        }
    }

    fn weights(&self, targets: usize, report: &mut Report, set: impl FnOnce(Vec<f32>)) {
        let wanted = Wanted { types: &[Type::Scalar], components: ANY_NUMBER };
        let Some((moment, values)) = self.keys::<1>(wanted, targets, report) else {
            return;
        };
        let value = |i: usize, target: usize| values[i * targets + target][0];
        let weight = |target: usize| match (moment, self.interpolation) {
            (Moment::Key(key), _) | (Moment::Between(key, ..), Interpolation::Step) => value(self.at(key), target),
            (Moment::Between(key, t, _), Interpolation::Linear) => {
                let (a, b) = (value(key, target), value(key + 1, target));
                a + (b - a) * t as f32
            }
            (Moment::Between(key, t, seconds), Interpolation::CubicSpline) => {
                let [a, b, c, d] = hermite(t, seconds).map(|factor| factor as f32);
                value(3 * key + 1, target) * a
                    + value(3 * key + 2, target) * b
                    + value(3 * key + 4, target) * c
                    + value(3 * key + 3, target) * d
            }
        };
        set((0..targets).map(weight).collect());
    }

    /// Where a key's value is among the outputs: splines keep tangents on both sides of it.
    fn at(&self, key: usize) -> usize {
        if self.interpolation == Interpolation::CubicSpline { 3 * key + 1 } else { key }
    }

    /// The moment, and all outputs, of which there are as many as the keys need.
    fn keys<const N: usize>(
        &self,
        wanted: Wanted,
        values_each: usize,
        report: &mut Report,
    ) -> Option<(Moment, Vec<[f32; N]>)> {
        let place = format!("{}.input", self.place);
        let scalar = Wanted { types: &[Type::Scalar], components: FLOAT };
        let times = self.document.floats::<1>(self.sampler.input.value(), scalar, &place, report)?;
        if times.is_empty() {
            return report.fail(place, "an animation needs at least one key");
        }
        // Written so that NaN fails.
        if !times.iter().all(|[time]| time.is_finite()) || !times.windows(2).all(|pair| pair[0] < pair[1]) {
            return report.fail(place, "the times must be finite and strictly increasing");
        }
        let place = format!("{}.output", self.place);
        let values = self.document.floats::<N>(self.sampler.output.value(), wanted, &place, report)?;
        let parts = if self.interpolation == Interpolation::CubicSpline { 3 } else { 1 };
        let expected = times.len() * parts * values_each;
        if values.len() != expected {
            let found = values.len();
            return report.fail(place, format!("{} keys need {expected} values, found {found}", times.len()));
        }
        if !values.as_flattened().iter().all(|value| value.is_finite()) {
            return report.fail(place, "the values must be finite");
        }
        Some((moment(&times, self.seconds), values))
    }
}

fn moment(times: &[[f32; 1]], seconds: f64) -> Moment {
    let time = |key: usize| f64::from(times[key][0]);
    let after = times.partition_point(|[time]| f64::from(*time) <= seconds);
    match after.checked_sub(1) {
        None => Moment::Key(0),
        Some(key) if after == times.len() || time(key) == seconds => Moment::Key(key),
        Some(key) => {
            let span = time(after) - time(key);
            Moment::Between(key, (seconds - time(key)) / span, span)
        }
    }
}

/// The weights of the value before, its outgoing tangent, the value after, and its incoming tangent
/// (specification, appendix C.5).
fn hermite(t: f64, seconds: f64) -> [f64; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [2.0 * t3 - 3.0 * t2 + 1.0, seconds * (t3 - 2.0 * t2 + t), 3.0 * t2 - 2.0 * t3, seconds * (t3 - t2)]
}
