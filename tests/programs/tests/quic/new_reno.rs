//! Predictions of RFC 9002: a packet-level model of its loss recovery and its congestion control (NewReno, appendices A and B), with random numbers of its own.
//!
//! It shares no line with quinn, the emulator or the test bed. It leaves out what a long transfer does not feel: handshake packets, the search of the path's MTU, flow
//! control, persistent congestion.

use std::collections::{BTreeMap, BinaryHeap, VecDeque};

/// A path and what is sent over it. Times in seconds, lengths in bytes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Path {
    pub(crate) rate_bits: f64,
    pub(crate) delay: f64,
    pub(crate) loss: f64,
    pub(crate) queue: f64,
    /// The length of a datagram, and how much of the file it carries.
    pub(crate) datagram: f64,
    pub(crate) payload: f64,
    pub(crate) file: f64,
}

/// RFC 9002, 6.1.1.
const PACKET_THRESHOLD: u64 = 3;
/// RFC 9002, 6.1.2.
const TIME_THRESHOLD: f64 = 9.0 / 8.0;
/// RFC 9002, 7.2, with the datagrams of 1,200 bytes with which a connection begins.
const INITIAL_WINDOW: f64 = 12_000.0;
/// RFC 9000, 18.2.
const MAX_ACK_DELAY: f64 = 0.025;
/// RFC 9002, 7.7: a little faster than a window per round trip, with bursts of an initial window.
const PACING_GAIN: f64 = 1.25;
const BURST: f64 = 10.0;

/// SplitMix64.
struct Numbers(u64);

impl Numbers {
    fn lost(&mut self, probability: f64) -> bool {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut word = self.0;
        word = (word ^ (word >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        word = (word ^ (word >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        word ^= word >> 31;
        ((word >> 11) as f64) < probability * 9_007_199_254_740_992.0
    }
}

#[derive(Clone, Copy, PartialEq, Debug)]
enum Event {
    /// A packet reaches the receiver.
    Arrival(u64),
    /// The receiver has waited long enough for a second packet.
    DelayedAck(u64),
    /// The sender hears of this number of arrivals.
    Ack(usize),
    /// The sender looks after losses and probes, if the timer was not set anew since.
    Timer(u64),
    /// The pacer lets go.
    Pace,
}

#[derive(PartialEq)]
struct At(f64, u64, Event);

impl Eq for At {}

impl PartialOrd for At {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for At {
    /// The earliest is the greatest, as the heap wants it.
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        other.0.total_cmp(&self.0).then(other.1.cmp(&self.1))
    }
}

#[derive(Clone, Copy)]
struct Sent {
    at: f64,
    chunk: u64,
}

struct Model {
    path: Path,
    numbers: Numbers,
    now: f64,
    events: BinaryHeap<At>,
    scheduled: u64,
    // The line.
    line_free: f64,
    // The receiver.
    arrived: Vec<u64>,
    highest: Option<u64>,
    unacknowledged: u64,
    missing: Vec<bool>,
    left: u64,
    // The sender.
    next_number: u64,
    /// By packet number.
    chunks: Vec<u64>,
    next_chunk: u64,
    again: VecDeque<u64>,
    out: BTreeMap<u64, Sent>,
    heard: usize,
    largest: Option<u64>,
    window: f64,
    threshold: f64,
    recovery: f64,
    smoothed: f64,
    variation: f64,
    latest: f64,
    probes: i32,
    /// How often the timer was set.
    timer: u64,
    tokens: f64,
    refilled: f64,
    is_pacing: bool,
    last_sent: f64,
}

/// How long it takes from the beginning of the handshake until the receiver has the whole file \[s\].
pub(crate) fn transfer_time(path: Path, seed: u64) -> f64 {
    // A handshake is a round trip; the file follows.
    let begin = 2.0 * path.delay;
    let chunks = (path.file / path.payload).ceil() as u64;
    let mut model = Model {
        path,
        numbers: Numbers(seed),
        now: begin,
        events: BinaryHeap::new(),
        scheduled: 0,
        line_free: 0.0,
        arrived: Vec::new(),
        highest: None,
        unacknowledged: 0,
        missing: vec![true; chunks as usize],
        left: chunks,
        next_number: 0,
        chunks: Vec::new(),
        next_chunk: 0,
        again: VecDeque::new(),
        out: BTreeMap::new(),
        heard: 0,
        largest: None,
        window: INITIAL_WINDOW,
        threshold: f64::INFINITY,
        recovery: -1.0,
        smoothed: 2.0 * path.delay,
        variation: path.delay,
        latest: 2.0 * path.delay,
        probes: 0,
        timer: 0,
        tokens: BURST * path.datagram,
        refilled: begin,
        is_pacing: false,
        last_sent: begin,
    };
    model.send_what_may();
    while model.left > 0 {
        let At(at, _, event) = model.events.pop().expect("the sender probes until it hears");
        model.now = at;
        model.handle(event);
    }
    model.now
}

impl Model {
    fn schedule(&mut self, at: f64, event: Event) {
        self.scheduled += 1;
        self.events.push(At(at, self.scheduled, event));
    }

    fn handle(&mut self, event: Event) {
        match event {
            Event::Arrival(number) => self.arrive(number),
            Event::DelayedAck(since) => {
                if self.unacknowledged > 0 && self.arrived.len() as u64 - self.unacknowledged == since {
                    self.acknowledge();
                }
            }
            Event::Ack(heard) => {
                self.hear(heard);
                self.send_what_may();
            }
            Event::Timer(set) if set != self.timer => {}
            Event::Timer(_) => {
                self.find_losses();
                self.probe();
                self.send_what_may();
            }
            Event::Pace => {
                self.is_pacing = false;
                self.send_what_may();
            }
        }
    }

    fn arrive(&mut self, number: u64) {
        let chunk = self.chunks[number as usize] as usize;
        if std::mem::replace(&mut self.missing[chunk], false) {
            self.left -= 1;
        }
        let in_order = self.highest.map_or(number == 0, |highest| number == highest + 1);
        self.highest = self.highest.max(Some(number));
        self.arrived.push(number);
        self.unacknowledged += 1;
        // RFC 9000, 13.2.1 and 13.2.2: at once if a packet is missing, else every second one, or after a while.
        if !in_order || self.unacknowledged >= 2 {
            self.acknowledge();
        } else {
            let since = self.arrived.len() as u64 - 1;
            self.schedule(self.now + MAX_ACK_DELAY, Event::DelayedAck(since));
        }
    }

    fn acknowledge(&mut self) {
        self.unacknowledged = 0;
        if !self.numbers.lost(self.path.loss) {
            self.schedule(self.now + self.path.delay, Event::Ack(self.arrived.len()));
        }
    }

    fn hear(&mut self, heard: usize) {
        let mut newest = None;
        for place in self.heard..heard {
            let number = self.arrived[place];
            let Some(sent) = self.out.remove(&number) else { continue };
            if self.largest.is_none_or(|largest| number > largest) {
                self.largest = Some(number);
                newest = Some(sent);
            }
            if sent.at > self.recovery {
                let datagram = self.path.datagram;
                self.window += if self.window < self.threshold { datagram } else { datagram * datagram / self.window };
            }
            self.probes = 0;
        }
        self.heard = self.heard.max(heard);
        if let Some(sent) = newest {
            self.latest = self.now - sent.at;
            self.variation += ((self.smoothed - self.latest).abs() - self.variation) / 4.0;
            self.smoothed += (self.latest - self.smoothed) / 8.0;
        }
        self.find_losses();
    }

    fn loss_delay(&self) -> f64 {
        TIME_THRESHOLD * self.smoothed.max(self.latest)
    }

    fn find_losses(&mut self) {
        let Some(largest) = self.largest else { return };
        let too_old = self.now - self.loss_delay() + 1e-9;
        let lost: Vec<(u64, Sent)> = self
            .out
            .range(..largest)
            .filter(|(number, sent)| **number + PACKET_THRESHOLD <= largest || sent.at <= too_old)
            .map(|(number, sent)| (*number, *sent))
            .collect();
        for (number, sent) in lost {
            self.out.remove(&number);
            self.again.push_back(sent.chunk);
            if sent.at > self.recovery {
                self.recovery = self.now;
                self.window = (self.window / 2.0).max(2.0 * self.path.datagram);
                self.threshold = self.window;
            }
        }
        self.set_timer();
    }

    fn set_timer(&mut self) {
        let gap = self.largest.and_then(|largest| self.out.range(..largest).next().map(|(_, sent)| sent.at + self.loss_delay()));
        let probe = (!self.out.is_empty()).then(|| self.last_sent + self.probe_timeout());
        if let Some(at) = gap.or(probe) {
            self.timer += 1;
            self.schedule(at.max(self.now + 1e-9), Event::Timer(self.timer));
        }
    }

    fn probe_timeout(&self) -> f64 {
        (self.smoothed + 4.0 * self.variation + MAX_ACK_DELAY) * 2f64.powi(self.probes)
    }

    fn probe(&mut self) {
        let is_due = self.now + 1e-9 >= self.last_sent + self.probe_timeout();
        let Some(oldest) = self.out.values().next().filter(|_| is_due).map(|sent| sent.chunk) else { return };
        self.probes += 1;
        self.send(oldest);
        self.set_timer();
    }

    fn send_what_may(&mut self) {
        while (self.out.len() as f64 + 1.0) * self.path.datagram <= self.window && !self.is_pacing {
            let Some(chunk) = self.again.pop_front().or_else(|| (self.next_chunk < self.missing.len() as u64).then_some(self.next_chunk)) else {
                return;
            };
            let speed = PACING_GAIN * self.window / self.smoothed;
            self.tokens = (self.tokens + speed * (self.now - self.refilled)).min(BURST * self.path.datagram);
            self.refilled = self.now;
            if self.tokens + 1e-6 < self.path.datagram {
                if chunk != self.next_chunk {
                    self.again.push_front(chunk);
                }
                self.is_pacing = true;
                self.schedule(self.now + (self.path.datagram - self.tokens) / speed, Event::Pace);
                return;
            }
            self.tokens -= self.path.datagram;
            if chunk == self.next_chunk {
                self.next_chunk += 1;
            }
            self.send(chunk);
            self.set_timer();
        }
    }

    fn send(&mut self, chunk: u64) {
        let number = self.next_number;
        self.next_number += 1;
        self.chunks.push(chunk);
        self.out.insert(number, Sent { at: self.now, chunk });
        self.last_sent = self.now;
        if self.numbers.lost(self.path.loss) {
            return;
        }
        // Bytes that wait, without the packet on the line.
        let service = 8.0 * self.path.datagram / self.path.rate_bits;
        let waiting = ((self.line_free - self.now) / service).ceil() - 1.0;
        if waiting > 0.0 && (waiting + 1.0) * self.path.datagram > self.path.queue {
            return;
        }
        self.line_free = self.line_free.max(self.now) + service;
        self.schedule(self.line_free + self.path.delay, Event::Arrival(number));
    }
}
