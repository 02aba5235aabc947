//! Batch forms of the library's heavy functions: sixteen lanes at once, the same bits as the scalar form.
//!
//! Each function is a loop over [`LANES`] lanes whose body has no branch and no call, so that the compiler turns it into
//! vector instructions. All are `inline(always)`: called from code that is compiled for wide vectors (`pulp`'s
//! `Arch::dispatch` of a [`pulp::WithSimd`], whose `with_simd` is `inline(always)` too; a closure may not be inlined),
//! they are as wide as that code. Only operations that IEEE 754 defines to the bit are used, and never a fused one, so a
//! result depends neither on the width nor on the CPU. The scalar forms define the meaning; tests compare the bits.

#[cfg(test)]
mod check;
pub mod noise;

/// Lanes of a block.
pub const LANES: usize = 16;

/// A block of one component.
pub type Lanes = [f32; LANES];
