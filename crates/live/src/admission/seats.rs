//! A seat of a session: the holder, the sequence numbers seen from the holder, and the rule by which another program can take the seat.

use core::time::Duration;
use std::net::SocketAddr;

use cohaptic_units::Instant;

use super::{JOININGS_END, Place, Refusal, SEQUENCE_BITS, Seat, Under};
use crate::Label;
use crate::seal::JoiningKeys;

/// Status of a seat at an instant.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SeatStatus<'a> {
    /// Index of the peer in the scene.
    pub place: Place,
    /// Name of the peer in the scene.
    pub name: &'a str,
    /// Address of the holder. `None` if the seat was never taken.
    pub address: Option<SocketAddr>,
    /// Instant of the latest admitted sample of the holder. `None` if the seat was never taken.
    pub heard: Option<Instant>,
    /// `true` if the latest sample was admitted less than `stale_after` ago.
    pub present: bool,
    /// Number of times that the seat was taken.
    pub joinings: u64,
    /// Number of samples admitted, in all joinings together.
    pub admitted: u64,
    /// Label of the holder's device, as told by the hello of the present joining.
    pub label: Label,
    /// Sequence numbers missing between the first and the highest number of each joining: samples lost on the way to the session.
    pub lost: u64,
}

/// A seat with the holder and the counts.
#[derive(Debug)]
pub(super) struct SeatState {
    seat: Seat,
    /// Holder of the seat, also if the holder is gone. `None` if the seat was never taken.
    occupant: Option<Occupant>,
    /// Number of times that the seat was taken, at most `JOININGS_END`.
    joinings: u64,
    /// Samples admitted, in all joinings together.
    admitted: u64,
    /// Address and label of the latest hello with a right tag. The label becomes that of the holder when a sample from this address takes the seat.
    introduced: Option<(SocketAddr, Label)>,
    /// Sequence numbers missing in the joinings before the present joining.
    lost_before: u64,
}

/// Holder of a seat, present or gone.
#[derive(Debug)]
pub(super) struct Occupant {
    /// Address to which samples are sent: the sender of the sample that took the seat.
    pub(super) address: SocketAddr,
    /// Keys of the joining. `None` in a session without a key. Boxed, so that the keys are not copied when the occupant moves.
    pub(super) keys: Option<Box<JoiningKeys>>,
    /// Instant of the latest admitted sample.
    heard: Instant,
    /// Sequence numbers seen in the present joining.
    window: Window,
    /// First sequence number of the present joining.
    first: u64,
    /// Samples admitted in the present joining, at least one.
    admitted: u64,
    label: Label,
}

impl Occupant {
    /// Returns the number of sequence numbers missing in the present joining.
    const fn lost(&self) -> u64 {
        // A late number below the first number makes the difference negative.
        (self.window.highest - self.first + 1).saturating_sub(self.admitted)
    }
}

impl SeatState {
    pub(super) const fn free(seat: Seat) -> Self {
        Self { seat, occupant: None, joinings: 0, admitted: 0, introduced: None, lost_before: 0 }
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

    /// Notes the label of a hello with a right tag. Only displays use the label, so that a repeated hello can do no more than take a label away.
    pub(super) const fn introduce(&mut self, from: SocketAddr, label: Label) {
        self.introduced = Some((from, label));
    }

    pub(super) const fn occupant(&self) -> Option<&Occupant> {
        self.occupant.as_ref()
    }

    /// Returns the holder of the seat, if a sample of the holder was admitted less than `stale_after` ago.
    pub(super) fn present(&self, now: Instant, stale_after: Duration) -> Option<&Occupant> {
        self.occupant.as_ref().filter(|occupant| since(occupant.heard, now) < stale_after)
    }

    pub(super) fn status(&self, now: Instant, stale_after: Duration) -> SeatStatus<'_> {
        let Self { seat, occupant, joinings, admitted, lost_before, .. } = self;
        SeatStatus {
            place: seat.place,
            name: &seat.name,
            address: occupant.as_ref().map(|occupant| occupant.address),
            heard: occupant.as_ref().map(|occupant| occupant.heard),
            present: self.present(now, stale_after).is_some(),
            joinings: *joinings,
            admitted: *admitted,
            label: occupant.as_ref().map_or(Label::NONE, |occupant| occupant.label),
            lost: lost_before + occupant.as_ref().map_or(0, Occupant::lost),
        }
    }

    /// Admits a sample whose format, limits and tag are right. Returns whether the sample took the seat, or the refusal if the seat belongs to another
    /// program, the sequence number is a repetition, or the joinings are used up.
    pub(super) fn take_or_keep(&mut self, now: Instant, stale_after: Duration, from: SocketAddr, number: u64, under: Under) -> Result<bool, Refusal> {
        let present = self.present(now, stale_after).is_some();
        let same_address = self.occupant.as_ref().is_some_and(|occupant| occupant.address == from);
        let keys = match under {
            // With a key, a joining lasts until the next joining, however long the peer is silent: `unseal` has checked the address and the keys. Without a
            // key, a joining ends with the silence.
            Under::Present if self.occupant.as_ref().is_some_and(|occupant| occupant.keys.is_some()) => return self.keep(now, number),
            Under::Present if present && same_address => return self.keep(now, number),
            Under::Present => None,
            Under::New(keys) => Some(keys),
        };
        // New keys from the address of the holder mean that the same program has begun anew. A program at another address waits until the holder has gone.
        if present && !same_address {
            return Err(Refusal::SeatTaken);
        }
        // One more joining would make the numbers inside the session overflow.
        if self.joinings == JOININGS_END {
            return Err(Refusal::JoiningsUsedUp);
        }
        self.joinings += 1;
        self.admitted += 1;
        self.lost_before += self.occupant.as_ref().map_or(0, Occupant::lost);
        let label = self.introduced.filter(|(address, _)| *address == from).map_or(Label::NONE, |(_, label)| label);
        // The window begins anew, because a peer that joins may count from any number.
        self.occupant = Some(Occupant { address: from, keys, heard: now, window: Window::beginning_with(number), first: number, admitted: 1, label });
        Ok(true)
    }

    /// Admits a sample of the present joining, unless the number was seen before or is too old to tell.
    fn keep(&mut self, now: Instant, number: u64) -> Result<bool, Refusal> {
        let Some(occupant) = &mut self.occupant else { return Err(Refusal::NotJoined) };
        if !occupant.window.accept(number) {
            return Err(Refusal::Replayed);
        }
        // Only an admitted sample counts as heard: repetitions must not keep a silent peer present.
        occupant.heard = now;
        occupant.admitted += 1;
        self.admitted += 1;
        Ok(false)
    }

    /// Returns the sequence number for the scene of `number` in the present joining: the joining, counted from 0, in the upper bits. So the numbers never go
    /// back when a peer joins again, and in the first joining `number` is unchanged.
    pub(super) const fn number_inside(&self, number: u64) -> u64 {
        self.joinings.saturating_sub(1) << SEQUENCE_BITS | number
    }
}

/// Returns the time from `then` to `now`, or zero if `then` is later than `now`.
const fn since(then: Instant, now: Instant) -> Duration {
    Duration::from_nanos(now.as_nanos().saturating_sub(then.as_nanos()))
}

/// Length of the window of sequence numbers: a late number is admitted once if the number is less than this below the highest number seen.
pub(crate) const WINDOW: u32 = 128;

/// Sequence numbers seen in a joining: a window of 128 numbers up to the highest number seen, as in RFC 4303, section 3.4.3.
#[derive(Clone, Copy, Debug)]
struct Window {
    /// Highest number seen.
    highest: u64,
    /// Bit i is set if the number `highest` − i has been seen. Bit 0 is always set.
    seen: u128,
}

impl Window {
    /// Returns the window after the first number of a joining. The first number may be any number.
    const fn beginning_with(number: u64) -> Self {
        Self { highest: number, seen: 1 }
    }

    /// Returns whether `number` is admitted: neither seen before nor below the window. An admitted number counts as seen.
    const fn accept(&mut self, number: u64) -> bool {
        if number > self.highest {
            // A shift by 128 or more bits would overflow; after such a jump no earlier number is within the window.
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

    use cohaptic_tests_common::properties;
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

    properties! {
        #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

        /// Compares the window with a set of all numbers ever seen, with jumps within the window and beyond the window.
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
