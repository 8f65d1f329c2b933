//! Numbers for rotations.

use crate::Number;

/// Square of an angle [rad²] below which both functions of [`Real::half_turn`] are series. Seven terms leave an error below 2⁻⁶⁴.
const SERIES_BELOW: f64 = 0.25;

/// A number with a reciprocal and the functions of a half angle. A vector of numbers applies them element by element.
pub trait Real: Number {
    /// Returns 1/x.
    #[must_use]
    fn recip(self) -> Self;

    /// Returns cos(½a) and sin(½a)/a, where `square` = a² is the square of an angle \[rad²\].
    #[must_use]
    fn half_turn(square: Self) -> (Self, Self);
}

impl Real for f64 {
    fn recip(self) -> Self {
        1.0 / self
    }

    #[inline(always)]
    fn half_turn(square: Self) -> (Self, Self) {
        if square < SERIES_BELOW { series(square) } else { closed(square) }
    }
}

/// Returns the series with z = −a²/4: cos(½a) = Σ zᵏ/(2k)! and sin(½a)/a = ½·Σ zᵏ/(2k + 1)!.
#[inline(always)]
fn series(square: f64) -> (f64, f64) {
    let z = -0.25 * square;
    let nested = |factors: [f64; 6]| factors.into_iter().fold(1.0, |sum, factor| 1.0 + z * sum / factor);
    // Factors (2k − 1)·2k and 2k·(2k + 1), the last term first.
    (nested([132.0, 90.0, 56.0, 30.0, 12.0, 2.0]), 0.5 * nested([156.0, 110.0, 72.0, 42.0, 20.0, 6.0]))
}

/// Returns the closed form, for angles above the limit of the series.
#[inline(never)]
fn closed(square: f64) -> (f64, f64) {
    let angle = libm::sqrt(square);
    let (sine, cosine) = libm::sincos(0.5 * angle);
    (cosine, sine / angle)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn series_and_closed_form_are_one_function() {
        for angle in [1e-9, 1e-3, 0.1, 0.3, 0.499] {
            let (square, half) = (angle * angle, 0.5 * angle);
            let (cosine, sine) = series(square);
            // The square and the root round the angle twice.
            assert!((cosine - libm::cos(half)).abs() <= 4.0 * f64::EPSILON, "{angle}");
            assert!((sine * angle - libm::sin(half)).abs() <= 4.0 * f64::EPSILON * half, "{angle}");
        }
        assert_eq!(f64::half_turn(0.0), (1.0, 0.5));
    }
}
