//! Stage of a link: the waiting packets of the link and of its cross-traffic, and the packet in transmission.

use alloc::collections::VecDeque;
use core::time::Duration;

use cohaptic_units::{Bytes, Ecn, Instant};

use super::super::CrossStage;
use super::super::fifo::{Fifo, Rules};
use super::{Bottleneck, Discipline, Red, Service, giga_bits};
use crate::fates::fate::DropCause;
use crate::packet::{Carried, Exit, Output, Outputs, PacketInfo};

/// Stage with the waiting packets and the packet in transmission.
#[derive(Clone, Debug)]
pub(crate) struct BottleneckStage<T> {
    config: Bottleneck,
    queue: Queue<T>,
    /// Size of the latest packet at an idle transmitter, with its transmission time. Cached, because the time is a division of 128 bits.
    latest_service: Option<(Bytes, Duration)>,
    /// Departure of the link's first packet inside, or `None` without such a packet. Kept beside cross-traffic only, so that the owner need not wake the stage
    /// for each cross packet before that packet.
    first_own: Option<Instant>,
}

/// Packets of a stage.
pub(crate) type Queue<T> = Fifo<Queued<T>, Sums>;

/// Packet in the queue or in transmission, with the instant of its offer.
#[derive(Clone, Debug)]
pub(crate) enum Queued<T> {
    /// Packet of the link.
    Own(Instant, Carried<T>),
    /// Packet of the cross-traffic, with its size.
    Cross(Instant, Bytes),
}

impl<T> Queued<T> {
    fn info(&self) -> PacketInfo {
        match self {
            Self::Own(_, packet) => packet.info,
            // Cross-traffic does not react, so its packets must not be marked.
            Self::Cross(_, size) => PacketInfo { size: *size, ecn: Ecn::NotCapable },
        }
    }

    const fn is_own(&self) -> bool {
        matches!(self, Self::Own(..))
    }

    fn into_own(self) -> Option<Carried<T>> {
        match self {
            Self::Own(_, packet) => Some(packet),
            Self::Cross(..) => None,
        }
    }
}

/// Sums over the waiting packets of a stage.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sums {
    /// Bytes, framing not counted. Wider than [`Bytes`]: a sum of [`Bytes`] would saturate and then be wrong after a departure.
    bytes: u128,
    /// Bits to transmit, in 10⁻⁹ bit.
    bits: u128,
    /// Packets of the link.
    own: usize,
}

impl<T> Rules<Queued<T>> for Bottleneck {
    type Sums = Sums;

    fn bottleneck(&self) -> &Bottleneck {
        self
    }

    fn offered(&self, packet: &Queued<T>) -> Instant {
        let (Queued::Own(offered, _) | Queued::Cross(offered, _)) = packet;
        *offered
    }

    fn size(&self, packet: &Queued<T>) -> Bytes {
        packet.info().size
    }

    fn bits(&self, packet: &Queued<T>) -> u128 {
        giga_bits(self.framing.on_the_line(packet.info().size))
    }

    fn flow(&self, packet: &Queued<T>) -> Option<u32> {
        match packet {
            Queued::Own(_, packet) => Some(packet.flow),
            Queued::Cross(..) => None,
        }
    }

    fn ecn(&self, packet: &Queued<T>) -> Ecn {
        if matches!(packet, Queued::Own(_, packet) if packet.marks.congestion) { Ecn::Congestion } else { packet.info().ecn }
    }

    fn mark(&self, packet: &mut Queued<T>) {
        if let Queued::Own(_, packet) = packet {
            packet.marks.congestion = true;
        }
    }

    fn add(&self, sums: &mut Sums, packet: &Queued<T>) {
        sums.bytes += u128::from(self.size(packet).get());
        sums.bits += self.bits(packet);
        sums.own += usize::from(packet.is_own());
    }

    fn remove(&self, sums: &mut Sums, packet: &Queued<T>) {
        sums.bytes -= u128::from(self.size(packet).get());
        sums.bits -= self.bits(packet);
        sums.own -= usize::from(packet.is_own());
    }

    fn waiting(&self, sums: &Sums, _count: usize) -> (u128, u128) {
        (sums.bytes, sums.bits)
    }

    fn mean_packet(&self, red: &Red) -> f64 {
        self.time_of_mean_packet(red)
    }

    fn next(&self, now: Instant, left: u128) -> (Instant, u64) {
        match &self.service {
            Service::Rate(rate) => (now.saturating_add(rate.transmission_time(left)), 0),
            // At the end of time a packet never leaves, and one opportunity is as good as many.
            Service::Recorded(trace) => trace.next_after(now).unwrap_or((Instant::MAX, 1)),
        }
    }
}

impl<T> BottleneckStage<T> {
    /// Returns an idle bottleneck.
    pub(crate) fn new(config: Bottleneck) -> Self {
        let queue = Fifo::new(&config.discipline);
        Self::resumed(config, queue)
    }

    /// Returns a bottleneck with packets.
    pub(crate) const fn resumed(config: Bottleneck, queue: Queue<T>) -> Self {
        Self { config, queue, latest_service: None, first_own: None }
    }

    /// Returns the departure of a packet of `size` offered `now` to an idle transmitter. Returns `None` if the transmitter is busy or has a recording, or if
    /// the discipline takes note of a packet at an idle transmitter.
    #[inline]
    pub(crate) fn departure_if_idle(&mut self, now: Instant, size: Bytes) -> Option<Instant> {
        let Service::Rate(rate) = &self.config.service else { return None };
        // A waiting packet implies a packet in transmission, so the queue is empty here.
        if self.queue.on_line().is_some() || takes_note_of_all(&self.config.discipline) {
            return None;
        }
        let service = match self.latest_service {
            Some((same, service)) if same == size => service,
            _ => {
                let service = rate.transmission_time(giga_bits(self.config.framing.on_the_line(size)));
                self.latest_service = Some((size, service));
                service
            }
        };
        Some(now.saturating_add(service))
    }

    /// Takes a packet. The packet is then sent, waits, or is dropped into `outputs`; older packets may be dropped in its place. `word` gives the packet's
    /// random word for queues. `cross` must have [caught up](Self::catch_up) with `now`.
    pub(crate) fn offer(
        &mut self,
        now: Instant,
        packet: Carried<T>,
        word: impl Fn() -> u64,
        mut cross: Option<&mut CrossStage>,
        outputs: &mut Outputs<T>,
    ) {
        self.queue.offer(now, &self.config, Queued::Own(now, packet), word, |cause, packet| drop(&mut cross, outputs, now, cause, packet));
        if let Some(cross) = cross {
            cross.meet();
            // Behind an earlier packet of the link, this packet is not the first.
            if self.first_own.is_none() {
                self.foresee();
            }
        }
    }

    /// Returns the instant of the next call of [`BottleneckStage::release`], or `None` if the transmitter is idle. Beside cross-traffic, returns `None` too if no
    /// packet of the link is inside: nobody outside can see what happens then, and [`catch_up`](Self::catch_up) computes it when a packet comes.
    pub(crate) fn next_at(&self, cross: Option<&CrossStage>) -> Option<Instant> {
        let on_line = self.queue.on_line()?;
        let Some(cross) = cross else { return Some(on_line.next) };
        if !self.has_own() {
            return None;
        }
        match (&self.config.service, &self.config.discipline) {
            // An admitted packet is never dropped, so its departure is known from its offer.
            (Service::Rate(_), Discipline::TailDrop | Discipline::Red(_) | Discipline::Pie(_)) => self.first_own,
            // Packets are dropped, or sent, where a packet leaves the transmitter or where opportunities come.
            (_, Discipline::TailDrop | Discipline::Red(_) | Discipline::Pie(_) | Discipline::CoDel(_) | Discipline::DualPi2(_)) => Some(on_line.next),
            // A cross packet may push out a packet of the link.
            (_, Discipline::HeadDrop | Discipline::FqCoDel(_)) => Some(cross.next_at().map_or(on_line.next, |arrival| arrival.min(on_line.next))),
        }
    }

    /// Appends the packets leaving the bottleneck `now` to `released`, and dropped packets to `outputs`. `now` is the instant returned by
    /// [`next_at`](Self::next_at).
    pub(crate) fn release(&mut self, now: Instant, cross: Option<&mut CrossStage>, released: &mut VecDeque<Carried<T>>, outputs: &mut Outputs<T>) {
        match cross {
            None => self.leave(now, &mut None, released, outputs),
            Some(cross) => {
                self.let_happen(now, cross, Some(released), outputs);
                self.foresee();
            }
        }
    }

    /// Lets the cross-traffic up to `now` happen, before a packet is offered or the configuration changes.
    pub(crate) fn catch_up(&mut self, now: Instant, cross: &mut CrossStage, outputs: &mut Outputs<T>) {
        self.let_happen(now, cross, None, outputs);
    }

    /// Lets departures and arrivals up to `until` happen in the order of their instants. Without `released`, stops before a departure of a packet of the link:
    /// such a packet leaves at `until` itself, when the owner asks for it.
    fn let_happen(&mut self, until: Instant, cross: &mut CrossStage, mut released: Option<&mut VecDeque<Carried<T>>>, outputs: &mut Outputs<T>) {
        loop {
            let departure = self.queue.on_line().map(|on_line| on_line.next).filter(|at| *at <= until);
            // At equal instants a departure comes first, and makes room for the packet.
            if let Some(at) = departure.filter(|at| cross.next_at().is_none_or(|arrival| *at <= arrival)) {
                let mut nothing = VecDeque::new();
                let released = match &mut released {
                    Some(released) => released,
                    None if self.may_release_own() => return,
                    None => &mut nothing,
                };
                self.leave(at, &mut Some(&mut *cross), released, outputs);
            } else if let Some((at, size, word)) = cross.take(until) {
                let cross = &mut Some(&mut *cross);
                self.queue.offer(at, &self.config, Queued::Cross(at, size), word, |cause, packet| drop(cross, outputs, at, cause, packet));
            } else {
                return;
            }
        }
    }

    /// Lets the packets leave that leave `now`, and appends the link's own packets to `released`.
    #[inline]
    fn leave(&mut self, now: Instant, cross: &mut Option<&mut CrossStage>, released: &mut VecDeque<Carried<T>>, outputs: &mut Outputs<T>) {
        let Self { config, queue, .. } = self;
        let trace = match &config.service {
            Service::Rate(_) => {
                let left = queue.leave(now, config, |at, cause, packet| drop(cross, outputs, at, cause, packet));
                return released.extend(left.and_then(|(_, packet)| packet.into_own()));
            }
            Service::Recorded(trace) => trace,
        };
        // The opportunities of this instant are shared by as many packets as fit. A rest of the budget behind an empty queue is lost.
        let opportunities = queue.on_line().map_or(0, |on_line| on_line.opportunities);
        let mut budget = giga_bits(trace.bytes()).saturating_mul(opportunities.into());
        while let Some(on_line) = queue.on_line_mut() {
            // The packet is larger than the rest of the budget: the next opportunities send its remaining bits.
            if on_line.left > budget {
                on_line.left -= budget;
                break;
            }
            budget -= on_line.left;
            released.extend(queue.on_line_mut().take().and_then(|on_line| on_line.packet.into_own()));
            queue.serve_next(now, config, |cause, packet| drop(cross, outputs, now, cause, packet));
            if budget == 0 {
                break;
            }
        }
        queue.announce(now, config);
    }

    /// Changes rate, framing, limit and discipline; see [`Fifo::reconfigure`]. Cross-traffic must have [caught up](Self::catch_up) with `now`.
    pub(crate) fn reconfigure(&mut self, now: Instant, config: Bottleneck) {
        // The transmission time in the cache belongs to the old rate and framing.
        self.queue.reconfigure(now, &self.config, &config);
        (self.config, self.latest_service) = (config, None);
        self.foresee();
    }

    /// Returns whether a packet of the link waits or is in transmission.
    pub(crate) fn has_own(&self) -> bool {
        self.queue.sums().own > 0 || self.queue.on_line().is_some_and(|on_line| on_line.packet.is_own())
    }

    /// Returns whether the next departure may release a packet of the link.
    fn may_release_own(&self) -> bool {
        match &self.config.service {
            Service::Rate(_) => self.queue.on_line().is_some_and(|on_line| on_line.packet.is_own()),
            // Packets that wait can leave at one opportunity with the packet in transmission.
            Service::Recorded(_) => self.has_own(),
        }
    }

    /// Computes the departure of the link's first packet inside: the sum of the transmission times, each rounded as at the departures. Over a run, each cross
    /// packet is passed over once at most, for the packet of the link behind it.
    fn foresee(&mut self) {
        self.first_own = None;
        let Self { config: Bottleneck { service, discipline, .. }, queue, .. } = &*self;
        let (Service::Rate(rate), Discipline::TailDrop | Discipline::Red(_) | Discipline::Pie(_), Some(on_line)) =
            (service, discipline, queue.on_line())
        else {
            return;
        };
        if !self.has_own() {
            return;
        }
        let mut leaves = on_line.next;
        let mut packet = &on_line.packet;
        let mut behind = self.queue.waiting();
        while !packet.is_own() {
            let Some(next) = behind.next() else { return };
            leaves = leaves.saturating_add(rate.transmission_time(self.config.bits(next)));
            packet = next;
        }
        self.first_own = Some(leaves);
    }

    /// Returns the link's packet in transmission and all its waiting packets, in order, when a link loses its bottleneck. Cross packets end here.
    pub(crate) fn dismantle(self) -> impl Iterator<Item = Carried<T>> {
        self.queue.dismantle().filter_map(Queued::into_own)
    }
}

/// Returns whether the discipline takes note of a packet at an idle transmitter: RED's average, PIE's delay, the turns of FQ-CoDel and the marks of DualPI2.
const fn takes_note_of_all(discipline: &Discipline) -> bool {
    matches!(discipline, Discipline::Red(_) | Discipline::Pie(_) | Discipline::FqCoDel(_) | Discipline::DualPi2(_))
}

/// Appends a dropped packet of the link to `outputs`, and counts a dropped cross packet.
fn drop<T>(cross: &mut Option<&mut CrossStage>, outputs: &mut Outputs<T>, now: Instant, cause: DropCause, packet: Queued<T>) {
    match (packet, cross) {
        (Queued::Own(_, packet), _) => outputs.push(Output { packet, exit: Exit::Dropped(now, cause) }),
        (Queued::Cross(..), Some(cross)) => cross.count_drop(),
        // A queue with cross packets has the stage that sent them, even after a change that ends the cross-traffic.
        (Queued::Cross(..), None) => {}
    }
}

#[cfg(test)]
mod tests {
    use cohaptic_units::Rate;

    use super::super::{DeliveryTrace, QueueLimit};
    use super::*;
    use crate::packet::{Marks, Packet};

    /// Returns a bottleneck of 1 Mbit/s, at which 64 bytes take 512 µs.
    fn megabit(limit: Option<QueueLimit>, discipline: Discipline) -> BottleneckStage<char> {
        BottleneckStage::new(Bottleneck { limit, discipline, ..Bottleneck::at_rate(Rate::bits_per_sec(1_000_000).unwrap()) })
    }

    fn micros(t: u64) -> Instant {
        Instant::from_nanos(t * 1_000)
    }

    /// Offers a packet, and returns the dropped packets.
    fn offer(stage: &mut BottleneckStage<char>, now: u64, size: u64, item: char) -> Vec<char> {
        let info = Bytes::new(size).into();
        let packet = Packet::new(0, info, Marks::default(), item);
        let mut outputs = Vec::new();
        stage.offer(micros(now), packet, || 0, None, &mut outputs);
        outputs.into_iter().map(|output| output.packet.item).collect()
    }

    /// Returns the packets that leave up to `until`, each with the microsecond of its departure.
    fn leaves(stage: &mut BottleneckStage<char>, until: u64) -> Vec<(char, u64)> {
        let mut left = Vec::new();
        while let Some(at) = stage.next_at(None).filter(|at| *at <= micros(until)) {
            let mut released = VecDeque::new();
            stage.release(at, None, &mut released, &mut Vec::new());
            left.extend(released.into_iter().map(|packet| (packet.item, at.as_nanos() / 1_000)));
        }
        left
    }

    #[test]
    fn a_full_queue_refuses_the_newest_packet() {
        let mut stage = megabit(Some(QueueLimit::Packets(1)), Discipline::TailDrop);
        let dropped: Vec<char> = [(0, 'a'), (1, 'b'), (2, 'c')].into_iter().flat_map(|(t, item)| offer(&mut stage, t, 64, item)).collect();
        assert_eq!(dropped, ['c']);
        assert_eq!(leaves(&mut stage, 9_999), [('a', 512), ('b', 1024)]);
    }

    #[test]
    fn a_full_queue_that_drops_from_the_head_takes_the_newest() {
        let mut stage = megabit(Some(QueueLimit::Bytes(Bytes::new(100))), Discipline::HeadDrop);
        assert!(offer(&mut stage, 0, 64, 'a').is_empty());
        assert!(offer(&mut stage, 0, 30, 'b').is_empty());
        assert!(offer(&mut stage, 0, 40, 'c').is_empty());
        assert_eq!(offer(&mut stage, 0, 80, 'd'), ['b', 'c']);
        assert_eq!(offer(&mut stage, 0, 101, 'e'), ['d', 'e']);
    }

    #[test]
    fn a_limit_in_bytes_counts_what_waits() {
        let mut stage = megabit(Some(QueueLimit::Bytes(Bytes::new(100))), Discipline::TailDrop);
        let offered = [(64, 'a'), (64, 'b'), (64, 'c'), (36, 'd')];
        let dropped: Vec<char> = offered.into_iter().flat_map(|(size, item)| offer(&mut stage, 0, size, item)).collect();
        assert_eq!(dropped, ['c']);
    }

    /// Each packet ahead takes 512 µs. With a limit of 1 ms the third packet waits 1024 − 100 µs, and the fourth packet would wait 1436 µs.
    #[test]
    fn a_limit_in_time_counts_what_is_ahead() {
        let mut stage = megabit(Some(QueueLimit::Time(Duration::from_millis(1))), Discipline::TailDrop);
        let dropped: Vec<char> =
            [(0, 'a'), (0, 'b'), (100, 'c'), (100, 'd')].into_iter().flat_map(|(t, item)| offer(&mut stage, t, 64, item)).collect();
        assert_eq!(dropped, ['d']);
    }

    #[test]
    fn a_change_of_rate_keeps_the_bits_already_sent() {
        let mut stage = megabit(None, Discipline::TailDrop);
        offer(&mut stage, 0, 64, 'a');
        // Half of the packet is sent at 1 Mbit/s. The other 256 bits take 128 µs at 2 Mbit/s.
        stage.reconfigure(micros(256), Bottleneck::at_rate(Rate::bits_per_sec(2_000_000).unwrap()));
        assert_eq!(leaves(&mut stage, 9_999), [('a', 384)]);
    }

    /// Opportunities for 100 bytes come at 1, 2 and 2 ms, and then again. A packet of 150 bytes needs two opportunities, and two packets of 40 bytes share
    /// the rest.
    #[test]
    fn a_recorded_line_shares_its_opportunities() {
        let trace = DeliveryTrace::parse("1\n2\n2\n", Bytes::new(100)).unwrap();
        let mut stage = BottleneckStage::new(Bottleneck { service: Service::Recorded(trace), ..Bottleneck::at_rate(Rate::bits_per_sec(1).unwrap()) });
        for (size, item) in [(150, 'a'), (40, 'b'), (40, 'c'), (90, 'd')] {
            offer(&mut stage, 0, size, item);
        }
        assert_eq!(leaves(&mut stage, 9_999), [('a', 2000), ('b', 2000), ('c', 2000), ('d', 3000)]);
        // Unused bytes are lost: at 5 ms no more than 100 bytes may leave.
        offer(&mut stage, 4_500, 100, 'e');
        offer(&mut stage, 4_500, 100, 'f');
        assert_eq!(leaves(&mut stage, 9_999), [('e', 5000), ('f', 6000)]);
    }
}
