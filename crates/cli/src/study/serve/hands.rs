//! Hands of the people, with connection, visibility and round trips of each browser. Written by the threads of the server, and read by the real-time thread
//! without waiting.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant as Clock};

use cohaptic_device::Device;
use cohaptic_live::pointers::Pointer;
use cohaptic_study::{Fault, RoundTrip};

use super::lock;

/// Time without a word of a page after which its pointer counts as silent.
const SILENCE: Duration = Duration::from_secs(1);

/// Hand and browser of one person.
pub(super) struct Hand {
    /// Instant from which `heard` counts.
    begun: Clock,
    is_connected: AtomicBool,
    is_hidden: AtomicBool,
    /// `true` if the connection was lost since the beginning of the trial.
    was_lost: AtomicBool,
    /// `true` if the page was hidden since the beginning of the trial.
    was_hidden: AtomicBool,
    /// Time of the last word of the page, since `begun` \[ms\].
    heard: AtomicU64,
    pointer: Mutex<Pointer>,
    trips: Mutex<Vec<Duration>>,
}

// Each flag is read alone, and no other memory depends on a flag, so that `Relaxed` suffices everywhere.
impl Hand {
    pub(super) fn new(begun: Clock) -> Self {
        let no = || AtomicBool::new(false);
        Self {
            begun,
            is_connected: no(),
            is_hidden: no(),
            was_lost: no(),
            was_hidden: no(),
            heard: AtomicU64::new(0),
            pointer: Mutex::default(),
            trips: Mutex::default(),
        }
    }

    /// Takes the seat of the person for a page. Returns `false` if another page has the seat.
    pub(super) fn connect(&self) -> bool {
        let is_free = !self.is_connected.swap(true, Ordering::Relaxed);
        if is_free {
            self.is_hidden.store(false, Ordering::Relaxed);
        }
        is_free
    }

    pub(super) fn disconnect(&self) {
        // Letting go has no position to refuse.
        let _ = lock(&self.pointer).tell(None);
        self.was_lost.store(true, Ordering::Relaxed);
        self.is_connected.store(false, Ordering::Relaxed);
    }

    pub(super) fn is_connected(&self) -> bool {
        self.is_connected.load(Ordering::Relaxed)
    }

    pub(super) fn is_hidden(&self) -> bool {
        self.is_hidden.load(Ordering::Relaxed)
    }

    pub(super) fn hide(&self, is_hidden: bool) {
        self.is_hidden.store(is_hidden, Ordering::Relaxed);
        if is_hidden {
            self.was_hidden.store(true, Ordering::Relaxed);
        }
    }

    /// Notes that the page said something at the instant `now`.
    pub(super) fn hear(&self, now: Clock) {
        let millis = u64::try_from(now.saturating_duration_since(self.begun).as_millis()).unwrap_or(u64::MAX);
        self.heard.store(millis, Ordering::Relaxed);
    }

    /// Moves the pointer.
    pub(super) fn tell(&self, position: Option<[f64; 3]>) -> Result<(), String> {
        lock(&self.pointer).tell(position).map_err(|error| error.to_string())
    }

    pub(super) fn round_trip(&self, took: Duration) {
        lock(&self.trips).push(took);
    }

    /// Returns the latest round trip; `None` before the first.
    pub(super) fn latest_trip(&self) -> Option<Duration> {
        lock(&self.trips).last().copied()
    }

    /// Begins a trial at the instant `now`, and returns the pointer as a device of the trial's session. The pointer is new, because each trial begins at the
    /// same place.
    pub(super) fn begin(&self, now: Clock) -> Box<dyn Device> {
        self.was_lost.store(!self.is_connected(), Ordering::Relaxed);
        self.was_hidden.store(self.is_hidden(), Ordering::Relaxed);
        lock(&self.trips).clear();
        self.hear(now);
        let mut pointer = lock(&self.pointer);
        *pointer = Pointer::default();
        pointer.device()
    }

    /// Returns the fault of the trial on the side of this person, at the instant `now`; `None` for a valid trial so far.
    pub(super) fn fault(&self, now: Clock) -> Option<Fault> {
        let heard = self.begun + Duration::from_millis(self.heard.load(Ordering::Relaxed));
        if self.was_lost.load(Ordering::Relaxed) {
            Some(Fault::LostPartner)
        } else if self.was_hidden.load(Ordering::Relaxed) {
            Some(Fault::HiddenPage)
        } else {
            (now > heard + SILENCE).then_some(Fault::SilentPointer)
        }
    }

    /// Returns median and 99th percentile of the round trips of the trial, by nearest rank; `None` if there was none.
    pub(super) fn round_trips(&self) -> Option<RoundTrip> {
        let mut trips = lock(&self.trips).clone();
        trips.sort_unstable();
        let rank = |percent: usize| trips.get((trips.len() * percent).div_ceil(100).saturating_sub(1)).map(Duration::as_secs_f64);
        Some(RoundTrip { p50_s: rank(50)?, p99_s: rank(99)? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn a_trial_is_not_valid_once_a_page_was_hidden_lost_or_silent() {
        let begun = Clock::now();
        let hand = Hand::new(begun);
        assert!(hand.connect() && !hand.connect());
        drop(hand.begin(begun));
        // The documentation promises one second.
        assert_eq!(hand.fault(begun + 1000 * MS), None);
        assert_eq!(hand.fault(begun + 1001 * MS), Some(Fault::SilentPointer));
        hand.hear(begun + 500 * MS);
        assert_eq!(hand.fault(begun + SILENCE + 500 * MS), None);
        // A page that was hidden for a moment counts, and so does a connection that came back.
        hand.hide(true);
        hand.hide(false);
        assert_eq!(hand.fault(begun), Some(Fault::HiddenPage));
        hand.disconnect();
        assert!(hand.connect());
        assert_eq!(hand.fault(begun), Some(Fault::LostPartner));
        drop(hand.begin(begun + 600 * MS));
        assert_eq!(hand.fault(begun + 600 * MS + SILENCE), None);
        hand.disconnect();
        drop(hand.begin(begun));
        assert_eq!(hand.fault(begun), Some(Fault::LostPartner), "it was lost before the trial");
    }

    #[test]
    fn percentiles_are_those_of_the_nearest_rank() {
        let hand = Hand::new(Clock::now());
        assert!(hand.round_trips().is_none());
        for millis in (1..=200).rev() {
            hand.round_trip(millis * MS);
        }
        let trips = hand.round_trips().unwrap();
        assert!((trips.p50_s - 0.1).abs() < 1e-12 && (trips.p99_s - 0.198).abs() < 1e-12, "{trips:?}");
        assert_eq!(hand.latest_trip(), Some(MS));
        drop(hand.begin(Clock::now()));
        hand.round_trip(7 * MS);
        assert!((hand.round_trips().unwrap().p99_s - 0.007).abs() < 1e-12);
    }
}
