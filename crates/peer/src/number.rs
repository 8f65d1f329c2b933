//! The numbers in which the tick of a peer is computed.

use core::ops::{Add, Mul, Neg, Sub};

/// A number that a position, a velocity, a force or a coefficient can be: an element of a ring.
///
/// The equations of a tick are written once, for any such number. Eight peers at once, or the columns of a linear response, are a loop over `f64`: the
/// compiler turns it into vector instructions, and each number is rounded as it would be alone. A number with more digits, or one that carries its
/// derivatives, is another implementation.
pub trait Number: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self> {
    /// A number of binary64, exactly.
    fn of(value: f64) -> Self;
}

/// At least 100 bits.
#[cfg(feature = "qd")]
impl Number for qd::Quad {
    fn of(value: f64) -> Self {
        Self::from_f64(value)
    }
}

impl Number for f64 {
    #[inline(always)]
    fn of(value: f64) -> Self {
        value
    }
}
