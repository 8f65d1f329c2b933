//! One seat: its holder, which numbers were seen, and whether it can be taken.

use core::time::Duration;
use std::net::SocketAddr;

use cohaptic_units::Instant;

use super::{JOININGS_END, Place, Refusal, SEQUENCE_BITS, Seat, Under};
use crate::seal::JoiningKeys;

/// What a seat is like at an instant.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SeatStatus<'a> {
    /// Its place.
    pub place: Place,
    /// The name of the peer in the scene.
    pub name: &'a str,
    /// Where the peer was heard from last; `None` if it never was.
    pub address: Option<SocketAddr>,
    /// When a sample of it was let in last; `None` if none ever was.
    pub heard: Option<Instant>,
    /// Whether that is less than `stale_after` ago.
    pub present: bool,
    /// How often the seat was taken.
    pub joinings: u64,
    /// How many samples were let in.
    pub admitted: u64,
}

/// A seat and its holder.
#[derive(Debug)]
pub(super) struct SeatState {
    seat: Seat,
    occupant: Option<Occupant>,
    joinings: u64,
    admitted: u64,
}

/// The holder of a seat, present or gone.
#[derive(Debug)]
pub(super) struct Occupant {
    pub(super) address: SocketAddr,
    /// `None` in a session without a key.
    pub(super) keys: Option<Box<JoiningKeys>>,
    heard: Instant,
    window: Window,
}

impl SeatState {
    pub(super) const fn free(seat: Seat) -> Self {
        Self { seat, occupant: None, joinings: 0, admitted: 0 }
    }

    pub(super) const fn place(&self) -> Place {
        self.seat.place
    }

    pub(super) const fn tick(&self) -> Duration {
        self.seat.tick
    }

    pub(super) const fn joinings(&self) -> u64 {
        self.joinings
    }

    pub(super) const fn occupant(&self) -> Option<&Occupant> {
        self.occupant.as_ref()
    }

    /// The holder of the seat, if heard lately.
    pub(super) fn present(&self, now: Instant, stale_after: Duration) -> Option<&Occupant> {
        self.occupant.as_ref().filter(|occupant| since(occupant.heard, now) < stale_after)
    }

    pub(super) fn status(&self, now: Instant, stale_after: Duration) -> SeatStatus<'_> {
        let Self { seat, occupant, joinings, admitted, .. } = self;
        SeatStatus {
            place: seat.place,
            name: &seat.name,
            address: occupant.as_ref().map(|occupant| occupant.address),
            heard: occupant.as_ref().map(|occupant| occupant.heard),
            present: self.present(now, stale_after).is_some(),
            joinings: *joinings,
            admitted: *admitted,
        }
    }

    /// Takes in a sample that is good in itself. Whether it took the seat.
    pub(super) fn take_or_keep(&mut self, now: Instant, stale_after: Duration, from: SocketAddr, number: u64, under: Under) -> Result<bool, Refusal> {
        let present = self.present(now, stale_after).is_some();
        let same_address = self.occupant.as_ref().is_some_and(|occupant| occupant.address == from);
        let keys = match under {
            // With a key, a joining lasts until the next one, however long the peer is silent. Without, it ends with the silence.
            Under::Present if self.occupant.as_ref().is_some_and(|occupant| occupant.keys.is_some()) => return self.keep(now, number),
            Under::Present if present && same_address => return self.keep(now, number),
            Under::Present => None,
            Under::New(keys) => Some(keys),
        };
        // New keys from the address of the holder: the same program has begun anew. Anybody else waits until he has gone.
        if present && !same_address {
            return Err(Refusal::SeatTaken);
        }
        if self.joinings == JOININGS_END {
            return Err(Refusal::JoiningsUsedUp);
        }
        self.joinings += 1;
        self.admitted += 1;
        self.occupant = Some(Occupant { address: from, keys, heard: now, window: Window::beginning_with(number) });
        Ok(true)
    }

    fn keep(&mut self, now: Instant, number: u64) -> Result<bool, Refusal> {
        let Some(occupant) = &mut self.occupant else { return Err(Refusal::NotJoined) };
        if !occupant.window.accept(number) {
            return Err(Refusal::Replayed);
        }
        occupant.heard = now;
        self.admitted += 1;
        Ok(false)
    }

    /// The number that a sample of the present joining has for those inside: it never goes back when the peer joins again. That of the first joining
    /// is unchanged.
    pub(super) const fn number_inside(&self, number: u64) -> u64 {
        self.joinings.saturating_sub(1) << SEQUENCE_BITS | number
    }
}

/// How long ago `then` was; nothing if it is yet to come.
const fn since(then: Instant, now: Instant) -> Duration {
    Duration::from_nanos(now.as_nanos().saturating_sub(then.as_nanos()))
}

/// How far behind the highest number one that is late is still let in, once.
pub const WINDOW: u32 = 128;

/// The numbers seen in one joining: a window of the last 128, as in RFC 4303, section 3.4.3.
#[derive(Clone, Copy, Debug)]
struct Window {
    highest: u64,
    /// Bit i: `highest` − i has been seen. Bit 0 is always set.
    seen: u128,
}

impl Window {
    /// After the first number of a joining, which may be any.
    const fn beginning_with(number: u64) -> Self {
        Self { highest: number, seen: 1 }
    }

    /// Whether that number may pass; from now on it is seen.
    const fn accept(&mut self, number: u64) -> bool {
        if number > self.highest {
            let ahead = number - self.highest;
            self.seen = if ahead < WINDOW as u64 { self.seen << ahead | 1 } else { 1 };
            self.highest = number;
            return true;
        }
        let behind = self.highest - number;
        if behind >= WINDOW as u64 || self.seen >> behind & 1 == 1 {
            return false;
        }
        self.seen |= 1 << behind;
        true
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_late_number_passes_once_and_one_128_behind_never() {
        let mut window = Window::beginning_with(0);
        assert!(window.accept(128));
        assert!(!window.accept(0), "0 is out of the window");
        assert!(window.accept(1));
        assert!(!window.accept(1));
        assert!(!window.accept(128));
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

        /// Against a set of all numbers ever seen, with jumps over and within the window.
        #[test]
        fn it_lets_in_what_a_set_would_and_nothing_older_than_the_window(steps in prop::collection::vec((-200_i64..200, any::<bool>()), 1..300)) {
            let mut seen = BTreeSet::from([1000_u64]);
            let mut window = Window::beginning_with(1000);
            for (step, far) in steps {
                let highest = *seen.last().unwrap();
                let number = highest.saturating_add_signed(if far { step } else { step % 5 });
                let expected = number + 128 > highest && !seen.contains(&number);
                prop_assert_eq!(window.accept(number), expected);
                if expected {
                    seen.insert(number);
                }
            }
        }
    }
}
