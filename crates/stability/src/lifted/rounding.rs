//! A quick bound of the rounding errors of a frame.
//!
//! Each tick of a node rounds some ten operations on numbers of at most step·growth. *Step* is the largest sum of absolute values of a row of one tick's
//! matrix; *growth* is the largest such sum of a row of the states so far, as functions of the frame's unknowns. The rest of the frame magnifies a rounding
//! error by about the growth of the whole frame. If disturbances grow so fast that the square of the growth says nothing, [`majorant`](super::majorant) has
//! a closer bound.

/// Growth, step and number of ticks, from which the bound follows. Updated after each tick of a frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rounding {
    /// Largest sum of absolute values of a row so far; 1 at the beginning.
    growth: f64,
    /// Number of ticks of all nodes so far.
    ticks: u32,
    /// Largest sum of absolute values of a row of one tick's matrix, over all nodes.
    step: f64,
}

/// Rounding error of the operations of one tick, relative to the numbers in the tick.
const TICK: f64 = 10.0 * f64::EPSILON;

impl Rounding {
    /// Returns a bound that counts no tick yet. `step` is the largest sum of absolute values of a row of one tick's matrix, over all nodes.
    pub(crate) const fn new(step: f64) -> Self {
        Self { growth: 1.0, ticks: 0, step }
    }

    /// Counts a tick of a node, after which the sums of absolute values of the node's rows are at most `sum`.
    #[inline]
    pub(crate) fn tick(&mut self, sum: f64) {
        self.ticks += 1;
        self.growth = self.growth.max(sum);
    }

    /// Returns a bound of the errors, as the largest sum of absolute values of a row. If the bound is not below 1, `closer` is called and the smaller of both
    /// bounds is returned.
    pub(crate) fn bound(&self, closer: impl FnOnce() -> f64) -> f64 {
        closer_of(TICK * f64::from(self.ticks) * self.step * self.growth * self.growth, closer)
    }
}

/// Returns `bound` if it is below 1, and otherwise the smaller of `bound` and the bound of `closer`, which takes longer to compute. NaN counts as infinite.
pub(crate) fn closer_of(bound: f64, closer: impl FnOnce() -> f64) -> f64 {
    if bound < 1.0 { bound } else { [bound, closer()].into_iter().filter(|bound| !bound.is_nan()).fold(f64::INFINITY, f64::min) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_slow_motion_it_is_that_of_the_growth() {
        let mut rounding = Rounding::new(3.0);
        (0..100).for_each(|_| rounding.tick(2.0));
        let asked = || unreachable!("the bound says something");
        assert_eq!(rounding.bound(asked).to_bits(), (TICK * 100.0 * 3.0 * 2.0 * 2.0).to_bits());
    }

    #[test]
    fn of_fast_growth_it_is_the_closer_one() {
        let mut rounding = Rounding::new(1e6);
        rounding.tick(1e48);
        assert_eq!(rounding.bound(|| 1e34).to_bits(), 1e34_f64.to_bits());
        rounding.tick(f64::INFINITY);
        assert_eq!((rounding.bound(|| 1e34).to_bits(), rounding.bound(|| f64::NAN).to_bits()), (1e34_f64.to_bits(), f64::INFINITY.to_bits()));
    }
}
