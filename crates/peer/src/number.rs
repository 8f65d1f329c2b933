//! Numbers in which the tick of a peer is computed.
//!
//! Most functions that are generic over [`Number`] are `#[inline(always)]`: a caller may compile a tick of eight peers for wider instructions than those of
//! its build, and a function that is not inlined there is compiled without these instructions.

use core::ops::{Add, Mul, Neg, Sub};

/// A number for positions, velocities, forces and coefficients: an element of a ring.
///
/// The equations of a tick are written once, for any `Number`. Eight peers at once, or the columns of a linear response, are a loop over `f64`: the compiler
/// vectorises the loop, and each element is rounded as a single `f64` would be. A number with more digits, or with derivatives, is another implementation.
pub trait Number: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self> {
    /// Converts a binary64 number, exactly.
    fn of(value: f64) -> Self;
}

/// Double-double arithmetic with at least 100 bits.
#[cfg(feature = "qd")]
impl Number for qd::Quad {
    fn of(value: f64) -> Self {
        Self::from_f64(value)
    }
}

impl Number for f64 {
    fn of(value: f64) -> Self {
        value
    }
}
