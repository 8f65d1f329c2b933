//! Stages that decide about a packet at once: largest size, copies, damage, and limit of packets.

use cohaptic_tests_common::properties;
use cohaptic_units::Bytes;
use cohaptic_wan::random::Purpose;
use cohaptic_wan::{Chance, Checksum, Corruption, Delay, DropCause, Fate, Flips, LinkConfig};
use proptest::prelude::*;

use super::{Act, Dar, Said, Script, draws, said, script, sorted};
use crate::any_link::{chance, corruption, micros};
use crate::random_links::{at, cases};

fn config() -> BoxedStrategy<LinkConfig> {
    let optional = (proptest::option::of((0..8u64).prop_map(Bytes::new)), proptest::option::of(corruption()), proptest::option::of(0..6u64));
    (optional, chance(), 0..20u64)
        .prop_map(|((mtu, corruption, limit), duplication, delay)| LinkConfig {
            mtu,
            duplication,
            corruption,
            limit,
            delay: Delay::constant(micros(delay)),
            ..LinkConfig::default()
        })
        .boxed()
}

/// Returns whether any bit of a packet is flipped.
fn is_hit(corruption: &Corruption, chance: &mut Dar, size: u64, number: u64, copy: u8) -> bool {
    let bytes = (0..size).filter(|byte| corruption.within.as_ref().is_none_or(|within| within.contains(byte))).count();
    let mut draws = draws(number, copy).draws(Purpose::Corruption);
    match corruption.bits {
        Flips::Bits { packets, count } => !packets.is_never() && chance.happens(packets, || draws.next_unit()) && bytes > 0 && count > 0,
        // The first hit bit by inversion: P(more than k bits stay whole) = (1 − rate)ᵏ.
        Flips::Rate(rate) if rate.get() == 1.0 => bytes > 0,
        Flips::Rate(rate) if rate.get() == 0.0 => false,
        Flips::Rate(rate) => {
            let whole = libm::log(1.0 - draws.next_unit()) / libm::log1p(-rate.get());
            whole < 8.0 * bytes as f64
        }
    }
}

fn model(script: &Script<LinkConfig>) -> Vec<Said> {
    let mut config = LinkConfig::default();
    let (mut copying, mut hitting) = (Dar::default(), Dar::default());
    let mut arrivals: Vec<u64> = Vec::new();
    let mut said = Vec::new();
    for (now, act) in script {
        match act {
            Act::Change(new) => {
                copying.change(new.duplication);
                hitting.change(match &new.corruption {
                    Some(Corruption { bits: Flips::Bits { packets, .. }, .. }) => *packets,
                    _ => Chance::default(),
                });
                config = new.clone();
            }
            Act::Offer(packet) => {
                if config.mtu.is_some_and(|mtu| packet.size > mtu.get()) {
                    said.push((packet.number, 0, at(*now), Fate::Dropped(DropCause::Mtu), false));
                    continue;
                }
                let copied = !config.duplication.is_never()
                    && copying.happens(config.duplication, || draws(packet.number, 0).draws(Purpose::Duplication).next_unit());
                if copied {
                    said.push((packet.number, 1, at(*now), Fate::Duplicated, false));
                }
                for copy in 0..=u8::from(copied) {
                    let hit = config.corruption.as_ref().is_some_and(|corruption| is_hit(corruption, &mut hitting, packet.size, packet.number, copy));
                    let inside = arrivals.iter().filter(|arrival| **arrival > *now).count();
                    // A packet that takes no time arrives when all that happens at its instant has happened.
                    let at_once = said.iter().filter(|(number, _, _, fate, _)| *number == packet.number && fate.is_end()).count();
                    let own = if config.delay.mean().is_zero() { at_once } else { 0 };
                    let fate = if config.limit.is_some_and(|limit| (inside + own) as u64 >= limit) {
                        Fate::Dropped(DropCause::Limit)
                    } else {
                        let arrival = now + u64::try_from(config.delay.mean().as_nanos()).unwrap();
                        arrivals.push(arrival);
                        let discards = config.corruption.as_ref().is_some_and(|corruption| corruption.checksum == Checksum::Discards);
                        if hit && discards { Fate::Dropped(DropCause::Checksum) } else { Fate::Delivered(at(arrival)) }
                    };
                    let when = if fate == Fate::Dropped(DropCause::Limit) { *now } else { *arrivals.last().unwrap() };
                    said.push((packet.number, copy, at(when), fate, false));
                }
            }
        }
    }
    sorted(said)
}

properties! {
    #![proptest_config(cases(320))]

    #[test]
    fn sizes_copies_damage_and_limits(script in script(config())) {
        prop_assert_eq!(said(&script, |config| config), model(&script));
    }
}
