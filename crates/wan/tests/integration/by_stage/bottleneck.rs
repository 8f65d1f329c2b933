//! The bottleneck: a line that takes bit after bit, or on a recorded line byte after byte, and a queue whose rules are those of the papers: RED by the
//! text of Floyd & Jacobson (1993), CoDel by the pseudocode of RFC 8289, FQ-CoDel by the text of RFC 8290. PIE does nothing in the microseconds of these
//! scripts; [`queue_laws`](crate::queue_laws) has its model.

use std::collections::BTreeMap;

use cohaptic_units::Bytes;
use cohaptic_wan::random::Purpose;
use cohaptic_wan::{Bottleneck, CoDel, DeliveryTrace, Discipline, DropCause, FqCoDel, Framing, LinkConfig, Pie, QueueLimit, Red, Service};
use proptest::prelude::*;

use super::{Act, Packet, Said, Script, delivered, draws, dropped, flow, said, script, sorted};
use crate::any_link::{codel, fq_codel, framing, limit};
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
}

/// CoDel, in the names of RFC 8289.
#[derive(Clone, Copy, Default)]
struct Control {
    first_above_time: Option<u64>,
    drop_next: u64,
    count: u64,
    lastcount: u64,
    dropping: bool,
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
        }
    }

    /// Number of the queue of a packet.
    fn number(&self, packet: Packet) -> u32 {
        if let Discipline::FqCoDel(fq_codel) = self.config.bottleneck.discipline { flow(packet.number) % fq_codel.flows.get() } else { 0 }
    }

    fn control(&mut self, number: u32) -> &mut Control {
        self.controls.entry(number).or_default()
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

    /// The oldest packet of a queue.
    fn pop(&mut self, number: u32) -> Option<Queued> {
        let place = self.queue.iter().position(|queued| self.number(queued.packet) == number)?;
        Some(self.queue.remove(place))
    }

    /// RFC 8290, section 4.2.
    fn deque_in_turn(&mut self, fq_codel: &FqCoDel, now: u64) -> Option<Queued> {
        loop {
            let is_new = !self.new.is_empty();
            let list = if is_new { &mut self.new } else { &mut self.old };
            let (number, credit) = *list.first()?;
            if credit <= 0 {
                list.remove(0);
                self.old.push((number, credit + i64::from(fq_codel.quantum.get())));
                continue;
            }
            let packet = self.deque(&fq_codel.codel, number, now);
            let list = if is_new { &mut self.new } else { &mut self.old };
            match packet {
                Some(queued) => {
                    list[0].1 -= i64::try_from(queued.packet.size).unwrap();
                    return Some(queued);
                }
                None => {
                    list.remove(0);
                    if is_new && !self.old.is_empty() {
                        self.old.push((number, credit));
                    }
                }
            }
        }
    }

    /// Puts the queue of a packet into the list of new ones, unless it is in a list.
    fn lists(&mut self, fq_codel: &FqCoDel, packet: Packet) {
        let number = self.number(packet);
        if self.new.iter().chain(&self.old).all(|(listed, _)| *listed != number) {
            self.new.push((number, fq_codel.quantum.get().into()));
        }
    }

    /// RFC 8290, section 4.1, and Linux: drops half of the bytes of the longest queue from its head. Scripts are too short for the 64 packets.
    fn drop_from_longest(&mut self, now: u64) {
        let mut bytes: BTreeMap<u32, u64> = BTreeMap::new();
        for queued in &self.queue {
            *bytes.entry(self.number(queued.packet)).or_default() += queued.packet.size;
        }
        let most = *bytes.values().max().unwrap();
        let number = *bytes.iter().find(|(_, bytes)| **bytes == most).unwrap().0;
        let mut gone = 0;
        while let Some(queued) = self.pop(number) {
            self.control(number).count += 1;
            self.said.push(dropped(queued.packet, now, DropCause::QueueFull, queued.marked));
            gone += queued.packet.size;
            if gone >= most / 2 {
                return;
            }
        }
    }

    fn offer_to_flow(&mut self, fq_codel: &FqCoDel, now: u64, packet: Packet) {
        self.lists(fq_codel, packet);
        self.queue.push(Queued { packet, came: now, marked: false });
        if self.sending.is_none() {
            return self.send_next(now);
        }
        loop {
            let Some(place) = self.queue.iter().position(|queued| queued.packet.number == packet.number) else { return };
            // As full as it is for the newest packet, which is not one of those before it.
            let newest = self.queue.remove(place);
            let is_full = self.is_full(now, packet.size);
            self.queue.insert(place, newest);
            if !is_full {
                return;
            }
            self.drop_from_longest(now);
        }
    }

    /// RFC 8289, section 5.5: the packet, and whether it may be dropped.
    fn dodequeue(&mut self, codel: &CoDel, number: u32, now: u64) -> Option<(Queued, bool)> {
        let Some(p) = self.pop(number) else {
            self.control(number).first_above_time = None;
            return None;
        };
        let bytes = self.bytes();
        let control = self.control(number);
        let mut ok_to_drop = false;
        let sojourn_time = now - p.came;
        if u128::from(sojourn_time) < codel.target.as_nanos() || bytes <= codel.mtu.get() {
            control.first_above_time = None;
        } else {
            match control.first_above_time {
                None => control.first_above_time = Some(now + u64::try_from(codel.interval.as_nanos()).unwrap()),
                Some(first_above_time) => ok_to_drop = now >= first_above_time,
            }
        }
        Some((p, ok_to_drop))
    }

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "microseconds")]
    fn control_law(codel: &CoDel, t: u64, count: u64) -> u64 {
        t + (codel.interval.as_nanos() as f64 / (count as f64).sqrt()).round_ties_even() as u64
    }

    /// Pseudo-code of RFC 8289, section 5.6. An ECN-capable packet that would be dropped is marked and sent, as in Linux.
    fn deque(&mut self, codel: &CoDel, number: u32, now: u64) -> Option<Queued> {
        let mut r = self.dodequeue(codel, number, now);
        let marks = |p: &Queued| codel.ecn && p.packet.ecn_capable;
        if self.control(number).dropping {
            if !r.is_some_and(|(_, ok_to_drop)| ok_to_drop) {
                self.control(number).dropping = false;
            }
            while now >= self.control(number).drop_next && self.control(number).dropping {
                let (mut p, _) = r.unwrap();
                self.control(number).count += 1;
                if marks(&p) {
                    p.marked = true;
                    let control = self.control(number);
                    control.drop_next = Self::control_law(codel, control.drop_next, control.count);
                    return Some(p);
                }
                self.said.push(dropped(p.packet, now, DropCause::CoDel, p.marked));
                r = self.dodequeue(codel, number, now);
                if r.is_some_and(|(_, ok_to_drop)| ok_to_drop) {
                    let control = self.control(number);
                    control.drop_next = Self::control_law(codel, control.drop_next, control.count);
                } else {
                    self.control(number).dropping = false;
                }
            }
        } else if let Some((mut p, true)) = r {
            if marks(&p) {
                p.marked = true;
                r = Some((p, true));
            } else {
                self.said.push(dropped(p.packet, now, DropCause::CoDel, p.marked));
                r = self.dodequeue(codel, number, now);
            }
            self.control(number).dropping = true;
            let control = self.control(number);
            let delta = control.count - control.lastcount;
            // Before the first drop there is no control that it could go on with.
            let recently =
                control.lastcount > 0 && i128::from(now) - i128::from(control.drop_next) < 16 * i128::try_from(codel.interval.as_nanos()).unwrap();
            control.count = if delta > 1 && recently { delta } else { 1 };
            control.drop_next = Self::control_law(codel, now, control.count);
            control.lastcount = control.count;
        }
        r.map(|(p, _)| p)
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
            Some(words.ecn && packet.ecn_capable)
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
        // Another number of queues is another discipline.
        let kind = |config: &Config| {
            let flows = if let Discipline::FqCoDel(fq_codel) = config.bottleneck.discipline { fq_codel.flows.get() } else { 0 };
            (std::mem::discriminant(&config.bottleneck.discipline), flows)
        };
        let is_same = kind(&self.config) == kind(&config);
        self.config = config;
        if !is_same {
            (self.avg, self.unhit) = (0.0, 0.0);
            self.controls.clear();
            self.new.clear();
            self.old.clear();
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

proptest! {
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
    fn red_by_the_text_of_the_paper(script in script(with_red())) {
        prop_assert_eq!(said(&script, link), model(&script));
    }

    #[test]
    fn disciplines_that_take_turns(script in script(prop_oneof![
        plain(config(rates(), queues())),
        plain(config(rates(), codel().prop_map(Discipline::CoDel).boxed())),
        plain(config(rates(), fq_codel().prop_map(Discipline::FqCoDel).boxed())),
        with_red(),
    ].boxed())) {
        prop_assert_eq!(said(&script, link), model(&script));
    }
}
