//! Arming: a device gives forces after its user has held the cursor at the origin.

use core::time::Duration;

use cohaptic_device::Reading;
use cohaptic_units::Instant;

use super::ClientConfig;
use crate::axes::length;

/// Arming of a device.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub(super) struct Arming {
    is_armed: bool,
    /// Instant since which each reading was near the origin, and the instant of the newest of these readings.
    near: Option<(Instant, Instant)>,
}

impl Arming {
    pub(super) const fn is_armed(&self) -> bool {
        self.is_armed
    }

    /// Takes a reading. A pause of more than `pause` between two readings begins the wait anew: the cursor may have been elsewhere meanwhile.
    pub(super) fn read(&mut self, now: Instant, reading: &Reading, config: &ClientConfig, pause: Duration) {
        // `contains` is false for NaN, so a position that is not finite is not near.
        if !(0.0..=config.arming_distance).contains(&length(reading.position)) {
            self.near = None;
            return;
        }
        let since = self.near.filter(|(_, last)| now.saturating_duration_since(*last) <= pause).map_or(now, |(since, _)| since);
        self.near = Some((since, now));
        self.is_armed |= now.saturating_duration_since(since) >= config.arming_time;
    }

    /// Disarms, and returns whether the device was armed.
    pub(super) fn lose(&mut self) -> bool {
        core::mem::take(self).is_armed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAUSE: Duration = Duration::from_millis(10);

    fn read(arming: &mut Arming, milliseconds: u64, x: f64) -> bool {
        let reading = Reading { position: [x, 0.0, 0.0], velocity: [0.0; 3] };
        arming.read(Instant::from_nanos(1_000_000 * milliseconds), &reading, &ClientConfig::DEFAULT, PAUSE);
        arming.is_armed()
    }

    #[test]
    fn the_cursor_must_stay_near_the_origin_without_a_pause() {
        let mut arming = Arming::default();
        // 20 mm are near, 21 mm are not.
        assert!((0..=150).all(|ms| !read(&mut arming, ms, 0.020)) && !read(&mut arming, 151, 0.021));
        assert!((152..352).all(|ms| !read(&mut arming, ms, -0.020)));
        assert!(read(&mut arming, 352, 0.0));
        // An armed device stays armed far from the origin.
        assert!(read(&mut arming, 353, 0.1));
        assert!(arming.lose() && !arming.lose());
        assert!((354..=500).all(|ms| !read(&mut arming, ms, 0.0)));
        // A pause of 11 ms begins anew.
        assert!((511..711).all(|ms| !read(&mut arming, ms, 0.0)));
        assert!(read(&mut arming, 711, 0.0));
    }
}
