//! How many segments may be on the way.

mod cubic;
mod reduction;

use core::time::Duration;

use cohaptic_units::Instant;

use crate::config::{CongestionControl, TcpConfig};
use crate::sequence::Position;
use cubic::Cubic;
pub(crate) use reduction::Reduction;

/// No threshold yet.
pub(crate) const UNBOUNDED: u32 = u32::MAX;

/// The congestion window in segments, and how it grows (RFC 5681 with RFC 3465's counting of acknowledged segments, without its limit, as Linux).
#[derive(Clone, Debug)]
pub(crate) struct Congestion {
    pub(crate) window: u32,
    pub(crate) threshold: u32,
    /// Segments acknowledged towards the next increase.
    count: u32,
    cubic: Option<Cubic>,
    initial: u32,
    /// Whether the window, not the program, held the last flight back, how large that was, and where it ends.
    is_limiting: bool,
    most_out: u32,
    usage_end: Position,
}

impl Congestion {
    pub(crate) fn new(config: &TcpConfig) -> Self {
        let cubic = (config.congestion == CongestionControl::Cubic).then(Cubic::default);
        let window = config.initial_window;
        Self { window, threshold: UNBOUNDED, count: 0, cubic, initial: window, is_limiting: false, most_out: 0, usage_end: 0 }
    }

    pub(crate) const fn is_slow_start(&self) -> bool {
        self.window < self.threshold
    }

    /// The threshold after a loss; from here on growth begins anew.
    pub(crate) fn reduced(&mut self) -> u32 {
        self.count = 0;
        match &mut self.cubic {
            Some(cubic) => cubic.reduced(self.window),
            None => (self.window / 2).max(2),
        }
    }

    /// A timeout: one segment, and what was learnt about the path is forgotten.
    pub(crate) fn restart(&mut self, window: u32) {
        self.window = window.max(1);
        if let Some(cubic) = &mut self.cubic {
            *cubic = Cubic::default();
        }
    }

    /// Segments were acknowledged while nothing is amiss.
    pub(crate) fn grow(&mut self, now: Instant, acked: u32, least_rtt: Duration) {
        if !self.is_limited() {
            return;
        }
        let mut acked = acked;
        if self.is_slow_start() {
            let grown = self.window.saturating_add(acked).min(self.threshold);
            acked -= grown - self.window;
            self.window = grown;
        }
        if acked == 0 {
            return;
        }
        let step = match &mut self.cubic {
            Some(cubic) => cubic.step(now, self.window, acked, least_rtt),
            None => self.window,
        };
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

    /// Whether it was the window that held the sender back: only then may it grow (RFC 7661 in the form of Linux).
    fn is_limited(&self) -> bool {
        self.is_limiting || (self.is_slow_start() && self.window < self.most_out.saturating_mul(2))
    }

    /// Segments have left up to `next`: `out` are unacknowledged, and `is_limiting` says whether the window held more back.
    pub(crate) fn used(&mut self, una: Position, next: Position, out: u32, is_limiting: bool) {
        if una >= self.usage_end || is_limiting || (!self.is_limiting && out > self.most_out) {
            (self.is_limiting, self.most_out, self.usage_end) = (is_limiting, out, next);
        }
    }

    /// Nothing was sent for `idle` (RFC 2861): half for each timeout, down to the initial window.
    pub(crate) fn rest(&mut self, idle: Duration, timeout: Duration) {
        if let Some(cubic) = &mut self.cubic {
            cubic.shift(idle);
        }
        if idle <= timeout {
            return;
        }
        let least = self.initial.min(self.window);
        self.threshold = self.threshold.max(self.window / 4 * 3);
        let mut rest = idle.saturating_sub(timeout);
        while !rest.is_zero() && self.window > least {
            self.window /= 2;
            rest = rest.saturating_sub(timeout);
        }
        self.window = self.window.max(least);
    }
}
