//! Drift between two clocks, from the send times and the arrivals of samples.
//!
//! A sample tells the time of its sending on the sender's clock. The arrival on the own clock, less that time, is the offset of the two clocks plus the delay
//! of the way. The offset cannot be separated from the delay, but its growth can: the shortest delays of long windows are nearly equal, so the lowest
//! difference of each window follows the clocks alone (Moon, Skelly & Towsley 1999 fit the same lower envelope).

use core::time::Duration;

use cohaptic_units::Instant;

/// Length of a window. Only the lowest difference of a window counts.
pub const DRIFT_WINDOW: Duration = Duration::from_secs(10);

/// Estimate of the drift of the own clock against the clock of one sender: the line of least squares through the lowest differences of whole windows.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct ClockDrift {
    /// First sample: arrival, and arrival less send time \[ns\]. All times count from here, so that the sums stay exact.
    origin: Option<(Instant, i128)>,
    /// Window of the latest sample.
    window: u64,
    /// Lowest difference of this window: time since the first arrival \[s\], and difference less the first difference \[s\].
    lowest: Option<(f64, f64)>,
    sums: Sums,
}

/// Sums over the closed windows: number, Σt, Σd, Σt², Σt·d.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
struct Sums {
    count: f64,
    t: f64,
    d: f64,
    tt: f64,
    td: f64,
}

impl ClockDrift {
    /// Takes a sample with the arrival `arrived` on the own clock and the send time `sent` on the sender's clock. Arrivals must not go back. A send time
    /// damaged by a link falsifies the window of the sample.
    pub fn note(&mut self, arrived: Instant, sent: Instant) {
        let difference = i128::from(arrived.as_nanos()) - i128::from(sent.as_nanos());
        let (first, base) = *self.origin.get_or_insert((arrived, difference));
        let elapsed = arrived.saturating_duration_since(first);
        // A length of 10 s makes the quotient a small number.
        let window = elapsed.as_secs() / DRIFT_WINDOW.as_secs();
        if window > self.window {
            self.close();
            self.window = window;
        }
        #[expect(clippy::cast_precision_loss, reason = "differences from the first one, far below 2^53 ns")]
        let point = (elapsed.as_secs_f64(), (difference - base) as f64 * 1e-9);
        if self.lowest.is_none_or(|(_, lowest)| point.1 < lowest) {
            self.lowest = Some(point);
        }
    }

    fn close(&mut self) {
        let Some((t, d)) = self.lowest.take() else { return };
        let Sums { count, t: sum_t, d: sum_d, tt, td } = self.sums;
        self.sums = Sums { count: count + 1.0, t: sum_t + t, d: sum_d + d, tt: tt + t * t, td: td + t * d };
    }

    /// Returns by how much the own clock is faster than the sender's clock \[ppm\]; negative if slower. `None` before two whole windows have passed.
    #[must_use]
    pub fn ppm(&self) -> Option<f64> {
        let Sums { count, t, d, tt, td } = self.sums;
        if count < 2.0 {
            return None;
        }
        // The times of two windows differ, so the denominator is above zero.
        Some((count * td - t * d) / (count * tt - t * t) * 1e6)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Passes samples of 8 ms for `seconds` over a way of 24 ms and a jitter, with an own clock that is `ppm` faster and ahead by an hour.
    fn measured(ppm: i64, seconds: u64) -> Option<f64> {
        let mut drift = ClockDrift::default();
        let mut noise = 1_u64;
        for number in 0..seconds * 125 {
            let sent = number * 8_000_000;
            // Congruential noise of up to 4 ms on most samples: the lower envelope must not follow the noise.
            noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let delay = 24_000_000 + (noise >> 33) % 4_000_000;
            let arrived = sent + delay;
            let gained = i64::try_from(arrived / 1000).unwrap() * ppm / 1000;
            let own = arrived.checked_add_signed(gained).unwrap() + 3_600_000_000_000;
            drift.note(Instant::from_nanos(own), Instant::from_nanos(sent));
        }
        drift.ppm()
    }

    #[test]
    fn the_drift_is_found_under_jitter_and_the_offset_has_no_part_in_it() {
        for ppm in [-80_i32, 0, 35] {
            let found = measured(ppm.into(), 120).unwrap();
            // The lowest of 1250 delays is 3.2 µs above the least on average, and 10 s are between two windows.
            assert!((found - f64::from(ppm)).abs() < 0.2, "{found} in place of {ppm}");
        }
    }

    #[test]
    fn two_windows_must_have_passed() {
        assert_eq!(measured(10, 19), None);
        assert!(measured(10, 21).is_some());
    }
}
