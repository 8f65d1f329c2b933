//! The work that is measured of one link: a steady stream of packets through it, some 10⁴ of them in flight.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::num::NonZeroU32;
use std::time::Duration;

use cohaptic_benches_common::one_link::{DELAY, JITTER, LOSS, RATE, SPACING_NANOS};
pub use cohaptic_benches_common::one_link::{drive, heap, ring, str0m};
use cohaptic_units::{Bytes, Probability, Rate};
use cohaptic_wan::random::{Purpose, Stream};
use cohaptic_wan::{
    Bottleneck, Chance, Checksum, CoDel, Corruption, Delay, Discipline, Displacement, Distribution, Flips, IdleOutages, Jitter, LinkConfig, Loss,
    Order, Outages, QueueLimit, Reorder, Slots, TokenBucket,
};
use str0m_netem::{Bitrate, DataSize, NetemConfig, RandomLoss};

fn p(value: f64) -> Probability {
    Probability::new(value).expect("a probability")
}

fn rate() -> Rate {
    Rate::bits_per_sec(RATE).expect("not zero")
}

/// A constant delay.
#[must_use]
pub fn constant() -> LinkConfig {
    LinkConfig { delay: Delay::constant(DELAY), ..LinkConfig::default() }
}

/// Normal jitter of a tenth and 1 % of loss.
///
/// # Panics
///
/// Never: these parameters are sound.
#[must_use]
pub fn jitter_and_loss() -> LinkConfig {
    let delay = Delay::with_jitter(DELAY, Jitter::new(JITTER, Distribution::Normal)).expect("sound");
    LinkConfig { delay, loss: Loss::Independent(p(LOSS)), ..LinkConfig::default() }
}

/// One stage more than a constant delay, or all of them, by name.
///
/// # Panics
///
/// Never: these parameters are sound.
#[must_use]
pub fn stages() -> Vec<(&'static str, LinkConfig)> {
    let bottleneck = Bottleneck { limit: Some(QueueLimit::Packets(1000)), ..Bottleneck::at_rate(rate()) };
    let one = NonZeroU32::MIN;
    let flips = Flips::Bits { packets: Chance::independent(p(0.001)), count: 1 };
    let bucket = TokenBucket { rate: rate(), burst: Bytes::new(15_000), peak: None, framing: bottleneck.framing, limit: bottleneck.limit };
    let idle = IdleOutages { after: Duration::from_secs(1), down: Duration::from_secs(1) };
    let all = LinkConfig {
        mtu: Some(Bytes::new(1500)),
        outages: Outages::default().with_idle(idle).expect("sound"),
        loss: Loss::Correlated(Chance::correlated(p(0.01), 0.5).expect("sound")),
        duplication: Chance::independent(p(0.001)),
        corruption: Some(Corruption { bits: flips, within: None, checksum: Checksum::Discards }),
        limit: Some(1_000_000),
        token_bucket: Some(bucket),
        bottleneck: Some(Bottleneck { discipline: Discipline::CoDel(CoDel::default()), ..bottleneck.clone() }),
        reorder: Some(Reorder { packets: Chance::independent(p(0.001)), how: Displacement::Jump { gap: one } }),
        ..jitter_and_loss()
    };
    let slots = Slots::new(Duration::from_micros(50), Duration::from_micros(50)).expect("sound");
    vec![
        ("nothing but the delay", constant()),
        ("independent loss", LinkConfig { loss: Loss::Independent(p(0.01)), ..constant() }),
        ("normal jitter", LinkConfig { loss: Loss::None, ..jitter_and_loss() }),
        ("normal jitter, in order", LinkConfig { loss: Loss::None, order: Order::InOrder, ..jitter_and_loss() }),
        ("duplication", LinkConfig { duplication: Chance::independent(p(0.001)), ..constant() }),
        ("corruption", LinkConfig { corruption: all.corruption.clone(), ..constant() }),
        ("reordering", LinkConfig { reorder: all.reorder, ..constant() }),
        ("token bucket", LinkConfig { token_bucket: all.token_bucket, ..constant() }),
        ("bottleneck, tail drop", LinkConfig { bottleneck: Some(bottleneck), ..constant() }),
        ("bottleneck, CoDel", LinkConfig { bottleneck: all.bottleneck.clone(), ..constant() }),
        ("slots of 50 µs", LinkConfig { slots: Some(slots), ..constant() }),
        ("all of them but slots", all),
    ]
}

/// str0m-netem with a constant delay; with jitter and loss; with jitter, loss, duplication, reordering and a rate. It has a table of 1 % steps instead of a normal
/// law: its jitter is uniform.
#[must_use]
pub fn str0m_configs() -> [NetemConfig; 3] {
    let constant = NetemConfig::new().latency(DELAY).seed(1);
    let one_percent = RandomLoss::new(str0m_netem::Probability::new(0.01));
    let jitter = constant.jitter(JITTER).loss(one_percent);
    let buffer = DataSize::bytes(10_000_000);
    let full = jitter.duplicate(str0m_netem::Probability::new(0.001)).reorder_gap(1000).link(Bitrate::bps(RATE), buffer);
    [constant, jitter, full]
}

/// The hold model: 10⁴ pending events, each taken is pushed again later.
#[must_use]
pub fn hold(events: u64) -> u64 {
    let stream = Stream::new(1, b"hold");
    let mut heap: BinaryHeap<Reverse<(u64, u64)>> = (0..10_000).map(|number| Reverse((number * SPACING_NANOS, number))).collect();
    let mut last = 0;
    for number in 0..events {
        if let Some(Reverse((at, event))) = heap.pop() {
            last = at;
            heap.push(Reverse((at + (stream.packet(number).first(Purpose::Jitter) >> 40), event)));
        }
    }
    last
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The heap draws the same numbers as the link: the same packets come out. And the stages let nearly all through: 40 000 of 50 000 are out at the end
    /// over a constant delay; 1 % is lost at most, and in order packets wait for the slowest of the last thousands, 3 to 4 ms more.
    #[test]
    fn all_do_the_same_work() {
        const PACKETS: u64 = 50_000;
        assert_eq!(drive(&jitter_and_loss(), PACKETS, |_| ()), heap(PACKETS, |_| ()));
        assert_eq!(drive(&constant(), PACKETS, |_| ()), ring(PACKETS, |_| ()));
        for (name, config) in stages() {
            let out = drive(&config, PACKETS, |_| ());
            assert!((35_500..41_000).contains(&out), "{name}: {out}");
        }
        for config in str0m_configs() {
            let out = str0m(config, PACKETS);
            assert!((38_000..41_000).contains(&out), "{out}");
        }
    }
}
