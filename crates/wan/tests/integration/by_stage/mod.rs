//! Every stage beside a naive model of it: slow, obvious, code of its own, over random operations and live changes. Only the addresses of the random
//! numbers are shared.

mod bottleneck;
mod copies;
mod losses;
mod modulation;
mod outages;
mod path;
mod reorder;
mod slots;
mod token_bucket;

use std::time::Duration;

use cohaptic_units::{Ecn, Instant};
use cohaptic_wan::random::{PacketDraws, Stream};
use cohaptic_wan::{Chance, DropCause, Fate, FateLog, LinkConfig, PacketEvent, PacketInfo};
use proptest::collection::vec;
use proptest::prelude::*;

use crate::any_link::{any_link, packet};
use crate::random_links::{SEED, at, drain, gap};

/// Fate of a packet or copy by a model: number of the packet, number of the copy, instant, fate, and `true` if marked.
type Said = (u64, u8, Instant, Fate, bool);

/// Operation on a link. `C` is the configuration of the tested stage.
#[derive(Clone, Copy, Debug)]
enum Act<C> {
    Offer(Packet),
    Change(C),
}

/// Offered packet.
#[derive(Clone, Copy, Debug)]
struct Packet {
    number: u64,
    /// Size \[bytes\].
    size: u64,
    ecn: Ecn,
}

/// Operations with their instants \[ns\].
type Script<C> = Vec<(u64, Act<C>)>;

/// Returns a strategy for scripts: a first configuration, then offers with occasional live changes.
fn script<C: Clone + std::fmt::Debug + 'static>(config: BoxedStrategy<C>) -> BoxedStrategy<Script<C>> {
    let first = config.clone();
    let act = prop_oneof![
        8 => packet().prop_map(Ok::<PacketInfo, C>),
        1 => config.prop_map(Err),
    ];
    (first, vec((gap(), act), 1..60))
        .prop_map(|(first, acts)| {
            let (mut now, mut number) = (Duration::ZERO, 0);
            let mut script = vec![(0, Act::Change(first))];
            for (gap, act) in acts {
                now += gap;
                let act = match act {
                    Err(config) => Act::Change(config),
                    Ok(PacketInfo { size, ecn }) => {
                        number += 1;
                        Act::Offer(Packet { number: number - 1, size: size.get(), ecn })
                    }
                };
                script.push((u64::try_from(now.as_nanos()).unwrap(), act));
            }
            script
        })
        .boxed()
}

/// Returns the events of a link under a script. `link` puts the configuration of the stage into the configuration of a link.
fn events<C: Clone>(script: &Script<C>, link: impl Fn(C) -> LinkConfig) -> Vec<PacketEvent<u64>> {
    let Some((_, Act::Change(first))) = script.first() else { unreachable!("a script begins with a configuration") };
    let mut subject = any_link(link(first.clone())).with_flows(|number| flow(*number));
    for (now, act) in &script[1..] {
        match act {
            Act::Offer(packet) => {
                let info = PacketInfo { size: cohaptic_units::Bytes::new(packet.size), ecn: packet.ecn };
                subject.handle_packet(at(*now), info, packet.number).unwrap();
            }
            Act::Change(config) => subject.set_model(at(*now), link(config.clone())).unwrap(),
        }
    }
    subject.handle_timeout(Instant::MAX).unwrap();
    drain(&mut subject)
}

/// Returns the fates of a link under a script, in the order of a fate log.
fn said<C: Clone>(script: &Script<C>, link: impl Fn(C) -> LinkConfig) -> Vec<Said> {
    let log = FateLog::new(events(script, link).iter().map(|event| event.record)).unwrap();
    log.records().iter().map(|record| (record.sequence, record.copy, record.at, record.fate, record.marked)).collect()
}

/// Sorts the fates of a model into the order of a fate log.
fn sorted(mut said: Vec<Said>) -> Vec<Said> {
    said.sort_by_key(|(number, copy, at, fate, _)| (*number, *copy, fate.is_end(), *at));
    said
}

fn delivered(packet: Packet, nanos: u64, marked: bool) -> Said {
    (packet.number, 0, at(nanos), Fate::Delivered(at(nanos)), marked)
}

fn dropped(packet: Packet, nanos: u64, cause: DropCause, marked: bool) -> Said {
    (packet.number, 0, at(nanos), Fate::Dropped(cause), marked)
}

/// Returns the flow of a packet: ten flows, in no order.
fn flow(number: u64) -> u32 {
    u32::try_from(number * number % 17 % 10).unwrap()
}

fn draws(number: u64, copy: u8) -> PacketDraws {
    Stream::new(SEED, b"left->right").copy(number, copy)
}

/// A chance by its definition: P(yes | yes) = p + ρ(1−p), P(yes | no) = p(1−ρ). A chance that is never asks for nothing and forgets.
#[derive(Clone, Copy, Default)]
struct Dar(Option<bool>);

impl Dar {
    fn happens(&mut self, chance: Chance, unit: impl FnOnce() -> f64) -> bool {
        let (p, rho) = (chance.probability().get(), chance.correlation());
        let yes = match self.0 {
            None => p,
            Some(before) => p * (1.0 - rho) + if before { rho } else { 0.0 },
        };
        let happens = unit() < yes;
        self.0 = Some(happens);
        happens
    }

    fn change(&mut self, chance: Chance) {
        if chance.is_never() {
            self.0 = None;
        }
    }
}
