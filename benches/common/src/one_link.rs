//! One link alone: a steady stream of packets through it, some 10⁴ of them in flight.
#![allow(clippy::cast_possible_truncation, reason = "delays are short")]

use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};
use std::time::{Duration, Instant as StdInstant};

use cohaptic_units::{Bytes, Instant, Probability};
use cohaptic_wan::random::{Purpose, Stream};
use cohaptic_wan::{Fate, Link, LinkConfig, LinkName, standard_normal};
use str0m_netem::{Input, Netem, NetemConfig, Output, WithLen};

/// Packets are a microsecond apart, and the mean delay is 10 ms.
pub const SPACING_NANOS: u64 = 1_000;
/// The mean delay.
pub const DELAY: Duration = Duration::from_millis(10);
/// The deviation of normal jitter, and half the width of uniform jitter.
pub const JITTER: Duration = Duration::from_millis(1);
/// The fraction of packets lost, where packets are lost independently.
pub const LOSS: f64 = 0.01;
/// Every packet has this size.
pub const SIZE: u64 = 64;
/// Twice what the stream needs, so that the stages work and seldom hold anything up \[bit/s\].
pub const RATE: u64 = 1_000_000_000;

/// Drives a link with the stream; gives how many packets are out by the last, with a look at the delay of each \[ns\].
///
/// # Panics
///
/// Never: time goes on.
pub fn drive(config: &LinkConfig, packets: u64, mut look: impl FnMut(u64)) -> u64 {
    let mut link = Link::new(1, &LinkName::between("a", "b"), config.clone());
    let mut out = 0;
    for number in 0..packets {
        let now = Instant::from_nanos(number * SPACING_NANOS);
        link.handle_packet(now, Bytes::new(SIZE), number).expect("time goes on");
        while let Some(event) = link.poll_event() {
            if matches!(event.fate, Fate::Delivered(_)) {
                out += 1;
                look(event.at.as_nanos() - event.offered.as_nanos());
            }
        }
    }
    out
}

/// A packet of str0m-netem, with its number.
#[derive(Clone, Copy, Debug)]
pub struct Packet(pub u64);

impl WithLen for Packet {
    fn len(&self) -> usize {
        SIZE as usize
    }
}

/// The same work for str0m-netem.
#[must_use]
pub fn str0m(config: NetemConfig, packets: u64) -> u64 {
    let begin = StdInstant::now();
    let mut netem = Netem::new(config);
    let mut out = 0;
    for number in 0..packets {
        netem.handle_input(Input::Packet(begin + Duration::from_nanos(number * SPACING_NANOS), Packet(number)));
        while let Some(output) = netem.poll_output() {
            match output {
                Output::Packet(_) => out += 1,
                Output::Timeout(_) => break,
            }
        }
    }
    out
}

/// A ring: what a constant delay needs at least.
pub fn ring(packets: u64, mut look: impl FnMut(u64)) -> u64 {
    let mut ring = VecDeque::new();
    let mut out = 0;
    for number in 0..packets {
        let now = number * SPACING_NANOS;
        ring.push_back((now + DELAY.as_nanos() as u64, number));
        while ring.front().is_some_and(|&(at, _)| at <= now) {
            if let Some((at, number)) = ring.pop_front() {
                out += 1;
                look(at - number * SPACING_NANOS);
            }
        }
    }
    out
}

/// A binary heap with normal jitter and loss, drawn from the same addresses as the link's: what others build on.
///
/// # Panics
///
/// Never: the loss is a probability.
pub fn heap(packets: u64, mut look: impl FnMut(u64)) -> u64 {
    let stream = Stream::new(1, LinkName::between("a", "b").as_str().as_bytes());
    let lost = Probability::new(LOSS).expect("a probability");
    let mut heap = BinaryHeap::new();
    let mut out = 0;
    for number in 0..packets {
        let now = number * SPACING_NANOS;
        let draws = stream.packet(number);
        let [loss, jitter] = draws.loss_and_jitter();
        if !lost.happens(loss) {
            let mut more = draws.more(Purpose::Jitter);
            let z = standard_normal(jitter, || more.next_word());
            let delay = (DELAY.as_nanos() as u64).saturating_add_signed((z * JITTER.as_secs_f64() * 1e9).round_ties_even() as i64);
            heap.push(Reverse((now + delay, number)));
        }
        while heap.peek().is_some_and(|&Reverse((at, _))| at <= now) {
            if let Some(Reverse((at, number))) = heap.pop() {
                out += 1;
                look(at - number * SPACING_NANOS);
            }
        }
    }
    out
}
