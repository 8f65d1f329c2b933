//! Round trips of a page: the time from a ping of the server until the browser's answer. Browsers answer pings by themselves (RFC 6455, section 5.5.3).

use core::time::Duration;
use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};

use axum::body::Bytes;
use tokio::time::Instant;

/// Time without an answer after which a browser counts as gone. The connection of a phone that went to sleep stays open, and would keep the person's place.
const SILENCE: Duration = Duration::from_secs(3);
/// Greatest number of pings without an answer that are remembered. Pings further back count as lost.
const REMEMBERED: usize = 256;

/// Pings of a connection.
pub(super) struct RoundTrips {
    every: Duration,
    pings: Mutex<Pings>,
}

struct Pings {
    /// Number of the next ping. The content of a ping is its number.
    next: u64,
    /// Instant of the latest ping; `None` before the first.
    latest: Option<Instant>,
    /// Pings without an answer, with their numbers, in order of sending.
    open: VecDeque<(u64, Instant)>,
    /// Instant of the latest answer, at first that of the connection.
    heard: Instant,
}

impl RoundTrips {
    /// Begins with the connection, at the instant `now`. A ping is due each `every`.
    pub(super) fn new(every: Duration, now: Instant) -> Self {
        Self { every, pings: Mutex::new(Pings { next: 0, latest: None, open: VecDeque::new(), heard: now }) }
    }

    /// Begins a round trip, if due, and returns the content of the ping.
    pub(super) fn begin(&self, now: Instant) -> Option<Bytes> {
        let mut pings = self.pings();
        if pings.latest.is_some_and(|latest| now < latest + self.every) {
            return None;
        }
        let number = pings.next;
        (pings.next, pings.latest) = (number + 1, Some(now));
        // The list is bounded, because pings stay open without an answer, and a short `every` opens many before the silence ends the connection.
        if pings.open.len() == REMEMBERED {
            pings.open.pop_front();
        }
        pings.open.push_back((number, now));
        Some(Bytes::copy_from_slice(&number.to_be_bytes()))
    }

    /// Ends the round trip of an answer, and returns the time of the trip. `None` for an answer to no open ping.
    pub(super) fn end(&self, echo: &[u8], now: Instant) -> Option<Duration> {
        // A page may send any Pong, also unasked and of any length, so the content is not trusted to be a number of a ping.
        let number = u64::from_be_bytes(echo.try_into().ok()?);
        let mut pings = self.pings();
        let at = pings.open.iter().position(|(open, _)| *open == number)?;
        let (_, sent) = pings.open[at];
        // A browser may answer only the latest of several pings, so that earlier pings are closed too.
        pings.open.drain(..=at);
        pings.heard = now;
        Some(now - sent)
    }

    /// Returns whether the browser has answered nothing for [`SILENCE`].
    pub(super) fn is_silent(&self, now: Instant) -> bool {
        now > self.pings().heard + SILENCE
    }

    fn pings(&self) -> MutexGuard<'_, Pings> {
        self.pings.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn a_trip_takes_from_its_ping_to_the_answer() {
        let begun = Instant::now();
        let trips = RoundTrips::new(100 * MS, begun);
        let first = trips.begin(begun).unwrap();
        assert_eq!(trips.begin(begun + 99 * MS), None, "the next ping is not due");
        let second = trips.begin(begun + 100 * MS).unwrap();
        let answered = begun + 130 * MS;
        assert_eq!([trips.end(b"something", answered), trips.end(&[9; 8], answered)], [None, None], "no such ping");
        assert_eq!(trips.end(&second, answered), Some(30 * MS));
        assert_eq!(
            [trips.end(&second, answered), trips.end(&first, answered)],
            [None, None],
            "a ping has one answer, and none after that of a later ping"
        );
    }

    #[test]
    fn a_browser_that_answers_nothing_is_gone() {
        let begun = Instant::now();
        let trips = RoundTrips::new(100 * MS, begun);
        let ping = trips.begin(begun).unwrap();
        assert!(!trips.is_silent(begun + SILENCE));
        assert!(trips.is_silent(begun + SILENCE + MS));
        trips.end(&ping, begun + SILENCE + MS).unwrap();
        assert!(!trips.is_silent(begun + 2 * SILENCE));
    }
}
