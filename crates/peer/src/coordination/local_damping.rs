//! A spring towards the mean of the other copies, and a damper from each copy to ground.
//!
//! This is local damping injection as in Lee & Huang (2010), without their set-points: FT = KT·(x − mean xⱼ), and the copy has the damping bO + β. If no
//! sample in use is older than m ticks, the springs inject at most the sum of KT·(m + 1)·d² over all ticks, where d is the motion of a copy in a tick. A
//! damper dissipates at least β·d²/Tc, so with β = KT·(m + 1)·Tc the network injects no energy. The user feels the damping in free motion.

use super::{Coefficients, Law, LawForm, LawKind, LawParameter, LawParameters, LawValue, Observation, UsedGains};
use crate::gains::coordinate;
use crate::{Gains, Number};

/// The average-position law without damping between copies, and with a damper from the peer's copy to ground.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct LocalDamping<C = f64> {
    /// Gain KT [N/m]; the damping between copies is zero.
    gains: Gains<C>,
    /// Damping β of the copy towards ground [N·s/m].
    damping: f64,
}

impl LawKind for LocalDamping {
    const GAINS: UsedGains = UsedGains::Stiffness;
    const PARAMETERS: &[LawParameter] = &[
        LawParameter {
            key: "damping",
            form: LawForm::AutomaticDamping,
            default: "\"auto\"",
            about: "Damping of each copy towards ground, β; auto for K_T times the age of the oldest sample in use and a tick",
            can_change: true,
        },
        LawParameter {
            key: "age",
            form: LawForm::AutomaticDuration,
            default: "\"auto\"",
            about: "Age of the oldest sample in use, for a damping of auto; auto needs constant delays on all links, and no loss but patterns of lost packets",
            can_change: false,
        },
    ];

    #[expect(clippy::cast_precision_loss, reason = "ticks are counted, far below 2^53")]
    fn new(parameters: &LawParameters) -> Self {
        let Gains { stiffness, .. } = parameters.gains;
        let tick = parameters.tick.as_secs_f64();
        let automatic = || match (parameters.own.get(1), parameters.oldest) {
            (LawValue::Duration(age), _) => stiffness * (age.as_secs_f64() + tick),
            (_, Some(oldest)) => stiffness * ((oldest + 1) as f64 * tick),
            // Scenes with `auto` whose links do not bound the age are refused before this point.
            (_, None) => 0.0,
        };
        Self { gains: Gains { stiffness, damping: 0.0 }, damping: parameters.own.get(0).number().unwrap_or_else(automatic) }
    }
}

impl<C: Copy> Coefficients for LocalDamping<C> {
    type Coefficient = C;
    type Of<D: Copy> = LocalDamping<D>;

    #[inline(always)]
    fn map<D: Copy>(&self, coefficient: impl FnMut(&C) -> D) -> LocalDamping<D> {
        LocalDamping { gains: self.gains.map(coefficient), damping: self.damping }
    }
}

impl<N: Number> Law<N> for LocalDamping<N> {
    fn damping(&self) -> f64 {
        self.damping
    }

    #[inline(always)]
    fn force(&self, seen: &Observation<N>, _memory: &mut [N]) -> N {
        coordinate(&self.gains, seen.own.relative_to(seen.mean))
    }
}
