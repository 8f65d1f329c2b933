//! Spikes of delay, as at a handover of a radio link: at random instants all packets become late, and the additional delay decays.
//!
//! Spikes begin at the instants s of a Poisson process of `rate`. A packet with its propagation beginning at t is late by the sum of all begun spikes, Σ
//! `height`·exp(−(t − s)/`decay`) over s ≤ t: shot noise with an exponential pulse. By Campbell's theorem (N. R. Campbell, Proc. Cambridge Phil. Soc. 15,
//! 1909) the sum has the long-run mean `rate`·`height`·`decay` and the long-run variance `rate`·`height`²·`decay`/2. The process begins without spikes, so
//! the mean at t is smaller by a factor of 1 − exp(−t/`decay`).
//!
//! The instants depend on the link's random numbers and not on the packets: the n-th gap has the random numbers of "packet" n.

use alloc::format;
use alloc::string::{String, ToString as _};
use core::time::Duration;

use cohaptic_units::Instant;
use cohaptic_units::print::Span;

use crate::laws::sojourn::Sojourn;
use crate::packet::PacketInfo;
use crate::parameters::{Form, Key, NONE, Quantity, Table, number, required, usual};
use crate::random::{Purpose, Stream};
use crate::stages::impairment::{ExtraDelay, Impairment, ImpairmentStage, Refusal, Values};

/// Configuration of spikes of delay at random instants.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Spike {
    /// Mean number of spikes beginning in a second \[1/s\]; from 0 to [`MOST`].
    rate: f64,
    /// Additional delay of each spike at its begin.
    height: Duration,
    /// Time of a spike's fall to 1/e; above zero.
    decay: Duration,
}

/// Highest rate \[1/s\]. The rate is bounded because the stage computes every spike.
const MOST: f64 = 1e6;

static PARAMETERS: Table = Table::of(&[&[
    required("rate", number(Quantity::not_negative("1/s")), "Mean number of spikes per second, at most 1000000"),
    required("height", Form::Duration, "Additional delay at the beginning of a spike"),
    required("decay", Form::Duration, "Time in which a spike falls to 1/e of its height"),
]]);

impl Impairment for Spike {
    type Stage = SpikeStage;

    const KEY: Key = usual(
        "spike",
        Form::AnyOf(const { &[Form::Table(&PARAMETERS), NONE] }),
        "\"none\"",
        "Additional delays that begin at random and decay, as at a handover",
    );

    fn of(values: &Values) -> Result<Self, Refusal> {
        let (rate, height, decay) = (values.number("rate"), values.duration("height"), values.duration("decay"));
        let refuse = |key, message: String| Err(Refusal { key, message });
        // A range contains no NaN, so NaN is refused as well.
        if !(0.0..=MOST).contains(&rate) {
            return refuse("rate", format!("{rate} is out of range: expected at most {MOST} spikes per second"));
        }
        if decay.is_zero() {
            return refuse("decay", "zero is out of range: expected a duration above zero such as \"300ms\"".to_string());
        }
        Ok(Self { rate, height, decay })
    }

    fn words(&self) -> String {
        format!("spikes of {} with a decay of {}, {} per second", Span(self.height), Span(self.decay), self.rate)
    }

    fn extra_delay(&self) -> ExtraDelay {
        let (height, decay) = (self.height.as_secs_f64(), self.decay.as_secs_f64());
        // Campbell's theorem: see the head of this file.
        ExtraDelay { mean: self.rate * height * decay, variance: self.rate * height * height * decay / 2.0 }
    }
}

/// Stage with the sum of the begun spikes, and the instant of the next spike.
#[derive(Clone, Debug)]
pub(crate) struct SpikeStage {
    draws: Stream,
    code: u8,
    /// Present configuration. `None` while the link has no spikes.
    config: Option<Spike>,
    /// Number of gaps drawn so far: the address of the next gap's random numbers.
    drawn: u64,
    /// Begin of the next spike, or the end of time if no spike will begin.
    next: Instant,
    /// Sum of all spikes \[ns\] at the instant `at` of the latest event: a spike or a change of the configuration.
    level: f64,
    at: Instant,
}

impl ImpairmentStage for SpikeStage {
    type Config = Spike;

    /// Returns the stage for a new configuration. Begun spikes continue from their present level with the new decay. If the rate changes, the next gap is drawn
    /// anew. This keeps the law, because exponential gaps have no memory. Without a configuration no packet is late.
    fn reconfigured(before: Option<Self>, now: Instant, config: Option<&Spike>, draws: Stream, code: u8) -> Option<Self> {
        if before.is_none() && config.is_none() {
            return None;
        }
        let beginning = Self { draws, code, config: None, drawn: 0, next: Instant::MAX, level: 0.0, at: now };
        let mut stage = before.unwrap_or(beginning);
        // Spikes due until `now` still have the height and the decay of the old configuration.
        stage.pass(now);
        (stage.level, stage.at) = (stage.level_at(now), now);
        let rate = |config: Option<&Spike>| config.map_or(0.0, |config| config.rate);
        // The next gap stays only if the rate is the same to the bit.
        let same_rate = rate(stage.config.as_ref()).to_bits() == rate(config).to_bits();
        stage.config = config.cloned();
        if config.is_none() {
            stage.level = 0.0;
        }
        // An exponential gap has no memory, so a new gap may begin at the present instant.
        if !same_rate {
            stage.next = now;
            stage.draw_next();
        }
        Some(stage)
    }

    fn delay_nanos(&mut self, now: Instant, _packet: PacketInfo) -> u64 {
        self.pass(now);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "not negative; saturates beyond 584 years")]
        let nanos = libm::rint(self.level_at(now)) as u64;
        nanos
    }
}

impl SpikeStage {
    /// Begins all spikes due at `now`. The level is computed at the instants of spikes only, so rounding does not depend on the instants of packets.
    fn pass(&mut self, now: Instant) {
        while self.next <= now && self.next < Instant::MAX {
            let height = self.config.as_ref().map_or(0.0, |config| nanos(config.height));
            self.level = self.level_at(self.next) + height;
            self.at = self.next;
            self.draw_next();
        }
    }

    /// Returns the sum of the begun spikes \[ns\] at the instant `now`, not before the latest event.
    fn level_at(&self, now: Instant) -> f64 {
        let Some(config) = &self.config else { return 0.0 };
        // A sum of exponential pulses with one decay decays as a whole, so one number stands for all spikes.
        self.level * libm::exp(-nanos(now.saturating_duration_since(self.at)) / nanos(config.decay))
    }

    /// Draws the gap from the spike at `next` to the following spike, and moves `next` to this spike.
    fn draw_next(&mut self) {
        let rate = self.config.as_ref().map_or(0.0, |config| config.rate);
        if rate == 0.0 {
            self.next = Instant::MAX;
            return;
        }
        let mut draws = self.draws.packet(self.drawn).draws(Purpose::Listed(self.code));
        self.drawn += 1;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "positive; saturates at 584 years")]
        // Gaps of a Poisson process are exponential, with the mean 1/rate.
        let mean = Duration::from_nanos(libm::rint(1e9 / rate) as u64);
        self.next = self.next.saturating_add(Sojourn::Exponential(mean).draw(|| draws.next_word()));
    }
}

/// Returns a span in nanoseconds.
#[expect(clippy::cast_precision_loss, reason = "a span enters a random law as a real number")]
fn nanos(span: Duration) -> f64 {
    span.as_nanos() as f64
}

#[cfg(test)]
mod tests {
    use alloc::sync::Arc;
    use alloc::vec::Vec;

    use cohaptic_units::Bytes;

    use super::*;
    use crate::stages::impairment::ParameterValue;
    use crate::{Delay, FateLog, Impairments, Link, LinkConfig, LinkModel, LinkName, Order, PacketEvent};

    const MS: Duration = Duration::from_millis(1);

    fn values(rate: f64, height: Duration, decay: Duration) -> Values {
        let values =
            [("rate", ParameterValue::Number(rate)), ("height", ParameterValue::Duration(height)), ("decay", ParameterValue::Duration(decay))];
        Values(values.to_vec())
    }

    fn stage(rate: f64, height: Duration, decay: Duration, seed: u64) -> SpikeStage {
        let spike = Spike::of(&values(rate, height, decay)).unwrap();
        SpikeStage::reconfigured(None, Instant::ZERO, Some(&spike), Stream::new(seed, b"spike"), 14).unwrap()
    }

    fn late(stage: &mut SpikeStage, millis: u64) -> u64 {
        stage.delay_nanos(Instant::from_nanos(millis * 1_000_000), PacketInfo::default())
    }

    fn config(rate: f64, height: Duration, decay: Duration, order: Order) -> LinkConfig {
        let mut listed = Impairments::default();
        listed.set("spike", Some(&values(rate, height, decay))).unwrap();
        LinkConfig { delay: Delay::constant(20 * MS), order, listed, ..LinkConfig::default() }
    }

    /// Returns the events of packets sent once per millisecond, in the order of arrival.
    fn events(model: impl Into<LinkModel>, packets: u64) -> Vec<PacketEvent<u64>> {
        let mut link = Link::new(3, &LinkName::between("a", "b"), model);
        for number in 0..packets {
            link.handle_packet(Instant::from_nanos(number * 1_000_000), Bytes::new(64), number).unwrap();
        }
        while let Some(next) = link.poll_timeout() {
            link.handle_timeout(next).unwrap();
        }
        core::iter::from_fn(|| link.poll_event()).collect()
    }

    /// Returns the numbers of the packets and their arrivals.
    fn arrivals(model: impl Into<LinkModel>, packets: u64) -> Vec<(u64, Instant)> {
        events(model, packets).into_iter().map(|event| (event.payload, event.record.at)).collect()
    }

    /// Campbell's theorem with λ = 2/s, h = 1 s, d = 0.5 s: mean 1 s, variance 0.5 s². The level is observed every 50 ms over T = 200 000 s. The mean has the
    /// variance 2σ²d/T and so a standard error of 1.6 ms. The second moment about the true mean has the variance d(κ₄ + 2σ⁴)/T with κ₄ = λh⁴d/4 = 0.25 and so
    /// a standard error of 1.4·10⁻³ s². The sampling adds less than a hundredth to both. The beginning without spikes lowers the mean by d/T, 2.5 µs.
    #[test]
    fn the_mean_and_the_variance_are_those_of_campbells_theorem() {
        let mut stage = stage(2.0, 1000 * MS, 500 * MS, 1);
        let seen = 4_000_000_u32;
        let (mut sum, mut squares) = (0.0, 0.0);
        for number in 0..u64::from(seen) {
            let seconds = late(&mut stage, 50 * number) as f64 / 1e9;
            sum += seconds;
            squares += (seconds - 1.0) * (seconds - 1.0);
        }
        let extra = stage.config.as_ref().unwrap().extra_delay();
        assert_eq!((extra.mean, extra.variance), (1.0, 0.5));
        assert!((sum / f64::from(seen) - 1.0).abs() < 4.5 * 0.0016, "{}", sum / f64::from(seen));
        assert!((squares / f64::from(seen) - 0.5).abs() < 4.5 * 0.0014, "{}", squares / f64::from(seen));
    }

    /// The delay equals the sum over the instants of the process, which follow from gaps drawn with their numbers. Many instants lie within one decay.
    #[test]
    fn overlapping_spikes_add_up() {
        let draws = Stream::new(5, b"spike");
        let mut stage = stage(40.0, 10 * MS, 300 * MS, 5);
        let gap = |number| {
            let mut words = draws.packet(number).draws(Purpose::Listed(14));
            Sojourn::Exponential(25 * MS).draw(|| words.next_word())
        };
        let begins: Vec<Duration> = (0..200)
            .scan(Duration::ZERO, |at, number| {
                *at += gap(number);
                Some(*at)
            })
            .collect();
        for millis in (0..2000).step_by(7) {
            let now = millis * MS;
            let expected: f64 = begins.iter().filter(|at| **at <= now).map(|at| 1e7 * libm::exp(-nanos(now - *at) / 3e8)).sum();
            let found = late(&mut stage, u64::from(millis)) as f64;
            // The delay is rounded to a nanosecond. The sum of at most 80 terms has relative errors of 1e-14.
            assert!((found - expected).abs() <= 0.5 + 1e-13 * expected, "{millis} ms: {found} and {expected}");
        }
    }

    #[test]
    fn when_packets_ask_changes_nothing() {
        let (mut often, mut seldom) = (stage(3.0, 80 * MS, 200 * MS, 9), stage(3.0, 80 * MS, 200 * MS, 9));
        for millis in 0..10_000 {
            let late_by = late(&mut often, millis);
            assert!(millis % 997 != 0 || late_by == late(&mut seldom, millis), "{millis}");
        }
    }

    #[test]
    fn without_events_nothing_is_late_and_a_long_silence_ends_all_spikes() {
        let mut never = stage(0.0, 80 * MS, 200 * MS, 1);
        assert_eq!([0, 1_000_000, 1 << 43].map(|millis| late(&mut never, millis)), [0; 3]);
        let plain = LinkConfig { delay: Delay::constant(20 * MS), ..LinkConfig::default() };
        assert_eq!(arrivals(config(0.0, 80 * MS, 200 * MS, Order::default()), 100), arrivals(plain, 100));
        // One spike begins in about three years: at the end of a century the level is that of the latest spike, which is zero after rounding.
        let mut rare = stage(1e-8, 80 * MS, 200 * MS, 1);
        assert_eq!(late(&mut rare, 100 * 365 * 86_400_000), 0);
        assert!(rare.drawn > 1);
        // The end of time, which stands for "no spike", begins no spike.
        assert_eq!(rare.delay_nanos(Instant::MAX, PacketInfo::default()), 0);
    }

    /// A spike of 50 ms that falls to 1/e in 10 ms falls by more than a millisecond in each of its first milliseconds, so that later packets overtake unless
    /// the order is kept.
    #[test]
    fn packets_overtake_in_the_fall_of_a_spike_unless_the_order_is_kept() {
        let numbers = |order| arrivals(config(5.0, 50 * MS, 10 * MS, order), 2000).into_iter().map(|(number, _)| number).collect::<Vec<_>>();
        assert!(!numbers(Order::AllowReordering).is_sorted());
        assert!(numbers(Order::InOrder).is_sorted());
    }

    #[test]
    fn a_replay_of_its_log_does_what_it_did() {
        let spiky = || config(5.0, 50 * MS, 100 * MS, Order::AllowReordering);
        let original = arrivals(spiky(), 500);
        let log = FateLog::new(events(spiky(), 500).into_iter().map(|event| event.record)).unwrap();
        assert_eq!(arrivals(LinkModel::Replay(Arc::new(log)), 500), original);
        assert_eq!(arrivals(spiky(), 500), original);
    }

    #[test]
    fn a_live_change_keeps_the_level_and_draws_nothing_twice() {
        let draws = Stream::new(7, b"spike");
        let spike = |rate, height, decay| Spike::of(&values(rate, height, decay)).unwrap();
        let change =
            |stage, millis: u64, config: Option<&Spike>| SpikeStage::reconfigured(stage, Instant::from_nanos(millis * 1_000_000), config, draws, 14);
        let mut first = stage(4.0, 80 * MS, 200 * MS, 7);
        let level = late(&mut first, 5000);
        // Another decay: the present level falls with the new decay, and the next spike stays.
        let mut slower = change(Some(first.clone()), 5000, Some(&spike(4.0, 80 * MS, 900 * MS))).unwrap();
        assert_eq!((late(&mut slower, 5000), slower.next, slower.drawn), (level, first.next, first.drawn));
        // Another rate: a new gap is drawn from now on.
        let mut rarer = change(Some(first.clone()), 5000, Some(&spike(0.5, 80 * MS, 200 * MS))).unwrap();
        assert_eq!((late(&mut rarer, 5000), rarer.drawn), (level, first.drawn + 1));
        assert!(rarer.next != first.next && rarer.next > Instant::from_nanos(5_000_000_000));
        // Without spikes no packet is late. When spikes come back, they are new spikes.
        let mut gone = change(Some(first.clone()), 5000, None).unwrap();
        assert_eq!((late(&mut gone, 5001), gone.next), (0, Instant::MAX));
        let mut back = change(Some(gone), 6000, Some(&spike(4.0, 80 * MS, 200 * MS))).unwrap();
        assert_eq!((late(&mut back, 6000), back.drawn), (0, first.drawn + 1));
        assert!(change(None, 0, None).is_none());
    }

    #[test]
    fn values_that_make_no_sense_are_refused() {
        let refused = |rate, decay| Spike::of(&values(rate, 80 * MS, decay)).unwrap_err();
        assert_eq!(refused(1.0, Duration::ZERO).key, "decay");
        assert_eq!(refused(1e6 + 1.0, MS).key, "rate");
        assert!(refused(f64::NAN, MS).message.contains("expected"));
        assert!(Spike::of(&values(1e6, Duration::ZERO, MS)).is_ok());
    }
}
