//! Means of states, exact but for one rounding.

use alloc::vec::Vec;

use crate::State;
use crate::exact_sum::ExactSum;

/// Exact sums of states, and means that round once.
#[derive(Clone, Debug, Default)]
pub struct ExactMeans<const A: usize> {
    /// Sums of position and of velocity, indexed by axis.
    sums: Vec<[ExactSum; 2]>,
}

impl<const A: usize> ExactMeans<A> {
    /// Returns the sums of `states`.
    pub fn new<'a>(states: impl IntoIterator<Item = &'a State<A>>) -> Self {
        let mut means = Self { sums: (0..A).map(|_| Default::default()).collect() };
        for state in states {
            for (axis, [position, velocity]) in means.sums.iter_mut().enumerate() {
                position.add(state.position[axis]);
                velocity.add(state.velocity[axis]);
            }
        }
        means
    }

    /// Replaces the state `before`, which must be among the summed states, by `now`.
    #[inline]
    pub fn replace(&mut self, before: &State<A>, now: &State<A>) {
        for (axis, [position, velocity]) in self.sums.iter_mut().enumerate() {
            position.replace(before.position[axis], now.position[axis]);
            velocity.replace(before.velocity[axis], now.velocity[axis]);
        }
    }

    /// Returns the mean of `count` states, which is the number of summed states.
    #[must_use]
    pub fn mean(&self, count: usize) -> State<A> {
        self.each(count, |_, sum, count| sum.mean(count))
    }

    /// Returns the mean of the `count` states that remain without `state`.
    #[must_use]
    pub fn mean_without(&self, state: &State<A>, count: usize) -> State<A> {
        self.each(count, |number, sum, count| sum.mean_without(number(state), count))
    }

    fn each(&self, count: usize, mean: impl Fn(&dyn Fn(&State<A>) -> f64, &ExactSum, u32) -> f64) -> State<A> {
        let count = u32::try_from(count).expect("peers are counted in 32 bits");
        State {
            position: core::array::from_fn(|axis| mean(&|state| state.position[axis], &self.sums[axis][0], count)),
            velocity: core::array::from_fn(|axis| mean(&|state| state.velocity[axis], &self.sums[axis][1], count)),
        }
    }
}
