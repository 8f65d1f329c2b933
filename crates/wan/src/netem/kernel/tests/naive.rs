//! Compares the queue with a slow one that is simple enough to be checked by reading: a vector that is sorted anew for every look. Only random numbers,
//! transmission times and lengths of slots come from the tested code.

use core::num::NonZeroU32;
use core::time::Duration;

use cohaptic_tests_common::properties;
use proptest::option::of;
use proptest::prelude::*;

use crate::netem::kernel::airtime::Airtime;
use crate::netem::kernel::correlated::{Correlated, distributed};
use crate::netem::kernel::prng::Unseeded;
use crate::netem::kernel::slot::Slots;
use crate::netem::kernel::tests::at;
use crate::netem::kernel::{Output, Prng, Qdisc};
use crate::netem::{ChanceSpec, DelaySpec, JitterSpec, LossSpec, Netem, Percent, ReorderSpec, SlotGap, SlotSpec};

/// The simple queue, with the packets held in the order of their arrival.
struct Naive {
    netem: Netem,
    held: Vec<Held>,
    prng: Prng,
    unseeded: Unseeded,
    sequences: [Correlated; 5],
    slots: Option<Slots>,
    since_reordered: u32,
    arrivals: u64,
}

#[derive(Clone, Copy, PartialEq, Debug)]
struct Held {
    at_once: bool,
    time: i64,
    arrival: u64,
    item: u64,
    copy: u8,
    size: u32,
}

#[derive(Clone, PartialEq, Debug)]
enum Event {
    Copied,
    Dropped(u64, u8),
    Left(u64, u8),
    Nothing,
}

impl Naive {
    fn new(netem: &Netem, seed: u64) -> Self {
        let mut unseeded = Unseeded::new(seed);
        // Sequences of loss, delay, duplicate, corrupt and reorder. Without correlation their first values have no effect.
        let sequences = core::array::from_fn(|_| Correlated::new(0, &mut unseeded));
        let slots = netem.slot.as_ref().and_then(|slot| Slots::new(slot, None));
        Self { netem: netem.clone(), held: Vec::new(), prng: Prng::new(seed), unseeded, sequences, slots, since_reordered: 0, arrivals: 0 }
    }

    fn happens(&mut self, chance: Option<Percent>) -> bool {
        let probability = chance.map_or(0, Percent::as_u32);
        probability > 0 && self.prng.next_u32() <= probability
    }

    fn enqueue(&mut self, now: i64, size: u32, item: u64, copy: u8, events: &mut Vec<Event>) {
        let duplicated = copy == 0 && self.happens(self.netem.duplicate.map(|chance| chance.percent));
        let lost = match self.netem.loss {
            Some(LossSpec::Random(chance)) => self.happens(Some(chance.percent)),
            _ => false,
        };
        if lost && !duplicated {
            events.push(Event::Dropped(item, copy));
            return;
        }
        if duplicated && !lost {
            events.push(Event::Copied);
            self.enqueue(now, size, item, 1, events);
        }
        if self.held.len() >= self.netem.limit.unwrap_or(1000) as usize {
            events.push(Event::Dropped(item, copy));
            return;
        }
        let at_once = match self.netem.reorder {
            Some(ReorderSpec { chance, gap }) if chance.percent.as_u32() > 0 => {
                let turn = self.since_reordered + 1 >= gap.map_or(1, NonZeroU32::get);
                turn && self.prng.next_u32() <= chance.percent.as_u32()
            }
            _ => false,
        };
        let time = if at_once { now } else { self.time(now, size) };
        self.since_reordered = if at_once { 0 } else { self.since_reordered + 1 };
        self.held.push(Held { at_once, time, arrival: self.arrivals, item, copy, size });
        self.arrivals += 1;
    }

    fn time(&mut self, now: i64, size: u32) -> i64 {
        let (mean, sigma) = match &self.netem.delay {
            None => (0, 0),
            Some(delay) => (ticks(delay.time), delay.jitter.as_ref().map_or(0, |jitter| ticks(jitter.time))),
        };
        let prng = &mut self.prng;
        let delay = distributed(mean, i32::try_from(sigma).unwrap(), || self.sequences[1].next(prng), None);
        let Some(rate) = &self.netem.rate else { return now + delay };
        let transmission = i64::try_from(Airtime::new(rate).of(size)).unwrap();
        // The time is max(last, now + delay) + transmission time, or now + delay + transmission time if no packet is held.
        self.held.iter().map(|held| held.time).max().unwrap_or(i64::MIN).max(now + delay) + transmission
    }

    fn dequeue(&mut self, now: i64) -> Event {
        let mut order = self.held.clone();
        // Packets that leave at once come before all others, the last arrival first. The others come in the order of time, then of arrival.
        order.sort_by_key(|held| if held.at_once { (0, 0, u64::MAX - held.arrival) } else { (1, held.time, held.arrival) });
        let Some(first) = order.first() else { return Event::Nothing };
        if !first.at_once {
            if let Some(slots) = &mut self.slots {
                if slots.next < first.time {
                    slots.advance(now, &mut self.prng, &mut self.unseeded);
                }
                if slots.next > now {
                    return Event::Nothing;
                }
            }
            if first.time > now {
                return Event::Nothing;
            }
            if let Some(slots) = &mut self.slots
                && slots.spend(first.size)
            {
                slots.advance(now, &mut self.prng, &mut self.unseeded);
            }
        }
        self.held.retain(|held| held != first);
        Event::Left(first.item, first.copy)
    }
}

/// Converts a time to whole microseconds, then to whole ticks of 64 ns \[ns\].
fn ticks(span: Duration) -> i64 {
    i64::try_from(span.as_micros() * 1000 / 64 * 64).unwrap()
}

fn chance() -> impl Strategy<Value = ChanceSpec> {
    (0..=100_u32).prop_map(|percent| ChanceSpec { percent: Percent::new(f64::from(percent)).unwrap(), correlation: None })
}

/// Netems whose times are similar to those between the operations.
fn netem() -> impl Strategy<Value = Netem> {
    let time = || (1..200_u64).prop_map(Duration::from_micros);
    let delay = (time(), of(time()))
        .prop_map(|(time, jitter)| DelaySpec { time, jitter: jitter.map(|time| JitterSpec { time, correlation: None, distribution: None }) });
    let reorder = (chance(), of((1..4_u32).prop_map(|gap| NonZeroU32::new(gap).unwrap())));
    let slot = (time(), time(), of(1..4_u32), of(1..4000_u32)).prop_map(|(a, b, packets, bytes)| SlotSpec {
        gap: SlotGap::Range { min: a.min(b), max: Some(a.max(b)) },
        packets: packets.and_then(NonZeroU32::new),
        bytes: bytes.and_then(NonZeroU32::new),
    });
    let rate = prop_oneof![Just("rate 100mbit"), Just("rate 400mbit 20"), Just("rate 100mbit -14 48 5")]
        .prop_map(|words| Netem::parse(words).unwrap().rate.unwrap());
    (of(0..20_u32), delay, of(chance()), of(chance()), of(reorder), of(rate), of(slot)).prop_map(
        |(limit, delay, loss, duplicate, reorder, rate, slot)| Netem {
            limit,
            delay: Some(delay),
            loss: loss.map(LossSpec::Random),
            duplicate,
            reorder: reorder.map(|(chance, gap)| ReorderSpec { chance, gap: gap.filter(|_| chance.percent > Percent::ZERO) }),
            rate,
            slot,
            ..Netem::default()
        },
    )
}

/// Operations: each waits for a time \[µs\], then offers a packet of a size, or only looks.
fn operations() -> impl Strategy<Value = Vec<(u64, Option<u32>)>> {
    prop::collection::vec((0..60_u64, of(prop_oneof![4 => 60..1514_u32])), 1..120)
}

fn drain(qdisc: &mut Qdisc<u64>, naive: &mut Naive, now: u64) -> Result<(u64, u64), TestCaseError> {
    let mut left = 0;
    loop {
        let actual = qdisc.dequeue(at(now)).map_or(Event::Nothing, |packet| Event::Left(packet.item, packet.copy));
        prop_assert_eq!(&actual, &naive.dequeue(i64::try_from(now).unwrap()));
        if actual == Event::Nothing {
            break;
        }
        left += 1;
    }
    // No packet is due any more, so that the next look is later.
    prop_assert!(qdisc.next_at().is_none_or(|next| next > at(now)));
    prop_assert_eq!(qdisc.len(), naive.held.len());
    Ok((left, now))
}

properties! {
    #[test]
    fn the_queue_does_what_a_sorted_vector_does(netem in netem(), operations in operations(), seed in any::<u64>()) {
        let mut qdisc = Qdisc::new(&netem, seed, |_| None).unwrap();
        let mut naive = Naive::new(&netem, seed);
        let (mut now, mut offered, mut copied, mut dropped, mut left) = (0, 0_u64, 0_u64, 0_u64, 0);
        for (wait, size) in operations {
            let until = now + wait * 1000;
            // The simple queue looks whenever the tested queue says that an event is due.
            while let Some(next) = qdisc.next_at().filter(|next| *next <= at(until)) {
                now = next.as_nanos();
                left += drain(&mut qdisc, &mut naive, now)?.0;
            }
            now = until;
            if let Some(size) = size {
                let (mut actual, mut expected) = (Vec::new(), Vec::new());
                qdisc.enqueue(at(now), size, false, offered, &mut |output| actual.push(match output {
                    Output::Duplicated => Event::Copied,
                    Output::Dropped { item, copy, .. } => Event::Dropped(item, copy),
                }));
                naive.enqueue(i64::try_from(now).unwrap(), size, offered, 0, &mut expected);
                prop_assert_eq!(&actual, &expected);
                offered += 1;
                copied += actual.iter().filter(|event| **event == Event::Copied).count() as u64;
                dropped += actual.iter().filter(|event| matches!(event, Event::Dropped(..))).count() as u64;
            }
            left += drain(&mut qdisc, &mut naive, now)?.0;
            prop_assert_eq!(offered + copied, left + dropped + qdisc.len() as u64, "nothing comes from nowhere or is forgotten");
        }
        // The queue runs empty by itself.
        while let Some(next) = qdisc.next_at() {
            left += drain(&mut qdisc, &mut naive, next.as_nanos().max(now))?.0;
        }
        prop_assert_eq!(offered + copied, left + dropped);
    }

    /// No words make the queue panic or lose track of a packet.
    #[test]
    fn every_netem_conserves_packets(
        netem in crate::netem::tests::round_trip::netem(),
        sizes in prop::collection::vec(any::<u32>(), 1..40),
        spacing in 0..1_000_000_000_u64,
        seed in any::<u64>(),
    ) {
        let table = |_: &crate::netem::TableName| crate::netem::kernel::Table::parse("-8192 0 8192").ok();
        let Ok(mut qdisc) = Qdisc::new(&netem, seed, table) else { return Ok(()) };
        let (mut offered, mut copied, mut dropped, mut left, mut now) = (0, 0, 0, 0, 0);
        for size in sizes {
            now += spacing;
            qdisc.enqueue(at(now), size, size % 2 == 0, (), &mut |output| match output {
                Output::Duplicated => copied += 1,
                Output::Dropped { .. } => dropped += 1,
            });
            offered += 1;
            left += core::iter::from_fn(|| qdisc.dequeue(at(now))).count();
            prop_assert_eq!(offered + copied, left + dropped + qdisc.len());
        }
    }
}
