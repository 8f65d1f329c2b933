//! Outages: by a timetable, by random spans, and of an idle link.

use cohaptic_tests_common::properties;
use cohaptic_wan::random::Purpose;
use cohaptic_wan::{DropCause, IdleOutages, LinkConfig, Outages, RandomOutages, Sojourn};
use proptest::prelude::*;

use super::{Act, Said, Script, delivered, draws, dropped, said, script, sorted};
use crate::any_link::any_outages;
use crate::random_links::cases;

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "milliseconds")]
fn span(law: Sojourn, number: u64) -> u64 {
    let mut draws = draws(number, 0).draws(Purpose::Outage);
    let mut exponential = |mean: f64| -mean * libm::log(1.0 - draws.next_unit());
    let nanos = match law {
        Sojourn::Fixed(span) => span.as_nanos() as f64,
        Sojourn::Exponential(mean) => exponential(mean.as_nanos() as f64),
        Sojourn::Uniform(from, to) => from.as_nanos() as f64 + (to - from).as_nanos() as f64 * draws.next_unit(),
        Sojourn::Erlang(mean, stages) => (0..stages).map(|_| exponential(1.0)).sum::<f64>() * (mean.as_nanos() as f64 / f64::from(stages)),
    };
    (nanos.round_ties_even() as u64).max(1)
}

/// Spans of a link that fails at random: (number, end).
struct Failing {
    number: u64,
    end: u64,
}

fn model(script: &Script<Outages>) -> Vec<Said> {
    let mut outages = Outages::default();
    let mut failing: Option<Failing> = None;
    let mut last_taken = 0;
    let mut said = Vec::new();
    for (now, act) in script {
        match act {
            Act::Change(new) => {
                if outages.idle().is_none() {
                    last_taken = *now;
                }
                if let (None, Some(RandomOutages { up, .. })) = (outages.random(), new.random()) {
                    let number = failing.as_ref().map_or(0, |before| before.number / 2 * 2 + 2);
                    failing = Some(Failing { number, end: now + span(up, number) });
                }
                outages = new.clone();
            }
            Act::Offer(packet) => {
                let scheduled = outages.scheduled().iter().any(|outage| outage.from.as_nanos() <= *now && *now < outage.to.as_nanos());
                let random = outages.random().is_some_and(|random| {
                    let failing = failing.as_mut().unwrap();
                    while failing.end <= *now {
                        failing.number += 1;
                        failing.end += span(if failing.number.is_multiple_of(2) { random.up } else { random.down }, failing.number);
                    }
                    failing.number % 2 == 1
                });
                let idle = outages.idle().is_some_and(|IdleOutages { after, down }| {
                    let (after, down) = (u64::try_from(after.as_nanos()).unwrap(), u64::try_from(down.as_nanos()).unwrap());
                    // It goes down `after` each time that it came up, for `down`.
                    let rounds = (now - last_taken) / (after + down);
                    now - last_taken - rounds * (after + down) >= after
                });
                if scheduled || random || idle {
                    said.push(dropped(*packet, *now, DropCause::Outage, false));
                } else {
                    last_taken = *now;
                    said.push(delivered(*packet, *now, false));
                }
            }
        }
    }
    sorted(said)
}

properties! {
    #![proptest_config(cases(240))]

    #[test]
    fn scheduled_random_and_idle_outages(script in script(any_outages())) {
        prop_assert_eq!(said(&script, |outages| LinkConfig { outages, ..LinkConfig::default() }), model(&script));
    }
}
