//! The instants at which a peer sends its samples.

use std::time::Duration;

use cohaptic_peer::{Clock, Drift};
use cohaptic_scene::Scene;
use cohaptic_units::Instant;

/// The sampling instants of a peer: the n-th sample is sent at tick phase + n·M of the peer's clock, with M = update/tick.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) struct Sampling {
    /// True time at which the clock starts.
    offset: Duration,
    /// Time of the first sample on the clock.
    first: Duration,
    /// Time Tn between samples on the clock.
    period: Duration,
    /// Drift of the clock, in parts per billion; positive if the clock is fast.
    drift: i64,
    /// Time that a sample takes before it enters the link.
    ahead: Duration,
}

impl Sampling {
    pub(crate) fn of(scene: &Scene, place: usize, ahead: Duration) -> Self {
        let spec = &scene.peers[place];
        let Clock { tick, offset, drift } = spec.clock;
        let nanos = tick.as_nanos().saturating_mul(u128::from(spec.phase));
        let first = Duration::from_nanos(u64::try_from(nanos).unwrap_or(u64::MAX));
        let drift: i64 = Drift::parts_per_billion(drift);
        // Without drift only the sum of offset and first sample matters. Equal sums must compare equal, so that equal senders form one class.
        let (offset, first) = if drift == 0 { (offset.saturating_add(first), Duration::ZERO) } else { (offset, first) };
        Self { offset, first, period: scene.coordination.update, drift, ahead }
    }

    /// Returns the sampling as seen by a link that does not depend on the time: without drift, shifts in time are removed.
    pub(crate) fn timeless(self) -> Self {
        if self.drift == 0 { Self { offset: Duration::ZERO, ahead: Duration::ZERO, ..self } } else { self }
    }

    /// Returns the instant at which the n-th sample enters the link, equal to [`Clock::instant`] to the nanosecond; `None` if the instant overflows.
    pub(crate) fn instant(&self, sample: u64) -> Option<Instant> {
        let local = self.period.as_nanos().checked_mul(u128::from(sample))?.checked_add(self.first.as_nanos())?;
        let true_time = local.checked_mul(1_000_000_000)? / u128::from(1_000_000_000_u64.saturating_add_signed(self.drift));
        let span = Duration::from_nanos(u64::try_from(true_time).ok()?);
        Instant::ZERO.checked_add(self.offset)?.checked_add(span)?.checked_add(self.ahead)
    }

    /// Returns the number of samples per second of true time.
    pub(crate) fn per_second(&self) -> f64 {
        let speed = f64::from(i32::try_from(self.drift).unwrap_or(0)) / 1e9 + 1.0;
        speed / self.period.as_secs_f64()
    }
}
