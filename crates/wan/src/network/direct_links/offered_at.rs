//! Instants of packets that are offered to neighbouring links together.

use cohaptic_units::Instant;

use super::DirectLinks;

/// When packets are offered to neighbouring links.
pub trait OfferedAt: Copy {
    /// When one is offered to the link in that place, which is below [`DirectLinks::AT_ONCE`].
    fn of(self, place: usize) -> Instant;
}

/// All at one instant.
impl OfferedAt for Instant {
    #[inline(always)]
    fn of(self, _place: usize) -> Instant {
        self
    }
}

/// Each at one of its own.
impl OfferedAt for &[Instant; DirectLinks::AT_ONCE] {
    #[inline(always)]
    fn of(self, place: usize) -> Instant {
        self[place % DirectLinks::AT_ONCE]
    }
}
