//! One link alone: a steady stream of packets through it, some 10⁴ of them on the way.

use std::time::{Duration, Instant as StdInstant};

use cohaptic_benches_common::one_link::{DELAY, JITTER, LOSS, Packet, RATE, SPACING_NANOS, drive, heap, ring, str0m};
use cohaptic_units::{Bytes, Probability, Rate};
use cohaptic_wan::{Bottleneck, Delay, Distribution, GilbertElliott, Jitter, LinkConfig, Loss, Order, QueueLimit};
use str0m_netem::{Bitrate, DataSize, GilbertElliot, Input, Netem, NetemConfig, Output, RandomLoss};

/// Bursts of three packets, one after a hundred.
const BURSTS: [f32; 2] = [100.0, 3.0];
const BUFFER: u32 = 10_000_000;

/// What came out of a link.
#[derive(Clone, Copy, PartialEq, Default, Debug)]
pub struct Seen {
    /// How many packets.
    pub delivered: u64,
    sum: f64,
    squares: f64,
}

impl Seen {
    fn add(&mut self, delay_nanos: u64) {
        let difference = delay_nanos as f64 / 1e6 - DELAY.as_secs_f64() * 1e3;
        self.delivered += 1;
        self.sum += difference;
        self.squares += difference * difference;
    }

    /// Mean and deviation of their delays \[ms\].
    #[must_use]
    pub fn delay(&self) -> [f64; 2] {
        let count = self.delivered as f64;
        let mean = self.sum / count;
        [DELAY.as_secs_f64() * 1e3 + mean, (self.squares / count - mean * mean).max(0.0).sqrt()]
    }
}

/// What a link does to packets.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    /// A constant delay.
    Constant,
    /// A uniform delay, and no packet overtakes another.
    Uniform,
    /// A normal one, and 1 % of independent loss.
    NormalAndLoss,
    /// A constant delay, and losses in bursts.
    Bursts,
    /// The uniform delay in order, 1 % of loss, and a rate with a queue.
    UniformLossAndRate,
}

/// The program that has the link.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum By {
    /// This project.
    Cohaptic,
    /// str0m-netem.
    Str0m,
    /// The least that is written by hand: a ring for a constant delay, a binary heap with the draws of this project for the other.
    Bare,
}

/// The rows of the table.
pub const ROWS: [(Kind, By); 11] = [
    (Kind::Constant, By::Cohaptic),
    (Kind::Constant, By::Str0m),
    (Kind::Constant, By::Bare),
    (Kind::Uniform, By::Cohaptic),
    (Kind::Uniform, By::Str0m),
    (Kind::NormalAndLoss, By::Cohaptic),
    (Kind::NormalAndLoss, By::Bare),
    (Kind::Bursts, By::Cohaptic),
    (Kind::Bursts, By::Str0m),
    (Kind::UniformLossAndRate, By::Cohaptic),
    (Kind::UniformLossAndRate, By::Str0m),
];

impl Kind {
    /// How it is called in a table.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Constant => "10 ms",
            Self::Uniform => "10 ± 1 ms uniform, in order",
            Self::NormalAndLoss => "10 ± 1 ms normal, 1 % loss",
            Self::Bursts => "10 ms, bursts of loss",
            Self::UniformLossAndRate => "10 ± 1 ms uniform, in order, 1 % loss, 1 Gbit/s",
        }
    }

    /// As this project takes it.
    ///
    /// # Panics
    ///
    /// Never: these parameters are sound.
    #[must_use]
    pub fn config(self) -> LinkConfig {
        let p = |value: f64| Probability::new(value).expect("a probability");
        // A uniform law of deviation σ is √3·σ wide to each side.
        let uniform = Jitter::new(JITTER.div_f64(3.0_f64.sqrt()), Distribution::Uniform);
        let jittery = |jitter| Delay::with_jitter(DELAY, jitter).expect("sound");
        let constant = LinkConfig { delay: Delay::constant(DELAY), ..LinkConfig::default() };
        let independent = Loss::Independent(p(LOSS));
        let [good, bad] = BURSTS.map(|packets| p(1.0 / f64::from(packets)));
        let chain = GilbertElliott { p: good, r: bad, h: Probability::ZERO, k: Probability::ONE };
        let rate = Rate::bits_per_sec(RATE).expect("not zero");
        let limit = Some(QueueLimit::Bytes(Bytes::new(BUFFER.into())));
        match self {
            Self::Constant => constant,
            Self::Uniform => LinkConfig { delay: jittery(uniform), order: Order::InOrder, ..constant },
            Self::NormalAndLoss => LinkConfig { delay: jittery(Jitter::new(JITTER, Distribution::Normal)), loss: independent, ..constant },
            Self::Bursts => LinkConfig { loss: Loss::GilbertElliott(chain), ..constant },
            Self::UniformLossAndRate => LinkConfig {
                delay: jittery(uniform),
                order: Order::InOrder,
                loss: independent,
                bottleneck: Some(Bottleneck { limit, ..Bottleneck::at_rate(rate) }),
                ..constant
            },
        }
    }

    /// As str0m-netem takes it; it has no normal law.
    fn str0m(self) -> NetemConfig {
        let constant = NetemConfig::new().latency(DELAY).seed(1);
        let independent = RandomLoss::new(str0m_netem::Probability::new(LOSS as f32));
        match self {
            Self::Constant => constant,
            Self::Uniform => constant.jitter(JITTER),
            Self::NormalAndLoss => constant.jitter(JITTER).loss(independent),
            Self::Bursts => constant.loss(GilbertElliot::new().good_duration(BURSTS[0]).bad_duration(BURSTS[1])),
            Self::UniformLossAndRate => constant.jitter(JITTER).loss(independent).link(Bitrate::bps(RATE), DataSize::bytes(BUFFER.into())),
        }
    }
}

impl By {
    /// How it is called in a table.
    #[must_use]
    pub fn name(self, kind: Kind) -> String {
        match (self, kind) {
            (Self::Cohaptic, _) => "cohaptic".into(),
            (Self::Str0m, _) => format!("str0m-netem {}", crate::version("str0m-netem")),
            (Self::Bare, Kind::Constant) => "a bare ring".into(),
            (Self::Bare, Kind::Uniform | Kind::NormalAndLoss | Kind::Bursts | Kind::UniformLossAndRate) => "a bare binary heap, same draws".into(),
        }
    }

    /// Sends a number of packets, a microsecond apart, and gives how many are out by the last.
    #[must_use]
    pub fn drive(self, kind: Kind, packets: u64) -> u64 {
        match (self, kind) {
            (Self::Cohaptic, _) => drive(&kind.config(), packets, |_| ()),
            (Self::Str0m, _) => str0m(kind.str0m(), packets),
            (Self::Bare, Kind::Constant) => ring(packets, |_| ()),
            (Self::Bare, _) => heap(packets, |_| ()),
        }
    }

    /// Sends the packets too, with a look at the delay of each packet that is out.
    #[must_use]
    pub fn watch(self, kind: Kind, packets: u64) -> Seen {
        let mut seen = Seen::default();
        match (self, kind) {
            (Self::Cohaptic, _) => {
                drive(&kind.config(), packets, |delay| seen.add(delay));
            }
            (Self::Str0m, _) => seen = watch_str0m(kind.str0m(), packets),
            (Self::Bare, Kind::Constant) => {
                ring(packets, |delay| seen.add(delay));
            }
            (Self::Bare, _) => {
                heap(packets, |delay| seen.add(delay));
            }
        }
        seen
    }
}

/// With all its timeouts, so that each packet is seen at its own instant.
fn watch_str0m(config: NetemConfig, packets: u64) -> Seen {
    let begin = StdInstant::now();
    let mut netem = Netem::new(config);
    let mut seen = Seen::default();
    for number in 0..packets {
        let now = begin + Duration::from_nanos(number * SPACING_NANOS);
        while !netem.is_empty() && netem.poll_timeout() <= now {
            let at = netem.poll_timeout();
            netem.handle_input(Input::Timeout(at));
            while let Some(Output::Packet(Packet(number))) = netem.poll_output() {
                let delay = (at - begin).saturating_sub(Duration::from_nanos(number * SPACING_NANOS));
                seen.add(u64::try_from(delay.as_nanos()).unwrap_or(u64::MAX));
            }
        }
        netem.handle_input(Input::Packet(now, Packet(number)));
    }
    seen
}

#[cfg(test)]
mod tests {
    use super::*;

    const PACKETS: u64 = 100_000;

    /// Where the draws are the same, the packets are too.
    #[test]
    fn what_is_written_by_hand_does_the_same_as_the_link() {
        for kind in [Kind::Constant, Kind::NormalAndLoss] {
            assert_eq!(By::Cohaptic.watch(kind, PACKETS), By::Bare.watch(kind, PACKETS), "{kind:?}");
            assert_eq!(By::Cohaptic.drive(kind, PACKETS), By::Bare.drive(kind, PACKETS), "{kind:?}");
        }
    }

    /// Elsewhere the laws are. In order a packet comes with the slowest before it, Dₙ = max over k of dₙ₋ₖ − k·1 µs. With d uniform up to 11 ms and 2 ms wide, as
    /// many as u²/(2·1 µs·2 ms) of them are expected above 11 ms − u, so that D is that far below 11 ms with the law of Rayleigh, σ² = 1 µs·2 ms: mean √(π/2)·σ =
    /// 56.0 µs, deviation √(2−π/2)·σ = 29.3 µs. It forgets in some 50 packets, so 90,000 are as good as 1,000 independent ones: five deviations are 5 µs.
    ///
    /// Of 90,000 packets bursts take 3/103; a burst has 3 ± 2.4, so that 873 of them have 5·√873·3.9 = 580 by chance.
    #[test]
    fn the_laws_are_the_same() {
        for by in [By::Cohaptic, By::Str0m] {
            let seen = by.watch(Kind::Uniform, PACKETS);
            let [mean, deviation] = seen.delay();
            assert!((mean - 10.944).abs() < 0.006 && (deviation - 0.0293).abs() < 0.005, "{by:?}: {mean} ± {deviation}");
            let constant = by.watch(Kind::Constant, PACKETS);
            assert_eq!((constant.delivered, constant.delay()), (PACKETS - 10_000, [10.0, 0.0]), "{by:?}");
            let lost = constant.delivered - by.watch(Kind::Bursts, PACKETS).delivered;
            assert!(lost.abs_diff(90_000 * 3 / 103) < 580, "{by:?}: {lost}");
        }
    }
}
