//! Configuration of an [`AdmissionControl`](super::AdmissionControl), and the errors of a configuration.

use core::time::Duration;

use cohaptic_peer::wire::SampleKind;
use cohaptic_units::print::{Counted, Span};

use crate::place::Place;
use crate::{EntropyError, SessionKey};

/// Seat of a session: the peer of the scene that a program joins as. One program at a time has the seat.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Seat {
    /// Index of the peer in the scene.
    pub place: Place,
    /// Name of the peer in the scene.
    pub name: String,
    /// Control tick Tc of the peer, above zero and below 584 years. A welcome carries this tick.
    pub tick: Duration,
}

/// Largest position and velocity of an admitted sample. Without limits, a sample can be finite and still throw every other copy far away through the
/// coordination.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Limits {
    /// Largest absolute value of a coordinate \[m\], above zero.
    pub position: f64,
    /// Largest absolute value of the velocity along an axis [m/s], above zero.
    pub velocity: f64,
}

/// Configuration of an [`AdmissionControl`](super::AdmissionControl).
#[derive(Clone, Debug)]
pub struct AdmissionConfig {
    /// Number of the session, which is the seed of the scene. Datagrams with another number are refused.
    pub session: u64,
    /// Number of axes of the scene, 1 to 3.
    pub axes: usize,
    /// Kind of the samples: data in samples beyond position and velocity.
    pub kind: SampleKind,
    /// Number of peers of the scene, simulated peers included. The place of every seat is below this number.
    pub peers: u32,
    /// Period of sending Tn, above zero and below 584 years. A welcome carries this period.
    pub update: Duration,
    /// Seats of the peers that are other programs, in any order, each at a place of its own.
    pub seats: Vec<Seat>,
    /// Session key. With a key only programs with the key can join. `None`: every program within reach of the socket can join.
    pub key: Option<SessionKey>,
    /// Time without an admitted sample after which a peer counts as gone, above zero and below 584 years. Nothing is sent to a gone peer, and the seat of a
    /// gone peer can be taken.
    pub stale_after: Duration,
    /// Limits of position and velocity. `None`: every finite sample is admitted.
    pub limits: Option<Limits>,
    /// Fingerprint of the scene. A hello with another fingerprint is refused; a hello with the fingerprint 0 tells none and is answered. 0: every hello is
    /// answered.
    pub scene: u64,
}

impl AdmissionConfig {
    /// Returns a configuration for samples of states, without a key, without limits, for peers of any scene, and with one second until a silent peer counts
    /// as gone.
    #[must_use]
    pub const fn new(session: u64, axes: usize, peers: u32, update: Duration, seats: Vec<Seat>) -> Self {
        Self { session, axes, kind: SampleKind::State, peers, update, seats, key: None, stale_after: Duration::from_secs(1), limits: None, scene: 0 }
    }

    /// Returns the configuration with the session key `key`, or without a key if `None`.
    #[must_use]
    pub fn with_key(self, key: Option<SessionKey>) -> Self {
        Self { key, ..self }
    }

    /// Returns the first fault of the configuration.
    pub(super) fn check(&self) -> Result<(), AdmissionConfigError> {
        if !(1..=3).contains(&self.axes) {
            return Err(AdmissionConfigError::Axes { found: self.axes });
        }
        let ticks = self.seats.iter().map(|seat| (seat.tick, "tick"));
        for (span, name) in ticks.chain([(self.update, "update"), (self.stale_after, "stale_after")]) {
            // A welcome carries spans as nanoseconds in 64 bits.
            if span.is_zero() || u64::try_from(span.as_nanos()).is_err() {
                return Err(AdmissionConfigError::Span { name, found: span });
            }
        }
        if let Some(limits) = self.limits
            && [limits.position, limits.velocity].into_iter().any(|limit| limit.is_nan() || limit <= 0.0)
        {
            return Err(AdmissionConfigError::Limits { found: limits });
        }
        for seat in &self.seats {
            if seat.place.0 >= self.peers {
                return Err(AdmissionConfigError::Beyond { place: seat.place, peers: self.peers });
            }
            // The seat itself is among the seats counted, so that a count of 1 means no duplicate.
            if self.seats.iter().filter(|other| other.place == seat.place).count() > 1 {
                return Err(AdmissionConfigError::Twice { place: seat.place });
            }
        }
        Ok(())
    }
}

/// Reason why an admission control cannot be made.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum AdmissionConfigError {
    /// The number of axes is not 1 to 3.
    #[error("{}; a sample has 1 to 3", Counted(*found, "axis"))]
    Axes {
        /// Configured number of axes.
        found: usize,
    },
    /// A span is zero, or too long for nanoseconds in 64 bits.
    #[error("{name} is {}; expected a time above zero and below 584 years", Span(*found))]
    Span {
        /// Name of the span: `tick`, `update` or `stale_after`.
        name: &'static str,
        /// Configured span.
        found: Duration,
    },
    /// A limit is zero, negative or not a number.
    #[error("limits of {} m and {} m/s; expected numbers above zero", found.position, found.velocity)]
    Limits {
        /// Configured limits.
        found: Limits,
    },
    /// The place of a seat is not below the number of peers.
    #[error("a seat at place {place}, but the scene has {peers} peers, counted from 0")]
    Beyond {
        /// Place of the seat.
        place: Place,
        /// Number of peers of the scene.
        peers: u32,
    },
    /// Two seats have the same place.
    #[error("two seats at place {place}")]
    Twice {
        /// Place of both seats.
        place: Place,
    },
    /// The system has no random bytes for the secret of the nonces.
    #[error(transparent)]
    Entropy(#[from] EntropyError),
}
