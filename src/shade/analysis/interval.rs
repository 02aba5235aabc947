//! Bounds of floats.
//!
//! An [`Interval`] bounds what an `f32` of a running script can be. Bounds are sound under rounding: IEEE operations
//! are monotone, so the bounds of a sum or a product are computed with the very same `f32` operations; whatever is not
//! correctly rounded is widened outwards. NaN is tracked apart, as a flag.
//!
//! −0 lies below +0: a zero whose sign is not known is no known value, for a division by it can tell the two apart. So
//! bounds that come out as a zero are taken as both zeros, unless all operands are known to the bit.

/// What a float can be: within `low` … `high`, or NaN if `nan`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Interval {
    /// Least value, never NaN.
    pub low: f32,
    /// Greatest value, never NaN, at least `low`.
    pub high: f32,
    /// Whether NaN is possible.
    pub nan: bool,
}

impl PartialEq for Interval {
    fn eq(&self, other: &Self) -> bool {
        let bits = |x: &Self| (x.low.to_bits(), x.high.to_bits(), x.nan);
        bits(self) == bits(other)
    }
}

/// Relative error that no reasonable order of a few `f32` operations exceeds.
const SLACK: f64 = 1e-6;

impl Interval {
    /// Anything, NaN included.
    pub const ANY: Self = Self { low: f32::NEG_INFINITY, high: f32::INFINITY, nan: true };
    /// 0 … 1.
    pub const UNIT: Self = Self::new(0.0, 1.0);
    /// A component of a unit vector, with room for the rounding of its normalization.
    pub const UNIT_COMPONENT: Self = Self::within(1.000_001);

    /// Between two numbers, with zeros of either sign.
    pub const fn new(low: f32, high: f32) -> Self {
        let low = if low == 0.0 { -0.0 } else { low };
        let high = if high == 0.0 { 0.0 } else { high };
        Self { low, high, nan: false }
    }

    /// Exactly one number, to the bit.
    pub const fn exact(x: f32) -> Self {
        if x.is_nan() { Self::ANY } else { Self { low: x, high: x, nan: false } }
    }

    /// From −`size` to `size`.
    pub const fn within(size: f32) -> Self {
        Self::new(-size, size)
    }

    /// Between two results of which NaN means that nothing is known, and then is possible.
    fn between(low: f32, high: f32) -> Self {
        let bounds = Self::new(
            if low.is_nan() { f32::NEG_INFINITY } else { low },
            if high.is_nan() { f32::INFINITY } else { high },
        );
        bounds.or_nan(low.is_nan() || high.is_nan())
    }

    /// The value, if only one is possible.
    pub fn value(self) -> Option<f32> {
        (self.low.to_bits() == self.high.to_bits() && !self.nan).then_some(self.low)
    }

    /// The result of an operation on values that are both known.
    fn known(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Option<Self> {
        Some(Self::exact(f(self.value()?, other.value()?)))
    }

    /// Whether zero is possible.
    pub fn has_zero(self) -> bool {
        self.low <= 0.0 && self.high >= 0.0
    }

    fn has_infinity(self) -> bool {
        self.low == f32::NEG_INFINITY || self.high == f32::INFINITY
    }

    /// Whether every possible value is a finite number.
    pub fn is_finite(self) -> bool {
        !self.nan && !self.has_infinity()
    }

    /// The same, with NaN possible if `nan`.
    pub fn or_nan(self, nan: bool) -> Self {
        Self { nan: self.nan || nan, ..self }
    }

    /// All that either can be.
    pub fn hull(self, other: Self) -> Self {
        let low = if other.low.total_cmp(&self.low).is_lt() { other.low } else { self.low };
        let high = if other.high.total_cmp(&self.high).is_gt() { other.high } else { self.high };
        Self { low, high, nan: self.nan || other.nan }
    }

    /// What both bounds allow: for two sound bounds of one value.
    pub fn meet(self, other: Self) -> Self {
        let (low, high) = (self.low.max(other.low), self.high.min(other.high));
        // Disjoint bounds mean that no number is possible; any of the two is then sound.
        if low <= high { Self::new(low, high).or_nan(self.nan && other.nan) } else { self }
    }

    /// Bounds moved outwards by the rounding errors of a few operations on values of that size.
    pub fn widened(self, size: f32) -> Self {
        if size == 0.0 {
            return self;
        }
        if size == f32::INFINITY {
            return Self { nan: self.nan, ..Self::ANY };
        }
        let slack = f64::from(size) * SLACK;
        let low = (f64::from(self.low) - slack) as f32;
        let high = (f64::from(self.high) + slack) as f32;
        Self::new(low.next_down(), high.next_up()).or_nan(self.nan)
    }

    /// The greatest magnitude.
    pub fn size(self) -> f32 {
        self.low.abs().max(self.high.abs())
    }

    /// A function that never falls and is computed by the very `f32` operations of `f`.
    pub fn rising(self, f: impl Fn(f32) -> f32) -> Self {
        match self.value() {
            Some(x) => Self::exact(f(x)),
            None => Self::between(f(self.low), f(self.high)).or_nan(self.nan),
        }
    }

    /// A function that never falls and is computed with small errors; `f` is (nearly) exact.
    pub fn rising_roughly(self, f: impl Fn(f64) -> f64) -> Self {
        outwards(f(f64::from(self.low)), f(f64::from(self.high))).or_nan(self.nan)
    }

    pub fn neg(self) -> Self {
        Self { low: -self.high, high: -self.low, nan: self.nan }
    }

    pub fn add(self, other: Self) -> Self {
        let opposite = |a: Self, b: Self| a.high == f32::INFINITY && b.low == f32::NEG_INFINITY;
        self.known(other, |a, b| a + b).unwrap_or_else(|| {
            let nan = self.nan || other.nan || opposite(self, other) || opposite(other, self);
            Self::between(self.low + other.low, self.high + other.high).or_nan(nan)
        })
    }

    pub fn sub(self, other: Self) -> Self {
        self.add(other.neg())
    }

    pub fn mul(self, other: Self) -> Self {
        let zero_times_infinity = |a: Self, b: Self| a.has_zero() && b.has_infinity();
        self.known(other, |a, b| a * b).unwrap_or_else(|| {
            let nan = zero_times_infinity(self, other) || zero_times_infinity(other, self);
            self.corners(other, |a, b| a * b).or_nan(nan)
        })
    }

    /// Without bounds if the divisor can be zero.
    pub fn div(self, other: Self) -> Self {
        if other.has_zero() {
            return self.known(other, |a, b| a / b).unwrap_or(Self::ANY);
        }
        self.known(other, |a, b| a / b)
            .unwrap_or_else(|| self.corners(other, |a, b| a / b).or_nan(self.has_infinity() && other.has_infinity()))
    }

    /// The remainder with the sign of the dividend, as `%`.
    pub fn rem(self, other: Self) -> Self {
        self.known(other, |a, b| a % b).unwrap_or_else(|| {
            let size = self.size().min(other.size());
            let low = if self.low < 0.0 { -size } else { 0.0 };
            let high = if self.high > 0.0 { size } else { 0.0 };
            let nan = self.nan || other.nan || other.has_zero() || self.has_infinity();
            Self::new(low, high).or_nan(nan)
        })
    }

    /// The hull of an operation that is monotone in each operand. What is not a number at a corner (0 · ∞) is next to
    /// zero there.
    fn corners(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        let at = |a, b| {
            let x = f(a, b);
            if x.is_nan() { Self::new(0.0, 0.0) } else { Self::new(x, x) }
        };
        at(self.low, other.low)
            .hull(at(self.low, other.high))
            .hull(at(self.high, other.low))
            .hull(at(self.high, other.high))
            .or_nan(self.nan || other.nan)
    }

    pub fn abs(self) -> Self {
        if let Some(x) = self.value() {
            Self::exact(x.abs())
        } else if self.low >= 0.0 {
            self
        } else if self.high <= 0.0 {
            self.neg()
        } else {
            Self::new(0.0, self.size()).or_nan(self.nan)
        }
    }

    /// The lesser of two. Which operand is seen beside a NaN differs between functions, so both are allowed for.
    pub fn min(self, other: Self) -> Self {
        let least = |a: f32, b: f32| if b < a { b } else { a };
        self.known(other, least)
            .unwrap_or_else(|| Self::new(self.low.min(other.low), self.high.min(other.high)).beside_nan(self, other))
    }

    /// The greater of two; see [`Self::min`].
    pub fn max(self, other: Self) -> Self {
        let greatest = |a: f32, b: f32| if a < b { b } else { a };
        self.known(other, greatest)
            .unwrap_or_else(|| Self::new(self.low.max(other.low), self.high.max(other.high)).beside_nan(self, other))
    }

    fn beside_nan(self, a: Self, b: Self) -> Self {
        let result = if a.nan { self.hull(b) } else { self };
        if b.nan { result.hull(a).or_nan(true) } else { result.or_nan(a.nan) }
    }

    /// `min(max(self, low), high)`.
    pub fn clamp(self, low: Self, high: Self) -> Self {
        self.max(low).min(high)
    }

    pub fn sqrt(self) -> Self {
        match self.value() {
            Some(x) => Self::exact(x.sqrt()),
            None => {
                let nan = self.nan || self.low < 0.0;
                Self::new(self.low.max(0.0).sqrt(), self.high.max(0.0).sqrt()).or_nan(nan)
            }
        }
    }

    /// `self` to the power `exponent`. Negative bases have bounds only for whole constant exponents.
    pub fn pow(self, exponent: Self) -> Self {
        if self.low < 0.0 {
            let Some(n) = exponent.value().filter(|n| n.fract() == 0.0 && *n >= 1.0 && *n < 1e6) else {
                return Self::ANY;
            };
            if n % 2.0 == 0.0 {
                return self.abs().pow(exponent);
            }
            return self.rising_roughly(|x| x.powf(f64::from(n)));
        }
        // x^y is monotone in x, and monotone in y for each x, so the corners bound it.
        let at = |x: f32, y: f32| f64::from(x.abs()).powf(f64::from(y));
        let corners = [
            at(self.low, exponent.low),
            at(self.low, exponent.high),
            at(self.high, exponent.low),
            at(self.high, exponent.high),
        ];
        let low = corners.iter().copied().fold(f64::INFINITY, f64::min);
        let high = corners.iter().copied().fold(0.0, f64::max);
        // A negative zero has negative odd powers.
        let low_bound = if self.low == 0.0 && exponent.low < 0.0 { f64::NEG_INFINITY } else { low };
        let bounds = outwards(low_bound, high);
        let low = if low_bound < 0.0 { bounds.low } else { bounds.low.max(0.0) };
        Self::new(low, bounds.high).or_nan(self.nan || exponent.nan)
    }

    /// `self * (1 - t) + other * t`.
    pub fn mix(self, other: Self, t: Self) -> Self {
        let weighted = self.mul(Self::exact(1.0).sub(t)).add(other.mul(t));
        let is_mean = t.low >= 0.0 && t.high <= 1.0 && self.is_finite() && other.is_finite() && !t.nan;
        if is_mean && weighted.value().is_none() {
            // A mean lies between its terms, up to rounding.
            let between = self.hull(other);
            return between.widened(between.size()).meet(weighted);
        }
        weighted
    }
}

/// The interval from `low` to `high`, a little widened; NaN bounds are no bounds.
fn outwards(low: f64, high: f64) -> Interval {
    let low = if low.is_infinite() { low } else { low - low.abs() * SLACK };
    let high = if high.is_infinite() { high } else { high + high.abs() * SLACK };
    Interval::between((low as f32).next_down(), (high as f32).next_up())
}
