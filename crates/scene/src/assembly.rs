//! Configurations of a peer's parts with every scaling applied. Masses of copies and gains are scaled by the number of peers here.

use cohaptic_peer::coordination::Pull;
use cohaptic_peer::{CopyConfig, Gains, PeerConfig, Plant, State};

use crate::{Scaling, Scene};

impl Scene {
    /// Returns the configuration of a peer without device, copy and strategy. `place` is the index in [`Scene::peers`].
    ///
    /// # Panics
    ///
    /// If there is no such peer, or `place` exceeds 2^32 − 1.
    #[must_use]
    pub fn peer_config(&self, place: usize) -> PeerConfig {
        let spec = &self.peers[place];
        PeerConfig {
            session: self.seed,
            place: u32::try_from(place).expect("a scene has fewer than 2^32 peers"),
            axes: self.axes.count(),
            contact: spec.contact,
            coupling: self.coupling(place),
            tick: spec.clock.tick,
            compute_delay: spec.compute_delay,
            exchange: spec.exchange,
            own_damping: self.own_damping(place),
            enclosure: self.object.enclosure,
        }
    }

    /// Returns KC [N/m] and BC [N·s/m] between device and copy of a peer, scaled. `place` is the index in [`Scene::peers`].
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    pub fn coupling(&self, place: usize) -> Gains {
        let spec = &self.peers[place];
        spec.coupling.scaled(spec.coupling_scaling.coupling_factor(self.number()))
    }

    /// Returns KT [N/m] and BT [N·s/m] of a peer: `gains` times [`Scene::coordination_factor`]. `gains` are the gains of the scene or of a change in the
    /// timeline.
    ///
    /// # Panics
    ///
    /// If the scene has a topology, and no such peer.
    #[must_use]
    pub fn coordination_gains(&self, gains: Gains, peer: usize) -> Gains {
        gains.scaled(self.coordination_factor(peer))
    }

    /// Returns the factor of KT and BT of a peer, from the number of peers and the number of peers heard by this peer. A law with a sum over the other peers
    /// counts N − 1 itself where the scene has no topology, so that the factor does not contain N − 1 for such a law.
    ///
    /// # Panics
    ///
    /// If the scene has a topology, and no such peer.
    #[must_use]
    pub fn coordination_factor(&self, peer: usize) -> f64 {
        let scaling = self.coordination.scaling.coordination_factor(self.number());
        let summed = match self.coordination.pull {
            Pull::Mean => scaling,
            Pull::Sum => scaling * self.heard_by(peer),
        };
        // The law counts N − 1 peers. On a topology the law is made for two peers instead, N − 1 = 1, and the heard peers count here.
        match self.coordination.strategy.pull() {
            Pull::Sum if self.topology.is_some() => summed * self.heard_by(peer),
            Pull::Sum | Pull::Mean => summed,
        }
    }

    /// Returns the device of a peer along one axis, with the arm that holds the device. `place` is the index in [`Scene::peers`].
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    pub fn device_plant(&self, place: usize) -> Plant {
        let spec = &self.peers[place];
        spec.device.plant(spec.hand.as_ref())
    }

    /// Returns the copy of the object of a peer, with the damping of the coordination law. `place` is the index in [`Scene::peers`].
    ///
    /// # Panics
    ///
    /// If there is no such peer.
    #[must_use]
    pub fn copy_config(&self, place: usize) -> CopyConfig {
        CopyConfig { mass: self.copy_mass(), damping: self.object.damping + self.own_damping(place) }
    }

    /// Returns the initial state of a peer's copy on the first A axes. Axes beyond three are zero. `place` is the index in [`Scene::peers`].
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

impl Scaling {
    /// Returns the factor of the coordination gains for this number of peers: 4(N−1)/N² for [`Scaling::InverseN`].
    ///
    /// Over an ideal network the difference modes of average-position coordination with split mass have the squared frequency (N/mO)·KT·N/(N−1) (Rakhsha &
    /// Constantinescu 2015, equation 6). With the scaled gain the squared frequency is 4·KT/mO for every N.
    #[must_use]
    pub fn coordination_factor(self, peers: usize) -> f64 {
        let n = count(peers);
        match self {
            Self::None => 1.0,
            Self::InverseN => 4.0 * (n - 1.0) / (n * n),
        }
    }

    /// Returns the factor of the coupling gains for this number of peers: 2/N for [`Scaling::InverseN`].
    #[must_use]
    pub(crate) fn coupling_factor(self, peers: usize) -> f64 {
        match self {
            Self::None => 1.0,
            Self::InverseN => 2.0 / count(peers),
        }
    }
}

impl Scene {
    /// Returns the mass of each copy of the object \[kg\]. A server that alone has the object has the whole mass, also with `split-mass`.
    #[must_use]
    pub fn copy_mass(&self) -> f64 {
        // There is one copy where a server alone has the object.
        if self.object.split_mass && self.server().is_none() { self.object.mass / count(self.number()) } else { self.object.mass }
    }
}

#[expect(clippy::cast_precision_loss, reason = "the number of peers is far below 2^53")]
pub(crate) fn count(peers: usize) -> f64 {
    peers as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_peers_are_left_unchanged() {
        for scaling in [Scaling::None, Scaling::InverseN] {
            assert!((scaling.coordination_factor(2) - 1.0).abs() < f64::EPSILON);
            assert!((scaling.coupling_factor(2) - 1.0).abs() < f64::EPSILON);
        }
    }

    /// (N/m)·factor·N/(N−1) = 4/m: the coordination mode for every N has the frequency for N = 2.
    #[test]
    fn scaled_modes_have_one_frequency() {
        for peers in [2, 3, 5, 8, 50] {
            let n = count(peers);
            let stiffness = n * Scaling::InverseN.coordination_factor(peers) * n / (n - 1.0);
            assert!((stiffness - 4.0).abs() < 1e-12, "N = {peers}");
        }
    }
}
