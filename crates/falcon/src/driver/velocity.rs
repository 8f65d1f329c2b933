//! Estimate of velocity from quantised positions.

use core::f64::consts::TAU;
use core::time::Duration;

use cohaptic_units::Instant;

use crate::kinematics::Triple;

/// Pause after which the velocity begins at zero again.
const PAUSE: Duration = Duration::from_millis(50);

/// Low-pass filter of first order over differences of positions, divided by the time between them.
///
/// Each update closes the part 1 − exp(−2π·f·Δt) of the gap to the newest difference, so the bandwidth f is independent of the rate of updates. The estimate
/// lags by 1/(2π·f), 5 ms at 30 Hz. One count of an encoder, 0.03 mm, within one millisecond shows as 5 mm/s at 30 Hz instead of 30 mm/s.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct VelocityFilter {
    bandwidth: f64,
    last: Option<(Instant, Triple)>,
    velocity: Triple,
}

impl VelocityFilter {
    /// Returns a filter at rest with the bandwidth `bandwidth` \[Hz\].
    #[must_use]
    pub(crate) const fn new(bandwidth: f64) -> Self {
        Self { bandwidth, last: None, velocity: [0.0; 3] }
    }

    /// Takes a position \[m\] and returns the velocity \[m/s\]. A position of the same instant or of an earlier instant changes nothing.
    pub(crate) fn update(&mut self, at: Instant, position: Triple) -> Triple {
        let Some((before, old)) = self.last else {
            // The first position has no difference.
            self.last = Some((at, position));
            return self.velocity;
        };
        let passed = at.saturating_duration_since(before);
        if passed.is_zero() {
            return self.velocity;
        }
        self.last = Some((at, position));
        // The difference over a long pause would be a mean velocity of the past, not a present velocity.
        if passed > PAUSE {
            self.velocity = [0.0; 3];
            return self.velocity;
        }
        let seconds = passed.as_secs_f64();
        // `expm1` keeps the digits of a short step.
        let part = -libm::expm1(-TAU * self.bandwidth * seconds);
        for axis in 0..3 {
            self.velocity[axis] += part * ((position[axis] - old[axis]) / seconds - self.velocity[axis]);
        }
        self.velocity
    }

    /// Resets the filter to rest, after a jump of positions.
    pub(crate) const fn reset(&mut self) {
        (self.last, self.velocity) = (None, [0.0; 3]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(micros: u64) -> Instant {
        Instant::ZERO + Duration::from_micros(micros)
    }

    #[test]
    fn the_answer_to_a_step_of_speed_does_not_depend_on_the_rate() {
        // The time constant is 16 ms, after which 1 − 1/e of the step is reached.
        for steps in [20_u32, 100, 1000] {
            let mut filter = VelocityFilter::new(1.0 / (TAU * 0.016));
            for step in 0..=steps {
                let now = at(u64::from(step * 16_000 / steps));
                filter.update(now, [now.as_secs_f64(), 0.0, 0.0]);
            }
            assert!((filter.velocity[0] - (1.0 - (-1.0_f64).exp())).abs() < 1e-12, "{steps}: {}", filter.velocity[0]);
        }
    }

    #[test]
    fn one_count_within_a_millisecond() {
        let mut filter = VelocityFilter::new(30.0);
        filter.update(at(0), [0.0; 3]);
        // The difference of 0.03 m/s passes 1 − exp(−2π·30·0.001) = 0.1718.
        assert!((filter.update(at(1000), [0.03e-3, 0.0, 0.0])[0] - 0.03 * 0.17183).abs() < 1e-5);
    }

    #[test]
    fn pauses_and_repeated_instants_make_no_speed() {
        let mut filter = VelocityFilter::new(30.0);
        filter.update(at(0), [0.0; 3]);
        assert_eq!(filter.update(at(0), [1.0; 3]), [0.0; 3]);
        assert_eq!(filter.update(at(60_000), [1.0; 3]), [0.0; 3]);
    }
}
