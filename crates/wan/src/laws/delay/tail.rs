//! Place in a law: the probability on its shorter side, so both tails are resolved.

use super::special::normal;

/// Place in a law, given by the smaller of the probabilities below and above, so rounding cuts neither tail.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Tail {
    /// Probability below the place, at most ½.
    Below(f64),
    /// Probability above the place, at most ½.
    Above(f64),
}

impl Tail {
    /// Returns the place of a standard normal number: Φ(z).
    pub(super) fn of_normal(z: f64) -> Self {
        if z < 0.0 { Self::Below(normal::below(z)) } else { Self::Above(normal::below(-z)) }
    }

    /// Returns the place of the probability `p`, in (0, 1).
    pub(super) fn of_probability(p: f64) -> Self {
        // For p ≥ ½ the difference is exact.
        if p < 0.5 { Self::Below(p) } else { Self::Above(1.0 - p) }
    }

    /// Returns the place of a uniform word. The top bit is the side, and the other bits are (k + ½)·2⁻⁶⁴ from the end, so the ends of a law are resolved to
    /// 3·10⁻²⁰.
    pub(super) fn of_word(word: u64) -> Self {
        // The complement of an upper word counts from the upper end.
        if word >> 63 == 0 { Self::Below(from_the_end(word)) } else { Self::Above(from_the_end(!word)) }
    }

    /// Returns the standard normal number of this place.
    pub(super) fn normal(self) -> f64 {
        match self {
            Self::Below(p) => normal::inverse_below(p),
            Self::Above(q) => -normal::inverse_below(q),
        }
    }

    /// Returns the probability above this place.
    pub(super) fn above(self) -> f64 {
        match self {
            Self::Below(p) => 1.0 - p,
            Self::Above(q) => q,
        }
    }

    /// Returns the logarithm of the probability above this place, accurate also for a probability of nearly 1.
    pub(super) fn log_above(self) -> f64 {
        match self {
            Self::Below(p) => libm::log1p(-p),
            Self::Above(q) => libm::log(q),
        }
    }
}

/// Returns (word + ½)·2⁻⁶⁴, a probability below ½. `word` is below 2^63.
#[expect(clippy::cast_precision_loss, reason = "a word below 2^63, rounded to 53 bits, is a probability to 16 digits")]
fn from_the_end(word: u64) -> f64 {
    const TWO_POW_MINUS_64: f64 = 1.0 / (4_294_967_296.0 * 4_294_967_296.0);
    (word as f64 + 0.5) * TWO_POW_MINUS_64
}
