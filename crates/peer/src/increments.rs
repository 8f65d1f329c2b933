//! Positions of senders as sums of displacements, each displacement counted once.
//!
//! In: numbered displacements, in any order and any number of times. Out: the sum for each sender. This module knows neither packets nor laws.

use alloc::boxed::Box;
use alloc::vec::Vec;

use crate::State;

/// Sums of the displacements of several senders.
#[derive(Clone, Debug)]
pub(crate) struct Increments<const A: usize> {
    /// Senders in the order of [`Held`](crate::Held).
    senders: Vec<Sender<A>>,
}

#[derive(Clone, Debug)]
struct Sender<const A: usize> {
    /// Initial position plus all counted displacements \[m\], and the velocity of the newest sample [m/s].
    state: State<A>,
    counted: Counted,
}

impl<const A: usize> Increments<A> {
    /// Returns sums that begin at the given states, one for each sender.
    pub(crate) fn new(initial: impl Iterator<Item = State<A>>) -> Self {
        Self { senders: initial.map(Sender::at).collect() }
    }

    /// Begins anew at `state`, as if nothing had ever arrived from this sender.
    ///
    /// # Panics
    ///
    /// If the index `sender` is out of range.
    pub(crate) fn restart(&mut self, sender: usize, state: State<A>) {
        self.senders[sender] = Sender::at(state);
    }

    /// Adds the displacement of a sample \[m\], unless the sample with this number was added before. Returns whether the sum has changed.
    ///
    /// # Panics
    ///
    /// If the index `sender` is out of range.
    pub(crate) fn add(&mut self, sender: usize, number: u64, displacement: &[f64; A]) -> bool {
        let Sender { state, counted } = &mut self.senders[sender];
        let is_new = counted.is_first(number);
        if is_new {
            for (position, displacement) in state.position.iter_mut().zip(displacement) {
                *position += displacement;
            }
        }
        is_new
    }

    /// Sets the velocity of a sender, that of its newest sample.
    pub(crate) fn set_velocity(&mut self, sender: usize, velocity: [f64; A]) {
        self.senders[sender].state.velocity = velocity;
    }

    /// Returns the sum as a position, with the velocity of the newest sample.
    pub(crate) fn state(&self, sender: usize) -> State<A> {
        self.senders[sender].state
    }
}

impl<const A: usize> Sender<A> {
    fn at(state: State<A>) -> Self {
        Self { state, counted: Counted::default() }
    }
}

/// Numbers that were counted: each of the [`Counted::REACH`] numbers up to the newest one exactly. All older numbers are taken as counted, so that the memory
/// is bounded however many samples are lost (a window, as RFC 4303 has against repeated packets).
#[derive(Clone, Debug, Default)]
struct Counted {
    /// Largest number so far; `None` before the first.
    newest: Option<u64>,
    /// Bit n modulo [`Counted::REACH`] is set if the number n within reach was counted. Empty before the first number.
    bits: Box<[u64]>,
}

impl Counted {
    /// Quantity of numbers that are told apart, a multiple of 64.
    const REACH: u64 = 1 << 16;

    /// Counts a number. Returns whether the number is counted for the first time and within reach of the newest.
    fn is_first(&mut self, number: u64) -> bool {
        if self.bits.is_empty() {
            self.bits = alloc::vec![0; Self::place(Self::REACH - 1).0 + 1].into_boxed_slice();
        }
        match self.newest {
            Some(newest) if number > newest => {
                // The places of the numbers that were left out still have the bits of numbers that are out of reach from now on.
                if number - newest >= Self::REACH {
                    self.bits.fill(0);
                } else {
                    (newest + 1..number).for_each(|missing| self.clear(missing));
                    self.clear(number);
                }
                self.newest = Some(number);
            }
            Some(newest) if newest - number >= Self::REACH => return false,
            Some(_) => {}
            None => self.newest = Some(number),
        }
        let (word, bit) = Self::place(number);
        let is_first = self.bits[word] & bit == 0;
        self.bits[word] |= bit;
        is_first
    }

    fn clear(&mut self, number: u64) {
        let (word, bit) = Self::place(number);
        self.bits[word] &= !bit;
    }

    /// Returns the index of a number's word and the bit in this word.
    const fn place(number: u64) -> (usize, u64) {
        let place = number % Self::REACH;
        ((place / 64) as usize, 1 << (place % 64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_counts_once_within_reach_of_the_newest() {
        let mut counted = Counted::default();
        let reach = Counted::REACH;
        for (number, expected) in [
            (5, true),
            (5, false),
            (3, true),
            (reach + 4, true),
            // 5 is the oldest number within reach, and 4 is out of reach.
            (5, false),
            (6, true),
            (4, false),
            (reach + 3, true),
            (3 * reach, true),
            (2 * reach + 1, true),
            (2 * reach, false),
            (u64::MAX, true),
            (u64::MAX - 1, true),
            (u64::MAX, false),
        ] {
            assert_eq!(counted.is_first(number), expected, "{number}");
        }
    }

    #[test]
    fn a_sender_that_begins_anew_counts_from_its_state() {
        let mut increments = Increments::new([State { position: [1.0], velocity: [0.0] }].into_iter());
        assert!(increments.add(0, 7, &[0.5]) && !increments.add(0, 7, &[0.5]));
        increments.set_velocity(0, [2.0]);
        assert_eq!(increments.state(0), State { position: [1.5], velocity: [2.0] });
        increments.restart(0, State { position: [-1.0], velocity: [0.0] });
        assert!(increments.add(0, 7, &[0.25]));
        assert_eq!(increments.state(0).position, [-0.75]);
    }
}
