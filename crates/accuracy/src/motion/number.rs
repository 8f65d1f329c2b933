//! Number types of the loop: doubles as in the program, and numbers of twice the digits for the reference.

use std::ops::{Div, Mul, Sub};

use qd::Quad;

/// A number of the loop with comparison, division and rounding.
pub(crate) trait Number: cohaptic_peer::Number + PartialOrd + Div<Output = Self> {
    /// Returns the nearest double.
    fn rounded(self) -> f64;
}

impl Number for f64 {
    #[inline(always)]
    fn rounded(self) -> f64 {
        self
    }
}

/// The unevaluated sum of two doubles, with at least 100 bits.
impl Number for Quad {
    fn rounded(self) -> f64 {
        self.0
    }
}

/// Returns the absolute value.
pub(crate) fn absolute<T: Number>(value: T) -> T {
    if value < T::of(0.0) { -value } else { value }
}

/// A complex number.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Complex<T> {
    pub(crate) re: T,
    pub(crate) im: T,
}

impl<T: Number> Complex<T> {
    pub(crate) fn real(re: T) -> Self {
        Self { re, im: T::of(0.0) }
    }

    pub(crate) fn norm_squared(self) -> T {
        self.re * self.re + self.im * self.im
    }
}

impl<T: Number> Sub for Complex<T> {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self { re: self.re - other.re, im: self.im - other.im }
    }
}

impl<T: Number> Mul for Complex<T> {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        Self { re: self.re * other.re - self.im * other.im, im: self.re * other.im + self.im * other.re }
    }
}

impl<T: Number> Div for Complex<T> {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        let divisor = other.norm_squared();
        // Multiplication by the conjugate makes the divisor real.
        let Self { re, im } = self * Self { re: other.re, im: -other.im };
        Self { re: re / divisor, im: im / divisor }
    }
}
