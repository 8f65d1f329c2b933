//! Congestion window: the number of segments that may be on the way. The algorithms work with counts of segments. Positions serve only to tell one flight from
//! the next flight.

mod cubic;
mod dctcp;
mod hystart;
mod reduction;

use core::time::Duration;

use cohaptic_units::Instant;

use crate::config::{CongestionControl, TcpConfig};
use crate::sequence::Position;
use cubic::Cubic;
use dctcp::Dctcp;
pub(crate) use hystart::RoundTrip;
pub(crate) use reduction::Reduction;

/// Threshold of slow start before any reduction.
pub(crate) const UNBOUNDED: u32 = u32::MAX;

/// Congestion window and its growth (RFC 5681). Growth counts acknowledged segments as in RFC 3465, but without the limit of RFC 3465, as Linux does.
#[derive(Clone, Debug)]
pub(crate) struct Congestion {
    /// Congestion window \[segments\], at least 1.
    pub(crate) window: u32,
    /// Threshold of slow start \[segments\]: slow start below, congestion avoidance from there on.
    pub(crate) threshold: u32,
    /// Number of segments acknowledged since the last increase in congestion avoidance.
    count: u32,
    /// State of CUBIC. `None` with Reno and DCTCP.
    cubic: Option<Cubic>,
    /// State of DCTCP. `None` with Reno and CUBIC.
    dctcp: Option<Dctcp>,
    /// Initial window \[segments\].
    initial: u32,
    /// `true` if the window, and not the program, held back data in the last flight.
    is_limiting: bool,
    /// Largest number of unacknowledged segments in the last flight.
    most_out: u32,
    /// End of the last flight. `is_limiting` and `most_out` are measured anew once this position is acknowledged.
    usage_end: Position,
}

impl Congestion {
    pub(crate) fn new(config: &TcpConfig) -> Self {
        let cubic = (config.congestion == CongestionControl::Cubic).then(|| Cubic::new(config.hystart));
        let dctcp = (config.congestion == CongestionControl::Dctcp).then(Dctcp::new);
        let window = config.initial_window;
        Self { window, threshold: UNBOUNDED, count: 0, cubic, dctcp, initial: window, is_limiting: false, most_out: 0, usage_end: 0 }
    }

    pub(crate) const fn is_slow_start(&self) -> bool {
        self.window < self.threshold
    }

    /// Returns the threshold after a loss at the present window \[segments\], at least 2, and lets growth begin anew. The caller sets `window` and `threshold`.
    pub(crate) fn reduced(&mut self) -> u32 {
        self.count = 0;
        match &mut self.cubic {
            Some(cubic) => cubic.reduced(self.window),
            None => (self.window / 2).max(2),
        }
    }

    /// Returns whether the window answers to the share of marked segments (DCTCP), and not to the first mark of a round as to a loss.
    pub(crate) const fn is_scalable(&self) -> bool {
        self.dctcp.is_some()
    }

    /// Takes an acknowledgement for the estimate of the share of marked segments; see [`Dctcp::hear`].
    pub(crate) fn hear(&mut self, una: Position, next: Position, delivered: u32, is_marked: bool) {
        if let Some(dctcp) = &mut self.dctcp {
            dctcp.hear(una, next, delivered, is_marked);
        }
    }

    /// Shrinks the window by the share of marked segments, and ends slow start. Returns whether this is the first mark of its round; later ones change nothing.
    pub(crate) fn shrink_by_share(&mut self, una: Position, next: Position) -> bool {
        let Some(window) = self.dctcp.as_mut().and_then(|dctcp| dctcp.reduced(self.window, una, next)) else { return false };
        (self.window, self.threshold) = (window, window);
        true
    }

    /// Sets the window after a timeout, to at least one segment, and drops the state of CUBIC.
    pub(crate) fn restart(&mut self, window: u32) {
        self.window = window.max(1);
        if let Some(cubic) = &mut self.cubic {
            cubic.restart();
        }
    }

    /// Takes the round trip that an acknowledgement tells. With CUBIC, the sample may end slow start.
    pub(crate) fn sample(&mut self, now: Instant, sample: RoundTrip) {
        let is_slow_start = self.is_slow_start();
        if let Some(cubic) = &mut self.cubic
            && cubic.ends_slow_start(now, is_slow_start.then_some(self.window), sample)
        {
            self.threshold = self.window;
        }
    }

    /// Lets the window grow after `acked` acknowledged segments. Does nothing unless the window has limited the sender.
    pub(crate) fn grow(&mut self, now: Instant, acked: u32) {
        if !self.is_limited() {
            return;
        }
        let mut acked = acked;
        if self.is_slow_start() {
            // Segments that are left over when slow start reaches the threshold count for congestion avoidance.
            let grown = self.window.saturating_add(acked).min(self.threshold);
            acked -= grown - self.window;
            self.window = grown;
        }
        if acked == 0 {
            return;
        }
        let step = match &mut self.cubic {
            Some(cubic) => cubic.step(now, self.window, acked),
            None => self.window,
        };
        // The count may have been collected at a larger step. The window then grows by one segment only, as in Linux.
        if self.count >= step {
            self.count = 0;
            self.window = self.window.saturating_add(1);
        }
        self.count += acked;
        if self.count >= step {
            self.window = self.window.saturating_add(self.count / step);
            self.count %= step;
        }
    }

    /// Returns whether the window limits the sender, which is the condition for growth (RFC 7661 in the form of Linux).
    fn is_limited(&self) -> bool {
        // In slow start a window that is more than half used counts as limiting, because the window may double within a round trip.
        self.is_limiting || (self.is_slow_start() && self.window < self.most_out.saturating_mul(2))
    }

    /// Notes the use of the window: segments up to `next` have been sent, positions from `una` on and `out` segments are unacknowledged. `is_limiting` says
    /// whether the window has held back more.
    pub(crate) fn used(&mut self, una: Position, next: Position, out: u32, is_limiting: bool) {
        if una >= self.usage_end || is_limiting || (!self.is_limiting && out > self.most_out) {
            (self.is_limiting, self.most_out, self.usage_end) = (is_limiting, out, next);
        }
    }

    /// Moves the beginning of CUBIC's curve by a pause of `idle` in sending.
    pub(crate) fn shift(&mut self, idle: Duration) {
        if let Some(cubic) = &mut self.cubic {
            cubic.shift(idle);
        }
    }

    /// Shrinks the window after a pause of `idle` in sending (RFC 2861): by half for each timeout, down to the initial window. `threshold` is the threshold to
    /// keep.
    pub(crate) fn rest(&mut self, idle: Duration, timeout: Duration, threshold: u32) {
        if idle <= timeout {
            return;
        }
        let least = self.initial.min(self.window);
        // The threshold keeps three quarters of the window, so that slow start returns there if the path has not changed.
        self.threshold = threshold;
        let mut rest = idle.saturating_sub(timeout);
        while !rest.is_zero() && self.window > least {
            self.window /= 2;
            rest = rest.saturating_sub(timeout);
        }
        self.window = self.window.max(least);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `tcp_cwnd_restart`: half for each timeout, down to the initial window, and a threshold of three quarters of the window before the pause.
    #[test]
    fn a_pause_shrinks_the_window_and_keeps_the_threshold() {
        let timeout = Duration::from_millis(200);
        for (idle, window) in [(200, 100), (201, 50), (401, 25), (601, 12), (801, 10), (10_000, 10)] {
            let mut congestion = Congestion::new(&TcpConfig::default());
            congestion.window = 100;
            congestion.rest(Duration::from_millis(idle), timeout, 75);
            assert_eq!((congestion.window, congestion.threshold), (window, if idle > 200 { 75 } else { UNBOUNDED }), "{idle} ms");
        }
    }
}
