//! What becomes of a packet. Everything that can happen has a name, and every name a counter.

use cohaptic_units::Instant;

/// Why a packet was dropped.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
#[non_exhaustive]
pub enum DropCause {
    /// The link was down when the packet was offered.
    Outage,
    /// The loss model took it.
    Loss,
    /// The queue before the serialiser was full.
    QueueFull,
}

impl DropCause {
    /// Every cause, in the order of the stages.
    pub const ALL: [Self; 3] = [Self::Outage, Self::Loss, Self::QueueFull];

    /// The name in records and JSON: `queue-full`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Outage => "outage",
            Self::Loss => "loss",
            Self::QueueFull => "queue-full",
        }
    }

    pub(crate) const fn index(self) -> usize {
        match self {
            Self::Outage => 0,
            Self::Loss => 1,
            Self::QueueFull => 2,
        }
    }
}

/// What became of a packet.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[non_exhaustive]
pub enum Fate {
    /// It came out of the far end at this instant.
    Delivered(Instant),
    /// It did not, for this reason.
    Dropped(DropCause),
}

impl Fate {
    /// The name in records: `delivered`, or that of the cause.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Delivered(_) => "delivered",
            Self::Dropped(cause) => cause.name(),
        }
    }
}
