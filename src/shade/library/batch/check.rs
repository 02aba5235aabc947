//! Checks of batch forms against scalar forms, bit by bit, at every vector width of this CPU.

use super::{LANES, Lanes};

/// Numbers that look random, the same in every run (Steele's SplitMix64).
pub struct Numbers(u64);

impl Numbers {
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub fn below(&mut self, end: u64) -> u64 {
        ((self.bits() >> 32) * end) >> 32
    }

    /// Any float: special ones, whole ones and halves, ordinary ones, ones of any size.
    pub fn any(&mut self) -> f32 {
        const SPECIAL: [f32; 18] = [
            0.0,
            -0.0,
            1e-45,
            -1e-45,
            1.0,
            -1.0,
            1e-38,
            -1e-38,
            1e-7,
            -1e-9,
            f32::NAN,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::MAX,
            f32::MIN,
            0.999_999_94,
            -0.999_999_94,
            1_048_576.0,
        ];
        match self.below(8) {
            0 => f32::from_bits(self.bits() as u32),
            1 => SPECIAL[self.below(SPECIAL.len() as u64) as usize],
            2 => self.below(17) as f32 * 0.5 - 4.0,
            3 => self.within(1.0),
            _ => self.within(40.0),
        }
    }

    /// From −`size` to `size`.
    pub fn within(&mut self, size: f32) -> f32 {
        (self.bits() as u32 as f32 / 4_294_967_296.0 * 2.0 - 1.0) * size
    }
}

struct Blocks<'a, F, const N: usize, const M: usize>(F, &'a [[Lanes; N]], &'a mut [[Lanes; M]]);

impl<F: Fn(&[Lanes; N], &mut [Lanes; M]), const N: usize, const M: usize> pulp::WithSimd for Blocks<'_, F, N, M> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        for (given, out) in self.1.iter().zip(self.2) {
            (self.0)(given, out);
        }
    }
}

/// All widths that this CPU can do.
pub fn widths() -> Vec<pulp::Arch> {
    let mut widths = vec![pulp::Arch::Scalar, pulp::Arch::new()];
    #[cfg(target_arch = "x86_64")]
    widths.extend(pulp::x86::V3::try_new().map(pulp::Arch::V3));
    widths
}

/// Compares both forms of a function with `N` components of arguments and `M` of results, at about `count` places.
pub fn same_bits<const N: usize, const M: usize>(
    name: &str,
    count: usize,
    mut next: impl FnMut() -> [f32; N],
    scalar: impl Fn([f32; N]) -> [f32; M],
    batch: impl Fn(&[Lanes; N], &mut [Lanes; M]) + Copy,
) {
    const BLOCKS: usize = 64;
    for _ in 0..count.div_ceil(BLOCKS * LANES) {
        let mut given = [[[0.0; LANES]; N]; BLOCKS];
        for block in &mut given {
            for lane in 0..LANES {
                for (column, value) in block.iter_mut().zip(next()) {
                    column[lane] = value;
                }
            }
        }
        for width in widths() {
            let mut out = [[[0.0; LANES]; M]; BLOCKS];
            width.dispatch(Blocks(batch, &given, &mut out));
            for (given, out) in given.iter().zip(&out) {
                for lane in 0..LANES {
                    let arguments: [f32; N] = std::array::from_fn(|component| given[component][lane]);
                    let got: [f32; M] = std::array::from_fn(|component| out[component][lane]);
                    let wanted = scalar(arguments);
                    assert_eq!(
                        wanted.map(f32::to_bits),
                        got.map(f32::to_bits),
                        "{name}{arguments:?} is {wanted:?}, but {got:?} in a batch, {width:?}"
                    );
                }
            }
        }
    }
}
