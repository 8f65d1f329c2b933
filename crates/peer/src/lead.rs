//! Mean displacement of extrapolated samples since they were sent.

use core::time::Duration;

use cohaptic_units::Instant;

const NANOS_A_SECOND: f64 = 1e9;

/// An extrapolated sample.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Moving<const A: usize> {
    /// Send time on the sender's clock.
    pub sent: Instant,
    /// Velocity of the extrapolation \[m/s\].
    pub velocity: [f64; A],
}

/// Mean of min(age, horizon)·velocity over the samples that a peer holds \[m\].
///
/// The sum over the samples is computed when a sample changes, and when a sample begins or ends to move. Between these instants the lead grows linearly by
/// the mean velocity, so a tick takes the same time for any number of samples.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Lead<const A: usize> {
    /// Instant of the sum, on the holder's clock.
    since: Instant,
    /// First instant at which a sample begins or ends to move.
    until: Instant,
    /// Lead at `since` \[m\].
    value: [f64; A],
    /// Growth of the lead [m/ns].
    rate: [f64; A],
}

impl<const A: usize> Lead<A> {
    /// A lead that is valid at no instant, so that the next use computes the sum.
    pub const STALE: Self = Self { since: Instant::ZERO, until: Instant::ZERO, value: [0.0; A], rate: [0.0; A] };

    /// Sums over all samples at the time `now` on the holder's clock, with `horizon` \[s\] rounded to the nearest nanosecond. Zero without samples.
    ///
    /// Sums are four partial sums, as in [`crate::Held::refresh`]. Ages are whole nanoseconds, exact below 104 days.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "ages of held samples and the number of peers are far below 2^53")]
    pub fn of(samples: impl Iterator<Item = Moving<A>>, now: Instant, horizon: f64) -> Self {
        let horizon = Duration::try_from_secs_f64(horizon).map_or(u64::MAX, |horizon| u64::try_from(horizon.as_nanos()).unwrap_or(u64::MAX));
        let mut until = Instant::MAX;
        let (mut led, mut moved) = ([[0.0; A]; 4], [[0.0; A]; 4]);
        let mut count = 0;
        for Moving { sent, velocity } in samples {
            let end = sent.saturating_add_nanos(horizon);
            // A sample moves from its send time until the horizon, and stands still before and after.
            let moves = sent <= now && now < end;
            // A sample with a send time after `now` (clocks may differ) begins to move at its send time. A sample older than the horizon has stopped.
            let next = if sent > now { sent } else { end };
            if next > now && next < until {
                until = next;
            }
            let age = now.as_nanos().saturating_sub(sent.as_nanos()).min(horizon) as f64;
            let part = count % 4;
            for axis in 0..A {
                led[part][axis] += age * velocity[axis];
                moved[part][axis] += if moves { velocity[axis] } else { 0.0 };
            }
            count += 1;
        }
        // Without samples the sums are zero; a divisor of at least one sample keeps NaN away.
        let divisor = NANOS_A_SECOND * count.max(1) as f64;
        let mean = |[a, b, c, d]: [[f64; A]; 4]| core::array::from_fn(|axis| ((a[axis] + b[axis]) + (c[axis] + d[axis])) / divisor);
        Self { since: now, until, value: mean(led), rate: mean(moved) }
    }

    /// Returns whether the lead is linear from the instant of its sum to `now`.
    #[must_use]
    pub fn holds_at(&self, now: Instant) -> bool {
        self.since <= now && now < self.until
    }

    /// Returns the lead at an instant for which [`Lead::holds_at`] is true \[m\].
    #[must_use]
    #[inline]
    #[expect(clippy::cast_precision_loss, reason = "a lead is summed again long before 2^53 ns")]
    pub fn at(&self, now: Instant) -> [f64; A] {
        let nanos = now.as_nanos().saturating_sub(self.since.as_nanos()) as f64;
        core::array::from_fn(|axis| self.value[axis] + nanos * self.rate[axis])
    }
}

#[cfg(test)]
mod tests {
    use cohaptic_tests_common::properties;
    use proptest::collection::vec;
    use proptest::prelude::*;

    use super::*;

    properties! {
        /// The lead, followed over ticks, is the mean of min(age, horizon)·velocity, summed sample by sample. Each side rounds every product and every sum:
        /// fewer than 40 roundings of numbers of at most 2 m/s times a quarter of a second.
        #[test]
        fn followed_it_is_the_sum_at_every_tick(
            samples in vec((0..400_u64, -2.0..2.0_f64), 1..20), horizon in 0..250_u64, ticks in vec(1..30_u64, 1..20),
        ) {
            const MS: u64 = 1_000_000;
            let moving = || samples.iter().map(|(sent, velocity)| Moving { sent: Instant::from_nanos(sent * MS), velocity: [*velocity] });
            let (mut lead, mut now) = (Lead::<1>::STALE, 0);
            for tick in ticks {
                now += tick;
                let at = Instant::from_nanos(now * MS);
                if !lead.holds_at(at) {
                    lead = Lead::of(moving(), at, horizon as f64 * 1e-3);
                }
                let terms = samples.iter().map(|(sent, velocity)| now.saturating_sub(*sent).min(horizon) as f64 * 1e-3 * velocity);
                let expected = terms.sum::<f64>() / samples.len() as f64;
                prop_assert!((lead.at(at)[0] - expected).abs() <= 40.0 * f64::EPSILON * 0.5, "{} is not {expected} at {now} ms", lead.at(at)[0]);
            }
        }
    }

    #[test]
    fn nothing_held_moves_nowhere() {
        let now = Instant::from_nanos(5);
        let lead = Lead::<2>::of(core::iter::empty(), now, f64::INFINITY);
        assert!(lead.holds_at(now) && !Lead::<2>::STALE.holds_at(now));
        assert_eq!(lead.at(Instant::from_nanos(1_000_000)), [0.0; 2]);
    }
}
