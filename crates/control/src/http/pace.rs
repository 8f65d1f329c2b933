//! Turns of guests: requests of guests are answered one at a time with pauses, so that all guests together leave time for the host.

use core::time::Duration;
use std::sync::{Mutex, PoisonError};

use tokio::time::{Instant, sleep_until};

/// Shortest time between the beginnings of two guests' requests. A page sends four requests when opened.
const EVERY: Duration = Duration::from_millis(5);

/// Queue of turns, [`EVERY`] apart.
#[derive(Debug, Default)]
pub(crate) struct Pace {
    /// Earliest instant of the next turn; `None` before the first.
    next: Mutex<Option<Instant>>,
}

impl Pace {
    /// Waits for the next free turn.
    pub(super) async fn turn(&self) {
        // The turn is reserved first. The wait is without the lock, so that turns come in the order of arrival.
        sleep_until(self.reserve(Instant::now())).await;
    }

    /// Reserves a turn and returns its instant, `now` or later.
    fn reserve(&self, now: Instant) -> Instant {
        let mut next = self.next.lock().unwrap_or_else(PoisonError::into_inner);
        // Unused turns are not saved up: after a pause the next turn is now.
        let turn = next.map_or(now, |next| next.max(now));
        *next = Some(turn + EVERY);
        turn
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_follow_each_other_and_nobody_saves_them_up() {
        let (pace, now) = (Pace::default(), Instant::now());
        assert_eq!([0, 0, 1, 7].map(|millis| pace.reserve(now + Duration::from_millis(millis)) - now), [0, 5, 10, 15].map(Duration::from_millis));
        let later = now + Duration::from_secs(1);
        assert_eq!([(); 2].map(|()| pace.reserve(later)), [later, later + EVERY]);
    }
}
