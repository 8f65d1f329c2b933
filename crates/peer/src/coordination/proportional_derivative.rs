//! Conventional proportional-derivative coordination: each copy is pulled towards each of the others.
//!
//! Over an ideal network the difference modes of N copies have the stiffness N·KT (Rakhsha & Constantinescu 2015, equation 3): it grows with N.

use super::{AveragePosition, Command, Context, Strategy};
use crate::Gains;

/// The conventional strategy.
///
/// Σⱼ [KT·(x − xⱼ) + BT·(v − vⱼ)] over the N−1 others is (N−1)·[KT·(x − x̄) + BT·(v − v̄)]: average-position coordination with gains (N−1)·KT and
/// (N−1)·BT. It is computed so, in one product instead of N−1, and then the identity between the two strategies holds to the bit.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ProportionalDerivative {
    others: f64,
    equivalent: AveragePosition,
}

impl ProportionalDerivative {
    /// The strategy with gains KT and BT towards each of the other peers; `peers` counts all of them.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "the number of peers is far below 2^53")]
    pub fn new(gains: Gains, peers: usize) -> Self {
        let others = peers.saturating_sub(1) as f64;
        Self { others, equivalent: AveragePosition::new(gains.scaled(others)) }
    }
}

impl<const A: usize> Strategy<A> for ProportionalDerivative {
    #[inline]
    fn command(&mut self, context: &Context<'_, A>) -> Command<A> {
        self.equivalent.command(context)
    }

    fn set_gains(&mut self, gains: Gains) {
        Strategy::<A>::set_gains(&mut self.equivalent, gains.scaled(self.others));
    }
}
