//! What becomes of a packet. Everything that can happen has a name, and every name a counter.

use cohaptic_units::Instant;

/// Why a packet was dropped.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum DropCause {
    /// A predicate of the program took it.
    Filter,
    /// It was larger than the link takes, or than a token bucket ever holds.
    Mtu,
    /// The link was down when the packet was offered.
    Outage,
    /// The loss model took it.
    Loss,
    /// As many packets as the link may hold were under way.
    Limit,
    /// The queue before the serialiser, or before the token bucket, was full.
    QueueFull,
    /// Random early detection took it, before the queue was full.
    Red,
    /// Controlled delay took it, because packets had waited too long for too long.
    CoDel,
    /// Its bits were damaged, and the receiver's checksum found it.
    Checksum,
    /// The log that the link replays has ended.
    EndOfLog,
}

impl DropCause {
    /// Every cause, in the order of the stages.
    pub const ALL: [Self; 10] =
        [Self::Filter, Self::Mtu, Self::Outage, Self::Loss, Self::Limit, Self::QueueFull, Self::Red, Self::CoDel, Self::Checksum, Self::EndOfLog];

    /// The name in records and JSON: `queue-full`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Filter => "filter",
            Self::Mtu => "mtu",
            Self::Outage => "outage",
            Self::Loss => "loss",
            Self::Limit => "limit",
            Self::QueueFull => "queue-full",
            Self::Red => "red",
            Self::CoDel => "codel",
            Self::Checksum => "checksum",
            Self::EndOfLog => "end-of-log",
        }
    }

    /// The cause of that name; `None` if there is none.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|cause| cause.name() == name)
    }

    /// Its place in [`DropCause::ALL`].
    pub(crate) const fn index(self) -> usize {
        self as usize
    }
}

/// What became of a packet.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
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
    fn every_cause_has_its_place() {
        assert!(DropCause::ALL.iter().enumerate().all(|(place, cause)| cause.index() == place));
    }

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
