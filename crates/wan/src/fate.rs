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

    /// The cause of that name; `None` if there is none.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|cause| cause.name() == name)
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
    /// A copy of it was made. This is not its end: the packet and its copy each go on to one of the others.
    Duplicated,
}

impl Fate {
    /// The name in records: `delivered`, `duplicated`, or that of the cause.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Delivered(_) => "delivered",
            Self::Dropped(cause) => cause.name(),
            Self::Duplicated => "duplicated",
        }
    }

    /// Whether the packet is out of the link with this: delivered or dropped.
    #[must_use]
    pub const fn is_end(self) -> bool {
        match self {
            Self::Delivered(_) | Self::Dropped(_) => true,
            Self::Duplicated => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cause_is_found_by_its_name_and_no_other_text_is() {
        for cause in DropCause::ALL {
            assert_eq!(DropCause::from_name(cause.name()), Some(cause));
        }
        for name in ["", "delivered", "duplicated", "Loss", "loss "] {
            assert_eq!(DropCause::from_name(name), None);
        }
    }
}
