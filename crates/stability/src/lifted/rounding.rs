//! How far the rounding of a frame's ticks may take its rows from the exact ones.
//!
//! Each tick of a node rounds some ten operations on numbers of at most step·growth: *step* is the largest sum of the sizes of a row of one tick's matrix,
//! *growth* the largest sum of a row of what the frame has made so far of its unknowns. What is left of the frame magnifies that, for which there are two
//! bounds: about the growth of the whole frame, which is the closer one where a disturbance lives long and grows little; and step to the power of the
//! ticks left, carried along tick by tick, which is the closer one where disturbances grow so fast that the square of the growth says nothing any more.

/// The two bounds, carried along with the ticks of a frame. The error of each node's rows is the caller's to keep, 0 at the beginning.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rounding {
    /// The largest sum of the sizes of a row so far; 1 at the beginning.
    growth: f64,
    ticks: u32,
    step: f64,
    /// The largest error of a sample sent so far.
    sent: f64,
}

/// What the operations of a tick round, relative to the numbers in it.
const TICK: f64 = 10.0 * f64::EPSILON;

impl Rounding {
    /// Before the first tick; `step` is that of the worst node.
    pub(crate) const fn new(step: f64) -> Self {
        Self { growth: 1.0, ticks: 0, step, sent: 0.0 }
    }

    /// A sample of rows with that error, of which it is a mean.
    #[inline]
    pub(crate) fn sample(&mut self, error: f64) {
        self.sent = self.sent.max(error);
    }

    /// A tick of a node after which its rows have at most that sum: the error of its rows before becomes that after.
    #[inline]
    pub(crate) fn tick(&mut self, sum: f64, error: &mut f64) {
        self.ticks += 1;
        self.growth = self.growth.max(sum);
        *error = self.step * error.max(self.sent) + TICK * self.step * self.growth;
    }

    /// A bound of the errors, in the largest sum of sizes of a row, if those of all nodes are at most `errors`.
    pub(crate) fn bound(&self, errors: f64) -> f64 {
        let of_growth = TICK * f64::from(self.ticks) * self.step * self.growth * self.growth;
        if of_growth < 1.0 { of_growth } else { errors.max(self.sent).min(of_growth) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Eight ticks that multiply by 10^6 each: the entries are 10^48 and their errors some 10^34, not the 10^81 that the square of the growth says.
    #[test]
    fn of_fast_growth_the_error_is_small_beside_the_entries() {
        let mut rounding = Rounding::new(1e6);
        let (mut sum, mut error) = (1.0, 0.0);
        for _ in 0..8 {
            sum *= 1e6;
            rounding.tick(sum, &mut error);
        }
        // Each tick adds 10·ε·10^6·(its sum), which the ticks after it multiply to 10·ε·10^54.
        let expected = 8.0 * TICK * 1e54;
        assert!((rounding.bound(error) / expected - 1.0).abs() < 1e-12, "{error}");
    }

    #[test]
    fn of_slow_motion_it_is_that_of_the_growth() {
        let mut rounding = Rounding::new(3.0);
        let mut error = 0.0;
        for _ in 0..100 {
            rounding.tick(2.0, &mut error);
        }
        assert_eq!(rounding.bound(error).to_bits(), (TICK * 100.0 * 3.0 * 2.0 * 2.0).to_bits());
    }
}
