//! Average-position coordination: each copy is pulled towards the mean of the others.
//!
//! Over an ideal network the difference modes of N copies have the stiffness N/(N−1)·KT (Rakhsha & Constantinescu 2015, equation 6): bounded in N.

use super::{Command, Context, Strategy};
use crate::Gains;

/// The strategy of Rakhsha & Constantinescu (2015).
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct AveragePosition {
    gains: Gains,
}

impl AveragePosition {
    /// The strategy with gains KT and BT.
    #[must_use]
    pub const fn new(gains: Gains) -> Self {
        Self { gains }
    }
}

impl<const A: usize> Strategy<A> for AveragePosition {
    #[inline]
    fn command(&mut self, context: &Context<'_, A>) -> Command<A> {
        let Gains { stiffness: k_t, damping: b_t } = self.gains;
        let (own, target) = (context.own, *context.held.mean());
        //= Rakhsha & Constantinescu 2015, eq. (10): FT = KT·(xO − xd) + BT·(vO − vd)
        let force =
            core::array::from_fn(|axis| k_t * (own.position[axis] - target.position[axis]) + b_t * (own.velocity[axis] - target.velocity[axis]));
        Command { force, target }
    }

    fn set_gains(&mut self, gains: Gains) {
        self.gains = gains;
    }
}
