//! Least box that contains the copies.

/// Least and greatest position of copies along each axis \[m\].
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds<const A: usize> {
    low: [f64; A],
    high: [f64; A],
}

impl<const A: usize> Bounds<A> {
    /// Bounds of no copy.
    pub(super) const NONE: Self = Self { low: [f64::INFINITY; A], high: [f64::NEG_INFINITY; A] };

    /// Adds the position of a copy.
    #[inline(always)]
    pub(super) fn add(&mut self, position: &[f64; A]) {
        for ((low, high), position) in self.low.iter_mut().zip(&mut self.high).zip(position) {
            // Comparisons with NaN are false: an unknown position changes neither bound.
            *low = if *position < *low { *position } else { *low };
            *high = if *position > *high { *position } else { *high };
        }
    }

    /// Returns the largest distance along an axis between two copies \[m\]; zero for no copy.
    #[inline(always)]
    pub(super) fn discrepancy(&self) -> f64 {
        let mut discrepancy = 0.0_f64;
        for axis in 0..A {
            // A difference that is not a number changes nothing, as with `f64::max`, which takes more instructions.
            let apart = self.high[axis] - self.low[axis];
            discrepancy = if apart > discrepancy { apart } else { discrepancy };
        }
        discrepancy
    }
}
