//! A place in a law: the probability on its shorter side, so that both tails are resolved.

use super::special::normal;

/// A place in a law, by the probability of what lies below it or above it. The smaller of the two, so that neither tail is cut by rounding.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) enum Tail {
    /// At most ½ lies below.
    Below(f64),
    /// At most ½ lies above.
    Above(f64),
}

impl Tail {
    /// The place of a standard normal number: Φ(z).
    pub(super) fn of_normal(z: f64) -> Self {
        if z < 0.0 { Self::Below(normal::below(z)) } else { Self::Above(normal::below(-z)) }
    }

    /// The place of a probability; `p` is believed to lie in (0, 1).
    pub(super) fn of_probability(p: f64) -> Self {
        // For p ≥ ½ the difference is exact.
        if p < 0.5 { Self::Below(p) } else { Self::Above(1.0 - p) }
    }

    /// The place of a uniform word: the top bit is the side, the others are (k + ½)·2⁻⁶⁴ from the end. So the ends of a law are resolved to 3·10⁻²⁰.
    #[inline]
    pub(super) fn of_word(word: u64) -> Self {
        if word >> 63 == 0 { Self::Below(from_the_end(word)) } else { Self::Above(from_the_end(!word)) }
    }

    /// The standard normal number of this place.
    pub(super) fn normal(self) -> f64 {
        match self {
            Self::Below(p) => normal::inverse_below(p),
            Self::Above(q) => -normal::inverse_below(q),
        }
    }

    /// The probability above.
    pub(super) fn above(self) -> f64 {
        match self {
            Self::Below(p) => 1.0 - p,
            Self::Above(q) => q,
        }
    }

    /// ln of the probability above, accurate also where that is nearly 1.
    pub(super) fn log_above(self) -> f64 {
        match self {
            Self::Below(p) => libm::log1p(-p),
            Self::Above(q) => libm::log(q),
        }
    }
}

#[inline]
#[expect(clippy::cast_precision_loss, reason = "a word below 2^63, rounded to 53 bits, is a probability to 16 digits")]
fn from_the_end(word: u64) -> f64 {
    const TWO_POW_MINUS_64: f64 = 1.0 / (4_294_967_296.0 * 4_294_967_296.0);
    (word as f64 + 0.5) * TWO_POW_MINUS_64
}
