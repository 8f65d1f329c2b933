//! Choice of the faults of a connection, by its number and the seed.

use std::time::Duration;

use cohaptic_linkfile::stream::{Hit, StreamConfig};
use cohaptic_wan::random::{Purpose, Stream};

use super::direction::Direction;
use super::{Side, Timer};
use crate::config::Proxy;

/// Directions and deadlines of a new connection. Deadlines are ages of the connection.
pub(super) struct Chosen {
    /// Direction of the bytes of each side, with the time by which its end is late.
    pub(super) directions: [(Direction, Duration); 2],
    pub(super) timers: Vec<(Duration, Timer)>,
}

/// Returns the faults of the connection with the given number of a proxy.
pub(super) fn chosen(seed: u64, proxy: &Proxy, number: u64) -> Chosen {
    let mut timers = Vec::new();
    let mut direction = |from: Side, stream: &StreamConfig| {
        let faults = &stream.faults;
        let lot = Lot { seed, proxy: &proxy.name, number };
        timers.extend(lot.hit("close-after", faults.close_after).map(|after| (after, Timer::CloseAfter)));
        timers.extend(lot.hit("reset-after", faults.reset_after).map(|after| (after, Timer::ResetAfter)));
        if let Some(stall) = lot.hit("stall", faults.stall) {
            timers.push((stall.after, Timer::Stall(from)));
            timers.extend(stall.length.map(|length| (stall.after.saturating_add(length), Timer::Resume(from))));
        }
        let side = if from == Side::Client { "forth" } else { "back" };
        let sizes = |law| (law, Stream::new(seed, format!("{}/slice/{side}/{number}", proxy.name).as_bytes()));
        let slices = lot.hit("slice", faults.slice).map(sizes);
        let cut = lot.hit("cut-after", faults.cut_after).map(|bytes| bytes.get());
        (Direction::new(stream.window(), cut, slices), lot.hit("slow-close", faults.slow_close).unwrap_or_default())
    };
    let directions = [direction(Side::Client, &proxy.forth), direction(Side::Server, &proxy.back)];
    Chosen { directions, timers }
}

/// Seed, names and number that select the random numbers of one connection.
struct Lot<'a> {
    seed: u64,
    proxy: &'a str,
    number: u64,
}

impl Lot<'_> {
    /// Returns the fault if the connection has the fault. Each fault has random numbers of its own, which do not depend on the direction: a fault in both
    /// directions has the same connections.
    fn hit<T: Copy>(&self, name: &str, hit: Option<Hit<T>>) -> Option<T> {
        let hit = hit?;
        let word = Stream::new(self.seed, format!("{}/{name}", self.proxy).as_bytes()).packet(self.number).first(Purpose::Loss);
        hit.share.happens(word).then_some(hit.fault)
    }
}
