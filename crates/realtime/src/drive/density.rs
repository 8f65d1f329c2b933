//! Rate of packets in the recent past, for the decision whether the loop rests.

use std::time::Duration;

use cohaptic_units::Instant;

/// Packets in and out since the beginning of a window, and the verdict on the previous window.
#[derive(Clone, Copy, Debug)]
pub(super) struct Density {
    /// Beginning of the window.
    since: Instant,
    /// Packets in and out since then.
    packets: u64,
    /// `true` if the previous window had at least [`DENSE`] packets per [`WINDOW`].
    is_dense: bool,
}

/// Least length of a window. A window ends with the first count after this time.
const WINDOW: Duration = Duration::from_millis(1);

/// Packets in and out per [`WINDOW`] from which on traffic is dense. A packet that passes counts twice, so this is 20,000 passing packets a second.
const DENSE: u64 = 40;

impl Density {
    pub(super) const fn new() -> Self {
        Self { since: Instant::ZERO, packets: 0, is_dense: false }
    }

    /// Counts arriving or leaving packets, at the instant `now`.
    pub(super) fn note(&mut self, now: Instant, packets: u64) {
        self.packets += packets;
        let span = now.saturating_duration_since(self.since);
        // The window may have lasted longer than `WINDOW`, so rates are compared, not counts. The products need 128 bits.
        if span >= WINDOW {
            self.is_dense = u128::from(self.packets) * WINDOW.as_nanos() >= u128::from(DENSE) * span.as_nanos();
            (self.since, self.packets) = (now, 0);
        }
    }

    pub(super) const fn is_dense(&self) -> bool {
        self.is_dense
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_dense_from_twenty_thousand_a_second_on_and_not_after_a_silence() {
        let mut density = Density::new();
        let mut now = 0;
        let mut pass = |micros: u64, count: u64| {
            for _ in 0..count {
                now += micros * 1000;
                // Each packet arrives and leaves.
                density.note(Instant::from_nanos(now), 2);
            }
            density.is_dense()
        };
        assert!(!pass(200, 100), "5,000 a second");
        assert!(pass(50, 100), "20,000 a second");
        assert!(!pass(10_000, 1));
        assert!(pass(4, 1000));
        assert!(!pass(60, 100));
    }
}
