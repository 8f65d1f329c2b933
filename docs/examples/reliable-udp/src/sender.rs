//! What the sender knows and decides, without sockets and clocks.

use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

use cohaptic_testkit::Instant;

use crate::rtt::Rtt;

/// So many transmissions are on their way at most.
const WINDOW: usize = 16;
/// The next one leaves so much later, so that the network is not flooded.
const PACE: Duration = Duration::from_micros(100);
/// A transmission is lost if one was acknowledged that was sent so many later: as in QUIC (RFC 9002, 6.1.1).
const REORDERED: u32 = 3;

/// What the sender knows.
pub struct Sender<const FIXED: bool> {
    /// The messages that wait to be sent, or sent again: the smallest first.
    waiting: VecDeque<u32>,
    /// The transmissions that are on their way, by number.
    in_flight: BTreeMap<u32, InFlight>,
    /// Those that were given up, with their message: its acknowledgement may still come.
    given_up: BTreeMap<u32, u32>,
    next_number: u32,
    next_at: Instant,
    rtt: Rtt,
}

struct InFlight {
    message: u32,
    sent: Instant,
}

impl<const FIXED: bool> Sender<FIXED> {
    /// A sender of so many messages.
    pub fn new(messages: u32, now: Instant) -> Self {
        let (in_flight, given_up) = (BTreeMap::new(), BTreeMap::new());
        Self { waiting: (0..messages).collect(), in_flight, given_up, next_number: 0, next_at: now, rtt: Rtt::new() }
    }

    /// What is to be sent now: the number of the transmission, and the message.
    pub fn next(&mut self, now: Instant) -> Option<(u32, u32)> {
        if now < self.next_at || self.in_flight.len() >= WINDOW {
            return None;
        }
        let message = self.waiting.pop_front()?;
        let number = self.next_number;
        self.next_number += 1;
        self.next_at = now + PACE;
        self.in_flight.insert(number, InFlight { message, sent: now });
        Some((number, message))
    }

    /// When there will be something to do; `None` if all is done.
    pub fn wake(&self) -> Option<Instant> {
        let can_send = !self.waiting.is_empty() && self.in_flight.len() < WINDOW;
        let overdue = self.in_flight.values().map(|transmission| transmission.sent + self.rtt.timeout()).min();
        can_send.then_some(self.next_at).into_iter().chain(overdue).min()
    }

    /// Gives up the transmissions that should have been acknowledged by now.
    pub fn give_up_overdue(&mut self, now: Instant) {
        let timeout = self.rtt.timeout();
        let overdue: Vec<u32> =
            self.in_flight.iter().filter(|(_, transmission)| transmission.sent + timeout <= now).map(|(number, _)| *number).collect();
        if !overdue.is_empty() {
            self.rtt.back_off();
        }
        overdue.into_iter().for_each(|number| self.give_up(number));
    }

    /// A transmission was acknowledged.
    pub fn acknowledge(&mut self, now: Instant, number: u32) {
        if let Some(transmission) = self.in_flight.remove(&number) {
            self.rtt.sample(now.saturating_duration_since(transmission.sent));
            // Those that were sent well before it are lost.
            let lost: Vec<u32> = self.in_flight.range(..(number + 1).saturating_sub(REORDERED)).map(|(number, _)| *number).collect();
            lost.into_iter().for_each(|number| self.give_up(number));
        } else if let Some(message) = self.given_up.remove(&number) {
            // It was only late: its message need not be sent again.
            match self.waiting.binary_search(&message) {
                Ok(place) => drop(self.waiting.remove(place)),
                // It has been sent again already.
                Err(_) if FIXED => {}
                // The planted bug: what stands in its place is another message, which is never sent.
                Err(place) => drop(self.waiting.remove(place)),
            }
        }
    }

    /// The message of that transmission waits to be sent again.
    fn give_up(&mut self, number: u32) {
        let Some(InFlight { message, .. }) = self.in_flight.remove(&number) else { return };
        self.given_up.insert(number, message);
        if let Err(place) = self.waiting.binary_search(&message) {
            self.waiting.insert(place, message);
        }
    }
}
