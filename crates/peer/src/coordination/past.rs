//! Own states of the latest ticks, for laws with a lag.

use alloc::vec;
use alloc::vec::Vec;

use crate::State;

/// States of a copy at the latest ticks, the oldest first, as numbers: the positions along all axes, then the velocities.
///
/// Each state is written twice, one window length apart. The window is therefore one slice, wherever it begins, and a tick takes the same time for any lag.
#[derive(Clone, Debug)]
pub(super) struct Past<const A: usize> {
    /// Two copies of the window: 2·2·A·lag numbers.
    numbers: Vec<f64>,
    /// Number of states in the window, at least 1.
    lag: usize,
    /// Index of the oldest state in the first copy, below `lag`.
    oldest: usize,
    /// `true` if a state is known; not before the first tick.
    is_known: bool,
}

impl<const A: usize> Past<A> {
    /// Returns an empty window of `lag` ticks, at least one.
    pub(super) fn new(lag: usize) -> Self {
        Self { numbers: vec![0.0; 4 * A * lag], lag, oldest: 0, is_known: false }
    }

    /// Changes the window to `lag` ticks, at least one. The latest states stay. If the new window is longer than the known states, the oldest known state
    /// fills the rest.
    pub(super) fn set_lag(&mut self, lag: usize) {
        if lag == self.lag {
            return;
        }
        // Before the first tick there is nothing to keep.
        let known = self.is_known.then(|| self.numbers().to_vec());
        *self = Self::new(lag);
        let Some(known) = known else { return };
        let (oldest, count) = (&known[..2 * A], known.len() / (2 * A));
        // Either `missing` is empty, or all known states stay: together they fill the window exactly.
        let missing = oldest.repeat(lag.saturating_sub(count));
        self.set_numbers(&[&missing, &known[2 * A * count.saturating_sub(lag)..]].concat());
    }

    /// Returns the oldest state and stores the present state `now`. Before the first tick, the state of the first tick counts.
    pub(super) fn exchange(&mut self, now: &State<A>) -> State<A> {
        if !self.is_known {
            // The state of the first tick stands for all earlier ticks.
            for place in 0..self.lag {
                self.write(place, now);
            }
            self.is_known = true;
        }
        let oldest = &self.numbers[2 * A * self.oldest..2 * A * (self.oldest + 1)];
        let before = State { position: core::array::from_fn(|axis| oldest[axis]), velocity: core::array::from_fn(|axis| oldest[A + axis]) };
        self.write(self.oldest, now);
        // The window moves by one state, and wraps around after `lag` ticks.
        self.oldest = if self.oldest + 1 == self.lag { 0 } else { self.oldest + 1 };
        before
    }

    /// Returns all states, the oldest first.
    pub(super) fn numbers(&self) -> &[f64] {
        &self.numbers[2 * A * self.oldest..2 * A * (self.oldest + self.lag)]
    }

    /// Replaces all states, the oldest first.
    ///
    /// # Panics
    ///
    /// If `numbers` does not have the length of the window.
    pub(super) fn set_numbers(&mut self, numbers: &[f64]) {
        let (first, second) = self.numbers.split_at_mut(2 * A * self.lag);
        first.copy_from_slice(numbers);
        second.copy_from_slice(numbers);
        (self.oldest, self.is_known) = (0, true);
    }

    /// Writes a state into both copies of the window.
    fn write(&mut self, place: usize, state: &State<A>) {
        for place in [place, place + self.lag] {
            let numbers = &mut self.numbers[2 * A * place..2 * A * (place + 1)];
            numbers[..A].copy_from_slice(&state.position);
            numbers[A..].copy_from_slice(&state.velocity);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(number: u32) -> State<2> {
        let number = f64::from(number);
        State { position: [number, number + 0.25], velocity: [-number, -number - 0.25] }
    }

    #[test]
    fn a_state_comes_back_after_the_lag_and_the_first_one_before_that() {
        for lag in 1..=7_u32 {
            let mut past = Past::new(lag as usize);
            for tick in 5..40 {
                assert_eq!(past.exchange(&state(tick)), state((tick - lag.min(tick)).max(5)));
                let window: Vec<f64> = (0..lag)
                    .rev()
                    .flat_map(|age| {
                        let State { position, velocity } = state((tick - age.min(tick)).max(5));
                        position.into_iter().chain(velocity)
                    })
                    .collect();
                assert_eq!(past.numbers(), window);
            }
        }
    }

    /// After a change of its length, a window returns the same states as a window of the new length, as far as it knows them.
    #[test]
    fn a_lag_that_changes_keeps_the_latest_states() {
        for (before, after) in [(3_u32, 7_u32), (7, 3), (4, 4), (1, 5), (5, 1)] {
            let mut past = Past::new(before as usize);
            (10..30).for_each(|tick| _ = past.exchange(&state(tick)));
            past.set_lag(after as usize);
            for tick in 30..50 {
                assert_eq!(past.exchange(&state(tick)), state((tick - after).max(30 - before)), "{before} to {after} at {tick}");
            }
        }
        let mut unknown = Past::new(2);
        unknown.set_lag(3);
        assert_eq!(unknown.exchange(&state(5)), state(5));
    }

    #[test]
    fn numbers_that_are_put_back_go_on_as_they_would_have() {
        let mut past = Past::new(3);
        (0..10).for_each(|tick| _ = past.exchange(&state(tick)));
        let mut other = Past::new(3);
        other.set_numbers(past.numbers());
        for tick in 10..20 {
            assert_eq!(other.exchange(&state(tick)), past.exchange(&state(tick)));
            assert_eq!(other.numbers(), past.numbers());
        }
    }
}
