//! What the parts of a peer are made from, with every scaling applied.

use cohaptic_peer::{CopyConfig, PeerConfig, State};

use crate::Scene;

impl Scene {
    /// The peer in that place, apart from its device, copy and strategy.
    ///
    /// # Panics
    ///
    /// If there is no such peer, or its place is beyond 2^32.
    #[must_use]
    pub fn peer_config(&self, place: usize) -> PeerConfig {
        let spec = &self.peers[place];
        PeerConfig {
            session: self.seed,
            place: u32::try_from(place).expect("a scene has fewer than 2^32 peers"),
            axes: self.axes.count(),
            contact: spec.contact,
            coupling: spec.coupling.scaled(spec.coupling_scaling.coupling_factor(self.peers.len())),
            tick: spec.clock.tick,
            compute_delay: spec.compute_delay,
            enclosure: self.object.enclosure,
        }
    }

    /// Each peer's copy of the object.
    #[must_use]
    pub fn copy_config(&self) -> CopyConfig {
        CopyConfig { mass: self.copy_mass(), damping: self.object.damping }
    }

    /// Where the copy and the device of that peer begin.
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    pub fn initial_state<const A: usize>(&self, place: usize) -> State<A> {
        let spec = &self.peers[place];
        let take = |values: &[f64; 3]| core::array::from_fn(|axis| values.get(axis).copied().unwrap_or(0.0));
        State { position: take(&spec.position), velocity: take(&spec.velocity) }
    }
}
