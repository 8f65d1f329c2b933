//! `HyStart`: leaves slow start before a loss, when acknowledgements come in a train of half a round trip, or the round trip grows (Ha & Rhee 2011), with the
//! constants of Linux (`tcp_cubic`).

use core::time::Duration;

use cohaptic_units::Instant;

use crate::pace::Pace;
use crate::sequence::Position;

/// Least window at which slow start may be left \[segments\] (`hystart_low_window`).
const LOW_WINDOW: u32 = 16;

/// Longest time between two acknowledgements of a train (`hystart_ack_delta_us`).
const IN_TRAIN: Duration = Duration::from_millis(2);

/// Number of samples after which the least round trip of a round counts.
const SAMPLES: u8 = 8;

/// Bounds of the growth of the round trip that ends slow start. Between them, an eighth of the least round trip.
const LEAST_GROWTH: Duration = Duration::from_millis(4);
const MOST_GROWTH: Duration = Duration::from_millis(16);

/// Search for the end of slow start. A round lasts from the acknowledgement of one flight to the acknowledgement of the next flight.
#[derive(Clone, Default, Debug)]
pub(super) struct HyStart {
    /// `true` once slow start was left. A timeout begins the search anew.
    found: bool,
    /// Present round. `None` before the first.
    round: Option<Round>,
}

#[derive(Clone, Debug)]
struct Round {
    begin: Instant,
    /// Instant of the last acknowledgement of the train that began with the round.
    last: Instant,
    /// End of the data sent when the round began.
    end: Position,
    /// Least round trip in the round.
    least: Duration,
    /// Number of samples in the round, at most [`SAMPLES`].
    samples: u8,
}

/// Sample of the round trip from an acknowledgement, with the positions that tell rounds apart and the time that tells trains apart.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RoundTrip {
    /// Time since the last acknowledged segment was sent.
    pub(crate) latest: Duration,
    /// First unacknowledged position.
    pub(crate) una: Position,
    /// First position that was never sent.
    pub(crate) next: Position,
    /// Rate of the sender, which tells the time by which acknowledgements of one burst may be apart.
    pub(crate) pace: Pace,
}

impl HyStart {
    /// Takes a sample in slow start at the window `window`. `least` is the least round trip so far. Returns whether slow start ends here.
    pub(super) fn ends(&mut self, now: Instant, window: u32, least: Duration, sample: RoundTrip) -> bool {
        if self.found {
            return false;
        }
        let is_over = self.round.as_ref().is_none_or(|round| sample.una > round.end);
        if is_over {
            self.round = Some(Round { begin: now, last: now, end: sample.next, least: Duration::MAX, samples: 0 });
        }
        let Some(round) = self.round.as_mut().filter(|_| window >= LOW_WINDOW) else { return false };
        if now.saturating_duration_since(round.last) <= IN_TRAIN {
            round.last = now;
            // A train that is as long as half a round trip fills the path in one direction.
            let length = now.saturating_duration_since(round.begin);
            // The margin takes divisions, and most trains are far shorter.
            self.found |= length > least / 2 && length > (least + sample.pace.margin()) / 2;
        }
        round.least = round.least.min(sample.latest);
        if round.samples < SAMPLES {
            round.samples += 1;
        } else {
            self.found |= round.least > least + (least / 8).clamp(LEAST_GROWTH, MOST_GROWTH);
        }
        self.found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LEAST: Duration = Duration::from_millis(100);

    /// Returns the index of the acknowledgement that ends slow start, of `count` acknowledgements `apart` with `latest` as round trip and `least` as the
    /// least round trip.
    fn ends_after(window: u32, count: u64, apart: Duration, latest: Duration, least: Duration) -> Option<u64> {
        let mut hystart = HyStart::default();
        let sample = RoundTrip { latest, una: 1, next: 1_000_000, pace: Pace::new(0, 100, 1) };
        let mut ends = |k: &u64| hystart.ends(Instant::ZERO + apart * u32::try_from(*k).unwrap(), window, least, sample);
        let index = (0..count).find(&mut ends);
        // Slow start ends once: the search does not begin anew before a timeout.
        assert_eq!(index.and_then(|index| (index + 1..index + count).find(ends)), None);
        index
    }

    fn ends_at(window: u32, count: u64, apart: Duration, latest: Duration) -> Option<u64> {
        ends_after(window, count, apart, latest, LEAST)
    }

    #[test]
    fn a_train_of_half_a_round_trip_ends_slow_start() {
        // (100 ms + 1 ms)/2 = 50.5 ms: the 51st millisecond is the first one beyond.
        assert_eq!(ends_at(16, 200, Duration::from_millis(1), LEAST), Some(51));
        assert_eq!(ends_at(16, 200, Duration::from_millis(2), LEAST), Some(26));
        // Acknowledgements each 500 µs: the 102nd comes at 51 ms, the 101st at 50.5 ms, which is above half of the round trip without the length of a burst.
        assert_eq!(ends_at(16, 200, Duration::from_micros(500), LEAST), Some(102));
        // A gap of more than 2 ms is no train, and a window below 16 is left alone.
        assert_eq!(ends_at(16, 200, Duration::from_micros(2001), LEAST), None);
        assert_eq!(ends_at(15, 200, Duration::from_millis(1), LEAST), None);
    }

    #[test]
    fn a_round_trip_that_grows_by_an_eighth_ends_slow_start_after_eight_samples() {
        let grown = LEAST + Duration::from_micros(12_501);
        assert_eq!(ends_at(16, 200, Duration::from_millis(3), grown), Some(8));
        assert_eq!(ends_at(16, 200, Duration::from_millis(3), LEAST + Duration::from_micros(12_500)), None);
        // The growth is at least 4 ms and at most 16 ms: an eighth of 16 ms is 2 ms, and an eighth of 200 ms is 25 ms.
        for (least, growth) in [(16, 4), (200, 16)] {
            let (least, grown) = (Duration::from_millis(least), Duration::from_millis(least + growth));
            assert_eq!(ends_after(16, 200, Duration::from_millis(3), grown, least), None);
            assert_eq!(ends_after(16, 200, Duration::from_millis(3), grown + Duration::from_micros(1), least), Some(8));
        }
    }
}
