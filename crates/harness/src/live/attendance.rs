//! Who of those that live elsewhere is there, what the others feel of them, and what is to be sent to them.

use std::collections::VecDeque;

use cohaptic_peer::wire::MAX_LEN;
use cohaptic_peer::{Age, Device, Peer, Strategy};
use cohaptic_scene::{PeerKind, Scene};
use cohaptic_units::Instant;

use super::seat::Seat;

/// A datagram, in place.
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

/// A datagram that the network has delivered to a peer in another process.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Transmit {
    /// The receiver.
    pub to: usize,
    /// When it arrived.
    pub at: Instant,
    /// Its bytes, with whatever damage the network did.
    pub datagram: Datagram,
}

/// Everybody who lives elsewhere.
#[derive(Debug)]
pub(crate) struct Attendance {
    seats: Vec<Option<Seat>>,
    /// What each (sender, receiver) was last told.
    told: Vec<Option<Age>>,
    outbox: VecDeque<Transmit>,
    /// Whether any peer lives in another process.
    pub(crate) has_processes: bool,
}

impl Attendance {
    pub(crate) fn new(scene: &Scene) -> Self {
        let peers = scene.peers.len();
        let seat = |(place, peer): (usize, &cohaptic_scene::PeerSpec)| {
            let is_process = matches!(peer.kind, PeerKind::Udp(_));
            peer.kind.silence().map(|silence| Seat::new(is_process, silence, peers, scene.peer_config(place).coupling))
        };
        let seats: Vec<Option<Seat>> = scene.peers.iter().enumerate().map(seat).collect();
        let has_processes = seats.iter().flatten().any(|seat| seat.is_process);
        Self { seats, told: vec![None; peers * peers], outbox: VecDeque::new(), has_processes }
    }

    pub(crate) fn seat(&self, place: usize) -> Option<&Seat> {
        self.seats.get(place)?.as_ref()
    }

    pub(crate) fn seat_mut(&mut self, place: usize) -> Option<&mut Seat> {
        self.seats.get_mut(place)?.as_mut()
    }

    /// Whether a peer lives in another process.
    pub(crate) fn is_process(&self, place: usize) -> bool {
        self.seat(place).is_some_and(|seat| seat.is_process)
    }

    /// Notices who has fallen silent, and calls `silent` for each.
    pub(crate) fn notice_silence(&mut self, now: Instant, mut silent: impl FnMut(usize)) {
        for (place, seat) in self.seats.iter_mut().enumerate() {
            if seat.as_mut().is_some_and(|seat| seat.notice_silence(now)) {
                silent(place);
            }
        }
    }

    /// A sample has arrived that is newer than all before it.
    pub(crate) fn arrived<const A: usize, D: Device<A>, S: Strategy<A>>(&mut self, from: usize, to: usize, now: Instant, peer: &mut Peer<A, D, S>) {
        let Some(seat) = self.seat_mut(from).filter(|seat| seat.is_process) else { return };
        if !peer.take_return(other(from, to)) {
            return;
        }
        seat.fades[to].moved(now);
        if !seat.is_silent() {
            seat.fades[to].rise(now);
        }
    }

    /// Tells a peer that is about to tick what it feels of those who live elsewhere.
    pub(crate) fn tell<const A: usize, D: Device<A>, S: Strategy<A>>(&mut self, to: usize, now: Instant, peer: &mut Peer<A, D, S>) {
        let peers = self.seats.len();
        for (from, seat) in self.seats.iter().enumerate().filter(|(from, _)| *from != to) {
            let Some(seat) = seat else { continue };
            let (age, told) = (seat.fades[to].age(now), &mut self.told[from * peers + to]);
            if *told != Some(age) {
                *told = Some(age);
                peer.set_age(other(from, to), age);
            }
        }
    }

    pub(crate) fn send_out(&mut self, to: usize, at: Instant, datagram: Datagram) {
        self.outbox.push_back(Transmit { to, at, datagram });
    }

    pub(crate) fn next_transmit(&mut self) -> Option<Transmit> {
        self.outbox.pop_front()
    }
}

/// The place of a sender among the others of a receiver.
pub(crate) const fn other(from: usize, to: usize) -> usize {
    if from < to { from } else { from - 1 }
}
