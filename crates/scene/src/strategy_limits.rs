//! Limits of strategies: scenes in which a strategy cannot work, and the reasons.

use cohaptic_peer::coordination::Law;
use cohaptic_peer::{Coordination, Drift, Exchange, Integrator};

use crate::{ChangeKind, Scene};

impl Scene {
    /// Returns why the coordination cannot work with the parameters of the beginning; `None` if the coordination works.
    pub(crate) fn refused_coordination(&self) -> Option<String> {
        self.refused_automatic().or_else(|| self.refused_lag()).map(str::to_owned).or_else(|| self.refused_strategy())
    }

    /// Returns why the changes of the strategy's parameters in the timeline are impossible; `None` if all changes are possible.
    pub(crate) fn refused_changes(&self) -> Option<String> {
        let settings = self.timeline.iter().filter_map(|change| match &change.what {
            ChangeKind::Parameters(settings) => Some(settings),
            ChangeKind::Link(_)
            | ChangeKind::AllLinks(_)
            | ChangeKind::Contact { .. }
            | ChangeKind::Hand { .. }
            | ChangeKind::HandTorque { .. }
            | ChangeKind::Coordination(_)
            | ChangeKind::RotationalGains(_)
            | ChangeKind::SendWhen(_) => None,
        });
        // A law with a horizon extrapolates, so that peers keep the send times of samples.
        let keeps_ages = |scene: &Self| scene.law(0).is_some_and(|law| Law::<f64>::horizon(&law).is_some());
        let refused = |scene: Self| {
            let begins = keeps_ages(&scene) != keeps_ages(self);
            scene.refused_coordination().or_else(|| {
                begins.then(|| {
                    "send times of samples are kept from the beginning or not at all: expected horizons that are all above zero, or all zero"
                        .to_owned()
                })
            })
        };
        settings.map(|settings| self.with_parameters(settings)).find_map(refused)
    }

    /// Returns why the strategy cannot work in this scene; `None` if the strategy works.
    pub(crate) fn refused_strategy(&self) -> Option<String> {
        let strategy = self.coordination.strategy;
        let (predicts, exchanges_waves, modulates) =
            (strategy == Coordination::PassivityControl, strategy == Coordination::Wave, strategy == Coordination::SetPosition);
        let refuse = |why: &str| Some(format!("the strategy {} {why}", strategy.name()));
        if self.leaves_out_samples() && (exchanges_waves || strategy == Coordination::ClientServer) {
            return refuse("needs every sample: expected no send-when");
        }
        if (predicts || exchanges_waves || modulates) && self.peers.iter().any(|peer| peer.compute_delay) {
            return refuse("counts the energy of forces that act at once: expected no peer with a compute-delay of 1");
        }
        if strategy == Coordination::ClientServer && self.peers.iter().any(|peer| peer.exchange != Exchange::EACH_TICK) {
            return refuse(
                "sends the state of a device at each update and pulls the device at each tick: expected exchange-every = 1 and exchange-age = 0",
            );
        }
        if (exchanges_waves || modulates) && self.integrator != Integrator::Exact {
            return refuse("damps each copy by just as much as it counts on: expected the integrator \"exact\"");
        }
        if exchanges_waves && self.peers.iter().any(|peer| peer.clock.drift != Drift::default()) {
            return refuse("sends waves for as long as it takes to the next sample, on a clock that all have: expected no peer whose clock drifts");
        }
        if modulates && self.timeline.iter().any(|change| matches!(change.what, ChangeKind::Coordination(_))) {
            return refuse("keeps energy in its springs: expected a timeline that does not change the gains");
        }
        if modulates && self.coordination.gains.stiffness == 0.0 {
            return refuse("has no set-position without a spring: expected a stiffness above zero");
        }
        None
    }
}
