//! Numbers that the loop can be run in: those of the program, and those with twice the digits that it is set against.

use std::ops::{Div, Mul, Sub};

use qd::Quad;

/// A number of the loop that is compared, divided and rounded.
pub(crate) trait Number: cohaptic_peer::Number + PartialOrd + Div<Output = Self> {
    /// The nearest number of the program.
    fn rounded(self) -> f64;
}

impl Number for f64 {
    #[inline(always)]
    fn rounded(self) -> f64 {
        self
    }
}

/// The unevaluated sum of two numbers of the program: at least 100 bits.
impl Number for Quad {
    fn rounded(self) -> f64 {
        self.0
    }
}

/// The absolute value.
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
        let Self { re, im } = self * Self { re: other.re, im: -other.im };
        Self { re: re / divisor, im: im / divisor }
    }
}
