//! Pairs of configurations, over random chains of stages, whose fates must be equal or must differ in a known way.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use cohaptic_tests_common::properties;
use cohaptic_units::{Bytes, Instant, Rate};
use cohaptic_wan::{
    Between, Bottleneck, Chance, Checksum, Corruption, Damage, Delay, Discipline, Distribution, DropCause, Fate, FateLog, Flips, Framing,
    Impairments, Jitter, Link, LinkConfig, LinkModel, Loss, Modulated, Modulator, ModulatorState, Outage, Outages, PacketEvent, PacketInfo,
    PathTrace, Pattern, Peak, QueueLimit, Reorder, Service, Slots, TokenBucket,
};
use proptest::collection::vec;
use proptest::prelude::*;

use crate::any_link::{all_events, all_records, any_link, any_stages, framing, limit, micros, packets};
use crate::random_links::{at, cases, drain, gap, nanos, probability};

/// Returns the link with a further stage that changes nothing. `which` chooses the stage.
fn with_nothing(config: &LinkConfig, which: usize) -> LinkModel {
    let mut config = config.clone();
    let fast = Rate::bits_per_sec(u64::MAX).unwrap();
    match which {
        0 => config.mtu = config.mtu.or(Some(Bytes::new(u64::MAX))),
        1 => config.limit = config.limit.or(Some(u64::MAX)),
        2 => {
            config.outages = if config.outages.is_empty() {
                Outages::new(vec![Outage { from: at(u64::MAX - 1), to: Instant::MAX }]).unwrap()
            } else {
                config.outages
            }
        }
        3 if config.loss == Loss::None => config.loss = Loss::Independent(probability(0.0)),
        4 if config.loss == Loss::None => config.loss = Loss::Pattern(Pattern::of_packets(Vec::new(), Some(3)).unwrap()),
        5 if config.loss == Loss::None => config.loss = Loss::Correlated(Chance::default()),
        6 => {
            config.corruption =
                config.corruption.or_else(|| Some(Corruption { bits: Flips::Rate(probability(0.0)), within: None, checksum: Checksum::Discards }))
        }
        // It never runs dry: these packets hold less, and a nanosecond brings more than 2 GB.
        7 => {
            let peak = Some(Peak { rate: fast, burst: Bytes::new(1 << 40) });
            config.token_bucket = config.token_bucket.or_else(|| {
                Some(TokenBucket { rate: fast, burst: Bytes::new(1 << 40), peak, framing: Framing::default(), limit: Some(QueueLimit::Packets(0)) })
            });
        }
        // All that a packet has is overhead that is taken away.
        8 => {
            config.bottleneck =
                config.bottleneck.or_else(|| Some(Bottleneck { framing: Framing { overhead: i32::MIN, cells: None }, ..Bottleneck::at_rate(fast) }))
        }
        9 => config.slots = config.slots.or_else(|| Some(Slots::new(Duration::ZERO, Duration::ZERO).unwrap())),
        10 => {
            config.reorder =
                config.reorder.or_else(|| Some(Reorder { packets: Chance::default(), how: cohaptic_wan::Displacement::Later { by: micros(9) } }))
        }
        11 => config.trace = config.trace.or_else(|| Some(PathTrace::parse("t,delay,loss\n0,0,0\n1,0,0\n", Between::Lines, true).unwrap())),
        12 => {
            let modulator = Modulator::new("still", vec![ModulatorState { sojourn: None, next: vec![0.0] }]).unwrap();
            return Modulated::new(modulator, vec![config]).unwrap().into();
        }
        13 => {
            let sojourn = Some(cohaptic_wan::Sojourn::Exponential(micros(500)));
            let states = vec![ModulatorState { sojourn, next: vec![0.0, 1.0] }, ModulatorState { sojourn, next: vec![1.0, 0.0] }];
            return Modulated::new(Modulator::new("twins", states).unwrap(), vec![config.clone(), config]).unwrap().into();
        }
        _ => {}
    }
    config.into()
}

/// Parameters of a link without absolute times: with all times multiplied by a factor, the fates are the same, later by the factor.
#[derive(Clone, Debug)]
struct Scalable {
    /// The logarithm of the nanoseconds that a byte takes.
    byte: u32,
    framing: Framing,
    limit: Option<QueueLimit>,
    burst: u64,
    peak: bool,
    mean: u64,
    jitter: bool,
    outages: Vec<(u64, u64)>,
    loss: f64,
    copies: f64,
    late: u64,
    slot: u64,
    which: [bool; 4],
}

impl Scalable {
    fn config(&self, shift: u32) -> LinkConfig {
        let span = |nanos: u64| Duration::from_nanos(nanos << shift);
        // A byte takes a power of two of nanoseconds.
        let rate = Rate::bits_per_sec(8_000_000_000 >> (self.byte + shift)).unwrap();
        let limit = self.limit.map(|limit| if let QueueLimit::Time(time) = limit { QueueLimit::Time(time * (1 << shift)) } else { limit });
        let burst = Bytes::new(self.burst);
        let [has_bucket, has_bottleneck, has_slots, has_reorder] = self.which;
        let mut edge = 0;
        let mut next = |gap: u64| {
            edge += gap << shift;
            at(edge)
        };
        let mean = span(self.mean << 10);
        LinkConfig {
            outages: Outages::new(self.outages.iter().map(|(up, down)| Outage { from: next(*up), to: next(*down) }).collect()).unwrap(),
            loss: Loss::Independent(probability(self.loss)),
            duplication: Chance::independent(probability(self.copies)),
            token_bucket: has_bucket.then(|| TokenBucket {
                rate,
                burst,
                peak: self.peak.then(|| Peak { rate: Rate::bits_per_sec(2 * rate.as_bits_per_sec()).unwrap(), burst }),
                framing: self.framing,
                limit,
            }),
            bottleneck: has_bottleneck.then(|| Bottleneck { framing: self.framing, limit, ..Bottleneck::at_rate(rate) }),
            slots: has_slots.then(|| Slots::new(span(self.slot), span(self.slot)).unwrap()),
            reorder: has_reorder
                .then(|| Reorder { packets: Chance::independent(probability(0.3)), how: cohaptic_wan::Displacement::Later { by: span(self.late) } }),
            delay: if self.jitter { Delay::with_jitter(mean, Jitter::new(mean / 4, Distribution::Uniform)).unwrap() } else { Delay::constant(mean) },
            ..LinkConfig::default()
        }
    }
}

fn scalable() -> BoxedStrategy<Scalable> {
    let first = (0..6u32, framing(), limit(), 8..60u64, any::<bool>(), 0..20u64, any::<bool>());
    let second = (vec((1..40_000u64, 1..20_000u64), 0..3), 0.0..0.5f64, 0.0..0.5f64, 0..10_000u64, 0..5_000u64, any::<[bool; 4]>());
    (first, second)
        .prop_map(|((byte, framing, limit, burst, peak, mean, jitter), (outages, loss, copies, late, slot, which))| Scalable {
            byte,
            framing,
            limit,
            burst,
            peak,
            mean,
            jitter,
            outages,
            loss,
            copies,
            late,
            slot,
            which,
        })
        .boxed()
}

fn fate(event: &PacketEvent<u64>) -> &'static str {
    event.fate.name()
}

/// The packets, by number and copy, of which a question has the answer yes.
fn answers<T>(events: &[PacketEvent<u64>], answer: impl Fn(&PacketEvent<u64>) -> Option<T>) -> BTreeMap<(u64, u8), T> {
    events.iter().filter(|event| event.fate.is_end()).filter_map(|event| Some(((event.sequence, event.copy), answer(event)?))).collect()
}

/// Checks that both maps agree on all packets and copies that are in both.
fn agree<T: PartialEq + std::fmt::Debug>(one: &BTreeMap<(u64, u8), T>, other: &BTreeMap<(u64, u8), T>) -> Result<(), TestCaseError> {
    for (packet, answer) in one {
        if let Some(same) = other.get(packet) {
            prop_assert_eq!(answer, same, "{:?}", packet);
        }
    }
    Ok(())
}

properties! {
    #![proptest_config(cases(160))]

    #[test]
    fn a_stage_that_does_nothing_changes_nothing(config in any_stages(), offered in packets(), which in 0..14usize) {
        // A stage more between propagation and the end makes simultaneous packets come in the order of its queue; a fate log has an order of its own.
        prop_assert_eq!(all_records(config.clone(), &offered), all_records(with_nothing(&config, which), &offered), "{}", which);
    }

    #[test]
    fn a_link_that_is_slower_by_a_power_of_two_does_the_same_slower(scalable in scalable(), offered in packets(), shift in 1..7u32) {
        let offered: Vec<(Duration, PacketInfo)> =
            offered.into_iter().map(|(gap, info)| (nanos(u64::try_from(gap.as_nanos()).unwrap() / 16 % 2_000), info)).collect();
        let slow: Vec<(Duration, PacketInfo)> = offered.iter().map(|(gap, info)| (*gap * (1 << shift), *info)).collect();
        let (base, scaled) = (all_records(scalable.config(0), &offered), all_records(scalable.config(shift), &slow));
        prop_assert_eq!(base.len(), scaled.len());
        for (base, scaled) in base.iter().zip(&scaled) {
            prop_assert_eq!((base.sequence, base.copy, base.fate.name()), (scaled.sequence, scaled.copy, scaled.fate.name()));
            // Only jitter is rounded: by half a nanosecond, on either side.
            let (expected, found) = (base.at.as_nanos() << shift, scaled.at.as_nanos());
            let rounding = if scalable.jitter { 1 + (1 << shift) } else { 0 };
            prop_assert!(expected.abs_diff(found) <= rounding, "{:?} {:?}", base, scaled);
        }
    }

    /// A chain without a timetable, asked later, says the same later.
    #[test]
    fn traffic_that_starts_later_arrives_later(mut config in any_stages(), offered in packets(), later in 1..1_000_000_000u64) {
        config.outages = Outages::default();
        config.trace = None;
        config.listed = Impairments::default();
        config.cross_traffic = None;
        if let Loss::Pattern(_) = config.loss {
            config.loss = Loss::None;
        }
        if let Some(Bottleneck { service: service @ Service::Recorded(_), .. }) = &mut config.bottleneck {
            *service = Service::Rate(Rate::bits_per_sec(8_000_000).unwrap());
        }
        // The controller has a timer that runs from the start.
        if let Some(Bottleneck { discipline: discipline @ Discipline::DualPi2(_), .. }) = &mut config.bottleneck {
            *discipline = Discipline::TailDrop;
        }
        let mut shifted = offered.clone();
        shifted[0].0 += nanos(later);
        let moved = all_records(config.clone(), &offered).into_iter().map(|record| {
            let at = record.at + nanos(later);
            let fate = if let Fate::Delivered(_) = record.fate { Fate::Delivered(at) } else { record.fate };
            cohaptic_wan::PacketRecord { offered: record.offered + nanos(later), at, fate, ..record }
        });
        prop_assert_eq!(moved.collect::<Vec<_>>(), all_records(config, &shifted));
    }

    /// The packets lost with a higher probability include those lost with a lower one, whatever stages lie before and after the loss.
    #[test]
    fn a_higher_probability_loses_a_superset(config in any_stages(), offered in packets(), low in 0.0..1.0f64, more in 0.0..1.0f64) {
        let high = low + (1.0 - low) * more;
        let lost = |p| {
            let config = LinkConfig { loss: Loss::Independent(probability(p)), marks_instead_of_loss: false, trace: None, ..config.clone() };
            // Idle outages look at what was lost before.
            let outages = Outages::new(config.outages.scheduled().to_vec()).unwrap();
            let events = all_events(LinkConfig { outages, ..config }, &offered);
            answers(&events, |event| (event.fate == Fate::Dropped(DropCause::Loss)).then_some(()))
        };
        let (fewer, more) = (lost(low), lost(high));
        // In the physical layout a lost packet has no copy that could be lost; so only packets that exist in both are asked.
        prop_assert!(fewer.keys().filter(|(_, copy)| *copy == 0).all(|packet| more.contains_key(packet)), "{:?} {:?}", fewer, more);
    }

    #[test]
    fn a_larger_queue_never_drops_more_packets_of_one_size(gaps in vec(gap(), 1..120), size in 1..5u64, room in 0..6u64, more in 1..4u64) {
        let offered: Vec<(Duration, PacketInfo)> = gaps.into_iter().map(|gap| (gap, Bytes::new(size).into())).collect();
        let fates = |room| {
            let bottleneck = Bottleneck { limit: Some(QueueLimit::Packets(room)), ..Bottleneck::at_rate(Rate::bits_per_sec(8_000_000).unwrap()) };
            all_records(LinkConfig { bottleneck: Some(bottleneck), ..LinkConfig::default() }, &offered)
        };
        let dropped = |room| fates(room).iter().filter(|record| !matches!(record.fate, Fate::Delivered(_))).count();
        prop_assert!(dropped(room + more) <= dropped(room));
        // And a limit in bytes is one in packets of that size.
        let bytes = Bottleneck { limit: Some(QueueLimit::Bytes(Bytes::new(room * size + size - 1))), ..Bottleneck::at_rate(Rate::bits_per_sec(8_000_000).unwrap()) };
        prop_assert_eq!(all_records(LinkConfig { bottleneck: Some(bytes), ..LinkConfig::default() }, &offered), fates(room));
    }

    /// Common random numbers: which packets are copied, which bits are flipped and how long the path takes do not depend on the other stages.
    #[test]
    fn one_impairment_leaves_the_draws_of_the_others_alone(
        offered in packets(),
        copies in 0.0..1.0f64,
        bits in 0.0..0.2f64,
        losses in (0.0..1.0f64, 0.0..1.0f64),
        queue in proptest::option::of(0..3u64),
    ) {
        let base = LinkConfig {
            duplication: Chance::independent(probability(copies)),
            corruption: Some(Corruption { bits: Flips::Rate(probability(bits)), within: None, checksum: Checksum::Passes }),
            delay: Delay::with_jitter(micros(40), Jitter::new(micros(10), Distribution::Gamma)).unwrap(),
            ..LinkConfig::default()
        };
        let bottleneck = queue.map(|room| Bottleneck { limit: Some(QueueLimit::Packets(room)), ..Bottleneck::at_rate(Rate::bits_per_sec(80_000_000).unwrap()) });
        let variants = [
            base.clone(),
            LinkConfig { loss: Loss::Independent(probability(losses.0)), ..base.clone() },
            LinkConfig { loss: Loss::Independent(probability(losses.1)), limit: Some(30), bottleneck, ..base.clone() },
            LinkConfig { reorder: Some(Reorder { packets: Chance::independent(probability(0.0)), how: cohaptic_wan::Displacement::Later { by: micros(1) } }), ..base.clone() },
        ];
        let all: Vec<Vec<PacketEvent<u64>>> = variants.iter().map(|config| all_events(config.clone(), &offered)).collect();
        let first = &all[0];
        for other in &all[1..] {
            // Damage to packets that got as far as being damaged.
            let damage = |events: &[PacketEvent<u64>]| answers(events, |event| matches!(event.fate, Fate::Delivered(_)).then(|| event.damage.as_ref().map(Damage::bits).map(<[u64]>::to_vec)));
            agree(&damage(first), &damage(other))?;
            // A packet that was not lost is copied in both or in neither.
            let survived: Vec<u64> = other.iter().filter(|event| event.copy == 0 && fate(event) != "loss").map(|event| event.sequence).collect();
            let copied = |events: &[PacketEvent<u64>]| events.iter().filter(|event| event.fate == Fate::Duplicated && survived.contains(&event.sequence)).map(|event| event.sequence).collect::<Vec<_>>();
            prop_assert_eq!({ let mut copied = copied(first); copied.sort_unstable(); copied }, { let mut copied = copied(other); copied.sort_unstable(); copied });
        }
        // Delays, where no queue stands before the path.
        let delay = |events: &[PacketEvent<u64>]| answers(events, |event| matches!(event.fate, Fate::Delivered(_)).then_some(event.at));
        agree(&delay(&all[0]), &delay(&all[1]))?;
        agree(&delay(&all[0]), &delay(&all[3]))?;
    }

    /// A link that replays a fate log gives the same fate log, and so does a replay of that log.
    #[test]
    fn a_replay_of_a_replay_is_the_log(config in any_stages(), offered in packets()) {
        let log = FateLog::new(all_events(config, &offered).iter().map(|event| event.record)).unwrap();
        let sizes: Vec<(Duration, PacketInfo)> = offered.iter().map(|(gap, info)| (*gap, info.size.into())).collect();
        let mut again = log.clone();
        for _ in 0..2 {
            again = FateLog::new(all_events(LinkModel::Replay(Arc::new(again)), &sizes).iter().map(|event| event.record)).unwrap();
            prop_assert_eq!(&again, &log);
        }
        // Also through the text of a file.
        prop_assert_eq!(FateLog::parse(&log.to_text()).unwrap(), log);
    }

    /// Packets beyond the end of the log are dropped. Payload and size of each event are those of the offered packet, and not of the logged one.
    #[test]
    fn what_comes_after_the_log_is_dropped(config in any_stages(), offered in packets(), more in 1..5usize) {
        let log = FateLog::new(all_events(config, &offered).iter().map(|event| event.record)).unwrap();
        let packets = log.packets();
        let mut subject: Link<u64> = any_link(LinkModel::Replay(Arc::new(log)));
        for number in 0..packets + more {
            subject.handle_packet(at(7), Bytes::new(3), number as u64).unwrap();
        }
        subject.handle_timeout(Instant::MAX).unwrap();
        let events = drain(&mut subject);
        prop_assert!(events.iter().all(|event| event.size == Bytes::new(3) && event.payload == event.sequence));
        let beyond: Vec<u64> = events.iter().filter(|event| event.fate == Fate::Dropped(DropCause::EndOfLog)).map(|event| event.sequence).collect();
        prop_assert_eq!(beyond, (packets as u64..(packets + more) as u64).collect::<Vec<_>>());
    }
}
