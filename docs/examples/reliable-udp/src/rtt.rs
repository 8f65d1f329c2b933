//! How long to wait for an acknowledgement (RFC 6298).

use std::time::Duration;

/// Before anything is known: RFC 6298 says a second, RFC 1122 said three. Three are more than the way there and back takes anywhere.
const FIRST: Duration = Duration::from_secs(3);
/// It is at least so much longer than the way there and back takes.
const LEAST_MARGIN: Duration = Duration::from_secs(1);
const MOST: Duration = Duration::from_secs(60);

/// How long the way there and back takes, smoothed, and how much that varies.
pub(crate) struct Rtt {
    smoothed: Option<(Duration, Duration)>,
    backoff: u32,
}

impl Rtt {
    pub(crate) const fn new() -> Self {
        Self { smoothed: None, backoff: 0 }
    }

    /// Transmissions have numbers of their own, so that it is always clear which one was acknowledged.
    pub(crate) fn sample(&mut self, rtt: Duration) {
        self.backoff = 0;
        self.smoothed =
            Some(self.smoothed.map_or((rtt, rtt / 2), |(mean, deviation)| (mean * 7 / 8 + rtt / 8, deviation * 3 / 4 + mean.abs_diff(rtt) / 4)));
    }

    pub(crate) fn back_off(&mut self) {
        self.backoff = (self.backoff + 1).min(6);
    }

    pub(crate) fn timeout(&self) -> Duration {
        let timeout = self.smoothed.map_or(FIRST, |(mean, deviation)| mean + (deviation * 4).max(LEAST_MARGIN));
        (timeout * 2_u32.pow(self.backoff)).min(MOST)
    }
}
