//! The bottleneck: a line that takes bit after bit, or on a recorded line byte after byte, and a queue whose rules are those of the papers: RED by the
//! text of Floyd & Jacobson (1993), CoDel by the pseudocode of RFC 8289, FQ-CoDel by the text of RFC 8290, DualPI2 by the pseudocode of RFC 9332. PIE does
//! nothing in the microseconds of these scripts; [`queue_laws`](crate::queue_laws) has its model.

mod codel;
mod dualpi2;

use std::collections::BTreeMap;

use cohaptic_tests_common::properties;
use cohaptic_units::Bytes;
use cohaptic_wan::random::Purpose;
use cohaptic_wan::{Bottleneck, DeliveryTrace, Discipline, DropCause, Framing, LinkConfig, Pie, QueueLimit, Red, Service};
use proptest::prelude::*;

use self::codel::Control;
use self::dualpi2::Coupled;
use super::{Act, Packet, Said, Script, delivered, draws, dropped, said, script, sorted};
use crate::any_link::{codel, dualpi2, fq_codel, framing, limit};
use crate::random_links::{BYTE_A_MICROSECOND, cases, rate};

/// 10⁻⁹ bit.
const BYTE: u128 = 8_000_000_000;

/// A recording as it is written: milliseconds in order, and bytes at each.
#[derive(Clone, Debug)]
struct Recording {
    millis: Vec<u64>,
    bytes: u64,
}

/// Bottleneck with, for a recorded service, the recording in a form that a test can read.
#[derive(Clone, Debug)]
struct Config {
    bottleneck: Bottleneck,
    recording: Option<Recording>,
}

fn recorded() -> BoxedStrategy<(Service, Option<Recording>)> {
    (proptest::collection::vec(0..3u64, 1..6), 1..8u64)
        .prop_map(|(gaps, bytes)| {
            let mut at = 1;
            let millis: Vec<u64> = gaps
                .into_iter()
                .map(|gap| {
                    at += gap;
                    at
                })
                .collect();
            let text: Vec<String> = millis.iter().map(u64::to_string).collect();
            let trace = DeliveryTrace::parse(&text.join("\n"), Bytes::new(bytes)).unwrap();
            (Service::Recorded(trace), Some(Recording { millis, bytes }))
        })
        .boxed()
}

fn config(service: BoxedStrategy<(Service, Option<Recording>)>, discipline: BoxedStrategy<Discipline>) -> BoxedStrategy<Config> {
    (service, framing(), limit(), discipline)
        .prop_map(|((service, recording), framing, limit, discipline)| Config {
            bottleneck: Bottleneck { service, framing, limit, discipline },
            recording,
        })
        .boxed()
}

fn rates() -> BoxedStrategy<(Service, Option<Recording>)> {
    prop_oneof![3 => Just(BYTE_A_MICROSECOND), 1 => Just(BYTE_A_MICROSECOND / 2), 1 => 100_000..100_000_000u64]
        .prop_map(|bits| (Service::Rate(rate(bits)), None))
        .boxed()
}

/// A packet in the queue or on the line.
#[derive(Clone, Copy)]
struct Queued {
    packet: Packet,
    came: u64,
    marked: bool,
}

struct Sending {
    queued: Queued,
    left: u128,
    /// Since when the rest is sent at the present rate, or the last opportunity.
    since: u64,
}

struct Line {
    config: Config,
    queue: Vec<Queued>,
    sending: Option<Sending>,
    said: Vec<Said>,
    // RED: the average, packets since one was hit, and since when the line idles.
    avg: f64,
    unhit: f64,
    idle_since: u64,
    /// CoDel of each queue. CoDel without flows has one queue, number 0.
    controls: BTreeMap<u32, Control>,
    /// FQ-CoDel: the two lists of queues with their rest of the turn \[bytes\].
    new: Vec<(u32, i64)>,
    old: Vec<(u32, i64)>,
    coupled: Coupled,
}

fn on_the_line(framing: Framing, size: u64) -> u128 {
    let mut bytes = (i128::from(size) + i128::from(framing.overhead)).max(0);
    if let Some(cells) = framing.cells {
        let mut whole = 0;
        while bytes > 0 {
            whole += i128::from(cells.payload.get()) + i128::from(cells.overhead);
            bytes -= i128::from(cells.payload.get());
        }
        bytes = whole;
    }
    u128::try_from(bytes).unwrap() * BYTE
}

impl Line {
    fn new(config: Config) -> Self {
        Self {
            config,
            queue: Vec::new(),
            sending: None,
            said: Vec::new(),
            avg: 0.0,
            unhit: 0.0,
            idle_since: 0,
            controls: BTreeMap::new(),
            new: Vec::new(),
            old: Vec::new(),
            coupled: Coupled::default(),
        }
    }

    fn bytes(&self) -> u64 {
        self.queue.iter().map(|queued| queued.packet.size).sum()
    }

    /// The first opportunity after an instant, and how many there are then: round after round is read from the begin.
    fn opportunity(&self, after: u64) -> (u64, u128) {
        let Recording { millis, bytes } = self.config.recording.as_ref().unwrap();
        let period = millis.last().unwrap() * 1_000_000;
        let mut begin = after / period * period;
        loop {
            if let Some(at) = millis.iter().map(|millis| begin + millis * 1_000_000).find(|at| *at > after) {
                let all = millis.iter().map(|millis| begin + millis * 1_000_000).filter(|other| *other == at).count() as u64;
                return (at, u128::from(all * bytes) * BYTE);
            }
            begin += period;
        }
    }

    fn next(&self) -> Option<u64> {
        let sending = self.sending.as_ref()?;
        Some(match &self.config.bottleneck.service {
            Service::Rate(rate) => sending.since + u64::try_from(sending.left.div_ceil(u128::from(rate.as_bits_per_sec()))).unwrap(),
            _ => self.opportunity(sending.since).0,
        })
    }

    fn pass(&mut self, until: u64) {
        while let Some(now) = self.next().filter(|now| *now <= until) {
            if let Service::Rate(_) = self.config.bottleneck.service {
                self.leave(now);
                continue;
            }
            let (_, mut capacity) = self.opportunity(self.sending.as_ref().unwrap().since);
            while capacity > 0 && self.sending.is_some() {
                // Byte by byte; of a packet whose bits a change of service cut there may be less than one left.
                let sending = self.sending.as_mut().unwrap();
                let part = sending.left.min(capacity).min(BYTE);
                sending.left -= part;
                capacity -= part;
                if sending.left == 0 {
                    self.leave(now);
                }
            }
            if let Some(sending) = &mut self.sending {
                sending.since = now;
            }
        }
    }

    fn leave(&mut self, now: u64) {
        let sending = self.sending.take().unwrap();
        self.said.push(delivered(sending.queued.packet, now, sending.queued.marked));
        self.send_next(now);
    }

    fn send_next(&mut self, now: u64) {
        let next = match self.config.bottleneck.discipline {
            Discipline::CoDel(codel) => self.deque(&codel, 0, now),
            Discipline::FqCoDel(fq_codel) => self.deque_in_turn(&fq_codel, now),
            Discipline::DualPi2(dualpi2) => self.dualpi2_dequeue(&dualpi2, now),
            _ => self.pop(0),
        };
        match next {
            None => self.idle_since = now,
            Some(queued) => {
                let left = on_the_line(self.config.bottleneck.framing, queued.packet.size);
                self.sending = Some(Sending { queued, left, since: now });
            }
        }
    }

    /// Floyd & Jacobson, sections 4 and 7 (method 2); after an idle time the average is what it would be after so many empty packets' times, and
    /// then the queue that the packet finds counts, as in Floyd's own simulator. Some(true) marks, Some(false) drops.
    fn red(&mut self, words: &Words, now: u64, packet: Packet) -> Option<bool> {
        if self.sending.is_none() {
            let mean = words.mean.max(1);
            let mean_packet = match &self.config.bottleneck.service {
                Service::Rate(rate) => {
                    let framed = on_the_line(self.config.bottleneck.framing, mean);
                    framed.div_ceil(u128::from(rate.as_bits_per_sec())) as f64
                }
                _ => {
                    let Recording { millis, bytes } = self.config.recording.as_ref().unwrap();
                    mean as f64 * (millis.last().unwrap() * 1_000_000) as f64 / (bytes * millis.len() as u64) as f64
                }
            };
            let m = if mean_packet > 0.0 { (now - self.idle_since) as f64 / mean_packet } else { 0.0 };
            self.avg *= (1.0 - words.weight).powf(m);
            self.idle_since = now;
        }
        // As (1 − w)·avg + w·q but for the rounding, which decides where the average tends to a threshold: a queue of `max` bytes that stays.
        self.avg += words.weight * (self.bytes() as f64 - self.avg);
        let (min, max) = (words.min as f64, words.max as f64);
        if self.avg < min {
            self.unhit = 0.0;
            return None;
        }
        if self.avg >= max {
            self.unhit = 0.0;
            return Some(false);
        }
        let pb = words.max_p * (self.avg - min) / (max - min);
        let pa = if self.unhit * pb < 1.0 { (pb / (1.0 - self.unhit * pb)).min(1.0) } else { 1.0 };
        if draws(packet.number, 0).draws(Purpose::Queue).next_unit() < pa {
            self.unhit = 0.0;
            Some(words.ecn && packet.ecn.is_capable())
        } else {
            self.unhit += 1.0;
            None
        }
    }

    fn is_full(&self, now: u64, size: u64) -> bool {
        match self.config.bottleneck.limit {
            None => false,
            Some(QueueLimit::Packets(limit)) => self.queue.len() as u64 + 1 > limit,
            Some(QueueLimit::Bytes(limit)) => self.bytes() + size > limit.get(),
            Some(QueueLimit::Time(limit)) => u128::from(self.turn(now) - now) > limit.as_nanos(),
        }
    }

    /// Returns the instant at which all present packets will have been sent \[ns\].
    fn turn(&self, now: u64) -> u64 {
        let sending = self.sending.as_ref().unwrap();
        let framing = self.config.bottleneck.framing;
        let mut ahead = sending.left + self.queue.iter().map(|queued| on_the_line(framing, queued.packet.size)).sum::<u128>();
        match &self.config.bottleneck.service {
            Service::Rate(rate) => {
                let rate = u128::from(rate.as_bits_per_sec());
                ahead = ahead.saturating_sub(rate * u128::from(now - sending.since));
                now + u64::try_from(ahead.div_ceil(rate)).unwrap()
            }
            _ => {
                let mut turn = now;
                loop {
                    let capacity;
                    (turn, capacity) = self.opportunity(turn);
                    if capacity >= ahead {
                        return turn;
                    }
                    ahead -= capacity;
                }
            }
        }
    }

    fn offer(&mut self, now: u64, packet: Packet, words: Option<&Words>) {
        if let Discipline::FqCoDel(fq_codel) = self.config.bottleneck.discipline {
            return self.offer_to_flow(&fq_codel, now, packet);
        }
        if let Discipline::DualPi2(dualpi2) = self.config.bottleneck.discipline {
            self.dualpi2_update(&dualpi2, now);
        }
        let mut queued = Queued { packet, came: now, marked: false };
        if let Some(words) = words {
            match self.red(words, now, packet) {
                None => {}
                Some(true) => queued.marked = true,
                Some(false) => return self.said.push(dropped(packet, now, DropCause::Red, false)),
            }
        }
        if self.sending.is_some() {
            while self.is_full(now, packet.size) {
                if self.config.bottleneck.discipline == Discipline::HeadDrop && !self.queue.is_empty() {
                    let head = self.queue.remove(0);
                    self.said.push(dropped(head.packet, now, DropCause::QueueFull, head.marked));
                } else {
                    return self.said.push(dropped(packet, now, DropCause::QueueFull, queued.marked));
                }
            }
        }
        self.queue.push(queued);
        if self.sending.is_none() {
            self.send_next(now);
        }
    }

    fn change(&mut self, now: u64, config: Config) {
        if let Some(sending) = &mut self.sending {
            if let Service::Rate(rate) = &self.config.bottleneck.service {
                sending.left = sending.left.saturating_sub(u128::from(rate.as_bits_per_sec()) * u128::from(now - sending.since));
            }
            sending.since = now;
        }
        // A change of the number of queues counts as a change of the discipline.
        let kind = |config: &Config| {
            let flows = if let Discipline::FqCoDel(fq_codel) = config.bottleneck.discipline { fq_codel.flows.get() } else { 0 };
            (std::mem::discriminant(&config.bottleneck.discipline), flows)
        };
        let is_same = kind(&self.config) == kind(&config);
        if let Discipline::DualPi2(dualpi2) = self.config.bottleneck.discipline {
            self.dualpi2_update(&dualpi2, now);
        }
        self.config = config;
        if !is_same {
            (self.avg, self.unhit) = (0.0, 0.0);
            self.controls.clear();
            self.new.clear();
            self.old.clear();
            self.coupled = Coupled::begun(now);
            if let Discipline::FqCoDel(fq_codel) = self.config.bottleneck.discipline {
                self.queue.clone().into_iter().for_each(|queued| self.lists(&fq_codel, queued.packet));
            }
        }
    }
}

/// Parameters of RED, kept here because [`Red`] has no accessors for some of them.
#[derive(Clone, Debug)]
struct Words {
    min: u64,
    max: u64,
    max_p: f64,
    weight: f64,
    mean: u64,
    ecn: bool,
}

type WithWords = (Config, Option<Words>);

fn model(script: &Script<WithWords>) -> Vec<Said> {
    let mut line: Option<Line> = None;
    let mut words = None;
    for (now, act) in script {
        if let Some(line) = &mut line {
            line.pass(*now);
        }
        match (act, &mut line) {
            (Act::Change((config, new)), line) => {
                words.clone_from(new);
                match line {
                    None => *line = Some(Line::new(config.clone())),
                    Some(line) => line.change(*now, config.clone()),
                }
            }
            (Act::Offer(packet), Some(line)) => line.offer(*now, *packet, words.as_ref()),
            (Act::Offer(_), None) => unreachable!("a script begins with a configuration"),
        }
        // A packet that takes no time on the line has left before anything else happens.
        if let Some(line) = &mut line {
            line.pass(*now);
        }
    }
    let mut line = line.unwrap();
    line.pass(u64::MAX);
    sorted(line.said)
}

fn link((config, _): WithWords) -> LinkConfig {
    LinkConfig { bottleneck: Some(config.bottleneck), ..LinkConfig::default() }
}

fn plain(config: BoxedStrategy<Config>) -> BoxedStrategy<WithWords> {
    config.prop_map(|config| (config, None)).boxed()
}

fn with_red() -> BoxedStrategy<WithWords> {
    let words = (0..6u64, 1..8u64, 0.0..=1.0f64, prop_oneof![Just(1.0), 0.001..1.0f64], 1..5u64, any::<bool>());
    let words = words.prop_map(|(min, more, max_p, weight, mean, ecn)| Words { min, max: min + more, max_p, weight, mean, ecn });
    (config(prop_oneof![rates(), recorded()].boxed(), Just(Discipline::TailDrop).boxed()), words)
        .prop_map(|(mut config, words)| {
            let (min, max, mean) = (Bytes::new(words.min), Bytes::new(words.max), Bytes::new(words.mean));
            let max_p = crate::random_links::probability(words.max_p);
            config.bottleneck.discipline = Discipline::Red(Red::new(min, max, max_p, words.weight, mean, words.ecn).unwrap());
            (config, Some(words))
        })
        .boxed()
}

fn queues() -> BoxedStrategy<Discipline> {
    prop_oneof![2 => Just(Discipline::TailDrop), 2 => Just(Discipline::HeadDrop), 1 => Just(Discipline::Pie(Pie::default()))].boxed()
}

properties! {
    #![proptest_config(cases(320))]

    #[test]
    fn tail_and_head_drop_with_all_limits_and_framings(script in script(plain(config(rates(), queues())))) {
        prop_assert_eq!(said(&script, link), model(&script));
    }

    #[test]
    fn recorded_service_byte_by_byte(script in script(plain(config(prop_oneof![3 => recorded(), 1 => rates()].boxed(), queues())))) {
        prop_assert_eq!(said(&script, link), model(&script));
    }

    #[test]
    fn codel_by_the_pseudocode_of_the_rfc(
        script in script(plain(config(prop_oneof![5 => rates(), 1 => recorded()].boxed(), codel().prop_map(Discipline::CoDel).boxed()))),
    ) {
        prop_assert_eq!(said(&script, link), model(&script));
    }

    #[test]
    fn fq_codel_by_the_text_of_the_rfc(
        script in script(plain(config(prop_oneof![5 => rates(), 1 => recorded()].boxed(), fq_codel().prop_map(Discipline::FqCoDel).boxed()))),
    ) {
        prop_assert_eq!(said(&script, link), model(&script));
    }

    #[test]
    fn dualpi2_by_the_pseudocode_of_the_rfc(
        script in script(plain(config(prop_oneof![5 => rates(), 1 => recorded()].boxed(), dualpi2().prop_map(Discipline::DualPi2).boxed()))),
    ) {
        prop_assert_eq!(said(&script, link), model(&script));
    }

    #[test]
    fn red_by_the_text_of_the_paper(script in script(with_red())) {
        prop_assert_eq!(said(&script, link), model(&script));
    }

    #[test]
    fn disciplines_that_take_turns(script in script(prop_oneof![
        plain(config(rates(), queues())),
        plain(config(rates(), codel().prop_map(Discipline::CoDel).boxed())),
        plain(config(rates(), fq_codel().prop_map(Discipline::FqCoDel).boxed())),
        plain(config(rates(), dualpi2().prop_map(Discipline::DualPi2).boxed())),
        with_red(),
    ].boxed())) {
        prop_assert_eq!(said(&script, link), model(&script));
    }
}
