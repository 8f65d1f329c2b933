//! Faults of a simulated service, and their times.

use core::time::Duration;

use cohaptic_units::Instant;

/// Fault of a simulated service.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum FaultKind {
    /// A reply takes 20 ms longer. Later replies of the same connection wait for the late reply.
    Late,
    /// A message gets no reply.
    Missing,
    /// A reply is sent twice.
    Doubled,
    /// A reply is sent as two frames, of which no frame is JSON.
    Split,
    /// A reply lacks the end of its text.
    Malformed,
    /// A reply lacks position or velocity.
    FieldMissing,
    /// The device is missing from the list.
    Gone,
    /// The device has another id.
    Renamed,
    /// The device is not ready.
    NotReady,
    /// The service ends all connections, and accepts none.
    Restart,
    /// The position stays as at the beginning of the fault, while the grip moves on.
    Frozen,
    /// The position is 50 mm off.
    Jumping,
    /// The axes of the device are permuted, as by another program.
    Turned,
    /// The coordinates of the session are turned by a transform.
    Transformed,
    /// The emergency brake locks the device.
    Brake,
    /// A motor stalls.
    Stall,
}

impl FaultKind {
    /// All faults.
    pub const ALL: [Self; 16] = [
        Self::Late,
        Self::Missing,
        Self::Doubled,
        Self::Split,
        Self::Malformed,
        Self::FieldMissing,
        Self::Gone,
        Self::Renamed,
        Self::NotReady,
        Self::Restart,
        Self::Frozen,
        Self::Jumping,
        Self::Turned,
        Self::Transformed,
        Self::Brake,
        Self::Stall,
    ];

    /// Returns the name in a command line.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Late => "late",
            Self::Missing => "missing",
            Self::Doubled => "doubled",
            Self::Split => "split",
            Self::Malformed => "malformed",
            Self::FieldMissing => "field-missing",
            Self::Gone => "gone",
            Self::Renamed => "renamed",
            Self::NotReady => "not-ready",
            Self::Restart => "restart",
            Self::Frozen => "frozen",
            Self::Jumping => "jumping",
            Self::Turned => "turned",
            Self::Transformed => "transformed",
            Self::Brake => "brake",
            Self::Stall => "stall",
        }
    }

    /// Returns whether the fault can hit single replies by chance. Other faults are states of service or device, and need a beginning and a length.
    #[must_use]
    pub const fn hits_replies(self) -> bool {
        !matches!(self, Self::Restart | Self::Frozen | Self::Turned | Self::Brake | Self::Stall)
    }
}

/// Time of a fault.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum When {
    /// Each reply has the fault with this probability, from 0 to 1.
    Chance(f64),
    /// Every reply, or the device, has the fault during a span.
    During {
        /// Beginning of the fault.
        from: Instant,
        /// Length of the fault.
        length: Duration,
    },
}

/// Fault of a simulated service, and its time.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Fault {
    /// Kind of the fault.
    pub kind: FaultKind,
    /// Time of the fault. [`When::Chance`] has no effect on a fault that does not [hit replies](FaultKind::hits_replies).
    pub when: When,
}

impl Fault {
    /// Returns a fault during a span that begins at `from`.
    #[must_use]
    pub const fn during(kind: FaultKind, from: Instant, length: Duration) -> Self {
        Self { kind, when: When::During { from, length } }
    }

    /// Returns whether the span of the fault contains `now`. `false` for a fault by chance.
    pub(super) fn holds(&self, now: Instant) -> bool {
        let When::During { from, length } = self.when else { return false };
        now.checked_duration_since(from).is_some_and(|passed| passed < length)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_holds_from_its_beginning_to_before_its_end() {
        let at = |ms: u64| Instant::ZERO + Duration::from_millis(ms);
        let fault = Fault::during(FaultKind::Gone, at(10), Duration::from_millis(5));
        assert_eq!([9, 10, 14, 15].map(|ms| fault.holds(at(ms))), [false, true, true, false]);
        assert!(!Fault { kind: FaultKind::Late, when: When::Chance(1.0) }.holds(at(10)));
    }
}
