//! A link and a network that are obviously right and slow: every packet in turn, every other packet looked at, nothing remembered that could be
//! computed again. Only the addresses of the random numbers are shared with the subject.

use std::collections::BTreeMap;

use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::random::{Purpose, Stream};
use cohaptic_wan::{Distribution, DropCause, Fate, GilbertElliott, LinkConfig, LinkName, Loss, NodeId, Order, QueueLimit, Service};

use crate::random_links::{Plan, SEED, Sending, name};

/// An instant and, for what happens at the instant of a change, under which configuration: the ordering is (instant, configuration).
pub(crate) type Moment = (Instant, usize);

/// A packet handed to a link.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Offered {
    pub(crate) moment: Moment,
    pub(crate) size: Bytes,
}

/// Span in which a packet of `size` was sent over the line.
struct Served {
    begin: Moment,
    end: Moment,
    size: Bytes,
}

/// The fates of all packets of one link. Configuration i holds from its instant on; either all of them have a bottleneck or none has.
pub(crate) fn fates(name: &LinkName, configs: &[(Instant, LinkConfig)], offered: &[Offered]) -> Vec<Fate> {
    let mut served: Vec<Served> = Vec::new();
    let mut arrivals: Vec<Instant> = Vec::new();
    let lost = losses(name, configs, offered);
    let mut fate = |number: usize, packet: &Offered| {
        let config = &configs[packet.moment.1].1;
        let now = packet.moment;
        if config.outages.scheduled().iter().any(|outage| outage.from <= now.0 && now.0 < outage.to) {
            return Fate::Dropped(DropCause::Outage);
        }
        if lost[number] {
            return Fate::Dropped(DropCause::Loss);
        }
        let mut leaves = now;
        if let Some(bottleneck) = &config.bottleneck {
            let busy = served.iter().any(|service| service.end > now);
            let waiting: Vec<&Served> = served.iter().filter(|service| service.begin > now).collect();
            let bytes: u128 = waiting.iter().map(|service| u128::from(service.size.get())).sum();
            let full = match bottleneck.limit {
                Some(QueueLimit::Packets(limit)) => waiting.len() as u64 + 1 > limit,
                Some(QueueLimit::Bytes(limit)) => bytes + u128::from(packet.size.get()) > u128::from(limit.get()),
                _ => false,
            };
            if busy && full {
                return Fate::Dropped(DropCause::QueueFull);
            }
            // Lindley: a packet is served when it is there and the one before it is gone.
            let begin = served.last().map_or(now, |previous| previous.end.max(now));
            leaves = transmitted(configs, begin, packet.size);
            served.push(Served { begin, end: leaves, size: packet.size });
        }
        let config = &configs[leaves.1].1;
        let wanted = Instant::from_nanos(leaves.0.as_nanos() + delay(name, config, number as u64));
        arrivals.push(wanted);
        Fate::Delivered(match config.order {
            Order::AllowReordering => wanted,
            Order::InOrder => *arrivals.iter().max().unwrap(),
        })
    };
    offered.iter().enumerate().map(|(number, packet)| fate(number, packet)).collect()
}

/// Returns the moment at which a packet that is sent from `begin` on has been sent. Its bits are subtracted span by span, in units of 10⁻⁹ bit.
fn transmitted(configs: &[(Instant, LinkConfig)], begin: Moment, size: Bytes) -> Moment {
    let bottleneck = |index: usize| configs[index].1.bottleneck.as_ref().unwrap();
    let rate_of = |index: usize| match &bottleneck(index).service {
        Service::Rate(rate) => *rate,
        other => unreachable!("no model for {other:?}"),
    };
    let (mut now, mut index) = begin;
    let mut left = (u128::from(size.get()) + u128::try_from(bottleneck(index).framing.overhead).unwrap()) * 8 * 1_000_000_000;
    loop {
        let rate = u128::from(rate_of(index).as_bits_per_sec());
        // Rounded up to a nanosecond.
        let needed = left / rate + u128::from(left % rate > 0);
        let end = u128::from(now.as_nanos()) + needed;
        match configs.get(index + 1) {
            Some((change, _)) if end > u128::from(change.as_nanos()) => {
                left -= rate * u128::from(change.as_nanos() - now.as_nanos());
                now = *change;
                index += 1;
            }
            _ => return (Instant::from_nanos(u64::try_from(end).unwrap()), index),
        }
    }
}

/// Returns the losses by the loss model: `true` for a lost packet, indexed by packet. Packets dropped by an outage do not advance the model.
fn losses(name: &LinkName, configs: &[(Instant, LinkConfig)], offered: &[Offered]) -> Vec<bool> {
    let stream = Stream::new(SEED, name.as_str().as_bytes());
    let first = stream.packet(0).draws(Purpose::InitialState).next_unit();
    let stationary_bad = |chain: GilbertElliott| first < chain.p.get() / (chain.p.get() + chain.r.get());
    // A chain that never moves is good: 0/0 is less than nothing.
    let mut chain_is_bad: Option<bool> = None;
    let mut applied = 0;
    let mut lost = Vec::new();
    for (number, packet) in offered.iter().enumerate() {
        while applied < packet.moment.1 + 1 {
            chain_is_bad = match &configs[applied].1.loss {
                Loss::GilbertElliott(chain) => Some(chain_is_bad.unwrap_or_else(|| stationary_bad(*chain))),
                Loss::None | Loss::Independent(_) => None,
                other => unreachable!("no model for {other:?}"),
            };
            applied += 1;
        }
        let config = &configs[packet.moment.1].1;
        let down = config.outages.scheduled().iter().any(|outage| outage.from <= packet.moment.0 && packet.moment.0 < outage.to);
        let mut draws = stream.packet(number as u64).draws(Purpose::Loss);
        lost.push(match &config.loss {
            _ if down => false,
            Loss::None => false,
            Loss::Independent(p) => draws.next_unit() < p.get(),
            Loss::GilbertElliott(chain) => {
                let was_bad = chain_is_bad.unwrap();
                let moves = draws.next_unit() < if was_bad { chain.r.get() } else { chain.p.get() };
                chain_is_bad = Some(was_bad != moves);
                draws.next_unit() >= if was_bad { chain.h.get() } else { chain.k.get() }
            }
            other => unreachable!("no model for {other:?}"),
        });
    }
    lost
}

/// The propagation delay of packet `number` \[ns\].
fn delay(name: &LinkName, config: &LinkConfig, number: u64) -> u64 {
    let mean = i128::try_from(config.delay.mean().as_nanos()).unwrap();
    let Some(jitter) = config.delay.jitter() else { return u64::try_from(mean).unwrap() };
    let mut draws = Stream::new(SEED, name.as_str().as_bytes()).packet(number).draws(Purpose::Jitter);
    let sd = jitter.sd.as_nanos() as f64;
    let deviation = match &jitter.distribution {
        Distribution::Normal => sd * cohaptic_wan::standard_normal(draws.next_word(), || draws.next_word()),
        // Uniform over ±√3·σ.
        Distribution::Uniform => 3f64.sqrt() * sd * (2.0 * draws.next_unit() - 1.0),
        other => unreachable!("no model for {other:?}"),
    };
    #[expect(clippy::cast_possible_truncation, reason = "the tests draw at most seconds")]
    let deviation = deviation.round_ties_even() as i128;
    u64::try_from((mean + deviation).max(0)).unwrap()
}

/// A packet on its way from line to line.
#[derive(Clone, Copy)]
struct Travelling {
    at: Instant,
    /// Number of the call that brought the packet to `at`. Breaks ties: a packet without any delay comes after all packets that were there before it was sent.
    call: usize,
    path: (NodeId, NodeId),
    sequence: u64,
    sent: Instant,
    size: Bytes,
}

/// Returns the fate of each packet of a network, by sender, receiver and sequence number. Lines are computed one by one, since no line depends on later lines.
pub(crate) fn network_fates(plan: &Plan, sendings: &[Sending]) -> BTreeMap<(NodeId, NodeId, u64), (Instant, Fate)> {
    let mut fates = BTreeMap::new();
    let mut sequences: BTreeMap<(NodeId, NodeId), u64> = BTreeMap::new();
    let mut now = Instant::ZERO;
    let mut packets = Vec::new();
    for (call, sending) in sendings.iter().enumerate() {
        now += sending.gap;
        let path = (sending.from, sending.to);
        let next = sequences.entry(path).or_default();
        packets.push(Travelling { at: now, call: call + 1, path, sequence: *next, sent: now, size: sending.size });
        *next += 1;
    }
    let mut through = |packets: &[Travelling], config: &LinkConfig, name: LinkName| -> Vec<Travelling> {
        let offered: Vec<Offered> = packets.iter().map(|packet| Offered { moment: (packet.at, 0), size: packet.size }).collect();
        let mut through = Vec::new();
        for (packet, fate) in packets.iter().zip(self::fates(&name, &[(Instant::ZERO, config.clone())], &offered)) {
            let at = if let Fate::Delivered(at) = fate { at } else { packet.at };
            fates.insert((packet.path.0, packet.path.1, packet.sequence), (at, fate));
            if matches!(fate, Fate::Delivered(_)) {
                through.push(Travelling { at, call: if at == packet.sent { packet.call } else { 0 }, ..*packet });
            }
        }
        through
    };
    let of = |packets: &[Travelling], belongs: &dyn Fn(&Travelling) -> bool| -> Vec<Travelling> {
        packets.iter().filter(|packet| belongs(packet)).copied().collect()
    };

    let mut sent = Vec::new();
    for (node, uplink) in plan.node_ids().zip(&plan.uplinks) {
        let own = of(&packets, &|packet| packet.path.0 == node);
        sent.extend(match uplink {
            None => own,
            Some(config) => through(&own, config, LinkName::uplink(&name(node.index()))),
        });
    }
    let mut carried = Vec::new();
    for from in plan.node_ids() {
        for to in plan.node_ids().filter(|to| *to != from) {
            let mut own = of(&sent, &|packet| packet.path == (from, to));
            own.sort_by_key(|packet| (packet.at, packet.call, packet.sequence));
            carried.extend(through(&own, plan.link(from, to), LinkName::between(&name(from.index()), &name(to.index()))));
        }
    }
    for (node, downlink) in plan.node_ids().zip(&plan.downlinks) {
        let mut own = of(&carried, &|packet| packet.path.1 == node);
        own.sort_by_key(|packet| (packet.at, packet.call, packet.path.0, packet.sequence));
        if let Some(config) = downlink {
            through(&own, config, LinkName::downlink(&name(node.index())));
        }
    }
    fates
}
