//! Vectors of eight numbers.

use std::ops::{Add, BitAnd, Div, Mul, Sub};

/// Numbers computed at once: a cache line, and a register of the widest processors.
pub(crate) const WIDTH: usize = 8;

/// Eight numbers with the same operations. Each number is rounded as if alone, so no lane changes a bit of another lane.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Lanes(pub(super) [f64; WIDTH]);

/// Mask of eight lanes: all bits of a lane are set, or none.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(align(64))]
pub(super) struct Mask([u64; WIDTH]);

impl Lanes {
    pub(super) const ZERO: Self = Self([0.0; WIDTH]);

    #[inline(always)]
    pub(super) fn splat(value: f64) -> Self {
        Self([value; WIDTH])
    }

    #[inline(always)]
    pub(super) fn abs(self) -> Self {
        Self(self.0.map(f64::abs))
    }

    /// Returns the smaller number in each lane.
    #[inline(always)]
    pub(super) fn smaller(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| smaller(self.0[i], other.0[i])))
    }

    /// Returns the larger number in each lane.
    #[inline(always)]
    pub(super) fn larger(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| larger(self.0[i], other.0[i])))
    }
}

/// Returns the smaller of two numbers; the second if both are equal or either is NaN. Compiles to one instruction, unlike [`f64::min`].
#[inline(always)]
pub(crate) fn smaller(one: f64, other: f64) -> f64 {
    // Written with an operator: `f64::min` treats NaN and signed zeros in further instructions.
    if one < other { one } else { other }
}

/// Returns the larger of two numbers; the second if both are equal or either is NaN.
#[inline(always)]
pub(crate) fn larger(one: f64, other: f64) -> f64 {
    if one > other { one } else { other }
}

impl Mask {
    pub(super) const NONE: Self = Self([0; WIDTH]);
    pub(super) const ALL: Self = Self([u64::MAX; WIDTH]);

    pub(super) fn set(&mut self, place: usize, holds: bool) {
        self.0[place] = if holds { u64::MAX } else { 0 };
    }

    pub(super) fn get(&self, place: usize) -> bool {
        self.0[place] != 0
    }

    /// Returns `number` if the mask holds in this lane, else +0.
    #[inline(always)]
    pub(super) fn keep(&self, lane: usize, number: f64) -> f64 {
        f64::from_bits(number.to_bits() & self.0[lane])
    }

    /// Returns the lanes of `yes` in the mask, and the lanes of `no` outside of the mask.
    #[inline(always)]
    pub(super) fn choose(self, yes: Lanes, no: Lanes) -> Lanes {
        // By bits instead of a branch, so NaN and the sign of zero pass unchanged.
        Lanes(std::array::from_fn(|i| f64::from_bits(yes.0[i].to_bits() & self.0[i] | no.0[i].to_bits() & !self.0[i])))
    }
}

/// Keeps the lanes in the mask, and sets all other lanes to +0.
impl BitAnd<Mask> for Lanes {
    type Output = Self;

    #[inline(always)]
    fn bitand(self, mask: Mask) -> Self {
        Self(std::array::from_fn(|i| f64::from_bits(self.0[i].to_bits() & mask.0[i])))
    }
}

macro_rules! each {
    ($operation:ident, $name:ident, $sign:tt) => {
        impl $operation for Lanes {
            type Output = Self;

            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Self(std::array::from_fn(|i| self.0[i] $sign other.0[i]))
            }
        }
    };
}
each!(Add, add, +);
each!(Sub, sub, -);
each!(Mul, mul, *);
each!(Div, div, /);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mask_takes_away_even_the_sign_of_zero() {
        let mut mask = Mask::NONE;
        mask.set(1, true);
        let masked = Lanes::splat(-0.0) & mask;
        assert_eq!((masked.0[0].to_bits(), masked.0[1].to_bits()), (0, (-0.0_f64).to_bits()));
        let chosen = mask.choose(Lanes::splat(1.0), Lanes::splat(2.0));
        assert_eq!((chosen.0[0], chosen.0[1], mask.get(0), mask.get(1)), (2.0, 1.0, false, true));
    }
}
