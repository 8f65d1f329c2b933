//! The turns of guests: their requests are answered one after the other, so that all guests together do not take the whole time of the server's thread.

use core::time::Duration;
use std::sync::{Mutex, PoisonError};

use tokio::time::{Instant, sleep_until};

/// A guest's request begins that long after the one before it at the earliest. A page asks for four things when it is opened.
const EVERY: Duration = Duration::from_millis(5);

/// Turns, one every [`EVERY`].
#[derive(Debug, Default)]
pub(crate) struct Pace {
    /// When the next turn may be; `None` before the first one.
    next: Mutex<Option<Instant>>,
}

impl Pace {
    /// Waits for a turn.
    pub(super) async fn turn(&self) {
        sleep_until(self.reserve(Instant::now())).await;
    }

    fn reserve(&self, now: Instant) -> Instant {
        let mut next = self.next.lock().unwrap_or_else(PoisonError::into_inner);
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
