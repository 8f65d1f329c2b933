//! Counts of the samples of one sender at a joined peer.

use cohaptic_units::Instant;

use super::ClockDrift;

/// Samples of a sender so far.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct HeardSender {
    /// Samples newer than all samples before.
    pub taken: u64,
    /// Samples received after a later sample, and repeated samples.
    pub late: u64,
    /// Arrival of the newest sample on the clock of this program; `None` before the first.
    pub latest: Option<Instant>,
    /// Drift of the clock of this program against the clock of the sender.
    pub drift: ClockDrift,
    /// Samples lost in the counts before the present count.
    lost_before: u64,
    /// Present count of the sender; `None` before its first sample.
    count: Option<Count>,
}

/// Numbers of a sender since the beginning of a count.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Count {
    first: u64,
    newest: u64,
    came: u64,
}

impl Count {
    const fn lost(self) -> u64 {
        (self.newest - self.first + 1).saturating_sub(self.came)
    }
}

impl HeardSender {
    /// Takes a sample newer than all samples of the sender before.
    pub(super) fn take(&mut self, at: Instant, sequence: u64, sent: Instant) {
        self.taken += 1;
        self.latest = Some(at);
        self.count = Some(match self.count {
            Some(Count { first, newest, came }) if sequence > newest => Count { first, newest: sequence, came: came + 1 },
            // The first sample, or a session that was started again and counts anew. The clock of that session began anew, too.
            earlier => {
                self.lost_before += earlier.map_or(0, Count::lost);
                self.drift = ClockDrift::default();
                Count { first: sequence, newest: sequence, came: 1 }
            }
        });
        self.drift.note(at, sent);
    }

    /// Counts a sample older than the newest sample, or a repetition.
    pub(super) const fn come_late(&mut self) {
        self.late += 1;
        if let Some(count) = &mut self.count {
            count.came += 1;
        }
    }

    /// Returns the number of lost samples, as far as the numbers tell: losses of the links of the scene and of the network between the computers.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.lost_before + self.count.map_or(0, Count::lost)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_numbers_are_lost_until_they_come_late() {
        let mut heard = HeardSender::default();
        let at = Instant::from_nanos;
        for number in [10, 11, 15] {
            heard.take(at(number), number, at(number));
        }
        assert_eq!((heard.taken, heard.lost()), (3, 3));
        heard.come_late();
        assert_eq!((heard.taken, heard.late, heard.lost()), (3, 1, 2));
        // The session begins anew and counts from 0.
        heard.take(at(20), 0, at(0));
        heard.take(at(21), 2, at(1));
        assert_eq!(heard.lost(), 3);
    }

    /// Passes samples of 8 ms for 25 s to `heard`. The own clock shows `began` \[ns\] when the sender's clock shows 0, and runs faster by `ppm`.
    fn listen(heard: &mut HeardSender, began: u64, ppm: i64) {
        for number in 0..3125 {
            let sent = number * 8_000_000;
            let gained = i64::try_from(sent / 1_000_000).unwrap() * ppm;
            heard.take(Instant::from_nanos((began + sent).checked_add_signed(gained).unwrap()), number, Instant::from_nanos(sent));
        }
    }

    #[test]
    fn the_drift_of_a_sender_is_found_and_counts_anew_after_a_restart_of_the_session() {
        let mut heard = HeardSender::default();
        let expect = |heard: &HeardSender, ppm: f64| {
            let found = heard.drift.ppm().unwrap();
            assert!((found - ppm).abs() < 0.01, "{found} in place of {ppm}");
        };
        listen(&mut heard, 1_000_000_000, 50);
        expect(&heard, 50.0);
        // The session began anew, at another offset between the clocks and with another clock.
        listen(&mut heard, 40_000_000_000, -30);
        expect(&heard, -30.0);
    }
}
