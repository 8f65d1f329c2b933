//! The work that is measured of one link: a steady stream of packets through it, some 10⁴ of them in flight.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};
use std::num::NonZeroU32;
use std::time::{Duration, Instant as StdInstant};

use cohaptic_units::{Bytes, Instant, Probability, Rate};
use cohaptic_wan::random::{Purpose, Stream};
use cohaptic_wan::{
    Bottleneck, Chance, Checksum, CoDel, Corruption, Delay, Discipline, Displacement, Distribution, Flips, IdleOutages, Jitter, Link, LinkConfig,
    LinkName, Loss, Order, Outages, QueueLimit, Reorder, Slots, TokenBucket,
};
use str0m_netem::{Bitrate, DataSize, Input, Netem, NetemConfig, Output, RandomLoss, WithLen};

/// Packets are a microsecond apart, and the delay is 10 ms: 10⁴ packets are in flight.
pub const SPACING_NANOS: u64 = 1_000;
/// The mean delay.
pub const DELAY: Duration = Duration::from_millis(10);
/// Every packet has this size.
pub const SIZE: u64 = 64;
/// Far more than the stream needs, so that the stages work and seldom hold anything up: 1 Gbit/s for 0.5 Gbit/s.
const RATE: u64 = 1_000_000_000;

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
    let delay = Delay::with_jitter(DELAY, Jitter::new(DELAY / 10, Distribution::Normal)).expect("sound");
    LinkConfig { delay, loss: Loss::Independent(p(0.01)), ..LinkConfig::default() }
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

/// Drives a link with a steady stream; gives how many packets came out.
///
/// # Panics
///
/// Never: time goes on.
#[must_use]
pub fn drive(config: &LinkConfig, packets: u64) -> u64 {
    let mut link = Link::new(1, &LinkName::between("a", "b"), config.clone());
    let mut out = 0;
    for number in 0..packets {
        let now = Instant::from_nanos(number * SPACING_NANOS);
        link.handle_packet(now, Bytes::new(SIZE), number).expect("time goes on");
        while let Some(event) = link.poll_event() {
            out += u64::from(matches!(event.fate, cohaptic_wan::Fate::Delivered(_)));
        }
    }
    out
}

/// A packet of str0m-netem.
#[derive(Clone, Copy, Debug)]
struct Packet(#[expect(dead_code, reason = "it is carried, as ours is")] u64);

impl WithLen for Packet {
    fn len(&self) -> usize {
        SIZE as usize
    }
}

/// The same work for str0m-netem, which has a table of 1 % steps instead of a normal law: its jitter is uniform.
#[must_use]
pub fn str0m(config: NetemConfig, packets: u64) -> u64 {
    let begin = StdInstant::now();
    let mut netem = Netem::new(config);
    let mut out = 0;
    for number in 0..packets {
        netem.handle_input(Input::Packet(begin + Duration::from_nanos(number * SPACING_NANOS), Packet(number)));
        while let Some(output) = netem.poll_output() {
            match output {
                Output::Packet(_) => out += 1,
                Output::Timeout(_) => break,
            }
        }
    }
    out
}

/// str0m-netem with a constant delay; with jitter and loss; with jitter, loss, duplication, reordering and a rate.
#[must_use]
pub fn str0m_configs() -> [NetemConfig; 3] {
    let constant = NetemConfig::new().latency(DELAY).seed(1);
    let one_percent = RandomLoss::new(str0m_netem::Probability::new(0.01));
    let jitter = constant.jitter(DELAY / 10).loss(one_percent);
    let buffer = DataSize::bytes(10_000_000);
    let full = jitter.duplicate(str0m_netem::Probability::new(0.001)).reorder_gap(1000).link(Bitrate::bps(RATE), buffer);
    [constant, jitter, full]
}

/// A ring: what a constant delay needs at least.
#[must_use]
pub fn ring(packets: u64) -> u64 {
    let mut ring = VecDeque::new();
    let mut out = 0;
    for number in 0..packets {
        let now = number * SPACING_NANOS;
        while ring.front().is_some_and(|&(at, _)| at <= now) {
            out += u64::from(ring.pop_front().is_some_and(|(_, number)| number < packets));
        }
        ring.push_back((now + DELAY.as_nanos() as u64, number));
    }
    out
}

/// A binary heap with the same jitter and loss, drawn from the same addresses: what others build on.
#[must_use]
pub fn heap(packets: u64) -> u64 {
    let stream = Stream::new(1, b"a->b");
    let mut heap = BinaryHeap::new();
    let mut out = 0;
    for number in 0..packets {
        let now = number * SPACING_NANOS;
        while heap.peek().is_some_and(|&Reverse((at, _))| at <= now) {
            out += u64::from(heap.pop().is_some());
        }
        let draws = stream.packet(number);
        let [loss, jitter] = draws.loss_and_jitter();
        if !p(0.01).happens(loss) {
            let mut more = draws.more(Purpose::Jitter);
            let z = cohaptic_wan::standard_normal(jitter, || more.next_word());
            let delay = (DELAY.as_nanos() as u64).saturating_add_signed((z * 1e6).round_ties_even() as i64);
            heap.push(Reverse((now + delay, number)));
        }
    }
    out
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
        assert_eq!(drive(&jitter_and_loss(), PACKETS), heap(PACKETS));
        assert_eq!(drive(&constant(), PACKETS), ring(PACKETS + 1) - 1);
        for (name, config) in stages() {
            let out = drive(&config, PACKETS);
            assert!((35_500..41_000).contains(&out), "{name}: {out}");
        }
        for config in str0m_configs() {
            let out = str0m(config, PACKETS);
            assert!((38_000..41_000).contains(&out), "{out}");
        }
    }
}
