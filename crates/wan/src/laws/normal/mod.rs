//! Standard normal numbers by the ziggurat method (Marsaglia & Tsang 2000).
//!
//! The density exp(−x²/2) is covered with 256 layers of equal area. One random word chooses a layer and a point in the layer; in 98.8 % of the cases the
//! point certainly lies under the density. Only `libm` is called, so a draw is the same on every platform.

mod tables;

use crate::random::unit;
use tables::{F, R, X};

/// Returns a standard normal number for a uniform word. `more` gives further uniform words, rarely needed.
#[must_use]
pub fn standard_normal(word: u64, more: impl FnMut() -> u64) -> f64 {
    in_the_core(word).unwrap_or_else(|| outside_the_core(word, more))
}

/// Returns a standard normal number for a uniform word, or `None` in the 1.2 % of cases that need further words.
#[inline(always)]
pub(crate) fn in_the_core(word: u64) -> Option<f64> {
    let (layer, size) = point(word);
    // X[layer + 1] is the end of the layer above: a point below it lies under the density with certainty.
    (size < X[layer + 1]).then(|| signed(word, size))
}

/// Returns the number of [`in_the_core`], or NaN instead of `None`. Two positive numbers compare like their bits, so the comparison needs no branch.
#[inline(always)]
pub(crate) fn in_the_core_or_nan(word: u64) -> f64 {
    let (layer, size) = point(word);
    // The sign bit of the difference is set for a smaller size; negated and spread, all bits are set outside of the core, a NaN.
    let is_outside = !(size.to_bits().wrapping_sub(X[layer + 1].to_bits()).cast_signed() >> 63);
    f64::from_bits(signed(word, size).to_bits() | is_outside.cast_unsigned())
}

/// Returns the layer, and the distance of the point from zero. Layer, distance and sign come from different bits of the word.
#[inline]
fn point(word: u64) -> (usize, f64) {
    let layer = usize::from(word.to_le_bytes()[0]);
    // Layer from bits 0 to 7, sign from bit 8, distance from bits 11 to 63.
    (layer, unit(word) * X[layer])
}

/// Returns `size` with the sign chosen by the word. The sign is random, so a branch could not be predicted; the bit is moved instead.
#[inline]
fn signed(word: u64, size: f64) -> f64 {
    f64::from_bits(size.to_bits() | (word & 0x100) << 55)
}

/// Returns a standard normal number for a word with its point not certainly under the density, but in a wedge or in the tail. Draws further points from
/// `more` until a point lies under the density.
#[cold]
pub(crate) fn outside_the_core(mut word: u64, mut more: impl FnMut() -> u64) -> f64 {
    loop {
        let (layer, size) = point(word);
        if size < X[layer + 1] {
            return signed(word, size);
        }
        // The lowest layer has no wedge: outside of its core lies the tail.
        if layer == 0 {
            return signed(word, tail(&mut more));
        }
        // A uniform height within the layer; the point counts if the height lies under the density.
        let height = F[layer] + (F[layer + 1] - F[layer]) * unit(more());
        if height < libm::exp(-0.5 * size * size) {
            return signed(word, size);
        }
        // The rejected point is replaced by a new one with a new layer, as the method demands.
        word = more();
    }
}

/// Returns a number from the tail beyond R, by Marsaglia (1964).
fn tail(more: &mut impl FnMut() -> u64) -> f64 {
    loop {
        // 1 − u lies in (0, 1], so its logarithm is finite.
        // Exponential majorant of the tail with the rate R.
        let beyond = -libm::log(1.0 - unit(more())) / R;
        let height = -libm::log(1.0 - unit(more()));
        if 2.0 * height > beyond * beyond {
            return R + beyond;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, Stream};

    fn draw(stream: Stream, number: u64) -> f64 {
        let packet = stream.packet(number);
        let mut more = packet.more(Purpose::Jitter);
        standard_normal(packet.first(Purpose::Jitter), || more.next_word())
    }

    /// Every layer has the same area as the lowest layer with its tail: R·F(R) + √(π/2)·erfc(R/√2). Tables of 16 digits are consistent to 1e-14.
    #[test]
    fn all_layers_have_one_area() {
        let density = |x: f64| libm::exp(-0.5 * x * x);
        let area = R * density(R) + libm::sqrt(core::f64::consts::FRAC_PI_2) * libm::erfc(R / core::f64::consts::SQRT_2);
        assert!((X[0] * density(R) - area).abs() < 1e-14);
        assert_eq!((X[1], X[256], F[256]), (R, 0.0, 1.0));
        for i in 1..256 {
            assert!((X[i] * (F[i + 1] - F[i]) - area).abs() < 1e-14, "layer {i}");
            assert!((F[i] - density(X[i])).abs() < 1e-15, "edge {i}");
        }
    }

    /// Compares moments of 2·10⁶ draws with the normal law. The standard errors of Σz^k/n for k = 1, 2, 3, 4 are √(1/n), √(2/n), √(15/n) and √(96/n); 4.5 of
    /// them are exceeded by chance once in 150 000.
    #[test]
    fn moments_are_those_of_the_normal_law() {
        let stream = Stream::new(3, b"normal");
        let count = 2_000_000_u32;
        let mut sums = [0.0; 4];
        for packet in 0..u64::from(count) {
            let z = draw(stream, packet);
            let square = z * z;
            for (sum, power) in sums.iter_mut().zip([z, square, square * z, square * square]) {
                *sum += power;
            }
        }
        let n = f64::from(count);
        for ((sum, mean), variance) in sums.iter().zip([0.0, 1.0, 0.0, 3.0]).zip([1.0, 2.0, 15.0, 96.0]) {
            assert!((sum / n - mean).abs() < 4.5 * libm::sqrt(variance / n), "{sums:?}");
        }
    }

    /// Of 2·10⁶ draws about 2·10⁶·erfc(3.8/√2) = 289.4 lie beyond 3.8, all of them from the tail. The number is Poisson, with a bound of 4.5 standard
    /// deviations of 17.
    #[test]
    fn the_tail_has_its_share() {
        let stream = Stream::new(4, b"normal");
        let beyond = (0..2_000_000).filter(|&packet| draw(stream, packet).abs() > 3.8).count();
        assert!((213..=366).contains(&beyond), "{beyond}");
    }

    /// Every recorded result with jitter contains draws. If this test fails, the change breaks recorded results.
    #[test]
    fn draws_never_change() {
        let stream = Stream::new(1, b"left->right");
        let drawn: [u64; 3] = core::array::from_fn(|packet| draw(stream, packet as u64).to_bits());
        assert_eq!(drawn, [13_821_872_902_639_228_385, 13_827_345_273_651_602_772, 4_604_346_350_751_844_895]);
    }
}
