//! Batch forms of the transcendental functions of [`portable`].

use super::{LANES, Lanes};
use crate::math::portable::{self, MAX_TURN, lane};

macro_rules! unary {
    ($($name:ident)*) => { $(
        #[doc = concat!("[`portable::", stringify!($name), "`] of each lane.")]
        #[inline(always)]
        pub fn $name(x: &Lanes, out: &mut Lanes) {
            for i in 0..LANES {
                out[i] = lane::$name(x[i]);
            }
        }
    )* };
}
unary! { asin acos atan sinh cosh tanh exp exp2 ln log2 log10 cbrt }

macro_rules! periodic {
    ($($name:ident)*) => { $(
        #[doc = concat!("[`portable::", stringify!($name), "`] of each lane.")]
        #[inline(always)]
        pub fn $name(x: &Lanes, out: &mut Lanes) {
            let mut all_near = true;
            for i in 0..LANES {
                all_near &= x[i].abs() <= MAX_TURN;
                out[i] = lane::$name(x[i]);
            }
            if !all_near {
                far(x, portable::$name, out);
            }
        }
    )* };
}
periodic! { sin cos tan }

/// Lanes that are too large, infinite or NaN, one by one.
#[cold]
#[inline(never)]
fn far(x: &Lanes, function: fn(f32) -> f32, out: &mut Lanes) {
    for (x, out) in x.iter().zip(out) {
        let is_near = x.abs() <= MAX_TURN;
        if !is_near {
            *out = function(*x);
        }
    }
}

/// [`portable::atan2`] of each lane.
#[inline(always)]
pub fn atan2(y: &Lanes, x: &Lanes, out: &mut Lanes) {
    for i in 0..LANES {
        out[i] = lane::atan2(y[i], x[i]);
    }
}

/// [`portable::pow`] of each lane.
#[inline(always)]
pub fn pow(x: &Lanes, y: &Lanes, out: &mut Lanes) {
    for i in 0..LANES {
        out[i] = lane::pow(x[i], y[i]);
    }
}

#[cfg(test)]
mod tests {
    use super::super::check::{Numbers, same_bits};
    use super::*;

    #[test]
    fn transcendental_functions_are_the_same_in_batches() {
        let mut numbers = Numbers::new(4);
        let mut next = || [numbers.any()];
        macro_rules! compare {
            ($($name:ident)*) => { $(
                same_bits(
                    stringify!($name), 500_000, &mut next, |[x]| [portable::$name(x)], |[x], [out]| $name(x, out),
                );
            )* };
        }
        compare! { sin cos tan asin acos atan sinh cosh tanh exp exp2 ln log2 log10 cbrt }
        let mut next = || [numbers.any(), numbers.any()];
        same_bits("atan2", 1_000_000, &mut next, |[y, x]| [portable::atan2(y, x)], |[y, x], [out]| atan2(y, x, out));
        same_bits("pow", 1_000_000, &mut next, |[x, y]| [portable::pow(x, y)], |[x, y], [out]| pow(x, y, out));
    }
}
