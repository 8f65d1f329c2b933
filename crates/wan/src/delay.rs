//! Propagation delay with jitter.

use core::time::Duration;

use crate::normal::standard_normal;
use crate::random::{PacketDraws, Purpose, unit};

/// The law of the jitter. Its standard deviation is the one asked for, but for what the normal law loses below zero delay.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[non_exhaustive]
pub enum Distribution {
    /// Normal. A draw below zero delay arrives at once: with delay µ and deviation σ this happens with probability Φ(−µ/σ).
    #[default]
    Normal,
    /// Uniform over µ ± √3·σ.
    Uniform,
}

/// Random variation of the delay around its mean.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Jitter {
    /// The standard deviation.
    pub sd: Duration,
    /// The law.
    pub distribution: Distribution,
}

/// A propagation delay: a mean and, perhaps, jitter around it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Delay {
    mean: Duration,
    jitter: Option<Jitter>,
}

/// Why a delay is refused.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DelayError {
    /// The uniform law would reach below zero, where it could not be kept.
    #[error(
        "uniform jitter of standard deviation {} reaches {} below the mean delay of {}: expected at most the delay",
        cohaptic_units::print::Span(*sd), cohaptic_units::print::Span(*reach), cohaptic_units::print::Span(*mean)
    )]
    ReachesBelowZero {
        /// The mean delay.
        mean: Duration,
        /// The standard deviation.
        sd: Duration,
        /// √3·sd.
        reach: Duration,
    },
    /// More than 292 years, which cannot be counted with a sign.
    #[error("a delay and its deviation must be below 292 years")]
    TooLong,
}

/// The longest delay and deviation: what an `i64` of nanoseconds holds.
const LONGEST: Duration = Duration::from_nanos(i64::MAX.unsigned_abs());

impl Delay {
    /// The same delay for every packet.
    #[must_use]
    pub const fn constant(mean: Duration) -> Self {
        Self { mean, jitter: None }
    }

    /// A delay with jitter. A deviation of zero is no jitter: nothing is drawn.
    ///
    /// # Errors
    ///
    /// [`DelayError`] if the law would reach below zero delay (uniform only) or the spans cannot be counted.
    pub fn with_jitter(mean: Duration, jitter: Jitter) -> Result<Self, DelayError> {
        if mean > LONGEST || jitter.sd > LONGEST / 2 {
            return Err(DelayError::TooLong);
        }
        let reach = uniform_reach(jitter.sd);
        if jitter.distribution == Distribution::Uniform && reach > mean {
            return Err(DelayError::ReachesBelowZero { mean, sd: jitter.sd, reach });
        }
        Ok(Self { mean, jitter: (!jitter.sd.is_zero()).then_some(jitter) })
    }

    /// The mean delay asked for.
    #[must_use]
    pub const fn mean(&self) -> Duration {
        self.mean
    }

    /// The jitter, if there is any.
    #[must_use]
    pub const fn jitter(&self) -> Option<Jitter> {
        self.jitter
    }

    /// No packet is faster than this.
    #[must_use]
    pub fn least(&self) -> Duration {
        match self.jitter {
            None => self.mean,
            Some(Jitter { sd, distribution: Distribution::Uniform }) => self.mean - uniform_reach(sd),
            Some(Jitter { distribution: Distribution::Normal, .. }) => Duration::ZERO,
        }
    }
}

/// The delay stage: draws the delay of each packet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DelayStage {
    mean_nanos: u64,
    jitter: Option<Law>,
}

/// Spans as numbers, converted once.
#[derive(Clone, Copy, Debug)]
enum Law {
    Normal { sd_nanos: f64 },
    Uniform { reach_nanos: f64 },
}

impl DelayStage {
    pub(crate) fn new(delay: Delay) -> Self {
        let law = |Jitter { sd, distribution }| match distribution {
            Distribution::Normal => Law::Normal { sd_nanos: nanos(sd) },
            Distribution::Uniform => Law::Uniform { reach_nanos: SQRT_3 * nanos(sd) },
        };
        Self { mean_nanos: u64::try_from(delay.mean.as_nanos()).unwrap_or(u64::MAX), jitter: delay.jitter.map(law) }
    }

    /// The delay of one packet \[ns\], if there is jitter from `word`, the first of its words for jitter. Rounded to the nearest nanosecond.
    #[inline]
    pub(crate) fn draw_nanos(&self, word: u64, packet: PacketDraws) -> u64 {
        let deviation = match self.jitter {
            None => return self.mean_nanos,
            Some(Law::Normal { sd_nanos }) => {
                let mut more = packet.more(Purpose::Jitter);
                sd_nanos * standard_normal(word, || more.next_word())
            }
            Some(Law::Uniform { reach_nanos }) => reach_nanos * (2.0 * unit(word) - 1.0),
        };
        #[expect(clippy::cast_possible_truncation, reason = "saturates, beyond 292 years")]
        let deviation = libm::rint(deviation) as i64;
        self.mean_nanos.saturating_add_signed(deviation)
    }
}

const SQRT_3: f64 = 1.732_050_807_568_877_2;

#[expect(clippy::cast_precision_loss, reason = "a span enters a random law as a real number")]
fn nanos(span: Duration) -> f64 {
    span.as_nanos() as f64
}

/// How far the uniform law reaches to either side, rounded like a draw.
fn uniform_reach(sd: Duration) -> Duration {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "not negative, and below 2^63 for every accepted deviation")]
    Duration::from_nanos(libm::rint(SQRT_3 * nanos(sd)) as u64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;

    const MILLISECOND: Duration = Duration::from_millis(1);

    fn draws(delay: Delay, count: u64) -> Vec<f64> {
        let stream = Stream::new(1, b"delay");
        let stage = DelayStage::new(delay);
        let draw = |packet: PacketDraws| stage.draw_nanos(packet.first(Purpose::Jitter), packet) as f64 / 1e6;
        (0..count).map(|number| draw(stream.packet(number))).collect()
    }

    fn jitter(distribution: Distribution, sd: Duration) -> Jitter {
        Jitter { sd, distribution }
    }

    /// The largest distance between the empirical distribution and `cdf` (Kolmogorov).
    fn kolmogorov(mut sample: Vec<f64>, cdf: impl Fn(f64) -> f64) -> f64 {
        sample.sort_by(f64::total_cmp);
        let n = sample.len() as f64;
        sample.iter().enumerate().map(|(i, &x)| (cdf(x) - i as f64 / n).max((i + 1) as f64 / n - cdf(x))).fold(0.0, f64::max)
    }

    // Kolmogorov–Smirnov, n = 100 000: the 0.999 quantile of the distance is 1.9495/√n = 0.00616.
    const KS_BOUND: f64 = 0.006_16;

    #[test]
    fn normal_jitter_has_the_normal_law() {
        let delay = Delay::with_jitter(24 * MILLISECOND, jitter(Distribution::Normal, 2 * MILLISECOND)).unwrap();
        let cdf = |x: f64| 0.5 * libm::erfc(-(x - 24.0) / (2.0 * core::f64::consts::SQRT_2));
        assert!(kolmogorov(draws(delay, 100_000), cdf) < KS_BOUND);
    }

    #[test]
    fn uniform_jitter_has_the_uniform_law_with_the_deviation_asked_for() {
        let delay = Delay::with_jitter(24 * MILLISECOND, jitter(Distribution::Uniform, 2 * MILLISECOND)).unwrap();
        let reach = 2.0 * SQRT_3;
        let cdf = |x: f64| ((x - 24.0 + reach) / (2.0 * reach)).clamp(0.0, 1.0);
        assert!(kolmogorov(draws(delay, 100_000), cdf) < KS_BOUND);
    }

    #[test]
    fn no_draw_is_below_the_least_delay() {
        let tight = Delay::with_jitter(Duration::from_nanos(1_732_051), jitter(Distribution::Uniform, MILLISECOND)).unwrap();
        assert_eq!(tight.least(), Duration::ZERO);
        let wide = Delay::with_jitter(MILLISECOND, jitter(Distribution::Normal, 2 * MILLISECOND)).unwrap();
        assert!(draws(wide, 10_000).contains(&0.0), "a normal law this wide is cut at zero");
    }

    #[test]
    fn uniform_jitter_that_reaches_below_zero_is_refused() {
        let wide = Delay::with_jitter(MILLISECOND, jitter(Distribution::Uniform, MILLISECOND));
        assert!(matches!(wide, Err(DelayError::ReachesBelowZero { .. })));
    }

    #[test]
    fn a_deviation_of_zero_is_a_constant_delay() {
        let delay = Delay::with_jitter(MILLISECOND, jitter(Distribution::Normal, Duration::ZERO)).unwrap();
        assert_eq!(delay, Delay::constant(MILLISECOND));
    }
}
