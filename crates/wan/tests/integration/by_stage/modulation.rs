//! A modulated link is a link whose configuration somebody changes at the instants of the modulator's path.

use std::time::Duration;

use cohaptic_tests_common::properties;
use cohaptic_units::Instant;
use cohaptic_wan::random::{Purpose, Stream};
use cohaptic_wan::{Modulator, PacketEvent, PacketInfo, Sojourn};
use proptest::prelude::*;

use crate::any_link::{all_events, any_link, modulated, packets};
use crate::random_links::{SEED, at, cases, drain};

/// Returns the states of a modulator up to an instant, each as the instant at which it begins \[ns\] and its index.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "milliseconds")]
fn path(modulator: &Modulator, until: u64) -> Vec<(u64, usize)> {
    let stream = Stream::new(SEED, format!("modulator {}", modulator.name()).as_bytes());
    let mut path = vec![(0, 0)];
    for number in 0.. {
        let (begin, state) = *path.last().unwrap();
        // The first word of a change is for where it goes, those from the second on for how long the state lasts that it ends.
        let mut draws = stream.packet(number).draws(Purpose::Modulation);
        let place = draws.next_unit();
        let mut exponential = || -libm::log(1.0 - draws.next_unit());
        let words = &modulator.states()[state];
        let span = match words.sojourn.unwrap() {
            Sojourn::Fixed(span) => span.as_nanos() as f64,
            Sojourn::Exponential(mean) => mean.as_nanos() as f64 * exponential(),
            Sojourn::Uniform(from, to) => from.as_nanos() as f64 + (to - from).as_nanos() as f64 * draws.next_unit(),
            Sojourn::Erlang(mean, stages) => mean.as_nanos() as f64 / f64::from(stages) * (0..stages).map(|_| exponential()).sum::<f64>(),
        };
        let end = begin + (span.round_ties_even() as u64).max(1);
        if end > until {
            break;
        }
        // A point on all weights laid end to end.
        let total: f64 = words.next.iter().sum();
        let mut edge = 0.0;
        let next = words.next.iter().position(|weight| {
            edge += weight;
            place * total < edge
        });
        path.push((end, next.unwrap()));
    }
    path
}

properties! {
    #![proptest_config(cases(120))]

    #[test]
    fn a_modulated_link_is_one_that_is_changed_at_the_instants_of_the_path(modulated in modulated(), mut offered in packets()) {
        // A path of some ten thousand changes is enough.
        for (gap, info) in &mut offered {
            *gap = (*gap).min(Duration::from_millis(5));
            info.size = info.size.min(cohaptic_units::Bytes::new(20));
        }
        let by_itself = all_events(modulated.clone(), &offered);
        let mut instants = Vec::new();
        let mut now = Instant::ZERO;
        for (gap, info) in &offered {
            now += *gap;
            instants.push((now.as_nanos(), *info));
        }
        let last = by_itself.iter().map(|event| event.at).max().unwrap();
        let path = path(modulated.modulator(), last.max(now).as_nanos());
        let mut subject = any_link(modulated.configs()[0].clone());
        let mut coming = instants.into_iter().zip(0u64..).peekable();
        let mut offer_until = |subject: &mut cohaptic_wan::Link<u64>, until: u64| {
            while let Some(((now, info), number)) = coming.next_if(|((now, _), _)| *now < until) {
                let info: PacketInfo = info;
                subject.handle_packet(at(now), info, number).unwrap();
            }
        };
        for (begin, state) in &path[1..] {
            offer_until(&mut subject, *begin);
            subject.set_model(at(*begin), modulated.configs()[*state].clone()).unwrap();
        }
        offer_until(&mut subject, u64::MAX);
        subject.handle_timeout(Instant::MAX).unwrap();
        let sorted = |mut events: Vec<PacketEvent<u64>>| {
            events.sort_by_key(|event| (event.sequence, event.copy, event.fate.is_end(), event.at));
            events
        };
        prop_assert_eq!(sorted(by_itself), sorted(drain(&mut subject)));
    }
}
