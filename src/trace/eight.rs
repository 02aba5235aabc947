//! Eight numbers side by side, in the widest instructions that the machine has.
//!
//! Loops over arrays leave it to the compiler to find these instructions. Where eight comparisons become eight bits it does not,
//! and the box test, which is little else, took twice as long. So these few operations are named: by [`pulp`] where there are
//! AVX2 or AVX-512, by two [`Vec4`] elsewhere. All give the same bits.

use crate::math::Vec4;

/// Numbers side by side.
pub const WIDTH: usize = 8;

/// Operations on eight numbers, none of which may be NaN.
pub trait Eights: Copy {
    /// Eight numbers.
    type Eight: Copy;

    /// The same number eight times.
    fn splat(self, value: f32) -> Self::Eight;
    /// Numbers from memory.
    fn load(self, values: &[f32; WIDTH]) -> Self::Eight;
    /// Numbers to memory.
    fn store(self, values: Self::Eight) -> [f32; WIDTH];
    /// a − b.
    fn sub(self, a: Self::Eight, b: Self::Eight) -> Self::Eight;
    /// a · b.
    fn mul(self, a: Self::Eight, b: Self::Eight) -> Self::Eight;
    /// The smaller of both.
    fn min(self, a: Self::Eight, b: Self::Eight) -> Self::Eight;
    /// The larger of both.
    fn max(self, a: Self::Eight, b: Self::Eight) -> Self::Eight;
    /// A bit for each a ≤ b, that of the first number lowest.
    fn at_most(self, a: Self::Eight, b: Self::Eight) -> u32;
}

/// Work that is compiled for several sets of instructions. What it calls must be `#[inline(always)]`, or it is compiled for the
/// least of them.
pub trait Task {
    /// What comes of it.
    type Output;

    /// Does it.
    fn run<E: Eights>(self, eights: E) -> Self::Output;
}

/// Does a task with the instructions of a machine.
#[inline(always)]
pub fn dispatch<T: Task>(arch: pulp::Arch, task: T) -> T::Output {
    match arch {
        #[cfg(target_arch = "x86_64")]
        pulp::Arch::V4(simd) => pulp::Simd::vectorize(simd, With { task, eights: *simd }),
        #[cfg(target_arch = "x86_64")]
        pulp::Arch::V3(simd) => pulp::Simd::vectorize(simd, With { task, eights: simd }),
        other => other.dispatch(With { task, eights: Pairs }),
    }
}

struct With<T, E> {
    task: T,
    eights: E,
}

impl<T: Task, E: Eights> pulp::WithSimd for With<T, E> {
    type Output = T::Output;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> T::Output {
        self.task.run(self.eights)
    }
}

#[cfg(target_arch = "x86_64")]
impl Eights for pulp::x86::V3 {
    type Eight = pulp::f32x8;

    #[inline(always)]
    fn splat(self, value: f32) -> Self::Eight {
        self.splat_f32x8(value)
    }

    #[inline(always)]
    fn load(self, values: &[f32; WIDTH]) -> Self::Eight {
        pulp::cast(*values)
    }

    #[inline(always)]
    fn store(self, values: Self::Eight) -> [f32; WIDTH] {
        pulp::cast(values)
    }

    #[inline(always)]
    fn sub(self, a: Self::Eight, b: Self::Eight) -> Self::Eight {
        pulp::cast(self.avx._mm256_sub_ps(pulp::cast(a), pulp::cast(b)))
    }

    #[inline(always)]
    fn mul(self, a: Self::Eight, b: Self::Eight) -> Self::Eight {
        pulp::cast(self.avx._mm256_mul_ps(pulp::cast(a), pulp::cast(b)))
    }

    #[inline(always)]
    fn min(self, a: Self::Eight, b: Self::Eight) -> Self::Eight {
        pulp::cast(self.avx._mm256_min_ps(pulp::cast(a), pulp::cast(b)))
    }

    #[inline(always)]
    fn max(self, a: Self::Eight, b: Self::Eight) -> Self::Eight {
        pulp::cast(self.avx._mm256_max_ps(pulp::cast(a), pulp::cast(b)))
    }

    #[inline(always)]
    fn at_most(self, a: Self::Eight, b: Self::Eight) -> u32 {
        self.avx._mm256_movemask_ps(pulp::cast(self.cmp_le_f32x8(a, b))) as u32
    }
}

/// Two times four numbers, where there is nothing wider.
#[derive(Clone, Copy)]
pub struct Pairs;

impl Eights for Pairs {
    type Eight = [Vec4; 2];

    #[inline(always)]
    fn splat(self, value: f32) -> Self::Eight {
        [Vec4::splat(value); 2]
    }

    #[inline(always)]
    fn load(self, [a, b, c, d, e, f, g, h]: &[f32; WIDTH]) -> Self::Eight {
        [Vec4::new(*a, *b, *c, *d), Vec4::new(*e, *f, *g, *h)]
    }

    #[inline(always)]
    fn store(self, [low, high]: Self::Eight) -> [f32; WIDTH] {
        let ([a, b, c, d], [e, f, g, h]) = (low.to_array(), high.to_array());
        [a, b, c, d, e, f, g, h]
    }

    #[inline(always)]
    fn sub(self, a: Self::Eight, b: Self::Eight) -> Self::Eight {
        [a[0] - b[0], a[1] - b[1]]
    }

    #[inline(always)]
    fn mul(self, a: Self::Eight, b: Self::Eight) -> Self::Eight {
        [a[0] * b[0], a[1] * b[1]]
    }

    #[inline(always)]
    fn min(self, a: Self::Eight, b: Self::Eight) -> Self::Eight {
        [a[0].min(b[0]), a[1].min(b[1])]
    }

    #[inline(always)]
    fn max(self, a: Self::Eight, b: Self::Eight) -> Self::Eight {
        [a[0].max(b[0]), a[1].max(b[1])]
    }

    #[inline(always)]
    fn at_most(self, a: Self::Eight, b: Self::Eight) -> u32 {
        a[0].cmple(b[0]).bitmask() | a[1].cmple(b[1]).bitmask() << 4
    }
}
