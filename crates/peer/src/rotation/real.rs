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

/// Returns [`Real::half_turn`] of each element, equal to the bit. If all angles are below half a radian, no element needs a branch.
#[must_use]
#[inline(always)]
pub fn half_turns<const W: usize>(squares: &[f64; W]) -> ([f64; W], [f64; W]) {
    let (mut cosines, mut sines) = ([0.0; W], [0.0; W]);
    let mut all_below = true;
    for place in 0..W {
        (cosines[place], sines[place]) = series(squares[place]);
        all_below &= squares[place] < SERIES_BELOW;
    }
    // One large angle sends all elements through the scalar function, which uses the same series below the limit.
    if !all_below {
        for place in 0..W {
            (cosines[place], sines[place]) = f64::half_turn(squares[place]);
        }
    }
    (cosines, sines)
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
    fn many_half_turns_are_those_of_each() {
        for squares in [[0.0, 0.1, 0.249], [0.1, 0.25, 7.0], [f64::NAN, f64::INFINITY, 1e-300]] {
            let (cosines, sines) = half_turns(&squares);
            for (place, square) in squares.into_iter().enumerate() {
                let (cosine, sine) = f64::half_turn(square);
                assert_eq!((cosines[place].to_bits(), sines[place].to_bits()), (cosine.to_bits(), sine.to_bits()), "{square}");
            }
        }
    }

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
