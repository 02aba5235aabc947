//! The loops: one for each form of instruction, over blocks of rows.
//!
//! Only what cannot overlap is sure to become vector instructions, so every loop reads copies and writes a local array.

use super::super::ir::{
    Comparison, FloatBinaryLoop, FloatTernaryLoop, FloatUnaryLoop, IntBinaryLoop, IntCheckedLoop, LibraryFunction,
    LibraryLoop, MOST_ARGUMENTS,
};
use super::super::slice::Register;
use super::bank::{Bank, Block, LANES, View, mask};
use crate::shade::library::batch::noise as batch;

#[inline(always)]
pub(super) fn each<S: Copy, T: Copy + Default>(out: &mut [Block<T>], a: View<'_, S>, formula: impl Fn(S) -> T) {
    for (index, out) in out.iter_mut().enumerate() {
        // Only what cannot overlap is sure to become vector instructions: hence copies, here and below.
        let a = *a.block(index);
        let mut results = [T::default(); LANES];
        for lane in 0..LANES {
            results[lane] = formula(a[lane]);
        }
        out.0 = results;
    }
}

#[inline(always)]
pub(super) fn whole_blocks(
    out: &mut [Block<f32>],
    a: View<'_, f32>,
    function: impl Fn(&[f32; LANES], &mut [f32; LANES]),
) {
    for (index, out) in out.iter_mut().enumerate() {
        function(a.block(index), &mut out.0);
    }
}

#[inline(always)]
pub(super) fn compare<T: Copy>(
    out: &mut [Block<u32>],
    a: View<'_, T>,
    b: View<'_, T>,
    op: Comparison,
    formula: impl Fn(Comparison, T, T) -> bool,
) {
    use Comparison::{Equal, Greater, GreaterEqual, Less, LessEqual, NotEqual};
    let mut go = |op| Binary { out: &mut *out, a, b }.go(|a, b| mask(formula(op, a, b)));
    // One loop for each, without a choice inside.
    match op {
        Equal => go(Equal),
        NotEqual => go(NotEqual),
        Less => go(Less),
        LessEqual => go(LessEqual),
        Greater => go(Greater),
        GreaterEqual => go(GreaterEqual),
    }
}

#[inline(always)]
pub(super) fn select<T: Copy + Default>(out: &mut [Block<T>], mask: View<'_, u32>, a: View<'_, T>, b: View<'_, T>) {
    for (index, out) in out.iter_mut().enumerate() {
        let (mask, a, b) = (*mask.block(index), *a.block(index), *b.block(index));
        let mut results = [T::default(); LANES];
        for lane in 0..LANES {
            results[lane] = if mask[lane] != 0 { a[lane] } else { b[lane] };
        }
        out.0 = results;
    }
}

pub(super) struct Unary<'a> {
    pub(super) out: &'a mut [Block<f32>],
    pub(super) a: View<'a, f32>,
}

impl FloatUnaryLoop for Unary<'_> {
    #[inline(always)]
    fn run(self, formula: impl Fn(f32) -> f32) {
        each(self.out, self.a, formula);
    }
}

pub(super) struct Binary<'a, T, R> {
    pub(super) out: &'a mut [Block<R>],
    pub(super) a: View<'a, T>,
    pub(super) b: View<'a, T>,
}

impl<T: Copy, R: Copy + Default> Binary<'_, T, R> {
    #[inline(always)]
    pub(super) fn go(self, formula: impl Fn(T, T) -> R) {
        for (index, out) in self.out.iter_mut().enumerate() {
            let (a, b) = (*self.a.block(index), *self.b.block(index));
            let mut results = [R::default(); LANES];
            for lane in 0..LANES {
                results[lane] = formula(a[lane], b[lane]);
            }
            out.0 = results;
        }
    }
}

impl FloatBinaryLoop for Binary<'_, f32, f32> {
    #[inline(always)]
    fn run(self, formula: impl Fn(f32, f32) -> f32) {
        self.go(formula);
    }
}

impl IntBinaryLoop for Binary<'_, i64, i64> {
    #[inline(always)]
    fn run(self, formula: impl Fn(i64, i64) -> i64) {
        self.go(formula);
    }
}

pub(super) struct Ternary<'a> {
    pub(super) out: &'a mut [Block<f32>],
    pub(super) a: View<'a, f32>,
    pub(super) b: View<'a, f32>,
    pub(super) c: View<'a, f32>,
}

impl FloatTernaryLoop for Ternary<'_> {
    #[inline(always)]
    fn run(self, formula: impl Fn(f32, f32, f32) -> f32) {
        for (index, out) in self.out.iter_mut().enumerate() {
            let (a, b, c) = (*self.a.block(index), *self.b.block(index), *self.c.block(index));
            let mut results = [0.0; LANES];
            for lane in 0..LANES {
                results[lane] = formula(a[lane], b[lane], c[lane]);
            }
            out.0 = results;
        }
    }
}

pub(super) struct Rows<'a> {
    pub(super) outs: &'a mut [Vec<Block<f32>>],
    pub(super) operands: &'a [Register],
    pub(super) floats: &'a Bank<f32>,
    pub(super) blocks: usize,
}

impl Rows<'_> {
    /// Runs functions that have batch forms of their own; the others are left.
    #[inline(always)]
    pub(super) fn whole_blocks(&mut self, function: LibraryFunction) -> bool {
        let view = |operand: usize| self.floats.view(self.operands[operand]);
        match function {
            LibraryFunction::Worley2 | LibraryFunction::Worley3 => {
                for index in 0..self.blocks {
                    let (x, y) = (view(0).block(index), view(1).block(index));
                    let mut results = [[0.0; LANES]; 2];
                    match function {
                        LibraryFunction::Worley2 => batch::worley_2d(x, y, &mut results),
                        _ => batch::worley_3d(x, y, view(2).block(index), &mut results),
                    }
                    for (out, result) in self.outs.iter_mut().zip(results) {
                        out[index].0 = result;
                    }
                }
                true
            }
            LibraryFunction::Layered2(octaves) if view(2).uniform && view(3).uniform => {
                let (lacunarity, gain) = (view(2).row(0), view(3).row(0));
                for index in 0..self.blocks {
                    let (x, y) = (view(0).block(index), view(1).block(index));
                    batch::layered_2d(x, y, octaves.into(), lacunarity, gain, &mut self.outs[0][index].0);
                }
                true
            }
            LibraryFunction::Layered3(octaves) if view(3).uniform && view(4).uniform => {
                let (lacunarity, gain) = (view(3).row(0), view(4).row(0));
                for index in 0..self.blocks {
                    let (x, y, z) = (view(0).block(index), view(1).block(index), view(2).block(index));
                    batch::layered_3d(x, y, z, octaves.into(), lacunarity, gain, &mut self.outs[0][index].0);
                }
                true
            }
            _ => false,
        }
    }
}

impl LibraryLoop for Rows<'_> {
    #[inline(always)]
    fn run(self, formula: impl Fn([f32; MOST_ARGUMENTS]) -> [f32; 4]) {
        for index in 0..self.blocks {
            let mut arguments = [[0.0; LANES]; MOST_ARGUMENTS];
            for (argument, operand) in arguments.iter_mut().zip(self.operands) {
                *argument = *self.floats.view(*operand).block(index);
            }
            let mut results = [[0.0; LANES]; 4];
            let [a, b, c, d, e, f, g, h] = &arguments;
            for lane in 0..LANES {
                let given = formula([a[lane], b[lane], c[lane], d[lane], e[lane], f[lane], g[lane], h[lane]]);
                [results[0][lane], results[1][lane], results[2][lane], results[3][lane]] = given;
            }
            for (out, result) in self.outs.iter_mut().zip(results) {
                out[index].0 = result;
            }
        }
    }
}

pub(super) struct Checked<'a> {
    pub(super) out: &'a mut [Block<i64>],
    pub(super) a: View<'a, i64>,
    pub(super) b: View<'a, i64>,
    pub(super) mask: View<'a, u32>,
    pub(super) failed: &'a mut [Block<u32>],
}

impl IntCheckedLoop for Checked<'_> {
    #[inline(always)]
    fn run(self, formula: impl Fn(i64, i64) -> Option<i64>) {
        for ((index, out), failed) in self.out.iter_mut().enumerate().zip(self.failed) {
            let (a, b, mask) = (self.a.block(index), self.b.block(index), self.mask.block(index));
            for lane in 0..LANES {
                let result = formula(a[lane], b[lane]);
                out.0[lane] = result.unwrap_or_default();
                failed.0[lane] |= if result.is_none() { mask[lane] } else { 0 };
            }
        }
    }
}
