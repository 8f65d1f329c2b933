//! Average-position coordination: each copy is pulled towards the mean of the other copies.
//!
//! Over an ideal network the difference modes of N copies have the stiffness N/(N−1)·KT (Rakhsha & Constantinescu 2015, equation 6): bounded in N.

use super::{Coefficients, Law, LawKind, LawParameters, Observation};
use crate::gains::coordinate;
use crate::{Gains, Number};

/// The law of Rakhsha & Constantinescu (2015).
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct AveragePosition<C = f64> {
    /// Gains KT [N/m] and BT [N·s/m].
    pub gains: Gains<C>,
}

impl LawKind for AveragePosition {
    fn new(parameters: &LawParameters) -> Self {
        Self { gains: parameters.gains }
    }
}

impl<C: Copy> Coefficients for AveragePosition<C> {
    type Coefficient = C;
    type Of<D: Copy> = AveragePosition<D>;

    #[inline(always)]
    fn map<D: Copy>(&self, coefficient: impl FnMut(&C) -> D) -> AveragePosition<D> {
        AveragePosition { gains: self.gains.map(coefficient) }
    }
}

impl<N: Number> Law<N> for AveragePosition<N> {
    #[inline(always)]
    fn force(&self, seen: &Observation<N>, _memory: &mut [N]) -> N {
        coordinate(&self.gains, seen.own.relative_to(seen.mean))
    }
}
