//! The bottleneck: a finite first-in-first-out queue before a serialiser of fixed rate. Tail drop.
//!
//! ```text
//! offered ──► [ waiting … ] ──► serialiser, 8·(L + overhead)/R per packet ──► propagation
//!             limit counts these    the packet in service is not counted
//! ```
//!
//! What leaves in any window t is at most R·t plus one packet, because the service time is rounded up. A departure at an instant makes room for
//! a packet that is offered at the same instant. A change of rate in the middle of a packet integrates the bits: what is already on the wire stays sent.

use alloc::collections::VecDeque;
use core::time::Duration;

use cohaptic_units::{Bytes, Instant, Rate};

/// How much may wait before the serialiser. The packet being serialised does not count.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum QueueLimit {
    /// At most so many packets wait; with 0, a packet that finds the line busy is dropped.
    Packets(u64),
    /// The packets that wait hold at most so many bytes together, overhead not counted.
    Bytes(Bytes),
}

/// A serialisation rate and the queue before it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Bottleneck {
    /// The rate of the line.
    pub rate: Rate,
    /// What every packet costs beyond its own size, such as 28 bytes for IPv4 and UDP.
    pub overhead: Bytes,
    /// How much may wait; `None`: no limit.
    pub limit: Option<QueueLimit>,
}

impl Bottleneck {
    /// How long a packet of that size occupies the line.
    #[must_use]
    pub fn service_time(&self, size: Bytes) -> Duration {
        self.rate.serialisation_time(size + self.overhead)
    }

    /// 10⁻⁹ bits of a packet on the line: see [`Rate::transmission_time`].
    fn giga_bits(&self, size: Bytes) -> u128 {
        u128::from((size + self.overhead).get()) * 8_000_000_000
    }
}

/// The stage: what waits and what is on the line.
#[derive(Clone, Debug)]
pub(crate) struct BottleneckStage<T> {
    config: Bottleneck,
    waiting: VecDeque<(Bytes, T)>,
    /// Wider than [`Bytes`], whose sum would saturate and then count wrongly.
    waiting_bytes: u128,
    in_service: Option<InService<T>>,
    /// Counts departures that were announced, so that one that a change of rate made stale is known.
    announced: u64,
}

#[derive(Clone, Debug)]
struct InService<T> {
    item: T,
    /// Since when what is left is sent at the present rate.
    since: Instant,
    /// What was left then, in 10⁻⁹ bit.
    left: u128,
    departure: Instant,
}

/// The line will have sent its packet at `at`; `ticket` says which announcement this is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Departure {
    pub(crate) at: Instant,
    pub(crate) ticket: u64,
}

impl<T> BottleneckStage<T> {
    /// An idle line. Announcements count on from `announced`, so that those of a line that stood here before stay stale.
    pub(crate) fn new(config: Bottleneck, announced: u64) -> Self {
        Self { config, waiting: VecDeque::new(), waiting_bytes: 0, in_service: None, announced }
    }

    /// Takes a packet. `Ok(Some)`: the line was idle and has begun to send it. `Ok(None)`: it waits. `Err`: the queue is full; the packet comes back.
    pub(crate) fn offer(&mut self, now: Instant, size: Bytes, item: T) -> Result<Option<Departure>, T> {
        if self.in_service.is_none() {
            return Ok(Some(self.serve(now, size, item)));
        }
        let full = match self.config.limit {
            None => false,
            Some(QueueLimit::Packets(limit)) => self.waiting.len() as u64 >= limit,
            Some(QueueLimit::Bytes(limit)) => self.waiting_bytes + u128::from(size.get()) > u128::from(limit.get()),
        };
        if full {
            return Err(item);
        }
        self.waiting.push_back((size, item));
        self.waiting_bytes += u128::from(size.get());
        Ok(None)
    }

    /// The packet that leaves the line with this announcement, and the announcement of the next one. `None` if the announcement is stale.
    pub(crate) fn depart(&mut self, departure: Departure) -> Option<(T, Option<Departure>)> {
        if departure.ticket != self.announced {
            return None;
        }
        let sent = self.in_service.take()?;
        Some((sent.item, self.serve_next(departure.at)))
    }

    /// Changes rate, overhead and limit. What waits keeps its place even beyond a smaller limit; what is on the line keeps the bits already sent.
    pub(crate) fn reconfigure(&mut self, now: Instant, config: Bottleneck) -> Option<Departure> {
        let old_rate = self.config.rate;
        self.config = config;
        let service = self.in_service.as_mut()?;
        service.left = service.left.saturating_sub(old_rate.bits_sent(now.saturating_duration_since(service.since)));
        service.since = now;
        service.departure = now.saturating_add(config.rate.transmission_time(service.left));
        self.announced += 1;
        Some(Departure { at: service.departure, ticket: self.announced })
    }

    /// The last announcement made, and everything that waits or is on the line, in order: what a link gives up with its bottleneck.
    pub(crate) fn dismantle(self) -> (u64, impl Iterator<Item = T>) {
        (self.announced, self.in_service.into_iter().map(|service| service.item).chain(self.waiting.into_iter().map(|(_, item)| item)))
    }

    fn serve_next(&mut self, now: Instant) -> Option<Departure> {
        let (size, item) = self.waiting.pop_front()?;
        self.waiting_bytes -= u128::from(size.get());
        Some(self.serve(now, size, item))
    }

    fn serve(&mut self, now: Instant, size: Bytes, item: T) -> Departure {
        let left = self.config.giga_bits(size);
        let departure = now.saturating_add(self.config.rate.transmission_time(left));
        self.in_service = Some(InService { item, since: now, left, departure });
        self.announced += 1;
        Departure { at: departure, ticket: self.announced }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 64 bytes take 512 µs.
    fn megabit(limit: Option<QueueLimit>) -> BottleneckStage<char> {
        BottleneckStage::new(Bottleneck { rate: Rate::bits_per_sec(1_000_000).unwrap(), overhead: Bytes::ZERO, limit }, 0)
    }

    fn micros(t: u64) -> Instant {
        Instant::from_nanos(t * 1_000)
    }

    const SIZE: Bytes = Bytes::new(64);

    #[test]
    fn a_full_queue_refuses_the_newest_packet() {
        let mut stage = megabit(Some(QueueLimit::Packets(1)));
        assert!(matches!(stage.offer(micros(0), SIZE, 'a'), Ok(Some(_))));
        assert_eq!(stage.offer(micros(1), SIZE, 'b'), Ok(None));
        assert_eq!(stage.offer(micros(2), SIZE, 'c'), Err('c'));
    }

    #[test]
    fn a_limit_in_bytes_counts_what_waits() {
        let mut stage = megabit(Some(QueueLimit::Bytes(Bytes::new(100))));
        assert!(stage.offer(micros(0), SIZE, 'a').is_ok());
        assert_eq!(stage.offer(micros(0), SIZE, 'b'), Ok(None));
        assert_eq!(stage.offer(micros(0), SIZE, 'c'), Err('c'));
        assert_eq!(stage.offer(micros(0), Bytes::new(36), 'd'), Ok(None));
    }

    #[test]
    fn packets_leave_one_service_time_apart() {
        let mut stage = megabit(None);
        let first = stage.offer(micros(0), SIZE, 'a').unwrap().unwrap();
        assert_eq!(stage.offer(micros(100), SIZE, 'b'), Ok(None));
        assert_eq!(first.at, micros(512));
        let (item, next) = stage.depart(first).unwrap();
        assert_eq!((item, next.unwrap().at), ('a', micros(1024)));
    }

    #[test]
    fn a_change_of_rate_keeps_the_bits_already_sent() {
        let mut stage = megabit(None);
        let stale = stage.offer(micros(0), SIZE, 'a').unwrap().unwrap();
        // Half of the packet is sent at 1 Mbit/s; the other 256 bits take 128 µs at 2 Mbit/s.
        let doubled = Bottleneck { rate: Rate::bits_per_sec(2_000_000).unwrap(), overhead: Bytes::ZERO, limit: None };
        let departure = stage.reconfigure(micros(256), doubled).unwrap();
        assert_eq!(departure.at, micros(384));
        assert!(stage.depart(stale).is_none());
        assert_eq!(stage.depart(departure).unwrap().0, 'a');
    }
}
