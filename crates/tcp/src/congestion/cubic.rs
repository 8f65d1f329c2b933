//! CUBIC (RFC 9438), in integer arithmetic, so that results are equal on every machine.

use core::time::Duration;

use cohaptic_units::Instant;

use super::hystart::{HyStart, RoundTrip};

/// Numerator and denominator of the factor β of a reduction: 717/1024, as in Linux.
const BETA: (u64, u64) = (717, 1024);

/// State of CUBIC. The epoch is the present stage of growth: from the first acknowledgement after a reduction to the next reduction.
#[derive(Clone, Default, Debug)]
pub(crate) struct Cubic {
    /// `W_max`: the window before the last reduction \[segments\], lowered by fast convergence if that window had not reached the earlier `W_max`. Zero before
    /// any reduction and after a timeout.
    last_most: u32,
    /// Beginning of the epoch. `None` until the first acknowledgement after a reduction.
    epoch: Option<Instant>,
    /// Target of the window during the epoch.
    curve: Curve,
    /// Window that Reno would have reached in this epoch \[segments\].
    reno_window: u32,
    /// Number of segments acknowledged since the last increase of `reno_window`.
    acked: u32,
    /// Window, instant and result of the last full computation of [`step`](Self::step).
    last: Option<(u32, Instant, u32)>,
    /// Least round trip since the last timeout, apart from the first second of an epoch. Zero before the first sample.
    least_rtt: Duration,
    /// Search for the end of slow start. `None` if slow start lasts until a loss.
    hystart: Option<HyStart>,
}

/// Cubic curve W(t) = C·(t − K)³ + origin with C = 0.4 segments/s³, where t is the time since the beginning of the epoch.
#[derive(Clone, Default, Debug)]
struct Curve {
    /// Window at the plateau of the curve \[segments\].
    origin: u32,
    /// Time of the plateau, K \[ns\].
    k: u64,
}

impl Curve {
    /// Returns the curve with W(0) = `window` and the plateau at `origin`, so that K = ∛((origin − window)/C). If `window` is above `origin`, the curve begins
    /// on a plateau at `window`.
    fn new(window: u32, origin: u32) -> Self {
        let rise = origin.saturating_sub(window);
        Self { origin: origin.max(window), k: cube_root(u128::from(rise) * 10 * NANOS_CUBED / 4) }
    }

    /// Returns the distance of the curve from the plateau `t` nanoseconds after the beginning of the epoch \[1/1000 segment\].
    fn distance(&self, t: u64) -> u64 {
        // The cube of at most 1000 s times four is 4·10³⁶ ns³, which 128 bits hold. At 1000 s the curve is 4·10⁸ segments away from the plateau, above
        // any real window.
        let distance = u128::from(t.abs_diff(self.k)).min(1_000_000_000_000);
        u64::try_from(distance.pow(3) * 4 / (NANOS_CUBED / 100)).unwrap_or(u64::MAX)
    }

    /// Returns the window `t` nanoseconds after the beginning of the epoch \[segments\]. As in Linux, the distance from the plateau is rounded down.
    fn at(&self, t: u64) -> u32 {
        let distance = u32::try_from(self.distance(t) / 1000).unwrap_or(u32::MAX);
        if t < self.k { self.origin.saturating_sub(distance) } else { self.origin.saturating_add(distance) }
    }
}

/// Number of cubic nanoseconds in a cubic second.
const NANOS_CUBED: u128 = 1_000_000_000_000_000_000_000_000_000;

impl Cubic {
    pub(crate) fn new(has_hystart: bool) -> Self {
        Self { hystart: has_hystart.then(HyStart::default), ..Self::default() }
    }

    /// Drops epoch, `W_max` and least round trip after a timeout, and begins the search for the end of slow start anew.
    pub(crate) fn restart(&mut self) {
        *self = Self::new(self.hystart.is_some());
    }

    /// Takes a round trip. Returns whether slow start ends here; `slow_start` is the window if slow start lasts.
    pub(crate) fn ends_slow_start(&mut self, now: Instant, slow_start: Option<u32>, sample: RoundTrip) -> bool {
        // Round trips soon after a recovery tell of the queue that the recovery has left.
        if self.epoch.is_some_and(|epoch| now.saturating_duration_since(epoch) < Duration::from_secs(1)) {
            return false;
        }
        let latest = sample.latest.max(Duration::from_nanos(1));
        if self.least_rtt.is_zero() || latest < self.least_rtt {
            self.least_rtt = latest;
        }
        match (&mut self.hystart, slow_start) {
            (Some(hystart), Some(window)) => hystart.ends(now, window, self.least_rtt, sample),
            _ => false,
        }
    }

    /// Ends the epoch and returns the threshold after a loss at `window` \[segments\], at least 2. A window below the last `W_max` lowers `W_max` further, so
    /// that the flow makes room for new flows (fast convergence, RFC 9438, section 4.7).
    pub(crate) fn reduced(&mut self, window: u32) -> u32 {
        let (numerator, denominator) = BETA;
        let scaled = |factor: u64, by: u64| u32::try_from(u64::from(window) * factor / by).unwrap_or(u32::MAX);
        self.epoch = None;
        self.last_most = if window < self.last_most { scaled(denominator + numerator, 2 * denominator) } else { window };
        scaled(numerator, denominator).max(2)
    }

    /// Returns the number of acknowledged segments after which the window grows by one segment, at least 2. `acked` counts the segments acknowledged since the
    /// last call.
    pub(crate) fn step(&mut self, now: Instant, window: u32, acked: u32) -> u32 {
        self.acked = self.acked.saturating_add(acked);
        // As in Linux, a result counts for 31 ms (1/32 s) while the window is the same.
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
        // The target is the window one round trip ahead, where the growth decided now takes effect.
        let t = now.saturating_duration_since(epoch) + self.least_rtt;
        let target = self.curve.at(u64::try_from(t.as_nanos()).unwrap_or(u64::MAX));
        // Reaching the target within a window of acknowledgements takes one increase per window/(target − window). At or above the target, the window almost
        // stands still.
        let mut step = if target > window { window / (target - window) } else { window.saturating_mul(100) };
        // Before any reduction the curve knows no plateau and would begin too slowly.
        if self.last_most == 0 {
            step = step.min(20);
        }
        step = self.at_least_reno(window, step).max(2);
        self.last = Some((window, now, step));
        step
    }

    /// Returns the smaller of `step` and the step with which the window keeps up with Reno (RFC 9438, section 4.3).
    fn at_least_reno(&mut self, window: u32, step: u32) -> u32 {
        // Reno's estimate grows by one segment per window·(1 + β)/(3·(1 − β)) acknowledged segments. Linux rounds the factor down to eighths (`beta_scale`).
        const EIGHTHS: u64 = 8 * (BETA.1 + BETA.0) / 3 / (BETA.1 - BETA.0);
        let share = u32::try_from(u64::from(window) * EIGHTHS / 8).unwrap_or(u32::MAX).max(1);
        // As in Linux, the estimate grows with the first segment beyond a share.
        let grown = self.acked.saturating_sub(1) / share;
        self.reno_window = self.reno_window.saturating_add(grown);
        self.acked -= grown * share;
        match self.reno_window.checked_sub(window) {
            Some(ahead @ 1..) => step.min(window / ahead),
            _ => step,
        }
    }

    /// Moves the beginning of the epoch by `idle`, so that the curve does not rise while nothing is sent.
    pub(crate) fn shift(&mut self, idle: Duration) {
        self.epoch = self.epoch.map(|epoch| epoch.saturating_add(idle));
    }
}

/// Returns the cube root of `number`, rounded down. `number` must be below 2^126.
fn cube_root(number: u128) -> u64 {
    // Bisection: the cube of `low` is at most `number`, the cube of `high` is above.
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
    use crate::pace::Pace;

    /// RFC 9438, calculated by hand: `W_max` = 100, β = 0.7, C = 0.4.
    #[test]
    fn the_curve_after_a_loss_at_100_segments() {
        let mut cubic = Cubic::default();
        assert_eq!(cubic.reduced(100), 70);
        let curve = Curve::new(70, cubic.last_most);
        assert_eq!(curve.k / 1000, 4_217_163);
        // W(0) = 70, W(1 s) = 86.7 and W(6 s) = 102.3.
        assert_eq!([0, 1, 6].map(|second| (curve.distance(second * 1_000_000_000) + 50) / 100), [300, 133, 23]);
        assert_eq!([0, 1, 6].map(|second| curve.at(second * 1_000_000_000)), [71, 87, 102]);
        assert_eq!(curve.at(curve.k), 100);
    }

    /// As in `bictcp_acked`, round trips in the first second of an epoch do not count. After a timeout, the search for the end of slow start begins anew
    /// (`bictcp_state`).
    #[test]
    fn slow_start_ends_once_and_not_soon_after_a_reduction() {
        let mut cubic = Cubic::new(true);
        cubic.step(Instant::ZERO, 16, 1);
        // Returns whether one of ten acknowledgements of a round from the second `second` on ends slow start.
        let ends = |cubic: &mut Cubic, second: u64, latest: u64| {
            let sample = RoundTrip { latest: Duration::from_millis(latest), una: second * 10, next: second * 10 + 5, pace: Pace::UNBOUNDED };
            (0..10).any(|k| cubic.ends_slow_start(Instant::ZERO + Duration::from_millis(second * 1000 + k * 3), Some(16), sample))
        };
        assert!(!ends(&mut cubic, 0, 50) && cubic.least_rtt.is_zero());
        assert_eq!([(1, 100), (2, 200), (3, 200)].map(|(second, latest)| ends(&mut cubic, second, latest)), [false, true, false]);
        cubic.restart();
        assert_eq!([(4, 100), (5, 200)].map(|(second, latest)| ends(&mut cubic, second, latest)), [false, true]);
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
        congestion.sample(Instant::ZERO, RoundTrip { latest: Duration::from_millis(100), una: 0, next: 0, pace: Pace::UNBOUNDED });
        congestion.threshold = congestion.reduced();
        congestion.window = congestion.threshold;
        let rtt = Duration::from_millis(100);
        let mut now = Instant::ZERO;
        let window_at = |congestion: &mut super::super::Congestion, now: &mut Instant, end: u64| {
            while now.as_nanos() < end {
                congestion.grow(*now, congestion.window);
                *now += rtt;
            }
            congestion.window
        };
        let seen = [1_000_000_000, 4_217_163_000, 6_000_000_000].map(|end| window_at(&mut congestion, &mut now, end));
        assert!(seen.iter().zip([87, 100, 102]).all(|(seen, expected): (&u32, u32)| seen.abs_diff(expected) <= 2), "{seen:?}");
    }
}
