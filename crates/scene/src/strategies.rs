//! Which strategy each peer runs: the scene's, or one of the caller's own.

use cohaptic_peer::Strategy;
use cohaptic_peer::coordination::{BuiltIn, LawParameters, LawStrategy};

use crate::Scene;

/// Makes the coordination strategy of each peer, for as many axes as are simulated.
///
/// [`FromScene`] makes what the scene names. Implement this to simulate or to analyse a scene with a strategy of your own.
pub trait Strategies {
    /// The strategy for A axes.
    type Strategy<const A: usize>: Strategy<A>;

    /// Makes the strategy of the peer in that place of [`Scene::peers`].
    fn strategy<const A: usize>(&self, scene: &Scene, peer: usize) -> Self::Strategy<A>;

    /// The law of every peer, if these strategies are one of the registry: it gives their forces to the bit, so a run can do without the strategies.
    fn law(&self, _scene: &Scene) -> Option<BuiltIn> {
        None
    }
}

/// The strategy that the scene names, with its gains scaled by the number of peers.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct FromScene;

impl Strategies for FromScene {
    type Strategy<const A: usize> = LawStrategy<A>;

    fn strategy<const A: usize>(&self, scene: &Scene, _peer: usize) -> LawStrategy<A> {
        LawStrategy::new(scene.coordination.strategy, scene.law_parameters())
    }

    fn law(&self, scene: &Scene) -> Option<BuiltIn> {
        Some(scene.law())
    }
}

impl Scene {
    /// The coordination law of every peer.
    #[must_use]
    pub fn law(&self) -> BuiltIn {
        self.coordination.strategy.law(&self.law_parameters())
    }

    /// What the law is made from: the gains scaled by the number of peers.
    fn law_parameters(&self) -> LawParameters {
        let peers = self.peers.len();
        LawParameters { gains: self.coordination.gains.scaled(self.coordination.scaling.coordination_factor(peers)), peers }
    }
}
