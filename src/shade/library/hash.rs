//! Hashes: a number or vector in, an unrelated number out, the same every time.

use rhai::{Dynamic, Engine};

use super::Function;
use super::operand::{Operand, Outcome, refuse};
use crate::math::Vec3;

pub(super) const FUNCTIONS: &[Function] = &[
    Function {
        name: "hash",
        form: "hash(x)",
        about: "a number 0 ≤ h < 1 that looks random, of a number or vector",
        types: "number or vector → number, 0 ≤ h < 1",
        example: "hash(hit.object_id)",
    },
    Function {
        name: "hash_color",
        form: "hash_color(x)",
        about: "the same, three unrelated numbers in a vec3",
        types: "number or vector → vec3, 0 ≤ h < 1",
        example: "hash_color(hit.polygon_id)",
    },
];

/// An integer hash with good avalanche: C. Wellons' `lowbias32`.
#[inline(always)]
fn scramble(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// The hash of an int from a seed.
#[inline(always)]
pub(in crate::shade) fn of_int(seed: u32, x: i64) -> f32 {
    unit(digest(seed, Operand::Int(x)))
}

/// The hash of a number's or vector's components from a seed.
#[inline(always)]
pub(in crate::shade) fn of_floats(seed: u32, components: &[f32]) -> f32 {
    unit(components.iter().fold(seed, |h, x| join(h, float_word(*x))))
}

#[inline(always)]
fn join(h: u32, word: u32) -> u32 {
    scramble(h ^ word).wrapping_add(0x9e37_79b9)
}

/// −0 counts as 0, and every NaN as one: which of its many bit patterns an operation gives is up to the machine.
#[inline(always)]
fn float_word(x: f32) -> u32 {
    if x.is_nan() { f32::NAN.to_bits() } else { (x + 0.0).to_bits() }
}

/// From a seed, for each word in order, `h = scramble(h ^ word) + 0x9e3779b9`. The words of an int are its low and high
/// 32 bits; of floats, the bits of each component, −0 counting as 0 and all NaNs as one. So 1 and 1.0 differ.
fn digest(seed: u32, value: Operand) -> u32 {
    match value {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the halves are taken as bits")]
        Operand::Int(x) => join(join(seed, x as u32), (x >> 32) as u32),
        _ => (0..value.width()).fold(seed, |h, lane| join(h, float_word(value.lane(lane)))),
    }
}

/// The upper 24 bits as a fraction, each value exact.
#[expect(clippy::cast_precision_loss, reason = "24 bits fit a float")]
#[inline(always)]
fn unit(h: u32) -> f32 {
    (scramble(h) >> 8) as f32 / 16_777_216.0
}

fn hash(name: &str, value: Dynamic, seed: u32) -> Outcome<f32> {
    match Operand::of(&value) {
        Some(operand) => Ok(unit(digest(seed, operand))),
        None => Err(refuse(name, &[value])),
    }
}

pub(super) fn register(engine: &mut Engine) {
    engine.register_fn("hash", |value: Dynamic| hash("hash", value, 0));
    engine.register_fn("hash_color", |value: Dynamic| -> Outcome<Vec3> {
        let channel = |seed| hash("hash_color", value.clone(), seed);
        Ok(Vec3::new(channel(1)?, channel(2)?, channel(3)?))
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hashes_spread_evenly() {
        let mut buckets = [0_u32; 16];
        for x in 0..16_000 {
            let h = unit(digest(0, Operand::Int(x)));
            assert!((0.0..1.0).contains(&h));
            buckets[(h * 16.0) as usize] += 1;
        }
        assert!(buckets.iter().all(|n| (850..1150).contains(n)), "{buckets:?}");
    }

    #[test]
    fn both_zeros_hash_alike() {
        assert_eq!(digest(0, Operand::Float(0.0)), digest(0, Operand::Float(-0.0)));
    }
}
