//! Stage of a link: the delay of each packet, drawn alone or for many links together.

use alloc::boxed::Box;
use alloc::sync::Arc;
use core::time::Duration;

use cohaptic_units::Instant;

use super::{Checked, Delay, Jitter, Memory, nanos};
use crate::laws::delay::{Distribution, GammaCubics, GammaLaw, Law};
use crate::laws::normal::{in_the_core, in_the_core_or_nan, outside_the_core, standard_normal};
use crate::random::{PacketDraws, Purpose};

/// Delay stage, with the draw of each packet's delay.
#[derive(Clone, Debug)]
pub(crate) struct DelayStage {
    mean_nanos: u64,
    law: StageLaw,
}

/// Way of drawing a delay. Spans are numbers of nanoseconds, converted once.
#[derive(Clone, Debug)]
enum StageLaw {
    Constant,
    /// Normal jitter without floor and without correlation: the most frequent law, without need for shared data.
    Normal {
        sd_nanos: f64,
    },
    /// Laws drawn from a normal number: lognormal and gamma.
    FromNormal(Arc<Checked>),
    Independent(Arc<Checked>),
    /// Boxed, because few links have correlated delays and an unboxed chain would enlarge the delay stage of every link.
    Correlated(Box<Correlated>),
}

#[derive(Clone, Debug)]
struct Correlated {
    checked: Arc<Checked>,
    /// Latest value of the Gaussian chain and its instant, or `None` before the first packet.
    chain: Option<(f64, Instant)>,
    weights: Weights,
}

/// Shares of the latest value and of a fresh normal number in the next value of a Gaussian chain. Kept from packet to packet, because most streams have equal
/// spans between packets, and a share takes an exponential.
#[derive(Clone, Copy, Debug)]
struct Weights {
    /// Time since the packet before \[ns\]. Without meaning under [`Memory::PerPacket`].
    span: u64,
    phi: f64,
    fresh: f64,
}

impl Weights {
    fn new(memory: Memory, span: u64) -> Self {
        // The law of a value stays standard normal, because φ² and the square of the fresh share add up to one.
        let phi = match memory {
            Memory::None => 0.0,
            Memory::PerPacket(phi) => phi,
            // φ = e^(−Δ/τ) of an Ornstein–Uhlenbeck process.
            Memory::InTime { tau_nanos, .. } => libm::exp(-nanos(Duration::from_nanos(span)) / tau_nanos),
        };
        Self { span, phi, fresh: fresh_share(phi) }
    }
}

impl DelayStage {
    pub(crate) fn new(delay: &Delay) -> Self {
        // The cheapest fitting way of drawing is chosen once, not at each packet.
        let law = match &delay.jitter {
            None => StageLaw::Constant,
            Some(checked) => match (&checked.jitter, checked.memory) {
                (Jitter { sd, distribution: Distribution::Normal, floor: Duration::ZERO, .. }, Memory::None) => {
                    StageLaw::Normal { sd_nanos: nanos(*sd) }
                }
                (Jitter { distribution: Distribution::LogNormal | Distribution::Gamma, .. }, Memory::None) => {
                    StageLaw::FromNormal(Arc::clone(checked))
                }
                (_, Memory::None) => StageLaw::Independent(Arc::clone(checked)),
                (_, Memory::PerPacket(_) | Memory::InTime { .. }) => {
                    StageLaw::Correlated(Box::new(Correlated { checked: Arc::clone(checked), chain: None, weights: Weights::new(checked.memory, 0) }))
                }
            },
        };
        Self { mean_nanos: u64::try_from(delay.mean.as_nanos()).unwrap_or(u64::MAX), law }
    }

    /// Sets the delay of later packets. A chain of correlated delays continues from its present value.
    pub(crate) fn reconfigure(&mut self, delay: &Delay) {
        let before = core::mem::replace(self, Self::new(delay));
        // The chain is standard normal under every law, so its value is valid for the new law too.
        if let (StageLaw::Correlated(before), StageLaw::Correlated(now)) = (before.law, &mut self.law) {
            now.chain = before.chain;
        }
    }

    /// Returns whether drawing a delay needs a random word.
    pub(crate) const fn is_random(&self) -> bool {
        !matches!(self.law, StageLaw::Constant)
    }

    /// Returns the delay of one packet \[ns\], rounded to the nearest nanosecond. If there is jitter, `word` is the packet's first random word for jitter, and
    /// `packet` makes the packet's draws where `word` is not enough.
    #[inline(always)]
    pub(crate) fn draw_nanos(&mut self, now: Instant, word: u64, packet: impl FnOnce() -> PacketDraws) -> u64 {
        self.draw_nanos_for(Purpose::Jitter, now, word, packet)
    }

    /// Returns a delay \[ns\] like [`draw_nanos`](Self::draw_nanos), drawn from the packet's random words for `purpose`.
    #[inline(always)]
    pub(crate) fn draw_nanos_for(&mut self, purpose: Purpose, now: Instant, word: u64, packet: impl FnOnce() -> PacketDraws) -> u64 {
        // The most frequent law is tested first: a choice between all laws is an indirect jump at each packet.
        if let StageLaw::Normal { sd_nanos } = self.law {
            let deviation = sd_nanos * normal(purpose, word, packet);
            // A large negative deviation ends at a delay of zero: the floor of this law.
            return self.mean_nanos.saturating_add_signed(nearest(deviation));
        }
        match &self.law {
            StageLaw::Constant | StageLaw::Normal { .. } => self.mean_nanos,
            StageLaw::FromNormal(checked) => from_normal(&checked.law, purpose, word, packet()),
            StageLaw::Independent(_) | StageLaw::Correlated(_) => self.draw_by_law(purpose, now, word, packet()),
        }
    }

    /// Returns the delays \[ns\] of several packets with these first random words for jitter, or [`Law::UNKNOWN`] for the few delays that need further words or
    /// more digits, and for all delays of a law that is not drawn from a normal number.
    #[inline(always)]
    pub(crate) fn nanos_at_once<const N: usize>(&self, words: &[u64; N]) -> [u64; N] {
        let mut nanos = [Law::UNKNOWN; N];
        match &self.law {
            StageLaw::Constant => nanos = [self.mean_nanos; N],
            StageLaw::Normal { sd_nanos } => {
                // Beyond 2^62 the sum below could overflow.
                let Some(mean) = i64::try_from(self.mean_nanos).ok().filter(|mean| *mean < 1 << 62) else { return nanos };
                for (nanos, word) in nanos.iter_mut().zip(words) {
                    let deviation = sd_nanos * in_the_core_or_nan(*word);
                    // A NaN fails the comparison. As in `draw_nanos`, a large negative deviation ends at a delay of zero.
                    let whole = mean.wrapping_add(with_room(deviation)).max(0).cast_unsigned();
                    *nanos = if deviation.abs() < SMALL { whole } else { Law::UNKNOWN };
                }
            }
            StageLaw::FromNormal(checked) => {
                let mut z = [0.0; N];
                for (z, word) in z.iter_mut().zip(words) {
                    *z = in_the_core_or_nan(*word);
                }
                nanos = checked.law.whole_at_normals(&z);
            }
            StageLaw::Independent(_) | StageLaw::Correlated(_) => {}
        }
        nanos
    }

    /// Returns a delay \[ns\] of the laws without inline draw.
    #[inline(never)]
    fn draw_by_law(&mut self, purpose: Purpose, now: Instant, word: u64, packet: PacketDraws) -> u64 {
        let mut more = packet.more(purpose);
        match &mut self.law {
            StageLaw::Constant | StageLaw::Normal { .. } => self.mean_nanos,
            StageLaw::FromNormal(checked) | StageLaw::Independent(checked) => count(checked.law.draw(word, || more.next_word())),
            StageLaw::Correlated(correlated) => {
                let Correlated { checked, chain, weights } = &mut **correlated;
                let fresh = standard_normal(word, || more.next_word());
                let z = chain.map_or(fresh, |(before, at)| {
                    let span = now.as_nanos().saturating_sub(at.as_nanos());
                    if span != weights.span && matches!(checked.memory, Memory::InTime { .. }) {
                        *weights = Weights::new(checked.memory, span);
                    }
                    weights.phi * before + weights.fresh * fresh
                });
                *chain = Some((z, now));
                at_normal(&checked.law, mixed(checked.memory, z, || standard_normal(more.next_word(), || more.next_word())))
            }
        }
    }
}

/// Law of correlated delays, for many links with a chain each.
#[derive(Clone, Debug)]
pub(crate) struct CorrelatedDelays {
    marginal: Marginal,
    /// Law of a delay, if a delay is computed from the value of its chain alone: lognormal and gamma, where the whole variance has memory.
    law: Option<Arc<Checked>>,
    memory: Memory,
    /// `true` if only a share of the variance has memory.
    is_of_share: bool,
    weights: Weights,
}

/// Law of a single delay.
#[derive(Clone, Debug)]
enum Marginal {
    Gamma(GammaLaw),
    Other(Arc<Checked>),
}

impl CorrelatedDelays {
    /// Returns the law of `delay` if its delays are correlated, and `None` otherwise.
    pub(crate) fn new(delay: &Delay) -> Option<Self> {
        let checked = delay.jitter.as_ref()?;
        let memory = checked.memory;
        if memory == Memory::None {
            return None;
        }
        // A gamma law gets a separate form, without the choice between laws at each packet.
        let marginal = checked.law.as_gamma().map_or_else(|| Marginal::Other(Arc::clone(checked)), Marginal::Gamma);
        let is_of_share = matches!(memory, Memory::InTime { parts: [_, rest], .. } if rest > 0.0);
        let is_from_normal = matches!(checked.jitter.distribution, Distribution::LogNormal | Distribution::Gamma);
        let law = (is_from_normal && !is_of_share).then(|| Arc::clone(checked));
        Some(Self { marginal, law, memory, is_of_share, weights: Weights::new(memory, 0) })
    }

    /// Returns the next values of several chains with these latest values, and the delays \[ns\]. A delay is [`Law::UNKNOWN`] where
    /// [`draw_nanos`](Self::draw_nanos) must draw it, and the value has no meaning then.
    #[inline(always)]
    pub(crate) fn nanos_at_once<const N: usize>(&self, chains: &[f64; N], words: &[u64; N]) -> ([f64; N], [u64; N]) {
        let Some(checked) = &self.law else { return ([f64::NAN; N], [Law::UNKNOWN; N]) };
        let following = self.following(chains, words);
        let nanos = checked.law.whole_at_normals(&following);
        (following, nanos)
    }

    /// Returns the instant since which the present weights are those of a packet that begins to propagate `now`: the latest value of its chain must be of this
    /// instant. Links that are offered packets together have the weights of one span. Returns `None` if the weights do not depend on time.
    #[inline(always)]
    pub(crate) fn since(&self, now: Instant) -> Option<Instant> {
        self.is_in_time().then(|| Instant::from_nanos(now.as_nanos().wrapping_sub(self.weights.span)))
    }

    /// Returns whether the correlation depends on the time between packets.
    pub(crate) const fn is_in_time(&self) -> bool {
        matches!(self.memory, Memory::InTime { .. })
    }

    /// Returns the delay \[ns\] of a packet that begins to propagate `now`. `chain` is the latest value of its link's chain and the instant of the value, or
    /// NaN before the first packet; the call replaces both.
    #[inline(always)]
    pub(crate) fn draw_nanos(&mut self, now: Instant, (chain, at): (&mut f64, &mut Instant), word: u64, packet: PacketDraws) -> u64 {
        if self.is_in_time() {
            let span = now.as_nanos().saturating_sub(at.as_nanos());
            // Links that are offered packets together share the weights, so that the weights are computed once for all these links.
            if span != self.weights.span {
                self.weights = Weights::new(self.memory, span);
            }
            *at = now;
        }
        self.next_nanos(chain, word, packet)
    }

    /// Returns the delay of a packet \[ns\], with the present weights. `chain` is as for [`draw_nanos`](Self::draw_nanos).
    #[inline(always)]
    pub(crate) fn next_nanos(&self, chain: &mut f64, word: u64, packet: PacketDraws) -> u64 {
        if self.is_of_share {
            return self.next_of_share(chain, packet);
        }
        let fresh = normal(Purpose::Jitter, word, || packet);
        self.move_on(chain, fresh);
        self.nanos_at(*chain)
    }

    /// Returns the delay of a packet \[ns\] if only a share of the variance has memory. Not inlined, because few links have such a memory.
    #[inline(never)]
    fn next_of_share(&self, chain: &mut f64, packet: PacketDraws) -> u64 {
        let mut words = packet.draws(Purpose::Jitter);
        let mut normal = || standard_normal(words.next_word(), || words.next_word());
        self.move_on(chain, normal());
        self.nanos_at(mixed(self.memory, *chain, normal))
    }

    /// Replaces the value of a chain, or NaN before the first packet, by the next value.
    #[inline(always)]
    fn move_on(&self, chain: &mut f64, fresh: f64) {
        // The first value has the stationary law of the chain, so no start-up transient exists.
        *chain = if chain.is_nan() { fresh } else { self.weights.phi * *chain + self.weights.fresh * fresh };
    }

    #[inline(always)]
    fn nanos_at(&self, z: f64) -> u64 {
        match &self.marginal {
            Marginal::Gamma(law) => count(law.at_normal(z)),
            Marginal::Other(checked) => at_normal(&checked.law, z),
        }
    }

    /// Returns the cubics for most delays of several links at once, or `None` if the law has no cubics.
    pub(crate) fn cubics(&self) -> Option<GammaCubics> {
        match &self.marginal {
            Marginal::Gamma(law) => law.cubics(),
            Marginal::Other(_) => None,
        }
    }

    /// Returns the next values of several chains, given the packets' random words. A value is NaN for a first packet, and for the few packets that need further
    /// random words.
    #[inline(always)]
    pub(crate) fn following<const N: usize>(&self, chains: &[f64; N], words: &[u64; N]) -> [f64; N] {
        // A loop instead of `map`: the compiler does not inline `map` of an array here, and a call prevents vector instructions.
        let mut following = [0.0; N];
        for (following, (before, word)) in following.iter_mut().zip(chains.iter().zip(words)) {
            *following = self.weights.phi * before + self.weights.fresh * in_the_core_or_nan(*word);
        }
        following
    }
}

/// Returns the normal number of a delay: the value of its chain, mixed with a number of the packet alone where only a share of the variance has memory.
#[inline(always)]
fn mixed(memory: Memory, chain: f64, alone: impl FnOnce() -> f64) -> f64 {
    match memory {
        Memory::InTime { parts: [of_chain, rest], .. } if rest > 0.0 => of_chain * chain + rest * alone(),
        Memory::None | Memory::PerPacket(_) | Memory::InTime { .. } => chain,
    }
}

/// Returns √(1 − φ²), the factor of a fresh normal number in a chain of variance one.
fn fresh_share(phi: f64) -> f64 {
    // Written as a product, so no digits cancel for φ near 1.
    libm::sqrt((1.0 - phi) * (1.0 + phi))
}

/// 2^51, the bound below which [`with_room`] is exact.
const SMALL: f64 = 2_251_799_813_685_248.0;

/// Returns the nearest whole number, and of two equally near numbers the even number. Saturates beyond 2^63.
///
/// Adding 1.5·2^52 leaves no bits for a fraction, so the sum is rounded and its lower bits hold the whole number. Below 2^51 the result is equal to `rint`,
/// without the call to `libm`.
#[inline]
#[expect(clippy::cast_possible_truncation, reason = "saturates")]
fn nearest(number: f64) -> i64 {
    if number.abs() < SMALL { with_room(number) } else { libm::rint(number) as i64 }
}

/// Returns [`nearest`] of a number whose magnitude is below [`SMALL`].
#[inline(always)]
#[expect(clippy::cast_possible_wrap, reason = "a difference of bits that may be negative")]
fn with_room(number: f64) -> i64 {
    const ROOM: f64 = 6_755_399_441_055_744.0;
    (number + ROOM).to_bits().wrapping_sub(ROOM.to_bits()) as i64
}

/// Returns the standard normal number of a packet. Nearly all numbers follow from the first word alone. Only numbers outside the core need further words.
#[inline(always)]
fn normal(purpose: Purpose, word: u64, packet: impl FnOnce() -> PacketDraws) -> f64 {
    in_the_core(word).unwrap_or_else(|| {
        let mut more = packet().more(purpose);
        outside_the_core(word, || more.next_word())
    })
}

/// Returns a delay of a law that is drawn from a normal number. Not inlined, so that the draw of the normal law, the most frequent law, stays small enough
/// for inlining.
#[inline(never)]
fn from_normal(law: &Law, purpose: Purpose, word: u64, packet: PacketDraws) -> u64 {
    at_normal(law, normal(purpose, word, || packet))
}

/// Returns the delay of a normal number as a whole number of nanoseconds.
#[inline(always)]
fn at_normal(law: &Law, z: f64) -> u64 {
    law.whole_at_normal(z).unwrap_or_else(|| count(law.at_normal(z)))
}

/// Returns a delay as a whole number of nanoseconds. The delay is not negative, because no law is below its floor.
#[inline]
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates beyond 584 years")]
pub(super) fn count(nanos: f64) -> u64 {
    if nanos < SMALL { with_room(nanos).cast_unsigned() } else { libm::rint(nanos) as u64 }
}

#[cfg(test)]
mod tests {
    use super::super::Correlation;
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

    /// Returns delays \[ms\] of `count` packets that are `gap` apart.
    fn draws(delay: &Delay, count: u64, gap: Duration) -> Vec<f64> {
        let stream = Stream::new(1, b"delay");
        let mut stage = DelayStage::new(delay);
        let mut now = Instant::ZERO;
        let mut draw = |packet: PacketDraws| {
            now += gap;
            stage.draw_nanos(now, packet.first(Purpose::Jitter), || packet) as f64 / 1e6
        };
        (0..count).map(|number| draw(stream.packet(number))).collect()
    }

    /// Returns the largest distance between the empirical distribution and the distribution of the delay's law (Kolmogorov).
    fn kolmogorov(delay: &Delay, mut sample: Vec<f64>) -> f64 {
        sample.sort_by(f64::total_cmp);
        let n = sample.len() as f64;
        let cdf = |x: f64| delay.law().unwrap().cdf(x * 1e6);
        sample.iter().enumerate().map(|(i, &x)| (cdf(x) - i as f64 / n).max((i + 1) as f64 / n - cdf(x))).fold(0.0, f64::max)
    }

    /// Kolmogorov–Smirnov: the 0.999 quantile of √n times the distance.
    const KS: f64 = 1.9495;

    fn all_laws() -> [Distribution; 8] {
        use Distribution::{Gamma, Laplace, LogNormal, Normal, Pareto, ParetoNormal, Uniform, Weibull};
        [Normal, Uniform, Pareto, ParetoNormal, LogNormal, Gamma, Weibull, Laplace]
    }

    #[test]
    fn independent_delays_have_their_law() {
        let count = cohaptic_tests_common::quarter_by_day(100_000);
        for distribution in all_laws() {
            let jitter = Jitter { floor: 10 * MILLISECOND, ..Jitter::new(2 * MILLISECOND, distribution.clone()) };
            let delay = Delay::with_jitter(24 * MILLISECOND, jitter).unwrap();
            let sample = draws(&delay, count, MILLISECOND);
            let least = delay.least().as_secs_f64() * 1e3;
            assert!(sample.iter().all(|x| *x >= least - 1e-9), "{distribution:?}");
            assert!(kolmogorov(&delay, sample) < KS / (count as f64).sqrt(), "{distribution:?}");
        }
    }

    /// Lag-one autocorrelation 0.9 by packet, and φ = e^(−8/76) = 0.9 in time at a spacing of 8 ms: of 100 000 delays the autocorrelation of a Gaussian
    /// AR(1) has the standard error √((1−ρ²)/n) = 0.0014; other laws have heavier tails, at most three times this error here.
    #[test]
    fn correlated_delays_have_their_law_and_their_correlation() {
        for distribution in [Distribution::Normal, Distribution::Uniform, Distribution::Gamma, Distribution::LogNormal] {
            let tau = Duration::from_secs_f64(-0.008 / 0.9_f64.ln());
            for correlation in [Correlation::PerPacket(0.9), Correlation::InTime(tau), Correlation::PartlyInTime { time: tau, share: 0.6 }] {
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
                    Correlation::PartlyInTime { share, .. } => delay.law().unwrap().correlation(share * 0.9),
                };
                assert!((covariance / variance - expected).abs() < 4.5 * 3.0 * 0.0014, "{distribution:?} {correlation:?} {}", covariance / variance);
                // Every 50th delay is independent of the others except for a correlation of 0.9^50 = 0.5 %: n = 2000.
                let thinned: Vec<f64> = sample.into_iter().step_by(50).collect();
                assert!(kolmogorov(&delay, thinned) < 1.9495 / 2000_f64.sqrt(), "{distribution:?} {correlation:?}");
            }
        }
    }

    #[test]
    fn a_share_of_one_is_the_whole_memory() {
        for distribution in [Distribution::Normal, Distribution::Gamma] {
            let with = |correlation| {
                let jitter = Jitter { correlation, ..Jitter::new(2 * MILLISECOND, distribution.clone()) };
                draws(&Delay::with_jitter(24 * MILLISECOND, jitter).unwrap(), 1_000, 8 * MILLISECOND)
            };
            let time = 76 * MILLISECOND;
            assert_eq!(with(Correlation::PartlyInTime { time, share: 1.0 }), with(Correlation::InTime(time)), "{distribution:?}");
        }
    }

    #[test]
    fn a_normal_law_that_reaches_zero_is_cut_there() {
        let wide = Delay::with_jitter(MILLISECOND, Jitter::new(2 * MILLISECOND, Distribution::Normal)).unwrap();
        assert_eq!(wide.least(), Duration::ZERO);
        assert!(draws(&wide, 10_000, MILLISECOND).contains(&0.0));
    }
}
