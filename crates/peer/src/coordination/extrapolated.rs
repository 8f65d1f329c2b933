//! Average-position coordination towards the present positions of other copies: samples are extrapolated with their velocities.
//!
//! The law is the dead reckoning of distributed simulation (IEEE 1278.1, first order): x̂ⱼ = xⱼ + min(age, horizon)·vⱼ, and FT = KT·(x − mean x̂ⱼ) + BT·(v −
//! mean vⱼ). Copies that move at one velocity then exert no force on each other, at any age of the samples up to the horizon.

use super::{Coefficients, Law, LawForm, LawKind, LawParameter, LawParameters, Observation};
use crate::gains::coordinate;
use crate::{Gains, Motion, Number};

/// The average-position law with extrapolated samples.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Extrapolated<C = f64> {
    /// Gains KT [N/m] and BT [N·s/m].
    gains: Gains<C>,
    /// Greatest age to which samples are extrapolated \[s\]; 0 for average-position coordination.
    horizon: f64,
}

impl LawKind for Extrapolated {
    const PARAMETERS: &[LawParameter] = &[LawParameter {
        key: "horizon",
        form: LawForm::Duration,
        default: "\"100ms\"",
        about: "Largest age up to which samples are extrapolated; 0 for average-position itself",
        can_change: true,
    }];

    fn new(parameters: &LawParameters) -> Self {
        Self { gains: parameters.gains, horizon: parameters.own.duration(0).as_secs_f64() }
    }
}

impl<C: Copy> Coefficients for Extrapolated<C> {
    type Coefficient = C;
    type Of<D: Copy> = Extrapolated<D>;

    #[inline(always)]
    fn map<D: Copy>(&self, coefficient: impl FnMut(&C) -> D) -> Extrapolated<D> {
        Extrapolated { gains: self.gains.map(coefficient), horizon: self.horizon }
    }
}

impl<N: Number> Law<N> for Extrapolated<N> {
    fn horizon(&self) -> Option<f64> {
        (self.horizon > 0.0).then_some(self.horizon)
    }

    #[inline(always)]
    fn force(&self, seen: &Observation<N>, _memory: &mut [N]) -> N {
        coordinate(&self.gains, seen.own.relative_to(self.target(seen)))
    }

    #[inline(always)]
    fn target(&self, seen: &Observation<N>) -> Motion<N> {
        Motion { position: seen.mean.position + seen.lead, velocity: seen.mean.velocity }
    }
}
