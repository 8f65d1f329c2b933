//! Events that happen to packets with a probability, independently or in runs.

use crate::parameters::{CORRELATION, Form, Key, Table, number, optional, usual};
use alloc::format;
use alloc::string::String;
use cohaptic_units::Probability;
use core::fmt;

/// Chance of an event for every packet: the probability of yes, and the correlation of the answer with the previous packet's answer.
///
/// The answers are a chain of two states, DAR(1) (Jacobs & Lewis 1978): P(yes | yes) = p + ρ(1−p), P(yes | no) = p(1−ρ). The mean is exactly p, the
/// autocorrelation at lag k exactly ρᵏ, and the mean run of yes 1/((1−ρ)(1−p)). With ρ = 0 the answers are independent.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Chance {
    probability: Probability,
    correlation: f64,
}

/// Error: events of this probability cannot have this correlation.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ChanceError {
    /// Probability of the events.
    pub probability: Probability,
    /// Correlation asked for.
    pub correlation: f64,
    /// Least correlation of events with this probability.
    pub least: f64,
}

impl fmt::Display for ChanceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { probability, correlation, least } = self;
        write!(
            f,
            "events of probability {probability} cannot have the correlation {correlation} from one packet to the next: expected {least:.6} or more, and less than 1"
        )
    }
}

impl core::error::Error for ChanceError {}

impl Chance {
    /// Returns a chance with independent answers.
    #[must_use]
    pub const fn independent(probability: Probability) -> Self {
        Self { probability, correlation: 0.0 }
    }

    /// Returns a chance with the autocorrelation `correlation` of the answers at lag one.
    ///
    /// # Errors
    ///
    /// [`ChanceError`] if the correlation is 1 or more, is not a number, or is more negative than possible for events of this probability, −min(p/(1−p),
    /// (1−p)/p).
    pub fn correlated(probability: Probability, correlation: f64) -> Result<Self, ChanceError> {
        let p = probability.get();
        let (small, large) = if p < 0.5 { (p, 1.0 - p) } else { (1.0 - p, p) };
        // P(yes | no) = p(1−ρ) and P(no | yes) = (1−p)(1−ρ) must stay at most 1.
        let least = -small / large;
        // NaN fails both comparisons and is refused.
        if correlation >= least && correlation < 1.0 {
            Ok(Self { probability, correlation })
        } else {
            Err(ChanceError { probability, correlation, least })
        }
    }

    /// Returns the long-run fraction of yes.
    #[must_use]
    pub const fn probability(self) -> Probability {
        self.probability
    }

    /// Returns the autocorrelation of the answers at lag one.
    #[must_use]
    pub const fn correlation(self) -> f64 {
        self.correlation
    }

    /// Returns whether the answer is always no.
    #[must_use]
    pub fn is_never(self) -> bool {
        self.probability == Probability::ZERO
    }
}

/// Stage with an answer for each packet, and the previous answer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ChanceStage {
    chance: Chance,
    /// Answer for the previous packet, or `None` before the first packet.
    before: Option<bool>,
}

impl ChanceStage {
    /// Returns the stage at the begin, or `None` if the answer is always no.
    pub(crate) fn new(chance: Chance) -> Option<Self> {
        (!chance.is_never()).then_some(Self { chance, before: None })
    }

    /// Returns the stage for the chance `chance`, continued from the previous answer, or `None` if the answer is always no.
    pub(crate) fn reconfigured(before: Option<Self>, chance: Chance) -> Option<Self> {
        Some(Self { before: before.and_then(|stage| stage.before), ..Self::new(chance)? })
    }

    /// Returns whether the event happens to the next packet, given the packet's random word, and remembers the answer for the packet after.
    pub(crate) fn happens(&mut self, word: u64) -> bool {
        let (p, rho) = (self.chance.probability.get(), self.chance.correlation);
        // DAR(1): for ρ ≥ 0 the previous answer is repeated with probability ρ, else a new answer is drawn.
        let yes = match self.before {
            _ if rho == 0.0 => p,
            None => p,
            Some(true) => p + rho * (1.0 - p),
            Some(false) => p * (1.0 - rho),
        };
        // Rounding can lead slightly outside of 0 to 1, and `Probability` refuses such numbers.
        let happens = Probability::new(yes.clamp(0.0, 1.0)).unwrap_or_default().happens(word);
        self.before = Some(happens);
        happens
    }
}

/// Parameter of copies.
pub(crate) const KEYS: [Key; 1] = [usual("duplicate", CHANCE, "0", "Probability that a packet is sent twice")];
/// Form of an event that happens to packets with a probability.
pub(crate) const CHANCE: Form = Form::AnyOf(&[Form::Probability, Form::Table(&CHANCE_TABLE)]);
static CHANCE_TABLE: Table = Table::of(&[&CHANCES]);
/// Keys of a chance, for tables with further keys.
pub(crate) const CHANCES: [Key; 2] = [
    optional("probability", Form::Probability, "Fraction of the packets that this happens to"),
    usual("correlation", number(CORRELATION), "0", "Correlation of this event between successive packets"),
];

impl Chance {
    /// Returns the probability in words, such as `1%`, with the correlation if there is one.
    pub(crate) fn words(self) -> String {
        let often = percent(self.probability.get());
        if self.correlation == 0.0 { often } else { format!("{often} (correlation {})", self.correlation) }
    }
}

/// Returns a fraction as a percentage, rounded to six places.
pub(crate) fn percent(fraction: f64) -> String {
    format!("{}%", libm::round(fraction * 1e8) / 1e6)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{Purpose, Stream};

    fn p(value: f64) -> Probability {
        Probability::new(value).unwrap()
    }

    fn answers(chance: Chance, count: u64) -> Vec<bool> {
        let stream = Stream::new(5, b"chance");
        let mut stage = ChanceStage::new(chance).unwrap();
        (0..count).map(|n| stage.happens(stream.packet(n).first(Purpose::Loss))).collect()
    }

    /// Compares mean and autocorrelations of 10⁶ answers with p = 0.05, ρ = 0.5 with their laws. The standard error of the mean is √(p(1−p)/n·(1+ρ)/(1−ρ)) =
    /// 0.00038, those of the autocorrelations are below 0.004 (Bartlett, doubled for the skew of rare events). 4.5 standard errors are exceeded once in 150
    /// 000.
    #[test]
    fn mean_and_autocorrelation_are_those_asked_for() {
        let n = 1_000_000;
        let yes = answers(Chance::correlated(p(0.05), 0.5).unwrap(), n);
        let mean = yes.iter().filter(|yes| **yes).count() as f64 / n as f64;
        assert!((mean - 0.05).abs() < 4.5 * 0.000_38, "{mean}");
        let value = |yes: bool| f64::from(u8::from(yes)) - mean;
        let variance: f64 = yes.iter().map(|yes| value(*yes).powi(2)).sum::<f64>() / n as f64;
        for lag in 1..=3 {
            let covariance: f64 = yes.iter().zip(&yes[lag..]).map(|(a, b)| value(*a) * value(*b)).sum::<f64>() / n as f64;
            let expected = 0.5_f64.powi(i32::try_from(lag).unwrap());
            assert!((covariance / variance - expected).abs() < 4.5 * 0.004, "lag {lag}: {}", covariance / variance);
        }
    }

    /// With probability ½ and correlation −1, yes and no alternate.
    #[test]
    fn the_most_negative_correlation_alternates() {
        let yes = answers(Chance::correlated(p(0.5), -1.0).unwrap(), 100);
        assert!(yes.windows(2).all(|pair| pair[0] != pair[1]));
    }

    #[test]
    fn a_correlation_that_such_events_cannot_have_is_refused() {
        assert!(Chance::correlated(p(0.1), -1.0 / 9.0).is_ok());
        for correlation in [-0.2, 1.0, f64::NAN] {
            assert!(Chance::correlated(p(0.1), correlation).is_err(), "{correlation}");
        }
    }
}
