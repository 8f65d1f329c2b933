//! Conventional proportional-derivative coordination: each copy is pulled towards each other copy.
//!
//! Over an ideal network the difference modes of N copies have the stiffness N·KT (Rakhsha & Constantinescu 2015, equation 3), which grows with N.

use super::{Coefficients, Law, LawKind, LawParameters, Observation, Pull};
use crate::{Gains, Number};

/// The conventional law.
///
/// FT = Σⱼ [KT·(x − xⱼ) + BT·(v − vⱼ)] over the N−1 other peers. Every term is linear, so the sum equals a pull towards the mean with N−1 times the gains.
/// These gains are computed once, in place of N−1 terms per tick.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ProportionalDerivative<C = f64> {
    /// Gains (N−1)·KT [N/m] and (N−1)·BT [N·s/m].
    summed: Gains<C>,
}

impl LawKind for ProportionalDerivative {
    const PULL: Pull = Pull::Sum;

    #[expect(clippy::cast_precision_loss, reason = "the number of peers is far below 2^53")]
    fn new(parameters: &LawParameters) -> Self {
        // A session of one peer has no other copies and no pull.
        Self { summed: parameters.gains.scaled(parameters.peers.saturating_sub(1) as f64) }
    }
}

impl<C: Copy> Coefficients for ProportionalDerivative<C> {
    type Coefficient = C;
    type Of<D: Copy> = ProportionalDerivative<D>;

    #[inline(always)]
    fn map<D: Copy>(&self, coefficient: impl FnMut(&C) -> D) -> ProportionalDerivative<D> {
        ProportionalDerivative { summed: self.summed.map(coefficient) }
    }
}

impl<N: Number> Law<N> for ProportionalDerivative<N> {
    #[inline(always)]
    fn force(&self, seen: &Observation<N>, _memory: &mut [N]) -> N {
        //= Rakhsha & Constantinescu 2015, eq. (2): FT = Σⱼ [KT·(xO − xOⱼ) + BT·(vO − vOⱼ)]
        self.summed.force(seen.own.relative_to(seen.mean))
    }
}
