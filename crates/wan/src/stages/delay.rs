//! Propagation delay with jitter: configuration and checks.

mod stage;

use alloc::format;
use alloc::string::String;
use alloc::string::ToString as _;
use alloc::sync::Arc;
use core::fmt;
use core::time::Duration;

use cohaptic_units::print::Span;

use stage::count;
pub(crate) use stage::{CorrelatedDelays, DelayStage};

use crate::laws::delay::{Distribution, Law, LawError};
use crate::parameters::{CORRELATION, Choices, FRACTION, Form, Key, Table, number, optional, usual, words};

/// Random variation of the delay around its mean.
#[derive(Clone, PartialEq, Debug)]
pub struct Jitter {
    /// Standard deviation of the delay.
    pub sd: Duration,
    /// Law of the delay. [`crate::law`] describes each law and its shape at the floor.
    pub distribution: Distribution,
    /// Least delay: no packet is faster.
    pub floor: Duration,
    /// Dependence of a packet's delay on the delay of the previous packet. The law of each single delay stays the same.
    pub correlation: Correlation,
}

/// Dependence between delays of successive packets. Delays are images of a Gaussian chain, z(n) = φ·z(n−1) + √(1−φ²)·ε(n), delay = F⁻¹(Φ(z)): a Gaussian
/// copula.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub enum Correlation {
    /// Independent delays.
    #[default]
    None,
    /// Autocorrelation of the delays at lag one, whatever the time between packets. φ follows from the autocorrelation and the law.
    PerPacket(f64),
    /// Correlation time τ, with φ = e^(−Δ/τ) for packets Δ apart. The chain is an Ornstein–Uhlenbeck process, and the speed of change of the delay does not
    /// depend on the number of packets. If τ is far above the spacing of packets, packets rarely overtake each other.
    InTime(Duration),
    /// Two memories. A share of the variance of the Gaussian numbers is an Ornstein–Uhlenbeck process as under [`InTime`](Self::InTime), and the rest is drawn
    /// anew for each packet: z(n) = √s·u(n) + √(1−s)·η(n). The correlation of z over Δ is s·e^(−Δ/τ).
    PartlyInTime {
        /// Correlation time τ of the process.
        time: Duration,
        /// Share s of the process in the variance, above 0 and at most 1.
        share: f64,
    },
}

impl Jitter {
    /// Returns independent jitter without a floor.
    #[must_use]
    pub const fn new(sd: Duration, distribution: Distribution) -> Self {
        Self { sd, distribution, floor: Duration::ZERO, correlation: Correlation::None }
    }
}

/// Propagation delay: a mean with optional jitter around the mean.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Delay {
    mean: Duration,
    jitter: Option<Arc<Checked>>,
}

/// Checked jitter, with the resulting law and memory. Shared by all links with this delay, so both are computed once.
#[derive(PartialEq, Debug)]
struct Checked {
    jitter: Jitter,
    law: Law,
    memory: Memory,
}

/// Origin of φ in the Gaussian chain.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Memory {
    None,
    PerPacket(f64),
    /// A chain in time. `parts` are the factors √s of the chain's value and √(1−s) of an independent normal number; the second is 0 without such a number.
    InTime {
        tau_nanos: f64,
        parts: [f64; 2],
    },
}

impl Memory {
    /// Returns a chain with the correlation time `time`, not zero, and with the share `share` of the variance.
    fn in_time(time: Duration, share: f64) -> Self {
        Self::InTime { tau_nanos: nanos(time), parts: [libm::sqrt(share), libm::sqrt(1.0 - share)] }
    }
}

/// Reason for the refusal of a delay.
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub enum DelayError {
    /// A law with a least value would begin below the floor and cannot be cut there, or the deviation is too large for the mean.
    ReachesBelowFloor {
        /// Name of the law.
        law: &'static str,
        /// Mean delay.
        mean: Duration,
        /// Standard deviation.
        sd: Duration,
        /// Floor.
        floor: Duration,
        /// Largest accepted deviation.
        largest: Duration,
    },
    /// The floor lies above the mean.
    FloorAboveMean {
        /// Mean delay.
        mean: Duration,
        /// Floor.
        floor: Duration,
    },
    /// Delays with this law cannot have this correlation.
    Correlation {
        /// Correlation asked for.
        asked: f64,
        /// Least correlation of delays with this law.
        least: f64,
    },
    /// The correlation time is zero.
    NoTime,
    /// The share of the variance with memory is not above 0 and at most 1.
    Share(f64),
    /// The mean exceeds 292 years, the longest span in signed nanoseconds, or the deviation exceeds half of this span.
    TooLong,
}

impl fmt::Display for DelayError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::ReachesBelowFloor { law, mean, sd, floor, largest } => write!(
                f,
                "{law} jitter with a standard deviation of {} around {} does not stay above the least delay of {}: expected a deviation of at most {}",
                Span(*sd),
                Span(*mean),
                Span(*floor),
                Span(*largest)
            ),
            Self::FloorAboveMean { mean, floor } => {
                write!(f, "the mean delay of {} is below the least delay of {}: expected a mean at or above it", Span(*mean), Span(*floor))
            }
            Self::Correlation { asked, least } => write!(
                f,
                "delays with this law cannot have the correlation {asked} from one packet to the next: expected {least:.6} or more, and less than 1"
            ),
            Self::NoTime => f.write_str("a correlation time of 0s: expected a time above zero, or no correlation"),
            Self::Share(found) => write!(f, "found the share {found} of the variance with memory: expected a number above 0 and at most 1"),
            Self::TooLong => f.write_str("a delay and its deviation must be below 292 years"),
        }
    }
}

impl core::error::Error for DelayError {}

/// Longest delay: the nanoseconds of an `i64`. A deviation may have half of this.
const LONGEST: Duration = Duration::from_nanos(i64::MAX.unsigned_abs());

impl Delay {
    /// Returns the same delay for all packets.
    #[must_use]
    pub const fn constant(mean: Duration) -> Self {
        Self { mean, jitter: None }
    }

    /// Returns a delay with jitter. With a deviation of zero the delay is constant and no random number is drawn.
    ///
    /// # Errors
    ///
    /// [`DelayError`] if the law does not stay above the floor and cannot be cut there, if the law cannot have the correlation, or if the spans cannot be
    /// counted.
    pub fn with_jitter(mean: Duration, jitter: Jitter) -> Result<Self, DelayError> {
        if mean > LONGEST || jitter.sd > LONGEST / 2 {
            return Err(DelayError::TooLong);
        }
        let explained = |error| explain(error, mean, &jitter);
        let law = Law::new(&jitter.distribution, nanos(mean), nanos(jitter.sd), Some(nanos(jitter.floor))).map_err(explained)?;
        let memory = match jitter.correlation {
            Correlation::None => Memory::None,
            Correlation::InTime(Duration::ZERO) | Correlation::PartlyInTime { time: Duration::ZERO, .. } => return Err(DelayError::NoTime),
            Correlation::InTime(time) => Memory::in_time(time, 1.0),
            // NaN fails both comparisons and is refused here.
            Correlation::PartlyInTime { share, .. } if !(share > 0.0 && share <= 1.0) => return Err(DelayError::Share(share)),
            Correlation::PartlyInTime { time, share } => Memory::in_time(time, share),
            // NaN fails both comparisons and is refused here. The law refuses correlations below its least possible correlation.
            Correlation::PerPacket(rho) if !(rho > -2.0 && rho < 1.0) => return Err(DelayError::Correlation { asked: rho, least: -1.0 }),
            Correlation::PerPacket(rho) => match law.gaussian_correlation(rho).map_err(explained)? {
                0.0 => Memory::None,
                phi => Memory::PerPacket(phi),
            },
        };
        // Without deviation there is nothing to draw, so the delay is constant.
        let jitters = !jitter.sd.is_zero();
        Ok(Self { mean, jitter: jitters.then(|| Arc::new(Checked { jitter, law, memory })) })
    }

    /// Returns the configured mean delay.
    #[must_use]
    pub const fn mean(&self) -> Duration {
        self.mean
    }

    /// Returns the jitter, or `None` for a constant delay.
    #[must_use]
    pub fn jitter(&self) -> Option<&Jitter> {
        self.jitter.as_deref().map(|checked| &checked.jitter)
    }

    /// Returns the law of a packet's delay \[ns\], or `None` for a constant delay.
    #[must_use]
    pub fn law(&self) -> Option<&Law> {
        self.jitter.as_deref().map(|checked| &checked.law)
    }

    /// Returns the least delay of a packet.
    #[must_use]
    pub fn least(&self) -> Duration {
        self.law().map_or(self.mean, |law| Duration::from_nanos(count(law.least())))
    }
}

/// Returns the error of a delay for an error of its law.
fn explain(error: LawError, mean: Duration, jitter: &Jitter) -> DelayError {
    let Jitter { sd, floor, .. } = *jitter;
    match error {
        LawError::ReachesBelowFloor { law, largest_sd, .. } | LawError::TooVaried { law, largest_sd, .. } => {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "not negative; rounded down, so that it is accepted")]
            let largest = Duration::from_nanos(largest_sd as u64);
            DelayError::ReachesBelowFloor { law, mean, sd, floor, largest }
        }
        LawError::FloorAboveMean { .. } => DelayError::FloorAboveMean { mean, floor },
        LawError::NotACorrelation { found } => DelayError::Correlation { asked: found, least: -1.0 },
        LawError::TooNegative { asked, least } => DelayError::Correlation { asked, least },
        // Both errors cannot occur, because spans are finite and not negative.
        LawError::NotFinite { .. } | LawError::NegativeDeviation { .. } => DelayError::TooLong,
    }
}

/// Parameters of the delay and of its jitter.
pub(crate) const KEYS: [Key; 2] = [
    usual("delay", Form::Duration, "\"0s\"", "One-way propagation delay; the mean if there is jitter"),
    optional("jitter", JITTER, "Standard deviation of the delay, with a normal law, or a table that also names law, floor and memory"),
];
pub(crate) const JITTER: Form = Form::AnyOf(&[Form::Duration, Form::Table(&JITTER_TABLE)]);
static JITTER_TABLE: Table = Table::of(&[&[
    optional("sd", Form::Duration, "Standard deviation of the delay. Required, except for measured delays, whose own deviation is the default"),
    usual("distribution", Form::AnyOf(const { &[Form::Words(&LAWS), Form::Table(&LAW_FILE)] }), "\"normal\"", "Law of the delay"),
    usual("floor", Form::Duration, "\"0s\"", "Smallest delay of a packet"),
    usual("correlation", number(CORRELATION), "0", "Correlation between the delays of successive packets"),
    optional("correlation-time", Form::PositiveDuration, "Time constant of the memory of delays, in place of correlation"),
    usual(
        "correlation-share",
        number(FRACTION),
        "1",
        "With correlation-time: share of the variation that has this memory; the rest differs from packet to packet",
    ),
]]);
const LAWS: [(&str, &str); 8] = words(&Distribution::CHOICES);

impl Distribution {
    /// Names of the laws without a file, each with its value and its description.
    pub const CHOICES: Choices<Self, 8> = [
        ("normal", Self::Normal, "Gaussian, cut off at the floor"),
        ("uniform", Self::Uniform, "equally likely between two ends"),
        ("pareto", Self::Pareto, "a heavy tail above"),
        ("paretonormal", Self::ParetoNormal, "the mixture of tc-netem"),
        ("lognormal", Self::LogNormal, "above the floor, with a long tail"),
        ("gamma", Self::Gamma, "above the floor, as many small delays add up"),
        ("weibull", Self::Weibull, "above the floor"),
        ("laplace", Self::Laplace, "two exponentials, back to back"),
    ];
}
static LAW_FILE: Table = Table::of(&[&[
    optional("table", Form::File, "Table of a law, a .dist file as tc reads it"),
    optional("empirical", Form::File, "CSV file of measured delays with the header delay, in seconds"),
]]);

impl Delay {
    /// Returns the mean and the jitter in words.
    pub(crate) fn words(&self) -> String {
        let mean = Span(self.mean());
        // A constant delay has no law to describe.
        let Some(Jitter { sd, distribution, floor, correlation }) = self.jitter() else { return mean.to_string() };
        let floor = if *floor == Duration::ZERO { String::new() } else { format!(", never below {}", Span(*floor)) };
        let memory = match correlation {
            Correlation::None => String::new(),
            Correlation::PerPacket(correlation) => format!(", correlation {correlation} from packet to packet"),
            Correlation::InTime(time) => format!(", correlated over {}", Span(*time)),
            Correlation::PartlyInTime { time, share } => format!(", {share} of the variance correlated over {}", Span(*time)),
        };
        format!("{mean}, {} jitter of {}{floor}{memory}", distribution.words(), Span(*sd))
    }
}

/// Returns a span in nanoseconds.
#[expect(clippy::cast_precision_loss, reason = "a span enters a random law as a real number")]
fn nanos(span: Duration) -> f64 {
    span.as_nanos() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    const MILLISECOND: Duration = Duration::from_millis(1);

    #[test]
    fn what_cannot_be_is_refused_with_what_can() {
        let jitter = |distribution, correlation| Jitter { correlation, ..Jitter::new(MILLISECOND, distribution) };
        let refused = |jitter: Jitter| Delay::with_jitter(MILLISECOND, jitter).unwrap_err();
        let DelayError::ReachesBelowFloor { largest, .. } = refused(jitter(Distribution::Uniform, Correlation::None)) else { panic!() };
        assert_eq!(largest, Duration::from_nanos(577_350));
        assert!(Delay::with_jitter(MILLISECOND, Jitter::new(largest, Distribution::Uniform)).is_ok());
        for correlation in [Correlation::PerPacket(1.0), Correlation::PerPacket(f64::NAN), Correlation::PerPacket(-0.9)] {
            assert!(matches!(refused(jitter(Distribution::LogNormal, correlation)), DelayError::Correlation { .. }), "{correlation:?}");
        }
        assert_eq!(refused(jitter(Distribution::Normal, Correlation::InTime(Duration::ZERO))), DelayError::NoTime);
        let partly = |time, share| refused(jitter(Distribution::Normal, Correlation::PartlyInTime { time, share }));
        assert_eq!(partly(Duration::ZERO, 0.5), DelayError::NoTime);
        for share in [0.0, -0.1, 1.5, f64::NAN] {
            assert!(matches!(partly(MILLISECOND, share), DelayError::Share(_)), "{share}");
        }
        let floor = Jitter { floor: 2 * MILLISECOND, ..jitter(Distribution::Normal, Correlation::None) };
        assert!(matches!(refused(floor), DelayError::FloorAboveMean { .. }));
    }

    #[test]
    fn a_deviation_of_zero_is_a_constant_delay() {
        let delay = Delay::with_jitter(MILLISECOND, Jitter::new(Duration::ZERO, Distribution::Gamma)).unwrap();
        assert_eq!(delay, Delay::constant(MILLISECOND));
    }
}
