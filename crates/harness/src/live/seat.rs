//! The place of a peer that is remote, taken or not.

use std::ops::Range;
use std::time::Duration;

use cohaptic_peer::wire::DecodeError;
use cohaptic_peer::{Gains, ReceiveError};
use cohaptic_scene::{PeerKind, Silence};
use cohaptic_units::Instant;

use super::fade::Fade;

/// Whether a peer is there.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Presence {
    /// It is simulated here.
    Here,
    /// Nothing has ever been heard of it.
    Absent,
    /// It is heard.
    Present,
    /// Nothing has been heard of it for so long that its pull fades or has faded, which began at this instant.
    Stale(Instant),
}

/// Why a sample from outside was refused. Nothing changed but a counter.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum SampleError {
    /// The peer does not live in another process.
    #[error("peer {peer} is no peer of kind \"udp\" of this scene")]
    NoSeat {
        /// The peer.
        peer: usize,
    },
    /// It is no sample of this session and that peer.
    #[error(transparent)]
    Sample(#[from] ReceiveError),
    /// A later sample of the peer came before it, or the same one.
    #[error("sample {found} after sample {newest}: expected a higher number, or any number once the peer has been silent")]
    OutOfOrder {
        /// Its number.
        found: u64,
        /// The highest number that came before it.
        newest: u64,
    },
    /// The session has ended.
    #[error("the session has ended")]
    Ended,
}

impl From<DecodeError> for SampleError {
    fn from(error: DecodeError) -> Self {
        Self::Sample(error.into())
    }
}

/// What came in at a seat.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct SeatStats {
    /// Samples taken in, or ticks at which the device could be read.
    pub taken: u64,
    /// How often the peer came, the first time included.
    pub joined: u64,
    /// Samples that were no samples of this session and this peer.
    pub refused: u64,
    /// Samples that came after a later one, or twice.
    pub out_of_order: u64,
    /// Samples handed in later than what they should have come before, and moved to the first instant that was still open.
    pub late: u64,
    /// By how much the latest of them.
    pub most_late: Duration,
}

/// The place of a peer that is remote.
#[derive(Clone, Debug)]
pub(crate) struct Seat {
    pub(crate) is_process: bool,
    /// Whose fades follow whether it is heard: all of them, or with a device that is simulated here that of its hand alone.
    followed: Range<usize>,
    silence: Silence,
    pub(crate) heard: Option<Instant>,
    /// Whether the present silence has been noticed. So is one before anything was heard.
    is_silent: bool,
    /// The number that the peer gave its newest sample.
    newest: u64,
    /// The number that its next sample has for the others.
    pub(crate) next_sequence: u64,
    pub(crate) stats: SeatStats,
    /// What each of the others feels of it; what it has of its own device in its own place.
    pub(crate) fades: Vec<Fade>,
    /// KC and BC when it is wholly there.
    pub(crate) coupling: Gains,
}

impl Seat {
    /// `None` for a peer that is never silent.
    pub(crate) fn of(kind: &PeerKind, place: usize, peers: usize, coupling: Gains) -> Option<Self> {
        let silence = kind.silence()?;
        let pointer = if let PeerKind::Pointer(_, pointer) = kind { Some(pointer) } else { None };
        let followed = if pointer.is_some() { place..place + 1 } else { 0..peers };
        let is_held = pointer.is_some_and(|pointer| pointer.held);
        let fade = |to: usize| if is_held || !followed.contains(&to) { Fade::whole(silence.fade) } else { Fade::unheard(silence.fade) };
        Some(Self {
            is_process: matches!(kind, PeerKind::Udp(_)),
            fades: (0..peers).map(fade).collect(),
            followed,
            silence,
            heard: is_held.then_some(Instant::ZERO),
            is_silent: !is_held,
            newest: 0,
            next_sequence: 0,
            stats: SeatStats { joined: u64::from(is_held), ..SeatStats::default() },
            coupling,
        })
    }

    /// What follows whether it is heard.
    pub(crate) fn followed_mut(&mut self) -> &mut [Fade] {
        &mut self.fades[self.followed.clone()]
    }

    /// Whether its copy is of interest: one with a device that is simulated here is, held or not.
    pub(crate) fn is_there(&self) -> bool {
        !self.is_silent || self.followed.len() < self.fades.len()
    }

    /// Notices that nothing has been heard for too long, and answers whether that is new.
    pub(crate) fn notice_silence(&mut self, now: Instant) -> bool {
        let Some(since) = self.falls_silent().filter(|since| !self.is_silent && now >= *since) else { return false };
        self.is_silent = true;
        self.followed_mut().iter_mut().for_each(|fade| fade.fall(since));
        true
    }

    /// Something is heard, and answers whether the peer was silent until now.
    pub(crate) fn hear(&mut self, now: Instant) -> bool {
        self.heard = Some(now);
        let joins = core::mem::take(&mut self.is_silent);
        self.stats.joined += u64::from(joins);
        self.stats.taken += 1;
        joins
    }

    /// Whether a sample of that number can be the next, and if so notes it.
    pub(crate) fn admit(&mut self, sequence: u64) -> Result<(), SampleError> {
        if !self.is_silent && sequence <= self.newest {
            self.stats.out_of_order += 1;
            return Err(SampleError::OutOfOrder { found: sequence, newest: self.newest });
        }
        self.newest = sequence;
        Ok(())
    }

    pub(crate) const fn is_silent(&self) -> bool {
        self.is_silent
    }

    pub(crate) fn presence(&self, now: Instant) -> Presence {
        match self.falls_silent() {
            None => Presence::Absent,
            Some(since) if self.is_silent || now >= since => Presence::Stale(since),
            Some(_) => Presence::Present,
        }
    }

    /// When it counts as silent if nothing more is heard.
    fn falls_silent(&self) -> Option<Instant> {
        Some(self.heard?.saturating_add(self.silence.after))
    }
}
