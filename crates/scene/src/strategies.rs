//! Which strategy each peer runs: the scene's, or one of the caller's own.

use cohaptic_peer::coordination::BuiltIn;
use cohaptic_peer::{Gains, Strategy};

use crate::Scene;

/// Makes the coordination strategy of each peer, for as many axes as are simulated.
///
/// [`FromScene`] makes what the scene names. Implement this to simulate or to analyse a scene with a strategy of your own.
pub trait Strategies {
    /// The strategy for A axes.
    type Strategy<const A: usize>: Strategy<A>;

    /// Makes the strategy of the peer in that place of [`Scene::peers`].
    fn strategy<const A: usize>(&self, scene: &Scene, peer: usize) -> Self::Strategy<A>;

    /// The gains KT and BT towards the mean of the samples held with which average-position coordination gives the same forces at every peer, to the bit;
    /// `None` if these strategies are not known to be that. A run that knows can do without them.
    fn towards_mean(&self, _scene: &Scene) -> Option<Gains> {
        None
    }
}

/// The strategy that the scene names, with its gains scaled by the number of peers.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct FromScene;

impl Strategies for FromScene {
    type Strategy<const A: usize> = BuiltIn;

    fn strategy<const A: usize>(&self, scene: &Scene, _peer: usize) -> BuiltIn {
        let peers = scene.peers.len();
        let gains = scene.coordination.gains.scaled(scene.coordination.scaling.coordination_factor(peers));
        scene.coordination.strategy.strategy(gains, peers)
    }

    fn towards_mean(&self, scene: &Scene) -> Option<Gains> {
        let peers = scene.peers.len();
        let gains = scene.coordination.gains.scaled(scene.coordination.scaling.coordination_factor(peers));
        scene.coordination.strategy.as_average_position(gains, peers)
    }
}
