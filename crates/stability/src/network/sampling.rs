//! When a peer samples.

use std::time::Duration;

use cohaptic_peer::{Clock, Drift};
use cohaptic_scene::Scene;
use cohaptic_units::Instant;

/// The sampling instants of a peer: the n-th sample is sent at tick phase + n·M of its clock, M = update/tick.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) struct Sampling {
    offset: Duration,
    /// The first sample on the clock.
    first: Duration,
    /// Tn on the clock.
    period: Duration,
    /// Parts per billion.
    drift: i64,
    /// The time that a sample is under way before the link.
    ahead: Duration,
}

impl Sampling {
    pub(crate) fn of(scene: &Scene, place: usize, ahead: Duration) -> Self {
        let spec = &scene.peers[place];
        let Clock { tick, offset, drift } = spec.clock;
        let nanos = tick.as_nanos().saturating_mul(u128::from(spec.phase));
        let first = Duration::from_nanos(u64::try_from(nanos).unwrap_or(u64::MAX));
        let drift: i64 = Drift::parts_per_billion(drift);
        // Without drift only the sum of both matters.
        let (offset, first) = if drift == 0 { (offset.saturating_add(first), Duration::ZERO) } else { (offset, first) };
        Self { offset, first, period: scene.coordination.update, drift, ahead }
    }

    /// The same, as far as a link can tell that does not know the time.
    pub(crate) fn timeless(self) -> Self {
        if self.drift == 0 { Self { offset: Duration::ZERO, ahead: Duration::ZERO, ..self } } else { self }
    }

    /// When the n-th sample enters the link; `None` beyond the end of time. To the nanosecond what [`Clock::instant`] says.
    pub(crate) fn instant(&self, sample: u64) -> Option<Instant> {
        let local = self.period.as_nanos().checked_mul(u128::from(sample))?.checked_add(self.first.as_nanos())?;
        let true_time = local.checked_mul(1_000_000_000)? / u128::from(1_000_000_000_u64.saturating_add_signed(self.drift));
        let span = Duration::from_nanos(u64::try_from(true_time).ok()?);
        Instant::ZERO.checked_add(self.offset)?.checked_add(span)?.checked_add(self.ahead)
    }

    /// Samples a second.
    pub(crate) fn per_second(&self) -> f64 {
        let speed = f64::from(i32::try_from(self.drift).unwrap_or(0)) / 1e9 + 1.0;
        speed / self.period.as_secs_f64()
    }
}
