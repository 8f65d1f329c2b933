//! Which strategy each peer runs: the scene's, or one of the caller's own.

use cohaptic_peer::Strategy;
use cohaptic_peer::coordination::{BuiltIn, LawParameters, LawStrategy};

use crate::{CoordinationSpec, Scene};

/// Makes the coordination strategy of each peer, for as many axes as are simulated.
///
/// [`FromScene`] makes what the scene names. Implement this to simulate or to analyse a scene with a strategy of your own.
pub trait Strategies {
    /// The strategy for A axes.
    type Strategy<const A: usize>: Strategy<A>;

    /// Makes the strategy of the peer in that place of [`Scene::peers`].
    fn strategy<const A: usize>(&self, scene: &Scene, peer: usize) -> Self::Strategy<A>;

    /// The law of the peer in that place of [`Scene::peers`], if these strategies are one of the registry: it gives their forces to the bit, so a run can do
    /// without the strategies.
    fn law(&self, _scene: &Scene, _peer: usize) -> Option<BuiltIn> {
        None
    }
}

/// The strategy that the scene names, with its gains scaled by the number of peers.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct FromScene;

impl Strategies for FromScene {
    type Strategy<const A: usize> = LawStrategy<A>;

    fn strategy<const A: usize>(&self, scene: &Scene, peer: usize) -> LawStrategy<A> {
        LawStrategy::new(scene.coordination.strategy, scene.law_parameters(peer))
    }

    fn law(&self, scene: &Scene, peer: usize) -> Option<BuiltIn> {
        Some(scene.law(peer))
    }
}

impl Scene {
    /// The coordination law of a peer.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    pub fn law(&self, peer: usize) -> BuiltIn {
        self.coordination.strategy.law(&self.law_parameters(peer))
    }

    /// What the law of a peer is made from: the gains scaled by the number of peers, its tick, and the parameters of the law itself.
    fn law_parameters(&self, peer: usize) -> LawParameters {
        let peers = self.peers.len();
        let CoordinationSpec { strategy, gains, settings, .. } = &self.coordination;
        let own = settings.of(*strategy);
        LawParameters {
            gains: self.coordination_gains(*gains),
            peers,
            tick: self.peers[peer].clock.tick,
            oldest: if own.any_automatic() { self.oldest_sample() } else { None },
            own: *own,
        }
    }
}
