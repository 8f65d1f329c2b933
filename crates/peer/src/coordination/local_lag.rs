//! Average-position coordination of states of equal age: the own state is as old as the samples of the other copies.
//!
//! FT(k) = KT·(x(k − L) − mean xⱼ) + BT·(v(k − L) − mean vⱼ), with the initial state before the first tick, as in Cheong & Niculescu's synchronisation of
//! delayed copies. If the samples in use are L ticks old, copies that move at one velocity exert no force on each other. A copy feels its own motion L ticks
//! late.

use super::{Coefficients, Law, LawForm, LawKind, LawParameter, LawParameters, LawValue, Observation};
use crate::gains::coordinate;
use crate::{Gains, Number};

/// The average-position law with the peer's own state of L ticks ago in place of the present state.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LocalLag<C = f64> {
    /// Gains KT [N/m] and BT [N·s/m].
    gains: Gains<C>,
    /// L, the age of the own state \[ticks\].
    lag: usize,
}

impl LawKind for LocalLag {
    const PARAMETERS: &[LawParameter] = &[LawParameter {
        key: "lag",
        form: LawForm::AutomaticDuration,
        default: "\"auto\"",
        about: "Age of the own state that is compared, in whole ticks, rounded up; auto for the middle age of samples, where all links have one constant delay; 0 for average-position itself",
        can_change: true,
    }];

    fn new(parameters: &LawParameters) -> Self {
        let ticks = match (parameters.own.get(0), parameters.middle) {
            // Rounded up to whole ticks, as the age of a sample that arrives between two ticks.
            (LawValue::Duration(lag), _) => lag.as_nanos().div_ceil(parameters.tick.as_nanos().max(1)),
            (_, Some(middle)) => middle.into(),
            // Scenes with `auto` whose links give no middle age are refused before this point.
            (_, None) => 0,
        };
        Self { gains: parameters.gains, lag: usize::try_from(ticks).unwrap_or(usize::MAX) }
    }
}

impl<C: Copy> Coefficients for LocalLag<C> {
    type Coefficient = C;
    type Of<D: Copy> = LocalLag<D>;

    #[inline(always)]
    fn map<D: Copy>(&self, coefficient: impl FnMut(&C) -> D) -> LocalLag<D> {
        LocalLag { gains: self.gains.map(coefficient), lag: self.lag }
    }
}

impl<N: Number> Law<N> for LocalLag<N> {
    fn lag(&self) -> usize {
        self.lag
    }

    #[inline(always)]
    fn force(&self, seen: &Observation<N>, _memory: &mut [N]) -> N {
        coordinate(&self.gains, seen.past.relative_to(seen.mean))
    }
}
