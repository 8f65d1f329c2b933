//! The own states of the latest ticks, for laws that look back.

use alloc::vec;
use alloc::vec::Vec;

use crate::State;

/// The states of a copy at the latest ticks, the oldest first, as numbers: its positions along each axis, then its velocities.
///
/// Each state is written twice, one length of the window apart, so that the window is one slice wherever it begins, and a tick takes as long whatever the
/// lag is.
#[derive(Clone, Debug)]
pub(super) struct Past<const A: usize> {
    numbers: Vec<f64>,
    lag: usize,
    /// The place of the oldest state.
    oldest: usize,
    /// Whether any state is known: before the first tick none is.
    is_known: bool,
}

impl<const A: usize> Past<A> {
    /// Room for the states of that number of ticks, at least one.
    pub(super) fn new(lag: usize) -> Self {
        Self { numbers: vec![0.0; 4 * A * lag], lag, oldest: 0, is_known: false }
    }

    /// Room for the states of that number of ticks, at least one, from now on. The latest states stay; where more are asked for than are known, the copy was
    /// before the oldest as at the oldest.
    pub(super) fn set_lag(&mut self, lag: usize) {
        if lag == self.lag {
            return;
        }
        let known = self.is_known.then(|| self.numbers().to_vec());
        *self = Self::new(lag);
        let Some(known) = known else { return };
        let (oldest, count) = (&known[..2 * A], known.len() / (2 * A));
        let missing = oldest.repeat(lag.saturating_sub(count));
        self.set_numbers(&[&missing, &known[2 * A * count.saturating_sub(lag)..]].concat());
    }

    /// Gives the oldest state, and remembers the present one. Before the first tick the copy was as at the first.
    pub(super) fn exchange(&mut self, now: &State<A>) -> State<A> {
        if !self.is_known {
            for place in 0..self.lag {
                self.write(place, now);
            }
            self.is_known = true;
        }
        let oldest = &self.numbers[2 * A * self.oldest..2 * A * (self.oldest + 1)];
        let before = State { position: core::array::from_fn(|axis| oldest[axis]), velocity: core::array::from_fn(|axis| oldest[A + axis]) };
        self.write(self.oldest, now);
        self.oldest = if self.oldest + 1 == self.lag { 0 } else { self.oldest + 1 };
        before
    }

    /// All states, the oldest first.
    pub(super) fn numbers(&self) -> &[f64] {
        &self.numbers[2 * A * self.oldest..2 * A * (self.oldest + self.lag)]
    }

    /// Replaces all states, the oldest first.
    ///
    /// # Panics
    ///
    /// If there are not as many numbers.
    pub(super) fn set_numbers(&mut self, numbers: &[f64]) {
        let (first, second) = self.numbers.split_at_mut(2 * A * self.lag);
        first.copy_from_slice(numbers);
        second.copy_from_slice(numbers);
        (self.oldest, self.is_known) = (0, true);
    }

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

    /// A window that was longer or shorter before gives back what one of its length from the beginning does, as far as it has seen.
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
