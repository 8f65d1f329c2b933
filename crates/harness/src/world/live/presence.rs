//! Presence of remote peers, its effect on local peers, and datagrams for other processes.

use std::collections::VecDeque;

use cohaptic_peer::wire::{Extra, MAX_LEN, Sample};
use cohaptic_peer::{Age, Ages, Device, Peer, ReceiveError, Reception, Strategy};
use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use super::seat::Seat;

/// Datagram with its bytes in place, without allocation.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Datagram {
    bytes: [u8; MAX_LEN],
    len: usize,
}

impl Datagram {
    pub(crate) const fn new(bytes: [u8; MAX_LEN], len: usize) -> Self {
        Self { bytes, len }
    }
}

impl std::ops::Deref for Datagram {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        &self.bytes[..self.len]
    }
}

impl std::fmt::Debug for Datagram {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:x?}", &**self)
    }
}

/// Datagram delivered by the network to a peer in another process.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Transmit {
    /// Index of the receiver.
    pub to: usize,
    /// Instant of the arrival.
    pub at: Instant,
    /// Bytes, with the damage of the network.
    pub datagram: Datagram,
}

/// Remote peers of a scene.
#[derive(Debug)]
pub(crate) struct RemotePeers<const A: usize> {
    /// Seats, indexed by peer; `None` for a never silent peer.
    seats: Vec<Option<Seat>>,
    /// Indices of peers with a seat.
    places: Vec<usize>,
    /// Ages of the remote peers, as applied to each local peer. Indexed by local peer.
    ages: Vec<Ages<A>>,
    /// Age applied last, indexed by sender · number of peers + receiver; `None` before the first.
    told: Vec<Option<Age>>,
    /// Datagrams for other processes, in the order of arrival.
    outbox: VecDeque<Transmit>,
    /// Time on the clock of the session, which may be ahead of the logical time.
    pub(crate) clock: Instant,
    /// `true` if any peer is in another process.
    pub(crate) has_processes: bool,
    /// Index of the first local peer.
    pub(crate) lead: usize,
    /// Instant of an input with undelivered packets. The world must look at this instant again.
    pub(crate) undrained: Option<Instant>,
}

impl<const A: usize> RemotePeers<A> {
    pub(crate) fn new(scene: &Scene) -> Self {
        let peers = scene.peers.len();
        let seat = |(place, peer): (usize, &cohaptic_scene::PeerSpec)| Seat::of(&peer.kind, place, peers, scene.peer_config(place).coupling);
        let seats: Vec<Option<Seat>> = scene.peers.iter().enumerate().map(seat).collect();
        let places = seats.iter().enumerate().filter_map(|(place, seat)| seat.as_ref().map(|_| place)).collect();
        let has_processes = seats.iter().flatten().any(|seat| seat.is_process);
        // Without any local peer nothing ticks here, and the index is never used.
        let lead = seats.iter().position(|seat| seat.as_ref().is_none_or(|seat| !seat.is_process)).unwrap_or(0);
        let (ages, told) = (vec![Ages::default(); peers], vec![None; peers * peers]);
        Self { seats, places, ages, told, outbox: VecDeque::new(), clock: Instant::ZERO, has_processes, lead, undrained: None }
    }

    pub(crate) fn seat(&self, place: usize) -> Option<&Seat> {
        self.seats.get(place)?.as_ref()
    }

    pub(crate) fn seat_mut(&mut self, place: usize) -> Option<&mut Seat> {
        self.seats.get_mut(place)?.as_mut()
    }

    /// Returns whether a peer is in another process.
    pub(crate) fn is_process(&self, place: usize) -> bool {
        self.seat(place).is_some_and(|seat| seat.is_process)
    }

    /// Notes peers fallen silent by `now`, and calls `silent` with the index of each.
    pub(crate) fn notice_silence(&mut self, now: Instant, mut silent: impl FnMut(usize)) {
        // Peers with a seat are few among many simulated peers, hence the list of places.
        for place in &self.places {
            if self.seats[*place].as_mut().is_some_and(|seat| seat.notice_silence(now)) {
                silent(*place);
            }
        }
    }

    /// Makes the first sample of `from` with the number `sequence` or later a return of `from` for the peer `to`.
    pub(crate) fn await_return<D: Device<A>, S: Strategy<A>>(&mut self, from: usize, to: usize, sequence: u64, peer: &mut Peer<A, D, S>) {
        self.ages[to].await_return(peer, other(from, to), sequence);
    }

    /// Hands a sample to its receiver. `ends` are the indices of sender and receiver.
    pub(crate) fn take_in<D: Device<A>, S: Strategy<A>>(
        &mut self,
        now: Instant,
        ends: (usize, usize),
        sample: &Sample<A>,
        extra: &Extra<A>,
        peer: &mut Peer<A, D, S>,
    ) -> Result<Reception, ReceiveError> {
        let (from, to) = ends;
        let received = self.ages[to].handle_extended(peer, sample, extra)?;
        // A stale sample neither moves what the receiver holds nor ends a silence, and a late displacement ends none.
        if received == Reception::Newest {
            self.arrived(now, from, to);
        }
        Ok(received)
    }

    /// Handles a sample newer than all samples before. If the sample is a return of its sender, the fade begins.
    fn arrived(&mut self, now: Instant, from: usize, to: usize) {
        let Some(seat) = self.seats.get_mut(from).and_then(Option::as_mut).filter(|seat| seat.is_process) else { return };
        // The sender may return to each receiver at a different instant, when its first new sample arrives there.
        if !self.ages[to].take_return(other(from, to)) {
            return;
        }
        // The held sample jumps from the place before the silence to the new place, so the share begins anew.
        seat.fades[to].moved(now);
        // The sender can be silent again before its sample arrives. The jump then is faded, but the weight keeps falling.
        if !seat.is_silent() {
            seat.fades[to].rise(now);
        }
    }

    /// Applies the ages of all remote peers to the peer `to` before its tick.
    pub(crate) fn tell<D: Device<A>, S: Strategy<A>>(&mut self, to: usize, now: Instant, peer: &mut Peer<A, D, S>) {
        let peers = self.seats.len();
        for from in self.places.iter().copied().filter(|from| *from != to) {
            let Some(seat) = &self.seats[from] else { continue };
            let (age, told) = (seat.fades[to].age(now), &mut self.told[from * peers + to]);
            // Most ages are constant between ticks, and only changes are applied.
            if *told != Some(age) {
                *told = Some(age);
                self.ages[to].set(peer, other(from, to), age);
            }
        }
        self.ages[to].apply(peer);
    }

    pub(crate) fn send_out(&mut self, to: usize, at: Instant, datagram: Datagram) {
        self.outbox.push_back(Transmit { to, at, datagram });
    }

    pub(crate) fn next_transmit(&mut self) -> Option<Transmit> {
        self.outbox.pop_front()
    }
}

/// Returns the index of `from` among the senders of `to`. The senders do not include `to`.
const fn other(from: usize, to: usize) -> usize {
    if from < to { from } else { from - 1 }
}
