//! Average-position coordination with a first-order lag of the force.
//!
//! FT of [`AveragePosition`](super::AveragePosition) passes the low-pass filter lag·dFT/dt + FT = F, solved exactly for a force F held over a tick:
//! FT(k) = a·FT(k − 1) + (1 − a)·F(k) with a = e^(−Tc/lag).

use super::{Coefficients, Law, LawForm, LawKind, LawParameter, LawParameters, Observation};
use crate::gains::coordinate;
use crate::{Gains, Number};

/// The average-position law with a first-order lag.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SmoothedAveragePosition<C = f64> {
    /// Gains KT [N/m] and BT [N·s/m].
    gains: Gains<C>,
    /// a, the share of the force of the tick before.
    kept: C,
    /// 1 − a, the share of the present force.
    taken: C,
}

impl LawKind for SmoothedAveragePosition {
    const PARAMETERS: &[LawParameter] = &[LawParameter {
        key: "lag",
        form: LawForm::Duration,
        default: "\"10ms\"",
        about: "Time constant of the force; 0 for average-position itself",
        can_change: true,
    }];

    fn new(parameters: &LawParameters) -> Self {
        let periods = parameters.tick.as_secs_f64() / parameters.own.duration(0).as_secs_f64();
        // `expm1` gives 1 − a without the rounding of a, which is near 1 for a short tick. A lag of 0 gives an infinite quotient and a = 0.
        Self { gains: parameters.gains, kept: libm::exp(-periods), taken: -libm::expm1(-periods) }
    }
}

impl<C: Copy> Coefficients for SmoothedAveragePosition<C> {
    type Coefficient = C;
    type Of<D: Copy> = SmoothedAveragePosition<D>;

    #[inline(always)]
    fn map<D: Copy>(&self, mut coefficient: impl FnMut(&C) -> D) -> SmoothedAveragePosition<D> {
        SmoothedAveragePosition { gains: self.gains.map(&mut coefficient), kept: coefficient(&self.kept), taken: coefficient(&self.taken) }
    }
}

impl<N: Number> Law<N> for SmoothedAveragePosition<N> {
    fn memory(&self) -> usize {
        1
    }

    #[inline(always)]
    fn force(&self, seen: &Observation<N>, memory: &mut [N]) -> N {
        let pull = coordinate(&self.gains, seen.own.relative_to(seen.mean));
        // The memory holds the force of the tick before; at the first tick it is zero, so the force rises from rest.
        memory[0] = self.kept * memory[0] + self.taken * pull;
        memory[0]
    }
}
