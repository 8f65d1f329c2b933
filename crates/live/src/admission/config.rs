//! The parameters of an admission control.

use core::fmt;
use core::time::Duration;

use cohaptic_peer::wire::SampleKind;
use cohaptic_units::print::Counted;

use crate::{EntropyError, SessionKey};

/// The place of a peer among the peers of the scene, from 0: the sender of its samples.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct Place(pub u32);

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// A peer of the scene that is another program.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Seat {
    /// Where it stands among the peers.
    pub place: Place,
    /// Its name in the scene.
    pub name: String,
    /// Tc of this peer, which a welcome tells.
    pub tick: Duration,
}

/// How far and how fast a copy can be without being refused. A sample can be finite and still throw every other copy out of the room.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Limits {
    /// The largest coordinate, either way \[m\].
    pub position: f64,
    /// The largest velocity along an axis, either way [m/s].
    pub velocity: f64,
}

/// The parameters of an admission control.
#[derive(Clone, Debug)]
pub struct AdmissionConfig {
    /// Only peers of one session understand each other; the seed of the scene.
    pub session: u64,
    /// How many axes the scene has, 1 to 3.
    pub axes: usize,
    /// What samples carry beyond the state.
    pub kind: SampleKind,
    /// How many peers the scene has, simulated ones among them.
    pub peers: u32,
    /// Tn, which a welcome tells.
    pub update: Duration,
    /// The peers that are other programs, in any order.
    pub seats: Vec<Seat>,
    /// With a key only its holders can join. Without one every program can that reaches the socket.
    pub key: Option<SessionKey>,
    /// After how long a peer that is not heard counts as gone: nothing is sent to it any more, and its seat can be taken.
    pub stale_after: Duration,
    /// `None`: any finite sample is let in.
    pub limits: Option<Limits>,
}

impl AdmissionConfig {
    /// With samples of states, without a key and limits, and with a second until a silent peer counts as gone.
    #[must_use]
    pub const fn new(session: u64, axes: usize, peers: u32, update: Duration, seats: Vec<Seat>) -> Self {
        Self { session, axes, kind: SampleKind::State, peers, update, seats, key: None, stale_after: Duration::from_secs(1), limits: None }
    }

    /// With that key, or none.
    #[must_use]
    pub fn with_key(self, key: Option<SessionKey>) -> Self {
        Self { key, ..self }
    }

    pub(super) fn check(&self) -> Result<(), AdmissionConfigError> {
        if !(1..=3).contains(&self.axes) {
            return Err(AdmissionConfigError::Axes { found: self.axes });
        }
        let ticks = self.seats.iter().map(|seat| (seat.tick, "tick"));
        for (span, name) in ticks.chain([(self.update, "update"), (self.stale_after, "stale_after")]) {
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
            if self.seats.iter().filter(|other| other.place == seat.place).count() > 1 {
                return Err(AdmissionConfigError::Twice { place: seat.place });
            }
        }
        Ok(())
    }
}

/// Why an admission control cannot be made.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum AdmissionConfigError {
    /// A sample has 1 to 3 axes.
    #[error("{}; a sample has 1 to 3", Counted(*found, "axis"))]
    Axes {
        /// What was asked for.
        found: usize,
    },
    /// A span is zero or longer than nanoseconds can be counted.
    #[error("{name} is {found:?}; expected more than nothing and less than 584 years")]
    Span {
        /// Which one.
        name: &'static str,
        /// What was asked for.
        found: Duration,
    },
    /// A limit is not above zero.
    #[error("limits of {} m and {} m/s; expected numbers above zero", found.position, found.velocity)]
    Limits {
        /// What was asked for.
        found: Limits,
    },
    /// A seat is none of the scene's peers.
    #[error("a seat at place {place}, but the scene has {peers} peers, counted from 0")]
    Beyond {
        /// The place.
        place: Place,
        /// How many peers there are.
        peers: u32,
    },
    /// Two seats are the same peer.
    #[error("two seats at place {place}")]
    Twice {
        /// The place.
        place: Place,
    },
    /// There are no random bytes to make nonces of.
    #[error(transparent)]
    Entropy(#[from] EntropyError),
}
