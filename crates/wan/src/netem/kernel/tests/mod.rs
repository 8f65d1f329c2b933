//! Tests of the kernel's netem: its tables, its laws and its queue. Figures called *published* are those of the table of netem's real behaviour in
//! `docs/netem.md`. Each figure comes from a run of the published formulas and has a sampling error of its own, which the tolerances include.

mod choices;
mod correlation;
mod loss_laws;
mod naive;
mod queue;
mod tables;

use cohaptic_units::Instant;

use super::qdisc::Packet;
use super::{DropReason, Output, Qdisc};
use crate::netem::Netem;

/// Length of packets \[bytes\] in tests in which the length does not matter.
const SIZE: u32 = 1000;

fn at(nanos: u64) -> Instant {
    Instant::from_nanos(nanos)
}

fn qdisc(words: &str, seed: u64) -> Qdisc<u64> {
    let netem = Netem::parse(words).unwrap_or_else(|error| panic!("{}", error.excerpt(words)));
    Qdisc::new(&netem, seed, |_| None).unwrap_or_else(|error| panic!("{words}: {error}"))
}

/// A packet that left.
#[derive(PartialEq, Debug)]
struct Left {
    packet: Packet<u64>,
    /// `true` if the packet left before waiting packets.
    reordered: bool,
}

impl core::ops::Deref for Left {
    type Target = Packet<u64>;

    fn deref(&self) -> &Packet<u64> {
        &self.packet
    }
}

/// Fates of packets that are numbered from 0.
#[derive(Default)]
struct Run {
    /// Packets that left, with their instants, in the order in which they left.
    delivered: Vec<(Instant, Left)>,
    lost: Vec<u64>,
    over_limit: Vec<u64>,
    duplicated: u64,
}

/// Drives the queue like an infinitely fast device: each packet that is due leaves at once.
struct Driver {
    qdisc: Qdisc<u64>,
    run: Run,
}

impl Driver {
    fn new(qdisc: Qdisc<u64>) -> Self {
        Self { qdisc, run: Run::default() }
    }

    fn drain(&mut self, now: Instant) {
        loop {
            let reordered = !self.qdisc.reordered.is_empty();
            let Some(packet) = self.qdisc.dequeue(now) else { return };
            self.run.delivered.push((now, Left { packet, reordered }));
        }
    }

    /// Lets all packets leave that are due before `until`.
    fn advance(&mut self, until: Instant) {
        while let Some(next) = self.qdisc.next_at().filter(|next| *next < until) {
            self.drain(next);
        }
    }

    fn offer(&mut self, now: Instant, number: u64, size: u32, ect: bool) {
        self.advance(now);
        let run = &mut self.run;
        self.qdisc.enqueue(now, size, ect, number, &mut |output| match output {
            Output::Duplicated => run.duplicated += 1,
            Output::Dropped { item, reason: DropReason::Loss, .. } => run.lost.push(item),
            Output::Dropped { item, reason: DropReason::Limit, .. } => run.over_limit.push(item),
        });
        self.drain(now);
    }

    fn finish(mut self) -> Run {
        self.advance(Instant::MAX);
        assert_eq!(self.qdisc.len(), 0);
        self.run
    }
}

/// Offers `count` packets of [`SIZE`] bytes, `spacing` nanoseconds apart, the first one after one spacing.
fn run(words: &str, seed: u64, count: u64, spacing: u64) -> Run {
    let mut driver = Driver::new(qdisc(words, seed));
    for number in 0..count {
        driver.offer(at((number + 1) * spacing), number, SIZE, false);
    }
    driver.finish()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn deviation(values: &[f64]) -> f64 {
    let mean = mean(values);
    (values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / values.len() as f64).sqrt()
}

/// Returns the autocorrelation at `lag`.
fn autocorrelation(values: &[f64], lag: usize) -> f64 {
    let mean = mean(values);
    let moment = |lag: usize| values.iter().zip(&values[lag..]).map(|(a, b)| (a - mean) * (b - mean)).sum::<f64>();
    moment(lag) / moment(0)
}
