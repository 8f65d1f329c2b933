//! Propagation delay with jitter.

use alloc::boxed::Box;
use alloc::format;
use alloc::string::String;
use alloc::string::ToString as _;
use alloc::sync::Arc;
use core::fmt;
use core::time::Duration;

use cohaptic_units::Instant;
use cohaptic_units::print::Span;

use crate::laws::delay::{Distribution, GammaCubics, GammaLaw, Law, LawError};
use crate::laws::normal::{in_the_core, in_the_core_or_nan, outside_the_core, standard_normal};
use crate::parameters::{CORRELATION, Choices, Form, Key, Table, number, optional, usual, words};
use crate::random::{PacketDraws, Purpose};

/// Random variation of the delay around its mean.
#[derive(Clone, PartialEq, Debug)]
pub struct Jitter {
    /// The standard deviation.
    pub sd: Duration,
    /// The law: see [`crate::law`] for what each is, and what it does at the floor.
    pub distribution: Distribution,
    /// No packet is faster than this.
    pub floor: Duration,
    /// How much the delay of a packet depends on that of the one before. The law of each delay stays the same.
    pub correlation: Correlation,
}

/// How delays of successive packets hang together: as images of a Gaussian chain, z(n) = φ·z(n−1) + √(1−φ²)·ε(n), delay = F⁻¹(Φ(z)), a Gaussian copula.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub enum Correlation {
    /// Not at all.
    #[default]
    None,
    /// The autocorrelation of the delays at lag one, whatever the time between packets. φ follows from it and the law.
    PerPacket(f64),
    /// φ = e^(−Δ/τ) for packets Δ apart, this being τ: the chain is an Ornstein–Uhlenbeck process, and how fast the delay changes does not depend on how
    /// many packets are sent. With τ far above the spacing packets seldom overtake each other.
    InTime(Duration),
}

impl Jitter {
    /// Independent jitter without a floor.
    #[must_use]
    pub const fn new(sd: Duration, distribution: Distribution) -> Self {
        Self { sd, distribution, floor: Duration::ZERO, correlation: Correlation::None }
    }
}

/// A propagation delay: a mean and, perhaps, jitter around it.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Delay {
    mean: Duration,
    jitter: Option<Arc<Checked>>,
}

/// Jitter that was checked, with what was computed from it once for all links.
#[derive(PartialEq, Debug)]
struct Checked {
    jitter: Jitter,
    law: Law,
    memory: Memory,
}

/// What φ is.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Memory {
    None,
    PerPacket(f64),
    InTime { tau_nanos: f64 },
}

/// Why a delay is refused.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum DelayError {
    /// A law with a least value would begin below the floor, where it could not be kept, or its deviation is too large for its mean.
    ReachesBelowFloor {
        /// The name of the law.
        law: &'static str,
        /// The mean delay.
        mean: Duration,
        /// The standard deviation.
        sd: Duration,
        /// The floor.
        floor: Duration,
        /// The largest possible deviation.
        largest: Duration,
    },
    /// The floor lies above the mean.
    FloorAboveMean {
        /// The mean delay.
        mean: Duration,
        /// The floor.
        floor: Duration,
    },
    /// No delays with this law have this correlation.
    Correlation {
        /// What was asked for.
        asked: f64,
        /// The least that there is.
        least: f64,
    },
    /// A correlation time of zero.
    NoTime,
    /// More than 292 years, which cannot be counted with a sign.
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
            Self::TooLong => f.write_str("a delay and its deviation must be below 292 years"),
        }
    }
}

impl core::error::Error for DelayError {}

/// The longest delay and deviation: what an `i64` of nanoseconds holds.
const LONGEST: Duration = Duration::from_nanos(i64::MAX.unsigned_abs());

impl Delay {
    /// One delay for all packets.
    #[must_use]
    pub const fn constant(mean: Duration) -> Self {
        Self { mean, jitter: None }
    }

    /// A delay with jitter. A deviation of zero is no jitter: nothing is drawn.
    ///
    /// # Errors
    ///
    /// [`DelayError`] if the law does not stay above the floor and cannot be cut there, if it cannot have the correlation, or if the spans cannot be
    /// counted.
    pub fn with_jitter(mean: Duration, jitter: Jitter) -> Result<Self, DelayError> {
        if mean > LONGEST || jitter.sd > LONGEST / 2 {
            return Err(DelayError::TooLong);
        }
        let explained = |error| explain(error, mean, &jitter);
        let law = Law::new(&jitter.distribution, nanos(mean), nanos(jitter.sd), Some(nanos(jitter.floor))).map_err(explained)?;
        let memory = match jitter.correlation {
            Correlation::None => Memory::None,
            Correlation::InTime(tau) if tau.is_zero() => return Err(DelayError::NoTime),
            Correlation::InTime(tau) => Memory::InTime { tau_nanos: nanos(tau) },
            // No NaN passes the comparison.
            Correlation::PerPacket(rho) if !(rho > -2.0 && rho < 1.0) => return Err(DelayError::Correlation { asked: rho, least: -1.0 }),
            Correlation::PerPacket(rho) => match law.gaussian_correlation(rho).map_err(explained)? {
                0.0 => Memory::None,
                phi => Memory::PerPacket(phi),
            },
        };
        let jitters = !jitter.sd.is_zero();
        Ok(Self { mean, jitter: jitters.then(|| Arc::new(Checked { jitter, law, memory })) })
    }

    /// The mean delay asked for.
    #[must_use]
    pub const fn mean(&self) -> Duration {
        self.mean
    }

    /// The jitter, if there is any.
    #[must_use]
    pub fn jitter(&self) -> Option<&Jitter> {
        self.jitter.as_deref().map(|checked| &checked.jitter)
    }

    /// The law of the delay of a packet \[ns\], if there is jitter.
    #[must_use]
    pub fn law(&self) -> Option<&Law> {
        self.jitter.as_deref().map(|checked| &checked.law)
    }

    /// No packet is faster than this.
    #[must_use]
    pub fn least(&self) -> Duration {
        self.law().map_or(self.mean, |law| Duration::from_nanos(count(law.least())))
    }
}

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
        // Spans are finite and not negative.
        LawError::NotFinite { .. } | LawError::NegativeDeviation { .. } => DelayError::TooLong,
    }
}

/// The delay stage: draws the delay of each packet.
#[derive(Clone, Debug)]
pub(crate) struct DelayStage {
    mean_nanos: u64,
    law: StageLaw,
}

/// How a delay is drawn; spans as numbers, converted once.
#[derive(Clone, Debug)]
enum StageLaw {
    Constant,
    /// The most frequent law, without a floor.
    Normal {
        sd_nanos: f64,
    },
    Independent(Arc<Checked>),
    /// In a box, as whatever is seldom: the links of a large mesh fill the cache.
    Correlated(Box<Correlated>),
}

#[derive(Clone, Debug)]
struct Correlated {
    checked: Arc<Checked>,
    /// The Gaussian chain: its latest value, and when that was; `None` before the first packet.
    chain: Option<(f64, Instant)>,
}

impl DelayStage {
    pub(crate) fn new(delay: &Delay) -> Self {
        let law = match &delay.jitter {
            None => StageLaw::Constant,
            Some(checked) => match (&checked.jitter, checked.memory) {
                (Jitter { sd, distribution: Distribution::Normal, floor: Duration::ZERO, .. }, Memory::None) => {
                    StageLaw::Normal { sd_nanos: nanos(*sd) }
                }
                (_, Memory::None) => StageLaw::Independent(Arc::clone(checked)),
                (_, Memory::PerPacket(_) | Memory::InTime { .. }) => {
                    StageLaw::Correlated(Box::new(Correlated { checked: Arc::clone(checked), chain: None }))
                }
            },
        };
        Self { mean_nanos: u64::try_from(delay.mean.as_nanos()).unwrap_or(u64::MAX), law }
    }

    /// Whether a delay depends on those before.
    pub(crate) const fn remembers(&self) -> bool {
        matches!(self.law, StageLaw::Correlated(_))
    }

    /// New laws for later packets. Correlated delays go on from where they are.
    pub(crate) fn reconfigure(&mut self, delay: &Delay) {
        let before = core::mem::replace(self, Self::new(delay));
        if let (StageLaw::Correlated(before), StageLaw::Correlated(now)) = (before.law, &mut self.law) {
            now.chain = before.chain;
        }
    }

    /// Whether a delay needs a random word.
    pub(crate) const fn is_random(&self) -> bool {
        !matches!(self.law, StageLaw::Constant)
    }

    /// The delay \[ns\] of one packet, if there is jitter from `word`, the first of its words for jitter. Rounded to the nearest nanosecond.
    #[inline]
    pub(crate) fn draw_nanos(&mut self, now: Instant, word: u64, packet: PacketDraws) -> u64 {
        self.draw_nanos_for(Purpose::Jitter, now, word, packet)
    }

    /// A delay drawn from the words for another purpose.
    #[inline]
    pub(crate) fn draw_nanos_for(&mut self, purpose: Purpose, now: Instant, word: u64, packet: PacketDraws) -> u64 {
        match &self.law {
            StageLaw::Constant => self.mean_nanos,
            StageLaw::Normal { sd_nanos } => {
                let normal = in_the_core(word).unwrap_or_else(|| {
                    let mut more = packet.more(purpose);
                    outside_the_core(word, || more.next_word())
                });
                let deviation = sd_nanos * normal;
                self.mean_nanos.saturating_add_signed(nearest(deviation))
            }
            StageLaw::Independent(_) | StageLaw::Correlated(_) => self.draw_by_law(purpose, now, word, packet),
        }
    }

    #[inline(never)]
    fn draw_by_law(&mut self, purpose: Purpose, now: Instant, word: u64, packet: PacketDraws) -> u64 {
        let mut more = packet.more(purpose);
        match &mut self.law {
            StageLaw::Constant | StageLaw::Normal { .. } => self.mean_nanos,
            StageLaw::Independent(checked) => count(checked.law.draw(word, || more.next_word())),
            StageLaw::Correlated(correlated) => {
                let Correlated { checked, chain } = &mut **correlated;
                let fresh = standard_normal(word, || more.next_word());
                let z = chain.map_or(fresh, |(before, at)| {
                    let phi = match checked.memory {
                        Memory::None => 0.0,
                        Memory::PerPacket(phi) => phi,
                        Memory::InTime { tau_nanos } => libm::exp(-nanos(now.saturating_duration_since(at)) / tau_nanos),
                    };
                    phi * before + fresh_share(phi) * fresh
                });
                *chain = Some((z, now));
                count(checked.law.at_normal(z))
            }
        }
    }
}

/// Correlated delays of many links, each of which keeps its own chain.
#[derive(Clone, Debug)]
pub(crate) struct CorrelatedDelays {
    marginal: Marginal,
    phi: f64,
    fresh_share: f64,
}

/// The law of each of them alone.
#[derive(Clone, Debug)]
enum Marginal {
    Gamma(GammaLaw),
    Other(Arc<Checked>),
}

impl CorrelatedDelays {
    /// Those of a delay, if it is correlated from packet to packet.
    pub(crate) fn new(delay: &Delay) -> Option<Self> {
        let checked = delay.jitter.as_ref()?;
        let Memory::PerPacket(phi) = checked.memory else { return None };
        let marginal = checked.law.as_gamma().map_or_else(|| Marginal::Other(Arc::clone(checked)), Marginal::Gamma);
        Some(Self { marginal, phi, fresh_share: fresh_share(phi) })
    }

    /// The delay \[ns\] of a packet. `chain` is the latest value of its link's chain, NaN before the first packet.
    #[inline(always)]
    pub(crate) fn draw_nanos(&self, chain: &mut f64, word: u64, packet: PacketDraws) -> u64 {
        let fresh = in_the_core(word).unwrap_or_else(|| {
            let mut more = packet.more(Purpose::Jitter);
            outside_the_core(word, || more.next_word())
        });
        *chain = if chain.is_nan() { fresh } else { self.phi * *chain + self.fresh_share * fresh };
        count(match &self.marginal {
            Marginal::Gamma(law) => law.at_normal(*chain),
            Marginal::Other(checked) => checked.law.at_normal(*chain),
        })
    }

    /// What tells most of them for several links at once, if their law does.
    pub(crate) fn cubics(&self) -> Option<GammaCubics> {
        match &self.marginal {
            Marginal::Gamma(law) => law.cubics(),
            Marginal::Other(_) => None,
        }
    }

    /// The values of several chains after these, by the words of packets; NaN for a first packet, and for those few that take further words.
    #[inline(always)]
    pub(crate) fn following<const N: usize>(&self, chains: &[f64; N], words: &[u64; N]) -> [f64; N] {
        // Loops, not `map`, which is a call that no wide registers reach.
        let mut following = [0.0; N];
        for (following, (before, word)) in following.iter_mut().zip(chains.iter().zip(words)) {
            *following = self.phi * before + self.fresh_share * in_the_core_or_nan(*word);
        }
        following
    }
}

/// What a fresh number adds to a chain of variance one.
fn fresh_share(phi: f64) -> f64 {
    libm::sqrt((1.0 - phi) * (1.0 + phi))
}

#[expect(clippy::cast_precision_loss, reason = "a span enters a random law as a real number")]
fn nanos(span: Duration) -> f64 {
    span.as_nanos() as f64
}

/// 2^51.
const SMALL: f64 = 2_251_799_813_685_248.0;

/// The nearest whole number, of two the even one; saturates beyond 2^63.
///
/// Adding 1.5·2^52 leaves no room for a fraction, and the whole number in the lower bits: below 2^51 that is `rint` in an addition and a subtraction, where
/// `libm`'s is a call, which added a quarter to a tick of ten peers over links with jitter.
#[inline]
#[expect(clippy::cast_possible_truncation, reason = "saturates")]
fn nearest(number: f64) -> i64 {
    if number.abs() < SMALL { with_room(number) } else { libm::rint(number) as i64 }
}

/// [`nearest`] of a number smaller than [`SMALL`].
#[inline(always)]
#[expect(clippy::cast_possible_wrap, reason = "a difference of bits that may be negative")]
fn with_room(number: f64) -> i64 {
    const ROOM: f64 = 6_755_399_441_055_744.0;
    (number + ROOM).to_bits().wrapping_sub(ROOM.to_bits()) as i64
}

/// A delay as a whole number of nanoseconds: laws are not below their floor.
#[inline]
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates beyond 584 years")]
fn count(nanos: f64) -> u64 {
    if nanos < SMALL { with_room(nanos).cast_unsigned() } else { libm::rint(nanos) as u64 }
}

/// The parameters of the delay and of its jitter.
pub(crate) const KEYS: [Key; 2] = [
    usual("delay", Form::Duration, "\"0s\"", "One-way propagation delay; the mean if there is jitter"),
    optional("jitter", JITTER, "Standard deviation of the delay, with a normal law, or a table that also names law, floor and memory"),
];
pub(crate) const JITTER: Form = Form::AnyOf(&[Form::Duration, Form::Table(&JITTER_TABLE)]);
static JITTER_TABLE: Table = Table::of(&[&[
    optional("sd", Form::Duration, "Standard deviation. Must be given, but for measured delays: theirs then"),
    usual("distribution", Form::AnyOf(const { &[Form::Words(&LAWS), Form::Table(&LAW_FILE)] }), "\"normal\"", "The law of the delay"),
    usual("floor", Form::Duration, "\"0s\"", "No packet is faster"),
    usual("correlation", number(CORRELATION), "0", "Correlation of a packet's delay with that of the one before"),
    optional("correlation-time", Form::PositiveDuration, "In place of correlation: the time over which delays forget, whatever is sent"),
]]);
const LAWS: [(&str, &str); 8] = words(&Distribution::CHOICES);

impl Distribution {
    /// The words of files for laws that need no file.
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
    optional("table", Form::File, "A .dist table as tc reads it"),
    optional("empirical", Form::File, "A CSV file of measured delays with the header delay, in seconds"),
]]);

impl Delay {
    /// The mean and the jitter in words.
    pub(crate) fn words(&self) -> String {
        let mean = Span(self.mean());
        let Some(Jitter { sd, distribution, floor, correlation }) = self.jitter() else { return mean.to_string() };
        let floor = if *floor == Duration::ZERO { String::new() } else { format!(", never below {}", Span(*floor)) };
        let memory = match correlation {
            Correlation::None => String::new(),
            Correlation::PerPacket(correlation) => format!(", correlation {correlation} from packet to packet"),
            Correlation::InTime(time) => format!(", correlated over {}", Span(*time)),
        };
        format!("{mean}, {} jitter of {}{floor}{memory}", distribution.words(), Span(*sd))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;

    const MILLISECOND: Duration = Duration::from_millis(1);

    #[test]
    fn the_nearest_whole_number_is_what_rint_says() {
        let halves = (-9..=9).map(|number| f64::from(number) / 2.0);
        let edges =
            [0.0, -0.0, 2_251_799_813_685_247.5, -2_251_799_813_685_247.5, 2_251_799_813_685_248.5, 4.5e15, -4.5e15, 1e19, -1e19, f64::INFINITY];
        let drawn =
            (0..100_000).map(|n| Stream::new(3, b"nearest").packet(n).first(Purpose::Jitter).cast_signed() as f64 / 2_f64.powi((n % 80) as i32));
        for number in halves.chain(edges).chain(drawn) {
            assert_eq!(nearest(number), libm::rint(number) as i64, "{number}");
        }
    }

    /// Delays \[ms\] of packets so far apart.
    fn draws(delay: &Delay, count: u64, gap: Duration) -> Vec<f64> {
        let stream = Stream::new(1, b"delay");
        let mut stage = DelayStage::new(delay);
        let mut now = Instant::ZERO;
        let mut draw = |packet: PacketDraws| {
            now += gap;
            stage.draw_nanos(now, packet.first(Purpose::Jitter), packet) as f64 / 1e6
        };
        (0..count).map(|number| draw(stream.packet(number))).collect()
    }

    /// The largest distance between the empirical distribution and that of the delay's law (Kolmogorov).
    fn kolmogorov(delay: &Delay, mut sample: Vec<f64>) -> f64 {
        sample.sort_by(f64::total_cmp);
        let n = sample.len() as f64;
        let cdf = |x: f64| delay.law().unwrap().cdf(x * 1e6);
        sample.iter().enumerate().map(|(i, &x)| (cdf(x) - i as f64 / n).max((i + 1) as f64 / n - cdf(x))).fold(0.0, f64::max)
    }

    // Kolmogorov–Smirnov, n = 100 000: the 0.999 quantile of the distance is 1.9495/√n = 0.00616.
    const KS_BOUND: f64 = 0.006_16;

    fn all_laws() -> [Distribution; 8] {
        use Distribution::{Gamma, Laplace, LogNormal, Normal, Pareto, ParetoNormal, Uniform, Weibull};
        [Normal, Uniform, Pareto, ParetoNormal, LogNormal, Gamma, Weibull, Laplace]
    }

    #[test]
    fn independent_delays_have_their_law() {
        for distribution in all_laws() {
            let jitter = Jitter { floor: 10 * MILLISECOND, ..Jitter::new(2 * MILLISECOND, distribution.clone()) };
            let delay = Delay::with_jitter(24 * MILLISECOND, jitter).unwrap();
            let sample = draws(&delay, 100_000, MILLISECOND);
            let least = delay.least().as_secs_f64() * 1e3;
            assert!(sample.iter().all(|x| *x >= least - 1e-9), "{distribution:?}");
            assert!(kolmogorov(&delay, sample) < KS_BOUND, "{distribution:?}");
        }
    }

    /// Lag-one autocorrelation 0.9 by packet, and φ = e^(−8/76) = 0.9 in time at a spacing of 8 ms: of 100 000 delays the autocorrelation of a Gaussian
    /// AR(1) has the standard error √((1−ρ²)/n) = 0.0014; other laws have heavier tails, at most three times that here.
    #[test]
    fn correlated_delays_have_their_law_and_their_correlation() {
        for distribution in [Distribution::Normal, Distribution::Uniform, Distribution::Gamma, Distribution::LogNormal] {
            let tau = Duration::from_secs_f64(-0.008 / 0.9_f64.ln());
            for correlation in [Correlation::PerPacket(0.9), Correlation::InTime(tau)] {
                let jitter = Jitter { correlation, ..Jitter::new(2 * MILLISECOND, distribution.clone()) };
                let delay = Delay::with_jitter(24 * MILLISECOND, jitter).unwrap();
                let sample = draws(&delay, 100_000, 8 * MILLISECOND);
                let n = sample.len() as f64;
                let mean = sample.iter().sum::<f64>() / n;
                let variance = sample.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
                let covariance = sample.windows(2).map(|pair| (pair[0] - mean) * (pair[1] - mean)).sum::<f64>() / n;
                let expected = match correlation {
                    Correlation::PerPacket(rho) => rho,
                    Correlation::None | Correlation::InTime(_) => delay.law().unwrap().correlation(0.9),
                };
                assert!((covariance / variance - expected).abs() < 4.5 * 3.0 * 0.0014, "{distribution:?} {correlation:?} {}", covariance / variance);
                // Every 50th is independent of the others but for 0.9^50 = 0.5 %: n = 2000.
                let thinned: Vec<f64> = sample.into_iter().step_by(50).collect();
                assert!(kolmogorov(&delay, thinned) < 1.9495 / 2000_f64.sqrt(), "{distribution:?} {correlation:?}");
            }
        }
    }

    #[test]
    fn a_normal_law_that_reaches_zero_is_cut_there() {
        let wide = Delay::with_jitter(MILLISECOND, Jitter::new(2 * MILLISECOND, Distribution::Normal)).unwrap();
        assert_eq!(wide.least(), Duration::ZERO);
        assert!(draws(&wide, 10_000, MILLISECOND).contains(&0.0));
    }

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
        let floor = Jitter { floor: 2 * MILLISECOND, ..jitter(Distribution::Normal, Correlation::None) };
        assert!(matches!(refused(floor), DelayError::FloorAboveMean { .. }));
    }

    #[test]
    fn a_deviation_of_zero_is_a_constant_delay() {
        let delay = Delay::with_jitter(MILLISECOND, Jitter::new(Duration::ZERO, Distribution::Gamma)).unwrap();
        assert_eq!(delay, Delay::constant(MILLISECOND));
    }
}
