//! Packets from one node to all its receivers.

use core::ops::Range;

use cohaptic_units::Instant;

use super::Network;
use super::config::NetworkError;
use super::groups::Group;
use super::id::{LinkId, NodeId, Path};
use super::paths::Paths;
use super::pending::{InNetwork, LineId, SizeAndMarks};
use super::sendings::Open;
use super::traffic::Traffic;
use crate::line::Line;
use crate::line::pipeline::Outcome;
use crate::packet::PacketInfo;

/// Number of links to which a packet of a broadcast is offered before the arrivals are scheduled.
const OFFERED_AT_ONCE: usize = 8;

/// Arrivals of the packets that are offered together, or [`Instant::ZERO`] for a link without a later arrival.
type Arrivals = [Instant; OFFERED_AT_ONCE];

/// Links from one node to all nodes, in the order of receivers.
type Row<P> = [Line<P, InNetwork<P>>];

/// Values that all packets of a broadcast share.
pub(super) struct Sent<'a, P> {
    pub(super) now: Instant,
    pub(super) from: NodeId,
    pub(super) size: SizeAndMarks,
    pub(super) payload: &'a P,
}

/// A packet of a broadcast that does more than arrive later: its receiver, its number, and what its link has decided.
struct Unusual {
    to: NodeId,
    sequence: u64,
    outcome: Outcome,
}

impl<P: Clone> Network<P> {
    /// Takes a packet from one node to each of its receivers, in the order of receivers. The result is the same as the result of [`Network::handle_packet`] for
    /// each receiver; work common to all receivers is done once.
    ///
    /// # Errors
    ///
    /// [`NetworkError`] if `now` is before an earlier call's instant or the node is missing; the network is unchanged then.
    pub fn handle_broadcast(&mut self, now: Instant, from: NodeId, info: impl Into<PacketInfo>, payload: P) -> Result<(), NetworkError> {
        let info = info.into();
        if from.0 >= self.nodes {
            return Err(NetworkError::NoLink { from, to: from });
        }
        // The uplink is passed once, so a single offer stands for all receivers.
        if self.has_relay && self.lines.uplinks[from.index()].is_some() {
            self.let_pass(now)?;
            self.send_to_relay(now, from, SizeAndMarks::new(info), payload);
            return Ok(());
        }
        if self.has_uplinks {
            // Packets of a node with an uplink pass the uplink one after another, so they have no work in common.
            let mut place = 0;
            while let Some(to) = self.places.receiver(from, place) {
                if to != from {
                    self.handle_packet(now, from, to, info, payload.clone())?;
                }
                place += 1;
            }
            return Ok(());
        }
        self.let_pass(now)?;
        let size = SizeAndMarks::new(info);
        if self.has_inner_events || self.has_filters || self.lines.on_demand.is_some() || matches!(self.places, Paths::Some(_)) {
            let mut place = 0;
            while let Some(to) = self.places.receiver(from, place) {
                if to != from {
                    self.send(now, Path { from, to }, size, payload.clone());
                }
                place += 1;
            }
            return Ok(());
        }
        self.send_directly(&Sent { now, from, size, payload: &payload });
        Ok(())
    }

    /// Offers a packet to the links from a node to all other nodes. The network has no inner events and no filters, so that the links alone decide, and its
    /// links lie in the order of receivers.
    fn send_directly(&mut self, sent: &Sent<'_, P>) {
        let first = self.link(Path { from: sent.from, to: NodeId(0) });
        let mut begin = 0;
        loop {
            let row = &mut self.lines.links[first.index()..first.index() + usize::from(self.nodes)];
            let schedule = if self.is_random { schedule_each } else { schedule_groups };
            let unusual = schedule(row, first, &mut self.traffic, sent, begin);
            let Some(Unusual { to, sequence, outcome }) = unusual else { return };
            let packet = sent.packet(to, sequence);
            self.decided(sent.now, link_to(first, to), outcome, || packet);
            begin = to.0 + 1;
        }
    }
}

impl<P: Clone> Sent<'_, P> {
    #[inline(always)]
    fn packet(&self, to: NodeId, sequence: u64) -> InNetwork<P> {
        let Self { now, from, size, payload } = *self;
        InNetwork { sequence, offered: now, entered: now, path: Path { from, to }, size, payload: payload.clone() }
    }
}

/// Returns the link to a node in the row of links that begins with the link `first`.
#[inline(always)]
fn link_to(first: LinkId, to: NodeId) -> LineId {
    LineId::Link(LinkId(first.0 + u32::from(to.0)))
}

/// Offers a packet to each link of `row` from the receiver `begin` on, and schedules the arrivals that come later than the packet. Returns the first packet
/// with any other fate; the rest of the row is then left. `first` is the number of the first link of the row. No link draws random numbers, so that most
/// packets arrive together, and are scheduled together.
#[inline(never)]
fn schedule_groups<P: Clone>(row: &mut Row<P>, first: LinkId, traffic: &mut Traffic<P>, sent: &Sent<'_, P>, begin: u16) -> Option<Unusual> {
    let Sent { now, from, .. } = *sent;
    // Arrival, number and receivers of the present group. The group is made when it is complete, so that the loop over links changes few values.
    let (mut arrives, mut receivers) = ((Instant::ZERO, 0), begin..begin);
    let mut unusual = None;
    for (line, to) in row[usize::from(begin)..].iter_mut().zip(begin..).filter(|(_, to)| *to != from.0) {
        // The number is taken before the offer, because the offer counts the packet.
        let sequence = line.offered();
        match line.offer_without_draws(now) {
            Outcome::Arrives(at) if at > now => {
                // The first packet begins a group, because it arrives after the beginning of time.
                if (at, sequence) != arrives {
                    if !receivers.is_empty() {
                        schedule_group(traffic, sent, first, arrives, &receivers);
                    }
                    (arrives, receivers.start) = ((at, sequence), to);
                }
                receivers.end = to + 1;
            }
            outcome @ (Outcome::Arrives(_) | Outcome::Dropped(_) | Outcome::Enters) => {
                unusual = Some(Unusual { to: NodeId(to), sequence, outcome });
                break;
            }
        }
    }
    if !receivers.is_empty() {
        schedule_group(traffic, sent, first, arrives, &receivers);
    }
    unusual
}

/// Schedules the packets to `receivers`, which arrive at one instant and have one number.
#[inline(never)]
fn schedule_group<P: Clone>(traffic: &mut Traffic<P>, sent: &Sent<'_, P>, first: LinkId, (at, sequence): (Instant, u64), receivers: &Range<u16>) {
    let Sent { now, from, size, payload } = *sent;
    let (next, end) = (NodeId(receivers.start), receivers.end);
    traffic.schedule_group(Group { at, offered: now, sequence, from, next, end, first, size, payload: payload.clone() });
}

/// Like [`schedule_groups`], for links of which some draw random numbers, so that each packet arrives at an instant of its own. The first packet with another
/// number than the packets before also counts as a packet with another fate: numbers differ only if single packets are sent between broadcasts.
#[inline(never)]
fn schedule_each<P: Clone>(row: &mut Row<P>, first: LinkId, traffic: &mut Traffic<P>, sent: &Sent<'_, P>, begin: u16) -> Option<Unusual> {
    let (begin, own) = (usize::from(begin), usize::from(sent.from.0));
    let receiver = if begin == own { begin + 1 } else { begin };
    let mut open = traffic.open(sent, first, row.get(receiver)?.offered());
    let mut unusual = None;
    // Receivers before the sender, and receivers after the sender.
    'parts: for part in [begin.min(own)..own, begin.max(own + 1)..row.len()] {
        for (lines, begin) in row[part.clone()].chunks_mut(OFFERED_AT_ONCE).zip(part.step_by(OFFERED_AT_ONCE)) {
            let mut arrivals = [Instant::ZERO; OFFERED_AT_ONCE];
            let ended = offer_to_some(lines, sent.now, open.sequence, &mut arrivals);
            schedule_arrivals(&arrivals[..lines.len()], sent.now, NodeId::new(begin), traffic, &mut open);
            if let Some((index, sequence, outcome)) = ended {
                unusual = Some(Unusual { to: NodeId::new(begin + index), sequence, outcome });
                break 'parts;
            }
        }
    }
    traffic.close(&open);
    unusual
}

/// Schedules the arrivals later than `now` at successive receivers, of which `begin` is the first. Not inlined, so that the loops over offers and over
/// arrivals have all registers each (`benches/peers`, rows of watched packets).
#[inline(never)]
fn schedule_arrivals<P: Clone>(arrivals: &[Instant], now: Instant, begin: NodeId, traffic: &mut Traffic<P>, open: &mut Open) {
    for (at, to) in arrivals.iter().zip(begin.0..) {
        if *at > now {
            traffic.schedule_shared(*at, NodeId(to), open);
        }
    }
}

/// Offers a packet to each of at most [`OFFERED_AT_ONCE`] links, up to the first packet that does not arrive later than `now`, or has another number than
/// `expected`. Sets the later arrivals, indexed like the links, and returns index, number and outcome of the packet that ended the offers.
///
/// Draws and offers are two loops, because one loop for both needs more registers than there are (`benches/peers`, rows of watched packets).
#[inline(always)]
fn offer_to_some<P: Clone>(lines: &mut Row<P>, now: Instant, expected: u64, arrivals: &mut Arrivals) -> Option<(usize, u64, Outcome)> {
    // The draws do not depend on each other, so a processor can compute several at once.
    let mut words = [[0; 2]; OFFERED_AT_ONCE];
    for (words, line) in words.iter_mut().zip(&*lines) {
        *words = line.words();
    }
    for (index, ((line, words), arrival)) in lines.iter_mut().zip(&words).zip(arrivals).enumerate() {
        let sequence = line.offered();
        match line.offer(now, Some(*words)) {
            Outcome::Arrives(at) if at > now && sequence == expected => *arrival = at,
            outcome @ (Outcome::Arrives(_) | Outcome::Dropped(_) | Outcome::Enters) => return Some((index, sequence, outcome)),
        }
    }
    None
}
