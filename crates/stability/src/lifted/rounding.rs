//! How far the rounding of a frame's ticks may take its rows from the exact ones.
//!
//! Each tick of a node rounds some ten operations on numbers of at most step·growth: *step* is the largest sum of the sizes of a row of one tick's matrix,
//! *growth* the largest sum of a row of what the frame has made so far of its unknowns. The rest of the frame magnifies that by about the growth of the
//! whole frame. Where disturbances grow so fast that the square of the growth says nothing any more, [`majorant`](super::majorant) does.

/// The bound, carried along with the ticks of a frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rounding {
    /// The largest sum of the sizes of a row so far; 1 at the beginning.
    growth: f64,
    ticks: u32,
    step: f64,
}

/// What the operations of a tick round, relative to the numbers in it.
const TICK: f64 = 10.0 * f64::EPSILON;

impl Rounding {
    /// Before the first tick; `step` is that of the worst node.
    pub(crate) const fn new(step: f64) -> Self {
        Self { growth: 1.0, ticks: 0, step }
    }

    /// A tick of a node after which its rows have at most that sum.
    #[inline]
    pub(crate) fn tick(&mut self, sum: f64) {
        self.ticks += 1;
        self.growth = self.growth.max(sum);
    }

    /// A bound of the errors, in the largest sum of sizes of a row; where it says nothing, the smaller of it and what `closer` answers.
    pub(crate) fn bound(&self, closer: impl FnOnce() -> f64) -> f64 {
        closer_of(TICK * f64::from(self.ticks) * self.step * self.growth * self.growth, closer)
    }
}

/// A bound of errors where it says something: below 1. Elsewhere the smaller of it and another, which takes longer.
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
