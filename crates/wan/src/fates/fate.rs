//! Fate of a packet. Every possible fate has a name, and every end has a counter.

use cohaptic_units::Instant;

/// Cause of a drop.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub enum DropCause {
    /// A predicate of the program dropped the packet.
    Filter,
    /// The packet was too large for the link, or for a token bucket at any time.
    Mtu,
    /// The link was down at the offer of the packet.
    Outage,
    /// The loss model dropped the packet.
    Loss,
    /// The link already held as many packets as its limit allows.
    Limit,
    /// The queue before the serialiser, or before the token bucket, was full.
    QueueFull,
    /// Random early detection dropped the packet before the queue was full.
    Red,
    /// Controlled delay dropped the packet, because waits had exceeded the target for an interval.
    CoDel,
    /// The controller of PIE dropped the packet, because the delay of the queue exceeded the target.
    Pie,
    /// DualPI2 dropped the packet: one without ECN, or any one under overload.
    DualPi2,
    /// Bits of the packet were flipped, and the receiver's checksum detected the damage.
    Checksum,
    /// The replayed log has ended.
    EndOfLog,
}

impl DropCause {
    /// All causes in the order of the stages, indexed by the cause's number.
    pub const ALL: [Self; 12] = [
        Self::Filter,
        Self::Mtu,
        Self::Outage,
        Self::Loss,
        Self::Limit,
        Self::QueueFull,
        Self::Red,
        Self::CoDel,
        Self::Pie,
        Self::DualPi2,
        Self::Checksum,
        Self::EndOfLog,
    ];

    /// Returns the name in records and JSON, such as `queue-full`.
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
            Self::Pie => "pie",
            Self::DualPi2 => "dualpi2",
            Self::Checksum => "checksum",
            Self::EndOfLog => "end-of-log",
        }
    }

    /// Returns the cause with the given name, or `None` if no cause has the name.
    #[must_use]
    pub(crate) fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|cause| cause.name() == name)
    }

    /// Returns the index of the cause in [`DropCause::ALL`].
    pub(crate) const fn index(self) -> usize {
        self as usize
    }
}

/// Fate of a packet.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Fate {
    /// The packet left the far end of the link at this instant.
    Delivered(Instant),
    /// The packet was dropped for this cause.
    Dropped(DropCause),
    /// The packet was copied. Not final: packet and copy each get a later fate, `Delivered` or `Dropped`.
    Duplicated,
}

impl Fate {
    /// Returns the name in records: `delivered`, `duplicated`, or the name of the cause.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Delivered(_) => "delivered",
            Self::Dropped(cause) => cause.name(),
            Self::Duplicated => "duplicated",
        }
    }

    /// Returns whether the fate is final: the packet has left the link, delivered or dropped.
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
