//! Reordering over a constant delay: packets that jump ahead, are held until others have passed, or take longer.

use std::time::Duration;

use cohaptic_tests_common::properties;
use cohaptic_wan::random::Purpose;
use cohaptic_wan::{Delay, Displacement, LinkConfig, Reorder};
use proptest::prelude::*;

use super::{Act, Dar, Packet, Said, Script, delivered, draws, said, script, sorted};
use crate::any_link::{micros, reorder};
use crate::random_links::cases;

type Config = (Option<Reorder>, u64);

struct Held {
    packet: Packet,
    passed_by: u32,
    until: u64,
}

fn nanos(span: Duration) -> u64 {
    u64::try_from(span.as_nanos()).unwrap()
}

fn model(script: &Script<Config>) -> Vec<Said> {
    let (mut config, mut delay) = (None, 0);
    let (mut dar, mut since_jump, mut held, mut said): (Dar, u32, Vec<Held>, Vec<Said>) = (Dar::default(), 0, Vec::new(), Vec::new());
    for (now, act) in script.iter().map(|(now, act)| (*now, Some(act))).chain([(u64::MAX, None)]) {
        held.retain(|held| {
            if held.until <= now {
                said.push(delivered(held.packet, held.until + delay, false));
            }
            held.until > now
        });
        match act {
            None => {}
            Some(Act::Change((new, micros))) => {
                delay = micros * 1_000;
                if new.is_none() {
                    said.extend(held.drain(..).map(|held| delivered(held.packet, now + delay, false)));
                    dar = Dar::default();
                }
                if let Some(Reorder { packets, .. }) = new {
                    dar.change(*packets);
                }
                config = *new;
            }
            Some(Act::Offer(packet)) => {
                let chosen = config.filter(|config: &Reorder| match config.how {
                    // The gap-th packet after one that jumped may jump.
                    Displacement::Jump { gap } => since_jump + 1 >= gap.get(),
                    _ => true,
                });
                let chosen = chosen.filter(|config| {
                    let unit = || draws(packet.number, 0).draws(Purpose::Reordering).next_unit();
                    !config.packets.is_never() && dar.happens(config.packets, unit)
                });
                if config.is_some() {
                    since_jump = if chosen.is_some() { 0 } else { since_jump + 1 };
                }
                let how = chosen.map(|config| config.how);
                if let Some(Displacement::Behind { packets, at_most }) = how {
                    held.push(Held { packet: *packet, passed_by: packets.get(), until: now + nanos(at_most) });
                    // Not to be held at all is to go on at once.
                    held.retain(|held| {
                        if held.until <= now {
                            said.push(delivered(held.packet, held.until + delay, false));
                        }
                        held.until > now
                    });
                    continue;
                }
                let arrival = match how {
                    Some(Displacement::Jump { .. }) => now,
                    Some(Displacement::Later { by }) => now + delay + nanos(by),
                    _ => now + delay,
                };
                said.push(delivered(*packet, arrival, false));
                held.iter_mut().for_each(|held| held.passed_by -= 1);
                held.retain(|held| {
                    if held.passed_by == 0 {
                        said.push(delivered(held.packet, now + delay + 1, false));
                    }
                    held.passed_by > 0
                });
            }
        }
    }
    sorted(said)
}

properties! {
    #![proptest_config(cases(320))]

    #[test]
    fn jumps_swaps_and_late_packets(script in script((proptest::option::weighted(0.9, reorder()), 0..20u64).boxed())) {
        let link = |(reorder, delay)| LinkConfig { reorder, delay: Delay::constant(micros(delay)), ..LinkConfig::default() };
        prop_assert_eq!(said(&script, link), model(&script));
    }
}
