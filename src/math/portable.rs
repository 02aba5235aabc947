//! Transcendental functions whose results do not depend on the machine.
//!
//! Each is computed in double precision from nothing but additions, multiplications, divisions, square roots and bit
//! operations, which IEEE 754 defines to the last bit, in a fixed order, never fused; then rounded once. The polynomials
//! are good for 1e-10, so a result is the float nearest to the true value, or in rare cases the one beside it (an error of
//! at most 0.501 units in the last place; a test measures it). Special cases are those of C99 (annex F).
//!
//! All but [`sin`], [`cos`] and [`tan`], and all of [`lane`], have neither branches nor calls and are always inlined: a loop
//! over them becomes vector instructions.

macro_rules! plain {
    ($($(#[$doc:meta])* $name:ident($($x:ident),*)),* $(,)?) => { $(
        $(#[$doc])*
        #[inline(always)]
        #[must_use]
        pub fn $name($($x: f32),*) -> f32 {
            lane::$name($($x),*)
        }
    )* };
}
plain! {
    /// The angle of a sine, in radians, −π/2 … π/2.
    asin(x),
    /// The angle of a cosine, in radians, 0 … π.
    acos(x),
    /// The angle of a tangent, in radians, −π/2 … π/2.
    atan(x),
    /// The angle of the vector (`x`, `y`) in radians, −π … π.
    atan2(y, x),
    /// Hyperbolic sine.
    sinh(x),
    /// Hyperbolic cosine.
    cosh(x),
    /// Hyperbolic tangent.
    tanh(x),
    /// e to the power `x`.
    exp(x),
    /// 2 to the power `x`.
    exp2(x),
    /// Natural logarithm.
    ln(x),
    /// Logarithm to base 2.
    log2(x),
    /// Logarithm to base 10.
    log10(x),
    /// `x` to the power `y`.
    pow(x, y),
    /// Cube root.
    cbrt(x),
}

/// Beyond this, [`sin`], [`cos`] and [`tan`] are not those of [`lane`] but come from `libm`.
pub const MAX_TURN: f32 = 1_048_576.0;

macro_rules! periodic {
    ($($(#[$doc:meta])* $name:ident, $far:ident);* $(;)?) => { $(
        $(#[$doc])*
        #[must_use]
        pub fn $name(x: f32) -> f32 {
            match x.abs() {
                near if near <= MAX_TURN => lane::$name(x),
                far if far < f32::INFINITY => libm::$far(f64::from(x)) as f32,
                _ => f32::NAN,
            }
        }
    )* };
}
periodic! {
    /// Sine of an angle in radians.
    sin, sin;
    /// Cosine of an angle in radians.
    cos, cos;
    /// Tangent of an angle in radians.
    tan, tan;
}

/// `sin` in double precision, for constants that are worked out once and must not be a rounding error off.
#[inline]
#[must_use]
pub fn sin_f64(x: f64) -> f64 {
    libm::sin(x)
}

/// One lane of a batch. `inline(always)`, so that it is compiled for the caller's vectors.
pub mod lane {
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, LN_2, LOG2_E, LOG10_2, PI};

    /// Adding it rounds a number to a whole one, which then stands in the low bits.
    const ROUNDER: f64 = 6_755_399_441_055_744.0;

    /// π/2 cut after 33 bits, and the rest: the product of the first with a number up to 2²⁰ is exact.
    const HALF_PI: [f64; 2] = [1.570_796_326_734_125_6, 6.077_100_506_506_192e-11];

    /// The polynomial with the given coefficients, lowest first.
    #[inline(always)]
    fn polynomial<const N: usize>(x: f64, coefficients: [f64; N]) -> f64 {
        let mut sum = coefficients[N - 1];
        let mut i = N - 1;
        while i > 0 {
            i -= 1;
            sum = sum * x + coefficients[i];
        }
        sum
    }

    /// `x` less the nearest multiple of π/2, and the number of that.
    #[inline(always)]
    fn reduced(x: f32) -> (f64, u64) {
        let x = f64::from(x);
        let sum = x * std::f64::consts::FRAC_2_PI + ROUNDER;
        let turns = sum - ROUNDER;
        ((x - turns * HALF_PI[0]) - turns * HALF_PI[1], sum.to_bits())
    }

    /// Sine and cosine of an angle of at most π/4, by the polynomials of FreeBSD's `k_sinf.c` and `k_cosf.c`.
    #[inline(always)]
    fn sine_and_cosine(x: f64) -> (f64, f64) {
        let z = x * x;
        let sine = polynomial(
            z,
            [
                -0.166_666_666_416_265_24,
                0.008_333_329_385_889_463,
                -0.000_198_393_348_360_966_32,
                2.718_311_493_989_822e-6,
            ],
        );
        let cosine = polynomial(
            z,
            [
                1.0,
                -0.499_999_997_251_031,
                0.041_666_623_323_739_06,
                -0.001_388_676_377_460_993,
                2.439_044_879_627_741e-5,
            ],
        );
        (x + x * z * sine, cosine)
    }

    /// Sine. |x| is at most [`MAX_TURN`](super::MAX_TURN).
    #[inline(always)]
    #[must_use]
    pub fn sin(x: f32) -> f32 {
        let (rest, quarter) = reduced(x);
        let (sine, cosine) = sine_and_cosine(rest);
        let value = if quarter & 1 == 0 { sine } else { cosine };
        f64::from_bits(value.to_bits() ^ ((quarter & 2) << 62)) as f32
    }

    /// Cosine. |x| is at most [`MAX_TURN`](super::MAX_TURN).
    #[inline(always)]
    #[must_use]
    pub fn cos(x: f32) -> f32 {
        let (rest, quarter) = reduced(x);
        let (sine, cosine) = sine_and_cosine(rest);
        let value = if quarter & 1 == 0 { cosine } else { sine };
        f64::from_bits(value.to_bits() ^ ((quarter.wrapping_add(1) & 2) << 62)) as f32
    }

    /// Tangent. |x| is at most [`MAX_TURN`](super::MAX_TURN).
    #[inline(always)]
    #[must_use]
    pub fn tan(x: f32) -> f32 {
        let (rest, quarter) = reduced(x);
        let (sine, cosine) = sine_and_cosine(rest);
        let even = quarter & 1 == 0;
        ((if even { sine } else { -cosine }) / (if even { cosine } else { sine })) as f32
    }

    /// Arc sine of a number from 0 to 1/2.
    #[inline(always)]
    fn small_arc_sine(x: f64) -> f64 {
        let z = x * x;
        let rest = polynomial(
            z,
            [
                0.166_666_666_654_950_86,
                0.075_000_005_988_290_49,
                0.044_642_358_484_883_196,
                0.030_397_634_130_580_702,
                0.022_132_443_623_426_794,
                0.019_306_260_869_368_045,
                0.005_443_185_102_748_108,
                0.029_305_239_705_335_79,
            ],
        );
        x + x * z * rest
    }

    /// Arc sine.
    #[inline(always)]
    #[must_use]
    pub fn asin(x: f32) -> f32 {
        let size = f64::from(x.abs());
        let far = size > 0.5;
        let part = small_arc_sine(if far { ((1.0 - size) * 0.5).sqrt() } else { size });
        let angle = (if far { FRAC_PI_2 - 2.0 * part } else { part }) as f32;
        if size <= 1.0 { angle.copysign(x) } else { f32::NAN }
    }

    /// Arc cosine.
    #[inline(always)]
    #[must_use]
    pub fn acos(x: f32) -> f32 {
        let size = f64::from(x.abs());
        let far = size > 0.5;
        let part = small_arc_sine(if far { ((1.0 - size) * 0.5).sqrt() } else { size });
        let part = if far { 2.0 * part } else { FRAC_PI_2 - part };
        let angle = (if x < 0.0 { PI - part } else { part }) as f32;
        if size <= 1.0 { angle } else { f32::NAN }
    }

    /// The angle of the vector (`x`, `y`), both not negative, 0 … π/2.
    #[inline(always)]
    fn first_quarter(y: f64, x: f64) -> f64 {
        const EIGHTH: f64 = 0.414_213_562_373_095_03;
        let steep = y > x;
        let (low, high) = if steep { (x, y) } else { (y, x) };
        let past_eighth = low > high * EIGHTH;
        let above = if past_eighth { low - high } else { low };
        let below = if past_eighth { low + high } else { high };
        let t = above / (if below == 0.0 { 1.0 } else { below });
        let z = t * t;
        let rest = polynomial(
            z,
            [
                -0.333_333_333_314_382_64,
                0.199_999_989_160_922_15,
                -0.142_856_124_191_430_23,
                0.111_074_925_707_108_24,
                -0.090_289_516_200_012_78,
                0.071_351_441_597_153_83,
                -0.040_428_425_583_640_86,
            ],
        );
        let angle = t + t * z * rest;
        let angle = if past_eighth { angle + FRAC_PI_4 } else { angle };
        if steep { FRAC_PI_2 - angle } else { angle }
    }

    /// Arc tangent.
    #[inline(always)]
    #[must_use]
    pub fn atan(x: f32) -> f32 {
        (first_quarter(f64::from(x.abs()), 1.0) as f32).copysign(x)
    }

    /// The angle of the vector (`x`, `y`).
    #[inline(always)]
    #[must_use]
    pub fn atan2(y: f32, x: f32) -> f32 {
        let (up, along) = (f64::from(y.abs()), f64::from(x.abs()));
        // Of two infinities the angle is that of two ones.
        let both = (up == f64::INFINITY) & (along == f64::INFINITY);
        let angle = first_quarter(if both { 1.0 } else { up }, if both { 1.0 } else { along });
        let angle = if x.is_sign_negative() { PI - angle } else { angle };
        if x.is_nan() | y.is_nan() { f32::NAN } else { (angle as f32).copysign(y) }
    }

    /// 2 to a power of at most ±1000; NaN stays.
    #[inline(always)]
    fn power_of_two(x: f64) -> f64 {
        let sum = x + ROUNDER;
        let rest = x - (sum - ROUNDER);
        let fraction = polynomial(
            rest,
            [
                1.0,
                0.693_147_180_556_832_4,
                0.240_226_506_958_885_03,
                0.055_504_109_063_258_665,
                0.009_618_129_135_236_14,
                0.001_333_347_847_368_541_2,
                0.000_154_034_751_865_307_86,
                1.530_370_071_136_569_3e-5,
                1.325_080_551_750_225e-6,
            ],
        );
        fraction * f64::from_bits(sum.to_bits().wrapping_add(1023) << 52)
    }

    /// Within ± a limit; NaN stays.
    #[inline(always)]
    fn limited(x: f64, limit: f64) -> f64 {
        let x = if x < -limit { -limit } else { x };
        if limit < x { limit } else { x }
    }

    /// 2 to the power `x`.
    #[inline(always)]
    #[must_use]
    pub fn exp2(x: f32) -> f32 {
        power_of_two(limited(f64::from(x), 200.0)) as f32
    }

    /// e to the power `x`.
    #[inline(always)]
    #[must_use]
    pub fn exp(x: f32) -> f32 {
        power_of_two(limited(f64::from(x) * LOG2_E, 200.0)) as f32
    }

    /// sinh(x) / x − 1 over x², of a number of at most 1/2.
    #[inline(always)]
    fn small_sinh(x: f64) -> f64 {
        let z = x * x;
        let rest = polynomial(
            z,
            [
                0.166_666_666_665_899_7,
                0.008_333_333_431_502_386,
                0.000_198_410_735_562_165_72,
                2.768_285_616_945_226e-6,
            ],
        );
        x + x * z * rest
    }

    /// Hyperbolic sine and cosine of a number of at most ±200 in powers of two.
    #[inline(always)]
    fn sinh_and_cosh(x: f64) -> (f64, f64) {
        let power = power_of_two(limited(x * LOG2_E, 200.0));
        let inverse = 1.0 / power;
        let sinh = if x.abs() < 0.5 { small_sinh(x) } else { (power - inverse) * 0.5 };
        (sinh, (power + inverse) * 0.5)
    }

    /// Hyperbolic sine.
    #[inline(always)]
    #[must_use]
    pub fn sinh(x: f32) -> f32 {
        sinh_and_cosh(f64::from(x)).0 as f32
    }

    /// Hyperbolic cosine.
    #[inline(always)]
    #[must_use]
    pub fn cosh(x: f32) -> f32 {
        sinh_and_cosh(f64::from(x)).1 as f32
    }

    /// Hyperbolic tangent.
    #[inline(always)]
    #[must_use]
    pub fn tanh(x: f32) -> f32 {
        let (sinh, cosh) = sinh_and_cosh(f64::from(x));
        (sinh / cosh) as f32
    }

    /// The logarithm to base 2 of a positive normal number.
    #[inline(always)]
    fn binary_logarithm(x: f64) -> f64 {
        const ONE: u64 = 1023 << 52;
        const ROOT_HALF: u64 = 0x3fe6_a09e_667f_3bcd;
        const TWO_TO_52: f64 = 4_503_599_627_370_496.0;
        // The exponent, and the rest between √½ and √2.
        let exponent = x.to_bits().wrapping_add(ONE - ROOT_HALF) >> 52;
        let rest = f64::from_bits(x.to_bits().wrapping_sub(exponent << 52).wrapping_add(ONE));
        let exponent = f64::from_bits(exponent | TWO_TO_52.to_bits()) - (TWO_TO_52 + 1023.0);
        let t = (rest - 1.0) / (rest + 1.0);
        let z = t * t;
        let series = polynomial(
            z,
            [
                2.885_390_081_777_927,
                0.961_796_693_924_332_5,
                0.577_078_017_247_236,
                0.412_198_401_900_165_77,
                0.320_616_398_922_117_7,
                0.261_443_890_737_714_35,
                0.242_920_517_553_120_75,
            ],
        );
        exponent + t * series
    }

    /// A logarithm of a float, `scale` times that to base 2.
    #[inline(always)]
    fn logarithm(x: f32, scale: f64) -> f32 {
        let value = (binary_logarithm(f64::from(x)) * scale) as f32;
        let beyond = if x == 0.0 { f32::NEG_INFINITY } else { f32::NAN };
        let value = if x > 0.0 { value } else { beyond };
        if x == f32::INFINITY { x } else { value }
    }

    /// Logarithm to base 2.
    #[inline(always)]
    #[must_use]
    pub fn log2(x: f32) -> f32 {
        logarithm(x, 1.0)
    }

    /// Natural logarithm.
    #[inline(always)]
    #[must_use]
    pub fn ln(x: f32) -> f32 {
        logarithm(x, LN_2)
    }

    /// Logarithm to base 10.
    #[inline(always)]
    #[must_use]
    pub fn log10(x: f32) -> f32 {
        logarithm(x, LOG10_2)
    }

    /// `x` to the power `y`.
    #[inline(always)]
    #[must_use]
    pub fn pow(x: f32, y: f32) -> f32 {
        const TWO_TO_52: f64 = 4_503_599_627_370_496.0;
        let size = x.abs();
        let logarithm = binary_logarithm(f64::from(size));
        let logarithm = if size == 0.0 { f64::NEG_INFINITY } else { logarithm };
        let logarithm = if size == f32::INFINITY { f64::INFINITY } else { logarithm };
        let value = power_of_two(limited(f64::from(y) * logarithm, 200.0)) as f32;

        // Whether y is a whole number, and an odd one. Beyond 2²⁵ all are even.
        let exponent = f64::from(y.abs());
        let exponent = if exponent < 33_554_432.0 { exponent } else { 33_554_432.0 };
        let sum = exponent + TWO_TO_52;
        let is_whole = sum - TWO_TO_52 == exponent;
        let is_odd = is_whole & (sum.to_bits() & 1 == 1);

        let value = if x.is_sign_negative() & is_odd { -value } else { value };
        let value = if (x < 0.0) & (size < f32::INFINITY) & !is_whole { f32::NAN } else { value };
        let value = if x.is_nan() | y.is_nan() { f32::NAN } else { value };
        let is_one = (x == 1.0) | (y == 0.0) | ((x == -1.0) & (y.abs() == f32::INFINITY));
        if is_one { 1.0 } else { value }
    }

    /// Cube root: two of Halley's steps from an estimate of 5 bits (FreeBSD's `s_cbrtf.c`).
    #[inline(always)]
    #[must_use]
    pub fn cbrt(x: f32) -> f32 {
        let size = f64::from(x.abs());
        // A third of the upper word, as a product that is exact for 32 bits.
        let third = ((size.to_bits() >> 32).wrapping_mul(0xaaaa_aaab) >> 33).wrapping_add(715_094_163);
        let step = |t: f64| {
            let cube = t * t * t;
            t * ((size + size + cube) / (size + cube + cube))
        };
        let root = step(step(f64::from_bits(third << 32))) as f32;
        if (size > 0.0) & (size < f64::INFINITY) { root.copysign(x) } else { x }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The error in units in the last place.
    fn error(got: f32, wanted: f64) -> f64 {
        let nearest = wanted as f32;
        if got.is_nan() || wanted.is_nan() || got.is_infinite() || nearest.is_infinite() || nearest == 0.0 {
            let same = got == nearest && got.is_sign_negative() == nearest.is_sign_negative();
            return if same || (got.is_nan() && wanted.is_nan()) { 0.0 } else { f64::INFINITY };
        }
        let exponent = (wanted.abs().log2().floor() as i32).max(-126);
        ((f64::from(got) - wanted) / 2_f64.powi(exponent - 23)).abs()
    }

    /// Every float if `TUSCHE_EXHAUSTIVE` is set (some minutes), else one in 10,007.
    fn floats() -> impl Iterator<Item = f32> {
        let stride = if std::env::var_os("TUSCHE_EXHAUSTIVE").is_some() { 1 } else { 10_007 };
        (0..1_u64 << 32).step_by(stride).map(|bits| f32::from_bits(bits as u32))
    }

    #[test]
    fn results_are_the_nearest_floats_or_beside_them() {
        type Checked = (&'static str, fn(f32) -> f32, fn(f64) -> f64);
        let functions: [Checked; 15] = [
            ("sin", sin, libm::sin),
            ("cos", cos, libm::cos),
            ("tan", tan, libm::tan),
            ("asin", asin, libm::asin),
            ("acos", acos, libm::acos),
            ("atan", atan, libm::atan),
            ("sinh", sinh, libm::sinh),
            ("cosh", cosh, libm::cosh),
            ("tanh", tanh, libm::tanh),
            ("exp", exp, libm::exp),
            ("exp2", exp2, libm::exp2),
            ("ln", ln, libm::log),
            ("log2", log2, libm::log2),
            ("log10", log10, libm::log10),
            ("cbrt", cbrt, libm::cbrt),
        ];
        for (name, function, truth) in functions {
            let errors = floats().map(|x| (error(function(x), truth(f64::from(x))), x));
            let (worst, at) = errors.fold((0.0, 0.0), |a, b| if b.0 > a.0 { b } else { a });
            println!("{name}: {worst:.6} units in the last place, at {at:?}");
            assert!(worst <= 0.501, "{name}({at:?}) is {}, {worst} units off", function(at));
        }
    }

    #[test]
    fn powers_and_angles_are_the_nearest_floats_or_beside_them() {
        const SPECIAL: [f32; 25] = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::NAN,
            0.5,
            -0.5,
            2.0,
            -2.0,
            3.0,
            -3.0,
            1e-45,
            -1e-45,
            f32::MAX,
            f32::MIN,
            16_777_217.0,
            16_777_215.0,
            -16_777_215.0,
            8_388_607.5,
            4_194_303.5,
            -4_194_303.5,
            1e-30,
            -1e10,
        ];
        let mut state = 1_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 32) as u32
        };
        let mut pairs: Vec<_> = SPECIAL.iter().flat_map(|x| SPECIAL.iter().map(|y| (*x, *y))).collect();
        for _ in 0..100_000 {
            let (a, b) = (next(), next());
            let (x, y) = (f32::from_bits(a), f32::from_bits(b));
            let small = |bits: u32| bits as f32 / 4_294_967_296.0;
            let whole = (b % 41) as f32 - 20.0;
            pairs.extend([(x, y), (x, whole), (small(a) * 4.0, small(b) * 60.0 - 30.0), (x, small(b))]);
        }
        for (x, y) in pairs {
            let (a, b) = (f64::from(x), f64::from(y));
            let (power, angle) = (error(pow(x, y), libm::pow(a, b)), error(atan2(x, y), libm::atan2(a, b)));
            assert!(power <= 0.501, "pow({x:?}, {y:?}) is {:?}, but {:?}", pow(x, y), libm::pow(a, b));
            assert!(angle <= 0.501, "atan2({x:?}, {y:?}) is {:?}, but {:?}", atan2(x, y), libm::atan2(a, b));
        }
    }
}
