//! CUBIC (RFC 9438), in whole numbers.

use core::time::Duration;

use cohaptic_units::Instant;

/// β = 717/1024, as in Linux.
const BETA: (u64, u64) = (717, 1024);

#[derive(Clone, Default, Debug)]
pub(crate) struct Cubic {
    /// The window before the last reduction \[segments\].
    last_most: u32,
    /// When this stage of growth began.
    epoch: Option<Instant>,
    curve: Curve,
    /// What Reno would have, and what was acknowledged towards its next segment.
    reno_window: u32,
    acked: u32,
    /// The window and the instant of the last step, and that step.
    last: Option<(u32, Instant, u32)>,
}

/// W(t) = C·(t − K)³ + origin with C = 0.4 segments/s³.
#[derive(Clone, Default, Debug)]
struct Curve {
    origin: u32,
    k: u64,
}

impl Curve {
    /// The curve that begins at `window` and is flat at `origin`: K = ∛((origin − window)/C).
    fn new(window: u32, origin: u32) -> Self {
        let rise = origin.saturating_sub(window);
        Self { origin: origin.max(window), k: cube_root(u128::from(rise) * 10 * NANOS_CUBED / 4) }
    }

    /// The window `t` nanoseconds after the beginning \[1/1000 segment\].
    fn at(&self, t: u64) -> u64 {
        // Beyond 1000 s the cube would not fit, and no window would either.
        let distance = u128::from(t.abs_diff(self.k)).min(1_000_000_000_000);
        let change = u64::try_from(distance.pow(3) * 4 / (NANOS_CUBED / 100)).unwrap_or(u64::MAX);
        let origin = u64::from(self.origin) * 1000;
        if t < self.k { origin.saturating_sub(change) } else { origin.saturating_add(change) }
    }
}

/// Nanoseconds cubed in a second cubed.
const NANOS_CUBED: u128 = 1_000_000_000_000_000_000_000_000_000;

impl Cubic {
    /// The threshold after a loss at that window. A window that did not reach the last one makes room (RFC 9438, section 4.7).
    pub(crate) fn reduced(&mut self, window: u32) -> u32 {
        let (numerator, denominator) = BETA;
        let scaled = |factor: u64, by: u64| u32::try_from(u64::from(window) * factor / by).unwrap_or(u32::MAX);
        self.epoch = None;
        self.last_most = if window < self.last_most { scaled(denominator + numerator, 2 * denominator) } else { window };
        scaled(numerator, denominator).max(2)
    }

    /// After how many acknowledged segments the window grows by one.
    pub(crate) fn step(&mut self, now: Instant, window: u32, acked: u32, least_rtt: Duration) -> u32 {
        self.acked = self.acked.saturating_add(acked);
        if let Some((last_window, at, step)) = self.last
            && self.epoch.is_some()
            && last_window == window
            && now.saturating_duration_since(at) <= Duration::from_millis(31)
        {
            return step;
        }
        let epoch = *self.epoch.get_or_insert_with(|| {
            self.acked = acked;
            self.reno_window = window;
            self.curve = Curve::new(window, self.last_most);
            now
        });
        let t = now.saturating_duration_since(epoch) + least_rtt;
        let target = u32::try_from(self.curve.at(u64::try_from(t.as_nanos()).unwrap_or(u64::MAX)) / 1000).unwrap_or(u32::MAX);
        let mut step = if target > window { window / (target - window) } else { window.saturating_mul(100) };
        if self.last_most == 0 {
            step = step.min(20);
        }
        step = self.at_least_reno(window, step).max(2);
        self.last = Some((window, now, step));
        step
    }

    /// Where Reno would be faster, as fast as Reno (RFC 9438, section 4.3).
    fn at_least_reno(&mut self, window: u32, step: u32) -> u32 {
        let (numerator, denominator) = BETA;
        // Segments for one more: window·(1 + β)/(3·(1 − β)).
        let share = u64::from(window) * (denominator + numerator) / (3 * (denominator - numerator));
        let share = u32::try_from(share).unwrap_or(u32::MAX).max(1);
        self.reno_window = self.reno_window.saturating_add(self.acked / share);
        self.acked %= share;
        match self.reno_window.checked_sub(window) {
            Some(ahead @ 1..) => step.min(window / ahead),
            _ => step,
        }
    }

    /// Nothing was sent for that long: the time does not count.
    pub(crate) fn shift(&mut self, idle: Duration) {
        self.epoch = self.epoch.map(|epoch| epoch.saturating_add(idle));
    }
}

/// The cube root, rounded down.
fn cube_root(number: u128) -> u64 {
    let (mut low, mut high) = (0u64, 1 << 42);
    while high - low > 1 {
        let middle = low.midpoint(high);
        if u128::from(middle).pow(3) <= number { low = middle } else { high = middle }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;

    /// RFC 9438 by hand: W_max = 100, β = 0.7, C = 0.4.
    #[test]
    fn the_curve_after_a_loss_at_100_segments() {
        let mut cubic = Cubic::default();
        assert_eq!(cubic.reduced(100), 70);
        let curve = Curve::new(70, cubic.last_most);
        assert_eq!(curve.k / 1000, 4_217_163);
        assert_eq!([0, 1, 6].map(|second| (curve.at(second * 1_000_000_000) + 50) / 100), [700, 867, 1023]);
        assert_eq!(curve.at(curve.k), 100_000);
    }

    #[test]
    fn a_second_loss_below_the_first_makes_room() {
        let mut cubic = Cubic::default();
        cubic.reduced(100);
        assert_eq!((cubic.reduced(80), cubic.last_most), (56, 68));
    }

    #[test]
    fn the_window_follows_the_curve() {
        // 70 segments, R = 100 ms, so that Reno is slower; the window is ahead by a round trip.
        let mut congestion = super::super::Congestion::new(&crate::TcpConfig::default());
        (congestion.window, congestion.is_limiting) = (100, true);
        congestion.threshold = congestion.reduced();
        congestion.window = congestion.threshold;
        let rtt = Duration::from_millis(100);
        let mut now = Instant::ZERO;
        let window_at = |congestion: &mut super::super::Congestion, now: &mut Instant, end: u64| {
            while now.as_nanos() < end {
                congestion.grow(*now, congestion.window, rtt);
                *now += rtt;
            }
            congestion.window
        };
        let seen = [1_000_000_000, 4_217_163_000, 6_000_000_000].map(|end| window_at(&mut congestion, &mut now, end));
        assert!(seen.iter().zip([87, 100, 102]).all(|(seen, expected): (&u32, u32)| seen.abs_diff(expected) <= 2), "{seen:?}");
    }
}
