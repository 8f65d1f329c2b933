//! Whether so much passes that looking at every datagram by itself costs more than it is worth.

use core::time::Duration;

use cohaptic_units::Instant;

/// How much came in and left lately.
#[derive(Clone, Copy, Debug)]
pub(super) struct Density {
    since: Instant,
    work: u64,
    is_dense: bool,
}

/// It is counted over at least so long.
const WINDOW: Duration = Duration::from_millis(1);

/// Datagrams a millisecond, in and out: 20,000 a second that pass.
const DENSE: u64 = 40;

impl Density {
    /// When it is dense, so much time passes between two looks, so that what leaves together goes in one call of the kernel. A datagram is later by as much at
    /// most; of 250,000 a second, each took 2.1 µs of processor time in place of 3.3 µs.
    pub(super) const REST: Duration = Duration::from_micros(50);

    pub(super) const fn new() -> Self {
        Self { since: Instant::ZERO, work: 0, is_dense: false }
    }

    /// So many came in or left.
    #[inline]
    pub(super) fn note(&mut self, now: Instant, count: u64) {
        self.work += count;
        let span = now.saturating_duration_since(self.since);
        if span >= WINDOW {
            self.is_dense = u128::from(self.work) * WINDOW.as_nanos() >= u128::from(DENSE) * span.as_nanos();
            (self.since, self.work) = (now, 0);
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
                // One in, one out.
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
