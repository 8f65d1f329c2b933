//! Slots: waiting packets leave when a slot opens, as many as the slot takes.

use cohaptic_tests_common::properties;
use cohaptic_wan::random::Purpose;
use cohaptic_wan::{LinkConfig, SlotGap, Slots};
use proptest::prelude::*;

use super::{Act, Packet, Said, Script, delivered, draws, said, script, sorted};
use crate::any_link::slots;
use crate::random_links::cases;

struct Slot {
    opens: u64,
    packets: u64,
    bytes: u64,
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "microseconds")]
fn open(slots: &Slots, now: u64, number: &mut u64) -> Slot {
    let SlotGap::Between { min, max } = *slots.gap() else { unreachable!("only gaps between two spans are drawn here") };
    let gap = min.as_nanos() as f64 + (draws(*number, 0).draws(Purpose::Slot).next_unit() * (max - min).as_nanos() as f64).floor();
    *number += 1;
    Slot { opens: now + gap as u64, packets: slots.packets.map_or(u64::MAX, u64::from), bytes: slots.bytes.map_or(u64::MAX, u64::from) }
}

fn model(script: &Script<Slots>) -> Vec<Said> {
    let Act::Change(mut slots) = script[0].1.clone() else { unreachable!("a script begins with a configuration") };
    let (mut slot, mut number, mut waiting, mut said): (Option<Slot>, u64, Vec<Packet>, Vec<Said>) = (None, 0, Vec::new(), Vec::new());
    for (now, act) in script[1..].iter().map(|(now, act)| (*now, Some(act))).chain([(u64::MAX, None)]) {
        // What is offered at the instant of a slot still leaves with it: it is looked at again before the next operation.
        while let Some(present) = slot.as_mut().filter(|slot| slot.opens <= now && !waiting.is_empty()) {
            let first = waiting.remove(0);
            said.push(delivered(first, present.opens, false));
            present.packets -= 1;
            present.bytes = present.bytes.saturating_sub(first.size.max(1));
            if present.packets == 0 || present.bytes == 0 {
                let at = present.opens;
                slot = Some(open(&slots, at, &mut number));
            }
        }
        match act {
            None => {}
            Some(Act::Change(new)) => slots = new.clone(),
            Some(Act::Offer(packet)) => {
                if waiting.is_empty() && slot.as_ref().is_none_or(|slot| slot.opens < now) {
                    slot = Some(open(&slots, now, &mut number));
                }
                waiting.push(*packet);
            }
        }
    }
    sorted(said)
}

properties! {
    #![proptest_config(cases(320))]

    #[test]
    fn slots_with_shares_of_packets_and_bytes(script in script(slots())) {
        prop_assert_eq!(said(&script, |slots| LinkConfig { slots: Some(slots), ..LinkConfig::default() }), model(&script));
    }
}
