//! Seats: state of each remote peer, present or absent.

use std::ops::Range;
use std::time::Duration;

use cohaptic_peer::wire::DecodeError;
use cohaptic_peer::{Gains, ReceiveError};
use cohaptic_scene::{PeerKind, Silence};
use cohaptic_units::Instant;

use super::fade::Fade;

/// Presence of a peer.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Presence {
    /// The peer is simulated in this process.
    Here,
    /// The peer was never heard.
    Absent,
    /// The peer is heard.
    Present,
    /// The peer has been silent for long, and its pull fades or has faded. The fade began at this instant.
    Stale(Instant),
}

/// Reason why a sample from outside was refused. Only counters have changed.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SampleError {
    /// The peer is not in another process.
    #[error("peer {peer} is not a peer of kind \"udp\" of this scene")]
    NoSeat {
        /// Index of the peer.
        peer: usize,
    },
    /// The datagram is no sample of this session and this peer.
    #[error(transparent)]
    Sample(#[from] ReceiveError),
    /// The sequence number is not above the number of an earlier sample of the peer.
    #[error("sample {found} after sample {newest}: expected a higher number, or any number once the peer has been silent")]
    OutOfOrder {
        /// Sequence number of the sample.
        found: u64,
        /// Highest sequence number so far.
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

/// Counters of the inputs at a seat.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct SeatStats {
    /// Samples taken, or ticks with a reading of the device.
    pub taken: u64,
    /// Number of joinings of the peer, including the first.
    pub joined: u64,
    /// Datagrams without a sample of this session and this peer.
    pub refused: u64,
    /// Samples after a later sample, and repeated samples.
    pub out_of_order: u64,
    /// Samples passed in after their instant, and moved to the first open instant.
    pub late: u64,
    /// Largest shift of a sample.
    pub most_late: Duration,
}

/// Seat of a remote peer.
#[derive(Clone, Debug)]
pub(crate) struct Seat {
    /// `true` if the peer is in another process.
    pub(crate) is_process: bool,
    /// Indices of the fades that fall and rise with the silence of the peer: all fades, or for a pointer only the fade of its own hand.
    followed: Range<usize>,
    /// Time until silence and time of fading.
    silence: Silence,
    /// Instant at which the peer was last heard.
    pub(crate) heard: Option<Instant>,
    /// `true` if the peer is silent. True before the peer is heard for the first time, unless a pointer is held from the start.
    is_silent: bool,
    /// Sequence number of the newest sample in the peer's own count.
    newest: u64,
    /// Sequence number of the next sample for the receivers.
    pub(crate) next_sequence: u64,
    pub(crate) stats: SeatStats,
    /// Strength of this peer at each peer, indexed by peer. The peer's own entry is the strength of its own device.
    pub(crate) fades: Vec<Fade>,
    /// Coupling gains KC and BC at full presence.
    pub(crate) coupling: Gains,
}

impl Seat {
    /// Returns the seat of a peer; `None` for a never silent peer.
    pub(crate) fn of(kind: &PeerKind, place: usize, peers: usize, coupling: Gains) -> Option<Self> {
        let silence = kind.silence()?;
        let pointer = if let PeerKind::Pointer(_, pointer) = kind { Some(pointer) } else { None };
        // A pointer lets go of a device simulated here, so other peers go on feeling the device at full strength.
        let followed = if pointer.is_some() { place..place + 1 } else { 0..peers };
        // A held pointer is present from the first instant, before any reading.
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

    /// Returns the fades that fall and rise with the silence of the peer.
    pub(crate) fn followed_mut(&mut self) -> &mut [Fade] {
        &mut self.fades[self.followed.clone()]
    }

    /// Returns whether the copy of the peer counts in the discrepancy. The copy of a pointer's peer always counts, because its device is simulated here.
    pub(crate) fn is_there(&self) -> bool {
        !self.is_silent || self.followed.len() < self.fades.len()
    }

    /// Notes a silence that has lasted too long by `now`. Returns whether the silence is new.
    pub(crate) fn notice_silence(&mut self, now: Instant) -> bool {
        let Some(since) = self.falls_silent().filter(|since| !self.is_silent && now >= *since) else { return false };
        // The fade begins at the beginning of the silence, possibly before `now`.
        self.is_silent = true;
        self.followed_mut().iter_mut().for_each(|fade| fade.fall(since));
        true
    }

    /// Notes that the peer is heard. Returns whether the peer was silent before.
    pub(crate) fn hear(&mut self, now: Instant) -> bool {
        self.heard = Some(now);
        // `is_silent` is also true before the first sample, so the first sample counts as a joining.
        let joins = core::mem::take(&mut self.is_silent);
        self.stats.joined += u64::from(joins);
        self.stats.taken += 1;
        joins
    }

    /// Checks the sequence number of a sample and notes it. Any number is admitted after a silence.
    pub(crate) fn admit(&mut self, sequence: u64) -> Result<(), SampleError> {
        // After a silence the process of the peer may have started again, so any number is admitted.
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

    /// Returns the beginning of silence if nothing more is heard; `None` if nothing was ever heard.
    fn falls_silent(&self) -> Option<Instant> {
        Some(self.heard?.saturating_add(self.silence.after))
    }
}
